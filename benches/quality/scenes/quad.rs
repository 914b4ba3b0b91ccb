//! A square with a few small bright spots.

use glam::{Vec2, Vec3};

use super::image::Image;
use super::points::PointSet;
use super::{LightMesh, Scene, Weight};

/// Two triangles under a texture of 512² texels.
pub(crate) fn quad() -> Scene {
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let positions = uvs.iter().map(|uv| Vec3::new(uv.x, uv.y, 0.0)).collect();
    let indices = vec![[0, 1, 2], [0, 2, 3]];
    let mesh = LightMesh { positions, uvs, indices, weight: Weight::Image, portal: false };
    Scene::emitters(vec![mesh], Some(Image::spots(512)), PointSet::OverQuad)
}
