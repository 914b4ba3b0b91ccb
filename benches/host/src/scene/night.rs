//! The room at night: lamps of a few texels in a dark sky.

use glam::{DVec3, Vec3};

use super::data::Data;
use super::room::Room;
use super::{Scene, skies};
use crate::Error;
use crate::film::Image;
use crate::random::Pcg32;
use crate::sky::{Sky, texel_of};

/// Radiance of the dark.
const DARK: f32 = 0.02;
/// Number of lamps.
const LAMPS: usize = 30;

/// A lamp in the sky: azimuth from +y and elevation in degrees, and radiance.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    azimuth: f64,
    elevation: f64,
    radiance: f64,
}

/// Builds the room at night.
pub(super) fn night_room(_: &Data) -> Result<Scene, Error> {
    Ok(Room::with_windows(sky()).into_scene())
}

fn lamps() -> Vec<Lamp> {
    let mut pcg = Pcg32::new(37, 2);
    let draw = |_| Lamp {
        azimuth: -60.0 + 120.0 * pcg.f(),
        elevation: -5.0 + 50.0 * pcg.f(),
        radiance: 10.0 * 100.0_f64.powf(pcg.f()),
    };
    (0..LAMPS).map(draw).collect()
}

/// Returns the dark with 3 x 3 texels for each lamp.
pub(super) fn sky() -> Sky {
    let [width, height] = skies::SIZE;
    let mut image = Image { width, height, pixels: vec![Vec3::splat(DARK); width * height] };
    for lamp in lamps() {
        let (sin, cos) = lamp.azimuth.to_radians().sin_cos();
        let (height_above, radius) = lamp.elevation.to_radians().sin_cos();
        let direction = DVec3::new(sin * radius, cos * radius, height_above).as_vec3();
        let [x, y] = texel_of(direction, skies::SIZE);
        for row in y - 1..=y + 1 {
            for column in x + width - 1..=x + width + 1 {
                image.pixels[row * width + column % width] = Vec3::splat(lamp.radiance as f32);
            }
        }
    }
    Sky::new(image, glam::Mat3::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::{DARK, lamps, sky};

    #[test]
    fn first_lamp_is_that_of_the_generator() {
        let lamp = lamps()[0];
        assert!((lamp.azimuth + 54.130_81).abs() < 1e-5);
        assert!((lamp.elevation - 2.010_326).abs() < 1e-5);
        assert!((lamp.radiance - 37.096_93).abs() < 1e-5);
    }

    #[test]
    fn lamps_are_nine_texels() {
        let lit = sky().image().pixels.iter().filter(|texel| texel.x > DARK).count();
        assert!((9 * 28..=9 * 30).contains(&lit), "{lit}");
    }
}
