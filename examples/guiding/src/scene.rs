//! Three rooms in a row. A door leads from the first to the second; the third is closed, and its lamps are the
//! brightest.

use fanlight::glam::{Vec3, vec3};
use fanlight::{Error, LightSampler, Mesh, Weight};

/// Extent of the three rooms.
pub(crate) const SIZE: Vec3 = vec3(12.0, 4.0, 3.0);
/// Extent of the room that the image shows.
pub(crate) const ROOM: [f32; 2] = [4.0, 4.0];
/// How much of the light walls reflect.
pub(crate) const ALBEDO: f32 = 0.6;
/// Side of a lamp.
const LAMP: f32 = 0.3;

/// A rectangle between two corners that agree in one coordinate. Walls have two sides, lamps shine downwards.
struct Rectangle {
    low: Vec3,
    high: Vec3,
    radiance: f32,
}

/// What a ray meets.
pub(crate) struct Hit {
    pub(crate) position: Vec3,
    /// Towards where the ray came from.
    pub(crate) normal: Vec3,
    /// Radiance that arrives from there.
    pub(crate) radiance: f32,
}

pub(crate) struct Scene {
    rectangles: Vec<Rectangle>,
}

impl Scene {
    pub(crate) fn new() -> Self {
        let wall = |low: [f32; 3], high: [f32; 3]| Rectangle { low: low.into(), high: high.into(), radiance: 0.0 };
        let [x, y, z] = SIZE.to_array();
        let mut rectangles = vec![
            wall([0.0; 3], [x, y, 0.0]),
            wall([0.0, 0.0, z], [x, y, z]),
            wall([0.0; 3], [x, 0.0, z]),
            wall([0.0, y, 0.0], [x, y, z]),
            wall([0.0; 3], [0.0, y, z]),
            wall([x, 0.0, 0.0], [x, y, z]),
            wall([8.0, 0.0, 0.0], [8.0, y, z]),
            // Around the door.
            wall([4.0, 0.0, 0.0], [4.0, 1.5, z]),
            wall([4.0, 2.5, 0.0], [4.0, y, z]),
            wall([4.0, 1.5, 2.1], [4.0, 2.5, z]),
        ];
        for (room, radiance) in [(4.0, 10.0), (8.0, 100.0)] {
            for i in 0..9_u8 {
                let [column, row] = [i % 3, i / 3].map(|i| 0.7 + 1.2 * f32::from(i));
                let low = vec3(room + column, row, z - 0.05);
                rectangles.push(Rectangle { low, high: low + vec3(LAMP, LAMP, 0.0), radiance });
            }
        }
        Self { rectangles }
    }

    /// Passes the lamps to the sampler.
    pub(crate) fn lights(&self) -> Result<LightSampler, Error> {
        let mut builder = LightSampler::builder();
        for Rectangle { low, high, radiance } in self.rectangles.iter().filter(|rectangle| rectangle.radiance > 0.0) {
            let corners = [*low, vec3(low.x, high.y, low.z), *high, vec3(high.x, low.y, low.z)];
            let lamp = Mesh::emitter(&corners, &[[0, 1, 2], [0, 2, 3]]).weight(Weight::Constant(*radiance));
            builder.add_mesh(&lamp)?;
        }
        builder.build()
    }

    /// The nearest rectangle along a ray.
    pub(crate) fn trace(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let distance = |rectangle: &Rectangle| {
            let axis = (rectangle.high - rectangle.low).min_position();
            let distance = (rectangle.low[axis] - origin[axis]) / direction[axis];
            let mut at = origin + distance * direction;
            at[axis] = rectangle.low[axis];
            let is_inside = at.cmpge(rectangle.low).all() && at.cmple(rectangle.high).all();
            (distance > 1e-4 && is_inside).then_some((distance, axis, at, rectangle.radiance))
        };
        let (_, axis, at, radiance) = self.rectangles.iter().filter_map(distance).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let normal = -Vec3::AXES[axis] * direction[axis].signum();
        let radiance = if direction.z > 0.0 { radiance } else { 0.0 };
        Some(Hit { position: at, normal, radiance })
    }

    /// Whether nothing is between two points.
    pub(crate) fn sees(&self, from: Vec3, to: Vec3) -> bool {
        let hit = self.trace(from, (to - from).normalize());
        hit.is_none_or(|hit| hit.position.distance(from) > to.distance(from) - 1e-3)
    }
}
