//! Scenes from glTF files, as the gallery reads them.

use std::path::Path;
use std::sync::Arc;

use fanlight_gallery::plain::{self, Outside, PlainMesh, PlainScene, PlainSky, PlainSurface};
use glam::{Mat3, Vec3};

use super::texture::Texture;
use super::{Emitter, Portal, Radiance, Scene, night};
use crate::Error;
use crate::bsdf::Material;
use crate::camera::Camera;
use crate::film::Image;
use crate::geometry::{Mesh, Rectangle};
use crate::sky::Sky;

/// Diagonal of a scene in meters, whatever the file says: distances that rays keep are those of a room.
const DIAGONAL: f32 = 10.0;

/// From the sky's own frame to a world whose y is up.
const UPRIGHT: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y);

/// What lights a file from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surroundings<'a> {
    /// What the gallery knows.
    Of(Outside<'a>),
    /// The sky of `night-room`.
    Night,
}

/// Reads a scene. Prints what is not as the file says.
pub(crate) fn read(path: &Path, panes: Option<&str>, surroundings: Surroundings<'_>) -> Result<Scene, Error> {
    let outside = match surroundings {
        Surroundings::Of(outside) => outside,
        // Replaced below: with darkness, a note would say that all is black.
        Surroundings::Night => Outside::Daylight,
    };
    let mut read = plain::read(path, panes, outside)?;
    if matches!(surroundings, Surroundings::Night) {
        let night = night::sky();
        let Image { width, height, pixels } = night.image();
        read.sky = Some(PlainSky { width: *width, height: *height, texels: pixels.clone() });
    }
    read.notes.iter().for_each(|note| eprintln!("note: {note}"));
    convert(read).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn convert(PlainScene { mut meshes, camera, sky, .. }: PlainScene) -> Result<Scene, Error> {
    let corners = || meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
    let (low, high) = corners().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    let scale = DIAGONAL / (high - low).length();
    if !scale.is_finite() {
        return Err("there are no triangles".into());
    }
    meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(|position| *position *= scale);

    let mut scene = Scene {
        camera: Camera::with_axes(scale * camera.position, camera.axes, camera.field_of_view),
        solids: Vec::new(),
        emitters: Vec::new(),
        portals: Vec::new(),
        sky: sky.map(sky_of),
        inside: None,
    };
    meshes.into_iter().for_each(|mesh| scene.add(mesh));
    if scene.sky.is_none() && scene.emitters.is_empty() {
        return Err("nothing shines".into());
    }
    Ok(scene)
}

impl Scene {
    fn add(&mut self, PlainMesh { positions, uvs, indices, surface }: PlainMesh) {
        let mesh = Mesh { positions, indices, uvs };
        match surface {
            PlainSurface::Diffuse(albedo) => self.solids.push((mesh, Material::Diffuse(albedo))),
            PlainSurface::Glossy { alpha, share } => self.solids.push((mesh, Material::Glossy { alpha, share })),
            PlainSurface::Emitter(radiance) => {
                self.emitters.push(Emitter { mesh: without_slivers(mesh), radiance: Radiance::Constant(radiance) });
            }
            PlainSurface::Image(image) => {
                let texture = Arc::new(Texture { size: image.size, texels: image.texels });
                self.emitters.push(Emitter { mesh: without_slivers(mesh), radiance: Radiance::Textured(texture) });
            }
            PlainSurface::Portal => match rectangles(&mesh) {
                Some(rectangles) => self.portals.extend(rectangles.into_iter().map(Portal::from)),
                None => self.portals.push(Portal { mesh, rectangle: None }),
            },
        }
    }
}

/// Returns the rectangles that pairs of triangles make up, if all do.
fn rectangles(mesh: &Mesh) -> Option<Vec<Rectangle>> {
    let (pairs, rest) = mesh.indices.as_chunks::<2>();
    let rectangle =
        |pair: &[[u32; 3]; 2]| Rectangle::of(pair.map(|corners| corners.map(|i| mesh.positions[i as usize])));
    if rest.is_empty() { pairs.iter().map(rectangle).collect() } else { None }
}

/// Takes out triangles without an area, which have no normal.
fn without_slivers(mut mesh: Mesh) -> Mesh {
    let positions = &mesh.positions;
    mesh.indices.retain(|corners| {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        (b - a).cross(c - a).length() > 0.0
    });
    mesh
}

fn sky_of(PlainSky { width, height, texels }: PlainSky) -> Sky {
    Sky::new(Image { width, height, pixels: texels }, UPRIGHT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fanlight_gallery::plain::PlainCamera;

    fn mesh(quads: &[[Vec3; 4]], surface: PlainSurface) -> PlainMesh {
        let indices =
            (0..quads.len() as u32).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
        PlainMesh { positions: quads.concat(), uvs: Vec::new(), indices: indices.collect(), surface }
    }

    #[test]
    fn openings_are_rectangles_where_they_can_be() {
        let quad = |x: f32, top: f32| [[0.0, 0.0], [1.0, 0.0], [top, 1.0], [0.0, 1.0]].map(|[y, z]| Vec3::new(x, y, z));
        let portals = [
            mesh(&[quad(0.0, 1.0), quad(3.0, 1.0)], PlainSurface::Portal),
            mesh(&[quad(6.0, 0.5)], PlainSurface::Portal),
        ];
        let camera = PlainCamera { position: Vec3::X, axes: Mat3::IDENTITY, field_of_view: 1.0 };
        let plain = PlainScene { meshes: portals.to_vec(), camera, sky: None, notes: Vec::new() };
        assert!(convert(plain.clone()).is_err(), "nothing shines");
        let sky = Some(PlainSky { width: 2, height: 1, texels: vec![Vec3::ONE; 2] });
        let scene = convert(PlainScene { sky, ..plain }).expect("the sky shines");
        let normals: Vec<_> = scene.portals.iter().map(|portal| portal.rectangle.map(|r| r.normal())).collect();
        assert_eq!(normals, [Some(Vec3::X), Some(Vec3::X), None]);
        let length = scene.portals[0].mesh.positions[0].distance(scene.portals[2].mesh.positions[2]);
        assert!((0.9 * DIAGONAL..=DIAGONAL).contains(&length), "{length}");
    }

    #[test]
    fn skies_stand_upright() {
        let (width, height) = (8, 4);
        let mut texels = vec![Vec3::ZERO; width * height];
        texels[width + 1] = Vec3::ONE;
        let sky = sky_of(PlainSky { width, height, texels });
        let [phi, theta] = [(1.5 / width as f32) * core::f32::consts::TAU, 1.5 / height as f32 * core::f32::consts::PI];
        let direction = Vec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin());
        assert!((sky.radiance(direction) - Vec3::ONE).length() < 1e-3, "{}", sky.radiance(direction));
    }

    #[test]
    fn night_lights_a_file() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fuzz/files/rich.gltf"));
        let scene = read(path, None, Surroundings::Night).expect("the file is sound");
        let sky = scene.sky.expect("the sky of night-room");
        assert_eq!(sky.image().pixels, night::sky().image().pixels);
    }
}
