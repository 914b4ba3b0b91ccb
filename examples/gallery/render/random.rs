//! Random numbers.

use rand_pcg::{Pcg32, rand_core::Rng};

/// Uniform random numbers in [0, 1).
pub(crate) struct Random(Pcg32);

impl Random {
    /// One of 2⁶³ independent streams.
    pub(crate) fn new(state: u64, stream: u64) -> Self {
        Self(Pcg32::new(state, stream))
    }

    /// The next `N` numbers.
    pub(crate) fn take<const N: usize>(&mut self) -> [f32; N] {
        core::array::from_fn(|_| self.one())
    }

    /// One number.
    pub(crate) fn one(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32
    }
}
