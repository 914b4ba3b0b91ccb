//! Noise has no steps where a lobe turns or narrows: the relative deviation of a sample, found
//! without samples from exact irradiances and the crate's probabilities.

use core::f32::consts::PI;

use fanlight::{LightId, LightSampler, ProfileId, ProfileLight, Receiver, ShadingPoint};
use glam::{DVec3, Vec3, vec3};

use super::{Placed, Table};
use crate::common::lights::ARITIES;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::tier::some;

/// Largest factor between the deviations at two neighboring steps: over all points, and at each of them.
const MOST: f64 = 1.5;
/// Largest factor at a single point between two scenes: a lamp that changes is at times put among others in the tree.
const MOST_REBUILT: f64 = 2.2;
/// Deviation below which nobody sees a difference.
const LEAST: f64 = 0.03;
/// Points that each step is seen from.
const POINTS: usize = 12;
/// Where the lamp is that changes.
const LAMP: Vec3 = vec3(0.3, 0.2, 2.5);

/// Lamps on a ceiling, each with its own direction and one of three wide profiles, which do not change.
const OTHERS: usize = 150;

/// A lobe of a half width in radians, in 24 rows: brightest at the axis, dark at its rim, and brighter on one side.
fn lobe(width: f32) -> Table {
    const ROWS: usize = 24;
    let vertical = (0..=ROWS).map(|i| width * i as f32 / ROWS as f32).collect();
    let horizontal = (0..6).map(|i| i as f32).collect();
    let value = |row: usize, column: usize| {
        let across = 1.0 - row as f32 / ROWS as f32;
        across * across * (1.0 + if row == 0 { 0.0 } else { 0.5 * (column as f32).cos() })
    };
    let intensities = (0..=ROWS).flat_map(|row| (0..6).map(move |column| value(row, column))).collect();
    Table { vertical, horizontal, intensities }
}

/// One step of a sweep: the first lamp's profile, place, axis and scale.
struct Step {
    table: Table,
    position: Vec3,
    axis: Vec3,
    scale: f32,
}

/// Points, and what the other lamps send to each.
struct Surroundings {
    points: Vec<ShadingPoint>,
    others: Vec<ProfileLight>,
    irradiances: Vec<Vec<f64>>,
}

impl Step {
    fn placed(&self) -> Placed<'_> {
        placed(&self.table, 0, self.position, self.axis, self.scale)
    }
}

/// Profiles of the other lamps, by turns.
fn wide() -> [Table; 3] {
    [lobe(PI), lobe(1.3), lobe(0.6)]
}

fn placed(table: &Table, profile: usize, position: Vec3, axis: Vec3, scale: f32) -> Placed<'_> {
    let z = axis.as_dvec3().normalize();
    let x = DVec3::X.reject_from(z).normalize();
    let lamp = ProfileLight::new(position, axis, ProfileId::from_index(profile as u32), scale).facing(Vec3::X);
    Placed { table, lamp, position, frame: [x, z.cross(x), z], scale: scale.into() }
}

impl Surroundings {
    fn new(points: Vec<ShadingPoint>) -> Self {
        let (tables, mut pcg) = (wide(), Pcg32::new(17, 185));
        let (mut others, mut irradiances) = (vec![], vec![vec![]; points.len()]);
        for i in 0..OTHERS {
            let position = vec3(pcg.within(-4.0, 4.0), pcg.within(-4.0, 4.0), 3.0);
            let mut axis = pcg.direction();
            axis.z = -axis.z.abs();
            let lamp = placed(&tables[i % 3], 1 + i % 3, position, axis, pcg.within(0.2, 2.0));
            irradiances.iter_mut().zip(&points).for_each(|(sum, x)| sum.push(lamp.irradiance(x)));
            others.push(lamp.lamp);
        }
        Self { points, others, irradiances }
    }

    fn build(&self, step: &Step, number: usize) -> LightSampler {
        let mut builder = LightSampler::builder().arity(ARITIES[number]);
        builder.add_profile(&step.table.profile()).expect("a valid profile");
        for table in wide() {
            builder.add_profile(&table.profile()).expect("a valid profile");
        }
        for lamp in [step.placed().lamp].iter().chain(&self.others) {
            builder.add_light(*lamp).expect("a valid lamp");
        }
        builder.build().expect("few lights")
    }

    /// Relative deviation of a sample at each point, and over all points by energy: by the choice of a lamp alone, as a
    /// lamp has no extent.
    fn deviations(&self, lights: &LightSampler, step: &Step) -> Vec<f64> {
        let first = step.placed();
        let (mut found, mut variances, mut energies) = (vec![], 0.0, 0.0);
        for (x, irradiances) in self.points.iter().zip(&self.irradiances) {
            let at = lights.at(x);
            let (mut total, mut squares) = (0.0, 0.0);
            for (i, exact) in [first.irradiance(x)].iter().chain(irradiances).enumerate() {
                let pmf = f64::from(at.pmf_light(LightId::from_index(i as u32)));
                // What rounds away at a rim is no noise that anybody sees.
                squares += if pmf > 0.0 { exact * exact / pmf } else { 0.0 };
                total += exact;
            }
            let variance = (squares - total * total).max(0.0);
            found.push((variance / (total * total)).sqrt());
            (variances, energies) = (variances + variance, energies + total * total);
        }
        found.push((variances / energies).sqrt());
        found
    }
}

fn points() -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(18, 185);
    (0..POINTS)
        .map(|i| {
            let position = vec3(pcg.within(-2.0, 2.0), pcg.within(-2.0, 2.0), 0.0);
            ShadingPoint::new(position, if i % 3 == 2 { Receiver::Volume } else { Receiver::Surface(Vec3::Z) })
        })
        .collect()
}

/// Deviations grow or fall by no more than [`MOST`] from one step to the next over all points, and by `most` at each.
fn check(what: &str, steps: usize, most: f64, deviations: impl Fn(usize) -> Vec<f64> + Sync) {
    let found: Vec<Vec<f64>> = parallel::map(steps + 1, deviations);
    let (mut of_all, mut of_each) = ((1.0, 0), (1.0, 0));
    for (i, pair) in found.windows(2).enumerate() {
        for (k, (before, after)) in pair[0].iter().zip(&pair[1]).enumerate() {
            let [before, after] = [before, after].map(|deviation| deviation.max(LEAST));
            let factor = (before / after).max(after / before);
            let largest = if k == POINTS { &mut of_all } else { &mut of_each };
            if factor > largest.0 {
                *largest = (factor, i);
            }
        }
    }
    let (least, largest) =
        found.iter().flatten().fold((f64::MAX, 0.0_f64), |(least, largest), d| (least.min(*d), largest.max(*d)));
    println!("{what}: deviations from {least:.3} to {largest:.3}, a step at most {of_all:.3?}, {of_each:.3?}");
    for ((factor, i), limit) in [(of_all, MOST), (of_each, most)] {
        assert!(factor <= limit, "{what}, step {i}: {factor}, from {:?} to {:?}", found[i], found[i + 1]);
    }
}

/// A sweep of the lamp, in a sampler of its own for each step.
fn check_lamp(what: &str, steps: usize, step: impl Fn(usize) -> Step + Sync) {
    let surroundings = Surroundings::new(points());
    for number in some(ARITIES.len()) {
        check(&format!("{what}, {number}"), steps, MOST_REBUILT, |i| {
            let step = step(i);
            surroundings.deviations(&surroundings.build(&step, number), &step)
        });
    }
}

/// A bright lobe turns from the ceiling over all points and to the ceiling again.
#[test]
fn a_lobe_that_turns_makes_no_steps() {
    const STEPS: usize = 240;
    let lobes = [(0.3, 60.0), (1.6, 20.0)];
    for (width, scale) in some(lobes.len()).into_iter().map(|i| lobes[i]) {
        check_lamp(&format!("turned, {width}"), STEPS, |i| {
            let (sin, cos) = (PI * i as f32 / STEPS as f32).sin_cos();
            Step { table: lobe(width), position: LAMP, axis: vec3(cos, 0.1, -sin), scale }
        });
    }
}

/// A lobe narrows from all directions until it counts as a cone, and from there to a ray.
#[test]
fn a_lobe_that_narrows_makes_no_steps() {
    let (from, to) = (PI, 0.02_f32);
    let steps = ((from / to).ln() / 0.02).ceil() as usize;
    check_lamp(&format!("narrowed from {from}"), steps, |i| {
        let width = from * (to / from).powf(i as f32 / steps as f32);
        Step { table: lobe(width), position: LAMP, axis: vec3(0.1, 0.0, -1.0), scale: 30.0 }
    });
}

/// A lamp with a lobe of 17 degrees comes down through the others on the ceiling, by steps of 2 % of its height.
#[test]
fn a_lamp_that_moves_makes_no_steps() {
    check_lamp("lowered", 150, |i| {
        let position = LAMP.with_z(6.0 * 0.98_f32.powi(i as i32));
        Step { table: lobe(0.3), position, axis: vec3(0.1, 0.0, -1.0), scale: 60.0 }
    });
}

/// Points that come to a lamp with a lobe of 17 degrees by 3 % of their distance.
#[test]
fn points_that_approach_a_lamp_make_no_steps() {
    const STEPS: usize = 150;
    let step = Step { table: lobe(0.3), position: LAMP, axis: vec3(0.1, 0.0, -1.0), scale: 60.0 };
    let axis = step.axis.normalize();
    let surroundings = |i: usize| {
        let mut pcg = Pcg32::new(19, 185);
        let distance = 3.0 * 0.97_f32.powi(i as i32);
        let point = |k: usize| {
            // In its lobe and around it.
            let aside = vec3(pcg.within(-0.4, 0.4), pcg.within(-0.4, 0.4), 0.0);
            let receiver = if k % 3 == 2 { Receiver::Volume } else { Receiver::Surface(Vec3::Z) };
            ShadingPoint::new(LAMP + distance * (axis + aside), receiver)
        };
        Surroundings::new((0..POINTS).map(point).collect())
    };
    for number in some(ARITIES.len()) {
        let lights = surroundings(0).build(&step, number);
        check(&format!("approached, {number}"), STEPS, MOST_REBUILT, |i| surroundings(i).deviations(&lights, &step));
    }
}

/// A lamp with a lobe of 17 degrees becomes brighter by 5 % at a time, until it outshines all others.
#[test]
fn a_lamp_that_brightens_makes_no_steps() {
    check_lamp("brightened", 150, |i| {
        let scale = 0.1 * 1.05_f32.powi(i as i32);
        Step { table: lobe(0.3), position: LAMP, axis: vec3(0.1, 0.0, -1.0), scale }
    });
}
