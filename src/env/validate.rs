//! Checking an environment that comes from elsewhere.

use super::feature_texel::FeatureTexel;
use super::features::{BrightFeature, MAX_FEATURES, finest};
use super::pyramid::{children, level_start, parent_mean, parent_range};
use super::view::{EnvironmentHeader, EnvironmentView};
use super::{MAX_PYRAMID_DEPTH, MAX_RADIANCE, MIN_RADIANCE, rotation};
use crate::buffers::{Section, Sections};
use crate::error::{Error, ErrorKind};
use alloc::vec::Vec;
use glam::{Mat3, Vec3};

/// Tag and version of the section that holds the [`EnvironmentHeader`].
const HEADER: ([u8; 4], u32) = (*b"EHDR", 1);

impl<'a> EnvironmentView<'a> {
    /// Appends the sections of the environment. `header` is its own header, which has to outlive them.
    pub(crate) fn append_all_sections(&self, header: &'a [EnvironmentHeader; 1], sections: &mut Vec<Section<'a>>) {
        sections.push(Section::new(HEADER.0, HEADER.1, header));
        self.append_sections(sections);
    }

    /// Borrows an environment from its sections, and checks it.
    ///
    /// # Errors
    ///
    /// If a section is missing or does not hold what it should.
    pub(crate) fn from_all_sections(sections: &mut Sections<'a>) -> Result<Self, Error> {
        let header = sections.take_value(HEADER.0, HEADER.1, "header of the environment")?;
        let environment = Self::from_sections(sections, header)?;
        environment.validate()?;
        Ok(environment)
    }

    /// Checks that all numbers are in range, that means and ranges are those of the texels, and that the bright
    /// features refer to their texels. Which texels are bright features is up to the version that built the
    /// environment. What passes cannot make sampling panic or return NaN.
    ///
    /// # Errors
    ///
    /// If a part does not hold what it should.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        let Self { header, means, ranges, filtered, features, feature_texels } = *self;
        let depth = header.depth;
        if depth > MAX_PYRAMID_DEPTH {
            return Err(wrong("the environment's depth", 0, u64::from(depth), u64::from(MAX_PYRAMID_DEPTH)));
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
            if !(v == 0.0 || (MIN_RADIANCE..=MAX_RADIANCE).contains(&v)) {
                return Err(wrong("a texel of the environment", inner + i, bits(v), bits(MAX_RADIANCE)));
            }
        }
        for (i, &v) in filtered.iter().enumerate() {
            if !(0.0..=MAX_RADIANCE).contains(&v) {
                return Err(wrong("a filtered mean", i, bits(v), bits(MAX_RADIANCE)));
            }
        }
        check_features(&header, features, feature_texels)?;
        check_levels(depth, means, ranges, header.cap)?;
        let max = finest(depth, means).iter().copied().fold(0.0, f32::max);
        for (what, found, expected) in [("the mean", header.mean, means[0]), ("the maximum", header.max, max)] {
            if found != expected {
                return Err(wrong(what, 0, bits(found), bits(expected)));
            }
        }
        let matrix = Mat3::from_cols_array_2d(&header.rotation);
        if rotation::checked(matrix)? != header.rotation {
            return Err(Error(ErrorKind::Rotation { determinant: matrix.determinant() }));
        }
        Ok(())
    }
}

/// Relative difference granted to sums that another version may have added up in another order. *Proved*: sums of
/// 256 texels, each rounded to `f32`, differ by less than 256 units in the last place, 3.1e-5.
///
/// Larger: densities of forged bytes may be off by as much. Smaller: bytes of another version could be refused.
const SUM_TOLERANCE: f64 = 1e-3;

/// Bound on the components of a texel's center and sides, and on its margin and radius. *Proved*: two points of the
/// unit sphere are at most 2 apart, a margin grants a quarter more, and a radius is at most both.
const MAX_EXTENT: f32 = 8.0;

/// Checks that the bright features can be sampled: that their numbers are in range, and that their sums are those of
/// their texels.
fn check_features(
    header: &EnvironmentHeader,
    features: &[BrightFeature],
    texels: &[FeatureTexel],
) -> Result<(), Error> {
    if features.len() > MAX_FEATURES {
        return Err(wrong("the number of bright features", 0, features.len() as u64, MAX_FEATURES as u64));
    }
    // Only bright features explain why an image is capped.
    if !(header.cap > 0.0) || features.is_empty() != (header.cap == f32::INFINITY) {
        return Err(wrong("the cap of the radiance", 0, bits(header.cap), bits(f32::INFINITY)));
    }
    let mut end = 0;
    for (i, feature) in features.iter().enumerate() {
        let &BrightFeature { axis, sin_radius, power, range, level } = feature;
        let [start, stop] = range.map(|at| at as usize);
        if start != end || stop <= start || stop > texels.len() {
            return Err(wrong("the texels of a bright feature", i, u64::from(range[1]), texels.len() as u64));
        }
        end = stop;
        if level > header.depth {
            return Err(wrong("the level of a bright feature", i, u64::from(level), u64::from(header.depth)));
        }
        let length = Vec3::from_array(axis).length();
        if !((length - 1.0).abs() <= 1e-3) {
            return Err(wrong("the axis of a bright feature", i, bits(length), bits(1.0)));
        }
        if !(sin_radius > 0.0 && sin_radius <= 1.0) {
            return Err(wrong("the radius of a bright feature", i, bits(sin_radius), bits(1.0)));
        }
        let texels = &texels[start..stop];
        check_texels(level, texels)?;
        let excess = texels.iter().map(|texel| f64::from(texel.excess)).sum::<f64>();
        let expected = excess * f64::from(feature.texel_solid_angle());
        let power_range = f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX);
        if !(power_range.contains(&f64::from(power)) && is_close(f64::from(power), expected, expected)) {
            return Err(wrong("the power of a bright feature", i, bits(power), bits(expected as f32)));
        }
        let mut sum = 0.0;
        for (at, texel) in texels.iter().enumerate() {
            sum += f64::from(texel.excess);
            if !is_close(f64::from(texel.sum), sum / excess, 1.0) {
                return Err(wrong("the sum of a bright texel", start + at, bits(texel.sum), bits(1.0)));
            }
        }
    }
    if end != texels.len() {
        return Err(wrong("the number of bright texels", 0, texels.len() as u64, end as u64));
    }
    Ok(())
}

/// Checks the texels of one bright feature.
fn check_texels(level: u32, texels: &[FeatureTexel]) -> Result<(), Error> {
    let count = 1_u32 << (2 * level);
    let mut before: Option<&FeatureTexel> = None;
    for (i, texel) in texels.iter().enumerate() {
        let &FeatureTexel { texel: number, sum, excess, margin, radius, center, sides } = texel;
        if number >= count || before.is_some_and(|before| before.texel >= number) {
            return Err(wrong("the number of a bright texel", i, u64::from(number), u64::from(count)));
        }
        if !(sum >= before.map_or(0.0, |before| before.sum) && sum <= 1.0) {
            return Err(wrong("the sum of a bright texel", i, bits(sum), bits(1.0)));
        }
        if !(0.0..=MAX_RADIANCE).contains(&excess) {
            return Err(wrong("the excess of a bright texel", i, bits(excess), bits(MAX_RADIANCE)));
        }
        if ![margin, radius].iter().all(|extent| (0.0..=MAX_EXTENT).contains(extent)) {
            return Err(wrong("the margin of a bright texel", i, bits(margin), bits(MAX_EXTENT)));
        }
        if !center.iter().chain(sides.as_flattened()).all(|component| component.abs() <= MAX_EXTENT) {
            return Err(wrong("the place of a bright texel", i, bits(center[0]), bits(MAX_EXTENT)));
        }
        before = Some(texel);
    }
    // The last sum is exact: no variate is above it.
    match before {
        Some(last) if last.sum == 1.0 => Ok(()),
        _ => Err(wrong("the sum of a bright texel", texels.len(), 0, bits(1.0))),
    }
}

/// Whether two sums agree, but for the order in which they were added up.
fn is_close(found: f64, expected: f64, scale: f64) -> bool {
    (found - expected).abs() <= SUM_TOLERANCE * scale
}

/// Checks that every texel of the inner levels has the mean and range of the four below.
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
    Error(ErrorKind::Bytes { what, at, found, expected })
}
