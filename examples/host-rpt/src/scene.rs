//! What is rendered: things on a floor, below a knot of neon and beside a screen.

use core::f64::consts::{PI, TAU};

use rpt::glm::{self, DVec3, vec3};
use rpt::{Camera, Material, Object, Scene, SceneAdd, Transformable, cube, plane, sphere};

use crate::emitter::Emitter;

/// A tube along a trefoil knot, which is brightest along a part of it, and a screen with bars outside of the picture.
pub(crate) fn emitters() -> Vec<Emitter> {
    let along = |t: f64| 0.5 * vec3(t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin());
    let knot = |u: f64, v: f64| {
        let t = TAU * v;
        let forwards = (along(t + 1e-4) - along(t - 1e-4)).normalize();
        let side = glm::cross(&forwards, &vec3(0.0, 0.0, 1.0)).normalize();
        let (sin, cos) = (TAU * u).sin_cos();
        vec3(0.0, 2.6, 0.0) + 0.5 * along(t) + 0.05 * (cos * side + sin * glm::cross(&forwards, &side))
    };
    let dash = |_: f32, v: f32| if (6.0 * v).fract() < 0.2 { 60.0 } else { 4.0 };
    let screen = |u: f64, v: f64| vec3(-3.0 + 0.4 * (PI * u).sin(), 0.2 + 1.8 * v, 2.0 - 3.0 * u);
    let bars = |u: f32, v: f32| if (3.0 * u).fract() < 0.12 && (v - 0.5).abs() < 0.4 { 40.0 } else { 0.0 };
    vec![Emitter::new([8, 300], knot, dash), Emitter::new([8, 2], screen, bars)]
}

/// Everything but the lights.
pub(crate) fn scene() -> Scene {
    let mut scene = Scene::new();
    let gray = |x: f64| Material::diffuse(vec3(x, x, x));
    scene.add(Object::new(plane(vec3(0.0, 1.0, 0.0), 0.0)).material(gray(0.6)));
    scene.add(Object::new(plane(vec3(0.0, 0.0, 1.0), -2.5)).material(Material::diffuse(vec3(0.5, 0.55, 0.6))));
    let ball = |center: DVec3, radius: f64| sphere().scale(&vec3(radius, radius, radius)).translate(&center);
    scene.add(Object::new(ball(vec3(-1.2, 0.6, -0.4), 0.6)).material(Material::diffuse(vec3(0.8, 0.3, 0.2))));
    scene.add(Object::new(ball(vec3(0.2, 0.4, 0.9), 0.4)).material(Material::specular(vec3(0.3, 0.5, 0.8), 0.3)));
    let block = cube().rotate_y(0.5).scale(&vec3(0.8, 1.1, 0.8)).translate(&vec3(1.2, 0.55, -0.3));
    scene.add(Object::new(block).material(Material::diffuse(vec3(0.8, 0.7, 0.4))));
    scene
}

pub(crate) fn camera() -> Camera {
    Camera::look_at(vec3(0.3, 2.0, 5.2), vec3(0.0, 0.9, 0.0), vec3(0.0, 1.0, 0.0), PI / 3.5)
}
