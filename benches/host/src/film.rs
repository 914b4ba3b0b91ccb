//! Collects samples into an image.

use glam::{DVec3, Vec3};

/// Pixels of an image, columns and rows.
pub(crate) const RESOLUTION: [usize; 2] = [96, 72];

/// An image in linear RGB.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Rows from the top.
    pub(crate) pixels: Vec<Vec3>,
}

impl Image {
    /// Returns a black image.
    pub(crate) fn black(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![Vec3::ZERO; width * height] }
    }

    /// Returns the mean of all pixels.
    pub(crate) fn mean(&self) -> DVec3 {
        self.pixels.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>() / self.pixels.len() as f64
    }
}

/// Sums over the samples of one pixel.
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
    pixels: Vec<Pixel>,
    samples: u32,
}

impl Film {
    /// Returns an empty film.
    pub(crate) fn new() -> Self {
        Self { pixels: vec![Pixel::default(); RESOLUTION[0] * RESOLUTION[1]], samples: 0 }
    }

    /// Number of samples of each pixel.
    pub(crate) const fn samples(&self) -> u32 {
        self.samples
    }

    /// Returns the pixels, to each of which one further sample is to be added.
    pub(crate) fn add_pass(&mut self) -> &mut [Pixel] {
        self.samples += 1;
        &mut self.pixels
    }

    /// Adds the samples of another film.
    pub(crate) fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        for (pixel, other) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.sum += other.sum;
            pixel.sum_of_squares += other.sum_of_squares;
        }
    }

    /// Returns the means of the samples.
    pub(crate) fn image(&self) -> Image {
        let samples = f64::from(self.samples.max(1));
        let pixels = self.pixels.iter().map(|pixel| (pixel.sum / samples).as_vec3()).collect();
        Image { width: RESOLUTION[0], height: RESOLUTION[1], pixels }
    }

    /// Returns the estimated variance of every pixel of [`image`](Self::image).
    pub(crate) fn variance(&self) -> Vec<DVec3> {
        let samples = f64::from(self.samples);
        let variance = |pixel: &Pixel| {
            let mean = pixel.sum / samples;
            (pixel.sum_of_squares / samples - mean * mean) / (samples - 1.0).max(1.0)
        };
        self.pixels.iter().map(variance).collect()
    }
}
