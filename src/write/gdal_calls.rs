//! Three calls of GDAL that the `gdal` crate lacks, each behind a safe function.
#![allow(unsafe_code)]

use gdal::errors::{GdalError, Result};
use gdal::raster::RasterBand;
use gdal::vector::{Feature, LayerAccess, OGRFieldType};
use std::ffi::{CString, c_longlong};

/// Sets the unit of a band's values.
pub(crate) fn set_unit(band: &mut RasterBand, unit: &str) -> Result<()> {
    let unit = CString::new(unit)?;
    // SAFETY: the band's handle is valid while `band` is borrowed, and GDAL copies the text.
    let code = unsafe { gdal_sys::GDALSetRasterUnitType(band.c_rasterband(), unit.as_ptr()) };
    if code == gdal_sys::CPLErr::CE_None {
        Ok(())
    } else {
        Err(GdalError::CplError { class: code, number: 0, msg: "GDALSetRasterUnitType".into() })
    }
}

/// Sets the primary key of a feature that is not yet in a layer.
pub(crate) fn set_fid(feature: &mut Feature, fid: i64) -> Result<()> {
    // SAFETY: the feature's handle is valid while `feature` is borrowed.
    ogr("OGR_F_SetFID", unsafe { gdal_sys::OGR_F_SetFID(feature.c_feature(), fid as c_longlong) })
}

/// Adds a field of truth values to a layer: an integer field with the subtype boolean.
pub(crate) fn create_boolean_field(layer: &impl LayerAccess, name: &str) -> Result<()> {
    let name = CString::new(name)?;
    // SAFETY: the definition is made, given a subtype, copied by the layer and destroyed here, by nobody
    // else; it is checked before its first use. The layer's handle is valid while `layer` is borrowed.
    let code = unsafe {
        let field = gdal_sys::OGR_Fld_Create(name.as_ptr(), OGRFieldType::OFTInteger);
        if field.is_null() {
            return Err(GdalError::NullPointer { method_name: "OGR_Fld_Create", msg: String::new() });
        }
        gdal_sys::OGR_Fld_SetSubType(field, gdal_sys::OGRFieldSubType::OFSTBoolean);
        let code = gdal_sys::OGR_L_CreateField(layer.c_layer(), field, 1);
        gdal_sys::OGR_Fld_Destroy(field);
        code
    };
    ogr("OGR_L_CreateField", code)
}

fn ogr(method_name: &'static str, err: gdal_sys::OGRErr::Type) -> Result<()> {
    if err == gdal_sys::OGRErr::OGRERR_NONE { Ok(()) } else { Err(GdalError::OgrError { err, method_name }) }
}
