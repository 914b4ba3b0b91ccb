//! Scenes that move, with the same scenes as they are at one time. Coordinates and maps are multiples of powers of two
//! at all quarters of the interval, so that what the tests compare with is exact there.

use fanlight::{Arity, Hit, Instance, LightSample, LightSampler, LightSamplerBuilder, Mesh, ShadingPoint};
use glam::{Affine3A, Mat3, Mat3A, Vec3, Vec3A};

use crate::common::oracle;
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Scene};
use crate::instances::town::{Town, mesh, soup};

/// Kinds of motion: maps of instances as in [`crate::instances::town::transform`].
pub(crate) const KINDS: usize = 6;

/// A town at both ends of the interval.
#[derive(Clone, Debug)]
pub(crate) struct Moving {
    pub(crate) start: Town,
    pub(crate) end: Town,
}

/// A vector of steps.
fn steps(pcg: &mut Pcg32, count: usize, unit: f32) -> Vec3 {
    Vec3::from([(); 3].map(|()| (pcg.below(2 * count + 1) as f32 - count as f32) * unit))
}

/// A map close enough to another to be inverted all the way in between.
fn later(transform: &Affine3A, kind: usize, pcg: &mut Pcg32) -> Affine3A {
    let unit = if kind == 5 { 4.0 } else { 0.25 };
    let bend = Mat3::from_cols(
        Vec3::X + steps(pcg, 1, 0.25),
        Vec3::Y + steps(pcg, 1, 0.25),
        Vec3::Z * (1.0 + 0.25 * pcg.below(4) as f32),
    );
    let linear = if kind == 5 { transform.matrix3 } else { transform.matrix3 * Mat3A::from(bend) };
    Affine3A { matrix3: linear, translation: transform.translation + Vec3A::from(steps(pcg, 8, unit)) }
}

impl Moving {
    /// Objects of emitters and portals that move, and meshes of the same kinds whose vertices do.
    pub(crate) fn random(pcg: &mut Pcg32, kind: usize, textured: bool, sky: usize) -> Self {
        let town = Town::random(pcg, kind, textured, sky);
        let mut base = town.base.clone();
        if kind != 5 {
            for i in 0..2 {
                let mut mesh = soup(pcg, [3, 8][i]);
                (mesh.portal, mesh.two_sided) = (i == 0, pcg.below(2) == 0);
                mesh.paint = town.objects[1][i].paint;
                base.meshes.push(mesh);
            }
        }
        let start = Town::new(base.clone(), town.objects.clone(), town.instances.clone());
        // One instance in four and one mesh in three stand still.
        for mesh in base.meshes.iter_mut().skip(1) {
            mesh.positions.iter_mut().for_each(|p| *p += steps(pcg, 8, 1.0 / 16.0));
        }
        let mut instances = town.instances.clone();
        for (_, (_, transform, _)) in instances.iter_mut().enumerate().filter(|(i, _)| i % 4 != 3) {
            *transform = later(transform, kind, pcg);
        }
        Self { end: Town::new(base, town.objects, instances), start }
    }

    /// The scene as it is at a time.
    pub(crate) fn at(&self, time: f32) -> Town {
        let between = |a: Vec3, b: Vec3| (a.as_dvec3() + (b - a).as_dvec3() * f64::from(time)).as_vec3();
        let mut base = self.start.base.clone();
        for (mesh, end) in base.meshes.iter_mut().zip(&self.end.base.meshes) {
            mesh.positions.iter_mut().zip(&end.positions).for_each(|(p, q)| *p = between(*p, *q));
        }
        let instances = self.start.instances.iter().zip(&self.end.instances).map(|(start, end)| {
            let [a, b] = [start, end].map(|(_, transform, _)| transform.to_cols_array_2d());
            let columns = core::array::from_fn(|i| between(a[i].into(), b[i].into()).to_array());
            (start.0, Affine3A::from_cols_array_2d(&columns), start.2)
        });
        Town::new(base, self.start.objects.clone(), instances.collect())
    }

    /// The first few instances alone.
    pub(crate) fn first(&self, count: usize) -> Self {
        Self { start: self.start.first(count), end: self.end.first(count) }
    }

    /// Returns the town with lights that all have two sides.
    pub(crate) fn two_sided(&self) -> Self {
        let of = |town: &Town| {
            let two_sided = |mesh: &LightMesh| LightMesh { two_sided: true, ..mesh.clone() };
            let meshes = town.base.meshes.iter().map(two_sided).collect();
            let objects = town.objects.iter().map(|parts| parts.iter().map(two_sided).collect()).collect();
            Town::new(Scene { meshes, ..town.base.clone() }, objects, town.instances.clone())
        };
        Self { start: of(&self.start), end: of(&self.end) }
    }

    pub(crate) fn instance(&self, number: usize) -> Instance {
        self.start.instance(number).moving_to(self.end.instances[number].1)
    }

    /// The sampler of what moves.
    pub(crate) fn build(&self, arity: Arity) -> LightSampler {
        let empty = Scene { meshes: Vec::new(), ..self.start.base.clone() };
        empty.build_with(arity, |builder| self.add(builder))
    }

    fn add(&self, builder: &mut LightSamplerBuilder<'_>) {
        for (light, end) in self.start.base.meshes.iter().zip(&self.end.base.meshes) {
            builder.add_mesh(&mesh(light).moving_to(&end.positions)).expect("the mesh is valid");
        }
        for object in &self.start.objects {
            let meshes: Vec<Mesh<'_>> = object.iter().map(mesh).collect();
            builder.add_object(&meshes).expect("the object is valid");
        }
        for number in 0..self.start.instances.len() {
            builder.add_instance(self.instance(number)).expect("the instance is valid");
        }
    }
}

/// What a sample brings of one light, cosine included.
pub(crate) fn brought(town: &Town, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let direction = sample.direction.as_dvec3();
    oracle::cosine(&x.receiver, direction) * sent(town, &sample.hit().expect("a triangle"), direction)
}

/// What a point of a light sends against a direction.
pub(crate) fn sent(town: &Town, hit: &Hit, direction: glam::DVec3) -> f64 {
    let hit = town.flat_hit(hit);
    let (m, t) = (hit.triangle.mesh.index() as usize, hit.triangle.triangle as usize);
    oracle::sent(&town.flat, m, t, hit.barycentrics.map(f64::from), direction)
}

/// A lamp of three sides.
pub(crate) fn lamp() -> LightMesh {
    let positions = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.0], [-0.25, 0.4, 0.0], [-0.25, -0.4, 0.0]].map(Vec3::from).to_vec();
    LightMesh::new(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]])
}
