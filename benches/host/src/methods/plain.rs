//! What hosts have: each kind of light its own technique, none knows of the others.

use glam::Vec3;

use super::emitters::{Choice, EmitterTable};
use super::environment::EnvironmentTable;
use super::portals::RectanglePortals;
use super::{Lighting, LightsHere, Proposal, Target};
use crate::bsdf::Vertex;
use crate::random::Pcg32;
use crate::world::{EmitterPoint, World};

/// Any of three techniques, each of which is sampled once a vertex. Without any, the surface's own samples are all.
#[derive(Clone, Debug, Default)]
pub(super) struct Plain {
    environment: Option<EnvironmentTable>,
    portals: Option<RectanglePortals>,
    emitters: Option<EmitterTable>,
}

impl Plain {
    /// Adds directions to the sky by its luminance, if there is one.
    pub(super) fn with_sky(mut self, world: &World) -> Self {
        self.environment = world.scene.sky.as_ref().and_then(EnvironmentTable::new);
        self
    }

    /// Adds directions through the windows. `None` if there is none, or one that is not a rectangle.
    pub(super) fn with_portals(self, world: &World) -> Option<Self> {
        RectanglePortals::new(world).map(|portals| Self { portals: Some(portals), ..self })
    }

    /// Adds points on emitters, of which there has to be one.
    pub(super) fn with_emitters(mut self, world: &World, choice: Choice) -> Self {
        self.emitters = Some(EmitterTable::new(world, choice));
        self
    }
}

/// The techniques as seen from a vertex.
pub(super) struct Here<'a> {
    plain: &'a Plain,
    vertex: Vertex,
}

impl Lighting for Plain {
    type Here<'a> = Here<'a>;

    #[inline]
    fn at(&self, vertex: &Vertex) -> Here<'_> {
        Here { plain: self, vertex: *vertex }
    }
}

impl LightsHere for Here<'_> {
    #[inline]
    fn propose(&self, random: &mut Pcg32, mut visit: impl FnMut(Proposal)) {
        if let Some(environment) = &self.plain.environment {
            let (direction, pdf) = environment.sample(random);
            let others = self.plain.portals.as_ref().map_or(0.0, |p| p.pdf(self.vertex.position, direction));
            visit(Proposal { direction, target: Target::Sky, pdf: pdf + others });
        }
        if let Some(portals) = &self.plain.portals
            && let Some((direction, pdf)) = portals.sample(self.vertex.position, random)
        {
            let others = self.plain.environment.as_ref().map_or(0.0, |e| e.pdf(direction));
            visit(Proposal { direction, target: Target::Sky, pdf: pdf + others });
        }
        if let Some(emitters) = &self.plain.emitters
            && let Some(proposal) = emitters.sample(&self.vertex, random)
        {
            visit(proposal);
        }
    }

    #[inline]
    fn sky_pdf(&self, direction: Vec3) -> f32 {
        self.plain.environment.as_ref().map_or(0.0, |environment| environment.pdf(direction))
            + self.plain.portals.as_ref().map_or(0.0, |portals| portals.pdf(self.vertex.position, direction))
    }

    #[inline]
    fn emitter_pdf(&self, point: &EmitterPoint, direction: Vec3) -> f32 {
        self.plain.emitters.as_ref().map_or(0.0, |emitters| emitters.pdf(&self.vertex, point, direction))
    }
}
