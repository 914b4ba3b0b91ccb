//! Fog in a room with a window: hazy sunlight between its bars.

use glam::{Vec2, Vec3, vec2, vec3};

use super::shapes::{card, hazy, rectangle, wall_at, walls};
use crate::render::{Bitmap, Camera, Fog, Material, Model};

const SIZE: Vec3 = vec3(5.0, 3.2, 4.0);

pub(crate) fn fog() -> Model {
    let camera = Camera::looking(vec3(3.9, 1.3, 3.8), vec3(0.6, 1.35, 1.3), 58.0);
    let mut model = Model::new(camera, Some(hazy(vec3(-0.8, 0.55, 0.3).normalize(), 30.0, 10.0)));
    walls(&mut model, SIZE, [vec3(0.4, 0.35, 0.3), Vec3::splat(0.5), vec3(0.45, 0.45, 0.5)]);
    model.guide_texels = Some(64);
    let (low, high) = (vec2(1.2, 0.9), vec2(2.8, 2.5));
    let outline = rectangle(Vec2::ZERO, vec2(SIZE.y, SIZE.z));
    let wall = model.material(Material::new("front", Vec3::splat(0.5)));
    model.add(wall.polygon(wall_at(0.0), &outline, &[rectangle(low, high)]));
    // Three by three panes.
    let bars = model.bitmap(Bitmap::mask(192, 192, |uv| {
        let pane = (3.0 * uv).fract();
        pane.min(Vec2::ONE - pane).min_element() > 0.1
    }));
    let window = model.material(Material::new("window bars", Vec3::splat(0.1)).mask(bars));
    model.add(card(window, 0.0, low, high));
    model.fog = Some(Fog { low: Vec3::ZERO, high: SIZE, density: 0.12 });
    let chest = model.material(Material::new("chest", vec3(0.45, 0.25, 0.12)));
    model.add(chest.block(vec3(2.4, 0.35, 1.2), vec3(0.9, 0.7, 0.6), 0.4));
    model
}
