use core::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;

use super::*;

/// A file of this version, tilt, header, angles and values.
fn file(version: &str, tilt: &str, factors: [&str; 3], horizontal: &str, values: &str) -> String {
    let [multiplier, ballast, other] = factors;
    let count = horizontal.split(' ').count();
    format!(
        "{version}\n[TEST] none\nTILT={tilt}\n1 -1 {multiplier} 2 {count} 1 2 0 0 0\n{ballast} {other} 20\n0 90\n\
         {horizontal}\n{values}\n"
    )
}

fn table(text: &str) -> Luminaire {
    read(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Candelas in a direction of the file: degrees of both angles.
fn candelas(luminaire: &Luminaire, vertical: f32, horizontal: f32) -> f32 {
    let Luminaire { vertical: rows, horizontal: columns, intensities, .. } = luminaire;
    let profile = fanlight::Profile { vertical: rows, horizontal: columns, intensities };
    // The other way around the axis.
    profile.intensity([vertical.to_radians().into(), (-horizontal).to_radians().into()])
}

fn assert_candelas(luminaire: &Luminaire, values: &[[f32; 3]]) {
    for &[vertical, horizontal, expected] in values {
        let found = candelas(luminaire, vertical, horizontal);
        assert!((found - expected).abs() < 1e-3 * expected + 1e-3, "{vertical} {horizontal}: {found}, not {expected}");
    }
}

#[test]
fn the_sample_has_its_numbers() {
    let luminaire = table(include_str!("sample.ies"));
    assert_eq!(luminaire.vertical.len(), 5);
    assert_eq!(luminaire.horizontal.len(), 8);
    assert!((luminaire.vertical[4] - FRAC_PI_2).abs() < 1e-6 && (luminaire.horizontal[1] - FRAC_PI_4).abs() < 1e-6);
    // A multiplier of 2 and a ballast factor of a half; what follows is no factor in 2002. All quadrants are alike.
    for horizontal in [45.0, 135.0, 225.0, 315.0] {
        assert_candelas(&luminaire, &[[0.0, horizontal, 100.0], [45.0, horizontal, 160.0], [67.5, horizontal, 80.0]]);
    }
    assert_candelas(&luminaire, &[[45.0, 90.0, 200.0], [45.0, 270.0, 200.0], [45.0, 0.0, 120.0], [45.0, 180.0, 120.0]]);
    // Between the angles it is linear, and above the horizon zero.
    assert_candelas(&luminaire, &[[45.0, 22.5, 140.0], [33.75, 0.0, 115.0], [90.0, 10.0, 0.0], [120.0, 0.0, 0.0]]);
    // It is a profile that a sampler accepts.
    let Luminaire { vertical, horizontal, intensities, .. } = &luminaire;
    let profile = fanlight::Profile { vertical, horizontal, intensities };
    fanlight::LightSampler::builder().add_profile(&profile).expect("a valid profile");
}

#[test]
fn factors_are_those_of_the_version() {
    let scaled = |version, factors| candelas(&table(&file(version, "NONE", factors, "0", "10 10")), 30.0, 0.0);
    for old in ["IESNA91", "IESNA:LM-63-1995", "No version"] {
        assert_eq!(scaled(old, ["3", "0.5", "0.2"]), 3.0, "{old}");
    }
    for new in ["IESNA:LM-63-2002", "IES:LM-63-2019"] {
        // In 2019 this is the way in which the file was made.
        assert_eq!(scaled(new, ["3", "0.5", "1.10000"]), 15.0, "{new}");
    }
}

#[test]
fn what_is_symmetric_is_completed() {
    let of = |horizontal, values| table(&file("IESNA:LM-63-2002", "NONE", ["1", "1", "1"], horizontal, values));
    assert_candelas(&of("0", "8 0"), &[[0.0, 17.0, 8.0], [45.0, 200.0, 4.0]]);
    let half = of("0 90 180", "9 1 9 2 9 3");
    assert_candelas(&half, &[[90.0, 0.0, 1.0], [90.0, 90.0, 2.0], [90.0, 270.0, 2.0], [90.0, 180.0, 3.0]]);
    assert_candelas(&half, &[[90.0, 135.0, 2.5], [90.0, 225.0, 2.5]]);
    let other_half = of("90 180 270", "9 1 9 2 9 3");
    assert_candelas(&other_half, &[[90.0, 90.0, 1.0], [90.0, 180.0, 2.0], [90.0, 0.0, 2.0], [90.0, 270.0, 3.0]]);
    // All around, with the first angle once more at the end or without: counter-clockwise from above.
    for (horizontal, values) in [("0 90 180 270 360", "9 1 9 2 9 3 9 4 9 1"), ("0 90 180 270", "9 1 9 2 9 3 9 4")] {
        let whole = of(horizontal, values);
        assert_eq!(whole.horizontal.len(), 4);
        assert_candelas(&whole, &[[90.0, 0.0, 1.0], [90.0, 90.0, 2.0], [90.0, 180.0, 3.0], [90.0, 270.0, 4.0]]);
        // As a profile, a right horizontal angle is at the other side: 4 candelas.
        assert_eq!(whole.intensities[4..], [1.0, 4.0, 3.0, 2.0]);
    }
}

#[test]
fn tilts_are_read_over() {
    let text = file("IESNA:LM-63-2002", "INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8", ["1", "1", "1"], "0", "8 2");
    assert_candelas(&table(&text), &[[0.0, 0.0, 8.0], [90.0, 0.0, 2.0]]);
    let text = file("IESNA:LM-63-2002", "lamp.tlt", ["1", "1", "1"], "0", "8 2");
    assert_candelas(&table(&text), &[[90.0, 0.0, 2.0]]);
}

#[test]
fn what_is_wrong_is_named() {
    let good = file("IESNA:LM-63-2002", "NONE", ["1", "1", "1"], "0 90", "9 1 9 2");
    let refuse = |text: &str, part: &str| {
        let error = read(text).expect_err(part).to_string();
        assert!(error.contains(part), "{error} lacks {part}");
    };
    refuse("", "TILT=");
    refuse(&good.replace("TILT=NONE", ""), "TILT=");
    refuse(&good.replace(" 2 2 1 2 ", " 2 2 4 2 "), "type 4");
    refuse(&good.replace(" 2 2 1 2 ", " 1 2 1 2 "), "number of vertical angles is 1");
    refuse(&good.replace(" 2 2 1 2 ", " 2 2.5 1 2 "), "number of horizontal angles is 2.5");
    refuse(&good.replace("9 1 9 2", "9 1 9"), "ends before a candela value");
    refuse(&good.replace("9 1 9 2", "9 1 x 2"), "`x`");
    refuse(&good.replace("9 1 9 2", "9 -1 9 2"), "candela value 1 is -1");
    refuse(&good.replace("\n0 90\n0 90\n", "\n0 90\n90 0\n"), "horizontal angle 1 is 0");
    refuse(&good.replace("\n0 90\n0 90\n", "\n0 200\n0 90\n"), "vertical angle 1 is 200");
    refuse(&good.replace("\n0 90\n0 90\n", "\n0 90\n10 70\n"), "from 10 to 70");
    refuse(&good.replace("1 -1 1 2", "1 -1 inf 2"), "multiplied by inf");
}

/// The lamp of a type in the frame of type C: its aim, its right and what is above it.
struct Pose {
    code: usize,
    aim: Vec3,
    right: Vec3,
    up: Vec3,
}

const A: Pose = Pose { code: 3, aim: Vec3::NEG_X, right: Vec3::Y, up: Vec3::Z };
const B: Pose = Pose { code: 2, aim: Vec3::Y, right: Vec3::Z, up: Vec3::NEG_X };

impl Pose {
    /// The direction of a vertical and a horizontal angle in degrees.
    fn direction(&self, [vertical, horizontal]: [f32; 2]) -> Vec3 {
        let [(sin_v, cos_v), (sin_h, cos_h)] = [vertical, horizontal].map(|angle| angle.to_radians().sin_cos());
        // Longitudes are horizontal angles in type A, and vertical ones in type B.
        if self.code == A.code {
            cos_v * (cos_h * self.aim + sin_h * self.right) + sin_v * self.up
        } else {
            cos_h * (cos_v * self.aim + sin_v * self.up) + sin_h * self.right
        }
    }

    /// A table of this type.
    fn table(&self, vertical: &[f32], horizontal: &[f32], value: impl Fn([f32; 2]) -> f32) -> Luminaire {
        table(&file_of(self.code, vertical, horizontal, value))
    }
}

/// A file of a type, with a value for each vertical and horizontal angle.
fn file_of(code: usize, vertical: &[f32], horizontal: &[f32], value: impl Fn([f32; 2]) -> f32) -> String {
    let list = |values: &[f32]| values.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    let of_column = |h: &f32| list(&vertical.iter().map(|v| value([*v, *h])).collect::<Vec<_>>());
    let values = horizontal.iter().map(of_column).collect::<Vec<_>>().join("\n");
    format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} {} {code} 2 0 0 0\n1 1 20\n{}\n{}\n{values}\n",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal)
    )
}

/// Candelas in a direction of the frame of type C, of which x is horizontal angle 0 and z is up.
fn towards(luminaire: &Luminaire, direction: Vec3) -> f32 {
    let horizontal = direction.y.atan2(direction.x);
    candelas(luminaire, (-direction.z).clamp(-1.0, 1.0).acos().to_degrees(), horizontal.to_degrees())
}

/// Angles between two limits.
fn steps(from: f32, to: f32, step: f32) -> Vec<f32> {
    (0..=((to - from) / step) as usize).map(|at| from + at as f32 * step).collect()
}

#[test]
fn the_front_is_isotropic() {
    for pose in [A, B] {
        for angles in [&[-90.0, -20.0, 90.0][..], &[0.0, 90.0]] {
            // Vertical angles from 0 on are mirrored in type B alone.
            let luminaire = pose.table(if pose.code == A.code { &[-90.0, 90.0] } else { angles }, angles, |_| 7.0);
            for v in steps(-89.0, 89.0, 8.9) {
                for h in steps(-89.0, 89.0, 8.9) {
                    let direction = pose.direction([v, h]);
                    assert!((towards(&luminaire, direction) - 7.0).abs() < 1e-4, "{} {v} {h}", pose.code);
                    assert_eq!(towards(&luminaire, -direction), 0.0, "{} {v} {h}", pose.code);
                }
            }
        }
    }
}

#[test]
fn bright_entries_are_where_they_belong() {
    let [all, half] = [steps(-90.0, 90.0, 15.0), steps(0.0, 90.0, 15.0)];
    let bright = |angles: [f32; 2]| if angles == [30.0, 45.0] { 5.0 } else { 0.0 };
    for (pose, vertical, horizontal, copies) in [
        (A, &all, &all, &[[1.0, 1.0]][..]),
        (B, &all, &all, &[[1.0, 1.0]]),
        (A, &all, &half, &[[1.0, 1.0], [1.0, -1.0]]),
        (B, &all, &half, &[[1.0, 1.0], [1.0, -1.0]]),
        (B, &half, &all, &[[1.0, 1.0], [-1.0, 1.0]]),
        (B, &half, &half, &[[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]),
        // Type A has no mirrored vertical angles.
        (A, &half, &half, &[[1.0, 1.0], [1.0, -1.0]]),
    ] {
        let luminaire = pose.table(vertical, horizontal, bright);
        for v in &all {
            for h in &all {
                let is_copy = copies.iter().any(|[a, b]| [a * v, b * h] == [30.0, 45.0]);
                let found = towards(&luminaire, pose.direction([*v, *h]));
                assert!((found - if is_copy { 5.0 } else { 0.0 }).abs() < 1e-3, "{} {v} {h}: {found}", pose.code);
            }
        }
    }
}

/// A lopsided lobe, by type A and B, and by type C around its axis.
#[test]
fn types_agree() {
    let all = steps(-90.0, 90.0, 2.5);
    for pose in [A, B] {
        let lobe = |direction: Vec3| {
            let [aim, right, up] = [pose.aim, pose.right, pose.up].map(|axis| axis.dot(direction));
            100.0 * aim.max(0.0).powi(3) * (1.0 + 0.5 * right + 0.3 * up)
        };
        let luminaire = pose.table(&all, &all, |angles| lobe(pose.direction(angles)));
        // Directions of type C.
        let of_c = |[v, h]: [f32; 2]| {
            let [(sin_v, cos_v), (sin_h, cos_h)] = [v, h].map(|angle| angle.to_radians().sin_cos());
            Vec3::new(sin_v * cos_h, sin_v * sin_h, -cos_v)
        };
        let (vertical, horizontal) = (steps(0.0, 180.0, 2.0), steps(0.0, 360.0, 2.0));
        let same = table(&file_of(1, &vertical, &horizontal, |angles| lobe(of_c(angles))));
        for v in steps(1.0, 179.0, 7.3) {
            for h in steps(0.0, 359.0, 7.3) {
                let found = [&luminaire, &same].map(|luminaire| towards(luminaire, of_c([v, h])));
                // Interpolation between these angles errs by about a thousandth of the peak.
                assert!((found[0] - found[1]).abs() < 0.15, "{} {v} {h}: {found:?}", pose.code);
            }
        }
    }
}

/// Candelas in a direction of the frame in which both angles 0 are along -z.
fn towards_in_frame(luminaire: &Luminaire, direction: Vec3) -> f32 {
    let [axis, zero] = luminaire.frame;
    let horizontal = direction.dot(axis.cross(zero)).atan2(direction.dot(zero));
    // The other way around the axis in files.
    candelas(luminaire, axis.dot(direction).clamp(-1.0, 1.0).acos().to_degrees(), -horizontal.to_degrees())
}

/// What the types call right of the aim and above it is the same side of it.
#[test]
fn frames_agree() {
    let (aim, right, up) = (Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X);
    let all = steps(-90.0, 90.0, 5.0);
    // In type C, the vertical angle is away from the aim, at first towards what is above, and then counter-clockwise.
    let wide = |[v, h]: [f32; 2]| {
        let [(sin_v, cos_v), (sin_h, cos_h)] = [v, h].map(|angle| angle.to_radians().sin_cos());
        cos_v * aim + sin_v * (cos_h * up - sin_h * right)
    };
    let lobe = |direction: Vec3| {
        100.0 * aim.dot(direction).max(0.0).powi(3) * (1.0 + 0.5 * right.dot(direction) + 0.3 * up.dot(direction))
    };
    let of_c = table(&file_of(1, &steps(0.0, 180.0, 5.0), &steps(0.0, 360.0, 5.0), |angles| lobe(wide(angles))));
    for code in [A.code, B.code] {
        let pose = Pose { code, aim, right, up };
        let luminaire = pose.table(&all, &all, |angles| lobe(pose.direction(angles)));
        for v in steps(1.0, 179.0, 7.3) {
            for h in steps(0.0, 359.0, 7.3) {
                let direction = wide([v, h]);
                let found = [&luminaire, &of_c].map(|luminaire| towards_in_frame(luminaire, direction));
                // Interpolation between these angles errs by a few thousandths of the peak.
                assert!((found[0] - found[1]).abs() < 0.6, "{code} {v} {h}: {found:?}");
            }
        }
    }
}

/// Measured from -40 to 40 degrees, a lamp is dark beyond.
#[test]
fn what_was_not_measured_is_dark() {
    for pose in [A, B] {
        let luminaire = pose.table(&[-20.0, 20.0], &[-40.0, 40.0], |_| 3.0);
        for angles in [[0.0, 0.0], [19.9, 39.9], [-19.9, -39.9]] {
            assert!((towards(&luminaire, pose.direction(angles)) - 3.0).abs() < 1e-3, "{} {angles:?}", pose.code);
        }
        for angles in [[20.1, 0.0], [-20.1, 0.0], [0.0, 40.1], [0.0, -40.1], [0.0, 180.0]] {
            assert_eq!(towards(&luminaire, pose.direction(angles)), 0.0, "{} {angles:?}", pose.code);
        }
        let Luminaire { vertical, horizontal, intensities, .. } = &luminaire;
        let profile = fanlight::Profile { vertical, horizontal, intensities };
        fanlight::LightSampler::builder().add_profile(&profile).expect("a valid profile");
    }
}

#[test]
fn wrong_angles_are_named() {
    for code in [A.code, B.code] {
        for (vertical, horizontal, part) in [
            (&[-90.0, 90.0], &[0.0, 100.0][..], "horizontal angle 1 is 100"),
            (&[-91.0, 90.0], &[0.0, 90.0], "vertical angle 0 is -91"),
            (&[30.0, 30.0], &[0.0, 90.0], "vertical angle 1 is 30"),
            (&[-90.0, 90.0], &[0.0, 60.0, 50.0], "horizontal angle 2 is 50"),
            (&[-90.0, 90.0], &[0.0], "number of horizontal angles is 1"),
        ] {
            let error = read(&file_of(code, vertical, horizontal, |_| 1.0)).expect_err(part).to_string();
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
    // Negative ones are of these types only.
    let error = read(&file_of(1, &[-90.0, 90.0], &[0.0], |_| 1.0)).expect_err("type C").to_string();
    assert!(error.contains("vertical angle 0 is -90"), "{error}");
}
