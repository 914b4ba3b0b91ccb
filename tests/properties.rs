//! Properties that hold for any scene that a builder accepts.

use approx::assert_relative_eq;
use fanlight::{Environment, Filter, LightSampler, LightSamplerView, Mesh, ShadingPoint, Sides, Texture, Weight};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

/// Numbers that are often equal, tiny, huge or zero.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -1.0f32..1.0,
        1 => prop::sample::select(vec![0.0, 1.0, -1.0, 0.5, 1e-7, -1e-7, 1e-3, 100.0]),
    ]
}

fn point() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from)
}

fn direction() -> impl Strategy<Value = Vec3> {
    point().prop_map(|p| p.normalize_or(Vec3::Z))
}

fn shading_point() -> impl Strategy<Value = ShadingPoint> {
    (point(), direction(), 0..3).prop_map(|(position, normal, kind)| match kind {
        0 => ShadingPoint::surface(position, normal),
        1 => ShadingPoint::transmissive(position, normal),
        _ => ShadingPoint::volume(position),
    })
}

/// Corners and uvs of triangles, and whether each is a portal and textured.
type Soup = Vec<([Vec3; 3], [[f32; 2]; 3], bool, bool)>;

fn soup() -> impl Strategy<Value = Soup> {
    let uv = [-3.0f32..3.0, -3.0f32..3.0];
    let uvs = [uv.clone(), uv.clone(), uv];
    prop::collection::vec(([point(), point(), point()], uvs, any::<bool>(), any::<bool>()), 1..20)
}

fn texels() -> impl Strategy<Value = Vec<f32>> {
    prop::collection::vec(prop_oneof![2 => Just(0.0f32), 2 => 0.0f32..2.0, 1 => Just(1e6f32)], 16)
}

/// The lights of a soup in a sky of eight by four texels, with all coordinates multiplied.
fn build(soup: &Soup, texels: &[f32], sky: &[f32], scale: f32) -> LightSampler {
    let mut builder = LightSampler::builder();
    let image: Vec<f32> = sky.iter().chain(sky).copied().collect();
    builder.environment(Environment::from_lat_long(8, 4, &image, Filter::Bilinear).expect("the sky is finite"));
    let texture = builder.add_texture(Texture::new(4, 4, texels).expect("the texels are finite"));
    for (number, (corners, uvs, portal, textured)) in soup.iter().enumerate() {
        let (corners, uvs) = (corners.map(|p| p * scale), uvs.map(Vec2::from));
        let faces = [[0, 1, 2]];
        let mesh = if *portal { Mesh::portal(&corners, &faces) } else { Mesh::emitter(&corners, &faces) };
        let mesh = if *textured { mesh.uvs(&uvs).weight(Weight::Texture(texture)) } else { mesh };
        let mesh = mesh.sides(if number % 3 == 0 { Sides::Two } else { Sides::One });
        builder.add_mesh(&mesh).expect("the mesh is finite");
    }
    builder.build().expect("there are few triangles")
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::with_cases(400) })]

    #[test]
    fn a_sample_has_the_density_that_pdf_finds(
        soup in soup(), texels in texels(), sky in texels(), x in shading_point(),
        us in prop::collection::vec([0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0], 30),
    ) {
        let lights = build(&soup, &texels, &sky, 1.0);
        for u in us {
            if let Some(sample) = lights.sample(&x, u) {
                assert_relative_eq!(lights.pdf(&x, &sample.hit), sample.pdf, max_relative = 1e-5);
                prop_assert!(sample.pdf.is_normal() && sample.pdf_area > 0.0 && sample.distance > 0.0);
                prop_assert!(lights.pdf_sample_direction(&x, &sample) >= sample.pdf);
                assert_relative_eq!(sample.direction.length(), 1.0, max_relative = 1e-5);
            }
        }
    }

    #[test]
    fn bytes_hold_the_same_lights(
        soup in soup(), texels in texels(), sky in texels(), x in shading_point(), u in [0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0],
    ) {
        let lights = build(&soup, &texels, &sky, 1.0);
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&lights.to_bytes());
        let view: LightSamplerView<'_> = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("the bytes are whole");
        prop_assert_eq!(view.sample(&x, u), lights.sample(&x, u));
    }

    /// A power of two changes no digit of any length.
    #[test]
    fn a_larger_scene_has_the_same_densities(
        soup in soup(), texels in texels(), sky in texels(), x in shading_point(), u in [0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0],
        exponent in -12i32..12,
    ) {
        let scale = 2f32.powi(exponent);
        let (lights, larger) = (build(&soup, &texels, &sky, 1.0), build(&soup, &texels, &sky, scale));
        let far = ShadingPoint { position: x.position * scale, ..x };
        if let (Some(a), Some(b)) = (lights.sample(&x, u), larger.sample(&far, u)) {
            assert_relative_eq!(lights.pdf(&x, &a.hit), larger.pdf(&far, &a.hit), max_relative = 1e-4);
            assert_relative_eq!(lights.pdf(&x, &b.hit), larger.pdf(&far, &b.hit), max_relative = 1e-4);
        }
    }
}
