//! Groups of neighboring bright texels, each of which may become a bright feature.

use alloc::vec;
use alloc::vec::Vec;

use glam::{Vec2, Vec3};

use super::feature_texel::{from_morton, to_morton};
use crate::warp::equal_area::{square_to_sphere, wrap_texel_log2};

/// Most doublings of a cap. *Proved* to be enough wherever the mean of the capped image is at least 2^-60 of the
/// brightest texel, and 1e-30 to 1e30 is 2^200: a feature that is too large after all of them goes back into the rest.
///
/// Larger: a longer search in images of even more contrast. Smaller: their features may be missed.
pub(super) const MAX_DOUBLINGS: u32 = 60;

/// A texel above the cap: its Morton code and its radiance.
pub(super) type BrightTexel = (u32, f32);

/// Bright texels that are connected, sorted by code.
#[derive(Clone, Debug)]
pub(super) struct TexelCluster {
    pub(super) texels: Vec<BrightTexel>,
    /// Radiance above which the texels belong to the feature.
    pub(super) cap: f32,
}

/// Groups neighboring bright texels. The cap of a group that is too large is doubled, again and again, and the group
/// falls apart.
pub(super) fn clusters(depth: u32, bright: Vec<BrightTexel>, cap: f32, sin_radius: f32) -> Vec<TexelCluster> {
    let mut found = Vec::new();
    let mut open = vec![(bright, cap, 0)];
    while let Some((bright, cap, doublings)) = open.pop() {
        for texels in connected(depth, &bright) {
            if radius(depth, &texels) <= sin_radius {
                found.push(TexelCluster { texels, cap });
            } else if doublings < MAX_DOUBLINGS {
                let brighter: Vec<_> = texels.into_iter().filter(|&(_, v)| v > 2.0 * cap).collect();
                open.push((brighter, 2.0 * cap, doublings + 1));
            }
        }
    }
    found
}

/// All groups of texels that are connected over edges or corners.
fn connected(depth: u32, bright: &[BrightTexel]) -> Vec<Vec<BrightTexel>> {
    let mut taken = vec![false; bright.len()];
    let mut groups = Vec::new();
    for start in 0..bright.len() {
        if taken[start] {
            continue;
        }
        taken[start] = true;
        let mut open = vec![start];
        let mut group = Vec::new();
        while let Some(at) = open.pop() {
            group.push(bright[at]);
            let [x, y] = from_morton(bright[at].0).map(|v| v as i32);
            for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let (i, j) = wrap_texel_log2(x + dx, y + dy, depth);
                let neighbor = bright.binary_search_by_key(&to_morton(i, j), |&(code, _)| code);
                if let Some(next) = neighbor.ok().filter(|next| !taken[*next]) {
                    taken[next] = true;
                    open.push(next);
                }
            }
        }
        group.sort_unstable_by_key(|&(code, _)| code);
        groups.push(group);
    }
    groups
}

/// Sine of the angular radius of a group around its center; 1 from a right angle on.
pub(super) fn radius(depth: u32, texels: &[BrightTexel]) -> f32 {
    let axis = texels.iter().map(|&(code, v)| center(depth, code) * v).sum::<Vec3>().normalize_or(Vec3::Z);
    texels.iter().fold(0.0, |sin: f32, &(code, _)| {
        let direction = center(depth, code);
        sin.max(if axis.dot(direction) > 0.0 { axis.cross(direction).length() } else { 1.0 })
    })
}

/// Direction of a texel's center.
fn center(depth: u32, code: u32) -> Vec3 {
    let side = 1.0 / (1_u32 << depth) as f32;
    let [x, y] = from_morton(code);
    square_to_sphere(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * side)
}
