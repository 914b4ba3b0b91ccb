//! What is counted.

use core::hint::black_box;

use fanlight::{
    Environment, LightSample, LightSampler, LightSamplerBuilder, Mesh, ShadingPoint, Splitting, Texture, Weight,
};
use smallvec::SmallVec;

use crate::scenes::pcg::Pcg32;
use crate::scenes::{self, Scene};

/// Calls a case.
pub(crate) const CALLS: usize = 256;

/// One thing to be counted.
pub(crate) struct Case {
    pub(crate) name: &'static str,
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
    Case { name: "cloud/sample", run: || sample("cloud-10000") },
    Case { name: "cloud/pmf", run: || of_samples("cloud-10000", |lights, x, s| lights.pmf(x, s.hit.triangle)) },
    Case { name: "cloud/pdf", run: || of_samples("cloud-10000", |lights, x, s| lights.pdf(x, &s.hit)) },
    Case {
        name: "cloud/pdf_direction",
        run: || of_samples("cloud-10000", |lights, x, s| lights.pdf_direction(x, s.direction)),
    },
    Case { name: "cloud/sample_split", run: sample_split },
    Case { name: "cloud/build", run: build },
    Case { name: "quad/sample", run: || sample("quad") },
    Case { name: "quad/pdf", run: || of_samples("quad", |lights, x, s| lights.pdf(x, &s.hit)) },
    Case { name: "window/sample", run: || sample("window") },
    Case { name: "window/pdf", run: || of_samples("window", |lights, x, s| lights.pdf(x, &s.hit)) },
    Case {
        name: "window/pdf_direction",
        run: || of_samples("window", |lights, x, s| lights.pdf_direction(x, s.direction)),
    },
    Case { name: "window/emission", run: emission },
    Case { name: "star/sample", run: || sample("star") },
    Case { name: "grid-100/sample", run: || sample("grid-100") },
    Case {
        name: "environment/sample",
        run: || environment(|sky, u| sky.sample([u[0], u[1]]).map_or(0.0, |sample| sample.radiance)),
    },
    Case { name: "environment/pdf", run: || environment(|sky, u| sky.pdf(glam::Vec3::from(u).normalize())) },
];

/// Everything in here is counted, and nothing else.
#[inline(never)]
fn measured(mut call: impl FnMut(usize)) {
    for i in 0..CALLS {
        call(i);
    }
}

fn lights(scene: &Scene) -> LightSampler {
    let mut builder = LightSamplerBuilder::new();
    add(&mut builder, scene);
    builder.build().expect("the workload is small")
}

fn add<'a>(builder: &mut LightSamplerBuilder<'a>, scene: &'a Scene) {
    if let Some(sky) = &scene.sky {
        builder.environment(sky.environment.clone());
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
}

fn numbers() -> Vec<[f32; 3]> {
    let mut pcg = Pcg32::new(3, 3);
    (0..CALLS).map(|_| pcg.uniform3()).collect()
}

fn sample(workload: &str) {
    let scene = scenes::scene(workload);
    let (lights, points, numbers) = (lights(&scene), scene.points.timing(CALLS), numbers());
    measured(|i| {
        black_box(lights.sample(&points[i], numbers[i]));
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
        .filter_map(|(x, u)| lights.sample(x, *u).map(|sample| (*x, sample)))
        .collect();
    measured(|i| {
        black_box(density(&lights, &drawn[i].0, &drawn[i].1));
    });
}

fn sample_split() {
    let scene = scenes::scene("cloud-10000");
    let (lights, points, numbers) = (lights(&scene), scene.points.timing(CALLS), numbers());
    let splitting = Splitting { threshold: 0.9, levels: 1 };
    measured(|i| {
        let mut samples = SmallVec::<[LightSample; 16]>::new();
        lights.sample_split(&points[i], numbers[i], &splitting, &mut samples);
        black_box(samples);
    });
}

fn build() {
    let scene = scenes::scene("cloud-10000");
    let mut builder = Some(LightSamplerBuilder::<16, 4>::new());
    builder.iter_mut().for_each(|builder| add(builder, &scene));
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
