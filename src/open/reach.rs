//! A survey: one or several files in one frame.

use super::agreement::{check_heights, check_same_kind, stated_systems};
use super::error::OpenError;
use super::frame::Frame;
use super::georeference::{Georeference, SideFiles};
use super::las_crs::CloudCrs;
use super::mapped::MappedFile;
use super::ply::PlyMesh;
use super::precision::{check_not_degrees, check_precision};
use super::progress::Progress;
use super::sample::EdgeSample;
use super::scalar::Scalar;
use super::survey_file::SurveyFile;
use super::warning::Warning;
use crate::geometry::DVec3;
use crate::settings::{InputSettings, Unit};
use std::ops::Range;
use std::path::PathBuf;

/// A survey that is ready to be computed on: every vertex is finite, every triangle names vertices that
/// are there, so that reading cannot fail any more. Read from any thread.
///
/// Several files are one survey: vertices, faces and triangles are numbered on from file to file. Triangles
/// are in file order: faces in order, each cut into a fan (0, k, k+1) about its first corner.
#[derive(Debug)]
pub struct Reach {
    files: Vec<SurveyFile>,
    georeference: Georeference,
    frame: Frame,
    bounds: ([f64; 3], [f64; 3]),
    full_color: Option<f64>,
    sampled_edges_m: Vec<Option<f64>>,
}

/// Longest survey along an axis, metres. Keeps squares and sums of areas far from the limits of their types.
const LONGEST_EXTENT_M: f64 = 1e5;
/// A mean edge above the first, over an extent in plan above the second, is rather one of millimetres: too
/// coarse to show gravel, metres. The finer pair is that of a box of sand scanned at 0.1 mm.
const LIKE_MILLIMETRES_M: [(f64, f64); 2] = [(0.2, 50.0), (0.05, 200.0)];
/// More of a surface than this faces down, in plan, where something is upside down: of beds of stones seen from all sides,
/// with their overhangs, up to 0.28 does.
const MOST_FACING_DOWN: f64 = 0.4;
/// A line feed, or a line feed and a carriage return, behind the last record is no finding.
pub(super) const TOLERATED_TRAILING_BYTES: u64 = 2;

impl Reach {
    /// Maps the files, validates every record, finds the bounds and sets the frame. `progress` hears the
    /// bytes done and the bytes in total, from any thread.
    ///
    /// The frame's origin is the whole number of input units below the lowest coordinates. Its unit is that
    /// of the settings, else that of the CRS, else metres; the map's unit is that of the CRS, else metres.
    ///
    /// # Errors
    /// Whatever makes a file unreadable or a survey meaningless; see [`OpenError`].
    pub fn open(
        paths: &[PathBuf],
        input: &InputSettings,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<(Reach, Vec<Warning>), OpenError> {
        // Before the files: what is wrong with a side file is told at once.
        let side_files = SideFiles::read(paths, input)?;
        side_files.resolve(&[])?;
        let files = open_files(paths, progress)?;
        check_same_kind(&files)?;
        let georeference = side_files.resolve(&stated_systems(&files))?;
        check_heights(&files, &georeference)?;
        let bounds = joint_bounds(&files);
        let frame = georeference.frame(bounds.0);
        check_extent(&files, &frame, &bounds)?;
        let bytes = files.iter().all(|f| f.color_type() == Some(Scalar::U8));
        let has_colors = files.iter().all(|f| f.color_type().is_some());
        let full_color = has_colors.then_some(if bytes { 255.0 } else { 1.0 });
        let mut reach = Reach { files, georeference, frame, bounds, full_color, sampled_edges_m: Vec::new() };
        let samples: Vec<_> = reach.files.iter().map(|file| EdgeSample::of(file, &reach.frame)).collect();
        reach.sampled_edges_m = samples.iter().map(EdgeSample::mean_edge_m).collect();
        let mut coarse = Vec::new();
        for (file, sample) in reach.files.iter().zip(&samples) {
            if input.unit == Unit::Auto {
                check_not_degrees(&file.path.display().to_string(), sample, file.input_bounds())?;
            }
            coarse.extend(check_precision(file, sample, &reach.frame)?);
            let path = || file.path.display().to_string();
            let down = sample.share_facing_down().filter(|&share| share > MOST_FACING_DOWN);
            coarse.extend(down.map(|share| Warning::FacesDown { path: path(), share }));
        }
        let mut warnings = reach.warnings(input, samples[0].mean_edge_m());
        warnings.extend(coarse);
        Ok((reach, warnings))
    }

    /// Whether the files are point clouds, which have vertices and no triangles.
    pub fn is_cloud(&self) -> bool {
        self.triangles() == 0
    }

    /// Refuses what another program has written to since it was opened; with `opened_again` also what it has replaced or
    /// removed, which matters where files were opened a second time.
    ///
    /// # Errors
    /// [`OpenError::Changed`], with the first such file.
    pub fn check_unchanged(&self, opened_again: bool) -> Result<(), OpenError> {
        let of_file = |file: &SurveyFile| match opened_again {
            true => file.mesh.bytes.stamp().check_same(file.path()),
            false => file.mesh.bytes.check_not_rewritten(file.path()),
        };
        self.files().iter().try_for_each(of_file)
    }

    /// From input to local to map.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Where the survey is, and who said so.
    pub fn georeference(&self) -> &Georeference {
        &self.georeference
    }

    /// The files, in the order given.
    pub fn files(&self) -> &[SurveyFile] {
        &self.files
    }

    /// Mean edge of a sample of each file's triangles, metres; none for a file without an edge of any length.
    pub fn sampled_edges_m(&self) -> &[Option<f64>] {
        &self.sampled_edges_m
    }

    /// Number of vertices, unused ones included.
    pub fn vertices(&self) -> u64 {
        self.files.iter().map(SurveyFile::vertices).sum()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.files.iter().map(SurveyFile::triangles).sum()
    }

    /// Number of faces as the files have them.
    pub fn faces(&self) -> u64 {
        self.files.iter().map(SurveyFile::faces).sum()
    }

    /// Lowest and highest coordinates, input units.
    pub fn input_bounds(&self) -> ([f64; 3], [f64; 3]) {
        self.bounds
    }

    /// Whether every vertex has a colour.
    pub fn has_colors(&self) -> bool {
        self.full_color.is_some()
    }

    /// Place of a vertex, local metres.
    ///
    /// # Panics
    /// Above the last vertex.
    #[inline]
    pub fn position(&self, vertex: u64) -> DVec3 {
        let file = self.file_of(vertex, |f| f.first_vertex);
        self.frame.local(file.mesh.vertices.position(file.mesh.bytes(), vertex - file.first_vertex))
    }

    /// The three vertices of a triangle.
    ///
    /// # Panics
    /// Above the last triangle.
    #[inline]
    pub fn triangle(&self, triangle: u64) -> [u64; 3] {
        let file = self.file_of(triangle, |f| f.first_triangle);
        let [a, b, c] = file.mesh.faces.triangle(file.mesh.bytes(), triangle - file.first_triangle);
        [a + file.first_vertex, b + file.first_vertex, c + file.first_vertex]
    }

    /// Puts the places of a range of vertices, local metres, in place of what `to` holds: quicker than one by one.
    ///
    /// # Panics
    /// Above the last vertex.
    pub fn positions(&self, vertices: Range<u64>, to: &mut Vec<DVec3>) {
        to.clear();
        for file in &self.files {
            let of_file = within(&vertices, file.first_vertex, file.vertices());
            file.mesh.vertices.each_position(file.mesh.bytes(), of_file, |p| to.push(self.frame.local(p)));
        }
    }

    /// Puts the colours of a range of vertices, as [`Reach::raw_color`] has them, in place of what `to` holds.
    ///
    /// # Panics
    /// Above the last vertex.
    pub fn raw_colors(&self, vertices: Range<u64>, to: &mut Vec<[f32; 3]>) {
        to.clear();
        match self.full_color {
            None => to.resize(vertices.end.saturating_sub(vertices.start) as usize, [0.0; 3]),
            Some(full) => {
                for file in &self.files {
                    let (bytes, of_file) = (file.mesh.bytes(), within(&vertices, file.first_vertex, file.vertices()));
                    to.extend(of_file.map(|v| file.mesh.vertices.color_in(bytes, v, full).unwrap_or_default()));
                }
            }
        }
    }

    /// Puts the vertices of a range of triangles in place of what `to` holds: quicker than one by one.
    ///
    /// # Panics
    /// Above the last triangle.
    pub fn corner_numbers(&self, triangles: Range<u64>, to: &mut Vec<[u64; 3]>) {
        to.clear();
        for file in &self.files {
            let of_file = within(&triangles, file.first_triangle, file.triangles());
            let first = file.first_vertex;
            file.mesh.faces.each_triangle(file.mesh.bytes(), of_file, |corners| to.push(corners.map(|v| v + first)));
        }
    }

    /// The face that a triangle is part of.
    ///
    /// # Panics
    /// Above the last triangle.
    #[inline]
    pub fn face_of(&self, triangle: u64) -> u64 {
        let file = self.file_of(triangle, |f| f.first_triangle);
        file.mesh.faces.face_of(triangle - file.first_triangle) + file.first_face
    }

    /// Red, green and blue of a vertex, 0 to 1; `None` unless every vertex of the survey has a colour.
    ///
    /// # Panics
    /// Above the last vertex.
    #[inline]
    pub fn color(&self, vertex: u64) -> Option<[f64; 3]> {
        self.full_color?;
        let file = self.file_of(vertex, |f| f.first_vertex);
        file.mesh.vertices.color(file.mesh.bytes(), vertex - file.first_vertex)
    }

    /// What stands for full colour in [`Reach::raw_color`]: 255 where all files have colours of one byte,
    /// else 1; none unless every vertex has a colour.
    pub fn full_color(&self) -> Option<f64> {
        self.full_color
    }

    /// Red, green and blue of a vertex, in parts of [`Reach::full_color`]; zero without colours.
    ///
    /// # Panics
    /// Above the last vertex.
    #[inline]
    pub fn raw_color(&self, vertex: u64) -> [f32; 3] {
        let Some(full) = self.full_color else { return [0.0; 3] };
        let file = self.file_of(vertex, |f| f.first_vertex);
        file.mesh.vertices.color_in(file.mesh.bytes(), vertex - file.first_vertex, full).unwrap_or_default()
    }

    /// Whether a point of a cloud is noise or withheld.
    ///
    /// # Panics
    /// Above the last vertex.
    #[inline]
    pub fn is_skipped(&self, vertex: u64) -> bool {
        let file = self.file_of(vertex, |f| f.first_vertex);
        file.mesh.vertices.is_skipped(file.mesh.bytes(), vertex - file.first_vertex)
    }

    /// Lets go of all pages of the files: they are read again when they are needed.
    pub fn release(&self) {
        self.files.iter().for_each(|f| f.mesh.release());
    }

    #[inline]
    fn file_of(&self, number: u64, first: impl Fn(&SurveyFile) -> u64) -> &SurveyFile {
        match self.files.as_slice() {
            [only] => only,
            // The first file starts at 0, so at least one starts at or below any number.
            several => &several[several.partition_point(|f| first(f) <= number) - 1],
        }
    }

    /// A warning if the survey, taken as metres, is rather one of millimetres.
    pub fn looks_like_millimetres(&self, mean_edge_m: f64) -> Option<Warning> {
        let (extent_m, path) = (self.plan_extent_m(), self.files.first()?.path.display().to_string());
        let looks = LIKE_MILLIMETRES_M.iter().any(|&(edge, extent)| mean_edge_m >= edge && extent_m > extent);
        looks.then_some(Warning::LooksLikeMillimetres { path, mean_edge_m, extent_m })
    }

    fn warnings(&self, input: &InputSettings, mean_edge_m: Option<f64>) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let name = |file: &SurveyFile| file.path.display().to_string();
        if input.unit == Unit::Auto {
            warnings.extend(mean_edge_m.and_then(|mean_edge_m| self.looks_like_millimetres(mean_edge_m)));
        }
        let Georeference { offset_map_units: offset, .. } = self.georeference;
        if let Some(first) = self.files.first()
            && self.frame.is_shifted_twice(self.bounds)
        {
            warnings.push(Warning::LooksShifted { path: name(first), lowest: self.bounds.0, offset });
        }
        for file in &self.files {
            let bytes = file.mesh.trailing_bytes;
            if bytes > TOLERATED_TRAILING_BYTES {
                warnings.push(Warning::TrailingBytes { path: name(file), bytes });
            }
            if let Some((line, text)) = file.mesh.header.skipped.first().cloned() {
                let lines = file.mesh.header.skipped.len() as u64;
                warnings.push(Warning::HeaderLinesSkipped { path: name(file), line, text, lines });
            }
            if let Some(las) = &file.mesh.las {
                warnings.extend(las.warnings.iter().cloned());
                if let CloudCrs::Unusable { reason } = &las.crs {
                    warnings.push(Warning::CrsUnusable { path: name(file), reason: reason.clone() });
                }
            }
            if let Some(reason) = &file.mesh.vertices.color_refused {
                warnings.push(Warning::ColoursIgnored { path: name(file), reason: reason.clone() });
            }
        }
        if !self.has_colors()
            && self.files.iter().any(|f| f.color_type().is_some())
            && let Some(without) = self.files.iter().find(|f| f.color_type().is_none())
        {
            warnings.push(Warning::SomeFilesWithoutColours { path: name(without) });
        }
        warnings
    }

    fn plan_extent_m(&self) -> f64 {
        let (min, max) = self.bounds;
        (max[0] - min[0]).max(max[1] - min[1]) * self.frame.metres_per_input_unit
    }
}

/// What of a range lies in a file with `n` elements from `first` on, by the file's own numbers.
fn within(range: &Range<u64>, first: u64, n: u64) -> Range<u64> {
    range.start.saturating_sub(first).min(n)..range.end.saturating_sub(first).min(n)
}

fn open_files(paths: &[PathBuf], tell: &(dyn Fn(u64, u64) + Sync)) -> Result<Vec<SurveyFile>, OpenError> {
    if paths.is_empty() {
        return Err(OpenError::NoFiles);
    }
    let mut real: Vec<(PathBuf, &PathBuf)> =
        paths.iter().filter_map(|path| path.canonicalize().ok().map(|real| (real, path))).collect();
    real.sort();
    if let Some(same) = real.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(OpenError::Twice { path: same[1].1.display().to_string() });
    }
    let mapped = paths.iter().map(|path| MappedFile::open(path)).collect::<Result<Vec<_>, _>>()?;
    let progress = Progress::new(mapped.iter().map(|m| m.len() as u64).sum(), tell);
    let (mut files, mut done) = (Vec::<SurveyFile>::new(), 0);
    for (path, bytes) in paths.iter().zip(mapped) {
        done += bytes.len() as u64;
        let mesh = PlyMesh::open(&path.display().to_string(), bytes, &progress)?;
        files.push(SurveyFile::new(path, mesh, files.last()));
        progress.reach(done);
    }
    Ok(files)
}

fn joint_bounds(files: &[SurveyFile]) -> ([f64; 3], [f64; 3]) {
    files.iter().map(SurveyFile::input_bounds).fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |a, b| {
        (std::array::from_fn(|i| a.0[i].min(b.0[i])), std::array::from_fn(|i| a.1[i].max(b.1[i])))
    })
}

fn check_extent(files: &[SurveyFile], frame: &Frame, bounds: &([f64; 3], [f64; 3])) -> Result<(), OpenError> {
    for (axis, letter) in ['x', 'y', 'z'].into_iter().enumerate() {
        let (min, max) = (bounds.0[axis], bounds.1[axis]);
        let extent_m = (max - min) * frame.metres_per_input_unit;
        if extent_m > LONGEST_EXTENT_M {
            // The file that reaches farthest from the others is the one to look at.
            let reaches = |f: &&SurveyFile| f.input_bounds().1[axis] == max;
            let path = files.iter().find(reaches).map(|f| f.path.display().to_string()).unwrap_or_default();
            return Err(OpenError::Extent { path, axis: letter, min, max, extent_m, limit_m: LONGEST_EXTENT_M });
        }
    }
    Ok(())
}
