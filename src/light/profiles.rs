//! All profiles and projections of a sampler, by their numbers.

use core::f32::consts::PI;

use super::profile::ProfileTable;
use super::profile_values::{ProfileCollection, TABLE_HEADER};
use super::projection::ProjectionTable;
use crate::blas;
use crate::error::{Error, ErrorKind};

/// All profiles of a sampler.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Profiles<'a> {
    /// Where each starts in `values`, and the end. Empty without profiles.
    pub(super) starts: &'a [u32],
    pub(super) values: &'a [f32],
}

/// Intensities by direction, from a profile or from a projection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distribution<'a> {
    /// Mean intensity over all directions.
    pub(super) mean: f32,
    /// Largest angle from the axis at which anything is sent.
    pub(super) reach: f32,
    by: Table<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Table<'a> {
    Angles(ProfileTable<'a>),
    Image(ProjectionTable<'a>),
}

/// Mean cosine of a projection. *Proved* for one that fills a hemisphere evenly; all are in front of their lights, and
/// the widest come near to that.
const PROJECTION_COSINE: f64 = 0.5;

impl Distribution<'_> {
    /// Returns the mean cosine between the axis and the directions in which light leaves.
    pub(super) fn mean_cosine(&self) -> f64 {
        match &self.by {
            Table::Angles(table) => table.mean_cosine(),
            Table::Image(_) => PROJECTION_COSINE,
        }
    }

    /// Returns the intensity in a direction in the frame of the light.
    pub(super) fn intensity(&self, direction: [f64; 3]) -> f32 {
        match &self.by {
            Table::Angles(table) => table.intensity(direction),
            Table::Image(table) => table.intensity(direction),
        }
    }

    /// Draws a unit direction in the frame of the light.
    pub(super) fn sample(&self, u: [f64; 2]) -> [f64; 3] {
        match &self.by {
            Table::Angles(table) => table.sample(u),
            Table::Image(table) => table.sample(u),
        }
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws a direction.
    pub(super) fn pdf(&self, direction: [f64; 3]) -> f64 {
        match &self.by {
            Table::Angles(table) => table.pdf(direction),
            Table::Image(table) => table.pdf(direction),
        }
    }
}

impl ProfileCollection {
    /// Returns the profiles as a sampler reads them.
    pub(super) fn view(&self) -> Profiles<'_> {
        Profiles { starts: &self.starts, values: &self.values }
    }
}

impl<'a> Profiles<'a> {
    /// Number of profiles.
    pub(super) fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns a profile or a projection by its number, if its values are as many as they should be. The number of rows
    /// of a projection is negative.
    pub(super) fn get(&self, profile: u32) -> Option<Distribution<'a>> {
        let starts = self.starts.get(profile as usize..)?;
        let [start, end, ..] = starts else { return None };
        let (header, values) = self.values.get(*start as usize..*end as usize)?.split_first_chunk::<TABLE_HEADER>()?;
        let by = if header[0] < 0.0 {
            Table::Image(ProjectionTable::new(*header, values)?)
        } else {
            Table::Angles(ProfileTable::new(*header, values)?)
        };
        let [_, _, mean, reach] = *header;
        Some(Distribution { mean, reach, by })
    }

    /// Checks that the profile of a light exists, if the light has one.
    pub(super) fn check(&self, light: u32, profile: Option<u32>) -> Result<(), Error> {
        match profile {
            Some(profile) if profile as usize >= self.count() => {
                let (light, profile) = (light as usize, profile as usize);
                Err(Error(ErrorKind::UnknownProfile { light, profile, profiles: self.count() }))
            }
            _ => Ok(()),
        }
    }

    /// Checks profiles that come from outside.
    pub(super) fn validate(&self) -> Result<(), Error> {
        let end = self.starts.last().map_or(0, |&end| end as usize);
        Error::unless_equal("number of values of profiles", end, self.values.len())?;
        Error::unless_equal("start of the first profile", self.starts.first().map_or(0, |&start| start as usize), 0)?;
        Error::unless_equal("number of starts of profiles", usize::from(self.starts.len() == 1), 0)?;
        for number in 0..self.count() {
            let fail = || Error::bytes("profile", number, 0, 0);
            let Distribution { mean, reach, by } = self.get(number as u32).ok_or_else(fail)?;
            let is_sound = (0.0..=blas::MAX_AVERAGE).contains(&mean) && (0.0..=PI).contains(&reach);
            let is_valid = match by {
                Table::Angles(table) => table.is_valid(),
                Table::Image(table) => table.is_valid(),
            };
            if !(is_sound && is_valid) {
                return Err(fail());
            }
        }
        Ok(())
    }
}
