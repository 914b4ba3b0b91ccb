//! Properties that hold for any scene that a builder accepts.

use core::cell::Cell;

use approx::assert_relative_eq;
use fanlight::{
    Environment, Filter, Hit, LightSampler, LightSamplerView, Mesh, MeshId, Receiver, ShadingPoint, Sides, Texture,
    TriangleId, Weight,
};
use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

use crate::common::tier::tier;

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

/// Mostly three points; now and then a sliver, a repeated corner, or a triangle far from everything.
fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
    let barycentric = [0.0f32..1.0, -1e-6f32..1e-6];
    ([point(), point(), point()], barycentric, 0..8).prop_map(|([a, b, c], [along, off], kind)| match kind {
        0 => [a, b, a + along * (b - a) + off * (c - a)],
        1 => [a, b, b],
        2 => [a, b, c].map(|p| p + 1e5),
        3 => [a, b, c].map(|p| 1e-6 * p),
        _ => [a, b, c],
    })
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
    prop::collection::vec((triangle(), uvs, any::<bool>(), any::<bool>()), 1..20)
}

/// Three random numbers.
fn numbers() -> impl Strategy<Value = [f32; 3]> {
    [0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0]
}

fn texels() -> impl Strategy<Value = Vec<f32>> {
    prop::collection::vec(prop_oneof![2 => Just(0.0f32), 2 => 0.0f32..2.0, 1 => Just(1e6f32)], 16)
}

/// Corners of a triangle seen from a point.
fn seen(corners: [Vec3; 3], x: &ShadingPoint) -> [DVec3; 3] {
    corners.map(|p| p.as_dvec3() - x.position.as_dvec3())
}

/// Cosine of a receiver, clamped or absolute; one in a volume.
fn cosine(x: &ShadingPoint, direction: DVec3) -> f64 {
    match x.receiver {
        Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
        Receiver::Transmissive(normal) => normal.as_dvec3().dot(direction).abs(),
        Receiver::Volume => 1.0,
        other => unreachable!("{other:?} is none of the three receivers"),
    }
}

/// Least barycentric coordinate of where a ray crosses the plane of a triangle, and the second and third one.
fn crossing([a, b, c]: [DVec3; 3], direction: DVec3) -> Option<(f64, [f64; 2])> {
    let normal = (b - a).cross(c - a);
    let [na, nb, nc] = [b.cross(c), c.cross(a), a.cross(b)].map(|n| n.dot(direction));
    let whole = na + nb + nc;
    let barycentrics = [na / whole, nb / whole, nc / whole];
    let ahead = normal.dot(a) / normal.dot(direction) > 0.0;
    (ahead && whole != 0.0).then(|| (barycentrics.into_iter().fold(1.0, f64::min), [barycentrics[1], barycentrics[2]]))
}

/// The lights of a soup in a sky of eight by four texels, with all coordinates multiplied.
fn build(soup: &Soup, texels: &[f32], sky: &[f32], scale: f32) -> LightSampler {
    let image: Vec<f32> = sky.iter().chain(sky).copied().collect();
    let sky = Environment::from_lat_long(8, 4, &image, Filter::Bilinear).expect("the sky is finite");
    let mut builder = LightSampler::builder().environment(sky);
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

/// Checks a property in as many cases as the tier says. The property returns how many things it has compared: `least`
/// of them a case, on average, or it has shown nothing.
fn check<S: Strategy>(strategy: S, least: f64, property: impl Fn(S::Value) -> Result<usize, TestCaseError>) {
    let cases = tier().cases;
    let config = Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::with_cases(cases) };
    let compared = Cell::new(0);
    let result = TestRunner::new(config).run(&strategy, |values| {
        compared.set(compared.get() + property(values)?);
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    let compared = compared.into_inner();
    println!("{compared} comparisons in {cases} cases");
    assert!(compared as f64 > least * f64::from(cases), "only {compared} comparisons in {cases} cases");
}

#[test]
fn a_sample_has_the_density_that_pdf_finds() {
    let numbers = prop::collection::vec(numbers(), 30);
    let strategy = (soup(), texels(), texels(), shading_point(), numbers);
    check(strategy, 3.0, |(soup, texels, sky, x, us)| {
        let lights = build(&soup, &texels, &sky, 1.0);
        let mut compared = 0;
        for u in us {
            if let Some(sample) = lights.at(&x).sample(u) {
                compared += 1;
                assert_relative_eq!(
                    lights.at(&x).pdf(&sample.hit().expect("a triangle")),
                    sample.pdf,
                    max_relative = 1e-5
                );
                prop_assert!(sample.pdf.is_normal() && sample.pdf_area > 0.0 && sample.distance > 0.0);
                prop_assert!(lights.at(&x).pdf_sample_direction(&sample) >= sample.pdf);
                assert_relative_eq!(sample.direction.length(), 1.0, max_relative = 1e-5);
            }
        }
        Ok(compared)
    });
}

/// Untextured triangles of a sky that is nowhere black: they send light wherever a side that is lit is seen.
#[test]
fn what_sends_light_can_be_drawn() {
    let strategy = (soup(), shading_point(), prop::collection::vec([0.0f64..1.0, 0.0f64..1.0], 30));
    check(strategy, 1.0, |(soup, x, places)| {
        let soup: Soup = soup.into_iter().map(|(corners, uvs, portal, _)| (corners, uvs, portal, false)).collect();
        let lights = build(&soup, &[1.0; 16], &[1.0; 16], 1.0);
        let mut compared = 0;
        for ((number, (corners, ..)), [u, v]) in soup.iter().enumerate().cycle().zip(places) {
            let [a, b, c] = seen(*corners, &x);
            let [b1, b2] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let (at, normal) = (a + (b - a) * b1 + (c - a) * b2, (b - a).cross(c - a));
            let facing = -normal.normalize_or_zero().dot(at.normalize_or_zero());
            let lit = if number % 3 == 0 { facing.abs() } else { facing };
            // Nearer to a plane, or thinner, than what rounding may hide.
            let size = corners.iter().fold(0.0f32, |size, p| size.max(p.abs().max_element()));
            let is_thin = normal.length() < 1e-5 * f64::from(size).powi(2);
            if lit < 1e-3 || cosine(&x, at.normalize()) < 1e-3 || is_thin || at.length() < 1e-5 * f64::from(size) {
                continue;
            }
            let hit = Hit::new(TriangleId::new(MeshId::from_index(number as u32), 0), [b1 as f32, b2 as f32]);
            prop_assert!(lights.at(&x).pdf(&hit) > 0.0, "{hit:?} sends light to {x:?}");
            compared += 1;
        }
        Ok(compared)
    });
}

#[test]
fn the_density_of_a_direction_is_the_sum_over_what_it_crosses() {
    let strategy = (soup(), texels(), texels(), shading_point(), prop::collection::vec(point(), 10));
    check(strategy, 1.0, |(soup, texels, sky, x, places)| {
        let lights = build(&soup, &texels, &sky, 1.0);
        let mut compared = 0;
        for place in places {
            let direction = (place - x.position).normalize_or(Vec3::X);
            let mut sum = 0.0;
            let mut is_clear = true;
            for (number, (corners, ..)) in soup.iter().enumerate() {
                let vertices = seen(*corners, &x);
                let size = vertices.iter().fold(0.0f64, |size, p| size.max(p.length()));
                let normal = (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]);
                let height = normal.normalize_or_zero().dot(vertices[0]).abs();
                let Some((least, barycentrics)) = crossing(vertices, direction.as_dvec3()) else { continue };
                // Near an edge rounding decides, and near anything seen edge on or thin as a needle.
                let is_thin = normal.length() < 1e-3 * size * size || height < 1e-3 * size;
                is_clear &= least.abs() > 1e-3 && (least < -1.0 || !is_thin);
                if least > 0.0 {
                    let triangle = TriangleId::new(MeshId::from_index(number as u32), 0);
                    sum += lights.at(&x).pdf(&Hit::new(triangle, barycentrics.map(|b| b as f32)));
                }
            }
            if is_clear {
                let found = lights.at(&x).pdf_direction(direction);
                prop_assert_eq!(found > 0.0, sum > 0.0);
                assert_relative_eq!(found, sum, max_relative = 1e-3);
                compared += usize::from(found > 0.0);
            }
        }
        Ok(compared)
    });
}

#[test]
fn bytes_hold_the_same_lights() {
    let strategy = (soup(), texels(), texels(), shading_point(), numbers());
    check(strategy, 0.1, |(soup, texels, sky, x, u)| {
        let lights = build(&soup, &texels, &sky, 1.0);
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&lights.to_bytes());
        let view: LightSamplerView<'_> =
            LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("the bytes are whole");
        let sample = lights.at(&x).sample(u);
        prop_assert_eq!(view.at(&x).sample(u), sample);
        Ok(usize::from(sample.is_some()))
    });
}

/// A power of two changes no digit of any length.
#[test]
fn a_larger_scene_has_the_same_densities() {
    let strategy = (soup(), texels(), texels(), shading_point(), numbers(), -12i32..12);
    check(strategy, 0.1, |(soup, texels, sky, x, u, exponent)| {
        let scale = 2f32.powi(exponent);
        let (lights, larger) = (build(&soup, &texels, &sky, 1.0), build(&soup, &texels, &sky, scale));
        let far = ShadingPoint::new(x.position * scale, x.receiver);
        let (Some(a), Some(b)) = (lights.at(&x).sample(u), larger.at(&far).sample(u)) else { return Ok(0) };
        assert_relative_eq!(
            lights.at(&x).pdf(&a.hit().expect("a triangle")),
            larger.at(&far).pdf(&a.hit().expect("a triangle")),
            max_relative = 1e-4
        );
        assert_relative_eq!(
            lights.at(&x).pdf(&b.hit().expect("a triangle")),
            larger.at(&far).pdf(&b.hit().expect("a triangle")),
            max_relative = 1e-4
        );
        Ok(1)
    });
}
