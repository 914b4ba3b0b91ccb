//! A few triangles, which are sampled without a tree: densities against quadrature, samples against densities, and how
//! close both are to what arrives.

use core::f64::consts::PI;

use fanlight::{Hit, LightSampler, LightSamplerView, Mesh, MeshId, ShadingPoint, Sides, TriangleId, Weight};
use glam::{DVec3, Vec3, vec3};

use crate::common::lights::aligned;
use crate::common::pcg::Pcg32;
use crate::common::statistics::{chi_square, sidak};

/// Significance of all chi-square tests together.
const SIGNIFICANCE: f64 = 1e-6;

/// Steps along each edge by which a triangle is divided.
const STEPS: u32 = 24;

/// A mesh of one triangle.
struct Lamp {
    corners: [Vec3; 3],
    radiance: f32,
    two_sided: bool,
}

impl Lamp {
    /// A triangle somewhere above the unit square, that shines downwards or to both sides.
    fn random(pcg: &mut Pcg32) -> Self {
        let center = vec3(pcg.f32(), pcg.f32(), 1.5 + pcg.f32());
        let [a, b, c] = core::array::from_fn(|_| center + 0.3 * pcg.direction());
        let faces_down = (b - a).cross(c - a).z < 0.0;
        let corners = if faces_down { [a, b, c] } else { [a, c, b] };
        Self { corners, radiance: 0.1 + 5.0 * pcg.f32(), two_sided: pcg.below(3) == 0 }
    }

    /// The two triangles below the ceiling of the Cornell box.
    fn cornell() -> [Self; 2] {
        let corner = |x, y| vec3(x, y, 0.9999);
        let [a, b, c, d] = [corner(0.35, 0.35), corner(0.65, 0.35), corner(0.65, 0.65), corner(0.35, 0.65)];
        [[a, c, b], [a, d, c]].map(|corners| Self { corners, radiance: 15.0, two_sided: false })
    }

    /// Cells of equal area: three corners each, as barycentrics.
    fn cells(steps: u32) -> impl Iterator<Item = [[f64; 2]; 3]> {
        let at = move |i: u32, j: u32| [f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps)];
        (0..steps).flat_map(move |i| {
            (0..steps - i).flat_map(move |j| {
                let upright = [at(i, j), at(i + 1, j), at(i, j + 1)];
                let inverted = (i + j + 1 < steps).then(|| [at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)]);
                core::iter::once(upright).chain(inverted)
            })
        })
    }

    /// Solid angle and central direction of a cell, without regard to the side that shines; and its center.
    fn cell(&self, x: Vec3, cell: [[f64; 2]; 3]) -> (f64, DVec3, [f64; 2]) {
        let [a, b, c] = self.corners.map(Vec3::as_dvec3);
        let at = |[b1, b2]: [f64; 2]| a + (b - a) * b1 + (c - a) * b2 - x.as_dvec3();
        let [p, q, r] = cell.map(|corner| at(corner).normalize());
        // Van Oosterom and Strackee 1983.
        let solid_angle = 2.0 * p.dot(q.cross(r)).abs().atan2(1.0 + p.dot(q) + q.dot(r) + r.dot(p));
        let center = [0, 1].map(|k| (cell[0][k] + cell[1][k] + cell[2][k]) / 3.0);
        (solid_angle, at(center).normalize(), center)
    }

    fn shines_on(&self, x: Vec3) -> bool {
        let [a, b, c] = self.corners.map(Vec3::as_dvec3);
        self.two_sided || (b - a).cross(c - a).dot(a - x.as_dvec3()) < 0.0
    }
}

fn build(lamps: &[Lamp]) -> LightSampler {
    let mut builder = LightSampler::builder();
    for Lamp { corners, radiance, two_sided } in lamps {
        let mesh = Mesh::emitter(corners, &[[0, 1, 2]]).weight(Weight::Constant(*radiance));
        let sides = if *two_sided { Sides::Two } else { Sides::One };
        builder.add_mesh(&mesh.sides(sides)).expect("the lamp is sound");
    }
    builder.build().expect("the scene is small")
}

fn id(lamp: usize) -> TriangleId {
    TriangleId::new(MeshId::from_index(lamp as u32), 0)
}

/// Points on the floor, on walls and, one in four, near a lamp, where the tree is asked.
fn point(pcg: &mut Pcg32, lamps: &[Lamp], kind: usize) -> ShadingPoint {
    let [u, v, w] = pcg.cube();
    match kind % 4 {
        0 => ShadingPoint::surface(vec3(u, v, 0.0), Vec3::Z),
        1 => ShadingPoint::surface(vec3(0.0, u, v), Vec3::X),
        2 => ShadingPoint::surface(vec3(u, 1.0, v), Vec3::NEG_Y),
        _ => {
            let near = lamps[pcg.below(lamps.len())].corners[0];
            ShadingPoint::surface(near + 0.3 * vec3(u - 0.5, v - 0.5, -w), pcg.direction())
        }
    }
}

#[test]
fn samples_of_a_few_have_their_densities() {
    let mut pcg = Pcg32::new(1, 130);
    for count in [1, 2, 2, 3, 8] {
        let lamps: Vec<Lamp> = (0..count).map(|_| Lamp::random(&mut pcg)).collect();
        let lights = build(&lamps);
        let bytes = aligned(&lights.to_bytes());
        let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&bytes)).expect("these bytes are sound");
        let queries: Vec<_> = (0..400).map(|i| (point(&mut pcg, &lamps, i), pcg.cube())).collect();
        let mut many = vec![None; queries.len()];
        lights.sample_many(&queries, &mut many);
        let mut drawn = 0;
        for ((x, u), of_many) in queries.iter().zip(many) {
            let at = lights.at(x);
            let sample = at.sample(*u);
            assert_eq!(sample, of_many);
            assert_eq!(sample, view.at(x).sample(*u));
            let sum: f32 = (0..count).map(|lamp| at.pmf(id(lamp))).sum();
            let Some(sample) = sample else { continue };
            drawn += 1;
            let hit = sample.hit().expect("a triangle");
            assert_eq!(at.pdf(&hit), sample.pdf, "{x:?}");
            assert_eq!(at.pmf(hit.triangle), sample.pmf, "{x:?}");
            assert!((sum - 1.0).abs() < 1e-5, "{sum} at {x:?}");
            let along = at.pdf_sample_direction(&sample);
            assert!(along >= sample.pdf && (at.pdf_direction(sample.direction) / along - 1.0).abs() < 1e-3);
            // What belongs together.
            assert!((sample.direction * sample.distance + x.position).distance(sample.position) < 1e-5);
            let per_area = sample.normal.dot(sample.direction).abs() / sample.distance.powi(2);
            assert!((sample.pdf * per_area / sample.pdf_area - 1.0).abs() < 1e-3, "{sample:?}");
            assert!(lamps[hit.triangle.mesh.index() as usize].shines_on(x.position));
        }
        assert!(drawn > 200, "{drawn} of 400");
    }
}

#[test]
fn samples_of_a_few_follow_their_densities() {
    const TESTS: usize = 12;
    let mut pcg = Pcg32::new(2, 130);
    let mut made = 0;
    for i in 0.. {
        if made == TESTS {
            break;
        }
        let lamps: Vec<Lamp> = (0..[1, 2, 3, 8][i % 4]).map(|_| Lamp::random(&mut pcg)).collect();
        let (lights, x) = (build(&lamps), point(&mut pcg, &lamps, i / 4 % 3));
        let at = lights.at(&x);
        if at.sample([0.5; 3]).is_none() {
            continue;
        }
        made += 1;
        // Sixteen bins a triangle, which are cells of a coarser division.
        const SIDE: f64 = 4.0;
        let bin = |[b1, b2]: [f64; 2]| {
            let [i, j] = [b1, b2].map(|b| (b * SIDE).min(SIDE - 1.0) as usize);
            2 * (4 * i + j) + usize::from(b1 * SIDE - i as f64 + b2 * SIDE - j as f64 > 1.0)
        };
        let mut expected = vec![0.0; 32 * lamps.len()];
        for (number, lamp) in lamps.iter().enumerate() {
            for cell in Lamp::cells(STEPS) {
                let (solid_angle, _, center) = lamp.cell(x.position, cell);
                let pdf = at.pdf(&Hit::new(id(number), center.map(|b| b as f32)));
                expected[32 * number + bin(center)] += solid_angle * f64::from(pdf);
            }
        }
        let sum: f64 = expected.iter().sum();
        assert!((sum - 1.0).abs() < 2e-3, "the densities add up to {sum} at {x:?}");
        let count = 20_000;
        expected.iter_mut().for_each(|share| *share *= f64::from(count) / sum);
        let mut observed = vec![0.0; expected.len()];
        for _ in 0..count {
            let hit = at.sample(pcg.cube()).and_then(|sample| sample.hit()).expect("all samples find light");
            observed[32 * hit.triangle.mesh.index() as usize + bin(hit.barycentrics.map(f64::from))] += 1.0;
        }
        let (p, worst) = chi_square(&observed, &expected);
        assert!(p > sidak(SIGNIFICANCE, TESTS), "{p} at {x:?}\n{worst}");
    }
}

/// Mean of the estimate at a point of the Cornell box, its relative variance, and the irradiance by quadrature.
fn estimates(lights: &LightSampler, lamps: &[Lamp], x: &ShadingPoint, normal: Vec3, pcg: &mut Pcg32) -> [f64; 3] {
    let count = 2000;
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..count {
        let Some(sample) = lights.at(x).sample(pcg.cube()) else { continue };
        let value = 15.0 * f64::from(normal.dot(sample.direction).max(0.0) / sample.pdf);
        (sum, squares) = (sum + value, squares + value * value);
    }
    let (mean, square) = (sum / f64::from(count), squares / f64::from(count));
    let mut irradiance = 0.0;
    for lamp in lamps {
        for cell in Lamp::cells(STEPS) {
            let (solid_angle, direction, _) = lamp.cell(x.position, cell);
            irradiance += 15.0 * solid_angle * normal.as_dvec3().dot(direction).max(0.0);
        }
    }
    [mean, square / (mean * mean) - 1.0, irradiance]
}

/// `cargo test --release few -- --nocapture` prints the figure of docs/ACCURACY.md.
#[test]
fn a_few_have_little_noise_in_the_cornell_box() {
    let (lamps, mut pcg) = (Lamp::cornell(), Pcg32::new(3, 130));
    let lights = build(&lamps);
    let (mut variances, mut worst) = (Vec::new(), 0.0_f64);
    for i in 0..60 {
        let [u, v, _] = pcg.cube();
        let (position, normal) = match i % 3 {
            0 => (vec3(u, v, 0.0), Vec3::Z),
            1 => (vec3(0.0, u, v), Vec3::X),
            _ => (vec3(u, 1.0, v), Vec3::NEG_Y),
        };
        let x = ShadingPoint::surface(position, normal);
        let [mean, variance, irradiance] = estimates(&lights, &lamps, &x, normal, &mut pcg);
        let error = (mean / irradiance - 1.0).abs();
        // Six standard deviations and what the quadrature is off.
        assert!(error < 6.0 * (variance.max(0.0) / 2000.0).sqrt() + 1e-3, "{mean} instead of {irradiance} at {x:?}");
        variances.push(variance);
        worst = worst.max(variance);
    }
    variances.sort_by(f64::total_cmp);
    std::println!("relative variance: median {:.4}, largest {worst:.4}", variances[30]);
    assert!(variances[30] < 0.005 && worst < 0.1, "{} and {worst}", variances[30]);
}

#[test]
fn nothing_arrives_at_odd_points_and_odd_numbers_do_no_harm() {
    let lights = build(&Lamp::cornell());
    let floor = ShadingPoint::surface(vec3(0.5, 0.5, 0.0), Vec3::Z);
    for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1.0, 2.0] {
        for u in [[odd, 0.5, 0.5], [0.5, odd, 0.5], [0.5, 0.5, odd], [odd; 3]] {
            let sample = lights.at(&floor).sample(u).expect("it is lit");
            assert!(sample.pdf > 0.0 && sample.position.is_finite() && sample.direction.is_normalized(), "{sample:?}");
        }
        let away = ShadingPoint::surface(vec3(0.5, if odd.abs() <= 2.0 { 3e15 } else { odd }, 0.0), Vec3::Z);
        assert_eq!(lights.at(&away).sample([0.5; 3]), None);
    }
    // Behind the light, above the ceiling, below the horizon, and without a common group.
    let dark = [
        ShadingPoint::surface(vec3(0.5, 0.5, 1.0), Vec3::NEG_Z),
        ShadingPoint::surface(vec3(0.5, 0.5, 0.0), Vec3::NEG_Z),
        floor.with_groups(0),
    ];
    for x in dark {
        assert_eq!(lights.at(&x).sample([0.5; 3]), None, "{x:?}");
        assert_eq!(lights.at(&x).pdf(&Hit::new(id(0), [0.3; 2])), 0.0, "{x:?}");
    }
    // In contact with a corner, and in the plane of the light.
    for x in [vec3(0.35, 0.35, 0.9999), vec3(0.5, 0.5, 0.9999), vec3(0.9, 0.5, 0.9999)] {
        let here = lights.at(&ShadingPoint::surface(x, Vec3::Z));
        assert!(here.sample([0.5; 3]).is_none_or(|sample| sample.pdf.is_finite()));
    }
    assert!((lights.at(&floor).irradiance() / (15.0 * 0.09 * PI as f32 / PI as f32) - 1.0).abs() < 0.3);
}
