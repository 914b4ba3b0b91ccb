//! Learned visibility: any table, a hostile one included, leaves samples unbiased and densities exact.

use crate::common::hostile::{hostile, random_scene, shading_point, shading_point_with_lobe};
use crate::common::lights::{ARITIES, aligned, build, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LightMesh, Scene, Sky, random_point};
use crate::common::statistics::{chi_square, sidak};
use crate::common::tier::{agreement, few, some, tier};
use fanlight::{
    Arity, Environment, Filter, LightSample, LightSampler, LightSamplerView, Mesh, SampledLight, ShadingPoint,
    Splitting, Visibility, VisibilityCounters, VisibilityLearner, VisibilityView,
};
use glam::Vec3;

mod regions;

/// Largest relative difference of two densities of one point.
const TOLERANCE: f32 = 1e-5;
/// Standard errors that two estimates may be apart: a significance of 1e-6 a comparison.
const ERRORS: f64 = 4.9;

/// What the factors of a table are replaced by.
#[derive(Clone, Copy, Debug)]
enum Hostile {
    Random,
    Floor,
    One,
    /// Factors of at least a sixteenth.
    Moderate,
    /// Only one of many lanes is believed to be visible.
    Spikes,
}

const HOSTILE: [Hostile; 4] = [Hostile::Random, Hostile::Floor, Hostile::One, Hostile::Spikes];

/// A wall through the middle of the unit cube hides about half of everything.
fn wall(x: &ShadingPoint, sample: &LightSample) -> f32 {
    f32::from(u8::from((x.position.x > 0.5) == (sample.position.x > 0.5)))
}

/// Learns a little at points around the unit cube.
fn learn(lights: &LightSampler, rays: u64) -> Visibility {
    let point = |i: u64| random_point(&mut Pcg32::new(i, 91), i as usize);
    Visibility::learn(&lights.as_view(), rays, point, wall).expect("nobody cancels")
}

/// Returns the table with other factors: they are the last section.
fn with_factors(visibility: &Visibility, kind: Hostile, pcg: &mut Pcg32) -> Visibility {
    let mut bytes = visibility.to_bytes();
    let count = 16 * entries(visibility);
    let start = bytes.len() - count;
    for byte in &mut bytes[start..] {
        *byte = match kind {
            Hostile::Random => pcg.below(256) as u8,
            Hostile::Floor => 0,
            Hostile::One => 255,
            Hostile::Moderate => 63 + pcg.below(193) as u8,
            Hostile::Spikes => {
                if pcg.below(20) == 0 {
                    255
                } else {
                    0
                }
            }
        };
    }
    VisibilityView::from_bytes(bytemuck::cast_slice(&aligned(&bytes))).expect("any factors are valid").to_owned()
}

/// Number of entries of a table, by the length of the section of its factors.
fn entries(visibility: &Visibility) -> usize {
    let bytes = visibility.to_bytes();
    // A header of 24 bytes, and a table of five sections of 16 bytes each: tag, version, length.
    let length = &bytes[24 + 4 * 16 + 8..][..8];
    usize::try_from(u64::from_ne_bytes(length.try_into().expect("eight bytes"))).expect("it is in memory") / 16
}

#[track_caller]
fn assert_same(found: f32, expected: f32, what: &str) {
    let difference = (found - expected).abs();
    assert!(difference <= TOLERANCE * expected.abs(), "{what}: {found} instead of {expected}");
}

/// Samples of a random scene with a hostile table are found again by every density.
fn examine(number: usize) {
    let mut pcg = Pcg32::new(number as u64, 92);
    let scene = random_scene(number, &mut pcg);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let learned = learn(&lights, 400);
    let splitting = Splitting::new(0.7, 2);
    for kind in HOSTILE {
        let visibility = with_factors(&learned, kind, &mut pcg);
        let view = lights.with_visibility(&visibility).expect("it was learned here");
        let mut queries = Vec::new();
        for i in 0..8 {
            let make = if i % 2 == 0 { shading_point } else { shading_point_with_lobe };
            let x = if i < 4 { random_point(&mut pcg, i) } else { make(number + i, &scene, &mut pcg) };
            let at = view.at(&x);
            for _ in 0..agreement(60 * 8 * HOSTILE.len(), 125) {
                let u = core::array::from_fn(|_| hostile(&mut pcg));
                queries.push((x, u));
                let Some(sample) = at.sample(u) else { continue };
                let hit = sample.hit().expect("a triangle");
                assert_same(at.pdf(&hit), sample.pdf, "pdf");
                assert_same(at.pmf(hit.triangle), sample.pmf, "pmf");
                assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && sample.pmf > 0.0);
                assert!(at.pdf_sample_direction(&sample) >= sample.pdf);
            }
            for sample in sample_split(&at, pcg.cube(), &splitting).iter().take(8) {
                assert_same(at.pdf_split(&sample.hit().expect("a triangle"), &splitting), sample.pdf, "split");
            }
        }
        // Many at once are the same.
        let mut samples = vec![None; queries.len()];
        view.sample_many(&queries, &mut samples);
        for ((x, u), sample) in queries.iter().zip(&samples) {
            assert_eq!(*sample, view.at(x).sample(*u));
        }
    }
}

#[test]
fn densities_are_those_of_the_samples_for_any_table() {
    let scenes = some(60);
    parallel::map(scenes.len(), |i| examine(scenes[i]));
}

/// Mean and variance of the mean of what samples bring, and the rate of samples that are not `None`.
fn estimate(lights: &LightSamplerView<'_>, x: &ShadingPoint, count: usize, pcg: &mut Pcg32) -> [f64; 3] {
    let at = lights.at(x);
    let (mut sum, mut squares, mut drawn) = (0.0, 0.0, 0.0);
    for _ in 0..count {
        if let Some(sample) = at.sample(pcg.cube()) {
            let value = f64::from(x.cosine(sample.direction)) / f64::from(sample.pdf) * f64::from(wall(x, &sample));
            (sum, squares, drawn) = (sum + value, squares + value * value, drawn + 1.0);
        }
    }
    let count = count as f64;
    let mean = sum / count;
    [mean, (squares / count - mean * mean) / count, drawn / count]
}

/// The irradiance by samples with any table is that without one. Factors as small as 1.5e-5 make so much noise that a
/// mean over thousands of samples falls short of what a few rare ones bring; so tables are compared whose noise can be
/// seen through. What the others do to densities is in the tests around this one.
#[test]
fn estimates_are_unbiased_for_any_table() {
    let scenes = few(125);
    parallel::map(scenes.len(), |i| {
        let number = scenes[i];
        let mut pcg = Pcg32::new(number as u64, 93);
        let content = Content { triangles: 40, textured: number % 2 == 0, sky: number % 5, two_sided: number % 3 == 0 };
        let scene = Scene::random(&mut pcg, content);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        let learned = learn(&lights, 2000);
        for kind in [None, Some(Hostile::Floor), Some(Hostile::One), Some(Hostile::Moderate)] {
            let visibility = kind.map_or_else(|| learned.clone(), |kind| with_factors(&learned, kind, &mut pcg));
            let view = lights.with_visibility(&visibility).expect("it was learned here");
            for i in 0..3 {
                let x = random_point(&mut pcg, i);
                let [blind, blind_variance, _] = estimate(&lights.as_view(), &x, 20_000, &mut pcg);
                let [mean, variance, _] = estimate(&view, &x, 20_000, &mut pcg);
                let limit = ERRORS * (variance + blind_variance).sqrt() + 1e-6 * blind;
                assert!((mean - blind).abs() <= limit, "{}: {mean}, {blind} without, {kind:?}", scene.name);
            }
        }
    });
}

/// Probabilities of all triangles add up to one, or to what is not `None`.
#[test]
fn probabilities_add_up_for_any_table() {
    for number in some(30) {
        let mut pcg = Pcg32::new(number as u64, 94);
        let content = Content { triangles: 60, textured: false, sky: 0, two_sided: true };
        let scene = Scene::random(&mut pcg, content);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        let visibility = with_factors(&learn(&lights, 1000), HOSTILE[number % 4], &mut pcg);
        let view = lights.with_visibility(&visibility).expect("it was learned here");
        for i in 0..10 {
            let x = random_point(&mut pcg, i);
            let at = view.at(&x);
            let triangles = scene.triangles().map(crate::common::density::id);
            let sum: f64 = triangles.map(|id| f64::from(at.pmf(id))).sum();
            let blind =
                scene.triangles().map(|t| f64::from(lights.at(&x).pmf(crate::common::density::id(t)))).sum::<f64>();
            assert!((sum - 1.0).abs() < 1e-5 || sum < 1.0 && blind < 1.0 - 1e-7, "{sum}, {blind} without");
        }
    }
}

/// Samples fall on triangles as their probabilities say, under any table.
#[test]
fn triangles_are_chosen_as_their_probabilities_say_for_any_table() {
    let numbers = some(30);
    let points = 4;
    for &number in &numbers {
        let mut pcg = Pcg32::new(number as u64, 95);
        let content = Content { triangles: 60, textured: false, sky: 0, two_sided: true };
        let scene = Scene::random(&mut pcg, content);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        let visibility = with_factors(&learn(&lights, 1000), HOSTILE[number % 4], &mut pcg);
        let view = lights.with_visibility(&visibility).expect("it was learned here");
        let ids: Vec<_> = scene.triangles().map(crate::common::density::id).collect();
        for i in 0..points {
            let at = view.at(&random_point(&mut pcg, i));
            let count = tier().histogram / 10;
            let mut observed = vec![0.0; ids.len() + 1];
            for _ in 0..count {
                let sample = at.sample(pcg.cube());
                let place = sample.and_then(|s| ids.iter().position(|id| *id == s.hit().expect("a triangle").triangle));
                observed[place.unwrap_or(ids.len())] += 1.0;
            }
            let mut expected: Vec<f64> = ids.iter().map(|id| count as f64 * f64::from(at.pmf(*id))).collect();
            let none = count as f64 - expected.iter().sum::<f64>();
            // Rounding is no cell.
            expected.push(if none > 1e-4 * count as f64 { none } else { observed[ids.len()] });
            let (p, dump) = chi_square(&observed, &expected);
            assert!(p > sidak(0.01, points * numbers.len()), "{number}, {i}: p = {p:e}\n{dump}");
        }
    }
}

/// Two lamps and a wall between them: nearly all samples go to the lamp that is seen.
#[test]
fn samples_reach_the_point() {
    let lamp = |x: f32| LightMesh::quad(Vec3::new(x, 0.2, 1.0), Vec3::Y * 0.2, Vec3::X * 0.2);
    let scene = Scene {
        name: "two lamps".into(),
        meshes: vec![lamp(0.1), lamp(0.7)],
        images: Vec::new(),
        sky: Sky::Constant(1.0),
        rotation: glam::Mat3::IDENTITY,
        illumination: fanlight::Illumination::default(),
    };
    let lights = build(&scene, ARITIES[0]);
    let point = |i: u64| {
        let mut pcg = Pcg32::new(i, 95);
        ShadingPoint::surface(Vec3::new(pcg.f32(), pcg.f32(), 0.0), Vec3::Z)
    };
    let visibility = Visibility::learn(&lights.as_view(), 4000, point, wall).expect("nobody cancels");
    let reach = |view: &LightSamplerView<'_>| {
        let mut pcg = Pcg32::new(1, 96);
        let samples: Vec<_> = (0..4000_u64).filter_map(|i| Some((i, view.at(&point(i)).sample(pcg.cube())?))).collect();
        let seen = samples.iter().filter(|(i, sample)| wall(&point(*i), sample) == 1.0).count();
        seen as f64 / samples.len() as f64
    };
    let known = lights.with_visibility(&visibility).expect("it was learned here");
    let [blind, known] = [reach(&lights.as_view()), reach(&known)];
    assert!(blind < 0.8 && known > 0.96, "{blind} without, {known} with");
}

/// The table does not depend on how reports are spread over counters, and in which order these are merged.
#[test]
fn order_and_threads_do_not_matter() {
    let mut pcg = Pcg32::new(3, 97);
    let scene = Scene::random(&mut pcg, Content { triangles: 300, textured: false, sky: 0, two_sided: true });
    let lights = build(&scene, ARITIES[0]);
    let run = |threads: usize, reversed: bool| {
        let mut learner = VisibilityLearner::new(&lights.as_view());
        let mut table: Option<Visibility> = None;
        for pass in 0..3_u64 {
            let mut parts: Vec<VisibilityCounters> = (0..threads).map(|_| learner.counters()).collect();
            for i in 0..6000_u64 {
                let mut pcg = Pcg32::new(6000 * pass + i, 98);
                let x = random_point(&mut pcg, i as usize);
                let view = match &table {
                    Some(table) => lights.with_visibility(table).expect("it was learned here"),
                    None => lights.as_view(),
                };
                let at = view.at(&x);
                if let Some(sample) = at.sample(pcg.cube()) {
                    parts[i as usize % threads].report(&at, &sample, 0.1 + 0.8 * wall(&x, &sample));
                }
            }
            if reversed {
                parts.reverse();
            }
            parts.iter().for_each(|part| learner.merge(part).expect("it is of this pass"));
            table = Some(learner.publish(&lights.as_view()).expect("the sampler is the same"));
            assert!(learner.merge(&parts[0]).is_err(), "it is of the pass before");
        }
        table.expect("three passes")
    };
    let one = run(1, false);
    assert!(one.region_count() > 7 && entries(&one) > 20);
    assert!(one == run(8, false) && one == run(8, true));
}

/// By rays of its own, a table is the same for every number of threads.
#[cfg(feature = "rayon")]
#[test]
fn learning_does_not_depend_on_threads() {
    let mut pcg = Pcg32::new(4, 97);
    let scene = Scene::random(&mut pcg, Content { triangles: 200, textured: false, sky: 1, two_sided: true });
    let lights = build(&scene, ARITIES[0]);
    let learned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| learn(&lights, 60_000))
    };
    assert!(learned(1) == learned(8));
}

#[test]
fn a_table_of_another_sampler_is_refused() {
    let mut pcg = Pcg32::new(5, 97);
    let mut sampler = |triangles| {
        build(&Scene::random(&mut pcg, Content { triangles, textured: false, sky: 0, two_sided: true }), ARITIES[0])
    };
    let (lights, others) = (sampler(100), sampler(101));
    let visibility = learn(&lights, 1000);
    let message = others.with_visibility(&visibility).expect_err("another number of lights").to_string();
    assert!(message.contains("learned for") && message.contains("visibility"), "{message}");
    let mut learner = VisibilityLearner::new(&lights.as_view());
    assert!(learner.publish(&others.as_view()).is_err());
    assert!(learner.merge(&VisibilityLearner::new(&others.as_view()).counters()).is_err());
}

/// Lamps in a row, all below one root of 16 lanes.
fn row(lamps: usize) -> LightSampler {
    let mut builder = LightSampler::builder().arity(Arity::Sixteen);
    for i in 0..lamps {
        let corner = Vec3::new(2.0 * i as f32, 0.0, 2.0);
        let corners = [corner, corner + Vec3::Y, corner + Vec3::X];
        builder.add_mesh(&Mesh::emitter(&corners, &[[0, 1, 2]])).expect("valid");
    }
    builder.build().expect("small")
}

/// Reports `count` samples at points below the whole row.
fn report(counters: &mut VisibilityCounters, lights: &LightSampler, count: u64) {
    for i in 0..count {
        let mut pcg = Pcg32::new(i, 99);
        let x = ShadingPoint::surface(Vec3::new(28.0 * pcg.f32(), pcg.f32(), 0.0), Vec3::Z);
        let here = lights.at(&x);
        if let Some(sample) = here.sample(pcg.cube()) {
            counters.report(&here, &sample, pcg.f32());
        }
    }
}

/// Trees with as many nodes, of which one has more leaves.
#[test]
fn reports_of_another_sampler_are_ignored() {
    let (lights, others) = (row(10), row(14));
    let mut learner = VisibilityLearner::new(&lights.as_view());
    let mut counters = learner.counters();
    report(&mut counters, &others, 400);
    learner.merge(&counters).expect("it is of this learner");
    let visibility = learner.publish(&lights.as_view()).expect("the sampler is the same");
    assert_eq!(visibility.region_count(), 0);
}

/// Counters of a learner that has divided space, for one that has not, and the other way round.
#[test]
fn counters_with_other_regions_are_refused() {
    let lights = row(10);
    let learner = |reports: u64| {
        let mut learner = VisibilityLearner::new(&lights.as_view());
        let mut counters = learner.counters();
        report(&mut counters, &lights, reports);
        learner.merge(&counters).expect("it is of this learner");
        learner.publish(&lights.as_view()).expect("the sampler is the same");
        learner
    };
    let (mut few, mut many) = (learner(10), learner(2000));
    let [mut of_few, mut of_many] = [few.counters(), many.counters()];
    report(&mut of_few, &lights, 2000);
    report(&mut of_many, &lights, 2000);
    let message = few.merge(&of_many).expect_err("it has more regions").to_string();
    assert!(message.contains("8 regions") && message.contains("there are 7"), "{message}");
    assert!(many.merge(&of_few).is_err() && of_few.merge(&of_many).is_err());
    for (learner, counters) in [(&mut few, &of_few), (&mut many, &of_many)] {
        learner.merge(counters).expect("it is of this learner");
        assert!(learner.publish(&lights.as_view()).is_ok());
    }
}

/// Learners that have divided space at different places.
#[test]
fn counters_with_as_many_other_regions_are_refused() {
    let lights = row(10);
    let [mut one, mut other] = [600, 2000].map(|reports| {
        let mut learner = VisibilityLearner::new(&lights.as_view());
        let mut counters = learner.counters();
        report(&mut counters, &lights, reports);
        learner.merge(&counters).expect("it is of this learner");
        learner.publish(&lights.as_view()).expect("the sampler is the same");
        learner
    });
    let message = one.merge(&other.counters()).expect_err("its plane is elsewhere").to_string();
    assert!(message.contains("node ") && message.contains("the plane "), "{message}");
    assert!(other.merge(&one.counters()).is_err());
}

/// An edited sampler learns what its bytes learn, whose nodes are in order again.
#[test]
fn the_numbers_of_nodes_do_not_matter() {
    let (mut all, mut different) = (0, 0);
    for seed in 0..8 {
        let (_, lights) = crate::edits::edited(seed, 0, 30);
        let words = aligned(&lights.to_bytes());
        let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        let views = [lights.as_view(), loaded];
        let queries = (0..6000).map(|i| {
            let mut pcg = Pcg32::new(i, 100 + seed);
            (ShadingPoint::volume(4.0 * Vec3::from_array(pcg.cube()) - 2.0), pcg.cube())
        });
        let queries: Vec<_> = queries.collect();
        let tables = views.map(|view| {
            let mut learner = VisibilityLearner::new(&view);
            let mut counters = learner.counters();
            for (x, u) in &queries {
                let here = view.at(x);
                let Some(sample) = here.sample(*u) else { continue };
                counters.report(&here, &sample, f32::from(u8::from((x.position.x > 0.0) == (sample.position.x > 0.0))));
            }
            learner.merge(&counters).expect("it is of this learner");
            learner.publish(&view).expect("the sampler is the same")
        });
        let [own, other] = [0, 1].map(|k| views[k].with_visibility(tables[k].as_view()).expect("learned here"));
        for (x, u) in &queries {
            let [own, other] = [own, other].map(|view| view.at(x).sample(*u).map_or(0.0, |sample| sample.pmf));
            all += 1;
            different += usize::from((own - other).abs() > 1e-3 * own);
        }
    }
    // Sums in another order may round a factor to the next code.
    assert!(200 * different < all, "{different} of {all}");
}

#[test]
fn learning_can_be_cancelled_and_shows_progress() {
    let mut pcg = Pcg32::new(6, 97);
    let scene = Scene::random(&mut pcg, Content { triangles: 50, textured: false, sky: 0, two_sided: true });
    let lights = build(&scene, ARITIES[0]);
    let point = |i: u64| random_point(&mut Pcg32::new(i, 91), i as usize);
    let shown = std::sync::Mutex::new(Vec::new());
    let learn = |limit: f32| {
        Visibility::learn_with(&lights.as_view(), 30_000, point, wall, |share| {
            shown.lock().expect("nobody panics").push(share);
            if share > limit { core::ops::ControlFlow::Break(()) } else { core::ops::ControlFlow::Continue(()) }
        })
    };
    assert!(learn(0.5).expect_err("it was cancelled").is_cancelled());
    assert!(learn(2.0).is_ok());
    assert_eq!(shown.lock().expect("nobody panics").last(), Some(&1.0));
}

/// Changed bytes are an error, or a table that samples stay valid with.
#[test]
fn hostile_bytes_are_refused_or_harmless() {
    let mut pcg = Pcg32::new(7, 97);
    let scene = Scene::random(&mut pcg, Content { triangles: 80, textured: false, sky: 0, two_sided: true });
    let lights = build(&scene, ARITIES[0]);
    let visibility = learn(&lights, 3000);
    let bytes = visibility.to_bytes();
    let words = aligned(&bytes);
    let same = VisibilityView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    assert!(same.to_owned() == visibility && same.bytes() == visibility.bytes());
    let (mut refused, mut loaded) = (0, 0);
    for _ in 0..tier().inputs {
        let mut words = words.clone();
        for _ in 0..1 + pcg.below(3) {
            // Mostly the trees over regions and the keys, which come first.
            let limit = if pcg.below(3) == 0 { words.len() } else { words.len() / 3 };
            let at = pcg.below(limit);
            words[at] = match pcg.below(4) {
                0 => words[at] ^ (1 << pcg.below(32)),
                1 => pcg.below(40) as u32,
                2 => u32::MAX,
                _ => words[pcg.below(words.len())],
            };
        }
        let Ok(view) = VisibilityView::from_bytes(bytemuck::cast_slice(&words)) else {
            refused += 1;
            continue;
        };
        let Ok(view) = lights.as_view().with_visibility(view) else { continue };
        loaded += 1;
        for i in 0..4 {
            let x = random_point(&mut pcg, i);
            let at = view.at(&x);
            if let Some(sample) = at.sample(pcg.cube()) {
                assert_same(at.pdf(&sample.hit().expect("a triangle")), sample.pdf, "pdf");
            }
        }
    }
    assert!(refused > 100 && loaded > 100, "{refused} refused, {loaded} loaded");
    for end in 0..bytes.len().min(400) {
        assert!(VisibilityView::from_bytes(&bytemuck::cast_slice::<u32, u8>(&words)[..end]).is_err());
    }
}

/// The environment as a light, half of which a wall hides.
#[test]
fn what_hides_the_environment_is_learned() {
    let mut pcg = Pcg32::new(8, 97);
    let texels: Vec<f32> = (0..64 * 32).map(|i| if i == 700 { 5000.0 } else { 0.5 + pcg.f32() }).collect();
    let sky = Environment::from_lat_long(64, 32, &texels, Filter::Nearest).expect("valid texels");
    let soup = LightMesh::soup(&mut pcg, 40, 0.05);
    let mesh = Mesh::emitter(&soup.positions, &soup.indices);
    let lights = LightSampler::builder().environment(sky).environment_as_light().mesh(&mesh).expect("valid");
    let lights = lights.build().expect("small");
    let seen = |_: &ShadingPoint, sample: &LightSample| match sample.light {
        SampledLight::Environment => f32::from(u8::from(sample.direction.y < 0.1)),
        _ => 0.0,
    };
    let point = |i: u64| random_point(&mut Pcg32::new(i, 91), i as usize);
    let visibility = Visibility::learn(&lights.as_view(), 20_000, point, seen).expect("nobody cancels");
    let known = lights.with_visibility(&visibility).expect("it was learned here");
    let (mut reach, mut drawn) = ([0; 2], [0; 2]);
    for i in 0..4000 {
        let (x, u) = (point(i), pcg.cube());
        for (k, view) in [lights.as_view(), known].iter().enumerate() {
            let at = view.at(&x);
            let Some(sample) = at.sample(u) else { continue };
            drawn[k] += 1;
            reach[k] += usize::from(seen(&x, &sample) > 0.0);
            if sample.light == SampledLight::Environment {
                assert_same(at.pdf_environment(sample.direction), sample.pdf, "environment");
            }
        }
    }
    let [blind, known] = [0, 1].map(|k| reach[k] as f64 / drawn[k] as f64);
    assert!(known > 1.5 * blind, "{blind} without, {known} with");
}

/// A sun behind two windows, one of which is bricked up.
#[test]
fn what_hides_a_sun_is_learned() {
    let mut pcg = Pcg32::new(9, 97);
    let mut texels = vec![0.2; 128 * 64];
    texels[20 * 128 + 40] = 20_000.0;
    let sky = Environment::from_lat_long(128, 64, &texels, Filter::Nearest).expect("valid texels");
    let ceiling = |x: f32| LightMesh::quad(Vec3::new(x, -1.0, 1.0), Vec3::Y * 3.0, Vec3::X * 0.9);
    let mut builder = LightSampler::builder().environment(sky);
    for mesh in [ceiling(-1.0), ceiling(0.5)] {
        builder.add_mesh(&Mesh::portal(&mesh.positions, &mesh.indices)).expect("valid");
    }
    let lights = builder.build().expect("small");
    let seen = |_: &ShadingPoint, sample: &LightSample| f32::from(u8::from(sample.position.x > 0.5));
    let point = |i: u64| {
        let mut pcg = Pcg32::new(i, 95);
        ShadingPoint::surface(Vec3::new(pcg.f32() * 2.0 - 0.5, pcg.f32(), 0.0), Vec3::Z)
    };
    let visibility = Visibility::learn(&lights.as_view(), 6000, point, seen).expect("nobody cancels");
    let known = lights.with_visibility(&visibility).expect("it was learned here");
    let (mut sums, mut seen_samples) = ([0.0; 2], [0; 2]);
    for i in 0..6000 {
        let (x, u) = (point(i), pcg.cube());
        for (k, view) in [lights.as_view(), known].iter().enumerate() {
            let at = view.at(&x);
            let Some(sample) = at.sample(u) else { continue };
            assert_same(at.pdf(&sample.hit().expect("a triangle")), sample.pdf, "pdf");
            let radiance = lights.environment().radiance(sample.direction);
            sums[k] += f64::from(seen(&x, &sample) * radiance * x.cosine(sample.direction) / sample.pdf);
            seen_samples[k] += usize::from(seen(&x, &sample) > 0.0);
        }
    }
    assert!((sums[0] / sums[1] - 1.0).abs() < 0.1, "{sums:?}");
    let [blind, known] = seen_samples;
    assert!(known as f64 > 1.2 * blind as f64 && known > 4500, "{blind} without, {known} with");
}

/// After a refit a table stays exact.
#[test]
fn a_table_stays_exact_after_a_refit() {
    let mut pcg = Pcg32::new(10, 97);
    let scene = Scene::random(&mut pcg, Content { triangles: 80, textured: false, sky: 0, two_sided: true });
    let mut lights = build(&scene, ARITIES[0]);
    let visibility = learn(&lights, 3000);
    let updates: Vec<_> = (0..scene.meshes.len() as u32)
        .map(|i| fanlight::MeshUpdate::new(fanlight::MeshId::from_index(i)).scaled(0.5 + pcg.f32()))
        .collect();
    lights.refit(&updates).expect("the meshes are known");
    let view = lights.with_visibility(&visibility).expect("the numbers are the same");
    for i in 0..200 {
        let x = random_point(&mut pcg, i);
        let at = view.at(&x);
        if let Some(sample) = at.sample(pcg.cube()) {
            assert_same(at.pdf(&sample.hit().expect("a triangle")), sample.pdf, "pdf");
        }
    }
}

/// A small opening in front of a large one: what gets through both counts for the small one, whose samples find it.
#[test]
fn the_smaller_of_two_portals_along_a_ray_is_preferred() {
    let window = |z: f32, half: f32| {
        let (x, y) = (Vec3::X * half, Vec3::Y * half);
        LightMesh::quad(Vec3::Z * z - x - y, 2.0 * y, 2.0 * x)
    };
    let sky = Environment::constant(1.0).expect("a valid radiance");
    let mut builder = LightSampler::builder().environment(sky);
    for mesh in [window(1.0, 0.05), window(1.4, 0.7)] {
        builder.add_mesh(&Mesh::portal(&mesh.positions, &mesh.indices)).expect("valid");
    }
    let lights = builder.build().expect("small");
    let seen = |x: &ShadingPoint, sample: &LightSample| {
        let place = x.position + sample.direction / sample.direction.z;
        f32::from(u8::from(place.x.abs().max(place.y.abs()) < 0.05))
    };
    let point = |i: u64| {
        let mut pcg = Pcg32::new(i, 98);
        ShadingPoint::surface(Vec3::new(pcg.f32() - 0.5, pcg.f32() - 0.5, 0.0), Vec3::Z)
    };
    let visibility = Visibility::learn(&lights.as_view(), 8000, point, seen).expect("nobody cancels");
    let known = lights.with_visibility(&visibility).expect("it was learned here");
    let (mut pcg, mut reach, mut sums) = (Pcg32::new(11, 97), [0.0; 2], [0.0; 2]);
    let count = 40_000;
    for i in 0..count {
        let (x, u) = (point(i), pcg.cube());
        for (k, view) in [lights.as_view(), known].iter().enumerate() {
            let at = view.at(&x);
            let Some(sample) = at.sample(u) else { continue };
            let seen = f64::from(seen(&x, &sample));
            reach[k] += seen / count as f64;
            sums[k] += seen * f64::from(x.cosine(sample.direction) / at.pdf_sample_direction(&sample));
        }
    }
    // The blind one has a relative standard error of 0.05.
    assert!((sums[0] / sums[1] - 1.0).abs() < 0.25, "{sums:?}");
    let [blind, known] = reach;
    assert!(blind < 0.05 && known > 0.4, "{blind} without, {known} with");
}
