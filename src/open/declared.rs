//! Whether a file is long enough for what its header declares: asked before anything large is read.

use super::error::OpenError;
use super::faces::CORNER_NAMES;
use super::ply_header::{Element, Kind, PlyHeader};
use super::records::Source;
use ply_rs_bw::ply::Encoding;

/// A shorter file is read anyway, so that the very record at which it ends is named.
const READ_ANYWAY_BYTES: u64 = 64 << 20;
/// A digit and a blank.
const LEAST_TEXT_BYTES: u64 = 2;

/// Refuses a file that is too short whatever its lists hold, if only every face has three corners.
///
/// # Errors
/// The element that goes beyond the end of the file.
pub(super) fn check_length(source: Source<'_>, header: &PlyHeader) -> Result<(), OpenError> {
    let bytes = source.bytes.len() as u64;
    if bytes < READ_ANYWAY_BYTES {
        return Ok(());
    }
    let is_text = header.encoding == Encoding::Ascii;
    // The last number of a text needs no blank behind it.
    let mut room = bytes - header.payload + u64::from(is_text);
    for element in &header.elements {
        let least = least_bytes(element, is_text);
        match element.count.checked_mul(least) {
            Some(needed) if needed <= room => room -= needed,
            _ => {
                return Err(OpenError::TooShort {
                    path: source.path.to_owned(),
                    bytes,
                    element: element.name.clone(),
                    index: room / least.max(1),
                    count: element.count,
                });
            }
        }
    }
    Ok(())
}

/// The shortest record of an element.
fn least_bytes(element: &Element, is_text: bool) -> u64 {
    let of = |scalar: super::scalar::Scalar| if is_text { LEAST_TEXT_BYTES } else { scalar.size() as u64 };
    let corners = |name: &str| if element.name == "face" && CORNER_NAMES.contains(&name) { 3 } else { 0 };
    let property = |p: &super::ply_header::Property| match p.kind {
        Kind::Number(scalar) => of(scalar),
        Kind::List { length, entry } => of(length) + corners(&p.name) * of(entry),
    };
    element.properties.iter().map(property).sum()
}
