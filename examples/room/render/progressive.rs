//! Renders pass after pass, on all threads, until a budget is spent.

use std::time::Instant;

use glam::{UVec2, Vec2};
use rayon::prelude::*;

use super::camera::Camera;
use super::film::Film;
use super::path::{PathTracer, Random};

/// When a rendering ends.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Budget {
    /// With the first pass that ends after this time.
    Seconds(f64),
    /// After this many samples of every pixel.
    Samples(u32),
}

impl Budget {
    /// A multiple of the budget.
    pub(crate) fn times(self, factor: u32) -> Self {
        match self {
            Self::Seconds(seconds) => Self::Seconds(seconds * f64::from(factor)),
            Self::Samples(samples) => Self::Samples(samples.saturating_mul(factor)),
        }
    }

    /// The part of the budget that is spent; 1 and more if all of it is.
    pub(crate) fn spent(self, seconds: f64, samples: u32) -> f64 {
        match self {
            Self::Seconds(budget) => seconds / budget,
            Self::Samples(budget) => f64::from(samples) / f64::from(budget),
        }
    }
}

/// One rendering.
pub(crate) struct Progressive<'a> {
    pub(crate) tracer: PathTracer<'a>,
    pub(crate) camera: Camera,
    /// Which random numbers are used. The threads' number and order have no part in it.
    pub(crate) seed: u32,
}

impl Progressive<'_> {
    /// Adds one sample a pixel until the budget is spent, and tells how much of it is after every pass.
    /// Returns the film and the seconds it took.
    pub(crate) fn render(&self, budget: Budget, mut progress: impl FnMut(f64)) -> (Film, f64) {
        let mut film = Film::new(self.camera.width(), self.camera.height());
        let start = Instant::now();
        loop {
            self.add_pass(&mut film);
            let seconds = start.elapsed().as_secs_f64();
            let spent = budget.spent(seconds, film.samples());
            progress(spent.min(1.0));
            if spent >= 1.0 {
                return (film, seconds);
            }
        }
    }

    /// Adds one sample to every pixel.
    pub(crate) fn add_pass(&self, film: &mut Film) {
        let pass = film.samples();
        let (width, pixels) = film.add_pass();
        pixels.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let at = UVec2::new(x as u32, y as u32);
                let mut random = self.random(at, pass);
                let point = at.as_vec2() + Vec2::from(random.take());
                let (origin, direction) = self.camera.ray(point);
                pixel.add(self.tracer.radiance(origin, direction, &mut random));
            }
        });
    }

    /// Every sample of every pixel has random numbers of its own.
    fn random(&self, pixel: UVec2, pass: u32) -> Random {
        let index = u64::from(pixel.y) << 32 | u64::from(pixel.x);
        Random::new(mix(u64::from(self.seed) << 32 | u64::from(pass)), mix(index))
    }
}

/// The finalizer of `SplitMix64`: neighboring numbers become unrelated ones.
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}
