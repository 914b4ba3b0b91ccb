//! Environments that were taken apart and put together again.

use super::*;
use crate::env::{EnvironmentParts, EnvironmentView};

#[test]
fn parts_make_the_same_environment() {
    for environment in zoo().into_iter().chain([Environment::constant(0.0).unwrap()]) {
        let view = environment.as_view();
        let header: Vec<u8> = bytemuck::bytes_of(&view.parts().header).to_vec();
        let header = bytemuck::pod_read_unaligned(&header);
        let again = EnvironmentView::from_parts(EnvironmentParts { header, ..view.parts() }).unwrap();
        assert_eq!(again.sample([0.3, 0.7]), view.sample([0.3, 0.7]));
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let environment = Environment::from_equal_area(16, &noise(256, 1), Filter::Nearest).unwrap();
    let view = environment.as_view();
    let parts = view.parts();
    let EnvironmentParts { means, ranges, filtered_means: filtered, .. } = parts;
    let check = |f: &dyn Fn(&mut crate::EnvironmentHeader)| {
        let mut header = parts.header;
        f(&mut header);
        EnvironmentView::from_parts(EnvironmentParts { header, ..parts }).is_err()
    };
    assert!(!check(&|_| ()));
    assert!(check(&|h| h.depth = 3));
    assert!(check(&|h| h.depth = 14));
    assert!(check(&|h| h.depth = u32::MAX));
    assert!(check(&|h| h.mean *= 1.001));
    assert!(check(&|h| h.max = f32::NAN));
    assert!(check(&|h| h.rotation[0][0] = 0.9));
    assert!(check(&|h| h.rotation[1][1] = f32::NAN));
    assert!(EnvironmentView::from_parts(EnvironmentParts { means: &means[1..], ..parts }).is_err());
    assert!(EnvironmentView::from_parts(EnvironmentParts { ranges: &ranges[1..], ..parts }).is_err());
    assert!(EnvironmentView::from_parts(EnvironmentParts { filtered_means: &filtered[1..], ..parts }).is_err());
    let refused = |means: &[f32], ranges: &[[f32; 2]], filtered_means: &[f32]| {
        EnvironmentView::from_parts(EnvironmentParts { means, ranges, filtered_means, ..parts }).is_err()
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

#[test]
fn suns_that_are_not_the_image_s_are_refused() {
    let environment = Environment::from_equal_area(64, &one_lit(64, 64, 40, 15), Filter::Nearest).unwrap();
    let view = environment.as_view();
    let parts = view.parts();
    assert_eq!((parts.suns.len(), parts.sun_texels.len()), (1, 1));
    let mut sun = parts.suns[0];
    sun.range[1] = 2;
    assert!(EnvironmentView::from_parts(EnvironmentParts { suns: &[sun], ..parts }).is_err());
    assert!(EnvironmentView::from_parts(EnvironmentParts { suns: &[], ..parts }).is_err());
    assert!(EnvironmentView::from_parts(EnvironmentParts { sun_texels: &[], ..parts }).is_err());
    let header = crate::EnvironmentHeader { cap: 1.0, ..parts.header };
    assert!(EnvironmentView::from_parts(EnvironmentParts { header, ..parts }).is_err());
}
