//! Lights that move or change their brightness, in a tree whose shape stays.

use glam::Vec3;

use super::energy::{Energies, Scales, storable};
use super::lights::{LightSampler, NO_AREA};
use super::mesh::check_triangles;
use crate::blas;
use crate::error::{Error, Kind};
use crate::geometry::Triangle;

/// A change of a mesh that is in a sampler already.
#[derive(Clone, Copy, Debug)]
pub struct MeshUpdate<'a> {
    mesh: u32,
    triangles: Option<(&'a [Vec3], &'a [[u32; 3]])>,
    scale: Option<f32>,
}

impl<'a> MeshUpdate<'a> {
    /// No change yet of the mesh with this number.
    pub const fn new(mesh: u32) -> Self {
        Self { mesh, triangles: None, scale: None }
    }

    /// Moves the vertices. There must be as many triangles as the mesh was added with, in the same order; they keep
    /// their texture coordinates.
    #[must_use]
    pub const fn moved(mut self, positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        self.triangles = Some((positions, indices));
        self
    }

    /// Multiplies the weights that the mesh was added with: 1 restores them, whatever was set before, and 0 switches
    /// the mesh off.
    #[must_use]
    pub const fn scaled(mut self, factor: f32) -> Self {
        self.scale = Some(factor);
        self
    }
}

impl<const N: usize> LightSampler<N> {
    /// Applies changes of meshes without building anew. The tree keeps its shape and gets new bounds: sampling stays
    /// exact, but gets noisier the more lights have moved in relation to each other; [`Self::decay`] tells when a new
    /// build is worth its time. Takes time in proportion to all lights, however few have changed.
    ///
    /// A triangle whose area or weight has become zero is never sampled, and comes back if it becomes positive again.
    /// What sent nothing when the sampler was built is not in it: black triangles stay black, and one that had no area
    /// must not get any.
    ///
    /// After an error the sampler is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such mesh, it had another number of triangles, a vertex is not finite or has a coordinate above
    /// 1e9, an index has no vertex, a factor or a weight multiplied by it is NaN, negative or above 1e30, or a triangle
    /// without area has become one with an area.
    pub fn refit(&mut self, updates: &[MeshUpdate<'_>]) -> Result<(), Error> {
        updates.iter().try_for_each(|update| self.check(update))?;
        updates.iter().for_each(|update| self.apply(update));
        self.fit();
        Ok(())
    }

    /// Cost of the tree in relation to what it was when it was built, by the surface area orientation heuristic: 1 after
    /// the build, and after a motion of everything as a whole. At 1.5 samples are noisier by about a third than those of a
    /// new build, at 2 by about a factor of two: build anew somewhere there.
    pub fn decay(&self) -> f32 {
        (self.cost / self.cost_at_build) as f32
    }

    /// Gives the tree the bounds of the triangles as they are.
    pub(super) fn fit(&mut self) {
        let scales = Scales { factors: &self.scales, meshes: &self.meshes };
        let energies = Energies::new(&self.environment, scales);
        let total = energies.total(&self.triangles);
        self.cost = self.tlas.fit(&|leaf| energies.bounds(&self.triangles[leaf as usize], total));
        self.energy = storable(total);
    }

    /// Where the triangles of a mesh are in `leaves`.
    fn places(&self, mesh: u32) -> core::ops::Range<usize> {
        self.meshes[mesh as usize] as usize..self.meshes[mesh as usize + 1] as usize
    }

    fn check(&self, update: &MeshUpdate<'_>) -> Result<(), Error> {
        let (mesh, meshes) = (update.mesh as usize, self.meshes.len() - 1);
        if mesh >= meshes {
            return Err(Error(Kind::UnknownMesh { mesh, meshes }));
        }
        let leaves = &self.leaves[self.places(update.mesh)];
        if let Some((positions, indices)) = update.triangles {
            if indices.len() != leaves.len() {
                return Err(Error(Kind::TriangleCount { mesh, found: indices.len(), expected: leaves.len() }));
            }
            check_triangles(mesh, positions, indices)?;
            let revived = |&(&leaf, indices): &(&u32, &[u32; 3])| {
                leaf == NO_AREA && triangle(positions, *indices).normal_and_area().is_some()
            };
            if let Some(triangle) = leaves.iter().zip(indices).position(|pair| revived(&pair)) {
                return Err(Error(Kind::Revived { mesh, triangle }));
            }
        }
        let Some(scale) = update.scale else { return Ok(()) };
        let average = |leaf: &u32| self.triangles.get(*leaf as usize).map_or(0.0, |light| light.root.average);
        let brightest = leaves.iter().map(average).fold(1.0, f32::max);
        match [scale, scale * brightest].into_iter().find(|value| !(0.0..=blas::MAX_AVERAGE).contains(value)) {
            Some(value) => Err(Error(Kind::Weight { mesh, value, limit: blas::MAX_AVERAGE })),
            None => Ok(()),
        }
    }

    fn apply(&mut self, update: &MeshUpdate<'_>) {
        let places = self.places(update.mesh);
        if let Some((positions, indices)) = update.triangles {
            for (&leaf, &indices) in self.leaves[places].iter().zip(indices) {
                if let Some(light) = self.triangles.get_mut(leaf as usize) {
                    light.vertices = triangle(positions, indices).0.map(Vec3::into);
                }
            }
        }
        if let Some(scale) = update.scale {
            if self.scales.is_empty() {
                self.scales.resize(self.meshes.len() - 1, 1.0);
            }
            self.scales[update.mesh as usize] = scale;
        }
    }
}

fn triangle(positions: &[Vec3], indices: [u32; 3]) -> Triangle {
    Triangle(indices.map(|index| positions[index as usize]))
}
