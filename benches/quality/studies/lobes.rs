//! Glossy receivers: how much noise there is if lights are sampled with and without regard to the lobe, if the lobe
//! alone is sampled, and if both are, weighted by the balance heuristic.
//!
//! The receiver reflects `kd cos θ / π + ks D G / (4 cos θo)`, GGX with height-correlated masking and without Fresnel.
//! Emitters do not cover each other: a ray sees all that it crosses.

use core::f64::consts::{FRAC_1_PI, PI, TAU};

use ::fanlight::{Glossy, Receiver, ShadingPoint};
use glam::{DMat3, DVec3};

use crate::args::Args;
use crate::methods::{Drawn, Fanlight, Method, barycentrics, crosses};
use crate::metrics::{Summary, summary};
use crate::parallel::parallel;
use crate::report::short;
use crate::scenes::pcg::Pcg32;
use crate::scenes::{self, Scene};

/// Scenes with the names of their workloads, roughnesses and shares of the diffuse part.
const WORKLOADS: [(&str, &str, &[f64], &[f64]); 3] = [
    ("cloud-10000", "lobe", &[0.01, 0.02, 0.05, 0.1, 0.2, 0.4], &[0.0, 0.5]),
    ("window", "lobe-window", &[0.05, 0.1, 0.2, 0.4], &[0.0]),
    ("quad", "lobe-quad", &[0.05, 0.1, 0.2, 0.4], &[0.0]),
];
const METHODS: [&str; 5] = ["light", "light@lobe", "bsdf", "pair", "pair@lobe"];

/// What the receiver reflects.
struct Lobe {
    /// Tangent, bitangent and normal.
    frame: DMat3,
    /// Outgoing direction in the frame.
    outgoing: DVec3,
    alpha: f64,
    diffuse: f64,
}

impl Lobe {
    fn lambda(&self, cosine: f64) -> f64 {
        let tangent2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        0.5 * ((1.0 + self.alpha * self.alpha * tangent2).sqrt() - 1.0)
    }

    /// Reflected share of the radiance from a direction above the surface, and the density of [`Self::sample`]; the
    /// part that both have in common.
    fn value_and_pdf(&self, direction: DVec3) -> (f64, f64) {
        let direction = self.frame.transpose() * direction;
        if direction.z <= 0.0 {
            return (0.0, 0.0);
        }
        let h = (direction + self.outgoing).normalize();
        let alpha2 = self.alpha * self.alpha;
        let tail = h.x * h.x + h.y * h.y + alpha2 * h.z * h.z;
        let distribution = alpha2 / (PI * tail * tail) / (4.0 * self.outgoing.z);
        let (of_o, of_i) = (self.lambda(self.outgoing.z), self.lambda(direction.z));
        let (diffuse, glossy) = (self.diffuse * direction.z * FRAC_1_PI, (1.0 - self.diffuse) * distribution);
        (diffuse + glossy / (1.0 + of_o + of_i), diffuse + glossy / (1.0 + of_o))
    }

    /// Draws a direction, through a visible normal (Heitz 2018) or in proportion to the cosine.
    fn sample(&self, pcg: &mut Pcg32) -> DVec3 {
        let (is_diffuse, u, v) = (pcg.f() < self.diffuse, pcg.f(), pcg.f());
        let (sin, cos) = (TAU * v).sin_cos();
        let (x, y) = (u.sqrt() * cos, u.sqrt() * sin);
        if is_diffuse {
            return self.frame * DVec3::new(x, y, (1.0 - u).max(0.0).sqrt());
        }
        let stretch = DVec3::new(self.alpha, self.alpha, 1.0);
        let view = (self.outgoing * stretch).normalize();
        let (s, t) = view.any_orthonormal_pair();
        // `t` along the projection of the normal, as the disk is squeezed there.
        let up = DVec3::Z - view * view.z;
        let (s, t) = if up.length_squared() > 1e-12 { (up.normalize().cross(view), up.normalize()) } else { (s, t) };
        let share = 0.5 * (1.0 + view.z);
        let y = (1.0 - share) * (1.0 - x * x).max(0.0).sqrt() + share * y;
        let normal = s * x + t * y + view * (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = (normal * DVec3::new(self.alpha, self.alpha, 1.0)).normalize();
        self.frame * (2.0 * normal.dot(self.outgoing) * normal - self.outgoing)
    }
}

/// One point's view of the lights.
struct View<'a> {
    scene: &'a Scene,
    method: &'a Fanlight<'a>,
    /// The point without the lobe, and with it.
    points: [ShadingPoint; 2],
    lobe: Lobe,
    /// Lights whose front is seen, relative to the point.
    lights: Vec<(usize, [DVec3; 3])>,
}

/// One row.
pub(crate) struct LobeRow {
    pub(crate) workload: String,
    pub(crate) method: &'static str,
    pub(crate) points: usize,
    pub(crate) relvar: Summary,
}

pub(crate) fn run(args: &Args) -> Vec<LobeRow> {
    println!("\nGlossy receivers: relative variance of one sample (of a pair, times two, for both)");
    println!("{:20} {:12} {:>6} {:>8} {:>8} {:>8}", "workload", "method", "points", "relvar", "p90", "EW");
    let mut rows = vec![];
    for (scene, name, roughnesses, shares) in WORKLOADS {
        for (alpha, diffuse) in roughnesses.iter().flat_map(|alpha| shares.iter().map(move |kd| (*alpha, *kd))) {
            let workload =
                if scene == "cloud-10000" { format!("{name}-{alpha}-{diffuse}") } else { format!("{name}-{alpha}") };
            if args.wants(&workload) || args.wants(scene) {
                rows.extend(workload_rows(&workload, &scenes::scene(scene), [alpha, diffuse], args));
            }
        }
    }
    rows
}

fn workload_rows(workload: &str, scene: &Scene, [alpha, diffuse]: [f64; 2], args: &Args) -> Vec<LobeRow> {
    let method = Fanlight::new(scene);
    let mut pcg = Pcg32::new(34, 2);
    let points: Vec<_> = scene.points.quality(args.effort.points).into_iter().map(|x| (x, pcg.direction())).collect();
    let at_point = |i: usize, (x, outgoing): &(ShadingPoint, DVec3)| {
        let mut pcg = Pcg32::new(i as u64, 9);
        View::new(scene, &method, x, *outgoing, [alpha, diffuse]).measure(args.effort.samples, &mut pcg)
    };
    let measured: Vec<_> = parallel(&points, at_point).into_iter().flatten().collect();
    let mut rows = vec![];
    for (i, name) in METHODS.into_iter().enumerate() {
        let Some(s) = summary(measured.iter().map(|(variances, e2)| (variances[i], *e2))) else { continue };
        let [median, p90, mean] = [s.median, s.p90, s.energy_weighted].map(short);
        println!("{workload:20} {name:12} {:>6} {median:>8} {p90:>8} {mean:>8}", measured.len());
        rows.push(LobeRow { workload: workload.to_owned(), method: name, points: measured.len(), relvar: s });
    }
    rows
}

impl<'a> View<'a> {
    fn new(
        scene: &'a Scene,
        method: &'a Fanlight<'a>,
        x: &ShadingPoint,
        outgoing: DVec3,
        [alpha, diffuse]: [f64; 2],
    ) -> Self {
        let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
        let relative = |l: usize| (l, scene.lights[l].vertices.map(|v| v - x.position.as_dvec3()));
        let is_front =
            |(l, vertices): &(usize, [DVec3; 3])| scene.lights[*l].normal_and_area().0.dot(vertices[0]) < 0.0;
        let lights: Vec<_> = (0..scene.lights.len()).map(relative).filter(is_front).collect();
        let n = normal.as_dvec3().normalize();
        let outgoing = if outgoing.dot(n) < 0.0 { -outgoing } else { outgoing };
        let glossy =
            Glossy::new(normal, outgoing.as_vec3(), alpha as f32).with_weights(diffuse as f32, (1.0 - diffuse) as f32);
        let (s, t) = n.any_orthonormal_pair();
        let frame = DMat3::from_cols(s, t, n);
        let lobe = Lobe { frame, outgoing: frame.transpose() * outgoing, alpha, diffuse };
        Self { scene, method, points: [*x, ShadingPoint::glossy(x.position, glossy)], lobe, lights }
    }

    /// Variances of all methods, and the squared mean. `None` where nothing arrives.
    fn measure(&self, samples: usize, pcg: &mut Pcg32) -> Option<([f64; 5], f64)> {
        // Second moments of light sampling, by samples of lights and of the lobe together, and the halves of pairs.
        let mut of_light = [0.0; 2];
        let (mut halves, mut of_lobe) = ([[Moments::default(); 2]; 2], 0.0);
        for _ in 0..samples {
            for (k, x) in self.points.iter().enumerate() {
                let mut estimate = 0.0;
                if let Some(drawn) = self.method.sample(x, pcg.uniform3()) {
                    let (value, pdf) = self.lobe.value_and_pdf(drawn.direction.as_dvec3());
                    let f = self.weight(&drawn) * value;
                    estimate = f / (drawn.pdf + pdf);
                    of_light[k] += f * f / (drawn.pdf * (drawn.pdf + pdf));
                }
                halves[k][0].add(estimate);
            }
            let direction = self.lobe.sample(pcg);
            let (value, pdf) = self.lobe.value_and_pdf(direction);
            let (mut estimates, mut seen) = ([0.0; 2], 0.0);
            if value > 0.0 {
                for drawn in self.hits(direction) {
                    let f = self.weight(&drawn) * value;
                    seen += f / pdf;
                    for (k, x) in self.points.iter().enumerate() {
                        let p = self.method.pdf(x, &drawn);
                        estimates[k] += f / (p + pdf);
                        if p > 0.0 {
                            of_light[k] += f * f / (p * (p + pdf));
                        }
                    }
                }
            }
            (0..2).for_each(|k| halves[k][1].add(estimates[k]));
            of_lobe += seen * seen;
        }
        let count = samples as f64;
        let mean = (halves[1][0].sum + halves[1][1].sum) / count;
        let e2 = mean * mean;
        let pair = |k: usize| 2.0 * (halves[k][0].variance() + halves[k][1].variance());
        let variances = [of_light[0] / count - e2, of_light[1] / count - e2, of_lobe / count - e2, pair(0), pair(1)];
        (mean > 0.0).then_some((variances.map(|v| v.max(0.0)), e2))
    }

    /// Radiance from a point of a light.
    fn weight(&self, drawn: &Drawn) -> f64 {
        let weight = self.scene.weight(drawn.light, drawn.barycentrics.map(f64::from));
        match &self.scene.sky {
            Some(sky) => weight * f64::from(sky.environment.radiance(drawn.direction)),
            None => weight,
        }
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
        self.lights.iter().filter(is_crossed).map(drawn)
    }
}

/// Of the estimates by one kind of samples.
#[derive(Clone, Copy, Default)]
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
