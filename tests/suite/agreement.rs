//! A density that `sample` reports is the density that is found for the same point later.

use crate::common::hostile::{
    MOVED, hostile, random_scene, shading_point, shading_point_with_lobe, shading_point_with_microfacets,
};
use crate::common::lights::{ARITIES, Point, build, sample_from_bytes, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LightMesh, Paint, Scene, Sky, random_point};
use crate::common::tier::{agreement, some, tier};
use fanlight::{Arity, LightSample, Receiver, ShadingPoint, Splitting};
use glam::Vec3;

/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;
/// Shading points of a scene.
const POINTS: usize = 20;

fn differs(a: f32, b: f32, tolerance: f64) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    a.is_nan() || b.is_nan() || (a - b).abs() > tolerance * a.abs().max(b.abs())
}

#[derive(Default)]
struct Counts {
    samples: u64,
    none: u64,
    /// `pdf` of the hit, or `pmf` of its triangle, is not what the sample says.
    mismatches: u64,
    /// `pdf_sample_direction` is below the sample's own density.
    below: u64,
    /// `pdf_direction` finds another density.
    boundary: u64,
    directions: u64,
    /// Density, distance or direction that is no number.
    broken: u64,
    worst: f64,
    first: Option<String>,
}

impl Counts {
    fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.none += other.none;
        self.mismatches += other.mismatches;
        self.below += other.below;
        self.boundary += other.boundary;
        self.directions += other.directions;
        self.broken += other.broken;
        self.worst = self.worst.max(other.worst);
        self.first = self.first.take().or(other.first);
    }

    fn check(&mut self, at: &dyn Point, x: &ShadingPoint, sample: &LightSample) {
        self.samples += 1;
        let pdf = at.pdf(&sample.hit().expect("a triangle"));
        let difference = (f64::from(pdf) / f64::from(sample.pdf) - 1.0).abs();
        self.worst = self.worst.max(difference);
        if differs(pdf, sample.pdf, TOLERANCE) {
            self.mismatches += 1;
            self.first.get_or_insert_with(|| format!("{sample:?} at {x:?}: pdf {pdf}"));
        }
        let [b1, b2] = sample.hit().expect("a triangle").barycentrics;
        let finite = sample.position.is_finite() && sample.direction.is_normalized() && sample.normal.is_normalized();
        let positive = [sample.pdf, sample.pdf_area, sample.pmf, sample.distance, b1, b2, 1.0 - b1 - b2];
        let in_range = |value: &f32| value.is_finite() && *value >= 0.0;
        if !(finite && positive[..3].iter().all(|value| *value > 0.0) && positive.iter().all(in_range)) {
            self.broken += 1;
            self.first.get_or_insert_with(|| format!("{sample:?} at {x:?}"));
        }
    }

    fn check_direction(&mut self, at: &dyn Point, x: &ShadingPoint, sample: &LightSample) {
        self.directions += 1;
        if differs(at.pmf(sample.hit().expect("a triangle").triangle), sample.pmf, TOLERANCE) {
            self.mismatches += 1;
            self.first.get_or_insert_with(|| format!("{sample:?} at {x:?}: pmf"));
        }
        let along = at.pdf_sample_direction(sample);
        if !(along >= sample.pdf && along.is_finite()) {
            self.below += 1;
            self.first.get_or_insert_with(|| format!("{sample:?} at {x:?}: along the direction {along}"));
        }
        if differs(at.pdf_direction(sample.direction), along, 1e-2) {
            self.boundary += 1;
        }
    }
}

/// Makes the shading point of a number.
type MakePoint = fn(usize, &Scene, &mut Pcg32) -> ShadingPoint;

/// Samples of one random scene. One of `every` is also looked up as a direction.
fn examine(number: usize, samples: usize, every: usize, make: MakePoint) -> Counts {
    let mut pcg = Pcg32::new(number as u64, 15);
    let scene = random_scene(number, &mut pcg);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let mut counts = Counts::default();
    for point in 0..POINTS {
        let x = make(number + point, &scene, &mut pcg);
        let at = lights.at(&x);
        for i in 0..samples / POINTS {
            // A direction leads to the same cell only where the point is not on the rim of one: plain numbers then.
            let direction = i % every == 0 && (number + point) % 10 < 7 && !MOVED.contains(&(number % 8));
            let u = core::array::from_fn(|_| if direction { pcg.f32() } else { hostile(&mut pcg) });
            match at.sample(u) {
                Some(sample) => {
                    counts.check(&at, &x, &sample);
                    if direction {
                        counts.check_direction(&at, &x, &sample);
                    }
                }
                None => {
                    counts.samples += 1;
                    counts.none += 1;
                }
            }
        }
    }
    counts
}

/// With this many samples of a scene in the full tier.
fn examine_all(full: usize, make: MakePoint) {
    let mut all = Counts::default();
    let scenes = tier().scenes;
    let samples = agreement(scenes, full);
    // Directions would take most of the time.
    let every = 10;
    parallel::map(scenes, |i| examine(i, samples, every, make)).into_iter().for_each(|counts| all.add(counts));
    println!(
        "{} samples, {} of them None: {} mismatches, worst {:e}, {} not finite; {} directions: {} below the sample's \
         density, {} found with another",
        all.samples, all.none, all.mismatches, all.worst, all.broken, all.directions, all.below, all.boundary
    );
    let first = all.first.unwrap_or_default();
    assert_eq!([all.mismatches, all.broken, all.below], [0; 3], "mismatches, not finite, below; the first: {first}");
    assert!(all.samples - all.none > all.samples / 3, "too few samples to mean anything");
    let rate = all.boundary as f64 / all.directions as f64;
    assert!(rate < 1e-4, "the density of a direction differs at a rate of {rate:e}");
}

/// Ten million of them in the full tier.
#[test]
fn samples_have_the_density_that_pdf_finds() {
    examine_all(25_000, shading_point);
}

/// Densities are those of other trees all the same: a million are enough in the full tier.
#[test]
fn samples_for_lobes_have_the_density_that_pdf_finds() {
    examine_all(2500, shading_point_with_lobe);
}

#[test]
fn samples_for_microfacets_have_the_density_that_pdf_finds() {
    examine_all(1000, shading_point_with_microfacets);
}

#[test]
fn a_density_of_another_cell_is_told_apart() {
    let mut scene =
        Scene::random(&mut Pcg32::new(3, 16), Content { triangles: 10, textured: true, sky: 0, two_sided: true });
    scene.rotation = glam::Mat3::IDENTITY;
    let lights = build(&scene, Arity::Eight);
    let mut pcg = Pcg32::new(4, 16);
    let x = random_point(&mut pcg, 2);
    let mut counts = Counts::default();
    for _ in 0..1000 {
        let mut sample = lights.at(&x).sample(pcg.cube()).expect("everything is visible");
        sample.pdf *= 1.0 + 3e-5;
        counts.check(&lights.at(&x), &x, &sample);
    }
    assert_eq!(counts.mismatches, 1000);
}

#[test]
fn split_samples_have_the_density_that_pdf_split_finds() {
    let check = |number: usize| {
        let mut pcg = Pcg32::new(number as u64, 17);
        let scene = random_scene(number, &mut pcg);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        let splitting = Splitting::new([0.3, 0.7, 0.95, 1.0][number % 4], 1 + (number % 3) as u32);
        let (mut count, mut most) = (0, 0);
        for point in 0..40 {
            let x = shading_point(number + point, &scene, &mut pcg);
            for _ in 0..20 {
                let u = core::array::from_fn(|_| hostile(&mut pcg));
                let samples = sample_split(&lights.at(&x), u, &splitting);
                most = most.max(samples.len());
                for sample in samples.iter().take(50) {
                    count += 1;
                    let pdf = lights.at(&x).pdf_split(&sample.hit().expect("a triangle"), &splitting);
                    assert!(!differs(pdf, sample.pdf, TOLERANCE), "{sample:?} at {x:?} with {splitting:?}: {pdf}");
                }
            }
        }
        (count, most)
    };
    let found = parallel::map(60, check);
    let most = found.iter().map(|f| f.1).max();
    let count = found.iter().map(|f| f.0).sum::<usize>();
    println!("{count} samples, up to {most:?} of one split");
    assert!(most > Some(20) && count > 50_000, "{count} samples, up to {most:?} of one split");
}

#[test]
fn environment_samples_have_the_density_that_pdf_finds() {
    for kind in 0..4 {
        let mut pcg = Pcg32::new(kind as u64, 18);
        let content = Content { triangles: 1, textured: false, sky: kind, two_sided: false };
        let environment = Scene::random(&mut pcg, content).environment();
        for _ in 0..50_000 {
            let sample = environment.sample([hostile(&mut pcg), hostile(&mut pcg)]).expect("it is not black");
            assert!(sample.direction.is_normalized() && sample.pdf > 0.0 && sample.pdf.is_finite());
            assert!(!differs(environment.pdf(sample.direction), sample.pdf, TOLERANCE), "{sample:?}");
            assert!(!differs(environment.radiance(sample.direction), sample.radiance, TOLERANCE), "{sample:?}");
        }
    }
}

/// A second build gives the same bits, and so does a sampler that went through bytes and draws many at once.
#[test]
fn samples_are_reproducible_to_the_bit() {
    let bits = |sample: &Option<LightSample>| {
        sample.map(|s| {
            let [p, n, d] = [s.position, s.normal, s.direction].map(|v| v.to_array().map(f32::to_bits));
            let scalars = [s.distance, s.pdf, s.pdf_area, s.pmf].map(f32::to_bits);
            (
                s.hit().expect("a triangle").triangle,
                s.hit().expect("a triangle").barycentrics.map(f32::to_bits),
                p,
                n,
                d,
                scalars,
            )
        })
    };
    let mut lit = 0;
    let numbers = some(40);
    for &number in &numbers {
        let mut pcg = Pcg32::new(number as u64, 19);
        let scene = random_scene(number, &mut pcg);
        let arities = ARITIES[number % ARITIES.len()];
        let queries: Vec<_> = (0..500)
            .map(|i| (shading_point(i, &scene, &mut pcg), core::array::from_fn(|_| hostile(&mut pcg))))
            .collect();
        let (first, second) = (build(&scene, arities), build(&scene, arities));
        assert_eq!(first.to_bytes(), second.to_bytes());
        let loaded = sample_from_bytes(&first, &queries);
        let mut some = 0;
        for ((x, u), loaded) in queries.iter().zip(&loaded) {
            let sample = bits(&first.at(x).sample(*u));
            assert_eq!(sample, bits(&second.at(x).sample(*u)));
            assert_eq!(sample, bits(loaded));
            some += usize::from(sample.is_some());
        }
        assert!(some > 0 || !scene.images.is_empty(), "{}", scene.name);
        lit += usize::from(some > 0);
    }
    // One triangle does not reach the only texel of its image that is not black.
    assert!(lit + 1 >= numbers.len(), "only {lit} of {} scenes are lit", numbers.len());
}

/// The candidates that a target gets are the samples of the same numbers, to the bit and in their order, although their
/// walks are interleaved.
#[test]
fn candidates_of_resampling_are_samples() {
    let mut candidates = 0;
    let scenes = some(40);
    for &number in &scenes {
        let mut pcg = Pcg32::new(number as u64, 22);
        let scene = random_scene(number, &mut pcg);
        let lights = build(&scene, ARITIES[number % ARITIES.len()]);
        for point in 0..30 {
            let make = [shading_point, shading_point_with_lobe, shading_point_with_microfacets][point % 3];
            let at = lights.at(&make(number + point, &scene, &mut pcg));
            // Slices that end within a group of interleaved walks, and at its end.
            let numbers: Vec<[f32; 3]> =
                (0..[1, 7, 8, 13, 32][point % 5]).map(|_| core::array::from_fn(|_| hostile(&mut pcg))).collect();
            let expected: Vec<String> =
                numbers.iter().filter_map(|u| at.sample(*u)).map(|sample| format!("{sample:?}")).collect();
            let mut found = Vec::new();
            let chosen = at.sample_resampled(&numbers, pcg.f32(), |sample| {
                found.push(format!("{sample:?}"));
                1.0
            });
            assert_eq!(found, expected, "{}", scene.name);
            assert_eq!(chosen.is_some(), !found.is_empty());
            candidates += found.len();
        }
    }
    assert!(candidates > 100 * scenes.len(), "only {candidates} candidates");
}

/// Two openings behind each other: the density of a direction is the sum over both, and more than either.
#[test]
fn the_density_of_a_direction_counts_every_portal() {
    let outer = LightMesh::quad(Vec3::new(-2.0, -2.0, 2.0), 4.0 * Vec3::Y, 4.0 * Vec3::X).portal();
    let inner = LightMesh::quad(Vec3::new(-0.5, -0.5, 1.0), Vec3::Y, Vec3::X).portal().paint(Paint::Constant(0.5));
    let lights = build(&Scene::new("nested", vec![outer, inner]), Arity::Eight);
    let mut pcg = Pcg32::new(1, 20);
    let x = ShadingPoint::new(Vec3::new(0.1, -0.1, 0.0), Receiver::Surface(Vec3::Z));
    let (mut both, mut one) = (0, 0);
    for _ in 0..10_000 {
        let sample = lights.at(&x).sample(pcg.cube()).expect("both are above the horizon");
        let along = lights.at(&x).pdf_sample_direction(&sample);
        if along > sample.pdf { both += 1 } else { one += 1 }
    }
    assert!(both > 1000 && one > 1000, "{both} {one}");
}

/// A window that faces the dark part of a sky of such a contrast that the dark relative to the mean is nothing in
/// single precision.
#[test]
fn what_is_dark_next_to_a_very_bright_sky_is_sampled() {
    let window = LightMesh::quad(Vec3::new(-0.02, -0.02, 1.0), 0.04 * Vec3::Y, 0.04 * Vec3::X).portal();
    let mut scene = Scene::new("contrast", vec![window.clone(), window]);
    let texel = |i: usize| match i {
        0..64 => 1e-28,
        64..120 => 1e28,
        _ => 0.0,
    };
    scene.sky = Sky::LatLong { size: [16, 8], texels: (0..16 * 8).map(texel).collect() };
    let lights = build(&scene, Arity::Sixteen);
    let mut pcg = Pcg32::new(1, 21);
    let x = ShadingPoint::new(Vec3::ZERO, Receiver::Surface(Vec3::Z));
    let some = (0..100).filter(|_| lights.at(&x).sample(pcg.cube()).is_some()).count();
    assert_eq!(some, 100);
}
