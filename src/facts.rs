//! What belongs into `run.json` beside settings and costs.

use crate::index::Index;
use crate::open::Reach;
use crate::pipeline::LostJob;
use crate::tile::Plan;
use std::path::Path;

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
        "spacing_m": index.scale.spacing_m,
        "zero_area_triangles": index.scale.zero_area_triangles,
    })
}
