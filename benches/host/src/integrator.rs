//! A plain path tracer: at every vertex one sample of each technique, and the balance heuristic (Veach and Guibas 1995,
//! "Optimally Combining Sampling Techniques for Monte Carlo Rendering").

use glam::{Vec2, Vec3};

use crate::bsdf::Vertex;
use crate::film::{Pixel, RESOLUTION};
use crate::methods::{Lighting, LightsHere, Proposal, Target};
use crate::random::Pcg32;
use crate::world::{Meeting, World};

/// How far behind an emitter the camera looks on, in meters: with less, a ray meets the same triangle again; with more,
/// it misses a surface on which the emitter lies. *Measured*: the references agree.
const BEHIND: f32 = 1e-5;

/// Adds one sample to every pixel. Light touches at most `bounces` surfaces.
pub(crate) fn render_pass<L: Lighting>(
    world: &World,
    lighting: &L,
    bounces: u32,
    random: &mut Pcg32,
    pixels: &mut [Pixel],
) {
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let corner = Vec2::new((i % RESOLUTION[0]) as f32, (i / RESOLUTION[0]) as f32);
        if let Some(vertex) = first_vertex(world, corner, random) {
            pixel.add(radiance(world, lighting, vertex, bounces, random));
        }
    }
}

/// Returns a random vertex of a random path. `None` where the path has left the scene.
pub(crate) fn random_vertex(world: &World, bounces: u32, random: &mut Pcg32) -> Option<Vertex> {
    let [width, height] = RESOLUTION.map(|side| side as f32);
    let [x, y] = random.uniform2();
    let mut vertex = first_vertex(world, Vec2::new(width * x, height * y).floor(), random)?;
    // The first vertex as often as all others together.
    let steps = if random.uniform() < 0.5 { 0 } else { (random.uniform() * bounces as f32) as u32 };
    for _ in 0..steps {
        match world.trace(vertex.position, vertex.sample(random)) {
            Meeting::Surface(next) => vertex = next,
            Meeting::Emitter(_) | Meeting::Sky => break,
        }
    }
    Some(vertex)
}

/// Returns what is seen through a random point of a pixel. Emitters do not show: the camera sees what is behind them,
/// and `None` where that is the sky.
pub(crate) fn first_vertex(world: &World, corner: Vec2, random: &mut Pcg32) -> Option<Vertex> {
    let (mut origin, direction) = world.scene.camera.ray(corner + Vec2::from_array(random.uniform2()));
    loop {
        match world.trace(origin, direction) {
            Meeting::Surface(vertex) => return Some(vertex),
            Meeting::Emitter(point) => origin = point.position + BEHIND * direction,
            Meeting::Sky => return None,
        }
    }
}

/// Estimates the radiance that a point of a surface sends to the camera.
fn radiance<L: Lighting>(world: &World, lighting: &L, mut vertex: Vertex, bounces: u32, random: &mut Pcg32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    for bounce in 1..=bounces {
        let here = lighting.at(&vertex);
        here.propose(random, |proposal| sum += throughput * proposed(world, &vertex, &proposal));

        let direction = vertex.sample(random);
        let scattered = vertex.scattered(direction);
        if scattered == Vec3::ZERO {
            break;
        }
        let pdf = vertex.pdf(direction);
        match world.trace(vertex.position, direction) {
            Meeting::Sky => {
                if let Some(sky) = &world.scene.sky {
                    let light = sky.radiance(direction);
                    sum += throughput * scattered * light / (pdf + here.sky_pdf(direction));
                }
                break;
            }
            Meeting::Emitter(point) => {
                let light = world.emission(&point, direction);
                if light > 0.0 {
                    sum += throughput * scattered * light / (pdf + here.emitter_pdf(&point, direction));
                }
                break;
            }
            Meeting::Surface(next) => {
                if bounce < bounces {
                    throughput *= scattered / pdf;
                    vertex = Vertex { depth: bounce, ..next };
                }
            }
        }
    }
    sum
}

/// Returns what arrives from the place that a light technique proposes, is scattered along the path, and is not found
/// by the surface's own sample.
#[inline]
fn proposed(world: &World, vertex: &Vertex, proposal: &Proposal) -> Vec3 {
    let scattered = vertex.scattered(proposal.direction);
    if scattered == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let light = match &proposal.target {
        Target::Sky => world.scene.sky.as_ref().map_or(Vec3::ZERO, |sky| sky.radiance(proposal.direction)),
        Target::Emitter(point) => Vec3::splat(world.emission(point, proposal.direction)),
    };
    if light == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let is_seen = match &proposal.target {
        Target::Sky => world.sees_sky(vertex.position, proposal.direction),
        Target::Emitter(point) => world.sees(vertex.position, point.position),
    };
    if is_seen { scattered * light / (proposal.pdf + vertex.pdf(proposal.direction)) } else { Vec3::ZERO }
}
