//! Lights that are added, removed, moved and recolored in a finished sampler.

use core::fmt;

use super::lights::LightSampler;
use crate::blas::{Procedural, Texture};
use crate::error::Error;
use crate::light::{EditState, Edited, Instance, Lamp, LightChanges, Mesh, MeshUpdate};
use crate::receiver::ALL_GROUPS;
use crate::record::{InstanceId, LightId, MeshId, TextureId};

/// Edits of a [`LightSampler`], made by [`LightSampler::edit`]: lights, meshes and instances that are added, removed,
/// moved, recolored or hidden between two frames.
///
/// What moves while the shutter is open ([`Mesh::moving_to`], [`MeshUpdate::moving`], [`Instance::moving_to`]) comes,
/// goes and changes like what stands still, and edits begin and end motion.
///
/// Edits are checked one by one, as they are made, and take effect all together in [`Self::apply`]. Each counts for
/// those after it: what was removed is unknown from then on, and what was added can be changed. Without a call of
/// `apply` nothing changes.
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{LightSampler, PointLight, SphereLight};
///
/// let mut builder = LightSampler::builder();
/// let bulb = builder.add_light(SphereLight::new(Vec3::new(0.0, 0.0, 2.0), 0.1, 50.0))?;
/// let mut lights = builder.build()?;
///
/// let mut edits = lights.edit();
/// let spark = edits.add_light(PointLight::new(Vec3::new(1.0, 0.0, 1.0), 3.0))?;
/// edits.set_light(bulb, SphereLight::new(Vec3::new(0.0, 0.5, 2.0), 0.1, 40.0))?;
/// edits.apply()?;
/// assert_eq!(lights.light_count(), 2);
///
/// let mut edits = lights.edit();
/// edits.remove_light(spark)?;
/// assert!(edits.remove_light(spark).is_err());
/// edits.apply()?;
/// assert_eq!(lights.light_count(), 1);
/// # Ok::<(), fanlight::Error>(())
/// ```
///
/// # Numbers
///
/// The number of what was removed is free, and later batches give it to what they add. So an id of something removed
/// must not be used after the batch that removed it. Within that batch it is an error.
///
/// # What needs a new build
///
/// Some of what a builder is told stays what it is, and another sampler has to be built to change it:
///
/// - Objects: instances are of those that were added with
///   [`add_object`](crate::LightSamplerBuilder::add_object). An object need not have an instance when the sampler is
///   built.
/// - Profiles and projections: lights refer to those that were added with
///   [`add_profile`](crate::LightSamplerBuilder::add_profile) and
///   [`add_projection`](crate::LightSamplerBuilder::add_projection).
/// - The environment and its light groups. Its rotation is changed by
///   [`set_environment_rotation`](LightSampler::set_environment_rotation).
/// - The arity and the illumination that the sampler was built for.
///
/// The triangles, texture, sides and light groups of a mesh stay the same as well, and so do the light groups of a light
/// that is not made of triangles. To change them, remove it and add another one: that may be in one batch.
///
/// # Time and memory
///
/// An edit takes a time in proportion to the depth of the light tree, and edits of one part of a tree share most of it.
/// Parts of the tree that were edited often are built again; over many edits, that adds a share of the time of a build
/// to each. Some edits take longer:
///
/// - The first batch of a sampler takes about the time of a [`refit`](LightSampler::refit).
/// - A textured mesh takes the time to build its trees, as in the builder.
/// - A batch that edits lights that are not made of triangles takes a time in proportion to the number of all
///   [`DistantLight`](crate::DistantLight)s.
/// - A batch that adds, replaces or removes instances that move, or adds, moves or removes meshes that do, takes a time
///   in proportion to the number of all that move.
/// - A change of a mesh takes a time in proportion to the number of its triangles.
///
/// Places of what was removed are used again, so that memory is bounded by what a sampler has held at a time, however
/// many edits there are. A sampler that is edited takes about 15 bytes more for each light, and up to half as much
/// again for free places.
///
/// # Exactness
///
/// After every batch all densities are as exact as those of a new build, and so are all proofs of darkness. The tree
/// has another shape than that of a new build, so samples differ. Equal edits of equal samplers give equal samples.
///
/// A [`Visibility`](crate::Visibility) that was learned before an edit belongs to another tree.
#[must_use]
pub struct LightEdits<'s, 'a> {
    state: &'s mut EditState,
    edited: Edited<'s>,
    /// Cost of the tree, and as it was built.
    costs: [&'s mut f64; 2],
    changes: LightChanges<'a>,
}

impl fmt::Debug for LightEdits<'_, '_> {
    /// Shows the numbers of edited lights, meshes and instances.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [lights, meshes, instances] = self.changes.counts();
        f.debug_struct("LightEdits")
            .field("lights", &lights)
            .field("meshes", &meshes)
            .field("instances", &instances)
            .finish()
    }
}

impl LightSampler {
    /// Begins a batch of edits: see [`LightEdits`].
    ///
    /// Sampling reads and edits write, so nothing can sample meanwhile. A host that does not want to wait edits a
    /// clone, or builds another sampler, while the current one is sampled. Samplers can be sent to another thread and
    /// back:
    ///
    /// ```
    /// use std::sync::Arc;
    ///
    /// use fanlight::glam::Vec3;
    /// use fanlight::{LightId, LightSampler, PointLight, ShadingPoint};
    ///
    /// let light = PointLight::new(Vec3::Z, 1.0);
    /// let mut current = Arc::new(LightSampler::builder().light(light)?.build()?);
    ///
    /// let mut next = (*current).clone();
    /// let edited = std::thread::spawn(move || {
    ///     let mut edits = next.edit();
    ///     edits.set_light(LightId::from_index(0), PointLight::new(Vec3::Z, 2.0))?;
    ///     edits.apply().map(|()| next)
    /// });
    /// // Meanwhile all threads sample the current one.
    /// let floor = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    /// assert!(current.at(&floor).sample([0.1, 0.2, 0.3]).is_some());
    /// // Between two frames.
    /// current = Arc::new(edited.join().expect("edits do not panic")?);
    /// # assert!(current.at(&floor).sample([0.1, 0.2, 0.3]).is_some());
    /// # Ok::<(), fanlight::Error>(())
    /// ```
    pub fn edit<'a>(&mut self) -> LightEdits<'_, 'a> {
        let Self { tlas, lights, environment, cost, cost_at_build, arity, unplaced, edits, .. } = self;
        let state = edits.get_or_insert_with(|| EditState::new(lights, tlas, environment, core::mem::take(unplaced)));
        let changes = LightChanges::new(state);
        let edited = Edited { lights, tlas, environment, arity: *arity };
        LightEdits { state, edited, costs: [cost, cost_at_build], changes }
    }
}

impl<'a> LightEdits<'_, 'a> {
    /// Adds a light that is not made of triangles, as [`add_light`](crate::LightSamplerBuilder::add_light) of a builder
    /// does. After an error the batch is as it was before.
    ///
    /// # Errors
    ///
    /// As those of the builder's method.
    pub fn add_light(&mut self, light: impl Into<Lamp>) -> Result<LightId, Error> {
        self.add_light_to(ALL_GROUPS, light)
    }

    /// Adds a light that is not made of triangles to some light groups alone, as
    /// [`add_light_to`](crate::LightSamplerBuilder::add_light_to) of a builder does. After an error the batch is as it
    /// was before.
    ///
    /// The first light of a sampler that is not in all groups takes a time in proportion to the number of all lights.
    ///
    /// # Errors
    ///
    /// As those of the builder's method.
    pub fn add_light_to(&mut self, groups: u32, light: impl Into<Lamp>) -> Result<LightId, Error> {
        self.changes.add_lamp(self.edited.lights, self.state, light.into(), groups)
    }

    /// Replaces a light that is not made of triangles, by one that has moved, has another brightness or is of another
    /// kind. The light stays in its light groups. One of a radiance or intensity of zero is hidden: it is never
    /// sampled, and comes back if it is replaced again. After an error the batch is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such light, or [`Self::add_light`] would refuse the new one.
    pub fn set_light(&mut self, id: LightId, light: impl Into<Lamp>) -> Result<(), Error> {
        self.changes.set_lamp(self.edited.lights, self.state, id, light.into())
    }

    /// Removes a light that is not made of triangles.
    ///
    /// # Errors
    ///
    /// If there is no such light.
    pub fn remove_light(&mut self, id: LightId) -> Result<(), Error> {
        self.changes.remove_lamp(self.state, id)
    }

    /// Adds a texture that meshes of this batch can refer to. Its texels are read until the batch is applied. Textures
    /// of a batch are numbered from 0; those of a builder or of another batch are not known.
    pub fn add_texture(&mut self, texture: Texture<'a>) -> TextureId {
        self.changes.add_texture(texture)
    }

    /// Adds a function of texture coordinates that meshes of this batch can refer to like a texture.
    pub fn add_procedural(&mut self, function: &'a dyn Procedural) -> TextureId {
        self.changes.add_procedural(function)
    }

    /// Adds a mesh, as [`add_mesh`](crate::LightSamplerBuilder::add_mesh) of a builder does. Its texture is one of this
    /// batch. After an error the batch is as it was before.
    ///
    /// # Errors
    ///
    /// As those of the builder's method. Errors number the meshes of a batch from 0, in the order in which they are
    /// added.
    pub fn add_mesh(&mut self, mesh: &Mesh<'_>) -> Result<MeshId, Error> {
        self.changes.add_mesh(self.edited.lights, self.state, mesh)
    }

    /// Moves the vertices of a mesh or multiplies its weights, as [`refit`](LightSampler::refit) does. A factor of 0
    /// hides the mesh. After an error the batch is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such mesh, or as those of [`refit`](LightSampler::refit).
    pub fn update_mesh(&mut self, update: &MeshUpdate<'_>) -> Result<(), Error> {
        self.changes.update_mesh(self.edited.lights, self.state, update)
    }

    /// Removes a mesh.
    ///
    /// # Errors
    ///
    /// If there is no such mesh.
    pub fn remove_mesh(&mut self, id: MeshId) -> Result<(), Error> {
        self.changes.remove_mesh(self.state, id)
    }

    /// Adds an instance of an object that the sampler was built with, as
    /// [`add_instance`](crate::LightSamplerBuilder::add_instance) of a builder does. After an error the batch is as it
    /// was before.
    ///
    /// # Errors
    ///
    /// As those of the builder's method.
    pub fn add_instance(&mut self, instance: Instance) -> Result<InstanceId, Error> {
        self.changes.add_instance(self.edited.lights, self.state, &instance)
    }

    /// Replaces an instance: by one at another place, with another factor, in other light groups or of another object.
    /// A factor of 0 hides it. After an error the batch is as it was before.
    ///
    /// # Errors
    ///
    /// If there is no such instance, or [`Self::add_instance`] would refuse the new one.
    pub fn set_instance(&mut self, id: InstanceId, instance: Instance) -> Result<(), Error> {
        self.changes.set_instance(self.edited.lights, self.state, id, &instance, false)
    }

    /// Removes an instance.
    ///
    /// # Errors
    ///
    /// If there is no such instance.
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<(), Error> {
        self.changes.remove_instance(self.state, id)
    }

    /// Applies all edits of the batch. After an error the sampler is as it was before the batch.
    ///
    /// # Errors
    ///
    /// If there are more lights (2^27) or nodes of trees over textures than can be numbered, or a mesh that was added
    /// is multiplied by a factor that takes its texture above 1e30.
    pub fn apply(self) -> Result<(), Error> {
        let [cost, cost_at_build] = self.costs;
        let applied = self.state.apply(self.changes, self.edited)?;
        *cost = applied.cost;
        if applied.is_rebuilt {
            *cost_at_build = applied.cost;
        }
        Ok(())
    }

    /// Replaces an instance that stays in its light groups.
    pub(super) fn replace_instance(&mut self, id: InstanceId, instance: &Instance) -> Result<(), Error> {
        self.changes.set_instance(self.edited.lights, self.state, id, instance, true)
    }
}
