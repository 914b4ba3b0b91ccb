//! Samples fall where the density says.

use crate::common::density::{OnTriangle, bin, id, probes};
use crate::common::lights::{ARITIES, build, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LEAST_EFFORT, LOBES, MICROFACETS, Scene, point_of_kind, random_point};
use crate::common::statistics::{binomial_p, chi_square, sidak};
use crate::common::tier::{fewer, some_slow, tier};
use fanlight::{Arity, Hit, ShadingPoint, Splitting};
use glam::Vec3;

/// Significance of all scenes of a test together.
const SIGNIFICANCE: f64 = 0.01;
/// Triangles are cut into 4^DEPTH cells.
const DEPTH: u32 = 2;
/// Samples of each cell that guide the integration.
const PROBES: f64 = 50.0;

/// p-value of one scene's samples over all cells of all triangles and the misses, with the histogram. `wrong` asks
/// for a density that is off.
fn cells(content: Content, number: usize, receiver: usize, wrong: bool) -> (f64, String) {
    let mut pcg = Pcg32::new(500 + number as u64, 12);
    let scene = Scene::random(&mut pcg, content);
    let arities = ARITIES[number % ARITIES.len()];
    let lights = build(&scene, arities);
    let x = point_of_kind(&mut pcg, receiver);
    let bins = 1 << (2 * DEPTH);
    let samples = tier().histogram;
    let mut firsts = Vec::new();
    let mut total = 0;
    for mesh in &scene.meshes {
        firsts.push(total);
        total += mesh.indices.len();
    }
    let mut observed = vec![0.0; total * bins + 1];
    let mut kept = Vec::new();
    let at = lights.at(&x);
    for _ in 0..samples {
        match at.sample(pcg.cube()) {
            Some(sample) => {
                let hit = sample.hit().expect("a triangle");
                let triangle = firsts[hit.triangle.mesh.index() as usize] + hit.triangle.triangle as usize;
                let count = &mut observed[triangle * bins + bin(hit.barycentrics, DEPTH)];
                *count += 1.0;
                if *count <= PROBES {
                    kept.push(sample);
                }
            }
            None => observed[total * bins] += 1.0,
        }
    }
    let probes = probes(&scene, &kept);
    let pdf = |hit: &Hit| {
        // Integrates to one as well: the parts are a quarter and three quarters of a triangle.
        let factor = if !wrong {
            1.0
        } else if hit.barycentrics[0] > 0.5 {
            1.15
        } else {
            0.95
        };
        factor * f64::from(at.pdf(hit))
    };
    let mut expected = Vec::with_capacity(observed.len());
    for triangle in scene.triangles() {
        let on = OnTriangle::new(&scene, triangle, &x, &pdf);
        // The more probable a triangle, the finer what may be missed in it.
        let least_depth = match at.pmf(id(triangle)) {
            pmf if pmf > 0.05 => 6,
            pmf if pmf > 1e-4 => 4,
            _ => 2,
        };
        let (integrals, _) = on.integrate(DEPTH, least_depth, &probes[triangle.0][triangle.1]);
        expected.extend(integrals.iter().map(|share| share * samples as f64));
    }
    let shortfall = samples as f64 - expected.iter().sum::<f64>();
    expected.push(shortfall.max(0.0));
    // A shortfall as small as the error of the integrals cannot be judged.
    let misses = observed.len() - 1;
    if expected[misses].max(observed[misses]) < 3e-4 * samples as f64 {
        (expected[misses], observed[misses]) = (0.0, 0.0);
    }
    let (p, dump) = chi_square(&observed, &expected);
    (p, format!("{} {arities:?} {x:?}: p = {p:e}\n{dump}", scene.name))
}

fn contents() -> Vec<Content> {
    let mut contents = Vec::new();
    for triangles in [1, 2, 10, 50] {
        for textured in [false, true] {
            contents.extend((0..4).map(|sky| Content { triangles, textured, sky, two_sided: triangles == 2 }));
        }
    }
    contents
}

#[test]
fn samples_fill_the_cells_of_triangles_as_the_density_says() {
    check_cells(0, some_slow);
}

#[test]
fn samples_for_lobes_fill_the_cells_of_triangles_as_the_density_says() {
    check_cells(LOBES, fewer);
}

#[test]
fn samples_of_the_least_effort_fill_the_cells_of_triangles_as_the_density_says() {
    check_cells(LEAST_EFFORT, fewer);
}

#[test]
fn samples_for_microfacets_fill_the_cells_of_triangles_as_the_density_says() {
    check_cells(MICROFACETS, fewer);
}

/// With three kinds of receivers from `first` on.
fn check_cells(first: usize, some: fn(usize) -> Vec<usize>) {
    let contents = contents();
    let numbers = some(3 * contents.len());
    let count = numbers.len();
    let significance = sidak(SIGNIFICANCE, count);
    let found = parallel::map(count, |k| {
        let i = numbers[k];
        cells(contents[i / 3], i / 3, first + i % 3, false)
    });
    let failed: Vec<_> = found.iter().filter(|(p, _)| *p < significance).collect();
    failed.iter().for_each(|(_, dump)| eprintln!("{dump}"));
    let least = found.iter().fold(1.0f64, |least, (p, _)| least.min(*p));
    println!("{count} points of {} samples, least p {least:e}, limit {significance:e}", tier().histogram);
    assert!(failed.is_empty(), "{} of {count} histograms fail", failed.len());
}

#[test]
fn a_density_that_is_off_fails_the_same_test() {
    let content = Content { triangles: 2, textured: true, sky: 0, two_sided: true };
    assert!(cells(content, 3, 2, false).0 > 1e-3);
    assert!(cells(content, 3, 2, true).0 < 1e-9);
}

/// A cloud of 10,000 triangles, and points in and around it.
fn cloud(number: usize) -> (Scene, ShadingPoint, Pcg32) {
    let mut pcg = Pcg32::new(800 + number as u64, 13);
    let scene = Scene::random(&mut pcg, Content { triangles: 10_000, textured: false, sky: 0, two_sided: false });
    let x = random_point(&mut pcg, number);
    (scene, x, pcg)
}

#[test]
fn triangles_are_chosen_with_their_probability() {
    let count = 3;
    let samples = 10 * tier().histogram;
    let found = parallel::map(count, |i| {
        let (scene, x, mut pcg) = cloud(i);
        let lights = build(&scene, ARITIES[i]);
        let triangles: Vec<_> = scene.triangles().map(id).collect();
        let mut observed = vec![0.0; triangles.len() + 1];
        for _ in 0..samples {
            let chosen = lights.at(&x).sample(pcg.cube()).map(|sample| sample.hit().expect("a triangle").triangle);
            let place = chosen.map_or(Ok(triangles.len()), |chosen| triangles.binary_search(&chosen));
            observed[place.expect("the triangle is one of the scene's")] += 1.0;
        }
        let n = samples as f64;
        let mut expected: Vec<_> = triangles.iter().map(|t| n * f64::from(lights.at(&x).pmf(*t))).collect();
        expected.push((n - expected.iter().sum::<f64>()).max(0.0));
        if expected[triangles.len()] < 1e-6 * n {
            expected[triangles.len()] = 0.0;
        }
        let (p, dump) = chi_square(&observed, &expected);
        // Each fourth triangle's share goes to the next: a wrong probability.
        for pair in expected.chunks_exact_mut(4) {
            (pair[0], pair[1]) = (0.9 * pair[0], pair[1] + 0.1 * pair[0]);
        }
        (p, dump, chi_square(&observed, &expected).0)
    });
    for (p, dump, wrong) in found {
        assert!(p > sidak(SIGNIFICANCE, count), "p = {p:e}\n{dump}");
        assert!(wrong < 1e-9, "{wrong:e}");
        println!("p = {p:.3}; with wrong probabilities {wrong:e}");
    }
}

/// One split gives no triangle twice, so that each triangle's count is binomial whatever its neighbors do.
#[test]
fn splitting_visits_triangles_as_often_as_it_expects() {
    let settings = [(0.5, 1, 200_000), (0.9, 2, 120_000), (1.0, 2, 10_000)];
    let found = parallel::map(settings.len(), |i| {
        let (threshold, levels, rounds) = settings[i];
        let splitting = Splitting::new(threshold, levels);
        let (scene, x, mut pcg) = cloud(i + 3);
        let lights = build(&scene, ARITIES[i]);
        let triangles: Vec<_> = scene.triangles().map(id).collect();
        let mut observed = vec![0u32; triangles.len()];
        let mut drawn = 0;
        for _ in 0..rounds {
            let samples = sample_split(&lights.at(&x), pcg.cube(), &splitting);
            drawn += samples.len();
            let mut visited: Vec<_> = samples.iter().map(|sample| sample.hit().expect("a triangle").triangle).collect();
            visited.sort_unstable();
            assert!(visited.windows(2).all(|pair| pair[0] != pair[1]), "a triangle is visited twice");
            for triangle in visited {
                observed[triangles.binary_search(&triangle).expect("a triangle of the scene")] += 1;
            }
        }
        // Wherever something arrives from, the ratio of the densities is the ratio of the counts.
        let expected = |t| {
            let places = [[0.25, 0.5], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            let hits = places.map(|barycentrics| Hit::new(t, barycentrics));
            let Some(hit) = hits.into_iter().find(|hit| lights.at(&x).pdf(hit) > 0.0) else { return 0.0 };
            let single = lights.at(&x).pdf(&hit);
            f64::from(lights.at(&x).pmf(t)) * f64::from(lights.at(&x).pdf_split(&hit, &splitting)) / f64::from(single)
        };
        let expected: Vec<f64> = triangles.iter().map(|t| expected(*t)).collect();
        (observed, expected, drawn)
    });
    let significance = sidak(SIGNIFICANCE, found.iter().map(|f| f.0.len() + 1).sum());
    for ((observed, expected, drawn), setting) in found.into_iter().zip(settings) {
        let n = f64::from(setting.2);
        let p = |expected: f64, i: usize| binomial_p(f64::from(observed[i]), n, expected.min(1.0));
        for (i, &e) in expected.iter().enumerate() {
            if e > 0.999_99 {
                assert_eq!(f64::from(observed[i]), n, "{setting:?} triangle {i} is visited always");
            } else {
                let p = p(e, i);
                assert!(p > significance, "{setting:?} triangle {i}: {} of {}, p {p:e}", observed[i], e * n);
            }
        }
        let wrong = (0..observed.len()).filter(|&i| p(1.3 * expected[i], i) < significance).count();
        assert!(wrong > 10, "the test cannot tell counts that are off by a third");
        println!(
            "{setting:?}: {:.2} samples a round, expected {:.2}; {wrong} triangles would betray wrong counts",
            drawn as f64 / n,
            expected.iter().sum::<f64>()
        );
    }
}

/// A tree of 4096 equal lights in a row, seen from afar: the deepest choices still have all their bits.
#[test]
fn equal_lights_are_chosen_equally_often_at_any_depth() {
    let mut scene = Scene::new("row", Vec::new());
    let mut mesh = crate::common::scene::LightMesh::new(Vec::new(), Vec::new()).two_sided();
    for i in 0..4096u32 {
        let corner = Vec3::new(i as f32, 0.0, 0.0);
        mesh.positions.extend([corner, corner + 0.5 * Vec3::X, corner + 0.5 * Vec3::Y]);
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    scene.meshes.push(mesh);
    let lights = build(&scene, Arity::Four);
    let x = ShadingPoint::volume(Vec3::new(2048.0, 0.0, 1e6));
    let mut pcg = Pcg32::new(9, 14);
    let mut observed = vec![0.0; 4096];
    let n = 400_000;
    for _ in 0..n {
        let sample = lights.at(&x).sample(pcg.cube()).expect("every light is visible");
        observed[sample.hit().expect("a triangle").triangle.triangle as usize] += 1.0;
    }
    let expected: Vec<_> = scene.triangles().map(|t| f64::from(n) * f64::from(lights.at(&x).pmf(id(t)))).collect();
    let (p, dump) = chi_square(&observed, &expected);
    assert!(p > SIGNIFICANCE, "p = {p}\n{dump}");
}
