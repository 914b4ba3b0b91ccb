//! The random numbers that all workloads are drawn from.

use core::f64::consts::TAU;

use glam::DVec3;
use rand_pcg::rand_core::Rng;

/// PCG32, XSH-RR 64/32 (O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms
/// for Random Number Generation"), with what the workloads draw from it.
pub(crate) struct Pcg32(rand_pcg::Pcg32);

impl Pcg32 {
    /// A generator in its reference initialization.
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        Self(rand_pcg::Pcg32::new(seed, sequence))
    }

    /// 32 random bits.
    pub(crate) fn bits(&mut self) -> u32 {
        self.0.next_u32()
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
