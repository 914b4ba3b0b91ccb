//! The tree against plain loops over its leaves.

use alloc::vec::Vec;

use glam::Vec3;

use super::node::Child;
use super::tree::{WideTree, for_arity};
use super::walk::descend::{Descent, PmfWalk, SampleWalk};
use super::walk::ray::{Crossed, Met};
use super::{Arity, LeafOracle, Splitting, Tlas, TlasView};
use crate::bounds::{LightBounds, Moments};
use crate::geometry::{Aabb, Cone};
use crate::progress::Progress;
use crate::receiver::{ShadingPoint, for_lobe};
use crate::simd::InstructionSet;
use crate::testing::Pcg32;
use crate::warp::{Variate, seed};

type BoundedLight = (LightBounds, Moments);

/// The tree over lights, and the lights in the order of its leaves.
pub(super) fn build(arity: Arity, lights: &[BoundedLight]) -> (Tlas, Vec<u32>) {
    let (mut tlas, order) =
        super::build(arity, lights.len(), &|light| lights[light as usize].0, &Progress::new(None, 1.0))
            .expect("nobody cancels");
    tlas.fit(&|leaf| lights[order[leaf as usize] as usize]);
    (tlas, order)
}

/// The arity with this number of lanes.
fn arity<const N: usize>() -> Arity {
    Arity::from_code(N as u32).expect("there is such an arity")
}

/// A shading point before which some leaves are visible, and portals show the same in every direction.
#[derive(Clone, Copy)]
pub(super) struct Before<'a> {
    x: &'a ShadingPoint,
    /// Whether only leaves with odd numbers are visible of those in doubt, or all leaves.
    odd_alone: bool,
}

impl LeafOracle for Before<'_> {
    fn shading_point(&self) -> &ShadingPoint {
        self.x
    }

    fn radiances(&self, _centers: [&[f32]; 3], _radii: &[f32], _set: u32, radiances: &mut [f32]) {
        radiances.fill(1.0);
    }

    fn has_shaped_leaves(&self) -> bool {
        false
    }

    fn has_factors(&self) -> bool {
        false
    }

    fn factors(&self, _node: u32) -> Option<&super::FactorBytes> {
        None
    }

    fn is_visible(&self, leaf: u32) -> bool {
        !self.odd_alone || leaf % 2 == 1
    }

    fn irradiance_per_area(&self, _leaf: u32) -> f32 {
        1.0
    }
}

/// All leaves are visible.
pub(super) fn open(x: &ShadingPoint) -> Before<'_> {
    Before { x, odd_alone: false }
}

/// Hides leaves: of those in doubt, only those with odd numbers are visible.
fn odd(x: &ShadingPoint) -> Before<'_> {
    Before { x, odd_alone: true }
}

fn cloud(n: usize, pcg: &mut Pcg32) -> Vec<BoundedLight> {
    let size = 0.3 / (n as f32).cbrt();
    let light = |_| {
        let center = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
        let corner = size * pcg.direction();
        let normal = pcg.direction();
        let bounds = LightBounds {
            aabb: Aabb::around(&[center - corner, center + corner]),
            normals: Cone::single(normal),
            emission: core::f32::consts::FRAC_PI_2,
            flux: if pcg.next_f32() < 0.5 { pcg.next_f32() } else { 0.0 },
            portal: pcg.next_f32(),
            two_sided: pcg.next_f32() < 0.2,
        };
        let variance = corner.length_squared() / 3.0;
        (bounds, Moments { energy: bounds.energy(), mean: center, variance, normal })
    };
    (0..n).map(light).collect()
}

fn shading_point(i: usize, pcg: &mut Pcg32) -> ShadingPoint {
    let position = 2.0 * Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) - 0.5;
    match i % 3 {
        0 => ShadingPoint::surface(position, pcg.direction()),
        1 => ShadingPoint::transmissive(position, pcg.direction()),
        _ => ShadingPoint::volume(position),
    }
}

/// Probability of ending below a node where every weight is zero.
fn dead_mass<const N: usize>(tlas: &WideTree<'_, N>, node: usize, oracle: &impl LeafOracle) -> f64 {
    let weights = tlas.weigh(node, oracle);
    if weights == [0.0; N] {
        return 1.0;
    }
    let below = |lane| match tlas.nodes[node].child(lane) {
        Child::Node(index) if weights[lane] > 0.0 => {
            crate::warp::pmf_wide(&weights, lane) * dead_mass(tlas, index as usize, oracle)
        }
        _ => 0.0,
    };
    (0..N).map(below).sum()
}

fn probabilities_sum_to_one<const N: usize>(before: impl Fn(&ShadingPoint) -> Before<'_>) {
    let mut pcg = Pcg32::new(3, 1);
    for n in [2, 3, 17, 100, 3000] {
        let (tlas, _) = build(arity::<N>(), &cloud(n, &mut pcg));
        let view = tlas.view();
        view.validate().expect("a built tree is valid");
        for i in 0..12 {
            let x = shading_point(i, &mut pcg);
            let oracle = &before(&x);
            let leaves: f64 = (0..n as u32).map(|leaf| view.pmf(leaf, oracle, None)).sum();
            // Few lights are in narrower nodes.
            let dead = for_arity!(view, tree => dead_mass(&tree, 0, oracle));
            assert!((leaves + dead - 1.0).abs() < 1e-9, "{n} lights: {leaves} + {dead}");
        }
    }
}

#[test]
fn leaves_and_dead_ends_have_all_the_probability() {
    probabilities_sum_to_one::<4>(open);
    probabilities_sum_to_one::<8>(open);
    probabilities_sum_to_one::<16>(open);
    probabilities_sum_to_one::<8>(odd);
}

#[test]
fn a_sample_has_the_probability_of_its_leaf() {
    let mut pcg = Pcg32::new(4, 1);
    let (tlas, _) = build(Arity::Eight, &cloud(5000, &mut pcg));
    let view = tlas.view();
    let mut found = 0;
    for i in 0..20_000 {
        let x = shading_point(i, &mut pcg);
        let u = pcg.next_f32();
        if let Some((leaf, pmf)) = view.sample(&odd(&x), None, Variate::new(u, seed(&[u]))) {
            let again = view.pmf(leaf, &odd(&x), None);
            assert!((pmf / again - 1.0).abs() < 1e-12, "leaf {leaf}: {pmf} {again}");
            found += 1;
        }
    }
    assert!(found > 10_000, "{found} drawn");
}

#[test]
fn all_instruction_sets_give_the_same_bits() {
    let mut pcg = Pcg32::new(11, 1);
    for scale in [1.0, 1e-6, 1e8] {
        let mut lights = cloud(3000, &mut pcg);
        for (bounds, moments) in &mut lights {
            bounds.aabb = Aabb { min: bounds.aabb.min * scale, max: bounds.aabb.max * scale };
            (moments.mean, moments.variance) = (moments.mean * scale, moments.variance * scale * scale);
        }
        same_bits::<4>(&lights, scale, &mut pcg);
        same_bits::<8>(&lights, scale, &mut pcg);
        same_bits::<16>(&lights, scale, &mut pcg);
    }
}

fn same_bits<const N: usize>(lights: &[(LightBounds, Moments)], scale: f32, pcg: &mut Pcg32) {
    let (tlas, _) = build(arity::<N>(), lights);
    let tlas = &tlas.view().wide::<N>();
    let (mut found, mut entered) = (0, [0; 2]);
    for i in 0..3000 {
        let x = &shading_point(i, pcg);
        let x = &ShadingPoint { position: x.position * scale, ..*x };
        let u = pcg.next_f32();
        let draw = |level: InstructionSet| {
            for_lobe!(x.receiver, lobe => {
                let walk = Descent::new(odd(x), lobe, Variate::new(u, seed(&[u])));
                let drawn = level.run(SampleWalk { tlas, walk });
                let pmf = |leaf| level.run(PmfWalk { tlas, leaf, oracle: &odd(x), lobe, first: None }).to_bits();
                (drawn.map(|(leaf, pmf)| (leaf, pmf.to_bits())), drawn.map(|(leaf, _)| pmf(leaf)))
            })
        };
        let mut all = InstructionSet::all().map(draw);
        let first = all.next();
        found += usize::from(first.is_some_and(|(drawn, ..)| drawn.is_some()));
        assert!(all.all(|other| Some(other) == first));
        // Towards a light, at nodes near the root, so that something is met.
        let (node, origin) = (&tlas.nodes[i % tlas.nodes.len().min(8)], x.position);
        let axis = (lights[i % lights.len()].1.mean - origin).normalize();
        let inverse = axis.recip();
        let lanes = |level: InstructionSet| {
            let crossed = level.run(Crossed::<N, false> { node, origin, inverse, margin: 0.0 });
            (crossed, level.run(Met::<N, false> { node, origin, axis, cone: [0.6, 0.8], margin: 0.0 }))
        };
        let mut all = InstructionSet::all().map(lanes);
        let first = all.next();
        assert!(all.all(|other| Some(other) == first));
        first.into_iter().for_each(|(crossed, met)| {
            entered[0] += usize::from(crossed != 0);
            entered[1] += usize::from(met != 0);
        });
    }
    assert!(entered.iter().all(|&count| count > 50), "{entered:?} entered");
    assert!(found > 2000, "{found} drawn");
}

#[test]
fn lights_are_a_permutation_in_the_order_of_leaves() {
    let mut pcg = Pcg32::new(5, 1);
    for n in [1, 2, 9, 1000] {
        let (_, order) = build(Arity::Eight, &cloud(n, &mut pcg));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..n as u32));
    }
}

#[test]
fn coincident_and_chained_lights_make_shallow_trees() {
    let mut pcg = Pcg32::new(6, 1);
    let light = cloud(1, &mut pcg)[0];
    let same = alloc::vec![light; 100_000];
    // Each light twice as far and as large as the one before: every binned split takes off the last few.
    let moved = |i: i32| {
        let scale = 2.0f32.powi(i / 8 - 40);
        let (bounds, moments) = light;
        let aabb = Aabb { min: bounds.aabb.min * scale, max: bounds.aabb.max * scale };
        let (mean, variance) = (moments.mean * scale, moments.variance * scale * scale);
        (LightBounds { aabb, ..bounds }, Moments { mean, variance, ..moments })
    };
    let chain: Vec<_> = (0..640).map(moved).collect();
    for lights in [same, chain] {
        let (tlas, _) = build(Arity::Four, &lights);
        let view = tlas.view();
        view.validate().expect("a built tree is valid");
        let depth = (0..lights.len() as u32).map(|leaf| view.wide::<4>().path(leaf).count()).max();
        assert!(depth < Some(70), "{depth:?}");
    }
}

#[test]
fn a_ray_finds_every_box_that_it_crosses() {
    let mut pcg = Pcg32::new(7, 1);
    let lights = cloud(2000, &mut pcg);
    let (tlas, order) = build(Arity::Eight, &lights);
    let mut crossed = 0;
    for i in 0..3000 {
        let origin = shading_point(i, &mut pcg).position;
        let direction = if i % 5 == 0 { [Vec3::X, Vec3::NEG_Y, Vec3::Z][i % 3] } else { pcg.direction() };
        let mut found = Vec::new();
        tlas.view().cross(origin, direction, |leaf| found.push(leaf));
        for (leaf, &light) in (0..).zip(&order) {
            if passes_through(origin, direction, &lights[light as usize].0.aabb) {
                assert!(found.contains(&leaf), "leaf {leaf} from {origin} along {direction}");
                crossed += 1;
            }
        }
        assert!(found.len() < 400, "{} boxes found", found.len());
    }
    assert!(crossed > 300, "{crossed} boxes crossed");
}

/// Slab test in double precision, shrunk a little so that it decides only clear cases.
fn passes_through(origin: Vec3, direction: Vec3, aabb: &Aabb) -> bool {
    let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (f64::from(origin[axis]), f64::from(direction[axis]));
        let (low, high) = (f64::from(aabb.min[axis]), f64::from(aabb.max[axis]));
        if d == 0.0 {
            if o <= low || o >= high {
                return false;
            }
            continue;
        }
        let (a, b) = ((low - o) / d, (high - o) / d);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    enter < leave - 1e-6
}

fn visits(tlas: &Tlas, x: &ShadingPoint, u: f32, splitting: &Splitting) -> Vec<(u32, f64)> {
    let mut visits = Vec::new();
    let variate = |draw| Variate::scrambled(u, u64::from(draw), seed(&[u]) ^ u64::from(draw));
    tlas.view().sample_split(&odd(x), splitting, variate, |leaf, count| visits.push((leaf, count)));
    visits
}

#[test]
fn split_visits_have_their_expected_counts() {
    let mut pcg = Pcg32::new(8, 1);
    let (tlas, _) = build(Arity::Eight, &cloud(500, &mut pcg));
    let mut most = 0;
    for i in 0..2000 {
        let x = shading_point(i, &mut pcg);
        for splitting in [0.0, 0.3, 0.6, 1.0].map(|threshold| Splitting { threshold, levels: 2 }) {
            let visits = visits(&tlas, &x, pcg.next_f32(), &splitting);
            assert!(visits.len() <= 64);
            most = most.max(visits.len());
            for (leaf, count) in visits {
                let again = tlas.view().expected_count(leaf, &odd(&x), &splitting);
                assert!((count / again - 1.0).abs() < 1e-12, "leaf {leaf}: {count} {again}");
            }
        }
    }
    assert!(most > 8, "nothing was split twice");
}

#[test]
fn without_splitting_there_is_one_visit_like_a_plain_sample() {
    let mut pcg = Pcg32::new(9, 1);
    let (tlas, _) = build(Arity::Eight, &cloud(300, &mut pcg));
    let mut found = 0;
    for i in 0..500 {
        let x = shading_point(i, &mut pcg);
        for splitting in [Splitting { threshold: 0.0, levels: 9 }, Splitting { threshold: 1.0, levels: 0 }] {
            let visits = visits(&tlas, &x, pcg.next_f32(), &splitting);
            assert!(visits.len() <= 1);
            found += visits.len();
            for (leaf, count) in visits {
                assert!((count / tlas.view().pmf(leaf, &odd(&x), None) - 1.0).abs() < 1e-12);
            }
        }
    }
    assert!(found > 500, "{found} visits");
}

#[test]
fn broken_trees_are_refused() {
    let mut pcg = Pcg32::new(10, 1);
    let (tlas, _) = build(Arity::Four, &cloud(50, &mut pcg));
    let word_count = tlas.nodes.len();
    let mut refused = 0;
    for word in 0..word_count {
        let mut broken = tlas.clone();
        broken.nodes[word] ^= 0x8000_0001;
        // What passes must still be safe to walk.
        match broken.view().validate() {
            Err(_) => refused += 1,
            Ok(()) => {
                let x = shading_point(word, &mut pcg);
                broken.view().sample(&open(&x), None, Variate::new(pcg.next_f32(), 1));
                broken.view().cross(x.position, Vec3::ONE, |_| ());
            }
        }
    }
    assert!(refused > word_count / 20, "{refused} of {word_count}");
    for length in 0..tlas.leaves.len() {
        let view = tlas.view();
        assert!(TlasView { leaves: &tlas.leaves[..length], ..view }.validate().is_err());
    }
}
