//! Lights that are not made of triangles: one file a kind, one enum, and the record that a sampler keeps of each.
//!
//! A lamp is seen from a shading point in directions: a ray meets the side of it that shines back in one point at most,
//! so that a point of a lamp *is* the direction to it. Directions are rounded to single precision when they are drawn,
//! and every density is that of the rounded direction.

mod disk;
mod distant;
mod point;
mod profiled;
mod sphere;
mod spot;
mod tube;

use core::f64::consts::PI;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::emitted::EmittedRay;
use super::extras::Extras;
use super::profiles::Profiles;
use super::triangle_view::FARTHEST_POINT;
use super::{DrawnPoint, LightKind, LightTriangle, LightViewKind, LocalPoint, POSITION_LIMIT};
use crate::blas;
use crate::bounds::{LightBounds, Moments};
use crate::error::{Error, ErrorKind};
use crate::geometry::{Aabb, Cone, HORIZON_ROUNDING};
use crate::math;
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::record::{LightId, SampledLight};
use crate::warp::Variate;
use crate::warp::spherical_cap::SphericalCap;

pub use disk::DiskLight;
use disk::DiskView;
pub use distant::DistantLight;
pub use point::PointLight;
use point::PointView;
pub use profiled::ProfileLight;
pub use sphere::SphereLight;
use sphere::SphereView;
pub use spot::SpotLight;
pub use tube::TubeLight;
use tube::TubeView;

/// Numbers that describe a lamp of any kind. *Format*: what the kind with the most numbers needs.
const VALUES: usize = 10;

/// Largest difference of the squared length of a rounded unit vector from 1. *Proved*: a component is off by at most
/// 6e-8 of itself. Larger: a vector that is no unit vector would be taken for one.
const UNIT_ROUNDING: f64 = 2.5e-7;

/// Least radius and length. *Proved*: areas are normal numbers in single precision. A larger one would refuse tiny
/// lamps.
const LEAST_LAMP_LENGTH: f32 = 1e-15;

/// A light that is not made of triangles.
///
/// Every kind is a type of its own, which turns into a `Lamp`:
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{LightSampler, SampledLight, ShadingPoint, SphereLight};
///
/// let mut builder = LightSampler::builder();
/// let bulb = builder.add_light(SphereLight::new(Vec3::new(0.0, 0.0, 2.0), 0.1, 50.0))?;
/// let lights = builder.build()?;
///
/// let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
/// let sample = here.sample([0.3, 0.6, 0.1]).expect("the bulb is above the floor");
/// assert_eq!(sample.light, SampledLight::Shape(bulb));
/// assert_eq!(here.pdf_light(bulb, sample.direction), sample.pdf);
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lamp {
    /// A sphere.
    Sphere(SphereLight),
    /// A point without an extent.
    Point(PointLight),
    /// A point without an extent that sends into a cone.
    Spot(SpotLight),
    /// A flat disk.
    Disk(DiskLight),
    /// The round surface of a cylinder.
    Tube(TubeLight),
    /// A direction, or a cap of directions, infinitely far away.
    Distant(DistantLight),
    /// A point without an extent that sends by a profile.
    Profile(ProfileLight),
}

/// What is kept of every lamp that can emit light: in the same array as triangles, and as large as they are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct LampRecord {
    /// What the kind makes of them.
    values: [f32; VALUES],
    /// Code of the kind.
    kind: u32,
    /// Number among all lamps that were added, and [`LightTriangle::LAMP`].
    number_and_mark: u32,
}

const _: () = assert!(size_of::<LampRecord>() == size_of::<LightTriangle>());
const _: () = assert!(
    core::mem::offset_of!(LampRecord, number_and_mark) == core::mem::offset_of!(LightTriangle, index_and_flags)
);

/// A number that a lamp must not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LampFault {
    what: &'static str,
    value: f32,
    expected: &'static str,
}

/// Where a lamp is and which way it sends.
struct Reach {
    aabb: Aabb,
    normals: Cone,
    /// Largest angle to a normal at which light leaves; π for what has no front.
    emission: f32,
    two_sided: bool,
    /// Mean position, and mean squared distance from it.
    mean: Vec3,
    variance: f32,
    /// Mean normal.
    normal: Vec3,
}

/// What a kind of lamp says of itself.
trait LampKind: Sized {
    /// Number that stands for the kind in bytes. *Format.*
    const CODE: u32;

    /// Returns the numbers that bytes hold.
    fn to_values(self) -> [f32; VALUES];

    /// Returns the lamp of these numbers.
    fn from_values(values: [f32; VALUES]) -> Self;

    /// Checks the numbers, which may come from outside.
    fn check(&self) -> Result<(), LampFault>;

    /// Whether the lamp has an extent.
    fn has_extent(&self) -> bool {
        true
    }

    /// Returns radiance or radiant intensity.
    fn weight(&self) -> f32;

    /// Returns what the weight is multiplied by so that it competes with the radiance times area of a triangle.
    fn area(&self, profiles: Profiles<'_>) -> f32;

    /// Returns where the lamp is and which way it sends.
    fn reach(&self, profiles: Profiles<'_>) -> Reach;

    /// Returns the lamp as seen from a shading point; `None` where nothing can arrive, whatever the receiver.
    fn view(&self, x: &ShadingPoint, profiles: Profiles<'_>) -> Option<ShapeView>;

    /// Whether a ray in a unit direction meets a side that shines back along it.
    fn is_crossed(&self, origin: Vec3, direction: DVec3) -> bool;

    /// Draws a ray in which light leaves. `side` is uniform in `[0, 1)`.
    fn emit(&self, point: [Variate; 2], direction: [Variate; 2], side: f64, profiles: Profiles<'_>) -> EmittedRay;

    /// Returns the density with which [`Self::emit`] draws a ray in a unit direction.
    fn emission_pdf(&self, direction: Vec3, profiles: Profiles<'_>) -> f64;
}

/// What a kind of lamp says of itself to a shading point.
trait ShapeViewKind {
    /// Draws a unit direction to the lamp.
    fn draw(&self, u: [Variate; 2]) -> DVec3;

    /// Returns the density per solid angle with which [`Self::draw`] draws a direction that meets the lamp; a
    /// probability for a lamp without an extent.
    fn pdf(&self, direction: DVec3) -> f64;

    /// Returns the point of the lamp in a direction, relative to the shading point. Rounding may have taken the
    /// direction past the lamp: then a point at its rim.
    fn point(&self, direction: DVec3) -> DVec3;

    /// Returns the unit normal of the front side in a point relative to the shading point.
    fn normal(&self, point: DVec3) -> DVec3;

    /// Returns the solid angle per area of the lamp at a point; 1 for a lamp without an extent.
    fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        let distance2 = point.length_squared();
        let cosine = self.normal(point).dot(point).abs();
        cosine / (distance2 * math::sqrt64(distance2))
    }

    /// Returns the height of the highest point over a plane through the shading point with this unit normal, and the
    /// size of the numbers that it was computed from.
    fn highest(&self, normal: DVec3) -> [f64; 2];

    /// Estimates the irradiance from the lamp with a weight of 1. Zero only if nothing can arrive.
    fn irradiance(&self, receiver: Receiver) -> f64;
}

/// A lamp of any kind as seen from a point.
#[derive(Clone, Copy, Debug)]
enum ShapeView {
    Sphere(SphereView),
    Point(PointView),
    Disk(DiskView),
    Tube(TubeView),
}

/// A lamp as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampView {
    receiver: Receiver,
    shape: ShapeView,
}

/// Evaluates an expression with whichever kind a lamp is.
macro_rules! of_lamp {
    ($lamp:expr, $kind:ident => $call:expr) => {
        match $lamp {
            Lamp::Sphere($kind) => $call,
            Lamp::Point($kind) => $call,
            Lamp::Spot($kind) => $call,
            Lamp::Disk($kind) => $call,
            Lamp::Tube($kind) => $call,
            Lamp::Distant($kind) => $call,
            Lamp::Profile($kind) => $call,
        }
    };
}

/// Evaluates an expression with whichever kind of lamp a record is of, and another one where there is no such kind.
/// Nothing but this kind is made of the record, so that little is left of a question about one of its numbers.
macro_rules! of_record {
    ($record:expr, $kind:ident => $call:expr, else $otherwise:expr) => {
        match $record.kind {
            SphereLight::CODE => of_record!(SphereLight, $record, $kind => $call),
            PointLight::CODE => of_record!(PointLight, $record, $kind => $call),
            SpotLight::CODE => of_record!(SpotLight, $record, $kind => $call),
            DiskLight::CODE => of_record!(DiskLight, $record, $kind => $call),
            TubeLight::CODE => of_record!(TubeLight, $record, $kind => $call),
            DistantLight::CODE => of_record!(DistantLight, $record, $kind => $call),
            ProfileLight::CODE => of_record!(ProfileLight, $record, $kind => $call),
            _ => $otherwise,
        }
    };
    ($type:ident, $record:expr, $kind:ident => $call:expr) => {{
        let $kind = $type::from_values($record.values);
        $call
    }};
    // Records are checked before anything is asked of them.
    ($record:expr, $kind:ident => $call:expr) => {
        of_record!($record, $kind => $call, else {
            let $kind = SphereLight::new(Vec3::ZERO, 0.0, 0.0);
            $call
        })
    };
}

/// Evaluates an expression with the view of whichever kind a lamp is.
macro_rules! of_view {
    ($view:expr, $kind:ident => $call:expr) => {
        match $view {
            ShapeView::Sphere($kind) => $call,
            ShapeView::Point($kind) => $call,
            ShapeView::Disk($kind) => $call,
            ShapeView::Tube($kind) => $call,
        }
    };
}

impl Lamp {
    /// Returns the record of a lamp that may be added as one with this number.
    ///
    /// # Errors
    ///
    /// If a number is not finite or out of its range.
    pub(crate) fn record(self, number: u32) -> Result<LampRecord, Error> {
        self.check().map_err(|LampFault { what, value, expected }| {
            Error(ErrorKind::Lamp { light: number as usize, what, value, expected })
        })?;
        let (kind, values) = of_lamp!(self, kind => (code_of(&kind), kind.to_values()));
        Ok(LampRecord { values, kind, number_and_mark: number | LightTriangle::LAMP })
    }
}

impl Lamp {
    /// Checks the numbers.
    pub(super) fn check(&self) -> Result<(), LampFault> {
        of_lamp!(self, kind => kind.check())
    }
}

/// Returns the code of a kind.
fn code_of<K: LampKind>(_: &K) -> u32 {
    K::CODE
}

impl LampRecord {
    /// Returns the lamp; `None` if there is no kind of this code.
    fn decode(&self) -> Option<Lamp> {
        of_record!(self, kind => Some(kind.into()), else None)
    }

    /// Returns the lamp's number among all that were added.
    pub(super) fn number(&self) -> u32 {
        self.number_and_mark & !LightTriangle::LAMP
    }

    /// Returns the record as it is kept among triangles.
    pub(super) fn into_triangle(self) -> LightTriangle {
        bytemuck::cast(self)
    }

    /// Whether the numbers, which may come from outside, are those of a lamp.
    pub(super) fn is_valid(&self) -> bool {
        self.decode().is_some_and(|lamp| lamp.check().is_ok() && !matches!(lamp, Lamp::Distant(_)))
    }

    /// Returns the light as one that is infinitely far away; `None` for any other.
    pub(super) fn distant(&self) -> Option<DistantLight> {
        (self.kind == DistantLight::CODE).then(|| DistantLight::from_values(self.values))
    }

    /// Whether the lamp has an extent.
    pub(super) fn has_extent(&self) -> bool {
        of_record!(self, kind => kind.has_extent())
    }

    /// Returns what a host gets to know of a sample of this lamp.
    pub(super) fn sampled(&self) -> SampledLight {
        let id = LightId(self.number());
        if self.has_extent() { SampledLight::Shape(id) } else { SampledLight::Punctual(id) }
    }

    /// Returns radiance or radiant intensity.
    #[inline]
    pub(super) fn weight(&self) -> f32 {
        of_record!(self, kind => kind.weight())
    }

    /// Returns the number of the lamp's profile; `None` for a lamp without one.
    pub(super) fn profile(&self) -> Option<u32> {
        (self.kind == ProfileLight::CODE).then(|| ProfileLight::from_values(self.values).profile().index())
    }
}

/// A lamp together with what it may refer to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampLight<'a> {
    pub(super) record: &'a LampRecord,
    pub(super) extras: Extras<'a>,
}

impl LampLight<'_> {
    /// Draws a ray in which light leaves.
    pub(super) fn emit(&self, point: [Variate; 2], direction: [Variate; 2], side: f64) -> EmittedRay {
        of_record!(self.record, kind => kind.emit(point, direction, side, self.extras.profiles()))
    }

    /// Returns the density with which [`Self::emit`] draws a ray in a unit direction.
    pub(super) fn emission_pdf(&self, direction: Vec3) -> f64 {
        of_record!(self.record, kind => kind.emission_pdf(direction, self.extras.profiles()))
    }
}

impl LightKind for LampLight<'_> {
    #[inline]
    fn is_portal(&self) -> bool {
        false
    }

    fn is_two_sided(&self) -> bool {
        of_record!(self.record, kind => kind.reach(self.extras.profiles()).two_sided)
    }

    #[inline]
    fn weight(&self) -> f32 {
        self.record.weight()
    }

    #[inline]
    fn area(&self) -> f32 {
        of_record!(self.record, kind => kind.area(self.extras.profiles()))
    }

    fn bounds(&self, _directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments) {
        let (Reach { aabb, normals, emission, two_sided, mean, variance, normal }, area) =
            of_record!(self.record, kind => (kind.reach(self.extras.profiles()), kind.area(self.extras.profiles())));
        let energy = energy(area);
        let bounds = LightBounds { aabb, normals, emission, flux: energy, portal: 0.0, two_sided };
        (bounds, Moments { energy, mean, variance, normal })
    }

    #[inline(never)]
    fn is_visible(&self, x: &ShadingPoint) -> bool {
        LampView::new(self, x).is_some()
    }

    #[inline(never)]
    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32 {
        LampView::new(self, x).map_or(0.0, |view| (view.irradiance_of_unit() / f64::from(self.area())) as f32)
    }

    #[inline(never)]
    fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        let unit = direction.as_dvec3().try_normalize()?;
        let is_crossed = of_record!(self.record, kind => kind.is_crossed(origin, unit));
        // A sample's own direction stays as it is: next to a rim, another rounding would have another density.
        let is_unit = (direction.as_dvec3().length_squared() - 1.0).abs() <= UNIT_ROUNDING;
        is_crossed.then(|| LocalPoint::from_direction(if is_unit { direction } else { unit.as_vec3() }))
    }
}

impl LampView {
    /// Returns the view from a shading point, or `None` where nothing can arrive.
    #[inline(never)]
    pub(super) fn new(lamp: &LampLight<'_>, x: &ShadingPoint) -> Option<Self> {
        // NaN fails.
        if !x.position.to_array().iter().all(|x| x.abs() <= FARTHEST_POINT) {
            return None;
        }
        let shape = of_record!(lamp.record, kind => kind.view(x, lamp.extras.profiles()))?;
        let is_below = x.receiver.has_horizon() && {
            let [height, size] = of_view!(&shape, view => view.highest(x.receiver.normal().as_dvec3()));
            height < f64::from(-HORIZON_ROUNDING) * size
        };
        (!is_below).then_some(Self { receiver: x.receiver, shape })
    }

    /// Whether a direction is below the horizon.
    fn is_below_horizon(&self, direction: Vec3) -> bool {
        self.receiver.has_horizon() && !(self.receiver.normal().dot(direction) > 0.0)
    }

    /// Estimates the irradiance from the lamp with a weight of 1.
    fn irradiance_of_unit(&self) -> f64 {
        of_view!(&self.shape, view => view.irradiance(self.receiver))
    }
}

impl LightViewKind for LampView {
    #[inline(never)]
    fn sample(&self, u: [Variate; 2]) -> Option<DrawnPoint> {
        let direction = of_view!(&self.shape, view => view.draw(u));
        let point = LocalPoint::from_direction(direction.as_vec3());
        Some(DrawnPoint { point, relative: self.point(point), pdf: self.pdf(point)? })
    }

    #[inline(never)]
    fn pdf(&self, point: LocalPoint) -> Option<f64> {
        let direction = point.to_direction();
        if self.is_below_horizon(direction) {
            return None;
        }
        let pdf = of_view!(&self.shape, view => view.pdf(direction.as_dvec3()));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }

    #[inline(never)]
    fn point(&self, point: LocalPoint) -> DVec3 {
        of_view!(&self.shape, view => view.point(point.to_direction().as_dvec3()))
    }

    fn direction(&self, point: LocalPoint, _relative: DVec3, _distance: f64) -> Vec3 {
        point.to_direction()
    }

    #[inline(never)]
    fn normal(&self, point: DVec3) -> Vec3 {
        of_view!(&self.shape, view => view.normal(point).as_vec3())
    }

    #[inline(never)]
    fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        of_view!(&self.shape, view => view.solid_angle_per_area(point))
    }

    fn irradiance(&self, weight: f32) -> f32 {
        (f64::from(weight) * self.irradiance_of_unit()).clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32
    }
}

/// Estimates the irradiance from a cap of unit radiance. Zero only if nothing can arrive.
pub(super) fn irradiance_of_cap(receiver: Receiver, cap: &SphericalCap) -> f64 {
    let sin = if cap.cos > 0.0 { cap.sin } else { 1.0 };
    irradiance_of_directions(receiver, cap.axis, sin, cap.solid_angle())
}

/// Estimates the irradiance from directions of unit radiance: their middle, the sine of the angle from there to the
/// farthest of them, and their solid angle. Zero only if nothing can arrive.
fn irradiance_of_directions(receiver: Receiver, axis: DVec3, sin_reach: f64, solid_angle: f64) -> f64 {
    // An angle of zero has no mean.
    let sin = (sin_reach as f32).max(f32::MIN_POSITIVE);
    let mean = f64::from(receiver.mean_over_cone(axis.as_vec3(), sin));
    // One plus the cosine of the half angle of a cap, halved: of a cap above the horizon, the mean cosine is that of
    // its middle times this.
    let share = if receiver.normal() == Vec3::ZERO { 1.0 } else { (1.0 - solid_angle / (4.0 * PI)).max(0.5) };
    solid_angle * share * mean
}

/// `Ok` if a vector has the length 1, which it has unless it had no direction.
fn check_axis(what: &'static str, axis: Vec3) -> Result<(), LampFault> {
    within(what, axis.length(), [0.999, 1.001], "positive and finite")
}

/// `Ok` if a number is in a range.
fn within(what: &'static str, value: f32, [low, high]: [f32; 2], expected: &'static str) -> Result<(), LampFault> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(LampFault { what, value, expected }) }
}

/// `Ok` if a radiance or an intensity is finite and not negative.
fn check_weight(what: &'static str, value: f32) -> Result<(), LampFault> {
    within(what, value, [0.0, blas::MAX_AVERAGE], "from 0 to 1e30")
}

/// `Ok` if a radius or another length is positive and not too large.
fn check_length(what: &'static str, value: f32) -> Result<(), LampFault> {
    within(what, value, [LEAST_LAMP_LENGTH, POSITION_LIMIT], "from 1e-15 to 1e9")
}

/// `Ok` if a position is finite, and nothing in this distance of it is too far away.
fn check_position(what: &'static str, position: Vec3, size: f32) -> Result<(), LampFault> {
    let limit = [-POSITION_LIMIT, POSITION_LIMIT];
    let farthest = |value: f32| if value < 0.0 { value - size } else { value + size };
    let check = |value: f32| within(what, farthest(value), limit, "from -1e9 to 1e9, with the extent of the light");
    position.to_array().into_iter().try_for_each(check)
}
