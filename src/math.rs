//! Floating-point functions from `std` or from `libm`, chosen in this file alone.

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("fanlight needs the feature `std` or the feature `libm` for its floating-point functions");

/// Square root of a non-negative number. Without `std` by the machine's own instruction where that can be had: `libm`
/// has it behind a call, and loops over calls never become vectors.
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    #[cfg(feature = "std")]
    return x.sqrt();
    #[cfg(all(not(feature = "std"), target_arch = "x86_64", target_feature = "sse2"))]
    return crate::simd::sqrt(x);
    #[cfg(not(any(feature = "std", all(target_arch = "x86_64", target_feature = "sse2"))))]
    return libm::sqrtf(x);
}

/// Square root of a non-negative number, in double precision.
#[inline(always)]
pub(crate) fn sqrt64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.sqrt();
    #[cfg(not(feature = "std"))]
    return libm::sqrt(x);
}

/// Returns the largest integer that is not above a number, saturated to what the type holds. NaN becomes zero.
///
/// A cast and a comparison: the floor of a float is a function call on targets without an instruction for it.
#[inline(always)]
pub(crate) fn floor_to_i64(x: f64) -> i64 {
    let truncated = x as i64;
    truncated.saturating_sub(i64::from(x < truncated as f64))
}

/// Angle in `[-π/2, π/2]` whose sine is `x`, which is first clamped to `[-1, 1]`.
#[inline]
pub(crate) fn asin(x: f32) -> f32 {
    let x = x.clamp(-1.0, 1.0);
    #[cfg(feature = "std")]
    return x.asin();
    #[cfg(not(feature = "std"))]
    return libm::asinf(x);
}

/// [`asin`] in double precision.
#[inline]
pub(crate) fn asin64(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    #[cfg(feature = "std")]
    return x.asin();
    #[cfg(not(feature = "std"))]
    return libm::asin(x);
}

/// [`atan2`] in double precision.
#[inline]
pub(crate) fn atan2_64(y: f64, x: f64) -> f64 {
    #[cfg(feature = "std")]
    return y.atan2(x);
    #[cfg(not(feature = "std"))]
    return libm::atan2(y, x);
}

/// Exponential function, in double precision.
#[inline]
pub(crate) fn exp64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.exp();
    #[cfg(not(feature = "std"))]
    return libm::exp(x);
}

/// Logarithm of one more than a number, in double precision.
#[inline]
pub(crate) fn ln_1p64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.ln_1p();
    #[cfg(not(feature = "std"))]
    return libm::log1p(x);
}

/// Exponential function less one, in double precision.
#[inline]
pub(crate) fn exp_m1_64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.exp_m1();
    #[cfg(not(feature = "std"))]
    return libm::expm1(x);
}

/// Angle of the point `(x, y)` in `[-π, π]`.
#[inline]
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    #[cfg(feature = "std")]
    return y.atan2(x);
    #[cfg(not(feature = "std"))]
    return libm::atan2f(y, x);
}

/// Sine and cosine of an angle in radians.
#[inline]
pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
    #[cfg(feature = "std")]
    return x.sin_cos();
    #[cfg(not(feature = "std"))]
    return libm::sincosf(x);
}

/// Cosine of an angle in radians, in double precision.
#[inline]
pub(crate) fn cos64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.cos();
    #[cfg(not(feature = "std"))]
    return libm::cos(x);
}

/// Largest integer not above `x`, in double precision.
#[inline(always)]
pub(crate) fn floor64(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.floor();
    #[cfg(not(feature = "std"))]
    return libm::floor(x);
}

/// The larger of both, and `low` for NaN: a single instruction, unlike `f32::max`.
#[inline(always)]
pub(crate) fn at_least(x: f32, low: f32) -> f32 {
    if x > low { x } else { low }
}

/// The smaller of both, and `high` for NaN: a single instruction, unlike `f32::min`.
#[inline(always)]
pub(crate) fn at_most(x: f32, high: f32) -> f32 {
    if x < high { x } else { high }
}

/// `x` or zero, by its bits: what is written as a choice may become a branch.
#[inline(always)]
pub(crate) fn only_if(condition: bool, x: f32) -> f32 {
    f32::from_bits(x.to_bits() & u32::from(condition).wrapping_neg())
}

/// `x` limited to `[0, high]`; NaN becomes 0, unlike with `clamp`.
#[inline(always)]
pub(crate) fn limit(x: f32, high: f32) -> f32 {
    if x > 0.0 { x.min(high) } else { 0.0 }
}

/// `x` limited to `[0, high]`, in double precision; NaN becomes 0, unlike with `clamp`.
#[inline(always)]
pub(crate) fn limit64(x: f64, high: f64) -> f64 {
    if x > 0.0 { x.min(high) } else { 0.0 }
}
