//! Nodes of the light tree, and what is kept next to them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bit of [`Node::normals`] that marks a two-sided light. *Format.*
pub(super) const LANE_TWO_SIDED: u32 = 1 << 31;
/// Bit of [`Node::normals`] that marks a child whose lights do not all send over the hemisphere around their normal.
/// With [`WIDE`], some of them send in all directions. With any other code of [`Node::tangents`], all of them send into
/// the cone of that code alone: the cone of normals, widened by the angle at which light leaves. *Format.*
pub(super) const LANE_SHAPED: u32 = 1 << 30;
/// Largest component of a normal, in the ten bits that it has. *Format.*
pub(super) const NORMAL_STEPS: f32 = 511.0;
/// Code of a cone of normals so wide that something always faces the shading point. *Format.*
pub(super) const WIDE: u8 = u8::MAX;
/// Largest code of a share, which stands for exactly one. *Format.*
pub(super) const ALL: u8 = u8::MAX;
/// Largest code of a mean position, at the side of the box. *Format.*
pub(super) const MEAN_STEPS: f32 = 127.0;
/// Number of steps per unit of the square root of the tangent of a cone's half angle. The root makes the codes of
/// narrow cones finer. *Format*: with 254 steps, tangents end at 15.8, which is above the tangent of
/// `WIDEST_STORED_CONE`; smaller steps could not reach it, larger ones widen all cones.
pub(super) const TANGENT_STEPS: f32 = 64.0;

/// Up to `N` children, in few bits each (after Ylitie, Karras and Laine 2017): first other nodes, which are neighbors
/// in memory, then leaves, whose numbers are neighbors. What proves that a child is dark is rounded to the safe side:
/// boxes and cones only grow.
///
/// Numbers of two bytes are the upper half of an `f32`.
#[repr(C, packed)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Node<const N: usize> {
    /// Least corner of all boxes.
    pub(super) origin: [f32; 3],
    /// The first child that is a node.
    pub(super) first_node: u32,
    /// The first child that is a leaf.
    pub(super) first_leaf: u32,
    /// Direction of the mean normal, which is the axis of the cone of normals as well: ten bits a component, and
    /// [`LANE_TWO_SIDED`] and [`LANE_SHAPED`].
    pub(super) normals: [u32; N],
    /// Energies; zero where there is no child.
    pub(super) energies: [u16; N],
    /// Unit of the boxes along each axis.
    pub(super) steps: [u16; 3],
    /// Number of children that are nodes.
    pub(super) node_count: u8,
    /// Number of children.
    pub(super) width: u8,
    /// Centers of the boxes, in steps from the origin.
    pub(super) centers: [[u8; N]; 3],
    /// Halves of the boxes' edges, in halves of a step.
    pub(super) halves: [[u8; N]; 3],
    /// Mean positions: from -127 to 127 across the box.
    pub(super) means: [[i8; N]; 3],
    /// Standard deviations of the positions, relative to half the boxes' diagonals.
    pub(super) deviations: [u8; N],
    /// Lengths of the mean normals: the shorter, the more the normals differ.
    pub(super) lengths: [u8; N],
    /// Tangents of the half angles of the cones of normals, by their roots; or [`WIDE`].
    pub(super) tangents: [u8; N],
    /// Shares of the energies to be multiplied by what is seen through a portal. 0 and [`ALL`] are exact.
    pub(super) portals: [u8; N],
}

/// Number of words of a node. Nodes have no padding, so that they can be kept as an array of words for any arity.
pub(super) const fn words<const N: usize>() -> usize {
    size_of::<Node<N>>() / size_of::<u32>()
}

const _: () = assert!(size_of::<Node<4>>() == 4 * words::<4>() && words::<4>() == 26);
const _: () = assert!(size_of::<Node<8>>() == 4 * words::<8>() && words::<8>() == 45);
const _: () = assert!(size_of::<Node<16>>() == 4 * words::<16>() && words::<16>() == 83);

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

/// Returns the value of a number of two bytes.
#[inline(always)]
pub(super) fn wide(bits: u16) -> f32 {
    f32::from_bits(u32::from(bits) << 16)
}

impl<const N: usize> Node<N> {
    /// Returns a node whose children are known, but without bounds.
    pub(super) fn new(first_node: usize, node_count: usize, first_leaf: usize, width: usize) -> Self {
        Self {
            first_node: first_node as u32,
            first_leaf: first_leaf as u32,
            node_count: node_count as u8,
            width: width as u8,
            ..Zeroable::zeroed()
        }
    }

    #[inline(always)]
    pub(super) fn child(&self, lane: usize) -> Child {
        let lane = lane as u32;
        let nodes = u32::from(self.node_count);
        if lane < nodes {
            Child::Node(self.first_node.wrapping_add(lane))
        } else if lane < u32::from(self.width) {
            Child::Leaf(self.first_leaf.wrapping_add(lane - nodes))
        } else {
            Child::Empty
        }
    }

    /// Returns the lanes that refer to anything, as a set of bits.
    #[inline(always)]
    pub(super) fn children(&self) -> u32 {
        (1 << self.width) - 1
    }

    /// Returns a component of a lane's normal.
    #[inline(always)]
    pub(super) fn component(normal: u32, axis: u32) -> f32 {
        Self::steps(normal, axis) * (1.0 / NORMAL_STEPS)
    }

    /// Returns a component of a lane's normal, in units of 1 / [`NORMAL_STEPS`].
    #[inline(always)]
    pub(super) fn steps(normal: u32, axis: u32) -> f32 {
        ((normal << (22 - 10 * axis)) as i32 >> 22) as f32
    }

    /// Returns the energies that do not depend on the direction, and those of portals.
    #[inline(always)]
    pub(super) fn energies(&self) -> [[f32; N]; 2] {
        let (energies, portals) = (self.energies, self.portals);
        let (mut flux, mut portal) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            let energy = wide(energies[lane]);
            let share = f32::from(portals[lane]) * (1.0 / f32::from(ALL));
            (flux[lane], portal[lane]) = (energy * (1.0 - share), energy * share);
        }
        [flux, portal]
    }

    /// Returns the cone of normals of a lane, by its axis and the sine and cosine of its half angle, and the mean
    /// normal.
    pub(super) fn cone(&self, lane: usize) -> (Vec3, [f32; 2], Vec3) {
        let normal = self.normals[lane];
        let axis = Vec3::from_array([0, 1, 2].map(|axis| Self::component(normal, axis))).normalize_or_zero();
        let mean = axis * f32::from(self.lengths[lane]) * (1.0 / 255.0);
        if self.tangents[lane] == WIDE {
            return (axis, [1.0, 0.0], mean);
        }
        let root = f32::from(self.tangents[lane]) / TANGENT_STEPS;
        let tangent = root * root;
        let cos = 1.0 / crate::math::sqrt(1.0 + tangent * tangent);
        (axis, [tangent * cos, cos], mean)
    }

    /// Returns the lanes marked with [`LANE_SHAPED`], as a set of bits.
    #[inline(always)]
    pub(super) fn shaped_lanes(&self) -> u32 {
        let normals = self.normals;
        (0..N).fold(0, |set, lane| set | u32::from(normals[lane] & LANE_SHAPED != 0) << lane)
    }

    pub(super) fn is_two_sided(&self, lane: usize) -> bool {
        self.normals[lane] & LANE_TWO_SIDED != 0
    }

    /// Returns the least and largest coordinates of all boxes, by axis. Each is rounded once, so that a box still holds
    /// what it was made for.
    #[inline(always)]
    pub(super) fn corners(&self) -> ([[f32; N]; 3], [[f32; N]; 3]) {
        let (origin, steps, centers, halves) = (self.origin, self.steps, self.centers, self.halves);
        let (mut low, mut high) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for axis in 0..3 {
            let half_step = 0.5 * wide(steps[axis]);
            for lane in 0..N {
                let (middle, half) = (2.0 * f32::from(centers[axis][lane]), f32::from(halves[axis][lane]));
                low[axis][lane] = origin[axis] + (middle - half) * half_step;
                high[axis][lane] = origin[axis] + (middle + half) * half_step;
            }
        }
        (low, high)
    }
}

/// Energies of all leaves below a node, for splitting: relative to the whole tree's.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Spread {
    /// Number of leaves, as a float, for it is only multiplied.
    pub(super) count: f32,
    /// Mean energy of a leaf.
    pub(super) mean: f32,
    /// Variance of the energy of the leaves.
    pub(super) variance: f32,
}

const _: () = assert!(size_of::<Spread>() == 12);

impl Spread {
    /// Multiplies all energies.
    pub(super) fn scale(&mut self, factor: f64) {
        self.mean = (f64::from(self.mean) * factor) as f32;
        self.variance = (f64::from(self.variance) * factor * factor) as f32;
    }
}

/// Where the walk from a node or leaf to the root goes on: the lane that refers to it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Slot(u32);

const _: () = assert!(size_of::<Slot>() == 4);

impl Slot {
    /// Slot of the root, which no lane refers to.
    pub(super) const ROOT: Self = Self(u32::MAX);
    /// Slot of a place that an edit has left free. Nothing refers to the place, and bytes hold none. *Format*: as many
    /// nodes as have a slot of this number are never built.
    pub(super) const FREE: Self = Self(u32::MAX - 1);

    pub(super) fn new<const N: usize>(node: usize, lane: usize) -> Self {
        Self((node * N + lane) as u32)
    }

    /// Returns node and lane, or `None` for the root and for a place that is free.
    #[inline]
    pub(super) fn get<const N: usize>(self) -> Option<(usize, usize)> {
        (self.0 < Self::FREE.0).then_some((self.0 as usize / N, self.0 as usize % N))
    }
}
