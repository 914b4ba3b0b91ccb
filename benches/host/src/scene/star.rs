//! A room with a window in the shape of a star. Its world has y up.

use core::f32::consts::PI;

use glam::{Mat3, Vec2, Vec3, Vec3Swizzles as _, vec2, vec3};

use super::data::Data;
use super::room::WALL;
use super::{Portal, Scene};
use crate::Error;
use crate::camera::Camera;
use crate::geometry::{Mesh, Plane, rectangle_outline};
use crate::sky::Sky;

/// Length, height and width, in meters.
const SIZE: Vec3 = vec3(4.0, 3.0, 4.0);
/// Middle of the star in its wall, in y and z.
const CENTER: Vec2 = vec2(1.5, 2.0);
/// Inner radius over the outer one.
const INNER: f32 = 0.4;
/// From the sky's frame to a world with y up, where its image looks along (sin φ sin θ, cos θ, −cos φ sin θ).
const Y_UP: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y);

/// Builds the room.
pub(super) fn star(data: &Data) -> Result<Scene, Error> {
    let outline = outline();
    let mut walls = Mesh::default();
    let sides = [
        (Plane::X(SIZE.x), SIZE.yz()),
        (Plane::Y(0.0), SIZE.xz()),
        (Plane::Y(SIZE.y), SIZE.xz()),
        (Plane::Z(0.0), SIZE.xy()),
        (Plane::Z(SIZE.z), SIZE.xy()),
    ];
    for (plane, size) in sides {
        walls.append(&plane.polygon(&rectangle_outline(Vec2::ZERO, size), &[]));
    }
    let front = Plane::X(0.0);
    walls.append(&front.polygon(&rectangle_outline(Vec2::ZERO, SIZE.yz()), core::slice::from_ref(&outline)));
    Ok(Scene {
        camera: Camera::new(vec3(0.3, 2.2, 3.7), vec3(2.6, 0.3, 1.2), Vec3::Y, 75.0),
        solids: vec![(walls, WALL)],
        emitters: Vec::new(),
        portals: vec![Portal { mesh: front.polygon(&outline, &[]), rectangle: None }],
        sky: Some(Sky::new(data.image("room/sky.exr")?, Y_UP)),
        inside: Some([Vec3::ZERO, SIZE]),
    })
}

/// Returns the ten points of a star of one square meter.
fn outline() -> Vec<Vec2> {
    let step = PI / 5.0;
    let outer = (1.0 / (5.0 * INNER * step.sin())).sqrt();
    let point = |k: u8| {
        let radius = if k.is_multiple_of(2) { outer } else { INNER * outer };
        let (sin, cos) = (0.5 * PI + step * f32::from(k)).sin_cos();
        CENTER + radius * vec2(sin, cos)
    };
    (0..10).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::{Plane, outline};

    #[test]
    fn star_has_one_square_meter() {
        let mesh = Plane::X(0.0).polygon(&outline(), &[]);
        let area: f32 = mesh.triangles().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).x).sum();
        assert!((area - 1.0).abs() < 1e-5);
    }
}
