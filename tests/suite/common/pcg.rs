//! Random numbers.

use glam::{Mat3, Vec3};
use rand_pcg::rand_core::Rng;

/// PCG32 (O'Neill 2014), XSH-RR 64/32, with what the tests draw from it.
#[derive(Clone)]
pub(crate) struct Pcg32(rand_pcg::Pcg32);

impl Pcg32 {
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        Self(rand_pcg::Pcg32::new(seed, sequence))
    }

    pub(crate) fn u32(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// Uniform in `[0, 1)`, a multiple of 2^-24.
    pub(crate) fn f32(&mut self) -> f32 {
        (self.u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in an interval.
    pub(crate) fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.f32()
    }

    /// Uniform among `0..count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u64::from(self.u32()) * count as u64) >> 32) as usize
    }

    /// Uniform in the unit cube.
    pub(crate) fn cube(&mut self) -> [f32; 3] {
        [self.f32(), self.f32(), self.f32()]
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.f32();
        let (sin, cos) = (core::f32::consts::TAU * self.f32()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * cos, radius * sin, z).normalize()
    }

    /// Some rotation.
    pub(crate) fn rotation(&mut self) -> Mat3 {
        let axis = self.direction();
        Mat3::from_axis_angle(axis, self.within(0.0, core::f32::consts::TAU))
    }
}

/// The reference's own check: whatever is drawn elsewhere follows from these bits.
#[test]
fn random_numbers_are_those_of_the_reference() {
    let mut pcg = Pcg32::new(42, 54);
    assert_eq!([pcg.u32(), pcg.u32(), pcg.u32()], [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
}
