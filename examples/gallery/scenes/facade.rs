//! A hall behind a façade of many windows, all with the same clip map.

use glam::{Vec3, vec2, vec3};

use super::shapes::{card, overcast, painted_sky, star_mask, walls};
use crate::render::{Camera, Material, Model, Sky};

const SIZE: Vec3 = vec3(30.0, 15.0, 20.0);

/// The hall below clouds.
pub(crate) fn overcast_facade(rows: u32) -> Model {
    let mut model = facade(rows, painted_sky(overcast));
    model.guide_texels = Some(64);
    model
}

/// The hall with the given rows and columns of windows, each half as wide and half as high as their pitch.
pub(crate) fn facade(rows: u32, sky: Sky) -> Model {
    let camera = Camera::looking(vec3(26.0, 6.0, 16.0), vec3(8.0, 2.5, 6.0), 60.0);
    let mut model = Model::new(camera, Some(sky));
    walls(&mut model, SIZE, [vec3(0.55, 0.5, 0.42), Vec3::splat(0.7), vec3(0.6, 0.58, 0.5)]);
    let mask = model.bitmap(star_mask(64));
    let mut windows = model.material(Material::new("window", Vec3::splat(0.6)).mask(mask));
    let mut wall = model.material(Material::new("front", Vec3::splat(0.6)));
    let pitch = vec2(SIZE.y, SIZE.z) / rows as f32;
    let margin = 0.25 * pitch;
    for row in 0..rows {
        let low = pitch.x * row as f32;
        wall = card(wall, 0.0, vec2(low - margin.x, 0.0), vec2(low + margin.x, SIZE.z));
        for column in 0..rows {
            let low = vec2(low, pitch.y * column as f32);
            let inner = [low + margin, low + pitch - margin];
            windows = card(windows, 0.0, inner[0], inner[1]);
            wall = card(wall, 0.0, vec2(inner[0].x, low.y - margin.y), vec2(inner[1].x, inner[0].y));
        }
        wall = card(wall, 0.0, vec2(low + margin.x, SIZE.z - margin.y), vec2(low + pitch.x - margin.x, SIZE.z));
    }
    wall = card(wall, 0.0, vec2(SIZE.y - margin.x, 0.0), vec2(SIZE.y, SIZE.z));
    model.add(wall);
    model.add(windows);
    let mut columns = model.material(Material::new("columns", vec3(0.7, 0.65, 0.6)));
    for x in [7.0, 14.0, 21.0] {
        for z in [5.0, 15.0] {
            columns = columns.block(vec3(x, 7.5, z), vec3(1.0, 15.0, 1.0), 0.0);
        }
    }
    model.add(columns);
    let mut benches = model.material(Material::new("benches", vec3(0.35, 0.18, 0.1)));
    for x in [5.0, 10.0, 12.0, 17.0] {
        benches = benches.block(vec3(x, 0.4, 10.0), vec3(0.8, 0.8, 5.0), 0.0);
    }
    model.add(benches);
    model
}
