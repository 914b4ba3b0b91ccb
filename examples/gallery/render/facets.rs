//! Rough mirrors: isotropic GGX with height-correlated masking (Heitz 2014), without Fresnel.

use core::f32::consts::{PI, TAU};

use fanlight::Glossy;
use glam::{Mat3, Vec2, Vec3, vec2, vec3};

/// The microfacets of one point for one outgoing direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facets {
    alpha: f32,
    normal: Vec3,
    outgoing: Vec3,
}

impl Facets {
    pub(super) const fn new(alpha: f32, normal: Vec3, outgoing: Vec3) -> Self {
        Self { alpha, normal, outgoing }
    }

    /// What `fanlight` is told of them.
    pub(super) fn glossy(&self) -> Glossy {
        Glossy::new(self.normal, self.outgoing, self.alpha).with_weights(0.0, 1.0)
    }

    /// Share of the radiance from a direction above the surface that is reflected, per solid angle: the cosine is in
    /// it.
    pub(super) fn value(&self, incoming: Vec3) -> f32 {
        let cosine = self.cosine();
        let masking = 1.0 + self.lambda(cosine) + self.lambda(self.normal.dot(incoming));
        self.distribution(incoming) / (4.0 * cosine * masking)
    }

    /// Density per solid angle of [`sample`](Self::sample)'s directions.
    pub(super) fn pdf(&self, incoming: Vec3) -> f32 {
        let cosine = self.cosine();
        self.distribution(incoming) / (4.0 * cosine * (1.0 + self.lambda(cosine)))
    }

    /// A direction through a visible normal (Heitz 2018), which may be below the surface.
    pub(super) fn sample(&self, u: f32, v: f32) -> Vec3 {
        let (tangent, bitangent) = self.normal.any_orthonormal_pair();
        let frame = Mat3::from_cols(tangent, bitangent, self.normal);
        let stretched = (frame.transpose() * self.outgoing * vec3(self.alpha, self.alpha, 1.0)).normalize();
        let across = vec2(-stretched.y, stretched.x).normalize_or(Vec2::X).extend(0.0);
        let disc = u.sqrt() * Vec2::from_angle(TAU * v);
        let share = 0.5 * (1.0 + stretched.z);
        let y = (1.0 - share) * (1.0 - disc.x * disc.x).max(0.0).sqrt() + share * disc.y;
        let z = (1.0 - disc.x * disc.x - y * y).max(0.0).sqrt();
        let facet = disc.x * across + y * stretched.cross(across) + z * stretched;
        let facet = frame * vec3(self.alpha * facet.x, self.alpha * facet.y, facet.z.max(1e-6)).normalize();
        (2.0 * facet.dot(self.outgoing) * facet - self.outgoing).normalize()
    }

    /// Density of facets that mirror a direction to the outgoing one.
    fn distribution(&self, incoming: Vec3) -> f32 {
        let cosine = self.normal.dot((incoming + self.outgoing).normalize());
        let alpha2 = self.alpha * self.alpha;
        // In this form nothing cancels where the lobe is narrow.
        let tail = (1.0 - cosine * cosine).max(0.0) + alpha2 * cosine * cosine;
        alpha2 / (PI * tail * tail)
    }

    /// Smith's Λ.
    fn lambda(&self, cosine: f32) -> f32 {
        let tangent2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        0.5 * ((1.0 + self.alpha * self.alpha * tangent2).sqrt() - 1.0)
    }

    fn cosine(&self) -> f32 {
        self.normal.dot(self.outgoing).max(1e-6)
    }
}
