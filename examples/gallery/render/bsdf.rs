//! How a surface scatters light: Lambert's lobe on both sides, and Phong's or that of microfacets on one.

use core::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::facets::Facets;
use super::material::Lobe;
use super::sky::LUMINANCE;

/// The scattering of one point for one outgoing direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf {
    reflected: Vec3,
    transmitted: Vec3,
    glossy: Vec3,
    exponent: f32,
    /// What takes the place of Phong's lobe, if anything does.
    facets: Option<Facets>,
    /// To the side of the outgoing direction.
    normal: Vec3,
    mirror: Vec3,
    /// With which probability each of the three lobes is sampled.
    shares: [f32; 3],
}

impl Bsdf {
    /// The scattering towards `outgoing`, which is on the side of the normal.
    pub(crate) fn new(lobe: Lobe, color: Vec3, normal: Vec3, outgoing: Vec3) -> Self {
        let (mut reflected, mut transmitted, mut glossy, mut exponent) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, 0.0);
        let mut facets = None;
        match lobe {
            Lobe::Diffuse => reflected = color,
            Lobe::Clear => {}
            Lobe::Translucent(share) => (reflected, transmitted) = ((1.0 - share) * color, share * color),
            Lobe::Glossy(sharpness) => (glossy, exponent) = (color, sharpness),
            Lobe::Rough(alpha) => (glossy, facets) = (color, Some(Facets::new(alpha, normal, outgoing))),
        }
        let weights = [reflected, transmitted, glossy].map(|color| color.dot(LUMINANCE));
        let sum = weights.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        let mirror = 2.0 * normal.dot(outgoing) * normal - outgoing;
        let shares = weights.map(|weight| weight / sum);
        Self { reflected, transmitted, glossy, exponent, facets, normal, mirror, shares }
    }

    /// To the side of the outgoing direction.
    pub(crate) const fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The microfacets, if there are any.
    pub(super) const fn facets(&self) -> Option<&Facets> {
        self.facets.as_ref()
    }

    /// Whether nothing is scattered.
    pub(crate) fn is_black(&self) -> bool {
        [self.reflected, self.transmitted, self.glossy] == [Vec3::ZERO; 3]
    }

    /// Whether light comes through from behind.
    pub(crate) fn transmits(&self) -> bool {
        self.shares[1] > 0.0
    }

    /// Share of the radiance from a direction that is scattered, per solid angle: the cosine is in it.
    pub(crate) fn value(&self, incoming: Vec3) -> Vec3 {
        let cosine = self.normal.dot(incoming);
        if cosine <= 0.0 {
            return -cosine * FRAC_1_PI * self.transmitted;
        }
        let glossy = match (self.shares[2], &self.facets) {
            (0.0, _) => Vec3::ZERO,
            (_, Some(facets)) => return self.glossy * facets.value(incoming),
            (_, None) => self.glossy * ((self.exponent + 2.0) / TAU * self.phong(incoming)),
        };
        cosine * (FRAC_1_PI * self.reflected + glossy)
    }

    /// A direction with the density of [`pdf`](Self::pdf).
    pub(crate) fn sample(&self, [choice, u, v]: [f32; 3]) -> Vec3 {
        let [reflected, transmitted, _] = self.shares;
        if choice < reflected {
            around(self.normal, u.sqrt(), v)
        } else if choice < reflected + transmitted {
            around(-self.normal, u.sqrt(), v)
        } else if let Some(facets) = &self.facets {
            facets.sample(u, v)
        } else {
            around(self.mirror, u.powf(1.0 / (self.exponent + 1.0)), v)
        }
    }

    /// Density per solid angle of sampled directions.
    pub(crate) fn pdf(&self, incoming: Vec3) -> f32 {
        let cosine = self.normal.dot(incoming);
        let diffuse = if cosine > 0.0 { self.shares[0] } else { self.shares[1] };
        let glossy = match (self.shares[2], &self.facets) {
            (0.0, _) => 0.0,
            (_, Some(_)) if cosine <= 0.0 => 0.0,
            (share, Some(facets)) => share * facets.pdf(incoming),
            (share, None) => share * (self.exponent + 1.0) / TAU * self.phong(incoming),
        };
        diffuse * cosine.abs() * FRAC_1_PI + glossy
    }

    fn phong(&self, incoming: Vec3) -> f32 {
        self.mirror.dot(incoming).max(0.0).powf(self.exponent)
    }
}

/// The unit vector at an angle of this cosine around an axis.
fn around(axis: Vec3, cosine: f32, turn: f32) -> Vec3 {
    let disc = (1.0 - cosine * cosine).max(0.0).sqrt() * Vec2::from_angle(TAU * turn);
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    (disc.x * tangent + disc.y * bitangent + cosine * axis).normalize()
}
