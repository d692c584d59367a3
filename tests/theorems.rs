//! What geometry demands: the curvature of spheres, planes and saddles; measures that do not ask how a stone
//! is turned; and stones of known axes and attitude, measured.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use glam::{DMat3, DQuat};
use gravelometer::curvature::{InstructionSet, Stencil, divergence, nearest_centroid_m};
use gravelometer::geometry::DVec3;
use gravelometer::measure::attitude::Attitude;
use gravelometer::measure::{Grain, Wanted, measure};
use gravelometer::open::MemorySurface;
use gravelometer::segment::Segment;
use gravelometer::settings::CurvatureSettings;
use gravelometer::tile::{NormalField, Owned, TileMesh};
use support::bed::{Rng, ball};

/// Divergence at every vertex of a surface, with the published stencil, and the spacing.
fn divergence_of(surface: &MemorySurface) -> (Vec<f64>, f64) {
    let index = support::indexed(surface);
    let field = NormalField::load(&index, &index.grid.all()).unwrap();
    let area_m2 = index.scale.mean_triangle_area_m2;
    let nearest = nearest_centroid_m(&field, &surface.positions, area_m2.sqrt(), InstructionSet::best());
    let spacing = nearest.iter().map(|d| d.value().unwrap()).sum::<f64>() / nearest.len() as f64;
    let stencil = Stencil::new(spacing, area_m2, &CurvatureSettings::default());
    (
        divergence(&field, &surface.positions, &stencil, InstructionSet::best())
            .into_iter()
            .map(|d| d.value().unwrap())
            .collect(),
        spacing,
    )
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A height field over a square of side 1 about zero, its vertices jittered in plan.
fn sheet(n: usize, height: impl Fn(f64, f64) -> f64) -> MemorySurface {
    let mut rng = Rng(n as u64);
    let mut surface = MemorySurface::default();
    for j in 0..=n {
        for i in 0..=n {
            let mut place = |k: usize| (k as f64 + rng.within(-0.2, 0.2)) / n as f64 - 0.5;
            let (x, y) = (place(i), place(j));
            surface.positions.push(DVec3::new(x, y, height(x, y)));
        }
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u64;
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    surface
}

/// The published stencil is a few edges wide and shrinks with the mesh. Its smoothing bias, a few percent too
/// flat, falls with refinement, but not to zero: of a regular mesh about 2.4 % stays, since the 25 nearest
/// triangles are the same ones however small they are.
#[test]
fn the_divergence_of_a_sphere_comes_within_three_percent_of_two_over_its_radius() {
    let radius = 0.25;
    let (mut errors, mut biases) = (Vec::new(), Vec::new());
    for rings in [20, 40, 80, 160] {
        let (found, spacing) = divergence_of(&ball(radius, rings, 2 * rings));
        assert!(found.iter().all(|&d| d > 0.0), "outward normals: convex is positive");
        let relative: Vec<f64> = found.iter().map(|d| d * radius / 2.0 - 1.0).collect();
        biases.push(median(relative.clone()));
        errors.push(median(relative.iter().map(|e| e.abs()).collect()));
        let (error, bias) = (errors[errors.len() - 1], biases[biases.len() - 1]);
        println!("{rings} rings: spacing / radius {:.4}, median error {error:.5}, bias {bias:.5}", spacing / radius);
    }
    assert!(errors.windows(2).all(|w| w[1] < w[0]), "{errors:?}");
    assert!(errors[0] < 0.05 && errors[2] < 0.03 && errors[3] < 0.03, "{errors:?}");
    assert!(biases.windows(2).all(|w| w[1].abs() < w[0].abs()), "{biases:?}");
}

#[test]
fn a_hollow_is_as_negative_as_a_dome_is_positive() {
    let dome = sheet(60, |x, y| (1.0 - x * x - y * y).sqrt());
    let bowl = sheet(60, |x, y| -(1.0 - x * x - y * y).sqrt());
    let inside = |s: &MemorySurface, v: usize| s.positions[v].truncate().length() < 0.35;
    for (surface, expected) in [(dome, 2.0), (bowl, -2.0)] {
        let (found, _) = divergence_of(&surface);
        let inner: Vec<f64> = (0..found.len()).filter(|&v| inside(&surface, v)).map(|v| found[v]).collect();
        assert!(inner.iter().all(|d| d * expected > 0.0), "sign");
        let error = median(inner.iter().map(|d| (d / expected - 1.0).abs()).collect());
        println!("{expected}: median error {error:.4}");
        assert!(error < 0.05, "{expected}: {error}");
    }
}

#[test]
fn a_tilted_plane_has_no_divergence() {
    let (found, spacing) = divergence_of(&sheet(60, |x, y| 0.3 * x - 0.2 * y + 0.7));
    let worst = found.iter().fold(0.0f64, |w, d| w.max(d.abs()));
    println!("plane: worst {worst:.1e} 1/m, spacing {spacing:.4} m");
    assert!(worst < 1e-9 / spacing, "{worst}");
}

/// div n of z = k (x² - y²) is of the order k³ r² away from the centre, and 0 there.
#[test]
fn a_saddle_has_no_divergence_at_its_centre() {
    let surface = sheet(80, |x, y| 0.8 * (x * x - y * y));
    let (found, _) = divergence_of(&surface);
    let centre: Vec<f64> =
        (0..found.len()).filter(|&v| surface.positions[v].truncate().length() < 0.06).map(|v| found[v]).collect();
    let mean = centre.iter().sum::<f64>() / centre.len() as f64;
    println!("saddle: mean {mean:.4} 1/m of {} vertices; its principal curvatures are 1.6", centre.len());
    assert!(mean.abs() < 0.02 * 1.6, "{mean}");
}

/// Measures the whole surface as one grain.
fn measured(surface: &MemorySurface) -> Grain {
    let index = support::indexed(surface);
    let all = index.grid.all();
    let mesh = TileMesh::load(&index, Owned::Cells(&all), &all).unwrap();
    let inputs = index.vertex_inputs(0..index.scale.vertices).unwrap();
    let segment =
        Segment { triangles: (0..mesh.triangles.len() as u32).collect(), at_mesh_edge: false, evidence: None };
    let wanted = Wanted {
        outline_step_m: 1.0 / 1_048_576.0,
        shape_prior: gravelometer::settings::ShapePrior::RIVER_GRAVEL,
        triangle_ids: false,
    };
    measure(&mesh, &segment, wanted, &|v| {
        Some(surface.colors.get(inputs[v as usize] as usize)?.map(|c| f64::from(c) / 255.0))
    })
}

/// An ellipsoid of full axes `axes_m`, its axes along the columns of `turn`.
fn stone(axes_m: [f64; 3], turn: DMat3, rings: u64) -> MemorySurface {
    let mut stone = ball(1.0, rings, 2 * rings);
    let half = DVec3::from_array(axes_m) / 2.0;
    stone.positions.iter_mut().for_each(|p| *p = turn * (*p * half));
    stone
}

/// Only the part above zero height before it is turned.
fn upper_half(axes_m: [f64; 3], rings: u64) -> MemorySurface {
    let whole = stone(axes_m, DMat3::IDENTITY, rings);
    let keep: Vec<[u64; 3]> =
        whole.triangles.iter().copied().filter(|t| t.iter().all(|&v| whole.positions[v as usize].z > -1e-9)).collect();
    MemorySurface { triangles: keep, ..whole }
}

/// A lump without any symmetry.
fn lump() -> MemorySurface {
    let mut lump = stone([0.31, 0.22, 0.12], DMat3::IDENTITY, 24);
    let mut rng = Rng(3);
    for p in &mut lump.positions {
        *p *= 1.0 + rng.within(-0.05, 0.05) + 0.4 * p.x + 0.3 * p.y;
    }
    lump
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

#[test]
fn a_stone_measures_the_same_wherever_it_lies_and_however_it_is_turned() {
    let at_home = measured(&lump());
    let quarter = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);
    let any = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::ZYX, 0.7, -0.4, 1.9));
    for (turn, shift) in [
        (quarter, DVec3::ZERO),
        (any, DVec3::ZERO),
        (any, DVec3::new(812.25, -377.5, 64.0)),
        (DMat3::IDENTITY, DVec3::new(3.0, 5.0, 7.0)),
    ] {
        let mut moved = lump();
        moved.positions.iter_mut().for_each(|p| *p = turn * *p + shift);
        let g = measured(&moved);
        let mut worst = 0.0f64;
        for i in 0..3 {
            worst = worst.max(relative(g.axes_m[i], at_home.axes_m[i]));
            let (e, f) = (g.ellipsoid_axes_m.unwrap()[i], at_home.ellipsoid_axes_m.unwrap()[i]);
            worst = worst.max(relative(e, f));
            // An axis has no sign of its own: the rule that gives it one looks at where east and up are.
            let along = g.directions[i].dot(turn * at_home.directions[i]).abs();
            assert!(along > 1.0 - 1e-12, "axis {i} does not turn along: {along}");
        }
        worst = worst.max(relative(g.surface_area_m2, at_home.surface_area_m2));
        worst = worst.max(relative(g.hull_area_m2, at_home.hull_area_m2));
        worst = worst.max(relative(g.hull_volume_m3, at_home.hull_volume_m3));
        println!("worst relative change {worst:.1e}");
        assert!(worst < 1e-9, "{worst}");
        assert!((g.centroid - (turn * at_home.centroid + shift)).length() < 1e-11);
    }
}

/// Rotation that lays a along azimuth `trend`, `plunge` degrees down, and turns the stone about it.
fn laid(trend: f64, plunge: f64, spin: f64) -> DMat3 {
    let (t, p) = (f64::to_radians(trend), f64::to_radians(plunge));
    let a = DVec3::new(t.sin() * p.cos(), t.cos() * p.cos(), -p.sin());
    let b = DQuat::from_axis_angle(a, spin.to_radians()) * DVec3::new(-t.cos(), t.sin(), 0.0);
    DMat3::from_cols(a, b, a.cross(b))
}

fn angle_between(a: f64, b: f64) -> f64 {
    ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs()
}

#[test]
fn a_stone_of_known_axes_and_attitude_is_measured_as_it_lies() {
    let axes_m = [0.24, 0.16, 0.10];
    for (trend, plunge, spin) in [(30.0, 20.0, 0.0), (250.0, 35.0, 15.0), (120.0, 5.0, -40.0), (0.0, 60.0, 10.0)] {
        let turn = laid(trend, plunge, spin);
        let g = measured(&stone(axes_m, turn, 60));
        let near = |found: [f64; 3]| found.iter().zip(axes_m).all(|(f, a)| relative(*f, a) < 0.01);
        assert!(near(g.axes_m), "{:?}", g.axes_m);
        assert!(near(g.ellipsoid_axes_m.unwrap()), "{:?}", g.ellipsoid_axes_m);
        let at = Attitude::of(g.directions);
        assert!(angle_between(at.a_trend_deg.unwrap(), trend) < 1.0, "{at:?}");
        assert!((at.a_plunge_deg - plunge).abs() < 1.0, "{at:?}");
        // The a-b plane dips where its upward normal leans.
        let up = if turn.z_axis.z < 0.0 { -turn.z_axis } else { turn.z_axis };
        assert!((at.ab_dip_deg - up.z.acos().to_degrees()).abs() < 1.0, "{at:?}");
        let direction = up.x.atan2(up.y).to_degrees();
        assert!(angle_between(at.ab_dip_direction_deg.unwrap(), direction) < 1.0, "{at:?}");
        let rebuilt = DMat3::from_rotation_z(at.yaw_deg.to_radians())
            * DMat3::from_rotation_y(at.pitch_deg.to_radians())
            * DMat3::from_rotation_x(at.roll_deg.to_radians());
        for i in 0..3 {
            assert!((rebuilt.col(i) - g.directions[i]).length() < 1e-9, "{at:?}");
            assert!(rebuilt.col(i).dot(turn.col(i)).abs() > f64::to_radians(1.0).cos(), "axis {i}: {at:?}");
        }
    }
}

#[test]
fn a_stone_that_shows_its_upper_half_has_its_a_and_b_and_half_its_c() {
    for axes_m in [[0.24, 0.16, 0.10], [0.30, 0.30, 0.12]] {
        let g = measured(&upper_half(axes_m, 60));
        assert!(relative(g.axes_m[0], axes_m[0]) < 0.01 && relative(g.axes_m[1], axes_m[1]) < 0.01, "{:?}", g.axes_m);
        assert!(relative(g.axes_m[2], axes_m[2] / 2.0) < 0.01, "{:?}", g.axes_m);
        // The ellipsoid is fitted to the surface and so knows the buried half; but the fit is tied to
        // 4 J > I² (see `measure::ellipsoid_axes`), which flatter stones do not have.
        let inverse = axes_m.map(|a: f64| 1.0 / (a * a));
        let (i, squares) = (inverse.iter().sum::<f64>(), inverse.iter().map(|q| q * q).sum::<f64>());
        if 2.0 * (i * i - squares) > i * i {
            let fitted = g.ellipsoid_axes_m.unwrap();
            assert!((0..3).all(|i| relative(fitted[i], axes_m[i]) < 0.01), "{fitted:?}");
        }
        let footprint = std::f64::consts::FRAC_PI_4 * axes_m[0] * axes_m[1];
        assert!(relative(g.footprint_area_m2, footprint) < 0.01, "{}", g.footprint_area_m2);
    }
}

#[test]
fn the_surface_and_volume_of_a_ball_are_those_of_a_sphere() {
    let g = measured(&ball(0.1, 60, 120));
    let (area, volume) = (4.0 * std::f64::consts::PI * 0.01, 4.0 / 3.0 * std::f64::consts::PI * 0.001);
    assert!(relative(g.surface_area_m2, area) < 0.002 && relative(g.hull_area_m2, area) < 0.002);
    assert!(relative(g.hull_volume_m3, volume) < 0.003, "{}", g.hull_volume_m3);
    assert!(relative(g.footprint_area_m2, std::f64::consts::PI * 0.01) < 0.002, "{}", g.footprint_area_m2);
}
