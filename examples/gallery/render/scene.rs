//! Casts rays into a model.

use glam::{Vec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use smallvec::SmallVec;

use super::bitmap::Bitmap;
use super::material::Material;
use super::model::Model;

/// How far from surfaces rays start and end, so that they do not meet them again: this share of the scene's diagonal.
const OFFSET: f32 = 1e-5;
/// Length of a ray's direction, as a share of the scene's diagonal. Boxes that end within 1e-4 of it are taken to be
/// behind the ray, and that must be less than the offset.
const STEP: f32 = 1e-2;
/// How far triangles reach beyond their edges, in barycentrics: light must not leak in between two of them.
const OVERLAP: f32 = 2e-6;

/// A point on a solid surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// A hair's breadth in front of the surface.
    pub(crate) position: Vec3,
    /// A hair's breadth behind it.
    pub(crate) behind: Vec3,
    /// Unit normal to the side that the ray came from.
    pub(crate) normal: Vec3,
    /// Whether that is the front.
    pub(crate) front: bool,
    pub(crate) uv: Vec2,
    /// Where the emission's image is read.
    pub(crate) emission_uv: Vec2,
    /// Multiplies the material's color.
    pub(crate) tint: Vec3,
    /// Weights of the triangle's second and third vertex.
    pub(crate) barycentrics: [f32; 2],
    /// Number of the triangle in the order of the model's meshes.
    pub(crate) triangle: usize,
    /// How far the ray went.
    pub(crate) distance: f32,
}

impl Point {
    /// Where a ray starts that leaves in a direction.
    pub(crate) fn start(&self, direction: Vec3) -> Vec3 {
        if self.normal.dot(direction) >= 0.0 { self.position } else { self.behind }
    }

    /// Returns the point as a ray in another direction meets it.
    pub(crate) fn facing(self, direction: Vec3) -> Self {
        if self.normal.dot(direction) <= 0.0 {
            return self;
        }
        let Self { position, behind, normal, front, .. } = self;
        Self { position: behind, behind: position, normal: -normal, front: !front, ..self }
    }
}

/// What a triangle is made of.
#[derive(Clone, Copy)]
struct Surface {
    material: u32,
    /// Whether rays may pass straight through it.
    has_holes: bool,
    /// Its number among those with more than one set of texture coordinates or with colors of their own.
    layers: Option<u32>,
}

/// What few triangles have.
struct Layers {
    emission_uvs: [Vec2; 3],
    colors: [Vec3; 3],
}

/// The surfaces, ready for ray casting.
pub(crate) struct Scene {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
    uvs: Vec<[Vec2; 3]>,
    surfaces: Vec<Surface>,
    layers: Vec<Layers>,
    materials: Vec<Material>,
    bitmaps: Vec<Bitmap>,
    diagonal: f32,
}

impl Scene {
    /// Copies the surfaces of a model.
    pub(crate) fn new(model: &Model) -> Self {
        let (mut triangles, mut uvs, mut surfaces, mut layers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for mesh in &model.meshes {
            let has_layers = !(mesh.emission_uvs.is_empty() && mesh.colors.is_empty());
            let has_holes = model.materials[mesh.material].has_holes();
            for corners in &mesh.indices {
                let [v0, v1, v2] = corners.map(|i| Vec3A::from(mesh.positions[i as usize]));
                triangles.push(Triangle { v0, v1, v2 });
                uvs.push(corners.map(|i| mesh.uvs[i as usize]));
                let number = has_layers.then_some(layers.len() as u32);
                surfaces.push(Surface { material: mesh.material as u32, has_holes, layers: number });
                if has_layers {
                    let emission_uvs = corners.map(|i| mesh.emission_uvs()[i as usize]);
                    let colors = corners.map(|i| mesh.colors.get(i as usize).copied().unwrap_or(Vec3::ONE));
                    layers.push(Layers { emission_uvs, colors });
                }
            }
        }
        let mut build_time = core::time::Duration::ZERO;
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut build_time);
        let (materials, bitmaps) = (model.materials.clone(), model.bitmaps.clone());
        Self { bvh, triangles, uvs, surfaces, layers, materials, bitmaps, diagonal: model.diagonal() }
    }

    /// How far from surfaces rays start and end.
    pub(crate) const fn offset(&self) -> f32 {
        OFFSET * self.diagonal
    }

    /// Images of the materials.
    pub(crate) fn bitmaps(&self) -> &[Bitmap] {
        &self.bitmaps
    }

    /// The material at a point.
    pub(crate) fn material(&self, point: &Point) -> &Material {
        &self.materials[self.surfaces[point.triangle].material as usize]
    }

    /// The first solid surface along a ray, and what passes the clear ones before it.
    pub(crate) fn trace(&self, origin: Vec3, direction: Vec3) -> (Vec3, Option<Point>) {
        let mut hit = RayHit::none();
        let mut found = 0;
        let mut panes = SmallVec::<[(f32, Vec3); 8]>::new();
        self.bvh.ray_traverse(self.ray(origin, direction, f32::INFINITY), &mut hit, |ray, slot| {
            let triangle = self.bvh.primitive_indices[slot] as usize;
            let distance = intersect(&self.triangles[triangle], ray);
            if distance >= ray.tmax {
                return distance;
            }
            match self.passes_at(triangle, ray, distance) {
                Some(share) => {
                    panes.push((distance, share));
                    f32::INFINITY
                }
                None => {
                    found = triangle;
                    distance
                }
            }
        });
        let share = panes.iter().filter(|pane| pane.0 < hit.t).map(|pane| pane.1).product();
        (share, hit.t.is_finite().then(|| self.point(found, origin, direction, STEP * self.diagonal * hit.t)))
    }

    /// A ray whose distances are in steps.
    fn ray(&self, origin: Vec3, direction: Vec3, distance: f32) -> Ray {
        let step = STEP * self.diagonal;
        Ray::new(origin.into(), (step * direction).into(), 0.0, distance / step)
    }

    /// What passes from a point in a direction, up to a distance.
    pub(crate) fn passes(&self, origin: Vec3, direction: Vec3, distance: f32) -> Vec3 {
        let mut share = Vec3::ONE;
        let ray = self.ray(origin, direction, distance);
        let free = self.bvh.ray_traverse_miss(ray, |ray, slot| {
            let triangle = self.bvh.primitive_indices[slot] as usize;
            let distance = intersect(&self.triangles[triangle], ray);
            if distance >= ray.tmax {
                return f32::INFINITY;
            }
            match self.passes_at(triangle, ray, distance) {
                Some(passed) => {
                    share *= passed;
                    f32::INFINITY
                }
                None => distance,
            }
        });
        if free { share } else { Vec3::ZERO }
    }

    /// What passes straight through a triangle where a ray meets it; `None` if it is solid there.
    fn passes_at(&self, triangle: usize, ray: &Ray, distance: f32) -> Option<Vec3> {
        let Surface { material, has_holes: true, .. } = self.surfaces[triangle] else { return None };
        let barycentrics = self.barycentrics(triangle, ray.origin + distance * ray.direction);
        let uv = self.uv(triangle, barycentrics);
        self.materials[material as usize].passes(&self.bitmaps, uv, || self.tint(triangle, barycentrics))
    }

    fn point(&self, triangle: usize, origin: Vec3, direction: Vec3, distance: f32) -> Point {
        let hit = origin + distance * direction;
        let outward = Vec3::from(self.triangles[triangle].compute_normal());
        let front = outward.dot(direction) < 0.0;
        let normal = if front { outward } else { -outward };
        let barycentrics = self.barycentrics(triangle, hit.into());
        // Back along the ray as well: where it comes from is free, even in corners that rounding is blind to.
        let away = self.offset() * (normal - direction);
        let uv = self.uv(triangle, barycentrics);
        Point {
            position: hit + away,
            behind: hit - away,
            normal,
            front,
            uv,
            emission_uv: self.layers(triangle).map_or(uv, |layers| interpolate(layers.emission_uvs, barycentrics)),
            tint: self.tint(triangle, barycentrics),
            barycentrics,
            triangle,
            distance,
        }
    }

    fn barycentrics(&self, triangle: usize, point: Vec3A) -> [f32; 2] {
        let Triangle { v0, v1, v2 } = self.triangles[triangle];
        let area = (v1 - v0).cross(v2 - v0);
        let scale = area.length_squared().recip();
        [(point - v0).cross(v2 - v0), (v1 - v0).cross(point - v0)].map(|part| part.dot(area) * scale)
    }

    fn uv(&self, triangle: usize, barycentrics: [f32; 2]) -> Vec2 {
        interpolate(self.uvs[triangle], barycentrics)
    }

    fn layers(&self, triangle: usize) -> Option<&Layers> {
        self.surfaces[triangle].layers.map(|number| &self.layers[number as usize])
    }

    fn tint(&self, triangle: usize, barycentrics: [f32; 2]) -> Vec3 {
        self.layers(triangle).map_or(Vec3::ONE, |layers| interpolate(layers.colors, barycentrics))
    }
}

fn interpolate<T>([a, b, c]: [T; 3], [b1, b2]: [f32; 2]) -> T
where
    T: Copy + core::ops::Add<Output = T> + core::ops::Sub<Output = T>,
    f32: core::ops::Mul<T, Output = T>,
{
    a + b1 * (b - a) + b2 * (c - a)
}

/// Distance along a ray to a triangle, infinite if there is none (Möller and Trumbore 1997).
#[inline]
fn intersect(triangle: &Triangle, ray: &Ray) -> f32 {
    let (e1, e2) = (triangle.v0 - triangle.v1, triangle.v2 - triangle.v0);
    let normal = e1.cross(e2);
    let c = triangle.v0 - ray.origin;
    let r = ray.direction.cross(c);
    let inverse = 1.0 / normal.dot(ray.direction);
    let (u, v) = (r.dot(e2) * inverse, r.dot(e1) * inverse);
    let distance = normal.dot(c) * inverse;
    let inside = u.min(v).min(1.0 - u - v) >= -OVERLAP;
    if inside && distance > ray.tmin && distance.is_finite() { distance } else { f32::INFINITY }
}
