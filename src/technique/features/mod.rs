//! The environment's bright features through the portals: a technique next to the trees.
//!
//! For every shading point, the parts of portals that a feature is visible through are found, and how much of it each
//! shows. The irradiance from the features is then known. As a direction towards a feature belongs to a point of a
//! portal, like those of the trees, the density of a direction is a plain sum over the portals that it crosses.

mod child_powers;
mod clipped_square;
mod groups;
mod list;
mod opening;
#[cfg(test)]
mod tests;
mod texel_cut;
mod view;

use super::{Density, PlacedPoint, Technique, Variates, Viewpoint};
use crate::env::FeatureNode;
use crate::light::{LightLeaf, LightPoint, LightView, LightViewKind, LocalPoint};
use crate::math;
use crate::warp::{Variate, pick, sum};

use groups::{Group, Groups};
pub(crate) use list::VisibleFeatures;
use list::{ANY_PORTAL, MAX_VISIBLE, VisibleFeature};
use view::FeatureView;

/// Least number of parts that are measured of a feature that has more of them than there is room for. *Chosen*: their
/// mean stands for all others.
///
/// Larger: more parts are measured where the list is full. Smaller: one small part could stand for many large ones, so
/// that the feature starves.
const LEAST_MEASURED: usize = 16;

impl VisibleFeatures {
    /// Lists all features that are visible from a shading point.
    pub(super) fn find(&mut self, at: &Viewpoint<'_>) {
        let mut groups = Groups::empty();
        groups.fill(at);
        let mut left = groups.as_slice().len();
        for group in groups.as_slice() {
            left -= 1;
            // Every group after this one keeps a place.
            self.find_group(*group, MAX_VISIBLE - left, at);
        }
        if let Some(region) = &at.visibility {
            self.dim(|leaf| at.feature_factor(region, leaf));
        }
    }

    /// Appends the parts of portals that a group of features is visible through, as long as there are fewer than `end`.
    ///
    /// A group with more parts becomes one entry for all portals, with an irradiance estimated from the parts that were
    /// measured: the first ones in the order of the tree over the lights. Groups come in the order in which
    /// [`Groups::fill`] divided them, and not by energy: a late group finds only the places that earlier ones left.
    /// Which groups lose their walls thus depends on the features and the shading point, and the order in which meshes
    /// were added decides at most which parts of one group are measured.
    fn find_group(&mut self, Group { node, cosine }: Group, end: usize, at: &Viewpoint<'_>) {
        let environment = &at.scene.environment;
        let FeatureNode { sin_radius, power, .. } = environment.feature_nodes()[node as usize];
        let axis = environment.feature_axis(node as usize);
        let start = self.len();
        // Weights of all parts that were measured, how many they are, and how many lights were only counted.
        let (mut sum, mut measured, mut more) = (0.0, 0, 0);
        let cone = [sin_radius, math::sqrt((1.0 - sin_radius * sin_radius).max(0.0))];
        let visit = |leaf: LightLeaf| {
            let scale = at.scene.lights.scale(leaf);
            if !at.scene.lights.is_portal(leaf) || scale == 0.0 {
                return;
            }
            if measured > end - start && measured >= LEAST_MEASURED {
                more += 1;
                return;
            }
            let view = &at.view(leaf);
            let Some(triangle) = view.as_ref().and_then(LightView::as_portal) else { return };
            self.note(triangle.is_close());
            FeatureView::new(triangle, environment, node as usize).visit(|part, through| {
                let weight = through * scale * cosine;
                if self.len() < end {
                    self.push(leaf, node, part, weight);
                }
                (sum, measured) = (sum + weight, measured + 1);
            });
        };
        if sin_radius < 1.0 {
            at.scene.meet(at.x.position, axis, cone, visit);
        } else {
            at.scene.for_each_light(visit);
        }
        if measured > end - start {
            let all = sum * (1.0 + more as f32 / measured as f32);
            self.merge(start, node, all.min(power * cosine));
        }
    }

    /// Draws a point on a portal towards one entry of the list. Returns it with the entry's density over the excess of
    /// the feature, if that is known then.
    fn point(&self, at: &Viewpoint<'_>, index: usize, u: [Variate; 2]) -> Option<(LightPoint, Option<f64>)> {
        let VisibleFeature { leaf, node, part } = self.get(index);
        let node = node as usize;
        if leaf == ANY_PORTAL {
            return least_crossed(at, at.scene.environment.sample_feature(node, u)).map(|point| (point, None));
        }
        let view = &at.view(leaf);
        let triangle = view.as_ref()?.as_portal()?;
        let (point, per_excess) = FeatureView::new(triangle, &at.scene.environment, node).sample(part, u)?;
        Some((LightPoint { leaf, point: LocalPoint::on_triangle(point) }, Some(per_excess)))
    }

    /// Returns the density of a point. `known` is an entry of the list that draws the point, with its density over the
    /// excess of the feature.
    #[inline]
    fn density_with(
        &self,
        at: &Viewpoint<'_>,
        point: LightPoint,
        view: &LightView<'_>,
        known: Option<(usize, f64)>,
    ) -> Density {
        let none = Density { pmf: 0.0, pdf: 0.0 };
        let Some(triangle) = view.as_portal() else { return none };
        let direction = triangle.point(point.point).normalize_or_zero().as_vec3();
        let environment = &at.scene.environment;
        let Some((block, excess)) = environment.feature_at(direction) else { return none };
        let mut pdf = 0.0;
        for (index, (visible, weight)) in self.entries().enumerate() {
            let (leaf, point) = (point.leaf, point.point.lattice());
            let node = visible.node as usize;
            let is_here = visible.leaf == leaf || visible.leaf == ANY_PORTAL;
            if !is_here || !environment.feature_nodes()[node].holds_block(block) {
                continue;
            }
            let per_excess = if visible.leaf == ANY_PORTAL {
                // On an edge, rounding may take the ray past the very light that the point lies on, or to its neighbor.
                let is_least = at.scene.lights.is_crossed_once
                    || least_crossed(at, direction).is_none_or(|least| least.leaf >= leaf);
                if is_least { 1.0 / f64::from(environment.feature_nodes()[node].power) } else { 0.0 }
            } else if !visible.part.cell.holds(point) {
                continue;
            } else if let Some((_, per_excess)) = known.filter(|(drawn, _)| *drawn == index) {
                per_excess
            } else {
                FeatureView::new(triangle, environment, node).pdf_per_excess(visible.part, point)
            };
            pdf += f64::from(weight) * f64::from(excess) * per_excess;
        }
        Density { pmf: 0.0, pdf }
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
        then: impl FnOnce(PlacedPoint, Density, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        let index = pick(self.weights(), self.total(), &mut u.choice);
        let (point, per_excess) = self.point(at, index, u.point)?;
        let view = at.view(point.leaf)?;
        let relative = view.point(point.point);
        let density = self.density_with(at, point, &view, per_excess.map(|per_excess| (index, per_excess)));
        then(PlacedPoint { point, relative }, density, &view)
    }

    #[inline]
    fn density(&self, at: &Viewpoint<'_>, point: LightPoint, view: &LightView<'_>) -> Density {
        self.density_with(at, point, view, None)
    }
}

/// Returns where a ray crosses the portal of the least number among those that it crosses.
fn least_crossed(at: &Viewpoint<'_>, direction: glam::Vec3) -> Option<LightPoint> {
    let least = core::cell::Cell::new(None::<LightPoint>);
    let lights = &at.scene.lights;
    let is_wanted = |leaf: LightLeaf| {
        let is_less = least.get().is_none_or(|least| leaf <= least.leaf);
        let is_portal = lights.is_portal(leaf) && lights.scale(leaf) != 0.0;
        is_portal && is_less && at.receives(leaf.top) && lights.is_visible(leaf, &at.x)
    };
    let visit = |point: LightPoint| least.set(Some(point));
    at.scene.cross(at.x.position, direction, is_wanted, visit);
    least.get()
}
