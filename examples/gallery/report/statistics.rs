//! Ratios of several images: their geometric mean, and how well it is known.

/// Quantiles of Student's t distribution for intervals of 95 %, by the degrees of freedom from 1. *Format.*
const T: [f64; 15] =
    [12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131];

/// Geometric mean of positive numbers.
pub(super) fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    Logarithms::new(values).mean()
}

/// Positive numbers as their logarithms.
pub(super) struct Logarithms(Vec<f64>);

impl Logarithms {
    pub(super) fn new(values: impl Iterator<Item = f64>) -> Self {
        Self(values.map(f64::ln).collect())
    }

    /// The geometric mean.
    pub(super) fn mean(&self) -> f64 {
        self.logarithm().exp()
    }

    /// An interval that holds the true geometric mean with 95 %, if there are at least two numbers.
    pub(super) fn interval(&self) -> Option<[f64; 2]> {
        let freedom = self.0.len().checked_sub(1).filter(|&freedom| freedom > 0)?;
        let mean = self.logarithm();
        let variance = self.0.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / freedom as f64;
        let half = T[freedom.min(T.len()) - 1] * (variance / self.0.len() as f64).sqrt();
        Some([mean - half, mean + half].map(f64::exp))
    }

    fn logarithm(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }
}
