//! What each light sends, as the tree over the lights needs to know it.

use super::instance::emits;
use super::{Light, LightKind};
use crate::bounds::{LightBounds, Moments};
use crate::env::Environment;
use crate::parallel;

/// Least energy of a light relative to the sum of all.
///
/// Proved: above it products with geometric terms down to 1e-8 are normal numbers in single precision.
const LEAST_ENERGY_SHARE: f64 = 1e-30;

/// What the energy of a light depends on besides the light itself.
pub(crate) struct Energies<'a> {
    /// Mean radiance that portals show.
    mean: f64,
    /// Whether what portals show depends on the direction.
    directional: bool,
    /// What the weights of each mesh are multiplied by since the build; nothing without factors.
    factors: &'a [f32],
    /// Where the triangles of each mesh start.
    meshes: &'a [u32],
}

impl<'a> Energies<'a> {
    pub(crate) fn new(environment: &Environment, factors: &'a [f32], meshes: &'a [u32]) -> Self {
        let mean = f64::from(environment.mean_without_features());
        Self { mean, directional: !environment.is_constant(), factors, meshes }
    }

    /// Returns the energy of all lights together.
    pub(crate) fn total(&self, count: usize, light: impl Fn(usize) -> Light<'a> + Sync + Send) -> f64 {
        parallel::sum(count, |i| self.energy(light(i)))
    }

    /// Returns weight times what it is multiplied by to compete ([`LightKind::area`]), times mean radiance for a
    /// portal. Exactly zero where nothing is emitted.
    pub(crate) fn energy(&self, light: Light<'_>) -> f64 {
        if let Light::Instance(placed) = light {
            let [flux, portal] = placed.energies();
            return flux + self.mean * portal;
        }
        self.energy_of_area(light, light.area())
    }

    #[inline]
    fn energy_of_area(&self, light: Light<'_>, area: f32) -> f64 {
        let radiance = if light.is_portal() { self.mean } else { 1.0 };
        let weight = f64::from(light.weight()) * f64::from(light.scale(self.factors, self.meshes));
        weight * f64::from(area) * radiance
    }

    /// Returns the bounds of a light, with its energy relative to that of all.
    pub(crate) fn bounds(&self, light: Light<'_>, total: f64) -> (LightBounds, Moments) {
        let share = |energy: f64| if energy > 0.0 { (energy / total).max(LEAST_ENERGY_SHARE) as f32 } else { 0.0 };
        if let Light::Instance(placed) = light {
            let [flux, portal] = placed.energies();
            let portal = self.mean * portal;
            return placed.bounds_with(if self.directional {
                [share(flux), share(portal)]
            } else {
                [share(flux + portal), 0.0]
            });
        }
        light.bounds(light.is_portal() && self.directional, |area| share(self.energy_of_area(light, area)))
    }

    /// Whether a light may emit, whatever an instance is multiplied by.
    pub(crate) fn may_emit(&self, light: Light<'_>) -> bool {
        match light {
            Light::Instance(placed) => emits(&placed.object, self.mean),
            Light::Triangle(_) | Light::Lamp(_) | Light::Moving(_) => self.energy(light) > 0.0,
        }
    }
}
