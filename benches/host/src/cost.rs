//! What a call costs, in nanoseconds and in rays of the same run.

use core::hint::black_box;

use glam::Vec2;

use crate::bsdf::Vertex;
use crate::clock::thread_seconds;
use crate::film::RESOLUTION;
use crate::integrator::first_vertex;
use crate::methods::Method;
use crate::random::Pcg32;
use crate::statistics::median;
use crate::world::{Meeting, World};

/// Vertices of paths that calls are timed at; more take longer and vary less.
const VERTICES: usize = 4096;
/// Vertices that are visited before the clock starts; with fewer, the first time counts the caches' misses.
const WARM_UP: usize = 512;
/// Repetitions, of which the median counts.
const REPEATS: usize = 9;
/// Samples after which a vertex counts as one that no light reaches. *Measured*: with 64 the share of lit vertices
/// changes by less than 1 %.
const TRIES: u32 = 16;
/// Walks through all pixels after which the search for vertices ends.
const MOST_WALKS: usize = 16;

/// Times of a method's calls: what is asked of it at one vertex, its samples and their densities.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// At vertices that light may reach.
    pub(crate) lit_ns: f64,
    /// At all vertices of paths.
    pub(crate) ns: f64,
}

/// Times of all methods in one scene.
pub(crate) struct Costs {
    pub(crate) methods: Vec<Cost>,
    /// Mean time of a ray to the closest hit, along a surface's own sample.
    pub(crate) ray_ns: f64,
}

/// Times the calls of all methods at the same vertices, in turn.
pub(crate) fn measure(world: &World, methods: &[Method], bounces: u32) -> Costs {
    let mut random = Pcg32::new(1, 1000);
    let all = vertices(world, bounces, &mut random);
    let lit: Vec<Vertex> = match methods.iter().find(|method| !method.is_competitor()) {
        Some(method) => all.iter().filter(|vertex| method.reaches(vertex, TRIES, &mut random)).copied().collect(),
        None => all.clone(),
    };
    let mut rays = Vec::new();
    let mut times: Vec<[Vec<f64>; 2]> = methods.iter().map(|_| [Vec::new(), Vec::new()]).collect();
    for _ in 0..REPEATS {
        rays.push(timed(&all, |vertices| trace(world, vertices, &mut random)));
        for (method, [lit_times, all_times]) in methods.iter().zip(&mut times) {
            // What the method before has pushed out of the caches counts for neither.
            black_box(method.call(&all[..all.len().min(WARM_UP)], &mut random));
            lit_times.push(timed(&lit, |vertices| method.call(vertices, &mut random)));
            all_times.push(timed(&all, |vertices| method.call(vertices, &mut random)));
        }
    }
    let cost = |[lit, all]: [Vec<f64>; 2]| Cost { lit_ns: median(lit), ns: median(all) };
    Costs { methods: times.into_iter().map(cost).collect(), ray_ns: median(rays) }
}

/// Returns the mean time of one of many, in nanoseconds.
fn timed(vertices: &[Vertex], work: impl FnOnce(&[Vertex]) -> f32) -> f64 {
    let before = thread_seconds();
    black_box(work(black_box(vertices)));
    1e9 * (thread_seconds() - before) / vertices.len().max(1) as f64
}

/// Traces one ray from each vertex.
fn trace(world: &World, vertices: &[Vertex], random: &mut Pcg32) -> f32 {
    let mut sum = 0.0;
    for vertex in vertices {
        sum += match world.trace(vertex.position, vertex.sample(random)) {
            Meeting::Surface(next) => next.position.x,
            Meeting::Emitter(point) => point.position.x,
            Meeting::Sky => 0.0,
        };
    }
    sum
}

/// Returns vertices of paths from all of the image.
fn vertices(world: &World, bounces: u32, random: &mut Pcg32) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    let pixels = RESOLUTION[0] * RESOLUTION[1];
    // A prime step spreads the first of them over the image.
    let mut pixel = 0;
    for _ in 0..MOST_WALKS * pixels {
        pixel = (pixel + 4001) % pixels;
        let corner = Vec2::new((pixel % RESOLUTION[0]) as f32, (pixel / RESOLUTION[0]) as f32);
        let mut next = first_vertex(world, corner, random);
        for _ in 0..bounces {
            let Some(vertex) = next else { break };
            vertices.push(vertex);
            next = match world.trace(vertex.position, vertex.sample(random)) {
                Meeting::Surface(vertex) => Some(vertex),
                Meeting::Emitter(_) | Meeting::Sky => None,
            };
        }
        if vertices.len() >= VERTICES {
            break;
        }
    }
    vertices
}
