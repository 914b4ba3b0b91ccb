//! A textured triangle cut along the patches on which its texture is one bilinear function.

use fanlight::Filter;
use glam::{DVec2, DVec3};

use super::quadrature::{Corner, clip};
use crate::scenes::Light;
use crate::scenes::image::Image;

/// Part of a triangle, with the texture there less the background.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// A convex polygon in world space.
    pub(crate) corners: Vec<Corner>,
    /// Values at the corners of the patch.
    pub(crate) values: [f64; 4],
}

/// A rectangle of texture coordinates with a bilinear value.
struct Patch {
    min: DVec2,
    max: DVec2,
    values: [f64; 4],
}

impl Patch {
    fn is_constant(&self) -> bool {
        self.values.iter().all(|value| *value == self.values[0])
    }
}

/// All pieces of a triangle where the texture differs from the background.
pub(crate) fn pieces(light: &Light, image: &Image) -> Vec<Piece> {
    patches(image).iter().filter_map(|patch| piece(light, patch)).collect()
}

/// Patches that differ from the background, runs of the same constant value in one.
fn patches(image: &Image) -> Vec<Patch> {
    let n = image.size as i64;
    // Patches of a bilinear lookup have their corners at texel centers.
    let (range, shift) = match image.filter {
        Filter::Nearest => (0..n, 0.0),
        Filter::Bilinear => (-1..n, 0.5),
    };
    let edge = |i: i64| ((i as f64 + shift) / n as f64).clamp(0.0, 1.0);
    let mut patches: Vec<Patch> = vec![];
    for y in range.clone() {
        let start = patches.len();
        for x in range.clone() {
            let at = |dx, dy| image.fetch(x + dx, y + dy) - f64::from(image.background);
            let values = match image.filter {
                Filter::Nearest => [at(0, 0); 4],
                Filter::Bilinear => [at(0, 0), at(1, 0), at(0, 1), at(1, 1)],
            };
            let patch = Patch { min: DVec2::new(edge(x), edge(y)), max: DVec2::new(edge(x + 1), edge(y + 1)), values };
            match patches[start..].last_mut() {
                _ if values == [0.0; 4] => {}
                Some(run) if run.is_constant() && run.values == values && run.max.x == patch.min.x => {
                    run.max.x = patch.max.x;
                }
                _ => patches.push(patch),
            }
        }
    }
    patches
}

/// The part of a triangle under a patch.
fn piece(light: &Light, patch: &Patch) -> Option<Piece> {
    let size = patch.max - patch.min;
    let corner = |i: usize| Corner { place: light.vertices[i], patch: (light.uvs[i] - patch.min) / size };
    let mut corners = vec![corner(0), corner(1), corner(2)];
    let axes = [DVec2::X, DVec2::Y];
    for axis in axes {
        corners = clip(&corners, |corner| axis.dot(corner.patch));
        corners = clip(&corners, |corner| 1.0 - axis.dot(corner.patch));
    }
    (corners.len() > 2).then_some(Piece { corners, values: patch.values })
}

impl Piece {
    /// All of a polygon, with the same value everywhere.
    pub(crate) fn constant(vertices: &[DVec3], value: f64) -> Self {
        let corners = vertices.iter().map(|&place| Corner { place, patch: DVec2::ZERO }).collect();
        Self { corners, values: [value; 4] }
    }
}
