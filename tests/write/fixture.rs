//! A small survey with known grains.

use glam::DVec3;
use gravelometer::geometry::PlanBox;
use gravelometer::index::Scale;
use gravelometer::measure::{Completed, Grain, Polygon};
use gravelometer::open::{Crs, Frame};
use gravelometer::settings::Settings;
use gravelometer::stitch::{Catalogue, NumberedGrain, Oversize, TileReport};
use gravelometer::write::{MeshSource, Results};

/// Steps of the outline grid in a metre.
pub(crate) const STEPS: f64 = 1_048_576.0;

pub(crate) struct Survey {
    pub(crate) frame: Frame,
    pub(crate) settings: Settings,
    pub(crate) scale: Scale,
    pub(crate) surveyed: Vec<PlanBox>,
    pub(crate) catalogue: Catalogue,
    pub(crate) tiles: Vec<TileReport>,
    pub(crate) facts: serde_json::Value,
}

impl Survey {
    pub(crate) fn results<'a>(&'a self, mesh: Option<&'a dyn MeshSource>) -> Results<'a> {
        Results {
            frame: &self.frame,
            settings: &self.settings,
            scale: &self.scale,
            surveyed: &self.surveyed,
            catalogue: &self.catalogue,
            tiles: &self.tiles,
            smallest_grain_area_m2: 1e-4,
            facts: &self.facts,
            costs: &|| serde_json::json!({ "stages": [] }),
            mesh,
            cloud: None,
        }
    }
}

pub(crate) fn new_zealand() -> Frame {
    let srs = gdal::spatial_ref::SpatialRef::from_epsg(2193).expect("PROJ database");
    Frame {
        offset_map: [1_480_000.0, 5_250_000.0, 700.0],
        crs: Some(Crs {
            wkt: srs.to_wkt().expect("WKT"),
            name: srs.name().expect("name"),
            authority: Some("EPSG:2193".into()),
        }),
        ..Frame::metres()
    }
}

/// `n` grains on a lattice of 0.1 m, in a box of 2 m by 1 m.
pub(crate) fn survey(n: usize, frame: Frame) -> Survey {
    let grains =
        (0..n).map(|i| NumberedGrain { grain_id: i as u64 + 1, segment_color: (i % 4) as u32, grain: grain(i) });
    let bounds = PlanBox { min: [1.5, 0.5], max: [1.75, 0.75] };
    let oversize = Oversize { anchor: 7, triangles: 12, surface_area_m2: 0.07, bounds };
    let tile = |tile: u64, west: f64, east: f64| TileReport {
        tile,
        core: PlanBox { min: [west, f64::NEG_INFINITY], max: [east, f64::INFINITY] },
        core_triangles: 100,
        segmented_triangles: 130,
        attempts: 1,
        grains: n as u64 / 2,
    };
    Survey {
        frame,
        settings: Settings::default(),
        scale: Scale {
            vertices: 1000,
            triangles: 2000,
            min: DVec3::ZERO,
            max: DVec3::new(2.0, 1.0, 0.3),
            surface_area_m2: 2.5,
            mean_triangle_area_m2: 0.00125,
            mean_edge_m: 0.05,
            spacing_m: 0.02,
            zero_area_triangles: 0,
        },
        surveyed: vec![PlanBox { min: [0.0, 0.0], max: [2.0, 1.0] }],
        catalogue: Catalogue { grains: grains.collect(), oversize: if n > 0 { vec![oversize] } else { Vec::new() } },
        tiles: vec![tile(0, f64::NEG_INFINITY, 1.0), tile(1, 1.0, f64::INFINITY)],
        facts: serde_json::json!({"inputs": ["reach.ply"], "refused": []}),
    }
}

fn grain(i: usize) -> Grain {
    let (x, y) = (0.05 + 0.1 * (i % 19) as f64, 0.05 + 0.1 * (i / 19) as f64);
    let b = 0.02 + 0.000_4 * (i % 50) as f64 + 1e-12 / 3.0;
    let turn = (i as f64 * 0.37).sin() * 0.4;
    let rotation = glam::DMat3::from_rotation_z(turn) * glam::DMat3::from_rotation_y(turn * 0.5);
    Grain {
        anchor: 10 * i as u64,
        triangles: 60 + 10 * i as u64,
        vertices: 40 + 5 * i as u64,
        centroid: DVec3::new(x, y, 0.01 * i as f64 / 7.0),
        top_z: 0.1,
        axes_m: [b * 1.05 * (1.0 + (i % 5) as f64 * 0.2), b, b * (0.95 - (i % 7) as f64 * 0.1)],
        directions: [rotation.x_axis, rotation.y_axis, rotation.z_axis],
        ellipsoid_axes_m: (!i.is_multiple_of(3)).then_some([b * 1.5, b, b * 0.7]),
        completed: (!i.is_multiple_of(5)).then_some(Completed {
            axes_m: [b * 1.4, b, b * 0.65],
            c_error_m: b * 0.1,
            seen_share: 0.01 * (i % 100) as f64,
            c_from_prior: i.is_multiple_of(2),
        }),
        surface_area_m2: b * b * 2.0,
        hull_area_m2: b * b * 4.5,
        hull_volume_m3: b * b * b * 0.6,
        footprint_area_m2: 0.02 * 0.02,
        color_mean: (i % 4 != 1).then_some([0.1, 0.25, 1.0 / 3.0]),
        color_std: (i % 4 != 1).then_some([0.01, 0.02, 0.03]),
        touches_edge: i.is_multiple_of(6),
        evidence: None,
        outline: outline(i, x, y),
        triangle_ids: vec![2 * i as u64, 2 * i as u64 + 1],
    }
}

/// A square, a square with a hole, a star, or two separate squares.
fn outline(i: usize, x: f64, y: f64) -> Vec<Polygon> {
    let ring = |points: &[(f64, f64)]| -> Vec<[i64; 2]> {
        points.iter().map(|&(dx, dy)| [((x + dx) * STEPS).round() as i64, ((y + dy) * STEPS).round() as i64]).collect()
    };
    let square = |cx: f64, h: f64| ring(&[(cx - h, -h), (cx + h, -h), (cx + h, h), (cx - h, h)]);
    match i % 4 {
        0 => vec![vec![square(0.0, 0.03)]],
        1 => vec![vec![square(0.0, 0.03), ring(&[(-0.01, -0.01), (-0.01, 0.01), (0.01, 0.01), (0.01, -0.01)])]],
        2 => {
            let star: Vec<(f64, f64)> = (0..10)
                .map(|k| {
                    let (r, a) = (if k % 2 == 0 { 0.035 } else { 0.015 }, f64::from(k) * std::f64::consts::PI / 5.0);
                    (r * a.cos(), r * a.sin())
                })
                .collect();
            vec![vec![ring(&star)]]
        }
        _ => vec![vec![square(-0.02, 0.01)], vec![square(0.02, 0.01)]],
    }
}

/// A strip of quads and triangles: face 0 is a quad (two triangles), all others are triangles.
pub(crate) struct Strip {
    pub(crate) faces: Vec<Vec<u64>>,
    pub(crate) vertices: u64,
}

impl MeshSource for Strip {
    fn vertices(&self) -> u64 {
        self.vertices
    }
    fn faces(&self) -> u64 {
        self.faces.len() as u64
    }
    fn vertex_properties(&self) -> Vec<(String, &'static str)> {
        vec![("x".into(), "double"), ("y".into(), "float"), ("red".into(), "uchar")]
    }
    fn vertex_record(&self, v: u64, out: &mut Vec<u8>) {
        out.extend((v as f64 * 0.5).to_le_bytes());
        out.extend((v as f32 * 0.25).to_le_bytes());
        out.push(v as u8);
    }
    fn face_corners(&self, f: u64, out: &mut Vec<u64>) {
        out.extend(&self.faces[f as usize]);
    }
    fn face_of(&self, triangle: u64) -> u64 {
        let mut left = triangle;
        for (face, corners) in self.faces.iter().enumerate() {
            let triangles = corners.len() as u64 - 2;
            if left < triangles {
                return face as u64;
            }
            left -= triangles;
        }
        self.faces()
    }
    fn triangles(&self) -> u64 {
        self.faces.iter().map(|f| f.len() as u64 - 2).sum()
    }
}
