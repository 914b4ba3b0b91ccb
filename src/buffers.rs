//! Plain-data buffers, and the sections of bytes that they are written to.
//!
//! A structure lists its buffers once, with [`buffers!`]. The owned form, the borrowed form, the sizes, the writer and
//! the reader all come from that list, so that a new buffer is one line.
//!
//! # Layout of the bytes
//!
//! A [`Header`], one [`Entry`] for each section, then the sections one after the other. A section is an array of plain
//! data under a tag of four letters, with a version of its own. Every section starts at a multiple of [`ALIGNMENT`] and
//! all numbers are in the byte order of the machine that wrote them.

use alloc::vec::Vec;
use core::fmt;

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

use crate::error::Error;

const MAGIC: [u8; 8] = *b"fanlight";

/// Version of the container: of [`Header`] and [`Entry`], not of what the sections hold. *Format.*
const CONTAINER_VERSION: u32 = 3;

/// A number that reads differently on a machine of the other byte order. *Format.*
const BYTE_ORDER: u32 = 0x0102_0304;

/// Every section starts at a multiple of this many bytes: all arrays consist of 4-byte numbers. *Format.*
pub(crate) const ALIGNMENT: usize = 4;

/// Four letters that name a section.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct Tag(pub(crate) [u8; 4]);

const _: () = assert!(size_of::<Tag>() == 4);

impl fmt::Debug for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.escape_ascii().fmt(f)
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Header {
    magic: [u8; 8],
    byte_order: u32,
    container_version: u32,
    /// Number of entries.
    sections: u32,
    padding: u32,
}

const _: () = assert!(size_of::<Header>() == 24);

/// Where a section is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Entry {
    tag: Tag,
    version: u32,
    /// Length in bytes.
    length: u64,
}

const _: () = assert!(size_of::<Entry>() == 16);

/// A section that is to be written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section<'a> {
    pub(crate) tag: Tag,
    pub(crate) version: u32,
    pub(crate) bytes: &'a [u8],
}

impl<'a> Section<'a> {
    pub(crate) fn new<T: NoUninit>(tag: [u8; 4], version: u32, values: &'a [T]) -> Self {
        Self { tag: Tag(tag), version, bytes: bytemuck::cast_slice(values) }
    }
}

/// Writes sections one after the other, with a table of them in front.
pub(crate) fn write(sections: &[Section<'_>]) -> Vec<u8> {
    let header = Header {
        magic: MAGIC,
        byte_order: BYTE_ORDER,
        container_version: CONTAINER_VERSION,
        sections: sections.len() as u32,
        padding: 0,
    };
    let mut bytes = bytemuck::bytes_of(&header).to_vec();
    for section in sections {
        let entry = Entry { tag: section.tag, version: section.version, length: section.bytes.len() as u64 };
        bytes.extend_from_slice(bytemuck::bytes_of(&entry));
    }
    sections.iter().for_each(|section| bytes.extend_from_slice(section.bytes));
    bytes
}

/// The sections of bytes that came from elsewhere. Each is taken once; [`Self::end`] makes sure that none is left.
#[derive(Debug)]
pub(crate) struct Sections<'a> {
    bytes: &'a [u8],
    count: usize,
    taken: usize,
}

impl<'a> Sections<'a> {
    /// Checks the header and the table.
    ///
    /// # Errors
    ///
    /// If the bytes do not start at a multiple of [`ALIGNMENT`], are cut off or too long, or of another container
    /// version or byte order.
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        let misaligned = bytes.as_ptr() as usize % ALIGNMENT;
        Error::unless_equal("alignment", misaligned, 0)?;
        let Some(header) = bytes.get(..size_of::<Header>()) else {
            return Err(Error::bytes("header", 0, bytes.len(), size_of::<Header>()));
        };
        let header: Header = bytemuck::pod_read_unaligned(header);
        let expect = |what, found: u64, expected: u64| {
            if found == expected { Ok(()) } else { Err(Error::bytes(what, 0, found, expected)) }
        };
        expect("magic number", u64::from_le_bytes(header.magic), u64::from_le_bytes(MAGIC))?;
        expect("byte order", header.byte_order.into(), BYTE_ORDER.into())?;
        expect("container version", header.container_version.into(), CONTAINER_VERSION.into())?;
        let count = header.sections as usize;
        let table = count.checked_mul(size_of::<Entry>()).and_then(|table| table.checked_add(size_of::<Header>()));
        let Some(mut end) = table.filter(|end| *end <= bytes.len()) else {
            return Err(Error::bytes("table of sections", size_of::<Header>(), bytes.len(), header.sections));
        };
        let sections = Self { bytes, count, taken: 0 };
        for i in 0..count {
            let length = sections.entry(i).length;
            let left = bytes.len() - end;
            match usize::try_from(length) {
                Ok(length) if length <= left && length % ALIGNMENT == 0 => end += length,
                _ => return Err(Error::bytes("length of section", i, length, left)),
            }
        }
        Error::unless_equal("number of bytes", bytes.len(), end)?;
        Ok(sections)
    }

    fn entry(&self, index: usize) -> Entry {
        let start = size_of::<Header>() + index * size_of::<Entry>();
        bytemuck::pod_read_unaligned(&self.bytes[start..start + size_of::<Entry>()])
    }

    /// Takes the section of a tag.
    ///
    /// # Errors
    ///
    /// If there is none, it has another version, or its length is no multiple of that of an element.
    pub(crate) fn take<T: AnyBitPattern + NoUninit>(
        &mut self,
        tag: [u8; 4],
        version: u32,
        what: &'static str,
    ) -> Result<&'a [T], Error> {
        let mut start = size_of::<Header>() + self.count * size_of::<Entry>();
        for i in 0..self.count {
            let entry = self.entry(i);
            let end = start + entry.length as usize;
            if entry.tag == Tag(tag) {
                if entry.version != version {
                    return Err(Error::section(what, entry.version, version));
                }
                self.taken += 1;
                let bytes = &self.bytes[start..end];
                return bytemuck::try_cast_slice(bytes)
                    .map_err(|_| Error::bytes(what, start, bytes.len(), size_of::<T>()));
            }
            start = end;
        }
        Err(Error::bytes(what, 0, 0u64, 1u64))
    }

    /// Takes a section that holds a single value.
    ///
    /// # Errors
    ///
    /// As [`Self::take`], and if there is not one value.
    pub(crate) fn take_value<T: AnyBitPattern + NoUninit>(
        &mut self,
        tag: [u8; 4],
        version: u32,
        what: &'static str,
    ) -> Result<T, Error> {
        match self.take::<T>(tag, version, what)? {
            [value] => Ok(*value),
            values => Err(Error::bytes(what, 0, values.len(), 1)),
        }
    }

    /// Checks that every section has been taken.
    ///
    /// # Errors
    ///
    /// If there is a section that this build does not know.
    pub(crate) fn end(self) -> Result<(), Error> {
        Error::unless_equal("number of sections", self.count, self.taken)
    }
}

/// Declares a structure of buffers in its owned and its borrowed form.
///
/// `plain` fields are copied as they are and written by whoever owns the structure.
macro_rules! buffers {
    (
        $(#[$attribute:meta])*
        $visibility:vis $owner:ident,
        $(#[$view_attribute:meta])*
        $view:ident
        plain { $($(#[$plain_attribute:meta])* $plain:ident: $plain_type:ty,)* }
        buffers { $($(#[$buffer_attribute:meta])* $buffer:ident: $element:ty = $tag:literal version $version:literal,)* }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, PartialEq)]
        $visibility struct $owner {
            $($(#[$plain_attribute])* pub(crate) $plain: $plain_type,)*
            $($(#[$buffer_attribute])* pub(crate) $buffer: alloc::vec::Vec<$element>,)*
        }

        $(#[$view_attribute])*
        #[derive(Clone, Copy)]
        $visibility struct $view<'a> {
            $($(#[$plain_attribute])* pub(crate) $plain: $plain_type,)*
            $($(#[$buffer_attribute])* pub(crate) $buffer: &'a [$element],)*
        }

        impl $owner {
            /// Returns the borrowed form, which all sampling works on.
            #[inline]
            pub(crate) fn view(&self) -> $view<'_> {
                $view { $($plain: self.$plain,)* $($buffer: &self.$buffer,)* }
            }
        }

        impl<'a> $view<'a> {
            /// Appends a section for each buffer.
            pub(crate) fn append_sections(&self, sections: &mut alloc::vec::Vec<$crate::buffers::Section<'a>>) {
                $(sections.push($crate::buffers::Section::new(*$tag, $version, self.$buffer));)*
            }

            /// Borrows the buffers from their sections. What they hold is not checked here.
            pub(crate) fn from_sections(
                sections: &mut $crate::buffers::Sections<'a>,
                ($($plain,)*): ($($plain_type,)*),
            ) -> Result<Self, $crate::error::Error> {
                Ok(Self { $($plain,)* $($buffer: sections.take(*$tag, $version, stringify!($buffer))?,)* })
            }

            /// Returns the number of bytes that the buffers take.
            pub(crate) fn byte_size(&self) -> usize {
                0 $(+ size_of_val(self.$buffer))*
            }
        }

        impl core::fmt::Debug for $view<'_> {
            /// Shows the number of elements of each buffer, not the elements.
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($owner))
                    $(.field(stringify!($plain), &self.$plain))*
                    $(.field(stringify!($buffer), &self.$buffer.len()))*
                    .finish()
            }
        }

        impl core::fmt::Debug for $owner {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                self.view().fmt(f)
            }
        }
    };
}

pub(crate) use buffers;

/// Implements `Debug` of a large structure by what is worth a line of a log: counts, sizes and single numbers.
macro_rules! debug_counts {
    ($name:ident$(<$lifetime:lifetime>)?, $this:ident => { $($field:ident: $value:expr),* $(,)? }) => {
        impl core::fmt::Debug for $name$(<$lifetime>)? {
            /// Shows counts and sizes, not contents.
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let $this = self;
                f.debug_struct(stringify!($name))$(.field(stringify!($field), &$value))*.finish()
            }
        }
    };
}

pub(crate) use debug_counts;

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    buffers! {
        /// Two buffers.
        pub(crate) Pair,
        /// Two borrowed buffers.
        PairView
        plain {
            /// A number.
            count: u32,
        }
        buffers {
            /// Numbers.
            numbers: u32 = b"NUMB" version 1,
            /// Halves.
            halves: f32 = b"HALF" version 2,
        }
    }

    fn aligned(bytes: &[u8]) -> Vec<u32> {
        bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
    }

    fn bytes_of(pair: &Pair) -> Vec<u32> {
        let mut sections = Vec::new();
        pair.view().append_sections(&mut sections);
        aligned(&write(&sections))
    }

    fn read(words: &[u32]) -> Result<Pair, Error> {
        let mut sections = Sections::new(bytemuck::cast_slice(words))?;
        let view = PairView::from_sections(&mut sections, (7,))?;
        sections.end()?;
        Ok(Pair { count: view.count, numbers: view.numbers.to_vec(), halves: view.halves.to_vec() })
    }

    #[test]
    fn buffers_come_back() {
        let pair = Pair { count: 7, numbers: vec![1, 2, 3], halves: vec![0.5] };
        assert_eq!(read(&bytes_of(&pair)), Ok(pair.clone()));
        assert_eq!(pair.view().byte_size(), 16);
        assert_eq!(std::format!("{pair:?}"), "Pair { count: 7, numbers: 3, halves: 1 }");
        let empty = Pair { count: 7, numbers: vec![], halves: vec![] };
        assert_eq!(read(&bytes_of(&empty)), Ok(empty.clone()));
    }

    #[test]
    fn every_changed_word_of_header_and_table_is_an_error() {
        let words = bytes_of(&Pair { count: 7, numbers: vec![1, 2, 3], halves: vec![0.5] });
        let front = (size_of::<Header>() + 2 * size_of::<Entry>()) / 4;
        let padding = 5;
        for at in (0..front).filter(|at| *at != padding) {
            for change in [1, 1 << 8, 1 << 31] {
                let mut changed = words.clone();
                changed[at] ^= change;
                assert!(read(&changed).is_err(), "word {at} changed by {change:#x}");
            }
        }
        for end in 0..words.len() {
            assert!(read(&words[..end]).is_err());
        }
    }

    #[test]
    fn a_section_of_another_version_or_of_no_use_is_named() {
        let numbers = [1u32];
        let sections = |version, tag| [Section::new(*b"NUMB", version, &numbers), Section::new(tag, 2, &numbers)];
        let message = |sections: &[Section<'_>]| read(&aligned(&write(sections))).unwrap_err();
        let version = message(&sections(9, *b"HALF"));
        assert!(std::format!("{version}").contains("numbers") && std::format!("{version}").contains('9'), "{version}");
        assert!(std::format!("{}", message(&sections(1, *b"OTHR"))).contains("halves"));
        let three = [sections(1, *b"HALF").to_vec(), vec![Section::new(*b"MORE", 1, &numbers)]].concat();
        assert!(std::format!("{}", message(&three)).contains("number of sections"));
    }
}
