//! What is known of the light that arrives: a density of directions for each cell of space and each orientation.

use fanlight::glam::Vec3;
use fanlight::{LightSamplerView, ShadingPoint};

use crate::quadtree::{Quadtree, Weighted, to_square};
use crate::random::Random;
use crate::scene::SIZE;

/// As how many samples of a path what `fanlight` knows counts. More trusts the paths later. *Chosen.*
const PRIOR: f32 = 1000.0;
/// Directions that are drawn at each point to fill the regions. *Chosen.*
const DRAWN: u32 = 8;

/// Regions, with what has been recorded there.
pub(crate) struct Guide {
    regions: Vec<Region>,
}

#[derive(Default)]
struct Region {
    prior: Vec<Weighted>,
    recorded: Vec<Weighted>,
    tree: Option<Quadtree>,
}

/// The region of a point: cells of a meter, times six orientations.
fn number(position: Vec3, normal: Vec3) -> usize {
    let [x, y, z] = position.clamp(Vec3::ZERO, SIZE - 1e-3).to_array().map(|x| x as usize);
    let [_, height, depth] = SIZE.to_array().map(|x| x as usize);
    let axis = normal.abs().max_position();
    let side = 2 * axis + usize::from(normal[axis] < 0.0);
    ((x * height + y) * depth + z) * 6 + side
}

impl Guide {
    /// A guide that knows nothing.
    pub(crate) fn new() -> Self {
        let cells: usize = SIZE.to_array().map(|x| x as usize).into_iter().product();
        Self { regions: (0..6 * cells).map(|_| Region::default()).collect() }
    }

    /// Fills the regions of some points, with their normals, with directions that `fanlight` draws there. No ray is
    /// traced: that walls hide some of the lights is known to a view with a table.
    pub(crate) fn fill(&mut self, lights: LightSamplerView<'_>, points: &[[Vec3; 2]], random: &mut Random) {
        for &[position, normal] in points {
            let here = lights.at(&ShadingPoint::surface(position, normal));
            let samples = (0..DRAWN).filter_map(|_| here.sample(random.take()));
            let region = &mut self.regions[number(position, normal)];
            region.prior.extend(samples.map(|sample| (to_square(sample.direction), 1.0)));
        }
        self.learn();
    }

    /// Notes light that arrived: radiance times cosine over density.
    pub(crate) fn record(&mut self, position: Vec3, normal: Vec3, direction: Vec3, weight: f32) {
        if weight > 0.0 {
            self.regions[number(position, normal)].recorded.push((to_square(direction), weight));
        }
    }

    /// Fits the densities to all that is known.
    pub(crate) fn learn(&mut self) {
        for Region { prior, recorded, tree } in &mut self.regions {
            let sum = |samples: &[Weighted]| samples.iter().map(|sample| sample.1).sum::<f32>();
            let weight = match recorded.len() {
                0 => 1.0,
                count => PRIOR * sum(recorded) / count as f32 / sum(prior),
            };
            let prior = prior.iter().map(|&(point, share)| (point, share * weight));
            *tree = Quadtree::fit(prior.chain(recorded.iter().copied()).collect());
        }
    }

    /// The density of directions at a point, if anything is known.
    pub(crate) fn at(&self, position: Vec3, normal: Vec3) -> Option<&Quadtree> {
        self.regions[number(position, normal)].tree.as_ref()
    }
}
