//! Variance of the one-sample estimate `f / p` at one point.

use fanlight::ShadingPoint;
use glam::DVec3;

use crate::methods::{Cumulative, Drawn, Method, OnTriangle, barycentrics};
use crate::oracle::{Class, Truth};
use crate::scenes::Scene;
use crate::scenes::pcg::Pcg32;
use crate::scenes::sky::{SUN_SAMPLE_SOLID_ANGLE, Sky};

/// One of this many directions of the sun stands for its neighbors.
const SUN_STRIDE: usize = 5;
/// Radiance that only the sun exceeds.
pub(crate) const BRIGHT: f32 = 2.0;

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
    /// Share of the reference's samples that carry something and that the method cannot draw.
    pub(crate) lost: f64,
}

/// A method at work on a scene.
pub(crate) struct Estimator<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) method: &'a dyn Method,
    /// Uniform directions through the openings of a scene that has any.
    pub(crate) openings: Option<&'a dyn Method>,
}

/// Draws what a method may draw too seldom for plain Monte Carlo to see.
enum Reference<'a> {
    /// Uniform directions through the openings.
    Openings(&'a dyn Method),
    /// Lights in proportion to their true irradiance, uniform directions to each.
    Lights(&'a Truth, Cumulative),
}

impl Estimator<'_> {
    /// Measures at a point whose irradiance is positive.
    pub(crate) fn measure(&self, x: &ShadingPoint, truth: &Truth, samples: usize, seed: u64) -> Measured {
        let mut pcg = Pcg32::new(seed, 5);
        let measured = match self.reference(truth) {
            Some(reference) => self.mixture(&reference, x, truth, samples, &mut pcg),
            None => self.plain(x, truth, samples, &mut pcg),
        };
        let sun = match (&self.scene.sky, truth.class) {
            (Some(sky), Class::Sun) if !self.method.has_own_environment() => self.sun(sky, x, truth.total),
            _ => 0.0,
        };
        Measured { variance: measured.variance + sun, ..measured }
    }

    fn reference<'t>(&'t self, truth: &'t Truth) -> Option<Reference<'t>> {
        if self.method.has_own_environment() {
            return None;
        }
        let is_plain = self.scene.sky.is_none() && self.scene.image.is_none();
        let lights = || Reference::Lights(truth, Cumulative::new(truth.by_light.iter().copied()));
        self.openings.map(Reference::Openings).or_else(|| is_plain.then(lights))
    }

    /// Plain Monte Carlo with the method's own samples. The irradiance of a method with an environment of its own is
    /// that of its environment.
    fn plain(&self, x: &ShadingPoint, truth: &Truth, samples: usize, pcg: &mut Pcg32) -> Measured {
        let (mut sum, mut squares, mut zeros) = (0.0, 0.0, 0.0);
        for _ in 0..samples {
            let drawn = self.method.sample(x, pcg.uniform3());
            let estimate = drawn.map_or(0.0, |drawn| contribution(self.scene, x, &drawn) / drawn.pdf);
            zeros += f64::from(u8::from(estimate == 0.0));
            sum += estimate - truth.total;
            squares += (estimate - truth.total).powi(2);
        }
        let [bias, square, zeros] = [sum, squares, zeros].map(|sum| sum / samples as f64);
        let variance = if self.method.has_own_environment() { square - bias * bias } else { square };
        Measured { class: truth.class, e2: truth.total * truth.total, variance, zeros, lost: 0.0 }
    }

    /// Without the sun: the integral of `(f/p - E)² p`, half of its samples from the method and half from the
    /// reference, weighted by the balance heuristic (Veach 1997).
    fn mixture(
        &self,
        reference: &Reference<'_>,
        x: &ShadingPoint,
        truth: &Truth,
        samples: usize,
        pcg: &mut Pcg32,
    ) -> Measured {
        let (half, irradiance) = (samples.div_ceil(2), truth.total);
        let (mut sum, mut zeros, mut lost) = (0.0, 0.0, 0.0);
        let mut add = |drawn: &Drawn, p: f64, r: f64| {
            let f = contribution(self.scene, x, drawn);
            if p > 0.0 && !(f > 0.0 && self.is_sun(drawn)) {
                sum += (f / p - irradiance).powi(2) * p / (p + r);
            }
            lost += f64::from(u8::from(f > 0.0 && !(p > 0.0)));
            f
        };
        let mut missed = 0.0;
        for _ in 0..half {
            match self.method.sample(x, pcg.uniform3()) {
                Some(drawn) => {
                    let f = add(&drawn, drawn.pdf, reference.pdf(self.scene, x, &drawn));
                    zeros += f64::from(u8::from(f == 0.0));
                }
                None => missed += 1.0,
            }
            if let Some(drawn) = reference.sample(self.scene, x, pcg.uniform3()) {
                add(&drawn, self.method.pdf(x, &drawn), drawn.pdf);
            }
        }
        let e2 = irradiance * irradiance;
        let [variance, zeros, lost] = [sum + missed * e2, zeros + missed, lost].map(|sum| sum / half as f64);
        Measured { class: truth.class, e2, variance, zeros, lost }
    }

    fn is_sun(&self, drawn: &Drawn) -> bool {
        self.scene.sky.as_ref().is_some_and(|sky| sky.environment.radiance(drawn.direction) > BRIGHT)
    }

    /// Integral of `(f/p - E)² p` over the visible part of the sun, by quadrature.
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

impl Reference<'_> {
    fn sample(&self, scene: &Scene, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let (truth, choice) = match self {
            Self::Openings(method) => return method.sample(x, u),
            Self::Lights(truth, choice) => (truth, choice),
        };
        let light = choice.sample(u[0]);
        let vertices = relative(scene, light, x);
        let (direction, place, density) = REFERENCE.sample(&vertices, [f64::from(u[1]), f64::from(u[2])]);
        let pdf = truth.by_light[light] / truth.total * density;
        let barycentrics = place.map(|b| b as f32);
        Some(Drawn { light, barycentrics, direction: direction.as_vec3(), pdf, radiance: None })
    }

    /// Density of what the method drew, which may be a direction that misses all openings.
    fn pdf(&self, scene: &Scene, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        match self {
            Self::Openings(method) => {
                locate(scene, x, drawn.direction.as_dvec3()).map_or(0.0, |drawn| method.pdf(x, &drawn))
            }
            Self::Lights(truth, _) => match truth.by_light[drawn.light] / truth.total {
                0.0 => 0.0,
                share => share * REFERENCE.density(&relative(scene, drawn.light, x), drawn.direction.as_dvec3()),
            },
        }
    }
}

/// How the reference draws a direction to a light.
const REFERENCE: OnTriangle = OnTriangle::SolidAngle;

fn relative(scene: &Scene, light: usize, x: &ShadingPoint) -> [DVec3; 3] {
    scene.lights[light].vertices.map(|v| v - x.position.as_dvec3())
}

/// The point of an opening that a direction passes.
pub(crate) fn locate(scene: &Scene, x: &ShadingPoint, direction: DVec3) -> Option<Drawn> {
    // With several walls methods look at the direction alone.
    let (light, _) = scene.walls[0].meet(x.position.as_dvec3(), direction, scene.image.as_ref())?;
    let barycentrics = barycentrics(&relative(scene, light, x), direction).map(|b| b as f32);
    Some(Drawn { light, barycentrics, direction: direction.as_vec3(), pdf: 0.0, radiance: None })
}

/// Radiance from a direction times the cosine.
pub(crate) fn contribution(scene: &Scene, x: &ShadingPoint, drawn: &Drawn) -> f64 {
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
