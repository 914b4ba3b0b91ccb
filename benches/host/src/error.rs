//! The error of an image.

use glam::DVec3;

use crate::film::{Film, Image};

/// Share of the mean's square that is added to each denominator: errors in the dark count no more than those at a tenth
/// of the mean. *Format*: it defines the measure.
const FLOOR: f64 = 0.01;

/// What images are compared with.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    image: Image,
    /// Number that is added to each denominator.
    floor: f64,
    /// The error of the reference itself, in the measure of [`rel_mse`](Self::rel_mse).
    noise: f64,
}

impl Reference {
    /// Returns a reference whose own error is known.
    pub(crate) fn new(image: Image, noise: f64) -> Self {
        let mean = image.mean().element_sum() / 3.0;
        Self { image, floor: FLOOR * mean * mean, noise }
    }

    /// Returns a film as a reference; its own error is estimated from its samples.
    pub(crate) fn from_film(film: &Film) -> Self {
        let mut reference = Self::new(film.image(), 0.0);
        reference.noise = reference.predicted(film);
        reference
    }

    /// The image.
    pub(crate) const fn image(&self) -> &Image {
        &self.image
    }

    /// The error of the reference itself.
    pub(crate) const fn noise(&self) -> f64 {
        self.noise
    }

    /// Returns the relative mean squared error: the mean over pixels and channels of (x − r)² / (r² + 0.01 mean(r)²),
    /// less that of the reference itself.
    pub(crate) fn rel_mse(&self, image: &Image) -> f64 {
        let squares = image.pixels.iter().zip(&self.image.pixels).map(|(x, r)| {
            let difference = x.as_dvec3() - r.as_dvec3();
            difference * difference
        });
        self.relative(squares) - self.noise
    }

    /// Returns the error that a film's own variance lets expect.
    pub(crate) fn predicted(&self, film: &Film) -> f64 {
        self.relative(film.variance().into_iter())
    }

    /// Returns the mean of squares over those of the reference.
    fn relative(&self, squares: impl Iterator<Item = DVec3>) -> f64 {
        let sum: f64 = squares
            .zip(&self.image.pixels)
            .map(|(square, r)| {
                let r = r.as_dvec3();
                (square / (r * r + self.floor)).element_sum()
            })
            .sum();
        sum / (3 * self.image.pixels.len()) as f64
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::Reference;
    use crate::film::Image;

    #[test]
    fn error_is_relative_to_the_reference() {
        let image = |a: f32, b: f32| Image { width: 2, height: 1, pixels: vec![Vec3::splat(a), Vec3::splat(b)] };
        let reference = Reference::new(image(1.0, 3.0), 0.001);
        // (0.1² / (1 + 0.04) + 0.6² / (9 + 0.04)) / 2 - 0.001
        assert!((reference.rel_mse(&image(1.1, 2.4)) - 0.023_719_3).abs() < 1e-6);
    }
}
