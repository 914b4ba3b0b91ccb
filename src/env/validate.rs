//! Checking an environment that comes from elsewhere.

use super::feature_texel::FeatureTexel;
use super::feature_tree::FeatureNode;
use super::features::finest;
use super::pyramid::{children, level_start, parent_mean, parent_range};
use super::view::{EnvironmentHeader, EnvironmentView};
use super::{MAX_PYRAMID_DEPTH, MAX_RADIANCE, MIN_RADIANCE, rotation};
use crate::buffers::{Section, Sections};
use crate::error::{Error, ErrorKind};
use alloc::vec::Vec;
use glam::{Mat3, Vec3};

/// Tag and version of the section that holds the [`EnvironmentHeader`].
const HEADER_SECTION: ([u8; 4], u32) = (*b"EHDR", 1);

impl<'a> EnvironmentView<'a> {
    /// Appends the sections of the environment. `header` is its own header, which has to outlive them.
    pub(crate) fn append_all_sections(&self, header: &'a [EnvironmentHeader; 1], sections: &mut Vec<Section<'a>>) {
        sections.push(Section::new(HEADER_SECTION.0, HEADER_SECTION.1, header));
        self.append_sections(sections);
    }

    /// Borrows an environment from its sections, and checks it.
    ///
    /// # Errors
    ///
    /// If a section is missing or does not hold what it should.
    pub(crate) fn from_all_sections(sections: &mut Sections<'a>) -> Result<Self, Error> {
        let header = sections.take_value(HEADER_SECTION.0, HEADER_SECTION.1, "header of the environment")?;
        let environment = Self::from_sections(sections, (header,))?;
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
        self.check_levels()?;
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

    /// Checks that every texel of the inner levels has the mean and range of the four below.
    fn check_levels(&self) -> Result<(), Error> {
        let Self { header, means, ranges, .. } = *self;
        for d in (0..header.depth).rev() {
            for y in 0..1_u32 << d {
                for x in 0..1_u32 << d {
                    let at = level_start(d) + ((y << d) | x) as usize;
                    let below = children(means, d, x, y);
                    if means[at] != parent_mean(below) {
                        return Err(wrong("a mean", at, bits(means[at]), bits(parent_mean(below))));
                    }
                    let below =
                        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| self.range_at(d + 1, 2 * x + i, 2 * y + j));
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
}

/// Most blocks of the bright features. *Format*: the tree's numbers fit into 32 bits with room to spare.
///
/// Larger: validation takes longer. Smaller: fewer lamps, or coarser ones.
const MAX_FEATURE_BLOCKS: usize = 1 << 24;

/// Relative difference granted to sums that another version may have added up in another order. *Proved*: sums of
/// a few blocks, each rounded to `f32`, differ by a few units in the last place, 1e-6.
///
/// Larger: densities of forged bytes may be off by as much. Smaller: bytes of another version could be refused.
const SUM_TOLERANCE: f64 = 1e-3;

/// Bound on the components of a texel's center and sides, and on its margin and radius. *Proved*: two points of the
/// unit sphere are at most 2 apart, a margin grants a quarter more, and a radius is at most both.
const MAX_EXTENT: f32 = 8.0;

/// Checks that the bright features can be sampled: that their numbers are in range, that the tree is one, and that its
/// powers are those of its blocks.
fn check_features(header: &EnvironmentHeader, nodes: &[FeatureNode], texels: &[FeatureTexel]) -> Result<(), Error> {
    let limit = MAX_FEATURE_BLOCKS as u64;
    if texels.len() > MAX_FEATURE_BLOCKS || nodes.len() > 2 * MAX_FEATURE_BLOCKS {
        return Err(wrong("the number of bright texels", 0, texels.len() as u64, limit));
    }
    // Only bright features explain why an image is capped.
    if !(header.cap > 0.0) || nodes.is_empty() != (header.cap == f32::INFINITY) {
        return Err(wrong("the cap of the radiance", 0, bits(header.cap), bits(f32::INFINITY)));
    }
    for (i, texel) in texels.iter().enumerate() {
        check_texel(header, i, texel)?;
    }
    let all = nodes.first().map_or([0, 0], |root| root.range);
    if all != [0, texels.len() as u32] || nodes.first().is_some_and(|root| root.next as usize != nodes.len()) {
        return Err(wrong("the number of bright texels", 0, texels.len() as u64, u64::from(all[1])));
    }
    let mut sorted = 0;
    for (i, node) in nodes.iter().enumerate() {
        check_node(i, nodes, texels)?;
        let [start, stop] = node.range.map(|at| at as usize);
        // The parts of a feature come after the feature.
        if node.is_single == 1 && start >= sorted {
            check_order(start, &texels[start..stop])?;
            sorted = stop;
        }
    }
    Ok(())
}

/// Checks that the blocks of a feature are apart, and sorted.
fn check_order(start: usize, texels: &[FeatureTexel]) -> Result<(), Error> {
    for (i, pair) in texels.windows(2).enumerate() {
        let [(before, count), (after, _)] = [pair[0], pair[1]].map(|texel| texel.codes(MAX_PYRAMID_DEPTH));
        if after < before + count {
            return Err(wrong("the number of a bright texel", start + i, u64::from(after), u64::from(before)));
        }
    }
    Ok(())
}

/// Checks one node of the tree over the bright features. Where each passes, they are one tree: the children of each
/// share its nodes and its blocks.
fn check_node(i: usize, nodes: &[FeatureNode], texels: &[FeatureTexel]) -> Result<(), Error> {
    let FeatureNode { axis, sin_radius, sin_spread, power, range, next, is_single } = nodes[i];
    let [start, stop] = range.map(|at| at as usize);
    let end = next as usize;
    if start >= stop || stop > texels.len() {
        return Err(wrong("the texels of a bright feature", i, u64::from(range[1]), texels.len() as u64));
    }
    if end <= i || end > nodes.len() {
        return Err(wrong("the children of a bright feature", i, u64::from(next), nodes.len() as u64));
    }
    let length = Vec3::from_array(axis).length();
    if !((length - 1.0).abs() <= 1e-3) {
        return Err(wrong("the axis of a bright feature", i, bits(length), bits(1.0)));
    }
    if !(sin_radius > 0.0 && sin_radius <= 1.0) {
        return Err(wrong("the radius of a bright feature", i, bits(sin_radius), bits(1.0)));
    }
    if !(sin_spread > 0.0 && sin_spread <= sin_radius) {
        return Err(wrong("the spread of a bright feature", i, bits(sin_spread), bits(sin_radius)));
    }
    if is_single > 1 {
        return Err(wrong("the kind of a bright feature", i, u64::from(is_single), 1));
    }
    let expected = if end == i + 1 {
        if is_single == 0 {
            return Err(wrong("the kind of a bright feature", i, 0, 1));
        }
        texels[start..stop].iter().map(|texel| f64::from(texel.power())).sum::<f64>()
    } else {
        let first = &nodes[i + 1];
        // The children were not checked yet.
        let Some(second) = nodes[..end].get(first.next as usize).filter(|_| first.next as usize > i + 1) else {
            return Err(wrong("the children of a bright feature", i + 1, u64::from(first.next), end as u64));
        };
        if second.next != next || first.range != [range[0], second.range[0]] || second.range[1] != range[1] {
            return Err(wrong("the children of a bright feature", i, u64::from(second.next), end as u64));
        }
        if first.is_single < is_single || second.is_single < is_single {
            return Err(wrong("the kind of a bright feature", i, u64::from(is_single), 0));
        }
        f64::from(first.power) + f64::from(second.power)
    };
    let power_range = f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX);
    if !(power_range.contains(&f64::from(power)) && is_close(f64::from(power), expected, expected)) {
        return Err(wrong("the power of a bright feature", i, bits(power), bits(expected as f32)));
    }
    Ok(())
}

/// Checks a block of texels of a bright feature.
fn check_texel(header: &EnvironmentHeader, i: usize, texel: &FeatureTexel) -> Result<(), Error> {
    let &FeatureTexel { code, level, excess, cap, margin, radius, center, sides } = texel;
    if level > header.depth {
        return Err(wrong("the level of a bright texel", i, u64::from(level), u64::from(header.depth)));
    }
    if code >= 1 << (2 * level) {
        return Err(wrong("the number of a bright texel", i, u64::from(code), 1 << (2 * level)));
    }
    if !(0.0..=MAX_RADIANCE).contains(&excess) {
        return Err(wrong("the excess of a bright texel", i, bits(excess), bits(MAX_RADIANCE)));
    }
    if !(header.cap..=MAX_RADIANCE).contains(&cap) {
        return Err(wrong("the cap of a bright texel", i, bits(cap), bits(header.cap)));
    }
    if ![margin, radius].iter().all(|extent| (0.0..=MAX_EXTENT).contains(extent)) {
        return Err(wrong("the margin of a bright texel", i, bits(margin), bits(MAX_EXTENT)));
    }
    if !center.iter().chain(sides.as_flattened()).all(|component| component.abs() <= MAX_EXTENT) {
        return Err(wrong("the place of a bright texel", i, bits(center[0]), bits(MAX_EXTENT)));
    }
    Ok(())
}

/// Whether two sums agree, but for the order in which they were added up.
fn is_close(found: f64, expected: f64, scale: f64) -> bool {
    (found - expected).abs() <= SUM_TOLERANCE * scale
}

fn bits(value: f32) -> u64 {
    u64::from(value.to_bits())
}

fn wrong(what: &'static str, at: usize, found: u64, expected: u64) -> Error {
    Error(ErrorKind::Bytes { what, at, found, expected })
}
