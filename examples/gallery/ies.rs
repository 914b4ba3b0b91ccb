//! Luminaires from files of the format LM-63 (ANSI/IES LM-63-2002 and -2019, and those before), called `.ies`.
//!
//! A file holds a table of candelas by vertical and horizontal angle. Of photometry of type C, the usual one, the
//! vertical angle is 0 straight down and 180 degrees straight up, and horizontal angles grow counter-clockwise as seen
//! from above. Lumens, sizes and powers are read over, and so is what a tilt of the lamp changes: the luminaire is in
//! the position in which it was measured.
//!
//! Types A (automotive lamps) and B (floodlights) are latitudes and longitudes around the aim of the lamp, where both
//! angles are zero. Seen from the lamp, positive vertical angles are above the aim and positive horizontal ones to the
//! right of it (LM-63-2002, section 3: horizontal angles are clockwise). The poles are above and below the lamp in
//! type A, and to its left and right in type B. In both cases these are the poles of the table of type C in another
//! position, so that no value is interpolated: [`Photometry`] says which position.

use core::f32::consts::PI;

use glam::Vec3;

use crate::render::Error;

/// First lines of files up to 1995, in which a factor of the ballast stands where later ones have none.
const OLD: [&str; 3] = ["IESNA91", "IESNA:LM-63-1991", "IESNA:LM-63-1995"];
/// Numbers in front of the angles.
const HEADER: usize = 13;
/// Most angles of either kind.
const MOST_ANGLES: usize = 2048;
/// Degrees from the edge of a table of type A or B to where it is dark. A larger angle lets light out beside the table;
/// one of less than 1e-4 is lost in the rounding of angles to single precision.
const EDGE: f32 = 0.01;

/// Types of photometry, and the angles of type C that are those of the others. The angles are those of Cycles
/// (`process_type_a` and `process_type_b` in its `util/ies.cpp`), so that a table is the same as there. A scene
/// turns the table to where the lamp is aimed, by its [`frame`](Photometry::frame).
#[derive(Clone, Copy, Debug, PartialEq)]
enum Photometry {
    /// Vertical angle 0 is the axis.
    C,
    /// The axis is to the left: `[H + 90, V + 90]` of type C, vertical angle first. The lamp is aimed at `[90, 90]`,
    /// and what is above it is at `[90, 180]`.
    B,
    /// The axis is below: `[V + 90, 180 - H]`. The lamp is aimed at `[90, 180]`, and its right is at `[90, 90]`.
    A,
}

impl Photometry {
    fn of(code: f32) -> Result<Self, Error> {
        match code {
            1.0 => Ok(Self::C),
            2.0 => Ok(Self::B),
            3.0 => Ok(Self::A),
            _ => Err(format!("its photometry is of type {code}, but must be 1 (C), 2 (B) or 3 (A)").into()),
        }
    }

    /// Least number of horizontal angles: only around the axis of type C, one can stand for all.
    const fn least_horizontal(self) -> usize {
        if matches!(self, Self::C) { 1 } else { 2 }
    }

    /// Axis and horizontal angle 0 of the table, in the frame of `EXT_lights_ies`: the point of both angles 0 of the
    /// file is along -z, and vertical angles at horizontal angle 0 are in the plane of x and z. They grow towards x, as
    /// the extension has it for type C. Horizontal angles of types A and B are clockwise, and grow towards -y.
    const fn frame(self) -> [Vec3; 2] {
        match self {
            Self::C => [Vec3::NEG_Z, Vec3::X],
            Self::B => [Vec3::Y, Vec3::NEG_X],
            Self::A => [Vec3::NEG_X, Vec3::Z],
        }
    }

    /// Ranges of vertical and horizontal angles.
    const fn ranges(self) -> [[f32; 2]; 2] {
        if matches!(self, Self::C) { [[0.0, 180.0], [0.0, 360.0]] } else { [[-90.0, 90.0]; 2] }
    }
}

/// Angles of a table in degrees, each with the index of the angle of the file whose values it has. Without one it is
/// dark.
type Side = Vec<(f32, Option<usize>)>;

/// A table as `fanlight` has it: radians, all around the axis, counter-clockwise around a vertical angle 0 that looks
/// at the viewer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Luminaire {
    pub(crate) vertical: Vec<f32>,
    pub(crate) horizontal: Vec<f32>,
    /// Direction of vertical angle 0, and that of horizontal angle 0, for a luminaire whose angles of 0 are along -z.
    pub(crate) frame: [Vec3; 2],
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
    let photometry = Photometry::of(header[5])?;
    let counts =
        [count_of(header[3], "vertical", 2)?, count_of(header[4], "horizontal", photometry.least_horizontal())?];
    let scale = header[2] * header[10] * if is_old { header[11] } else { 1.0 };
    if !(scale >= 0.0 && scale.is_finite()) {
        return Err(format!("candelas are multiplied by {scale}").into());
    }
    let [above, around] = photometry.ranges();
    let vertical = angles(numbers.list("vertical angle", counts[0])?, "vertical", above)?;
    let horizontal = angles(numbers.list("horizontal angle", counts[1])?, "horizontal", around)?;
    let candelas: Vec<f32> = numbers.list("candela value", counts[0] * counts[1])?;
    if let Some(at) = candelas.iter().position(|value| !(*value >= 0.0 && value.is_finite())) {
        return Err(format!("candela value {at} is {}", candelas[at]).into());
    }
    let value = |vertical: usize, horizontal: usize| scale * candelas[horizontal * counts[0] + vertical];
    let frame = photometry.frame();
    Ok(match photometry {
        Photometry::C => tabulate(frame, numbered(&vertical), all_around(&horizontal)?, value),
        Photometry::B => {
            // Rows are the horizontal angles: what is between them is a cone around the axis to the left.
            let columns = in_front(mirrored(&vertical), |angle| angle + 90.0);
            tabulate(frame, from_pole(mirrored(&horizontal)), columns, |row, column| value(column, row))
        }
        Photometry::A => {
            // As in Cycles, vertical angles from 0 on are not mirrored: such a lamp is dark below its aim.
            let columns = in_front(mirrored(&horizontal), |angle| 180.0 - angle);
            tabulate(frame, from_pole(numbered(&vertical)), columns, value)
        }
    })
}

/// Makes a table of rows and columns that are in degrees of type C.
fn tabulate(frame: [Vec3; 2], rows: Side, mut columns: Side, value: impl Fn(usize, usize) -> f32) -> Luminaire {
    // From counter-clockwise to clockwise, as the axis looks down.
    columns.iter_mut().for_each(|(angle, _)| *angle = (360.0 - *angle).rem_euclid(360.0));
    columns.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [rows, columns] = [rows, columns].map(distinct_radians);
    let of_row = |row: Option<usize>| {
        let of_pair = |column: Option<usize>| row.zip(column).map_or(0.0, |(row, column)| value(row, column));
        columns.iter().map(|(_, column)| of_pair(*column)).collect::<Vec<_>>()
    };
    Luminaire {
        frame,
        intensities: rows.iter().flat_map(|(_, row)| of_row(*row)).collect(),
        vertical: rows.iter().map(|(angle, _)| angle.min(PI)).collect(),
        horizontal: columns.iter().map(|(angle, _)| *angle).collect(),
    }
}

/// Returns ascending angles in radians. Of angles that are there twice, or that rounding makes the same, the first
/// counts.
fn distinct_radians(mut side: Side) -> Side {
    side.iter_mut().for_each(|(angle, _)| *angle = angle.to_radians());
    side.dedup_by(|b, a| b.0 == a.0);
    side
}

fn numbered(angles: &[f32]) -> Side {
    angles.iter().enumerate().map(|(at, angle)| (*angle, Some(at))).collect()
}

/// Returns angles on both sides of the aim. Files that start at 0 have one side of what is symmetric.
fn mirrored(angles: &[f32]) -> Side {
    let one = numbered(angles);
    if angles[0] != 0.0 {
        return one;
    }
    let other = one.iter().skip(1).rev().map(|(angle, at)| (-angle, *at));
    other.chain(one.iter().copied()).collect()
}

/// Counts angles from a pole instead of the equator.
fn from_pole(mut side: Side) -> Side {
    side.iter_mut().for_each(|(angle, _)| *angle += 90.0);
    side
}

/// Returns angles around the axis by those to both sides of the aim. A profile goes on from its last angle to its
/// first, here through what is behind the lamp and was not measured: it is dark, from next to the edges on.
fn in_front(mut side: Side, to_c: impl Fn(f32) -> f32) -> Side {
    let [first, last] = [side[0].0, side[side.len() - 1].0];
    side.extend([(first - EDGE, None), (last + EDGE, None)]);
    side.iter_mut().for_each(|(angle, _)| *angle = to_c(*angle));
    side
}

/// Returns horizontal angles of type C all around. Files have less of what is symmetric: one angle, a quarter, the half
/// from 0 to 180 degrees, or that from 90 to 270.
fn all_around(angles: &[f32]) -> Result<Side, Error> {
    let mut around = numbered(angles);
    let mirror = |around: &mut Side, sum: f32| {
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

fn count_of(value: f32, kind: &str, least: usize) -> Result<usize, Error> {
    let is_count = value.fract() == 0.0 && (least as f32..=MOST_ANGLES as f32).contains(&value);
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
