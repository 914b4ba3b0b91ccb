//! Triangles without a texture have no cliffs: not next to the shading point, and not where they are divided more
//! finely.

use crate::common::pcg::Pcg32;
use fanlight::{Environment, EnvironmentImage, LightSampler, Mesh, Receiver, ShadingPoint, Texture, Weight, Wrap};
use glam::{DVec3, Vec3};

/// The square `[-1, 1]²` at `z = 0`, with its front to `-z`.
const SQUARE: [Vec3; 4] =
    [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 0.0)];

/// Lambert's formula for the part of a polygon above the horizon, in double precision.
fn lambert(corners: &[DVec3], normal: DVec3) -> f64 {
    let above: Vec<DVec3> = (0..corners.len())
        .flat_map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
            let (h, k) = (normal.dot(a), normal.dot(b));
            let cut = ((h > 0.0) != (k > 0.0)).then(|| a + (b - a) * (h / (h - k)));
            [(h > 0.0).then_some(a), cut]
        })
        .flatten()
        .collect();
    let edge = |i: usize| {
        let (a, b) = (above[i].normalize(), above[(i + 1) % above.len()].normalize());
        let cross = a.cross(b);
        let length = cross.length();
        if length == 0.0 { 0.0 } else { length.atan2(a.dot(b)) * normal.dot(cross) / length }
    };
    0.5 * (0..above.len()).map(edge).sum::<f64>().abs()
}

/// Solid angle of a polygon by the excess of its angles.
fn solid_angle(corners: &[DVec3]) -> f64 {
    let n = corners.len();
    let angle = |i: usize| {
        let (a, b, c) = (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
        let (p, q) = (b.cross(a), b.cross(c));
        p.cross(q).length().atan2(p.dot(q))
    };
    (0..n).map(angle).sum::<f64>() - (n as f64 - 2.0) * core::f64::consts::PI
}

/// Mean and mean square of estimates that are drawn at one point.
fn moments(lights: &LightSampler, x: &ShadingPoint, count: usize, value: impl Fn(Vec3) -> f32, seed: u64) -> [f64; 2] {
    let mut pcg = Pcg32::new(seed, 41);
    let (mut sum, mut squares) = (0.0, 0.0);
    let at = lights.at(x);
    for _ in 0..count {
        let found = at.sample(pcg.cube()).map_or(0.0, |sample| {
            f64::from(value(sample.direction) * x.cosine(sample.direction)) / f64::from(sample.pdf)
        });
        sum += found;
        squares += found * found;
    }
    [sum / count as f64, squares / count as f64]
}

#[test]
fn a_square_is_sampled_as_well_from_any_height() {
    let lights = LightSampler::builder()
        .mesh(&Mesh::emitter(&SQUARE, &[[0, 2, 1], [0, 3, 2]]))
        .expect("the mesh is valid")
        .build()
        .expect("the scene is valid");
    let (points, count) = (50, 4000);
    for exponent in 0..=9 {
        let h = 0.1_f32.powi(exponent);
        for receiver in [Receiver::Surface(Vec3::Z), Receiver::Volume] {
            let mut pcg = Pcg32::new(33, 2);
            let (mut ratio, mut variance) = (0.0, 0.0);
            for point in 0..points {
                let [x, y] = [0; 2].map(|_| 0.95 * (2.0 * pcg.f32() - 1.0));
                let at = ShadingPoint::new(Vec3::new(x, y, -h), receiver);
                let corners = SQUARE.map(|c| c.as_dvec3() - at.position.as_dvec3());
                let exact = match receiver {
                    Receiver::Surface(normal) => lambert(&corners, normal.as_dvec3()),
                    _ => solid_angle(&corners),
                };
                let [mean, square] = moments(&lights, &at, count, |_| 1.0, point);
                ratio += mean / exact / points as f64;
                variance += (square / (mean * mean) - 1.0) / points as f64;
            }
            let deviation = variance.max(0.0).sqrt();
            println!("height {h:e}, {receiver:?}: mean {ratio:.5}, relative deviation {deviation:.3}");
            // Two thirds of a millionth of the square above it, rounding of barycentrics begins to show.
            let slack = if exponent == 6 { 5e-3 } else { 2e-4 };
            let error = 6.0 * deviation / ((points as usize * count) as f64).sqrt() + slack;
            assert!((ratio - 1.0).abs() < error, "{h:e}, {receiver:?}: {ratio}");
            // Below, every direction is as likely as any other. Above, what noise there is is rounding at the horizon.
            let bar = if exponent <= 6 { 0.02 } else { 0.75 };
            assert!(deviation < bar, "{h:e}, {receiver:?}: {deviation}");
        }
    }
}

/// Values of an image at texture coordinates, bilinear and clamped, in double precision.
fn bilinear(texels: &[f32], size: usize, uv: [f64; 2]) -> f64 {
    let [x, y] = uv.map(|x| x * size as f64 - 0.5);
    let texel = |i: f64, j: f64| {
        let [i, j] = [i, j].map(|k| k.clamp(0.0, size as f64 - 1.0) as usize);
        f64::from(texels[j * size + i])
    };
    let ([i, j], [s, t]) = ([x.floor(), y.floor()], [x - x.floor(), y - y.floor()]);
    let row = |j: f64| texel(i, j) * (1.0 - s) + texel(i + 1.0, j) * s;
    row(j) * (1.0 - t) + row(j + 1.0) * t
}

/// Eight bright disks on a dim square: next to it, both what is far and bright and what is near and dim is found.
#[test]
fn a_textured_square_has_no_cliffs_either() {
    let size = 256;
    let mut pcg = Pcg32::new(7, 7);
    let centers: [[f32; 2]; 8] = core::array::from_fn(|_| [0; 2].map(|_| pcg.f32()));
    let is_bright = |uv: [f32; 2]| centers.iter().any(|c| (c[0] - uv[0]).hypot(c[1] - uv[1]) < 0.02);
    let texels: Vec<f32> = (0..size * size)
        .map(|k| [k % size, k / size].map(|i| (i as f32 + 0.5) / size as f32))
        .map(|uv| if is_bright(uv) { 100.0 } else { 0.05 })
        .collect();
    let uvs = SQUARE.map(|corner| 0.5 * corner.truncate() + 0.5);
    let mut builder = LightSampler::builder();
    let texture = Texture::new(size, size, &texels).expect("the image is finite");
    let texture = builder.add_texture(texture.wrap(Wrap::Clamp, Wrap::Clamp));
    let mesh = Mesh::emitter(&SQUARE, &[[0, 2, 1], [0, 3, 2]]).uvs(&uvs).weight(Weight::Texture(texture));
    let lights = builder.mesh(&mesh).expect("the mesh is valid").build().expect("the scene is valid");
    let (points, count) = (20_u64, 2000);
    for exponent in 0..=6 {
        let h = 0.1_f32.powi(exponent);
        for receiver in [Receiver::Surface(Vec3::Z), Receiver::Volume] {
            let mut pcg = Pcg32::new(33, 2);
            let (mut found, mut exact, mut variance, mut relative) = (0.0, 0.0, 0.0, 0.0);
            for seed in 0..points {
                let [x, y] = [0; 2].map(|_| 0.95 * (2.0 * pcg.f32() - 1.0));
                let at = ShadingPoint::new(Vec3::new(x, y, -h), receiver);
                let weight = |direction: Vec3| {
                    let hit = at.position.as_dvec3() + direction.as_dvec3() * (f64::from(h) / f64::from(direction.z));
                    bilinear(&texels, size, [0.5 * hit.x + 0.5, 0.5 * hit.y + 0.5]) as f32
                };
                let [mean, square] = moments(&lights, &at, count, weight, seed);
                let truth = irradiance(&texels, size, &at);
                (found, exact) = (found + mean, exact + truth);
                variance += square - mean * mean;
                relative += (square / (mean * mean) - 1.0) / points as f64;
            }
            let (ratio, deviation) = (found / exact, relative.max(0.0).sqrt());
            println!("height {h:e}, {receiver:?}: mean {ratio:.4}, relative deviation {deviation:.3}");
            // The sum over directions is off by 2 %.
            let error = 6.0 * (variance / count as f64).sqrt() / exact + 0.02;
            assert!((ratio - 1.0).abs() < error, "{h:e}, {receiver:?}: {ratio}, {error}");
            assert!(deviation < 1.5, "{h:e}, {receiver:?}: {deviation}");
        }
    }
}

/// What arrives from the textured square: a sum over directions of equal weight.
fn irradiance(texels: &[f32], size: usize, x: &ShadingPoint) -> f64 {
    let n = 300;
    let (origin, is_volume) = (x.position.as_dvec3(), x.receiver == Receiver::Volume);
    let mut sum = 0.0;
    for i in 0..n * n {
        let [u, v] = [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
        let z = if is_volume { u } else { u.sqrt() };
        let (sin, cos) = (core::f64::consts::TAU * v).sin_cos();
        let to = DVec3::new(cos, sin, 0.0) * ((1.0 - z * z).sqrt() / z * -origin.z);
        let hit = origin + to;
        if hit.x.abs() <= 1.0 && hit.y.abs() <= 1.0 {
            sum += bilinear(texels, size, [0.5 * hit.x + 0.5, 0.5 * hit.y + 0.5]);
        }
    }
    core::f64::consts::PI * if is_volume { 2.0 } else { 1.0 } * sum / f64::from(n * n)
}

/// A window of `2 n²` triangles in front of a sky that brightens upwards.
fn window(n: u32) -> LightSampler {
    let size = 128;
    // Above the horizon is the diamond in the middle of the map, whose distance from the center grows with the angle.
    let texels: Vec<f32> = (0..size * size)
        .map(|i| [(i % size) as f32, (i / size) as f32].map(|x| ((x + 0.5) / size as f32 * 2.0 - 1.0).abs()))
        .map(|[u, v]| 0.2 + 0.8 * (1.0 - (u + v) * (u + v)).max(0.0))
        .collect();
    let environment = Environment::new(&EnvironmentImage::equal_area(size, &texels)).expect("the image is valid");
    let positions: Vec<Vec3> = (0..(n + 1) * (n + 1))
        .map(|i| Vec3::new((i % (n + 1)) as f32 / n as f32 - 0.5, 0.0, 1.0 + (i / (n + 1)) as f32 / n as f32))
        .collect();
    let triangles: Vec<[u32; 3]> = (0..n * n)
        .flat_map(|i| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        })
        .collect();
    LightSampler::builder()
        .environment(environment)
        .mesh(&Mesh::portal(&positions, &triangles))
        .expect("the mesh is valid")
        .build()
        .expect("the scene is valid")
}

#[test]
fn a_window_may_be_divided_into_triangles() {
    let [coarse, fine] = [window(1), window(8)];
    let mut pcg = Pcg32::new(8, 2);
    let (mut variances, mut total, mut lit) = ([0.0; 2], 0.0, 0);
    while lit < 100 {
        let position = Vec3::new(-2.0 + 4.0 * pcg.f32(), -3.0 + 2.9 * pcg.f32(), 3.0 * pcg.f32());
        let x = ShadingPoint::surface(position, pcg.direction());
        let radiance = |direction: Vec3| coarse.environment().radiance(direction);
        let found = [&coarse, &fine].map(|lights| moments(lights, &x, 4000, radiance, lit));
        if found[0][0] == 0.0 {
            continue;
        }
        lit += 1;
        total += found[1][0] * found[1][0];
        for (variance, [mean, square]) in variances.iter_mut().zip(found) {
            *variance += square - mean * mean;
        }
    }
    let [two, many] = variances.map(|variance| variance / total);
    println!("relative variance {two:.4} with 2 triangles, {many:.4} with 128");
    assert!(two < 1.5 * many && many < 1.5 * two, "{two} {many}");
}
