//! What the unit tests share: a random number generator and the statistics that judge a sampler.

/// PCG32 (O'Neill 2014), XSH-RR 64/32.
pub(crate) struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// The reference initialization: `(42, 54)` gives `a15c02b7 7b47f409 ba1d3330`.
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        let mut pcg = Self { state: 0, increment: (sequence << 1) | 1 };
        pcg.next_u32();
        pcg.state = pcg.state.wrapping_add(seed);
        pcg.next_u32();
        pcg
    }

    pub(crate) fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in `[0, 1)`, a multiple of 2^-24.
    pub(crate) fn next_f32(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Below `n`, with a bias that no test here could see.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(n)) >> 32) as u32
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> glam::Vec3 {
        let z = 1.0 - 2.0 * self.next_f32();
        let (sin, cos) = (core::f32::consts::TAU * self.next_f32()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        glam::Vec3::new(radius * cos, radius * sin, z)
    }
}

/// Value that a chi-square variable exceeds with probability 1e-4 (Wilson and Hilferty's approximation).
pub(crate) fn chi_square_limit(degrees: usize) -> f64 {
    let d = degrees as f64;
    let c = 2.0 / (9.0 * d);
    d * (1.0 - c + 3.719 * c.sqrt()).powi(3)
}

/// Chi-square statistic and degrees of freedom of `observed` against `expected` counts of the same total.
///
/// Cells that expect fewer than five are pooled; a hit in a cell that expects none makes it infinite.
pub(crate) fn chi_square(observed: &[f64], expected: &[f64]) -> (f64, usize) {
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        if e == 0.0 {
            if o > 0.0 {
                return (f64::INFINITY, 1);
            }
        } else if e < 5.0 {
            pooled_observed += o;
            pooled_expected += e;
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pooled_expected > 0.0 {
        statistic += (pooled_observed - pooled_expected) * (pooled_observed - pooled_expected) / pooled_expected;
        cells += 1;
    }
    (statistic, cells.max(2) - 1)
}

#[test]
fn pcg32_matches_its_reference() {
    let mut pcg = Pcg32::new(42, 54);
    assert_eq!([pcg.next_u32(), pcg.next_u32(), pcg.next_u32()], [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
}
