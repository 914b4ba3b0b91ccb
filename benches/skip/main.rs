//! What is saved where a scene does not need something: pairs of scenes, one with and one without it.
//!
//! `cargo bench -p fanlight-benches --bench skip` prints a table. Times are medians of runs that are interleaved, so
//! that both see the same machine; bytes are those that the samplers report.

#[path = "../instruction_set.rs"]
mod instruction_set;
#[expect(dead_code, reason = "the quality bench uses the rest")]
#[path = "../quality/scenes/mod.rs"]
mod scenes;

use core::hint::black_box;
use std::time::Instant;

use fanlight::{Environment, Filter, LightSampler, Mesh, ShadingPoint, Texture, Weight};
use glam::{Vec2, Vec3};
use scenes::pcg::Pcg32;

/// Runs of each of a pair.
const RUNS: usize = 9;
/// Samples a run.
const SAMPLES: usize = 1 << 14;
/// Texels along the edge of an image.
const SIZE: usize = 256;

/// One scene of a pair, and the points that it is sampled from.
struct Side {
    lights: LightSampler,
    points: Vec<ShadingPoint>,
}

/// Something that can be skipped.
struct Saving {
    name: &'static str,
    with: Side,
    without: Side,
}

impl Side {
    fn bytes(&self) -> usize {
        self.lights.bytes().total()
    }

    /// Nanoseconds a sample.
    fn time(&self, samples: usize, numbers: &[[f32; 3]]) -> f64 {
        let start = Instant::now();
        for i in 0..samples {
            black_box(self.lights.at(&self.points[i % self.points.len()]).sample(numbers[i % numbers.len()]));
        }
        start.elapsed().as_secs_f64() * 1e9 / samples as f64
    }
}

fn main() {
    // `cargo test` wants to see it run, `cargo bench` to see it measure.
    let (runs, samples) = if std::env::args().any(|word| word == "--bench") { (RUNS, SAMPLES) } else { (1, 64) };
    let mut pcg = Pcg32::new(3, 3);
    let numbers: Vec<[f32; 3]> = (0..samples).map(|_| pcg.uniform3()).collect();
    println!("times with the instructions {}\n", instruction_set::name());
    println!("| what the scene does not have | ns a sample with | without | KB with | without |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    for Saving { name, with, without } in savings() {
        let mut times = [vec![], vec![]];
        for _ in 0..runs {
            times[0].push(with.time(samples, &numbers));
            times[1].push(without.time(samples, &numbers));
        }
        let [a, b] = times.map(median);
        let kilobytes = |side: &Side| side.bytes() as f64 / 1024.0;
        println!("| {name} | {a:.0} | {b:.0} | {:.1} | {:.1} |", kilobytes(&with), kilobytes(&without));
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn savings() -> Vec<Saving> {
    let noise = noise();
    let mut spot = vec![0.0; SIZE * SIZE];
    spot[SIZE * SIZE / 2 + SIZE / 2] = 1.0;
    let sky = scenes::sky::Sky::new().environment;
    let quiet = scenes::sky::Sky::without_sun().environment;
    let white = || Environment::constant(1.0).expect("a radiance");
    let cloud = |sent: fn(usize) -> bool| side(emitters(20_000, sent), cube_points(None));
    vec![
        Saving {
            name: "a texture on an emitter",
            with: side(quad(false, white(), Some(&noise), 1, 0.0), room_points()),
            without: side(quad(false, white(), None, 1, 0.0), room_points()),
        },
        Saving {
            name: "texels in constant parts of a texture",
            with: side(quad(false, white(), Some(&noise), 1, 0.0), room_points()),
            without: side(quad(false, white(), Some(&spot), 1, 0.0), room_points()),
        },
        Saving {
            name: "an image as environment",
            with: side(quad(true, quiet.clone(), None, 1, 0.0), room_points()),
            without: side(quad(true, white(), None, 1, 0.0), room_points()),
        },
        Saving {
            name: "contrast in the visible part of the environment",
            with: side(quad(true, half(&noise), None, 1, 0.0), room_points()),
            without: side(quad(true, half(&vec![0.5; noise.len()]), None, 1, 0.0), room_points()),
        },
        Saving {
            name: "a sun",
            with: side(quad(true, sky, None, 1, 0.0), room_points()),
            without: side(quad(true, quiet, None, 1, 0.0), room_points()),
        },
        Saving {
            name: "nine of ten triangles, which are black",
            with: cloud(|_| true),
            without: cloud(|i| i % 10 == 0),
        },
        Saving {
            name: "more than one triangle",
            with: side(quad(false, white(), None, 1, 0.0), room_points()),
            without: side(triangle(), room_points()),
        },
        Saving {
            name: "half of the lights, which are below the horizon",
            with: side(emitters(20_000, |_| true), cube_points(Some(Vec3::Z))),
            without: side(emitters(20_000, |_| true), cube_points(Some(Vec3::X))),
        },
        Saving {
            name: "half of the lights, which face away from the point",
            with: side(ceiling(|_| false), cube_points(Some(Vec3::Z))),
            without: side(ceiling(|i| i % 2 == 0), cube_points(Some(Vec3::Z))),
        },
        Saving {
            name: "a texture of its own for each of 100 windows",
            with: side(quad(true, white(), Some(&noise), 100, 1e-4), room_points()),
            without: side(quad(true, white(), Some(&noise), 100, 0.0), room_points()),
        },
    ]
}

fn side(lights: LightSampler, points: Vec<ShadingPoint>) -> Side {
    Side { lights, points }
}

fn noise() -> Vec<f32> {
    let mut pcg = Pcg32::new(4, 4);
    (0..SIZE * SIZE).map(|_| pcg.f() as f32).collect()
}

/// An environment whose half with y > 0, the one that windows show, has these texels, and whose other half is noise.
fn half(texels: &[f32]) -> Environment {
    let noise = noise();
    let texel = |i: usize| if i / SIZE < SIZE / 2 { noise[i] } else { texels[i] };
    let texels: Vec<f32> = (0..SIZE * SIZE).map(texel).collect();
    Environment::from_equal_area(SIZE, &texels, Filter::Nearest).expect("the texels are finite")
}

/// Windows of 1 x 1 m next to each other in the wall y = 0. The texture coordinates of each differ from those of the
/// one before by `step`.
fn quad(portal: bool, environment: Environment, texels: Option<&[f32]>, count: u16, step: f32) -> LightSampler {
    let mut builder = LightSampler::builder().environment(environment);
    let weight = texels.map_or(Weight::Constant(1.0), |texels| {
        Weight::Texture(builder.add_texture(Texture::new(SIZE, SIZE, texels).expect("the texels are finite")))
    });
    for i in 0..count {
        let corners = [[-0.5, 1.0], [0.5, 1.0], [0.5, 2.0], [-0.5, 2.0]];
        let positions = corners.map(|[x, z]| Vec3::new(x + 1.5 * f32::from(i), 0.0, z));
        let shift = step * f32::from(i);
        let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|uv| Vec2::from(uv) + shift);
        let indices = [[0, 1, 2], [0, 2, 3]];
        let mesh = if portal { Mesh::portal(&positions, &indices) } else { Mesh::emitter(&positions, &indices) };
        builder.add_mesh(&mesh.uvs(&uvs).weight(weight)).expect("a valid window");
    }
    builder.build().expect("few triangles")
}

fn triangle() -> LightSampler {
    let positions = [[-0.5, 0.0, 1.0], [0.5, 0.0, 1.0], [0.0, 0.0, 2.0]].map(Vec3::from);
    let builder = LightSampler::builder().mesh(&Mesh::emitter(&positions, &[[0, 1, 2]])).expect("a valid triangle");
    builder.build().expect("one triangle")
}

/// Triangles of a cloud, of which some are black.
fn emitters(count: usize, sent: fn(usize) -> bool) -> LightSampler {
    let mut builder = LightSampler::builder();
    for (i, mesh) in scenes::cloud::cloud(count).meshes.iter().enumerate() {
        let weight = Weight::Constant(if sent(i) { 1.0 } else { 0.0 });
        builder.add_mesh(&Mesh::emitter(&mesh.positions, &mesh.indices).weight(weight)).expect("a valid cloud");
    }
    builder.build().expect("few triangles")
}

/// Lamps above the unit cube, of which some face up and the others down.
fn ceiling(faces_up: fn(usize) -> bool) -> LightSampler {
    let mut builder = LightSampler::builder();
    let mut pcg = Pcg32::new(5, 5);
    for i in 0..20_000 {
        let [x, y] = [(); 2].map(|()| 3.0 * pcg.f() as f32 - 1.0);
        let corner = Vec3::new(x, y, 2.0);
        let positions = [corner, corner + 0.01 * Vec3::Y, corner + 0.01 * Vec3::X];
        let indices = if faces_up(i) { [0, 2, 1] } else { [0, 1, 2] };
        builder.add_mesh(&Mesh::emitter(&positions, &[indices])).expect("a valid lamp");
    }
    builder.build().expect("few triangles")
}

/// Points behind the wall of the windows.
fn room_points() -> Vec<ShadingPoint> {
    scenes::points::PointSet::Room.timing(1024)
}

/// Points in and around the unit cube; below its middle, with a normal, if one is given: with one along z all lights of
/// the cube are above their horizon, with one across about half of them.
fn cube_points(normal: Option<Vec3>) -> Vec<ShadingPoint> {
    let mut points = scenes::points::PointSet::Cube.timing(1024);
    if let Some(normal) = normal {
        for x in &mut points {
            // From 0.45 to 0.55 across, so that a horizon along z divides the cube in halves.
            let across = 0.45 + 0.1 * (x.position.truncate() + 0.5) / 2.0;
            let position = across.extend(-0.5 - x.position.z.abs());
            *x = ShadingPoint::surface(position, normal);
        }
    }
    points
}
