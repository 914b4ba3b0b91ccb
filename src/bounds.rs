//! Bounds and moments of a cluster of lights.

use core::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec3, Vec4};

use crate::geometry::{Aabb, Cone};
use crate::math;

/// Returns an energy in single precision, zero only if it is zero.
pub(crate) fn storable(energy: f64) -> f32 {
    if energy > 0.0 { energy.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32 } else { 0.0 }
}

/// Least share of the hemisphere that a light counts as sending into: a cone of 8 degrees. *Chosen*.
///
/// Larger: narrower beams count as dimmer than they are. Smaller: a beam that next to nothing is in counts as bright.
const NARROWEST_BEAM: f32 = 0.01;

/// Where the lights of a cluster are, which way they face and how much they send.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightBounds {
    pub(crate) aabb: Aabb,
    /// Normals of the front sides.
    pub(crate) normals: Cone,
    /// Largest angle to its normal at which a light sends (θe): π/2 for surfaces, less for spots, and π for what sends
    /// in all directions and has no normal.
    pub(crate) emission: f32,
    /// Weight times area of what does not depend on the direction it is seen from: mesh lights, and portals to a
    /// constant environment.
    pub(crate) flux: f32,
    /// Transmittance times area times the mean radiance of the environment, of portals to an image.
    pub(crate) portal: f32,
    /// Whether any of the lights sends from its back as well.
    pub(crate) two_sided: bool,
}

impl LightBounds {
    /// Bounds of no light.
    pub(crate) const NONE: Self = Self {
        aabb: Aabb::EMPTY,
        normals: Cone::single(Vec3::Z),
        emission: 0.0,
        flux: 0.0,
        portal: 0.0,
        two_sided: false,
    };

    /// Returns the bounds of both clusters together.
    pub(crate) fn union(self, mut other: Self) -> Self {
        // The sign of a two-sided light's normal says nothing, so it is free to agree.
        if self.two_sided && other.two_sided && self.normals.axis.dot(other.normals.axis) < 0.0 {
            other.normals.axis = -other.normals.axis;
        }
        Self {
            aabb: self.aabb.union(other.aabb),
            normals: self.normals.union(other.normals),
            emission: self.emission.max(other.emission),
            flux: self.flux + other.flux,
            portal: self.portal + other.portal,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// Returns all energy that the cluster sends.
    pub(crate) fn energy(&self) -> f32 {
        self.flux + self.portal
    }

    /// Returns the energy over the part of the hemisphere around each normal that it is sent into, or over two
    /// hemispheres for what sends everywhere.
    pub(crate) fn brightness(&self) -> f32 {
        let (_, cos) = math::sin_cos(self.emission);
        self.energy() / (1.0 - cos).max(NARROWEST_BEAM)
    }

    /// Returns the cost of the cluster in the surface area orientation heuristic: `M_A · M_Ω · energy`.
    pub(crate) fn cost(&self) -> f64 {
        let (_, cos) = math::sin_cos(self.normals.theta);
        f64::from(self.aabb.area()) * f64::from(orientation_measure(cos, self.two_sided) * self.energy())
    }
}

/// Returns the solid angle, weighted by the falloff at its rim, of the directions that lights may send into whose
/// normals are within an angle with this cosine of an axis: `M_Ω` of the surface area orientation heuristic (Conty
/// Estevez and Kulla 2018, section 4.1) for θe = π/2, where all of its arccosines but one cancel. That one is
/// approximated to within 7e-5 radians (Abramowitz and Stegun 1964, 4.4.45).
#[inline]
pub(crate) fn orientation_measure(cos: f32, two_sided: bool) -> f32 {
    let sin = math::sqrt((1.0 - cos * cos).max(0.0));
    let one_side = if cos >= 0.0 {
        2.0 * PI - PI * cos + 0.5 * PI * PI * sin
    } else {
        let x = -cos;
        let polynomial = ((-0.018_729_3 * x + 0.074_261) * x - 0.212_114_4) * x + FRAC_PI_2;
        let rest = math::sqrt((1.0 - x).max(0.0)) * polynomial;
        2.0 * PI * (1.0 + x) + PI * rest * sin
    };
    if two_sided { (2.0 * one_side).min(4.0 * PI) } else { one_side }
}

/// Returns [`orientation_measure`] of four clusters at once, bit for bit. `sides` is 1 for what has one side, and 2 for
/// what has two.
#[inline(always)]
pub(crate) fn orientation_measures(cos: Vec4, sides: Vec4) -> Vec4 {
    let roots = |squares: Vec4| squares.max(Vec4::ZERO).sqrt();
    let sin = roots(1.0 - cos * cos);
    let narrow = 2.0 * PI - PI * cos + 0.5 * PI * PI * sin;
    let x = -cos;
    let polynomial = ((-0.018_729_3 * x + 0.074_261) * x - 0.212_114_4) * x + FRAC_PI_2;
    let wide = 2.0 * PI * (1.0 + x) + PI * (roots(1.0 - x) * polynomial) * sin;
    let one_side = Vec4::select(cos.cmpge(Vec4::ZERO), narrow, wide);
    Vec4::select(sides.cmpgt(Vec4::ONE), (2.0 * one_side).min(Vec4::splat(4.0 * PI)), one_side)
}

/// First and second moments of the energy of a cluster, from which a light tree estimates irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moments {
    /// Energy that the cluster sends.
    pub(crate) energy: f32,
    /// Mean position, by energy.
    pub(crate) mean: Vec3,
    /// Mean squared distance from the mean position.
    pub(crate) variance: f32,
    /// Mean unit normal; the shorter it is, the more the normals differ.
    pub(crate) normal: Vec3,
}

impl Moments {
    /// Moments of no light.
    pub(crate) const NONE: Self = Self { energy: 0.0, mean: Vec3::ZERO, variance: 0.0, normal: Vec3::Z };

    /// Returns the moments of both clusters together. `flip` reverses the normals of the second first.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's formula.
    fn by_angles(theta_o: f64) -> f64 {
        let pi = core::f64::consts::PI;
        let theta_w = (theta_o + 0.5 * pi).min(pi);
        let (sin_o, cos_o) = theta_o.sin_cos();
        let rim = (theta_o - 2.0 * theta_w).cos();
        2.0 * pi * (1.0 - cos_o) + 0.5 * pi * (2.0 * theta_w * sin_o - rim - 2.0 * theta_o * sin_o + cos_o)
    }

    #[test]
    fn the_orientation_measure_is_the_paper_s() {
        for i in 0..=180 {
            let theta = f64::from(i).to_radians();
            let exact = by_angles(theta);
            let one = f64::from(orientation_measure(theta.cos() as f32, false));
            let two = f64::from(orientation_measure(theta.cos() as f32, true));
            assert!((one / exact - 1.0).abs() < 1e-4, "{i} degrees: {one} {exact}");
            assert!((two / (2.0 * exact).min(4.0 * core::f64::consts::PI) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn four_measures_are_those_of_each() {
        for i in 0..=1000 {
            let cos = 1.0 - i as f32 / 500.0;
            for (sides, two_sided) in [(1.0, false), (2.0, true)] {
                let four = orientation_measures(Vec4::new(0.5, cos, -0.5, -1.0), Vec4::new(2.0, sides, 1.0, 1.0));
                assert_eq!(four.y.to_bits(), orientation_measure(cos, two_sided).to_bits(), "{cos}");
            }
        }
    }
}
