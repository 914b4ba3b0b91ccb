//! The environment's bright features through the portals: a technique next to the trees.
//!
//! For every shading point, the parts of portals that a feature is visible through are found, and how much of it each
//! shows. The irradiance from the features is then known. As a direction towards a feature belongs to a point of a portal,
//! like those of the trees, the density of a direction is a plain sum over the portals that it crosses.

mod clipped_square;
mod list;
mod opening;
#[cfg(test)]
mod tests;
mod texel_cut;
mod view;

use super::{Density, Technique, Variates, Viewpoint};
use crate::blas::Lattice;
use crate::env::BrightFeature;
use crate::light::{LightKind, LightPoint, LightView, LightViewKind};
use crate::math;
use crate::receiver::ReceiverKind;
use crate::warp::{Variate, pick, sum};

pub(crate) use list::VisibleFeatures;
use list::{ANY_PORTAL, MAX_VISIBLE, VisibleFeature};
use view::FeatureView;

impl VisibleFeatures {
    /// Lists all features that are visible from a shading point.
    pub(super) fn find(&mut self, at: &Viewpoint<'_>) {
        for feature in 0..at.scene.environment.bright_features().len() {
            self.find_one(feature, at);
        }
    }

    /// Appends the parts of portals that a feature is visible through.
    fn find_one(&mut self, feature: usize, at: &Viewpoint<'_>) {
        let features = at.scene.environment.bright_features();
        let axis = at.scene.environment.feature_axis(feature);
        let BrightFeature { sin_radius, power, .. } = features[feature];
        let cosine = at.x.receiver.mean_over_cone(axis, sin_radius);
        if cosine == 0.0 {
            return;
        }
        let start = self.len();
        // Every feature after this one keeps a place.
        let end = MAX_VISIBLE - (features.len() - 1 - feature);
        let mut more = 0.0;
        let cone = [sin_radius, math::sqrt((1.0 - sin_radius * sin_radius).max(0.0))];
        at.scene.tlas.meet(at.x.position, axis, cone, |leaf| {
            let scale = at.scene.lights.scale(leaf);
            if !at.scene.lights.light(leaf).is_portal() || scale == 0.0 {
                return;
            }
            if more > 0.0 {
                more += 1.0;
                return;
            }
            let view = &at.view(leaf);
            let Some(triangle) = view.as_ref().and_then(LightView::as_portal) else { return };
            self.note(triangle.is_close());
            FeatureView::new(triangle, &at.scene.environment, feature).visit(|part, through| {
                if self.len() < end {
                    self.push(leaf, feature, part, through * scale * cosine);
                } else {
                    more += 1.0;
                }
            });
        });
        if more > 0.0 {
            let all = self.irradiance_from(start) * (1.0 + more / (end - start) as f32);
            self.merge(start, feature, all.min(power * cosine));
        }
    }

    /// Draws a point on a portal towards one entry of the list.
    fn point(&self, at: &Viewpoint<'_>, index: usize, u: [Variate; 2]) -> Option<LightPoint> {
        let VisibleFeature { leaf, feature, part } = self.get(index);
        let feature = feature as usize;
        if leaf == ANY_PORTAL {
            return least_crossed(at, at.scene.environment.sample_feature(feature, u));
        }
        let view = at.view(leaf)?;
        let point = FeatureView::new(view.as_portal()?, &at.scene.environment, feature).sample(part, u)?;
        Some(LightPoint { leaf, point })
    }
}

impl Technique for VisibleFeatures {
    fn total(&self) -> f64 {
        sum(self.weights())
    }

    fn sample<R>(
        &self,
        at: &Viewpoint<'_>,
        mut u: Variates,
        then: impl FnOnce(LightPoint, Density, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        let index = pick(self.weights(), self.total(), &mut u.choice);
        let point = self.point(at, index, u.point)?;
        let view = at.view(point.leaf)?;
        then(point, self.density(at, point, &view), &view)
    }

    #[inline]
    fn density(&self, at: &Viewpoint<'_>, point: LightPoint, view: &LightView<'_>) -> Density {
        let Some(triangle) = view.as_portal() else { return Density { pmf: 0.0, pdf: 0.0 } };
        let direction = triangle.point(point.point).normalize_or_zero().as_vec3();
        let environment = &at.scene.environment;
        let mut pdf = 0.0;
        for feature in 0..environment.bright_features().len() {
            let excess = f64::from(environment.feature_excess(feature, direction));
            if excess == 0.0 {
                continue;
            }
            for (visible, weight) in self.of_feature(feature) {
                let LightPoint { leaf, point } = point;
                let per_excess = if visible.leaf == ANY_PORTAL {
                    // On an edge, rounding may take the ray past the very light that the point lies on, or to its neighbor.
                    let is_least = at.scene.lights.is_crossed_once
                        || least_crossed(at, direction).is_none_or(|least| least.leaf >= leaf);
                    if is_least { 1.0 / f64::from(environment.bright_features()[feature].power) } else { 0.0 }
                } else if visible.leaf == leaf && visible.part.cell.holds(point) {
                    FeatureView::new(triangle, environment, feature).pdf_per_excess(visible.part, point)
                } else {
                    continue;
                };
                pdf += f64::from(weight) * excess * per_excess;
            }
        }
        Density { pmf: 0.0, pdf }
    }
}

/// Returns where a ray crosses the portal of the least number among those that it crosses.
fn least_crossed(at: &Viewpoint<'_>, direction: glam::Vec3) -> Option<LightPoint> {
    let least = core::cell::Cell::new(None::<LightPoint>);
    let lights = &at.scene.lights;
    let is_wanted = |leaf: u32| {
        let light = lights.light(leaf);
        let is_less = least.get().is_none_or(|least| leaf <= least.leaf);
        light.is_portal() && lights.scale(leaf) != 0.0 && is_less && light.is_visible(&at.x)
    };
    let visit = |leaf: u32, point: Lattice| least.set(Some(LightPoint { leaf, point }));
    at.scene.cross(at.x.position, direction, is_wanted, visit);
    least.get()
}
