//! A town at night: one street lamp and three windows, each of which stands in some thousand places.

use core::f32::consts::FRAC_PI_2;

use glam::{Affine3A, Quat, Vec2, Vec3, Vec4, vec3};

use super::alloc::sync::Arc;
use crate::render::{Bitmap, Camera, Copies, Material, Mesh, Model};

/// Houses of each row.
const HOUSES: u32 = 18;
/// From the middle of a street to that of the next one.
const PITCH: f32 = 20.0;
/// Half the width of a house.
const HALF: f32 = 6.5;
/// Distance of lamps from the middle of the street.
const LAMP_LINE: f32 = 2.6;
/// Lamps beside each house.
const LAMPS: u32 = 6;
/// Windows of each floor of a wall.
const COLUMNS: u32 = 4;

pub(crate) fn town() -> Model {
    let mut model = Model::new(Camera::looking(vec3(0.9, 2.6, 9.0), vec3(-0.6, 1.8, -12.0), 62.0), None);
    let half = 0.5 * PITCH * HOUSES as f32;
    let ground = model.material(Material::new("ground", vec3(0.35, 0.34, 0.33)));
    model.add(ground.quad(vec3(-half, 0.0, -half), Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half));
    add_houses(&mut model);
    add_lamps(&mut model);
    model
}

/// Returns a model with every copy as triangles of its own.
pub(crate) fn flattened(model: &Model) -> Model {
    let mut model = model.clone();
    model.meshes.iter_mut().for_each(|mesh| mesh.copies = None);
    model
}

/// Middle of a house, on the ground.
fn house(i: u32, j: u32) -> Vec3 {
    let at = |number: u32| PITCH * (number as f32 + 0.5 - 0.5 * HOUSES as f32);
    vec3(at(i), 0.0, at(j))
}

/// Numbers of all houses.
fn houses() -> impl Iterator<Item = (u32, u32)> {
    (0..HOUSES * HOUSES).map(|number| (number % HOUSES, number / HOUSES))
}

/// A number from 0 to 1 that looks random.
fn noise(seed: u32) -> f32 {
    let mut bits = seed.wrapping_mul(0x9e37_79b1);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca6b);
    ((bits ^ (bits >> 13)) >> 8) as f32 / (1 << 24) as f32
}

/// Walls and roofs, and the windows behind which someone is awake.
fn add_houses(model: &mut Model) {
    let colors = [vec3(0.55, 0.42, 0.33), vec3(0.5, 0.47, 0.4), vec3(0.42, 0.44, 0.48)];
    let mut walls = colors.map(|color| model.material(Material::new("house", color)));
    let curtains = model.bitmap(Bitmap::draw(48, 64, pane));
    let lights = [14.0 * vec3(1.0, 0.66, 0.32), 9.0 * vec3(1.0, 0.82, 0.55), 5.0 * vec3(0.45, 0.6, 1.0)];
    let window = |color: Vec3| {
        let material = Material { emission_map: Some(curtains), ..Material::emitter("lit pane", color) };
        // Its image runs downwards.
        model.material(material).quad(vec3(-0.5, 0.75, 0.0), Vec3::Y * -1.5, Vec3::X)
    };
    let windows = lights.map(window);
    let mut places = [const { Vec::new() }; 3];
    for (i, j) in houses() {
        let number = HOUSES * j + i;
        let floors = 2 + (4.0 * noise(number)) as u32;
        let height = 1.0 + 2.8 * floors as f32;
        let center = house(i, j) + 0.5 * height * Vec3::Y;
        let mesh = &mut walls[number as usize % 3];
        *mesh = core::mem::take(mesh).block(center, vec3(2.0 * HALF, height, 2.0 * HALF), 0.0);
        for place in 0..4 * COLUMNS * floors {
            let (side, column, floor) = (place % 4, place / 4 % COLUMNS, place / (4 * COLUMNS));
            let seed = 1000 * (number + 1) + 8 * place;
            if noise(seed) > 0.22 {
                continue;
            }
            let turn = Quat::from_rotation_y(FRAC_PI_2 * side as f32);
            let across = 2.0 * HALF * ((column as f32 + 0.5) / COLUMNS as f32 - 0.5);
            let at = house(i, j) + turn * vec3(across, 1.9 + 2.8 * floor as f32, HALF + 0.02);
            let size = vec3(1.0 + 0.6 * noise(seed + 1), 1.0, 1.0);
            places[(3.0 * noise(seed + 2)) as usize].push(Affine3A::from_scale_rotation_translation(size, turn, at));
        }
    }
    walls.into_iter().for_each(|mesh| model.add(mesh));
    for (window, places) in windows.into_iter().zip(places) {
        model.add(placed(window, places));
    }
}

/// Panes, with curtains to both sides.
fn pane(uv: Vec2) -> Vec4 {
    let is_bar = (uv - 0.5).abs().min_element() < 0.03 || (uv - 0.5).abs().max_element() > 0.46;
    let fold = 0.25 + 0.1 * (60.0 * uv.x).sin();
    let brightness = match (uv.x - 0.5).abs() {
        _ if is_bar => 0.0,
        aside if aside > 0.22 => fold,
        _ => 1.0,
    };
    Vec4::from((Vec3::splat(brightness), 1.0))
}

/// Lamps of three globes along the pavements.
fn add_lamps(model: &mut Model) {
    let mut poles = model.material(Material::new("pole", Vec3::splat(0.1)));
    let mut lamp = model.material(Material::emitter("globe", 30.0 * vec3(1.0, 0.74, 0.45)));
    for center in [vec3(-0.3, 3.3, 0.0), vec3(0.3, 3.3, 0.0), vec3(0.0, 3.7, 0.0)] {
        lamp = lamp.sphere(center, 0.14, 4);
    }
    let mut places = Vec::new();
    for (i, j) in houses() {
        for number in 0..LAMPS {
            let seed = 100 * (HOUSES * j + i) + number;
            let along = PITCH * ((number / 2) as f32 + 0.2 + 0.4 * noise(seed)) / 3.0 - 0.5 * PITCH;
            let edge = 0.5 * PITCH - LAMP_LINE;
            let at = if number % 2 == 0 { vec3(edge, 0.0, along) } else { vec3(along, 0.0, -edge) };
            let foot = house(i, j) + at;
            let turn = Quat::from_rotation_y(4.0 * noise(seed + 7));
            let size = Vec3::splat(0.9 + 0.2 * noise(seed + 9));
            poles = poles.block(foot + 1.5 * Vec3::Y, vec3(0.1, 3.0, 0.1), 0.0);
            places.push(Affine3A::from_scale_rotation_translation(size, turn, foot));
        }
    }
    model.add(poles);
    model.add(placed(lamp, places));
}

/// Copies of a mesh, none of which is a mirror image.
fn placed(object: Mesh, places: Vec<Affine3A>) -> Mesh {
    let mut all = Mesh::of(object.material);
    for place in &places {
        let copy = object.positions.iter().map(|&position| place.transform_point3(position)).collect();
        all.append(&Mesh { positions: copy, ..object.clone() });
    }
    Mesh { copies: Some(Copies { object: Arc::new(object), places }), ..all }
}
