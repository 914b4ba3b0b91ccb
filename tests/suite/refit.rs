//! A sampler whose lights have moved or changed their brightness keeps all promises of one that was freshly built.

use crate::common::density::{OnTriangle, id, probes};
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, LightMesh, Paint, Scene, random_point};
use crate::common::statistics::Mean;
use crate::common::tier::{some, tier};
use crate::common::{oracle, parallel};
use fanlight::{
    Arity, Environment, Error, Filter, Hit, LightSample, LightSampler, Mesh, MeshId, MeshUpdate, ShadingPoint,
    TriangleId,
};
use glam::{DVec3, Quat, Vec3};

const SCENES: usize = 24;

fn content(number: usize, two_sided: bool) -> Content {
    Content { triangles: [1, 5, 30, 200][number % 4], textured: number % 3 == 1, sky: number / 4 % 4, two_sided }
}

fn scene(number: usize, two_sided: bool) -> (Scene, Pcg32) {
    let mut pcg = Pcg32::new(3000 + number as u64, 31);
    let scene = Scene::random(&mut pcg, content(number, two_sided));
    (scene, pcg)
}

/// Every mesh turned by itself, bent, and multiplied.
fn changed(scene: &Scene, pcg: &mut Pcg32) -> (Scene, Vec<f32>) {
    let mut scene = scene.clone();
    let mut scales = Vec::new();
    for mesh in &mut scene.meshes {
        let turn = Quat::from_rotation_arc(pcg.direction(), pcg.direction());
        mesh.positions.iter_mut().for_each(|p| *p = turn * *p + 0.2 * Vec3::new((5.0 * p.y).sin(), p.z * p.z, 0.3));
        scales.push(pcg.within(0.2, 5.0));
    }
    for (mesh, scale) in scene.meshes.iter_mut().zip(&scales) {
        match &mut mesh.paint {
            Paint::Constant(value) => *value *= scale,
            Paint::Image(image) => scene.images[*image].texels.iter_mut().for_each(|texel| *texel *= scale),
        }
    }
    (scene, scales)
}

fn update_of<'a>(mesh: u32) -> MeshUpdate<'a> {
    MeshUpdate::new(MeshId::from_index(mesh))
}

fn refit(lights: &mut LightSampler, scene: &Scene, scales: &[f32]) {
    let mut updates = Vec::new();
    for (number, mesh) in (0..).zip(&scene.meshes) {
        let update = update_of(number).moved(&mesh.positions, &mesh.indices);
        updates.push(scales.get(number as usize).map_or(update, |scale| update.scaled(*scale)));
    }
    lights.refit(&updates).expect("the changes are valid");
}

fn samples(lights: &LightSampler, count: usize) -> Vec<Option<LightSample>> {
    let mut pcg = Pcg32::new(1, 32);
    (0..count).map(|i| lights.at(&random_point(&mut pcg, i)).sample(pcg.cube())).collect()
}

#[test]
fn without_a_change_every_bit_stays() {
    for number in 0..SCENES {
        let (scene, _) = scene(number, false);
        let mut lights = scene.build(Arity::Sixteen);
        let before = lights.to_bytes();
        lights.refit(&[]).expect("nothing is valid");
        refit(&mut lights, &scene, &[]);
        assert!(lights.to_bytes() == before, "{}", scene.name);
        assert_eq!(lights.decay(), 1.0);
    }
}

#[test]
fn changes_can_be_taken_back() {
    for number in 0..SCENES {
        let (scene, mut pcg) = scene(number, false);
        let mut lights = scene.build(Arity::Sixteen);
        let before = samples(&lights, 2000);
        let (other, scales) = changed(&scene, &mut pcg);
        refit(&mut lights, &other, &scales);
        assert_ne!(samples(&lights, 2000), before, "{}", scene.name);
        refit(&mut lights, &scene, &vec![1.0; scales.len()]);
        assert_eq!(samples(&lights, 2000), before, "{}", scene.name);
    }
}

#[test]
fn the_density_is_that_of_the_samples() {
    let mut drawn = 0;
    for number in 0..SCENES {
        let (scene, mut pcg) = scene(number, false);
        let mut lights = scene.build(Arity::Sixteen);
        let (other, scales) = changed(&scene, &mut pcg);
        refit(&mut lights, &other, &scales);
        for i in 0..3000 {
            let x = random_point(&mut pcg, i);
            let Some(sample) = lights.at(&x).sample(pcg.cube()) else { continue };
            drawn += 1;
            let again = lights.at(&x).pdf(&sample.hit().expect("a triangle"));
            assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{}: {} {again}", other.name, sample.pdf);
            let [a, b, c] = other.meshes[sample.hit().expect("a triangle").triangle.mesh.index() as usize]
                .vertices(sample.hit().expect("a triangle").triangle.triangle as usize);
            let [b1, b2] = sample.hit().expect("a triangle").barycentrics;
            let there = a * (1.0 - b1 - b2) + b * b1 + c * b2;
            assert!(there.distance(sample.position) < 1e-4, "the sample is not on the moved triangle");
        }
    }
    assert!(drawn > 1000 * SCENES, "only {drawn} samples");
}

/// How much coarser the integrals are than those of scenes that stay as they are. What they leave open is tolerated.
const COARSER: f64 = 5.0;

/// Volumes see every two-sided light, so nothing can be missed.
#[test]
fn the_density_integrates_to_one() {
    let numbers = some(SCENES);
    let found = parallel::map(numbers.len(), |k| {
        let number = numbers[k];
        let (scene, mut pcg) = scene(number, true);
        let mut lights = scene.build(Arity::Four);
        let (other, scales) = changed(&scene, &mut pcg);
        refit(&mut lights, &other, &scales);
        let x = random_point(&mut pcg, 2);
        let drawn: Vec<_> = (0..20_000).filter_map(|_| lights.at(&x).sample(pcg.cube())).collect();
        let missed = 1.0 - drawn.len() as f64 / 20_000.0;
        let probes = probes(&other, &drawn[..drawn.len().min(2000)]);
        let at = lights.at(&x);
        let pdf = |hit: &Hit| f64::from(at.pdf(hit));
        let (mut sum, mut unresolved, mut pmfs) = (0.0, 0.0, 0.0);
        for (m, t) in other.triangles() {
            let on = OnTriangle::new(&other, (m, t), &x, &pdf).coarser(COARSER);
            let (whole, open) = on.integrate(0, 4, &probes[m][t]);
            sum += whole[0];
            unresolved += open * open;
            pmfs += f64::from(at.pmf(id((m, t))));
        }
        (other.name, sum, unresolved.sqrt(), missed, pmfs)
    });
    for (name, sum, unresolved, missed, pmfs) in found {
        let tolerance = 1e-4 + unresolved + 4.0 * (missed * (1.0 - missed) / 20_000.0).sqrt();
        assert!((sum + missed - 1.0).abs() < tolerance, "{name}: {sum}, missed {missed}");
        assert!(pmfs < 1.0 + 1e-5, "{name}: {pmfs}");
    }
}

/// What a sample's point sends to `x`, times the cosine.
fn contribution(scene: &Scene, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let (m, t) = (
        sample.hit().expect("a triangle").triangle.mesh.index() as usize,
        sample.hit().expect("a triangle").triangle.triangle as usize,
    );
    let b = sample.hit().expect("a triangle").barycentrics.map(f64::from);
    let [v0, v1, v2] = scene.meshes[m].vertices(t).map(|v| v.as_dvec3() - x.position.as_dvec3());
    let direction: DVec3 = (v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1]).normalize();
    oracle::sent(scene, m, t, b, direction) * oracle::cosine(&x.receiver, direction)
}

/// Against an integral in double precision that knows nothing of the crate, within four and a half standard errors:
/// chance alone breaks that in one run of six thousand. The variance is that of a new build, or near to it.
#[test]
fn estimates_agree_with_the_integral_and_with_a_new_build() {
    let found = parallel::map(16, |number| {
        let (scene, mut pcg) = scene(4 * (number % 4) + 1 + number / 4 % 2, false);
        let mut lights = scene.build(Arity::Sixteen);
        let (other, scales) = changed(&scene, &mut pcg);
        refit(&mut lights, &other, &scales);
        let fresh = other.build(Arity::Sixteen);
        let x = (0..100).map(|i| random_point(&mut pcg, i)).find(|x| lights.at(x).sample([0.5; 3]).is_some());
        let x = x.expect("some point is lit");
        let sent = |m, t, b, direction| oracle::sent(&other, m, t, b, direction);
        let (exact, change) = oracle::converged(5e-4, |count| oracle::over_lights(&other, &x, None, count, &sent));
        let estimate = |lights: &LightSampler, pcg: &mut Pcg32| {
            let mut mean = Mean::default();
            for _ in 0..tier().histogram {
                let sample = lights.at(&x).sample(pcg.cube());
                mean.add(sample.map_or(0.0, |s| contribution(&other, &x, &s) / f64::from(s.pdf)));
            }
            mean
        };
        (other.name.clone(), exact, change, estimate(&lights, &mut pcg), estimate(&fresh, &mut pcg))
    });
    for (name, exact, change, refitted, fresh) in &found {
        for mean in [refitted, fresh] {
            let off = ((mean.mean() - exact).abs() - change).max(0.0);
            assert!(off <= 4.5 * mean.error(), "{name}: {} ± {}, not {exact}", mean.mean(), mean.error());
        }
    }
    let worst = found.iter().map(|(_, _, _, refitted, fresh)| refitted.error() / fresh.error().max(1e-9));
    let geometric = worst.map(f64::ln).sum::<f64>() / found.len() as f64;
    assert!(geometric.exp() < 1.5, "the error grew by {}", geometric.exp());
}

fn id_of(mesh: u32, triangle: u32) -> TriangleId {
    TriangleId::new(MeshId::from_index(mesh), triangle)
}

/// Three squares above each other, looking down, which a point below sees all.
fn squares() -> Scene {
    let square = |z: f32| LightMesh::quad(Vec3::new(-0.5, -0.5, z), Vec3::Y, Vec3::X);
    Scene::new("squares", vec![square(1.0), square(1.5), square(2.0)])
}

#[test]
fn a_mesh_that_is_off_is_never_sampled() {
    for count in 1..=3 {
        let mut scene = squares();
        scene.meshes.truncate(count);
        scene.meshes.iter_mut().for_each(|mesh| mesh.indices.truncate(if count == 1 { 1 } else { 2 }));
        let mut lights = scene.build(Arity::Sixteen);
        let x = ShadingPoint::surface(Vec3::new(0.1, 0.0, 0.0), Vec3::Z);
        let sum = |lights: &LightSampler| -> f32 { scene.triangles().map(|t| lights.at(&x).pmf(id(t))).sum() };
        assert!((sum(&lights) - 1.0).abs() < 1e-5);
        lights.refit(&[update_of(0).scaled(0.0)]).expect("zero is valid");
        let mut pcg = Pcg32::new(9, 33);
        for _ in 0..2000 {
            let sample = lights.at(&x).sample(pcg.cube());
            assert!(sample.is_none_or(|sample| sample.hit().expect("a triangle").triangle.mesh.index() != 0));
            assert_eq!(sample.is_some(), count > 1);
        }
        assert_eq!(lights.at(&x).pmf(id_of(0, 0)), 0.0);
        assert_eq!(lights.at(&x).pdf(&Hit::new(id_of(0, 0), [0.3, 0.3])), 0.0);
        assert_eq!(lights.at(&x).pdf_direction(Vec3::Z) > 0.0, count > 1);
        let rest = if count > 1 { 1.0 } else { 0.0 };
        assert!((sum(&lights) - rest).abs() < 1e-5, "{count}: {}", sum(&lights));
        lights.refit(&[update_of(0).scaled(1.0)]).expect("one is valid");
        assert!((sum(&lights) - 1.0).abs() < 1e-5 && lights.at(&x).pmf(id_of(0, 0)) > 0.0);
    }
}

/// A sun that is seen through a portal is a technique of its own, which must know about the factor, too.
#[test]
fn suns_are_seen_through_the_portals_that_are_on() {
    let mut texels = vec![1.0f32; 64 * 32];
    texels[3 * 64 + 10] = 5000.0;
    let sky = Environment::from_lat_long(64, 32, &texels, Filter::Nearest).expect("the sky is valid");
    let (phi, theta) = (core::f32::consts::TAU * 10.5 / 64.0, core::f32::consts::PI * 3.5 / 32.0);
    let sun = Vec3::new(phi.cos() * theta.sin(), -phi.sin() * theta.sin(), theta.cos());
    let side = sun.any_orthonormal_vector();
    let across = sun.cross(side);
    let mut scene = squares();
    for (mesh, distance) in scene.meshes.iter_mut().zip([1.0f32, 2.0, 3.0]) {
        let corner = distance * sun - 0.5 * (side + across);
        *mesh = LightMesh::quad(corner, across, side).portal();
    }
    let mut builder = LightSampler::builder().environment(sky);
    for mesh in &scene.meshes {
        builder.add_mesh(&Mesh::portal(&mesh.positions, &mesh.indices)).expect("the mesh is valid");
    }
    let mut lights = builder.build().expect("there are few triangles");
    let x = ShadingPoint::volume(Vec3::ZERO);
    let mut pcg = Pcg32::new(10, 33);
    let mut into_sun = |lights: &LightSampler, mesh: u32| {
        let mut count = 0;
        for _ in 0..4000 {
            let Some(sample) = lights.at(&x).sample(pcg.cube()) else { continue };
            let again = lights.at(&x).pdf(&sample.hit().expect("a triangle"));
            assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{} {again}", sample.pdf);
            count += usize::from(
                sample.hit().expect("a triangle").triangle.mesh.index() == mesh && sample.direction.dot(sun) > 0.99,
            );
        }
        count
    };
    assert!(into_sun(&lights, 0) > 1000);
    lights.refit(&[update_of(0).scaled(0.0)]).expect("zero is valid");
    assert_eq!(into_sun(&lights, 0), 0);
    assert!(into_sun(&lights, 1) > 1000);
    lights.refit(&[update_of(0).scaled(0.0), update_of(1).scaled(1e-20)]).expect("they are valid");
    assert!(into_sun(&lights, 1) < 100 && into_sun(&lights, 2) > 0);
}

#[test]
fn triangles_may_lose_their_area_and_get_it_back() {
    let scene = squares();
    let mut lights = scene.build(Arity::Four);
    let x = ShadingPoint::surface(Vec3::new(0.1, 0.0, 0.0), Vec3::Z);
    let before = lights.at(&x).pmf(id_of(1, 1));
    let mut flat = scene.clone();
    flat.meshes[1].positions[3] = flat.meshes[1].positions[0];
    refit(&mut lights, &flat, &[]);
    assert_eq!(lights.at(&x).pmf(id_of(1, 1)), 0.0);
    assert_eq!(lights.at(&x).pdf(&Hit::new(id_of(1, 1), [0.2, 0.2])), 0.0);
    let sum: f32 = flat.triangles().map(|t| lights.at(&x).pmf(id(t))).sum();
    assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    let mut pcg = Pcg32::new(11, 33);
    (0..2000).for_each(|_| {
        assert_ne!(lights.at(&x).sample(pcg.cube()).map(|s| s.hit().expect("a triangle").triangle), Some(id_of(1, 1)));
    });
    refit(&mut lights, &scene, &[]);
    assert_eq!(lights.at(&x).pmf(id_of(1, 1)), before);
}

fn assert_refused(lights: &mut LightSampler, updates: &[MeshUpdate<'_>], parts: &[&str]) {
    let before = lights.to_bytes();
    let Err(error): Result<(), Error> = lights.refit(updates) else { panic!("{updates:?} is accepted") };
    let message = error.to_string();
    parts.iter().for_each(|part| assert!(message.contains(part), "\"{message}\" does not say \"{part}\""));
    assert!(lights.to_bytes() == before, "{message}: but something has changed");
}

#[test]
fn bad_changes_are_refused_and_change_nothing() {
    let mut scene = squares();
    // From here on the second triangle of the last mesh has no area.
    scene.meshes[2].indices[1] = [0, 0, 3];
    scene.meshes[2].paint = Paint::Constant(1e20);
    let mut lights = scene.build(Arity::Sixteen);
    let good = update_of(0).scaled(3.0);
    let refuse =
        |lights: &mut LightSampler, bad: MeshUpdate<'_>, parts: &[&str]| assert_refused(lights, &[good, bad], parts);
    refuse(&mut lights, update_of(3), &["mesh 3", "has 3"]);
    for (bad, name) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-1.0, "-1"), (2e30, "20000000000")] {
        refuse(&mut lights, update_of(1).scaled(bad), &["mesh 1", name, "1e30"]);
    }
    refuse(&mut lights, update_of(2).scaled(1e11), &["mesh 2", "1e30"]);
    let LightMesh { positions, indices, .. } = &scene.meshes[1];
    refuse(&mut lights, update_of(1).moved(positions, &indices[..1]), &["mesh 1", "1 triangles", "with 2"]);
    refuse(&mut lights, update_of(1).moved(&positions[..3], indices), &["mesh 1", "vertex 3", "are 3"]);
    for bad in [f32::NAN, f32::INFINITY, 2e9] {
        let mut positions = positions.clone();
        positions[2].y = bad;
        refuse(&mut lights, update_of(1).moved(&positions, indices), &["mesh 1", "vertex 2"]);
    }
    let update = update_of(2).moved(positions, indices);
    refuse(&mut lights, update, &["mesh 2", "triangle 1", "no", "area"]);
    let same = update_of(2).moved(positions, &scene.meshes[2].indices);
    lights.refit(&[good, same]).expect("a triangle without area may stay so");
}

#[test]
fn decay_tells_what_a_motion_does_to_the_tree() {
    let mut pcg = Pcg32::new(12, 33);
    let scene = Scene::new("soup", vec![LightMesh::soup(&mut pcg, 2000, 0.03)]);
    let mut lights = scene.build(Arity::Sixteen);
    let mut decay = |change: &mut dyn FnMut(usize, Vec3) -> Vec3| {
        let mut moved = scene.clone();
        moved.meshes[0].positions.iter_mut().enumerate().for_each(|(i, p)| *p = change(i / 3, *p));
        refit(&mut lights, &moved, &[]);
        lights.decay()
    };
    let rigid = decay(&mut |_, p| 3.0 * Vec3::new(p.y, -p.x, p.z) + 1.0);
    assert!((rigid - 1.0).abs() < 1e-3, "{rigid}");
    let offsets: Vec<Vec3> = (0..2000).map(|_| pcg.direction()).collect();
    let little = decay(&mut |i, p| p + 0.02 * offsets[i]);
    let much = decay(&mut |i, p| p + 0.3 * offsets[i]);
    println!("decay {little} {much}");
    assert!(1.0 < little && little < 1.2 && much > 1.5, "{little} {much}");
    assert_eq!(decay(&mut |_, p| p), 1.0);
}

/// Median over shading points of the relative variance of one sample.
fn noise(lights: &LightSampler) -> f64 {
    let mut pcg = Pcg32::new(13, 33);
    let points: Vec<_> = (0..200).map(|_| random_point(&mut pcg, 0)).collect();
    let relative_variance = |x: &ShadingPoint| {
        let mut mean = Mean::default();
        for _ in 0..1000 {
            let sample = lights.at(x).sample(pcg.cube());
            let cosine = |s: &LightSample| oracle::cosine(&x.receiver, s.direction.as_dvec3());
            mean.add(sample.map_or(0.0, |s| cosine(&s) / f64::from(s.pdf)));
        }
        1000.0 * (mean.error() / mean.mean()).powi(2)
    };
    let mut variances: Vec<f64> = points.iter().map(relative_variance).filter(|v| v.is_finite()).collect();
    assert!(2 * variances.len() > points.len(), "only {} points are lit", variances.len());
    variances.sort_by(f64::total_cmp);
    variances[variances.len() / 2]
}

/// How much noisier than a new build a tree is that has decayed; `--nocapture` prints the table of the documentation.
#[test]
fn decay_goes_with_noise() {
    let mut pcg = Pcg32::new(14, 33);
    let scene = Scene::new("soup", vec![LightMesh::soup(&mut pcg, 10_000, 0.014)]);
    let offsets: Vec<Vec3> = (0..10_000).map(|_| pcg.direction()).collect();
    let mut lights = scene.build(Arity::Sixteen);
    let mut ratios = Vec::new();
    for distance in [0.02, 0.08, 0.16, 0.3] {
        let mut moved = scene.clone();
        let positions = moved.meshes[0].positions.iter_mut().enumerate();
        positions.for_each(|(i, p)| *p += distance * offsets[i / 3]);
        refit(&mut lights, &moved, &[]);
        let ratio = noise(&lights) / noise(&moved.build(Arity::Sixteen));
        println!("moved by {distance}: decay {:.2}, variance {ratio:.2} times that of a new build", lights.decay());
        ratios.push((lights.decay(), ratio));
    }
    assert!(ratios[0].0 < 1.2 && ratios[0].1 < 1.2, "{ratios:?}");
    assert!(ratios[3].0 > 2.0 && ratios[3].1 > 2.0, "{ratios:?}");
    assert!(ratios.windows(2).all(|pair| pair[0].0 < pair[1].0), "{ratios:?}");
}

#[test]
fn bytes_hold_what_has_changed() {
    let (scene, mut pcg) = scene(6, false);
    let mut lights = scene.build(Arity::Sixteen);
    let (other, scales) = changed(&scene, &mut pcg);
    refit(&mut lights, &other, &scales);
    let words = crate::common::lights::aligned(&lights.to_bytes());
    let view = fanlight::LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("the bytes load");
    let mut drawn = 0;
    for i in 0..2000 {
        let (x, u) = (random_point(&mut pcg, i), pcg.cube());
        let sample = lights.at(&x).sample(u);
        assert_eq!(view.at(&x).sample(u), sample);
        drawn += u32::from(sample.is_some());
    }
    assert!(drawn > 500, "{drawn} samples");
}
