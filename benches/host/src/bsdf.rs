//! How surfaces scatter light.

use core::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Mat3, Vec2, Vec3, vec2};

use crate::random::Pcg32;

/// What a surface is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Material {
    /// Lambert's lobe with this albedo.
    Diffuse(Vec3),
    /// Isotropic GGX with height-correlated Smith shadowing and without Fresnel: (roughness α, share reflected).
    Glossy { alpha: f32, share: f32 },
}

/// A point of a surface that a path has reached.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// A hair's breadth in front of the surface.
    pub(crate) position: Vec3,
    /// Unit normal to the side that the path came from.
    pub(crate) normal: Vec3,
    /// Unit direction back along the path.
    pub(crate) outgoing: Vec3,
    pub(crate) material: Material,
    /// Number of surfaces between it and the camera.
    pub(crate) depth: u32,
}

impl Vertex {
    /// Returns the share of the radiance from a direction that is scattered along the path, per solid angle; the cosine
    /// is in it.
    #[inline]
    pub(crate) fn scattered(&self, incoming: Vec3) -> Vec3 {
        let cosine = self.normal.dot(incoming);
        if cosine <= 0.0 {
            return Vec3::ZERO;
        }
        match self.material {
            Material::Diffuse(albedo) => cosine * FRAC_1_PI * albedo,
            Material::Glossy { alpha, share } => {
                let (h, cos_o) = self.half_vector(incoming);
                let masking = 1.0 / (1.0 + lambda(alpha, cos_o) + lambda(alpha, cosine));
                Vec3::splat(share * distribution(alpha, h) * masking / (4.0 * cos_o))
            }
        }
    }

    /// Returns the density per solid angle with which [`sample`](Self::sample) draws a direction.
    #[inline]
    pub(crate) fn pdf(&self, incoming: Vec3) -> f32 {
        let cosine = self.normal.dot(incoming);
        if cosine <= 0.0 {
            return 0.0;
        }
        match self.material {
            Material::Diffuse(_) => cosine * FRAC_1_PI,
            Material::Glossy { alpha, .. } => {
                let (h, cos_o) = self.half_vector(incoming);
                distribution(alpha, h) / ((1.0 + lambda(alpha, cos_o)) * 4.0 * cos_o)
            }
        }
    }

    /// Draws a direction in proportion to the cosine, or through a visible normal.
    #[inline]
    pub(crate) fn sample(&self, random: &mut Pcg32) -> Vec3 {
        let [u, v] = random.uniform2();
        match self.material {
            Material::Diffuse(_) => {
                let disc = u.sqrt() * Vec2::from_angle(TAU * v);
                self.frame() * disc.extend((1.0 - u).max(0.0).sqrt())
            }
            Material::Glossy { alpha, .. } => {
                let frame = self.frame();
                let h = frame * visible_normal(alpha, frame.transpose_mul_vec3(self.outgoing), u, v);
                2.0 * h.dot(self.outgoing) * h - self.outgoing
            }
        }
    }

    /// Returns the cosines between the normal, and the half vector and the outgoing direction.
    #[inline]
    fn half_vector(&self, incoming: Vec3) -> (f32, f32) {
        let h = (incoming + self.outgoing).normalize();
        (self.normal.dot(h), self.normal.dot(self.outgoing).max(1e-6))
    }

    /// Returns the rotation from the frame whose z is the normal.
    #[inline]
    fn frame(&self) -> Mat3 {
        let (tangent, bitangent) = self.normal.any_orthonormal_pair();
        Mat3::from_cols(tangent, bitangent, self.normal)
    }
}

/// Returns the GGX distribution of normals, per solid angle.
#[inline]
fn distribution(alpha: f32, cosine: f32) -> f32 {
    let squared = alpha * alpha;
    // In this form nothing cancels where the lobe is narrow.
    let tail = (1.0 - cosine * cosine).max(0.0) + squared * cosine * cosine;
    squared / (PI * tail * tail)
}

/// Returns Smith's Λ.
#[inline]
fn lambda(alpha: f32, cosine: f32) -> f32 {
    let tangent_squared = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tangent_squared).sqrt() - 1.0)
}

/// Draws a normal that is visible from a direction, both in the frame of the surface (Heitz 2018, "Sampling the GGX
/// Distribution of Visible Normals").
fn visible_normal(alpha: f32, outgoing: Vec3, u: f32, v: f32) -> Vec3 {
    let stretched = (outgoing * Vec3::new(alpha, alpha, 1.0)).normalize();
    let across = vec2(-stretched.y, stretched.x);
    let tangent = if across.length_squared() > 0.0 { across.normalize().extend(0.0) } else { Vec3::X };
    let bitangent = stretched.cross(tangent);
    let disc = u.sqrt() * Vec2::from_angle(TAU * v);
    let share = 0.5 * (1.0 + stretched.z);
    let y = (1.0 - share) * (1.0 - disc.x * disc.x).max(0.0).sqrt() + share * disc.y;
    let z = (1.0 - disc.x * disc.x - y * y).max(0.0).sqrt();
    let normal = disc.x * tangent + y * bitangent + z * stretched;
    (normal * Vec3::new(alpha, alpha, 0.0)).with_z(normal.z.max(1e-6)).normalize()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{Material, Vertex};
    use crate::random::Pcg32;

    /// The mean of value over density, drawn from the surface, is that of value times sphere, drawn uniformly.
    #[test]
    fn samples_follow_the_density() {
        for (alpha, outgoing) in [(0.3, Vec3::new(0.3, -0.2, 0.6)), (0.6, Vec3::new(0.9, 0.1, 0.2)), (1.0, Vec3::Z)] {
            let vertex = Vertex {
                position: Vec3::ZERO,
                normal: Vec3::Z,
                outgoing: outgoing.normalize(),
                material: Material::Glossy { alpha, share: 1.0 },
                depth: 0,
            };
            let mut random = Pcg32::new(1, 2);
            let (mut by_surface, mut by_sphere, mut above, mut total) = (0.0, 0.0, 0.0, 0.0);
            let count = 400_000;
            for _ in 0..count {
                let drawn = vertex.sample(&mut random);
                if drawn.z > 0.0 {
                    above += 1.0;
                    by_surface += f64::from(drawn.x * vertex.scattered(drawn).x / vertex.pdf(drawn));
                }
                let z = 2.0 * random.uniform() - 1.0;
                let turn = glam::Vec2::from_angle(core::f32::consts::TAU * random.uniform());
                let anywhere = (turn * (1.0 - z * z).sqrt()).extend(z);
                let weight = 4.0 * core::f64::consts::PI;
                by_sphere += f64::from(anywhere.x * vertex.scattered(anywhere).x) * weight;
                total += f64::from(vertex.pdf(anywhere)) * weight;
            }
            let count = f64::from(count);
            assert!((by_surface - by_sphere).abs() / count < 0.02, "{alpha}: {by_surface} {by_sphere}");
            // Directions below the horizon have no density.
            assert!((total - above).abs() / count < 0.02, "{alpha}: {} {}", total / count, above / count);
        }
    }
}
