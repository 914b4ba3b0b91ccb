//! Numbers, scenes and shading points that are often at a limit.

use fanlight::ShadingPoint;
use glam::Vec3;

use super::pcg::Pcg32;
use super::scene::{Content, Scene, random_point, with_lobe, with_microfacets};

/// Scenes by their number modulo 8 that are squeezed to slivers, moved a thousand units away, or shrunk.
pub(crate) const MOVED: [usize; 3] = [FLAT, FAR, SMALL];
const FLAT: usize = 3;
const FAR: usize = 5;
const SMALL: usize = 7;

/// Mostly uniform, now and then an end of the range, a denormal or a multiple of a power of two.
pub(crate) fn hostile(pcg: &mut Pcg32) -> f32 {
    match pcg.below(24) {
        0 => 0.0,
        1 => 1.0 - f32::EPSILON / 2.0,
        2 => 1e-45,
        3 => f32::MIN_POSITIVE * pcg.f32(),
        4 => pcg.below(4) as f32 * 0.25,
        5 => pcg.below(1 << 12) as f32 / 4096.0,
        6 => (1 + pcg.below(1 << 12)) as f32 / 4096.0 - f32::EPSILON / 2.0,
        7 => pcg.f32() * 1e-7,
        _ => pcg.f32(),
    }
}

/// A scene of up to a thousand triangles.
pub(crate) fn random_scene(number: usize, pcg: &mut Pcg32) -> Scene {
    let triangles = [1, 2, 10, 100, 1000][number % 5];
    let content = Content { triangles, textured: pcg.below(3) > 0, sky: pcg.below(5), two_sided: pcg.below(2) == 0 };
    let mut scene = Scene::random(pcg, content);
    // Every other scene is moved, scaled or flattened to slivers.
    let change = |scene: &mut Scene, f: &dyn Fn(Vec3) -> Vec3| {
        scene.meshes.iter_mut().for_each(|mesh| mesh.positions.iter_mut().for_each(|p| *p = f(*p)));
    };
    match number % 8 {
        FLAT => change(&mut scene, &|p| p * Vec3::new(1.0, 1.0, 1e-4)),
        FAR => change(&mut scene, &|p| p + 1000.0),
        SMALL => change(&mut scene, &|p| p * 1e-3),
        _ => {}
    }
    scene
}

/// Points around the unit cube; some in the plane of a triangle or at a vertex.
pub(crate) fn shading_point(number: usize, scene: &Scene, pcg: &mut Pcg32) -> ShadingPoint {
    let mut x = random_point(pcg, number);
    let mesh = &scene.meshes[pcg.below(scene.meshes.len())];
    let [a, b, c] = mesh.vertices(pcg.below(mesh.indices.len()));
    match number % 10 {
        7 => x.position = a + 2.0 * (b - a),
        8 => x.position = c,
        9 => x.position = (a + b + c) / 3.0 + 1e-4 * x.position,
        _ => x.position += a - Vec3::splat(0.5),
    }
    x
}

/// A point of [`shading_point`] with a lobe, down to mirrors.
pub(crate) fn shading_point_with_lobe(number: usize, scene: &Scene, pcg: &mut Pcg32) -> ShadingPoint {
    let x = shading_point(number, scene, pcg);
    with_lobe(x, pcg, 1e-4)
}

/// A point of [`shading_point`] with microfacets, down to mirrors and to clear glass.
pub(crate) fn shading_point_with_microfacets(number: usize, scene: &Scene, pcg: &mut Pcg32) -> ShadingPoint {
    let x = shading_point(number, scene, pcg);
    with_microfacets(x, pcg, 1e-4)
}
