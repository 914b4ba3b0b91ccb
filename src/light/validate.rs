//! Checks of lights that come from outside.

use alloc::vec::Vec;

use super::{Extras, Light, LightsView, NO_AREA, distant};
use crate::blas;
use crate::error::Error;

impl LightsView<'_> {
    /// Checks that no lookup can leave a buffer, go around in circles or meet a number that is not finite.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        blas::validate(self.cells)?;
        // Before any record is taken for that of an instance.
        self.validate_instances()?;
        let is_instance = |&(leaf, number): &(u32, u32)| self.is_instance_at(number, leaf);
        let instances = || (0..).zip(self.records).filter_map(|(leaf, record)| Some((leaf, record.instance()?)));
        if let Some((leaf, number)) = instances().find(|instance| !is_instance(instance)) {
            return Err(Error::bytes("instance of a leaf", leaf as usize, number, self.instances.len()));
        }
        let triangle = |record| Light::of(record, Extras::NONE, self.instances, 0.0).triangle();
        let roots: Vec<blas::Root> = self.records.iter().filter_map(triangle).map(|triangle| triangle.root).collect();
        let lamps = self.records.len() - roots.len() - instances().count();
        Error::unless_equal("mark of lamps", self.has_lamps.into(), (lamps > 0).into())?;
        blas::validate_roots(&roots, self.cells)?;
        self.validate_leaves()?;
        self.extras().validate(self.len(), distant::validate)?;
        let count = self.extras().profiles().count();
        let lamps =
            self.records.iter().filter_map(|record| match Light::of(record, Extras::NONE, self.instances, 0.0) {
                Light::Lamp(lamp) => lamp.record.profile(),
                Light::Triangle(_) | Light::Instance(_) | Light::Moving(_) => None,
            });
        for profile in lamps {
            if profile as usize >= count {
                return Err(Error::bytes("profile of a light", 0, profile, count));
            }
        }
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

    /// Checks that leaves and lights refer to each other, so that the density of a sample is looked up under the id
    /// that the sample came with.
    fn validate_leaves(&self) -> Result<(), Error> {
        let lamp_start = self.meshes.last().copied().unwrap_or(0);
        // The number of a light among all that were added, if it is valid.
        let index = |leaf: u32| match self.light(leaf) {
            Light::Triangle(triangle) => {
                Some(triangle.index()).filter(|&index| triangle.is_valid() && index < lamp_start)
            }
            Light::Lamp(lamp) => lamp_start.checked_add(lamp.record.number()).filter(|_| lamp.record.is_valid()),
            Light::Moving(moving) => {
                let triangle = moving.record;
                Some(triangle.index()).filter(|&index| triangle.is_valid() && index < lamp_start)
            }
            Light::Instance(_) => None,
        };
        let is_single = |&leaf: &u32| self.instance(leaf).is_none();
        for leaf in (0..self.len() as u32).filter(is_single) {
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
