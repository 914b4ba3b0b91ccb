//! Scene files for renderers that know less than this one: triangles of even color, those that shine, and openings.

use std::path::Path;

use glam::{Mat3, Vec2, Vec3};

use crate::gltf::{self, Prefixes, Read};
use crate::render::{Bitmap, Daylight, LUMINANCE, Lobe, Material, Mesh, Model, Sky, direction_of, read_rgb};

/// What went wrong, in one line.
pub type Error = Box<dyn core::error::Error + Send + Sync>;

/// Most texels along a side of an emitter's image.
const MOST_TEXELS: usize = 1024;

/// Points along a triangle's edge, less one, at which its emission is looked up: more find smaller bright spots.
const GRID: u32 = 8;

/// Share of a material's emission below which its image is dark: what a byte of an image in sRGB may hold for black.
const DARK: f32 = 1e-3;

/// A scene.
#[derive(Clone, Debug)]
pub struct PlainScene {
    /// All triangles, by what they are.
    pub meshes: Vec<PlainMesh>,
    /// That of the file, or one that sees everything.
    pub camera: PlainCamera,
    /// What is seen outside; nothing if there is none.
    pub sky: Option<PlainSky>,
    /// What was ignored, or became something else than the file says.
    pub notes: Vec<String>,
}

/// Where the picture is taken from.
#[derive(Clone, Copy, Debug)]
pub struct PlainCamera {
    /// Where all rays start.
    pub position: Vec3,
    /// Camera to world; the columns are the image's right, its top, and backwards.
    pub axes: Mat3,
    /// Vertical field of view in radians.
    pub field_of_view: f32,
}

/// Triangles; the vertices run counter-clockwise around the front.
#[derive(Clone, Debug)]
pub struct PlainMesh {
    /// The vertices.
    pub positions: Vec<Vec3>,
    /// Where an emitter's image is read, one a vertex; from 0 to 1.
    pub uvs: Vec<Vec2>,
    /// The vertices of each triangle.
    pub indices: Vec<[u32; 3]>,
    /// What all of them are.
    pub surface: PlainSurface,
}

/// What a mesh is.
#[derive(Clone, Debug)]
pub enum PlainSurface {
    /// Scatters this share of the light evenly.
    Diffuse(Vec3),
    /// Reflects a share of the light by microfacets (GGX).
    Glossy {
        /// Roughness α.
        alpha: f32,
        /// What is reflected of the light.
        share: f32,
    },
    /// Shines from its front, with this luminance.
    Emitter(f32),
    /// Shines from its front, with luminances of an image that is read through the texture coordinates.
    Image(PlainImage),
    /// Nothing at all: the sky shines in through it. Its front faces the room.
    Portal,
}

/// A square image of luminances, the row at `v = 0` first.
#[derive(Clone, Debug)]
pub struct PlainImage {
    /// Texels a side.
    pub size: usize,
    /// Row by row.
    pub texels: Vec<f32>,
}

/// The radiance of the sky in a latitude-longitude image: the middle of column `u` and row `v`, both from 0 to 1, looks
/// along (sin φ sin θ, cos θ, −cos φ sin θ) with φ = 2π u and θ = π v.
#[derive(Clone, Debug)]
pub struct PlainSky {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row, in linear sRGB.
    pub texels: Vec<Vec3>,
}

/// What lights a scene from outside.
#[derive(Clone, Copy, Debug)]
pub enum Outside<'a> {
    /// A clear sky with a sun.
    Daylight,
    /// An image on disk.
    Image(&'a Path),
    /// Nothing.
    Dark,
}

/// Reads a glTF file. Materials whose names start with `window`, in capitals or not, are portals where they let light
/// through. If `panes` is given, those whose names start with it are portals instead, whatever the file says.
///
/// # Errors
///
/// If a file cannot be read, or holds what no renderer of triangles can show.
pub fn read(path: &Path, panes: Option<&str>, outside: Outside<'_>) -> Result<PlainScene, Error> {
    let sky = match outside {
        Outside::Daylight => Some(Daylight::new().draw()),
        Outside::Image(path) => Some(Sky::new(read_rgb(path)?)),
        Outside::Dark => None,
    };
    let prefixes = Prefixes { portals: panes.unwrap_or("window"), panes };
    let read = || gltf::read(&std::fs::read(path)?, path.parent(), prefixes, sky, gltf::Limits::RENDERABLE);
    let Read { model, notes, .. } = read().map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    if model.camera.parallel.is_some() {
        return Err(format!("the camera of {} looks along parallel rays", path.display()).into());
    }
    let camera = PlainCamera {
        position: model.camera.position,
        axes: model.camera.axes,
        field_of_view: model.camera.field_of_view,
    };
    let mut scene = PlainScene { meshes: Vec::new(), camera, sky: model.sky.as_deref().map(plain_sky), notes };
    if !model.lamps.is_empty() {
        scene.notes.push(format!("{} lights without a surface are left out", model.lamps.len()));
    }
    for mesh in model.meshes.iter().filter(|mesh| !mesh.indices.is_empty()) {
        scene.add(&model, mesh);
    }
    Ok(scene)
}

impl PlainScene {
    fn add(&mut self, model: &Model, mesh: &Mesh) {
        let material = &model.materials[mesh.material];
        let mut note = |what: &str| {
            let note = format!("material {}: {what}", material.name);
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        };
        if material.has_holes() && model.is_portal(mesh) {
            if material.masked || material.color_map.is_some() {
                note("the opening counts as clear everywhere");
            }
            self.meshes.push(plain_mesh(mesh, Vec::new(), PlainSurface::Portal));
            return;
        }
        let (shining, rest): (Vec<_>, Vec<_>) =
            mesh.indices.iter().partition(|corners| shines(model, material, mesh, **corners));
        if !shining.is_empty() {
            if material.two_sided {
                note("it shines from its front alone");
            }
            note("what shines reflects no light");
            let shining = Mesh { indices: shining, ..mesh.clone() };
            let (surface, uvs) = emitter(model, material, &shining, &mut note);
            self.meshes.push(plain_mesh(&shining, uvs, surface));
        }
        if rest.is_empty() {
            return;
        }
        if material.lobe == Lobe::Clear {
            return note("clear panes are left out");
        }
        if material.has_holes() {
            note("holes of its image are closed");
        }
        let rest = Mesh { indices: rest, ..mesh.clone() };
        let surface = reflecting(model, material, &rest, &mut note);
        self.meshes.push(plain_mesh(&rest, Vec::new(), surface));
    }
}

fn plain_mesh(mesh: &Mesh, uvs: Vec<Vec2>, surface: PlainSurface) -> PlainMesh {
    PlainMesh { positions: mesh.positions.clone(), uvs, indices: mesh.indices.clone(), surface }
}

/// Whether a triangle shines anywhere, as far as a grid of its points tells.
fn shines(model: &Model, material: &Material, mesh: &Mesh, corners: [u32; 3]) -> bool {
    let uvs = mesh.emission_uvs();
    let [a, b, c] = corners.map(|i| uvs.get(i as usize).copied().unwrap_or_default());
    let grid = (0..=GRID).flat_map(|i| (0..=GRID - i).map(move |j| [i, j].map(|k| k as f32 / GRID as f32)));
    let mut points = grid.map(|[s, t]| a + s * (b - a) + t * (c - a));
    material.emits()
        && points
            .any(|uv| LUMINANCE.dot(material.emission_at(&model.bitmaps, uv)) > DARK * LUMINANCE.dot(material.emission))
}

/// What a mesh reflects, in the mean over its triangles.
fn reflecting(model: &Model, material: &Material, mesh: &Mesh, note: &mut impl FnMut(&str)) -> PlainSurface {
    let color = mean(mesh, &mesh.uvs, |uv| material.color_at(&model.bitmaps, uv)) * mean_of_vertices(mesh);
    match material.lobe {
        Lobe::Rough(alpha) => PlainSurface::Glossy { alpha, share: LUMINANCE.dot(color) },
        Lobe::Diffuse => PlainSurface::Diffuse(color),
        Lobe::Clear | Lobe::Translucent(_) | Lobe::Glossy(_) => {
            note("it counts as diffuse");
            PlainSurface::Diffuse(color)
        }
    }
}

/// What a mesh sends out, with the texture coordinates by which its image is read, if it has one.
fn emitter(model: &Model, material: &Material, mesh: &Mesh, note: &mut impl FnMut(&str)) -> (PlainSurface, Vec<Vec2>) {
    let uvs = mesh.emission_uvs();
    let even = || {
        let radiance = mean(mesh, uvs, |uv| material.emission_at(&model.bitmaps, uv));
        (PlainSurface::Emitter(LUMINANCE.dot(radiance * mean_of_vertices(mesh))), Vec::new())
    };
    let Some(map) = material.emission_map else { return even() };
    let is_tiled = uvs.iter().any(|uv| uv.min_element() < 0.0 || uv.max_element() > 1.0);
    if is_tiled || !mesh.colors.is_empty() {
        note("it shines evenly, as its image is tiled or multiplied by colors of vertices");
        return even();
    }
    let bitmap: &Bitmap = &model.bitmaps[map];
    let size = bitmap.width.max(bitmap.height).min(MOST_TEXELS);
    let place = |i: usize| (i as f32 + 0.5) / size as f32;
    let texel = |i: usize| {
        let uv = Vec2::new(place(i % size), place(i / size));
        LUMINANCE.dot(material.emission_at(&model.bitmaps, uv))
    };
    let texels = (0..size * size).map(texel).collect();
    (PlainSurface::Image(PlainImage { size, texels }), uvs.to_vec())
}

/// Mean of a function over the centers of a mesh's triangles, by area.
fn mean(mesh: &Mesh, uvs: &[Vec2], value: impl Fn(Vec2) -> Vec3) -> Vec3 {
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for corners in &mesh.indices {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
        let uv = corners.iter().map(|&i| uvs.get(i as usize).copied().unwrap_or_default()).sum::<Vec2>() / 3.0;
        let area = (b - a).cross(c - a).length();
        (sum, total) = (sum + area * value(uv), total + area);
    }
    if total > 0.0 { sum / total } else { Vec3::ZERO }
}

/// Mean of the colors of a mesh's vertices.
fn mean_of_vertices(mesh: &Mesh) -> Vec3 {
    if mesh.colors.is_empty() { Vec3::ONE } else { mesh.colors.iter().sum::<Vec3>() / mesh.colors.len() as f32 }
}

fn plain_sky(sky: &Sky) -> PlainSky {
    let (width, height) = (sky.width(), sky.height());
    let texel = |i: usize| {
        let place = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        sky.radiance(direction_of(place / Vec2::new(width as f32, height as f32)))
    };
    PlainSky { width, height, texels: (0..width * height).map(texel).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Camera;

    /// A floor, a lamp of which half shines, a pane and an opening, written and read again.
    #[test]
    fn surfaces_are_what_the_file_says() {
        let mut model = Model::new(Camera::looking(Vec3::new(0.0, 1.0, 3.0), Vec3::ZERO, 50.0), None);
        let quad = |mesh: Mesh, y: f32| mesh.quad(Vec3::new(0.0, y, 0.0), Vec3::X, Vec3::Z);
        let half = |uv: Vec2| if uv.x < 0.5 { 1.0 } else { 0.0 };
        let image = model.bitmap(Bitmap::draw(64, 64, |uv| Vec3::splat(half(uv)).extend(1.0)));
        let floor = model.material(Material::new("floor", Vec3::new(0.5, 0.25, 0.125)));
        let lamp = Material { emission_map: Some(image), ..Material::emitter("lamp", Vec3::splat(2.0)) };
        let lamp = model.material(lamp);
        let pane = model.material(Material::new("pane", Vec3::ONE).lobe(Lobe::Clear));
        let window = model.material(Material::new("Window", Vec3::ONE).lobe(Lobe::Clear));
        let left = Mesh { uvs: vec![Vec2::ZERO, Vec2::X * 0.4, Vec2::ONE * 0.4, Vec2::Y], ..quad(lamp.clone(), 1.0) };
        let right = Mesh { uvs: vec![Vec2::X, Vec2::X, Vec2::ONE, Vec2::ONE], ..quad(lamp, 2.0) };
        for mesh in [quad(floor, 0.0), left, right, quad(pane, 3.0), quad(window, 4.0)] {
            model.add(mesh);
        }
        let folder = std::env::temp_dir().join(format!("fanlight-plain-{}", std::process::id()));
        let path = gltf::write(&folder, "plain", &model).expect("the folder can be written");
        let flagged = read(&path, Some("pane"), Outside::Dark).expect("the file is sound");
        let read = read(&path, None, Outside::Dark).expect("the file is sound");
        std::fs::remove_dir_all(&folder).expect("the folder is there");

        let height = |mesh: &PlainMesh| mesh.positions[mesh.indices[0][0] as usize].y as u32;
        let openings = flagged.meshes.iter().filter(|mesh| matches!(mesh.surface, PlainSurface::Portal));
        assert_eq!(openings.map(height).collect::<Vec<_>>(), [3]);
        let at = |y: u32| read.meshes.iter().find(|mesh| height(mesh) == y).map(|mesh| &mesh.surface);
        let is_near = |a: f32, b: f32| (a - b).abs() < 0.01;
        assert!(
            matches!(at(0), Some(PlainSurface::Diffuse(color)) if is_near(color.x, 0.5) && is_near(color.z, 0.125))
        );
        assert!(matches!(at(1), Some(PlainSurface::Image(image)) if image.size == 64 && is_near(image.texels[0], 2.0)));
        assert!(matches!(at(2), Some(PlainSurface::Diffuse(_))), "it does not shine");
        assert!(at(3).is_none(), "nothing is left of a pane");
        assert!(matches!(at(4), Some(PlainSurface::Portal)));
        assert!(is_near(read.camera.position.z, 3.0) && read.sky.is_none());
        assert!(read.notes.iter().any(|note| note == "material pane: clear panes are left out"), "{:?}", read.notes);
    }
}
