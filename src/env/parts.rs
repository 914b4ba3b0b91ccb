//! Checking an environment that comes from elsewhere.

use super::pyramid::{children, level_start, parent_mean, parent_range};
use super::suns::{Sun, Suns, finest};
use super::texel::SunTexel;
use super::view::{EnvironmentHeader, EnvironmentView};
use super::{BRIGHTEST, DARKEST, MAX_DEPTH, rotation};
use crate::error::{Error, Kind};
use glam::Mat3;

/// What an environment consists of, all plain data: to be stored, mapped or uploaded.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentParts<'a> {
    /// The fixed part.
    pub header: EnvironmentHeader,
    /// Means of all levels of the pyramid, the coarsest first.
    pub means: &'a [f32],
    /// Minimum and maximum of all levels but the finest, the coarsest first, capped at the header's `cap`.
    pub ranges: &'a [[f32; 2]],
    /// 3x3 box-filtered means of all levels of the capped image, the coarsest first.
    pub filtered_means: &'a [f32],
    /// Clusters of texels above the cap.
    pub suns: &'a [Sun],
    /// The texels of all suns.
    pub sun_texels: &'a [SunTexel],
}

impl<'a> EnvironmentView<'a> {
    /// The parts that this environment borrows.
    pub fn parts(&self) -> EnvironmentParts<'a> {
        let Self { header, means, ranges, filtered, suns, sun_texels } = *self;
        EnvironmentParts { header, means, ranges, filtered_means: filtered, suns, sun_texels }
    }

    /// An environment from its [`parts`](Self::parts), which may have been stored or mapped.
    ///
    /// Everything is checked: the texels, that all other means and ranges are those of the texels, the suns and the
    /// rotation. What passes cannot make sampling panic.
    ///
    /// # Errors
    ///
    /// If anything does not hold what it should.
    pub fn from_parts(parts: EnvironmentParts<'a>) -> Result<Self, Error> {
        let EnvironmentParts { header, means, ranges, filtered_means: filtered, suns, sun_texels } = parts;
        let depth = header.depth;
        if depth > MAX_DEPTH {
            return Err(wrong("the environment's depth", 0, u64::from(depth), u64::from(MAX_DEPTH)));
        }
        let (inner, all) = (level_start(depth), level_start(depth + 1));
        for (what, found, expected) in [
            ("the number of means", means.len(), all),
            ("the number of ranges", ranges.len(), inner),
            ("the number of filtered means", filtered.len(), all),
        ] {
            if found != expected {
                return Err(wrong(what, 0, found as u64, expected as u64));
            }
        }
        // Negated, so that NaN fails too. Bits are named, as a value may be NaN.
        for (i, &v) in means[inner..].iter().enumerate() {
            if !(v == 0.0 || (DARKEST..=BRIGHTEST).contains(&v)) {
                return Err(wrong("a texel of the environment", inner + i, bits(v), bits(BRIGHTEST)));
            }
        }
        for (i, &v) in filtered.iter().enumerate() {
            if !(0.0..=BRIGHTEST).contains(&v) {
                return Err(wrong("a filtered mean", i, bits(v), bits(BRIGHTEST)));
            }
        }
        check_suns(&header, finest(depth, means), suns, sun_texels)?;
        check_levels(depth, means, ranges, header.cap)?;
        let max = finest(depth, means).iter().copied().fold(0.0, f32::max);
        for (what, found, expected) in [("the mean", header.mean, means[0]), ("the maximum", header.max, max)] {
            if found != expected {
                return Err(wrong(what, 0, bits(found), bits(expected)));
            }
        }
        let matrix = Mat3::from_cols_array_2d(&header.rotation);
        if rotation::checked(matrix)? != header.rotation {
            return Err(Error(Kind::Rotation { determinant: matrix.determinant() }));
        }
        Ok(Self { header, means, ranges, filtered, suns, sun_texels })
    }
}

/// Whether the suns are those of the image.
fn check_suns(header: &EnvironmentHeader, image: &[f32], suns: &[Sun], sun_texels: &[SunTexel]) -> Result<(), Error> {
    let expected = if header.depth == 0 { Suns::none() } else { Suns::find(header.depth, image) };
    if header.cap.to_bits() != expected.cap.to_bits() {
        return Err(wrong("the cap of the radiance", 0, bits(header.cap), bits(expected.cap)));
    }
    if suns != expected.suns || sun_texels != expected.texels {
        return Err(wrong("the number of suns, or one of them,", 0, suns.len() as u64, expected.suns.len() as u64));
    }
    Ok(())
}

/// Whether every texel of the inner levels has the mean and range of the four below.
fn check_levels(depth: u32, means: &[f32], ranges: &[[f32; 2]], cap: f32) -> Result<(), Error> {
    for d in (0..depth).rev() {
        for y in 0..1_u32 << d {
            for x in 0..1_u32 << d {
                let at = level_start(d) + ((y << d) | x) as usize;
                let below = children(means, d, x, y);
                if means[at] != parent_mean(below) {
                    return Err(wrong("a mean", at, bits(means[at]), bits(parent_mean(below))));
                }
                let below = if d + 1 == depth { below.map(|v| [v.min(cap); 2]) } else { children(ranges, d, x, y) };
                let expected = parent_range(below);
                for (found, expected) in ranges[at].into_iter().zip(expected) {
                    if found != expected {
                        return Err(wrong("a range", at, bits(found), bits(expected)));
                    }
                }
            }
        }
    }
    Ok(())
}

fn bits(value: f32) -> u64 {
    u64::from(value.to_bits())
}

fn wrong(what: &'static str, at: usize, found: u64, expected: u64) -> Error {
    Error(Kind::Bytes { what, at, found, expected })
}
