//! A first look at a survey: what is in the files, what they can show, and what a run would take.

mod display;
mod needs;
mod suggestion;

use crate::geometry::{DVec3, ExactSum};
use crate::open::{Fingerprint, Frame, Georeference, OpenError, Reach, Scalar, SurveyFile, resolve_inputs};
use crate::pipeline::memory_there_bytes;
use crate::settings::InputSettings;
use crate::triangulate::point_spacing_m;
use crate::weld::{self, WeldFacts, weld};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Display;
use std::path::PathBuf;

pub use needs::Needs;
pub use suggestion::{Preset, Suggestion};

/// What a survey holds, whole and file by file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// All files together.
    pub survey: SurveyFigures,
    /// Each file, in the order given.
    pub files: Vec<FileFigures>,
    /// What was found beside the files, or left out.
    pub notes: Vec<String>,
    /// What welding them gave; none for a single file, or where they cannot be welded, which is among the warnings.
    pub weld: Option<WeldFacts>,
    /// What is odd about them, each with a remedy.
    pub warnings: Vec<String>,
}

/// All files together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurveyFigures {
    /// Counts and coordinates.
    pub contents: Contents,
    /// CRS, offset and unit, and where they came from.
    pub georeference: Georeference,
    /// Whether every vertex has a colour.
    pub has_colors: bool,
    /// What the surface is made of; of a cloud, what it will be made of, about.
    pub surface: SurfaceFigures,
    /// Of a cloud, the side of the square that a point has in plan, metres.
    pub point_spacing_m: Option<f64>,
    /// What the survey can show, and settings for it.
    pub suggestion: Suggestion,
    /// What a run would take.
    pub needs: Needs,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileFigures {
    /// The path as given.
    pub path: String,
    /// Format and encoding.
    pub format: String,
    /// Length and hash.
    pub fingerprint: Fingerprint,
    /// Types of x, y, z.
    pub coordinate_types: [&'static str; 3],
    /// Coarsest distance between neighbouring values of the file's coordinates at their largest, metres;
    /// none for whole numbers.
    pub coordinate_step_m: Option<f64>,
    /// Type of the colours; none without colours.
    pub color_type: Option<&'static str>,
    /// The header's comments.
    pub comments: Vec<String>,
    /// Counts and coordinates.
    pub contents: Contents,
    /// What the surface is made of.
    pub surface: SurfaceFigures,
}

/// Counts and coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contents {
    /// Vertices, unused ones included.
    pub vertices: u64,
    /// Faces as the file has them.
    pub faces: u64,
    /// Triangles into which they are cut.
    pub triangles: u64,
    /// Lowest coordinates, input units.
    pub min_input: [f64; 3],
    /// Highest coordinates, input units.
    pub max_input: [f64; 3],
    /// Lowest coordinates, metres.
    pub min_m: [f64; 3],
    /// Highest coordinates, metres.
    pub max_m: [f64; 3],
    /// Extent along x, y, z, metres.
    pub extent_m: [f64; 3],
}

/// What a surface is made of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SurfaceFigures {
    /// Mean length of the triangles' edges (an edge counts once per triangle), metres.
    pub mean_edge_m: f64,
    /// Mean triangle area, m².
    pub mean_triangle_area_m2: f64,
    /// Summed triangle area, m².
    pub surface_area_m2: f64,
    /// Triangles per m² of surface; none for a surface of no area.
    pub triangles_per_m2: Option<f64>,
    /// Triangles of zero area.
    pub zero_area_triangles: u64,
}

/// Opens a survey and looks at every triangle.
///
/// # Errors
/// Those of [`resolve_inputs`] and of [`Reach::open`].
pub fn inspect(paths: &[PathBuf], input: &InputSettings) -> Result<Inspection, OpenError> {
    let inputs = resolve_inputs(paths)?;
    let (reach, warnings) = Reach::open(&inputs.paths, input, &|_, _| {})?;
    let sums: Vec<Sums> = reach.files().iter().map(|f| Sums::of(&reach, f)).collect();
    let frame = reach.frame();
    let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    let refused = |refused: &dyn Display| format!("a run would be refused: {refused}");
    let cloud = reach.is_cloud().then(|| point_spacing_m(&reach, &|point| !reach.is_skipped(point)));
    if let Some(Err(error)) = &cloud {
        warnings.push(refused(error));
    }
    let point_spacing_m = cloud.and_then(Result::ok).map(|(spacing_m, _)| spacing_m);
    let figures = |sums: &Sums, vertices: u64, triangles: u64| match point_spacing_m {
        Some(spacing_m) => SurfaceFigures::of_cloud(spacing_m, vertices),
        None => sums.figures(triangles),
    };
    let of_file = |(f, s): (&SurveyFile, &Sums)| file_figures(f, figures(s, f.vertices(), f.triangles()), frame);
    let files = reach.files().iter().zip(&sums).map(of_file).collect();
    let all = sums.iter().fold(Sums::default(), |a, &b| a.merge(b));
    let surface = figures(&all, reach.vertices(), reach.triangles());
    if !reach.is_cloud() && surface.surface_area_m2 <= 0.0 {
        warnings.push(refused(&"the surface has no area at all: check the unit (--unit) and the export"));
    }
    let counts = [reach.vertices(), reach.faces(), reach.triangles()];
    let mut needs = Needs::of(&reach, memory_there_bytes());
    let weld = match weld(&reach, input.weld_m, u64::MAX) {
        Ok((welded, facts)) => {
            needs.least_memory_bytes += welded.bytes();
            facts
        }
        Err(error) => {
            warnings.push(refused(&error));
            None
        }
    };
    if let Some(facts) = &weld {
        warnings.extend(weld::warnings(facts, &weld::parts(&reach)).iter().map(ToString::to_string));
    }
    let survey = SurveyFigures {
        contents: Contents::new(counts, reach.input_bounds(), frame),
        georeference: reach.georeference().clone(),
        has_colors: reach.has_colors(),
        surface,
        point_spacing_m,
        suggestion: Suggestion::new(&surface, reach.has_colors()),
        needs,
    };
    let notes = inputs.notes.iter().chain(&reach.georeference().notes).cloned().collect();
    Ok(Inspection { survey, files, notes, weld, warnings })
}

fn file_figures(file: &SurveyFile, surface: SurfaceFigures, frame: &Frame) -> FileFigures {
    let counts = [file.vertices(), file.faces(), file.triangles()];
    FileFigures {
        path: file.path().display().to_string(),
        format: file.format(),
        fingerprint: file.fingerprint(),
        coordinate_types: file.axis_types().map(Scalar::ply_name),
        coordinate_step_m: file.coordinate_step().map(|step| step * frame.metres_per_input_unit),
        color_type: file.color_type().map(Scalar::ply_name),
        comments: file.comments().to_vec(),
        contents: Contents::new(counts, file.input_bounds(), frame),
        surface,
    }
}

/// Mean edge of the Delaunay triangulation of points strewn at random, in spacings: 32 / (9 pi), Miles 1970,
/// <https://doi.org/10.1016/0025-5564(70)90061-1>.
const EDGE_SPACINGS: f64 = 1.1318;

impl SurfaceFigures {
    /// Of the surface that a cloud will get, about: two triangles for each point.
    fn of_cloud(spacing_m: f64, points: u64) -> SurfaceFigures {
        let square_m2 = spacing_m * spacing_m;
        SurfaceFigures {
            mean_edge_m: EDGE_SPACINGS * spacing_m,
            mean_triangle_area_m2: square_m2 / 2.0,
            surface_area_m2: square_m2 * points as f64,
            triangles_per_m2: Some(2.0 / square_m2),
            zero_area_triangles: 0,
        }
    }
}

impl Contents {
    fn new(counts: [u64; 3], bounds: ([f64; 3], [f64; 3]), frame: &Frame) -> Contents {
        let (min, max) = bounds;
        let metres = frame.metres_per_input_unit;
        Contents {
            vertices: counts[0],
            faces: counts[1],
            triangles: counts[2],
            min_input: min,
            max_input: max,
            min_m: min.map(|v| v * metres),
            max_m: max.map(|v| v * metres),
            extent_m: std::array::from_fn(|i| (max[i] - min[i]) * metres),
        }
    }
}

/// Exact sums over triangles: the same whatever the order.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    edge_m: ExactSum,
    area_m2: ExactSum,
    zero_area: u64,
}

/// Triangles per parallel task.
const CHUNK: u64 = 1 << 16;

impl Sums {
    fn of(reach: &Reach, file: &SurveyFile) -> Sums {
        (0..file.triangles().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = Sums::default();
                for triangle in chunk * CHUNK..((chunk + 1) * CHUNK).min(file.triangles()) {
                    let corners = reach.triangle(file.first_triangle() + triangle);
                    sums.add(corners.map(|v| reach.position(v)));
                }
                sums
            })
            .reduce(Sums::default, Sums::merge)
    }

    fn add(&mut self, [a, b, c]: [DVec3; 3]) {
        let area_m2 = (b - a).cross(c - a).length() / 2.0;
        self.area_m2.add(area_m2);
        self.edge_m.add(a.distance(b) + b.distance(c) + c.distance(a));
        self.zero_area += u64::from(area_m2 == 0.0);
    }

    fn merge(mut self, other: Sums) -> Sums {
        self.edge_m.merge(other.edge_m);
        self.area_m2.merge(other.area_m2);
        self.zero_area += other.zero_area;
        self
    }

    fn figures(&self, triangles: u64) -> SurfaceFigures {
        let (count, area) = (triangles as f64, self.area_m2.value());
        SurfaceFigures {
            mean_edge_m: self.edge_m.value() / (3.0 * count),
            mean_triangle_area_m2: area / count,
            surface_area_m2: area,
            triangles_per_m2: (area > 0.0).then(|| count / area),
            zero_area_triangles: self.zero_area,
        }
    }
}
