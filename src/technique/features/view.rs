//! One bright feature of the environment through one light triangle.

use super::opening::{Coverage, Opening};
use crate::blas::{self, Block, Cell, Domain, Draw, Follow, LEAF, Lattice, Root, Shape, Worth};
use crate::env::{BrightFeature, EnvironmentView};
use crate::light::Lit;
use crate::warp::Variate;

/// Ratio of a cell's to a feature's angular radius up to which the cell counts as one part, however its texture
/// varies. *Measured* on the scenes with windows of the bench `quality`: the variance of a star-shaped window
/// where the sun is visible is 0.15 with half, 0.065 with this, and 0.086 with double.
///
/// Larger: fewer parts, so that a shading point is cheaper, but the texture inside a part is followed by the tree's
/// descent alone. Smaller: more parts, up to the limit of the list.
const SMALL_CELL: f32 = 0.5;

/// A part of a triangle through which a feature is visible.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FeaturePart {
    /// Cell of the triangle.
    pub(crate) domain: Domain,
    /// Node of the texture's tree below the cell.
    node: u32,
    /// Power of the feature through the cell, as if the texture were one.
    power: f32,
}

impl FeaturePart {
    /// The whole of a triangle of one opacity.
    pub(crate) const WHOLE: Self = Self { domain: Domain::root(), node: LEAF, power: 0.0 };
}

/// A feature behind a light triangle: the target by which cells are chosen when the feature is sampled by itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FeatureView<'a> {
    /// The triangle as seen from the shading point.
    pub(crate) lit: &'a Lit<'a>,
    /// The environment that holds the feature.
    pub(crate) environment: EnvironmentView<'a>,
    /// Index of the feature.
    pub(crate) feature: usize,
}

impl FeatureView<'_> {
    /// The directions in which a cell is visible.
    fn opening(&self, domain: Domain) -> Opening {
        Opening::new(&self.environment, domain.corners().map(|corner| self.lit.point(corner)))
    }

    /// Power of the feature through a cell, as if the cell's texture were one.
    fn power(&self, cell: &Cell) -> f32 {
        self.opening(cell.domain).power(&self.environment, self.feature)
    }

    /// Passes every part of the triangle through which the feature is visible to `found`, with the power through the
    /// part. A part has one opacity, or is small.
    pub(crate) fn visit<const M: usize>(
        &self,
        blocks: &[Block<M>],
        root: Root,
        found: &mut impl FnMut(FeaturePart, f32),
    ) {
        let scale = if root.node == LEAF { 1.0 } else { root.average / blas::mean(blocks, root.node) };
        self.visit_below(blocks, &Cell::root(self.lit.vertices), root, scale, found);
    }

    fn visit_below<const M: usize>(
        &self,
        blocks: &[Block<M>],
        cell: &Cell,
        below: Root,
        scale: f32,
        found: &mut impl FnMut(FeaturePart, f32),
    ) {
        let opening = self.opening(cell.domain);
        if below.average == 0.0 || opening.coverage(self.bright()) == Coverage::Nothing {
            return;
        }
        if below.node == LEAF || self.is_small(cell) {
            let power = opening.power(&self.environment, self.feature);
            if power * below.average > 0.0 {
                found(FeaturePart { domain: cell.domain, node: below.node, power }, power * below.average);
            }
            return;
        }
        let averages = blas::averages(blocks, below.node);
        for (i, average) in averages.into_iter().enumerate() {
            let root = Root { average: average * scale, node: blas::below(blocks, below.node, i) };
            self.visit_below(blocks, &cell.child::<M>(i), root, scale, found);
        }
    }

    /// Draws a point in a part.
    pub(crate) fn sample<const M: usize>(
        &self,
        blocks: &[Block<M>],
        part: FeaturePart,
        u: [Variate; 2],
    ) -> Option<Lattice> {
        if part.node == LEAF {
            return self.sample_in(part.domain, Some(part.power), u);
        }
        let mut draw = Draw::new(u);
        let (cell, _) = blas::descend_below(blocks, part.node, self.cell(part.domain), self, &mut draw)?;
        self.sample_in(cell.domain, None, draw.rest())
    }

    /// Draws a point in a cell of one opacity. `power` is the feature's through the cell, if it is known already.
    fn sample_in(&self, domain: Domain, power: Option<f32>, u: [Variate; 2]) -> Option<Lattice> {
        let opening = self.opening(domain);
        let power = power.unwrap_or_else(|| opening.power(&self.environment, self.feature));
        let direction = opening.sample(&self.environment, self.feature, power, u);
        let place = Lattice::from_barycentrics(self.lit.intersect(direction)?);
        domain.holds(place).then_some(place)
    }

    /// Density per solid angle with which [`Self::sample`] draws a point of the part, divided by the feature's excess
    /// at that point.
    pub(crate) fn pdf_per_excess<const M: usize>(&self, blocks: &[Block<M>], part: FeaturePart, place: Lattice) -> f64 {
        if part.node == LEAF {
            return 1.0 / f64::from(part.power);
        }
        let mut follow = Follow::below(part.domain, place);
        let found = blas::descend_below(blocks, part.node, self.cell(part.domain), self, &mut follow);
        found.map_or(0.0, |(cell, pmf)| match self.power(&cell) {
            0.0 => 0.0,
            power => pmf / f64::from(power),
        })
    }

    /// The feature.
    fn bright(&self) -> &BrightFeature {
        &self.environment.bright_features()[self.feature]
    }

    /// A cell with its corners in space.
    fn cell(&self, domain: Domain) -> Cell {
        Cell { domain, vertices: domain.corners().map(|corner| self.lit.point(corner).as_vec3()) }
    }

    /// Whether a cell is small compared with the feature.
    fn is_small(&self, cell: &Cell) -> bool {
        let center = cell.vertices.iter().sum::<glam::Vec3>() * (1.0 / 3.0);
        let radius2 = cell.vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
        let reach = SMALL_CELL * self.bright().sin_radius;
        radius2 <= reach * reach * center.length_squared()
    }
}

impl Shape for FeatureView<'_> {
    fn worth(&self, cell: &Cell) -> Worth {
        Worth { weight: self.power(cell), uniform: true, even: true }
    }
}
