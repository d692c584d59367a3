//! Any bytes behind the signature of a LAS file are a cloud or are refused by name.

/// Opens the bytes as a LAS, LAZ or COPC file and reads everything in it.
pub(crate) fn check(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    if let Some(signature) = bytes.get_mut(..4) {
        signature.copy_from_slice(b"LASF");
    }
    crate::ply::check(&bytes);
}
