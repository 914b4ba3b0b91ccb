//! A clear sky with a sun.
//!
//! The sky is that of Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight" (SIGGRAPH 1999), appendix
//! A.2; the sun's strength is that of the IES, "Recommended Practice for the Calculation of Daylight Availability"
//! (1984), for clear days.

use core::f64::consts::PI;

use glam::{DMat3, DVec3, Vec3, dvec3, vec2};

use super::film::Image;
use super::sky::{LUMINANCE, Sky, direction_of};

/// Columns and rows of the image.
const SIZE: (usize, usize) = (1024, 512);
/// Haze: 2 is arctic, 10 is misty.
const TURBIDITY: f64 = 3.0;
/// To the sun: 30° high, shining through the window onto the floor.
const SUN: DVec3 = dvec3(-0.813_797_681, 0.5, 0.296_198_133);
/// Half the angle that the sun's disc is seen under.
const SUN_RADIUS: f64 = 0.00465;
/// Color of sunlight at this height.
const SUN_COLOR: Vec3 = Vec3::new(1.15, 0.98, 0.75);
/// Share of the light that the ground outside reflects.
const GROUND_ALBEDO: f32 = 0.15;

/// Linear sRGB from CIE XYZ; the first column is what X adds.
const RGB_FROM_XYZ: DMat3 =
    DMat3::from_cols(dvec3(3.2405, -0.9693, 0.0556), dvec3(-1.5371, 1.8760, -0.2040), dvec3(-0.4985, 0.0416, 1.0572));

/// Perez' distribution of one quantity over the sky, scaled to its value at the zenith.
struct Perez {
    coefficients: [f64; 5],
    scale: f64,
}

impl Perez {
    fn new(coefficients: [f64; 5], zenith: f64) -> Self {
        let unscaled = Self { coefficients, scale: 1.0 };
        let scale = zenith / unscaled.at(1.0, SUN.y);
        Self { coefficients, scale }
    }

    /// The quantity where the cosines of the angles to the zenith and to the sun are these.
    fn at(&self, cos_theta: f64, cos_gamma: f64) -> f64 {
        let [a, b, c, d, e] = self.coefficients;
        let gamma = cos_gamma.clamp(-1.0, 1.0).acos();
        let horizon = 1.0 + a * (b / cos_theta).exp();
        let around_sun = 1.0 + c * (d * gamma).exp() + e * cos_gamma * cos_gamma;
        self.scale * horizon * around_sun
    }
}

/// The model's three quantities: chromaticities x and y, and luminance in kcd/m².
pub(crate) struct Daylight {
    x: Perez,
    y: Perez,
    luminance: Perez,
}

impl Daylight {
    /// Evaluates the model's tables for the sun's height and the haze.
    pub(crate) fn new() -> Self {
        let linear = |table: [[f64; 2]; 5]| table.map(|[slope, offset]| slope * TURBIDITY + offset);
        let luminance =
            linear([[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]]);
        let x =
            linear([[-0.0193, -0.2592], [-0.0665, 0.0008], [-0.0004, 0.2125], [-0.0641, -0.8989], [-0.0033, 0.0452]]);
        let y =
            linear([[-0.0167, -0.2608], [-0.0950, 0.0092], [-0.0079, 0.2102], [-0.0441, -1.6537], [-0.0109, 0.0529]]);
        Self {
            x: Perez::new(x, zenith_chromaticity(&ZENITH_X)),
            y: Perez::new(y, zenith_chromaticity(&ZENITH_Y)),
            luminance: Perez::new(luminance, zenith_luminance()),
        }
    }

    /// Draws sky, sun and ground.
    pub(crate) fn draw(&self) -> Sky {
        let mut image = Image::black(SIZE.0, SIZE.1);
        for (i, texel) in image.pixels.iter_mut().enumerate() {
            let direction = texel_direction(i, 0.5, 0.5);
            if direction.y > 0.0 {
                *texel = self.sky_radiance(direction.as_dvec3());
            }
        }
        let ground = self.ground_radiance(&image);
        image.pixels[SIZE.0 * SIZE.1 / 2..].fill(ground);
        add_sun(&mut image);
        Sky::new(image)
    }

    fn sky_radiance(&self, direction: DVec3) -> Vec3 {
        let cosines = (direction.y, direction.dot(SUN));
        let [x, y, luminance] = [&self.x, &self.y, &self.luminance].map(|perez| perez.at(cosines.0, cosines.1));
        let xyz = dvec3(x, y, 1.0 - x - y) * (luminance / y);
        (RGB_FROM_XYZ * xyz).as_vec3().max(Vec3::ZERO)
    }

    /// What a diffuse ground reflects of the sky in the upper half of an image, and of the sun.
    fn ground_radiance(&self, image: &Image) -> Vec3 {
        let from_sky: Vec3 =
            (0..SIZE.0 * SIZE.1 / 2).map(|i| image.pixels[i] * solid_angle(i) * texel_direction(i, 0.5, 0.5).y).sum();
        let from_sun = sun_illuminance() * SUN.y as f32;
        (from_sky + from_sun) * GROUND_ALBEDO / core::f32::consts::PI
    }
}

/// Coefficients of the zenith's chromaticity x: rows for T², T and 1, columns for θ³, θ², θ and 1.
const ZENITH_X: [[f64; 4]; 3] =
    [[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394], [0.11693, -0.21196, 0.06052, 0.25886]];

/// Coefficients of the zenith's chromaticity y.
const ZENITH_Y: [[f64; 4]; 3] =
    [[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516], [0.15346, -0.26756, 0.06670, 0.26688]];

fn sun_theta() -> f64 {
    SUN.y.acos()
}

fn zenith_chromaticity(table: &[[f64; 4]; 3]) -> f64 {
    let polynomial = |coefficients: &[f64], t: f64| coefficients.iter().fold(0.0, |sum, c| sum * t + c);
    polynomial(&table.map(|row| polynomial(&row, sun_theta())), TURBIDITY)
}

fn zenith_luminance() -> f64 {
    let chi = (4.0 / 9.0 - TURBIDITY / 120.0) * (PI - 2.0 * sun_theta());
    (4.0453 * TURBIDITY - 4.9710) * chi.tan() - 0.2155 * TURBIDITY + 2.4192
}

/// What the sun sheds on a surface that faces it, in klx: 127.5 above the air, less by 0.21 for each air mass.
fn sun_illuminance() -> Vec3 {
    let illuminance = 127.5 * (-0.21 / SUN.y).exp();
    SUN_COLOR / SUN_COLOR.dot(LUMINANCE) * illuminance as f32
}

/// Spreads the sun's light over the texels that its disc covers.
fn add_sun(image: &mut Image) {
    let coverage: Vec<(usize, f32)> =
        (0..SIZE.0 * SIZE.1 / 2).map(|i| (i, sun_coverage(i))).filter(|&(_, coverage)| coverage > 0.0).collect();
    let covered: f32 = coverage.iter().map(|&(i, coverage)| coverage * solid_angle(i)).sum();
    let radiance = sun_illuminance() / covered;
    for (i, coverage) in coverage {
        image.pixels[i] += coverage * radiance;
    }
}

/// Which share of a texel the sun's disc covers.
fn sun_coverage(i: usize) -> f32 {
    const GRID: u8 = 16;
    let sun = SUN.as_vec3();
    if texel_direction(i, 0.5, 0.5).distance(sun) > 0.02 {
        return 0.0;
    }
    let offset = |k: u8| (f32::from(k) + 0.5) / f32::from(GRID);
    let points = (0..GRID).flat_map(|row| (0..GRID).map(move |column| (offset(column), offset(row))));
    // The chord, because cosines of angles as small as these cannot be told apart.
    let inside = points.filter(|&(x, y)| texel_direction(i, x, y).distance(sun) < SUN_RADIUS as f32);
    inside.count() as f32 / f32::from(GRID).powi(2)
}

/// Direction to a point of a texel; (0.5, 0.5) is its middle.
fn texel_direction(i: usize, x: f32, y: f32) -> Vec3 {
    let (column, row) = (i % SIZE.0, i / SIZE.0);
    direction_of(vec2((column as f32 + x) / SIZE.0 as f32, (row as f32 + y) / SIZE.1 as f32))
}

/// Solid angle of a texel.
fn solid_angle(i: usize) -> f32 {
    let theta = |row: usize| PI * row as f64 / SIZE.1 as f64;
    let row = i / SIZE.0;
    ((theta(row).cos() - theta(row + 1).cos()) * 2.0 * PI / SIZE.0 as f64) as f32
}
