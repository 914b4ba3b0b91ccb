//! Points uniform on the portals, by multiple importance sampling with the environment (Nguyen 2014, "Light Portals:
//! Light Transport Variance Reduction"). Where the original draws one sample of each and weighs both by the balance
//! heuristic, half of the samples here are of either, so that a sample costs one ray as with every other method.

use ::fanlight::ShadingPoint;

use super::environment_reject::EnvironmentReject;
use super::triangle::{OnTriangle, ThenPoint, best_choice};
use super::{Drawn, Method};
use crate::scenes::Scene;
use crate::variance::locate;

pub(crate) struct PortalEnvironment<'a> {
    scene: &'a Scene,
    portals: ThenPoint<'a>,
    environment: EnvironmentReject,
}

impl<'a> PortalEnvironment<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let portals = ThenPoint::new(scene, best_choice(scene), OnTriangle::Area);
        Self { scene, portals, environment: EnvironmentReject::new(scene) }
    }
}

impl Method for PortalEnvironment<'_> {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let drawn = if u[0] < 0.5 {
            self.portals.sample(x, [2.0 * u[0], u[1], u[2]])?
        } else {
            let direction = self.environment.sample(x, u)?.direction;
            // What misses all portals carries nothing.
            locate(self.scene, x, direction.as_dvec3())?
        };
        Some(Drawn { pdf: self.pdf(x, &drawn), ..drawn })
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        0.5 * (self.portals.pdf(x, drawn) + self.environment.pdf(x, drawn))
    }

    fn pmfs(&self, _: &ShadingPoint, _: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        None
    }

    fn bytes(&self) -> usize {
        self.portals.bytes() + self.environment.bytes()
    }
}
