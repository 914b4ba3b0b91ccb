//! An edited tree is the fit of its own shape, and refers to every leaf once.

use alloc::collections::BTreeMap;

use super::*;
use crate::geometry::{Aabb, Cone};
use crate::testing::Pcg32;
use crate::tlas::MAX_LEAVES;
use glam::Vec3;

/// Lights by their numbers, and what is in each leaf.
#[derive(Default)]
struct Store {
    lights: BTreeMap<u32, (LightBounds, Moments)>,
    leaves: Vec<Option<u32>>,
    leaf_of: BTreeMap<u32, u32>,
}

impl LeafStore for Store {
    type Leaf = u32;

    fn bounds(&self, light: &u32) -> (LightBounds, Moments) {
        self.lights[light]
    }

    fn get(&self, leaf: u32) -> u32 {
        self.leaves[leaf as usize].expect("the leaf is in use")
    }

    fn groups(&self, leaf: u32) -> u32 {
        1 << (self.get(leaf) % 5)
    }

    fn take(&mut self, leaf: u32) -> u32 {
        self.leaves[leaf as usize].take().expect("the leaf is in use")
    }

    fn put(&mut self, leaf: u32, light: u32) {
        assert!(self.leaves[leaf as usize].replace(light).is_none(), "the leaf is in use");
        self.leaf_of.insert(light, leaf);
    }

    fn resize(&mut self, leaves: usize) {
        self.leaves.resize(leaves, None);
    }
}

fn light(pcg: &mut Pcg32) -> (LightBounds, Moments) {
    let position = Vec3::from_array([0; 3].map(|_| pcg.next_f32()));
    let normal = Vec3::from_array([0; 3].map(|_| pcg.next_f32() - 0.5)).normalize_or(Vec3::Z);
    let size = if pcg.below(5) == 0 { 0.5 } else { 0.01 };
    let flux = if pcg.below(20) == 0 { 0.0 } else { 0.01 + pcg.next_f32() };
    let aabb = Aabb { min: position, max: position + size };
    let emission = core::f32::consts::FRAC_PI_2;
    let bounds = LightBounds { aabb, normals: Cone::single(normal), emission, flux, portal: 0.0, two_sided: false };
    let mean = position + 0.5 * size;
    (bounds, Moments { energy: flux, mean, variance: 0.1 * size * size, normal })
}

/// Checks an edited tree against a fit of its shape.
fn check(tlas: &Tlas, state: &TreeState, store: &Store) {
    let (laid_out, _, order) = relayout(&tlas.view());
    laid_out.view().validate().expect("the tree is sound");
    assert!(order.len() == store.lights.len() && order.len() < MAX_LEAVES);
    for (&light, &leaf) in store.leaf_of.iter().filter(|(light, _)| store.lights.contains_key(light)) {
        assert!(tlas.view().has_leaf(leaf) && store.get(leaf) == light);
    }
    let mut fresh = laid_out.clone();
    let cost = fresh.fit(&|leaf| store.bounds(&store.get(order[leaf as usize])));
    assert!(fresh.nodes == laid_out.nodes, "an edit has left other bounds");
    assert!((cost - state.nodes[0].fitted.relative_cost()).abs() <= 1e-9 * cost);
    let free = tlas.leaves.iter().filter(|slot| **slot == Slot::FREE).count();
    assert_eq!(free, state.free_leaves.count());
    assert_eq!(tlas.parents.iter().filter(|slot| **slot == Slot::FREE).count(), state.free_nodes.count());
    // Every node but the root has at least two leaves below it.
    let is_narrow = |(node, slot): (usize, &Slot)| {
        *slot != Slot::FREE && *slot != Slot::ROOT && state.nodes[node].fitted.leaf_count() < 2.0
    };
    assert!(!tlas.parents.iter().enumerate().any(is_narrow), "a node stands for one leaf");
    assert!(tlas.leaves.len() as f32 <= 1.5 * order.len() as f32 + FEW_FREE as f32 + 1.0, "places leak");
    if !tlas.groups.is_empty() {
        let mut noted = laid_out.clone();
        noted.groups.clear();
        let all = tlas.groups[..tlas.arity.lanes()].iter().fold(0, |all, groups| all | groups);
        let below = order.iter().fold(0, |all, &leaf| all | store.groups(leaf));
        assert_eq!(all, below);
    }
}

fn edit_randomly(arity: Arity, rounds: usize, seed: u64, has_groups: bool) {
    let mut pcg = Pcg32::new(seed, 72);
    let (mut tlas, mut state, mut store) = (Tlas::empty(arity), TreeState::default(), Store::default());
    TreeEdit { tlas: &mut tlas, state: &mut state, store: &mut store }.prepare();
    if has_groups {
        tlas.groups = alloc::vec![0; tlas.parents.len() * arity.lanes()];
    }
    let mut next = 0;
    for round in 0..rounds {
        let mut edit = TreeEdit { tlas: &mut tlas, state: &mut state, store: &mut store };
        // It grows, and then it shrinks.
        let grows = round < rounds / 2;
        for _ in 0..pcg.below(60) {
            let known = edit.store.lights.len() as u32;
            let nth = |store: &Store, n: u32| *store.lights.keys().nth(n as usize).expect("there are as many");
            match pcg.below(6) {
                0 | 1 if grows => {
                    edit.store.lights.insert(next, light(&mut pcg));
                    edit.insert(next);
                    next += 1;
                }
                0..=3 if known > 0 && (!grows || pcg.below(3) == 0) => {
                    let light = nth(edit.store, pcg.below(known));
                    let leaf = edit.store.leaf_of[&light];
                    assert_eq!(edit.remove(leaf), light);
                    edit.store.lights.remove(&light);
                    edit.store.leaf_of.remove(&light);
                }
                _ if known > 0 => {
                    let number = nth(edit.store, pcg.below(known));
                    edit.store.lights.insert(number, light(&mut pcg));
                    let leaf = edit.store.leaf_of[&number];
                    edit.update(leaf);
                }
                _ => {}
            }
        }
        edit.finish(arity);
        check(&tlas, &state, &store);
    }
}

#[test]
fn an_edited_tree_is_the_fit_of_its_shape() {
    for (seed, arity) in (0..).zip([Arity::Four, Arity::Eight, Arity::Sixteen]) {
        edit_randomly(arity, 60, seed, seed == 1);
    }
}

/// Adds equal lights, in batches of `batch`, and checks the tree.
fn add_equal(batch: u32) {
    let (mut tlas, mut state, mut store) = (Tlas::empty(Arity::Four), TreeState::default(), Store::default());
    let mut pcg = Pcg32::new(9, 73);
    let same = light(&mut pcg);
    TreeEdit { tlas: &mut tlas, state: &mut state, store: &mut store }.prepare();
    for first in (0..3000).step_by(batch as usize) {
        let mut edit = TreeEdit { tlas: &mut tlas, state: &mut state, store: &mut store };
        for number in first..first + batch {
            edit.store.lights.insert(number, same);
            edit.insert(number);
        }
        edit.finish(Arity::Four);
    }
    check(&tlas, &state, &store);
    let tree = tlas.view().wide::<4>();
    let deepest = (0..tlas.leaves.len()).filter(|&leaf| tlas.leaves[leaf] != Slot::FREE);
    let deepest = deepest.map(|leaf| tree.path(leaf as u32).count()).max();
    assert!(deepest <= Some(40), "{deepest:?}");
}

#[test]
fn lights_at_one_place_make_no_deep_tree() {
    [1, 300, 1000].into_iter().for_each(add_equal);
}
