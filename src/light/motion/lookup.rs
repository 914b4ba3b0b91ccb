//! Which lights stand still, and what is asked of those that may not.

use super::MovingTriangle;
use crate::env::EnvironmentView;
use crate::light::lamp::LampView;
use crate::light::{Light, LightLeaf, LightTriangle, LightView, LightsView, TriangleView};
use crate::receiver::ShadingPoint;

impl Light<'_> {
    /// Whether the light's vertices move.
    pub(crate) fn is_moving(&self) -> bool {
        matches!(self, Self::Moving(_))
    }
}

impl<'a> LightsView<'a> {
    /// Returns the triangle in a leaf if it stands still, as those in most leaves do; `None` for any other light.
    #[inline(always)]
    pub(in crate::light) fn still(&self, leaf: u32) -> Option<&'a LightTriangle> {
        let record = &self.records[leaf as usize];
        (record.index_and_flags & LightTriangle::LAMP == 0).then_some(record)
    }

    /// Returns a light that is not a triangle that stands still, as seen from a shading point.
    #[inline]
    pub(in crate::light) fn view_of_other<'v>(
        &self,
        leaf: LightLeaf,
        x: &ShadingPoint,
        environment: Option<&'v EnvironmentView<'v>>,
    ) -> Option<LightView<'v>>
    where
        'a: 'v,
    {
        match self.light(leaf.top) {
            Light::Lamp(lamp) => LampView::new(&lamp, x).map(LightView::Lamp),
            Light::Instance(placed) => self.view_within(&placed, leaf, x, environment),
            Light::Moving(moving) => self.view_moving(&moving, x, environment),
            Light::Triangle(_) => None,
        }
    }

    /// Returns a triangle whose vertices move as seen from a shading point.
    #[inline(never)]
    fn view_moving<'v>(
        &self,
        moving: &MovingTriangle<'a>,
        x: &ShadingPoint,
        environment: Option<&'v EnvironmentView<'v>>,
    ) -> Option<LightView<'v>>
    where
        'a: 'v,
    {
        TriangleView::moving(moving, x, self.illumination, self.cells, environment, LightView::Triangle)
    }

    /// Returns what the weight of a light that is no triangle or that moves is multiplied by.
    #[inline(never)]
    pub(in crate::light) fn scale_of_other(&self, leaf: u32) -> f32 {
        self.light(leaf).scale(self.scales, self.meshes)
    }
}
