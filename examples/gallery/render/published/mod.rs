//! The published way to choose points of textured emitters, to compare with (Ogaki 2020, "Generalized Light Portals"):
//! a wide tree over triangles by the conservative term of Conty Estevez and Kulla, and in a triangle a tree of arity 4
//! over the texture by the extremely conservative term, down to single texels. Nothing of the crate is in it.

mod averages;
#[expect(dead_code, reason = "the benchmark samples this tree itself")]
#[path = "../../../../benches/quality/methods/binary_tree.rs"]
mod binary_tree;
#[expect(dead_code, reason = "the benchmark has environments, too")]
#[path = "../../../../benches/quality/methods/talk/cell.rs"]
mod cell;
#[path = "../../../../benches/quality/methods/light_bounds.rs"]
mod light_bounds;
#[expect(dead_code, reason = "the benchmark counts bytes, too")]
#[path = "../../../../benches/quality/methods/wide_tree.rs"]
mod wide_tree;

use fanlight::{Receiver, ShadingPoint};
use glam::Vec3;

use super::lighting::{Aim, Proposal};
use super::model::Model;
use super::scene::Point;
use averages::Averages;
use binary_tree::BinaryTree;
use cell::{Cell, follow};
use light_bounds::LightBounds;
use wide_tree::{WideTree, pick};

/// The emitting triangles of a model, all of which emit from the front alone.
pub(crate) struct Published {
    tree: WideTree,
    triangles: Vec<[Vec3; 3]>,
    /// Averages of the radiance over each triangle.
    averages: Vec<Averages>,
    /// Place of all of the model's triangles among these.
    numbers: Vec<Option<usize>>,
}

impl Published {
    pub(crate) fn new(model: &Model) -> Self {
        let (mut triangles, mut averages, mut numbers, mut bounds) = (vec![], vec![], vec![], vec![]);
        for mesh in &model.meshes {
            let material = &model.materials[mesh.material];
            assert!(!material.emits() || !material.two_sided, "the method is for lights with a front");
            for corners in &mesh.indices {
                numbers.push(material.emits().then_some(triangles.len()));
                if material.emits() {
                    let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
                    let own = Averages::new(model, material, corners.map(|i| mesh.emission_uvs()[i as usize]));
                    let cross = (b - a).cross(c - a);
                    let flux = 0.5 * cross.length() * own.at(&Cell::root([a, b, c]));
                    bounds.push(LightBounds::of_triangle([a, b, c], cross.normalize_or_zero(), flux));
                    triangles.push([a, b, c]);
                    averages.push(own);
                }
            }
        }
        Self { tree: WideTree::new(&BinaryTree::new(&bounds)), triangles, averages, numbers }
    }

    /// A direction to a point of an emitter.
    pub(crate) fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Proposal> {
        let (light, light_pmf) = self.tree.sample(f64::from(u[0]), |bounds| bounds.one_sided_importance(x))?;
        // Up to ten choices between four: more bits than one of the numbers has.
        let mut rest = f64::from(u[1]) + f64::from(u[0]) * (1.0 / 16_777_216.0);
        let (cell, pmf) = self.descend(light, x, |weights, total| pick(weights, total, &mut rest))?;
        let root = rest.sqrt();
        let [s, t] = cell.place([root * (1.0 - f64::from(u[2])), root * f64::from(u[2])]).map(|b| b as f32);
        let [a, b, c] = self.triangles[light].map(|v| v - x.position);
        let step = a + s * (b - a) + t * (c - a);
        let cross = (b - a).cross(c - a);
        let distance = step.length();
        let facing = -cross.dot(step);
        let pdf = light_pmf * pmf * cell.parts() * f64::from(2.0 * distance.powi(3) / facing);
        let pdf = pdf as f32;
        (facing > 0.0 && pdf.is_finite() && pdf > 0.0).then_some(Proposal {
            direction: step / distance,
            pdf,
            aim: Aim::Point(distance),
        })
    }

    /// Density per solid angle of a direction that leads to a point of an emitter.
    pub(crate) fn pdf(&self, x: &ShadingPoint, direction: Vec3, point: &Point) -> f32 {
        let Some(light) = self.numbers[point.triangle] else { return 0.0 };
        let [b1, b2] = point.barycentrics.map(f64::from);
        let mut local = [1.0 - b1 - b2, b1, b2];
        let light_pmf = self.tree.pmf(light, |bounds| bounds.one_sided_importance(x));
        let Some((cell, pmf)) = self.descend(light, x, |_, _| follow(&mut local)) else { return 0.0 };
        let [a, b, c] = self.triangles[light];
        let facing = -(b - a).cross(c - a).dot(direction);
        let per_area = light_pmf * pmf * cell.parts() * f64::from(2.0 * point.distance * point.distance);
        if facing > 0.0 { (per_area / f64::from(facing)) as f32 } else { 0.0 }
    }

    /// From a triangle to a cell of it; `choose` gets the weights of four children. Returns the cell and its
    /// probability.
    fn descend(
        &self,
        light: usize,
        x: &ShadingPoint,
        mut choose: impl FnMut(&[f32; 4], f32) -> usize,
    ) -> Option<(Cell, f64)> {
        let averages = &self.averages[light];
        let mut cell = Cell::root(self.triangles[light].map(|v| v - x.position));
        let mut pmf = 1.0;
        while !averages.is_leaf(&cell) {
            let children = cell.children();
            let weights = children.map(|child| averages.at(&child) * term(&child, x));
            let total: f32 = weights.iter().sum();
            if !(total > 0.0) {
                return None;
            }
            let chosen = choose(&weights, total);
            pmf *= f64::from(weights[chosen] / total);
            cell = children[chosen];
        }
        Some((cell, pmf))
    }
}

/// The extremely conservative term: positive whatever is seen of the cell.
fn term(cell: &Cell, x: &ShadingPoint) -> f32 {
    let footprint = cell.footprint();
    let receiver = match x.receiver {
        Receiver::Surface(normal) => 1.0 + normal.dot(footprint.direction),
        _ => 1.0,
    };
    (receiver * (1.0 + footprint.cosine)).max(f32::MIN_POSITIVE) / footprint.distance2
}
