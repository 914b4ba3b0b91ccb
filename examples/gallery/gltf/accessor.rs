//! Arrays of numbers.

use super::data::{Data, part};
use super::document::{Accessor, Sparse, member};
use crate::render::Error;

/// Component types. *Format.*
const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

impl Data<'_> {
    /// Elements of `N` floats. Integers become floats, from −1 to 1 if they are normalized.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, Error> {
        let normalized = member(&self.document.accessors, "accessor", index)?.normalized;
        self.elements(index, |kind, bytes| float(kind, normalized, bytes))
    }

    /// Elements of `N` whole numbers.
    pub(super) fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Error> {
        self.elements(index, integer)
    }

    /// How many elements there are, and how many numbers each of them has.
    pub(super) fn shape(&self, index: usize) -> Result<[usize; 2], Error> {
        let accessor = member(&self.document.accessors, "accessor", index)?;
        Ok([accessor.count, components(&accessor.kind).ok_or_else(|| unknown_kind(index, &accessor.kind))?])
    }

    fn elements<T: Copy + Default, const N: usize>(
        &self,
        index: usize,
        convert: impl Fn(u32, &[u8]) -> Option<T>,
    ) -> Result<Vec<[T; N]>, Error> {
        let accessor = member(&self.document.accessors, "accessor", index)?;
        let [_, components] = self.shape(index)?;
        if components != N {
            return Err(format!("accessor {index} holds {components} numbers an element instead of {N}").into());
        }
        let fails = |error: Error| Error::from(format!("accessor {index}: {error}"));
        let mut elements = match accessor.buffer_view {
            Some(view) => self.strided(accessor, view, &convert).map_err(fails)?,
            None if accessor.count.checked_mul(4 * N).is_some_and(|bytes| bytes <= self.limits.bytes) => {
                vec![[T::default(); N]; accessor.count]
            }
            None => return Err(fails(format!("{} zeros are too many", accessor.count).into())),
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut elements, accessor.component_type, sparse, &convert).map_err(fails)?;
        }
        Ok(elements)
    }

    fn strided<T: Copy + Default, const N: usize>(
        &self,
        accessor: &Accessor,
        view: usize,
        convert: &impl Fn(u32, &[u8]) -> Option<T>,
    ) -> Result<Vec<[T; N]>, Error> {
        let bytes = self.view(view)?;
        let size = size_of_component(accessor.component_type)?;
        let stride = self.document.buffer_views[view].byte_stride.unwrap_or(N * size);
        let rest = bytes.get(accessor.byte_offset..).unwrap_or_default();
        decode(rest, accessor.count, stride, accessor.component_type, convert)
    }

    fn replace<T: Copy + Default, const N: usize>(
        &self,
        elements: &mut [[T; N]],
        kind: u32,
        sparse: &Sparse,
        convert: &impl Fn(u32, &[u8]) -> Option<T>,
    ) -> Result<(), Error> {
        let Sparse { count, indices, values } = sparse;
        let rest = |view, offset| Ok::<_, Error>(self.view(view)?.get(offset..).unwrap_or_default());
        let places = rest(indices.buffer_view, indices.byte_offset)?;
        let stride = size_of_component(indices.component_type)?;
        let places: Vec<[u32; 1]> = decode(places, *count, stride, indices.component_type, &integer)?;
        let values = rest(values.buffer_view, values.byte_offset)?;
        let values: Vec<[T; N]> = decode(values, *count, N * size_of_component(kind)?, kind, convert)?;
        let length = elements.len();
        for ([place], value) in places.into_iter().zip(values) {
            let element = elements.get_mut(place as usize);
            *element.ok_or_else(|| format!("it replaces element {place} of {length}"))? = value;
        }
        Ok(())
    }
}

fn decode<T: Copy + Default, const N: usize>(
    bytes: &[u8],
    count: usize,
    stride: usize,
    kind: u32,
    convert: &impl Fn(u32, &[u8]) -> Option<T>,
) -> Result<Vec<[T; N]>, Error> {
    let size = size_of_component(kind)?;
    if stride < N * size {
        return Err(format!("its elements are {stride} bytes apart, but {} bytes long", N * size).into());
    }
    let needed = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(N * size));
    if needed.is_none_or(|needed| needed > bytes.len()) {
        return Err(format!("{count} elements do not fit into {} bytes", bytes.len()).into());
    }
    let mut elements = vec![[T::default(); N]; count];
    for (i, element) in elements.iter_mut().enumerate() {
        for (j, value) in element.iter_mut().enumerate() {
            let number = part(bytes, i * stride + j * size, size).and_then(|bytes| convert(kind, bytes));
            *value = number.ok_or_else(|| format!("it holds numbers of type {kind}, which it must not"))?;
        }
    }
    Ok(elements)
}

fn size_of_component(kind: u32) -> Result<usize, Error> {
    match kind {
        I8 | U8 => Ok(1),
        I16 | U16 => Ok(2),
        U32 | F32 => Ok(4),
        _ => Err(format!("there is no component type {kind}").into()),
    }
}

fn components(kind: &str) -> Option<usize> {
    match kind {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        "MAT4" => Some(16),
        _ => None,
    }
}

fn unknown_kind(index: usize, kind: &str) -> Error {
    format!("accessor {index} holds `{}`, which is not read", kind.escape_debug()).into()
}

fn float(kind: u32, normalized: bool, bytes: &[u8]) -> Option<f32> {
    if kind == F32 {
        return bytes.try_into().ok().map(f32::from_le_bytes);
    }
    let (value, largest) = match (kind, bytes) {
        (I8, &[byte]) => (f32::from(byte as i8), 127.0),
        (U8, &[byte]) => (f32::from(byte), 255.0),
        (I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        _ => return None,
    };
    Some(if normalized { (value / largest).max(-1.0) } else { value })
}

fn integer(kind: u32, bytes: &[u8]) -> Option<u32> {
    match (kind, bytes) {
        (U8, &[byte]) => Some(u32::from(byte)),
        (U16, &[a, b]) => Some(u32::from(u16::from_le_bytes([a, b]))),
        (U32, _) => bytes.try_into().ok().map(u32::from_le_bytes),
        _ => None,
    }
}
