//! Objects and instances that are added to the collection of all lights.

use alloc::vec::Vec;

use super::added::AddedObject;
use super::{Instance, InstanceRecord, first_object};
use crate::error::{Error, ErrorKind};
use crate::geometry::Aabb;
use crate::light::{Energies, LightCollection, LightTriangle, Mesh};
use crate::progress::Progress;
use crate::receiver::ALL_GROUPS;
use crate::record::{InstanceId, MeshId, ObjectId};
use crate::tlas::{Arity, MAX_LEAVES};

impl<'a> LightCollection<'a> {
    /// Exchanges what is kept of meshes for that of an object, so that meshes can be added to it.
    pub(in crate::light) fn exchange_meshes(&mut self, object: &mut AddedObject) {
        core::mem::swap(&mut self.triangles, &mut object.triangles);
        core::mem::swap(&mut self.indices, &mut object.indices);
        core::mem::swap(&mut self.meshes, &mut object.meshes);
        core::mem::swap(&mut self.pending, &mut object.pending);
    }

    /// Adds an object. After an error the collection is as it was before.
    pub(crate) fn add_object(&mut self, meshes: &[Mesh<'_>]) -> Result<ObjectId, Error> {
        let number = self.objects.len();
        if let Some(mesh) = meshes.iter().position(|mesh| mesh.groups != ALL_GROUPS) {
            return Err(Error(ErrorKind::GroupsInObject { object: number, mesh }));
        }
        if let Some(mesh) = meshes.iter().position(|mesh| mesh.end.is_some()) {
            return Err(Error(ErrorKind::MotionInObject { object: number, mesh }));
        }
        let mut object = AddedObject::empty();
        let meshes_before = self.mesh_groups.len();
        self.exchange_meshes(&mut object);
        let added = meshes.iter().try_for_each(|mesh| self.add_mesh(mesh).map(|_: MeshId| ()));
        self.exchange_meshes(&mut object);
        self.mesh_groups.truncate(meshes_before);
        added.map_err(|Error(kind)| Error(ErrorKind::InObject { object: number, kind: kind.into() }))?;
        if object.indices.is_empty() {
            return Err(Error(ErrorKind::EmptyObject { object: number }));
        }
        let vertices = meshes.iter().flat_map(|mesh| mesh.positions);
        let whole = vertices.fold(Aabb::EMPTY, |whole, &p| whole.union(Aabb { min: p, max: p }));
        object.corners = [whole.min, whole.max];
        self.objects.push(object);
        Ok(ObjectId(number as u32))
    }

    /// Adds an instance. After an error the collection is as it was before.
    pub(crate) fn add_instance(&mut self, instance: &Instance) -> Result<InstanceId, Error> {
        let (number, ObjectId(object)) = (self.instances.len(), instance.object);
        let objects = self.objects.len();
        let unknown = || ErrorKind::UnknownObject { instance: number, object: object as usize, objects };
        let added = self.objects.get(object as usize).ok_or_else(|| Error(unknown()))?;
        if number >= MAX_LEAVES {
            return Err(Error(ErrorKind::TooMany { what: "instances", count: number + 1, limit: MAX_LEAVES }));
        }
        self.instances.push(InstanceRecord::new(instance, number, 0, added.corners)?);
        self.instance_groups.push(instance.groups);
        self.motion.set_instance(number as u32, instance.end_columns());
        Ok(InstanceId(number as u32))
    }

    /// Builds the light trees of all objects. Only then instances are complete.
    ///
    /// # Errors
    ///
    /// If the words of objects are more than can be numbered, or if the host has canceled the build.
    pub(crate) fn build_objects(
        &mut self,
        arity: Arity,
        energies: &Energies<'_>,
        progress: &Progress<'_>,
    ) -> Result<(), Error> {
        let mut starts = Vec::with_capacity(self.objects.len());
        for object in core::mem::take(&mut self.objects) {
            self.objects_have_portals |= object.triangles.iter().any(crate::light::LightKind::is_portal);
            starts.push(object.build(arity, energies, progress, &mut self.object_words)?);
        }
        self.instances.iter_mut().for_each(|instance| instance.object = starts[instance.number as usize]);
        let (count, limit) = (first_object(self.instances.len()) + self.object_words.len(), u32::MAX as usize);
        if count <= limit {
            Ok(())
        } else {
            Err(Error(ErrorKind::TooMany { what: "words of instances and objects", count, limit }))
        }
    }

    /// Number of the triangles of all objects that may emit.
    pub(crate) fn object_light_count(&self) -> usize {
        self.objects.iter().map(|object| object.triangles.len()).sum()
    }
}

impl LightTriangle {
    /// Returns the record that stands for an instance in the order of the tree's leaves. *Format*: it is marked as a
    /// lamp and a portal, which no lamp is, and a moving triangle with one more mark.
    pub(in crate::light) fn of_instance(number: u32) -> Self {
        let mark = Self::LAMP | Self::PORTAL;
        Self { index_and_flags: number | mark, ..bytemuck::Zeroable::zeroed() }
    }

    /// Returns the number of the instance that a record marked as a lamp stands for, if it is one.
    #[inline(always)]
    pub(in crate::light) fn instance(&self) -> Option<u32> {
        let mark = Self::LAMP | Self::PORTAL;
        (self.index_and_flags & (mark | Self::MOVING) == mark).then_some(self.index_and_flags & !mark)
    }
}
