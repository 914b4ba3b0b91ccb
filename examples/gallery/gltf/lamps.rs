//! Lights without a surface (`KHR_lights_punctual`), as something that the renderer has.

use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{Mat4, Vec2, Vec3, vec2};
use serde::Deserialize;

use super::document::{Document, Node, called, extension, member};
use super::notes::Notes;
use crate::render::{Error, Image, Material, Mesh, Model, Sky, direction_of};

/// Name of the extension.
const NAME: &str = "KHR_lights_punctual";
/// Radius of the sphere that stands for a point, as a share of the scene's diagonal: too small to be seen, and large
/// enough that rays which start next to surfaces do not miss it.
const RADIUS: f32 = 2.5e-4;
/// Radius of the shade of a spot in radii of its sphere: the larger, the sharper the cone's edge.
const SHADE: f32 = 10.0;
/// Rows of triangles of a sphere.
const RINGS: u32 = 8;
/// Columns of a sky that a distant light is added to, at least: 0.35 degrees each.
const COLUMNS: usize = 1024;
/// Angular radius of a distant light: two texels of such a sky, so that they sum up to a disk.
const ANGLE: f32 = 0.014;
/// Strongest light. Sums of stronger ones overflow.
const STRONGEST: f32 = 1e12;

/// A light as the file describes it.
#[derive(Deserialize)]
#[serde(default)]
pub(super) struct Lamp {
    pub(super) name: Option<String>,
    #[serde(rename = "type")]
    pub(super) kind: String,
    color: [f32; 3],
    intensity: f32,
    range: Option<f32>,
    spot: Spot,
}

impl Default for Lamp {
    fn default() -> Self {
        Self { name: None, kind: String::new(), color: [1.0; 3], intensity: 1.0, range: None, spot: Spot::default() }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Spot {
    inner_cone_angle: f32,
    outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Self {
        Self { inner_cone_angle: 0.0, outer_cone_angle: FRAC_PI_4 }
    }
}

#[derive(Deserialize)]
struct Reference {
    light: usize,
}

/// The light that a node holds, and what messages call it.
pub(super) fn of_node(document: &Document, node: &Node) -> Result<Option<(Lamp, String)>, Error> {
    let Some(Reference { light }) = extension(&node.extensions, NAME)? else { return Ok(None) };
    let lights = document.extensions.get(NAME).and_then(|extension| extension.get("lights")?.as_array());
    let lamp = member(lights.map_or(&[][..], Vec::as_slice), "light", light)?;
    let lamp = Lamp::deserialize(lamp).map_err(|error| format!("light {light} cannot be read ({error})"))?;
    let called = called("light", light, lamp.name.as_deref());
    Ok(Some((lamp, called)))
}

/// Adds a light to a scene of some diagonal. The renderer has no lights without a surface, so each is made of what it has.
pub(super) fn add(
    model: &mut Model,
    lamp: &Lamp,
    called: &str,
    transform: &Mat4,
    diagonal: f32,
    notes: &mut Notes,
) -> Result<(), Error> {
    let strength = lamp.intensity * Vec3::from(lamp.color);
    if strength.min_element() < 0.0 || !(strength.max_element() <= STRONGEST) {
        return Err(format!("its strength is {strength}, but must be from 0 to {STRONGEST:e}").into());
    }
    if lamp.range.is_some() {
        notes.about(called, "its range is ignored: light falls off with the square of the distance");
    }
    let position = transform.w_axis.truncate();
    let forward = -transform.z_axis.truncate().normalize_or(Vec3::Z);
    match lamp.kind.as_str() {
        "point" => {
            notes.about(called, "this point light is a small sphere of the same power");
            add_sphere(model, strength, position, RADIUS * diagonal);
        }
        "spot" => {
            notes.about(called, "this spot is a small sphere of the same intensity in a black shade");
            add_sphere(model, strength, position, RADIUS * diagonal);
            add_shade(model, lamp.spot.half_angle(), position, forward, SHADE * RADIUS * diagonal);
        }
        "directional" => {
            notes.about(called, "this directional light is a small disk in the environment");
            let sky = with_disk(model.sky.as_deref(), -forward, strength);
            model.sky = Some(sky.into());
        }
        kind => return Err(format!("there is no type `{}`", kind.escape_debug()).into()),
    }
    Ok(())
}

/// A sphere of an intensity, in units of power per solid angle.
fn add_sphere(model: &mut Model, intensity: Vec3, center: Vec3, radius: f32) {
    let mut mesh = Mesh::default().sphere(center, radius, RINGS);
    let unit = Mesh::default().sphere(Vec3::ZERO, 1.0, RINGS);
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| unit.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    // The mean silhouette of a convex body is a quarter of its surface.
    let silhouette = radius * radius * 0.25 * unit.indices.iter().copied().map(area).sum::<f32>();
    mesh.material = model.material(Material::emitter("", intensity / silhouette)).material;
    model.add(mesh);
}

/// A black sphere around a spot that is open to the front.
fn add_shade(model: &mut Model, half_angle: f32, center: Vec3, forward: Vec3, radius: f32) {
    let (u, v) = forward.any_orthonormal_pair();
    let mut mesh = model.material(Material::new("", Vec3::ZERO));
    mesh.grid([4 * RINGS, RINGS], |at: Vec2| {
        let (sin_phi, cos_phi) = (TAU * at.x).sin_cos();
        let (sin, cos) = (half_angle + (PI - half_angle) * at.y).sin_cos();
        center + radius * (cos * forward + sin * (cos_phi * u + sin_phi * v))
    });
    model.add(mesh);
}

impl Spot {
    /// Half angle of the cone with a sharp edge that holds as much light: between the two cones it falls off as the
    /// square of a line in the cosine, whose mean is a third.
    fn half_angle(&self) -> f32 {
        let outer = self.outer_cone_angle.clamp(1e-3, FRAC_PI_2);
        let [inner, outer] = [self.inner_cone_angle.clamp(0.0, outer).cos(), outer.cos()];
        (inner - (inner - outer) / 3.0).acos()
    }
}

/// A sky with a small disk in it that gives an irradiance to what faces it.
fn with_disk(sky: Option<&Sky>, towards: Vec3, irradiance: Vec3) -> Sky {
    let width = sky.map_or(COLUMNS, |sky| sky.width().max(COLUMNS));
    let height = sky.map_or(COLUMNS / 2, |sky| sky.height().max(COLUMNS / 2));
    let mut image = Image::black(width, height);
    let middle = |i: usize| vec2(((i % width) as f32 + 0.5) / width as f32, ((i / width) as f32 + 0.5) / height as f32);
    let mut disk = Vec::new();
    let mut solid_angle = 0.0;
    for (i, texel) in image.pixels.iter_mut().enumerate() {
        let direction = direction_of(middle(i));
        *texel = sky.map_or(Vec3::ZERO, |sky| sky.radiance(direction));
        if direction.distance(towards) < ANGLE {
            disk.push(i);
            solid_angle += TAU / width as f32 * PI / height as f32 * (1.0 - direction.y * direction.y).sqrt();
        }
    }
    for i in disk {
        image.pixels[i] += irradiance / solid_angle;
    }
    Sky::new(image)
}
