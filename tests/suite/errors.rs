//! Bad input is a clear error, and nothing that was accepted makes sampling panic.

use core::panic::AssertUnwindSafe;
use std::panic::catch_unwind;

use crate::common::lights::{ARITIES, aligned, build};
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, Scene};
use fanlight::{
    Arity, Environment, EnvironmentImage, Error, Filter, Hit, LightSample, LightSampler, LightSamplerBuilder,
    LightSamplerView, Mesh, MeshId, Receiver, ShadingPoint, Splitting, Texture, TextureId, TriangleId, Weight,
};
use glam::{Mat3, Vec2, Vec3};
use smallvec::SmallVec;

/// Fails unless the result is an error whose message holds all parts.
fn assert_error<T>(what: &str, result: Result<T, Error>, parts: &[&str]) {
    let Err(error) = result else { panic!("{what}: no error") };
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "{what}: \"{message}\" does not say \"{part}\"");
    }
    // It is an error like others.
    let _: &dyn core::error::Error = &error;
}

#[test]
fn textures() {
    let with = |bad: f32| [0.0, 1.0, 2.0, bad, 4.0, 5.0];
    assert_error("no width", Texture::new(0, 3, &[]), &["texture", "0 x 3", "32768"]);
    assert_error("no height", Texture::new(3, 0, &[]), &["texture", "3 x 0", "32768"]);
    assert_error("too wide", Texture::new(32_769, 1, &[0.0; 32_769]), &["texture", "32769 x 1", "32768"]);
    assert_error("overflow", Texture::new(usize::MAX, usize::MAX, &[]), &["texture", "32768"]);
    assert_error("too few", Texture::new(2, 3, &[0.0; 5]), &["texture", "5", "2 x 3"]);
    assert_error("too many", Texture::new(2, 3, &[0.0; 7]), &["texture", "7", "2 x 3"]);
    for (bad, value) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf"), (-0.5, "-0.5")] {
        assert_error(value, Texture::new(2, 3, &with(bad)), &["texture", "(1, 1)", value, "finite and not negative"]);
    }
    let _ = Texture::new(2, 3, &with(3.0)).expect("these texels are valid");
}

#[test]
fn environments() {
    for (bad, value) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-1.0, "-1"), (2e30, "2000000000000")] {
        assert_error(value, Environment::constant(bad), &["environment", "radiance", value, "1e30"]);
    }
    let with = |bad: f32| [0.0, 1.0, 2.0, bad, 4.0, 5.0, 6.0, 7.0, 8.0];
    type Build = fn(usize, usize, &[f32]) -> Result<Environment, Error>;
    let builds: [Build; 4] = [
        |w, h, texels| Environment::from_lat_long(w, h, texels, Filter::Nearest),
        |w, h, texels| {
            Environment::new(&EnvironmentImage::lat_long(w, h, texels).filter(Filter::Bilinear).resolution(4))
        },
        |w, _, texels| Environment::from_equal_area(w, texels, Filter::Bilinear),
        |w, _, texels| Environment::new(&EnvironmentImage::equal_area(w, texels).filter(Filter::Nearest).resolution(4)),
    ];
    for build in builds {
        assert_error("no texels", build(0, 0, &[]), &["environment", "0 x 0", "65536"]);
        assert_error("too large", build(65_537, 65_537, &[]), &["environment", "65537", "65536"]);
        assert_error("overflow", build(usize::MAX, usize::MAX, &[]), &["environment", "65536"]);
        assert_error("too few", build(3, 3, &[0.0; 8]), &["environment", "8", "3 x 3"]);
        for (bad, value) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
            assert_error(value, build(3, 3, &with(bad)), &["environment", "(0, 1)", value, "finite"]);
        }
        assert_error("too bright", build(3, 3, &with(2e30)), &["environment", "(0, 1)", "2e30", "1e30"]);
        let environment = build(3, 3, &with(-0.25)).expect("a negative texel is clamped");
        assert_eq!(environment.clamped_texels(), 1);
    }
    for size in [0, 8193] {
        let number = size.to_string();
        let texels = [1.0; 4];
        for image in [EnvironmentImage::lat_long(2, 2, &texels), EnvironmentImage::equal_area(2, &texels)] {
            let result = Environment::new(&image.filter(Filter::Nearest).resolution(size));
            assert_error("resolution", result, &["environment", &number, "8192"]);
        }
    }
}

#[test]
fn rotations() {
    let turned = Mat3::from_rotation_z(1.0);
    let mut environment = Environment::constant(1.0).expect("white is valid").with_rotation(turned).expect("it is one");
    let mirror = Mat3::from_diagonal(Vec3::new(1.0, 1.0, -1.0));
    let sheared = Mat3::from_cols(Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::Z);
    let bad = [(2.0 * Mat3::IDENTITY, "8"), (mirror, "-1"), (sheared, "1"), (Mat3::NAN, "NaN"), (Mat3::ZERO, "0")];
    for (matrix, determinant) in bad {
        let parts = ["environment", "rotation", determinant, "must be 1"];
        assert_error("set_rotation", environment.set_rotation(matrix), &parts);
        assert_error("with_rotation", environment.clone().with_rotation(matrix), &parts);
        assert_eq!(environment.rotation(), turned);
    }
    let mut lights = LightSampler::builder().build().expect("no lights are fine");
    assert_error("sampler", lights.set_environment_rotation(Mat3::ZERO), &["rotation"]);
}

const POSITIONS: [Vec3; 4] = [Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y];
const INDICES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const UVS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// Calls `attempt` with a builder that holds a mesh and a texture; its error must hold all parts, and the builder
/// must go on as if it had not been called.
fn assert_mesh_error(what: &str, mesh: &Mesh<'_>, parts: &[&str]) {
    let texels = [0.0, 1.0, 2.0, 3.0];
    let texture = Texture::new(2, 2, &texels).expect("it is valid");
    let good = |texture| Mesh::portal(&POSITIONS, &INDICES).uvs(&UVS).weight(Weight::Texture(texture));
    let mut builder = LightSampler::builder();
    let id = builder.add_texture(texture);
    assert_eq!(builder.add_mesh(&good(id)), Ok(MeshId::from_index(0)));
    assert_error(what, builder.add_mesh(mesh), parts);
    assert_eq!(builder.add_mesh(&good(id)), Ok(MeshId::from_index(1)));
    let mut reference = LightSampler::builder();
    let id = reference.add_texture(texture);
    assert_eq!(
        (reference.add_mesh(&good(id)), reference.add_mesh(&good(id))),
        (Ok(MeshId::from_index(0)), Ok(MeshId::from_index(1)))
    );
    let bytes = |builder: LightSamplerBuilder<'_>| builder.build().map(|lights| lights.to_bytes());
    assert_eq!(bytes(builder), bytes(reference), "{what}: the builder is not as before");
}

/// A texture of a builder that has more of them than [`assert_mesh_error`]'s.
fn texture_of_another_builder() -> TextureId {
    let mut builder = LightSampler::builder();
    let texture = Texture::new(1, 1, &[1.0]).expect("it is valid");
    (0..6).for_each(|_| _ = builder.add_texture(texture));
    builder.add_texture(texture)
}

fn first_texture() -> TextureId {
    LightSampler::builder().add_texture(Texture::new(1, 1, &[1.0]).expect("it is valid"))
}

#[test]
fn meshes() {
    let limits = [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf"), (1.5e9, "1500000000")];
    for (bad, value) in limits {
        for axis in 0..3 {
            let mut positions = POSITIONS;
            positions[3][axis] = bad;
            let mesh = Mesh::emitter(&positions, &INDICES);
            assert_mesh_error(value, &mesh, &["mesh 1", "vertex 3", value, "finite", "1e9"]);
        }
    }
    let indices = [[0, 1, 2], [0, 4, 3]];
    assert_mesh_error("index", &Mesh::portal(&POSITIONS, &indices), &["mesh 1", "triangle 1", "vertex 4", "are 4"]);
    let mesh = Mesh::portal(&[], &indices);
    assert_mesh_error("no vertices", &mesh, &["mesh 1", "triangle 0", "vertex 0", "are 0"]);
    for (bad, value) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-0.5, "-0.5"), (2e30, "2000000000000")] {
        let mesh = Mesh::emitter(&POSITIONS, &INDICES).weight(Weight::Constant(bad));
        assert_mesh_error(value, &mesh, &["mesh 1", "weight", value, "from 0 to 1e30"]);
    }
    let textured = Mesh::emitter(&POSITIONS, &INDICES).weight(Weight::Texture(first_texture()));
    assert_mesh_error("no uvs", &textured, &["mesh 1", "0 uvs", "4 vertices"]);
    assert_mesh_error("few uvs", &textured.uvs(&UVS[..3]), &["mesh 1", "3 uvs", "4 vertices"]);
    for (bad, value) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (2e5, "200000")] {
        for axis in 0..2 {
            let mut uvs = UVS;
            uvs[2][axis] = bad;
            assert_mesh_error(value, &textured.uvs(&uvs), &["mesh 1", "vertex 2", "uv", value, "1e5"]);
        }
    }
    let unknown = textured.uvs(&UVS).weight(Weight::Texture(texture_of_another_builder()));
    assert_mesh_error("unknown texture", &unknown, &["mesh 1", "texture 6", "has 1"]);
}

type View<'a> = LightSamplerView<'a>;

/// A sampler with every buffer in use.
fn full() -> (Scene, LightSampler) {
    let mut pcg = Pcg32::new(77, 24);
    let mut scene = Scene::random(&mut pcg, Content { triangles: 12, textured: true, sky: 1, two_sided: false });
    for image in &mut scene.images {
        (image.size, image.texels) = ([2, 2], vec![0.0, 1.0, 2.0, 3.0]);
    }
    scene.meshes.iter_mut().for_each(|mesh| mesh.uvs.iter_mut().for_each(|uv| *uv *= 0.5));
    scene.sky =
        crate::common::scene::Sky::LatLong { size: [4, 2], texels: vec![1.0, 2.0, 0.0, 4.0, 5.0, 6.0, 7.0, 8.0] };
    let lights = scene.build(Arity::Sixteen);
    (scene, lights)
}

/// Everything that a host can ask, where results must at least be numbers. Returns the number of samples.
fn exercise(view: &View<'_>, x: &ShadingPoint, u: [f32; 3]) -> usize {
    let finite = |pdf: f32| assert!(pdf.is_finite() && pdf >= 0.0, "a density of {pdf} at {x:?} with {u:?}");
    let splitting = Splitting::new(0.8, 2);
    let check = |sample: &LightSample| {
        [sample.pdf, sample.pdf_area, sample.pmf].into_iter().for_each(finite);
        assert!(sample.pdf > 0.0 && sample.pdf_area > 0.0 && sample.pmf > 0.0, "{sample:?}");
        finite(view.at(x).pdf(&sample.hit().expect("a triangle")));
        finite(view.at(x).pdf_split(&sample.hit().expect("a triangle"), &splitting));
        finite(view.at(x).pdf_sample_direction(sample));
        assert!(!sample.position.is_nan() && sample.direction.is_finite() && sample.distance.is_finite());
    };
    let single = view.at(x).sample(u);
    single.iter().for_each(check);
    let mut samples = SmallVec::<[LightSample; 8]>::new();
    view.at(x).sample_split(u, &splitting, &mut samples);
    samples.iter().for_each(check);
    let direction = Vec3::from(u) - 0.5;
    finite(view.at(x).pdf_direction(direction));
    finite(view.at(x).pdf_split_direction(direction, &splitting));
    for triangle in [0, 1, 2, 3, u32::MAX] {
        for mesh in [0, 3, 4, u32::MAX] {
            let triangle = TriangleId::new(MeshId::from_index(mesh), triangle);
            finite(view.at(x).pdf(&Hit::new(triangle, [u[0], u[1]])));
            finite(view.at(x).pmf(triangle));
        }
    }
    single.iter().len() + samples.len()
}

#[test]
fn bytes_that_are_cut_off_or_moved() {
    let (_, lights) = full();
    let bytes = lights.to_bytes();
    let mut words = aligned(&bytes);
    let good: &[u8] = bytemuck::cast_slice(&words);
    View::from_bytes(good).expect("its own bytes load");
    for length in 0..good.len() {
        assert_error("cut off", View::from_bytes(&good[..length]), &["bytes", "expected"]);
    }
    let mut moved = vec![0; good.len() + 8];
    let start = moved.as_ptr().align_offset(4) + 1;
    moved[start..start + good.len()].copy_from_slice(good);
    assert_error("moved", View::from_bytes(&moved[start..start + good.len()]), &["alignment", "0x1"]);
    words.push(0);
    assert_error("too long", View::from_bytes(bytemuck::cast_slice(&words)), &["number of bytes"]);
}

/// Where the first section begins, which holds the arities of the trees over lights and over textures.
fn parameters(words: &[u32]) -> usize {
    const HEADER: usize = 6;
    const ENTRY: usize = 4;
    HEADER + ENTRY * words[4] as usize
}

/// Bytes hold the arities that they were built with: the one of the tree over lights comes back, and bytes that say
/// another are refused. That of the trees over textures is the same in all bytes, whatever it is.
#[test]
fn bytes_of_other_arities() {
    let (scene, _) = full();
    let mut pcg = Pcg32::new(8, 28);
    let mut texture_arities = Vec::new();
    for (arity, number) in [(Arity::Four, 4), (Arity::Eight, 8), (Arity::Sixteen, 16)] {
        let lights = build(&scene, arity);
        let words = aligned(&lights.to_bytes());
        let parameters = parameters(&words);
        assert_eq!(words[parameters], number);
        let texture_arity = words[parameters + 1];
        assert!(texture_arity >= 4 && texture_arity.isqrt().pow(2) == texture_arity, "{texture_arity}");
        texture_arities.push(texture_arity);
        let view = View::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        for i in 0..100 {
            let (x, u) = (crate::common::scene::random_point(&mut pcg, i), pcg.cube());
            assert_eq!(view.at(&x).sample(u), lights.at(&x).sample(u));
        }
        let load = |at: usize, value: u32| {
            let mut words = words.clone();
            words[parameters + at] = value;
            View::from_bytes(bytemuck::cast_slice(&words)).map(drop)
        };
        for other in [4, 8, 16].into_iter().filter(|other| *other != number) {
            assert_error("another arity", load(0, other), &["bytes", "expected"]);
        }
        for unknown in [0, 1, 5, 32, u32::MAX] {
            assert_error("no arity", load(0, unknown), &["lights", &format!("arity {unknown},"), "4, 8, 16"]);
        }
        for other in [0, 1, texture_arity / 4, texture_arity + 1, 4 * texture_arity, u32::MAX] {
            let (found, expected) = (format!("arity {other},"), format!("reads {texture_arity}"));
            assert_error("another arity of textures", load(1, other), &["texture", &found, &expected]);
        }
    }
    assert!(texture_arities.iter().all(|arity| *arity == texture_arities[0]), "{texture_arities:?}");
}

/// Whatever one flipped bit does, the bytes are refused, or sampling works on what they say.
#[test]
fn bytes_with_a_flipped_bit() {
    let (_, lights) = full();
    let mut words = aligned(&lights.to_bytes());
    let mut pcg = Pcg32::new(5, 25);
    let points: [ShadingPoint; 6] = core::array::from_fn(|i| crate::common::scene::random_point(&mut pcg, i));
    let (mut refused, mut accepted, mut drawn) = (0, 0, 0);
    let mut failed = Vec::new();
    for word in 0..words.len() {
        for bit in 0..32 {
            words[word] ^= 1 << bit;
            match View::from_bytes(bytemuck::cast_slice(&words)) {
                Err(error) => {
                    refused += 1;
                    assert!(!error.to_string().is_empty());
                }
                Ok(view) => {
                    accepted += 1;
                    let ask = || points.iter().map(|x| exercise(&view, x, pcg.cube())).sum::<usize>();
                    match catch_unwind(AssertUnwindSafe(ask)) {
                        Ok(samples) => drawn += samples,
                        Err(_) => failed.push((word, bit)),
                    }
                }
            }
            words[word] ^= 1 << bit;
        }
    }
    println!("{} words, {refused} flips refused, {accepted} accepted, {} of them bad", words.len(), failed.len());
    assert!(failed.is_empty(), "(word, bit) {failed:?}");
    assert!(refused > 1000 && accepted > 1000 && drawn > accepted, "{refused} {accepted} {drawn}");
}

#[test]
fn hostile_shading_points_and_numbers() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, 1e-45, 0.5, 1.0, 1e30, f32::MAX];
    let mut pcg = Pcg32::new(6, 26);
    let (mut count, mut drawn) = (0, 0);
    for kind in 0..4 {
        let mut scene =
            Scene::random(&mut pcg, Content { triangles: 20, textured: true, sky: kind, two_sided: kind > 1 });
        // A sliver, a point-sized triangle and a duplicate.
        let mesh = &mut scene.meshes[0];
        mesh.positions[2] = 0.5 * (mesh.positions[0] + mesh.positions[1]) + Vec3::splat(1e-7);
        mesh.indices[1] = [3, 3, 3];
        mesh.indices[3] = mesh.indices[2];
        let lights = scene.build(Arity::Sixteen);
        let view = lights.as_view();
        let mut positions = Vec::new();
        for (m, t) in scene.triangles() {
            let [a, b, c] = scene.meshes[m].vertices(t);
            positions.extend([a, b, 0.5 * (b + c), (a + b + c) / 3.0, a + 3.0 * (b - a), 0.9 * a + 0.1 * c]);
        }
        for value in bad {
            positions.extend([Vec3::splat(value), Vec3::new(value, 0.5, 0.5), Vec3::new(0.5, value, -value)]);
        }
        for position in positions {
            let normals = [pcg.direction(), Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e30)];
            let receivers = normals.into_iter().flat_map(|n| [Receiver::Surface(n), Receiver::Transmissive(n)]);
            for receiver in receivers.chain([Receiver::Volume]) {
                let x = ShadingPoint::new(position, receiver);
                let u =
                    if pcg.below(2) == 0 { pcg.cube() } else { core::array::from_fn(|_| bad[pcg.below(bad.len())]) };
                let result = catch_unwind(AssertUnwindSafe(|| exercise(&view, &x, u)));
                let Ok(samples) = result else { panic!("{x:?} with {u:?} in {}", scene.name) };
                drawn += samples;
                count += 1;
            }
        }
    }
    println!("{count} hostile shading points, {drawn} samples");
    assert!(drawn > count / 10, "{count} points, {drawn} samples");
}

#[test]
fn nothing_arrives_from_no_lights() {
    let lights = LightSampler::builder().build().expect("no lights are fine");
    let x = ShadingPoint::volume(Vec3::ZERO);
    assert_eq!(lights.at(&x).sample([0.5; 3]), None);
    assert_eq!(lights.at(&x).pdf_direction(Vec3::Z), 0.0);
    assert_eq!(exercise(&lights.as_view(), &x, [0.1, 0.2, 0.3]), 0);
    // Black lights are none either, for every arity.
    let mut scene =
        Scene::random(&mut Pcg32::new(1, 27), Content { triangles: 9, textured: true, sky: 0, two_sided: true });
    scene.images.iter_mut().for_each(|image| image.texels.fill(0.0));
    for arity in ARITIES {
        assert_eq!(build(&scene, arity).at(&x).sample([0.5; 3]), None);
    }
}
