//! Lights with measured profiles (`EXT_lights_ies`).

use glam::{Mat3, Mat4, Vec3};
use serde::Deserialize;

use super::alloc::sync::Arc;
use super::data::Data;
use super::document::{Node, extension, member};
use crate::ies::{self, Luminaire};
use crate::render::{Diagram, Error, Lamp, LampKind};

/// Name of the extension.
const NAME: &str = "EXT_lights_ies";
/// Strongest light. Sums of stronger ones overflow.
const STRONGEST: f32 = 1e12;

/// Where a profile is.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Source {
    uri: Option<String>,
    buffer_view: Option<usize>,
}

/// What a node says of its light.
#[derive(Deserialize)]
struct Reference {
    light: usize,
    #[serde(default = "one")]
    multiplier: f32,
    #[serde(default = "white")]
    color: [f32; 3],
}

const fn one() -> f32 {
    1.0
}

const fn white() -> [f32; 3] {
    [1.0; 3]
}

/// The light that a node holds, and what a list says of it. The point of both angles 0 is along -z, for all types of
/// photometry ("Coordinate System Mapping" of the extension), and the vertical plane is that of x and z.
pub(super) fn of_node(data: &Data<'_>, node: &Node, transform: &Mat4) -> Result<Option<(Lamp, String)>, Error> {
    let Some(Reference { light, multiplier, color }) = extension(&node.extensions, NAME)? else { return Ok(None) };
    let lights = data.document.extensions.get(NAME).and_then(|extension| extension.get("lights")?.as_array());
    let source = member(lights.map_or(&[][..], Vec::as_slice), "light profile", light)?;
    let within = |error: String| Error::from(format!("light profile {light}: {error}"));
    let source = Source::deserialize(source).map_err(|error| within(error.to_string()))?;
    let bytes = match (&source.uri, source.buffer_view) {
        (Some(uri), _) => data.resource(uri),
        (None, Some(view)) => data.view(view).map(<[u8]>::to_vec),
        (None, None) => Err("it has neither a URI nor a bufferView".into()),
    };
    let bytes = bytes.map_err(|error| within(error.to_string()))?;
    let luminaire = ies::read(&String::from_utf8_lossy(&bytes)).map_err(|error| within(error.to_string()))?;
    let strength = multiplier * Vec3::from(color);
    let brightest = luminaire.intensities.iter().fold(0.0, |brightest: f32, value| brightest.max(*value));
    if !(strength.min_element() >= 0.0 && strength.max_element() * brightest <= STRONGEST) {
        return Err(within(format!(
            "its strength is {strength}, but must be from 0, and its candelas up to {STRONGEST:e}"
        )));
    }
    let described = format!("light profile {light} of up to {} candela", brightest * strength);
    let Luminaire { vertical, horizontal, frame, intensities } = luminaire;
    let rotation = rotation(transform);
    let [axis, zero] = frame.map(|direction| rotation * direction);
    let diagram = Diagram { axis, zero, vertical, horizontal, intensities };
    Ok(Some((Lamp { kind: LampKind::Luminaire(transform.w_axis.truncate(), Arc::new(diagram)), strength }, described)))
}

/// Returns the rotation of a node. Its z and x are kept, and y is so that scales and mirrors do not change a light.
fn rotation(transform: &Mat4) -> Mat3 {
    let z = transform.z_axis.truncate().normalize_or(Vec3::Z);
    let x = transform.x_axis.truncate().reject_from_normalized(z).normalize_or(z.any_orthonormal_vector());
    Mat3::from_cols(x, z.cross(x), z)
}
