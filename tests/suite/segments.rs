//! Stretches of rays in media: densities of distances, radiance scattered in against integrals in double precision, and
//! how much there is to gain.

use crate::common::pcg::Pcg32;
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    DistantLight, Environment, Filter, LightSampler, LightSamplerBuilder, Mesh, PointLight, RaySegment, SampledLight,
    Scattering, SegmentSampler, SphereLight, Weight,
};
use glam::Vec3;

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;

/// Points and spheres in a cube, a few or many.
fn lamps(count: usize, pcg: &mut Pcg32) -> (LightSampler, Vec<Vec3>) {
    let places: Vec<Vec3> = (0..count).map(|_| 4.0 * Vec3::from_array(pcg.cube())).collect();
    let mut builder = LightSampler::builder();
    for place in &places {
        builder.add_light(PointLight::new(*place, 1.0)).expect("a valid light");
    }
    (builder.build().expect("few lights"), places)
}

/// A window to a sky with a hazy sun.
fn hazy_room() -> LightSampler {
    let sun = Vec3::new(0.3, 0.1, 0.95).normalize();
    let haze = |i: usize| {
        let direction = equal_area(i % 64, i / 64);
        0.3 + 30.0 * (-(direction.angle_between(sun) / 0.17).powi(2)).exp()
    };
    let sky: Vec<f32> = (0..64 * 64).map(haze).collect();
    let environment = Environment::from_equal_area(64, &sky, Filter::Nearest).expect("valid");
    window(environment).build().expect("few lights")
}

/// Direction of a texel of an image of 64 texels a side, by Clarberg's map.
fn equal_area(x: usize, y: usize) -> Vec3 {
    let [u, v] = [x, y].map(|i| (2.0 * (i as f32 + 0.5) / 64.0) - 1.0);
    let (a, b) = (u.abs(), v.abs());
    let signed = 1.0 - a - b;
    let r = 1.0 - signed.abs();
    let phi = if r == 0.0 { 0.0 } else { ((b - a) / r + 1.0) * core::f32::consts::FRAC_PI_4 };
    let z = (1.0 - r * r).copysign(signed);
    let across = r * (2.0 - r * r).sqrt();
    Vec3::new((across * phi.cos()).copysign(u), (across * phi.sin()).copysign(v), z)
}

/// A window of a meter in the ceiling.
fn window<'a>(environment: Environment) -> LightSamplerBuilder<'a> {
    let window = [[1.0, 1.0, 3.0], [2.0, 1.0, 3.0], [2.0, 2.0, 3.0], [1.0, 2.0, 3.0]].map(Vec3::from);
    let mut builder = LightSampler::builder().environment(environment);
    builder.add_mesh(&Mesh::portal(&window, &[[0, 2, 1], [0, 3, 2]])).expect("a valid mesh");
    builder
}

/// A window to a sky with a sun, and a lamp.
fn room(pcg: &mut Pcg32, with_lamp: bool) -> LightSampler {
    let mut sky: Vec<f32> = (0..64 * 64).map(|_| 0.3 + 0.1 * pcg.f32()).collect();
    // Above, and a little aside.
    sky[34 * 64 + 36] = 3e4;
    let environment = Environment::from_equal_area(64, &sky, Filter::Nearest).expect("valid");
    let mut builder = window(environment);
    if with_lamp {
        builder.add_light(SphereLight::new(Vec3::new(3.0, 1.0, 1.0), 0.05, 5.0)).expect("a valid light");
    }
    builder.build().expect("few lights")
}

/// A scene that mixes all.
fn mixed(pcg: &mut Pcg32) -> LightSampler {
    let environment = Environment::constant(0.2).expect("valid");
    let mut builder = LightSampler::builder().environment(environment).environment_as_light();
    for i in 0..30_u32 {
        let at = 4.0 * Vec3::from_array(pcg.cube());
        let positions = [at, at + 0.2 * pcg.direction(), at + 0.2 * pcg.direction()];
        builder.add_mesh(&Mesh::emitter(&positions, &[[0, 1, 2]]).weight(Weight::Constant(3.0))).expect("valid");
        let lamp = SphereLight::new(4.0 * Vec3::from_array(pcg.cube()), 0.03, 9.0);
        builder.add_light_to(1 << (i % 2), lamp).expect("valid");
    }
    builder.add_light(DistantLight::new(pcg.direction(), 0.3)).expect("valid");
    builder.build().expect("few lights")
}

fn segment(pcg: &mut Pcg32) -> RaySegment {
    let extinction = [0.0, 0.2, 3.0][pcg.below(3)];
    RaySegment::new(4.0 * Vec3::from_array(pcg.cube()), pcg.direction(), 0.5 + 5.0 * pcg.f32(), extinction)
}

fn each_scene(mut visit: impl FnMut(&LightSampler, &mut Pcg32)) {
    let mut pcg = Pcg32::new(1, 191);
    visit(&LightSampler::builder().build().expect("nothing"), &mut pcg);
    for count in [1, 3, 400] {
        visit(&lamps(count, &mut pcg).0, &mut pcg);
    }
    visit(&hazy_room(), &mut pcg);
    visit(&room(&mut pcg, false), &mut pcg);
    visit(&room(&mut pcg, true), &mut pcg);
    visit(&mixed(&mut pcg), &mut pcg);
}

/// Densities of distances integrate to 1, are found again, and are zero outside.
#[test]
fn densities_of_distances_integrate_to_one() {
    each_scene(|lights, pcg| {
        for _ in 0..4 {
            let segment = segment(pcg);
            let along = lights.along(&segment);
            let steps = 40_000;
            let width = f64::from(segment.length) / f64::from(steps);
            let pdf = |i: i32| f64::from(along.pdf_distance(((f64::from(i) + 0.5) * width) as f32));
            let sum: f64 = (0..steps).map(pdf).sum::<f64>() * width;
            assert!((sum - 1.0).abs() < 5e-3, "{segment:?}: {sum}");
            for _ in 0..200 {
                let (distance, pdf) = along.sample_distance(pcg.f32()).expect("a segment");
                assert!((0.0..=segment.length).contains(&distance) && pdf > 0.0 && pdf.is_finite());
                assert!((along.pdf_distance(distance) / pdf - 1.0).abs() < 1e-5);
                let Some(sample) = along.sample([pcg.f32(), pcg.f32(), pcg.f32(), pcg.f32()]) else { continue };
                if sample.light.has_extent() {
                    let joint = along.pdf(sample.distance, sample.light.direction);
                    let least = sample.pdf_distance * sample.light.pdf;
                    // Rounding may take a ray past a small light.
                    assert!(joint >= 0.0 && joint.is_finite() && least > 0.0);
                    assert!(along.at(sample.distance).pdf_sample_direction(&sample.light) > 0.0);
                }
            }
            assert_eq!((along.pdf_distance(-0.1), along.pdf_distance(segment.length * 1.01)), (0.0, 0.0));
        }
    });
}

/// Distances fall as their density says.
#[test]
fn distances_fall_as_the_density_says() {
    let mut found = vec![];
    each_scene(|lights, pcg| {
        for _ in 0..3 {
            let segment = segment(pcg);
            let along = lights.along(&segment);
            let (cells, each, n) = (50, 400, 20_000);
            let mut observed = vec![0.0; cells];
            for _ in 0..n {
                let (distance, _) = along.sample_distance(pcg.f32()).expect("a segment");
                let cell = (distance / segment.length * cells as f32) as usize;
                observed[cell.min(cells - 1)] += 1.0;
            }
            let width = f64::from(segment.length) / (cells * each) as f64;
            let pdf = |i: usize| f64::from(along.pdf_distance(((i as f64 + 0.5) * width) as f32));
            let expected: Vec<f64> = (0..cells)
                .map(|cell| f64::from(n) * width * (cell * each..(cell + 1) * each).map(pdf).sum::<f64>())
                .collect();
            found.push(chi_square(&observed, &expected));
        }
    });
    for (p, dump) in &found {
        assert!(*p > sidak(SIGNIFICANCE, found.len()), "p = {p:e}\n{dump}");
    }
}

/// What a sample of both brings: light scattered in, without anything in between and without loss on the way to the
/// segment.
fn brought(along: &SegmentSampler<'_>, segment: &RaySegment, u: [f32; 4]) -> f64 {
    along.sample(u).map_or(0.0, |sample| {
        let transmittance = f64::from(-segment.extinction * sample.distance).exp();
        let light = match sample.light.light {
            SampledLight::Punctual(_) if sample.light.distance.is_finite() => f64::from(sample.light.distance).powi(-2),
            _ => 1.0,
        };
        transmittance * light / (f64::from(sample.pdf_distance) * f64::from(sample.light.pdf))
    })
}

/// Points of light: the estimate is the integral, and its variance is far below that of even distances.
#[test]
fn points_bring_the_integral_over_the_segment() {
    let mut pcg = Pcg32::new(2, 192);
    let mut gains = Mean::default();
    for count in [1, 2, 10, 100] {
        for _ in 0..6 {
            let (lights, places) = lamps(count, &mut pcg);
            let segment = segment(&mut pcg);
            let along = lights.along(&segment);
            let at = |t: f64| {
                let x = segment.origin.as_dvec3() + t * segment.direction.as_dvec3();
                let fluence: f64 = places.iter().map(|place| 1.0 / (place.as_dvec3() - x).length_squared()).sum();
                fluence * (-f64::from(segment.extinction) * t).exp()
            };
            let steps = 20_000;
            let width = f64::from(segment.length) / f64::from(steps);
            let exact: f64 = (0..steps).map(|i| at((f64::from(i) + 0.5) * width)).sum::<f64>() * width;
            let (mut joint, mut even) = (Mean::default(), Mean::default());
            for _ in 0..6000 {
                joint.add(brought(&along, &segment, [pcg.f32(), pcg.f32(), pcg.f32(), pcg.f32()]));
                let t = segment.length * pcg.f32();
                let sample = along.at(t).sample(pcg.cube());
                even.add(sample.map_or(0.0, |sample| {
                    let transmittance = f64::from(-segment.extinction * t).exp();
                    let fluence = transmittance / (f64::from(sample.distance).powi(2) * f64::from(sample.pdf));
                    f64::from(segment.length) * fluence
                }));
            }
            let (found, error) = (joint.mean(), joint.error());
            assert!((found - exact).abs() < 5.0 * error + 2e-3 * exact, "{count}: {found} ± {error}, not {exact}");
            gains.add((even.error() / error).powi(2).ln());
        }
    }
    let gain = gains.mean().exp();
    assert!(gain > 3.0, "variance is lower by a factor of {gain} alone");
}

/// A beam of sunlight through a window: the same mean as by even distances, and far less noise.
#[test]
fn beams_are_found() {
    let mut pcg = Pcg32::new(3, 193);
    for (lights, least) in [(room(&mut pcg, false), 2.0), (hazy_room(), 1.3)] {
        let gain = gain_in_beam(&lights, &mut pcg);
        assert!(gain > least, "variance is lower by a factor of {gain} alone");
    }
}

/// How much lower the variance is than that of even distances, on rays through a beam.
fn gain_in_beam(lights: &LightSampler, pcg: &mut Pcg32) -> f64 {
    let mut gains = Mean::default();
    for _ in 0..8 {
        // Across the room, through the beam.
        let origin = Vec3::new(-2.0, 1.0 + pcg.f32(), 1.0 + pcg.f32());
        let target = Vec3::new(1.5 - 0.3 * (3.0 - origin.z), origin.y, origin.z);
        let segment = RaySegment::new(origin, target - origin, 6.0, 0.1);
        let along = lights.along(&segment);
        let radiance = |direction: Vec3| f64::from(lights.environment().radiance(direction));
        let (mut joint, mut even) = (Mean::default(), Mean::default());
        for _ in 0..8000 {
            let u: [f32; 4] = core::array::from_fn(|_| pcg.f32());
            let of = |distance: f32, pdf_distance: f64, u: [f32; 3]| {
                let at = along.at(distance);
                at.sample(u).map_or(0.0, |sample| {
                    let transmittance = f64::from(-segment.extinction * distance).exp();
                    let pdf = f64::from(at.pdf_sample_direction(&sample));
                    transmittance * radiance(sample.direction) / (pdf_distance * pdf)
                })
            };
            let (distance, pdf) = along.sample_distance(u[0]).expect("a segment");
            joint.add(of(distance, pdf.into(), [u[1], u[2], u[3]]));
            even.add(of(segment.length * u[0], 1.0 / f64::from(segment.length), [u[1], u[2], u[3]]));
        }
        let error = joint.error().hypot(even.error());
        assert!((joint.mean() - even.mean()).abs() < 5.0 * error, "{} {} ± {error}", joint.mean(), even.mean());
        gains.add((even.error() / joint.error()).powi(2).ln());
    }
    gains.mean().exp()
}

/// Points of a segment receive their groups alone, and phase functions guide.
#[test]
fn groups_and_phase_functions_are_kept() {
    let mut pcg = Pcg32::new(4, 194);
    let lights = mixed(&mut pcg);
    for _ in 0..50 {
        let segment = segment(&mut pcg).with_groups(2);
        let scattering = Scattering::new(-segment.direction, 0.6);
        let along = lights.along(&segment.receiver(fanlight::Receiver::Scattering(scattering)));
        if let Some(sample) = along.sample([pcg.f32(), pcg.f32(), pcg.f32(), pcg.f32()]) {
            if let SampledLight::Shape(id) = sample.light.light {
                assert_eq!(id.index() % 2, 1);
            }
        }
    }
}

/// Segments that are none, and such as are hard: no NaN, no infinity, no panic.
#[test]
fn hostile_segments_are_safe() {
    let mut pcg = Pcg32::new(5, 195);
    let lengths = [0.0, -1.0, f32::NAN, 1e-30, 1e-6, 1.0, 1e6, 1e15, 1e30, f32::INFINITY];
    let extinctions = [0.0, 1e-20, 1e-3, 1.0, 1e10, -1.0, f32::NAN, f32::INFINITY];
    let origins = [Vec3::ZERO, Vec3::splat(1e9), Vec3::splat(1e20), Vec3::NAN, Vec3::new(1.0, 1.0, 3.0)];
    let directions = [Vec3::X, Vec3::ZERO, Vec3::NAN, Vec3::new(1e-30, 0.0, 0.0), Vec3::ONE];
    let mut on_ray = LightSampler::builder();
    on_ray.add_light(PointLight::new(Vec3::X, 1.0)).expect("valid");
    on_ray.add_light(SphereLight::new(Vec3::new(0.5, 0.0, 0.0), 1e-3, 1.0)).expect("valid");
    let (mut drawn, scenes) = (0, [room(&mut pcg, true), mixed(&mut pcg), on_ray.build().expect("few lights")]);
    for lights in &scenes {
        for length in lengths {
            for extinction in extinctions {
                for origin in origins {
                    for direction in directions {
                        let along = lights.along(&RaySegment::new(origin, direction, length, extinction));
                        let u = [0.0, 0.3, 1.0 - f32::EPSILON / 2.0, pcg.f32()];
                        for u in u {
                            let Some((distance, pdf)) = along.sample_distance(u) else { continue };
                            drawn += 1;
                            assert!(distance >= 0.0 && distance <= length && pdf > 0.0 && pdf.is_finite());
                            assert_eq!(along.pdf_distance(distance), pdf);
                            if let Some(sample) = along.sample([u, pcg.f32(), u, pcg.f32()]) {
                                assert!(sample.light.pdf.is_finite() && sample.light.position.is_finite());
                            }
                        }
                        assert!(along.pdf(0.5, Vec3::Z).is_finite());
                    }
                }
            }
        }
    }
    assert!(drawn > 1000, "only {drawn}");
}
