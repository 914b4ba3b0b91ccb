//! The shading points of the matrix: places around one triangle.

use fanlight::{Glossy, Microfacet, Receiver, Scattering, ShadingPoint};
use glam::{DVec3, Vec3};

use crate::common::scene::Scene;

pub(crate) const NAMES: [&str; 9] = [
    "far",
    "near, 1e-3",
    "near, 1e-7",
    "on the triangle",
    "on its edge",
    "at its vertex",
    "in its plane",
    "behind",
    "grazing",
];

/// Sines of the angle by which a tip of the triangle rises above the horizon of the last column.
const GRAZING: f64 = 0.05;

/// The point of a column with one kind of receiver: 0 surface, 1 transmissive, 2 volume.
pub(crate) fn point(scene: &Scene, column: usize, receiver: usize) -> ShadingPoint {
    let [a, b, c] = scene.meshes[0].vertices(0).map(|v| v.as_dvec3());
    let size = (b - a).length().max((c - a).length());
    let front = (b - a).cross(c - a).normalize();
    let centroid = (a + b + c) / 3.0;
    let inside = 0.3 * a + 0.36 * b + 0.34 * c;
    let position = match column {
        0 => centroid + (1e5 * size) * (front + 0.1 * (b - a) / size),
        1 => inside + 1e-3 * size * front,
        2 => inside + 1e-7 * size * front,
        3 => inside,
        4 => 0.5 * (b + c),
        5 => c,
        6 => a + 0.7 * (c - a) + 0.7 * (b - a),
        7 => centroid - 0.7 * size * front,
        _ => centroid + 0.5 * size * front,
    };
    let normal = match column {
        0 => -front,
        7 => front,
        8 => grazing(c - position, centroid - position),
        _ => (-front + 0.5 * (a - c) / (a - c).length() + 0.3 * front.cross(a - c) / (a - c).length()).normalize(),
    }
    .as_vec3()
    .normalize();
    let receiver = [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume][receiver];
    ShadingPoint::new(position.as_vec3(), receiver)
}

/// Returns the point with a lobe: of a glossy surface, of microfacets on a transmissive one, or a phase function.
/// `turn` decides about the roughness, from 1e-4 to 1, and the outgoing direction: grazing, below the horizon or above.
pub(crate) fn with_lobe(x: ShadingPoint, turn: usize) -> ShadingPoint {
    let roughness = [1e-4, 1e-3, 1e-2, 0.1, 1.0][turn % 5];
    let along = Vec3::new(0.6, -0.3, 0.5);
    let outgoing = |normal: Vec3| {
        let across = along.reject_from(normal).normalize();
        match turn / 5 % 4 {
            0 => (across + 1e-4 * normal).normalize(),
            1 => (across - 0.5 * normal).normalize(),
            _ => (across + normal).normalize(),
        }
    };
    let guide = match x.receiver {
        Receiver::Surface(normal) if turn % 2 == 0 => {
            ShadingPoint::glossy(x.position, Glossy::new(normal, outgoing(normal), roughness))
        }
        Receiver::Surface(normal) => {
            let brushed = Glossy::new(normal, outgoing(normal), roughness).anisotropic(along, [roughness, 0.3]);
            ShadingPoint::microfacet(x.position, brushed)
        }
        Receiver::Transmissive(normal) => {
            let glass = Microfacet::new(normal, outgoing(normal), roughness).with_weights(0.0, 0.1, 0.9);
            ShadingPoint::microfacet(x.position, glass.with_ior([1.0, 1.5, 0.66][turn % 3]))
        }
        _ => ShadingPoint::scattering(x.position, Scattering::new(along, [0.99, -0.7, 0.3][turn % 3])),
    };
    guide.at_time(x.time())
}

/// A normal over whose horizon a tip rises, but not the center.
fn grazing(tip: DVec3, center: DVec3) -> DVec3 {
    let tip = tip.normalize();
    let away = (center - tip * tip.dot(center)).normalize();
    (GRAZING * tip - away).normalize()
}

/// A name for messages.
pub(crate) fn receiver_name(x: &ShadingPoint) -> &'static str {
    match x.receiver {
        Receiver::Surface(_) => "surface",
        Receiver::Transmissive(_) => "transmissive",
        Receiver::Volume => "volume",
        other => unreachable!("{other:?} is none of the three receivers"),
    }
}
