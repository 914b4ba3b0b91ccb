//! A lantern: a small bulb behind painted paper. The paper is a portal that scatters what it lets in.

use core::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, Vec4, vec2, vec3};

use super::shapes::walls;
use crate::render::{Bitmap, Camera, Lobe, Material, Mesh, Model};

const CENTER: Vec3 = vec3(1.7, 1.45, 1.8);
const SIZE: Vec3 = vec3(4.0, 2.6, 4.0);

pub(crate) fn lantern() -> Model {
    let camera = Camera::looking(vec3(3.8, 1.6, 3.7), vec3(1.7, 1.05, 1.7), 48.0);
    let mut model = Model::new(camera, None);
    walls(&mut model, SIZE, [vec3(0.4, 0.28, 0.18), vec3(0.6, 0.55, 0.45), vec3(0.55, 0.5, 0.42)]);
    let wall = model.material(Material::new("screen", vec3(0.6, 0.55, 0.45)));
    model.add(wall.quad(Vec3::ZERO, Vec3::Y * SIZE.y, Vec3::Z * SIZE.z));

    let painted = model.bitmap(Bitmap::draw(256, 128, painting));
    let paper = model.material(Material::new("window paper", Vec3::ONE).lobe(Lobe::Translucent(0.6)).map(painted));
    model.add(spheroid(paper));
    let caps = model.material(Material::new("caps", Vec3::splat(0.03)));
    let cap = |y: f32| vec3(CENTER.x, CENTER.y + y, CENTER.z);
    model.add(caps.block(cap(0.245), vec3(0.2, 0.03, 0.2), 0.0).block(cap(-0.245), vec3(0.2, 0.03, 0.2), 0.0));
    let bulb = model.material(Material::emitter("bulb", vec3(900.0, 620.0, 320.0)));
    model.add(bulb.sphere(CENTER, 0.02, 8));

    let table = model.material(Material::new("table", vec3(0.3, 0.14, 0.07)));
    model.add(table.block(vec3(1.7, 0.35, 1.8), vec3(1.3, 0.7, 1.0), 0.2));
    let cup = model.material(Material::new("cup", vec3(0.7, 0.75, 0.8)));
    model.add(cup.sphere(vec3(2.1, 0.8, 1.9), 0.1, 16));
    model
}

/// A paper balloon, open where its caps are.
fn spheroid(mut paper: Mesh) -> Mesh {
    paper.grid([48, 24], |at| {
        let height = 0.5 * (PI * (at.y - 0.5) * 0.94).sin();
        let radius = 0.24 * (1.0 - (height / 0.58).powi(2) * 1.05).max(0.0).sqrt();
        let (sin, cos) = (TAU * at.x).sin_cos();
        CENTER + vec3(radius * sin, 0.5 * height, radius * cos)
    });
    paper
}

/// Ink on rice paper: a red sun, reeds, and bands at both ends.
fn painting(uv: Vec2) -> Vec4 {
    let mut color = vec3(0.95, 0.88, 0.72);
    if [0.15, 0.65].iter().any(|&u| ((uv - vec2(u, 0.6)) * vec2(2.0, 1.0)).length() < 0.17) {
        color = vec3(0.75, 0.05, 0.03);
    }
    let reed = |k: f32| {
        let bend = 0.03 * (5.0 * uv.y + 2.1 * k).sin() * uv.y;
        let height = 0.55 + 0.3 * (7.3 * k).sin();
        (uv.x - (k + 0.5) / 11.0 - bend).abs() < 0.006 * (1.2 - uv.y) && uv.y < height
    };
    if (0..11).any(|k| reed(k as f32)) || !(0.08..0.92).contains(&uv.y) {
        color = Vec3::splat(0.02);
    }
    Vec4::from((color, 1.0))
}
