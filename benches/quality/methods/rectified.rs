//! Portal-masked environment map sampling (Bitterli, Novák and Jarosz 2015) as in pbrt-v4's
//! `PortalImageInfiniteLight`: the environment is resampled to a map in which every rectangle parallel to the portal
//! is seen as an axis-parallel rectangle, and a summed-area table yields the part of the map in the rectangle.
//!
//! As in pbrt, the rectified map itself is what the sky looks like. Where a scene has several openings or a clip map,
//! the rectangle is the box around all of them; of two walls, the outer one's.

use core::f64::consts::PI;

use ::fanlight::ShadingPoint;
use glam::{DVec2, DVec3};

use super::{Drawn, Method};
use crate::scenes::Scene;
use crate::scenes::sky::Sky;
use crate::scenes::wall::{Opening, Wall};

const SIZE: usize = 1024;

pub(crate) struct Rectified {
    min: DVec3,
    max: DVec3,
    /// Radiance.
    image: Vec<f32>,
    /// Density before it is restricted to a window: radiance times solid angle of a texel.
    density: Vec<f32>,
    /// Sums of `density` below and left of the corners of texels, as means.
    sums: Vec<f64>,
}

impl Rectified {
    pub(crate) fn new(scene: &Scene) -> Self {
        let sky = scene.sky.as_ref().expect("the workload has openings");
        let wall = scene.walls[0];
        let (low, high) = bounds(&wall);
        let corner = |place: f64| DVec3::new(wall.min.x + place * wall.side, wall.y, wall.min.y + place * wall.side);
        let image: Vec<f32> = (0..SIZE * SIZE).map(|texel| radiance(sky, texel % SIZE, texel / SIZE) as f32).collect();
        let solid_angle = |texel: usize| {
            let center = (DVec2::new((texel % SIZE) as f64, (texel / SIZE) as f64) + 0.5) / SIZE as f64;
            1.0 / texture_per_solid_angle(direction(center))
        };
        let density: Vec<f32> =
            image.iter().enumerate().map(|(i, r)| (f64::from(*r) * solid_angle(i)) as f32).collect();
        let sums = summed_area(&density);
        Self { min: corner(low), max: corner(high), image, density, sums }
    }

    /// The window as it is seen from a point, as a rectangle of the map.
    fn window(&self, x: &ShadingPoint) -> Option<(DVec2, DVec2)> {
        let place = |corner: DVec3| square(corner - x.position.as_dvec3());
        Some((place(self.min)?, place(self.max)?))
    }

    /// Integral of the density over the rectangle from the origin.
    fn below(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x * SIZE as f64, y * SIZE as f64);
        let (i, j) = ((x as usize).min(SIZE - 1), (y as usize).min(SIZE - 1));
        let (fx, fy) = (x - i as f64, y - j as f64);
        let row = |j: usize| {
            let at = j * (SIZE + 1) + i;
            self.sums[at] + (self.sums[at + 1] - self.sums[at]) * fx
        };
        row(j) + (row(j + 1) - row(j)) * fy
    }

    fn integral(&self, min: DVec2, max: DVec2) -> f64 {
        self.below(max.x, max.y) - self.below(min.x, max.y) - self.below(max.x, min.y) + self.below(min.x, min.y)
    }

    fn texel(uv: DVec2) -> usize {
        let index = |x: f64| ((x * SIZE as f64) as usize).min(SIZE - 1);
        index(uv.y) * SIZE + index(uv.x)
    }
}

/// Low and high end of the openings along both axes, in units of the wall's side.
fn bounds(wall: &Wall) -> (f64, f64) {
    match wall.opening {
        Opening::Grid(k) => (0.25 / k as f64, 1.0 - 0.25 / k as f64),
        Opening::Whole | Opening::Clipped => (0.0, 1.0),
    }
}

/// Mean radiance of a texel of the map; finely where the sun is near.
fn radiance(sky: &Sky, x: usize, y: usize) -> f64 {
    let mean = |n: usize| {
        let place = |i: usize, k: usize| (i as f64 + (k as f64 + 0.5) / n as f64) / SIZE as f64;
        let sample = |k: usize| sky.texel(direction(DVec2::new(place(x, k % n), place(y, k / n))));
        (0..n * n).map(sample).sum::<f64>() / (n * n) as f64
    };
    let coarse = mean(2);
    let near_sun = {
        let center = direction((DVec2::new(x as f64, y as f64) + 0.5) / SIZE as f64);
        sky.sun.first().is_some_and(|(sun, _)| sun.dot(center) > 0.03_f64.cos())
    };
    if near_sun { mean(16) } else { coarse }
}

/// World direction of a place in the map. The wall's normal `+y` is the map's axis.
fn direction(uv: DVec2) -> DVec3 {
    let angles = (uv - 0.5) * PI;
    DVec3::new(angles.x.tan(), 1.0, angles.y.tan()).normalize()
}

/// The inverse, for directions through the wall.
fn square(direction: DVec3) -> Option<DVec2> {
    let angles = DVec2::new(direction.x.atan2(direction.y), direction.z.atan2(direction.y));
    (direction.y > 0.0).then(|| angles / PI + 0.5)
}

/// How much of the map's area is in a unit of solid angle.
fn texture_per_solid_angle(w: DVec3) -> f64 {
    w.y / (PI * PI * (1.0 - w.x * w.x) * (1.0 - w.z * w.z))
}

fn summed_area(density: &[f32]) -> Vec<f64> {
    let mut sums = vec![0.0; (SIZE + 1) * (SIZE + 1)];
    for y in 0..SIZE {
        let mut row = 0.0;
        for x in 0..SIZE {
            row += f64::from(density[y * SIZE + x]) / (SIZE * SIZE) as f64;
            sums[(y + 1) * (SIZE + 1) + x + 1] = sums[y * (SIZE + 1) + x + 1] + row;
        }
    }
    sums
}

/// Where a cumulative function that is linear within texels reaches `u`.
fn invert(cumulative: impl Fn(f64) -> f64, u: f64, mut min: f64, mut max: f64) -> f64 {
    let n = SIZE as f64;
    while (n * max).ceil() - (n * min).floor() > 1.0 {
        let middle = 0.5 * (min + max);
        if cumulative(middle) <= u {
            min = middle;
        } else {
            max = middle;
        }
    }
    let (low, high) = (cumulative(min), cumulative(max));
    let t = if high > low { (u - low) / (high - low) } else { 0.5 };
    (min + (max - min) * t).clamp(min, max)
}

impl Method for Rectified {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let (min, max) = self.window(x)?;
        let total = self.integral(min, max);
        if total <= 0.0 {
            return None;
        }
        let column = |x: f64| self.integral(min, DVec2::new(x, max.y)) / total;
        let px = invert(column, f64::from(u[1]), min.x, max.x);
        let texel = (px * SIZE as f64).floor().min((SIZE - 1) as f64);
        let (left, right) = (texel / SIZE as f64, (texel + 1.0) / SIZE as f64);
        let part = |y: f64| self.integral(DVec2::new(left, min.y), DVec2::new(right, y));
        let column_total = part(max.y);
        if column_total <= 0.0 {
            return None;
        }
        let py = invert(|y| part(y) / column_total, f64::from(u[2]), min.y, max.y);
        let uv = DVec2::new(px, py);
        let direction = direction(uv);
        let texel = Self::texel(uv);
        let pdf = f64::from(self.density[texel]) / total * texture_per_solid_angle(direction);
        let radiance = Some(f64::from(self.image[texel]));
        Some(Drawn { light: 0, barycentrics: [0.0; 2], direction: direction.as_vec3(), pdf, radiance })
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let direction = drawn.direction.as_dvec3();
        let (Some((min, max)), Some(uv)) = (self.window(x), square(direction)) else { return 0.0 };
        let total = self.integral(min, max);
        let is_inside = uv.cmpge(min).all() && uv.cmple(max).all();
        if !is_inside || total <= 0.0 {
            return 0.0;
        }
        f64::from(self.density[Self::texel(uv)]) / total * texture_per_solid_angle(direction)
    }

    fn pmfs(&self, _: &ShadingPoint, _: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        None
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.image[..]) + size_of_val(&self.density[..]) + size_of_val(&self.sums[..])
    }

    fn has_own_environment(&self) -> bool {
        true
    }
}
