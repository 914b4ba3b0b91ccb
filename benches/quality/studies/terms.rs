//! The terms that can guide the descent inside a triangle, on one triangle: `-- --terms` prints a table.
//!
//! No Monte Carlo: the density is evaluated in the middle of 4,096 cells, and set against the true contribution.

use core::hint::black_box;
use std::time::Instant;

use fanlight::{
    Filter, Hit, Illumination, LightSampler, Mesh, MeshId, ShadingPoint, Sides, Texture, TriangleId, Weight, Wrap,
};
use glam::{DVec3, Vec2, Vec3};

use crate::args::Effort;
use crate::parallel::parallel;
use crate::scenes::pcg::Pcg32;
use crate::timing::median;

/// Cells along an edge of the triangle.
const CELLS: u32 = 64;
/// Texels along an edge of the image: 1,024 cells of half a texel cover the triangle.
const TEXELS: usize = 32;

const TERMS: [(&str, Option<Illumination>); 5] = [
    ("area only", None),
    ("conservative", Some(Illumination::Conservative)),
    ("point to point", Some(Illumination::PointToPoint)),
    ("boundary", Some(Illumination::Boundary)),
    ("clamped vertices (default)", Some(Illumination::ClampedVertices)),
];

/// Distances of the shading points from the triangle, in lengths of its short edges.
const RANGES: [(&str, [f64; 2]); 3] = [("far", [2.0, 6.0]), ("mid", [0.5, 2.0]), ("near", [0.05, 0.5])];

/// Prints the table.
pub(crate) fn run(effort: &Effort) {
    println!("| term | {} | ns |", rows().map(|(image, range)| format!("{}, {}", image.name(), range.0)).join(" | "));
    println!("| --- {}|", "| ---: ".repeat(7));
    for (name, term) in TERMS {
        let cells = rows().map(|(image, (_, range))| measure(image, range, term, effort));
        let nanoseconds = term.map_or("-".to_owned(), |term| format!("{:.0}", nanoseconds(term, effort)));
        println!("| {name} | {} | {nanoseconds} |", cells.join(" | "));
    }
}

fn rows() -> [(Emission, (&'static str, [f64; 2])); 6] {
    core::array::from_fn(|i| ([Emission::Constant, Emission::Disc][i / 3], RANGES[i % 3]))
}

/// What the triangle emits.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Emission {
    Constant,
    /// A thousand times as much on one hundredth of the area.
    Disc,
}

impl Emission {
    fn name(self) -> &'static str {
        if self == Self::Constant { "constant" } else { "disc" }
    }

    fn texels(self) -> Vec<f32> {
        let value = |i: usize| {
            let [x, y] = [i % TEXELS, i / TEXELS].map(|k| k as f64 - 10.0);
            // A thousandth of contrast keeps the tree from ending early.
            let ground = if i.is_multiple_of(2) { 1.0 } else { 0.999 };
            if self == Self::Disc && x * x + y * y <= 1.0 { 1000.0 } else { ground }
        };
        (0..TEXELS * TEXELS).map(value).collect()
    }
}

const VERTICES: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn sampler(texels: &[f32], term: Illumination) -> LightSampler {
    let mut builder = LightSampler::builder().illumination(term);
    let texture = Texture::new(TEXELS, TEXELS, texels).expect("the image is finite");
    let texture = builder.add_texture(texture.filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp));
    let uvs = VERTICES.map(|v| Vec2::new(v.x, v.y));
    let mesh = Mesh::emitter(&VERTICES, &[[0, 1, 2]]).uvs(&uvs).weight(Weight::Texture(texture)).sides(Sides::Two);
    builder.add_mesh(&mesh).expect("the triangle is valid");
    builder.build().expect("the triangle is valid")
}

/// Points at distances within the range from points of the triangle, with random normals.
fn points(range: [f64; 2], count: usize) -> Vec<ShadingPoint> {
    let mut pcg = Pcg32::new(21, 2);
    let mut point = || {
        let [x, y] = [pcg.f(), pcg.f()];
        let on = if x + y > 1.0 { DVec3::new(1.0 - x, 1.0 - y, 0.0) } else { DVec3::new(x, y, 0.0) };
        let distance = range[0] + (range[1] - range[0]) * pcg.f();
        ShadingPoint::surface((on + pcg.direction() * distance).as_vec3(), pcg.direction().as_vec3())
    };
    (0..count).map(|_| point()).collect()
}

/// Mean relative variance over all points that light arrives at, and the median in brackets.
fn measure(emission: Emission, range: [f64; 2], term: Option<Illumination>, effort: &Effort) -> String {
    let texels = emission.texels();
    let sampler = term.map(|term| sampler(&texels, term));
    let points = points(range, 4 * effort.study_points);
    let found = parallel(&points, |_, x| relative_variance(x, &texels, sampler.as_ref()));
    let mut found: Vec<f64> = found.into_iter().flatten().collect();
    found.sort_by(f64::total_cmp);
    format!("{:.3} ({:.3})", found.iter().sum::<f64>() / found.len() as f64, found[found.len() / 2])
}

/// The sum of `p² / q` over the square of the sum of `p`, less one. `None` if nothing arrives.
fn relative_variance(x: &ShadingPoint, texels: &[f32], sampler: Option<&LightSampler>) -> Option<f64> {
    let fanlight::Receiver::Surface(normal) = x.receiver else { return None };
    let total: f64 = places().map(|b| f64::from(texels[texel(b)])).sum();
    let (mut sum, mut squares) = (0.0, 0.0);
    for barycentrics in places() {
        let to = DVec3::new(barycentrics[0], barycentrics[1], 0.0) - x.position.as_dvec3();
        let distance2 = to.length_squared();
        let cosines = normal.as_dvec3().dot(to).max(0.0) * to.z.abs() / distance2;
        let weight = f64::from(texels[texel(barycentrics)]);
        let p = weight * cosines / distance2;
        if p == 0.0 {
            continue;
        }
        let q = match sampler {
            None => weight / total,
            Some(sampler) => {
                let hit = Hit::new(TriangleId::new(MeshId::from_index(0), 0), barycentrics.map(|b| b as f32));
                // Per solid angle; what a cell has of the triangle's area is half of its share of all cells.
                let per_area = f64::from(sampler.at(x).pdf(&hit)) * to.z.abs() / (distance2 * distance2.sqrt());
                per_area * 0.5 / f64::from(CELLS * CELLS)
            }
        };
        sum += p;
        squares += p * p / q;
    }
    (sum > 0.0).then(|| squares / (sum * sum) - 1.0)
}

fn texel([u, v]: [f64; 2]) -> usize {
    (v * TEXELS as f64) as usize * TEXELS + (u * TEXELS as f64) as usize
}

/// Centers of all cells.
fn places() -> impl Iterator<Item = [f64; 2]> {
    let center = |i: u32, third: u32| f64::from(3 * i + third) / f64::from(3 * CELLS);
    (0..CELLS).flat_map(move |i| {
        let upright = (0..CELLS - i).map(move |j| [center(i, 1), center(j, 1)]);
        upright.chain((1..CELLS - i).map(move |j| [center(i, 2), center(j - 1, 2)]))
    })
}

/// The time of a sample, at points of all ranges and with both emissions.
fn nanoseconds(term: Illumination, effort: &Effort) -> f64 {
    let images = [Emission::Constant, Emission::Disc].map(Emission::texels);
    let samplers = images.each_ref().map(|texels| sampler(texels, term));
    let points: Vec<_> = RANGES.iter().flat_map(|(_, range)| points(*range, 4 * effort.study_points)).collect();
    let time = || {
        let mut pcg = Pcg32::new(3, 3);
        let start = Instant::now();
        for i in 0..effort.calls {
            black_box(samplers[i % 2].at(&points[i % points.len()]).sample(pcg.uniform3()));
        }
        start.elapsed().as_secs_f64() * 1e9 / effort.calls as f64
    };
    median((0..effort.repeats).map(|_| time()).collect())
}
