//! One primitive of a mesh: positions, texture coordinates and colors.

use glam::{Mat4, Vec2, Vec3};

use super::data::Data;
use super::document::{Primitive, attribute};
use super::notes::Notes;
use super::skin;
use super::texture::Mapping;
use super::triangles::{TRIANGLES, mode_name, triangles};
use crate::render::{Error, Mesh};

/// Name of the compression that is not read.
const DRACO: &str = "KHR_draco_mesh_compression";
/// Cosine between two triangles above which they count as one plane: two degrees. *Chosen* so that rounding is no edge.
const FLAT: f32 = 0.9994;

/// How a primitive is to be read.
pub(super) struct Wanted<'a> {
    /// What notes call its mesh.
    pub(super) called: &'a str,
    /// How much of each morph target is added.
    pub(super) weights: &'a [f32],
    /// What joints do to it.
    pub(super) joints: Option<&'a [Mat4]>,
    pub(super) color: Option<Mapping>,
    pub(super) emission: Option<Mapping>,
    /// Whether its material lets light through where there is no alpha.
    pub(super) has_alpha: bool,
    /// Number of its material.
    pub(super) material: usize,
}

/// Reads a primitive in its own coordinates, or in those of the world if joints move it, and whether they do. `None` if
/// it holds no triangles.
pub(super) fn read(
    data: &Data<'_>,
    primitive: &Primitive,
    wanted: &Wanted<'_>,
    notes: &mut Notes,
) -> Result<Option<(Mesh, bool)>, Error> {
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    let Some(positions) = attribute(&primitive.attributes, "POSITION")? else {
        notes.about(wanted.called, "it has no positions, and is ignored");
        return Ok(None);
    };
    refuse_draco(data, primitive, positions)?;
    let mut positions: Vec<Vec3> = data.floats::<3>(positions)?.into_iter().map(Vec3::from).collect();
    let corners: Vec<u32> = match primitive.indices {
        Some(indices) => data.integers::<1>(indices)?.into_iter().flatten().collect(),
        None => (0..positions.len() as u32).collect(),
    };
    let Some(indices) = triangles(mode, &corners) else {
        notes.about(wanted.called, &format!("it holds {}, which are ignored", mode_name(mode)));
        return Ok(None);
    };
    if let Some(index) = indices.as_flattened().iter().find(|&&index| index as usize >= positions.len()) {
        return Err(format!("it uses vertex {index}, but has {}", positions.len()).into());
    }
    if primitive.attributes.contains_key("NORMAL") && is_curved(&positions, &indices) {
        notes.about(wanted.called, "its normals are ignored: it is as flat as its triangles");
    }
    morph(data, primitive, wanted, &mut positions, notes)?;
    let is_skinned = match wanted.joints {
        Some(joints) => skin::apply(data, primitive, joints, &mut positions)?,
        None => false,
    };
    let uvs = coordinates(data, primitive, wanted, wanted.color.or(wanted.emission), positions.len(), notes)?;
    let emission_uvs = match (wanted.color, wanted.emission) {
        (Some(color), Some(emission)) if color != emission => {
            coordinates(data, primitive, wanted, Some(emission), positions.len(), notes)?
        }
        _ => vec![],
    };
    let colors = colors(data, primitive, wanted, positions.len(), notes)?;
    let mesh =
        Mesh { positions, uvs, emission_uvs, colors, indices, material: wanted.material, bulb: None, copies: None };
    Ok(Some((mesh, is_skinned)))
}

/// Whether triangles that share a vertex face different sides, so that normals smooth the edges between them.
fn is_curved(positions: &[Vec3], indices: &[[u32; 3]]) -> bool {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    indices.iter().any(|corners| {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        corners.iter().any(|&i| {
            let known = core::mem::replace(&mut normals[i as usize], normal);
            known != Vec3::ZERO && normal != Vec3::ZERO && known.dot(normal) < FLAT
        })
    })
}

fn refuse_draco(data: &Data<'_>, primitive: &Primitive, positions: usize) -> Result<(), Error> {
    let is_compressed = primitive.extensions.contains_key(DRACO);
    let has_fallback = data.document.accessors.get(positions).is_some_and(|accessor| accessor.buffer_view.is_some());
    if is_compressed && !has_fallback {
        return Err(format!(
            "it is compressed with {DRACO}, which is not supported; \
             `gltf-transform copy in.glb out.glb` takes the compression out"
        )
        .into());
    }
    Ok(())
}

fn morph(
    data: &Data<'_>,
    primitive: &Primitive,
    wanted: &Wanted<'_>,
    positions: &mut [Vec3],
    notes: &mut Notes,
) -> Result<(), Error> {
    for (target, &weight) in primitive.targets.iter().zip(wanted.weights).filter(|(_, weight)| **weight != 0.0) {
        if let Some(index) = attribute(target, "POSITION")? {
            let moves = data.floats::<3>(index)?;
            positions.iter_mut().zip(moves).for_each(|(position, by)| *position += weight * Vec3::from(by));
        }
        if target.keys().any(|name| name.starts_with("TEXCOORD") || name.starts_with("COLOR")) {
            notes.about(wanted.called, "its morph targets' texture coordinates and colors are ignored");
        }
    }
    Ok(())
}

/// Texture coordinates where a mapping reads them; zeros if there is none.
fn coordinates(
    data: &Data<'_>,
    primitive: &Primitive,
    wanted: &Wanted<'_>,
    mapping: Option<Mapping>,
    count: usize,
    notes: &mut Notes,
) -> Result<Vec<Vec2>, Error> {
    let Some(mapping) = mapping else { return Ok(vec![Vec2::ZERO; count]) };
    let name = format!("TEXCOORD_{}", mapping.set);
    let mut uvs: Vec<Vec2> = match attribute(&primitive.attributes, &name)? {
        Some(index) => data.floats::<2>(index)?.into_iter().map(Vec2::from).collect(),
        None => {
            notes.about(wanted.called, &format!("it has no {name}, which its material reads: zeros are taken"));
            vec![Vec2::ZERO; count]
        }
    };
    uvs.iter_mut().for_each(|uv| *uv = mapping.apply(*uv));
    check_length(&name, uvs.len(), count)?;
    match uvs.iter().find(|uv| !uv.is_finite()) {
        Some(uv) => Err(format!("one of its texture coordinates is {uv}").into()),
        None => Ok(uvs),
    }
}

/// Colors of vertices; none if all of them are white.
fn colors(
    data: &Data<'_>,
    primitive: &Primitive,
    wanted: &Wanted<'_>,
    count: usize,
    notes: &mut Notes,
) -> Result<Vec<Vec3>, Error> {
    let Some(index) = attribute(&primitive.attributes, "COLOR_0")? else { return Ok(vec![]) };
    let colors: Vec<Vec3> = match data.shape(index)? {
        [_, 4] => {
            let colors = data.floats::<4>(index)?;
            if wanted.has_alpha && colors.iter().any(|color| color[3] < 1.0) {
                notes.about(wanted.called, "the alpha of its vertices' colors is ignored");
            }
            colors.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect()
        }
        _ => data.floats::<3>(index)?.into_iter().map(Vec3::from).collect(),
    };
    check_length("COLOR_0", colors.len(), count)?;
    if let Some(color) = colors.iter().find(|color| !color.is_finite() || color.min_element() < 0.0) {
        return Err(format!("one of its vertices has the color {color}").into());
    }
    Ok(if colors.iter().all(|&color| color == Vec3::ONE) { vec![] } else { colors })
}

fn check_length(name: &str, found: usize, count: usize) -> Result<(), Error> {
    if found == count { Ok(()) } else { Err(format!("it has {count} positions, but {found} {name}").into()) }
}
