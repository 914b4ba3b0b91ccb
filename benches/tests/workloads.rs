//! The generators and oracles of the quality bench reproduce the published check values.

#[expect(dead_code, reason = "the bench uses all of it")]
#[path = "../quality/oracle/mod.rs"]
mod oracle;
#[expect(dead_code, reason = "the bench uses all of it")]
#[path = "../quality/scenes/mod.rs"]
mod scenes;

use fanlight::{Receiver, ShadingPoint};
use glam::DVec3;
use oracle::{Class, Oracle};
use scenes::Scene;
use scenes::pcg::Pcg32;
use scenes::sky::Sky;

/// Irradiance at the first points.
fn irradiances(scene: &Scene) -> Vec<f64> {
    let oracle = Oracle::new(scene);
    scene.points.quality(5).iter().map(|x| oracle.truth(x).total).collect()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance * expected, "{found} instead of {expected}");
    }
}

#[test]
fn random_numbers() {
    let mut pcg = Pcg32::new(42, 54);
    assert_eq!([pcg.bits(), pcg.bits(), pcg.bits()], [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
}

#[test]
fn cloud() {
    let scene = scenes::scene("cloud-10000");
    let first = scene.lights[0].vertices[0];
    assert_close(&first.to_array(), &[0.791_256_309, 0.089_440_353_2, 0.748_418_331], 1e-8);
    assert_close(&[scene.weight(0, [0.3, 0.3])], &[4.868_061_54], 1e-8);
    assert_close(&irradiances(&scene), &[0.183_894_1, 0.008_509_593_2, 0.0, 0.0, 0.172_786_02], 1e-6);
}

#[test]
fn sphere() {
    let scene = scenes::scene("sphere-29");
    assert_eq!(scene.lights.len(), 12 * 29 * 29);
    assert_close(&irradiances(&scene), &[0.157_710_19, 2.237_278_3e-5, 0.0, 0.0, 0.158_472_55], 1e-6);
}

#[test]
fn sphere_with_spots() {
    let scene = scenes::scene("sphere-9-spots");
    assert_eq!(scene.lights.len(), 972);
    let image = scene.image.expect("the sphere is textured");
    assert_eq!(image.size, 256);
    // Eight discs of radius 0.02, by the number of their texels.
    let bright = image.texels.iter().filter(|texel| **texel == 100.0).count() as f64 / 65_536.0;
    assert_close(&[bright], &[8.0 * core::f64::consts::PI * 0.02 * 0.02], 0.1);
}

#[test]
fn quad() {
    let expected = [0.121_285_4, 0.114_489_3, 0.007_956_743, 0.0, 0.051_845_7];
    assert_close(&irradiances(&scenes::scene("quad")), &expected, 1e-4);
}

#[test]
fn window() {
    let scene = scenes::scene("window");
    // The published values come from a coarser integration than the oracle, which `by_brute_force` confirms to 1e-5.
    assert_close(&irradiances(&scene), &[0.011_002_8, 0.0, 0.0, 0.016_237_79, 0.056_987_6], 2.5e-4);
    let oracle = Oracle::new(&scene);
    let classes: Vec<Class> = scene.points.quality(1000).iter().map(|x| oracle.truth(x).class).collect();
    for class in [Class::NoSun, Class::Sun, Class::Below] {
        assert!(classes.iter().filter(|other| **other == class).count() > 10, "{class:?}");
    }
}

#[test]
fn clip_maps_are_what_holes_are() {
    for (holes, clip) in [("grid-1", "grid-1@clip-map"), ("grid-100", "grid-100@clip-map")] {
        let (holes, clip) = (irradiances(&scenes::scene(holes)), irradiances(&scenes::scene(clip)));
        assert_close(&clip, &holes, 1e-5);
    }
}
/// Irradiance through the first wall by a regular grid over it and the environment's own texels.
fn by_brute_force(scene: &Scene, x: &ShadingPoint) -> f64 {
    const SIDE: usize = 1000;
    let sky = scene.sky.as_ref().expect("the room has a sky");
    let Receiver::Surface(normal) = x.receiver else { panic!("all points are on surfaces") };
    let wall = scene.walls[0];
    let step = wall.side / SIDE as f64;
    let place = |i: usize| (i as f64 + 0.5) * step;
    let eye = x.position.as_dvec3();
    let sample = |k: usize| {
        let at = DVec3::new(wall.min.x + place(k % SIDE), wall.y, wall.min.y + place(k / SIDE)) - eye;
        let distance2 = at.length_squared();
        let direction = at / distance2.sqrt();
        let cosines = normal.as_dvec3().dot(direction).max(0.0) * direction.y;
        scene.transmittance(eye, direction) * sky.texel(direction) * cosines / distance2
    };
    (0..SIDE * SIDE).map(sample).sum::<f64>() * step * step
}

/// Points that see the sky but not the sun.
fn shaded_points(scene: &Scene) -> (Vec<ShadingPoint>, Vec<f64>) {
    let oracle = Oracle::new(scene);
    let truths = scene.points.quality(30).into_iter().map(|x| (x, oracle.truth(&x)));
    truths.filter(|(_, truth)| truth.class == Class::NoSun && truth.total > 1e-4).map(|(x, t)| (x, t.total)).unzip()
}

#[test]
fn irradiance_through_openings() {
    // The grid is coarse where an opening is small or has a jagged edge.
    let tolerances = [("window", 1e-4), ("star", 1e-2), ("star@nearest", 1e-2), ("grid-100", 1e-2), ("nested", 3e-2)];
    for (name, tolerance) in tolerances {
        let scene = scenes::scene(name);
        let (points, found) = shaded_points(&scene);
        assert!(points.len() > 2, "{name}: {} points", points.len());
        let expected: Vec<f64> = points.iter().map(|x| by_brute_force(&scene, x)).collect();
        assert_close(&found, &expected, tolerance);
    }
}

/// The texels of the bench's own sky are those that the crate looks up.
#[test]
fn the_sky_is_the_environment() {
    let sky = Sky::new();
    let mut pcg = Pcg32::new(1, 2);
    let differs = |direction: DVec3| {
        let looked_up = f64::from(sky.environment.radiance(direction.as_vec3()));
        (looked_up - sky.texel(direction)).abs() > 0.01
    };
    assert_eq!((0..100_000).filter(|_| differs(pcg.direction())).count(), 0);
}
