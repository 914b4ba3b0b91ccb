//! The bits of samples and densities at fixed seeds: whoever changes one should have meant to.
//!
//! `GOLDEN=write cargo test golden` writes down what is found. Angles come from the system's library of functions or,
//! without `std`, from `libm`, so that there is a list for each, and they hold for the system that they were made on.
use std::path::Path;

use crate::common::hostile::{random_scene, shading_point, shading_point_with_lobe, shading_point_with_microfacets};
use crate::common::lights::{ARITIES, build, sample_from_bytes, sample_split};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Scene, random_point};
use crate::edits::edited;
use crate::groups::scene as grouped;
use crate::instances;
use crate::instances::town::Town;
use crate::kinds::{mixed, pdf_again};
use crate::motion::shutter::Moving;
use crate::projections::projectors;
use fanlight::{
    Effort, LightSample, LightSampler, MeshId, RaySegment, ShadingPoint, Splitting, TriangleId, Visibility,
};
use glam::Vec3;

const SCENES: usize = 70;
const POINTS: usize = 60;
/// Scenes that mix all kinds of lights.
const KINDS: usize = 12;
/// Scenes with light groups, profiles and distant lights.
const GROUPS: usize = 6;
/// Scenes with learned visibility.
const LEARNED: usize = 6;
/// Scenes of instances.
const TOWNS: usize = 12;
/// Scenes that are sampled with the least effort.
const LEAST: usize = 12;
/// Scenes that move.
const MOVING: usize = 6;

const LIST: &str = if cfg!(feature = "std") { "std.txt" } else { "libm.txt" };
/// Scenes at points with microfacets, after those at points with lobes.
const MICROFACETS: usize = 20;
/// Scenes with projections.
const PROJECTIONS: usize = 6;
/// Scenes that are edited.
const EDITED: usize = 12;

/// List of the scenes at points with lobes.
const LOBES: &str = if cfg!(feature = "std") { "lobes-std.txt" } else { "lobes-libm.txt" };

/// FNV-1a over the bits of numbers.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, values: &[f32]) {
        for byte in values.iter().flat_map(|value| value.to_bits().to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    fn add_sample(&mut self, sample: &LightSample) {
        let id = sample.hit().expect("a triangle").triangle;
        self.add(&[f32::from_bits(id.mesh.index()), f32::from_bits(id.triangle)]);
        self.add(&sample.hit().expect("a triangle").barycentrics);
        [sample.position, sample.normal, sample.direction].iter().for_each(|v| self.add(&v.to_array()));
        self.add(&[sample.distance, sample.pdf, sample.pdf_area, sample.pmf]);
    }
}

/// What is asked at one point; the number of samples that were drawn.
fn ask(lights: &LightSampler, x: &ShadingPoint, pcg: &mut Pcg32, hash: &mut Hash) -> usize {
    let at = lights.at(x);
    let splitting = Splitting::new(0.7, 2);
    let u = pcg.cube();
    let split = sample_split(&lights.at(x), u, &splitting);
    let single = at.sample(u);
    for sample in single.iter().chain(split.iter().take(8)) {
        hash.add_sample(sample);
        hash.add(&[
            at.pdf(&sample.hit().expect("a triangle")),
            at.pmf(sample.hit().expect("a triangle").triangle),
            lights.at(x).pdf_split(&sample.hit().expect("a triangle"), &splitting),
        ]);
        hash.add(&[at.pdf_direction(sample.direction), at.pdf_sample_direction(sample)]);
    }
    hash.add(&[at.pdf_direction(pcg.direction()), at.pmf(TriangleId::new(MeshId::from_index(0), 0))]);
    usize::from(single.is_some()) + split.len()
}

/// The environment's own samples.
fn ask_environment(scene: &Scene, pcg: &mut Pcg32, hash: &mut Hash) {
    let environment = scene.environment();
    for _ in 0..POINTS {
        if let Some(sample) = environment.sample([pcg.f32(), pcg.f32()]) {
            hash.add(&sample.direction.to_array());
            hash.add(&[sample.pdf, sample.radiance, environment.pdf(sample.direction)]);
        }
    }
}

/// One line about one scene.
fn line(number: usize, make: fn(usize, &Scene, &mut Pcg32) -> ShadingPoint) -> String {
    let mut pcg = Pcg32::new(number as u64, 81);
    let scene = random_scene(number, &mut pcg);
    let arity = ARITIES[number % ARITIES.len()];
    let lights = build(&scene, arity);
    let mut hash = Hash::new();
    let mut drawn = 0;
    let points: Vec<_> = (0..POINTS).map(|i| make(number + i, &scene, &mut pcg)).collect();
    for x in &points {
        drawn += ask(&lights, x, &mut pcg, &mut hash);
    }
    let queries: Vec<_> = points.iter().map(|x| (*x, pcg.cube())).collect();
    sample_from_bytes(&lights, &queries).iter().flatten().for_each(|sample| hash.add_sample(sample));
    ask_environment(&scene, &mut pcg, &mut hash);
    format!("{number:2} {:2}/ 4 {drawn:5} {:016x} {}\n", arity.lanes(), hash.0, scene.name)
}

/// One line about a scene that mixes all kinds of lights.
fn line_of_kinds(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 82);
    let (lights, _) = mixed(&mut pcg, number);
    let splitting = Splitting::new(0.7, 2);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    let emission = lights.emission();
    for i in 0..POINTS {
        let x = random_point(&mut pcg, i);
        let at = lights.at(&x);
        let u = pcg.cube();
        for sample in at.sample(u).iter().chain(sample_split(&at, u, &splitting).iter().take(8)) {
            drawn += 1;
            let id = sample.light.id().map_or(u32::MAX, |id| id.index());
            hash.add(&[f32::from_bits(id), sample.distance, sample.pdf, sample.pdf_area, sample.pmf]);
            [sample.position, sample.normal, sample.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[pdf_again(&at, sample), at.pdf_direction(sample.direction), at.pdf_sample_direction(sample)]);
        }
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            [ray.position, ray.normal, ray.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[ray.pdf, ray.pmf, emission.pdf_ray(x.position, pcg.direction())]);
        }
    }
    format!("{number:2} kinds {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene with light groups, profiles and distant lights, and about distances along rays in it.
fn line_of_groups(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 83);
    let (lights, _) = grouped(number, &mut pcg);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    let emission = lights.emission().within(Vec3::ONE, 4.0);
    for i in 0..POINTS {
        let x = random_point(&mut pcg, i).with_groups([1, 6, u32::MAX][i % 3]);
        let at = lights.at(&x);
        if let Some(sample) = at.sample(pcg.cube()) {
            drawn += 1;
            let id = sample.light.id().map_or(u32::MAX, |id| id.index());
            hash.add(&[f32::from_bits(id), sample.distance, sample.pdf, sample.pdf_area, sample.pmf]);
            [sample.position, sample.normal, sample.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[pdf_again(&at, &sample), at.pdf_direction(sample.direction), at.pdf_sample_direction(&sample)]);
        }
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            [ray.position, ray.normal, ray.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[ray.pdf, ray.pmf, emission.pdf_ray(x.position, pcg.direction())]);
        }
        let segment = RaySegment::new(x.position, pcg.direction(), 1.0 + pcg.f32(), [0.0, 0.5][i % 2]);
        let along = lights.along(&segment.with_groups(x.groups));
        if let Some(sample) = along.sample([pcg.f32(), pcg.f32(), pcg.f32(), pcg.f32()]) {
            hash.add(&[sample.distance, sample.pdf_distance, sample.light.pdf, along.pdf_distance(0.5)]);
        }
    }
    format!("{number:2} groups {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene with learned visibility: the table as well as samples.
fn line_of_learned(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 83);
    let scene = random_scene(number + 1, &mut pcg);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let point = |i: u64| random_point(&mut Pcg32::new(i, 84), i as usize);
    let seen =
        |x: &ShadingPoint, sample: &LightSample| f32::from(u8::from((x.position.x > 0.5) == (sample.position.x > 0.5)));
    let table = Visibility::learn(&lights.as_view(), 2000, point, seen).expect("nobody cancels");
    let view = lights.with_visibility(&table).expect("it was learned here");
    let (mut hash, mut drawn) = (Hash::new(), 0);
    table.to_bytes().chunks_exact(4).for_each(|word| hash.add(&[bytemuck::pod_read_unaligned(word)]));
    for i in 0..POINTS {
        let x = random_point(&mut pcg, i);
        let at = view.at(&x);
        if let Some(sample) = at.sample(pcg.cube()) {
            drawn += 1;
            hash.add_sample(&sample);
            hash.add(&[at.pdf(&sample.hit().expect("a triangle")), at.pdf_sample_direction(&sample)]);
        }
    }
    format!("{number:2} learned {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene that is sampled with the least effort.
fn line_of_least(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 85);
    let scene = random_scene(number, &mut pcg);
    let lights = build(&scene, ARITIES[number % ARITIES.len()]);
    let mut hash = Hash::new();
    let points = (0..POINTS).map(|i| shading_point(number + i, &scene, &mut pcg).with_effort(Effort::Least));
    let points: Vec<_> = points.collect();
    let drawn: usize = points.iter().map(|x| ask(&lights, x, &mut pcg, &mut hash)).sum();
    format!("{number:2} least {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene of instances.
fn line_of_town(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 83);
    let town = Town::random(&mut pcg, number % 5, number % 2 == 0, number % 5);
    let lights = town.build(ARITIES[number % 3]);
    let splitting = Splitting::new(0.7, 2);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    let emission = lights.emission();
    for i in 0..POINTS {
        let x = instances::point(&town, &mut pcg, i);
        let at = lights.at(&x);
        let u = pcg.cube();
        for sample in at.sample(u).iter().chain(sample_split(&at, u, &splitting).iter().take(8)) {
            drawn += 1;
            let hit = sample.hit().expect("a triangle");
            hash.add(&[f32::from_bits(hit.instance.map_or(u32::MAX, |instance| instance.index()))]);
            hash.add_sample(sample);
            hash.add(&[at.pdf(&hit), at.pdf_direction(sample.direction), at.pdf_sample_direction(sample)]);
        }
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            [ray.position, ray.normal, ray.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[ray.pdf, ray.pmf, emission.pdf_ray(x.position, pcg.direction())]);
        }
    }
    format!("{number:2} instances {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene that moves.
fn line_of_motion(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 85);
    let moving = Moving::random(&mut pcg, number, number % 2 == 0, number % 5);
    let lights = moving.build(ARITIES[number % 3]);
    let splitting = Splitting::new(0.7, 2);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    for i in 0..POINTS {
        let time = pcg.f32();
        let x = instances::point(&moving.start, &mut pcg, i).at_time(time);
        let at = lights.at(&x);
        let u = pcg.cube();
        for sample in at.sample(u).iter().chain(sample_split(&at, u, &splitting).iter().take(8)) {
            drawn += 1;
            let hit = sample.hit().expect("a triangle");
            hash.add(&[f32::from_bits(hit.instance.map_or(u32::MAX, |instance| instance.index()))]);
            hash.add_sample(sample);
            hash.add(&[at.pdf(&hit), at.pdf_direction(sample.direction), at.pdf_sample_direction(sample)]);
        }
        let emission = lights.emission().at_time(time);
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            [ray.position, ray.normal, ray.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[ray.pdf, ray.pmf, emission.pdf_ray(x.position, pcg.direction())]);
        }
        let along = lights.along(&RaySegment::new(x.position, pcg.direction(), 2.0, 0.3).at_time(time));
        if let Some(sample) = along.sample([pcg.f32(), pcg.f32(), pcg.f32(), pcg.f32()]) {
            hash.add(&[sample.distance, sample.pdf_distance, sample.light.pdf, along.pdf_distance(0.5)]);
        }
    }
    format!("{number:2} motion {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene of projectors.
fn line_of_projections(number: usize) -> String {
    let mut pcg = Pcg32::new(number as u64, 83);
    let lights = projectors(number, &mut pcg);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    let emission = lights.emission();
    for i in 0..POINTS {
        let x = random_point(&mut pcg, i);
        let at = lights.at(&x);
        if let Some(sample) = at.sample(pcg.cube()) {
            drawn += 1;
            let id = sample.light.id().map_or(u32::MAX, |id| id.index());
            hash.add(&[f32::from_bits(id), sample.distance, sample.pdf, sample.pmf, pdf_again(&at, &sample)]);
        }
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            hash.add(&ray.direction.to_array());
            hash.add(&[ray.pdf, ray.pmf]);
        }
    }
    format!("{number:2} projections {drawn:5} {:016x}\n", hash.0)
}

/// One line about a scene that is edited.
fn line_of_edited(number: usize) -> String {
    let (_, lights) = edited(number as u64, number, 30);
    let mut pcg = Pcg32::new(number as u64, 83);
    let splitting = Splitting::new(0.7, 2);
    let (mut hash, mut drawn) = (Hash::new(), 0);
    let emission = lights.emission();
    hash.add(&[lights.decay()]);
    for i in 0..POINTS {
        let x = random_point(&mut pcg, i);
        let at = lights.at(&x);
        let u = pcg.cube();
        for sample in at.sample(u).iter().chain(sample_split(&at, u, &splitting).iter().take(8)) {
            drawn += 1;
            let id = sample.light.id().map_or(u32::MAX, |id| id.index());
            hash.add(&[f32::from_bits(id), sample.distance, sample.pdf, sample.pdf_area, sample.pmf]);
            [sample.position, sample.normal, sample.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[at.pdf_direction(sample.direction), at.pdf_sample_direction(sample)]);
        }
        if let Some(ray) = emission.sample(core::array::from_fn(|_| pcg.f32())) {
            [ray.position, ray.normal, ray.direction].iter().for_each(|v| hash.add(&v.to_array()));
            hash.add(&[ray.pdf, ray.pmf, emission.pdf_ray(x.position, pcg.direction())]);
        }
    }
    format!("{number:2} edited {drawn:5} {:016x}\n", hash.0)
}

#[test]
fn samples_and_densities_are_those_of_before() {
    compare(LIST, false);
}

#[test]
fn samples_and_densities_of_lobes_are_those_of_before() {
    compare(LOBES, true);
}

/// Lines by their number.
type Lines = Box<dyn Fn(usize) -> String + Sync>;

/// What is listed after the random scenes: how many lines, and each.
fn more() -> [(usize, Lines); 8] {
    [
        (KINDS, Box::new(line_of_kinds)),
        (GROUPS, Box::new(line_of_groups)),
        (LEARNED, Box::new(line_of_learned)),
        (TOWNS, Box::new(line_of_town)),
        (LEAST, Box::new(line_of_least)),
        (MOVING, Box::new(line_of_motion)),
        (PROJECTIONS, Box::new(line_of_projections)),
        (EDITED, Box::new(line_of_edited)),
    ]
}

fn compare(list: &str, has_lobes: bool) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(list);
    let random = |first, shading_point| Box::new(move |i| line(first + i, shading_point)) as Lines;
    let mut lists = vec![(SCENES, random(0, if has_lobes { shading_point_with_lobe } else { shading_point }))];
    if has_lobes {
        lists.push((MICROFACETS, random(SCENES, shading_point_with_microfacets)));
    } else {
        lists.extend(more());
    }
    let all: Vec<_> = lists.iter().flat_map(|(count, line)| (0..*count).map(move |i| (line, i))).collect();
    let found = parallel::map(all.len(), |k| all[k].0(all[k].1)).concat();
    if std::env::var("GOLDEN").is_ok_and(|value| value == "write") {
        std::fs::write(&path, found).expect("the list can be written");
        panic!("{} is written, and nothing was compared", path.display());
    }
    let known = std::fs::read_to_string(&path).expect("the list can be read");
    let differing: Vec<_> = found.lines().zip(known.lines()).filter(|(found, known)| found != known).collect();
    assert!(differing.is_empty(), "found and known: {differing:#?}");
    assert_eq!(found.lines().count(), known.lines().count());
}
