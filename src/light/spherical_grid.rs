//! Sampling a triangle without a texture by directions: a grid of cells of equal solid angle on what is visible of it.
//!
//! The part of the triangle above the receiver's horizon is one or two spherical triangles ([`VisiblePart`]). The
//! equal-area map from the unit square to each ([`SphericalTriangle`](crate::warp::SphericalTriangle)) makes a grid of
//! 8 x 8 cells, whose columns meet in one corner. (Two triangles share the columns of the first step.) Cells are chosen
//! by solid angle times the receiver's weight and the environment's radiance in their central directions; one vector
//! loop weighs all 64. While the environment or the receiver's lobe varies over the chosen cell, it is divided again in
//! the same way, in up to three steps in all. Of the geometry, only the receiver's weight varies within a cell: the
//! density does not depend on how near the triangle is.
//!
//! Sampling and density share [`descend`](SphericalGrid::descend): a [`GridGuide`] draws the way or follows a point. A
//! drawn direction is rounded to a point of the triangle's lattice, and the density is that of the rounded point.

use glam::{DVec3, Vec3};

use super::triangle_view::TriangleView;
use super::visible_part::VisiblePart;
use crate::env::{EnvironmentView, texel_of};
use crate::math::{self, at_least};
use crate::receiver::{Lobe, Receiver, ReceiverKind, ReceiverLanes, SPREAD_OF_SOLID_ANGLE};
use crate::warp::equal_area::sphere_to_square_quickly;
use crate::warp::{COLUMNS, SphericalColumns, Variate, keep_positive, pick_pair, pick_wide, pmf_wide};

/// Columns of a step, and rows.
const SIDE: usize = COLUMNS;
/// Base-2 logarithm of [`SIDE`].
const SIDE_BITS: u32 = SIDE.trailing_zeros();
/// Columns of each of two spherical triangles that share a step.
const HALF: usize = SIDE / 2;
/// Cells of a step. Lane `row * SIDE + column`: sums over the rows are sums of vectors.
const GRID_LANES: usize = SIDE * SIDE;

/// Most steps. *Measured* on the window under clouds (docs/ACCURACY.md, "Wide steps"): the third takes the
/// energy-weighted variance from 0.065 to 0.033, for less than 1 % more time.
///
/// Larger: cells smaller than the texels of most environments. Smaller: small bright parts of the environment are left
/// to noise.
const MAX_STEPS: usize = 3;

/// Bits of a coordinate of the unit square that cells are told by. *Proved*: three steps use 9 of them.
///
/// Larger than 32: coordinates would not fit. Smaller than 9: cells could not be told apart.
const FIXED_BITS: u32 = 30;

/// Least solid angle of a grid. Chosen with slivers and specks of a triangle, not swept: far below it, rounding moves
/// directions between cells.
///
/// Larger: more of the small triangles are divided by area. Smaller: densities could be those of a neighboring cell.
pub(super) const LEAST_SOLID_ANGLE: f64 = 1e-6;

/// Ratio of a chord to the largest distance from the pole up to which radii of cells are bounded. *Proved*: an arc
/// grows by at most 1.4003 times its chord there.
///
/// Larger: bounds would not hold. Smaller: large cells are taken for everything.
const LARGEST_CHORD: f32 = 1.4;

/// How much an arc grows with its chord, up to [`LARGEST_CHORD`]. *Proved*: `1 / sqrt(1 - 1.4² / 4)`, rounded up.
const ARC_OVER_CHORD: f32 = 1.42;

/// A grid of cells on what is visible of a triangle.
pub(super) struct SphericalGrid<'a, L> {
    visible: VisiblePart,
    receiver: Receiver,
    lanes: ReceiverLanes<L>,
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
    /// Chooses a column by the sums of the columns, then a row. Returns both with their probability; `None` where that
    /// is zero. A step has `1 << column_bits` columns of each spherical triangle.
    fn choose(
        &mut self,
        cell: &GridCell,
        column_bits: u32,
        sums: &[f32; SIDE],
        weights: &[f32; GRID_LANES],
    ) -> Option<([usize; 2], f64)>;
}

/// Weights of the cells of a column.
#[inline(always)]
fn rows_of(weights: &[f32; GRID_LANES], column: usize) -> [f32; SIDE] {
    let mut rows = [0.0; SIDE];
    for (j, row) in rows.iter_mut().enumerate() {
        *row = weights[j * SIDE + column % SIDE];
    }
    rows
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
        weights: &[f32; GRID_LANES],
    ) -> Option<([usize; 2], f64)> {
        let (column, share) = pick_wide(sums, &mut self.u[1])?;
        let (row, share_of_column) = pick_wide(&rows_of(weights, column), &mut self.u[0])?;
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
        weights: &[f32; GRID_LANES],
    ) -> Option<([usize; 2], f64)> {
        let GridPoint { part, fixed: [column, row] } = self.point;
        let column = (column >> (FIXED_BITS - cell.column_bits - column_bits)) as usize & ((1 << column_bits) - 1);
        let row = (row >> (FIXED_BITS - cell.row_bits - SIDE_BITS)) as usize & (SIDE - 1);
        // In a step that two share, the second has the last columns.
        let column = if column_bits < SIDE_BITS { column + part * HALF } else { column };
        let pmf = pmf_wide(sums, column) * pmf_wide(&rows_of(weights, column), row);
        (pmf > 0.0).then_some(([column, row], pmf))
    }
}

/// One step of a descent.
struct Step {
    /// Start of the arcs, the same for all columns of a spherical triangle, by coordinate.
    poles: [[f32; SIDE]; 3],
    arcs: SphericalColumns,
    /// Solid angle of each cell, by column.
    solid_angles: [f32; SIDE],
    /// Least mean weight of the receiver over each cell, by column.
    least: [f32; SIDE],
    /// Level that the environment is looked up in, by column.
    levels: Levels,
    /// Weights of the cells.
    weights: [f32; GRID_LANES],
    /// Points of the square of the environment that the cells' centers lie at.
    points: [[f32; GRID_LANES]; 2],
    /// Texels of the levels.
    texels: [u32; GRID_LANES],
}

/// Levels of the environment, by column.
#[derive(Default)]
struct Levels {
    /// Texels a side.
    sizes: [f32; SIDE],
    /// Number of the first texel.
    starts: [u32; SIDE],
    /// Texels a row.
    strides: [u32; SIDE],
}

impl Step {
    #[inline(always)]
    fn new() -> Self {
        Self {
            poles: [[0.0; SIDE]; 3],
            arcs: SphericalColumns::default(),
            solid_angles: [0.0; SIDE],
            least: [0.0; SIDE],
            levels: Levels::default(),
            weights: [0.0; GRID_LANES],
            points: [[0.0; GRID_LANES]; 2],
            texels: [0; GRID_LANES],
        }
    }
}

impl<'a, L: Lobe> SphericalGrid<'a, L> {
    /// Returns the grid of a triangle, with the lobe of the receiver; `None` where there is nothing above the horizon,
    /// or too little of it.
    #[inline(always)]
    pub(super) fn new(view: &TriangleView<'a>, lobe: L) -> Option<Self> {
        let horizon = view.receiver.has_horizon().then(|| view.receiver_normal.as_dvec3());
        let visible = VisiblePart::new(view.exact_vertices, view.determinant, horizon)?;
        (visible.solid_angle() >= LEAST_SOLID_ANGLE).then(|| Self {
            visible,
            receiver: view.receiver,
            lanes: view.receiver.lanes(Vec3::ZERO).with_lobe(lobe),
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

    /// Returns the density per solid angle of a unit direction above the horizon. `drawn` may be a cell with its
    /// density.
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
        let mut step = Step::new();
        for number in 1..=MAX_STEPS {
            let is_shared = number == 1 && self.visible.is_split();
            if is_shared {
                self.columns::<0, HALF>(&cell, &mut step);
                self.columns::<HALF, HALF>(&GridCell { part: 1, ..cell }, &mut step);
            } else {
                self.columns::<0, SIDE>(&cell, &mut step);
            }
            match self.environment {
                None => self.weigh_directions::<false>(&cell, None, &mut step),
                Some(environment) => {
                    self.weigh_directions::<true>(&cell, Some(environment), &mut step);
                    let rough = environment.is_rough().then(|| self.cover(environment, &cell, is_shared, &step));
                    environment.weigh_lanes(&step.texels, rough.as_ref(), &mut step.weights);
                }
            }
            keep_positive(&mut step.weights);
            let mut sums = [0.0; SIDE];
            for row in step.weights.chunks_exact(SIDE) {
                sums.iter_mut().zip(row).for_each(|(sum, weight)| *sum += weight);
            }
            let column_bits = if is_shared { SIDE_BITS - 1 } else { SIDE_BITS };
            let ([column, row], chosen) = guide.choose(&cell, column_bits, &sums, &step.weights)?;
            pmf *= chosen;
            let lane = (row * SIDE + column) % GRID_LANES;
            cell = GridCell {
                part: if is_shared { column / HALF } else { cell.part },
                column: cell.column << column_bits | (column as u32 & ((1 << column_bits) - 1)),
                column_bits: cell.column_bits + column_bits,
                row: cell.row << SIDE_BITS | row as u32,
                row_bits: cell.row_bits + SIDE_BITS,
            };
            let solid_angle = step.solid_angles[column % SIDE];
            let has_constant_radiance = self.environment.is_none_or(|environment| {
                environment.is_about_constant([step.points[0][lane], step.points[1][lane]], solid_angle)
            });
            if number == MAX_STEPS || has_constant_radiance && self.has_constant_lobe(&cell, solid_angle) {
                break;
            }
        }
        let [width, height] = cell.size();
        let solid_angle = self.visible.triangles()[cell.part].solid_angle() * (width * height);
        Some((cell, pmf / solid_angle))
    }

    /// Whether the lobe is about constant over a cell.
    #[inline(always)]
    fn has_constant_lobe(&self, cell: &GridCell, solid_angle: f32) -> bool {
        let center = self.visible.triangles()[cell.part].direction(cell.at([0.5, 0.5])).as_vec3();
        self.lanes.lobe.is_about_constant(center.to_array(), SPREAD_OF_SOLID_ANGLE * solid_angle)
    }

    /// Finds the columns from `START` on of the cells of a cell.
    #[inline(always)]
    fn columns<const START: usize, const COUNT: usize>(&self, cell: &GridCell, step: &mut Step) {
        let triangle = &self.visible.triangles()[cell.part];
        let ([u, _], [width, height]) = (cell.corner(), cell.size());
        let stride = width * (1.0 / COUNT as f64);
        triangle.columns::<START, COUNT>(u + 0.5 * stride, stride, &mut step.arcs);
        let solid_angle = (triangle.solid_angle() * (width * height) * (1.0 / (COUNT * SIDE) as f64)) as f32;
        let size = self.environment.map_or(1, |environment| environment.filter_size(solid_angle));
        let least = self.receiver.least_over_directions(solid_angle);
        let pole = triangle.pole().as_vec3();
        for i in START..START + COUNT {
            (step.poles[0][i], step.poles[1][i], step.poles[2][i]) = (pole.x, pole.y, pole.z);
            (step.solid_angles[i], step.least[i]) = (solid_angle, least);
            step.levels.sizes[i] = size as f32;
            (step.levels.starts[i], step.levels.strides[i]) = (EnvironmentView::first_texel(size), size);
        }
    }

    /// Weighs the cells of a step by solid angle and receiver, and finds where the environment shows in each.
    #[inline(always)]
    fn weigh_directions<const HAS_ENVIRONMENT: bool>(
        &self,
        cell: &GridCell,
        environment: Option<&EnvironmentView<'_>>,
        step: &mut Step,
    ) {
        let ([_, v], [_, height]) = (cell.corner(), cell.size());
        let (v, stride) = (v as f32, height as f32 * (1.0 / SIDE as f32));
        let Step {
            poles,
            arcs: SphericalColumns { toward, versines, .. },
            solid_angles,
            least,
            weights,
            points,
            levels,
            texels,
        } = step;
        let normal = self.lanes.normal;
        let (mut pole_cosines, mut cosines) = ([0.0; SIDE], [0.0; SIDE]);
        let (mut local_poles, mut local) = ([[0.0; SIDE]; 3], [[0.0; SIDE]; 3]);
        for i in 0..SIDE {
            pole_cosines[i] = normal.x * poles[0][i] + normal.y * poles[1][i] + normal.z * poles[2][i];
            cosines[i] = normal.x * toward[0][i] + normal.y * toward[1][i] + normal.z * toward[2][i];
            if let Some(environment) = environment.filter(|_| HAS_ENVIRONMENT) {
                [local_poles[0][i], local_poles[1][i], local_poles[2][i]] =
                    environment.local_vector([poles[0][i], poles[1][i], poles[2][i]]);
                [local[0][i], local[1][i], local[2][i]] =
                    environment.local_vector([toward[0][i], toward[1][i], toward[2][i]]);
            }
        }
        for j in 0..SIDE {
            let v = v + (j as f32 + 0.5) * stride;
            for i in 0..SIDE {
                let m = v * versines[i];
                let (sin, cos) = (math::sqrt(at_least(m * (2.0 - m), 0.0)), 1.0 - m);
                let cosine = self.lanes.weight_of_cell(pole_cosines[i] * cos + cosines[i] * sin, least[i]);
                let direction = [0, 1, 2].map(|k| poles[k][i] * cos + toward[k][i] * sin);
                let spread2 = SPREAD_OF_SOLID_ANGLE * solid_angles[i];
                weights[j * SIDE + i] = self.lanes.lobe.weigh(cosine, direction, 1.0, spread2) * solid_angles[i];
                if HAS_ENVIRONMENT {
                    let x = local_poles[0][i] * cos + local[0][i] * sin;
                    let y = local_poles[1][i] * cos + local[1][i] * sin;
                    let z = local_poles[2][i] * cos + local[2][i] * sin;
                    let [x, y] = sphere_to_square_quickly([x, y, z]);
                    (points[0][j * SIDE + i], points[1][j * SIDE + i]) = (x, y);
                    let (column, row) = (texel_of(x * levels.sizes[i]), texel_of(y * levels.sizes[i]));
                    texels[j * SIDE + i] =
                        levels.starts[i].wrapping_add(row.wrapping_mul(levels.strides[i])).wrapping_add(column);
                }
            }
        }
    }

    /// Returns the texels whose filters hold all directions of each cell.
    ///
    /// From the center of a cell to any other of its directions: along the center's column, over a chord that grows
    /// with the square root of `v`; then across. There the end of the arc moves by at most δ, so that the chord changes
    /// by no more than that, and the arc turns around the pole by at most γ.
    #[inline(always)]
    fn cover(
        &self,
        environment: &EnvironmentView<'_>,
        cell: &GridCell,
        is_shared: bool,
        step: &Step,
    ) -> [u32; GRID_LANES] {
        let (mut ends, mut turns, mut chords) = ([0.0; SIDE], [0.0; SIDE], [0.0; SIDE]);
        for side in [0.0, 1.0] {
            let mut edges = SphericalColumns::default();
            self.edges(cell, side, is_shared, &mut edges);
            for i in 0..SIDE {
                ends[i] = at_least(ends[i], distance(&edges.ends, &step.arcs.ends, i));
                turns[i] = at_least(turns[i], distance(&edges.toward, &step.arcs.toward, i));
            }
        }
        for (chord, versine) in chords.iter_mut().zip(&step.arcs.versines) {
            *chord = math::sqrt(2.0 * versine);
        }
        let finest = environment.size() as f32;
        let ([_, v], [_, height]) = (cell.corner(), cell.size());
        let (v, stride) = (v as f32, height as f32 * (1.0 / SIDE as f32));
        let mut texels = [0; GRID_LANES];
        for j in 0..SIDE {
            let [low, center, high] = [0.0, 0.5, 1.0].map(|share| math::sqrt(v + (j as f32 + share) * stride));
            for i in 0..SIDE {
                let chord = high * (chords[i] + ends[i]);
                let sum = ARC_OVER_CHORD * ((center - low) * chords[i] + high * ends[i]) + chord * turns[i];
                // 2 asin(s / 2) <= s + 0.1427 s³ up to 2, where the bound is more than any texel's.
                let angle = sum + 0.1427 * (sum * sum * sum);
                let angle = if chord < LARGEST_CHORD { angle } else { f32::INFINITY };
                let point = [step.points[0][j * SIDE + i], step.points[1][j * SIDE + i]];
                texels[j * SIDE + i] =
                    EnvironmentView::texel_in_level(point, EnvironmentView::cover_size(angle, finest));
            }
        }
        texels
    }

    /// The arcs along one edge of each column.
    #[inline(always)]
    fn edges(&self, cell: &GridCell, side: f64, is_shared: bool, edges: &mut SphericalColumns) {
        let ([u, _], [width, _]) = (cell.corner(), cell.size());
        let triangles = self.visible.triangles();
        if is_shared {
            let stride = width * (1.0 / HALF as f64);
            triangles[0].columns::<0, HALF>(u + side * stride, stride, edges);
            triangles[1].columns::<HALF, HALF>(u + side * stride, stride, edges);
        } else {
            let stride = width * (1.0 / SIDE as f64);
            triangles[cell.part].columns::<0, SIDE>(u + side * stride, stride, edges);
        }
    }
}

/// Distance between two points of lane `i`.
#[inline(always)]
fn distance(a: &[[f32; SIDE]; 3], b: &[[f32; SIDE]; 3], i: usize) -> f32 {
    let [x, y, z] = [a[0][i] - b[0][i], a[1][i] - b[1][i], a[2][i] - b[2][i]];
    math::sqrt(x * x + y * y + z * z)
}

#[cfg(test)]
mod tests;
