//! Casts rays into a scene.

use core::time::Duration;

use glam::{Vec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use crate::bsdf::{Material, Vertex};
use crate::scene::{Radiance, Scene};

/// How far in front of its surface a path's vertex lies, in meters: with less, rays meet the surface that they start
/// from; with more, contact shadows are lost. *Measured*: the references agree.
const OFFSET: f32 = 1e-4;

/// By how much triangles are larger than they are, in barycentrics, so that rays do not slip through between two: ten
/// times the rounding of a coordinate. *Measured*: no ray leaves the closed rooms.
const SEAM: f32 = 1e-6;

/// Share of the way to a light's point that must be free; the rest is the light's own. *Measured*: with more, bulbs
/// shadow themselves.
const SHADOW: f32 = 1.0 - 1e-4;

/// What a triangle is part of.
#[derive(Clone, Copy, Debug)]
enum Surface {
    Solid(Material),
    /// Number of the emitter's triangle.
    Emitter(u32),
}

/// A triangle, ready for rays.
#[derive(Clone, Copy, Debug)]
struct Facet {
    corner: Vec3A,
    /// From the second corner to the first.
    back: Vec3A,
    /// From the first corner to the third.
    side: Vec3A,
    /// The cross product of the two.
    cross: Vec3A,
}

/// A triangle that emits light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterTriangle {
    /// Number of the emitter.
    pub(crate) mesh: u32,
    /// Number of the triangle in its mesh.
    pub(crate) triangle: u32,
    pub(crate) corners: [Vec3; 3],
    uvs: [Vec2; 3],
    /// Unit normal of the front, which light leaves from.
    pub(crate) normal: Vec3,
    pub(crate) area: f32,
}

/// A point of an emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterPoint {
    /// Number of the triangle among all of the scene's emitters.
    pub(crate) triangle: u32,
    /// Weights of the second and third corner.
    pub(crate) barycentrics: [f32; 2],
    pub(crate) position: Vec3,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Meeting {
    /// A surface that reflects light.
    Surface(Vertex),
    /// An emitter, from either side.
    Emitter(EmitterPoint),
    /// Nothing.
    Sky,
}

/// A scene, ready for ray casting.
pub(crate) struct World {
    pub(crate) scene: Scene,
    /// All triangles of all emitters, in their order.
    pub(crate) emitters: Vec<EmitterTriangle>,
    bvh: CwBvh,
    /// In the order of the tree's leaves.
    facets: Vec<Facet>,
    surfaces: Vec<Surface>,
    /// Corners of the box that vertices of paths are kept in.
    inside: [Vec3; 2],
    fingerprint: u64,
}

impl World {
    /// Builds the tree over a scene's triangles.
    pub(crate) fn new(scene: Scene) -> Self {
        let mut triangles: Vec<[Vec3; 3]> = Vec::new();
        let mut surfaces: Vec<Surface> = Vec::new();
        for (mesh, material) in &scene.solids {
            triangles.extend(mesh.triangles());
            surfaces.resize(triangles.len(), Surface::Solid(*material));
        }
        let emitters = emitter_triangles(&scene);
        triangles.extend(emitters.iter().map(|emitter| emitter.corners));
        surfaces.extend((0..emitters.len() as u32).map(Surface::Emitter));

        let corners: Vec<Triangle> =
            triangles.iter().map(|t| t.map(Vec3A::from)).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
        let mut build_time = Duration::ZERO;
        let bvh = build_cwbvh_from_tris(&corners, BvhBuildParams::medium_build(), &mut build_time);
        let slots = bvh.primitive_indices.iter().map(|&i| i as usize);
        let facets = slots.clone().map(|i| Facet::new(&corners[i])).collect();
        let inside = scene.inside.unwrap_or([Vec3::NEG_INFINITY, Vec3::INFINITY]);
        Self {
            fingerprint: fingerprint(&scene, &triangles),
            emitters,
            facets,
            surfaces: slots.map(|i| surfaces[i]).collect(),
            bvh,
            inside: [inside[0] + OFFSET, inside[1] - OFFSET],
            scene,
        }
    }

    /// Number of triangles.
    pub(crate) fn triangle_count(&self) -> usize {
        self.facets.len()
    }

    /// A number that changes with the scene.
    pub(crate) const fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Returns what a ray meets first.
    #[inline]
    pub(crate) fn trace(&self, origin: Vec3, direction: Vec3) -> Meeting {
        let mut hit = RayHit::none();
        let mut barycentrics = [0.0; 2];
        self.bvh.ray_traverse(Ray::new_inf(origin.into(), direction.into()), &mut hit, |ray, slot| {
            self.facets[slot].intersect(ray).map_or(f32::INFINITY, |(distance, at)| {
                if distance < ray.tmax {
                    barycentrics = at;
                }
                distance
            })
        });
        if !hit.t.is_finite() {
            return Meeting::Sky;
        }
        let position = origin + hit.t * direction;
        match self.surfaces[hit.primitive_id as usize] {
            Surface::Emitter(triangle) => {
                let [b1, b2] = barycentrics.map(|b| b.clamp(0.0, 1.0));
                Meeting::Emitter(EmitterPoint { triangle, barycentrics: [b1, b2.min(1.0 - b1)], position })
            }
            Surface::Solid(material) => {
                let normal = Vec3::from(self.facets[hit.primitive_id as usize].cross).normalize();
                let normal = if normal.dot(direction) < 0.0 { normal } else { -normal };
                let position = (position + OFFSET * normal).clamp(self.inside[0], self.inside[1]);
                Meeting::Surface(Vertex { position, normal, outgoing: -direction, material, depth: 0 })
            }
        }
    }

    /// Whether nothing lies along a ray, so that the sky is seen.
    #[inline]
    pub(crate) fn sees_sky(&self, origin: Vec3, direction: Vec3) -> bool {
        self.is_free(Ray::new_inf(origin.into(), direction.into()))
    }

    /// Whether nothing is between a point and an emitter's.
    #[inline]
    pub(crate) fn sees(&self, from: Vec3, to: Vec3) -> bool {
        self.is_free(Ray::new(from.into(), (to - from).into(), 0.0, SHADOW))
    }

    #[inline]
    fn is_free(&self, ray: Ray) -> bool {
        self.bvh.ray_traverse_miss(ray, |ray, slot| self.facets[slot].intersect(ray).map_or(f32::INFINITY, |(t, _)| t))
    }

    /// Returns what an emitter's point sends along the direction from which it is seen.
    #[inline]
    pub(crate) fn emission(&self, at: &EmitterPoint, direction: Vec3) -> f32 {
        let emitter = &self.emitters[at.triangle as usize];
        if emitter.normal.dot(direction) >= 0.0 {
            return 0.0;
        }
        self.radiance(emitter, at.barycentrics)
    }

    /// Returns the radiance of an emitter's front.
    #[inline]
    pub(crate) fn radiance(&self, emitter: &EmitterTriangle, [b1, b2]: [f32; 2]) -> f32 {
        match &self.scene.emitters[emitter.mesh as usize].radiance {
            Radiance::Constant(radiance) => *radiance,
            Radiance::Textured(texture) => {
                let [uv0, uv1, uv2] = emitter.uvs;
                texture.value(uv0 + b1 * (uv1 - uv0) + b2 * (uv2 - uv0))
            }
        }
    }
}

impl Facet {
    fn new(&Triangle { v0, v1, v2 }: &Triangle) -> Self {
        let (back, side) = (v0 - v1, v2 - v0);
        // Negated: the front's normal.
        Self { corner: v0, back, side, cross: side.cross(back) }
    }

    /// Returns distance and barycentrics where a ray crosses the triangle (Möller and Trumbore 1997, "Fast, Minimum
    /// Storage Ray-Triangle Intersection").
    #[inline(always)]
    fn intersect(&self, ray: &Ray) -> Option<(f32, [f32; 2])> {
        let to_corner = self.corner - ray.origin;
        let turned = ray.direction.cross(to_corner);
        let inverse = -1.0 / self.cross.dot(ray.direction);
        let b1 = turned.dot(self.side) * inverse;
        let b2 = turned.dot(self.back) * inverse;
        let distance = -self.cross.dot(to_corner) * inverse;
        let is_inside = b1 >= -SEAM && b2 >= -SEAM && b1 + b2 <= 1.0 + SEAM;
        (is_inside && distance >= ray.tmin && distance <= ray.tmax).then_some((distance, [b1, b2]))
    }
}

fn emitter_triangles(scene: &Scene) -> Vec<EmitterTriangle> {
    let mut emitters = Vec::new();
    for (mesh, emitter) in scene.emitters.iter().enumerate() {
        let uvs = &emitter.mesh.uvs;
        for (triangle, (corners, indices)) in emitter.mesh.triangles().zip(&emitter.mesh.indices).enumerate() {
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            emitters.push(EmitterTriangle {
                mesh: mesh as u32,
                triangle: triangle as u32,
                corners,
                uvs: indices.map(|i| uvs.get(i as usize).copied().unwrap_or_default()),
                normal: cross.normalize(),
                area: 0.5 * cross.length(),
            });
        }
    }
    emitters
}

/// Hashes everything that light depends on (FNV-1a).
fn fingerprint(scene: &Scene, triangles: &[[Vec3; 3]]) -> u64 {
    /// *Format*: offset and prime of the 64-bit FNV.
    const START: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    let mut hash = START;
    let mut add = |x: f32| hash = (hash ^ u64::from(x.to_bits())).wrapping_mul(PRIME);
    triangles.iter().flatten().flat_map(Vec3::to_array).for_each(&mut add);
    for (mesh, material) in &scene.solids {
        add(mesh.indices.len() as f32);
        match *material {
            Material::Diffuse(albedo) => albedo.to_array().into_iter().for_each(&mut add),
            Material::Glossy { alpha, share } => [alpha, share].into_iter().for_each(&mut add),
        }
    }
    for emitter in &scene.emitters {
        match &emitter.radiance {
            Radiance::Constant(radiance) => add(*radiance),
            Radiance::Textured(texture) => texture.texels.iter().copied().for_each(&mut add),
        }
    }
    if let Some(sky) = &scene.sky {
        sky.image().pixels.iter().flat_map(Vec3::to_array).for_each(&mut add);
        sky.rotation().to_cols_array().into_iter().for_each(&mut add);
    }
    let (position, corner) = scene.camera.ray(Vec2::ZERO);
    [position, corner].iter().flat_map(Vec3::to_array).for_each(add);
    hash
}
