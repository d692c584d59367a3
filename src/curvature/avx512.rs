//! The kernel's vector steps in AVX-512.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]
#![allow(unsafe_code)]

use super::buffer::{Points, SLACK};
use super::lanes::{Keys, Lanes, MOST, Near, Set};
use super::thresholds::Thresholds;
use super::weights::{FIRST, GUESS, ROUND, SECOND, Sum, Weighting, surplus};
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
fn nearest_column(lanes: Avx512, column: &mut nearest::Column<'_, '_>) {
    nearest::work(lanes, column);
}

/// Sixteen numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there, and so are the numbers.
#[inline(always)]
unsafe fn load(from: *const f32, i: usize) -> __m512 {
    // SAFETY: by this function's contract.
    unsafe { _mm512_loadu_ps(from.add(i)) }
}

/// Thirty-two ranks from `i` on.
///
/// SAFETY contract: AVX-512 F is there, and so are the ranks.
#[inline(always)]
unsafe fn load_ranks(from: *const u16, i: usize) -> __m512i {
    // SAFETY: by this function's contract.
    unsafe { _mm512_loadu_si512(from.add(i).cast()) }
}

/// Eight numbers from `i` on.
///
/// SAFETY contract: AVX-512 F is there, and so are the numbers.
#[inline(always)]
unsafe fn load_f64(from: *const f64, i: usize) -> __m512d {
    // SAFETY: by this function's contract.
    unsafe { _mm512_loadu_pd(from.add(i)) }
}

/// Keeps the candidates that `near` accepts, less `origin`.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn keep(all: &Points, kept: &mut Points, origin: [f32; 3], near: impl Fn(__m512, __m512, __m512) -> __mmask16) {
    kept.reserve(all.len);
    assert!(all.fits(all.len) && kept.fits(all.len), "room for the candidates and the slack");
    let (xs, ys, zs, ids) = (all.x.as_ptr(), all.y.as_ptr(), all.z.as_ptr(), all.id.as_ptr());
    let (kx, ky, kz, kid) = (kept.x.as_mut_ptr(), kept.y.as_mut_ptr(), kept.z.as_mut_ptr(), kept.id.as_mut_ptr());
    let mut n = 0;
    // SAFETY: the instructions are there by this function's contract. Both `i` and `n` are below `all.len`, and the
    // slack that was asserted is wider than a vector.
    unsafe {
        let [ox, oy, oz] = origin.map(|o| _mm512_set1_ps(o));
        let mut i = 0;
        while i < all.len {
            let x = _mm512_sub_ps(load(xs, i), ox);
            let y = _mm512_sub_ps(load(ys, i), oy);
            let z = _mm512_sub_ps(load(zs, i), oz);
            let mut mask = near(x, y, z);
            if all.len - i < 16 {
                mask &= (1 << (all.len - i)) - 1;
            }
            if mask != 0 {
                _mm512_storeu_ps(kx.add(n), _mm512_maskz_compress_ps(mask, x));
                _mm512_storeu_ps(ky.add(n), _mm512_maskz_compress_ps(mask, y));
                _mm512_storeu_ps(kz.add(n), _mm512_maskz_compress_ps(mask, z));
                let id = _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ids.add(i).cast()));
                _mm512_storeu_si512(kid.add(n).cast(), id);
                n += mask.count_ones() as usize;
            }
            i += 16;
        }
    }
    kept.len = n;
}

/// Ranks of candidates at the six stencil points, in 32 bits.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn ranks(points: &Points, i: usize, offset: __m512, scale: __m512) -> [__m512i; 6] {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let (x, y, z) = (load(points.x.as_ptr(), i), load(points.y.as_ptr(), i), load(points.z.as_ptr(), i));
        let (x2, y2, z2) = (_mm512_mul_ps(x, x), _mm512_mul_ps(y, y), _mm512_mul_ps(z, z));
        let (yz, zx, xy) = (_mm512_add_ps(y2, z2), _mm512_add_ps(z2, x2), _mm512_add_ps(x2, y2));
        [
            rank(_mm512_sub_ps(x, offset), yz, scale),
            rank(_mm512_add_ps(x, offset), yz, scale),
            rank(_mm512_sub_ps(y, offset), zx, scale),
            rank(_mm512_add_ps(y, offset), zx, scale),
            rank(_mm512_sub_ps(z, offset), xy, scale),
            rank(_mm512_add_ps(z, offset), xy, scale),
        ]
    }
}

/// The floor of `scale` times (a² + rest), 65535 at most.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn rank(a: __m512, rest: __m512, scale: __m512) -> __m512i {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let d2 = _mm512_mul_ps(_mm512_fmadd_ps(a, a, rest), scale);
        _mm512_cvttps_epi32(_mm512_min_ps(d2, _mm512_set1_ps(65535.0)))
    }
}

/// [`Weighting::weight`] of a² + rest.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn weight(a: __m512d, rest: __m512d, least: __m512d, scale: __m512d) -> __m512d {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let d2 = _mm512_add_pd(_mm512_mul_pd(a, a), rest);
        let x = _mm512_max_pd(d2, least);
        let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(x));
        let guess = _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(GUESS as i64), half));
        let t = _mm512_mul_pd(_mm512_mul_pd(_mm512_mul_pd(_mm512_set1_pd(FIRST[1]), x), guess), guess);
        let y = _mm512_mul_pd(guess, _mm512_sub_pd(_mm512_set1_pd(FIRST[0]), t));
        let e = _mm512_sub_pd(_mm512_set1_pd(1.0), _mm512_mul_pd(_mm512_mul_pd(x, y), y));
        let tail = _mm512_add_pd(_mm512_set1_pd(SECOND[2]), _mm512_mul_pd(e, _mm512_set1_pd(SECOND[3])));
        let tail = _mm512_add_pd(_mm512_set1_pd(SECOND[1]), _mm512_mul_pd(e, tail));
        let tail = _mm512_add_pd(_mm512_set1_pd(SECOND[0]), _mm512_mul_pd(e, tail));
        let y = _mm512_mul_pd(y, scale);
        _mm512_add_pd(y, _mm512_mul_pd(_mm512_mul_pd(y, e), tail))
    }
}

/// Which of 32 ranks from `i` on do not exceed the threshold, whose lanes are all alike.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn below(from: *const u16, i: usize, threshold: __m512i) -> u32 {
    // SAFETY: the instructions are there by this function's contract.
    unsafe { _mm512_cmple_epu16_mask(load_ranks(from, i), threshold) }
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
            let beyond =
                |x, c, h| _mm512_max_ps(_mm512_sub_ps(_mm512_abs_ps(_mm512_sub_ps(x, c)), h), _mm512_setzero_ps());
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
        assert!(all.fits(all.len), "room for the candidates and the slack");
        let (xs, ys, zs) = (all.x.as_ptr(), all.y.as_ptr(), all.z.as_ptr());
        // SAFETY: `self` proves that the instructions are there; `i` is below `all.len`, and the slack wider than a
        // vector. Blocks are padded with far points.
        unsafe {
            let [px, py, pz] = point.map(|p| _mm512_set1_ps(p));
            let mut least = _mm512_set1_ps(f32::INFINITY);
            let mut i = 0;
            while i < all.len {
                let x = _mm512_sub_ps(load(xs, i), px);
                let y = _mm512_sub_ps(load(ys, i), py);
                let z = _mm512_sub_ps(load(zs, i), pz);
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
        assert!(n <= MOST && points.fits(n - SLACK.min(n)), "room for the candidates");
        assert!(keys.rank.len() >= 6 * MOST, "room for their ranks");
        let to = keys.rank.as_mut_ptr();
        // SAFETY: `self` proves that the instructions are there; `i` and the vectors from it on are below `n`.
        unsafe {
            let (offset, scale) = (_mm512_set1_ps(offset), _mm512_set1_ps(scale));
            // Packing works within quarters of a vector; this puts the quarters back in order.
            let order = _mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7);
            let mut i = 0;
            while i < n {
                let (low, high) = (ranks(points, i, offset, scale), ranks(points, i + 16, offset, scale));
                for q in 0..6 {
                    let packed = _mm512_packus_epi32(low[q], high[q]);
                    _mm512_storeu_si512(to.add(q * MOST + i).cast(), _mm512_permutexvar_epi64(order, packed));
                }
                i += 32;
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, thresholds: &Thresholds) -> Thresholds {
        let mut counts = [0; 8];
        let padded = keys.checked_padded();
        // SAFETY: `self` proves that the instructions are there; as many ranks are there as was checked.
        unsafe {
            for q in 0..6 {
                let ranks = keys.rank.as_ptr().add(q * MOST);
                let threshold = _mm512_set1_epi16(thresholds[q] as i16);
                let mut count = below(ranks, 0, threshold).count_ones()
                    + below(ranks, 32, threshold).count_ones()
                    + below(ranks, 64, threshold).count_ones();
                let mut i = 96;
                while i < padded {
                    count += below(ranks, i, threshold).count_ones();
                    i += 32;
                }
                counts[q] = count as i32;
            }
        }
        counts
    }

    #[inline(always)]
    fn members(self, keys: &Keys, q: usize, threshold: u16, set: &mut Set) {
        let padded = keys.checked_padded();
        assert!(q < 6, "one of six stencil points");
        // SAFETY: `self` proves that the instructions are there; as many ranks are there as was checked.
        unsafe {
            let ranks = keys.rank.as_ptr().add(q * MOST);
            let threshold = _mm512_set1_epi16(threshold as i16);
            let mut i = 0;
            while i < padded {
                let second = if i + 32 < padded { below(ranks, i + 32, threshold) } else { 0 };
                set[i / 64] = u64::from(below(ranks, i, threshold)) | u64::from(second) << 32;
                i += 64;
            }
        }
    }

    #[inline(always)]
    fn pack(self, word: u64, places: u64) -> u64 {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { _pext_u64(word, places) }
    }

    #[inline(always)]
    fn choose(self, from: &[u32], places: u64, to: &mut [u32]) -> usize {
        assert!(from.len() >= 64 && to.len() >= 64, "room for whole vectors");
        let mut n = 0;
        // SAFETY: `self` proves that the instructions are there. Four times 16 are read; and no more written, since
        // `n` is at most 16 times the vectors done.
        unsafe {
            for part in 0..4 {
                let mask = (places >> (16 * part)) as u16;
                let ids = _mm512_loadu_si512(from.as_ptr().add(16 * part).cast());
                _mm512_storeu_si512(to.as_mut_ptr().add(n).cast(), _mm512_maskz_compress_epi32(mask, ids));
                n += mask.count_ones() as usize;
            }
        }
        n
    }

    #[inline(always)]
    fn fetch(self, field: &NormalField, vertex: DVec3, near: &mut Near) {
        let triangles = field.centroids.len().min(field.normals.len());
        assert!(near.len <= MOST && near.id.len() >= MOST && near.value.len() >= 6 * MOST, "room for vectors");
        let value = near.value.as_mut_ptr();
        // SAFETY: `self` proves that the instructions are there. `i` is below `near.len`, and `MOST` a multiple of
        // eight. Only numbers below `triangles` are gathered, and a `DVec3` is three `f64` in a row.
        unsafe {
            let most = _mm512_set1_epi64(triangles as i64);
            let mut i = 0;
            while i < near.len {
                let id = _mm512_cvtepu32_epi64(_mm256_loadu_si256(near.id.as_ptr().add(i).cast()));
                let mask = _mm512_cmplt_epi64_mask(id, most);
                let at = _mm512_add_epi64(id, _mm512_add_epi64(id, id));
                let zero = _mm512_setzero_pd();
                for axis in 0..3 {
                    let from = field.centroids.as_ptr().cast::<f64>().add(axis);
                    let place = _mm512_mask_i64gather_pd::<8>(zero, mask, at, from);
                    let from = field.normals.as_ptr().cast::<f64>().add(axis);
                    let normal = _mm512_mask_i64gather_pd::<8>(zero, mask, at, from);
                    _mm512_storeu_pd(value.add(axis * MOST + i), _mm512_sub_pd(place, _mm512_set1_pd(vertex[axis])));
                    _mm512_storeu_pd(value.add((3 + axis) * MOST + i), normal);
                }
                i += 8;
            }
        }
    }

    #[inline(always)]
    fn sums(self, near: &Near, weighting: &Weighting) -> [Sum; 6] {
        assert!(near.len <= MOST && near.value.len() >= 6 * MOST, "whole vectors of neighbours");
        let value = near.value.as_ptr();
        // SAFETY: `self` proves that the instructions are there; `i` is below `near.len`, and `MOST` a multiple of the
        // lanes.
        unsafe {
            let offset = _mm512_set1_pd(weighting.offset_m);
            let (least, scale) = (_mm512_set1_pd(weighting.least_m2), _mm512_set1_pd(weighting.scale));
            let round = _mm512_set1_pd(ROUND);
            let mut sums = [[_mm512_setzero_si512(); 2]; 6];
            let mut i = 0;
            while i < near.len {
                let u = [load_f64(value, i), load_f64(value, MOST + i), load_f64(value, 2 * MOST + i)];
                let (x2, y2, z2) = (_mm512_mul_pd(u[0], u[0]), _mm512_mul_pd(u[1], u[1]), _mm512_mul_pd(u[2], u[2]));
                let rest = [_mm512_add_pd(y2, z2), _mm512_add_pd(z2, x2), _mm512_add_pd(x2, y2)];
                for axis in 0..3 {
                    let normal = load_f64(value, (3 + axis) * MOST + i);
                    for side in 0..2 {
                        let q = 2 * axis + side;
                        let mask = (near.of[q][i / 64] >> (i % 64)) as u8;
                        let a = if side == 0 { _mm512_sub_pd(u[axis], offset) } else { _mm512_add_pd(u[axis], offset) };
                        let w = weight(a, rest[axis], least, scale);
                        let (weighted, weights) =
                            (_mm512_add_pd(_mm512_mul_pd(w, normal), round), _mm512_add_pd(w, round));
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
                let surplus = surplus(&near.of[q][..words]);
                result[q] = Sum {
                    weighted: _mm512_reduce_add_epi64(sums[q][0]).wrapping_sub(surplus),
                    weights: _mm512_reduce_add_epi64(sums[q][1]).wrapping_sub(surplus),
                };
            }
            result
        }
    }
}
