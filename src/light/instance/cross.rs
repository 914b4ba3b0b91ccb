//! What rays and cones in the world meet of an object, and what the object sends out.

use glam::Vec3;

use super::PlacedObject;
use super::walk::ray_origin;
use crate::geometry::norm;
use crate::tlas::{Beam, Outgoing};
use crate::warp::Variate;

/// Most triangles of an object that are all visited where a ray crosses its box, without a look at their own boxes.
/// Affects time alone. *Chosen*: the two triangles of a window have the same box.
///
/// Larger: triangles are intersected whose boxes are not crossed. Smaller: the ray is mapped and a tree walked where
/// nothing is gained by it.
const FEW: usize = 2;

impl PlacedObject<'_> {
    /// Visits every triangle, by its leaf, whose box a ray crosses. `direction` need not be a unit vector.
    pub(crate) fn cross(&self, origin: Vec3, direction: Vec3, visit: impl FnMut(u32)) {
        if self.object.len() <= FEW {
            return (0..self.count()).for_each(visit);
        }
        let placement = self.placement();
        let (origin, margin) = ray_origin(&placement, origin);
        let direction = (placement.inverse * direction.as_dvec3()).normalize_or_zero().as_vec3();
        self.object.tree().cross_within(origin, direction, margin, visit);
    }

    /// Visits every triangle, by its leaf, whose box may hold a point in a cone around a unit vector, with an angular
    /// radius of this sine and cosine.
    ///
    /// The map makes an elliptic cone of it. A direction `a + τ`, with τ across the axis a and no longer than `tan r`,
    /// is mapped to within `asin(‖M⁻¹‖ tan r / |M⁻¹ a|)` of the image of the axis.
    pub(crate) fn meet(&self, origin: Vec3, axis: Vec3, [sin, cos]: [f32; 2], visit: impl FnMut(u32)) {
        let placement = self.placement();
        let (origin, margin) = ray_origin(&placement, origin);
        let image = placement.inverse * axis.as_dvec3();
        let own_sin = norm(&placement.inverse) * f64::from(sin) / (f64::from(cos) * image.length());
        // NaN fails.
        if cos > 0.0 && own_sin < 1.0 {
            let cone = [own_sin as f32, crate::math::sqrt64(1.0 - own_sin * own_sin) as f32];
            let axis = image.normalize_or_zero().as_vec3();
            self.object.tree().meet_within(origin, axis, cone, margin, visit);
        } else {
            (0..self.object.len() as u32).for_each(visit);
        }
    }

    /// Draws a triangle by what it sends out, with its probability.
    pub(crate) fn sample_outgoing(&self, outgoing: &Outgoing, u: &mut Variate) -> Option<(u32, f64)> {
        self.object.tree().sample_outgoing(&self.own_outgoing(outgoing), u)
    }

    /// Returns the probability with which [`Self::sample_outgoing`] draws a triangle.
    pub(crate) fn pmf_outgoing(&self, below: u32, outgoing: &Outgoing) -> f64 {
        self.object.tree().pmf_outgoing(below, &self.own_outgoing(outgoing))
    }

    /// Returns which light leaves, in the object's space. The area that a triangle turns towards a beam is in
    /// proportion to that which it turns there towards the beam's image, for all triangles alike.
    fn own_outgoing(&self, outgoing: &Outgoing) -> Outgoing {
        match outgoing {
            Outgoing::Diffuse => Outgoing::Diffuse,
            Outgoing::Beam(beam) => {
                let direction = self.placement().inverse * beam.direction.as_dvec3();
                Outgoing::Beam(Beam { direction: direction.normalize_or_zero().as_vec3(), ..*beam })
            }
        }
    }
}
