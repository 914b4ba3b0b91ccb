//! Checks of lights that come from outside.

use alloc::vec::Vec;

use super::{LAMP, Light, LightsView, NO_AREA};
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
        if end <= self.leaf_of.len() {
            Ok(())
        } else {
            Err(Error::bytes("end of the meshes", 0, end, self.leaf_of.len()))
        }
    }

    /// Checks that the places are those of all triangles and lamps, each kind in its own order.
    fn validate_places(&self) -> Result<(), Error> {
        let expected = if self.has_lamps() { self.len() } else { 0 };
        Error::unless_equal("number of places", self.places.len(), expected)?;
        let (mut triangles, mut lamps) = (0, 0);
        for (leaf, &place) in self.places.iter().enumerate() {
            let next = if place & LAMP == 0 { &mut triangles } else { &mut lamps };
            if place & !LAMP != *next {
                return Err(Error::bytes("place of leaf", leaf, place, *next));
            }
            *next += 1;
        }
        if self.has_lamps() {
            Error::unless_equal("number of lamps", lamps as usize, self.lamps.len())?;
        }
        Ok(())
    }

    /// Checks that leaves and lights refer to each other, so that the density of a sample is looked up under the id that
    /// the sample came with.
    fn validate_leaves(&self) -> Result<(), Error> {
        self.validate_places()?;
        let lamp_start = self.meshes.last().copied().unwrap_or(0);
        // The number of a light among all that were added, if it is valid.
        let index = |leaf: u32| match self.light(leaf) {
            Light::Triangle(triangle) => {
                Some(triangle.index()).filter(|&index| triangle.is_valid() && index < lamp_start)
            }
            Light::Lamp(lamp) => lamp_start.checked_add(lamp.number).filter(|_| lamp.is_valid()),
        };
        for leaf in 0..self.len() as u32 {
            if index(leaf).and_then(|index| self.leaf_of.get(index as usize)) != Some(&leaf) {
                return Err(Error::bytes("triangle or lamp", leaf as usize, 0, self.leaf_of.len()));
            }
        }
        for (i, &leaf) in self.leaf_of.iter().enumerate().filter(|(_, leaf)| **leaf < NO_AREA) {
            if leaf as usize >= self.len() || index(leaf).is_none_or(|index| index as usize != i) {
                return Err(Error::bytes("leaf of triangle or lamp", i, leaf, self.len()));
            }
        }
        Ok(())
    }
}
