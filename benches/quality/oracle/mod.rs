//! Irradiance at a point from every light, in double precision and without noise.

pub(crate) mod lambert;
pub(crate) mod pieces;
pub(crate) mod quadrature;

use fanlight::{Receiver, ShadingPoint};
use glam::{DVec2, DVec3};

use crate::scenes::image::bilinear;
use crate::scenes::sky::smooth;
use crate::scenes::wall::Wall;
use crate::scenes::{Light, Scene, Weight};
use pieces::Piece;
use quadrature::{Corner, clip, integrate};

/// What a point sees of the sun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// Nothing, or the scene has none.
    NoSun,
    /// Some of it, above the horizon.
    Sun,
    /// Some of it, all below the horizon.
    Below,
}

/// The truth at one point.
#[derive(Clone, Debug)]
pub(crate) struct Truth {
    /// Irradiance from every light, unless lights cover each other.
    pub(crate) by_light: Vec<f64>,
    pub(crate) total: f64,
    pub(crate) class: Class,
}

/// A scene cut into pieces that can be integrated.
pub(crate) struct Oracle<'a> {
    scene: &'a Scene,
    /// Background weight and pieces of each light.
    lights: Vec<(f64, Vec<Piece>)>,
}

impl<'a> Oracle<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let cut = |light: &Light| match (light.weight, &scene.image) {
            (Weight::Image, Some(image)) => (f64::from(image.background), pieces::pieces(light, image)),
            (Weight::Constant(weight), _) => (f64::from(weight), vec![]),
            (Weight::Image, None) => (0.0, vec![]),
        };
        let lights = scene.lights.iter().map(cut).collect();
        Self { scene, lights }
    }

    /// Irradiance at a point, and its class.
    pub(crate) fn truth(&self, x: &ShadingPoint) -> Truth {
        let view = View::new(x);
        let mut by_light = match &self.scene.walls[..] {
            [outer, inner] => vec![nested(&view, outer, inner)],
            _ => self.lights.iter().zip(&self.scene.lights).map(|(cut, light)| self.light(&view, cut, light)).collect(),
        };
        let class = self.add_sun(&view, &mut by_light);
        Truth { total: by_light.iter().sum(), by_light, class }
    }

    /// Irradiance from one light, without the sun.
    fn light(&self, view: &View, (background, pieces): &(f64, Vec<Piece>), light: &Light) -> f64 {
        let relative = light.vertices.map(|v| v - view.position);
        let (normal, _) = light.normal_and_area();
        if normal.dot(relative[0]) >= 0.0 || relative.iter().all(|v| view.normal.dot(*v) <= 0.0) {
            return 0.0;
        }
        let portal = self.scene.sky.is_some();
        let flat = match *background {
            0.0 => 0.0,
            background if portal => view.piece(&Piece::constant(&light.vertices, background), normal, true),
            background => background * lambert::irradiance(view.normal, &relative),
        };
        flat + pieces.iter().map(|piece| view.piece(piece, normal, portal)).sum::<f64>()
    }

    /// Adds what the sun sends through each opening.
    fn add_sun(&self, view: &View, by_light: &mut [f64]) -> Class {
        let Some(sky) = &self.scene.sky else { return Class::NoSun };
        let mut class = Class::NoSun;
        for &(direction, energy) in &sky.sun {
            let transmittance = self.scene.transmittance(view.position, direction);
            if transmittance <= 0.0 {
                continue;
            }
            let cosine = view.normal.dot(direction);
            class = match class {
                Class::NoSun | Class::Below if cosine <= 0.0 => Class::Below,
                _ => Class::Sun,
            };
            let light = match &self.scene.walls[..] {
                [wall] => wall.meet(view.position, direction, self.scene.image.as_ref()).map_or(0, |(light, _)| light),
                _ => 0,
            };
            by_light[light] += energy * transmittance * cosine.max(0.0);
        }
        class
    }
}

/// A shading point in double precision.
struct View {
    position: DVec3,
    normal: DVec3,
}

impl View {
    fn new(x: &ShadingPoint) -> Self {
        let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
        Self { position: x.position.as_dvec3(), normal: normal.as_dvec3() }
    }

    /// Irradiance from a piece in a plane with this normal; through it the smooth sky is seen if it is a portal.
    fn piece(&self, piece: &Piece, normal: DVec3, portal: bool) -> f64 {
        let relative = |corner: &Corner| Corner { place: corner.place - self.position, ..*corner };
        let polygon: Vec<Corner> = piece.corners.iter().map(relative).collect();
        let polygon = clip(&polygon, |corner| self.normal.dot(corner.place));
        if polygon.is_empty() {
            return 0.0;
        }
        let height = -normal.dot(polygon[0].place);
        let integrand = |corner: &Corner| {
            let d2 = corner.place.length_squared();
            let sky = if portal { smooth(corner.place.z / d2.sqrt()) } else { 1.0 };
            bilinear(&piece.values, corner.patch) * sky * self.normal.dot(corner.place) * height / (d2 * d2)
        };
        if portal && polygon.iter().any(|c| c.place.z > 0.0) && polygon.iter().any(|c| c.place.z < 0.0) {
            // The sky has a kink at its horizon.
            let halves = [1.0, -1.0].map(|sign| clip(&polygon, |corner| sign * corner.place.z));
            return halves.iter().map(|half| integrate(half, &integrand)).sum();
        }
        integrate(&polygon, &integrand)
    }
}

/// Irradiance through the outer one of two walls, less what the inner one covers.
fn nested(view: &View, outer: &Wall, inner: &Wall) -> f64 {
    let (mut min, mut max) = (outer.min, outer.min + outer.side);
    let eye = DVec2::new(view.position.x, view.position.z);
    if view.position.y < inner.y {
        // The inner opening as it is projected to the outer wall.
        let scale = (outer.y - view.position.y) / (inner.y - view.position.y);
        min = min.max(eye + (inner.min - eye) * scale);
        max = max.min(eye + (inner.min + inner.side - eye) * scale);
    }
    if min.x >= max.x || min.y >= max.y {
        return 0.0;
    }
    let corner = |x: f64, z: f64| DVec3::new(x, outer.y, z);
    let rectangle = [corner(min.x, min.y), corner(max.x, min.y), corner(max.x, max.y), corner(min.x, max.y)];
    view.piece(&Piece::constant(&rectangle, 1.0), DVec3::NEG_Y, true)
}
