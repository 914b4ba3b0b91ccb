//! Bright features of the environment through one light triangle.

use glam::Vec3;

use super::opening::{Coverage, Opening};
use crate::blas::{self, CellTarget, CellWeight, Draw, Follow, LEAF, Lattice, LatticeCell, Root};
use crate::env::{EnvironmentView, FeatureNode};
use crate::light::TriangleView;
use crate::warp::Variate;

/// Ratio of a cell's to a feature's angular radius up to which the cell counts as one part, however its texture
/// varies.
///
/// Measured on star and grid-100 (docs/ACCURACY.md, "Suns taken out"). Larger: fewer parts, so that a shading point is
/// cheaper, but the texture inside a part is followed by the tree's descent alone. Smaller: more parts, up to the limit of
/// the list.
const SMALL_CELL: f32 = 0.5;

/// A part of a triangle through which a feature is visible.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeaturePart {
    /// Cell of the triangle.
    pub(super) cell: LatticeCell,
    /// Node of the texture's tree below the cell.
    node: u32,
    /// Power of the feature through the cell, as if the texture were one.
    power: f32,
}

impl FeaturePart {
    /// The whole of a triangle of one opacity.
    pub(super) const WHOLE: Self = Self { cell: LatticeCell::whole(), node: LEAF, power: 0.0 };
}

/// A feature, or a group of features, behind a light triangle: the target by which cells are chosen when the feature is
/// sampled by itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeatureView<'a> {
    /// The triangle as seen from the shading point.
    triangle: &'a TriangleView<'a>,
    /// The environment that holds the feature.
    environment: &'a EnvironmentView<'a>,
    /// Node of the tree over the features.
    node: usize,
}

impl<'a> FeatureView<'a> {
    pub(super) fn new(triangle: &'a TriangleView<'a>, environment: &'a EnvironmentView<'a>, node: usize) -> Self {
        Self { triangle, environment, node }
    }

    /// The directions in which a cell is visible.
    fn opening(&self, cell: LatticeCell) -> Opening {
        Opening::of_cell(self.environment, self.triangle, cell)
    }

    /// Power of the feature through a cell, as if the cell's texture were one.
    fn power(&self, cell: LatticeCell) -> f32 {
        self.opening(cell).power(self.environment, self.node)
    }

    /// Passes every part of the triangle through which the feature is visible to `found`, with the power through the
    /// part. A part has one opacity, or is small. `opening` is that of the whole triangle.
    pub(super) fn visit(&self, opening: &Opening, mut found: impl FnMut(FeaturePart, f32)) {
        let TriangleView { root, cells, .. } = *self.triangle;
        let scale = if root.node == LEAF { 1.0 } else { root.average / blas::mean(cells, root.node) };
        self.visit_below((LatticeCell::whole(), *self.triangle.vertices()), opening, root, scale, &mut found);
    }

    fn visit_below(
        &self,
        (cell, corners): (LatticeCell, [Vec3; 3]),
        opening: &Opening,
        below: Root,
        scale: f32,
        found: &mut impl FnMut(FeaturePart, f32),
    ) {
        if below.average == 0.0 || opening.coverage(self.bright()) == Coverage::Nothing {
            return;
        }
        if below.node == LEAF || self.is_small(&corners) {
            let power = opening.power(self.environment, self.node);
            if power * below.average > 0.0 {
                found(FeaturePart { cell, node: below.node, power }, power * below.average);
            }
            return;
        }
        let averages = blas::averages(self.triangle.cells, below.node);
        for (i, average) in averages.into_iter().enumerate() {
            let root = Root { average: average * scale, node: blas::below(self.triangle.cells, below.node, i) };
            if average == 0.0 {
                continue;
            }
            let child = cell.child(i);
            self.visit_below((child, blas::child_corners(&corners, i)), &self.opening(child), root, scale, found);
        }
    }

    /// Draws a point in a part.
    pub(super) fn sample(&self, part: FeaturePart, u: [Variate; 2]) -> Option<Lattice> {
        if part.node == LEAF {
            return self.sample_in(part.cell, Some(part.power), u);
        }
        let mut draw = Draw::new(u);
        let (cell, _) = blas::descend_below(self.triangle.cells, part.node, part.cell, (), self, &mut draw)?;
        self.sample_in(cell, None, draw.rest())
    }

    /// Draws a point in a cell of one opacity. `power` is the feature's through the cell, if it is known already.
    fn sample_in(&self, cell: LatticeCell, power: Option<f32>, u: [Variate; 2]) -> Option<Lattice> {
        let opening = self.opening(cell);
        let power = power.unwrap_or_else(|| opening.power(self.environment, self.node));
        let direction = opening.sample(self.environment, self.node, power, u);
        self.triangle.intersect(direction).filter(|point| cell.holds(*point))
    }

    /// Density per solid angle with which [`Self::sample`] draws a point of the part, divided by the feature's excess
    /// at that point.
    pub(super) fn pdf_per_excess(&self, part: FeaturePart, point: Lattice) -> f64 {
        if part.node == LEAF {
            return 1.0 / f64::from(part.power);
        }
        let mut follow = Follow::below(part.cell, point);
        let found = blas::descend_below(self.triangle.cells, part.node, part.cell, (), self, &mut follow);
        found.map_or(0.0, |(cell, pmf)| match self.power(cell) {
            0.0 => 0.0,
            power => pmf / f64::from(power),
        })
    }

    /// The node of the tree over the features.
    fn bright(&self) -> &FeatureNode {
        &self.environment.feature_nodes()[self.node]
    }

    /// Whether a cell is small compared with the feature.
    fn is_small(&self, corners: &[Vec3; 3]) -> bool {
        let center = corners.iter().sum::<Vec3>() * (1.0 / 3.0);
        let radius2 = corners.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
        let reach = SMALL_CELL * self.bright().sin_radius;
        radius2 <= reach * reach * center.length_squared()
    }
}

impl CellTarget for FeatureView<'_> {
    type Cell = ();

    fn whole(&self) {}

    fn child(&self, (): &(), _index: usize) {}

    fn weigh(&self, at: LatticeCell, (): &mut ()) -> CellWeight {
        CellWeight { weight: self.power(at), is_final: true }
    }
}
