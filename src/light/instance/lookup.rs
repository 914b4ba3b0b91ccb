//! Ways from ids to the triangles of instances and back, and what is asked of a light whether it belongs to an instance
//! or not.

use glam::Vec3;

use super::{PlacedObject, PlacedTriangle, records};
use crate::light::{LightKind, LightLeaf, LightTriangle, LightsView, LocalPoint, NO_LEAF};
use crate::receiver::ShadingPoint;
use crate::record::{InstanceId, TriangleId};

impl PlacedObject<'_> {
    /// Returns all triangles in their places, rounded to single precision, with their fronts as the order of their
    /// vertices says. What else they hold counts for nothing.
    pub(in crate::light) fn flattened(&self) -> impl Iterator<Item = LightTriangle> {
        let is_mirrored = self.placement().is_mirrored();
        (0..self.object.len() as u32).map(move |below| {
            let triangle = self.triangle(below);
            let [a, b, c] = triangle.exactly_relative_to(Vec3::ZERO).map(|vertex| vertex.as_vec3().to_array());
            LightTriangle { vertices: if is_mirrored { [a, c, b] } else { [a, b, c] }, ..*triangle.record }
        })
    }
}

impl<'a> LightsView<'a> {
    /// Whether any light belongs to an instance.
    #[inline(always)]
    pub(crate) fn has_instances(&self) -> bool {
        !self.instances.is_empty()
    }

    /// Number of lights, where each triangle of an object counts once for each instance.
    pub(crate) fn count(&self) -> usize {
        let placed = records(self.instances).iter().filter(|instance| instance.leaf != NO_LEAF);
        let within = placed.map(|instance| PlacedObject::new(instance, self.instances).object.len() - 1);
        within.fold(self.len(), usize::saturating_add)
    }

    /// Whether a leaf is an instance.
    #[inline(always)]
    pub(crate) fn is_instance(&self, leaf: u32) -> bool {
        self.records[leaf as usize].instance().is_some()
    }

    /// Returns the instance in a leaf; `None` for a light of its own.
    #[inline]
    pub(crate) fn instance(&self, leaf: u32) -> Option<PlacedObject<'a>> {
        let number = self.records[leaf as usize].instance()?;
        Some(PlacedObject::at(self.instances, number).moving(self.extras(), number, self.time))
    }

    /// Returns the leaf of a triangle of an instance; `None` for one that emits nothing or that was never added.
    #[inline(never)]
    pub(crate) fn leaf_within(&self, id: InstanceId, triangle: TriangleId) -> Option<LightLeaf> {
        let record = records(self.instances).get(id.0 as usize).filter(|record| record.leaf != NO_LEAF)?;
        let below = PlacedObject::new(record, self.instances).object.leaf(triangle)?;
        Some(LightLeaf::within(record.leaf, below))
    }

    /// Returns the ids of a triangle of an instance.
    #[inline(never)]
    pub(in crate::light) fn id_within(
        &self,
        leaf: LightLeaf,
        placed: &PlacedObject<'a>,
    ) -> (TriangleId, Option<InstanceId>) {
        let number = self.records[leaf.top as usize].instance().unwrap_or_default();
        let triangle = placed.object.id(&placed.object.records()[leaf.below().unwrap_or_default() as usize]);
        (triangle, Some(InstanceId(number)))
    }

    /// Returns the irradiance from the light in a leaf if it has unit radiance, per area of the light
    /// ([`LightKind::irradiance_per_area`]).
    #[inline]
    pub(crate) fn irradiance_per_area(&self, leaf: u32, x: &ShadingPoint) -> f32 {
        if let Some(triangle) = self.still(leaf) {
            return triangle.irradiance_per_area(x);
        }
        match self.instance(leaf) {
            Some(placed) => placed.irradiance_per_area(x),
            None => self.light(leaf).irradiance_per_area(x),
        }
    }

    /// Whether the environment shines in through a light.
    #[inline]
    pub(crate) fn is_portal(&self, leaf: LightLeaf) -> bool {
        match self.still(leaf.top) {
            Some(triangle) => triangle.is_portal(),
            None => self.is_other_portal(leaf),
        }
    }

    #[inline(never)]
    fn is_other_portal(&self, leaf: LightLeaf) -> bool {
        match self.placed(leaf) {
            None => self.light(leaf.top).is_portal(),
            Some(triangle) => triangle.is_portal(),
        }
    }

    /// Whether anything can travel from a light to the shading point.
    #[inline]
    pub(crate) fn is_visible(&self, leaf: LightLeaf, x: &ShadingPoint) -> bool {
        match self.placed(leaf) {
            None => self.light(leaf.top).is_visible(x),
            Some(triangle) => triangle.is_visible(x),
        }
    }

    /// Returns the point where a ray crosses a light, if it does. `direction` need not be a unit vector.
    #[inline]
    pub(crate) fn intersect(&self, leaf: LightLeaf, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        match self.still(leaf.top) {
            Some(triangle) => triangle.intersect(origin, direction),
            None => self.intersect_other(leaf, origin, direction),
        }
    }

    #[inline(never)]
    fn intersect_other(&self, leaf: LightLeaf, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        match self.placed(leaf) {
            None => self.light(leaf.top).intersect(origin, direction),
            Some(triangle) => triangle.intersect(origin, direction),
        }
    }

    /// Returns the triangle of an instance; `None` for a light of its own.
    #[inline(always)]
    pub(in crate::light) fn placed(&self, leaf: LightLeaf) -> Option<PlacedTriangle<'a>> {
        let below = leaf.below()?;
        self.instance(leaf.top).map(|placed| placed.triangle(below))
    }
}
