//! What the files of a survey must agree on.

use super::error::OpenError;
use super::georeference::{CrsCandidate, CrsSource, Georeference};
use super::las_crs::CloudCrs;
use super::survey_file::SurveyFile;

/// The systems that headers state.
pub(super) fn stated_systems(files: &[SurveyFile]) -> Vec<CrsCandidate> {
    let of_file = |file: &SurveyFile| match &file.mesh.las.as_ref()?.crs {
        CloudCrs::Stated { definition, .. } => {
            Some(CrsCandidate { source: CrsSource::Header(file.path.clone()), text: definition.clone() })
        }
        CloudCrs::Unstated | CloudCrs::Unusable { .. } => None,
    };
    files.iter().filter_map(of_file).collect()
}

/// Heights in another unit than the plan would stretch every grain.
pub(super) fn check_heights(files: &[SurveyFile], georeference: &Georeference) -> Result<(), OpenError> {
    // Who names another system knows better than the header.
    if !georeference.crs_is_of_header {
        return Ok(());
    }
    let plan_m = georeference.metres_per_map_unit;
    for file in files {
        if let Some(CloudCrs::Stated { definition, height_unit_m: Some(height_m) }) =
            file.mesh.las.as_ref().map(|las| &las.crs)
            && (height_m / plan_m - 1.0).abs() > 1e-9
        {
            let origin =
                format!("{} (header of {})", definition.chars().take(60).collect::<String>(), file.path.display());
            let name = georeference.crs.clone().unwrap_or_default();
            return Err(OpenError::CrsUnits { origin, name, plan_m, height_m: *height_m });
        }
    }
    Ok(())
}

/// Meshes and clouds are not one surface.
pub(super) fn check_same_kind(files: &[SurveyFile]) -> Result<(), OpenError> {
    let find = |cloud: bool| files.iter().find(|f| (f.triangles() == 0) == cloud);
    match (find(false), find(true)) {
        (Some(mesh), Some(cloud)) => {
            let name = |file: &SurveyFile| file.path.display().to_string();
            Err(OpenError::MeshAndCloud { mesh: name(mesh), cloud: name(cloud) })
        }
        _ => Ok(()),
    }
}
