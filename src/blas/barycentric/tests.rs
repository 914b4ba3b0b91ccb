use super::*;
use crate::testing::Pcg32;

/// Ogaki's formula in exact arithmetic, for points that are not on an inner edge.
fn talk_index(local: [u32; 3], size: u32, r: u32) -> usize {
    let beta = local.map(|j| ((size - j) * r / size).min(r - 1) as i64);
    transposed((beta[0] * beta[0] + (beta[1] - beta[2]) + beta[0]) as usize)
}

fn numbering() {
    let r = EDGE_CELLS;
    let size = 16 * r;
    let t = size / r;
    let parent = LatticeCell { offset: [0; 3], inverted: false, size };
    let mut inside = [0u32; ARITY];
    for j1 in 0..=size {
        for j2 in 0..=size - j1 {
            let local = [size - j1 - j2, j1, j2];
            let (index, inner) = child(local, size);
            assert!(index < ARITY);
            assert_eq!(inner.iter().sum::<u32>(), t, "{local:?}");
            // The way back arrives at the same point, so the index is that of a cell which holds it.
            assert_eq!(parent.child(index).global(inner).0, local);
            if inner.iter().all(|&j| j > 0) {
                inside[index] += 1;
                assert_eq!(index, talk_index(local, size, r), "{local:?}");
            }
        }
    }
    // Every cell has all of its interior points: (t - 1)(t - 2) / 2 of them.
    assert_eq!(inside, [(t - 1) * (t - 2) / 2; ARITY]);
}

#[test]
fn numbering_is_consistent_on_a_small_lattice() {
    numbering();
}

#[test]
fn successive_numbers_are_those_of_different_groups() {
    // The first group of eight begins at vertex 0, the second ends at the other end of the third row.
    assert_eq!(child([128, 0, 0], 128), (0, [16, 0, 0]));
    assert_eq!(child([0, 128, 0], 128).0, transposed(49));
    assert_eq!(child([0, 0, 128], 128), (63, [0, 0, 16]));
    assert_eq!((transposed(1), transposed(8), transposed(transposed(49))), (8, 1, 49));
}

/// Down a random path of cells, a point strictly inside of the last cell is looked up along the same path.
fn paths(seed: u64) {
    let mut rng = Pcg32::new(seed, 3);
    let levels = MAX_HALVINGS / LEVEL_HALVINGS;
    for _ in 0..2000 {
        let mut cell = LatticeCell::whole();
        let mut path = [0; MAX_HALVINGS as usize];
        for index in &mut path[..levels as usize] {
            *index = rng.below(ARITY as u32) as usize;
            cell = cell.child(*index);
        }
        assert!(cell.size >= 16);
        let inner = interior_point(cell.size, [f64::from(rng.next_f32()), f64::from(rng.next_f32())]);
        assert!(inner.iter().all(|&j| j >= 1) && inner.iter().sum::<u32>() == cell.size);
        let point = cell.global(inner);
        assert_eq!(point.0.iter().sum::<u32>(), LATTICE);
        assert_eq!(Lattice::from_barycentrics(point.to_barycentrics()), point);
        let (mut local, mut size) = (point.0, LATTICE);
        for &index in &path[..levels as usize] {
            let (found, next) = child(local, size);
            assert_eq!(found, index);
            (local, size) = (next, size >> LEVEL_HALVINGS);
        }
        assert_eq!(local, inner);
        for (corner, b) in cell.corners().into_iter().zip(cell.corner_barycentrics()) {
            assert_eq!(corner.0.iter().sum::<u32>(), LATTICE);
            assert_eq!(Lattice::from_barycentrics(b), corner);
        }
    }
}

#[test]
fn paths_are_found_again() {
    paths(1);
}

/// Any point, edges and corners included, is in a cell at every depth, and in one that really holds it.
fn everywhere() {
    let mut rng = Pcg32::new(9, 1);
    let mut points = alloc::vec![[LATTICE, 0, 0], [0, LATTICE, 0], [0, 0, LATTICE]];
    for _ in 0..2000 {
        // Coarse coordinates fall onto edges and corners of cells.
        let grain = 1 << rng.below(LATTICE_BITS + 1);
        let j1 = rng.below(LATTICE / grain + 1) * grain;
        let j2 = rng.below((LATTICE - j1) / grain + 1) * grain;
        points.push([LATTICE - j1 - j2, j1, j2]);
    }
    for point in points {
        let (mut local, mut cell) = (point, LatticeCell::whole());
        for _ in 0..MAX_HALVINGS / LEVEL_HALVINGS {
            let (index, next) = child(local, cell.size);
            cell = cell.child(index);
            local = next;
            assert_eq!(cell.global(local).0, point);
        }
    }
}

#[test]
fn every_point_has_a_cell() {
    everywhere();
}

#[test]
fn any_barycentrics_are_safe() {
    let odd = [0.0, -0.0, 1.0, -1.0, 0.5, 0.333_333_34, 1e-30, 1e30, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    for b1 in odd {
        for b2 in odd {
            let Lattice([i0, i1, i2]) = Lattice::from_barycentrics([b1, b2]);
            assert_eq!(i0 + i1 + i2, LATTICE);
            assert!(i0 <= LATTICE && i1 <= LATTICE && i2 <= LATTICE);
        }
    }
}

#[test]
fn any_random_numbers_are_safe() {
    for u in [0.0, 1.0, -3.0, 7.0, f64::NAN, f64::INFINITY, 0.5] {
        for v in [0.0, 1.0, -3.0, 7.0, f64::NAN, f64::NEG_INFINITY, 0.5] {
            for size in [4, 16, LATTICE] {
                let p = interior_point(size, [u, v]);
                assert!(p.iter().all(|&j| j >= 1) && p.iter().sum::<u32>() == size);
            }
        }
    }
}

/// The points' mean is the center, and a quarter of them is in each quarter.
#[test]
fn interior_points_are_uniform() {
    let n = 1024;
    let size = 1 << 12;
    let (mut mean, mut quarters) = ([0f64; 3], [0u32; 4]);
    for i in 0..n {
        for j in 0..n {
            let u = [(f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n)];
            let p = interior_point(size, u);
            quarters[p.iter().position(|&j| 2 * j > size).unwrap_or(3)] += 1;
            mean = core::array::from_fn(|k| mean[k] + f64::from(p[k]));
        }
    }
    let count = f64::from(n * n);
    for m in mean {
        assert!((m / count / f64::from(size) - 1.0 / 3.0).abs() < 1e-4);
    }
    for q in quarters {
        assert!((4.0 * f64::from(q) / count - 1.0).abs() < 2e-3, "{quarters:?}");
    }
}

#[test]
fn cells_hold_the_points_strictly_inside() {
    let parent = LatticeCell { offset: [0; 3], inverted: false, size: 16 * EDGE_CELLS };
    let size = parent.size;
    for index in 0..ARITY {
        let cell = parent.child(index);
        let mut held = 0;
        for j1 in 0..=size {
            for j2 in 0..=size - j1 {
                let point = Lattice([size - j1 - j2, j1, j2]);
                let local = cell.local(point);
                let is_inside = local.iter().all(|&j| j > 0);
                assert_eq!(cell.holds(point), is_inside);
                assert_eq!(local.iter().sum::<i32>(), 16);
                if is_inside {
                    held += 1;
                    assert_eq!(cell.global(local.map(|j| j as u32)), point);
                    assert_eq!(child(point.0, size).0, index);
                }
            }
        }
        assert_eq!(held, 15 * 14 / 2);
    }
}
