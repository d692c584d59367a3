//! The layers of the GeoPackage: which features, fields and shapes each one has.

use super::columns::{COLUMNS, Kind, Row, Value};
use super::{Results, wkb};
use crate::geometry::PlanBox;
use crate::open::Frame;
use crate::settings::{Settings, WorkSettings};
use gdal::vector::OGRwkbGeometryType;
use std::borrow::Cow;

/// One feature.
pub(crate) struct Feature {
    /// Primary key; none for the next free one.
    pub(crate) fid: Option<u64>,
    /// One value per field.
    pub(crate) values: Vec<Value>,
    /// Shape; none for a feature without one.
    pub(crate) wkb: Option<Vec<u8>>,
}

/// One layer.
pub(crate) struct Layer<'a> {
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
    pub(crate) geometry: OGRwkbGeometryType::Type,
    pub(crate) fields: Vec<(&'static str, Kind)>,
    pub(crate) features: Box<dyn Iterator<Item = Feature> + 'a>,
}

/// All layers, in the order in which they are written.
pub(crate) fn all<'a>(results: &'a Results<'a>) -> Vec<Layer<'a>> {
    vec![grains(results), grain_centres(results), oversize(results), tiles(results), survey(results), styles()]
}

fn grain_values(row: &Row) -> Vec<Value> {
    COLUMNS.iter().map(|c| (c.value)(row)).collect()
}

fn grains<'a>(results: &'a Results<'a>) -> Layer<'a> {
    Layer {
        name: "grains",
        description: "outline in plan and attributes of every grain",
        geometry: OGRwkbGeometryType::wkbMultiPolygon,
        fields: COLUMNS.iter().map(|c| (c.name, c.kind)).collect(),
        features: Box::new(results.catalogue.grains.iter().map(|numbered| Feature {
            fid: Some(numbered.grain_id),
            values: grain_values(&Row::new(numbered, results.frame, results.settings)),
            wkb: wkb::multi_polygon(results.frame, &numbered.grain.outline),
        })),
    }
}

fn grain_centres<'a>(results: &'a Results<'a>) -> Layer<'a> {
    Layer {
        name: "grain_centres",
        description: "centroid of the visible surface and attributes of every grain",
        geometry: OGRwkbGeometryType::wkbPoint25D,
        fields: COLUMNS.iter().map(|c| (c.name, c.kind)).collect(),
        features: Box::new(results.catalogue.grains.iter().map(|numbered| Feature {
            fid: Some(numbered.grain_id),
            values: grain_values(&Row::new(numbered, results.frame, results.settings)),
            wkb: Some(wkb::point_z(results.frame.position(numbered.grain.centroid))),
        })),
    }
}

fn oversize<'a>(results: &'a Results<'a>) -> Layer<'a> {
    Layer {
        name: "oversize",
        description: "bounding boxes of convex bodies wider than segment.max_grain_m, which are no grains",
        geometry: OGRwkbGeometryType::wkbPolygon,
        fields: vec![
            ("anchor", Kind::Integer),
            ("triangles", Kind::Integer),
            ("surface_area_m2", Kind::Real),
            ("width_m", Kind::Real),
        ],
        features: Box::new(results.catalogue.oversize.iter().map(|body| Feature {
            fid: None,
            values: vec![
                whole(body.anchor),
                whole(body.triangles),
                Value::real(body.surface_area_m2),
                Value::real(body.bounds.width_m()),
            ],
            wkb: wkb::rectangle(results.frame, &body.bounds),
        })),
    }
}

fn tiles<'a>(results: &'a Results<'a>) -> Layer<'a> {
    let survey = survey_box(results);
    Layer {
        name: "tiles",
        description: "cores of the tiles, cut to the survey's box, and how each was worked",
        geometry: OGRwkbGeometryType::wkbPolygon,
        fields: vec![
            ("tile", Kind::Integer),
            ("core_triangles", Kind::Integer),
            ("segmented_triangles", Kind::Integer),
            ("attempts", Kind::Integer),
            ("grains", Kind::Integer),
        ],
        features: Box::new(results.tiles.iter().map(move |tile| Feature {
            fid: None,
            values: vec![
                whole(tile.tile),
                whole(tile.core_triangles),
                whole(tile.segmented_triangles),
                Value::Integer(i64::from(tile.attempts)),
                whole(tile.grains),
            ],
            wkb: wkb::rectangle(results.frame, &cut(&tile.core, &survey)),
        })),
    }
}

fn survey<'a>(results: &'a Results<'a>) -> Layer<'a> {
    Layer {
        name: "survey",
        description: "box of the survey, with counts, settings and the program's version",
        geometry: OGRwkbGeometryType::wkbPolygon,
        fields: vec![
            ("program", Kind::Text),
            ("version", Kind::Text),
            ("grains", Kind::Integer),
            ("oversize_bodies", Kind::Integer),
            ("triangles", Kind::Integer),
            ("vertices", Kind::Integer),
            ("surface_area_m2", Kind::Real),
            ("mean_edge_m", Kind::Real),
            ("smallest_grain_area_m2", Kind::Real),
            ("metres_per_map_unit", Kind::Real),
            ("offset_east", Kind::Real),
            ("offset_north", Kind::Real),
            ("offset_up", Kind::Real),
            ("settings_json", Kind::Text),
        ],
        features: Box::new(std::iter::once_with(|| survey_feature(results))),
    }
}

fn survey_feature(results: &Results) -> Feature {
    let (frame, scale): (&Frame, _) = (results.frame, results.scale);
    // How the work was cut changes no result, so it has no place in what must not depend on it.
    let settings = Settings { work: WorkSettings::default(), ..results.settings.clone() };
    let settings = serde_json::to_string(&settings).unwrap_or_default();
    let offset = frame.offset_map.map(Value::Position);
    let mut values = vec![
        Value::Text(Cow::Borrowed(env!("CARGO_PKG_NAME"))),
        Value::Text(Cow::Borrowed(env!("CARGO_PKG_VERSION"))),
        whole(results.catalogue.grains.len() as u64),
        whole(results.catalogue.oversize.len() as u64),
        whole(scale.triangles),
        whole(scale.vertices),
        Value::real(scale.surface_area_m2),
        Value::real(scale.mean_edge_m),
        Value::real(results.smallest_grain_area_m2),
        Value::real(frame.metres_per_map_unit),
    ];
    values.extend(offset);
    values.push(Value::Text(Cow::Owned(settings)));
    Feature { fid: None, values, wkb: wkb::rectangle(frame, &survey_box(results)) }
}

/// The table in which QGIS looks for the style of a layer.
fn styles<'a>() -> Layer<'a> {
    let text = |t: &'static str| Value::Text(Cow::Borrowed(t));
    let style = move |name, qml, default, description| {
        let values = vec![
            text(""),
            text(""),
            text("grains"),
            text("geom"),
            text(name),
            text(qml),
            text(""),
            Value::Boolean(default),
            text(description),
            text(env!("CARGO_PKG_NAME")),
            text(""),
        ];
        Feature { fid: None, values, wkb: None }
    };
    let all = [
        style("b axis", include_str!("grains.qml"), true, "grains by b axis in Wentworth classes"),
        style("confidence", include_str!("confidence.qml"), false, "grains by how sure their segmentation is"),
    ];
    Layer {
        name: "layer_styles",
        description: "QGIS styles",
        geometry: OGRwkbGeometryType::wkbNone,
        fields: vec![
            ("f_table_catalog", Kind::Text),
            ("f_table_schema", Kind::Text),
            ("f_table_name", Kind::Text),
            ("f_geometry_column", Kind::Text),
            ("styleName", Kind::Text),
            ("styleQML", Kind::Text),
            ("styleSLD", Kind::Text),
            ("useAsDefault", Kind::Boolean),
            ("description", Kind::Text),
            ("owner", Kind::Text),
            ("ui", Kind::Text),
        ],
        features: Box::new(all.into_iter()),
    }
}

fn whole(value: u64) -> Value {
    i64::try_from(value).map_or(Value::Null, Value::Integer)
}

fn survey_box(results: &Results) -> PlanBox {
    let (min, max) = (results.scale.min, results.scale.max);
    PlanBox { min: [min.x, min.y], max: [max.x, max.y] }
}

fn cut(core: &PlanBox, survey: &PlanBox) -> PlanBox {
    PlanBox {
        min: std::array::from_fn(|i| core.min[i].clamp(survey.min[i], survey.max[i].max(survey.min[i]))),
        max: std::array::from_fn(|i| core.max[i].clamp(survey.min[i], survey.max[i].max(survey.min[i]))),
    }
}
