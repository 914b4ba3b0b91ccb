//! What moves against the same scene as it is at the time: densities and positions, irradiance by an integral in double
//! precision, normalization, histograms, agreement, photons, suns and media.

use crate::common::density::{OnTriangle, id, probes};
use crate::common::lights::ARITIES;
use crate::common::oracle;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Paint, Scene, Sky};
use crate::common::statistics::{Mean, chi_square, sidak};
use crate::common::tier::{agreement, some, tier};
use crate::instances::town::Town;
use crate::instances::{check_agreement, check_many, pmf, point, report};
use fanlight::{Arity, Hit, LightSample, LightSampler, PointSampler, RaySegment, ShadingPoint};
use glam::{Affine3A, Mat3, Quat, Vec3};

mod changes;
pub(crate) mod shutter;

use shutter::{KINDS, Moving, brought, lamp};

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;
/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;
/// Times at which what moves is exact in single precision as well.
const TIMES: [f32; 5] = [0.0, 0.5, 1.0, 0.25, 0.75];

fn close(a: f32, b: f32) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

/// A case of a test: a scene that moves, a time, and the scene at that time.
struct Case {
    number: usize,
    moving: Moving,
    time: f32,
    now: Town,
}

impl Case {
    fn new(number: usize, seed: u64, sky: usize, first: Option<usize>) -> (Self, Pcg32) {
        let mut pcg = Pcg32::new(number as u64, seed);
        let moving = Moving::random(&mut pcg, number % KINDS, number / KINDS % 2 == 0, sky);
        let moving = first.map_or(moving.clone(), |count| moving.first(count));
        let time = TIMES[number % TIMES.len()];
        let now = moving.at(time);
        (Self { number, moving, time, now }, pcg)
    }

    fn build(&self) -> LightSampler {
        self.moving.build(ARITIES[self.number % 3])
    }

    fn point(&self, pcg: &mut Pcg32, kind: usize) -> ShadingPoint {
        point(&self.now, pcg, kind).at_time(self.time)
    }
}

fn samples(at: &PointSampler<'_>, pcg: &mut Pcg32, count: usize) -> Vec<LightSample> {
    (0..count).filter_map(|_| at.sample(pcg.cube())).collect()
}

/// At each time a light is sampled as the light that stands where it is then, and from the same place.
#[test]
fn at_each_time_densities_are_those_of_what_stands_still() {
    let rounds = some(140);
    let compared = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        // Without bright features, which are no matter of single triangles.
        let (case, mut pcg) = Case::new(number, 301, [0, 1, 3][number % 3], None);
        let (lights, still) = (case.build(), case.now.build(ARITIES[number % 3]));
        assert!(lights.light_count() >= still.light_count());
        let mut compared = 0;
        for kind in 0..10 {
            let x = case.point(&mut pcg, kind);
            let (at, still_at) = (lights.at(&x), still.at(&x));
            for sample in samples(&at, &mut pcg, 20) {
                let hit = sample.hit().expect("a triangle");
                let [own, other] = [sample.pdf / sample.pmf, still_at.pdf(&hit) / pmf(&still_at, &hit)];
                // What stands still is in smaller clusters, which are dark more often.
                let is_dark = still_at.pdf(&hit) == 0.0 && brought(&case.now, &x, &sample) == 0.0;
                assert!(close(own, other) || is_dark, "{number} {x:?} {sample:?}: {own}, standing still {other}");
                let place = case.now.flat_position(&hit);
                let distance = (place - sample.position.as_dvec3()).length();
                assert!(distance < 1e-5 * (1.0 + place.length()), "{number} {sample:?} is not at {place}");
                compared += 1;
            }
            // What can be sampled where it stands still can be sampled where it moves.
            for sample in samples(&still_at, &mut pcg, 20) {
                let hit = sample.hit().expect("a triangle");
                assert!(at.pdf(&hit) > 0.0, "{number} {x:?} {sample:?}");
            }
        }
        compared
    });
    assert!(compared.iter().sum::<usize>() > 40 * rounds.len(), "{compared:?}");
}

#[test]
fn densities_agree_at_all_times() {
    let rounds = some(60);
    let drawn = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let (case, mut pcg) = Case::new(number, 302, number % 5, None);
        let lights = case.build();
        check_many(&lights, &mut pcg, agreement(rounds.len(), 2000), |pcg, kind| {
            // Any time, and beyond the interval.
            case.point(pcg, kind).at_time(pcg.within(-0.2, 1.2))
        })
    });
    assert!(report(&drawn) > 20 * rounds.len(), "{drawn:?}");
}

fn estimate(at: &PointSampler<'_>, pcg: &mut Pcg32, count: usize, value: impl Fn(&LightSample) -> f64) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..count {
        mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| value(&sample) / f64::from(sample.pdf)));
    }
    mean
}

fn irradiance(town: &Town, x: &ShadingPoint) -> f64 {
    oracle::over_lights(&town.flat, x, None, 1 << 20, &|m, t, b, direction| {
        oracle::sent(&town.flat, m, t, b, direction)
    })
}

#[test]
fn the_irradiance_is_that_of_an_integral_at_all_times() {
    let rounds = some(120);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let (case, mut pcg) = Case::new(number, 303, [0, 1, 3][number % 3], Some(3));
        let lights = case.build();
        let x = case.point(&mut pcg, number % 3);
        let mean = estimate(&lights.at(&x), &mut pcg, 20_000, |sample| brought(&case.now, &x, sample));
        (number, x, irradiance(&case.now, &x), mean)
    });
    let mut lit = 0;
    for (number, x, exact, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        // The integral is coarse where all but nothing is above the horizon.
        if exact < 2e-3 {
            continue;
        }
        assert!((mean - exact).abs() <= 4.5 * error + 4e-3 * exact, "{number} {x:?}: {mean} ± {error}, not {exact}");
        lit += 1;
    }
    assert!(3 * lit > rounds.len(), "only {lit} points are lit");
}

/// A lamp that turns by 60 degrees and goes by, far from the origin as well: its irradiance at each time and over the
/// interval.
#[test]
fn a_lamp_turns() {
    let found = parallel::map(4, |number| {
        let mut pcg = Pcg32::new(number as u64, 304);
        let far = [Vec3::ZERO, Vec3::new(1e6, -5e5, 0.0)][number % 2];
        let bend = [Mat3::IDENTITY, Mat3::from_diagonal(Vec3::new(1.0, -0.5, 2.0))][number / 2];
        let turn = |angle: f32, place| {
            Affine3A::from_mat3_translation(Mat3::from_quat(Quat::from_rotation_y(angle)) * bend, place)
        };
        let places = [(0, turn(-0.5, far), 2.0), (0, turn(0.55, far + Vec3::new(1.0, 0.0, 0.0)), 2.0)];
        let town = |place| Town::new(Scene::new("lamp", Vec::new()), vec![vec![lamp().two_sided()]], vec![place]);
        let moving = Moving { start: town(places[0]), end: town(places[1]) };
        let lights = moving.build(Arity::Four);
        let x = ShadingPoint::surface(far + Vec3::new(0.25, 0.5, 2.0), Vec3::new(0.3, 0.0, -1.0).normalize());
        let mut rows = Vec::new();
        let mut whole = Mean::default();
        let times = [0.0, 0.1, 0.5, 0.7, 1.0];
        for time in times {
            let now = moving.at(time);
            let x = x.at_time(time);
            check_agreement(&lights.as_view(), &x, &mut pcg, 20);
            let mean = estimate(&lights.at(&x), &mut pcg, 8_000, |sample| brought(&now, &x, sample));
            rows.push((irradiance(&now, &x), mean));
        }
        for _ in 0..8_000 {
            let time = times[pcg.below(times.len())];
            let sample = lights.at(&x.at_time(time)).sample(pcg.cube());
            let now = moving.at(time);
            whole.add(sample.map_or(0.0, |sample| brought(&now, &x, &sample) / f64::from(sample.pdf)));
        }
        let exact = rows.iter().map(|(exact, _)| exact).sum::<f64>() / times.len() as f64;
        rows.push((exact, whole));
        rows
    });
    for (number, rows) in found.iter().enumerate() {
        for (i, (exact, mean)) in rows.iter().enumerate() {
            let (error, mean) = (mean.error(), mean.mean());
            // Vertices far from the origin are rounded to a sixteenth in the scene that is compared with.
            let rounding = if number % 2 == 1 { 0.2 } else { 2e-3 };
            assert!(
                *exact > 0.0 && (mean - exact).abs() <= 4.5 * error + rounding * exact,
                "{number} {i}: {mean} {exact}"
            );
        }
    }
}

/// The densities of all points integrate to the share of samples that are no `None`.
#[test]
fn densities_integrate_to_the_rate_of_samples_at_all_times() {
    let rounds = some(21);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let (case, mut pcg) = Case::new(number, 305, number % 2, Some(2));
        let lights = case.build();
        let x = case.point(&mut pcg, number % 3);
        let at = lights.at(&x);
        let n = 4_000;
        let drawn = samples(&at, &mut pcg, n);
        let flat: Vec<LightSample> = drawn.iter().map(|sample| case.now.flat_sample(sample)).collect();
        let probes = probes(&case.now.flat, &flat);
        let pdf = |hit: &Hit| f64::from(at.pdf(&case.now.hit(hit)));
        let (mut sum, mut unresolved) = (0.0, 0.0);
        for triangle in case.now.flat.triangles() {
            let pmf = f64::from(pmf(&at, &case.now.hit(&Hit::new(id(triangle), [0.0; 2]))));
            if pmf > 1e-5 {
                let on = OnTriangle::new(&case.now.flat, triangle, &x, &pdf).coarser(10.0);
                let (whole, open) = on.integrate(0, 3, &probes[triangle.0][triangle.1]);
                (sum, unresolved) = (sum + whole[0], unresolved + open * open);
            }
        }
        (number, x, sum, unresolved.sqrt(), drawn.len() as f64 / n as f64, n as f64)
    });
    for (number, x, sum, unresolved, rate, n) in found {
        let error = 4.5 * (rate * (1.0 - rate) / n).sqrt() + 1e-4;
        assert!((sum - rate).abs() <= error + 5e-4 + unresolved, "{number} {x:?}: {sum} ± {unresolved}, not {rate}");
    }
}

/// Triangles are drawn as often as their probabilities say, and no other. All lights have two sides and the receivers no
/// horizon, so that every choice gives a sample, but for triangles that have no area at the time.
#[test]
fn histograms_over_triangles_are_the_probabilities_at_all_times() {
    let rounds = some(18);
    let count = tier().histogram;
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let (case, mut pcg) = Case::new(number, 306, number % 2, None);
        let moving = case.moving.two_sided();
        let case = Case { now: moving.at(case.time), moving, ..case };
        let lights = case.build();
        let x = case.point(&mut pcg, 1 + number % 2);
        let at = lights.at(&x);
        let triangles: Vec<_> = case.now.flat.triangles().collect();
        let hit = |triangle| case.now.hit(&Hit::new(id(triangle), [0.0; 2]));
        let expected: Vec<f64> =
            triangles.iter().map(|triangle| f64::from(pmf(&at, &hit(*triangle))) * count as f64).collect();
        let mut observed = vec![0.0; expected.len()];
        let mut none = 0;
        for _ in 0..count {
            let Some(sample) = at.sample(pcg.cube()) else {
                none += 1;
                continue;
            };
            let triangle = case.now.flat_hit(&sample.hit().expect("a triangle")).triangle;
            observed[triangles.iter().position(|other| id(*other) == triangle).expect("a triangle of the scene")] +=
                1.0;
        }
        (number, x, none, chi_square(&observed, &expected))
    });
    let limit = sidak(SIGNIFICANCE, found.len());
    let (all, mut compared) = (found.len(), 0);
    for (number, x, none, (p, table)) in found {
        if none == 0 {
            assert!(p >= limit, "{number} {x:?}: p {p}\n{table}");
            compared += 1;
        }
    }
    assert!(3 * compared >= 2 * all, "only {compared} histograms of {all} are compared");
}

/// A clip-mapped window that goes by, as a mesh or as an instance, under a sky with a sun.
fn window(number: usize, pcg: &mut Pcg32) -> Moving {
    let mut base = Scene::new("window", Vec::new());
    base.sky = Sky::random(pcg, 4);
    let mut image = crate::common::scene::Image::random(pcg, 1);
    image.filter = fanlight::Filter::Nearest;
    base.images.push(image);
    let paint = if number % 2 == 0 { Paint::Image(0) } else { Paint::Constant(0.5) };
    let quad = LightMesh::quad(Vec3::new(-0.5, -0.5, 0.0), Vec3::Y, Vec3::X).portal().paint(paint);
    let (way, grown) = (Vec3::new(0.5, -0.25, 0.25), Mat3::from_diagonal(Vec3::new(1.5, 1.0, 1.0)));
    if number / 2 % 2 == 0 {
        let town = |transform| Town::new(base.clone(), vec![vec![quad.clone()]], vec![(0, transform, 1.0)]);
        let end = Affine3A::from_mat3_translation(grown, way);
        return Moving { start: town(Affine3A::IDENTITY), end: town(end) };
    }
    let town = |mesh: LightMesh| {
        let base = Scene { meshes: vec![mesh], ..base.clone() };
        Town::new(base, Vec::new(), Vec::new())
    };
    let mut end = quad.clone();
    end.positions.iter_mut().for_each(|p| *p = grown * *p + way);
    Moving { start: town(quad.clone()), end: town(end) }
}

/// A sun behind windows that move: the irradiance at the time is that of an integral over the sky's pixels.
#[test]
fn suns_shine_through_what_moves() {
    let rounds = some(40);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 307);
        let (moving, time) = (window(number, &mut pcg), TIMES[number % 5]);
        let (lights, now) = (moving.build(ARITIES[number % 3]), moving.at(time));
        let position = Vec3::new(pcg.within(-0.5, 1.0), pcg.within(-0.5, 0.5), -pcg.within(0.2, 1.5));
        let x = ShadingPoint::surface(position, Vec3::new(0.2, 0.1, 1.0).normalize()).at_time(time);
        let arriving = |direction| oracle::through_portals(&now.flat, &x, direction);
        let exact = oracle::over_pixels(&now.flat, &x, 1 << 18, &arriving);
        check_agreement(&lights.as_view(), &x, &mut pcg, 50);
        let at = lights.at(&x);
        let mut mean = Mean::default();
        for _ in 0..10_000 {
            let sample = at.sample(pcg.cube());
            mean.add(sample.map_or(0.0, |sample| {
                let direction = sample.direction.as_dvec3();
                let value = oracle::cosine(&x.receiver, direction) * arriving(direction);
                value / f64::from(at.pdf_sample_direction(&sample))
            }));
        }
        (number, x, exact, mean)
    });
    for (number, x, exact, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        assert!((mean - exact).abs() <= 4.5 * error + 1e-2 * exact, "{number} {x:?}: {mean} ± {error}, not {exact}");
    }
}

/// Photons of a time bring the power of an integral, and their densities agree.
#[test]
fn photons_leave_at_their_time() {
    let rounds = some(20);
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 308);
        let moving = Moving::random(&mut pcg, number % 5, number % 2 == 0, [0, 1][number / 2 % 2]);
        let time = TIMES[number % 5];
        let (lights, now) = (moving.build(ARITIES[number % 3]), moving.at(time));
        let emission = lights.emission().at_time(time);
        // A floor far below, of which all is seen.
        let (height, side) = (-12.0f32, 16.0f32);
        let mut mean = Mean::default();
        for i in 0..20_000 {
            let ray = emission.sample(core::array::from_fn(|_| pcg.f32()));
            mean.add(ray.map_or(0.0, |ray| {
                let hit = ray.hit().expect("a triangle");
                if i % 4 == 0 {
                    let again = emission.pdf(&hit, ray.direction);
                    assert!(close(again, ray.pdf), "{number} {ray:?}: {again}");
                    let line = emission.pdf_sample_ray(&ray, ray.position + ray.direction);
                    assert!(line >= ray.pdf * 0.99999 && line.is_finite(), "{number} {ray:?}: {line}");
                }
                let t = (height - ray.position.z) / ray.direction.z;
                let landed = ray.position + t * ray.direction;
                if !(ray.direction.z < 0.0 && t > 0.0 && landed.truncate().abs().max_element() < 0.5 * side) {
                    return 0.0;
                }
                shutter::sent(&now, &hit, -ray.direction.as_dvec3()) / f64::from(ray.pdf)
            }));
        }
        let grid = 10;
        let cell = side / grid as f32;
        let irradiance = (0..grid * grid).map(|i| {
            let [s, t] = [i % grid, i / grid].map(|k| (k as f32 + 0.5) * cell - 0.5 * side);
            let x = ShadingPoint::surface(Vec3::new(s, t, height), Vec3::Z);
            // Enough that texels are resolved, as all points of the floor look at the same places of a light.
            oracle::over_lights(&now.flat, &x, None, 1 << 16, &|m, t, b, direction| {
                oracle::sent(&now.flat, m, t, b, direction)
            })
        });
        (number, irradiance.sum::<f64>() * f64::from(cell * cell), mean)
    });
    for (number, power, mean) in found {
        let (error, mean) = (mean.error(), mean.mean());
        assert!((mean - power).abs() <= 4.5 * error + 1e-2 * power, "{number}: {mean} ± {error}, not {power}");
    }
}

/// Distances along a segment at a time, through a window that moves: densities integrate to 1, and what is scattered in
/// is that of distances that are drawn evenly.
#[test]
fn segments_have_a_time() {
    for number in 0..4 {
        let mut pcg = Pcg32::new(number as u64, 309);
        let moving = window(number, &mut pcg);
        let lights = moving.build(Arity::Four);
        let (time, length) = ([1.0, 0.75][number % 2], 3.0);
        let segment = RaySegment::new(Vec3::new(-1.5, -0.2, -0.6), Vec3::X, length, 0.2).at_time(time);
        let along = lights.along(&segment);
        assert_eq!(segment.point(1.0).time(), time);
        let steps = 10_000;
        let width = length / steps as f32;
        let sum: f64 = (0..steps).map(|i| f64::from(along.pdf_distance((i as f32 + 0.5) * width) * width)).sum();
        assert!((sum - 1.0).abs() < 5e-3, "{number}: {sum}");
        let now = moving.at(time);
        let scattered = |distance: f32, sample: &LightSample| {
            let (x, direction) = (segment.point(distance), sample.direction.as_dvec3());
            let arriving = oracle::through_portals(&now.flat, &x, direction);
            arriving * f64::from(-0.2 * distance).exp() / f64::from(along.at(distance).pdf_sample_direction(sample))
        };
        let (mut own, mut even) = (Mean::default(), Mean::default());
        for _ in 0..4_000 {
            let [u, v] = [pcg.f32(), pcg.f32()];
            let sample = along.sample([u, v, pcg.f32(), pcg.f32()]);
            own.add(sample.map_or(0.0, |s| scattered(s.distance, &s.light) / f64::from(s.pdf_distance)));
            let distance = length * u;
            let sample = lights.at(&segment.point(distance)).sample(pcg.cube());
            even.add(sample.map_or(0.0, |sample| scattered(distance, &sample) * f64::from(length)));
        }
        let error = own.error().hypot(even.error());
        assert!((own.mean() - even.mean()).abs() < 4.5 * error, "{number}: {} {}", own.mean(), even.mean());
    }
}

/// What does not move is sampled as if nothing did, to the bit, whatever the time.
#[test]
fn what_stands_still_has_no_time() {
    let mut pcg = Pcg32::new(3, 310);
    let town = Town::random(&mut pcg, 1, true, 4);
    let (lights, moving) = (town.build(Arity::Eight), Moving { start: town.clone(), end: town.clone() });
    // Ends that are the starts are none.
    assert_eq!(moving.build(Arity::Eight).bytes(), lights.bytes());
    for kind in 0..20 {
        let (x, u) = (point(&town, &mut pcg, kind), pcg.cube());
        assert_eq!(lights.at(&x.at_time(0.7)).sample(u), lights.at(&x).sample(u));
    }
    let x = ShadingPoint::volume(Vec3::ZERO);
    let times = [f32::NAN, -3.0, 0.25, 1.0, 7.0, f32::INFINITY].map(|time| x.at_time(time).time());
    assert_eq!(times, [0.0, 0.0, 0.25, 1.0, 1.0, 1.0]);
}
