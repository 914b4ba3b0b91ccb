//! Collects samples into an image, and measures how far it is from a reference.

use glam::{DVec3, Vec3};

/// An image in linear RGB.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row from the top.
    pub(crate) pixels: Vec<Vec3>,
}

impl Image {
    /// A black image.
    pub(crate) fn black(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![Vec3::ZERO; width * height] }
    }

    /// Mean of all pixels.
    pub(crate) fn mean(&self) -> DVec3 {
        self.pixels.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>() / self.pixels.len() as f64
    }
}

/// What one pixel has collected.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    sum: DVec3,
    sum_of_squares: DVec3,
}

impl Pixel {
    /// Adds a sample.
    pub(crate) fn add(&mut self, radiance: Vec3) {
        let radiance = radiance.as_dvec3();
        self.sum += radiance;
        self.sum_of_squares += radiance * radiance;
    }
}

/// Running sums of the samples of every pixel.
#[derive(Clone, Debug)]
pub(crate) struct Film {
    width: usize,
    pixels: Vec<Pixel>,
    samples: u32,
}

impl Film {
    /// An empty film.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, pixels: vec![Pixel::default(); width * height], samples: 0 }
    }

    /// Samples of each pixel.
    pub(crate) const fn samples(&self) -> u32 {
        self.samples
    }

    /// The rows of pixels that a further sample of each is to be added to.
    pub(crate) fn add_pass(&mut self) -> (usize, &mut [Pixel]) {
        self.samples += 1;
        (self.width, &mut self.pixels)
    }

    /// Means of the samples.
    pub(crate) fn image(&self) -> Image {
        let samples = f64::from(self.samples.max(1));
        let pixels = self.pixels.iter().map(|pixel| (pixel.sum / samples).as_vec3()).collect();
        Image { width: self.width, height: self.pixels.len() / self.width, pixels }
    }

    /// Estimated variance of every pixel of [`image`](Self::image).
    pub(crate) fn variance(&self) -> Vec<DVec3> {
        let samples = f64::from(self.samples);
        let variance = |pixel: &Pixel| {
            let mean = pixel.sum / samples;
            (pixel.sum_of_squares / samples - mean * mean) / (samples - 1.0).max(1.0)
        };
        self.pixels.iter().map(variance).collect()
    }
}

/// What images are compared with.
pub(crate) struct Reference {
    image: Image,
    /// Mean of the denominators' floor: errors in the dark count no more than those at a tenth of the mean.
    floor: f64,
    /// The reference's own error in the measure below.
    noise: f64,
}

impl Reference {
    /// An image without noise.
    pub(crate) fn exact(image: Image) -> Self {
        let mean = image.mean().element_sum() / 3.0;
        Self { image, floor: 0.01 * mean * mean, noise: 0.0 }
    }

    /// A film whose remaining noise is known from its samples.
    pub(crate) fn from_film(film: &Film) -> Self {
        let mut reference = Self::exact(film.image());
        reference.noise = reference.relative(film.variance().into_iter());
        reference
    }

    /// The image.
    pub(crate) fn image(&self) -> &Image {
        &self.image
    }

    /// Relative mean squared error of the reference itself.
    pub(crate) const fn noise(&self) -> f64 {
        self.noise
    }

    /// Relative mean squared error: the mean over pixels and channels of (x − r)² / (r² + 0.01 mean(r)²).
    ///
    /// The reference's own noise is no error of the image, and subtracted.
    pub(crate) fn rel_mse(&self, image: &Image) -> f64 {
        let squares = image.pixels.iter().zip(&self.image.pixels).map(|(x, r)| {
            let difference = x.as_dvec3() - r.as_dvec3();
            difference * difference
        });
        self.relative(squares) - self.noise
    }

    /// Mean of squared errors relative to the reference's squares.
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
