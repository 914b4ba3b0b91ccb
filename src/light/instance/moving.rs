//! Instances whose transforms move while the shutter is open.
//!
//! The elements of the transform are interpolated, so that every point of the object moves along a straight line.
//! Bounds are those over the whole interval, by the Bernstein coefficients of what changes with a power of the time
//! ([`geometry`](crate::geometry)), in parts of the interval.

use glam::{Affine3A, DMat3, DVec3, Vec3};

use super::bounds::mapped_cone_of;
use super::{Instance, InstanceFault, InstanceRecord, LARGEST_CONDITION, LARGEST_SCALE, PlacedObject};
use crate::geometry::{Cone, Placement, cofactors, determinants, norm};
use crate::light::Extras;
use crate::light::motion::{EndColumns, SHUTTER_PARTS, convex_cone, simpson, widened};

/// Most times that the interval is halved to prove that a transform can be inverted. *Chosen*: bounds over a thousandth
/// of the interval are those of a moment.
///
/// Larger: what is refused takes longer to be refused. Smaller: transforms of a condition close to the limit are
/// refused.
const MOST_HALVINGS: u32 = 10;

impl Instance {
    /// Makes the instance move while the shutter is open: from its transform at the start, the time 0, to this one at
    /// the end, the time 1. Samples and densities are those of the time of the shading point
    /// ([`ShadingPoint::at_time`](crate::ShadingPoint::at_time)), and exact at each.
    ///
    /// In between, every *element* of the transform is interpolated linearly, so that points move along straight lines:
    /// a renderer must do the same, or divide the interval until it makes no difference. An object that turns by an
    /// angle α is smaller by the factor cos(α/2) in the middle: 0.4 % for 10 degrees, 3.4 % for 30. The transform must
    /// be one that can be inverted at all times, so that an object cannot turn by 180 degrees, or into its mirror
    /// image.
    pub const fn moving_to(mut self, end: Affine3A) -> Self {
        self.end = Some(end);
        self
    }

    /// Returns the columns of the transform at the end of the interval, if it is another then.
    pub(in crate::light) fn end_columns(&self) -> Option<EndColumns> {
        self.end.filter(|end| *end != self.transform).map(|end| end.to_cols_array_2d())
    }
}

impl InstanceRecord {
    /// Checks the transform at the end of the interval, and that it can be inverted at all times.
    pub(super) fn check_motion(&self, end: &EndColumns, corners: [Vec3; 2]) -> Result<(), InstanceFault> {
        Self { columns: *end, ..*self }.check(corners)?;
        let [start, end] = [&self.columns, end].map(|columns| Placement::new(columns).linear);
        let at = |time: f64| start + (end - start) * time;
        check_between(&at, [0.0, 1.0], MOST_HALVINGS).map_err(|time| InstanceFault {
            what: "time at which the transform cannot be inverted",
            value: time as f32,
            expected: "none from 0 to 1",
        })
    }
}

/// Checks that a matrix that moves evenly can be inverted at all times of an interval, at whose ends it can. The error
/// is a time at which it cannot.
fn check_between(at: &impl Fn(f64) -> DMat3, [start, end]: [f64; 2], halvings: u32) -> Result<(), f64> {
    let (first, last) = (at(start), at(end));
    let sign = determinant_of(&first).signum();
    let least = determinants(&first, &last).into_iter().fold(f64::INFINITY, |least, det| least.min(sign * det));
    let largest = norm(&first).max(norm(&last));
    let cofactor = cofactors(&first, &last).iter().fold(0.0f64, |largest, matrix| largest.max(norm(matrix)));
    if is_invertible(largest, cofactor, least) {
        return Ok(());
    }
    let middle = 0.5 * (start + end);
    let matrix = at(middle);
    let determinant = sign * determinant_of(&matrix);
    if determinant <= 0.0 {
        return Err(zero_between(|time| sign * determinant_of(&at(time)), [start, middle]));
    }
    let [cofactors, ..] = cofactors(&matrix, &matrix);
    if halvings == 0 || !is_invertible(norm(&matrix), norm(&cofactors), determinant) {
        return Err(middle);
    }
    check_between(at, [start, middle], halvings - 1)?;
    check_between(at, [middle, end], halvings - 1)
}

/// Whether a matrix can be inverted well enough, by bounds on the lengths of what it and its cofactors make of unit
/// vectors, and on the determinant.
fn is_invertible(largest: f64, cofactor: f64, determinant: f64) -> bool {
    let inverse = cofactor / determinant;
    // NaN fails.
    determinant > 0.0 && largest * inverse <= LARGEST_CONDITION && inverse <= LARGEST_SCALE
}

/// Returns where a function that is positive at the start of an interval, and not at the end, is zero.
fn zero_between(of: impl Fn(f64) -> f64, [mut start, mut end]: [f64; 2]) -> f64 {
    for _ in 0..f32::MANTISSA_DIGITS {
        let middle = 0.5 * (start + end);
        *(if of(middle) > 0.0 { &mut start } else { &mut end }) = middle;
    }
    end
}

fn determinant_of(matrix: &DMat3) -> f64 {
    matrix.x_axis.dot(matrix.y_axis.cross(matrix.z_axis))
}

#[inline(never)]
fn end_of<'a>(extras: Extras<'a>, number: u32) -> Option<&'a EndColumns> {
    extras.motion().end_of_instance(number)
}

#[inline(never)]
fn columns_between(start: &EndColumns, end: &EndColumns, time: f32) -> [DVec3; 4] {
    Placement::columns_between(start, end, time.into())
}

impl<'a> PlacedObject<'a> {
    /// Returns the instance of a number at a time, if it moves.
    #[inline(always)]
    pub(in crate::light) fn moving(self, extras: Extras<'a>, number: u32, time: f32) -> Self {
        let end = if extras.is_empty() { None } else { end_of(extras, number) };
        Self { end, time, ..self }
    }

    /// Returns the instance at the start of the interval, with this transform at its end.
    pub(in crate::light) fn moving_to(self, end: Option<&'a EndColumns>) -> Self {
        Self { end, time: 0.0, ..self }
    }

    /// Returns the map to the world at the time of the instance.
    #[inline(always)]
    pub(super) fn placement(&self) -> Placement {
        Placement::of_columns(match self.end {
            None => Placement::exactly(&self.record.columns),
            Some(end) => columns_between(&self.record.columns, end, self.time),
        })
    }

    fn placement_at(&self, end: &EndColumns, time: f64) -> Placement {
        Placement::of_columns(Placement::columns_between(&self.record.columns, end, time))
    }

    /// Returns the mean over the interval of what depends on the map to the world.
    pub(super) fn mean(&self, of: impl Fn(&Placement) -> f64) -> f64 {
        match self.end {
            None => of(&self.record.placement()),
            Some(end) => simpson(|time| of(&self.placement_at(end, time))),
        }
    }

    /// Returns the mean over the interval of the matrix that maps area vectors.
    pub(super) fn mean_areas(&self) -> DMat3 {
        let Some(end) = self.end else { return self.record.placement().areas() };
        let areas = |time: f64| self.placement_at(end, time).areas();
        (areas(0.0) + areas(0.5) * 4.0 + areas(1.0)) * (1.0 / 6.0)
    }

    /// Returns the maps to the world at both ends of the interval, which are the same for an instance that stands
    /// still.
    pub(super) fn ends(&self) -> [Placement; 2] {
        [&self.record.columns, self.end.unwrap_or(&self.record.columns)].map(Placement::new)
    }

    /// Returns a cone that holds what the maps of all times make of a cone of normals; `None` for an instance that
    /// stands still.
    ///
    /// In each part of the interval, what is made of a normal lies between what the coefficients of the cofactors make
    /// of it.
    pub(super) fn moving_cone(&self, axis: Vec3, theta: f32) -> Option<Cone> {
        let end = self.end?;
        let linear = |i: usize| self.placement_at(end, i as f64 / SHUTTER_PARTS as f64).linear;
        let sign = determinant_of(&linear(0)).signum();
        let all = (0..SHUTTER_PARTS).map(|i| {
            let cones = cofactors(&linear(i), &linear(i + 1)).map(|areas| mapped_cone_of(&(areas * sign), axis, theta));
            convex_cone(cones.map(Some))
        });
        Some(widened(all.flatten().reduce(Cone::union)))
    }
}

#[cfg(test)]
mod tests;
