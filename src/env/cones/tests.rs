use alloc::vec::Vec;

use glam::{Mat3, Quat, Vec3};

use crate::Filter;
use crate::env::{DirectionCone, Environment};
use crate::testing::Pcg32;

/// Bright above, dark around, and below of a radiance.
fn sky(below: f32) -> Environment {
    let (width, height) = (64, 32);
    let value = |i: usize| match i / width {
        0..8 => 3.0 + (i % 5) as f32,
        8..16 => 0.1,
        _ => below,
    };
    let texels: Vec<f32> = (0..width * height).map(value).collect();
    let mut sky = Environment::from_lat_long(width, height, &texels, Filter::Nearest).expect("a good image");
    sky.set_rotation(Mat3::from_quat(Quat::from_rotation_x(0.4))).expect("a rotation");
    sky
}

#[test]
fn many_balls_are_about_as_bright_as_each_alone() {
    compare(&sky(0.05));
}

#[test]
fn black_balls_are_black() {
    assert!(compare(&sky(0.0)) > 100);
}

/// Balls all at once against each alone; the number of black ones.
fn compare(sky: &Environment) -> u32 {
    let mut pcg = Pcg32::new(1, 91);
    let view = sky.as_view();
    let (mut lit, mut black, mut close) = (0, 0, 0);
    for _ in 0..2000 {
        let centers: [Vec3; 8] = core::array::from_fn(|_| 10.0 * pcg.next_f32() * pcg.direction());
        let radii: [f32; 8] = core::array::from_fn(|_| 2.0 * pcg.next_f32() * pcg.next_f32());
        let by_axis = [0, 1, 2].map(|axis| centers.map(|center| center[axis]));
        let set = pcg.next_u32() & 0xff;
        let mut values = [0.0; 8];
        view.radiances_of_balls(by_axis.each_ref().map(|axis| &axis[..]), &radii, set, &mut values);
        for i in 0..8 {
            let alone = view.estimate_radiance(&DirectionCone::ball(centers[i], radii[i])).value;
            match (set >> i & 1, alone > 0.0) {
                (0, _) => assert_eq!(values[i], 0.0),
                (_, false) => {
                    black += 1;
                    assert_eq!(values[i], 0.0);
                }
                (_, true) => {
                    assert!(values[i] > 0.0 && values[i] <= view.max());
                    if radii[i] < 0.2 * centers[i].length() {
                        // One texel holds it, which is then known better than by the filter.
                        continue;
                    }
                    lit += 1;
                    // Both read one texel of the filter; they differ by the share of what is around it.
                    close += u32::from((values[i] - alone).abs() <= 0.03 * view.max());
                }
            }
        }
    }
    assert!(lit > 1000, "{lit}");
    // Rounding takes some to the neighbor.
    assert!(f64::from(close) > 0.99 * f64::from(lit), "{close} of {lit}");
    black
}

#[test]
fn any_ball_has_a_number() {
    const VALUES: [f32; 7] = [0.0, -0.0, 1e-45, 1e38, f32::MAX, f32::INFINITY, f32::NAN];
    for (below, value) in [0.0, 1.0].into_iter().flat_map(|below| VALUES.map(|value| (below, value))) {
        let mut values = [0.0; 4];
        let centers: [&[f32]; 3] = [&[value; 4], &[0.0; 4], &[1.0; 4]];
        sky(below).as_view().radiances_of_balls(centers, &[value; 4], 0xf, &mut values);
        assert!(values.iter().all(|value| value.is_finite() && *value >= 0.0), "{value}: {values:?}");
    }
}
