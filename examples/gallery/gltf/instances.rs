//! Copies of a mesh (`EXT_mesh_gpu_instancing`).

use glam::{Mat4, Quat, Vec3};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::data::Data;
use super::document::{Node, attribute, extension};
use super::hierarchy::unit;
use crate::render::Error;

/// Name of the extension.
const NAME: &str = "EXT_mesh_gpu_instancing";

#[derive(Deserialize)]
struct Instancing {
    #[serde(default)]
    attributes: Map<String, Value>,
}

/// Where the copies of a node's mesh stand, in the node's own coordinates: at least one.
pub(super) fn instances(data: &Data<'_>, node: &Node) -> Result<Vec<Mat4>, Error> {
    let Some(Instancing { attributes }) = extension(&node.extensions, NAME)? else { return Ok(vec![Mat4::IDENTITY]) };
    let fails = |error: Error| Error::from(format!("{NAME}: {error}"));
    let place = |name: &str| attribute(&attributes, name).map_err(fails);
    let [translation, rotation, scale] = [place("TRANSLATION")?, place("ROTATION")?, place("SCALE")?];
    let counts = [translation, rotation, scale].into_iter().flatten().map(|index| Ok(data.shape(index)?[0]));
    let counts = counts.collect::<Result<Vec<usize>, Error>>().map_err(fails)?;
    let count = counts.first().copied().unwrap_or(1);
    if counts.iter().any(|&other| other != count) {
        return Err(fails("its attributes are of different lengths".into()));
    }
    let mut matrices = vec![Mat4::IDENTITY; count.min(data.limits.triangles)];
    if let Some(index) = scale {
        let scales = data.floats::<3>(index).map_err(fails)?;
        matrices.iter_mut().zip(scales).for_each(|(matrix, scale)| *matrix = Mat4::from_scale(Vec3::from(scale)));
    }
    if let Some(index) = rotation {
        for (matrix, rotation) in matrices.iter_mut().zip(data.floats::<4>(index).map_err(fails)?) {
            *matrix = Mat4::from_quat(unit(Quat::from_array(rotation))) * *matrix;
        }
    }
    if let Some(index) = translation {
        for (matrix, translation) in matrices.iter_mut().zip(data.floats::<3>(index).map_err(fails)?) {
            *matrix = Mat4::from_translation(Vec3::from(translation)) * *matrix;
        }
    }
    Ok(matrices)
}
