//! The body that completes a stone: a rounded solid of three semi-axes, and its fit to the visible surface.
//!
//! The surface is (x² + y²)^(5/4) + |z|^(5/2) = 1 in coordinates over the semi-axes: an ellipse in plan, and a
//! little squarer than an ellipsoid (exponent 2) seen from the side, as worn stones are (a superquadric, Barr
//! 1981, doi:10.1109/MCG.1981.1673799). From half a flat stone an ellipsoid finds c a fifth too large, since
//! its top is too pointed; the exponent 5/2 needs nothing but square roots.
//!
//! The fit is Levenberg-Marquardt over nine numbers (centre, logarithms of the semi-axes, rotation). It
//! minimises, in units of variances: the squared distances, robustly; what is expected of b/a and c/b; and
//! that the body is about as long and as wide as what is seen of it.

use crate::settings::ShapePrior;
use glam::{DMat3, DQuat, DVec3};
use nalgebra::{SMatrix, SVector};

type Matrix9 = SMatrix<f64, 9, 9>;
type Vector9 = SVector<f64, 9>;

/// Weight of the mean squared distance, in units of the visible area: as if 20 independent points departed
/// from the body by 3 % of the stone's width each.
const DATA_WEIGHT: f64 = 20_000.0;
/// Distances well above this share of the square root of the visible area count linearly, not squared.
const ROBUST: f64 = 0.02;
/// One standard deviation of ln(width of the body / width seen) along the box's a and b.
const WIDTH_SPREAD: f64 = 0.07;
/// Keeps the turn of a round body about its axis determined: no wider than some turns, radians to the power -2.
const TURN_WEIGHT: f64 = 1e-3;
/// Steps at most; five are usual.
const STEPS: u32 = 16;
/// The fit ends when a step improves the sum by less than this share.
const ENOUGH: f64 = 1e-3;
/// Coefficients of the rational form of 5/2 (S - S^(3/5)) in S - 1, right to the third order.
const ABOVE: f64 = 0.3 + 0.14 / 0.3;
const BELOW: f64 = 0.14 / 0.3;

/// What is seen of a stone, in a frame along its box and in units of the square root of its visible area.
pub(super) struct Seen<'a> {
    /// Points that stand for pieces of the surface.
    pub points: &'a [DVec3],
    /// Shares of the pieces in the area; their sum is 1.
    pub shares: &'a [f64],
    /// Width along x and y (the box's a and b).
    pub widths: [f64; 2],
}

/// A body in place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    /// Its centre.
    pub centre: DVec3,
    /// Columns: directions of its three axes.
    pub turn: DMat3,
    /// Its semi-axes along these.
    pub semi: DVec3,
}

/// A fitted body with what is known of its precision.
pub(super) struct Fitted {
    /// The body.
    pub body: Body,
    /// Covariance of the logarithms of the semi-axes.
    pub covariance: [[f64; 3]; 3],
    /// Root of the mean squared distance of the surface from the body.
    pub misfit: f64,
}

/// Where one point lies from a body: approximate signed distance, and how the body's nine numbers change it.
struct Offset {
    distance: f64,
    slope: [f64; 9],
}

/// A body, ready for many points: its centre, the turn into its frame, one over its semi-axes.
struct Prepared {
    centre: DVec3,
    into: DMat3,
    per_semi: DVec3,
}

impl Prepared {
    /// Distance to first order, along the axes to third: (S^(2/5) - 1) over the length of its gradient.
    #[inline(always)]
    fn offset(&self, point: DVec3) -> Offset {
        let u = self.into * (point - self.centre);
        let q = u * self.per_semi;
        let plan = q.x * q.x + q.y * q.y;
        let (plan_root, z_root) = (plan.sqrt().sqrt(), q.z.abs().sqrt());
        let excess = plan * plan_root + q.z * q.z * z_root - 1.0;
        let by_share = DVec3::new(q.x * plan_root, q.y * plan_root, q.z * z_root) * 2.5;
        let gradient = by_share * self.per_semi;
        let flatness = 1.0 / gradient.length().max(1e-12);
        let normal = gradient * flatness;
        let stretch = by_share * q * flatness;
        let lever = u.cross(normal);
        Offset {
            distance: excess * (1.0 + ABOVE * excess) / (1.0 + BELOW * excess) * flatness,
            slope: [-normal.x, -normal.y, -normal.z, -stretch.x, -stretch.y, -stretch.z, -lever.x, -lever.y, -lever.z],
        }
    }

    /// [`Prepared::offset`] without the slopes.
    fn distance(&self, point: DVec3) -> f64 {
        self.offset(point).distance
    }
}

impl Body {
    /// The body with what all its points share.
    fn prepared(&self) -> Prepared {
        Prepared { centre: self.centre, into: self.turn.transpose(), per_semi: self.semi.recip() }
    }

    /// Half the width along a unit vector (of the ellipsoid with the same axes), and how the semi-axes'
    /// logarithms and a turn change its logarithm.
    fn half_width(&self, along: DVec3) -> (f64, DVec3, DVec3) {
        let v = self.turn.transpose() * along;
        let reach = self.semi * v;
        let half = reach.length();
        let square = half * half;
        (half, reach * reach / square, (self.semi * reach).cross(v) / square)
    }

    /// The body after a step in its own frame.
    fn moved(&self, step: &Vector9) -> Body {
        // Rational stand-ins for exp and for the rotation by an angle: exact to second order, and the end of
        // the fit does not depend on how far a step really went.
        let grown = |k: usize| {
            let s = step[3 + k].clamp(-0.5, 0.5);
            (1.0 + 0.5 * s) / (1.0 - 0.5 * s)
        };
        let turn = DVec3::new(step[6], step[7], step[8]).clamp_length_max(0.5) * 0.5;
        Body {
            centre: self.centre + self.turn * DVec3::new(step[0], step[1], step[2]),
            turn: self.turn * DMat3::from_quat(DQuat::from_xyzw(turn.x, turn.y, turn.z, 1.0).normalize()),
            semi: self.semi * DVec3::new(grown(0), grown(1), grown(2)),
        }
    }

    /// Terms besides the distances: by how many standard deviations they are off, and their slopes.
    fn expectations(&self, seen: &Seen, prior: &ShapePrior) -> [(f64, [f64; 9]); 4] {
        let ratio = |small: usize, large: usize, expected: f64, spread: f64| {
            let mut slope = [0.0; 9];
            slope[3 + small] = 1.0 / spread;
            slope[3 + large] = -1.0 / spread;
            ((self.semi[small] / (self.semi[large] * expected)).ln() / spread, slope)
        };
        let width = |k: usize| {
            let (half, by_axes, by_turn) = self.half_width(DVec3::AXES[k]);
            let slope = [0.0, 0.0, 0.0, by_axes.x, by_axes.y, by_axes.z, by_turn.x, by_turn.y, by_turn.z];
            ((2.0 * half / seen.widths[k]).ln() / WIDTH_SPREAD, slope.map(|s| s / WIDTH_SPREAD))
        };
        [
            ratio(2, 1, prior.c_over_b, prior.c_over_b_spread),
            ratio(1, 0, prior.b_over_a, prior.b_over_a_spread),
            width(0),
            width(1),
        ]
    }

    /// The sum that the fit minimises, in units of variances.
    fn badness(&self, seen: &Seen, prior: &ShapePrior) -> f64 {
        let (mut sum, at) = (0.0, self.prepared());
        for (&point, &share) in seen.points.iter().zip(seen.shares) {
            let r = at.distance(point) * (1.0 / ROBUST);
            sum += share * 2.0 * ((1.0 + r * r).sqrt() - 1.0);
        }
        sum *= DATA_WEIGHT * ROBUST * ROBUST;
        self.expectations(seen, prior).iter().fold(sum, |sum, (off, _)| sum + off * off)
    }

    /// Curvature (half the second derivatives, first order) and half the slope of that sum.
    fn normal_equations(&self, seen: &Seen, prior: &ShapePrior) -> (Matrix9, Vector9) {
        let (mut curvature, mut slope) = ([[0.0; 9]; 9], [0.0; 9]);
        // Whole rows: half of them would be fewer products and more time.
        let mut add = |weight: f64, off: f64, by: &[f64; 9]| {
            let weighted = by.map(|b| weight * b);
            for (row, w) in curvature.iter_mut().zip(weighted) {
                row.iter_mut().zip(by).for_each(|(sum, b)| *sum += w * b);
            }
            slope.iter_mut().zip(weighted).for_each(|(sum, w)| *sum += w * off);
        };
        let at = self.prepared();
        for (&point, &share) in seen.points.iter().zip(seen.shares) {
            let offset = at.offset(point);
            let r = offset.distance * (1.0 / ROBUST);
            add(DATA_WEIGHT * share / (1.0 + r * r).sqrt(), offset.distance, &offset.slope);
        }
        for (off, by) in &self.expectations(seen, prior) {
            add(1.0, *off, by);
        }
        (6..9).for_each(|i| curvature[i][i] += TURN_WEIGHT);
        (Matrix9::from_fn(|i, j| curvature[i][j]), Vector9::from(slope))
    }

    /// The body of least badness, from this one on; none where numbers fail.
    pub(super) fn fitted(self, seen: &Seen, prior: &ShapePrior) -> Option<Fitted> {
        let mut body = self;
        let mut badness = body.badness(seen, prior);
        let mut damping = 1e-3;
        let (mut curvature, mut slope) = body.normal_equations(seen, prior);
        for _ in 0..STEPS {
            let Some((next, less, eased)) = body.better(seen, prior, badness, (&curvature, &slope), damping) else {
                break;
            };
            let gain = badness - less;
            (body, badness, damping) = (next, less, eased);
            (curvature, slope) = body.normal_equations(seen, prior);
            if gain < ENOUGH * badness {
                break;
            }
        }
        let inverse = curvature.cholesky()?.inverse();
        let at = body.prepared();
        let square = seen.points.iter().zip(seen.shares).fold(0.0, |sum, (&point, &share)| {
            let distance = at.distance(point);
            sum + share * distance * distance
        });
        let covariance = [3, 4, 5].map(|i| [3, 4, 5].map(|j| inverse[(i, j)]));
        let finite =
            badness.is_finite() && square.is_finite() && covariance.as_flattened().iter().all(|c| c.is_finite());
        finite.then(|| Fitted { body, covariance, misfit: square.sqrt() })
    }

    /// A step that lessens the badness, with the damping for the next; none where six dampings find none.
    fn better(
        &self,
        seen: &Seen,
        prior: &ShapePrior,
        badness: f64,
        (curvature, slope): (&Matrix9, &Vector9),
        mut damping: f64,
    ) -> Option<(Body, f64, f64)> {
        for _ in 0..6 {
            let mut damped = *curvature;
            (0..9).for_each(|i| damped[(i, i)] += damping * curvature[(i, i)]);
            let next = self.moved(&-damped.cholesky()?.solve(slope));
            let less = next.badness(seen, prior);
            if less < badness {
                return Some((next, less, (damping / 5.0).max(1e-7)));
            }
            damping *= 5.0;
        }
        None
    }
}
