//! What a light tree knows of a cluster of lights.

use core::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use crate::geometry::{Aabb, Cone};
use crate::math;

/// Where the lights of a cluster are, which way they face and how much they send.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightBounds {
    pub(crate) aabb: Aabb,
    /// Normals of the front sides. Every light sends over the hemisphere around its normal (θe = π/2).
    pub(crate) normals: Cone,
    /// Weight times area of what does not depend on the direction it is seen from: mesh lights, and portals to a
    /// constant environment.
    pub(crate) flux: f32,
    /// Transmittance times area times the mean radiance of the environment, of portals to an image.
    pub(crate) portal: f32,
    /// Whether any of the lights sends from its back as well.
    pub(crate) two_sided: bool,
}

impl LightBounds {
    /// Bounds of both clusters together.
    pub(crate) fn union(self, mut other: Self) -> Self {
        // The sign of a two-sided light's normal says nothing, so it is free to agree.
        if self.two_sided && other.two_sided && self.normals.axis.dot(other.normals.axis) < 0.0 {
            other.normals.axis = -other.normals.axis;
        }
        Self {
            aabb: self.aabb.union(other.aabb),
            normals: self.normals.union(other.normals),
            flux: self.flux + other.flux,
            portal: self.portal + other.portal,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// All that the cluster sends.
    pub(crate) fn energy(&self) -> f32 {
        self.flux + self.portal
    }

    /// The directions that the cluster may send into, as a solid angle weighted by the falloff at its rim:
    /// `M_Ω` of the surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.1) for θe = π/2.
    pub(crate) fn orientation_measure(&self) -> f32 {
        let theta_o = self.normals.theta;
        let theta_w = (theta_o + FRAC_PI_2).min(PI);
        let (sin_o, cos_o) = math::sin_cos(theta_o);
        let (_, cos_rim) = math::sin_cos(theta_o - 2.0 * theta_w);
        let one_side =
            2.0 * PI * (1.0 - cos_o) + FRAC_PI_2 * (2.0 * theta_w * sin_o - cos_rim - 2.0 * theta_o * sin_o + cos_o);
        if self.two_sided { (2.0 * one_side).min(4.0 * PI) } else { one_side }
    }

    /// What a cluster costs in the surface area orientation heuristic: `M_A · M_Ω · energy`.
    pub(crate) fn cost(&self, pad: f32) -> f32 {
        self.aabb.padded_area(pad) * self.orientation_measure() * self.energy()
    }
}

/// How the energy of a cluster is spread: what a light tree estimates irradiance from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moments {
    /// All that the cluster sends.
    pub(crate) energy: f32,
    /// Mean position, by energy.
    pub(crate) mean: Vec3,
    /// Mean squared distance from the mean position.
    pub(crate) variance: f32,
    /// Mean unit normal; the shorter it is, the more the normals differ.
    pub(crate) normal: Vec3,
}

impl Moments {
    /// Moments of both clusters together. `flip` turns the normals of the second around first.
    pub(crate) fn union(self, other: Self, flip: bool) -> Self {
        let energy = self.energy + other.energy;
        let share = if energy > 0.0 { other.energy / energy } else { 0.5 };
        let between = other.mean - self.mean;
        let normal = if flip { -other.normal } else { other.normal };
        Self {
            energy,
            mean: self.mean + share * between,
            variance: self.variance * (1.0 - share)
                + other.variance * share
                + share * (1.0 - share) * between.length_squared(),
            normal: self.normal.lerp(normal, share),
        }
    }
}
