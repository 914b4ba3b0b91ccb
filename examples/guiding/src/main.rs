//! A guided path tracer, of the kind of Müller, Gross and Novák (2017), that learns from nothing, from what `fanlight`
//! knows of the lights, and from what it knows with a table of what walls hide.
//!
//! `cargo run --release --manifest-path examples/guiding/Cargo.toml -- [FIGURE.svg]`. Nothing samples lights: paths
//! find them by the directions that the guide draws, and all calls of `fanlight` are made before the first path.

mod figure;
mod guide;
mod quadtree;
mod random;
mod scene;

use core::f32::consts::{PI, TAU};

use fanlight::glam::{Vec2, Vec3, vec3};
use fanlight::{LightSample, LightSampler, ShadingPoint, Visibility};
use guide::Guide;
use random::Random;
use rustix::time::{ClockId, clock_gettime};
use scene::{ALBEDO, ROOM, Scene};

/// Pixels: points of the floor of the first room.
const SIZE: [u16; 2] = [48, 48];
/// Surfaces that light may touch on its way.
const BOUNCES: u32 = 4;
/// Each pass has twice as many samples a pixel as the one before, from one on.
const PASSES: u32 = 8;
/// Runs with other random numbers, of which figures are means.
const SEEDS: u64 = 4;
/// Samples of a pixel of the reference.
const REFERENCE: u32 = 256;
/// Rays that learn what walls hide.
const RAYS: u64 = 20_000;
/// Points whose regions are filled.
const POINTS: usize = 10_000;
/// Share of the directions that are drawn by the cosine. *Chosen.*
const COSINE: f32 = 0.4;

/// What the guide starts with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    Nothing,
    Lights,
    Visibility,
}

/// What one pass came to, as the mean over all seeds.
#[derive(Clone, Copy, Default)]
struct Pass {
    /// Samples a pixel that the guide was trained with before.
    trained: u32,
    /// Error of one sample a pixel.
    error: f64,
    /// Error of the mean of all samples so far, and the time until then.
    error_so_far: f64,
    seconds: f64,
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let scene = Scene::new();
    let lights = scene.lights()?;
    let reference = reference(&scene, &lights)?;
    let mut curves = Vec::new();
    for (name, start) in [
        ("from nothing", Start::Nothing),
        ("from the lights", Start::Lights),
        ("from the lights and what walls hide", Start::Visibility),
    ] {
        let mut passes = [Pass::default(); PASSES as usize];
        for seed in 0..SEEDS {
            run(&scene, &lights, start, seed, &reference, &mut passes)?;
        }
        println!("\n{name}\n{:>10} {:>16} {:>16} {:>10}", "trained", "error a sample", "error so far", "seconds");
        for Pass { trained, error, error_so_far, seconds } in &passes {
            println!("{trained:>10} {error:>16.3} {error_so_far:>16.4} {seconds:>10.3}");
        }
        curves.push((name, passes));
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, figure::draw(&curves))?;
    }
    Ok(())
}

/// Renders all passes with one seed, and adds the errors to the means.
fn run(
    scene: &Scene,
    lights: &LightSampler,
    start: Start,
    seed: u64,
    reference: &[f64],
    passes: &mut [Pass],
) -> Result<(), fanlight::Error> {
    let mut random = Random::new(seed, 1);
    let begin = seconds();
    let mut guide = Guide::new();
    if start != Start::Nothing {
        let points = points(scene, &mut random);
        let table = (start == Start::Visibility).then(|| learn(scene, lights, &points)).transpose()?;
        let view = match &table {
            Some(table) => lights.with_visibility(table)?,
            None => lights.as_view(),
        };
        guide.fill(view, &points, &mut random);
    }
    let mut time = seconds() - begin;
    let (mut sum, mut count) = (vec![0.0; reference.len()], 0);
    for (number, pass) in (0..).zip(passes) {
        let samples = 1 << number;
        let begin = seconds();
        let mut image = vec![0.0; reference.len()];
        let mut recorder = Vec::new();
        for (pixel, value) in image.iter_mut().enumerate() {
            for _ in 0..samples {
                let x = floor(pixel, random.take());
                *value += f64::from(radiance(scene, &guide, x, Vec3::Z, 1, &mut random, &mut recorder));
            }
        }
        for (position, normal, direction, weight) in recorder {
            guide.record(position, normal, direction, weight);
        }
        guide.learn();
        time += seconds() - begin;
        sum.iter_mut().zip(&image).for_each(|(sum, value)| *sum += value);
        let share = 1.0 / SEEDS as f64;
        pass.trained = count;
        count += samples;
        pass.error += share * f64::from(samples) * error(&image, samples, reference);
        pass.error_so_far += share * error(&sum, count, reference);
        pass.seconds += share * time;
    }
    Ok(())
}

type Record = (Vec3, Vec3, Vec3, f32);

/// Radiance that a diffuse point reflects, by one path.
fn radiance(
    scene: &Scene,
    guide: &Guide,
    x: Vec3,
    normal: Vec3,
    bounce: u32,
    random: &mut Random,
    recorder: &mut Vec<Record>,
) -> f32 {
    let tree = guide.at(x, normal);
    let [choice, numbers @ ..]: [f32; 4] = random.take();
    let direction = match tree {
        Some(tree) if choice >= COSINE => tree.sample(numbers),
        _ => cosine_direction(normal, [numbers[0], numbers[1]]),
    };
    let cosine = normal.dot(direction);
    if cosine <= 0.0 {
        return 0.0;
    }
    let by_cosine = cosine / PI;
    let pdf = tree.map_or(by_cosine, |tree| COSINE * by_cosine + (1.0 - COSINE) * tree.pdf(direction));
    let Some(hit) = scene.trace(x, direction) else { return 0.0 };
    let mut arriving = hit.radiance;
    if bounce < BOUNCES {
        arriving += radiance(scene, guide, hit.position, hit.normal, bounce + 1, random, recorder);
    }
    let weight = arriving * cosine / pdf;
    recorder.push((x, normal, direction, weight));
    ALBEDO / PI * weight
}

/// Points of surfaces, with their normals, that paths from the floor come to.
fn points(scene: &Scene, random: &mut Random) -> Vec<[Vec3; 2]> {
    let mut points = Vec::new();
    while points.len() < POINTS {
        let [u] = random.take();
        let pixel = u * f32::from(SIZE[0] * SIZE[1]);
        let (mut x, mut normal) = (floor(pixel as usize, random.take()), Vec3::Z);
        for _ in 0..BOUNCES {
            points.push([x, normal]);
            let Some(hit) = scene.trace(x, cosine_direction(normal, random.take())) else { break };
            (x, normal) = (hit.position, hit.normal);
        }
    }
    points
}

/// What walls hide, by rays.
fn learn(scene: &Scene, lights: &LightSampler, points: &[[Vec3; 2]]) -> Result<Visibility, fanlight::Error> {
    let point = |i: u64| {
        let [position, normal] = points[i as usize % points.len()];
        ShadingPoint::surface(position, normal)
    };
    let traced = |x: &ShadingPoint, sample: &LightSample| f32::from(scene.sees(x.position, sample.position));
    Visibility::learn(&lights.as_view(), RAYS, point, traced)
}

/// The image by samples of the lights at each vertex, without a guide.
fn reference(scene: &Scene, lights: &LightSampler) -> Result<Vec<f64>, fanlight::Error> {
    let mut random = Random::new(0, 2);
    let table = learn(scene, lights, &points(scene, &mut random))?;
    let view = lights.with_visibility(&table)?;
    let pixel = |pixel: usize| {
        let mut sum = 0.0;
        for _ in 0..REFERENCE {
            let (mut x, mut normal, mut throughput) = (floor(pixel, random.take()), Vec3::Z, 1.0);
            for _ in 0..BOUNCES {
                if let Some(sample) = view.at(&ShadingPoint::surface(x, normal)).sample(random.take())
                    && let Some(hit) = scene.trace(x, sample.direction).filter(|hit| hit.radiance > 0.0)
                    && hit.position.distance(sample.position) < 1e-2
                {
                    let cosine = normal.dot(sample.direction).max(0.0);
                    sum += f64::from(throughput * ALBEDO / PI * cosine * hit.radiance / sample.pdf);
                }
                let Some(hit) = scene.trace(x, cosine_direction(normal, random.take())) else { break };
                (x, normal, throughput) = (hit.position, hit.normal, throughput * ALBEDO);
            }
        }
        sum / f64::from(REFERENCE)
    };
    Ok((0..usize::from(SIZE[0] * SIZE[1])).map(pixel).collect())
}

/// Mean squared error of sums of samples, relative to the squares of the reference.
fn error(sums: &[f64], samples: u32, reference: &[f64]) -> f64 {
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let relative = |(sum, r): (&f64, &f64)| (sum / f64::from(samples) - r).powi(2) / (r * r + 0.01 * mean * mean);
    sums.iter().zip(reference).map(relative).sum::<f64>() / reference.len() as f64
}

/// A point of a pixel.
fn floor(pixel: usize, [u, v]: [f32; 2]) -> Vec3 {
    let [column, row] = [pixel % usize::from(SIZE[0]), pixel / usize::from(SIZE[0])];
    let along = |i: usize, u: f32, k: usize| (i as f32 + u) / f32::from(SIZE[k]) * ROOM[k];
    vec3(along(column, u, 0), along(row, v, 1), 0.0)
}

fn cosine_direction(normal: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let disk = u.sqrt() * Vec2::from_angle(TAU * v);
    disk.x * tangent + disk.y * bitangent + (1.0 - u).sqrt() * normal
}

/// Time that this thread has spent on a processor.
fn seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
