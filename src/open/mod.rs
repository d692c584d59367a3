//! Opening a survey: files become arrays in one frame. Knows formats and georeferencing, nothing else.

mod bits;
mod chunks;
mod crs;
mod draped;
mod error;
mod faces;
mod frame;
mod gdal_messages;
mod mapped;
mod numbers;
mod ply;
mod ply_header;
mod precision;
mod progress;
mod reach;
mod records;
mod scalar;
mod surface;
mod survey_file;
mod transcode;
mod vertices;
mod warning;

pub(crate) use bits::Bits;
pub(crate) use chunks::{over_chunks, over_chunks_then, pieces};
pub use crs::GeoReference;
pub use draped::DrapedCloud;
pub use error::OpenError;
pub use frame::{Crs, Frame};
pub use gdal_messages::{gdal_failures, listen_to_gdal};
pub use reach::Reach;
pub use scalar::Scalar;
pub use surface::{MemorySurface, Surface};
pub use survey_file::{Fingerprint, SurveyFile};
pub use vertices::ScalarProperty;
pub use warning::Warning;
