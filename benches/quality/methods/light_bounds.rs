//! Bounds and importance of a set of lights as in pbrt-v4 (`lightsamplers.h`, `lights.h`), after Conty Estevez and
//! Kulla 2018.

use core::f32::consts::{FRAC_PI_2, PI};

use ::fanlight::{Receiver, ShadingPoint};
use glam::Vec3;

/// Box, cone of normals, the angle around these at which the emission ends, and flux. All lights are one-sided.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    axis: Vec3,
    cos_o: f32,
    cos_e: f32,
    pub(crate) phi: f32,
}

impl LightBounds {
    /// Bounds of a diffuse triangle, whose emission ends at a right angle.
    pub(crate) fn of_triangle(vertices: [Vec3; 3], normal: Vec3, phi: f32) -> Self {
        let [a, b, c] = vertices;
        Self::of_box([a.min(b).min(c), a.max(b).max(c)], (normal, 1.0), 0.0, phi)
    }

    /// Bounds of any light, by the corners of its box, its cone of normals and the cosine at which its emission ends.
    pub(crate) fn of_box([min, max]: [Vec3; 2], (axis, cos_o): (Vec3, f32), cos_e: f32, phi: f32) -> Self {
        Self { min, max, axis, cos_o, cos_e, phi }
    }

    pub(crate) fn union(a: Self, b: Self) -> Self {
        let (axis, cos_o) = cone_union((a.axis, a.cos_o), (b.axis, b.cos_o));
        let cos_e = a.cos_e.min(b.cos_e);
        Self { min: a.min.min(b.min), max: a.max.max(b.max), axis, cos_o, cos_e, phi: a.phi + b.phi }
    }

    pub(crate) fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// `EvaluateCost`: flux times orientation term times area.
    pub(crate) fn cost(&self) -> f32 {
        let theta_o = self.cos_o.clamp(-1.0, 1.0).acos();
        let theta_w = (theta_o + self.cos_e.acos()).min(PI);
        let sin_o = sine(self.cos_o);
        let orientation = 2.0 * PI * (1.0 - self.cos_o)
            + FRAC_PI_2
                * (2.0 * theta_w * sin_o - (theta_o - 2.0 * theta_w).cos() - 2.0 * theta_o * sin_o + self.cos_o);
        let d = self.max - self.min;
        self.phi * orientation * 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// `LightBounds::Importance`, with its absolute cosine at the receiver, but for the clamp of the distance: pbrt
    /// clamps its *square* at half the diagonal's *length*; here it is clamped at the square of half the diagonal,
    /// as was meant.
    #[inline]
    pub(crate) fn importance(&self, x: &ShadingPoint) -> f32 {
        self.importance_with(x, f32::abs)
    }

    /// The importance as Conty Estevez and Kulla have it: nothing arrives from below the receiver's horizon.
    #[inline]
    pub(crate) fn one_sided_importance(&self, x: &ShadingPoint) -> f32 {
        self.importance_with(x, |cosine| cosine)
    }

    #[inline]
    fn importance_with(&self, x: &ShadingPoint, receiver_cosine: impl Fn(f32) -> f32) -> f32 {
        let to_point = x.position - self.center();
        let distance2 = to_point.length_squared();
        let radius2 = 0.25 * (self.max - self.min).length_squared();
        let wi = to_point * (1.0 / distance2.sqrt());
        let cos_b = if distance2 < radius2 { -1.0 } else { (1.0 - radius2 / distance2).max(0.0).sqrt() };
        let sin_b = sine(cos_b);
        let cos_w = self.axis.dot(wi);
        let (sin_w, sin_o) = (sine(cos_w), sine(self.cos_o));
        let cos_x = cos_sub_clamped(sin_w, cos_w, sin_o, self.cos_o);
        let sin_x = sin_sub_clamped(sin_w, cos_w, sin_o, self.cos_o);
        let cos_p = cos_sub_clamped(sin_x, cos_x, sin_b, cos_b);
        if cos_p <= self.cos_e {
            return 0.0;
        }
        let importance = self.phi * cos_p / distance2.max(radius2);
        let Receiver::Surface(normal) = x.receiver else { return importance };
        let cos_i = receiver_cosine(-normal.dot(wi));
        (importance * cos_sub_clamped(sine(cos_i), cos_i, sin_b, cos_b)).max(0.0)
    }
}

fn sine(cosine: f32) -> f32 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

fn cos_sub_clamped(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

fn sin_sub_clamped(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 0.0 } else { sin_a * cos_b - cos_a * sin_b }
}

/// `Union` of direction cones.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (theta_a, theta_b) = (a.1.clamp(-1.0, 1.0).acos(), b.1.clamp(-1.0, 1.0).acos());
    let theta_d = angle(a.0, b.0);
    if (theta_d + theta_b).min(PI) <= theta_a {
        return a;
    }
    if (theta_d + theta_a).min(PI) <= theta_b {
        return b;
    }
    let theta_o = 0.5 * (theta_a + theta_d + theta_b);
    if theta_o >= PI {
        return (a.0, -1.0);
    }
    let rotation_axis = a.0.cross(b.0);
    if rotation_axis.length_squared() == 0.0 {
        return (a.0, -1.0);
    }
    let (sin, cos) = (theta_o - theta_a).sin_cos();
    let axis = a.0 * cos + rotation_axis.normalize().cross(a.0) * sin;
    (axis.normalize(), theta_o.cos())
}

fn angle(a: Vec3, b: Vec3) -> f32 {
    if a.dot(b) < 0.0 {
        PI - 2.0 * (0.5 * (a + b).length()).min(1.0).asin()
    } else {
        2.0 * (0.5 * (b - a).length()).min(1.0).asin()
    }
}
