//! What changes what moves, and what refuses it: bytes, refits, groups, triangles that have no area at some time,
//! errors.

use super::{Case, close};
use crate::common::lights::{ARITIES, aligned};
use crate::common::parallel;
use crate::common::pcg::Pcg32;
use crate::common::scene::random_point;
use crate::common::tier::tier;
use crate::instances::check_agreement;
use fanlight::{
    Instance, InstanceId, LightSampler, LightSamplerView, Mesh, MeshId, MeshUpdate, ShadingPoint, Sides, TriangleId,
};
use glam::{Affine3A, Vec3};

/// A sampler comes back from its bytes, and what is changed in them is found or does no harm.
#[test]
fn bytes_hold_motion() {
    let (case, mut pcg) = Case::new(10, 311, 1, None);
    let lights = case.build();
    let words = aligned(&lights.to_bytes());
    let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    assert_eq!((view.light_count(), view.bytes()), (lights.light_count(), lights.bytes()));
    for kind in 0..20 {
        let (x, u) = (case.point(&mut pcg, kind).at_time(pcg.f32()), pcg.cube());
        assert_eq!(view.at(&x).sample(u), lights.at(&x).sample(u));
    }
    // The section of what few scenes have, where the ends are.
    let table = |i: usize| [words[6 + 4 * i], words[8 + 4 * i]];
    let sections = words[4] as usize;
    let tag = u32::from_ne_bytes(*b"XTRA");
    let own = (0..sections).position(|i| table(i)[0] == tag).expect("there is such a section");
    let start = 6 + 4 * sections + (0..own).map(|i| table(i)[1] as usize / 4).sum::<usize>();
    let length = table(own)[1] as usize / 4;
    let (mut refused, mut accepted) = (0, 0);
    for i in 0..tier().inputs {
        let mut changed = words.clone();
        let at = if i % 2 == 0 { start + pcg.below(length) } else { pcg.below(words.len()) };
        changed[at] = [pcg.u32(), u32::MAX, 0, changed[at] ^ 1 << pcg.below(32), 0x7fc0_0000][pcg.below(5)];
        match LightSamplerView::from_bytes(bytemuck::cast_slice(&changed)) {
            Err(_) => refused += 1,
            Ok(view) => {
                accepted += 1;
                let x = case.point(&mut pcg, accepted).at_time(pcg.f32());
                let at = view.at(&x);
                if let Some(sample) = at.sample(pcg.cube()) {
                    assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && at.pdf_sample_direction(&sample).is_finite());
                }
                let _ = view.emission().at_time(x.time()).sample([0.5; 5]);
            }
        }
    }
    assert!(refused > 30 && accepted > 100, "{refused} refused, {accepted} accepted");
}

/// What stood still moves after a refit, and the other way round, by the densities of a new build's lights.
#[test]
fn refits_change_what_moves() {
    parallel::map(10, |number| {
        let (case, mut pcg) = Case::new(number, 312, number % 3, None);
        let (moving, still) = (&case.moving, &case.moving.start);
        let mut lights = case.build();
        let bytes = lights.to_bytes();
        let meshes = |moves: bool| {
            let update = |i: usize| {
                let update = MeshUpdate::new(MeshId::from_index(i as u32));
                let (start, end) = (&still.base.meshes[i], &moving.end.base.meshes[i]);
                if moves {
                    update.moving(&start.positions, &end.positions, &start.indices)
                } else {
                    update.moved(&start.positions, &start.indices)
                }
            };
            (0..still.base.meshes.len()).map(update).collect::<Vec<_>>()
        };
        let instances = |moves: bool| {
            let instance = |i| if moves { moving.instance(i) } else { still.instance(i) };
            (0..still.instances.len()).map(|i| (InstanceId::from_index(i as u32), instance(i))).collect::<Vec<_>>()
        };
        lights.refit(&meshes(true)).expect("nothing has changed");
        lights.refit_instances(&instances(true)).expect("nothing has changed");
        assert_eq!(lights.to_bytes(), bytes, "a refit with nothing changed");

        lights.refit_instances(&instances(false)).expect("valid instances");
        lights.refit(&meshes(false)).expect("valid meshes");
        for kind in 0..4 {
            let (x, u) = (case.point(&mut pcg, kind), pcg.cube());
            assert_eq!(lights.at(&x.at_time(1.0)).sample(u), lights.at(&x.at_time(0.0)).sample(u));
            check_agreement(&lights.as_view(), &x, &mut pcg, 5);
        }
        // Nothing is left of what moved, but for a triangle that has an area only while it moves.
        let expected = still.build(ARITIES[number % 3]);
        let more = lights.light_count() - expected.light_count();
        assert_eq!(lights.bytes().lights, expected.bytes().lights + 48 * more);

        lights.refit(&meshes(true)).expect("valid meshes");
        lights.refit_instances(&instances(true)).expect("valid instances");
        assert_eq!(lights.to_bytes(), bytes, "a refit there and back");
    });
}

/// A triangle that is nothing but a line at some times: it sends nothing then, and something before and after.
#[test]
fn a_triangle_without_an_area_sends_nothing_at_that_time() {
    let start = [Vec3::ZERO, Vec3::Y, Vec3::X].map(|p| p + Vec3::Z);
    // The third vertex crosses the edge of the others: the triangle turns its other side.
    let end = [start[0], start[1], start[2] - 2.0 * Vec3::X];
    let mut builder = LightSampler::builder();
    builder.add_mesh(&Mesh::emitter(&start, &[[0, 1, 2]]).moving_to(&end)).expect("a valid mesh");
    // No area at the start.
    let line = [start[0], start[1], start[1]];
    builder.add_mesh(&Mesh::emitter(&line, &[[0, 1, 2]]).moving_to(&start)).expect("a valid mesh");
    let lights = builder.build().expect("few lights");
    assert_eq!(lights.light_count(), 2);
    let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z);
    let count = |time: f32, x: ShadingPoint, mesh: u32| {
        let at = lights.at(&x.at_time(time));
        let drawn = (0..200).filter_map(|i| at.sample([(i as f32 + 0.5) / 200.0, 0.3, 0.4]));
        let id = TriangleId::new(MeshId::from_index(mesh), 0);
        drawn.filter(|sample| sample.hit().is_some_and(|hit| hit.triangle == id)).count()
    };
    assert!(count(0.0, x, 0) > 0 && count(0.3, x, 0) > 0 && count(0.3, x, 1) > 0);
    assert_eq!([count(0.5, x, 0), count(0.7, x, 0), count(0.0, x, 1)], [0; 3]);
    let above = ShadingPoint::surface(2.0 * Vec3::Z, Vec3::NEG_Z);
    assert!(count(0.7, above, 0) > 0);
    assert_eq!([count(0.3, above, 0), count(0.5, above, 0)], [0; 2]);
    assert!(lights.emission().at_time(0.5).sample([0.3; 5]).is_none_or(|ray| ray.pdf > 0.0));
}

/// A light that moves is in its groups at all times.
#[test]
fn groups_hold_for_what_moves() {
    let start = [Vec3::ZERO, Vec3::Y, Vec3::X].map(|p| p + Vec3::Z);
    let end = start.map(|p| p + Vec3::X);
    let mut builder = LightSampler::builder();
    let mesh = Mesh::emitter(&start, &[[0, 1, 2]]);
    builder.add_mesh(&mesh.moving_to(&end).groups(2)).expect("a valid mesh");
    let object = builder.add_object(&[mesh]).expect("a valid object");
    let lamp = Instance::new(object, Affine3A::IDENTITY).moving_to(Affine3A::from_translation(Vec3::Y)).groups(1);
    builder.add_instance(lamp).expect("a valid instance");
    let lights = builder.build().expect("few lights");
    for (groups, of_instance) in [(1, true), (2, false)] {
        for time in [0.0, 0.6, 1.0] {
            let x = ShadingPoint::surface(Vec3::ZERO, Vec3::Z).with_groups(groups).at_time(time);
            let at = lights.at(&x);
            for i in 0..20 {
                let sample = at.sample([i as f32 / 20.0, 0.3, 0.6]).expect("one is received");
                let hit = sample.hit().expect("a triangle");
                assert_eq!(hit.instance.is_some(), of_instance, "{x:?} {sample:?}");
                assert!(close(at.pdf(&hit), sample.pdf) && close(at.pdf_direction(sample.direction), sample.pdf));
            }
        }
    }
}

fn message(result: Result<impl core::fmt::Debug, fanlight::Error>) -> String {
    result.expect_err("it is refused").to_string()
}

#[test]
fn errors_name_what_cannot_move() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh::emitter(&positions, &[[0, 1, 2]]);
    let mut builder = LightSampler::builder();
    assert_eq!(
        message(builder.add_mesh(&mesh.moving_to(&positions[..2]))),
        "mesh 0: 2 vertices at the end of the shutter interval, but 3 at its start"
    );
    let far = [Vec3::ZERO, Vec3::splat(2e9), Vec3::Y];
    let text = message(builder.add_mesh(&mesh.moving_to(&far)));
    assert!(text.starts_with("mesh 0: vertex 1") && text.contains("2000000000"), "{text}");
    assert_eq!(
        message(builder.add_object(&[mesh, mesh.moving_to(&positions)])),
        "object 0: the vertices of mesh 1 move, but only the object's instances can"
    );
    let object = builder.add_object(&[mesh]).expect("a valid object");
    let still = Instance::new(object, Affine3A::IDENTITY);
    let cases = [
        (Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)), "cannot be inverted is 0.5"),
        (Affine3A::from_rotation_x(core::f32::consts::PI), "cannot be inverted is 0.5"),
        (Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0)), "condition number of the transform"),
        (Affine3A::from_scale(Vec3::new(1.0, -3.0, 1.0)), "cannot be inverted is 0.25"),
        (Affine3A::from_translation(Vec3::splat(2e9)), "largest coordinate is 2000000000"),
        (Affine3A::from_translation(Vec3::NAN), "NaN"),
    ];
    for (end, part) in cases {
        let text = message(builder.add_instance(still.moving_to(end)));
        assert!(text.starts_with("instance 0: ") && text.contains(part), "{text}: {part}");
    }
    // Nearly half a turn, and from small to large, are fine.
    builder.add_instance(still.moving_to(Affine3A::from_rotation_x(3.1))).expect("it can be inverted");
    builder.add_instance(still.moving_to(Affine3A::from_scale(Vec3::splat(1e3)))).expect("it can be inverted");
    let id = builder.add_mesh(&mesh).expect("a valid mesh");
    let mut lights = builder.build().expect("few lights");
    let bytes = lights.to_bytes();
    let text = message(lights.refit(&[MeshUpdate::new(id).moving(&positions, &positions[..1], &[[0, 1, 2]])]));
    assert!(text.starts_with("mesh 0: 1 vertices at the end"), "{text}");
    let mirrored = still.moving_to(Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    assert!(message(lights.refit_instances(&[(InstanceId::from_index(0), mirrored)])).contains("inverted is 0.5"));
    assert_eq!(lights.to_bytes(), bytes, "an error changes nothing");
}

/// A triangle of two sides that may move.
fn lamp<'a>(positions: &'a [Vec3; 3], end: Option<&'a [Vec3; 3]>) -> Mesh<'a> {
    let mesh = Mesh::emitter(positions, &[[0, 1, 2]]).sides(Sides::Two);
    end.map_or(mesh, |end| mesh.moving_to(end))
}

/// Edits that take away, add, begin, change and end motion leave the lights of a new build, at all times.
#[test]
fn edits_move_what_they_are_told_to() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let place = |x: f32| corners.map(|corner| corner + Vec3::new(x, 0.3 * x, 2.0));
    let places = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0].map(place);
    let shift = |x: f32| Affine3A::from_translation(Vec3::new(x, -1.0, 1.0));
    let instance = |object, [start, end]: [f32; 2]| Instance::new(object, shift(start)).moving_to(shift(end));
    // Start and end of each light.
    let build = |meshes: &[[usize; 2]], instances: &[[f32; 2]]| {
        let mut builder = LightSampler::builder();
        let object = builder.add_object(&[lamp(&corners, None)]).expect("a valid object");
        for &[start, end] in meshes {
            builder.add_mesh(&lamp(&places[start], Some(&places[end]))).expect("a valid mesh");
        }
        for ends in instances {
            builder.add_instance(instance(object, *ends)).expect("a valid instance");
        }
        (builder.build().expect("few lights"), object)
    };
    let (mut edited, object) = build(&[[0, 1], [2, 2], [3, 4], [5, 5]], &[[0.0, 1.0], [2.0, 2.0], [-1.0, 0.5]]);
    let (fresh, _) = build(&[[3, 3], [2, 5], [1, 0], [5, 5]], &[[0.5, 0.5], [2.0, -2.0], [-1.0, 1.5]]);
    let (mesh, number) = (MeshId::from_index, InstanceId::from_index);
    let mut edits = edited.edit();
    edits.remove_mesh(mesh(0)).expect("it is there");
    edits.add_mesh(&lamp(&places[1], Some(&places[0]))).expect("a valid mesh");
    edits.update_mesh(&MeshUpdate::new(mesh(1)).moving(&places[2], &places[5], &[[0, 1, 2]])).expect("it begins");
    edits.update_mesh(&MeshUpdate::new(mesh(2)).moved(&places[3], &[[0, 1, 2]])).expect("it ends");
    edits.update_mesh(&MeshUpdate::new(mesh(2)).scaled(1.0)).expect("its motion has ended before");
    edits.remove_instance(number(0)).expect("it is there");
    edits.set_instance(number(1), instance(object, [2.0, -2.0])).expect("it begins");
    edits.set_instance(number(2), instance(object, [-1.0, 1.5])).expect("it changes");
    edits.add_instance(instance(object, [0.5, 0.5])).expect("a valid instance");
    edits.apply().expect("a valid batch");
    let words = aligned(&edited.to_bytes());
    let loaded = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    let mut pcg = Pcg32::new(17, 313);
    for kind in 0..24 {
        let x = random_point(&mut pcg, kind).at_time(kind as f32 / 23.0);
        check_agreement(&loaded, &x, &mut pcg, 50);
        let [a, b] = [&loaded, &fresh.as_view()].map(|lights| {
            let at = lights.at(&x);
            super::estimate(&at, &mut pcg, 4000, |sample| f64::from(x.cosine(sample.direction)))
        });
        // Two-sided, 1e-6 by the normal distribution.
        let limit = 4.9 * (a.error() + b.error()) + 1e-6;
        assert!((a.mean() - b.mean()).abs() <= limit, "{x:?}: {} and {}", a.mean(), b.mean());
    }
    // What no longer moves takes no memory: the ends of two triangles and two transforms.
    let before = edited.bytes().lights;
    let mut edits = edited.edit();
    for i in [1, 4] {
        edits.remove_mesh(mesh(i)).expect("it is there");
    }
    for i in [1, 2] {
        edits.remove_instance(number(i)).expect("it is there");
    }
    edits.apply().expect("a valid batch");
    assert_eq!(edited.light_count(), 3);
    let ends = 2 * (size_of::<[Vec3; 3]>() + size_of::<[Vec3; 4]>());
    assert!(edited.bytes().lights + ends <= before, "{} bytes, and {before} before", edited.bytes().lights);
}

/// What is wrong with the motion in an edit is an error, and changes nothing.
#[test]
fn impossible_motion_is_refused_in_edits() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut builder = LightSampler::builder();
    let object = builder.add_object(&[lamp(&corners, None)]).expect("a valid object");
    builder.add_mesh(&lamp(&corners, None)).expect("a valid mesh");
    builder.add_instance(Instance::new(object, Affine3A::IDENTITY)).expect("a valid instance");
    let mut lights = builder.build().expect("few lights");
    drop(lights.edit());
    let bytes = lights.to_bytes();
    let mirrored = Instance::new(object, Affine3A::IDENTITY).moving_to(Affine3A::from_scale(-Vec3::ONE));
    let far = corners.map(|corner| corner + Vec3::splat(2e9));
    let mut edits = lights.edit();
    let update = MeshUpdate::new(MeshId::from_index(0));
    for (text, part) in [
        (message(edits.add_instance(mirrored)), "time at which the transform cannot be inverted"),
        (message(edits.set_instance(InstanceId::from_index(0), mirrored)), "instance 0"),
        (message(edits.add_mesh(&lamp(&corners, Some(&far)))), "must be finite and within 1e9"),
        (message(edits.update_mesh(&update.moving(&corners, &corners[..2], &[[0, 1, 2]]))), "2 vertices at the end"),
    ] {
        assert!(text.contains(part), "{text}");
    }
    edits.apply().expect("an empty batch");
    assert!(lights.to_bytes() == bytes, "an error changes something");
}

/// A mesh without triangles is at the place of the next one, whose motion it must leave alone.
#[test]
fn edits_of_meshes_without_triangles_move_nothing() {
    let place = |x: f32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|corner| corner + Vec3::new(x, 0.0, 2.0));
    let places = [0.0, 4.0, 8.0, 12.0].map(place);
    let nothing = Mesh::emitter(&[], &[]);
    let mesh = MeshId::from_index;
    let mut builder = LightSampler::builder();
    for added in [lamp(&places[0], None), nothing, lamp(&places[1], None)] {
        builder.add_mesh(&added).expect("a valid mesh");
    }
    let mut lights = builder.build().expect("few lights");
    let x = ShadingPoint::volume(Vec3::ZERO).at_time(1.0);
    let positions = |lights: &LightSampler| {
        let at = lights.at(&x);
        (0..64_u8).filter_map(|i| at.sample([f32::from(i) / 64.0, 0.3, 0.6])).map(|s| s.position.x).collect::<Vec<_>>()
    };
    let mut edits = lights.edit();
    edits.update_mesh(&MeshUpdate::new(mesh(2)).moving(&places[1], &places[2], &[[0, 1, 2]])).expect("it begins");
    edits.apply().expect("a valid batch");
    let mut edits = lights.edit();
    edits.update_mesh(&MeshUpdate::new(mesh(1)).moved(&[], &[])).expect("it has no triangles");
    edits.remove_mesh(mesh(0)).expect("it is there");
    edits.apply().expect("a valid batch");
    let found = positions(&lights);
    assert!(found.len() > 50 && found.iter().all(|x| (8.0..=9.0).contains(x)), "{found:?}");
    let mut edits = lights.edit();
    edits.remove_mesh(mesh(1)).expect("it is there");
    edits.apply().expect("a valid batch");
    let mut edits = lights.edit();
    assert_eq!(edits.add_mesh(&nothing), Ok(mesh(1)));
    assert_eq!(edits.add_mesh(&lamp(&places[0], Some(&places[3]))), Ok(mesh(0)));
    edits.apply().expect("a valid batch");
    let found = positions(&lights);
    let [near, far] = [8.0..=9.0, 12.0..=13.0].map(|place| found.iter().filter(|x| place.contains(*x)).count());
    assert!(near > 20 && far > 5 && near + far == found.len(), "{found:?}");
}
