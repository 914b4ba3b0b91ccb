//! Textures of emitters.

use glam::{DVec2, Vec2};

use crate::random::Pcg32;

/// A square image of numbers, looked up bilinearly and clamped at its edges.
#[derive(Clone, Debug)]
pub(crate) struct Texture {
    pub(crate) size: usize,
    /// The row at `v = 0` first.
    pub(crate) texels: Vec<f32>,
}

impl Texture {
    /// Returns eight bright discs of 100 on a ground of 0.05, times a scale.
    pub(crate) fn spots(size: usize, scale: f32) -> Self {
        let mut pcg = Pcg32::new(7, 7);
        let centers: [DVec2; 8] = core::array::from_fn(|_| {
            let x = pcg.f();
            DVec2::new(x, pcg.f())
        });
        let at = |i: usize| (i as f64 + 0.5) / size as f64;
        let value = |uv: DVec2| if centers.iter().any(|center| center.distance(uv) < 0.02) { 100.0 } else { 0.05 };
        let texels = (0..size * size).map(|k| scale * value(DVec2::new(at(k % size), at(k / size)))).collect();
        Self { size, texels }
    }

    /// Returns the value at texture coordinates.
    pub(crate) fn value(&self, uv: Vec2) -> f32 {
        let last = self.size - 1;
        let point = uv * self.size as f32 - 0.5;
        let low = point.floor();
        let weight = point - low;
        let index = |x: f32| (x.max(0.0) as usize).min(last);
        let (x0, x1, y0, y1) = (index(low.x), index(low.x + 1.0), index(low.y), index(low.y + 1.0));
        let row = |y: usize| {
            let (a, b) = (self.texels[y * self.size + x0], self.texels[y * self.size + x1]);
            a + weight.x * (b - a)
        };
        let (a, b) = (row(y0), row(y1));
        a + weight.y * (b - a)
    }
}
