//! Estimates are unbiased: they agree with an integral in double precision that knows nothing of the crate.
//!
//! Each point is within four standard errors. With 220 points, the full tier, chance alone breaks that in one run of
//! seventy; as the seeds are fixed, it either does or does not. A point that is off is done again with ten times the
//! samples, which tells bias from chance.

use crate::common::lights::{ARITIES, build, sample_split};
use crate::common::pcg::Pcg32;
use crate::common::scene::{Image, LightMesh, Paint, Scene, Sky, random_point, with_lobe, with_microfacets};
use crate::common::statistics::Mean;
use crate::common::tier::tier;
use crate::common::{oracle, parallel};
use fanlight::{Filter, LightSample, LightSampler, Receiver, ShadingPoint, Splitting, Wrap};
use glam::{DVec3, Vec3};

/// Standard errors that an estimate may be off.
const LIMIT: f64 = 4.0;
const SAMPLES: usize = 40_000;
/// Relative error of the integral, of which four per mille would already show.
const ORACLE_ERROR: f64 = 5e-4;

/// What is divided by what.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Estimator {
    /// What the sampled point sends, by the density of the point.
    Point,
    /// All that arrives along the direction, by the density of the direction.
    Direction,
    /// All that arrives along the direction, by the density of the point: wrong where portals overlap.
    DirectionByPoint,
    /// The sum over the points of a split.
    Split(Splitting),
}

/// Direction and contribution times the cosine of a sample's point, in double precision.
fn contribution(scene: &Scene, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let (m, t) = (
        sample.hit().expect("a triangle").triangle.mesh.index() as usize,
        sample.hit().expect("a triangle").triangle.triangle as usize,
    );
    let b = sample.hit().expect("a triangle").barycentrics.map(f64::from);
    let [v0, v1, v2] = scene.meshes[m].vertices(t).map(|v| v.as_dvec3() - x.position.as_dvec3());
    let direction = (v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1]).normalize();
    oracle::sent(scene, m, t, b, direction) * oracle::cosine(&x.receiver, direction)
}

fn arriving(scene: &Scene, x: &ShadingPoint, direction: Vec3) -> f64 {
    let direction = direction.as_dvec3().normalize();
    oracle::through_portals(scene, x, direction) * oracle::cosine(&x.receiver, direction)
}

fn estimate(scene: &Scene, lights: &LightSampler, x: &ShadingPoint, estimator: Estimator, n: usize, seed: u64) -> Mean {
    let mut pcg = Pcg32::new(seed, 21);
    let mut mean = Mean::default();
    for _ in 0..n {
        let u = pcg.cube();
        if let Estimator::Split(splitting) = estimator {
            let samples = sample_split(&lights.at(x), u, &splitting);
            mean.add(samples.iter().map(|s| contribution(scene, x, s) / f64::from(s.pdf)).sum());
            continue;
        }
        mean.add(lights.at(x).sample(u).map_or(0.0, |s| match estimator {
            Estimator::Direction => arriving(scene, x, s.direction) / f64::from(lights.at(x).pdf_sample_direction(&s)),
            Estimator::DirectionByPoint => arriving(scene, x, s.direction) / f64::from(s.pdf),
            _ => contribution(scene, x, &s) / f64::from(s.pdf),
        }));
    }
    mean
}

/// One family of scenes: the scene and shading point of a number, and the integral with a number of points.
struct Case {
    name: &'static str,
    scene: fn(&mut Pcg32, usize) -> (Scene, ShadingPoint),
    integral: fn(&Scene, &ShadingPoint, usize) -> f64,
    estimator: Estimator,
}

struct Found {
    name: String,
    exact: f64,
    /// Last change of the integral.
    change: f64,
    mean: f64,
    error: f64,
    repeated: bool,
}

impl Found {
    fn deviation(&self) -> f64 {
        let distance = ((self.mean - self.exact).abs() - self.change).max(0.0);
        if distance == 0.0 { 0.0 } else { distance / self.error }
    }
}

fn examine(case: &Case, number: usize) -> Found {
    let mut pcg = Pcg32::new(2000 + number as u64, 22);
    let (scene, x) = (case.scene)(&mut pcg, number);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let (exact, change) = oracle::converged(ORACLE_ERROR, |count| (case.integral)(&scene, &x, count));
    let mut found =
        Found { name: format!("{} {x:?}", case.name), exact, change, mean: 0.0, error: 0.0, repeated: false };
    let mut run = |n: usize, seed: u64| {
        let mean = estimate(&scene, &lights, &x, case.estimator, n, seed);
        (found.mean, found.error) = (mean.mean(), mean.error());
        found.deviation() <= LIMIT
    };
    // What is known to be wrong needs no second look.
    if !run(SAMPLES, number as u64) && case.estimator != Estimator::DirectionByPoint {
        run(10 * SAMPLES, 1000 + number as u64);
        found.repeated = true;
    }
    found
}

/// Runs a family, and says how it went.
fn check(case: &Case) -> Vec<Found> {
    let found = parallel::map(tier().points, |number| examine(case, number));
    let lit: Vec<_> = found.iter().filter(|f| f.exact > 0.0).collect();
    let worst = lit.iter().map(|f| f.deviation()).fold(0.0, f64::max);
    let mut errors: Vec<_> = lit.iter().map(|f| f.error / f.exact).collect();
    errors.sort_by(f64::total_cmp);
    let change = lit.iter().map(|f| f.change / f.exact).fold(0.0, f64::max);
    let repeated = found.iter().filter(|f| f.repeated).count();
    println!(
        "{}: {} of {} points lit, worst {worst:.2} standard errors, standard error {:.2} % (median) {:.2} % \
         (p90), integrals settled to {:.3} %, {repeated} repeated",
        case.name,
        lit.len(),
        found.len(),
        100.0 * errors[errors.len() / 2],
        100.0 * errors[errors.len() * 9 / 10],
        100.0 * change
    );
    assert!(found.iter().all(|f| f.exact > 0.0 || f.mean == 0.0), "{}: light where there is none", case.name);
    assert!(lit.len() * 2 > found.len(), "{}: {} lit points", case.name, lit.len());
    assert!(change <= 1e-3, "{}: the integral is off by {change}", case.name);
    assert!(errors[errors.len() * 3 / 4] < 0.02, "{}: {errors:?}", case.name);
    found
}

fn assert_unbiased(case: &Case) {
    let describe = |f: &Found| format!("{}: {} ± {}, but the integral is {}", f.name, f.mean, f.error, f.exact);
    let failed: Vec<_> = check(case).iter().filter(|f| f.deviation() > LIMIT).map(describe).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

fn over_lights(scene: &Scene, x: &ShadingPoint, count: usize) -> f64 {
    oracle::over_lights(scene, x, None, count, &|m, t, b, direction| oracle::sent(scene, m, t, b, direction))
}

fn over_pixels(scene: &Scene, x: &ShadingPoint, count: usize) -> f64 {
    oracle::over_pixels(scene, x, count, &|direction| oracle::sum_of_portals(scene, x, direction))
}

/// Through the first mesh, which is the outermost opening and hides the others' outside.
fn through_outermost(scene: &Scene, x: &ShadingPoint, count: usize) -> f64 {
    oracle::over_lights(scene, x, Some(0), count, &|_, _, _, direction| oracle::through_portals(scene, x, direction))
}

fn image(pcg: &mut Pcg32, number: usize, kind: usize) -> Image {
    let mut image = Image::random(pcg, kind);
    image.filter = if number.is_multiple_of(2) { Filter::Nearest } else { Filter::Bilinear };
    image
}

/// An opening of one by one in the plane z = 0, whose front faces down, under a sky.
fn window(sky: usize, pcg: &mut Pcg32) -> Scene {
    let opening = LightMesh::quad(Vec3::new(-0.5, -0.5, 0.0), Vec3::Y, Vec3::X).portal();
    let mut scene = Scene::new("window", vec![opening]);
    scene.sky = Sky::random(pcg, sky);
    scene.rotation = pcg.rotation();
    scene
}

/// A point under the opening, looking up to somewhere.
fn below_window(pcg: &mut Pcg32, number: usize) -> ShadingPoint {
    let position = Vec3::new(pcg.within(-1.0, 1.0), pcg.within(-1.0, 1.0), pcg.within(-1.5, -0.3));
    let normal = (pcg.direction() + 1.2 * (-position).normalize()).normalize();
    let receiver = [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][number % 3];
    ShadingPoint::new(position, receiver)
}

/// Turns the sky so that its one lit pixel is seen through a place in the opening.
fn aim_lit_pixel(scene: &mut Scene, x: &ShadingPoint, pcg: &mut Pcg32) {
    let Sky::LatLong { size: [w, h], texels } = &scene.sky else { return };
    let lit = texels.iter().position(|texel| *texel > 0.0).unwrap_or(0);
    let phi = core::f32::consts::TAU * ((lit % w) as f32 + 0.5) / *w as f32;
    let theta = core::f32::consts::PI * ((lit / w) as f32 + 0.5) / *h as f32;
    let pixel = Vec3::new(phi.cos() * theta.sin(), -phi.sin() * theta.sin(), theta.cos());
    let place = Vec3::new(pcg.within(-0.5, 0.5), pcg.within(-0.5, 0.5), 0.0);
    let turn = glam::Quat::from_rotation_arc(pixel, (place - x.position).normalize());
    scene.rotation = glam::Mat3::from_quat(turn);
}

#[test]
fn mesh_lights() {
    let scene = |pcg: &mut Pcg32, number| {
        let mesh = LightMesh::soup(pcg, 12, 0.4).paint(Paint::Constant(2.0));
        (Scene::new("soup", vec![mesh]), random_point(pcg, number))
    };
    assert_unbiased(&Case { name: "mesh lights", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn textured_mesh_lights() {
    let scene = |pcg: &mut Pcg32, number| {
        let meshes = (0..4).map(|i| LightMesh::soup(pcg, 2, 0.7).paint(Paint::Image(i)).two_sided()).collect();
        let mut scene = Scene::new("textured soup", meshes);
        scene.images = (0..4).map(|kind| image(pcg, number + kind, kind)).collect();
        (scene, random_point(pcg, number))
    };
    let name = "textured mesh lights";
    assert_unbiased(&Case { name, scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn plain_portals() {
    let scene = |pcg: &mut Pcg32, number| (window(1, pcg), below_window(pcg, number));
    assert_unbiased(&Case { name: "plain portals", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn textured_portals() {
    let scene = |pcg: &mut Pcg32, number| {
        let mut scene = window(1, pcg);
        scene.images.push(image(pcg, number / 4, number));
        scene.meshes[0].paint = Paint::Image(0);
        (scene, below_window(pcg, number))
    };
    assert_unbiased(&Case { name: "textured portals", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn black_hemispheres() {
    let scene = |pcg: &mut Pcg32, number| {
        let mut scene = window(3, pcg);
        // From wholly lit to a horizon that crosses the opening.
        scene.rotation = glam::Mat3::from_rotation_x(pcg.within(-1.8, 1.8));
        (scene, below_window(pcg, number))
    };
    assert_unbiased(&Case { name: "black hemispheres", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn skies_with_one_lit_pixel() {
    let scene = |pcg: &mut Pcg32, number| {
        let mut scene = window(2, pcg);
        let x = below_window(pcg, number);
        aim_lit_pixel(&mut scene, &x, pcg);
        if number.is_multiple_of(4) {
            scene.images.push(image(pcg, 1, 0));
            scene.meshes[0].paint = Paint::Image(0);
        }
        (scene, x)
    };
    let name = "skies with one lit pixel";
    assert_unbiased(&Case { name, scene, integral: over_pixels, estimator: Estimator::Point });
}

/// Openings, textured lights and plain ones together, seen by one kind of receiver.
fn mixture(pcg: &mut Pcg32, receiver: usize) -> (Scene, ShadingPoint) {
    let mut scene = Scene::new("mixture", Vec::new());
    scene.sky = Sky::random(pcg, 1);
    scene.rotation = pcg.rotation();
    scene.images.push(image(pcg, 0, 0));
    scene.meshes.push(LightMesh::soup(pcg, 5, 0.3).two_sided());
    scene.meshes.push(LightMesh::soup(pcg, 5, 0.3).portal().two_sided());
    scene.meshes.push(LightMesh::soup(pcg, 2, 0.5).paint(Paint::Image(0)).two_sided());
    (scene, random_point(pcg, receiver))
}

#[test]
fn two_sided_lights_on_surfaces() {
    let scene = |pcg: &mut Pcg32, _| mixture(pcg, 0);
    assert_unbiased(&Case { name: "two-sided lights", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn transmissive_surfaces() {
    let scene = |pcg: &mut Pcg32, _| mixture(pcg, 1);
    let name = "transmissive surfaces";
    assert_unbiased(&Case { name, scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn volumes() {
    let scene = |pcg: &mut Pcg32, _| mixture(pcg, 2);
    assert_unbiased(&Case { name: "volumes", scene, integral: over_lights, estimator: Estimator::Point });
}

/// Their estimates are those of hosts whose BSDF is the lobe.
#[test]
fn glossy_surfaces() {
    let scene = |pcg: &mut Pcg32, _| {
        let (scene, x) = mixture(pcg, 0);
        (scene, with_lobe(x, pcg, 0.05))
    };
    assert_unbiased(&Case { name: "glossy surfaces", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn phase_functions() {
    let scene = |pcg: &mut Pcg32, _| {
        let (scene, x) = mixture(pcg, 2);
        (scene, with_lobe(x, pcg, 0.05))
    };
    assert_unbiased(&Case { name: "phase functions", scene, integral: over_lights, estimator: Estimator::Point });
}

#[test]
fn anisotropic_surfaces() {
    let scene = |pcg: &mut Pcg32, _| {
        let (scene, x) = mixture(pcg, 0);
        (scene, with_microfacets(x, pcg, 0.1))
    };
    assert_unbiased(&Case { name: "anisotropic surfaces", scene, integral: over_lights, estimator: Estimator::Point });
}

/// Reflection, transmission, and a diffuse base.
#[test]
fn rough_glass() {
    let scene = |pcg: &mut Pcg32, _| {
        let (scene, x) = mixture(pcg, 1);
        (scene, with_microfacets(x, pcg, 0.1))
    };
    assert_unbiased(&Case { name: "rough glass", scene, integral: over_lights, estimator: Estimator::Point });
}

/// The host's lobe need not be the one that guides.
#[test]
fn openings_seen_with_lobes() {
    let scene = |pcg: &mut Pcg32, number| {
        let scene = window(1, pcg);
        let x = below_window(pcg, number);
        (scene, with_lobe(x, pcg, 0.1))
    };
    assert_unbiased(&Case { name: "openings, lobes", scene, integral: over_lights, estimator: Estimator::Direction });
}

#[test]
fn adaptive_splitting() {
    let scene = |pcg: &mut Pcg32, number| {
        let mut scene =
            Scene::new("cloud", vec![LightMesh::soup(pcg, 150, 0.1), LightMesh::soup(pcg, 50, 0.1).portal()]);
        scene.sky = Sky::random(pcg, 1);
        (scene, random_point(pcg, number))
    };
    let estimator = Estimator::Split(Splitting::new(0.9, 2));
    assert_unbiased(&Case { name: "adaptive splitting", scene, integral: over_lights, estimator });
}

/// A large opening, and one a tenth its size in front of it with a texture, one meter apart.
fn nested(pcg: &mut Pcg32, number: usize) -> (Scene, ShadingPoint) {
    let outer = LightMesh::quad(Vec3::new(-2.5, -2.5, 1.0), 5.0 * Vec3::Y, 5.0 * Vec3::X).portal();
    let inner = LightMesh::quad(Vec3::new(-0.25, -0.25, 0.0), 0.5 * Vec3::Y, 0.5 * Vec3::X).portal();
    let mut scene = Scene::new("nested", vec![outer.paint(Paint::Constant(0.6)), inner.paint(Paint::Image(0))]);
    scene.images.push(Image {
        size: [4, 4],
        texels: (0..16).map(|_| pcg.within(0.3, 3.0)).collect(),
        filter: Filter::Bilinear,
        wrap: [Wrap::Clamp; 2],
    });
    scene.sky = Sky::random(pcg, 1);
    scene.rotation = pcg.rotation();
    // So near to the axis that the inner opening is seen before the outer one.
    let position = Vec3::new(pcg.within(-0.3, 0.3), pcg.within(-0.3, 0.3), pcg.within(-0.8, -0.3));
    let receiver = [Receiver::Surface(Vec3::Z), Receiver::Transmissive(pcg.direction()), Receiver::Volume][number % 3];
    (scene, ShadingPoint::new(position, receiver))
}

#[test]
fn nested_portals() {
    let estimator = Estimator::Direction;
    assert_unbiased(&Case { name: "nested portals", scene: nested, integral: through_outermost, estimator });
}

/// For the density of the point alone the check fails: what it checks is the density of a direction.
#[test]
fn nested_portals_need_the_density_of_the_direction() {
    let estimator = Estimator::DirectionByPoint;
    let case = Case { name: "nested portals by the point", scene: nested, integral: through_outermost, estimator };
    let biased = check(&case).iter().filter(|f| f.deviation() > LIMIT).count();
    assert!(biased > tier().points / 2, "only {biased} points show that the estimate is wrong");
}

/// The oracle against closed forms: the solid angle of a cube's face, and the irradiance under an infinite ceiling.
#[test]
fn the_integral_matches_closed_forms() {
    let face = LightMesh::quad(Vec3::new(-0.5, -0.5, 0.5), Vec3::Y, Vec3::X);
    let scene = Scene::new("face", vec![face]);
    let (solid_angle, _) = oracle::converged(1e-5, |n| over_lights(&scene, &ShadingPoint::volume(Vec3::ZERO), n));
    assert!((solid_angle / (2.0 * core::f64::consts::PI / 3.0) - 1.0).abs() < 1e-4, "{solid_angle}");
    let mut scene = window(1, &mut Pcg32::new(1, 23));
    let x = ShadingPoint::surface(Vec3::new(0.2, 0.1, -0.6), Vec3::Z);
    let area = over_lights(&scene, &x, 1 << 20);
    let pixels = over_pixels(&scene, &x, 1 << 22);
    assert!((area / pixels - 1.0).abs() < 2e-3, "by area {area}, by direction {pixels}");
    scene.sky = Sky::Constant(2.0);
    let direction = DVec3::new(-0.2, -0.1, 0.6).normalize();
    assert_eq!(oracle::through_portals(&scene, &x, direction), 2.0);
    assert_eq!(oracle::through_portals(&scene, &x, -direction), 0.0);
}
