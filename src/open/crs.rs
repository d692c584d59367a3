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
const LONGEST_WKT_BYTES: u64 = 1 << 20;

/// Units whose published factor is a fraction that WKT rounds.
const EXACT_UNITS_M: [f64; 3] = [1.0, 0.3048, 1200.0 / 3937.0];

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
        if let Some(system) = spatial_ref(text, text)? {
            return check(text, &system).map(Some);
        }
        let path = Path::new(text);
        if !path.exists() {
            return Err(OpenError::CrsForm { text: text.to_owned() });
        }
        if !path.metadata().is_ok_and(|m| m.is_file() && m.len() <= LONGEST_WKT_BYTES) {
            return Err(OpenError::CrsForm { text: shorten(text) });
        }
        let content =
            std::fs::read_to_string(path).map_err(|source| OpenError::CrsFile { path: text.to_owned(), source })?;
        match spatial_ref(text, content.trim())? {
            Some(system) => check(text, &system).map(Some),
            None => Err(OpenError::CrsUnknown { text: text.to_owned(), message: "the file holds no WKT".to_owned() }),
        }
    }
}

/// The system of a code or WKT; `None` if the text is neither. `shown` names it in errors.
fn spatial_ref(shown: &str, definition: &str) -> Result<Option<SpatialRef>, OpenError> {
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
        let text = shorten(shown);
        if message.contains("proj.db") || message.contains("no database context") {
            OpenError::ProjDatabase { text, message }
        } else {
            OpenError::CrsUnknown { text, message }
        }
    })
}

fn check(text: &str, system: &SpatialRef) -> Result<GeoReference, OpenError> {
    let text = shorten(text);
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
        return Err(OpenError::CrsKind { text, name, kind });
    }
    let plan_m = exact_unit(system.linear_units());
    if let Some(height_m) = height_unit(system)
        && height_m != plan_m
    {
        return Err(OpenError::CrsUnits { text, name, plan_m, height_m });
    }
    let wkt = system.to_wkt().map_err(|e| OpenError::CrsUnknown { text: text.clone(), message: e.to_string() })?;
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

fn shorten(text: &str) -> String {
    let mut line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(60).collect();
    if text.chars().count() > 60 {
        line.push('…');
    }
    line
}
