//! For every shading point, the density of all points of all triangles integrates to the probability that `sample`
//! returns one.

use crate::common::density::{OnTriangle, id, probes};
use crate::common::lights::{ARITIES, build};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LEAST_EFFORT, LOBES, MICROFACETS, Scene, point_of_kind};
use crate::common::statistics::{binomial_p, sidak};
use crate::common::tier::{few, fewer, some, some_slow};
use fanlight::{Hit, LightSample, LightSampler, ShadingPoint};
use glam::Vec3;

/// Error granted to an integral.
const TOLERANCE: f64 = 1e-4;
/// Most that may be left open of an integral: twice the largest standard error of a rate among 40,000 samples.
const RESOLVED: f64 = 5e-3;
/// Significance of all scenes together.
const SIGNIFICANCE: f64 = 0.01;
/// How much coarser the integral over a scene of [`MANY`] triangles is. Among many of them, the density takes all kinds
/// of cells.
const COARSER: f64 = 5.0;
/// How much finer the integral of the least effort is. *Measured*: with 1, one of 20 integrals is off by 1.3e-4, as a
/// density that does not follow the sky has larger steps.
const FINER: f64 = 0.1;
const MANY: usize = 100;
/// Triangles that together have less probability than this are left out.
const NEGLIGIBLE: f64 = 2e-5;

struct Found {
    name: String,
    integral: f64,
    unresolved: f64,
    /// Whether the integral is a coarse one.
    is_coarse: bool,
    samples: usize,
    missed: usize,
}

/// Integral of the density over all triangles, and five standard errors of what it resolves by random places alone,
/// where the density varies over less than it divides.
fn integral(
    scene: &Scene,
    lights: &LightSampler,
    x: &ShadingPoint,
    samples: &[LightSample],
    coarser: f64,
    wrong: bool,
) -> (f64, f64) {
    let count = scene.triangles().count();
    // The more probable a triangle, the finer what may be missed in it.
    let least_depth = |pmf: f64| match pmf {
        pmf if pmf > 0.05 => 6,
        pmf if pmf < 1e-3 && count >= 10_000 => 2,
        _ => 4,
    };
    let probes = probes(scene, samples);
    let at = lights.at(x);
    let pdf = |hit: &Hit| {
        let factor = if wrong && hit.barycentrics[0] > 0.5 { 1.1 } else { 1.0 };
        factor * f64::from(at.pdf(hit))
    };
    let mut triangles: Vec<_> = scene.triangles().map(|t| (f64::from(at.pmf(id(t))), t)).collect();
    triangles.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left: f64 = triangles.iter().map(|t| t.0).sum();
    assert!(left <= 1.0 + 1e-5, "{}: the triangles' probabilities add up to {left}", scene.name);
    let (mut sum, mut unresolved) = (0.0, 0.0);
    for (pmf, triangle) in triangles {
        if left < NEGLIGIBLE {
            break;
        }
        left -= pmf;
        let on = OnTriangle::new(scene, triangle, x, &pdf).coarser(coarser);
        let (whole, open) = on.integrate(0, least_depth(pmf), &probes[triangle.0][triangle.1]);
        sum += whole[0];
        unresolved += open * open;
    }
    (sum, unresolved.sqrt())
}

impl Found {
    /// Error granted to the integral: to a coarse one, what it leaves open as well.
    fn tolerance(&self) -> f64 {
        TOLERANCE + if self.is_coarse { self.unresolved } else { 0.0 }
    }
}

fn examine(content: Content, number: usize, receiver: usize, count: usize, wrong: bool) -> Found {
    examine_moved(content, number, receiver, count, wrong, &|p| p)
}

/// [`examine`] with all positions changed.
fn examine_moved(
    content: Content,
    number: usize,
    receiver: usize,
    count: usize,
    wrong: bool,
    change: &dyn Fn(Vec3) -> Vec3,
) -> Found {
    let mut pcg = Pcg32::new(100 + number as u64, 11);
    let mut scene = Scene::random(&mut pcg, content);
    scene.meshes.iter_mut().for_each(|mesh| mesh.positions.iter_mut().for_each(|p| *p = change(*p)));
    let arities = ARITIES[number % ARITIES.len()];
    let lights = build(&scene, arities);
    let mut x = point_of_kind(&mut pcg, receiver);
    x.position = change(x.position);
    let at = lights.at(&x);
    let samples: Vec<_> = (0..count).filter_map(|_| at.sample(pcg.cube())).collect();
    let probing = &samples[..samples.len().min(2000)];
    let is_coarse = content.triangles >= MANY;
    let coarser = match receiver {
        _ if is_coarse => COARSER,
        LEAST_EFFORT.. => FINER,
        _ => 1.0,
    };
    let (integral, unresolved) = integral(&scene, &lights, &x, probing, coarser, wrong);
    let name = format!("{} {arities:?} {:?} {x:?}", scene.name, scene.illumination);
    Found { name, integral, unresolved, is_coarse, samples: count, missed: count - samples.len() }
}

/// Sizes with every texturing and sky; the largest with some. Many textured triangles take long to integrate over, so
/// that they are left to the release tier.
fn contents(two_sided: bool, slow: bool) -> Vec<Content> {
    let mut contents = Vec::new();
    for triangles in [1, 2, 10, 100] {
        for textured in [false, true] {
            contents.extend((0..4).map(|sky| Content { triangles, textured, sky, two_sided }));
        }
    }
    contents.extend((0..4).map(|sky| Content { triangles: 1000, textured: sky % 2 == 0, sky, two_sided }));
    contents.push(Content { triangles: 10_000, textured: false, sky: 0, two_sided });
    contents.retain(|content| slow == (content.textured && content.triangles > 2));
    contents
}

/// Volumes see every two-sided light, and no sky without a black pixel hides one: nothing can be missed.
fn check_where_all_is_visible(slow: bool) {
    let contents: Vec<_> = contents(true, slow).into_iter().filter(|content| content.sky < 2).collect();
    let numbers = some(contents.len());
    let found = parallel::map(numbers.len(), |k| examine(contents[numbers[k]], 1000 + numbers[k], 2, 5000, false));
    let mut worst = 0.0f64;
    for found in &found {
        assert_eq!(found.missed, 0, "{}", found.name);
        worst = worst.max((found.integral - 1.0).abs());
        let tolerance = found.tolerance();
        assert!(tolerance < RESOLVED, "{}: {} is left open", found.name, found.unresolved);
        assert!((found.integral - 1.0).abs() < tolerance, "{}: {}", found.name, found.integral);
    }
    println!("{} scenes, largest deviation {worst:e}", found.len());
}

#[test]
fn where_all_is_visible_the_density_integrates_to_one() {
    check_where_all_is_visible(false);
}

#[test]
#[ignore = "release tier: minutes; cargo test --release --test suite -- normalization --ignored"]
fn where_all_is_visible_the_density_of_many_textures_integrates_to_one() {
    check_where_all_is_visible(true);
}

/// Scenes far from the origin, tiny, huge, and squeezed to slivers.
#[test]
fn the_density_integrates_to_one_at_any_scale() {
    let changes: [&(dyn Fn(Vec3) -> Vec3 + Sync); 6] = [
        &|p| p + Vec3::new(1000.0, -2000.0, 500.0),
        &|p| p * 1e-6,
        &|p| p * 1e6,
        &|p| p * Vec3::new(1.0, 1.0, 1e-3),
        &|p| p * Vec3::new(1.0, 1e-4, 1e-4),
        &|p| p * 1e-2 + 1000.0,
    ];
    let numbers = some_slow(8 * changes.len());
    let count = numbers.len();
    let found = parallel::map(count, |k| {
        let i = numbers[k];
        let triangles = [1, 10][i % 2];
        let content = Content { triangles, textured: i % 4 > 1, sky: i % 8 / 4, two_sided: true };
        examine_moved(content, 2000 + i, 2, 5000, false, changes[i / 8])
    });
    for found in &found {
        let deviation = (found.integral + found.missed as f64 / found.samples as f64 - 1.0).abs();
        let tolerance = TOLERANCE + found.unresolved;
        assert!(deviation < tolerance, "{}: {}, missed {}", found.name, found.integral, found.missed);
    }
    check_resolved(&found, TOLERANCE);
}

/// A point next to a sliver, or between many lights, sees densities that vary over less than the integration resolves.
fn check_resolved(found: &[Found], least: f64) {
    let (resolved, count) = (found.iter().filter(|found| found.unresolved < least).count(), found.len());
    println!("{resolved} of {count} scenes are resolved");
    assert!(10 * resolved >= 9 * count, "only {resolved} of {count} scenes are resolved");
}

/// Everywhere else the shortfall is the rate of `None`. Each scene's binomial test has Šidák's share of 1 %. `least` is
/// how many points there must be to make this a test that always give a sample, that never do, and that are between; of
/// a part of the points, a part.
fn check_elsewhere(slow: bool, first: usize, some: fn(usize) -> Vec<usize>, least: [usize; 3]) {
    let contents = contents(false, slow);
    let numbers = some(3 * contents.len());
    let count = numbers.len();
    let one_of = (3 * contents.len()).div_ceil(count);
    let found = parallel::map(count, |k| {
        let i = numbers[k];
        examine(contents[i / 3], i / 3, first + i % 3, 40_000, false)
    });
    let significance = sidak(SIGNIFICANCE, count);
    let (mut full, mut empty, mut least_p) = (0, 0, 1.0f64);
    for found in &found {
        let p = p_value(found);
        assert!(
            p > significance,
            "{}: integral {}, missed {} of {}: p = {p:e}",
            found.name,
            found.integral,
            found.missed,
            found.samples
        );
        least_p = least_p.min(p);
        full += usize::from(found.missed == 0);
        empty += usize::from(found.missed == found.samples);
        if found.missed == found.samples {
            assert!(found.integral < TOLERANCE, "{}: {}", found.name, found.integral);
        }
    }
    check_resolved(&found, RESOLVED);
    println!("{count} points: {full} always give a sample, {empty} never do; least p {least_p:e}");
    // Both ends and the middle occur; the middle, of which the test is, among a few points as well.
    let found = [full, empty, count - full - empty];
    assert!(found.iter().zip(least).all(|(found, least)| *found >= least / one_of), "{found:?}");
    assert!(found[2] > 0, "no point misses some samples");
}

#[test]
fn elsewhere_the_shortfall_is_the_rate_of_none() {
    check_elsewhere(false, 0, some_slow, [11, 3, 6]);
}

#[test]
fn with_lobes_the_shortfall_is_the_rate_of_none() {
    check_elsewhere(false, LOBES, few, [11, 3, 6]);
}

#[test]
#[ignore = "release tier: minutes; cargo test --release --test suite -- normalization --ignored"]
fn with_the_least_effort_the_shortfall_is_the_rate_of_none() {
    check_elsewhere(false, LEAST_EFFORT, fewer, [11, 3, 6]);
}

#[test]
#[ignore = "release tier: minutes; cargo test --release --test suite -- normalization --ignored"]
fn with_microfacets_the_shortfall_is_the_rate_of_none() {
    check_elsewhere(false, MICROFACETS, fewer, [11, 3, 6]);
}

#[test]
#[ignore = "release tier: minutes; cargo test --release --test suite -- normalization --ignored"]
fn elsewhere_the_shortfall_of_many_textures_is_the_rate_of_none() {
    check_elsewhere(true, 0, some_slow, [6, 0, 6]);
}

/// Probability of a rate of `None` at least as far from the shortfall, less the error granted to the integral.
fn p_value(found: &Found) -> f64 {
    let n = found.samples as f64;
    let shortfall = 1.0 - found.integral;
    let tolerance = found.tolerance();
    if shortfall < -tolerance {
        return 0.0;
    }
    let rate = found.missed as f64 / n;
    let nearest = rate.max(shortfall - tolerance).min(shortfall + tolerance).clamp(0.0, 1.0);
    binomial_p(found.missed as f64, n, nearest)
}

/// The checks above see a density that is too large by a tenth on a quarter of a triangle.
#[test]
fn a_wrong_density_is_found() {
    let content = Content { triangles: 10, textured: false, sky: 0, two_sided: true };
    let right = examine(content, 1, 2, 40_000, false);
    let wrong = examine(content, 1, 2, 40_000, true);
    assert!((right.integral - 1.0).abs() < TOLERANCE && p_value(&right) > 0.5);
    assert!((wrong.integral - 1.0).abs() > TOLERANCE && p_value(&wrong) < 1e-9, "{}", wrong.integral);
}
