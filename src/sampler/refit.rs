//! Lights that move or change their brightness, in a tree whose shape stays.

use super::lights::LightSampler;
use crate::bounds::storable;
use crate::error::Error;
use crate::light::{Energies, Instance, Lamp, MeshUpdate};
use crate::record::{InstanceId, LightId};

impl LightSampler {
    /// Applies changes of meshes without a rebuild.
    ///
    /// The tree keeps its shape and gets new bounds. Sampling stays exact, but gets noisier the more lights have moved
    /// in relation to each other; [`Self::decay`] shows when a rebuild pays. Takes time in proportion to the number of
    /// all lights, however few have changed.
    ///
    /// A triangle whose area or weight has become zero is never sampled, and comes back if it becomes positive again.
    /// What emitted nothing when the sampler was built is not in it: black triangles stay black, and a triangle that
    /// had no area must not get any.
    ///
    /// A sampler that has been [edited](Self::edit) edits this as well.
    ///
    /// After an error the sampler is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such mesh, it had another number of triangles, a vertex is not finite or has a coordinate above
    /// 1e9, there are not as many vertices at the end of the shutter interval, an index has no vertex, a factor or a
    /// weight multiplied by it is NaN, negative or above 1e30, or a triangle without area has become one with an area.
    pub fn refit(&mut self, updates: &[MeshUpdate<'_>]) -> Result<(), Error> {
        if self.edits.is_some() {
            let mut edits = self.edit();
            updates.iter().try_for_each(|update| edits.update_mesh(update))?;
            return edits.apply();
        }
        self.lights.update(updates)?;
        self.fit();
        Ok(())
    }

    /// Replaces lights that are not made of triangles, without a rebuild: by lights that have moved, have another
    /// brightness or are of another kind. [`Self::refit`] describes the effect on samples and time.
    ///
    /// A light of a radiance or intensity of zero is never sampled, and comes back if it is replaced again.
    ///
    /// After an error the sampler is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such light, [`add_light`](crate::LightSamplerBuilder::add_light) would refuse the new one, it
    /// emits and the light that was added emitted nothing, or one of both is a [`DistantLight`](crate::DistantLight)
    /// and the other is not.
    pub fn refit_lights(&mut self, updates: &[(LightId, Lamp)]) -> Result<(), Error> {
        if self.edits.is_some() {
            let mut edits = self.edit();
            updates.iter().try_for_each(|&(id, light)| edits.set_light(id, light))?;
            return edits.apply();
        }
        self.lights.update_lamps(updates)?;
        self.fit();
        Ok(())
    }

    /// Replaces instances, without a rebuild and without a look at their meshes: by instances of the same objects that
    /// are at other places or have other factors. What holds of [`Self::refit`] holds of this; the time is in
    /// proportion to the number of instances, meshes and other lights, and not to that of the triangles in objects.
    ///
    /// An instance with a factor of 0 is never sampled, and comes back if it is replaced again.
    ///
    /// After an error the sampler is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such instance, it was one of another object, or
    /// [`add_instance`](crate::LightSamplerBuilder::add_instance) would refuse the new one.
    pub fn refit_instances(&mut self, updates: &[(InstanceId, Instance)]) -> Result<(), Error> {
        if self.edits.is_some() {
            let mut edits = self.edit();
            updates.iter().try_for_each(|(id, instance)| edits.replace_instance(*id, instance))?;
            return edits.apply();
        }
        self.lights.update_instances(updates)?;
        self.fit();
        Ok(())
    }

    /// Returns the cost of the tree in relation to its cost when it was built, by the surface area orientation
    /// heuristic.
    ///
    /// The result is 1 after the build, and after a motion of everything as a whole. At 1.5 samples are noisier by
    /// about a third than those of a new build, at 2 by about a factor of two: rebuild somewhere in between.
    /// [Edits](Self::edit) build parts of the tree again by themselves; when they have built all of it, the result is 1
    /// again.
    #[must_use]
    pub fn decay(&self) -> f32 {
        (self.cost / self.cost_at_build) as f32
    }

    /// Gives the tree the bounds of the lights as they are.
    pub(super) fn fit(&mut self) {
        let lights = self.lights.view();
        let energies = Energies::new(&self.environment, lights.scales, lights.meshes);
        let total = energies.total(lights.len(), |leaf| lights.light(leaf as u32));
        self.cost = self.tlas.fit(&|leaf| energies.bounds(lights.light(leaf), total));
        self.lights.energy = storable(total);
        self.lights.find_crossings();
    }
}
