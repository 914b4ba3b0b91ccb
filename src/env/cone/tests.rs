//! The bounds hold every direction of the cone.

use super::*;
use crate::env::Environment;
use crate::env::tests::{any_rotation, noise, one_lit, zoo};
use crate::env::view::texel_at;
use crate::record::Filter;
use crate::testing::Pcg32;
use alloc::vec;
use core::f32::consts::{FRAC_PI_2, PI, TAU};

fn region(direction: Vec3, radius: f32) -> DirectionCone {
    let sin_radius = if radius < FRAC_PI_2 { radius.sin() } else { 1.0 };
    DirectionCone { direction, sin_radius, solid_angle: TAU * (1.0 - radius.cos()) }
}

/// A direction inside of a cone: its rim and its axis are hit, too.
fn inside(axis: Vec3, radius: f32, pcg: &mut Pcg32) -> Vec3 {
    let (s, t) = axis.normalize().any_orthonormal_pair();
    let angle = radius * (1.05 * pcg.next_f32()).min(0.999_99);
    let (sin, cos) = (TAU * pcg.next_f32()).sin_cos();
    (axis * angle.cos() + (s * cos + t * sin) * angle.sin()).normalize()
}

fn any_radius(pcg: &mut Pcg32) -> f32 {
    0.5_f32.powf(14.0 * pcg.next_f32()) * PI
}

impl EnvironmentView<'_> {
    fn bounds_of(&self, region: &DirectionCone) -> RadianceBounds {
        let center = sphere_to_square(to_local(&self.header.rotation, region.direction));
        self.radiance_bounds(center.x, center.y, region.sin_radius)
    }

    /// Radiance without the bright features.
    fn rest(&self, direction: Vec3) -> f32 {
        let depth = self.header.depth;
        let texel = texel_at(depth, sphere_to_square(to_local(&self.header.rotation, direction)));
        self.range_at(depth, texel & ((1 << depth) - 1), texel >> depth)[0]
    }
}

#[test]
fn asin_is_bounded() {
    for i in 0..100_000 {
        let s = i as f64 / 100_000.0;
        let bound = f64::from(asin_bound(s as f32));
        assert!(bound >= s.asin() * (1.0 - 1e-6) && bound <= 1.13 * s.asin() + 1e-6, "{s}: {bound}");
    }
    for s in [1.0, 2.0, f32::INFINITY, f32::NAN] {
        assert!(asin_bound(s) > PI);
    }
    assert_eq!(asin_bound(-1.0), 0.0);
}

#[test]
fn logarithms_of_powers_of_two() {
    for e in -126..127 {
        let x = (e as f32).exp2();
        assert_eq!((floor_log2(x), floor_log2(1.999 * x)), (e, e));
    }
}

#[test]
fn the_bounds_hold_every_direction_of_the_cone() {
    let mut pcg = Pcg32::new(31, 1);
    let mut environments = zoo();
    let fine = Environment::from_equal_area(512, &noise(512 * 512, 5), Filter::Nearest).unwrap();
    environments.push(fine.with_rotation(any_rotation(&mut pcg)).unwrap());
    for environment in &environments {
        let view = environment.as_view();
        for k in 0..20_000 {
            let mut axis = pcg.direction();
            if k % 4 == 0 {
                // Close to poles, seams and edge midpoints of the square.
                axis = (axis * 0.01 + Vec3::AXES[k / 4 % 3] * if k % 8 == 0 { 1.0 } else { -1.0 }).normalize();
                axis = view.rotation() * axis;
            }
            let radius = any_radius(&mut pcg);
            let region = region(axis, radius);
            let (bounds, estimate) = (view.bounds_of(&region), view.estimate_radiance(&region));
            assert!(bounds.min <= bounds.mean * 1.000_001 && bounds.mean <= bounds.max * 1.000_001);
            assert_eq!(estimate.value > 0.0, bounds.max > 0.0);
            assert_eq!(estimate.is_constant, bounds.min >= CONSTANT_RATIO * bounds.max);
            for _ in 0..20 {
                let radiance = view.rest(inside(axis, radius, &mut pcg));
                assert!(bounds.min <= radiance && radiance <= bounds.max, "{axis} {radius}: {radiance}");
            }
        }
    }
}

#[test]
fn a_lit_texel_is_never_lost() {
    let mut pcg = Pcg32::new(32, 1);
    for size in [2, 16, 256] {
        for _ in 0..300 {
            let texel = (pcg.next_u32() as usize % size, pcg.next_u32() as usize % size);
            for (x, y) in [texel, (0, texel.1), (texel.0, size - 1), (size / 2, size / 2)] {
                let image = one_lit(size, size, x, y);
                let environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
                let lit = environment.sample([pcg.next_f32(), pcg.next_f32()]).unwrap().direction;
                for _ in 0..20 {
                    let radius = any_radius(&mut pcg);
                    // An axis such that the lit direction is inside of the cone, and a solid angle of any size.
                    let mut region = region(inside(lit, radius, &mut pcg), radius);
                    region.solid_angle *= pcg.next_f32();
                    assert!(
                        environment.as_view().estimate_radiance(&region).value > 0.0,
                        "{x} {y} of {size}, {radius}"
                    );
                }
            }
        }
    }
}

#[test]
fn black_and_constant_regions_are_known() {
    let image: vec::Vec<f32> = (0..256 * 128).map(|i| if i < 256 * 64 { 2.0 } else { 0.0 }).collect();
    let environment = Environment::from_lat_long(256, 128, &image, Filter::Nearest).unwrap();
    let view = environment.as_view();
    let mut pcg = Pcg32::new(33, 1);
    let mut exact = 0;
    for _ in 0..10_000 {
        let axis = pcg.direction();
        let estimate = view.estimate_radiance(&region(axis, 0.02));
        if axis.z.abs() > 0.2 {
            exact += 1;
            assert_eq!(estimate, RadianceEstimate { value: if axis.z > 0.0 { 2.0 } else { 0.0 }, is_constant: true });
        }
    }
    assert!(exact > 5000);
    let whole = RadianceEstimate { value: 2.5, is_constant: true };
    assert_eq!(Environment::constant(2.5).unwrap().as_view().estimate_radiance(&region(Vec3::X, 4.0)), whole);
}

#[test]
fn a_smooth_sky_is_estimated_well() {
    let size = 256_usize;
    let sky = |d: Vec3| 1.0 + 0.5 * d.z + 0.3 * d.x;
    let texel = |i: usize| {
        let point = (glam::Vec2::new((i % size) as f32, (i / size) as f32) + 0.5) / size as f32;
        sky(crate::warp::equal_area::square_to_sphere(point))
    };
    let image: vec::Vec<f32> = (0..size * size).map(texel).collect();
    let environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
    let mut pcg = Pcg32::new(34, 1);
    for _ in 0..10_000 {
        let axis = pcg.direction();
        let estimate = environment.as_view().estimate_radiance(&region(axis, 0.05));
        assert!((estimate.value / sky(axis) - 1.0).abs() < 0.15, "{axis}: {estimate:?}");
    }
}

#[test]
fn any_region_is_safe() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, 1e30, 0.5, 1e-45];
    for environment in zoo() {
        for a in odd {
            for b in odd {
                for direction in [Vec3::new(a, b, 0.3), Vec3::splat(a), Vec3::X] {
                    let region = DirectionCone { direction, sin_radius: b, solid_angle: a };
                    let value = environment.as_view().estimate_radiance(&region).value;
                    assert!(value.is_finite() && value >= 0.0);
                }
            }
        }
    }
}
