//! PCG32 (O'Neill 2014), XSH-RR 64/32.

use glam::{Mat3, Vec3};

pub(crate) struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// The reference initialisation: `(42, 54)` gives `a15c02b7 7b47f409 ba1d3330`.
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        let mut pcg = Self { state: 0, increment: (sequence << 1) | 1 };
        pcg.u32();
        pcg.state = pcg.state.wrapping_add(seed);
        pcg.u32();
        assert!(seed != 42 || sequence != 54 || pcg.clone_first() == 0xa15c_02b7);
        pcg
    }

    fn clone_first(&self) -> u32 {
        Self { state: self.state, increment: self.increment }.u32()
    }

    pub(crate) fn u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
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
