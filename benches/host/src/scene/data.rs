//! Environments and references, which are not part of the repository.

use std::path::PathBuf;

use crate::Error;
use crate::error::Reference;
use crate::file::read_exr;
use crate::film::{Image, RESOLUTION};

/// References by another renderer, and their own noise. *Measured*: from four independent runs of that renderer.
const REFERENCES: [(&str, &str, f64); 8] = [
    ("bulbs_1", "host/bulbs_1.exr", 4.8e-4),
    ("bulbs_5", "host/bulbs_5.exr", 7.1e-4),
    ("cornell_1", "host/cornell_1.exr", 5.8e-6),
    ("cornell_5", "host/cornell_5.exr", 3.5e-5),
    ("sun-room_1", "host/sun-room_1.exr", 1.1e-3),
    ("sun-room_5", "host/sun-room_5.exr", 1.8e-3),
    ("windows-only_1", "host/windows-only_1.exr", 1.3e-3),
    ("windows-only_5", "host/windows-only_5.exr", 3.1e-3),
];

/// The folder with environments and references.
#[derive(Clone, Debug)]
pub(crate) struct Data {
    folder: PathBuf,
}

impl Data {
    /// Takes a folder that need not exist.
    pub(crate) const fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Where a file is or would be.
    pub(crate) fn path(&self, file: &str) -> PathBuf {
        self.folder.join(file)
    }

    /// Reads an image.
    pub(crate) fn image(&self, file: &str) -> Result<Image, Error> {
        read_exr(&self.path(file))
    }

    /// Reads the reference of a scene, if another renderer has made one.
    pub(crate) fn reference(&self, scene: &str, bounces: u32) -> Result<Option<Reference>, Error> {
        let name = format!("{scene}_{bounces}");
        let known = REFERENCES.iter().find(|(known, ..)| *known == name);
        let Some((_, file, noise)) = known.filter(|(_, file, _)| self.path(file).exists()) else { return Ok(None) };
        let image = self.image(file)?;
        if [image.width, image.height] != RESOLUTION {
            return Err(format!("{file} has {} x {} pixels", image.width, image.height).into());
        }
        Ok(Some(Reference::new(image, *noise)))
    }
}
