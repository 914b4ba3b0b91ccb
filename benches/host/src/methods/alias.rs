//! Choice among many, in constant time.

/// An alias table (Vose 1991, "A Linear Algorithm for Generating Random Numbers with a Given Distribution").
#[derive(Clone, Debug)]
pub(super) struct AliasTable {
    /// For each entry the share of its column that is its own, and whose the rest is.
    columns: Vec<(f32, u32)>,
}

impl AliasTable {
    /// Builds the table for weights whose sum is positive.
    pub(super) fn new(weights: &[f64]) -> Self {
        let scale = weights.len() as f64 / weights.iter().sum::<f64>();
        let mut rest: Vec<f64> = weights.iter().map(|weight| weight * scale).collect();
        let mut columns: Vec<(f32, u32)> = (0..weights.len() as u32).map(|i| (1.0, i)).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..rest.len()).partition(|&i| rest[i] < 1.0);
        while let (Some(&poor), Some(&rich)) = (small.last(), large.last()) {
            small.pop();
            columns[poor] = (rest[poor] as f32, rich as u32);
            rest[rich] -= 1.0 - rest[poor];
            if rest[rich] < 1.0 {
                large.pop();
                small.push(rich);
            }
        }
        Self { columns }
    }

    /// Draws an entry with a probability in proportion to its weight.
    #[inline]
    pub(super) fn sample(&self, u: f32) -> usize {
        let scaled = u * self.columns.len() as f32;
        let column = (scaled as usize).min(self.columns.len() - 1);
        let (own, other) = self.columns[column];
        if scaled - (column as f32) < own { column } else { other as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::AliasTable;

    #[test]
    fn entries_are_drawn_by_weight() {
        let weights = [1.0, 0.0, 5.0, 2.0];
        let table = AliasTable::new(&weights);
        let mut counts = [0; 4];
        let draws = 80_000;
        for i in 0..draws {
            counts[table.sample((i as f32 + 0.5) / draws as f32)] += 1;
        }
        for (count, weight) in counts.into_iter().zip(weights) {
            assert!((f64::from(count) - weight * 10_000.0).abs() < 4.0, "{counts:?}");
        }
    }
}
