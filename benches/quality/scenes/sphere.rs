//! A bumpy sphere of 12 m² triangles.

use glam::{DVec3, Vec2, Vec3};

use super::image::Image;
use super::points::PointSet;
use super::{LightMesh, Scene, Weight};

/// The sphere with `m` x `m` quads a face, radiance 1.
pub(crate) fn sphere(m: u32) -> Scene {
    let mesh = mesh(m, Weight::Constant(1.0));
    Scene::emitters(vec![mesh], None, PointSet::AroundSphere)
}

/// The sphere under a texture of bright spots.
pub(crate) fn sphere_with_spots(m: u32, size: usize) -> Scene {
    let mesh = mesh(m, Weight::Image);
    Scene::emitters(vec![mesh], Some(Image::spots(size)), PointSet::AroundSphere)
}

fn mesh(m: u32, weight: Weight) -> LightMesh {
    let mut mesh = LightMesh { positions: vec![], uvs: vec![], indices: vec![], weight, portal: false };
    for face in 0..6 {
        let first = mesh.positions.len() as u32;
        for j in 0..=m {
            for i in 0..=m {
                mesh.positions.push(position(face, i, j, m));
                mesh.uvs.push(uv(face, i, j, m));
            }
        }
        for j in 0..m {
            for i in 0..m {
                let at = |i: u32, j: u32| first + j * (m + 1) + i;
                mesh.indices.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.indices.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

fn position(face: usize, i: u32, j: u32, m: u32) -> Vec3 {
    let axis = face / 2;
    let sign = if face % 2 == 1 { -1.0 } else { 1.0 };
    let along = |i: u32| 2.0 * f64::from(i) / f64::from(m) - 1.0;
    let mut q = DVec3::ZERO;
    q[axis] = sign;
    q[(axis + 1) % 3] = along(i);
    q[(axis + 2) % 3] = along(j) * sign;
    let q = q.normalize();
    let bumps = (9.0 * q.x).sin() + (9.0 * q.y).sin() + (9.0 * q.z).sin();
    (0.5 + 0.4 * (1.0 + 0.1 * bumps / 3.0) * q).as_vec3()
}

fn uv(face: usize, i: u32, j: u32, m: u32) -> Vec2 {
    let place = |tile: usize, i: u32, tiles: f64| (tile as f64 + f64::from(i) / f64::from(m)) / tiles;
    Vec2::new(place(face % 3, i, 3.0) as f32, place(face / 3, j, 2.0) as f32)
}
