//! What few scenes have: light groups, profiles, distant lights and motion, in one buffer, so that all others carry one
//! slice more.
//!
//! The buffer is empty where a scene has none of them. Otherwise it is an [`ExtrasHeader`], and then the arrays that it
//! counts.

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};

use super::Lights;
use super::distant_record::{DistantGroup, DistantRecord};
use super::motion::{Motion, MotionCollection};
use super::profiles::Profiles;
use crate::error::Error;
use crate::receiver::ALL_GROUPS;

/// Numbers of elements of the arrays, in their order.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct ExtrasHeader {
    /// Light groups of every leaf, and then of the environment as a light; none if all lights are in all groups.
    groups: u32,
    /// Distant lights that can send something, neighbors in direction next to each other.
    distants: u32,
    /// Groups of neighbors in direction.
    distant_groups: u32,
    /// Where each profile starts among the values, and the end; none without profiles.
    profile_starts: u32,
    /// Tables of the profiles.
    profile_values: u32,
    /// What moves. Always the last array, so that it can be replaced by one of another length.
    motion: u32,
}

const _: () = assert!(size_of::<ExtrasHeader>() == 24);

/// Words of an [`ExtrasHeader`].
const EXTRAS_HEADER_WORDS: usize = size_of::<ExtrasHeader>() / size_of::<u32>();
/// Words of a distant light.
const DISTANT: usize = size_of::<DistantRecord>() / size_of::<u32>();
/// Words of a group of distant lights.
const DISTANT_GROUP: usize = size_of::<DistantGroup>() / size_of::<u32>();

/// The buffer in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extras<'a>(pub(super) &'a [u32]);

/// Returns the buffer of these arrays.
pub(super) fn pack(
    groups: &[u32],
    distants: &[DistantRecord],
    distant_groups: &[DistantGroup],
    [profile_starts, profile_values]: [&[u32]; 2],
    motion: &[u32],
) -> Vec<u32> {
    if groups.is_empty() && distants.is_empty() && profile_starts.is_empty() && motion.is_empty() {
        return Vec::new();
    }
    let header = ExtrasHeader {
        groups: groups.len() as u32,
        distants: distants.len() as u32,
        distant_groups: distant_groups.len() as u32,
        profile_starts: profile_starts.len() as u32,
        profile_values: profile_values.len() as u32,
        motion: motion.len() as u32,
    };
    let arrays = [
        bytemuck::cast_slice(core::slice::from_ref(&header)),
        groups,
        bytemuck::cast_slice(distants),
        bytemuck::cast_slice(distant_groups),
        profile_starts,
        profile_values,
        motion,
    ];
    arrays.concat()
}

/// Replaces what moves by something else.
fn replace_motion(extras: &mut Vec<u32>, motion: &[u32]) {
    if extras.is_empty() {
        *extras = pack(&[], &[], &[], [&[]; 2], motion);
        return;
    }
    let header = Extras(extras).header();
    extras.truncate(extras.len() - (header.motion as usize).min(extras.len()));
    let header = ExtrasHeader { motion: motion.len() as u32, ..header };
    if let Some(place) = extras.get_mut(..EXTRAS_HEADER_WORDS) {
        place.copy_from_slice(bytemuck::cast_slice(core::slice::from_ref(&header)));
    }
    extras.extend_from_slice(motion);
    if extras.iter().all(|word| *word == 0) {
        extras.clear();
    }
}

impl Lights {
    /// Changes what moves.
    pub(super) fn update_motion(&mut self, change: impl FnOnce(&mut MotionCollection)) {
        let mut motion = MotionCollection::of(self.view().extras().motion());
        change(&mut motion);
        replace_motion(&mut self.extras, &motion.pack());
    }
}

/// Replaces the distant lights and their groups by as many others.
pub(super) fn replace_distants(extras: &mut [u32], distants: &[DistantRecord], distant_groups: &[DistantGroup]) {
    let start = EXTRAS_HEADER_WORDS + Extras(extras).header().groups as usize;
    let (distants, groups): (&[u32], &[u32]) = (bytemuck::cast_slice(distants), bytemuck::cast_slice(distant_groups));
    let middle = start + distants.len();
    if let Some(place) = extras.get_mut(start..middle) {
        place.copy_from_slice(distants);
    }
    if let Some(place) = extras.get_mut(middle..middle + groups.len()) {
        place.copy_from_slice(groups);
    }
}

impl<'a> Extras<'a> {
    /// Nothing.
    pub(super) const NONE: Self = Self(&[]);

    /// Whether the scene has none of what is kept here.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    #[inline]
    fn header(self) -> ExtrasHeader {
        self.0
            .get(..EXTRAS_HEADER_WORDS)
            .map_or_else(ExtrasHeader::default, |words| *bytemuck::from_bytes(bytemuck::cast_slice(words)))
    }

    /// Returns `count` words, after `before` words of the arrays before. Words that are not there, which validation
    /// refuses, give none.
    #[inline]
    fn words(self, before: usize, count: usize) -> &'a [u32] {
        let start = EXTRAS_HEADER_WORDS + before;
        self.0.get(start..start + count).unwrap_or(&[])
    }

    /// Returns the light groups of every leaf and of the environment; nothing if all lights are in all groups.
    #[inline]
    fn groups(self) -> &'a [u32] {
        self.words(0, self.header().groups as usize)
    }

    /// Returns the light groups of a leaf.
    #[inline(always)]
    pub(crate) fn groups_of(self, leaf: u32) -> u32 {
        if self.is_empty() { ALL_GROUPS } else { self.groups().get(leaf as usize).copied().unwrap_or(ALL_GROUPS) }
    }

    /// Returns the light groups of the environment as a light.
    pub(crate) fn groups_of_environment(self) -> u32 {
        self.groups().last().copied().unwrap_or(ALL_GROUPS)
    }

    /// Returns the distant lights.
    pub(crate) fn distants(self) -> &'a [DistantRecord] {
        let ExtrasHeader { groups, distants, .. } = self.header();
        bytemuck::cast_slice(self.words(groups as usize, distants as usize * DISTANT))
    }

    /// Returns the groups of distant lights.
    pub(crate) fn distant_groups(self) -> &'a [DistantGroup] {
        let ExtrasHeader { groups, distants, distant_groups, .. } = self.header();
        let before = groups as usize + distants as usize * DISTANT;
        bytemuck::cast_slice(self.words(before, distant_groups as usize * DISTANT_GROUP))
    }

    /// Returns the profiles.
    pub(super) fn profiles(self) -> Profiles<'a> {
        let ExtrasHeader { groups, distants, distant_groups, profile_starts, profile_values, .. } = self.header();
        let [starts, values] = [profile_starts, profile_values].map(|count| count as usize);
        let before = groups as usize + distants as usize * DISTANT + distant_groups as usize * DISTANT_GROUP;
        let values = bytemuck::cast_slice(self.words(before + starts, values));
        Profiles { starts: self.words(before, starts), values }
    }

    /// Returns what moves.
    #[inline]
    pub(crate) fn motion(self) -> Motion<'a> {
        let start = self.0.len().saturating_sub(self.header().motion as usize);
        Motion(self.0.get(start..).unwrap_or(&[]))
    }

    /// Checks that the arrays are where the header says, and what they hold. `leaves` is the number of lights in the
    /// tree, `check_distants` what checks distant lights and their groups.
    pub(super) fn validate(
        self,
        leaves: usize,
        check_distants: impl FnOnce(&[DistantRecord], &[DistantGroup]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if self.is_empty() {
            return Ok(());
        }
        let ExtrasHeader { groups, distants, distant_groups, profile_starts, profile_values, motion } = self.header();
        let counts = [
            (groups, 1),
            (distants, DISTANT),
            (distant_groups, DISTANT_GROUP),
            (profile_starts, 1),
            (profile_values, 1),
            (motion, 1),
        ];
        let words =
            counts.iter().fold(EXTRAS_HEADER_WORDS as u64, |sum, (count, size)| sum + u64::from(*count) * *size as u64);
        if words != self.0.len() as u64 {
            return Err(Error::bytes("length of groups, profiles, distant lights and motion", 0, self.0.len(), words));
        }
        if groups > 0 {
            Error::unless_equal("number of light groups", groups as usize, leaves + 1)?;
        }
        check_distants(self.distants(), self.distant_groups())?;
        self.motion().validate()?;
        self.profiles().validate()
    }
}

/// Returns the header and the arrays, with room for a header where there was none.
fn header_mut(extras: &mut Vec<u32>) -> &mut ExtrasHeader {
    if extras.is_empty() {
        extras.resize(EXTRAS_HEADER_WORDS, 0);
    }
    bytemuck::from_bytes_mut(bytemuck::cast_slice_mut(&mut extras[..EXTRAS_HEADER_WORDS]))
}

/// Replaces the distant lights and their groups.
pub(super) fn set_distants(extras: &mut Vec<u32>, distants: &[DistantRecord], distant_groups: &[DistantGroup]) {
    let header = header_mut(extras);
    let start = EXTRAS_HEADER_WORDS + header.groups as usize;
    let end = start + header.distants as usize * DISTANT + header.distant_groups as usize * DISTANT_GROUP;
    (header.distants, header.distant_groups) = (distants.len() as u32, distant_groups.len() as u32);
    let words: [&[u32]; 2] = [bytemuck::cast_slice(distants), bytemuck::cast_slice(distant_groups)];
    extras.splice(start..end, words.concat());
}

/// Gives every leaf light groups of its own, all for now, if they have none. Returns whether they had none.
pub(super) fn add_groups(extras: &mut Vec<u32>, leaves: usize) -> bool {
    let header = header_mut(extras);
    let is_new = header.groups == 0;
    if is_new {
        header.groups = leaves as u32 + 1;
        extras.splice(EXTRAS_HEADER_WORDS..EXTRAS_HEADER_WORDS, core::iter::repeat_n(ALL_GROUPS, leaves + 1));
    }
    is_new
}

/// Makes room for the light groups of `leaves` leaves, if leaves have light groups, and for more later. Those of the
/// environment stay the last.
pub(super) fn resize_groups(extras: &mut Vec<u32>, leaves: usize) {
    let groups = Extras(extras).header().groups as usize;
    if groups > 0 && groups < leaves + 1 {
        let more = (2 * groups).max(leaves + 1) - groups;
        let end = EXTRAS_HEADER_WORDS + groups - 1;
        header_mut(extras).groups += more as u32;
        extras.splice(end..end, core::iter::repeat_n(ALL_GROUPS, more));
    }
}

/// Sets the light groups of a leaf, if leaves have light groups.
pub(super) fn set_groups(extras: &mut [u32], leaf: u32, groups: u32) {
    let count = Extras(extras).header().groups as usize;
    if (leaf as usize) + 1 < count {
        extras[EXTRAS_HEADER_WORDS + leaf as usize] = groups;
    }
}

/// Returns the buffer with the light groups of these leaves alone, in this order.
pub(super) fn in_order(extras: Extras<'_>, leaves: &[u32]) -> Vec<u32> {
    let header = extras.header();
    if header.groups == 0 {
        return extras.0.to_vec();
    }
    let own = leaves.iter().map(|&leaf| extras.groups_of(leaf));
    let groups: Vec<u32> = own.chain([extras.groups_of_environment()]).collect();
    let profiles = extras.profiles();
    let arrays = [profiles.starts, bytemuck::cast_slice(profiles.values)];
    pack(&groups, extras.distants(), extras.distant_groups(), arrays, extras.motion().0)
}
