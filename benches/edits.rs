//! Times of edits between frames beside those of rebuilds, and how well an edited tree chooses beside a new one.
//!
//! `cloud-N` is `N` lights without an extent at random in the unit cube. A frame is 100 edits: 20 lights come, 20 go,
//! 20 move anywhere, 20 move a little, 20 change their brightness. Times are means over all frames, with everything
//! that is built again meanwhile. A rebuild is a call of `build`, without the calls that add lights to the builder.
//!
//! `exact-sel` is the variance of the irradiance that is left by the choice of a light, relative to the squared
//! irradiance: the median over shading points.
//!
//! `removed-N` is `N` meshes of a triangle that were there and are removed: the time to add one, in batches of one and
//! all that were removed in one batch.
//!
//! `cargo bench -p fanlight-benches --bench edits`; with `--features rayon`, rebuilds on all threads; with
//! `-- removed`, only the rows of meshes that were removed.

use std::time::Instant;

use fanlight::{LightId, LightSampler, Mesh, MeshId, PointLight, ShadingPoint};
use glam::Vec3;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Frames that are edited.
const FRAMES: usize = 1000;
/// Edits of each kind in a frame.
const EDITS: usize = 20;
/// Frames between two looks at the choices.
const STEP: usize = 250;
/// Shading points at which choices are compared.
const POINTS: usize = 300;
/// Samples at each point, where there are too many lights to ask for all.
const SAMPLES: usize = 20_000;

/// Uniform in `[0, 1)`.
fn uniform(pcg: &mut Pcg32) -> f32 {
    (pcg.next_u32() >> 8) as f32 / 16_777_216.0
}

fn vector(pcg: &mut Pcg32) -> Vec3 {
    Vec3::new(uniform(pcg), uniform(pcg), uniform(pcg))
}

fn brightness(pcg: &mut Pcg32) -> f32 {
    (6.0 * uniform(pcg) - 3.0).exp2()
}

/// Positions and intensities by the numbers of the lights.
struct Cloud(Vec<Option<(Vec3, f32)>>);

impl Cloud {
    fn new(count: usize, pcg: &mut Pcg32) -> Self {
        Self((0..count).map(|_| Some((vector(pcg), brightness(pcg)))).collect())
    }

    fn lights(&self) -> impl Iterator<Item = (Vec3, f32)> {
        self.0.iter().flatten().copied()
    }

    /// Builds all lights. Returns the seconds that the build takes as well.
    fn build(&self) -> (LightSampler, f64) {
        let mut builder = LightSampler::builder();
        for (position, intensity) in self.lights() {
            builder.add_light(PointLight::new(position, intensity)).expect("the cloud is finite");
        }
        let start = Instant::now();
        (builder.build().expect("the cloud is not too large"), start.elapsed().as_secs_f64())
    }

    /// The number of one of the lights.
    fn any(&self, pcg: &mut Pcg32) -> usize {
        loop {
            let number = pcg.next_u32() as usize % self.0.len();
            if self.0[number].is_some() {
                return number;
            }
        }
    }

    /// Edits a frame. Returns the seconds that it takes.
    fn edit(&mut self, lights: &mut LightSampler, pcg: &mut Pcg32) -> f64 {
        let (mut removed, mut changed, mut added) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..EDITS {
            let number = self.any(pcg);
            self.0[number] = None;
            removed.push(number);
        }
        for i in 0..3 * EDITS {
            let number = self.any(pcg);
            let (position, intensity) = self.0[number].expect("it is one of the lights");
            let light = match i % 3 {
                0 => (vector(pcg), intensity),
                1 => (position + 0.01 * vector(pcg) - 0.005, intensity),
                _ => (position, brightness(pcg)),
            };
            self.0[number] = Some(light);
            changed.push((number, light));
        }
        (0..EDITS).for_each(|_| added.push((vector(pcg), brightness(pcg))));
        let id = |number: usize| LightId::from_index(number as u32);
        let start = Instant::now();
        let mut edits = lights.edit();
        removed.iter().for_each(|&number| edits.remove_light(id(number)).expect("the light is there"));
        for &(number, (position, intensity)) in &changed {
            edits.set_light(id(number), PointLight::new(position, intensity)).expect("the light is there");
        }
        let add = |&(position, intensity): &(Vec3, f32)| edits.add_light(PointLight::new(position, intensity));
        let ids: Vec<LightId> = added.iter().map(add).collect::<Result<_, _>>().expect("the lights are valid");
        edits.apply().expect("the lights are few");
        let seconds = start.elapsed().as_secs_f64();
        for (id, light) in ids.iter().zip(added) {
            let number = id.index() as usize;
            self.0.resize(self.0.len().max(number + 1), None);
            self.0[number] = Some(light);
        }
        seconds
    }

    /// Variance of the choice of a light at some points: `ids` are the numbers of the lights in the sampler.
    fn variances(&self, lights: &LightSampler, ids: &[u32]) -> Vec<f64> {
        let mut pcg = Pcg32::new(7, 7);
        let mut at_point = || {
            let position = vector(&mut pcg);
            let normal = (2.0 * vector(&mut pcg) - 1.0).normalize();
            let at = lights.at(&ShadingPoint::surface(position, normal));
            let sends = |(light, intensity): (Vec3, f32)| {
                let to = (light - position).as_dvec3();
                (f64::from(intensity) * to.normalize().dot(normal.as_dvec3()) / to.length_squared()).max(0.0)
            };
            let all: Vec<f64> = self.lights().map(sends).collect();
            let irradiance: f64 = all.iter().sum();
            let squares = if all.len() <= 10_000 {
                let terms = all.iter().zip(ids).filter(|(sent, _)| **sent > 0.0);
                terms.map(|(sent, &id)| sent * sent / f64::from(at.pmf_light(LightId::from_index(id)))).sum::<f64>()
            } else {
                let draw = |_| {
                    let u = [uniform(&mut pcg), uniform(&mut pcg), uniform(&mut pcg)];
                    let sample = at.sample(u)?;
                    let light = match sample.light {
                        fanlight::SampledLight::Punctual(id) => id.index(),
                        other => panic!("{other:?} is no point"),
                    };
                    let place = ids.binary_search(&light).expect("the light is there");
                    Some((all[place] / f64::from(sample.pmf)).powi(2))
                };
                (0..SAMPLES).filter_map(draw).sum::<f64>() / SAMPLES as f64
            };
            squares / (irradiance * irradiance) - 1.0
        };
        (0..POINTS).map(|_| at_point()).collect()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn row(count: usize, frames: usize) {
    let mut pcg = Pcg32::new(1, 1);
    let mut cloud = Cloud::new(count, &mut pcg);
    let mut lights = cloud.build().0;
    let rebuild = median((0..3).map(|_| cloud.build().1).collect());
    let start = Instant::now();
    drop(lights.edit());
    println!(
        "cloud-{count}: rebuild {:.3} ms, first batch {:.3} ms",
        1e3 * rebuild,
        1e3 * start.elapsed().as_secs_f64()
    );
    let (mut sum, mut slowest) = (0.0, 0.0f64);
    for frame in 1..=frames {
        let seconds = cloud.edit(&mut lights, &mut pcg);
        (sum, slowest) = (sum + seconds, slowest.max(seconds));
        if frame % STEP.min(frames) == 0 {
            let fresh = cloud.build().0;
            let own: Vec<u32> = (0..).zip(&cloud.0).filter_map(|(id, light)| light.map(|_| id)).collect();
            let new: Vec<u32> = (0..own.len() as u32).collect();
            let [edited, built] = [(&lights, &own), (&fresh, &new)].map(|(lights, ids)| cloud.variances(lights, ids));
            // The mean over points of the logarithm, as variances of points differ by orders of magnitude. Where
            // nothing arrives there is none.
            let logarithms = edited.iter().zip(&built).map(|(edited, built)| (edited / built).ln());
            let known: Vec<f64> = logarithms.filter(|ratio| ratio.is_finite()).collect();
            let mean = known.iter().sum::<f64>() / known.len() as f64;
            let [edited, built] = [edited, built].map(median);
            println!(
                "  frame {frame}: exact-sel {edited:.3}, of a fresh build {built:.3}: ratio {:.3}, mean ratio of points {:.3}; \
                 decay {:.3}, {} bytes, of a fresh build {}",
                edited / built,
                mean.exp(),
                lights.decay(),
                lights.bytes().total(),
                fresh.bytes().total(),
            );
        }
    }
    let mean = sum / frames as f64;
    println!(
        "  100 edits: {:.4} ms a frame, slowest {:.3} ms; {:.1} times faster than a rebuild",
        1e3 * mean,
        1e3 * slowest,
        rebuild / mean
    );
}

/// Times to add meshes after `count` meshes were removed.
fn row_of_removed(count: usize, singles: usize) {
    let mut pcg = Pcg32::new(2, 2);
    let corners = [Vec3::ZERO, 0.01 * Vec3::X, 0.01 * Vec3::Y];
    let mut place = || {
        let at = vector(&mut pcg);
        corners.map(|corner| corner + at)
    };
    let mut builder = LightSampler::builder();
    let kept = 1000;
    for _ in 0..count + kept {
        builder.add_mesh(&Mesh::emitter(&place(), &[[0, 1, 2]])).expect("the mesh is valid");
    }
    let mut lights = builder.build().expect("the meshes are few");
    let mut edits = lights.edit();
    for number in kept..kept + count {
        edits.remove_mesh(MeshId::from_index(number as u32)).expect("the mesh is there");
    }
    edits.apply().expect("nothing is added");
    let mut times = [singles, count - singles].into_iter().enumerate().map(|(i, added)| {
        let places: Vec<_> = (0..added).map(|_| place()).collect();
        let start = Instant::now();
        for batch in places.chunks(if i == 0 { 1 } else { added.max(1) }) {
            let mut edits = lights.edit();
            for positions in batch {
                edits.add_mesh(&Mesh::emitter(positions, &[[0, 1, 2]])).expect("the mesh is valid");
            }
            edits.apply().expect("the meshes are few");
        }
        1e6 * start.elapsed().as_secs_f64() / added as f64
    });
    let [single, together] = [times.next(), times.next()].map(|time| time.expect("there are two"));
    println!(
        "removed-{count}: {single:.2} µs to add a mesh in its own batch, {together:.2} µs together with the others"
    );
}

fn main() {
    // `cargo test` wants to see it run once.
    if !std::env::args().any(|word| word == "--bench") {
        row_of_removed(100, 10);
        return row(1000, 10);
    }
    if std::env::args().any(|word| word == "removed") {
        return [2_000, 20_000, 100_000].into_iter().for_each(|count| row_of_removed(count, 1000));
    }
    let wanted: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let counts = if wanted.is_empty() { vec![10_000, 1_000_000] } else { wanted };
    counts.into_iter().for_each(|count| row(count, FRAMES));
}
