//! The inside of a car. Its windows are large, and its roof is in front of the bright part of the sky: the case
//! in which portals have least to give.

use core::f32::consts::TAU;

use glam::{Vec3, vec3};

use super::shapes::hazy;
use crate::render::{Camera, Lobe, Material, Mesh, Model};

/// A point between all windows.
const INSIDE: Vec3 = vec3(0.0, 0.8, 0.0);
/// Thickness of the glass.
const GLASS: f32 = 0.006;

pub(crate) fn car() -> Model {
    let camera = Camera::looking(vec3(0.12, 0.98, 0.95), vec3(-0.05, 0.72, -0.6), 70.0);
    let mut model = Model::new(camera, Some(hazy(Vec3::Y, 40.0, 15.0)));
    model.guide_texels = Some(32);
    let panes = panes();

    // Its two faces let through what one pane does.
    let tint = vec3(0.86, 0.91, 0.88);
    let mut inner = model.material(Material::new("window glass", tint).lobe(Lobe::Clear));
    let mut outer = model.material(Material::new("glass outside", tint).lobe(Lobe::Clear));
    for pane in &panes {
        let outward = (pane.positions[0] - INSIDE).normalize();
        inner.append(pane);
        outer.append(&Mesh { positions: pane.positions.iter().map(|p| p + GLASS * outward).collect(), ..pane.clone() });
    }
    model.add(inner.facing(INSIDE));
    model.add(outer.facing(INSIDE));
    add_body(&mut model);
    add_interior(&mut model);
    model
}

/// A flat piece between four corners.
fn piece(mesh: Mesh, [a, b, c, d]: [Vec3; 4]) -> Mesh {
    let mut mesh = mesh;
    mesh.grid([1, 1], |at| a.lerp(b, at.x).lerp(d.lerp(c, at.x), at.y));
    mesh
}

/// Corners of the cabin: along the belt line and the roof.
const BELT: [Vec3; 2] = [vec3(0.74, 0.66, -1.25), vec3(0.74, 0.66, 1.35)];
const ROOF: [Vec3; 2] = [vec3(0.56, 1.2, -0.55), vec3(0.56, 1.2, 0.95)];

fn mirrored(point: Vec3) -> Vec3 {
    vec3(-point.x, point.y, point.z)
}

fn panes() -> Vec<Mesh> {
    let [front, back] = BELT;
    let [roof_front, roof_back] = ROOF;
    let ends = [(front, roof_front), (back, roof_back)].map(|(belt, roof)| {
        let inset = |p: Vec3| vec3(0.93 * p.x, p.y, p.z);
        piece(Mesh::of(0), [mirrored(inset(belt)), inset(belt), inset(roof), mirrored(inset(roof))])
    });
    let along = |t: f32| [front.lerp(back, t), roof_front.lerp(roof_back, t)];
    let mut panes = ends.to_vec();
    for [from, to] in [[0.03, 0.5], [0.54, 0.97]] {
        let [[a, d], [b, c]] = [along(from), along(to)];
        panes.push(piece(Mesh::of(0), [a, b, c, d]));
        panes.push(piece(Mesh::of(0), [a, b, c, d].map(mirrored)));
    }
    panes
}

fn add_body(model: &mut Model) {
    let [front, back] = BELT;
    let [roof_front, roof_back] = ROOF;
    let low = |p: Vec3| vec3(p.x, 0.0, p.z);
    let mut body = model.material(Material::new("lining", vec3(0.35, 0.33, 0.3)));
    body = piece(body, [mirrored(roof_front), roof_front, roof_back, mirrored(roof_back)]);
    body = piece(body, [mirrored(low(front)), low(front), low(back), mirrored(low(back))]);
    for end in BELT {
        body = piece(body, [mirrored(low(end)), low(end), end, mirrored(end)]);
    }
    body = piece(body, [low(front), low(back), back, front]);
    body = piece(body, [low(front), low(back), back, front].map(mirrored));
    // Pillars: what is left between the panes.
    let along = |t: f32| [front.lerp(back, t), roof_front.lerp(roof_back, t)];
    for [from, to] in [[0.0, 0.03], [0.5, 0.54], [0.97, 1.0]] {
        let [[a, d], [b, c]] = [along(from), along(to)];
        body = piece(body, [a, b, c, d]);
        body = piece(body, [a, b, c, d].map(mirrored));
    }
    for (belt, roof) in [(front, roof_front), (back, roof_back)] {
        let inset = |p: Vec3| vec3(0.93 * p.x, p.y, p.z);
        body = piece(body, [belt, inset(belt), inset(roof), roof]);
        body = piece(body, [belt, inset(belt), inset(roof), roof].map(mirrored));
    }
    model.add(body);
}

fn add_interior(model: &mut Model) {
    let mut seats = model.material(Material::new("leather", vec3(0.32, 0.16, 0.09)));
    for x in [-0.36, 0.36] {
        cushion(&mut seats, vec3(x, 0.3, -0.05), vec3(0.5, 0.16, 0.54));
        cushion(&mut seats, vec3(x, 0.62, 0.2), vec3(0.48, 0.66, 0.14));
        cushion(&mut seats, vec3(x, 1.0, 0.22), vec3(0.24, 0.14, 0.09));
    }
    cushion(&mut seats, vec3(0.0, 0.3, 0.95), vec3(1.3, 0.2, 0.5));
    model.add(seats);
    let carpet = model.material(Material::new("carpet", vec3(0.2, 0.2, 0.24)));
    model.add(tufted(carpet));
    let dash = model.material(Material::new("dashboard", vec3(0.12, 0.12, 0.13)));
    model.add(dash.block(vec3(0.0, 0.58, -1.0), vec3(1.46, 0.22, 0.45), 0.0));
    let mut wheel = model.material(Material::new("wheel", Vec3::splat(0.3)).lobe(Lobe::Glossy(30.0)));
    wheel.grid([32, 8], |at| {
        let (around, tube) = (TAU * at.x, TAU * at.y);
        let ring = 0.17 + 0.015 * tube.cos();
        let flat = vec3(ring * around.cos(), ring * around.sin(), 0.015 * tube.sin());
        vec3(-0.36, 0.72, -0.68) + glam::Mat3::from_rotation_x(-0.4) * flat
    });
    model.add(wheel);
}

/// A box with soft edges and a grain.
fn cushion(mesh: &mut Mesh, center: Vec3, size: Vec3) {
    let mut round = Mesh::of(0).sphere(Vec3::ZERO, 1.0, 96);
    for position in &mut round.positions {
        let soft = position.signum() * position.abs().powf(0.35);
        let at = 90.0 * soft * size;
        let grain = 0.002 * at.x.sin() * at.y.sin() * at.z.sin();
        *position = center + 0.5 * soft * size + grain * *position;
    }
    mesh.append(&round);
}

/// Blades along the floor, in rows that sway.
fn tufted(mut carpet: Mesh) -> Mesh {
    const ROWS: u16 = 200;
    for row in 0..ROWS {
        for column in 0..ROWS {
            let [x, z] = [column, row].map(|i| (f32::from(i) + 0.5) / f32::from(ROWS));
            let (sin, cos) = (40.0 * x + 77.0 * z * x + 3.0 * f32::from(row % 7)).sin_cos();
            let foot = vec3(1.46 * (x - 0.5), 0.0, 2.58 * z - 1.24);
            carpet = carpet.quad(foot, 0.008 * vec3(cos, 0.0, sin), vec3(0.004 * sin, 0.02, 0.004 * cos));
        }
    }
    carpet
}
