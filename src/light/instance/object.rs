//! An object as words: what is known of it as a whole, its light tree, its triangles, and the ways from ids to
//! triangles.
//!
//! All objects of a scene are in one array, one after the other, so that a sampler is no larger for it.

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Vec3};

use crate::bounds::{LightBounds, Moments, storable};
use crate::light::meshes::mesh_of;
use crate::light::{LightKind, LightTriangle, NO_AREA};
use crate::math::sqrt64;
use crate::record::{MeshId, TriangleId};
use crate::tlas::{Arity, Tlas, TlasView};

/// What is known of an object as a whole, in its own space. All means are by energy.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct ObjectHeader {
    /// Number of words of the object, with this header.
    pub(super) words: u32,
    /// Code of the tree's arity.
    pub(super) arity: u32,
    /// Number of nodes of the tree.
    pub(super) nodes: u32,
    /// Number of triangles that can emit.
    pub(super) lights: u32,
    /// Number of meshes.
    pub(super) meshes: u32,
    /// Number of triangles that were added.
    pub(super) triangles: u32,
    /// Whether any triangle emits from its back as well.
    pub(super) two_sided: u32,
    /// Weight times area of all emitters.
    pub(super) flux: f32,
    /// Transmittance times area of all portals.
    pub(super) portal: f32,
    /// Least corner of the box around all triangles that can emit.
    pub(super) low: [f32; 3],
    /// Largest corner.
    pub(super) high: [f32; 3],
    /// Axis of the cone of normals.
    pub(super) axis: [f32; 3],
    /// Half angle of the cone of normals.
    pub(super) theta: f32,
    /// Mean position.
    pub(super) mean: [f32; 3],
    /// Covariance of the positions: xx, yy, zz, xy, yz, zx.
    pub(super) covariance: [f32; 6],
    /// Mean normal.
    pub(super) normal: [f32; 3],
    /// Mean products of the normals' components, as those of the covariance.
    pub(super) normals: [f32; 6],
}

const _: () = assert!(size_of::<ObjectHeader>() == 148);

/// Words of the header. *Format.*
const OBJECT_HEADER_WORDS: usize = size_of::<ObjectHeader>() / size_of::<u32>();
/// Words of a triangle. *Format.*
const TRIANGLE_WORDS: usize = size_of::<LightTriangle>() / size_of::<u32>();

/// The header of an object without lights, for a reference that leads nowhere; checked bytes have none.
static NO_OBJECT: ObjectHeader = ObjectHeader {
    words: OBJECT_HEADER_WORDS as u32,
    arity: 4,
    nodes: 0,
    lights: 0,
    meshes: 0,
    triangles: 0,
    two_sided: 0,
    flux: 0.0,
    portal: 0.0,
    low: [0.0; 3],
    high: [0.0; 3],
    axis: [0.0, 0.0, 1.0],
    theta: 0.0,
    mean: [0.0; 3],
    covariance: [0.0; 6],
    normal: [0.0; 3],
    normals: [0.0; 6],
};

/// An object in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Object<'a> {
    pub(super) header: &'a ObjectHeader,
    /// All words after the header.
    words: &'a [u32],
}

/// The parts of an object after its header.
pub(super) struct Parts<'a> {
    pub(super) tree: TlasView<'a>,
    pub(super) records: &'a [LightTriangle],
    /// Where the triangles of each mesh start in `leaf_of`, and their number at the end.
    pub(super) meshes: &'a [u32],
    /// Leaf of every triangle that was added, [`NO_LEAF`](crate::light::NO_LEAF) or [`NO_AREA`].
    pub(super) leaf_of: &'a [u32],
}

impl<'a> Object<'a> {
    /// Returns the object that starts at a word.
    #[inline]
    pub(crate) fn at(objects: &'a [u32], start: u32) -> Self {
        let split = objects.get(start as usize..).and_then(|words| words.split_at_checked(OBJECT_HEADER_WORDS));
        let header = split.and_then(|(header, words)| {
            let header = bytemuck::try_from_bytes(bytemuck::cast_slice(header)).ok()?;
            Some(Self { header, words })
        });
        header.unwrap_or(Self { header: &NO_OBJECT, words: &[] })
    }

    /// Returns the number of words that an object with these counts takes; `None` where that overflows.
    pub(super) fn word_count(header: &ObjectHeader) -> Option<usize> {
        let [nodes, lights, meshes, triangles] =
            [header.nodes, header.lights, header.meshes, header.triangles].map(|count| count as usize);
        let tree = TlasView::word_count(Arity::from_code(header.arity)?, nodes, lights)?;
        let ways = meshes.checked_add(1)?.checked_add(triangles)?;
        OBJECT_HEADER_WORDS.checked_add(tree)?.checked_add(lights.checked_mul(TRIANGLE_WORDS)?)?.checked_add(ways)
    }

    #[inline]
    fn split(&self) -> (TlasView<'a>, &'a [u32]) {
        let arity = Arity::from_code(self.header.arity).unwrap_or_default();
        TlasView::from_words(self.words, arity, self.header.nodes as usize, self.header.lights as usize)
    }

    /// Returns the light tree.
    #[inline]
    pub(crate) fn tree(&self) -> TlasView<'a> {
        self.split().0
    }

    /// Returns the triangles that can emit, in the order of the tree's leaves.
    #[inline]
    pub(crate) fn records(&self) -> &'a [LightTriangle] {
        self.parts().records
    }

    /// Returns all parts.
    #[inline]
    pub(super) fn parts(&self) -> Parts<'a> {
        let (tree, rest) = self.split();
        let take = |from: &'a [u32], count: usize| from.split_at_checked(count).unwrap_or((&[], &[]));
        let (records, rest) = take(rest, self.header.lights as usize * TRIANGLE_WORDS);
        let (meshes, rest) = take(rest, self.header.meshes as usize + 1);
        let (leaf_of, _) = take(rest, self.header.triangles as usize);
        Parts { tree, records: bytemuck::try_cast_slice(records).unwrap_or(&[]), meshes, leaf_of }
    }

    /// Number of triangles that can emit.
    pub(crate) fn len(&self) -> usize {
        self.header.lights as usize
    }

    /// Whether any light is a portal.
    pub(crate) fn has_portals(&self) -> bool {
        self.header.portal > 0.0
    }

    /// Returns the corners of the box around all triangles that can emit.
    pub(in crate::light) fn corners(&self) -> [Vec3; 2] {
        [self.header.low, self.header.high].map(Vec3::from)
    }

    /// Returns the leaf of a triangle in the object's own tree; `None` for one that emits nothing or that was never
    /// added.
    pub(crate) fn leaf(&self, id: TriangleId) -> Option<u32> {
        let Parts { meshes, leaf_of, .. } = self.parts();
        let mesh = id.mesh.0 as usize;
        let (start, end) = (*meshes.get(mesh)?, *meshes.get(mesh + 1)?);
        let index = start.checked_add(id.triangle).filter(|index| *index < end)?;
        leaf_of.get(index as usize).copied().filter(|leaf| *leaf < NO_AREA)
    }

    /// Returns the id of a triangle.
    pub(crate) fn id(&self, triangle: &LightTriangle) -> TriangleId {
        let Parts { meshes, .. } = self.parts();
        let index = triangle.index();
        let mesh = mesh_of(meshes, index);
        TriangleId::new(MeshId(mesh as u32), index.wrapping_sub(meshes[mesh]))
    }
}

/// Returns a symmetric matrix by its six different elements.
pub(super) fn symmetric([xx, yy, zz, xy, yz, zx]: [f32; 6]) -> DMat3 {
    let [xx, yy, zz, xy, yz, zx] = [xx, yy, zz, xy, yz, zx].map(f64::from);
    DMat3::from_cols(DVec3::new(xx, xy, zx), DVec3::new(xy, yy, yz), DVec3::new(zx, yz, zz))
}

/// Returns the six different products of the components of a vector.
fn products(v: DVec3) -> [f64; 6] {
    [v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.y * v.z, v.z * v.x]
}

/// What is needed to write an object.
pub(super) struct ObjectParts<'a> {
    pub(super) tree: &'a Tlas,
    /// In the order of the tree's leaves.
    pub(super) records: &'a [LightTriangle],
    pub(super) meshes: &'a [u32],
    pub(super) leaf_of: &'a [u32],
    /// Bounds and moments of each record, with energies relative to all.
    pub(super) bounds: &'a [(LightBounds, Moments)],
}

impl ObjectParts<'_> {
    /// Appends the words of the object, if there is a number for each of them.
    pub(super) fn append(&self, words: &mut Vec<u32>) -> Option<()> {
        let mut header = self.header();
        let count = Object::word_count(&header)?;
        u32::try_from(words.len().checked_add(count)?).ok()?;
        header.words = count as u32;
        words.extend_from_slice(bytemuck::cast_slice(bytemuck::bytes_of(&header)));
        self.tree.append_words(words);
        words.extend_from_slice(bytemuck::cast_slice(self.records));
        words.extend_from_slice(self.meshes);
        words.extend_from_slice(self.leaf_of);
        Some(())
    }

    fn header(&self) -> ObjectHeader {
        let mut whole = LightBounds::NONE;
        let mut moments = Moments::NONE;
        let (mut flux, mut portal) = (0.0, 0.0);
        for (i, (record, (bounds, own))) in self.records.iter().zip(self.bounds).enumerate() {
            let flip = whole.two_sided && bounds.two_sided && moments.normal.dot(own.normal) < 0.0;
            (whole, moments) = if i == 0 { (*bounds, *own) } else { (whole.union(*bounds), moments.union(*own, flip)) };
            let energy = f64::from(record.weight()) * f64::from(record.area());
            *(if record.is_portal() { &mut portal } else { &mut flux }) += energy;
        }
        let mean = moments.mean.as_dvec3();
        let (mut covariance, mut normals, mut sum) = ([0.0; 6], [0.0; 6], 0.0);
        for (record, (_, own)) in self.records.iter().zip(self.bounds) {
            let [a, b, c] = record.triangle().0.map(|vertex| vertex.as_dvec3() - mean);
            let energy = f64::from(own.energy);
            // The mean over a triangle: a twelfth for each vertex, and nine for the centroid.
            let at = [a, b, c, (a + b + c) * (1.0 / 3.0)].map(products);
            let normal = products(own.normal.as_dvec3());
            for i in 0..6 {
                covariance[i] += energy * (at[0][i] + at[1][i] + at[2][i] + 9.0 * at[3][i]) * (1.0 / 12.0);
                normals[i] += energy * normal[i];
            }
            sum += energy;
        }
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        let corners = if self.records.is_empty() { [Vec3::ZERO; 2] } else { [whole.aabb.min, whole.aabb.max] };
        let [nodes, lights] = self.tree.counts().map(|count| count as u32);
        ObjectHeader {
            words: 0,
            arity: self.tree.arity.code(),
            nodes,
            lights,
            meshes: self.meshes.len() as u32 - 1,
            triangles: self.leaf_of.len() as u32,
            two_sided: whole.two_sided.into(),
            flux: storable(flux),
            portal: storable(portal),
            low: corners[0].to_array(),
            high: corners[1].to_array(),
            axis: whole.normals.axis.to_array(),
            theta: whole.normals.theta,
            mean: moments.mean.to_array(),
            covariance: covariance.map(|value| (value * scale) as f32),
            normal: moments.normal.to_array(),
            normals: normals.map(|value| (value * scale) as f32),
        }
    }
}

/// Returns the root of a mean square that rounding may have made negative.
pub(super) fn root_of(square: f64) -> f64 {
    sqrt64(square.max(0.0))
}

/// Returns the first word of every object, after those of all instances: of `words`, or of `alone` where there is no
/// instance.
pub(in crate::light) fn object_starts(words: &[u32], alone: &[u32]) -> Vec<u32> {
    let first = super::first_object(super::records(words).len()).min(words.len());
    let objects = if words.is_empty() { alone } else { &words[first..] };
    let mut starts = Vec::new();
    let mut start = 0;
    while start < objects.len() {
        starts.push(start as u32);
        start += Object::at(objects, start as u32).header.words as usize;
    }
    starts
}

/// Calls `change` for the record of every triangle of every object.
pub(in crate::light) fn object_records_mut(words: &mut [u32], mut change: impl FnMut(&mut LightTriangle)) {
    let mut start = super::first_object(super::records(words).len());
    while start < words.len() {
        let object = Object::at(words, start as u32);
        let (end, lights) = (start + object.header.words as usize, object.len());
        let tree = TlasView::word_count(object.tree().arity, object.header.nodes as usize, lights).unwrap_or(0);
        let first = start + OBJECT_HEADER_WORDS + tree;
        let records = words.get_mut(first..first + lights * TRIANGLE_WORDS).unwrap_or(&mut []);
        let records: &mut [LightTriangle] = bytemuck::try_cast_slice_mut(records).unwrap_or(&mut []);
        records.iter_mut().for_each(&mut change);
        start = end;
    }
}

/// Returns whether an object can send anything under an environment of this mean radiance.
pub(in crate::light) fn emits(object: &Object<'_>, mean: f64) -> bool {
    f64::from(object.header.flux) + mean * f64::from(object.header.portal) > 0.0
}
