//! Coordinate reference systems, through GDAL and PROJ.

use super::error::OpenError;
use super::frame::Crs;
use super::gdal_messages::{last_gdal_message, listen_to_gdal};
use gdal::spatial_ref::SpatialRef;
use std::path::Path;

/// A projected or local system and its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct GeoReference {
    /// The system.
    pub crs: Crs,
    /// Metres in one unit of it: exactly 0.3048 for the foot, 1200/3937 for the US survey foot.
    pub metres_per_unit: f64,
}

/// A file with more than this is no description of a coordinate system.
pub(super) const LONGEST_WKT_BYTES: u64 = 1 << 20;

/// Metres in an international foot.
pub(super) const FOOT_M: f64 = 0.3048;
/// Metres in a US survey foot, by its definition of 1893.
pub(super) const US_SURVEY_FOOT_M: f64 = 1200.0 / 3937.0;

/// Units whose published factor is a fraction that WKT rounds.
const EXACT_UNITS_M: [f64; 3] = [1.0, FOOT_M, US_SURVEY_FOOT_M];

impl GeoReference {
    /// The system that a setting names: `EPSG:n`, WKT, or a file that holds one of them (`.prj`).
    /// `None` for the empty text.
    ///
    /// # Errors
    /// A text that is none of them, an unreadable file, a system that GDAL does not know or that has no
    /// plane coordinates, PROJ without its database.
    pub fn from_setting(text: &str) -> Result<Option<GeoReference>, OpenError> {
        let text = text.trim();
        if text.is_empty() {
            return Ok(None);
        }
        let origin = format!("--crs {}", shorten(text));
        if let Some(found) = GeoReference::from_definition(&origin, text)? {
            return Ok(Some(found));
        }
        let path = Path::new(text);
        if !path.exists() {
            return Err(OpenError::CrsForm { origin });
        }
        if !path.metadata().is_ok_and(|m| m.is_file() && m.len() <= LONGEST_WKT_BYTES) {
            return Err(OpenError::CrsForm { origin });
        }
        let content =
            std::fs::read_to_string(path).map_err(|source| OpenError::CrsFile { origin: origin.clone(), source })?;
        match GeoReference::from_definition(&origin, &content)? {
            Some(found) => Ok(Some(found)),
            None => Err(OpenError::CrsUnknown { origin, message: "the file holds no WKT".to_owned() }),
        }
    }

    /// The system of `EPSG:n` or of WKT; `None` if the text is neither. `origin` names it in errors.
    ///
    /// # Errors
    /// A system that GDAL does not know or that has no plane coordinates, PROJ without its database.
    pub fn from_definition(origin: &str, definition: &str) -> Result<Option<GeoReference>, OpenError> {
        let system = spatial_ref(origin, definition.trim_start_matches('\u{feff}').trim())?;
        system.map(|system| check(origin, &system)).transpose()
    }

    /// Whether both mean the same coordinates, however they are written down. Heights count only where both say
    /// what theirs are.
    pub fn is_same(&self, other: &GeoReference) -> bool {
        let (a, b) = (Parts::of(&self.crs.wkt), Parts::of(&other.crs.wkt));
        let heights = match (a.heights, b.heights) {
            (Some(a), Some(b)) => same(a, b),
            _ => true,
        };
        heights && same(a.plan, b.plan)
    }
}

/// WKT of a system, taken apart where it is compound.
struct Parts<'a> {
    plan: &'a str,
    heights: Option<&'a str>,
}

impl Parts<'_> {
    fn of(wkt: &str) -> Parts<'_> {
        match wkt.starts_with("COMPD_CS").then(|| node(wkt, "PROJCS").or_else(|| node(wkt, "LOCAL_CS"))) {
            Some(Some(plan)) => Parts { plan, heights: node(wkt, "VERT_CS") },
            _ => Parts { plan: wkt, heights: None },
        }
    }
}

/// The first node of that name, up to the bracket that closes it.
fn node<'a>(wkt: &'a str, name: &str) -> Option<&'a str> {
    let node = &wkt[wkt.find(&format!("{name}["))?..];
    let (mut depth, mut quoted) = (0, false);
    for (i, c) in node.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '[' if !quoted => depth += 1,
            ']' if !quoted => depth -= 1,
            _ => {}
        }
        if c == ']' && !quoted && depth == 0 {
            return Some(&node[..=i]);
        }
    }
    None
}

fn same(a: &str, b: &str) -> bool {
    if a == b {
        return true;
    }
    listen_to_gdal();
    let (Ok(a), Ok(b)) = (SpatialRef::from_wkt(a), SpatialRef::from_wkt(b)) else { return false };
    // EPSG has northings before eastings in some systems, such as EPSG:2193, and GDAL holds them to be other systems
    // than those of .prj files, which have no order of axes. As .prj files they can be compared.
    let without_axes = |system: &SpatialRef| {
        let copy = system.clone();
        copy.morph_to_esri().ok()?;
        SpatialRef::from_wkt(&copy.to_wkt().ok()?).ok()
    };
    a == b || matches!((without_axes(&a), without_axes(&b)), (Some(a), Some(b)) if a == b)
}

/// The system of a code or WKT; `None` if the text is neither. `origin` names it in errors.
fn spatial_ref(origin: &str, definition: &str) -> Result<Option<SpatialRef>, OpenError> {
    listen_to_gdal();
    let is_code = definition.split_once(':').is_some_and(|(authority, code)| {
        !authority.is_empty()
            && authority.chars().all(|c| c.is_ascii_alphabetic())
            && !code.is_empty()
            && code.chars().all(|c| c.is_ascii_digit() || c == '+')
    });
    // GDAL's own guessing would also open files and fetch web addresses: it gets codes only.
    let made = if is_code {
        SpatialRef::from_definition(definition)
    } else if definition.contains('[') {
        SpatialRef::from_wkt(definition)
    } else {
        return Ok(None);
    };
    made.map(Some).map_err(|error| {
        let message = last_gdal_message();
        let message = if message.is_empty() { error.to_string() } else { message };
        let origin = origin.to_owned();
        if message.contains("proj.db") || message.contains("no database context") {
            OpenError::ProjDatabase { origin, message }
        } else {
            OpenError::CrsUnknown { origin, message }
        }
    })
}

fn check(origin: &str, system: &SpatialRef) -> Result<GeoReference, OpenError> {
    let origin = || origin.to_owned();
    let name = system.name().unwrap_or_else(|| "unnamed".to_owned());
    let kind = if system.is_geocentric() {
        Some("geocentric (distances from the centre of the Earth)")
    } else if system.is_geographic() || system.is_derived_geographic() {
        Some("geographic (degrees)")
    } else if !system.is_projected() && !system.is_local() {
        Some("without coordinates in plan")
    } else {
        None
    };
    if let Some(kind) = kind {
        return Err(OpenError::CrsKind { origin: origin(), name, kind });
    }
    let plan_m = exact_unit(system.linear_units());
    if let Some(height_m) = height_unit(system)
        && height_m != plan_m
    {
        return Err(OpenError::CrsUnits { origin: origin(), name, plan_m, height_m });
    }
    let wkt = system.to_wkt().map_err(|e| OpenError::CrsUnknown { origin: origin(), message: e.to_string() })?;
    Ok(GeoReference { crs: Crs { wkt, name, authority: system.authority().ok() }, metres_per_unit: plan_m })
}

/// Unit of a compound system's heights, metres.
fn height_unit(system: &SpatialRef) -> Option<f64> {
    let text = system.get_attr_value("VERT_CS|UNIT", 1).ok().flatten()?;
    text.parse().ok().map(exact_unit)
}

fn exact_unit(metres: f64) -> f64 {
    EXACT_UNITS_M.into_iter().find(|exact| (metres / exact - 1.0).abs() < 1e-8).unwrap_or(metres)
}

/// A text that fits on a line of a message.
pub(super) fn shorten(text: &str) -> String {
    let mut line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(60).collect();
    if text.chars().count() > 60 {
        line.push('…');
    }
    line
}
