//! The statistics that judge a sampler.

use core::fmt::Write;

/// Significance of each of `count` tests so that all together have the significance `alpha` (Šidák).
pub(crate) fn sidak(alpha: f64, count: usize) -> f64 {
    -((-alpha).ln_1p() / count as f64).exp_m1()
}

/// Logarithm of the gamma function (Lanczos, g = 7).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C.iter().enumerate().skip(1).fold(C[0], |sum, (i, c)| sum + c / (x + i as f64));
    0.5 * core::f64::consts::TAU.ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Regularised upper incomplete gamma function Q(a, x).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    // Lentz's continued fraction.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..100_000 {
        let i = f64::from(i);
        let an = -i * (i - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    front * h
}

/// Probability that a chi-square variable exceeds `statistic`.
pub(crate) fn chi_square_p(statistic: f64, degrees: usize) -> f64 {
    upper_gamma(0.5 * degrees as f64, 0.5 * statistic)
}

/// p-value of observed against expected counts of the same total, and a table of the worst cells.
///
/// Cells that expect fewer than five are pooled; a hit in a cell that expects nothing gives 0.
pub(crate) fn chi_square(observed: &[f64], expected: &[f64]) -> (f64, String) {
    assert_eq!(observed.len(), expected.len());
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pool_o, mut pool_e) = (0.0, 0.0);
    let mut terms = Vec::new();
    for (i, (&o, &e)) in observed.iter().zip(expected).enumerate() {
        if e <= 0.0 {
            if o > 0.0 {
                return (0.0, format!("cell {i}: {o} samples where none can be"));
            }
        } else if e < 5.0 {
            pool_o += o;
            pool_e += e;
        } else {
            let term = (o - e) * (o - e) / e;
            terms.push((term, i, o, e));
            statistic += term;
            cells += 1;
        }
    }
    if pool_e > 1.0 {
        statistic += (pool_o - pool_e) * (pool_o - pool_e) / pool_e;
        cells += 1;
    } else if pool_o > 40.0 {
        return (0.0, format!("{pool_o} samples in cells that expect {pool_e} together"));
    }
    terms.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut dump = format!("chi-square {statistic:.2} over {cells} cells, pooled {pool_o} expected {pool_e:.2}\n");
    for (term, i, o, e) in terms.iter().take(20) {
        writeln!(dump, "  cell {i}: observed {o}, expected {e:.2}, term {term:.2}").expect("a string can grow");
    }
    (if cells < 2 { 1.0 } else { chi_square_p(statistic, cells - 1) }, dump)
}

/// Bound on the probability that a binomial count is at least as far off its mean, to the same side or the other, as
/// `count` of `n` trials (Chernoff). It holds for every `n` and `p`.
pub(crate) fn binomial_p(count: f64, n: f64, p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return if (p - 1.0).abs() < 1e-5 && count == n { 1.0 } else { 0.0 };
    }
    let q = count / n;
    let term = |a: f64, b: f64| match (a > 0.0, b > 0.0) {
        (false, _) => 0.0,
        (true, false) => f64::INFINITY,
        (true, true) => a * (a / b).ln(),
    };
    let divergence = term(q, p) + term(1.0 - q, 1.0 - p);
    (2.0 * (-n * divergence).exp()).min(1.0)
}

/// Mean and the standard error of the mean of numbers that come one by one.
#[derive(Default)]
pub(crate) struct Mean {
    n: f64,
    mean: f64,
    m2: f64,
}

impl Mean {
    pub(crate) fn add(&mut self, x: f64) {
        self.n += 1.0;
        let delta = x - self.mean;
        self.mean += delta / self.n;
        self.m2 += delta * (x - self.mean);
    }

    pub(crate) fn mean(&self) -> f64 {
        self.mean
    }

    pub(crate) fn error(&self) -> f64 {
        (self.m2 / (self.n * (self.n - 1.0))).sqrt()
    }
}
