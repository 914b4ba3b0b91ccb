use glam::Vec2;

use super::*;
use crate::blas::barycentric::{Lattice, child, interior_point};
use crate::blas::node::{averages, below, mean};
use crate::blas::validate::{validate, validate_roots};
use crate::record::Filter;
use crate::testing::Pcg32;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
pub(super) const FILTERS: [Filter; 2] = [Filter::Nearest, Filter::Bilinear];
pub(super) const LOWER: [Vec2; 3] = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0)];
pub(super) const UPPER: [Vec2; 3] = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];

/// The averages on a point's way down.
fn path<const M: usize>(root: Root, pool: &[Block<M>], barycentrics: [f32; 2]) -> Vec<f32> {
    let mut values = alloc::vec![root.average];
    let scale = if root.node == LEAF { 0.0 } else { root.average / mean(pool, root.node) };
    let (mut local, mut size) = (Lattice::from_barycentrics(barycentrics).0, LATTICE);
    let mut node = root.node;
    while node != LEAF {
        let (index, next) = child::<M>(local, size);
        values.push(averages(pool, node)[index] * scale);
        node = below(pool, node, index);
        (local, size) = (next, size >> level_halvings::<M>());
    }
    values
}

/// What a host does, in its own precision.
fn host(texture: &Texture<'_>, uv: [Vec2; 3], b: [f32; 2]) -> f32 {
    let p = uv[0] * (1.0 - b[0] - b[1]) + uv[1] * b[0] + uv[2] * b[1];
    texture.value(p.x, p.y)
}

fn random_barycentrics(rng: &mut Pcg32) -> [f32; 2] {
    let [x, y] = [rng.next_f32(), rng.next_f32()];
    let b = if x + y > 1.0 { [1.0 - x, 1.0 - y] } else { [x, y] };
    match rng.below(8) {
        0 => [b[0], 0.0],
        1 => [0.0, b[1]],
        2 => [b[0], 1.0 - b[0]],
        3 => b.map(|b| (b * 64.0) as u32 as f32 / 64.0),
        _ => b,
    }
}

/// Everything that a tree promises. Returns the number of bytes.
fn check<const M: usize>(texture: Texture<'_>, uv: [Vec2; 3], points: u32) -> usize {
    let mut prepared = Prepared::new(texture);
    let mut pool = alloc::vec![bytemuck::Zeroable::zeroed(); 4];
    let root = build::<M>(&mut prepared, uv, &mut pool).unwrap();
    validate(&pool).unwrap();
    validate_roots(&[root], &pool).unwrap();
    let mut rng = Pcg32::new(11, 4);
    for _ in 0..points {
        let b = random_barycentrics(&mut rng);
        if host(&texture, uv, b) > 0.0 {
            let values = path(root, &pool, b);
            assert!(values.iter().all(|&v| v > 0.0), "{values:?} at {b:?} of {uv:?} on {texture:?}");
        }
    }
    size_of_val(&pool[4..])
}

fn random_uv(rng: &mut Pcg32, scale: f32) -> [Vec2; 3] {
    core::array::from_fn(|_| Vec2::new(scale * (2.0 * rng.next_f32() - 1.0), scale * (2.0 * rng.next_f32() - 1.0)))
}

#[test]
fn one_bright_texel_is_never_lost() {
    let mut rng = Pcg32::new(21, 4);
    for round in 0..150 {
        let (w, h) = (1 + rng.below(12) as usize, 1 + rng.below(12) as usize);
        let mut texels = alloc::vec![0.0; w * h];
        texels[rng.below((w * h) as u32) as usize] = [1.0, 1e10, 1e-40, f32::MAX][round % 4];
        let scale = [0.2, 1.0, 10.0][round % 5 % 3];
        let uv = random_uv(&mut rng, scale);
        for filter in FILTERS {
            let texture = Texture::new(w, h, &texels).unwrap().filter(filter);
            let texture = texture.wrap(WRAPS[round % 3], WRAPS[round / 3 % 3]);
            check::<4>(texture, uv, 2000);
            check::<16>(texture, uv, 2000);
            check::<64>(texture, uv, 500);
            check::<4>(texture, [uv[0], uv[1], uv[0].lerp(uv[1], 0.3)], 500);
            check::<16>(texture, [uv[0]; 3], 10);
            // Edges of the triangle on edges of texels, and corners outside.
            let snapped = uv.map(|p| (p * Vec2::new(w as f32, h as f32)).round() / Vec2::new(w as f32, h as f32));
            check::<16>(texture, snapped, 2000);
        }
    }
}

#[test]
fn averages_at_the_root_are_those_of_the_image() {
    let mut rng = Pcg32::new(22, 4);
    let texels: Vec<f32> = (0..64 * 64).map(|_| rng.next_f32()).collect();
    let mean = texels.iter().map(|&t| f64::from(t)).sum::<f64>() / texels.len() as f64;
    for filter in FILTERS {
        let mut prepared = Prepared::new(Texture::new(64, 64, &texels).unwrap().filter(filter));
        let mut pool = Vec::new();
        let lower = build::<4>(&mut prepared, LOWER, &mut pool).unwrap();
        let upper = build::<4>(&mut prepared, UPPER, &mut pool).unwrap();
        // Repeat: the filter loses nothing.
        let found = 0.5 * (f64::from(lower.average) + f64::from(upper.average));
        assert!((found - mean).abs() < 1e-5, "{found} {mean}");
    }
}

#[test]
fn black_stays_black() {
    // The left half. Repeated, the image would be white just left of it, where a host may look by rounding.
    let texels: Vec<f32> = (0..32 * 32).map(|i| if i % 32 < 16 { 0.0 } else { 1.0 }).collect();
    let texture = Texture::new(32, 32, &texels).unwrap().filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp);
    let mut prepared = Prepared::new(texture);
    let mut pool = Vec::new();
    let root = build::<4>(&mut prepared, LOWER, &mut pool).unwrap();
    let mut rng = Pcg32::new(1, 9);
    for _ in 0..10_000 {
        let b = random_barycentrics(&mut rng);
        let u = b[0] + b[1];
        let last = *path(root, &pool, b).last().unwrap();
        if u < 15.0 / 32.0 {
            assert_eq!(last, 0.0);
        } else if u > 17.0 / 32.0 {
            assert_eq!(last, 1.0);
        }
    }
    let black = build::<4>(&mut prepared, LOWER.map(|p| p * 0.49), &mut pool).unwrap();
    assert_eq!(black, Root::constant(0.0));
}

#[test]
fn constant_images_need_no_nodes() {
    let texels = [0.25; 16];
    assert_eq!(check::<4>(Texture::new(4, 4, &texels).unwrap(), LOWER, 10), 0);
    assert_eq!(check::<64>(Texture::new(1, 1, &[7.0]).unwrap(), LOWER.map(|p| p * 1e5), 10), 0);
}

#[test]
fn arities_agree() {
    let mut rng = Pcg32::new(23, 4);
    for filter in FILTERS {
        let texels: Vec<f32> = (0..40 * 24).map(|_| rng.next_f32()).collect();
        let mut prepared = Prepared::new(Texture::new(40, 24, &texels).unwrap().filter(filter));
        let uv = random_uv(&mut rng, 1.0);
        let (mut four, mut sixteen) = (Vec::new(), Vec::new());
        let root4 = build::<4>(&mut prepared, uv, &mut four).unwrap();
        let root16 = build::<16>(&mut prepared, uv, &mut sixteen).unwrap();
        for _ in 0..500 {
            // Strictly inside of all cells, so that both see the same ones.
            let inner = interior_point(LATTICE, [f64::from(rng.next_f32()), f64::from(rng.next_f32())]);
            let b = Lattice(inner).to_barycentrics();
            let (a, c) = (path(root4, &four, b), path(root16, &sixteen, b));
            assert!((a[0] / c[0] - 1.0).abs() < 1e-2);
            for (x, y) in a.iter().step_by(2).zip(&c) {
                // Both are rounded, and so are the means of the roots that they are related to.
                assert!((x / y - 1.0).abs() < 0.2, "{a:?} {c:?}");
            }
        }
    }
}

#[test]
fn extreme_coordinates() {
    let mut rng = Pcg32::new(24, 4);
    let texels: Vec<f32> = (0..64 * 64).map(|i| if i % 37 == 0 { rng.next_f32() } else { 0.0 }).collect();
    for wrap in WRAPS {
        for filter in FILTERS {
            let texture = Texture::new(64, 64, &texels).unwrap().filter(filter).wrap(wrap, wrap);
            for scale in [0.0, 1e-30, 1e-3, 1e2, 1e5] {
                check::<4>(texture, random_uv(&mut rng, scale), 300);
                check::<16>(texture, random_uv(&mut rng, scale).map(|p| Vec2::new(p.x, 0.3)), 300);
                let far = Vec2::new(9e4, -9e4);
                check::<16>(texture, random_uv(&mut rng, scale.min(1.0)).map(|p| p + far), 300);
            }
        }
    }
    for bad in [f32::NAN, f32::INFINITY, 1.1e5] {
        let mut prepared = Prepared::new(Texture::new(64, 64, &texels).unwrap());
        let uv = [Vec2::ZERO, Vec2::new(0.0, bad), Vec2::ONE];
        let error = build::<4>(&mut prepared, uv, &mut Vec::new()).unwrap_err();
        assert!(matches!(error.0, Kind::TextureCoordinate { vertex: 1, .. }), "{error}");
    }
}

#[test]
fn long_images() {
    let mut texels = alloc::vec![0.0; 8192];
    texels[5000] = 1.0;
    for (w, h) in [(1, 8192), (8192, 1)] {
        for filter in FILTERS {
            let texture = Texture::new(w, h, &texels).unwrap().filter(filter);
            check::<4>(texture, LOWER, 100_000);
            check::<16>(texture, UPPER, 100_000);
        }
    }
}

/// A triangle over many copies of an image keeps to its memory.
#[test]
fn memory_of_copies() {
    let mut rng = Pcg32::new(25, 4);
    let texels: Vec<f32> = (0..128 * 128).map(|_| rng.next_f32()).collect();
    let texture = Texture::new(128, 128, &texels).unwrap();
    for bytes in
        [check::<4>(texture, LOWER.map(|p| p * 10.0), 1000), check::<16>(texture, LOWER.map(|p| p * 10.0), 1000)]
    {
        assert!(bytes <= 1 << 18 && bytes > 1 << 17, "{bytes}");
    }
    assert_eq!(check::<4>(texture, LOWER.map(|p| p * 1000.0), 1000), 0);
    // Clamped, most of the plane is constant and what is left can be resolved.
    assert!(check::<4>(texture.wrap(Wrap::Clamp, Wrap::Clamp), LOWER.map(|p| p * 1000.0), 1000) > 0);
}

/// Two bytes a texel, even of noise.
#[test]
fn memory_of_noise() {
    let mut rng = Pcg32::new(26, 4);
    let texels: Vec<f32> = (0..512 * 512).map(|_| rng.next_f32()).collect();
    for filter in FILTERS {
        let texture = Texture::new(512, 512, &texels).unwrap().filter(filter);
        for bytes in [check::<4>(texture, LOWER, 1000), check::<16>(texture, UPPER, 1000)] {
            assert!(bytes <= 512 * 512 && bytes > 512 * 500, "{bytes}");
        }
    }
}

/// A cell on the edge between two large texels is divided until little of it is dark.
#[test]
fn edges_between_large_texels_are_followed() {
    let texels: Vec<f32> = (0..8 * 8).map(|i| if i % 8 < 4 { 0.0 } else { 1.0 }).collect();
    let texture = Texture::new(8, 8, &texels).unwrap().filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp);
    let mut prepared = Prepared::new(texture);
    let mut pool = Vec::new();
    // The edge at 0.5 is none of cells here.
    let root = build::<4>(&mut prepared, LOWER.map(|p| p * 0.7), &mut pool).unwrap();
    let mut rng = Pcg32::new(27, 4);
    let (mut lit, mut dark) = (0.0, 0.0);
    for _ in 0..100_000 {
        let b = random_barycentrics(&mut rng);
        let weight = *path(root, &pool, b).last().unwrap();
        *(if host(&texture, LOWER.map(|p| p * 0.7), b) > 0.0 { &mut lit } else { &mut dark }) += weight;
    }
    assert!(dark < 0.02 * lit, "{dark} {lit}");
}
