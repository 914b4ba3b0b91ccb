//! Variance of the one-sample estimate `f / p` at one point.

use fanlight::ShadingPoint;
use glam::DVec3;

use crate::methods::{Drawn, Method, barycentrics};
use crate::oracle::{Class, Truth};
use crate::scenes::Scene;
use crate::scenes::pcg::Pcg32;
use crate::scenes::sky::{SUN_SAMPLE_SOLID_ANGLE, Sky};

/// Every so manieth direction of the sun stands for its neighbours.
const SUN_STRIDE: usize = 5;
/// Radiance that only the sun exceeds.
const BRIGHT: f32 = 2.0;

/// What was measured at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) class: Class,
    /// Squared irradiance.
    pub(crate) e2: f64,
    /// Variance of the one-sample estimate: its mean squared difference from the true irradiance.
    pub(crate) variance: f64,
    /// Share of samples that carry nothing.
    pub(crate) zeros: f64,
}

/// A method at work on a scene.
pub(crate) struct Estimator<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) method: &'a dyn Method,
    /// Directions through the openings, to find what the method seldom draws. Plain sampling without.
    pub(crate) reference: Option<&'a dyn Method>,
}

impl Estimator<'_> {
    /// Measures at a point whose irradiance is positive.
    pub(crate) fn measure(&self, x: &ShadingPoint, truth: &Truth, samples: usize, seed: u64) -> Measured {
        let mut pcg = Pcg32::new(seed, 5);
        let (variance, zeros) = match (self.reference, &self.scene.sky) {
            (Some(reference), Some(sky)) => {
                let (rest, zeros) = self.mixture(reference, x, truth.total, samples, &mut pcg);
                let sun = if truth.class == Class::Sun { self.sun(sky, x, truth.total) } else { 0.0 };
                (rest + sun, zeros)
            }
            _ => self.plain(x, truth.total, samples, &mut pcg),
        };
        Measured { class: truth.class, e2: truth.total * truth.total, variance, zeros }
    }

    /// Plain Monte Carlo with the method's own samples.
    fn plain(&self, x: &ShadingPoint, irradiance: f64, samples: usize, pcg: &mut Pcg32) -> (f64, f64) {
        let (mut squares, mut zeros) = (0.0, 0.0);
        for _ in 0..samples {
            let drawn = self.method.sample(x, pcg.uniform3());
            let estimate = drawn.map_or(0.0, |drawn| contribution(self.scene, x, &drawn) / drawn.pdf);
            zeros += f64::from(u8::from(estimate == 0.0));
            squares += (estimate - irradiance).powi(2);
        }
        (squares / samples as f64, zeros / samples as f64)
    }

    /// Without the sun: the integral of `(f/p - E)² p`, half of its samples from the method and half from the
    /// reference, weighted by the balance heuristic (Veach 1997).
    fn mixture(
        &self,
        reference: &dyn Method,
        x: &ShadingPoint,
        irradiance: f64,
        samples: usize,
        pcg: &mut Pcg32,
    ) -> (f64, f64) {
        let half = samples.div_ceil(2);
        let (mut sum, mut zeros) = (0.0, 0.0);
        let mut add = |drawn: &Drawn, p: f64, r: f64| {
            let f = contribution(self.scene, x, drawn);
            if p > 0.0 && !(f > 0.0 && self.is_sun(drawn)) {
                sum += (f / p - irradiance).powi(2) * p / (p + r);
            }
            f
        };
        let mut missed = 0.0;
        for _ in 0..half {
            match self.method.sample(x, pcg.uniform3()) {
                Some(drawn) => {
                    let f = add(&drawn, drawn.pdf, self.reference_density(reference, x, &drawn));
                    zeros += f64::from(u8::from(f == 0.0));
                }
                None => missed += 1.0,
            }
            if let Some(drawn) = reference.sample(x, pcg.uniform3()) {
                add(&drawn, self.method.pdf(x, &drawn), drawn.pdf);
            }
        }
        let count = half as f64;
        ((sum + missed * irradiance * irradiance) / count, (zeros + missed) / count)
    }

    fn is_sun(&self, drawn: &Drawn) -> bool {
        self.scene.sky.as_ref().is_some_and(|sky| sky.environment.radiance(drawn.direction) > BRIGHT)
    }

    /// Density of the reference in a direction that may miss all openings.
    fn reference_density(&self, reference: &dyn Method, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let direction = drawn.direction.as_dvec3();
        locate(self.scene, x, direction).map_or(0.0, |drawn| reference.pdf(x, &drawn))
    }

    /// The same integral over the visible part of the sun, by quadrature.
    fn sun(&self, sky: &Sky, x: &ShadingPoint, irradiance: f64) -> f64 {
        let solid_angle = SUN_SAMPLE_SOLID_ANGLE * SUN_STRIDE as f64;
        let term = |&(direction, _): &(DVec3, f64)| {
            let drawn = locate(self.scene, x, direction)?;
            let f = contribution(self.scene, x, &drawn);
            let p = if f > 0.0 { self.method.pdf(x, &drawn) } else { 0.0 };
            (p > 0.0).then(|| (f / p - irradiance).powi(2) * p * solid_angle)
        };
        sky.sun.iter().step_by(SUN_STRIDE).filter_map(term).sum()
    }
}

/// The point of an opening that a direction passes.
fn locate(scene: &Scene, x: &ShadingPoint, direction: DVec3) -> Option<Drawn> {
    let position = x.position.as_dvec3();
    // With several walls methods look at the direction alone.
    let (light, _) = scene.walls[0].meet(position, direction, scene.image.as_ref())?;
    let relative = scene.lights[light].vertices.map(|v| v - position);
    let barycentrics = barycentrics(&relative, direction).map(|b| b as f32);
    Some(Drawn { light, barycentrics, direction: direction.as_vec3(), pdf: 0.0, radiance: None })
}

/// Radiance from a direction times the cosine.
fn contribution(scene: &Scene, x: &ShadingPoint, drawn: &Drawn) -> f64 {
    let cosine = f64::from(x.cosine(drawn.direction));
    if cosine == 0.0 {
        return 0.0;
    }
    let Some(sky) = &scene.sky else {
        return cosine * scene.weight(drawn.light, drawn.barycentrics.map(f64::from));
    };
    match scene.transmittance(x.position.as_dvec3(), drawn.direction.as_dvec3()) {
        0.0 => 0.0,
        transmittance => {
            let radiance = drawn.radiance.unwrap_or_else(|| f64::from(sky.environment.radiance(drawn.direction)));
            cosine * transmittance * radiance
        }
    }
}
