//! `grains.gpkg`: a GeoPackage with the grains, their centres, what was too wide, the tiles and the survey.

use super::columns::{Kind, Value};
use super::gdal_calls::{create_boolean_field, set_fid};
use super::gdal_options::GdalOptions;
use super::gdal_watch::Watch;
use super::layers::{self, Feature, Layer};
use super::{Results, WriteError, atomic::Pending};
use crate::open::Frame;
use gdal::errors::Result as GdalResult;
use gdal::spatial_ref::{AxisMappingStrategy, SpatialRef};
use gdal::vector::{FieldDefn, Geometry, LayerAccess, LayerOptions, OGRFieldType, OGRwkbGeometryType};
use gdal::{Dataset, DatasetOptions, DriverManager, GdalOpenFlags};

const OPTIONS: &[(&str, &str)] =
    &[GdalOptions::FIXED_DATE, GdalOptions::NO_VALIDATION, GdalOptions::JOURNAL_IN_MEMORY, GdalOptions::FLUSHED_LATER];

/// How many rows a layer must have.
struct Expected {
    layer: &'static str,
    features: u64,
    /// Rows of its spatial index; none for a table without geometry.
    shapes: Option<u64>,
}

/// The map's system with the east axis first, whatever its authority says; none without a CRS.
pub(crate) fn spatial_ref(frame: &Frame) -> GdalResult<Option<SpatialRef>> {
    let Some(crs) = &frame.crs else { return Ok(None) };
    let mut srs = SpatialRef::from_wkt(&crs.wkt)?;
    srs.set_axis_mapping_strategy(AxisMappingStrategy::TraditionalGisOrder);
    Ok(Some(srs))
}

/// The map's system, or without one a plane with the map's unit: a GeoPackage layer without any system is
/// taken for degrees by its readers.
fn system_of_layers(frame: &Frame) -> GdalResult<SpatialRef> {
    if let Some(srs) = spatial_ref(frame)? {
        return Ok(srs);
    }
    let metres = frame.metres_per_map_unit;
    let unit = if metres == 1.0 { "metre" } else { "map unit" };
    SpatialRef::from_wkt(&format!(
        "LOCAL_CS[\"Undefined Cartesian SRS\",UNIT[\"{unit}\",{metres}],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]"
    ))
}

/// Writes the file, with its spatial indices, in one transaction, and reads it back.
pub(crate) fn write(file: &Pending, results: &Results) -> Result<(), WriteError> {
    let watch = Watch::new(&file.target);
    let step = |text: &'static str| move || text.to_owned();
    let _options = watch.step(step("setting up GDAL"), GdalOptions::set(OPTIONS))?;
    let srs = watch.step(step("reading the coordinate reference system"), system_of_layers(results.frame))?;
    let created = DriverManager::get_driver_by_name("GPKG").and_then(|d| d.create_vector_only(&file.partial));
    let mut dataset = watch.step(step("creating the GeoPackage"), created)?;
    let mut expected = Vec::new();
    {
        let mut transaction = watch.step(step("starting the transaction"), dataset.start_transaction())?;
        for layer in layers::all(results) {
            expected.push(write_layer(&watch, &mut transaction, &srs, layer)?);
        }
        for layer in expected.iter().filter(|l| l.shapes.is_some()) {
            let name = layer.layer;
            let made = numbers(&transaction, &[format!("CreateSpatialIndex('{name}', 'geom')")]);
            let made = watch.step(|| format!("building the spatial index of layer {name}"), made)?;
            if made != [Some(1)] {
                let (path, what) = (file.target.clone(), "spatial indices");
                return Err(WriteError::IncompleteLayer { path, layer: name.into(), what, expected: 1, found: 0 });
            }
        }
        watch.step(step("committing the layers"), transaction.commit())?;
    }
    watch.step(step("closing the GeoPackage"), dataset.close())?;
    verify(file, &watch, &expected)
}

fn write_layer(
    watch: &Watch,
    dataset: &mut Dataset,
    srs: &SpatialRef,
    layer: Layer<'_>,
) -> Result<Expected, WriteError> {
    let description = format!("DESCRIPTION={}", layer.description);
    let options = ["SPATIAL_INDEX=NO", "GEOMETRY_NAME=geom", "FID=fid", &description];
    let spatial = layer.geometry != OGRwkbGeometryType::wkbNone;
    let created = dataset.create_layer(LayerOptions {
        name: layer.name,
        srs: Some(srs).filter(|_| spatial),
        ty: layer.geometry,
        options: Some(&options),
    });
    let out = watch.step(|| format!("creating layer {}", layer.name), created)?;
    for (name, kind) in &layer.fields {
        let made = match kind {
            Kind::Boolean => create_boolean_field(&out, name),
            Kind::Integer => FieldDefn::new(name, OGRFieldType::OFTInteger64).and_then(|f| f.add_to_layer(&out)),
            Kind::Real => FieldDefn::new(name, OGRFieldType::OFTReal).and_then(|f| f.add_to_layer(&out)),
            Kind::Text => FieldDefn::new(name, OGRFieldType::OFTString).and_then(|f| f.add_to_layer(&out)),
        };
        watch.step(|| format!("creating field {name} of layer {}", layer.name), made)?;
    }
    let (mut features, mut shapes) = (0, 0);
    for feature in layer.features {
        features += 1;
        shapes += u64::from(feature.wkb.is_some());
        let added = add_feature(&out, &feature);
        watch.step(|| format!("writing feature {features} of layer {}", layer.name), added)?;
    }
    Ok(Expected { layer: layer.name, features, shapes: spatial.then_some(shapes) })
}

fn add_feature(layer: &gdal::vector::Layer, feature: &Feature) -> GdalResult<()> {
    let mut out = gdal::vector::Feature::new(layer.defn())?;
    if let Some(fid) = feature.fid {
        set_fid(&mut out, i64::try_from(fid)?)?;
    }
    for (index, value) in feature.values.iter().enumerate() {
        match value {
            Value::Null => out.set_field_null(index)?,
            Value::Integer(i) => out.set_field_integer64(index, *i)?,
            Value::Real(r) | Value::Position(r) => out.set_field_double(index, *r)?,
            Value::Text(t) => out.set_field_string(index, t)?,
            Value::Boolean(b) => out.set_field_integer(index, i32::from(*b))?,
        }
    }
    if let Some(wkb) = &feature.wkb {
        out.set_geometry(Geometry::from_wkb(wkb)?)?;
    }
    out.create(layer)
}

/// The values of some expressions, asked for at once since GDAL makes a layer of every query; none for NULL.
fn numbers(dataset: &Dataset, expressions: &[String]) -> GdalResult<Vec<Option<i64>>> {
    let query = format!("SELECT {}", expressions.join(", "));
    let mut rows = dataset.execute_sql(query, None, gdal::vector::sql::Dialect::DEFAULT)?;
    let row = rows.as_mut().and_then(|rows| rows.features().next());
    (0..expressions.len()).map(|i| row.as_ref().map_or(Ok(None), |row| row.field_as_integer64(i))).collect()
}

/// A table and how many rows it must have.
struct Count {
    layer: &'static str,
    what: &'static str,
    table: String,
    expected: u64,
}

fn counts(expected: &[Expected]) -> Vec<Count> {
    let of_layer = |&Expected { layer, features, shapes }: &Expected| {
        let all = Count { layer, what: "features", table: layer.into(), expected: features };
        let index = |shapes| {
            let (what, table) = ("rows of the spatial index", format!("rtree_{layer}_geom"));
            Count { layer, what, table, expected: shapes }
        };
        [Some(all), shapes.map(index)].into_iter().flatten()
    };
    expected.iter().flat_map(of_layer).collect()
}

/// Opens the closed file again: before GDAL 3.7 a full disk can go unreported when a file is closed.
fn verify(file: &Pending, watch: &Watch, expected: &[Expected]) -> Result<(), WriteError> {
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        allowed_drivers: Some(&["GPKG"]),
        ..Default::default()
    };
    let opened = Dataset::open_ex(&file.partial, options);
    let dataset = watch.step(|| "opening the finished GeoPackage".into(), opened)?;
    let counts = counts(expected);
    let queries: Vec<String> =
        counts.iter().map(|count| format!("(SELECT COUNT(*) FROM \"{}\")", count.table)).collect();
    // One query: GDAL makes a layer of every result.
    let found = watch.step(|| "counting what the layers hold".into(), numbers(&dataset, &queries))?;
    for (Count { layer, what, expected, .. }, found) in counts.into_iter().zip(found) {
        let found = found.and_then(|n| u64::try_from(n).ok()).unwrap_or(0);
        if found != expected {
            let (path, layer) = (file.target.clone(), layer.to_owned());
            return Err(WriteError::IncompleteLayer { path, layer, what, expected, found });
        }
    }
    watch.step(|| "closing the finished GeoPackage".into(), dataset.close())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_that_lost_features_or_its_index_is_named() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let file =
            Pending { partial: folder.path().join("grains.gpkg.partial"), target: folder.path().join("grains.gpkg") };
        let watch = Watch::new(&file.target);
        let driver = DriverManager::get_driver_by_name("GPKG").expect("driver");
        let mut dataset = driver.create_vector_only(&file.partial).expect("GeoPackage");
        let options = ["SPATIAL_INDEX=NO"];
        let layer = LayerOptions { name: "grains", options: Some(&options), ..Default::default() };
        dataset.create_layer(layer).map(|_| ()).expect("layer");
        dataset.close().expect("closed");
        let expected = |features, shapes| [Expected { layer: "grains", features, shapes }];
        let lost = verify(&file, &watch, &expected(3, None)).expect_err("three features are missing");
        assert!(lost.to_string().contains("layer grains holds 0 features, but 3 were written"), "{lost}");
        let bare = verify(&file, &watch, &expected(0, Some(0))).expect_err("there is no index");
        assert!(bare.to_string().contains("rtree_grains_geom"), "{bare}");
        verify(&file, &watch, &expected(0, None)).expect("nothing was to be written");
    }
}
