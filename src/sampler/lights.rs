//! All lights of a scene, owned or borrowed.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::point::PointSampler;
use crate::env::{Environment, EnvironmentView, RegionMoments};
use crate::error::Error;
use crate::light::{EditState, Lights, LightsView, Unplaced};
use crate::receiver::ShadingPoint;
use crate::record::LightSample;
use crate::technique::{LightScene, Viewpoint};
use crate::tlas::{Arity, Tlas};
use crate::visibility::VisibilityView;

/// All lights of a scene, ready to be sampled.
///
/// [`Self::at`] leads to samples and densities. Sampling reads and never writes, so all threads share one
/// sampler.
#[derive(Clone, Debug)]
pub struct LightSampler {
    pub(super) tlas: Tlas,
    pub(super) lights: Lights,
    pub(super) environment: Environment,
    /// What the regions of the environment send, if it is a light itself and not black.
    pub(super) sky: Option<Box<RegionMoments>>,
    /// Current cost of the tree: see [`Self::decay`].
    pub(super) cost: f64,
    /// Cost of the tree as it was built.
    pub(super) cost_at_build: f64,
    /// Arity of a tree of many lights.
    pub(super) arity: Arity,
    /// Lights and objects that are kept for edits alone.
    pub(super) unplaced: Unplaced,
    /// What edits need to know, from the first one on.
    pub(super) edits: Option<Box<EditState>>,
}

/// All lights of a scene in borrowed memory: plain data that can be mapped from a file or shared between processes.
#[derive(Clone, Copy, Debug)]
pub struct LightSamplerView<'a> {
    pub(super) scene: LightScene<'a>,
    /// What walls hide, where the host has passed it in.
    pub(super) visibility: Option<VisibilityView<'a>>,
}

/// Numbers of bytes that the structures of a sampler take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ByteSizes {
    /// Tree over the lights, and what edits need beside it.
    pub light_tree: usize,
    /// The lights themselves, and the ways from ids to lights; objects, with their own light trees, and instances.
    pub lights: usize,
    /// Trees over textures.
    pub texture_trees: usize,
    /// Environment, and what it needs as a light.
    pub environment: usize,
    /// What walls hide, where a view has it.
    pub visibility: usize,
}

impl ByteSizes {
    /// Returns the sum of all parts.
    #[must_use]
    pub const fn total(&self) -> usize {
        self.light_tree + self.lights + self.texture_trees + self.environment + self.visibility
    }
}

impl LightSampler {
    /// Borrows the lights.
    #[inline]
    #[must_use]
    pub fn as_view(&self) -> LightSamplerView<'_> {
        let (tlas, lights, environment) = (self.tlas.view(), self.lights.view(), self.environment.as_view());
        let scene = LightScene { tlas, lights, environment, sky: self.sky.as_deref() };
        LightSamplerView { scene, visibility: None }
    }

    /// Returns the lights as seen from a shading point.
    #[inline(always)]
    pub fn at(&self, x: &ShadingPoint) -> PointSampler<'_> {
        PointSampler::new(Viewpoint {
            scene: LightScene {
                tlas: self.tlas.view(),
                lights: LightsView { time: x.time, ..self.lights.view() },
                environment: self.environment.as_view(),
                sky: self.sky.as_deref(),
            },
            x: *x,
            visibility: None,
        })
    }

    /// Draws one sample for each shading point and its random numbers: see [`LightSamplerView::sample_many`].
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        self.as_view().sample_many(queries, samples);
    }

    /// Returns the environment, for its own sampling.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Rotates the environment at no cost: nothing is rebuilt.
    ///
    /// # Errors
    ///
    /// As [`Environment::set_rotation`].
    pub fn set_environment_rotation(&mut self, rotation: glam::Mat3) -> Result<(), Error> {
        self.environment.set_rotation(rotation)
    }

    /// Returns the number of lights that can send anything: triangles, and lights that are not made of them. A triangle
    /// of an object counts once for each of the object's instances.
    #[must_use]
    pub fn light_count(&self) -> usize {
        self.as_view().light_count()
    }

    /// Returns the number of bytes that the structures take.
    #[must_use]
    pub fn bytes(&self) -> ByteSizes {
        let mut bytes = self.as_view().bytes();
        bytes.light_tree += self.edits.as_ref().map_or(0, |edits| edits.byte_size());
        bytes
    }

    /// Returns everything as bytes: see [`LightSamplerView::to_bytes`].
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.as_view().to_bytes()
    }
}

impl<'a> LightSamplerView<'a> {
    /// Returns the lights as seen from a shading point.
    #[inline(always)]
    pub fn at(&self, x: &ShadingPoint) -> PointSampler<'a> {
        PointSampler::new(Viewpoint {
            scene: LightScene { lights: LightsView { time: x.time, ..self.scene.lights }, ..self.scene },
            x: *x,
            visibility: self.region(x),
        })
    }

    /// Returns the environment, for its own sampling.
    #[must_use]
    pub fn environment(&self) -> EnvironmentView<'a> {
        self.scene.environment
    }

    /// Returns the number of lights that can send anything: triangles, and lights that are not made of them. A triangle
    /// of an object counts once for each of the object's instances.
    #[must_use]
    pub fn light_count(&self) -> usize {
        let LightScene { tlas, lights, .. } = &self.scene;
        let free = if lights.is_edited { tlas.free_leaf_count() } else { 0 };
        lights.count() - free + lights.extras().distants().len()
    }

    /// Returns the number of bytes that the structures take.
    #[must_use]
    pub fn bytes(&self) -> ByteSizes {
        let texture_trees = size_of_val(self.scene.lights.cells);
        ByteSizes {
            light_tree: self.scene.tlas.byte_size(),
            lights: self.scene.lights.byte_size() - texture_trees,
            texture_trees,
            environment: self.scene.environment.byte_size() + self.scene.sky.map_or(0, size_of_val),
            visibility: self.visibility.map_or(0, |visibility| visibility.bytes()),
        }
    }
}
