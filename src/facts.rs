//! What belongs into `run.json` beside settings and costs.

use crate::index::{Index, Scale};
use crate::open::Reach;
use crate::pipeline::LostJob;
use crate::segment::smallest_grain_area_m2;
use crate::settings::{SegmentSettings, Settings};
use crate::stitch::Catalogue;
use crate::tile::Plan;
use crate::triangulate::DrapeFigures;
use std::path::Path;

/// More triangles than this part of all have no corner in common with another: the faces are not joined.
const LOOSE_SHARE: f64 = 0.9;
/// More grains than this part of all lie at an edge of the surface.
const EDGE_SHARE: f64 = 0.9;

/// What is odd about a result without being wrong, each with what to do.
/// `left_out` grains had too little confidence; `of_cloud` says that the surface was made of points.
pub fn oddities(
    catalogue: &Catalogue,
    (left_out, of_cloud): (u64, bool),
    scale: &Scale,
    settings: &Settings,
) -> Vec<String> {
    let mut odd = Vec::new();
    let wider = catalogue.oversize.len();
    // Of a closed or open surface there are two triangles for each vertex; of loose ones, a third.
    if scale.vertices as f64 > 3.0 * LOOSE_SHARE * scale.triangles as f64 {
        odd.push(format!(
            "the {} triangles have {} vertices: nearly every triangle has its own, so none is joined to another and no grain can be found\nhelp: join them, for instance in MeshLab with Filters > Cleaning and Repairing > Merge Close Vertices",
            scale.triangles, scale.vertices
        ));
    } else if catalogue.grains.is_empty() && left_out == 0 {
        odd.push(format!(
            "no grain was found among {} triangles with a mean edge of {:.3e} m, a smallest grain of {:.3e} m² and a widest of {} m{}\nhelp: `gravelometer inspect` says what the survey can show; look at --unit, --min-grain-area and --max-grain",
            scale.triangles,
            scale.mean_edge_m,
            settings.segment.min_grain_area_m2,
            settings.segment.max_grain_m,
            if wider > 0 { format!(" ({wider} wider bodies)") } else { String::new() }
        ));
    }
    let at_edges = catalogue.grains.iter().filter(|g| g.grain.touches_edge).count();
    if at_edges as f64 > EDGE_SHARE * catalogue.grains.len() as f64 {
        odd.push(format!(
            "{at_edges} of {} grains touch an edge of the surface: the border of the survey, or a hole, as gaps between stones often are. What lies beyond is in none of their sizes\nhelp: do not leave them all out; {}",
            catalogue.grains.len(),
            match of_cloud {
                true => "a Poisson mesh of the cloud (CloudCompare, MeshLab) has fewer holes",
                false => "photographs from more sides leave fewer holes",
            }
        ));
    }
    odd
}

/// What is said where the smallest grain that was asked for is smaller than the mesh can show; none where it is not.
pub fn raised_limit(scale: &Scale, settings: &SegmentSettings) -> Option<String> {
    let limit_m2 = smallest_grain_area_m2(scale, settings);
    (limit_m2 > settings.min_grain_area_m2).then(|| {
        format!(
            "the smallest grain is {limit_m2:.2e} m², not {:e}: it takes {} mean triangles to tell one from noise (segment.min_grain_triangles)",
            settings.min_grain_area_m2, settings.min_grain_triangles
        )
    })
}

/// What is odd about a cloud and what became of it, each with what to do.
pub fn oddities_of_cloud(figures: &DrapeFigures) -> Vec<String> {
    let DrapeFigures { points, same_place, side_unknown, .. } = *figures;
    let mut odd = Vec::new();
    if same_place > points / 20 {
        odd.push(format!(
            "{same_place} of {points} points lie at the very place of another one: files may hold the same points, or coordinates may be rounded"
        ));
    }
    if side_unknown > points / 50 {
        odd.push(format!(
            "at {side_unknown} of {points} points nothing nearby tells which side of the surface is the outer one (high walls, wide overhangs, the same ground twice): grains there may be wrong"
        ));
    }
    odd
}

/// Inputs, warnings, lost tiles, and what the survey is made of.
pub fn facts(reach: &Reach, index: &Index, plan: &Plan, warnings: &[String], lost: &[LostJob]) -> serde_json::Value {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned()).display().to_string();
    let inputs: Vec<_> = reach
        .files()
        .iter()
        .map(|f| {
            serde_json::json!({
                "path": absolute(f.path()),
                "bytes": f.bytes(),
                "vertices": f.vertices(),
                "faces": f.faces(),
                "triangles": f.triangles(),
                "format": f.format(),
                "noise_points": f.noise_and_withheld()[0],
                "withheld_points": f.noise_and_withheld()[1],
                "fingerprint": f.fingerprint(),
            })
        })
        .collect();
    let lost: Vec<_> = lost
        .iter()
        .map(|l| {
            let core = index.grid.outline(&plan.tiles[l.job].core);
            serde_json::json!({ "tile": plan.tiles[l.job].id, "core_min_m": core.min, "core_max_m": core.max, "message": l.message })
        })
        .collect();
    serde_json::json!({
        "inputs": inputs,
        "georeference": reach.georeference(),
        "warnings": warnings,
        "lost_tiles": lost,
        "tiles": plan.tiles.len(),
        "core_m": plan.core_m(index),
        "mean_edge_m": index.scale.mean_edge_m,
        "mean_triangle_area_m2": index.scale.mean_triangle_area_m2,
        "spacing_m": Some(index.scale.spacing_m).filter(|spacing_m| *spacing_m > 0.0),
        "zero_area_triangles": index.scale.zero_area_triangles,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;

    #[test]
    fn a_limit_that_the_mesh_raises_is_said_with_both_areas_and_one_that_it_does_not_is_not() {
        let scale = Scale {
            vertices: 3,
            triangles: 1,
            min: DVec3::ZERO,
            max: DVec3::ONE,
            surface_area_m2: 1e-4,
            mean_triangle_area_m2: 1e-4,
            mean_edge_m: 0.015,
            spacing_m: 0.0,
            zero_area_triangles: 0,
        };
        let asked = |min_grain_area_m2| SegmentSettings { min_grain_area_m2, ..SegmentSettings::default() };
        let said = raised_limit(&scale, &asked(1e-3)).unwrap_or_default();
        assert!(["5.00e-3 m²", "not 1e-3", "50 mean"].iter().all(|part| said.contains(part)), "{said}");
        assert_eq!(raised_limit(&scale, &asked(6e-3)), None);
    }
}
