//! Environments that were taken apart and put together again.

use super::*;
use crate::env::EnvironmentView;

#[test]
fn parts_make_the_same_environment() {
    for environment in zoo().into_iter().chain([Environment::constant(0.0).unwrap()]) {
        let view = environment.as_view();
        let header: Vec<u8> = bytemuck::bytes_of(view.header()).to_vec();
        let again = EnvironmentView::from_parts(
            bytemuck::pod_read_unaligned(&header),
            view.means(),
            view.ranges(),
            view.filtered_means(),
        )
        .unwrap();
        assert_eq!(again.sample([0.3, 0.7]), view.sample([0.3, 0.7]));
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let environment = Environment::from_equal_area(16, &noise(256, 1), Filter::Nearest).unwrap();
    let view = environment.as_view();
    let (means, ranges, filtered) = (view.means(), view.ranges(), view.filtered_means());
    let check = |f: &dyn Fn(&mut crate::EnvironmentHeader)| {
        let mut header = *view.header();
        f(&mut header);
        EnvironmentView::from_parts(header, means, ranges, filtered).is_err()
    };
    assert!(!check(&|_| ()));
    assert!(check(&|h| h.depth = 3));
    assert!(check(&|h| h.depth = 14));
    assert!(check(&|h| h.depth = u32::MAX));
    assert!(check(&|h| h.mean *= 1.001));
    assert!(check(&|h| h.max = f32::NAN));
    assert!(check(&|h| h.rotation[0][0] = 0.9));
    assert!(check(&|h| h.rotation[1][1] = f32::NAN));
    assert!(EnvironmentView::from_parts(*view.header(), &means[1..], ranges, filtered).is_err());
    assert!(EnvironmentView::from_parts(*view.header(), means, &ranges[1..], filtered).is_err());
    assert!(EnvironmentView::from_parts(*view.header(), means, ranges, &filtered[1..]).is_err());
    for value in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
        for at in 0..means.len() {
            let (mut means, mut filtered, mut ranges) = (means.to_vec(), filtered.to_vec(), ranges.to_vec());
            means[at] = value;
            assert!(EnvironmentView::from_parts(*view.header(), &means, &ranges, &filtered).is_err(), "{at}");
            means[at] = view.means()[at];
            filtered[at] = value;
            assert!(EnvironmentView::from_parts(*view.header(), &means, &ranges, &filtered).is_err(), "{at}");
            filtered[at] = view.filtered_means()[at];
            if at < ranges.len() {
                ranges[at][1] = value;
                assert!(EnvironmentView::from_parts(*view.header(), &means, &ranges, &filtered).is_err(), "{at}");
            }
        }
    }
}
