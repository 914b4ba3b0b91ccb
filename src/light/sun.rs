//! One sun of the environment through one light triangle.

use glam::Vec3;

use super::triangle::Lit;
use crate::blas::{self, CellBlock, CellTarget, CellWeight, Draw, Follow, LEAF, Lattice, LatticeCell, Root};
use crate::env::{Cover, EnvironmentView, Opening};
use crate::warp::Variate;

/// A cell is small, and not looked into for how much of it is open, if it is this much smaller than a sun.
const SMALL: f32 = 0.5;

/// A part of a triangle that a sun is seen through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Which cell of the triangle.
    pub(crate) domain: LatticeCell,
    /// The texture's node below it.
    node: u32,
    /// What the sun sends through it, with the texture taken for one.
    through: f32,
}

impl Part {
    /// The whole of a triangle of one opacity.
    pub(crate) const WHOLE: Self = Self { domain: LatticeCell::whole(), node: LEAF, through: 0.0 };
}

/// A sun behind a light triangle: the target that cells are chosen by where it is drawn by itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sunlit<'a> {
    pub(crate) lit: &'a Lit<'a>,
    pub(crate) environment: EnvironmentView<'a>,
    pub(crate) sun: usize,
}

impl Sunlit<'_> {
    /// The directions in which a cell is seen.
    fn opening(&self, domain: LatticeCell) -> Opening {
        self.environment.opening(domain.corners().map(|corner| self.lit.point(corner)))
    }

    /// What the sun sends through a cell, with the cell's texture taken for one.
    fn through(&self, domain: LatticeCell) -> f32 {
        self.environment.sun_through(self.sun, &self.opening(domain))
    }

    /// Finds the parts of the triangle that the sun is seen through, and what it sends through each. A part is all of
    /// one opacity, or small.
    pub(crate) fn visit(&self, blocks: &[CellBlock], root: Root, found: &mut impl FnMut(Part, f32)) {
        let scale = if root.node == LEAF { 1.0 } else { root.average / blas::mean(blocks, root.node) };
        self.visit_below(blocks, (LatticeCell::whole(), self.lit.vertices), root, scale, found);
    }

    fn visit_below(
        &self,
        blocks: &[CellBlock],
        (domain, corners): (LatticeCell, [Vec3; 3]),
        below: Root,
        scale: f32,
        found: &mut impl FnMut(Part, f32),
    ) {
        let opening = self.opening(domain);
        if below.average == 0.0 || self.environment.cover_of_sun(self.sun, &opening) == Cover::Nothing {
            return;
        }
        if below.node == LEAF || self.is_small(&corners) {
            let through = self.environment.sun_through(self.sun, &opening);
            if through * below.average > 0.0 {
                found(Part { domain, node: below.node, through }, through * below.average);
            }
            return;
        }
        let averages = blas::averages(blocks, below.node);
        for (i, average) in averages.into_iter().enumerate() {
            let root = Root { average: average * scale, node: blas::below(blocks, below.node, i) };
            let child = (domain.child(i), blas::child_corners(&corners, i));
            self.visit_below(blocks, child, root, scale, found);
        }
    }

    /// Draws a point in a part.
    pub(crate) fn sample(&self, blocks: &[CellBlock], part: Part, u: [Variate; 2]) -> Option<Lattice> {
        if part.node == LEAF {
            return self.sample_in(part.domain, Some(part.through), u);
        }
        let mut draw = Draw::new(u);
        let (cell, _) = blas::descend_below(blocks, part.node, part.domain, (), self, &mut draw)?;
        self.sample_in(cell, None, draw.rest())
    }

    /// Draws a point in a cell of one opacity, of which it may be known what the sun sends through it.
    fn sample_in(&self, domain: LatticeCell, through: Option<f32>, u: [Variate; 2]) -> Option<Lattice> {
        let opening = self.opening(domain);
        let through = through.unwrap_or_else(|| self.environment.sun_through(self.sun, &opening));
        let direction = self.environment.sample_sun_through(self.sun, &opening, through, u);
        let place = Lattice::from_barycentrics(self.lit.intersect(direction)?);
        domain.holds(place).then_some(place)
    }

    /// Density per solid angle with which [`Self::sample`] draws a point of the part, over the sun's excess there.
    pub(crate) fn pdf_per_excess(&self, blocks: &[CellBlock], part: Part, place: Lattice) -> f64 {
        if part.node == LEAF {
            return 1.0 / f64::from(part.through);
        }
        let mut follow = Follow::below(part.domain, place);
        let found = blas::descend_below(blocks, part.node, part.domain, (), self, &mut follow);
        found.map_or(0.0, |(cell, pmf)| match self.through(cell) {
            0.0 => 0.0,
            through => pmf / f64::from(through),
        })
    }

    fn is_small(&self, corners: &[Vec3; 3]) -> bool {
        let center = corners.iter().sum::<Vec3>() * (1.0 / 3.0);
        let radius2 = corners.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
        let reach = SMALL * self.environment.suns()[self.sun].sin_radius;
        radius2 <= reach * reach * center.length_squared()
    }
}

impl CellTarget for Sunlit<'_> {
    type Cell = ();

    fn whole(&self) {}

    fn child(&self, (): &(), _index: usize) {}

    fn weigh(&self, at: LatticeCell, (): &mut ()) -> CellWeight {
        CellWeight { weight: self.through(at), is_final: true }
    }
}
