//! Integrals over planar polygons that are seen from the origin.

use glam::{DVec2, DVec3};

/// A corner of a polygon: its place relative to the shading point, and in the patch of a texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) place: DVec3,
    pub(crate) patch: DVec2,
}

impl Corner {
    fn mix(&self, other: &Self, t: f64) -> Self {
        Self { place: self.place.lerp(other.place, t), patch: self.patch.lerp(other.patch, t) }
    }
}

/// Edge over distance up to which one rule of degree 2 or 5 is exact enough.
const SMALL: f64 = 0.05;
const MEDIUM: f64 = 0.4;
const MAX_DEPTH: u32 = 48;

/// The part of a polygon where `side` is not negative; `side` is linear.
pub(crate) fn clip(polygon: &[Corner], side: impl Fn(&Corner) -> f64) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, corner) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (at, then) = (side(corner), side(next));
        if at >= 0.0 {
            kept.push(*corner);
        }
        if (at >= 0.0) != (then >= 0.0) {
            kept.push(corner.mix(next, at / (at - then)));
        }
    }
    kept
}

/// Integral over the area of a convex polygon. `f` is smooth on the scale of the distance from the origin.
pub(crate) fn integrate(polygon: &[Corner], f: &impl Fn(&Corner) -> f64) -> f64 {
    (2..polygon.len()).map(|i| triangle([polygon[0], polygon[i - 1], polygon[i]], f, 0)).sum()
}

fn triangle(corners: [Corner; 3], f: &impl Fn(&Corner) -> f64, depth: u32) -> f64 {
    let [a, b, c] = corners;
    let lengths = [(b, c), (c, a), (a, b)].map(|(p, q)| p.place.distance_squared(q.place));
    let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
    let center = (a.place + b.place + c.place) / 3.0;
    let ratio2 = lengths[longest] / center.length_squared();
    if ratio2 > MEDIUM * MEDIUM && depth < MAX_DEPTH {
        let (top, left, right) = (corners[longest], corners[(longest + 1) % 3], corners[(longest + 2) % 3]);
        let middle = left.mix(&right, 0.5);
        return triangle([top, left, middle], f, depth + 1) + triangle([top, middle, right], f, depth + 1);
    }
    let area = 0.5 * (b.place - a.place).cross(c.place - a.place).length();
    area * if ratio2 < SMALL * SMALL { degree_2(&corners, f) } else { degree_5(&corners, f) }
}

/// Mean by the midpoints of the edges.
fn degree_2([a, b, c]: &[Corner; 3], f: &impl Fn(&Corner) -> f64) -> f64 {
    (f(&a.mix(b, 0.5)) + f(&b.mix(c, 0.5)) + f(&c.mix(a, 0.5))) / 3.0
}

/// Mean by Radon's rule of seven points.
fn degree_5([a, b, c]: &[Corner; 3], f: &impl Fn(&Corner) -> f64) -> f64 {
    let root = 15.0_f64.sqrt();
    let at = |t: f64, p: &Corner, q: &Corner, r: &Corner| {
        // Weight 1 - 2t for p, t for q and r.
        let place = p.place * (1.0 - 2.0 * t) + (q.place + r.place) * t;
        let patch = p.patch * (1.0 - 2.0 * t) + (q.patch + r.patch) * t;
        f(&Corner { place, patch })
    };
    let orbit = |t: f64| at(t, a, b, c) + at(t, b, c, a) + at(t, c, a, b);
    9.0 / 40.0 * at(1.0 / 3.0, a, b, c)
        + (155.0 - root) / 1200.0 * orbit((6.0 - root) / 21.0)
        + (155.0 + root) / 1200.0 * orbit((6.0 + root) / 21.0)
}
