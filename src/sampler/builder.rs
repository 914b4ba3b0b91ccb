//! From a host's meshes, textures and environment to a sampler.

use core::fmt;
use core::ops::ControlFlow;

use super::lights::LightSampler;
use crate::blas::{Procedural, Texture};
use crate::env::{Environment, RegionMoments};
use crate::error::Error;
use crate::light::{Energies, Illumination, Instance, Lamp, LightCollection, Mesh, Profile, Projection, Unplaced};
use crate::parallel;
use crate::progress::{Progress, Report};
use crate::receiver::ALL_GROUPS;
use crate::record::{InstanceId, LightId, MeshId, ObjectId, ProfileId, TextureId};
use crate::tlas::{self, Arity};

/// Share of the time that lights take after which all of them have found their place; the rest is the collapse and the
/// bounds. Only shown to the host: chosen, not measured.
const PLACED: f64 = 0.9;

/// Collects the lights of a scene and builds a [`LightSampler`].
///
/// Everything is checked when it is added; what was accepted can always be sampled. The methods come in two forms:
/// those that take and return the builder are for one expression, those that begin with `add_` are for loops.
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{Arity, Environment, LightSampler, Mesh};
///
/// let positions = [[0.0, 0.0, 2.0], [0.0, 1.0, 2.0], [1.0, 0.0, 2.0]].map(Vec3::from);
/// let lights = LightSampler::builder()
///     .environment(Environment::constant(0.5)?)
///     .arity(Arity::Eight)
///     .mesh(&Mesh::portal(&positions, &[[0, 1, 2]]))?
///     .build()?;
///
/// let mut builder = LightSampler::builder();
/// for height in [2.0, 3.0] {
///     let lifted = positions.map(|p| p.with_z(height));
///     builder.add_mesh(&Mesh::emitter(&lifted, &[[0, 1, 2]]))?;
/// }
/// assert_eq!((lights.light_count(), builder.build()?.light_count()), (1, 2));
/// # Ok::<(), fanlight::Error>(())
/// ```
#[must_use]
pub struct LightSamplerBuilder<'a> {
    arity: Arity,
    environment: Option<Environment>,
    environment_as_light: bool,
    illumination: Illumination,
    collection: LightCollection<'a>,
}

impl LightSampler {
    /// Returns a builder without lights, whose environment is white.
    pub fn builder<'a>() -> LightSamplerBuilder<'a> {
        LightSamplerBuilder::new()
    }
}

impl fmt::Debug for LightSamplerBuilder<'_> {
    /// Shows the numbers of what has been added.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [textures, meshes, triangles, lights] = self.collection.counts();
        f.debug_struct("LightSamplerBuilder")
            .field("arity", &self.arity)
            .field("environment", &self.environment)
            .field("environment_as_light", &self.environment_as_light)
            .field("illumination", &self.illumination)
            .field("textures", &textures)
            .field("meshes", &meshes)
            .field("triangles", &triangles)
            .field("lights", &lights)
            .finish()
    }
}

impl Default for LightSamplerBuilder<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a> LightSamplerBuilder<'a> {
    /// Returns a builder without lights, whose environment is white.
    pub fn new() -> Self {
        Self {
            arity: Arity::default(),
            environment: None,
            environment_as_light: false,
            illumination: Illumination::default(),
            collection: LightCollection::new(),
        }
    }

    /// Sets what the portals show.
    pub fn environment(mut self, environment: Environment) -> Self {
        self.environment = Some(environment);
        self
    }

    /// Makes the environment one more light, next to all others: for scenes under the open sky, or with openings
    /// that nobody has marked as portals. Off by default.
    ///
    /// A sample then is a point of a triangle or a direction of the environment
    /// ([`SampledLight`](crate::SampledLight)), chosen by what each is estimated to send to the point. One call thus
    /// replaces [`PointSampler::sample`](crate::PointSampler::sample) and [`Environment::sample`], and a path vertex
    /// needs one shadow ray instead of two. The estimate knows of no walls: where all that is seen of the environment
    /// is seen through portals, leave this off. Where lamps are often hidden,
    /// [`sample_split`](crate::PointSampler::sample_split) without any splitting draws one of each, for a ray more.
    ///
    /// Without any other light, the environment is the only one. A black environment is not a light.
    pub fn environment_as_light(mut self) -> Self {
        self.environment_as_light = true;
        self
    }

    /// Sets the light groups that the environment is in, a set of bits, where it is a light; all by default. A portal
    /// shows the environment to those that see the portal, by the groups of the portal's own mesh.
    pub fn environment_groups(mut self, groups: u32) -> Self {
        self.collection.environment_groups = groups;
        self
    }

    /// Sets the arity of the tree over the lights, 16 by default.
    ///
    /// The wider the tree, the better its choices. On machines without AVX, 8 may be faster.
    pub fn arity(mut self, arity: Arity) -> Self {
        self.arity = arity;
        self
    }

    /// Sets the term that guides the descent inside a triangle.
    pub fn illumination(mut self, illumination: Illumination) -> Self {
        self.illumination = illumination;
        self
    }

    /// Adds a texture, in one expression. Textures and functions are numbered together, from 0.
    pub fn texture(mut self, texture: Texture<'a>) -> Self {
        self.add_texture(texture);
        self
    }

    /// Adds a function that takes the place of a texture, in one expression.
    pub fn procedural(mut self, function: &'a dyn Procedural) -> Self {
        self.add_procedural(function);
        self
    }

    /// Adds a mesh, in one expression. Meshes are numbered from 0.
    ///
    /// # Errors
    ///
    /// As [`Self::add_mesh`].
    pub fn mesh(mut self, mesh: &Mesh<'_>) -> Result<Self, Error> {
        self.add_mesh(mesh)?;
        Ok(self)
    }

    /// Adds a light that is not made of triangles, in one expression. These lights are numbered from 0.
    ///
    /// # Errors
    ///
    /// As [`Self::add_light`].
    pub fn light(mut self, light: impl Into<Lamp>) -> Result<Self, Error> {
        self.add_light(light)?;
        Ok(self)
    }

    /// Adds a texture that meshes can refer to. Its texels are read until the builder is built.
    pub fn add_texture(&mut self, texture: Texture<'a>) -> TextureId {
        self.collection.add_texture(texture)
    }

    /// Adds a function of texture coordinates that meshes can refer to like a texture. [`Self::add_mesh`] evaluates it.
    pub fn add_procedural(&mut self, function: &'a dyn Procedural) -> TextureId {
        self.collection.add_procedural(function)
    }

    /// Adds a mesh. After an error the builder is as it was before.
    ///
    /// # Errors
    ///
    /// If a vertex is not finite or has a coordinate above 1e9, an index has no vertex, the weight is NaN, negative or
    /// above 1e30, or it is a texture of another builder or one without as many uvs as vertices; if the bounds of a
    /// [`Procedural`] are not finite, negative or in the wrong order, or its weight is not within them; or if a mesh
    /// that [moves](Mesh::moving_to) has another number of vertices at the end.
    pub fn add_mesh(&mut self, mesh: &Mesh<'_>) -> Result<MeshId, Error> {
        self.collection.add_mesh(mesh)
    }

    /// Adds a profile that [`ProfileLight`](crate::ProfileLight)s can refer to. After an error the builder is as it was
    /// before.
    ///
    /// # Errors
    ///
    /// If there are fewer than two vertical angles or no horizontal one, angles do not increase or are out of their
    /// ranges, or an intensity is negative, not finite or above 1e30, or missing.
    pub fn add_profile(&mut self, profile: &Profile<'_>) -> Result<ProfileId, Error> {
        self.collection.add_profile(profile)
    }

    /// Adds an image that [`ProfileLight`](crate::ProfileLight)s can project, in the place of a profile: both are
    /// numbered together. After an error the builder is as it was before.
    ///
    /// # Errors
    ///
    /// If the image has no texels, more than 2048 along an edge, or another number of intensities than its size says,
    /// an angle of view is out of its range, or an intensity is negative, not finite or above 1e30.
    pub fn add_projection(&mut self, projection: &Projection<'_>) -> Result<ProfileId, Error> {
        self.collection.add_projection(projection)
    }

    /// Adds a light that is not made of triangles: see [`Lamp`]. After an error the builder is as it was before.
    ///
    /// # Errors
    ///
    /// If a number is not finite, the light reaches beyond a coordinate of 1e9, a length is not positive, a radiance,
    /// an intensity or an irradiance is negative or above 1e30, or there is no such profile.
    pub fn add_light(&mut self, light: impl Into<Lamp>) -> Result<LightId, Error> {
        self.collection.add_lamp(light.into(), ALL_GROUPS)
    }

    /// Adds a light that is not made of triangles to some light groups alone, a set of bits, as [`Mesh::groups`] does
    /// for a mesh. The light stays in them when it is [replaced](LightSampler::refit_lights). After an error the
    /// builder is as it was before.
    ///
    /// # Errors
    ///
    /// As [`Self::add_light`].
    pub fn add_light_to(&mut self, groups: u32, light: impl Into<Lamp>) -> Result<LightId, Error> {
        self.collection.add_lamp(light.into(), groups)
    }

    /// Adds an object, in one expression. Objects are numbered from 0.
    ///
    /// # Errors
    ///
    /// As [`Self::add_object`].
    pub fn object(mut self, meshes: &[Mesh<'_>]) -> Result<Self, Error> {
        self.add_object(meshes)?;
        Ok(self)
    }

    /// Adds an instance, in one expression. Instances are numbered from 0.
    ///
    /// # Errors
    ///
    /// As [`Self::add_instance`].
    pub fn instance(mut self, instance: Instance) -> Result<Self, Error> {
        self.add_instance(instance)?;
        Ok(self)
    }

    /// Adds an object: meshes that send light only where an [`Instance`] places them. It is built once, with a light
    /// tree of its own, and each instance takes about 150 bytes, however many triangles it has. Within the object its
    /// meshes are numbered from 0, in the order in which they are given. After an error the builder is as it was
    /// before.
    ///
    /// # Errors
    ///
    /// If there is no triangle, [`Self::add_mesh`] would refuse one of the meshes, or one of them has
    /// [light groups](Mesh::groups) or [moves](Mesh::moving_to): an instance is in groups, and moves, as a whole.
    pub fn add_object(&mut self, meshes: &[Mesh<'_>]) -> Result<ObjectId, Error> {
        self.collection.add_object(meshes)
    }

    /// Adds an instance of an object that has been added. After an error the builder is as it was before.
    ///
    /// ```
    /// use fanlight::glam::{Affine3A, Vec3};
    /// use fanlight::{Hit, Instance, LightSampler, Mesh, ShadingPoint};
    ///
    /// let positions = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]].map(Vec3::from);
    /// let mut builder = LightSampler::builder();
    /// let lamp = builder.add_object(&[Mesh::emitter(&positions, &[[0, 1, 2]])])?;
    /// for i in 0..100 {
    ///     let place = Affine3A::from_translation(Vec3::new(3.0 * i as f32, 0.0, 2.0));
    ///     builder.add_instance(Instance::new(lamp, place).scaled(1.0 + i as f32))?;
    /// }
    /// let lights = builder.build()?;
    /// assert_eq!(lights.light_count(), 100);
    ///
    /// let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
    /// let sample = here.sample([0.3, 0.6, 0.1]).expect("lamps are above");
    /// let hit = sample.hit().expect("all lights are triangles");
    /// let instance = hit.instance.expect("all triangles are those of instances");
    /// assert_eq!(here.pdf(&Hit::on_instance(instance, hit.triangle, hit.barycentrics)), sample.pdf);
    /// # Ok::<(), fanlight::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// If there is no such object; if an element of the transform is not finite, its longest axis is more than 1e6
    /// times as long as its shortest, or a length is above 1e12 or below 1e-12, so that it cannot be inverted; if it
    /// moves a corner of the object's box to a coordinate above 1e9; if any of this holds at some time of an instance
    /// that [moves](Instance::moving_to); or if the factor of the weights is NaN, negative or above 1e30.
    pub fn add_instance(&mut self, instance: Instance) -> Result<InstanceId, Error> {
        self.collection.add_instance(&instance)
    }

    /// Builds the trees over textures and objects, and the tree over all lights that can emit.
    ///
    /// # Errors
    ///
    /// If there are more lights than the tree can number (2^28 - 1), or more cells of textures (2^34).
    pub fn build(self) -> Result<LightSampler, Error> {
        self.build_reporting(None)
    }

    /// Builds as [`Self::build`] does, for hosts that show progress or that need to be able to cancel.
    ///
    /// `report` is called with the share of the work that is done, in `[0, 1]`, and last with 1;
    /// [`ControlFlow::Break`] cancels the build. With the feature `rayon` the calls come from the threads that build,
    /// several at once and not always in order.
    ///
    /// # Errors
    ///
    /// As [`Self::build`], and if `report` has canceled the build: then [`Error::is_cancelled`] is true.
    pub fn build_with(self, report: impl Fn(f32) -> ControlFlow<()> + Sync) -> Result<LightSampler, Error> {
        self.build_reporting(Some(&report))
    }

    fn build_reporting(self, report: Option<Report<'_>>) -> Result<LightSampler, Error> {
        let environment = self.environment.map_or_else(|| Environment::constant(1.0), Ok)?;
        let energies = Energies::new(&environment, &[], &[]);
        let mut collection = self.collection;
        let lights = collection.light_count() + collection.object_light_count();
        let work = collection.image_work() + lights as f64 / PLACED;
        let progress = Progress::new(report, work);
        collection.build_images(&progress)?;
        collection.build_objects(self.arity, &energies, &progress)?;
        let emitting = collection.emitting(&energies)?;
        let total = collection.total_energy(&energies);
        let bounds = |i: u32| energies.bounds(collection.light(emitting[i as usize]), total).0;
        let groups = collection.groups(&emitting);
        let (tlas, order) = tlas::build_in_groups(self.arity, emitting.len(), &bounds, &groups, &progress)?;
        let leaves = parallel::collect(order.len(), |leaf| emitting[order[leaf] as usize]);
        let unplaced = Unplaced::of(&mut collection);
        let lights = collection.into_lights(self.illumination, &leaves);
        let is_light = self.environment_as_light && environment.mean() > 0.0;
        let sky = is_light.then(|| RegionMoments::new(&environment.as_view()));
        let mut sampler = LightSampler {
            tlas,
            lights,
            environment,
            sky,
            cost: 1.0,
            cost_at_build: 1.0,
            arity: self.arity,
            unplaced,
            edits: None,
        };
        sampler.fit();
        sampler.cost_at_build = sampler.cost;
        progress.finish()?;
        Ok(sampler)
    }
}
