//! A wall `y = const` with openings, and which of them a ray passes.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::image::Image;
use super::{LightMesh, Weight};

/// What is open within the rectangle of a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Opening {
    /// All of it: two triangles.
    Whole,
    /// `k` x `k` squares of half their pitch: two triangles each.
    Grid(usize),
    /// Where the scene's image says so: two triangles.
    Clipped,
}

/// A wall, closed outside of its rectangle. The room lies at smaller `y`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    pub(crate) y: f64,
    /// Low corner (x, z) of the rectangle.
    pub(crate) min: DVec2,
    pub(crate) side: f64,
    pub(crate) opening: Opening,
}

impl Wall {
    /// Triangle (counted from the wall's first one) and transmittance where a ray from `x` meets the wall.
    pub(crate) fn meet(&self, x: DVec3, direction: DVec3, image: Option<&Image>) -> Option<(usize, f64)> {
        let t = (self.y - x.y) / direction.y;
        if !(direction.y > 0.0 && t > 0.0) {
            return None;
        }
        let hit = x + direction * t;
        self.at((DVec2::new(hit.x, hit.z) - self.min) / self.side, image)
    }

    /// Triangle and transmittance at a place of the rectangle, in units of its side.
    fn at(&self, place: DVec2, image: Option<&Image>) -> Option<(usize, f64)> {
        if !(0.0..1.0).contains(&place.x) || !(0.0..1.0).contains(&place.y) {
            return None;
        }
        let triangle = |at: DVec2| usize::from(at.y > at.x);
        match self.opening {
            Opening::Whole => Some((triangle(place), 1.0)),
            Opening::Clipped => Some((triangle(place), image?.value(place))),
            Opening::Grid(k) => {
                let at = place * k as f64;
                let inside = (at.fract() - 0.25) * 2.0;
                let cell = at.y as usize * k + at.x as usize;
                let is_open = (0.0..1.0).contains(&inside.x) && (0.0..1.0).contains(&inside.y);
                is_open.then(|| (2 * cell + triangle(inside), 1.0))
            }
        }
    }

    /// The openings as portals that face the room.
    pub(crate) fn mesh(&self) -> LightMesh {
        let weight = if self.opening == Opening::Clipped { Weight::Image } else { Weight::Constant(1.0) };
        let mut mesh = LightMesh { positions: vec![], uvs: vec![], indices: vec![], weight, portal: true };
        let (k, size) = if let Opening::Grid(k) = self.opening { (k, 0.5) } else { (1, 1.0) };
        for cell in 0..k * k {
            let low = DVec2::new((cell % k) as f64, (cell / k) as f64) + 0.5 * (1.0 - size);
            let first = mesh.positions.len() as u32;
            for corner in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
                let place = (low + corner * size) / k as f64;
                let at = self.min + place * self.side;
                mesh.positions.push(Vec3::new(at.x as f32, self.y as f32, at.y as f32));
                mesh.uvs.push(Vec2::new(place.x as f32, place.y as f32));
            }
            mesh.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        mesh
    }
}
