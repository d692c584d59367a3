//! Opening a survey: files become arrays in one frame. Knows formats and georeferencing, nothing else.

mod chunks;
mod crs;
mod draped;
mod error;
mod faces;
mod frame;
mod gdal_messages;
#[allow(dead_code, reason = "clouds in LAS are not opened by a run yet")]
mod las;
#[allow(dead_code, reason = "clouds in LAS are not opened by a run yet")]
mod las_crs;
#[allow(dead_code, reason = "clouds in LAS are not opened by a run yet")]
mod las_header;
mod las_records;
#[cfg(test)]
mod las_tests;
#[allow(dead_code, reason = "clouds in LAS are not opened by a run yet")]
mod laz_chunks;
mod mapped;
mod numbers;
mod ply;
mod ply_header;
mod precision;
mod progress;
mod quiet;
mod reach;
mod records;
mod scalar;
mod surface;
mod survey_file;
mod transcode;
mod vertices;
mod warning;

pub(crate) use chunks::{over_chunks, over_chunks_then, pieces};
pub use crs::GeoReference;
pub use draped::DrapedCloud;
pub use error::OpenError;
pub use frame::{Crs, Frame};
pub use gdal_messages::{gdal_failures, listen_to_gdal};
#[allow(unused_imports, reason = "clouds in LAS are not opened by a run yet")]
pub(crate) use las_header::{COPC_USER, LASZIP_RECORD, LasInput, MINOR_VERSION_AT, VariableRecord};
#[allow(unused_imports, reason = "clouds in LAS are not opened by a run yet")]
pub(crate) use laz_chunks::laz_items;
pub use reach::Reach;
pub use scalar::Scalar;
pub use surface::{MemorySurface, Surface};
pub use survey_file::{Fingerprint, SurveyFile};
pub use vertices::ScalarProperty;
pub use warning::Warning;
