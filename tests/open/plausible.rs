//! Whether coordinates can be what they seem: degrees for metres, and texts with too few digits.

use crate::ply_bytes::{Element, PLACES};
use crate::{assert_contains, open_bytes, open_with, refusal};
use gravelometer::open::{OpenError, Warning};
use gravelometer::settings::{InputSettings, Unit};
use std::fmt::Write;

/// The patch of [`PLACES`], elsewhere.
pub(crate) fn moved(by: [f64; 3]) -> Element {
    let axis = |i: usize| PLACES.into_iter().map(move |p| p[i] + by[i]);
    Element::new("vertex").numbers("double x", axis(0)).numbers("double y", axis(1)).numbers("double z", axis(2))
}

/// A rough sheet of `n` x `n` vertices, as text: `size` in plan, with bumps of `relief`. `print` prints a coordinate.
fn sheet(n: usize, [width, height]: [f64; 2], relief: f64, to: [f64; 3], print: impl Fn(f64) -> String) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        n * n,
        2 * (n - 1) * (n - 1)
    );
    // Irrational steps: no grid that digits could hit by chance.
    let jitter = |i: usize, by: f64| ((i as f64 * by).fract() - 0.5) * 0.6;
    for i in 0..n * n {
        let at = |k: usize, by: f64| (k as f64 + jitter(i, by)) / n as f64;
        let (x, y) = (to[0] + width * at(i % n, 0.618_033_988_7), to[1] + height * at(i / n, 0.732_050_807_5));
        let z = to[2] + relief * jitter(i, 0.414_213_562_3);
        writeln!(text, "{} {} {}", print(x), print(y), print(z)).expect("a string");
    }
    for (i, j) in (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j))) {
        let a = j * n + i;
        writeln!(text, "3 {} {} {}\n3 {} {} {}", a, a + 1, a + n, a + 1, a + n + 1, a + n).expect("a string");
    }
    text
}

fn fully(value: f64) -> String {
    value.to_string()
}

#[test]
fn degrees_without_a_system_are_refused_with_the_remedy() {
    // A gravel bar of 50 x 80 m, a box of 1 x 1 m, and a reach of 3 km that is nearly level.
    for (size, relief) in [([6e-4, 8e-4], 1.5), ([1e-5, 1e-5], 0.1), ([0.03, 0.03], 4.0)] {
        for to in [[170.9, -42.8, 610.0], [-42.8, 170.9, 610.0], [358.2, 46.5, 0.0]] {
            let text = sheet(60, size, relief, to, fully);
            let message = refusal(text.as_bytes());
            assert_contains(&message, &["look like degrees", "project the mesh", "--unit m"]);
        }
    }
    let text = sheet(60, [6e-4, 8e-4], 1.5, [170.9, -42.8, 610.0], fully);
    let system = InputSettings { crs: "EPSG:2193".into(), ..InputSettings::default() };
    let error = open_with("reach.ply", text.as_bytes(), &system).expect_err("degrees in a projected system");
    assert!(matches!(error, OpenError::LooksLikeDegrees { .. }), "{error}");
    let metres = InputSettings { unit: Unit::M, ..InputSettings::default() };
    open_with("reach.ply", text.as_bytes(), &metres).unwrap_or_else(|e| panic!("who says metres means metres: {e}"));
}

#[test]
fn small_and_steep_surveys_in_metres_are_none_in_degrees() {
    for (name, size, relief) in [
        ("a box of sand", [0.5, 0.5], 0.1),
        ("a set of stones of 5 cm", [0.05, 0.05], 0.05),
        ("a single grain of sand", [0.002, 0.002], 0.002),
        ("a wall, seen from above", [8.0, 0.02], 5.0),
        ("a patch of 5 cm with spikes of half a metre", [0.05, 0.05], 1.0),
    ] {
        let text = sheet(40, size, relief, [12.0, 7.0, 100.0], fully);
        open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    // A core that stands upright, its wall in bands of 5 mm.
    let (rings, slices) = (200usize, 30usize);
    let mut core = sheet(2, [1.0; 2], 1.0, [0.0; 3], fully);
    let body = core.find("element vertex").expect("a header");
    core.truncate(body);
    let count = (rings - 1) * (slices - 1);
    write!(core, "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n", rings * slices)
        .and_then(|()| write!(core, "element face {count}\nproperty list uchar int vertex_indices\nend_header\n"))
        .expect("a string");
    for i in 0..rings * slices {
        let (sin, cos) = (std::f64::consts::TAU * (i % slices) as f64 / slices as f64).sin_cos();
        writeln!(core, "{} {} {}", 0.025 * cos, 0.025 * sin, (i / slices) as f64 * 0.005).expect("a string");
    }
    for (i, j) in (0..rings - 1).flat_map(|j| (0..slices - 1).map(move |i| (i, j))) {
        let a = j * slices + i;
        writeln!(core, "4 {} {} {} {}", a, a + 1, a + slices + 1, a + slices).expect("a string");
    }
    open_bytes(core.as_bytes()).unwrap_or_else(|e| panic!("a core: {e}"));
}

#[test]
fn digits_of_a_text_are_kept_where_a_float_would_lose_them() {
    let text = sheet(30, [3.0, 3.0], 0.2, [500_000.0, 4_600_000.0, 100.0], |v| format!("{v:.5}"));
    let (reach, warnings) = open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(warnings, []);
    let first = text.lines().nth(9).expect("a vertex");
    let expected: Vec<f64> = first.split(' ').map(|w| w.parse().expect("a number")).collect();
    let (at, origin) = (reach.position(0), reach.frame().origin_input);
    assert_eq!(at.to_array(), [0, 1, 2].map(|i| expected[i] - origin[i]));
    let step = reach.files()[0].coordinate_step().expect("a step");
    assert!((step - 1e-5).abs() < 1e-12, "{step}");
}

#[test]
fn a_text_with_fewer_digits_than_its_edges_need_is_refused() {
    let at = [500_000.0, 4_600_000.0, 100.0];
    // Edges of about 0.05 m.
    for decimals in [0, 1] {
        let text = sheet(60, [3.0, 3.0], 0.1, at, |v| format!("{v:.decimals$}"));
        let message = refusal(text.as_bytes());
        assert_contains(&message, &["printed in steps of", "more digits", "--offset-file"]);
    }
    let text = sheet(60, [3.0, 3.0], 0.1, at, |v| format!("{v:.2}"));
    let (_, warnings) = open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    assert!(matches!(warnings.as_slice(), [Warning::CoarselyPrinted { .. }]), "{warnings:?}");
    assert_contains(&warnings[0].to_string(), &["steps of 0.01 m", "\nhelp: "]);
    let text = sheet(60, [3.0, 3.0], 0.1, at, |v| format!("{v:.3}"));
    assert_eq!(open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{e}")).1, []);
    // What `%g` makes of metres on a map: six digits.
    let six = |v: f64| format!("{v:.5e}");
    assert_contains(&refusal(sheet(60, [3.0, 3.0], 0.1, at, six).as_bytes()), &["steps of 1 m"]);
    // And of metres about zero, where six are enough.
    let text = sheet(60, [3.0, 3.0], 0.1, [0.0; 3], six);
    assert_eq!(open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{e}")).1, []);
}

#[test]
fn floats_that_were_ruined_before_they_were_printed_are_refused() {
    let at = [500_000.0, 4_600_000.0, 100.0];
    for print in [|v: f64| format!("{:.6}", v as f32), |v: f64| (v as f32).to_string()] {
        let error = open_bytes(sheet(60, [3.0, 3.0], 0.1, at, print).as_bytes()).expect_err("ruined");
        // Printed with all their digits they are known as floats; the shortest texts may also be coarse.
        assert!(matches!(error, OpenError::FloatStep { .. } | OpenError::PrintedStep { .. }), "{error}");
    }
}

#[test]
fn a_grid_that_is_printed_in_full_is_not_coarse() {
    // Whole metres, and halves of them: the steps are as long as the edges, and exact.
    for spacing in [1.0, 0.5] {
        let mut text = sheet(2, [1.0; 2], 1.0, [0.0; 3], fully);
        text.truncate(text.find("element vertex").expect("a header"));
        write!(text, "element vertex 400\nproperty float x\nproperty float y\nproperty float z\n").expect("a string");
        text += "element face 361\nproperty list uchar int vertex_indices\nend_header\n";
        for i in 0..400 {
            let (x, y) = (f64::from(i % 20) * spacing, f64::from(i / 20) * spacing);
            writeln!(text, "{} {} {:.3}", x + 500_000.0, y, (x * 0.7).sin()).expect("a string");
        }
        for (i, j) in (0..19).flat_map(|j| (0..19).map(move |i| (i, j))) {
            let a = j * 20 + i;
            writeln!(text, "4 {} {} {} {}", a, a + 1, a + 21, a + 20).expect("a string");
        }
        open_bytes(text.as_bytes()).unwrap_or_else(|e| panic!("{spacing}: {e}"));
    }
}

#[test]
fn a_surface_that_faces_down_is_warned_of_and_one_with_overhangs_is_not() {
    let metres = InputSettings { unit: Unit::M, ..InputSettings::default() };
    let warnings = |text: &str| open_with("reach.ply", text.as_bytes(), &metres).expect("readable").1;
    let text = sheet(30, [2.0, 2.0], 0.1, [0.0; 3], fully);
    assert!(warnings(&text).is_empty());
    // Every `nth` face turned over.
    let turned = |nth: usize| -> String {
        let mut faces = 0;
        let lines = text.lines().map(|line| {
            let fields: Vec<&str> = line.split(' ').collect();
            let &[_, a, b, c] = fields.as_slice() else { return line.to_owned() };
            if line.starts_with("element") || line.starts_with("property") {
                return line.to_owned();
            }
            faces += 1;
            if faces % nth == 0 { format!("3 {a} {c} {b}") } else { line.to_owned() }
        });
        lines.map(|line| line + "\n").collect()
    };
    assert!(warnings(&turned(4)).is_empty());
    let found = warnings(&turned(1));
    let [warning @ Warning::FacesDown { share, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert!(*share > 0.99, "{share}");
    assert_contains(&warning.to_string(), &["reach.ply: 100 % of the surface", "Invert Faces Orientation"]);
    assert!(matches!(warnings(&turned(2)).as_slice(), [Warning::FacesDown { .. }]));
}
