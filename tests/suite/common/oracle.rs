//! Irradiance in double precision, from a scene's description alone.

use fanlight::{Filter, Glossy, Microfacet, Receiver, ShadingPoint, Wrap};
use glam::{DVec2, DVec3};

use super::scene::{Image, LightMesh, Paint, Scene, Sky};

/// The generalized golden ratio in two dimensions: multiples of its inverse powers fill the square evenly.
const GOLDEN: f64 = 1.324_717_957_244_746;

/// Weight of a unit direction: the cosine, and what a lobe makes of it.
pub(crate) fn cosine(receiver: &Receiver, direction: DVec3) -> f64 {
    match *receiver {
        Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
        Receiver::Transmissive(normal) => normal.as_dvec3().dot(direction).abs(),
        Receiver::Volume => 1.0,
        Receiver::Glossy(surface) => glossy(&surface, direction),
        Receiver::Microfacet(surface) => microfacets(&surface, direction),
        Receiver::Scattering(medium) => {
            let (g, cosine) = (f64::from(medium.asymmetry()), medium.outgoing().as_dvec3().dot(direction));
            (1.0 - g * g) / (1.0 + g * g + 2.0 * g * cosine).powf(1.5)
        }
        _ => panic!("the oracle does not know this receiver"),
    }
}

/// `π f cos θ` of a diffuse base and a GGX lobe, as Walter et al. 2007 and Heitz 2014 have it, by Smith's Λ.
fn glossy(surface: &Glossy, direction: DVec3) -> f64 {
    let (n, o) = (surface.normal().as_dvec3(), surface.outgoing().as_dvec3());
    let (cos_i, cos_o) = (n.dot(direction), n.dot(o));
    if cos_i <= 0.0 {
        return 0.0;
    }
    let alpha2 = f64::from(surface.roughness()).powi(2);
    let [kd, ks] = surface.weights().map(f64::from);
    let h = direction + o;
    let (sin2, cos2) = (n.cross(h).length_squared() / h.length_squared(), n.dot(h).powi(2) / h.length_squared());
    // π D, where D cos² is the density of slopes.
    let distribution = alpha2 / (cos2 * alpha2 + sin2).powi(2);
    let lambda = |cos: f64| 0.5 * ((1.0 + alpha2 * (1.0 - cos * cos).max(0.0) / (cos * cos)).sqrt() - 1.0);
    let masking = 1.0 / (1.0 + lambda(cos_i) + lambda(cos_o));
    kd * cos_i + ks * distribution * masking / (4.0 * cos_o)
}

/// `π f |cos θ|` of a diffuse base, a reflection and a transmission, as Walter et al. 2007 (with the index on the side
/// of the light squared) and Heitz 2014 have it, by Smith's Λ.
fn microfacets(surface: &Microfacet, direction: DVec3) -> f64 {
    let (n, t) = (surface.normal().as_dvec3(), surface.tangent().as_dvec3());
    let local = |v: DVec3| DVec3::new(t.dot(v), n.cross(t).dot(v), n.dot(v));
    let (o, i) = (local(surface.outgoing().as_dvec3()), local(direction));
    let [x2, y2] = surface.roughness().map(|alpha| f64::from(alpha).powi(2));
    let [kd, ks, kt] = surface.weights().map(f64::from);
    let ior = f64::from(surface.ior());
    // π D, where D cos² is the density of slopes.
    let distribution = |h: DVec3| 1.0 / ((x2 * y2).sqrt() * (h.x * h.x / x2 + h.y * h.y / y2 + h.z * h.z).powi(2));
    let lambda = |v: DVec3| 0.5 * ((1.0 + (x2 * v.x * v.x + y2 * v.y * v.y) / (v.z * v.z)).sqrt() - 1.0);
    let masking = 1.0 / (1.0 + lambda(i) + lambda(o));
    let reflected = |i: DVec3| distribution((i + o).normalize()) * masking / (4.0 * o.z);
    if i.z > 0.0 {
        return kd * i.z + ks * reflected(i);
    }
    if kt == 0.0 || i.z == 0.0 {
        return 0.0;
    }
    if ior == 1.0 {
        return kt * reflected(i * DVec3::new(1.0, 1.0, -1.0));
    }
    let sum = o + ior * i;
    let h = if sum.z < 0.0 { -sum.normalize() } else { sum.normalize() };
    if h.dot(o) <= 0.0 || h.dot(i) >= 0.0 {
        return 0.0;
    }
    let jacobian = ior * ior * (h.dot(o) * h.dot(i)).abs() / (h.dot(o) + ior * h.dot(i)).powi(2);
    kt * distribution(h) * masking * jacobian / o.z
}

fn wrapped(wrap: Wrap, index: i64, n: usize) -> usize {
    let n = n as i64;
    let index = match wrap {
        Wrap::Repeat => index.rem_euclid(n),
        Wrap::Clamp => index.clamp(0, n - 1),
        Wrap::Mirror if index.div_euclid(n) % 2 == 0 => index.rem_euclid(n),
        Wrap::Mirror => n - 1 - index.rem_euclid(n),
    };
    index as usize
}

pub(crate) fn look_up(image: &Image, uv: DVec2) -> f64 {
    let [w, h] = image.size;
    let fetch =
        |i: i64, j: i64| f64::from(image.texels[wrapped(image.wrap[1], j, h) * w + wrapped(image.wrap[0], i, w)]);
    let (x, y) = (uv.x * w as f64, uv.y * h as f64);
    match image.filter {
        Filter::Nearest => fetch(x.floor() as i64, y.floor() as i64),
        Filter::Bilinear => {
            let (x, y) = (x - 0.5, y - 0.5);
            let (i, j) = (x.floor() as i64, y.floor() as i64);
            let (fx, fy) = (x - x.floor(), y - y.floor());
            (fetch(i, j) * (1.0 - fx) + fetch(i + 1, j) * fx) * (1.0 - fy)
                + (fetch(i, j + 1) * (1.0 - fx) + fetch(i + 1, j + 1) * fx) * fy
        }
    }
}

/// Weight of a mesh at a point of one of its triangles.
pub(crate) fn weight(scene: &Scene, mesh: &LightMesh, triangle: usize, [b1, b2]: [f64; 2]) -> f64 {
    match mesh.paint {
        Paint::Constant(value) => f64::from(value),
        Paint::Image(image) => {
            let [a, b, c] = mesh.corner_uvs(triangle).map(|uv| uv.as_dvec2());
            look_up(&scene.images[image], a * (1.0 - b1 - b2) + b * b1 + c * b2)
        }
    }
}

/// Radiance of the environment along a unit direction, from the source image.
pub(crate) fn radiance(scene: &Scene, direction: DVec3) -> f64 {
    match &scene.sky {
        Sky::Constant(radiance) => f64::from(*radiance),
        Sky::LatLong { size: [w, h], texels } => {
            let local = scene.rotation.as_dmat3().transpose() * direction;
            let turns = (-local.y).atan2(local.x) / core::f64::consts::TAU;
            let u = turns - turns.floor();
            let v = local.z.clamp(-1.0, 1.0).acos() / core::f64::consts::PI;
            let (i, j) = ((u * *w as f64) as usize, (v * *h as f64) as usize);
            f64::from(texels[j.min(h - 1) * w + i.min(w - 1)])
        }
    }
}

/// Where a ray from the origin crosses a triangle with these vertices.
pub(crate) fn intersect([a, b, c]: [DVec3; 3], direction: DVec3) -> Option<[f64; 2]> {
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(direction);
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let p = direction * t;
    let area2 = normal.length_squared();
    let b1 = normal.dot((c - a).cross(a - p)) / area2;
    let b2 = normal.dot((a - p).cross(b - a)) / area2;
    // Signed areas of the parts next to p.
    (b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0).then_some([b1, b2])
}

/// Whether light leaves a triangle, at this place relative to the shading point, towards it.
pub(crate) fn sends([a, b, c]: [DVec3; 3], mesh: &LightMesh) -> bool {
    mesh.two_sided || (b - a).cross(c - a).dot(a) < 0.0
}

pub(crate) fn relative(mesh: &LightMesh, triangle: usize, x: &ShadingPoint) -> [DVec3; 3] {
    mesh.vertices(triangle).map(|v| v.as_dvec3() - x.position.as_dvec3())
}

/// Radiance that arrives along a direction through all portals that it crosses: the sky times their transmittances.
/// A direction through no portal is dark.
pub(crate) fn through_portals(scene: &Scene, x: &ShadingPoint, direction: DVec3) -> f64 {
    let mut transmittance = None;
    for mesh in scene.meshes.iter().filter(|mesh| mesh.portal) {
        for triangle in 0..mesh.indices.len() {
            let vertices = relative(mesh, triangle, x);
            if let Some(b) = intersect(vertices, direction).filter(|_| sends(vertices, mesh)) {
                *transmittance.get_or_insert(1.0) *= weight(scene, mesh, triangle, b);
                break;
            }
        }
    }
    transmittance.map_or(0.0, |transmittance| transmittance * radiance(scene, direction))
}

/// Even points of the unit square.
fn even_points(count: usize) -> impl Iterator<Item = [f64; 2]> {
    let steps = [1.0 / GOLDEN, 1.0 / (GOLDEN * GOLDEN)];
    (0..count).map(move |i| steps.map(|step| (0.5 + step * i as f64).fract()))
}

/// Integral over the triangles of the lights, or of one mesh, of what `along` says that arrives from a direction times
/// the cosine at the shading point, with `count` points in all. `along` gets mesh, triangle, barycentrics, direction.
pub(crate) fn over_lights(
    scene: &Scene,
    x: &ShadingPoint,
    only: Option<usize>,
    count: usize,
    along: &dyn Fn(usize, usize, [f64; 2], DVec3) -> f64,
) -> f64 {
    let mut parts = Vec::new();
    for (m, triangle) in scene.triangles().filter(|(m, _)| only.is_none_or(|only| only == *m)) {
        let vertices = relative(&scene.meshes[m], triangle, x);
        if sends(vertices, &scene.meshes[m]) {
            let whole = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            cut(&x.receiver, vertices, whole, 0, &mut |corners| parts.push((m, triangle, corners)));
        }
    }
    let count = count.div_ceil(parts.len().max(1));
    let mut total = 0.0;
    for (m, triangle, [o, p1, p2]) in parts {
        let [a, b, c] = relative(&scene.meshes[m], triangle, x);
        let cross = (b - a).cross(c - a);
        // The square of the ratio of an edge to the whole triangle's.
        let share = ((p1[0] - o[0]) * (p2[1] - o[1]) - (p1[1] - o[1]) * (p2[0] - o[0])).abs();
        let mut sum = 0.0;
        for [u, v] in even_points(count) {
            // Heitz's map, which is continuous.
            let [s, t] = if v > u { [0.5 * u, v - 0.5 * u] } else { [u - 0.5 * v, 0.5 * v] };
            let [b1, b2] = [0, 1].map(|i| o[i] + (p1[i] - o[i]) * s + (p2[i] - o[i]) * t);
            let p = a + (b - a) * b1 + (c - a) * b2;
            let d2 = p.length_squared();
            let direction = p / d2.sqrt();
            let cos = cosine(&x.receiver, direction);
            if cos > 0.0 {
                sum += cos * along(m, triangle, [b1, b2], direction) * 0.5 * cross.dot(direction).abs() / d2;
            }
        }
        total += share * sum / count as f64;
    }
    total
}

/// Cuts a triangle into parts that are small against their distance, given by their barycentric corners, and leaves
/// out those below the horizon. What the horizon crosses is cut further, as so little of it may count.
fn cut(
    receiver: &Receiver,
    vertices: [DVec3; 3],
    corners: [[f64; 2]; 3],
    depth: u32,
    visit: &mut impl FnMut([[f64; 2]; 3]),
) {
    let [a, b, c] = vertices;
    let mut above = 3;
    let normal = match *receiver {
        Receiver::Surface(normal) => Some(normal),
        Receiver::Glossy(surface) => Some(surface.normal()),
        Receiver::Microfacet(surface) if surface.weights()[2] == 0.0 => Some(surface.normal()),
        _ => None,
    };
    if let Some(normal) = normal {
        above = vertices.iter().filter(|v| normal.as_dvec3().dot(**v) > 0.0).count();
    }
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let is_near = depth < 9 && longest >= (a + b + c).length() / 3.0;
    match above {
        0 => return,
        3 if !is_near => return visit(corners),
        1 | 2 if !is_near && depth >= 6 => return visit(corners),
        _ => {}
    }
    let [p, q, r] = corners;
    let half = |p: [f64; 2], q: [f64; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    let (pq, qr, rp) = (half(p, q), half(q, r), half(r, p));
    cut(receiver, [a, ab, ca], [p, pq, rp], depth + 1, visit);
    cut(receiver, [ab, b, bc], [pq, q, qr], depth + 1, visit);
    cut(receiver, [ca, bc, c], [rp, qr, r], depth + 1, visit);
    cut(receiver, [bc, ca, ab], [qr, rp, pq], depth + 1, visit);
}

/// What a point of a light sends: its weight, of a portal times the sky behind it.
pub(crate) fn sent(scene: &Scene, mesh: usize, triangle: usize, b: [f64; 2], direction: DVec3) -> f64 {
    let sky = if scene.meshes[mesh].portal { radiance(scene, direction) } else { 1.0 };
    sky * weight(scene, &scene.meshes[mesh], triangle, b)
}

/// Integral over the directions to all lit pixels of the sky of what `along` says that arrives times the cosine at
/// the shading point, with `count` points in all.
pub(crate) fn over_pixels(scene: &Scene, x: &ShadingPoint, count: usize, along: &dyn Fn(DVec3) -> f64) -> f64 {
    let Sky::LatLong { size: [w, h], texels } = &scene.sky else { panic!("the sky has no pixels") };
    let lit = texels.iter().filter(|value| **value > 0.0).count();
    let (w, count) = (*w, count.div_ceil(lit));
    let pi = core::f64::consts::PI;
    let mut total = 0.0;
    for (pixel, _) in texels.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let (i, j) = ((pixel % w) as f64, (pixel / w) as f64);
        let (top, bottom) = ((pi * j / *h as f64).cos(), (pi * (j + 1.0) / *h as f64).cos());
        let mut sum = 0.0;
        for [u, v] in even_points(count) {
            let z = top + (bottom - top) * v;
            let (sin, cos) = (2.0 * pi * (i + u) / w as f64).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let direction = scene.rotation.as_dmat3() * DVec3::new(r * cos, -r * sin, z);
            let cos = cosine(&x.receiver, direction);
            if cos > 0.0 {
                sum += cos * along(direction);
            }
        }
        total += sum / count as f64 * (top - bottom) * 2.0 * pi / w as f64;
    }
    total
}

/// What plain lights bring along a direction: each portal that it crosses counts, one by one.
pub(crate) fn sum_of_portals(scene: &Scene, x: &ShadingPoint, direction: DVec3) -> f64 {
    let mut sum = 0.0;
    for (m, triangle) in scene.triangles() {
        let mesh = &scene.meshes[m];
        let vertices = relative(mesh, triangle, x);
        if let Some(b) = intersect(vertices, direction).filter(|_| mesh.portal && sends(vertices, mesh)) {
            sum += weight(scene, mesh, triangle, b);
        }
    }
    sum * radiance(scene, direction)
}

/// Doubles the number of points until the result changes by less than `tolerance`, relatively. Returns it with its
/// last change.
pub(crate) fn converged(tolerance: f64, integral: impl Fn(usize) -> f64) -> (f64, f64) {
    let mut count = 1 << 15;
    let mut before = integral(count);
    loop {
        count *= 2;
        let now = integral(count);
        let change = (now - before).abs();
        // The sequence is even, but one doubling may agree by chance: none counts before the third.
        if (change <= tolerance * now && count >= 1 << 18) || count >= 1 << 24 {
            return (now, change);
        }
        before = now;
    }
}
