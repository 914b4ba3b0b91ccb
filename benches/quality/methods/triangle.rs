//! First a triangle, then a point on it: all combinations of a choice and a uniform density.

use ::fanlight::ShadingPoint;
use glam::DVec3;

use super::arvo::{SphericalTriangle, barycentrics, crosses};
use super::binary_tree::BinaryTree;
use super::every_light::EveryLight;
use super::harmonic::Harmonic;
use super::power::{Power, scene_bounds};
use super::wide_tree::WideTree;
use super::{Cumulative, Drawn, Method};
use crate::oracle::lambert::solid_angle;
use crate::scenes::Scene;

/// Number of lights up to which it is quick to look at every one.
const FEW: usize = 200;

/// How a triangle is chosen.
pub(crate) enum Choice {
    Power(Power),
    Tree(BinaryTree),
    /// The talk's, by the conservative term.
    Wide(WideTree),
    Every(EveryLight),
    /// By the irradiance of every portal, from spherical harmonics.
    Harmonic(Harmonic),
    /// In proportion to the solid angles: uniform over an opening of two triangles.
    SolidAngle,
}

/// The best choice without this crate: exact for a single opening, the binary tree for more.
pub(crate) fn best_choice(scene: &Scene) -> Choice {
    if scene.sky.is_some() && scene.lights.len() == 2 {
        Choice::SolidAngle
    } else {
        Choice::Tree(BinaryTree::new(&scene_bounds(scene)))
    }
}

/// How a point on the triangle is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnTriangle {
    Area,
    /// Uniform over the solid angle, by area where that is too small to tell.
    SolidAngle,
}

impl OnTriangle {
    /// A direction to a triangle that is seen from the origin, the place that it meets, and its density per solid
    /// angle.
    pub(crate) fn sample(self, vertices: &[DVec3; 3], u: [f64; 2]) -> (DVec3, [f64; 2], f64) {
        if self == Self::SolidAngle
            && let Some(triangle) = SphericalTriangle::new(vertices)
        {
            let direction = triangle.sample(u);
            return (direction, barycentrics(vertices, direction), 1.0 / triangle.solid_angle);
        }
        let place = uniform(u);
        let [a, b, c] = *vertices;
        let direction = (a + (b - a) * place[0] + (c - a) * place[1]).normalize();
        (direction, place, area_density(vertices, direction))
    }

    /// Density per solid angle of a direction to the triangle.
    pub(crate) fn density(self, vertices: &[DVec3; 3], direction: DVec3) -> f64 {
        if self == Self::SolidAngle
            && let Some(triangle) = SphericalTriangle::new(vertices)
        {
            return 1.0 / triangle.solid_angle;
        }
        area_density(vertices, direction)
    }
}

pub(crate) struct ThenPoint<'a> {
    scene: &'a Scene,
    choice: Choice,
    on: OnTriangle,
    triangles: Vec<[glam::Vec3; 3]>,
    /// Whether a ray can cross several portals.
    layered: bool,
}

impl<'a> ThenPoint<'a> {
    pub(crate) fn new(scene: &'a Scene, choice: Choice, on: OnTriangle) -> Self {
        let triangles = scene.lights.iter().map(|light| light.vertices.map(|v| v.as_vec3())).collect();
        Self { scene, choice, on, triangles, layered: scene.walls.len() > 1 }
    }

    fn relative(&self, light: usize, x: &ShadingPoint) -> [DVec3; 3] {
        self.triangles[light].map(|v| v.as_dvec3() - x.position.as_dvec3())
    }

    fn choose(&self, x: &ShadingPoint, u: f32) -> Option<(usize, f64)> {
        match &self.choice {
            Choice::Power(power) => Some(power.table.sample(u)),
            Choice::Tree(tree) => tree.sample(x, &mut f64::from(u)),
            Choice::Wide(tree) => tree.sample(f64::from(u), |bounds| bounds.one_sided_importance(x)),
            Choice::Every(every) => every.sample(x, u),
            Choice::Harmonic(harmonic) => pick(&harmonic.weights(x), u),
            Choice::SolidAngle => {
                let second = self.second_share(x);
                let light = usize::from(f64::from(u) >= 1.0 - second);
                Some((light, if light == 1 { second } else { 1.0 - second }))
            }
        }
    }

    fn pmf(&self, x: &ShadingPoint, light: usize) -> f64 {
        match &self.choice {
            Choice::Power(power) => power.table.pmf(light),
            Choice::Tree(tree) => tree.pmf(x, light),
            Choice::Wide(tree) => tree.pmf(light, |bounds| bounds.one_sided_importance(x)),
            Choice::Every(every) => every.pmf(x, light),
            Choice::Harmonic(harmonic) => {
                let (weights, sum) = harmonic.weights(x);
                weights[light] / sum
            }
            Choice::SolidAngle if light == 1 => self.second_share(x),
            Choice::SolidAngle => 1.0 - self.second_share(x),
        }
    }

    fn second_share(&self, x: &ShadingPoint) -> f64 {
        let [first, second] = [0, 1].map(|light| solid_angle(&self.relative(light, x)));
        second / (first + second)
    }

    /// Sum of the densities of all triangles along a direction.
    fn direction_density(&self, x: &ShadingPoint, direction: DVec3) -> f64 {
        let density = |light: usize| {
            let vertices = self.relative(light, x);
            if front(&vertices) && crosses(&vertices, direction) {
                self.pmf(x, light) * self.on.density(&vertices, direction)
            } else {
                0.0
            }
        };
        (0..self.triangles.len()).map(density).sum()
    }
}

/// The entry that `u` falls into, and its probability; `None` if all weights are zero.
fn pick((weights, sum): &(Vec<f64>, f64), u: f32) -> Option<(usize, f64)> {
    let table = Cumulative::new(weights.iter().copied());
    (*sum > 0.0).then(|| table.sample(u)).map(|entry| (entry, weights[entry] / sum))
}

/// Density per solid angle of a uniform density over the area: `d² / (A cos θ)`.
pub(super) fn area_density(vertices: &[DVec3; 3], direction: DVec3) -> f64 {
    let [a, b, c] = *vertices;
    let double_normal = (b - a).cross(c - a);
    let double_area = double_normal.length();
    let normal = double_normal / double_area;
    let cosine = normal.dot(direction).abs();
    let distance = normal.dot(a).abs() / cosine;
    distance * distance / (0.5 * double_area * cosine)
}

/// Whether the origin sees the front of a triangle.
pub(super) fn front(vertices: &[DVec3; 3]) -> bool {
    let [a, b, c] = *vertices;
    (b - a).cross(c - a).dot(a) < 0.0
}

/// A uniform point of a triangle, as barycentrics (Turk 1990).
pub(crate) fn uniform(u: [f64; 2]) -> [f64; 2] {
    let root = u[0].sqrt();
    [root * (1.0 - u[1]), root * u[1]]
}

impl Method for ThenPoint<'_> {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let (light, pmf) = self.choose(x, u[0])?;
        let vertices = self.relative(light, x);
        if !front(&vertices) {
            return None;
        }
        let (direction, place, density) = self.on.sample(&vertices, [f64::from(u[1]), f64::from(u[2])]);
        let pdf = if self.layered { self.direction_density(x, direction) } else { pmf * density };
        Some(Drawn {
            light,
            barycentrics: place.map(|b| b as f32),
            direction: direction.as_vec3(),
            pdf,
            radiance: None,
        })
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let direction = drawn.direction.as_dvec3();
        if self.layered {
            return self.direction_density(x, direction);
        }
        self.pmf(x, drawn.light) * self.on.density(&self.relative(drawn.light, x), direction)
    }

    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        if let Choice::Every(every) = &self.choice {
            return Some(every.pmfs(x));
        }
        if let Choice::Harmonic(harmonic) = &self.choice {
            let (weights, sum) = harmonic.weights(x);
            return Some(weights.into_iter().map(|weight| weight / sum).collect());
        }
        let pmf = |light: usize| if wanted(light) { self.pmf(x, light) } else { 0.0 };
        Some((0..self.scene.lights.len()).map(pmf).collect())
    }

    fn bytes(&self) -> usize {
        let choice = match &self.choice {
            Choice::Power(power) => power.table.bytes(),
            Choice::Tree(tree) => tree.bytes(),
            Choice::Wide(tree) => tree.bytes(),
            Choice::Every(every) => every.bytes(),
            Choice::Harmonic(harmonic) => harmonic.bytes(),
            Choice::SolidAngle => 0,
        };
        choice + size_of_val(&self.triangles[..])
    }

    fn is_slow(&self) -> bool {
        match self.choice {
            Choice::Every(_) => self.triangles.len() > FEW,
            // Microseconds a portal.
            Choice::Harmonic(_) => self.triangles.len() > 2,
            _ => false,
        }
    }
}
