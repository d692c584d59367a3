//! The kernel's vector steps in AVX-512.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]
#![allow(unsafe_code)]

use super::buffer::Points;
use super::lanes::{Keys, Lanes, MOST, Near, Places, Row};
use super::weights::{FIRST, GUESS, LEAST, ROUND, SECOND, Sums, Weighting, surplus};
use super::{kernel, nearest};
use crate::geometry::DVec3;
use crate::tile::NormalField;
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, BW, DQ and VL, and what comes with them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Avx512(());

impl Avx512 {
    /// The proof, if the processor has them.
    pub(super) fn detect() -> Option<Avx512> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Avx512(()))
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn column(lanes: Avx512, column: &mut kernel::Column<'_, '_>) {
    kernel::work(lanes, column);
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn nearest_run(lanes: Avx512, run: &mut nearest::Run<'_, '_>) {
    nearest::work(lanes, run);
}

/// Sixteen numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there, and so are the numbers.
#[inline(always)]
unsafe fn load(from: *const f32, i: usize) -> __m512 {
    // SAFETY: by this function's contract.
    unsafe { _mm512_loadu_ps(from.add(i)) }
}

/// Squared distance as [`Lanes::keep_near_box`] has it, from a box around the origin.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn square(x: __m512, y: __m512, z: __m512, [hx, hy, hz, offset]: [__m512; 4]) -> __m512 {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let zero = _mm512_setzero_ps();
        let x = _mm512_max_ps(_mm512_sub_ps(_mm512_abs_ps(x), hx), zero);
        let y = _mm512_max_ps(_mm512_sub_ps(_mm512_abs_ps(y), hy), zero);
        let z = _mm512_max_ps(_mm512_sub_ps(_mm512_abs_ps(z), hz), zero);
        let d2 = _mm512_fmadd_ps(x, x, _mm512_fmadd_ps(y, y, _mm512_mul_ps(z, z)));
        let most = _mm512_max_ps(_mm512_max_ps(x, y), z);
        let less = _mm512_max_ps(_mm512_sub_ps(most, offset), _mm512_setzero_ps());
        _mm512_fmadd_ps(less, less, _mm512_fnmadd_ps(most, most, d2))
    }
}

/// [`Lanes::keep_near_box`].
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn keep(all: &Points, kept: &mut Points, origin: [f32; 3], half: [f32; 3], (reach, offset): (f32, f32)) {
    kept.reserve(all.len);
    assert!(all.fits(all.len) && kept.fits(all.len), "room for the candidates and the slack");
    let (xs, ys, zs, ids) = (all.x.as_ptr(), all.y.as_ptr(), all.z.as_ptr(), all.id.as_ptr());
    let (kx, ky, kz, kid) = (kept.x.as_mut_ptr(), kept.y.as_mut_ptr(), kept.z.as_mut_ptr(), kept.id.as_mut_ptr());
    let mut n = 0;
    // SAFETY: the instructions are there by this function's contract. Both `i` and `n` are below `all.len`, and the
    // slack that was asserted is wider than a vector.
    unsafe {
        let [ox, oy, oz] = origin.map(|o| _mm512_set1_ps(o));
        let [hx, hy, hz] = half.map(|h| _mm512_set1_ps(h));
        let half = [hx, hy, hz, _mm512_set1_ps(offset)];
        let limit = _mm512_set1_ps(reach * reach);
        let mut i = 0;
        while i < all.len {
            let x = _mm512_sub_ps(load(xs, i), ox);
            let y = _mm512_sub_ps(load(ys, i), oy);
            let z = _mm512_sub_ps(load(zs, i), oz);
            let mut mask = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(square(x, y, z, half), limit);
            if all.len - i < 16 {
                mask &= (1 << (all.len - i)) - 1;
            }
            // Even where none is kept: a branch would often be guessed wrong.
            _mm512_storeu_ps(kx.add(n), _mm512_maskz_compress_ps(mask, x));
            _mm512_storeu_ps(ky.add(n), _mm512_maskz_compress_ps(mask, y));
            _mm512_storeu_ps(kz.add(n), _mm512_maskz_compress_ps(mask, z));
            let id = _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ids.add(i).cast()));
            _mm512_storeu_si512(kid.add(n).cast(), id);
            n += mask.count_ones() as usize;
            i += 16;
        }
    }
    kept.len = n;
}

/// A row as a vector.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn load_row(row: &Row) -> __m512i {
    // SAFETY: by this function's contract; a row is 64 bytes, aligned.
    unsafe { _mm512_load_si512(row.0.as_ptr().cast()) }
}

/// A vector as a row.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn row(lanes: __m512i) -> Row {
    let mut row = Row([0; 32]);
    // SAFETY: by this function's contract; a row is 64 bytes, aligned.
    unsafe { _mm512_store_si512(row.0.as_mut_ptr().cast(), lanes) };
    row
}

/// 1 for what is negative, else 0. A comparison would go by way of a mask, at twice the cost.
///
/// SAFETY contract: AVX-512 BW is there.
#[inline(always)]
unsafe fn sign(lanes: __m512i) -> __m512i {
    // SAFETY: by this function's contract.
    unsafe { _mm512_srli_epi16::<15>(lanes) }
}

/// 32 numbers, every other four of them in a vector: packing two vectors puts them in order again.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn quarters(of: &[f32; 32]) -> [__m512; 2] {
    // SAFETY: by this function's contract.
    unsafe {
        let (a, b) = (load(of.as_ptr(), 0), load(of.as_ptr(), 16));
        [_mm512_shuffle_f32x4::<0b10_00_10_00>(a, b), _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b)]
    }
}

/// [`super::weights::weight`], 0 for what does not belong.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn weight(belongs: __mmask8, d2: __m512d) -> __m512d {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let x = _mm512_max_pd(d2, _mm512_set1_pd(LEAST));
        let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(x));
        let guess = _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(GUESS as i64), half));
        let t = _mm512_mul_pd(_mm512_mul_pd(x, guess), guess);
        let part = _mm512_fmadd_pd(_mm512_set1_pd(FIRST[2]), t, _mm512_set1_pd(FIRST[1]));
        let y = _mm512_mul_pd(guess, _mm512_fmadd_pd(part, t, _mm512_set1_pd(FIRST[0])));
        let e = _mm512_fnmadd_pd(_mm512_mul_pd(x, y), y, _mm512_set1_pd(1.0));
        let part = _mm512_fmadd_pd(_mm512_set1_pd(SECOND[1]), e, _mm512_set1_pd(SECOND[0]));
        _mm512_maskz_fmadd_pd(belongs, _mm512_mul_pd(y, e), part, y)
    }
}

/// The sums over each of six vectors, the last two twice.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn totals(of: [__m512i; 6]) -> __m512i {
    // SAFETY: by this function's contract.
    unsafe {
        let pair = |a, b| _mm512_add_epi64(_mm512_unpacklo_epi64(a, b), _mm512_unpackhi_epi64(a, b));
        let halves = |a, b| {
            let (even, odd) =
                (_mm512_shuffle_i64x2::<0b10_00_10_00>(a, b), _mm512_shuffle_i64x2::<0b11_01_11_01>(a, b));
            _mm512_add_epi64(even, odd)
        };
        let last = pair(of[4], of[5]);
        halves(halves(pair(of[0], of[1]), pair(of[2], of[3])), halves(last, last))
    }
}

impl Lanes for Avx512 {
    fn column(self, work: &mut kernel::Column<'_, '_>) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { column(self, work) }
    }

    fn nearest_run(self, work: &mut nearest::Run<'_, '_>) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { nearest_run(self, work) }
    }

    #[inline(always)]
    fn keep_near_box(
        self,
        all: &Points,
        centre: [f32; 3],
        half: [f32; 3],
        (reach, offset): (f32, f32),
        kept: &mut Points,
    ) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { keep(all, kept, centre, half, (reach, offset)) };
    }

    #[inline(always)]
    fn rank(self, points: &Points, places: &Places, keys: &mut Keys) {
        assert!(points.fits(points.len), "room for the candidates and the slack");
        let rows = keys.start(points.len).as_mut_ptr();
        let (xs, ys, zs) = (points.x.as_ptr(), points.y.as_ptr(), points.z.as_ptr());
        // SAFETY: `self` proves that the instructions are there. `i + j` is below `points.len`, of which there are rows;
        // `i` is too, and the slack wider than a vector.
        unsafe {
            let ([ax0, ax1], [ay0, ay1]) = (quarters(&places.a[0]), quarters(&places.a[1]));
            let ([az0, az1], [b0, b1]) = (quarters(&places.a[2]), quarters(&places.b));
            let scale = _mm512_set1_ps(places.scale);
            let mut own = [0f32; 16];
            let mut i = 0;
            while i < points.len {
                let (x, y, z) = (load(xs, i), load(ys, i), load(zs, i));
                let d2 = _mm512_fmadd_ps(x, x, _mm512_fmadd_ps(y, y, _mm512_mul_ps(z, z)));
                _mm512_storeu_ps(own.as_mut_ptr(), _mm512_mul_ps(d2, scale));
                for j in 0..16.min(points.len - i) {
                    let own = _mm512_set1_ps(own[j]);
                    let (x, y, z) = (
                        _mm512_set1_ps(*xs.add(i + j)),
                        _mm512_set1_ps(*ys.add(i + j)),
                        _mm512_set1_ps(*zs.add(i + j)),
                    );
                    let rank = |ax, ay, az, b| {
                        let sum = _mm512_fmadd_ps(ay, y, _mm512_fmadd_ps(ax, x, _mm512_add_ps(own, b)));
                        _mm512_cvtps_epi32(_mm512_fmadd_ps(az, z, sum))
                    };
                    let row = _mm512_packs_epi32(rank(ax0, ay0, az0, b0), rank(ax1, ay1, az1, b1));
                    _mm512_storeu_si512(rows.add(i + j).cast(), row);
                }
                i += 16;
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, at: &Row) -> Row {
        // SAFETY: `self` proves that the instructions are there; a row is a whole vector.
        unsafe {
            let at = load_row(at);
            let mut beyond = _mm512_setzero_si512();
            for row in keys.rows() {
                beyond = _mm512_add_epi16(beyond, sign(_mm512_sub_epi16(at, load_row(row))));
            }
            row(_mm512_sub_epi16(_mm512_set1_epi16(keys.rows().len() as i16), beyond))
        }
    }

    #[inline(always)]
    fn count_between(self, keys: &Keys, at: &Row) -> (Row, Row, Row) {
        // SAFETY: `self` proves that the instructions are there; a row is a whole vector.
        unsafe {
            let at = load_row(at);
            // How far ranks are below the threshold: as unsigned numbers, those above it are the largest.
            let (mut beyond, mut least) = (_mm512_setzero_si512(), at);
            let mut most = _mm512_sub_epi16(at, _mm512_set1_epi16(i16::MAX));
            for row in keys.rows() {
                let below = _mm512_sub_epi16(at, load_row(row));
                beyond = _mm512_add_epi16(beyond, sign(below));
                least = _mm512_min_epu16(least, below);
                most = _mm512_max_epu16(most, below);
            }
            let counts = _mm512_sub_epi16(_mm512_set1_epi16(keys.rows().len() as i16), beyond);
            let above = _mm512_sub_epi16(_mm512_sub_epi16(at, most), _mm512_set1_epi16(1));
            (row(counts), row(_mm512_sub_epi16(at, least)), row(above))
        }
    }

    #[inline(always)]
    fn members(self, keys: &Keys, at: &Row, of: &mut [u32]) -> (u32, Row) {
        // SAFETY: `self` proves that the instructions are there; a row is a whole vector.
        unsafe {
            let at = load_row(at);
            let (mut beyond, mut least) = (_mm512_setzero_si512(), _mm512_set1_epi16(-1));
            for (row, of) in keys.rows().iter().zip(of) {
                let below = _mm512_sub_epi16(at, load_row(row));
                *of = !_mm512_movepi16_mask(below);
                beyond = _mm512_add_epi16(beyond, sign(below));
                least = _mm512_min_epu16(least, below);
            }
            let counts = _mm512_sub_epi16(_mm512_set1_epi16(keys.rows().len() as i16), beyond);
            (_mm512_testn_epi16_mask(least, least), row(counts))
        }
    }

    #[inline(always)]
    fn choose(self, points: &Points, of: &[u32], bits: u32, near: &mut Near) {
        let len = points.len;
        assert!(len <= MOST && points.id.len() >= len + 16 && of.len() >= len + 16, "room for the candidates");
        assert!(near.id.len() >= MOST + 16 && near.of.len() >= MOST + 16, "room for those chosen");
        let (ids, of, to_id, to_of) = (points.id.as_ptr(), of.as_ptr(), near.id.as_mut_ptr(), near.of.as_mut_ptr());
        let mut n = 0;
        // SAFETY: `self` proves that the instructions are there. `i` and `n` are at most `MOST`, and 16 more are there.
        unsafe {
            let bits = _mm512_set1_epi32(bits as i32);
            let mut i = 0;
            while i < len {
                let of = _mm512_loadu_si512(of.add(i).cast());
                let mask = _mm512_test_epi32_mask(of, bits);
                let id = _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ids.add(i).cast()));
                _mm512_storeu_si512(to_id.add(n).cast(), id);
                _mm512_storeu_si512(to_of.add(n).cast(), _mm512_maskz_compress_epi32(mask, of));
                n += mask.count_ones() as usize;
                i += 16;
            }
        }
        near.len = n;
    }

    #[inline(always)]
    fn sums(self, field: &NormalField, vertex: DVec3, near: &mut Near, weighting: &Weighting) -> Sums {
        let triangles = field.centroids.len().min(field.normals.len());
        let len = near.len;
        assert!(len <= MOST && near.id.len() >= MOST + 8 && near.of.len() >= MOST + 8, "whole vectors of neighbours");
        // SAFETY: `self` proves that the instructions are there; `i` is below `len`, and vectors end in the slack. Only
        // numbers below `triangles` are gathered, and a `DVec3` is three `f64` in a row.
        unsafe {
            let vertex = vertex.to_array().map(|v| _mm512_set1_pd(v));
            let (offset_m2, per_m2) = (_mm512_set1_pd(weighting.offset_m2), _mm512_set1_pd(weighting.per_m2));
            let twice = _mm512_set1_pd(weighting.twice_per_m);
            let round = _mm512_set1_pd(ROUND);
            let (centroids, normals) = (field.centroids.as_ptr().cast::<f64>(), field.normals.as_ptr().cast::<f64>());
            let (most, zero) = (_mm512_set1_epi64(triangles as i64), _mm512_setzero_pd());
            let (mut weighted, mut weights) = ([_mm512_setzero_si512(); 6], [_mm512_setzero_si512(); 6]);
            let mut i = 0;
            while i < len {
                let id = _mm512_cvtepu32_epi64(_mm256_loadu_si256(near.id.as_ptr().add(i).cast()));
                let of = _mm512_cvtepu32_epi64(_mm256_loadu_si256(near.of.as_ptr().add(i).cast()));
                let known = _mm512_cmplt_epi64_mask(id, most);
                let at = _mm512_add_epi64(id, _mm512_add_epi64(id, id));
                let (mut u, mut normal) = ([zero; 3], [zero; 3]);
                for axis in 0..3 {
                    let place = _mm512_mask_i64gather_pd::<8>(zero, known, at, centroids.add(axis));
                    normal[axis] = _mm512_mask_i64gather_pd::<8>(zero, known, at, normals.add(axis));
                    u[axis] = _mm512_sub_pd(place, vertex[axis]);
                }
                let middle = u.iter().rev().fold(offset_m2, |sum, &u| _mm512_fmadd_pd(u, u, sum));
                let middle = _mm512_mul_pd(middle, per_m2);
                for q in 0..6 {
                    let u = u[q / 2];
                    let belongs = _mm512_test_epi64_mask(of, _mm512_set1_epi64(1 << (near.shift + q)));
                    let positive = q % 2 == 0;
                    let d2 =
                        if positive { _mm512_fnmadd_pd(twice, u, middle) } else { _mm512_fmadd_pd(twice, u, middle) };
                    let w = weight(belongs, d2);
                    let part = _mm512_fmadd_pd(w, normal[q / 2], round);
                    weighted[q] = _mm512_add_epi64(weighted[q], _mm512_castpd_si512(part));
                    weights[q] = _mm512_add_epi64(weights[q], _mm512_castpd_si512(_mm512_add_pd(w, round)));
                }
                i += 8;
            }
            let surplus = _mm512_set1_epi64(surplus(len.next_multiple_of(8)));
            let mut sums = Sums::default();
            let (to_weighted, to_weights) = (sums.weighted.as_mut_ptr(), sums.weights.as_mut_ptr());
            _mm512_store_si512(to_weighted.cast(), _mm512_sub_epi64(totals(weighted), surplus));
            _mm512_store_si512(to_weights.cast(), _mm512_sub_epi64(totals(weights), surplus));
            sums
        }
    }
}
