//! Where regions end, and how many of them there are.

use crate::common::lights::{ARITIES, aligned, build, sample_split};
use crate::common::oracle;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LightMesh, Paint, Scene, point_of_kind, random_point};
use crate::common::statistics::Mean;
use crate::common::tier::tier;
use fanlight::{
    LightSample, LightSampler, PointSampler, ShadingPoint, Splitting, Visibility, VisibilityLearner, VisibilityView,
};
use glam::{DVec3, Vec3, vec3};

use super::{ERRORS, assert_same, entries, learn};

/// Kinds of shading points: see [`point_of_kind`].
const KINDS: usize = 12;
/// Bytes of a node of the trees over regions, of a region's number, and of an entry.
const BYTES: [usize; 3] = [12, 4, 20];

/// All that a sampler says at a point, with all bits: floats are printed exactly, NaN and the sign of zero included.
fn says(at: &PointSampler<'_>, samples: &[LightSample], numbers: &[[f32; 3]]) -> String {
    let splitting = Splitting::new(0.7, 2);
    let densities = samples.iter().map(|sample| {
        let hit = sample.hit().expect("a triangle");
        let single = [at.pdf(&hit), at.pmf(hit.triangle), at.pdf_sample_direction(sample)];
        (single, at.pdf_direction(sample.direction), at.pdf_split(&hit, &splitting))
    });
    let drawn = numbers.iter().map(|u| (at.sample(*u), sample_split(at, *u, &splitting)));
    format!("{:?} {:?}", densities.collect::<Vec<_>>(), drawn.collect::<Vec<_>>())
}

/// A random scene, a table that was learned around the unit cube or at the points of `place`, and samples.
fn learned(number: usize, pcg: &mut Pcg32) -> (LightSampler, Visibility, Vec<LightSample>) {
    let content = Content { triangles: 60, textured: number % 2 == 0, sky: number % 5, two_sided: true };
    let scene = Scene::random(pcg, content);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let visibility = learn(&lights, 3000);
    let at = lights.at(&ShadingPoint::volume(Vec3::splat(0.5)));
    let samples: Vec<_> = (0..20).filter_map(|_| at.sample(pcg.cube())).take(8).collect();
    (lights, visibility, samples)
}

/// Returns the table without an outside: what is in no region is in the first one.
fn without_outside(visibility: &Visibility) -> Visibility {
    let bytes = visibility.to_bytes();
    let mut words = aligned(&bytes);
    // The sections of nodes, regions, keys and factors end the file, each with its length in the table before them.
    let length = |section: usize| words[(24 + 16 * section + 8) / 4] as usize / 4;
    let rest: usize = (2..5).map(length).sum();
    let range = words.len() - rest - length(1)..words.len() - rest;
    for node in words[range].chunks_exact_mut(3).filter(|node| node[0] == 4) {
        node.copy_from_slice(&[3, 0, 0]);
    }
    VisibilityView::from_bytes(bytemuck::cast_slice(&words)).expect("it is a table").to_owned()
}

/// Number of points, of those that `place` makes, at which a table changes anything.
fn changed(
    lights: &LightSampler,
    visibility: VisibilityView<'_>,
    samples: &[LightSample],
    pcg: &mut Pcg32,
    mut place: impl FnMut(usize, &mut Pcg32) -> ShadingPoint,
) -> usize {
    let known = lights.as_view().with_visibility(visibility).expect("it was learned here");
    let differs = |i: usize| {
        let x = place(i, pcg);
        let numbers = [pcg.cube(), pcg.cube(), pcg.cube()];
        says(&known.at(&x), samples, &numbers) != says(&lights.at(&x), samples, &numbers)
    };
    (0..5 * KINDS).map(differs).filter(|differs| *differs).count()
}

/// Outside of the box of all reports and a hundredth more, and for orientations without reports, every sample and every
/// density is that of the sampler without the table, bit for bit.
#[test]
fn points_outside_of_all_regions_are_sampled_as_without_a_table() {
    let mut pcg = Pcg32::new(12, 97);
    let (mut inside, mut told_apart) = (0, 0);
    for number in 0..9 {
        let (lights, visibility, samples) = learned(number, &mut pcg);
        let table = visibility.as_view();
        inside += changed(&lights, table, &samples, &mut pcg, |i, pcg| point_of_kind(pcg, i % KINDS));
        // Reports are in [-0.5, 1.5], and regions reach 0.02 beyond.
        let out = |i: usize, pcg: &mut Pcg32| {
            let mut x = point_of_kind(pcg, i % KINDS);
            for axis in 0..3 {
                if i & 1 << axis != 0 || i % 8 == axis {
                    let beyond = 1.021 + 10.0_f32.powf(pcg.within(-3.0, 4.0));
                    x.position[axis] = 0.5 + if pcg.below(2) == 0 { beyond } else { -beyond };
                }
            }
            x
        };
        assert_eq!(changed(&lights, table, &samples, &mut pcg, out), 0, "scene {number}");
        let boundless = without_outside(&visibility);
        told_apart += usize::from(changed(&lights, boundless.as_view(), &samples, &mut pcg, out) > 0);
        // Floors alone.
        let floor = |pcg: &mut Pcg32| ShadingPoint::surface(2.0 * Vec3::from(pcg.cube()) - 0.5, Vec3::Z);
        let point = |i: u64| floor(&mut Pcg32::new(i, 91));
        let of_floors = Visibility::learn(&lights.as_view(), 2000, point, super::wall).expect("nobody cancels");
        let table = of_floors.as_view();
        inside += changed(&lights, table, &samples, &mut pcg, |_, pcg| floor(pcg));
        let others = |i: usize, pcg: &mut Pcg32| {
            let normals = [Vec3::NEG_Z, Vec3::X, vec3(0.1, -0.8, 0.6), vec3(-0.8, 0.0, 0.6)];
            let position = floor(pcg).position;
            normals
                .get(i % 5)
                .map_or(ShadingPoint::volume(position), |normal| ShadingPoint::surface(position, normal.normalize()))
        };
        assert_eq!(changed(&lights, table, &samples, &mut pcg, others), 0, "scene {number}, other orientations");
    }
    // This test notices the table where there are regions, and a table that has no outside.
    assert!(inside > 9 * KINDS, "the table changes only {inside} points");
    assert!(told_apart > 4, "only {told_apart} tables without an outside are told apart");
}

/// Positions that are no numbers, or none that can be reached, are outside as well, and make no density NaN. Reports
/// from there are ignored.
#[test]
fn positions_that_are_not_finite_are_in_no_region() {
    let mut pcg = Pcg32::new(13, 97);
    for number in 0..6 {
        let (lights, visibility, samples) = learned(number, &mut pcg);
        let learner = VisibilityLearner::new(&lights.as_view());
        let mut counters = learner.counters();
        let hostile = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN];
        let place = |i: usize, pcg: &mut Pcg32| {
            let mut x = point_of_kind(pcg, i % KINDS);
            for axis in 0..3 {
                if i & 1 << axis != 0 || i % 8 == axis {
                    x.position[axis] = hostile[pcg.below(hostile.len())];
                }
            }
            x
        };
        let changed = changed(&lights, visibility.as_view(), &samples, &mut pcg, place);
        assert_eq!(changed, 0, "scene {number}");
        let known = lights.with_visibility(&visibility).expect("it was learned here");
        let before = counters.bytes();
        for i in 0..200 {
            let x = place(i, &mut pcg);
            let at = known.at(&x);
            for sample in &samples {
                let hit = sample.hit().expect("a triangle");
                let densities = [at.pdf(&hit), at.pmf(hit.triangle), at.pdf_sample_direction(sample)];
                assert!(densities.iter().all(|density| *density >= 0.0), "{x:?}: {densities:?}");
                if !x.position.is_finite() {
                    counters.report(&at, sample, 1.0);
                }
            }
            let drawn = at.sample(pcg.cube());
            assert!(drawn.is_none_or(|drawn| drawn.pdf > 0.0 && drawn.pmf > 0.0), "{x:?}: {drawn:?}");
        }
        assert_eq!(counters.bytes(), before, "scene {number}");
        // A normal alone that is no number.
        let x = ShadingPoint::surface(random_point(&mut pcg, 0).position, Vec3::NAN);
        let at = known.at(&x);
        assert!(samples.iter().all(|sample| at.pdf(&sample.hit().expect("a triangle")) >= 0.0));
    }
}

/// Largest coordinate of the country of 474 km.
const REACH: f32 = 237_000.0;
/// Middle of the lamp of 26 cm, in its house.
const LAMP: Vec3 = vec3(1000.3, -2000.6, 2.4);
const LAMP_SIDE: f32 = 0.26;

/// A country of 474 km with a hundred bright clouds, and in it one lamp of 26 cm.
fn country() -> Scene {
    let mut pcg = Pcg32::new(14, 97);
    let down =
        |middle: Vec3, side: f32| LightMesh::quad(middle - vec3(0.5, 0.5, 0.0) * side, side * Vec3::Y, side * Vec3::X);
    let mut meshes = vec![down(LAMP, LAMP_SIDE).paint(Paint::Constant(4.0))];
    for i in 0..100 {
        // Every other one is near the lamp.
        let reach = if i % 2 == 0 { REACH } else { 20_000.0 };
        let middle = vec3(pcg.within(-reach, reach), pcg.within(-reach, reach), pcg.within(800.0, 4000.0));
        meshes.push(down(middle, pcg.within(200.0, 2000.0)).paint(Paint::Constant(pcg.within(0.5, 2.0))));
    }
    Scene::new("country", meshes)
}

/// Whether a place is in the house of the lamp, of 6 x 6 x 3 m.
fn is_in_house(place: DVec3) -> bool {
    let from = (place - LAMP.as_dvec3()).abs();
    from.x < 3.0 && from.y < 3.0 && place.z < 3.0
}

/// The house hides what is outside of it, and a ridge at x = 0 the east from the west.
fn seen(x: &ShadingPoint, place: DVec3) -> f32 {
    let eye = x.position.as_dvec3();
    let through =
        if is_in_house(eye) { is_in_house(place) } else { !is_in_house(place) && (eye.x > 0.0) == (place.x > 0.0) };
    f32::from(u8::from(through))
}

/// Points on the ground: everywhere, or, for odd numbers, at all distances from the lamp.
fn ground(i: u64) -> ShadingPoint {
    let mut pcg = Pcg32::new(i, 101);
    if i % 2 == 0 {
        let [x, y] = [0, 1].map(|_| pcg.within(-REACH, REACH));
        return ShadingPoint::surface(vec3(x, y, 0.0), Vec3::Z);
    }
    let (sin, cos) = pcg.within(0.0, core::f32::consts::TAU).sin_cos();
    let distance = 10.0_f32.powf(pcg.within(-1.5, 5.2));
    ShadingPoint::surface(vec3(LAMP.x + distance * cos, LAMP.y + distance * sin, 0.0), Vec3::Z)
}

/// The stated bound: entries of three MiB, and 16,384 regions, each with two nodes of a tree and a number; the planes
/// around the reports of seven orientations come on top.
fn assert_bounded(visibility: &Visibility, max_bytes: usize) {
    const REGIONS: usize = 1 << 14;
    let [node, number, entry] = BYTES;
    assert!(visibility.region_count() <= REGIONS, "{} regions", visibility.region_count());
    assert!(entries(visibility) <= max_bytes / entry, "{} entries", entries(visibility));
    let limit = max_bytes + node * (2 * REGIONS + 7 * 13) + number * (REGIONS + 1) + 8;
    assert!(visibility.bytes() <= limit, "{} bytes of at most {limit}", visibility.bytes());
}

/// In a country of 474 km with a lamp of 26 cm, a table stays within its bounds, densities are those of the samples,
/// and what arrives is what an integral says, in the house and outside.
#[test]
fn a_small_lamp_in_a_large_country_is_learned_in_bounded_memory() {
    let scene = country();
    let lights = build(&scene, ARITIES[0]);
    let (rays, samples) = if tier().stride > 1 { (60_000, 20_000) } else { (3_000_000, 80_000) };
    let traced = |x: &ShadingPoint, sample: &LightSample| seen(x, sample.position.as_dvec3());
    let visibility = Visibility::learn(&lights.as_view(), rays, ground, traced).expect("nobody cancels");
    assert_bounded(&visibility, 3 << 20);
    // Rays decide about the number of regions, and not meters.
    assert!(visibility.region_count() as u64 <= rays / 24, "{} regions", visibility.region_count());
    println!("{rays} rays: {} regions, {} entries", visibility.region_count(), entries(&visibility));
    let known = lights.with_visibility(&visibility).expect("it was learned here");
    let mut pcg = Pcg32::new(15, 97);
    let (mut reach, mut drawn) = ([0; 2], 0);
    for i in 0..16 {
        let far = if i < 12 { pcg.within(0.0, 2.5) } else { pcg.within(4.0, 300.0) };
        let (sin, cos) = pcg.within(0.0, core::f32::consts::TAU).sin_cos();
        // The last ones are right below the lamp.
        let height = if i % 4 == 3 && i < 12 { 2.3 } else { 0.0 };
        let position = vec3(LAMP.x + far * cos, LAMP.y + far * sin, height);
        let x = ShadingPoint::surface(position, Vec3::Z);
        let exact = oracle::over_lights(&scene, &x, None, 1 << 17, &|m, t, b, direction| {
            let [a, p, q] = scene.meshes[m].vertices(t).map(|v| v.as_dvec3());
            let place = a + (p - a) * b[0] + (q - a) * b[1];
            oracle::sent(&scene, m, t, b, direction) * f64::from(seen(&x, place))
        });
        let (at, blind, mut mean) = (known.at(&x), lights.at(&x), Mean::default());
        for k in 0..samples {
            let u = pcg.cube();
            let Some(sample) = at.sample(u) else {
                mean.add(0.0);
                continue;
            };
            if k % 8 == 0 {
                let hit = sample.hit().expect("a triangle");
                assert_same(at.pdf(&hit), sample.pdf, "pdf");
                assert_same(at.pmf(hit.triangle), sample.pmf, "pmf");
                assert!(at.pdf_sample_direction(&sample) >= sample.pdf);
            }
            let hit = sample.hit().expect("a triangle").triangle;
            let Paint::Constant(radiance) = scene.meshes[hit.mesh.index() as usize].paint else { panic!("an image") };
            let arrives = traced(&x, &sample);
            drawn += 1;
            reach[0] += usize::from(blind.sample(u).is_some_and(|sample| traced(&x, &sample) > 0.0));
            reach[1] += usize::from(arrives > 0.0);
            mean.add(f64::from(radiance * x.cosine(sample.direction) * arrives) / f64::from(sample.pdf));
        }
        let (found, error) = (mean.mean(), mean.error());
        assert!((found - exact).abs() <= ERRORS * error + 1e-3 * exact, "{x:?}: {found} ± {error}, not {exact}");
        // Nothing was learned above the ground, so that the table may be wrong there: noise is the price.
        let most = if height > 0.0 { 0.1 } else { 0.03 };
        assert!(exact > 0.0 && error < most * exact, "{x:?}: {error} of {exact} tells nothing");
    }
    let [blind, known] = reach.map(|reach| reach as f64 / f64::from(drawn));
    println!("{blind} of the samples arrive without the table, {known} with it");
    // With many rays, the regions around the lamp must not be those that the limit of their number cuts.
    assert!(known > 0.85 && blind < 0.75, "{blind} without, {known} with");
}

/// With room for few entries, regions with few reports lose theirs first.
#[test]
fn what_is_seldom_asked_about_is_forgotten_first() {
    let scene = country();
    let lights = build(&scene, ARITIES[0]);
    let make = |max_bytes: usize| {
        let mut learner = VisibilityLearner::new(&lights.as_view()).max_bytes(max_bytes);
        let mut visibility = None;
        for pass in 0..12_u64 {
            let mut counters = learner.counters();
            for i in 0..8000 {
                // Nine of ten are near the lamp.
                let number = 8000 * pass + i;
                let x = ground(2 * number + u64::from(i % 10 != 0));
                let at = lights.at(&x);
                if let Some(sample) = at.sample(Pcg32::new(number, 102).cube()) {
                    counters.report(&at, &sample, seen(&x, sample.position.as_dvec3()));
                }
            }
            learner.merge(&counters).expect("it is of this learner");
            visibility = Some(learner.publish(&lights.as_view()).expect("the sampler is the same"));
        }
        visibility.expect("twelve passes")
    };
    let all = make(3 << 20);
    assert_bounded(&all, 3 << 20);
    // Fewer entries than there are regions.
    let kept = all.region_count() / 3;
    let few = make(kept * BYTES[2] + BYTES[2] - 1);
    assert_bounded(&few, (kept + 1) * BYTES[2]);
    assert!(kept > 8 && entries(&few) == kept, "{} entries of {}", entries(&few), entries(&all));
    // Points at which a table changes how probable the lamp is, far from it and near.
    let effect = |visibility: &Visibility| {
        let known = lights.with_visibility(visibility).expect("it was learned here");
        let mut counts = [0; 2];
        for i in 0..2000 {
            let x = ground(1_000_000 + i);
            let probable = |at: &PointSampler<'_>, u| at.sample(u).map(|sample| sample.pmf);
            let u = Pcg32::new(i, 103).cube();
            counts[i as usize % 2] += usize::from(probable(&known.at(&x), u) != probable(&lights.at(&x), u));
        }
        counts
    };
    let [[far, near], [far_kept, near_kept]] = [effect(&all), effect(&few)];
    println!(
        "{} regions, {} entries: {near} points near, {far} far; {kept} kept: {near_kept}, {far_kept}",
        all.region_count(),
        entries(&all)
    );
    let share = |kept: usize, all: usize| kept as f64 / all as f64;
    assert!(share(near_kept, near) > 2.0 * share(far_kept, far), "{near_kept} of {near}, {far_kept} of {far}");
}
