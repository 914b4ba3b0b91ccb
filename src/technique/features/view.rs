//! Bright features of the environment through one light triangle.

use glam::Vec3;

use super::child_powers::{ChildPowers, LEAST_POWER};
use super::opening::{Coverage, Opening};
use crate::blas::{self, ARITY, CHILD_CENTERS, CellTarget, Draw, Follow, LEAF, Lattice, LatticeCell, Root};
use crate::env::{EnvironmentView, FeatureNode};
use crate::light::TriangleView;
use crate::math::{self, at_least, only_if};
use crate::receiver::Effort;
use crate::simd::InstructionSet;
use crate::warp::Variate;

/// Ratio of a cell's to a feature's angular radius up to which the cell counts as one part, however its texture
/// varies.
///
/// *Measured* (docs/CONSTANTS.md). A step makes cells an eighth as wide, so that the parts of a textured triangle are
/// from half as wide as the feature to four times as wide. A part is weighed by the mean of those of its children,
/// again an eighth as wide, that the feature may be visible through. Larger: fewer parts, so that a shading point costs
/// less, but children as wide as the feature, whose mean says less of what it shines through. Smaller: up to 64 times
/// as many parts, of which the list holds [`MAX_VISIBLE`](super::list::MAX_VISIBLE).
const SMALL_CELL: f32 = 4.0;

/// Value of [`SMALL_CELL`] with the least effort. *Measured* (docs/CONSTANTS.md).
///
/// Larger: a shading point costs less, and the means say less of what the feature shines through. Smaller: the other way
/// round.
const LEAST_SMALL_CELL: f32 = 16.0;

/// Rounding of a cell's corners relative to the largest coordinate of a vertex. Proved: a corner is a sum of three
/// products, each off by less than 2e-7; the rest is for the axis and the products with it.
///
/// Larger: more cells are looked at closely. Smaller: a part of a feature could be missed.
const ASIDE_ROUNDING: f32 = 1e-5;

/// Rounding of squared distances from the feature's axis, relative to that from the shading point. Proved: a difference
/// of two sums of three squares in `f32`, with an axis within 3e-7 of unit length, rounded up.
///
/// Larger and smaller as [`ASIDE_ROUNDING`].
const SQUARE_ROUNDING: f32 = 3e-6;

/// Least share of a cell that counts as covered by a feature that may be visible through it. *Chosen*.
///
/// Larger: openings beside the feature count. Smaller: one that shows the feature's edge, and nothing else does, is
/// listed with next to no weight.
const LEAST_COVERED_SHARE: f32 = 0.05;

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
    #[inline(always)]
    fn opening(&self, cell: LatticeCell) -> Opening {
        Opening::new(self.environment, cell.corners().map(|corner| self.triangle.position(corner)))
    }

    /// Power of the feature through a cell, as if the cell's texture were one.
    fn power(&self, cell: LatticeCell) -> f32 {
        self.opening(cell).power(self.environment, self.node)
    }

    /// Passes every part of the triangle through which the feature is visible to `found`, with the power through the
    /// part times an estimate of its opacity. A part has one opacity, or is small.
    pub(super) fn visit(&self, mut found: impl FnMut(FeaturePart, f32)) {
        let TriangleView { root, cells, .. } = *self.triangle;
        let scale = if root.node == LEAF { 1.0 } else { root.average / blas::mean(cells, root.node) };
        self.visit_below((LatticeCell::whole(), *self.triangle.vertices()), root, scale, &mut found);
    }

    fn visit_below(
        &self,
        (cell, corners): (LatticeCell, [Vec3; 3]),
        below: Root,
        scale: f32,
        found: &mut impl FnMut(FeaturePart, f32),
    ) {
        if below.average == 0.0 {
            return;
        }
        let opening = self.opening(cell);
        if opening.coverage(self.bright()) == Coverage::Nothing {
            return;
        }
        if below.node == LEAF {
            let power = opening.power(self.environment, self.node);
            if power * below.average > 0.0 {
                found(FeaturePart { cell, node: below.node, power }, power * below.average);
            }
            return;
        }
        if self.is_small(&corners) {
            let average = scale * self.average_before_feature(&corners, below.node);
            let power = opening.power(self.environment, self.node);
            if power * average > 0.0 {
                found(FeaturePart { cell, node: below.node, power }, power * average);
            }
            return;
        }
        let averages = blas::averages(self.triangle.cells, below.node);
        let shares = self.covered_shares(&corners);
        for (i, average) in averages.into_iter().enumerate().filter(|(i, _)| shares[*i] > 0.0) {
            let root = Root { average: average * scale, node: blas::below(self.triangle.cells, below.node, i) };
            self.visit_below((cell.child(i), blas::child_corners(&corners, i)), root, scale, found);
        }
    }

    /// Mean of the relative averages of those children of a cell that the feature may be visible through, each counted
    /// by the share of it that the feature covers.
    fn average_before_feature(&self, corners: &[Vec3; 3], node: u32) -> f32 {
        let averages = blas::averages(self.triangle.cells, node);
        let shares = self.covered_shares(corners);
        let (mut sum, mut all) = (0.0, 0.0);
        for (average, share) in averages.into_iter().zip(shares) {
            sum += average * share;
            all += share;
        }
        if all > 0.0 { sum / all } else { 0.0 }
    }

    /// Draws a point in a part. Returns it with its [`pdf_per_excess`](Self::pdf_per_excess).
    pub(super) fn sample(&self, part: FeaturePart, u: [Variate; 2]) -> Option<(Lattice, f64)> {
        if part.node == LEAF {
            let (point, power) = self.sample_in(part.cell, Some(part.power), u)?;
            return Some((point, 1.0 / f64::from(power)));
        }
        let mut draw = Draw::new(u);
        let (cell, pmf) = blas::descend_below(self.triangle.cells, part.node, part.cell, (), self, &mut draw)?;
        let (point, power) = self.sample_in(cell, None, draw.rest())?;
        // As the point lies strictly inside of the cell, its density is found in the same cell.
        Some((point, pmf / f64::from(power)))
    }

    /// Draws a point in a cell of one opacity. `power` is the feature's through the cell, if it is known already.
    /// Returns it with the point, which lies strictly inside of the cell.
    fn sample_in(&self, cell: LatticeCell, power: Option<f32>, u: [Variate; 2]) -> Option<(Lattice, f32)> {
        let opening = self.opening(cell);
        let power = power.unwrap_or_else(|| opening.power(self.environment, self.node));
        let direction = opening.sample(self.environment, self.node, power, u);
        let point = self.triangle.intersect(direction).filter(|point| cell.holds(*point))?;
        (power > 0.0).then_some((point, power))
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

    /// Estimates the share of each child of a cell that the feature covers. It is zero only where nothing of the
    /// feature is visible through the child: a quick test that decides about most.
    ///
    /// The directions to a child lie in a cone around that to its center. Where the sines of the radii of two cones add
    /// up to less than that of the angle between their axes, or than 1 for an obtuse angle, the cones are apart. In
    /// between, the share grows evenly from cones that touch to one that holds the other, with a disk as wide as the
    /// feature is spread.
    fn covered_shares(&self, corners: &[Vec3; 3]) -> [f32; ARITY] {
        let center = corners.iter().sum::<Vec3>() * (1.0 / 3.0);
        let radius2 = corners.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
        let extent = self.triangle.vertices().iter().fold(0.0, |extent: f32, v| extent.max(v.abs().max_element()));
        let radius = math::sqrt(radius2 * (1.0 / ARITY as f32)) + ASIDE_ROUNDING * extent;
        let (axis, sine) = (Vec3::from_array(self.bright().axis), self.bright().reach());
        let [v0, v1, v2] = corners.map(|corner| self.environment.local_direction(corner));
        let (e1, e2) = (v1 - v0, v2 - v0);
        let (spread, per_radius) = (self.bright().sin_spread, 0.5 / radius);
        let mut shares = [0.0; ARITY];
        for (i, share) in shares.iter_mut().enumerate() {
            let (b1, b2) = (CHILD_CENTERS.b1[i], CHILD_CENTERS.b2[i]);
            let x = v0.x + (e1.x * b1 + e2.x * b2);
            let y = v0.y + (e1.y * b1 + e2.y * b2);
            let z = v0.z + (e1.z * b1 + e2.z * b2);
            let along = axis.x * x + axis.y * y + axis.z * z;
            let distance2 = x * x + y * y + z * z;
            let distance = math::sqrt(distance2);
            let reach = radius + sine * distance;
            let reach2 = reach * reach + SQUARE_ROUNDING * distance2;
            let across2 = (distance2 - if along > 0.0 { along * along } else { 0.0 }).max(0.0);
            let covered =
                ((radius + spread * distance - math::sqrt(across2)) * per_radius).clamp(LEAST_COVERED_SHARE, 1.0);
            *share = if reach2 < across2 { 0.0 } else { covered };
        }
        shares
    }

    /// Corners of a cell, relative to the shading point.
    fn corners(&self, cell: LatticeCell) -> [Vec3; 3] {
        let &[v0, v1, v2] = self.triangle.vertices();
        cell.corners().map(|corner| {
            let [b1, b2] = corner.to_barycentrics();
            v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
        })
    }

    /// Whether a cell is small compared with the feature.
    fn is_small(&self, corners: &[Vec3; 3]) -> bool {
        let center = corners.iter().sum::<Vec3>() * (1.0 / 3.0);
        let radius2 = corners.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
        let small = if self.triangle.effort == Effort::Least { LEAST_SMALL_CELL } else { SMALL_CELL };
        let reach = small * self.bright().sin_radius;
        radius2 <= reach * reach * center.length_squared()
    }
}

impl CellTarget for FeatureView<'_> {
    type Cell = ();

    fn whole(&self) {}

    fn child(&self, (): &(), _index: usize) {}

    fn weigh_children(&self, at: LatticeCell, (): &(), averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
        let shares = self.covered_shares(&self.corners(at));
        let corners = at.corners().map(|corner| self.triangle.position(corner));
        let powers = InstructionSet::best().run(ChildPowers::new(self.environment, self.node, corners));
        // NaN is passed over.
        let most = powers.iter().fold(f32::MIN_POSITIVE, |most, power| at_least(*power, most));
        for (i, weight) in weights.iter_mut().enumerate() {
            let least = LEAST_POWER * shares[i] * most;
            *weight = only_if(averages[i] != 0.0 && shares[i] > 0.0, at_least(powers[i], least));
        }
    }

    fn is_final(&self, _at: LatticeCell, (): &mut (), _levels: Option<u32>) -> bool {
        true
    }
}
