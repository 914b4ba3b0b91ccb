//! Random numbers.

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

pub(crate) struct Random(Pcg32);

impl Random {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self(Pcg32::new(seed, stream))
    }

    /// Numbers from 0 to 1, without 1.
    pub(crate) fn take<const N: usize>(&mut self) -> [f32; N] {
        core::array::from_fn(|_| (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32)
    }
}
