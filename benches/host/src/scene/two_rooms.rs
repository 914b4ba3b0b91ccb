//! Two rooms with a door between them; the camera is in the one without windows.

use glam::{Vec2, Vec3, Vec3Swizzles as _, vec2};

use super::data::Data;
use super::lamps::{bulb, bulbs, screen};
use super::room::{SIZE, WALL, camera, shell};
use super::{Portal, Scene, skies};
use crate::Error;
use crate::geometry::{Plane, Rectangle, rectangle_outline};

/// Bulbs that stay in the first room.
const BULBS_HERE: usize = 20;

/// Builds both rooms.
pub(super) fn two_rooms(data: &Data) -> Result<Scene, Error> {
    let size = SIZE.with_y(2.0 * SIZE.y);
    let window = |k: u8| {
        let low = vec2(0.3 + 1.1 * f32::from(k % 5), if k < 5 { 0.4 } else { 1.6 });
        [low, low + 0.8]
    };
    let windows: Vec<[Vec2; 2]> = (0..10).map(window).collect();
    let holes: Vec<_> = windows.iter().map(|&[low, high]| rectangle_outline(low, high)).collect();

    let mut walls = shell(size);
    walls.append(&Plane::Z(0.0).polygon(&rectangle_outline(Vec2::ZERO, size.xy()), &[]));
    walls.append(&Plane::Y(size.y).polygon(&rectangle_outline(Vec2::ZERO, size.xz()), &holes));
    let mut between = rectangle_outline(Vec2::ZERO, size.xz());
    // The door reaches down to the floor: a notch of the outline.
    between.splice(1..1, [vec2(2.5, 0.0), vec2(2.5, 2.0), vec2(3.5, 2.0), vec2(3.5, 0.0)]);
    walls.append(&Plane::Y(SIZE.y).polygon(&between, &[]));

    let place = |(i, (center, radiance)): (usize, (Vec3, f32))| {
        bulb(if i < BULBS_HERE { center } else { center + SIZE.y * Vec3::Y }, radiance)
    };
    let portal = |&[low, high]: &[Vec2; 2]| Portal::from(Rectangle::new(Plane::Y(size.y), low, high, Vec3::NEG_Y));
    Ok(Scene {
        camera: camera(),
        solids: vec![(walls, WALL)],
        emitters: bulbs().into_iter().enumerate().map(place).chain([screen()]).collect(),
        portals: windows.iter().map(portal).collect(),
        sky: Some(skies::captured(data, "courtyard")?),
        inside: Some([Vec3::ZERO, size]),
    })
}
