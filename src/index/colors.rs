//! Colours as the input has them: bytes where they are bytes, else floats.

use crate::store::{Column, ColumnWriter, Element, Shelf, StoreError};
use std::ops::Range;

/// What stands for full colour in bytes.
const FULL_BYTE: f64 = 255.0;

/// Red, green and blue in the type in which they are kept.
pub(super) trait Color: Element + Default {
    /// Of a colour as [`crate::open::Surface::raw_color`] has it.
    fn of(raw: [f32; 3]) -> Self;
    /// The same again.
    fn raw(self) -> [f32; 3];
}

impl Color for [u8; 3] {
    #[inline(always)]
    fn of(raw: [f32; 3]) -> [u8; 3] {
        raw.map(|c| c as u8)
    }
    #[inline(always)]
    fn raw(self) -> [f32; 3] {
        self.map(f32::from)
    }
}

impl Color for [f32; 3] {
    #[inline(always)]
    fn of(raw: [f32; 3]) -> [f32; 3] {
        raw
    }
    #[inline(always)]
    fn raw(self) -> [f32; 3] {
        self
    }
}

/// The colours of all vertices, and what stands for full colour.
#[derive(Debug)]
pub enum Colors {
    /// Of one byte each; full colour is 255.
    Bytes(Column<[u8; 3]>),
    /// Floats, and their full colour.
    Floats(f64, Column<[f32; 3]>),
}

impl Colors {
    /// Whether colours of this full value are kept as bytes.
    pub(super) fn are_bytes(full: f64) -> bool {
        full == FULL_BYTE
    }

    pub(super) fn create(shelf: &Shelf, name: &str, len: u64, full: f64) -> Result<Colors, StoreError> {
        Ok(match Colors::are_bytes(full) {
            true => Colors::Bytes(shelf.create(name, len)?),
            false => Colors::Floats(full, shelf.create(name, len)?),
        })
    }

    pub(super) fn open(shelf: &Shelf, name: &str, len: u64, full: f64) -> Result<Colors, StoreError> {
        Ok(match Colors::are_bytes(full) {
            true => Colors::Bytes(shelf.open(name, len)?),
            false => Colors::Floats(full, shelf.open(name, len)?),
        })
    }

    /// What stands for full colour.
    pub fn full(&self) -> f64 {
        match self {
            Colors::Bytes(_) => FULL_BYTE,
            Colors::Floats(full, _) => *full,
        }
    }

    pub(super) fn writer(&self, first: u64) -> ColorsWriter<'_> {
        match self {
            Colors::Bytes(column) => ColorsWriter::Bytes(column.writer(first)),
            Colors::Floats(_, column) => ColorsWriter::Floats(column.writer(first)),
        }
    }

    pub(super) fn checksum(&self, range: Range<u64>) -> Result<u64, StoreError> {
        match self {
            Colors::Bytes(column) => column.checksum(range),
            Colors::Floats(_, column) => column.checksum(range),
        }
    }

    pub(super) fn sync(&self) -> Result<(), StoreError> {
        match self {
            Colors::Bytes(column) => column.sync(),
            Colors::Floats(_, column) => column.sync(),
        }
    }
}

/// Writes colours one behind the other.
pub(super) enum ColorsWriter<'a> {
    Bytes(ColumnWriter<'a, [u8; 3]>),
    Floats(ColumnWriter<'a, [f32; 3]>),
}

impl ColorsWriter<'_> {
    #[inline(always)]
    pub(super) fn put<C: Color>(&mut self, color: C) -> Result<(), StoreError> {
        match self {
            ColorsWriter::Bytes(writer) => writer.put(Color::of(color.raw())),
            ColorsWriter::Floats(writer) => writer.put(color.raw()),
        }
    }

    pub(super) fn finish(self) -> Result<u64, StoreError> {
        match self {
            ColorsWriter::Bytes(writer) => writer.finish(),
            ColorsWriter::Floats(writer) => writer.finish(),
        }
    }
}
