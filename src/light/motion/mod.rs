//! Lights that move while the shutter is open: where they are at its end, beside the records that say where they are at
//! its start.
//!
//! A shading point carries its time, and [`LightsView`](super::LightsView) the same one: a light that is requested is
//! *made* at that time. Vertices, and the elements of transforms, are interpolated linearly in double precision; bounds
//! in the tree hold for the whole interval. What moves is found by the number that it was added with: [`Motion`] is an
//! array of words at the end of [`Extras`](super::Extras), so that a scene in which nothing moves has none of it, and
//! no walk asks for it.

mod lookup;
#[cfg(test)]
mod tests;
mod triangle;

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};

use super::POSITION_LIMIT;
use crate::error::Error;

pub(crate) use triangle::MovingTriangle;
pub(super) use triangle::{SHUTTER_PARTS, convex_cone, end_vertices, has_area_between, simpson, widened};

/// Vertices of a triangle at the end of the interval.
pub(super) type EndVertices = [[f32; 3]; 3];
/// Columns of a transform at the end of the interval.
pub(super) type EndColumns = [[f32; 3]; 4];

/// Numbers of elements of the arrays, in their order.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct MotionHeader {
    /// Meshes that move.
    meshes: u32,
    /// Triangles of all of them.
    triangles: u32,
    /// Instances that move.
    instances: u32,
}

const _: () = assert!(size_of::<MotionHeader>() == 12);

/// Words of a [`MotionHeader`]. *Format.*
const MOTION_HEADER_WORDS: usize = size_of::<MotionHeader>() / size_of::<u32>();
/// Words of a [`MovingMesh`]. *Format.*
const MESH_WORDS: usize = size_of::<MovingMesh>() / size_of::<u32>();
/// Words of the vertices of a triangle. *Format.*
const VERTICES_WORDS: usize = size_of::<EndVertices>() / size_of::<u32>();
/// Words of the columns of a transform. *Format.*
const COLUMNS_WORDS: usize = size_of::<EndColumns>() / size_of::<u32>();

/// Where the triangles of a mesh that moves are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct MovingMesh {
    /// Number of the first triangle among all that were added.
    first: u32,
    /// Place of its vertices among those of all triangles that move.
    start: u32,
}

const _: () = assert!(size_of::<MovingMesh>() == 8);

/// The ends of all that moves, in borrowed memory: a [`MotionHeader`], and the arrays that it counts. Empty if nothing
/// moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion<'a>(pub(super) &'a [u32]);

impl<'a> Motion<'a> {
    /// Whether nothing moves.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    #[inline]
    fn header(self) -> MotionHeader {
        self.0
            .get(..MOTION_HEADER_WORDS)
            .map_or_else(MotionHeader::default, |words| *bytemuck::from_bytes(bytemuck::cast_slice(words)))
    }

    /// Returns `count` words, after `before` words of the arrays before. Words that are not there, which validation
    /// refuses, give none.
    fn words(self, before: usize, count: usize) -> &'a [u32] {
        let start = MOTION_HEADER_WORDS + before;
        self.0.get(start..start + count).unwrap_or(&[])
    }

    fn meshes(self) -> &'a [MovingMesh] {
        bytemuck::cast_slice(self.words(0, self.header().meshes as usize * MESH_WORDS))
    }

    fn triangles(self) -> &'a [EndVertices] {
        let MotionHeader { meshes, triangles, .. } = self.header();
        bytemuck::cast_slice(self.words(meshes as usize * MESH_WORDS, triangles as usize * VERTICES_WORDS))
    }

    fn words_before_instances(self) -> usize {
        let MotionHeader { meshes, triangles, .. } = self.header();
        meshes as usize * MESH_WORDS + triangles as usize * VERTICES_WORDS
    }

    /// Returns the numbers of the instances that move, in ascending order.
    pub(super) fn instances(self) -> &'a [u32] {
        self.words(self.words_before_instances(), self.header().instances as usize)
    }

    fn columns(self) -> &'a [EndColumns] {
        let instances = self.header().instances as usize;
        bytemuck::cast_slice(self.words(self.words_before_instances() + instances, instances * COLUMNS_WORDS))
    }

    /// Whether the mesh whose first triangle has this number moves.
    pub(super) fn moves_mesh(self, first: u32) -> bool {
        self.meshes().binary_search_by_key(&first, |mesh| mesh.first).is_ok()
    }

    /// Returns the vertices of a triangle at the end, by its number among all that were added; `None` for one that
    /// stands still.
    pub(super) fn end_of_triangle(self, index: u32) -> Option<&'a EndVertices> {
        let meshes = self.meshes();
        let mesh = meshes.get(meshes.partition_point(|mesh| mesh.first <= index).checked_sub(1)?)?;
        self.triangles().get((index - mesh.first).checked_add(mesh.start)? as usize)
    }

    /// Returns the transform of an instance at the end, by its number; `None` for one that stands still.
    pub(super) fn end_of_instance(self, number: u32) -> Option<&'a EndColumns> {
        if self.is_empty() {
            return None;
        }
        self.columns().get(self.instances().binary_search(&number).ok()?)
    }

    /// Checks that the arrays are where the header says, and what they hold.
    pub(super) fn validate(self) -> Result<(), Error> {
        if self.is_empty() {
            return Ok(());
        }
        let MotionHeader { meshes, triangles, instances } = self.header();
        let sizes = [(meshes, MESH_WORDS), (triangles, VERTICES_WORDS), (instances, 1 + COLUMNS_WORDS)];
        let words =
            sizes.iter().fold(MOTION_HEADER_WORDS as u64, |sum, (count, size)| sum + u64::from(*count) * *size as u64);
        if words != self.0.len() as u64 || words == MOTION_HEADER_WORDS as u64 {
            return Err(Error::bytes("length of what moves", 0, self.0.len(), words));
        }
        let ascends = |pair: &[MovingMesh]| pair[0].first < pair[1].first && pair[0].start <= pair[1].start;
        if let Some(i) = self.meshes().windows(2).position(|pair| !ascends(pair)) {
            return Err(Error::bytes("start of a mesh that moves", i, self.meshes()[i].first, 0));
        }
        // NaN fails.
        let is_place = |vertices: &EndVertices| vertices.as_flattened().iter().all(|x| x.abs() <= POSITION_LIMIT);
        if let Some(i) = self.triangles().iter().position(|vertices| !is_place(vertices)) {
            return Err(Error::bytes("end of a triangle that moves", i, 0, 0));
        }
        match self.instances().windows(2).position(|pair| pair[0] >= pair[1]) {
            Some(i) => Err(Error::bytes("number of an instance that moves", i, self.instances()[i], 0)),
            None => Ok(()),
        }
    }
}

/// The ends of all that moves, on their way into a sampler.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionCollection {
    /// Vertices of meshes, by the numbers of their first triangles.
    meshes: BTreeMap<u32, Vec<EndVertices>>,
    /// Transforms of instances, by their numbers.
    instances: BTreeMap<u32, EndColumns>,
}

impl MotionCollection {
    /// Returns what a sampler holds, to be changed.
    pub(super) fn of(motion: Motion<'_>) -> Self {
        let (meshes, triangles) = (motion.meshes(), motion.triangles());
        let end = |i: usize| meshes.get(i + 1).map_or(triangles.len(), |next| next.start as usize);
        let own = |i: usize| triangles.get(meshes[i].start as usize..end(i)).unwrap_or(&[]).to_vec();
        Self {
            meshes: (0..meshes.len()).map(|i| (meshes[i].first, own(i))).collect(),
            instances: motion.instances().iter().copied().zip(motion.columns().iter().copied()).collect(),
        }
    }

    /// Returns the vertices of the triangles of a mesh by the number of its first one; empty if it stands still.
    pub(super) fn mesh(&self, first: u32) -> &[EndVertices] {
        self.meshes.get(&first).map_or(&[], |triangles| triangles)
    }

    /// Sets the vertices of the triangles of a mesh by the number of its first one: those of no triangle if it stands
    /// still.
    pub(super) fn set_mesh(&mut self, first: u32, triangles: Vec<EndVertices>) {
        if triangles.is_empty() {
            self.meshes.remove(&first);
        } else {
            self.meshes.insert(first, triangles);
        }
    }

    /// Sets the transform of an instance; none if it stands still.
    pub(super) fn set_instance(&mut self, number: u32, columns: Option<EndColumns>) {
        match columns {
            Some(columns) => self.instances.insert(number, columns),
            None => self.instances.remove(&number),
        };
    }

    /// Returns the words of a [`Motion`].
    pub(super) fn pack(&self) -> Vec<u32> {
        if self.meshes.is_empty() && self.instances.is_empty() {
            return Vec::new();
        }
        let mut start = 0;
        let place = |(&first, own): (&u32, &Vec<EndVertices>)| {
            let mesh = MovingMesh { first, start };
            start += own.len() as u32;
            mesh
        };
        let meshes: Vec<MovingMesh> = self.meshes.iter().map(place).collect();
        let triangles: Vec<EndVertices> = self.meshes.values().flatten().copied().collect();
        let instances: Vec<u32> = self.instances.keys().copied().collect();
        let columns: Vec<EndColumns> = self.instances.values().copied().collect();
        let header = MotionHeader {
            meshes: meshes.len() as u32,
            triangles: triangles.len() as u32,
            instances: instances.len() as u32,
        };
        let arrays: [&[u32]; 5] = [
            bytemuck::cast_slice(core::slice::from_ref(&header)),
            bytemuck::cast_slice(&meshes),
            bytemuck::cast_slice(&triangles),
            &instances,
            bytemuck::cast_slice(&columns),
        ];
        arrays.concat()
    }
}
