//! Lights on their way into a sampler: everything is checked as it is added.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use super::distant;
use super::distant_record::DistantRecord;
use super::extras;
use super::instance::{self, AddedObject, InstanceRecord, PlacedObject};
use super::mesh::{Mesh, MeshKind, Sides, Weight, check_end, check_triangles};
use super::meshes::mesh_of;
use super::motion::{EndVertices, MotionCollection, end_vertices};
use super::profile::Profile;
use super::profile_values::ProfileCollection;
use super::projection::Projection;
use super::{
    Energies, Extras, Illumination, Lamp, LampLight, LampRecord, Light, LightKind, LightTriangle, Lights, NO_AREA,
    NO_LEAF,
};
use crate::blas::{self, CellNode, ImageTree, Procedural, RegisteredFunction, Root, Texture};
use crate::error::{Error, ErrorKind};
use crate::parallel;
use crate::progress::Progress;
use crate::receiver::ALL_GROUPS;
use crate::record::{LightId, MeshId, ProfileId, TextureId};
use crate::tlas::MAX_LEAVES;

/// What a textured weight is read from.
enum WeightTexture<'a> {
    Image(Texture<'a>),
    Function(RegisteredFunction<'a>),
}

/// The lights of a scene before there is a tree over them.
pub(crate) struct LightCollection<'a> {
    textures: Vec<WeightTexture<'a>>,
    /// Triangles that may emit light.
    pub(super) triangles: Vec<LightTriangle>,
    /// For every triangle that was added, its index in `triangles`, [`NO_LEAF`] or [`NO_AREA`].
    pub(super) indices: Vec<u32>,
    /// Where each mesh starts in `indices`, and the end.
    pub(super) meshes: Vec<u32>,
    /// Light groups of each mesh.
    pub(super) mesh_groups: Vec<u32>,
    /// Lights that are not made of triangles.
    pub(super) lamps: Vec<LampRecord>,
    /// Light groups of each.
    pub(super) lamp_groups: Vec<u32>,
    profiles: ProfileCollection,
    /// Profiles and motion as lights read them. Complete after [`Self::build_images`].
    packed: Vec<u32>,
    /// Light groups of the environment.
    pub(crate) environment_groups: u32,
    pub(super) cells: Vec<CellNode>,
    /// Trees over functions by texture and the bits of the three uvs.
    shared: BTreeMap<TreeKey, Root>,
    /// Trees over images that are still to be built, and their numbers.
    images: Vec<ImageTree<'a>>,
    shared_images: BTreeMap<TreeKey, u32>,
    /// Triangles, by their places in `indices`, with the numbers of their trees over images.
    pub(super) pending: Vec<(u32, u32)>,
    /// Objects that are still to be built.
    pub(super) objects: Vec<AddedObject>,
    /// Objects that are built, as words.
    pub(super) object_words: Vec<u32>,
    pub(super) instances: Vec<InstanceRecord>,
    /// Light groups of each.
    pub(super) instance_groups: Vec<u32>,
    pub(super) objects_have_portals: bool,
    /// What moves while the shutter is open.
    pub(super) motion: MotionCollection,
}

/// A texture and the bits of the three uvs: what a tree depends on.
type TreeKey = (u32, [u32; 6]);

/// The weight over a triangle as far as it is known when the triangle is added.
enum AddedWeight {
    Tree(Root),
    /// The number of a tree over an image.
    Pending(u32),
}

impl<'a> LightCollection<'a> {
    pub(crate) fn new() -> Self {
        Self {
            textures: Vec::new(),
            triangles: Vec::new(),
            indices: Vec::new(),
            meshes: vec![0],
            mesh_groups: Vec::new(),
            lamps: Vec::new(),
            lamp_groups: Vec::new(),
            profiles: ProfileCollection::default(),
            packed: Vec::new(),
            environment_groups: ALL_GROUPS,
            cells: Vec::new(),
            shared: BTreeMap::new(),
            images: Vec::new(),
            shared_images: BTreeMap::new(),
            pending: Vec::new(),
            objects: Vec::new(),
            object_words: Vec::new(),
            instances: Vec::new(),
            instance_groups: Vec::new(),
            objects_have_portals: false,
            motion: MotionCollection::default(),
        }
    }

    /// Numbers of textures, meshes, triangles and lamps that were added.
    pub(crate) fn counts(&self) -> [usize; 4] {
        [self.textures.len(), self.meshes.len() - 1, self.indices.len(), self.lamps.len()]
    }

    pub(crate) fn add_texture(&mut self, texture: Texture<'a>) -> TextureId {
        self.push_texture(WeightTexture::Image(texture))
    }

    pub(crate) fn add_procedural(&mut self, function: &'a dyn Procedural) -> TextureId {
        self.push_texture(WeightTexture::Function(RegisteredFunction::new(function)))
    }

    fn push_texture(&mut self, texture: WeightTexture<'a>) -> TextureId {
        self.textures.push(texture);
        TextureId(self.textures.len() as u32 - 1)
    }

    /// Adds a mesh. After an error the collection is as it was before.
    pub(crate) fn add_mesh(&mut self, mesh: &Mesh<'_>) -> Result<MeshId, Error> {
        let number = self.meshes.len() - 1;
        self.check(number, mesh)?;
        let before = (self.triangles.len(), self.indices.len(), self.cells.len());
        let function = self.function(mesh).copied();
        for indices in mesh.indices {
            if let Err(error) = self.add_triangle(mesh, *indices) {
                if let (Some(changed), Some(before)) = (self.function(mesh), function) {
                    *changed = before;
                }
                self.triangles.truncate(before.0);
                self.indices.truncate(before.1);
                self.cells.truncate(before.2);
                self.shared.retain(|_, root| blas::holds(&self.cells, *root));
                return Err(error);
            }
        }
        if let Some(end) = mesh.end.filter(|end| *end != mesh.positions) {
            self.motion.set_mesh(before.1 as u32, end_vertices(end, mesh.indices));
        }
        self.meshes.push(self.indices.len() as u32);
        self.mesh_groups.push(mesh.groups);
        Ok(MeshId(number as u32))
    }

    /// Adds a light that is not made of triangles. After an error the collection is as it was before.
    pub(crate) fn add_lamp(&mut self, lamp: Lamp, groups: u32) -> Result<LightId, Error> {
        let number = self.lamps.len();
        if number >= MAX_LEAVES {
            return Err(Error(ErrorKind::TooMany { what: "lights", count: number + 1, limit: MAX_LEAVES }));
        }
        let record = lamp.record(number as u32)?;
        self.profiles.view().check(record.number(), record.profile())?;
        self.lamps.push(record);
        self.lamp_groups.push(groups);
        Ok(LightId(number as u32))
    }

    /// Adds a profile. After an error the collection is as it was before.
    pub(crate) fn add_profile(&mut self, profile: &Profile<'_>) -> Result<ProfileId, Error> {
        self.profiles.add(profile)
    }

    /// Adds a projection. After an error the collection is as it was before.
    pub(crate) fn add_projection(&mut self, projection: &Projection<'_>) -> Result<ProfileId, Error> {
        self.profiles.add_projection(projection)
    }

    /// Returns the units of work of [`Self::build_images`].
    pub(crate) fn image_work(&self) -> f64 {
        blas::image_work(&self.images)
    }

    /// Number of lights that may emit, by what is known of them.
    pub(crate) fn light_count(&self) -> usize {
        self.triangles.len() + self.lamps.len() + self.instances.len()
    }

    /// Builds the trees over images, and packs the profiles. Only then the lights are complete.
    ///
    /// # Errors
    ///
    /// If there are too many nodes, or if the host has canceled the build.
    pub(crate) fn build_images(&mut self, progress: &Progress<'_>) -> Result<(), Error> {
        self.packed = extras::pack(&[], &[], &[], self.profiles.arrays(), &self.motion.pack());
        let trees = core::mem::take(&mut self.images);
        // One image after the other: only few pyramids exist at a time.
        let mut order: Vec<u32> = (0..trees.len() as u32).collect();
        order.sort_by_key(|&tree| trees[tree as usize].texture);
        let sorted: Vec<ImageTree<'_>> = order.iter().map(|&tree| trees[tree as usize]).collect();
        let built = blas::build_images(&sorted, &mut self.cells, progress)?;
        let mut roots = vec![Root::constant(0.0); built.len()];
        for (tree, root) in order.into_iter().zip(built) {
            roots[tree as usize] = root;
        }
        self.set_roots(&roots);
        let mut objects = core::mem::take(&mut self.objects);
        for object in &mut objects {
            self.exchange_meshes(object);
            self.set_roots(&roots);
            self.exchange_meshes(object);
        }
        self.objects = objects;
        Ok(())
    }

    /// Gives the triangles that wait for trees over images their roots.
    fn set_roots(&mut self, roots: &[Root]) {
        for (at, tree) in core::mem::take(&mut self.pending) {
            let (index, root) = (&mut self.indices[at as usize], roots[tree as usize]);
            if let Some(triangle) = self.triangles.get_mut(*index as usize) {
                triangle.root = root;
            } else if root.average == 0.0 {
                *index = NO_LEAF;
            }
        }
        self.remove_black();
    }

    /// Removes the triangles on which an image turned out to be black.
    fn remove_black(&mut self) {
        let mut count = 0;
        let places: Vec<u32> = self
            .triangles
            .iter()
            .map(|triangle| {
                let is_kept = triangle.root.average != 0.0;
                count += u32::from(is_kept);
                if is_kept { count - 1 } else { NO_LEAF }
            })
            .collect();
        if count as usize == self.triangles.len() {
            return;
        }
        self.triangles.retain(|triangle| triangle.root.average != 0.0);
        for index in &mut self.indices {
            *index = places.get(*index as usize).copied().unwrap_or(*index);
        }
    }

    /// Returns what is known of the triangles of a mesh: their indices in `triangles`, [`NO_LEAF`] or [`NO_AREA`].
    pub(super) fn mesh(&self, mesh: u32) -> &[u32] {
        let [start, end] = [mesh, mesh + 1].map(|mesh| self.meshes[mesh as usize] as usize);
        &self.indices[start..end]
    }

    /// Returns the vertices of the triangles of a mesh at the end of the shutter interval; empty if it stands still.
    pub(super) fn ends(&self, mesh: u32) -> &[EndVertices] {
        // The place of a mesh without triangles is that of another one.
        if self.mesh(mesh).is_empty() { &[] } else { self.motion.mesh(self.meshes[mesh as usize]) }
    }

    /// Returns a light by its index among those that may emit: first the triangles, then the lamps, then the instances.
    #[inline]
    pub(crate) fn light(&self, index: u32) -> Light<'_> {
        match self.triangles.get(index as usize) {
            Some(triangle) if triangle.index_and_flags & LightTriangle::LAMP == 0 => Light::Triangle(triangle),
            _ => self.other_light(index as usize),
        }
    }

    /// Returns a light that is no triangle or that moves.
    #[inline(never)]
    fn other_light(&self, index: usize) -> Light<'_> {
        match self.triangles.get(index) {
            Some(triangle) => Light::of(triangle, Extras(&self.packed), &[], 0.0),
            None => match self.lamps.get(index - self.triangles.len()) {
                Some(record) => Light::Lamp(LampLight { record, extras: Extras(&self.packed) }),
                None => {
                    let number = index - self.triangles.len() - self.lamps.len();
                    let placed = PlacedObject::new(&self.instances[number], &self.object_words);
                    Light::Instance(placed.moving(Extras(&self.packed), number as u32, 0.0))
                }
            },
        }
    }

    /// Returns the light groups of some lights by their indices; nothing if all lights are in all groups.
    pub(crate) fn groups(&self, lights: &[u32]) -> Vec<u32> {
        let all = [self.environment_groups];
        let mut groups = self.mesh_groups.iter().chain(&self.lamp_groups).chain(&self.instance_groups).chain(&all);
        if groups.all(|groups| *groups == ALL_GROUPS) {
            return Vec::new();
        }
        let groups = |index: u32| match self.light(index) {
            Light::Triangle(triangle) => self.mesh_groups[mesh_of(&self.meshes, triangle.index())],
            Light::Moving(moving) => self.mesh_groups[mesh_of(&self.meshes, moving.record.index())],
            Light::Lamp(lamp) => self.lamp_groups[lamp.record.number() as usize],
            Light::Instance(_) => self.instance_groups[index as usize - self.triangles.len() - self.lamps.len()],
        };
        lights.iter().map(|&light| groups(light)).collect()
    }

    /// Returns the energy of all lights together.
    pub(crate) fn total_energy(&self, energies: &Energies<'_>) -> f64 {
        energies.total(self.light_count(), |i| self.light(i as u32))
    }

    /// Returns the indices of the lights that emit anything.
    ///
    /// # Errors
    ///
    /// If there are more of them than leaves in a tree.
    pub(crate) fn emitting(&self, energies: &Energies<'_>) -> Result<Vec<u32>, Error> {
        let emits = parallel::collect(self.light_count(), |i| energies.may_emit(self.light(i as u32)));
        let emitting: Vec<u32> = (0..).zip(emits).filter_map(|(i, emits)| emits.then_some(i)).collect();
        if emitting.len() > MAX_LEAVES {
            let count = emitting.len();
            return Err(Error(ErrorKind::TooMany { what: "lights", count, limit: MAX_LEAVES }));
        }
        Ok(emitting)
    }

    /// Returns the lights with these indices, in the order of leaves that is given.
    pub(crate) fn into_lights(mut self, illumination: Illumination, leaves: &[u32]) -> Lights {
        let has_portals = self.triangles.iter().any(LightKind::is_portal) || self.objects_have_portals;
        let first_lamp = self.triangles.len() as u32;
        let first_instance = first_lamp + self.lamps.len() as u32;
        let mut leaf_of_index = vec![NO_LEAF; self.light_count()];
        for (leaf, &index) in (0..).zip(leaves) {
            leaf_of_index[index as usize] = leaf;
        }
        let leaf_of = |&index: &u32| leaf_of_index.get(index as usize).copied().unwrap_or(index);
        let lamp_leaves = &leaf_of_index[first_lamp as usize..first_instance as usize];
        let leaf_of = self.indices.iter().map(leaf_of).chain(lamp_leaves.iter().copied()).collect();
        let record = |leaf: usize| match leaves[leaf].checked_sub(first_lamp) {
            None => self.triangles[leaves[leaf] as usize],
            Some(number) => match self.lamps.get(number as usize) {
                Some(lamp) => lamp.into_triangle(),
                None => LightTriangle::of_instance(leaves[leaf] - first_instance),
            },
        };
        let records = parallel::collect(leaves.len(), record);
        for (instance, leaf) in self.instances.iter_mut().zip(&leaf_of_index[first_instance as usize..]) {
            instance.leaf = *leaf;
        }
        let mut groups = self.groups(leaves);
        if !groups.is_empty() || self.environment_groups != ALL_GROUPS {
            groups.push(self.environment_groups);
        }
        let distant = |lamp: &LampRecord| {
            let groups = self.lamp_groups[lamp.number() as usize];
            Some(DistantRecord::new(&lamp.distant()?, lamp.number(), groups))
        };
        let emits = |light: &DistantRecord| light.irradiance() > 0.0;
        let mut distants: Vec<DistantRecord> = self.lamps.iter().filter_map(distant).filter(emits).collect();
        let distant_groups = distant::arrange(&mut distants);
        let extras = extras::pack(&groups, &distants, &distant_groups, self.profiles.arrays(), &self.motion.pack());
        Lights {
            illumination,
            energy: 0.0,
            has_portals,
            has_lamps: leaves.iter().any(|index| (first_lamp..first_instance).contains(index)),
            is_crossed_once: false,
            time: 0.0,
            is_edited: false,
            records,
            cells: self.cells,
            leaf_of,
            meshes: self.meshes,
            scales: Vec::new(),
            extras,
            instances: instance::join(&self.instances, &self.object_words),
        }
    }

    fn check(&self, number: usize, mesh: &Mesh<'_>) -> Result<(), Error> {
        let fail = |kind| Err(Error(kind));
        let vertices = mesh.positions.len();
        let count = self.indices.len().saturating_add(mesh.indices.len());
        if count > MAX_LEAVES {
            return fail(ErrorKind::TooMany { what: "triangles", count, limit: MAX_LEAVES });
        }
        check_triangles(number, mesh.positions, mesh.indices)?;
        mesh.end.map_or(Ok(()), |end| check_end(number, vertices, end))?;
        match mesh.weight {
            Weight::Constant(value) if !(0.0..=blas::MAX_AVERAGE).contains(&value) => {
                fail(ErrorKind::Weight { mesh: number, value, limit: blas::MAX_AVERAGE })
            }
            Weight::Constant(_) => Ok(()),
            Weight::Texture(TextureId(texture)) if texture as usize >= self.textures.len() => {
                let textures = self.textures.len();
                fail(ErrorKind::UnknownTexture { mesh: number, texture: texture as usize, textures })
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
        let weight = self.weight(mesh, indices)?;
        let root = match weight {
            AddedWeight::Tree(root) => root,
            AddedWeight::Pending(tree) => {
                self.pending.push((self.indices.len() as u32, tree));
                // Until it is built, the triangle may emit.
                Root::constant(1.0)
            }
        };
        let two_sided = if mesh.sides == Sides::Two { LightTriangle::TWO_SIDED } else { 0 };
        let portal = if mesh.kind == MeshKind::Portal { LightTriangle::PORTAL } else { 0 };
        let mut triangle = LightTriangle {
            vertices: indices.map(|index| mesh.positions[index as usize].to_array()),
            root,
            index_and_flags: self.indices.len() as u32 | two_sided | portal,
        };
        let end = mesh.end.map(|end| indices.map(|index| end[index as usize].to_array()));
        triangle.mark_motion(end.as_ref());
        if root.average == 0.0 {
            self.indices.push(NO_LEAF);
        } else if triangle.never_has_an_area(end.as_ref()) {
            self.indices.push(NO_AREA);
        } else {
            self.indices.push(self.triangles.len() as u32);
            self.triangles.push(triangle);
        }
        Ok(())
    }

    /// The function that guides the mesh, if it is guided by one.
    fn function(&mut self, mesh: &Mesh<'_>) -> Option<&mut RegisteredFunction<'a>> {
        let Weight::Texture(TextureId(texture)) = mesh.weight else { return None };
        match &mut self.textures[texture as usize] {
            WeightTexture::Function(function) => Some(function),
            WeightTexture::Image(_) => None,
        }
    }

    /// Returns the weight over one triangle: the tree over a function, built only if no triangle before has the same,
    /// or the number of one over an image.
    fn weight(&mut self, mesh: &Mesh<'_>, indices: [u32; 3]) -> Result<AddedWeight, Error> {
        let texture = match mesh.weight {
            Weight::Constant(weight) => {
                return Ok(AddedWeight::Tree(Root::constant(blas::storable(f64::from(weight)))));
            }
            Weight::Texture(TextureId(texture)) => texture,
        };
        let uv = indices.map(|index| mesh.uvs[index as usize]);
        let [a, b, c] = uv.map(|uv| uv.to_array().map(f32::to_bits));
        let key = (texture, [a[0], a[1], b[0], b[1], c[0], c[1]]);
        let mesh = self.meshes.len() - 1;
        match &mut self.textures[texture as usize] {
            WeightTexture::Image(image) => {
                let image = *image;
                let images = &mut self.images;
                let tree = *self.shared_images.entry(key).or_insert_with(|| {
                    images.push(ImageTree { image, texture, uv });
                    images.len() as u32 - 1
                });
                Ok(AddedWeight::Pending(tree))
            }
            WeightTexture::Function(function) => {
                if let Some(&root) = self.shared.get(&key) {
                    return Ok(AddedWeight::Tree(root));
                }
                let root = blas::build_procedural(function, mesh, uv, &mut self.cells)?;
                self.shared.insert(key, root);
                Ok(AddedWeight::Tree(root))
            }
        }
    }
}
