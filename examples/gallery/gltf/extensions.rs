//! Extensions: which are honored, and what is said about the others.

use super::document::Document;
use super::notes::Notes;
use crate::render::Error;

/// Those that the other files of this folder look for: to honor them, or to say what cannot be.
pub(super) const KNOWN: [&str; 19] = [
    "EXT_lights_ies",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_texture_dds",
];

/// Those that change neither light nor geometry, or are named at the material, mesh or scene that they change.
const HARMLESS: [&str; 8] = [
    "ADOBE_materials_clearcoat_specular",
    "ADOBE_materials_thin_transparency",
    "EXT_lights_image_based",
    "KHR_animation_pointer",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// Refuses a file that cannot be read without an extension that is not supported; notes those that it can do without.
pub(super) fn check(document: &Document, notes: &mut Notes) -> Result<(), Error> {
    let unknown = |names: &[String]| names.iter().filter(|name| !is_known(name)).cloned().collect::<Vec<_>>();
    let refused = unknown(&document.extensions_required);
    if !refused.is_empty() {
        let names = refused.join(", ").escape_debug().to_string();
        return Err(format!("it cannot be read without {names}, which is not supported").into());
    }
    for name in unknown(&document.extensions_used) {
        notes.add(format!("the extension {} is not supported and ignored", name.escape_debug()));
    }
    if document.extensions.contains_key("KHR_materials_variants") {
        notes.add("KHR_materials_variants is ignored: all meshes have their default material".to_owned());
    }
    if !document.animations.is_empty() {
        let count = document.animations.len();
        notes.add(format!("the file has {count} animation(s), which are ignored: all nodes are at rest"));
    }
    Ok(())
}

fn is_known(name: &str) -> bool {
    // Materials of all kinds are approximated, and what that leaves out is said of each of them.
    KNOWN.contains(&name) || HARMLESS.contains(&name) || name.starts_with("KHR_materials_")
}
