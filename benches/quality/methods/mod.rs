//! What is compared: the crate, and the methods that it must beat.

mod arvo;
mod binary_tree;
mod discrete;
mod environment_reject;
mod every_light;
mod fanlight;
pub(crate) mod harmonic;
mod light_bounds;
mod portal_environment;
mod power;
mod rectified;
mod talk;
mod tessellated;
mod texel_cdf;
mod triangle;
mod wide_tree;

use ::fanlight::{Arity, Effort, Illumination, ShadingPoint};
use glam::Vec3;

pub(crate) use self::fanlight::Fanlight;
use crate::scenes::Scene;
use crate::variance::BRIGHT;
pub(crate) use arvo::{barycentrics, crosses};
pub(crate) use binary_tree::BinaryTree;
pub(crate) use discrete::Cumulative;
pub(crate) use light_bounds::LightBounds;
pub(crate) use triangle::OnTriangle;
use triangle::{Choice, ThenPoint};

/// A direction that a method drew.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// The triangle and the place on it, unless the method draws directions alone.
    pub(crate) light: usize,
    pub(crate) barycentrics: [f32; 2],
    /// Unit direction from the shading point.
    pub(crate) direction: Vec3,
    /// Density per solid angle: that of the point for emitters, that of the direction for portals.
    pub(crate) pdf: f64,
    /// What the method itself takes for the environment's radiance, if it keeps its own.
    pub(crate) radiance: Option<f64>,
}

/// A way to sample the lights of a scene.
pub(crate) trait Method: Sync {
    /// Draws a direction.
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn>;

    /// All that a host does at a point for one light sample: the density that its estimate is divided by. A method
    /// whose samples come with that density needs no more than [`Self::sample`].
    fn call(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<f64> {
        self.sample(x, u).map(|drawn| drawn.pdf)
    }

    /// Density per solid angle of what a method drew, evaluated independently of the draw.
    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64;

    /// Probability of choosing each light that is `wanted`, or `None` if the method chooses none.
    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>>;

    /// Memory that sampling needs.
    fn bytes(&self) -> usize;

    /// Whether it keeps an environment of its own, whose radiance it returns with each direction.
    fn has_own_environment(&self) -> bool {
        false
    }

    /// Whether directions into the sun are drawn without a choice of a triangle, so that the probabilities of triangles
    /// are not those of all samples.
    fn draws_suns_apart(&self) -> bool {
        false
    }

    /// Whether it is so slow that only its choice of a triangle is evaluated.
    fn is_slow(&self) -> bool {
        false
    }
}

/// Other arities of the tree over triangles than the default, and the least effort: run on any workload if they are
/// named.
pub(crate) const ON_REQUEST: [&str; 4] = ["fanlight-4", "fanlight-8", "fanlight-16", "fanlight-least"];

/// Methods that are run on a workload, or a variant of it, by default.
pub(crate) fn names(workload: &str) -> &'static [&'static str] {
    match workload {
        "cloud-10000" | "sphere-29" => &["fanlight", "talk-tree", "power", "binary-tree", "every-light"],
        "cloud-100000" => &["fanlight", "talk-tree", "power", "binary-tree"],
        "quad" => &[
            "fanlight",
            "talk-conservative",
            "talk-point-to-point",
            "talk-boundary",
            "uniform-area",
            "uniform-solid-angle",
            "texel-cdf",
            "tessellated",
        ],
        "sphere-9-spots" => &[
            "fanlight",
            "talk-conservative",
            "talk-point-to-point",
            "talk-boundary",
            "power",
            "every-light",
            "uniform-area",
            "uniform-solid-angle",
            "texel-cdf",
        ],
        "window" | "star" => &[
            "fanlight",
            "talk-conservative",
            "talk-point-to-point",
            "talk-boundary",
            "talk-footprint",
            "environment-reject",
            "portal-environment",
            "uniform-solid-angle",
            "harmonics-3",
            "harmonics-9",
            "rectified",
        ],
        "grid-1" => &[
            "fanlight",
            "talk-footprint",
            "environment-reject",
            "portal-environment",
            "uniform-solid-angle",
            "rectified",
        ],
        "nested" => &[
            "fanlight",
            "talk-footprint",
            "environment-reject",
            "power",
            "every-light",
            "portal-environment",
            "uniform-solid-angle",
            "rectified",
        ],
        "grid-100" => &[
            "fanlight",
            "talk-footprint",
            "environment-reject",
            "power",
            "every-light",
            "portal-environment",
            "uniform-solid-angle",
            "harmonics-3",
            "harmonics-9",
            "rectified",
        ],
        "grid-10000" => &[
            "fanlight",
            "talk-footprint",
            "environment-reject",
            "power",
            "portal-environment",
            "uniform-solid-angle",
            "rectified",
        ],
        // What does not see the clip map does the same as without.
        _ => &["fanlight", "talk-footprint", "uniform-solid-angle", "rectified"],
    }
}

/// Builds the data that a method needs for a scene.
pub(crate) fn build<'a>(name: &str, scene: &'a Scene) -> Box<dyn Method + 'a> {
    let talk = |illumination| Box::new(Fanlight::with(scene, Arity::default(), illumination));
    let of_arity = |arity| Box::new(Fanlight::with(scene, arity, Illumination::default()));
    match name {
        "fanlight" => Box::new(Fanlight::new(scene)),
        "fanlight-least" => Box::new(Fanlight::new(scene).with_effort(Effort::Least)),
        "fanlight-4" => of_arity(Arity::Four),
        "fanlight-8" => of_arity(Arity::Eight),
        "fanlight-16" => of_arity(Arity::Sixteen),
        "talk-conservative" => talk(Illumination::Conservative),
        "talk-point-to-point" => talk(Illumination::PointToPoint),
        "talk-boundary" => talk(Illumination::Boundary),
        "talk-footprint" => Box::new(talk::Talk::new(scene)),
        "power" => Box::new(ThenPoint::new(scene, Choice::Power(power::Power::new(scene)), OnTriangle::SolidAngle)),
        "binary-tree" | "uniform-solid-angle" => {
            Box::new(ThenPoint::new(scene, triangle::best_choice(scene), OnTriangle::SolidAngle))
        }
        "uniform-area" => Box::new(ThenPoint::new(scene, triangle::best_choice(scene), OnTriangle::Area)),
        "talk-tree" => {
            let binary = BinaryTree::new(&power::scene_bounds(scene));
            let choice = Choice::Wide(wide_tree::WideTree::new(&binary));
            Box::new(ThenPoint::new(scene, choice, OnTriangle::SolidAngle))
        }
        "every-light" => {
            let choice = Choice::Every(every_light::EveryLight::new(scene));
            Box::new(ThenPoint::new(scene, choice, OnTriangle::SolidAngle))
        }
        "texel-cdf" => Box::new(texel_cdf::TexelCdf::new(scene)),
        "tessellated" => Box::new(tessellated::Tessellated::new(scene)),
        "environment-reject" => Box::new(environment_reject::EnvironmentReject::new(scene)),
        "rectified" => Box::new(rectified::Rectified::new(scene)),
        "portal-environment" => Box::new(portal_environment::PortalEnvironment::new(scene)),
        "harmonics-3" | "harmonics-9" => {
            let degree = if name == "harmonics-3" { 3 } else { 9 };
            let choice = Choice::Harmonic(harmonic::Harmonic::new(scene, degree, f64::from(BRIGHT)));
            Box::new(ThenPoint::new(scene, choice, OnTriangle::SolidAngle))
        }
        _ => panic!("no method is called {name}"),
    }
}
