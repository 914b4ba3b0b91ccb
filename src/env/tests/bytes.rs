//! Environments that were taken apart and put together again.

use super::*;
use crate::env::features::FeatureLimits;
use crate::env::view::EnvironmentHeader;
use crate::env::{EnvironmentImage, EnvironmentView, FeatureNode, FeatureTexel};
use crate::error::Error;
use crate::warp::Variate;

/// An environment that came from elsewhere.
fn checked(view: EnvironmentView<'_>) -> Result<EnvironmentView<'_>, Error> {
    view.validate()?;
    Ok(view)
}

#[test]
fn parts_make_the_same_environment() {
    for environment in zoo().into_iter().chain([Environment::constant(0.0).unwrap()]) {
        let view = environment.as_view();
        let header: Vec<u8> = bytemuck::bytes_of(&view.header).to_vec();
        let header = bytemuck::pod_read_unaligned(&header);
        let again = checked(EnvironmentView { header, ..view }).unwrap();
        assert_eq!(again.sample([0.3, 0.7]), view.sample([0.3, 0.7]));
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let environment = Environment::from_equal_area(16, &noise(256, 1), Filter::Nearest).unwrap();
    let view = environment.as_view();
    let parts = view;
    let EnvironmentView { means, ranges, filtered, .. } = parts;
    let check = |f: &dyn Fn(&mut EnvironmentHeader)| {
        let mut header = parts.header;
        f(&mut header);
        checked(EnvironmentView { header, ..parts }).is_err()
    };
    assert!(!check(&|_| ()));
    assert!(check(&|h| h.depth = 3));
    assert!(check(&|h| h.depth = 14));
    assert!(check(&|h| h.depth = u32::MAX));
    assert!(check(&|h| h.mean *= 1.001));
    assert!(check(&|h| h.max = f32::NAN));
    assert!(check(&|h| h.rotation[0][0] = 0.9));
    assert!(check(&|h| h.rotation[1][1] = f32::NAN));
    assert!(checked(EnvironmentView { means: &means[1..], ..parts }).is_err());
    assert!(checked(EnvironmentView { ranges: &ranges[1..], ..parts }).is_err());
    assert!(checked(EnvironmentView { filtered: &filtered[1..], ..parts }).is_err());
    let refused = |means: &[f32], ranges: &[[f32; 2]], filtered: &[f32]| {
        checked(EnvironmentView { means, ranges, filtered, ..parts }).is_err()
    };
    for value in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
        for at in 0..means.len() {
            let (mut broken_means, mut broken_filtered, mut broken_ranges) =
                (means.to_vec(), filtered.to_vec(), ranges.to_vec());
            broken_means[at] = value;
            broken_filtered[at] = value;
            assert!(refused(&broken_means, ranges, filtered) && refused(means, ranges, &broken_filtered), "{at}");
            if at < ranges.len() {
                broken_ranges[at][1] = value;
                assert!(refused(means, &broken_ranges, filtered), "{at}");
            }
        }
    }
}

/// Changes the features of an environment, and says whether the result is refused.
fn is_refused(parts: EnvironmentView<'_>, change: impl Fn(&mut FeatureNode, &mut [FeatureTexel])) -> bool {
    let mut features = parts.features.to_vec();
    let mut feature_texels = parts.feature_texels.to_vec();
    change(&mut features[0], &mut feature_texels);
    let parts = EnvironmentView { features: &features, feature_texels: &feature_texels, ..parts };
    checked(parts).is_err()
}

#[test]
fn features_that_cannot_be_sampled_are_refused() {
    let mut image = one_lit(64, 64, 40, 15);
    image[15 * 64 + 41] = 3.0;
    let environment = Environment::from_equal_area(64, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    let parts = view;
    assert_eq!((parts.features.len(), parts.feature_texels.len()), (1, 2));
    assert!(!is_refused(parts, |_, _| ()));
    for value in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
        let changes: [fn(&mut FeatureNode, &mut [FeatureTexel], f32); 10] = [
            |feature, _, value| feature.axis[1] = value,
            |feature, _, value| feature.sin_radius = value,
            |feature, _, value| feature.sin_spread = value,
            |feature, _, value| feature.power = value,
            |_, texels, value| texels[1].cap = value,
            |_, texels, value| texels[1].excess = value,
            |_, texels, value| texels[0].excess = value,
            |_, texels, value| texels[0].margin = value,
            |_, texels, value| texels[1].radius = value,
            |_, texels, value| texels[1].sides[1][2] = value * 10.0,
        ];
        for (i, change) in changes.into_iter().enumerate() {
            assert!(is_refused(parts, |feature, texels| change(feature, texels, value)), "{i}: {value}");
        }
    }
    assert!(is_refused(parts, |feature, _| feature.range = [0, 3]));
    assert!(is_refused(parts, |feature, _| feature.range = [1, 2]));
    assert!(is_refused(parts, |feature, _| feature.range = [0, 1]));
    assert!(is_refused(parts, |feature, _| feature.range = [0, 0]));
    assert!(is_refused(parts, |feature, _| feature.range = [u32::MAX, 2]));
    assert!(is_refused(parts, |feature, _| feature.next = 0));
    assert!(is_refused(parts, |feature, _| feature.next = 2));
    assert!(is_refused(parts, |feature, _| feature.is_single = 0));
    assert!(is_refused(parts, |feature, _| feature.is_single = 2));
    assert!(is_refused(parts, |_, texels| texels[1].level = 7));
    assert!(is_refused(parts, |_, texels| texels[1].level = u32::MAX));
    assert!(is_refused(parts, |_, texels| texels[1].code = texels[0].code));
    assert!(is_refused(parts, |_, texels| texels[1].code = 64 * 64));
    assert!(is_refused(parts, |_, texels| texels.swap(0, 1)));
    let features = [parts.features[0]; 3];
    assert!(checked(EnvironmentView { features: &features, ..parts }).is_err());
    // Two features that are one node each, below a node of both.
    let [feature] = parts.features else { panic!("{:?}", parts.features) };
    let half = |range, next| FeatureNode { power: 0.5 * feature.power, range, next, ..*feature };
    let mut same = [parts.feature_texels[0]; 2];
    (same[1].code, same[1].excess) = (parts.feature_texels[1].code, same[0].excess);
    let half_power = same[0].power();
    let tree = [
        FeatureNode { next: 3, is_single: 0, power: 2.0 * half_power, ..*feature },
        FeatureNode { power: half_power, ..half([0, 1], 2) },
        FeatureNode { power: half_power, ..half([1, 2], 3) },
    ];
    let with =
        |tree: &[FeatureNode]| checked(EnvironmentView { features: tree, feature_texels: &same, ..parts }).is_ok();
    assert!(with(&tree));
    for i in 0..3 {
        let changes: [fn(&mut FeatureNode); 5] = [
            |node| node.next += 1,
            |node| node.next -= 1,
            |node| node.range[0] += 1,
            |node| node.range[1] -= 1,
            |node| node.power *= 1.1,
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut broken = tree;
            change(&mut broken[i]);
            assert!(!with(&broken), "{i} {number}");
        }
    }
    assert!(checked(EnvironmentView { features: &[], ..parts }).is_err());
    assert!(checked(EnvironmentView { features: &[], feature_texels: &[], ..parts }).is_err());
    assert!(checked(EnvironmentView { feature_texels: &[], ..parts }).is_err());
    for cap in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1.5] {
        let header = EnvironmentHeader { cap, ..parts.header };
        assert!(checked(EnvironmentView { header, ..parts }).is_err(), "{cap}");
    }
}

#[test]
fn environments_of_other_limits_load() {
    let mut image = noise(64 * 64, 5);
    for (x, y, value) in [(20, 30, 9e3), (21, 30, 8e3), (50, 9, 2e4), (50, 10, 1e4), (0, 40, 5e3), (7, 7, 2e5)] {
        image[y * 64 + x] = value;
    }
    let mut different = 0;
    let default = Environment::from_equal_area(64, &image, Filter::Nearest).unwrap();
    for limits in [
        FeatureLimits { contrast: 4.0, ..FeatureLimits::default() },
        FeatureLimits { contrast: 200.0, ..FeatureLimits::default() },
        FeatureLimits { sin_radius: 1.0, image_share: 0.5, contrast: 1.5, ..FeatureLimits::default() },
        FeatureLimits { features: 1, ..FeatureLimits::default() },
        FeatureLimits { blocks: 1, sin_radius: 0.5, ..FeatureLimits::default() },
        FeatureLimits { flux_share: 0.9, ..FeatureLimits::default() },
    ] {
        let image = EnvironmentImage::equal_area(64, &image).filter(Filter::Nearest);
        let environment = Environment::with_limits(&image, &limits, None).unwrap();
        different += u32::from(environment != default);
        let view = checked(environment.as_view()).unwrap();
        let mut pcg = Pcg32::new(1, 7);
        for i in 0..2000 {
            let sample = view.sample([pcg.next_f32(), pcg.next_f32()]).unwrap();
            assert!(sample.pdf.is_finite() && sample.pdf > 0.0);
            for node in 0..view.feature_nodes().len() {
                let u = [Variate::new(pcg.next_f32(), i), Variate::new(pcg.next_f32(), !i)];
                let direction = view.sample_feature(node, u);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                let (block, excess) = view.feature_at(direction).expect("a block of the node");
                assert!(excess > 0.0 && view.feature_nodes()[node].holds_block(block));
            }
        }
    }
    assert!(different >= 4, "{different}");
}
