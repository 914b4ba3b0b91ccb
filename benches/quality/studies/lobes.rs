//! Glossy receivers: how much noise there is if light is sampled without regard to the lobe, if the lobe alone is
//! sampled, if both are and weighted by the balance heuristic, and if a triangle could be chosen by its product with
//! the lobe.
//!
//! The lobe is normalised, cosine-powered around a random direction above the horizon that meets a light, and stands
//! for the product of a BSDF and the cosine. Emitters do not cover each other: a ray sees all that it crosses.

use core::f64::consts::{PI, TAU};

use ::fanlight::{Receiver, ShadingPoint};
use glam::DVec3;

use crate::args::Args;
use crate::methods::{Cumulative, Drawn, Fanlight, Method, OnTriangle, barycentrics, crosses};
use crate::metrics::summary;
use crate::parallel::parallel;
use crate::report::short;
use crate::scenes::pcg::Pcg32;
use crate::scenes::{self, Scene};

const WORKLOADS: [&str; 2] = ["cloud-10000", "quad"];
const EXPONENTS: [i32; 3] = [10, 100, 1000];
const NAMES: [&str; 4] = ["light", "lobe", "both, balanced", "choice by product"];
/// Directions to try until one meets a light.
const TRIES: usize = 1000;
/// Number of lights from which it matters which is chosen.
const MANY: usize = 3;
/// Least share of the lobe's peak that the choice by product sees.
const LEAST_LOBE: f64 = 1e-3;

/// `(m + 1) / 2π cos^m` of the angle to an axis, zero below the horizon.
struct Lobe {
    axis: DVec3,
    normal: DVec3,
    exponent: i32,
}

impl Lobe {
    fn value(&self, direction: DVec3) -> f64 {
        let cosine = self.axis.dot(direction);
        if cosine <= 0.0 || self.normal.dot(direction) <= 0.0 {
            return 0.0;
        }
        f64::from(self.exponent + 1) / TAU * cosine.powi(self.exponent)
    }

    fn sample(&self, pcg: &mut Pcg32) -> DVec3 {
        let cosine = pcg.f().powf(1.0 / f64::from(self.exponent + 1));
        let (sin_phi, cos_phi) = (TAU * pcg.f()).sin_cos();
        let (s, t) = self.axis.any_orthonormal_pair();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        self.axis * cosine + (s * cos_phi + t * sin_phi) * sine
    }
}

/// One point's view of the lights.
struct View<'a> {
    scene: &'a Scene,
    method: &'a Fanlight<'a>,
    /// Mean weight of every light.
    means: &'a [f64],
    x: ShadingPoint,
    lobe: Lobe,
    /// Lights whose front is seen, relative to the point.
    lights: Vec<(usize, [DVec3; 3])>,
}

pub(crate) fn run(args: &Args) {
    println!("\nGlossy receivers: relative variance of one sample (of a pair, times two, for both)");
    println!("{:12} {:>8} {:20} {:>8} {:>8} {:>8}", "workload", "exponent", "sampling", "relvar", "p90", "EW");
    for workload in WORKLOADS.iter().filter(|workload| args.wants(workload)) {
        let scene = scenes::scene(workload);
        let method = Fanlight::new(&scene);
        let means: Vec<f64> = (0..scene.lights.len()).map(|light| scene.mean_weight(light)).collect();
        let points = scene.points.quality(args.effort.study_points);
        for exponent in EXPONENTS {
            let at_point = |i: usize, x: &ShadingPoint| {
                let mut pcg = Pcg32::new(i as u64, 9);
                View::new(&scene, (&method, &means), *x, exponent, &mut pcg)?.measure(args.effort.samples, &mut pcg)
            };
            let measured: Vec<_> = parallel(&points, at_point).into_iter().flatten().collect();
            let names = if scene.lights.len() < MANY { &NAMES[..3] } else { &NAMES[..] };
            for (i, name) in names.iter().enumerate() {
                let Some(s) = summary(measured.iter().map(|(variances, e2)| (variances[i], *e2))) else { continue };
                let [median, p90, mean] = [s.median, s.p90, s.energy_weighted].map(short);
                println!("{workload:12} {exponent:>8} {name:20} {median:>8} {p90:>8} {mean:>8}");
            }
        }
    }
}

impl<'a> View<'a> {
    fn new(
        scene: &'a Scene,
        (method, means): (&'a Fanlight<'a>, &'a [f64]),
        x: ShadingPoint,
        exponent: i32,
        pcg: &mut Pcg32,
    ) -> Option<Self> {
        let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
        let normal = normal.as_dvec3();
        let relative = |l: usize| (l, scene.lights[l].vertices.map(|v| v - x.position.as_dvec3()));
        let is_front =
            |(l, vertices): &(usize, [DVec3; 3])| scene.lights[*l].normal_and_area().0.dot(vertices[0]) < 0.0;
        let lights: Vec<_> = (0..scene.lights.len()).map(relative).filter(is_front).collect();
        let meets = |axis: &DVec3| axis.dot(normal) > 0.0 && lights.iter().any(|(_, v)| crosses(v, *axis));
        let axis = (0..TRIES).map(|_| pcg.direction()).find(meets)?;
        Some(Self { scene, method, means, x, lobe: Lobe { axis, normal, exponent }, lights })
    }

    /// Variances of all ways of sampling, and the squared mean. `None` where nothing arrives.
    fn measure(&self, samples: usize, pcg: &mut Pcg32) -> Option<([f64; 4], f64)> {
        let product = self.product();
        let (mut light, mut lobe) = (Moments::default(), Moments::default());
        // Second moments of light sampling (by light and lobe samples together) and of lobe sampling.
        let (mut of_light, mut of_lobe, mut of_product) = (0.0, 0.0, 0.0);
        for _ in 0..samples {
            let mut estimate = 0.0;
            if let Some(drawn) = self.method.sample(&self.x, pcg.uniform3()) {
                let (f, p) = (self.weight(&drawn) * self.lobe(&drawn), drawn.pdf + self.lobe(&drawn));
                estimate = f / p;
                of_light += f * f / (drawn.pdf * p);
            }
            light.add(estimate);
            let direction = self.lobe.sample(pcg);
            let (mut estimate, mut seen) = (0.0, 0.0);
            for drawn in self.hits(direction) {
                let (pdf, density) = (self.method.pdf(&self.x, &drawn), self.lobe(&drawn));
                let weight = self.weight(&drawn);
                seen += weight;
                estimate += weight * density / (pdf + density);
                if pdf > 0.0 {
                    of_light += (weight * density).powi(2) / (pdf * (pdf + density));
                }
            }
            lobe.add(estimate);
            of_lobe += seen * seen;
            of_product += self.sample_product(&product, pcg);
        }
        let count = samples as f64;
        let mean = (light.sum + lobe.sum) / count;
        let e2 = mean * mean;
        let both = 2.0 * (light.variance() + lobe.variance());
        let variances = [of_light / count - e2, of_lobe / count - e2, both, of_product / count - e2];
        (mean > 0.0).then_some((variances.map(|v| v.max(0.0)), e2))
    }

    fn weight(&self, drawn: &Drawn) -> f64 {
        self.scene.weight(drawn.light, drawn.barycentrics.map(f64::from))
    }

    fn lobe(&self, drawn: &Drawn) -> f64 {
        self.lobe.value(drawn.direction.as_dvec3())
    }

    /// All points that a ray crosses.
    fn hits(&self, direction: DVec3) -> impl Iterator<Item = Drawn> {
        let is_crossed = move |(_, vertices): &&(usize, [DVec3; 3])| crosses(vertices, direction);
        let drawn = move |(light, vertices): &(usize, [DVec3; 3])| Drawn {
            light: *light,
            barycentrics: barycentrics(vertices, direction).map(|b| b as f32),
            direction: direction.as_vec3(),
            pdf: 0.0,
            radiance: None,
        };
        let is_above = self.lobe.normal.dot(direction) > 0.0;
        self.lights.iter().filter(move |_| is_above).filter(is_crossed).map(drawn)
    }

    /// What each light sends, times the lobe's mean at its centre and vertices.
    fn product(&self) -> Cumulative {
        let peak = f64::from(self.lobe.exponent + 1) / TAU;
        Cumulative::new(self.lights.iter().map(|(light, [a, b, c])| {
            let center = (*a + *b + *c) / 3.0;
            let cross = (*b - *a).cross(*c - *a);
            let distance2 = center.length_squared();
            let solid_angle = 0.5 * cross.dot(center).abs() / (distance2 * distance2.sqrt());
            let places = [center, *a, *b, *c].map(|place| self.lobe.value(place.normalize()));
            let lobe = (places.iter().sum::<f64>() / 4.0).max(LEAST_LOBE * peak);
            self.means[*light] * solid_angle.min(2.0 * PI) * lobe
        }))
    }

    /// Squared estimate of a sample whose triangle is chosen by its product, uniform over its solid angle.
    fn sample_product(&self, product: &Cumulative, pcg: &mut Pcg32) -> f64 {
        let chosen = product.sample(pcg.f() as f32);
        let (light, vertices) = self.lights[chosen];
        let (direction, place, density) = OnTriangle::SolidAngle.sample(&vertices, [pcg.f(), pcg.f()]);
        let f = self.scene.weight(light, place) * self.lobe.value(direction);
        (f / (product.pmf(chosen) * density)).powi(2)
    }
}

/// Of the estimates by one kind of samples.
#[derive(Default)]
struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, x: f64) {
        self.count += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    fn variance(&self) -> f64 {
        self.squares / self.count - (self.sum / self.count).powi(2)
    }
}
