//! Rooms that see the sky through openings.

use fanlight::Filter;
use glam::DVec2;

use super::Scene;
use super::image::Image;
use super::wall::{Opening, Wall};

fn wall(side: f64, opening: Opening) -> Wall {
    Wall { y: 0.0, min: DVec2::new(-0.5 * side, 1.5 - 0.5 * side), side, opening }
}

/// One window of 1 x 1 m.
pub(crate) fn window() -> Scene {
    Scene::portals(vec![wall(1.0, Opening::Whole)], None)
}

/// A star that is cut out of a square of 1.5 x 1.5 m.
pub(crate) fn star(filter: Filter) -> Scene {
    Scene::portals(vec![wall(1.5, Opening::Clipped)], Some(Image::star(filter)))
}

/// `k` x `k` openings in a wall of 2 x 2 m.
pub(crate) fn grid(k: usize) -> Scene {
    Scene::portals(vec![wall(2.0, Opening::Grid(k))], None)
}

/// The openings of [`grid`] as one square with a clip map.
pub(crate) fn grid_clip(k: usize) -> Scene {
    let wall = wall(2.0, Opening::Clipped);
    Scene::portals(vec![wall], Some(Image::grid(k)))
}

/// A large opening, and a meter in front of it another wall with one of a tenth of its size. From behind both, only
/// what lies behind both openings is seen.
pub(crate) fn nested() -> Scene {
    let inner = Wall { y: -1.0, ..wall(0.2, Opening::Whole) };
    Scene::portals(vec![wall(2.0, Opening::Whole), inner], None)
}
