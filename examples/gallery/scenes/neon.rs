//! A curved wall of light with a neon sign on it: an emission texture whose brightest texels outshine the rest
//! a thousandfold.

use core::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4, vec2, vec3};

use super::glyphs::is_ink;
use crate::render::{Bitmap, Camera, Lobe, Material, Model};

/// Texels of the wall.
const TEXELS: [usize; 2] = [1568, 288];

pub(crate) fn neon() -> Model {
    let camera = Camera::looking(vec3(0.0, 1.9, 2.9), vec3(0.0, 0.2, 0.1), 52.0);
    let mut model = Model::new(camera, None);
    let sign = model.bitmap(Bitmap::draw(TEXELS[0], TEXELS[1], sign));
    let mut wall = model.material(Material {
        emission_map: Some(sign),
        color: Vec3::splat(0.05),
        ..Material::emitter("wall of light", Vec3::splat(600.0))
    });
    // Faces +z, towards the camera.
    wall.grid([14, 1], |at| {
        let (sin, cos) = (0.9 * PI * (at.x - 0.5)).sin_cos();
        vec3(2.2 * sin, 0.02 + 1.0 * (1.0 - at.y), 1.0 - 2.2 * cos)
    });
    model.add(wall.facing(vec3(0.0, 0.8, 1.0)));
    let floor = model.material(Material::new("floor", Vec3::splat(0.45)));
    model.add(floor.quad(vec3(-5.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 10.0));
    let back = model.material(Material::new("back", vec3(0.3, 0.3, 0.35)));
    model.add(back.quad(vec3(-5.0, 0.0, -3.0), Vec3::X * 10.0, Vec3::Y * 4.0));
    let block = model.material(Material::new("block", Vec3::splat(0.7)));
    model.add(block.block(vec3(-0.9, 0.25, 0.6), vec3(0.5, 0.5, 0.5), 0.5));
    let ball = model.material(Material::new("ball", vec3(0.8, 0.8, 0.8)).lobe(Lobe::Glossy(40.0)));
    model.add(ball.sphere(vec3(0.7, 0.3, 0.4), 0.3, 24));
    let ball = model.material(Material::new("clay", vec3(0.7, 0.6, 0.5)));
    model.add(ball.sphere(vec3(0.0, 0.2, 1.2), 0.2, 24));
    model
}

/// Color of all light: what is left of the noise is that of places, not of colors.
const GLOW: Vec3 = vec3(1.0, 0.5, 0.42);

/// Thin strokes of letters and two bands, on a wall that is dark but for them.
fn sign(uv: Vec2) -> Vec4 {
    let texel = 1.0 / vec2(TEXELS[0] as f32, TEXELS[1] as f32);
    let near = [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y].map(|step| is_ink("FANLIGHT", uv + step * texel));
    // The outline of each letter alone glows.
    let color = if is_ink("FANLIGHT", uv) && near.contains(&false) {
        GLOW
    } else if (uv.y - 0.06).abs() < texel.y || (uv.y - 0.94).abs() < texel.y {
        0.6 * GLOW
    } else {
        Vec3::ZERO
    };
    Vec4::from((color, 1.0))
}
