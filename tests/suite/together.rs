//! What was built one by one, used together: instances, lights of every kind, light groups, learned visibility, lobes,
//! media.

use fanlight::{
    DistantLight, Environment, Filter, Glossy, Hit, Instance, InstanceId, LightSample, LightSampler, LightSamplerView,
    Mesh, PointLight, PointSampler, RaySegment, SampledLight, ShadingPoint, SphereLight, Splitting, Visibility,
};
use glam::{Affine3A, Quat, Vec3, vec3};

use crate::common::pcg::Pcg32;

/// Light groups of everything in turn.
const GROUPS: [u32; 3] = [1, 2, 4];
/// Standard errors of a difference that are granted: two-sided, 1e-6 by the normal distribution.
const LIMIT: f64 = 4.9;
const RADIANCE: f32 = 2.0;
const INTENSITY: f32 = 1.5;
const INSTANCES: u32 = 12;

/// Sun of a few texels in a gray sky.
fn sky() -> Environment {
    let texels: Vec<f32> = (0..64 * 32).map(|i| if i % 64 == 20 && i / 64 == 9 { 400.0 } else { 0.5 }).collect();
    Environment::from_lat_long(64, 32, &texels, Filter::Nearest).expect("a good image")
}

/// Twelve instances of a lamp of two triangles and a window above it, two spheres, a point, and two distant lights.
/// Only what is in some of `groups` is added; everything keeps its numbers, as the rest is there without light.
fn scene(groups: u32) -> LightSampler {
    let corners = [[-0.2, -0.2, 0.0], [-0.2, 0.2, 0.0], [0.2, 0.2, 0.0], [0.2, -0.2, 0.0]].map(Vec3::from);
    let above = corners.map(|corner| 2.0 * corner + vec3(0.1, 0.0, 0.5));
    let quad = [[0, 1, 2], [0, 2, 3]];
    let emitter = Mesh::emitter(&corners, &quad).weight(fanlight::Weight::Constant(RADIANCE));
    let mut builder = LightSampler::builder().environment(sky());
    let lamp = builder.add_object(&[emitter, Mesh::portal(&above, &quad)]).expect("a good object");
    let is_in = |group: u32| groups & group != 0;
    let factor = |group| if is_in(group) { 1.0 } else { 0.0 };
    for i in 0..INSTANCES {
        let group = GROUPS[i as usize % 3];
        let place = vec3((i % 4) as f32 - 1.5, (i / 4) as f32 - 1.0, 2.0 + 0.3 * (i % 5) as f32);
        let scale = [Vec3::ONE, vec3(1.0, 0.5, 1.0), vec3(-1.0, 1.0, 2.0)][i as usize % 3];
        let transform = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.1 * i as f32), place);
        let instance = Instance::new(lamp, transform).groups(group).scaled(factor(group));
        builder.add_instance(instance).expect("a good instance");
    }
    for (i, group) in GROUPS.into_iter().take(2).enumerate() {
        let sphere = SphereLight::new(vec3(i as f32 - 0.5, 1.5, 1.0), 0.2, RADIANCE * factor(group));
        builder.add_light_to(group, sphere).expect("a good light");
    }
    let point = PointLight::new(vec3(0.3, -1.5, 1.5), INTENSITY * factor(GROUPS[2]));
    builder.add_light_to(GROUPS[2], point).expect("a good light");
    for (i, group) in GROUPS.into_iter().take(2).enumerate() {
        let axis = vec3(0.4 - 0.5 * i as f32, 0.3, -1.0);
        let light = DistantLight::new(axis, factor(group)).angular_radius(0.1 * i as f32);
        builder.add_light_to(group, light).expect("a good light");
    }
    builder.build().expect("a good scene")
}

/// What a sample brings to a point, walls left out, times the receiver's weight; 0 for `None`.
fn brought(lights: &LightSamplerView<'_>, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let radiance = match sample.light {
        SampledLight::Triangle(hit) if hit.triangle.mesh.index() == 0 => RADIANCE,
        SampledLight::Triangle(_) => lights.environment().radiance(sample.direction),
        SampledLight::Shape(id) if id.index() == 4 => {
            DistantLight::new(Vec3::NEG_Z, 1.0).angular_radius(0.1).radiance()
        }
        SampledLight::Shape(_) => RADIANCE,
        SampledLight::Punctual(id) if id.index() == 3 => 1.0,
        SampledLight::Punctual(_) => INTENSITY / (sample.distance * sample.distance),
        SampledLight::Environment => unreachable!("it is no light"),
        _ => unreachable!("there are no other kinds"),
    };
    f64::from(radiance) * f64::from(x.weight(sample.direction)) / f64::from(sample.pdf)
}

/// Mean and standard error of what samples bring; every sample's densities are looked up again.
fn estimate(lights: &LightSamplerView<'_>, x: &ShadingPoint, n: u32, pcg: &mut Pcg32) -> [f64; 2] {
    let at = lights.at(x);
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let Some(sample) = at.sample(pcg.cube()) else { continue };
        if i % 16 == 0 {
            check_densities(&at, &sample);
        }
        let value = brought(lights, x, &sample);
        sum += value;
        squares += value * value;
    }
    let (n, mean) = (f64::from(n), sum / f64::from(n));
    [mean, ((squares / n - mean * mean).max(0.0) / n).sqrt()]
}

fn check_densities(at: &PointSampler<'_>, sample: &LightSample) {
    let again = match sample.light {
        SampledLight::Triangle(hit) => at.pdf(&hit),
        SampledLight::Shape(id) => at.pdf_light(id, sample.direction),
        SampledLight::Punctual(id) => at.pmf_light(id),
        _ => unreachable!("there are no other kinds"),
    };
    assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{again} instead of {sample:?}");
    let (direction, whole) = (at.pdf_direction(sample.direction), at.pdf_sample_direction(sample));
    assert!(whole >= sample.pdf, "{whole} for {sample:?}");
    if sample.has_extent() && sample.distance.is_finite() {
        // The ray may pass the edge of a triangle by rounding.
        assert!(direction < 1.001 * whole, "{direction} instead of {whole} for {sample:?}");
    }
}

fn points(pcg: &mut Pcg32) -> Vec<ShadingPoint> {
    (0..6)
        .map(|i| {
            let position = vec3(3.0 * pcg.f32() - 1.5, 3.0 * pcg.f32() - 1.5, 0.5 * pcg.f32());
            match i % 3 {
                0 => ShadingPoint::surface(position, Vec3::Z),
                1 => ShadingPoint::volume(position),
                _ => {
                    let view = vec3(0.5, 0.2, 0.7).normalize();
                    ShadingPoint::glossy(position, Glossy::new(Vec3::Z, view, 0.3).with_weights(0.5, 0.5))
                }
            }
        })
        .collect()
}

fn check_same(what: &str, [a, ea]: [f64; 2], [b, eb]: [f64; 2]) {
    let error = (ea * ea + eb * eb).sqrt();
    assert!((a - b).abs() < LIMIT * error, "{what}: {a} ± {ea} and {b} ± {eb}");
    assert!(a > 0.0 && error < 0.1 * a, "{what}: {a} ± {error} says nothing");
}

/// A point that receives some groups gets what a scene without the others sends it.
#[test]
fn instances_and_lights_are_received_by_groups() {
    let (all, mut pcg) = (scene(7), Pcg32::new(1, 170));
    for (number, x) in points(&mut pcg).into_iter().enumerate() {
        for groups in [1, 2, 4, 5] {
            let received = x.with_groups(groups);
            let with_groups = estimate(&all.as_view(), &received, 4000, &mut pcg);
            let alone = estimate(&scene(groups).as_view(), &x, 4000, &mut pcg);
            check_same(&format!("point {number}, groups {groups}"), with_groups, alone);
            let at = all.at(&received);
            for i in 0..INSTANCES {
                let (triangle, instance) = (fanlight::TriangleId::new(fanlight::MeshId::from_index(0), 0), i);
                let hit = Hit::on_instance(InstanceId::from_index(instance), triangle, [0.3, 0.3]);
                let is_out = groups & GROUPS[i as usize % 3] == 0;
                assert!(!is_out || at.pdf(&hit) == 0.0, "instance {i} for groups {groups}");
            }
        }
    }
}

/// Whatever a table says, samples bring the same.
#[test]
fn learned_visibility_of_instances_and_lights_changes_no_mean() {
    let (lights, mut pcg) = (scene(7), Pcg32::new(2, 170));
    let all = points(&mut pcg);
    let near = |i: u64| all[i as usize % all.len()];
    let seen = |_: &ShadingPoint, sample: &LightSample| f32::from(u8::from(sample.direction.x > 0.0));
    let table = Visibility::learn(&lights.as_view(), 20_000, near, seen).expect("nobody cancels");
    let learned = lights.with_visibility(&table).expect("it was learned here");
    let mut differences = 0;
    for (number, x) in all.iter().enumerate() {
        let with_table = estimate(&learned, x, 8000, &mut pcg);
        let without = estimate(&lights.as_view(), x, 4000, &mut pcg);
        check_same(&format!("point {number}"), with_table, without);
        let u = pcg.cube();
        let [a, b] = [learned.at(x).sample(u), lights.at(x).sample(u)];
        differences += usize::from(a.map(|sample| sample.pdf) != b.map(|sample| sample.pdf));
    }
    assert!(differences > all.len() / 2, "the table is not used");
}

/// Split samples bring what single ones do, with a table and groups.
#[test]
fn split_samples_bring_the_same() {
    let (lights, mut pcg) = (scene(7), Pcg32::new(3, 170));
    let splitting = Splitting::new(0.7, 2);
    for (number, x) in points(&mut pcg).into_iter().enumerate() {
        let x = x.with_groups(3);
        let (view, at, mut samples) = (lights.as_view(), lights.at(&x), Vec::new());
        let (n, mut sum, mut squares) = (2000, 0.0, 0.0);
        for _ in 0..n {
            samples.clear();
            at.sample_split(pcg.cube(), &splitting, &mut samples);
            let value: f64 = samples.iter().map(|sample| brought(&view, &x, sample)).sum();
            sum += value;
            squares += value * value;
        }
        let (n, mean) = (f64::from(n), sum / f64::from(n));
        let split = [mean, ((squares / n - mean * mean).max(0.0) / n).sqrt()];
        check_same(&format!("point {number}"), split, estimate(&view, &x, 8000, &mut pcg));
    }
}

/// Along a ray through fog, a distance and a light bring what even distances do.
#[test]
fn segments_see_instances_and_distant_lights() {
    let (lights, mut pcg) = (scene(7), Pcg32::new(4, 170));
    let view = lights.as_view();
    for (number, direction) in [vec3(1.0, 0.2, 0.6), vec3(-0.3, 1.0, 0.3)].into_iter().enumerate() {
        let segment = RaySegment::new(vec3(-1.5, -1.0, 0.3), direction.normalize(), 4.0, 0.2).with_groups(3);
        let along = lights.along(&segment);
        let arriving = |distance: f32, pcg: &mut Pcg32| {
            let x = segment.point(distance);
            let at = along.at(distance);
            let value = at.sample(pcg.cube()).map_or(0.0, |sample| brought(&view, &x, &sample));
            value * f64::from(-0.2 * distance).exp()
        };
        let mut mean = |draw: &mut dyn FnMut(&mut Pcg32) -> f64, n: u32| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..n {
                let value = draw(&mut pcg);
                sum += value;
                squares += value * value;
            }
            let (n, mean) = (f64::from(n), sum / f64::from(n));
            [mean, ((squares / n - mean * mean).max(0.0) / n).sqrt()]
        };
        let chosen = mean(
            &mut |pcg| {
                let Some((distance, pdf)) = along.sample_distance(pcg.f32()) else { return 0.0 };
                assert!((along.pdf_distance(distance) / pdf - 1.0).abs() < 1e-4);
                arriving(distance, pcg) / f64::from(pdf)
            },
            8000,
        );
        let even = mean(&mut |pcg| 4.0 * arriving(4.0 * pcg.f32(), pcg), 40_000);
        check_same(&format!("ray {number}"), chosen, even);
    }
}
