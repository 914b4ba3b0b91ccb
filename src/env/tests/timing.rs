//! Timings: `cargo test --release --lib env::tests::timing -- --ignored --nocapture`.

use super::*;
use crate::env::Footprint;
use core::hint::black_box;
use std::time::Instant;

#[test]
#[ignore = "prints timings"]
fn timing() {
    let image = noise(1024 * 512, 1);
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let start = Instant::now();
        black_box(Environment::from_lat_long(1024, 512, &image, filter).unwrap());
        std::println!("build of 1024 x 512, {filter:?}: {:.3} s", start.elapsed().as_secs_f64());
    }
    for size in [2, 16, 128, 1024] {
        let mut image = noise(size * size, 3);
        image.iter_mut().for_each(|v| *v = 1.0 + *v * 1e-6);
        let environment = Environment::from_equal_area(size, &image, Filter::Nearest).unwrap();
        let mut pcg = Pcg32::new(1, 1);
        let u: Vec<[f32; 2]> = (0..65536).map(|_| [pcg.next_f32(), pcg.next_f32()]).collect();
        let mut best = f64::INFINITY;
        for _ in 0..19 {
            let start = Instant::now();
            u.iter().for_each(|&u| _ = black_box(environment.sample(u)));
            best = best.min(start.elapsed().as_nanos() as f64 / 65536.0);
        }
        std::println!("nearly uniform, {size} x {size}: sample {best:.1} ns");
    }
    let smooth: Vec<f32> = (0..1024 * 512).map(|i| 1.0 + ((i % 1024) as f32 * 0.02).sin()).collect();
    for (name, image) in [("noise", &image), ("smooth", &smooth)] {
        let environment = Environment::from_lat_long(1024, 512, image, Filter::Bilinear).unwrap();
        let view = environment.as_view();
        let mut pcg = Pcg32::new(1, 1);
        let u: Vec<[f32; 2]> = (0..65536).map(|_| [pcg.next_f32(), pcg.next_f32()]).collect();
        let directions: Vec<Vec3> = u.iter().map(|_| pcg.direction()).collect();
        let time = |what: &str, f: &mut dyn FnMut()| {
            let mut best = f64::INFINITY;
            for _ in 0..9 {
                let start = Instant::now();
                f();
                best = best.min(start.elapsed().as_nanos() as f64 / 65536.0);
            }
            std::println!("{name}: {what} {best:.1} ns");
        };
        time("sample", &mut || u.iter().for_each(|&u| _ = black_box(view.sample(u))));
        time("pdf", &mut || directions.iter().for_each(|&d| _ = black_box(view.pdf(d))));
        for radius in [0.001, 0.01, 0.1, 0.5] {
            let region =
                |&direction: &Vec3| Footprint { direction, sin_radius: radius, solid_angle: PI * radius * radius };
            time(&alloc::format!("average, radius {radius}"), &mut || {
                directions.iter().for_each(|d| _ = black_box(view.average(&region(d))));
            });
        }
    }
}
