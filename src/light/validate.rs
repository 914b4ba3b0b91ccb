//! Checks of lights that come from outside.

use alloc::vec::Vec;

use super::{LightKind, LightsView, NO_AREA};
use crate::blas;
use crate::error::Error;

impl LightsView<'_> {
    /// Checks that no lookup can leave a buffer, go around in circles or meet a number that is not finite.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        blas::validate(self.cells)?;
        let roots: Vec<blas::Root> = self.triangles.iter().map(|triangle| triangle.root).collect();
        blas::validate_roots(&roots, self.cells)?;
        self.validate_leaves()?;
        Error::unless_equal("start of the first mesh", self.meshes.first().map_or(0, |&start| start as usize), 0)?;
        let bad_mesh = self.meshes.windows(2).position(|pair| pair[0] > pair[1]);
        bad_mesh.map_or(Ok(()), |i| Err(Error::bytes("start of mesh", i, self.meshes[i], self.meshes[i + 1])))?;
        if !self.scales.is_empty() {
            Error::unless_equal("number of scales", self.scales.len() + 1, self.meshes.len())?;
        }
        let bad_scale = self.scales.iter().position(|scale| !(0.0..=blas::MAX_AVERAGE).contains(scale));
        bad_scale.map_or(Ok(()), |i| Err(Error::bytes("scale of mesh", i, self.scales[i].to_bits(), 0u64)))?;
        let end = self.meshes.last().map_or(usize::MAX, |&end| end as usize);
        Error::unless_equal("end of the meshes", end, self.leaf_of.len())
    }

    /// Checks that leaves and triangles refer to each other, so that the density of a sample is looked up under the id that
    /// the sample came with.
    fn validate_leaves(&self) -> Result<(), Error> {
        for (i, triangle) in self.triangles.iter().enumerate() {
            let leaf = self.leaf_of.get(triangle.index() as usize);
            if !triangle.is_valid() || leaf.is_none_or(|&leaf| leaf as usize != i) {
                return Err(Error::bytes("triangle", i, triangle.index(), self.leaf_of.len()));
            }
        }
        for (index, &leaf) in self.leaf_of.iter().enumerate().filter(|(_, leaf)| **leaf < NO_AREA) {
            if self.triangles.get(leaf as usize).is_none_or(|triangle| triangle.index() as usize != index) {
                return Err(Error::bytes("leaf of triangle", index, leaf, self.triangles.len()));
            }
        }
        Ok(())
    }
}
