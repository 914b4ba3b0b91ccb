//! Densities in single precision.

/// Returns a positive density in single precision: what is positive in double precision stays so.
pub(super) fn to_positive(pdf: f64) -> f32 {
    (pdf as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// Returns a density in single precision: zero stays zero, and nothing overflows or vanishes.
pub(super) fn to_finite(pdf: f64) -> f32 {
    if pdf > 0.0 { to_positive(pdf) } else { 0.0 }
}
