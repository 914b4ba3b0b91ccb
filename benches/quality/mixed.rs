//! Lamps of three kinds in a cloud: points, spots and spheres. The choice among them alone, without noise.
//!
//! Beside the crate: pbrt-v4's light tree with the bounds that it gives to each kind (`lights.cpp`), the importance of
//! these bounds for every lamp, and power alone. Lamps do not hide each other.

use core::f64::consts::PI;
use std::time::Instant;

use fanlight::{LightId, LightSampler, PointLight, Receiver, ShadingPoint, SphereLight, SpotLight};
use glam::Vec3;

use crate::args::Args;
use crate::methods::{BinaryTree, LightBounds};
use crate::metrics;
use crate::parallel::parallel;
use crate::report::{self, Row};
use crate::scenes;
use crate::scenes::cloud;
use crate::scenes::pcg::Pcg32;
use crate::timing::Nanoseconds;

/// The workload.
pub(crate) const NAME: &str = "cloud-mixed";
const METHODS: [&str; 4] = ["fanlight", "power", "binary-tree", "every-light"];

const COUNT: usize = 10_000;
/// Angles from the axis of a spot up to which its intensity is constant, and from which on it is zero.
const ANGLES: [f32; 2] = [30.0, 45.0];
/// Radius of the spheres.
const RADIUS: f32 = 0.005;

/// A lamp of the workload, which sends up to its intensity.
#[derive(Clone, Copy)]
struct Lamp {
    position: Vec3,
    intensity: f32,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Point,
    /// With its axis.
    Spot(Vec3),
    Sphere,
}

/// Centers and radiances of cloud-10000 as positions and intensities; kinds by turns.
fn lamps() -> Vec<Lamp> {
    let mut axes = Pcg32::new(40, 2);
    let mut lamp = |(i, (position, intensity)): (usize, (Vec3, f32))| {
        let kind = match i % 3 {
            0 => Kind::Point,
            1 => Kind::Spot(axes.direction().as_vec3()),
            _ => Kind::Sphere,
        };
        Lamp { position, intensity, kind }
    };
    cloud::centers_and_radiances(COUNT).into_iter().enumerate().map(&mut lamp).collect()
}

impl Lamp {
    /// Radiance of a sphere, whose intensity is that of its disk.
    fn radiance(&self) -> f64 {
        f64::from(self.intensity) / (PI * f64::from(RADIUS).powi(2))
    }

    fn light(&self) -> fanlight::Lamp {
        match self.kind {
            Kind::Point => PointLight::new(self.position, self.intensity).into(),
            Kind::Spot(axis) => SpotLight::new(self.position, axis, self.intensity, ANGLES.map(f32::to_radians)).into(),
            Kind::Sphere => SphereLight::new(self.position, RADIUS, self.radiance() as f32).into(),
        }
    }

    /// Irradiance in closed form.
    fn irradiance(&self, x: &ShadingPoint) -> f64 {
        let Receiver::Surface(normal) = x.receiver else { panic!("the workload has surfaces alone") };
        let to = self.position.as_dvec3() - x.position.as_dvec3();
        let (direction, distance2) = (to.normalize(), to.length_squared());
        let cosine = normal.as_dvec3().dot(direction);
        let share = match self.kind {
            Kind::Point => 1.0,
            Kind::Spot(axis) => {
                let [inner, outer] = ANGLES.map(|angle| f64::from(angle.to_radians()).cos());
                let t = ((axis.as_dvec3().dot(-direction) - outer) / (inner - outer)).clamp(0.0, 1.0);
                t * t * (3.0 - 2.0 * t)
            }
            Kind::Sphere => return self.radiance() * sphere_factor(f64::from(RADIUS).powi(2) / distance2, cosine),
        };
        f64::from(self.intensity) * share * cosine.max(0.0) / distance2
    }

    /// `Bounds` of `PointLight`, `SpotLight` and `DiffuseAreaLight` over a `Sphere`.
    fn bounds(&self) -> LightBounds {
        let phi = 4.0 * PI as f32 * self.intensity;
        let right_angle = 0.0;
        match self.kind {
            Kind::Point => LightBounds::of_box([self.position; 2], (Vec3::Z, -1.0), right_angle, phi),
            Kind::Spot(axis) => {
                let [inner, outer] = ANGLES.map(f32::to_radians);
                LightBounds::of_box([self.position; 2], (axis, inner.cos()), (outer - inner).cos(), phi)
            }
            // Radiance times area times π is the same.
            Kind::Sphere => {
                let corners = [-RADIUS, RADIUS].map(|radius| self.position + Vec3::splat(radius));
                LightBounds::of_box(corners, (Vec3::Z, -1.0), right_angle, phi)
            }
        }
    }
}

/// Irradiance of a surface from a sphere of radiance 1, by the square of the sine of its angular radius and the cosine
/// of its center: the part above the horizon (Snyder 1996, "Area Light Sources for Real-Time Graphics").
fn sphere_factor(sin2: f64, cosine: f64) -> f64 {
    if sin2 >= 1.0 {
        // Inside of it nothing arrives.
        return 0.0;
    }
    if cosine * cosine >= sin2 {
        return PI * sin2 * cosine.max(0.0);
    }
    let sine = (1.0 - cosine * cosine).sqrt();
    let x = (1.0 / sin2 - 1.0).sqrt();
    let y = -x * cosine / sine;
    let rest = sine * (1.0 - y * y).max(0.0).sqrt();
    (cosine * y.clamp(-1.0, 1.0).acos() - x * rest) * sin2 + (rest / x).atan()
}

/// What is compared.
enum Method {
    Fanlight(Box<LightSampler>),
    Power(f64),
    Tree(BinaryTree),
    Every(Vec<LightBounds>),
}

impl Method {
    fn new(name: &str, lamps: &[Lamp]) -> Self {
        let bounds = || lamps.iter().map(Lamp::bounds).collect::<Vec<_>>();
        match name {
            "fanlight" => {
                let mut builder = LightSampler::builder();
                lamps.iter().for_each(|lamp| {
                    builder.add_light(lamp.light()).expect("the workload is valid");
                });
                Self::Fanlight(Box::new(builder.build().expect("the workload is small")))
            }
            "power" => Self::Power(lamps.iter().map(|lamp| f64::from(lamp.bounds().phi)).sum()),
            "binary-tree" => Self::Tree(BinaryTree::new(&bounds())),
            _ => Self::Every(bounds()),
        }
    }

    /// Probabilities of all lamps that light arrives from.
    fn pmfs(&self, x: &ShadingPoint, lamps: &[Lamp], irradiances: &[f64]) -> Vec<f64> {
        let each = |pmf: &dyn Fn(usize) -> f64| {
            irradiances.iter().enumerate().map(|(i, e)| if *e > 0.0 { pmf(i) } else { 0.0 }).collect()
        };
        match self {
            Self::Fanlight(lights) => {
                let at = lights.at(x);
                each(&|i| at.pmf_light(LightId::from_index(i as u32)).into())
            }
            Self::Power(total) => each(&|i| f64::from(lamps[i].bounds().phi) / total),
            Self::Tree(tree) => each(&|i| tree.pmf(x, i)),
            Self::Every(bounds) => {
                let total: f64 = bounds.iter().map(|bounds| f64::from(bounds.importance(x))).sum();
                each(&|i| f64::from(bounds[i].importance(x)) / total)
            }
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Fanlight(lights) => lights.bytes().total(),
            Self::Power(_) => 0,
            Self::Tree(tree) => tree.bytes(),
            Self::Every(bounds) => size_of_val(&bounds[..]),
        }
    }
}

/// Runs the workload, and returns its rows: no times, as nothing but the choice is evaluated.
pub(crate) fn run(args: &Args) -> Vec<Row> {
    let names: Vec<&str> = METHODS.into_iter().filter(|name| args.wants_method(name, None)).collect();
    if !args.wants(NAME) || names.is_empty() {
        return vec![];
    }
    let lamps = lamps();
    let points = scenes::points::PointSet::Cube.quality(args.effort.points);
    let exact = parallel(&points, |_, x| lamps.iter().map(|lamp| lamp.irradiance(x)).collect::<Vec<_>>());
    let lit: Vec<(ShadingPoint, Vec<f64>)> =
        points.into_iter().zip(exact).filter(|(_, irradiances)| irradiances.iter().sum::<f64>() > 0.0).collect();
    let row = |name: &str| {
        let start = Instant::now();
        let method = Method::new(name, &lamps);
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let found = parallel(&lit, |_, (x, irradiances)| select(irradiances, &method.pmfs(x, &lamps, irradiances)));
        let lost = found.iter().fold(0.0, |most: f64, [.., lost]| most.max(*lost));
        Row {
            workload: NAME.to_owned(),
            method: name.to_owned(),
            class: "all",
            points: lit.len(),
            relvar: None,
            selection: metrics::summary(found.iter().map(|[variance, e2, _]| (*variance, *e2))),
            lost: Some(lost),
            zero_rate: None,
            nanoseconds: Nanoseconds { lit: 0.0, all: 0.0, pdf: 0.0 },
            bytes: method.bytes(),
            build_ms,
            reach: None,
            rays_learned: None,
        }
    };
    let rows: Vec<Row> = names.into_iter().map(row).collect();
    rows.iter().for_each(report::print);
    rows
}

/// Variance of the choice, the square of the irradiance, and the share of it that cannot be chosen.
fn select(irradiances: &[f64], pmfs: &[f64]) -> [f64; 3] {
    let (mut total, mut squares, mut lost) = (0.0, 0.0, 0.0);
    for (irradiance, pmf) in irradiances.iter().zip(pmfs) {
        total += irradiance;
        if *irradiance > 0.0 && *pmf > 0.0 {
            squares += irradiance * irradiance / pmf;
        } else {
            lost += irradiance;
        }
    }
    [squares - total * total, total * total, lost / total]
}
