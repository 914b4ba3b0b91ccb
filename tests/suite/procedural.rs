//! Weights that a function gives, next to an image of the same function.

use crate::common::density::{OnTriangle, bin, probes};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{LightMesh, Scene, Sky};
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    Arity, Error, Filter, Hit, Illumination, LightSampler, LightSamplerView, Mesh, MeshId, Procedural, ShadingPoint,
    Texture, TriangleId, Weight,
};
use glam::{Mat3, Vec2, Vec3, vec2, vec3};

/// Discs around all points with integer coordinates.
const RADIUS: f32 = 0.3;
const BRIGHT: f32 = 5.0;
/// Copies of a disc along an edge of the light.
const COPIES: f32 = 4.0;

fn dots(uv: Vec2) -> f32 {
    if uv.distance(uv.round()) < RADIUS { BRIGHT } else { 0.0 }
}

/// Exact for boxes that meet one disc, or none.
fn dots_within(low: Vec2, high: Vec2) -> [f32; 2] {
    if (high - low).max_element() >= 0.5 {
        return [0.0, BRIGHT];
    }
    let center = (0.5 * (low + high)).round();
    let farthest = (low - center).abs().max((high - center).abs()).length();
    let nearest = (low - RADIUS).ceil().max((high + RADIUS).floor());
    let met = (low - RADIUS).ceil().cmple((high + RADIUS).floor()).all()
        && nearest.clamp(low, high).distance(nearest) < RADIUS;
    [if farthest < RADIUS { BRIGHT } else { 0.0 }, if met { BRIGHT } else { 0.0 }]
}

/// A smooth function, with bounds that follow from its slope.
fn waves(uv: Vec2) -> f32 {
    1.0 + (3.0 * uv.x).sin() * (2.0 * uv.y).cos()
}

fn waves_within(low: Vec2, high: Vec2) -> [f32; 2] {
    let half = 0.5 * (high - low);
    let reach = 3.0 * half.x + 2.0 * half.y + 1e-6;
    let middle = waves(low + half);
    [(middle - reach).max(0.0), (middle + reach).min(2.0)]
}

const DOTS: &dyn Procedural = &(dots, dots_within);
const WAVES: &dyn Procedural = &(waves, waves_within);
const LOOSE: &dyn Procedural = &(dots, |_: Vec2, _: Vec2| [0.0, 3.0 * BRIGHT]);

/// One light of two triangles above the origin, as a scene for the tools that need its shape alone.
fn light() -> Scene {
    let mut mesh = LightMesh::quad(vec3(-1.0, -1.0, 1.0), Vec3::Y * 2.0, Vec3::X * 2.0);
    mesh.uvs = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X].map(|uv| COPIES * uv).to_vec();
    Scene {
        name: "one light".to_owned(),
        meshes: vec![mesh],
        images: Vec::new(),
        sky: Sky::Constant(1.0),
        rotation: Mat3::IDENTITY,
        illumination: Illumination::default(),
    }
}

fn sampler(scene: &Scene, function: &dyn Procedural, arity: Arity) -> LightSampler {
    let mut builder = LightSampler::builder().arity(arity);
    let weight = Weight::Texture(builder.add_procedural(function));
    let LightMesh { positions, indices, uvs, .. } = &scene.meshes[0];
    builder.add_mesh(&Mesh::emitter(positions, indices).uvs(uvs).weight(weight)).expect("the mesh is valid");
    builder.build().expect("the light is valid")
}

fn points() -> [ShadingPoint; 3] {
    [
        ShadingPoint::volume(vec3(0.2, -0.3, 0.1)),
        ShadingPoint::surface(vec3(0.9, 0.4, 0.0), Vec3::Z),
        ShadingPoint::surface(vec3(-0.2, 0.7, -1.0), vec3(0.8, 0.0, 0.6)),
    ]
}

/// p-value of samples over the cells of both triangles, the integral of the density, and the largest difference
/// between the density of a sample and that of its hit.
fn examine(lights: &LightSampler, scene: &Scene, x: &ShadingPoint, least_depth: u32, wrong: bool) -> (f64, f64, f64) {
    const DEPTH: u32 = 3;
    const SAMPLES: usize = 50_000;
    let mut pcg = Pcg32::new(7, 61);
    let bins = 1 << (2 * DEPTH);
    let (mut observed, mut kept, mut worst) = (vec![0.0; 2 * bins], Vec::new(), 0.0_f64);
    for _ in 0..SAMPLES {
        let Some(sample) = lights.at(x).sample(pcg.cube()) else { continue };
        observed[sample.hit().expect("a triangle").triangle.triangle as usize * bins
            + bin(sample.hit().expect("a triangle").barycentrics, DEPTH)] += 1.0;
        worst = worst.max(f64::from(lights.at(x).pdf(&sample.hit().expect("a triangle")) / sample.pdf - 1.0).abs());
        kept.push(sample);
    }
    kept.truncate(2000);
    let probes = probes(scene, &kept);
    let pdf = |hit: &Hit| {
        let factor = if wrong && hit.barycentrics[1] > 0.5 { 1.15 } else { 1.0 };
        factor * f64::from(lights.at(x).pdf(hit))
    };
    let mut expected = Vec::new();
    for (triangle, probes) in probes[0].iter().enumerate() {
        let on = OnTriangle::new(scene, (0, triangle), x, &pdf);
        expected.extend(on.integrate(DEPTH, least_depth, probes).0);
    }
    let integral = expected.iter().sum::<f64>();
    expected.iter_mut().for_each(|share| *share *= SAMPLES as f64);
    (chi_square(&observed, &expected).0, integral, worst)
}

/// Each with how far the integral may be off: along edges the integration misses slivers that are smaller than it
/// looks.
const CASES: [(&dyn Procedural, f64); 2] = [(DOTS, 3e-3), (WAVES, 1e-5)];

/// Samples fall where the density says, and it integrates to one.
fn check_density(count: usize, case: impl Fn(usize) -> usize + Sync) {
    let scene = light();
    let found = parallel::map(count, |i| {
        let (function, tolerance) = CASES[case(i) / 3];
        let lights = sampler(&scene, function, if case(i) % 3 == 0 { Arity::Sixteen } else { Arity::Eight });
        (examine(&lights, &scene, &points()[case(i) % 3], 6, false), tolerance)
    });
    for ((p, integral, worst), tolerance) in found {
        println!("p {p:.3}, integral {integral:.6}, largest difference {worst:e}");
        assert!(p > sidak(0.01, count), "p = {p:e}");
        assert!((integral - 1.0).abs() < tolerance, "{integral}");
        assert!(worst < 1e-5, "{worst:e}");
    }
}

#[test]
fn samples_of_a_smooth_function_follow_the_density() {
    check_density(1, |_| 3);
}

#[test]
#[ignore = "release tier: a minute; cargo test --release --test suite -- procedural --ignored"]
fn samples_of_any_function_follow_the_density() {
    check_density(3 * CASES.len(), |i| i);
}

#[test]
fn a_density_that_is_off_is_found() {
    let scene = light();
    let (p, integral, _) = examine(&sampler(&scene, WAVES, Arity::Sixteen), &scene, &points()[0], 6, true);
    assert!(p < 1e-9, "p = {p:e}, integral {integral}");
}

#[test]
fn wherever_the_function_is_bright_it_can_be_sampled() {
    let scene = light();
    for function in [DOTS, WAVES, LOOSE] {
        let lights = sampler(&scene, function, Arity::Sixteen);
        let mut pcg = Pcg32::new(3, 62);
        let mut dark = 0;
        for _ in 0..20_000 {
            let barycentrics = [pcg.f32(), pcg.f32()].map(|b| 0.5 * b);
            let hit = Hit::new(TriangleId::new(MeshId::from_index(0), 0), barycentrics);
            let [a, b, c] = [0, 1, 2].map(|i| scene.meshes[0].uvs[i]);
            let uv = a + barycentrics[0] * (b - a) + barycentrics[1] * (c - a);
            let pdf = lights.at(&points()[0]).pdf(&hit);
            if function.weight(uv) > 0.0 {
                assert!(pdf > 0.0, "{uv} has no density");
            } else if pdf == 0.0 {
                dark += 1;
            }
        }
        // A good bound proves most of what is dark.
        let expected = core::ptr::eq(function, DOTS);
        assert_eq!(dark > 12_000, expected, "{dark} dark points");
    }
}

/// Mean and relative variance of one sample's estimate of what arrives at a point.
fn estimate(lights: &LightSampler, x: &ShadingPoint, value: impl Fn(Vec3) -> f32) -> (f64, f64, f64) {
    const SAMPLES: u32 = 50_000;
    let mut pcg = Pcg32::new(5, 63);
    let mut mean = Mean::default();
    for _ in 0..SAMPLES {
        let sample = lights.at(x).sample(pcg.cube());
        mean.add(sample.map_or(0.0, |s| f64::from(value(s.position) * x.cosine(s.direction) / s.pdf)));
    }
    let deviation = mean.error() * f64::from(SAMPLES).sqrt();
    (mean.mean(), mean.error(), (deviation / mean.mean()).powi(2))
}

/// A sampler that knows an image of a function instead, or, without texels, nothing of it.
fn by_image(scene: &Scene, function: &dyn Procedural, size: usize) -> LightSampler {
    let place = |i: usize| vec2((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) / size as f32 * COPIES;
    let texels: Vec<f32> = (0..size * size).map(|i| function.weight(place(i))).collect();
    let mut builder = LightSampler::builder();
    let weight = if size == 0 {
        Weight::Constant(1.0)
    } else {
        let texture = Texture::new(size, size, &texels).expect("the image is valid").filter(Filter::Nearest);
        Weight::Texture(builder.add_texture(texture))
    };
    let LightMesh { positions, indices, uvs, .. } = &scene.meshes[0];
    let uvs: Vec<Vec2> = uvs.iter().map(|uv| *uv / COPIES).collect();
    builder.add_mesh(&Mesh::emitter(positions, indices).uvs(&uvs).weight(weight)).expect("the mesh is valid");
    builder.build().expect("the light is valid")
}

#[test]
fn a_function_is_as_good_a_guide_as_an_image_of_it() {
    let scene = light();
    for (name, function, is_tight) in [("dots", DOTS, true), ("waves", WAVES, true), ("loose", LOOSE, false)] {
        let [image, unaware] = [512, 0].map(|size| by_image(&scene, function, size));
        let lights = sampler(&scene, function, Arity::Sixteen);
        println!(
            "{name}: {:?} and {:?} bytes",
            image.as_view().bytes().texture_trees,
            lights.as_view().bytes().texture_trees
        );
        for x in points() {
            let value = |p: Vec3| function.weight(COPIES * 0.5 * vec2(p.x + 1.0, p.y + 1.0));
            let image = estimate(&image, &x, value).2;
            let (truth, truth_error, uniform) = estimate(&unaware, &x, value);
            let (found, error, function) = estimate(&lights, &x, value);
            println!("{found:.4} of {truth:.4}, variance {uniform:.4}, by image {image:.4}, by function {function:.4}");
            assert!((found - truth).abs() < 4.0 * truth_error.hypot(error), "{name}: {found} of {truth}");
            let most = if is_tight { 1.2 * image + 0.01 } else { 0.1 * uniform };
            assert!(function < most, "{name}: {function}, but at most {most}");
        }
    }
}

/// Bytes of the trees over triangles that each show another part of a function.
fn cells(count: u32, scale: f32, function: &dyn Procedural) -> usize {
    let mut builder = LightSampler::builder();
    let weight = Weight::Texture(builder.add_procedural(function));
    for i in 0..count {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + 2.0 * Vec3::Z * i as f32);
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|uv| scale * uv + 0.137 * i as f32);
        let mesh = Mesh::emitter(&positions, &[[0, 1, 2]]).uvs(&uvs).weight(weight);
        builder.add_mesh(&mesh).expect("the mesh is valid");
    }
    let lights = builder.build().expect("the lights are valid");
    let mut bytes = lights.to_bytes();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let words = crate::common::lights::aligned(&bytes);
    LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    lights.as_view().bytes().texture_trees
}

#[test]
fn memory_does_not_grow_with_what_the_function_shows() {
    for function in [DOTS, WAVES, LOOSE] {
        let bytes = [1.0, 10.0, 1e3, 1e5].map(|scale| cells(1, scale, function));
        println!("{bytes:?}");
        assert!(bytes.iter().all(|&bytes| bytes <= 1 << 18), "{bytes:?}");
    }
    let many = cells(300, 8.0, DOTS);
    assert!(many <= (1 << 20) + 300 * ((1 << 12) + 40) && many > 1 << 20, "{many}");
}

/// The error of a mesh with such a function; the builder must be as if it had never been there.
fn fault(function: &dyn Procedural) -> String {
    let scene = light();
    let LightMesh { positions, indices, uvs, .. } = &scene.meshes[0];
    let good = |weight| Mesh::emitter(positions, indices).uvs(uvs).weight(weight);
    let build = |bad: Option<&mut Option<Error>>| {
        let mut builder = LightSampler::builder();
        let (dots, wrong) = (builder.add_procedural(DOTS), builder.add_procedural(function));
        builder.add_mesh(&good(Weight::Texture(dots))).expect("the mesh is valid");
        if let Some(error) = bad {
            *error = builder.add_mesh(&good(Weight::Texture(wrong))).err();
        }
        builder.add_mesh(&good(Weight::Texture(dots))).expect("the mesh is valid");
        builder.build().expect("the lights are valid").to_bytes()
    };
    let mut error = None;
    let bytes = build(Some(&mut error));
    let message = error.expect("the function is wrong").to_string();
    assert!(bytes == build(None), "the builder is not as before");
    message
}

#[test]
fn what_a_function_says_wrongly_is_named() {
    let inner = |low: Vec2, high: Vec2| (high - low).max_element() < 0.6 && low.x > 1.0;
    for (bad, parts) in [
        ([f32::NAN, 1.0], ["NaN and 1", "finite"]),
        ([0.0, f32::NAN], ["0 and NaN", "finite"]),
        ([-0.5, 1.0], ["-0.5 and 1", "not negative"]),
        ([0.0, f32::INFINITY], ["0 and inf", "finite"]),
        ([3.0, 2.0], ["3 and 2", "order"]),
    ] {
        // The whole triangle, and a cell deep inside of it.
        let whole = fault(&(dots, move |_: Vec2, _: Vec2| bad));
        let deep = fault(&(dots, move |low, high| if inner(low, high) { bad } else { [0.0, BRIGHT] }));
        for message in [&whole, &deep] {
            assert!(message.starts_with("mesh 1: the bounds of its weight over uv ("), "{message}");
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
        assert!(whole.contains("uv (-0.0000038146973, -0.0000038146973) to (4.000004, 4.000004)"), "{whole}");
    }
    for bad in [f32::NAN, f32::INFINITY, -1.0, 7.5] {
        let message = fault(&(move |uv: Vec2| if uv.x > 2.0 { bad } else { 1.0 }, |_: Vec2, _: Vec2| [0.0, BRIGHT]));
        assert!(message.starts_with("mesh 1: the weight at uv ("), "{message}");
        assert!(message.contains(&format!("is {bad}, ")) && message.ends_with("are 0 and 5"), "{message}");
    }
    // A bound that is the same at both ends ends the tree: one look tells that it is wrong.
    let message = fault(&(dots, |_: Vec2, _: Vec2| [BRIGHT; 2]));
    assert!(
        message.ends_with(
            "is 0, but its bounds over uv (-0.0000038146973, -0.0000038146973) to (4.000004, 4.000004) are 5 and 5"
        ),
        "{message}"
    );
}
