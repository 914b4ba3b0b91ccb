//! Times of building and of refitting `cloud-N`: `N` small triangles at random in the unit cube, each a mesh with a
//! radiance of its own; of adding and building a million points at random; and of building a million instances of one
//! lamp.
//!
//! With the feature `rayon` everything is timed on one thread and on all.

use core::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion};
use fanlight::{Instance, LightSampler, LightSamplerBuilder, Mesh, MeshId, MeshUpdate, PointLight, Weight};
use glam::{Affine3A, Vec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Points without an extent.
const POINTS: usize = 1_000_000;
/// Instances of a lamp.
const INSTANCES: usize = 1_000_000;

struct Cloud {
    vertices: Vec<[Vec3; 3]>,
    radiances: Vec<f32>,
}

/// Uniform in `[0, 1)`.
fn uniform(pcg: &mut Pcg32) -> f32 {
    (pcg.next_u32() >> 8) as f32 / 16_777_216.0
}

fn vector(pcg: &mut Pcg32) -> Vec3 {
    Vec3::new(uniform(pcg), uniform(pcg), uniform(pcg))
}

impl Cloud {
    fn new(n: usize) -> Self {
        let mut pcg = Pcg32::new(1, 1);
        let size = 0.3 / (n as f32).cbrt();
        let mut triangle = || {
            let center = vector(&mut pcg);
            [(); 3].map(|()| center + size * (2.0 * vector(&mut pcg) - 1.0))
        };
        let vertices = (0..n).map(|_| triangle()).collect();
        Self { vertices, radiances: (0..n).map(|_| (6.0 * uniform(&mut pcg) - 3.0).exp2()).collect() }
    }

    fn builder(&self) -> LightSamplerBuilder<'static> {
        let mut builder = LightSampler::builder();
        for (vertices, radiance) in self.vertices.iter().zip(&self.radiances) {
            let mesh = Mesh::emitter(vertices, &[[0, 1, 2]]).weight(Weight::Constant(*radiance));
            builder.add_mesh(&mesh).expect("the cloud is finite");
        }
        builder
    }
}

fn build(builder: LightSamplerBuilder<'_>) -> LightSampler {
    builder.build().expect("the cloud is not too large")
}

fn refit(lights: &mut LightSampler, updates: &[MeshUpdate<'_>]) {
    lights.refit(black_box(updates)).expect("the changes are valid");
}

/// Points at random in the unit cube, with intensities of their own.
fn points() -> Vec<PointLight> {
    let mut pcg = Pcg32::new(3, 1);
    let mut point = || PointLight::new(vector(&mut pcg), (6.0 * uniform(&mut pcg) - 3.0).exp2());
    (0..POINTS).map(|_| point()).collect()
}

fn builder_of_points(points: &[PointLight]) -> LightSamplerBuilder<'static> {
    let mut builder = LightSampler::builder();
    for point in points {
        builder.add_light(*point).expect("the point is finite");
    }
    builder
}

/// A street lamp of a thousand triangles, a million times.
fn street() -> LightSamplerBuilder<'static> {
    let mut pcg = Pcg32::new(2, 1);
    let positions: Vec<Vec3> = (0..3000).map(|_| 0.1 * vector(&mut pcg)).collect();
    let indices: Vec<[u32; 3]> = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mut builder = LightSampler::builder();
    let lamp = builder.add_object(&[Mesh::emitter(&positions, &indices)]).expect("the lamp is finite");
    for _ in 0..INSTANCES {
        let place = Affine3A::from_translation(1000.0 * vector(&mut pcg));
        builder.add_instance(Instance::new(lamp, place)).expect("the place is near");
    }
    builder
}

fn rows(criterion: &mut Criterion, name: &str, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    for n in [10_000, 100_000, 1_000_000] {
        let cloud = Cloud::new(n);
        group.bench_function(BenchmarkId::new("build", n), |b| {
            pool.install(|| b.iter_batched(|| cloud.builder(), build, BatchSize::PerIteration));
        });
        let mut lights = build(cloud.builder());
        let moved =
            |mesh: usize| MeshUpdate::new(MeshId::from_index(mesh as u32)).moved(&cloud.vertices[mesh], &[[0, 1, 2]]);
        let updates: Vec<_> = (0..n).map(moved).collect();
        group.bench_function(BenchmarkId::new("refit", n), |b| {
            pool.install(|| b.iter(|| refit(&mut lights, &updates)));
        });
    }
    let points = points();
    group.bench_function(BenchmarkId::new("add points", POINTS), |b| {
        pool.install(|| b.iter_with_large_drop(|| builder_of_points(&points)));
    });
    group.bench_function(BenchmarkId::new("points", POINTS), |b| {
        pool.install(|| b.iter_batched(|| builder_of_points(&points), build, BatchSize::PerIteration));
    });
    let bytes = build(builder_of_points(&points)).bytes();
    println!("{POINTS} points take {} bytes, {} of them for the tree", bytes.total(), bytes.light_tree);
    group.bench_function(BenchmarkId::new("instances", INSTANCES), |b| {
        pool.install(|| b.iter_batched(street, build, BatchSize::PerIteration));
    });
    println!("{INSTANCES} instances take {} bytes", build(street()).bytes().total());
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    rows(&mut criterion, "one thread", 1);
    if cfg!(feature = "rayon") {
        rows(&mut criterion, "all threads", 0);
    }
    criterion.final_summary();
}
