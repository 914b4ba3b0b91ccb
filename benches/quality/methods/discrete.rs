//! Choices among a fixed set.

/// Alias table (Vose 1991): a choice in constant time.
pub(crate) struct AliasTable {
    /// Share of a column that is its own, the other entry in it, and the probability of the entry.
    columns: Vec<(f32, u32, f32)>,
}

impl AliasTable {
    pub(crate) fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let scale = weights.len() as f64 / total;
        let mut rest: Vec<f64> = weights.iter().map(|weight| weight * scale).collect();
        let mut columns: Vec<(f32, u32, f32)> =
            weights.iter().zip(0..).map(|(weight, i)| (1.0, i, (weight / total) as f32)).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..weights.len()).partition(|&i| rest[i] < 1.0);
        while let (Some(low), Some(high)) = (small.pop(), large.pop()) {
            columns[low].0 = rest[low] as f32;
            columns[low].1 = high as u32;
            rest[high] -= 1.0 - rest[low];
            if rest[high] < 1.0 { &mut small } else { &mut large }.push(high);
        }
        Self { columns }
    }

    /// An entry and its probability.
    pub(crate) fn sample(&self, u: f32) -> (usize, f64) {
        let at = f64::from(u) * self.columns.len() as f64;
        let column = (at as usize).min(self.columns.len() - 1);
        let (own, alias, _) = self.columns[column];
        let entry = if at - (column as f64) < f64::from(own) { column } else { alias as usize };
        (entry, self.pmf(entry))
    }

    pub(crate) fn pmf(&self, entry: usize) -> f64 {
        f64::from(self.columns[entry].2)
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.columns[..])
    }
}

/// A cumulative table that is searched.
pub(crate) struct Cumulative {
    sums: Vec<f64>,
}

impl Cumulative {
    pub(crate) fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |weight| {
            sum += weight;
            sum
        };
        Self { sums: weights.map(add).collect() }
    }

    pub(crate) fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The entry that `u` falls into.
    pub(crate) fn sample(&self, u: f32) -> usize {
        let at = f64::from(u) * self.total();
        self.sums.partition_point(|sum| *sum <= at).min(self.sums.len() - 1)
    }

    pub(crate) fn pmf(&self, entry: usize) -> f64 {
        let before = if entry == 0 { 0.0 } else { self.sums[entry - 1] };
        (self.sums[entry] - before) / self.total()
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.sums[..])
    }
}
