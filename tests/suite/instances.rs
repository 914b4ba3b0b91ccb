//! Instances against the same scene flattened: conditional densities, irradiance by an integral in double precision,
//! normalization, histograms, agreement, noise, photons, suns, bytes, refits and errors.

use crate::common::density::{OnTriangle, id, probes};
use crate::common::hostile::{hostile, shading_point};
use crate::common::lights::{ARITIES, aligned, sample_split};
use crate::common::oracle;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Paint, Scene, Sky, with_lobe};
use crate::common::statistics::{Mean, chi_square, sidak};
use crate::common::tier::{agreement, some, tier};
use fanlight::{
    Arity, Hit, Instance, InstanceId, LightSample, LightSampler, LightSamplerView, Mesh, ObjectId, PointSampler,
    Receiver, ShadingPoint, Splitting, Weight,
};
use glam::{Affine3A, Mat3, Vec3};

pub(crate) mod town;
mod wall;

use town::{KINDS, Town, moved};

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;
/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;

fn close(a: f32, b: f32, tolerance: f64) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

/// A shading point of one of five kinds.
pub(crate) fn point(town: &Town, pcg: &mut Pcg32, kind: usize) -> ShadingPoint {
    let normal = pcg.direction();
    let receiver = [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][kind % 3];
    let x = ShadingPoint::new(town.place(pcg), receiver);
    if kind % 5 >= 3 { with_lobe(x, pcg, 0.1) } else { x }
}

/// The towns that tests look at, each with its sampler.
fn towns(rounds: &[usize], seed: u64, sky: impl Fn(usize) -> usize + Sync) -> Vec<(Town, Pcg32, usize)> {
    let make = |&number: &usize| {
        let mut pcg = Pcg32::new(number as u64, seed);
        let town = Town::random(&mut pcg, number % KINDS, number / KINDS % 2 == 0, sky(number));
        (town, pcg, number)
    };
    rounds.iter().map(make).collect()
}

fn samples(at: &PointSampler<'_>, pcg: &mut Pcg32, count: usize) -> Vec<LightSample> {
    (0..count).filter_map(|_| at.sample(pcg.cube())).collect()
}

/// Within a triangle, an instance is sampled as the flattened triangle is.
#[test]
fn conditional_densities_are_those_of_flattened_triangles() {
    let rounds = some(60);
    // Without bright features, which are no matter of single triangles.
    let all = towns(&rounds, 171, |number| [0, 1, 3][number % 3]);
    let found = parallel::map(all.len(), |i| {
        let (town, mut pcg, number) = all[i].clone();
        let arity = ARITIES[number % 3];
        let (lights, flat) = (town.build(arity), town.flat.build(arity));
        assert_eq!(lights.light_count(), flat.light_count());
        let mut compared = 0;
        for kind in 0..10 {
            let x = point(&town, &mut pcg, kind);
            let (at, flat_at) = (lights.at(&x), flat.at(&x));
            for sample in samples(&at, &mut pcg, 20) {
                let hit = sample.hit().expect("a triangle");
                // The tree over a texture is that of the object's order of vertices, and its mirror image is another.
                if town.is_mirrored(&hit) && town.is_textured() {
                    continue;
                }
                let hit = town.flat_hit(&hit);
                let [own, other] = [sample.pdf / sample.pmf, flat_at.pdf(&hit) / flat_at.pmf(hit.triangle)];
                assert!(close(own, other, TOLERANCE), "{number} {x:?} {sample:?}: {own}, flattened {other}");
                compared += 1;
            }
            // What the flattened scene can sample, the instances can.
            for sample in samples(&flat_at, &mut pcg, 20) {
                let hit = town.hit(&sample.hit().expect("a triangle"));
                assert!(at.pdf(&hit) > 0.0, "{number} {x:?} {sample:?}");
            }
        }
        compared
    });
    let compared: usize = found.iter().sum();
    assert!(compared > 40 * rounds.len(), "{compared} samples");
}

/// All densities of samples agree, those of rays and of split trees too.
pub(crate) fn check_agreement(lights: &LightSamplerView<'_>, x: &ShadingPoint, pcg: &mut Pcg32, count: usize) -> usize {
    check_some(lights, x, pcg, count, 1)
}

/// The density of each sample is found again. One of `every` samples is asked for all that [`check_agreement`] asks for;
/// the others come from hostile numbers.
fn check_some(lights: &LightSamplerView<'_>, x: &ShadingPoint, pcg: &mut Pcg32, count: usize, every: usize) -> usize {
    let at = lights.at(x);
    let splitting = Splitting::new(0.7, 2);
    let mut found = 0;
    for i in 0..count {
        let asks_all = i % every == 0;
        let u = if asks_all { pcg.cube() } else { core::array::from_fn(|_| hostile(pcg)) };
        if let Some(sample) = at.sample(u) {
            found += 1;
            let hit = sample.hit().expect("a triangle");
            assert!(close(at.pdf(&hit), sample.pdf, TOLERANCE), "{x:?} {sample:?}: {}", at.pdf(&hit));
            if asks_all {
                let pmf = pmf(&at, &hit);
                assert!(close(pmf, sample.pmf, TOLERANCE) || pmf > sample.pmf, "{x:?} {sample:?}: {pmf}");
                let along = at.pdf_sample_direction(&sample);
                let is_enough = along >= sample.pdf * (1.0 - TOLERANCE as f32) && along.is_finite();
                assert!(is_enough, "{x:?} {sample:?}: {along}");
                let mut many = [None];
                lights.sample_many(&[(*x, u)], &mut many);
                assert_eq!(many[0], Some(sample));
            }
        }
        if !asks_all {
            continue;
        }
        for sample in sample_split(&at, u, &splitting).iter().take(4) {
            let hit = sample.hit().expect("a triangle");
            let pdf = at.pdf_split(&hit, &splitting);
            assert!(close(pdf, sample.pdf, TOLERANCE), "{x:?} {sample:?}: {pdf}");
        }
    }
    found
}

/// Draws so many samples at points that are made by their numbers: ten, or one for every thousand samples. Where there
/// are many, few are asked for all densities. Returns how many samples are drawn, and how many of these are no `None`.
pub(crate) fn check_many(
    lights: &LightSampler,
    pcg: &mut Pcg32,
    count: usize,
    mut point: impl FnMut(&mut Pcg32, usize) -> ShadingPoint,
) -> [usize; 2] {
    let points = (count / 1000).max(10);
    let each = count.div_ceil(points);
    let every = if points > 10 { 40 } else { 1 };
    let mut found = 0;
    for number in 0..points {
        let x = point(pcg, number);
        found += check_some(&lights.as_view(), &x, pcg, each, every);
    }
    [points * each, found]
}

/// Prints how many samples were drawn in all rounds. Returns how many of them were no `None`.
pub(crate) fn report(drawn: &[[usize; 2]]) -> usize {
    let [drawn, found] = drawn.iter().fold([0; 2], |sum, [drawn, found]| [sum[0] + drawn, sum[1] + found]);
    println!("{drawn} samples, {} of them None: 0 mismatches above {TOLERANCE:e}", drawn - found);
    found
}

#[test]
fn densities_agree() {
    let rounds = some(60);
    let all = towns(&rounds, 172, |number| number % 5);
    let drawn = parallel::map(all.len(), |i| {
        let (town, mut pcg, number) = all[i].clone();
        let lights = town.build(ARITIES[number % 3]);
        check_many(&lights, &mut pcg, agreement(rounds.len(), 2500), |pcg, kind| point(&town, pcg, kind))
    });
    assert!(report(&drawn) > 30 * rounds.len(), "{drawn:?}");
}

/// What a sample brings of one light.
fn brought(town: &Town, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let hit = town.flat_hit(&sample.hit().expect("a triangle"));
    let (m, t) = (hit.triangle.mesh.index() as usize, hit.triangle.triangle as usize);
    let direction = sample.direction.as_dvec3();
    let sent = oracle::sent(&town.flat, m, t, hit.barycentrics.map(f64::from), direction);
    oracle::cosine(&x.receiver, direction) * sent
}

fn brought_flat(town: &Town, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let hit = sample.hit().expect("a triangle");
    let (m, t) = (hit.triangle.mesh.index() as usize, hit.triangle.triangle as usize);
    let direction = sample.direction.as_dvec3();
    oracle::cosine(&x.receiver, direction) * oracle::sent(&town.flat, m, t, hit.barycentrics.map(f64::from), direction)
}

fn check_irradiance(seed: u64, rounds: &[usize], sky: impl Fn(usize) -> usize + Sync) {
    let all = towns(rounds, seed, sky);
    let found = parallel::map(all.len(), |i| {
        let (town, mut pcg, number) = all[i].clone();
        // Few, so that the integral has many points on each triangle.
        let town = town.first(3);
        let lights = town.build(ARITIES[number % 3]);
        let x = point(&town, &mut pcg, number % 3);
        let exact = oracle::over_lights(&town.flat, &x, None, 1 << 18, &|m, t, b, direction| {
            oracle::sent(&town.flat, m, t, b, direction)
        });
        let at = lights.at(&x);
        let mut mean = Mean::default();
        for _ in 0..20_000 {
            let sample = at.sample(pcg.cube());
            mean.add(sample.map_or(0.0, |sample| brought(&town, &x, &sample) / f64::from(sample.pdf)));
        }
        (number, x, exact, mean)
    });
    let mut lit = 0;
    for (number, x, exact, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        // The integral is coarse where all but nothing is above the horizon.
        if exact < 2e-3 {
            continue;
        }
        assert!((mean - exact).abs() <= 4.5 * error + 4e-3 * exact, "{number} {x:?}: {mean} ± {error}, not {exact}");
        lit += usize::from(exact > 0.0);
    }
    assert!(3 * lit > rounds.len(), "only {lit} points are lit");
}

#[test]
fn the_irradiance_is_that_of_an_integral() {
    check_irradiance(173, &some(120), |number| [0, 1, 3][number % 3]);
}

/// The probabilities of all triangles add up to that of a choice, and the densities of all points integrate to the
/// share of samples that are no `None`.
#[test]
fn densities_integrate_to_the_rate_of_samples() {
    let rounds = some(30);
    let all = towns(&rounds, 174, |number| number % 2);
    let found = parallel::map(all.len(), |i| {
        let (town, mut pcg, number) = all[i].clone();
        let town = town.first(2);
        let lights = town.build(ARITIES[number % 3]);
        let x = point(&town, &mut pcg, number % 3);
        let at = lights.at(&x);
        let n = 4_000;
        let drawn = samples(&at, &mut pcg, n);
        let flat: Vec<LightSample> = drawn.iter().map(|sample| town.flat_sample(sample)).collect();
        let probes = probes(&town.flat, &flat);
        let pdf = |hit: &Hit| f64::from(at.pdf(&town.hit(hit)));
        let (mut sum, mut unresolved, mut chosen) = (0.0, 0.0, 0.0);
        for triangle in town.flat.triangles() {
            let pmf = f64::from(pmf(&at, &town.hit(&Hit::new(id(triangle), [0.0; 2]))));
            chosen += pmf;
            if pmf > 1e-5 {
                let on = OnTriangle::new(&town.flat, triangle, &x, &pdf).coarser(10.0);
                let (whole, open) = on.integrate(0, 3, &probes[triangle.0][triangle.1]);
                (sum, unresolved) = (sum + whole[0], unresolved + open * open);
            }
        }
        (number, x, [sum, chosen], unresolved.sqrt(), drawn.len() as f64 / n as f64, n as f64)
    });
    for (number, x, [sum, chosen], unresolved, rate, n) in found {
        let error = 4.5 * (rate * (1.0 - rate) / n).sqrt() + 1e-4;
        assert!((sum - rate).abs() <= error + 5e-4 + unresolved, "{number} {x:?}: {sum} ± {unresolved}, not {rate}");
        assert!(chosen <= 1.0 + 1e-5 && chosen >= rate - error, "{number} {x:?}: {chosen}, not {rate}");
    }
}

/// Probability of a triangle.
pub(crate) fn pmf(at: &PointSampler<'_>, hit: &Hit) -> f32 {
    match hit.instance {
        Some(instance) => at.pmf_within(instance, hit.triangle),
        None => at.pmf(hit.triangle),
    }
}

/// Triangles are drawn as often as their probabilities say.
#[test]
fn histograms_over_triangles_are_the_probabilities() {
    let rounds = some(36);
    let all = towns(&rounds, 175, |number| number % 3);
    let count = tier().histogram;
    let found = parallel::map(all.len(), |i| {
        let (town, mut pcg, number) = all[i].clone();
        let lights = town.build(ARITIES[number % 3]);
        let x = point(&town, &mut pcg, number % 3);
        let at = lights.at(&x);
        let triangles: Vec<_> = town.flat.triangles().collect();
        let expected = triangles.iter().map(|triangle| {
            let hit = town.hit(&Hit::new(id(*triangle), [0.0; 2]));
            f64::from(pmf(&at, &hit))
        });
        let mut expected: Vec<f64> = expected.map(|pmf| pmf * count as f64).collect();
        let mut observed = vec![0.0; expected.len() + 1];
        for _ in 0..count {
            let index = at.sample(pcg.cube()).map_or(triangles.len(), |sample| {
                let triangle = town.flat_hit(&sample.hit().expect("a triangle")).triangle;
                triangles.iter().position(|other| id(*other) == triangle).expect("a triangle of the scene")
            });
            observed[index] += 1.0;
        }
        // The probability of a triangle counts points below the horizon of which no sample comes: only what was drawn
        // counts.
        let none = observed.pop().expect("the last one");
        let drawn: f64 = expected.iter().sum();
        expected.push((count as f64 - drawn).max(0.0));
        observed.push(none);
        (number, x, none, chi_square(&observed, &expected))
    });
    let limit = sidak(SIGNIFICANCE, found.len());
    let (all, mut compared) = (found.len(), 0);
    for (number, x, none, (p, table)) in found {
        // Where parts of triangles are below the horizon, samples are fewer than choices.
        if none == 0.0 {
            assert!(p >= limit, "{number} {x:?}: p {p}\n{table}");
            compared += 1;
        }
    }
    assert!(5 * compared >= all, "only {compared} histograms of {all} are compared");
}

/// Relative variance of the estimate at a point, without visibility.
fn noise(lights: &LightSampler, x: &ShadingPoint, pcg: &mut Pcg32, value: &dyn Fn(&LightSample) -> f64) -> (f64, f64) {
    let at = lights.at(x);
    let mut mean = Mean::default();
    let n = 1500;
    for _ in 0..n {
        mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| value(&sample) / f64::from(sample.pdf)));
    }
    (mean.mean(), mean.error().powi(2) * f64::from(n))
}

/// The noise of instances, relative to that of the flattened scene, on the whole.
#[test]
fn instances_are_about_as_noisy_as_flattened_scenes() {
    let found = parallel::map(KINDS, |number| {
        let mut pcg = Pcg32::new(number as u64, 176);
        let kind = number % KINDS;
        let lamp = vec![town::soup(&mut pcg, 60)];
        let instances = (0..40).map(|_| (0, town::transform(kind.min(4), &mut pcg), 1.0)).collect();
        let town = Town::new(Scene::new("lamps", Vec::new()), vec![lamp], instances);
        let (lights, flat) = (town.build(Arity::Sixteen), town.flat.build(Arity::Sixteen));
        let mut sums = [0.0; 2];
        for i in 0..10 {
            let x = point(&town, &mut pcg, i);
            let (mean, own) = noise(&lights, &x, &mut pcg, &|sample| brought(&town, &x, sample));
            let (_, other) = noise(&flat, &x, &mut pcg, &|sample| brought_flat(&town, &x, sample));
            if mean > 0.0 {
                // Means of logarithms: no single point decides.
                sums[0] += (own / (mean * mean) + 1e-3).ln();
                sums[1] += (other / (mean * mean) + 1e-3).ln();
            }
        }
        (kind, (sums[0] - sums[1]) / 10.0)
    });
    for kind in 0..KINDS {
        let ratios: Vec<f64> = found.iter().filter(|(k, _)| *k == kind).map(|(_, ratio)| *ratio).collect();
        let ratio = (ratios.iter().sum::<f64>() / ratios.len() as f64).exp();
        println!("kind {kind}: {ratio:.3}");
        assert!(ratio < 1.3, "kind {kind}: {ratio} times the variance");
    }
}

/// Windows of one clip map under a sky with a sun, each an instance.
fn windows(pcg: &mut Pcg32, count: usize, kind: usize) -> Town {
    let mut base = Scene::new("windows", Vec::new());
    base.sky = Sky::random(pcg, 4);
    let mut image = crate::common::scene::Image::random(pcg, 1);
    image.filter = fanlight::Filter::Nearest;
    base.images.push(image);
    let paint = if pcg.below(2) == 0 { Paint::Image(0) } else { Paint::Constant(0.5) };
    let window = LightMesh::quad(Vec3::new(-0.5, -0.5, 0.0), Vec3::Y, Vec3::X).portal().paint(paint);
    let stretch = [Mat3::IDENTITY, Mat3::from_diagonal(Vec3::new(0.5, 2.0, 1.0)), Mat3::from_diagonal(-Vec3::ONE)];
    let row = (count as f32).sqrt().ceil() as usize;
    let instances = (0..count).map(|i| {
        let place = Vec3::new((i % row) as f32 * 1.5, (i / row) as f32 * 2.5, 0.0);
        (0, Affine3A::from_mat3_translation(stretch[kind % 3], place), 1.0)
    });
    Town::new(base, vec![vec![window]], instances.collect())
}

/// A sun behind instanced windows: the irradiance is that of an integral over the sky's pixels, with the densities of
/// directions.
#[test]
fn suns_shine_through_instances() {
    let rounds = some(45);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 177);
        let town = windows(&mut pcg, [1, 4, 9][number / 3 % 3], number);
        let lights = town.build(ARITIES[number % 3]);
        // In front of the windows, which face down unless they are mirrored at the origin.
        let front = if number % 3 == 2 { 1.0 } else { -1.0 };
        let position = Vec3::new(pcg.within(-0.5, 3.0), pcg.within(-0.5, 3.0), front * pcg.within(0.2, 1.5));
        let x = ShadingPoint::surface(position, Vec3::new(0.2, 0.1, -front).normalize());
        let exact = oracle::over_pixels(&town.flat, &x, 1 << 19, &|direction| {
            oracle::through_portals(&town.flat, &x, direction)
        });
        check_agreement(&lights.as_view(), &x, &mut pcg, 100);
        let at = lights.at(&x);
        let mut mean = Mean::default();
        for _ in 0..30_000 {
            let sample = at.sample(pcg.cube());
            mean.add(sample.map_or(0.0, |sample| {
                let direction = sample.direction.as_dvec3();
                let arriving = oracle::through_portals(&town.flat, &x, direction);
                oracle::cosine(&x.receiver, direction) * arriving / f64::from(at.pdf_sample_direction(&sample))
            }));
        }
        (number, x, exact, mean)
    });
    for (number, x, exact, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        assert!((mean - exact).abs() <= 4.5 * error + 1e-2 * exact, "{number} {x:?}: {mean} ± {error}, not {exact}");
    }
}

/// Photons from instances bring the power of an integral, and their densities agree.
#[test]
fn photons_bring_the_power_of_an_integral() {
    let rounds = some(24);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 178);
        let town = Town::random(&mut pcg, number % 5, number % 2 == 0, [0, 1][number / 2 % 2]);
        let lights = town.build(ARITIES[number % 3]);
        let emission = lights.emission();
        // A floor far below, of which all is seen.
        let (height, side) = (-12.0f32, 16.0f32);
        let mut mean = Mean::default();
        for _ in 0..40_000 {
            let ray = emission.sample(core::array::from_fn(|_| pcg.f32()));
            mean.add(ray.map_or(0.0, |ray| {
                let hit = ray.hit().expect("a triangle");
                let again = emission.pdf(&hit, ray.direction);
                assert!(close(again, ray.pdf, TOLERANCE), "{number} {ray:?}: {again}");
                let t = (height - ray.position.z) / ray.direction.z;
                let landed = ray.position + t * ray.direction;
                if !(ray.direction.z < 0.0 && t > 0.0 && landed.truncate().abs().max_element() < 0.5 * side) {
                    return 0.0;
                }
                let flat = town.flat_hit(&hit);
                let (m, t) = (flat.triangle.mesh.index() as usize, flat.triangle.triangle as usize);
                oracle::sent(&town.flat, m, t, flat.barycentrics.map(f64::from), -ray.direction.as_dvec3())
                    / f64::from(ray.pdf)
            }));
        }
        let grid = 10;
        let cell = side / grid as f32;
        let irradiance = (0..grid * grid).map(|i| {
            let [s, t] = [i % grid, i / grid].map(|k| (k as f32 + 0.5) * cell - 0.5 * side);
            let x = ShadingPoint::surface(Vec3::new(s, t, height), Vec3::Z);
            oracle::over_lights(&town.flat, &x, None, 1 << 13, &|m, t, b, direction| {
                oracle::sent(&town.flat, m, t, b, direction)
            })
        });
        let power = irradiance.sum::<f64>() * f64::from(cell * cell);
        (number, power, mean)
    });
    for (number, power, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        assert!((mean - power).abs() <= 4.5 * error + 1e-2 * power, "{number}: {mean} ± {error}, not {power}");
    }
}

/// Places and maps of all sizes: no panic, no NaN, and densities agree.
#[test]
fn extreme_maps_and_places() {
    let scales = [1e-6f32, 1e-3, 1.0, 1e3, 1e6];
    parallel::map(scales.len() * 5, |number| {
        let mut pcg = Pcg32::new(number as u64, 179);
        let scale = scales[number % 5];
        let bend = [
            Mat3::IDENTITY,
            Mat3::from_diagonal(Vec3::new(1.0, 1e-5, 1.0)),
            Mat3::from_diagonal(Vec3::new(-1.0, 1e-3, 2.0)),
            Mat3::from_cols(Vec3::X, Vec3::new(3e2, 1.0, 0.0), Vec3::Z),
            pcg.rotation(),
        ][number / 5];
        let place = [Vec3::ZERO, Vec3::new(1e8, 0.0, -1e8)][number % 2];
        let transform = Affine3A::from_mat3_translation(scale * bend, place);
        let lamp = vec![LightMesh::soup(&mut pcg, 30, 0.4), LightMesh::soup(&mut pcg, 10, 1e-4).portal()];
        let mut base = Scene::new("extreme", Vec::new());
        base.sky = Sky::random(&mut pcg, number % 5);
        let town = Town::new(base, vec![lamp], vec![(0, transform, 1.0), (0, moved(Vec3::ONE), 0.5)]);
        let lights = town.build(ARITIES[number % 3]);
        for i in 0..60 {
            let x = match i % 3 {
                0 => point(&town, &mut pcg, i),
                1 => ShadingPoint::volume(transform.transform_point3(Vec3::from(pcg.cube()))),
                _ => shading_point(i, &town.flat, &mut pcg),
            };
            if x.position.abs().max_element() <= 1e9 {
                check_agreement(&lights.as_view(), &x, &mut pcg, 5);
            }
        }
    });
}

/// A sampler comes back from its bytes, and what is changed in them is found or does no harm.
#[test]
fn bytes_hold_instances() {
    let mut pcg = Pcg32::new(1, 180);
    let town = Town::random(&mut pcg, 4, true, 1);
    let lights = town.build(Arity::Eight);
    let words = aligned(&lights.to_bytes());
    let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    assert_eq!(view.light_count(), lights.light_count());
    assert_eq!(view.bytes(), lights.bytes());
    for kind in 0..20 {
        let (x, u) = (point(&town, &mut pcg, kind), pcg.cube());
        assert_eq!(view.at(&x).sample(u), lights.at(&x).sample(u));
    }
    let (mut refused, mut accepted) = (0, 0);
    for _ in 0..tier().inputs {
        let mut changed = words.clone();
        let at = pcg.below(changed.len());
        changed[at] = [pcg.u32(), u32::MAX, 0, changed[at] ^ 1 << pcg.below(32), 0x7fc0_0000][pcg.below(5)];
        match LightSamplerView::from_bytes(bytemuck::cast_slice(&changed)) {
            Err(_) => refused += 1,
            Ok(view) => {
                accepted += 1;
                let x = point(&town, &mut pcg, accepted);
                let at = view.at(&x);
                if let Some(sample) = at.sample(pcg.cube()) {
                    assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && at.pdf_sample_direction(&sample).is_finite());
                }
                let _ = view.emission().sample([0.5; 5]);
            }
        }
    }
    assert!(refused > 30 && accepted > 100, "{refused} refused, {accepted} accepted");
}

/// Moved instances are sampled as those of a new build, by densities that integrate and agree.
#[test]
fn instances_move() {
    parallel::map(12, |number| {
        let mut pcg = Pcg32::new(number as u64, 181);
        let before = Town::random(&mut pcg, number % 5, true, number % 3);
        let mut lights = before.build(ARITIES[number % 3]);
        let bytes = lights.to_bytes();
        let id = |i: usize| InstanceId::from_index(i as u32);
        let same: Vec<_> = (0..before.instances.len()).map(|i| (id(i), before.instance(i))).collect();
        lights.refit_instances(&same).expect("nothing has changed");
        assert_eq!(lights.to_bytes(), bytes, "a refit with nothing changed");

        let mut instances = before.instances.clone();
        for (i, (_, transform, scale)) in instances.iter_mut().enumerate() {
            *transform = town::transform((number + i) % 5, &mut pcg);
            *scale = [1.0, 0.25, 0.0][i % 3];
        }
        let after = before.with(instances);
        let updates: Vec<_> = (0..after.instances.len()).map(|i| (id(i), after.instance(i))).collect();
        lights.refit_instances(&updates).expect("valid instances");
        for kind in 0..8 {
            let x = point(&after, &mut pcg, kind);
            check_agreement(&lights.as_view(), &x, &mut pcg, 10);
            for sample in samples(&lights.at(&x), &mut pcg, 10) {
                let hit = sample.hit().expect("a triangle");
                let instance = hit.instance.map(|instance| instance.index() as usize);
                assert!(instance.is_none_or(|i| after.instances[i].2 > 0.0), "{sample:?} is switched off");
                let position = after.flat_position(&hit);
                let distance = (position - sample.position.as_dvec3()).length();
                assert!(distance < 1e-5 * (1.0 + position.length()), "{sample:?} is not at {position}");
            }
        }
        lights.refit_instances(&same).expect("valid instances");
        assert_eq!(lights.to_bytes(), bytes, "a refit there and back");
    });
}

fn message(result: Result<impl core::fmt::Debug, fanlight::Error>) -> String {
    result.expect_err("it is refused").to_string()
}

#[test]
fn errors_name_the_instance_and_the_value() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let lamp = Mesh::emitter(&positions, &[[0, 1, 2]]);
    let mut builder = LightSampler::builder();
    assert_eq!(message(builder.add_object(&[])), "object 0 has no triangles");
    assert_eq!(message(builder.add_object(&[Mesh::emitter(&positions, &[])])), "object 0 has no triangles");
    let bad = Mesh::emitter(&positions, &[[0, 1, 7]]);
    assert_eq!(
        message(builder.add_object(&[lamp, bad])),
        "object 0: mesh 1: triangle 0 uses vertex 7, but there are 3"
    );
    let weight = message(builder.add_object(&[lamp.weight(Weight::Constant(-1.0))]));
    assert!(weight.contains("object 0") && weight.contains("mesh 0") && weight.contains("-1"), "{weight}");
    let unknown = Instance::new(ObjectId::from_index(3), Affine3A::IDENTITY);
    assert_eq!(message(builder.add_instance(unknown)), "instance 0: object 3 was never added, this builder has 0");
    let object = builder.add_object(&[lamp]).expect("a valid object");
    let place = |linear: Mat3, translation| Instance::new(object, Affine3A::from_mat3_translation(linear, translation));
    builder.add_instance(place(Mat3::IDENTITY, Vec3::Z)).expect("a valid instance");
    let flat = Mat3::from_diagonal(Vec3::new(1.0, 1.0, 0.0));
    let cases = [
        (place(flat, Vec3::ZERO), ["condition", "at most 1e6"]),
        (place(Mat3::ZERO, Vec3::ZERO), ["condition", "at most 1e6"]),
        (place(Mat3::from_diagonal(Vec3::new(1.0, 1.0, 1e-7)), Vec3::ZERO), ["condition", "at most 1e6"]),
        (place(1e-13 * Mat3::IDENTITY, Vec3::ZERO), ["scale", "at most 1e12"]),
        (place(Mat3::IDENTITY, Vec3::new(0.0, f32::NAN, 0.0)), ["NaN", "finite"]),
        (place(f32::INFINITY * Mat3::IDENTITY, Vec3::ZERO), ["element", "finite"]),
        (place(Mat3::IDENTITY, Vec3::splat(2e9)), ["largest coordinate is 2000000000", "1e9"]),
        (place(Mat3::IDENTITY, Vec3::ZERO).scaled(f32::NAN), ["factor of the weights is NaN", "from 0 to 1e30"]),
        (place(Mat3::IDENTITY, Vec3::ZERO).scaled(-1.0), ["factor of the weights is -1", "from 0 to 1e30"]),
    ];
    for (instance, parts) in cases {
        let text = message(builder.add_instance(instance));
        assert!(text.starts_with("instance 1: ") && parts.iter().all(|part| text.contains(part)), "{text}");
    }
    let mut lights = builder.build().expect("a valid scene");
    assert_eq!(lights.light_count(), 1);
    let first = InstanceId::from_index(0);
    let bytes = lights.to_bytes();
    assert_eq!(
        message(lights.refit_instances(&[(InstanceId::from_index(4), place(Mat3::IDENTITY, Vec3::Z))])),
        "instance 4 was never added or has been removed, this sampler has 1"
    );
    let text =
        message(lights.refit_instances(&[(first, place(Mat3::IDENTITY, Vec3::ONE)), (first, place(flat, Vec3::Z))]));
    assert!(text.starts_with("instance 0: ") && text.contains("condition"), "{text}");
    let text = message(lights.refit_instances(&[(first, unknown)]));
    assert_eq!(text, "instance 0: it is one of object 3 now, but was added as one of object 0");
    assert_eq!(lights.to_bytes(), bytes, "an error changes nothing");
}

/// Objects without light, without instances, and black ones do no harm.
#[test]
fn dark_objects_are_no_lights() {
    let positions = [Vec3::Z, Vec3::Z + Vec3::Y, Vec3::Z + Vec3::X];
    let lamp = Mesh::emitter(&positions, &[[0, 1, 2]]);
    let mut builder = LightSampler::builder();
    let object = builder.add_object(&[lamp]).expect("a valid object");
    assert_eq!(builder.build().expect("a valid scene").light_count(), 0, "an object without instances");

    let mut builder = LightSampler::builder();
    let black = builder.add_object(&[lamp.weight(Weight::Constant(0.0))]).expect("a valid object");
    let flat = builder.add_object(&[Mesh::emitter(&[Vec3::X; 3], &[[0, 1, 2]])]).expect("a valid object");
    for object in [black, flat] {
        builder.add_instance(Instance::new(object, Affine3A::IDENTITY)).expect("a valid instance");
    }
    let lights = builder.build().expect("a valid scene");
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    assert_eq!((lights.light_count(), lights.at(&x).sample([0.5; 3])), (0, None));
    let words = aligned(&lights.to_bytes());
    LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");

    // Switched off from the start, and on later.
    let mut builder = LightSampler::builder();
    builder.add_object(&[lamp]).expect("a valid object");
    let off = Instance::new(object, Affine3A::IDENTITY).scaled(0.0);
    let id = builder.add_instance(off).expect("a valid instance");
    let mut lights = builder.build().expect("a valid scene");
    assert_eq!((lights.light_count(), lights.at(&x).sample([0.5; 3])), (1, None));
    assert_eq!(lights.emission().sample([0.5; 5]), None);
    lights.refit_instances(&[(id, off.scaled(2.0))]).expect("it was added");
    assert!(lights.at(&x).sample([0.5; 3]).is_some() && lights.emission().sample([0.5; 5]).is_some());
}

/// A mirror image shines to the outside, as the object does, and numbers its vertices as the object does.
#[test]
fn the_front_of_a_mirror_image_is_the_image_of_the_front() {
    let positions = [Vec3::ZERO, Vec3::Y, Vec3::X];
    let mut builder = LightSampler::builder();
    // Faces down.
    let object = builder.add_object(&[Mesh::emitter(&positions, &[[0, 1, 2]])]).expect("a valid object");
    let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
    let above = Affine3A::from_mat3_translation(mirror, Vec3::Z);
    let id = builder.add_instance(Instance::new(object, above)).expect("a valid instance");
    let lights = builder.build().expect("a valid scene");
    let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
    let sample = here.sample([0.3, 0.2, 0.6]).expect("it shines down");
    let hit = sample.hit().expect("a triangle");
    assert_eq!((hit.instance, sample.normal), (Some(id), Vec3::NEG_Z));
    let [b1, b2] = hit.barycentrics;
    let position = above.transform_point3(Vec3::Y * b1 + Vec3::X * b2);
    assert!((position - sample.position).length() < 1e-6, "{sample:?} is not at {position}");
    assert!(lights.at(&ShadingPoint::surface(2.0 * Vec3::Z, Vec3::NEG_Z)).sample([0.3; 3]).is_none());
}
