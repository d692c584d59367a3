//! The kernel's vector steps in AVX2.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]
#![allow(unsafe_code)]

use super::buffer::{Points, SLACK};
use super::lanes::{Keys, Lanes, MOST, Near, Set, choose, fetch};
use super::thresholds::Thresholds;
use super::weights::{FIRST, GUESS, ROUND, SECOND, Sum, Weighting, surplus};
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
fn nearest_column(lanes: Avx2, column: &mut nearest::Column<'_, '_>) {
    nearest::work(lanes, column);
}

/// For each set of eight lanes, their numbers in order, a byte each.
static TOGETHER: [u64; 256] = {
    let mut table = [0; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut to) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set] |= (lane as u64) << (8 * to);
                to += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// Eight numbers from `i` on.
///
/// SAFETY contract: AVX is there, and so are the numbers.
#[inline(always)]
unsafe fn load(from: *const f32, i: usize) -> __m256 {
    // SAFETY: by this function's contract.
    unsafe { _mm256_loadu_ps(from.add(i)) }
}

/// Sixteen ranks from `i` on.
///
/// SAFETY contract: AVX is there, and so are the ranks.
#[inline(always)]
unsafe fn load_ranks(from: *const u16, i: usize) -> __m256i {
    // SAFETY: by this function's contract.
    unsafe { _mm256_loadu_si256(from.add(i).cast()) }
}

/// Four numbers from `i` on.
///
/// SAFETY contract: AVX is there, and so are the numbers.
#[inline(always)]
unsafe fn load_f64(from: *const f64, i: usize) -> __m256d {
    // SAFETY: by this function's contract.
    unsafe { _mm256_loadu_pd(from.add(i)) }
}

/// Keeps the candidates that `near` accepts, less `origin`.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn keep(all: &Points, kept: &mut Points, origin: [f32; 3], near: impl Fn(__m256, __m256, __m256) -> __m256) {
    kept.reserve(all.len);
    assert!(all.fits(all.len) && kept.fits(all.len), "room for the candidates and the slack");
    let (xs, ys, zs, ids) = (all.x.as_ptr(), all.y.as_ptr(), all.z.as_ptr(), all.id.as_ptr());
    let (kx, ky, kz, kid) = (kept.x.as_mut_ptr(), kept.y.as_mut_ptr(), kept.z.as_mut_ptr(), kept.id.as_mut_ptr());
    let mut n = 0;
    // SAFETY: the instructions are there by this function's contract. Both `i` and `n` are below `all.len`, and the
    // slack that was asserted is wider than a vector.
    unsafe {
        let [ox, oy, oz] = origin.map(|o| _mm256_set1_ps(o));
        let mut i = 0;
        while i < all.len {
            let x = _mm256_sub_ps(load(xs, i), ox);
            let y = _mm256_sub_ps(load(ys, i), oy);
            let z = _mm256_sub_ps(load(zs, i), oz);
            let mut mask = _mm256_movemask_ps(near(x, y, z)) as usize;
            if all.len - i < 8 {
                mask &= (1 << (all.len - i)) - 1;
            }
            if mask != 0 {
                let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(TOGETHER[mask] as i64));
                _mm256_storeu_ps(kx.add(n), _mm256_permutevar8x32_ps(x, order));
                _mm256_storeu_ps(ky.add(n), _mm256_permutevar8x32_ps(y, order));
                _mm256_storeu_ps(kz.add(n), _mm256_permutevar8x32_ps(z, order));
                let id = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(ids.add(i).cast()), order);
                _mm256_storeu_si256(kid.add(n).cast(), id);
                n += mask.count_ones() as usize;
            }
            i += 8;
        }
    }
    kept.len = n;
}

/// Which of 32 ranks from `i` on do not exceed the threshold, whose lanes are all alike. Lanes in order if `ORDERED`.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn below<const ORDERED: bool>(ranks: *const u16, i: usize, threshold: __m256i) -> u32 {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let (first, second) = (load_ranks(ranks, i), load_ranks(ranks, i + 16));
        let first = _mm256_cmpeq_epi16(_mm256_min_epu16(first, threshold), first);
        let second = _mm256_cmpeq_epi16(_mm256_min_epu16(second, threshold), second);
        let packed = _mm256_packs_epi16(first, second);
        let packed = if ORDERED { _mm256_permute4x64_epi64::<0b11_01_10_00>(packed) } else { packed };
        _mm256_movemask_epi8(packed) as u32
    }
}

/// Ranks of candidates at the six stencil points, in 32 bits.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn ranks(points: &Points, i: usize, offset: __m256, scale: __m256) -> [__m256i; 6] {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let (x, y, z) = (load(points.x.as_ptr(), i), load(points.y.as_ptr(), i), load(points.z.as_ptr(), i));
        let (x2, y2, z2) = (_mm256_mul_ps(x, x), _mm256_mul_ps(y, y), _mm256_mul_ps(z, z));
        let (yz, zx, xy) = (_mm256_add_ps(y2, z2), _mm256_add_ps(z2, x2), _mm256_add_ps(x2, y2));
        [
            rank(_mm256_sub_ps(x, offset), yz, scale),
            rank(_mm256_add_ps(x, offset), yz, scale),
            rank(_mm256_sub_ps(y, offset), zx, scale),
            rank(_mm256_add_ps(y, offset), zx, scale),
            rank(_mm256_sub_ps(z, offset), xy, scale),
            rank(_mm256_add_ps(z, offset), xy, scale),
        ]
    }
}

/// The floor of `scale` times (a² + rest), 65535 at most.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn rank(a: __m256, rest: __m256, scale: __m256) -> __m256i {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let d2 = _mm256_mul_ps(_mm256_fmadd_ps(a, a, rest), scale);
        _mm256_cvttps_epi32(_mm256_min_ps(d2, _mm256_set1_ps(65535.0)))
    }
}

/// [`Weighting::weight`] of a² + rest.
///
/// SAFETY contract: the instructions are there.
#[inline(always)]
unsafe fn weight(a: __m256d, rest: __m256d, least: __m256d, scale: __m256d) -> __m256d {
    // SAFETY: the instructions are there by this function's contract.
    unsafe {
        let d2 = _mm256_add_pd(_mm256_mul_pd(a, a), rest);
        let x = _mm256_max_pd(d2, least);
        let half = _mm256_srli_epi64::<1>(_mm256_castpd_si256(x));
        let guess = _mm256_castsi256_pd(_mm256_sub_epi64(_mm256_set1_epi64x(GUESS as i64), half));
        let t = _mm256_mul_pd(_mm256_mul_pd(_mm256_mul_pd(_mm256_set1_pd(FIRST[1]), x), guess), guess);
        let y = _mm256_mul_pd(guess, _mm256_sub_pd(_mm256_set1_pd(FIRST[0]), t));
        let e = _mm256_sub_pd(_mm256_set1_pd(1.0), _mm256_mul_pd(_mm256_mul_pd(x, y), y));
        let tail = _mm256_add_pd(_mm256_set1_pd(SECOND[2]), _mm256_mul_pd(e, _mm256_set1_pd(SECOND[3])));
        let tail = _mm256_add_pd(_mm256_set1_pd(SECOND[1]), _mm256_mul_pd(e, tail));
        let tail = _mm256_add_pd(_mm256_set1_pd(SECOND[0]), _mm256_mul_pd(e, tail));
        let y = _mm256_mul_pd(y, scale);
        _mm256_add_pd(y, _mm256_mul_pd(_mm256_mul_pd(y, e), tail))
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

    fn nearest_column(self, work: &mut nearest::Column<'_, '_>) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe { nearest_column(self, work) }
    }

    #[inline(always)]
    fn keep_near_box(self, all: &Points, centre: [f32; 3], half: [f32; 3], limit: f32, kept: &mut Points) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let ([cx, cy, cz], [hx, hy, hz]) = (centre.map(|c| _mm256_set1_ps(c)), half.map(|h| _mm256_set1_ps(h)));
            let (limit, sign) = (_mm256_set1_ps(limit), _mm256_set1_ps(-0.0));
            let beyond = |x, c, h| {
                let far = _mm256_andnot_ps(sign, _mm256_sub_ps(x, c));
                _mm256_max_ps(_mm256_sub_ps(far, h), _mm256_setzero_ps())
            };
            keep(all, kept, [0.0; 3], |x, y, z| {
                let (x, y, z) = (beyond(x, cx, hx), beyond(y, cy, hy), beyond(z, cz, hz));
                let d2 = _mm256_fmadd_ps(x, x, _mm256_fmadd_ps(y, y, _mm256_mul_ps(z, z)));
                _mm256_cmp_ps::<_CMP_LE_OQ>(d2, limit)
            });
        }
    }

    #[inline(always)]
    fn keep_ball(self, all: &Points, point: [f32; 3], limit: f32, kept: &mut Points) {
        // SAFETY: `self` proves that the instructions are there.
        unsafe {
            let limit = _mm256_set1_ps(limit);
            keep(all, kept, point, |x, y, z| {
                let d2 = _mm256_fmadd_ps(x, x, _mm256_fmadd_ps(y, y, _mm256_mul_ps(z, z)));
                _mm256_cmp_ps::<_CMP_LE_OQ>(d2, limit)
            });
        }
    }

    #[inline(always)]
    fn least(self, all: &Points, point: [f32; 3]) -> f32 {
        let mut lanes = [0f32; 8];
        assert!(all.fits(all.len), "room for the candidates and the slack");
        let (xs, ys, zs) = (all.x.as_ptr(), all.y.as_ptr(), all.z.as_ptr());
        // SAFETY: `self` proves that the instructions are there; `i` is below `all.len`, and the slack wider than a
        // vector. Blocks are padded with far points.
        unsafe {
            let [px, py, pz] = point.map(|p| _mm256_set1_ps(p));
            let mut least = _mm256_set1_ps(f32::INFINITY);
            let mut i = 0;
            while i < all.len {
                let x = _mm256_sub_ps(load(xs, i), px);
                let y = _mm256_sub_ps(load(ys, i), py);
                let z = _mm256_sub_ps(load(zs, i), pz);
                least = _mm256_min_ps(_mm256_fmadd_ps(x, x, _mm256_fmadd_ps(y, y, _mm256_mul_ps(z, z))), least);
                i += 8;
            }
            _mm256_storeu_ps(lanes.as_mut_ptr(), least);
        }
        lanes.into_iter().fold(f32::INFINITY, |a, b| if b < a { b } else { a })
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
            let (offset, scale) = (_mm256_set1_ps(offset), _mm256_set1_ps(scale));
            let mut i = 0;
            while i < n {
                let (low, high) = (ranks(points, i, offset, scale), ranks(points, i + 8, offset, scale));
                for q in 0..6 {
                    let packed = _mm256_packus_epi32(low[q], high[q]);
                    // Packing works within halves of a vector; this puts their parts in order.
                    _mm256_storeu_si256(to.add(q * MOST + i).cast(), _mm256_permute4x64_epi64::<0b11_01_10_00>(packed));
                }
                i += 16;
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
                let threshold = _mm256_set1_epi16(thresholds[q] as i16);
                let mut count = below::<false>(ranks, 0, threshold).count_ones()
                    + below::<false>(ranks, 32, threshold).count_ones()
                    + below::<false>(ranks, 64, threshold).count_ones();
                let mut i = 96;
                while i < padded {
                    count += below::<false>(ranks, i, threshold).count_ones();
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
            let threshold = _mm256_set1_epi16(threshold as i16);
            let mut i = 0;
            while i < padded {
                let second = if i + 32 < padded { below::<true>(ranks, i + 32, threshold) } else { 0 };
                set[i / 64] = u64::from(below::<true>(ranks, i, threshold)) | u64::from(second) << 32;
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
        choose(from, places, to)
    }

    #[inline(always)]
    fn fetch(self, field: &NormalField, vertex: DVec3, near: &mut Near) {
        fetch(field, vertex, near);
    }

    #[inline(always)]
    fn sums(self, near: &Near, weighting: &Weighting) -> [Sum; 6] {
        let mut result = [Sum::default(); 6];
        assert!(near.len <= MOST && near.value.len() >= 6 * MOST, "whole vectors of neighbours");
        let value = near.value.as_ptr();
        // SAFETY: `self` proves that the instructions are there; `i` is below `near.len`, and `MOST` a multiple of the
        // lanes.
        unsafe {
            let offset = _mm256_set1_pd(weighting.offset_m);
            let (least, scale) = (_mm256_set1_pd(weighting.least_m2), _mm256_set1_pd(weighting.scale));
            let round = _mm256_set1_pd(ROUND);
            let lane = _mm256_setr_epi64x(1, 2, 4, 8);
            let words = near.len.div_ceil(64);
            // One axis at a time, since the registers hold no more.
            for axis in 0..3 {
                let mut sums = [[_mm256_setzero_si256(); 2]; 2];
                let mut i = 0;
                while i < near.len {
                    let u = load_f64(value, axis * MOST + i);
                    let b = load_f64(value, (axis + 1) % 3 * MOST + i);
                    let c = load_f64(value, (axis + 2) % 3 * MOST + i);
                    let rest = _mm256_add_pd(_mm256_mul_pd(b, b), _mm256_mul_pd(c, c));
                    let normal = load_f64(value, (3 + axis) * MOST + i);
                    for side in 0..2 {
                        let bits = (near.of[2 * axis + side][i / 64] >> (i % 64)) as i64;
                        let belongs = _mm256_cmpeq_epi64(_mm256_and_si256(_mm256_set1_epi64x(bits), lane), lane);
                        let a = if side == 0 { _mm256_sub_pd(u, offset) } else { _mm256_add_pd(u, offset) };
                        let w = weight(a, rest, least, scale);
                        let weighted = _mm256_castpd_si256(_mm256_add_pd(_mm256_mul_pd(w, normal), round));
                        let weights = _mm256_castpd_si256(_mm256_add_pd(w, round));
                        let [sum_n, sum] = sums[side];
                        sums[side] = [
                            _mm256_add_epi64(sum_n, _mm256_and_si256(weighted, belongs)),
                            _mm256_add_epi64(sum, _mm256_and_si256(weights, belongs)),
                        ];
                    }
                    i += 4;
                }
                for side in 0..2 {
                    let q = 2 * axis + side;
                    let surplus = surplus(&near.of[q][..words]);
                    result[q] = Sum {
                        weighted: total(sums[side][0]).wrapping_sub(surplus),
                        weights: total(sums[side][1]).wrapping_sub(surplus),
                    };
                }
            }
        }
        result
    }
}
