//! Every digit that the reference scorer (Python, NumPy) prints, for labels that are made here again from the truth by
//! formulas on the numbers of triangles and vertices. `reference/SCENE.txt` holds what it printed, with the options
//! that [`Case`] repeats.

use crate::support;
use gravelometer::validate::{Middle, Report, Score, TruthRule, Validation, validate};
use npyz::WriterBuilder;
use std::fmt::Write;
use std::path::Path;

/// True labels with flaws of all kinds: stones merged with the one before, split by place in the file, dropped, frayed,
/// and false grains on sand.
fn flawed(stones: &[i32]) -> Vec<i32> {
    let count = stones.len();
    let label = |(i, &stone): (usize, &i32)| {
        let (part, patch) = (i / (count / 97) % 3, i / (count / 997));
        match (stone.rem_euclid(7), stone >= 0) {
            _ if i % 11 == 0 => -1,
            (_, false) if patch % 40 == 7 => 20_000 + patch as i32,
            (_, false) => -1,
            (1, _) => stone - 1,
            (3, _) if part == 0 => 10_000 + stone,
            (5, _) => -1,
            _ => stone,
        }
    };
    stones.iter().enumerate().map(label).collect()
}

fn read(archive: &Path, name: &str) -> Vec<i32> {
    npyz::npz::NpzArchive::open(archive).unwrap().by_name(name).unwrap().unwrap().into_vec().unwrap()
}

fn write<T: npyz::AutoSerialize + Copy>(path: &Path, numbers: &[T]) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let shape = [numbers.len() as u64];
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(file).begin_nd().unwrap();
    writer.extend(numbers.iter().copied()).unwrap();
    writer.finish().unwrap();
}

/// What the reference prints of a score.
fn printed(rule: &str, score: &Score) -> String {
    let mut text = format!("truth rule {rule}: {} visible pebbles, {} segments\n", score.visible, score.segments);
    for (name, d) in [("detection_majority", &score.detection_majority), ("detection_iou50", &score.detection_iou50)] {
        let shares = format!("precision {:.3} recall {:.3} F1 {:.3} IoU {:.3}", d.precision, d.recall, d.f1, d.iou);
        writeln!(text, "{name:<20} TP {:4} FP {:4} FN {:4}  {shares}", d.tp, d.fp, d.missed).unwrap();
    }
    let e = &score.errors;
    writeln!(
        text,
        "errors               over_segmented_extra {}, over_segmented_pebbles {}, mostly_sand {}, phantom_ignored {}, \
         under_segmented {}, missed {}",
        e.over_segmented_extra, e.over_segmented_pebbles, e.mostly_sand, e.phantom_ignored, e.under_segmented, e.missed
    )
    .unwrap();
    let area = score.area.unwrap();
    let share = |name: &str, m: Middle| format!("{name} mean {:.3} median {:.3}", m.mean, m.median);
    let shares = [share("precision", area.precision), share("recall", area.recall), share("iou", area.iou)];
    writeln!(text, "area (matched)       {}", shares.join("  ")).unwrap();
    let axes: Vec<String> = ["A", "B", "C"]
        .into_iter()
        .zip(score.axes.unwrap().to_array())
        .map(|(name, x)| {
            let (mean, median, bias) = (x.mean_abs_percent, x.median_abs_percent, x.bias_percent);
            format!("{name} mean|e| {mean:.1}% median {median:.1}% bias {bias:+.1}%")
        })
        .collect();
    writeln!(text, "axes error           {}", axes.join("  ")).unwrap();
    let turned = score.orientation.unwrap();
    let angles: Vec<String> = [("A", turned.a), ("B", turned.b), ("C", turned.c), ("cumulative", turned.cumulative)]
        .into_iter()
        .map(|(name, m)| format!("{name} mean {:.1} median {:.1}", m.mean, m.median))
        .collect();
    writeln!(text, "axis angle, degrees  {}", angles.join("  ")).unwrap();
    let b = score.b_axis_mm.unwrap();
    let (found, error) = (b.segments.unwrap().to_array(), b.error_percent.unwrap().to_array());
    let sizes: Vec<String> = ["D16", "D50", "D84"]
        .into_iter()
        .zip(b.truth.to_array())
        .enumerate()
        .map(|(i, (name, truth))| {
            format!("{name} truth {truth:.1} mm, segments {:.1} mm ({:+.1}%)", found[i], error[i])
        })
        .collect();
    writeln!(text, "B axis               {}", sizes.join("  ")).unwrap();
    let Some(references) = &score.reference_pebbles else { return text };
    writeln!(text, "reference pebbles    {}, IoU > 0.8: {}", references.n, references.iou_over_08).unwrap();
    text += "  no  prec  recall  IoU  repr.  dA mm  dB mm  dC mm  sum cm   yaw pitch  roll   sum deg\n";
    for x in &references.rows {
        let turned = x.attitude.unwrap();
        writeln!(
            text,
            "  {:2} {:.3}  {:.3} {:.3}  {:.2}  {:+5.1}  {:+5.1}  {:+5.1}   {:5.2} {:5.0} {:5.0} {:5.0}   {:5.0}",
            x.reference,
            x.precision,
            x.recall,
            x.iou,
            x.represented.unwrap(),
            1e3 * x.a_error,
            1e3 * x.b_error,
            1e3 * x.c_error,
            x.cumulative_axes_cm,
            turned.yaw,
            turned.pitch,
            turned.roll,
            turned.cumulative_angle
        )
        .unwrap();
    }
    text
}

/// The part of a stored print.
fn stored<'a>(text: &'a str, part: &str) -> &'a str {
    let start = text.find(&format!("== {part}\n")).unwrap() + part.len() + 4;
    text[start..].split("== ").next().unwrap()
}

fn agrees(scene: &str, stored_text: &str) {
    let Some(folder) = support::data(&format!("dev-scenes/{scene}")) else { return };
    let temporary = tempfile::tempdir().unwrap();
    let archive = folder.join("truth.npz");
    let of_triangles = temporary.path().join("flawed.npy");
    write(&of_triangles, &flawed(&read(&archive, "tri_id")));
    // Unsigned, with 0 for none, as programs write them that know no negative labels.
    let of_vertices = temporary.path().join("vertices.npy");
    write(&of_vertices, &flawed(&read(&archive, "vert_id")).iter().map(|&l| (l + 1) as u32).collect::<Vec<_>>());
    let plain = Validation { run: of_triangles, truth: folder, ..Validation::default() };
    let report = |what: &Validation| -> Report { validate(what).unwrap().report };

    let first = report(&plain);
    assert_eq!(printed("best", &first.score), stored(stored_text, "perturbed"), "{scene}");
    assert_eq!(printed("best", &first.perfect_labels), stored(stored_text, "true"), "{scene}");
    let strict = report(&Validation {
        rule: TruthRule::Strict,
        min_area_m2: 1e-4,
        visible_area_m2: Some(2e-4),
        ..plain.clone()
    });
    assert_eq!(printed("strict", &strict.score), stored(stored_text, "strict"), "{scene}");
    let by_vertex = report(&Validation { run: of_vertices, zero_is_none: true, ..plain });
    assert_eq!(printed("best", &by_vertex.score), stored(stored_text, "vertex"), "{scene}");
}

macro_rules! scenes {
    ($($test:ident $scene:literal),*) => {$(
        #[test]
        fn $test() {
            agrees($scene, include_str!(concat!("reference/", $scene, ".txt")));
        }
    )*};
}

scenes! {
    coarse_gets_every_digit_of_the_reference "coarse",
    packed_window_gets_every_digit_of_the_reference "packed_window",
    sandbox_window_gets_every_digit_of_the_reference "sandbox_window",
    sandbox_low_window_gets_every_digit_of_the_reference "sandbox_low_window",
    wide_window_gets_every_digit_of_the_reference "wide_window"
}

#[test]
fn flaws_are_of_every_kind() {
    let stones: Vec<i32> = (0..9970).map(|i| i / 100 % 20 - 6).collect();
    let labels = flawed(&stones);
    let has = |wanted: &dyn Fn(i32, i32) -> bool| stones.iter().zip(&labels).any(|(&s, &l)| wanted(s, l));
    assert!(has(&|s, l| s >= 0 && l == s) && has(&|s, l| s > 0 && l == s - 1), "kept and merged");
    assert!(has(&|s, l| l == 10_000 + s) && has(&|s, l| s == 5 && l == -1), "split and dropped");
    assert!(has(&|s, l| s < 0 && l >= 20_000), "on sand");
}
