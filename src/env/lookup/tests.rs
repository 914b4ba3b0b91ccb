use super::*;
use crate::env::DirectionCone;
use crate::env::tests::zoo;
use crate::testing::Pcg32;
use crate::warp::equal_area::sphere_to_square;
use glam::Vec3;

/// The map is as close to the exact one as [`COVERING_SLACK`] assumes, seams aside, where both sides are right.
#[test]
fn the_map_is_close_to_the_exact_one() {
    let mut pcg = Pcg32::new(1, 71);
    let mut worst: f32 = 0.0;
    for _ in 0..400_000 {
        let direction = pcg.direction().normalize();
        let distance = 0.1 + 10.0 * pcg.next_f32();
        let [u, v] = direction_to_square((direction * distance).to_array(), distance);
        assert!((0.0..=LAST).contains(&u) && (0.0..=LAST).contains(&v));
        let exact = sphere_to_square(direction).min(glam::Vec2::splat(LAST));
        if direction.z.abs() > 1e-6 {
            worst = worst.max((u - exact.x).abs()).max((v - exact.y).abs());
        }
    }
    assert!(worst < 4.5e-6, "{worst}");
}

/// Estimates of cones at random, several at once, against each alone.
#[test]
fn estimates_are_those_of_single_cones_and_zero_proves_black() {
    let mut pcg = Pcg32::new(2, 71);
    let (mut black, mut close, mut count) = (0, 0, 0);
    for sky in zoo() {
        let view = sky.as_view();
        let lookup = view.vector_lookup();
        for _ in 0..500 {
            let cones: [DirectionCone; 8] = core::array::from_fn(|_| {
                let radius = 1.5 * pcg.next_f32() * pcg.next_f32() * pcg.next_f32();
                DirectionCone::ball(pcg.direction().normalize() * 2.0, 2.0 * radius)
            });
            let (mut nearest, mut covering) = ([0; 8], [0; 8]);
            for (i, cone) in cones.iter().enumerate() {
                let local = view.local_direction(cone.direction);
                let point = direction_to_square(local.to_array(), 1.0);
                nearest[i] = lookup.nearest(point, VectorLookup::texels_of(cone.solid_angle));
                covering[i] = lookup.covering(point, cone.sin_radius);
            }
            let mut radiances = [0.0; 8];
            lookup.relative_radiances(&nearest, &covering, &mut radiances);
            for (cone, radiance) in cones.iter().zip(radiances) {
                assert!(radiance.is_finite() && radiance >= 0.0);
                let alone = view.estimate_radiance(cone).value;
                count += 1;
                close += u32::from((radiance * view.mean_without_features() / alone).log2().abs() < 1.0);
                if radiance == 0.0 {
                    black += 1;
                    // All of the cone, by directions in it.
                    for _ in 0..20 {
                        let aside = pcg.direction().normalize() * cone.sin_radius.min(1.0) * pcg.next_f32();
                        let direction = (cone.direction + aside).normalize();
                        let sine = direction.cross(cone.direction).length();
                        assert!(sine > cone.sin_radius || view.radiance(direction) == 0.0);
                    }
                }
            }
        }
    }
    assert!(black > 100 && 2 * close > count, "{black} black, {close} of {count} close");
}

#[test]
fn any_direction_has_an_estimate() {
    const VALUES: [f32; 8] = [0.0, -0.0, 1e-45, 1.0, 1e38, f32::MAX, f32::INFINITY, f32::NAN];
    for sky in zoo() {
        let view = sky.as_view();
        let lookup = view.vector_lookup();
        for (x, other) in VALUES.into_iter().flat_map(|x| VALUES.map(|other| (x, other))) {
            let direction = Vec3::new(x, other, 1.0);
            let point = direction_to_square(direction.to_array(), direction.length());
            let nearest = lookup.nearest(point, VectorLookup::texels_of(x));
            let covering = lookup.covering(point, other);
            let mut radiances = [0.0];
            lookup.relative_radiances(&[nearest], &[covering], &mut radiances);
            let [radiance] = radiances;
            assert!(radiance >= 0.0 && radiance.is_finite(), "{x} {other}: {radiance}");
        }
    }
}
