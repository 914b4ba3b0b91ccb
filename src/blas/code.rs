//! Averages as single bytes: floating-point numbers of five bits of exponent and three of mantissa.
//!
//! A descent only compares cells of one node, so that a relative error is what counts: at most 1/17, which costs a
//! relative variance of less than 0.001 a level.

/// Bits of an `f32` below those that a code holds. *Format*.
const CODE_SHIFT: u32 = 20;

/// *Format*: added to a code, it makes the leading bits of an `f32` from 2^-31 to 1.875.
const CODE_OFFSET: u32 = 96 << 3;

/// What the largest code, 255, stands for. *Format*.
pub(crate) const LARGEST_VALUE: f32 = 1.875;

/// What a code stands for. Zero is exactly that.
#[inline(always)]
pub(crate) fn decode(code: u8) -> f32 {
    let value = f32::from_bits((u32::from(code) + CODE_OFFSET) << CODE_SHIFT);
    if code == 0 { 0.0 } else { value }
}

/// The nearest code of a value from 0 to [`LARGEST_VALUE`]. Only zero becomes 0: the least positive code stands for all
/// that is smaller, too.
pub(crate) fn encode(value: f32) -> u8 {
    if value > 0.0 {
        let nearest = (value.to_bits() + (1 << (CODE_SHIFT - 1))) >> CODE_SHIFT;
        nearest.saturating_sub(CODE_OFFSET).clamp(1, 255) as u8
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_stand_for_themselves() {
        for code in 0..=255 {
            assert_eq!(encode(decode(code)), code);
        }
        assert_eq!(decode(255), LARGEST_VALUE);
    }

    #[test]
    fn the_nearest_code_is_near() {
        let mut value = LARGEST_VALUE;
        while value > 1e-9 {
            assert!((decode(encode(value)) / value - 1.0).abs() <= 1.0 / 16.0, "{value}");
            value *= 0.997;
        }
    }

    #[test]
    fn nothing_positive_becomes_zero() {
        assert_eq!(encode(0.0), 0);
        assert_eq!(encode(-0.0), 0);
        for tiny in [1e-45, f32::MIN_POSITIVE, 1e-20, 4e-10] {
            assert_eq!(encode(tiny), 1);
        }
        assert_eq!(encode(f32::MAX), 255);
    }
}
