use core::f32::consts::{FRAC_PI_2, FRAC_PI_4};

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
    let Luminaire { vertical: rows, horizontal: columns, intensities } = luminaire;
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
    let Luminaire { vertical, horizontal, intensities } = &luminaire;
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
    refuse(&good.replace(" 2 2 1 2 ", " 2 2 2 2 "), "type B");
    refuse(&good.replace(" 2 2 1 2 ", " 2 2 3 2 "), "type A");
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
