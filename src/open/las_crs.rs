//! The coordinate reference system that a LAS file states, as text.

use super::las_header::{LasFile, VariableRecord, printable};
use las::crs::{GeoTiffCrs, GeoTiffData};
use las::{Builder, Vlr};

const PROJECTION: &str = "LASF_Projection";
const WKT: u16 = 2112;
/// The directory of keys, their numbers, their texts.
const GEOTIFF: [u16; 3] = [34735, 34736, 34737];
/// Bit of the global encoding that says that the system is WKT.
const WKT_BIT: u16 = 16;

/// GeoTIFF keys, OGC 19-008r4.
const MODEL_CITATION: u16 = 1026;
const GEODETIC: u16 = 2048;
const PROJECTED: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const VERTICAL_UNITS: u16 = 4099;
/// A system that no code names.
const USER_DEFINED: u16 = 32767;

/// What a file says about its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum CloudCrs {
    /// Nothing.
    Unstated,
    /// WKT, or `EPSG:n`.
    Stated {
        /// For `GeoReference::from_setting`.
        definition: String,
        /// Metres in a unit of height, where GeoTIFF keys say so beside the code.
        height_unit_m: Option<f64>,
    },
    /// GeoTIFF keys without a code, or keys that cannot be read.
    Unusable {
        /// What there is.
        reason: String,
    },
}

impl CloudCrs {
    /// WKT and GeoTIFF keys may both be there: the header says which one counts.
    pub(super) fn of(file: &LasFile<'_>) -> CloudCrs {
        let all = || file.records.iter().chain(&file.extended);
        let wkt = all().filter(|r| r.is((PROJECTION, WKT))).find_map(text_of);
        let keys = if all().any(|r| r.is((PROJECTION, GEOTIFF[0]))) { Some(geotiff(all())) } else { None };
        let says_wkt = file.header.global_encoding & WKT_BIT != 0;
        match (wkt, keys) {
            (Some(definition), keys) if says_wkt || keys.as_ref().is_none_or(|k| !k.is_usable()) => {
                CloudCrs::Stated { definition, height_unit_m: None }
            }
            (_, Some(keys)) => keys,
            _ => CloudCrs::Unstated,
        }
    }

    fn is_usable(&self) -> bool {
        matches!(self, CloudCrs::Stated { .. })
    }
}

/// The text of a record, if it holds any.
fn text_of(record: &VariableRecord<'_>) -> Option<String> {
    let text = std::str::from_utf8(record.data).ok()?;
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    (!text.is_empty()).then(|| text.to_owned())
}

fn geotiff<'a>(records: impl Iterator<Item = &'a VariableRecord<'a>>) -> CloudCrs {
    let mut builder = Builder::from((1, 4));
    for record in records.filter(|r| GEOTIFF.iter().any(|&n| r.is((PROJECTION, n)))) {
        let data = record.data.get(..usize::from(u16::MAX)).unwrap_or(record.data).to_vec();
        builder.vlrs.push(Vlr { user_id: PROJECTION.to_owned(), record_id: record.number, data, ..Vlr::default() });
    }
    let keys = builder.into_header().and_then(|header| header.get_geotiff_crs());
    match keys {
        Ok(Some(keys)) => of_keys(&keys),
        Ok(None) => CloudCrs::Unstated,
        Err(error) => {
            CloudCrs::Unusable { reason: format!("its GeoTIFF keys cannot be read: {}", printable(&error.to_string())) }
        }
    }
}

fn of_keys(keys: &GeoTiffCrs) -> CloudCrs {
    let number = |id| {
        keys.entries
            .iter()
            .find(|e| e.id == id)
            .and_then(|e| if let GeoTiffData::U16(n) = e.data { Some(n) } else { None })
    };
    let text = |id| {
        keys.entries.iter().find(|e| e.id == id).and_then(|e| match &e.data {
            GeoTiffData::String(text) => Some(printable(text.trim_matches(['|', '\0', ' ']))),
            _ => None,
        })
    };
    // 0 means undefined. Degrees are stated too: whoever takes the text says that they are no plane coordinates.
    let code = number(PROJECTED).or_else(|| number(GEODETIC)).filter(|&code| code != 0);
    match code {
        Some(USER_DEFINED) => {
            let citation =
                text(PROJECTED_CITATION).or_else(|| text(MODEL_CITATION)).unwrap_or_else(|| "unnamed".to_owned());
            CloudCrs::Unusable { reason: format!("its GeoTIFF keys define a system of their own ({citation})") }
        }
        Some(code) => CloudCrs::Stated {
            definition: format!("EPSG:{code}"),
            height_unit_m: number(VERTICAL_UNITS).and_then(unit_m),
        },
        None => CloudCrs::Unstated,
    }
}

/// Metres in a unit of length by its EPSG code, for the units that heights are measured in.
fn unit_m(code: u16) -> Option<f64> {
    match code {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(1200.0 / 3937.0),
        _ => None,
    }
}
