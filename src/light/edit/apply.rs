//! A batch of edits applied: to the lights, and through them to the tree.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::changes::{Changes, InstanceChange, LampChange, MeshChange, check_scale, class_of, places_of};
use super::{EditState, LightChanges, LightStore, LightsState, StoredLight, UNIT_DRIFT, append_cells, motion};
use crate::blas::LEAF;
use crate::bounds::storable;
use crate::env::Environment;
use crate::error::{Error, ErrorKind};
use crate::light::distant;
use crate::light::distant_record::DistantRecord;
use crate::light::instance::{INSTANCE_WORDS, InstanceRecord, PlacedObject, emits, first_object, records, records_mut};
use crate::light::{
    Energies, Light, LightCollection, LightKind, LightTriangle, Lights, MovingTriangle, NO_AREA, NO_LEAF, extras,
};
use crate::progress::Progress;
use crate::receiver::ALL_GROUPS;
use crate::tlas::{Arity, LeafStore, MAX_LEAVES, Tlas, TreeEdit};

/// Fewest spare places that are added for triangles or instances. *Chosen*: a few kilobytes.
const LEAST_SPARE: usize = 64;

/// Nodes of trees over textures that are never worth a search for those that nothing refers to. *Chosen*: 300
/// kilobytes.
const FEW_CELLS: usize = 4096;

/// The parts of a sampler that edits change.
pub(crate) struct Edited<'s> {
    pub(crate) lights: &'s mut Lights,
    pub(crate) tlas: &'s mut Tlas,
    pub(crate) environment: &'s Environment,
    /// Arity of large trees.
    pub(crate) arity: Arity,
}

/// What a batch has done to the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Applied {
    /// The tree's cost, as [`Tlas::fit`] returns it.
    pub(crate) cost: f64,
    /// Whether all of the tree was built again.
    pub(crate) is_rebuilt: bool,
}

/// A batch that is being applied.
struct Application<'s, 'e> {
    state: &'s mut LightsState,
    tree: TreeEdit<'s, LightStore<'e>>,
    /// Distant lights by their numbers, and whether they have changed.
    distants: BTreeMap<u32, DistantRecord>,
    distants_change: bool,
}

impl EditState {
    /// Applies a batch. After an error everything is as it was before.
    ///
    /// # Errors
    ///
    /// If there are more lights or more nodes over textures than can be numbered, or a factor times the weight of a
    /// mesh that was added is too large.
    pub(crate) fn apply(&mut self, changes: LightChanges<'_>, edited: Edited<'_>) -> Result<Applied, Error> {
        let LightChanges { mut collection, lamps, meshes, instances, reused_meshes, .. } = changes;
        let Edited { lights, tlas, environment, arity } = edited;
        // 1. What may fail.
        collection.build_images(&Progress::new(None, 1.0))?;
        let added = lamps.len() + instances.len() + collection.triangles.len();
        let limits = [
            ("lights", self.leaf_count(lights) + added, MAX_LEAVES / 2),
            ("nodes of trees over textures", lights.cells.len() + collection.cells.len(), LEAF as usize - 1),
            ("words of instances and objects", self.lights.instance_words(lights, &instances), u32::MAX as usize),
        ];
        if let Some(&(what, count, limit)) = limits.iter().find(|(_, count, limit)| count > limit) {
            return Err(Error(ErrorKind::TooMany { what, count, limit }));
        }
        for (&number, change) in &meshes {
            if let (Some(added), Some(scale)) = (change.added, change.scale) {
                let average = |&index: &u32| collection.triangles.get(index as usize).map_or(0.0, LightKind::weight);
                let brightest = collection.mesh(added).iter().map(average).fold(1.0, f32::max);
                check_scale(number as usize, scale, brightest)?;
            }
        }
        // 2. Room for what is added.
        let base = append_cells(&mut lights.cells, &collection.cells);
        self.lights.reserve_instances(lights, &instances);
        self.lights.take_free_meshes(&reused_meshes);
        for (&number, change) in &meshes {
            if let Some(added) = change.added {
                self.lights.allocate_mesh(lights, number, collection.mesh(added).len() as u32);
            }
        }
        let has_groups = |groups: Option<u32>| groups.is_some_and(|groups| groups != ALL_GROUPS);
        let limits_groups = lamps.values().flatten().any(|change| has_groups(change.groups))
            || instances.values().flatten().any(|change| has_groups(change.groups))
            || collection.mesh_groups.iter().any(|groups| *groups != ALL_GROUPS);
        if limits_groups && extras::add_groups(&mut lights.extras, lights.records.len()) {
            tlas.groups = alloc::vec![ALL_GROUPS; tlas.view().node_count() * tlas.arity.lanes()];
        }
        // 3. A unit in which all energies are numbers.
        let new = self.lights.energy(lights, environment, &collection, (&lamps, &meshes, &instances));
        let Self { lights: state, tree, unit, total } = self;
        let mut store = LightStore { lights, environment, unit: *unit };
        let mut edit = TreeEdit { tlas, state: tree, store: &mut store };
        if new > 0.0 && *total + new > UNIT_DRIFT * *unit {
            *unit = *total + new;
            edit.store.unit = *unit;
            edit.fit_all();
        }
        // 4. One light after the other, now that motion is known.
        motion::update(edit.store.lights, &collection, (&lamps, &meshes, &instances));
        // Without lamps among the changes, no distant light is among them.
        let known = if lamps.is_empty() { &[] } else { edit.store.lights.view().extras().distants() };
        let distants = known.iter().map(|light| (light.number(), *light)).collect();
        let mut all = Application { state, tree: edit, distants, distants_change: false };
        lamps.into_iter().for_each(|(number, change)| all.change_lamp(number, change));
        meshes.into_iter().for_each(|(number, change)| all.change_mesh(number, change, &collection, base));
        instances.into_iter().for_each(|(number, change)| all.change_instance(number, change));
        if all.distants_change {
            let mut distants: Vec<DistantRecord> = all.distants.into_values().collect();
            let groups = distant::arrange(&mut distants);
            extras::set_distants(&mut all.tree.store.lights.extras, &distants, &groups);
        }
        // 5. The tree as a whole.
        let mut edit = all.tree;
        let is_rebuilt = edit.finish(arity);
        *total = edit.energy() * *unit;
        if *total > 0.0 && *total * UNIT_DRIFT < *unit {
            *unit = *total;
            edit.store.unit = *unit;
            edit.fit_all();
        }
        let cost = edit.cost();
        if is_rebuilt {
            lights.find_crossings();
        }
        lights.energy = if *total > 0.0 { storable(*unit) } else { 0.0 };
        if lights.cells.len() > 2 * state.cells + FEW_CELLS {
            lights.reclaim_cells();
            state.cells = lights.cells.len();
        }
        Ok(Applied { cost, is_rebuilt })
    }

    fn leaf_count(&self, lights: &Lights) -> usize {
        lights.records.len() - self.tree.free_leaf_count()
    }
}

impl Application<'_, '_> {
    fn lights(&mut self) -> &mut Lights {
        self.tree.store.lights
    }

    fn is_leaf(leaf: u32) -> bool {
        leaf < NO_AREA
    }

    /// Removes what is in a place of `leaf_of` from the tree.
    fn clear(&mut self, place: usize) {
        let leaf = self.lights().leaf_of[place];
        if Self::is_leaf(leaf) {
            self.tree.remove(leaf);
        }
        self.lights().leaf_of[place] = NO_LEAF;
    }

    fn change_lamp(&mut self, number: u32, change: Option<LampChange>) {
        let lights = self.lights();
        let place = lights.meshes.last().map_or(0, |&end| end as usize) + number as usize;
        if lights.leaf_of.len() <= place {
            lights.leaf_of.resize(place + 1, NO_LEAF);
        }
        let leaf = lights.leaf_of[place];
        let Some(LampChange { record, groups }) = change else {
            self.clear(place);
            self.distants_change |= self.distants.remove(&number).is_some();
            self.state.unplaced.lamps.remove(&number);
            return self.state.lamps.remove(number);
        };
        self.state.lamps.insert(number);
        let dark = self.state.unplaced.lamps.remove(&number);
        let distant = self.distants.get(&number).map(|light| light.groups);
        let kept = if Self::is_leaf(leaf) { Some(self.tree.store.groups(leaf)) } else { distant.or(dark) };
        let groups = groups.or(kept).unwrap_or(ALL_GROUPS);
        if let Some(light) = record.distant() {
            self.clear(place);
            let light = DistantRecord::new(&light, number, groups);
            self.distants_change |= self.distants.remove(&number).is_some();
            if light.irradiance() > 0.0 {
                self.distants.insert(number, light);
                self.distants_change = true;
            } else {
                self.state.unplaced.lamps.insert(number, groups);
            }
            return;
        }
        self.distants_change |= self.distants.remove(&number).is_some();
        let light = StoredLight { record: record.into_triangle(), groups };
        if record.has_extent() {
            self.lights().is_crossed_once = false;
        }
        if !(self.tree.store.energy(&light.record) > 0.0) {
            self.clear(place);
            self.state.unplaced.lamps.insert(number, groups);
        } else if Self::is_leaf(leaf) {
            self.lights().records[leaf as usize] = light.record;
            self.tree.update(leaf);
        } else {
            self.lights().has_lamps = true;
            self.tree.insert(light);
        }
    }

    fn change_mesh(&mut self, number: u32, change: MeshChange, collection: &LightCollection<'_>, base: u32) {
        let places = self.state.places(self.tree.store.lights, number);
        if change.is_removed {
            places.for_each(|place| self.clear(place));
            self.state.free_mesh(self.tree.store.lights, number);
            return;
        }
        if let Some(added) = change.added {
            self.add_mesh(number, added, collection, base);
        }
        if let Some(scale) = change.scale {
            self.set_scale(number, scale);
        }
        if change.vertices.is_some() {
            self.lights().is_crossed_once = false;
        }
        if change.vertices.is_none() && change.scale.is_none() {
            return;
        }
        for (i, place) in places.enumerate() {
            let leaf = self.lights().leaf_of[place];
            if Self::is_leaf(leaf) {
                if let Some(vertices) = &change.vertices {
                    vertices.give(i, &mut self.lights().records[leaf as usize]);
                }
                self.tree.update(leaf);
            }
        }
    }

    fn add_mesh(&mut self, number: u32, added: u32, collection: &LightCollection<'_>, base: u32) {
        let (triangles, ends) = (collection.mesh(added), collection.ends(added));
        let groups = collection.mesh_groups[added as usize];
        self.lights().is_crossed_once = false;
        if !self.lights().scales.is_empty() {
            self.set_scale(number, 1.0);
        }
        let energies = Energies::new(self.tree.store.environment, &[], &[]);
        for (i, place) in self.state.places(self.tree.store.lights, number).enumerate() {
            let index = triangles[i];
            let Some(&(mut record)) = collection.triangles.get(index as usize) else {
                self.lights().leaf_of[place] = index;
                continue;
            };
            let flags = record.index_and_flags & (LightTriangle::TWO_SIDED | LightTriangle::PORTAL);
            record.index_and_flags = flags | place as u32;
            record.mark_motion(ends.get(i));
            if record.root.node != LEAF {
                record.root.node += base;
            }
            if energies.energy(collection.light(index)) > 0.0 {
                self.lights().has_portals |= record.is_portal();
                self.tree.insert(StoredLight { record, groups });
            }
        }
    }

    fn set_scale(&mut self, mesh: u32, scale: f32) {
        let lights = self.lights();
        if lights.scales.is_empty() {
            lights.scales.resize(lights.meshes.len() - 1, 1.0);
        }
        lights.scales[mesh as usize] = scale;
    }

    fn change_instance(&mut self, number: u32, change: Option<InstanceChange>) {
        let leaf = records(&self.tree.store.lights.instances)[number as usize].leaf;
        let Some(InstanceChange { record, groups, .. }) = change else {
            self.take_instance(number);
            return self.state.instances.remove(number);
        };
        self.state.instances.insert(number);
        let mean = f64::from(self.tree.store.environment.mean_without_features());
        let lights = self.lights();
        lights.is_crossed_once = false;
        let first = first_object(records(&lights.instances).len()) as u32;
        records_mut(&mut lights.instances)[number as usize] =
            InstanceRecord { leaf, object: first + record.object, ..record };
        let placed = PlacedObject::at(&lights.instances, number);
        let (has_portals, is_lit) = (placed.is_portal(), emits(&placed.object, mean));
        lights.has_portals |= has_portals;
        if !is_lit {
            self.take_instance(number);
        } else if Self::is_leaf(leaf) {
            if let Some(groups) = groups {
                extras::set_groups(&mut self.lights().extras, leaf, groups);
            }
            self.tree.update(leaf);
        } else {
            let groups = groups.unwrap_or(ALL_GROUPS);
            self.tree.insert(StoredLight { record: LightTriangle::of_instance(number), groups });
        }
    }

    /// Removes an instance from the tree.
    fn take_instance(&mut self, number: u32) {
        let leaf = records(&self.tree.store.lights.instances)[number as usize].leaf;
        if Self::is_leaf(leaf) {
            self.tree.remove(leaf);
        }
        records_mut(&mut self.lights().instances)[number as usize].leaf = NO_LEAF;
    }
}

impl LightsState {
    /// Takes the removed meshes whose places are given to new ones: of each class, the last that were removed.
    fn take_free_meshes(&mut self, counts: &BTreeMap<u32, usize>) {
        for (class, &count) in counts {
            if let Some(free) = self.free_meshes.get_mut(class) {
                free.truncate(free.len() - count);
            }
        }
    }

    /// Gives a new mesh places for its triangles.
    fn allocate_mesh(&mut self, lights: &mut Lights, number: u32, triangles: u32) {
        let places = places_of(triangles);
        self.mesh_sizes.insert(number, triangles);
        let is_new = number >= self.meshes.count();
        self.meshes.insert(number);
        if !is_new {
            return;
        }
        // The last mesh is that of the spare places.
        let last = lights.meshes.len() - 1;
        let [start, end] = [lights.meshes[last - 1], lights.meshes[last]];
        let missing = places.saturating_sub(end - start);
        if missing > 0 {
            let more = missing + (lights.leaf_of.len() / 2).max(LEAST_SPARE) as u32;
            lights.leaf_of.splice(end as usize..end as usize, core::iter::repeat_n(NO_LEAF, more as usize));
            lights.meshes[last] += more;
        }
        lights.meshes.insert(last, start + places);
        if !lights.scales.is_empty() {
            lights.scales.push(1.0);
        }
    }

    /// Frees the places of a mesh without triangles.
    fn free_mesh(&mut self, lights: &mut Lights, number: u32) {
        let [start, end] = [number, number + 1].map(|mesh| lights.meshes[mesh as usize]);
        if !lights.scales.is_empty() {
            lights.scales[number as usize] = 1.0;
        }
        self.mesh_sizes.remove(&number);
        self.meshes.remove(number);
        self.free_meshes.entry(class_of(end - start)).or_default().push(number);
    }

    /// Returns the number of records that instances need.
    fn instance_count(&self, lights: &Lights, changes: &BTreeMap<u32, Option<InstanceChange>>) -> usize {
        let count = changes.last_key_value().map_or(0, |(&last, _)| last as usize + 1);
        let now = records(&lights.instances).len();
        if count <= now { now } else { count + (now / 2).max(LEAST_SPARE.min(count)) }
    }

    fn instance_words(&self, lights: &Lights, changes: &BTreeMap<u32, Option<InstanceChange>>) -> usize {
        let more = self.instance_count(lights, changes) - records(&lights.instances).len();
        lights.instances.len() + self.unplaced.objects.len() + more.saturating_mul(INSTANCE_WORDS)
    }

    /// Makes room for the records of all instances.
    fn reserve_instances(&mut self, lights: &mut Lights, changes: &BTreeMap<u32, Option<InstanceChange>>) {
        let (before, count) = (records(&lights.instances).len(), self.instance_count(lights, changes));
        if count == before {
            return;
        }
        if lights.instances.is_empty() {
            lights.instances.push(0);
            lights.instances.append(&mut self.unplaced.objects);
        }
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let object = first_object(count) as u32;
        let spare = InstanceRecord { columns, object, scale: 0.0, leaf: NO_LEAF, number: 0 };
        let spare = alloc::vec![spare; count - before];
        let end = first_object(before);
        lights.instances.splice(end..end, bytemuck::cast_slice(&spare).iter().copied());
        lights.instances[0] = count as u32;
        let moved = ((count - before) * INSTANCE_WORDS) as u32;
        let known = records_mut(&mut lights.instances).iter_mut().take(before);
        known.for_each(|record| record.object += moved);
    }

    /// Returns the energy of all that is added or changed.
    fn energy(
        &self,
        lights: &Lights,
        environment: &Environment,
        collection: &LightCollection<'_>,
        (lamps, meshes, instances): Changes<'_>,
    ) -> f64 {
        let energies = Energies::new(environment, &[], &[]);
        let extras = lights.view().extras();
        let lamp = |change: &LampChange| match change.record.distant() {
            Some(_) => 0.0,
            None => energies.energy(Light::of(&change.record.into_triangle(), extras, &[], lights.time)),
        };
        let mut sum: f64 = lamps.values().flatten().map(lamp).sum();
        for (&number, change) in meshes {
            let current = lights.scales.get(number as usize).copied().filter(|_| change.added.is_none());
            let scale = f64::from(change.scale.or(current).unwrap_or(1.0)).max(1.0);
            let (leaves, records) = match change.added {
                Some(added) => (collection.mesh(added), &collection.triangles),
                None => (&lights.leaf_of[self.places(lights, number)], &lights.records),
            };
            for (i, &leaf) in leaves.iter().enumerate() {
                let Some(record) = records.get(leaf as usize) else { continue };
                if change.added.is_some() {
                    sum += scale * energies.energy(collection.light(leaf));
                } else if change.vertices.is_none() {
                    sum += scale * energies.energy(Light::of(record, extras, &[], lights.time));
                }
                if let Some(vertices) = &change.vertices {
                    let mut moved = *record;
                    vertices.give(i, &mut moved);
                    sum += scale
                        * energies.energy(match vertices.end.get(i) {
                            Some(end) => Light::Moving(MovingTriangle::between(&moved, end)),
                            None => Light::Triangle(&moved),
                        });
                }
            }
        }
        let first = first_object(records(&lights.instances).len()) as u32;
        for InstanceChange { record, end, .. } in instances.values().flatten() {
            let record = InstanceRecord { object: first + record.object, ..*record };
            let placed = PlacedObject::new(&record, &lights.instances).moving_to(end.as_ref());
            sum += energies.energy(Light::Instance(placed));
        }
        sum
    }
}
