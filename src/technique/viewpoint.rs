//! Everything that techniques draw from, and the same as seen from one shading point.

use core::f64::consts::PI;

use glam::Vec3;

use crate::env::{EnvironmentView, RegionMoments};
use crate::light::{
    FARTHEST_POINT, FewTriangles, LightKind, LightLeaf, LightPoint, LightView, LightsView, LocalPoint, MOST_FEW,
};
use crate::math::{at_least, only_if};
use crate::receiver::ShadingPoint;
use crate::record::LightSample;
use crate::tlas::{FactorBytes, LeafOracle, TlasView};
use crate::visibility::RegionFactors;

/// The lights of a scene with the structures over them, all borrowed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightScene<'a> {
    /// The tree over the lights.
    pub(crate) tlas: TlasView<'a>,
    /// The lights, in the order of the tree's leaves.
    pub(crate) lights: LightsView<'a>,
    /// What the portals show.
    pub(crate) environment: EnvironmentView<'a>,
    /// What the regions of the environment send, if the environment is a light itself and not black.
    pub(crate) sky: Option<&'a RegionMoments>,
}

impl<'a> LightScene<'a> {
    /// Whether bright features of the environment may be seen through portals.
    #[inline]
    pub(crate) fn has_features(&self) -> bool {
        self.lights.has_portals && !self.environment.feature_nodes().is_empty()
    }

    /// Whether there may be a technique besides the trees.
    #[inline]
    pub(crate) fn has_more_than_trees(&self) -> bool {
        self.sky.is_some() || self.has_features() || !self.lights.extras().is_empty()
    }

    /// The environment, if what portals show depends on the direction.
    #[inline]
    pub(crate) fn directional_environment(&self) -> Option<&EnvironmentView<'a>> {
        (!self.environment.is_constant()).then_some(&self.environment)
    }

    /// Visits all points of the wanted lights that a ray crosses. `direction` need not be a unit vector.
    pub(crate) fn cross(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut is_wanted: impl FnMut(LightLeaf) -> bool,
        mut visit: impl FnMut(LightPoint),
    ) {
        let mut visit_leaf = |leaf: LightLeaf| {
            let point = if is_wanted(leaf) { self.lights.intersect(leaf, origin, direction) } else { None };
            if let Some(point) = point {
                visit(LightPoint { leaf, point });
            }
        };
        if self.lights.has_instances() {
            self.tlas.cross(origin, direction, |leaf| {
                self.visit_within(leaf, &mut visit_leaf, |placed, visit| placed.cross(origin, direction, visit));
            });
        } else {
            self.tlas.cross(origin, direction, |leaf| visit_leaf(LightLeaf::alone(leaf)));
        }
    }
}

/// The lights as seen from one shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint<'a> {
    pub(crate) scene: LightScene<'a>,
    pub(crate) x: ShadingPoint,
    /// What is known of what walls hide from the region of the point.
    pub(crate) visibility: Option<RegionFactors<'a>>,
}

impl Viewpoint<'_> {
    /// Whether anything can arrive at the position at all.
    #[inline]
    pub(crate) fn is_somewhere(&self) -> bool {
        self.x.position.abs().cmple(Vec3::splat(FARTHEST_POINT)).all()
    }

    /// Returns a light as seen from here; `None` if nothing can arrive from it.
    #[inline]
    pub(crate) fn view(&self, leaf: LightLeaf) -> Option<LightView<'_>> {
        if !self.receives(leaf.top) {
            return None;
        }
        self.scene.lights.view(leaf, &self.x, self.scene.directional_environment())
    }

    /// Whether the lights may be a few triangles that need no tree ([`FewTriangles`]).
    #[inline(always)]
    pub(crate) fn has_few(&self) -> bool {
        self.scene.lights.len() <= MOST_FEW && !self.scene.lights.has_portals
    }

    /// Returns the lights if they are a few triangles that need no tree.
    #[inline(always)]
    fn few(&self) -> Option<FewTriangles<'_>> {
        if self.scene.sky.is_some() || self.visibility.is_some() {
            return None;
        }
        FewTriangles::new(&self.scene.lights, &self.x)
    }

    /// Draws a sample of a few triangles; `Some(None)` where nothing arrives. `None` where the tree has to be asked.
    #[inline(never)]
    pub(crate) fn sample_few(&self, u: [f32; 3]) -> Option<Option<LightSample>> {
        self.few()?.sample(u)
    }

    /// Returns the probability of one of a few triangles, and the density per solid angle of a point of it. `None` where
    /// the tree has to be asked.
    #[inline(never)]
    pub(crate) fn density_of_few(&self, leaf: LightLeaf, point: LocalPoint) -> Option<[f64; 2]> {
        self.few()?.density(leaf.top, point.lattice())
    }

    /// Estimates the irradiance from all that is infinitely far away and needs no portal: the same at all places.
    pub(crate) fn irradiance_everywhere(&self) -> f64 {
        let extras = self.scene.lights.extras();
        let receives = |groups: u32| groups & self.x.groups != 0;
        let distants = extras.distants().iter().filter(|light| receives(light.groups));
        let distant: f64 = distants.map(|light| f64::from(light.weigh(self.x.receiver))).sum();
        let is_lit = self.scene.sky.is_some() && receives(extras.groups_of_environment());
        distant + if is_lit { 4.0 * PI * f64::from(self.scene.environment.mean()) } else { 0.0 }
    }

    /// Whether the shading point receives any of the light groups that a light is in.
    #[inline(always)]
    pub(crate) fn receives(&self, leaf: u32) -> bool {
        self.scene.lights.extras().groups_of(leaf) & self.x.groups != 0
    }
}

impl LeafOracle for Viewpoint<'_> {
    #[inline(always)]
    fn shading_point(&self) -> &ShadingPoint {
        &self.x
    }

    #[inline(always)]
    fn radiances(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, radiances: &mut [f32]) {
        let mean = self.scene.environment.mean_without_features();
        if mean <= 0.0 {
            return radiances.fill(0.0);
        }
        self.scene.environment.radiances_of_balls(centers, radii, set, radiances);
        // What is not black stays so, however bright the rest is.
        let relative = |value: f32| only_if(value > 0.0, at_least(value / mean, f32::MIN_POSITIVE));
        radiances.iter_mut().for_each(|radiance| *radiance = relative(*radiance));
    }

    #[inline(always)]
    fn has_shaped_leaves(&self) -> bool {
        self.scene.lights.has_lamps
    }

    #[inline]
    fn is_visible(&self, leaf: u32) -> bool {
        let lights = &self.scene.lights;
        // As with any cluster of lights, that of an instance is left to what is inside.
        lights.energy > 0.0
            && self.receives(leaf)
            && (lights.is_instance(leaf) || lights.light(leaf).is_visible(&self.x))
    }

    fn irradiance_per_area(&self, leaf: u32) -> f32 {
        self.scene.lights.irradiance_per_area(leaf, &self.x)
    }

    #[inline(always)]
    fn has_factors(&self) -> bool {
        self.visibility.is_some()
    }

    #[inline(always)]
    fn factors(&self, node: u32) -> Option<&FactorBytes> {
        self.node_factors(node)
    }
}
