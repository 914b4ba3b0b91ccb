//! The Cornell box without its boxes.

use glam::{Vec2, Vec3, vec2, vec3};

use super::data::Data;
use super::{Emitter, Radiance, Scene};
use crate::Error;
use crate::bsdf::Material;
use crate::camera::Camera;
use crate::geometry::{Mesh, Plane, Rectangle, rectangle_outline};

/// How far the light hangs below the ceiling, in meters; *format* of the workload.
const BELOW_CEILING: f32 = 1e-4;

/// Builds the unit box, which is open at y = 0.
pub(super) fn cornell(_: &Data) -> Result<Scene, Error> {
    let white = Material::Diffuse(Vec3::splat(0.73));
    let wall = |plane: Plane| plane.polygon(&rectangle_outline(Vec2::ZERO, Vec2::ONE), &[]);
    let mut walls = Mesh::default();
    for plane in [Plane::Z(0.0), Plane::Z(1.0), Plane::Y(1.0)] {
        walls.append(&wall(plane));
    }
    let light = Rectangle::new(Plane::Z(1.0 - BELOW_CEILING), vec2(0.35, 0.35), vec2(0.65, 0.65), Vec3::NEG_Z);
    Ok(Scene {
        camera: Camera::new(vec3(0.5, -1.4, 0.5), vec3(0.5, 1.0, 0.5), Vec3::Z, 40.0),
        solids: vec![
            (walls, white),
            (wall(Plane::X(0.0)), Material::Diffuse(vec3(0.63, 0.065, 0.05))),
            (wall(Plane::X(1.0)), Material::Diffuse(vec3(0.14, 0.45, 0.091))),
        ],
        emitters: vec![Emitter { mesh: light.mesh(), radiance: Radiance::Constant(15.0) }],
        portals: Vec::new(),
        sky: None,
        inside: None,
    })
}
