//! Every parameter of a run: its unit, default, allowed range and reason.
//!
//! The same keys serve the settings file (`--config`, TOML), the flags and `--set section.key=value`.
//! `configs/default.toml` is compared with [`Settings::default`] by a test.

use serde::{Deserialize, Serialize};
use std::path::Path;

/// All settings of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// What the input's coordinates mean.
    pub input: InputSettings,
    /// How curvature is computed.
    pub curvature: CurvatureSettings,
    /// What makes a grain.
    pub segment: SegmentSettings,
    /// When a measurement is flagged.
    pub measure: MeasureSettings,
    /// The grain-size raster.
    pub raster: RasterSettings,
    /// How the work is cut and how much of the machine it takes; never changes a result.
    pub work: WorkSettings,
    /// Which optional files are written.
    pub output: OutputSettings,
}

/// Unit of the input's coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// The unit of the CRS, metres without one.
    #[default]
    Auto,
    /// Metres.
    M,
    /// Millimetres.
    Mm,
    /// International feet (0.3048 m).
    Ft,
}

/// What the input's coordinates mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct InputSettings {
    /// Unit of the input's coordinates: `auto`, `m`, `mm`, `ft`.
    pub unit: Unit,
    /// Coordinate reference system: `EPSG:n`, WKT, or a file that holds WKT (`.prj`). Empty: none.
    pub crs: String,
    /// East, north and up shift added to the coordinates to reach the CRS, in units of the CRS.
    pub offset: [f64; 3],
}

/// How curvature is computed (Rheinwalt et al. 2025, eq. 1 and 2).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CurvatureSettings {
    /// Triangle normals averaged at each of the six stencil points, count, 1 to 256.
    pub neighbours: usize,
    /// Distance of the stencil points from the vertex, in mean vertex-to-nearest-triangle distances.
    pub stencil_spacings: f64,
}

impl Default for CurvatureSettings {
    fn default() -> Self {
        CurvatureSettings { neighbours: 25, stencil_spacings: 2.0 }
    }
}

/// How the smallest grain is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AreaRule {
    /// Summed triangle area, m²: the same stone passes whatever the mesh density.
    #[default]
    Area,
    /// Number of triangles, the area divided by the survey's mean triangle area (the authors' program).
    TriangleCount,
}

/// How the three vertices of a triangle decide that it is concave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum ConcaveRule {
    /// One concave vertex is enough (the authors' program).
    #[default]
    Min,
    /// The mean of the three (the paper's text).
    Mean,
}

/// What makes a grain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentSettings {
    /// Widest grain, metres (longer side of its box in plan); 0 for no limit. Wider bodies are reported
    /// as oversize, never as grains. Decides how far a tile must look beyond its core.
    pub max_grain_m: f64,
    /// Smallest grain, m² of visible surface.
    pub min_grain_area_m2: f64,
    /// Smallest grain, triangles: raises `min_grain_area_m2` on coarse meshes to this many mean triangles.
    pub min_grain_triangles: f64,
    /// Whether the two limits above are held against areas or against triangle counts.
    pub area_rule: AreaRule,
    /// How three vertices decide that a triangle is concave.
    pub concave_rule: ConcaveRule,
    /// Divergence below which the surface is concave, in 1 per mean edge length; 0 as published.
    pub concave_below: f64,
    /// Triangles taller than this are removed, metres; 0 for none.
    pub max_triangle_height_m: f64,
    /// Rings of triangles taken off before grains are told apart; 0 for none.
    pub erosion_iterations: u32,
    /// Convex-hull sphericity below which a body is no grain, 0 to 1; 0 for none.
    pub min_sphericity: f64,
    /// Rings of triangles given back afterwards; 0 for none.
    pub dilation_iterations: u32,
    /// Whether a concave pocket that touches one grain only is filled.
    pub fill_holes: bool,
    /// Whether such a pocket is filled even where it is open at an edge of the mesh.
    pub fill_edge_holes: bool,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        SegmentSettings {
            max_grain_m: 2.0,
            min_grain_area_m2: 1e-4,
            min_grain_triangles: 50.0,
            area_rule: AreaRule::Area,
            concave_rule: ConcaveRule::Min,
            concave_below: -0.05,
            max_triangle_height_m: 0.0,
            erosion_iterations: 1,
            min_sphericity: 0.5,
            dilation_iterations: 3,
            fill_holes: true,
            fill_edge_holes: false,
        }
    }
}

/// When a measurement is flagged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureSettings {
    /// Grains of fewer triangles are flagged `few_triangles`.
    pub few_triangles: u64,
    /// Axis ratio (a/b or b/c) below which the attitude is flagged as undefined.
    pub equant_ratio: f64,
}

impl Default for MeasureSettings {
    fn default() -> Self {
        MeasureSettings { few_triangles: 100, equant_ratio: 1.1 }
    }
}

/// The grain-size raster.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RasterSettings {
    /// Cell size, metres; 0 for ten times the D50, rounded up to 1, 2 or 5 times a power of ten.
    pub cell_m: f64,
    /// Cells with fewer grains carry no percentiles.
    pub min_grains: u32,
}

impl Default for RasterSettings {
    fn default() -> Self {
        RasterSettings { cell_m: 0.0, min_grains: 5 }
    }
}

/// How the work is cut and how much of the machine it takes; never changes a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct WorkSettings {
    /// Side of a tile's core, metres; 0 to choose it from the memory budget.
    pub tile_size_m: f64,
    /// Compute threads; 0 for all cores.
    pub threads: usize,
    /// Memory for tiles in flight, as `2GiB`, `500MB` or bytes; empty for half of what is there.
    pub memory: String,
}

/// Which optional files are written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSettings {
    /// Whether the input mesh is written again with a `grain_id` for each face.
    pub labelled_mesh: bool,
}

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The settings file could not be read.
    #[error(
        "{path}: cannot read the settings file: {source}\nhelp: presets lie in configs/; `gravelometer run --help` names every key"
    )]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not TOML, or holds an unknown key or a value of the wrong kind.
    #[error("{origin}: {message}\nhelp: configs/default.toml lists every key with its unit")]
    Parse {
        /// File or flag.
        origin: String,
        /// What the parser says, with line and column where it knows them.
        message: String,
    },
    /// A value outside its range.
    #[error("{key} = {value}: {rule}")]
    Range {
        /// Dotted key.
        key: &'static str,
        /// The offending value.
        value: String,
        /// What is allowed.
        rule: &'static str,
    },
}

impl Settings {
    /// Defaults, overlaid by a settings file, overlaid by `section.key=value` assignments, then checked.
    ///
    /// # Errors
    /// Unreadable file, malformed TOML, unknown key, value out of range.
    pub fn load(file: Option<&Path>, assignments: &[String]) -> Result<Settings, SettingsError> {
        let mut table = toml::Table::new();
        if let Some(path) = file {
            let origin = path.display().to_string();
            let text =
                std::fs::read_to_string(path).map_err(|source| SettingsError::Read { path: origin.clone(), source })?;
            let parsed: Settings = toml::from_str(&text)
                .map_err(|e| SettingsError::Parse { origin: origin.clone(), message: e.to_string() })?;
            drop(parsed);
            table =
                text.parse().map_err(|e: toml::de::Error| SettingsError::Parse { origin, message: e.to_string() })?;
        }
        for assignment in assignments {
            assign(&mut table, assignment)?;
        }
        let settings: Settings = table.try_into().map_err(|e: toml::de::Error| SettingsError::Parse {
            origin: if assignments.is_empty() {
                "settings".into()
            } else {
                format!("--set {}", assignments.join(" --set "))
            },
            message: e.to_string(),
        })?;
        settings.check()?;
        Ok(settings)
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// The first value out of range, by its dotted key.
    pub fn check(&self) -> Result<(), SettingsError> {
        let s = &self.segment;
        let not_negative = "must be a finite number, 0 or more";
        for (key, value) in [
            ("segment.max_grain_m", s.max_grain_m),
            ("segment.min_grain_area_m2", s.min_grain_area_m2),
            ("segment.min_grain_triangles", s.min_grain_triangles),
            ("segment.max_triangle_height_m", s.max_triangle_height_m),
            ("raster.cell_m", self.raster.cell_m),
            ("work.tile_size_m", self.work.tile_size_m),
        ] {
            range(key, value, value.is_finite() && value >= 0.0, not_negative)?;
        }
        range("segment.concave_below", s.concave_below, s.concave_below.is_finite(), "must be a finite number")?;
        range(
            "segment.min_sphericity",
            s.min_sphericity,
            (0.0..=1.0).contains(&s.min_sphericity),
            "must lie in 0 to 1",
        )?;
        range(
            "segment.erosion_iterations",
            s.erosion_iterations,
            s.erosion_iterations <= 1000,
            "must be at most 1000 rings",
        )?;
        range(
            "segment.dilation_iterations",
            s.dilation_iterations,
            s.dilation_iterations <= 1000,
            "must be at most 1000 rings",
        )?;
        let c = &self.curvature;
        range("curvature.neighbours", c.neighbours, (1..=256).contains(&c.neighbours), "must lie in 1 to 256")?;
        range(
            "curvature.stencil_spacings",
            c.stencil_spacings,
            c.stencil_spacings.is_finite() && c.stencil_spacings > 0.0,
            "must be a finite number above 0",
        )?;
        let ratio = self.measure.equant_ratio;
        range("measure.equant_ratio", ratio, ratio.is_finite() && ratio >= 1.0, "must be a finite number, 1 or more")?;
        range("work.threads", self.work.threads, self.work.threads <= 4096, "must be at most 4096")?;
        range(
            "work.memory",
            &self.work.memory,
            parse_bytes(&self.work.memory).is_some(),
            "must be a size like 2GiB, 500MB or 1000000",
        )?;
        let offset = self.input.offset;
        range(
            "input.offset",
            format!("{offset:?}"),
            offset.iter().all(|v| v.is_finite() && v.abs() < 1e9),
            "must be three finite numbers below 1e9",
        )
    }

    /// The memory budget in bytes, if one was set.
    pub fn memory_bytes(&self) -> Option<u64> {
        parse_bytes(&self.work.memory).filter(|&b| b > 0)
    }
}

fn range(key: &'static str, value: impl ToString, ok: bool, rule: &'static str) -> Result<(), SettingsError> {
    if ok { Ok(()) } else { Err(SettingsError::Range { key, value: value.to_string(), rule }) }
}

/// Sets one dotted key; the value is read as TOML, and as a plain string where that fails.
fn assign(table: &mut toml::Table, assignment: &str) -> Result<(), SettingsError> {
    let bad = |message: &str| SettingsError::Parse { origin: format!("--set {assignment}"), message: message.into() };
    let (key, text) = assignment.split_once('=').ok_or_else(|| bad("expected section.key=value"))?;
    let (section, name) = key.trim().split_once('.').ok_or_else(|| bad("expected section.key=value"))?;
    let value = format!("v = {text}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| toml::Value::String(text.trim().to_owned()));
    table
        .entry(section.trim())
        .or_insert_with(|| toml::Value::Table(toml::Table::new()))
        .as_table_mut()
        .ok_or_else(|| bad("is not a section"))?
        .insert(name.trim().to_owned(), value);
    Ok(())
}

/// Bytes of a size such as `2GiB`, `500MB`, `1000000`; `Some(0)` for the empty text.
pub fn parse_bytes(text: &str) -> Option<u64> {
    let text = text.trim();
    if text.is_empty() {
        return Some(0);
    }
    let split = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let number: f64 = text[..split].parse().ok()?;
    let factor = match text[split..].trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kib" => 1024.0,
        "kb" => 1e3,
        "m" | "mib" => 1024.0 * 1024.0,
        "mb" => 1e6,
        "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "gb" => 1e9,
        "t" | "tib" => 1024.0f64.powi(4),
        "tb" => 1e12,
        _ => return None,
    };
    let bytes = number * factor;
    (bytes.is_finite() && bytes < 1e18).then_some(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_in_binary_and_decimal_units() {
        assert_eq!(parse_bytes("2GiB"), Some(2 << 30));
        assert_eq!(parse_bytes("1.5 kB"), Some(1500));
        assert_eq!(parse_bytes(""), Some(0));
        assert_eq!(parse_bytes("many"), None);
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let error = Settings::load(None, &["segment.minimum=3".into()]).expect_err("unknown key").to_string();
        assert!(error.contains("minimum"), "{error}");
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_its_key() {
        let error = Settings::load(None, &["segment.min_sphericity=1.5".into()]).expect_err("range").to_string();
        assert!(error.contains("segment.min_sphericity = 1.5"), "{error}");
    }

    #[test]
    fn an_assignment_reads_numbers_words_and_lists() {
        let s = Settings::load(
            None,
            &[
                "segment.area_rule=triangle-count".into(),
                "input.offset=[1, 2.5, 0]".into(),
                "input.crs=EPSG:2193".into(),
            ],
        )
        .expect("valid");
        assert_eq!(s.segment.area_rule, AreaRule::TriangleCount);
        assert_eq!(s.input.offset, [1.0, 2.5, 0.0]);
        assert_eq!(s.input.crs, "EPSG:2193");
    }
}
