//! Textured triangles that are near: some of the points are drawn by their directions, as if there were no texture.
//!
//! The cells of a triangle are chosen by what is known of them as a whole. Next to the shading point a cell is seen in
//! many directions, and what it sends is no longer the texture's average times anything: the nearer the triangle, the
//! more of the light comes from a spot that is smaller than any cell. Points drawn by direction find that light
//! whatever its distance, but not the texture. So each gets a share, and the density of a point is that of both. The
//! share of directions grows with the ratio of the triangle's size to its distance, and falls with the texture's
//! contrast.

use super::DrawnPoint;
use super::triangle_view::TriangleView;
use crate::blas::{self, ARITY, Follow, Guide, LEAF, Lattice};
use crate::math::{at_least, at_most, limit};
use crate::warp::{Variate, pick_pair};

/// Ratio of squared radius to squared distance of the center up to which no point is drawn by direction.
///
/// Chosen: a triangle that faces the point has a solid angle of a third there. Larger: more noise from textures that are
/// about even. Smaller: more triangles pay for the question.
const NEAR: f32 = 0.25;

/// Levels of the tree over the texture whose contrast counts. Chosen: those of an image of 512 texels a side.
///
/// Larger: time. Smaller: fine patterns are taken for even.
const LEVELS: usize = 3;

/// What the cells' noise is taken for at a distance of one radius, as a relative variance; it grows with the inverse
/// square. *Measured* (docs/ACCURACY.md, "Near lights").
///
/// Larger: points are drawn by direction where the cells follow the texture well. Smaller: bright spots next to a point
/// are left to noise.
const CELL_NOISE: f32 = 0.01;

/// Share of the cells where the texture's contrast is large, and least share of them. *Measured* as above.
///
/// Larger: what is very near has more noise. Smaller: what is bright and farther away has more.
const CELL_SHARES: [f32; 2] = [0.4, 0.05];

/// Share of directions below which there are none. Chosen: shares are counted from it, so that nothing jumps.
///
/// Larger: fewer points pay for two densities. Smaller: more do that gain next to nothing.
const LEAST_DIRECTION_SHARE: f32 = 0.05;

/// Shares of points that are drawn by direction, and by the cells of the texture.
#[derive(Clone, Copy)]
pub(super) struct NearTexture {
    shares: [f32; 2],
}

impl NearTexture {
    /// Returns the shares at a triangle with a texture; `None` where no point is drawn by direction.
    #[inline]
    pub(super) fn new(view: &TriangleView<'_>) -> Option<Self> {
        let [a, b, c] = view.vertices;
        let center2 = ((a + b + c) * (1.0 / 3.0)).length_squared();
        // NaN fails.
        if !(view.radius2 > NEAR * center2) {
            return None;
        }
        if !view.resolves_directions() {
            return Some(Self { shares: [1.0, 0.0] });
        }
        let (nearest, distance2) = nearest(view);
        let noise = CELL_NOISE * view.radius2 / at_least(distance2, f32::MIN_POSITIVE);
        let share = share(view, nearest, noise);
        (share > 0.0).then_some(Self { shares: [share, 1.0 - share] })
    }

    /// Draws a point.
    pub(super) fn sample(&self, view: &TriangleView<'_>, [mut v, u]: [Variate; 2]) -> Option<DrawnPoint> {
        let is_by_cell = pick_pair(self.shares, &mut v) == 1;
        if !is_by_cell {
            if let Some(drawn) = view.sample_direction([v, u]) {
                let drawn = drawn?;
                let pdf = self.mix(Some(drawn.pdf), self.pdf_of_cell(view, drawn.point.lattice()));
                return Some(DrawnPoint { pdf, ..drawn });
            }
        }
        let drawn = view.sample_cell([v, u])?;
        Some(match view.pdf_of_direction(drawn.point.lattice()) {
            Some(direction) => DrawnPoint { pdf: self.mix(direction, Some(drawn.pdf)), ..drawn },
            None => drawn,
        })
    }

    /// Returns the density per solid angle of a point. `None` where it is not a positive number.
    pub(super) fn pdf(&self, view: &TriangleView<'_>, point: Lattice) -> Option<f64> {
        match view.pdf_of_direction(point) {
            Some(direction) => {
                let pdf = self.mix(direction, self.pdf_of_cell(view, point));
                (pdf > 0.0).then_some(pdf)
            }
            // Too little solid angle: all points are drawn by cells.
            None => view.pdf_of_cell(point),
        }
    }

    #[inline]
    fn pdf_of_cell(&self, view: &TriangleView<'_>, point: Lattice) -> Option<f64> {
        if self.shares[1] > 0.0 { view.pdf_of_cell(point) } else { None }
    }

    /// Returns the density of both.
    #[inline]
    fn mix(&self, direction: Option<f64>, cell: Option<f64>) -> f64 {
        let [a, b] = self.shares.map(f64::from);
        (a * direction.unwrap_or(0.0) + b * cell.unwrap_or(0.0)) / (a + b)
    }
}

/// Returns the barycentric coordinates and the squared distance of the nearest point of a triangle.
#[inline]
fn nearest(view: &TriangleView<'_>) -> ([f32; 2], f32) {
    let [a, b, c] = view.vertices;
    let height2 = view.height * view.height;
    let normal = (b - a).cross(c - a);
    // Twice the area of each corner's part of the triangle, up to a factor.
    let parts = [(b, c), (c, a), (a, b)].map(|(p, q)| normal.dot(p.cross(q)));
    if parts.iter().all(|part| *part >= 0.0) {
        let [_, b1, b2] = parts.map(|part| part / normal.length_squared());
        return ([b1, b2], height2);
    }
    let mut found = ([0.0; 2], f32::INFINITY);
    for (p, q, from, to) in [(a, b, [0.0; 2], [1.0, 0.0]), (b, c, [1.0, 0.0], [0.0, 1.0]), (c, a, [0.0, 1.0], [0.0; 2])]
    {
        let edge = q - p;
        let t = limit(-p.dot(edge) / edge.length_squared(), 1.0);
        let distance2 = (p + edge * t).length_squared();
        if distance2 < found.1 {
            found = ([0, 1].map(|k| from[k] + (to[k] - from[k]) * t), distance2);
        }
    }
    (found.0, at_least(found.1, height2))
}

/// Returns the share of directions, where cells have this noise, by the contrast of the texture as far as it shows in the
/// averages over the whole triangle's cells and over those next to a point. Not positive where there are none.
#[inline]
fn share(view: &TriangleView<'_>, nearest: [f32; 2], noise: f32) -> f32 {
    let mut guide = Follow::new(Lattice::from_barycentrics(nearest));
    let (mut node, mut squares, mut share) = (view.root.node, 1.0, 1.0);
    for _ in 0..LEVELS {
        let averages = blas::averages(view.cells, node);
        squares *= 1.0 + contrast(&averages);
        share = share_at(squares - 1.0, noise);
        // The contrast only grows.
        if share <= 0.0 {
            break;
        }
        let cell = guide.choose(&averages, &Default::default());
        node = blas::below(view.cells, node, cell);
        if node == LEAF {
            break;
        }
    }
    share
}

/// Returns the share of directions by the contrast of the texture and the noise of the cells.
#[inline]
fn share_at(contrast: f32, noise: f32) -> f32 {
    let [of_contrast, least] = CELL_SHARES;
    let most = 1.0 - at_least(of_contrast * at_most(contrast, 1.0), least);
    // Where the noise is infinite, this is not a number.
    let share = most * at_most(noise / (noise + contrast), 1.0);
    (share - LEAST_DIRECTION_SHARE) * (1.0 / (1.0 - LEAST_DIRECTION_SHARE))
}

/// Returns the relative variance of averages; zero if all of them are.
#[inline]
fn contrast(averages: &[f32; ARITY]) -> f32 {
    const LANES: usize = 8;
    let (mut sums, mut squares) = ([0.0; LANES], [0.0; LANES]);
    for lanes in averages.chunks_exact(LANES) {
        for i in 0..LANES {
            sums[i] += lanes[i];
            squares[i] += lanes[i] * lanes[i];
        }
    }
    let [sum, squares] = [sums, squares].map(|lanes| lanes.iter().sum::<f32>());
    at_least(squares * ARITY as f32 / (sum * sum) - 1.0, 0.0)
}
