//! Random numbers at their limits, and how many choices they last for.

use fanlight::{Arity, LightSampler, ShadingPoint};
use glam::Vec3;

use crate::common::density::id;
use crate::common::hostile::random_scene;
use crate::common::lights::{ARITIES, build};
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Scene, random_point};
use crate::common::statistics::chi_square;

/// Ends of the range, denormals, and numbers next to those that separate halves.
pub(crate) const HOSTILE: [f32; 8] =
    [0.0, -0.0, 1.0 - f32::EPSILON / 2.0, 1e-45, f32::MIN_POSITIVE, 0.5, 0.5 - f32::EPSILON / 4.0, 1e-7];

/// Significance of a histogram.
const SIGNIFICANCE: f64 = 0.001;

/// All triples, and what is no number between zero and one at all.
#[test]
fn any_numbers_give_samples_with_their_density() {
    let outside = [f32::NAN, f32::INFINITY, -1.0, 1.0, 2.0];
    let all: Vec<f32> = HOSTILE.into_iter().chain(outside).collect();
    let mut found = 0;
    for number in 0..20 {
        let mut pcg = Pcg32::new(number as u64, 64);
        let scene = random_scene(number, &mut pcg);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        let x = random_point(&mut pcg, number);
        let at = lights.at(&x);
        for i in 0..all.len().pow(3) {
            let u = [i, i / all.len(), i / all.len() / all.len()].map(|i| all[i % all.len()]);
            let Some(sample) = at.sample(u) else { continue };
            found += 1;
            let difference = (at.pdf(&sample.hit().expect("a triangle")) / sample.pdf - 1.0).abs();
            assert!(difference <= 1e-5 && sample.direction.is_normalized(), "{u:?} at {x:?}: {sample:?}");
        }
    }
    assert!(found > 10_000, "{found} samples");
}

/// How often each triangle is drawn, and the probability of each.
fn histogram(scene: &Scene, lights: &LightSampler, x: &ShadingPoint, samples: usize) -> [Vec<f64>; 2] {
    let at = lights.at(x);
    let mut pcg = Pcg32::new(3, 65);
    let mut observed = vec![0.0; scene.triangles().count()];
    for _ in 0..samples {
        let sample = at.sample(pcg.cube()).expect("every light is visible");
        observed[sample.hit().expect("a triangle").triangle.triangle as usize] += 1.0;
    }
    let expected = scene.triangles().map(|t| samples as f64 * f64::from(at.pmf(id(t)))).collect();
    [observed, expected]
}

/// Each light is twice as far as the one before the eighth before it: no choice splits them evenly.
#[test]
fn lights_of_all_sizes_are_chosen_with_their_probability() {
    let mut mesh = LightMesh::new(Vec::new(), Vec::new()).two_sided();
    for i in 0..480u32 {
        let scale = 2f32.powf(i as f32 / 8.0 - 32.0);
        mesh.positions.extend([Vec3::X, Vec3::new(1.5, 0.0, 0.0), Vec3::new(1.0, 0.5, 0.1)].map(|p| p * scale));
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let scene = Scene::new("chain", vec![mesh]);
    for arity in [Arity::Four, Arity::Eight, Arity::Sixteen] {
        let lights = build(&scene, arity);
        let x = ShadingPoint::volume(Vec3::new(0.0, 0.0, 1e-9));
        let [observed, expected] = histogram(&scene, &lights, &x, 500_000);
        let (p, dump) = chi_square(&observed, &expected);
        assert!(p > SIGNIFICANCE, "{arity:?}: p = {p}\n{dump}");
    }
}

/// The way down a binary tree over these shares with a single float that is stretched at every choice.
fn naive(ends: &[f64], mut u: f32) -> usize {
    let (mut low, mut high) = (0, ends.len() - 1);
    while high - low > 1 {
        let middle = low.midpoint(high);
        let left = ((ends[middle] - ends[low]) / (ends[high] - ends[low])) as f32;
        if u < left {
            (u, high) = (u / left, middle);
        } else {
            (u, low) = ((u - left) / (1.0 - left), middle);
        }
    }
    low
}

#[test]
#[ignore = "release tier: a tree of 10^6 triangles; cargo test --release --test suite -- --ignored leaves"]
fn leaves_of_a_large_tree_are_chosen_with_their_probability() {
    let mut pcg = Pcg32::new(5, 66);
    let count = 1_000_000;
    let scene = Scene::new("cloud", vec![LightMesh::soup(&mut pcg, count, 0.01).two_sided()]);
    let lights = build(&scene, Arity::Eight);
    let x = ShadingPoint::volume(Vec3::new(0.5, 0.5, 40.0));
    let samples = 8 * count;
    let [observed, expected] = histogram(&scene, &lights, &x, samples);
    let (p, dump) = chi_square(&observed, &expected);
    let mut ends = vec![0.0];
    expected.iter().for_each(|share| ends.push(ends[ends.len() - 1] + share));
    // All that such a float can be.
    let inputs = 1 << 24;
    let mut by_naive = vec![0.0; count];
    (0..inputs).for_each(|i| by_naive[naive(&ends, i as f32 / inputs as f32)] += samples as f64 / f64::from(inputs));
    let likely = || by_naive.iter().zip(&expected).filter(|(_, expected)| **expected > 4.0);
    let off = likely().map(|(naive, expected)| (naive / expected - 1.0).abs()).fold(0.0, f64::max);
    println!("{count} leaves, {samples} samples: p = {p:.3}; a float that is stretched is off by up to {off:.2}");
    assert!(p > SIGNIFICANCE, "p = {p}\n{dump}");
    assert!(off > 0.1, "the naive way is as good: {off}");
}
