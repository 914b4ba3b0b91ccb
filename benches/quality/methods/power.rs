//! Lights by their power alone, whatever the shading point.

use super::discrete::AliasTable;
use super::light_bounds::LightBounds;
use crate::scenes::Scene;

/// An alias table over the flux of all lights.
pub(crate) struct Power {
    pub(crate) table: AliasTable,
}

impl Power {
    pub(crate) fn new(scene: &Scene) -> Self {
        let flux: Vec<f64> = (0..scene.lights.len()).map(|light| flux(scene, light)).collect();
        Self { table: AliasTable::new(&flux) }
    }
}

/// Area times mean radiance or transmittance.
pub(crate) fn flux(scene: &Scene, light: usize) -> f64 {
    scene.mean_weight(light) * scene.lights[light].normal_and_area().1
}

/// Bounds of the lights of a scene.
pub(crate) fn scene_bounds(scene: &Scene) -> Vec<LightBounds> {
    let bounds = |l: usize| {
        let light = &scene.lights[l];
        let (normal, _) = light.normal_and_area();
        LightBounds::of_triangle(light.vertices.map(|v| v.as_vec3()), normal.as_vec3(), flux(scene, l) as f32)
    };
    (0..scene.lights.len()).map(bounds).collect()
}
