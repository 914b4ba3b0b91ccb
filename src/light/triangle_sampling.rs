//! How points of a triangle are drawn, by cells or by directions, and their densities.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::cell_kernel::CellDescent;
use super::linear_density::LinearDensity;
use super::near_texture::NearTexture;
use super::projected_part::ProjectedPart;
use super::spherical_grid::{GridCell, SphericalGrid};
use super::triangle_view::TriangleView;
use super::{DrawnPoint, Illumination, LightViewKind, LocalPoint};
use crate::blas::{Draw, Follow, Guide, LEAF, Lattice, LatticeCell};
use crate::env::DirectionCone;
use crate::geometry;
use crate::math;
use crate::receiver::{Lobe, Receiver, for_lobe};
use crate::simd::{InstructionSet, Kernel};
use crate::warp::Variate;

/// Ratio of squared radius to squared distance of the center from which on points without a texture are drawn by the
/// cosine of a diffuse surface. *Measured* (docs/ACCURACY.md, "Near lights").
///
/// Larger: cells of directions leave a variance of up to 0.05. Smaller: more instructions, where they leave 0.001.
const PROJECTED: f32 = 0.5;

impl TriangleView<'_> {
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
    let drawn =
        |point, relative| DrawnPoint { point: LocalPoint::on_triangle(point), relative, pdf: grid.uniform_pdf() };
    if view.resolves_directions() {
        return Some(drawn(point, view.position(point)));
    }
    let relative = direction * distance;
    // Of a direction that grazes the triangle, barycentrics are rounded farther than to the lattice.
    let is_below = |point| view.is_below_horizon(view.position(point));
    if !is_below(point) {
        return Some(drawn(point, relative));
    }
    let point = Lattice::inside(geometry::barycentrics_of(view.exact_vertices, relative));
    (!is_below(point)).then(|| drawn(point, relative))
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
