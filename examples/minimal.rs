//! Irradiance on a floor, lit through a window of four panes, by Monte Carlo and exactly.

use fanlight::glam::{Vec2, Vec3};
use fanlight::{Environment, Error, Filter, LightSampler, Mesh, ShadingPoint, Texture, Weight};

/// How much light each pane lets through: the lower two, then the upper two.
const PANES: [f32; 4] = [1.0, 0.1, 0.5, 0.0];
/// Radiance of the sky.
const SKY: f32 = 2.0;
const SAMPLES: u32 = 4096;

/// A point of the window, which is 2 m wide and high and stands in the wall y = 0. Its front faces y < 0.
fn window(u: f32, v: f32) -> Vec3 {
    Vec3::new(2.0 * u - 1.0, 0.0, 2.0 * v + 0.5)
}

fn main() -> Result<(), Error> {
    // The window: two triangles, with a texture of two by two texels.
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from);
    let positions = uvs.map(|uv| window(uv.x, uv.y));
    let mut builder = LightSampler::builder().environment(Environment::constant(SKY)?);
    let panes = builder.add_texture(Texture::new(2, 2, &PANES)?.filter(Filter::Nearest));
    let mesh = Mesh::portal(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(Weight::Texture(panes));
    let lights = builder.mesh(&mesh)?.build()?;

    // A point on the floor, and directions from it through the window.
    let floor = ShadingPoint::surface(Vec3::new(0.3, -1.5, 0.0), Vec3::Z);
    let here = lights.at(&floor);
    let mut sum = 0.0;
    for i in 0..SAMPLES {
        // Points that fill the unit cube evenly (Roberts' sequence) instead of random numbers.
        let u = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| (0.5 + step * f64::from(i)).fract() as f32);
        // Where nothing can arrive, a sample of zero.
        let Some(sample) = here.sample(u) else { continue };
        // A renderer would trace a ray here, and take what it brings back.
        let arriving = SKY * transmittance(sample.position);
        sum += arriving * floor.cosine(sample.direction) / here.pdf_sample_direction(&sample);
    }
    println!("estimated {:.4}, exact {:.4}", sum / SAMPLES as f32, exact(floor.position, Vec3::Z));
    Ok(())
}

/// What the window lets through at a point of it.
fn transmittance(p: Vec3) -> f32 {
    PANES[2 * usize::from(p.z >= 1.5) + usize::from(p.x >= 0.0)]
}

fn exact(x: Vec3, normal: Vec3) -> f32 {
    let pane = |i: usize| {
        let (u, v) = (0.5 * (i % 2) as f32, 0.5 * (i / 2) as f32);
        let corners = [(u, v), (u + 0.5, v), (u + 0.5, v + 0.5), (u, v + 0.5)].map(|(u, v)| window(u, v) - x);
        SKY * PANES[i] * lambert(corners, normal)
    };
    (0..4).map(pane).sum()
}

/// Irradiance from a quadrilateral above the horizon with a radiance of one (Lambert 1760).
fn lambert(corners: [Vec3; 4], normal: Vec3) -> f32 {
    let edge = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        a.angle_between(b) * normal.dot(a.cross(b).normalize())
    };
    0.5 * (0..4).map(edge).sum::<f32>().abs()
}
