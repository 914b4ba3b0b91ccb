//! Lights without a surface (`KHR_lights_punctual`).

use core::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Mat4, Vec3};
use serde::Deserialize;

use super::document::{Document, Node, called, extension, member};
use super::notes::Notes;
use crate::render::{Error, Lamp, LampKind, Model};

/// Name of the extension.
const NAME: &str = "KHR_lights_punctual";
/// Strongest light. Sums of stronger ones overflow.
const STRONGEST: f32 = 1e12;

/// A light as the file describes it.
#[derive(Deserialize)]
#[serde(default)]
pub(super) struct Light {
    pub(super) name: Option<String>,
    #[serde(rename = "type")]
    pub(super) kind: String,
    color: [f32; 3],
    intensity: f32,
    range: Option<f32>,
    spot: Spot,
}

impl Default for Light {
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
pub(super) fn of_node(document: &Document, node: &Node) -> Result<Option<(Light, String)>, Error> {
    let Some(Reference { light }) = extension(&node.extensions, NAME)? else { return Ok(None) };
    let lights = document.extensions.get(NAME).and_then(|extension| extension.get("lights")?.as_array());
    let lamp = member(lights.map_or(&[][..], Vec::as_slice), "light", light)?;
    let lamp = Light::deserialize(lamp).map_err(|error| format!("light {light} cannot be read ({error})"))?;
    let called = called("light", light, lamp.name.as_deref());
    Ok(Some((lamp, called)))
}

/// Adds a light to a scene.
pub(super) fn add(
    model: &mut Model,
    light: &Light,
    called: &str,
    transform: &Mat4,
    notes: &mut Notes,
) -> Result<(), Error> {
    let strength = light.intensity * Vec3::from(light.color);
    if strength.min_element() < 0.0 || !(strength.max_element() <= STRONGEST) {
        return Err(format!("its strength is {strength}, but must be from 0 to {STRONGEST:e}").into());
    }
    if light.range.is_some() {
        notes.about(called, "its range is ignored: light falls off with the square of the distance");
    }
    let position = transform.w_axis.truncate();
    let forward = -transform.z_axis.truncate().normalize_or(Vec3::Z);
    let kind = match light.kind.as_str() {
        "point" => LampKind::Point(position),
        "spot" => LampKind::Spot(position, forward, light.spot.angles()),
        "directional" => LampKind::Distant(forward, 0.0),
        kind => return Err(format!("there is no type `{}`", kind.escape_debug()).into()),
    };
    model.lamps.push(Lamp { kind, strength });
    Ok(())
}

/// What a light is, and how strong, for a list.
pub(super) fn described(light: &Light) -> String {
    let unit = if light.kind == "directional" { "lux" } else { "candela" };
    format!("{} of {} {unit}", light.kind.escape_debug(), light.intensity * Vec3::from(light.color))
}

impl Spot {
    /// Angles of the inner and the outer cone.
    fn angles(&self) -> [f32; 2] {
        let outer = self.outer_cone_angle.clamp(1e-3, FRAC_PI_2);
        [self.inner_cone_angle.clamp(0.0, outer), outer]
    }
}
