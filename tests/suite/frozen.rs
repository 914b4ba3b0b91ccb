//! Bytes that an earlier build wrote load, and mean what they meant, also where its tuned constants had other values.
//!
//! `FROZEN=write cargo test --test suite frozen` writes the files from the scenes below. That is for new scenes alone:
//! a file that is committed stays as it is, whatever the crate becomes.

use std::path::{Path, PathBuf};

use fanlight::{
    Arity, DiskLight, DistantLight, Environment, Filter, Instance, LightSample, LightSampler, LightSamplerView, Mesh,
    MeshId, MeshUpdate, PointLight, Profile, ProfileLight, Projection, ShadingPoint, Sides, SphereLight, SpotLight,
    Texture, TubeLight, Visibility, VisibilityView, Weight, Wrap,
};
use glam::{Affine3A, Quat, Vec2, Vec3, vec3};

use crate::common::lights::aligned;
use crate::common::pcg::Pcg32;
use crate::common::scene::random_point;
use crate::common::statistics::Mean;
use crate::kinds::pdf_again;

/// Standard errors of a difference that are granted: two-sided, 1e-6 by the normal distribution.
const LIMIT: f64 = 4.9;
const SAMPLES: usize = 3000;
const POINTS: usize = 30;

const QUAD: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn quad(low: Vec3, x: Vec3, y: Vec3) -> [Vec3; 4] {
    [low, low + x, low + x + y, low + y]
}

/// A sky with a sun.
fn sky() -> Environment {
    let texels: Vec<f32> =
        (0..32 * 16).map(|i| if i == 4 * 32 + 11 { 300.0 } else { 0.3 + 0.01 * (i % 7) as f32 }).collect();
    Environment::from_lat_long(32, 16, &texels, Filter::Bilinear).expect("a good image")
}

/// A textured lamp, a textured window, lamps of every kind, light groups, instances, and what moves in the shutter.
fn everything() -> LightSampler {
    let image: Vec<f32> = (0..64).map(|i| [0.0, 0.2, 1.0][i * i % 3]).collect();
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mut builder = LightSampler::builder().environment(sky());
    let texture = Texture::new(8, 8, &image).expect("a good image").wrap(Wrap::Clamp, Wrap::Clamp);
    let texture = builder.add_texture(texture);
    let screen = quad(vec3(-1.0, 2.0, 0.0), 2.0 * Vec3::X, Vec3::Z);
    let window = quad(vec3(2.0, -1.0, 0.0), 2.0 * Vec3::Y, Vec3::Z);
    let panel = quad(vec3(-0.5, -0.5, 3.0), Vec3::Y, Vec3::X);
    let later = panel.map(|vertex| vertex + vec3(0.3, 0.0, -0.4));
    let meshes = [
        Mesh::emitter(&screen, &QUAD).uvs(&uvs).weight(Weight::Texture(texture)).sides(Sides::Two),
        Mesh::portal(&window, &QUAD).uvs(&uvs).weight(Weight::Texture(texture)),
        Mesh::emitter(&panel, &QUAD).weight(Weight::Constant(3.0)).moving_to(&later).groups(5),
    ];
    for mesh in &meshes {
        builder.add_mesh(mesh).expect("a good mesh");
    }
    let small = quad(Vec3::splat(-0.1), 0.2 * Vec3::Y, 0.2 * Vec3::X);
    let lamp = builder.add_object(&[Mesh::emitter(&small, &QUAD).sides(Sides::Two)]).expect("a good object");
    for i in 0..5 {
        let place = vec3(i as f32 - 2.0, 0.5, 2.0);
        let scale = vec3(1.0, 1.0 + 0.5 * i as f32, if i == 3 { -2.0 } else { 1.0 });
        let transform = |angle| Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_x(angle), place);
        let instance = Instance::new(lamp, transform(0.2 * i as f32)).scaled(4.0);
        let instance = if i == 4 { instance.moving_to(transform(1.5)) } else { instance };
        builder.add_instance(instance).expect("a good instance");
    }
    let profile = Profile { vertical: &[0.0, 0.8, 1.5], horizontal: &[0.0], intensities: &[1.0, 0.5, 0.0] };
    let profile = builder.add_profile(&profile).expect("a good profile");
    let slide =
        Projection { angles: [0.8, 0.6], size: [2, 2], intensities: &[1.0, 0.0, 0.3, 2.0], filter: Filter::Bilinear };
    let slide = builder.add_projection(&slide).expect("a good projection");
    builder.add_light(SphereLight::new(vec3(-1.5, -1.5, 1.0), 0.2, 5.0)).expect("a good light");
    builder.add_light(DiskLight::new(vec3(1.5, -1.5, 1.5), -Vec3::Z, 0.3, 2.0)).expect("a good light");
    builder.add_light(TubeLight::new([vec3(-1.0, -2.0, 2.0), vec3(1.0, -2.0, 2.0)], 0.05, 3.0)).expect("a good light");
    builder.add_light_to(3, PointLight::new(vec3(0.0, 0.0, 2.5), 2.0)).expect("a good light");
    builder.add_light(SpotLight::new(vec3(1.0, 1.0, 2.5), -Vec3::Z, 3.0, [0.3, 0.8])).expect("a good light");
    builder.add_light(ProfileLight::new(vec3(-1.0, 1.0, 2.5), -Vec3::Z, profile, 2.0)).expect("a good light");
    builder.add_light(ProfileLight::new(vec3(-2.0, 0.0, 1.5), Vec3::X, slide, 2.0)).expect("a good light");
    builder.add_light_to(6, DistantLight::new(-Vec3::Z, 0.5).angular_radius(0.1)).expect("a good light");
    builder.add_light(DistantLight::new(vec3(1.0, 0.0, -2.0), 0.2)).expect("a good light");
    builder.build().expect("a good scene")
}

/// Few lights under an open sky, in a tree of another arity.
fn open_sky() -> LightSampler {
    let lamp = quad(vec3(-0.5, -0.5, 2.0), Vec3::Y, Vec3::X);
    let mut builder = LightSampler::builder().arity(Arity::Four).environment(sky()).environment_as_light();
    builder.add_mesh(&Mesh::emitter(&lamp, &QUAD).weight(Weight::Constant(2.0))).expect("a good mesh");
    builder.build().expect("a good scene")
}

/// What a wall hides.
fn learned(lights: &LightSampler) -> Visibility {
    let point = |i: u64| random_point(&mut Pcg32::new(i, 91), i as usize);
    let seen =
        |x: &ShadingPoint, sample: &LightSample| f32::from(u8::from((x.position.x > 0.5) == (sample.position.x > 0.5)));
    Visibility::learn(&lights.as_view(), 3000, point, seen).expect("nobody cancels")
}

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/frozen").join(name)
}

/// Returns the bytes of a file, after writing them if that is requested.
fn frozen(name: &str, bytes: impl Fn() -> Vec<u8>) -> Vec<u32> {
    if std::env::var("FROZEN").is_ok_and(|value| value == "write") {
        std::fs::write(path(name), bytes()).expect("the file can be written");
    }
    aligned(&std::fs::read(path(name)).expect("the file can be read"))
}

/// Mean of what samples bring, walls left out.
fn estimate(lights: &LightSamplerView<'_>, x: &ShadingPoint, pcg: &mut Pcg32) -> Mean {
    let at = lights.at(x);
    let mut mean = Mean::default();
    for _ in 0..SAMPLES {
        let brought = at.sample(pcg.cube()).map_or(0.0, |sample| {
            let again = pdf_again(&at, &sample);
            assert!((again - sample.pdf).abs() <= 1e-4 * sample.pdf, "{sample:?}: {again}");
            f64::from(x.weight(sample.direction)) / f64::from(sample.pdf)
        });
        mean.add(brought);
    }
    mean
}

/// The file and a new build hold the same lights, and estimates from both agree.
fn check(loaded: &LightSamplerView<'_>, fresh: &LightSamplerView<'_>, seed: u64) {
    assert_eq!(loaded.light_count(), fresh.light_count());
    let mut pcg = Pcg32::new(seed, 92);
    for kind in 0..POINTS {
        let x = random_point(&mut pcg, kind).at_time(pcg.f32()).with_groups([u32::MAX, 1, 4][kind % 3]);
        let [a, b] = [loaded, fresh].map(|lights| estimate(lights, &x, &mut pcg));
        let limit = LIMIT * (a.error().powi(2) + b.error().powi(2)).sqrt() + 1e-6;
        assert!((a.mean() - b.mean()).abs() <= limit, "{x:?}: {} and {}, limit {limit}", a.mean(), b.mean());
    }
}

#[test]
fn bytes_of_every_kind_of_light_load() {
    let fresh = everything();
    let words = frozen("lights.bin", || fresh.to_bytes());
    let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("bytes of an earlier build load");
    check(&loaded, &fresh.as_view(), 1);
    let table = frozen("visibility.bin", || learned(&fresh).to_bytes());
    let table = VisibilityView::from_bytes(bytemuck::cast_slice(&table)).expect("bytes of an earlier build load");
    let seen = loaded.with_visibility(table).expect("it was learned for these lights");
    check(&seen, &fresh.as_view(), 2);
}

#[test]
fn bytes_of_an_open_sky_load() {
    let fresh = open_sky();
    let words = frozen("open-sky.bin", || fresh.to_bytes());
    let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("bytes of an earlier build load");
    check(&loaded, &fresh.as_view(), 3);
}

/// A textured screen, small triangles, forty distant lights, some with an extent, and a sky as a light: what tuned
/// constants decide about when it is built. The triangles are at the places that `place` gives them.
fn tuned(arity: Arity, place: impl Fn(u32) -> Vec3) -> LightSampler {
    let image: Vec<f32> = (0..64 * 64).map(|i| 0.1 + (i * i % 97) as f32 / 97.0).collect();
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mut builder = LightSampler::builder().arity(arity).environment(sky()).environment_as_light();
    let texture = builder.add_texture(Texture::new(64, 64, &image).expect("a good image"));
    let (positions, indices) = soup(place);
    builder.add_mesh(&Mesh::emitter(&positions, &indices).sides(Sides::Two)).expect("a good mesh");
    let screen = quad(vec3(-1.0, 2.0, 0.0), 2.0 * Vec3::X, Vec3::Z);
    let screen = Mesh::emitter(&screen, &QUAD).uvs(&uvs).weight(Weight::Texture(texture)).sides(Sides::Two);
    builder.add_mesh(&screen).expect("a good mesh");
    let mut pcg = Pcg32::new(4, 94);
    for i in 0..40_u8 {
        let light = DistantLight::new(pcg.direction(), 0.1 + 0.1 * f32::from(i % 5));
        let radius = if i % 4 == 0 { 0.05 } else { 0.0 };
        builder.add_light_to(1 << (i % 3), light.angular_radius(radius)).expect("a good light");
    }
    builder.build().expect("a good scene")
}

/// Sixty small triangles.
fn soup(place: impl Fn(u32) -> Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corners = |i| [Vec3::ZERO, 0.1 * Vec3::X, 0.1 * Vec3::new(0.0, 1.0, 0.3)].map(|corner| place(i) + corner);
    ((0..60).flat_map(corners).collect(), (0..60).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Places in order, from the one corner of a box to the other.
fn in_order(i: u32) -> Vec3 {
    vec3((i % 4) as f32, (i / 4 % 5) as f32, 4.0 + (i / 20) as f32) / 2.0
}

/// Other places, so that neighbors in a tree over these are none in a tree over those.
fn in_disorder(i: u32) -> Vec3 {
    in_order(i * 37 % 60)
}

/// Returns bytes with the words of one section changed.
fn with_section(words: &[u32], tag: [u8; 4], change: impl FnOnce(&mut Vec<u32>)) -> Vec<u32> {
    // A header of six words, then four for each section: tag, version, length in bytes.
    let entry = |i: usize| 6 + 4 * i;
    let sections = words[4] as usize;
    let own = (0..sections).position(|i| words[entry(i)] == u32::from_ne_bytes(tag)).expect("there is the section");
    let length = |i: usize| words[entry(i) + 2] as usize / 4;
    let start = entry(sections) + (0..own).map(length).sum::<usize>();
    let (head, rest) = words.split_at(start);
    let (section, tail) = rest.split_at(length(own));
    let (mut head, mut section) = (head.to_vec(), section.to_vec());
    change(&mut section);
    head[entry(own) + 2] = 4 * section.len() as u32;
    [&head, &section[..], tail].concat()
}

/// Replaces the groups of distant lights by those that `regroup` makes of the lights, 7 words each, and of the groups, 8
/// words each.
fn regrouped(words: &[u32], regroup: impl Fn(&[[u32; 7]], &[[u32; 8]]) -> Vec<[u32; 8]>) -> Vec<u32> {
    with_section(words, *b"XTRA", |section| {
        let [groups, lights, light_groups] = [0, 1, 2].map(|i| section[i] as usize);
        let first = 6 + groups;
        let middle = first + 7 * lights;
        let end = middle + 8 * light_groups;
        let found = regroup(bytemuck::cast_slice(&section[first..middle]), bytemuck::cast_slice(&section[middle..end]));
        section[2] = found.len() as u32;
        section.splice(middle..end, found.into_iter().flatten());
    })
}

/// One group in place of two.
fn joined(_: &[[u32; 7]], groups: &[[u32; 8]]) -> Vec<[u32; 8]> {
    let join = |pair: &[[u32; 8]]| {
        let [a, b] = [pair[0], *pair.last().expect("not empty")];
        if pair.len() == 1 {
            return a;
        }
        let axis = |group: [u32; 8]| Vec3::from_array([group[0], group[1], group[2]].map(f32::from_bits));
        let [x, y, z] = (axis(a) + axis(b)).normalize_or(Vec3::Z).to_array().map(f32::to_bits);
        let irradiance = f32::from_bits(a[4]) + f32::from_bits(b[4]);
        // A sine of 2 stands for more than a right angle.
        [x, y, z, 2.0_f32.to_bits(), irradiance.to_bits(), a[5], a[6] + b[6], a[7] | b[7]]
    };
    groups.chunks(2).map(join).collect()
}

/// Each light of the first ten groups as a group of its own.
fn parted(lights: &[[u32; 7]], groups: &[[u32; 8]]) -> Vec<[u32; 8]> {
    let alone = |i: u32| {
        let [x, y, z, irradiance, radius, _, of] = lights[i as usize];
        let [x, y, z] = [x, y, z].map(|component| (-f32::from_bits(component)).to_bits());
        let sine = f32::from_bits(radius).sin() + 1e-6;
        [x, y, z, sine.to_bits(), irradiance, i, 1, of]
    };
    let (first, rest) = groups.split_at(10);
    first.iter().flat_map(|group| group[5]..group[5] + group[6]).map(alone).chain(rest.iter().copied()).collect()
}

/// Every third tree over a part of a texture ends where it is, as if there had been less memory.
fn pruned(words: &[u32]) -> Vec<u32> {
    with_section(words, *b"CELL", |section| {
        let nodes = section.len() / 19;
        assert!(nodes > 30, "only {nodes} nodes");
        section.chunks_exact_mut(19).skip(1).step_by(3).for_each(|node| node[..2].fill(0));
    })
}

/// Regions keep more of their light as a weight at the horizon, and are taken for wider ones.
fn widened(words: &[u32]) -> Vec<u32> {
    with_section(words, *b"EREG", |section| {
        let change = |section: &mut [u32], change: fn(f32) -> f32| {
            section.iter_mut().for_each(|word| *word = change(f32::from_bits(*word)).to_bits());
        };
        change(&mut section[256..320], |spread| spread.max(0.03));
        change(&mut section[320..384], |reach| (1.02 * reach).min(1.0));
        change(&mut section[384..448], |least| 4.0 * least);
    })
}

/// Nothing that is tuned is computed again when bytes are loaded. The bright features of an environment have a unit
/// test of their own, and any table of what walls hide is tested in [`crate::visibility`].
#[test]
fn bytes_of_other_constants_load() {
    let fresh = tuned(Arity::Sixteen, in_order);
    let words = aligned(&fresh.to_bytes());
    let changed = [
        ("wider regions", widened(&words)),
        ("joined groups", regrouped(&words, joined)),
        ("parted groups", regrouped(&words, parted)),
        ("shallow trees over textures", pruned(&words)),
    ];
    for (seed, (name, changed)) in (4..).zip(&changed) {
        assert!(changed != &words, "{name}");
        let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(changed));
        check(&loaded.unwrap_or_else(|error| panic!("{name}: {error}")), &fresh.as_view(), seed);
    }
    // Lights in the order of another tree, as other weights of its build would have arranged them.
    let (positions, indices) = soup(in_order);
    for (seed, arity) in (20..).zip([Arity::Four, Arity::Eight, Arity::Sixteen]) {
        let mut other = tuned(arity, in_disorder);
        other.refit(&[MeshUpdate::new(MeshId::from_index(0)).moved(&positions, &indices)]).expect("a good update");
        let words = aligned(&other.to_bytes());
        let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        check(&loaded, &fresh.as_view(), seed);
    }
}
