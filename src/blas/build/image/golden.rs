//! One tree's bits.

use alloc::vec::Vec;
use glam::Vec2;

use super::tests::{LOWER, UPPER};
use super::*;
use crate::testing::Pcg32;

/// The texture coordinates of the quad's two triangles; images have `v` downwards.
fn quad() -> [[Vec2; 3]; 2] {
    [LOWER, UPPER].map(|uv| uv.map(|p| Vec2::new(p.x, 1.0 - p.y)))
}

#[test]
fn golden() {
    let texels = spots(64);
    let mut pyramid = TexturePyramid::new(Texture::new(64, 64, &texels).unwrap().wrap(Wrap::Clamp, Wrap::Clamp));
    let mut pool = Vec::<CellNode>::new();
    let roots = quad().map(|uv| build(&mut pyramid, uv, &mut pool).unwrap());
    // FNV-1a.
    let hash = |bytes: &[u8]| {
        bytes.iter().fold(0xcbf2_9ce4_8422_2325u64, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
    };
    let bytes: &[u8] = bytemuck::cast_slice(&pool);
    assert_eq!(
        (roots, pool.len(), hash(bytes)),
        (
            [Root { average: 0.491_266_88, node: 0 }, Root { average: 1.463_274_1, node: 65 }],
            261,
            10_001_550_631_721_866_294
        )
    );
}

/// Eight bright discs on a dark ground.
fn spots(n: usize) -> Vec<f32> {
    let mut rng = Pcg32::new(7, 7);
    let centers: [[f32; 2]; 8] = core::array::from_fn(|_| [rng.next_f32(), rng.next_f32()]);
    let at = |i: usize| (i as f32 + 0.5) / n as f32;
    (0..n * n)
        .map(|i| {
            let (x, y) = (at(i % n), at(i / n));
            let inside = centers.iter().any(|c| (x - c[0]).powi(2) + (y - c[1]).powi(2) < 0.02 * 0.02);
            if inside { 100.0 } else { 0.05 }
        })
        .collect()
}
