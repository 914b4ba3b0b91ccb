//! Values from a fuzzer's bytes.

use glam::Vec3;

/// Reads a string of bytes from front to back; zeros once it is used up.
pub(crate) struct Reader<'a> {
    data: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { data }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    pub(crate) fn byte(&mut self) -> u8 {
        match self.data.split_first() {
            Some((first, rest)) => {
                self.data = rest;
                *first
            }
            None => 0,
        }
    }

    /// A number below a limit.
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        usize::from(self.byte()) % limit
    }

    pub(crate) fn bits(&mut self) -> u32 {
        u32::from_le_bytes([(); 4].map(|()| self.byte()))
    }

    /// A float: most often a multiple of 1/16, so that values meet; sometimes a limit; sometimes any bits at all.
    pub(crate) fn float(&mut self) -> f32 {
        const LIMITS: [f32; 16] = [
            0.0,
            -0.0,
            f32::MIN_POSITIVE,
            1e-45,
            -1e-45,
            1e-6,
            1e6,
            1e9,
            -1e9,
            1e30,
            f32::MAX,
            f32::INFINITY,
            f32::NAN,
            1.0 - f32::EPSILON / 2.0,
            1.0 + f32::EPSILON,
            1e10,
        ];
        match self.byte() {
            byte @ 0..=15 => LIMITS[usize::from(byte)],
            16..=31 => f32::from_bits(self.bits()),
            32..=63 => self.bits() as f32 / u32::MAX as f32,
            _ => f32::from(self.byte() as i8) / 16.0,
        }
    }

    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }

    pub(crate) fn floats(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.float()).collect()
    }
}
