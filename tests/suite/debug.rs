//! What `{:?}` shows of large types is short: counts and sizes, not contents.

use core::fmt::Debug;

use fanlight::{
    Environment, EnvironmentImage, Filter, Instance, InstanceId, LightId, LightSampler, Mesh, MeshId, MeshUpdate,
    PointLight, Profile, Projection, RaySegment, ShadingPoint, SphereLight, Texture, VisibilityLearner, Weight,
};
use glam::{Affine3A, Vec2, Vec3};

use crate::common::pcg::Pcg32;
use crate::common::scene::random_point;

/// Longest text of a value.
const LIMIT: usize = 2000;
/// Triangles of the mesh, which are far more than what a text of [`LIMIT`] characters can list.
const TRIANGLES: u32 = 1000;

#[track_caller]
fn assert_short(name: &str, value: &impl Debug) {
    let text = format!("{value:?}");
    assert!(text.len() <= LIMIT, "{name} is shown by {} characters: {}", text.len(), &text[..LIMIT]);
}

/// An image with suns among darker texels.
fn image() -> Vec<f32> {
    (0..128 * 64).map(|i| if i % 997 == 500 { 5e4 } else { 0.5 + (i % 7) as f32 }).collect()
}

#[test]
fn large_types_are_shown_shortly() {
    let (luminance, texels) = (image(), [0.5; 64 * 64]);
    let image = EnvironmentImage::lat_long(128, 64, &luminance).filter(Filter::Bilinear);
    assert_short("image of an environment", &image);
    let texture = Texture::new(64, 64, &texels).expect("the image is finite");
    assert_short("texture", &texture);
    let intensities = vec![1.0; 500];
    let angles: Vec<f32> = (0..500).map(|i| i as f32 * 0.006).collect();
    let profile = Profile { vertical: &angles, horizontal: &[0.0], intensities: &intensities };
    assert_short("profile", &profile);
    let projection =
        Projection { angles: [1.0, 1.0], size: [25, 20], intensities: &intensities, filter: Filter::Nearest };
    assert_short("projection", &projection);

    let corners = |i: u32| {
        let at = Vec3::new((i % 32) as f32, (i / 32) as f32, 2.0) / 32.0;
        [at, at + 0.02 * Vec3::X, at + 0.02 * Vec3::Y]
    };
    let positions: Vec<Vec3> = (0..TRIANGLES).flat_map(corners).collect();
    let indices: Vec<[u32; 3]> = (0..TRIANGLES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let uvs = vec![Vec2::splat(0.5); positions.len()];
    let mesh = Mesh::emitter(&positions, &indices).uvs(&uvs);
    assert_short("mesh", &mesh);

    let environment = Environment::new(&image).expect("the image is finite");
    let mut builder = LightSampler::builder().environment(environment).environment_as_light();
    let texture = builder.add_texture(texture);
    builder.add_profile(&profile).expect("the profile is valid");
    let kept = builder.add_mesh(&mesh.weight(Weight::Texture(texture))).expect("the mesh is valid");
    let opening = [Vec3::new(0.0, 0.0, 3.0), Vec3::new(1.0, 0.0, 3.0), Vec3::new(0.0, 1.0, 3.0)];
    builder.add_mesh(&Mesh::portal(&opening, &[[0, 2, 1]])).expect("the mesh is valid");
    let object = builder.add_object(&[mesh]).expect("the object is valid");
    for i in 0..100_u32 {
        builder.add_light(PointLight::new(Vec3::splat(i as f32), 1.0)).expect("the light is valid");
        let place = Affine3A::from_translation(Vec3::new(i as f32, 0.0, 0.0));
        builder.add_instance(Instance::new(object, place)).expect("the instance is valid");
    }
    assert_short("builder", &builder);
    let mut lights = builder.build().expect("the lights are valid");
    assert_short("sampler", &lights);

    edit(&mut lights, &mesh, kept);
    assert_short("edited sampler", &lights);
    assert_short("view", &lights.as_view());
    assert_short("environment", lights.environment());
    assert_short("rays of lights", &lights.emission());

    let mut learner = learner(&lights);
    assert_short("learner", &learner);
    assert_short("counters", &learner.counters());
    let visibility = learner.publish(&lights.as_view()).expect("the lights are those of the learner");
    assert_short("table", &visibility);
    let lights = lights.with_visibility(&visibility).expect("the lights are those of the table");
    assert_short("view with a table", &lights);
    let here = lights.at(&ShadingPoint::surface(Vec3::new(0.5, 0.5, 0.0), Vec3::Z));
    assert_short("new sampler of a point", &here);
    assert!(here.sample([0.5; 3]).is_some());
    assert_short("sampler of a point", &here);
    let ray = RaySegment::new(Vec3::ZERO, Vec3::X, 4.0, 0.1);
    assert_short("sampler of a segment", &lights.along(&ray));
}

/// Removes, moves and adds many lights, meshes and instances.
fn edit(lights: &mut LightSampler, mesh: &Mesh<'_>, kept: MeshId) {
    let mut edits = lights.edit();
    for i in 0..60 {
        edits.remove_light(LightId::from_index(i)).expect("there is such a light");
        edits.remove_instance(InstanceId::from_index(i)).expect("there is such an instance");
        edits.set_light(LightId::from_index(99 - i % 30), SphereLight::new(Vec3::Y, 0.1, 2.0)).expect("it is valid");
    }
    let added = edits.add_mesh(mesh).expect("the mesh is valid");
    assert_short("edits", &edits);
    edits.apply().expect("the edits are valid");
    let mut edits = lights.edit();
    edits.remove_mesh(added).expect("there is such a mesh");
    edits.update_mesh(&MeshUpdate::new(kept).scaled(2.0)).expect("the update is valid");
    edits.apply().expect("the edits are valid");
}

/// What is learned where half of everything is hidden.
fn learner(lights: &LightSampler) -> VisibilityLearner {
    let mut learner = VisibilityLearner::new(&lights.as_view());
    for pass in 0..3 {
        let mut counters = learner.counters();
        let mut pcg = Pcg32::new(pass, 17);
        for i in 0..5000 {
            let here = lights.at(&random_point(&mut pcg, i));
            if let Some(sample) = here.sample(pcg.cube()) {
                counters.report(&here, &sample, f32::from(u8::from(sample.position.x > 0.5)));
            }
        }
        assert_short("counters with reports", &counters);
        learner.merge(&counters).expect("the counters are the learner's");
        assert_short("learner with reports", &learner);
        learner.publish(&lights.as_view()).expect("the lights are those of the learner");
    }
    learner
}
