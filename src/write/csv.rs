//! `grains.csv`: one row per grain, a header, LF, empty fields for what is not known.

use super::columns::{COLUMNS, Row};
use super::{Results, WriteError, atomic::Pending};
use std::fs::File;
use std::io::{self, BufWriter};

pub(crate) fn write(file: &Pending, results: &Results) -> Result<(), WriteError> {
    let write = || -> io::Result<()> {
        let out = BufWriter::new(File::create(&file.partial)?);
        let mut writer = ::csv::WriterBuilder::new().terminator(::csv::Terminator::Any(b'\n')).from_writer(out);
        writer.write_record(COLUMNS.iter().map(|c| c.name))?;
        for grain in &results.catalogue.grains {
            let row = Row::new(grain, results.frame, results.settings);
            for column in COLUMNS {
                writer.write_field((column.value)(&row).csv_text().as_bytes())?;
            }
            writer.write_record(None::<&[u8]>)?;
        }
        writer.flush()
    };
    write().map_err(|source| file.error("write the table of grains", source))
}
