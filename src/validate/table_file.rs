//! Tables of numbers: some columns of a comma-separated file, by name.

use super::error::ValidateError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The columns that were asked for and are there; an empty field or `nan` is none.
pub(super) struct NumberTable {
    path: PathBuf,
    header: Vec<String>,
    columns: BTreeMap<&'static str, Vec<Option<f64>>>,
    pub(super) rows: usize,
}

/// A line of the file for a row from 0: the header is the first.
fn line(row: usize) -> u64 {
    row as u64 + 2
}

impl NumberTable {
    /// Reads the columns of these names.
    ///
    /// # Errors
    /// No table of this kind, or a field that is no number; `true` and `false` are 1 and 0.
    pub(super) fn read(path: &Path, names: &[&'static str]) -> Result<NumberTable, ValidateError> {
        let refused = |source| ValidateError::Table { path: path.to_owned(), source };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(refused)?;
        let unmarked = |name: &str| name.trim_start_matches('\u{feff}').to_owned();
        let header: Vec<String> = reader.headers().map_err(refused)?.iter().map(unmarked).collect();
        let places: Vec<(&'static str, usize)> =
            names.iter().filter_map(|&name| Some((name, header.iter().position(|h| h == name)?))).collect();
        let mut columns: BTreeMap<&'static str, Vec<Option<f64>>> =
            places.iter().map(|&(name, _)| (name, Vec::new())).collect();
        let (mut record, mut rows) = (csv::StringRecord::new(), 0);
        while reader.read_record(&mut record).map_err(refused)? {
            for &(name, place) in &places {
                let text = record.get(place).unwrap_or_default();
                let value = number(text).ok_or_else(|| ValidateError::Field {
                    path: path.to_owned(),
                    line: line(rows),
                    column: name,
                    text: text.to_owned(),
                    expected: "number",
                })?;
                columns.entry(name).or_default().push(value);
            }
            rows += 1;
        }
        Ok(NumberTable { path: path.to_owned(), header, columns, rows })
    }

    /// A column, if it is there.
    pub(super) fn column(&self, name: &str) -> Option<&[Option<f64>]> {
        self.columns.get(name).map(Vec::as_slice)
    }

    /// A column that must be there.
    pub(super) fn needed(&self, name: &'static str, help: &'static str) -> Result<&[Option<f64>], ValidateError> {
        self.column(name).ok_or_else(|| ValidateError::MissingColumn {
            path: self.path.clone(),
            column: name,
            found: self.header.join(", "),
            help,
        })
    }

    /// A column of which every field must be as expected.
    pub(super) fn filled(
        &self,
        name: &'static str,
        help: &'static str,
        expected: &'static str,
        is_expected: impl Fn(f64) -> bool,
    ) -> Result<Vec<f64>, ValidateError> {
        let check = |(row, value): (usize, &Option<f64>)| {
            value.filter(|&v| is_expected(v)).ok_or_else(|| ValidateError::Field {
                path: self.path.clone(),
                line: line(row),
                column: name,
                text: value.map_or_else(String::new, |v| v.to_string()),
                expected,
            })
        };
        self.needed(name, help)?.iter().enumerate().map(check).collect()
    }

    /// Three columns of each row that has all of them; none where one of the columns is not there.
    pub(super) fn triples(&self, names: [&str; 3]) -> Option<Vec<Option<[f64; 3]>>> {
        let [a, b, c] = names.map(|name| self.column(name));
        let (a, b, c) = (a?, b?, c?);
        Some((0..self.rows).map(|row| Some([a[row]?, b[row]?, c[row]?])).collect())
    }
}

/// The number of a field, which may be empty; none if something else stands there.
fn number(text: &str) -> Option<Option<f64>> {
    match text {
        "" => Some(None),
        "true" | "True" => Some(Some(1.0)),
        "false" | "False" => Some(Some(0.0)),
        _ => text.parse::<f64>().ok().map(|v| Some(v).filter(|v| !v.is_nan())),
    }
}
