//! What a batch of edits makes of the motion of lights: where what it adds or changes is at the end of the shutter
//! interval.

use alloc::vec::Vec;

use super::changes::{Changes, MeshChange};
use crate::light::motion::{EndColumns, EndVertices};
use crate::light::{LightCollection, Lights};

impl MeshChange {
    /// Returns the vertices of all triangles at the end of the interval, of none if the mesh stands still; `None` if
    /// they stay what they are.
    pub(super) fn ends<'c>(&'c self, collection: &'c LightCollection<'_>) -> Option<&'c [EndVertices]> {
        match (&self.vertices, self.added) {
            _ if self.is_removed => Some(&[]),
            (Some(vertices), _) => Some(&vertices.end),
            (None, Some(added)) => Some(collection.ends(added)),
            (None, None) => None,
        }
    }
}

/// Sets where all that is added or changed is at the end of the interval, and forgets what is removed. Places of new
/// meshes are known.
pub(super) fn update(lights: &mut Lights, collection: &LightCollection<'_>, (_, meshes, instances): Changes<'_>) {
    let motion = lights.view().extras().motion();
    let ends = |(&number, change): (&u32, _)| {
        let [first, end] = [number, number + 1].map(|mesh| lights.meshes[mesh as usize]);
        let ends = MeshChange::ends(change, collection)?;
        if first == end {
            // No triangles, so that the place is that of another mesh.
            return None;
        }
        (!ends.is_empty() || motion.moves_mesh(first)).then(|| (first, ends.to_vec()))
    };
    let meshes: Vec<(u32, Vec<EndVertices>)> = meshes.iter().filter_map(ends).collect();
    let ends = instances.iter().map(|(&number, change)| (number, change.and_then(|change| change.end)));
    let moves = |(number, end): &(u32, Option<EndColumns>)| end.is_some() || motion.end_of_instance(*number).is_some();
    let instances: Vec<(u32, Option<EndColumns>)> = ends.filter(moves).collect();
    if meshes.is_empty() && instances.is_empty() {
        return;
    }
    lights.update_motion(|motion| {
        meshes.into_iter().for_each(|(first, ends)| motion.set_mesh(first, ends));
        instances.into_iter().for_each(|(number, end)| motion.set_instance(number, end));
    });
}
