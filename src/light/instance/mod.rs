//! Instances: objects that are built once and placed any number of times.
//!
//! An *object* is meshes with a light tree of their own ([`Object`]), an *instance* is an affine map and a factor
//! ([`InstanceRecord`]), and in the tree over all lights an instance is a leaf ([`PlacedObject`]). Its bounds there are
//! those of the object, mapped ([`bounds`]). Where a walk ends in such a leaf, it goes on in the object's own tree, for
//! the shading point in the object's own space ([`ObjectWalk`]), and ends in a triangle. That triangle is mapped to the
//! world ([`PlacedTriangle`]), and from there on it is a triangle like any other: trees over textures do not know its
//! shape.

mod added;
mod bounds;
mod collect;
mod cross;
mod lookup;
mod moving;
mod object;
mod triangle;
mod update;
mod validate;
mod walk;

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3};

use super::motion::EndColumns;
use super::{LightKind, LocalPoint, POSITION_LIMIT};
use crate::blas;
use crate::bounds::{LightBounds, Moments, storable};
use crate::error::{Error, ErrorKind};
use crate::geometry::{Placement, norm};
use crate::receiver::{ALL_GROUPS, ShadingPoint};
use crate::record::ObjectId;

pub(super) use added::AddedObject;
pub(super) use object::{Object, emits, object_records_mut, object_starts};
pub(crate) use triangle::PlacedTriangle;
pub(crate) use walk::ObjectWalk;

/// Largest ratio of the longest to the shortest image of a unit vector. *Chosen*: shading points are rounded to single
/// precision in the object's space.
///
/// Larger: flat images of objects are accepted whose triangles, seen from the side, are chosen by rounding. Smaller:
/// what can be sampled is refused.
const LARGEST_CONDITION: f64 = 1e6;

/// Largest factor by which a map may lengthen or shorten. *Proved*: determinants and their squares are normal numbers
/// in single precision.
///
/// Larger: weights could overflow. Smaller: objects modeled in tiny or huge units are refused.
const LARGEST_SCALE: f64 = 1e12;

/// An object at a place: see [`add_instance`](crate::LightSamplerBuilder::add_instance).
///
/// The transform maps the object's space to the world. It may be any affine map that can be inverted: rotation, uniform
/// and non-uniform scale, mirror image, shear. The front of a triangle stays its front, in a mirror image as well.
/// Weights are not affected by the transform: radiance stays radiance, and an object that is scaled to twice its size
/// sends four times the power.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Instance {
    pub(super) object: ObjectId,
    pub(super) transform: Affine3A,
    pub(super) scale: f32,
    pub(super) groups: u32,
    /// Transform at the end of the shutter interval; `None` for an instance that stands still.
    end: Option<Affine3A>,
}

impl Instance {
    /// Returns an object at the place that a transform maps it to.
    pub const fn new(object: ObjectId, transform: Affine3A) -> Self {
        Self { object, transform, scale: 1.0, groups: ALL_GROUPS, end: None }
    }

    /// Multiplies the weights of the object's meshes, 1 until this sets it: finite, not negative. 0 switches the
    /// instance off.
    pub const fn scaled(mut self, factor: f32) -> Self {
        self.scale = factor;
        self
    }

    /// Puts the instance in light groups, a set of bits: it is sampled for shading points that receive one of them
    /// ([`ShadingPoint::with_groups`]). All bits until this sets it. Meshes of an object have no groups of their own,
    /// and a change by [`refit_instances`](crate::LightSampler::refit_instances) does not look at them.
    pub const fn groups(mut self, groups: u32) -> Self {
        self.groups = groups;
        self
    }
}

/// What is kept of every instance.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    /// Columns of the map from the object's space to the world: three axes, and the image of the origin.
    pub(super) columns: [[f32; 3]; 4],
    /// First word of the object.
    pub(super) object: u32,
    /// What the weights of the object are multiplied by.
    pub(super) scale: f32,
    /// Leaf of the tree over all lights, or [`NO_LEAF`](super::NO_LEAF).
    pub(super) leaf: u32,
    /// Number of the object.
    pub(super) number: u32,
}

const _: () = assert!(size_of::<InstanceRecord>() == 64);

impl InstanceRecord {
    /// Returns the record of an instance that may be added as one with this number. `low` and `high` are the corners of
    /// the object's box, `object` its first word.
    ///
    /// # Errors
    ///
    /// If the map is not finite or not invertible, at the start of the interval or later, moves a corner too far away,
    /// or the factor is out of its range.
    pub(super) fn new(instance: &Instance, number: usize, object: u32, [low, high]: [Vec3; 2]) -> Result<Self, Error> {
        let columns = instance.transform.to_cols_array_2d();
        let record = Self { columns, object, scale: instance.scale, leaf: super::NO_LEAF, number: instance.object.0 };
        let moves = || instance.end_columns().map_or(Ok(()), |end| record.check_motion(&end, [low, high]));
        record.check([low, high]).and_then(|()| moves()).map(|()| record).map_err(
            |InstanceFault { what, value, expected }| {
                Error(ErrorKind::Instance { instance: number, what, value, expected })
            },
        )
    }

    /// Checks the numbers, which may come from outside.
    pub(super) fn check(&self, [low, high]: [Vec3; 2]) -> Result<(), InstanceFault> {
        let fault = |what, value: f64, expected| Err(InstanceFault { what, value: value as f32, expected });
        if let Some(&value) = self.columns.as_flattened().iter().find(|value| !value.is_finite()) {
            return fault("an element of the transform", f64::from(value), "finite");
        }
        let placement = Placement::new(&self.columns);
        // NaN fails.
        let condition = placement.condition();
        if !(condition <= LARGEST_CONDITION) {
            return fault("condition number of the transform", condition, "at most 1e6, so that it can be inverted");
        }
        for scale in [norm(&placement.linear), norm(&placement.inverse)] {
            if !(scale <= LARGEST_SCALE) {
                return fault("scale or inverse scale of the transform", scale, "at most 1e12");
            }
        }
        for corner in corners([low, high]) {
            let farthest = placement.relative_to(Vec3::ZERO, corner).abs().max_element();
            if !(farthest <= f64::from(POSITION_LIMIT)) {
                return fault("largest coordinate", farthest, "at most 1e9, with the whole box of the object");
            }
        }
        if !(0.0..=blas::MAX_AVERAGE).contains(&self.scale) {
            return fault("factor of the weights", f64::from(self.scale), "from 0 to 1e30");
        }
        Ok(())
    }

    /// Returns the map to the world at the start of the interval.
    #[inline]
    pub(super) fn placement(&self) -> Placement {
        Placement::new(&self.columns)
    }
}

/// A number that an instance must not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InstanceFault {
    what: &'static str,
    value: f32,
    expected: &'static str,
}

/// Returns the corners of a box.
fn corners([low, high]: [Vec3; 2]) -> impl Iterator<Item = Vec3> {
    (0..8).map(move |i| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low))
}

/// Words of a record. *Format.*
pub(super) const INSTANCE_WORDS: usize = size_of::<InstanceRecord>() / size_of::<u32>();

/// Returns the first word of the first object, which follows `instances` instances.
pub(super) fn first_object(instances: usize) -> usize {
    1 + instances * INSTANCE_WORDS
}

/// Returns the records of all instances. *Format*: the words are the number of instances, their records, and the
/// objects one after the other.
#[inline]
pub(super) fn records(words: &[u32]) -> &[InstanceRecord] {
    let Some((&count, rest)) = words.split_first() else { return &[] };
    let words = rest.get(..(count as usize).saturating_mul(INSTANCE_WORDS)).unwrap_or(&[]);
    bytemuck::try_cast_slice(words).unwrap_or(&[])
}

/// Returns the records of all instances, to be changed.
pub(super) fn records_mut(words: &mut [u32]) -> &mut [InstanceRecord] {
    let Some((&mut count, rest)) = words.split_first_mut() else { return &mut [] };
    let words = rest.get_mut(..(count as usize).saturating_mul(INSTANCE_WORDS)).unwrap_or(&mut []);
    bytemuck::try_cast_slice_mut(words).unwrap_or(&mut [])
}

/// Returns the words of instances and objects, in which the records number the words from the first object; none
/// without instances.
pub(super) fn join(instances: &[InstanceRecord], objects: &[u32]) -> Vec<u32> {
    if instances.is_empty() {
        return Vec::new();
    }
    let first = first_object(instances.len());
    let mut words = Vec::with_capacity(first + objects.len());
    words.push(instances.len() as u32);
    words.extend_from_slice(bytemuck::cast_slice(instances));
    words.extend_from_slice(objects);
    records_mut(&mut words).iter_mut().for_each(|record| record.object += first as u32);
    words
}

/// An instance with its object: a leaf of the tree over all lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedObject<'a> {
    pub(super) record: &'a InstanceRecord,
    pub(super) object: Object<'a>,
    /// Transform at the end of the shutter interval; `None` for an instance that stands still.
    end: Option<&'a EndColumns>,
    time: f32,
}

impl<'a> PlacedObject<'a> {
    /// Returns the instance with the object that it places, whose words are among these.
    #[inline]
    pub(super) fn new(record: &'a InstanceRecord, words: &'a [u32]) -> Self {
        Self { record, object: Object::at(words, record.object), end: None, time: 0.0 }
    }

    /// Returns the instance of a number by the words of all.
    #[inline]
    pub(super) fn at(words: &'a [u32], number: u32) -> Self {
        Self::new(&records(words)[number as usize], words)
    }

    /// Number of the object's triangles.
    pub(crate) fn count(&self) -> u32 {
        self.object.header.lights
    }

    /// Returns the irradiance by its estimate in units of the object's own energy ([`ObjectWalk::irradiance`]), for
    /// portals that show this mean radiance. Zero only if the estimate is, or the instance is switched off.
    pub(crate) fn irradiance(&self, estimate: f32, mean: f64) -> f32 {
        let header = self.object.header;
        let energy = f64::from(header.flux) + mean * f64::from(header.portal);
        storable(energy * f64::from(self.record.scale) * f64::from(estimate))
    }

    /// Returns the shares of the object's energy that do not depend on the direction and that come through portals,
    /// which show this mean radiance. Both are zero while the instance is switched off.
    pub(crate) fn shares(&self, mean: f32) -> [f32; 2] {
        let header = self.object.header;
        let (flux, portal) = (f64::from(header.flux), f64::from(mean) * f64::from(header.portal));
        if self.record.scale > 0.0 { [flux, portal].map(|part| (part / (flux + portal)) as f32) } else { [0.0; 2] }
    }

    /// Returns one of the object's triangles in its place.
    #[inline]
    pub(crate) fn triangle(&self, below: u32) -> PlacedTriangle<'a> {
        PlacedTriangle::new(&self.object.records()[below as usize], self.placement().forward())
    }
}

/// As a leaf an instance is a cluster of lights: what is asked here is answered by its bounds or by the weights of its
/// own tree, and its triangles are asked one by one.
impl LightKind for PlacedObject<'_> {
    fn is_portal(&self) -> bool {
        self.object.has_portals()
    }

    fn is_two_sided(&self) -> bool {
        self.object.header.two_sided != 0
    }

    fn weight(&self) -> f32 {
        self.record.scale
    }

    /// Returns the mean factor that areas are multiplied by.
    fn area(&self) -> f32 {
        self.mean_area_scale() as f32
    }

    fn bounds(&self, directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments) {
        let energy = energy(self.area());
        self.bounds_with(if directional { [0.0, energy] } else { [energy, 0.0] })
    }

    /// As with any cluster of lights, this is left to what is inside.
    fn is_visible(&self, _x: &ShadingPoint) -> bool {
        true
    }

    /// Returns the sum of the weights in the object's own tree, for unit radiance behind portals.
    #[inline(never)]
    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32 {
        let Some(walk) = ObjectWalk::new(self, x, None) else { return 0.0 };
        (f64::from(walk.irradiance()) / self.area_scale_for(&walk.placement)) as f32
    }

    fn intersect(&self, _origin: Vec3, _direction: Vec3) -> Option<LocalPoint> {
        None
    }
}
