//! What the write stage puts on the disk, read back.

mod fixture;
mod geopackage;
mod labelled_mesh;
mod output_folder;
mod raster;
#[path = "../support/small_disk.rs"]
#[allow(missing_docs, unreachable_pub)]
mod small_disk;
