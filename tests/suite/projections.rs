//! Lights that project an image: lookup, choices against exact irradiances, photons, bytes, errors.

use crate::common::bytes::check_changes;
use crate::common::lights::ARITIES;
use crate::common::pcg::Pcg32;
use crate::common::statistics::{Mean, chi_square, sidak};
use fanlight::{
    Filter, LightId, LightSampler, ProfileId, ProfileLight, Projection, Receiver, SampledLight, ShadingPoint,
};
use glam::{DVec3, Vec3};

/// Significance of all cases of a test together.
const SIGNIFICANCE: f64 = 0.01;

/// A projection with its texels.
#[derive(Clone, Debug)]
struct Slide {
    angles: [f32; 2],
    size: [usize; 2],
    texels: Vec<f32>,
    filter: Filter,
}

impl Slide {
    fn projection(&self) -> Projection<'_> {
        Projection { angles: self.angles, size: self.size, intensities: &self.texels, filter: self.filter }
    }

    /// Intensity in a direction in the frame of the light, written once more: by weights of all texels.
    fn intensity(&self, [x, y, z]: [f64; 3]) -> f64 {
        let tangents = self.angles.map(|angle| (0.5 * f64::from(angle)).tan());
        let (s, t) = (x / (z * tangents[0]), y / (z * tangents[1]));
        if !(z > 0.0 && s.abs() <= 1.0 && t.abs() <= 1.0) {
            return 0.0;
        }
        let at = [s, t].map(|s| 0.5 + 0.5 * s);
        let weight = |axis: usize, index: usize| {
            let (count, center) = (self.size[axis], index as f64 + 0.5);
            let place = at[axis] * count as f64;
            match self.filter {
                Filter::Nearest => f64::from(u8::from((place - center).abs() <= 0.5)),
                Filter::Bilinear => (1.0 - (place.clamp(0.5, count as f64 - 0.5) - center).abs()).max(0.0),
            }
        };
        let [width, height] = self.size;
        let term = |j: usize, i: usize| weight(0, i) * weight(1, j) * f64::from(self.texels[j * width + i]);
        (0..height).flat_map(|j| (0..width).map(move |i| (j, i))).map(|(j, i)| term(j, i)).sum()
    }
}

fn slides(pcg: &mut Pcg32) -> Vec<Slide> {
    let mut slides = vec![];
    for (angles, size) in [([0.7, 0.5], [8, 6]), ([2.6, 0.2], [3, 9]), ([0.02, 0.03], [5, 5]), ([3.05, 3.05], [4, 4])] {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let texels = (0..size[0] * size[1]).map(|_| pcg.f32() * pcg.f32()).collect();
            slides.push(Slide { angles, size, texels, filter });
        }
    }
    // One lit texel, and one texel in all.
    for (size, lit, filter) in [
        ([7, 5], 17, Filter::Nearest),
        ([7, 5], 17, Filter::Bilinear),
        ([6, 6], 0, Filter::Bilinear),
        ([1, 1], 0, Filter::Bilinear),
    ] {
        let texels = (0..size[0] * size[1]).map(|i| if i == lit { 5.0 } else { 0.0 }).collect();
        slides.push(Slide { angles: [1.0, 0.8], size, texels, filter });
    }
    slides
}

/// A light and what it projects.
struct Placed<'a> {
    slide: &'a Slide,
    lamp: ProfileLight,
    position: Vec3,
    frame: [DVec3; 3],
    scale: f64,
}

fn place<'a>(slide: &'a Slide, id: ProfileId, pcg: &mut Pcg32) -> Placed<'a> {
    let (axis, right, scale) = (pcg.direction(), pcg.direction(), 0.5 + pcg.f32());
    let position = 2.0 * Vec3::from_array(pcg.cube());
    let z = axis.as_dvec3().normalize();
    let x = right.as_dvec3().reject_from(z).normalize();
    let lamp = ProfileLight::new(position, axis, id, scale).facing(right);
    Placed { slide, lamp, position, frame: [x, z.cross(x), z], scale: scale.into() }
}

impl Placed<'_> {
    fn towards(&self, direction: DVec3) -> f64 {
        self.scale * self.slide.intensity(self.frame.map(|axis| axis.dot(direction)))
    }

    fn irradiance(&self, x: &ShadingPoint) -> f64 {
        let to = self.position.as_dvec3() - x.position.as_dvec3();
        let direction = to.normalize();
        let weight = match x.receiver {
            Receiver::Surface(normal) => normal.as_dvec3().dot(direction).max(0.0),
            _ => 1.0,
        };
        weight * self.towards(-direction) / to.length_squared()
    }

    /// A point that the light is seen from, in the middle part of its view.
    fn in_view(&self, pcg: &mut Pcg32) -> Vec3 {
        let tangents = self.slide.angles.map(|angle| (0.5 * f64::from(angle)).tan());
        let [s, t] = [0, 1].map(|k| tangents[k] * f64::from(pcg.within(-0.9, 0.9)));
        let [x, y, z] = self.frame;
        self.position + (2.0 * (x * s + y * t + z).normalize()).as_vec3()
    }
}

/// Scenes of projectors alone.
pub(crate) fn projectors(number: usize, pcg: &mut Pcg32) -> LightSampler {
    let slides = slides(pcg);
    let mut builder = LightSampler::builder().arity(ARITIES[number % 3]);
    for i in 0..[3, 20, 60][number % 3] {
        let slide = &slides[i % slides.len()];
        let id = builder.add_projection(&slide.projection()).expect("a valid projection");
        builder.add_light(place(slide, id, pcg).lamp).expect("a valid light");
    }
    builder.build().expect("few lights")
}

/// Up to a node of lights: each is chosen by exactly what it sends, and never where it sends nothing.
#[test]
fn projectors_are_chosen_by_their_intensity() {
    let (mut lit, mut dark) = (0, 0);
    for round in 0..12 {
        let mut pcg = Pcg32::new(round, 191);
        let slides = slides(&mut pcg);
        let mut builder = LightSampler::builder();
        let count = [1, 2, 9, 14][round as usize % 4];
        let placed: Vec<_> = (0..count)
            .map(|i| {
                let slide = &slides[(i + round as usize) % slides.len()];
                let id = builder.add_projection(&slide.projection()).expect("a valid projection");
                let placed = place(slide, id, &mut pcg);
                builder.add_light(placed.lamp).expect("a valid light");
                placed
            })
            .collect();
        let lights = builder.build().expect("few lights");
        for i in 0..60 {
            let receiver = if i % 2 == 0 { Receiver::Volume } else { Receiver::Surface(pcg.direction()) };
            let x = ShadingPoint::new(placed[i % count].in_view(&mut pcg), receiver);
            let at = lights.at(&x);
            let exact: Vec<f64> = placed.iter().map(|light| light.irradiance(&x)).collect();
            let total: f64 = exact.iter().sum();
            if total == 0.0 {
                assert_eq!(at.sample(pcg.cube()), None);
                continue;
            }
            for (number, exact) in exact.iter().enumerate() {
                let pmf = f64::from(at.pmf_light(LightId::from_index(number as u32)));
                // Energies have three digits.
                let expected = exact / total;
                let is_far = expected < 1e-3;
                assert!(is_far || (pmf / expected - 1.0).abs() < 0.02, "{x:?}: {pmf}, not {expected}");
                lit += usize::from(!is_far);
                if *exact == 0.0 {
                    dark += 1;
                    assert!(pmf < 1e-4, "{pmf}");
                }
            }
            let Some(sample) = at.sample(pcg.cube()) else { continue };
            let SampledLight::Punctual(id) = sample.light else { panic!("{sample:?}") };
            assert!((at.pmf_light(id) / sample.pdf - 1.0).abs() < 1e-5);
            let light = &placed[id.index() as usize];
            let own = f64::from(light.lamp.intensity_through(&light.slide.projection(), -sample.direction));
            let exact = light.towards(-sample.direction.as_dvec3());
            assert!((own - exact).abs() < 1e-3 * exact + 1e-3, "{own}, not {exact}");
        }
    }
    assert!(lit > 500 && dark > 100, "{lit} lit, {dark} dark");
}

/// Rays of light carry the power of the image, and as much of it to each half and quarter as integrals over directions
/// find; their densities agree.
#[test]
fn photons_carry_the_power_of_the_image() {
    // Parts of the image by coordinates from -1 to 1: all, the right half, the upper half, two quarters.
    let parts =
        |s: f64, t: f64| [true, s > 0.0, t > 0.0, (s > 0.0) == (t > 0.0)].map(|is_in| f64::from(u8::from(is_in)));
    let mut pcg = Pcg32::new(3, 193);
    for slide in slides(&mut pcg) {
        let mut builder = LightSampler::builder();
        let id = builder.add_projection(&slide.projection()).expect("a valid projection");
        let light = place(&slide, id, &mut pcg);
        builder.add_light(light.lamp).expect("a valid light");
        let lights = builder.build().expect("one light");
        let emission = lights.emission();
        let tangents = slide.angles.map(|angle| (0.5 * f64::from(angle)).tan());
        let mut means: [Mean; 4] = Default::default();
        for _ in 0..20_000 {
            let ray = emission.sample(core::array::from_fn(|_| pcg.f32()));
            let values = ray.map_or([0.0; 4], |ray| {
                let again = emission.pdf_light(LightId::from_index(0), ray.direction);
                assert!((again / ray.pdf - 1.0).abs() < 1e-5);
                let direction = ray.direction.as_dvec3();
                let [x, y, z] = light.frame.map(|axis| axis.dot(direction));
                let value = light.towards(direction) / f64::from(ray.pdf);
                parts(x / (z * tangents[0]), y / (z * tangents[1])).map(|part| part * value)
            });
            means.iter_mut().zip(values).for_each(|(mean, value)| mean.add(value));
        }
        let steps = 420;
        let mut exact = [0.0; 4];
        for i in 0..steps {
            for j in 0..steps {
                // Even steps of the angles, not of the plane.
                let place = |k: usize, i: i32| {
                    (f64::from(slide.angles[k]) * ((f64::from(i) + 0.5) / f64::from(steps) - 0.5)).tan()
                };
                let (x, y) = (place(0, i), place(1, j));
                let jacobian = (1.0 + x * x) * (1.0 + y * y) / (1.0 + x * x + y * y).powf(1.5);
                let sent = jacobian * light.scale * slide.intensity([x, y, 1.0]);
                let of_parts = parts(x / tangents[0], y / tangents[1]);
                exact.iter_mut().zip(of_parts).for_each(|(sum, part)| *sum += part * sent);
            }
        }
        let step = f64::from(slide.angles[0]) * f64::from(slide.angles[1]) / f64::from(steps * steps);
        let exact = exact.map(|sum| sum * step);
        for (part, (mean, exact_part)) in means.iter().zip(exact).enumerate() {
            let (found, error) = (mean.mean(), mean.error());
            assert!(
                (found - exact_part).abs() < 5.0 * error + 1e-2 * exact[0],
                "{slide:?}, part {part}: {found} ± {error}, not {exact_part}"
            );
        }
        // Wide texels are seen under very different angles.
        let error = means[0].error();
        assert!(error < 0.05 * exact[0], "{slide:?}: {error}");
    }
}

/// Photons fall on the texels as their density says, which integrates to one; a density that is off is told apart.
#[test]
fn photons_fall_where_the_density_says() {
    let mut pcg = Pcg32::new(4, 194);
    let slides = slides(&mut pcg);
    let significance = sidak(SIGNIFICANCE, slides.len());
    for slide in &slides {
        let mut builder = LightSampler::builder();
        let id = builder.add_projection(&slide.projection()).expect("a valid projection");
        let light = ProfileLight::new(Vec3::ZERO, Vec3::Z, id, 1.0).facing(Vec3::X);
        builder.add_light(light).expect("a valid light");
        let lights = builder.build().expect("one light");
        let emission = lights.emission();
        let tangents = slide.angles.map(|angle| (0.5 * f64::from(angle)).tan());
        let cells = slide.size.map(|size| 2 * size);
        let (mut observed, n) = (vec![0.0; cells[0] * cells[1]], 40_000);
        for _ in 0..n {
            let ray = emission.sample(core::array::from_fn(|_| pcg.f32())).expect("it sends");
            let d = ray.direction.as_dvec3();
            let at = [d.x / d.z / tangents[0], d.y / d.z / tangents[1]].map(|s| 0.5 + 0.5 * s);
            let [i, j] = [0, 1].map(|k| ((at[k] * cells[k] as f64) as usize).min(cells[k] - 1));
            observed[j * cells[0] + i] += 1.0;
        }
        // By the midpoint rule: within a texel, the density per area of the plane is constant.
        let area = 4.0 * tangents[0] * tangents[1] / (cells[0] * cells[1]) as f64;
        let expected: Vec<f64> = (0..observed.len())
            .map(|cell| {
                let place = |k: usize, i: usize| tangents[k] * (2.0 * (i as f64 + 0.5) / cells[k] as f64 - 1.0);
                let p = DVec3::new(place(0, cell % cells[0]), place(1, cell / cells[0]), 1.0);
                let pdf = emission.pdf_light(LightId::from_index(0), p.normalize().as_vec3());
                f64::from(n) * f64::from(pdf) * area / p.length().powi(3)
            })
            .collect();
        let total: f64 = expected.iter().sum();
        assert!((total / f64::from(n) - 1.0).abs() < 1e-4, "{slide:?}: {total}");
        let (p, dump) = chi_square(&observed, &expected);
        assert!(p > significance, "{slide:?}: p = {p:e}\n{dump}");
    }
}

/// A texel of next to no power among bright ones can still be drawn.
#[test]
fn no_lit_texel_is_without_a_density() {
    let size = [512, 300];
    let mut texels = vec![1e6; size[0] * size[1]];
    texels[77 * size[0] + 200] = 1e-9;
    texels[13 * size[0]..][..size[0]].fill(1e-12);
    let slide = Slide { angles: [1.0, 0.7], size, texels, filter: Filter::Nearest };
    let mut builder = LightSampler::builder();
    let id = builder.add_projection(&slide.projection()).expect("a valid projection");
    builder.add_light(ProfileLight::new(Vec3::ZERO, Vec3::Z, id, 1.0).facing(Vec3::X)).expect("a valid light");
    let lights = builder.build().expect("one light");
    let tangents = slide.angles.map(|angle| (0.5 * angle).tan());
    for [i, j] in [[200, 77], [0, 13], [511, 13], [3, 299]] {
        let place = |k: usize, i: usize| tangents[k] * (2.0 * (i as f32 + 0.5) / size[k] as f32 - 1.0);
        let direction = Vec3::new(place(0, i), place(1, j), 1.0).normalize();
        assert!(slide.intensity(direction.as_dvec3().to_array()) > 0.0);
        assert!(lights.emission().pdf_light(LightId::from_index(0), direction) > 0.0, "{i} {j}");
    }
}

/// Every changed word is refused, or harmless.
#[test]
fn projections_survive_bytes() {
    let mut pcg = Pcg32::new(4, 195);
    let slides = slides(&mut pcg);
    let mut builder = LightSampler::builder();
    for slide in [&slides[0], &slides[7], &slides[9]] {
        let id = builder.add_projection(&slide.projection()).expect("a valid projection");
        builder.add_light(place(slide, id, &mut pcg).lamp).expect("a valid light");
    }
    let lights = builder.build().expect("few lights");
    check_changes(&lights, &[1 << 15, 1 << 30, 1 << 31, u32::MAX], Vec3::splat(0.3), &mut pcg);
}

#[test]
fn bad_projections_are_clear_errors() {
    let refuse = |angles: [f32; 2], size: [usize; 2], intensities: &[f32], parts: &[&str]| {
        let projection = Projection { angles, size, intensities, filter: Filter::Nearest };
        let error = LightSampler::builder().add_projection(&projection).expect_err("an invalid one").to_string();
        parts.iter().for_each(|part| assert!(error.contains(part), "{error} lacks {part}"));
    };
    refuse([1.0, 1.0], [0, 1], &[], &["size of the image along axis 0", "2048"]);
    refuse([1.0, 1.0], [1, 4096], &[1.0; 4096], &["axis 1 is 4096"]);
    refuse([1.0, 3.2], [1, 1], &[1.0], &["angle of view 1 is 3.2"]);
    refuse([f32::NAN, 1.0], [1, 1], &[1.0], &["angle of view 0 is NaN"]);
    refuse([1.0, 1.0], [2, 1], &[1.0, -1.0], &["intensity 1 is -1"]);
    refuse([1.0, 1.0], [2, 1], &[f32::INFINITY, 1.0], &["intensity 0 is inf"]);
    refuse([1.0, 1.0], [2, 2], &[1.0; 3], &["number of intensities 4 is 3"]);
}
