//! Skins: meshes that joints move.

use glam::{Mat4, Vec3, Vec4};

use super::data::Data;
use super::document::{Primitive, Skin, attribute, called, member};
use crate::render::Error;

/// Most sets of four joints a vertex.
const SETS: u32 = 4;

/// What the joints of a skin do to a mesh, as they stand.
pub(super) fn joints(data: &Data<'_>, index: usize, globals: &[Mat4]) -> Result<Vec<Mat4>, Error> {
    let skin = member(&data.document.skins, "skin", index)?;
    let fails = |error: Error| format!("{}: {error}", called("skin", index, skin.name.as_deref()));
    joints_of(data, skin, globals).map_err(|error| fails(error).into())
}

fn joints_of(data: &Data<'_>, skin: &Skin, globals: &[Mat4]) -> Result<Vec<Mat4>, Error> {
    let inverse: Vec<[f32; 16]> = skin.inverse_bind_matrices.map_or(Ok(vec![]), |index| data.floats(index))?;
    let joint = |(i, &node): (usize, &usize)| {
        let inverse = inverse.get(i).map_or(Mat4::IDENTITY, Mat4::from_cols_array);
        Ok(*member(globals, "node", node)? * inverse)
    };
    skin.joints.iter().enumerate().map(joint).collect()
}

/// Moves the vertices of a primitive. Returns whether it says how.
pub(super) fn apply(
    data: &Data<'_>,
    primitive: &Primitive,
    joints: &[Mat4],
    positions: &mut [Vec3],
) -> Result<bool, Error> {
    let mut sums = vec![(Vec3::ZERO, 0.0_f32); positions.len()];
    for set in 0..SETS {
        let [places, weights] =
            ["JOINTS", "WEIGHTS"].map(|name| attribute(&primitive.attributes, &format!("{name}_{set}")));
        let (Some(places), Some(weights)) = (places?, weights?) else { break };
        let places = data.integers::<4>(places)?.into_iter();
        let weights = data.floats::<4>(weights)?.into_iter();
        for ((position, (sum, total)), (places, weights)) in positions.iter().zip(&mut sums).zip(places.zip(weights)) {
            for (place, weight) in places.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
                let joint = member(joints, "joint", place as usize)?;
                *sum += weight * joint.transform_point3(*position);
                *total += weight;
            }
        }
    }
    let moves = sums.iter().any(|(_, total)| *total > 0.0);
    for (position, (sum, total)) in positions.iter_mut().zip(sums) {
        if total > 0.0 {
            *position = sum / total;
        }
    }
    Ok(moves)
}

/// Whether a matrix mirrors.
pub(super) fn mirrors(matrix: &Mat4) -> bool {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(Vec4::truncate);
    x.cross(y).dot(z) < 0.0
}
