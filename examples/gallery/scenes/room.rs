//! A room with two star-shaped windows: a hole, and a card with a clip map.

use glam::{Vec2, Vec3, vec2, vec3};

use super::shapes::{card, rectangle, star, star_mask, wall_at, walls};
use crate::render::{Camera, Daylight, Lobe, Material, Model};

const SIZE: Vec3 = vec3(4.0, 3.0, 4.0);

pub(crate) fn room() -> Model {
    let camera = Camera::looking(vec3(0.3, 2.2, 3.7), vec3(2.6, 0.5, 1.2), 60.0);
    let mut model = Model::new(camera, Some(Daylight::new().draw()));
    walls(&mut model, SIZE, [vec3(0.5, 0.4, 0.3), Vec3::splat(0.7), vec3(0.55, 0.62, 0.7)]);

    let hole = star(vec2(1.8, 1.1), 0.55);
    let (low, high) = (vec2(1.25, 2.25), vec2(2.35, 3.35));
    let outline = rectangle(Vec2::ZERO, vec2(SIZE.y, SIZE.z));
    let wall = model.material(Material::new("wall with holes", Vec3::splat(0.7)));
    model.add(wall.polygon(wall_at(0.0), &outline, &[hole.clone(), rectangle(low, high)]));
    let window = model.material(Material::new("window", Vec3::ONE).lobe(Lobe::Clear));
    model.add(window.polygon(wall_at(0.0), &hole, &[]));
    let mask = model.bitmap(star_mask(512));
    let window = model.material(Material::new("window card", Vec3::splat(0.7)).mask(mask));
    model.add(card(window, 0.0, low, high));

    let table = model.material(Material::new("wood", vec3(0.45, 0.25, 0.12)));
    let leg = |x, z| (vec3(x, 0.35, z), vec3(0.08, 0.7, 0.08));
    let mut table = table.block(vec3(2.6, 0.73, 1.3), vec3(1.4, 0.06, 0.8), 0.3);
    for (center, size) in [leg(2.1, 1.2), leg(3.0, 0.9), leg(2.2, 1.7), leg(3.1, 1.4)] {
        table = table.block(center, size, 0.3);
    }
    model.add(table);
    let sphere = model.material(Material::new("metal", vec3(0.8, 0.7, 0.4)).lobe(Lobe::Glossy(60.0)));
    model.add(sphere.sphere(vec3(2.5, 0.96, 1.3), 0.2, 24));
    let chest = model.material(Material::new("red", vec3(0.6, 0.15, 0.1)));
    model.add(chest.block(vec3(1.3, 0.25, 0.5), vec3(0.6, 0.5, 0.5), 0.6));
    model
}
