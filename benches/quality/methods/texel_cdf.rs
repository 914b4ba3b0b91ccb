//! Texels of textured triangles by their power (Šik and Křivánek 2013, "Fast Random Sampling of Triangular Meshes"):
//! triangles are cut along texels, and all parts of all triangles stand in one cumulative table. The shading point is
//! not asked.

use ::fanlight::ShadingPoint;
use glam::DVec2;

use super::discrete::Cumulative;
use super::triangle::uniform;
use super::{Drawn, Method};
use crate::oracle::quadrature::{Corner, clip};
use crate::scenes::{Light, Scene, Weight};

/// A triangular part of a light within one texel.
struct Part {
    light: u32,
    corners: [[f32; 2]; 3],
}

pub(crate) struct TexelCdf<'a> {
    scene: &'a Scene,
    parts: Vec<Part>,
    cumulative: Cumulative,
}

impl<'a> TexelCdf<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let mut parts = vec![];
        let mut weights = vec![];
        for (number, light) in (0..).zip(&scene.lights) {
            let (_, area) = light.normal_and_area();
            for_each_part(scene, light, |corners, texel| {
                let share = cross(corners[1] - corners[0], corners[2] - corners[0]).abs();
                weights.push(area * share * texel);
                parts.push(Part { light: number, corners: corners.map(|c| c.as_vec2().to_array()) });
            });
        }
        Self { scene, parts, cumulative: Cumulative::new(weights.into_iter()) }
    }

    /// Density per area of a point.
    fn density(&self, light: usize, barycentrics: [f64; 2]) -> f64 {
        texel_at(self.scene, light, barycentrics) / self.cumulative.total()
    }
}

/// Mean of the texel under a point.
fn texel_at(scene: &Scene, light: usize, barycentrics: [f64; 2]) -> f64 {
    match (&scene.lights[light].weight, &scene.image) {
        (Weight::Image, Some(image)) => {
            let at = scene.lights[light].uv(barycentrics) * image.size as f64;
            let index = |x: f64| (x as usize).min(image.size - 1);
            image.texel_mean(index(at.x), index(at.y))
        }
        _ => scene.weight(light, barycentrics),
    }
}

fn cross(a: DVec2, b: DVec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Cuts a light along texels; passes on barycentrics and the mean of the texel.
fn for_each_part(scene: &Scene, light: &Light, mut each: impl FnMut([DVec2; 3], f64)) {
    let image = match (&scene.image, light.weight) {
        (Some(image), Weight::Image) => image,
        (_, Weight::Constant(weight)) => return each([DVec2::ZERO, DVec2::X, DVec2::Y], f64::from(weight)),
        _ => return,
    };
    // The place is in texels here, and the patch holds barycentrics.
    let corner = |i: usize, patch: DVec2| Corner { place: (light.uvs[i] * image.size as f64).extend(0.0), patch };
    let whole = [corner(0, DVec2::ZERO), corner(1, DVec2::X), corner(2, DVec2::Y)];
    let span = |polygon: &[Corner], axis: usize| {
        let low = polygon.iter().fold(f64::INFINITY, |low, c| low.min(c.place[axis]));
        let high = polygon.iter().fold(0.0_f64, |high, c| high.max(c.place[axis]));
        low.floor() as usize..high.ceil() as usize
    };
    let strip = |polygon: &[Corner], axis: usize, at: usize| {
        let above = clip(polygon, |c| c.place[axis] - at as f64);
        clip(&above, |c| (at + 1) as f64 - c.place[axis])
    };
    for y in span(&whole, 1) {
        let row = strip(&whole, 1, y);
        for x in span(&row, 0) {
            let cell = strip(&row, 0, x);
            for i in 2..cell.len() {
                each([cell[0].patch, cell[i - 1].patch, cell[i].patch], image.texel_mean(x, y));
            }
        }
    }
}

impl Method for TexelCdf<'_> {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let part = &self.parts[self.cumulative.sample(u[0])];
        let [b1, b2] = uniform([f64::from(u[1]), f64::from(u[2])]);
        let [p, q, r] = part.corners.map(|c| DVec2::new(f64::from(c[0]), f64::from(c[1])));
        let place = (p + (q - p) * b1 + (r - p) * b2).to_array();
        let light = part.light as usize;
        let offset = self.scene.lights[light].point(place) - x.position.as_dvec3();
        let mut drawn = Drawn {
            light,
            barycentrics: place.map(|b| b as f32),
            direction: offset.normalize().as_vec3(),
            pdf: 0.0,
            radiance: None,
        };
        drawn.pdf = self.pdf(x, &drawn);
        (drawn.pdf > 0.0).then_some(drawn)
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let light = &self.scene.lights[drawn.light];
        let place = drawn.barycentrics.map(f64::from);
        let offset = light.point(place) - x.position.as_dvec3();
        let (normal, _) = light.normal_and_area();
        let height = -normal.dot(offset);
        if height <= 0.0 {
            return 0.0;
        }
        self.density(drawn.light, place) * offset.length().powi(3) / height
    }

    fn pmfs(&self, _: &ShadingPoint, _: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let mut pmfs = vec![0.0; self.scene.lights.len()];
        for (i, part) in self.parts.iter().enumerate() {
            pmfs[part.light as usize] += self.cumulative.pmf(i);
        }
        Some(pmfs)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.parts[..]) + self.cumulative.bytes()
    }
}
