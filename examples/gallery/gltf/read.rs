//! Reads a model from glTF.

use std::collections::HashMap;
use std::path::Path;

use glam::{Affine3A, Mat3, Mat4, Vec3};

use super::alloc::sync::Arc;
use super::contents::{self, Uses, starts_with};
use super::data::{Data, Limits};
use super::document::{Document, member};
use super::hierarchy::Hierarchy;
use super::images::Images;
use super::instances::instances;
use super::notes::Notes;
use super::primitive::{self, Wanted};
use super::surface::{Map, Reading, Surface};
use super::texture::Mapping;
use super::{container, extensions, lamps, profiles, skin};
use crate::render::{Camera, Copies, Error, Lobe, Material, Mesh, Model, Sky};

/// Longest side of a scene: what is further than a thousand kilometers is a mistake in its units.
const LARGEST: f32 = 1e6;
/// Shortest size of a scene.
const SMALLEST: f32 = 1e-3;

/// A scene, and what should be known of it.
pub(crate) struct Read {
    pub(crate) model: Model,
    /// What was ignored, or became something else than the file says.
    pub(crate) notes: Vec<String>,
    /// What the file holds, and what became of it.
    pub(crate) contents: Vec<String>,
}

/// What materials are by their names, in capitals or not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prefixes<'a> {
    /// Those whose names start with this are portals, if they let light through.
    pub(crate) portals: &'a str,
    /// Those whose names start with this are portals as well, as clear panes, whatever the file says.
    pub(crate) panes: Option<&'a str>,
}

impl<'a> From<&'a str> for Prefixes<'a> {
    fn from(portals: &'a str) -> Self {
        Self { portals, panes: None }
    }
}

/// Reads a scene from the bytes of a file, and from others in its folder, if there is one. Its environment is not in
/// the file.
pub(crate) fn read<'a>(
    bytes: &[u8],
    folder: Option<&Path>,
    prefixes: impl Into<Prefixes<'a>>,
    sky: Option<Sky>,
    limits: Limits,
) -> Result<Read, Error> {
    let (document, blob) = container::parse(bytes)?;
    let mut notes = Notes::default();
    extensions::check(&document, &mut notes)?;
    let hierarchy = Hierarchy::new(&document, &mut notes)?;
    let camera = Camera::looking(Vec3::ONE, Vec3::ZERO, 60.0);
    let mut model = Model::new(camera, sky);
    let Prefixes { portals, panes } = prefixes.into();
    portals.clone_into(&mut model.portal_prefix);
    let uses = (0..=document.materials.len()).map(|_| Uses::default()).collect();
    let mut reader = Reader {
        panes,
        data: Data::new(&document, folder, blob, limits),
        document: &document,
        hierarchy,
        images: Images::default(),
        textures: HashMap::new(),
        objects: HashMap::new(),
        size: 0,
        mappings: vec![None; document.materials.len() + 1],
        model,
        notes,
        uses,
        contents: vec![],
    };
    reader.read()?;
    Ok(Read { model: reader.model, notes: reader.notes.lines(), contents: reader.contents })
}

/// Where a material's images are read: that of its color, and that of its emission.
type Mappings = [Option<Mapping>; 2];

struct Reader<'a> {
    document: &'a Document,
    /// What names of materials start with that are clear panes.
    panes: Option<&'a str>,
    data: Data<'a>,
    hierarchy: Hierarchy,
    images: Images,
    /// The model's numbers of images that are textures as they are, by the texture.
    textures: HashMap<usize, usize>,
    /// Primitives that emit light or may let it in, in their own coordinates, by mesh and number.
    objects: HashMap<(usize, usize), Arc<Mesh>>,
    /// Triangles or vertices so far.
    size: usize,
    /// Mappings of each material that is in use; the last one is that of meshes without a material.
    mappings: Vec<Option<Mappings>>,
    model: Model,
    notes: Notes,
    uses: Vec<Uses>,
    contents: Vec<String>,
}

impl Reader<'_> {
    fn read(&mut self) -> Result<(), Error> {
        for index in self.hierarchy.visible.clone() {
            self.add_node(index).map_err(|error| format!("{}: {error}", self.document.node(index)))?;
        }
        let [low, high] = self.check()?;
        self.contents.push(format!("the scene reaches from {low} to {high}"));
        self.place_camera(low, high)?;
        self.add_lamps()?;
        self.conclude();
        Ok(())
    }

    fn add_node(&mut self, index: usize) -> Result<(), Error> {
        let node = member(&self.document.nodes, "node", index)?;
        let Some(mesh_index) = node.mesh else { return Ok(()) };
        let mesh = member(&self.document.meshes, "mesh", mesh_index)?;
        let called = self.document.mesh(mesh_index);
        let joints = match node.skin {
            Some(skin) => {
                self.notes.about(&called, "it has a skin, and is posed as its joints stand in the file");
                Some(skin::joints(&self.data, skin, &self.hierarchy.globals)?)
            }
            None => None,
        };
        let global = self.hierarchy.globals[index];
        let places: Vec<Mat4> = instances(&self.data, node)?.into_iter().map(|place| global * place).collect();
        let weights = if node.weights.is_empty() { &mesh.weights } else { &node.weights };
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let within = |error: Error| Error::from(format!("{called}, primitive {number}: {error}"));
            if let Some(material) = primitive.material {
                member(&self.document.materials, "material", material).map_err(within)?;
            }
            let material = primitive.material.unwrap_or(self.document.materials.len());
            let ([color, emission], of_model) = self.material(material).map_err(within)?;
            let joints = joints.as_deref();
            let has_alpha = self.model.materials[of_model].has_holes();
            let wanted = Wanted { called: &called, weights, joints, color, emission, has_alpha, material: of_model };
            let local = primitive::read(&self.data, primitive, &wanted, &mut self.notes).map_err(within)?;
            let Some((local, is_skinned)) = local else { continue };
            if is_skinned && places.len() > 1 {
                self.notes.about(&called, "its instances are ignored, as joints place it");
            }
            let places = if is_skinned { &[Mat4::IDENTITY][..] } else { &places };
            self.check_room(&local, places.len()).map_err(within)?;
            let uses = &mut self.uses[material];
            uses.triangles += local.indices.len() * places.len();
            if uses.meshes.last() != Some(&called) {
                uses.meshes.push(called.clone());
            }
            self.note_names(material, index, mesh_index);
            let mut mesh = placed(&local, places);
            if let Some(corner) = mesh.positions.iter().find(|corner| !corner.is_finite()) {
                return Err(within(format!("a vertex is at {corner}").into()));
            }
            let of_light = &self.model.materials[of_model];
            if !is_skinned && (of_light.emits() || self.model.is_portal(&mesh)) {
                let object = match self.objects.get(&(mesh_index, number)) {
                    Some(object) if node.weights.is_empty() => object.clone(),
                    _ => Arc::new(local),
                };
                if node.weights.is_empty() {
                    self.objects.insert((mesh_index, number), object.clone());
                }
                let places = places.iter().map(|place| Affine3A::from_mat4(*place)).collect();
                mesh.copies = Some(Copies { object, places });
            }
            self.model.add(mesh);
        }
        Ok(())
    }

    /// Remembers what is called like a portal.
    fn note_names(&mut self, material: usize, node: usize, mesh: usize) {
        let names = [
            (self.document.nodes[node].name.as_deref(), self.document.node(node)),
            (self.document.meshes[mesh].name.as_deref(), self.document.mesh(mesh)),
        ];
        for (name, called) in names {
            if name.is_some_and(|name| starts_with(name, &self.model.portal_prefix)) {
                self.uses[material].called_portal.push(called);
            }
        }
    }

    /// Where a material's images are read, and its number in the model. Reads it if this is its first use.
    fn material(&mut self, index: usize) -> Result<(Mappings, usize), Error> {
        let known = self.mappings.get(index).copied().flatten();
        if let (Some(mappings), Some(number)) = (known, self.uses.get(index).and_then(|uses| uses.number)) {
            return Ok((mappings, number));
        }
        let none = self.document.materials.len();
        let surface = if index == none {
            let material = Material::new("", Vec3::splat(0.8));
            Surface { material, color_map: None, color_mapping: None, emission_map: None, emission_mapping: None }
        } else {
            let source = member(&self.document.materials, "material", index)?;
            let called = self.document.material(index);
            let (data, images, notes) = (&self.data, &mut self.images, &mut self.notes);
            let read = Reading { data, images, notes, called: &called }.surface(source);
            read.map_err(|error| format!("{called}: {error}"))?
        };
        let mut material = surface.material;
        if self.panes.is_some_and(|prefix| starts_with(&material.name, prefix)) {
            (material.lobe, material.two_sided) = (Lobe::Clear, true);
        }
        material.color_map = surface.color_map.map(|map| self.bitmap(map));
        material.emission_map = surface.emission_map.map(|map| self.bitmap(map));
        let mappings = [surface.color_mapping, surface.emission_mapping];
        let number = self.model.material(material).material;
        self.mappings[index] = Some(mappings);
        self.uses[index].number = Some(number);
        Ok((mappings, number))
    }

    /// The model's number of an image.
    fn bitmap(&mut self, map: Map) -> usize {
        if let Some(&known) = map.texture.and_then(|texture| self.textures.get(&texture)) {
            return known;
        }
        let number = self.model.bitmap(map.bitmap);
        if let Some(texture) = map.texture {
            self.textures.insert(texture, number);
        }
        number
    }

    /// Refuses a mesh that makes the scene too large.
    fn check_room(&mut self, mesh: &Mesh, copies: usize) -> Result<(), Error> {
        let most = self.data.limits.triangles;
        let size = mesh.indices.len().max(mesh.positions.len());
        let all = size.checked_mul(copies).and_then(|new| new.checked_add(self.size)).filter(|&all| all <= most);
        self.size =
            all.ok_or_else(|| format!("with {copies} of it the scene has more than {most} triangles or vertices"))?;
        Ok(())
    }

    /// Checks what was read. Returns its bounds.
    fn check(&self) -> Result<[Vec3; 2], Error> {
        let corners = || self.model.meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
        let has_triangles = self.model.meshes.iter().any(|mesh| !mesh.indices.is_empty());
        let [Some(low), Some(high)] = [corners().reduce(Vec3::min), corners().reduce(Vec3::max)] else {
            return Err("it holds no triangles".into());
        };
        if !has_triangles {
            return Err("it holds no triangles".into());
        }
        let size = (high - low).max_element().max(low.abs().max_element()).max(high.abs().max_element());
        if !(SMALLEST..=LARGEST).contains(&size) || (high - low).max_element() < SMALLEST * SMALLEST {
            return Err(format!(
                "the scene reaches from {low} to {high}, but its size must be from {SMALLEST} to {LARGEST:e} meters; \
                 was it exported in other units?"
            )
            .into());
        }
        Ok([low, high])
    }

    /// Takes the scene's first camera, or one that looks from a corner of the scene to its middle.
    fn place_camera(&mut self, low: Vec3, high: Vec3) -> Result<(), Error> {
        let nodes = &self.document.nodes;
        let cameras = self.hierarchy.visible.iter().filter_map(|&node| Some((node, nodes[node].camera?)));
        let cameras: Vec<_> = cameras.collect();
        let Some(&(node, index)) = cameras.first() else {
            self.notes.add("the scene has no camera; looking from a corner of it to its middle".to_owned());
            self.model.camera = Camera::looking(low.lerp(high, 0.95), low.lerp(high, 0.45), 60.0);
            self.contents.push("camera: none".to_owned());
            return Ok(());
        };
        let name = self.document.node(node);
        self.model.camera =
            camera(self.document, index, &self.hierarchy.globals[node]).map_err(|error| format!("{name}: {error}"))?;
        if cameras.len() > 1 {
            self.notes.add(format!("the scene has {} cameras, of which that of {name} is taken", cameras.len()));
        }
        let kind = if self.model.camera.parallel.is_some() { "orthographic" } else { "perspective" };
        self.contents.push(format!("camera: that of {name}, {kind}"));
        Ok(())
    }

    fn add_lamps(&mut self) -> Result<(), Error> {
        for index in self.hierarchy.visible.clone() {
            let node = &self.document.nodes[index];
            let within = |error: Error| Error::from(format!("{}: {error}", self.document.node(index)));
            let profiled = profiles::of_node(&self.data, node, &self.hierarchy.globals[index]).map_err(within)?;
            if let Some((lamp, described)) = profiled {
                let global = self.hierarchy.globals[index];
                if !global.is_finite() || global.w_axis.truncate().abs().max_element() > LARGEST {
                    return Err(within(format!("{described} is at {}", global.w_axis.truncate()).into()));
                }
                self.model.lamps.push(lamp);
                self.contents.push(format!("{}: {described}", self.document.node(index)));
            }
            let Some((lamp, called)) = lamps::of_node(self.document, node).map_err(within)? else { continue };
            let global = self.hierarchy.globals[index];
            if !global.is_finite() || global.w_axis.truncate().abs().max_element() > LARGEST {
                return Err(within(format!("{called} is at {}", global.w_axis.truncate()).into()));
            }
            lamps::add(&mut self.model, &lamp, &called, &global, &mut self.notes)
                .map_err(|error| within(format!("{called}: {error}").into()))?;
            self.contents.push(format!("{called} of {}: {}", self.document.node(index), lamps::described(&lamp)));
        }
        Ok(())
    }

    /// Tells what the file holds, and what `fanlight` will do with it.
    fn conclude(&mut self) {
        contents::note_near_misses(self.document, &self.model, &self.uses, &mut self.notes);
        let triangles: usize = self.model.meshes.iter().map(|mesh| mesh.indices.len()).sum();
        let [lights, portals] = contents::count(&self.model);
        let Document { nodes, meshes, materials, images, .. } = self.document;
        let mut lines = vec![
            format!(
                "nodes: {}, of which {} are in the scene; meshes: {}; materials: {}; images: {}",
                nodes.len(),
                self.hierarchy.visible.len(),
                meshes.len(),
                materials.len(),
                images.len()
            ),
            format!(
                "triangles: {triangles}, portal meshes: {portals}, emitting meshes: {lights}, lights without a surface: {}",
                self.model.lamps.len()
            ),
        ];
        lines.append(&mut self.contents);
        lines.append(&mut contents::list(self.document, &self.model, &self.uses));
        lines.extend((0..images.len()).map(|i| format!("{}: {}", self.document.image(i), self.images.state(i))));
        self.contents = lines;
        let lights = lights + self.model.lamps.len();
        if lights + portals == 0 && self.model.sky.is_none() {
            self.notes.add("nothing emits light, and there is no environment: all is black".to_owned());
        } else if lights + portals == 0 {
            let prefix = &self.model.portal_prefix;
            self.notes.add(format!(
                "there are no lamps, no material emits light, and none that lets light through has a name that starts with `{prefix}`: \
                 all light is the environment's"
            ));
        }
    }
}

fn camera(document: &Document, index: usize, transform: &Mat4) -> Result<Camera, Error> {
    let camera = member(&document.cameras, "camera", index)?;
    let axes = Mat3::from_mat4(*transform);
    let axis = |axis: Vec3, otherwise| axis.normalize_or(otherwise);
    let axes = Mat3::from_cols(axis(axes.x_axis, Vec3::X), axis(axes.y_axis, Vec3::Y), axis(axes.z_axis, Vec3::Z));
    let position = transform.w_axis.truncate();
    if !position.is_finite() || position.abs().max_element() > LARGEST {
        return Err(format!("the camera is at {position}").into());
    }
    match (&camera.perspective, &camera.orthographic) {
        (Some(perspective), _) if perspective.yfov > 0.0 && perspective.yfov < core::f32::consts::PI => {
            Ok(Camera::new(position, axes, perspective.yfov))
        }
        (None, Some(orthographic)) if orthographic.ymag.abs() > 0.0 && orthographic.ymag.abs() <= LARGEST => {
            Ok(Camera::new(position, axes, 1.0).parallel(2.0 * orthographic.ymag.abs()))
        }
        _ => {
            let name = super::document::called("camera", index, camera.name.as_deref());
            Err(format!("{name} has no field of view between 0 and 180 degrees, and no height").into())
        }
    }
}

/// Copies of a mesh in the world, as one mesh.
fn placed(local: &Mesh, places: &[Mat4]) -> Mesh {
    let mut all = Mesh::of(local.material);
    for place in places {
        let first = all.positions.len() as u32;
        let is_mirrored = skin::mirrors(place);
        all.positions.extend(local.positions.iter().map(|&position| place.transform_point3(position)));
        all.uvs.extend(&local.uvs);
        all.emission_uvs.extend(&local.emission_uvs);
        all.colors.extend(&local.colors);
        all.indices.extend(local.indices.iter().map(|corners| {
            let [a, b, c] = corners.map(|i| first + i);
            if is_mirrored { [a, c, b] } else { [a, b, c] }
        }));
    }
    all
}
