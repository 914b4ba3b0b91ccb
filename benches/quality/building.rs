//! Buildings of many rooms, in which nearly everything hides from everything: the crate blind to walls, and with
//! learned visibility.
//!
//! A light sample counts here only if it gets through. Walls are planes without thickness, so that visibility is exact,
//! and variance is integrated over points of all lights instead of being estimated from the samples of the method: what
//! a method draws too seldom cannot hide.

use core::hint::black_box;
use std::time::Instant;

use fanlight::{Hit, LightSample, LightSampler, LightSamplerView, Mesh, MeshId, ShadingPoint, TriangleId, Visibility};
use glam::{DVec3, Vec3};

use crate::args::Args;
use crate::metrics;
use crate::parallel::parallel;
use crate::report::{self, Row};
use crate::scenes::building::{self, HEIGHT, LightMesh, ROOMS, SIDE, is_door, sees};
use crate::scenes::pcg::Pcg32;
use crate::scenes::sky::{SUN_SAMPLE_SOLID_ANGLE, Sky};
use crate::timing::{Nanoseconds, median};

/// Workloads of this kind.
pub(crate) const NAMES: [&str; 3] = ["building", "building-10", "building-windows"];
const METHODS: [&str; 2] = ["fanlight", "fanlight@visibility"];

/// Learning rays of the rows with visibility.
const RAYS: [u64; 2] = [1_000_000, 10_000_000];
/// Points a side of a window, and an edge of a lamp's triangle, over which variance is integrated.
const WINDOW_GRID: u32 = 20;
const LAMP_GRID: u32 = 3;
/// Every nth direction of the sun stands for its neighbors.
const SUN_STRIDE: usize = 8;

/// A building, and the crate's sampler of its lights.
struct Building {
    /// Floors.
    floors: u32,
    /// Set if the lights are windows, and not lamps.
    sky: Option<Sky>,
    meshes: Vec<LightMesh>,
    lights: LightSampler,
}

/// What was found at a point.
struct Found {
    e2: f64,
    variance: f64,
    reach: f64,
}

/// Runs a workload, and returns its rows.
pub(crate) fn run(name: &str, args: &Args) -> Vec<Row> {
    let wanted = |method: &str| {
        let (method, variant) = crate::scenes::workload_and_variant(method);
        args.wants_method(method, variant)
    };
    if !args.wants(name) || !METHODS.into_iter().any(wanted) {
        return vec![];
    }
    let start = Instant::now();
    let building = match name {
        "building-windows" => Building::with_windows(),
        "building-10" => Building::with_lamps(building::MANY_FLOORS),
        _ => Building::with_lamps(building::FLOORS),
    };
    let build_ms = start.elapsed().as_secs_f64() * 1e3;
    let points = building::points(building.floors, 36, args.effort.points);
    let mut rows = vec![];
    if wanted(METHODS[0]) {
        rows.push(building.row(name, None, &points, args, build_ms));
    }
    if wanted(METHODS[1]) {
        let few = [20 * args.effort.points as u64];
        let rays = match args {
            args if args.effort.points < 50 => &few[..],
            args if args.quick => &RAYS[..1],
            _ => &RAYS[..],
        };
        for &rays in rays {
            let start = Instant::now();
            let visibility = building.learn(rays);
            let build_ms = build_ms + start.elapsed().as_secs_f64() * 1e3;
            rows.push(building.row(name, Some((&visibility, rays)), &points, args, build_ms));
            if let (Some(folder), true) = (&args.plots, name == NAMES[0] && rays == RAYS[0]) {
                building.plan(&visibility, &folder.join("visibility.png"));
            }
        }
    }
    rows.iter().for_each(report::print);
    rows
}

impl Building {
    fn with_lamps(floors: u32) -> Self {
        Self::new(floors, None, building::lamps(floors))
    }

    fn with_windows() -> Self {
        let mut meshes = vec![];
        for k in 0..building::FLOORS {
            for i in 0..ROOMS {
                let [low, high] = [1.4, 2.6].map(|u| SIDE * f64::from(i) + u);
                let [bottom, top] = [1.0, 2.2].map(|v| HEIGHT * f64::from(k) + v);
                let end = SIDE * f64::from(ROOMS);
                let corners = [(low, bottom), (high, bottom), (high, top), (low, top)];
                let window = |point: &dyn Fn(f64, f64) -> DVec3, turned: bool| {
                    let positions = corners.map(|(u, v)| point(u, v).as_vec3()).to_vec();
                    let indices = if turned { vec![[0, 2, 1], [0, 3, 2]] } else { vec![[0, 1, 2], [0, 2, 3]] };
                    LightMesh { positions, indices, radiance: 1.0 }
                };
                // Fronts look inward.
                meshes.push(window(&|u, v| DVec3::new(0.0, u, v), false));
                meshes.push(window(&|u, v| DVec3::new(end, u, v), true));
                meshes.push(window(&|u, v| DVec3::new(u, 0.0, v), true));
                meshes.push(window(&|u, v| DVec3::new(u, end, v), false));
            }
        }
        Self::new(building::FLOORS, Some(Sky::new()), meshes)
    }

    fn new(floors: u32, sky: Option<Sky>, meshes: Vec<LightMesh>) -> Self {
        let mut builder = LightSampler::builder();
        if let Some(sky) = &sky {
            builder = builder.environment(sky.environment.clone());
        }
        for mesh in &meshes {
            let make = if sky.is_some() { Mesh::portal } else { Mesh::emitter };
            let mesh = make(&mesh.positions, &mesh.indices).weight(fanlight::Weight::Constant(mesh.radiance));
            builder.add_mesh(&mesh).expect("the workload is valid");
        }
        let lights = builder.build().expect("the workload is small");
        Self { floors, sky, meshes, lights }
    }

    /// Learns visibility at random points like those of the workload.
    fn learn(&self, rays: u64) -> Visibility {
        let points = |i: u64| building::learning_point(self.floors, i);
        let seen = |x: &ShadingPoint, sample: &LightSample| f32::from(u8::from(sees(x, sample.position.as_dvec3())));
        Visibility::learn(&self.lights.as_view(), rays, points, seen).expect("nobody cancels")
    }

    fn row(
        &self,
        name: &str,
        visibility: Option<(&Visibility, u64)>,
        points: &[ShadingPoint],
        args: &Args,
        build_ms: f64,
    ) -> Row {
        let lights = match visibility {
            Some((visibility, _)) => self.lights.with_visibility(visibility).expect("it was learned here"),
            None => self.lights.as_view(),
        };
        let found = parallel(points, |i, x| self.measure(&lights, x, args.effort.samples, i as u64));
        let lit: Vec<(&ShadingPoint, &Found)> = points.iter().zip(&found).filter(|(_, f)| f.e2 > 0.0).collect();
        let points: Vec<ShadingPoint> = lit.iter().map(|(x, _)| **x).collect();
        let reach = lit.iter().map(|(_, found)| found.reach).sum::<f64>() / lit.len() as f64;
        Row {
            workload: name.to_owned(),
            method: METHODS[usize::from(visibility.is_some())].to_owned(),
            class: "all",
            points: lit.len(),
            relvar: metrics::summary(lit.iter().map(|(_, found)| (found.variance, found.e2))),
            selection: None,
            lost: None,
            zero_rate: Some(1.0 - reach),
            nanoseconds: self.time(&lights, &points, args),
            bytes: lights.bytes().total(),
            build_ms,
            reach: Some(reach),
            rays_learned: Some(visibility.map_or(0.0, |(_, rays)| rays as f64)),
        }
    }

    /// Integrates what a sample brings and its square over all lights.
    fn measure(&self, lights: &LightSamplerView<'_>, x: &ShadingPoint, samples: usize, seed: u64) -> Found {
        let here = lights.at(x);
        let eye = x.position.as_dvec3();
        let (mut sum, mut squares) = (0.0, 0.0);
        let mut add = |f: f64, pdf: f32, solid_angle: f64| {
            sum += f * solid_angle;
            squares += f * f * solid_angle / f64::from(pdf);
        };
        let mut pcg = Pcg32::new(seed, 42);
        for (mesh, id) in self.meshes.iter().zip((0..).map(MeshId::from_index)) {
            for (triangle, indices) in (0..).zip(&mesh.indices) {
                let [a, b, c] = indices.map(|i| mesh.positions[i as usize].as_dvec3());
                let cross = (b - a).cross(c - a);
                let can_arrive =
                    cross.dot(eye - a) > 0.0 && [a, b, c].iter().any(|v| x.cosine((v - eye).as_vec3()) > 0.0);
                if !can_arrive || !self.may_see(x, (a + b + c) / 3.0) {
                    continue;
                }
                let n = if self.sky.is_some() { WINDOW_GRID } else { LAMP_GRID };
                let area = 0.5 * cross.length() / f64::from(n * n);
                let normal = cross.normalize();
                for _ in 0..n * n {
                    let (u, v) = (pcg.f(), pcg.f());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let point = a + (b - a) * u + (c - a) * v;
                    let way = point - eye;
                    let direction = way.normalize();
                    let cosine = f64::from(x.cosine(direction.as_vec3()));
                    if cosine <= 0.0 || !sees(x, point) {
                        continue;
                    }
                    let sky = self.sky.as_ref().map_or(1.0, |_| crate::scenes::sky::smooth(direction.z));
                    let is_sun = self
                        .sky
                        .as_ref()
                        .is_some_and(|sky| f64::from(sky.environment.radiance(direction.as_vec3())) > 2.0);
                    if is_sun {
                        continue;
                    }
                    let pdf = here.pdf(&Hit::new(TriangleId::new(id, triangle), [u as f32, v as f32]));
                    let solid_angle = area * normal.dot(-direction) / way.length_squared();
                    add(f64::from(mesh.radiance) * sky * cosine, pdf, solid_angle);
                }
            }
        }
        if let Some(sky) = &self.sky {
            for &(direction, energy) in sky.sun.iter().step_by(SUN_STRIDE) {
                let cosine = f64::from(x.cosine(direction.as_vec3()));
                let Some((mesh, point)) = self.window(eye, direction).filter(|_| cosine > 0.0) else { continue };
                if !sees(x, point) {
                    continue;
                }
                let pdf = here.pdf_direction(direction.as_vec3());
                debug_assert!(mesh < self.meshes.len());
                // The radiance over that of the smooth sky, and that.
                let radiance = energy / SUN_SAMPLE_SOLID_ANGLE + crate::scenes::sky::smooth(direction.z);
                add(radiance * cosine, pdf, SUN_SAMPLE_SOLID_ANGLE * SUN_STRIDE as f64);
            }
        }
        let reached = (0..samples).filter(|_| {
            let sample = here.sample(pcg.uniform3());
            sample.is_some_and(|sample| x.cosine(sample.direction) > 0.0 && sees(x, sample.position.as_dvec3()))
        });
        let reach = reached.count() as f64 / samples as f64;
        Found { e2: sum * sum, variance: (squares - sum * sum).max(0.0), reach }
    }

    /// Whether anything of a light around a point may be seen: only what is on the same floor.
    fn may_see(&self, x: &ShadingPoint, center: DVec3) -> bool {
        (f64::from(x.position.z) / HEIGHT).floor() == (center.z / HEIGHT).floor()
    }

    /// Where a ray leaves the building by a window.
    fn window(&self, eye: DVec3, direction: DVec3) -> Option<(usize, DVec3)> {
        let end = SIDE * f64::from(ROOMS);
        let mut nearest: Option<(f64, usize)> = None;
        for axis in 0..2 {
            let plane = if direction[axis] > 0.0 { end } else { 0.0 };
            let distance = (plane - eye[axis]) / direction[axis];
            if distance > 0.0 && nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, axis));
            }
        }
        let (distance, axis) = nearest?;
        let point = eye + direction * distance;
        let (along, z) = (point[1 - axis].rem_euclid(SIDE), point.z.rem_euclid(HEIGHT));
        ((along - 2.0).abs() < 0.6 && (1.0..2.2).contains(&z)).then_some((0, point))
    }

    /// Draws a plan of one story: how often one lamp is chosen at each place of the floor, without the table and with
    /// it.
    fn plan(&self, visibility: &Visibility, path: &std::path::Path) {
        const PIXELS: u32 = 12;
        /// Number of the lamp, and its story.
        const LAMP: (usize, f64) = (3 * (6 * 2 + 2) + 1, 1.0);
        let side = PIXELS * ROOMS * SIDE as u32;
        let lamp = &self.meshes[LAMP.0];
        let center = lamp.positions.iter().sum::<Vec3>() / lamp.positions.len() as f32;
        let known = self.lights.with_visibility(visibility).expect("it was learned here");
        let id = MeshId::from_index(LAMP.0 as u32);
        let share = |lights: &LightSamplerView<'_>, x: f64, y: f64| {
            let point = DVec3::new(x, y, HEIGHT * LAMP.1 + 0.001).as_vec3();
            let here = lights.at(&ShadingPoint::surface(point, Vec3::Z));
            (0..lamp.indices.len() as u32).map(|i| here.pmf(TriangleId::new(id, i))).sum::<f32>()
        };
        let mut image = image::RgbImage::new(2 * side + PIXELS, side);
        for (panel, lights) in [self.lights.as_view(), known].iter().enumerate() {
            for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
                let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(PIXELS));
                let near = |at: f64| (at / SIDE - (at / SIDE).round()).abs() * SIDE * f64::from(PIXELS) < 0.6;
                let is_wall = near(x) && !is_door(y, 0.0) || near(y) && !is_door(x, 0.0);
                let radius = f64::from(center.x - x as f32).hypot(f64::from(center.y - y as f32));
                let value = share(lights, x, y).sqrt();
                let color = match () {
                    () if is_wall || (radius - 0.25).abs() < 0.06 => [255, 255, 255],
                    () => [value, value * value, 0.25 * value].map(|v| (255.0 * v.clamp(0.0, 1.0)) as u8),
                };
                image.put_pixel(i + panel as u32 * (side + PIXELS), side - 1 - j, image::Rgb(color));
            }
        }
        image.save(path).expect("the picture can be written");
    }

    fn time(&self, lights: &LightSamplerView<'_>, points: &[ShadingPoint], args: &Args) -> Nanoseconds {
        let mut pcg = Pcg32::new(3, 3);
        let inputs: Vec<(ShadingPoint, [f32; 3])> = (0..args.effort.calls)
            .map(|i| (points[i.wrapping_mul(0x9e37_79b1) % points.len()], pcg.uniform3()))
            .collect();
        let hits: Vec<(ShadingPoint, Hit)> =
            inputs.iter().filter_map(|(x, u)| Some((*x, lights.at(x).sample(*u)?.hit()?))).collect();
        let (mut calls, mut pdfs) = (vec![], vec![]);
        for _ in 0..args.effort.repeats {
            let start = Instant::now();
            for (x, u) in &inputs {
                let here = lights.at(x);
                let sample = here.sample(*u);
                if self.sky.is_some() {
                    black_box(sample.map(|sample| here.pdf_sample_direction(&sample)));
                } else {
                    black_box(sample);
                }
            }
            calls.push(start.elapsed().as_secs_f64() * 1e9 / inputs.len() as f64);
            let start = Instant::now();
            hits.iter().for_each(|(x, hit)| {
                black_box(lights.at(x).pdf(hit));
            });
            pdfs.push(start.elapsed().as_secs_f64() * 1e9 / hits.len() as f64);
        }
        let call = median(calls);
        Nanoseconds { lit: call, all: call, pdf: median(pdfs) }
    }
}
