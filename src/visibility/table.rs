//! The frozen table, as arrays of plain data.

use alloc::vec::Vec;
use core::fmt;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::buffers::{Section, Sections, buffers, write};
use crate::error::Error;
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::tlas::{FactorBytes, factor};

/// Factors of a node's lanes, each a byte `b` that stands for ((b + 1) / 256)² ([`factor`]): from 1.5e-5 to 1, finest
/// near zero. *Format*, and the proof that no factor is zero.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct Factors(pub(crate) FactorBytes);

impl Factors {
    /// Factor of a lane, in `(0, 1]`.
    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> f32 {
        factor(self.0[lane])
    }

    /// Returns the byte whose factor is nearest to a share in `[0, 1]`.
    pub(crate) fn code(share: f32) -> u8 {
        // A cast of what is below zero gives zero.
        (crate::math::sqrt(share.max(0.0)) * 256.0 - 0.5) as u8
    }
}

/// A node of the tree over regions: a plane, a region, or nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct RegionNode {
    /// Axis of the plane, [`REGION`] or [`NOTHING`].
    pub(crate) kind: u32,
    /// Coordinate of the plane: what is below it is in the first child.
    pub(crate) plane: f32,
    /// Index of the first child, which the other follows; or number of the region.
    pub(crate) first: u32,
}

const _: () = assert!(size_of::<RegionNode>() == 12);

impl fmt::Display for RegionNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, plane, first } = self;
        match *kind {
            REGION => write!(f, "region {first}"),
            axis => write!(f, "the plane {plane} of axis {axis} above node {first}"),
        }
    }
}

/// Marks a node that is a region. *Format.*
pub(crate) const REGION: u32 = 3;
/// Marks a node that is outside of all regions. *Format.*
pub(crate) const NOTHING: u32 = 4;
/// Number of orientations, each of which has a root of its own: the six directions of the axes, and points without a
/// side. *Format.*
pub(crate) const ORIENTATIONS: usize = 7;

/// What a table was learned for.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct VisibilityHeader {
    /// Number of nodes of the light tree.
    pub(crate) nodes: u32,
    /// Number of its leaves.
    pub(crate) leaves: u32,
}

impl VisibilityHeader {
    const TAG: [u8; 4] = *b"VISH";
    const VERSION: u32 = 1;
}

buffers! {
    /// What walls hide, as far as it has been learned: a factor for each child of a node of the light tree, by regions
    /// of space and orientation. See [`LightSampler::with_visibility`](crate::LightSampler::with_visibility). The regions
    /// of an environment that is a light have factors as well; distant lights have none.
    ///
    /// A table is frozen: sampling reads it and never writes. It is made by [`Visibility::learn`](Self::learn), or by a
    /// [`VisibilityLearner`](crate::VisibilityLearner) from what a host reports while it renders.
    pub Visibility,
    /// What walls hide, in borrowed memory.
    VisibilityView
    plain {
        /// What the table was learned for.
        header: VisibilityHeader,
    }
    buffers {
        /// The trees over regions: the roots of all orientations first, and children always after their parents.
        regions: RegionNode = b"VREG" version 1,
        /// Number of the first entry of each region, and the number of all entries.
        starts: u32 = b"VSTA" version 1,
        /// Node of each entry, ascending within a region.
        keys: u32 = b"VKEY" version 1,
        /// Factors of each entry.
        factors: Factors = b"VFAC" version 1,
    }
}

/// The entries of one region.
#[derive(Clone, Copy)]
pub(crate) struct RegionFactors<'a> {
    keys: &'a [u32],
    factors: &'a [Factors],
}

crate::buffers::debug_counts!(RegionFactors<'_>, region => {
    entries: region.keys.len(),
});

impl<'a> RegionFactors<'a> {
    /// Returns the factors of a node, or of another key.
    #[inline(always)]
    pub(crate) fn get(&self, key: u32) -> Option<&'a Factors> {
        // Without branches that depend on keys: which half is next cannot be foretold.
        let mut low = 0;
        let mut count = self.keys.len();
        while count > 1 {
            let half = count / 2;
            let is_above = self.keys.get(low + half).is_some_and(|found| *found <= key);
            low += if is_above { half } else { 0 };
            count -= half;
        }
        if self.keys.get(low) == Some(&key) { self.factors.get(low) } else { None }
    }
}

impl Visibility {
    /// Returns the same table in borrowed form.
    #[inline]
    #[must_use]
    pub fn as_view(&self) -> VisibilityView<'_> {
        self.view()
    }

    /// Returns the number of bytes that the table takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.view().bytes()
    }

    /// Returns the table as bytes: see [`VisibilityView::to_bytes`].
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.view().to_bytes()
    }

    /// Returns the number of regions that have entries: those where anything is known that would gain anything.
    #[must_use]
    pub fn region_count(&self) -> usize {
        self.view().region_count()
    }
}

impl<'a> VisibilityView<'a> {
    /// Returns the number of bytes that the table takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.byte_size() + size_of::<VisibilityHeader>()
    }

    /// Returns the number of regions that have entries: those where anything is known that would gain anything.
    #[must_use]
    pub fn region_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns the table as bytes, to be written to disk, mapped or shared, and to be read by [`Self::from_bytes`] on a
    /// machine of the same byte order.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = [self.header];
        let mut sections = Vec::new();
        sections.push(Section::new(VisibilityHeader::TAG, VisibilityHeader::VERSION, &header));
        self.append_sections(&mut sections);
        write(&sections)
    }

    /// Borrows a table from bytes that [`Self::to_bytes`] wrote, without a copy. `bytes` must start at a multiple of
    /// four.
    ///
    /// # Errors
    ///
    /// If the bytes are not aligned, are cut off, are of another version or byte order, or hold anything that sampling
    /// could stumble over. Bytes from an untrusted source are safe to load. Any factors are valid: bad ones only make
    /// noise.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut sections = Sections::new(bytes)?;
        let header =
            sections.take_value(VisibilityHeader::TAG, VisibilityHeader::VERSION, "parameters of visibility")?;
        let view = Self::from_sections(&mut sections, (header,))?;
        sections.end()?;
        view.validate()?;
        Ok(view)
    }

    /// Returns a copy that owns its memory.
    #[must_use]
    pub fn to_owned(&self) -> Visibility {
        Visibility {
            header: self.header,
            regions: self.regions.to_vec(),
            starts: self.starts.to_vec(),
            keys: self.keys.to_vec(),
            factors: self.factors.to_vec(),
        }
    }

    /// Whether nothing is known of any region, or nothing that would gain anything.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Returns the entries of the region that a shading point is in.
    #[inline]
    pub(crate) fn at(&self, x: &ShadingPoint) -> Option<RegionFactors<'a>> {
        let region = find(self.regions, orientation(&x.receiver), x.position)? as usize;
        let (start, end) = (*self.starts.get(region)?, *self.starts.get(region + 1)?);
        let range = start as usize..end as usize;
        Some(RegionFactors { keys: self.keys.get(range.clone())?, factors: self.factors.get(range)? })
    }
}

/// Returns the root that a receiver belongs to: that of the axis which is nearest to its normal, or the last one for a
/// receiver without a side.
#[inline]
pub(crate) fn orientation(receiver: &Receiver) -> usize {
    if !receiver.has_horizon() {
        return ORIENTATIONS - 1;
    }
    let normal = receiver.normal().to_array();
    let size = normal.map(f32::abs);
    let mut axis = usize::from(size[1] > size[0]);
    if size[2] > size[axis] {
        axis = 2;
    }
    2 * axis + usize::from(normal[axis] < 0.0)
}

/// Returns the region that a position is in.
#[inline]
pub(super) fn find(nodes: &[RegionNode], root: usize, position: Vec3) -> Option<u32> {
    let coordinates = position.to_array();
    let mut node = nodes.get(root)?;
    loop {
        match node.kind {
            REGION => return Some(node.first),
            axis => {
                let coordinate = coordinates.get(axis as usize)?;
                // Forward, so that this ends. Written as a negated comparison so that NaN is below every plane.
                node = nodes.get(node.first as usize + usize::from(*coordinate >= node.plane))?;
            }
        }
    }
}
