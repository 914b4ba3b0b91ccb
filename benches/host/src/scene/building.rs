//! A building of three floors with 36 rooms each.

use glam::{Vec2, Vec3, vec2, vec3};

use super::data::Data;
use super::room::WALL;
use super::{Emitter, Portal, Radiance, Scene, skies};
use crate::Error;
use crate::camera::Camera;
use crate::geometry::{Mesh, Plane, Rectangle, rectangle_outline, sphere};
use crate::random::Pcg32;

/// Rooms along x and along y.
const ROOMS: u8 = 6;
/// Floors.
const FLOORS: u8 = 3;
/// Width of a room and its height, in meters.
const ROOM: Vec2 = vec2(4.0, 3.0);

/// Builds the building with a lamp in each room.
pub(super) fn building(_: &Data) -> Result<Scene, Error> {
    let lamp = |(center, radiance): (Vec3, f32)| Emitter {
        mesh: sphere(center, 0.15, 6, 6),
        radiance: Radiance::Constant(radiance),
    };
    Ok(Scene { emitters: lamps().into_iter().map(lamp).collect(), ..shell(false) })
}

/// Builds the building without lamps, a window in each outer wall.
pub(super) fn building_windows(_: &Data) -> Result<Scene, Error> {
    Ok(Scene { sky: Some(skies::with_small_sun()), ..shell(true) })
}

/// Returns centers and radiances of the lamps.
fn lamps() -> Vec<(Vec3, f32)> {
    let mut pcg = Pcg32::new(35, 2);
    let rooms = (0..ROOMS).flat_map(|i| (0..ROOMS).flat_map(move |j| (0..FLOORS).map(move |k| [i, j, k])));
    rooms
        .map(|[i, j, k]| {
            let [x, y] = [i, j].map(|i| ((f64::from(i) + 0.3 + 0.4 * pcg.f()) * 4.0) as f32);
            (vec3(x, y, 3.0 * f32::from(k) + 2.6), 2.0_f64.powf(4.0 * pcg.f() - 2.0) as f32)
        })
        .collect()
}

/// Returns walls and floors.
fn shell(windows: bool) -> Scene {
    let side = f32::from(ROOMS) * ROOM.x;
    let height = f32::from(FLOORS) * ROOM.y;
    let mut solids = Mesh::default();
    for k in 0..=FLOORS {
        let floor = Plane::Z(f32::from(k) * ROOM.y);
        solids.append(&floor.polygon(&rectangle_outline(Vec2::ZERO, Vec2::splat(side)), &[]));
    }
    let mut portals = Vec::new();
    for i in 0..=ROOMS {
        let at = f32::from(i) * ROOM.x;
        let inward = if i == 0 { 1.0 } else { -1.0 };
        for (plane, front) in [(Plane::X(at), inward * Vec3::X), (Plane::Y(at), inward * Vec3::Y)] {
            for (j, k) in (0..ROOMS).flat_map(|j| (0..FLOORS).map(move |k| (j, k))) {
                let low = vec2(f32::from(j), f32::from(k)) * ROOM;
                let outline = rectangle_outline(low, low + ROOM);
                let is_outer = i == 0 || i == ROOMS;
                let window = [low + vec2(1.4, 1.0), low + vec2(2.6, 2.2)];
                let wall = match (is_outer, windows) {
                    (false, _) => plane.polygon(&with_door(outline), &[]),
                    (true, false) => plane.polygon(&outline, &[]),
                    (true, true) => plane.polygon(&outline, &[rectangle_outline(window[0], window[1])]),
                };
                solids.append(&wall);
                if is_outer && windows {
                    portals.push(Portal::from(Rectangle::new(plane, window[0], window[1], front)));
                }
            }
        }
    }
    Scene {
        camera: Camera::new(vec3(4.5, 4.5, 1.6), vec3(7.5, 7.5, 0.8), Vec3::Z, 75.0),
        solids: vec![(solids, WALL)],
        emitters: Vec::new(),
        portals,
        sky: None,
        inside: Some([Vec3::ZERO, vec3(side, side, height)]),
    }
}

/// Cuts a door of one by two meters out of a wall's lower edge.
fn with_door(mut outline: Vec<Vec2>) -> Vec<Vec2> {
    let corner = outline[0];
    let points = [(1.5, 0.0), (1.5, 2.0), (2.5, 2.0), (2.5, 0.0)].map(|(x, y)| corner + vec2(x, y));
    outline.splice(1..1, points);
    outline
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use glam::vec3;

    use super::{Data, building, building_windows, lamps};

    #[test]
    fn lamps_are_those_of_the_generator() {
        let lamps = lamps();
        assert_eq!(lamps.len(), 108);
        let (center, radiance) = lamps[0];
        assert!(center.distance(vec3(2.607_862, 2.053_754, 2.6)) < 1e-5);
        assert!((radiance - 0.788_692_1).abs() < 1e-6);
        let (center, radiance) = lamps[107];
        assert!(center.distance(vec3(21.859_03, 22.373_34, 8.6)) < 1e-4);
        assert!((radiance - 2.906_714).abs() < 1e-5);
    }

    #[test]
    fn counts_are_those_of_the_workload() {
        let data = Data::new(PathBuf::new());
        let scene = building(&data).expect("it needs no data");
        assert_eq!(scene.emitters.iter().map(|lamp| lamp.mesh.indices.len()).sum::<usize>(), 6480);
        assert_eq!(building_windows(&data).expect("it needs no data").portals.len(), 72);
    }
}
