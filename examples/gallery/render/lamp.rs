//! Lights without a surface: points, spots and distant lights.

use core::f32::consts::{PI, TAU};

use glam::Vec3;

/// A light without a surface.
#[derive(Clone, Debug)]
pub(crate) struct Lamp {
    pub(crate) kind: LampKind,
    /// Radiant intensity, that of a spot on its axis; of a distant light, the irradiance of what faces it.
    pub(crate) strength: Vec3,
}

/// Where a light is, and where its light goes.
#[derive(Clone, Debug)]
pub(crate) enum LampKind {
    /// In all directions from a place.
    Point(Vec3),
    /// Into a cone: place, axis, and the angles from the axis between which the intensity falls to zero.
    Spot(Vec3, Vec3, [f32; 2]),
    /// In one direction from far away.
    Distant(Vec3),
}

impl Lamp {
    /// Direction and distance from a place to the light.
    pub(crate) fn towards(&self, from: Vec3) -> (Vec3, f32) {
        match &self.kind {
            LampKind::Point(position) | LampKind::Spot(position, ..) => {
                let step = *position - from;
                let distance = step.length();
                (step / distance, distance)
            }
            LampKind::Distant(axis) => (-*axis, f32::INFINITY),
        }
    }

    /// Irradiance at a place on what faces the light, if nothing is in the way.
    pub(crate) fn irradiance(&self, at: Vec3) -> Vec3 {
        let (direction, distance) = self.towards(at);
        match &self.kind {
            LampKind::Point(_) => self.strength / (distance * distance),
            LampKind::Spot(_, axis, angles) => {
                self.strength * (falloff(*angles, -axis.dot(direction)) / (distance * distance))
            }
            LampKind::Distant(_) => self.strength,
        }
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
            LampKind::Distant(_) => PI * radius * radius,
        }
    }
}

/// Share of a spot's intensity at an angle of this cosine from its axis: the square of a line, as glTF has it.
fn falloff(angles: [f32; 2], cosine: f32) -> f32 {
    let [inner, outer] = angles.map(f32::cos);
    let height = (cosine - outer) / (inner - outer).max(f32::MIN_POSITIVE);
    height.clamp(0.0, 1.0).powi(2)
}
