//! A camera obscura: a dark box, a hole of twelve millimeters made by a clip map, and what is outside on the back wall.

use glam::{Vec2, Vec3, vec2, vec3};

use super::shapes::{card, painted_sky, walls};
use crate::render::{Bitmap, Camera, Material, Model};

const SIZE: Vec3 = vec3(2.0, 2.0, 2.6);

pub(crate) fn pinhole() -> Model {
    let camera = Camera::looking(vec3(0.15, 1.1, 1.3), vec3(2.0, 1.0, 1.3), 58.0);
    let mut model = Model::new(camera, Some(painted_sky(street)));
    walls(&mut model, SIZE, [Vec3::splat(0.5), Vec3::splat(0.8), Vec3::splat(0.5)]);
    // 2 m over 1024 texels: a hole of six of them.
    let hole = model.bitmap(Bitmap::mask(1024, 1024, |uv| (uv - 0.5).length() < 0.003));
    let front = model.material(Material::new("window hole", Vec3::splat(0.5)).mask(hole));
    model.add(card(front, 0.0, Vec2::ZERO, vec2(SIZE.y, SIZE.z)));
    model
}

/// A street: houses in four colors with windows, a lawn, a blue sky and a low sun.
fn street(direction: Vec3) -> Vec3 {
    let place = vec2(direction.z, direction.y) / -direction.x.min(-1e-3);
    let sun = vec3(-0.85, 0.42, 0.3).normalize();
    if direction.distance(sun) < 0.02 {
        return vec3(900.0, 800.0, 600.0);
    }
    let sky = vec3(0.3, 0.5, 0.95) * (1.0 + 0.6 * (1.0 - direction.y));
    if direction.x >= 0.0 {
        return sky.max(Vec3::ZERO) * if direction.y > 0.0 { 1.0 } else { 0.2 };
    }
    if direction.y < -0.12 {
        return vec3(0.15, 0.45, 0.08);
    }
    let number = (place.x * 2.5 + 10.0).floor();
    let across = place.x * 2.5 + 10.0 - number;
    let colors = [vec3(1.3, 0.35, 0.2), vec3(1.2, 1.0, 0.3), vec3(0.3, 0.75, 0.8), vec3(1.2, 1.1, 1.0)];
    let height = 0.22 + 0.1 * (number * 2.4).sin() - 0.35 * (across - 0.5).abs().max(0.2) + 0.1;
    if place.y > height {
        return sky;
    }
    let pane = vec2((across * 4.0).fract(), ((place.y + 0.12) * 9.0).fract());
    let is_window = (0.3..0.7).contains(&pane.x) && (0.3..0.75).contains(&pane.y);
    if is_window { vec3(0.05, 0.06, 0.1) } else { colors[number as usize % 4] }
}
