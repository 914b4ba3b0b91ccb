//! Stand-in for the light samplers.

use glam::{Vec2, Vec3, vec2};

use super::Error;
use super::room::Room;
use super::scene::SurfacePoint;
use super::sky::{Sky, direction_of, latitude_longitude};

pub(crate) struct Proposal {
    pub(crate) direction: Vec3,
    pub(crate) pdf: f32,
}

pub(crate) struct Lighting {
    size: Vec2,
    cdf: Vec<f32>,
    pmf: Vec<f32>,
    triangles: Vec<[Vec3; 3]>,
    area: f32,
}

fn area(t: &[Vec3; 3]) -> f32 {
    0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length()
}

impl Lighting {
    pub(crate) fn new(room: &Room, sky: &Sky) -> Result<Self, Error> {
        let (w, h) = (sky.width(), sky.height());
        let lum = sky.luminance();
        let mut pmf: Vec<f64> = (0..w * h)
            .map(|i| {
                let (x, y) = (i % w, i / w);
                let mut m = 0.0;
                for dy in 0..3 {
                    for dx in 0..3 {
                        let yy = (y + dy).saturating_sub(1).min(h - 1);
                        m += lum[yy * w + (x + w + dx - 1) % w];
                    }
                }
                (m as f64 + 1e-6) * (core::f64::consts::PI * (y as f64 + 0.5) / h as f64).sin()
            })
            .collect();
        let total: f64 = pmf.iter().sum();
        pmf.iter_mut().for_each(|p| *p /= total);
        let mut acc = 0.0;
        let cdf = pmf
            .iter()
            .map(|p| {
                acc += p;
                acc as f32
            })
            .collect();
        let m = &room.portal;
        let triangles: Vec<[Vec3; 3]> = m.indices.iter().map(|t| t.map(|i| m.positions[i as usize])).collect();
        let area = triangles.iter().map(area).sum();
        Ok(Self { size: vec2(w as f32, h as f32), cdf, pmf: pmf.iter().map(|&p| p as f32).collect(), triangles, area })
    }

    pub(crate) fn sample_environment(&self, [u0, u1]: [f32; 2]) -> Option<Proposal> {
        // two numbers are too few for this stub: the second is reused
        let i = self.cdf.partition_point(|&c| c <= u0).min(self.pmf.len() - 1);
        let w = self.size.x as usize;
        let f = (u1 * 4096.0).fract();
        let p = vec2((i % w) as f32 + (u1 * 4096.0).floor() / 4096.0 + f / 4096.0, (i / w) as f32 + f) / self.size;
        let direction = direction_of(p);
        Some(Proposal { direction, pdf: self.environment_pdf(direction) })
    }

    pub(crate) fn environment_pdf(&self, direction: Vec3) -> f32 {
        let p = latitude_longitude(direction);
        let t = p * self.size;
        let i = (t.y as usize).min(self.size.y as usize - 1) * self.size.x as usize
            + (t.x as usize).min(self.size.x as usize - 1);
        let sin = (1.0 - direction.y * direction.y).max(1e-12).sqrt();
        self.pmf[i] * self.size.x * self.size.y / (2.0 * core::f32::consts::PI.powi(2) * sin)
    }

    pub(crate) fn sample_portals(&self, x: &SurfacePoint, [u0, u1, u2]: [f32; 3]) -> Option<Proposal> {
        let mut left = u0 * self.area;
        let t = self.triangles.iter().find(|t| {
            left -= area(t);
            left < 0.0
        })?;
        let s = u1.sqrt();
        let p = t[0] * (1.0 - s) + t[1] * (s * (1.0 - u2)) + t[2] * (s * u2);
        let d = p - x.position;
        let direction = d.normalize();
        (direction.x < -1e-6).then(|| Proposal { direction, pdf: d.length_squared() / (-direction.x * self.area) })
    }

    pub(crate) fn portal_pdf(&self, x: &SurfacePoint, direction: Vec3) -> f32 {
        if direction.x >= -1e-6 {
            return 0.0;
        }
        let t = x.position.x / -direction.x;
        let p = x.position + t * direction;
        let inside = self.triangles.iter().any(|[a, b, c]| {
            let s = |a: Vec3, b: Vec3| (b - a).cross(p - a).x;
            s(*a, *b) >= 0.0 && s(*b, *c) >= 0.0 && s(*c, *a) >= 0.0
        });
        if inside { t * t / (-direction.x * self.area) } else { 0.0 }
    }
}
