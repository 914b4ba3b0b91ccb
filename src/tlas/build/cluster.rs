//! Lights and clusters of lights as the build of a tree sees them.
//!
//! Here a cluster's normals lie in a box, as its positions do: to add a light takes a few vector instructions and
//! no trigonometry, where the union of two cones takes two arcs and a turn. The cones of the finished tree are made of
//! the lights themselves.

use glam::{Mat4, Vec3A, Vec4};

use crate::bounds::{LightBounds, orientation_measures};

/// Least squared length of the middle of a box of unit normals. Below it, the normals count as pointing everywhere: the
/// middle is no direction any more, and dividing by its length would only enlarge rounding. Affects costs alone.
/// *Measured*: docs/CONSTANTS.md, "Constants of the build"; not sensitive.
const LEAST_MIDDLE2: f32 = 1e-4;

/// A light on its way into the tree. Fourth components hold what has no vector of its own: a build reads and moves all
/// lights at every level, so it pays to keep them small.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// Lower corner of the box, and the energy.
    low_and_energy: Vec4,
    /// Upper corner of the box, and bits: the number of the light, and [`Self::TWO_SIDED`].
    high_and_light: Vec4,
    /// The normal, and the energy over the share of the hemisphere that it is sent into.
    normal_and_brightness: Vec4,
}

const _: () = assert!(size_of::<Item>() == 48);

impl Item {
    /// Marks a light that sends from its back as well. Numbers of lights stay below it.
    const TWO_SIDED: u32 = 1 << 31;

    pub(super) fn new(bounds: &LightBounds, light: u32) -> Self {
        let bits = light | if bounds.two_sided { Self::TWO_SIDED } else { 0 };
        Self {
            low_and_energy: bounds.aabb.min.extend(bounds.energy()),
            high_and_light: bounds.aabb.max.extend(f32::from_bits(bits)),
            normal_and_brightness: bounds.normals.axis.extend(bounds.brightness()),
        }
    }

    #[inline(always)]
    pub(super) fn low(&self) -> Vec3A {
        Vec3A::from_vec4(self.low_and_energy)
    }

    #[inline(always)]
    pub(super) fn high(&self) -> Vec3A {
        Vec3A::from_vec4(self.high_and_light)
    }

    /// Returns twice the center of the box; coordinates are small enough to be added.
    #[inline(always)]
    pub(super) fn double_center(&self) -> Vec3A {
        self.low() + self.high()
    }

    /// Returns the normal, which that of a two-sided light is turned to the side of `reference`: its sign says nothing.
    #[inline(always)]
    pub(super) fn turned_normal(&self, reference: Vec3A) -> Vec3A {
        let normal = self.normal();
        if self.is_two_sided() && normal.dot(reference) < 0.0 { -normal } else { normal }
    }

    #[inline(always)]
    pub(super) fn normal(&self) -> Vec3A {
        Vec3A::from_vec4(self.normal_and_brightness)
    }

    /// Returns the energy over the share of the hemisphere that it is sent into.
    pub(super) fn brightness(&self) -> f32 {
        self.normal_and_brightness.w
    }

    #[inline(always)]
    pub(super) fn energy(&self) -> f32 {
        self.low_and_energy.w
    }

    #[inline(always)]
    pub(super) fn light(&self) -> u32 {
        self.high_and_light.w.to_bits() & !Self::TWO_SIDED
    }

    #[inline(always)]
    fn is_two_sided(&self) -> bool {
        self.high_and_light.w.to_bits() & Self::TWO_SIDED != 0
    }
}

/// Several lights, as the heuristic sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    pub(super) normal_low: Vec3A,
    pub(super) normal_high: Vec3A,
    pub(super) energy: f32,
    pub(super) two_sided: bool,
}

impl Cluster {
    pub(super) const EMPTY: Self = Self {
        low: Vec3A::INFINITY,
        high: Vec3A::NEG_INFINITY,
        normal_low: Vec3A::INFINITY,
        normal_high: Vec3A::NEG_INFINITY,
        energy: 0.0,
        two_sided: false,
    };

    /// Adds a light whose normal has been turned to the wanted side.
    #[inline(always)]
    pub(super) fn add(&mut self, item: &Item, normal: Vec3A) {
        self.add_without_normal(item);
        self.normal_low = self.normal_low.min(normal);
        self.normal_high = self.normal_high.max(normal);
        self.two_sided |= item.is_two_sided();
    }

    /// Adds a light, but not where it faces.
    #[inline(always)]
    pub(super) fn add_without_normal(&mut self, item: &Item) {
        self.low = self.low.min(item.low());
        self.high = self.high.max(item.high());
        self.energy += item.energy();
    }

    #[inline(always)]
    pub(super) fn union(self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            normal_low: self.normal_low.min(other.normal_low),
            normal_high: self.normal_high.max(other.normal_high),
            energy: self.energy + other.energy,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// Whether all normals agree, and are those of lights with one side.
    pub(super) fn has_one_normal(&self) -> bool {
        self.normal_low == self.normal_high && !self.two_sided
    }

    /// Returns `M_A · M_Ω · energy` of the heuristic.
    pub(super) fn cost(&self) -> f32 {
        Self::costs(&[*self; 4], &Units { pad: 0.0, per_length: 1.0, per_energy: 1.0 }, None).x
    }

    /// Returns `M_Ω` of the heuristic.
    pub(super) fn orientation_measure(&self) -> f32 {
        Self::orientation_measures(&[*self; 4]).x
    }

    /// Returns `M_A · M_Ω · energy` of four clusters, all of which have the given `M_Ω` if there is one.
    #[inline(always)]
    pub(super) fn costs(clusters: &[Self; 4], units: &Units, one_measure: Option<f32>) -> Vec4 {
        let edges = components(clusters.each_ref().map(|cluster| cluster.high - cluster.low));
        let [x, y, z] = edges.map(|edge| edge * units.per_length + units.pad);
        let areas = 2.0 * (x * y + y * z + z * x);
        let measures = one_measure.map_or_else(|| Self::orientation_measures(clusters), Vec4::splat);
        let energies = Vec4::from_array(clusters.each_ref().map(|cluster| cluster.energy));
        areas * measures * (energies * units.per_energy)
    }

    /// Returns `M_Ω` of four clusters.
    #[inline(always)]
    fn orientation_measures(clusters: &[Self; 4]) -> Vec4 {
        let clusters = clusters.each_ref();
        let low = components(clusters.map(|cluster| cluster.normal_low));
        let high = components(clusters.map(|cluster| cluster.normal_high));
        let sides = clusters.map(|cluster| if cluster.two_sided { 2.0 } else { 1.0 });
        orientation_measures(least_cos(low, high), Vec4::from_array(sides))
    }
}

/// Returns the three components of four vectors each.
#[inline(always)]
fn components(vectors: [Vec3A; 4]) -> [Vec4; 3] {
    let [a, b, c, d] = vectors.map(|vector| vector.extend(0.0));
    let rows = Mat4::from_cols(a, b, c, d).transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis]
}

/// Returns the least cosine of the angle between a normal and the middle of all, in four boxes of normals.
#[inline(always)]
fn least_cos(low: [Vec4; 3], high: [Vec4; 3]) -> Vec4 {
    let middle = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
    let half = [0, 1, 2].map(|axis| 0.5 * (high[axis] - low[axis]));
    let dot = |a: [Vec4; 3], b: [Vec4; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let length2 = dot(middle, middle);
    let inverse = 1.0 / length2.sqrt();
    // By the corner of the box that is farthest back, and by the ball around the box; the larger one is true, too.
    let by_corner = (length2 - dot(middle.map(Vec4::abs), half)) * inverse;
    let by_ball = 0.5 * (1.0 + length2 - dot(half, half)) * inverse;
    let cos = by_corner.max(by_ball).max(Vec4::NEG_ONE).min(Vec4::ONE);
    Vec4::select(length2.cmplt(Vec4::splat(LEAST_MIDDLE2)), Vec4::NEG_ONE, cos)
}

/// Units of costs, which keep the costs of tiny or dark lights apart.
pub(super) struct Units {
    /// Length by which edges are extended, so that flat boxes still compare.
    pub(super) pad: f32,
    pub(super) per_length: f32,
    pub(super) per_energy: f32,
}
