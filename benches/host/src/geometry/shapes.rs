//! Spheres of triangles.

use core::f32::consts::{PI, TAU};
use std::collections::BTreeMap;

use glam::{Vec3, vec3};

use super::mesh::Mesh;

/// Returns an icosahedron, each of whose triangles is divided into four: 80 triangles, all vertices on the sphere.
pub(crate) fn icosphere(center: Vec3, radius: f32) -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut points: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        points.extend([vec3(0.0, a, b), vec3(a, b, 0.0), vec3(b, 0.0, a)]);
    }
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let corners = [a, b, c].map(|i| points[i]);
                let is_edge = |i: usize| corners[i].distance_squared(corners[(i + 1) % 3]) < 4.1;
                if (0..3).all(is_edge) {
                    let outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(corners[0]) > 0.0;
                    faces.push((if outward { [a, b, c] } else { [a, c, b] }).map(|i| i as u32));
                }
            }
        }
    }
    let mut middles = BTreeMap::new();
    let mut middle = |i: u32, j: u32| {
        *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
            points.push(points[i as usize] + points[j as usize]);
            points.len() as u32 - 1
        })
    };
    let mut indices = Vec::new();
    for [a, b, c] in faces {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        indices.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let positions = points.iter().map(|point| center + radius * point.normalize()).collect();
    Mesh { positions, indices, uvs: Vec::new() }
}

/// Returns a sphere of quadrilaterals with poles on z, each of two triangles, facing outward; triangles without an area
/// at the poles are left out.
pub(crate) fn sphere(center: Vec3, radius: f32, longitudes: u32, latitudes: u32) -> Mesh {
    let point = |i: u32, j: u32| {
        let (sin_phi, cos_phi) = (TAU * (i % longitudes) as f32 / longitudes as f32).sin_cos();
        let (sin_theta, cos_theta) = (PI * j as f32 / latitudes as f32).sin_cos();
        center + radius * vec3(cos_phi * sin_theta, sin_phi * sin_theta, cos_theta)
    };
    let mut mesh = Mesh::default();
    mesh.positions.extend((0..=latitudes).flat_map(|j| (0..longitudes).map(move |i| point(i, j))));
    let number = |i: u32, j: u32| j * longitudes + i % longitudes;
    for j in 0..latitudes {
        for i in 0..longitudes {
            let [a, b, c, d] = [number(i, j), number(i, j + 1), number(i + 1, j + 1), number(i + 1, j)];
            if j + 1 < latitudes {
                mesh.indices.push([a, b, c]);
            }
            if j > 0 {
                mesh.indices.push([a, c, d]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{icosphere, sphere};
    use crate::geometry::Mesh;

    /// All triangles face outward and close the sphere: together they have no area, and nearly the sphere's volume.
    fn check(mesh: &Mesh, center: Vec3, share: f32) {
        let areas = || mesh.triangles().map(|[a, b, c]| ((b - a).cross(c - a) * 0.5, (a + b + c) / 3.0 - center));
        assert!(areas().map(|(area, _)| area).sum::<Vec3>().length() < 1e-4);
        assert!(areas().all(|(area, middle)| area.dot(middle) > 0.0));
        let volume: f32 = areas().map(|(area, middle)| area.dot(middle) / 3.0).sum();
        assert!(volume > share * 4.0 / 3.0 * core::f32::consts::PI * 8.0);
    }

    #[test]
    fn spheres_are_closed_and_face_outward() {
        let center = Vec3::new(1.0, -2.0, 3.0);
        let bulb = icosphere(center, 2.0);
        assert_eq!(bulb.indices.len(), 80);
        check(&bulb, center, 0.85);
        let dome = sphere(center, 2.0, 16, 8);
        assert_eq!(dome.indices.len(), 224);
        check(&dome, center, 0.9);
        assert_eq!(sphere(center, 2.0, 6, 6).indices.len(), 60);
    }
}
