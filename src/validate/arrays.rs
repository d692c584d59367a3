//! Whole numbers of NumPy files: `.npy`, and arrays of `.npz`.
//!
//! What a file declares is a claim: its header must be short, its length must be one that is asked for, and memory
//! grows with what is read.

use super::error::ValidateError;
use npyz::{DType, NpyFile, TypeChar};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Longest header that is read, bytes. That of a plain array has 128; the grammar of a longer one can be nested so
/// deeply that reading it takes all of the stack.
const LONGEST_HEADER: usize = 1024;

/// How an array's length may be.
pub(super) trait Lengths: Fn(u64) -> Result<(), ValidateError> {}
impl<F: Fn(u64) -> Result<(), ValidateError>> Lengths for F {}

/// The numbers of a `.npy` file, in the file's order. Unsigned numbers above 2^31 are negative ones in disguise.
pub(super) fn read_npy(path: &Path, check_length: impl Lengths) -> Result<Vec<i64>, ValidateError> {
    let file = File::open(path).map_err(|source| ValidateError::File { path: path.to_owned(), source })?;
    let source = Named { path, what: "the array".to_owned() };
    source.numbers(BufReader::with_capacity(1 << 18, file), check_length)
}

/// A `.npz` archive.
pub(super) struct Archive<'p> {
    path: &'p Path,
    zip: ZipArchive<BufReader<File>>,
    /// Names of the arrays, in the archive's order.
    pub(super) names: Vec<String>,
}

impl<'p> Archive<'p> {
    pub(super) fn open(path: &'p Path) -> Result<Archive<'p>, ValidateError> {
        let file = File::open(path).map_err(|source| ValidateError::File { path: path.to_owned(), source })?;
        let refused = |error: ZipError| Named { path, what: "the archive".to_owned() }.refused(error.to_string());
        let mut zip = ZipArchive::new(BufReader::new(file)).map_err(refused)?;
        let mut names = Vec::new();
        for i in 0..zip.len() {
            names.extend(zip.by_index_raw(i).map_err(refused)?.name().strip_suffix(".npy").map(str::to_owned));
        }
        Ok(Archive { path, zip, names })
    }

    /// The numbers of an array.
    pub(super) fn read(&mut self, name: &str, check_length: impl Lengths) -> Result<Vec<i64>, ValidateError> {
        if !self.names.iter().any(|n| n == name) {
            let found = if self.names.is_empty() { "none".to_owned() } else { self.names.join(", ") };
            return Err(ValidateError::ArrayMissing { path: self.path.to_owned(), name: name.to_owned(), found });
        }
        let source = Named { path: self.path, what: format!("array {name}") };
        match self.zip.by_name(&format!("{name}.npy")) {
            Ok(file) => source.numbers(BufReader::with_capacity(1 << 16, file), check_length),
            Err(error) => Err(source.refused(error.to_string())),
        }
    }
}

/// What is read, for messages.
struct Named<'p> {
    path: &'p Path,
    what: String,
}

impl Named<'_> {
    fn refused(&self, reason: impl Into<String>) -> ValidateError {
        ValidateError::Array { path: self.path.to_owned(), what: self.what.clone(), reason: reason.into() }
    }

    fn numbers(&self, mut reader: impl Read, check_length: impl Lengths) -> Result<Vec<i64>, ValidateError> {
        let header = self.header(&mut reader)?;
        let npy = NpyFile::new(header.as_slice().chain(reader)).map_err(|error| self.refused(error.to_string()))?;
        let length = npy.shape().iter().try_fold(1u64, |all, &n| all.checked_mul(n));
        let length = length.ok_or_else(|| self.refused(format!("its shape {:?} has no size", npy.shape())))?;
        check_length(length)?;
        match npy.dtype() {
            DType::Plain(kind) => match (kind.type_char(), kind.size_field()) {
                (TypeChar::Int, 1) => self.collect::<i8, _>(npy, length, i64::from),
                (TypeChar::Int, 2) => self.collect::<i16, _>(npy, length, i64::from),
                (TypeChar::Int, 4) => self.collect::<i32, _>(npy, length, i64::from),
                (TypeChar::Int, 8) => self.collect::<i64, _>(npy, length, |n| n),
                (TypeChar::Uint, 1) => self.collect::<u8, _>(npy, length, i64::from),
                (TypeChar::Uint, 2) => self.collect::<u16, _>(npy, length, i64::from),
                (TypeChar::Uint, 4) => self.collect::<u32, _>(npy, length, |n| no_wrapped(u64::from(n))),
                (TypeChar::Uint, 8) => self.collect::<u64, _>(npy, length, no_wrapped),
                _ => Err(self.refused(format!("it is of type {kind}, not of whole numbers"))),
            },
            _ => Err(self.refused("its elements are records, not whole numbers")),
        }
    }

    /// The file's first bytes, up to its numbers.
    fn header(&self, reader: &mut impl Read) -> Result<Vec<u8>, ValidateError> {
        let mut header = vec![0; 10];
        let cut = |error: std::io::Error| self.refused(error.to_string());
        reader.read_exact(&mut header).map_err(|_| self.refused("it is too short for a NumPy array"))?;
        if &header[..6] != b"\x93NUMPY" {
            return Err(self.refused("it does not begin as a NumPy array does"));
        }
        let mut length = usize::from(u16::from_le_bytes([header[8], header[9]]));
        // From version 2 on the length has four bytes.
        if header[6] > 1 {
            let mut more = [0; 2];
            reader.read_exact(&mut more).map_err(cut)?;
            length |= usize::from(u16::from_le_bytes(more)) << 16;
            header.extend(more);
        }
        if length > LONGEST_HEADER {
            return Err(self.refused(format!("its header has {length} bytes, more than a plain array needs")));
        }
        let start = header.len();
        header.resize(start + length, 0);
        reader.read_exact(&mut header[start..]).map_err(cut)?;
        Ok(header)
    }

    fn collect<T: npyz::Deserialize, R: Read>(
        &self,
        npy: NpyFile<R>,
        length: u64,
        whole: impl Fn(T) -> i64,
    ) -> Result<Vec<i64>, ValidateError> {
        let numbers = npy.data::<T>().map_err(|error| self.refused(error.to_string()))?;
        let mut read = Vec::new();
        for number in numbers {
            let number = number.map_err(|error| {
                self.refused(format!("it ends or breaks after {} of {length} numbers: {error}", read.len()))
            })?;
            read.push(whole(number));
        }
        Ok(read)
    }
}

/// What is far above any count of grains is -1 that lost its sign.
fn no_wrapped(number: u64) -> i64 {
    if number > 1 << 31 { -1 } else { number as i64 }
}
