//! How well triangles are chosen: the share of samples that each mesh gets, against its share of the light.

use core::f64::consts::PI;

use fanlight::{Environment, Filter, LightSampler, Mesh, MeshId, ShadingPoint, TriangleId, Weight};
use glam::{DVec3, Vec3, vec3};

use crate::common::pcg::Pcg32;

/// A mesh of one weight.
struct Light {
    positions: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
    weight: f32,
    portal: bool,
}

impl Light {
    fn emitter(positions: Vec<Vec3>, indices: Vec<[u32; 3]>, radiance: f32) -> Self {
        Self { positions, indices, weight: radiance, portal: false }
    }

    /// A parallelogram, seen from where its edges turn left.
    fn quad(corner: Vec3, edges: [Vec3; 2], weight: f32, portal: bool) -> Self {
        let positions = vec![corner, corner + edges[0], corner + edges[0] + edges[1], corner + edges[1]];
        Self { positions, indices: vec![[0, 1, 2], [0, 2, 3]], weight, portal }
    }

    /// A lamp of ten centimeters around a point, that shines downwards.
    fn lamp(center: Vec3) -> Self {
        Self::quad(center - vec3(0.05, 0.05, 0.0), [0.1 * Vec3::Y, 0.1 * Vec3::X], 100.0, false)
    }

    /// Irradiance of an unoccluded surface from a triangle, by Lambert's formula.
    fn irradiance(&self, triangle: usize, x: Vec3, normal: DVec3) -> f64 {
        let corners = self.indices[triangle].map(|i| (self.positions[i as usize] - x).as_dvec3());
        let above: Vec<DVec3> = clipped(&corners, normal);
        let edges = above.iter().zip(above.iter().cycle().skip(1));
        let sum: f64 = edges
            .map(|(&a, &b)| {
                let cross = a.cross(b);
                let sin = cross.length();
                if sin == 0.0 { 0.0 } else { sin.atan2(a.dot(b)) * normal.dot(cross) / sin }
            })
            .sum();
        f64::from(self.weight) * (-0.5 * sum).max(0.0)
    }
}

/// The part of a polygon above a plane through the origin.
fn clipped(corners: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut above = Vec::new();
    for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (height_a, height_b) = (normal.dot(a), normal.dot(b));
        if height_a > 0.0 {
            above.push(a);
        }
        if (height_a > 0.0) != (height_b > 0.0) {
            above.push(a + (b - a) * (height_a / (height_a - height_b)));
        }
    }
    above
}

fn build(lights: &[Light], environment: Option<Environment>) -> LightSampler {
    let mut builder = LightSampler::builder();
    if let Some(environment) = environment {
        builder = builder.environment(environment);
    }
    for light in lights {
        let new = if light.portal { Mesh::portal } else { Mesh::emitter };
        let mesh = new(&light.positions, &light.indices).weight(Weight::Constant(light.weight));
        builder.add_mesh(&mesh).expect("the light is sound");
    }
    builder.build().expect("the scene is sound")
}

/// Sphere of quads of longitude and latitude around the origin, that shines inwards.
fn dome(radius: f32) -> Light {
    let (columns, rows) = (16, 8);
    let corner = |i: u32, j: u32| {
        let theta = core::f32::consts::PI * j as f32 / rows as f32;
        let phi = core::f32::consts::TAU * (i % columns) as f32 / columns as f32;
        radius * vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    };
    let positions = (0..=rows).flat_map(|j| (0..columns).map(move |i| corner(i, j))).collect();
    let mut indices = Vec::new();
    for (i, j) in (0..columns * rows).map(|k| (k % columns, k / columns)) {
        let at = |i: u32, j: u32| j * columns + i % columns;
        let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        // The other way round than seen from outside; degenerate ones at the poles are left out.
        if j + 1 < rows {
            indices.push([a, c, b]);
        }
        if j > 0 {
            indices.push([a, d, c]);
        }
    }
    Light::emitter(positions, indices, 0.1)
}

fn dome_with_lamps(radius: f32, lamps: u32) -> Vec<Light> {
    let lamp = |i: u32| {
        let i = i as f32;
        Light::lamp(vec3(0.5 * i * (0.7 * i).cos(), 0.5 * i * (0.7 * i).sin(), 1.0))
    };
    core::iter::once(dome(radius)).chain((0..lamps).map(lamp)).collect()
}

/// What is found at the points of a workload.
#[derive(Debug)]
struct Choice {
    /// Share of the samples that the first mesh gets, over its share of the light, at each point in order.
    shares: Vec<f64>,
    /// Relative variances of the choice, in order.
    variances: Vec<f64>,
    /// Mean share of samples that choose nothing.
    none: f64,
}

fn median(sorted: &[f64]) -> f64 {
    sorted[sorted.len() / 2]
}

fn choice(lights: &[Light], sampler: &LightSampler, points: &[ShadingPoint], normal: Vec3) -> Choice {
    let (mut shares, mut variances, mut none) = (Vec::new(), Vec::new(), 0.0);
    for x in points {
        let at = sampler.at(x);
        let (mut total, mut of_first, mut chosen, mut chosen_first, mut second) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (m, light) in lights.iter().enumerate() {
            for t in 0..light.indices.len() {
                let irradiance = light.irradiance(t, x.position, normal.as_dvec3()) / PI;
                let pmf = f64::from(at.pmf(TriangleId::new(MeshId::from_index(m as u32), t as u32)));
                if irradiance > 0.0 {
                    second += irradiance * irradiance / pmf;
                }
                (total, chosen) = (total + irradiance, chosen + pmf);
                if m == 0 {
                    (of_first, chosen_first) = (of_first + irradiance, chosen_first + pmf);
                }
            }
        }
        shares.push(chosen_first / (of_first / total));
        variances.push(second / (total * total) - 1.0);
        none += (1.0 - chosen) / points.len() as f64;
    }
    shares.sort_by(f64::total_cmp);
    variances.sort_by(f64::total_cmp);
    Choice { shares, variances, none }
}

/// Points on the floor under a dome.
fn dome_points(radius: f32) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(31, 2);
    let most = if radius <= 2.0 { 1.5 } else { 2.5 };
    let mut point = || {
        let (angle, distance) = (core::f32::consts::TAU * pcg.f32(), most * pcg.f32().sqrt());
        ShadingPoint::surface(vec3(distance * angle.cos(), distance * angle.sin(), 0.0), Vec3::Z)
    };
    (0..200).map(|_| point()).collect()
}

#[test]
fn small_lamps_under_a_glowing_dome_get_their_share() {
    for (radius, lamps) in [(2.0, 1), (10.0, 1), (10.0, 20), (100.0, 1), (100.0, 20), (1000.0, 20)] {
        let lights = dome_with_lamps(radius, lamps);
        let found = choice(&lights, &build(&lights, None), &dome_points(radius), Vec3::Z);
        let (share, variance) = (median(&found.shares), median(&found.variances));
        println!("dome-{radius}-{lamps}: share {share:.3}, variance {variance:.4}, none {:.4}", found.none);
        assert!((0.8..1.2).contains(&share), "dome-{radius}-{lamps}: the dome has {share} times its share");
        assert!(variance <= 0.05, "dome-{radius}-{lamps}: a variance of {variance}");
        assert!(found.none <= 0.03, "dome-{radius}-{lamps}: {} choose nothing", found.none);
    }
}

/// Windows in the wall that the points are on, others in the wall across, and a lamp.
fn coplanar(own: u32, across: u32) -> Vec<Light> {
    let x = |i: u32| -6.75 + i as f32;
    let across = (0..across).map(|i| Light::quad(vec3(x(i), 5.0, 1.0), [0.5 * Vec3::X, 0.5 * Vec3::Z], 1.0, true));
    let own = (0..own).map(|i| Light::quad(vec3(x(i), 0.0, 1.0), [0.5 * Vec3::Z, 0.5 * Vec3::X], 1.0, true));
    let lamp = Light::lamp(vec3(0.0, 2.5, 2.5));
    core::iter::once(lamp).chain(across).chain(own).collect()
}

/// Points of a wall, between its windows.
fn coplanar_points(own: u32) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(32, 2);
    let mut point = || {
        let x = -6.1 + ((own - 1) as f32 * pcg.f32()).floor() + 0.3 * pcg.f32();
        ShadingPoint::surface(vec3(x, 0.0, 1.0 + 0.5 * pcg.f32()), Vec3::Y)
    };
    (0..100).map(|_| point()).collect()
}

#[test]
fn windows_in_the_wall_of_the_point_are_not_chosen() {
    let texels: Vec<f32> = (0..32 * 16).map(|i| 0.2 + 0.8 * (1.0 - (i / 32) as f32 / 8.0).max(0.0)).collect();
    let sky = Environment::from_lat_long(32, 16, &texels, Filter::Bilinear).expect("the sky is finite");
    for (own, across) in [(2, 10), (7, 5), (12, 10), (12, 1)] {
        let lights = coplanar(own, across);
        let found = choice(&lights, &build(&lights, Some(sky.clone())), &coplanar_points(own), Vec3::Y);
        println!("coplanar-{own}-{across}: none {:.4}", found.none);
        assert!(found.none <= 0.05, "coplanar-{own}-{across}: {} choose nothing", found.none);
    }
}

/// The estimate of the irradiance that a host may weigh its own lights against, relative to Lambert's formula.
#[test]
fn the_irradiance_is_about_that_of_all_lights() {
    let (mut errors, mut count) = (Vec::new(), 0);
    for (radius, lamps) in [(2.0, 1), (10.0, 20), (100.0, 20)] {
        let lights = dome_with_lamps(radius, lamps);
        let sampler = build(&lights, None);
        for x in dome_points(radius) {
            let each = lights.iter().flat_map(|light| (0..light.indices.len()).map(move |t| (light, t)));
            let exact: f64 = each.map(|(light, t)| light.irradiance(t, x.position, DVec3::Z)).sum();
            let estimate = f64::from(sampler.at(&x).irradiance());
            assert!(estimate > 0.5 * exact && estimate < 2.0 * exact, "{x:?}: {estimate} instead of {exact}");
            errors.push((estimate / exact - 1.0).abs());
            count += 1;
        }
    }
    errors.sort_by(f64::total_cmp);
    println!("{count} points: median error {:.3}, largest {:.3}", median(&errors), errors[errors.len() - 1]);
    assert!(median(&errors) < 0.1, "{}", median(&errors));
    let below = ShadingPoint::surface(Vec3::new(0.0, 0.0, 5.0), Vec3::Z);
    assert_eq!(build(&[Light::lamp(Vec3::Z)], None).at(&below).irradiance(), 0.0);
    let sky = Environment::constant(2.0).expect("a good radiance");
    let open = LightSampler::builder().environment(sky).environment_as_light().build().expect("no light is needed");
    let found = open.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Y)).irradiance();
    assert!((f64::from(found) / (2.0 * PI) - 1.0).abs() < 0.1, "{found}");
}
