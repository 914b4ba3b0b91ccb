//! The whole environment by its radiance; directions that miss the openings are lost.

use ::fanlight::{Environment, ShadingPoint};

use super::{Drawn, Method};
use crate::scenes::Scene;
use crate::scenes::sky;

pub(crate) struct EnvironmentReject {
    environment: Environment,
}

impl EnvironmentReject {
    pub(crate) fn new(scene: &Scene) -> Self {
        let sky = scene.sky.as_ref().expect("the workload has openings");
        Self { environment: sky::environment(&sky.texels) }
    }
}

impl Method for EnvironmentReject {
    fn sample(&self, _: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let sample = self.environment.sample([u[1], u[2]])?;
        Some(Drawn {
            light: 0,
            barycentrics: [0.0; 2],
            direction: sample.direction,
            pdf: f64::from(sample.pdf),
            radiance: None,
        })
    }

    fn pdf(&self, _: &ShadingPoint, drawn: &Drawn) -> f64 {
        f64::from(self.environment.pdf(drawn.direction))
    }

    fn pmfs(&self, _: &ShadingPoint, _: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        None
    }

    fn bytes(&self) -> usize {
        // Means, filtered means, and pairs of minimum and maximum of all levels.
        let texels = |levels: u32| (0..levels).map(|level| 1_usize << (2 * level)).sum::<usize>();
        let depth = self.environment.size().trailing_zeros();
        8 * texels(depth + 1) + 8 * texels(depth)
    }
}
