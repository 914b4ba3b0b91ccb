use super::*;
use crate::testing::Pcg32;

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
