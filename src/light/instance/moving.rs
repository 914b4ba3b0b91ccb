//! Instances whose transforms move while the shutter is open.
//!
//! The elements of the transform are interpolated, so that every point of the object moves along a straight line. Bounds are
//! those over the whole interval, by the Bernstein coefficients of what changes with a power of the time
//! ([`geometry`](crate::geometry)), in parts of the interval.

use glam::{Affine3A, DMat3, Vec3};

use super::bounds::mapped_cone_of;
use super::{Fault, Instance, InstanceRecord, LARGEST_CONDITION, LARGEST_SCALE, PlacedObject};
use crate::geometry::{Cone, Placement, cofactors, determinants, norm};
use crate::light::Extras;
use crate::light::motion::{EndColumns, PARTS, convex_cone, simpson, widened};

/// Most times that the interval is halved to prove that a transform can be inverted. *Chosen*: bounds over a thousandth of the
/// interval are those of a moment.
///
/// Larger: what is refused takes longer to be refused. Smaller: transforms of a condition close to the limit are refused.
const MOST_HALVINGS: u32 = 10;

impl Instance {
    /// Makes the instance move while the shutter is open: from its transform at the start, the time 0, to this one at the end, the
    /// time 1. Samples and densities are those of the time of the shading point
    /// ([`ShadingPoint::at_time`](crate::ShadingPoint::at_time)), and exact at each.
    ///
    /// In between, every *element* of the transform is interpolated linearly, so that points move along straight lines: a
    /// renderer must do the same, or divide the interval until it makes no difference. An object that turns by an angle α is
    /// smaller by the factor cos(α/2) in the middle: 0.4 % for 10 degrees, 3.4 % for 30. The transform must be one that can be
    /// inverted at all times, so that an object cannot turn by 180 degrees, or into its mirror image.
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
    pub(super) fn check_motion(&self, end: &EndColumns, corners: [Vec3; 2]) -> Result<(), Fault> {
        Self { columns: *end, ..*self }.check(corners)?;
        let [start, end] = [&self.columns, end].map(|columns| Placement::new(columns).linear);
        let at = |time: f64| start + (end - start) * time;
        check_between(&at, [0.0, 1.0], MOST_HALVINGS).map_err(|time| Fault {
            what: "time at which the transform cannot be inverted",
            value: time as f32,
            expected: "none from 0 to 1",
        })
    }
}

/// Checks that a matrix that moves evenly can be inverted at all times of an interval, at whose ends it can. The error is a time
/// at which it cannot.
fn check_between(at: &impl Fn(f64) -> DMat3, [start, end]: [f64; 2], halvings: u32) -> Result<(), f64> {
    let (first, last) = (at(start), at(end));
    let determinants = determinants(&first, &last);
    let sign = determinants[0].signum();
    let least = determinants.into_iter().fold(f64::INFINITY, |least, coefficient| least.min(sign * coefficient));
    let largest = norm(&first).max(norm(&last));
    // The inverse is that of the cofactors over the determinant.
    let cofactor = cofactors(&first, &last).iter().fold(0.0f64, |largest, matrix| largest.max(norm(matrix)));
    let inverse = cofactor / least;
    // NaN fails.
    if least > 0.0 && largest * inverse <= LARGEST_CONDITION && inverse <= LARGEST_SCALE {
        return Ok(());
    }
    let middle = 0.5 * (start + end);
    if halvings == 0 || determinant_of(&at(middle)) * sign <= 0.0 {
        return Err(middle);
    }
    check_between(at, [start, middle], halvings - 1)?;
    check_between(at, [middle, end], halvings - 1)
}

fn determinant_of(matrix: &DMat3) -> f64 {
    matrix.x_axis.dot(matrix.y_axis.cross(matrix.z_axis))
}

impl<'a> PlacedObject<'a> {
    /// Returns the instance of a number at a time, if it moves.
    #[inline(always)]
    pub(in crate::light) fn moving(self, extras: Extras<'a>, number: u32, time: f32) -> Self {
        if extras.is_empty() { self } else { self.moving_at(extras, number, time) }
    }

    #[inline(never)]
    fn moving_at(self, extras: Extras<'a>, number: u32, time: f32) -> Self {
        Self { end: extras.motion().end_of_instance(number), time, ..self }
    }

    /// Returns the map to the world at the time of the instance.
    #[inline]
    pub(super) fn placement(&self) -> Placement {
        match self.end {
            None => self.record.placement(),
            Some(end) => Placement::between(&self.record.columns, end, self.time.into()),
        }
    }

    fn placement_at(&self, end: &EndColumns, time: f64) -> Placement {
        Placement::between(&self.record.columns, end, time)
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

    /// Returns the maps to the world at both ends of the interval, which are the same for an instance that stands still.
    pub(super) fn ends(&self) -> [Placement; 2] {
        [&self.record.columns, self.end.unwrap_or(&self.record.columns)].map(Placement::new)
    }

    /// Returns a cone that holds what the maps of all times make of a cone of normals; `None` for an instance that stands still.
    ///
    /// In each part of the interval, what is made of a normal lies between what the coefficients of the cofactors make of it.
    pub(super) fn moving_cone(&self, axis: Vec3, theta: f32) -> Option<Cone> {
        let end = self.end?;
        let linear = |i: usize| self.placement_at(end, i as f64 / PARTS as f64).linear;
        let sign = determinant_of(&linear(0)).signum();
        let all = (0..PARTS).map(|i| {
            let cones = cofactors(&linear(i), &linear(i + 1)).map(|areas| mapped_cone_of(&(areas * sign), axis, theta));
            convex_cone(cones.map(Some))
        });
        Some(widened(all.flatten().reduce(Cone::union)))
    }
}
