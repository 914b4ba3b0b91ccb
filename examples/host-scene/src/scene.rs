//! What is rendered: balls in a corner below sixty lamps, of which every tenth is bright. Everything is diffuse.

use core::f32::consts::TAU;

use rust_pathtracer::prelude::*;

use crate::lights::{Lights, vector};

/// Surfaces that a path may meet.
const DEPTH: u16 = 4;
const LAMPS: u8 = 60;

/// A plane through a point, or a ball.
enum Shape {
    Plane(F3, F3),
    Ball(F3, f32),
}

/// The scene, lit by the renderer's own choice of lamps or through `fanlight`.
pub(crate) struct World {
    shapes: Vec<(Shape, F3)>,
    lamps: Vec<AnalyticalLight>,
    camera: Box<dyn Camera3D>,
    through: Option<Lights>,
}

impl World {
    /// The scene lit through `fanlight`.
    pub(crate) fn through_fanlight() -> Result<Self, fanlight::Error> {
        let own = Self::new();
        Ok(Self { through: Some(Lights::new(&own.lamps)?), ..own })
    }

    /// The nearest surface along a ray that is nearer than a distance: its distance, normal and color.
    fn nearest(&self, ray: &Ray, most: f32) -> Option<(f32, F3, F3)> {
        let mut nearest = None;
        let mut most = most;
        for (shape, color) in &self.shapes {
            let distance = match shape {
                Shape::Plane(point, normal) => dot(&(*point - ray.origin), normal) / dot(&ray.direction, normal),
                Shape::Ball(center, radius) => ball(ray, *center, *radius),
            };
            if distance > 0.0 && distance < most {
                most = distance;
                let normal = match shape {
                    Shape::Plane(_, normal) => *normal,
                    Shape::Ball(center, _) => normalize(&(ray.at(&distance) - *center)),
                };
                nearest = Some((distance, normal, *color));
            }
        }
        nearest
    }

    /// The nearest lamp along a ray that is nearer than a distance.
    fn nearest_lamp(&self, ray: &Ray, most: f32) -> Option<(usize, f32)> {
        let distances = self.lamps.iter().map(|lamp| ball(ray, lamp.light.position, lamp.light.radius));
        let hits = distances.enumerate().filter(|(_, distance)| *distance > 0.0 && *distance < most);
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Distance to a ball from outside; NaN if there is none.
fn ball(ray: &Ray, center: F3, radius: f32) -> f32 {
    let (step, direction) = (vector(center - ray.origin), vector(ray.direction));
    let along = step.dot(direction);
    along - (radius * radius - step.cross(direction).length_squared()).sqrt()
}

impl Scene for World {
    fn new() -> Self {
        let gray = F3::new_x(0.6);
        let shapes = vec![
            (Shape::Plane(F3::zeros(), F3::new(0.0, 1.0, 0.0)), gray),
            (Shape::Plane(F3::new(0.0, 0.0, -2.5), F3::new(0.0, 0.0, 1.0)), F3::new(0.5, 0.55, 0.6)),
            (Shape::Ball(F3::new(-1.2, 0.6, -0.4), 0.6), F3::new(0.8, 0.3, 0.2)),
            (Shape::Ball(F3::new(0.2, 0.4, 0.9), 0.4), F3::new(0.3, 0.5, 0.8)),
            (Shape::Ball(F3::new(1.3, 0.5, -0.2), 0.5), F3::new(0.7, 0.6, 0.2)),
        ];
        let lamp = |number: u8| {
            let turn = TAU * f32::from(number) / f32::from(LAMPS);
            let place = F3::new(2.6 * turn.cos(), 1.3 + (3.0 * turn).sin(), 2.0 * turn.sin());
            let radiance = if number.is_multiple_of(10) { 150.0 } else { 5.0 };
            AnalyticalLight::spherical(place, 0.04, F3::new(0.9, 1.0, 0.8).mult_f(&radiance))
        };
        let mut camera: Box<dyn Camera3D> = Box::new(Pinhole::new());
        camera.set(F3::new(0.3, 2.0, 5.2), F3::new(0.0, 0.8, 0.0));
        camera.set_fov(55.0);
        Self { shapes, lamps: (0..LAMPS).map(lamp).collect(), camera, through: None }
    }

    fn background(&self, _: &Ray) -> F3 {
        F3::zeros()
    }

    fn closest_hit(&self, ray: &Ray, state: &mut State, light: &mut LightSampleRec) -> bool {
        let surface = self.nearest(ray, f32::INFINITY);
        let distance = surface.map_or(f32::INFINITY, |hit| hit.0);
        let lamp = self.nearest_lamp(ray, distance);
        match &self.through {
            Some(lights) => {
                if let Some((lamp, near)) = lamp {
                    (light.emission, light.pdf) =
                        (self.lamps[lamp].light.emission, lights.pdf(state, lamp, ray.direction));
                    (state.is_emitter, state.hit_dist) = (true, near);
                    return true;
                }
            }
            None => {
                state.hit_dist = distance;
                if self.sample_lights(ray, state, light, &self.lamps) {
                    return true;
                }
            }
        }
        let Some((distance, normal, color)) = surface else { return false };
        (state.hit_dist, state.normal) = (distance, normal);
        // Without a step of the index of refraction nothing is glossy.
        (state.material.rgb, state.material.roughness, state.material.ior) = (color, 0.5, 1.0);
        if let Some(lights) = &self.through {
            let mut here = state.clone();
            here.finalize(ray);
            state.material.emission = lights.reflected(ray, &here, &self.lamps, |ray, most| self.any_hit(ray, most));
        }
        true
    }

    fn any_hit(&self, ray: &Ray, most: f32) -> bool {
        self.nearest(ray, most).is_some() || self.nearest_lamp(ray, most).is_some()
    }

    fn camera(&self) -> &Box<dyn Camera3D> {
        &self.camera
    }

    /// None for the renderer to choose from, where `fanlight` chooses.
    fn number_of_lights(&self) -> usize {
        if self.through.is_some() { 0 } else { self.lamps.len() }
    }

    fn light_at(&self, index: usize) -> &AnalyticalLight {
        &self.lamps[index]
    }

    fn recursion_depth(&self) -> u16 {
        DEPTH
    }

    fn as_any(&mut self) -> &mut dyn core::any::Any {
        self
    }
}
