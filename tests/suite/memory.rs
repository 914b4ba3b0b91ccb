//! What trees over textures take.

use fanlight::{LightSampler, Mesh, Texture, Weight};
use glam::{Vec2, Vec3};

use crate::common::tier::tier;

const UVS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// Bytes of the trees over textures of a number of windows with the same image.
fn cells(windows: usize, texture: Texture<'_>) -> usize {
    let mut builder = LightSampler::builder();
    let texture = builder.add_texture(texture);
    for i in 0..windows {
        let at = Vec3::new((i % 100) as f32, 0.0, (i / 100) as f32) * 2.0;
        let positions = UVS.map(|uv| at + Vec3::new(uv.x, 0.0, uv.y));
        let mesh = Mesh::portal(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&UVS).weight(Weight::Texture(texture));
        builder.add_mesh(&mesh).expect("the mesh is valid");
    }
    builder.build().expect("the lights are valid").as_view().bytes().texture_trees
}

/// A ring with a hole.
fn ring(size: usize) -> Vec<f32> {
    let center = |i: usize| (i as f32 + 0.5) / size as f32 - 0.5;
    let radius = |i: usize| Vec2::new(center(i % size), center(i / size)).length();
    (0..size * size).map(|i| if (0.2..0.4).contains(&radius(i)) { 1.0 } else { 0.0 }).collect()
}

#[test]
fn ten_thousand_windows_take_what_one_takes() {
    let texels = ring(64);
    let texture = Texture::new(64, 64, &texels).expect("the image is finite");
    let one = cells(1, texture);
    assert!(one > 1000, "{one}");
    assert_eq!(cells(10_000, texture), one);
}

#[test]
fn a_large_image_takes_at_most_two_bytes_a_texel() {
    // A congruential generator is noise enough.
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32
    };
    let texels: Vec<f32> = (0..1024 * 1024).map(|_| noise()).collect();
    let texture = Texture::new(1024, 1024, &texels).expect("the image is finite");
    let bytes = cells(1, texture);
    assert!(bytes <= 2 * texels.len(), "{bytes}");
    assert!(cells(1, Texture::new(1024, 1024, &ring(1024)).expect("the image is finite")) < bytes / 4);
}

/// Where every triangle has coordinates of its own, a small image still has one budget for all of them, and one for the
/// edges of openings of 64 bytes a texel.
#[test]
fn many_triangles_share_what_a_small_image_may_take() {
    let texels = ring(16);
    let texture = Texture::new(16, 16, &texels).expect("the image is finite");
    let mut builder = LightSampler::builder();
    let texture = builder.add_texture(texture);
    for i in 0..1000 {
        let uvs = UVS.map(|uv| uv + i as f32 * 1e-3);
        let positions = UVS.map(|uv| Vec3::new(uv.x, i as f32, uv.y));
        let mesh = Mesh::emitter(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(Weight::Texture(texture));
        builder.add_mesh(&mesh).expect("the mesh is valid");
    }
    let bytes = builder.build().expect("the lights are valid").as_view().bytes().texture_trees;
    let own = 2000 * (2 * 128 + 40);
    assert!(bytes < own + (1 << 18) + 64 * 256 + 4000, "{bytes}");
}

/// However often an image is repeated, a triangle takes no more than one copy of the image may, or one of 2^15 texels,
/// and all together what the edges of one image may.
#[test]
fn tiling_takes_bounded_memory() {
    for &size in tier().tiles {
        let texels = ring(size);
        let tiled = |copies: f32| {
            let texture = Texture::new(size, size, &texels).expect("the image is finite");
            let mut builder = LightSampler::builder();
            let texture = builder.add_texture(texture);
            let uvs = UVS.map(|uv| copies * uv - 0.5 * copies);
            let positions = UVS.map(|uv| Vec3::new(uv.x, 0.0, uv.y));
            let mesh = Mesh::portal(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(Weight::Texture(texture));
            builder.add_mesh(&mesh).expect("the mesh is valid");
            builder.build().expect("the lights are valid").as_view().bytes().texture_trees
        };
        let bytes = [1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, 1e4, 1e5].map(tiled);
        println!("{size}: {bytes:?}");
        let most = (1 << 18) + 2 * (2 * (size * size).max(1 << 15) + 40);
        assert!(bytes.iter().all(|&bytes| bytes <= most), "{bytes:?}");
        assert!(bytes[3] > 10_000, "thirty copies can still be told apart: {bytes:?}");
    }
}
