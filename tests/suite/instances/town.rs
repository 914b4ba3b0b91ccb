//! Scenes of instances with the same scene flattened. All coordinates and maps are multiples of powers of two, so that
//! the vertices of the flattened scene are exact.

use fanlight::{
    Arity, Hit, Instance, InstanceId, LightSample, LightSampler, LightSamplerBuilder, Mesh, MeshId, ObjectId,
    SampledLight, Sides, TextureId, TriangleId, Weight,
};
use glam::{Affine3A, DVec3, Mat3, Mat3A, Vec3, Vec3A};

use crate::common::density::id;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Image, LightMesh, Paint, Scene, Sky};

/// Kinds of maps: see [`transform`].
pub(crate) const KINDS: usize = 6;

/// Where a mesh of the flattened scene comes from.
#[derive(Clone, Copy, Debug)]
struct Origin {
    instance: Option<usize>,
    mesh: usize,
    mirrored: bool,
}

/// Objects, instances of them, and meshes of their own.
#[derive(Clone, Debug)]
pub(crate) struct Town {
    pub(crate) objects: Vec<Vec<LightMesh>>,
    pub(crate) instances: Vec<(usize, Affine3A, f32)>,
    /// The meshes that stand alone, with images and the sky.
    pub(crate) base: Scene,
    /// All of it as meshes.
    pub(crate) flat: Scene,
    origins: Vec<Origin>,
}

/// A map of a kind: 0 rotation and uniform scale, 1 non-uniform scale, 2 mirror image, 3 shear, 4 any, 5 far from the
/// origin.
pub(crate) fn transform(kind: usize, pcg: &mut Pcg32) -> Affine3A {
    let turned = Mat3::from_cols(Vec3::new(2.0, 2.0, -1.0), Vec3::new(-1.0, 2.0, 2.0), Vec3::new(2.0, -1.0, 2.0));
    let turns = [turned, turned.transpose(), 3.0 * Mat3::IDENTITY];
    let mut step = |steps: usize, unit: f32| (pcg.below(2 * steps + 1) as f32 - steps as f32) * unit;
    let place = Vec3::new(step(16, 0.125), step(16, 0.125), step(16, 0.125));
    let scale = [0.125, 0.25, 0.5][(step(100, 1.0) as i32).rem_euclid(3) as usize];
    let rotation = turns[(step(100, 1.0) as i32).rem_euclid(3) as usize] * scale;
    let linear = match kind {
        0 => rotation,
        1 => rotation * Mat3::from_diagonal(Vec3::new(0.25, 1.0, 0.5)),
        2 => rotation * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0)),
        3 => rotation * Mat3::from_cols(Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.0, -0.75, 1.0)),
        4 => {
            let shear = Mat3::from_cols(Vec3::X, Vec3::new(step(4, 0.25), 1.0, 0.0), Vec3::new(0.0, 0.5, 1.0));
            rotation * shear * Mat3::from_diagonal(Vec3::new(0.5, 1.0, -0.5))
        }
        _ => turned * 0.25,
    };
    let far = Vec3::new(1e6, -5e5, 0.0);
    Affine3A::from_mat3_translation(linear, if kind == 5 { far + place.round() } else { place })
}

/// Separate triangles with vertices on a grid.
pub(crate) fn soup(pcg: &mut Pcg32, count: usize) -> LightMesh {
    let mut mesh = LightMesh::soup(pcg, count, 0.3);
    mesh.positions.iter_mut().for_each(|p| *p = (*p * 16.0).round() / 16.0);
    mesh
}

/// Moves vertices to places that stay exact 1e6 from the origin.
fn coarse(mut mesh: LightMesh) -> LightMesh {
    mesh.positions.iter_mut().for_each(|p| *p = (*p * 8.0).round() / 2.0);
    mesh
}

impl Town {
    /// Flattens instances.
    pub(crate) fn new(base: Scene, objects: Vec<Vec<LightMesh>>, instances: Vec<(usize, Affine3A, f32)>) -> Self {
        let mut flat = base.clone();
        let alone = |mesh| Origin { instance: None, mesh, mirrored: false };
        let mut origins: Vec<Origin> = (0..base.meshes.len()).map(alone).collect();
        for (i, (object, transform, scale)) in instances.iter().enumerate() {
            let mirrored = transform.matrix3.determinant() < 0.0;
            for (number, mesh) in objects[*object].iter().enumerate() {
                let mut mesh = mesh.clone();
                mesh.positions.iter_mut().for_each(|p| *p = transform.transform_point3(*p));
                if mirrored {
                    mesh.indices.iter_mut().for_each(|[_, b, c]| core::mem::swap(b, c));
                }
                mesh.paint = match mesh.paint {
                    Paint::Constant(value) => Paint::Constant(value * scale),
                    Paint::Image(image) => {
                        let mut image: Image = flat.images[image].clone();
                        image.texels.iter_mut().for_each(|texel| *texel *= scale);
                        flat.images.push(image);
                        Paint::Image(flat.images.len() - 1)
                    }
                };
                flat.meshes.push(mesh);
                origins.push(Origin { instance: Some(i), mesh: number, mirrored });
            }
        }
        Self { objects, instances, base, flat, origins }
    }

    /// Objects of emitters and portals, placed by maps of a kind.
    pub(crate) fn random(pcg: &mut Pcg32, kind: usize, textured: bool, sky: usize) -> Self {
        let mut base = Scene::new("town", Vec::new());
        base.sky = Sky::random(pcg, sky);
        base.rotation = pcg.rotation();
        let mut objects = Vec::new();
        for count in [1, 6, 40] {
            let mut parts = Vec::new();
            for part in 0..2 {
                let mut mesh = soup(pcg, if part == 0 { count } else { count.div_ceil(3) - 1 });
                mesh = if kind == 5 { coarse(mesh) } else { mesh };
                mesh.two_sided = pcg.below(3) == 0;
                mesh.portal = (part + count) % 2 == 1;
                mesh.paint = if textured {
                    base.images.push(Image::random(pcg, part + count));
                    Paint::Image(base.images.len() - 1)
                } else {
                    Paint::Constant(pcg.within(0.1, 4.0))
                };
                parts.push(mesh);
            }
            objects.push(parts);
        }
        // A light of its own among them.
        if kind != 5 && pcg.below(2) == 0 {
            base.meshes.push(soup(pcg, 3).two_sided());
        }
        let count = [1, 3, 20][pcg.below(3)];
        let instances =
            (0..count).map(|_| (pcg.below(3), transform(kind, pcg), [1.0, 0.5, 2.0][pcg.below(3)])).collect();
        Self::new(base, objects, instances)
    }

    /// The sampler of the instances.
    pub(crate) fn build(&self, arity: Arity) -> LightSampler {
        self.base.build_with(arity, |builder| self.add(builder))
    }

    fn add(&self, builder: &mut LightSamplerBuilder<'_>) {
        for object in &self.objects {
            let meshes: Vec<Mesh<'_>> = object.iter().map(mesh).collect();
            builder.add_object(&meshes).expect("the object is valid");
        }
        for instance in 0..self.instances.len() {
            builder.add_instance(self.instance(instance)).expect("the instance is valid");
        }
    }

    pub(crate) fn instance(&self, number: usize) -> Instance {
        let (object, transform, scale) = self.instances[number];
        Instance::new(ObjectId::from_index(object as u32), transform).scaled(scale)
    }

    /// The hit on the instances that a hit on the flattened scene is.
    pub(crate) fn hit(&self, flat: &Hit) -> Hit {
        let Origin { instance, mesh, mirrored } = self.origins[flat.triangle.mesh.index() as usize];
        let triangle = TriangleId::new(MeshId::from_index(mesh as u32), flat.triangle.triangle);
        let [b1, b2] = flat.barycentrics;
        let barycentrics = if mirrored { [b2, b1] } else { [b1, b2] };
        match instance {
            None => Hit::new(triangle, barycentrics),
            Some(instance) => Hit::on_instance(InstanceId::from_index(instance as u32), triangle, barycentrics),
        }
    }

    /// The hit on the flattened scene that a hit on the instances is.
    pub(crate) fn flat_hit(&self, hit: &Hit) -> Hit {
        let instance = hit.instance.map(|instance| instance.index() as usize);
        let is_origin =
            |origin: &Origin| origin.instance == instance && origin.mesh == hit.triangle.mesh.index() as usize;
        let mesh = self.origins.iter().position(is_origin).expect("a mesh of the scene");
        let [b1, b2] = hit.barycentrics;
        let barycentrics = if self.origins[mesh].mirrored { [b2, b1] } else { [b1, b2] };
        Hit::new(id((mesh, hit.triangle.triangle as usize)), barycentrics)
    }

    /// The first few instances alone.
    pub(crate) fn first(&self, count: usize) -> Self {
        let instances = self.instances.iter().take(count).copied().collect();
        Self::new(self.base.clone(), self.objects.clone(), instances)
    }

    /// Returns a town of the same objects in other places.
    pub(crate) fn with(&self, instances: Vec<(usize, Affine3A, f32)>) -> Self {
        Self::new(self.base.clone(), self.objects.clone(), instances)
    }

    /// Where a hit is, by the flattened scene.
    pub(crate) fn flat_position(&self, hit: &Hit) -> DVec3 {
        let flat = self.flat_hit(hit);
        let mesh = &self.flat.meshes[flat.triangle.mesh.index() as usize];
        let [a, b, c] = mesh.vertices(flat.triangle.triangle as usize).map(Vec3::as_dvec3);
        let [b1, b2] = flat.barycentrics.map(f64::from);
        a * (1.0 - b1 - b2) + b * b1 + c * b2
    }

    /// Whether a hit is on a mirror image.
    pub(crate) fn is_mirrored(&self, hit: &Hit) -> bool {
        hit.instance.is_some_and(|i| self.instances[i.index() as usize].1.matrix3.determinant() < 0.0)
    }

    /// Whether there are textures.
    pub(crate) fn is_textured(&self) -> bool {
        !self.base.images.is_empty()
    }

    /// The sample on the flattened scene that a sample on the instances is.
    pub(crate) fn flat_sample(&self, sample: &LightSample) -> LightSample {
        let mut flat = *sample;
        flat.light = SampledLight::Triangle(self.flat_hit(&sample.hit().expect("a triangle")));
        flat
    }

    /// A point of the scene to look from: in the unit cube of one of the instances, or near it.
    pub(crate) fn place(&self, pcg: &mut Pcg32) -> Vec3 {
        let (_, transform, _) = self.instances[pcg.below(self.instances.len())];
        transform.transform_point3(3.0 * Vec3::from(pcg.cube()) - 1.0)
    }
}

/// A mesh as the crate gets it.
pub(crate) fn mesh(light: &LightMesh) -> Mesh<'_> {
    let make = if light.portal { Mesh::portal } else { Mesh::emitter };
    let weight = match light.paint {
        Paint::Constant(value) => Weight::Constant(value),
        Paint::Image(image) => Weight::Texture(TextureId::from_index(image as u32)),
    };
    let sides = if light.two_sided { Sides::Two } else { Sides::One };
    make(&light.positions, &light.indices).uvs(&light.uvs).weight(weight).sides(sides)
}

/// A map that does nothing but to move.
pub(crate) fn moved(by: Vec3) -> Affine3A {
    Affine3A { matrix3: Mat3A::IDENTITY, translation: Vec3A::from(by) }
}
