//! Lights that outshine the others, and lights of different size, apart.
//!
//! A cluster that holds a large light and small ones has the extent of the large one: from any point near it, its
//! moments say little of either, and a lamp under a glowing dome starves. So lights are sorted into classes by the
//! diagonals of their boxes, each class gets a tree of its own, and the root joins these.
//!
//! A cluster that holds a bright light and dim ones is mostly the bright one, but is as wide and sends in as many
//! directions as all of them: where the bright one shines, it is chosen too seldom. So the brightest lights are lanes
//! of the root, each by itself, wherever they move and however they turn.

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

/// Least brightness of a light that outshines the others, relative to the mean. *Chosen*; what such lights gain is in
/// docs/LIGHTS.md, "Where noise has no steps".
///
/// Larger: brighter lights are left among others. Smaller: lights that are about as bright as others take their lanes.
const BRIGHT_OVER_MEAN: f64 = 8.0;
/// Least brightness of a light that outshines the others, relative to the sum of all. *Chosen*: half of
/// the share that each of sixteen lanes has on average.
///
/// Larger: of many lights, bright ones are left among others. Smaller: lights that matter little take lanes.
const BRIGHT_SHARE: f64 = 1.0 / 32.0;

/// Moves the lights that outshine the others to the front, the brightest first. Returns how many of these are to be
/// lanes of the root by themselves: a fourth of the lanes at most.
pub(super) fn outshining(items: &mut [Item], arity: Arity) -> usize {
    let all = parallel::sum(items.len(), |i| items[i].brightness().into());
    let least = all * BRIGHT_SHARE.max(BRIGHT_OVER_MEAN / items.len() as f64);
    let is_bright = |item: &Item| all > 0.0 && f64::from(item.brightness()) >= least;
    if !items.iter().any(is_bright) {
        return 0;
    }
    let count = partition(items, is_bright);
    items[..count].sort_unstable_by(|a, b| b.brightness().total_cmp(&a.brightness()).then(a.light().cmp(&b.light())));
    count.min(arity.lanes() / 4)
}

/// Sorts lights into at most `most` classes by size, the largest lights first. Returns the number of lights in each
/// class.
pub(super) fn divide(items: &mut [Item], most: usize) -> SmallVec<[usize; MOST_CLASSES]> {
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

    fn classes(diagonals: &[f32], most: usize) -> (Vec<usize>, Vec<u32>) {
        let mut items = items(diagonals);
        let classes = divide(&mut items, most).to_vec();
        (classes, items.iter().map(|item| item.light()).collect())
    }

    #[test]
    fn lights_of_one_class_stay_in_their_order() {
        assert_eq!(classes(&[1.0, 0.5, 4.0, 2.0], 4), (Vec::from([4]), Vec::from([0, 1, 2, 3])));
        assert_eq!(classes(&[0.0, 0.0], 4).0, [2]);
    }

    #[test]
    fn classes_are_counted_from_their_largest_light() {
        let (counts, lights) = classes(&[0.01, 10.0, 1.0, 0.02, 2.0], 4);
        assert_eq!(counts, [2, 1, 2]);
        assert!(lights[..2].iter().all(|light| [1, 4].contains(light)) && lights[2] == 2, "{lights:?}");
    }

    #[test]
    fn the_brightest_lights_come_first() {
        let outshining = |energies: &[f32], arity: Arity| {
            let item = |(i, &flux): (usize, &f32)| {
                Item::new(
                    &LightBounds { flux, aabb: Aabb { min: Vec3::ZERO, max: Vec3::ZERO }, ..LightBounds::NONE },
                    i as u32,
                )
            };
            let mut items: Vec<Item> = energies.iter().enumerate().map(item).collect();
            let count = outshining(&mut items, arity);
            items[..count].iter().map(Item::light).collect::<Vec<_>>()
        };
        let mut energies = [1.0; 100];
        assert!(outshining(&energies, Arity::Sixteen).is_empty());
        assert!(outshining(&[0.0; 100], Arity::Sixteen).is_empty());
        // Eight times the mean, which they raise themselves.
        (energies[70], energies[20], energies[99]) = (30.0, 20.0, 20.0);
        assert_eq!(outshining(&energies, Arity::Sixteen), [70, 20, 99]);
        assert_eq!(outshining(&energies, Arity::Eight), [70, 20]);
        assert_eq!(outshining(&energies, Arity::Four), [70]);
        energies[99] = 12.0;
        assert_eq!(outshining(&energies, Arity::Sixteen), [70, 20]);
        // Many lights: a share of all energy as well.
        let mut energies = [1.0; 1000];
        (energies[5], energies[6]) = (40.0, 20.0);
        assert_eq!(outshining(&energies, Arity::Sixteen), [5]);
    }

    #[test]
    fn the_smallest_class_holds_all_below() {
        let sizes: Vec<f32> = (0..10).map(|i| 0.1f32.powi(i)).collect();
        assert_eq!(classes(&sizes, 4).0, [1, 1, 1, 7]);
        assert_eq!(classes(&sizes, 2).0, [1, 9]);
    }
}
