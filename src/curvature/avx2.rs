//! The kernel's vector steps in AVX2.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]
#![allow(unsafe_code)]

use super::buffer::Points;
use super::lanes::{IN_ORDER, Keys, Lanes, MOST, Near, Places, Row, fetch};
use super::weights::{FIRST, GUESS, LEAST, ROUND, SECOND, Sums, Weighting, surplus};
use super::{kernel, nearest};
use crate::geometry::DVec3;
use crate::tile::NormalField;
use std::arch::x86_64::*;

/// Proof that the processor has AVX2, FMA, BMI2 and what comes with them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Avx2(());

impl Avx2 {
    /// The proof, if the processor has them.
    pub(super) fn detect() -> Option<Avx2> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Avx2(()))
    }
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn column(lanes: Avx2, column: &mut kernel::Column<'_, '_>) {
    kernel::work(lanes, column);
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn nearest_run(lanes: Avx2, run: &mut nearest::Run<'_, '_>) {
    nearest::work(lanes, run);
}

/// Eight numbers from `i` on.
///
/// SAFETY contract: AVX is there, and so are the numbers.
#[inline(always)]
unsafe fn load(from: *const f32, i: usize) -> __m256 {
    // SAFETY: by this function's contract.
    unsafe { _mm256_loadu_ps(from.add(i)) }
}

/// Four numbers from `i` on.
///
/// SAFETY contract: AVX is there, and so are the numbers.
#[inline(always)]
unsafe fn load_f64(from: *const f64, i: usize) -> __m256d {
    // SAFETY: by this function's contract.
    unsafe { _mm256_loadu_pd(from.add(i)) }
}

/// Squared distance as [`Lanes::keep_near_box`] has it, from a box around the origin.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn square(x: __m256, y: __m256, z: __m256, [hx, hy, hz, offset]: [__m256; 4]) -> __m256 {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let zero = _mm256_setzero_ps();
        let x = _mm256_max_ps(_mm256_sub_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0), x), hx), zero);
        let y = _mm256_max_ps(_mm256_sub_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0), y), hy), zero);
        let z = _mm256_max_ps(_mm256_sub_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0), z), hz), zero);
        let d2 = _mm256_fmadd_ps(x, x, _mm256_fmadd_ps(y, y, _mm256_mul_ps(z, z)));
        let most = _mm256_max_ps(_mm256_max_ps(x, y), z);
        let less = _mm256_max_ps(_mm256_sub_ps(most, offset), _mm256_setzero_ps());
        _mm256_fmadd_ps(less, less, _mm256_fnmadd_ps(most, most, d2))
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
        let [ox, oy, oz] = origin.map(|o| _mm256_set1_ps(o));
        let [hx, hy, hz] = half.map(|h| _mm256_set1_ps(h));
        let half = [hx, hy, hz, _mm256_set1_ps(offset)];
        let limit = _mm256_set1_ps(reach * reach);
        let mut i = 0;
        while i < all.len {
            let x = _mm256_sub_ps(load(xs, i), ox);
            let y = _mm256_sub_ps(load(ys, i), oy);
            let z = _mm256_sub_ps(load(zs, i), oz);
            let mut mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(square(x, y, z, half), limit)) as usize;
            if all.len - i < 8 {
                mask &= (1 << (all.len - i)) - 1;
            }
            // Even where none is kept: a branch would often be guessed wrong.
            let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(IN_ORDER[mask] as i64));
            _mm256_storeu_ps(kx.add(n), _mm256_permutevar8x32_ps(x, order));
            _mm256_storeu_ps(ky.add(n), _mm256_permutevar8x32_ps(y, order));
            _mm256_storeu_ps(kz.add(n), _mm256_permutevar8x32_ps(z, order));
            let id = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(ids.add(i).cast()), order);
            _mm256_storeu_si256(kid.add(n).cast(), id);
            n += mask.count_ones() as usize;
            i += 8;
        }
    }
    kept.len = n;
}

/// A row as two vectors.
///
/// SAFETY contract: AVX is there.
#[inline(always)]
unsafe fn load_row(row: &Row) -> [__m256i; 2] {
    let from = row.0.as_ptr().cast::<__m256i>();
    // SAFETY: by this function's contract; a row is 64 bytes, aligned.
    unsafe { [_mm256_load_si256(from), _mm256_load_si256(from.add(1))] }
}

/// Two vectors as a row.
///
/// SAFETY contract: AVX is there.
#[inline(always)]
unsafe fn row(lanes: [__m256i; 2]) -> Row {
    let mut row = Row([0; 32]);
    let to = row.0.as_mut_ptr().cast::<__m256i>();
    // SAFETY: by this function's contract; a row is 64 bytes, aligned.
    unsafe {
        _mm256_store_si256(to, lanes[0]);
        _mm256_store_si256(to.add(1), lanes[1]);
    }
    row
}

/// One bit for each rank of a row, set where all bits of the rank's lane are.
///
/// SAFETY contract: AVX2 is there.
#[inline(always)]
unsafe fn bits(lanes: [__m256i; 2]) -> u32 {
    // SAFETY: by this function's contract.
    unsafe {
        // Packing works within halves of a vector; this puts their parts in order.
        let packed = _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_packs_epi16(lanes[0], lanes[1]));
        _mm256_movemask_epi8(packed) as u32
    }
}

/// Half of 32 numbers, every other four of them in a vector: packing two vectors puts them in order again.
///
/// SAFETY contract: AVX is there.
#[inline(always)]
unsafe fn quarters(of: &[f32; 32], half: usize) -> [__m256; 2] {
    // SAFETY: by this function's contract; `half` is 0 or 1.
    unsafe {
        let (a, b) = (load(of.as_ptr(), 16 * half), load(of.as_ptr(), 16 * half + 8));
        [_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b)]
    }
}

/// [`super::weights::weight`].
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn weight(d2: __m256d) -> __m256d {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let x = _mm256_max_pd(d2, _mm256_set1_pd(LEAST));
        let half = _mm256_srli_epi64::<1>(_mm256_castpd_si256(x));
        let guess = _mm256_castsi256_pd(_mm256_sub_epi64(_mm256_set1_epi64x(GUESS as i64), half));
        let t = _mm256_mul_pd(_mm256_mul_pd(x, guess), guess);
        let part = _mm256_fmadd_pd(_mm256_set1_pd(FIRST[2]), t, _mm256_set1_pd(FIRST[1]));
        let y = _mm256_mul_pd(guess, _mm256_fmadd_pd(part, t, _mm256_set1_pd(FIRST[0])));
        let e = _mm256_fnmadd_pd(_mm256_mul_pd(x, y), y, _mm256_set1_pd(1.0));
        let part = _mm256_fmadd_pd(_mm256_set1_pd(SECOND[1]), e, _mm256_set1_pd(SECOND[0]));
        _mm256_fmadd_pd(_mm256_mul_pd(y, e), part, y)
    }
}

/// The sum of four integers.
///
/// SAFETY contract: AVX is there.
#[inline(always)]
unsafe fn total(lanes: __m256i) -> i64 {
    let mut each = [0i64; 4];
    // SAFETY: the array holds the 32 bytes that are written.
    unsafe { _mm256_storeu_si256(each.as_mut_ptr().cast(), lanes) };
    each[0].wrapping_add(each[1]).wrapping_add(each[2].wrapping_add(each[3]))
}

impl Lanes for Avx2 {
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
        // `i` is too, and the slack wider than a vector. A row is two vectors.
        unsafe {
            let scale = _mm256_set1_ps(places.scale);
            let mut own = [0f32; 8];
            for half in 0..2 {
                let ([ax0, ax1], [ay0, ay1]) = (quarters(&places.a[0], half), quarters(&places.a[1], half));
                let ([az0, az1], [b0, b1]) = (quarters(&places.a[2], half), quarters(&places.b, half));
                let mut i = 0;
                while i < points.len {
                    let (x, y, z) = (load(xs, i), load(ys, i), load(zs, i));
                    let d2 = _mm256_fmadd_ps(x, x, _mm256_fmadd_ps(y, y, _mm256_mul_ps(z, z)));
                    _mm256_storeu_ps(own.as_mut_ptr(), _mm256_mul_ps(d2, scale));
                    for j in 0..8.min(points.len - i) {
                        let own = _mm256_set1_ps(own[j]);
                        let (x, y, z) = (
                            _mm256_set1_ps(*xs.add(i + j)),
                            _mm256_set1_ps(*ys.add(i + j)),
                            _mm256_set1_ps(*zs.add(i + j)),
                        );
                        let rank = |ax, ay, az, b| {
                            let sum = _mm256_fmadd_ps(ay, y, _mm256_fmadd_ps(ax, x, _mm256_add_ps(own, b)));
                            _mm256_cvtps_epi32(_mm256_fmadd_ps(az, z, sum))
                        };
                        let ranks = _mm256_packs_epi32(rank(ax0, ay0, az0, b0), rank(ax1, ay1, az1, b1));
                        _mm256_storeu_si256(rows.add(i + j).cast::<__m256i>().add(half), ranks);
                    }
                    i += 8;
                }
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, at: &Row) -> Row {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let at = load_row(at).map(|t| _mm256_add_epi16(t, _mm256_set1_epi16(1)));
            let mut counts = [_mm256_setzero_si256(); 2];
            for row in keys.rows() {
                let rank = load_row(row);
                for h in 0..2 {
                    counts[h] = _mm256_sub_epi16(counts[h], _mm256_cmpgt_epi16(at[h], rank[h]));
                }
            }
            row(counts)
        }
    }

    #[inline(always)]
    fn count_between(self, keys: &Keys, at: &Row) -> (Row, Row, Row) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let at = load_row(at);
            // How far ranks are below the threshold: as unsigned numbers, those above it are the largest.
            let (mut beyond, mut least) = ([_mm256_setzero_si256(); 2], at);
            let mut most = at.map(|t| _mm256_sub_epi16(t, _mm256_set1_epi16(i16::MAX)));
            for row in keys.rows() {
                let rank = load_row(row);
                for h in 0..2 {
                    let below = _mm256_sub_epi16(at[h], rank[h]);
                    beyond[h] = _mm256_add_epi16(beyond[h], _mm256_srli_epi16::<15>(below));
                    least[h] = _mm256_min_epu16(least[h], below);
                    most[h] = _mm256_max_epu16(most[h], below);
                }
            }
            let all = _mm256_set1_epi16(keys.rows().len() as i16);
            let (mut below, mut above) = (at, at);
            for h in 0..2 {
                below[h] = _mm256_sub_epi16(at[h], least[h]);
                above[h] = _mm256_sub_epi16(_mm256_sub_epi16(at[h], most[h]), _mm256_set1_epi16(1));
            }
            (row(beyond.map(|b| _mm256_sub_epi16(all, b))), row(below), row(above))
        }
    }

    #[inline(always)]
    fn members(self, keys: &Keys, at: &Row, of: &mut [u32]) -> (u32, Row) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let at = load_row(at);
            let (mut beyond, mut equal) = ([_mm256_setzero_si256(); 2], [_mm256_setzero_si256(); 2]);
            for (row, of) in keys.rows().iter().zip(of) {
                let rank = load_row(row);
                let above = [_mm256_cmpgt_epi16(rank[0], at[0]), _mm256_cmpgt_epi16(rank[1], at[1])];
                *of = !bits(above);
                for h in 0..2 {
                    beyond[h] = _mm256_sub_epi16(beyond[h], above[h]);
                    equal[h] = _mm256_or_si256(equal[h], _mm256_cmpeq_epi16(rank[h], at[h]));
                }
            }
            let all = _mm256_set1_epi16(keys.rows().len() as i16);
            (bits(equal), row(beyond.map(|b| _mm256_sub_epi16(all, b))))
        }
    }

    #[inline(always)]
    fn choose(self, points: &Points, of: &[u32], bits: u32, near: &mut Near) {
        let len = points.len;
        assert!(len <= MOST && points.id.len() >= len + 8 && of.len() >= len + 8, "room for the candidates");
        assert!(near.id.len() >= MOST + 8 && near.of.len() >= MOST + 8, "room for those chosen");
        let (ids, of, to_id, to_of) = (points.id.as_ptr(), of.as_ptr(), near.id.as_mut_ptr(), near.of.as_mut_ptr());
        let mut n = 0;
        // SAFETY: `self` proves that the instructions are there. `i` and `n` are at most `MOST`, and 8 more are there.
        unsafe {
            let bits = _mm256_set1_epi32(bits as i32);
            let mut i = 0;
            while i < len {
                let of = _mm256_loadu_si256(of.add(i).cast());
                let none = _mm256_cmpeq_epi32(_mm256_and_si256(of, bits), _mm256_setzero_si256());
                let mask = (!_mm256_movemask_ps(_mm256_castsi256_ps(none)) & 255) as usize;
                let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(IN_ORDER[mask] as i64));
                let id = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(ids.add(i).cast()), order);
                _mm256_storeu_si256(to_id.add(n).cast(), id);
                _mm256_storeu_si256(to_of.add(n).cast(), _mm256_permutevar8x32_epi32(of, order));
                n += mask.count_ones() as usize;
                i += 8;
            }
        }
        near.len = n;
    }

    #[inline(always)]
    fn sums(self, field: &NormalField, vertex: DVec3, near: &mut Near, weighting: &Weighting) -> Sums {
        fetch(field, vertex, near);
        let mut result = Sums::default();
        assert!(
            near.len <= MOST && near.value.len() >= 6 * MOST && near.of.len() >= MOST,
            "whole vectors of neighbours"
        );
        let value = near.value.as_ptr();
        // SAFETY: `self` proves that the instructions are there; `i` is below `near.len`, and `MOST` a multiple of the
        // lanes.
        unsafe {
            let (offset_m2, per_m2) = (_mm256_set1_pd(weighting.offset_m2), _mm256_set1_pd(weighting.per_m2));
            let twice = _mm256_set1_pd(weighting.twice_per_m);
            let round = _mm256_set1_pd(ROUND);
            let surplus = surplus(near.len.next_multiple_of(4));
            // One axis at a time, since the registers hold no more.
            for axis in 0..3 {
                let mut sums = [[_mm256_setzero_si256(); 2]; 2];
                let mut i = 0;
                while i < near.len {
                    let u = [0, 1, 2].map(|axis| load_f64(value, axis * MOST + i));
                    let middle = u.iter().rev().fold(offset_m2, |sum, &u| _mm256_fmadd_pd(u, u, sum));
                    let middle = _mm256_mul_pd(middle, per_m2);
                    let u = u[axis];
                    let normal = load_f64(value, (3 + axis) * MOST + i);
                    let of = _mm256_cvtepu32_epi64(_mm_loadu_si128(near.of.as_ptr().add(i).cast()));
                    for side in 0..2 {
                        let bit = _mm256_set1_epi64x(1 << (near.shift + 2 * axis + side));
                        let belongs = _mm256_cmpeq_epi64(_mm256_and_si256(of, bit), bit);
                        let positive = side == 0;
                        let d2 = if positive {
                            _mm256_fnmadd_pd(twice, u, middle)
                        } else {
                            _mm256_fmadd_pd(twice, u, middle)
                        };
                        let w = _mm256_and_pd(weight(d2), _mm256_castsi256_pd(belongs));
                        let weighted = _mm256_castpd_si256(_mm256_fmadd_pd(w, normal, round));
                        let weights = _mm256_castpd_si256(_mm256_add_pd(w, round));
                        let [sum_n, sum] = sums[side];
                        sums[side] = [_mm256_add_epi64(sum_n, weighted), _mm256_add_epi64(sum, weights)];
                    }
                    i += 4;
                }
                for side in 0..2 {
                    let q = 2 * axis + side;
                    result.weighted[q] = total(sums[side][0]).wrapping_sub(surplus);
                    result.weights[q] = total(sums[side][1]).wrapping_sub(surplus);
                }
            }
        }
        result
    }
}
