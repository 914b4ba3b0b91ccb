//! Builds of many lights: no input takes long, no number of threads changes a bit, and a host can follow and stop one.

use core::ops::ControlFlow;
use core::sync::atomic::{AtomicUsize, Ordering};
use core::time::Duration;
use std::sync::{Mutex, OnceLock};
use std::time::Instant;

use crate::common::pcg::Pcg32;
use crate::common::tier::tier;
use fanlight::{Arity, Environment, EnvironmentImage, LightSampler, LightSamplerBuilder, Mesh, Texture, Weight};
use glam::{Vec2, Vec3};

/// How many times as long as a build of as many triangles at random one of any others may take. One that compares all
/// pairs takes hours.
const LONGER: u32 = 5;

/// A mesh of small triangles at centers; far away larger ones, so that rounding leaves them an area.
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

fn time(builder: LightSamplerBuilder<'_>) -> Duration {
    let start = Instant::now();
    let lights = builder.build().expect("there are not too many triangles");
    let time = start.elapsed();
    assert_eq!(lights.as_view().light_count(), tier().triangles as usize);
    time
}

fn assert_quick(what: &str, center: impl Fn(u32) -> Vec3) {
    // Once for all tests; they run at the same time, on the same machine.
    static RANDOM: OnceLock<Duration> = OnceLock::new();
    let limit = LONGER * *RANDOM.get_or_init(|| time(random(tier().triangles)));
    let mut builder = LightSampler::builder();
    add(&mut builder, tier().triangles, center);
    let time = time(builder);
    println!("{what}: {time:?}");
    assert!(time < limit, "{what} takes {time:?}, more than {limit:?}");
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
    assert_quick("exponential", |i| Vec3::new((i as f32 / tier().triangles as f32 * 80.0 - 60.0).exp2(), 0.0, 0.0));
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
    let nothing = LightSampler::builder().arity(Arity::Eight).build_with(|_| ControlFlow::Break(()));
    assert!(nothing.is_err_and(|error| error.is_cancelled()));
}

/// Many triangles, each with coordinates of its own, over a small image, whose memory does not suffice for all, and
/// over a large one.
fn textured<'a>(small: &'a [f32], large: &'a [f32]) -> LightSamplerBuilder<'a> {
    let mut builder = LightSampler::builder();
    let images = [Texture::new(16, 16, small), Texture::new(256, 256, large)].map(|t| t.expect("texels are finite"));
    let images = images.map(|image| builder.add_texture(image));
    let mut pcg = Pcg32::new(3, 41);
    for i in 0..300 {
        let uvs: Vec<Vec2> = (0..3).map(|_| Vec2::new(pcg.f32(), pcg.f32())).collect();
        let positions: Vec<Vec3> = uvs.iter().map(|uv| uv.extend(i as f32)).collect();
        let weight = Weight::Texture(images[usize::from(i % 7 == 0)]);
        builder.add_mesh(&Mesh::portal(&positions, &[[0, 1, 2]]).uvs(&uvs).weight(weight)).expect("the mesh is valid");
    }
    builder
}

fn noise(count: usize) -> Vec<f32> {
    let mut pcg = Pcg32::new(4, 41);
    (0..count).map(|_| pcg.f32().powi(4)).collect()
}

#[cfg(feature = "rayon")]
#[test]
fn the_number_of_threads_changes_no_tree_over_an_image() {
    let (small, large) = (noise(256), noise(1 << 16));
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| textured(&small, &large).build().expect("there are not too many triangles").to_bytes())
    };
    let one = bytes(1);
    for threads in [2, 7] {
        assert!(bytes(threads) == one, "{threads} threads");
    }
}

#[test]
fn trees_over_images_are_part_of_the_progress() {
    let (small, large) = (noise(256), noise(1 << 16));
    let reports = Mutex::new(Vec::new());
    let report = |share: f32| {
        reports.lock().expect("no report panics").push(share);
        ControlFlow::Continue(())
    };
    textured(&small, &large).build_with(report).expect("there are not too many triangles");
    let mut reports = reports.into_inner().expect("no report panics");
    assert_eq!(reports.last(), Some(&1.0));
    reports.sort_by(f32::total_cmp);
    let largest_step = reports.windows(2).map(|pair| pair[1] - pair[0]).fold(reports[0], f32::max);
    assert!(largest_step < 0.1, "{reports:?}");
    let cancelled = textured(&small, &large)
        .build_with(|share| if share > 0.3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) });
    assert!(cancelled.is_err_and(|error| error.is_cancelled()));
}

#[test]
fn environments_report_progress_and_can_be_cancelled() {
    let luminance = noise(256 * 128);
    let image = EnvironmentImage::lat_long(256, 128, &luminance);
    let reports = Mutex::new(Vec::new());
    let report = |share: f32| {
        reports.lock().expect("no report panics").push(share);
        ControlFlow::Continue(())
    };
    let environment = Environment::new_with(&image, report).expect("texels are finite");
    let mut reports = reports.into_inner().expect("no report panics");
    assert_eq!(reports.last(), Some(&1.0));
    reports.sort_by(f32::total_cmp);
    let largest_step = reports.windows(2).map(|pair| pair[1] - pair[0]).fold(reports[0], f32::max);
    assert!(largest_step < 0.1, "{reports:?}");
    // Whoever looks on changes nothing.
    let alone = Environment::new(&image).expect("texels are finite");
    assert_eq!(environment.mean().to_bits(), alone.mean().to_bits());
    for calls in [1, 100, 1000] {
        let called = AtomicUsize::new(0);
        let report = |share| {
            let number = called.fetch_add(1, Ordering::Relaxed) + 1;
            if number >= calls || share == 1.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        assert!(Environment::new_with(&image, report).is_err_and(|error| error.is_cancelled()));
        assert!(called.into_inner() < calls + 64);
    }
    assert!(Environment::new_with(&image, |_| ControlFlow::Break(())).is_err_and(|error| error.is_cancelled()));
}
