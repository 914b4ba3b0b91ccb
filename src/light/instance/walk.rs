//! The walk through an object's own light tree, for a shading point in the world.
//!
//! The tree is walked in the object's space. For a rotation with a uniform scale, weights there are those in the world;
//! for any other map, and where the receiver has a lobe, a [`PlacedLobe`] makes them so. Whatever the tree asks about
//! single triangles and about the environment is answered in the world.

use glam::Vec3;

use super::{Object, PlacedObject, PlacedTriangle};
use crate::env::EnvironmentView;
use crate::geometry::{Placement, norm};
use crate::light::LightTriangle;
use crate::light::triangle_view::FARTHEST_POINT;
use crate::math::{at_least, only_if};
use crate::receiver::{PlacedLobe, RoundedPoint, ShadingPoint, for_lobe, own_receiver};
use crate::tlas::{FactorBytes, LeafOracle, MAX_LANES, TlasView};
use crate::warp::Variate;

/// How far rounding moves a shading point along an axis when it is mapped, relative to its largest coordinate.
/// *Proved*: half a unit in the last place is 6e-8, and the map itself is in double precision. Larger: less is culled.
const POINT_ROUNDING: f32 = 1.5e-7;

/// Margin of a shading point so far away in the object's space that it is moved nearer, relative to its distance.
/// *Proved*: the object's coordinates, up to 1e9, are 1e-6 of that.
const FAR_ROUNDING: f32 = 1e-5;

/// An object's light tree, as it is walked for one shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectWalk<'a> {
    tree: TlasView<'a>,
    /// Triangles, in the order of the tree's leaves.
    records: &'a [LightTriangle],
    object: Object<'a>,
    pub(super) placement: Placement,
    /// Shading point in the world.
    x: ShadingPoint,
    /// Shading point in the object's space, without a lobe.
    own: ShadingPoint,
    /// Length that the normal had in the object's space.
    normal_length: f64,
    /// How far rounding may have moved the shading point.
    margin: f32,
    /// Whether weights in the object's space are those in the world.
    is_simple: bool,
    /// Largest factor by which the map lengthens; 0 where portals show the same in all directions.
    largest: f32,
    /// What portals show; `None` for unit radiance.
    environment: Option<&'a EnvironmentView<'a>>,
}

/// Evaluates an expression with the lobe that makes weights in the object's space those in the world.
macro_rules! for_own_lobe {
    ($walk:expr, $lobe:ident => $call:expr) => {
        if $walk.is_simple {
            let $lobe = RoundedPoint { margin: $walk.margin };
            $call
        } else {
            let (receiver, normal_length) = ($walk.x.receiver, $walk.normal_length);
            for_lobe!(receiver, inner => {
                let $lobe = PlacedLobe::new(&$walk.placement, receiver, normal_length, $walk.margin, inner);
                $call
            })
        }
    };
}

impl<'a> ObjectWalk<'a> {
    /// Prepares a walk; `None` where nothing can arrive. `environment` is what portals show, or `None` for unit
    /// radiance.
    pub(crate) fn new(
        placed: &PlacedObject<'a>,
        x: &ShadingPoint,
        environment: Option<&'a EnvironmentView<'a>>,
    ) -> Option<Self> {
        // NaN fails.
        if !x.position.to_array().iter().all(|x| x.abs() <= FARTHEST_POINT) {
            return None;
        }
        let (placement, parts) = (placed.placement(), placed.object.parts());
        let (receiver, normal_length) = own_receiver(x.receiver, &placement.linear);
        let (position, margin) = own_position(&placement, x.position);
        let shows_an_image = environment.is_some_and(|environment| !environment.is_constant());
        Some(Self {
            tree: parts.tree,
            records: parts.records,
            object: placed.object,
            x: *x,
            own: ShadingPoint { position, receiver, ..*x },
            normal_length,
            margin,
            is_simple: !x.receiver.has_lobe() && placement.is_similarity(),
            largest: if shows_an_image { norm(&placement.linear) as f32 } else { 0.0 },
            placement,
            environment,
        })
    }

    /// Draws a triangle of the object. Returns its leaf with its probability; `None` where nothing can arrive from the
    /// part of the object that `u` leads to.
    pub(crate) fn sample(&self, u: &mut Variate) -> Option<(u32, f64)> {
        for_own_lobe!(self, lobe => self.tree.sample_by(self, lobe, u))
    }

    /// Returns the probability with which [`Self::sample`] draws a triangle.
    pub(crate) fn pmf(&self, below: u32) -> f64 {
        for_own_lobe!(self, lobe => self.tree.pmf_by(below, self, lobe))
    }

    /// Returns an estimate of the irradiance, in units of the object's energy in its own space. Zero only if nothing
    /// can arrive.
    pub(crate) fn irradiance(&self) -> f32 {
        let sum = for_own_lobe!(self, lobe => self.tree.irradiance_by(self, lobe));
        sum.unwrap_or_else(|| self.irradiance_of_one())
    }

    /// Returns the irradiance from the only triangle.
    fn irradiance_of_one(&self) -> f32 {
        if self.object.len() == 0 || !LeafOracle::is_visible(self, 0) {
            return 0.0;
        }
        let triangle = self.triangle(0);
        let mut radiance = [1.0];
        if let (true, Some(_)) = (triangle.is_portal(), self.environment) {
            let [low, high] = self.object.corners();
            let center = 0.5 * (low + high) - self.own.position;
            let [x, y, z] = center.to_array().map(|value| [value]);
            self.radiances([&x, &y, &z], &[0.5 * (high - low).length()], 1, &mut radiance);
        }
        at_least(triangle.irradiance_per_own_area(&self.x), f32::MIN_POSITIVE) * radiance[0]
    }

    fn triangle(&self, below: u32) -> PlacedTriangle<'a> {
        PlacedTriangle::new(&self.records[below as usize], self.placement.forward())
    }
}

/// Returns a point of the world in the object's space, and how far rounding may have moved it along each axis.
fn own_position(placement: &Placement, position: Vec3) -> (Vec3, f32) {
    let own = placement.own_point(position);
    let size = own.abs().max_element();
    if size > f64::from(FARTHEST_POINT) {
        // Directions from there are about those from farther away.
        let near = (own * (f64::from(FARTHEST_POINT) / size)).as_vec3();
        return (near, FAR_ROUNDING * FARTHEST_POINT);
    }
    (own.as_vec3(), POINT_ROUNDING * size as f32)
}

/// Returns a point of the world in an object's space with its margin, for rays.
pub(super) fn ray_origin(placement: &Placement, position: Vec3) -> (Vec3, f32) {
    own_position(placement, position)
}

impl LeafOracle for ObjectWalk<'_> {
    #[inline(always)]
    fn shading_point(&self) -> &ShadingPoint {
        &self.own
    }

    #[inline(always)]
    fn radiances(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, radiances: &mut [f32]) {
        let Some(environment) = self.environment else { return radiances.fill(1.0) };
        let mean = environment.mean_without_features();
        let count = radii.len().min(MAX_LANES);
        if mean <= 0.0 || count < radii.len() {
            return radiances.fill(0.0);
        }
        let [a, b, c] = self.placement.linear.to_cols_array_2d().map(|column| column.map(|value| value as f32));
        let (mut mapped, mut mapped_radii) = ([[0.0; MAX_LANES]; 3], [0.0; MAX_LANES]);
        for i in 0..count {
            for axis in 0..3 {
                mapped[axis][i] = a[axis] * centers[0][i] + b[axis] * centers[1][i] + c[axis] * centers[2][i];
            }
            mapped_radii[i] = self.largest * (radii[i] + 2.0 * self.margin);
        }
        let [x, y, z] = &mapped;
        environment.radiances_of_balls([&x[..count], &y[..count], &z[..count]], &mapped_radii[..count], set, radiances);
        // What is not black stays so, however bright the rest is.
        let relative = |value: f32| only_if(value > 0.0, at_least(value / mean, f32::MIN_POSITIVE));
        radiances.iter_mut().for_each(|radiance| *radiance = relative(*radiance));
    }

    #[inline(always)]
    fn has_shaped_leaves(&self) -> bool {
        false
    }

    #[inline(always)]
    fn has_factors(&self) -> bool {
        false
    }

    // What is learned is about the tree over all lights.
    #[inline(always)]
    fn factors(&self, _node: u32) -> Option<&FactorBytes> {
        None
    }

    fn is_visible(&self, leaf: u32) -> bool {
        self.triangle(leaf).is_visible(&self.x)
    }

    fn irradiance_per_area(&self, leaf: u32) -> f32 {
        self.triangle(leaf).irradiance_per_own_area(&self.x)
    }
}
