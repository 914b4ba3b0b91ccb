//! Shapes of the window, as outlines in the plane of the wall.

use core::f32::consts::PI;

use glam::{Vec2, vec2};

/// Where the window's middle lies in its wall.
const CENTER: Vec2 = vec2(1.5, 2.0);

/// Panes of the lattice along one side.
const PANES: u32 = 8;
/// Length of the lattice's side.
const LATTICE_SIDE: f32 = 1.5;

/// A shape of the window.
///
/// Points of the wall are written `(y, z)`: what runs counter-clockwise in them faces the room, at +x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Window {
    /// A square meter.
    Rect,
    /// A five-pointed star of one square meter.
    Star,
    /// A grid of square panes half as wide as their pitch.
    Lattice,
}

impl Window {
    /// One closed outline for each opening.
    pub(crate) fn outlines(self) -> Vec<Vec<Vec2>> {
        match self {
            Self::Rect => vec![square(CENTER, 1.0)],
            Self::Star => vec![star()],
            Self::Lattice => lattice(),
        }
    }

    /// The two opposite corners of the box around all openings.
    pub(crate) fn bounds(self) -> (Vec2, Vec2) {
        let points = || self.outlines().into_iter().flatten();
        (points().fold(Vec2::INFINITY, Vec2::min), points().fold(Vec2::NEG_INFINITY, Vec2::max))
    }

    /// Whether a point of the wall lies in an opening.
    pub(crate) fn contains(outlines: &[Vec<Vec2>], point: Vec2) -> bool {
        outlines.iter().any(|outline| is_inside(outline, point))
    }
}

fn square(center: Vec2, side: f32) -> Vec<Vec2> {
    let half = 0.5 * side;
    [vec2(-half, -half), vec2(half, -half), vec2(half, half), vec2(-half, half)].map(|corner| center + corner).to_vec()
}

/// Ten points alternately on an outer circle and on one of 0.4 times its radius.
fn star() -> Vec<Vec2> {
    const INNER: f32 = 0.4;
    let step = PI / 5.0;
    let outer = (1.0 / (5.0 * INNER * step.sin())).sqrt();
    let point = |k: u8| {
        let radius = if k % 2 == 1 { INNER * outer } else { outer };
        let (sin, cos) = (0.5 * PI + step * f32::from(k)).sin_cos();
        CENTER + radius * vec2(sin, cos)
    };
    (0..10).map(point).collect()
}

fn lattice() -> Vec<Vec<Vec2>> {
    let pitch = LATTICE_SIDE / PANES as f32;
    let corner = CENTER - Vec2::splat(0.5 * LATTICE_SIDE);
    let pane = |i: u32| {
        let cell = vec2((i / PANES) as f32, (i % PANES) as f32);
        square(corner + (cell + 0.5) * pitch, 0.5 * pitch)
    };
    (0..PANES * PANES).map(pane).collect()
}

/// Counts the edges that a ray along +z crosses (even-odd rule).
fn is_inside(outline: &[Vec2], point: Vec2) -> bool {
    let next = outline.iter().cycle().skip(1);
    let crossings = outline.iter().zip(next).filter(|(a, b)| {
        let spans = (a.x > point.x) != (b.x > point.x);
        spans && point.y < a.y + (point.x - a.x) / (b.x - a.x) * (b.y - a.y)
    });
    crossings.count() % 2 == 1
}
