//! The checks of the fuzz targets, for inputs that once failed and for random ones.

use crate::checks;
use crate::common::tier::tier;
use fanlight::{
    DistantLight, Environment, Filter, LightSampler, LightSamplerView, Mesh, Receiver, ShadingPoint, Sides,
};
use glam::Vec3;
use rand_pcg::{Pcg32, rand_core::Rng};

/// Inputs of every length, all of whose bytes are random.
fn inputs(count: u64) -> impl Iterator<Item = Vec<u8>> {
    (0..count).map(|seed| {
        let mut pcg = Pcg32::new(seed, 41);
        let mut input = vec![0; (pcg.next_u32() % 1500) as usize];
        pcg.fill_bytes(&mut input);
        input
    })
}

#[test]
fn random_scenes() {
    inputs(tier().inputs).for_each(|input| checks::scene(&input));
}

#[test]
fn random_bytes() {
    inputs(tier().inputs).for_each(|input| checks::bytes(&input));
}

#[test]
fn random_bytes_of_visibility() {
    inputs(tier().inputs / 2).for_each(|input| checks::visibility(&input));
}

/// Once a direction that grazed a triangle, from a point on its edge, led to a point with a density of zero.
#[test]
fn a_point_on_the_edge_of_a_triangle() {
    checks::visibility(b"`N\x0e\x02\x0e\x07\0\0\0\0\0\0\x0e\x0e\x0e\x0e\x0e\x0e[\x0e[\x07\x02\x07\xa7");
}

/// Photons of a distant light once started at infinity, as their ball was that large.
#[test]
fn photons_into_a_ball_beyond_all_distances() {
    let mut builder = LightSampler::builder();
    builder.add_light(DistantLight::new(Vec3::NEG_Z, 1.0)).expect("a valid light");
    let lights = builder.build().expect("one light");
    let mut drawn = 0;
    for (center, radius) in [(0.0, 1.0), (1e15, 1e15), (1e16, 1.0), (f32::MAX, 1.0), (0.0, f32::MAX), (f32::NAN, 1.0)] {
        let emission = lights.emission().within(Vec3::splat(center), radius);
        if let Some(ray) = emission.sample([0.3, 0.9, 0.9, 0.5, 0.5]) {
            drawn += 1;
            assert!(ray.position.is_finite() && ray.pdf > 0.0, "{ray:?}");
        }
    }
    assert_eq!(drawn, 2);
}

/// Sends to both sides of z = 0.
fn one_triangle() -> LightSampler {
    let mut builder = LightSampler::builder();
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    builder.add_mesh(&Mesh::emitter(&positions, &[[0, 1, 2]]).sides(Sides::Two)).expect("a valid mesh");
    builder.build().expect("one triangle")
}

#[test]
fn nothing_arrives_at_points_beyond_all_distances() {
    let lights = one_triangle();
    for far in [1e16, 1e20, 1e38, f32::MAX, f32::INFINITY, f32::NAN] {
        for position in [Vec3::splat(far), Vec3::new(0.0, 0.0, -far), Vec3::new(0.1, far, 0.5)] {
            let normal = Vec3::new(0.0, -0.6, -0.8);
            for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
                let x = ShadingPoint::new(position, receiver);
                assert_eq!(lights.at(&x).sample([0.5; 3]), None, "{x:?}");
                assert_eq!(lights.at(&x).pdf_direction(-Vec3::Z), 0.0, "{x:?}");
            }
        }
    }
    let x = ShadingPoint::volume(Vec3::new(0.0, 0.0, 1e15));
    assert!(lights.at(&x).sample([0.5; 3]).is_some_and(|sample| sample.distance.is_finite()));
}

#[test]
fn normals_of_any_bits_keep_samples_finite() {
    let lights = one_triangle();
    let mut drawn = 0;
    for normal in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX), Vec3::ZERO, Vec3::splat(1e-45)] {
        for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal)] {
            let x = ShadingPoint::new(Vec3::new(0.2, 0.2, 1.0), receiver);
            if let Some(sample) = lights.at(&x).sample([0.5; 3]) {
                drawn += 1;
                assert!(sample.pdf > 0.0 && sample.pdf.is_finite(), "{x:?}");
                assert_eq!(sample.pdf, lights.at(&x).pdf(&sample.hit().expect("a triangle")), "{x:?}");
            }
        }
    }
    assert!(drawn >= 2, "only {drawn} of 10 normals give a sample");
}

/// Two meshes of one triangle each, whose bytes hold `[0, 1, 2]` (starts of the meshes), then two leaves.
#[test]
fn triangles_and_their_leaves_agree() {
    let mut builder = LightSampler::builder();
    for position in [Vec3::ZERO, Vec3::splat(9.0)] {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|vertex| vertex + position);
        builder.add_mesh(&Mesh::emitter(&positions, &[[0, 1, 2]])).expect("a valid mesh");
    }
    let bytes = builder.build().expect("two triangles").to_bytes();
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let load = |words: &[u32]| LightSamplerView::from_bytes(bytemuck::cast_slice(words)).map(drop);
    load(&words).expect("its own bytes");
    let starts = words.windows(3).rposition(|window| *window == [0, 1, 2]).expect("the starts of the meshes");
    let mut swapped = words.clone();
    swapped.swap(starts + 3, starts + 4);
    assert!(load(&swapped).expect_err("swapped leaves").to_string().contains("triangle"));
    let mut moved = words.clone();
    moved[starts] = 1;
    assert!(load(&moved).expect_err("a triangle of no mesh").to_string().contains("first mesh"));
    let mut absent = words;
    absent[starts + 3] = u32::MAX;
    assert!(load(&absent).expect_err("a leaf that its triangle does not know").to_string().contains("triangle"));
}

/// A sky whose only light comes from behind a portal.
#[test]
fn no_ray_leaves_where_nothing_is_sent() {
    let texels: Vec<f32> = (0..64).map(|i| if [27, 28, 35, 36].contains(&i) { 1.0 } else { 0.0 }).collect();
    let sky = Environment::from_equal_area(8, &texels, Filter::Nearest).expect("a valid sky");
    let mut builder = LightSampler::builder().environment(sky);
    builder.add_mesh(&Mesh::portal(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]])).expect("a valid mesh");
    let lights = builder.build().expect("one triangle");
    let emission = lights.emission();
    for u in [0.0, 0.3, 0.6, 0.9] {
        assert_eq!(emission.sample([u; 5]), None);
    }
}
