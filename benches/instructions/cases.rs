//! What is counted.

use core::hint::black_box;

use fanlight::{
    Effort, Environment, Glossy, Hit, Instance, LightSample, LightSampler, LightSamplerBuilder, LightSamplerView, Mesh,
    MeshId, Receiver, ShadingPoint, Splitting, Texture, TriangleId, Visibility, Weight,
};
use glam::{Affine3A, Quat, Vec3};
use smallvec::SmallVec;

use super::{building, bulbs};
use crate::scenes::building::{FLOORS, MANY_FLOORS};
use crate::scenes::pcg::Pcg32;
use crate::scenes::{self, Scene};

/// Calls of a case that is counted a call.
pub(super) const CALLS: usize = 256;
/// Numbers that are tried at a point to find out whether it is lit.
const TRIES: usize = 64;

/// One thing to be counted.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    /// Calls that the count is divided by.
    pub(crate) calls: usize,
    run: fn(),
}

impl Case {
    pub(crate) fn run(&self) {
        (self.run)();
    }
}

pub(crate) fn find(name: &str) -> Option<&'static Case> {
    ALL.iter().find(|case| case.name == name)
}

/// All cases. `cloud` is cloud-10000.
pub(crate) const ALL: &[Case] = &[
    Case { name: "cloud/sample", calls: CALLS, run: || sample("cloud-10000") },
    Case {
        name: "cloud/pmf",
        calls: CALLS,
        run: || of_samples("cloud-10000", |lights, x, s| lights.at(x).pmf(s.hit().expect("a triangle").triangle)),
    },
    Case {
        name: "cloud/pdf",
        calls: CALLS,
        run: || of_samples("cloud-10000", |lights, x, s| lights.at(x).pdf(&s.hit().expect("a triangle"))),
    },
    Case {
        name: "cloud/pdf_direction",
        calls: CALLS,
        run: || of_samples("cloud-10000", |lights, x, s| lights.at(x).pdf_direction(s.direction)),
    },
    Case { name: "cloud/sample_split", calls: CALLS, run: sample_split },
    Case { name: "cloud/nee", calls: CALLS, run: || next_event("cloud-10000") },
    Case { name: "cloud/lobe-sample", calls: CALLS, run: || sample_lobe("cloud-10000") },
    Case { name: "cloud/lobe-nee", calls: CALLS, run: || next_event_lobe("cloud-10000") },
    Case { name: "cloud/learned-nee", calls: CALLS, run: next_event_learned },
    Case { name: "cloud/build", calls: 1, run: build },
    Case { name: "quad/sample", calls: CALLS, run: || sample("quad") },
    Case {
        name: "quad/pdf",
        calls: CALLS,
        run: || of_samples("quad", |lights, x, s| lights.at(x).pdf(&s.hit().expect("a triangle"))),
    },
    Case { name: "quad/nee", calls: CALLS, run: || next_event("quad") },
    Case { name: "cornell/nee", calls: CALLS, run: cornell },
    Case { name: "bulbs/nee", calls: CALLS, run: bulbs::spheres },
    Case { name: "bulbs-triangles/nee", calls: CALLS, run: bulbs::triangles },
    Case { name: "building/nee", calls: CALLS, run: || building::blind(FLOORS) },
    Case { name: "building/learned-nee", calls: CALLS, run: || building::learned(FLOORS) },
    Case { name: "building-10/nee", calls: CALLS, run: || building::blind(MANY_FLOORS) },
    Case { name: "building-10/learned-nee", calls: CALLS, run: || building::learned(MANY_FLOORS) },
    Case { name: "quad/lobe-nee", calls: CALLS, run: || next_event_lobe("quad") },
    Case { name: "window/sample", calls: CALLS, run: || sample("window") },
    Case {
        name: "window/pdf",
        calls: CALLS,
        run: || of_samples("window", |lights, x, s| lights.at(x).pdf(&s.hit().expect("a triangle"))),
    },
    Case {
        name: "window/pdf_direction",
        calls: CALLS,
        run: || of_samples("window", |lights, x, s| lights.at(x).pdf_direction(s.direction)),
    },
    Case { name: "window/at", calls: CALLS, run: at },
    Case { name: "window/nee", calls: CALLS, run: || next_event("window") },
    Case { name: "window/least-nee", calls: CALLS, run: || next_event_least("window") },
    Case { name: "window/lobe-nee", calls: CALLS, run: || next_event_lobe("window") },
    Case { name: "window/emission", calls: CALLS, run: emission },
    Case { name: "star/sample", calls: CALLS, run: || sample("star") },
    Case { name: "star/nee", calls: CALLS, run: || next_event("star") },
    Case { name: "star/least-nee", calls: CALLS, run: || next_event_least("star") },
    Case { name: "grid-100/sample", calls: CALLS, run: || sample("grid-100") },
    Case { name: "grid-100/nee", calls: CALLS, run: || next_event("grid-100") },
    Case { name: "grid-100/least-nee", calls: CALLS, run: || next_event_least("grid-100") },
    Case {
        name: "environment/sample",
        calls: CALLS,
        run: || environment(|sky, u| sky.sample([u[0], u[1]]).map_or(0.0, |sample| sample.radiance)),
    },
    Case { name: "environment/pdf", calls: CALLS, run: || environment(|sky, u| sky.pdf(Vec3::from(u).normalize())) },
    Case {
        name: "environment-light/at",
        calls: CALLS,
        run: || environment_light(|lights, x, _| lights.at(x).pdf(&NOWHERE)),
    },
    Case {
        name: "environment-light/sample",
        calls: CALLS,
        run: || environment_light(|lights, x, u| lights.at(x).sample(u).map_or(0.0, |sample| sample.pdf)),
    },
    Case {
        name: "environment-light/pdf",
        calls: CALLS,
        run: || environment_light(|lights, x, u| lights.at(x).pdf_environment(Vec3::from(u) - 0.5)),
    },
    Case { name: "street/sample", calls: CALLS, run: || street(Street::Instances, false) },
    Case { name: "street/nee", calls: CALLS, run: || street(Street::Instances, true) },
    Case { name: "street-stretched/sample", calls: CALLS, run: || street(Street::Stretched, false) },
    Case { name: "street-stretched/nee", calls: CALLS, run: || street(Street::Stretched, true) },
    Case { name: "street-flattened/sample", calls: CALLS, run: || street(Street::Flattened, false) },
    Case { name: "street-flattened/nee", calls: CALLS, run: || street(Street::Flattened, true) },
    Case { name: "street-moving/nee", calls: CALLS, run: || street(Street::Moving, true) },
    Case { name: "street-moving-triangles/nee", calls: CALLS, run: || street(Street::MovingTriangles, true) },
    Case { name: "star-instance/nee", calls: CALLS, run: || star_instances(1) },
    Case { name: "star-10000-instances/nee", calls: CALLS, run: || star_instances(10_000) },
    Case { name: "star-100-instances/nee", calls: CALLS, run: || star_instances(100) },
    Case { name: "star-100-flattened/nee", calls: CALLS, run: || star_flattened(100) },
    Case { name: "star-10000-flattened/nee", calls: CALLS, run: || star_flattened(10_000) },
];

/// A point of a triangle that no workload has: its density costs what the first call at a shading point finds for all,
/// and nothing more.
const NOWHERE: Hit = Hit::new(TriangleId::new(MeshId::from_index(u32::MAX), 0), [0.0; 2]);

/// Everything in here is counted, and nothing else.
#[inline(never)]
fn measured(mut call: impl FnMut(usize)) {
    for i in 0..CALLS {
        call(i);
    }
}

fn lights(scene: &Scene) -> LightSampler {
    builder(scene).build().expect("the workload is small")
}

fn builder(scene: &Scene) -> LightSamplerBuilder<'_> {
    let mut builder = LightSampler::builder();
    if let Some(sky) = &scene.sky {
        builder = builder.environment(sky.environment.clone());
    }
    let texture = scene.image.as_ref().map(|image| {
        let texture = Texture::new(image.size, image.size, &image.texels).expect("the image is finite");
        builder.add_texture(texture.filter(image.filter))
    });
    for mesh in &scene.meshes {
        let weight = match (mesh.weight, texture) {
            (scenes::Weight::Constant(weight), _) => Weight::Constant(weight),
            (scenes::Weight::Image, Some(texture)) => Weight::Texture(texture),
            (scenes::Weight::Image, None) => unreachable!("a mesh with an image has one"),
        };
        let make = if mesh.portal {
            Mesh::portal(&mesh.positions, &mesh.indices)
        } else {
            Mesh::emitter(&mesh.positions, &mesh.indices)
        };
        builder.add_mesh(&make.uvs(&mesh.uvs).weight(weight)).expect("the workload is valid");
    }
    builder
}

fn numbers() -> Vec<[f32; 3]> {
    let mut pcg = Pcg32::new(3, 3);
    (0..CALLS).map(|_| pcg.uniform3()).collect()
}

/// Roughness of the lobes.
const ROUGHNESS: f32 = 0.1;

/// Returns the points as glossy surfaces, seen from directions above them.
fn with_lobes(points: Vec<ShadingPoint>) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(34, 2);
    let with_lobe = |x: ShadingPoint| {
        let Receiver::Surface(normal) = x.receiver else { unreachable!("all workloads have opaque surfaces") };
        let outgoing = pcg.direction().as_vec3();
        let outgoing = if outgoing.dot(normal) < 0.0 { -outgoing } else { outgoing };
        ShadingPoint::glossy(x.position, Glossy::new(normal, outgoing, ROUGHNESS))
    };
    points.into_iter().map(with_lobe).collect()
}

fn sample(workload: &str) {
    sample_at(workload, |points| points);
}

fn sample_lobe(workload: &str) {
    sample_at(workload, with_lobes);
}

fn sample_at(workload: &str, change: fn(Vec<ShadingPoint>) -> Vec<ShadingPoint>) {
    let scene = scenes::scene(workload);
    let (lights, points, numbers) = (lights(&scene), change(scene.points.timing(CALLS)), numbers());
    measured(|i| {
        black_box(lights.at(&points[i]).sample(numbers[i]));
    });
}

/// A density of what was drawn: elsewhere it would be a cheap zero.
fn of_samples(workload: &str, density: fn(&LightSampler, &ShadingPoint, &LightSample) -> f32) {
    let scene = scenes::scene(workload);
    let lights = lights(&scene);
    let points = scene.points.timing(16 * CALLS);
    let numbers = numbers();
    let drawn: Vec<(ShadingPoint, LightSample)> = points
        .iter()
        .zip(numbers.iter().cycle())
        .filter_map(|(x, u)| lights.at(x).sample(*u).map(|sample| (*x, sample)))
        .collect();
    measured(|i| {
        black_box(density(&lights, &drawn[i].0, &drawn[i].1));
    });
}

fn sample_split() {
    let scene = scenes::scene("cloud-10000");
    let (lights, points, numbers) = (lights(&scene), scene.points.timing(CALLS), numbers());
    let splitting = Splitting::new(0.9, 1);
    measured(|i| {
        let mut samples = SmallVec::<[LightSample; 16]>::new();
        lights.at(&points[i]).sample_split(numbers[i], &splitting, &mut samples);
        black_box(samples);
    });
}

/// Points of a workload at which something arrives, with the sampler.
fn lit_points(scene: &Scene, lights: &LightSampler) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(4, 4);
    let points = scene.points.timing(16 * CALLS);
    let lit = points.into_iter().filter(|x| (0..TRIES).any(|_| lights.at(x).sample(pcg.uniform3()).is_some()));
    let lit: Vec<_> = lit.take(CALLS).collect();
    assert_eq!(lit.len(), CALLS, "a workload has too few lit points");
    lit
}

/// What a host does at a lit point for one light sample.
fn next_event(workload: &str) {
    next_event_at(workload, |points| points);
}

/// What a host does at a lit point for one light sample with the least effort.
fn next_event_least(workload: &str) {
    next_event_at(workload, |points| points.into_iter().map(|x| x.with_effort(Effort::Least)).collect());
}

fn next_event_lobe(workload: &str) {
    next_event_at(workload, with_lobes);
}

fn next_event_at(workload: &str, change: fn(Vec<ShadingPoint>) -> Vec<ShadingPoint>) {
    let scene = scenes::scene(workload);
    let lights = lights(&scene);
    let (points, numbers) = (change(lit_points(&scene, &lights)), numbers());
    measured(|i| {
        let here = lights.at(&points[i]);
        if let Some(sample) = here.sample(numbers[i]) {
            black_box(here.pdf_sample_direction(&sample));
            black_box(sample);
        }
    });
}

/// What a host does at a lit point, with a table of what a wall through the middle of the cloud hides.
fn next_event_learned() {
    const RAYS: u64 = 100_000;
    let scene = scenes::scene("cloud-10000");
    let lights = lights(&scene);
    let points = lit_points(&scene, &lights);
    let seen =
        |x: &ShadingPoint, sample: &LightSample| f32::from(u8::from((x.position.x < 0.5) == (sample.position.x < 0.5)));
    let point = |i: u64| points[i as usize % points.len()];
    let table = Visibility::learn(&lights.as_view(), RAYS, point, seen).expect("nobody cancels");
    next_event_of(&lights.with_visibility(&table).expect("it was learned for these lights"), &points);
}

/// What a host does at these points for one light sample.
pub(super) fn next_event_of(lights: &LightSamplerView<'_>, points: &[ShadingPoint]) {
    let numbers = numbers();
    measured(|i| {
        let here = lights.at(&points[i]);
        if let Some(sample) = here.sample(numbers[i]) {
            black_box(here.pdf_sample_direction(&sample));
            black_box(sample);
        }
    });
}

/// What a host does on the floor and the walls of the Cornell box, whose light is two triangles without a texture.
fn cornell() {
    let light = [[0.35, 0.35], [0.65, 0.35], [0.65, 0.65], [0.35, 0.65]].map(|[x, y]| Vec3::new(x, y, 0.999));
    let mut builder = LightSampler::builder();
    let mesh = Mesh::emitter(&light, &[[0, 2, 1], [0, 3, 2]]).weight(Weight::Constant(15.0));
    builder.add_mesh(&mesh).expect("the light is sound");
    let lights = builder.build().expect("the scene is small");
    let mut pcg = Pcg32::new(5, 5);
    let points: Vec<ShadingPoint> = (0..CALLS)
        .map(|i| {
            let [u, v, _] = pcg.uniform3();
            match i % 3 {
                0 => ShadingPoint::surface(Vec3::new(u, v, 0.0), Vec3::Z),
                1 => ShadingPoint::surface(Vec3::new(0.0, u, v), Vec3::X),
                _ => ShadingPoint::surface(Vec3::new(u, 1.0, v), Vec3::NEG_Y),
            }
        })
        .collect();
    next_event_to_emitters(&lights, &points);
}

/// Calls of a host with emitters alone, whose samples have the density that it needs.
pub(super) fn next_event_to_emitters(lights: &LightSampler, points: &[ShadingPoint]) {
    let numbers = numbers();
    measured(|i| {
        let here = lights.at(&points[i]);
        if let Some(sample) = here.sample(numbers[i]) {
            black_box(sample.pdf);
            black_box(sample);
        }
    });
}

/// What all calls at a point share.
fn at() {
    let scene = scenes::scene("window");
    let lights = lights(&scene);
    let points = lit_points(&scene, &lights);
    measured(|i| {
        black_box(lights.at(&points[i]).pdf(&NOWHERE));
    });
}

fn build() {
    let scene = scenes::scene("cloud-10000");
    let mut builder = Some(builder(&scene));
    measured(|_| {
        if let Some(builder) = builder.take() {
            black_box(builder.build().expect("the workload is small"));
        }
    });
}

fn emission() {
    let scene = scenes::scene("window");
    let lights = lights(&scene);
    let emission = lights.emission();
    let numbers = numbers();
    measured(|i| {
        let ([a, b, c], [d, e, _]) = (numbers[i], numbers[CALLS - 1 - i]);
        black_box(emission.sample([a, b, c, d, e]));
    });
}

fn environment(call: fn(&Environment, [f32; 3]) -> f32) {
    let sky = scenes::sky::Sky::new().environment;
    let numbers = numbers();
    measured(|i| {
        black_box(call(&sky, numbers[i]));
    });
}

/// The sky of the workloads as the only light, at the points of the window.
fn environment_light(call: fn(&LightSampler, &ShadingPoint, [f32; 3]) -> f32) {
    let sky = scenes::sky::Sky::new().environment;
    let lights = LightSampler::builder().environment(sky).environment_as_light().build().expect("the sky is a light");
    let (points, numbers) = (scenes::scene("window").points.timing(CALLS), numbers());
    measured(|i| {
        black_box(call(&lights, &points[i], numbers[i]));
    });
}

/// A clip-mapped window under the captured sky with its sun, or a wall of them: one object.
fn star_instances(count: u32) {
    star_wall(count, true);
}

/// The windows of [`star_instances`] as meshes of their own.
fn star_flattened(count: u32) {
    star_wall(count, false);
}

fn star_wall(count: u32, as_instances: bool) {
    let scene = scenes::scene("star");
    let points = lit_points(&scene, &lights(&scene));
    let mut builder =
        LightSampler::builder().environment(scene.sky.as_ref().expect("there is one").environment.clone());
    let image = scene.image.as_ref().expect("there is one");
    let texture = Texture::new(image.size, image.size, &image.texels).expect("the image is finite");
    let texture = builder.add_texture(texture.filter(image.filter));
    let weight = Weight::Texture(texture);
    let meshes: Vec<Mesh<'_>> =
        scene.meshes.iter().map(|m| Mesh::portal(&m.positions, &m.indices).uvs(&m.uvs).weight(weight)).collect();
    let window = as_instances.then(|| builder.add_object(&meshes).expect("the window is sound"));
    let row = f64::from(count).sqrt() as u32;
    for i in 0..count {
        let [x, z] = [i % row, i / row].map(|k| (k as f32 - (row / 2) as f32) * 2.0);
        let place = Vec3::new(x, 0.0, z);
        if let Some(window) = window {
            let instance = Instance::new(window, Affine3A::from_translation(place));
            builder.add_instance(instance).expect("the place is sound");
            continue;
        }
        for mesh in &scene.meshes {
            let placed: Vec<Vec3> = mesh.positions.iter().map(|p| *p + place).collect();
            let mesh = Mesh::portal(&placed, &mesh.indices).uvs(&mesh.uvs).weight(weight);
            builder.add_mesh(&mesh).expect("the window is sound");
        }
    }
    let lights = builder.build().expect("the wall is small");
    let numbers = numbers();
    measured(|i| {
        let here = lights.at(&points[i]);
        if let Some(sample) = here.sample(numbers[i]) {
            black_box(here.pdf_sample_direction(&sample));
            black_box(sample);
        }
    });
}

/// How the lamps of a street are passed in.
#[derive(Clone, Copy, PartialEq)]
enum Street {
    /// One object, turned and scaled evenly.
    Instances,
    /// One object, each lamp stretched by its own factor.
    Stretched,
    /// The lamps of [`Street::Instances`] as a mesh each.
    Flattened,
    /// Those of [`Street::Instances`], each of which goes by a little while the shutter is open.
    Moving,
    /// The lamps of [`Street::Moving`] as a mesh each.
    MovingTriangles,
}

/// Four hundred lamps of two hundred triangles, and points between them.
fn street(kind: Street, with_density: bool) {
    let mut pcg = Pcg32::new(8, 8);
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    // A ball of facets that face outwards.
    for i in 0..200 {
        let out = pcg.direction().as_vec3();
        let (s, t) = out.any_orthonormal_pair();
        positions.extend([out * 0.2, out * 0.2 + s * 0.02, out * 0.2 + t * 0.02]);
        indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let transforms: Vec<Affine3A> = (0..400)
        .map(|i| {
            let [u, v, w] = pcg.uniform3();
            let turn = Quat::from_axis_angle(pcg.direction().as_vec3(), 6.0 * u);
            let stretch = if kind == Street::Stretched { 0.5 + 1.5 * w } else { 1.0 };
            let place = Vec3::new((i % 20) as f32 * 2.0, (i / 20) as f32 * 2.0, 1.0);
            Affine3A::from_scale_rotation_translation((0.5 + v) * Vec3::new(1.0, 1.0, stretch), turn, place)
        })
        .collect();
    let mut builder = LightSampler::builder();
    let is_moving = matches!(kind, Street::Moving | Street::MovingTriangles);
    let way = if is_moving { Vec3::new(0.1, 0.05, 0.0) } else { Vec3::ZERO };
    if matches!(kind, Street::Flattened | Street::MovingTriangles) {
        for transform in &transforms {
            let moved: Vec<Vec3> = positions.iter().map(|p| transform.transform_point3(*p)).collect();
            let later: Vec<Vec3> = moved.iter().map(|p| *p + way).collect();
            builder.add_mesh(&Mesh::emitter(&moved, &indices).moving_to(&later)).expect("the lamp is sound");
        }
    } else {
        let lamp = builder.add_object(&[Mesh::emitter(&positions, &indices)]).expect("the lamp is sound");
        for transform in &transforms {
            let instance = Instance::new(lamp, *transform).moving_to(Affine3A::from_translation(way) * *transform);
            builder.add_instance(instance).expect("the place is sound");
        }
    }
    let lights = builder.build().expect("the street is small");
    let points: Vec<ShadingPoint> = (0..CALLS)
        .map(|_| {
            let [u, v, w] = pcg.uniform3();
            ShadingPoint::surface(Vec3::new(38.0 * u, 38.0 * v, 0.5 * w), Vec3::Z).at_time(w)
        })
        .collect();
    let numbers = numbers();
    measured(|i| {
        let here = lights.at(&points[i]);
        if let Some(sample) = here.sample(numbers[i]) {
            if with_density {
                black_box(here.pdf_sample_direction(&sample));
            }
            black_box(sample);
        }
    });
}
