//! From a host's meshes, textures and environment to a sampler.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::energy::{Energies, Scales};
use super::lights::{LightSampler, NO_AREA, NO_LEAF};
use super::mesh::{Kind, Mesh, Sides, TextureId, Weight, check_triangles};
use crate::blas::{self, Procedural, RegisteredFunction, Root, Texture, TexturePyramid};
use crate::env::Environment;
use crate::error::{Error, Kind as ErrorKind};
use crate::light::{Illumination, LightTriangle};
use crate::parallel;
use crate::tlas::{self, MAX_LEAVES, Report};

/// What a textured weight is read from.
#[derive(Debug)]
enum Surface<'a> {
    Image(TexturePyramid<'a>),
    Function(RegisteredFunction<'a>),
}

/// Collects the lights of a scene and builds a [`LightSampler`].
///
/// Everything is checked when it is added; what was accepted can always be sampled. `N` is the arity of the tree
/// over triangles (4, 8 or 16).
/// The wider a tree, the better its choices; on machines without AVX, 8 may be faster than the default of 16.
#[derive(Debug)]
pub struct LightSamplerBuilder<'a, const N: usize = 16> {
    environment: Option<Environment>,
    illumination: Illumination,
    textures: Vec<Surface<'a>>,
    /// Triangles that may send light.
    triangles: Vec<LightTriangle>,
    /// For every triangle that was added, its place in `triangles`, [`NO_LEAF`] or [`NO_AREA`].
    places: Vec<u32>,
    /// Where each mesh starts in `places`, and the end.
    meshes: Vec<u32>,
    cells: Vec<blas::CellBlock>,
    /// Trees over textures by texture and the bits of the three uvs.
    shared: BTreeMap<(usize, [u32; 6]), Root>,
}

impl<const N: usize> Default for LightSamplerBuilder<'_, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, const N: usize> LightSamplerBuilder<'a, N> {
    /// A builder without lights, whose environment is white.
    pub fn new() -> Self {
        const { assert!(N == 4 || N == 8 || N == 16, "the arity of the tree over triangles is 4, 8 or 16") };
        Self {
            environment: None,
            illumination: Illumination::default(),
            textures: Vec::new(),
            triangles: Vec::new(),
            places: Vec::new(),
            meshes: vec![0],
            cells: Vec::new(),
            shared: BTreeMap::new(),
        }
    }

    /// Sets what the portals show.
    pub fn environment(&mut self, environment: Environment) -> &mut Self {
        self.environment = Some(environment);
        self
    }

    /// Sets the term that guides the descent inside a triangle.
    pub fn illumination(&mut self, illumination: Illumination) -> &mut Self {
        self.illumination = illumination;
        self
    }

    /// Adds a texture that meshes can refer to. Its texels are needed until [`Self::build`].
    pub fn add_texture(&mut self, texture: Texture<'a>) -> TextureId {
        self.textures.push(Surface::Image(TexturePyramid::new(texture)));
        TextureId(self.textures.len() - 1)
    }

    /// Adds a function of texture coordinates that meshes can refer to like a texture. It is asked by
    /// [`Self::add_mesh`].
    pub fn add_procedural(&mut self, function: &'a dyn Procedural) -> TextureId {
        self.textures.push(Surface::Function(RegisteredFunction::new(function)));
        TextureId(self.textures.len() - 1)
    }

    /// Adds a mesh. Returns its number: meshes are numbered in the order in which they are added. After an error the
    /// builder is as it was before.
    ///
    /// # Errors
    ///
    /// If a vertex is not finite or has a coordinate above 1e9, an index has no vertex, the weight is NaN, negative
    /// or above 1e30, or it is a texture of another builder or one without as many uvs as vertices; if the bounds of a
    /// [`Procedural`] are not finite, negative or in the wrong order, or its weight is not within them.
    pub fn add_mesh(&mut self, mesh: &Mesh<'_>) -> Result<u32, Error> {
        let number = self.meshes.len() - 1;
        self.check(number, mesh)?;
        let before = (self.triangles.len(), self.places.len(), self.cells.len());
        let function = self.function(mesh).copied();
        for indices in mesh.indices {
            if let Err(error) = self.add_triangle(mesh, *indices) {
                if let (Some(changed), Some(before)) = (self.function(mesh), function) {
                    *changed = before;
                }
                self.triangles.truncate(before.0);
                self.places.truncate(before.1);
                self.cells.truncate(before.2);
                self.shared.retain(|_, root| blas::holds(&self.cells, *root));
                return Err(error);
            }
        }
        self.meshes.push(self.places.len() as u32);
        Ok(number as u32)
    }

    /// Builds the tree over all triangles that can send light.
    ///
    /// # Errors
    ///
    /// If there are more triangles than the tree can number (2^28 - 1).
    pub fn build(self) -> Result<LightSampler<N>, Error> {
        self.build_reporting(None)
    }

    /// [`Self::build`] for hosts that show how far it is, or that want to be able to stop it. `report` is called now
    /// and then with the share of the work that is done, in `[0, 1]`, and last with 1; [`ControlFlow::Break`] cancels
    /// the build. With the feature `rayon` the calls come from the threads that build, several at once and not always
    /// in order.
    ///
    /// # Errors
    ///
    /// As [`Self::build`], and one of which [`Error::is_cancelled`] is true if `report` has cancelled the build.
    pub fn build_with(self, report: impl Fn(f32) -> ControlFlow<()> + Sync) -> Result<LightSampler<N>, Error> {
        self.build_reporting(Some(&report))
    }

    fn build_reporting(self, report: Option<Report<'_>>) -> Result<LightSampler<N>, Error> {
        let environment = self.environment.map_or_else(|| Environment::constant(1.0), Ok)?;
        let energies = Energies::new(&environment, Scales::default());
        let sends = parallel::collect(self.triangles.len(), |i| energies.energy(&self.triangles[i]) > 0.0);
        let sending: Vec<u32> = (0..).zip(sends).filter_map(|(i, sends)| sends.then_some(i)).collect();
        if sending.len() > MAX_LEAVES {
            return Err(Error(ErrorKind::TooMany { what: "light triangles", count: sending.len(), limit: MAX_LEAVES }));
        }
        let total = energies.total(&self.triangles);
        let bounds = |light: u32| energies.bounds(&self.triangles[sending[light as usize] as usize], total).0;
        let cancelled = |_| Error(ErrorKind::Cancelled);
        let (tlas, order) = tlas::build::<N>(sending.len(), &bounds, report).map_err(cancelled)?;
        let places = parallel::collect(order.len(), |leaf| sending[order[leaf] as usize]);
        let triangles = parallel::collect(places.len(), |leaf| self.triangles[places[leaf] as usize]);
        let portals = self.triangles.iter().any(LightTriangle::is_portal);
        let mut leaf_of = vec![NO_LEAF; self.triangles.len()];
        for (leaf, &place) in (0..).zip(&places) {
            leaf_of[place as usize] = leaf;
        }
        let leaf_at = |&place: &u32| leaf_of.get(place as usize).copied().unwrap_or(place);
        let mut lights = LightSampler {
            tlas,
            triangles,
            leaves: self.places.iter().map(leaf_at).collect(),
            meshes: self.meshes,
            scales: Vec::new(),
            cells: self.cells,
            energy: 0.0,
            portals,
            environment,
            illumination: self.illumination,
            cost: 1.0,
            cost_at_build: 1.0,
        };
        lights.fit();
        lights.cost_at_build = lights.cost;
        match report.map(|report| report(1.0)) {
            Some(ControlFlow::Break(())) => Err(Error(ErrorKind::Cancelled)),
            Some(ControlFlow::Continue(())) | None => Ok(lights),
        }
    }

    fn check(&self, number: usize, mesh: &Mesh<'_>) -> Result<(), Error> {
        let fail = |kind| Err(Error(kind));
        let vertices = mesh.positions.len();
        let count = self.places.len().saturating_add(mesh.indices.len());
        if count > MAX_LEAVES {
            return fail(ErrorKind::TooMany { what: "triangles", count, limit: MAX_LEAVES });
        }
        check_triangles(number, mesh.positions, mesh.indices)?;
        match mesh.weight {
            Weight::Constant(value) if !(0.0..=blas::MAX_AVERAGE).contains(&value) => {
                fail(ErrorKind::Weight { mesh: number, value, limit: blas::MAX_AVERAGE })
            }
            Weight::Constant(_) => Ok(()),
            Weight::Texture(TextureId(texture)) if texture >= self.textures.len() => {
                fail(ErrorKind::UnknownTexture { mesh: number, texture, textures: self.textures.len() })
            }
            Weight::Texture(_) if mesh.uvs.len() != vertices => {
                fail(ErrorKind::TextureCoordinateCount { mesh: number, found: mesh.uvs.len(), vertices })
            }
            Weight::Texture(_) => {
                mesh.uvs.iter().enumerate().try_for_each(|(vertex, uv)| blas::check_uv(number, vertex, *uv))
            }
        }
    }

    fn add_triangle(&mut self, mesh: &Mesh<'_>, indices: [u32; 3]) -> Result<(), Error> {
        let root = self.root(mesh, indices)?;
        let two_sided = if mesh.sides == Sides::Two { LightTriangle::TWO_SIDED } else { 0 };
        let portal = if mesh.kind == Kind::Portal { LightTriangle::PORTAL } else { 0 };
        let triangle = LightTriangle {
            vertices: indices.map(|index| mesh.positions[index as usize].to_array()),
            root,
            place_and_flags: self.places.len() as u32 | two_sided | portal,
        };
        if root.average == 0.0 {
            self.places.push(NO_LEAF);
        } else if triangle.triangle().normal_and_area().is_none() {
            self.places.push(NO_AREA);
        } else {
            self.places.push(self.triangles.len() as u32);
            self.triangles.push(triangle);
        }
        Ok(())
    }

    /// What guides the mesh, if that is a function.
    fn function(&mut self, mesh: &Mesh<'_>) -> Option<&mut RegisteredFunction<'a>> {
        let Weight::Texture(TextureId(texture)) = mesh.weight else { return None };
        match &mut self.textures[texture] {
            Surface::Function(function) => Some(function),
            Surface::Image(_) => None,
        }
    }

    /// The tree over the texture of one triangle, built only if no triangle before has the same.
    fn root(&mut self, mesh: &Mesh<'_>, indices: [u32; 3]) -> Result<Root, Error> {
        let texture = match mesh.weight {
            Weight::Constant(weight) => return Ok(Root::constant(blas::storable(f64::from(weight)))),
            Weight::Texture(TextureId(texture)) => texture,
        };
        let uvs = indices.map(|index| mesh.uvs[index as usize]);
        let [a, b, c] = uvs.map(|uv| uv.to_array().map(f32::to_bits));
        let key = (texture, [a[0], a[1], b[0], b[1], c[0], c[1]]);
        if let Some(&root) = self.shared.get(&key) {
            return Ok(root);
        }
        let mesh = self.meshes.len() - 1;
        let root = match &mut self.textures[texture] {
            Surface::Image(image) => blas::build(image, uvs, &mut self.cells),
            Surface::Function(function) => blas::build_procedural(function, mesh, uvs, &mut self.cells),
        }?;
        self.shared.insert(key, root);
        Ok(root)
    }
}
