//! Shapes that several scenes have in common.

use core::f32::consts::PI;

use glam::{Vec2, Vec3, vec2, vec3};

use crate::render::{Bitmap, Image, Material, Mesh, Model, Sky, direction_of};

/// Five-pointed star: ten points alternately on a circle of this radius and on one of 0.4 times that.
pub(crate) fn star(center: Vec2, radius: f32) -> Vec<Vec2> {
    let point = |k: u8| {
        let radius = if k.is_multiple_of(2) { radius } else { 0.4 * radius };
        center + radius * Vec2::from_angle(PI / 5.0 * f32::from(k))
    };
    (0..10).map(point).collect()
}

/// A rectangle between two corners.
pub(crate) fn rectangle(low: Vec2, high: Vec2) -> Vec<Vec2> {
    vec![low, vec2(high.x, low.y), high, vec2(low.x, high.y)]
}

/// Whether a point is inside of an outline (even-odd rule).
pub(crate) fn is_inside(outline: &[Vec2], point: Vec2) -> bool {
    let next = outline.iter().cycle().skip(1);
    let crossings = outline.iter().zip(next).filter(|(a, b)| {
        let spans = (a.x > point.x) != (b.x > point.x);
        spans && point.y < a.y + (point.x - a.x) / (b.x - a.x) * (b.y - a.y)
    });
    crossings.count() % 2 == 1
}

/// A mask with a star in it that touches its edges.
pub(crate) fn star_mask(size: usize) -> Bitmap {
    let outline = star(vec2(0.5, 0.5), 0.5);
    Bitmap::mask(size, size, |uv| is_inside(&outline, uv))
}

/// The plane of a wall at some x that faces +x; its coordinates are y and z.
pub(crate) fn wall_at(x: f32) -> [Vec3; 3] {
    [vec3(x, 0.0, 0.0), Vec3::Y, Vec3::Z]
}

/// A quad in that plane between two corners; its image runs along z and downwards.
pub(crate) fn card(mesh: Mesh, x: f32, low: Vec2, high: Vec2) -> Mesh {
    let size = high - low;
    mesh.quad(vec3(x, high.x, low.y), Vec3::Z * size.y, Vec3::NEG_Y * size.x)
}

/// Floor, ceiling and the three walls that are not at x = 0, each of its color.
pub(crate) fn walls(model: &mut Model, size: Vec3, [floor, walls, side]: [Vec3; 3]) {
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    let mesh = model.material(Material::new("floor", floor)).quad(Vec3::ZERO, z, x);
    model.add(mesh);
    let mesh = model.material(Material::new("wall", walls)).quad(y, x, z).quad(x, z, y);
    model.add(mesh);
    let mesh = model.material(Material::new("side", side)).quad(Vec3::ZERO, x, y).quad(z, y, x);
    model.add(mesh);
}

/// A sky drawn as a function of directions.
pub(crate) fn painted_sky(radiance: impl Fn(Vec3) -> Vec3) -> Sky {
    const SIZE: [usize; 2] = [1024, 512];
    let mut image = Image::black(SIZE[0], SIZE[1]);
    for (i, pixel) in image.pixels.iter_mut().enumerate() {
        let place = vec2((i % SIZE[0]) as f32 + 0.5, (i / SIZE[0]) as f32 + 0.5);
        *pixel = radiance(direction_of(place / vec2(SIZE[0] as f32, SIZE[1] as f32)));
    }
    Sky::new(image)
}

/// An overcast sky (CIE), above a dark ground.
pub(crate) fn overcast(direction: Vec3) -> Vec3 {
    if direction.y < 0.0 {
        return Vec3::splat(0.12);
    }
    vec3(0.9, 0.97, 1.1) * (1.0 + 2.0 * direction.y) / 3.0
}

/// An [`overcast`] sky with a sun behind thin clouds: of this brightness, spread over this many degrees.
pub(crate) fn hazy(sun: Vec3, brightness: f32, degrees: f32) -> Sky {
    painted_sky(|direction| {
        let distance = direction.angle_between(sun).to_degrees() / degrees;
        overcast(direction) + vec3(1.0, 0.95, 0.85) * (brightness * (-distance * distance).exp())
    })
}
