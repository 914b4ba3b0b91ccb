//! A sampler that has been edited holds the same lights as one that is built anew, and keeps the same promises.

mod world;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

use crate::common::lights::{aligned, sample_from_bytes};
use crate::common::pcg::Pcg32;
use crate::common::tier::tier;
use fanlight::{LightSampler, LightSamplerView, SampledLight, ShadingPoint};
use glam::Vec3;
use world::World;

/// A shading point that every light of a world can send to: in a volume, which two-sided lights and spheres always reach.
fn volume(pcg: &mut Pcg32) -> ShadingPoint {
    ShadingPoint::volume(4.0 * Vec3::from_array(pcg.cube()) - 2.0)
}

/// Compares an edited sampler with a fresh build of the same lights.
fn compare(world: &World, lights: &LightSampler, pcg: &mut Pcg32) -> Result<(), TestCaseError> {
    let fresh = world.build();
    prop_assert_eq!(lights.light_count(), fresh.lights.light_count());
    let words = aligned(&lights.to_bytes());
    let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words));
    prop_assert!(loaded.is_ok(), "{:?}", loaded.err());
    let mut points = Vec::new();
    for _ in 0..4 {
        let x = volume(pcg);
        let (at, other) = (lights.at(&x), fresh.lights.at(&x));
        let mut sums = [0.0f64; 2];
        for (light, new) in world.lights().zip(&fresh.ids) {
            let [own, built] = [light.pmf(&at), new.pmf(&other)];
            let is_known = !world.is_doubtful(light);
            prop_assert!(!is_known || (own > 0.0) == (built > 0.0), "{light:?}: {own}, but {built} in a fresh build");
            sums = [sums[0] + f64::from(own), sums[1] + f64::from(built)];
        }
        // Nothing is left out, and nothing counts twice.
        prop_assert!(sums.iter().all(|sum| *sum < 1.0 + 1e-4), "{sums:?}");
        if world.is_complete() {
            prop_assert!((sums[0] - sums[1]).abs() < 1e-4, "{sums:?}");
            prop_assert!(sums[1] == 0.0 || sums[1] > 1.0 - 1e-4, "{sums:?}");
        }
        for _ in 0..8 {
            let u = pcg.cube();
            points.push((x, u));
            let Some(sample) = at.sample(u) else { continue };
            prop_assert!(world.holds(&sample.light), "{:?} is no light", sample.light);
            let again = match sample.light {
                SampledLight::Triangle(hit) => at.pdf(&hit),
                SampledLight::Shape(id) => at.pdf_light(id, sample.direction),
                SampledLight::Punctual(id) => at.pmf_light(id),
                _ => at.pdf_environment(sample.direction),
            };
            prop_assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{:?}: {again}, {}", sample.light, sample.pdf);
        }
    }
    let own: Vec<_> = points.iter().map(|(x, u)| lights.at(x).sample(*u)).collect();
    prop_assert_eq!(own, sample_from_bytes(lights, &points));
    Ok(())
}

/// Edits of any kind, in batches of any size.
#[test]
fn random_edits_leave_the_lights_of_a_fresh_build() {
    let config = Config { cases: tier().cases / 2, rng_seed: RngSeed::Fixed(17), failure_persistence: None, ..Config::default() };
    let edits = prop::collection::vec(any::<[u16; 3]>(), 0..150);
    let run = TestRunner::new(config).run(&(0..12usize, 0..40usize, edits, any::<u64>()), |(kind, count, edits, seed)| {
        let mut pcg = Pcg32::new(seed, 71);
        let mut world = World::random(&mut pcg, kind, count);
        let mut lights = world.build().lights;
        let batches = 1 + pcg.below(8);
        for batch in edits.chunks(edits.len().div_ceil(batches).max(1)) {
            let mut edit = lights.edit();
            for &numbers in batch {
                world.edit(&mut edit, numbers, &mut pcg).map_err(|error| TestCaseError::fail(error.to_string()))?;
            }
            edit.apply().map_err(|error| TestCaseError::fail(error.to_string()))?;
            compare(&world, &lights, &mut pcg)?;
        }
        Ok(())
    });
    if let Err(error) = run {
        panic!("{error}");
    }
}
