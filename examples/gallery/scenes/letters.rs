//! Letters cut through a wall by a clip map, and a floor that light falls on through them.

use glam::{Vec2, Vec3, vec2, vec3};

use super::glyphs::is_ink;
use super::shapes::{rectangle, wall_at};
use crate::render::{Bitmap, Camera, Daylight, Material, Model};

/// The card with the letters, as (y, z).
const CARD: [Vec2; 2] = [vec2(1.0, 1.6), vec2(1.5, 4.4)];

pub(crate) fn letters() -> Model {
    let camera = Camera::looking(vec3(4.6, 2.6, 3.0), vec3(1.4, 0.3, 3.0), 60.0);
    let mut model = Model::new(camera, Some(Daylight::new().draw()));
    let floor = model.material(Material::new("floor", Vec3::splat(0.7)));
    model.add(floor.quad(Vec3::ZERO, Vec3::Z * 6.0, Vec3::X * 5.0));
    let wall = model.material(Material::new("wall", Vec3::splat(0.5)));
    let rest = wall.quad(Vec3::Y * 3.0, Vec3::X * 5.0, Vec3::Z * 6.0).quad(Vec3::X * 5.0, Vec3::Z * 6.0, Vec3::Y * 3.0);
    model.add(rest.quad(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 3.0).quad(Vec3::Z * 6.0, Vec3::Y * 3.0, Vec3::X * 5.0));
    let front = model.material(Material::new("front", Vec3::splat(0.5)));
    let outline = rectangle(Vec2::ZERO, vec2(3.0, 6.0));
    model.add(front.polygon(wall_at(0.0), &outline, &[rectangle(CARD[0], CARD[1])]));
    let text = model.bitmap(Bitmap::mask(49 * 16, 9 * 16, |uv| is_ink("FANLIGHT", uv)));
    let window = model.material(Material::new("window letters", Vec3::splat(0.5)).mask(text));
    // On its head, so that it can be read on the floor.
    let size = CARD[1] - CARD[0];
    model.add(window.quad(vec3(0.0, CARD[0].x, CARD[1].y), Vec3::NEG_Z * size.y, Vec3::Y * size.x));
    model
}
