//! Where the records of an element lie: at a fixed stride, or one behind the other where they hold lists.

use super::error::OpenError;
use super::mapped::MappedFile;
use super::ply_header::{Element, Kind};
use super::progress::Progress;
use super::scalar::Scalar;

/// Records between two reports of progress, and per parallel task.
pub(super) const CHUNK: u64 = 1 << 16;

/// The bytes of a file and its name for messages.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) path: &'a str,
    pub(super) bytes: &'a MappedFile,
}

impl Source<'_> {
    /// Says that so many bytes are done and not needed for now.
    pub(super) fn passed(&self, progress: &Progress<'_>, bytes: u64) {
        self.bytes.passed(bytes);
        progress.add(bytes);
    }
}

/// Start bytes of an element's records.
#[derive(Debug)]
pub(super) enum Records {
    /// Record `i` starts at `start + i * stride`.
    Fixed { start: u64, stride: u64 },
    /// Record `i` starts at entry `i`.
    Table(Vec<u64>),
}

impl Records {
    /// First byte of a record.
    #[inline]
    pub(super) fn at(&self, index: u64) -> usize {
        match self {
            Records::Fixed { start, stride } => (start + index * stride) as usize,
            Records::Table(starts) => starts[index as usize] as usize,
        }
    }
}

enum Step {
    Skip(u64),
    List { property: usize, length: Scalar, entry_bytes: u64 },
}

/// How to step over some properties of a record.
pub(super) struct Walk<'a> {
    source: Source<'a>,
    element: &'a Element,
    steps: Vec<Step>,
}

impl<'a> Walk<'a> {
    /// Steps over the properties `range` of an element.
    pub(super) fn new(source: Source<'a>, element: &'a Element, range: std::ops::Range<usize>) -> Walk<'a> {
        let mut steps = Vec::new();
        for property in range {
            match (element.properties[property].kind, steps.last_mut()) {
                (Kind::Number(scalar), Some(Step::Skip(bytes))) => *bytes += scalar.size() as u64,
                (Kind::Number(scalar), _) => steps.push(Step::Skip(scalar.size() as u64)),
                (Kind::List { length, entry }, _) => {
                    steps.push(Step::List { property, length, entry_bytes: entry.size() as u64 });
                }
            }
        }
        Walk { source, element, steps }
    }

    /// The common length in bytes of these properties, where they hold no list.
    pub(super) fn stride(&self) -> Option<u64> {
        match self.steps.as_slice() {
            [] => Some(0),
            [Step::Skip(bytes)] => Some(*bytes),
            _ => None,
        }
    }

    /// The byte behind these properties of record `index`, if they start at `at`.
    ///
    /// # Errors
    /// The file ends before, or a list has a negative length.
    #[inline]
    pub(super) fn end(&self, mut at: u64, index: u64) -> Result<u64, OpenError> {
        for step in &self.steps {
            at = match step {
                Step::Skip(bytes) => at + bytes,
                Step::List { property, length, entry_bytes } => {
                    let entries = self.list_length(*length, at, index, *property)?;
                    // Beyond any file where it saturates.
                    at.saturating_add(length.size() as u64).saturating_add(entries.saturating_mul(*entry_bytes))
                }
            };
        }
        if at > self.source.bytes.len() as u64 {
            return Err(self.truncated(index));
        }
        Ok(at)
    }

    /// Number of entries of the list at byte `at`.
    #[inline]
    pub(super) fn list_length(&self, length: Scalar, at: u64, index: u64, property: usize) -> Result<u64, OpenError> {
        let Some(bytes) = self.source.bytes.get(at as usize..(at as usize).saturating_add(length.size())) else {
            return Err(self.truncated(index));
        };
        let entries = length.integer(bytes);
        u64::try_from(entries).map_err(|_| OpenError::ListLength {
            path: self.source.path.to_owned(),
            element: self.element.name.clone(),
            index,
            property: self.element.properties[property].name.clone(),
            length: entries,
            byte: at,
        })
    }

    /// The error that the file ends within record `index`.
    pub(super) fn truncated(&self, index: u64) -> OpenError {
        OpenError::Truncated {
            path: self.source.path.to_owned(),
            bytes: self.source.bytes.len() as u64,
            element: self.element.name.clone(),
            index,
            count: self.element.count,
        }
    }

    /// The byte behind `count` records of a fixed stride.
    ///
    /// # Errors
    /// The file ends before.
    pub(super) fn fixed_end(&self, start: u64, stride: u64) -> Result<u64, OpenError> {
        let room = (self.source.bytes.len() as u64).saturating_sub(start);
        match self.element.count.checked_mul(stride) {
            Some(bytes) if bytes <= room => Ok(start + bytes),
            _ => Err(self.truncated(room / stride.max(1))),
        }
    }
}

/// Finds the records of an element that starts at byte `start`: their places, and the byte behind them.
/// Only `keep` makes a table where the records differ in length.
///
/// # Errors
/// The file ends before, or a list has a negative length.
pub(super) fn locate(
    source: Source<'_>,
    element: &Element,
    start: u64,
    keep: bool,
    progress: &Progress<'_>,
) -> Result<(Records, u64), OpenError> {
    let walk = Walk::new(source, element, 0..element.properties.len());
    if let Some(stride) = walk.stride() {
        return Ok((Records::Fixed { start, stride }, walk.fixed_end(start, stride)?));
    }
    let (mut starts, mut at, mut told) = (Vec::new(), start, start);
    for index in 0..element.count {
        if keep {
            starts.push(at);
        }
        at = walk.end(at, index)?;
        if index % CHUNK == CHUNK - 1 {
            source.passed(progress, at - told);
            told = at;
        }
    }
    Ok((Records::Table(starts), at))
}
