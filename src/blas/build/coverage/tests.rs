use alloc::vec::Vec;
use glam::Vec2;

use super::*;
use crate::blas::barycentric::LatticeCell;
use crate::blas::build::footprint::UvTriangle;
use crate::blas::build::texture::Texture;
use crate::blas::build::touched::{range, window};
use crate::record::Wrap;
use crate::testing::Pcg32;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

fn average_of(pyramid: &TexturePyramid<'_>, uv: [Vec2; 3]) -> (f64, TexelRange) {
    let footprint = UvTriangle::new(pyramid.texture(), uv).footprint(LatticeCell::whole());
    let window = window(pyramid, &footprint);
    let range = range(pyramid, &footprint, window.as_ref());
    (f64::from(average(pyramid, &footprint, range, window.as_ref())), range)
}

/// Lookups at the centers of `n²` cells: mean, least and greatest.
fn brute_force(texture: &Texture<'_>, uv: [Vec2; 3], n: u32) -> (f64, f64, f64) {
    let [w, h] = texture.size().map(f64::from);
    let [a, b, c] = uv.map(|p| [f64::from(p.x) * w, f64::from(p.y) * h]);
    let (mut sum, mut min, mut max) = (0.0, f64::INFINITY, 0.0f64);
    for i in 0..n {
        for j in 0..n - i {
            for third in 1..=2 {
                if third == 2 && i + j == n - 1 {
                    continue;
                }
                let b1 = (f64::from(i) + f64::from(third) / 3.0) / f64::from(n);
                let b2 = (f64::from(j) + f64::from(third) / 3.0) / f64::from(n);
                let at = |k: usize| a[k] + b1 * (b[k] - a[k]) + b2 * (c[k] - a[k]);
                let value = texture.value_at(at(0), at(1));
                sum += value;
                (min, max) = (min.min(value), max.max(value));
            }
        }
    }
    (sum / f64::from(n * n), min, max)
}

fn random_uv(rng: &mut Pcg32, scale: f32) -> [Vec2; 3] {
    core::array::from_fn(|_| Vec2::new(scale * (2.0 * rng.next_f32() - 1.0), scale * (2.0 * rng.next_f32() - 1.0)))
}

fn compare(texture: Texture<'_>, uv: [Vec2; 3], tolerance: f64) {
    let pyramid = TexturePyramid::new(texture);
    let (found, range) = average_of(&pyramid, uv);
    let (mean, min, max) = brute_force(&texture, uv, 160);
    let spread = f64::from(range.max - range.min);
    assert!((found - mean).abs() <= tolerance * spread + 1e-6 * mean, "{found} is not {mean}: {uv:?} {texture:?}");
    assert!(
        f64::from(range.min) <= min * (1.0 + 1e-9) && max <= f64::from(range.max) * (1.0 + 1e-9),
        "{texture:?} {uv:?}"
    );
}

#[test]
fn averages_are_those_of_many_lookups() {
    let mut rng = Pcg32::new(5, 5);
    for round in 0..300 {
        let (w, h) = (1 + rng.below(9) as usize, 1 + rng.below(9) as usize);
        let image: Vec<f32> = (0..w * h).map(|_| rng.next_f32() * rng.next_f32()).collect();
        let (u, v) = (WRAPS[round % 3], WRAPS[round / 3 % 3]);
        let scale = [0.3, 0.6, 1.7][round % 7 % 3];
        let uv = random_uv(&mut rng, scale);
        let texture = Texture::new(w, h, &image).unwrap().wrap(u, v);
        // Beyond, lookups in blocks stand in for texels; of images as small as these, they are few.
        if texels(&UvTriangle::new(&texture, uv).footprint(LatticeCell::whole())) <= EXACT_TEXELS {
            compare(texture, uv, 2e-3);
            compare(texture.filter(Filter::Nearest), uv, 2e-2);
        }
        // A line and a point.
        compare(texture, [uv[0], uv[1], uv[0].midpoint(uv[1])], 5e-2);
        compare(texture, [uv[0]; 3], 1e-6);
    }
}

#[test]
fn a_small_cell_is_integrated_to_rounding() {
    // Between the four texel centers the image is x + y, so that its mean over the lower half is 2/3.
    let texels = [0.0, 1.0, 1.0, 2.0];
    let pyramid = TexturePyramid::new(Texture::new(2, 2, &texels).unwrap().wrap(Wrap::Clamp, Wrap::Clamp));
    let uv = [Vec2::new(0.25, 0.25), Vec2::new(0.75, 0.25), Vec2::new(0.25, 0.75)];
    assert!((average_of(&pyramid, uv).0 - 2.0 / 3.0).abs() < 1e-7);
    // Nearest: a quarter of a texel holds 0, two eighths hold 1.
    let pyramid = TexturePyramid::new(pyramid.texture().filter(Filter::Nearest));
    assert!((average_of(&pyramid, uv).0 - 0.5).abs() < 1e-7);
}

/// Larger footprints go through the pyramid.
#[test]
fn large_footprints_are_close() {
    let mut rng = Pcg32::new(6, 5);
    let (w, h) = (100, 70);
    let texels: Vec<f32> = (0..w * h).map(|i| (i % w) as f32 * 0.01 + rng.next_f32()).collect();
    for round in 0..60 {
        let uv = random_uv(&mut rng, [1.0, 3.0, 40.0][round % 3]);
        let texture = Texture::new(w, h, &texels).unwrap().wrap(WRAPS[round % 2], WRAPS[round / 2 % 2]);
        compare(texture, uv, 6e-2);
        compare(texture.filter(Filter::Nearest), uv, 6e-2);
    }
}

#[test]
fn a_bright_texel_far_away_costs_no_precision() {
    let mut texels = [1e-3f32; 64 * 64];
    texels[63] = f32::MAX;
    for at in [16.0, 32.0] {
        let pyramid = TexturePyramid::new(Texture::new(64, 64, &texels).unwrap().wrap(Wrap::Clamp, Wrap::Clamp));
        let uv = [Vec2::new(0.0, 0.9), Vec2::new(at / 64.0, 0.9), Vec2::new(0.0, 0.2)];
        assert!((average_of(&pyramid, uv).0 - 1e-3).abs() < 1e-9);
    }
}
