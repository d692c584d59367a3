//! A survey: one or several files in one frame.

use super::crs::GeoReference;
use super::error::OpenError;
use super::frame::Frame;
use super::mapped::MappedFile;
use super::ply::PlyMesh;
use super::precision::{COARSEST_STEP_IN_EDGES, coarsest_step};
use super::progress::Progress;
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
    frame: Frame,
    bounds: ([f64; 3], [f64; 3]),
    full_color: Option<f64>,
}

/// Longest survey along an axis, metres. Keeps squares and sums of areas far from the limits of their types.
const LONGEST_EXTENT_M: f64 = 1e5;
/// Places in a file, evenly spread, where edges are measured to judge unit and precision.
const SAMPLED_PLACES: u64 = 256;
/// Triangles that are measured at each.
const SAMPLED_TRIANGLES: u64 = 200;
/// A mean edge above the first, over an extent in plan above the second, is rather one of millimetres: too
/// coarse to show gravel, metres. The finer pair is that of a box of sand scanned at 0.1 mm.
const LIKE_MILLIMETRES_M: [(f64, f64); 2] = [(0.2, 50.0), (0.05, 200.0)];
/// A line feed, or a line feed and a carriage return, behind the last record is no finding.
const TOLERATED_TRAILING_BYTES: u64 = 2;

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
        let reference = GeoReference::from_setting(&input.crs)?;
        let files = open_files(paths, progress)?;
        check_same_kind(&files)?;
        let bounds = joint_bounds(&files);
        let frame = make_frame(input, reference, &bounds);
        check_extent(&files, &frame, &bounds)?;
        let bytes = files.iter().all(|f| f.color_type() == Some(Scalar::U8));
        let has_colors = files.iter().all(|f| f.color_type().is_some());
        let full_color = has_colors.then_some(if bytes { 255.0 } else { 1.0 });
        let reach = Reach { files, frame, bounds, full_color };
        let edges_m: Vec<_> = reach.files.iter().map(|file| reach.sampled_edge_m(file)).collect();
        reach.check_precision(&edges_m)?;
        let warnings = reach.warnings(input, &edges_m);
        Ok((reach, warnings))
    }

    /// Whether the files are point clouds, which have vertices and no triangles.
    pub fn is_cloud(&self) -> bool {
        self.triangles() == 0
    }

    /// From input to local to map.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The files, in the order given.
    pub fn files(&self) -> &[SurveyFile] {
        &self.files
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

    /// Mean edge of a sample of a file's triangles, metres, edges of no length left out; `None` if all are.
    fn sampled_edge_m(&self, file: &SurveyFile) -> Option<f64> {
        let (mut sum, mut edges) = (0.0, 0u32);
        for place in 0..SAMPLED_PLACES {
            let part = |i: u64| (u128::from(i) * u128::from(file.triangles()) / u128::from(SAMPLED_PLACES)) as u64;
            let triangles = part(place)..part(place + 1).min(part(place) + SAMPLED_TRIANGLES);
            for triangle in triangles {
                let [a, b, c] = self.triangle(file.first_triangle + triangle).map(|v| self.position(v));
                for length in [a.distance(b), b.distance(c), c.distance(a)] {
                    if length > 0.0 {
                        sum += length;
                        edges += 1;
                    }
                }
            }
            // Corners may lie anywhere in the file, and every page that is touched brings its neighbours.
            file.mesh.release_if_large();
        }
        file.mesh.release();
        (edges > 0).then(|| sum / f64::from(edges))
    }

    fn check_precision(&self, edges_m: &[Option<f64>]) -> Result<(), OpenError> {
        for (file, &edge_m) in self.files.iter().zip(edges_m) {
            let step = coarsest_step(file.axis_types(), file.input_bounds());
            if let (Some((step, largest)), Some(edge_m)) = (step, edge_m) {
                let step_m = step * self.frame.metres_per_input_unit;
                if step_m > COARSEST_STEP_IN_EDGES * edge_m {
                    let path = file.path.display().to_string();
                    return Err(OpenError::FloatStep { path, largest, step_m, edge_m });
                }
            }
        }
        Ok(())
    }

    fn warnings(&self, input: &InputSettings, edges_m: &[Option<f64>]) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let name = |file: &SurveyFile| file.path.display().to_string();
        if let [first, _, ..] = self.files.as_slice() {
            warnings.push(Warning::SeparateFiles { path: name(first), files: self.files.len() });
        }
        if let (Some(first), Some(&Some(mean_edge_m))) = (self.files.first(), edges_m.first())
            && input.unit == Unit::Auto
        {
            let extent_m = self.plan_extent_m();
            if LIKE_MILLIMETRES_M.iter().any(|&(edge, extent)| mean_edge_m >= edge && extent_m > extent) {
                warnings.push(Warning::LooksLikeMillimetres { path: name(first), mean_edge_m, extent_m });
            }
        }
        for file in &self.files {
            let bytes = file.mesh.trailing_bytes;
            if bytes > TOLERATED_TRAILING_BYTES {
                warnings.push(Warning::TrailingBytes { path: name(file), bytes });
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

fn check_same_kind(files: &[SurveyFile]) -> Result<(), OpenError> {
    let find = |cloud: bool| files.iter().find(|f| (f.triangles() == 0) == cloud);
    match (find(false), find(true)) {
        (Some(mesh), Some(cloud)) => {
            let name = |file: &SurveyFile| file.path.display().to_string();
            Err(OpenError::MeshAndCloud { mesh: name(mesh), cloud: name(cloud) })
        }
        _ => Ok(()),
    }
}

fn joint_bounds(files: &[SurveyFile]) -> ([f64; 3], [f64; 3]) {
    files.iter().map(SurveyFile::input_bounds).fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |a, b| {
        (std::array::from_fn(|i| a.0[i].min(b.0[i])), std::array::from_fn(|i| a.1[i].max(b.1[i])))
    })
}

fn make_frame(input: &InputSettings, reference: Option<GeoReference>, bounds: &([f64; 3], [f64; 3])) -> Frame {
    let metres_per_map_unit = reference.as_ref().map_or(1.0, |r| r.metres_per_unit);
    let metres_per_input_unit = match input.unit {
        Unit::Auto => metres_per_map_unit,
        Unit::M => 1.0,
        Unit::Mm => 1e-3,
        Unit::Ft => 0.3048,
    };
    Frame {
        origin_input: bounds.0.map(f64::floor),
        metres_per_input_unit,
        offset_map: input.offset,
        metres_per_map_unit,
        crs: reference.map(|r| r.crs),
    }
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
