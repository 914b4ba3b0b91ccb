//! A binary light tree collapsed to arity 8, as in the talk (Ogaki 2020): every wide node is a cut through the binary
//! one.

use super::binary_tree::BinaryTree;
use super::light_bounds::LightBounds;

const ARITY: usize = 8;

/// A child of a node.
struct Lane {
    bounds: LightBounds,
    /// Node, or light of a leaf.
    child: Result<u32, u32>,
}

pub(crate) struct WideTree {
    nodes: Vec<Vec<Lane>>,
    /// Where each light hangs.
    lights: Vec<(u32, u32)>,
    /// Where each node hangs; the root hangs on itself.
    parents: Vec<(u32, u32)>,
}

impl WideTree {
    pub(crate) fn new(binary: &BinaryTree) -> Self {
        let mut tree = Self { nodes: vec![], lights: vec![], parents: vec![] };
        tree.collapse(binary, 0, (0, 0));
        tree
    }

    /// Adds the wide node of a binary one: the member of the largest cost is replaced until the node is full.
    fn collapse(&mut self, binary: &BinaryTree, at: usize, parent: (u32, u32)) -> u32 {
        let number = self.nodes.len();
        self.nodes.push(vec![]);
        self.parents.push(parent);
        let mut cut = vec![at];
        while cut.len() < ARITY {
            let inner = (0..cut.len()).filter(|&i| binary.node(cut[i]).1.is_ok());
            let cost = |i: usize| binary.node(cut[i]).0.cost();
            let Some(worst) = inner.max_by(|&i, &j| cost(i).total_cmp(&cost(j))) else { break };
            if let Ok([first, second]) = binary.node(cut[worst]).1 {
                cut[worst] = first;
                cut.push(second);
            }
        }
        for (lane, &member) in (0..).zip(&cut) {
            let (bounds, content) = binary.node(member);
            let place = (number as u32, lane);
            let child = match content {
                Ok(_) => Ok(self.collapse(binary, member, place)),
                Err(light) => {
                    let count = self.lights.len().max(light + 1);
                    self.lights.resize(count, (0, 0));
                    self.lights[light] = place;
                    Err(light as u32)
                }
            };
            self.nodes[number].push(Lane { bounds: *bounds, child });
        }
        number as u32
    }

    /// Draws a light in proportion to the importance at each node.
    pub(crate) fn sample(&self, mut u: f64, importance: impl Fn(&LightBounds) -> f32) -> Option<(usize, f64)> {
        let (mut at, mut pmf) = (0, 1.0);
        loop {
            let (weights, total) = self.weights(at, &importance);
            if !(total > 0.0) {
                return None;
            }
            let chosen = pick(&weights, total, &mut u);
            pmf *= f64::from(weights[chosen] / total);
            match self.nodes[at][chosen].child {
                Ok(node) => at = node as usize,
                Err(light) => return Some((light as usize, pmf)),
            }
        }
    }

    /// Probability of drawing a light.
    pub(crate) fn pmf(&self, light: usize, importance: impl Fn(&LightBounds) -> f32) -> f64 {
        let (mut node, mut lane) = self.lights[light];
        let mut pmf = 1.0;
        loop {
            let (weights, total) = self.weights(node as usize, &importance);
            if !(weights[lane as usize] > 0.0) {
                return 0.0;
            }
            pmf *= f64::from(weights[lane as usize] / total);
            if node == 0 {
                return pmf;
            }
            (node, lane) = self.parents[node as usize];
        }
    }

    fn weights(&self, node: usize, importance: impl Fn(&LightBounds) -> f32) -> ([f32; ARITY], f32) {
        let mut weights = [0.0; ARITY];
        for (weight, lane) in weights.iter_mut().zip(&self.nodes[node]) {
            *weight = importance(&lane.bounds);
        }
        (weights, weights.iter().sum())
    }

    pub(crate) fn bytes(&self) -> usize {
        let nodes: usize = self.nodes.iter().map(|lanes| size_of_val(&lanes[..])).sum();
        nodes + size_of_val(&self.lights[..]) + size_of_val(&self.parents[..])
    }
}

/// Chooses in proportion, and rescales `u`.
pub(super) fn pick(weights: &[f32], total: f32, u: &mut f64) -> usize {
    let mut target = *u * f64::from(total);
    let mut chosen = 0;
    for (i, &weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        chosen = i;
        if target < f64::from(weight) {
            break;
        }
        target -= f64::from(weight);
    }
    *u = (target / f64::from(weights[chosen])).clamp(0.0, 1.0 - f64::EPSILON);
    chosen
}
