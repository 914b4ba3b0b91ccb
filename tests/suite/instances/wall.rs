//! Walls of windows that are instances: whether anything else may be met along a ray is known.

use crate::common::parallel;
use crate::common::pcg::Pcg32;
use fanlight::{Instance, LightSampler, LightSamplerBuilder, Mesh, ShadingPoint};
use glam::{Affine3A, Quat, Vec3};

/// Windows of a wall: more triangles than once were looked at.
const WINDOWS: u32 = 3_000;

fn wall() -> (LightSamplerBuilder<'static>, fanlight::ObjectId, Quat) {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y].map(|corner| corner - 0.5);
    let flat = corners.map(|corner| Vec3::new(corner.x, corner.y, 0.0));
    let mut builder = LightSampler::builder();
    let window = builder.add_object(&[Mesh::emitter(&flat, &[[0, 1, 2], [0, 2, 3]])]).expect("the window is sound");
    let turn = Quat::from_rotation_y(0.4);
    for i in 0..WINDOWS {
        let place = turn * Vec3::new((i % 60) as f32 * 1.25, (i / 60) as f32 * 1.5, 0.0);
        builder.add_instance(Instance::new(window, Affine3A::from_rotation_translation(turn, place))).expect("sound");
    }
    (builder, window, turn)
}

/// In a wall, the density of a sample's direction is the sample's; with a window in front of it, it need not be. The
/// density of the direction, which is looked for, is the same but for rounding.
#[test]
fn a_ray_meets_one_window_of_a_wall() {
    let found = parallel::map(2, |has_another| {
        let (mut builder, window, turn) = wall();
        if has_another == 1 {
            let place =
                Affine3A::from_scale_rotation_translation(Vec3::splat(60.0), turn, turn * Vec3::new(37.0, 37.0, 0.1));
            builder.add_instance(Instance::new(window, place)).expect("the place is sound");
        }
        let lights = builder.build().expect("the wall is small");
        let mut pcg = Pcg32::new(5, 401);
        let (mut drawn, mut more) = (0, 0);
        for _ in 0..40 {
            let position = turn * Vec3::new(pcg.within(0.0, 75.0), pcg.within(0.0, 75.0), pcg.within(0.5, 20.0));
            let at = lights.at(&ShadingPoint::surface(position, turn * Vec3::NEG_Z));
            for _ in 0..20 {
                let Some(sample) = at.sample(pcg.cube()) else { continue };
                let (own, all) = (at.pdf_sample_direction(&sample), at.pdf_direction(sample.direction));
                assert!((all - own).abs() <= 1e-4 * own, "{position} {sample:?}: {own} {all}");
                drawn += 1;
                more += usize::from(own.to_bits() != sample.pdf.to_bits());
            }
        }
        (drawn, more)
    });
    assert!(found[0].0 > 700 && found[0].1 == 0, "{found:?}");
    assert!(found[1].0 > 700 && found[1].1 > 300, "{found:?}");
}
