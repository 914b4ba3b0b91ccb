//! Edits of many distant lights, which are in no tree but in groups of like directions.

extern crate alloc;

use alloc::collections::BTreeMap;

use crate::common::hostile::hostile;
use crate::common::lights::sample_from_bytes;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::with_lobe;
use crate::common::tier::few;
use crate::kinds::pdf_again;
use fanlight::{
    DistantLight, Error, Lamp, LightEdits, LightId, LightSample, LightSampler, PointLight, PointSampler, Receiver,
    SampledLight, ShadingPoint, SphereLight,
};
use glam::Vec3;

/// Angular radii from none to all directions.
const RADII: [f32; 6] = [0.0, 0.0, 1e-4, 0.1, 1.5, core::f32::consts::PI];
/// Largest relative difference of two densities of one direction.
const TOLERANCE: f64 = 1e-5;

/// Kinds of skies: in all light groups or not, alone or among lights that have a place.
const KINDS: usize = 4;

/// A light as a sampler is told of it.
#[derive(Clone, Copy, Debug)]
struct Told {
    axis: Vec3,
    irradiance: f32,
    radius: f32,
    groups: u32,
    /// A light at a place, instead of a distant one.
    placed: Option<Vec3>,
}

/// The lights of a scene that is edited.
struct Sky {
    kind: usize,
    lights: BTreeMap<LightId, Told>,
}

fn close(a: f32, b: f32) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

impl Told {
    fn lamp(&self) -> Lamp {
        match self.placed {
            Some(at) if self.radius > 0.0 => SphereLight::new(at, 0.1, self.irradiance).into(),
            Some(at) => PointLight::new(at, self.irradiance).into(),
            None => DistantLight::new(self.axis, self.irradiance).angular_radius(self.radius).into(),
        }
    }
}

impl Sky {
    fn new(kind: usize, count: usize, pcg: &mut Pcg32) -> Self {
        let mut sky = Self { kind, lights: BTreeMap::new() };
        for number in 0..count as u32 {
            let told = sky.any(pcg);
            sky.lights.insert(LightId::from_index(number), told);
        }
        sky
    }

    fn any(&self, pcg: &mut Pcg32) -> Told {
        let groups = if self.kind % 2 == 1 && pcg.below(3) == 0 { 1 << pcg.below(3) } else { u32::MAX };
        let placed = self.kind / 2 == 1 && pcg.below(8) == 0;
        Told {
            axis: pcg.direction(),
            irradiance: brightness(pcg),
            radius: RADII[pcg.below(RADII.len())],
            groups,
            placed: placed.then(|| 4.0 * Vec3::from_array(pcg.cube()) - 2.0),
        }
    }

    fn build(&self) -> LightSampler {
        let mut builder = LightSampler::builder();
        for told in self.lights.values() {
            builder.add_light_to(told.groups, told.lamp()).expect("the light is valid");
        }
        builder.build().expect("the lights are few")
    }

    /// An id of a light that is there, if any is.
    fn known(&self, pcg: &mut Pcg32) -> Option<LightId> {
        self.lights.keys().nth(pcg.below(self.lights.len().max(1))).copied()
    }

    /// Makes a random edit, here and of a sampler. Ids of lights that are not there must be refused.
    fn edit(&mut self, edits: &mut LightEdits<'_, '_>, pcg: &mut Pcg32) {
        match pcg.below(8) {
            0 | 1 => {
                let told = self.any(pcg);
                let id = edits.add_light_to(told.groups, told.lamp()).expect("the light is valid");
                assert!(self.lights.insert(id, told).is_none(), "an id is given out twice");
            }
            2 | 3 => {
                let Some(id) = self.known(pcg) else { return };
                edits.remove_light(id).expect("the light is there");
                self.lights.remove(&id);
                if pcg.below(4) == 0 {
                    refused(edits.remove_light(id), id);
                }
            }
            // Anywhere, of another radius, and at times a light of another kind.
            4 => {
                let Some(id) = self.known(pcg) else { return };
                let told = Told { groups: self.lights[&id].groups, ..self.any(pcg) };
                self.set(edits, id, told);
            }
            // A little.
            5 => {
                let Some(id) = self.known(pcg) else { return };
                let told = self.lights[&id];
                self.set(edits, id, Told { axis: told.axis + 0.05 * pcg.direction(), ..told });
            }
            6 => {
                let Some(id) = self.known(pcg) else { return };
                let told = self.lights[&id];
                self.set(edits, id, Told { irradiance: brightness(pcg), ..told });
            }
            _ => {
                let id = LightId::from_index([pcg.below(600) as u32, u32::MAX, 1 << 27][pcg.below(3)]);
                if !self.lights.contains_key(&id) {
                    refused(edits.remove_light(id), id);
                    refused(edits.set_light(id, DistantLight::new(Vec3::Z, 1.0)), id);
                }
            }
        }
    }

    fn set(&mut self, edits: &mut LightEdits<'_, '_>, id: LightId, told: Told) {
        edits.set_light(id, told.lamp()).expect("the light is there");
        self.lights.insert(id, told);
    }
}

/// Zero for some, which are hidden.
fn brightness(pcg: &mut Pcg32) -> f32 {
    if pcg.below(10) == 0 { 0.0 } else { pcg.within(-6.0, 6.0).exp2() }
}

fn refused(result: Result<(), Error>, id: LightId) {
    let message = result.expect_err("there is no such light").to_string();
    assert!(message.starts_with(&format!("light {}", id.index())), "{message}");
}

fn point(kind: usize, pcg: &mut Pcg32) -> ShadingPoint {
    let normal = pcg.direction();
    let receiver = [Receiver::Volume, Receiver::Surface(normal), Receiver::Transmissive(normal)][kind % 3];
    let x = ShadingPoint::new(4.0 * Vec3::from_array(pcg.cube()) - 2.0, receiver);
    let x = if kind % 4 == 3 { with_lobe(x, pcg, 1e-2) } else { x };
    x.with_groups([u32::MAX, 1, 6, u32::MAX][kind / 3 % 4])
}

fn id_of(sample: &LightSample) -> LightId {
    match sample.light {
        SampledLight::Shape(id) | SampledLight::Punctual(id) => id,
        _ => panic!("another kind of light"),
    }
}

fn check_sample(at: &PointSampler<'_>, x: &ShadingPoint, sample: &LightSample) {
    let pdf = pdf_again(at, sample);
    assert!(close(pdf, sample.pdf), "{x:?} {sample:?}: {pdf}");
    let pmf = at.pmf_light(id_of(sample));
    assert!(close(pmf, sample.pmf), "{x:?} {sample:?}: {pmf}");
    let along = at.pdf_sample_direction(sample);
    assert!(along >= sample.pdf * (1.0 - TOLERANCE as f32) && along.is_finite(), "{x:?} {sample:?}: {along}");
}

/// Compares an edited sampler with a new build. Distant lights alone are sampled alike to the bit, as no tree of another
/// shape decides. Returns how many samples were drawn.
fn compare(sky: &Sky, lights: &LightSampler, pcg: &mut Pcg32) -> usize {
    let fresh = sky.build();
    assert_eq!(lights.light_count(), fresh.light_count());
    let ids: Vec<LightId> = sky.lights.keys().copied().collect();
    let is_alone = sky.kind / 2 == 0;
    let (mut queries, mut drawn) = (Vec::new(), 0);
    for kind in 0..12 {
        let x = point(kind, pcg);
        let (at, other) = (lights.at(&x), fresh.at(&x));
        let mut sum = 0.0;
        for (number, (id, told)) in (0..).zip(&sky.lights) {
            let [own, built] = [at.pmf_light(*id), other.pmf_light(LightId::from_index(number))];
            assert!(!is_alone || own.to_bits() == built.to_bits(), "{x:?} {told:?}: {own}, but {built} of a new build");
            assert!((own > 0.0) == (built > 0.0), "{x:?} {told:?}: {own}, but {built} of a new build");
            let is_received = told.groups & x.groups != 0 && told.irradiance > 0.0;
            assert!(is_received || own == 0.0, "{x:?} {told:?}: {own}");
            sum += f64::from(own);
        }
        // In a volume all distant lights are received, if they are in the right light groups. From a surface all may be
        // below, and a cluster of placed lights may turn out to be dark.
        let is_whole = is_alone && kind % 3 == 0 && kind % 4 < 3;
        let least = if is_whole { 1.0 - 1e-4 } else { 0.0 };
        let any = sky.lights.values().any(|told| told.groups & x.groups != 0 && told.irradiance > 0.0);
        assert!(sum < 1.0 + 1e-4 && (!any || sum >= least), "{x:?}: {sum}");
        for _ in 0..20 {
            let u = core::array::from_fn(|_| hostile(pcg));
            queries.push((x, u));
            let (sample, new) = (at.sample(u), other.sample(u));
            if let Some(sample) = &sample {
                check_sample(&at, &x, sample);
                drawn += 1;
            }
            if is_alone {
                let number = |sample: &LightSample| ids.binary_search(&id_of(sample)).expect("the light is there");
                let own = sample.as_ref().map(|sample| (number(sample), sample.direction, sample.pdf, sample.pmf));
                let index = |sample: &LightSample| id_of(sample).index() as usize;
                let built = new.as_ref().map(|sample| (index(sample), sample.direction, sample.pdf, sample.pmf));
                assert_eq!(own, built, "{x:?}");
            }
        }
    }
    let own: Vec<_> = queries.iter().map(|(x, u)| lights.at(x).sample(*u)).collect();
    assert_eq!(own, sample_from_bytes(lights, &queries));
    drawn
}

/// Batches of any size that add, remove, move, widen, recolor and hide distant lights, and ids of no light among them.
#[test]
fn edits_of_many_distant_lights_leave_those_of_a_new_build() {
    let counts = [300, 33, 0];
    let rounds = few(49 * counts.len() * KINDS);
    let drawn = parallel::map(rounds.len(), |i| {
        let number = rounds[i];
        let mut pcg = Pcg32::new(number as u64, 79);
        let mut sky = Sky::new(number % KINDS, counts[number / KINDS % counts.len()], &mut pcg);
        let mut lights = sky.build();
        let mut drawn = compare(&sky, &lights, &mut pcg);
        for size in [1, 4, 150, 20, 400, 2] {
            let mut edits = lights.edit();
            for _ in 0..size {
                sky.edit(&mut edits, &mut pcg);
            }
            edits.apply().expect("the lights are few");
            drawn += compare(&sky, &lights, &mut pcg);
        }
        drawn
    });
    assert!(drawn.iter().sum::<usize>() > 500 * rounds.len(), "{drawn:?}");
}

/// Whatever is wrong with edits of distant lights is an error that names the light, and changes nothing.
#[test]
fn mistakes_with_distant_lights_are_errors() {
    let mut pcg = Pcg32::new(1, 80);
    let mut sky = Sky::new(0, 300, &mut pcg);
    let mut lights = sky.build();
    drop(lights.edit());
    let before = lights.to_bytes();
    let id = LightId::from_index;
    let valid = DistantLight::new(Vec3::Z, 1.0);
    let mut edits = lights.edit();
    for unknown in [300, 301, 1 << 27, u32::MAX] {
        refused(edits.remove_light(id(unknown)), id(unknown));
        refused(edits.set_light(id(unknown), valid), id(unknown));
    }
    for wrong in [
        DistantLight::new(Vec3::ZERO, 1.0),
        DistantLight::new(Vec3::new(f32::NAN, 0.0, 1.0), 1.0),
        DistantLight::new(Vec3::Z, -1.0),
        DistantLight::new(Vec3::Z, f32::NAN),
        DistantLight::new(Vec3::Z, f32::INFINITY),
        valid.angular_radius(-0.1),
        valid.angular_radius(1e-6),
        valid.angular_radius(3.2),
        valid.angular_radius(f32::NAN),
    ] {
        refused(edits.set_light(id(7), wrong), id(7));
        refused(edits.add_light(wrong).map(drop), id(300));
    }
    // Removed twice, changed after it is removed, and added after all.
    edits.remove_light(id(3)).expect("the light is there");
    refused(edits.remove_light(id(3)), id(3));
    refused(edits.set_light(id(3), valid), id(3));
    assert_eq!(edits.add_light(valid), Ok(id(300)));
    edits.remove_light(id(300)).expect("it was added before");
    refused(edits.remove_light(id(300)), id(300));
    assert_eq!(edits.add_light(valid), Ok(id(301)));
    drop(edits);
    assert!(lights.to_bytes() == before, "a batch that was not applied has changed something");

    // What was removed in a batch is unknown in the next one, and its number is given out again.
    let mut edits = lights.edit();
    edits.remove_light(id(3)).expect("the light is there");
    edits.apply().expect("nothing is added");
    sky.lights.remove(&id(3));
    compare(&sky, &lights, &mut pcg);
    let mut edits = lights.edit();
    refused(edits.remove_light(id(3)), id(3));
    let told = Told { axis: Vec3::Z, irradiance: 1.0, radius: 0.0, groups: u32::MAX, placed: None };
    assert_eq!(edits.add_light(told.lamp()), Ok(id(3)));
    sky.lights.insert(id(3), told);
    // The last word on a light counts: there and back, as a light of another kind and hidden in between.
    edits.set_light(id(5), PointLight::new(Vec3::Z, 1.0)).expect("the light is there");
    edits.set_light(id(5), DistantLight::new(Vec3::X, 0.0)).expect("the light is there");
    edits.set_light(id(5), sky.lights[&id(5)].lamp()).expect("the light is there");
    edits.apply().expect("the lights are few");
    compare(&sky, &lights, &mut pcg);

    // All go, and all come back.
    let mut edits = lights.edit();
    sky.lights.keys().for_each(|id| edits.remove_light(*id).expect("the light is there"));
    edits.apply().expect("nothing is added");
    assert_eq!((lights.light_count(), lights.at(&ShadingPoint::volume(Vec3::ZERO)).sample([0.5; 3])), (0, None));
    let mut edits = lights.edit();
    for (id, told) in &sky.lights {
        assert_eq!(edits.add_light(told.lamp()), Ok(*id));
    }
    edits.apply().expect("the lights are few");
    compare(&sky, &lights, &mut pcg);
}
