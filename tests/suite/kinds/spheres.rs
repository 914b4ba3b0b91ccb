//! Spheres against the triangles that a host without spheres has.

use crate::common::pcg::Pcg32;
use crate::common::statistics::Mean;
use fanlight::{LightSample, LightSampler, Mesh, SampledLight, ShadingPoint, SphereLight, Weight};
use glam::Vec3;

/// An icosahedron divided once: unit vectors, and triangles that face outward.
fn icosphere() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let corners: Vec<Vec3> = (0..12)
        .map(|i| {
            let [one, two] = [[1.0, golden], [1.0, -golden], [-1.0, golden], [-1.0, -golden]][i % 4];
            [Vec3::new(0.0, one, two), Vec3::new(one, two, 0.0), Vec3::new(two, 0.0, one)][i / 4]
        })
        .collect();
    let are_neighbors = |i: usize, j: usize| (corners[i].distance(corners[j]) - 2.0).abs() < 1e-3;
    let (mut positions, mut indices) = (vec![], vec![]);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if !(are_neighbors(i, j) && are_neighbors(j, k) && are_neighbors(i, k)) {
                    continue;
                }
                let [a, mut b, mut c] = [i, j, k].map(|corner| corners[corner]);
                if (b - a).cross(c - a).dot(a) < 0.0 {
                    (b, c) = (c, b);
                }
                let first = positions.len() as u32;
                positions.extend([a, b, c, a + b, b + c, c + a].map(Vec3::normalize));
                indices.extend([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]].map(|face| face.map(|at| first + at)));
            }
        }
    }
    (positions, indices)
}

/// Fifty small spheres over a floor, as such and as 80 triangles each: at most half the variance, of the same mean.
#[test]
fn spheres_are_less_noisy_than_their_triangles() {
    let (directions, indices) = icosphere();
    let mut pcg = Pcg32::new(38, 148);
    let (mut spheres, mut meshes, mut radiances) = (LightSampler::builder(), LightSampler::builder(), vec![]);
    for _ in 0..50 {
        let center = Vec3::new(pcg.within(0.3, 5.7), pcg.within(0.3, 4.7), pcg.within(2.2, 2.8));
        let radiance = 20.0 * 5.0_f32.powf(pcg.f32());
        radiances.push(radiance);
        spheres.add_light(SphereLight::new(center, 0.04, radiance)).expect("a valid light");
        let positions: Vec<Vec3> = directions.iter().map(|direction| center + 0.04 * direction).collect();
        let mesh = Mesh::emitter(&positions, &indices).weight(Weight::Constant(radiance));
        meshes.add_mesh(&mesh).expect("a valid mesh");
    }
    let lights = [spheres, meshes].map(|builder| builder.build().expect("few lights"));
    let radiance_of = |sample: &LightSample| match sample.light {
        SampledLight::Shape(id) => radiances[id.index() as usize],
        SampledLight::Triangle(hit) => radiances[hit.triangle.mesh.index() as usize],
        _ => panic!("another kind of light"),
    };
    let mut ratio = Mean::default();
    for _ in 0..40 {
        let x = ShadingPoint::surface(Vec3::new(pcg.within(0.0, 6.0), pcg.within(0.0, 5.0), 0.0), Vec3::Z);
        let [(sphere, a), (mesh, b)] = lights.each_ref().map(|lights| {
            let (at, mut mean) = (lights.at(&x), Mean::default());
            for _ in 0..3000 {
                mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| {
                    f64::from(radiance_of(&sample)) * f64::from(sample.direction.z) / f64::from(sample.pdf)
                }));
            }
            (mean.error() / mean.mean(), mean.mean())
        });
        // The triangles are inside the sphere, and send 3 to 10 % less.
        let limit = 0.1 * a + 5.0 * (sphere * a).hypot(mesh * b);
        assert!((a - b).abs() < limit, "{a} from spheres, {b} from triangles at {x:?}");
        ratio.add(2.0 * (mesh / sphere).ln());
    }
    let ratio = ratio.mean().exp();
    assert!(ratio > 2.0, "the variance of triangles is {ratio} times as high alone");
}
