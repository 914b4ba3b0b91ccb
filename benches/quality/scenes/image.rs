//! Textures, and their lookup in double precision.

use core::f64::consts::PI;

use fanlight::{Filter, Texture, Wrap};
use glam::DVec2;

use super::pcg::Pcg32;

/// A square texture that is clamped at its edges.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    pub(crate) size: usize,
    /// The row at `v = 0` first.
    pub(crate) texels: Vec<f32>,
    pub(crate) filter: Filter,
    /// The value of most texels.
    pub(crate) background: f32,
}

impl Image {
    /// Texels from a function of the texture coordinates of their centers.
    fn from_fn(size: usize, filter: Filter, background: f32, value: impl Fn(DVec2) -> f32) -> Self {
        let center = |i: usize| (i as f64 + 0.5) / size as f64;
        let texels = (0..size * size).map(|k| value(DVec2::new(center(k % size), center(k / size)))).collect();
        Self { size, texels, filter, background }
    }

    /// Eight bright discs. The image is defined top down: what stands at `v` is its value at `1 - v`.
    pub(crate) fn spots(size: usize) -> Self {
        let mut pcg = Pcg32::new(7, 7);
        let centers: [DVec2; 8] = core::array::from_fn(|_| {
            let x = pcg.f();
            DVec2::new(x, pcg.f())
        });
        Self::from_fn(size, Filter::Bilinear, 0.05, |uv| {
            let at = DVec2::new(uv.x, 1.0 - uv.y);
            if centers.iter().any(|center| center.distance(at) < 0.02) { 100.0 } else { 0.05 }
        })
    }

    /// A five-pointed star that is open in a wall that is not.
    pub(crate) fn star(filter: Filter) -> Self {
        Self::from_fn(512, filter, 0.0, |uv| f32::from(u8::from(is_in_star(uv - 0.5))))
    }

    /// `k` x `k` square openings of half their pitch, four texels a pitch.
    pub(crate) fn grid(k: usize) -> Self {
        let is_open = |x: f64| (0.25..0.75).contains(&(x * k as f64).fract());
        Self::from_fn(4 * k, Filter::Nearest, 0.0, |uv| f32::from(u8::from(is_open(uv.x) && is_open(uv.y))))
    }

    /// One smooth wave along each axis.
    pub(crate) fn waves() -> Self {
        let wave = |x: f64| 0.5 + 0.4 * (2.0 * PI * x).sin();
        Self::from_fn(64, Filter::Bilinear, 0.0, |uv| (wave(uv.x) * wave(uv.y)) as f32)
    }

    /// Returns the image as a texture of the crate.
    pub(crate) fn texture(&self) -> Texture<'_> {
        let texture = Texture::new(self.size, self.size, &self.texels).expect("the image is finite");
        texture.filter(self.filter).wrap(Wrap::Clamp, Wrap::Clamp)
    }

    /// A texel, that at the edge beyond it.
    pub(crate) fn fetch(&self, x: i64, y: i64) -> f64 {
        let last = self.size as i64 - 1;
        f64::from(self.texels[y.clamp(0, last) as usize * self.size + x.clamp(0, last) as usize])
    }

    /// The value at texture coordinates.
    pub(crate) fn value(&self, uv: DVec2) -> f64 {
        let at = uv * self.size as f64;
        match self.filter {
            Filter::Nearest => self.fetch(at.x.floor() as i64, at.y.floor() as i64),
            Filter::Bilinear => {
                let low = (at - 0.5).floor();
                let (x, y) = (low.x as i64, low.y as i64);
                let corners = [self.fetch(x, y), self.fetch(x + 1, y), self.fetch(x, y + 1), self.fetch(x + 1, y + 1)];
                bilinear(&corners, at - 0.5 - low)
            }
        }
    }

    /// The mean over a texel.
    pub(crate) fn texel_mean(&self, x: usize, y: usize) -> f64 {
        let (x, y) = (x as i64, y as i64);
        if self.filter == Filter::Nearest {
            return self.fetch(x, y);
        }
        let row = |y| self.fetch(x - 1, y) + 6.0 * self.fetch(x, y) + self.fetch(x + 1, y);
        (row(y - 1) + 6.0 * row(y) + row(y + 1)) / 64.0
    }
}

/// Interpolates between values at (0, 0), (1, 0), (0, 1), (1, 1).
pub(crate) fn bilinear(corners: &[f64; 4], at: DVec2) -> f64 {
    let row = |a: f64, b: f64| a + (b - a) * at.x;
    let (low, high) = (row(corners[0], corners[1]), row(corners[2], corners[3]));
    low + (high - low) * at.y
}

/// A star of radius 0.48 around the origin, a point of it up, the notches at 0.2.
fn is_in_star(at: DVec2) -> bool {
    let corner = |k: u32| {
        let radius = if k.is_multiple_of(2) { 0.48 } else { 0.2 };
        let (sin, cos) = (f64::from(k) * PI / 5.0).sin_cos();
        DVec2::new(radius * sin, radius * cos)
    };
    // Even-odd rule.
    let crosses = |k: &u32| {
        let (a, b) = (corner(*k), corner(*k + 1));
        (a.y > at.y) != (b.y > at.y) && at.x < a.x + (b.x - a.x) * (at.y - a.y) / (b.y - a.y)
    };
    (0..10).filter(crosses).count() % 2 == 1
}
