//! A small opening behind a large one: two walls, a meter apart.

use glam::{Vec2, Vec3, vec2, vec3};

use super::shapes::{rectangle, wall_at, walls};
use crate::render::{Camera, Daylight, Lobe, Material, Model};

const SIZE: Vec3 = vec3(4.0, 3.0, 4.0);
/// Middle of the openings as (y, z), and half the sides of the inner one; the outer one's are ten times as long.
const CENTER: Vec2 = vec2(1.7, 2.0);
const HALF: f32 = 0.125;

pub(crate) fn nested() -> Model {
    let camera = Camera::looking(vec3(0.3, 2.2, 3.7), vec3(2.6, 0.5, 1.2), 60.0);
    let mut model = Model::new(camera, Some(Daylight::new().draw()));
    walls(&mut model, SIZE, [vec3(0.5, 0.4, 0.3), Vec3::splat(0.7), vec3(0.55, 0.62, 0.7)]);
    let passage = model.material(Material::new("passage", Vec3::splat(0.5)));
    let (x, y, z) = (Vec3::X, Vec3::Y * SIZE.y, Vec3::Z * SIZE.z);
    model.add(passage.quad(-x, x, z).quad(y - x, x, z).quad(-x, x, y).quad(z - x, x, y));
    for (name, x, half) in [("inner", 0.0, HALF), ("outer", -1.0, 10.0 * HALF)] {
        let opening = rectangle(CENTER - half, CENTER + half);
        let outline = rectangle(Vec2::ZERO, vec2(SIZE.y, SIZE.z));
        let wall = model.material(Material::new(name, Vec3::splat(0.6)));
        model.add(wall.polygon(wall_at(x), &outline, core::slice::from_ref(&opening)));
        let window = model.material(Material::new(&format!("window {name}"), Vec3::ONE).lobe(Lobe::Clear));
        model.add(window.polygon(wall_at(x), &opening, &[]));
    }
    let chest = model.material(Material::new("red", vec3(0.6, 0.15, 0.1)));
    model.add(chest.block(vec3(2.2, 0.4, 1.4), vec3(0.8, 0.8, 0.8), 0.5));
    model
}
