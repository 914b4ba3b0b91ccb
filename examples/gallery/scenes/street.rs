//! A street at night: luminaires with a diagram, garlands of bulbs, and the moon.

use core::f32::consts::{FRAC_PI_2, PI};
use glam::{Vec3, vec3};

use super::alloc::sync::Arc;
use crate::render::{Camera, Diagram, Fog, Lamp, LampKind, Lobe, Material, Mesh, Model};

/// Half the width of the roadway.
const CURB: f32 = 4.0;
/// Where houses begin.
const FRONT: f32 = 6.5;
/// Length of the street.
const LENGTH: f32 = 64.0;
/// Luminaires of each side.
const LAMPS: u16 = 10;
/// Garlands across the street, and bulbs of each.
const GARLANDS: u16 = 12;
const BULBS: u16 = 15;

pub(crate) fn street() -> Model {
    let mut model = Model::new(Camera::looking(vec3(1.4, 1.7, 1.0), vec3(-0.4, 2.0, -14.0), 62.0), None);
    add_houses(&mut model);
    add_lamps(&mut model);
    add_garlands(&mut model);
    // Half a degree across, above the end of the street.
    let moon = LampKind::Distant(-vec3(-0.08, 0.42, -0.9).normalize(), 0.0045);
    model.lamps.push(Lamp { kind: moon, strength: vec3(0.035, 0.045, 0.06) });
    model
}

/// The [`street`] in thin fog.
pub(crate) fn foggy_street() -> Model {
    let mut model = street();
    model.fog = Some(Fog { low: vec3(-FRONT, 0.0, -LENGTH), high: vec3(FRONT, 8.0, 4.0), density: 0.015 });
    model
}

/// Ground, houses, and what stands around.
fn add_houses(model: &mut Model) {
    let slab = |mesh: Mesh, from: f32, to: f32, height: f32| {
        mesh.block(vec3(0.5 * (from + to), height - 0.5, 4.0 - 0.5 * LENGTH), vec3(to - from, 1.0, LENGTH + 8.0), 0.0)
    };
    let road = model.material(Material::new("asphalt", Vec3::splat(0.18)));
    model.add(slab(road, -CURB, CURB, 0.0));
    let pavement = model.material(Material::new("pavement", Vec3::splat(0.4)));
    model.add(slab(slab(pavement, -FRONT, -CURB, 0.12), CURB, FRONT, 0.12));
    let colors = [vec3(0.5, 0.35, 0.28), vec3(0.55, 0.5, 0.42), vec3(0.4, 0.42, 0.45)];
    let mut houses = colors.map(|color| model.material(Material::new("house", color)));
    for house in 0..16_u16 {
        let (side, number) = (if house.is_multiple_of(2) { 1.0 } else { -1.0 }, house / 2);
        let height = 7.0 + f32::from((house * 7) % 5);
        let center = vec3(side * (FRONT + 3.0), 0.5 * height, 4.0 - 9.0 * (f32::from(number) + 0.5));
        let mesh = &mut houses[usize::from(house % 3)];
        *mesh = core::mem::take(mesh).block(center, vec3(6.0, height, 9.0), 0.0);
        for floor in 0..3_u16 {
            for window in 0..3_u16 {
                // Reveals and sills.
                let at =
                    center + vec3(-side * 3.0, 2.0 + 2.3 * f32::from(floor) - center.y, 3.0 * f32::from(window) - 3.0);
                *mesh = core::mem::take(mesh).block(at, vec3(0.3, 0.12, 1.5), 0.0);
            }
        }
    }
    houses.into_iter().for_each(|mesh| model.add(mesh));
    let end = model.material(Material::new("end", Vec3::splat(0.45)));
    model.add(end.block(vec3(0.0, 5.0, -LENGTH - 1.0), vec3(13.0, 10.0, 2.0), 0.0));
    let mut cars = model.material(Material::new("car", vec3(0.25, 0.05, 0.04)).lobe(Lobe::Glossy(20.0)));
    let mut bins = model.material(Material::new("bin", vec3(0.15, 0.25, 0.15)));
    for (number, side) in [(1_u16, -1.0), (2, 1.0), (3, 1.0), (5, -1.0), (7, 1.0)] {
        let z = -6.5 * f32::from(number);
        cars = cars.block(vec3(side * 2.9, 0.55, z), vec3(1.7, 0.7, 4.2), 0.0);
        cars = cars.block(vec3(side * 2.9, 1.15, z + 0.2), vec3(1.5, 0.55, 2.2), 0.0);
        bins = bins.block(vec3(-side * 5.6, 0.6, z + 3.0), vec3(0.6, 1.0, 0.6), 0.3);
    }
    model.add(cars);
    model.add(bins);
}

/// Luminaires on poles, which send most of their light along the street.
fn add_lamps(model: &mut Model) {
    let mut poles = model.material(Material::new("pole", Vec3::splat(0.12)));
    for side in [-1.0, 1.0] {
        let diagram = Arc::new(luminaire(-side));
        for number in 0..LAMPS {
            let foot = vec3(side * (CURB + 0.4), 0.0, -2.0 - 3.0 * side - 6.0 * f32::from(number));
            let head = foot + vec3(-0.9 * side, 5.2, 0.0);
            poles = poles.block(foot + 2.6 * Vec3::Y, vec3(0.1, 5.3, 0.1), 0.0);
            poles = poles.block(head + vec3(0.4 * side, 0.05, 0.0), vec3(1.3, 0.06, 0.25), 0.0);
            let kind = LampKind::Luminaire(head - 0.05 * Vec3::Y, diagram.clone());
            model.lamps.push(Lamp { kind, strength: 24.0 * vec3(1.0, 0.78, 0.5) });
        }
    }
    model.add(poles);
}

/// A diagram with a peak at 60 degrees to both sides, which sends little behind the pole. `across` is the side of the
/// road.
fn luminaire(across: f32) -> Diagram {
    let vertical: Vec<f32> = (0..=16_u16).map(|i| FRAC_PI_2 * f32::from(i) / 16.0).collect();
    let horizontal: Vec<f32> = (0..24_u16).map(|i| 2.0 * PI * f32::from(i) / 24.0).collect();
    let intensity = |vertical: f32, horizontal: f32| {
        let along = horizontal.sin().powi(2);
        let behind = if horizontal.cos() < 0.0 { 1.0 - 0.7 * horizontal.cos().powi(2) } else { 1.0 };
        let peak = (-((vertical - 1.05) / 0.25).powi(2)).exp();
        let cutoff = ((1.4 - vertical) / 0.2).clamp(0.0, 1.0);
        cutoff * behind * (0.35 + along * peak)
    };
    let rows = vertical.iter().flat_map(|&v| horizontal.iter().map(move |&h| intensity(v, h)));
    let intensities = rows.collect();
    Diagram { axis: Vec3::NEG_Y, zero: across * Vec3::X, vertical, horizontal, intensities }
}

/// Bulbs that hang across the street.
fn add_garlands(model: &mut Model) {
    let colors = [vec3(1.0, 0.6, 0.25), vec3(1.0, 0.25, 0.15), vec3(0.3, 0.9, 0.35), vec3(0.3, 0.5, 1.0)];
    let bulbs = colors.map(|color| model.material(Material::emitter("bulb", 25.0 * color)));
    for garland in 0..GARLANDS {
        for number in 0..BULBS {
            let across = 2.0 * (f32::from(number) + 0.5) / f32::from(BULBS) - 1.0;
            let center = vec3(0.95 * FRONT * across, 3.6 + 1.2 * across * across, -3.0 - 5.0 * f32::from(garland));
            model.add(bulbs[usize::from((garland + number) % 4)].clone().bulb(center, 0.05, 6));
        }
    }
}
