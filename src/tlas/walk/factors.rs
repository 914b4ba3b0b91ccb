//! Factors of the children of a node, each in a byte.

/// Number of factors of a node: lanes of the widest tree. *Format*.
pub(crate) const FACTORS: usize = 16;

/// Bytes that stand for factors.
pub(crate) type FactorBytes = [u8; FACTORS];

/// Returns the factor in `(0, 1]` that a byte stands for: finest near zero, and never zero.
#[inline(always)]
pub(crate) fn factor(byte: u8) -> f32 {
    let root = (f32::from(byte) + 1.0) * (1.0 / 256.0);
    root * root
}
