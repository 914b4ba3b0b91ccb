//! The bright features in groups, as they are looked for at one shading point.

use crate::receiver::ReceiverKind;
use crate::technique::Viewpoint;

/// Most groups. Chosen on skies of many lamps, not swept.
///
/// Larger: wide groups become smaller ones, each of which costs a walk down the tree over the lights. Smaller: lamps
/// far from each other share a group, and with it the cosine.
pub(super) const MAX_GROUPS: usize = 32;

/// Largest angular radius of a group of several features, as a sine. Chosen on skies of many lamps, not swept; against
/// groups of one feature, measured (docs/ACCURACY.md, "Bright features").
///
/// Larger: the cosine varies within a group. Smaller: more walks down the tree over the lights.
const GROUP_RADIUS: f32 = 0.12;

/// A group of features that may be visible.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    /// Node of the tree over the features.
    pub(super) node: u32,
    /// Mean weight of its directions for the receiver.
    pub(super) cosine: f32,
}

/// Groups that hold all features over the horizon of a shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Groups {
    groups: [Group; MAX_GROUPS],
    len: usize,
}

impl Groups {
    /// No group yet.
    #[inline(always)]
    pub(super) fn empty() -> Self {
        Self { groups: [Group::default(); MAX_GROUPS], len: 0 }
    }

    /// Divides the widest group until all are narrow, or there are as many as there can be.
    #[inline(always)]
    pub(super) fn fill(&mut self, at: &Viewpoint<'_>) {
        self.add(0, at);
        if at.scene.environment.feature_nodes()[0].is_single == 0 {
            self.divide(at);
        }
    }

    #[inline(never)]
    fn divide(&mut self, at: &Viewpoint<'_>) {
        let nodes = at.scene.environment.feature_nodes();
        while self.len < MAX_GROUPS {
            let (mut widest, mut radius) = (None, GROUP_RADIUS);
            for (i, group) in self.as_slice().iter().enumerate() {
                let node = &nodes[group.node as usize];
                if node.is_single == 0 && node.sin_radius > radius {
                    (widest, radius) = (Some(i), node.sin_radius);
                }
            }
            let Some(widest) = widest else { break };
            let first = self.groups[widest].node as usize + 1;
            self.len -= 1;
            self.groups[widest] = self.groups[self.len];
            self.add(first, at);
            self.add(nodes[first].next as usize, at);
        }
    }

    pub(super) fn as_slice(&self) -> &[Group] {
        &self.groups[..self.len]
    }

    /// Adds a node that is not below the horizon.
    fn add(&mut self, node: usize, at: &Viewpoint<'_>) {
        let environment = &at.scene.environment;
        let sin_radius = environment.feature_nodes()[node].sin_radius;
        let cosine = at.x.receiver.mean_over_cone(environment.feature_axis(node), sin_radius);
        // A cone that may hold everything has no horizon, and at least the mean of a sphere.
        let cosine = if sin_radius < 1.0 { cosine } else { cosine.max(0.25) };
        if cosine > 0.0 {
            self.groups[self.len] = Group { node: node as u32, cosine };
            self.len += 1;
        }
    }
}
