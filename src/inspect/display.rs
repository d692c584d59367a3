//! An inspection for people.

use super::{Contents, FileFigures, Inspection, SurfaceFigures, SurveyFigures};
use std::fmt::{self, Display, Formatter};

impl Display for Inspection {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for file in &self.files {
            write_file(f, file)?;
        }
        write_survey(f, &self.survey, self.files.len())?;
        if let Some(facts) = &self.weld {
            row(f, "borders", facts.summary())?;
        }
        for note in &self.notes {
            writeln!(f, "\nnote: {note}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "\nwarning: {warning}")?;
        }
        Ok(())
    }
}

fn row(f: &mut Formatter<'_>, name: &str, value: impl Display) -> fmt::Result {
    writeln!(f, "  {name:<20} {value}")
}

fn write_file(f: &mut Formatter<'_>, file: &FileFigures) -> fmt::Result {
    writeln!(f, "{}", file.path)?;
    row(f, "format", format!("{}, {}", file.format, bytes(file.fingerprint.bytes)))?;
    let step = file.coordinate_step_m.map_or("whole numbers".to_owned(), |s| format!("steps of at most {}", length(s)));
    let [x, y, z] = file.coordinate_types;
    let types = if x == y && y == z { x.to_owned() } else { format!("{x}, {y}, {z}") };
    row(f, "coordinates", format!("{types}, {step}"))?;
    row(f, "colours", file.color_type.unwrap_or("none"))?;
    write_contents(f, &file.contents)?;
    if file.contents.triangles > 0 {
        write_surface(f, &file.surface)?;
    }
    writeln!(f)
}

fn write_survey(f: &mut Formatter<'_>, survey: &SurveyFigures, files: usize) -> fmt::Result {
    writeln!(f, "survey ({files} {})", if files == 1 { "file" } else { "files" })?;
    let place = &survey.georeference;
    let from = |from: &Option<String>| from.as_ref().map_or_else(String::new, |from| format!(", from {from}"));
    let crs = match (&place.crs, &place.authority) {
        (Some(name), Some(code)) => format!("{name} ({code})"),
        (Some(name), None) => name.clone(),
        _ => "none".to_owned(),
    };
    row(f, "CRS", format!("{crs}{}", from(&place.crs_from)))?;
    let unit = |name: &str, metres: f64| if metres == 1.0 { name.to_owned() } else { format!("{name}, {metres} m") };
    let input_unit = unit(&place.input_unit, place.metres_per_input_unit);
    row(f, "input unit", format!("{input_unit} ({})", place.input_unit_from))?;
    row(f, "map unit", unit(&place.unit, place.metres_per_map_unit))?;
    if place.offset_map_units != [0.0; 3] {
        let [e, n, u] = place.offset_map_units;
        row(f, "offset", format!("{e}, {n}, {u} map units{}", from(&place.offset_from)))?;
    }
    if files != 1 {
        row(f, "colours", if survey.has_colors { "yes" } else { "none" })?;
        write_contents(f, &survey.contents)?;
        if survey.contents.triangles > 0 {
            write_surface(f, &survey.surface)?;
        }
    }
    if let Some(spacing_m) = survey.point_spacing_m {
        let about = length(survey.surface.mean_edge_m);
        row(f, "points apart", format!("{}; the surface will have edges of about {about}", length(spacing_m)))?;
    }
    let s = &survey.suggestion;
    let across = length(s.smallest_grain_diameter_m);
    let smallest = format!("{} (a disc of {across}, 50 mean triangles)", area(s.smallest_grain_area_m2));
    row(f, "can be measured", format!("from {smallest} on; not all that is so small can be told from noise"))?;
    let coarse = if s.coarse { " (coarser than 30 mm: boulders only)" } else { "" };
    row(f, "preset", format!("--config {}{coarse}", s.preset.name()))?;
    let limits = format!("--min-grain-area {:e} --max-grain {}", s.min_grain_area_m2, s.max_grain_m);
    row(f, "suggested limits", limits)?;
    let l = &s.lengths;
    writeln!(f, "  with the default settings, all of which are multiples of the mean edge:")?;
    let valley = length(l.bluntest_valley_m);
    row(f, "a valley is", format!("a hollow that bends more sharply than a radius of {valley} (valley_depth)"))?;
    row(f, "bridges cut", format!("between stones, up to a width of {} (bridge_edges)", length(l.widest_bridge_m)))?;
    let smoothed = length(l.smoothed_m);
    let again = length(l.smoothed_again_m);
    row(f, "relief smoothed", format!("on a stone, where it is finer than {smoothed} (normal_passes, crease);"))?;
    row(f, "", format!("where no stone is found then, finer than {again} (second_passes)"))?;
    row(f, "growth", format!("up to {} into the valleys around a stone (growth_edges)", length(l.growth_m)))?;
    row(f, "patches joined", format!("over gaps of up to {} (join_reach_edges)", length(l.widest_gap_m)))?;
    let needs = &survey.needs;
    let least = format!("at least {}", bytes(needs.least_memory_bytes));
    row(f, "memory", format!("{least}; with {} it is worked in one piece", bytes(needs.whole_memory_bytes)))?;
    if let Some(there) = needs.memory_there_bytes {
        row(f, "memory there", format!("{}, of which a run takes half unless --memory says otherwise", bytes(there)))?;
    }
    row(f, "disk for the index", bytes(needs.disk_bytes))
}

fn write_contents(f: &mut Formatter<'_>, c: &Contents) -> fmt::Result {
    if c.triangles == 0 {
        row(f, "points", c.vertices)?;
    } else {
        row(f, "vertices", c.vertices)?;
        row(f, "faces", c.faces)?;
        row(f, "triangles", c.triangles)?;
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (min, max) = (c.min_input[axis], c.max_input[axis]);
        let metres = format!("{:.4} to {:.4} m", c.min_m[axis], c.max_m[axis]);
        row(f, name, format!("{min} to {max} input units, {metres}"))?;
    }
    let [x, y, z] = c.extent_m;
    row(f, "extent", format!("{x:.3} x {y:.3} x {z:.3} m"))
}

fn write_surface(f: &mut Formatter<'_>, s: &SurfaceFigures) -> fmt::Result {
    row(f, "mean edge", length(s.mean_edge_m))?;
    row(f, "mean triangle", area(s.mean_triangle_area_m2))?;
    row(f, "surface", area(s.surface_area_m2))?;
    row(f, "density", s.triangles_per_m2.map_or("none".to_owned(), |d| format!("{d:.0} triangles per m²")))?;
    row(f, "zero-area triangles", s.zero_area_triangles)
}

fn length(metres: f64) -> String {
    match metres {
        m if m >= 1.0 => format!("{m:.3} m"),
        m if m >= 1e-4 => format!("{:.2} mm", m * 1e3),
        m => format!("{m:.1e} m"),
    }
}

/// In m², as `--min-grain-area` has it, and where that is little in mm² beside it.
fn area(m2: f64) -> String {
    if m2 >= 0.01 { format!("{m2:.3} m²") } else { format!("{m2:.2e} m² ({:.3} mm²)", m2 * 1e6) }
}

fn bytes(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1024.0 {
            return if unit == "B" { format!("{bytes} B") } else { format!("{value:.1} {unit}") };
        }
        value /= 1024.0;
    }
    format!("{value:.1} TiB")
}
