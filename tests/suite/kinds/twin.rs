//! What lamps send, by other means than those of the crate: rays and sums in double precision.

use core::f64::consts::{PI, TAU};

use fanlight::{DiskLight, Lamp, PointLight, Receiver, ShadingPoint, Sides, SphereLight, SpotLight, TubeLight};
use glam::{DVec3, Vec3};

/// A lamp, and what it sends to a point, by other means than those of the crate.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Twin {
    Sphere { center: DVec3, radius: f64, two_sided: bool },
    Point { position: DVec3 },
    Spot { position: DVec3, axis: DVec3, angles: [f64; 2] },
    Disk { center: DVec3, normal: DVec3, radius: f64, two_sided: bool },
    Tube { ends: [DVec3; 2], radius: f64 },
}

/// A lamp together with its twin, of radiance or intensity 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    pub(super) lamp: Lamp,
    pub(super) twin: Twin,
}

pub(super) fn sphere(center: Vec3, radius: f32) -> Kind {
    let twin = Twin::Sphere { center: center.as_dvec3(), radius: radius.into(), two_sided: false };
    Kind { lamp: SphereLight::new(center, radius, 1.0).into(), twin }
}

pub(super) fn hollow_sphere(center: Vec3, radius: f32) -> Kind {
    let twin = Twin::Sphere { center: center.as_dvec3(), radius: radius.into(), two_sided: true };
    Kind { lamp: SphereLight::new(center, radius, 1.0).sides(Sides::Two).into(), twin }
}

pub(super) fn point(position: Vec3) -> Kind {
    Kind { lamp: PointLight::new(position, 1.0).into(), twin: Twin::Point { position: position.as_dvec3() } }
}

pub(super) fn spot(position: Vec3, axis: Vec3, angles: [f32; 2]) -> Kind {
    let twin =
        Twin::Spot { position: position.as_dvec3(), axis: axis.as_dvec3().normalize(), angles: angles.map(f64::from) };
    Kind { lamp: SpotLight::new(position, axis, 1.0, angles).into(), twin }
}

pub(super) fn disk(center: Vec3, normal: Vec3, radius: f32, sides: Sides) -> Kind {
    let twin = Twin::Disk {
        center: center.as_dvec3(),
        normal: normal.as_dvec3().normalize(),
        radius: radius.into(),
        two_sided: sides == Sides::Two,
    };
    Kind { lamp: DiskLight::new(center, normal, radius, 1.0).sides(sides).into(), twin }
}

pub(super) fn tube(ends: [Vec3; 2], radius: f32) -> Kind {
    let twin = Twin::Tube { ends: ends.map(|end| end.as_dvec3()), radius: radius.into() };
    Kind { lamp: TubeLight::new(ends, radius, 1.0).into(), twin }
}

impl Twin {
    /// Share of the intensity that leaves in a unit direction; 1 for what has an extent.
    pub(super) fn falloff(&self, direction: DVec3) -> f64 {
        let Self::Spot { axis, angles: [inner, outer], .. } = self else { return 1.0 };
        let t = ((axis.dot(direction) - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Radiance that arrives along a unit direction; nothing of what has no extent.
    pub(super) fn radiance(&self, origin: DVec3, direction: DVec3) -> f64 {
        match *self {
            Self::Sphere { center, radius, two_sided } => {
                let to = center - origin;
                let is_inside = to.length() <= radius;
                let is_hit = to.dot(direction) > 0.0 && to.reject_from(direction).length() <= radius;
                f64::from(u8::from(if is_inside { two_sided } else { is_hit }))
            }
            Self::Point { .. } | Self::Spot { .. } => 0.0,
            Self::Disk { center, normal, radius, two_sided } => {
                let height = (center - origin).dot(normal);
                let distance = height / direction.dot(normal);
                let is_hit = distance > 0.0 && (origin + distance * direction - center).length() <= radius;
                f64::from(u8::from(is_hit && (height < 0.0 || two_sided)))
            }
            Self::Tube { ends: [start, end], radius } => {
                // The first of both points of an endless cylinder, if the origin is outside of it.
                let axis = (end - start).normalize();
                let (across, from) = (direction.reject_from(axis), (origin - start).reject_from(axis));
                let (a, b, c) = (across.length_squared(), across.dot(from), from.length_squared() - radius * radius);
                let root = (b * b - a * c).sqrt();
                let height = (origin - start + (-b - root) / a * direction).dot(axis);
                let is_hit = c > 0.0 && b < 0.0 && height >= 0.0 && height <= (end - start).length();
                f64::from(u8::from(is_hit))
            }
        }
    }

    /// Cone of directions that holds all of a sphere: unit axis and cosine of the half angle.
    pub(super) fn cone(&self, origin: DVec3) -> (DVec3, f64) {
        match *self {
            Self::Sphere { center, radius, .. } => ball(center - origin, radius),
            _ => (DVec3::Z, -1.0),
        }
    }

    /// Irradiance of what has no extent; of anything else by an integral over directions.
    pub(super) fn irradiance(&self, x: &ShadingPoint, steps: usize) -> f64 {
        let origin = x.position.as_dvec3();
        if let Self::Point { position } | Self::Spot { position, .. } = self {
            let direction = (*position - origin).normalize();
            return weight(x, direction) * self.falloff(-direction) / (*position - origin).length_squared();
        }
        self.integrate(origin, steps, |direction| weight(x, direction))
    }

    /// Integral over the directions from a point that the light sends to it in, by the midpoints of equal parts.
    pub(super) fn integrate(&self, origin: DVec3, steps: usize, f: impl Fn(DVec3) -> f64) -> f64 {
        let middle = |i: usize| (i as f64 + 0.5) / steps as f64;
        // Points of a surface, with normals and areas.
        let surface = |point: &dyn Fn(f64, f64) -> (DVec3, DVec3, f64), two_sided: bool| {
            let mut sum = 0.0;
            for k in 0..steps * steps {
                let (position, normal, area) = point(middle(k % steps), middle(k / steps));
                let to = position - origin;
                let cosine = -normal.dot(to) / to.length();
                let cosine = if two_sided { cosine.abs() } else { cosine.max(0.0) };
                if cosine > 0.0 {
                    sum += f(to.normalize()) * cosine * area / to.length_squared();
                }
            }
            sum / (steps * steps) as f64
        };
        match *self {
            Self::Point { .. } | Self::Spot { .. } => 0.0,
            Self::Sphere { .. } => {
                let (axis, cos) = self.cone(origin);
                over_cap(axis, cos, steps, |direction| self.radiance(origin, direction) * f(direction))
            }
            Self::Disk { center, normal, radius, two_sided } => {
                let (s, t) = normal.any_orthonormal_pair();
                let point = |u: f64, v: f64| {
                    let (sin, cos) = (TAU * v).sin_cos();
                    (center + radius * u.sqrt() * (s * cos + t * sin), normal, PI * radius * radius)
                };
                surface(&point, two_sided)
            }
            Self::Tube { ends: [a, b], radius } => {
                let (s, t) = (b - a).normalize().any_orthonormal_pair();
                let point = |u: f64, v: f64| {
                    let (sin, cos) = (TAU * v).sin_cos();
                    let normal = s * cos + t * sin;
                    (a.lerp(b, u) + radius * normal, normal, TAU * radius * (b - a).length())
                };
                let is_inside = (origin - a).reject_from((b - a).normalize()).length() <= radius;
                if is_inside { 0.0 } else { surface(&point, false) }
            }
        }
    }
}

/// Directions to a ball.
fn ball(center: DVec3, radius: f64) -> (DVec3, f64) {
    let distance = center.length();
    if distance <= radius { (DVec3::Z, -1.0) } else { (center / distance, (1.0 - (radius / distance).powi(2)).sqrt()) }
}

/// Weight of a direction at a shading point.
pub(super) fn weight(x: &ShadingPoint, direction: DVec3) -> f64 {
    match x.receiver {
        Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
        Receiver::Transmissive(normal) => normal.as_dvec3().dot(direction).abs(),
        _ => 1.0,
    }
}

/// Integral over the directions within an angle of an axis, by the midpoints of equal parts.
pub(super) fn over_cap(axis: DVec3, cos: f64, steps: usize, f: impl Fn(DVec3) -> f64) -> f64 {
    let (s, t) = axis.any_orthonormal_pair();
    let mut sum = 0.0;
    for i in 0..steps {
        // Without loss for narrow caps: one less the cosine.
        let height = (1.0 - cos) * (i as f64 + 0.5) / steps as f64;
        let radius = (height * (2.0 - height)).sqrt();
        for j in 0..2 * steps {
            let (sin, cos) = (PI * (j as f64 + 0.5) / steps as f64).sin_cos();
            sum += f((s * cos + t * sin) * radius + axis * (1.0 - height));
        }
    }
    sum * TAU * (1.0 - cos) / (2 * steps * steps) as f64
}
