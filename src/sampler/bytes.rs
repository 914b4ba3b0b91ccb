//! A sampler as bytes, and bytes as a sampler.
//!
//! The bytes are sections (see [`buffers`](crate::buffers)), each of plain data under a tag and a version. Loading
//! borrows them. Every index and value is checked once, so that sampling need not check any; nothing that depends on a
//! tuned constant is computed again, so bytes of one build load in every build that reads the same versions.

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};

use super::lights::LightSamplerView;
use crate::blas;
use crate::buffers::{Section, Sections, write};
use crate::env::{EnvironmentView, RegionMoments};
use crate::error::{Error, ErrorKind};
use crate::light::{Illumination, LightsView, laid_out};
use crate::technique::LightScene;
use crate::tlas::{Arity, TlasView};

/// What is no array.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Parameters {
    /// Arity of the tree over the lights.
    light_arity: u32,
    /// Arity of the trees over textures.
    texture_arity: u32,
    illumination: u32,
    energy: f32,
    has_portals: u32,
    /// Whether the environment is a light: then its regions follow.
    has_sky: u32,
    is_crossed_once: u32,
    has_lamps: u32,
}

const _: () = assert!(size_of::<Parameters>() == 32);

impl Parameters {
    const TAG: [u8; 4] = *b"PARA";
    const VERSION: u32 = 2;
}

/// Tag and version of the section that holds the [`RegionMoments`].
const REGIONS_SECTION: ([u8; 4], u32) = (*b"EREG", 1);

impl<'a> LightSamplerView<'a> {
    /// Returns everything as bytes, to be written to disk, mapped, shared or uploaded, and to be read by
    /// [`Self::from_bytes`] on a machine of the same byte order. Of an [edited](crate::LightSampler::edit) sampler, the
    /// bytes hold no free places, and give the same samples.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        if self.scene.lights.is_edited {
            let (lights, tlas) = laid_out(&self.scene.lights, &self.scene.tlas);
            let scene = LightScene { tlas: tlas.view(), lights: lights.view(), ..self.scene };
            return LightSamplerView { scene, visibility: self.visibility }.to_bytes();
        }
        let LightScene { tlas, lights, environment, sky } = &self.scene;
        let parameters = [Parameters {
            light_arity: tlas.arity.code(),
            texture_arity: blas::ARITY as u32,
            illumination: lights.illumination as u32,
            energy: lights.energy,
            has_portals: lights.has_portals.into(),
            has_sky: sky.is_some().into(),
            is_crossed_once: lights.is_crossed_once.into(),
            has_lamps: lights.has_lamps.into(),
        }];
        let mut sections = Vec::new();
        sections.push(Section::new(Parameters::TAG, Parameters::VERSION, &parameters));
        tlas.append_sections(&mut sections);
        lights.append_sections(&mut sections);
        let header = [environment.header];
        environment.append_all_sections(&header, &mut sections);
        if let Some(sky) = sky {
            sections.push(Section::new(REGIONS_SECTION.0, REGIONS_SECTION.1, core::slice::from_ref(*sky)));
        }
        write(&sections)
    }

    /// Borrows a sampler from bytes that [`Self::to_bytes`] wrote, without a copy. `bytes` must start at a multiple of
    /// four.
    ///
    /// # Errors
    ///
    /// If the bytes are not aligned, are cut off, are of another version or byte order, or hold anything that sampling
    /// could stumble over. Bytes from an untrusted source are safe to load.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut sections = Sections::new(bytes)?;
        let parameters: Parameters = sections.take_value(Parameters::TAG, Parameters::VERSION, "parameters")?;
        let Parameters {
            light_arity,
            texture_arity,
            illumination,
            energy,
            has_portals,
            has_sky,
            is_crossed_once,
            has_lamps,
        } = parameters;
        if texture_arity as usize != blas::ARITY {
            let expected = const { &[blas::ARITY as u32] };
            return Err(Error(ErrorKind::Arity { what: "a tree over a texture", found: texture_arity, expected }));
        }
        Error::unless_equal("mark of portals", (has_portals & !1) as usize, 0)?;
        Error::unless_equal("mark of the environment", (has_sky & !1) as usize, 0)?;
        Error::unless_equal("mark of single crossings", (is_crossed_once & !1) as usize, 0)?;
        Error::unless_equal("mark of lamps", (has_lamps & !1) as usize, 0)?;
        let arity = Arity::from_code(light_arity).ok_or_else(|| {
            let expected = const { &[Arity::Four.code(), Arity::Eight.code(), Arity::Sixteen.code()] };
            Error(ErrorKind::Arity { what: "the tree over the lights", found: light_arity, expected })
        })?;
        let illumination =
            Illumination::from_u32(illumination).ok_or_else(|| Error::bytes("illumination", 0, illumination, 0u64))?;
        if !(0.0..f32::INFINITY).contains(&energy) {
            return Err(Error::bytes("energy", 0, energy.to_bits(), 0u64));
        }
        let tlas = TlasView::from_sections(&mut sections, (arity,))?;
        let (has_portals, has_lamps, is_crossed_once) = (has_portals != 0, has_lamps != 0, is_crossed_once != 0);
        // The time of whoever asks, and no places left free by edits.
        let plain = (illumination, energy, has_portals, has_lamps, is_crossed_once, 0.0, false);
        let lights = LightsView::from_sections(&mut sections, plain)?;
        let environment = EnvironmentView::from_all_sections(&mut sections)?;
        let sky = if has_sky == 0 { None } else { Some(take_regions(&mut sections)?) };
        sections.end()?;
        tlas.validate()?;
        lights.validate()?;
        Error::unless_equal("number of lights", lights.len(), tlas.leaves.len())?;
        Ok(Self { scene: LightScene { tlas, lights, environment, sky }, visibility: None })
    }
}

/// Takes the section of the regions, and checks them.
fn take_regions<'a>(sections: &mut Sections<'a>) -> Result<&'a RegionMoments, Error> {
    match sections.take::<RegionMoments>(REGIONS_SECTION.0, REGIONS_SECTION.1, "regions of the environment")? {
        [regions] => {
            regions.validate()?;
            Ok(regions)
        }
        several => Err(Error::bytes("regions of the environment", 0, several.len(), 1u64)),
    }
}
