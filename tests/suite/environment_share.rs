//! What it costs that the environment and the lights share one sample, where lamps are hidden and where they are not.
//!
//! A shading point on a floor, lamps over it and a sky. The lamps send a multiple of what the sky sends. Where they are
//! in casings, of which no estimate knows, nothing of it arrives. Three ways to sample: one sample of both, one of each
//! (`sample_split` that splits nothing), and what a host has without fanlight, one of the sky by its radiance and one
//! of the lamps by power. *Cost* is relative variance times rays. `-- --nocapture` prints the table of docs/ACCURACY.md.

use std::sync::OnceLock;

use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::statistics::Mean;
use fanlight::{
    Environment, Filter, LightId, LightSample, LightSampler, PointSampler, SampledLight, ShadingPoint, SphereLight,
    Splitting,
};
use glam::{DVec3, Vec3};

const PI: f64 = core::f64::consts::PI;
/// Distances of the lamps; all have the same power.
const DISTANCES: [f64; 6] = [1.0, 1.3, 1.7, 2.2, 2.9, 3.7];
/// Cosine of the angle between the normal and each lamp.
const COSINE: f64 = 0.7;
const LAMP: f64 = 0.1;
const CASING: f64 = 0.12;
/// Steps of the ratio from lamps to sky in each decade, from 10⁻² to 10⁶.
const STEPS: i32 = 4;
/// Estimates of each kind.
const COUNT: usize = 1500;
/// Least probability of the sky, and of the lamps.
const SHARE: f64 = 0.1;
/// Draws one lamp and one direction of the sky.
const ONE_OF_EACH: Splitting = Splitting::new(0.0, 0);

/// What is in the scenes, but for the radiance of the lamps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Family {
    lamps: usize,
    /// Whether most of the sky's light comes from a twentieth of its directions.
    window: bool,
    /// Whether the lamps are in casings.
    hidden: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// One sample of the mixture.
    One,
    Each,
    /// What a host has.
    Host,
}

struct Scene {
    family: Family,
    centers: Vec<DVec3>,
    ids: Vec<LightId>,
    lights: LightSampler,
    sky: Environment,
    radiance: f64,
    irradiance: f64,
}

/// The mean of the estimates relative to the irradiance, its standard error, and the relative variance.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    error: f64,
    variance: f64,
    rays: f64,
}

impl Estimate {
    fn cost(&self) -> f64 {
        self.rays * self.variance
    }
}

/// Estimates of each way, by light samples alone and next to a direction of the surface, by the balance heuristic.
#[derive(Debug)]
struct Row {
    family: Family,
    ratio: f64,
    one: [Estimate; 2],
    each: [Estimate; 2],
    host: [Estimate; 2],
}

/// Irradiance of the floor by a sphere of unit radiance.
fn of_sphere(center: DVec3, radius: f64) -> f64 {
    PI * radius * radius / center.length_squared() * center.normalize().z
}

/// Direction of the upper hemisphere by its projection, uniform over the disk.
fn projected(u: f64, v: f64) -> Vec3 {
    let (sin, cos) = (2.0 * PI * v).sin_cos();
    DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt()).as_vec3()
}

impl Family {
    fn centers(self) -> Vec<DVec3> {
        let sine = (1.0 - COSINE * COSINE).sqrt();
        let center = |i: usize| {
            let (sin, cos) = (2.0 * PI * i as f64 / DISTANCES.len() as f64).sin_cos();
            DISTANCES[i] * DVec3::new(sine * cos, sine * sin, COSINE)
        };
        (0..self.lamps).map(center).collect()
    }

    fn sky(self) -> Environment {
        let is_window = |x, y| (3..5).contains(&x) && (9..11).contains(&y);
        let texel = |i| if is_window(i % 16, i / 16) { 50.0 } else { 0.1 };
        let sky = if self.window {
            Environment::from_equal_area(16, &(0..256).map(texel).collect::<Vec<_>>(), Filter::Nearest)
        } else {
            Environment::constant(1.0)
        };
        sky.expect("the radiances are valid")
    }

    const fn radius(self) -> f64 {
        if self.hidden { CASING } else { LAMP }
    }

    /// The lamp or casing that a ray from the shading point meets.
    fn first(self, centers: &[DVec3], direction: Vec3) -> Option<usize> {
        let direction = direction.as_dvec3();
        centers.iter().position(|center| {
            let along = center.dot(direction);
            along > 0.0 && center.length_squared() - along * along < self.radius() * self.radius()
        })
    }

    /// Irradiance by the sky if nothing were in front of it.
    fn irradiance_of_open_sky(self) -> f64 {
        let sky = self.sky();
        if self.window { quadrature(|direction| f64::from(sky.radiance(direction))) } else { PI }
    }

    /// Irradiance that the lamps or casings take from the sky: nothing is in front of the window.
    fn shaded(self) -> f64 {
        let radiance = if self.window { 0.1 } else { 1.0 };
        radiance * self.centers().iter().map(|center| of_sphere(*center, self.radius())).sum::<f64>()
    }
}

/// Integral of the radiance times the cosine over the upper hemisphere.
fn quadrature(mut radiance: impl FnMut(Vec3) -> f64) -> f64 {
    let n = 400;
    let middle = |i: usize| (i as f64 + 0.5) / n as f64;
    let sum: f64 = (0..n * n).map(|k| radiance(projected(middle(k / n), middle(k % n)))).sum();
    sum * PI / (n * n) as f64
}

impl Scene {
    /// Lamps that send a multiple of the irradiance by the open sky.
    fn new(family: Family, open_sky: f64, ratio: f64) -> Self {
        let (centers, sky) = (family.centers(), family.sky());
        let of_lamps: f64 = centers.iter().map(|center| of_sphere(*center, LAMP)).sum();
        let radiance = ratio * open_sky / of_lamps;
        let seen = if family.hidden { 0.0 } else { radiance * of_lamps };
        let irradiance = seen + open_sky - family.shaded();
        let mut builder = LightSampler::builder().environment(sky.clone()).environment_as_light();
        let lamp = |center: &DVec3| SphereLight::new(center.as_vec3(), LAMP as f32, radiance as f32);
        let ids = centers.iter().map(|center| builder.add_light(lamp(center)).expect("the lamp is valid")).collect();
        let lights = builder.build().expect("the scene is valid");
        Self { family, centers, ids, lights, sky, radiance, irradiance }
    }

    fn first(&self, direction: Vec3) -> Option<usize> {
        self.family.first(&self.centers, direction)
    }

    /// What arrives from a direction, times the cosine.
    fn arriving(&self, direction: Vec3) -> f64 {
        let radiance = match self.first(direction) {
            None => f64::from(self.sky.radiance(direction)),
            Some(_) if self.family.hidden => 0.0,
            Some(_) => self.radiance,
        };
        radiance * f64::from(direction.z.max(0.0))
    }

    /// One minus the cosine of the angle that a lamp fills around its center.
    fn versine(&self, lamp: usize) -> f64 {
        1.0 - (1.0 - LAMP * LAMP / self.centers[lamp].length_squared()).sqrt()
    }

    /// Density of a direction by its way, for what is met there.
    fn density(&self, at: &PointSampler<'_>, way: Way, direction: Vec3) -> f64 {
        match (way, self.first(direction)) {
            (Way::One, None) => at.pdf_environment(direction).into(),
            (Way::One, Some(lamp)) => at.pdf_light(self.ids[lamp], direction).into(),
            (Way::Each, None) => at.pdf_split_environment(direction, &ONE_OF_EACH).into(),
            (Way::Each, Some(lamp)) => at.pdf_split_light(self.ids[lamp], direction, &ONE_OF_EACH).into(),
            (Way::Host, None) => self.sky.pdf(direction).into(),
            (Way::Host, Some(lamp)) => 1.0 / (2.0 * PI * self.versine(lamp) * self.centers.len() as f64),
        }
    }

    /// A direction to a lamp by power, uniform in its cone.
    fn to_lamp(&self, pcg: &mut Pcg32) -> Vec3 {
        let lamp = pcg.below(self.centers.len());
        let cos = 1.0 - f64::from(pcg.f32()) * self.versine(lamp);
        let (y, x) = (2.0 * PI * f64::from(pcg.f32())).sin_cos();
        let axis = self.centers[lamp].normalize();
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        (axis * cos + (1.0 - cos * cos).sqrt() * (x * tangent + y * bitangent)).as_vec3()
    }

    /// Directions of one estimate, and whether each is meant for the sky. Strata of the choice make the measured
    /// variance less noisy, and leave what is measured as it is.
    fn draw(&self, at: &PointSampler<'_>, way: Way, stratum: usize, pcg: &mut Pcg32) -> Vec<(Vec3, bool)> {
        let [choice, u, v] = pcg.cube();
        let mut samples = Vec::<LightSample>::new();
        match way {
            Way::One => samples.extend(at.sample([(stratum as f32 + choice) / COUNT as f32, u, v])),
            Way::Each => at.sample_split([choice, u, v], &ONE_OF_EACH, &mut samples),
            Way::Host => {
                let sky = self.sky.sample([u, v]).expect("the sky is lit");
                return vec![(sky.direction, true), (self.to_lamp(pcg), false)];
            }
        }
        samples.iter().map(|sample| (sample.direction, sample.light == SampledLight::Environment)).collect()
    }

    fn estimate(&self, way: Way, balances: bool) -> Estimate {
        let at = self.lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
        let mut pcg = Pcg32::new(1, 2);
        let of_surface = |direction: Vec3| if balances { f64::from(direction.z.max(0.0)) / PI } else { 0.0 };
        let along = |direction| match self.arriving(direction) {
            0.0 => 0.0,
            value => value / (self.density(&at, way, direction) + of_surface(direction)),
        };
        let mut estimates = Mean::default();
        for i in 0..COUNT {
            let drawn = self.draw(&at, way, i, &mut pcg);
            let met = drawn.iter().filter(|(direction, to_sky)| self.first(*direction).is_none() == *to_sky);
            let mut sum: f64 = met.map(|(direction, _)| along(*direction)).sum();
            if balances {
                // Even points: few directions meet a lamp, and their number is not to be left to chance.
                let even = [(i as f64 + 0.5) / COUNT as f64, (i as f64 * 0.618_033_988_75).fract()];
                sum += along(projected(even[0], even[1]));
            }
            estimates.add(sum / self.irradiance);
        }
        let rays = if way == Way::One { 1.0 } else { 2.0 } + f64::from(u8::from(balances));
        let (mean, error) = (estimates.mean(), estimates.error());
        Estimate { mean, error, variance: error * error * COUNT as f64, rays }
    }
}

impl Row {
    fn new(family: Family, open_sky: f64, ratio: f64) -> Self {
        let scene = Scene::new(family, open_sky, ratio);
        let [one, each, host] =
            [Way::One, Way::Each, Way::Host].map(|way| [false, true].map(|balances| scene.estimate(way, balances)));
        Self { family, ratio, one, each, host }
    }

    fn print(&self) {
        let Family { lamps, window, hidden } = self.family;
        let costs = [0, 1].map(|k| [self.one, self.each, self.host].map(|e| format!("{:7.3}", e[k].cost())).join(" "));
        let [alone, balanced] = costs;
        let (sky, seen) = (if window { "window" } else { "even" }, if hidden { "hidden" } else { "open" });
        println!("{lamps} {sky:6} {seen:6} {:9.2e}: {alone} | {balanced}", self.ratio);
    }
}

/// All families, each from dim lamps to bright ones.
fn rows() -> &'static [Vec<Row>] {
    static ROWS: OnceLock<Vec<Vec<Row>>> = OnceLock::new();
    ROWS.get_or_init(|| {
        let family = |i: usize| Family { lamps: [1, 6][i / 4], window: i / 2 % 2 == 1, hidden: i % 2 == 1 };
        let ratios: Vec<_> = (-2 * STEPS..=6 * STEPS).map(|k| 10_f64.powf(f64::from(k) / f64::from(STEPS))).collect();
        parallel::map(8, |i| {
            let (family, open_sky) = (family(i), family(i).irradiance_of_open_sky());
            ratios.iter().map(|ratio| Row::new(family, open_sky, *ratio)).collect()
        })
    })
}

#[test]
fn the_quadrature_finds_what_has_a_closed_form() {
    for family in [false, true].map(|window| Family { lamps: 6, window, hidden: true }) {
        let (centers, sky) = (family.centers(), family.sky());
        let is_open = |direction| family.first(&centers, direction).is_none();
        let seen = quadrature(|d| if is_open(d) { f64::from(sky.radiance(d)) } else { 0.0 });
        let expected = family.irradiance_of_open_sky() - family.shaded();
        assert!((seen / expected - 1.0).abs() < 1e-3, "{seen} not {expected}: {family:?}");
    }
}

#[test]
fn all_ways_find_the_irradiance() {
    for row in rows().iter().flatten() {
        for estimate in [row.one, row.each, row.host].iter().flatten() {
            assert!((estimate.mean - 1.0).abs() < 5.0 * estimate.error + 3e-3, "{estimate:?} {row:?}");
        }
    }
}

/// A choice that takes one of both is right where the estimates are. Where a casing makes them wrong, its variance is
/// that of the sky's samples over the sky's share.
#[test]
fn the_share_bounds_what_a_wrong_estimate_costs() {
    for row in rows().iter().flatten() {
        row.print();
        let [one, each] = [row.one[0], row.each[0]].map(|estimate| 1.0 + estimate.variance);
        let share = if row.family.hidden { SHARE } else { 1.0 - SHARE };
        assert!(one < 1.05 * each / share, "{one} over {each}: {row:?}");
    }
}

/// Never worse than what a host has, whatever the lamps send and whatever hides them.
#[test]
fn one_of_each_costs_no_more_than_a_host_without_fanlight() {
    for row in rows().iter().flatten() {
        for (each, host) in row.each.iter().zip(&row.host) {
            assert!(each.cost() < 1.1 * host.cost(), "{} over {}: {row:?}", each.cost(), host.cost());
        }
    }
}

#[test]
fn the_cost_is_gradual() {
    for pair in rows().iter().flat_map(|family| family.windows(2)) {
        for k in [0, 1] {
            let [a, b] = [&pair[0], &pair[1]].map(|row| 1.0 + row.one[k].variance);
            assert!((a / b).max(b / a) < 1.5, "{a} and {b}: {pair:?}");
        }
    }
}
