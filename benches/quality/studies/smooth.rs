//! Scenes without edges: what stratified numbers can help with.

use ::fanlight::{Environment, Receiver, ShadingPoint};
use glam::{Vec2, Vec3};

use crate::scenes::image::Image;
use crate::scenes::openings;
use crate::scenes::points::PointSet;
use crate::scenes::sky::{self, Sky};
use crate::scenes::{LightMesh, Scene, Weight};

/// What is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// The crate's lights.
    Lights,
    /// The crate's environment by itself.
    Environment,
    /// For comparison, a map that is known to keep strata: uniform solid angle.
    SolidAngle,
}

/// A smooth integrand.
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) scene: Scene,
    pub(super) target: Target,
}

impl Case {
    pub(super) fn all() -> Vec<Self> {
        let case = |name, scene, target| Self { name, scene, target };
        let constant = Weight::Constant(1.0);
        vec![
            case("triangle, solid angle", square(1.0, &[[0, 1, 2]], constant), Target::SolidAngle),
            case("triangle, constant", square(1.0, &[[0, 1, 2]], constant), Target::Lights),
            case("triangle, smooth texture", square(1.0, &[[0, 1, 2]], Weight::Image), Target::Lights),
            case("square far away", square(0.25, &[[0, 1, 2], [0, 2, 3]], constant), Target::Lights),
            case("window, smooth sky", window(), Target::Lights),
            case("smooth sky alone", window(), Target::Environment),
        ]
    }

    /// Shading points that see the whole light above their horizon.
    pub(super) fn points(&self, count: usize) -> Vec<ShadingPoint> {
        let sees_all = |x: &ShadingPoint| {
            let Receiver::Surface(normal) = x.receiver else { return false };
            let is_above = |vertex: glam::DVec3| normal.dot(vertex.as_vec3() - x.position) > 0.05;
            let is_in_front = |light: &crate::scenes::Light| {
                let (normal, _) = light.normal_and_area();
                normal.dot(x.position.as_dvec3() - light.vertices[0]) > 0.05
            };
            self.scene.lights.iter().all(|light| is_in_front(light) && light.vertices.into_iter().all(is_above))
        };
        self.scene.points.quality(100 * count).into_iter().filter(sees_all).take(count).collect()
    }
}

/// A square, or some triangles of it.
fn square(side: f32, indices: &[[u32; 3]], weight: Weight) -> Scene {
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let positions = uvs.iter().map(|uv| Vec3::new(side * uv.x, side * uv.y, 0.0)).collect();
    let mesh = LightMesh { positions, uvs, indices: indices.to_vec(), weight, portal: false };
    Scene::emitters(vec![mesh], (weight == Weight::Image).then(Image::waves), PointSet::OverQuad)
}

fn window() -> Scene {
    let scene = openings::window();
    Scene { sky: Some(Sky::without_sun()), ..scene }
}

/// The environment of the last two.
pub(super) fn environment() -> Environment {
    sky::environment(&Sky::without_sun().texels)
}
