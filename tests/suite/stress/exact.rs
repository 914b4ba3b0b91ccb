//! Irradiance from lights of one radiance each, in double precision and in closed form.
//!
//! A polygon of one radiance has one (Lambert 1760 for surfaces, Van Oosterom and Strackee 1983 for volumes); an image
//! that is read without interpolation cuts a triangle into such polygons.

use fanlight::{Receiver, ShadingPoint};
use glam::{DVec2, DVec3};

use super::sky;
use crate::common::oracle;
use crate::common::scene::{Image, LightMesh, Paint, Scene};

/// Corner of a part of a light: the place relative to the shading point, and the texture coordinates.
type Corner = (DVec3, DVec2);

/// A polygon this much smaller than its distance is integrated point by point, where the closed forms would cancel.
const SMALL: f64 = 0.02;

/// What arrives, and what would without horizons, cosines and backs that send nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Irradiance {
    pub(crate) arriving: f64,
    pub(crate) unoccluded: f64,
}

/// From all lights of a scene. `ones` takes every light for one of unit radiance, whatever its texture.
pub(crate) fn irradiance(scene: &Scene, x: &ShadingPoint, ones: bool) -> Irradiance {
    let mut sum = Irradiance::default();
    let mut rows = sky::Rows::new(scene);
    for (m, triangle) in scene.triangles() {
        let mesh = &scene.meshes[m];
        let vertices = oracle::relative(mesh, triangle, x);
        let [a, b, c] = vertices;
        let height = (b - a).cross(c - a).dot(a);
        if height == 0.0 {
            continue;
        }
        let sends = height < 0.0 || mesh.two_sided;
        let mut add = |radiance: f64, polygon: &[DVec3]| {
            let (arriving, unoccluded) = match &mut rows {
                Some(rows) if mesh.portal => (rows.over(polygon, &x.receiver), rows.over(polygon, &Receiver::Volume)),
                _ => (over_polygon(polygon, &x.receiver), over_polygon(polygon, &Receiver::Volume)),
            };
            let constant_sky = if mesh.portal && rows.is_none() { sky::constant(scene) } else { 1.0 };
            sum.arriving += if sends { radiance * constant_sky * arriving } else { 0.0 };
            sum.unoccluded += radiance * constant_sky * unoccluded;
        };
        match mesh.paint {
            Paint::Image(image) if !ones => over_texels(&scene.images[image], mesh, triangle, vertices, &mut add),
            Paint::Constant(value) if !ones => add(f64::from(value), &vertices),
            _ => add(1.0, &vertices),
        }
    }
    sum
}

/// How many steps of barycentric coordinates, which have 24 bits, what matters of the nearest light is wide. `detail`
/// is the angle that its smallest bright part is seen under.
pub(crate) fn steps(scene: &Scene, x: &ShadingPoint, detail: f64) -> f64 {
    const STEP: f64 = 1.0 / (1 << 24) as f64;
    /// Solid angle of a light that matters.
    const SEEN: f64 = 0.01;
    let width = |(m, triangle)| {
        let vertices = oracle::relative(&scene.meshes[m], triangle, x);
        let [a, b, c] = vertices;
        let cross = (b - a).cross(c - a);
        let height = cross.dot(a).abs() / cross.length();
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let matters = height > 0.0 && oracle::sends(vertices, &scene.meshes[m]) && solid_angle(vertices) > SEEN;
        if matters { height * detail / (STEP * longest) } else { f64::INFINITY }
    };
    scene.triangles().map(width).fold(f64::INFINITY, f64::min)
}

/// Calls `add` with the radiance of each part of a triangle that shows a single texel.
fn over_texels(
    image: &Image,
    mesh: &LightMesh,
    triangle: usize,
    vertices: [DVec3; 3],
    add: &mut impl FnMut(f64, &[DVec3]),
) {
    let uvs = mesh.corner_uvs(triangle).map(|uv| uv.as_dvec2());
    let size = DVec2::new(image.size[0] as f64, image.size[1] as f64);
    let whole: Vec<Corner> = vertices.into_iter().zip(uvs.map(|uv| uv * size)).collect();
    strips(&whole, |uv| uv.x, &mut |column| {
        strips(column, |uv| uv.y, &mut |part| {
            let middle = part.iter().map(|corner| corner.1).sum::<DVec2>() / part.len() as f64;
            let radiance = oracle::look_up(image, middle / size);
            if radiance > 0.0 {
                let polygon: Vec<_> = part.iter().map(|corner| corner.0).collect();
                add(radiance, &polygon);
            }
        });
    });
}

/// Calls `visit` with the parts of a polygon between successive whole numbers of a coordinate.
fn strips(polygon: &[Corner], along: fn(DVec2) -> f64, visit: &mut impl FnMut(&[Corner])) {
    let values = || polygon.iter().map(|corner| along(corner.1));
    let low = values().fold(f64::INFINITY, f64::min).floor();
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let mut rest = polygon.to_vec();
    let mut end = low + 1.0;
    while end < high {
        let part = clip(&rest, |corner| end - along(corner.1));
        rest = clip(&rest, |corner| along(corner.1) - end);
        if part.len() > 2 {
            visit(&part);
        }
        end += 1.0;
    }
    if rest.len() > 2 {
        visit(&rest);
    }
}

/// What is left of a convex polygon where a linear function is positive (Sutherland and Hodgman 1974).
fn clip(polygon: &[Corner], value: impl Fn(&Corner) -> f64) -> Vec<Corner> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (i, corner) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (here, there) = (value(corner), value(next));
        if here >= 0.0 {
            left.push(*corner);
        }
        if (here >= 0.0) != (there >= 0.0) {
            let t = here / (here - there);
            left.push((corner.0 + (next.0 - corner.0) * t, corner.1 + (next.1 - corner.1) * t));
        }
    }
    left
}

/// Integral of the cosine over the directions to a convex polygon; of one for volumes.
pub(crate) fn over_polygon(polygon: &[DVec3], receiver: &Receiver) -> f64 {
    match *receiver {
        Receiver::Surface(normal) => above(polygon, normal.as_dvec3()),
        Receiver::Transmissive(normal) => above(polygon, normal.as_dvec3()) + above(polygon, -normal.as_dvec3()),
        Receiver::Volume => (1..polygon.len() - 1).map(|i| solid_angle([polygon[0], polygon[i], polygon[i + 1]])).sum(),
        other => unreachable!("{other:?} is none of the three receivers"),
    }
}

/// The part above the horizon of a normal.
fn above(polygon: &[DVec3], normal: DVec3) -> f64 {
    let corners: Vec<Corner> = polygon.iter().map(|v| (*v, DVec2::ZERO)).collect();
    let polygon: Vec<_> = clip(&corners, |corner| normal.dot(corner.0)).into_iter().map(|corner| corner.0).collect();
    if polygon.len() < 3 {
        return 0.0;
    }
    if is_small(&polygon) {
        let part = |i: usize| point_by_point([polygon[0], polygon[i], polygon[i + 1]], |d| normal.dot(d));
        return (1..polygon.len() - 1).map(part).sum();
    }
    let edge = |i: usize| {
        let (v, next) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let cross = v.cross(next);
        let length = cross.length();
        if length > 0.0 { length.atan2(v.dot(next)) * normal.dot(cross) / length } else { 0.0 }
    };
    0.5 * (0..polygon.len()).map(edge).sum::<f64>().abs()
}

fn is_small(polygon: &[DVec3]) -> bool {
    let distance = polygon.iter().map(|v| v.length()).fold(f64::INFINITY, f64::min);
    polygon.iter().all(|v| (*v - polygon[0]).length() < SMALL * distance)
}

fn solid_angle(triangle: [DVec3; 3]) -> f64 {
    if is_small(&triangle) {
        return point_by_point(triangle, |_| 1.0);
    }
    let [a, b, c] = triangle;
    let [la, lb, lc] = triangle.map(|v| v.length());
    let numerator = (b - a).cross(c - a).dot(a).abs();
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

/// The rule of degree five with seven points (Radon 1948).
fn point_by_point([a, b, c]: [DVec3; 3], weight: impl Fn(DVec3) -> f64) -> f64 {
    let root = 15f64.sqrt();
    let cross = (b - a).cross(c - a);
    let at = |p: DVec3| {
        let (d2, distance) = (p.length_squared(), p.length());
        weight(p / distance) * 0.5 * (cross.dot(p) / distance).abs() / d2
    };
    let mut sum = 9.0 / 40.0 * at((a + b + c) / 3.0);
    for (near, share) in
        [((6.0 - root) / 21.0, (155.0 - root) / 1200.0), ((6.0 + root) / 21.0, (155.0 + root) / 1200.0)]
    {
        let far = 1.0 - 2.0 * near;
        for p in [a * far + (b + c) * near, b * far + (a + c) * near, c * far + (a + b) * near] {
            sum += share * at(p);
        }
    }
    sum
}
