//! Lights by their power alone, whatever the shading point.

use super::discrete::AliasTable;
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
