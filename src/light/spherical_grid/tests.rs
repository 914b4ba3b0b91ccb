use alloc::vec::Vec;

use glam::{DVec3, Vec3};

use super::{GridPoint, SphericalGrid};
use crate::blas::{CellNode, LEAF, Lattice, Root};
use crate::env::{Environment, EnvironmentImage};
use crate::light::linear_density::LinearDensity;
use crate::light::{DrawnPoint, Illumination, LightTriangle, LightViewKind, LocalPoint, TriangleView};
use crate::receiver::{NoLobe, Receiver, ReceiverKind, ShadingPoint};
use crate::testing::{Pcg32, chi_square, chi_square_limit};
use crate::warp::{SphericalTriangle, Variate, seed};

const NO_CELLS: &[CellNode] = &[];

fn light(vertices: [Vec3; 3]) -> LightTriangle {
    LightTriangle {
        vertices: vertices.map(|v| v.to_array()),
        root: Root { average: 1.0, node: LEAF },
        index_and_flags: LightTriangle::TWO_SIDED | LightTriangle::PORTAL,
    }
}

fn numbers(pcg: &mut Pcg32) -> [Variate; 2] {
    let u = [pcg.next_f32(), pcg.next_f32()];
    let salt = seed(&u);
    [Variate::new(u[0], salt), Variate::new(u[1], salt ^ 1)]
}

/// A sky by a function of the direction.
fn sky(radiance: impl Fn(Vec3) -> f32) -> Environment {
    let size = 64;
    let side = 1.0 / size as f32;
    let texels: Vec<f32> = (0..size * size)
        .map(|i| glam::Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) * side)
        .map(|point| radiance(crate::warp::equal_area::square_to_sphere(point)))
        .collect();
    Environment::new(&EnvironmentImage::equal_area(size, &texels)).expect("the image is valid")
}

fn skies() -> [Option<Environment>; 4] {
    [
        None,
        Some(sky(|d| 0.2 + 0.8 * d.z.max(0.0) + if d.x * d.y > 0.1 { 3.0 } else { 0.0 })),
        // Black ground, and black patches.
        Some(sky(|d| if d.z > 0.05 && (9.0 * d.x).sin() > -0.5 { 0.3 + d.z } else { 0.0 })),
        // High contrast.
        Some(sky(|d| if (13.0 * d.x).sin() * (11.0 * d.z).sin() > 0.9 { 100.0 } else { 0.01 })),
    ]
}

/// Shading points and triangles of all kinds that are near.
fn scenes(pcg: &mut Pcg32, count: usize) -> Vec<(LightTriangle, ShadingPoint)> {
    (0..count)
        .map(|i| {
            let vertices: [Vec3; 3] = core::array::from_fn(|_| pcg.direction() * (0.3 + pcg.next_f32()));
            let normal = pcg.direction();
            let inside = (vertices[0] + vertices[1] + vertices[2]) * (1.0 / 3.0);
            let away = pcg.direction() * [1.0, 0.3, 0.01][i / 3 % 3];
            let receiver = match i % 3 {
                0 => Receiver::Surface(normal),
                1 => Receiver::Transmissive(normal),
                _ => Receiver::Volume,
            };
            (light(vertices), ShadingPoint::new(inside + away, receiver))
        })
        .collect()
}

/// A point of the triangle uniform by solid angle, with the solid angle.
fn whole(view: &TriangleView<'_>) -> SphericalTriangle {
    let [a, b, c] = view.exact_vertices;
    let vertices = if view.determinant < 0.0 { [a, c, b] } else { [a, b, c] };
    SphericalTriangle::new(vertices, view.determinant.abs()).expect("the triangle is visible")
}

fn point_towards(view: &TriangleView<'_>, direction: DVec3) -> Lattice {
    let (barycentrics, _) = crate::geometry::cross_plane(view.exact_vertices, direction).expect("it crosses");
    Lattice::inside(barycentrics)
}

#[test]
fn a_samples_density_is_that_of_its_point() {
    let mut pcg = Pcg32::new(1, 72);
    let mut drawn = 0;
    for sky in skies() {
        let environment = sky.as_ref().map(Environment::as_view);
        for (light, x) in scenes(&mut pcg, 250) {
            let Some(view) =
                TriangleView::wrapped(&light, &x, Illumination::default(), NO_CELLS, environment.as_ref(), |v| v)
            else {
                continue;
            };
            for _ in 0..1000 {
                let Some(DrawnPoint { point, pdf, .. }) = view.sample(numbers(&mut pcg)) else { continue };
                let found = view.pdf(point).unwrap_or(0.0);
                assert!((found / pdf - 1.0).abs() < 1e-5, "{x:?} {point:?}: {found} {pdf}");
                drawn += 1;
            }
        }
    }
    assert!(drawn > 500_000, "{drawn}");
}

#[test]
fn densities_are_normalized_and_positive_where_light_is() {
    let mut pcg = Pcg32::new(2, 72);
    for (kind, sky) in skies().into_iter().enumerate() {
        let environment = sky.as_ref().map(Environment::as_view);
        for (light, x) in scenes(&mut pcg, 15) {
            let Some(view) =
                TriangleView::wrapped(&light, &x, Illumination::default(), NO_CELLS, environment.as_ref(), |v| v)
            else {
                continue;
            };
            if (0..100).all(|_| view.sample(numbers(&mut pcg)).is_none()) {
                continue;
            }
            let triangle = whole(&view);
            let n = 128;
            let (mut sum, mut square) = (0.0, 0.0);
            for i in 0..n * n {
                let [u, v] = [i % n, i / n].map(|i| (f64::from(i) + f64::from(pcg.next_f32())) / f64::from(n));
                let direction = triangle.direction([u, v]);
                let point = LocalPoint::on_triangle(point_towards(&view, direction));
                let pdf = view.pdf(point).unwrap_or(0.0) * triangle.solid_angle();
                let radiance = environment.as_ref().map_or(1.0, |e| e.radiance(direction.as_vec3()));
                let target = radiance * x.receiver.weight(direction.as_vec3());
                assert!(pdf > 0.0 || target < 1e-5, "{kind} {x:?} {direction}: {target}");
                sum += pdf;
                square += pdf * pdf;
            }
            let (count, integral) = (f64::from(n * n), sum / f64::from(n * n));
            let deviation = ((square / count - integral * integral).max(0.0) / count).sqrt();
            // Nothing is drawn where what is behind the chosen cell turns out to be black.
            let tries = 4096;
            let none = (0..tries).filter(|_| view.sample(numbers(&mut pcg)).is_none()).count() as f64;
            let missing = none / f64::from(tries);
            let deviation = (deviation * deviation + missing * (1.0 - missing) / f64::from(tries)).sqrt();
            let error = integral + missing - 1.0;
            assert!(error.abs() < 5.0 * deviation + 1e-4, "{kind} {x:?}: {integral} {missing} ± {deviation}");
        }
    }
}

#[test]
fn samples_follow_the_density() {
    // The density is constant over the cells of three steps, or smooth, so that sums over them are integrals.
    const FINEST: usize = 512;
    const BINS: usize = 8;
    let mut pcg = Pcg32::new(3, 72);
    for sky in skies() {
        let environment = sky.as_ref().map(Environment::as_view);
        for (light, x) in scenes(&mut pcg, 3) {
            let view =
                TriangleView::wrapped(&light, &x, Illumination::default(), NO_CELLS, environment.as_ref(), |v| v);
            let Some(view) = view.filter(|view| LinearDensity::new(view).is_none()) else { continue };
            let Some(grid) = SphericalGrid::new(&view, NoLobe) else { continue };
            // Such points may be drawn by the cosine, without cells.
            let is_even = matches!(x.receiver, Receiver::Surface(_)) && environment.is_none();
            let mut expected = [0.0; 2 * BINS * BINS];
            let bin = |(part, point): (usize, [f64; 2])| {
                let [i, j] = point.map(|x| ((x * BINS as f64) as usize).min(BINS - 1));
                (part * BINS + j) * BINS + i
            };
            let count = 40_000;
            for part in 0..1 + usize::from(grid.visible.is_split()) {
                let triangle = grid.visible.triangles()[part];
                for i in 0..FINEST * FINEST {
                    let point = [i % FINEST, i / FINEST].map(|i| (i as f64 + 0.5) / FINEST as f64);
                    let direction = triangle.direction(point);
                    let pdf = if is_even {
                        view.pdf(LocalPoint::on_triangle(point_towards(&view, direction)))
                    } else {
                        grid.pdf(direction, None)
                    };
                    let pdf = pdf.unwrap_or(0.0);
                    expected[bin((part, point))] +=
                        pdf * triangle.solid_angle() / (FINEST * FINEST) as f64 * f64::from(count);
                }
            }
            let (mut observed, mut none) = ([0.0; 2 * BINS * BINS], 0.0);
            for _ in 0..count {
                match view.sample(numbers(&mut pcg)) {
                    Some(drawn) => observed[bin(grid.visible.locate(drawn.relative.normalize()))] += 1.0,
                    None => none += 1.0,
                }
            }
            let rest = f64::from(count) - expected.iter().sum::<f64>();
            let all = |bins: [f64; 2 * BINS * BINS], rest: f64| bins.into_iter().chain([rest]).collect::<Vec<f64>>();
            let (statistic, degrees) = chi_square(&all(observed, none), &all(expected, rest.max(1e-6)));
            assert!(statistic < chi_square_limit(degrees), "{x:?}: {statistic} of {degrees}");
        }
    }
}

/// Irradiance of a diffuse square by Lambert's formula in double precision: nothing of the sampler is in it.
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

/// Solid angle by the excess of its angles.
fn solid_angle(corners: &[DVec3]) -> f64 {
    let n = corners.len();
    let angle = |i: usize| {
        let (a, b, c) = (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
        let (p, q) = (b.cross(a), b.cross(c));
        p.cross(q).length().atan2(p.dot(q))
    };
    (0..n).map(angle).sum::<f64>() - (n as f64 - 2.0) * core::f64::consts::PI
}

#[test]
fn near_squares_have_the_right_mean_and_little_noise() {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let triangles = [[0, 2, 1], [0, 3, 2]].map(|t| light(t.map(|i: usize| corners[i])));
    let tilted = Vec3::new(0.6, -0.3, 0.7).normalize();
    for exponent in 0..=9 {
        let h = 0.1_f32.powi(exponent);
        for receiver in [Receiver::Surface(Vec3::Z), Receiver::Surface(tilted), Receiver::Volume] {
            let mut pcg = Pcg32::new(33, 2);
            let (mut ratios, mut variances) = (0.0, 0.0);
            let points = 50;
            for _ in 0..points {
                let [x, y] = [0; 2].map(|_| 0.95 * (2.0 * pcg.next_f32() - 1.0));
                let at = ShadingPoint::new(Vec3::new(x, y, -h), receiver);
                let relative = corners.map(|c| c.as_dvec3() - at.position.as_dvec3());
                let exact = match receiver {
                    Receiver::Surface(normal) => lambert(&relative, normal.as_dvec3()),
                    _ => solid_angle(&relative),
                };
                // Both triangles, chosen by what each sends.
                let (mut mean, mut second) = (0.0, 0.0);
                let count = 3000;
                for light in &triangles {
                    let view = TriangleView::wrapped(light, &at, Illumination::default(), NO_CELLS, None, |v| v);
                    let Some(view) = view else { continue };
                    let (mut sum, mut squares) = (0.0, 0.0);
                    for _ in 0..count {
                        let Some(DrawnPoint { relative, pdf, .. }) = view.sample(numbers(&mut pcg)) else { continue };
                        let value = f64::from(receiver.weight(relative.normalize().as_vec3())) / pdf;
                        sum += value / f64::from(count);
                        squares += value * value / f64::from(count);
                    }
                    mean += sum;
                    second += if sum > 0.0 { squares / sum } else { 0.0 };
                }
                ratios += mean / exact / f64::from(points);
                variances += (second / mean - 1.0) / f64::from(points);
            }
            let deviation = variances.max(0.0).sqrt();
            std::eprintln!("{h:e} {receiver:?}: {ratios:.5}, {deviation:.3}");
            // Six standard errors of 150,000 samples. Two thirds of a millionth of the triangle above it, rounding to
            // the lattice shows.
            let limit = 6.0 * deviation / 380.0 + if exponent == 6 { 5e-3 } else { 1e-4 };
            assert!((ratios - 1.0).abs() < limit, "{h:e} {receiver:?}: {ratios}");
            assert!(deviation < if exponent <= 6 { 0.3 } else { 0.75 }, "{h:e} {receiver:?}: {deviation}");
        }
    }
}

#[test]
fn drawn_directions_lie_in_their_cells() {
    let mut pcg = Pcg32::new(5, 72);
    let (mut in_cell, mut all) = (0.0, 0.0);
    for sky in skies() {
        let environment = sky.as_ref().map(Environment::as_view);
        for (light, x) in scenes(&mut pcg, 50) {
            let view =
                TriangleView::wrapped(&light, &x, Illumination::default(), NO_CELLS, environment.as_ref(), |v| v);
            let Some(grid) = view.as_ref().and_then(|view| SphericalGrid::new(view, NoLobe)) else { continue };
            for _ in 0..100 {
                let Some((direction, cell, _)) = grid.draw(numbers(&mut pcg)) else { continue };
                all += 1.0;
                in_cell += f64::from(u8::from(cell.holds(GridPoint::new(grid.visible.locate(direction)))));
            }
        }
    }
    assert!(in_cell >= 0.9999 * all, "{in_cell} of {all}");
}
