//! A sampler as bytes, and bytes as a sampler.
//!
//! The bytes are a [`Header`] and then the buffers of the sampler, one after the other, in the machine's own byte
//! order. Loading borrows them; every index and value is checked once, so that sampling need not check any.

use alloc::vec::Vec;

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

use super::lights::{LightSampler, LightSamplerView, NO_AREA};
use crate::blas;
use crate::env::{EnvironmentHeader, EnvironmentParts, EnvironmentView};
use crate::error::Error;
use crate::light::Illumination;
use crate::tlas::TlasView;

const MAGIC: [u8; 8] = *b"fanlight";
/// Changes with every change of a layout.
const VERSION: u32 = 2;
/// Reads differently on a machine of the other byte order.
const BYTE_ORDER: u32 = 0x0102_0304;
const BUFFERS: usize = 14;
/// Every buffer consists of 4-byte numbers.
const ALIGNMENT: usize = 4;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Header {
    magic: [u8; 8],
    version: u32,
    byte_order: u32,
    arities: [u32; 2],
    illumination: u32,
    energy: f32,
    portals: u32,
    padding: u32,
    /// Lengths of the buffers in bytes.
    lengths: [u64; BUFFERS],
}

impl<const N: usize> LightSampler<N> {
    /// See [`LightSamplerView::to_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        self.as_view().to_bytes()
    }
}

impl<'a, const N: usize> LightSamplerView<'a, N> {
    /// Everything as bytes, to be written to disk, mapped, shared or uploaded, and to be read by
    /// [`Self::from_bytes`] on a machine of the same byte order.
    pub fn to_bytes(&self) -> Vec<u8> {
        let buffers = self.buffers();
        let header = Header {
            magic: MAGIC,
            version: VERSION,
            byte_order: BYTE_ORDER,
            arities: [N as u32, blas::ARITY as u32],
            illumination: self.illumination as u32,
            energy: self.energy,
            portals: self.portals.into(),
            padding: 0,
            lengths: buffers.map(|buffer| buffer.len() as u64),
        };
        let environment = self.environment.parts().header;
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(bytemuck::bytes_of(&environment));
        buffers.into_iter().for_each(|buffer| bytes.extend_from_slice(buffer));
        bytes
    }

    fn buffers(&self) -> [&'a [u8]; BUFFERS] {
        let environment = self.environment.parts();
        [
            bytemuck::cast_slice(self.tlas.nodes),
            bytemuck::cast_slice(self.tlas.parents),
            bytemuck::cast_slice(self.tlas.spreads),
            bytemuck::cast_slice(self.tlas.leaves),
            bytemuck::cast_slice(self.triangles),
            bytemuck::cast_slice(self.cells),
            bytemuck::cast_slice(self.meshes),
            bytemuck::cast_slice(self.leaves),
            bytemuck::cast_slice(self.scales),
            bytemuck::cast_slice(environment.means),
            bytemuck::cast_slice(environment.ranges),
            bytemuck::cast_slice(environment.filtered_means),
            bytemuck::cast_slice(environment.suns),
            bytemuck::cast_slice(environment.sun_texels),
        ]
    }

    /// Borrows a sampler from bytes that [`Self::to_bytes`] wrote, without a copy. `bytes` must start at a multiple
    /// of four.
    ///
    /// # Errors
    ///
    /// If the bytes are not aligned, cut off, of another version, byte order or arity, or hold anything that sampling
    /// could stumble over. Bytes from an untrusted source are safe to load.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader { bytes, at: 0 };
        let header: Header = reader.value("header")?;
        header.check(N, blas::ARITY)?;
        let environment_header: EnvironmentHeader = reader.value("header of the environment")?;
        let [
            nodes,
            parents,
            spreads,
            leaves,
            triangles,
            cells,
            meshes,
            places,
            scales,
            means,
            ranges,
            filtered,
            suns,
            sun_texels,
        ] = header.lengths;
        let view = Self {
            illumination: Illumination::from_u32(header.illumination)
                .ok_or_else(|| Error::bytes("illumination", 0, header.illumination, 0u64))?,
            tlas: TlasView {
                nodes: reader.slice("nodes", nodes)?,
                parents: reader.slice("parents", parents)?,
                spreads: reader.slice("spreads", spreads)?,
                leaves: reader.slice("leaves", leaves)?,
            },
            triangles: reader.slice("triangles", triangles)?,
            cells: reader.slice("cells", cells)?,
            meshes: reader.slice("meshes", meshes)?,
            leaves: reader.slice("leaves of the triangles", places)?,
            scales: reader.slice("scales of the meshes", scales)?,
            environment: EnvironmentView::from_parts(EnvironmentParts {
                header: environment_header,
                means: reader.slice("means", means)?,
                ranges: reader.slice("ranges", ranges)?,
                filtered_means: reader.slice("filtered means", filtered)?,
                suns: reader.slice("suns", suns)?,
                sun_texels: reader.slice("texels of suns", sun_texels)?,
            })?,
            energy: header.energy,
            portals: header.portals != 0,
        };
        reader.end()?;
        view.validate()?;
        Ok(view)
    }

    /// Whether no look-up can leave a buffer, go round in circles or meet a number that is not finite.
    fn validate(&self) -> Result<(), Error> {
        self.tlas.validate()?;
        Error::unless_equal("number of triangles", self.triangles.len(), self.tlas.leaves.len())?;
        blas::validate(self.cells)?;
        let roots: Vec<blas::Root> = self.triangles.iter().map(|triangle| triangle.root).collect();
        blas::validate_roots(&roots, self.cells)?;
        self.validate_places()?;
        Error::unless_equal("start of the first mesh", self.meshes.first().map_or(0, |&start| start as usize), 0)?;
        let bad_mesh = self.meshes.windows(2).position(|pair| pair[0] > pair[1]);
        bad_mesh.map_or(Ok(()), |i| Err(Error::bytes("start of mesh", i, self.meshes[i], self.meshes[i + 1])))?;
        if !self.scales.is_empty() {
            Error::unless_equal("number of scales", self.scales.len() + 1, self.meshes.len())?;
        }
        let bad_scale = self.scales.iter().position(|scale| !(0.0..=blas::MAX_AVERAGE).contains(scale));
        bad_scale.map_or(Ok(()), |i| Err(Error::bytes("scale of mesh", i, self.scales[i].to_bits(), 0u64)))?;
        Error::unless_equal(
            "end of the meshes",
            self.meshes.last().map_or(usize::MAX, |&end| end as usize),
            self.leaves.len(),
        )
    }

    /// Whether leaves and triangles refer to each other, so that a sample is asked for its density under the number
    /// that it came with.
    fn validate_places(&self) -> Result<(), Error> {
        for (i, triangle) in self.triangles.iter().enumerate() {
            let leaf = self.leaves.get(triangle.place() as usize);
            if !triangle.is_valid() || leaf.is_none_or(|&leaf| leaf as usize != i) {
                return Err(Error::bytes("triangle", i, triangle.place(), self.leaves.len()));
            }
        }
        for (place, &leaf) in self.leaves.iter().enumerate().filter(|(_, leaf)| **leaf < NO_AREA) {
            if self.triangles.get(leaf as usize).is_none_or(|triangle| triangle.place() as usize != place) {
                return Err(Error::bytes("leaf of triangle", place, leaf, self.triangles.len()));
            }
        }
        Ok(())
    }
}

impl Header {
    fn check(&self, n: usize, m: usize) -> Result<(), Error> {
        let expect = |what, found: u64, expected: u64| {
            if found == expected { Ok(()) } else { Err(Error::bytes(what, 0, found, expected)) }
        };
        expect("magic number", u64::from_le_bytes(self.magic), u64::from_le_bytes(MAGIC))?;
        expect("byte order", self.byte_order.into(), BYTE_ORDER.into())?;
        expect("version", self.version.into(), VERSION.into())?;
        if !(self.energy >= 0.0 && self.energy < f32::INFINITY) {
            return Err(Error::bytes("energy", 0, self.energy.to_bits(), 0u64));
        }
        expect("mark of portals", (self.portals & !1).into(), 0)?;
        expect("arity of the tree over triangles", self.arities[0].into(), n as u64)?;
        expect("arity of the trees over textures", self.arities[1].into(), m as u64)
    }
}

/// Takes values and slices off the front of bytes.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, what: &'static str, length: u64) -> Result<&'a [u8], Error> {
        let left = self.bytes.len() - self.at;
        let wanted = usize::try_from(length).ok().filter(|length| *length <= left);
        let Some(length) = wanted else { return Err(Error::bytes(what, self.at, left, length)) };
        let taken = &self.bytes[self.at..self.at + length];
        self.at += length;
        Ok(taken)
    }

    fn value<T: AnyBitPattern>(&mut self, what: &'static str) -> Result<T, Error> {
        self.take(what, size_of::<T>() as u64).map(bytemuck::pod_read_unaligned)
    }

    fn slice<T: AnyBitPattern + NoUninit>(&mut self, what: &'static str, length: u64) -> Result<&'a [T], Error> {
        let at = self.at;
        let bytes = self.take(what, length)?;
        if length == 0 {
            return Ok(&[]);
        }
        let address = bytes.as_ptr() as usize;
        if !address.is_multiple_of(ALIGNMENT) {
            return Err(Error::bytes("alignment", at, address % ALIGNMENT, 0u64));
        }
        bytemuck::try_cast_slice(bytes).map_err(|_| Error::bytes(what, at, length, size_of::<T>()))
    }

    fn end(&self) -> Result<(), Error> {
        Error::unless_equal("number of bytes", self.bytes.len(), self.at)
    }
}
