//! Passes meshes in: as they are, or once where copies of them stand in several places.

use std::collections::HashMap;

use fanlight::{Hit, Instance, InstanceId, LightSamplerBuilder, MeshId, ObjectId, TriangleId};

use super::Error;
use super::alloc::sync::Arc;
use super::mesh::{Copies, Mesh};
use super::model::Model;
use super::scene::Point;

/// What the sampler calls the triangles of the model that emit light.
#[derive(Default)]
pub(super) struct Sources {
    /// In the order of the model's triangles.
    parts: Vec<Part>,
    /// How many meshes and instances emit light; portals have higher numbers.
    emitting: [u32; 2],
}

/// Triangles that follow each other, of one mesh or of one copy of it.
struct Part {
    triangles: core::ops::Range<usize>,
    instance: Option<InstanceId>,
    mesh: MeshId,
    /// Whether the second and third vertex are exchanged.
    is_mirrored: bool,
}

impl Sources {
    /// The point of a surface as the sampler knows it, if it emits light.
    pub(super) fn hit(&self, point: &Point) -> Option<Hit> {
        let at = self.parts.partition_point(|part| part.triangles.end <= point.triangle);
        let part = self.parts.get(at).filter(|part| part.triangles.contains(&point.triangle))?;
        let triangle = TriangleId::new(part.mesh, (point.triangle - part.triangles.start) as u32);
        let [b1, b2] = point.barycentrics;
        let barycentrics = if part.is_mirrored { [b2, b1] } else { [b1, b2] };
        Some(part.instance.map_or_else(
            || Hit::new(triangle, barycentrics),
            |instance| Hit::on_instance(instance, triangle, barycentrics),
        ))
    }

    /// Whether a point that was drawn is of an emitter, and not of a portal.
    pub(super) fn emits(&self, hit: &Hit) -> bool {
        let [meshes, instances] = self.emitting;
        hit.instance.map_or_else(|| hit.triangle.mesh.index() < meshes, |instance| instance.index() < instances)
    }
}

/// A mesh as the sampler wants it.
pub(super) type AsLight<'a> = &'a dyn Fn(&'_ Mesh) -> fanlight::Mesh<'_>;

/// Meshes that are being passed in: all emitters before the first portal.
pub(super) struct Meshes {
    /// In how many places each object stands.
    uses: HashMap<*const Mesh, usize>,
    objects: HashMap<*const Mesh, ObjectId>,
    sources: Sources,
    /// Meshes and instances so far.
    added: [u32; 2],
}

impl Meshes {
    pub(super) fn of(model: &Model) -> Self {
        let mut uses = HashMap::new();
        for copies in model.meshes.iter().filter_map(|mesh| mesh.copies.as_ref()) {
            *uses.entry(Arc::as_ptr(&copies.object)).or_default() += copies.places.len();
        }
        Self { uses, objects: HashMap::new(), sources: Sources::default(), added: [0; 2] }
    }

    /// The object that a mesh is copies of, if there are several.
    fn shared<'m>(&self, mesh: &'m Mesh) -> Option<&'m Copies> {
        let copies = mesh.copies.as_ref()?;
        (self.uses.get(&Arc::as_ptr(&copies.object)).is_some_and(|&uses| uses > 1)).then_some(copies)
    }

    /// Passes in a mesh that emits light. `first` is the number of its first triangle in the model.
    pub(super) fn add_emitter(
        &mut self,
        builder: &mut LightSamplerBuilder<'_>,
        mesh: &Mesh,
        first: usize,
        as_light: AsLight<'_>,
    ) -> Result<(), Error> {
        self.add(builder, mesh, as_light, Some(first))?;
        self.sources.emitting = self.added;
        Ok(())
    }

    /// Passes in a portal.
    pub(super) fn add_portal(
        &mut self,
        builder: &mut LightSamplerBuilder<'_>,
        mesh: &Mesh,
        as_light: AsLight<'_>,
    ) -> Result<(), Error> {
        self.add(builder, mesh, as_light, None)
    }

    /// What has been passed in, and how many objects are among it.
    pub(super) fn finish(self) -> (Sources, Passed) {
        let passed = Passed { meshes: self.added[0], objects: self.objects.len(), instances: self.added[1] };
        (self.sources, passed)
    }

    fn add(
        &mut self,
        builder: &mut LightSamplerBuilder<'_>,
        mesh: &Mesh,
        as_light: AsLight<'_>,
        first: Option<usize>,
    ) -> Result<(), Error> {
        let Some(Copies { object, places }) = self.shared(mesh) else {
            return self.add_alone(builder, mesh, as_light, first);
        };
        let key = Arc::as_ptr(object);
        let id = match self.objects.get(&key) {
            Some(&id) => id,
            None => builder.add_object(&[as_light(object)])?,
        };
        self.objects.insert(key, id);
        for (number, place) in places.iter().enumerate() {
            let first = first.map(|first| first + number * object.indices.len());
            // Some places flatten a mesh so that it cannot be an object.
            match builder.add_instance(Instance::new(id, *place)) {
                Ok(instance) => {
                    self.added[1] += 1;
                    self.extend(
                        first,
                        object,
                        Some(instance),
                        MeshId::from_index(0),
                        place.matrix3.determinant() < 0.0,
                    );
                }
                Err(_) => self.add_alone(builder, &mesh.copy(number), as_light, first)?,
            }
        }
        Ok(())
    }

    fn add_alone(
        &mut self,
        builder: &mut LightSamplerBuilder<'_>,
        mesh: &Mesh,
        as_light: AsLight<'_>,
        first: Option<usize>,
    ) -> Result<(), Error> {
        let id = builder.add_mesh(&as_light(mesh))?;
        self.added[0] += 1;
        self.extend(first, mesh, None, id, false);
        Ok(())
    }

    fn extend(
        &mut self,
        first: Option<usize>,
        mesh: &Mesh,
        instance: Option<InstanceId>,
        id: MeshId,
        is_mirrored: bool,
    ) {
        let Some(first) = first else { return };
        let triangles = first..first + mesh.indices.len();
        self.sources.parts.push(Part { triangles, instance, mesh: id, is_mirrored });
    }
}

/// How much was passed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Passed {
    pub(crate) meshes: u32,
    pub(crate) objects: usize,
    pub(crate) instances: u32,
}
