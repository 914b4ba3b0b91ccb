//! What sampling returns, and the points whose density can be requested.

use glam::Vec3;

use super::ids::{InstanceId, LightId, TriangleId};

/// A point on a light triangle, as a host's own intersector reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Hit {
    /// The triangle that was hit.
    pub triangle: TriangleId,
    /// Weights `b1`, `b2` of the second and third vertex; `b0 = 1 - b1 - b2` is the first one's.
    pub barycentrics: [f32; 2],
    /// The instance that the triangle belongs to, if it is a triangle of an object.
    pub instance: Option<InstanceId>,
}

impl Hit {
    /// Returns the point of a triangle with these weights `[b1, b2]` of its second and third vertex.
    #[must_use]
    pub const fn new(triangle: TriangleId, barycentrics: [f32; 2]) -> Self {
        Self { triangle, barycentrics, instance: None }
    }

    /// Returns the point of a triangle of an instance. The triangle is numbered within its object, and the weights
    /// `[b1, b2]` are those of the second and third vertex in the object's own order, in a mirror image as well.
    #[must_use]
    pub const fn on_instance(instance: InstanceId, triangle: TriangleId, barycentrics: [f32; 2]) -> Self {
        Self { triangle, barycentrics, instance: Some(instance) }
    }
}

/// What a sample was drawn on.
///
/// More kinds of lights may follow: match with a wildcard, and treat what is unknown like a sample of zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SampledLight {
    /// A point of a triangle.
    Triangle(Hit),
    /// A direction of the environment
    /// ([`environment_as_light`](crate::LightSamplerBuilder::environment_as_light)).
    Environment,
    /// A point of a light that has an extent and is not made of triangles: a sphere, for example. Of a distant light
    /// with an angular radius, a direction.
    Shape(LightId),
    /// A light without an extent: a point light, a spot, a light with a profile, or a distant light without an angular
    /// radius. No ray finds it by chance, so multiple importance sampling does not apply.
    Punctual(LightId),
}

impl SampledLight {
    /// Returns the point of the triangle; `None` for any other kind of light.
    #[inline]
    #[must_use]
    pub const fn hit(&self) -> Option<Hit> {
        match self {
            Self::Triangle(hit) => Some(*hit),
            Self::Environment | Self::Shape(_) | Self::Punctual(_) => None,
        }
    }

    /// Returns the light that is not made of triangles; `None` for a triangle and for the environment.
    #[inline]
    #[must_use]
    pub const fn id(&self) -> Option<LightId> {
        match self {
            Self::Shape(id) | Self::Punctual(id) => Some(*id),
            Self::Triangle(_) | Self::Environment => None,
        }
    }

    /// Whether the light has an extent, so that densities are densities. Of a light without an extent they are
    /// probabilities.
    #[inline]
    #[must_use]
    pub const fn has_extent(&self) -> bool {
        !matches!(self, Self::Punctual(_))
    }
}

/// A point on a light, or a direction of the environment, drawn for a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LightSample {
    /// What was drawn: a point of a triangle or of another light, or a direction of the environment.
    pub light: SampledLight,
    /// World position of the point. For the environment and distant lights, a position 10¹⁵ units away along the
    /// direction: behind everything that a scene can hold.
    pub position: Vec3,
    /// Unit normal of the front side: of a triangle, the side around which its vertices run counter-clockwise; of a
    /// sphere or a tube, the outside. For the environment, for distant lights, and for lights without an extent, the
    /// opposite of the direction.
    pub normal: Vec3,
    /// Unit direction from the shading point to the point.
    pub direction: Vec3,
    /// Distance from the shading point to the point. [`f32::INFINITY`] for the environment and for distant
    /// lights.
    pub distance: f32,
    /// Density of the point per solid angle at the shading point. Finite and above zero.
    ///
    /// It counts this light alone. Where a ray can cross several portals, a host that evaluates all that
    /// arrives along the direction divides by the density of the *direction* instead.
    ///
    /// For a light without an extent ([`Self::has_extent`]), this is no density but the probability of the light,
    /// `pmf`. Divide intensity over squared distance by it, or the irradiance of a distant light, and give the sample
    /// the weight 1.
    pub pdf: f32,
    /// Density of the same point per area of the light. Finite and above zero. For the environment, per area of the
    /// unit sphere, which is `pdf`. For a light without an extent, `pdf` too.
    pub pdf_area: f32,
    /// Probability (`pmf`) of having chosen the triangle or other light, or the environment. In `(0, 1]`.
    pub pmf: f32,
}

impl LightSample {
    /// Returns the point of the triangle that was drawn; `None` for any other kind of light.
    #[inline]
    #[must_use]
    pub const fn hit(&self) -> Option<Hit> {
        self.light.hit()
    }

    /// Whether the light has an extent. Of a light without one, `pdf` is a probability, and multiple importance
    /// sampling does not apply.
    #[inline]
    #[must_use]
    pub const fn has_extent(&self) -> bool {
        self.light.has_extent()
    }
}
