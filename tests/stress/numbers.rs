//! Random numbers at their limits.

/// Ends of the range, denormals, and what is no uniform number at all.
pub(crate) const HOSTILE: [f32; 8] =
    [0.0, -0.0, 1.0 - f32::EPSILON / 2.0, 1e-45, f32::MIN_POSITIVE, 0.5, 0.5 - f32::EPSILON / 4.0, 1e-7];
