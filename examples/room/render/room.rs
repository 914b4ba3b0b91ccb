//! The geometry: six walls, one of them with a window.

use core::ops::Range;

use earcut::Earcut;
use glam::{Vec2, Vec2Swizzles, Vec3, Vec3Swizzles, vec2, vec3};

use super::mask::Mask;
use super::window::Window;

/// The corner of the room away from the origin.
const SIZE: Vec3 = vec3(4.0, 3.0, 4.0);

/// How the window is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Opening {
    /// A hole in the wall, with a portal of the same shape in it.
    Hole,
    /// A rectangular card of two triangles whose texture says where it is open.
    Clip,
}

/// Triangles with texture coordinates.
#[derive(Clone, Default)]
pub(crate) struct TriangleMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) uvs: Vec<Vec2>,
}

/// The room's triangles.
pub(crate) struct Room {
    /// What blocks light.
    pub(crate) walls: TriangleMesh,
    /// Which of the wall's triangles have the mask's holes.
    pub(crate) masked: Range<usize>,
    /// The mask of a clipped window.
    pub(crate) mask: Option<Mask>,
    /// What light comes in by. Its front side is that of the room.
    pub(crate) portal: TriangleMesh,
}

impl Room {
    /// Builds the room.
    pub(crate) fn new(window: Window, opening: Opening) -> Self {
        let (low, high) = window.bounds();
        let card = vec![low, vec2(high.x, low.y), high, vec2(low.x, high.y)];
        let outlines = match opening {
            Opening::Hole => window.outlines(),
            Opening::Clip => vec![card],
        };
        let uv = |point: Vec2| ((point - low) / (high - low)).yx();

        let mut portal = TriangleMesh::default();
        for outline in &outlines {
            portal.add_polygon(outline, &[], uv);
        }
        let mut walls = closed_walls();
        walls.add_polygon(&[Vec2::ZERO, vec2(SIZE.y, 0.0), SIZE.yz(), vec2(0.0, SIZE.z)], &outlines, uv);
        let solid = walls.indices.len();
        let mask = (opening == Opening::Clip).then(|| Mask::draw(window));
        if mask.is_some() {
            walls.append(&portal);
        }
        Self { masked: solid..walls.indices.len(), walls, mask, portal }
    }
}

/// The five walls without a window.
fn closed_walls() -> TriangleMesh {
    let corners = (0..8u8).map(|i| Vec3::from([i & 1, i >> 1 & 1, i >> 2 & 1].map(f32::from)) * SIZE).collect();
    let quads = [[1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    let indices = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh { positions: corners, indices, uvs: vec![Vec2::ZERO; 8] }
}

impl TriangleMesh {
    /// Adds a polygon with holes that lies in the wall x = 0, facing the room.
    fn add_polygon(&mut self, outline: &[Vec2], holes: &[Vec<Vec2>], uv: impl Fn(Vec2) -> Vec2) {
        let points: Vec<Vec2> = outline.iter().chain(holes.iter().flatten()).copied().collect();
        let starts: Vec<u32> = holes
            .iter()
            .scan(outline.len() as u32, |next, hole| Some(core::mem::replace(next, *next + hole.len() as u32)))
            .collect();
        let mut corners: Vec<u32> = Vec::new();
        Earcut::new().earcut(points.iter().map(Vec2::to_array), &starts, &mut corners);

        let first = self.positions.len() as u32;
        let triangles = corners.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]);
        self.indices.extend(triangles.map(|[a, b, c]| {
            let [pa, pb, pc] = [a, b, c].map(|i| points[i as usize]);
            let faces_room = (pb - pa).perp_dot(pc - pa) > 0.0;
            (if faces_room { [a, b, c] } else { [a, c, b] }).map(|i| first + i)
        }));
        self.positions.extend(points.iter().map(|point| vec3(0.0, point.x, point.y)));
        self.uvs.extend(points.into_iter().map(uv));
    }

    fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|triangle| triangle.map(|i| first + i)));
    }
}
