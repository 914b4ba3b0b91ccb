//! Points on emitters from one table for all shading points: what `fanlight` is compared with.
//!
//! Triangles are cut along texels, and all parts stand in one cumulative table (Šik and Křivánek, "Fast Random Sampling
//! of Triangular Meshes", 2013).

use super::alloc::sync::Arc;

use glam::{Vec2, Vec3, vec2};
use smallvec::{SmallVec, smallvec};

use super::lighting::{Aim, Proposal};
use super::model::Model;
use super::scene::Point;
use super::sky::LUMINANCE;

/// A part of a triangle within a texel.
struct Part {
    triangle: usize,
    /// Barycentrics of its corners.
    corners: [Vec2; 3],
}

/// All parts of all emitters.
pub(crate) struct TexelTable {
    parts: Vec<Part>,
    cumulative: Vec<f64>,
    /// Positions of all of the model's triangles.
    triangles: Vec<[Vec3; 3]>,
    /// Density per area of every triangle's texels, in rows; a single one if it has no image.
    densities: Vec<Densities>,
}

/// Densities over a triangle.
struct Densities {
    width: usize,
    /// Densities of all texels per area, shared by all triangles with one image.
    per_area: Arc<[f32]>,
}

impl TexelTable {
    /// Emitters by their area, times the mean radiance of their mesh.
    pub(crate) fn areas(model: &Model) -> Self {
        Self::new(model, false)
    }

    /// Emitters by their texels.
    pub(crate) fn texels(model: &Model) -> Self {
        Self::new(model, true)
    }

    /// Whether there is no emitter.
    pub(crate) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Area of all emitters times their radiance.
    pub(crate) fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    fn new(model: &Model, by_texel: bool) -> Self {
        let mut table = Self { parts: vec![], cumulative: vec![], triangles: vec![], densities: vec![] };
        let mut total = 0.0;
        for mesh in &model.meshes {
            let material = &model.materials[mesh.material];
            let luminance = LUMINANCE.dot(material.emission);
            let bitmap = material.emission_map.filter(|_| material.emits()).map(|map| &model.bitmaps[map]);
            let texels: Vec<f32> = bitmap.map_or_else(
                || vec![luminance],
                |bitmap| bitmap.texels().map(|texel| LUMINANCE.dot(material.emission * texel.truncate())).collect(),
            );
            let mean = texels.iter().sum::<f32>() / texels.len() as f32;
            let (width, per_area): (_, Arc<[f32]>) = match bitmap {
                Some(bitmap) if by_texel => (bitmap.width, texels.into()),
                _ => (1, [mean].into()),
            };
            for corners in &mesh.indices {
                let triangle = table.triangles.len();
                let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
                let uvs = corners.map(|i| mesh.emission_uvs()[i as usize]);
                let area = (b - a).cross(c - a).length();
                for_each_part(uvs, [width, per_area.len() / width], |corners, texel| {
                    let share = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]).abs();
                    let weight = f64::from(0.5 * area * share * per_area[texel]);
                    if weight > 0.0 {
                        total += weight;
                        table.parts.push(Part { triangle, corners });
                        table.cumulative.push(total);
                    }
                });
                table.triangles.push([a, b, c]);
                table.densities.push(Densities { width, per_area: per_area.clone() });
            }
        }
        table
    }

    /// A direction to a point of an emitter.
    pub(crate) fn sample(&self, position: Vec3, [choice, u, v]: [f32; 3]) -> Option<Proposal> {
        let total = *self.cumulative.last()?;
        let number = self.cumulative.partition_point(|&sum| sum <= f64::from(choice) * total);
        let part = &self.parts[number.min(self.parts.len() - 1)];
        let [a, b, c] = part.corners;
        let root = u.sqrt();
        let barycentrics = (1.0 - root) * a + root * (1.0 - v) * b + root * v * c;
        let [p0, p1, p2] = self.triangles[part.triangle];
        let step = p0 + barycentrics.x * (p1 - p0) + barycentrics.y * (p2 - p0) - position;
        let below = number.checked_sub(1).map_or(0.0, |before| self.cumulative[before]);
        let share = (a - c).perp_dot(b - c).abs() * 0.5 * (p1 - p0).cross(p2 - p0).length();
        let pdf_area = (self.cumulative[number.min(self.parts.len() - 1)] - below) / total / f64::from(share);
        let normal = (p1 - p0).cross(p2 - p0).normalize();
        let distance2 = step.length_squared();
        let direction = step / distance2.sqrt();
        let pdf = pdf_area as f32 * distance2 / normal.dot(direction).abs();
        (pdf.is_finite() && pdf > 0.0).then_some(Proposal { direction, pdf, aim: Aim::Point(distance2.sqrt()) })
    }

    /// Density per solid angle of a direction that leads to a point of an emitter.
    pub(crate) fn pdf(&self, direction: Vec3, point: &Point) -> f32 {
        let Densities { width, per_area } = &self.densities[point.triangle];
        let height = per_area.len() / width;
        let index = |place: f32, size: usize| ((place * size as f32) as usize).min(size - 1);
        let texel = per_area[index(point.emission_uv.y, height) * width + index(point.emission_uv.x, *width)];
        let total = self.cumulative.last().copied().unwrap_or(f64::INFINITY);
        let pdf_area = (f64::from(texel) / total) as f32;
        pdf_area * point.distance * point.distance / point.normal.dot(direction).abs()
    }
}

/// Cuts a triangle along the texels of an image that it has once on it; passes on barycentrics and the texel.
fn for_each_part(uvs: [Vec2; 3], [width, height]: [usize; 2], mut each: impl FnMut([Vec2; 3], usize)) {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
    if width * height == 1 {
        return each(corners, 0);
    }
    let size = vec2(width as f32, height as f32);
    let whole: Polygon = core::array::from_fn::<_, 3, _>(|i| (uvs[i] * size, corners[i])).into_iter().collect();
    for y in span(&whole, 1, height) {
        let row = strip(&whole, 1, y);
        for x in span(&row, 0, width) {
            let cell = strip(&row, 0, x);
            for i in 2..cell.len() {
                each([cell[0].1, cell[i - 1].1, cell[i].1], y * width + x);
            }
        }
    }
}

/// Corners: place in texels, and barycentrics.
type Polygon = SmallVec<[(Vec2, Vec2); 8]>;

fn span(polygon: &Polygon, axis: usize, size: usize) -> core::ops::Range<usize> {
    let places = || polygon.iter().map(|corner| corner.0[axis]);
    let (low, high) = (places().fold(f32::INFINITY, f32::min), places().fold(0.0, f32::max));
    if polygon.is_empty() { 0..0 } else { low.floor() as usize..(high.ceil() as usize).min(size) }
}

fn strip(polygon: &Polygon, axis: usize, at: usize) -> Polygon {
    let above = clip(polygon, |place| place[axis] - at as f32);
    clip(&above, |place| (at + 1) as f32 - place[axis])
}

/// Sutherland and Hodgman's clipping, against one line.
fn clip(polygon: &Polygon, height: impl Fn(Vec2) -> f32) -> Polygon {
    let mut clipped: Polygon = smallvec![];
    for (i, &corner) in polygon.iter().enumerate() {
        let next = polygon[(i + 1) % polygon.len()];
        let (a, b) = (height(corner.0), height(next.0));
        if a >= 0.0 {
            clipped.push(corner);
        }
        if (a >= 0.0) != (b >= 0.0) {
            let t = a / (a - b);
            clipped.push((corner.0.lerp(next.0, t), corner.1.lerp(next.1, t)));
        }
    }
    clipped
}
