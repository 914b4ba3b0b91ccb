//! The workloads: geometry, textures, environment and shading points, all from fixed seeds.

pub(crate) mod building;
pub(crate) mod cloud;
pub(crate) mod image;
pub(crate) mod openings;
pub(crate) mod pcg;
pub(crate) mod points;
pub(crate) mod quad;
pub(crate) mod sky;
pub(crate) mod sphere;
pub(crate) mod wall;

use fanlight::{Filter, MeshId, ShadingPoint, TriangleId};
use glam::{DVec2, DVec3, Vec2, Vec3};

use image::Image;
use points::PointSet;
use sky::Sky;
use wall::Wall;

/// All workloads, in the order of the table; after an `@`, another way to pass the same light.
pub(crate) const NAMES: [&str; 15] = [
    "cloud-10000",
    "cloud-100000",
    "sphere-29",
    "quad",
    "sphere-9-spots",
    "window",
    "star",
    "star@nearest",
    "grid-1",
    "grid-1@clip-map",
    "grid-100",
    "grid-100@clip-map",
    "grid-10000",
    "grid-10000@clip-map",
    "nested",
];

/// Name of a workload (or method), and of its variant if it is not the first.
pub(crate) fn workload_and_variant(name: &str) -> (&str, Option<&str>) {
    name.split_once('@').map_or((name, None), |(workload, variant)| (workload, Some(variant)))
}

/// The names of all workloads, for a message.
pub(crate) fn workloads() -> String {
    NAMES.into_iter().filter(|name| !name.contains('@')).collect::<Vec<_>>().join(", ")
}

/// Builds a workload by its name.
pub(crate) fn scene(name: &str) -> Scene {
    match name {
        "cloud-10000" => cloud::cloud(10_000),
        "cloud-100000" => cloud::cloud(100_000),
        "sphere-29" => sphere::sphere(29),
        "quad" => quad::quad(),
        "sphere-9-spots" => sphere::sphere_with_spots(9, 256),
        "window" => openings::window(),
        "star" => openings::star(Filter::Bilinear),
        "star@nearest" => openings::star(Filter::Nearest),
        "grid-1" => openings::grid(1),
        "grid-1@clip-map" => openings::grid_clip(1),
        "grid-100" => openings::grid(10),
        "grid-100@clip-map" => openings::grid_clip(10),
        "grid-10000" => openings::grid(100),
        "grid-10000@clip-map" => openings::grid_clip(100),
        "nested" => openings::nested(),
        _ => panic!("no workload is called {name}"),
    }
}

/// Radiance or transmittance of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Weight {
    Constant(f32),
    /// The scene's image.
    Image,
}

/// A mesh as it is handed to the crate.
#[derive(Clone, Debug)]
pub(crate) struct LightMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) weight: Weight,
    pub(crate) portal: bool,
}

/// One triangle in double precision. It sends to its front only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    pub(crate) id: TriangleId,
    pub(crate) vertices: [DVec3; 3],
    pub(crate) uvs: [DVec2; 3],
    pub(crate) weight: Weight,
}

impl Light {
    /// Unit normal of the front, and area.
    pub(crate) fn normal_and_area(&self) -> (DVec3, f64) {
        let [a, b, c] = self.vertices;
        let cross = (b - a).cross(c - a);
        let double_area = cross.length();
        (cross / double_area, 0.5 * double_area)
    }

    pub(crate) fn point(&self, barycentrics: [f64; 2]) -> DVec3 {
        let [a, b, c] = self.vertices;
        a + (b - a) * barycentrics[0] + (c - a) * barycentrics[1]
    }

    pub(crate) fn uv(&self, barycentrics: [f64; 2]) -> DVec2 {
        let [a, b, c] = self.uvs;
        a + (b - a) * barycentrics[0] + (c - a) * barycentrics[1]
    }
}

/// A workload.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) meshes: Vec<LightMesh>,
    /// All triangles of all meshes, in order.
    pub(crate) lights: Vec<Light>,
    /// Number of the first light of each mesh.
    pub(crate) first: Vec<usize>,
    pub(crate) image: Option<Image>,
    /// Set if the lights are portals.
    pub(crate) sky: Option<Sky>,
    pub(crate) walls: Vec<Wall>,
    pub(crate) points: PointSet,
}

impl Scene {
    pub(crate) fn emitters(meshes: Vec<LightMesh>, image: Option<Image>, points: PointSet) -> Self {
        let mut lights = vec![];
        let mut first = vec![];
        for (id, mesh) in (0..).map(MeshId::from_index).zip(&meshes) {
            first.push(lights.len());
            let light = |(triangle, indices): (u32, &[u32; 3])| Light {
                id: TriangleId::new(id, triangle),
                vertices: indices.map(|i| mesh.positions[i as usize].as_dvec3()),
                uvs: indices.map(|i| mesh.uvs.get(i as usize).copied().unwrap_or_default().as_dvec2()),
                weight: mesh.weight,
            };
            lights.extend((0..).zip(&mesh.indices).map(light));
        }
        Self { meshes, lights, first, image, sky: None, walls: vec![], points }
    }

    fn portals(walls: Vec<Wall>, image: Option<Image>) -> Self {
        let meshes = walls.iter().map(Wall::mesh).collect();
        let scene = Self::emitters(meshes, image, PointSet::Room);
        Self { sky: Some(Sky::new()), walls, ..scene }
    }

    /// Number of a triangle among all lights.
    pub(crate) fn light_index(&self, id: TriangleId) -> usize {
        self.first[id.mesh.index() as usize] + id.triangle as usize
    }

    /// Radiance or transmittance of a point of a light.
    pub(crate) fn weight(&self, light: usize, barycentrics: [f64; 2]) -> f64 {
        let light = &self.lights[light];
        match (light.weight, &self.image) {
            (Weight::Image, Some(image)) => image.value(light.uv(barycentrics)),
            (Weight::Constant(weight), _) => f64::from(weight),
            (Weight::Image, None) => 0.0,
        }
    }

    /// Share of the light that passes all walls between a point and the sky.
    pub(crate) fn transmittance(&self, x: DVec3, direction: DVec3) -> f64 {
        let through = |wall: &Wall| wall.meet(x, direction, self.image.as_ref()).map_or(0.0, |(_, t)| t);
        self.walls.iter().filter(|wall| wall.y > x.y).map(through).product()
    }

    /// Whether anything can arrive at a point: whether some light faces it, and is not black and not below the horizon
    /// everywhere. The places of a light that are looked at are its corners, where its whole area sends, or a grid.
    pub(crate) fn is_lit(&self, x: &ShadingPoint) -> bool {
        const GRID: usize = 16;
        let eye = x.position.as_dvec3();
        let is_whole = self.image.is_none() && self.walls.len() < 2;
        let grid = || (0..=GRID).flat_map(|i| (0..=GRID - i).map(move |j| [i, j].map(|k| k as f64 / GRID as f64)));
        let sends = |l: usize, b: [f64; 2]| {
            let direction = self.lights[l].point(b) - eye;
            let is_sent = is_whole
                || if self.sky.is_some() { self.transmittance(eye, direction) > 0.0 } else { self.weight(l, b) > 0.0 };
            is_sent && x.cosine(direction.as_vec3()) > 0.0
        };
        let faces = |l: usize| {
            let [a, b, c] = self.lights[l].vertices;
            (b - a).cross(c - a).dot(eye - a) > 0.0
        };
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let lit =
            |l: usize| if is_whole { corners.into_iter().any(|b| sends(l, b)) } else { grid().any(|b| sends(l, b)) };
        (0..self.lights.len()).any(|l| faces(l) && lit(l))
    }

    /// Mean radiance or transmittance of a light.
    pub(crate) fn mean_weight(&self, light: usize) -> f64 {
        if let Weight::Constant(weight) = self.lights[light].weight {
            return f64::from(weight);
        }
        // Centers of the cells of a regular subdivision, two along a texel.
        let [a, b, c] = self.lights[light].uvs;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = self.image.as_ref().map_or(1, |image| (2.0 * longest * image.size as f64).ceil() as usize).max(1);
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n - i {
                let at = |k: usize| (k as f64 + 1.0 / 3.0) / n as f64;
                sum += self.weight(light, [at(i), at(j)]);
                count += 1.0;
            }
        }
        sum / count
    }
}
