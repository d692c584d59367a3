//! Reading settings: defaults, then a file or preset, then single keys; then every value is checked.

use super::Settings;
use std::path::Path;

/// The presets that the program carries, by name. `configs/` holds the same files.
pub const PRESETS: [(&str, &str); 6] = [
    ("default", include_str!("../../configs/default.toml")),
    ("sandbox", include_str!("../../configs/sandbox.toml")),
    ("mast", include_str!("../../configs/mast.toml")),
    ("drone", include_str!("../../configs/drone.toml")),
    ("laser-scan", include_str!("../../configs/laser-scan.toml")),
    ("rheinwalt2025", include_str!("../../configs/rheinwalt2025.toml")),
];

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The settings file could not be read.
    #[error(
        "{path}: cannot read the settings file: {source}\nhelp: give a TOML file or a preset: default, sandbox, mast, drone, laser-scan, rheinwalt2025"
    )]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not TOML, or holds an unknown key or a value of the wrong kind.
    #[error("{origin}: {message}\nhelp: `gravelometer settings` prints every key with its unit and its default")]
    Parse {
        /// File or flag.
        origin: String,
        /// What the parser says, with line and column where it knows them.
        message: String,
    },
    /// A value outside its range.
    #[error("{key} = {value}: {rule}\nhelp: `gravelometer settings` prints every key with its default")]
    Range {
        /// Dotted key.
        key: &'static str,
        /// The offending value.
        value: String,
        /// What is allowed.
        rule: &'static str,
    },
}

/// The text of a settings file; of a preset where no file has that name.
fn read(path: &Path) -> Result<String, SettingsError> {
    let preset = PRESETS.iter().find(|(name, _)| path.as_os_str() == *name);
    match (std::fs::read_to_string(path), preset) {
        (Ok(text), _) => Ok(text),
        (Err(_), Some((_, text))) => Ok((*text).to_owned()),
        (Err(source), None) => Err(SettingsError::Read { path: path.display().to_string(), source }),
    }
}

impl Settings {
    /// Defaults, overlaid by a settings file or preset, overlaid by `section.key=value` assignments, then checked.
    ///
    /// # Errors
    /// Unreadable file, malformed TOML, unknown key, value out of range.
    pub fn load(file: Option<&Path>, assignments: &[String]) -> Result<Settings, SettingsError> {
        let mut table = toml::Table::new();
        if let Some(path) = file {
            let origin = path.display().to_string();
            let text = read(path)?;
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
            ("input.weld_m", self.input.weld_m),
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
        self.valleys.check()?;
        let surface = &self.surface;
        range(
            "surface.gap_spacings",
            surface.gap_spacings,
            (0.7..=3.0).contains(&surface.gap_spacings),
            "must lie in 0.7 to 3",
        )?;
        let c = &self.curvature;
        range("curvature.neighbours", c.neighbours, (1..=256).contains(&c.neighbours), "must lie in 1 to 256")?;
        range(
            "curvature.stencil_spacings",
            c.stencil_spacings,
            c.stencil_spacings.is_finite() && c.stencil_spacings > 0.0,
            "must be a finite number above 0",
        )?;
        let m = &self.measure;
        for (key, value) in [("measure.prior_c_over_b", m.prior_c_over_b), ("measure.prior_b_over_a", m.prior_b_over_a)]
        {
            range(key, value, (0.01..=1.0).contains(&value), "must lie in 0.01 to 1")?;
        }
        for (key, value) in [
            ("measure.prior_c_over_b_spread", m.prior_c_over_b_spread),
            ("measure.prior_b_over_a_spread", m.prior_b_over_a_spread),
        ] {
            range(key, value, (0.05..=2.0).contains(&value), "must lie in 0.05 to 2")?;
        }
        let ratio = self.measure.equant_ratio;
        range("measure.equant_ratio", ratio, ratio.is_finite() && ratio >= 1.0, "must be a finite number, 1 or more")?;
        let least = self.measure.min_confidence;
        range("measure.min_confidence", least, (0.0..=1.0).contains(&least), "must lie in 0 to 1")?;
        range("work.threads", self.work.threads, self.work.threads <= 1024, "must be at most 1024")?;
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

pub(super) fn range(
    key: &'static str,
    value: impl ToString,
    ok: bool,
    rule: &'static str,
) -> Result<(), SettingsError> {
    if ok { Ok(()) } else { Err(SettingsError::Range { key, value: value.to_string(), rule }) }
}

/// Sets one dotted key; the value is read as TOML, as a number where it is one without the 0 before the point (`.5`), and as
/// a plain string where that fails.
fn assign(table: &mut toml::Table, assignment: &str) -> Result<(), SettingsError> {
    let bad = |message: &str| SettingsError::Parse { origin: format!("--set {assignment}"), message: message.into() };
    let (key, text) = assignment.split_once('=').ok_or_else(|| bad("expected section.key=value"))?;
    let (section, name) = key.trim().split_once('.').ok_or_else(|| bad("expected section.key=value"))?;
    let value = format!("v = {text}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut t| t.remove("v"))
        .or_else(|| number(text.trim()))
        .unwrap_or_else(|| toml::Value::String(text.trim().to_owned()));
    table
        .entry(section.trim())
        .or_insert_with(|| toml::Value::Table(toml::Table::new()))
        .as_table_mut()
        .ok_or_else(|| bad("is not a section"))?
        .insert(name.trim().to_owned(), value);
    Ok(())
}

/// A number that begins with its point.
fn number(text: &str) -> Option<toml::Value> {
    let begins_with_its_point = text.trim_start_matches(['+', '-']).starts_with('.');
    text.parse().ok().filter(|_| begins_with_its_point).map(toml::Value::Float)
}

/// A size as text, also where it was written as a plain number of bytes.
pub(super) fn size_text<'de, D: serde::Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    #[derive(serde::Deserialize)]
    #[serde(untagged)]
    enum Size {
        Text(String),
        Bytes(u64),
    }
    Ok(match serde::Deserialize::deserialize(from)? {
        Size::Text(text) => text,
        Size::Bytes(bytes) => bytes.to_string(),
    })
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
    use crate::settings::AreaRule;

    #[test]
    fn a_number_may_begin_with_its_point_and_a_name_with_a_digit() {
        let load = |assignment: &str| Settings::load(None, &[assignment.into()]);
        assert_eq!(load("valleys.valley_depth=.05").expect("a number").valleys.valley_depth, 0.05);
        assert_eq!(load("valleys.stone_score=-.5").expect("a number").valleys.stone_score, -0.5);
        for name in ["0012", "1.txt", "2024."] {
            assert_eq!(load(&format!("input.offset_file={name}")).expect("a name").input.offset_file, name);
        }
        assert!(load("valleys.valley_depth=--5").is_err());
    }

    #[test]
    fn sizes_are_read_in_binary_and_decimal_units() {
        assert_eq!(parse_bytes("2GiB"), Some(2 << 30));
        assert_eq!(parse_bytes("1.5 kB"), Some(1500));
        assert_eq!(parse_bytes(""), Some(0));
        assert_eq!(parse_bytes("many"), None);
    }

    #[test]
    fn every_preset_can_be_loaded_by_name_and_the_default_is_the_default() {
        for (name, _) in PRESETS {
            let settings = Settings::load(Some(Path::new(name)), &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(name == "default", settings == Settings::default(), "{name}");
        }
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
        for (key, value) in [("prior_c_over_b", "1.2"), ("prior_b_over_a", "0"), ("prior_c_over_b_spread", "0.01")] {
            let assignment = format!("measure.{key}={value}");
            let error = Settings::load(None, &[assignment]).expect_err(key).to_string();
            assert!(error.contains(&format!("measure.{key} = {value}: must lie in ")), "{error}");
        }
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
