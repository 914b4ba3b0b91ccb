//! Projections: images of the intensity of a light over its field of view, as a slide projector has one.
//!
//! The image lies on a plane in front of the light, so that it is a rectangular pyramid of directions. Rays of light
//! are drawn by its texels: a row, then a texel in the row, each by the mean intensity times the solid angle, then a
//! point of the texel uniformly. On the plane at the distance 1, an area is seen under its size times the third power
//! of the cosine to the axis.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI};

use super::profile_values::{ProfileCollection, REACH_MARGIN, TABLE_HEADER, push_sums};
use crate::blas;
use crate::error::{Error, ErrorKind};
use crate::math;
use crate::record::{Filter, ProfileId};

/// Most texels along an edge. *Format*: sums over a row are exact enough in single precision for the least
/// share of a texel.
const MOST_TEXELS: usize = 2048;

/// Values of a projection between the header and the texels: tangents of half the angles of view, and the filter.
/// *Format.*
const VIEW: usize = 3;

/// Range of the angles of view, in radians. *Chosen*: tangents of half of them are well within single precision.
const ANGLES: [f32; 2] = [1e-3, 3.1];

/// Range of the tangents of half the angles of view. *Proved*: holds those of [`ANGLES`].
const TANGENTS: [f32; 2] = [4e-4, 49.0];

/// An image of radiant intensities that a light projects, borrowed from the host.
///
/// A [`ProfileLight`](crate::ProfileLight) may have one in the place of a [`Profile`](crate::Profile). Its axis is the
/// middle of the image, [`facing`](crate::ProfileLight::facing) is the direction of the image's right edge as seen
/// along the light, and rows go down.
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{Filter, LightSampler, ProfileLight, Projection, ShadingPoint};
///
/// // A slide of two texels, bright on the right.
/// let slide = Projection { angles: [0.8, 0.6], size: [2, 1], intensities: &[1.0, 5.0], filter: Filter::Nearest };
/// let mut builder = LightSampler::builder();
/// let id = builder.add_projection(&slide)?;
/// let projector = ProfileLight::new(Vec3::ZERO, Vec3::Y, id, 2.0).facing(Vec3::X);
/// builder.add_light(projector)?;
/// let lights = builder.build()?;
///
/// let on_screen = |x| lights.at(&ShadingPoint::surface(Vec3::new(x, 3.0, 0.0), -Vec3::Y)).sample([0.5; 3]);
/// let sample = on_screen(0.5).expect("the right half is lit");
/// assert_eq!(projector.intensity_through(&slide, -sample.direction), 10.0);
/// assert_eq!(projector.intensity_through(&slide, Vec3::new(-0.1, 1.0, 0.0).normalize()), 2.0);
/// assert!(on_screen(2.0).is_none());
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq)]
#[must_use]
pub struct Projection<'a> {
    /// Angles of view across the image and down, in radians: the whole angles, from 1e-3 to 3.1.
    pub angles: [f32; 2],
    /// Columns and rows, each from 1 to 2048.
    pub size: [usize; 2],
    /// Radiant intensities, not negative: row by row from the upper left.
    pub intensities: &'a [f32],
    /// How the host reads the image between texel centers. Beyond the centers at the edges it is constant.
    pub filter: Filter,
}

crate::buffers::debug_counts!(Projection<'_>, projection => {
    angles: projection.angles,
    size: projection.size,
    intensities: projection.intensities.len(),
    filter: projection.filter,
});

impl Projection<'_> {
    /// Returns the intensity at a point of the image, from `[0, 0]` at the upper left to `[1, 1]` at the lower right;
    /// zero outside.
    #[must_use]
    pub fn intensity(&self, point: [f64; 2]) -> f32 {
        // NaN fails.
        if !point.iter().all(|u| (0.0..=1.0).contains(u)) {
            return 0.0;
        }
        let [x, y] = [0, 1].map(|axis| point[axis] * self.size[axis] as f64);
        if self.filter == Filter::Nearest {
            return self.texel(x as usize, y as usize) as f32;
        }
        let [x, y] = [x, y].map(|at| (at - 0.5).max(0.0));
        let ([i, j], [s, t]) = ([x as usize, y as usize], [x - math::floor64(x), y - math::floor64(y)]);
        let row = |j: usize| self.texel(i, j) * (1.0 - s) + self.texel(i + 1, j) * s;
        (row(j) * (1.0 - t) + row(j + 1) * t) as f32
    }

    /// Value of a texel; beyond the edges, of that at the edge.
    fn texel(&self, column: usize, row: usize) -> f64 {
        let [width, height] = self.size;
        let at = row.min(height.saturating_sub(1)) * width + column.min(width.saturating_sub(1));
        self.intensities.get(at).copied().unwrap_or(0.0).into()
    }

    /// Mean intensity over a texel.
    fn mean(&self, column: usize, row: usize) -> f64 {
        if self.filter == Filter::Nearest {
            return self.texel(column, row);
        }
        // The mean of what is linear between centers: an eighth of both neighbors along each axis.
        let across = |row: usize| {
            let [before, at, after] =
                [column.saturating_sub(1), column, column + 1].map(|column| self.texel(column, row));
            0.125 * (before + 6.0 * at + after)
        };
        0.125 * (across(row.saturating_sub(1)) + 6.0 * across(row) + across(row + 1))
    }

    /// Returns the intensity in a direction in the frame of the light.
    pub(super) fn intensity_towards(&self, direction: [f64; 3]) -> f32 {
        let view = View { size: self.size, tangents: self.tangents().map(f64::from) };
        view.point(direction).map_or(0.0, |point| self.intensity(point))
    }

    /// Tangents of half the angles of view, rounded as a sampler keeps them.
    fn tangents(&self) -> [f32; 2] {
        self.angles.map(|angle| {
            let half = 0.5 * f64::from(angle);
            (math::cos64(half - FRAC_PI_2) / math::cos64(half)) as f32
        })
    }

    fn check(&self) -> Result<(), Error> {
        let fail = |what, at, value, expected| Err(Error(ErrorKind::Profile { what, at, value, expected }));
        if let Some(axis) = self.size.iter().position(|size| !(1..=MOST_TEXELS).contains(size)) {
            return fail("size of the image along axis", axis, self.size[axis] as f32, "from 1 to 2048");
        }
        if let Some(axis) = self.angles.iter().position(|angle| !(ANGLES[0]..=ANGLES[1]).contains(angle)) {
            return fail("angle of view", axis, self.angles[axis], "from 1e-3 to 3.1");
        }
        let is_bad = |value: &f32| !(0.0..=blas::MAX_AVERAGE).contains(value);
        if let Some(at) = self.intensities.iter().position(is_bad) {
            return fail("intensity", at, self.intensities[at], "from 0 to 1e30");
        }
        let (found, expected) = (self.intensities.len(), self.size[0] * self.size[1]);
        if found == expected {
            Ok(())
        } else {
            fail("number of intensities", expected, found as f32, "one for each texel")
        }
    }
}

impl ProfileCollection {
    /// Adds a projection, unless there is something wrong with it.
    pub(super) fn add_projection(&mut self, image: &Projection<'_>) -> Result<ProfileId, Error> {
        image.check()?;
        let ([width, height], tangents) = (image.size, image.tangents());
        let end = self.values.len() + TABLE_HEADER + VIEW + height + 2 * width * height;
        if u32::try_from(end).is_err() {
            return Err(Error(ErrorKind::TooMany { what: "values of profiles", count: end, limit: u32::MAX as usize }));
        }
        let view = View { size: image.size, tangents: tangents.map(f64::from) };
        let power = |column: usize, row: usize| image.mean(column, row) * view.solid_angle(column, row);
        let powers = |row: usize| (0..width).map(move |column| power(column, row));
        let (mut total, mut reach) = (0.0, 0.0_f64);
        let mut rows = Vec::with_capacity(height);
        for row in 0..height {
            let of_row: f64 = powers(row).sum();
            total += of_row;
            rows.push(of_row);
            let lit = (0..width).filter(|&column| image.mean(column, row) > 0.0);
            reach = lit.fold(reach, |reach, column| reach.max(view.farthest(column, row)));
        }
        let count = [-(height as f32), width as f32];
        let reach = if total > 0.0 { math::atan2_64(reach, 1.0) as f32 } else { 0.0 };
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.values.extend(count);
        self.values.extend([(total / (4.0 * PI)).min(blas::MAX_AVERAGE.into()) as f32, reach + REACH_MARGIN]);
        self.values.extend(tangents);
        self.values.push(if image.filter == Filter::Nearest { 0.0 } else { 1.0 });
        self.values.extend(image.intensities);
        push_sums(&mut self.values, rows.into_iter());
        (0..height).for_each(|row| push_sums(&mut self.values, powers(row)));
        self.starts.push(end as u32);
        Ok(ProfileId(self.starts.len() as u32 - 2))
    }
}

/// The plane of an image at the distance 1.
#[derive(Clone, Copy, Debug)]
struct View {
    size: [usize; 2],
    tangents: [f64; 2],
}

impl View {
    /// Place on the plane of a corner between texels.
    fn corner(&self, axis: usize, index: usize) -> f64 {
        self.tangents[axis] * (2.0 * index as f64 / self.size[axis] as f64 - 1.0)
    }

    /// Solid angle of a texel.
    fn solid_angle(&self, column: usize, row: usize) -> f64 {
        // That of the rectangle between the axis and a corner.
        let of = |column: usize, row: usize| {
            let [x, y] = [self.corner(0, column), self.corner(1, row)];
            math::atan2_64(x * y, math::sqrt64(1.0 + x * x + y * y))
        };
        (of(column + 1, row + 1) - of(column, row + 1) - of(column + 1, row) + of(column, row)).max(0.0)
    }

    /// Largest distance of a corner of a texel from the axis.
    fn farthest(&self, column: usize, row: usize) -> f64 {
        let reach = |axis: usize, index: usize| {
            let [a, b] = [index, index + 1].map(|index| self.corner(axis, index));
            (a * a).max(b * b)
        };
        math::sqrt64(reach(0, column) + reach(1, row))
    }

    /// Area of a texel.
    fn area(&self) -> f64 {
        [0, 1].into_iter().map(|axis| 2.0 * self.tangents[axis] / self.size[axis] as f64).product()
    }

    /// Point of the image in a direction in the frame of the light; `None` outside.
    fn point(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        let point = [x / z, y / z];
        let point = [0, 1].map(|axis| 0.5 + 0.5 * point[axis] / self.tangents[axis]);
        // NaN fails.
        (z > 0.0 && point.iter().all(|u| (0.0..=1.0).contains(u))).then_some(point)
    }

    /// Texel that a point of the image is in.
    fn texel(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| ((point[axis] * self.size[axis] as f64) as usize).min(self.size[axis] - 1))
    }
}

/// A projection as a sampler keeps it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProjectionTable<'a> {
    view: View,
    intensities: &'a [f32],
    filter: f32,
    /// Share of each row and those before it.
    rows: &'a [f32],
    /// Share of each texel and those before it in its row.
    texels: &'a [f32],
}

impl<'a> ProjectionTable<'a> {
    /// Returns the table of these values after a header, if there are as many as there should be.
    pub(super) fn new([rows, columns, ..]: [f32; TABLE_HEADER], values: &'a [f32]) -> Option<Self> {
        let size = [columns as usize, -rows as usize];
        let count = size[0].checked_mul(size[1]).filter(|_| size.iter().all(|n| (1..=MOST_TEXELS).contains(n)))?;
        let ([x, y, filter], values) = values.split_first_chunk::<VIEW>()?;
        let (intensities, values) = values.split_at_checked(count)?;
        let (rows, texels) = values.split_at_checked(size[1])?;
        let view = View { size, tangents: [*x, *y].map(f64::from) };
        (texels.len() == count).then_some(Self { view, intensities, filter: *filter, rows, texels })
    }

    /// Whether the values, which may come from outside, are those of a projection.
    pub(super) fn is_valid(&self) -> bool {
        let ascends = |sums: &[f32]| sums.windows(2).all(|pair| pair[0] <= pair[1]);
        let is_share = |sum: &f32| (0.0..=1.0).contains(sum);
        let [low, high] = TANGENTS.map(f64::from);
        self.view.tangents.iter().all(|tangent| (low..=high).contains(tangent))
            && [0.0, 1.0].contains(&self.filter)
            && self.intensities.iter().all(|value| (0.0..=blas::MAX_AVERAGE).contains(value))
            && ascends(self.rows)
            && self.texels.chunks(self.view.size[0]).all(ascends)
            && self.rows.iter().chain(self.texels).all(is_share)
    }

    /// Returns the intensity in a direction in the frame of the light.
    pub(super) fn intensity(&self, direction: [f64; 3]) -> f32 {
        let filter = if self.filter == 0.0 { Filter::Nearest } else { Filter::Bilinear };
        let image = Projection { angles: [0.0; 2], size: self.view.size, intensities: self.intensities, filter };
        self.view.point(direction).map_or(0.0, |point| image.intensity(point))
    }

    /// Draws a unit direction in the frame of the light.
    pub(super) fn sample(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let (row, down) = choose(self.rows, v);
        let (column, across) = choose(self.texels_of(row), u);
        let [x, y] = [(column, across), (row, down)].map(|(index, rest)| index as f64 + rest);
        let [width, height] = self.view.size.map(|size| size as f64);
        let [tx, ty] = self.view.tangents;
        let (x, y) = (tx * (2.0 * x / width - 1.0), ty * (2.0 * y / height - 1.0));
        let inverse = 1.0 / math::sqrt64(1.0 + x * x + y * y);
        [x * inverse, y * inverse, inverse]
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws a direction.
    pub(super) fn pdf(&self, direction: [f64; 3]) -> f64 {
        let Some(point) = self.view.point(direction) else { return 0.0 };
        let [column, row] = self.view.texel(point);
        let share = share_of(self.rows, row) * share_of(self.texels_of(row), column);
        let [x, y, z] = direction;
        let cosine = z / math::sqrt64(x * x + y * y + z * z);
        share / (self.view.area() * cosine * cosine * cosine)
    }

    /// Sums of the texels of a row.
    fn texels_of(&self, row: usize) -> &'a [f32] {
        let width = self.view.size[0];
        &self.texels[row * width..][..width]
    }
}

/// Chooses one of several by its share, given the sums of the shares. Returns it with what is left of the random
/// number.
fn choose(sums: &[f32], u: f64) -> (usize, f64) {
    let Some(&total) = sums.last() else { return (0, u) };
    // The first whose end is beyond: never one without a share.
    let target = u * f64::from(total);
    let index = sums.partition_point(|&sum| f64::from(sum) <= target).min(sums.len() - 1);
    let share = share_of(sums, index) * f64::from(total);
    let before = f64::from(sums[index]) - share;
    (index, ((target - before) / share.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
}

/// Share of one, relative to all.
fn share_of(sums: &[f32], index: usize) -> f64 {
    let before = index.checked_sub(1).map_or(0.0, |before| sums[before]);
    let total = sums.last().map_or(0.0, |&total| f64::from(total));
    if total > 0.0 { (f64::from(sums[index]) - f64::from(before)) / total } else { 0.0 }
}
