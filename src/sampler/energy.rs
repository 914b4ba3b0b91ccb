//! What each triangle sends, as the tree over triangles wants to know it.

use glam::Vec3;

use super::mesh::mesh_of;
use crate::bounds::{LightBounds, Moments};
use crate::env::Environment;
use crate::geometry::{Aabb, Cone};
use crate::light::LightTriangle;
use crate::parallel;

/// Least energy of a triangle relative to the sum of all. Below, it would vanish in single precision.
const LEAST_ENERGY: f64 = 1e-30;

/// What the energy of a triangle depends on besides itself.
pub(super) struct Energies<'a> {
    /// Mean radiance that portals show.
    mean: f64,
    /// Whether what portals show depends on the direction.
    directional: bool,
    scales: Scales<'a>,
}

/// What the weights of each mesh are multiplied by since the build; without factors, nothing.
#[derive(Clone, Copy, Default)]
pub(super) struct Scales<'a> {
    pub(super) factors: &'a [f32],
    pub(super) meshes: &'a [u32],
}

impl Scales<'_> {
    #[inline]
    pub(super) fn of(&self, light: &LightTriangle) -> f32 {
        if self.factors.is_empty() {
            return 1.0;
        }
        self.factors.get(mesh_of(self.meshes, light.place())).copied().unwrap_or(1.0)
    }
}

/// An energy in single precision, zero only if it is zero.
pub(super) fn storable(energy: f64) -> f32 {
    if energy > 0.0 { energy.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32 } else { 0.0 }
}

impl<'a> Energies<'a> {
    pub(super) fn new(environment: &Environment, scales: Scales<'a>) -> Self {
        Self { mean: f64::from(environment.mean_without_features()), directional: !environment.is_constant(), scales }
    }

    /// Energy of all triangles together.
    pub(super) fn total(&self, lights: &[LightTriangle]) -> f64 {
        let part = |lights: &[LightTriangle]| lights.iter().map(|light| self.energy(light)).sum::<f64>();
        parallel::reduce(lights, part, |a, b| a + b)
    }

    /// Weight times area, times mean radiance for a portal. Exactly zero where nothing is sent.
    pub(super) fn energy(&self, light: &LightTriangle) -> f64 {
        let area = light.triangle().normal_and_area().map_or(0.0, |(_, area)| area);
        self.energy_of(light, area)
    }

    fn energy_of(&self, light: &LightTriangle, area: f32) -> f64 {
        let radiance = if light.is_portal() { self.mean } else { 1.0 };
        let weight = f64::from(light.root.average) * f64::from(self.scales.of(light));
        weight * f64::from(area) * radiance
    }

    /// Bounds of a triangle, with its energy relative to that of all.
    pub(super) fn bounds(&self, light: &LightTriangle, total: f64) -> (LightBounds, Moments) {
        let triangle = light.triangle();
        let (normal, area) = triangle.normal_and_area().unwrap_or((Vec3::Z, 0.0));
        let energy = self.energy_of(light, area);
        let share = if energy > 0.0 { (energy / total).max(LEAST_ENERGY) as f32 } else { 0.0 };
        let directional = light.is_portal() && self.directional;
        let bounds = LightBounds {
            aabb: Aabb::around(&triangle.0),
            normals: Cone::single(normal),
            flux: if directional { 0.0 } else { share },
            portal: if directional { share } else { 0.0 },
            two_sided: light.is_two_sided(),
        };
        let (mean, variance) = triangle.mean_and_variance();
        (bounds, Moments { energy: share, mean, variance, normal })
    }
}
