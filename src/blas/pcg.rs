//! The random numbers of the tests: PCG32 (O'Neill 2014, XSH RR).

pub(crate) struct Pcg {
    state: u64,
    increment: u64,
}

impl Pcg {
    pub(crate) fn new(seed: u64, sequence: u64) -> Self {
        let mut rng = Self { state: 0, increment: (sequence << 1) | 1 };
        rng.u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.u32();
        rng
    }

    pub(crate) fn u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// Below `n`, with a bias that no test here could see.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.u32()) * u64::from(n)) >> 32) as u32
    }

    /// In `[0, 1)`.
    pub(crate) fn f32(&mut self) -> f32 {
        (self.u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

#[test]
fn known_numbers() {
    let mut rng = Pcg::new(42, 54);
    assert_eq!([rng.u32(), rng.u32(), rng.u32()], [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
}
