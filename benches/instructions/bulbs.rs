//! Fifty bulbs in a closed room, as spheres and as the triangles that a host without spheres has.

use fanlight::{LightSampler, Mesh, ShadingPoint, SphereLight, Weight};
use glam::Vec3;

use super::cases::{CALLS, next_event_to_emitters};
use crate::scenes::pcg::Pcg32;

const RADIUS: f32 = 0.04;

/// A call of a host for bulbs as spheres.
pub(super) fn spheres() {
    next_event(|center, radiance, builder| {
        builder.add_light(SphereLight::new(center, RADIUS, radiance)).expect("the light is sound");
    });
}

/// A call of a host for bulbs of 80 triangles each.
pub(super) fn triangles() {
    let (positions, indices) = icosphere();
    next_event(|center, radiance, builder| {
        let positions: Vec<Vec3> = positions.iter().map(|direction| center + RADIUS * direction).collect();
        let mesh = Mesh::emitter(&positions, &indices).weight(Weight::Constant(radiance));
        builder.add_mesh(&mesh).expect("the mesh is sound");
    });
}

fn next_event(add: impl Fn(Vec3, f32, &mut fanlight::LightSamplerBuilder<'_>)) {
    let mut pcg = Pcg32::new(38, 2);
    let mut builder = LightSampler::builder();
    for _ in 0..50 {
        let [u, v, w] = pcg.uniform3();
        let center = Vec3::new(0.3 + 5.4 * u, 0.3 + 4.4 * v, 2.2 + 0.6 * w);
        add(center, 20.0 * 5.0_f32.powf(pcg.uniform3()[0]), &mut builder);
    }
    let lights = builder.build().expect("the scene is small");
    let mut pcg = Pcg32::new(5, 5);
    let points: Vec<ShadingPoint> = (0..CALLS)
        .map(|i| {
            let [u, v, w] = pcg.uniform3();
            match i % 3 {
                0 => ShadingPoint::surface(Vec3::new(6.0 * u, 5.0 * v, 0.0), Vec3::Z),
                1 => ShadingPoint::surface(Vec3::new(0.0, 5.0 * u, 3.0 * v), Vec3::X),
                _ => ShadingPoint::surface(Vec3::new(6.0 * u, 5.0, 3.0 * w), Vec3::NEG_Y),
            }
        })
        .collect();
    next_event_to_emitters(&lights, &points);
}

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
