//! Where a survey is: which system, which offset, which unit, and who said so.
//!
//! Four sources may name the CRS; in this order the first is taken: `--crs`, the offset file, a `.prj` file beside an
//! input, the header of an input. The lower three must agree. `--crs` overrides the last two, but not the offset file,
//! which is named in the same breath.

use super::crs::{FOOT_M, GeoReference, LONGEST_WKT_BYTES, US_SURVEY_FOOT_M};
use super::error::OpenError;
use super::frame::Frame;
use super::offset_file::OffsetFile;
use crate::settings::{InputSettings, Unit};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

/// Who names a system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CrsSource {
    /// The setting `input.crs`.
    Setting,
    /// The offset file.
    OffsetFile(PathBuf),
    /// A `.prj` file beside an input or beside the offset file.
    Beside(PathBuf),
    /// The header of an input.
    Header(PathBuf),
}

impl fmt::Display for CrsSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CrsSource::Setting => write!(f, "--crs"),
            CrsSource::OffsetFile(path) => write!(f, "the offset file {}", path.display()),
            CrsSource::Beside(path) => write!(f, "{}", path.display()),
            CrsSource::Header(path) => write!(f, "the header of {}", path.display()),
        }
    }
}

/// A system that somebody names: a code or WKT, for the setting also a file that holds one of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CrsCandidate {
    /// Who.
    pub source: CrsSource,
    /// What.
    pub text: String,
}

/// The system that counts, and who named it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCrs {
    /// The system.
    pub reference: GeoReference,
    /// Who named it.
    pub source: CrsSource,
}

impl NamedCrs {
    /// Name and code.
    fn title(&self) -> String {
        let crs = &self.reference.crs;
        crs.authority.as_ref().map_or_else(|| crs.name.clone(), |code| format!("{} ({code})", crs.name))
    }
}

/// The system that counts, of candidates in the order in which they count, and what is to be told about the others.
///
/// # Errors
/// A candidate that cannot be used and is not overridden, or two that contradict each other, both named.
pub fn resolve_crs(candidates: &[CrsCandidate]) -> Result<(Option<NamedCrs>, Vec<String>), OpenError> {
    let mut notes = Vec::new();
    let mut chosen: Option<NamedCrs> = None;
    for candidate in candidates {
        let overridden = chosen.as_ref().is_some_and(|c| c.source == CrsSource::Setting)
            && matches!(candidate.source, CrsSource::Beside(_) | CrsSource::Header(_));
        let read = match read(candidate) {
            Err(_) if overridden => Ok(None),
            read => read,
        }?;
        match (&chosen, read) {
            (None, None) | (Some(_), None) if candidate.source == CrsSource::Setting => {}
            (_, None) => notes.push(format!("{} names no system that can be used; it is ignored", candidate.source)),
            (None, Some(reference)) => chosen = Some(NamedCrs { reference, source: candidate.source.clone() }),
            (Some(first), Some(second)) if first.reference.is_same(&second) => {}
            (Some(first), Some(second)) => {
                let second = NamedCrs { reference: second, source: candidate.source.clone() };
                if !overridden {
                    return Err(contradiction(first, &second));
                }
                let (is, not) = (first.title(), second.title());
                notes.push(format!("{is} is taken, as {} says, not the {not} of {}", first.source, second.source));
            }
        }
    }
    if let Some(chosen) = chosen.as_ref().filter(|c| c.source != CrsSource::Setting) {
        notes.insert(0, format!("the CRS is {}, from {}", chosen.title(), chosen.source));
    }
    Ok((chosen, notes))
}

fn read(candidate: &CrsCandidate) -> Result<Option<GeoReference>, OpenError> {
    match &candidate.source {
        CrsSource::Setting => GeoReference::from_setting(&candidate.text),
        source => GeoReference::from_definition(&source.to_string(), &candidate.text),
    }
}

fn contradiction(first: &NamedCrs, second: &NamedCrs) -> OpenError {
    OpenError::CrsContradiction {
        first: first.source.to_string(),
        first_name: first.title(),
        second: second.source.to_string(),
        second_name: second.title(),
        help: match (&first.source, &second.source) {
            (CrsSource::Setting, _) => "leave out --crs if the offset file is right, or give the offset with --offset",
            (CrsSource::OffsetFile(_), _) => {
                "remove the one that is wrong, or give the offset with --offset and the system with --crs"
            }
            _ => "name the system of all inputs with --crs, or run them one by one if they differ",
        },
    }
}

/// What is known of a survey's place before its files are read.
#[derive(Debug, Clone)]
pub(super) struct SideFiles {
    candidates: Vec<CrsCandidate>,
    offset: [f64; 3],
    offset_from: Option<String>,
    unit: Unit,
}

impl SideFiles {
    /// Reads the offset file and the `.prj` files.
    ///
    /// # Errors
    /// Two offsets, or an offset file that is none.
    pub(super) fn read(paths: &[PathBuf], input: &InputSettings) -> Result<SideFiles, OpenError> {
        let mut candidates = vec![CrsCandidate { source: CrsSource::Setting, text: input.crs.clone() }];
        let (mut offset, mut offset_from) = (input.offset, None);
        if offset != [0.0; 3] {
            offset_from = Some("--offset".to_owned());
        }
        let mut beside = Vec::new();
        if !input.offset_file.is_empty() {
            if offset_from.is_some() {
                return Err(OpenError::TwoOffsets { offset, path: input.offset_file.clone() });
            }
            let path = Path::new(&input.offset_file);
            let file = OffsetFile::read(path)?;
            offset = file.offset;
            offset_from = Some(format!("{} ({})", path.display(), file.form));
            let source = CrsSource::OffsetFile(path.to_owned());
            candidates.extend(file.crs.map(|text| CrsCandidate { source, text }));
            beside.extend(of_pix4d(path));
        }
        beside.extend(paths.iter().flat_map(|path| prj_names(path)));
        for path in beside {
            let source = CrsSource::Beside(path);
            let CrsSource::Beside(path) = &source else { continue };
            if path.is_file() && candidates.iter().all(|c| c.source != source) {
                let text = prj_text(path)?;
                candidates.push(CrsCandidate { source, text });
            }
        }
        Ok(SideFiles { candidates, offset, offset_from, unit: input.unit })
    }

    /// Where the survey is, with what the headers of its files say of their systems.
    ///
    /// # Errors
    /// Those of [`resolve_crs`].
    pub(super) fn resolve(&self, headers: &[CrsCandidate]) -> Result<Georeference, OpenError> {
        let candidates: Vec<_> = self.candidates.iter().chain(headers).cloned().collect();
        let (named, mut notes) = resolve_crs(&candidates)?;
        let metres_per_map_unit = named.as_ref().map_or(1.0, |n| n.reference.metres_per_unit);
        let (metres_per_input_unit, unit_from) = match (self.unit, &named) {
            (Unit::Auto, Some(_)) => (metres_per_map_unit, "the CRS"),
            (Unit::Auto, None) => (1.0, "assumed"),
            (Unit::M, _) => (1.0, "--unit"),
            (Unit::Mm, _) => (1e-3, "--unit"),
            (Unit::Ft, _) => (FOOT_M, "--unit"),
            (Unit::UsFt, _) => (US_SURVEY_FOOT_M, "--unit"),
        };
        if let Some(from) = self.offset_from.as_ref().filter(|from| *from != "--offset") {
            let [east, north, up] = self.offset;
            notes.push(format!("the offset is {east}, {north}, {up} map units, from {from}"));
        }
        let (unit, input_unit) = (unit_name(metres_per_map_unit), unit_name(metres_per_input_unit));
        if metres_per_map_unit != 1.0
            && let Some(named) = &named
        {
            let input = match self.unit {
                Unit::Auto => "and the coordinates are taken to have it as well".to_owned(),
                _ => format!("and the coordinates the {input_unit}, as --unit says"),
            };
            notes.push(format!(
                "{} has the {unit} of {metres_per_map_unit} m as its unit, {input}; grains are measured in metres",
                named.title()
            ));
        }
        Ok(Georeference {
            crs: named.as_ref().map(|n| n.reference.crs.name.clone()),
            authority: named.as_ref().and_then(|n| n.reference.crs.authority.clone()),
            crs_from: named.as_ref().map(|n| n.source.to_string()),
            offset_map_units: self.offset,
            offset_from: self.offset_from.clone(),
            vertical_shift_map_units: self.offset[2],
            unit,
            metres_per_map_unit,
            input_unit,
            metres_per_input_unit,
            input_unit_from: unit_from,
            crs_is_of_header: named.as_ref().is_some_and(|n| matches!(n.source, CrsSource::Header(_))),
            reference: named.map(|n| n.reference),
            notes,
        })
    }
}

/// `PROJECT_wkt.prj`, which Pix4D writes beside `PROJECT_offset.xyz`.
fn of_pix4d(offset_file: &Path) -> Option<PathBuf> {
    let project = offset_file.file_name()?.to_str()?.strip_suffix("_offset.xyz")?;
    Some(offset_file.with_file_name(format!("{project}_wkt.prj")))
}

/// The names that a `.prj` file of this input may have.
fn prj_names(input: &Path) -> Vec<PathBuf> {
    let Some(stem) = input.file_stem() else { return Vec::new() };
    let name = |end: &str| {
        let mut name = stem.to_owned();
        name.push(end);
        input.with_file_name(name)
    };
    let mut names = vec![name(".prj"), name("_wkt.prj")];
    // On some file systems this is the same file by another name.
    names.extend(Some(name(".PRJ")).filter(|_| !names[0].is_file()));
    names
}

/// What a `.prj` file holds; nothing if it is too long for WKT, for other programs use that name for their projects.
fn prj_text(path: &Path) -> Result<String, OpenError> {
    let unreadable = |source| OpenError::Unreadable { path: path.display().to_string(), source };
    if std::fs::metadata(path).map_err(unreadable)?.len() > LONGEST_WKT_BYTES {
        return Ok(String::new());
    }
    Ok(String::from_utf8_lossy(&std::fs::read(path).map_err(unreadable)?).into_owned())
}

fn unit_name(metres: f64) -> String {
    let names =
        [(1.0, "metre"), (1e-3, "millimetre"), (FOOT_M, "international foot"), (US_SURVEY_FOOT_M, "US survey foot")];
    let name = names.into_iter().find(|(length_m, _)| *length_m == metres).map(|(_, name)| name.to_owned());
    name.unwrap_or_else(|| format!("unit of {metres} m"))
}

/// What was applied to a survey's coordinates, and where each part came from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Georeference {
    /// Name of the CRS.
    pub crs: Option<String>,
    /// Code of the CRS, such as `EPSG:2193`.
    pub authority: Option<String>,
    /// Who named the CRS.
    pub crs_from: Option<String>,
    /// East, north, up; added to reach the map, map units.
    pub offset_map_units: [f64; 3],
    /// Who named the offset; none without one.
    pub offset_from: Option<String>,
    /// How far heights were shifted, map units: the last part of the offset.
    pub vertical_shift_map_units: f64,
    /// Unit of the map, for people.
    pub unit: String,
    /// Metres in one unit of the map.
    pub metres_per_map_unit: f64,
    /// Unit of the input, for people.
    pub input_unit: String,
    /// Metres in one unit of the input.
    pub metres_per_input_unit: f64,
    /// Who named the unit of the input.
    pub input_unit_from: &'static str,
    /// Whether it is the header of an input that named the CRS.
    #[serde(skip)]
    pub(super) crs_is_of_header: bool,
    /// The system itself.
    #[serde(skip)]
    pub(super) reference: Option<GeoReference>,
    /// What people should hear about it.
    #[serde(skip)]
    pub notes: Vec<String>,
}

impl Georeference {
    /// The frame of a survey with these lowest coordinates, input units. Its origin is the whole number of input units
    /// below them.
    pub(super) fn frame(&self, lowest: [f64; 3]) -> Frame {
        Frame {
            origin_input: lowest.map(f64::floor),
            metres_per_input_unit: self.metres_per_input_unit,
            offset_map: self.offset_map_units,
            metres_per_map_unit: self.metres_per_map_unit,
            crs: self.reference.as_ref().map(|r| r.crs.clone()),
        }
    }
}
