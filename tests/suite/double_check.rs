//! The densities of very many samples of random scenes: as many as the environment variable `SAMPLES` asks for.
//!
//! `SAMPLES=1e9 cargo test --release --test suite -- double_check --ignored --nocapture`; with `FIRST=3400` before it,
//! from that scene on.

use core::fmt::Write;
use std::path::Path;
use std::time::Instant;

use crate::checks;
use crate::common::hostile::{hostile, random_scene, shading_point};
use crate::common::lights::{ARITIES, build};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::random_point;
use crate::kinds::pdf_again;
use fanlight::{LightSample, LightSampler, ShadingPoint};

/// Largest relative difference of two densities of one point.
const TOLERANCE: f64 = 1e-5;
/// Shading points of a scene, and samples of each.
const POINTS: usize = 50;
const SAMPLES: usize = 2000;
/// Scenes after which it says how far it has come.
const BLOCK: usize = 200;
/// Mismatches of which the log tells.
const LOGGED: usize = 1000;

#[derive(Default)]
struct Counts {
    samples: u64,
    none: u64,
    mismatches: u64,
    worst: f64,
    log: Vec<String>,
}

impl Counts {
    fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.none += other.none;
        self.mismatches += other.mismatches;
        self.worst = self.worst.max(other.worst);
        self.log.extend(other.log.into_iter().take(LOGGED - self.log.len().min(LOGGED)));
    }

    fn check(&mut self, scene: usize, x: &ShadingPoint, sample: &LightSample, pdf: f32) {
        let difference = (f64::from(pdf) / f64::from(sample.pdf) - 1.0).abs();
        let is_number = difference.is_finite() && sample.direction.is_normalized() && sample.distance > 0.0;
        if is_number {
            self.worst = self.worst.max(difference);
        }
        if !(is_number && difference <= TOLERANCE) {
            self.mismatches += 1;
            if self.log.len() < LOGGED {
                self.log.push(format!("scene {scene}, {x:?}: {sample:?}, but pdf {pdf}"));
            }
        }
    }
}

/// Lights of a number, and points around them. Every fourth scene is made of random bytes, as a fuzzer's are.
fn scene(number: usize, pcg: &mut Pcg32) -> (LightSampler, Vec<ShadingPoint>) {
    if number.is_multiple_of(4) {
        let mut any_point = |i: usize| {
            let mut x = random_point(pcg, i);
            x.position *= if i.is_multiple_of(3) { 16.0 } else { 1.0 };
            if i.is_multiple_of(5) {
                x.position = (16.0 * x.position).round() / 16.0;
            }
            x
        };
        let points = (0..POINTS).map(&mut any_point).collect();
        loop {
            let bytes: Vec<u8> = (0..1500).map(|_| pcg.u32() as u8).collect();
            if let Some(lights) = checks::build::lights(&mut checks::reader::Reader::new(&bytes)) {
                return (lights, points);
            }
        }
    }
    let scene = random_scene(number, pcg);
    let points = (0..POINTS).map(|i| shading_point(number + i, &scene, pcg)).collect();
    (build(&scene, ARITIES[number % ARITIES.len()]), points)
}

fn examine(number: usize) -> Counts {
    let mut pcg = Pcg32::new(number as u64, 71);
    let (lights, points) = scene(number, &mut pcg);
    let mut counts = Counts::default();
    for x in points {
        let at = lights.at(&x);
        for i in 0..SAMPLES {
            let u = if i % 4 == 0 { core::array::from_fn(|_| hostile(&mut pcg)) } else { pcg.cube() };
            counts.samples += 1;
            match at.sample(u) {
                Some(sample) => counts.check(number, &x, &sample, pdf_again(&at, &sample)),
                None => counts.none += 1,
            }
        }
    }
    counts
}

#[test]
#[ignore = "as long as SAMPLES asks for; SAMPLES=1e9 cargo test --release --test suite -- double_check --ignored --nocapture"]
fn all_samples_have_the_density_that_pdf_finds() {
    let samples: f64 = std::env::var("SAMPLES").map_or(1e6, |samples| samples.parse().expect("a number of samples"));
    let scenes = (samples / (POINTS * SAMPLES) as f64).ceil() as usize;
    let first: usize = std::env::var("FIRST").map_or(0, |first| first.parse().expect("the number of a scene"));
    let clock = Instant::now();
    let mut all = Counts::default();
    let mut summary = String::new();
    for start in (first..scenes).step_by(BLOCK) {
        let count = BLOCK.min(scenes - start);
        parallel::map(count, |i| examine(start + i)).into_iter().for_each(|counts| all.add(counts));
        summary = format!(
            "{} samples of scenes {first} to {}, {} of them None: {} mismatches above {TOLERANCE:e}, worst difference {:.1e}, {:.0} s",
            all.samples,
            start + count - 1,
            all.none,
            all.mismatches,
            all.worst,
            clock.elapsed().as_secs_f64()
        );
        println!("{summary}");
    }
    let mut text = summary;
    all.log.iter().for_each(|line| write!(text, "\n{line}").expect("a string can grow"));
    let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join("double_check.log");
    std::fs::write(&log, text + "\n").expect("the log can be written");
    assert_eq!(all.mismatches, 0, "see {}", log.display());
    assert!(3 * all.none < 2 * all.samples, "too few samples to mean anything");
}

/// What the check is worth: a density that is off by twice the tolerance is counted and logged.
#[test]
fn a_wrong_density_is_a_mismatch() {
    let mut pcg = Pcg32::new(1, 71);
    let (lights, points) = scene(2, &mut pcg);
    let mut counts = Counts::default();
    let mut found = 0;
    for x in &points {
        let at = lights.at(x);
        if let Some(sample) = at.sample(pcg.cube()) {
            found += 1;
            counts.check(2, x, &sample, sample.pdf * (1.0 + 2.0 * TOLERANCE as f32));
            counts.check(2, x, &sample, f32::NAN);
            counts.check(2, x, &sample, at.pdf(&sample.hit().expect("a triangle")));
        }
    }
    assert!(found > 10 && counts.mismatches == 2 * found && counts.log.len() == 2 * found as usize);
}
