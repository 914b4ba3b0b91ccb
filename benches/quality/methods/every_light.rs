//! The tree's importance, evaluated on every light: what a perfect tree would converge to, in linear time.

use ::fanlight::ShadingPoint;

use super::light_bounds::LightBounds;
use super::power::scene_bounds;
use crate::scenes::Scene;

pub(crate) struct EveryLight {
    lights: Vec<LightBounds>,
}

impl EveryLight {
    pub(crate) fn new(scene: &Scene) -> Self {
        Self { lights: scene_bounds(scene) }
    }

    fn total(&self, x: &ShadingPoint) -> f64 {
        self.lights.iter().map(|light| f64::from(light.importance(x))).sum()
    }

    pub(crate) fn sample(&self, x: &ShadingPoint, u: f32) -> Option<(usize, f64)> {
        let total = self.total(x);
        let mut rest = f64::from(u) * total;
        let mut chosen = None;
        for (i, light) in self.lights.iter().enumerate() {
            let importance = f64::from(light.importance(x));
            if importance > 0.0 {
                chosen = Some((i, importance / total));
                if rest < importance {
                    break;
                }
                rest -= importance;
            }
        }
        chosen
    }

    pub(crate) fn pmf(&self, x: &ShadingPoint, light: usize) -> f64 {
        f64::from(self.lights[light].importance(x)) / self.total(x)
    }

    pub(crate) fn pmfs(&self, x: &ShadingPoint) -> Vec<f64> {
        let total = self.total(x);
        self.lights.iter().map(|light| f64::from(light.importance(x)) / total).collect()
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.lights[..])
    }
}
