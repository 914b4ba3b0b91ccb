//! Unpacks views that meshoptimizer compressed (`EXT_meshopt_compression`, `KHR_meshopt_compression`): attributes,
//! triangles and indices as the appendices A and B of the extensions lay them down.
//!
//! Attributes stand in blocks. In a block, the same byte of all elements stands together, as differences to the element
//! before it; groups of 16 differences take 0, 1, 2, 4 or 8 bits each. Triangles are coded by edges and vertices that
//! were used not long before.

use super::data::part;
use crate::render::Error;

/// Elements of a group. *Format.*
const GROUP: usize = 16;
/// Most bytes and most elements of a block. *Format.*
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;
/// Least bytes after the blocks, by version. *Format.*
const TAIL: [usize; 2] = [32, 24];
/// Bytes after triangles and after indices. *Format.*
const TABLE: usize = 16;
const PADDING: usize = 4;
/// Largest element in bytes. *Format.*
const LARGEST: usize = 256;

/// Unpacks `count` elements of `stride` bytes.
pub(super) fn decode(source: &[u8], count: usize, stride: usize, mode: &str, filter: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = match mode {
        "ATTRIBUTES" => attributes(source, count, stride)?,
        "TRIANGLES" => narrowed(&triangles(source, count)?, stride)?,
        "INDICES" => narrowed(&sequence(source, count)?, stride)?,
        _ => return Err(format!("there is no mode `{}`", mode.escape_debug()).into()),
    };
    match filter {
        // Filtered normals and tangents are not used here.
        "NONE" | "OCTAHEDRAL" => {}
        "EXPONENTIAL" => exponential(&mut bytes),
        "QUATERNION" if stride == 8 => quaternions(&mut bytes),
        "COLOR" if stride == 4 => colors::<1>(&mut bytes),
        "COLOR" if stride == 8 => colors::<2>(&mut bytes),
        _ => return Err(format!("there is no filter `{}` of {stride} bytes", filter.escape_debug()).into()),
    }
    Ok(bytes)
}

/// Bytes from front to back.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Error> {
        let taken = part(self.bytes, self.at, count).ok_or("its data ends too early")?;
        self.at += count;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Error> {
        Ok(self.take(1)?[0])
    }

    /// Refuses data of which more or less than `rest` bytes are left.
    fn ends_before(&self, rest: usize) -> Result<(), Error> {
        if self.at + rest == self.bytes.len() { Ok(()) } else { Err("its data is of another length".into()) }
    }

    /// A number in groups of seven bits.
    fn varint(&mut self) -> Result<u32, Error> {
        let mut number = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            number |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(number);
            }
        }
        Err("one of its numbers is too long".into())
    }
}

/// The signed number of a zigzag code.
const fn unzigzag(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

fn attributes(source: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Error> {
    if stride == 0 || stride > LARGEST || !stride.is_multiple_of(4) {
        return Err(format!("its elements cannot be {stride} bytes long").into());
    }
    let packed_by_channels = match source.first() {
        Some(0xa0) => false,
        Some(0xa1) => true,
        _ => return Err("it holds no attributes".into()),
    };
    let tail = stride + if packed_by_channels { stride / 4 } else { 0 };
    let tail = source.len().checked_sub(tail).map(|start| &source[start..]).ok_or("its data ends too early")?;
    let (first, channels) = tail.split_at(stride);
    let channels: Vec<u8> = if packed_by_channels { channels.to_vec() } else { vec![0; stride / 4] };

    let mut last = first.to_vec();
    let mut cursor = Cursor { bytes: source, at: 1 };
    let mut elements = Vec::with_capacity(count * stride);
    let block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    let mut left = count;
    while left > 0 {
        let size = left.min(block);
        let deltas = block_of_deltas(&mut cursor, size, stride, packed_by_channels)?;
        for i in 0..size {
            for (channel, word) in last.chunks_exact_mut(4).enumerate() {
                let delta = core::array::from_fn(|byte| deltas[(4 * channel + byte) * block + i]);
                add(word, delta, channels[channel])?;
            }
            elements.extend_from_slice(&last);
        }
        left -= size;
    }
    let padded = tail.len().max(if packed_by_channels { TAIL[1] } else { TAIL[0] });
    cursor.ends_before(padded).map(|()| elements)
}

/// Differences of a block, in rows of one byte of all elements.
fn block_of_deltas(
    cursor: &mut Cursor<'_>,
    size: usize,
    stride: usize,
    packed_by_channels: bool,
) -> Result<Vec<u8>, Error> {
    let row = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    let groups = size.div_ceil(GROUP);
    let controls = cursor.take(if packed_by_channels { stride / 4 } else { 0 })?;
    let mut deltas = vec![0; row * stride];
    for (byte, deltas) in deltas.chunks_exact_mut(row).enumerate() {
        let control = controls.get(byte / 4).map(|control| control >> (byte % 4 * 2) & 3);
        let widths = match control {
            None => [0, 2, 4, 8],
            Some(0) => [0, 1, 2, 4],
            Some(1) => [1, 2, 4, 8],
            Some(2) => continue,
            Some(_) => {
                deltas[..size].copy_from_slice(cursor.take(size)?);
                continue;
            }
        };
        let modes = cursor.take(groups.div_ceil(4))?;
        for (group, deltas) in deltas.chunks_exact_mut(GROUP).take(groups).enumerate() {
            let mode = modes[group / 4] >> (group % 4 * 2) & 3;
            group_of_deltas(cursor, widths[usize::from(mode)], deltas)?;
        }
    }
    Ok(deltas)
}

/// Differences of the given number of bits. The largest of them says that a whole byte follows.
fn group_of_deltas(cursor: &mut Cursor<'_>, bits: usize, deltas: &mut [u8]) -> Result<(), Error> {
    if bits == 0 {
        return Ok(());
    }
    let packed = cursor.take(GROUP * bits / 8)?;
    if bits == 8 {
        deltas.copy_from_slice(packed);
        return Ok(());
    }
    let escape = (1 << bits) - 1;
    for (i, delta) in deltas.iter_mut().enumerate() {
        let place = i * bits % 8;
        // Single bits stand from low to high, others from high to low.
        let shift = if bits == 1 { place } else { 8 - bits - place };
        let code = packed[i * bits / 8] >> shift & escape;
        *delta = if code == escape { cursor.byte()? } else { code };
    }
    Ok(())
}

/// Adds a difference to four bytes, in the way of their channel.
fn add(word: &mut [u8], delta: [u8; 4], channel: u8) -> Result<(), Error> {
    match channel & 3 {
        0 => {
            for (byte, delta) in word.iter_mut().zip(delta) {
                *byte = byte.wrapping_add(unzigzag(u32::from(delta)) as u8);
            }
        }
        1 => {
            for (pair, delta) in word.chunks_exact_mut(2).zip(delta.chunks_exact(2)) {
                let delta = unzigzag(u32::from(u16::from_le_bytes([delta[0], delta[1]]))) as u16;
                let sum = u16::from_le_bytes([pair[0], pair[1]]).wrapping_add(delta);
                pair.copy_from_slice(&sum.to_le_bytes());
            }
        }
        2 => {
            let turned = u32::from_le_bytes(delta).rotate_right(u32::from(channel >> 4));
            let turned = turned.to_le_bytes();
            word.iter_mut().zip(turned).for_each(|(byte, delta)| *byte ^= delta);
        }
        _ => return Err("one of its channels is of an unknown kind".into()),
    }
    Ok(())
}

/// The last values that were used.
struct Recent<T, const N: usize> {
    values: [T; N],
    next: usize,
}

impl<T: Copy + Default, const N: usize> Recent<T, N> {
    fn new() -> Self {
        Self { values: [T::default(); N], next: 0 }
    }

    fn push(&mut self, value: T) -> T {
        self.values[self.next % N] = value;
        self.next = (self.next + 1) % N;
        value
    }

    /// The value that was pushed the given number of pushes before the last one.
    fn get(&self, age: usize) -> T {
        self.values[(self.next + 2 * N - 1 - age) % N]
    }
}

/// What is known of the vertices while triangles are decoded.
struct Vertices<'a> {
    next: u32,
    last: u32,
    recent: Recent<u32, 16>,
    data: Cursor<'a>,
}

impl Vertices<'_> {
    const fn new_one(&mut self) -> u32 {
        let vertex = self.next;
        self.next = vertex.wrapping_add(1);
        vertex
    }

    fn coded(&mut self) -> Result<u32, Error> {
        self.last = self.last.wrapping_add(unzigzag(self.data.varint()?));
        Ok(self.last)
    }

    /// The third vertex of a triangle at an edge.
    fn opposite(&mut self, code: u8) -> Result<u32, Error> {
        let vertex = match code {
            0 => self.new_one(),
            1..=12 => return Ok(self.recent.get(usize::from(code))),
            13 => {
                self.last = self.last.wrapping_sub(1);
                self.last
            }
            14 => {
                self.last = self.last.wrapping_add(1);
                self.last
            }
            _ => self.coded()?,
        };
        Ok(self.recent.push(vertex))
    }

    /// The second or third vertex of a triangle of its own, and whether it is to be remembered.
    fn of_four_bits(&mut self, code: u8, may_be_coded: bool) -> Result<(u32, bool), Error> {
        match code {
            0 => Ok((self.new_one(), true)),
            15 if may_be_coded => Ok((self.coded()?, true)),
            _ => Ok((self.recent.get(usize::from(code) - 1), false)),
        }
    }

    /// A triangle that shares no edge with those before it.
    fn separate(&mut self, code: u8, pairs: &[u8]) -> Result<[u32; 3], Error> {
        let is_listed = code < 14;
        let pair = if is_listed { pairs[usize::from(code)] } else { self.data.byte()? };
        if !is_listed && pair == 0 {
            self.next = 0;
        }
        let a = if code == 15 { self.coded()? } else { self.new_one() };
        let (b, remember_b) = self.of_four_bits(pair >> 4, !is_listed)?;
        let (c, remember_c) = self.of_four_bits(pair & 15, !is_listed)?;
        self.recent.push(a);
        for (vertex, remember) in [(b, remember_b), (c, remember_c)] {
            if remember {
                self.recent.push(vertex);
            }
        }
        Ok([a, b, c])
    }
}

fn triangles(source: &[u8], count: usize) -> Result<Vec<u32>, Error> {
    if source.first() != Some(&0xe1) || !count.is_multiple_of(3) {
        return Err("it holds no triangles".into());
    }
    let codes = part(source, 1, count / 3).ok_or("its data ends too early")?;
    let pairs = source.len().checked_sub(TABLE).map(|start| &source[start..]).ok_or("its data ends too early")?;
    let data = Cursor { bytes: source, at: 1 + count / 3 };
    let mut vertices = Vertices { next: 0, last: 0, recent: Recent::new(), data };
    let mut edges = Recent::<[u32; 2], 16>::new();
    let mut indices = Vec::with_capacity(count);
    for code in codes {
        let (edge, vertex) = (code >> 4, code & 15);
        let [a, b, c] = if edge < 15 {
            let [a, b] = edges.get(usize::from(edge));
            let c = vertices.opposite(vertex)?;
            edges.push([c, b]);
            edges.push([a, c]);
            [a, b, c]
        } else {
            let [a, b, c] = vertices.separate(vertex, pairs)?;
            edges.push([b, a]);
            edges.push([c, b]);
            edges.push([a, c]);
            [a, b, c]
        };
        indices.extend([a, b, c]);
    }
    vertices.data.ends_before(TABLE).map(|()| indices)
}

fn sequence(source: &[u8], count: usize) -> Result<Vec<u32>, Error> {
    if source.first() != Some(&0xd1) {
        return Err("it holds no indices".into());
    }
    // Each takes a byte at least.
    if count > source.len() {
        return Err("its data ends too early".into());
    }
    let mut data = Cursor { bytes: source, at: 1 };
    let mut last = [0_u32; 2];
    let mut next = || {
        let code = data.varint()?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(unzigzag(code >> 1));
        Ok(*last)
    };
    let indices = (0..count).map(|_| next()).collect::<Result<_, Error>>()?;
    data.ends_before(PADDING).map(|()| indices)
}

/// Indices of two or four bytes.
fn narrowed(indices: &[u32], stride: usize) -> Result<Vec<u8>, Error> {
    match stride {
        2 => Ok(indices.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect()),
        4 => Ok(indices.iter().flat_map(|index| index.to_le_bytes()).collect()),
        _ => Err(format!("its indices cannot be {stride} bytes long").into()),
    }
}

/// Numbers with a shared exponent of base two each.
fn exponential(bytes: &mut [u8]) {
    for word in bytes.as_chunks_mut::<4>().0 {
        let code = i32::from_le_bytes(*word);
        let (exponent, mantissa) = (code >> 24, code << 8 >> 8);
        *word = (mantissa as f32 * (exponent as f32).exp2()).to_le_bytes();
    }
}

/// Quaternions without their largest component, which the lowest two bits name.
fn quaternions(bytes: &mut [u8]) {
    for quaternion in bytes.as_chunks_mut::<8>().0 {
        let code = |i: usize| i16::from_le_bytes([quaternion[2 * i], quaternion[2 * i + 1]]);
        let scale = core::f32::consts::FRAC_1_SQRT_2 / f32::from(code(3) | 3);
        let [x, y, z] = [0, 1, 2].map(|i| f32::from(code(i)) * scale);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let largest = usize::from(code(3) as u16 & 3);
        for (i, value) in [w, x, y, z].into_iter().enumerate() {
            let place = 2 * ((largest + i) % 4);
            quaternion[place..place + 2].copy_from_slice(&((value * 32767.0).round() as i16).to_le_bytes());
        }
    }
}

/// Colors as brightness and two differences, with a scale in the alpha's highest bit; a channel takes `BYTES` bytes.
fn colors<const BYTES: usize>(bytes: &mut [u8]) {
    for color in bytes.chunks_exact_mut(4 * BYTES) {
        let bits =
            |i: usize| (0..BYTES).fold(0_i32, |sum, byte| sum | i32::from(color[i * BYTES + byte]) << (8 * byte));
        let shift = 32 - 8 * BYTES;
        let signed = |i: usize| bits(i) << shift >> shift;
        let (y, co, cg, alpha) = (bits(0), signed(1), signed(2), bits(3));
        let largest = (1 << (32 - alpha.leading_zeros())) - 1;
        let rest = alpha & (largest >> 1);
        let values = [y + co - cg, y + cg, y - co - cg, rest << 1 | rest & 1];
        let scale = ((1_i64 << (8 * BYTES)) - 1) as f32 / largest.max(1) as f32;
        for (channel, value) in color.chunks_exact_mut(BYTES).zip(values) {
            let value = (value as f32 * scale).round() as u32;
            channel.copy_from_slice(&value.to_le_bytes()[..BYTES]);
        }
    }
}
