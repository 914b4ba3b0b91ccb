//! Bounds and moments of an instance in the world, by those of its object.
//!
//! What is a proof stays one: the box holds the mapped box, and the cone of normals is widened where the map bends it.
//! What is an estimate is exact where it can be: mean position and variance for any map, and the mean normal and the
//! energy as far as each triangle's energy is multiplied by the factor of all. The factor of a triangle of the unit
//! normal n is
//! |det M · M⁻ᵀn|, and that of all is the root of its mean square.

use glam::{DMat3, DVec3, Vec3};

use super::object::{root_of, symmetric};
use super::{PlacedObject, corners};
use crate::bounds::{LightBounds, Moments};
use crate::geometry::{Aabb, Cone, Placement, between, norm};
use crate::math;
use core::f32::consts::{FRAC_PI_2, PI};

/// Widening of a box for rounding to single precision, relative to its largest coordinate. *Proved*: half a unit in the
/// last place is 6e-8. Larger: boxes far from the origin are wider than need be.
const BOX_ROUNDING: f64 = 1.2e-7;

/// Widening of a cone of normals, in radians, for what a map that counts as a similarity bends. *Proved*: axes that are
/// within 1e-4 of orthonormal change angles by at most twice that. Larger: a little less is culled.
const SIMILARITY_MARGIN: f32 = 2e-4;

/// Widening of a cone of normals, in radians, for rounding. *Proved*: the arcsine and its argument are off by about
/// 1e-7 each, but next to a right angle, where the cone is as good as a half-space. Larger: a little less is culled.
const MAPPED_CONE_ROUNDING: f32 = 1e-6;

impl PlacedObject<'_> {
    /// Returns the factor that areas are multiplied by, as the root of its mean square by energy; exact for a
    /// similarity and for an object in one plane.
    pub(super) fn area_scale(&self, placement: &Placement) -> f64 {
        let areas = placement.areas();
        root_of(trace(&(areas * symmetric(self.object.header.normals) * areas.transpose())))
    }

    /// Returns the mean of [`Self::area_scale`] over the shutter interval.
    pub(super) fn mean_area_scale(&self) -> f64 {
        self.mean(|placement| self.area_scale(placement))
    }

    /// Returns the same, where the map to the world is known already if the instance stands still.
    pub(super) fn area_scale_for(&self, placement: &Placement) -> f64 {
        if self.end.is_some() { self.mean_area_scale() } else { self.area_scale(placement) }
    }

    /// Returns weight times area of emitters, and transmittance times area of portals.
    pub(in crate::light) fn energies(&self) -> [f64; 2] {
        let scale = f64::from(self.record.scale) * self.mean_area_scale();
        [self.object.header.flux, self.object.header.portal].map(|energy| f64::from(energy) * scale)
    }

    /// Returns bounds and moments with these energies, of what does not depend on the direction and of what does.
    pub(in crate::light) fn bounds_with(&self, [flux, portal]: [f32; 2]) -> (LightBounds, Moments) {
        let (header, ends) = (self.object.header, self.ends());
        let [start, end] = &ends;
        let (axis, theta) = (Vec3::from(header.axis), header.theta);
        let aabb = self.aabb(start);
        let bounds = LightBounds {
            aabb: if self.end.is_some() { aabb.union(self.aabb(end)) } else { aabb },
            normals: self.moving_cone(axis, theta).unwrap_or_else(|| mapped_cone(start, axis, theta)),
            emission: FRAC_PI_2,
            flux,
            portal,
            two_sided: header.two_sided != 0,
        };
        let center = Vec3::from(header.mean);
        let means = [start, end].map(|placement| placement.relative_to(Vec3::ZERO, center));
        let within = self.mean(|&Placement { linear, .. }| {
            trace(&(linear * symmetric(header.covariance) * linear.transpose())).max(0.0)
        });
        let area_scale = self.mean_area_scale().max(f64::MIN_POSITIVE);
        let normal = self.mean_areas() * Vec3::from(header.normal).as_dvec3() / area_scale;
        // Each triangle counts with its own area here, so that rounding alone makes this longer than 1.
        let normal = normal.clamp_length_max(1.0);
        let moments = Moments {
            energy: flux + portal,
            mean: between(means[0], means[1], 0.5).as_vec3().clamp(bounds.aabb.min, bounds.aabb.max),
            // The mean moves evenly along a stretch.
            variance: (within + (means[1] - means[0]).length_squared() * (1.0 / 12.0)) as f32,
            normal: if normal.is_finite() { normal.as_vec3() } else { Vec3::Z },
        };
        (bounds, moments)
    }

    /// Returns a box around the mapped box.
    fn aabb(&self, placement: &Placement) -> Aabb {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in corners(self.object.corners()) {
            let corner = placement.relative_to(Vec3::ZERO, corner);
            (low, high) = (low.min(corner), high.max(corner));
        }
        let margin = DVec3::splat(BOX_ROUNDING * low.abs().max(high.abs()).max_element());
        Aabb { min: (low - margin).as_vec3(), max: (high + margin).as_vec3() }
    }
}

/// The cone of all directions.
const EVERY_NORMAL: Cone = Cone { axis: Vec3::Z, theta: PI };

fn trace(matrix: &DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

/// Returns a cone that holds what a map makes of a cone of normals.
///
/// A vector `a + τ`, with τ across the axis a and no longer than `tan θ`, is mapped to within `asin(‖C‖ tan θ / |C a|)`
/// of the image of the axis, where C maps normals.
fn mapped_cone(placement: &Placement, axis: Vec3, theta: f32) -> Cone {
    let areas = placement.areas();
    if theta > 0.0 && placement.is_similarity() {
        let unit = (areas * axis.as_dvec3()).try_normalize();
        return unit.map_or(EVERY_NORMAL, |unit| Cone { axis: unit.as_vec3(), theta: theta + SIMILARITY_MARGIN });
    }
    mapped_cone_of(&areas, axis, theta)
}

/// Returns a cone that holds what a matrix makes of a cone of normals.
pub(super) fn mapped_cone_of(areas: &DMat3, axis: Vec3, theta: f32) -> Cone {
    let image = *areas * axis.as_dvec3();
    let Some(unit) = image.try_normalize() else { return EVERY_NORMAL };
    let axis = unit.as_vec3();
    if theta == 0.0 {
        return Cone { axis, theta };
    }
    let (sin, cos) = math::sin_cos(theta);
    if !(theta < FRAC_PI_2 && cos > 0.0) {
        return Cone { axis, theta: PI };
    }
    let spread = norm(areas) * f64::from(sin / cos) / image.length();
    Cone { axis, theta: if spread < 1.0 { math::asin(spread as f32) + MAPPED_CONE_ROUNDING } else { PI } }
}
