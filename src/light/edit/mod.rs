//! Lights that come, go and change in a finished sampler.
//!
//! A batch of edits is first checked and collected ([`LightChanges`]), by the number of what it edits, so that the last
//! word on each counts. Then it is applied ([`apply`]), and nothing of that can fail. What a sampler needs for this and
//! no walk looks at is kept beside it ([`LightsState`]).
//!
//! Numbers of what was removed are given out again, to later batches. Meshes have places for their triangles in one
//! array: the places of a removed mesh go to one that needs at least half of them. The array ends with spare places,
//! which are those of one more mesh that nobody knows of, so that a new mesh need not move the lamps behind all meshes.

mod apply;
mod changes;
mod layout;
mod motion;
mod numbers;

use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::extras;
use super::instance::{object_starts, records, records_mut};
use super::{Energies, Extras, Light, LightCollection, LightTriangle, Lights};
use crate::blas::CellNode;
use crate::bounds::{LightBounds, Moments};
use crate::env::Environment;
use crate::receiver::ALL_GROUPS;
use crate::tlas::{LeafStore, Tlas, TreeEdit, TreeState};
pub(crate) use apply::Edited;
pub(crate) use changes::LightChanges;
pub(crate) use layout::laid_out;
use numbers::Numbers;

/// Most light that all lights may come to send, relative to what they sent when the tree was fitted last, and the
/// inverse of the least. Beyond it all nodes are fitted again. *Chosen*: far from what single precision holds.
///
/// Larger: products come nearer to overflow. Smaller: more edits of very bright or nearly all lights take the time of a
/// refit.
const UNIT_DRIFT: f64 = 1_048_576.0;

/// What edits of a sampler need to know beside it.
#[derive(Clone, Debug)]
pub(crate) struct EditState {
    lights: LightsState,
    tree: TreeState,
    /// Unit of the energies in the tree.
    unit: f64,
    /// Energy of all lights.
    total: f64,
}

/// What a sampler holds only for edits to come.
#[derive(Clone, Default)]
pub(crate) struct Unplaced {
    /// Words of the objects while there is no instance.
    objects: Vec<u32>,
    /// Light groups of lamps that emit nothing, but for those in all groups.
    lamps: BTreeMap<u32, u32>,
}

crate::buffers::debug_counts!(Unplaced, unplaced => {
    objects: unplaced.objects.len(),
    lamps: unplaced.lamps.len(),
});

impl Unplaced {
    /// Takes from a collection what will not be in its sampler.
    pub(crate) fn of(collection: &mut LightCollection<'_>) -> Self {
        let has_instances = !collection.instances.is_empty();
        let objects = if has_instances { Vec::new() } else { core::mem::take(&mut collection.object_words) };
        let lamps = (0..).zip(collection.lamps.iter().zip(&collection.lamp_groups));
        let dark = lamps.filter(|(_, (lamp, groups))| lamp.weight() == 0.0 && **groups != ALL_GROUPS);
        Self { objects, lamps: dark.map(|(number, (_, groups))| (number, *groups)).collect() }
    }
}

/// What edits of lights need to know beside them.
#[derive(Clone)]
struct LightsState {
    lamps: Numbers,
    meshes: Numbers,
    instances: Numbers,
    /// Removed meshes, by the logarithm of the number of their places, in the order in which they were removed. The last
    /// ones are given out first, so that it takes no search to find or to take them.
    free_meshes: BTreeMap<u32, Vec<u32>>,
    /// Numbers of triangles of those meshes that have more places than triangles.
    mesh_sizes: BTreeMap<u32, u32>,
    /// First word of every object, after those of all instances.
    objects: Vec<u32>,
    unplaced: Unplaced,
    /// Nodes of trees over textures when those that nothing refers to were removed last.
    cells: usize,
}

crate::buffers::debug_counts!(LightsState, state => {
    lamps: state.lamps,
    meshes: state.meshes,
    instances: state.instances,
    free_meshes: state.free_meshes.values().map(Vec::len).sum::<usize>(),
    mesh_sizes: state.mesh_sizes.len(),
    objects: state.objects.len(),
    unplaced: state.unplaced,
    cells: state.cells,
});

impl EditState {
    /// Returns the number of bytes that this takes, but for what was removed or is dark.
    pub(crate) fn byte_size(&self) -> usize {
        self.tree.byte_size() + size_of_val(&self.lights.objects[..]) + size_of_val(&self.lights.unplaced.objects[..])
    }

    /// Prepares a sampler that has not been edited before.
    pub(crate) fn new(
        lights: &mut Lights,
        tlas: &mut Tlas,
        environment: &Environment,
        unplaced: Unplaced,
    ) -> Box<Self> {
        let lamp_start = lights.meshes.last().copied().unwrap_or(0);
        let lamps = lights.leaf_of.len() as u32 - lamp_start;
        let state = LightsState {
            lamps: Numbers::new(lamps),
            meshes: Numbers::new(lights.meshes.len() as u32 - 1),
            instances: Numbers::new(records(&lights.instances).len() as u32),
            free_meshes: BTreeMap::new(),
            mesh_sizes: BTreeMap::new(),
            objects: object_starts(&lights.instances, &unplaced.objects),
            unplaced,
            cells: lights.cells.len(),
        };
        // The spare places: none yet.
        lights.meshes.push(lamp_start);
        if !lights.scales.is_empty() {
            lights.scales.push(1.0);
        }
        lights.is_edited = true;
        let view = lights.view();
        let energies = Energies::new(environment, view.scales, view.meshes);
        let total = energies.total(view.len(), |leaf| view.light(leaf as u32));
        let mut all = Box::new(Self { lights: state, tree: TreeState::default(), unit: total, total });
        let mut store = LightStore { lights, environment, unit: total };
        TreeEdit { tlas, state: &mut all.tree, store: &mut store }.prepare();
        all
    }
}

/// The lights of a sampler as its tree sees them while it is edited.
struct LightStore<'s> {
    lights: &'s mut Lights,
    environment: &'s Environment,
    unit: f64,
}

/// What is kept of a light in a leaf.
#[derive(Clone, Copy, Debug)]
struct StoredLight {
    record: LightTriangle,
    groups: u32,
}

impl LightStore<'_> {
    fn energies(&self) -> Energies<'_> {
        Energies::new(self.environment, &self.lights.scales, &self.lights.meshes)
    }

    fn light<'r>(&'r self, record: &'r LightTriangle) -> Light<'r> {
        Light::of(record, Extras(&self.lights.extras), &self.lights.instances, self.lights.time)
    }

    /// Returns the energy of a light, of which a record is given.
    fn energy(&self, record: &LightTriangle) -> f64 {
        self.energies().energy(self.light(record))
    }
}

impl LeafStore for LightStore<'_> {
    type Leaf = StoredLight;

    fn bounds(&self, light: &StoredLight) -> (LightBounds, Moments) {
        self.energies().bounds(self.light(&light.record), self.unit)
    }

    fn get(&self, leaf: u32) -> StoredLight {
        StoredLight { record: self.lights.records[leaf as usize], groups: self.groups(leaf) }
    }

    fn groups(&self, leaf: u32) -> u32 {
        Extras(&self.lights.extras).groups_of(leaf)
    }

    fn take(&mut self, leaf: u32) -> StoredLight {
        let light = self.get(leaf);
        self.lights.records[leaf as usize] = bytemuck::Zeroable::zeroed();
        light
    }

    fn put(&mut self, leaf: u32, light: StoredLight) {
        let Lights { records, leaf_of, meshes, instances, extras, .. } = &mut *self.lights;
        records[leaf as usize] = light.record;
        extras::set_groups(extras, leaf, light.groups);
        if let Some(instance) = light.record.instance() {
            records_mut(instances)[instance as usize].leaf = leaf;
        } else {
            let first = if light.record.is_lamp() { meshes.last().copied().unwrap_or(0) } else { 0 };
            leaf_of[(first + light.record.number()) as usize] = leaf;
        }
    }

    fn resize(&mut self, leaves: usize) {
        if leaves < self.lights.records.len() {
            self.lights.records.truncate(leaves);
            self.lights.records.shrink_to_fit();
        } else {
            self.lights.records.resize(leaves, bytemuck::Zeroable::zeroed());
        }
        extras::resize_groups(&mut self.lights.extras, leaves);
    }
}

impl LightTriangle {
    /// Whether this is the record of a lamp.
    fn is_lamp(&self) -> bool {
        self.index_and_flags & (Self::LAMP | Self::MOVING) == Self::LAMP && self.instance().is_none()
    }

    /// Returns the number of the triangle or lamp.
    fn number(&self) -> u32 {
        self.index()
    }
}

/// Appends trees of another pool, of whose roots `roots` are some.
fn append_cells(cells: &mut Vec<CellNode>, added: &[CellNode]) -> u32 {
    let base = cells.len() as u32;
    cells.extend(added.iter().map(|node| node.moved_by(base)));
    base
}
