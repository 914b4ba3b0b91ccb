//! The environment as a light of its own: `environment_as_light`.

use crate::common::hostile::hostile;
use crate::common::lights::aligned;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{random_point, with_lobe};
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    Environment, Filter, LightSample, LightSampler, LightSamplerView, Mesh, PointSampler, Receiver, SampledLight,
    ShadingPoint, Splitting, Weight,
};
use glam::{DVec3, Mat3, Vec3};

/// Texels a side of the images.
const SIZE: usize = 16;
/// Rows and columns of the quadrature over the sphere.
const STEPS: usize = 800;
/// Names of the skies.
const SKIES: [&str; 6] = ["constant", "noise", "black hemisphere", "sun", "rotated sun", "one texel"];
/// Names of what stands beside the sky.
const SCENES: [&str; 3] = ["nothing", "lamp", "portal"];
/// Corners of the lamp or portal. Its front faces down.
const QUAD: [[f32; 3]; 4] = [[-0.7, -0.4, 1.0], [-0.7, 0.8, 1.0], [0.9, 0.8, 1.0], [0.9, -0.4, 1.0]];

fn environment(sky: &str) -> Environment {
    let mut pcg = Pcg32::new(5, 1);
    let image = |texel: &mut dyn FnMut(usize, usize) -> f32| {
        let texels: Vec<_> = (0..SIZE * SIZE).map(|i| texel(i % SIZE, i / SIZE)).collect();
        Environment::from_equal_area(SIZE, &texels, Filter::Nearest).expect("the texels are valid")
    };
    let is_sun = |x, y| (x, y) == (9, 4);
    let mut sun = || image(&mut |x, y| if is_sun(x, y) { 1e5 } else { 0.5 + pcg.f32() });
    match sky {
        "constant" => Environment::constant(1.5).expect("the radiance is valid"),
        "noise" => image(&mut |_, _| Pcg32::f32(&mut pcg).powi(4)),
        "black hemisphere" => image(&mut |x, _| if x < SIZE / 2 { 0.0 } else { 1.0 }),
        "sun" => sun(),
        "rotated sun" => {
            sun().with_rotation(Mat3::from_rotation_x(1.1) * Mat3::from_rotation_z(0.7)).expect("a rotation")
        }
        "one texel" => image(&mut |x, y| f32::from(u8::from(is_sun(x, y)))),
        other => panic!("no sky is called {other}"),
    }
}

fn build(sky: &str, scene: &str) -> LightSampler {
    let positions = QUAD.map(Vec3::from);
    let builder = LightSampler::builder().environment(environment(sky)).environment_as_light();
    let indices = [[0, 1, 2], [0, 2, 3]];
    let builder = match scene {
        "nothing" => Ok(builder),
        "lamp" => builder.mesh(&Mesh::emitter(&positions, &indices)),
        "portal" => builder.mesh(&Mesh::portal(&positions, &indices)),
        other => panic!("no scene is called {other}"),
    };
    builder.and_then(|builder| builder.build()).expect("the scene is valid")
}

/// Shading points of all kinds near the origin.
fn points(count: usize, sequence: u64) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(17, sequence);
    let receiver = |kind, normal| [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][kind];
    let point = |i: usize| ShadingPoint::new(0.3 * pcg.direction(), receiver(i % 3, pcg.direction()));
    (0..count).map(point).collect()
}

/// Shading points with lobes near the origin.
fn points_with_lobes(count: usize, sequence: u64) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(18, sequence);
    points(count, sequence).into_iter().map(|x| with_lobe(x, &mut pcg, 0.1)).collect()
}

/// All skies with all scenes.
fn cases() -> Vec<(&'static str, &'static str)> {
    SKIES.iter().flat_map(|sky| SCENES.map(|scene| (*sky, scene))).collect()
}

/// Visits even directions over the sphere, each with its bin of 8 x 16 and its share of the sphere.
fn over_sphere(mut visit: impl FnMut(Vec3, usize)) -> f64 {
    for i in 0..STEPS {
        let z = 1.0 - (2 * i + 1) as f64 / STEPS as f64;
        let r = (1.0 - z * z).sqrt();
        for j in 0..STEPS {
            // Rows are shifted against each other, so that edges along meridians are met everywhere.
            let turns = (j as f64 + 0.618_033_988_75 * i as f64).rem_euclid(STEPS as f64) / STEPS as f64;
            let (sin, cos) = (core::f64::consts::TAU * turns).sin_cos();
            visit(DVec3::new(r * cos, r * sin, z).as_vec3(), bin(z, turns));
        }
    }
    4.0 * core::f64::consts::PI / (STEPS * STEPS) as f64
}

fn bin(z: f64, turns: f64) -> usize {
    let row = ((1.0 - z) * 4.0) as usize;
    row.min(7) * 16 + ((turns * 16.0) as usize).min(15)
}

fn bin_of(direction: Vec3) -> usize {
    let d = direction.as_dvec3();
    let turns = d.y.atan2(d.x) / core::f64::consts::TAU;
    bin(d.z, turns - turns.floor())
}

#[test]
fn the_density_of_directions_integrates_to_the_rate_of_samples() {
    let cases = cases();
    parallel::map(cases.len(), |i| {
        let (sky, scene) = cases[i];
        let lights = build(sky, scene);
        // Each sky with each scene at one kind of receiver.
        let number = (i + i / 3) % 3;
        for x in [points(3, i as u64)[number], points_with_lobes(3, i as u64)[number]] {
            let at = lights.at(&x);
            let mut sum = 0.0;
            let step = over_sphere(|direction, _| sum += f64::from(at.pdf_direction(direction)));
            let mut pcg = Pcg32::new(3, i as u64);
            let count = 20_000;
            let drawn = (0..count).filter(|_| at.sample(pcg.cube()).is_some()).count() as f64 / f64::from(count);
            let error = (drawn * (1.0 - drawn) / f64::from(count)).sqrt();
            assert!(drawn == 0.0 || drawn > 0.85, "{sky}, {scene}: {drawn} at {x:?}");
            assert!((sum * step - drawn).abs() < 4.0 * error + 6e-3, "{sky}, {scene}: {} {drawn} at {x:?}", sum * step);
        }
    });
}

#[test]
fn directions_are_drawn_with_their_density() {
    let cases = cases();
    let significance = sidak(0.01, 2 * cases.len());
    parallel::map(cases.len(), |i| {
        let (sky, scene) = cases[i];
        let lights = build(sky, scene);
        let (number, sequence) = ((i + i / 3) % 3, 100 + i as u64);
        for x in [points(3, sequence)[number], points_with_lobes(3, sequence)[number]] {
            let at = lights.at(&x);
            let mut expected = [0.0; 128];
            over_sphere(|direction, bin| expected[bin] += f64::from(at.pdf_direction(direction)));
            let mut pcg = Pcg32::new(4, i as u64);
            let mut observed = [0.0; 128];
            let count = 10_000;
            for sample in (0..count).filter_map(|_| at.sample(pcg.cube())) {
                observed[bin_of(sample.direction)] += 1.0;
            }
            let total: f64 = observed.iter().sum();
            if total == 0.0 {
                continue;
            }
            let sum: f64 = expected.iter().sum();
            // The quadrature may miss a bin of which next to nothing is lit.
            expected.iter_mut().for_each(|expected| *expected = (*expected * total / sum).max(1e-3));
            let (p, table) = chi_square(&observed, &expected);
            assert!(p > significance, "{sky}, {scene}, {x:?}: {p}\n{table}");
        }
    });
}

/// Every number of a sample of the environment, and its density when it is looked up.
fn check(at: &PointSampler<'_>, x: &ShadingPoint, sample: &LightSample) {
    assert!(sample.direction.is_normalized() && sample.position.is_finite(), "{sample:?}");
    assert_eq!((sample.hit(), sample.distance, sample.normal), (None, f32::INFINITY, -sample.direction));
    assert_eq!(sample.pdf_area.to_bits(), sample.pdf.to_bits());
    assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && sample.pmf > 0.0 && sample.pmf <= 1.0, "{sample:?}");
    let towards = (sample.position - x.position).normalize();
    assert!(towards.dot(sample.direction) > 0.999_999, "{sample:?}");
    assert_eq!(at.pdf_environment(sample.direction).to_bits(), sample.pdf.to_bits(), "{sample:?} at {x:?}");
}

#[test]
fn samples_have_the_density_that_is_found_later() {
    let cases = cases();
    let counts = parallel::map(cases.len(), |i| {
        let (sky, scene) = cases[i];
        let lights = build(sky, scene);
        let mut pcg = Pcg32::new(6, i as u64);
        let mut count = 0;
        for x in points(30, 200 + i as u64).into_iter().chain(points_with_lobes(30, 300 + i as u64)) {
            let at = lights.at(&x);
            for _ in 0..300 {
                let Some(sample) = at.sample(core::array::from_fn(|_| hostile(&mut pcg))) else { continue };
                let along = at.pdf_sample_direction(&sample);
                assert!(along >= sample.pdf && along.is_finite(), "{along} {sample:?}");
                match sample.light {
                    SampledLight::Environment => {
                        check(&at, &x, &sample);
                        assert!((at.pdf_direction(sample.direction) / along - 1.0).abs() < 1e-6, "{sample:?}");
                        count += 1;
                    }
                    SampledLight::Triangle(hit) => {
                        assert!((at.pdf(&hit) / sample.pdf - 1.0).abs() < 1e-5, "{sample:?}");
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
        count
    });
    let count: usize = counts.iter().sum();
    assert!(count > 50_000, "only {count} samples of the environment");
}

/// Integral of the sky's radiance times the receiver's cosine.
fn irradiance(sky: &Environment, x: &ShadingPoint) -> f64 {
    let mut sum = 0.0;
    let step = over_sphere(|direction, _| sum += f64::from(sky.radiance(direction)) * f64::from(x.cosine(direction)));
    sum * step
}

/// Integral over the quad, of unit radiance towards its front.
fn irradiance_of_quad(x: &ShadingPoint) -> f64 {
    let [a, b, _, d] = QUAD.map(|v| Vec3::from(v).as_dvec3() - x.position.as_dvec3());
    let n = 400;
    let mut sum = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [u, v] = [i, j].map(|i| (f64::from(i) + 0.5) / f64::from(n));
        let point = a + (b - a) * u + (d - a) * v;
        let direction = point.normalize();
        let cosine = direction.z.max(0.0);
        sum += f64::from(x.cosine(direction.as_vec3())) * cosine / point.length_squared();
    }
    sum * (b - a).cross(d - a).length() / f64::from(n * n)
}

/// Compares an estimate with the integral, to within five standard errors and what the quadrature is off.
fn assert_estimate(estimate: &Mean, exact: f64, context: &str) {
    let off = (estimate.mean() - exact).abs();
    assert!(off <= 5.0 * estimate.error() + 5e-3 * exact + 1e-9, "{context}: {} not {exact}", estimate.mean());
}

/// What a host computes that sees the whole sky, whatever portals hang in it.
#[test]
fn the_irradiance_is_that_of_the_sky() {
    let cases: Vec<_> = SKIES.iter().flat_map(|sky| ["nothing", "portal"].map(|scene| (*sky, scene))).collect();
    parallel::map(cases.len(), |i| {
        let (sky, scene) = cases[i];
        let (lights, environment) = (build(sky, scene), environment(sky));
        for x in points(6, 300 + i as u64) {
            let at = lights.at(&x);
            let mut pcg = Pcg32::new(7, i as u64);
            let mut estimate = Mean::default();
            for _ in 0..4000 {
                estimate.add(at.sample(pcg.cube()).map_or(0.0, |sample| {
                    let value = environment.radiance(sample.direction) * x.cosine(sample.direction);
                    f64::from(value) / f64::from(at.pdf_sample_direction(&sample))
                }));
            }
            assert_estimate(&estimate, irradiance(&environment, &x), &format!("{sky}, {scene}, {x:?}"));
        }
    });
}

/// The lamp's share of the light at a point, and the share of samples that go to it.
fn lamp_beside(sky: &str, radiance: f32) {
    let positions = QUAD.map(Vec3::from);
    let lamp = Mesh::emitter(&positions, &[[0, 1, 2], [0, 2, 3]]).weight(Weight::Constant(radiance));
    let builder = LightSampler::builder().environment(environment(sky)).environment_as_light();
    let lights = builder.mesh(&lamp).and_then(|builder| builder.build()).expect("the lamp is valid");
    for x in [ShadingPoint::surface(Vec3::ZERO, Vec3::Z), ShadingPoint::volume(Vec3::ZERO)] {
        let at = lights.at(&x);
        let mut pcg = Pcg32::new(8, 8);
        let (mut lamp, mut rest, mut on_lamp) = (Mean::default(), Mean::default(), 0);
        let count = 20_000;
        for _ in 0..count {
            let sample = at.sample(pcg.cube());
            let value = sample.map_or(0.0, |s| f64::from(x.cosine(s.direction)) / f64::from(s.pdf));
            match sample.map(|sample| sample.light) {
                Some(SampledLight::Triangle(_)) => {
                    on_lamp += 1;
                    lamp.add(value * f64::from(radiance));
                    rest.add(0.0);
                }
                _ => {
                    lamp.add(0.0);
                    let light = sample.map_or(0.0, |s| lights.environment().radiance(s.direction));
                    rest.add(value * f64::from(light));
                }
            }
        }
        let context = format!("{sky}, {radiance}, {x:?}");
        assert_estimate(&lamp, f64::from(radiance) * irradiance_of_quad(&x), &context);
        assert_estimate(&rest, irradiance(&environment(sky), &x), &context);
        let share = f64::from(on_lamp) / f64::from(count);
        assert!((0.05..=0.95).contains(&share), "{context}: {share} of the samples");
    }
}

#[test]
fn a_dim_lamp_under_a_bright_sky_does_not_starve() {
    lamp_beside("noise", 1e-4);
    lamp_beside("sun", 1e-3);
}

/// Its share is that of a lamp, however little its estimate is.
#[test]
fn a_lamp_too_dim_for_floats_keeps_its_share() {
    let positions = QUAD.map(|v| Vec3::from(v) * Vec3::new(1e-3, 1e-3, 1e6));
    let lamp = Mesh::emitter(&positions, &[[0, 1, 2], [0, 2, 3]]).weight(Weight::Constant(1e-30));
    let builder = LightSampler::builder().environment(environment("noise")).environment_as_light();
    let lights = builder.mesh(&lamp).and_then(|builder| builder.build()).expect("the lamp is valid");
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let at = lights.at(&x);
    let mut pcg = Pcg32::new(16, 16);
    let on_lamp = (0..1000).filter_map(|_| at.sample(pcg.cube())?.hit()).count();
    assert!((50..=200).contains(&on_lamp), "{on_lamp}");
}

#[test]
fn a_dim_sky_behind_a_bright_lamp_does_not_starve() {
    lamp_beside("noise", 1e4);
    lamp_beside("constant", 1e4);
}

/// The next levels of the pyramid are weighed by the receiver where its horizon cuts a region.
#[test]
fn few_directions_are_below_the_horizon() {
    for sky in ["constant", "noise", "rotated sun"] {
        let lights = build(sky, "nothing");
        let (mut below, mut count) = (0, 0);
        for x in points(300, 400).iter().filter(|x| matches!(x.receiver, Receiver::Surface(_))) {
            let at = lights.at(x);
            let mut pcg = Pcg32::new(9, 9);
            for _ in 0..200 {
                count += 1;
                below += usize::from(at.sample(pcg.cube()).is_none_or(|s| x.cosine(s.direction) <= 0.0));
            }
        }
        assert!(below * 20 < count, "{sky}: {below} of {count}");
    }
}

/// A wall turned away from the sun is not drawn to it, though the rest of the sun's region is seen.
#[test]
fn a_sun_just_below_the_horizon_takes_few_samples() {
    let lights = build("sun", "nothing");
    let sky = environment("sun");
    let mut pcg = Pcg32::new(10, 10);
    let sun = (0..).map(|_| pcg.direction()).find(|d| sky.radiance(*d) > 1e4).expect("it is large");
    for degrees in [20.0_f32, 30.0, 40.0] {
        // The normal leans away from the sun.
        let side = sun.any_orthonormal_vector();
        let (sin, cos) = degrees.to_radians().sin_cos();
        let x = ShadingPoint::surface(Vec3::ZERO, side * cos - sun * sin);
        let at = lights.at(&x);
        let count = 1000;
        let to_sun = (0..count).filter_map(|_| at.sample(pcg.cube())).filter(|s| sky.radiance(s.direction) > 1e4);
        let share = to_sun.count() as f64 / f64::from(count);
        assert!(share < 0.2, "{degrees} degrees: {share}");
    }
}

#[test]
fn without_triangles_the_environment_is_the_only_light() {
    let lights = LightSampler::builder().environment_as_light().build().expect("a white environment");
    assert_eq!(lights.light_count(), 0);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let sample = lights.at(&x).sample([0.3, 0.4, 0.5]).expect("the sky is white");
    assert_eq!((sample.light, sample.pmf), (SampledLight::Environment, 1.0));
    assert!(sample.direction.z > 0.0);
    assert!(lights.emission().sample([0.5; 5]).is_none(), "nothing leaves a triangle");
}

#[test]
fn a_black_environment_is_no_light() {
    let positions = QUAD.map(Vec3::from);
    let build = |is_light: bool| {
        let builder = LightSampler::builder().environment(Environment::constant(0.0).expect("black is valid"));
        let builder = if is_light { builder.environment_as_light() } else { builder };
        builder.mesh(&Mesh::emitter(&positions, &[[0, 1, 2]])).and_then(|b| b.build()).expect("the lamp is valid")
    };
    let (with, without) = (build(true), build(false));
    assert_eq!(with.to_bytes(), without.to_bytes());
    let mut pcg = Pcg32::new(11, 11);
    for i in 0..1000 {
        let (x, u) = (random_point(&mut pcg, i), pcg.cube());
        assert_eq!(with.at(&x).sample(u), without.at(&x).sample(u));
        assert_eq!(with.at(&x).pdf_environment(Vec3::Z), 0.0);
    }
}

#[test]
fn nothing_arrives_from_below_or_at_no_position() {
    let lights = build("constant", "nothing");
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    assert_eq!(lights.at(&x).pdf_environment(Vec3::NEG_Z), 0.0);
    assert!(lights.at(&x).pdf_environment(Vec3::new(0.0, 1.0, 1e-3)) > 0.0);
    // The length of a direction does not count.
    let pdf = lights.at(&x).pdf_environment(Vec3::Z);
    assert!(pdf > 0.0 && [1e-30, 1e30].map(|s| lights.at(&x).pdf_environment(s * Vec3::Z)) == [pdf; 2]);
    for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(lights.at(&x).pdf_environment(direction), 0.0, "{direction}");
    }
    for position in [Vec3::new(f32::NAN, 0.0, 0.0), Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e16)] {
        let nowhere = ShadingPoint::volume(position);
        assert_eq!(lights.at(&nowhere).sample([0.5; 3]), None, "{position}");
    }
    for normal in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        let at = &lights.at(&ShadingPoint::surface(Vec3::ZERO, normal));
        let sample = at.sample([0.5; 3]);
        assert!(sample.is_none_or(|sample| sample.pdf.is_finite() && sample.direction.is_normalized()));
    }
}

#[test]
fn many_samples_are_those_of_single_calls() {
    let lights = build("rotated sun", "lamp");
    let mut pcg = Pcg32::new(12, 12);
    let queries: Vec<_> = points(100, 500).into_iter().map(|x| (x, pcg.cube())).collect();
    let mut samples = vec![None; queries.len()];
    lights.sample_many(&queries, &mut samples);
    for ((x, u), sample) in queries.iter().zip(&samples) {
        assert_eq!(lights.at(x).sample(*u), *sample);
    }
}

#[test]
fn a_split_tree_has_one_direction_of_the_environment_beside_it() {
    let lights = build("noise", "lamp");
    let splitting = Splitting::new(0.5, 2);
    let mut pcg = Pcg32::new(13, 13);
    for x in points(300, 600) {
        let at = lights.at(&x);
        let mut samples = Vec::new();
        at.sample_split(pcg.cube(), &splitting, &mut samples);
        let of_sky: Vec<_> = samples.iter().filter(|s| s.light == SampledLight::Environment).collect();
        assert!(of_sky.len() <= 1);
        for sample in of_sky {
            assert_eq!(sample.pmf, 1.0);
            assert_eq!(at.pdf_split_environment(sample.direction, &splitting), sample.pdf);
            let along = at.pdf_split_direction(sample.direction, &splitting);
            assert!(along >= sample.pdf && (along == sample.pdf || sample.direction.z > 0.0), "{along} {sample:?}");
        }
    }
}

#[test]
fn a_rotation_moves_the_light() {
    let mut lights = build("sun", "nothing");
    let x = ShadingPoint::volume(Vec3::ZERO);
    let rotation = Mat3::from_rotation_y(0.8);
    let before = lights.at(&x).sample([0.1, 0.2, 0.3]).expect("there is light everywhere");
    lights.set_environment_rotation(rotation).expect("a rotation");
    let after = lights.at(&x).sample([0.1, 0.2, 0.3]).expect("there is light everywhere");
    assert!(after.direction.distance(rotation * before.direction) < 1e-5);
    assert_eq!(before.pdf, after.pdf);
}

#[test]
fn bytes_hold_the_light() {
    let lights = build("rotated sun", "lamp");
    let words = aligned(&lights.to_bytes());
    let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    let mut pcg = Pcg32::new(14, 14);
    for x in points(100, 700) {
        let u = pcg.cube();
        assert_eq!(lights.at(&x).sample(u), view.at(&x).sample(u));
    }
    let plain = LightSampler::builder().environment(environment("rotated sun")).build().expect("nothing to refuse");
    let alone = build("rotated sun", "nothing");
    assert!(alone.bytes().environment > plain.bytes().environment);
}

/// Changed bytes are refused, or safe to sample.
#[test]
fn changed_bytes_do_no_harm() {
    let lights = build("noise", "nothing");
    let words = aligned(&lights.to_bytes());
    let mut pcg = Pcg32::new(15, 15);
    // The regions come last: 448 numbers.
    let mut refused = 0;
    for at in words.len() - 448..words.len() {
        for value in [f32::NAN.to_bits(), f32::INFINITY.to_bits(), (-2.0_f32).to_bits(), 0, 1.0_f32.to_bits()] {
            let mut changed = words.clone();
            changed[at] = value;
            let Ok(view) = LightSamplerView::from_bytes(bytemuck::cast_slice(&changed)) else {
                refused += 1;
                continue;
            };
            for x in points(3, at as u64) {
                let sample = view.at(&x).sample(pcg.cube());
                assert!(sample.is_none_or(|s| s.pdf.is_finite() && s.pdf > 0.0 && s.direction.is_normalized()));
                let pdf = view.at(&x).pdf_direction(pcg.direction());
                assert!(pdf.is_finite() && pdf >= 0.0);
            }
        }
    }
    assert!(refused > 3 * 440, "{refused}");
    let cut = &words[..words.len() - 1];
    assert!(LightSamplerView::from_bytes(bytemuck::cast_slice(cut)).is_err());
}
