//! Objects on their way into a sampler.

use alloc::vec;
use alloc::vec::Vec;

use glam::Vec3;

use super::object::ObjectParts;
use crate::error::{Error, ErrorKind};
use crate::light::{Energies, Light, LightTriangle, NO_LEAF};
use crate::parallel;
use crate::progress::Progress;
use crate::tlas::{self, Arity};

/// The meshes of an object before there is a tree over them: what the collection keeps of meshes that stand alone.
pub(in crate::light) struct AddedObject {
    pub(in crate::light) triangles: Vec<LightTriangle>,
    pub(in crate::light) indices: Vec<u32>,
    pub(in crate::light) meshes: Vec<u32>,
    /// Triangles that wait for trees over images.
    pub(in crate::light) pending: Vec<(u32, u32)>,
    /// Corners of the box around all vertices.
    pub(super) corners: [Vec3; 2],
}

impl AddedObject {
    pub(super) fn empty() -> Self {
        Self {
            triangles: Vec::new(),
            indices: Vec::new(),
            meshes: vec![0],
            pending: Vec::new(),
            corners: [Vec3::ZERO; 2],
        }
    }

    /// Appends the words of the object, if there is a number for each of them. Returns its first word.
    pub(super) fn build(
        &self,
        arity: Arity,
        energies: &Energies<'_>,
        progress: &Progress<'_>,
        words: &mut Vec<u32>,
    ) -> Result<u32, Error> {
        let emits = |index: &u32| energies.energy(Light::Triangle(&self.triangles[*index as usize])) > 0.0;
        let emitting: Vec<u32> = (0..self.triangles.len() as u32).filter(emits).collect();
        let light = |i: usize| Light::Triangle(&self.triangles[emitting[i] as usize]);
        let total = parallel::sum(emitting.len(), |i| energies.energy(light(i)));
        let all = parallel::collect(emitting.len(), |i| energies.bounds(light(i), total));
        let (mut tree, order) = tlas::build_in_groups(arity, emitting.len(), &|i| all[i as usize].0, &[], progress)?;
        let bounds = parallel::collect(order.len(), |leaf| all[order[leaf] as usize]);
        tree.fit(&|leaf| bounds[leaf as usize]);
        let mut leaf_of_triangle = vec![NO_LEAF; self.triangles.len()];
        for (leaf, &i) in (0..).zip(&order) {
            leaf_of_triangle[emitting[i as usize] as usize] = leaf;
        }
        let leaf_of = |index: &u32| leaf_of_triangle.get(*index as usize).copied().unwrap_or(*index);
        let leaf_of: Vec<u32> = self.indices.iter().map(leaf_of).collect();
        let records: Vec<LightTriangle> =
            order.iter().map(|&i| self.triangles[emitting[i as usize] as usize]).collect();
        let parts =
            ObjectParts { tree: &tree, records: &records, meshes: &self.meshes, leaf_of: &leaf_of, bounds: &bounds };
        let start = words.len();
        let too_many = || ErrorKind::TooMany { what: "words of objects", count: start, limit: u32::MAX as usize };
        parts.append(words).ok_or_else(|| Error(too_many()))?;
        Ok(start as u32)
    }
}
