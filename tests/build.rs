//! Builds of many lights: no input takes long, no number of threads changes a bit, and a host can follow and stop one.

#[expect(dead_code, reason = "every test uses a part of what they share")]
mod common;

use core::ops::ControlFlow;
use core::sync::atomic::{AtomicUsize, Ordering};
use core::time::Duration;
use std::sync::Mutex;
use std::time::Instant;

use common::pcg::Pcg32;
use fanlight::{LightSampler, LightSamplerBuilder, Mesh};
use glam::Vec3;

const MANY: u32 = 1_000_000;
/// Where a build takes a few seconds at most, and one that compares all pairs an hour.
const LONG: Duration = Duration::from_secs(60);

/// A mesh of small triangles at centres; far away larger ones, so that rounding leaves them an area.
fn add(builder: &mut LightSamplerBuilder<'_>, count: u32, center: impl Fn(u32) -> Vec3) {
    let corners = [Vec3::ZERO, Vec3::new(1e-3, 0.0, 0.0), Vec3::new(0.0, 1e-3, 2e-4)];
    let place = |i: u32, corner: Vec3| center(i) + corner * (1.0 + center(i).length());
    let positions: Vec<Vec3> = (0..count).flat_map(|i| corners.map(|corner| place(i, corner))).collect();
    let indices: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    builder.add_mesh(&Mesh::emitter(&positions, &indices)).expect("the mesh is valid");
}

fn random(count: u32) -> LightSamplerBuilder<'static> {
    let mut pcg = Pcg32::new(1, 41);
    let mut builder = LightSampler::builder();
    let centers: Vec<Vec3> = (0..count).map(|_| Vec3::from(pcg.cube())).collect();
    add(&mut builder, count, |i| centers[i as usize]);
    builder
}

fn assert_quick(what: &str, center: impl Fn(u32) -> Vec3) {
    let mut builder = LightSampler::builder();
    add(&mut builder, MANY, center);
    let start = Instant::now();
    let lights = builder.build().expect("there are not too many triangles");
    let time = start.elapsed();
    println!("{what}: {time:?}");
    assert!(time < LONG, "{what} takes {time:?}");
    assert_eq!(lights.as_view().light_count(), MANY as usize);
}

#[test]
fn coincident_triangles_take_no_longer() {
    assert_quick("coincident", |_| Vec3::splat(0.5));
}

#[test]
fn sorted_triangles_take_no_longer() {
    assert_quick("in a row", |i| Vec3::new(i as f32, 0.0, 0.0));
    assert_quick("in a row backwards", |i| Vec3::new(0.0, -(i as f32), 0.0));
}

/// Every split in bins takes off the last few.
#[test]
fn triangles_at_growing_distances_take_no_longer() {
    assert_quick("exponential", |i| Vec3::new((i as f32 / MANY as f32 * 80.0 - 60.0).exp2(), 0.0, 0.0));
    assert_quick("two heaps and one far away", |i| match i {
        0 => Vec3::splat(1e8),
        _ => Vec3::splat((i % 2) as f32),
    });
}

/// Large enough to be built in parts.
const IN_PARTS: u32 = 150_000;

#[test]
fn a_build_gives_the_same_bits_again() {
    let bytes = || random(IN_PARTS).build().expect("there are not too many triangles").to_bytes();
    assert!(bytes() == bytes());
}

#[cfg(feature = "rayon")]
#[test]
fn the_number_of_threads_changes_nothing() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| random(IN_PARTS).build().expect("there are not too many triangles").to_bytes())
    };
    let one = bytes(1);
    for threads in [2, 3, 7] {
        assert!(bytes(threads) == one, "{threads} threads");
    }
}

#[test]
fn progress_goes_from_nothing_to_one() {
    let reports = Mutex::new(Vec::new());
    let report = |share: f32| {
        reports.lock().expect("no report panics").push(share);
        ControlFlow::Continue(())
    };
    let lights = random(IN_PARTS).build_with(report).expect("there are not too many triangles");
    let reports = reports.into_inner().expect("no report panics");
    assert!(reports.len() > 20, "{reports:?}");
    assert!(reports.iter().all(|share| (0.0..=1.0).contains(share)));
    assert_eq!(reports.last(), Some(&1.0));
    let mut sorted = reports.clone();
    sorted.sort_by(f32::total_cmp);
    let largest_step = sorted.windows(2).map(|pair| pair[1] - pair[0]).fold(sorted[0], f32::max);
    assert!(largest_step < 0.2, "{sorted:?}");
    #[cfg(not(feature = "rayon"))]
    assert_eq!(sorted, reports);
    // Whoever looks on changes nothing.
    assert_eq!(lights.to_bytes(), random(IN_PARTS).build().expect("there are not too many triangles").to_bytes());
}

#[test]
fn a_build_can_be_cancelled() {
    for (count, calls) in [(3, 1), (IN_PARTS, 1), (IN_PARTS, 5)] {
        let called = AtomicUsize::new(0);
        let report = |_| {
            let number = called.fetch_add(1, Ordering::Relaxed) + 1;
            if number >= calls { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let error = random(count).build_with(report).map(drop).expect_err("it was cancelled");
        assert!(error.is_cancelled() && error.to_string().contains("cancelled"), "{error}");
        // Other threads may be on their way to report.
        assert!(called.into_inner() < calls + 64);
    }
    let nothing = LightSamplerBuilder::<8>::new().build_with(|_| ControlFlow::Break(()));
    assert!(nothing.is_err_and(|error| error.is_cancelled()));
}
