//! What moves against the same scene as it is at the time: densities and positions, irradiance by an integral in double
//! precision, normalization, histograms, agreement, photons, suns, media, bytes, refits and errors.

use crate::common::density::{OnTriangle, id, probes};
use crate::common::lights::{ARITIES, aligned};
use crate::common::oracle;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Paint, Scene, Sky};
use crate::common::statistics::{Mean, chi_square, sidak};
use crate::common::tier::{some, tier};
use crate::instances::town::Town;
use crate::instances::{check_agreement, pmf, point};
use fanlight::{
    Arity, Hit, Instance, InstanceId, LightSample, LightSampler, LightSamplerView, Mesh, MeshId, MeshUpdate,
    PointSampler, RaySegment, ShadingPoint, TriangleId,
};
use glam::{Affine3A, Mat3, Quat, Vec3};

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
        let mut drawn = 0;
        for kind in 0..10 {
            // Any time, and beyond the interval.
            let x = case.point(&mut pcg, kind).at_time(pcg.within(-0.2, 1.2));
            drawn += check_agreement(&lights.as_view(), &x, &mut pcg, 8);
        }
        drawn
    });
    assert!(drawn.iter().sum::<usize>() > 20 * rounds.len(), "{drawn:?}");
}

fn estimate(at: &PointSampler<'_>, pcg: &mut Pcg32, count: usize, value: impl Fn(&LightSample) -> f64) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..count {
        mean.add(at.sample(pcg.cube()).map_or(0.0, |sample| value(&sample) / f64::from(sample.pdf)));
    }
    mean
}

fn irradiance(town: &Town, x: &ShadingPoint) -> f64 {
    oracle::over_lights(&town.flat, x, None, 1 << 17, &|m, t, b, direction| {
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

/// A lamp that turns by 60 degrees and goes by, far from the origin as well: its irradiance at each time and over the interval.
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

/// Triangles are drawn as often as their probabilities say, and no other.
#[test]
fn histograms_over_triangles_are_the_probabilities_at_all_times() {
    let rounds = some(18);
    let count = tier().histogram;
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let (case, mut pcg) = Case::new(number, 306, number % 3, None);
        let lights = case.build();
        let x = case.point(&mut pcg, number % 3);
        let at = lights.at(&x);
        let triangles: Vec<_> = case.now.flat.triangles().collect();
        let hit = |triangle| case.now.hit(&Hit::new(id(triangle), [0.0; 2]));
        let expected: Vec<f64> =
            triangles.iter().map(|triangle| f64::from(pmf(&at, &hit(*triangle))) * count as f64).collect();
        let mut observed = vec![0.0; expected.len() + 1];
        for _ in 0..count {
            let index = at.sample(pcg.cube()).map_or(triangles.len(), |sample| {
                let triangle = case.now.flat_hit(&sample.hit().expect("a triangle")).triangle;
                triangles.iter().position(|other| id(*other) == triangle).expect("a triangle of the scene")
            });
            observed[index] += 1.0;
        }
        let none = observed.pop().expect("the last one");
        (number, x, none, chi_square(&observed, &expected))
    });
    let limit = sidak(SIGNIFICANCE, found.len());
    for (number, x, none, (p, table)) in found {
        // Where parts of triangles are below the horizon, samples are fewer than choices.
        if none < 1e-3 * count as f64 {
            assert!(p >= limit, "{number} {x:?}: p {p}\n{table}");
        }
    }
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
            oracle::over_lights(&now.flat, &x, None, 1 << 12, &|m, t, b, direction| {
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

/// Distances along a segment at a time, through a window that moves: densities integrate to 1, and what is scattered in is that
/// of distances that are drawn evenly.
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

/// A sampler comes back from its bytes, and what is changed in them is found or does no harm.
#[test]
fn bytes_hold_motion() {
    let (case, mut pcg) = Case::new(10, 311, 1, None);
    let lights = case.build();
    let words = aligned(&lights.to_bytes());
    let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    assert_eq!((view.light_count(), view.bytes()), (lights.light_count(), lights.bytes()));
    for kind in 0..20 {
        let (x, u) = (case.point(&mut pcg, kind).at_time(pcg.f32()), pcg.cube());
        assert_eq!(view.at(&x).sample(u), lights.at(&x).sample(u));
    }
    // The section of what few scenes have, where the ends are.
    let table = |i: usize| [words[6 + 4 * i], words[8 + 4 * i]];
    let sections = words[4] as usize;
    let tag = u32::from_ne_bytes(*b"XTRA");
    let own = (0..sections).position(|i| table(i)[0] == tag).expect("there is such a section");
    let start = 6 + 4 * sections + (0..own).map(|i| table(i)[1] as usize / 4).sum::<usize>();
    let length = table(own)[1] as usize / 4;
    let (mut refused, mut accepted) = (0, 0);
    for i in 0..tier().inputs {
        let mut changed = words.clone();
        let at = if i % 2 == 0 { start + pcg.below(length) } else { pcg.below(words.len()) };
        changed[at] = [pcg.u32(), u32::MAX, 0, changed[at] ^ 1 << pcg.below(32), 0x7fc0_0000][pcg.below(5)];
        match LightSamplerView::from_bytes(bytemuck::cast_slice(&changed)) {
            Err(_) => refused += 1,
            Ok(view) => {
                accepted += 1;
                let x = case.point(&mut pcg, accepted).at_time(pcg.f32());
                let at = view.at(&x);
                if let Some(sample) = at.sample(pcg.cube()) {
                    assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && at.pdf_sample_direction(&sample).is_finite());
                }
                let _ = view.emission().at_time(x.time()).sample([0.5; 5]);
            }
        }
    }
    assert!(refused > 30 && accepted > 100, "{refused} refused, {accepted} accepted");
}

/// What stood still moves after a refit, and the other way round, by the densities of a new build's lights.
#[test]
fn refits_change_what_moves() {
    parallel::map(10, |number| {
        let (case, mut pcg) = Case::new(number, 312, number % 3, None);
        let (moving, still) = (&case.moving, &case.moving.start);
        let mut lights = case.build();
        let bytes = lights.to_bytes();
        let meshes = |moves: bool| {
            let update = |i: usize| {
                let update = MeshUpdate::new(MeshId::from_index(i as u32));
                let (start, end) = (&still.base.meshes[i], &moving.end.base.meshes[i]);
                if moves {
                    update.moving(&start.positions, &end.positions, &start.indices)
                } else {
                    update.moved(&start.positions, &start.indices)
                }
            };
            (0..still.base.meshes.len()).map(update).collect::<Vec<_>>()
        };
        let instances = |moves: bool| {
            let instance = |i| if moves { moving.instance(i) } else { still.instance(i) };
            (0..still.instances.len()).map(|i| (InstanceId::from_index(i as u32), instance(i))).collect::<Vec<_>>()
        };
        lights.refit(&meshes(true)).expect("nothing has changed");
        lights.refit_instances(&instances(true)).expect("nothing has changed");
        assert_eq!(lights.to_bytes(), bytes, "a refit with nothing changed");

        lights.refit_instances(&instances(false)).expect("valid instances");
        lights.refit(&meshes(false)).expect("valid meshes");
        for kind in 0..4 {
            let (x, u) = (case.point(&mut pcg, kind), pcg.cube());
            assert_eq!(lights.at(&x.at_time(1.0)).sample(u), lights.at(&x.at_time(0.0)).sample(u));
            check_agreement(&lights.as_view(), &x, &mut pcg, 5);
        }
        // Nothing is left of what moved, but for a triangle that has an area only while it moves.
        let expected = still.build(ARITIES[number % 3]);
        let more = lights.light_count() - expected.light_count();
        assert_eq!(lights.bytes().lights, expected.bytes().lights + 48 * more);

        lights.refit(&meshes(true)).expect("valid meshes");
        lights.refit_instances(&instances(true)).expect("valid instances");
        assert_eq!(lights.to_bytes(), bytes, "a refit there and back");
    });
}

/// A triangle that is nothing but a line at some times: it sends nothing then, and something before and after.
#[test]
fn a_triangle_without_an_area_sends_nothing_at_that_time() {
    let start = [Vec3::ZERO, Vec3::Y, Vec3::X].map(|p| p + Vec3::Z);
    // The third vertex crosses the edge of the others: the triangle turns its other side.
    let end = [start[0], start[1], start[2] - 2.0 * Vec3::X];
    let mut builder = LightSampler::builder();
    builder.add_mesh(&Mesh::emitter(&start, &[[0, 1, 2]]).moving_to(&end)).expect("a valid mesh");
    // No area at the start.
    let line = [start[0], start[1], start[1]];
    builder.add_mesh(&Mesh::emitter(&line, &[[0, 1, 2]]).moving_to(&start)).expect("a valid mesh");
    let lights = builder.build().expect("few lights");
    assert_eq!(lights.light_count(), 2);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let count = |time: f32, x: ShadingPoint, mesh: u32| {
        let at = lights.at(&x.at_time(time));
        let drawn = (0..200).filter_map(|i| at.sample([(i as f32 + 0.5) / 200.0, 0.3, 0.4]));
        let id = TriangleId::new(MeshId::from_index(mesh), 0);
        drawn.filter(|sample| sample.hit().is_some_and(|hit| hit.triangle == id)).count()
    };
    assert!(count(0.0, x, 0) > 0 && count(0.3, x, 0) > 0 && count(0.3, x, 1) > 0);
    assert_eq!([count(0.5, x, 0), count(0.7, x, 0), count(0.0, x, 1)], [0; 3]);
    let above = ShadingPoint::surface(2.0 * Vec3::Z, Vec3::NEG_Z);
    assert!(count(0.7, above, 0) > 0);
    assert_eq!([count(0.3, above, 0), count(0.5, above, 0)], [0; 2]);
    assert!(lights.emission().at_time(0.5).sample([0.3; 5]).is_none_or(|ray| ray.pdf > 0.0));
}

/// A light that moves is in its groups at all times.
#[test]
fn groups_hold_for_what_moves() {
    let start = [Vec3::ZERO, Vec3::Y, Vec3::X].map(|p| p + Vec3::Z);
    let end = start.map(|p| p + Vec3::X);
    let mut builder = LightSampler::builder();
    let mesh = Mesh::emitter(&start, &[[0, 1, 2]]);
    builder.add_mesh(&mesh.moving_to(&end).groups(2)).expect("a valid mesh");
    let object = builder.add_object(&[mesh]).expect("a valid object");
    let lamp = Instance::new(object, Affine3A::IDENTITY).moving_to(Affine3A::from_translation(Vec3::Y)).groups(1);
    builder.add_instance(lamp).expect("a valid instance");
    let lights = builder.build().expect("few lights");
    for (groups, of_instance) in [(1, true), (2, false)] {
        for time in [0.0, 0.6, 1.0] {
            let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z).with_groups(groups).at_time(time);
            let at = lights.at(&x);
            for i in 0..20 {
                let sample = at.sample([i as f32 / 20.0, 0.3, 0.6]).expect("one is received");
                let hit = sample.hit().expect("a triangle");
                assert_eq!(hit.instance.is_some(), of_instance, "{x:?} {sample:?}");
                assert!(close(at.pdf(&hit), sample.pdf) && close(at.pdf_direction(sample.direction), sample.pdf));
            }
        }
    }
}

fn message(result: Result<impl core::fmt::Debug, fanlight::Error>) -> String {
    result.expect_err("it is refused").to_string()
}

#[test]
fn errors_name_what_cannot_move() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh::emitter(&positions, &[[0, 1, 2]]);
    let mut builder = LightSampler::builder();
    assert_eq!(
        message(builder.add_mesh(&mesh.moving_to(&positions[..2]))),
        "mesh 0: 2 vertices at the end of the shutter interval, but 3 at its start"
    );
    let far = [Vec3::ZERO, Vec3::splat(2e9), Vec3::Y];
    let text = message(builder.add_mesh(&mesh.moving_to(&far)));
    assert!(text.starts_with("mesh 0: vertex 1") && text.contains("2000000000"), "{text}");
    assert_eq!(
        message(builder.add_object(&[mesh, mesh.moving_to(&positions)])),
        "object 0: the vertices of mesh 1 move, but only the object's instances can"
    );
    let object = builder.add_object(&[mesh]).expect("a valid object");
    let still = Instance::new(object, Affine3A::IDENTITY);
    let cases = [
        (Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)), "cannot be inverted is 0.5"),
        (Affine3A::from_rotation_x(core::f32::consts::PI), "cannot be inverted is 0.5"),
        (Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0)), "condition number of the transform"),
        (Affine3A::from_scale(Vec3::new(1.0, -3.0, 1.0)), "cannot be inverted is 0.25"),
        (Affine3A::from_translation(Vec3::splat(2e9)), "largest coordinate is 2000000000"),
        (Affine3A::from_translation(Vec3::NAN), "NaN"),
    ];
    for (end, part) in cases {
        let text = message(builder.add_instance(still.moving_to(end)));
        assert!(text.starts_with("instance 0: ") && text.contains(part), "{text}: {part}");
    }
    // Nearly half a turn, and from small to large, are fine.
    builder.add_instance(still.moving_to(Affine3A::from_rotation_x(3.1))).expect("it can be inverted");
    builder.add_instance(still.moving_to(Affine3A::from_scale(Vec3::splat(1e3)))).expect("it can be inverted");
    let id = builder.add_mesh(&mesh).expect("a valid mesh");
    let mut lights = builder.build().expect("few lights");
    let bytes = lights.to_bytes();
    let text = message(lights.refit(&[MeshUpdate::new(id).moving(&positions, &positions[..1], &[[0, 1, 2]])]));
    assert!(text.starts_with("mesh 0: 1 vertices at the end"), "{text}");
    let mirrored = still.moving_to(Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    assert!(message(lights.refit_instances(&[(InstanceId::from_index(0), mirrored)])).contains("inverted is 0.5"));
    assert_eq!(lights.to_bytes(), bytes, "an error changes nothing");
}
