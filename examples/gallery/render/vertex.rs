//! The points of a path.

use core::f32::consts::PI;

use glam::Vec3;

use super::bsdf::Bsdf;
use super::lighting::LightsAt;
use super::random::Random;
use super::scene::Point;
use super::technique::ChoiceAt;

/// A point of a path, and how light is sampled there.
pub(super) struct Vertex<'a> {
    pub(super) place: Place,
    pub(super) lights: ChoiceAt<'a>,
    pub(super) guide: Option<LightsAt<'a>>,
    /// Density per area with which the path came here from the vertex before, if the end of a light ray could have
    /// stood in its place.
    pub(super) arrival: Option<f32>,
}

/// What light is scattered by.
pub(super) enum Place {
    Surface(Point, Bsdf),
    /// Evenly in all directions.
    Fog(Vec3),
}

impl Vertex<'_> {
    pub(super) fn position(&self) -> Vec3 {
        match &self.place {
            Place::Surface(point, _) => point.position,
            Place::Fog(position) => *position,
        }
    }

    /// Where a ray starts that leaves in a direction.
    pub(super) fn start(&self, direction: Vec3) -> Vec3 {
        match &self.place {
            Place::Surface(point, _) => point.start(direction),
            Place::Fog(position) => *position,
        }
    }

    /// Share of the radiance from a direction that is scattered, per solid angle.
    pub(super) fn value(&self, direction: Vec3) -> Vec3 {
        match &self.place {
            Place::Surface(_, bsdf) => bsdf.value(direction),
            Place::Fog(_) => Vec3::splat(0.25 / PI),
        }
    }

    /// A direction in which the path goes on, and the share of the radiance from there.
    pub(super) fn scatter(&self, random: &mut Random) -> Option<(Vec3, Vec3)> {
        let [choice, rest @ ..]: [f32; 4] = random.take();
        let direction = match (&self.guide, &self.place) {
            (Some(guide), _) if choice < 0.5 => guide.sample(rest)?.direction,
            (_, Place::Surface(_, bsdf)) => bsdf.sample(rest),
            (_, Place::Fog(_)) => {
                let height = 1.0 - 2.0 * rest[0];
                let disc = (1.0 - height * height).sqrt() * glam::Vec2::from_angle(2.0 * PI * rest[1]);
                disc.extend(height)
            }
        };
        let value = self.value(direction);
        (value != Vec3::ZERO).then_some((direction, value))
    }

    /// Density per solid angle of [`scatter`](Self::scatter)'s directions.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let own = match &self.place {
            Place::Surface(_, bsdf) => bsdf.pdf(direction),
            Place::Fog(_) => 0.25 / PI,
        };
        self.guide.as_ref().map_or(own, |guide| 0.5 * (own + guide.pdf(direction)))
    }
}
