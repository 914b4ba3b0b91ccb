//! Nodes of the light tree and the buffers they live in.

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::bounds::{LightBounds, Moments};
use crate::geometry::Aabb;
use crate::math;

/// Marks a child that is a leaf; the other bits below [`TWO_SIDED`] are its number.
const LEAF: u32 = 1 << 31;
/// Marks a child that holds a two-sided light.
const TWO_SIDED: u32 = 1 << 30;
/// Most leaves that a tree can number.
pub(crate) const MAX_LEAVES: usize = (1 << 28) - 1;
/// A lane without a child.
const EMPTY: u32 = u32::MAX;

/// Widening of a cluster's cone of normals, in radians: covers the rounding of its construction in `f32`.
const CONE_MARGIN: f32 = 1e-4;

const ROWS: usize = 21;
const CHILD: usize = 0;
const MIN: usize = 1;
const MAX: usize = 4;
const AXIS: usize = 7;
const COS: usize = 10;
const SIN: usize = 11;
const FLUX: usize = 12;
const PORTAL: usize = 13;
const MEAN: usize = 14;
const VARIANCE: usize = 17;
const NORMAL: usize = 18;

/// `N` children, one a lane: a row of references, then rows of `f32` bits (the talk's `TLASNode`, with the energy in
/// two rows: one that arrives the same from everywhere, one to be multiplied by what is seen through a portal).
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Node<const N: usize>([[u32; N]; ROWS]);

/// What a lane of a node refers to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Child {
    /// Nothing.
    Empty,
    /// Another node, by index.
    Node(u32),
    /// A leaf, by number.
    Leaf(u32),
}

impl<const N: usize> Node<N> {
    /// A node without children.
    pub(super) fn empty() -> Self {
        let mut node = Self([[0; N]; ROWS]);
        node.0[CHILD] = [EMPTY; N];
        node
    }

    /// Writes one child and its bounds.
    pub(super) fn set(&mut self, lane: usize, child: Child, bounds: &LightBounds, moments: &Moments) {
        let side = if bounds.two_sided { TWO_SIDED } else { 0 };
        self.0[CHILD][lane] = match child {
            Child::Empty => EMPTY,
            Child::Node(index) => index | side,
            Child::Leaf(number) => number | LEAF | side,
        };
        let (sin, cos) = math::sin_cos((bounds.normals.theta + CONE_MARGIN).min(core::f32::consts::PI));
        let mut write = |row: usize, value: f32| self.0[row][lane] = value.to_bits();
        for axis in 0..3 {
            write(MIN + axis, bounds.aabb.min[axis]);
            write(MAX + axis, bounds.aabb.max[axis]);
            write(AXIS + axis, bounds.normals.axis[axis]);
            write(MEAN + axis, moments.mean[axis]);
            write(NORMAL + axis, moments.normal[axis]);
        }
        write(VARIANCE, moments.variance);
        write(COS, cos);
        write(SIN, sin.max(0.0));
        write(FLUX, bounds.flux);
        write(PORTAL, bounds.portal);
    }

    pub(super) fn child(&self, lane: usize) -> Child {
        let reference = self.0[CHILD][lane];
        match reference {
            EMPTY => Child::Empty,
            _ if reference & LEAF != 0 => Child::Leaf(reference & !(LEAF | TWO_SIDED)),
            _ => Child::Node(reference & !TWO_SIDED),
        }
    }

    /// A row of floats.
    #[inline(always)]
    fn row(&self, row: usize) -> [f32; N] {
        self.0[row].map(f32::from_bits)
    }

    /// Three rows of floats, one an axis.
    #[inline(always)]
    fn vectors(&self, row: usize) -> [[f32; N]; 3] {
        [self.row(row), self.row(row + 1), self.row(row + 2)]
    }

    /// One for each lane that holds a two-sided light, else zero.
    #[inline(always)]
    pub(super) fn two_sided(&self) -> [bool; N] {
        self.0[CHILD].map(|reference| reference & TWO_SIDED != 0)
    }

    /// Lanes that refer to a child.
    #[inline(always)]
    pub(super) fn occupied(&self) -> [bool; N] {
        self.0[CHILD].map(|reference| reference != EMPTY)
    }

    /// Corners of the boxes.
    #[inline(always)]
    pub(super) fn boxes(&self) -> [[[f32; N]; 3]; 2] {
        [self.vectors(MIN), self.vectors(MAX)]
    }

    /// Axes of the cones of normals, and the cosines and sines of their half angles.
    #[inline(always)]
    pub(super) fn cones(&self) -> ([[f32; N]; 3], [f32; N], [f32; N]) {
        (self.vectors(AXIS), self.row(COS), self.row(SIN))
    }

    /// Mean positions, variances of the position, and mean normals.
    #[inline(always)]
    pub(super) fn moments(&self) -> ([[f32; N]; 3], [f32; N], [[f32; N]; 3]) {
        (self.vectors(MEAN), self.row(VARIANCE), self.vectors(NORMAL))
    }

    /// Energies that do not depend on the direction, and those of portals.
    #[inline(always)]
    pub(super) fn energies(&self) -> [[f32; N]; 2] {
        [self.row(FLUX), self.row(PORTAL)]
    }

    /// The corners of one box.
    #[inline(always)]
    pub(super) fn aabb(&self, lane: usize) -> Aabb {
        let corner = |row: usize| Vec3::from_array([0, 1, 2].map(|axis| self.value(row + axis, lane)));
        Aabb { min: corner(MIN), max: corner(MAX) }
    }

    #[inline(always)]
    fn value(&self, row: usize, lane: usize) -> f32 {
        f32::from_bits(self.0[row][lane])
    }

    /// Whether no energy of a lane is negative.
    pub(super) fn has_energies(&self, lane: usize) -> bool {
        self.value(FLUX, lane) >= 0.0 && self.value(PORTAL, lane) >= 0.0 && self.value(VARIANCE, lane) >= 0.0
    }

    /// Every value of a lane but its reference.
    pub(super) fn values(&self, lane: usize) -> impl Iterator<Item = f32> + '_ {
        (CHILD + 1..ROWS).map(move |row| self.value(row, lane))
    }
}

/// What splitting needs to know of all leaves below a node: energies relative to the whole tree's.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Spread {
    /// Number of leaves, as a float, for it is only multiplied.
    pub(super) count: f32,
    /// Mean energy of a leaf.
    pub(super) mean: f32,
    /// Variance of the energy of the leaves.
    pub(super) variance: f32,
}

impl Spread {
    /// The same of energies that are multiplied.
    pub(super) fn scale(&mut self, factor: f64) {
        self.mean = (f64::from(self.mean) * factor) as f32;
        self.variance = (f64::from(self.variance) * factor * factor) as f32;
    }
}

/// Where the walk from a node or leaf to the root goes on: the lane that refers to it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Slot(u32);

impl Slot {
    /// Of the root, which no lane refers to.
    pub(super) const ROOT: Self = Self(u32::MAX);

    pub(super) fn new<const N: usize>(node: usize, lane: usize) -> Self {
        Self((node * N + lane) as u32)
    }

    /// Node and lane, or `None` for the root.
    #[inline]
    pub(super) fn get<const N: usize>(self) -> Option<(usize, usize)> {
        (self != Self::ROOT).then_some((self.0 as usize / N, self.0 as usize % N))
    }
}

/// A wide light tree of arity `N`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tlas<const N: usize> {
    /// The root first; a child always after its parent. Empty where there is no leaf or a single one.
    pub(crate) nodes: Vec<Node<N>>,
    /// One a node.
    pub(crate) parents: Vec<Slot>,
    /// One a node.
    pub(crate) spreads: Vec<Spread>,
    /// One a leaf.
    pub(crate) leaves: Vec<Slot>,
}

impl<const N: usize> Tlas<N> {
    /// The tree as borrowed slices, which all sampling works on.
    #[inline]
    pub(crate) fn view(&self) -> TlasView<'_, N> {
        TlasView { nodes: &self.nodes, parents: &self.parents, spreads: &self.spreads, leaves: &self.leaves }
    }
}

/// A light tree in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TlasView<'a, const N: usize> {
    pub(crate) nodes: &'a [Node<N>],
    pub(crate) parents: &'a [Slot],
    pub(crate) spreads: &'a [Spread],
    pub(crate) leaves: &'a [Slot],
}
