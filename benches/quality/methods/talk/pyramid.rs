//! The environment's levels under a 3x3 box filter, and their minimum and maximum.

use glam::{Vec2, Vec3};

const DEPTH: u32 = 10;
/// Solid angle of a pixel of the environment.
pub(super) const TEXEL_SOLID_ANGLE: f32 = 4.0 * core::f32::consts::PI / (1 << (2 * DEPTH)) as f32;

/// What a region shows.
pub(super) struct Seen {
    pub(super) value: f32,
    pub(super) is_constant: bool,
}

/// Filtered mean, minimum and maximum of every pixel of every level, the coarsest first.
pub(super) struct Pyramid(Vec<Vec<[f32; 3]>>);

impl Pyramid {
    pub(super) fn new(texels: &[f32]) -> Self {
        assert!(texels.len() == 1 << (2 * DEPTH), "all workloads have an environment of 1024²");
        let mut level: Vec<[f32; 3]> = texels.iter().map(|&v| [v; 3]).collect();
        let mut levels = vec![];
        for depth in (0..=DEPTH).rev() {
            let n = 1 << depth;
            levels.push((0..n * n).map(|i| filtered(&level, n, i % n, i / n)).collect());
            level = (0..n * n / 4).map(|i| reduced(&level, n, i % (n / 2), i / (n / 2))).collect();
        }
        levels.reverse();
        Self(levels)
    }

    /// The nearest pixel of the level whose filter is as large as the solid angle: `Ω = min(4π, 9 · 4π / 4^level)`.
    pub(super) fn look_up(&self, direction: Vec3, solid_angle: f32) -> Seen {
        let depth = (0.5 * (9.0 * 4.0 * core::f32::consts::PI / solid_angle).log2()).round().clamp(0.0, DEPTH as f32);
        let n = 1_usize << depth as u32;
        let at = square(direction) * n as f32;
        let index = |x: f32| (x as usize).min(n - 1);
        let [value, min, max] = self.0[depth as usize][index(at.y) * n + index(at.x)];
        Seen { value, is_constant: min == max }
    }

    pub(super) fn bytes(&self) -> usize {
        self.0.iter().map(|level| size_of_val(&level[..])).sum()
    }
}

/// A pixel with the mean of the 3x3 pixels around it. Beyond an edge the image goes on rotated by half a turn.
fn filtered(level: &[[f32; 3]], n: usize, x: usize, y: usize) -> [f32; 3] {
    let at = |dx: i64, dy: i64| {
        let (x, y, n) = (x as i64 + dx, y as i64 + dy, n as i64);
        let is_turned = (x.div_euclid(n) + y.div_euclid(n)) % 2 != 0;
        let (x, y) = (x.rem_euclid(n), y.rem_euclid(n));
        let (x, y) = if is_turned { (n - 1 - x, n - 1 - y) } else { (x, y) };
        level[(y * n + x) as usize][0]
    };
    let sum: f32 = (0..9).map(|k| at(k % 3 - 1, k / 3 - 1)).sum();
    let [_, min, max] = level[y * n + x];
    [sum / 9.0, min, max]
}

/// Mean, minimum and maximum of the four pixels under one of the next level.
fn reduced(level: &[[f32; 3]], n: usize, x: usize, y: usize) -> [f32; 3] {
    let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| level[(2 * y + dy) * n + 2 * x + dx]);
    four.iter().fold([0.0, f32::INFINITY, 0.0], |[mean, low, high], &[m, min, max]| {
        [mean + 0.25 * m, low.min(min), high.max(max)]
    })
}

/// Clarberg's map with pbrt-v4's polynomial for the angle.
fn square(direction: Vec3) -> Vec2 {
    const POLYNOMIAL: [f32; 7] =
        [4.067_586e-6, 0.636_226_5, 6.157_202e-3, -0.247_333_73, 0.088_177_07, 0.041_903_88, -0.025_139_097];
    let d = direction.abs();
    let r = (1.0 - d.z).max(0.0).sqrt();
    let (low, high) = (d.x.min(d.y), d.x.max(d.y));
    let ratio = if high == 0.0 { 0.0 } else { low / high };
    let phi = POLYNOMIAL.iter().rev().fold(0.0, |sum, c| sum * ratio + c);
    let phi = if d.x < d.y { 1.0 - phi } else { phi };
    let (mut u, mut v) = (r - phi * r, phi * r);
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    0.5 + 0.5 * Vec2::new(u.copysign(direction.x), v.copysign(direction.y))
}
