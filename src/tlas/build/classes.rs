//! Lights of different size apart.
//!
//! A cluster that holds a large light and small ones has the extent of the large one: from any point near it, its
//! moments say little of either, and a lamp under a glowing dome starves. So lights are sorted into classes by the
//! diagonals of their boxes, each class gets a tree of its own, and the root joins these.

use smallvec::SmallVec;

use super::binary::partition;
use super::cluster::Item;
use crate::parallel;
use crate::tlas::arity::Arity;

/// Ratio of the largest diagonal to the smallest in a class. Chosen, not swept; the effect of classes is in
/// docs/ACCURACY.md, "Choosing a triangle".
///
/// Larger: lights of more sizes share a tree. Smaller: lights are set apart that would do well in one tree.
const CLASS_RATIO: f32 = 8.0;
/// Most classes. Chosen, not swept: three span a factor of 512 or more, and the fourth holds all that is smaller.
///
/// Larger: fewer lanes of the root for each. Smaller: lights of more sizes share the last class.
pub(super) const MOST_CLASSES: usize = 4;

/// Sorts lights into classes, the largest lights first. Returns the number of lights in each class.
pub(super) fn divide(items: &mut [Item], arity: Arity) -> SmallVec<[usize; MOST_CLASSES]> {
    // At least two lanes for a class.
    divide_into(items, MOST_CLASSES.min(arity.lanes() / 2))
}

/// Sorts lights into at most `most` classes, as [`divide`] does.
pub(super) fn divide_into(items: &mut [Item], most: usize) -> SmallVec<[usize; MOST_CLASSES]> {
    let diagonal2 = |item: &Item| (item.high() - item.low()).length_squared();
    let mut classes = SmallVec::new();
    let mut rest = items;
    while classes.len() + 1 < most {
        let part = |items: &[Item]| {
            let diagonals2 = items.iter().map(diagonal2);
            diagonals2.fold((f32::INFINITY, 0.0f32), |(least2, largest2), d2| (least2.min(d2), largest2.max(d2)))
        };
        let (smallest2, largest2) = parallel::reduce(rest, part, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let least2 = largest2 * (1.0 / (CLASS_RATIO * CLASS_RATIO));
        if smallest2 >= least2 {
            break;
        }
        let count = partition(rest, |item| diagonal2(item) >= least2);
        classes.push(count);
        rest = &mut rest[count..];
    }
    classes.push(rest.len());
    classes
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::bounds::LightBounds;
    use crate::geometry::{Aabb, Cone};
    use glam::Vec3;

    fn items(diagonals: &[f32]) -> Vec<Item> {
        let item = |(i, &diagonal): (usize, &f32)| {
            let aabb = Aabb { min: Vec3::splat(i as f32), max: Vec3::new(i as f32 + diagonal, i as f32, i as f32) };
            let normals = Cone::single(Vec3::Z);
            let emission = core::f32::consts::FRAC_PI_2;
            Item::new(&LightBounds { aabb, normals, emission, flux: 1.0, portal: 0.0, two_sided: false }, i as u32)
        };
        diagonals.iter().enumerate().map(item).collect()
    }

    fn classes(diagonals: &[f32], arity: Arity) -> (Vec<usize>, Vec<u32>) {
        let mut items = items(diagonals);
        let classes = divide(&mut items, arity).to_vec();
        (classes, items.iter().map(|item| item.light()).collect())
    }

    #[test]
    fn lights_of_one_class_stay_in_their_order() {
        assert_eq!(classes(&[1.0, 0.5, 4.0, 2.0], Arity::Sixteen), (Vec::from([4]), Vec::from([0, 1, 2, 3])));
        assert_eq!(classes(&[0.0, 0.0], Arity::Sixteen).0, [2]);
    }

    #[test]
    fn classes_are_counted_from_their_largest_light() {
        let (counts, lights) = classes(&[0.01, 10.0, 1.0, 0.02, 2.0], Arity::Sixteen);
        assert_eq!(counts, [2, 1, 2]);
        assert!(lights[..2].iter().all(|light| [1, 4].contains(light)) && lights[2] == 2, "{lights:?}");
    }

    #[test]
    fn the_smallest_class_holds_all_below() {
        let sizes: Vec<f32> = (0..10).map(|i| 0.1f32.powi(i)).collect();
        assert_eq!(classes(&sizes, Arity::Sixteen).0, [1, 1, 1, 7]);
        assert_eq!(classes(&sizes, Arity::Four).0, [1, 9]);
    }
}
