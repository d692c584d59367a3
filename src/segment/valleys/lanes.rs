//! Four neighbours at a time, each in a lane of its own: what vector instructions do well, and with one order of additions.

use glam::{Mat4, Vec3A, Vec4};

/// Four vectors, coordinate by coordinate.
pub(super) struct Lanes {
    pub(super) x: Vec4,
    pub(super) y: Vec4,
    pub(super) z: Vec4,
    pub(super) w: Vec4,
}

impl Lanes {
    #[inline]
    pub(super) fn of([a, b, c, d]: [Vec4; 4]) -> Lanes {
        let lanes = Mat4::from_cols(a, b, c, d).transpose();
        Lanes { x: lanes.x_axis, y: lanes.y_axis, z: lanes.z_axis, w: lanes.w_axis }
    }

    /// The products of the first three coordinates with those of a vector.
    #[inline]
    pub(super) fn dot(&self, other: Vec3A) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The squares of the lengths of the first three coordinates.
    #[inline]
    pub(super) fn lengths_squared(&self) -> Vec4 {
        self.x * self.x + self.y * self.y + self.z * self.z
    }
}

/// The sum over the lanes.
#[inline]
pub(super) fn sum(lanes: Vec4) -> f32 {
    (lanes.x + lanes.z) + (lanes.y + lanes.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_hold_one_coordinate_each() {
        let lanes = Lanes::of([0, 1, 2, 3].map(|i| Vec4::new(0.0, 1.0, 2.0, 3.0) + 10.0 * i as f32));
        assert_eq!(lanes.z.to_array(), [2.0, 12.0, 22.0, 32.0]);
        assert_eq!(lanes.dot(Vec3A::new(1.0, 2.0, 3.0)).to_array(), [8.0, 68.0, 128.0, 188.0]);
        assert_eq!(lanes.lengths_squared().to_array(), [5.0, 365.0, 1325.0, 2885.0]);
        assert_eq!([lanes.x, lanes.w].map(sum), [60.0, 72.0]);
    }
}
