//! The lobes of a surface with microfacets as the loops need them: one formula for the side of the normal and for the
//! other.

use core::f32::consts::FRAC_2_PI;

use super::LEAST_ACROSS2;
use crate::math::{at_least, at_most, sqrt};
use crate::receiver::glossy::LEAST_SUM2;
use crate::receiver::lobe::Lobe;

/// Least part of the determinant in the denominator of the distribution. *Proved*: a half vector of unit length leaves
/// more, but that of opposite directions is zero. Larger: peaks are cut off.
const LEAST_TAIL: f32 = 0.25;

/// Least squared distance. *Proved*: its inverse is finite. A larger one would show in tiny scenes.
const LEAST_DISTANCE2: f32 = 1e-30;

/// Variation of a region that the surface's own plane halves, where the two sides differ. Chosen: what is farther from
/// the plane than its own deviation counts as constant.
///
/// Larger: divides cells that are hardly cut. Smaller: the lobe of one side stands for both.
const PLANE_VARIATION: f32 = 0.16;

/// What light from one side of a surface meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// Index of refraction of the lobe, 1 without a refraction.
    pub(super) ior: f32,
    /// What heights over the plane are multiplied by: -1 where they are mirrored.
    pub(super) upright: f32,
    /// Sign of the product of both directions' cosines to the half vector.
    pub(super) turn: f32,
    /// Weight of the cosine: that of the diffuse base, with the share of the lobe that guides like it.
    pub(super) even: f32,
    /// Weight of the cosine on the other side, for what a region has there.
    pub(super) other: f32,
    /// Weight of the lobe.
    pub(super) share: f32,
}

/// Microfacet lobes over a diffuse base, prepared for loops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MicrofacetLobe {
    /// Tangent, bitangent and normal.
    pub(super) frame: [[f32; 3]; 3],
    /// Outgoing direction in this frame.
    pub(super) outgoing: [f32; 3],
    /// Squared roughness along the tangent and across.
    pub(super) alpha2: [f32; 2],
    /// `√(cos² θo + αx² ox² + αy² oy²)`, a part of Smith's term.
    pub(super) masking: f32,
    /// The side of the normal, and the other.
    pub(super) sides: [Side; 2],
    /// Weight of every direction.
    pub(super) least: f32,
    /// 1 if light comes from both sides, and zero otherwise.
    pub(super) transmits: f32,
}

/// Half vectors of one direction.
pub(super) struct Halfway {
    /// Sum of the outgoing direction and the direction times the index, in the frame of the lobe.
    pub(super) sum: [f32; 3],
    /// One over the squared length of the sum.
    pub(super) inverse2: f32,
    /// Products of the outgoing direction, and of the direction, with the sum.
    pub(super) along: [f32; 2],
}

impl MicrofacetLobe {
    /// Returns a vector in the frame of the lobe.
    #[inline(always)]
    pub(super) fn local(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [[tx, ty, tz], [bx, by, bz], [nx, ny, nz]] = self.frame;
        // Not a map, whose closure would be compiled for the baseline.
        [tx * x + ty * y + tz * z, bx * x + by * y + bz * z, nx * x + ny * y + nz * z]
    }

    /// Returns the side that a height over the plane is on.
    #[inline(always)]
    pub(super) fn side(&self, height: f32) -> Side {
        let [above, below] = self.sides;
        let is_below = self.transmits * height < 0.0;
        let choose = |a: f32, b: f32| if is_below { b } else { a };
        Side {
            ior: choose(above.ior, below.ior),
            upright: choose(above.upright, below.upright),
            turn: choose(above.turn, below.turn),
            even: choose(above.even, below.even),
            other: choose(above.other, below.other),
            share: choose(above.share, below.share),
        }
    }

    #[inline(always)]
    pub(super) fn halfway(&self, side: &Side, [t, b, n]: [f32; 3]) -> Halfway {
        let ([ot, ob, on], ior) = (self.outgoing, side.ior);
        let cosine = ot * t + ob * b + on * n;
        let (ht, hb, hn) = (ot + ior * t, ob + ior * b, on + ior * n);
        let sum2 = at_least(ht * ht + hb * hb + hn * hn, LEAST_SUM2);
        Halfway { sum: [ht, hb, hn], inverse2: 1.0 / sum2, along: [1.0 + ior * cosine, cosine + ior] }
    }

    /// Returns the weight of the lobe in a unit direction of the lobe's frame, blurred by a variance of directions.
    /// `cosine` is the absolute one.
    #[inline(always)]
    pub(super) fn value(&self, side: &Side, cosine: f32, [t, b, n]: [f32; 3], spread2: f32) -> f32 {
        let n = side.upright * n;
        let Halfway { sum: [ht, hb, hn], inverse2, along: [out, toward] } = self.halfway(side, [t, b, n]);
        let [x2, y2] = self.alpha2;
        let ior2 = side.ior * side.ior;
        // The movement of the half vector across the plane of incidence, and in it.
        let blur = spread2 * ior2 * inverse2;
        let (across, inside) = (at_most(blur, 1.0), at_most(blur * (toward * toward * inverse2), 1.0));
        let (a, c) = (x2 + inside, y2 + inside);
        // What the direction has across the half vector points along the plane of incidence.
        let scale = toward * inverse2;
        let (et, eb) = (t - scale * ht, b - scale * hb);
        let (et2, eb2) = (et * et, eb * eb);
        let rest = at_least(across - inside, 0.0) / at_least(et2 + eb2, LEAST_ACROSS2);
        // The matrix is diag(a, c) + rest f fᵀ with f = (-eb, et). In this form nothing cancels.
        let determinant = a * c + rest * (c * eb2 + a * et2);
        let (ht2, hb2, eh) = (ht * ht, hb * hb, et * ht + eb * hb);
        let slope = (c * ht2 + a * hb2 + rest * (eh * eh)) * inverse2;
        // Wider than 1 it would be no distribution of heights.
        let limit = at_least(at_least(a + rest * eb2, c + rest * et2), 1.0);
        let tail = limit * slope + determinant * (hn * hn * inverse2);
        let tail = at_least(tail, LEAST_TAIL * determinant);
        // π D:
        let distribution = limit * determinant * sqrt(determinant) / (tail * tail);
        // G / (4 cos θ cos θo):
        let shadowing = sqrt(cosine * cosine + x2 * (t * t) + y2 * (b * b));
        let [_, _, on] = self.outgoing;
        let visibility = 0.5 / at_least(cosine * self.masking + on * shadowing, f32::MIN_POSITIVE);
        // 4 η² |o·h| |ω·h| / |o + η ω|², its product the mean of a clamped normal variable.
        let (product, step) = (side.turn * out * toward, ior2 - 1.0);
        let product = 0.5 * (product + sqrt(product * product + (0.5 * FRAC_2_PI) * (step * step) * spread2));
        let jacobian = 4.0 * ior2 * at_least(product, 0.0) * (inverse2 * inverse2);
        side.share * distribution * (visibility * cosine) * jacobian
    }
}

impl Lobe for MicrofacetLobe {
    #[inline(always)]
    fn weigh(&self, toward: f32, center: [f32; 3], distance: f32, spread2: f32) -> f32 {
        let [t, b, height] = self.local(center);
        let inverse = 1.0 / sqrt(at_least(t * t + b * b + height * height, LEAST_DISTANCE2));
        let side = self.side(height);
        // What the region has on the other side of the plane: the mean of the absolute height is above that of the
        // height.
        let other = 0.5 * self.transmits * at_least(toward - height.abs(), 0.0);
        let toward = toward - other;
        let value = self.value(&side, toward / distance, [t * inverse, b * inverse, height * inverse], spread2);
        side.even * toward + side.other * other + distance * (value + self.least)
    }

    /// As that of a glossy surface, with the mean of what both roughnesses give, and with the plane between both sides.
    #[inline(always)]
    fn variation(&self, direction: [f32; 3], spread2: f32) -> f32 {
        let [t, b, n] = self.local(direction);
        let side = self.side(n);
        let Halfway { sum: [ht, hb, _], inverse2, .. } = self.halfway(&side, [t, b, side.upright * n]);
        let [x2, y2] = self.alpha2;
        let (x2, y2) = (1.0 / x2, 1.0 / y2);
        let blur = spread2 * (side.ior * side.ior) * inverse2;
        let plane = self.transmits * PLANE_VARIATION * spread2 / at_least(n * n, LEAST_ACROSS2);
        4.0 * blur * (x2 + y2) / (1.0 + (ht * ht * x2 + hb * hb * y2) * inverse2) + plane
    }

    #[inline(always)]
    fn map(self, map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let [t, b, n] = self.frame;
        Self { frame: [map(t), map(b), map(n)], ..self }
    }
}
