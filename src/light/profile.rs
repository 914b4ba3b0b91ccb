//! Profiles: tables of the intensity of a luminaire by direction (goniometric diagrams, photometric webs).
//!
//! Between the angles of the table the intensity is bilinear, around the axis it is periodic, and outside of the
//! vertical angles it is zero. What is kept of a profile is the table, the mean intensity, the vertical angle beyond
//! which nothing is sent, and sums over the cells of the table by which rays of light are drawn.

use core::f32::consts::{PI, TAU};
use core::f64::consts::{PI as PI64, TAU as TAU64};

use super::profile_values::{ProfileCollection, REACH_MARGIN, TABLE_HEADER, push_sums};
use crate::blas;
use crate::error::{Error, ErrorKind};
use crate::math;
use crate::record::ProfileId;

/// Most angles of a profile, vertical or horizontal. *Format*: numbers of cells are exact in single precision.
const MOST_ANGLES: usize = 2048;

/// The intensity of a luminaire by direction, borrowed from the host: a goniometric diagram, as files of the format
/// IESNA LM-63 hold it.
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{LightSampler, Profile, ProfileLight, ShadingPoint};
///
/// // Straight down the intensity is 10, and from 60 degrees on it is zero.
/// let profile = Profile { vertical: &[0.0, 1.05], horizontal: &[0.0], intensities: &[10.0, 0.0] };
/// let mut builder = LightSampler::builder();
/// let id = builder.add_profile(&profile)?;
/// let lamp = ProfileLight::new(Vec3::new(0.0, 0.0, 3.0), Vec3::NEG_Z, id, 1.0);
/// builder.add_light(lamp)?;
/// let lights = builder.build()?;
/// let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
/// let sample = here.sample([0.5; 3]).expect("the floor is lit");
/// assert_eq!(lamp.intensity_towards(&profile, -sample.direction), 10.0);
/// assert!(lights.at(&ShadingPoint::surface(Vec3::new(9.0, 0.0, 0.0), Vec3::Z)).sample([0.5; 3]).is_none());
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq)]
#[must_use]
pub struct Profile<'a> {
    /// Angles from the axis in radians, at least two: from 0 to π, in ascending order. Nothing is sent before the first
    /// and beyond the last.
    pub vertical: &'a [f32],
    /// Angles around the axis in radians, at least one: from 0 to less than 2π, in ascending order. The last is next to
    /// the first. With a single one, the intensity depends on the vertical angle alone.
    pub horizontal: &'a [f32],
    /// Radiant intensities, not negative: those of all horizontal angles for the first vertical angle, then for the
    /// next.
    pub intensities: &'a [f32],
}

crate::buffers::debug_counts!(Profile<'_>, profile => {
    vertical: profile.vertical.len(),
    horizontal: profile.horizontal.len(),
    intensities: profile.intensities.len(),
});

impl Profile<'_> {
    /// Returns the intensity at a vertical and a horizontal angle, in radians.
    #[must_use]
    pub fn intensity(&self, [vertical, horizontal]: [f64; 2]) -> f32 {
        let Some((row, across)) = row_at(self.vertical, vertical) else { return 0.0 };
        let (columns, along) = columns_at(self.horizontal, horizontal);
        let width = self.horizontal.len();
        let at =
            |row: usize, column: usize| f64::from(self.intensities.get(row * width + column).copied().unwrap_or(0.0));
        let mix = |row| at(row, columns[0]) * (1.0 - along) + at(row, columns[1]) * along;
        (mix(row) * (1.0 - across) + mix(row + 1) * across) as f32
    }

    fn check(&self) -> Result<(), Error> {
        let fail = |what, at, value, expected| Err(Error(ErrorKind::Profile { what, at, value, expected }));
        let ascends = |angles: &[f32], at: usize| at == 0 || angles[at] > angles[at - 1];
        let counts =
            [("number of vertical angles", self.vertical, 2), ("number of horizontal angles", self.horizontal, 1)];
        for (what, angles, least) in counts {
            if !(least..=MOST_ANGLES).contains(&angles.len()) {
                return fail(what, least, angles.len() as f32, "at least that many, and at most 2048");
            }
        }
        let is_bad = |at: &usize| !((0.0..=PI).contains(&self.vertical[*at]) && ascends(self.vertical, *at));
        if let Some(at) = (0..self.vertical.len()).find(is_bad) {
            return fail("vertical angle", at, self.vertical[at], "from 0 to π and above the one before");
        }
        let is_bad = |at: &usize| !((0.0..TAU).contains(&self.horizontal[*at]) && ascends(self.horizontal, *at));
        if let Some(at) = (0..self.horizontal.len()).find(is_bad) {
            return fail(
                "horizontal angle",
                at,
                self.horizontal[at],
                "from 0 to less than 2π and above the one before",
            );
        }
        let is_bad = |value: &f32| !(0.0..=blas::MAX_AVERAGE).contains(value);
        if let Some(at) = self.intensities.iter().position(is_bad) {
            return fail("intensity", at, self.intensities[at], "from 0 to 1e30");
        }
        let (found, expected) = (self.intensities.len(), self.vertical.len() * self.horizontal.len());
        if found == expected {
            Ok(())
        } else {
            fail("number of intensities", expected, found as f32, "one for each pair of angles")
        }
    }

    /// Solid angle of a cell of the table, by its first vertical and horizontal angle.
    fn solid_angle(&self, row: usize, column: usize) -> f64 {
        let [top, bottom] = [row, row + 1].map(|row| math::cos64(self.vertical[row].into()));
        (top - bottom) * width_of(self.horizontal, column)
    }

    /// Power that leaves through a cell of the table: the integral of the bilinear intensity over its solid angle.
    fn power(&self, row: usize, column: usize) -> f64 {
        let width = self.horizontal.len();
        let mean = |row: usize| {
            let at = |column: usize| f64::from(self.intensities[row * width + column]);
            0.5 * (at(column) + at((column + 1) % width))
        };
        let (a, b) = (f64::from(self.vertical[row]), f64::from(self.vertical[row + 1]));
        let (sin_a, cos_a) = (math::cos64(a - 0.5 * PI64), math::cos64(a));
        let (sin_b, cos_b) = (math::cos64(b - 0.5 * PI64), math::cos64(b));
        // Integrals of the sine, and of the sine times a ramp from 0 to 1.
        let all = (cos_a - cos_b).max(0.0);
        let ramp = (((sin_b - sin_a) / (b - a)) - cos_b).clamp(0.0, all);
        (mean(row) * (all - ramp) + mean(row + 1) * ramp) * width_of(self.horizontal, column)
    }
}

/// Returns the first of the two vertical angles around an angle, and how far it is on the way to the second.
fn row_at(vertical: &[f32], angle: f64) -> Option<(usize, f64)> {
    let [first, .., last] = vertical else { return None };
    if !(angle >= f64::from(*first) && angle <= f64::from(*last)) {
        return None;
    }
    let row = vertical.partition_point(|&value| f64::from(value) <= angle).clamp(1, vertical.len() - 1) - 1;
    let [a, b] = [vertical[row], vertical[row + 1]].map(f64::from);
    Some((row, ((angle - a) / (b - a)).clamp(0.0, 1.0)))
}

/// Returns the two horizontal angles around an angle, and how far it is on the way from the first to the second.
fn columns_at(horizontal: &[f32], angle: f64) -> ([usize; 2], f64) {
    let count = horizontal.len();
    let Some(&first) = horizontal.first().filter(|_| count > 1) else { return ([0; 2], 0.0) };
    let turns = math::floor64((angle - f64::from(first)) / TAU64);
    // From the first angle on, and less than a turn.
    let angle = (angle - turns * TAU64).max(first.into());
    let column = horizontal.partition_point(|&value| f64::from(value) <= angle).clamp(1, count) - 1;
    let share = (angle - f64::from(horizontal[column])) / width_of(horizontal, column);
    ([column, (column + 1) % count], share.clamp(0.0, 1.0))
}

/// Returns the difference between a horizontal angle and the next.
fn width_of(horizontal: &[f32], column: usize) -> f64 {
    let start = f64::from(horizontal[column]);
    match horizontal.get(column + 1) {
        Some(next) => f64::from(*next) - start,
        None => f64::from(horizontal[0]) + TAU64 - start,
    }
}

/// Returns the direction at a vertical and a horizontal angle, in the frame of the profile.
fn direction_of_angles([vertical, horizontal]: [f64; 2]) -> [f64; 3] {
    let sin = |angle: f64| math::cos64(angle - 0.5 * PI64);
    let across = sin(vertical);
    [across * math::cos64(horizontal), across * sin(horizontal), math::cos64(vertical)]
}

/// Returns the vertical and the horizontal angle of a direction in the frame of the profile.
pub(super) fn angles_of_direction([x, y, z]: [f64; 3]) -> [f64; 2] {
    [math::atan2_64(math::sqrt64(x * x + y * y), z), math::atan2_64(y, x)]
}

impl ProfileCollection {
    /// Adds a profile, unless there is something wrong with it.
    pub(super) fn add(&mut self, profile: &Profile<'_>) -> Result<ProfileId, Error> {
        profile.check()?;
        let [rows, columns] = [profile.vertical.len() - 1, profile.horizontal.len()];
        let end = self.values.len() + TABLE_HEADER + rows + 1 + columns + (rows + 1) * columns + rows * columns;
        if u32::try_from(end).is_err() {
            return Err(Error(ErrorKind::TooMany { what: "values of profiles", count: end, limit: u32::MAX as usize }));
        }
        let cells = || (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let total: f64 = cells().map(|(row, column)| profile.power(row, column)).sum();
        let is_lit =
            |row: usize| profile.intensities[row * columns..(row + 1) * columns].iter().any(|value| *value > 0.0);
        let reach = (0..=rows).rev().find(|&row| is_lit(row)).map_or(0.0, |row| profile.vertical[(row + 1).min(rows)]);
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.values.extend([(rows + 1) as f32, columns as f32]);
        self.values.extend([(total / (4.0 * PI64)) as f32, (reach + REACH_MARGIN).min(PI)]);
        self.values.extend(profile.vertical.iter().chain(profile.horizontal).chain(profile.intensities));
        push_sums(&mut self.values, cells().map(|(row, column)| profile.power(row, column)));
        self.starts.push(end as u32);
        Ok(ProfileId(self.starts.len() as u32 - 2))
    }
}

/// A profile as a sampler keeps it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProfileTable<'a> {
    profile: Profile<'a>,
    /// Share of the power that leaves through each cell and those before it.
    sums: &'a [f32],
}

impl<'a> ProfileTable<'a> {
    /// Returns the table of these values after a header, if there are as many as there should be.
    pub(super) fn new([rows, columns, ..]: [f32; TABLE_HEADER], values: &'a [f32]) -> Option<Self> {
        let [rows, columns] = [rows as usize, columns as usize];
        let cells = rows.checked_sub(1)?.checked_mul(columns)?;
        let (vertical, values) = values.split_at_checked(rows)?;
        let (horizontal, values) = values.split_at_checked(columns)?;
        let (intensities, sums) = values.split_at_checked(cells + columns)?;
        (sums.len() == cells).then_some(Self { profile: Profile { vertical, horizontal, intensities }, sums })
    }

    /// Whether the values, which may come from outside, are those of a profile.
    pub(super) fn is_valid(&self) -> bool {
        let ascends = self.sums.windows(2).all(|pair| pair[0] <= pair[1]);
        self.profile.check().is_ok() && ascends && self.sums.iter().all(|sum| (0.0..=1.0).contains(sum))
    }

    /// Share of the power that leaves through a cell.
    fn share(&self, cell: usize) -> f64 {
        let before = cell.checked_sub(1).map_or(0.0, |before| self.sums[before]);
        f64::from(self.sums[cell]) - f64::from(before)
    }

    /// Returns the mean cosine between the axis and the directions in which light leaves, by the power of each row.
    pub(super) fn mean_cosine(&self) -> f64 {
        let Profile { vertical, horizontal, .. } = self.profile;
        let (mut mean, mut before) = (0.0, 0.0);
        for (angles, sums) in vertical.windows(2).zip(self.sums.chunks_exact(horizontal.len())) {
            let [top, bottom] = [angles[0], angles[1]].map(|angle| math::cos64(angle.into()));
            let sum = sums.last().map_or(before, |&sum| f64::from(sum));
            mean += (sum - before) * 0.5 * (top + bottom);
            before = sum;
        }
        mean
    }

    /// Returns the intensity in a direction in the frame of the light.
    pub(super) fn intensity(&self, direction: [f64; 3]) -> f32 {
        self.profile.intensity(angles_of_direction(direction))
    }

    /// Draws a unit direction in the frame of the light.
    pub(super) fn sample(&self, u: [f64; 2]) -> [f64; 3] {
        direction_of_angles(self.angles(u))
    }

    /// Draws a vertical and a horizontal angle: a cell by its power, and uniformly in its solid angle.
    fn angles(&self, [u1, u2]: [f64; 2]) -> [f64; 2] {
        let Some(last) = self.sums.len().checked_sub(1) else { return [0.0; 2] };
        let total = f64::from(self.sums[last]);
        // The first cell whose end is beyond: never one without power.
        let target = u1 * total;
        let cell = self.sums.partition_point(|&sum| f64::from(sum) <= target).min(last);
        let before = f64::from(self.sums[cell]) - self.share(cell);
        let rest = ((target - before) / self.share(cell).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let Profile { vertical, horizontal, .. } = self.profile;
        let (row, column) = (cell / horizontal.len(), cell % horizontal.len());
        let [top, bottom] = [row, row + 1].map(|row| math::cos64(vertical[row].into()));
        let cos = (top + rest * (bottom - top)).clamp(-1.0, 1.0);
        let sin = math::sqrt64((1.0 - cos * cos).max(0.0));
        [math::atan2_64(sin, cos), f64::from(horizontal[column]) + u2 * width_of(horizontal, column)]
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws a direction.
    pub(super) fn pdf(&self, direction: [f64; 3]) -> f64 {
        let [vertical, horizontal] = angles_of_direction(direction);
        let Some((row, _)) = row_at(self.profile.vertical, vertical) else { return 0.0 };
        let ([column, _], _) = columns_at(self.profile.horizontal, horizontal);
        let total = self.sums.last().map_or(0.0, |&total| f64::from(total));
        let share = self.share(row * self.profile.horizontal.len() + column);
        if share > 0.0 { share / (total * self.profile.solid_angle(row, column)) } else { 0.0 }
    }
}
