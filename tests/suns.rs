//! A sun through a window: the second technique next to the trees.

#[path = "common/pcg.rs"]
#[expect(dead_code, reason = "other tests use the rest")]
mod pcg;

use fanlight::{Environment, Filter, Hit, LightSample, LightSampler, Mesh, ShadingPoint, Splitting};
use glam::Vec3;
use pcg::Pcg32;
use smallvec::SmallVec;

const SIZE: usize = 256;

fn sun_direction() -> Vec3 {
    Vec3::new(0.3, 0.8, 0.5).normalize()
}

/// A grey sky with a sun of one degree's radius, which a latitude-longitude image of many texels resolves.
fn environment() -> Environment {
    let (width, height) = (2 * SIZE, SIZE);
    let texel = |i: usize| {
        let (u, v) = (((i % width) as f32 + 0.5) / width as f32, ((i / width) as f32 + 0.5) / height as f32);
        let (theta, phi) = (core::f32::consts::PI * v, core::f32::consts::TAU * u);
        let direction = Vec3::new(phi.cos() * theta.sin(), -phi.sin() * theta.sin(), theta.cos());
        if direction.dot(sun_direction()) > 1f32.to_radians().cos() { 5000.0 } else { 0.3 }
    };
    let image: Vec<f32> = (0..width * height).map(texel).collect();
    Environment::from_lat_long(width, height, &image, Filter::Nearest).expect("the texels are finite")
}

/// Two windows, one behind the other, so that a sun's ray can cross both.
fn lights(nested: bool) -> LightSampler {
    let quad = |size: f32, y: f32| {
        [[-size, -size], [size, -size], [size, size], [-size, size]].map(|[x, z]| Vec3::new(x, y, 1.5 + z))
    };
    let mut builder = LightSampler::builder();
    builder.environment(environment());
    let faces = [[0, 1, 2], [0, 2, 3]];
    builder.add_mesh(&Mesh::portal(&quad(0.5, 0.0), &faces)).expect("the window is sound");
    if nested {
        builder.add_mesh(&Mesh::portal(&quad(0.8, 0.3), &faces)).expect("the window is sound");
    }
    builder.build().expect("a scene of four triangles")
}

/// Points that see the sun through the window, and its surroundings.
fn points() -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(1, 31);
    let mut cube = || pcg.cube().map(|u| u - 0.5);
    (0..12)
        .map(|i| {
            let target = Vec3::new(0.0, 0.0, 1.5) + 0.6 * Vec3::from(cube()) * Vec3::new(1.0, 0.0, 1.0);
            let position = target - (1.0 + 0.1 * i as f32) * sun_direction();
            let normal = (sun_direction() + Vec3::from(cube())).normalize();
            match i % 3 {
                0 => ShadingPoint::surface(position, normal),
                1 => ShadingPoint::transmissive(position, normal),
                _ => ShadingPoint::volume(position),
            }
        })
        .collect()
}

/// Mean and standard error.
fn estimate(n: usize, mut draw: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let value = draw();
        sum += value;
        squares += value * value;
    }
    let mean = sum / n as f64;
    (mean, ((squares / n as f64 - mean * mean).max(0.0) / n as f64).sqrt())
}

#[test]
fn the_sun_is_found() {
    let environment = environment();
    assert_eq!(environment.as_view().suns().len(), 1);
    let power = f64::from(environment.as_view().suns()[0].power);
    let flux = f64::from(environment.mean()) * 4.0 * core::f64::consts::PI;
    assert!(power > 0.4 * flux && power < flux, "{power} of {flux}");
}

#[test]
fn densities_agree_in_and_beside_the_sun() {
    let mut pcg = Pcg32::new(2, 31);
    for lights in [lights(false), lights(true)] {
        let mut mismatches = 0;
        for x in points() {
            for _ in 0..3000 {
                let Some(sample) = lights.sample(&x, pcg.cube()) else { continue };
                let again = lights.pdf(&x, &sample.hit);
                assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{again} {}", sample.pdf);
                let direction = lights.pdf_sample_direction(&x, &sample);
                assert!(direction >= sample.pdf * 0.999_999);
                // Next to a border of cells or texels the ray may find the other side.
                mismatches += u32::from((lights.pdf_direction(&x, sample.direction) / direction - 1.0).abs() > 1e-3);
            }
        }
        assert!(mismatches < 10, "{mismatches} of 36,000");
    }
}

/// The oracle samples the environment and knows the window's four edges.
#[test]
fn irradiance_is_that_of_environment_sampling() {
    let environment = environment();
    let (lights, nested) = (lights(false), lights(true));
    let mut pcg = Pcg32::new(3, 31);
    let splitting = Splitting::default();
    for x in points() {
        let sends = |direction: Vec3, size: f32, y: f32| {
            let t = (y - x.position.y) / direction.y;
            let hit = x.position + t * direction;
            t > 0.0 && hit.x.abs() <= size && (hit.z - 1.5).abs() <= size
        };
        let open = |direction: Vec3| sends(direction, 0.5, 0.0) && direction.y > 0.0;
        let arrives = |direction: Vec3| f64::from(environment.radiance(direction) * x.cosine(direction));
        let (exact, exact_error) = estimate(400_000, || {
            let sample = environment.sample([pcg.cube()[0], pcg.cube()[1]]).expect("the sky is not black");
            if open(sample.direction) { arrives(sample.direction) / f64::from(sample.pdf) } else { 0.0 }
        });
        let value = |sample: &LightSample, pdf: f32| {
            if open(sample.direction) { arrives(sample.direction) / f64::from(pdf) } else { 0.0 }
        };
        let single = estimate(20_000, || lights.sample(&x, pcg.cube()).map_or(0.0, |s| value(&s, s.pdf)));
        let direction = estimate(20_000, || {
            nested.sample(&x, pcg.cube()).map_or(0.0, |s| value(&s, nested.pdf_sample_direction(&x, &s)))
        });
        let split = estimate(20_000, || {
            let mut samples = SmallVec::<[LightSample; 16]>::new();
            lights.sample_split(&x, pcg.cube(), &splitting, &mut samples);
            samples.iter().map(|s| value(s, s.pdf)).sum()
        });
        for (mean, error) in [single, direction, split] {
            let bound = 4.0 * (error * error + exact_error * exact_error).sqrt();
            assert!((mean - exact).abs() < bound, "{x:?}: {mean} ± {error}, {exact} ± {exact_error}");
        }
        // Without the second technique this is in the tens and hundreds.
        let relvar = 20_000.0 * (single.1 / single.0).powi(2);
        assert!(relvar < 0.5, "{x:?}: {relvar}");
    }
}

#[test]
fn split_samples_have_the_density_that_pdf_split_finds() {
    let lights = lights(false);
    let mut pcg = Pcg32::new(4, 31);
    let splitting = Splitting::default();
    for x in points() {
        for _ in 0..500 {
            let mut samples = SmallVec::<[LightSample; 16]>::new();
            lights.sample_split(&x, pcg.cube(), &splitting, &mut samples);
            for sample in samples {
                let hit: Hit = sample.hit;
                let again = lights.pdf_split(&x, &hit, &splitting);
                assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{again} {}", sample.pdf);
            }
        }
    }
}
