//! What became of a file's materials: lights, portals, or neither, and why.

use super::document::Document;
use super::notes::{Notes, listed};
use crate::render::{Lobe, Material, Model};

/// Who uses a material.
#[derive(Default)]
pub(super) struct Uses {
    /// Number of the material in the model, if it is in use.
    pub(super) number: Option<usize>,
    pub(super) triangles: usize,
    /// Meshes, by what messages call them.
    pub(super) meshes: Vec<String>,
    /// Meshes and nodes whose own names start with the prefix of portals.
    pub(super) called_portal: Vec<String>,
}

/// What a material is for the sampler.
struct Role {
    is_light: bool,
    is_portal: bool,
}

/// Whether a name starts with a prefix, in capitals or not.
pub(super) fn starts_with(name: &str, prefix: &str) -> bool {
    name.get(..prefix.len()).is_some_and(|start| start.eq_ignore_ascii_case(prefix))
}

fn holds(name: &str, prefix: &str) -> bool {
    name.to_ascii_lowercase().contains(&prefix.to_ascii_lowercase())
}

/// Whether light comes through a material, so that it can be a portal.
fn lets_through(material: &Material) -> bool {
    material.has_holes() || matches!(material.lobe, Lobe::Translucent(_))
}

fn role(model: &Model, material: &Material) -> Role {
    let is_portal = starts_with(&material.name, &model.portal_prefix) && lets_through(material);
    Role { is_light: material.emits(), is_portal }
}

/// A line for each material of the file: what it is, and why it is not something else.
pub(super) fn list(document: &Document, model: &Model, uses: &[Uses]) -> Vec<String> {
    let line = |(index, uses): (usize, &Uses)| {
        let name = if index < document.materials.len() { document.material(index) } else { "no material".to_owned() };
        let Some(number) = uses.number else { return format!("{name}: not in use") };
        let material = &model.materials[number];
        let Role { is_light, is_portal } = role(model, material);
        let what = match (is_light, is_portal) {
            (true, true) => "a light and a portal",
            (true, false) => "a light",
            (false, true) => "a portal",
            (false, false) => "neither light nor portal",
        };
        let why = format!("{}; {}", why_light(material), why_portal(model, material));
        format!("{name}: {what} ({why}), {} triangles of {}", uses.triangles, listed(&uses.meshes))
    };
    let is_listed = |(index, uses): &(usize, &Uses)| *index < document.materials.len() || uses.number.is_some();
    uses.iter().enumerate().filter(is_listed).map(line).collect()
}

fn why_light(material: &Material) -> String {
    if !material.emits() {
        return "it emits nothing".to_owned();
    }
    let image = if material.emission_map.is_some() { " times an image" } else { "" };
    let sides = if material.two_sided { "both sides" } else { "its front" };
    format!("it emits {}{image} from {sides}", material.emission)
}

fn why_portal(model: &Model, material: &Material) -> String {
    let prefix = &model.portal_prefix;
    match (starts_with(&material.name, prefix), lets_through(material)) {
        (true, true) => format!("its name starts with `{prefix}`"),
        (true, false) => format!("its name starts with `{prefix}`, but it is opaque"),
        (false, _) => format!("its name does not start with `{prefix}`"),
    }
}

/// Notes materials, meshes and nodes that look as if they were meant to be portals, and are not.
pub(super) fn note_near_misses(document: &Document, model: &Model, uses: &[Uses], notes: &mut Notes) {
    let prefix = &model.portal_prefix;
    for (index, uses) in uses.iter().enumerate() {
        let Some(material) = uses.number.map(|number| &model.materials[number]) else { continue };
        let name = document.material(index);
        if starts_with(&material.name, prefix) {
            if !lets_through(material) {
                let rest = if material.emits() { "; it stays a light" } else { "" };
                notes.about(
                    &name,
                    &format!(
                        "the name starts with `{prefix}`, but the material is opaque, so that it is no portal{rest} \
                         (transmission, an alpha mask or alpha blending let light in)"
                    ),
                );
            }
        } else if holds(&material.name, prefix) {
            notes.about(&name, &format!("the name holds `{prefix}`, but does not start with it: this is no portal"));
        }
        for user in uses.called_portal.iter().filter(|_| !starts_with(&material.name, prefix)) {
            let text = format!("its name starts with `{prefix}`, but that of its material does not: this is no portal");
            notes.about(user, &text);
        }
    }
}

/// How many meshes are lights, and how many are portals.
pub(super) fn count(model: &Model) -> [usize; 2] {
    let count = |wanted: &dyn Fn(&Role) -> bool| {
        model.meshes.iter().filter(|mesh| wanted(&role(model, &model.materials[mesh.material]))).count()
    };
    [count(&|role| role.is_light), count(&|role| role.is_portal)]
}
