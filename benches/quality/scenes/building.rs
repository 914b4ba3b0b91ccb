//! Rooms with doors, and a lamp in each: walls are planes without thickness.

use fanlight::ShadingPoint;
use glam::{DVec3, Vec3};

use super::pcg::Pcg32;

/// Rooms along x and along y, and their sizes.
pub(crate) const ROOMS: u32 = 6;
pub(crate) const SIDE: f64 = 4.0;
pub(crate) const HEIGHT: f64 = 3.0;
/// Floors of the building, and of the one with ten times as many rooms.
pub(crate) const FLOORS: u32 = 3;
pub(crate) const MANY_FLOORS: u32 = 30;

/// A mesh of the building.
pub(crate) struct LightMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) radiance: f32,
}

/// A lamp in each room.
pub(crate) fn lamps(floors: u32) -> Vec<LightMesh> {
    let mut pcg = Pcg32::new(35, 2);
    let mut meshes = vec![];
    for (i, j) in (0..ROOMS).flat_map(|i| (0..ROOMS).map(move |j| (i, j))) {
        for k in 0..floors {
            let x = (f64::from(i) + 0.3 + 0.4 * pcg.f()) * SIDE;
            let y = (f64::from(j) + 0.3 + 0.4 * pcg.f()) * SIDE;
            let radiance = (4.0 * pcg.f() - 2.0).exp2() as f32;
            meshes.push(lamp(DVec3::new(x, y, HEIGHT * f64::from(k) + 2.6), radiance));
        }
    }
    meshes
}

/// Points alternately on floors and on the walls that look along x.
pub(crate) fn points(floors: u32, seed: u64, count: usize) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(seed, 2);
    let mut points = vec![];
    let mut is_floor = true;
    while points.len() < count {
        points.extend(point(floors, &mut pcg, is_floor));
        is_floor = !is_floor;
    }
    points
}

/// A random point like those of the workload, by its number.
pub(crate) fn learning_point(floors: u32, i: u64) -> ShadingPoint {
    let mut pcg = Pcg32::new(i, 41);
    loop {
        if let Some(point) = point(floors, &mut pcg, i.is_multiple_of(2)) {
            return point;
        }
    }
}

fn point(floors: u32, pcg: &mut Pcg32, is_floor: bool) -> Option<ShadingPoint> {
    let side = SIDE * f64::from(ROOMS);
    let floor = |f: f64| HEIGHT * (f64::from(floors) * f).floor();
    if is_floor {
        let (x, y) = (side * pcg.f(), side * pcg.f());
        let position = DVec3::new(x, y, floor(pcg.f()) + 0.001);
        return Some(ShadingPoint::surface(position.as_vec3(), Vec3::Z));
    }
    let x = SIDE * (f64::from(ROOMS) * pcg.f()).floor() + 0.001;
    let y = side * pcg.f();
    let bottom = floor(pcg.f());
    let position = DVec3::new(x, y, bottom + 0.3 + 2.4 * pcg.f());
    let is_door = x > 1.0 && is_door(position.y, position.z);
    (!is_door).then(|| ShadingPoint::surface(position.as_vec3(), Vec3::X))
}

/// A sphere of 6 x 6 quads of longitude and latitude.
fn lamp(center: DVec3, radiance: f32) -> LightMesh {
    const N: u32 = 6;
    const RADIUS: f64 = 0.15;
    let angle = |i: u32, turn: f64| turn * f64::from(i) / f64::from(N);
    let position = |i: u32, j: u32| {
        let (sin_phi, cos_phi) = angle(i, core::f64::consts::TAU).sin_cos();
        let (sin, cos) = angle(j, core::f64::consts::PI).sin_cos();
        (center + RADIUS * DVec3::new(sin * cos_phi, sin * sin_phi, cos)).as_vec3()
    };
    let positions = (0..=N).flat_map(|j| (0..=N).map(move |i| position(i, j))).collect();
    let mut indices = vec![];
    for (i, j) in (0..N).flat_map(|j| (0..N).map(move |i| (i, j))) {
        let at = |i: u32, j: u32| j * (N + 1) + i;
        if j > 0 {
            indices.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
        }
        if j + 1 < N {
            indices.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    LightMesh { positions, indices, radiance }
}

/// Whether a place of an inner wall is in a door.
pub(crate) fn is_door(along: f64, z: f64) -> bool {
    (along.rem_euclid(SIDE) - 2.0).abs() < 0.5 && z.rem_euclid(HEIGHT) < 2.0
}

/// Whether nothing but doors is between a shading point and a point.
pub(crate) fn sees(x: &ShadingPoint, to: DVec3) -> bool {
    let from = x.position.as_dvec3();
    if (from.z / HEIGHT).floor() != (to.z / HEIGHT).floor() {
        return false;
    }
    for axis in 0..2 {
        let (low, high) = if from[axis] < to[axis] { (from[axis], to[axis]) } else { (to[axis], from[axis]) };
        let mut wall = (low / SIDE).ceil();
        while wall * SIDE < high {
            let plane = wall * SIDE;
            if wall > 0.0 && wall < f64::from(ROOMS) {
                let t = (plane - from[axis]) / (to[axis] - from[axis]);
                let place = from + (to - from) * t;
                if !is_door(place[1 - axis], place.z) {
                    return false;
                }
            }
            wall += 1.0;
        }
    }
    true
}
