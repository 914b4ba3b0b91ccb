//! Means and how far they can be trusted.

/// Quantiles of Student's t distribution for a two-sided interval of 95 %, by degrees of freedom from 1. *Format*.
const STUDENT: [f64; 15] =
    [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131];

/// Smallest error that a figure is made of: an image may by chance be nearer to a noisy reference than that is to the
/// truth. *Format*.
const SMALLEST: f64 = 1e-9;

/// A geometric mean with its 95 % interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ratio {
    pub(crate) mean: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Returns the geometric mean.
pub(crate) fn geometric_mean(values: &[f64]) -> f64 {
    (values.iter().map(|value| value.max(SMALLEST).ln()).sum::<f64>() / values.len() as f64).exp()
}

/// Returns the geometric mean of the ratios of two lists.
pub(crate) fn ratio(numerators: &[f64], denominators: &[f64]) -> Ratio {
    let ratios = numerators.iter().zip(denominators);
    let logs: Vec<f64> = ratios.map(|(n, d)| (n.max(SMALLEST) / d.max(SMALLEST)).ln()).collect();
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let half = match logs.len() {
        0 | 1 => f64::INFINITY,
        n => STUDENT.get(n - 2).copied().unwrap_or(2.0) * (variance / count).sqrt(),
    };
    Ratio { mean: mean.exp(), low: (mean - half).exp(), high: (mean + half).exp() }
}

/// Returns the median.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::{geometric_mean, median, ratio};

    #[test]
    fn interval_is_around_the_mean_of_ratios() {
        assert!((geometric_mean(&[1.0, 4.0, 16.0]) - 4.0).abs() < 1e-12);
        let found = ratio(&[2.0, 8.0], &[1.0, 1.0]);
        assert!((found.mean - 4.0).abs() < 1e-12);
        // The logarithms deviate by ln 2 each: s = √2 ln 2, the standard error ln 2.
        assert!((found.high.ln() - found.mean.ln() - 12.706 * 2.0_f64.ln()).abs() < 1e-9);
        assert!((median(vec![3.0, 1.0, 2.0]) - 2.0).abs() < 1e-12);
    }
}
