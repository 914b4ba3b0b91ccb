//! From images to equal-area ones.

use super::*;
use crate::env::source::EnvironmentSource;
use crate::env::{EnvironmentImage, Poles};
use core::f64::consts::PI as PI64;

/// Mean over the sphere of a latitude-longitude image as the host sees it.
fn lat_long_mean(width: usize, height: usize, image: &[f32], filter: Filter) -> f64 {
    let source = EnvironmentSource::new(&EnvironmentImage::lat_long(width, height, image).filter(filter)).unwrap();
    let (columns, rows) = (source.columns(), source.rows());
    let mut sum = 0.0;
    for row in 0..rows {
        // cos a - cos b without cancellation.
        let (top, bottom) = (row as f64 / rows as f64 * PI64, (row + 1) as f64 / rows as f64 * PI64);
        let band = 2.0 * ((top + bottom) / 2.0).sin() * ((bottom - top) / 2.0).sin();
        sum += (0..columns).map(|c| source.cell(c, row)).sum::<f64>() / columns as f64 * band / 2.0;
    }
    sum
}

fn assert_close(found: f32, expected: f64, tolerance: f64, what: &str) {
    assert!((f64::from(found) / expected - 1.0).abs() < tolerance, "{what}: {found:e}, expected {expected:e}");
}

#[test]
fn lat_long_flux_is_kept() {
    for (width, height) in [(1, 2), (3, 1), (5, 3), (16, 8), (37, 21), (128, 64), (300, 150)] {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let image = noise(width * height, (width + height) as u64);
            let environment = Environment::from_lat_long(width, height, &image, filter).unwrap();
            let expected = lat_long_mean(width, height, &image, filter);
            assert_close(environment.mean(), expected, 1e-6, &alloc::format!("{width} x {height} {filter:?}"));
        }
    }
}

#[test]
fn lat_long_flux_of_one_texel_is_kept() {
    for (width, height) in [(8, 4), (31, 17), (256, 128)] {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            for y in [0, 1, height / 2 - 1, height / 2, height - 1] {
                for x in [0, 1, width / 4, width / 2, width - 1] {
                    let image = one_lit(width, height, x, y);
                    for size in [0, 2, 64] {
                        let environment = match size {
                            0 => Environment::from_lat_long(width, height, &image, filter),
                            _ => Environment::new(
                                &EnvironmentImage::lat_long(width, height, &image).filter(filter).resolution(size),
                            ),
                        };
                        let expected = lat_long_mean(width, height, &image, filter);
                        let what = alloc::format!("({x}, {y}) of {width} x {height}, {filter:?}, {size}");
                        assert_close(environment.unwrap().mean(), expected, 1e-6, &what);
                    }
                }
            }
        }
    }
}

#[test]
fn equal_area_flux_is_kept() {
    for size in [2_usize, 3, 5, 16, 37, 100] {
        let image = noise(size * size, size as u64);
        let expected = image.iter().map(|&v| f64::from(v)).sum::<f64>() / (size * size) as f64;
        for filter in [Filter::Nearest, Filter::Bilinear] {
            for resolution in [1, 2, 64] {
                let found =
                    Environment::new(&EnvironmentImage::equal_area(size, &image).filter(filter).resolution(resolution))
                        .unwrap();
                assert_close(found.mean(), expected, 1e-6, "mean");
            }
            assert_close(Environment::from_equal_area(size, &image, filter).unwrap().mean(), expected, 1e-6, "mean");
        }
    }
}

#[test]
fn a_power_of_two_is_taken_as_it_is() {
    let image = noise(1024, 1);
    let environment = Environment::from_equal_area(32, &image, Filter::Nearest).unwrap();
    assert_eq!(environment.as_view().means[341..], image);
    for y in 0..32 {
        for x in 0..32 {
            let point = (glam::Vec2::new(x as f32, y as f32) + 0.5) / 32.0;
            let direction = crate::warp::equal_area::square_to_sphere(point);
            assert_eq!(environment.radiance(direction), image[y * 32 + x]);
        }
    }
}

#[test]
fn lit_places_stay_lit_and_all_others_black() {
    let mut pcg = Pcg32::new(6, 6);
    for filter in [Filter::Nearest, Filter::Bilinear] {
        for (width, height) in [(16_usize, 8_usize), (37, 21), (200, 100)] {
            for size in [4, 64, 512] {
                let (x, y) = (pcg.next_u32() as usize % width, pcg.next_u32() as usize % height);
                for y in [y, 0, height - 1] {
                    let image = one_lit(width, height, x, y).iter().map(|v| v * 1e-30).collect::<Vec<_>>();
                    let e = Environment::new(
                        &EnvironmentImage::lat_long(width, height, &image).filter(filter).resolution(size),
                    )
                    .unwrap();
                    let reach = if filter == Filter::Nearest { 0.0 } else { 0.5 };
                    for _ in 0..1000 {
                        let u = x as f32 - reach + (1.0 + 2.0 * reach) * (0.001 + 0.998 * pcg.next_f32());
                        let v = y as f32 - reach + (1.0 + 2.0 * reach) * (0.001 + 0.998 * pcg.next_f32());
                        let v = v.clamp(0.001, height as f32 - 0.001);
                        let direction = lat_long_direction(u / width as f32, v / height as f32);
                        assert!(e.radiance(direction) > 0.0, "{x}, {y}: {u}, {v}");
                    }
                    // No texel is lit that does not overlap.
                    let lit = e.as_view().means[(size * size - 1) / 3..].iter().filter(|&&v| v > 0.0).count();
                    let share = lat_long_mean(width, height, &one_lit(width, height, x, y), Filter::Nearest);
                    let texels = share * (size * size) as f64 * if reach > 0.0 { 4.0 } else { 1.0 };
                    assert!((lit as f64) < 3.0 * texels + 40.0 + 4.0 * (texels * 40.0).sqrt() + size as f64 / 4.0);
                }
            }
        }
    }
}

#[test]
fn a_black_hemisphere_stays_black() {
    let image: Vec<f32> = (0..64 * 32).map(|i| if i < 64 * 16 { 1.0 } else { 0.0 }).collect();
    let environment = Environment::from_lat_long(64, 32, &image, Filter::Nearest).unwrap();
    let mut pcg = Pcg32::new(2, 2);
    for _ in 0..100_000 {
        let direction = pcg.direction();
        // The texels that the equator cuts hold both: their diagonal is 1/32 in r, twice that in z.
        if direction.z < -0.065 {
            assert_eq!(environment.radiance(direction), 0.0);
        } else if direction.z > 0.065 {
            assert_eq!(environment.radiance(direction), 1.0);
        }
    }
}

#[test]
fn pixels_are_where_the_convention_says() {
    let (width, height) = (64, 32);
    let image = noise(width * height, 4);
    let e =
        Environment::new(&EnvironmentImage::lat_long(width, height, &image).filter(Filter::Nearest).resolution(1024))
            .unwrap();
    let mut y_up = e.clone();
    y_up.set_rotation(Environment::Y_UP_LAT_LONG).unwrap();
    for y in 1..height - 1 {
        for x in 0..width {
            let (u, v) = ((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let value = image[y * width + x];
            assert_eq!(e.radiance(lat_long_direction(u, v)), value, "{x} {y}");
            let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
            assert_eq!(y_up.radiance(Vec3::new(sin_phi * sin, cos, -cos_phi * sin)), value, "{x} {y}");
        }
    }
}

#[test]
fn levels_hold_what_is_below_them() {
    for environment in zoo() {
        let view = environment.as_view();
        let finest = view.header.depth;
        let rest = |x, y| view.range_at(finest, x, y)[0];
        let filtered = view.filtered;
        for depth in 0..=finest {
            let (size, below) = (1_u32 << depth, 1_u32 << (finest - depth));
            for (y, x) in (0..size).flat_map(|y| (0..size).map(move |x| (y, x))) {
                let texels = (0..below).flat_map(|j| (0..below).map(move |i| (i, j)));
                let texels: Vec<f32> =
                    texels.map(|(i, j)| view.mean_at(finest, x * below + i, y * below + j)).collect();
                let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / texels.len() as f64;
                let found = view.mean_at(depth, x, y);
                assert!((f64::from(found) - mean).abs() <= 1e-6 * mean);
                let [min, max] = view.range_at(depth, x, y);
                let rests = || (0..below * below).map(|k| rest(x * below + k % below, y * below + k / below));
                assert_eq!(min, rests().fold(f32::INFINITY, f32::min));
                assert_eq!(max, rests().fold(0.0, f32::max));
                assert_eq!(found > 0.0, max > 0.0);
                let mut sum = 0.0;
                for (dy, dx) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dy, dx))) {
                    let (i, j) = crate::warp::equal_area::wrap_texel(x as i32 + dx, y as i32 + dy, size as i32);
                    let below = (0..below).flat_map(|y| (0..below).map(move |x| (i * below + x, j * below + y)));
                    let capped = below.map(|(x, y)| f64::from(rest(x, y)));
                    sum += capped.sum::<f64>() / 4f64.powi((finest - depth) as i32);
                }
                let index = crate::env::pyramid::level_start(depth) + (y * size + x) as usize;
                assert!((f64::from(filtered[index]) - sum / 9.0).abs() <= 1e-6 * sum);
            }
        }
    }
}

#[test]
fn uniform_images_and_constants_cost_nothing() {
    let environments = [
        Environment::constant(0.3).unwrap(),
        Environment::from_lat_long(37, 20, &[0.3; 740], Filter::Bilinear).unwrap(),
        Environment::from_equal_area(5, &[0.3; 25], Filter::Nearest).unwrap(),
    ];
    for environment in environments {
        assert!(environment.is_constant());
        assert_eq!(environment.as_view().means, [0.3]);
        assert_eq!((environment.mean(), environment.max(), environment.size()), (0.3, 0.3, 1));
        assert!((environment.texel_solid_angle() - 2.0 * TAU).abs() < 1e-5);
    }
    // A region keeps its value exactly although texels and cells do not line up.
    let image: Vec<f32> = (0..50 * 30).map(|i| if i < 50 * 20 { 0.3 } else { 0.7 }).collect();
    let environment = Environment::from_lat_long(50, 30, &image, Filter::Bilinear).unwrap();
    let mixed = environment.as_view().means[(64 * 64 - 1) / 3..].iter().filter(|&&v| v != 0.3 && v != 0.7);
    assert!(mixed.count() < 64 * 64 / 5);
}

#[test]
fn memory_is_in_bounds() {
    let environment = Environment::from_equal_area(1024, &noise(1 << 20, 1), Filter::Nearest).unwrap();
    let view = environment.as_view();
    let bytes = size_of_val(view.means) + size_of_val(view.ranges) + size_of_val(view.filtered);
    assert!(bytes <= 16_000_000, "{bytes}");
}

#[test]
fn extremes_of_brightness() {
    for value in [1e30, 1e-30, 1e-38, 1e-45] {
        let mut image = one_lit(64, 32, 10, 3);
        image.iter_mut().for_each(|v| *v *= value);
        let environment =
            Environment::new(&EnvironmentImage::lat_long(64, 32, &image).filter(Filter::Bilinear).resolution(2048))
                .unwrap();
        assert!(environment.mean() > 0.0 && environment.mean().is_finite());
        let view = environment.as_view();
        assert!(view.means.iter().zip(view.filtered).all(|(a, b)| a.is_finite() && b.is_finite()));
        let sample = environment.sample([0.3, 0.6]).unwrap();
        assert!(sample.pdf.is_finite() && sample.pdf > 0.0 && sample.radiance >= 1e-30);
        let constant = Environment::constant(value).unwrap();
        assert!((constant.pdf(Vec3::X) * 2.0 * TAU - 1.0).abs() < 1e-6);
    }
    let all = Environment::from_equal_area(4, &[1e30; 16], Filter::Bilinear).unwrap();
    assert_eq!(all.mean(), 1e30);
}

#[test]
fn bad_images_are_refused_by_name() {
    let build = |value: f32| {
        let mut image = [1.0; 8];
        image[6] = value;
        Environment::from_lat_long(4, 2, &image, Filter::Nearest)
    };
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e31] {
        let message = build(value).unwrap_err();
        assert!(alloc::format!("{message}").contains("(2, 1)"), "{message}");
    }
    let clamped = build(-1.0).unwrap();
    assert_eq!(clamped.clamped_texels(), 1);
    assert_eq!(Environment::from_equal_area(1, &[-1.0], Filter::Nearest).unwrap().clamped_texels(), 1);
    for (width, height, count) in [(0, 1, 0), (1, 0, 0), (2, 2, 3), (1 << 17, 1, 1 << 17), (usize::MAX, 2, 1)] {
        assert!(Environment::from_lat_long(width, height, &vec![1.0; count], Filter::Nearest).is_err());
    }
    for size in [0, 8193, usize::MAX] {
        assert!(
            Environment::new(&EnvironmentImage::equal_area(1, &[1.0]).filter(Filter::Nearest).resolution(size))
                .is_err()
        );
    }
    for value in [f32::NAN, -1.0, f32::INFINITY, 1e31] {
        assert!(Environment::constant(value).is_err());
    }
}

#[test]
fn only_rotations_rotate() {
    let environment = Environment::constant(1.0).unwrap();
    let mut skewed = Mat3::IDENTITY;
    skewed.x_axis.y = 0.01;
    for bad in [Mat3::ZERO, -Mat3::IDENTITY, 1.001 * Mat3::IDENTITY, skewed, f32::NAN * Mat3::IDENTITY] {
        assert!(environment.clone().with_rotation(bad).is_err());
    }
    skewed.x_axis.y = 5e-5;
    let nearly = environment.clone().with_rotation(skewed).unwrap().rotation();
    let error = nearly.transpose() * nearly - Mat3::IDENTITY;
    assert!(error.to_cols_array().iter().all(|e| e.abs() < 5e-7));
    let mut pcg = Pcg32::new(1, 4);
    for _ in 0..1000 {
        let rotation = any_rotation(&mut pcg);
        let once = environment.clone().with_rotation(rotation).unwrap().rotation();
        assert!((once - rotation).to_cols_array().iter().all(|e| e.abs() < 2e-6));
        assert_eq!(environment.clone().with_rotation(once).unwrap().rotation(), once);
    }
}

/// Value of the texel in which a direction of the environment's frame lies.
fn texel_in_direction(width: usize, height: usize, image: &[f32], direction: Vec3) -> f64 {
    let d = direction.as_dvec3();
    let u = (-d.y.atan2(d.x) / (2.0 * PI64)).rem_euclid(1.0);
    let v = d.z.clamp(-1.0, 1.0).acos() / PI64;
    let (x, y) = ((u * width as f64) as usize, (v * height as f64) as usize);
    f64::from(image[y.min(height - 1) * width + x.min(width - 1)])
}

/// A host that interpolates between the four texels whose centers are nearest on the sphere, beyond the poles too.
fn host_across_the_poles(width: usize, height: usize, image: &[f32], u: f64, v: f64) -> f64 {
    let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (s, t) = (x - left, y - top);
    let texel = |i: f64, j: f64| {
        // A little to both sides: beyond the pole of an image of odd width a center is on a border.
        let value = |offset: f64| {
            let (u, v) = ((left + i + 0.5 + offset) / width as f64, (top + j + 0.5) / height as f64);
            // A negative polar angle leads over the pole.
            texel_in_direction(width, height, image, lat_long_direction(u as f32, v as f32))
        };
        0.5 * (value(-0.01) + value(0.01))
    };
    (1.0 - t) * ((1.0 - s) * texel(0.0, 0.0) + s * texel(1.0, 0.0))
        + t * ((1.0 - s) * texel(0.0, 1.0) + s * texel(1.0, 1.0))
}

#[test]
fn rows_beyond_the_poles_are_those_of_the_host() {
    for (width, height) in [(1, 1), (2, 1), (8, 4), (7, 4), (16, 8)] {
        let image = noise(width * height, 11);
        let lat_long = EnvironmentImage::lat_long(width, height, &image).poles(Poles::Across);
        let source = EnvironmentSource::new(&lat_long).unwrap();
        let (columns, rows) = (source.columns(), source.rows());
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            // The mean of an interpolated function over a quadrant is its value in the center.
            let (u, v) = ((column as f64 + 0.5) / columns as f64, (row as f64 + 0.5) / rows as f64);
            let expected = host_across_the_poles(width, height, &image, u, v);
            let found = source.cell(column, row);
            assert!(
                (found - expected).abs() <= 1e-6 * expected,
                "{width} x {height}, {column} {row}: {found} {expected}"
            );
        }
    }
}

#[test]
fn light_reaches_over_a_pole_if_the_host_reads_it_there() {
    let (width, height) = (16, 8);
    for (y, v) in [(0, 0.01), (height - 1, 0.99)] {
        let image = one_lit(width, height, 3, y);
        for (poles, filter, lit) in [
            (Poles::Clamp, Filter::Bilinear, false),
            (Poles::Across, Filter::Bilinear, true),
            (Poles::Across, Filter::Nearest, false),
        ] {
            let image = EnvironmentImage::lat_long(width, height, &image).filter(filter).poles(poles).resolution(256);
            let environment = Environment::new(&image).unwrap();
            // Columns 3 + 8: half a turn away.
            let beyond = lat_long_direction(11.5 / width as f32, v);
            assert_eq!(environment.radiance(beyond) > 0.0, lit, "{poles:?} {filter:?}");
            assert!(environment.radiance(lat_long_direction(3.5 / width as f32, v)) > 0.0);
        }
    }
}
