//! What a scene sends does not depend on the order of its triangles, on their number, on the order of their vertices,
//! nor on where and how large it is.

use crate::common::oracle;
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::{Content, Scene, random_point};
use crate::common::statistics::Mean;
use crate::common::tier::some;
use fanlight::{Arity, Hit, Illumination, LightSample, LightSampler, Receiver, ShadingPoint, TriangleId};
use glam::{Mat3, Vec3};

const SCENES: usize = 24;
/// Cosines at either end below which rounding decides whether anything arrives.
const GRAZING: f64 = 1e-3;

/// A scene and a shading point, written down in another way.
struct Changed {
    scene: Scene,
    x: ShadingPoint,
    /// Where in the changed scene a point of the first one lies.
    hit: Box<dyn Fn(Hit) -> Hit>,
}

type Change = fn(&Scene, &ShadingPoint, &mut Pcg32) -> Changed;

const CHANGES: [(&str, Change); 6] = [
    ("shuffled", shuffled),
    ("moved", moved),
    ("scaled", scaled),
    ("with every triangle in four", split),
    ("with other first vertices", turned),
    ("with both sides lit and another winding", rewound),
];

/// The triangles of each mesh in another order.
fn shuffled(scene: &Scene, x: &ShadingPoint, pcg: &mut Pcg32) -> Changed {
    let mut scene = scene.clone();
    let mut places = Vec::new();
    for mesh in &mut scene.meshes {
        let mut order: Vec<_> = (0..mesh.indices.len()).collect();
        (1..order.len()).for_each(|i| order.swap(i, pcg.below(i + 1)));
        mesh.indices = order.iter().map(|i| mesh.indices[*i]).collect();
        let mut place = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(old, new)| place[*old] = new);
        places.push(place);
    }
    let hit = move |hit: Hit| {
        let TriangleId { mesh, triangle, .. } = hit.triangle;
        let triangle = places[mesh.index() as usize][triangle as usize];
        Hit::new(TriangleId::new(mesh, triangle), hit.barycentrics)
    };
    Changed { scene, x: *x, hit: Box::new(hit) }
}

fn transformed(scene: &Scene, x: &ShadingPoint, scale: f32, turn: Mat3, shift: Vec3) -> Changed {
    let mut scene = scene.clone();
    let place = |p: Vec3| scale * (turn * p) + shift;
    scene.meshes.iter_mut().for_each(|mesh| mesh.positions.iter_mut().for_each(|p| *p = place(*p)));
    scene.rotation = turn * scene.rotation;
    let receiver = match x.receiver {
        Receiver::Surface(normal) => Receiver::Surface((turn * normal).normalize()),
        Receiver::Transmissive(normal) => Receiver::Transmissive((turn * normal).normalize()),
        receiver => receiver,
    };
    Changed { scene, x: ShadingPoint::new(place(x.position), receiver), hit: Box::new(|hit| hit) }
}

/// All turned and shifted, the sky turned with it.
fn moved(scene: &Scene, x: &ShadingPoint, pcg: &mut Pcg32) -> Changed {
    transformed(scene, x, 1.0, pcg.rotation(), 2.0 * Vec3::from(pcg.cube()) - 1.0)
}

fn scaled(scene: &Scene, x: &ShadingPoint, pcg: &mut Pcg32) -> Changed {
    transformed(scene, x, 10f32.powf(pcg.within(-5.0, 5.0)), Mat3::IDENTITY, Vec3::ZERO)
}

/// Every triangle as four.
fn split(scene: &Scene, x: &ShadingPoint, _: &mut Pcg32) -> Changed {
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        let mut quarters = Vec::new();
        for [a, b, c] in mesh.indices.clone() {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
                let [p, q] = [p as usize, q as usize];
                mesh.positions.push(0.5 * (mesh.positions[p] + mesh.positions[q]));
                mesh.uvs.push(0.5 * (mesh.uvs[p] + mesh.uvs[q]));
                mesh.positions.len() as u32 - 1
            });
            quarters.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]);
        }
        mesh.indices = quarters;
    }
    let hit = |hit: Hit| {
        let [b1, b2] = hit.barycentrics;
        let (part, barycentrics) = match () {
            () if b1 >= 0.5 => (1, [2.0 * b1 - 1.0, 2.0 * b2]),
            () if b2 >= 0.5 => (2, [2.0 * b1, 2.0 * b2 - 1.0]),
            () if b1 + b2 <= 0.5 => (0, [2.0 * b1, 2.0 * b2]),
            () => (3, [1.0 - 2.0 * b1, 1.0 - 2.0 * b2]),
        };
        let TriangleId { mesh, triangle, .. } = hit.triangle;
        Hit::new(TriangleId::new(mesh, 4 * triangle + part), barycentrics)
    };
    Changed { scene, x: *x, hit: Box::new(hit) }
}

/// Every triangle begins with its second vertex.
fn turned(scene: &Scene, x: &ShadingPoint, _: &mut Pcg32) -> Changed {
    let mut scene = scene.clone();
    scene.meshes.iter_mut().for_each(|mesh| mesh.indices.iter_mut().for_each(|[a, b, c]| [*a, *b, *c] = [*b, *c, *a]));
    let hit = |hit: Hit| {
        let [b1, b2] = hit.barycentrics;
        Hit::new(hit.triangle, [b2, (1.0 - b1 - b2).max(0.0)])
    };
    Changed { scene, x: *x, hit: Box::new(hit) }
}

/// Other windings; meshes of one side keep theirs.
fn rewound(scene: &Scene, x: &ShadingPoint, _: &mut Pcg32) -> Changed {
    let mut scene = scene.clone();
    let two_sided: Vec<_> = scene.meshes.iter().map(|mesh| mesh.two_sided).collect();
    for mesh in scene.meshes.iter_mut().filter(|mesh| mesh.two_sided) {
        mesh.indices.iter_mut().for_each(|[_, b, c]| core::mem::swap(b, c));
    }
    let hit = move |hit: Hit| {
        let [b1, b2] = hit.barycentrics;
        let barycentrics = if two_sided[hit.triangle.mesh.index() as usize] { [b2, b1] } else { [b1, b2] };
        Hit::new(hit.triangle, barycentrics)
    };
    Changed { scene, x: *x, hit: Box::new(hit) }
}

fn scene(number: usize, triangles: usize) -> (Scene, Pcg32) {
    let mut pcg = Pcg32::new(5000 + number as u64, 51);
    let content = Content {
        triangles,
        textured: number.is_multiple_of(2),
        sky: number / 2 % 4,
        two_sided: number.is_multiple_of(3),
    };
    let scene = Scene::random(&mut pcg, content);
    (scene, pcg)
}

/// What a sample's point sends to `x` times the cosine there, and the lesser of the cosines at either end.
fn contribution(scene: &Scene, x: &ShadingPoint, sample: &LightSample) -> (f64, f64) {
    let (m, t) = (
        sample.hit().expect("a triangle").triangle.mesh.index() as usize,
        sample.hit().expect("a triangle").triangle.triangle as usize,
    );
    let b = sample.hit().expect("a triangle").barycentrics.map(f64::from);
    let [v0, v1, v2] = scene.meshes[m].vertices(t).map(|v| v.as_dvec3() - x.position.as_dvec3());
    let direction = (v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1]).normalize();
    let (here, there) = (oracle::cosine(&x.receiver, direction), (v1 - v0).cross(v2 - v0).normalize().dot(direction));
    (oracle::sent(scene, m, t, b, direction) * here, here.min(there.abs()))
}

/// Where light comes from in one, it can be drawn in the other.
#[test]
fn what_can_be_drawn_can_be_drawn_in_the_changed_scene() {
    let counts = parallel::map(SCENES, |number| {
        let (scene, mut pcg) = scene(number, [1, 4, 30, 300][number % 4]);
        let lights = scene.build(Arity::Sixteen);
        let mut counted = 0;
        for (name, change) in CHANGES {
            for kind in 0..3 {
                let x = random_point(&mut pcg, kind);
                let changed = change(&scene, &x, &mut pcg);
                let other = changed.scene.build(Arity::Sixteen);
                for _ in 0..200 {
                    let Some(sample) = lights.at(&x).sample(pcg.cube()) else { continue };
                    let (value, cosine) = contribution(&scene, &x, &sample);
                    if value > 0.0 && cosine > GRAZING {
                        counted += 1;
                        let found = other.at(&changed.x).pdf(&(changed.hit)(sample.hit().expect("a triangle")));
                        assert!(found > 0.0, "{} {name}: {sample:?} from {x:?}", scene.name);
                    }
                }
            }
        }
        counted
    });
    let counted: usize = counts.iter().sum();
    assert!(counted > 20_000, "only {counted} samples were compared");
}

/// A single triangle has no tree over triangles, whose boxes lie along the axes: its density moves with it. It may
/// differ only where a decision to divide a cell is a matter of rounding. The boundary integral, of which rounding
/// leaves little far away, is not asked.
#[test]
fn the_density_of_one_triangle_moves_with_it() {
    let found = parallel::map(SCENES, |number| {
        let (mut scene, mut pcg) = scene(number, 1);
        if scene.illumination == Illumination::Boundary {
            scene.illumination = Illumination::default();
        }
        let lights = scene.build(Arity::Sixteen);
        let mut ratios = Vec::new();
        for (_, change) in [CHANGES[1], CHANGES[2]] {
            for kind in 0..3 {
                let x = random_point(&mut pcg, kind);
                let changed = change(&scene, &x, &mut pcg);
                let other = changed.scene.build(Arity::Sixteen);
                for _ in 0..500 {
                    let Some(sample) = lights.at(&x).sample(pcg.cube()) else { continue };
                    let (value, cosine) = contribution(&scene, &x, &sample);
                    if value > 0.0 && cosine > GRAZING {
                        ratios.push(f64::from(
                            other.at(&changed.x).pdf(&(changed.hit)(sample.hit().expect("a triangle"))) / sample.pdf,
                        ));
                    }
                }
            }
        }
        ratios
    });
    let ratios = found.concat();
    let equal = ratios.iter().filter(|ratio| (**ratio - 1.0).abs() < 1e-3).count();
    println!("{equal} of {} densities are equal", ratios.len());
    assert!(ratios.len() > 10_000, "only {} densities were compared", ratios.len());
    assert!(equal as f64 > 0.99 * ratios.len() as f64, "{equal} of {}", ratios.len());
}

fn estimate(scene: &Scene, lights: &LightSampler, x: &ShadingPoint, pcg: &mut Pcg32) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..20_000 {
        let sample = lights.at(x).sample(pcg.cube());
        mean.add(sample.map_or(0.0, |sample| contribution(scene, x, &sample).0 / f64::from(sample.pdf)));
    }
    mean
}

/// Within four and a half standard errors of the difference: chance alone breaks that in one run of a thousand.
#[test]
fn estimates_are_the_same() {
    let numbers = some(SCENES);
    let failed = parallel::map(numbers.len(), |k| {
        let number = numbers[k];
        let (scene, mut pcg) = scene(number, [1, 4, 30, 300][number % 4]);
        let mut failed = Vec::new();
        let x = random_point(&mut pcg, number);
        let first = estimate(&scene, &scene.build(Arity::Sixteen), &x, &mut pcg);
        for (name, change) in CHANGES {
            let changed = change(&scene, &x, &mut pcg);
            let other = estimate(&changed.scene, &changed.scene.build(Arity::Sixteen), &changed.x, &mut pcg);
            let limit = 4.5 * first.error().hypot(other.error()) + 1e-4 * first.mean();
            if !((first.mean() - other.mean()).abs() <= limit) {
                failed.push(format!("{} {name} from {x:?}: {} and {}", scene.name, first.mean(), other.mean()));
            }
        }
        failed
    });
    let failed = failed.concat();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// A light of one side is seen from the side that its winding says, and with another winding from the other.
#[test]
fn the_winding_says_which_side_is_lit() {
    let mut pcg = Pcg32::new(1, 52);
    let (mut front, mut back) = (0, 0);
    for number in 0..200 {
        let (mut scene, _) = scene(4 * number, 1);
        scene.meshes[0].two_sided = false;
        let mut other = scene.clone();
        other.meshes[0].indices[0].swap(1, 2);
        let mut both = scene.clone();
        both.meshes[0].two_sided = true;
        let x = ShadingPoint::volume(2.0 * Vec3::from(pcg.cube()) - 0.5);
        let [one, other, both] = [scene, other, both].map(|scene| scene.build(Arity::Sixteen));
        for _ in 0..20 {
            let Some(sample) = both.at(&x).sample(pcg.cube()) else { continue };
            let [b1, b2] = sample.hit().expect("a triangle").barycentrics;
            let here = one.at(&x).pdf(&sample.hit().expect("a triangle"));
            let there = other.at(&x).pdf(&Hit::new(sample.hit().expect("a triangle").triangle, [b2, b1]));
            assert!((here > 0.0) != (there > 0.0), "{here} {there} at {sample:?} from {x:?}");
            if here > 0.0 { front += 1 } else { back += 1 }
        }
    }
    assert!(front > 500 && back > 500, "{front} in front, {back} behind");
}
