//! Lights that are not made of triangles, alone and mixed with meshes and portals: irradiance against integrals in
//! double precision that know nothing of the crate, normalization, histograms, agreement, hostile places, bytes and
//! photons.

use core::f64::consts::{PI, TAU};

use crate::common::bytes::check_changes;
use crate::common::hostile::hostile;
use crate::common::lights::{ARITIES, aligned, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, Scene, with_lobe};
use crate::common::statistics::{Mean, chi_square, sidak};
use crate::common::tier::{agreement, some, tier};
use fanlight::{
    DiskLight, Emission, Error, Lamp, LightId, LightSample, LightSampler, LightSamplerView, Mesh, MeshId, MeshUpdate,
    PointLight, PointSampler, Receiver, SampledLight, ShadingPoint, Sides, SphereLight, Splitting, SpotLight,
    TubeLight, Weight,
};
use glam::{DVec3, Vec3};

mod spheres;
mod twin;

use twin::{Kind, Twin, disk, hollow_sphere, over_cap, point, sphere, spot, tube, weight};

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;
/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;

fn receivers(pcg: &mut Pcg32) -> [Receiver; 3] {
    [Receiver::Surface(pcg.direction()), Receiver::Transmissive(pcg.direction()), Receiver::Volume]
}

/// Lamps of all kinds around the unit cube.
fn kinds(pcg: &mut Pcg32) -> Vec<Kind> {
    let mut place = || Vec3::from_array(pcg.cube());
    vec![
        sphere(place(), 0.3),
        sphere(place(), 0.01),
        sphere(place(), 0.7),
        hollow_sphere(place(), 0.4),
        point(place()),
        spot(place(), place() - place(), [0.3, 0.7]),
        spot(place(), place() - place(), [0.2, 1.5]),
        disk(place(), place() - place(), 0.4, Sides::One),
        disk(place(), place() - place(), 0.1, Sides::Two),
        tube([place(), place()], 0.1),
        tube([place(), place()], 0.02),
    ]
}

fn build(lamps: &[Kind]) -> LightSampler {
    let mut builder = LightSampler::builder();
    lamps.iter().for_each(|kind| {
        builder.add_light(kind.lamp).expect("a valid lamp");
    });
    builder.build().expect("few lights")
}

/// Lamps among the meshes of a random scene.
pub(crate) fn mixed(pcg: &mut Pcg32, number: usize) -> (LightSampler, Vec<Kind>) {
    let content =
        Content { triangles: [1, 10, 100][number % 3], textured: number % 2 == 0, sky: number % 5, two_sided: true };
    let scene = Scene::random(pcg, content);
    let lamps: Vec<Kind> = (0..1 + number % 4).flat_map(|_| kinds(pcg)).collect();
    let lights = scene.build_with(ARITIES[number % 3], |builder| {
        lamps.iter().for_each(|kind| {
            builder.add_light(kind.lamp).expect("a valid lamp");
        });
    });
    (lights, lamps)
}

/// Density of the light of a sample, looked up by its id.
pub(crate) fn pdf_again(at: &PointSampler<'_>, sample: &LightSample) -> f32 {
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

/// What a sample brings if all weights are 1 and nothing hides it.
fn brought(twins: &[Kind], x: &ShadingPoint, sample: &LightSample) -> f64 {
    let direction = sample.direction.as_dvec3();
    let received = weight(x, direction);
    match sample.light {
        SampledLight::Shape(_) => received / f64::from(sample.pdf),
        SampledLight::Punctual(id) => {
            let falloff = twins[id.index() as usize].twin.falloff(-direction);
            falloff * received / (f64::from(sample.distance).powi(2) * f64::from(sample.pdf))
        }
        _ => 0.0,
    }
}

/// Each kind alone: samples bring the irradiance of an integral.
#[test]
fn each_kind_brings_the_irradiance_of_an_integral() {
    let rounds = 12;
    let found = parallel::map(rounds, |round| {
        let mut pcg = Pcg32::new(round as u64, 141);
        let mut results = Vec::new();
        for kind in kinds(&mut pcg) {
            for receiver in receivers(&mut pcg) {
                let x = ShadingPoint::new(3.0 * Vec3::from_array(pcg.cube()) - 1.0, receiver);
                let lights = build(&[kind]);
                let at = lights.at(&x);
                let mut mean = Mean::default();
                let n = 64;
                for i in 0..n * n {
                    let u =
                        [pcg.f32(), ((i % n) as f32 + pcg.f32()) / n as f32, ((i / n) as f32 + pcg.f32()) / n as f32];
                    mean.add(at.sample(u).map_or(0.0, |sample| brought(&[kind], &x, &sample)));
                }
                results.push((kind, x, kind.twin.irradiance(&x, 500), mean.mean(), mean.error()));
            }
        }
        results
    });
    let mut lit = 0;
    for (kind, x, exact, mean, error) in found.into_iter().flatten() {
        assert!((mean - exact).abs() <= 5.0 * error + 4e-3 * exact, "{kind:?} {x:?}: {mean} ± {error}, not {exact}");
        lit += usize::from(exact > 0.0);
    }
    assert!(lit > 100, "only {lit} points are lit");
}

/// The density of directions integrates to the share of samples that are no `None` and have an extent.
#[test]
fn densities_of_directions_integrate_to_the_rate_of_samples() {
    let rounds = some(12);
    let found = parallel::map(rounds.len(), |round| {
        let mut pcg = Pcg32::new(rounds[round] as u64, 142);
        let mut results = Vec::new();
        for kind in kinds(&mut pcg) {
            for receiver in receivers(&mut pcg) {
                let x = ShadingPoint::new(3.0 * Vec3::from_array(pcg.cube()) - 1.0, receiver);
                let lights = build(&[kind]);
                let at = lights.at(&x);
                let pdf = |direction: DVec3| f64::from(at.pdf_direction(direction.as_vec3()));
                let integral = kind.twin.integrate(x.position.as_dvec3(), 300, pdf);
                let n = 20_000;
                let drawn = (0..n).filter(|_| at.sample(pcg.cube()).is_some_and(|sample| sample.has_extent())).count();
                results.push((kind, x, integral, drawn as f64 / f64::from(n)));
            }
        }
        results
    });
    for (kind, x, integral, rate) in found.into_iter().flatten() {
        let error = 4.0 * (rate * (1.0 - rate) / 20_000.0).sqrt();
        assert!((integral - rate).abs() < error + 5e-3, "{kind:?} {x:?}: {integral}, drawn {rate}");
    }
}

/// Directions of samples in equal parts of the sphere fall as the density says.
#[test]
fn directions_fall_as_the_density_says() {
    const BANDS: usize = 24;
    let cell = |direction: Vec3| {
        let z = ((0.5 * (f64::from(direction.z) + 1.0) * BANDS as f64) as usize).min(BANDS - 1);
        let angle = f64::from(direction.y).atan2(direction.x.into()) / TAU + 0.5;
        z * BANDS + ((angle * BANDS as f64) as usize).min(BANDS - 1)
    };
    let rounds = some(12);
    let count = rounds.len();
    let found = parallel::map(count, |k| {
        let round = rounds[k];
        let mut pcg = Pcg32::new(round as u64, 143);
        let lamps: Vec<Kind> = kinds(&mut pcg);
        let lights = build(&lamps);
        let x = ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()) - 0.5, receivers(&mut pcg)[round % 3]);
        let at = lights.at(&x);
        let n = tier().histogram;
        let mut observed = vec![0.0; BANDS * BANDS + 1];
        for _ in 0..n {
            match at.sample(pcg.cube()).filter(LightSample::has_extent) {
                Some(sample) => observed[cell(sample.direction)] += 1.0,
                None => observed[BANDS * BANDS] += 1.0,
            }
        }
        let steps = 1200;
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
        expected[BANDS * BANDS] = (n as f64 - all).max(0.0);
        // Cells at the rims of lights are known as well as the grid is fine.
        let last = BANDS * BANDS;
        if expected[last] < 2e-3 * n as f64 {
            (expected[last], observed[last]) = (0.0, 0.0);
        }
        chi_square(&observed, &expected)
    });
    for (p, dump) in found {
        assert!(p > sidak(SIGNIFICANCE, count), "p = {p:e}\n{dump}");
    }
}

/// Scenes that mix kinds: what is found later is what a sample says, by every way to ask.
#[test]
fn densities_of_samples_are_found_again_in_mixed_scenes() {
    let count = 24;
    let found = parallel::map(count, |number| {
        let mut pcg = Pcg32::new(number as u64, 144);
        let (lights, lamps) = mixed(&mut pcg, number);
        let splitting = Splitting::new(0.7, 2);
        let (mut of_lamps, mut of_meshes) = (0, 0);
        for i in 0..40 {
            let receiver = receivers(&mut pcg)[i % 3];
            let x = ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()) - 0.5, receiver);
            let x = if i % 2 == 1 { with_lobe(x, &mut pcg, 1e-3) } else { x };
            let at = lights.at(&x);
            for _ in 0..agreement(40 * count, 1250) {
                let u = core::array::from_fn(|_| hostile(&mut pcg));
                let Some(sample) = at.sample(u) else { continue };
                match sample.light.id() {
                    Some(_) => of_lamps += 1,
                    None => of_meshes += 1,
                }
                assert_close(pdf_again(&at, &sample), sample.pdf, &(x, sample));
                let along = at.pdf_sample_direction(&sample);
                assert!(along >= sample.pdf * (1.0 - 1e-5) && along.is_finite(), "{along} along {sample:?}");
                if let (SampledLight::Shape(id), true) = (sample.light, sample.pdf_area > 1e-3) {
                    // Except at the rim, the ray meets the light, and all ways to ask agree.
                    let origin = x.position.as_dvec3();
                    let direction = sample.direction.as_dvec3().normalize();
                    let (s, t) = direction.any_orthonormal_pair();
                    let twin = &lamps[id.index() as usize].twin;
                    let near = [s, t, -s, -t].map(|side| (direction + 1e-5 * side).normalize());
                    if near.iter().all(|direction| twin.radiance(origin, *direction) > 0.0) {
                        let any = at.pdf_direction(sample.direction);
                        assert!(f64::from(any) > f64::from(sample.pdf) * (1.0 - 1e-5), "{any}: {x:?} {sample:?}");
                    }
                }
            }
            for sample in sample_split(&at, pcg.cube(), &splitting) {
                let again = match sample.light {
                    SampledLight::Triangle(hit) => at.pdf_split(&hit, &splitting),
                    SampledLight::Shape(id) => at.pdf_split_light(id, sample.direction, &splitting),
                    _ => continue,
                };
                assert_close(again, sample.pdf, &(x, sample));
            }
        }
        (of_lamps, of_meshes)
    });
    let [lamps, meshes] = found.iter().fold([0, 0], |sum, count| [sum[0] + count.0, sum[1] + count.1]);
    assert!(lamps > 1000 && meshes > 1000, "{lamps} samples of lamps, {meshes} of meshes");
}

/// On the axis of a disk, the direction across it is nothing but rounding.
#[test]
fn disks_are_seen_from_their_axis() {
    let mut pcg = Pcg32::new(8, 147);
    for i in 0..3000 {
        // Sums of like numbers are exact, and others are not.
        let normal = if i % 2 == 0 { Vec3::ONE } else { pcg.direction() };
        let (height, radius) = (10.0_f32.powf(pcg.within(-3.0, 3.0)), 10.0_f32.powf(pcg.within(-3.0, 3.0)));
        let beside = if i % 3 == 0 { Vec3::ZERO } else { pcg.direction() * 10.0_f32.powf(pcg.within(-12.0, -4.0)) };
        let lights = build(&[disk(height * (normal + beside), -normal, radius, Sides::One)]);
        let at = lights.at(&ShadingPoint::volume(Vec3::ZERO));
        let distance = f64::from(height) * f64::from(normal.length());
        let cos = distance / distance.hypot(radius.into());
        let solid_angle = TAU * (f64::from(radius) / distance.hypot(radius.into())).powi(2) / (1.0 + cos);
        for _ in 0..4 {
            let sample = at.sample(pcg.cube()).expect("the disk faces the point");
            assert!((sample.direction.length() - 1.0).abs() < 1e-5, "{normal} {height} {radius} {beside}: {sample:?}");
            let uniform = f64::from(sample.pdf) * solid_angle;
            assert!((uniform - 1.0).abs() < 0.01, "{normal} {height} {radius} {beside}: {uniform}");
        }
    }
}

/// Where lamps are behind each other, each candidate stands for its own lamp.
#[test]
fn resampled_lamps_bring_what_samples_bring() {
    let mut pcg = Pcg32::new(7, 146);
    let lamps =
        [sphere(Vec3::new(0.0, 0.0, 2.0), 0.5), sphere(Vec3::new(0.0, 0.1, 4.0), 1.0), point(Vec3::new(1.0, 0.0, 2.0))];
    let lights = build(&lamps);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8));
    let at = lights.at(&x);
    let exact: f64 = lamps.iter().map(|kind| kind.twin.irradiance(&x, 500)).sum();
    let mut mean = Mean::default();
    for _ in 0..40_000 {
        let numbers: [[f32; 3]; 4] = core::array::from_fn(|_| pcg.cube());
        // A target that prefers one side.
        let chosen = at.sample_resampled(&numbers, pcg.f32(), |sample| 1.1 + sample.direction.y);
        mean.add(chosen.map_or(0.0, |chosen| {
            brought(&lamps, &x, &chosen.sample) * f64::from(chosen.sample.pdf) * f64::from(chosen.weight)
        }));
    }
    let (found, error) = (mean.mean(), mean.error());
    assert!((found - exact).abs() < 5.0 * error + 1e-3 * exact, "{found} ± {error} instead of {exact}");
    assert!(error < 0.01 * exact, "{error} does not tell them apart");
}

/// All at once and from bytes, samples are the same.
#[test]
fn samples_of_many_and_from_bytes_are_the_same() {
    for number in 0..15 {
        let mut pcg = Pcg32::new(number as u64, 145);
        let (lights, _) = mixed(&mut pcg, number);
        let words = aligned(&lights.to_bytes());
        let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        let queries: Vec<_> = (0..200)
            .map(|i| {
                let receiver = receivers(&mut pcg)[i % 3];
                (ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()) - 0.5, receiver), pcg.cube())
            })
            .collect();
        let mut many = vec![None; queries.len()];
        view.sample_many(&queries, &mut many);
        for ((x, u), sample) in queries.iter().zip(many) {
            assert_eq!(lights.at(x).sample(*u), sample);
        }
        assert_eq!(view.to_bytes(), lights.to_bytes());
    }
}

/// Every changed word of what a lamp is kept in is refused, or harmless.
#[test]
fn changed_bytes_of_lamps_are_refused_or_harmless() {
    let mut pcg = Pcg32::new(7, 146);
    let lamps = kinds(&mut pcg);
    let lights = build(&lamps);
    let flips = [1, 1 << 15, 1 << 23, 1 << 30, 1 << 31, u32::MAX];
    check_changes(&lights, &flips, Vec3::splat(0.3), &mut pcg);
}

/// Rays of light: their densities agree, and the power that leaves a closed surface around all is known.
#[test]
fn photons_carry_the_power_of_their_lamps() {
    let mut pcg = Pcg32::new(3, 147);
    for kind in kinds(&mut pcg) {
        let lights = build(&[kind]);
        let emission = lights.emission();
        let mut mean = Mean::default();
        for _ in 0..40_000 {
            let u = core::array::from_fn(|_| pcg.f32());
            let power = emission.sample(u).map_or(0.0, |ray| {
                assert_close(emission.pdf_light(LightId::from_index(0), ray.direction), ray.pdf, &ray);
                let landed = ray.position + 10.0 * ray.direction;
                assert!(emission.pdf_sample_ray(&ray, landed) >= ray.pdf);
                kind.twin.falloff(ray.direction.as_dvec3()) / f64::from(ray.pdf)
            });
            mean.add(power);
        }
        let exact = power(&kind.twin);
        assert!((mean.mean() - exact).abs() <= 4.0 * mean.error() + 1e-5 * exact, "{kind:?}: {} {exact}", mean.mean());
    }
}

/// Power of a lamp of radiance or intensity 1.
fn power(twin: &Twin) -> f64 {
    match *twin {
        Twin::Sphere { radius, two_sided, .. } => {
            let sides = if two_sided { 2.0 } else { 1.0 };
            sides * PI * 4.0 * PI * radius * radius
        }
        Twin::Point { .. } => 4.0 * PI,
        Twin::Spot { axis, angles, .. } => over_cap(axis, angles[1].cos(), 300, |direction| twin.falloff(direction)),
        Twin::Disk { radius, two_sided, .. } => {
            let sides = if two_sided { 2.0 } else { 1.0 };
            sides * PI * PI * radius * radius
        }
        Twin::Tube { ends: [a, b], radius } => PI * TAU * radius * (b - a).length(),
    }
}

/// Photons of a mixed scene that land on a floor bring the irradiance of light samples there.
#[test]
fn photons_bring_what_light_samples_bring() {
    let mut pcg = Pcg32::new(5, 148);
    // What leaves the inside of a hollow sphere has its outside in its way.
    let is_hollow = |kind: &Kind| matches!(kind.twin, Twin::Sphere { two_sided: true, .. });
    let lamps: Vec<Kind> = kinds(&mut pcg).into_iter().filter(|kind| !is_hollow(kind)).collect();
    let quad = [[2.0, 0.0, 2.0], [3.0, 0.0, 2.0], [2.0, 1.0, 2.0]].map(Vec3::from);
    let mut builder = LightSampler::builder();
    builder.add_mesh(&Mesh::emitter(&quad, &[[0, 2, 1]]).weight(Weight::Constant(1.0))).expect("a valid mesh");
    for kind in &lamps {
        builder.add_light(kind.lamp).expect("a valid lamp");
    }
    let lights = builder.build().expect("few lights");
    let emission: Emission<'_> = lights.emission();
    let height = -1.0;
    let landing = |origin: Vec3, direction: Vec3| {
        let t = (height - origin.z) / direction.z;
        let at = origin + t * direction;
        (t > 0.0 && at.x.abs() < 1.0 && at.y.abs() < 1.0).then_some(at)
    };
    let (mut photons, mut samples) = (Mean::default(), Mean::default());
    for _ in 0..400_000 {
        let ray = emission.sample(core::array::from_fn(|_| pcg.f32()));
        photons.add(ray.map_or(0.0, |ray| match landing(ray.position, ray.direction) {
            Some(_) => {
                let twin = ray.light.id().map(|id| lamps[id.index() as usize].twin);
                twin.map_or(1.0, |twin| twin.falloff(ray.direction.as_dvec3())) / f64::from(ray.pdf)
            }
            None => 0.0,
        }));
        let position = Vec3::new(2.0 * pcg.f32() - 1.0, 2.0 * pcg.f32() - 1.0, height);
        let x = ShadingPoint::surface(position, Vec3::Z);
        samples.add(
            4.0 * lights.at(&x).sample(pcg.cube()).map_or(0.0, |sample| match sample.light {
                SampledLight::Triangle(_) => weight(&x, sample.direction.as_dvec3()) / f64::from(sample.pdf),
                _ => brought(&lamps, &x, &sample),
            }),
        );
    }
    let error = photons.error().hypot(samples.error());
    let (a, b) = (photons.mean(), samples.mean());
    assert!((a - b).abs() < 4.0 * error && error < 0.02 * b, "{a} and {b} ± {error}");
}

/// What no lamp may be is an error that says which light and which value.
#[test]
fn bad_lamps_are_clear_errors() {
    let refuse = |lamp: Lamp, parts: &[&str]| {
        let mut builder = LightSampler::builder();
        builder.add_light(SphereLight::new(Vec3::ZERO, 1.0, 1.0)).expect("a valid lamp");
        let error: Error = builder.add_light(lamp).expect_err("an invalid lamp");
        let message = error.to_string();
        assert!(message.contains("light 1"), "{message}");
        parts.iter().for_each(|part| assert!(message.contains(part), "{message} does not say {part}"));
        // The builder is as it was before.
        assert_eq!(builder.add_light(SphereLight::new(Vec3::ZERO, 1.0, 1.0)).expect("valid").index(), 1);
    };
    let bad = [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-1.0, "-1")];
    for (value, name) in bad {
        refuse(SphereLight::new(Vec3::ZERO, value, 1.0).into(), &["radius", name]);
        refuse(SphereLight::new(Vec3::ZERO, 1.0, value).into(), &["radiance", name]);
    }
    refuse(SphereLight::new(Vec3::ZERO, 0.0, 1.0).into(), &["radius", "0"]);
    refuse(SphereLight::new(Vec3::new(0.0, f32::NAN, 0.0), 1.0, 1.0).into(), &["center", "NaN"]);
    refuse(SphereLight::new(Vec3::new(0.0, 0.0, -1e9), 1e6, 1.0).into(), &["center", "1e9"]);
    refuse(SphereLight::new(Vec3::ZERO, 1.0, 2e30).into(), &["radiance", "1e30"]);
    for (value, name) in bad {
        refuse(PointLight::new(Vec3::ZERO, value).into(), &["intensity", name]);
        refuse(SpotLight::new(Vec3::ZERO, Vec3::Z, value, [0.1, 0.2]).into(), &["intensity", name]);
        refuse(SpotLight::new(Vec3::ZERO, Vec3::Z, 1.0, [0.1, value]).into(), &["outer angle", name]);
        refuse(SpotLight::new(Vec3::ZERO, Vec3::Z, 1.0, [value, 0.2]).into(), &["inner angle", name]);
        refuse(DiskLight::new(Vec3::ZERO, Vec3::Z, value, 1.0).into(), &["radius", name]);
        refuse(DiskLight::new(Vec3::ZERO, Vec3::Z, 1.0, value).into(), &["radiance", name]);
        refuse(TubeLight::new([Vec3::ZERO, Vec3::Z], value, 1.0).into(), &["radius", name]);
        refuse(TubeLight::new([Vec3::ZERO, Vec3::Z], 1.0, value).into(), &["radiance", name]);
    }
    refuse(PointLight::new(Vec3::new(2e9, 0.0, 0.0), 1.0).into(), &["position", "2000000000"]);
    refuse(SpotLight::new(Vec3::ZERO, Vec3::ZERO, 1.0, [0.1, 0.2]).into(), &["axis", "0"]);
    refuse(SpotLight::new(Vec3::ZERO, Vec3::Z, 1.0, [0.3, 0.2]).into(), &["inner angle", "outer angle"]);
    refuse(SpotLight::new(Vec3::ZERO, Vec3::Z, 1.0, [0.3, 1.6]).into(), &["outer angle", "π/2"]);
    refuse(DiskLight::new(Vec3::ZERO, Vec3::splat(f32::NAN), 1.0, 1.0).into(), &["normal"]);
    refuse(TubeLight::new([Vec3::X, Vec3::X], 1.0, 1.0).into(), &["length", "0"]);
}

/// Lamps of every size, seen from every distance: nothing is NaN or infinite, densities agree, and nothing arrives from
/// what emits nothing.
#[test]
fn hostile_places_are_safe() {
    let mut pcg = Pcg32::new(11, 149);
    let mut drawn = 0;
    let sizes = [1e-15, 1e-6, 1e-3, 1.0, 1e3, 1e6, 2e8];
    let gaps = [0.0, 1e-12, 1e-7, 1e-3, 1.0, 1e6, 1e9];
    for size in sizes {
        for gap in gaps {
            for place in [Vec3::ZERO, Vec3::new(1e3, -2e3, 5e2), Vec3::splat(1e8)] {
                for kind in shapes(place, size) {
                    let lights = build(&[kind, sphere(place + 3.0 * size, size)]);
                    let away = pcg.direction();
                    let positions =
                        [place, place + (size + gap) * away, place + gap * away, place - (size + gap) * Vec3::Z];
                    for position in positions {
                        for receiver in receivers(&mut pcg) {
                            drawn += check_hostile(&lights, &ShadingPoint::new(position, receiver), &mut pcg);
                        }
                    }
                }
            }
        }
    }
    assert!(drawn > 10_000, "only {drawn} samples");
    for bad in [f32::NAN, f32::INFINITY, 1e20] {
        let lights = build(&kinds(&mut pcg));
        let at = lights.at(&ShadingPoint::volume(Vec3::splat(bad)));
        assert_eq!(at.sample([0.5; 3]), None);
        assert_eq!(at.pdf_direction(Vec3::Z), 0.0);
    }
}

/// Lamps of all kinds in a place and of a size.
fn shapes(place: Vec3, size: f32) -> Vec<Kind> {
    let ends = [place - 0.5 * size * Vec3::X, place + 0.5 * size * Vec3::X];
    let mut kinds = vec![
        sphere(place, size),
        hollow_sphere(place, size),
        point(place),
        spot(place, Vec3::Z, [0.1, 0.3]),
        disk(place, Vec3::Z, size, Sides::One),
        disk(place, Vec3::new(1.0, 2.0, 3.0), size, Sides::Two),
    ];
    // So far from the origin, the ends of a short tube are the same.
    if ends[0] != ends[1] {
        kinds.extend([tube(ends, (0.5 * size).max(1e-15)), tube(ends, (1e-5 * size).max(1e-15))]);
    }
    kinds
}

fn check_hostile(lights: &LightSampler, x: &ShadingPoint, pcg: &mut Pcg32) -> usize {
    let at = lights.at(x);
    let mut drawn = 0;
    for _ in 0..8 {
        let Some(sample) = at.sample(core::array::from_fn(|_| hostile(pcg))) else { continue };
        drawn += 1;
        let LightSample { position, normal, direction, distance, pdf, pdf_area, pmf, .. } = sample;
        assert!(position.is_finite() && distance > 0.0 && distance.is_finite(), "{x:?} {sample:?}");
        assert!((normal.length() - 1.0).abs() < 1e-4 && (direction.length() - 1.0).abs() < 1e-4, "{x:?} {sample:?}");
        assert!(pdf > 0.0 && pdf.is_finite() && pdf_area > 0.0 && pdf_area.is_finite(), "{x:?} {sample:?}");
        assert!(pmf > 0.0 && pmf <= 1.0, "{x:?} {sample:?}");
        assert_close(pdf_again(&at, &sample), pdf, &(x, sample));
        let along = at.pdf_sample_direction(&sample);
        assert!(along >= pdf * (1.0 - 1e-5) && along.is_finite(), "{along}: {x:?} {sample:?}");
        assert!(at.pdf_direction(direction).is_finite());
    }
    let emission = lights.emission();
    if let Some(ray) = emission.sample(core::array::from_fn(|_| hostile(pcg))) {
        assert!(ray.position.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-4, "{ray:?}");
        assert!(ray.pdf > 0.0 && ray.pdf.is_finite(), "{ray:?}");
        assert!(emission.pdf_sample_ray(&ray, x.position) >= ray.pdf);
    }
    drawn
}

/// What emits nothing is not in the tree.
#[test]
fn black_lamps_are_never_chosen() {
    let mut builder = LightSampler::builder();
    let black = builder.add_light(SphereLight::new(Vec3::Z, 0.5, 0.0)).expect("a valid lamp");
    let lit = builder.add_light(SphereLight::new(2.0 * Vec3::Z, 0.5, 1.0)).expect("a valid lamp");
    let lights = builder.build().expect("few lights");
    assert_eq!(lights.light_count(), 1);
    let at = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
    assert_eq!((at.pmf_light(black), at.pmf_light(lit)), (0.0, 1.0));
    assert_eq!(at.pdf_light(black, Vec3::Z), 0.0);
    assert_eq!(at.pmf_light(LightId::from_index(2)), 0.0);
    assert!(at.sample([0.5; 3]).is_some_and(|sample| sample.light == SampledLight::Shape(lit)));
    let one = LightSampler::builder().light(SphereLight::new(Vec3::Z, 0.5, 0.0)).expect("a valid lamp").build();
    assert_eq!(one.expect("no light").at(&ShadingPoint::volume(Vec3::ZERO)).sample([0.5; 3]), None);
}

/// Relative deviation of samples as a light grows: no step.
fn assert_gradual(what: &str, lights: impl Fn(f32) -> (LightSampler, Vec<Kind>), range: [f32; 2]) {
    let mut pcg = Pcg32::new(17, 150);
    let (steps, n) = (100, tier().histogram / 5);
    let ratio = (range[1] / range[0]).powf(1.0 / steps as f32);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let deviations: Vec<f64> = (0..=steps)
        .map(|i| {
            let (lights, twins) = lights(range[0] * ratio.powi(i));
            let at = lights.at(&x);
            let mut mean = Mean::default();
            for _ in 0..n {
                let sample = at.sample(pcg.cube());
                mean.add(sample.map_or(0.0, |sample| match sample.light {
                    SampledLight::Triangle(_) => weight(&x, sample.direction.as_dvec3()) / f64::from(sample.pdf),
                    _ => brought(&twins, &x, &sample),
                }));
            }
            mean.error() * (n as f64).sqrt() / mean.mean()
        })
        .collect();
    for (i, pair) in deviations.windows(2).enumerate() {
        let [low, high] = [pair[0].min(pair[1]), pair[0].max(pair[1])];
        assert!(high < 1.5 * low + 0.02, "{what}: from {} to {} at step {i}: {deviations:?}", pair[0], pair[1]);
    }
}

#[test]
fn variance_changes_gradually_with_the_size_of_a_light() {
    let floor = [[-1.0, -1.0, 3.0], [-1.0, 1.0, 3.0], [1.0, -1.0, 3.0]].map(Vec3::from);
    let with = |kinds: Vec<Kind>| {
        let mut builder = LightSampler::builder();
        builder.add_mesh(&Mesh::emitter(&floor, &[[0, 1, 2]])).expect("a valid mesh");
        kinds.iter().for_each(|kind| {
            builder.add_light(kind.lamp).expect("a valid lamp");
        });
        (builder.build().expect("few lights"), kinds)
    };
    let center = Vec3::new(0.4, 0.3, 11.0);
    assert_gradual("radius of a sphere", |radius| with(vec![sphere(center, radius)]), [1e-4, 10.0]);
    let row = |radius: f32| (0..20u8).map(|i| sphere(Vec3::new(f32::from(i) - 8.0, 2.0, 1.0), radius)).collect();
    assert_gradual("radius of twenty spheres", |radius| with(row(radius)), [1e-4, 0.9]);
    let x = |height: f32| Vec3::new(0.2, 0.1, height);
    assert_gradual("radius of a disk", |radius| with(vec![disk(x(1.0), Vec3::NEG_Z, radius, Sides::One)]), [1e-4, 1e3]);
    assert_gradual("height of a disk", |height| with(vec![disk(x(height), Vec3::NEG_Z, 1.0, Sides::One)]), [1e-4, 1e3]);
    let ends = |height: f32| [x(height) - Vec3::X, x(height) + Vec3::X];
    assert_gradual("radius of a tube", |radius| with(vec![tube(ends(1.0), radius)]), [1e-5, 0.9]);
    assert_gradual("angle of a spot", |angle| with(vec![spot(x(2.0), Vec3::NEG_Z, [0.0, angle])]), [0.15, 1.57]);
    assert_gradual("distance of a point", |height| with(vec![point(x(height))]), [1e-3, 1e3]);
    assert_gradual("height over a sphere", |gap| with(vec![sphere((0.1 + gap) * Vec3::Z, 0.1)]), [1e-4, 1e3]);
}

/// Lights that move, change their brightness or their kind: what is sampled is what a new build would sample, and
/// densities agree.
#[test]
fn lights_are_replaced_without_a_rebuild() {
    let mut pcg = Pcg32::new(19, 151);
    for number in 0..12 {
        let (mut lights, lamps) = mixed(&mut pcg, number);
        let before = lights.to_bytes();
        let same: Vec<_> = (0..).map(LightId::from_index).zip(&lamps).map(|(id, kind)| (id, kind.lamp)).collect();
        lights.refit_lights(&same).expect("valid updates");
        lights.refit(&[MeshUpdate::new(MeshId::from_index(0)).scaled(1.0)]).expect("a valid update");
        // Scales are kept once they were set; everything else is as before.
        let mut again = LightSampler::clone(&lights);
        again.refit(&[]).expect("no update");
        assert_eq!(again.to_bytes(), lights.to_bytes());
        assert!(lights.to_bytes().len() >= before.len());
        let moved: Vec<Kind> = (0..lamps.len().div_ceil(11)).flat_map(|_| kinds(&mut pcg)).collect();
        let shifted: Vec<_> = same.iter().zip(moved.iter().rev()).map(|((id, _), kind)| (*id, kind.lamp)).collect();
        lights.refit_lights(&shifted).expect("valid updates");
        assert!(lights.decay() > 0.0);
        let words = aligned(&lights.to_bytes());
        let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        for i in 0..60 {
            let x = ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()) - 0.5, receivers(&mut pcg)[i % 3]);
            let at = view.at(&x);
            for _ in 0..20 {
                let Some(sample) = at.sample(pcg.cube()) else { continue };
                assert_close(pdf_again(&at, &sample), sample.pdf, &(x, sample));
                assert_eq!(lights.at(&x).sample([0.5; 3]), at.sample([0.5; 3]));
            }
        }
    }
}

#[test]
fn lights_that_cannot_be_replaced_are_clear_errors() {
    let mut builder = LightSampler::builder();
    let lit = builder.add_light(SphereLight::new(Vec3::Z, 0.5, 1.0)).expect("a valid lamp");
    let black = builder.add_light(PointLight::new(Vec3::Z, 0.0)).expect("a valid lamp");
    let mut lights = builder.build().expect("few lights");
    let before = lights.to_bytes();
    let mut refuse = |id: LightId, lamp: Lamp, part: &str| {
        let error = lights.refit_lights(&[(lit, point(Vec3::X).lamp), (id, lamp)]).expect_err("no such light");
        assert!(error.to_string().contains(part), "{error}");
        assert_eq!(lights.to_bytes(), before);
    };
    refuse(LightId::from_index(2), point(Vec3::X).lamp, "light 2");
    refuse(black, point(Vec3::X).lamp, "light 1");
    refuse(lit, SphereLight::new(Vec3::Z, -1.0, 1.0).into(), "radius");
    // Switched off and on again.
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    lights.refit_lights(&[(lit, PointLight::new(Vec3::Z, 0.0).into())]).expect("a valid update");
    assert_eq!((lights.at(&x).sample([0.5; 3]), lights.emission().sample([0.5; 5])), (None, None));
    let words = aligned(&lights.to_bytes());
    LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    lights.refit_lights(&[(lit, PointLight::new(Vec3::Z, 2.0).into())]).expect("a valid update");
    assert!(lights.at(&x).sample([0.5; 3]).is_some_and(|sample| sample.light == SampledLight::Punctual(lit)));
}
