//! The clip map of a window that is drawn on a card instead of cut into the wall.

use glam::Vec2;

use super::window::Window;

/// Texels along one side of a mask.
const SIZE: u32 = 512;

/// A square image of ones (open) and zeros (wall). Row 0 lies at `v = 0`.
pub(crate) struct Mask {
    texels: Vec<f32>,
}

impl Mask {
    /// Draws a window over the box around its openings; `u` runs along z and `v` along y.
    pub(crate) fn draw(window: Window) -> Self {
        let outlines = window.outlines();
        let (low, high) = window.bounds();
        let texel = |i: u32| {
            let center = Vec2::new((i / SIZE) as f32 + 0.5, (i % SIZE) as f32 + 0.5) / SIZE as f32;
            f32::from(Window::contains(&outlines, low + center * (high - low)))
        };
        Self { texels: (0..SIZE * SIZE).map(texel).collect() }
    }

    /// Texels along one side.
    pub(crate) const fn size(&self) -> u32 {
        SIZE
    }

    /// All texels, row by row.
    pub(crate) fn texels(&self) -> &[f32] {
        &self.texels
    }

    /// Whether light passes at `uv`: the nearest texel, and the one at the edge outside of `[0, 1]`.
    pub(crate) fn is_open(&self, uv: Vec2) -> bool {
        let texel = (uv * SIZE as f32).clamp(Vec2::ZERO, Vec2::splat((SIZE - 1) as f32)).as_uvec2();
        self.texels[(texel.y * SIZE + texel.x) as usize] > 0.0
    }
}
