//! Whether any ray meets at most one light that shines back along it. Then the density of a sample is that of its
//! direction, and nothing else along the ray need be looked for.
//!
//! Two arrangements are recognized: lights side by side in one plane, and lights on the surface of one convex body that
//! all face into it, such as the windows of a room. A ray leaves a convex body once. Lamps without an extent are never
//! crossed.

use alloc::vec::Vec;

use glam::DVec3;

use super::{Extras, Light, LightKind, LightTriangle, Lights};
use crate::math::sqrt64;

/// Most planes that lights may lie in. *Chosen*: a room has six.
///
/// Larger: a build compares each light with more planes before it gives up. Smaller: bodies of many faces are not
/// recognized.
const MAX_PLANES: usize = 64;

/// Most triangles that are looked at where some belong to instances. *Chosen*: a wall of 10,000 windows, several times.
///
/// Larger: builds and refits of walls of many instances take longer; lights in more than [`MAX_PLANES`] planes are soon
/// found to be. Smaller: walls with more windows are not recognized.
const MOST_PLACED: usize = 1 << 16;

/// Largest distance of a vertex from a plane that it counts as lying in, relative to the coordinates of both. *Chosen*:
/// rounding to `f32` moves a vertex by at most 1.04e-7 of them (√3 · 2⁻²⁴). A ray that meets two lights of what counts
/// as one plane runs along both, at an angle of at most this distance over their size.
///
/// Larger: lights would count as one plane that are not. Smaller: a turned wall would not, as its vertices are rounded.
const PLANE_ROUNDING: f64 = 2.5e-7;

/// Largest overlap of two lights in one plane that counts as none, relative to the smaller one. *Chosen*: its share of
/// the light is below the rounding of a density.
///
/// Larger: overlaps would be ignored. Smaller: neighbors with rounded vertices would count as overlapping.
const OVERLAP_ROUNDING: f64 = 1e-6;

/// Most pairs of lights that are compared, for each light. *Chosen*: in a wall of n by n windows, a light is compared
/// with about n others of its column.
///
/// Larger: builds of large walls take longer; with 256, up to half a second for a million lights. Smaller: large walls
/// are not recognized.
const MAX_PAIRS: usize = 256;

/// A plane that lights lie in.
struct Plane {
    /// A point of the first light that was found in it.
    origin: DVec3,
    /// Unit normal of that light's front side.
    normal: DVec3,
    /// Largest coordinate of that light.
    extent: f64,
    /// Whether there are lights to both of its sides.
    is_two_sided: bool,
}

impl Plane {
    /// Returns the plane of a light, or `None` where the light has no area.
    fn new(light: &LightTriangle) -> Option<Self> {
        let triangle = light.triangle();
        let normal = triangle.double_area_vector().try_normalize()?;
        let origin = triangle.0[0].as_dvec3();
        Some(Self { origin, normal, extent: extent(light), is_two_sided: light.is_two_sided() })
    }

    /// Returns the least and the largest height of a light over the plane, and what rounding may do to them.
    fn heights(&self, light: &LightTriangle) -> [f64; 3] {
        let [a, b, c] = light.triangle().0.map(|vertex| self.normal.dot(vertex.as_dvec3() - self.origin));
        [a.min(b).min(c), a.max(b).max(c), PLANE_ROUNDING * (self.extent + extent(light))]
    }

    fn holds(&self, light: &LightTriangle) -> bool {
        let [low, high, rounding] = self.heights(light);
        low >= -rounding && high <= rounding
    }

    /// Whether a light is nowhere behind the plane.
    fn is_in_front(&self, light: &LightTriangle) -> bool {
        let [low, _, rounding] = self.heights(light);
        low >= -rounding
    }
}

/// Returns the largest coordinate of a light.
fn extent(light: &LightTriangle) -> f64 {
    light.vertices.as_flattened().iter().fold(0.0, |extent: f32, x| extent.max(x.abs())).into()
}

impl Lights {
    /// Finds out whether a ray meets at most one light that shines back along it.
    pub(crate) fn find_crossings(&mut self) {
        // What moves may cross what it does not cross at either end.
        self.is_crossed_once = if !self.view().extras().motion().is_empty() {
            false
        } else if self.has_lamps || !self.instances.is_empty() {
            self.is_mixture_crossed_once()
        } else {
            is_crossed_once(&self.records)
        };
    }

    /// Whether a ray meets at most one of lights among which are lamps or instances.
    fn is_mixture_crossed_once(&self) -> bool {
        let (mut triangles, mut planes) = (Vec::new(), Planes::default());
        for record in &self.records {
            let first = triangles.len();
            match Light::of(record, Extras::NONE, &self.instances, 0.0) {
                Light::Triangle(triangle) => triangles.push(*triangle),
                Light::Lamp(lamp) if lamp.record.has_extent() => return false,
                Light::Lamp(_) => {}
                Light::Moving(_) => return false,
                Light::Instance(placed) => {
                    if triangles.len() + placed.object.len() > MOST_PLACED {
                        return false;
                    }
                    triangles.extend(placed.flattened());
                }
            }
            if !triangles[first..].iter().all(|triangle| planes.add(triangle)) {
                return false;
            }
        }
        planes.are_crossed_once(&triangles)
    }
}

/// Whether a ray meets at most one light that shines back along it, as far as the recognized arrangements go.
fn is_crossed_once(lights: &[LightTriangle]) -> bool {
    let mut planes = Planes::default();
    lights.iter().all(|light| planes.add(light)) && planes.are_crossed_once(lights)
}

/// Planes that lights lie in.
#[derive(Default)]
struct Planes {
    planes: Vec<Plane>,
    /// The plane of each light.
    numbers: Vec<usize>,
}

impl Planes {
    /// Adds a light. Returns whether it has a plane, among no more than there may be.
    fn add(&mut self, light: &LightTriangle) -> bool {
        let Some(own) = Plane::new(light) else { return false };
        let number = self.planes.iter().position(|plane| plane.holds(light)).unwrap_or(self.planes.len());
        self.numbers.push(number);
        match self.planes.get_mut(number) {
            Some(plane) => plane.is_two_sided |= own.is_two_sided || plane.normal.dot(own.normal) < 0.0,
            None if number == MAX_PLANES => return false,
            None => self.planes.push(own),
        }
        true
    }

    /// Whether a ray meets at most one of all lights that were added.
    fn are_crossed_once(self, lights: &[LightTriangle]) -> bool {
        let members = self.numbers.into_iter().zip(lights).collect();
        is_convex(&self.planes, lights) && are_apart(&self.planes, members)
    }
}

/// Whether all lights face into one convex body, or lie in one plane.
fn is_convex(planes: &[Plane], lights: &[LightTriangle]) -> bool {
    let is_face = |plane: &Plane| !plane.is_two_sided && lights.iter().all(|light| plane.is_in_front(light));
    planes.len() <= 1 || planes.iter().all(is_face)
}

/// A light in the coordinates of its plane.
struct FlatFace {
    plane: usize,
    vertices: [[f64; 2]; 3],
    low: [f64; 2],
    high: [f64; 2],
}

impl FlatFace {
    /// Leaves out the axis along which the plane's normal is largest.
    fn new(plane: usize, normal: DVec3, light: &LightTriangle) -> Self {
        let size = normal.abs();
        let axes = if size.x >= size.y.max(size.z) {
            [1, 2]
        } else if size.y >= size.z {
            [0, 2]
        } else {
            [0, 1]
        };
        let vertices = light.vertices.map(|vertex| axes.map(|axis| f64::from(vertex[axis])));
        let end = |of: fn(f64, f64) -> f64| [0, 1].map(|k| of(of(vertices[0][k], vertices[1][k]), vertices[2][k]));
        Self { plane, vertices, low: end(f64::min), high: end(f64::max) }
    }

    fn size(&self) -> f64 {
        (self.high[0] - self.low[0]).max(self.high[1] - self.low[1])
    }

    /// Whether no more of two lights overlaps than rounding may have caused: one of their edges separates them.
    fn is_apart(&self, other: &Self) -> bool {
        let most = OVERLAP_ROUNDING * self.size().min(other.size());
        self.has_beyond_an_edge(other, most) || other.has_beyond_an_edge(self, most)
    }

    /// Whether another light is on the outer side of one of the edges, up to `most` within.
    fn has_beyond_an_edge(&self, other: &Self, most: f64) -> bool {
        (0..3).any(|i| {
            let [a, b, c] = [0, 1, 2].map(|k| self.vertices[(i + k) % 3]);
            let edge = [b[0] - a[0], b[1] - a[1]];
            let inside = |p: [f64; 2]| edge[0] * (p[1] - a[1]) - edge[1] * (p[0] - a[0]);
            let (sign, length) = (inside(c).signum(), sqrt64(edge[0] * edge[0] + edge[1] * edge[1]));
            other.vertices.iter().all(|&p| sign * inside(p) <= most * length)
        })
    }
}

/// Whether no two lights of one plane overlap. Sweeps across each plane along its first axis.
fn are_apart(planes: &[Plane], members: Vec<(usize, &LightTriangle)>) -> bool {
    let flat = |(plane, light): (usize, &LightTriangle)| FlatFace::new(plane, planes[plane].normal, light);
    let mut faces: Vec<FlatFace> = members.into_iter().map(flat).collect();
    faces.sort_unstable_by(|a, b| {
        (a.plane, a.low[0]).partial_cmp(&(b.plane, b.low[0])).unwrap_or(core::cmp::Ordering::Equal)
    });
    let mut left = MAX_PAIRS * faces.len();
    for (i, face) in faces.iter().enumerate() {
        let is_near = |other: &&FlatFace| other.plane == face.plane && other.low[0] < face.high[0];
        for other in faces[i + 1..].iter().take_while(is_near) {
            if left == 0 {
                return false;
            }
            left -= 1;
            let share = [0, 1].iter().all(|&k| other.low[k] < face.high[k] && face.low[k] < other.high[k]);
            if share && !face.is_apart(other) {
                return false;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests;
