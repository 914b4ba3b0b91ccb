//! Lights by their power, whatever they send to a shading point: what `fanlight` is compared with where there are
//! lamps.

use core::f32::consts::{PI, TAU};

use glam::Vec3;

use super::lamp::{Lamp, within};
use super::lighting::{Aim, Proposal};
use super::model::Model;
use super::scene::Point;
use super::sky::LUMINANCE;
use super::texel_table::TexelTable;

/// All emitters and lamps.
pub(crate) struct PowerTable {
    /// Emitters by their area.
    areas: TexelTable,
    lamps: Vec<Lamp>,
    /// Those of the lamps that rays find by chance.
    caps: Vec<usize>,
    /// Probability of the emitters, then of each lamp, each with all before it. The last one is 1.
    cumulative: Vec<f64>,
}

impl PowerTable {
    /// Takes over all lights of a model. `None` if there are none.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let areas = TexelTable::areas(model);
        let radius = 0.5 * model.diagonal();
        let power = |lamp: &Lamp| f64::from(LUMINANCE.dot(lamp.strength) * lamp.extent(radius));
        let powers = core::iter::once(f64::from(PI) * areas.total()).chain(model.lamps.iter().map(power));
        let mut cumulative: Vec<f64> = powers
            .scan(0.0, |sum, power| {
                *sum += power;
                Some(*sum)
            })
            .collect();
        let total = cumulative.last().copied().filter(|&total| total > 0.0)?;
        cumulative.iter_mut().for_each(|sum| *sum /= total);
        let caps = (0..model.lamps.len()).filter(|&lamp| model.lamps[lamp].cap().is_some()).collect();
        Some(Self { areas, lamps: model.lamps.clone(), caps, cumulative })
    }

    /// A direction to a light.
    pub(crate) fn sample(&self, position: Vec3, [choice, u, v]: [f32; 3]) -> Option<Proposal> {
        let choice = f64::from(choice);
        let number = self.cumulative.partition_point(|&sum| sum <= choice);
        let share = self.share(number);
        let Some(lamp) = number.checked_sub(1) else {
            let choice = (choice / f64::from(share)).min(1.0 - f64::from(f32::EPSILON));
            let proposal = self.areas.sample(position, [choice as f32, u, v])?;
            return Some(Proposal { pdf: share * proposal.pdf, ..proposal });
        };
        let (direction, _) = self.lamps.get(lamp)?.towards(position);
        if let Some((cosine, _)) = self.lamps[lamp].cap() {
            let pdf = share / (TAU * (1.0 - cosine));
            return Some(Proposal { direction: within(direction, cosine, [u, v]), pdf, aim: Aim::Sky });
        }
        // Not from the lamp's own place.
        direction.is_finite().then_some(Proposal { direction, pdf: share, aim: Aim::Lamp(lamp) })
    }

    /// Density per solid angle of a direction that leads to a point of an emitter, or out of the scene if that is
    /// `None`.
    pub(crate) fn pdf(&self, direction: Vec3, point: Option<&Point>) -> f32 {
        match (self.share(0), point) {
            (share, Some(point)) if share > 0.0 => share * self.areas.pdf(direction, point),
            (_, Some(_)) => 0.0,
            (_, None) => self.caps.iter().map(|&lamp| self.pdf_of_cap(lamp, direction)).sum(),
        }
    }

    fn pdf_of_cap(&self, lamp: usize, direction: Vec3) -> f32 {
        match self.lamps[lamp].cap() {
            Some((cosine, _)) if self.lamps[lamp].radiance(direction) != Vec3::ZERO => {
                self.share(lamp + 1) / (TAU * (1.0 - cosine))
            }
            _ => 0.0,
        }
    }

    /// Probability of the emitters, or of the lamp before that number.
    fn share(&self, number: usize) -> f32 {
        let sum = |number: usize| self.cumulative.get(number).copied().unwrap_or(1.0);
        (sum(number) - number.checked_sub(1).map_or(0.0, sum)) as f32
    }
}
