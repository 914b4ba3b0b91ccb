//! The irradiance of every portal by spherical harmonics (Wang and Ramamoorthi 2018): without noise, as far as the
//! environment is smooth.

use ::fanlight::{Receiver, ShadingPoint};
use glam::DVec3;

use crate::harmonics::Harmonics;
use crate::oracle::lambert;
use crate::scenes::Scene;
use crate::scenes::sky;

/// Samples of the environment per axis of the equal-area map. Larger: exacter coefficients, slower to build.
const RESOLUTION: usize = 256;
/// Least share of a portal's irradiance under the mean radiance that the choice counts on: harmonics of a low degree
/// may come to less than nothing.
const LEAST_SHARE: f64 = 0.05;

/// The choice of a portal by its irradiance.
pub(crate) struct Harmonic {
    portals: Vec<[DVec3; 3]>,
    harmonics: Harmonics,
    mean: f64,
}

impl Harmonic {
    /// Projects the environment with no radiance above `most`: a small sun makes harmonics of a low degree swing
    /// everywhere.
    pub(crate) fn new(scene: &Scene, degree: usize, most: f64) -> Self {
        let sky = scene.sky.as_ref().expect("the workload has openings");
        let radiances = || radiances(sky).map(|(direction, radiance)| (direction, radiance.min(most)));
        let harmonics = Harmonics::of_radiance(degree, radiances());
        let mean = radiances().map(|(_, radiance)| radiance).sum::<f64>() / (RESOLUTION * RESOLUTION) as f64;
        Self { portals: scene.lights.iter().map(|light| light.vertices).collect(), harmonics, mean }
    }

    /// The function that is integrated.
    pub(crate) fn harmonics(&self) -> &Harmonics {
        &self.harmonics
    }

    /// What a portal sends to a point, as far as harmonics know.
    pub(crate) fn irradiance(&self, x: &ShadingPoint, portal: usize) -> f64 {
        let normal = normal(x);
        let relative = self.portals[portal].map(|v| v - x.position.as_dvec3());
        let (polygon, count) = above_horizon(normal, &relative);
        // Portals face the room: from the inside their corners run clockwise.
        if count < 3 { 0.0 } else { self.harmonics.integral(&polygon[..count]).dot(normal) }
    }

    /// Weights of all portals, and their sum.
    pub(crate) fn weights(&self, x: &ShadingPoint) -> (Vec<f64>, f64) {
        let weight = |portal: usize| {
            let relative = self.portals[portal].map(|v| v - x.position.as_dvec3());
            let [a, b, c] = relative;
            let is_front = (b - a).cross(c - a).dot(a) < 0.0;
            let flat = if is_front { lambert::irradiance(normal(x), &relative) } else { 0.0 };
            if flat > 0.0 { self.irradiance(x, portal).max(LEAST_SHARE * self.mean * flat) } else { 0.0 }
        };
        let weights: Vec<f64> = (0..self.portals.len()).map(weight).collect();
        let sum = weights.iter().sum();
        (weights, sum)
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.portals[..])
    }
}

/// Directions of equal solid angle, with their radiance.
fn radiances(sky: &sky::Sky) -> impl Iterator<Item = (DVec3, f64)> {
    let center = |i: usize| (i as f64 + 0.5) / RESOLUTION as f64;
    (0..RESOLUTION * RESOLUTION).map(move |k| {
        let direction = sky::square_to_sphere(glam::DVec2::new(center(k % RESOLUTION), center(k / RESOLUTION)));
        (direction, f64::from(sky.environment.radiance(direction.as_vec3())))
    })
}

/// Unit normal of a surface.
pub(crate) fn normal(x: &ShadingPoint) -> DVec3 {
    let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
    normal.as_dvec3()
}

/// Unit directions to the corners of the part of a triangle above the horizon, counterclockwise as seen from the point,
/// and their number.
fn above_horizon(normal: DVec3, relative: &[DVec3; 3]) -> ([DVec3; 4], usize) {
    let mut polygon = [DVec3::ZERO; 4];
    let mut count = 0;
    for i in 0..3 {
        let (v, next) = (relative[(3 - i) % 3], relative[2 - i]);
        let (height, next_height) = (normal.dot(v), normal.dot(next));
        let crossing = (height >= 0.0) != (next_height >= 0.0);
        let on_horizon = crossing.then(|| v + (next - v) * (height / (height - next_height)));
        for corner in (height >= 0.0).then_some(v).into_iter().chain(on_horizon) {
            polygon[count] = corner.normalize();
            count += 1;
        }
    }
    (polygon, count)
}
