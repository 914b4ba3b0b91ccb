//! Many small triangles of all sizes of radiance.

use glam::{DVec3, Vec3};

use super::pcg::Pcg32;
use super::points::PointSet;
use super::{LightMesh, Scene, Weight};

/// `count` random triangles in the unit cube.
pub(crate) fn cloud(count: usize) -> Scene {
    let mut pcg = Pcg32::new(1, 1);
    let s = 0.3 / (count as f64).cbrt();
    let mut triangle = || {
        let center = DVec3::from_array(core::array::from_fn(|_| pcg.f()));
        let positions = (0..3)
            .map(|_| (center + s * DVec3::from_array(core::array::from_fn(|_| 2.0 * pcg.f() - 1.0))).as_vec3())
            .collect();
        let weight = Weight::Constant((6.0 * pcg.f() - 3.0).exp2() as f32);
        LightMesh { positions, uvs: vec![], indices: vec![[0, 1, 2]], weight, portal: false }
    };
    let meshes = (0..count).map(|_| triangle()).collect();
    Scene::emitters(meshes, None, PointSet::Cube)
}

/// Centers of the triangles that [`cloud`] makes, before their corners are drawn, and their radiances.
pub(crate) fn centers_and_radiances(count: usize) -> Vec<(Vec3, f32)> {
    let mut pcg = Pcg32::new(1, 1);
    let mut triangle = || {
        let center = DVec3::from_array(core::array::from_fn(|_| pcg.f())).as_vec3();
        (0..9).for_each(|_| {
            pcg.f();
        });
        (center, (6.0 * pcg.f() - 3.0).exp2() as f32)
    };
    (0..count).map(|_| triangle()).collect()
}
