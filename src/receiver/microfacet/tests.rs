use core::f64::consts::PI;

use glam::DVec3;

use super::*;
use crate::receiver::{Receiver, ShadingPoint};
use crate::testing::Pcg32;

/// A surface and the numbers that it was made of, with the normal z and the tangent x.
#[derive(Clone, Copy, Debug)]
struct MicrofacetParameters {
    outgoing: [f64; 3],
    alphas: [f64; 2],
    weights: [f64; 3],
    ior: f64,
}

impl MicrofacetParameters {
    fn surface(&self) -> Microfacet {
        let [diffuse, reflected, transmitted] = self.weights.map(|weight| weight as f32);
        Microfacet::new(Vec3::Z, DVec3::from_array(self.outgoing).as_vec3(), 0.5)
            .anisotropic(Vec3::new(2.0, 0.0, 1.0), self.alphas.map(|alpha| alpha as f32))
            .with_weights(diffuse, reflected, transmitted)
            .with_ior(self.ior as f32)
    }

    /// `π f cos θ` from the books: Walter et al. 2007 (equations 20 and 21, with the index on the side of the light
    /// squared), Heitz 2014 for the anisotropic distribution and Smith's Λ.
    fn scattered(&self, direction: DVec3) -> f64 {
        let outgoing = DVec3::from_array(self.outgoing);
        let (sum, [x, y]) = (self.weights.iter().sum::<f64>(), self.alphas);
        let d = |h: DVec3| {
            let q = (h.x / x).powi(2) + (h.y / y).powi(2) + h.z * h.z;
            if h.z > 0.0 { 1.0 / (PI * x * y * q * q) } else { 0.0 }
        };
        let lambda = |v: DVec3| 0.5 * ((1.0 + ((x * v.x).powi(2) + (y * v.y).powi(2)) / (v.z * v.z)).sqrt() - 1.0);
        let g = |v: DVec3| 1.0 / (1.0 + lambda(v) + lambda(outgoing));
        let reflect = |v: DVec3| PI * d((v + outgoing).normalize()) * g(v) / (4.0 * outgoing.z);
        let [diffuse, reflected, transmitted] = self.weights;
        if direction.z >= 0.0 {
            return (diffuse * direction.z + reflected * reflect(direction)) / sum;
        }
        let mirrored = DVec3::new(direction.x, direction.y, -direction.z);
        let value = if self.ior == 1.0 {
            reflect(mirrored)
        } else {
            let h = outgoing + self.ior * direction;
            let h = if h.z < 0.0 { -h.normalize() } else { h.normalize() };
            let (o, i) = (outgoing.dot(h), direction.dot(h));
            if o <= 0.0 || i >= 0.0 {
                0.0
            } else {
                let jacobian = self.ior.powi(2) * (o * i).abs() / (o + self.ior * i).powi(2);
                PI * d(h) * g(direction) * jacobian / outgoing.z
            }
        };
        transmitted * value / sum
    }
}

fn lobes() -> [MicrofacetParameters; 8] {
    let of = |outgoing, alphas, weights, ior| MicrofacetParameters { outgoing, alphas, weights, ior };
    [
        of([0.6, 0.0, 0.8], [0.1, 0.5], [0.0, 1.0, 0.0], 1.0),
        of([0.48, 0.6, 0.64], [0.3, 0.05], [0.5, 0.5, 0.0], 1.0),
        of([0.0, 0.6, 0.8], [0.2, 0.2], [0.0, 0.1, 0.9], 1.0),
        of([0.6, 0.0, 0.8], [0.2, 0.2], [0.0, 0.0, 1.0], 1.5),
        of([0.48, 0.6, 0.64], [0.1, 0.3], [0.2, 0.3, 0.5], 1.5),
        of([-0.48, 0.36, 0.8], [0.15, 0.15], [0.0, 0.5, 0.5], 1.0 / 1.5),
        of([0.0, 0.0, 1.0], [0.8, 1.0], [1.0, 1.0, 1.0], 1.33),
        of([0.0, 0.995, 0.099_874_92], [0.3, 0.4], [0.0, 0.5, 0.5], 2.4),
    ]
}

/// A direction, often near what is scattered most.
fn direction(parameters: &MicrofacetParameters, pcg: &mut Pcg32, i: usize) -> Vec3 {
    let [x, y, z] = parameters.outgoing.map(|v| v as f32);
    let across = Vec3::new(-x, -y, 0.0) / parameters.ior as f32;
    let straight = across - (1.0 - across.length_squared()).max(0.0).sqrt() * Vec3::Z;
    let near = match i % 3 {
        0 => return pcg.direction(),
        1 => Vec3::new(-x, -y, z),
        _ => straight,
    };
    (near + 0.3 * pcg.next_f32() * pcg.direction()).normalize()
}

#[test]
fn weights_are_those_of_the_books() {
    let mut pcg = Pcg32::new(11, 19);
    for parameters in lobes() {
        let x = ShadingPoint::microfacet(Vec3::ZERO, parameters.surface());
        for i in 0..3000 {
            let direction = direction(&parameters, &mut pcg, i);
            let (found, exact) = (f64::from(x.weight(direction)), parameters.scattered(direction.as_dvec3()));
            let least = 1.1e-3 * f64::from(direction.z.abs());
            assert!((found - exact).abs() <= 2e-3 * exact + least, "{parameters:?} {direction}: {found} {exact}");
            let cosine = if parameters.weights[2] > 0.0 { direction.z.abs() } else { direction.z.max(0.0) };
            assert_eq!(x.cosine(direction), cosine);
        }
    }
}

/// Without a second roughness and without a transmission, this is a glossy surface.
#[test]
fn isotropic_reflections_are_those_of_glossy_surfaces() {
    let mut pcg = Pcg32::new(12, 19);
    for alpha in [1e-3, 0.05, 0.3, 1.0] {
        for _ in 0..300 {
            let (normal, outgoing) = (pcg.direction(), pcg.direction());
            let glossy = Glossy::new(normal, outgoing, alpha).with_weights(0.3, 0.7);
            let surface = glossy.anisotropic(pcg.direction(), [alpha; 2]);
            let [a, b] = [ShadingPoint::glossy(Vec3::ZERO, glossy), ShadingPoint::microfacet(Vec3::ZERO, surface)];
            let mirror = 2.0 * normal * normal.dot(outgoing) - outgoing;
            let direction = (mirror + alpha * pcg.next_f32() * pcg.direction()).normalize();
            let (a, b) = (a.weight(direction), b.weight(direction));
            assert!((a - b).abs() <= 2e-2 * a + 1.1e-3, "{alpha} {normal} {outgoing} {direction}: {a} {b}");
        }
    }
}

/// A sample of the transmission that follows the facets that are seen brings as much as it should: its weights add up
/// to the share of light that masking leaves.
#[test]
fn transmitted_light_adds_up() {
    for parameters in lobes().into_iter().filter(|parameters| parameters.weights[2] > 0.0 && parameters.ior >= 1.0) {
        let only = MicrofacetParameters { weights: [0.0, 0.0, 1.0], ..parameters };
        let x = ShadingPoint::microfacet(Vec3::ZERO, only.surface());
        let n = 1200;
        let mut sum = 0.0;
        for i in 0..n {
            let z = -(f64::from(i) + 0.5) / f64::from(n);
            for j in 0..n {
                let (sin, cos) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(n)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                let direction = DVec3::new(across * cos, across * sin, z).as_vec3();
                sum += f64::from(x.weight(direction)) * 2.0 / f64::from(n * n);
            }
        }
        assert!(sum > 0.5 && sum < 1.01, "{parameters:?}: {sum}");
    }
}

#[test]
fn means_are_near_those_of_their_directions() {
    let mut pcg = Pcg32::new(13, 19);
    let mut worst = [f64::INFINITY, 0.0_f64];
    for parameters in lobes() {
        let receiver = Receiver::Microfacet(parameters.surface());
        let lobe = parameters.surface().lobe();
        for radius in [0.02, 0.1, 0.3] {
            for i in 0..12 {
                let axis = direction(&parameters, &mut pcg, i).as_dvec3();
                let (s, t) = axis.any_orthonormal_pair();
                let (mut sum, mut cosines, n) = (0.0, 0.0, 100);
                for i in 0..n * n {
                    let r = radius * ((f64::from(i / n) + 0.5) / f64::from(n)).sqrt();
                    let (sin, cos) = (2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();
                    let direction = (axis + r * (s * cos + t * sin)).normalize();
                    sum += parameters.scattered(direction) / f64::from(n * n);
                    cosines += f64::from(ShadingPoint::new(Vec3::ZERO, receiver).cosine(direction.as_vec3()))
                        / f64::from(n * n);
                }
                let found = f64::from(lobe.weigh(
                    cosines as f32,
                    axis.as_vec3().to_array(),
                    1.0,
                    (0.5 * radius * radius) as f32,
                ));
                assert!(found > 0.1 * sum && found < 8.0 * sum + 0.2, "{parameters:?} {radius} {axis}: {found} {sum}");
                if sum > 0.1 {
                    worst = [worst[0].min(found / sum), worst[1].max(found / sum)];
                }
            }
        }
    }
    std::println!("{worst:?}");
}

/// Wherever there is light without the lobe, there is some with it, blurred or not, and all numbers are finite.
#[test]
fn a_lobe_is_never_the_reason_for_a_zero() {
    let mut pcg = Pcg32::new(14, 19);
    let pick = |values: &[f32], pcg: &mut Pcg32| values[pcg.next_u32() as usize % values.len()];
    for _ in 0..20_000 {
        let (normal, outgoing) = (pcg.direction(), pcg.direction());
        let outgoing = if pcg.next_f32() < 0.2 { outgoing.reject_from(normal) + 1e-4 * normal } else { outgoing };
        let alphas = [0, 1].map(|_| pick(&[1e-3, 0.01, 0.1, 1.0], &mut pcg));
        let surface = Microfacet::new(normal, outgoing, 0.1)
            .anisotropic(pcg.direction(), alphas)
            .with_weights(pick(&[0.0, 0.5], &mut pcg), pick(&[0.0, 1.0], &mut pcg), pick(&[0.0, 0.3, 1e4], &mut pcg))
            .with_ior(pick(&[0.1, 0.66, 0.98, 1.0, 1.02, 1.5, 10.0], &mut pcg));
        let x = ShadingPoint::microfacet(Vec3::ZERO, surface);
        let Receiver::Microfacet(surface) = x.receiver else { continue };
        let lobe = surface.lobe();
        for _ in 0..5 {
            let direction = match pcg.next_u32() % 4 {
                0 => -surface.outgoing(),
                1 => surface.outgoing(),
                _ => pcg.direction(),
            };
            let cosine = x.cosine(direction);
            let spread2 = pick(&[0.0, 1e-12, 1e-3, 1.0, 1e6], &mut pcg);
            let weight = lobe.weigh(cosine, direction.to_array(), 1.0, spread2);
            let least = 1e-6 * cosine;
            assert!(weight.is_finite() && weight >= least, "{surface:?} {direction} {spread2}: {weight}");
            assert!(lobe.variation(direction.to_array(), spread2) >= 0.0);
            let weight = x.weight(direction);
            assert!(weight.is_finite() && weight >= least, "{surface:?} {direction}: {weight}");
            let mean = surface.mean_over_cone(direction, 0.1);
            assert!(mean.is_finite() && (mean > 0.0 || cosine == 0.0), "{surface:?} {direction}: {mean}");
        }
        assert!(lobe.weigh(0.0, [0.0; 3], 1.0, 1.0).is_finite());
    }
}

#[test]
fn lobes_out_of_range_are_left_out() {
    let (up, through) = (Receiver::Surface(Vec3::Z), Receiver::Transmissive(Vec3::Z));
    let of = |surface: Microfacet| ShadingPoint::microfacet(Vec3::ZERO, surface).receiver;
    for outgoing in [-Vec3::Z, Vec3::X, Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        let surface = Microfacet::new(Vec3::Z, outgoing, 0.1);
        assert_eq!(of(surface), up, "{outgoing}");
        assert_eq!(of(surface.with_weights(0.0, 0.5, 0.5)), through, "{outgoing}");
    }
    let surface = Microfacet::new(Vec3::Z, Vec3::Z, 0.1);
    for [diffuse, reflected] in [[0.0, 0.0], [1.0, 0.0], [f32::NAN, f32::NAN], [1.0, -1.0]] {
        assert_eq!(of(surface.with_weights(diffuse, reflected, 0.0)), up);
    }
    assert_eq!(of(surface.anisotropic(Vec3::X, [f32::NAN, 0.1])), up);
    assert_eq!(surface.anisotropic(Vec3::X, [-1.0, 2.0]).roughness(), [1e-3, 1.0]);
    for tangent in [Vec3::ZERO, Vec3::Z, -3.0 * Vec3::Z, Vec3::NAN, Vec3::INFINITY] {
        let [x, y] = surface.anisotropic(tangent, [0.1, 0.4]).roughness();
        assert!(x == y && (x - 0.2).abs() < 1e-6, "{tangent}: {x} {y}");
    }
    assert!((surface.anisotropic(1e-20 * Vec3::Y, [0.1, 0.4]).tangent() - Vec3::Y).length() < 1e-6);
    let iors = [1.005, f32::NAN, -1.0, f32::INFINITY, 1.5].map(|ior| surface.with_ior(ior).ior());
    assert_eq!(iors, [1.0, 1.0, 0.1, 10.0, 1.5]);
    // Weights add up, and what is positive stays so.
    let weights = |diffuse, reflected, transmitted| surface.with_weights(diffuse, reflected, transmitted).weights();
    for (found, expected) in [
        (weights(0.0, f32::INFINITY, f32::MAX), [0.0, 0.5, 0.5]),
        (weights(0.0, 1e-3, 0.0), [0.0, 1.0, 0.0]),
        (weights(1e-9, 0.0, 7.0), [1.0 / 65535.0, 0.0, 1.0]),
        (weights(1.0, 1e-9, 1e-9), [1.0, 1.0 / 65535.0, 1.0 / 65535.0]),
        (weights(1e-9, 1e-9, 1.0), [1.0 / 65535.0, 1.0 / 65535.0, 1.0]),
        (weights(1.0, 2.0, 1.0), [0.25, 0.5, 0.25]),
    ] {
        assert_eq!(found.map(|weight| weight > 0.0), expected.map(|weight| weight > 0.0), "{found:?}");
        let is_near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 3e-4);
        assert!(is_near && (found.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{found:?}, not {expected:?}");
    }
}

/// The irradiance is an estimate, within a factor of a few of brute force.
#[test]
fn the_irradiance_is_near_that_of_brute_force() {
    for parameters in lobes() {
        let receiver = Receiver::Microfacet(parameters.surface());
        for vertices in [
            [Vec3::new(-1.0, -0.5, 1.0), Vec3::new(1.0, -0.5, 1.5), Vec3::new(0.0, 1.0, 2.0)],
            [Vec3::new(1.0, -0.5, -1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(1.5, 1.0, -0.5)],
            [Vec3::new(-0.9, -0.6, -1.2), Vec3::new(0.6, -0.7, -0.8), Vec3::new(-0.3, 0.5, -1.0)],
        ] {
            let [a, b, c] = vertices.map(Vec3::as_dvec3);
            let (cross, n) = ((b - a).cross(c - a), 300);
            let mut exact = 0.0;
            for i in 0..n {
                for j in 0..n - i {
                    let [b1, b2] = [i, j].map(|i| (f64::from(i) + 1.0 / 3.0) / f64::from(n));
                    let p = a + (b - a) * b1 + (c - a) * b2;
                    let d2 = p.length_squared();
                    let direction = p / d2.sqrt();
                    exact += parameters.scattered(direction) * direction.dot(cross).abs() / d2;
                }
            }
            exact /= PI * f64::from(n * (n + 1));
            let found = f64::from(receiver.irradiance(&vertices));
            assert!(found >= 0.4 * exact && found < 2.5 * exact + 0.02, "{parameters:?} {vertices:?}: {found} {exact}");
        }
    }
}
