//! A batch of edits as it is collected: each is checked at once, and none is applied yet.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use glam::Vec3;

use super::{EditState, LightsState};
use crate::blas::{self, Procedural, Texture};
use crate::error::{Error, ErrorKind};
use crate::geometry::Triangle;
use crate::light::instance::{InstanceRecord, Object, first_object, records};
use crate::light::mesh::{Mesh, MeshUpdate};
use crate::light::motion::{EndColumns, EndVertices, end_vertices};
use crate::light::update::check_vertices;
use crate::light::{Instance, Lamp, LampRecord, LightCollection, LightTriangle, Lights};
use crate::record::{InstanceId, LightId, MeshId, ObjectId, TextureId};
use crate::tlas::MAX_LEAVES;

/// Edits of a batch.
pub(crate) struct LightChanges<'a> {
    /// Meshes that are added, with their textures.
    pub(super) collection: LightCollection<'a>,
    /// What becomes of lamps, by number: `None` if they are removed.
    pub(super) lamps: BTreeMap<u32, Option<LampChange>>,
    pub(super) meshes: BTreeMap<u32, MeshChange>,
    /// What becomes of instances, by number: `None` if they are removed.
    pub(super) instances: BTreeMap<u32, Option<InstanceChange>>,
    /// Numbers from which on free ones are looked for.
    next_lamp: u32,
    next_instance: u32,
    /// Number of the next mesh that takes new places.
    next_mesh: u32,
    /// How many removed meshes are given out again, by the logarithm of the number of their places. The last ones that
    /// were removed come first.
    pub(super) reused_meshes: BTreeMap<u32, usize>,
    /// Places of triangles that new meshes take.
    places: usize,
}

/// What becomes of a lamp.
#[derive(Clone, Copy)]
pub(super) struct LampChange {
    pub(super) record: LampRecord,
    /// New light groups, if they change.
    pub(super) groups: Option<u32>,
}

/// What becomes of a mesh.
#[derive(Default)]
pub(super) struct MeshChange {
    /// Number in the collection of one that is added.
    pub(super) added: Option<u32>,
    pub(super) is_removed: bool,
    pub(super) vertices: Option<NewVertices>,
    pub(super) scale: Option<f32>,
}

/// New vertices of all triangles of a mesh.
pub(super) struct NewVertices {
    pub(super) start: Vec<Triangle>,
    /// Those at the end of the shutter interval; empty if the mesh stands still.
    pub(super) end: Vec<EndVertices>,
}

/// What becomes of an instance.
#[derive(Clone, Copy)]
pub(super) struct InstanceChange {
    /// Its object is numbered as in [`LightsState::objects`].
    pub(super) record: InstanceRecord,
    /// Transform at the end of the shutter interval, if the instance moves.
    pub(super) end: Option<EndColumns>,
    pub(super) groups: Option<u32>,
}

/// What becomes of lamps, meshes and instances.
pub(super) type Changes<'c> =
    (&'c BTreeMap<u32, Option<LampChange>>, &'c BTreeMap<u32, MeshChange>, &'c BTreeMap<u32, Option<InstanceChange>>);

/// Returns the logarithm of the places of a mesh, by which a removed one is found; rounded up for one that looks for
/// places.
pub(super) fn class_of(places: u32) -> u32 {
    places.checked_ilog2().unwrap_or(u32::MAX)
}

/// Returns the number of places that a new mesh gets for its triangles.
pub(super) fn places_of(triangles: u32) -> u32 {
    if triangles == 0 { 0 } else { triangles.next_power_of_two() }
}

impl NewVertices {
    /// Gives the record of a triangle of the mesh its vertices, and says whether they move.
    pub(super) fn give(&self, triangle: usize, record: &mut LightTriangle) {
        record.vertices = self.start[triangle].0.map(Vec3::into);
        record.mark_motion(self.end.get(triangle));
    }
}

impl<'a> LightChanges<'a> {
    /// Returns no change of a sampler.
    pub(crate) fn new(state: &EditState) -> Self {
        Self {
            collection: LightCollection::new(),
            lamps: BTreeMap::new(),
            meshes: BTreeMap::new(),
            instances: BTreeMap::new(),
            next_lamp: 0,
            next_instance: 0,
            next_mesh: state.lights.meshes.count(),
            reused_meshes: BTreeMap::new(),
            places: 0,
        }
    }

    /// Returns how many lamps, meshes and instances change.
    pub(crate) fn counts(&self) -> [usize; 3] {
        [self.lamps.len(), self.meshes.len(), self.instances.len()]
    }

    pub(crate) fn add_texture(&mut self, texture: Texture<'a>) -> TextureId {
        self.collection.add_texture(texture)
    }

    pub(crate) fn add_procedural(&mut self, function: &'a dyn Procedural) -> TextureId {
        self.collection.add_procedural(function)
    }

    /// Adds a lamp.
    pub(crate) fn add_lamp(
        &mut self,
        lights: &Lights,
        state: &EditState,
        lamp: Lamp,
        groups: u32,
    ) -> Result<LightId, Error> {
        let number = state.lights.lamps.next(self.next_lamp);
        let record = self.lamp(lights, lamp, number)?;
        self.lamps.insert(number, Some(LampChange { record, groups: Some(groups) }));
        self.next_lamp = number + 1;
        Ok(LightId(number))
    }

    fn lamp(&self, lights: &Lights, lamp: Lamp, number: u32) -> Result<LampRecord, Error> {
        check_count("lights", number as usize + 1)?;
        let record = lamp.record(number)?;
        lights.view().extras().profiles().check(record.number(), record.profile())?;
        Ok(record)
    }

    /// Replaces a lamp.
    pub(crate) fn set_lamp(
        &mut self,
        lights: &Lights,
        state: &EditState,
        LightId(number): LightId,
        lamp: Lamp,
    ) -> Result<(), Error> {
        self.check_lamp(&state.lights, number)?;
        let record = self.lamp(lights, lamp, number)?;
        let before = self.lamps.get(&number).copied().flatten();
        self.lamps.insert(number, Some(LampChange { record, groups: before.and_then(|before| before.groups) }));
        Ok(())
    }

    /// Removes a lamp.
    pub(crate) fn remove_lamp(&mut self, state: &EditState, LightId(number): LightId) -> Result<(), Error> {
        self.check_lamp(&state.lights, number)?;
        self.lamps.insert(number, None);
        Ok(())
    }

    fn check_lamp(&self, state: &LightsState, number: u32) -> Result<(), Error> {
        let exists = match self.lamps.get(&number) {
            Some(change) => change.is_some(),
            None => state.lamps.contains(number),
        };
        let lights = state.lamps.count() as usize;
        if exists { Ok(()) } else { Err(Error(ErrorKind::UnknownLight { light: number as usize, lights })) }
    }

    /// Adds a mesh.
    pub(crate) fn add_mesh(&mut self, lights: &Lights, state: &EditState, mesh: &Mesh<'_>) -> Result<MeshId, Error> {
        let triangles = mesh.indices.len();
        check_count("triangles", triangles.saturating_add(lights.leaf_of.len()).saturating_add(self.places))?;
        let places = places_of(triangles as u32);
        let class = class_of(places);
        let reused = self.reused_meshes.get(&class).copied().unwrap_or(0);
        let free = state.lights.free_meshes.get(&class).and_then(|free| free.get(free.len().checked_sub(reused + 1)?));
        check_count("places of triangles", lights.leaf_of.len() + self.places + places as usize)?;
        let MeshId(added) = self.collection.add_mesh(mesh)?;
        let number = if let Some(&number) = free {
            self.reused_meshes.insert(class, reused + 1);
            number
        } else {
            self.places += places as usize;
            self.next_mesh += 1;
            self.next_mesh - 1
        };
        self.meshes.insert(number, MeshChange { added: Some(added), ..MeshChange::default() });
        Ok(MeshId(number))
    }

    /// Moves or scales a mesh.
    pub(crate) fn update_mesh(
        &mut self,
        lights: &Lights,
        state: &EditState,
        update: &MeshUpdate<'_>,
    ) -> Result<(), Error> {
        let MeshId(number) = update.mesh;
        self.check_mesh(&state.lights, number)?;
        let mesh = number as usize;
        let added = self.meshes.get(&number).and_then(|change| change.added);
        let leaves = match added {
            Some(added) => self.collection.mesh(added),
            None => &lights.leaf_of[state.lights.places(lights, number)],
        };
        check_vertices(update, leaves)?;
        let vertices = update.triangles.map(|(positions, indices)| NewVertices {
            start: indices.iter().map(|&indices| Triangle::of(positions, indices)).collect(),
            end: update.end.filter(|end| *end != positions).map_or_else(Vec::new, |end| end_vertices(end, indices)),
        });
        if let Some(scale) = update.scale {
            let average = |leaf: &u32| lights.records.get(*leaf as usize).map_or(0.0, |light| light.root.average);
            // The average of an added mesh is known only when its textures are built.
            let known = if added.is_some() { &[] } else { leaves };
            check_scale(mesh, scale, known.iter().map(average).fold(1.0, f32::max))?;
        }
        let change = self.meshes.entry(number).or_default();
        change.vertices = vertices.or(change.vertices.take());
        change.scale = update.scale.or(change.scale);
        Ok(())
    }

    /// Removes a mesh.
    pub(crate) fn remove_mesh(&mut self, state: &EditState, MeshId(number): MeshId) -> Result<(), Error> {
        self.check_mesh(&state.lights, number)?;
        let change = self.meshes.entry(number).or_default();
        *change = MeshChange { is_removed: true, added: change.added, ..MeshChange::default() };
        Ok(())
    }

    /// `Ok` if there is such a mesh.
    fn check_mesh(&self, state: &LightsState, number: u32) -> Result<(), Error> {
        let exists = match self.meshes.get(&number) {
            Some(change) => !change.is_removed,
            None => state.meshes.contains(number),
        };
        let (mesh, meshes) = (number as usize, state.meshes.count() as usize);
        if exists { Ok(()) } else { Err(Error(ErrorKind::UnknownMesh { mesh, meshes })) }
    }

    /// Adds an instance.
    pub(crate) fn add_instance(
        &mut self,
        lights: &Lights,
        state: &EditState,
        instance: &Instance,
    ) -> Result<InstanceId, Error> {
        let number = state.lights.instances.next(self.next_instance);
        check_count("instances", number as usize + 1)?;
        let record = instance_record(lights, &state.lights, instance, number)?;
        let (end, groups) = (instance.end_columns(), Some(instance.groups));
        self.instances.insert(number, Some(InstanceChange { record, end, groups }));
        self.next_instance = number + 1;
        Ok(InstanceId(number))
    }

    /// Replaces an instance. `keeps_groups` leaves it in its light groups.
    pub(crate) fn set_instance(
        &mut self,
        lights: &Lights,
        state: &EditState,
        InstanceId(number): InstanceId,
        instance: &Instance,
        keeps_groups: bool,
    ) -> Result<(), Error> {
        self.check_instance(&state.lights, number)?;
        let record = instance_record(lights, &state.lights, instance, number)?;
        let before = self.instances.get(&number).copied().flatten().and_then(|before| before.groups);
        let groups = if keeps_groups { before } else { Some(instance.groups) };
        self.instances.insert(number, Some(InstanceChange { record, end: instance.end_columns(), groups }));
        Ok(())
    }

    /// Removes an instance.
    pub(crate) fn remove_instance(&mut self, state: &EditState, InstanceId(number): InstanceId) -> Result<(), Error> {
        self.check_instance(&state.lights, number)?;
        self.instances.insert(number, None);
        Ok(())
    }

    /// `Ok` if there is such an instance.
    fn check_instance(&self, state: &LightsState, number: u32) -> Result<(), Error> {
        let exists = match self.instances.get(&number) {
            Some(change) => change.is_some(),
            None => state.instances.contains(number),
        };
        let (instance, instances) = (number as usize, state.instances.count() as usize);
        if exists { Ok(()) } else { Err(Error(ErrorKind::UnknownInstance { instance, instances })) }
    }
}

impl LightsState {
    /// Returns where the triangles of a mesh are among all places.
    pub(super) fn places(&self, lights: &Lights, mesh: u32) -> core::ops::Range<usize> {
        let [start, end] = [mesh, mesh + 1].map(|mesh| lights.meshes[mesh as usize]);
        let size = self.mesh_sizes.get(&mesh).copied().unwrap_or(end - start);
        start as usize..(start + size) as usize
    }

    /// Returns an object by its number, and its first word.
    fn object<'o>(&'o self, lights: &'o Lights, number: u32) -> Option<(Object<'o>, u32)> {
        let start = *self.objects.get(number as usize)?;
        if lights.instances.is_empty() {
            return Some((Object::at(&self.unplaced.objects, start), start));
        }
        let first = first_object(records(&lights.instances).len()) as u32;
        Some((Object::at(&lights.instances, first + start), start))
    }
}

/// Returns the record of an instance with this number.
fn instance_record(
    lights: &Lights,
    state: &LightsState,
    instance: &Instance,
    number: u32,
) -> Result<InstanceRecord, Error> {
    let (ObjectId(object), number) = (instance.object, number as usize);
    let unknown =
        || ErrorKind::UnknownObject { instance: number, object: object as usize, objects: state.objects.len() };
    let (object, start) = state.object(lights, object).ok_or_else(|| Error(unknown()))?;
    InstanceRecord::new(instance, number, start, object.corners())
}

/// `Ok` if the factor of a mesh, and its product with the brightest of its triangles, can be stored.
pub(super) fn check_scale(mesh: usize, scale: f32, brightest: f32) -> Result<(), Error> {
    match [scale, scale * brightest].into_iter().find(|value| !(0.0..=blas::MAX_AVERAGE).contains(value)) {
        Some(value) => Err(Error(ErrorKind::Weight { mesh, value, limit: blas::MAX_AVERAGE })),
        None => Ok(()),
    }
}

/// `Ok` if `count` of something can be numbered.
fn check_count(what: &'static str, count: usize) -> Result<(), Error> {
    // As spare places grow by half, at most.
    let limit = MAX_LEAVES / 2;
    if count <= limit { Ok(()) } else { Err(Error(ErrorKind::TooMany { what, count, limit })) }
}
