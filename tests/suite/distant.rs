//! Distant lights: irradiance against integrals in double precision that know nothing of the crate, normalization,
//! histograms, agreement, bytes, photons and gradual changes.

use core::f64::consts::{PI, TAU};

use crate::common::bytes::check_changes;
use crate::common::hostile::hostile;
use crate::common::lights::{aligned, sample_split};
use crate::common::pcg::Pcg32;
use crate::common::scene::with_lobe;
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    DistantLight, Emission, Environment, LightId, LightSample, LightSampler, LightSamplerView, Mesh, PointLight,
    PointSampler, Receiver, SampledLight, ShadingPoint, SphereLight, Splitting,
};
use glam::{DVec3, Vec3};

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;
/// Largest relative difference of two densities of one direction.
const TOLERANCE: f64 = 1e-5;
/// Angular radii from none to all directions.
const RADII: [f32; 9] = [0.0, 1e-5, 1e-3, 0.1, 0.7, 1.5, 1.8, 2.6, core::f32::consts::PI];

fn receivers(pcg: &mut Pcg32) -> [Receiver; 3] {
    [Receiver::Surface(pcg.direction()), Receiver::Transmissive(pcg.direction()), Receiver::Volume]
}

fn weight(x: &ShadingPoint, direction: DVec3) -> f64 {
    match x.receiver {
        Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
        Receiver::Transmissive(normal) => normal.as_dvec3().dot(direction).abs(),
        _ => 1.0,
    }
}

/// A light of irradiance 1 with what is known of it.
#[derive(Clone, Copy, Debug)]
struct Twin {
    light: DistantLight,
    toward: DVec3,
    radius: f64,
}

fn twin(toward: Vec3, radius: f32) -> Twin {
    let light = DistantLight::new(-toward, 1.0).angular_radius(radius);
    Twin { light, toward: toward.as_dvec3().normalize(), radius: radius.into() }
}

impl Twin {
    /// Radiance of a light of irradiance 1.
    fn radiance(&self) -> f64 {
        1.0 / (PI * self.radius.min(0.5 * PI).sin().powi(2))
    }

    /// Integral over the cap, by the midpoints of equal parts.
    fn integrate(&self, steps: usize, f: impl Fn(DVec3) -> f64) -> f64 {
        let (s, t) = self.toward.any_orthonormal_pair();
        let mut sum = 0.0;
        for i in 0..steps {
            let height = 2.0 * (0.5 * self.radius).sin().powi(2) * (i as f64 + 0.5) / steps as f64;
            let across = (height * (2.0 - height)).sqrt();
            for j in 0..2 * steps {
                let (sin, cos) = (PI * (j as f64 + 0.5) / steps as f64).sin_cos();
                sum += f((s * cos + t * sin) * across + self.toward * (1.0 - height));
            }
        }
        sum * TAU * 2.0 * (0.5 * self.radius).sin().powi(2) / (2 * steps * steps) as f64
    }

    fn irradiance(&self, x: &ShadingPoint) -> f64 {
        if self.radius == 0.0 {
            return weight(x, self.toward);
        }
        self.radiance() * self.integrate(200, |direction| weight(x, direction))
    }
}

fn build(twins: &[Twin]) -> LightSampler {
    let mut builder = LightSampler::builder();
    twins.iter().for_each(|twin| {
        builder.add_light(twin.light).expect("a valid light");
    });
    builder.build().expect("few lights")
}

/// What a sample brings if nothing hides it.
fn brought(twins: &[Twin], x: &ShadingPoint, sample: &LightSample) -> f64 {
    let received = weight(x, sample.direction.as_dvec3()) / f64::from(sample.pdf);
    match sample.light {
        SampledLight::Shape(id) => twins[id.index() as usize].radiance() * received,
        SampledLight::Punctual(_) => received,
        _ => 0.0,
    }
}

fn pdf_again(at: &PointSampler<'_>, sample: &LightSample) -> f32 {
    match sample.light {
        SampledLight::Triangle(hit) => at.pdf(&hit),
        SampledLight::Environment => at.pdf_environment(sample.direction),
        SampledLight::Shape(id) => at.pdf_light(id, sample.direction),
        SampledLight::Punctual(id) => at.pmf_light(id),
        _ => panic!("another kind of light"),
    }
}

fn assert_close(found: f32, expected: f32, what: &impl core::fmt::Debug) {
    let (a, b) = (f64::from(found), f64::from(expected));
    assert!((a - b).abs() <= TOLERANCE * a.abs().max(b.abs()), "{found}, expected {expected}: {what:?}");
}

/// A normal from which the middle of a light is at an angle.
fn tilted(toward: DVec3, angle: f64) -> Vec3 {
    let (s, _) = toward.any_orthonormal_pair();
    (toward * angle.cos() + s * angle.sin()).as_vec3()
}

/// Each radius over, across and below the horizon: samples bring the irradiance of an integral, and where all of a
/// light is above the horizon, each brings all of it.
#[test]
fn samples_bring_the_irradiance_of_an_integral() {
    let mut pcg = Pcg32::new(1, 161);
    for radius in RADII {
        for step in 0..8 {
            let twin = twin(pcg.direction(), radius);
            let lights = build(&[twin]);
            let angle = match step {
                0 => 0.3,
                // Across the horizon.
                1..=5 => 0.5 * PI + (f64::from(step) - 3.0) * 0.45 * twin.radius.clamp(1e-4, 1.5),
                6 => 2.5,
                _ => 1.0,
            };
            let normal = tilted(twin.toward, angle);
            for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
                let x = ShadingPoint::new(Vec3::from_array(pcg.cube()), receiver);
                let (at, exact) = (lights.at(&x), twin.irradiance(&x));
                let (mut mean, n) = (Mean::default(), 48);
                for i in 0..n * n {
                    let u = [(i % n) as f32, (i / n) as f32].map(|k| (k + pcg.f32()) / n as f32);
                    let sample = at.sample([pcg.f32(), u[0], u[1]]);
                    mean.add(sample.map_or(0.0, |sample| brought(&[twin], &x, &sample)));
                }
                let (found, error) = (mean.mean(), mean.error());
                // Rounding of directions, next to the horizon.
                let slack = 2e-3 * exact + 1e-7;
                assert!((found - exact).abs() <= 5.0 * error + slack, "{twin:?} {x:?}: {found} ± {error}, not {exact}");
                let is_above = angle + twin.radius < 0.5 * PI && matches!(receiver, Receiver::Surface(_));
                if is_above && radius != 1e-5 {
                    assert!(error < 1e-4 * exact, "{twin:?} {x:?}: {found} ± {error}");
                }
            }
        }
    }
}

/// Densities of directions integrate to the share of samples that are no `None` and have an extent.
#[test]
fn densities_integrate_to_the_rate_of_samples() {
    let mut pcg = Pcg32::new(2, 162);
    for radius in RADII.into_iter().skip(2) {
        let twin = twin(pcg.direction(), radius);
        let lights = build(&[twin]);
        for step in 0..5 {
            let normal = tilted(twin.toward, f64::from(step) * 0.75);
            for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
                let x = ShadingPoint::new(Vec3::ZERO, receiver);
                let at = lights.at(&x);
                let id = LightId::from_index(0);
                let integral = twin.integrate(120, |direction| f64::from(at.pdf_light(id, direction.as_vec3())));
                let n = 8_000;
                let drawn = (0..n).filter(|_| at.sample(pcg.cube()).is_some()).count() as f64 / f64::from(n);
                let error = 5.0 * (drawn * (1.0 - drawn) / f64::from(n)).sqrt();
                assert!((integral - drawn).abs() < error + 2e-2, "{twin:?} {x:?}: {integral}, drawn {drawn}");
            }
        }
    }
}

/// Directions of samples in equal parts of the sphere fall as the density of directions says, caps on top of each other
/// and on the sky.
#[test]
fn directions_fall_as_the_density_says() {
    const BANDS: usize = 20;
    let cell = |direction: Vec3| {
        let z = ((0.5 * (f64::from(direction.z) + 1.0) * BANDS as f64) as usize).min(BANDS - 1);
        let angle = f64::from(direction.y).atan2(direction.x.into()) / TAU + 0.5;
        z * BANDS + ((angle * BANDS as f64) as usize).min(BANDS - 1)
    };
    let count = 4;
    for round in 0..count {
        let mut pcg = Pcg32::new(round as u64, 163);
        let mut builder = LightSampler::builder().environment(Environment::constant(0.2).expect("valid"));
        if round % 2 == 1 {
            builder = builder.environment_as_light();
        }
        for radius in [0.3, 0.5, 0.8, 1.4, 2.2] {
            builder.add_light(twin(pcg.direction(), radius).light).expect("a valid light");
        }
        let lights = builder.build().expect("few lights");
        let at = lights.at(&ShadingPoint::new(Vec3::ZERO, receivers(&mut pcg)[round % 3]));
        // Every tier draws as many, as a sample takes less than a microsecond.
        let n = 100_000;
        let mut observed = vec![0.0; BANDS * BANDS + 1];
        for _ in 0..n {
            match at.sample(pcg.cube()) {
                Some(sample) => observed[cell(sample.direction)] += 1.0,
                None => observed[BANDS * BANDS] += 1.0,
            }
        }
        let steps = 400;
        let mut expected = vec![0.0; BANDS * BANDS + 1];
        let each = n as f64 * 2.0 * TAU / (2 * steps * steps) as f64;
        for i in 0..steps {
            let z = -1.0 + 2.0 * (i as f64 + 0.5) / steps as f64;
            for j in 0..2 * steps {
                let (sin, cos) = (PI * (j as f64 + 0.5) / steps as f64).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let direction = DVec3::new(r * cos, r * sin, z).as_vec3();
                expected[cell(direction)] += each * f64::from(at.pdf_direction(direction));
            }
        }
        let all: f64 = expected.iter().sum();
        let last = BANDS * BANDS;
        expected[last] = (n as f64 - all).max(0.0);
        if expected[last] < 2e-3 * n as f64 {
            (expected[last], observed[last]) = (0.0, 0.0);
        }
        let (p, dump) = chi_square(&observed, &expected);
        assert!(p > sidak(SIGNIFICANCE, count), "round {round}: p = {p:e}\n{dump}");
    }
}

/// Distant lights, few and many, among a sky, meshes and lamps.
fn mixed(pcg: &mut Pcg32, number: usize) -> (LightSampler, Vec<Twin>) {
    let twins: Vec<Twin> = (0..[1, 5, 32, 33, 200][number % 5])
        .map(|i| twin(pcg.direction(), RADII[(i + number) % RADII.len()].min(if i % 4 == 0 { 4.0 } else { 0.3 })))
        .collect();
    let quad = [[2.0, 0.0, 2.0], [3.0, 0.0, 2.0], [2.0, 1.0, 2.0]].map(Vec3::from);
    let mut builder = LightSampler::builder().environment(Environment::constant(0.3).expect("valid"));
    if number % 2 == 0 {
        builder = builder.environment_as_light();
    }
    twins.iter().for_each(|twin| {
        builder.add_light(twin.light).expect("a valid light");
    });
    if number % 3 > 0 {
        builder.add_light(SphereLight::new(Vec3::new(0.0, 2.0, 2.0), 0.4, 2.0)).expect("a valid light");
        builder.add_mesh(&Mesh::emitter(&quad, &[[0, 2, 1]])).expect("a valid mesh");
        builder.add_mesh(&Mesh::portal(&quad.map(|p| p - Vec3::X), &[[0, 2, 1]])).expect("a valid mesh");
    }
    (builder.build().expect("few lights"), twins)
}

fn points(pcg: &mut Pcg32, count: usize) -> Vec<ShadingPoint> {
    (0..count)
        .map(|i| {
            let receiver = receivers(pcg)[i % 3];
            let x = ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()) - 0.5, receiver);
            if i % 2 == 1 { with_lobe(x, pcg, 1e-3) } else { x }
        })
        .collect()
}

/// What is found later is what a sample says, by every way to ask, from bytes too; and probabilities of lights add up.
#[test]
fn densities_of_samples_are_found_again() {
    let mut drawn = 0;
    for number in 0..15 {
        let mut pcg = Pcg32::new(number as u64, 164);
        let (lights, twins) = mixed(&mut pcg, number);
        let words = aligned(&lights.to_bytes());
        let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        assert_eq!(view.to_bytes(), lights.to_bytes());
        let splitting = Splitting::new(0.7, 2);
        let points = points(&mut pcg, 24);
        for x in &points {
            let at = lights.at(x);
            for _ in 0..30 {
                let u = core::array::from_fn(|_| hostile(&mut pcg));
                let sample = at.sample(u);
                assert_eq!(view.at(x).sample(u), sample);
                let Some(sample) = sample else { continue };
                drawn += 1;
                assert!((sample.direction.length() - 1.0).abs() < 1e-5 && sample.position.is_finite());
                assert!(sample.pdf > 0.0 && sample.pmf > 0.0 && sample.pmf <= 1.0 && sample.pmf <= at_most(&sample));
                assert_close(pdf_again(&at, &sample), sample.pdf, &(x, sample));
                let along = at.pdf_sample_direction(&sample);
                assert!(along >= sample.pdf * (1.0 - 1e-5) && along.is_finite(), "{along} along {sample:?}");
                let any = at.pdf_direction(sample.direction);
                let is_inside = match sample.light {
                    SampledLight::Shape(id) => twins.get(id.index() as usize).is_some_and(|twin| {
                        let direction = sample.direction.as_dvec3();
                        let angle = twin.toward.cross(direction).length().atan2(twin.toward.dot(direction));
                        angle < twin.radius - 1e-6
                    }),
                    _ => false,
                };
                if is_inside {
                    assert_close(any, along, &(x, sample));
                }
            }
            for sample in sample_split(&at, pcg.cube(), &splitting) {
                let again = match sample.light {
                    SampledLight::Shape(id) => at.pdf_split_light(id, sample.direction, &splitting),
                    _ => continue,
                };
                assert_close(again, sample.pdf, &(x, sample));
            }
        }
        let queries: Vec<_> = points.iter().map(|x| (*x, pcg.cube())).collect();
        let mut many = vec![None; queries.len()];
        view.sample_many(&queries, &mut many);
        queries.iter().zip(many).for_each(|((x, u), sample)| assert_eq!(lights.at(x).sample(*u), sample));
        if number % 3 == 0 && number % 2 == 1 {
            let at = lights.at(&ShadingPoint::volume(Vec3::ZERO));
            let sum: f32 = (0..twins.len() as u32).map(|i| at.pmf_light(LightId::from_index(i))).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        }
    }
    assert!(drawn > 5_000, "only {drawn}");
}

/// Largest probability of a sample's light.
fn at_most(sample: &LightSample) -> f32 {
    if sample.has_extent() { 1.0 } else { sample.pdf * (1.0 + 1e-6) }
}

/// Below the horizon nothing arrives, and lights above it get all samples.
#[test]
fn lights_below_the_horizon_are_never_chosen() {
    let (above, below) = (twin(Vec3::new(0.3, 0.0, 1.0), 0.1), twin(Vec3::new(0.3, 0.0, -1.0), 0.1));
    let lights = build(&[below, above, twin(Vec3::NEG_Z, 0.0)]);
    assert_eq!(lights.light_count(), 3);
    let at = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
    let ids = [0, 1, 2].map(LightId::from_index);
    assert_eq!(ids.map(|id| at.pmf_light(id)), [0.0, 1.0, 0.0]);
    assert_eq!(at.pdf_light(ids[0], below.toward.as_vec3()), 0.0);
    let mut pcg = Pcg32::new(3, 165);
    for _ in 0..1000 {
        assert!(at.sample(pcg.cube()).is_some_and(|sample| sample.light == SampledLight::Shape(ids[1])));
    }
    for bad in [f32::NAN, f32::INFINITY, 1e20] {
        let at = lights.at(&ShadingPoint::volume(Vec3::splat(bad)));
        assert_eq!((at.sample([0.5; 3]), at.pdf_direction(Vec3::Z)), (None, 0.0));
    }
}

/// Every changed word is refused, or harmless.
#[test]
fn changed_bytes_are_refused_or_harmless() {
    let mut pcg = Pcg32::new(7, 166);
    let twins: Vec<Twin> = (0..40).map(|i| twin(pcg.direction(), RADII[i % RADII.len()])).collect();
    let lights = build(&twins);
    check_changes(&lights, &[1 << 15, 1 << 30, u32::MAX], Vec3::ZERO, &mut pcg);
}

/// Photons into a ball: their power, their densities, and what they bring to a floor.
#[test]
fn photons_bring_what_light_samples_bring() {
    let mut pcg = Pcg32::new(5, 167);
    let twins = [twin(Vec3::new(0.2, 0.1, 1.0), 0.0), twin(Vec3::new(-0.5, 0.1, 1.0), 0.3), twin(Vec3::Z, 1.2)];
    let lights = build(&twins);
    assert_eq!(lights.emission().sample([0.5; 5]), None);
    let (center, radius) = (Vec3::new(0.1, 0.2, -0.4), 2.0);
    let emission = lights.emission().within(center, radius);
    let (mut power, mut photons, mut samples) = (Mean::default(), Mean::default(), Mean::default());
    for _ in 0..50_000 {
        let ray = emission.sample(core::array::from_fn(|_| pcg.f32())).expect("all lights send");
        let id = ray.light.id().expect("a light");
        let twin = &twins[id.index() as usize];
        assert_close(emission.pdf_light(id, ray.direction), ray.pdf, &ray);
        assert!(emission.pdf_sample_ray(&ray, center) >= ray.pdf);
        let sent = if ray.has_extent() { twin.radiance() } else { 1.0 } / f64::from(ray.pdf);
        power.add(sent);
        let t = -ray.position.z / ray.direction.z;
        let landed = ray.position + t * ray.direction;
        let is_hit = t > 0.0 && landed.x.abs() < 0.7 && landed.y.abs() < 0.7;
        photons.add(if is_hit { sent } else { 0.0 });
        let x = ShadingPoint::surface(Vec3::new(1.4 * pcg.f32() - 0.7, 1.4 * pcg.f32() - 0.7, 0.0), Vec3::Z);
        samples.add(1.96 * lights.at(&x).sample(pcg.cube()).map_or(0.0, |sample| brought(&twins, &x, &sample)));
    }
    // Radiance over all directions of the cap, and not over those in front of a surface.
    let exact: f64 = twins
        .iter()
        .map(|twin| if twin.radius > 0.0 { twin.radiance() * TAU * (1.0 - twin.radius.cos()) } else { 1.0 })
        .sum::<f64>()
        * PI
        * f64::from(radius * radius);
    assert!((power.mean() - exact).abs() < 5.0 * power.error() + 1e-4 * exact, "{} {exact}", power.mean());
    let error = photons.error().hypot(samples.error());
    let (a, b) = (photons.mean(), samples.mean());
    assert!((a - b).abs() < 4.0 * error && error < 0.03 * b, "{a} and {b} ± {error}");
}

/// Photons of a bulb beside a sun of up to five million times its power come as often as their density says. The last
/// values of the first number choose the bulb.
#[test]
fn photons_of_weak_lights_come_beside_strong_ones() {
    let build = |irradiance| {
        let mut builder = LightSampler::builder();
        builder.add_light(PointLight::new(Vec3::Z, 1.0)).expect("a valid light");
        builder.add_light(DistantLight::new(Vec3::NEG_Z, irradiance)).expect("a valid light");
        builder.build().expect("two lights")
    };
    let bulb = LightId::from_index(0);
    let share = |emission: &Emission<'_>| f64::from(emission.pdf_light(bulb, Vec3::X)) * 2.0 * TAU;
    for power in [1e6_f32, 4e6, 1e7, 2e7, 6e7] {
        let lights = build(power);
        // In a ball whose section has an area of about 1, the sun's power is its irradiance.
        let emission = lights.emission().within(Vec3::ZERO, 0.564_189_6);
        let share = share(&emission);
        assert!((share * f64::from(power) / (2.0 * TAU) - 1.0).abs() < 1e-3, "{share}");
        // The bulb's share of the numbers from `1 - steps * step` on.
        let step = f64::from(f32::EPSILON) / 2.0;
        let steps = (share / step).ceil() * 2.0;
        let mut pcg = Pcg32::new(1, 169);
        let count = 20_000;
        let mut found = 0;
        for i in 0..count {
            let [_, b, c] = pcg.cube();
            let u = 1.0 - f64::from(i % steps as i32 + 1) * step;
            let ray = emission.sample([u as f32, b, c, pcg.f32(), pcg.f32()]).expect("both send in all directions");
            found += i32::from(ray.light.id() == Some(bulb));
        }
        let expected = share / (steps * step);
        let error = (expected * (1.0 - expected) / f64::from(count)).sqrt();
        let found = f64::from(found) / f64::from(count);
        assert!((found - expected).abs() < 5.0 * error, "{power}: {found}, expected {expected}");
    }
    // The last ball counts, and it alone.
    let lights = build(10.0);
    let once = lights.emission().within(Vec3::X, 2.0);
    let twice = lights.emission().within(Vec3::ZERO, 50.0).within(Vec3::X, 2.0);
    assert_eq!(once.pdf_light(bulb, Vec3::X), twice.pdf_light(bulb, Vec3::X));
    let u = [0.999, 0.1, 0.2, 0.3, 0.4];
    assert_eq!(once.sample(u), twice.sample(u));
}

#[test]
fn bad_distant_lights_are_clear_errors() {
    let refuse = |light: DistantLight, parts: &[&str]| {
        let message = LightSampler::builder().add_light(light).expect_err("an invalid light").to_string();
        ["light 0"].iter().chain(parts).for_each(|part| assert!(message.contains(part), "{message} lacks {part}"));
    };
    for (value, name) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-1.0, "-1")] {
        refuse(DistantLight::new(Vec3::Z, value), &["irradiance", name]);
        refuse(DistantLight::new(Vec3::Z, 1.0).angular_radius(value), &["angular radius", name]);
    }
    refuse(DistantLight::new(Vec3::ZERO, 1.0), &["axis"]);
    refuse(DistantLight::new(Vec3::Z, 1.0).angular_radius(1e-6), &["angular radius", "1e-5"]);
    refuse(DistantLight::new(Vec3::Z, 1.0).angular_radius(3.2), &["angular radius", "π"]);
    refuse(DistantLight::new(Vec3::Z, 1e30).angular_radius(1e-5), &["radiance", "1e38"]);
}

/// Lights that move: as a new build, to the bit; and what cannot be is an error.
#[test]
fn distant_lights_are_replaced_without_a_rebuild() {
    let mut pcg = Pcg32::new(9, 168);
    let before = [twin(Vec3::Z, 0.1), twin(Vec3::X, 0.0)];
    let after = [twin(pcg.direction(), 0.0), twin(pcg.direction(), 0.7)];
    let mut lights = build(&before);
    let ids = [0, 1].map(LightId::from_index);
    lights.refit_lights(&[(ids[0], after[0].light.into()), (ids[1], after[1].light.into())]).expect("valid updates");
    assert_eq!(lights.to_bytes(), build(&after).to_bytes());
    let mut builder = LightSampler::builder();
    let sun = builder.add_light(before[0].light).expect("valid");
    let bulb = builder.add_light(SphereLight::new(Vec3::Z, 0.1, 1.0)).expect("valid");
    let black = builder.add_light(DistantLight::new(Vec3::Z, 0.0)).expect("valid");
    let mut lights = builder.build().expect("few lights");
    assert_eq!(lights.light_count(), 2);
    let bytes = lights.to_bytes();
    let mut refuse = |id: LightId, lamp: fanlight::Lamp, part: &str| {
        let error = lights.refit_lights(&[(sun, after[0].light.into()), (id, lamp)]).expect_err("impossible");
        assert!(error.to_string().contains(part), "{error}");
        assert_eq!(lights.to_bytes(), bytes);
    };
    refuse(sun, SphereLight::new(Vec3::Z, 0.1, 1.0).into(), "distant light");
    refuse(bulb, before[0].light.into(), "distant light");
    refuse(black, before[0].light.into(), "light 2");
    lights.refit_lights(&[(sun, DistantLight::new(Vec3::Z, 0.0).into())]).expect("switched off");
    let at = lights.at(&ShadingPoint::volume(Vec3::ZERO));
    assert_eq!((at.pmf_light(sun), at.pmf_light(bulb)), (0.0, 1.0));
}

/// Relative deviation of samples as a light changes: no step.
#[test]
fn variance_changes_gradually() {
    let mut pcg = Pcg32::new(17, 169);
    let quad = [[-1.0, -1.0, 3.0], [-1.0, 1.0, 3.0], [1.0, -1.0, 3.0]].map(Vec3::from);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let mut deviation = |lights: &[Twin]| {
        let mut builder = LightSampler::builder();
        lights.iter().for_each(|twin| {
            builder.add_light(twin.light).expect("a valid light");
        });
        builder.add_mesh(&Mesh::emitter(&quad, &[[0, 1, 2]])).expect("a valid mesh");
        let sampler = builder.build().expect("few lights");
        let (at, mut mean, n) = (sampler.at(&x), Mean::default(), 4_000);
        for _ in 0..n {
            mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| match sample.light {
                SampledLight::Triangle(_) => weight(&x, sample.direction.as_dvec3()) / f64::from(sample.pdf),
                _ => brought(lights, &x, &sample),
            }));
        }
        mean.error() * f64::from(n).sqrt() / mean.mean()
    };
    let mut assert_gradual = |what: &str, lights: &dyn Fn(f32) -> Vec<Twin>| {
        let found: Vec<f64> = (0..=60_u8).map(|i| deviation(&lights(f32::from(i) / 60.0))).collect();
        for (i, pair) in found.windows(2).enumerate() {
            let [low, high] = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            assert!(high < 1.5 * low + 0.04, "{what}: from {} to {} at step {i}: {found:?}", pair[0], pair[1]);
        }
    };
    let at = |angle: f32| Vec3::new(angle.sin(), 0.0, angle.cos());
    assert_gradual("radius", &|t| vec![twin(at(0.5), 1e-5 * (3.1e5_f32).powf(t))]);
    assert_gradual("radius at the horizon", &|t| vec![twin(at(1.5), 1e-5 * (3.1e5_f32).powf(t))]);
    assert_gradual("height of a wide light", &|t| vec![twin(at(1.2 + 0.8 * t), 0.5)]);
    assert_gradual("number", &|t| (0..1 + (60.0 * t) as u16).map(|i| twin(at(0.02 * f32::from(i)), 0.1)).collect());
}
