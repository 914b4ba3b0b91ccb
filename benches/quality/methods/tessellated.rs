//! One constant triangle for every half of a texel, under the binary light tree: what a renderer does whose lights
//! have one radiance each.

use ::fanlight::ShadingPoint;
use glam::{DVec2, DVec3, Vec3};

use super::binary_tree::BinaryTree;
use super::light_bounds::LightBounds;
use super::triangle::uniform;
use super::{Drawn, Method};
use crate::scenes::{Light, Scene};

/// A triangle of one radiance.
struct Part {
    vertices: [Vec3; 3],
    area: f32,
}

pub(crate) struct Tessellated<'a> {
    scene: &'a Scene,
    size: usize,
    parts: Vec<Part>,
    tree: BinaryTree,
}

impl<'a> Tessellated<'a> {
    /// Only for a flat square of two triangles whose texture coordinates are those of the corners.
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let image = scene.image.as_ref().expect("the workload is textured");
        let size = image.size;
        let mut parts = vec![];
        let mut bounds = vec![];
        for cell in 0..size * size {
            for half in 0..2 {
                let corners = corners(cell % size, cell / size, half).map(|c| c / size as f64);
                let vertices = corners.map(|uv| at(&scene.lights[half], uv).as_vec3());
                let area = 0.5 * (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]).length();
                let normal = scene.lights[half].normal_and_area().0.as_vec3();
                // The mean over the triangle, by the midpoints of its edges.
                let middle = |i: usize| image.value(0.5 * (corners[i] + corners[(i + 1) % 3]));
                let mean = (middle(0) + middle(1) + middle(2)) / 3.0;
                bounds.push(LightBounds::of_triangle(vertices, normal, area * mean as f32));
                parts.push(Part { vertices, area });
            }
        }
        Self { scene, size, parts, tree: BinaryTree::new(&bounds) }
    }

    /// The light and the place on it of a point with these texture coordinates; the second light lies above the
    /// diagonal.
    fn place(uv: DVec2) -> (usize, [f64; 2]) {
        if uv.y > uv.x { (1, [uv.x, uv.y - uv.x]) } else { (0, [uv.x - uv.y, uv.y]) }
    }

    /// Density per solid angle of a point of a part.
    fn density(&self, part: usize, pmf: f64, offset: DVec3) -> f64 {
        let (normal, _) = self.scene.lights[part % 2].normal_and_area();
        pmf * offset.length().powi(3) / (f64::from(self.parts[part].area) * -normal.dot(offset))
    }
}

/// Corners of one half of a texel, in texels.
fn corners(x: usize, y: usize, half: usize) -> [DVec2; 3] {
    let low = DVec2::new(x as f64, y as f64);
    [low, low + if half == 0 { DVec2::X } else { DVec2::ONE }, low + if half == 0 { DVec2::ONE } else { DVec2::Y }]
}

/// Point of a light at texture coordinates of the square.
fn at(light: &Light, uv: DVec2) -> DVec3 {
    let [a, b, c] = light.uvs;
    let (e1, e2, e) = (b - a, c - a, uv - a);
    let determinant = e1.perp_dot(e2);
    light.point([e.perp_dot(e2) / determinant, e1.perp_dot(e) / determinant])
}

impl Method for Tessellated<'_> {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let (part, pmf) = self.tree.sample(x, &mut f64::from(u[0]))?;
        let [b1, b2] = uniform([f64::from(u[1]), f64::from(u[2])]);
        let [a, b, c] = self.parts[part].vertices.map(Vec3::as_dvec3);
        let point = a + (b - a) * b1 + (c - a) * b2;
        let offset = point - x.position.as_dvec3();
        let (light, barycentrics) = Self::place(point.truncate());
        Some(Drawn {
            light,
            barycentrics: barycentrics.map(|b| b as f32),
            direction: offset.normalize().as_vec3(),
            pdf: self.density(part, pmf, offset),
            radiance: None,
        })
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let light = &self.scene.lights[drawn.light];
        let place = drawn.barycentrics.map(f64::from);
        let offset = light.point(place) - x.position.as_dvec3();
        let texel = light.uv(place) * self.size as f64;
        let index = |x: f64| (x as usize).min(self.size - 1);
        let half = usize::from(texel.fract().y > texel.fract().x);
        let part = 2 * (index(texel.y) * self.size + index(texel.x)) + half;
        self.density(part, self.tree.pmf(x, part), offset)
    }

    fn pmfs(&self, _: &ShadingPoint, _: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        None
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.parts[..]) + self.tree.bytes()
    }
}
