use glam::Vec2;

use super::*;
use crate::blas::barycentric::{Lattice, child};
use crate::blas::node::{LEAF, averages, below, end, mean};
use crate::blas::validate::{validate, validate_roots};
use crate::error::ErrorKind;
use crate::record::Filter;
use crate::testing::Pcg32;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
pub(super) const FILTERS: [Filter; 2] = [Filter::Nearest, Filter::Bilinear];
pub(super) const LOWER: [Vec2; 3] = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0)];
pub(super) const UPPER: [Vec2; 3] = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];

/// The averages on a point's way down.
fn path(root: Root, pool: &[CellNode], barycentrics: [f32; 2]) -> Vec<f32> {
    let mut values = alloc::vec![root.average];
    let scale = if root.node == LEAF { 0.0 } else { root.average / mean(pool, root.node) };
    let (mut local, mut size) = (Lattice::from_barycentrics(barycentrics).0, LATTICE);
    let mut node = root.node;
    while node != LEAF {
        let (index, next) = child(local, size);
        values.push(averages(pool, node)[index] * scale);
        node = below(pool, node, index);
        (local, size) = (next, size >> LEVEL_HALVINGS);
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
fn check(texture: Texture<'_>, uv: [Vec2; 3], points: u32) -> usize {
    let mut pyramid = TexturePyramid::new(texture);
    let mut pool = alloc::vec![bytemuck::Zeroable::zeroed(); 4];
    let root = build(&mut pyramid, uv, &mut pool).unwrap();
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
            check(texture, uv, 2000);
            check(texture, [uv[0], uv[1], uv[0].lerp(uv[1], 0.3)], 500);
            check(texture, [uv[0]; 3], 10);
            // Edges of the triangle on edges of texels, and corners outside.
            let snapped = uv.map(|p| (p * Vec2::new(w as f32, h as f32)).round() / Vec2::new(w as f32, h as f32));
            check(texture, snapped, 2000);
        }
    }
}

#[test]
fn averages_at_the_root_are_those_of_the_image() {
    let mut rng = Pcg32::new(22, 4);
    let texels: Vec<f32> = (0..64 * 64).map(|_| rng.next_f32()).collect();
    let mean = texels.iter().map(|&t| f64::from(t)).sum::<f64>() / texels.len() as f64;
    for filter in FILTERS {
        let mut pyramid = TexturePyramid::new(Texture::new(64, 64, &texels).unwrap().filter(filter));
        let mut pool = Vec::new();
        let lower = build(&mut pyramid, LOWER, &mut pool).unwrap();
        let upper = build(&mut pyramid, UPPER, &mut pool).unwrap();
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
    let mut pyramid = TexturePyramid::new(texture);
    let mut pool = Vec::new();
    let root = build(&mut pyramid, LOWER, &mut pool).unwrap();
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
    let black = build(&mut pyramid, LOWER.map(|p| p * 0.49), &mut pool).unwrap();
    assert_eq!(black, Root::constant(0.0));
}

#[test]
fn constant_images_need_no_nodes() {
    let texels = [0.25; 16];
    assert_eq!(check(Texture::new(4, 4, &texels).unwrap(), LOWER, 10), 0);
    assert_eq!(check(Texture::new(1, 1, &[7.0]).unwrap(), LOWER.map(|p| p * 1e5), 10), 0);
}

/// The average of a divided cell is the mean of the node below it.
#[test]
fn levels_agree() {
    let mut rng = Pcg32::new(23, 4);
    for filter in FILTERS {
        let texels: Vec<f32> = (0..40 * 24).map(|_| rng.next_f32()).collect();
        let mut pyramid = TexturePyramid::new(Texture::new(40, 24, &texels).unwrap().filter(filter));
        let mut pool = Vec::new();
        build(&mut pyramid, random_uv(&mut rng, 1.0), &mut pool).unwrap();
        let mut divided = 0;
        for node in 0..end(&pool, 0) as u32 {
            for (cell, average) in averages(&pool, node).into_iter().enumerate() {
                let below = below(&pool, node, cell);
                if below != LEAF {
                    divided += 1;
                    // Both are rounded.
                    assert!((mean(&pool, below) / average - 1.0).abs() < 0.13);
                }
            }
        }
        assert!(divided > 100, "{divided}");
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
                check(texture, random_uv(&mut rng, scale), 300);
                check(texture, random_uv(&mut rng, scale).map(|p| Vec2::new(p.x, 0.3)), 300);
                let far = Vec2::new(9e4, -9e4);
                check(texture, random_uv(&mut rng, scale.min(1.0)).map(|p| p + far), 300);
            }
        }
    }
    for bad in [f32::NAN, f32::INFINITY, 1.1e5] {
        let mut pyramid = TexturePyramid::new(Texture::new(64, 64, &texels).unwrap());
        let uv = [Vec2::ZERO, Vec2::new(0.0, bad), Vec2::ONE];
        let error = build(&mut pyramid, uv, &mut Vec::new()).unwrap_err();
        assert!(matches!(error.0, ErrorKind::TextureCoordinate { vertex: 1, .. }), "{error}");
    }
}

#[test]
fn long_images() {
    let mut texels = alloc::vec![0.0; 8192];
    texels[5000] = 1.0;
    for (w, h) in [(1, 8192), (8192, 1)] {
        for filter in FILTERS {
            let texture = Texture::new(w, h, &texels).unwrap().filter(filter);
            check(texture, LOWER, 100_000);
            check(texture, UPPER, 100_000);
        }
    }
}

/// A triangle over many copies of an image keeps to its memory.
#[test]
fn memory_of_copies() {
    let mut rng = Pcg32::new(25, 4);
    let texels: Vec<f32> = (0..128 * 128).map(|_| rng.next_f32()).collect();
    let texture = Texture::new(128, 128, &texels).unwrap();
    let bytes = check(texture, LOWER.map(|p| p * 10.0), 1000);
    assert!(bytes <= 1 << 18 && bytes > 1 << 17, "{bytes}");
    assert_eq!(check(texture, LOWER.map(|p| p * 1000.0), 1000), 0);
    // Clamped, most of the plane is constant and what is left can be resolved.
    assert!(check(texture.wrap(Wrap::Clamp, Wrap::Clamp), LOWER.map(|p| p * 1000.0), 1000) > 0);
}

/// Two bytes a texel, even of noise.
#[test]
fn memory_of_noise() {
    let mut rng = Pcg32::new(26, 4);
    let texels: Vec<f32> = (0..512 * 512).map(|_| rng.next_f32()).collect();
    for filter in FILTERS {
        let texture = Texture::new(512, 512, &texels).unwrap().filter(filter);
        for bytes in [check(texture, LOWER, 1000), check(texture, UPPER, 1000)] {
            assert!(bytes <= 512 * 512 && bytes > 512 * 500, "{bytes}");
        }
    }
}

/// A cell on the edge between two large texels is divided until little of it is dark.
#[test]
fn edges_between_large_texels_are_followed() {
    let texels: Vec<f32> = (0..8 * 8).map(|i| if i % 8 < 4 { 0.0 } else { 1.0 }).collect();
    let texture = Texture::new(8, 8, &texels).unwrap().filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp);
    let mut pyramid = TexturePyramid::new(texture);
    let mut pool = Vec::new();
    // The edge at 0.5 is none of cells here.
    let root = build(&mut pyramid, LOWER.map(|p| p * 0.7), &mut pool).unwrap();
    let mut rng = Pcg32::new(27, 4);
    let (mut lit, mut dark) = (0.0, 0.0);
    for _ in 0..100_000 {
        let b = random_barycentrics(&mut rng);
        let weight = *path(root, &pool, b).last().unwrap();
        *(if host(&texture, LOWER.map(|p| p * 0.7), b) > 0.0 { &mut lit } else { &mut dark }) += weight;
    }
    assert!(dark < 0.02 * lit, "{dark} {lit}");
}

/// Between openings of two texels few samples are lost, whatever the size of the image, and its memory is bounded.
#[test]
fn openings_of_a_fine_grid_are_found() {
    for size in [200_usize, 300, 400] {
        let is_open = |i: usize| (1..3).contains(&(i % 4));
        let texels: Vec<f32> =
            (0..size * size).map(|i| f32::from(u8::from(is_open(i % size) && is_open(i / size)))).collect();
        let texture = Texture::new(size, size, &texels).unwrap().filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp);
        let mut pyramid = TexturePyramid::new(texture);
        let mut pool = Vec::new();
        let root = build(&mut pyramid, LOWER, &mut pool).unwrap();
        let bytes = pool.len() * size_of::<CellNode>();
        // Half of what the image may take for edges, four bytes for each texel that is covered, and what images of few
        // texels have.
        assert!(bytes <= (32 + 2) * size * size + (1 << 18), "{size}: {bytes}");
        let mut rng = Pcg32::new(28, 4);
        let (mut lit, mut dark) = (0.0, 0.0);
        for _ in 0..50_000 {
            let b = random_barycentrics(&mut rng);
            let weight = *path(root, &pool, b).last().unwrap();
            *(if host(&texture, LOWER, b) > 0.0 { &mut lit } else { &mut dark }) += weight;
        }
        // A quarter would be lost with two bytes a texel.
        assert!(dark < 0.16 * (lit + dark), "{size}: {dark} {lit}");
    }
}

/// Where cells end where texels do, nothing is lost, and no memory is taken for what rounding shows.
#[test]
fn openings_of_an_aligned_grid_take_no_more() {
    let is_open = |i: usize| (1..3).contains(&(i % 4));
    let texels: Vec<f32> = (0..512 * 512).map(|i| f32::from(u8::from(is_open(i % 512) && is_open(i / 512)))).collect();
    let texture = Texture::new(512, 512, &texels).unwrap().filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp);
    let mut pool = Vec::new();
    build(&mut TexturePyramid::new(texture), LOWER, &mut pool).unwrap();
    let bytes = pool.len() * size_of::<CellNode>();
    assert!(bytes <= 2 * 512 * 512, "{bytes}");
}

/// Trees that are grown side by side are those of one after the other, also where the image's memory runs out.
#[test]
fn order_decides_who_gets_what_is_left() {
    // Without black and with it: where there is black, triangles share what is for edges as well.
    for black in [0.0, 0.7] {
        check_order(black);
    }
}

fn check_order(black: f32) {
    let mut rng = Pcg32::new(8, 8);
    let texel = |value: f32| if value < black { 0.0 } else { value };
    let texels: Vec<f32> = (0..256).map(|_| texel(rng.next_f32())).collect();
    let image = Texture::new(16, 16, &texels).unwrap().filter(Filter::Nearest);
    let trees: Vec<ImageTree<'_>> =
        (0..300).map(|_| ImageTree { image, texture: 3, uv: random_uv(&mut rng, 0.7) }).collect();
    let mut together = Vec::new();
    let roots = build_images(&trees, &mut together, &Progress::new(None, 1.0)).unwrap();
    let mut images = ImageGroup { numbers: alloc::vec![3], pyramids: alloc::vec![TexturePyramid::new(image)] };
    let (mut alone, mut expected, mut rest) = (Vec::new(), Vec::new(), &trees[..]);
    while !rest.is_empty() {
        let (batch, others) = rest.split_at(images.batch(rest));
        for tree in batch {
            images.build(core::slice::from_ref(tree), &mut alone, &Progress::new(None, 1.0), &mut expected).unwrap();
        }
        images.end_batch();
        rest = others;
    }
    assert_eq!(roots, expected);
    assert_eq!(images.pyramids[0].memory.extra, 0.0);
    // Less than a node is left of what is for edges, or all of it.
    let rescue = images.pyramids[0].memory.rescue;
    assert!(if black > 0.0 { rescue < size_of::<CellNode>() as f64 } else { rescue == 64.0 * 256.0 }, "{rescue}");
    assert!(together == alone);
}
