//! Lights that move or change their brightness.

use alloc::vec::Vec;

use glam::Vec3;

use super::distant;
use super::distant_record::DistantRecord;
use super::extras;
use super::mesh::{MeshUpdate, check_end, check_triangles};
use super::motion::{end_vertices, has_area_between};
use super::{Lamp, LampRecord, Lights, NO_AREA};
use crate::blas;
use crate::error::{Error, ErrorKind};
use crate::geometry::Triangle;
use crate::record::LightId;

impl Lights {
    /// Applies updates, or none of them if one is invalid.
    pub(crate) fn update(&mut self, updates: &[MeshUpdate<'_>]) -> Result<(), Error> {
        updates.iter().try_for_each(|update| self.check(update))?;
        updates.iter().for_each(|update| self.apply(update));
        self.update_ends(updates);
        Ok(())
    }

    /// Replaces lamps by others, or none of them if one is invalid.
    pub(crate) fn update_lamps(&mut self, updates: &[(LightId, Lamp)]) -> Result<(), Error> {
        let first = self.meshes.last().map_or(0, |&end| end as usize);
        let count = self.leaf_of.len() - first;
        let replace = |&(LightId(light), lamp): &(LightId, Lamp)| {
            let light = light as usize;
            let &leaf =
                self.leaf_of[first..].get(light).ok_or(Error(ErrorKind::UnknownLight { light, lights: count }))?;
            let record = lamp.record(light as u32)?;
            self.view().extras().profiles().check(record.number(), record.profile())?;
            let is_distant = self.view().extras().distant_of(LightId(light as u32)).is_some();
            match self.records.get(leaf as usize) {
                _ if is_distant != matches!(lamp, Lamp::Distant(_)) && (is_distant || leaf < NO_AREA) => {
                    Err(Error(ErrorKind::DistantReplaced { light }))
                }
                None if record.weight() > 0.0 && !is_distant => Err(Error(ErrorKind::RevivedLight { light })),
                _ => Ok((leaf, record)),
            }
        };
        let replaced: Vec<(u32, LampRecord)> = updates.iter().map(replace).collect::<Result<_, _>>()?;
        self.update_distants(&replaced);
        for (leaf, record) in replaced {
            if let Some(place) = self.records.get_mut(leaf as usize) {
                *place = record.into_triangle();
            }
        }
        Ok(())
    }

    /// Replaces those distant lights that are among these.
    fn update_distants(&mut self, replaced: &[(u32, LampRecord)]) {
        let extras = self.view().extras();
        if extras.distants().is_empty() {
            return;
        }
        let mut distants = extras.distants().to_vec();
        for (_, record) in replaced {
            if let (Some(light), Some(place)) = (record.distant(), extras.distant_of(LightId(record.number()))) {
                distants[place] = DistantRecord::new(&light, record.number(), distants[place].groups);
            }
        }
        let groups = distant::groups_of(&distants);
        extras::replace_distants(&mut self.extras, &distants, &groups);
    }

    /// Where the triangles of a mesh are in `leaf_of`.
    fn range(&self, mesh: usize) -> core::ops::Range<usize> {
        self.meshes[mesh] as usize..self.meshes[mesh + 1] as usize
    }

    fn check(&self, update: &MeshUpdate<'_>) -> Result<(), Error> {
        let (mesh, meshes) = (update.mesh.0 as usize, self.meshes.len() - 1);
        if mesh >= meshes {
            return Err(Error(ErrorKind::UnknownMesh { mesh, meshes }));
        }
        let leaves = &self.leaf_of[self.range(mesh)];
        check_vertices(update, leaves)?;
        let Some(scale) = update.scale else { return Ok(()) };
        let average = |leaf: &u32| self.records.get(*leaf as usize).map_or(0.0, |light| light.root.average);
        let brightest = leaves.iter().map(average).fold(1.0, f32::max);
        match [scale, scale * brightest].into_iter().find(|value| !(0.0..=blas::MAX_AVERAGE).contains(value)) {
            Some(value) => Err(Error(ErrorKind::Weight { mesh, value, limit: blas::MAX_AVERAGE })),
            None => Ok(()),
        }
    }

    /// Sets where the vertices of changed meshes are at the end of the shutter interval.
    fn update_ends(&mut self, updates: &[MeshUpdate<'_>]) {
        if self.view().extras().motion().is_empty() && updates.iter().all(|update| update.end.is_none()) {
            return;
        }
        let ends = |update: &MeshUpdate<'_>| {
            let (positions, indices) = update.triangles.filter(|(_, indices)| !indices.is_empty())?;
            let end = update.end.filter(|end| *end != positions);
            let ends = end.map_or_else(Vec::new, |end| end_vertices(end, indices));
            Some((self.meshes[update.mesh.0 as usize], ends))
        };
        let changed: Vec<_> = updates.iter().filter_map(ends).collect();
        self.update_motion(|motion| changed.into_iter().for_each(|(first, ends)| motion.set_mesh(first, ends)));
    }

    fn apply(&mut self, update: &MeshUpdate<'_>) {
        let mesh = update.mesh.0 as usize;
        let range = self.range(mesh);
        if let Some((positions, indices)) = update.triangles {
            for (&leaf, &indices) in self.leaf_of[range].iter().zip(indices) {
                if let Some(light) = self.records.get_mut(leaf as usize) {
                    light.vertices = Triangle::of(positions, indices).0.map(Vec3::into);
                    let end = update.end.map(|end| Triangle::of(end, indices).0.map(Vec3::into));
                    light.mark_motion(end.as_ref());
                }
            }
        }
        if let Some(scale) = update.scale {
            if self.scales.is_empty() {
                self.scales.resize(self.meshes.len() - 1, 1.0);
            }
            self.scales[mesh] = scale;
        }
    }
}

/// Checks the vertices of an update, if it has any. `leaves` says which triangles of the mesh have no area.
pub(super) fn check_vertices(update: &MeshUpdate<'_>, leaves: &[u32]) -> Result<(), Error> {
    let Some((positions, indices)) = update.triangles else { return Ok(()) };
    let mesh = update.mesh.0 as usize;
    if indices.len() != leaves.len() {
        return Err(Error(ErrorKind::TriangleCount { mesh, found: indices.len(), expected: leaves.len() }));
    }
    check_triangles(mesh, positions, indices)?;
    update.end.map_or(Ok(()), |end| check_end(mesh, positions.len(), end))?;
    let has_area = |&indices: &[u32; 3]| match update.end {
        None => Triangle::of(positions, indices).normal_and_area().is_some(),
        Some(end) => has_area_between(positions, end, indices),
    };
    let is_revived = |(leaf, indices): (&u32, &[u32; 3])| *leaf == NO_AREA && has_area(indices);
    match leaves.iter().zip(indices).position(is_revived) {
        Some(triangle) => Err(Error(ErrorKind::Revived { mesh, triangle })),
        None => Ok(()),
    }
}
