//! The scenes of the matrix.

use core::f32::consts::PI;

use fanlight::{Arity, Filter, LightSampler, ShadingPoint, Wrap};
use glam::{Mat3, Quat, Vec2, Vec3};

use crate::common::pcg::Pcg32;
use crate::common::scene::{Image, LightMesh, Paint, Scene, Sky};

/// A scene of the matrix. Shading points are placed around the first triangle of the first mesh.
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    /// Whether the lights are taken for ones of unit radiance, as two lookups of such a texture need not agree.
    pub(crate) ones: bool,
    /// Angle, in radians, that the smallest bright part of an environment is seen under.
    pub(crate) detail: f64,
    /// Whether a look at every triangle takes so long that there are fewer of them.
    pub(crate) large: bool,
    /// How far a vertex moves while the shutter is open; it is where the scene says at [`MIDDLE`].
    way: fn(Vec3) -> Vec3,
}

/// The time at which all rows are looked at.
const MIDDLE: f32 = 0.5;

impl Row {
    /// The sampler of the scene, as it moves.
    pub(crate) fn build(&self, arity: Arity) -> LightSampler {
        let aside = |share: f32| {
            let mut scene = self.scene.clone();
            let all = scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions);
            all.for_each(|p| *p += share * (self.way)(*p));
            scene
        };
        let (start, end) = (aside(-MIDDLE), aside(1.0 - MIDDLE));
        start.build_moving(arity, &end)
    }

    /// A point at the time of the scene.
    pub(crate) fn now(&self, x: ShadingPoint) -> ShadingPoint {
        x.at_time(MIDDLE)
    }
}

/// How large the largest scenes are.
#[derive(Clone, Copy)]
pub(crate) struct Sizes {
    pub(crate) triangles: usize,
    pub(crate) sky: usize,
}

/// The number of rows.
pub(crate) const COUNT: usize = 27;

/// A row by its number.
pub(crate) fn row(number: usize, sizes: Sizes) -> Row {
    let mut pcg = Pcg32::new(number as u64, 61);
    let (name, scene) = match number {
        0 => ("sliver of aspect 10^7", book(|p| p * Vec3::new(1.0, 1e-7, 1e-7))),
        1 => ("triangles without area", without_area()),
        2 => ("one triangle 1,000 times", repeated()),
        3 => ("all centroids equal", one_center(&mut pcg, 64, 1.0)),
        4 => ("1e-6 units", book(|p| p * 1e-6)),
        5 => ("1e6 units", book(|p| p * 1e6)),
        6 => ("1e6 from the origin", book(|p| p + Vec3::new(1e6, -1e6, 1e6))),
        7 => ("10^6 triangles in one point", one_center(&mut pcg, sizes.triangles, 1e-3)),
        8 => ("closed box", closed_box()),
        9 => ("uvs without area", textured(noise(&mut pcg, [4, 4], 0.0), |_| Vec2::new(0.3, 0.7))),
        10 => ("uvs on a line", textured(noise(&mut pcg, [4, 4], 0.0), |uv| Vec2::splat(uv.x))),
        11 => ("100 repeats, 5,000 away", textured(noise(&mut pcg, [2, 2], 0.0), |uv| 100.0 * uv + 5000.0)),
        12 => ("uvs at the limit of 1e5", textured(noise(&mut pcg, [4, 4], 0.5), |uv| (uv - 0.5) * 2e5)),
        13 => ("one texel of 1e10 in black", textured(one_texel([64, 64], [20, 20], 1e10), |uv| uv)),
        14 => ("all black", textured(one_texel([8, 8], [4, 4], 0.0), |uv| uv)),
        15 => ("texture of 1x1", textured(noise(&mut pcg, [1, 1], 1.0), |uv| uv)),
        16 => ("texture of 1x8192", textured(noise(&mut pcg, [1, 8192], 0.01), |uv| uv)),
        17 => ("environment of one texel", through(Sky::LatLong { size: [1, 1], texels: vec![3.0] })),
        18 => ("one lit texel", lit_texel()),
        19 => ("sun on a seam of the map", sun([33, 180], 0.0)),
        20 => ("sun on a pole", sun([0, 0], 0.0)),
        21 => ("sun on the other pole", sun([0, 255], 0.0)),
        22 => ("sun on a corner of cells", sun([64, 127], 0.002)),
        23 => ("environment of 4096^2", wide(&mut pcg, sizes.sky)),
        24 => ("from a line to twice the size", book(|p| p)),
        25 => ("moving, 1e6 from the origin", book(|p| p + Vec3::new(1e6, -1e6, 1e6))),
        26 => ("sun through a moving portal", sun([33, 180], 0.0)),
        _ => unreachable!("there is no such row"),
    };
    let detail = match number {
        18 => 0.1,
        19..=22 | 26 => 0.012,
        23 => 6.3 / sizes.sky as f64,
        _ => 1.0,
    };
    let way: fn(Vec3) -> Vec3 = match number {
        24 => |p| 2.0 * p * Vec3::Y,
        25 => |p| Vec3::new(1.0, 0.5, 0.25 * f32::from(u8::from(p.x > 1e6))),
        26 => |p| Vec3::new(0.25, 0.5, -0.25 * p.y),
        _ => |_| Vec3::ZERO,
    };
    Row { name, scene, detail, ones: number == 12, large: matches!(number, 7 | 23), way }
}

/// Two triangles with an edge in common, one of which stands on the other's front.
fn pages() -> LightMesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.25, 1.0, 0.0), Vec3::new(0.5, 0.125, 0.75)];
    let mut mesh = LightMesh::new(positions, vec![[0, 1, 2], [1, 0, 3]]);
    mesh.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    mesh
}

fn book(change: impl Fn(Vec3) -> Vec3) -> Scene {
    let mut mesh = pages();
    mesh.positions.iter_mut().for_each(|p| *p = change(*p));
    Scene::new("book", vec![mesh])
}

fn without_area() -> Scene {
    let mut mesh = pages();
    mesh.positions.push(Vec3::new(2.0, 0.0, 0.0));
    mesh.indices.extend([[0, 0, 0], [0, 1, 1], [2, 2, 0], [0, 1, 4], [3, 3, 3]]);
    Scene::new("degenerate", vec![mesh])
}

fn repeated() -> Scene {
    let mut mesh = pages();
    mesh.indices.extend([[0, 1, 2]; 999]);
    Scene::new("repeated", vec![mesh])
}

/// Triangles of any orientation, up to so large, around the origin.
fn one_center(pcg: &mut Pcg32, count: usize, size: f32) -> Scene {
    let mut mesh = LightMesh::new(Vec::new(), Vec::new());
    for i in 0..count as u32 {
        let turn = pcg.rotation();
        let scale = size * if i == 0 { 1.0 } else { pcg.within(0.2, 1.0) };
        let corner = |k: i32| {
            let (sin, cos) = (2.0 * PI / 3.0 * k as f32).sin_cos();
            turn * Vec3::new(scale * cos, scale * sin, 0.0)
        };
        mesh.positions.extend([corner(0), corner(1), corner(2)]);
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    Scene::new("one center", vec![mesh])
}

/// A cube that shines inwards.
fn closed_box() -> Scene {
    let mut mesh = LightMesh::new(Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let first = mesh.positions.len() as u32;
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
                mesh.positions.push(Vec3::from(p));
            }
            let [b, c, d] = if side == 0.0 { [1, 2, 3] } else { [3, 2, 1] };
            mesh.indices.extend([[first, first + b, first + c], [first, first + c, first + d]]);
        }
    }
    Scene::new("box", vec![mesh])
}

fn textured(image: Image, change: impl Fn(Vec2) -> Vec2) -> Scene {
    let mut mesh = pages().paint(Paint::Image(0));
    mesh.uvs.iter_mut().for_each(|uv| *uv = change(*uv));
    let mut scene = Scene::new("textured", vec![mesh]);
    scene.images.push(image);
    scene
}

fn image(size: [usize; 2], texels: Vec<f32>) -> Image {
    Image { size, texels, filter: Filter::Nearest, wrap: [Wrap::Repeat; 2] }
}

fn noise(pcg: &mut Pcg32, size: [usize; 2], least: f32) -> Image {
    image(size, (0..size[0] * size[1]).map(|_| least + pcg.f32()).collect())
}

fn one_texel(size: [usize; 2], [column, row]: [usize; 2], value: f32) -> Image {
    let mut texels = vec![0.0; size[0] * size[1]];
    texels[row * size[0] + column] = value;
    image(size, texels)
}

fn through(sky: Sky) -> Scene {
    let mut scene = Scene::new("portals", vec![pages().portal()]);
    scene.sky = sky;
    scene
}

/// Turns the sky so that a direction of the map is seen through the first page from in front of it.
fn turned(mut scene: Scene, local: Vec3) -> Scene {
    scene.rotation = Mat3::from_quat(Quat::from_rotation_arc(local, Vec3::new(0.02, -0.03, -1.0).normalize()));
    scene
}

/// Center of a texel of a latitude-longitude image, some of the texel's width aside.
fn place([width, height]: [usize; 2], [column, row]: [usize; 2], aside: f32) -> Vec3 {
    let phi = 2.0 * PI * (column as f32 + 0.5 + aside) / width as f32;
    let theta = PI * (row as f32 + 0.5 + aside) / height as f32;
    Vec3::new(phi.cos() * theta.sin(), -phi.sin() * theta.sin(), theta.cos())
}

fn lit_texel() -> Scene {
    let (size, at) = ([64, 32], [11, 13]);
    let texels = one_texel(size, at, 50.0).texels;
    turned(through(Sky::LatLong { size, texels }), place(size, at, 0.0))
}

/// A dim sky with a sun of two by two texels at and after the given one, or all around the pole in its row.
fn sun([column, row]: [usize; 2], tilt: f32) -> Scene {
    let size = [512, 256];
    let mut texels: Vec<f32> = (0..size[0] * size[1]).map(|i| 0.1 + 0.2 * (i % 7) as f32 / 7.0).collect();
    let is_pole = row == 0 || row == size[1] - 1;
    if is_pole {
        texels[row * size[0]..][..size[0]].fill(5e4);
        let pole = Vec3::new(0.0, tilt, if row == 0 { 1.0 } else { -1.0 });
        return turned(through(Sky::LatLong { size, texels }), pole.normalize());
    }
    for [x, y] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
        texels[(row + y) * size[0] + (column + x) % size[0]] = 5e4;
    }
    turned(through(Sky::LatLong { size, texels }), place(size, [column, row], 0.5))
}

/// Noise, brighter on one side, with a sun.
fn wide(pcg: &mut Pcg32, size: usize) -> Scene {
    let brightness = |i: usize| 1.0 + 4.0 * (i % size) as f32 / size as f32;
    let mut texels: Vec<f32> = (0..size * size).map(|i| (0.2 + pcg.f32()) * brightness(i)).collect();
    let at = [size / 3, size / 5];
    texels[at[1] * size + at[0]] = 6.0 * (size * size) as f32;
    turned(through(Sky::LatLong { size: [size; 2], texels }), place([size; 2], at, 0.0))
}
