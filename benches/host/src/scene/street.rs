//! A street at dusk: boxes and bulbs under a captured sky, without portals.

use glam::{Vec2, Vec3, vec2, vec3};

use super::data::Data;
use super::lamps::{BULBS, bulb};
use super::room::WALL;
use super::{Scene, skies};
use crate::Error;
use crate::camera::Camera;
use crate::geometry::{Mesh, Plane, rectangle_outline};
use crate::random::Pcg32;

/// Number of boxes.
const BOXES: usize = 60;

/// A box on the ground.
#[derive(Clone, Copy, Debug)]
struct Block {
    center: Vec2,
    half: Vec2,
    height: f32,
}

/// Builds the street.
pub(super) fn street(data: &Data) -> Result<Scene, Error> {
    let mut pcg = Pcg32::new(39, 2);
    let ground = rectangle_outline(Vec2::splat(-20.0), Vec2::splat(20.0));
    let mut solids = Plane::Z(0.0).polygon(&ground, &[]);
    for block in blocks(&mut pcg) {
        add_block(&mut solids, block);
    }
    let draw = |_| {
        let [x, y, z] = [(-15.0, 30.0), (-15.0, 30.0), (3.0, 1.0)].map(|(low, size)| (low + size * pcg.f()) as f32);
        bulb(vec3(x, y, z), (50.0 * 5.0_f64.powf(pcg.f())) as f32)
    };
    Ok(Scene {
        camera: Camera::new(vec3(-14.0, -14.0, 1.7), vec3(0.0, 0.0, 1.5), Vec3::Z, 75.0),
        solids: vec![(solids, WALL)],
        emitters: (0..BULBS).map(draw).collect(),
        portals: Vec::new(),
        sky: Some(skies::captured(data, "city")?),
        inside: None,
    })
}

/// Draws the boxes.
fn blocks(pcg: &mut Pcg32) -> Vec<Block> {
    let mut draw = |low: f64, size: f64| (low + size * pcg.f()) as f32;
    (0..BOXES)
        .map(|_| Block {
            center: vec2(draw(-18.0, 36.0), draw(-18.0, 36.0)),
            half: vec2(draw(0.4, 1.0), draw(0.4, 1.0)),
            height: draw(1.0, 4.0),
        })
        .collect()
}

/// Adds the four walls and the roof of a box.
fn add_block(mesh: &mut Mesh, Block { center, half, height }: Block) {
    let (low, high) = (center - half, center + half);
    for plane in [Plane::X(low.x), Plane::X(high.x)] {
        mesh.append(&plane.polygon(&rectangle_outline(vec2(low.y, 0.0), vec2(high.y, height)), &[]));
    }
    for plane in [Plane::Y(low.y), Plane::Y(high.y)] {
        mesh.append(&plane.polygon(&rectangle_outline(vec2(low.x, 0.0), vec2(high.x, height)), &[]));
    }
    mesh.append(&Plane::Z(height).polygon(&rectangle_outline(low, high), &[]));
}

#[cfg(test)]
mod tests {
    use glam::vec2;

    use super::{Pcg32, blocks};

    #[test]
    fn first_box_is_that_of_the_generator() {
        let block = blocks(&mut Pcg32::new(39, 2))[0];
        assert!(block.center.distance(vec2(-5.894_174, -12.062_57)) < 1e-5);
        assert!(block.half.distance(vec2(1.190_777, 0.977_451_9)) < 1e-6);
        assert!((block.height - 1.912_408).abs() < 1e-6);
    }
}
