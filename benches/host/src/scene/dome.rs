//! Small lamps under a large dome that glows.

use core::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};

use super::data::Data;
use super::room::WALL;
use super::{Emitter, Radiance, Scene};
use crate::Error;
use crate::camera::Camera;
use crate::geometry::{Plane, Rectangle, sphere};

/// Radius of the dome, in meters.
const RADIUS: f32 = 10.0;
/// Number of lamps.
const LAMPS: u8 = 20;
/// Corners of the disc on the ground; with fewer its edge would not look round.
const CORNERS: u16 = 128;

/// Builds the dome over a disc.
pub(super) fn dome_lamps(_: &Data) -> Result<Scene, Error> {
    let mut dome = sphere(Vec3::ZERO, RADIUS, 16, 8);
    for triangle in &mut dome.indices {
        triangle.swap(1, 2);
    }
    let lamp = |i: u8| {
        let center = lamp_center(i);
        let rectangle = Rectangle::new(Plane::Z(1.0), center - 0.05, center + 0.05, Vec3::NEG_Z);
        Emitter { mesh: rectangle.mesh(), radiance: Radiance::Constant(100.0) }
    };
    let corner = |i: u16| 5.0 * Vec2::from_angle(TAU * f32::from(i) / f32::from(CORNERS));
    let disc: Vec<Vec2> = (0..CORNERS).map(corner).collect();
    let dome = Emitter { mesh: dome, radiance: Radiance::Constant(0.1) };
    Ok(Scene {
        camera: Camera::new(vec3(0.0, -3.0, 2.0), vec3(0.0, 0.0, 0.5), Vec3::Z, 75.0),
        solids: vec![(Plane::Z(0.0).polygon(&disc, &[]), WALL)],
        emitters: core::iter::once(dome).chain((0..LAMPS).map(lamp)).collect(),
        portals: Vec::new(),
        sky: None,
        inside: None,
    })
}

/// Returns where a lamp hangs, in x and y.
fn lamp_center(i: u8) -> Vec2 {
    let i = f32::from(i);
    0.5 * i * vec2((0.7 * i).cos(), (0.7 * i).sin())
}

#[cfg(test)]
mod tests {
    use glam::vec2;

    use super::lamp_center;

    #[test]
    fn lamps_are_those_of_the_generator() {
        assert!(lamp_center(1).distance(vec2(0.382_421_1, 0.322_108_8)) < 1e-5);
        assert!(lamp_center(19).distance(vec2(7.056_117, 6.360_913)) < 1e-4);
    }
}
