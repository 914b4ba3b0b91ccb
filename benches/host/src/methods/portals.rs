//! Rectangular windows, chosen by chance, and any direction through them.

use glam::{Vec2, Vec3, vec2};

use super::spherical_rectangle::SphericalRectangle;
use crate::geometry::Rectangle;
use crate::random::Pcg32;
use crate::world::World;

/// The windows of one wall.
#[derive(Clone, Debug)]
struct Wall {
    /// Unit normal to the room.
    normal: Vec3,
    offset: f32,
    /// Axes of the wall.
    axes: [Vec3; 2],
    /// Corners of each window in these axes, and its number.
    windows: Vec<([Vec2; 2], usize)>,
}

/// All windows of a scene.
#[derive(Clone, Debug)]
pub(super) struct RectanglePortals {
    rectangles: Vec<Rectangle>,
    walls: Vec<Wall>,
}

impl RectanglePortals {
    /// Collects the windows. `None` if there is none, or one that is not a rectangle.
    pub(super) fn new(world: &World) -> Option<Self> {
        let rectangles: Vec<Rectangle> =
            world.scene.portals.iter().map(|portal| portal.rectangle).collect::<Option<_>>()?;
        let mut walls: Vec<Wall> = Vec::new();
        for (number, rectangle) in rectangles.iter().enumerate() {
            let normal = rectangle.normal();
            let offset = normal.dot(rectangle.corner);
            let known = walls
                .iter()
                .position(|wall| wall.normal.distance(normal) < 1e-5 && (wall.offset - offset).abs() < 1e-5);
            let known = known.unwrap_or_else(|| {
                let axes = rectangle.sides.map(Vec3::normalize);
                walls.push(Wall { normal, offset, axes, windows: Vec::new() });
                walls.len() - 1
            });
            let wall = &mut walls[known];
            let [a, b] = [rectangle.corner, rectangle.corner + rectangle.sides[0] + rectangle.sides[1]];
            let [a, b] = [a, b].map(|point| wall.place(point));
            wall.windows.push(([a.min(b), a.max(b)], number));
        }
        (!rectangles.is_empty()).then_some(Self { rectangles, walls })
    }

    /// Draws a direction through a window; returns it and its density per solid angle, over all windows.
    #[inline]
    pub(super) fn sample(&self, position: Vec3, random: &mut Pcg32) -> Option<(Vec3, f32)> {
        let number = ((random.uniform() * self.rectangles.len() as f32) as usize).min(self.rectangles.len() - 1);
        let rectangle = &self.rectangles[number];
        if rectangle.sides[0].cross(rectangle.sides[1]).dot(position - rectangle.corner) <= 0.0 {
            return None;
        }
        let spherical = SphericalRectangle::new(rectangle, position)?;
        let direction = spherical.direction(random.uniform2());
        let own = self.chance() / spherical.solid_angle() as f32;
        Some((direction, own + self.pdf_except(position, direction, Some(number))))
    }

    /// Returns the density per solid angle of a direction.
    #[inline]
    pub(super) fn pdf(&self, position: Vec3, direction: Vec3) -> f32 {
        self.pdf_except(position, direction, None)
    }

    /// Sums the densities of a direction through all windows that it crosses, but for one.
    #[inline]
    fn pdf_except(&self, position: Vec3, direction: Vec3, except: Option<usize>) -> f32 {
        let mut sum = 0.0;
        for wall in &self.walls {
            let (height, slope) = (wall.normal.dot(position) - wall.offset, -wall.normal.dot(direction));
            if height <= 0.0 || slope <= 0.0 {
                continue;
            }
            let place = wall.place(position + direction * (height / slope));
            for &([low, high], number) in &wall.windows {
                if place.cmpge(low).all() && place.cmple(high).all() && Some(number) != except {
                    let spherical = SphericalRectangle::new(&self.rectangles[number], position);
                    sum += spherical.map_or(0.0, |seen| self.chance() / seen.solid_angle() as f32);
                }
            }
        }
        sum
    }

    /// Probability of each window.
    fn chance(&self) -> f32 {
        1.0 / self.rectangles.len() as f32
    }
}

impl Wall {
    /// Returns the coordinates of a point of the wall.
    fn place(&self, point: Vec3) -> Vec2 {
        vec2(self.axes[0].dot(point), self.axes[1].dot(point))
    }
}
