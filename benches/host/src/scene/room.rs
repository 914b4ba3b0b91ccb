//! The room that most scenes are made from.

use glam::{Vec2, Vec3, Vec3Swizzles as _, vec2, vec3};

use super::data::Data;
use super::lamps::{bulb, bulbs as bulb_list, screen};
use super::{Emitter, Portal, Scene, skies};
use crate::Error;
use crate::bsdf::Material;
use crate::camera::Camera;
use crate::geometry::{Mesh, Plane, Rectangle, rectangle_outline};
use crate::sky::Sky;

/// Length, width and height, in meters.
pub(super) const SIZE: Vec3 = vec3(6.0, 5.0, 3.0);
/// What walls are made of.
pub(super) const WALL: Material = Material::Diffuse(Vec3::splat(0.6));
/// What the camera sees, sideways, in degrees.
const FIELD_OF_VIEW: f32 = 75.0;

/// The camera of all rooms.
pub(super) fn camera() -> Camera {
    Camera::new(vec3(5.4, 0.6, 1.7), vec3(1.5, 4.0, 0.9), Vec3::Z, FIELD_OF_VIEW)
}

/// A room with windows in the wall y = 5, bulbs and a screen, or without any of them.
pub(super) struct Room {
    /// Lower and upper corners of the windows, in x and z.
    pub(super) windows: Vec<[Vec2; 2]>,
    pub(super) emitters: Vec<Emitter>,
    pub(super) sky: Option<Sky>,
    pub(super) floor: Material,
}

impl Room {
    /// Returns the room with its two windows.
    pub(super) fn with_windows(sky: Sky) -> Self {
        let window = |x: f32| [vec2(x, 0.9), vec2(x + 1.2, 2.1)];
        Self { windows: vec![window(1.0), window(3.4)], emitters: Vec::new(), sky: Some(sky), floor: WALL }
    }

    /// Adds the bulbs and the screen.
    pub(super) fn with_bulbs(mut self) -> Self {
        self.emitters = bulb_list().into_iter().map(|(center, radiance)| bulb(center, radiance)).collect();
        self.emitters.push(screen());
        self
    }

    /// Builds the walls.
    pub(super) fn into_scene(self) -> Scene {
        let mut walls = shell(SIZE);
        let holes: Vec<_> = self.windows.iter().map(|&[low, high]| rectangle_outline(low, high)).collect();
        walls.append(&Plane::Y(SIZE.y).polygon(&rectangle_outline(Vec2::ZERO, SIZE.xz()), &holes));
        let floor = Plane::Z(0.0).polygon(&rectangle_outline(Vec2::ZERO, SIZE.xy()), &[]);
        let portal = |&[low, high]: &[Vec2; 2]| Portal::from(Rectangle::new(Plane::Y(SIZE.y), low, high, Vec3::NEG_Y));
        Scene {
            camera: camera(),
            solids: vec![(walls, WALL), (floor, self.floor)],
            emitters: self.emitters,
            portals: self.windows.iter().map(portal).collect(),
            sky: self.sky,
            inside: Some([Vec3::ZERO, SIZE]),
        }
    }
}

/// Returns the walls x = 0, y = 0 and x = `size.x`, and the ceiling.
pub(super) fn shell(size: Vec3) -> Mesh {
    let mut walls = Mesh::default();
    for plane in [Plane::X(0.0), Plane::X(size.x)] {
        walls.append(&plane.polygon(&rectangle_outline(Vec2::ZERO, size.yz()), &[]));
    }
    walls.append(&Plane::Y(0.0).polygon(&rectangle_outline(Vec2::ZERO, size.xz()), &[]));
    walls.append(&Plane::Z(size.z).polygon(&rectangle_outline(Vec2::ZERO, size.xy()), &[]));
    walls
}

/// Builds the room under a captured sky without a sun.
pub(super) fn windows_only(data: &Data) -> Result<Scene, Error> {
    Ok(Room::with_windows(skies::captured(data, "courtyard")?).into_scene())
}

/// Builds the room with the sun in its windows.
pub(super) fn sun_room(data: &Data) -> Result<Scene, Error> {
    Ok(Room::with_windows(skies::facing_window(data, "city")?).into_scene())
}

/// Builds the room without windows.
pub(super) fn bulbs(_: &Data) -> Result<Scene, Error> {
    let room = Room { windows: Vec::new(), emitters: Vec::new(), sky: None, floor: WALL };
    Ok(room.with_bulbs().into_scene())
}

/// Builds the room with windows, bulbs and a screen.
pub(super) fn room_bulbs(data: &Data) -> Result<Scene, Error> {
    Ok(Room::with_windows(skies::captured(data, "courtyard")?).with_bulbs().into_scene())
}

/// Builds the same on a floor that shines.
pub(super) fn glossy(data: &Data, alpha: f32) -> Result<Scene, Error> {
    let room = Room::with_windows(skies::captured(data, "courtyard")?).with_bulbs();
    Ok(Room { floor: Material::Glossy { alpha, share: 0.9 }, ..room }.into_scene())
}

/// Builds the room with a hundred small openings, and the sun behind them.
pub(super) fn grid(data: &Data) -> Result<Scene, Error> {
    let opening = |k: u8| {
        let low = vec2(2.05, 0.65) + 0.2 * vec2(f32::from(k % 10), f32::from(k / 10));
        [low, low + 0.1]
    };
    let room = Room::with_windows(skies::facing_window(data, "city")?);
    Ok(Room { windows: (0..100).map(opening).collect(), ..room }.into_scene())
}
