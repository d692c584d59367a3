//! What a tile found as bytes, so that a run can be resumed, and back, bit for bit.
//!
//! The bytes are a format number and then postcard's: whole numbers take as many bytes as they need, an
//! `f64` takes its eight. They carry no checksum, since whoever keeps them must know anyhow that they are
//! whole; bytes that were changed give an error or another finding, those that were cut off an error.

use super::TileFinding;

/// First byte of every record. It must change when a field of [`TileFinding`] or of what it holds does, and
/// when the same surface gives other figures.
const FORMAT: u8 = 3;

/// Bytes that hold no finding.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// Written by a version with other fields.
    #[error(
        "the record of a tile has format {found}, but this program reads format {FORMAT}\nhelp: resume with the version that wrote it, or start again"
    )]
    Format {
        /// The format.
        found: u8,
    },
    /// The bytes end too early or mean nothing.
    #[error("the record of a tile, {bytes} bytes, is damaged: {source}\nhelp: start the run again without its records")]
    Damaged {
        /// Length of the record.
        bytes: usize,
        /// What is wrong with it.
        source: postcard::Error,
    },
    /// The bytes go on after the finding.
    #[error(
        "the record of a tile, {bytes} bytes, goes on for {surplus} bytes after its end\nhelp: start the run again without its records"
    )]
    Surplus {
        /// Length of the record.
        bytes: usize,
        /// How many are too many.
        surplus: usize,
    },
    /// A finding that cannot be put into bytes.
    #[error("the finding of tile {tile} cannot be recorded: {source}\nhelp: this is a bug; please report it")]
    Unwritable {
        /// The tile.
        tile: u64,
        /// Why.
        source: postcard::Error,
    },
}

impl TileFinding {
    /// The finding as bytes.
    ///
    /// # Errors
    /// None is known.
    pub fn to_record(&self) -> Result<Vec<u8>, RecordError> {
        postcard::to_extend(self, vec![FORMAT])
            .map_err(|source| RecordError::Unwritable { tile: self.report.tile, source })
    }

    /// The finding that [`TileFinding::to_record`] made these bytes of. Takes memory in proportion to the
    /// bytes, whatever they say.
    ///
    /// # Errors
    /// The bytes are of another format, or damaged, or not all of them were used.
    pub fn from_record(record: &[u8]) -> Result<TileFinding, RecordError> {
        let bytes = record.len();
        let damaged = |source| RecordError::Damaged { bytes, source };
        let rest = match record.split_first() {
            Some((&FORMAT, rest)) => rest,
            Some((&found, _)) => return Err(RecordError::Format { found }),
            None => return Err(damaged(postcard::Error::DeserializeUnexpectedEnd)),
        };
        match postcard::take_from_bytes(rest).map_err(damaged)? {
            (finding, []) => Ok(finding),
            (_, surplus) => Err(RecordError::Surplus { bytes, surplus: surplus.len() }),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::geometry::{DVec3, ExactSum, PlanBox};
    use crate::measure::{Completed, Grain};
    use crate::segment::{Evidence, OversizePiece};
    use crate::stitch::TileReport;
    use proptest::collection::vec;
    use proptest::option;
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;

    fn number() -> impl Strategy<Value = f64> {
        let odd = vec![0.0, -0.0, 1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MIN_POSITIVE / 4.0, f64::MAX];
        prop_oneof![any::<u64>().prop_map(f64::from_bits), proptest::sample::select(odd), -1e3..1e3f64]
    }

    fn whole_number() -> impl Strategy<Value = u64> {
        prop_oneof![any::<u64>(), 0..300u64, Just(u64::MAX)]
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        [number(), number(), number()].prop_map(DVec3::from_array)
    }

    fn plan_box() -> impl Strategy<Value = PlanBox> {
        [number(), number(), number(), number()].prop_map(|[a, b, c, d]| PlanBox { min: [a, b], max: [c, d] })
    }

    fn three() -> impl Strategy<Value = [f64; 3]> {
        [number(), number(), number()]
    }

    fn completed() -> impl Strategy<Value = Completed> {
        (three(), [number(), number()], any::<bool>()).prop_map(|(axes_m, [c_error_m, seen_share], c_from_prior)| {
            Completed { axes_m, c_error_m, seen_share, c_from_prior }
        })
    }

    fn evidence() -> impl Strategy<Value = Evidence> {
        ([number(), number(), number(), number()], any::<u32>()).prop_map(
            |([rim_bend, free_rim, bulge, core_share], patches)| Evidence {
                rim_bend,
                free_rim,
                bulge,
                core_share,
                patches,
            },
        )
    }

    fn grain() -> impl Strategy<Value = Grain> {
        let outline = vec(vec(vec(any::<[i64; 2]>(), 0..5), 0..4), 0..3);
        (
            [whole_number(), whole_number(), whole_number()],
            ([vector(), vector(), vector(), vector()], three(), [number(), number(), number(), number(), number()]),
            (option::of(three()), option::of(three()), option::of(three()), option::of(completed())),
            (any::<bool>(), outline, vec(whole_number(), 0..20), option::of(evidence())),
        )
            .prop_map(|([anchor, triangles, vertices], (vectors, axes_m, scalars), optional, rest)| Grain {
                anchor,
                triangles,
                vertices,
                centroid: vectors[0],
                top_z: scalars[0],
                axes_m,
                directions: [vectors[1], vectors[2], vectors[3]],
                ellipsoid_axes_m: optional.0,
                completed: optional.3,
                surface_area_m2: scalars[1],
                hull_area_m2: scalars[2],
                hull_volume_m3: scalars[3],
                footprint_area_m2: scalars[4],
                color_mean: optional.1,
                color_std: optional.2,
                touches_edge: rest.0,
                evidence: rest.3,
                outline: rest.1,
                triangle_ids: rest.2,
            })
    }

    /// Sums of terms of very different size, up to the largest that a sum may hold.
    fn exact_sum() -> impl Strategy<Value = ExactSum> {
        vec(prop_oneof![-1e9..1e9f64, -1e-15..1e-15f64, Just(-4.6e18), Just(4.6e18)], 0..2).prop_map(|terms| {
            let mut sum = ExactSum::ZERO;
            terms.into_iter().for_each(|t| sum.add(t));
            sum
        })
    }

    fn piece() -> impl Strategy<Value = OversizePiece> {
        let crossings = vec([whole_number(), whole_number()], 0..8);
        (whole_number(), whole_number(), exact_sum(), option::of(plan_box()), crossings).prop_map(
            |(anchor, triangles, area_m2, bounds, crossings)| OversizePiece {
                anchor,
                triangles,
                area_m2,
                bounds,
                crossings,
            },
        )
    }

    fn report() -> impl Strategy<Value = TileReport> {
        ([whole_number(), whole_number(), whole_number(), whole_number()], plan_box(), any::<u32>()).prop_map(
            |([tile, core_triangles, segmented_triangles, grains], core, attempts)| TileReport {
                tile,
                core,
                core_triangles,
                segmented_triangles,
                attempts,
                grains,
            },
        )
    }

    fn finding() -> impl Strategy<Value = TileFinding> {
        (vec(grain(), 0..4), vec(piece(), 0..4), report()).prop_map(|(grains, oversize, report)| TileFinding {
            grains,
            oversize,
            report,
        })
    }

    /// Every number with all its bits (but a NaN's payload): Rust prints the shortest text that reads back.
    fn text(finding: &TileFinding) -> String {
        format!("{finding:?}")
    }

    fn bits_of_all_floats(finding: &TileFinding) -> Vec<u64> {
        let boxed = |b: &PlanBox| [b.min[0], b.min[1], b.max[0], b.max[1]];
        let mut all = boxed(&finding.report.core).to_vec();
        all.extend(finding.oversize.iter().filter_map(|p| p.bounds.as_ref()).flat_map(boxed));
        for g in &finding.grains {
            all.extend(
                [g.centroid, g.directions[0], g.directions[1], g.directions[2]].iter().flat_map(DVec3::to_array),
            );
            all.extend([g.top_z, g.surface_area_m2, g.hull_area_m2, g.hull_volume_m3, g.footprint_area_m2]);
            all.extend(g.axes_m);
            if let Some(c) = &g.completed {
                all.extend(c.axes_m);
                all.extend([c.c_error_m, c.seen_share]);
            }
            all.extend([g.ellipsoid_axes_m, g.color_mean, g.color_std].iter().flatten().flatten());
            let of = |e: Evidence| [e.rim_bend, e.free_rim, e.bulge, e.core_share];
            all.extend(g.evidence.map(of).iter().flatten());
        }
        all.into_iter().map(f64::to_bits).collect()
    }

    fn largest() -> TileFinding {
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let findings = (0..200).map(|_| finding().new_tree(&mut runner).unwrap().current());
        findings.max_by_key(|f| f.to_record().unwrap().len()).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_finding_survives_bit_for_bit(finding in finding()) {
            let record = finding.to_record().unwrap();
            let back = TileFinding::from_record(&record).unwrap();
            prop_assert_eq!(text(&back), text(&finding));
            prop_assert_eq!(bits_of_all_floats(&back), bits_of_all_floats(&finding));
            prop_assert_eq!(back.to_record().unwrap(), record);
        }

        #[test]
        fn changed_bytes_give_an_error_or_another_finding_and_never_a_panic(
            finding in finding(),
            changes in vec((any::<proptest::sample::Index>(), 1u8..), 1..4),
        ) {
            let mut record = finding.to_record().unwrap();
            let whole = record.clone();
            changes.iter().for_each(|(at, by)| record[at.index(whole.len())] ^= by);
            if let Ok(back) = TileFinding::from_record(&record) {
                prop_assert!(record == whole || back.to_record().unwrap() != whole, "a change went unseen");
            }
        }

        #[test]
        fn random_bytes_never_panic(mut bytes in vec(any::<u8>(), 0..400), good_start in any::<bool>()) {
            if good_start && !bytes.is_empty() {
                bytes[0] = FORMAT;
            }
            let _ = TileFinding::from_record(&bytes);
        }
    }

    #[test]
    fn a_record_cut_off_or_prolonged_anywhere_is_an_error() {
        let record = largest().to_record().unwrap();
        assert!(record.len() > 1000, "{}", record.len());
        for length in 0..record.len() {
            let error = TileFinding::from_record(&record[..length]).unwrap_err();
            assert!(matches!(error, RecordError::Damaged { bytes, .. } if bytes == length), "{length}: {error}");
        }
        let error = TileFinding::from_record(&[&record[..], &[0, 0]].concat()).unwrap_err();
        assert!(matches!(error, RecordError::Surplus { surplus: 2, .. }), "{error}");
        assert!(error.to_string().contains("\nhelp: "));
    }

    #[test]
    fn a_record_of_another_format_is_refused() {
        let mut record = largest().to_record().unwrap();
        record[0] = 9;
        assert!(matches!(TileFinding::from_record(&record), Err(RecordError::Format { found: 9 })));
    }

    #[test]
    fn counts_far_beyond_the_bytes_are_refused_without_taking_memory() {
        // The first number is the count of grains: 2^63 of them would end the process.
        let mut bytes = vec![FORMAT];
        bytes.extend([0xff; 9]);
        bytes.push(1);
        bytes.resize(5000, 0xff);
        assert!(matches!(TileFinding::from_record(&bytes), Err(RecordError::Damaged { .. })));
    }

    #[test]
    fn the_whole_range_of_an_exact_sum_survives() {
        for sum in [i128::MAX, i128::MIN, -1, 0, 1 << 100] {
            let bytes = postcard::to_allocvec(&sum).unwrap();
            let back: ExactSum = postcard::from_bytes(&bytes).unwrap();
            assert_eq!(postcard::to_allocvec(&back).unwrap(), bytes);
            assert_eq!(back.value(), sum as f64 / 2f64.powi(64));
        }
    }
}
