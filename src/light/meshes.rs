//! Which mesh a light belongs to, and what its weight has been multiplied by since the build.

/// Returns the mesh that holds a triangle, by the numbers at which the meshes start (and, at last, the one at which
/// they end).
#[inline]
pub(super) fn mesh_of(starts: &[u32], index: u32) -> usize {
    let last = starts.len().saturating_sub(2);
    if last == 0 {
        return 0;
    }
    let total = starts.last().map_or(1, |&end| u64::from(end.max(1)));
    // Meshes are often of similar sizes: search around the position that the mesh would have if all were equal.
    let guess = ((u64::from(index) * (last as u64 + 1) / total) as usize).min(last);
    let (mut low, mut high, mut reach) = (guess, guess + 1, 1);
    while low > 0 && starts[low] > index {
        low = low.saturating_sub(reach);
        reach *= 2;
    }
    while high <= last && starts[high] <= index {
        high = (high + reach).min(last + 1);
        reach *= 2;
    }
    (low + starts[low..high].partition_point(|&start| start <= index)).saturating_sub(1)
}

/// Returns what the weight of a triangle is multiplied by: 1 without factors.
#[inline]
pub(super) fn scale_of(factors: &[f32], starts: &[u32], index: u32) -> f32 {
    if factors.is_empty() {
        return 1.0;
    }
    factors.get(mesh_of(starts, index)).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::mesh_of;
    use crate::testing::Pcg32;
    use alloc::vec::Vec;

    #[test]
    fn every_triangle_is_in_its_mesh() {
        let mut pcg = Pcg32::new(1, 51);
        for round in 0..200 {
            // Meshes of all sizes, and empty ones.
            let mut starts = Vec::from([0]);
            for _ in 0..1 + pcg.below(60) {
                let size = pcg.below(1 << (round % 9)) * pcg.below(2);
                starts.push(starts[starts.len() - 1] + size);
            }
            for mesh in 0..starts.len() - 1 {
                (starts[mesh]..starts[mesh + 1]).for_each(|index| assert_eq!(mesh_of(&starts, index), mesh));
            }
        }
    }
}
