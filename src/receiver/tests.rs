use core::f64::consts::PI;

use glam::DVec3;

use super::*;
use crate::testing::Pcg32;

/// Outgoing direction, roughness and weights of a lobe.
type LobeParameters = ([f64; 3], f64, [f64; 2]);

/// `π f cos θ` of a coated surface with the normal z, from the books: Walter et al. 2007 and Heitz 2014, by Smith's Λ.
fn reflected((outgoing, alpha, [kd, ks]): LobeParameters, direction: DVec3) -> f64 {
    let outgoing = DVec3::from_array(outgoing);
    let (cos_i, cos_o) = (direction.z, outgoing.z);
    if cos_i <= 0.0 {
        return 0.0;
    }
    let h = (direction + outgoing).normalize();
    let tan2 = |v: DVec3| (1.0 - v.z * v.z) / (v.z * v.z);
    let d = 1.0 / (PI * alpha * alpha * h.z.powi(4) * (1.0 + tan2(h) / (alpha * alpha)).powi(2));
    let lambda = |v: DVec3| 0.5 * ((1.0 + alpha * alpha * tan2(v)).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(direction) + lambda(outgoing));
    let total = kd + ks;
    (kd * cos_i + ks * PI * d * g / (4.0 * cos_o)) / total
}

fn coated((outgoing, alpha, [kd, ks]): LobeParameters) -> Glossy {
    Glossy::new(Vec3::Z, DVec3::from_array(outgoing).as_vec3(), alpha as f32).with_weights(kd as f32, ks as f32)
}

const LOBES: [LobeParameters; 5] = [
    ([0.6, 0.0, 0.8], 0.5, [0.0, 1.0]),
    ([0.0, 0.0, 1.0], 0.1, [0.5, 0.5]),
    ([-0.6, 0.64, 0.48], 0.05, [0.2, 0.8]),
    ([0.0, 0.995, 0.099_874_92], 0.3, [0.0, 1.0]),
    ([0.0, 0.6, 0.8], 1.0, [3.0, 1.0]),
];

#[test]
fn weights_of_lobes_are_those_of_the_books() {
    let mut pcg = Pcg32::new(7, 19);
    for parameters in LOBES {
        let x = ShadingPoint::glossy(Vec3::ZERO, coated(parameters));
        let mirror = Vec3::from_array([-1.0, -1.0, 1.0]) * DVec3::from_array(parameters.0).as_vec3();
        for i in 0..2000 {
            let direction = if i % 2 == 0 { pcg.direction() } else { (mirror + 0.1 * pcg.direction()).normalize() };
            let (found, exact) = (f64::from(x.weight(direction)), reflected(parameters, direction.as_dvec3()));
            assert!((found - exact).abs() <= 1e-3 * exact, "{parameters:?} {direction}: {found} {exact}");
            assert_eq!(x.cosine(direction), direction.z.max(0.0));
        }
    }
}

#[test]
fn phase_functions_integrate_to_the_sphere() {
    for g in [-0.8_f64, 0.0, 0.3, 0.9] {
        let x = ShadingPoint::scattering(Vec3::ZERO, Scattering::new(2.0 * Vec3::X, g as f32));
        let n = 20_000;
        let (mut sum, mut cosine) = (0.0, 0.0);
        for i in 0..n {
            let along = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
            let direction = Vec3::new(along as f32, 0.0, (1.0 - along * along).sqrt() as f32);
            let weight = f64::from(x.weight(direction)) / f64::from(n);
            (sum, cosine) = (sum + weight, cosine - along * weight);
        }
        // The mean cosine of the deflection is g: light travels against the direction that it comes from.
        assert!((sum - 1.0).abs() < 1e-3 && (cosine - g).abs() < 1e-3, "{g}: {sum} {cosine}");
    }
}

#[test]
fn means_of_lobes_are_near_those_of_their_directions() {
    let mut pcg = Pcg32::new(8, 19);
    for parameters in LOBES {
        let lobe = coated(parameters).lobe();
        let mirror = Vec3::from_array([-1.0, -1.0, 1.0]) * DVec3::from_array(parameters.0).as_vec3();
        let mirror = mirror.as_dvec3();
        for radius in [0.02, 0.1, 0.3] {
            for off in [0.0, 0.1, 0.5] {
                let axis = (mirror + off * pcg.direction().as_dvec3()).normalize();
                let (s, t) = axis.any_orthonormal_pair();
                let (mut sum, mut cosines, n) = (0.0, 0.0, 200);
                for i in 0..n * n {
                    let r = radius * ((f64::from(i / n) + 0.5) / f64::from(n)).sqrt();
                    let (sin, cos) = (2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();
                    let direction = (axis + r * (s * cos + t * sin)).normalize();
                    sum += reflected(parameters, direction) / f64::from(n * n);
                    cosines += direction.z.max(0.0) / f64::from(n * n);
                }
                let found = f64::from(lobe.weigh(
                    cosines as f32,
                    axis.as_vec3().to_array(),
                    1.0,
                    (0.5 * radius * radius) as f32,
                ));
                // An estimate, but within a factor of a few, and never far below.
                assert!(found > 0.2 * sum && found < 5.0 * sum + 0.1, "{parameters:?} {radius} {off}: {found} {sum}");
            }
        }
    }
}

#[test]
fn lobes_out_of_range_are_left_out() {
    let up = Receiver::Surface(Vec3::Z);
    let glossy = |outgoing, alpha, [kd, ks]: [f32; 2]| {
        ShadingPoint::glossy(Vec3::ZERO, Glossy::new(Vec3::Z, outgoing, alpha).with_weights(kd, ks)).receiver
    };
    for outgoing in [-Vec3::Z, Vec3::X, Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(glossy(outgoing, 0.1, [0.0, 1.0]), up, "{outgoing}");
    }
    for weights in [[0.0, 0.0], [1.0, 0.0], [f32::NAN, f32::NAN], [1.0, -1.0]] {
        assert_eq!(glossy(Vec3::Z, 0.1, weights), up, "{weights:?}");
    }
    assert_eq!(glossy(Vec3::Z, f32::NAN, [0.0, 1.0]), up);
    assert_eq!(glossy(Vec3::Z, -1.0, [0.0, 1.0]), glossy(1e-30 * Vec3::Z, 1e-9, [0.0, f32::INFINITY]));
    assert_eq!(glossy(Vec3::Z, 1.0, [0.0, 1.0]), glossy(1e30 * Vec3::Z, f32::INFINITY, [-1.0, 2.0]));
    for (outgoing, g) in [(Vec3::X, f32::NAN), (Vec3::X, 0.0), (Vec3::ZERO, 0.5), (Vec3::NAN, 0.5)] {
        let x = ShadingPoint::scattering(Vec3::ZERO, Scattering::new(outgoing, g));
        assert_eq!(x.receiver, Receiver::Volume, "{outgoing} {g}");
    }
}

/// Irradiance over π of a triangle by brute force in double precision.
fn brute_force(receiver: Receiver, vertices: [Vec3; 3]) -> f64 {
    let [a, b, c] = vertices.map(Vec3::as_dvec3);
    let cross = (b - a).cross(c - a);
    let n = 400;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n - i {
            for inverted in [0.0, 1.0] {
                if inverted > 0.0 && i + j == n - 1 {
                    continue;
                }
                let step = 1.0 / f64::from(n);
                let [b1, b2] = [i, j].map(|i| (f64::from(i) + (1.0 + inverted) / 3.0) * step);
                let p = a + (b - a) * b1 + (c - a) * b2;
                let d2 = p.length_squared();
                let direction = p / d2.sqrt();
                let weight = match receiver {
                    Receiver::Surface(n) => n.as_dvec3().dot(direction).max(0.0),
                    Receiver::Transmissive(n) => n.as_dvec3().dot(direction).abs(),
                    Receiver::Volume => 1.0,
                    Receiver::Glossy(surface) => {
                        let number = LOBES.iter().position(|lobe| coated(*lobe) == surface).expect("one of the list");
                        reflected(LOBES[number], direction)
                    }
                    Receiver::Scattering(_) => {
                        let g: f64 = PHASE;
                        (1.0 - g * g) / (1.0 + g * g + 2.0 * g * direction.x).powf(1.5)
                    }
                    Receiver::Microfacet(_) => unreachable!("these have tests of their own"),
                };
                sum += weight * direction.dot(cross).abs() * 0.5 / d2 * step * step;
            }
        }
    }
    sum * core::f64::consts::FRAC_1_PI
}

#[test]
fn the_irradiance_is_that_of_brute_force() {
    let normal = Vec3::new(0.1, 0.2, 0.9).normalize();
    for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
        for vertices in [
            [Vec3::new(-1.0, -0.5, 1.0), Vec3::new(1.0, -0.5, 1.5), Vec3::new(0.0, 1.0, 2.0)],
            [Vec3::new(1.0, -0.5, -1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(1.5, 1.0, -0.5)],
            [Vec3::new(0.5, 0.0, 0.8), Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.5, 0.1, 0.8)],
        ] {
            let exact = brute_force(receiver, vertices);
            let found = f64::from(receiver.irradiance(&vertices));
            assert!((found - exact).abs() < 2e-3 * exact, "{receiver:?} {vertices:?}: {found} {exact}");
        }
    }
}

const PHASE: f64 = 0.6;

/// With a lobe, the irradiance is an estimate.
#[test]
fn the_irradiance_of_a_lobe_is_near_that_of_brute_force() {
    let phase = Receiver::Scattering(Scattering::new(Vec3::X, PHASE as f32));
    let surfaces = LOBES.map(|parameters| Receiver::Glossy(coated(parameters)));
    for receiver in surfaces.into_iter().chain([phase]) {
        for vertices in [
            [Vec3::new(-1.0, -0.5, 1.0), Vec3::new(1.0, -0.5, 1.5), Vec3::new(0.0, 1.0, 2.0)],
            [Vec3::new(1.0, -0.5, -1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(1.5, 1.0, -0.5)],
            [Vec3::new(0.5, 0.0, 0.8), Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.5, 0.1, 0.8)],
        ] {
            let exact = brute_force(receiver, vertices);
            let found = f64::from(receiver.irradiance(&vertices));
            assert!(found > 0.5 * exact && found < 2.0 * exact + 0.02, "{receiver:?} {vertices:?}: {found} {exact}");
        }
    }
}

#[test]
fn unit_normals_are_left_alone_and_others_normalized() {
    let mut pcg = Pcg32::new(4, 19);
    for _ in 0..1000 {
        let normal = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32() + 0.1).normalize();
        for scale in [1.0, 0.9991, 1.0009] {
            let scaled = normal * scale;
            assert_eq!(ShadingPoint::surface(Vec3::ZERO, scaled).receiver, Receiver::Surface(scaled));
        }
        for scale in [1e-6, 0.9, 1.1, 1e6] {
            let Receiver::Transmissive(found) = ShadingPoint::transmissive(Vec3::ZERO, normal * scale).receiver else {
                panic!("the receiver has changed its kind");
            };
            assert!((found - normal).length() < 1e-5, "{found} {normal}");
        }
    }
    assert_eq!(ShadingPoint::surface(Vec3::ZERO, Vec3::ZERO).receiver, Receiver::Surface(Vec3::ZERO));
}

#[test]
fn the_mean_over_a_cone_is_zero_only_below_the_horizon() {
    let surface = Receiver::Surface(Vec3::Z);
    assert_eq!(surface.mean_over_cone(Vec3::new(0.8, 0.0, -0.6), 0.5), 0.0);
    assert!(surface.mean_over_cone(Vec3::new(0.9, 0.0, -0.4), 0.5) > 0.0);
    assert_eq!(surface.mean_over_cone(Vec3::Z, 0.5), 1.0);
    assert!(Receiver::Transmissive(Vec3::Z).mean_over_cone(Vec3::X, 0.1) > 0.0);
}
