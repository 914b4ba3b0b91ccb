//! Glossy receivers: how much noise there is if lights are sampled with and without regard to the lobe, if the lobe
//! alone is sampled, and if both are, weighted by the balance heuristic.
//!
//! The receiver reflects `kd cos θ / π + ks D G / (4 cos θo)`, GGX with height-correlated masking and without Fresnel.
//! A brushed one has a roughness along a tangent and another across. A rough pane reflects a tenth, and the rest of the
//! lobe is mirrored to its other side.
//!
//! `resampled-8` is what a host does whose BSDF the crate does not know: a pair whose light sample is one of eight
//! blind ones, chosen by what it brings. `power` is a pair by the power heuristic with the exponent 2 (Veach and Guibas
//! 1995). `pair@ideal` is the pair, by the balance heuristic, of a sample of the BSDF and one in exact proportion to
//! what arrives. It is no lower bound: a light sample that leaves to the BSDF what that finds may do better in a pair.
//! Emitters do not cover each other: a ray sees all that it crosses.

use core::f64::consts::{FRAC_1_PI, PI, TAU};

use ::fanlight::{Glossy, Microfacet, Receiver, ShadingPoint};
use glam::{DMat3, DVec3, Vec3};

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
/// Workloads with microfacets: scene, name, roughness along the tangent and across, and what is transmitted.
const MICROFACETS: [(&str, &str, [f64; 2], f64); 6] = [
    ("cloud-10000", "lobe-brushed-0.05-0.2", [0.05, 0.2], 0.0),
    ("cloud-10000", "lobe-brushed-0.1-0.4", [0.1, 0.4], 0.0),
    ("cloud-10000", "lobe-pane-0.1", [0.1, 0.1], 0.9),
    ("cloud-10000", "lobe-pane-0.3", [0.3, 0.3], 0.9),
    ("quad", "lobe-quad-brushed-0.05-0.2", [0.05, 0.2], 0.0),
    ("quad", "lobe-quad-pane-0.1", [0.1, 0.1], 0.9),
];
const METHODS: [&str; 9] =
    ["light", "light@lobe", "bsdf", "pair", "pair@lobe", "resampled-8", "power", "power@lobe", "pair@ideal"];
/// Candidates of the last one.
const CANDIDATES: usize = 8;

/// What the receiver reflects.
struct Lobe {
    /// Tangent, bitangent and normal.
    frame: DMat3,
    /// Outgoing direction in the frame.
    outgoing: DVec3,
    look: Look,
}

/// What a receiver is made of.
#[derive(Clone, Copy)]
struct Look {
    /// Roughness along the tangent and across.
    alpha: [f64; 2],
    diffuse: f64,
    /// Share of the lobe that is mirrored to the other side.
    transmitted: f64,
}

impl Look {
    /// A point without the lobe, and with it.
    fn points(self, position: Vec3, normal: Vec3, outgoing: DVec3, tangent: DVec3) -> [ShadingPoint; 2] {
        let Self { alpha: [x, y], diffuse, transmitted } = self;
        let outgoing = outgoing.as_vec3();
        let share = 1.0 - diffuse;
        if x == y && transmitted == 0.0 {
            let glossy = Glossy::new(normal, outgoing, x as f32).with_weights(diffuse as f32, share as f32);
            return [ShadingPoint::surface(position, normal), ShadingPoint::glossy(position, glossy)];
        }
        let shares = [diffuse, share * (1.0 - transmitted), share * transmitted].map(|share| share as f32);
        let facets = Microfacet::new(normal, outgoing, x as f32).anisotropic(tangent.as_vec3(), [x as f32, y as f32]);
        let facets = facets.with_weights(shares[0], shares[1], shares[2]);
        let blind = if transmitted > 0.0 { ShadingPoint::transmissive } else { ShadingPoint::surface };
        [blind(position, normal), ShadingPoint::microfacet(position, facets)]
    }

    /// The stretch from the hemisphere to the microfacets.
    fn stretch(&self) -> DVec3 {
        DVec3::new(self.alpha[0], self.alpha[1], 1.0)
    }
}

impl Lobe {
    /// Smith's Λ of a direction in the frame.
    fn lambda(&self, direction: DVec3) -> f64 {
        let across = (direction * self.look.stretch()).truncate().length_squared();
        0.5 * ((1.0 + across / (direction.z * direction.z)).sqrt() - 1.0)
    }

    /// Scattered share of the radiance from a direction, and the density of [`Self::sample`].
    fn value_and_pdf(&self, direction: DVec3) -> (f64, f64) {
        let direction = self.frame.transpose() * direction;
        let Look { alpha: [x, y], diffuse, transmitted } = self.look;
        let (above, diffuse, share) = if direction.z > 0.0 {
            (direction, diffuse * direction.z * FRAC_1_PI, (1.0 - diffuse) * (1.0 - transmitted))
        } else {
            (direction * DVec3::new(1.0, 1.0, -1.0), 0.0, (1.0 - diffuse) * transmitted)
        };
        if above.z <= 0.0 || share == 0.0 && diffuse == 0.0 {
            return (0.0, 0.0);
        }
        let h = (above + self.outgoing).normalize();
        let tail = (h.x / x).powi(2) + (h.y / y).powi(2) + h.z * h.z;
        let distribution = 1.0 / (PI * x * y * tail * tail) / (4.0 * self.outgoing.z);
        let (of_o, of_i) = (self.lambda(self.outgoing), self.lambda(above));
        let glossy = share * distribution;
        (diffuse + glossy / (1.0 + of_o + of_i), diffuse + glossy / (1.0 + of_o))
    }

    /// Draws a direction, through a visible normal (Heitz 2018) or in proportion to the cosine.
    fn sample(&self, pcg: &mut Pcg32) -> DVec3 {
        let (choice, u, v) = (pcg.f(), pcg.f(), pcg.f());
        let (sin, cos) = (TAU * v).sin_cos();
        let (x, y) = (u.sqrt() * cos, u.sqrt() * sin);
        if choice < self.look.diffuse {
            return self.frame * DVec3::new(x, y, (1.0 - u).max(0.0).sqrt());
        }
        let stretch = self.look.stretch();
        let view = (self.outgoing * stretch).normalize();
        let (s, t) = view.any_orthonormal_pair();
        // `t` along the projection of the normal, as the disk is squeezed there.
        let up = DVec3::Z - view * view.z;
        let (s, t) = if up.length_squared() > 1e-12 { (up.normalize().cross(view), up.normalize()) } else { (s, t) };
        let share = 0.5 * (1.0 + view.z);
        let y = (1.0 - share) * (1.0 - x * x).max(0.0).sqrt() + share * y;
        let normal = s * x + t * y + view * (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = (normal * stretch).normalize();
        let mirrored = 2.0 * normal.dot(self.outgoing) * normal - self.outgoing;
        if mirrored.z <= 0.0 {
            // Neither side scatters it.
            return DVec3::ZERO;
        }
        let is_transmitted = choice > 1.0 - (1.0 - self.look.diffuse) * self.look.transmitted;
        self.frame * mirrored.with_z(if is_transmitted { -mirrored.z } else { mirrored.z })
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
                let look = Look { alpha: [alpha; 2], diffuse, transmitted: 0.0 };
                rows.extend(workload_rows(&workload, &scenes::scene(scene), look, args));
            }
        }
    }
    for (scene, workload, alpha, transmitted) in MICROFACETS {
        if args.wants(workload) || args.wants(scene) {
            let look = Look { alpha, diffuse: 0.0, transmitted };
            rows.extend(workload_rows(workload, &scenes::scene(scene), look, args));
        }
    }
    rows
}

fn workload_rows(workload: &str, scene: &Scene, look: Look, args: &Args) -> Vec<LobeRow> {
    let method = Fanlight::new(scene);
    let mut pcg = Pcg32::new(34, 2);
    let points: Vec<_> = scene.points.quality(args.effort.points).into_iter().map(|x| (x, pcg.direction())).collect();
    let at_point = |i: usize, (x, outgoing): &(ShadingPoint, DVec3)| {
        let mut pcg = Pcg32::new(i as u64, 9);
        View::new(scene, &method, x, *outgoing, look).measure(args.effort.samples, &mut pcg, i as u64)
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
    fn new(scene: &'a Scene, method: &'a Fanlight<'a>, x: &ShadingPoint, outgoing: DVec3, look: Look) -> Self {
        let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
        let relative = |l: usize| (l, scene.lights[l].vertices.map(|v| v - x.position.as_dvec3()));
        let is_front =
            |(l, vertices): &(usize, [DVec3; 3])| scene.lights[*l].normal_and_area().0.dot(vertices[0]) < 0.0;
        let lights: Vec<_> = (0..scene.lights.len()).map(relative).filter(is_front).collect();
        let n = normal.as_dvec3().normalize();
        let outgoing = if outgoing.dot(n) < 0.0 { -outgoing } else { outgoing };
        let (s, t) = n.any_orthonormal_pair();
        let frame = DMat3::from_cols(s, t, n);
        let points = look.points(x.position, normal, outgoing, s);
        let lobe = Lobe { frame, outgoing: frame.transpose() * outgoing, look };
        Self { scene, method, points, lobe, lights }
    }

    /// Variances of all methods, and the squared mean. `None` where nothing arrives.
    fn measure(&self, samples: usize, pcg: &mut Pcg32, point: u64) -> Option<([f64; METHODS.len()], f64)> {
        // Second moments of light sampling, by samples of lights and of the lobe together, and the halves of pairs.
        let mut of_light = [0.0; 2];
        let (mut halves, mut power, mut of_lobe) = ([[Moments::default(); 2]; 2], [[Moments::default(); 2]; 2], 0.0);
        let (mut resampled, mut candidates) = (Moments::default(), Pcg32::new(point, 10));
        let mut arrivals = Arrivals::default();
        for _ in 0..samples {
            for (k, x) in self.points.iter().enumerate() {
                let (mut estimate, mut by_power) = (0.0, 0.0);
                if let Some(drawn) = self.method.sample(x, pcg.uniform3()) {
                    let (value, pdf) = self.lobe.value_and_pdf(drawn.direction.as_dvec3());
                    let arrival = Arrival { f: self.weight(&drawn) * value, light: drawn.pdf, bsdf: pdf };
                    estimate = arrival.over_both();
                    by_power = arrival.by_power(drawn.pdf);
                    of_light[k] += arrival.f / drawn.pdf * estimate;
                    arrivals.of_light.extend((k == 1).then_some(arrival));
                }
                halves[k][0].add(estimate);
                power[k][0].add(by_power);
            }
            resampled.add(self.resample(&mut candidates));
            let direction = self.lobe.sample(pcg);
            let (value, pdf) = self.lobe.value_and_pdf(direction);
            let (mut estimates, mut by_power, mut seen) = ([0.0; 2], [0.0; 2], 0.0);
            let first = arrivals.of_bsdf.len();
            if value > 0.0 {
                for drawn in self.hits(direction) {
                    let f = self.weight(&drawn) * value;
                    seen += f / pdf;
                    for (k, x) in self.points.iter().enumerate() {
                        let arrival = Arrival { f, light: self.method.pdf(x, &drawn), bsdf: pdf };
                        estimates[k] += arrival.over_both();
                        by_power[k] += arrival.by_power(pdf);
                        if arrival.light > 0.0 {
                            of_light[k] += f / arrival.light * arrival.over_both();
                        }
                        arrivals.of_bsdf.extend((k == 1).then_some(arrival));
                    }
                }
            }
            arrivals.rays.push(first..arrivals.of_bsdf.len());
            for k in 0..2 {
                halves[k][1].add(estimates[k]);
                power[k][1].add(by_power[k]);
            }
            of_lobe += seen * seen;
        }
        let count = samples as f64;
        let mean = (halves[1][0].sum + halves[1][1].sum) / count;
        let e2 = mean * mean;
        let pair = |[light, bsdf]: [Moments; 2]| 2.0 * (light.variance() + bsdf.variance());
        let [blind, known] = of_light.map(|moment| moment / count - e2);
        let [pairs, powers] = [halves.map(pair), power.map(pair)];
        let resampled = pair([resampled, halves[0][1]]);
        let ideal = arrivals.ideal_pair(mean);
        let of_lobe = of_lobe / count - e2;
        let variances =
            [blind, known, of_lobe, pairs[0], pairs[1], resampled, powers[0], powers[1], ideal].map(|v| v.max(0.0));
        (mean > 0.0).then_some((variances, e2))
    }

    /// The half of a pair that one of several samples without the lobe brings.
    fn resample(&self, pcg: &mut Pcg32) -> f64 {
        let numbers: [[f32; 3]; CANDIDATES] = core::array::from_fn(|_| pcg.uniform3());
        let half = |drawn: &Drawn| {
            let (value, pdf) = self.lobe.value_and_pdf(drawn.direction.as_dvec3());
            self.weight(drawn) * value * drawn.pdf / (drawn.pdf + pdf)
        };
        let chosen = self.method.resampled(&self.points[0], &numbers, pcg.f() as f32, half);
        chosen.map_or(0.0, |(drawn, weight)| half(&drawn) * weight)
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

/// What arrives along a direction, and how probable the direction is.
#[derive(Clone, Copy)]
struct Arrival {
    /// Radiance times what the receiver scatters of it.
    f: f64,
    /// Densities of a light sample with the lobe, and of a sample of the BSDF.
    light: f64,
    bsdf: f64,
}

impl Arrival {
    /// Either half of a pair, by the balance heuristic.
    fn over_both(&self) -> f64 {
        self.f / (self.light + self.bsdf)
    }

    /// The half of a pair that was drawn with the density `own`, by the power heuristic.
    fn by_power(&self, own: f64) -> f64 {
        self.f * own / (self.light * self.light + self.bsdf * self.bsdf)
    }
}

/// What arrived at one point.
#[derive(Default)]
struct Arrivals {
    of_light: Vec<Arrival>,
    of_bsdf: Vec<Arrival>,
    /// Those in `of_bsdf` of each ray.
    rays: Vec<core::ops::Range<usize>>,
}

impl Arrivals {
    /// Variance of the pair, times two, if lights were sampled in proportion to `f`, whose integral is `mean`.
    fn ideal_pair(&self, mean: f64) -> f64 {
        // Either half, by the balance heuristic.
        let half = |a: &Arrival| a.f / (a.f / mean + a.bsdf);
        let count = self.rays.len() as f64;
        // Moments of the first half, by samples of both kinds.
        let moment = |power: i32| {
            let all = self.of_light.iter().chain(&self.of_bsdf);
            all.map(|a| half(a).powi(power) * a.over_both() / mean).sum::<f64>() / count
        };
        let mut bsdf = Moments::default();
        self.rays.iter().for_each(|ray| bsdf.add(self.of_bsdf[ray.clone()].iter().map(half).sum()));
        2.0 * (moment(2) - moment(1).powi(2) + bsdf.variance())
    }
}

/// Count and sums of the estimates by one kind of samples.
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
