//! Times of sampling, one thread.
//!
//! `cloud-N` is `N` small triangles at random in the unit cube, each a mesh with a radiance of its own; the shading
//! points lie in and around the cube. `batch` runs 10,000,000 triangles as well if `FANLIGHT_LARGE` is set.

#[path = "instruction_set.rs"]
mod instruction_set;

use core::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput};
use fanlight::{Environment, EnvironmentImage, Filter, Hit, LightSampler, Mesh, ShadingPoint, Weight};
use glam::{DVec3, Vec3};
use rand_pcg::rand_core::Rng;

/// Shading points, and vectors of random numbers, that are gone through in a circle.
const POINTS: usize = 1 << 16;

/// PCG32 (O'Neill 2014), XSH-RR 64/32.
struct Pcg(rand_pcg::Pcg32);

impl Pcg {
    fn new(seed: u64, sequence: u64) -> Self {
        Self(rand_pcg::Pcg32::new(seed, sequence))
    }

    /// Uniform in `[0, 1)`.
    fn f(&mut self) -> f64 {
        f64::from(self.0.next_u32() >> 8) / 16_777_216.0
    }

    fn vector(&mut self) -> DVec3 {
        let (x, y, z) = (self.f(), self.f(), self.f());
        DVec3::new(x, y, z)
    }

    fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.f();
        let (sin, cos) = (core::f64::consts::TAU * self.f()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, z).as_vec3()
    }
}

/// Vertices and radiance of the triangles of cloud-N.
fn cloud(n: usize) -> Vec<([Vec3; 3], f32)> {
    let mut pcg = Pcg::new(1, 1);
    let size = 0.3 / (n as f64).cbrt();
    let mut triangle = || {
        let center = pcg.vector();
        let vertices = [(); 3].map(|()| (center + size * (2.0 * pcg.vector() - 1.0)).as_vec3());
        (vertices, (6.0 * pcg.f() - 3.0).exp2() as f32)
    };
    let cloud: Vec<_> = (0..n).map(|_| triangle()).collect();
    if n == 10_000 {
        let ([a, ..], radiance) = cloud[0];
        assert_eq!((a, radiance), (Vec3::new(0.791_256_3, 0.089_440_35, 0.748_418_33), 4.868_061_5));
    }
    cloud
}

fn build(cloud: &[([Vec3; 3], f32)]) -> LightSampler {
    let mut builder = LightSampler::builder();
    for (vertices, radiance) in cloud {
        let mesh = Mesh::emitter(vertices, &[[0, 1, 2]]).weight(Weight::Constant(*radiance));
        builder.add_mesh(&mesh).expect("the cloud is finite");
    }
    builder.build().expect("the cloud is small")
}

fn points() -> Vec<ShadingPoint> {
    let mut pcg = Pcg::new(2, 2);
    let mut point = || {
        let position = (2.0 * pcg.vector() - 0.5).as_vec3();
        ShadingPoint::surface(position, pcg.direction())
    };
    (0..POINTS).map(|_| point()).collect()
}

fn numbers() -> Vec<[f32; 3]> {
    let mut pcg = Pcg::new(3, 3);
    (0..POINTS).map(|_| pcg.vector().as_vec3().to_array()).collect()
}

/// Calls `work` with 0, 1, 2 ... below `count`, again and again.
fn in_circle<T>(bencher: &mut criterion::Bencher<'_>, count: usize, work: impl Fn(usize) -> T) {
    let mut i = 0;
    bencher.iter(|| {
        i = if i + 1 < count { i + 1 } else { 0 };
        work(black_box(i))
    });
}

fn lights(criterion: &mut Criterion) {
    let (points, numbers) = (points(), numbers());
    for n in [100, 1_000, 10_000, 100_000] {
        let cloud = cloud(n);
        let sampler = build(&cloud);
        let mut group = criterion.benchmark_group(format!("cloud-{n}"));
        group.bench_function("sample", |b| in_circle(b, POINTS, |i| sampler.at(&points[i]).sample(numbers[i])));

        // Densities of what was drawn: elsewhere they would be cheap zeros.
        let drawn: Vec<(ShadingPoint, Hit, Vec3)> = points
            .iter()
            .zip(&numbers)
            .filter_map(|(x, u)| {
                sampler.at(x).sample(*u).map(|sample| (*x, sample.hit().expect("a triangle"), sample.direction))
            })
            .collect();
        group.bench_function("pmf", |b| {
            in_circle(b, drawn.len(), |i| sampler.at(&drawn[i].0).pmf(drawn[i].1.triangle));
        });
        group.bench_function("pdf", |b| in_circle(b, drawn.len(), |i| sampler.at(&drawn[i].0).pdf(&drawn[i].1)));
        group.bench_function("pdf_direction", |b| {
            in_circle(b, drawn.len(), |i| sampler.at(&drawn[i].0).pdf_direction(drawn[i].2));
        });
        group.finish();
    }
}

/// Single calls against calls for several points.
fn batch(criterion: &mut Criterion) {
    let queries: Vec<_> = points().into_iter().zip(numbers()).collect();
    let large = std::env::var_os("FANLIGHT_LARGE").map(|_| 10_000_000);
    for n in [1_000, 100_000].into_iter().chain(large) {
        let sampler = build(&cloud(n));
        let mut group = criterion.benchmark_group(format!("batch/cloud-{n}"));
        group.throughput(Throughput::Elements(1));
        group.bench_function("single", |b| in_circle(b, POINTS, |i| sampler.at(&queries[i].0).sample(queries[i].1)));
        for size in [1, 2, 4, 8, 16] {
            let mut samples = [None; 16];
            let mut batches = queries.chunks_exact(size).cycle();
            group.throughput(Throughput::Elements(size as u64));
            group.bench_function(BenchmarkId::from_parameter(size), |b| {
                b.iter(|| {
                    sampler.sample_many(batches.next().unwrap_or_default(), &mut samples);
                    black_box(&samples);
                });
            });
        }
        group.finish();
    }
}

/// Eight candidates at one point: by resampling, which interleaves their walks, and one after the other.
fn candidates(criterion: &mut Criterion) {
    let (points, numbers) = (points(), numbers());
    let slices: Vec<&[[f32; 3]]> = numbers.chunks_exact(8).collect();
    for n in [1_000, 100_000, 1_000_000] {
        let sampler = build(&cloud(n));
        let mut group = criterion.benchmark_group(format!("candidates/cloud-{n}"));
        let at = |i: usize| sampler.at(&points[8 * i]);
        group.bench_function("single", |b| {
            in_circle(b, slices.len(), |i| {
                let here = at(i);
                slices[i].iter().filter_map(|u| here.sample(*u)).map(|sample| sample.distance).sum::<f32>()
            });
        });
        group.bench_function("resampled", |b| {
            in_circle(b, slices.len(), |i| {
                at(i).sample_resampled(slices[i], 0.5, |sample| sample.distance).map(|chosen| chosen.weight)
            });
        });
        group.finish();
    }
}

/// A sky that brightens towards the zenith, with a sun of half a degree.
fn environment(criterion: &mut Criterion) {
    const SIZE: usize = 1024;
    let sun = Vec3::new(0.3, 0.8, 0.5).normalize();
    let texel = |i: usize| {
        let (u, v) = (((i % 2048) as f32 + 0.5) / 2048.0, ((i / 2048) as f32 + 0.5) / SIZE as f32);
        let ((sin, cos), (sin_phi, cos_phi)) =
            ((core::f32::consts::PI * v).sin_cos(), (core::f32::consts::TAU * u).sin_cos());
        let direction = Vec3::new(cos_phi * sin, -sin_phi * sin, cos);
        if direction.dot(sun) > 0.5_f32.to_radians().cos() { 20_000.0 } else { 0.2 + 0.8 * cos.max(0.0) }
    };
    let sky: Vec<f32> = (0..2048 * SIZE).map(texel).collect();
    let image = EnvironmentImage::lat_long(2048, SIZE, &sky).filter(Filter::Nearest).resolution(SIZE);
    let sky = Environment::new(&image).expect("a valid sky");
    let numbers = numbers();
    let mut pcg = Pcg::new(4, 4);
    let directions: Vec<Vec3> = (0..POINTS).map(|_| pcg.direction()).collect();
    let mut group = criterion.benchmark_group("environment");
    group.bench_function("radiance", |b| in_circle(b, POINTS, |i| sky.radiance(directions[i])));
    group.bench_function("pdf", |b| in_circle(b, POINTS, |i| sky.pdf(directions[i])));
    group.bench_function("sample", |b| in_circle(b, POINTS, |i| sky.sample([numbers[i][0], numbers[i][1]])));
    group.finish();
    // As a light of the mixture, on surfaces that look all ways.
    let lights = LightSampler::builder().environment(sky).environment_as_light().build().expect("the sky is a light");
    let points: Vec<_> = (0..POINTS).map(|_| ShadingPoint::surface(Vec3::ZERO, pcg.direction())).collect();
    let mut group = criterion.benchmark_group("environment-light");
    group.bench_function("sample", |b| in_circle(b, POINTS, |i| lights.at(&points[i]).sample(numbers[i])));
    group.bench_function("pdf", |b| in_circle(b, POINTS, |i| lights.at(&points[i]).pdf_environment(directions[i])));
    group.bench_function("pair", |b| {
        in_circle(b, POINTS, |i| {
            let here = lights.at(&points[i]);
            (here.sample(numbers[i]), here.pdf_environment(directions[i]))
        });
    });
    group.finish();
}

fn main() {
    println!("times with the instructions {}", instruction_set::name());
    let mut criterion = Criterion::default().configure_from_args();
    environment(&mut criterion);
    lights(&mut criterion);
    batch(&mut criterion);
    candidates(&mut criterion);
    criterion.final_summary();
}
