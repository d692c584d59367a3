//! The curvature kernel against a plain search that sorts everything, bit for bit, on clouds that are nasty on
//! purpose, with every instruction set that this processor has.
#![allow(missing_docs, clippy::unwrap_used, clippy::needless_range_loop, unreachable_pub)]

mod support;

use gravelometer::curvature::{self, Certain, InstructionSet, Neighbours, Stencil};
use gravelometer::geometry::{DVec3, PlanBox, triangle_area, triangle_centroid, triangle_normal};
use gravelometer::tile::NormalField;

const EVERYWHERE: PlanBox = PlanBox { min: [f64::NEG_INFINITY; 2], max: [f64::INFINITY; 2] };
const COUNTS: [usize; 5] = [1, 5, 25, 60, 256];

/// Numbers from a seed, the same on every machine.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn direction(&mut self) -> DVec3 {
        DVec3::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(0.2, 1.0)).normalize()
    }
}

/// Centroids with normals, places where the divergence is wanted, and the mean side of a triangle.
struct Cloud {
    name: &'static str,
    field: NormalField,
    points: Vec<DVec3>,
    side_m: f64,
}

impl Cloud {
    fn new(name: &'static str, centroids: Vec<DVec3>, points: Vec<DVec3>, side_m: f64) -> Cloud {
        let mut random = Random(7);
        let normals = centroids.iter().map(|_| random.direction()).collect();
        Cloud { name, field: NormalField { centroids, normals, loaded: EVERYWHERE }, points, side_m }
    }

    /// A cloud whose vertices are near its centroids, and a few are not.
    fn around(name: &'static str, centroids: Vec<DVec3>, side_m: f64, count: usize) -> Cloud {
        let mut random = Random(11);
        let mut points = Vec::new();
        for i in 0..count {
            let near = centroids[(random.unit() * centroids.len() as f64) as usize];
            let far = if i % 40 == 0 { 30.0 } else { 0.6 };
            points.push(near + random.direction() * far * side_m * random.unit());
        }
        Cloud::new(name, centroids, points, side_m)
    }

    fn stencil(&self, neighbours: usize) -> Stencil {
        Stencil { spacing_m: 0.55 * self.side_m, offset_m: 1.1 * self.side_m, neighbours, side_m: self.side_m }
    }
}

fn sheet(
    random: &mut Random,
    count: usize,
    width: f64,
    mut height: impl FnMut(&mut Random, f64, f64) -> f64,
) -> Vec<DVec3> {
    (0..count)
        .map(|_| {
            let (x, y) = (random.within(0.0, width), random.within(0.0, width));
            DVec3::new(x, y, height(random, x, y))
        })
        .collect()
}

fn clouds() -> Vec<Cloud> {
    let mut r = Random(1);
    let wavy = |r: &mut Random, x: f64, y: f64| (x * 0.4).sin() * 3.0 + (y * 0.3).cos() * 2.0 + 0.05 * r.unit();
    let mut all = vec![Cloud::around("wavy sheet", sheet(&mut r, 3000, 55.0, wavy), 1.0, 250)];

    let regular: Vec<DVec3> =
        (0..48 * 48).map(|i| DVec3::new(f64::from(i % 48), f64::from(i / 48), f64::from(i % 3))).collect();
    let nodes = (0..200).map(|i| DVec3::new(f64::from(i % 48), f64::from(i / 4), 0.5 * f64::from(i % 2))).collect();
    all.push(Cloud { side_m: 1.0, ..Cloud::new("regular grid, all ties", regular.clone(), nodes, 1.0) });

    let mut shuffled: Vec<DVec3> = regular.iter().flat_map(|&c| [c; 4]).collect();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, (r.unit() * (i + 1) as f64) as usize);
    }
    all.push(Cloud::around("every centroid four times", shuffled, 0.5, 120));

    let uneven =
        (0..4000).map(|_| DVec3::new(40.0 * r.unit().powi(6), 40.0 * r.unit().powi(4), 0.2 * r.unit())).collect();
    all.push(Cloud::around("uneven density", uneven, 0.5, 250));

    let layers = sheet(&mut r, 3000, 40.0, |r, _, _| if r.unit() < 0.5 { 0.0 } else { 1e-7 });
    all.push(Cloud::around("double layer", layers, 0.7, 150));

    let mut stray = sheet(&mut r, 2500, 50.0, wavy);
    for i in 0..6 {
        stray[i * 400] = DVec3::new(10f64.powi(i as i32 + 1), -300.0 * i as f64, 10f64.powi(6 - i as i32));
    }
    all.push(Cloud::around("outliers", stray, 1.0, 250));

    let shift = DVec3::new(48_211.3, -93_377.1, 1512.7);
    let far = sheet(&mut r, 3000, 55.0, wavy).into_iter().map(|c| c * 3e-4 + shift).collect();
    all.push(Cloud::around("far from the origin, fine", far, 3e-4, 250));

    let volume = (0..3000).map(|_| DVec3::new(r.unit(), r.unit(), r.unit()) * 14.0).collect();
    all.push(Cloud::around("volume", volume, 1.0, 120));

    let line = (0..1500).map(|i| DVec3::new(0.01 * f64::from(i), 0.0, 0.0)).collect();
    all.push(Cloud::around("line", line, 0.01, 120));
    all.push(Cloud::around("one place", vec![DVec3::new(1.0, 2.0, 3.0); 700], 1.0, 20));
    let coarse = sheet(&mut r, 900, 30.0, wavy);
    all.push(Cloud::around("sides much too small", coarse.clone(), 0.02, 60));
    all.push(Cloud::around("sides much too large", coarse, 30.0, 60));
    for (name, count) in [("one centroid", 1), ("four centroids", 4), ("24 centroids", 24), ("80 centroids", 80)] {
        all.push(Cloud::around(name, sheet(&mut r, count, 5.0, wavy), 1.0, 30));
    }
    all
}

/// The weight as the documentation of the kernel has it, of a squared distance in units of 2^50 times the spacing.
fn weight(d2: f64) -> f64 {
    let x = if d2 > 2f64.powi(-100) { d2 } else { 2f64.powi(-100) };
    let guess = f64::from_bits(0x5FE3_F488_137B_DF99 - (x.to_bits() >> 1));
    let t = x * guess * guess;
    let polynomial = 0.669_317_201_101_195_5f64.mul_add(t, -1.770_729_842_481_61).mul_add(t, 2.106_247_710_098_045);
    let y = guess * polynomial;
    let e = (x * y).mul_add(-y, 1.0);
    (y * e).mul_add(0.375f64.mul_add(e, 0.500_000_000_237_5), y)
}

/// The weighted mean of one component of the neighbours' normals.
fn mean(field: &NormalField, found: impl Iterator<Item = usize>, p: DVec3, s: &Stencil, q: usize) -> f64 {
    let (mut weighted, mut weights) = (0i64, 0i64);
    let axis = q / 2;
    let per_m2 = 2f64.powi(-100) / (s.spacing_m * s.spacing_m);
    for t in found {
        let u = field.centroids[t] - p;
        let middle = u.z.mul_add(u.z, s.offset_m * s.offset_m);
        let middle = u.x.mul_add(u.x, u.y.mul_add(u.y, middle)) * per_m2;
        let twice = 2.0 * s.offset_m * per_m2;
        let w = weight(u[axis].mul_add(if q.is_multiple_of(2) { -twice } else { twice }, middle));
        let normal = field.normals[t][axis];
        let round = 1.5 * 2f64.powi(52);
        weights += ((w + round) - round) as i64;
        weighted += (w.mul_add(normal, round) - round) as i64;
    }
    weighted as f64 / weights as f64
}

/// The divergence by sorting all centroids; none where one beyond what is loaded could count.
fn reference(field: &NormalField, p: DVec3, s: &Stencil) -> Option<f64> {
    let mut means = [0.0; 6];
    for (q, of_point) in means.iter_mut().enumerate() {
        let shift = DVec3::AXES[q / 2] * s.offset_m;
        let place = if q.is_multiple_of(2) { p + shift } else { p - shift };
        let mut all: Vec<(f64, usize)> = field
            .centroids
            .iter()
            .map(|&c| c - place)
            .enumerate()
            .map(|(t, d)| (d.x * d.x + d.y * d.y + d.z * d.z, t))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all.truncate(s.neighbours);
        let margin = field.loaded.margin_m(place);
        if margin < f64::INFINITY && (all.len() < s.neighbours || all[all.len() - 1].0.sqrt() >= margin) {
            return None;
        }
        *of_point = mean(field, all.iter().map(|n| n.1), p, s, q);
    }
    Some(((means[0] - means[1]) + (means[2] - means[3]) + (means[4] - means[5])) / (2.0 * s.offset_m))
}

fn divergence(field: &NormalField, points: &[DVec3], s: &Stencil, set: InstructionSet) -> Vec<Option<f64>> {
    curvature::divergence(field, points, s, set).into_iter().map(Certain::value).collect()
}

fn nearest_centroid_m(field: &NormalField, points: &[DVec3], side_m: f64, set: InstructionSet) -> Vec<Option<f64>> {
    curvature::nearest_centroid_m(field, points, side_m, set).into_iter().map(Certain::value).collect()
}

fn bits(values: &[Option<f64>]) -> Vec<Option<u64>> {
    values.iter().map(|v| v.map(f64::to_bits)).collect()
}

#[test]
fn every_instruction_set_gives_the_bits_of_a_plain_search() {
    for cloud in clouds() {
        for k in COUNTS {
            let stencil = cloud.stencil(k);
            let expected: Vec<_> = cloud.points.iter().map(|&p| reference(&cloud.field, p, &stencil)).collect();
            assert!(expected.iter().all(Option::is_some), "{}: everything is loaded", cloud.name);
            for set in InstructionSet::available() {
                let found = divergence(&cloud.field, &cloud.points, &stencil, set);
                assert_eq!(bits(&found), bits(&expected), "{}, {k} neighbours, {set:?}", cloud.name);
            }
        }
    }
}

/// A golden mesh: float x y z, uchar colours, triangles as `list uchar int`.
fn golden(name: &str) -> Option<Cloud> {
    let bytes = std::fs::read(support::data(&format!("golden/{name}.ply"))?).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |name: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(&format!("element {name} "))).unwrap().parse().unwrap()
    };
    let (n, m) = (count("vertex"), count("face"));
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let int = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let points: Vec<DVec3> =
        (0..n).map(|i| end + 15 * i).map(|at| DVec3::new(float(at), float(at + 4), float(at + 8))).collect();
    let corners: Vec<[DVec3; 3]> =
        (0..m).map(|i| end + 15 * n + 13 * i).map(|at| [1, 5, 9].map(|k| points[int(at + k)])).collect();
    let area = corners.iter().map(|&c| triangle_area(c)).sum::<f64>() / m as f64;
    let field = NormalField {
        centroids: corners.iter().map(|&c| triangle_centroid(c)).collect(),
        normals: corners.iter().map(|&c| triangle_normal(c)).collect(),
        loaded: EVERYWHERE,
    };
    Some(Cloud { name: "golden", field, points, side_m: area.sqrt() })
}

#[test]
fn golden_beds_have_the_bits_of_the_exact_search_on_one_thread_and_two() {
    for name in ["bed_0.3M", "bed3d_1M"] {
        let Some(mut bed) = golden(name) else { return };
        let stencil = bed.stencil(25);
        let whole = divergence(&bed.field, &bed.points, &stencil, InstructionSet::best());
        let every = |i: usize| i * 23;
        bed.points = (0..bed.points.len().div_ceil(23)).map(|i| bed.points[every(i)]).collect();
        let search = Neighbours::new(&bed.field, 2.5 * bed.side_m);
        let mut found = Vec::new();
        let expected: Vec<_> = bed
            .points
            .iter()
            .map(|&p| {
                let means = [0, 1, 2, 3, 4, 5].map(|q| {
                    let shift = DVec3::AXES[q / 2] * stencil.offset_m;
                    let place = if q.is_multiple_of(2) { p + shift } else { p - shift };
                    assert!(search.nearest(place, 25, 3.5 * bed.side_m, &mut found));
                    mean(&bed.field, found.iter().map(|n| n.1 as usize), p, &stencil, q)
                });
                let [x, y, z] = [0, 2, 4].map(|q| means[q] - means[q + 1]);
                Some((x + y + z) / (2.0 * stencil.offset_m))
            })
            .collect();
        let thinned: Vec<_> = (0..expected.len()).map(|i| whole[every(i)]).collect();
        assert_eq!(bits(&thinned), bits(&expected), "{name}");
        for set in InstructionSet::available() {
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let found = pool.install(|| divergence(&bed.field, &bed.points, &stencil, set));
                assert_eq!(bits(&found), bits(&expected), "{name}, {set:?}, {threads} threads");
            }
        }
    }
}

#[test]
fn the_nearest_centroid_is_that_of_a_plain_search() {
    for cloud in clouds() {
        let search = Neighbours::new(&cloud.field, cloud.side_m);
        let mut near = Vec::new();
        let expected: Vec<_> = cloud
            .points
            .iter()
            .map(|&p| {
                search.nearest(p, 1, cloud.side_m, &mut near);
                Some(near[0].0.sqrt())
            })
            .collect();
        for set in InstructionSet::available() {
            let found = nearest_centroid_m(&cloud.field, &cloud.points, cloud.side_m, set);
            assert_eq!(bits(&found), bits(&expected), "{}, {set:?}", cloud.name);
        }
    }
}

#[test]
fn a_field_cut_to_a_box_gives_the_same_bits_or_none() {
    for cloud in clouds().into_iter().take(8) {
        let mut sides = [0, 1].map(|axis| cloud.field.centroids.iter().map(|c| c[axis]).collect::<Vec<f64>>());
        sides.iter_mut().for_each(|s| s.sort_by(f64::total_cmp));
        let at = |axis: usize, share: f64| sides[axis][(share * (sides[axis].len() - 1) as f64) as usize];
        for (low, high) in [(0.11, 0.83), (0.37, 0.71)] {
            let loaded = PlanBox { min: [at(0, low), at(1, low)], max: [at(0, high), f64::INFINITY] };
            let inside: Vec<usize> = (0..cloud.field.centroids.len())
                .filter(|&t| loaded.margin_m(cloud.field.centroids[t]) >= 0.0)
                .collect();
            let cut = NormalField {
                centroids: inside.iter().map(|&t| cloud.field.centroids[t]).collect(),
                normals: inside.iter().map(|&t| cloud.field.normals[t]).collect(),
                loaded,
            };
            for k in [5, 25] {
                let stencil = cloud.stencil(k);
                let expected: Vec<_> = cloud.points.iter().map(|&p| reference(&cut, p, &stencil)).collect();
                for set in InstructionSet::available() {
                    let whole = divergence(&cloud.field, &cloud.points, &stencil, set);
                    let found = divergence(&cut, &cloud.points, &stencil, set);
                    assert_eq!(bits(&found), bits(&expected), "{}, {k} neighbours, {set:?}", cloud.name);
                    assert!(found.iter().any(Option::is_none), "{}: the box cuts nothing", cloud.name);
                    let known = |(f, _): &(&Option<f64>, &Option<f64>)| f.is_some();
                    let roomy = k == 5 && low < 0.2;
                    assert!(!roomy || found.iter().any(Option::is_some), "{}: nothing is certain", cloud.name);
                    for (i, (f, w)) in found.iter().zip(&whole).enumerate().filter(|(_, e)| known(e)) {
                        assert_eq!(f.map(f64::to_bits), w.map(f64::to_bits), "{}, point {i}, {set:?}", cloud.name);
                    }
                }
            }
        }
    }
}

#[test]
fn the_order_and_company_of_points_do_not_matter() {
    let cloud = &clouds()[0];
    let stencil = cloud.stencil(25);
    for set in InstructionSet::available() {
        let together = divergence(&cloud.field, &cloud.points, &stencil, set);
        let reversed: Vec<DVec3> = cloud.points.iter().rev().copied().collect();
        let mut backwards = divergence(&cloud.field, &reversed, &stencil, set);
        backwards.reverse();
        assert_eq!(bits(&together), bits(&backwards), "{set:?}");
        for (p, value) in cloud.points.iter().zip(&together).step_by(17) {
            assert_eq!(bits(&divergence(&cloud.field, &[*p], &stencil, set)), bits(&[*value]), "{set:?}");
        }
    }
}

#[test]
fn an_empty_field_is_uncertain_everywhere() {
    let field = NormalField { centroids: Vec::new(), normals: Vec::new(), loaded: EVERYWHERE };
    let stencil = Stencil { spacing_m: 1.0, offset_m: 2.0, neighbours: 25, side_m: 1.0 };
    for set in InstructionSet::available() {
        assert_eq!(divergence(&field, &[DVec3::ZERO], &stencil, set), [None]);
        assert_eq!(nearest_centroid_m(&field, &[DVec3::ZERO], 1.0, set), [None]);
    }
}
