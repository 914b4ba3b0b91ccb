//! Light groups: what a point does not receive is never sampled and has the density zero, all else is as exact as ever,
//! and what is left out starves nothing.

use crate::common::hostile::hostile;
use crate::common::lights::{ARITIES, aligned, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::with_lobe;
use crate::common::statistics::{Mean, chi_square, sidak};
use crate::common::tier::agreement;
use crate::kinds::pdf_again;
use fanlight::{
    Arity, DistantLight, Environment, Filter, Hit, LightId, LightSample, LightSampler, LightSamplerView, Mesh, MeshId,
    PointLight, Profile, ProfileLight, Receiver, SampledLight, ShadingPoint, SphereLight, Splitting, TriangleId,
    Weight,
};
use glam::Vec3;

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;

/// Groups of all that is in a scene.
pub(crate) struct Groups {
    meshes: Vec<u32>,
    lamps: Vec<u32>,
    environment: u32,
}

impl Groups {
    fn of(&self, light: &SampledLight) -> u32 {
        match light {
            SampledLight::Triangle(hit) => self.meshes[hit.triangle.mesh.index() as usize],
            SampledLight::Environment => self.environment,
            SampledLight::Shape(id) | SampledLight::Punctual(id) => self.lamps[id.index() as usize],
            _ => panic!("another kind of light"),
        }
    }
}

/// Lights of all kinds in up to eight groups.
pub(crate) fn scene(number: usize, pcg: &mut Pcg32) -> (LightSampler, Groups) {
    let mut sky = vec![0.5; 32 * 32];
    if number % 3 == 0 {
        sky[9 * 32 + 12] = 1e4;
    }
    let environment = Environment::from_equal_area(32, &sky, Filter::Nearest).expect("valid");
    let environment_groups = 1 << pcg.below(3);
    let mut builder = LightSampler::builder().environment(environment).environment_groups(environment_groups);
    builder = builder.arity(ARITIES[number % 3]);
    if number % 2 == 0 {
        builder = builder.environment_as_light();
    }
    let mut groups = Groups { meshes: vec![], lamps: vec![], environment: environment_groups };
    // Few sets of groups, or one for nearly every light.
    let draw = |pcg: &mut Pcg32| if number % 4 < 2 { 1 << pcg.below(3) } else { pcg.u32() & 0xff };
    for i in 0..[3, 20, 60][number % 3] {
        let at = 2.0 * Vec3::from_array(pcg.cube());
        let positions = [at, at + 0.3 * pcg.direction(), at + 0.3 * pcg.direction()];
        let set = draw(pcg);
        let mesh = if i % 4 == 0 {
            Mesh::portal(&positions, &[[0, 1, 2]])
        } else {
            Mesh::emitter(&positions, &[[0, 1, 2]]).weight(Weight::Constant(1.0 + pcg.f32()))
        };
        builder.add_mesh(&mesh.groups(set)).expect("a valid mesh");
        groups.meshes.push(set);
    }
    let profile =
        Profile { vertical: &[0.0, 0.4, 1.1], horizontal: &[0.0, 2.0], intensities: &[3.0, 3.0, 1.0, 2.0, 0.0, 0.5] };
    let profile = builder.add_profile(&profile).expect("a valid profile");
    for i in 0..[2, 8, 45][number % 3] {
        let (at, set) = (2.0 * Vec3::from_array(pcg.cube()), draw(pcg));
        let added = match i % 5 {
            0 => builder.add_light_to(set, SphereLight::new(at, 0.1, 2.0)),
            1 => builder.add_light_to(set, PointLight::new(at, 1.0)),
            2 => builder.add_light_to(set, DistantLight::new(pcg.direction(), 0.5).angular_radius(0.2)),
            3 => builder.add_light_to(set, DistantLight::new(pcg.direction(), 0.2)),
            _ => builder.add_light_to(set, ProfileLight::new(at, pcg.direction(), profile, 1.0)),
        };
        added.expect("a valid light");
        groups.lamps.push(set);
    }
    (builder.build().expect("few lights"), groups)
}

fn point(i: usize, pcg: &mut Pcg32) -> ShadingPoint {
    let receiver =
        [Receiver::Surface(pcg.direction()), Receiver::Transmissive(pcg.direction()), Receiver::Volume][i % 3];
    let x = ShadingPoint::new(2.0 * Vec3::from_array(pcg.cube()), receiver);
    let x = if i % 4 == 3 { with_lobe(x, pcg, 1e-2) } else { x };
    x.with_groups([1, 3, 6, 0x80, u32::MAX, 0][i % 6])
}

/// Density of the light of a sample, looked up by its id, and the probability of the light.
fn again(lights: &LightSampler, x: &ShadingPoint, sample: &LightSample) -> (f32, f32) {
    let at = lights.at(x);
    match sample.light {
        SampledLight::Triangle(hit) => (at.pdf(&hit), at.pmf(hit.triangle)),
        SampledLight::Shape(id) => (at.pdf_light(id, sample.direction), at.pmf_light(id)),
        SampledLight::Punctual(id) => (at.pmf_light(id), at.pmf_light(id)),
        _ => (at.pdf_environment(sample.direction), 1.0),
    }
}

/// Lights of all kinds, profiles and distant lights among them, to points of all groups: what is found later is what a
/// sample says.
#[test]
fn densities_of_samples_are_found_again_for_all_groups() {
    let (scenes, points) = (24, 40);
    let found = parallel::map(scenes, |number| {
        let mut pcg = Pcg32::new(number as u64, 175);
        let (lights, groups) = scene(number, &mut pcg);
        let mut found = [0; 3];
        for i in 0..points {
            let x = point(i, &mut pcg);
            let at = lights.at(&x);
            for _ in 0..agreement(scenes * points, 1250) {
                let Some(sample) = at.sample(core::array::from_fn(|_| hostile(&mut pcg))) else { continue };
                let kind = match sample.light {
                    SampledLight::Triangle(_) => 0,
                    SampledLight::Environment => 1,
                    _ => 2,
                };
                found[kind] += 1;
                assert!(groups.of(&sample.light) & x.groups != 0, "{x:?} {sample:?}");
                let pdf = pdf_again(&at, &sample);
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-5, "{x:?} {sample:?} {pdf}");
                let along = at.pdf_sample_direction(&sample);
                assert!(along >= sample.pdf * (1.0 - 1e-5) && along.is_finite(), "{along}: {x:?} {sample:?}");
            }
        }
        found
    });
    let found = found.iter().fold([0, 0, 0], |sum: [u64; 3], found| core::array::from_fn(|i| sum[i] + found[i]));
    assert!(found.iter().all(|count| *count > 500), "{found:?} of triangles, the sky and lamps");
}

/// Samples are of lights that the point receives, their densities are found again, and are zero at points that do not
/// receive the light.
#[test]
fn what_is_not_received_is_never_sampled() {
    let (mut drawn, mut left_out) = (0, 0);
    for number in 0..12 {
        let mut pcg = Pcg32::new(number as u64, 171);
        let (lights, groups) = scene(number, &mut pcg);
        let words = aligned(&lights.to_bytes());
        let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        let splitting = Splitting::new(0.7, 2);
        let points: Vec<_> = (0..60).map(|i| point(i, &mut pcg)).collect();
        for x in &points {
            let at = lights.at(x);
            for _ in 0..20 {
                let u = pcg.cube();
                let sample = at.sample(u);
                assert_eq!(view.at(x).sample(u), sample);
                let Some(sample) = sample else { continue };
                drawn += 1;
                let set = groups.of(&sample.light);
                assert!(set & x.groups != 0, "{x:?} {sample:?}");
                let (pdf, _) = again(&lights, x, &sample);
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-5, "{x:?} {sample:?} {pdf}");
                let along = at.pdf_sample_direction(&sample);
                assert!(along >= sample.pdf * (1.0 - 1e-5) && along.is_finite());
                let elsewhere = x.with_groups(!set);
                let (pdf, pmf) = again(&lights, &elsewhere, &sample);
                let is_sky = sample.light == SampledLight::Environment;
                assert!(pdf == 0.0 && (pmf == 0.0 || is_sky), "{elsewhere:?} {sample:?}: {pdf} {pmf}");
                left_out += 1;
            }
            for sample in sample_split(&at, pcg.cube(), &splitting) {
                assert!(groups.of(&sample.light) & x.groups != 0);
                if let SampledLight::Triangle(hit) = sample.light {
                    assert!((at.pdf_split(&hit, &splitting) / sample.pdf - 1.0).abs() < 1e-5);
                }
            }
            if x.groups == 0 {
                assert_eq!((at.sample(pcg.cube()), at.pdf_direction(pcg.direction())), (None, 0.0));
            }
        }
        let queries: Vec<_> = points.iter().map(|x| (*x, pcg.cube())).collect();
        let mut many = vec![None; queries.len()];
        view.sample_many(&queries, &mut many);
        queries.iter().zip(many).for_each(|((x, u), sample)| assert_eq!(lights.at(x).sample(*u), sample));
    }
    assert!(drawn > 3_000 && left_out > 3_000, "{drawn} drawn");
}

/// Lights fall as their probabilities say, and these add up to 1 where all that is received is visible.
#[test]
fn lights_fall_as_their_probabilities_say() {
    let count = 8;
    for round in 0..count {
        let mut pcg = Pcg32::new(round, 172);
        let mut builder = LightSampler::builder().arity(ARITIES[round as usize % 3]);
        let sets: Vec<u32> = (0..200).map(|_| 1 << pcg.below(if round % 2 == 0 { 3 } else { 12 })).collect();
        for set in &sets {
            let at = 4.0 * Vec3::from_array(pcg.cube());
            let bright = if *set == 2 { 1e3 } else { 1.0 };
            builder.add_light_to(*set, SphereLight::new(at, 0.01, bright)).expect("a valid light");
        }
        let lights = builder.build().expect("few lights");
        let x = ShadingPoint::volume(Vec3::splat(1.7)).with_groups([1, 5, 2, u32::MAX][round as usize % 4]);
        let at = lights.at(&x);
        let pmfs: Vec<f64> = (0..200).map(|i| at.pmf_light(LightId::from_index(i)).into()).collect();
        assert!((pmfs.iter().sum::<f64>() - 1.0).abs() < 1e-5);
        sets.iter().zip(&pmfs).for_each(|(set, pmf)| assert_eq!(*pmf > 0.0, set & x.groups != 0));
        let n = 40_000;
        let mut observed = vec![0.0; 200];
        for _ in 0..n {
            let sample = at.sample(pcg.cube()).expect("spheres are visible from outside");
            observed[sample.light.id().expect("a sphere").index() as usize] += 1.0;
        }
        let expected: Vec<f64> = pmfs.iter().map(|pmf| pmf * f64::from(n)).collect();
        let (p, dump) = chi_square(&observed, &expected);
        assert!(p > sidak(SIGNIFICANCE, count as usize), "round {round}: p = {p:e}\n{dump}");
    }
}

/// Variance of the irradiance over that of a scene without the lights that are left out.
fn cost_of_others(arity: Arity, sets: u32) -> f64 {
    let mut pcg = Pcg32::new(u64::from(sets), 173);
    let places: Vec<[f32; 3]> = (0..3000).map(|_| pcg.cube()).collect();
    let build = |with_others: bool| {
        let mut builder = LightSampler::builder().arity(arity);
        for (i, at) in places.iter().enumerate() {
            // Dim ones everywhere; in one half of the scene, others a thousand times as bright among them.
            let is_other = i % 2 == 1;
            if !is_other || with_others {
                let at = Vec3::from_array(*at) * Vec3::new(if is_other { 0.5 } else { 1.0 }, 1.0, 1.0);
                let set = if is_other { 2 << (i as u32 / 2 % sets) } else { 1 };
                let intensity = if is_other { 1e3 } else { 1.0 };
                builder.add_light_to(set, PointLight::new(at, intensity)).expect("a valid light");
            }
        }
        builder.build().expect("few lights")
    };
    let [with, without] = [build(true), build(false)];
    let mut logs = Mean::default();
    for _ in 0..60 {
        let x = ShadingPoint::volume(Vec3::from_array(pcg.cube())).with_groups(1);
        let mut variance = |lights: &LightSampler| {
            let (at, mut mean, n) = (lights.at(&x), Mean::default(), 400);
            for _ in 0..n {
                let sample = at.sample(pcg.cube());
                mean.add(sample.map_or(0.0, |s| 1.0 / (f64::from(s.distance).powi(2) * f64::from(s.pdf))));
            }
            (mean.error() * f64::from(n).sqrt() / mean.mean()).powi(2)
        };
        logs.add((variance(&with) / variance(&without)).ln());
    }
    logs.mean().exp()
}

/// What is left out, and a thousand times as bright, is no reason for noise.
#[test]
fn nothing_starves_next_to_what_is_left_out() {
    for (arity, sets) in [(Arity::Sixteen, 1), (Arity::Sixteen, 2), (Arity::Eight, 1), (Arity::Four, 1)] {
        let ratio = cost_of_others(arity, sets);
        assert!(ratio < 1.5, "{arity:?}, {sets} other sets: variance grows by a factor of {ratio}");
    }
}

/// A bright feature through two windows is seen through the one that is received alone.
#[test]
fn features_are_seen_through_received_portals_alone() {
    let mut sky = vec![0.1; 64 * 64];
    // About upwards.
    sky[32 * 64 + 32] = 1e5;
    let environment = Environment::from_equal_area(64, &sky, Filter::Nearest).expect("valid");
    let window = |x: f32| [[x, -1.0, 1.0], [x + 1.0, -1.0, 1.0], [x + 1.0, 1.0, 1.0], [x, 1.0, 1.0]].map(Vec3::from);
    let indices = [[0, 2, 1], [0, 3, 2]];
    let mut builder = LightSampler::builder().environment(environment);
    for (i, x) in [-1.0, 0.0].into_iter().enumerate() {
        builder.add_mesh(&Mesh::portal(&window(x), &indices).groups(1 << i)).expect("a valid mesh");
    }
    let lights = builder.build().expect("few lights");
    let mut pcg = Pcg32::new(5, 174);
    for groups in [1, 2, 3, 4] {
        let mut seen = [0; 2];
        for _ in 0..400 {
            let position = Vec3::new(0.4 * pcg.f32() - 0.2, 0.0, 0.0);
            let x = ShadingPoint::surface(position, Vec3::Z).with_groups(groups);
            let at = lights.at(&x);
            let Some(sample) = at.sample(pcg.cube()) else { continue };
            let hit: Hit = sample.hit().expect("a portal");
            let mesh = hit.triangle.mesh.index();
            assert!(groups >> mesh & 1 != 0);
            seen[mesh as usize] += 1;
            assert!((at.pdf(&hit) / sample.pdf - 1.0).abs() < 1e-5);
        }
        assert_eq!(seen.map(|count| count > 0), [groups & 1 != 0, groups & 2 != 0]);
    }
}

/// Where every light is in all groups nothing is kept, and photons know of no groups.
#[test]
fn groups_change_nothing_else() {
    let positions = [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::ONE];
    let build = |groups: Option<u32>| {
        let mesh = Mesh::emitter(&positions, &[[0, 2, 1]]);
        let mut builder = LightSampler::builder();
        builder.add_mesh(&groups.map_or(mesh, |groups| mesh.groups(groups))).expect("a valid mesh");
        let lamp = PointLight::new(2.0 * Vec3::Z, 1.0);
        builder.add_light_to(groups.unwrap_or(u32::MAX), lamp).expect("a valid light");
        builder.build().expect("few lights")
    };
    let plain = build(None);
    assert_eq!(build(Some(u32::MAX)).to_bytes(), plain.to_bytes());
    let grouped = build(Some(4));
    let mut pcg = Pcg32::new(6, 175);
    for _ in 0..100 {
        let u = core::array::from_fn(|_| pcg.f32());
        assert_eq!(grouped.emission().sample(u), plain.emission().sample(u));
        let x = ShadingPoint::volume(Vec3::from_array(pcg.cube()));
        assert_eq!(grouped.at(&x).sample([u[0], u[1], u[2]]), plain.at(&x).sample([u[0], u[1], u[2]]));
        assert_eq!(grouped.at(&x.with_groups(3)).pmf(TriangleId::new(MeshId::from_index(0), 0)), 0.0);
    }
}
