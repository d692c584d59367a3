//! What is odd about the borders between files without being wrong.

use super::facts::{PairFacts, WeldFacts};
use super::parts::Part;
use std::fmt;

/// A finding that does not stop a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Two files lie side by side and have hardly any vertex in common.
    Unjoined {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// Length along which they do, metres.
        border_m: f64,
        /// Vertices that they have in common.
        vertices: u64,
        /// How near two would have had to be, metres.
        tolerance_m: f64,
    },
    /// A file is near others and touches none.
    Alone {
        /// The file.
        path: String,
        /// The nearest of the others.
        nearest: String,
        /// How far away that is, metres.
        gap_m: f64,
    },
    /// A little ground is in two files.
    Doubled {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// Its area in plan, m².
        area_m2: f64,
    },
    /// One file lies above another one.
    Stacked {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// Area in plan where it does, m².
        area_m2: f64,
    },
    /// Some triangles are in two files.
    Identical {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// How many.
        triangles: u64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Unjoined { first, second, border_m, vertices, tolerance_m } => write!(
                f,
                "{first} and {second}: lie side by side for about {border_m:.2} m and have {vertices} vertices in \
                 common (within {tolerance_m:.1e} m), so that a grain cut by their border counts twice\nhelp: export both from \
                 one mesh, with the same offset and as many digits; if they are rounded differently, raise \
                 input.weld_m"
            ),
            Warning::Alone { path, nearest, gap_m } => write!(
                f,
                "{path}: touches no other file; {nearest} is {gap_m:.2} m away\nhelp: if the two are one surface, they \
                 were exported with different offsets, or something between them is missing"
            ),
            Warning::Doubled { first, second, area_m2 } => write!(
                f,
                "{first} and {second}: both hold {area_m2:.3} m² of the same ground; grains there may be found twice, \
                 or torn\nhelp: cut the blocks without overlap when they are exported"
            ),
            Warning::Stacked { first, second, area_m2 } => write!(
                f,
                "{first} and {second}: one lies above the other over {area_m2:.3} m²; grains there are found in \
                 both\nhelp: nothing, if a bank or a bridge hangs over the bed; otherwise check the heights"
            ),
            Warning::Identical { first, second, triangles } => write!(
                f,
                "{first} and {second}: {triangles} triangles are in both, and count twice in the areas of grains\n\
                 help: nothing, if it is a thin strip along their border"
            ),
        }
    }
}

/// Fewer vertices than this for each square along a border (a clean one has about eight) are no border.
const FEWEST_FOR_SQUARE: f64 = 1.0;
/// A border shorter than so many squares is one in passing.
const SHORTEST_SQUARES: f64 = 5.0;
/// A file this near to another one, in diagonals of its box, was probably meant to touch it.
const NEAR_DIAGONALS: f64 = 0.25;

/// What is odd, given what was found.
pub(super) fn warnings(facts: &WeldFacts, parts: &[Part]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut heard = vec![false; parts.len()];
    for pair in &facts.pairs {
        let of_pair = of_pair(pair, facts.tolerance_m, parts);
        if pair.welded_vertices > 0 || !of_pair.is_empty() {
            pair.files.iter().for_each(|&i| heard[i] = true);
        }
        warnings.extend(of_pair);
    }
    for (i, part) in parts.iter().enumerate().filter(|&(i, _)| !heard[i]) {
        let others = parts.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, other)| (part.gap_m(other), other));
        if let Some((gap_m, nearest)) = others.min_by(|a, b| a.0.total_cmp(&b.0))
            && gap_m <= NEAR_DIAGONALS * part.diagonal_m()
        {
            warnings.push(Warning::Alone { path: part.name.clone(), nearest: nearest.name.clone(), gap_m });
        }
    }
    warnings
}

fn of_pair(pair: &PairFacts, tolerance_m: f64, parts: &[Part]) -> Vec<Warning> {
    let [first, second] = pair.files.map(|i| parts[i].name.clone());
    let mut warnings = Vec::new();
    if pair.doubled.is_real(pair.border_squares) {
        let (first, second) = (first.clone(), second.clone());
        warnings.push(Warning::Doubled { first, second, area_m2: pair.doubled.area_m2 });
    }
    if pair.stacked.is_real(pair.border_squares) {
        let (first, second) = (first.clone(), second.clone());
        warnings.push(Warning::Stacked { first, second, area_m2: pair.stacked.area_m2 });
    }
    let squares = pair.border_squares as f64;
    if warnings.is_empty() && squares >= SHORTEST_SQUARES && (pair.welded_vertices as f64) < FEWEST_FOR_SQUARE * squares
    {
        let (first, second) = (first.clone(), second.clone());
        let (border_m, vertices) = (pair.border_m, pair.welded_vertices);
        warnings.push(Warning::Unjoined { first, second, border_m, vertices, tolerance_m });
    }
    if pair.identical_triangles > 0 {
        warnings.push(Warning::Identical { first, second, triangles: pair.identical_triangles });
    }
    warnings
}
