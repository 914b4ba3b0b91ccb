//! A sampler that has been edited holds the same lights as one that is freshly built, and keeps the same promises.

mod densities;
mod distant;
mod world;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

use crate::common::lights::{aligned, sample_from_bytes};
use crate::common::pcg::Pcg32;
use crate::common::statistics::{chi_square, sidak};
use crate::common::tier::tier;
use fanlight::{
    DistantLight, Error, Instance, InstanceId, LightId, LightSampler, LightSamplerView, Mesh, MeshId, MeshUpdate,
    ObjectId, PointLight, SampledLight, ShadingPoint, SphereLight, TextureId, Weight,
};
use glam::{Affine3A, Vec3};
use world::{KINDS, World};

/// A shading point that every light of a world can send to: in a volume, which two-sided lights and spheres always
/// reach.
fn volume(world: &World, pcg: &mut Pcg32) -> ShadingPoint {
    let x = ShadingPoint::volume(4.0 * Vec3::from_array(pcg.cube()) - 2.0);
    if world.moves { x.at_time([0.0, 1.0, pcg.within(0.0, 1.0)][pcg.below(3)]) } else { x }
}

/// Compares an edited sampler with a fresh build of the same lights.
fn compare(world: &World, lights: &LightSampler, pcg: &mut Pcg32) -> Result<(), TestCaseError> {
    let fresh = world.build();
    prop_assert_eq!(lights.light_count(), fresh.lights.light_count());
    let words = aligned(&lights.to_bytes());
    let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words));
    prop_assert!(loaded.is_ok(), "{:?}", loaded.err());
    let mut points = Vec::new();
    for _ in 0..4 {
        let x = volume(world, pcg);
        let (at, other) = (lights.at(&x), fresh.lights.at(&x));
        let mut sums = [0.0f64; 2];
        for (light, new) in world.lights().zip(&fresh.ids) {
            let [own, built] = [light.pmf(&at), new.pmf(&other)];
            let is_known = !world.is_doubtful(light);
            prop_assert!(!is_known || (own > 0.0) == (built > 0.0), "{light:?}: {own}, but {built} in a fresh build");
            sums = [sums[0] + f64::from(own), sums[1] + f64::from(built)];
        }
        // Nothing is left out, and nothing counts twice.
        prop_assert!(sums.iter().all(|sum| *sum < 1.0 + 1e-4), "{sums:?}");
        if world.is_complete() {
            prop_assert!((sums[0] - sums[1]).abs() < 1e-4, "{sums:?}");
            prop_assert!(sums[1] == 0.0 || sums[1] > 1.0 - 1e-4, "{sums:?}");
        }
        for _ in 0..8 {
            let u = pcg.cube();
            points.push((x, u));
            let Some(sample) = at.sample(u) else { continue };
            prop_assert!(world.holds(&sample.light), "{:?} is no light", sample.light);
            let again = match sample.light {
                SampledLight::Triangle(hit) => at.pdf(&hit),
                SampledLight::Shape(id) => at.pdf_light(id, sample.direction),
                SampledLight::Punctual(id) => at.pmf_light(id),
                _ => at.pdf_environment(sample.direction),
            };
            prop_assert!((again / sample.pdf - 1.0).abs() < 1e-5, "{:?}: {again}, {}", sample.light, sample.pdf);
        }
    }
    let own: Vec<_> = points.iter().map(|(x, u)| lights.at(x).sample(*u)).collect();
    prop_assert_eq!(own, sample_from_bytes(lights, &points));
    Ok(())
}

/// Edits of any kind, in batches of any size.
#[test]
fn random_edits_leave_the_lights_of_a_fresh_build() {
    let config = Config {
        cases: tier().cases / 2,
        rng_seed: RngSeed::Fixed(17),
        failure_persistence: None,
        ..Config::default()
    };
    let edits = prop::collection::vec(any::<[u16; 3]>(), 0..150);
    let run =
        TestRunner::new(config).run(&(0..2 * KINDS, 0..40usize, edits, any::<u64>()), |(kind, count, edits, seed)| {
            let mut pcg = Pcg32::new(seed, 71);
            let mut world = World::random(&mut pcg, kind, count);
            let mut lights = world.build().lights;
            let batches = 1 + pcg.below(8);
            for batch in edits.chunks(edits.len().div_ceil(batches).max(1)) {
                let mut edit = lights.edit();
                for &numbers in batch {
                    world.edit(&mut edit, numbers, &mut pcg).map_err(|error| TestCaseError::fail(error.to_string()))?;
                }
                edit.apply().map_err(|error| TestCaseError::fail(error.to_string()))?;
                compare(&world, &lights, &mut pcg)?;
            }
            Ok(())
        });
    if let Err(error) = run {
        panic!("{error}");
    }
}

/// A world after 400 edits in batches of `batch`, and its sampler.
pub(crate) fn edited(seed: u64, kind: usize, batch: usize) -> (World, LightSampler) {
    let mut pcg = Pcg32::new(seed, 74);
    let mut world = World::random(&mut pcg, kind, 60);
    let mut lights = world.build().lights;
    let edits: Vec<[u16; 3]> = (0..400).map(|_| [0; 3].map(|_| pcg.u32() as u16)).collect();
    for batch in edits.chunks(batch) {
        let mut edit = lights.edit();
        for numbers in batch {
            world.edit(&mut edit, *numbers, &mut pcg).expect("the edit is valid");
        }
        edit.apply().expect("the lights are few");
    }
    (world, lights)
}

/// Batches of one edit, of some, and of all.
#[test]
fn batches_of_any_size_end_in_a_fresh_build() {
    for (seed, batch) in (0..).zip([1, 7, 400]) {
        for kind in (seed as usize..2 * KINDS).step_by(3) {
            let (world, lights) = edited(seed, kind, batch);
            compare(&world, &lights, &mut Pcg32::new(seed, 75)).expect("the lights are those of a fresh build");
        }
    }
}

#[test]
fn equal_edits_give_equal_samplers() {
    for kind in [1, 2, 7, 10, 13, 15] {
        let [one, other] = [0; 2].map(|_| edited(5, kind, 30).1.to_bytes());
        assert!(one == other, "{kind}");
    }
}

/// Significance of all histograms together.
const SIGNIFICANCE: f64 = 0.01;

/// Histograms over lights, and the irradiance by all samples against the sum over all lights in double precision.
#[test]
fn samples_of_edited_lights_fall_where_the_density_says() {
    let mut pcg = Pcg32::new(1, 76);
    let point = |pcg: &mut Pcg32| (2.0 * Vec3::from_array(pcg.cube()) - 1.0, pcg.within(0.2, 5.0));
    let mut known: Vec<Option<(Vec3, f32)>> = (0..300).map(|_| Some(point(&mut pcg))).collect();
    let mut builder = LightSampler::builder();
    for (position, intensity) in known.iter().flatten() {
        builder.add_light(PointLight::new(*position, *intensity)).expect("the light is valid");
    }
    let mut lights = builder.build().expect("the lights are few");
    let cases = 6;
    for case in 0..cases {
        let mut edits = lights.edit();
        for _ in 0..150 {
            let number = pcg.below(known.len());
            let id = LightId::from_index(number as u32);
            if known[number].is_none() || pcg.below(3) == 0 {
                let light = point(&mut pcg);
                let id =
                    edits.add_light(PointLight::new(light.0, light.1)).expect("the light is valid").index() as usize;
                known.resize(known.len().max(id + 1), None);
                known[id] = Some(light);
            } else if pcg.below(2) == 0 {
                let light = point(&mut pcg);
                edits.set_light(id, PointLight::new(light.0, light.1)).expect("the light is there");
                known[number] = Some(light);
            } else {
                edits.remove_light(id).expect("the light is there");
                known[number] = None;
            }
        }
        edits.apply().expect("the lights are few");
        let x = Vec3::from_array(pcg.cube()) - 0.5;
        let at = lights.at(&ShadingPoint::volume(x));
        let sends = |(position, intensity): (Vec3, f32)| {
            f64::from(intensity) / position.as_dvec3().distance_squared(x.as_dvec3())
        };
        let exact: f64 = known.iter().flatten().map(|light| sends(*light)).sum();
        let count = 30_000;
        let pmf = |(number, light): (u32, &Option<_>)| {
            light.as_ref().map_or(0.0, |_| f64::from(at.pmf_light(LightId::from_index(number))))
        };
        let expected: Vec<f64> = (0..).zip(&known).map(|pair| count as f64 * pmf(pair)).collect();
        let mut observed = vec![0.0; known.len()];
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..count {
            let sample = at.sample(pcg.cube()).expect("points send everywhere");
            let SampledLight::Punctual(id) = sample.light else { panic!("{:?} is no point", sample.light) };
            observed[id.index() as usize] += 1.0;
            let brought = sends(known[id.index() as usize].expect("the light is there")) / f64::from(sample.pdf);
            (sum, squares) = (sum + brought, squares + brought * brought);
        }
        let (p, worst) = chi_square(&observed, &expected);
        assert!(p > sidak(SIGNIFICANCE, cases), "case {case}: p = {p}\n{worst}");
        let mean = sum / f64::from(count);
        let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
        assert!((mean - exact).abs() < 5.5 * error, "case {case}: {mean}, but {exact} arrives, ± {error}");
    }
}

fn bulb(x: f32) -> SphereLight {
    SphereLight::new(Vec3::new(x, 0.0, 2.0), 0.1, 1.0)
}

const QUAD: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn quad() -> Mesh<'static> {
    Mesh::emitter(&QUAD, &[[0, 1, 2]])
}

/// Whatever is wrong is an error that names it, and changes nothing.
#[test]
fn mistakes_are_errors() {
    let mut builder = LightSampler::builder();
    builder.add_light(bulb(0.0)).expect("the light is valid");
    builder.add_mesh(&quad()).expect("the mesh is valid");
    let lamp = builder.add_object(&[quad()]).expect("the object is valid");
    builder.add_instance(Instance::new(lamp, Affine3A::IDENTITY)).expect("the instance is valid");
    let mut lights = builder.build().expect("the lights are few");
    let (light, mesh, instance) = (LightId::from_index(0), MeshId::from_index(0), InstanceId::from_index(0));
    drop(lights.edit());
    let before = lights.to_bytes();
    let fails = |result: Result<(), Error>, with: &[&str]| {
        let message = result.expect_err("it is a mistake").to_string();
        with.iter().for_each(|part| assert!(message.contains(part), "{message} does not say {part}"));
    };
    let mut edits = lights.edit();
    fails(edits.remove_light(LightId::from_index(7)), &["light 7", "1"]);
    fails(edits.set_light(LightId::from_index(1), bulb(1.0)), &["light 1"]);
    fails(edits.set_light(light, bulb(f32::NAN)), &["light 0", "NaN"]);
    fails(edits.add_light(bulb(f32::INFINITY)).map(drop), &["light 1", "inf"]);
    fails(edits.remove_mesh(MeshId::from_index(3)), &["mesh 3", "1"]);
    fails(edits.update_mesh(&MeshUpdate::new(MeshId::from_index(1)).scaled(1.0)), &["mesh 1"]);
    fails(edits.update_mesh(&MeshUpdate::new(mesh).scaled(-1.0)), &["mesh 0", "-1"]);
    fails(edits.update_mesh(&MeshUpdate::new(mesh).moved(&QUAD, &[])), &["mesh 0", "0 triangles"]);
    fails(edits.add_mesh(&quad().weight(Weight::Texture(TextureId::from_index(0)))).map(drop), &["texture 0"]);
    fails(edits.add_mesh(&quad().weight(Weight::Constant(f32::NAN))).map(drop), &["NaN"]);
    fails(edits.remove_instance(InstanceId::from_index(2)), &["instance 2"]);
    let unknown = Instance::new(ObjectId::from_index(4), Affine3A::IDENTITY);
    fails(edits.add_instance(unknown).map(drop), &["object 4"]);
    fails(edits.set_instance(instance, unknown), &["object 4"]);
    fails(edits.set_instance(instance, Instance::new(lamp, Affine3A::from_scale(Vec3::ZERO))), &["instance 0"]);
    // After a removal, all is unknown.
    edits.remove_light(light).expect("the light is there");
    fails(edits.remove_light(light), &["light 0"]);
    fails(edits.set_light(light, bulb(1.0)), &["light 0"]);
    edits.remove_mesh(mesh).expect("the mesh is there");
    fails(edits.remove_mesh(mesh), &["mesh 0"]);
    fails(edits.update_mesh(&MeshUpdate::new(mesh).scaled(1.0)), &["mesh 0"]);
    edits.remove_instance(instance).expect("the instance is there");
    fails(edits.remove_instance(instance), &["instance 0"]);
    // What is removed in a batch is not given out again in it.
    assert_eq!(edits.add_light(bulb(1.0)), Ok(LightId::from_index(1)));
    assert_eq!(edits.add_mesh(&quad()), Ok(MeshId::from_index(1)));
    assert_eq!(edits.add_instance(Instance::new(lamp, Affine3A::IDENTITY)), Ok(InstanceId::from_index(1)));
    drop(edits);
    assert!(lights.to_bytes() == before, "a batch that was not applied has changed something");
    // A factor that is too large is known when the textures are built.
    let mut edits = lights.edit();
    let bright = edits.add_mesh(&quad().weight(Weight::Constant(1e20))).expect("the mesh is valid");
    edits.update_mesh(&MeshUpdate::new(bright).scaled(1e20)).expect("the factor is a number");
    fails(edits.apply(), &["mesh 1"]);
    assert!(lights.to_bytes() == before, "a batch that has failed has changed something");
}

#[test]
fn an_empty_scene_can_be_edited() {
    let mut lights = LightSampler::builder().build().expect("there is nothing to refuse");
    let x = ShadingPoint::volume(Vec3::ZERO);
    let mut edits = lights.edit();
    assert!(edits.remove_light(LightId::from_index(0)).is_err());
    assert!(edits.remove_mesh(MeshId::from_index(0)).is_err());
    assert!(
        edits
            .set_instance(InstanceId::from_index(0), Instance::new(ObjectId::from_index(0), Affine3A::IDENTITY))
            .is_err()
    );
    edits.apply().expect("nothing is valid");
    assert_eq!((lights.light_count(), lights.at(&x).sample([0.5; 3])), (0, None));
    let mut ids = Vec::new();
    for round in 0..3 {
        let mut edits = lights.edit();
        ids.clear();
        for i in 0..40 {
            ids.push(edits.add_light(bulb(i as f32)).expect("the light is valid"));
        }
        edits.add_light(DistantLight::new(Vec3::NEG_Z, 1.0)).expect("the light is valid");
        edits.apply().expect("the lights are few");
        assert_eq!(lights.light_count(), 41);
        let sum: f32 = ids.iter().map(|id| lights.at(&x).pmf_light(*id)).sum();
        assert!(sum > 0.0 && sum < 1.0 && lights.at(&x).irradiance() > 0.0, "{sum}");
        let mut edits = lights.edit();
        for id in ids.iter().chain([&LightId::from_index(40)]) {
            edits.remove_light(*id).expect("the light is there");
        }
        edits.apply().expect("the lights are few");
        assert_eq!((lights.light_count(), lights.at(&x).sample([0.5; 3])), (0, None), "{round}");
        let words = aligned(&lights.to_bytes());
        let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        assert_eq!(loaded.light_count(), 0);
    }
}

/// Places of what was removed are used again. Trees over textures wait to be removed until they are as many as those
/// that were in use, and some hundred kilobytes more.
#[test]
fn memory_is_bounded() {
    for kind in [7, KINDS + 7] {
        check_memory(kind);
    }
}

fn check_memory(kind: usize) {
    let mut pcg = Pcg32::new(3, 77);
    let mut world = World::random(&mut pcg, kind, 200);
    let mut lights = world.build().lights;
    let mut most_trees = 0;
    for round in 1..=100 {
        let mut edit = lights.edit();
        for _ in 0..60 {
            world.edit(&mut edit, [0; 3].map(|_| pcg.u32() as u16), &mut pcg).expect("the edit is valid");
        }
        world.shrink_to(&mut edit, 150).expect("the lights are there");
        edit.apply().expect("the lights are few");
        if round % 10 == 0 {
            let words = aligned(&lights.to_bytes());
            let written =
                LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load").bytes();
            let (bytes, fresh) = (lights.bytes(), world.build().lights.bytes());
            let without_trees = |bytes: fanlight::ByteSizes| bytes.total() - bytes.texture_trees;
            let [own, new, least] = [bytes, fresh, written].map(without_trees);
            assert!(own < 3 * new + 50_000, "{own} bytes after {round} rounds, but {new} of a fresh build");
            assert!(least < 2 * new, "{least} bytes written after {round} rounds, but {new} of a fresh build");
            let [own, live] = [bytes, written].map(|bytes| bytes.texture_trees);
            most_trees = most_trees.max(live);
            assert!(own < 3 * most_trees + 400_000, "{own} bytes of trees after {round} rounds, but {live} are in use");
        }
    }
    compare(&world, &lights, &mut pcg).expect("the lights are those of a fresh build");
}

/// The places of removed meshes go to new ones that need at least half of them: those of the last one that was removed
/// first. What a batch takes is not given out twice, and what it takes without being applied stays free.
#[test]
fn the_places_of_the_last_mesh_that_was_removed_are_the_next() {
    let mesh = MeshId::from_index;
    let mut builder = LightSampler::builder();
    let triple = Mesh::emitter(&QUAD, &[[0, 1, 2]; 3]);
    for number in 0..12 {
        builder.add_mesh(&if number < 10 { quad() } else { triple }).expect("the mesh is valid");
    }
    let mut lights = builder.build().expect("the lights are few");
    let remove = |lights: &mut LightSampler, numbers: &[u32]| {
        let mut edits = lights.edit();
        numbers.iter().for_each(|&number| edits.remove_mesh(mesh(number)).expect("the mesh is there"));
        edits.apply().expect("nothing is added");
    };
    // One batch frees its numbers in ascending order, whatever the order of the calls: the last one is used first.
    remove(&mut lights, &[9, 2, 5]);
    remove(&mut lights, &[3]);
    for is_applied in [false, true] {
        let mut edits = lights.edit();
        for number in [3, 9, 5, 2, 12, 13] {
            assert_eq!(edits.add_mesh(&quad()), Ok(mesh(number)));
        }
        if is_applied {
            edits.remove_mesh(mesh(5)).expect("it was added before");
            assert_eq!(edits.add_mesh(&quad()), Ok(mesh(14)));
            edits.apply().expect("the lights are few");
        }
    }
    assert_eq!(lights.light_count(), 12 + 2 * 2 + 3 - 1);
    // Three places are enough for two triangles, but not known to be for three.
    remove(&mut lights, &[10, 0]);
    let mut edits = lights.edit();
    assert_eq!(edits.add_mesh(&triple), Ok(mesh(15)));
    assert_eq!(edits.add_mesh(&Mesh::emitter(&QUAD, &[[0, 1, 2]; 2])), Ok(mesh(10)));
    assert_eq!(edits.add_mesh(&quad()), Ok(mesh(0)));
    assert_eq!(edits.add_mesh(&quad()), Ok(mesh(5)));
    assert_eq!(edits.add_mesh(&quad()), Ok(mesh(16)));
    edits.apply().expect("the lights are few");
    assert_eq!(lights.light_count(), 18 - 4 + 3 + 2 + 3);
}

#[test]
fn an_edited_sampler_can_be_refitted() {
    let mut builder = LightSampler::builder();
    let ids = [0.0, 1.0, 2.0].map(|x| builder.add_light(bulb(x)).expect("the light is valid"));
    let mesh = builder.add_mesh(&quad()).expect("the mesh is valid");
    let mut lights = builder.build().expect("the lights are few");
    let mut edits = lights.edit();
    edits.remove_light(ids[1]).expect("the light is there");
    edits.apply().expect("the lights are few");
    assert!(lights.refit_lights(&[(ids[1], bulb(4.0).into())]).is_err());
    lights.refit_lights(&[(ids[2], bulb(4.0).into())]).expect("the light is there");
    lights.refit(&[MeshUpdate::new(mesh).scaled(0.0)]).expect("the mesh is there");
    let at = lights.at(&ShadingPoint::volume(Vec3::new(4.0, 0.0, 1.0)));
    let sample = at.sample([0.5; 3]).expect("the bulb is near");
    assert_eq!(sample.light, SampledLight::Shape(ids[2]));
    assert!((sample.position.x - 4.0).abs() < 0.2 && at.pmf(fanlight::TriangleId::new(mesh, 0)) == 0.0);
    assert!((lights.decay() - 1.0).abs() < 10.0);
}
