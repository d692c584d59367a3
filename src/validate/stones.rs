//! The table of the known stones: `truth.csv`.

use super::error::ValidateError;
use super::table_file::NumberTable;
use crate::geometry::DVec3;
use std::path::Path;

/// A stone as it truly is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueStone {
    /// Full lengths along A, B, C, metres: the bounding box of the whole stone.
    pub axes_m: [f64; 3],
    /// Unit vectors along A, B, C, if they are known.
    pub directions: Option<[DVec3; 3]>,
    /// Whether the border of the scene cuts the stone, so that its size and attitude do not count.
    pub is_cut: bool,
    /// Number of a reference pebble, from 1; 0 for others.
    pub reference: u32,
    /// Share of the stone's whole surface that is in the mesh, 0 to 1.
    pub represented: Option<f64>,
    /// Radius of a calibration ball, metres.
    pub radius_m: Option<f64>,
}

impl TrueStone {
    /// A stone of which only the axes are known.
    pub fn of_axes(axes_m: [f64; 3]) -> TrueStone {
        TrueStone { axes_m, directions: None, is_cut: false, reference: 0, represented: None, radius_m: None }
    }
}

const DIRECTIONS: [[&str; 3]; 3] = [["r00", "r01", "r02"], ["r10", "r11", "r12"], ["r20", "r21", "r22"]];
const COLUMNS: [&str; 19] = [
    "id",
    "A",
    "B",
    "C",
    "visible",
    "component_area",
    "cut",
    "ref",
    "represented_ratio",
    "radius",
    "r00",
    "r01",
    "r02",
    "r10",
    "r11",
    "r12",
    "r20",
    "r21",
    "r22",
];
const AXES_HELP: &str =
    "A, B and C are needed: the full lengths of each stone's axes in metres, one row for each stone";
const AREA_HELP: &str = "--visible-area goes by it: the largest area of the stone in the mesh that hangs together, in m²; without it, leave --visible-area out";

/// Reads the stones, and which of them count.
///
/// # Errors
/// A needed column that is missing, a field that is no number, stones out of order.
pub(super) fn read_stones(
    path: &Path,
    visible_area_m2: Option<f64>,
) -> Result<(Vec<TrueStone>, Vec<bool>), ValidateError> {
    let table = NumberTable::read(path, &COLUMNS)?;
    let length = |name| table.filled(name, AXES_HELP, "length above 0", |v| v > 0.0 && v.is_finite());
    let (a, b, c) = (length("A")?, length("B")?, length("C")?);
    check_order(path, &table)?;
    let directions = directions(&table);
    check_directions(path, directions.as_deref().unwrap_or_default())?;
    let optional = |name: &str, row: usize| table.column(name).and_then(|column| column[row]);
    let stone = |row: usize| TrueStone {
        axes_m: [a[row], b[row], c[row]],
        directions: directions.as_ref().and_then(|all| all[row]),
        is_cut: optional("cut", row).is_some_and(|cut| cut != 0.0),
        reference: optional("ref", row).map_or(0, |number| number as u32),
        represented: optional("represented_ratio", row),
        radius_m: optional("radius", row).filter(|&radius| radius > 0.0),
    };
    let is_above = |column: &[Option<f64>], is_enough: &dyn Fn(f64) -> bool| {
        column.iter().map(|value| value.is_some_and(is_enough)).collect::<Vec<bool>>()
    };
    let visible = match (visible_area_m2, table.column("visible")) {
        (Some(least), _) => is_above(table.needed("component_area", AREA_HELP)?, &|area| area >= least),
        (None, Some(flags)) => is_above(flags, &|flag| flag > 0.0),
        (None, None) => vec![true; table.rows],
    };
    Ok(((0..table.rows).map(stone).collect(), visible))
}

/// Stones are known by their rows: an id that says otherwise would give every stone the axes of another.
fn check_order(path: &Path, table: &NumberTable) -> Result<(), ValidateError> {
    let Some(ids) = table.column("id") else { return Ok(()) };
    match ids.iter().enumerate().find(|&(row, id)| *id != Some(row as f64)) {
        None => Ok(()),
        Some((row, id)) => Err(ValidateError::Field {
            path: path.to_owned(),
            line: row as u64 + 2,
            column: "id",
            text: id.map_or_else(String::new, |id| id.to_string()),
            expected: NUMBER_EXPECTED,
        }),
    }
}

/// Directions that are no unit vectors at right angles would give angles that mean nothing. A table that has them in columns
/// instead of rows passes: it cannot be told.
fn check_directions(path: &Path, directions: &[Option<[DVec3; 3]>]) -> Result<(), ValidateError> {
    let are_at_right_angles = |[a, b, c]: [DVec3; 3]| {
        let off = [a.dot(a) - 1.0, b.dot(b) - 1.0, c.dot(c) - 1.0, a.dot(b), b.dot(c), c.dot(a)];
        off.iter().all(|off| off.abs() < DIRECTIONS_OFF)
    };
    match directions.iter().position(|of_row| of_row.is_some_and(|axes| !are_at_right_angles(axes))) {
        None => Ok(()),
        Some(row) => Err(ValidateError::Field {
            path: path.to_owned(),
            line: row as u64 + 2,
            column: "r00",
            text: format!("{:?}", directions[row].map(|axes| axes.map(|axis| axis.to_array())).unwrap_or_default()),
            expected: DIRECTIONS_EXPECTED,
        }),
    }
}

/// How far lengths and right angles of directions may be off: tables are often printed with three digits.
const DIRECTIONS_OFF: f64 = 0.02;
const DIRECTIONS_EXPECTED: &str =
    "row of three unit vectors at right angles, r00 to r02 the direction of A, r10 to r12 of B, r20 to r22 of C";

const NUMBER_EXPECTED: &str =
    "number of this row: rows are numbered from 0 and sorted, since triangles name stones by them";

fn directions(table: &NumberTable) -> Option<Vec<Option<[DVec3; 3]>>> {
    let [a, b, c] = DIRECTIONS.map(|names| table.triples(names));
    let (a, b, c) = (a?, b?, c?);
    // Zeros stand for directions that nobody knows.
    let known = |axes: &[DVec3; 3]| axes.iter().any(|axis| *axis != DVec3::ZERO);
    let of_row = |row: usize| Some([a[row]?, b[row]?, c[row]?].map(DVec3::from_array)).filter(known);
    Some((0..table.rows).map(of_row).collect())
}
