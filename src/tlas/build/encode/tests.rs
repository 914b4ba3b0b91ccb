//! What is rounded keeps its promises.

use alloc::vec::Vec;

use glam::Vec3;

use crate::bounds::{LightBounds, Moments};
use crate::geometry::{Aabb, Cone};
use crate::receiver::{Receiver, ShadingPoint};
use crate::testing::Pcg32;
use crate::tlas::Arity;
use crate::tlas::node::{Child, Node};
use crate::tlas::tests::{build, open};
use crate::tlas::tree::WideTree;

/// Small lights in a cube, some of them flat, all facing about the same way if `narrow`.
fn lights(n: usize, place: Vec3, scale: f32, narrow: bool, pcg: &mut Pcg32) -> Vec<(LightBounds, Moments)> {
    let up = pcg.direction();
    let light = |i| {
        let center = place + scale * Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
        let size = scale * 10f32.powf(-4.0 * pcg.next_f32()) * pcg.direction();
        let size = if i % 3 == 0 { size * Vec3::new(1.0, 0.0, 1.0) } else { size };
        let normal = if narrow { (up + 0.4 * pcg.direction()).normalize() } else { pcg.direction() };
        let energy = 10f32.powf(-30.0 * pcg.next_f32());
        let bounds = LightBounds {
            aabb: Aabb::around(&[center - size, center + size]),
            normals: Cone::single(normal),
            emission: core::f32::consts::FRAC_PI_2,
            flux: if i % 4 > 0 { energy } else { 0.0 },
            portal: if i % 4 < 2 { energy } else { 0.0 },
            two_sided: i % 7 == 0,
        };
        let variance = size.length_squared() / 3.0;
        (bounds, Moments { energy: bounds.energy(), mean: center, variance, normal })
    };
    (0..n).map(light).collect()
}

#[test]
fn boxes_grow_and_energies_stay_positive() {
    let mut pcg = Pcg32::new(21, 1);
    for (place, scale) in [(0.0, 1.0), (1e6, 1.0), (0.0, 1e-6), (-5e8, 1e9), (3.0, 0.0)] {
        for _ in 0..200 {
            let lights = lights(8, Vec3::splat(place), scale, false, &mut pcg);
            let mut node = Node::<8>::new(1, 0, 0, lights.len());
            node.set(&lights);
            let [flux, portal] = node.energies();
            let (low, high) = node.corners();
            let corner = |corners: [[f32; 8]; 3], lane: usize| Vec3::from_array(corners.map(|values| values[lane]));
            for (lane, (bounds, moments)) in lights.iter().enumerate() {
                let (min, max, exact) = (corner(low, lane), corner(high, lane), bounds.aabb);
                assert!(min.cmple(exact.min).all() && max.cmpge(exact.max).all(), "{min} {max} {exact:?}");
                assert_eq!((flux[lane] > 0.0, portal[lane] > 0.0), (bounds.flux > 0.0, bounds.portal > 0.0));
                let error = (flux[lane] + portal[lane]) / moments.energy - 1.0;
                assert!(error.abs() < 0.005, "{error}");
                let (axis, [sin, cos], _) = node.cone(lane);
                assert!(axis.dot(bounds.normals.axis) >= cos - 1e-6 && sin >= 0.0, "{axis} {cos}");
            }
        }
    }
}

/// Whether, in double precision, no point of the box can send anything to `x`.
fn is_dark(bounds: &LightBounds, x: &ShadingPoint) -> bool {
    let corners = || {
        (0..8).map(|i| {
            let corner = [bounds.aabb.min, bounds.aabb.max];
            let pick = |axis: usize| f64::from(corner[i >> axis & 1][axis]) - f64::from(x.position[axis]);
            glam::DVec3::new(pick(0), pick(1), pick(2))
        })
    };
    let below = |normal: Vec3| corners().all(|corner| normal.as_dvec3().dot(corner) <= 0.0);
    let behind = !bounds.two_sided && corners().all(|corner| bounds.normals.axis.as_dvec3().dot(corner) >= 0.0);
    behind || matches!(x.receiver, Receiver::Surface(normal) if below(normal))
}

/// Checks all leaves below a node. Returns how many lanes were culled.
fn check(tlas: &WideTree<'_, 8>, node: usize, culled: bool, x: &ShadingPoint, dark: &dyn Fn(u32) -> bool) -> usize {
    let weights = tlas.weigh(node, &open(x));
    let mut count = 0;
    for (lane, &weight) in weights.iter().enumerate() {
        let culled = culled || weight == 0.0;
        match tlas.nodes[node].child(lane) {
            Child::Node(below) => count += check(tlas, below as usize, culled, x, dark),
            Child::Leaf(leaf) if culled => assert!(dark(leaf), "leaf {leaf} is culled from {x:?}"),
            Child::Leaf(_) | Child::Empty => continue,
        }
        count += usize::from(culled);
    }
    count
}

#[test]
fn what_is_culled_is_dark() {
    let mut pcg = Pcg32::new(22, 1);
    let mut culled = 0;
    for (place, scale) in [(0.0, 1.0), (1e6, 100.0), (0.0, 1e-6), (-5e8, 1e9)] {
        for narrow in [true, false] {
            let lights = lights(300, Vec3::splat(place), scale, narrow, &mut pcg);
            let (tlas, order) = build(Arity::Eight, &lights);
            for i in 0..200 {
                let offset = 3.0 * Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) - 1.0;
                // Now and then next to a light.
                let near = lights[i].1.mean + 0.01 * scale * pcg.direction();
                let position = if i % 4 == 0 { near } else { Vec3::splat(place) + scale * offset };
                let x = match i % 3 {
                    0 => ShadingPoint::volume(position),
                    _ => ShadingPoint::surface(position, pcg.direction()),
                };
                let dark = |leaf: u32| is_dark(&lights[order[leaf as usize] as usize].0, &x);
                culled += check(&tlas.view().wide::<8>(), 0, false, &x, &dark);
            }
        }
    }
    assert!(culled > 100_000, "{culled} lanes culled");
}
