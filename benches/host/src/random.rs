//! The random numbers that scenes are made from and paths are drawn with.

/// The multiplier of the underlying generator; *format*, from O'Neill 2014.
const MULTIPLIER: u64 = 6_364_136_223_846_793_005;

/// PCG32, XSH-RR 64/32 (O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
/// Random Number Generation").
#[derive(Clone, Debug)]
pub(crate) struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// Returns a generator in its reference initialization.
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        let mut pcg = Self { state: 0, increment: (sequence << 1) | 1 };
        pcg.bits();
        pcg.state = pcg.state.wrapping_add(seed);
        pcg.bits();
        pcg
    }

    /// Draws 32 bits.
    #[inline]
    pub(crate) fn bits(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Draws a uniform number in `[0, 1)`, a multiple of 2^-24.
    #[inline]
    pub(crate) fn f(&mut self) -> f64 {
        f64::from(self.bits() >> 8) * (1.0 / 16_777_216.0)
    }

    /// Draws a uniform number in `[0, 1)` in single precision.
    #[inline]
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.bits() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Draws a uniform point of the unit square.
    #[inline]
    pub(crate) fn uniform2(&mut self) -> [f32; 2] {
        core::array::from_fn(|_| self.uniform())
    }

    /// Draws a uniform point of the unit cube.
    #[inline]
    pub(crate) fn uniform3(&mut self) -> [f32; 3] {
        core::array::from_fn(|_| self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::Pcg32;

    #[test]
    fn first_bits_are_those_of_the_reference() {
        let mut pcg = Pcg32::new(42, 54);
        assert_eq!([(); 3].map(|()| pcg.bits()), [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
    }
}
