//! Builds and samples a room without `std`: its own start, panic handler and allocator, and of libc only `write`
//! and `abort`.

#![no_std]
#![no_main]

extern crate alloc;

mod rt;

use fanlight::{Environment, Error, Filter, LightSampler, Mesh, ShadingPoint, Texture, Weight};
use glam::{Vec2, Vec3};

const SAMPLES: usize = 10_000;

const QUAD: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const UVS: [Vec2; 4] = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];

/// A window with a lattice of 8 x 8 panes in the wall `y = 0`, and a lamp under the ceiling.
fn room() -> Result<LightSampler, Error> {
    let mut sky = [0.5_f32; 32 * 16];
    sky[5 * 32 + 24] = 1000.0;
    let mut panes = [0.0_f32; 64 * 64];
    for (i, texel) in panes.iter_mut().enumerate() {
        *texel = if i % 8 > 1 && i / 64 % 8 > 1 { 0.9 } else { 0.0 };
    }
    let window =
        [Vec3::new(-1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 2.5), Vec3::new(-1.0, 0.0, 2.5)];
    let lamp =
        [Vec3::new(-0.2, -2.0, 2.9), Vec3::new(-0.2, -1.6, 2.9), Vec3::new(0.2, -1.6, 2.9), Vec3::new(0.2, -2.0, 2.9)];
    let sky = Environment::from_lat_long(32, 16, &sky, Filter::Bilinear)?;
    let mut builder = LightSampler::builder().environment(sky);
    let lattice = builder.add_texture(Texture::new(64, 64, &panes)?);
    builder.add_mesh(&Mesh::portal(&window, &QUAD).uvs(&UVS).weight(Weight::Texture(lattice)))?;
    builder.add_mesh(&Mesh::emitter(&lamp, &QUAD).weight(Weight::Constant(10.0)))?;
    builder.build()
}

/// Numbers of a scrambled counter, uniform in `[0, 1)`.
fn uniform(i: usize) -> f32 {
    let mut x = i as u32;
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    (x ^ (x >> 16)) as f32 * (1.0 / 4_294_967_296.0) * (1.0 - f32::EPSILON)
}

#[unsafe(no_mangle)]
pub extern "C" fn main() -> i32 {
    let sampler = room().expect("the room is valid");
    let on_floor = ShadingPoint::surface(Vec3::new(0.3, -1.5, 0.0), Vec3::Z);
    let (mut portal, mut emitter) = (0, 0);
    for i in 0..SAMPLES {
        let u = [uniform(3 * i), uniform(3 * i + 1), uniform(3 * i + 2)];
        let Some(sample) = sampler.at(&on_floor).sample(u) else { continue };
        let pdf = sampler.at(&on_floor).pdf(&sample.hit().expect("a triangle"));
        assert!((pdf - sample.pdf).abs() <= 1e-5 * sample.pdf, "sampled with {}, found {pdf}", sample.pdf);
        if sample.hit().expect("a triangle").triangle.mesh.index() == 0 { portal += 1 } else { emitter += 1 }
    }
    assert!(portal > 0 && emitter > 0, "both lights are seen");
    let bytes = sampler.to_bytes();
    rt::println!("no_std: {} samples agree with their densities", portal + emitter);
    rt::println!("no_std: {} bytes of lights", bytes.len());
    0
}
