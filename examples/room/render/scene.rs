//! Casts rays into the room.

use core::ops::Range;

use glam::{Vec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use super::mask::Mask;
use super::room::{Room, TriangleMesh};

/// How far from the walls a ray starts, so that it does not meet the same wall again.
const OFFSET: f32 = 1e-4;

/// A point on a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    /// A hair's breadth in front of the wall, and of any wall that it meets in a corner: rounding puts some points
    /// near a corner on its wrong side, where a single one in the sun outshines the corner.
    pub(crate) position: Vec3,
    /// Unit normal to the side that the ray came from.
    pub(crate) normal: Vec3,
}

/// The room, ready for ray casting.
pub(crate) struct Scene {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
    uvs: Vec<[Vec2; 3]>,
    masked: Range<usize>,
    mask: Option<Mask>,
    /// The corners of what lies between the walls.
    inside: (Vec3, Vec3),
}

impl Scene {
    /// Takes the walls over.
    pub(crate) fn new(room: Room) -> Self {
        let triangles = triangles(&room.walls);
        let uvs = room.walls.indices.iter().map(|corners| corners.map(|i| room.walls.uvs[i as usize])).collect();
        let mut build_time = core::time::Duration::ZERO;
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut build_time);
        let corners = room.walls.positions.iter();
        let inside = (
            corners.clone().fold(Vec3::INFINITY, |low, &corner| low.min(corner)) + OFFSET,
            corners.fold(Vec3::NEG_INFINITY, |high, &corner| high.max(corner)) - OFFSET,
        );
        Self { bvh, triangles, uvs, masked: room.masked, mask: room.mask, inside }
    }

    /// The first wall that a ray from a free point meets. `None` if it leaves through the window.
    pub(crate) fn trace(&self, origin: Vec3, direction: Vec3) -> Option<SurfacePoint> {
        let ray = Ray::new_inf(origin.into(), direction.into());
        let mut hit = RayHit::none();
        let mut triangle = 0;
        self.bvh.ray_traverse(ray, &mut hit, |ray, slot| {
            let candidate = self.bvh.primitive_indices[slot] as usize;
            let distance = self.intersect(ray, candidate);
            if distance < ray.tmax {
                triangle = candidate;
            }
            distance
        });
        hit.t.is_finite().then(|| {
            let normal = Vec3::from(self.triangles[triangle].compute_normal());
            let position = (origin + hit.t * direction).clamp(self.inside.0, self.inside.1);
            SurfacePoint { position, normal: -normal * normal.dot(direction).signum() }
        })
    }

    /// Whether a ray leaves the room, so that the sky is seen along it.
    pub(crate) fn sees_sky(&self, origin: Vec3, direction: Vec3) -> bool {
        let ray = Ray::new_inf(origin.into(), direction.into());
        self.bvh.ray_traverse_miss(ray, |ray, slot| self.intersect(ray, self.bvh.primitive_indices[slot] as usize))
    }

    /// Whether nothing is between two free points.
    pub(crate) fn sees(&self, from: Vec3, to: Vec3) -> bool {
        let ray = Ray::new(from.into(), (to - from).into(), 0.0, 1.0);
        self.bvh.ray_traverse_miss(ray, |ray, slot| self.intersect(ray, self.bvh.primitive_indices[slot] as usize))
    }

    /// Distance to a triangle; infinite where the ray misses it or passes through its mask.
    fn intersect(&self, ray: &Ray, triangle: usize) -> f32 {
        let distance = self.triangles[triangle].intersect(ray);
        match &self.mask {
            Some(mask) if distance < ray.tmax && self.masked.contains(&triangle) => {
                let point = ray.origin + distance * ray.direction;
                if mask.is_open(self.uv_at(triangle, point)) { f32::INFINITY } else { distance }
            }
            _ => distance,
        }
    }

    /// Texture coordinates at a point of a triangle.
    fn uv_at(&self, triangle: usize, point: Vec3A) -> Vec2 {
        let Triangle { v0, v1, v2 } = self.triangles[triangle];
        let area = (v1 - v0).cross(v2 - v0);
        let scale = area.length_squared().recip();
        let b1 = (point - v0).cross(v2 - v0).dot(area) * scale;
        let b2 = (v1 - v0).cross(point - v0).dot(area) * scale;
        let [uv0, uv1, uv2] = self.uvs[triangle];
        uv0 + b1 * (uv1 - uv0) + b2 * (uv2 - uv0)
    }
}

fn triangles(mesh: &TriangleMesh) -> Vec<Triangle> {
    let corner = |i: u32| Vec3A::from(mesh.positions[i as usize]);
    mesh.indices.iter().map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) }).collect()
}
