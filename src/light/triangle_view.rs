//! A triangle as seen from a shading point: how points of it are drawn, by cells or by directions, and their densities.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::cell_kernel::CellDescent;
use super::linear_density::LinearDensity;
use super::near_texture::NearTexture;
use super::projected_part::ProjectedPart;
use super::spherical_grid::{GridCell, SphericalGrid};
use super::{
    DrawnPoint, Illumination, LightKind, LightTriangle, LightViewKind, LocalPoint, MovingTriangle, PlacedTriangle,
};
use crate::blas::{CellNode, Draw, Follow, Guide, LEAF, Lattice, LatticeCell, Root};
use crate::env::{DirectionCone, EnvironmentView};
use crate::geometry;
use crate::math;
use crate::receiver::{Effort, Lobe, Receiver, ReceiverKind, ShadingPoint, for_lobe};
use crate::simd::{InstructionSet, Kernel};
use crate::warp::Variate;
use crate::warp::equal_area::sphere_to_square_quickly;

/// Largest coordinate of a shading point that anything arrives at.
///
/// Proved: squares of distances, 1e30, are finite, and so are their products with weights of up to 1e8.
pub(super) const FARTHEST_POINT: f32 = 1e15;

/// A triangle is close if its squared radius is more than this many times the squared distance from its plane.
///
/// Measured on star (docs/ACCURACY.md, "Where it is still weak"): it decides where the trees get a fifth of the samples
/// next to bright features. Larger values miss points close to a card, smaller ones waste samples at a distance.
const CLOSE_RATIO: f32 = 256.0;

/// Ratio of the height over a triangle to its radius from which the lattice resolves directions: 8 units of the
/// lattice. Chosen, not swept.
///
/// Larger: directions are drawn uniformly, with a relative deviation of 0.58, where they could be drawn by weight.
/// Smaller: rounding to the lattice would bias samples.
const RESOLVED_HEIGHT: f64 = 8.0 / 16_777_216.0;

/// Ratio of squared radius to squared distance of the center from which on points without a texture are drawn by the
/// cosine of a diffuse surface. *Measured* (docs/ACCURACY.md, "Near lights").
///
/// Larger: cells of directions leave a variance of up to 0.05. Smaller: more instructions, where they leave 0.001.
const PROJECTED: f32 = 0.5;

/// How far rounding to the lattice moves a point along both edges, in units of the edges. *Proved*: half a unit of the
/// lattice, and one more next to the triangle's own edges.
///
/// Larger: points below the horizon would have a density. Smaller: points that were drawn would have none.
const LATTICE_ROUNDING: f64 = 2.0 / 16_777_216.0;

/// A light triangle seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleView<'a> {
    pub(super) receiver: Receiver,
    /// Vertices relative to the shading point.
    pub(super) vertices: [Vec3; 3],
    /// Vertices relative to the shading point, in double precision.
    pub(super) exact_vertices: [DVec3; 3],
    /// Determinant of the vertices, by exact differences: negative in front, but for mirror images.
    pub(super) determinant: f64,
    /// Unit normal of the front side.
    normal: Vec3,
    pub(super) area: f32,
    /// Distance of the shading point from the triangle's plane.
    pub(super) height: f32,
    /// Distance of the shading point from the triangle's plane, in double precision.
    exact_height: f64,
    /// Squared distance of the farthest vertex from the centroid.
    pub(super) radius2: f32,
    /// Normal of the receiver; zero without one.
    pub(super) receiver_normal: Vec3,
    /// Height over the receiver's plane below which a vertex is below it for certain.
    pub(super) horizon: f32,
    /// Height of the highest vertex above or below the receiver's plane.
    pub(super) highest: f32,
    pub(super) illumination: Illumination,
    /// What the triangle is a portal to, if that depends on the direction.
    pub(super) environment: Option<&'a EnvironmentView<'a>>,
    pub(crate) effort: Effort,
    /// The tree over the texture.
    pub(crate) root: Root,
    /// Nodes of the trees over textures.
    pub(crate) cells: &'a [CellNode],
}

impl<'a> TriangleView<'a> {
    /// Returns the view from a shading point, or `None` where nothing can arrive. `wrap` makes the view into what is
    /// wanted before it is written anywhere: a view is large.
    #[inline]
    pub(super) fn wrapped<V>(
        light: &LightTriangle,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let triangle = light.triangle();
        let relative = (triangle.exactly_relative_to(x.position), triangle.relative_to(x.position));
        Self::of_vertices(light, relative, triangle.double_area_vector(), x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle of an instance.
    pub(super) fn placed<V>(
        triangle: &PlacedTriangle<'_>,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let exact = triangle.exactly_relative_to(x.position);
        let relative = (exact, exact.map(|vertex| vertex.as_vec3()));
        let front = triangle.double_area_vector();
        // The order of the vertices is the object's own, whichever way it runs around the front.
        let turn = if triangle.is_mirrored() { -1.0 } else { 1.0 };
        let wrap = |view: Self| wrap(Self { determinant: turn * view.determinant, ..view });
        Self::of_vertices(triangle.record, relative, front, x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle at its time.
    pub(super) fn moving<V>(
        triangle: &MovingTriangle<'_>,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let exact = triangle.exactly_relative_to(x.position);
        let relative = (exact, exact.map(|vertex| vertex.as_vec3()));
        let front = triangle.double_area_vector();
        Self::of_vertices(triangle.record, relative, front, x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle by its vertices relative to the shading point and the normal of its front times
    /// twice its area.
    #[expect(clippy::too_many_arguments, reason = "a struct would be copied")]
    #[inline(always)]
    fn of_vertices<V>(
        light: &LightTriangle,
        (exact_vertices, vertices): ([DVec3; 3], [Vec3; 3]),
        cross: DVec3,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        // NaN fails.
        let is_near = x.position.to_array().iter().all(|x| x.abs() <= FARTHEST_POINT);
        let side = cross.dot(exact_vertices[0]);
        if !(is_near && light.emits_to(side) && !x.receiver.is_dark(&vertices)) {
            return None;
        }
        let double_area = math::sqrt64(cross.length_squared());
        let (normal, area) = geometry::normal_and_area(cross, double_area)?;
        let height = side.abs() / double_area;
        let [a, b, c] = vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let receiver_normal = x.receiver.normal();
        Some(wrap(Self {
            receiver: x.receiver,
            vertices,
            radius2: vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared())),
            receiver_normal,
            horizon: geometry::horizon(receiver_normal, &vertices),
            highest: vertices.iter().fold(0.0, |h: f32, v| h.max(receiver_normal.dot(*v).abs())),
            exact_vertices,
            determinant: side,
            normal,
            area,
            height: height as f32,
            exact_height: height,
            illumination,
            environment: environment.filter(|_| light.is_portal()),
            effort: x.effort,
            root: light.root,
            cells,
        }))
    }

    /// Returns the vertices relative to the shading point.
    pub(crate) fn vertices(&self) -> &[Vec3; 3] {
        &self.vertices
    }

    /// Whether the shading point is almost in the triangle's plane.
    pub(crate) fn is_close(&self) -> bool {
        self.radius2 > CLOSE_RATIO * self.height * self.height
    }

    /// Returns the point where a ray from the shading point crosses the triangle.
    pub(crate) fn intersect(&self, direction: Vec3) -> Option<Lattice> {
        geometry::intersect(self.exact_vertices, direction).map(Lattice::from_barycentrics)
    }

    /// Returns a point relative to the shading point, in double precision, as it may be much nearer than the vertices.
    #[inline]
    pub(crate) fn position(&self, point: Lattice) -> DVec3 {
        let [b1, b2] = point.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = self.exact_vertices;
        v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
    }

    /// Descends to a cell of about constant density. Returns it with its probability.
    #[inline(always)]
    fn descend(&self, guide: &mut impl Guide) -> Option<(LatticeCell, f64)> {
        for_lobe!(self.receiver, lobe => InstructionSet::best().run(CellDescent { view: self, guide, lobe }))
    }

    /// Returns the density per solid angle of a point of a cell that was chosen with this probability,
    /// `p_A d² / cos θl`. `None` where it is not a positive number.
    #[inline]
    fn pdf_in(&self, cell: LatticeCell, cell_pmf: f64, point: Lattice) -> Option<f64> {
        let pdf_area = cell_pmf / (f64::from(self.area) * f64::from(cell.area()));
        let pdf = pdf_area / self.solid_angle_per_area(self.position(point));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }

    /// Whether points are drawn by a linear density or by direction, where the solid angle allows it: without a
    /// texture.
    #[inline]
    fn is_plain(&self) -> bool {
        self.root.node == LEAF && self.illumination == Illumination::ClampedVertices
    }

    /// Whether what is seen through a portal is about constant over it.
    #[inline]
    pub(super) fn has_constant_radiance(&self, center: Vec3, distance2: f32) -> bool {
        self.followed_environment().is_none_or(|environment| {
            let inverse = 1.0 / math::sqrt(distance2);
            let solid_angle = self.area * self.height * (inverse * inverse * inverse);
            let direction = environment.local_direction(center * inverse);
            environment.is_about_constant(sphere_to_square_quickly(direction.to_array()), solid_angle)
        })
    }

    /// Whether a point is below the horizon, and not only by rounding to the lattice.
    #[inline(always)]
    fn is_below_horizon(&self, point: DVec3) -> bool {
        let normal = self.receiver_normal.as_dvec3();
        let [a, b, c] = self.exact_vertices;
        let step = normal.dot(b - a).abs() + normal.dot(c - a).abs();
        self.receiver.has_horizon() && normal.dot(point) < -LATTICE_ROUNDING * step
    }

    /// What points are drawn by beside the triangle itself, if that depends on the direction.
    #[inline(always)]
    pub(super) fn followed_environment(&self) -> Option<&'a EnvironmentView<'a>> {
        self.environment.filter(|_| self.effort != Effort::Least)
    }

    /// Whether all directions to what is visible of a triangle without a texture are equally likely.
    #[inline(always)]
    fn draws_uniformly(&self) -> bool {
        let is_even = matches!(self.receiver, Receiver::Volume) && self.environment.is_none();
        is_even || self.effort == Effort::Least || !self.resolves_directions()
    }

    /// Whether the lattice resolves directions.
    #[inline(always)]
    pub(super) fn resolves_directions(&self) -> bool {
        self.exact_height >= RESOLVED_HEIGHT * f64::from(math::sqrt(self.radius2))
    }

    /// Returns what is visible as a diffuse surface sees it, if all points send the same and are drawn by the cosine.
    #[inline]
    fn projected(&self) -> Option<ProjectedPart> {
        let is_even = matches!(self.receiver, Receiver::Surface(_)) && self.environment.is_none();
        let [a, b, c] = self.vertices;
        let is_near = self.radius2 > PROJECTED * ((a + b + c) * (1.0 / 3.0)).length_squared();
        if is_even && is_near && !self.draws_uniformly() { ProjectedPart::new(self) } else { None }
    }

    /// Returns how points of a texture are drawn that is near; `None` where they are drawn by cells alone. Behind a
    /// portal the cells know the sky, and directions do not.
    #[inline]
    fn near_texture(&self) -> Option<NearTexture> {
        let is_emitter = self.illumination == Illumination::ClampedVertices && self.environment.is_none();
        if is_emitter { NearTexture::new(self) } else { None }
    }

    /// Draws a point by its direction. `None` where there is too little solid angle, and points are drawn by cells.
    #[inline(always)]
    pub(super) fn sample_direction(&self, u: [Variate; 2]) -> Option<Option<DrawnPoint>> {
        if let Some(part) = self.projected() {
            return Some(part.sample(self, u));
        }
        for_lobe!(self.receiver, lobe => InstructionSet::best().run(SampleDirection { view: self, lobe, u }))
    }

    /// Returns the density per solid angle of a point that [`Self::sample_direction`] draws.
    #[inline]
    pub(super) fn pdf_of_direction(&self, point: Lattice) -> Option<Option<f64>> {
        if let Some(part) = self.projected() {
            return Some(part.pdf(self.position(point)));
        }
        for_lobe!(self.receiver, lobe => InstructionSet::best().run(PdfOfDirection { view: self, lobe, point }))
    }

    /// Draws a point by the cells of the triangle.
    #[inline(always)]
    pub(super) fn sample_cell(&self, u: [Variate; 2]) -> Option<DrawnPoint> {
        let mut draw = Draw::new(u);
        let (cell, cell_pmf) = self.descend(&mut draw)?;
        let point = draw.point(cell);
        let pdf = self.pdf_in(cell, cell_pmf, point)?;
        Some(DrawnPoint { point: LocalPoint::on_triangle(point), relative: self.position(point), pdf })
    }

    /// Returns the density per solid angle of a point that [`Self::sample_cell`] draws.
    #[inline]
    pub(super) fn pdf_of_cell(&self, point: Lattice) -> Option<f64> {
        let (cell, cell_pmf) = self.descend(&mut Follow::new(point))?;
        self.pdf_in(cell, cell_pmf, point)
    }
}

impl LightViewKind for TriangleView<'_> {
    #[inline(always)]
    fn sample(&self, u: [Variate; 2]) -> Option<DrawnPoint> {
        if self.is_plain() {
            if let Some(density) = LinearDensity::new(self) {
                return density.sample(self, u);
            }
            if let Some(drawn) = self.sample_direction(u) {
                return drawn;
            }
        } else if let Some(near) = self.near_texture() {
            return near.sample(self, u);
        }
        self.sample_cell(u)
    }

    #[inline]
    fn pdf(&self, point: LocalPoint) -> Option<f64> {
        let point = point.lattice();
        if self.is_plain() {
            if let Some(density) = LinearDensity::new(self) {
                return density.pdf(self, point);
            }
            if let Some(pdf) = self.pdf_of_direction(point) {
                return pdf;
            }
        } else if let Some(near) = self.near_texture() {
            return near.pdf(self, point);
        }
        self.pdf_of_cell(point)
    }

    #[inline]
    fn point(&self, point: LocalPoint) -> DVec3 {
        self.position(point.lattice())
    }

    #[inline]
    fn direction(&self, _point: LocalPoint, relative: DVec3, distance: f64) -> Vec3 {
        (relative / distance).as_vec3()
    }

    #[inline]
    fn normal(&self, _point: DVec3) -> Vec3 {
        self.normal
    }

    #[inline]
    fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        let distance2 = point.length_squared();
        self.exact_height / (distance2 * math::sqrt64(distance2))
    }

    fn irradiance(&self, weight: f32) -> f32 {
        let radiance = self.environment.map_or(1.0, |environment| {
            let [a, b, c] = self.vertices;
            let center = (a + b + c) * (1.0 / 3.0);
            let least = (self.height * self.height).max(f32::MIN_POSITIVE);
            let inverse = 1.0 / math::sqrt(center.length_squared().max(least));
            let cone = DirectionCone {
                direction: center * inverse,
                sin_radius: math::sqrt(self.radius2) * inverse,
                solid_angle: self.area * self.height * inverse * inverse * inverse,
            };
            environment.estimate_radiance(&cone).value
        });
        PI * weight * self.estimate(LatticeCell::whole()) * radiance
    }
}

/// Draws a point by its direction. `None` where that is no good and cells are drawn by area.
struct SampleDirection<'v, 'a, L> {
    view: &'v TriangleView<'a>,
    /// Lobe of the view's receiver.
    lobe: L,
    u: [Variate; 2],
}

impl<L: Lobe> Kernel for SampleDirection<'_, '_, L> {
    type Output = Option<Option<DrawnPoint>>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { view, lobe, u } = self;
        let grid = SphericalGrid::new(view, lobe)?;
        if view.draws_uniformly() {
            return Some(sample_uniformly(view, &grid, u));
        }
        Some(sample_grid(view, &grid, u))
    }
}

/// Draws a point by the cells of a grid.
#[inline(always)]
fn sample_grid(view: &TriangleView<'_>, grid: &SphericalGrid<'_, impl Lobe>, u: [Variate; 2]) -> Option<DrawnPoint> {
    let (direction, cell, pdf) = grid.draw(u)?;
    let (barycentrics, _) = geometry::cross_plane(view.exact_vertices, direction)?;
    let point = Lattice::inside(barycentrics);
    let relative = view.position(point);
    let pdf = density(view, grid, relative, Some((cell, pdf)))?;
    Some(DrawnPoint { point: LocalPoint::on_triangle(point), relative, pdf })
}

/// Draws a point by a uniform direction. Where neighbors of the lattice are seen in very different directions, the
/// direction is kept as it was drawn: the density does not depend on how it was rounded.
#[inline(never)]
fn sample_uniformly(
    view: &TriangleView<'_>,
    grid: &SphericalGrid<'_, impl Lobe>,
    u: [Variate; 2],
) -> Option<DrawnPoint> {
    let direction = grid.draw_uniformly(u);
    let (barycentrics, distance) = geometry::cross_plane(view.exact_vertices, direction)?;
    let point = Lattice::inside(barycentrics);
    let relative = if view.resolves_directions() { view.position(point) } else { direction * distance };
    Some(DrawnPoint { point: LocalPoint::on_triangle(point), relative, pdf: grid.uniform_pdf() })
}

/// Finds the density of a point that is drawn by its direction. `None` where cells are drawn by area.
struct PdfOfDirection<'v, 'a, L> {
    view: &'v TriangleView<'a>,
    /// Lobe of the view's receiver.
    lobe: L,
    point: Lattice,
}

impl<L: Lobe> Kernel for PdfOfDirection<'_, '_, L> {
    type Output = Option<Option<f64>>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { view, lobe, point } = self;
        let grid = SphericalGrid::new(view, lobe)?;
        let relative = view.position(point);
        if view.draws_uniformly() {
            return Some((!view.is_below_horizon(relative)).then(|| grid.uniform_pdf()));
        }
        Some(density(view, &grid, relative, None))
    }
}

/// Returns the density per solid angle of a point of the lattice. `drawn` may be a cell with its density.
#[inline(always)]
fn density(
    view: &TriangleView<'_>,
    grid: &SphericalGrid<'_, impl Lobe>,
    point: DVec3,
    drawn: Option<(GridCell, f64)>,
) -> Option<f64> {
    let distance2 = point.length_squared();
    if view.is_below_horizon(point) || distance2 == 0.0 {
        return None;
    }
    let pdf = grid.pdf(point * (1.0 / math::sqrt64(distance2)), drawn)?;
    (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
}
