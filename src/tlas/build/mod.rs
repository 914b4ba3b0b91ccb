//! How the tree is made: first bright lights and those of different size are set apart ([`classes`]), then a binary
//! tree arranges those of each class ([`binary`]), then comes the wide tree whose nodes are cuts through it
//! ([`collapse`]), and last what its nodes say of their children ([`fit`]).

mod binary;
mod bins;
mod classes;
mod cluster;
mod collapse;
mod encode;
mod fit;
mod forest;
mod groups;

use alloc::vec::Vec;

use smallvec::SmallVec;

use binary::{BinaryNode, join};
use classes::{MOST_CLASSES, divide, outshining};
use cluster::Item;
use collapse::collapse;
use groups::divide_groups;

pub(super) use fit::Fitted;

use crate::bounds::LightBounds;
use crate::parallel;
use crate::progress::{Cancelled, Progress};
use crate::tlas::arity::Arity;
use crate::tlas::tree::Tlas;

/// Arranges `count` lights, whose bounds `light` returns, in a tree of this arity, or of a lower one that holds
/// them all in one node. Returns it with the lights in the order of its leaves; its nodes know no bounds until
/// [`Tlas::fit`]. Every light that has found its place is a unit of progress.
#[cfg(test)]
pub(crate) fn build(
    arity: Arity,
    count: usize,
    light: &(impl Fn(u32) -> LightBounds + Sync),
    progress: &Progress<'_>,
) -> Result<(Tlas, Vec<u32>), Cancelled> {
    build_in_groups(arity, count, light, &[], progress)
}

/// Arranges `count` lights, whose bounds `light` returns, in a tree of this arity, or of a lower one that holds
/// them all in one node. `groups` are the light groups of each, or nothing. Returns the tree with the lights in the
/// order of its leaves; its nodes know no bounds until [`Tlas::fit`]. Every light that has found its place is a unit of
/// progress.
pub(crate) fn build_in_groups(
    arity: Arity,
    count: usize,
    light: &(impl Fn(u32) -> LightBounds + Sync),
    groups: &[u32],
    progress: &Progress<'_>,
) -> Result<(Tlas, Vec<u32>), Cancelled> {
    if count == 0 {
        return Ok((Tlas::empty(arity), Vec::new()));
    }
    let arity = arity.narrowed_to(count);
    let mut items = parallel::collect(count, |i| Item::new(&light(i as u32), i as u32));
    let mut binary: Vec<BinaryNode> = bytemuck::zeroed_vec(2 * count - 1);
    let classes = set_apart(&mut items, groups, arity);
    join(&mut items, &mut binary, &classes, progress);
    progress.check()?;
    drop(items);
    let (mut tlas, order) = match arity {
        Arity::Four => collapse::<4>(arity, &binary),
        Arity::Eight => collapse::<8>(arity, &binary),
        Arity::Sixteen => collapse::<16>(arity, &binary),
    };
    if !groups.is_empty() {
        tlas.note_groups(|leaf| groups[order[leaf as usize] as usize]);
    }
    Ok((tlas, order))
}

/// Sorts lights into the classes that have trees of their own. Returns the number of lights in each.
fn set_apart(items: &mut [Item], groups: &[u32], arity: Arity) -> SmallVec<[usize; 2 * MOST_CLASSES]> {
    let bright = outshining(items, arity);
    let others = &mut items[bright..];
    // At least two lanes for a class.
    let most = (arity.lanes() - bright) / 2;
    let others =
        if groups.is_empty() { divide(others, most.min(MOST_CLASSES)) } else { divide_groups(others, groups, most) };
    core::iter::repeat_n(1, bright).chain(others).collect()
}

/// Arranges lights in a tree of just this arity, without a look at their sizes or groups: a part of a larger tree.
/// Returns what [`build_in_groups`] does; `None` for fewer than two lights.
pub(super) fn arrange(arity: Arity, lights: &[LightBounds]) -> Option<(Tlas, Vec<u32>)> {
    let count = lights.len();
    if count < 2 {
        return None;
    }
    let mut items = parallel::collect(count, |i| Item::new(&lights[i], i as u32));
    let mut binary: Vec<BinaryNode> = bytemuck::zeroed_vec(2 * count - 1);
    join(&mut items, &mut binary, &[count], &Progress::new(None, 1.0));
    Some(match arity {
        Arity::Four => collapse::<4>(arity, &binary),
        Arity::Eight => collapse::<8>(arity, &binary),
        Arity::Sixteen => collapse::<16>(arity, &binary),
    })
}
