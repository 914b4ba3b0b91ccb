//! The descent against an enumeration of all its ways.

use alloc::vec::Vec;

use glam::{Vec2, Vec3};

use super::*;
use crate::blas::walk::{Draw, Follow, child_corners};
use crate::blas::{ARITY, Texture, TexturePyramid, build};
use crate::record::Filter;
use crate::testing::Pcg32;
use crate::warp::{Variate, seed};

/// Weighs nothing left of a line; elsewhere the more, the nearer. Ends at a given size.
struct Halved {
    vertices: [Vec3; 3],
    smallest: u32,
}

impl CellTarget for Halved {
    type Cell = [Vec3; 3];

    fn whole(&self) -> [Vec3; 3] {
        self.vertices
    }

    fn child(&self, cell: &[Vec3; 3], index: usize) -> [Vec3; 3] {
        child_corners(cell, index)
    }

    fn weigh_children(&self, _at: LatticeCell, cell: &[Vec3; 3], _averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
        *weights = core::array::from_fn(|index| {
            let child = child_corners(cell, index);
            if child.iter().all(|v| v.x < 0.1) {
                0.0
            } else {
                1.0 / child.iter().copied().sum::<Vec3>().length_squared()
            }
        });
    }

    fn is_final(&self, at: LatticeCell, _cell: &mut [Vec3; 3], _levels: Option<u32>) -> bool {
        at.size <= self.smallest
    }
}

/// Follows given indices, then stops choosing: it notes the weights of the first choice that was not given.
struct Scripted<'a> {
    script: &'a [usize],
    next: Option<Vec<f32>>,
    at: usize,
}

impl Guide for Scripted<'_> {
    fn choose(&mut self, weights: &[f32; ARITY], _groups: &GroupSums) -> usize {
        let index = match self.script.get(self.at) {
            Some(&index) => index,
            None => {
                self.next.get_or_insert_with(|| weights.to_vec());
                weights.iter().position(|w| *w > 0.0).unwrap_or(0)
            }
        };
        self.at += 1;
        index
    }
}

/// Probability of all leaves, and of all dead ends.
fn masses(nodes: &[CellNode], root: Root, shape: &Halved) -> (f64, f64) {
    let (mut leaves, mut dead) = (0.0, 0.0);
    let mut open = Vec::from([(Vec::new(), 1.0)]);
    while let Some((script, mass)) = open.pop() {
        let mut guide = Scripted { script: &script, next: None, at: 0 };
        let found = descend(nodes, root, shape, &mut guide);
        match (guide.next, found) {
            (Some(weights), _) => {
                let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
                for (index, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                    let mut longer = script.clone();
                    longer.push(index);
                    open.push((longer, mass * f64::from(*weight) / total));
                }
            }
            (None, Some((_, pmf))) => {
                // Sums of groups are rounded to single precision.
                assert!((pmf / mass - 1.0).abs() < 1e-5);
                leaves += mass;
            }
            (None, None) => dead += mass,
        }
    }
    (leaves, dead)
}

fn tree(pcg: &mut Pcg32) -> (Vec<CellNode>, Root) {
    let texels: Vec<f32> = (0..16 * 16).map(|_| if pcg.next_f32() < 0.2 { pcg.next_f32() } else { 0.0 }).collect();
    let texture = Texture::new(16, 16, &texels).expect("texels are finite").filter(Filter::Nearest);
    let mut nodes = Vec::new();
    let uvs = [Vec2::new(0.1, 0.0), Vec2::new(0.9, 0.2), Vec2::new(0.3, 1.0)];
    let root = build(&mut TexturePyramid::new(texture), uvs, &mut nodes).expect("uvs are finite");
    (nodes, root)
}

fn all_ways_have_all_the_probability() {
    let (nodes, root) = tree(&mut Pcg32::new(1, 2));
    let vertices = [Vec3::new(-1.0, 0.0, 1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(0.5, 1.0, 0.75)];
    for smallest in [LATTICE, LATTICE >> 6] {
        let (leaves, dead) = masses(&nodes, root, &Halved { vertices, smallest });
        assert!((leaves + dead - 1.0).abs() < 1e-9 && leaves > 0.5, "{leaves} + {dead}");
    }
}

#[test]
fn leaves_and_dead_ends_have_all_the_probability() {
    all_ways_have_all_the_probability();
}

fn a_drawn_point_leads_back() {
    let mut pcg = Pcg32::new(2, 2);
    let (nodes, root) = tree(&mut pcg);
    let vertices = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(0.5, 1.0, 0.75)];
    let shape = Halved { vertices, smallest: 16 };
    for i in 0..20_000 {
        let edges = [0.0, 1.0 - f32::EPSILON / 2.0, 0.5, f32::MIN_POSITIVE];
        let mut number = || if i % 7 == 0 { edges[pcg.next_u32() as usize % 4] } else { pcg.next_f32() };
        let u = [number(), number()];
        let salt = seed(&u);
        let mut draw = Draw::new([Variate::new(u[0], salt), Variate::new(u[1], salt ^ 1)]);
        let Some((cell, pmf)) = descend(&nodes, root, &shape, &mut draw) else { continue };
        let point = draw.point(cell);
        let found = descend(&nodes, root, &shape, &mut Follow::new(point));
        let (again, again_pmf) = found.expect("a drawn point can be drawn");
        assert_eq!((again, again_pmf), (cell, pmf));
    }
}

#[test]
fn the_way_back_from_a_drawn_point_is_the_same() {
    a_drawn_point_leads_back();
}

/// As many points of a grid as there are cells of a uniform tree: each cell gets one.
#[test]
fn stratified_input_stays_stratified() {
    struct Uniform;
    impl CellTarget for Uniform {
        type Cell = ();

        fn whole(&self) {}

        fn child(&self, (): &(), _index: usize) {}

        fn weigh_children(&self, _at: LatticeCell, (): &(), _averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
            *weights = [1.0; ARITY];
        }

        fn is_final(&self, at: LatticeCell, (): &mut (), _levels: Option<u32>) -> bool {
            at.size <= LATTICE >> 6
        }
    }
    let mut cells = alloc::collections::BTreeSet::new();
    for i in 0..64 * 64 {
        let u = [i % 64, i / 64].map(|x| (x as f32 + 0.5) / 64.0);
        let mut draw = Draw::new([Variate::new(u[0], 0), Variate::new(u[1], 1)]);
        let (cell, _) = descend(&[], Root::constant(1.0), &Uniform, &mut draw).expect("nothing is dark");
        cells.insert((cell.offset, cell.inverted));
    }
    assert_eq!(cells.len(), 64 * 64);
}
