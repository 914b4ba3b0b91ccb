//! Lights without a surface: points, spots, luminaires and distant lights.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

use fanlight::Profile;
use glam::{Vec2, Vec3};

use super::alloc::sync::Arc;

/// A light without a surface.
#[derive(Clone, Debug)]
pub(crate) struct Lamp {
    pub(crate) kind: LampKind,
    /// Radiant intensity, that of a spot on its axis, that of a luminaire where its diagram is 1; of a distant light,
    /// the irradiance of what faces it.
    pub(crate) strength: Vec3,
}

/// Where a light is, and where its light goes.
#[derive(Clone, Debug)]
pub(crate) enum LampKind {
    /// In all directions from a place.
    Point(Vec3),
    /// Into a cone: place, axis, and the angles from the axis between which the intensity falls to zero.
    Spot(Vec3, Vec3, [f32; 2]),
    /// By a diagram, from a place.
    Luminaire(Vec3, Arc<Diagram>),
    /// In one direction from far away, or in all directions within an angle of it, if that is not zero.
    Distant(Vec3, f32),
}

/// Intensity by direction.
#[derive(Clone, Debug)]
pub(crate) struct Diagram {
    /// Direction of the vertical angle 0.
    pub(crate) axis: Vec3,
    /// Direction of the horizontal angle 0, perpendicular to the axis.
    pub(crate) zero: Vec3,
    /// Angles from the axis.
    pub(crate) vertical: Vec<f32>,
    /// Angles around it.
    pub(crate) horizontal: Vec<f32>,
    /// Those of all horizontal angles for each vertical one.
    pub(crate) intensities: Vec<f32>,
}

impl Lamp {
    /// Direction and distance from a place to the light; of a distant light, to its middle.
    pub(crate) fn towards(&self, from: Vec3) -> (Vec3, f32) {
        match &self.kind {
            LampKind::Point(position) | LampKind::Spot(position, ..) | LampKind::Luminaire(position, _) => {
                let step = *position - from;
                let distance = step.length();
                (step / distance, distance)
            }
            LampKind::Distant(axis, _) => (-*axis, f32::INFINITY),
        }
    }

    /// Irradiance at a place on what faces the light, if nothing is in the way.
    pub(crate) fn irradiance(&self, at: Vec3) -> Vec3 {
        let (direction, distance) = self.towards(at);
        let share = match &self.kind {
            LampKind::Distant(..) => return self.strength,
            LampKind::Point(_) => 1.0,
            LampKind::Spot(_, axis, angles) => falloff(*angles, -axis.dot(direction)),
            LampKind::Luminaire(_, diagram) => diagram.towards(-direction),
        };
        self.strength * (share / (distance * distance))
    }

    /// What its strength is multiplied by for its power: a solid angle, or the area of a scene of some radius.
    pub(crate) fn extent(&self, radius: f32) -> f32 {
        match &self.kind {
            LampKind::Point(_) => 2.0 * TAU,
            LampKind::Spot(_, _, angles) => {
                // The mean of the falloff between the cones is a third.
                let [inner, outer] = angles.map(f32::cos);
                TAU * ((1.0 - inner) + (inner - outer) / 3.0)
            }
            LampKind::Luminaire(_, diagram) => diagram.extent(),
            LampKind::Distant(..) => PI * radius * radius,
        }
    }

    /// The cap of directions to a distant light that has an extent: cosine of its angle, and its radiance.
    pub(crate) fn cap(&self) -> Option<(f32, Vec3)> {
        match self.kind {
            LampKind::Distant(_, radius) if radius > 0.0 => {
                Some((radius.cos(), self.strength / (PI * radius.min(FRAC_PI_2).sin().powi(2))))
            }
            _ => None,
        }
    }

    /// Radiance of a distant light from a direction.
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        match (self.cap(), &self.kind) {
            (Some((cosine, radiance)), LampKind::Distant(axis, _)) if -axis.dot(direction) > cosine => radiance,
            _ => Vec3::ZERO,
        }
    }
}

impl Diagram {
    /// Returns the diagram as a profile of `fanlight`.
    pub(super) fn profile(&self) -> Profile<'_> {
        Profile { vertical: &self.vertical, horizontal: &self.horizontal, intensities: &self.intensities }
    }

    fn towards(&self, direction: Vec3) -> f32 {
        let turn = self.axis.cross(self.zero);
        let vertical = self.axis.dot(direction).clamp(-1.0, 1.0).acos();
        let horizontal = direction.dot(turn).atan2(direction.dot(self.zero));
        self.profile().intensity([vertical, horizontal].map(f64::from))
    }

    /// Its integral over all directions, by the midpoint rule.
    fn extent(&self) -> f32 {
        const STEPS: u16 = 64;
        let place = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
        let mut sum = 0.0;
        for row in 0..STEPS {
            let vertical = f64::from(2.0_f32.mul_add(-place(row), 1.0).acos());
            for column in 0..STEPS {
                sum += self.profile().intensity([vertical, f64::from(TAU * place(column))]);
            }
        }
        2.0 * TAU * sum / f32::from(STEPS * STEPS)
    }
}

/// Share of a spot's intensity at an angle of this cosine from its axis: the square of a line, as glTF has it.
fn falloff(angles: [f32; 2], cosine: f32) -> f32 {
    let [inner, outer] = angles.map(f32::cos);
    let height = (cosine - outer) / (inner - outer).max(f32::MIN_POSITIVE);
    height.clamp(0.0, 1.0).powi(2)
}

/// A direction within an angle of this cosine around an axis.
pub(super) fn within(axis: Vec3, cosine: f32, [u, v]: [f32; 2]) -> Vec3 {
    let height = 1.0 - u * (1.0 - cosine);
    let disc = (1.0 - height * height).max(0.0).sqrt() * Vec2::from_angle(TAU * v);
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    (disc.x * tangent + disc.y * bitangent + height * axis).normalize()
}
