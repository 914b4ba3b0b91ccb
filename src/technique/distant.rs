//! Distant lights: directions that are known beforehand.
//!
//! Each light is weighed by what it sends to the shading point ([`DistantRecord::weigh`]), which is known but for
//! walls: a light below the horizon has the weight zero. Of more lights than [`MOST_GROUPS`], a group of neighbors is
//! chosen first, and its lights are weighed only then.
//!
//! Like [`Sky`](super::sky::Sky), this technique draws directions. But a direction belongs to one light, and each has a
//! density of its own: caps may overlap.

use glam::Vec3;

use super::Viewpoint;
use crate::light::{DistantGroup, DistantRecord, MOST_GROUPS};
use crate::math::only_if;
use crate::warp::{Variate, keep_positive, pick, pmf, sum};

/// Distant lights as seen from one shading point: no more than what balances them with the rest, as every shading point
/// has room for it. Weights are recomputed in each call.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distant {
    irradiance: f32,
}

/// A direction of a distant light that was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistantDirection {
    /// Place of the light among all distant lights.
    pub(crate) light: usize,
    /// Unit world direction.
    pub(crate) direction: Vec3,
    /// Probability of the light.
    pub(crate) pmf: f64,
    /// Density per solid angle; the probability of a light without an extent.
    pub(crate) pdf: f64,
}

impl Distant {
    /// Weighs all groups. `None` if nothing can arrive.
    pub(super) fn new(at: &Viewpoint<'_>) -> Option<Self> {
        if !at.is_somewhere() {
            return None;
        }
        let irradiance = sum(weights(at, &mut [0.0; MOST_GROUPS])).min(f64::from(f32::MAX)) as f32;
        (irradiance > 0.0).then_some(Self { irradiance })
    }

    /// Estimate of the irradiance.
    pub(super) fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// Draws a direction. `None` where nothing arrives from the light or group that the variates lead to.
    pub(super) fn sample(&self, at: &Viewpoint<'_>, choice: &mut Variate, u: [Variate; 2]) -> Option<DistantDirection> {
        let mut room = [0.0; MOST_GROUPS];
        let weights = weights(at, &mut room);
        let index = pick(weights, sum(weights), choice);
        let group = at.scene.lights.extras().distant_groups().get(index)?;
        let light = if group.lights().len() > 1 { pick_light(at, group, choice)? } else { group.lights().start };
        let view = at.scene.lights.extras().distants().get(light)?.view(at.x.receiver);
        let direction = view.draw(u.map(|u| u.value()))?;
        let pmf = pmf_in(at, weights, index, light);
        let pdf = pmf * view.pdf(direction);
        (pdf > 0.0).then_some(DistantDirection { light, direction, pmf, pdf })
    }

    /// Returns the probability of a light, by its place among all distant lights.
    pub(super) fn pmf(&self, at: &Viewpoint<'_>, light: usize) -> f64 {
        let groups = at.scene.lights.extras().distant_groups();
        let Some(index) = groups.iter().position(|group| group.lights().contains(&light)) else { return 0.0 };
        pmf_in(at, weights(at, &mut [0.0; MOST_GROUPS]), index, light)
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws a unit direction that leads to a light
    /// with an extent.
    pub(super) fn pdf(&self, at: &Viewpoint<'_>, light: usize, direction: Vec3) -> f64 {
        let Some(record) = at.scene.lights.extras().distants().get(light).filter(|record| record.has_extent()) else {
            return 0.0;
        };
        match self.pmf(at, light) {
            0.0 => 0.0,
            pmf => pmf * record.view(at.x.receiver).pdf(direction),
        }
    }
}

/// Weights of the groups, as many as there are: most scenes have one distant light.
fn weights<'w>(at: &Viewpoint<'_>, room: &'w mut [f32; MOST_GROUPS]) -> &'w [f32] {
    let (lights, groups) = (at.scene.lights.extras().distants(), at.scene.lights.extras().distant_groups());
    let weights = &mut room[..groups.len().min(MOST_GROUPS)];
    for (weight, group) in weights.iter_mut().zip(groups) {
        *weight = match lights.get(group.lights()) {
            _ if group.groups & at.x.groups == 0 => 0.0,
            Some([light]) => light.weigh(at.x.receiver),
            _ => group.weigh(at.x.receiver),
        };
    }
    keep_positive(weights);
    weights
}

/// Weight of a light in its group.
fn weight(at: &Viewpoint<'_>, light: &DistantRecord) -> f64 {
    f64::from(only_if(light.groups & at.x.groups != 0, light.weigh(at.x.receiver)))
}

/// Sum of the weights of a group's lights.
fn total(at: &Viewpoint<'_>, group: &DistantGroup) -> f64 {
    at.scene.lights.extras().distants()[group.lights()].iter().map(|light| weight(at, light)).sum()
}

/// Chooses a light of a group by its weight. `None` if nothing arrives from any.
fn pick_light(at: &Viewpoint<'_>, group: &DistantGroup, choice: &mut Variate) -> Option<usize> {
    let total = total(at, group);
    let target = choice.value() * total;
    let (mut chosen, mut below) = (None, 0.0);
    for light in group.lights() {
        let weight = weight(at, &at.scene.lights.extras().distants()[light]);
        if weight > 0.0 {
            chosen = Some(light);
            below += weight;
            if target < below {
                break;
            }
        }
    }
    chosen
}

/// Returns the probability of a light, by the weights of the groups and the number of its own.
fn pmf_in(at: &Viewpoint<'_>, weights: &[f32], index: usize, light: usize) -> f64 {
    let pmf = if index < weights.len() { pmf(weights, index) } else { 0.0 };
    match at.scene.lights.extras().distant_groups().get(index) {
        Some(group) if pmf > 0.0 && group.lights().len() > 1 => pmf * pmf_of_light(at, group, light),
        _ => pmf,
    }
}

/// Returns the probability with which [`pick_light`] chooses a light.
fn pmf_of_light(at: &Viewpoint<'_>, group: &DistantGroup, light: usize) -> f64 {
    match weight(at, &at.scene.lights.extras().distants()[light]) {
        0.0 => 0.0,
        weight => weight / total(at, group),
    }
}
