//! Bright features of the image.

use super::*;
use crate::env::features::FeatureLimits;
use crate::env::{EnvironmentImage, EnvironmentView};
use alloc::vec::Vec;
use glam::Vec3;

#[test]
fn a_small_sun_is_a_feature() {
    // Two texels of a uniform sky, one of them in the middle of a face of the octahedron.
    let mut image = vec![1.0; 128 * 128];
    for x in [40, 41] {
        image[30 * 128 + x] = 20_000.0;
    }
    let environment = Environment::from_equal_area(128, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    let [feature] = view.feature_nodes() else { panic!("{:?}", view.feature_nodes()) };
    let flux = f64::from(environment.mean()) * f64::from(2.0 * TAU);
    let power = f64::from(feature.power);
    assert!(power > 0.4 * flux && power < flux, "{power} of {flux}");
    assert_eq!(view.feature_texels(0).len(), 2);
    let axis = view.feature_axis(0);
    assert!(view.feature_at(axis).is_some() && view.feature_at(-axis).is_none());
}

/// Lamps of 2 x 2 texels in a sky of 0.1, each a little brighter than the one before.
fn lamps(size: usize, count: usize) -> Environment {
    let mut image = vec![0.1; size * size];
    let across = size / 8;
    for i in 0..count {
        let (x, y) = (8 * (i % across) + 3, 8 * (i / across) + 3);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            image[(y + dy) * size + x + dx] = 1000.0 + i as f32;
        }
    }
    Environment::from_equal_area(size, &image, Filter::Nearest).unwrap()
}

/// Number of features.
fn count(view: &EnvironmentView<'_>) -> usize {
    let nodes = view.feature_nodes();
    let mut at = 0;
    let mut count = 0;
    while let Some(node) = nodes.get(at) {
        count += node.is_single as usize;
        at = if node.is_single == 1 { node.next as usize } else { at + 1 };
    }
    count
}

#[test]
fn any_number_of_lamps_are_features() {
    for lamp_count in [1, 8, 9, 64, 250] {
        let environment = lamps(256, lamp_count);
        let view = environment.as_view();
        assert_eq!(count(&view), lamp_count);
        assert_eq!(view.mean_without_features().max(0.1), view.mean_without_features());
        assert!(view.mean_without_features() < 0.1 * 17.0);
        view.validate().unwrap();
    }
}

#[test]
fn more_lamps_than_there_is_room_for_keep_as_many_as_fit() {
    let environment = lamps(256, 600);
    let view = environment.as_view();
    view.validate().unwrap();
    assert_eq!(count(&view), 256);
}

#[test]
fn of_too_many_lamps_the_faintest_stay_in_the_rest() {
    let image = lamps(256, 40);
    let view = image.as_view();
    let size = view.size() as usize;
    let texels = &view.means[view.means.len() - size * size..];
    let limits = FeatureLimits { features: 30, ..FeatureLimits::default() };
    let image = EnvironmentImage::equal_area(size, texels).filter(Filter::Nearest);
    let few = Environment::with_limits(&image, &limits, None).unwrap();
    let few = few.as_view();
    few.validate().unwrap();
    assert_eq!(count(&few), 30);
    // Those that stay are not capped.
    assert_eq!(few.ranges[0], [0.1, 1009.0]);
    assert!(few.rest_of(3, 3, 1000.0) == 1000.0 && few.rest_of(8 * 10 + 3, 3, 1010.0) < 5.0);
}

#[test]
fn a_cloud_that_is_too_large_keeps_its_sun() {
    // A disc of contrast 40, with a sun in it and another one next to it.
    let size = 256;
    let image: Vec<f32> = (0..size * size)
        .map(|k| {
            let (x, y) = ((k % size) as f32 - 60.0, (k / size) as f32 - 70.0);
            let cloud: f32 = if x * x + y * y < 15.0 * 15.0 { 40.0 } else { 1.0 };
            let suns = (x.abs() < 2.0 && y.abs() < 2.0) || (x - 30.0).abs() < 2.0 && y.abs() < 2.0;
            cloud + if suns { 9000.0 } else { 0.0 }
        })
        .collect();
    let environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    view.validate().unwrap();
    assert_eq!(count(&view), 2);
    let caps: Vec<f32> = view.feature_texels.iter().map(|texel| texel.cap).collect();
    assert!(caps.iter().any(|&cap| cap > 40.0) && caps.iter().any(|&cap| cap < 40.0), "{caps:?}");
}

#[test]
fn a_sun_is_finer_than_its_halo() {
    let size = 1024;
    let image: Vec<f32> = (0..size * size)
        .map(|k| {
            let (x, y) = ((k % size) as f32 - 260.3, (k / size) as f32 - 270.1);
            let r2 = x * x + y * y;
            1.0 + 1e6 * (-r2 / 8.0).exp() + 3e5 / (r2 + 30.0).powf(1.5)
        })
        .collect();
    let environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    view.validate().unwrap();
    let texels = view.feature_texels(0);
    let axis = view.feature_axis(0);
    let level = |near: bool| {
        let levels = texels.iter().filter(|texel| near == (Vec3::from_array(texel.center).distance(axis) < 0.006));
        let (sum, count) = levels.fold((0, 0), |(sum, count), texel| (sum + texel.level, count + 1));
        f64::from(sum) / f64::from(count)
    };
    assert_eq!(view.header.depth, 10);
    assert!(level(true) > 9.8 && level(false) < 9.5, "{} {} of {}", level(true), level(false), texels.len());
}
