//! All lights of a scene, owned or borrowed.

use alloc::vec::Vec;

use super::builder::LightSamplerBuilder;
use super::energy::Scales;
use super::mesh::mesh_of;
use crate::blas;
use crate::env::{Environment, EnvironmentView};
use crate::light::{Illumination, LightTriangle, Lit};
use crate::math::{at_least, only_if};
use crate::record::{ShadingPoint, TriangleId};
use crate::tlas::{self, Tlas, TlasView};

/// Marks a triangle that is not in the tree because it sends nothing, whatever its shape.
pub(super) const NO_LEAF: u32 = u32::MAX;
/// Marks a triangle that is not in the tree because it has no area.
pub(super) const NO_AREA: u32 = u32::MAX - 1;

/// All lights of a scene, ready to be sampled. `N` is the arity of the tree over triangles (4, 8 or 16).
/// The wider a tree, the better its choices; on machines without AVX, 8 may be faster than the default of 16.
///
/// All that a shading point needs works on [`LightSamplerView`], which borrows plain data; the methods here forward
/// to it.
#[derive(Clone, Debug)]
pub struct LightSampler<const N: usize = 16> {
    pub(super) tlas: Tlas<N>,
    /// In the order of the tree's leaves.
    pub(super) triangles: Vec<LightTriangle>,
    pub(super) cells: Vec<blas::CellBlock>,
    /// Where the triangles of each mesh start in `leaves`, and their number at the end.
    pub(super) meshes: Vec<u32>,
    /// Leaf of every triangle that was added, [`NO_LEAF`] or [`NO_AREA`].
    pub(super) leaves: Vec<u32>,
    /// What the weights of each mesh have been multiplied by since the build. Empty if they have not.
    pub(super) scales: Vec<f32>,
    pub(super) environment: Environment,
    pub(super) illumination: Illumination,
    /// Energy of all triangles together, without the suns: weight times area, times mean radiance for portals. Zero
    /// only if nothing is sent.
    pub(super) energy: f32,
    /// Whether any triangle is a portal.
    pub(super) portals: bool,
    /// What the tree costs, now and as it was built: see [`Self::decay`].
    pub(super) cost: f64,
    pub(super) cost_at_build: f64,
}

/// All lights of a scene in borrowed memory: plain data that can be mapped from a file or shared between processes.
#[derive(Clone, Copy, Debug)]
pub struct LightSamplerView<'a, const N: usize = 16> {
    pub(super) tlas: TlasView<'a, N>,
    pub(super) triangles: &'a [LightTriangle],
    pub(super) cells: &'a [blas::CellBlock],
    pub(super) meshes: &'a [u32],
    pub(super) leaves: &'a [u32],
    pub(super) scales: &'a [f32],
    pub(super) environment: EnvironmentView<'a>,
    pub(super) illumination: Illumination,
    pub(super) energy: f32,
    pub(super) portals: bool,
}

impl LightSampler {
    /// Starts a sampler of the default arities.
    pub fn builder<'a>() -> LightSamplerBuilder<'a> {
        LightSamplerBuilder::new()
    }
}

impl<const N: usize> LightSampler<N> {
    /// The same lights in borrowed form.
    #[inline]
    pub fn as_view(&self) -> LightSamplerView<'_, N> {
        LightSamplerView {
            tlas: self.tlas.view(),
            triangles: &self.triangles,
            cells: &self.cells,
            meshes: &self.meshes,
            leaves: &self.leaves,
            scales: &self.scales,
            environment: self.environment.as_view(),
            illumination: self.illumination,
            energy: self.energy,
            portals: self.portals,
        }
    }

    /// The environment, for its own sampling.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Turns the environment; nothing is built anew.
    ///
    /// # Errors
    ///
    /// As [`Environment::set_rotation`].
    pub fn set_environment_rotation(&mut self, rotation: glam::Mat3) -> Result<(), crate::Error> {
        self.environment.set_rotation(rotation)
    }
}

impl<'a, const N: usize> LightSamplerView<'a, N> {
    /// The environment, for its own sampling.
    pub fn environment(&self) -> EnvironmentView<'a> {
        self.environment
    }

    /// Number of triangles that can send light.
    pub fn light_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of bytes that the structures take, by part: tree over triangles, triangles, trees over textures,
    /// environment.
    pub fn bytes(&self) -> [usize; 4] {
        let tlas = size_of_val(self.tlas.nodes)
            + size_of_val(self.tlas.parents)
            + size_of_val(self.tlas.spreads)
            + size_of_val(self.tlas.leaves);
        let triangles = size_of_val(self.triangles)
            + size_of_val(self.meshes)
            + size_of_val(self.leaves)
            + size_of_val(self.scales);
        let parts = self.environment.parts();
        let environment = size_of_val(&parts.header)
            + size_of_val(parts.means)
            + size_of_val(parts.ranges)
            + size_of_val(parts.filtered_means)
            + size_of_val(parts.suns)
            + size_of_val(parts.sun_texels);
        [tlas, triangles, size_of_val(self.cells), environment]
    }

    /// Leaf of a triangle; `None` for one that sends nothing or that was never added.
    pub(super) fn leaf(&self, id: TriangleId) -> Option<u32> {
        let start = *self.meshes.get(id.mesh as usize)?;
        let end = *self.meshes.get(id.mesh as usize + 1)?;
        let index = start.checked_add(id.triangle).filter(|index| *index < end)?;
        self.leaves.get(index as usize).copied().filter(|leaf| *leaf < NO_AREA)
    }

    /// The triangle in a leaf.
    pub(super) fn id(&self, leaf: u32) -> TriangleId {
        let place = self.triangles[leaf as usize].place();
        let mesh = mesh_of(self.meshes, place);
        TriangleId { mesh: mesh as u32, triangle: place.wrapping_sub(self.meshes[mesh]) }
    }

    /// What the weight of a triangle is multiplied by.
    #[inline]
    pub(super) fn scale(&self, light: &LightTriangle) -> f32 {
        Scales { factors: self.scales, meshes: self.meshes }.of(light)
    }

    /// A triangle as seen from a shading point; `None` if nothing can arrive from it.
    #[inline]
    pub(super) fn lit(&self, leaf: u32, x: &ShadingPoint) -> Option<Lit<'_>> {
        Lit::new(&self.triangles[leaf as usize], x, self.illumination, self.directional_environment())
    }

    /// Whether anything is sent at all.
    pub(super) fn sends(&self) -> bool {
        self.energy > 0.0
    }

    pub(super) fn has_portals(&self) -> bool {
        self.portals
    }

    /// The environment, if what it shows depends on the direction.
    fn directional_environment(&self) -> Option<&EnvironmentView<'a>> {
        (!self.environment.is_constant()).then_some(&self.environment)
    }

    /// What the tree over triangles asks for at a shading point.
    pub(super) fn scene<'s>(&'s self, x: &'s ShadingPoint) -> Scene<'s> {
        Scene { x, triangles: self.triangles, environment: &self.environment, sends: self.sends() }
    }
}

/// The tree's window on triangles and environment.
pub(super) struct Scene<'a> {
    x: &'a ShadingPoint,
    triangles: &'a [LightTriangle],
    environment: &'a EnvironmentView<'a>,
    /// Whether any triangle sends anything.
    sends: bool,
}

impl tlas::Scene for Scene<'_> {
    #[inline(always)]
    fn radiances<const N: usize>(&self, centers: &[[f32; N]; 3], radii: &[f32; N], set: u32) -> [f32; N] {
        let mean = self.environment.mean_without_suns();
        if mean <= 0.0 {
            return [0.0; N];
        }
        // What is not black stays so, however bright the rest is.
        let relative = |value: f32| only_if(value > 0.0, at_least(value / mean, f32::MIN_POSITIVE));
        self.environment.averages_of_balls(centers, radii, set).map(relative)
    }

    #[inline]
    fn is_visible(&self, leaf: u32) -> bool {
        self.sends && self.triangles[leaf as usize].is_visible(self.x)
    }
}
