//! Luminaires from files of the format LM-63 (ANSI/IES LM-63-2002 and -2019, and those before), called `.ies`.
//!
//! A file holds a table of candelas by vertical and horizontal angle. Of photometry of type C, the usual one, the
//! vertical angle is 0 straight down and 180 degrees straight up, and horizontal angles grow counter-clockwise as seen
//! from above. Types A and B (automotive lamps and floodlights) have other angles, and are refused. Lumens, sizes and
//! powers are read over, and so is what a tilt of the lamp changes: the luminaire is in the position in which it was
//! measured.

use core::f32::consts::PI;

use crate::render::Error;

/// First lines of files up to 1995, in which a factor of the ballast stands where later ones have none.
const OLD: [&str; 3] = ["IESNA91", "IESNA:LM-63-1991", "IESNA:LM-63-1995"];
/// Numbers in front of the angles.
const HEADER: usize = 13;
/// Most angles of either kind.
const MOST_ANGLES: usize = 2048;

/// A table as `fanlight` has it: radians, all around the axis, counter-clockwise around a vertical angle 0 that looks
/// at the viewer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Luminaire {
    pub(crate) vertical: Vec<f32>,
    pub(crate) horizontal: Vec<f32>,
    /// Candelas: those of all horizontal angles for the first vertical one, then for the next.
    pub(crate) intensities: Vec<f32>,
}

/// Reads a file.
pub(crate) fn read(text: &str) -> Result<Luminaire, Error> {
    let first = text.lines().next().unwrap_or_default().trim();
    // The version of 1986 has no line of its own, and its factors are those of 1991.
    let is_old = !first.starts_with("IES") || OLD.contains(&first);
    let mut lines = text.lines();
    let tilt = lines.find_map(|line| line.trim().strip_prefix("TILT=")).ok_or("it has no line TILT=")?;
    let rest = lines.collect::<Vec<_>>().join("\n");
    let mut numbers = Numbers::new(&rest);
    if tilt.trim() == "INCLUDE" {
        numbers.take("lamp-to-luminaire geometry")?;
        let count = numbers.count("number of tilt angles")?;
        numbers.list("tilt angle or factor", 2 * count)?;
    }
    let header: Vec<f32> = numbers.list("number before the angles", HEADER)?;
    let (counts, kind) = ([count_of(header[3], "vertical")?, count_of(header[4], "horizontal")?], header[5]);
    if kind != 1.0 {
        let name =
            [(2.0, "B"), (3.0, "A")].into_iter().find(|(code, _)| *code == kind).map_or("unknown", |(_, name)| name);
        return Err(format!("its photometry is of type {name} ({kind}), but only type C (1) is read").into());
    }
    let scale = header[2] * header[10] * if is_old { header[11] } else { 1.0 };
    if !(scale >= 0.0 && scale.is_finite()) {
        return Err(format!("candelas are multiplied by {scale}").into());
    }
    let vertical = angles(numbers.list("vertical angle", counts[0])?, "vertical", [0.0, 180.0])?;
    let horizontal = angles(numbers.list("horizontal angle", counts[1])?, "horizontal", [0.0, 360.0])?;
    let candelas: Vec<f32> = numbers.list("candela value", counts[0] * counts[1])?;
    if let Some(at) = candelas.iter().position(|value| !(*value >= 0.0 && value.is_finite())) {
        return Err(format!("candela value {at} is {}", candelas[at]).into());
    }
    let around = all_around(&horizontal)?;
    let rows = 0..vertical.len();
    let intensities = rows.flat_map(|row| around.iter().map(move |(_, column)| (row, *column)));
    Ok(Luminaire {
        intensities: intensities.map(|(row, column)| scale * candelas[column * vertical.len() + row]).collect(),
        horizontal: around.iter().map(|(angle, _)| angle.to_radians()).collect(),
        vertical: vertical.iter().map(|angle| angle.to_radians().min(PI)).collect(),
    })
}

/// Returns horizontal angles all around, each with the number of the one that its values are those of. Files have less
/// of what is symmetric: one angle, a quarter, the half from 0 to 180 degrees, or that from 90 to 270.
fn all_around(angles: &[f32]) -> Result<Vec<(f32, usize)>, Error> {
    let mut around: Vec<(f32, usize)> = angles.iter().copied().zip(0..).collect();
    let mirror = |around: &mut Vec<(f32, usize)>, sum: f32| {
        for (angle, column) in around.clone() {
            around.push(((sum - angle).rem_euclid(360.0), column));
        }
    };
    match [angles[0], angles[angles.len() - 1]] {
        [_, _] if angles.len() == 1 => around[0].0 = 0.0,
        [0.0, 90.0] => {
            mirror(&mut around, 180.0);
            mirror(&mut around, 360.0);
        }
        [0.0, 180.0] => mirror(&mut around, 360.0),
        [90.0, 270.0] => mirror(&mut around, 180.0),
        [0.0, last] if last > 180.0 => {}
        [first, last] => {
            return Err(
                format!("its horizontal angles run from {first} to {last} degrees, which is no symmetry").into()
            );
        }
    }
    // From clockwise to counter-clockwise, as the axis looks down.
    around.iter_mut().for_each(|(angle, _)| *angle = (360.0 - *angle).rem_euclid(360.0));
    // Of angles that are there twice, the first counts.
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    around.dedup_by(|b, a| b.0 == a.0);
    Ok(around)
}

fn angles(angles: Vec<f32>, kind: &str, [low, high]: [f32; 2]) -> Result<Vec<f32>, Error> {
    let is_bad = |at: &usize| {
        let angle = angles[*at];
        !(low..=high).contains(&angle) || *at > 0 && !(angle > angles[*at - 1])
    };
    match (0..angles.len()).find(is_bad) {
        Some(at) => Err(format!(
            "{kind} angle {at} is {}, but must be from {low} to {high} and above the one before",
            angles[at]
        )
        .into()),
        None => Ok(angles),
    }
}

fn count_of(value: f32, kind: &str) -> Result<usize, Error> {
    let least = if kind == "vertical" { 2.0 } else { 1.0 };
    let is_count = value.fract() == 0.0 && (least..=MOST_ANGLES as f32).contains(&value);
    if is_count {
        Ok(value as usize)
    } else {
        Err(format!("the number of {kind} angles is {value}, but must be from {least} to {MOST_ANGLES}").into())
    }
}

/// Numbers between spaces, commas and ends of lines.
struct Numbers<'a> {
    words: Box<dyn Iterator<Item = &'a str> + 'a>,
}

impl<'a> Numbers<'a> {
    fn new(text: &'a str) -> Self {
        let is_between = |c: char| c.is_whitespace() || c == ',';
        Self { words: Box::new(text.split(is_between).filter(|word| !word.is_empty())) }
    }

    fn take(&mut self, what: &str) -> Result<f32, Error> {
        let word = self.words.next().ok_or_else(|| format!("it ends before a {what}"))?;
        word.parse().map_err(|_| format!("a {what} is `{}`, which is no number", word.escape_debug()).into())
    }

    fn count(&mut self, what: &str) -> Result<usize, Error> {
        let value = self.take(what)?;
        let is_count = value.fract() == 0.0 && (0.0..=MOST_ANGLES as f32).contains(&value);
        if is_count { Ok(value as usize) } else { Err(format!("the {what} is {value}").into()) }
    }

    fn list(&mut self, what: &str, count: usize) -> Result<Vec<f32>, Error> {
        (0..count).map(|_| self.take(what)).collect()
    }
}

// Named, as the fuzz target has this file under another root.
#[cfg(test)]
#[path = "ies/tests.rs"]
mod tests;
