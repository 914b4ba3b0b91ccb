//! Rays of light that leave the lights: their densities agree with themselves and integrate to one, and the light
//! that they bring to a surface is that of an integral which knows nothing of the crate.
//!
//! A family of scenes passes if the deviations of its scenes, four standard errors at most each, do so.

use crate::common::oracle;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Image, LightMesh, Paint, Scene, Sky};
use crate::common::statistics::Mean;
use crate::common::tier::some;
use fanlight::{Arity, Emission, EmissionSample, Filter, Hit, ShadingPoint};
use glam::Vec3;

const SCENES: usize = 16;
const SAMPLES: usize = 200_000;
/// Standard errors that an estimate may be off.
const LIMIT: f64 = 4.0;

/// A square floor below the unit cube, facing up, with this corner and side.
const FLOOR: (Vec3, f32) = (Vec3::new(-0.5, -0.5, -0.6), 2.0);

fn random<const D: usize>(pcg: &mut Pcg32) -> [f32; D] {
    core::array::from_fn(|_| pcg.f32())
}

fn hit(ray: &EmissionSample) -> Hit {
    ray.hit().expect("a triangle")
}

/// Whether a ray ends on the floor, and at which cosine.
fn lands(ray: &EmissionSample) -> bool {
    let (corner, side) = FLOOR;
    let t = (corner.z - ray.position.z) / ray.direction.z;
    let at = ray.position + t * ray.direction - corner;
    ray.direction.z < 0.0 && t > 0.0 && at.x > 0.0 && at.y > 0.0 && at.x < side && at.y < side
}

/// Radiance along a ray, by the scene's description.
fn radiance(scene: &Scene, ray: &EmissionSample) -> f64 {
    let hit = hit(ray);
    let (m, t) = (hit.triangle.mesh.index() as usize, hit.triangle.triangle as usize);
    oracle::sent(scene, m, t, hit.barycentrics.map(f64::from), -ray.direction.as_dvec3())
}

/// Power that the lights send to the floor, by the irradiance at the midpoints of a grid on it.
fn power(scene: &Scene) -> f64 {
    const GRID: u16 = 12;
    let (corner, side) = FLOOR;
    let points = (0..GRID * GRID).map(|i| [i % GRID, i / GRID].map(|i| (f32::from(i) + 0.5) / f32::from(GRID)));
    let irradiance = points.map(|[s, t]| {
        let x = ShadingPoint::surface(corner + Vec3::new(s * side, t * side, 0.0), Vec3::Z);
        oracle::over_lights(scene, &x, None, 1 << 14, &|m, t, b, d| oracle::sent(scene, m, t, b, d))
    });
    irradiance.sum::<f64>() / f64::from(GRID * GRID) * f64::from(side * side)
}

/// Power that the lights send to the floor, by photons, with its standard error.
fn photon_power(scene: &Scene, emission: &Emission<'_>, pcg: &mut Pcg32) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..SAMPLES {
        let ray = emission.sample(random(pcg)).filter(lands);
        mean.add(ray.map_or(0.0, |ray| radiance(scene, &ray) / f64::from(ray.pdf)));
    }
    mean
}

/// `sample(..).pdf` is `pdf` of the same ray.
fn assert_agreement(emission: &Emission<'_>, pcg: &mut Pcg32) {
    let mut drawn = 0;
    for _ in 0..2000 {
        let Some(ray) = emission.sample(random(pcg)) else { continue };
        let pdf = emission.pdf(&hit(&ray), ray.direction);
        assert!((pdf / ray.pdf - 1.0).abs() < 1e-5, "{ray:?}: {pdf}");
        drawn += 1;
    }
    assert!(drawn > 200, "only {drawn} rays");
}

fn check(name: &str, make: impl Fn(&mut Pcg32, usize) -> Scene + Sync) {
    let numbers = some(SCENES);
    let results = parallel::map(numbers.len(), |k| {
        let number = numbers[k];
        let mut pcg = Pcg32::new(3000 + number as u64, 31);
        let scene = make(&mut pcg, number);
        let lights = scene.build(Arity::default());
        let emission = lights.emission();
        assert_agreement(&emission, &mut pcg);
        let mean = photon_power(&scene, &emission, &mut pcg);
        (power(&scene), mean.mean(), mean.error())
    });
    for (number, (exact, mean, error)) in results.iter().enumerate() {
        println!("{name} {number}: {exact:.5} {mean:.5} ± {error:.5}");
        assert!((mean - exact).abs() <= LIMIT * error + 2e-3 * exact, "{name} {number}: {mean} ± {error}, not {exact}");
        assert!(*error < 0.05 * exact, "{name} {number}: too noisy to tell");
    }
}

#[test]
fn emitters_light_the_floor() {
    check("emitters", |pcg, number| {
        let mut scene = Scene::new("soup", vec![LightMesh::soup(pcg, 20, 0.3).paint(Paint::Image(0))]);
        scene.images.push(Image { filter: Filter::Nearest, ..Image::random(pcg, number % 2) });
        scene.meshes.push(LightMesh::soup(pcg, 5, 0.3).two_sided());
        scene
    });
}

#[test]
fn portals_to_an_image_light_the_floor() {
    check("portals", |pcg, number| {
        let mut scene = Scene::new("soup", vec![LightMesh::soup(pcg, 20, 0.3).portal().two_sided()]);
        scene.meshes.push(LightMesh::soup(pcg, 2, 0.3).paint(Paint::Constant(0.4)));
        scene.sky = Sky::random(pcg, 1 + 2 * (number % 2));
        scene.rotation = pcg.rotation();
        scene
    });
}

#[test]
fn portals_to_a_constant_sky_light_the_floor() {
    check("constant sky", |pcg, _| Scene {
        sky: Sky::Constant(1.5),
        ..Scene::new("soup", vec![LightMesh::soup(pcg, 20, 0.3).portal()])
    });
}

#[test]
fn a_single_portal_lights_the_floor() {
    check("single", |pcg, number| {
        let (a, b) = (Vec3::new(-1.0, -1.0, 0.5), Vec3::new(2.0, -1.0, 0.8));
        let mesh = LightMesh::new(vec![a, Vec3::new(0.0, 2.0, 0.2), b], vec![[0, 1, 2]]).portal();
        Scene { sky: Sky::random(pcg, number % 2), ..Scene::new("triangle", vec![mesh]) }
    });
}

/// A ray that passes two portals counts with the sum of their densities.
#[test]
fn rays_through_two_portals_count_once() {
    let outer = LightMesh::quad(Vec3::new(-1.5, -1.5, 1.0), 3.0 * Vec3::Y, 3.0 * Vec3::X).portal();
    let inner = LightMesh::quad(Vec3::new(-0.5, -0.5, 0.0), Vec3::Y, Vec3::X).portal();
    let mut scene = Scene::new("nested", vec![outer, inner]);
    let mut pcg = Pcg32::new(9, 9);
    scene.sky = Sky::random(&mut pcg, 1);
    let lights = scene.build(Arity::default());
    let emission = lights.emission();
    // The floor through both, and what the inner one alone would say.
    let through_both = |ray: &EmissionSample| {
        let at = |z: f32| ray.position + (z - ray.position.z) / ray.direction.z * ray.direction;
        let inside = |p: Vec3, half: f32| p.x.abs() < half && p.y.abs() < half;
        ray.direction.z < 0.0 && inside(at(1.0), 1.5) && inside(at(0.0), 0.5)
    };
    let (mut sum, mut one) = (Mean::default(), Mean::default());
    for _ in 0..SAMPLES {
        let ray = emission.sample(random(&mut pcg)).filter(lands).filter(through_both);
        let value = ray.map_or(0.0, |ray| {
            let sky = oracle::radiance(&scene, -ray.direction.as_dvec3());
            let below = ray.position - (ray.position.z + 0.1) / ray.direction.z * ray.direction;
            sky / f64::from(emission.pdf_ray(below, -ray.direction))
        });
        sum.add(value);
        one.add(if ray.is_some_and(|ray| hit(&ray).triangle.mesh.index() == 1) {
            ray.map_or(0.0, |ray| radiance(&scene, &ray) / f64::from(ray.pdf))
        } else {
            0.0
        });
    }
    let error = sum.error().hypot(one.error());
    assert!((sum.mean() - one.mean()).abs() < LIMIT * error, "{} and {} ± {error}", sum.mean(), one.mean());
    assert!(error < 0.02 * one.mean(), "too noisy to tell");
}

/// A hundred windows: fifty in a ceiling, and as many above them, through which some rays come before.
fn a_hundred_openings(pcg: &mut Pcg32) -> Scene {
    let mut scene = Scene::new("openings", Vec::new());
    for i in 0..100u8 {
        let [x, y, z] = [i % 10, i / 10 % 5, i / 50].map(f32::from);
        let corner = Vec3::new(0.2 * x, 0.4 * y, 1.0 + 0.3 * z);
        scene.meshes.push(LightMesh::quad(corner, 0.3 * Vec3::Y, 0.15 * Vec3::X).portal());
    }
    scene.sky = Sky::random(pcg, 1);
    scene
}

/// Whether a line passes the edge of any triangle so closely that rounding may decide on which side.
fn passes_an_edge(scene: &Scene, point: Vec3, along: Vec3) -> bool {
    const NEAR: f64 = 1e-4;
    scene.triangles().any(|(m, t)| {
        let [a, b, c] = scene.meshes[m].vertices(t).map(|v| v.as_dvec3() - point.as_dvec3());
        let along = along.as_dvec3();
        let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|normal| normal.dot(along));
        let least = parts.iter().map(|part| part / parts.iter().sum::<f64>()).fold(1.0, f64::min);
        least.abs() < NEAR
    })
}

/// A ray's own density, evaluated where it has landed, counts the opening that it came through, whatever rounding does;
/// apart from the edges it is the density of any ray there.
#[test]
fn the_density_of_a_landed_ray_is_never_below_its_own() {
    let mut pcg = Pcg32::new(13, 9);
    let scene = a_hundred_openings(&mut pcg);
    let lights = scene.build(Arity::default());
    let emission = lights.emission();
    let land = |ray: &EmissionSample| ray.position - ray.position.z / ray.direction.z * ray.direction;
    let (mut drawn, mut compared, mut through_both) = (0, 0, 0);
    for _ in 0..SAMPLES {
        let Some(ray) = emission.sample(random(&mut pcg)) else { continue };
        drawn += 1;
        let landed = land(&ray);
        let own = emission.pdf_sample_ray(&ray, landed);
        assert!(own >= ray.pdf && own.is_finite(), "{ray:?}: {own}");
        if passes_an_edge(&scene, landed, -ray.direction) {
            continue;
        }
        compared += 1;
        through_both += usize::from(own > 1.1 * ray.pdf);
        let any = emission.pdf_ray(landed, -ray.direction);
        assert!((any / own - 1.0).abs() < 1e-5, "{ray:?}: {own}, but {any} for any ray");
    }
    assert!(2 * drawn > SAMPLES, "only {drawn} rays");
    assert!(100 * compared > 99 * drawn, "only {compared} of {drawn} rays pass no edge");
    assert!(20 * through_both > drawn, "only {through_both} of {drawn} rays pass two openings");
    // Rays that start at an edge: on the way back some of them miss their own triangle.
    let mut missed = 0;
    for i in 0..20_000 {
        let mut u = random(&mut pcg);
        u[1 + i % 2] = [0.0, 1.0 - f32::EPSILON / 2.0][i / 2 % 2];
        let Some(ray) = emission.sample(u) else { continue };
        let landed = land(&ray);
        let own = emission.pdf_sample_ray(&ray, landed);
        assert!(own >= ray.pdf && own.is_finite(), "{ray:?}: {own}");
        missed += usize::from(emission.pdf_ray(landed, -ray.direction) < 0.5 * ray.pdf);
    }
    assert!(missed > 0, "no ray misses its own triangle: the test shows nothing");
    println!("{drawn} rays, {through_both} through two openings; {missed} of those from edges miss their own triangle");
}

#[test]
fn a_distant_light_passes_portals_by_their_area() {
    let numbers = some(8);
    let (count, mut lit) = (numbers.len(), 0);
    for number in numbers {
        let mut pcg = Pcg32::new(number as u64, 32);
        let mut scene = Scene::new("soup", vec![LightMesh::soup(&mut pcg, 12, 0.3).paint(Paint::Image(0)).portal()]);
        scene.images.push(Image { filter: Filter::Nearest, ..Image::random(&mut pcg, 1) });
        scene.sky = Sky::random(&mut pcg, usize::from(number % 2 == 0));
        let lights = scene.build(Arity::default());
        let emission = lights.emission();
        let direction = pcg.direction();
        let (mut through, mut exact, mut drawn) = (Mean::default(), 0.0, 0);
        for _ in 0..SAMPLES {
            let ray = emission.sample_distant(direction, random(&mut pcg));
            through.add(ray.map_or(0.0, |ray| {
                drawn += 1;
                let pdf = emission.pdf_distant(direction, &hit(&ray));
                assert!((pdf / ray.pdf - 1.0).abs() < 1e-5, "{ray:?}: {pdf}");
                let b = hit(&ray).barycentrics.map(f64::from);
                oracle::weight(&scene, &scene.meshes[0], hit(&ray).triangle.triangle as usize, b) / f64::from(ray.pdf)
            }));
        }
        for (_, t) in scene.triangles() {
            let [a, b, c] = scene.meshes[0].vertices(t).map(|v| v.as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).dot(direction.as_dvec3());
            let n: u32 = 200_000;
            let points = (0..n).map(|i| {
                let [u, v] =
                    [0.754_877_666_246_692_8, 0.569_840_290_998_053_2].map(|g| (g * f64::from(i) + 0.5).fract());
                let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                oracle::weight(&scene, &scene.meshes[0], t, [u, v])
            });
            exact += area.max(0.0) * points.sum::<f64>() / f64::from(n);
        }
        // Where all portals face away or are black, nothing may come.
        assert!(if exact > 0.0 { drawn > SAMPLES / 10 } else { drawn == 0 }, "{number}: {drawn} rays for {exact}");
        lit += usize::from(exact > 0.0);
        let tolerance = LIMIT * through.error() + 2e-3 * exact;
        assert!((through.mean() - exact).abs() <= tolerance, "{number}: {} for {exact}", through.mean());
    }
    assert!(2 * lit > count, "only {lit} of {count} scenes are lit from there");
}

/// What is black, or faces away from everything that shines, sends nothing and does no harm.
#[test]
fn nothing_comes_out_of_nothing() {
    let opening = LightMesh::quad(Vec3::ZERO, Vec3::X, Vec3::Y).portal();
    let mut scene = Scene::new("dark", vec![opening]);
    scene.sky = Sky::Constant(0.0);
    let lights = scene.build(Arity::default());
    assert_eq!(lights.emission().sample([0.5; 5]), None);
    let empty = Scene::new("empty", Vec::new()).build(Arity::default());
    assert_eq!(empty.emission().sample([0.5; 5]), None);
    assert_eq!(empty.emission().sample_distant(Vec3::X, [0.5; 3]), None);
    assert_eq!(empty.emission().pdf_ray(Vec3::ZERO, Vec3::X), 0.0);
    // A portal that faces up, under a sky that is lit near the zenith alone: no light goes up through it.
    scene.sky = Sky::LatLong { size: [16, 8], texels: (0..128).map(|i| f32::from(u8::from(i < 32))).collect() };
    let lights = scene.build(Arity::default());
    let mut pcg = Pcg32::new(1, 1);
    let emission = lights.emission();
    for _ in 0..1000 {
        assert_eq!(emission.sample(random(&mut pcg)), None);
    }
}
