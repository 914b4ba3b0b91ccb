//! Where nodes stand, and which of them the scene holds. Nothing here calls itself, so that chains may be deep.

use glam::{Mat4, Quat, Vec3};

use super::document::{Document, Node, extension, member};
use super::notes::Notes;
use crate::render::Error;

/// Nodes of a scene.
pub(super) struct Hierarchy {
    /// Node to world, of all nodes of the file.
    pub(super) globals: Vec<Mat4>,
    /// Nodes of the scene that are not hidden, parents before children.
    pub(super) visible: Vec<usize>,
}

#[derive(serde::Deserialize)]
struct Visibility {
    visible: bool,
}

impl Hierarchy {
    pub(super) fn new(document: &Document, notes: &mut Notes) -> Result<Self, Error> {
        let parents = parents(document)?;
        let globals = globals(document, &parents)?;
        let mut visible = Vec::new();
        let mut is_reached = vec![false; document.nodes.len()];
        let mut open: Vec<usize> = roots(document, &parents, notes)?;
        open.reverse();
        while let Some(index) = open.pop() {
            let node = member(&document.nodes, "node", index)?;
            if core::mem::replace(&mut is_reached[index], true) {
                continue;
            }
            let shown = extension::<Visibility>(&node.extensions, "KHR_node_visibility");
            let shown = shown.map_err(|error| format!("{}: {error}", document.node(index)))?;
            if shown.is_none_or(|shown| shown.visible) {
                visible.push(index);
                open.extend(node.children.iter().rev());
            }
        }
        Ok(Self { globals, visible })
    }
}

fn parents(document: &Document) -> Result<Vec<Option<usize>>, Error> {
    let mut parents: Vec<Option<usize>> = vec![None; document.nodes.len()];
    for (index, node) in document.nodes.iter().enumerate() {
        let name = || document.node(index);
        for &child in &node.children {
            let count = parents.len();
            let parent = parents.get_mut(child);
            let parent = parent.ok_or_else(|| format!("{} has child {child}, the file has {count} nodes", name()))?;
            if child == index {
                return Err(format!("{} is its own child", name()).into());
            }
            if let Some(other) = parent.replace(index) {
                let [child, other] = [child, other].map(|node| document.node(node));
                return Err(format!("{child} is a child of both {other} and {}", name()).into());
            }
        }
    }
    Ok(parents)
}

fn globals(document: &Document, parents: &[Option<usize>]) -> Result<Vec<Mat4>, Error> {
    let mut globals: Vec<Option<Mat4>> = vec![None; document.nodes.len()];
    let mut open: Vec<usize> = (0..parents.len()).filter(|&index| parents[index].is_none()).collect();
    while let Some(index) = open.pop() {
        let node = &document.nodes[index];
        let parent = parents[index].and_then(|parent| globals[parent]).unwrap_or(Mat4::IDENTITY);
        globals[index] = Some(parent * local(node));
        open.extend(&node.children);
    }
    // Each node has one parent at most, so that those that no root leads to hang on a cycle.
    let Some(lost) = globals.iter().position(Option::is_none) else {
        return Ok(globals.into_iter().flatten().collect());
    };
    let mut on_cycle = lost;
    for _ in 0..parents.len() {
        on_cycle = parents[on_cycle].unwrap_or(on_cycle);
    }
    Err(format!("{} is its own ancestor", document.node(on_cycle)).into())
}

fn local(node: &Node) -> Mat4 {
    if let Some(matrix) = node.matrix {
        return Mat4::from_cols_array(&matrix);
    }
    let rotation = node.rotation.map_or(Quat::IDENTITY, |rotation| unit(Quat::from_array(rotation)));
    let [translation, scale] = [(node.translation, 0.0), (node.scale, 1.0)].map(|(v, none)| v.unwrap_or([none; 3]));
    Mat4::from_scale_rotation_translation(Vec3::from(scale), rotation, Vec3::from(translation))
}

/// A quaternion of length one; none at all is no rotation.
pub(super) fn unit(rotation: Quat) -> Quat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation / length } else { Quat::IDENTITY }
}

/// Where the scene starts.
fn roots(document: &Document, parents: &[Option<usize>], notes: &mut Notes) -> Result<Vec<usize>, Error> {
    let index = document.scene.unwrap_or(0);
    if document.scenes.len() > 1 {
        let scene = super::document::called("scene", index, document.scenes.get(index).and_then(|s| s.name.as_deref()));
        notes.add(format!("the file has {} scenes, of which {scene} is taken", document.scenes.len()));
    }
    if document.scenes.is_empty() {
        notes.add("the file has no scene, so that all of its nodes are taken".to_owned());
        return Ok((0..parents.len()).filter(|&index| parents[index].is_none()).collect());
    }
    let scene = member(&document.scenes, "scene", index)?;
    if scene.extensions.contains_key("EXT_lights_image_based") {
        notes.add("EXT_lights_image_based is ignored: the environment is that of --env".to_owned());
    }
    Ok(scene.nodes.clone())
}
