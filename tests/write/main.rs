//! What the write stage puts on the disk, read back.

mod fixture;
mod geopackage;
mod labelled_mesh;
mod output_folder;
mod raster;
