//! Numbers of vertices and triangles, as narrow as the survey allows.

use crate::store::{Column, ColumnWriter, Element, Shelf, StoreError};
use std::ops::Range;

/// A number of a vertex or triangle: 32 bits where all of a survey fit, else 64.
pub(super) trait Id: Element + Ord + Default {
    /// Of a number that fits.
    fn of(number: u64) -> Self;
    /// The number.
    fn number(self) -> u64;
}

impl Id for u32 {
    #[inline(always)]
    fn of(number: u64) -> u32 {
        debug_assert!(number <= u64::from(u32::MAX));
        number as u32
    }
    #[inline(always)]
    fn number(self) -> u64 {
        u64::from(self)
    }
}

impl Id for u64 {
    #[inline(always)]
    fn of(number: u64) -> u64 {
        number
    }
    #[inline(always)]
    fn number(self) -> u64 {
        self
    }
}

/// A column of numbers, or of a few numbers each, as narrow as the survey allows.
#[derive(Debug)]
pub(super) enum Numbers<const N: usize> {
    Narrow(Column<[u32; N]>),
    Wide(Column<[u64; N]>),
}

impl<const N: usize> Numbers<N> {
    pub(super) fn create(shelf: &Shelf, name: &str, len: u64, wide: bool) -> Result<Numbers<N>, StoreError> {
        Ok(if wide { Numbers::Wide(shelf.create(name, len)?) } else { Numbers::Narrow(shelf.create(name, len)?) })
    }

    pub(super) fn open(shelf: &Shelf, name: &str, len: u64, wide: bool) -> Result<Numbers<N>, StoreError> {
        Ok(if wide { Numbers::Wide(shelf.open(name, len)?) } else { Numbers::Narrow(shelf.open(name, len)?) })
    }

    /// Hands the numbers of a range to `take`, in order, some at a time.
    pub(super) fn each_slice(&self, range: Range<u64>, take: impl FnMut(&[[u64; N]])) -> Result<(), StoreError> {
        match self {
            Numbers::Narrow(column) => column.each_slice(range, |numbers| numbers.map(u64::from), take),
            Numbers::Wide(column) => column.each_slice(range, |numbers| numbers, take),
        }
    }

    pub(super) fn writer(&self, first: u64) -> NumbersWriter<'_, N> {
        match self {
            Numbers::Narrow(column) => NumbersWriter::Narrow(column.writer(first)),
            Numbers::Wide(column) => NumbersWriter::Wide(column.writer(first)),
        }
    }

    pub(super) fn len(&self) -> u64 {
        match self {
            Numbers::Narrow(column) => column.len(),
            Numbers::Wide(column) => column.len(),
        }
    }

    pub(super) fn is_wide(&self) -> bool {
        matches!(self, Numbers::Wide(_))
    }

    pub(super) fn checksum(&self, range: Range<u64>) -> Result<u64, StoreError> {
        match self {
            Numbers::Narrow(column) => column.checksum(range),
            Numbers::Wide(column) => column.checksum(range),
        }
    }

    pub(super) fn sync(&self) -> Result<(), StoreError> {
        match self {
            Numbers::Narrow(column) => column.sync(),
            Numbers::Wide(column) => column.sync(),
        }
    }
}

/// Writes numbers one behind the other.
pub(super) enum NumbersWriter<'a, const N: usize> {
    Narrow(ColumnWriter<'a, [u32; N]>),
    Wide(ColumnWriter<'a, [u64; N]>),
}

impl<const N: usize> NumbersWriter<'_, N> {
    #[inline(always)]
    pub(super) fn put(&mut self, numbers: [u64; N]) -> Result<(), StoreError> {
        match self {
            NumbersWriter::Narrow(writer) => writer.put(numbers.map(u32::of)),
            NumbersWriter::Wide(writer) => writer.put(numbers),
        }
    }

    pub(super) fn finish(self) -> Result<u64, StoreError> {
        match self {
            NumbersWriter::Narrow(writer) => writer.finish(),
            NumbersWriter::Wide(writer) => writer.finish(),
        }
    }
}
