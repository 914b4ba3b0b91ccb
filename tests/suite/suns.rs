//! A sun through a window: the second technique next to the trees.

use crate::common::pcg::Pcg32;
use crate::common::tier::some;
use fanlight::{
    Environment, Filter, Hit, LightSample, LightSampler, Mesh, Receiver, ShadingPoint, Splitting, Texture, Weight,
};
use glam::{Vec2, Vec3};
use smallvec::SmallVec;

const SIZE: usize = 256;

fn sun_direction() -> Vec3 {
    Vec3::new(0.3, 0.8, 0.5).normalize()
}

/// A gray sky with a sun of one degree's radius, which a latitude-longitude image of many texels resolves.
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

/// What the wall at `y = 0` has for openings, in a square of one meter around the window's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wall {
    Window,
    /// A window, and a larger one behind it.
    Nested,
    /// This many holes a side, each of half the pitch.
    Holes(i32),
    /// This many holes a side, by the clip map of a window.
    Clipped(i32),
}

impl Wall {
    fn is_open(self, x: f32, z: f32) -> bool {
        let inside = x.abs() <= 0.5 && z.abs() <= 0.5;
        match self {
            Self::Window | Self::Nested => inside,
            Self::Holes(n) | Self::Clipped(n) => inside && [x, z].iter().all(|a| ((a + 0.5) * n as f32).fract() < 0.5),
        }
    }

    fn build(self) -> LightSampler {
        self.portal_to(environment())
    }

    fn portal_to(self, environment: Environment) -> LightSampler {
        // Thirty-two texels to a hole: of those on its edges, the tree over the texture knows only the mean.
        let side = if let Self::Clipped(n) = self { 64 * n as usize } else { 1 };
        let mask: Vec<f32> = (0..side * side)
            .map(|k| f32::from(u8::from([k % side, k / side].iter().all(|texel| texel % 64 < 32))))
            .collect();
        let mask = Texture::new(side, side, &mask).expect("a mask").filter(Filter::Nearest);
        let mut builder = LightSampler::builder().environment(environment);
        let mask = Weight::Texture(builder.add_texture(mask));
        let mut add = |from: [f32; 2], to: [f32; 2], y: f32, weight: Weight| {
            let corner = |x: f32, z: f32| Vec3::new(x, y, 1.5 + z);
            let quad = [corner(from[0], from[1]), corner(to[0], from[1]), corner(to[0], to[1]), corner(from[0], to[1])];
            let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
            let mesh = Mesh::portal(&quad, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(weight);
            builder.add_mesh(&mesh).expect("the window is sound");
        };
        match self {
            Self::Window => add([-0.5; 2], [0.5; 2], 0.0, Weight::Constant(1.0)),
            Self::Nested => {
                add([-0.5; 2], [0.5; 2], 0.0, Weight::Constant(1.0));
                add([-0.8; 2], [0.8; 2], 0.3, Weight::Constant(1.0));
            }
            Self::Holes(n) => {
                for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
                    let from = [i, j].map(|i| i as f32 / n as f32 - 0.5);
                    add(from, from.map(|a| a + 0.5 / n as f32), 0.0, Weight::Constant(1.0));
                }
            }
            Self::Clipped(_) => add([-0.5; 2], [0.5; 2], 0.0, mask),
        }
        builder.build().expect("the scene is sound")
    }
}

/// Points that see the sun through the window, and its surroundings.
fn all_points() -> Vec<ShadingPoint> {
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

/// Some of these points.
fn points() -> Vec<ShadingPoint> {
    let all = all_points();
    some(all.len()).into_iter().map(|i| all[i]).collect()
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
fn densities_agree_in_and_beside_the_sun() {
    let mut pcg = Pcg32::new(2, 31);
    for wall in [Wall::Window, Wall::Nested, Wall::Holes(20), Wall::Clipped(20)] {
        let lights = wall.build();
        let (mut mismatches, mut drawn) = (0, 0);
        for x in points() {
            for _ in 0..3000 {
                let Some(sample) = lights.at(&x).sample(pcg.cube()) else { continue };
                drawn += 1;
                let again = lights.at(&x).pdf(&sample.hit().expect("a triangle"));
                assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{again} {}", sample.pdf);
                let direction = lights.at(&x).pdf_sample_direction(&sample);
                assert!(direction >= sample.pdf * 0.999_999);
                // Next to a border of cells or texels the ray may find the other side.
                mismatches += u32::from((lights.at(&x).pdf_direction(sample.direction) / direction - 1.0).abs() > 1e-3);
            }
        }
        assert!(drawn > 2000 * points().len(), "{wall:?}: only {drawn} samples");
        assert!(mismatches < 10, "{mismatches} of {drawn}");
    }
}

/// Compares with an oracle that samples the environment and knows the openings, and bounds the relative variance.
fn check_irradiance(wall: Wall, largest: f64) {
    let environment = environment();
    let lights = wall.build();
    let mut pcg = Pcg32::new(3, 31);
    let splitting = Splitting::default();
    for x in points() {
        let open = |direction: Vec3| {
            let t = -x.position.y / direction.y;
            let hit = x.position + t * direction;
            direction.y > 0.0 && t > 0.0 && wall.is_open(hit.x, hit.z - 1.5)
        };
        let arrives = |direction: Vec3| f64::from(environment.radiance(direction) * x.cosine(direction));
        let (exact, exact_error) = estimate(400_000, || {
            let sample = environment.sample([pcg.cube()[0], pcg.cube()[1]]).expect("the sky is not black");
            if open(sample.direction) { arrives(sample.direction) / f64::from(sample.pdf) } else { 0.0 }
        });
        let value = |sample: &LightSample, pdf: f32| {
            if open(sample.direction) { arrives(sample.direction) / f64::from(pdf) } else { 0.0 }
        };
        let by_direction = |s: LightSample| value(&s, lights.at(&x).pdf_sample_direction(&s));
        let single = estimate(20_000, || lights.at(&x).sample(pcg.cube()).map_or(0.0, by_direction));
        let mut estimates = vec![single];
        // The density of a split sample is that of its point: no estimator where openings overlap.
        if wall != Wall::Nested {
            estimates.push(estimate(20_000, || {
                let mut samples = SmallVec::<[LightSample; 16]>::new();
                lights.at(&x).sample_split(pcg.cube(), &splitting, &mut samples);
                samples.iter().map(|s| value(s, s.pdf)).sum()
            }));
        }
        assert!(exact > 0.0, "{x:?} is dark");
        for (mean, error) in estimates {
            let bound = 4.0 * (error * error + exact_error * exact_error).sqrt();
            assert!((mean - exact).abs() < bound, "{x:?}: {mean} ± {error}, {exact} ± {exact_error}");
        }
        let relvar = 20_000.0 * (single.1 / single.0).powi(2);
        assert!(relvar < largest, "{x:?}: {relvar}");
    }
}

#[test]
fn irradiance_is_that_of_environment_sampling() {
    // Without the second technique the variance is in the tens and hundreds.
    check_irradiance(Wall::Window, 0.5);
}

#[test]
fn a_second_window_behind_the_first_changes_nothing() {
    check_irradiance(Wall::Nested, 0.5);
}

/// If a sun were drawn as if there were no wall, three of four directions would be lost here: a variance of 3.
#[test]
fn openings_as_small_as_the_sun() {
    check_irradiance(Wall::Holes(20), 0.5);
}

/// More openings in the sun's disc than a shading point keeps.
#[test]
fn openings_without_number() {
    check_irradiance(Wall::Holes(150), 10.0);
}

/// A ray to an edge may pass the opening by rounding. The point has the sun's density all the same.
#[test]
fn points_on_edges_of_openings_see_the_sun() {
    let lights = Wall::Holes(150).build();
    let x = all_points().into_iter().find(|x| x.receiver == Receiver::Volume).expect("one is in a volume");
    let here = lights.at(&x);
    let mut pcg = Pcg32::new(5, 31);
    let (mut found, mut lost) = (0, 0);
    for _ in 0..3000 {
        let Some(sample) = here.sample(pcg.cube()) else { continue };
        let hit = sample.hit().expect("a triangle");
        let [b1, _] = hit.barycentrics;
        let densities = [1e-3, 2e-7, 0.0].map(|b2| here.pdf(&Hit::new(hit.triangle, [b1, b2])));
        found += u32::from(densities[0] > 100.0);
        lost += u32::from(densities[0] > 100.0 && densities[1].min(densities[2]) < 0.1 * densities[0]);
    }
    assert!(found > 300, "only {found} openings before the sun");
    // Between the two points the sun may end.
    assert!(20 * lost < found, "{lost} of {found}");
}

#[test]
fn openings_of_a_clip_map() {
    check_irradiance(Wall::Clipped(20), 1.0);
}

#[test]
fn split_samples_have_the_density_that_pdf_split_finds() {
    let lights = Wall::Window.build();
    let mut pcg = Pcg32::new(4, 31);
    let splitting = Splitting::default();
    let mut drawn = 0;
    for x in points() {
        for _ in 0..500 {
            let mut samples = SmallVec::<[LightSample; 16]>::new();
            lights.at(&x).sample_split(pcg.cube(), &splitting, &mut samples);
            for sample in samples {
                drawn += 1;
                let hit = sample.hit().expect("a triangle");
                let again = lights.at(&x).pdf_split(&hit, &splitting);
                assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{again} {}", sample.pdf);
            }
        }
    }
    assert!(drawn > 400 * points().len(), "only {drawn} samples");
}

/// A dim sky with `count` bright lamps of 3 x 3 texels, all of which are seen through the window.
fn lamps(count: usize) -> Environment {
    let (width, height) = (1024_usize, 512_usize);
    let mut image = vec![0.1; width * height];
    for i in 0..count {
        let (column, row) = ((i % 8) as f32, (i / 8) as f32);
        let direction = Vec3::new(-0.42 + 0.12 * column, 1.5, 0.62 + 0.11 * row).normalize();
        let (theta, phi) = (direction.z.acos(), (-direction.y).atan2(direction.x).rem_euclid(core::f32::consts::TAU));
        let x = (phi / core::f32::consts::TAU * width as f32) as usize;
        let y = (theta / core::f32::consts::PI * height as f32) as usize;
        for (dx, dy) in (0..9).map(|k| (k % 3, k / 3)) {
            image[(y + dy - 1) * width + x + dx - 1] = 1000.0;
        }
    }
    Environment::from_lat_long(width, height, &image, Filter::Nearest).expect("the texels are finite")
}

#[test]
fn any_number_of_lamps_is_sampled_as_well_as_a_few() {
    let window = Wall::Window;
    let x = ShadingPoint::surface(Vec3::new(0.0, -1.5, 0.5), Vec3::new(0.0, 0.6, 0.8));
    let is_open = |direction: Vec3| {
        let hit = x.position + direction * (1.5 / direction.y);
        direction.y > 0.0 && window.is_open(hit.x, hit.z - 1.5)
    };
    let mut pcg = Pcg32::new(3, 31);
    let mut before: Option<f64> = None;
    for count in [1, 2, 4, 8, 9, 10, 16, 17, 32, 33, 64] {
        let environment = lamps(count);
        let n = 4000;
        let (mean, error) = estimate(4 * n, || {
            let [u, v, _] = pcg.cube();
            let sample = environment.sample([u, v]).expect("the sky is not black");
            if !is_open(sample.direction) {
                return 0.0;
            }
            f64::from(sample.radiance * x.cosine(sample.direction) / sample.pdf)
        });
        let lights = window.portal_to(environment.clone());
        let here = lights.at(&x);
        let (found, own_error) = estimate(n, || {
            let Some(sample) = here.sample(pcg.cube()) else { return 0.0 };
            let radiance = environment.radiance(sample.direction) * f32::from(u8::from(is_open(sample.direction)));
            f64::from(radiance * x.cosine(sample.direction) / here.pdf_sample_direction(&sample))
        });
        assert!((found - mean).abs() < 5.0 * (error + own_error), "{count}: {found} instead of {mean}");
        let deviation = own_error * f64::from(n as u32).sqrt() / found;
        let other = 2.0 * error * f64::from(n as u32).sqrt() / mean;
        assert!(deviation < 1.1 * other, "{count}: {deviation}, and {other} by the environment");
        assert!(
            before.is_none_or(|before| deviation < 1.5 * before.max(0.05)),
            "{count}: {deviation} after {before:?}"
        );
        before = Some(deviation);
    }
}

/// A row of panes with narrow bars between them, in the window's place.
fn panes(count: usize, environment: &Environment) -> LightSampler {
    let mut builder = LightSampler::builder().environment(environment.clone());
    for [from, to] in (0..count).map(|i| pane(i, count)) {
        let corners = [[from, 1.0], [to, 1.0], [to, 2.0], [from, 2.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        builder.add_mesh(&Mesh::portal(&corners, &[[0, 1, 2], [0, 2, 3]])).expect("the pane is sound");
    }
    builder.build().expect("the scene is sound")
}

/// Where a pane begins and ends.
fn pane(i: usize, count: usize) -> [f32; 2] {
    [0.0, 0.9].map(|share| -0.5 + (i as f32 + share) / count as f32)
}

/// The list of parts has room for what few panes show of 32 lamps, one by one, and not for what many do.
#[test]
fn any_number_of_panes_is_sampled_as_well_as_a_few() {
    let environment = lamps(32);
    let x = ShadingPoint::surface(Vec3::new(0.0, -1.5, 0.5), Vec3::new(0.0, 0.6, 0.8));
    let mut pcg = Pcg32::new(6, 31);
    for count in [2, 8, 9, 16, 32, 64] {
        let is_open = |direction: Vec3| {
            let hit = x.position + direction * (1.5 / direction.y);
            let is_pane = |[from, to]: [f32; 2]| (from..=to).contains(&hit.x);
            direction.y > 0.0 && (1.0..=2.0).contains(&hit.z) && (0..count).map(|i| pane(i, count)).any(is_pane)
        };
        let (mean, error) = estimate(100_000, || {
            let [u, v, _] = pcg.cube();
            let sample = environment.sample([u, v]).expect("the sky is not black");
            let value = f64::from(sample.radiance * x.cosine(sample.direction) / sample.pdf);
            if is_open(sample.direction) { value } else { 0.0 }
        });
        let lights = panes(count, &environment);
        let here = lights.at(&x);
        let n = 4000;
        let (found, own_error) = estimate(n, || {
            let Some(sample) = here.sample(pcg.cube()) else { return 0.0 };
            let value = f64::from(environment.radiance(sample.direction) * x.cosine(sample.direction));
            value / f64::from(here.pdf_sample_direction(&sample))
        });
        assert!((found - mean).abs() < 5.0 * (error + own_error), "{count}: {found} instead of {mean}");
        let relvar = n as f64 * (own_error / found).powi(2);
        println!("{count} panes: relative variance {relvar:.3}");
        assert!(relvar < 0.05, "{count} panes: {relvar}");
    }
}
