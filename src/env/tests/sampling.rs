//! `sample`, `pdf` and `radiance`.

use super::*;
use crate::env::EnvironmentView;
use crate::testing::{chi_square, chi_square_limit};

const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

fn assert_agrees(view: &EnvironmentView<'_>, u: [f32; 2]) {
    let Some(sample) = view.sample(u) else {
        assert_eq!(view.mean(), 0.0);
        return;
    };
    assert!((sample.direction.length() - 1.0).abs() < 1e-6);
    assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && sample.radiance > 0.0, "{u:?} {sample:?}");
    // All read one texel, and so the same bits, also for a host that normalizes the direction.
    for direction in [sample.direction, sample.direction.normalize()] {
        assert_eq!(view.pdf(direction), sample.pdf, "{u:?} {sample:?}");
        assert_eq!(view.radiance(direction), sample.radiance, "{u:?} {sample:?}");
    }
}

#[test]
fn a_sample_s_density_is_that_of_its_direction() {
    let mut environments = zoo();
    environments.push(Environment::constant(2.0).unwrap());
    environments.push(Environment::constant(0.0).unwrap());
    environments.push(Environment::from_equal_area(8, &[0.0; 64], Filter::Bilinear).unwrap());
    let mut pcg = Pcg32::new(10, 10);
    let large = Environment::from_equal_area(1024, &noise(1 << 20, 9), Filter::Nearest).unwrap();
    environments.push(large.with_rotation(any_rotation(&mut pcg)).unwrap());
    for environment in &environments {
        let view = environment.as_view();
        for _ in 0..200_000 {
            assert_agrees(&view, [pcg.next_f32(), pcg.next_f32()]);
        }
        let edges = [0.0, BELOW_ONE, 0.5, 0.25, f32::from_bits(0.5_f32.to_bits() - 1), 1e-45];
        for u in edges {
            for v in edges {
                assert_agrees(&view, [u, v]);
            }
            for _ in 0..1000 {
                assert_agrees(&view, [u, pcg.next_f32()]);
                assert_agrees(&view, [pcg.next_f32(), u]);
            }
        }
    }
}

#[test]
fn the_largest_image_agrees_too() {
    // Depth 13 with few texels lit, at seams, poles and in general position.
    let size = 8192;
    let mut image = vec![0.0; size * size];
    let mut pcg = Pcg32::new(3, 14);
    for _ in 0..2000 {
        image[pcg.next_u32() as usize % (size * size)] = pcg.next_f32();
    }
    for (x, y) in [(0, 0), (size - 1, 0), (size / 2, size / 2), (size / 2 - 1, 0), (size - 1, size / 2), (100, 8091)] {
        image[y * size + x] = 1e10;
    }
    let mut environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
    for _ in 0..8 {
        environment.set_rotation(any_rotation(&mut pcg)).unwrap();
        let view = environment.as_view();
        for _ in 0..50_000 {
            assert_agrees(&view, [pcg.next_f32(), pcg.next_f32()]);
        }
    }
}

#[test]
fn samples_follow_the_density() {
    let mut pcg = Pcg32::new(21, 1);
    let n = 400_000;
    // Cells of a grid in z and azimuth that has nothing to do with the texels; expected counts by integration of
    // the density.
    let (bands, sectors) = (16, 32);
    let cell = |d: Vec3| {
        let band = ((d.z * 0.5 + 0.5) * bands as f32) as usize;
        let sector = ((d.y.atan2(d.x) / TAU + 0.5) * sectors as f32) as usize;
        band.min(bands - 1) * sectors + sector.min(sectors - 1)
    };
    for environment in [&zoo()[0], &zoo()[1], &zoo()[4], &Environment::constant(3.0).unwrap()] {
        let steps = 24;
        let mut expected = vec![0.0; bands * sectors];
        for (i, e) in expected.iter_mut().enumerate() {
            let (band, sector) = (i / sectors, i % sectors);
            for a in 0..steps {
                for b in 0..steps {
                    let z = (band as f32 + (a as f32 + 0.5) / steps as f32) / bands as f32 * 2.0 - 1.0;
                    let phi = ((sector as f32 + (b as f32 + 0.5) / steps as f32) / sectors as f32 - 0.5) * TAU;
                    let r = (1.0 - z * z).sqrt();
                    *e += f64::from(environment.pdf(Vec3::new(r * phi.cos(), r * phi.sin(), z)));
                }
            }
        }
        let total: f64 = expected.iter().sum();
        let norm = total / (expected.len() * steps * steps) as f64 * f64::from(2.0 * TAU);
        assert!((norm - 1.0).abs() < 0.01, "the density integrates to {norm}");
        // The integration's own error would show in a chi-square of these counts: compare texels for that, and
        // cells to within a few percent here.
        let mut observed = vec![0.0; bands * sectors];
        for _ in 0..n {
            observed[cell(environment.sample([pcg.next_f32(), pcg.next_f32()]).unwrap().direction)] += 1.0;
        }
        let distance: f64 = observed.iter().zip(&expected).map(|(o, e)| (o / f64::from(n) - e / total).abs()).sum();
        assert!(distance < 0.05, "total variation {distance}");
    }
}

#[test]
fn texels_are_chosen_in_proportion_to_their_radiance() {
    let mut pcg = Pcg32::new(22, 1);
    let n = 1_000_000;
    for environment in zoo() {
        let view = environment.as_view();
        let size = view.size() as usize;
        let texels = &view.means[view.means.len() - size * size..];
        let total: f64 = texels.iter().map(|&v| f64::from(v)).sum();
        let expected: Vec<f64> = texels.iter().map(|&v| f64::from(v) / total * f64::from(n)).collect();
        let mut observed = vec![0.0; size * size];
        let mut inside = [0.0; 64];
        for _ in 0..n {
            let sample = view.sample([pcg.next_f32(), pcg.next_f32()]).unwrap();
            let local = crate::env::rotation::to_local(&view.header.rotation, sample.direction);
            let point = crate::warp::equal_area::sphere_to_square(local) * size as f32;
            let (x, y) = (point.x as usize, point.y as usize);
            observed[y * size + x] += 1.0;
            inside[(point.y.fract() * 8.0) as usize * 8 + (point.x.fract() * 8.0) as usize] += 1.0;
        }
        let (statistic, degrees) = chi_square(&observed, &expected);
        assert!(statistic < chi_square_limit(degrees), "{statistic} with {degrees} degrees of freedom");
        let (statistic, degrees) = chi_square(&inside, &[f64::from(n) / 64.0; 64]);
        assert!(statistic < chi_square_limit(degrees), "{statistic} inside of texels");
    }
}

#[test]
fn stratified_numbers_stay_stratified() {
    // For a uniform image that is not stored as one, the warp is the identity of the square.
    let mut image = vec![1.0; 64 * 64];
    image[0] = 1.000_01;
    let environment = Environment::from_equal_area(64, &image, Filter::Nearest).unwrap();
    let mut pcg = Pcg32::new(1, 2);
    for _ in 0..100_000 {
        let u = glam::Vec2::new(pcg.next_f32(), pcg.next_f32());
        let point = crate::warp::equal_area::sphere_to_square(environment.sample(u.to_array()).unwrap().direction);
        assert!((point - u).abs().max_element() < 1e-5, "{u} {point}");
    }
}

#[test]
fn black_is_never_sampled() {
    let black = Environment::from_lat_long(4, 2, &[0.0; 8], Filter::Nearest).unwrap();
    assert!(black.sample([0.5, 0.5]).is_none());
    assert_eq!((black.pdf(Vec3::X), black.mean(), black.max()), (0.0, 0.0, 0.0));
    let lit = Environment::from_equal_area(64, &one_lit(64, 64, 63, 0), Filter::Nearest).unwrap();
    let mut pcg = Pcg32::new(1, 1);
    for _ in 0..10_000 {
        let sample = lit.sample([pcg.next_f32(), pcg.next_f32()]).unwrap();
        assert_eq!(sample.radiance, 1.0);
        assert!((sample.pdf * lit.texel_solid_angle() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn turning_turns_everything() {
    let still = Environment::from_lat_long(64, 32, &noise(64 * 32, 7), Filter::Nearest).unwrap();
    let mut pcg = Pcg32::new(8, 1);
    for _ in 0..20 {
        let rotation = any_rotation(&mut pcg);
        let turned = still.clone().with_rotation(rotation).unwrap();
        for _ in 0..1000 {
            let u = [pcg.next_f32(), pcg.next_f32()];
            let (a, b) = (still.sample(u).unwrap(), turned.sample(u).unwrap());
            assert!((rotation * a.direction - b.direction).length() < 1e-6);
            assert_eq!((a.pdf, a.radiance), (b.pdf, b.radiance));
        }
    }
}

#[test]
fn any_number_and_any_vector_is_safe() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1.0, 1e30, -0.0, 0.5, 1e-45];
    for environment in zoo() {
        for &a in &odd {
            for &b in &odd {
                let sample = environment.sample([a, b]).unwrap();
                assert!(sample.pdf.is_finite() && sample.pdf > 0.0 && sample.direction.is_finite());
                for &c in &odd {
                    let d = Vec3::new(a, b, c);
                    assert!(environment.pdf(d).is_finite() && environment.radiance(d).is_finite());
                }
            }
        }
    }
}

#[test]
fn samples_are_the_same_bits_everywhere() {
    let mut pcg = Pcg32::new(40, 1);
    let image: Vec<f32> = (0..1024).map(|_| pcg.next_f32()).collect();
    let environment = Environment::from_equal_area(32, &image, Filter::Bilinear).unwrap();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for _ in 0..10_000 {
        let sample = environment.sample([pcg.next_f32(), pcg.next_f32()]).unwrap();
        for x in sample.direction.to_array().into_iter().chain([sample.radiance, sample.pdf]) {
            hash = (hash ^ u64::from(x.to_bits())).wrapping_mul(0x0100_0000_01b3);
        }
    }
    assert_eq!(hash, 14_498_952_895_062_356_828);
}
