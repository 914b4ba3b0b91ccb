//! Three floors of different roughness that mirror bulbs, a window and a screen.

use glam::{Vec2, Vec3, Vec4, vec2, vec3};

use super::glyphs::is_ink;
use super::shapes::{rectangle, wall_at};
use crate::render::{Bitmap, Camera, Daylight, Lobe, Material, Mesh, Model};

const SIZE: Vec3 = vec3(6.0, 3.0, 6.0);
/// Roughnesses of the floors, from the left to the right.
const ROUGHNESSES: [f32; 3] = [0.05, 0.15, 0.4];
/// Bulbs of each row and of each column.
const BULBS: [u16; 2] = [6, 4];
/// Texels of the screen.
const TEXELS: [usize; 2] = [256, 128];

pub(crate) fn glossy() -> Model {
    let camera = Camera::looking(vec3(5.7, 1.5, 3.0), vec3(1.6, 0.55, 3.0), 58.0);
    let mut model = Model::new(camera, Some(Daylight::new().draw()));
    add_walls(&mut model);
    let width = SIZE.z / ROUGHNESSES.len() as f32;
    for (i, alpha) in (0_u8..).zip(ROUGHNESSES) {
        let floor = model.material(Material::new("rough floor", Vec3::splat(0.55)).lobe(Lobe::Rough(alpha)));
        // The camera looks along -x, so that its right is towards -z.
        let z = SIZE.z - width * f32::from(i + 1);
        model.add(floor.quad(Vec3::Z * z, Vec3::Z * width, Vec3::X * SIZE.x));
    }
    add_bulbs(&mut model);
    let image = model.bitmap(Bitmap::draw(TEXELS[0], TEXELS[1], shown));
    let screen = Material { emission_map: Some(image), ..Material::emitter("screen", Vec3::splat(9.0)) };
    let screen = model.material(screen);
    // On the wall opposite the camera, to the left of the window.
    model.add(screen.quad(vec3(0.02, 1.75, 5.6), Vec3::NEG_Z * 2.2, Vec3::NEG_Y * 1.1).facing(vec3(3.0, 1.0, 3.0)));
    for (z, color) in [(4.4, vec3(0.6, 0.15, 0.1)), (1.5, vec3(0.15, 0.3, 0.5))] {
        let block = model.material(Material::new("block", color));
        model.add(block.block(vec3(1.5, 0.25, z), Vec3::splat(0.5), 0.5));
    }
    model
}

/// The walls, of which the one at x = 0 has a window, and the ceiling.
fn add_walls(model: &mut Model) {
    let (x, y, z) = (Vec3::X * SIZE.x, Vec3::Y * SIZE.y, Vec3::Z * SIZE.z);
    let walls = model.material(Material::new("wall", Vec3::splat(0.6)));
    let center = 0.5 * SIZE;
    let walls = walls.quad(y, x, z).quad(x, z, y).quad(Vec3::ZERO, x, y).quad(z, y, x);
    model.add(walls.facing(center));
    let opening = rectangle(vec2(0.7, 0.5), vec2(2.0, 2.2));
    let wall = model.material(Material::new("wall with a window", Vec3::splat(0.6)));
    let outline = rectangle(Vec2::ZERO, vec2(SIZE.y, SIZE.z));
    model.add(wall.polygon(wall_at(0.0), &outline, core::slice::from_ref(&opening)));
    let window = model.material(Material::new("window", Vec3::ONE).lobe(Lobe::Clear));
    model.add(window.polygon(wall_at(0.0), &opening, &[]));
}

/// Bulbs that hang from the ceiling.
fn add_bulbs(model: &mut Model) {
    let colors = [vec3(1.0, 0.75, 0.45), vec3(1.0, 0.5, 0.3), vec3(0.6, 0.8, 1.0)];
    let mut bulbs = colors.map(|color| model.material(Material::emitter("bulb", 60.0 * color)));
    let [columns, rows] = BULBS;
    for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
        let share = |i: u16, count: u16| (f32::from(i) + 0.5) / f32::from(count);
        let height = 2.3 + 0.1 * f32::from((3 * column + 5 * row) % 4);
        let center = vec3(0.8 + 3.2 * share(row, rows), height, SIZE.z * share(column, columns));
        let mesh: &mut Mesh = &mut bulbs[usize::from((column + 2 * row) % 3)];
        *mesh = core::mem::take(mesh).sphere(center, 0.05, 5);
    }
    bulbs.into_iter().for_each(|mesh| model.add(mesh));
}

/// Bright letters on a dim ground.
fn shown(uv: Vec2) -> Vec4 {
    let is_lit = is_ink("GLOSSY", (uv - vec2(0.06, 0.25)) / vec2(0.88, 0.5));
    let ground = 0.04 * vec3(0.3, 0.5, 1.0) * (1.0 + uv.x);
    Vec4::from((if is_lit { vec3(1.0, 0.9, 0.6) } else { ground }, 1.0))
}
