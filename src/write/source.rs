//! A survey as the labelled mesh reads it again: file by file, record by record.

use super::MeshSource;
use crate::open::{DrapedCloud, Reach, SKIPPED, ScalarProperty, Surface, SurveyFile};

/// A survey with the vertex properties that all of its files have, with the same type, in the order of
/// the first file.
pub struct WholeMesh<'a> {
    reach: &'a Reach,
    /// The surface that a cloud got.
    cloud: Option<&'a DrapedCloud<'a>>,
    properties: Vec<&'a ScalarProperty>,
    /// For each file, where each of the properties lies in a record: offset and bytes.
    places: Vec<Vec<(usize, usize)>>,
}

impl<'a> WholeMesh<'a> {
    /// A survey ready to be read again: of clouds, with the surface that they got.
    pub fn new(reach: &'a Reach, cloud: Option<&'a DrapedCloud<'a>>) -> WholeMesh<'a> {
        let find = |file: &'a SurveyFile, wanted: &ScalarProperty| {
            file.vertex_properties().iter().find(|p| p.name == wanted.name && p.scalar == wanted.scalar)
        };
        let properties: Vec<&ScalarProperty> = reach.files().first().map_or(Vec::new(), |first| {
            let everywhere =
                |p: &&ScalarProperty| p.name != SKIPPED && reach.files().iter().all(|f| find(f, p).is_some());
            first.vertex_properties().iter().filter(everywhere).collect()
        });
        let place = |p: &ScalarProperty| (p.offset, p.scalar.size());
        let places = reach
            .files()
            .iter()
            .map(|file| properties.iter().filter_map(|p| find(file, p).map(place)).collect())
            .collect();
        WholeMesh { reach, cloud, properties, places }
    }

    /// The file that holds an element, by the first number of each file.
    fn file_with(&self, number: u64, first: impl Fn(&SurveyFile) -> u64) -> usize {
        self.reach.files().partition_point(|f| first(f) <= number) - 1
    }
}

impl MeshSource for WholeMesh<'_> {
    fn vertices(&self) -> u64 {
        self.reach.vertices()
    }
    fn faces(&self) -> u64 {
        self.cloud.map_or_else(|| self.reach.faces(), |cloud| cloud.triangles())
    }
    fn vertex_properties(&self) -> Vec<(String, &'static str)> {
        self.properties.iter().map(|p| (p.name.clone(), p.scalar.ply_name())).collect()
    }
    fn vertex_record(&self, vertex: u64, out: &mut Vec<u8>) {
        let i = self.file_with(vertex, SurveyFile::first_vertex);
        let file = &self.reach.files()[i];
        let record = file.vertex_record(vertex - file.first_vertex());
        for &(offset, bytes) in &self.places[i] {
            out.extend_from_slice(&record[offset..offset + bytes]);
        }
    }
    fn face_corners(&self, face: u64, out: &mut Vec<u64>) {
        if let Some(cloud) = self.cloud {
            out.extend(cloud.triangle(face));
            return;
        }
        let file = &self.reach.files()[self.file_with(face, SurveyFile::first_face)];
        out.extend(file.face_corners(face - file.first_face()).map(|v| v + file.first_vertex()));
    }
    fn face_of(&self, triangle: u64) -> u64 {
        if self.cloud.is_some() { triangle } else { self.reach.face_of(triangle) }
    }
    fn triangles(&self) -> u64 {
        self.cloud.map_or_else(|| self.reach.triangles(), |cloud| cloud.triangles())
    }
}
