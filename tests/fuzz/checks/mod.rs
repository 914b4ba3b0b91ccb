//! What must hold for any bytes at all. The fuzz targets call it with theirs, the tests with those that once failed.

pub(crate) mod build;
pub(crate) mod reader;

use fanlight::{
    Glossy, LightSample, LightSampler, LightSamplerView, Microfacet, RaySegment, Receiver, SampledLight, Scattering,
    ShadingPoint, Splitting, VisibilityView,
};
use glam::{Vec3, Vec3Swizzles};
use reader::Reader;
use smallvec::SmallVec;

/// Positions and normals that the contracts speak of.
const POSITION_LIMIT: f32 = 1e9;
/// Relative difference between two ways to the same density.
const TOLERANCE: f32 = 1e-5;

/// Builds a scene from the bytes, and samples it if it is accepted.
pub(crate) fn scene(data: &[u8]) {
    let mut reader = Reader::new(data);
    let Some(mut lights) = build::lights(&mut reader) else { return };
    loop {
        sample(&lights.as_view(), &mut reader);
        emit(&lights, &mut reader);
        if reader.is_empty() {
            break;
        }
    }
    // By the same bytes once more, so that inputs that were found keep their meaning.
    let mut reader = Reader::new(data);
    for _ in 0..3 {
        build::edit(&mut lights, &mut reader);
        sample(&lights.as_view(), &mut reader);
        emit(&lights, &mut reader);
    }
    let mut room = Vec::new();
    let bytes = lights.to_bytes();
    let view = LightSamplerView::from_bytes(aligned(&bytes, &mut room)).expect("its own bytes load");
    sample(&view, &mut reader);
}

/// Loads bytes: those of a sampler with some of them changed, or, if the first one says so, the given ones as they are.
pub(crate) fn bytes(data: &[u8]) {
    let mut reader = Reader::new(data);
    let mut bytes;
    if reader.byte().is_multiple_of(4) {
        bytes = data[1.min(data.len())..].to_vec();
    } else {
        bytes = build::some_bytes(reader.byte()).to_vec();
        for _ in 0..reader.below(8) {
            let at = reader.bits() as usize % bytes.len();
            bytes[at] = reader.byte();
        }
        if reader.byte().is_multiple_of(8) {
            bytes.truncate(reader.bits() as usize % bytes.len());
        }
    }
    let mut room = Vec::new();
    let Ok(view) = LightSamplerView::from_bytes(aligned(&bytes, &mut room)) else { return };
    for _ in 0..4 {
        sample(&view, &mut reader);
    }
}

/// Copies bytes to an address that is a multiple of four.
fn aligned<'r>(bytes: &[u8], room: &'r mut Vec<u8>) -> &'r [u8] {
    *room = vec![0; bytes.len() + 4];
    let start = room.as_ptr().align_offset(4);
    let aligned = &mut room[start..start + bytes.len()];
    aligned.copy_from_slice(bytes);
    aligned
}

/// Loads bytes of a table of visibility, with some of them changed, and samples with it if it is accepted.
pub(crate) fn visibility(data: &[u8]) {
    let mut reader = Reader::new(data);
    let (lights, mut bytes) = build::learned();
    for _ in 0..reader.below(12) {
        let at = reader.bits() as usize % bytes.len();
        bytes[at] = reader.byte();
    }
    if reader.byte().is_multiple_of(8) {
        bytes.truncate(reader.bits() as usize % bytes.len());
    }
    let mut room = Vec::new();
    let Ok(table) = VisibilityView::from_bytes(aligned(&bytes, &mut room)) else { return };
    let Ok(view) = lights.as_view().with_visibility(table) else { return };
    for _ in 0..4 {
        sample(&view, &mut reader);
    }
}

fn receiver(reader: &mut Reader<'_>) -> Receiver {
    let any = reader.vector();
    let normal = if reader.byte() < 250 { any.normalize_or(Vec3::Z) } else { any };
    match reader.below(5) {
        0 => Receiver::Surface(normal),
        1 => Receiver::Transmissive(normal),
        2 => Receiver::Volume,
        3 => {
            let (outgoing, roughness, weights) = (reader.vector(), reader.float(), [reader.float(), reader.float()]);
            let surface = Glossy::new(normal, outgoing, roughness).with_weights(weights[0], weights[1]);
            // By no byte of its own, so that inputs that were found keep their meaning.
            match roughness.to_bits() % 3 {
                0 => Receiver::Microfacet(surface.anisotropic(outgoing.zxy(), [roughness, weights[0]])),
                1 => Receiver::Microfacet(
                    Microfacet::from(surface)
                        .anisotropic(outgoing.yzx(), [roughness, weights[1]])
                        .with_weights(weights[1], weights[0], roughness)
                        .with_ior(2.0 * outgoing.x),
                ),
                _ => Receiver::Glossy(surface),
            }
        }
        _ => Receiver::Scattering(Scattering::new(reader.vector(), reader.float())),
    }
}

/// Draws from one point, and checks every density.
fn sample(lights: &LightSamplerView<'_>, reader: &mut Reader<'_>) {
    let x = ShadingPoint::new(reader.vector(), receiver(reader));
    let u = [(); 3].map(|()| reader.float());
    let direction = reader.vector();
    // By no byte of its own, so that inputs that were found keep their meaning.
    let x = x.with_groups([u32::MAX, u32::MAX, 1, 2][direction.x.to_bits() as usize % 4]).at_time(direction.y);
    let at = lights.at(&x);
    along(lights, &x, u, direction);
    assert_density(lights.at(&x).pdf_direction(direction));
    if let Some(sample) = lights.at(&x).sample(u) {
        check(lights, &x, &sample);
        assert_eq!(at.sample(u), Some(sample));
    }
    let mut samples = SmallVec::<[LightSample; 8]>::new();
    let splitting = Splitting::new(reader.float(), reader.below(3) as u32);
    at.sample_split(u, &splitting, &mut samples);
    for sample in &samples {
        check_numbers(sample);
        if is_ordinary(&x) {
            let pdf = match sample.light {
                SampledLight::Triangle(hit) => at.pdf_split(&hit, &splitting),
                SampledLight::Environment => at.pdf_split_environment(sample.direction, &splitting),
                SampledLight::Shape(id) => at.pdf_split_light(id, sample.direction, &splitting),
                _ => continue,
            };
            assert_close(pdf, sample.pdf, sample);
        }
    }
}

/// Draws a distance along a ray, and checks its density.
fn along(lights: &LightSamplerView<'_>, x: &ShadingPoint, u: [f32; 3], direction: Vec3) {
    let segment = RaySegment::new(x.position, direction, u[0].abs() * 10.0, u[1].abs()).with_groups(x.groups);
    let along = lights.along(&segment.receiver(x.receiver).at_time(x.time()));
    if let Some((distance, pdf)) = along.sample_distance(u[2]) {
        assert!(distance >= 0.0 && distance <= segment.length && pdf > 0.0 && pdf.is_finite(), "{segment:?}");
        assert_close(along.pdf_distance(distance), pdf, &segment);
    }
    assert_density(along.pdf(u[1], direction));
    if let Some(sample) = along.sample([u[2], u[0], u[1], u[2]]) {
        check_numbers(&sample.light);
    }
}

fn check(lights: &LightSamplerView<'_>, x: &ShadingPoint, sample: &LightSample) {
    check_numbers(sample);
    if is_ordinary(x) {
        let at = lights.at(x);
        let pdf = match sample.light {
            SampledLight::Triangle(hit) => at.pdf(&hit),
            SampledLight::Shape(id) => at.pdf_light(id, sample.direction),
            SampledLight::Punctual(id) => at.pmf_light(id),
            _ => at.pdf_environment(sample.direction),
        };
        assert_close(pdf, sample.pdf, sample);
        let along = lights.at(x).pdf_sample_direction(sample);
        assert!(along.is_finite() && along >= sample.pdf * (1.0 - TOLERANCE), "{along} along {sample:?}");
    }
}

fn is_ordinary(x: &ShadingPoint) -> bool {
    x.position.abs().max_element() <= POSITION_LIMIT
        && match x.receiver {
            Receiver::Surface(normal) | Receiver::Transmissive(normal) => (normal.length() - 1.0).abs() < 1e-5,
            Receiver::Glossy(surface) => (surface.normal().length() - 1.0).abs() < 1e-5,
            Receiver::Microfacet(surface) => (surface.normal().length() - 1.0).abs() < 1e-5,
            _ => true,
        }
}

fn check_numbers(sample: &LightSample) {
    let LightSample { position, normal, direction, distance, pdf, pdf_area, pmf, .. } = *sample;
    assert!(position.is_finite() && normal.is_finite() && direction.is_finite(), "{sample:?}");
    assert!((direction.length() - 1.0).abs() < 1e-4, "{sample:?}");
    assert!(distance >= 0.0 && (distance.is_finite() || sample.hit().is_none()), "{sample:?}");
    assert!(pdf > 0.0 && pdf_area > 0.0 && pmf > 0.0, "{sample:?}");
    assert!(pdf.is_finite() && pdf_area.is_finite() && pmf.is_finite(), "{sample:?}");
}

fn assert_density(pdf: f32) {
    assert!(pdf >= 0.0 && pdf.is_finite(), "{pdf}");
}

fn assert_close(found: f32, expected: f32, context: &impl core::fmt::Debug) {
    assert!((found / expected - 1.0).abs() <= TOLERANCE, "{found} instead of {expected}: {context:?}");
}

/// Draws a ray of light, and checks its density.
fn emit(lights: &LightSampler, reader: &mut Reader<'_>) {
    let u = [(); 5].map(|()| reader.float());
    let emission = lights.emission().within(Vec3::splat(u[4]), u[3]).at_time(u[2]);
    if let Some(ray) = emission.sample(u) {
        assert!(ray.position.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-4, "{ray:?}");
        assert!(ray.pdf > 0.0 && ray.pdf.is_finite() && ray.pmf > 0.0, "{ray:?}");
        let pdf = match ray.light.id() {
            Some(id) => emission.pdf_light(id, ray.direction),
            None => emission.pdf(&ray.hit().expect("a triangle"), ray.direction),
        };
        assert_close(pdf, ray.pdf, &ray);
    }
    assert_density(emission.pdf_ray(reader.vector(), reader.vector()));
    let direction = reader.vector().normalize_or(Vec3::X);
    if let Some(ray) = emission.sample_distant(direction, [u[0], u[1], u[2]]) {
        assert_close(emission.pdf_distant(direction, &ray.hit().expect("a triangle")), ray.pdf, &ray);
    }
}
