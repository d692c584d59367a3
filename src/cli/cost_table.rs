//! The costs of a run as a table for people.

use crate::costs::Costs;
use std::fmt::Write;

/// One line for each stage, and a total. A figure that the system does not tell is a dash.
pub fn cost_table(costs: &Costs, triangles: u64) -> String {
    let mut rows = vec![["stage", "amount", "CPU s", "us per triangle", "wall s"].map(str::to_owned)];
    for stage in &costs.stages {
        let amount = format!("{} {}", stage.amount, stage.unit.name());
        rows.push(row(stage.name, amount, stage.cpu_s, stage.wall_s, triangles));
    }
    rows.push(row("total", format!("{triangles} triangles"), costs.cpu_s, costs.wall_s, triangles));
    let mut width = [0; 5];
    for row in &rows {
        row.iter().zip(&mut width).for_each(|(cell, width)| *width = cell.len().max(*width));
    }
    let mut table = String::new();
    for [stage, amount, cpu, per_triangle, wall] in &rows {
        let [w0, w1, w2, w3, w4] = width;
        let _ = writeln!(table, "{stage:<w0$}  {amount:>w1$}  {cpu:>w2$}  {per_triangle:>w3$}  {wall:>w4$}");
    }
    let peak = costs.peak_memory_bytes.map_or("-".to_owned(), |bytes| (bytes >> 20).to_string());
    table + &format!("peak memory {peak} MiB, mapped input included")
}

fn row(name: &str, amount: String, cpu_s: Option<f64>, wall_s: f64, triangles: u64) -> [String; 5] {
    let figure = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2}"));
    let us_per_triangle = cpu_s.filter(|_| triangles > 0).map(|s| s * 1e6 / triangles as f64);
    [name.to_owned(), amount, figure(cpu_s), figure(us_per_triangle), format!("{wall_s:.2}")]
}
