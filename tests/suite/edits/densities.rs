//! Densities of samples of an edited sampler, looked up again.

use super::world::{KINDS, World};
use crate::common::hostile::hostile;
use crate::common::lights::sample_split;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::with_lobe;
use crate::common::tier::{agreement, some};
use crate::instances::pmf;
use crate::kinds::pdf_again;
use fanlight::{LightSample, LightSampler, Receiver, SampledLight, ShadingPoint, Splitting};
use glam::Vec3;

/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;
/// Samples of a batch of edits, at least as long as there are more than a few batches.
const SAMPLES: usize = 5000;
/// Samples of a shading point.
const POINT_SAMPLES: usize = 50;
/// Most lamps, most meshes and most instances.
const MOST: usize = 400;

/// Samples that are drawn, and how many of these are of triangles, of triangles of instances, of lamps with and of lamps
/// without an extent.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    edits: usize,
    batches: usize,
    drawn: usize,
    found: [usize; 4],
}

impl Counts {
    fn plus(self, other: Self) -> Self {
        Self {
            edits: self.edits + other.edits,
            batches: self.batches + other.batches,
            drawn: self.drawn + other.drawn,
            found: core::array::from_fn(|i| self.found[i] + other.found[i]),
        }
    }
}

fn close(a: f32, b: f32) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

fn point(pcg: &mut Pcg32) -> ShadingPoint {
    let normal = pcg.direction();
    let receiver = [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][pcg.below(3)];
    let x = ShadingPoint::new(5.0 * Vec3::from_array(pcg.cube()) - 2.5, receiver);
    let x = if pcg.below(4) == 0 { with_lobe(x, pcg, 1e-2) } else { x };
    x.with_groups([u32::MAX, 1, 6, 15][pcg.below(4)]).at_time(pcg.within(-0.2, 1.2))
}

/// All other densities of a sample, and of those of a split tree.
fn check_others(lights: &LightSampler, x: &ShadingPoint, u: [f32; 3], sample: &LightSample) {
    let at = lights.at(x);
    let pmf = match sample.light {
        SampledLight::Triangle(hit) => pmf(&at, &hit),
        SampledLight::Shape(id) | SampledLight::Punctual(id) => at.pmf_light(id),
        _ => panic!("another kind of light"),
    };
    assert!(close(pmf, sample.pmf) || pmf > sample.pmf, "{x:?} {sample:?}: {pmf}");
    let along = at.pdf_sample_direction(sample);
    assert!(along >= sample.pdf * (1.0 - TOLERANCE as f32) && along.is_finite(), "{x:?} {sample:?}: {along}");
    let mut many = [None];
    lights.sample_many(&[(*x, u)], &mut many);
    assert_eq!(many[0].as_ref(), Some(sample));
    let splitting = Splitting::new(0.7, 2);
    for sample in sample_split(&at, u, &splitting).iter().take(4) {
        let pdf = match sample.light {
            SampledLight::Triangle(hit) => at.pdf_split(&hit, &splitting),
            SampledLight::Shape(id) => at.pdf_split_light(id, sample.direction, &splitting),
            _ => continue,
        };
        assert!(close(pdf, sample.pdf), "{x:?} {sample:?}: {pdf}");
    }
}

/// Draws samples at random points. One of `every` is asked for all densities.
fn check(world: &World, lights: &LightSampler, pcg: &mut Pcg32, samples: usize, every: usize) -> Counts {
    let mut counts = Counts { batches: 1, ..Counts::default() };
    while counts.drawn < samples {
        let x = point(pcg);
        let at = lights.at(&x);
        for _ in 0..POINT_SAMPLES {
            counts.drawn += 1;
            let u = core::array::from_fn(|_| hostile(pcg));
            let Some(sample) = at.sample(u) else { continue };
            let pdf = pdf_again(&at, &sample);
            assert!(close(pdf, sample.pdf), "{x:?} {sample:?}: {pdf}");
            assert!(world.holds(&sample.light), "{:?} is no light", sample.light);
            let kind = match sample.light {
                SampledLight::Triangle(hit) => usize::from(hit.instance.is_some()),
                SampledLight::Shape(_) => 2,
                _ => 3,
            };
            counts.found[kind] += 1;
            if counts.drawn % every == 0 {
                check_others(lights, &x, u, &sample);
            }
        }
    }
    counts
}

/// Lamps, meshes and instances that stand still or move, seen from points of all kinds, groups and times: what an edited
/// sampler finds later is what its sample says, after any batches of edits.
#[test]
fn densities_of_samples_are_found_again_after_edits() {
    let (sizes, kinds) = ([0, 5, 60, 300], 2 * KINDS);
    let rounds = some(2 * sizes.len() * kinds);
    let samples = agreement(rounds.len(), 16_000);
    let batches = (samples / SAMPLES).max(8);
    // Where there are many, the rest would take most of the time.
    let every = if batches > 8 { 40 } else { 4 };
    let found = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 78);
        let has_extents = number / kinds % 2 == 1;
        let mut world = World::with(&mut pcg, number % kinds, sizes[number / kinds / 2], has_extents);
        let mut lights = world.build().lights;
        let mut counts = Counts::default();
        for _ in 0..batches {
            let mut edits = lights.edit();
            let count = [1, 8, 60, 200][pcg.below(4)];
            for _ in 0..count {
                let numbers = [0; 3].map(|_| pcg.u32() as u16);
                world.edit(&mut edits, numbers, &mut pcg).expect("the edit is valid");
            }
            world.shrink_to(&mut edits, MOST).expect("the lights are there");
            edits.apply().expect("the lights are few");
            counts = counts.plus(check(&world, &lights, &mut pcg, samples.div_ceil(batches), every));
            counts.edits += count;
        }
        counts
    });
    let all = found.into_iter().fold(Counts::default(), Counts::plus);
    println!(
        "{} samples after {} batches of {} edits, {} of them None, {:?} of triangles, of instances, of lamps with and \
         without an extent: 0 mismatches above {TOLERANCE:e}",
        all.drawn,
        all.batches,
        all.edits,
        all.drawn - all.found.iter().sum::<usize>(),
        all.found
    );
    assert!(all.found.iter().all(|count| 1000 * count > all.drawn), "{all:?}");
}
