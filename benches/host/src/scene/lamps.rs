//! Bulbs and the screen.

use std::sync::Arc;

use glam::{Vec2, Vec3, vec2, vec3};

use super::texture::Texture;
use super::{Emitter, Radiance};
use crate::geometry::{Mesh, icosphere};
use crate::random::Pcg32;

/// Radius of a bulb, in meters; *format* of the workload.
pub(super) const BULB_RADIUS: f32 = 0.04;
/// Number of bulbs of a room.
pub(super) const BULBS: usize = 50;

/// Returns a bulb.
pub(super) fn bulb(center: Vec3, radiance: f32) -> Emitter {
    Emitter { mesh: icosphere(center, BULB_RADIUS), radiance: Radiance::Constant(radiance) }
}

/// Returns centers and radiances of the bulbs under a room's ceiling.
pub(super) fn bulbs() -> Vec<(Vec3, f32)> {
    let mut pcg = Pcg32::new(38, 2);
    let draw = |_| {
        let [x, y, z] = [(0.3, 5.4), (0.3, 4.4), (2.2, 0.6)].map(|(low, size)| (low + size * pcg.f()) as f32);
        (vec3(x, y, z), (20.0 * 5.0_f64.powf(pcg.f())) as f32)
    };
    (0..BULBS).map(draw).collect()
}

/// Returns the screen on the wall x = 0.
pub(super) fn screen() -> Emitter {
    let (low, high) = (vec2(1.5, 0.8), vec2(3.5, 1.9));
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let corners = uvs.map(|uv| {
        let at = low + uv * (high - low);
        vec3(0.01, at.x, at.y)
    });
    let mesh = Mesh { uvs: uvs.to_vec(), ..Mesh::quad(corners) };
    Emitter { mesh, radiance: Radiance::Textured(Arc::new(Texture::spots(512, 5.0))) }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::{bulbs, screen};

    #[test]
    fn first_bulb_is_that_of_the_generator() {
        let (center, radiance) = bulbs()[0];
        assert!(center.distance(vec3(1.0112, 1.867_625, 2.352_726)) < 1e-6);
        assert!((radiance - 63.699_09).abs() < 1e-5);
    }

    #[test]
    fn screen_faces_the_room() {
        let [a, b, c] = screen().mesh.triangles().next().expect("a screen has triangles");
        assert!((b - a).cross(c - a).dot(Vec3::X) > 0.0);
    }
}
