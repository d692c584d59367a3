//! Buffers of candidates, as the vector code wants them: one array per coordinate, aligned, padded.

use std::ops::{Deref, DerefMut};

/// Lanes that a vector store may write beyond the last candidate, and that hold far points after padding.
pub(super) const SLACK: usize = 128;

/// Coordinate of padding: so far away that no candidate is beyond it, and its square is still finite.
const FAR: f32 = 1e15;

/// A slice that starts at a cache line, since vector loads that straddle two lines cost twice.
#[derive(Debug, Default)]
pub(super) struct Aligned<T> {
    data: Vec<T>,
    start: usize,
    len: usize,
}

impl<T: Copy + Default> Aligned<T> {
    /// Makes the slice at least `len` long. Contents are lost when it grows.
    pub(super) fn grow(&mut self, len: usize) {
        if self.len < len {
            self.data = vec![T::default(); len + 64];
            self.start = self.data.as_ptr().align_offset(64).min(64);
            self.len = len;
        }
    }

    /// A new slice.
    pub(super) fn of(len: usize) -> Self {
        let mut new = Aligned { data: Vec::new(), start: 0, len: 0 };
        new.grow(len);
        new
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];
    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.data[self.start..self.start + self.len]
    }
}

impl<T> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.data[self.start..self.start + self.len]
    }
}

/// Candidates: coordinates relative to some centre (or to a vertex) and local triangle numbers.
#[derive(Debug, Default)]
pub(super) struct Points {
    /// East, metres.
    pub(super) x: Aligned<f32>,
    /// North, metres.
    pub(super) y: Aligned<f32>,
    /// Up, metres.
    pub(super) z: Aligned<f32>,
    /// Local triangle numbers.
    pub(super) id: Aligned<u32>,
    /// How many there are; what follows them is padding.
    pub(super) len: usize,
}

impl Points {
    /// Room for `len` points and the slack.
    pub(super) fn reserve(&mut self, len: usize) {
        self.x.grow(len + SLACK);
        self.y.grow(len + SLACK);
        self.z.grow(len + SLACK);
        self.id.grow(len + SLACK);
    }

    /// Whether `len` points and the slack fit.
    #[inline(always)]
    pub(super) fn fits(&self, len: usize) -> bool {
        let room = len + SLACK;
        self.x.len() >= room && self.y.len() >= room && self.z.len() >= room && self.id.len() >= room
    }

    /// Far points from the last candidate on, so that whole vectors can be read.
    #[inline(always)]
    pub(super) fn pad(&mut self, to: usize) {
        let n = self.len;
        self.x[n..to].fill(FAR);
        self.y[n..to].fill(FAR);
        self.z[n..to].fill(FAR);
    }
}
