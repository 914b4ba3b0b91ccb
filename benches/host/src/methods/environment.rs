//! Directions to the sky in proportion to its luminance: a distribution tabulated over the texels of its
//! latitude-longitude image.

use core::f64::consts::{PI, TAU};

use glam::Vec3;

use crate::random::Pcg32;
use crate::sky::Sky;

/// The tabulated distribution.
#[derive(Clone, Debug)]
pub(super) struct EnvironmentTable {
    sky: Sky,
    width: usize,
    height: usize,
    /// Probability of the rows before each row, and 1.
    rows: Vec<f32>,
    /// For each row the probability, within it, of the columns before each column, and 1.
    columns: Vec<f32>,
    /// Density per solid angle of each texel's directions.
    density: Vec<f32>,
    /// Cosines of θ at the rows' edges.
    cosines: Vec<f32>,
}

impl EnvironmentTable {
    /// Builds the table. `None` if the sky is black.
    pub(super) fn new(sky: &Sky) -> Option<Self> {
        let (width, height) = (sky.image().width, sky.image().height);
        let luminance = sky.luminance();
        let cosine = |j: usize| (PI * j as f64 / height as f64).cos();
        let solid_angle = |j: usize| TAU / width as f64 * (cosine(j) - cosine(j + 1));
        // What is interpolated between texel centers has this mean over a texel.
        let mean = |i: usize, j: usize| {
            let rows = [j.saturating_sub(1), j, (j + 1).min(height - 1)];
            let columns = [(i + width - 1) % width, i, (i + 1) % width];
            let weight = [0.125, 0.75, 0.125];
            let row = |j: usize| (0..3).map(|k| weight[k] * f64::from(luminance[j * width + columns[k]])).sum::<f64>();
            (0..3).map(|k| weight[k] * row(rows[k])).sum::<f64>()
        };
        let means: Vec<f64> = (0..width * height).map(|k| mean(k % width, k / width)).collect();
        let row_sums: Vec<f64> =
            (means.chunks(width).enumerate()).map(|(j, row)| row.iter().sum::<f64>() * solid_angle(j)).collect();
        let total: f64 = row_sums.iter().sum();
        (total > 0.0).then(|| Self {
            sky: sky.clone(),
            width,
            height,
            rows: cumulative(&row_sums),
            columns: means.chunks(width).flat_map(cumulative).collect(),
            density: means.iter().map(|mean| (mean / total) as f32).collect(),
            cosines: (0..=height).map(|j| cosine(j) as f32).collect(),
        })
    }

    /// Draws a direction; returns it and its density per solid angle.
    #[inline]
    pub(super) fn sample(&self, random: &mut Pcg32) -> (Vec3, f32) {
        let (j, y) = find(&self.rows, random.uniform());
        let start = j * (self.width + 1);
        let (i, x) = find(&self.columns[start..=start + self.width], random.uniform());
        let (top, bottom) = (self.cosines[j], self.cosines[j + 1]);
        let direction = self.sky.direction((i as f32 + x) / self.width as f32, top + y * (bottom - top));
        (direction, self.density[j * self.width + i])
    }

    /// Returns the density per solid angle of a direction.
    #[inline]
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let place = self.sky.place(direction);
        let i = ((place.x * self.width as f32) as usize).min(self.width - 1);
        let j = ((place.y * self.height as f32) as usize).min(self.height - 1);
        self.density[j * self.width + i]
    }
}

/// Returns the sums before each entry over the sum of all, and 1.
fn cumulative(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let mut shares: Vec<f32> = Vec::with_capacity(weights.len() + 1);
    for (i, weight) in weights.iter().enumerate() {
        let even = i as f64 / weights.len() as f64;
        shares.push((if total > 0.0 { sum / total } else { even }) as f32);
        sum += weight;
    }
    shares.push(1.0);
    shares
}

/// Returns the entry whose share holds a number, and where in it the number lies.
#[inline]
fn find(shares: &[f32], u: f32) -> (usize, f32) {
    let last = shares.len() - 2;
    let i = (shares.partition_point(|&share| share <= u).saturating_sub(1)).min(last);
    let (low, high) = (shares[i], shares[i + 1]);
    (i, ((u - low) / (high - low).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Vec3};

    use super::EnvironmentTable;
    use crate::film::Image;
    use crate::random::Pcg32;
    use crate::sky::Sky;

    #[test]
    fn samples_have_the_density_of_their_direction() {
        let mut random = Pcg32::new(5, 6);
        let (width, height) = (64, 32);
        let pixels = (0..width * height).map(|_| Vec3::splat(random.uniform().powi(8))).collect();
        let sky = Sky::new(Image { width, height, pixels }, Mat3::from_rotation_z(0.7));
        let table = EnvironmentTable::new(&sky).expect("the sky is not black");
        let (mut agreeing, mut inverse, mut mean) = (0, 0.0, 0.0);
        for _ in 0..100_000 {
            let (direction, pdf) = table.sample(&mut random);
            agreeing += u32::from((table.pdf(direction) / pdf - 1.0).abs() < 1e-4);
            inverse += f64::from(1.0 / pdf);
            mean += f64::from(sky.radiance(direction).x / pdf);
        }
        // Some lie on an edge between two texels.
        assert!(agreeing > 99_900, "{agreeing}");
        let sphere = 4.0 * core::f64::consts::PI;
        assert!((inverse / 100_000.0 / sphere - 1.0).abs() < 0.1, "{inverse}");
        assert!((mean / 100_000.0 / sphere - 1.0 / 9.0).abs() < 0.01, "{mean}");
    }
}
