//! The lights: one file a kind, one enum, and the buffers that hold the lights of a scene.
//!
//! Everything that depends on the kind of a light is a method of [`LightKind`] (the light itself) or of
//! [`LightViewKind`] (the light as seen from a shading point). Above this level a light is the number of a leaf. A new
//! kind is a new file, and a variant in both enums.

mod cell_kernel;
mod collect;
mod crossing;
mod distant;
mod distant_record;
mod edit;
mod emitted;
mod energy;
mod extras;
mod few;
mod illumination;
mod instance;
mod lamp;
mod leaf;
mod linear_density;
mod mesh;
mod meshes;
mod motion;
mod near_texture;
mod profile;
mod profile_values;
mod profiles;
mod projected_part;
mod projection;
mod spherical_grid;
mod triangle;
mod triangle_sampling;
mod triangle_view;
mod update;
mod validate;
mod visible_part;

use glam::{DVec3, Vec3};

use crate::blas::{CellNode, Lattice};
use crate::bounds::{LightBounds, Moments};
use crate::buffers::buffers;
use crate::env::EnvironmentView;
use crate::receiver::ShadingPoint;
use crate::record::{Hit, LightId, MeshId, SampledLight, TriangleId};
use crate::simd::prefetch;
use crate::warp::Variate;

pub(crate) use collect::LightCollection;
pub(crate) use distant::MOST_GROUPS;
pub(crate) use distant_record::{DistantGroup, DistantRecord};
pub(crate) use edit::{EditState, Edited, LightChanges, Unplaced, laid_out};
pub(crate) use emitted::{EmissionStart, EmittedRay};
pub(crate) use energy::Energies;
pub(crate) use extras::Extras;
pub(crate) use few::{FewTriangles, MOST_FEW};
pub use illumination::Illumination;
pub use instance::Instance;
pub(crate) use instance::{ObjectWalk, PlacedObject, PlacedTriangle};
pub(crate) use lamp::LampView;
use lamp::irradiance_of_cap;
pub use lamp::{DiskLight, DistantLight, Lamp, PointLight, ProfileLight, SphereLight, SpotLight, TubeLight};
use lamp::{LampLight, LampRecord};
pub(crate) use leaf::LightLeaf;
pub use mesh::{Mesh, MeshUpdate, Sides, Weight};
use meshes::{mesh_of, scale_of};
pub(crate) use motion::MovingTriangle;
pub use profile::Profile;
pub use projection::Projection;
pub(crate) use triangle::{LightTriangle, POSITION_LIMIT};
pub(crate) use triangle_view::{FARTHEST_POINT, TriangleView};

/// Marks a triangle that is not in the tree because it emits nothing, whatever its shape. *Format.*
pub(crate) const NO_LEAF: u32 = u32::MAX;
/// Marks a triangle that is not in the tree because it has no area. *Format.*
pub(crate) const NO_AREA: u32 = u32::MAX - 1;

buffers! {
    /// The lights of a scene.
    pub(crate) Lights,
    /// The lights of a scene in borrowed memory.
    LightsView
    plain {
        /// Term that guides the descent inside a triangle.
        illumination: Illumination,
        /// Energy of all lights together, without the environment's bright features: weight times area, times mean
        /// radiance for portals. Zero only if nothing is emitted.
        energy: f32,
        /// Whether any light is a portal.
        has_portals: bool,
        /// Whether any light is a lamp.
        has_lamps: bool,
        /// Whether a ray is known to meet at most one light that shines back along it.
        is_crossed_once: bool,
        /// Time in the shutter interval, from 0 to 1, at which lights are looked up.
        time: f32,
        /// Whether edits may have left places free: then bytes hold another layout.
        is_edited: bool,
    }
    buffers {
        /// Triangles, and lamps in records of the same size, in the order of the tree's leaves.
        records: LightTriangle = b"TRIA" version 1,
        /// Nodes of the trees over textures.
        cells: CellNode = b"CELL" version 2,
        /// Where the triangles of each mesh start in `leaf_of`, and their number at the end.
        meshes: u32 = b"MESH" version 1,
        /// Leaf of every triangle that was added, [`NO_LEAF`] or [`NO_AREA`]; then the leaf of every lamp or
        /// [`NO_LEAF`].
        leaf_of: u32 = b"LEAF" version 1,
        /// What the weights of each mesh have been multiplied by since the build. Empty if they have not.
        scales: f32 = b"SCAL" version 1,
        /// Light groups, profiles, distant lights and what moves: see [`Extras`].
        extras: u32 = b"XTRA" version 2,
        /// Instances and the objects that they place, as words (see [`instance`]). Empty without instances.
        instances: u32 = b"INST" version 1,
    }
}

/// A light of any kind.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light<'a> {
    /// A triangle of an emissive mesh or of a portal.
    Triangle(&'a LightTriangle),
    /// Anything else.
    Lamp(LampLight<'a>),
    /// An object in its place.
    Instance(PlacedObject<'a>),
    /// A triangle whose vertices move, at a time.
    Moving(MovingTriangle<'a>),
}

/// A light of any kind as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LightView<'a> {
    /// A triangle of an emissive mesh or of a portal.
    Triangle(TriangleView<'a>),
    /// Anything else.
    Lamp(LampView),
}

/// A point of a light in the light's own terms: the barycentric coordinates of a point of a triangle, or the direction
/// from the shading point to a point of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LocalPoint([u32; 3]);

impl LocalPoint {
    /// Returns the point of a triangle.
    #[inline(always)]
    pub(crate) fn on_triangle(point: Lattice) -> Self {
        Self(point.0)
    }

    /// Returns the coordinates of a point of a triangle.
    #[inline(always)]
    pub(crate) fn lattice(self) -> Lattice {
        Lattice(self.0)
    }

    /// Any point of a lamp, where it makes no difference which.
    pub(crate) const NONE: Self = Self([0; 3]);

    /// Returns the point in a direction.
    #[inline]
    fn from_direction(direction: Vec3) -> Self {
        Self(direction.to_array().map(f32::to_bits))
    }

    /// Returns the direction to a point of a lamp.
    #[inline]
    fn to_direction(self) -> Vec3 {
        Vec3::from_array(self.0.map(f32::from_bits))
    }
}

/// A point on a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightPoint {
    pub(crate) leaf: LightLeaf,
    pub(crate) point: LocalPoint,
}

/// A point of a light that was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnPoint {
    pub(crate) point: LocalPoint,
    /// Relative to the shading point. The lattice's own point, except where the lattice is too coarse to tell
    /// directions apart.
    pub(crate) relative: DVec3,
    /// Density per solid angle with which the point is drawn; the probability of a lamp without an extent, which is 1.
    pub(crate) pdf: f64,
}

/// What a light of any kind says of itself.
pub(crate) trait LightKind {
    /// Whether the environment shines in through the light.
    fn is_portal(&self) -> bool;

    /// Whether the light emits from its back as well.
    fn is_two_sided(&self) -> bool;

    /// Returns the average weight: radiance of an emitter, transmittance of a portal, intensity of what has no extent.
    fn weight(&self) -> f32;

    /// Returns the area that light leaves from, once for lights of two sides. For a light without an extent, the number
    /// that makes its weight compete.
    fn area(&self) -> f32;

    /// Returns bounds and moments. `energy` gives the energy by the area; `directional` says whether it depends on the
    /// direction.
    fn bounds(&self, directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments);

    /// Whether anything can travel from the light to the shading point.
    fn is_visible(&self, x: &ShadingPoint) -> bool;

    /// Returns the irradiance from a light of unit radiance, per area of the light, exact as far as `f32` goes.
    /// Rounding may make it zero.
    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32;

    /// Returns the point where a ray crosses the light, if it does. `direction` need not be a unit vector.
    fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint>;
}

/// What a light of any kind says of itself to a shading point.
pub(crate) trait LightViewKind {
    /// Draws a point of the light; `None` where nothing can arrive from the part of the light that the variates lead
    /// to.
    fn sample(&self, u: [Variate; 2]) -> Option<DrawnPoint>;

    /// Returns the density per solid angle with which [`Self::sample`] draws a point, if that is positive.
    fn pdf(&self, point: LocalPoint) -> Option<f64>;

    /// Returns a point of the light relative to the shading point.
    fn point(&self, point: LocalPoint) -> DVec3;

    /// Returns the unit direction to a point of the light, of which place and distance are given.
    fn direction(&self, point: LocalPoint, relative: DVec3, distance: f64) -> Vec3;

    /// Returns the unit normal of the front side in a point relative to the shading point.
    fn normal(&self, point: DVec3) -> Vec3;

    /// Returns the solid angle at the shading point per area of the light at this place: `cos θl / d²`; 1 for a light
    /// without an extent.
    fn solid_angle_per_area(&self, point: DVec3) -> f64;

    /// Returns an estimate of the irradiance from the light if this is its weight. Zero only if nothing can arrive.
    fn irradiance(&self, weight: f32) -> f32;
}

/// Calls the same method of whichever kind a light is.
macro_rules! dispatch {
    (Light, $light:expr, $kind:ident => $call:expr) => {
        match $light {
            Light::Triangle($kind) => $call,
            Light::Lamp($kind) => $call,
            Light::Instance($kind) => $call,
            Light::Moving($kind) => $call,
        }
    };
    ($enum:ident, $light:expr, $kind:ident => $call:expr) => {
        match $light {
            $enum::Triangle($kind) => $call,
            $enum::Lamp($kind) => $call,
        }
    };
}

impl LightKind for Light<'_> {
    #[inline]
    fn is_portal(&self) -> bool {
        dispatch!(Light, self, kind => kind.is_portal())
    }

    #[inline]
    fn is_two_sided(&self) -> bool {
        dispatch!(Light, self, kind => kind.is_two_sided())
    }

    #[inline]
    fn weight(&self) -> f32 {
        dispatch!(Light, self, kind => kind.weight())
    }

    fn area(&self) -> f32 {
        dispatch!(Light, self, kind => kind.area())
    }

    #[inline]
    fn bounds(&self, directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments) {
        dispatch!(Light, self, kind => kind.bounds(directional, energy))
    }

    #[inline]
    fn is_visible(&self, x: &ShadingPoint) -> bool {
        dispatch!(Light, self, kind => kind.is_visible(x))
    }

    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32 {
        dispatch!(Light, self, kind => kind.irradiance_per_area(x))
    }

    #[inline]
    fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        dispatch!(Light, self, kind => kind.intersect(origin, direction))
    }
}

impl LightViewKind for LightView<'_> {
    #[inline(always)]
    fn sample(&self, u: [Variate; 2]) -> Option<DrawnPoint> {
        dispatch!(LightView, self, kind => kind.sample(u))
    }

    #[inline]
    fn pdf(&self, point: LocalPoint) -> Option<f64> {
        dispatch!(LightView, self, kind => kind.pdf(point))
    }

    #[inline]
    fn point(&self, point: LocalPoint) -> DVec3 {
        dispatch!(LightView, self, kind => kind.point(point))
    }

    #[inline]
    fn direction(&self, point: LocalPoint, relative: DVec3, distance: f64) -> Vec3 {
        dispatch!(LightView, self, kind => kind.direction(point, relative, distance))
    }

    #[inline]
    fn normal(&self, point: DVec3) -> Vec3 {
        dispatch!(LightView, self, kind => kind.normal(point))
    }

    #[inline]
    fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        dispatch!(LightView, self, kind => kind.solid_angle_per_area(point))
    }

    fn irradiance(&self, weight: f32) -> f32 {
        dispatch!(LightView, self, kind => kind.irradiance(weight))
    }
}

impl LightView<'_> {
    /// Returns the view as that of a portal; `None` for kinds of lights that are none.
    #[inline]
    pub(crate) fn as_portal(&self) -> Option<&TriangleView<'_>> {
        match self {
            Self::Triangle(view) => Some(view),
            Self::Lamp(_) => None,
        }
    }
}

impl<'a> Light<'a> {
    /// Returns the light of a record at a time.
    #[inline(always)]
    fn of(record: &'a LightTriangle, extras: Extras<'a>, instances: &'a [u32], time: f32) -> Self {
        if record.index_and_flags & LightTriangle::LAMP == 0 {
            Light::Triangle(record)
        } else if let Some(instance) = record.instance() {
            Light::Instance(PlacedObject::at(instances, instance).moving(extras, instance, time))
        } else if record.index_and_flags & LightTriangle::MOVING != 0 {
            Light::Moving(MovingTriangle::new(record, extras.motion(), time))
        } else {
            Light::Lamp(LampLight { record: bytemuck::cast_ref(record), extras })
        }
    }

    /// Returns the record of the triangle, wherever it moves; `None` for anything else.
    #[inline(always)]
    fn triangle(self) -> Option<&'a LightTriangle> {
        match self {
            Self::Triangle(triangle) => Some(triangle),
            Self::Moving(moving) => Some(moving.record),
            Self::Lamp(_) | Self::Instance(_) => None,
        }
    }

    /// Returns what the weight of the light is multiplied by, by the factors of the meshes.
    #[inline]
    fn scale(self, factors: &[f32], meshes: &[u32]) -> f32 {
        match self {
            Self::Triangle(triangle) => scale_of(factors, meshes, triangle.index()),
            Self::Moving(moving) => scale_of(factors, meshes, moving.record.index()),
            Self::Lamp(_) => 1.0,
            Self::Instance(placed) => placed.weight(),
        }
    }
}

impl LightPoint {
    /// Returns the point of a triangle with barycentrics that may have been rounded.
    #[inline]
    pub(crate) fn new(leaf: LightLeaf, barycentrics: [f32; 2]) -> Self {
        Self { leaf, point: LocalPoint::on_triangle(Lattice::from_barycentrics(barycentrics)) }
    }
}

impl<'a> LightsView<'a> {
    /// Number of lights.
    pub(crate) fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there is no light.
    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the light in a leaf.
    #[inline(always)]
    pub(crate) fn light(&self, leaf: u32) -> Light<'a> {
        Light::of(&self.records[leaf as usize], self.extras(), self.instances, self.time)
    }

    /// Returns what few scenes have.
    #[inline(always)]
    pub(crate) fn extras(&self) -> Extras<'a> {
        Extras(self.extras)
    }

    /// Returns a portal's vertices, and whether it has two sides; `None` for any other light.
    pub(crate) fn portal(&self, leaf: u32) -> Option<([Vec3; 3], bool)> {
        let light = self.light(leaf);
        let triangle = light.triangle().filter(|triangle| triangle.is_portal())?;
        let vertices = match light {
            Light::Moving(moving) => moving.exactly_relative_to(Vec3::ZERO).map(|vertex| vertex.as_vec3()),
            _ => triangle.triangle().0,
        };
        Some((vertices, triangle.is_two_sided()))
    }

    /// Fetches the memory of the light in a leaf, so that a later look at it does not wait.
    #[inline(always)]
    pub(crate) fn prefetch(&self, leaf: u32) {
        prefetch(&self.records[leaf as usize]);
    }

    /// Returns a light as seen from a shading point; `None` if nothing can arrive from it. `environment` is what
    /// portals show, if that depends on the direction.
    #[inline(always)]
    pub(crate) fn view<'v>(
        &self,
        leaf: LightLeaf,
        x: &ShadingPoint,
        environment: Option<&'v EnvironmentView<'v>>,
    ) -> Option<LightView<'v>>
    where
        'a: 'v,
    {
        match self.still(leaf.top) {
            Some(light) => {
                TriangleView::wrapped(light, x, self.illumination, self.cells, environment, LightView::Triangle)
            }
            None => self.view_of_other(leaf, x, environment),
        }
    }

    /// Returns a triangle of an instance as seen from a shading point.
    #[inline(never)]
    fn view_within<'v>(
        &self,
        placed: &PlacedObject<'a>,
        leaf: LightLeaf,
        x: &ShadingPoint,
        environment: Option<&'v EnvironmentView<'v>>,
    ) -> Option<LightView<'v>>
    where
        'a: 'v,
    {
        let triangle = placed.triangle(leaf.below()?);
        TriangleView::placed(&triangle, x, self.illumination, self.cells, environment, LightView::Triangle)
    }

    /// Returns the leaf of a triangle; `None` for one that emits nothing or that was never added.
    pub(crate) fn leaf(&self, id: TriangleId) -> Option<u32> {
        let mesh = id.mesh.0 as usize;
        let start = *self.meshes.get(mesh)?;
        let end = *self.meshes.get(mesh + 1)?;
        let index = start.checked_add(id.triangle).filter(|index| *index < end)?;
        self.leaf_of.get(index as usize).copied().filter(|leaf| *leaf < NO_AREA)
    }

    /// Returns the leaf of a lamp; `None` for one that emits nothing or that was never added.
    pub(crate) fn leaf_of_lamp(&self, id: LightId) -> Option<u32> {
        let index = self.meshes.last()?.checked_add(id.0)?;
        self.leaf_of.get(index as usize).copied().filter(|leaf| *leaf < NO_AREA)
    }

    /// Returns the leaf of the triangle of a hit; `None` for one that emits nothing or that was never added.
    pub(crate) fn leaf_of_hit(&self, hit: &Hit) -> Option<LightLeaf> {
        match hit.instance {
            None => self.leaf(hit.triangle).map(LightLeaf::alone),
            Some(instance) => self.leaf_within(instance, hit.triangle),
        }
    }

    /// Returns the leaf of what was sampled; `None` for the environment.
    pub(crate) fn leaf_of_sampled(&self, light: &SampledLight) -> Option<LightLeaf> {
        match light {
            SampledLight::Triangle(hit) => self.leaf_of_hit(hit),
            SampledLight::Shape(id) | SampledLight::Punctual(id) => self.leaf_of_lamp(*id).map(LightLeaf::alone),
            SampledLight::Environment => None,
        }
    }

    /// Returns what a host gets to know of a point of a light.
    #[inline]
    pub(crate) fn sampled(&self, LightPoint { leaf, point }: LightPoint) -> SampledLight {
        let (triangle, instance) = match self.light(leaf.top) {
            Light::Triangle(triangle) => (self.id(triangle), None),
            Light::Moving(moving) => (self.id(moving.record), None),
            Light::Lamp(lamp) => return lamp.record.sampled(),
            Light::Instance(placed) => self.id_within(leaf, &placed),
        };
        SampledLight::Triangle(Hit { triangle, barycentrics: point.lattice().to_barycentrics(), instance })
    }

    /// Returns the point of a lamp in a direction; `None` for a lamp without an extent, or one that emits nothing or
    /// was never added.
    pub(crate) fn point_of_lamp(&self, id: LightId, direction: Vec3) -> Option<LightPoint> {
        let leaf = self.leaf_of_lamp(id)?;
        let Light::Lamp(lamp) = self.light(leaf) else { return None };
        lamp.record
            .has_extent()
            .then(|| LightPoint { leaf: LightLeaf::alone(leaf), point: LocalPoint::from_direction(direction) })
    }

    fn id(&self, triangle: &LightTriangle) -> TriangleId {
        let index = triangle.index();
        let mesh = mesh_of(self.meshes, index);
        TriangleId::new(MeshId(mesh as u32), index.wrapping_sub(self.meshes[mesh]))
    }

    /// Returns what the weight of a light is multiplied by.
    #[inline]
    pub(crate) fn scale(&self, leaf: LightLeaf) -> f32 {
        match self.still(leaf.top) {
            Some(triangle) => scale_of(self.scales, self.meshes, triangle.index()),
            None => self.scale_of_other(leaf.top),
        }
    }
}
