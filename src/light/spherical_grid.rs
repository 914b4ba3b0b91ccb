//! Sampling a triangle without a texture by directions: a grid of cells of equal solid angle on what is visible of it.
//!
//! The part of the triangle above the receiver's horizon is one or two spherical triangles ([`VisiblePart`]). The equal-area
//! map of the unit square to each ([`SphericalTriangle`](crate::warp::SphericalTriangle)) makes a grid of 8 x 8 cells, columns of which meet in one corner.
//! Cells are chosen by solid angle times the receiver's weight and the environment's radiance in their central directions,
//! all 64 weighed in one vector loop. The chosen cell is divided again in the same way while the environment varies over
//! it, up to three times. So there is nothing of the geometry left that could vary but the receiver's weight within a cell:
//! the density does not depend on how near the triangle is.
//!
//! Sampling and density share [`descend`](SphericalGrid::descend): a [`GridGuide`] draws the way or follows a point. A drawn
//! direction is rounded to a point of the triangle's lattice, and the density is that of the rounded point.

use glam::{DVec3, Vec3};

use super::triangle_view::TriangleView;
use super::visible_part::VisiblePart;
use crate::env::EnvironmentView;
use crate::math::{self, at_least};
use crate::receiver::{Receiver, ReceiverKind, ReceiverLanes};
use crate::warp::equal_area::sphere_to_square_lanes;
use crate::warp::{SphericalColumns, Variate, keep_possible, pick_pair, pick_wide, pmf_wide};

/// Columns of a step, and rows.
const SIDE: usize = 8;
/// Base-2 logarithm of [`SIDE`].
const SIDE_BITS: u32 = SIDE.trailing_zeros();
/// Columns of each of two spherical triangles that share a step.
const HALF: usize = SIDE / 2;
/// Cells of a step. Lane `row * SIDE + column`: sums over the rows are sums of vectors.
const LANES: usize = SIDE * SIDE;

/// Most steps. *Measured* on the window under clouds: the third takes the energy-weighted variance from 0.065 to 0.033, for
/// less than 1 % more time.
///
/// Larger: nothing more is gained. Smaller: small bright parts of the environment are missed.
const MAX_STEPS: usize = 3;

/// Bits of a coordinate of the unit square that cells are told by. *Proved*: three steps use 9 of them.
///
/// Larger than 32: coordinates would not fit. Smaller than 9: cells could not be told apart.
const FIXED_BITS: u32 = 30;

/// Least solid angle of a grid. *Measured* with slivers and specks of a triangle: below it, rounding moves directions
/// between cells.
///
/// Larger: more of the small triangles are divided by area. Smaller: densities could be those of a neighboring cell.
const LEAST_SOLID_ANGLE: f64 = 1e-6;

/// Ratio of a chord to the largest distance from the pole up to which radii of cells are bounded. *Proved*: an arc grows by
/// at most 1.4003 times its chord there.
///
/// Larger: bounds would not hold. Smaller: large cells are taken for everything.
const LARGEST_CHORD: f32 = 1.4;

/// How much an arc grows with its chord, up to [`LARGEST_CHORD`]. *Proved*: `1 / sqrt(1 - 1.4² / 4)`, rounded up.
const ARC_OVER_CHORD: f32 = 1.42;

/// A grid of cells on what is visible of a triangle.
pub(super) struct SphericalGrid<'a> {
    visible: VisiblePart,
    receiver: Receiver,
    lanes: ReceiverLanes,
    environment: Option<&'a EnvironmentView<'a>>,
}

/// A cell of a grid: which of the columns and rows that a step has left of one spherical triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GridCell {
    /// Which of the spherical triangles.
    part: usize,
    column: u32,
    /// Base-2 logarithm of the number of columns.
    column_bits: u32,
    row: u32,
    /// Base-2 logarithm of the number of rows.
    row_bits: u32,
}

/// A point of the unit square of one spherical triangle.
#[derive(Clone, Copy, Debug)]
struct GridPoint {
    part: usize,
    /// Column and row of the finest division, by [`FIXED_BITS`].
    fixed: [u32; 2],
}

impl GridCell {
    const ALL: Self = Self { part: 0, column: 0, column_bits: 0, row: 0, row_bits: 0 };

    /// Size along both coordinates.
    #[inline(always)]
    fn size(&self) -> [f64; 2] {
        [1.0 / f64::from(1_u32 << self.column_bits), 1.0 / f64::from(1_u32 << self.row_bits)]
    }

    /// Least coordinates.
    #[inline(always)]
    fn corner(&self) -> [f64; 2] {
        let [width, height] = self.size();
        [f64::from(self.column) * width, f64::from(self.row) * height]
    }

    /// A point of the cell by its own coordinates in `[0, 1]`.
    #[inline(always)]
    fn at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [width, height] = self.size();
        [(f64::from(self.column) + u) * width, (f64::from(self.row) + v) * height]
    }

    #[inline(always)]
    fn holds(&self, point: GridPoint) -> bool {
        let [column, row] = point.fixed;
        self.part == point.part
            && column >> (FIXED_BITS - self.column_bits) == self.column
            && row >> (FIXED_BITS - self.row_bits) == self.row
    }
}

impl GridPoint {
    /// Points outside of the square are moved to its edge, and NaN to a corner.
    #[inline(always)]
    fn new((part, point): (usize, [f64; 2])) -> Self {
        let scale = f64::from(1_u32 << FIXED_BITS);
        // The cast saturates.
        Self { part, fixed: point.map(|x| ((x * scale) as u32).min((1 << FIXED_BITS) - 1)) }
    }
}

/// What leads a descent from a cell to one of its cells.
trait GridGuide {
    /// Chooses a column by the sums of the columns, then a row. Returns both with their probability; `None` where that is
    /// zero. A step has `1 << column_bits` columns of each spherical triangle.
    fn choose(
        &mut self,
        cell: &GridCell,
        column_bits: u32,
        sums: &[f32; SIDE],
        rows: impl Fn(usize) -> [f32; SIDE],
    ) -> Option<([usize; 2], f64)>;
}

/// Draws the way.
struct DrawCell {
    u: [Variate; 2],
}

impl GridGuide for DrawCell {
    #[inline(always)]
    fn choose(
        &mut self,
        _cell: &GridCell,
        _column_bits: u32,
        sums: &[f32; SIDE],
        rows: impl Fn(usize) -> [f32; SIDE],
    ) -> Option<([usize; 2], f64)> {
        let (column, share) = pick_wide(sums, &mut self.u[1])?;
        let (row, share_of_column) = pick_wide(&rows(column), &mut self.u[0])?;
        Some(([column, row], share * share_of_column))
    }
}

/// Follows a point.
struct FollowPoint {
    point: GridPoint,
}

impl GridGuide for FollowPoint {
    #[inline(always)]
    fn choose(
        &mut self,
        cell: &GridCell,
        column_bits: u32,
        sums: &[f32; SIDE],
        rows: impl Fn(usize) -> [f32; SIDE],
    ) -> Option<([usize; 2], f64)> {
        let GridPoint { part, fixed: [column, row] } = self.point;
        let column = (column >> (FIXED_BITS - cell.column_bits - column_bits)) as usize & ((1 << column_bits) - 1);
        let row = (row >> (FIXED_BITS - cell.row_bits - SIDE_BITS)) as usize & (SIDE - 1);
        // In a step that two share, the second has the last columns.
        let column = if column_bits < SIDE_BITS { column + part * HALF } else { column };
        let pmf = pmf_wide(sums, column) * pmf_wide(&rows(column), row);
        (pmf > 0.0).then_some(([column, row], pmf))
    }
}

/// What all rows of a step share, by column.
struct Columns {
    /// Start of the arcs, the same for all columns of a spherical triangle, by coordinate.
    poles: [[f32; SIDE]; 3],
    arcs: SphericalColumns<SIDE>,
    /// Solid angle of each cell.
    solid_angles: [f32; SIDE],
    /// Least mean weight of the receiver over each cell.
    least: [f32; SIDE],
    /// Texels a side of the level that the environment is looked up in.
    sizes: [f32; SIDE],
}

/// The weights of a step, and where the environment was looked up.
struct Weighed {
    weights: [f32; LANES],
    /// Points of the square of the environment.
    points: [[f32; LANES]; 2],
}

impl<'a> SphericalGrid<'a> {
    /// Returns the grid of a triangle; `None` where there is nothing above the horizon, or too little of it.
    #[inline(always)]
    pub(super) fn new(view: &TriangleView<'a>) -> Option<Self> {
        let horizon = view.receiver.has_horizon().then(|| view.receiver_normal.as_dvec3());
        let visible = VisiblePart::new(view.exact_vertices, view.determinant, horizon)?;
        (visible.solid_angle() >= LEAST_SOLID_ANGLE).then(|| Self {
            visible,
            receiver: view.receiver,
            lanes: view.receiver.lanes(Vec3::ZERO),
            environment: view.environment,
        })
    }

    /// Draws a direction by the cells, and returns it with the cell and the density of all directions in the cell.
    #[inline(always)]
    pub(super) fn draw(&self, u: [Variate; 2]) -> Option<(DVec3, GridCell, f64)> {
        let mut guide = DrawCell { u };
        let (cell, pdf) = self.descend(&mut guide)?;
        let [v, u] = guide.u.map(|u| u.value());
        Some((self.visible.triangles()[cell.part].direction(cell.at([u, v])), cell, pdf))
    }

    /// Returns the density per solid angle of a unit direction above the horizon. `drawn` may be a cell with its density.
    #[inline(always)]
    pub(super) fn pdf(&self, direction: DVec3, drawn: Option<(GridCell, f64)>) -> Option<f64> {
        let point = GridPoint::new(self.visible.locate(direction));
        match drawn {
            Some((cell, pdf)) if cell.holds(point) => Some(pdf),
            _ => self.descend(&mut FollowPoint { point }).map(|(_, pdf)| pdf),
        }
    }

    /// Draws a direction uniformly.
    #[inline]
    pub(super) fn draw_uniformly(&self, [v, mut u]: [Variate; 2]) -> DVec3 {
        let triangles = self.visible.triangles();
        let index = if self.visible.is_split() {
            pick_pair(triangles.map(|triangle| triangle.solid_angle() as f32), &mut u)
        } else {
            0
        };
        triangles[index].direction([u.value(), v.value()])
    }

    /// Returns the density per solid angle of [`Self::draw_uniformly`].
    #[inline]
    pub(super) fn uniform_pdf(&self) -> f64 {
        1.0 / self.visible.solid_angle()
    }

    /// Descends to a cell over which the density is constant. Returns the cell with its density per solid angle.
    #[inline(always)]
    fn descend(&self, guide: &mut impl GridGuide) -> Option<(GridCell, f64)> {
        let mut cell = GridCell::ALL;
        let mut pmf = 1.0;
        for step in 1..=MAX_STEPS {
            let is_shared = step == 1 && self.visible.is_split();
            let columns = if is_shared {
                let mut columns = self.columns::<HALF>(&cell);
                columns.append(&self.columns::<HALF>(&GridCell { part: 1, ..cell }));
                columns
            } else {
                self.columns::<SIDE>(&cell)
            };
            let column_bits = if is_shared { SIDE_BITS - 1 } else { SIDE_BITS };
            let Weighed { weights, points } = self.weigh(&cell, &columns, is_shared);
            let mut sums = [0.0; SIDE];
            for j in 0..SIDE {
                for i in 0..SIDE {
                    sums[i] += weights[j * SIDE + i];
                }
            }
            let rows = |column: usize| core::array::from_fn(|j| weights[(j * SIDE + column) % LANES]);
            let ([column, row], chosen) = guide.choose(&cell, column_bits, &sums, rows)?;
            pmf *= chosen;
            if is_shared {
                cell.part = column / HALF;
            }
            let within = column as u32 & ((1 << column_bits) - 1);
            cell = GridCell {
                part: cell.part,
                column: cell.column << column_bits | within,
                column_bits: cell.column_bits + column_bits,
                row: cell.row << SIDE_BITS | row as u32,
                row_bits: cell.row_bits + SIDE_BITS,
            };
            let Some(environment) = self.environment else { break };
            let lane = (row * SIDE + column) % LANES;
            let point = [points[0][lane], points[1][lane]];
            if step == MAX_STEPS || environment.is_about_constant(point, columns.solid_angles[column % SIDE]) {
                break;
            }
        }
        let [width, height] = cell.size();
        let solid_angle = self.visible.triangles()[cell.part].solid_angle() * (width * height);
        Some((cell, pmf / solid_angle))
    }

    /// Returns the columns of a step in the first lanes.
    #[inline(always)]
    fn columns<const COLUMNS: usize>(&self, cell: &GridCell) -> Columns {
        let triangle = &self.visible.triangles()[cell.part];
        let ([u, _], [width, height]) = (cell.corner(), cell.size());
        let step = width * (1.0 / COLUMNS as f64);
        let arcs = triangle.columns::<COLUMNS>(u + 0.5 * step, step);
        let solid_angle = (triangle.solid_angle() * (width * height) * (1.0 / (COLUMNS * SIDE) as f64)) as f32;
        let size = self.environment.map_or(1.0, |environment| environment.filter_size(solid_angle));
        Columns {
            poles: triangle.pole().as_vec3().to_array().map(|x| [x; SIDE]),
            arcs: widened(&arcs),
            solid_angles: [solid_angle; SIDE],
            least: [self.receiver.least_over_directions(solid_angle); SIDE],
            sizes: [size; SIDE],
        }
    }

    /// Weighs the cells of a step.
    #[inline(always)]
    fn weigh(&self, cell: &GridCell, columns: &Columns, is_shared: bool) -> Weighed {
        let heights = self.rows(cell, 0.5);
        let Columns { poles, arcs, .. } = columns;
        let normal = self.lanes.normal;
        let cosines = |of: &[[f32; SIDE]; 3]| -> [f32; SIDE] {
            core::array::from_fn(|i| normal.x * of[0][i] + normal.y * of[1][i] + normal.z * of[2][i])
        };
        let (pole_cosines, arc_cosines) = (cosines(poles), cosines(&arcs.toward));
        let mut weighed = Weighed { weights: [0.0; LANES], points: [[0.0; LANES]; 2] };
        let mut texels = [0; LANES];
        let local = self.environment.map(|environment| {
            (environment.to_local_lanes(poles), environment.to_local_lanes(&arcs.toward))
        });
        for j in 0..SIDE {
            let (mut sines, mut versines) = ([0.0; SIDE], [0.0; SIDE]);
            for i in 0..SIDE {
                let m = heights[j] * arcs.versines[i];
                versines[i] = 1.0 - m;
                sines[i] = math::sqrt(at_least(m * (2.0 - m), 0.0));
            }
            let cosines = core::array::from_fn(|i| pole_cosines[i] * versines[i] + arc_cosines[i] * sines[i]);
            let toward = self.lanes.weights_of_cells(&cosines, &columns.least);
            for i in 0..SIDE {
                weighed.weights[j * SIDE + i] = toward[i] * columns.solid_angles[i];
            }
            if let Some((poles, arcs)) = &local {
                let directions: [[f32; SIDE]; 3] = core::array::from_fn(|k| {
                    core::array::from_fn(|i| poles[k][i] * versines[i] + arcs[k][i] * sines[i])
                });
                let points = sphere_to_square_lanes(&directions);
                let found = EnvironmentView::texels_of_lanes(&points, &columns.sizes);
                for i in 0..SIDE {
                    weighed.points[0][j * SIDE + i] = points[0][i];
                    weighed.points[1][j * SIDE + i] = points[1][i];
                    texels[j * SIDE + i] = found[i];
                }
            }
        }
        if let Some(environment) = self.environment {
            if environment.is_rough() {
                let cover = self.cover(environment, cell, columns, is_shared, &weighed.points);
                environment.weigh_lanes(&texels, Some(&cover), &mut weighed.weights);
            } else {
                environment.weigh_lanes(&texels, None, &mut weighed.weights);
            }
        }
        let possible: [bool; LANES] = core::array::from_fn(|i| weighed.weights[i] > 0.0);
        keep_possible(&mut weighed.weights, |i| possible[i]);
        weighed
    }

    /// Coordinates of a step's rows, at this share of each row's height.
    #[inline(always)]
    fn rows(&self, cell: &GridCell, share: f32) -> [f32; SIDE] {
        let ([_, v], [_, height]) = (cell.corner(), cell.size());
        let (v, step) = (v as f32, height as f32 * (1.0 / SIDE as f32));
        core::array::from_fn(|j| v + (j as f32 + share) * step)
    }

    /// Returns the texels whose filters hold all directions of each cell.
    ///
    /// From the center of a cell to any other of its directions: along the center's column, over a chord that grows with the
    /// square root of `v`; then across. There the end of the arc moves by at most δ, so that the chord changes by no more
    /// than that, and the arc turns around the pole by at most γ.
    #[inline(always)]
    fn cover(
        &self,
        environment: &EnvironmentView<'_>,
        cell: &GridCell,
        columns: &Columns,
        is_shared: bool,
        points: &[[f32; LANES]; 2],
    ) -> [u32; LANES] {
        let [left, right] = [0.0, 1.0].map(|side| self.edges(cell, side, is_shared));
        let distance = |a: &[[f32; SIDE]; 3], b: &[[f32; SIDE]; 3], i: usize| {
            let [x, y, z] = [a[0][i] - b[0][i], a[1][i] - b[1][i], a[2][i] - b[2][i]];
            math::sqrt(x * x + y * y + z * z)
        };
        let farthest = |of: fn(&SphericalColumns<SIDE>) -> &[[f32; SIDE]; 3]| -> [f32; SIDE] {
            core::array::from_fn(|i| {
                let (left, right) =
                    (distance(of(&left), of(&columns.arcs), i), distance(of(&right), of(&columns.arcs), i));
                at_least(left, right)
            })
        };
        let (ends, turns) = (farthest(|arcs| &arcs.ends), farthest(|arcs| &arcs.toward));
        let chords: [f32; SIDE] = core::array::from_fn(|i| math::sqrt(2.0 * columns.arcs.versines[i]));
        let [low, center, high] = [0.0, 0.5, 1.0].map(|share| self.rows(cell, share).map(math::sqrt));
        let mut texels = [0; LANES];
        for j in 0..SIDE {
            let (along, top) = (center[j] - low[j], high[j]);
            let angles: [f32; SIDE] = core::array::from_fn(|i| {
                let chord = top * (chords[i] + ends[i]);
                let sum = ARC_OVER_CHORD * (along * chords[i] + top * ends[i]) + chord * turns[i];
                // 2 asin(s / 2) <= s + 0.1427 s³ up to 2, where the bound is more than any cell's.
                let angle = sum + 0.1427 * (sum * sum * sum);
                if chord < LARGEST_CHORD { angle } else { f32::INFINITY }
            });
            let row = |k: usize| core::array::from_fn(|i| points[k][j * SIDE + i]);
            let found = EnvironmentView::texels_of_lanes(&[row(0), row(1)], &environment.cover_sizes(&angles));
            texels[j * SIDE..][..SIDE].copy_from_slice(&found);
        }
        texels
    }

    /// The arcs along one edge of each column.
    #[inline(always)]
    fn edges(&self, cell: &GridCell, side: f64, is_shared: bool) -> SphericalColumns<SIDE> {
        let ([u, _], [width, _]) = (cell.corner(), cell.size());
        let triangles = self.visible.triangles();
        if is_shared {
            let step = width * (1.0 / HALF as f64);
            let [first, second] =
                [0, 1].map(|part: usize| widened(&triangles[part].columns::<HALF>(u + side * step, step)));
            joined(first, &second)
        } else {
            let step = width * (1.0 / SIDE as f64);
            triangles[cell.part].columns::<SIDE>(u + side * step, step)
        }
    }
}

impl Columns {
    /// Puts the first half of the columns of another after those of this one.
    #[inline(always)]
    fn append(&mut self, other: &Self) {
        for (to, from) in self.poles.iter_mut().zip(&other.poles) {
            to[HALF..].copy_from_slice(&from[..HALF]);
        }
        self.arcs = joined(self.arcs, &other.arcs);
        self.solid_angles[HALF..].copy_from_slice(&other.solid_angles[..HALF]);
        self.least[HALF..].copy_from_slice(&other.least[..HALF]);
        self.sizes[HALF..].copy_from_slice(&other.sizes[..HALF]);
    }
}

/// Puts columns into the first lanes.
#[inline(always)]
fn widened<const COLUMNS: usize>(arcs: &SphericalColumns<COLUMNS>) -> SphericalColumns<SIDE> {
    let lanes = |values: &[f32; COLUMNS]| {
        let mut lanes = [0.0; SIDE];
        lanes[..COLUMNS].copy_from_slice(values);
        lanes
    };
    SphericalColumns {
        ends: [lanes(&arcs.ends[0]), lanes(&arcs.ends[1]), lanes(&arcs.ends[2])],
        toward: [lanes(&arcs.toward[0]), lanes(&arcs.toward[1]), lanes(&arcs.toward[2])],
        versines: lanes(&arcs.versines),
    }
}

/// The first halves of both.
#[inline(always)]
fn joined(mut first: SphericalColumns<SIDE>, second: &SphericalColumns<SIDE>) -> SphericalColumns<SIDE> {
    for k in 0..3 {
        first.ends[k][HALF..].copy_from_slice(&second.ends[k][..HALF]);
        first.toward[k][HALF..].copy_from_slice(&second.toward[k][..HALF]);
    }
    first.versines[HALF..].copy_from_slice(&second.versines[..HALF]);
    first
}

#[cfg(test)]
mod tests;
