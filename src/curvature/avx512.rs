//! The kernel's vector steps in AVX-512.
#![allow(unsafe_code)]

use super::buffer::Points;
use super::lanes::{Keys, Lanes, MOST, Near, Set};
use super::thresholds::Thresholds;
use super::weights::{FIRST, GUESS, ROUND, SECOND, Sum, Weighting};
use super::{kernel, nearest};
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, BW, DQ and VL, and what comes with them.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

impl Avx512 {
    /// The proof, if the processor has them.
    pub fn detect() -> Option<Avx512> {
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
fn nearest_column(lanes: Avx512, column: &mut nearest::Column<'_, '_>) {
    nearest::work(lanes, column);
}

/// Sixteen numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn load(from: &[f32], i: usize) -> __m512 {
    let lanes: &[f32; 16] = from[i..i + 16].try_into().expect("sixteen");
    // SAFETY: the array holds the 64 bytes that are read.
    unsafe { _mm512_loadu_ps(lanes.as_ptr()) }
}

/// Thirty-two ranks from `i` on.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn load_ranks(from: &[u16], i: usize) -> __m512i {
    let lanes: &[u16; 32] = from[i..i + 32].try_into().expect("thirty-two");
    // SAFETY: the array holds the 64 bytes that are read.
    unsafe { _mm512_loadu_si512(lanes.as_ptr().cast()) }
}

/// Eight numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn load_f64(from: &[f64], i: usize) -> __m512d {
    let lanes: &[f64; 8] = from[i..i + 8].try_into().expect("eight");
    // SAFETY: the array holds the 64 bytes that are read.
    unsafe { _mm512_loadu_pd(lanes.as_ptr()) }
}

/// Writes sixteen numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there.
#[inline(always)]
unsafe fn store(to: &mut [f32], i: usize, value: __m512) {
    let lanes: &mut [f32; 16] = (&mut to[i..i + 16]).try_into().expect("sixteen");
    // SAFETY: the array holds the 64 bytes that are written.
    unsafe { _mm512_storeu_ps(lanes.as_mut_ptr(), value) }
}

/// Keeps the candidates that `near` accepts, less `origin`.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn keep(
    all: &Points,
    kept: &mut Points,
    origin: [f32; 3],
    near: impl Fn(__m512, __m512, __m512) -> __mmask16,
) {
    kept.reserve(all.len);
    let mut n = 0;
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let [ox, oy, oz] = origin.map(|o| _mm512_set1_ps(o));
        let mut i = 0;
        while i < all.len {
            let x = _mm512_sub_ps(load(&all.x, i), ox);
            let y = _mm512_sub_ps(load(&all.y, i), oy);
            let z = _mm512_sub_ps(load(&all.z, i), oz);
            let mut mask = near(x, y, z);
            if all.len - i < 16 {
                mask &= (1 << (all.len - i)) - 1;
            }
            if mask != 0 {
                store(&mut kept.x, n, _mm512_maskz_compress_ps(mask, x));
                store(&mut kept.y, n, _mm512_maskz_compress_ps(mask, y));
                store(&mut kept.z, n, _mm512_maskz_compress_ps(mask, z));
                let id: &[u32; 16] = all.id[i..i + 16].try_into().expect("sixteen");
                let id = _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(id.as_ptr().cast()));
                let to: &mut [u32; 16] = (&mut kept.id[n..n + 16]).try_into().expect("sixteen");
                _mm512_storeu_si512(to.as_mut_ptr().cast(), id);
                n += mask.count_ones() as usize;
            }
            i += 16;
        }
    }
    kept.len = n;
}

impl Lanes for Avx512 {
    fn column(self, work: &mut kernel::Column<'_, '_>) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { column(self, work) }
    }

    fn nearest_column(self, work: &mut nearest::Column<'_, '_>) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { nearest_column(self, work) }
    }

    #[inline(always)]
    fn keep_near_box(self, all: &Points, centre: [f32; 3], half: [f32; 3], limit: f32, kept: &mut Points) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let ([cx, cy, cz], [hx, hy, hz]) = (centre.map(|c| _mm512_set1_ps(c)), half.map(|h| _mm512_set1_ps(h)));
            let limit = _mm512_set1_ps(limit);
            let beyond = |x, c, h| _mm512_max_ps(_mm512_sub_ps(_mm512_abs_ps(_mm512_sub_ps(x, c)), h), _mm512_setzero_ps());
            keep(all, kept, [0.0; 3], |x, y, z| {
                let (x, y, z) = (beyond(x, cx, hx), beyond(y, cy, hy), beyond(z, cz, hz));
                let d2 = _mm512_fmadd_ps(x, x, _mm512_fmadd_ps(y, y, _mm512_mul_ps(z, z)));
                _mm512_cmp_ps_mask::<_CMP_LE_OQ>(d2, limit)
            });
        }
    }

    #[inline(always)]
    fn keep_ball(self, all: &Points, point: [f32; 3], limit: f32, kept: &mut Points) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let limit = _mm512_set1_ps(limit);
            keep(all, kept, point, |x, y, z| {
                let d2 = _mm512_fmadd_ps(x, x, _mm512_fmadd_ps(y, y, _mm512_mul_ps(z, z)));
                _mm512_cmp_ps_mask::<_CMP_LE_OQ>(d2, limit)
            });
        }
    }

    #[inline(always)]
    fn least(self, all: &Points, point: [f32; 3]) -> f32 {
        // SAFETY: `self` proves that the instructions are there; blocks are padded with far points.
        unsafe {
            let [px, py, pz] = point.map(|p| _mm512_set1_ps(p));
            let mut least = _mm512_set1_ps(f32::INFINITY);
            let mut i = 0;
            while i < all.len {
                let x = _mm512_sub_ps(load(&all.x, i), px);
                let y = _mm512_sub_ps(load(&all.y, i), py);
                let z = _mm512_sub_ps(load(&all.z, i), pz);
                least = _mm512_min_ps(_mm512_fmadd_ps(x, x, _mm512_fmadd_ps(y, y, _mm512_mul_ps(z, z))), least);
                i += 16;
            }
            _mm512_reduce_min_ps(least)
        }
    }

    #[inline(always)]
    fn rank(self, points: &Points, offset: f32, scale: f32, keys: &mut Keys) {
        let n = Keys::padding(points.len);
        keys.padded = n;
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let (offset, scale) = (_mm512_set1_ps(offset), _mm512_set1_ps(scale));
            let most = _mm512_set1_ps(65535.0);
            // Packing works within quarters of a vector; this puts the quarters back in order.
            let order = _mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7);
            let ranks = |i: usize| {
                let (x, y, z) = (load(&points.x, i), load(&points.y, i), load(&points.z, i));
                let (x2, y2, z2) = (_mm512_mul_ps(x, x), _mm512_mul_ps(y, y), _mm512_mul_ps(z, z));
                let (yz, zx, xy) = (_mm512_add_ps(y2, z2), _mm512_add_ps(z2, x2), _mm512_add_ps(x2, y2));
                let rank = |a: __m512, rest: __m512| {
                    let d2 = _mm512_mul_ps(_mm512_fmadd_ps(a, a, rest), scale);
                    _mm512_cvttps_epi32(_mm512_min_ps(d2, most))
                };
                let pair = |a: __m512, rest: __m512| {
                    [rank(_mm512_sub_ps(a, offset), rest), rank(_mm512_add_ps(a, offset), rest)]
                };
                [pair(x, yz), pair(y, zx), pair(z, xy)]
            };
            let mut i = 0;
            while i < n {
                let (low, high) = (ranks(i), ranks(i + 16));
                for q in 0..6 {
                    let packed = _mm512_packus_epi32(low[q / 2][q % 2], high[q / 2][q % 2]);
                    let at = q * MOST + i;
                    let to: &mut [u16; 32] = (&mut keys.rank[at..at + 32]).try_into().expect("thirty-two");
                    _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_permutexvar_epi64(order, packed));
                }
                i += 32;
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, thresholds: &Thresholds) -> Thresholds {
        let mut counts = [0; 8];
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            for q in 0..6 {
                let ranks = keys.at(q);
                let threshold = _mm512_set1_epi16(thresholds[q] as i16);
                let below = |i| _mm512_cmple_epu16_mask(load_ranks(ranks, i), threshold).count_ones();
                let mut count = below(0) + below(32) + below(64);
                let mut i = 96;
                while i < ranks.len() {
                    count += below(i);
                    i += 32;
                }
                counts[q] = count as i32;
            }
        }
        counts
    }

    #[inline(always)]
    fn members(self, keys: &Keys, q: usize, threshold: u16, set: &mut Set) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let ranks = keys.at(q);
            let threshold = _mm512_set1_epi16(threshold as i16);
            let below = |i| u64::from(_mm512_cmple_epu16_mask(load_ranks(ranks, i), threshold));
            for i in (0..ranks.len()).step_by(64) {
                let second = if i + 32 < ranks.len() { below(i + 32) } else { 0 };
                set[i / 64] = below(i) | second << 32;
            }
        }
    }

    #[inline(always)]
    fn pack(self, word: u64, places: u64) -> u64 {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { _pext_u64(word, places) }
    }

    #[inline(always)]
    fn sums(self, near: &Near, weighting: &Weighting) -> [Sum; 6] {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let set1 = |x: f64| _mm512_set1_pd(x);
            let (offset, least, scale) = (set1(weighting.offset_m), set1(weighting.least_m2), set1(weighting.scale));
            let round = set1(ROUND);
            let weight = |a: __m512d, rest: __m512d| {
                let d2 = _mm512_add_pd(_mm512_mul_pd(a, a), rest);
                let x = _mm512_max_pd(d2, least);
                let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(x));
                let guess = _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(GUESS as i64), half));
                let t = _mm512_mul_pd(_mm512_mul_pd(_mm512_mul_pd(set1(FIRST[1]), x), guess), guess);
                let y = _mm512_mul_pd(guess, _mm512_sub_pd(set1(FIRST[0]), t));
                let e = _mm512_sub_pd(set1(1.0), _mm512_mul_pd(_mm512_mul_pd(x, y), y));
                let tail = _mm512_add_pd(set1(SECOND[2]), _mm512_mul_pd(e, set1(SECOND[3])));
                let tail = _mm512_add_pd(set1(SECOND[1]), _mm512_mul_pd(e, tail));
                let tail = _mm512_add_pd(set1(SECOND[0]), _mm512_mul_pd(e, tail));
                let y = _mm512_mul_pd(y, scale);
                _mm512_add_pd(y, _mm512_mul_pd(_mm512_mul_pd(y, e), tail))
            };
            let mut sums = [[_mm512_setzero_si512(); 2]; 6];
            let mut i = 0;
            while i < near.len {
                let value = |k: usize| load_f64(&near.value, k * MOST + i);
                let u = [value(0), value(1), value(2)];
                let [x2, y2, z2] = u.map(|u| _mm512_mul_pd(u, u));
                let rest = [_mm512_add_pd(y2, z2), _mm512_add_pd(z2, x2), _mm512_add_pd(x2, y2)];
                for axis in 0..3 {
                    let normal = value(3 + axis);
                    for side in 0..2 {
                        let q = 2 * axis + side;
                        let mask = (near.of[q][i / 64] >> (i % 64)) as u8;
                        let a = if side == 0 { _mm512_sub_pd(u[axis], offset) } else { _mm512_add_pd(u[axis], offset) };
                        let w = weight(a, rest[axis]);
                        let (weighted, weights) = (_mm512_add_pd(_mm512_mul_pd(w, normal), round), _mm512_add_pd(w, round));
                        let [sum_n, sum] = sums[q];
                        sums[q] = [
                            _mm512_mask_add_epi64(sum_n, mask, sum_n, _mm512_castpd_si512(weighted)),
                            _mm512_mask_add_epi64(sum, mask, sum, _mm512_castpd_si512(weights)),
                        ];
                    }
                }
                i += 8;
            }
            let words = near.len.div_ceil(64);
            let mut result = [Sum::default(); 6];
            for q in 0..6 {
                let count: u32 = near.of[q][..words].iter().map(|w| w.count_ones()).sum();
                let surplus = (ROUND.to_bits() as i64).wrapping_mul(i64::from(count));
                result[q] = Sum {
                    weighted: _mm512_reduce_add_epi64(sums[q][0]).wrapping_sub(surplus),
                    weights: _mm512_reduce_add_epi64(sums[q][1]).wrapping_sub(surplus),
                };
            }
            result
        }
    }
}
