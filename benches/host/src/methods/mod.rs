//! Ways to choose light.

mod alias;
mod emitters;
mod environment;
mod fanlight;
mod plain;
mod portals;
mod spherical_rectangle;

use ::fanlight::Effort;
use glam::Vec3;

use crate::Error;
use crate::bsdf::{Material, Vertex};
use crate::clock::thread_seconds;
use crate::film::Film;
use crate::integrator::render_pass;
use crate::random::Pcg32;
use crate::world::{EmitterPoint, World};

use emitters::Choice;
use fanlight::Fanlight;
use plain::Plain;

/// Where a technique looks for light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Target {
    /// The sky, if nothing is in between.
    Sky,
    /// A point of an emitter.
    Emitter(EmitterPoint),
}

/// A direction that is worth tracing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proposal {
    pub(crate) direction: Vec3,
    pub(crate) target: Target,
    /// Density per solid angle with which all of the method's light techniques together propose this target.
    pub(crate) pdf: f32,
}

/// A way to choose light, but for the surface's own samples.
pub(crate) trait Lighting {
    /// What is prepared for one vertex.
    type Here<'a>: LightsHere
    where
        Self: 'a;

    /// Returns the lights as seen from a vertex.
    fn at(&self, vertex: &Vertex) -> Self::Here<'_>;
}

/// The lights as seen from one vertex.
pub(crate) trait LightsHere {
    /// Draws one sample of each technique.
    fn propose(&self, random: &mut Pcg32, visit: impl FnMut(Proposal));

    /// Returns the density per solid angle with which the sky is proposed along a direction.
    fn sky_pdf(&self, direction: Vec3) -> f32;

    /// Returns the density per solid angle with which an emitter's point is proposed.
    fn emitter_pdf(&self, point: &EmitterPoint, direction: Vec3) -> f32;
}

/// One of the methods that are compared.
pub(crate) struct Method {
    pub(crate) name: &'static str,
    lighting: AnyLighting,
    /// CPU time that was spent before the first image, and is part of each.
    pub(crate) preparation: f64,
}

enum AnyLighting {
    Plain(Box<Plain>),
    Fanlight(Box<Fanlight>),
}

/// Does the same with either kind of lighting.
macro_rules! with {
    ($method:expr, $lighting:ident => $body:expr) => {
        match &$method.lighting {
            AnyLighting::Plain($lighting) => $body,
            AnyLighting::Fanlight($lighting) => $body,
        }
    };
}

impl Method {
    /// Returns the methods that a scene is rendered with: what hosts have, and at last fanlight; where there are glossy
    /// surfaces, once without their lobes; and once with what walls hide, if there are rays to learn it by.
    pub(crate) fn all(world: &World, bounces: u32, learned_rays: u64) -> Result<Vec<Self>, Error> {
        let mut methods = Self::competitors(world);
        let ours =
            |name, fanlight| Self { name, lighting: AnyLighting::Fanlight(Box::new(fanlight)), preparation: 0.0 };
        methods.push(ours("fanlight", Fanlight::new(world)?));
        if !world.scene.portals.is_empty() {
            for (name, first) in [("fanlight@later-least", Effort::Full), ("fanlight@least", Effort::Least)] {
                methods.push(ours(name, Fanlight::new(world)?.with_efforts([first, Effort::Least])));
            }
        }
        let is_glossy = |(_, material): &(_, Material)| matches!(material, Material::Glossy { .. });
        if world.scene.solids.iter().any(is_glossy) {
            methods.push(ours("fanlight@blind", Fanlight::new(world)?.blind()));
        }
        if learned_rays > 0 {
            let fanlight = Fanlight::new(world)?;
            let before = thread_seconds();
            let method = ours("fanlight@visibility", fanlight.learned(world, bounces, learned_rays)?);
            methods.push(Self { preparation: thread_seconds() - before, ..method });
        }
        Ok(methods)
    }

    /// Returns what hosts have.
    fn competitors(world: &World) -> Vec<Self> {
        let plain = |name, plain| Self { name, lighting: AnyLighting::Plain(Box::new(plain)), preparation: 0.0 };
        let mut methods = vec![plain("bsdf", Plain::default())];
        let has_emitters = !world.emitters.is_empty();
        if has_emitters {
            for (name, choice) in [("power", Choice::Power), ("uniform", Choice::Uniform)] {
                methods.push(plain(name, Plain::default().with_sky(world).with_emitters(world, choice)));
            }
        } else {
            methods.push(plain("environment", Plain::default().with_sky(world)));
        }
        if let Some(portals) = Plain::default().with_portals(world) {
            let portals = if has_emitters { portals.with_emitters(world, Choice::Power) } else { portals };
            methods.push(plain("rectangle", portals));
        }
        methods
    }

    /// Returns all techniques of the competitors together, for references.
    pub(crate) fn for_reference(world: &World) -> Self {
        let mut plain = Plain::default().with_portals(world).unwrap_or_default().with_sky(world);
        if !world.emitters.is_empty() {
            plain = plain.with_emitters(world, Choice::Power);
        }
        Self { name: "reference", lighting: AnyLighting::Plain(Box::new(plain)), preparation: 0.0 }
    }

    /// Whether this is what others are compared with.
    pub(crate) const fn is_competitor(&self) -> bool {
        matches!(self.lighting, AnyLighting::Plain(_))
    }

    /// Adds one sample to every pixel.
    pub(crate) fn render_pass(&self, world: &World, bounces: u32, random: &mut Pcg32, film: &mut Film) {
        with!(self, lighting => render_pass(world, &**lighting, bounces, random, film.add_pass()));
    }

    /// Asks for light at vertices, as the path tracer does: [`Lighting::at`], the samples and their densities. Returns
    /// a number that depends on all answers.
    pub(crate) fn call(&self, vertices: &[Vertex], random: &mut Pcg32) -> f32 {
        with!(self, lighting => call(&**lighting, vertices, random))
    }

    /// Whether a technique ever proposes something at a vertex that the surface scatters.
    pub(crate) fn reaches(&self, vertex: &Vertex, tries: u32, random: &mut Pcg32) -> bool {
        with!(self, lighting => {
            let here = lighting.at(vertex);
            let mut is_reached = false;
            for _ in 0..tries {
                here.propose(random, |proposal| is_reached |= vertex.scattered(proposal.direction) != Vec3::ZERO);
            }
            is_reached
        })
    }
}

fn call<L: Lighting>(lighting: &L, vertices: &[Vertex], random: &mut Pcg32) -> f32 {
    let mut sum = 0.0;
    for vertex in vertices {
        lighting.at(vertex).propose(random, |proposal| sum += proposal.pdf);
    }
    sum
}
