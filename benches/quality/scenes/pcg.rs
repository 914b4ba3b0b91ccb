//! The random numbers that all workloads are drawn from.

use core::f64::consts::TAU;

use glam::DVec3;

/// PCG32, XSH-RR 64/32 (O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms
/// for Random Number Generation").
pub(crate) struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// A generator in its reference initialisation.
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        let mut pcg = Self { state: 0, increment: (sequence << 1) | 1 };
        pcg.bits();
        pcg.state = pcg.state.wrapping_add(seed);
        pcg.bits();
        pcg
    }

    /// 32 random bits.
    pub(crate) fn bits(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in `[0, 1)`, a multiple of 2^-24.
    pub(crate) fn f(&mut self) -> f64 {
        f64::from(self.bits() >> 8) * (1.0 / 16_777_216.0)
    }

    /// What a sampler is fed with.
    pub(crate) fn uniform3(&mut self) -> [f32; 3] {
        core::array::from_fn(|_| self.f() as f32)
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * self.f();
        let (sin, cos) = (TAU * self.f()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }
}
