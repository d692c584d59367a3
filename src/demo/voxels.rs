//! The bed sampled on a grid of voxel corners, finely only where its surface is.

use super::bed::Bed;
use super::settings::SceneSettings;
use crate::geometry::DVec3;

/// Free space kept above the highest stone and solid below the lowest sand, voxels.
const MARGIN: f64 = 4.0;

/// Signed distances (voxels, negative inside, clamped) at the corners of a grid, x fastest.
pub(super) struct Voxels {
    pub(super) size: [usize; 3],
    pub(super) voxel_m: f64,
    pub(super) origin: DVec3,
    pub(super) value: Vec<f32>,
}

impl Voxels {
    /// Samples the union of sand and stones.
    pub(super) fn sample(settings: &SceneSettings, bed: &Bed) -> Voxels {
        let voxel_m = settings.voxel_m;
        let plan = (settings.side_m / voxel_m).floor() as usize + 1;
        let heights: Vec<f64> = (0..plan * plan)
            .map(|i| bed.sand.height_m((i % plan) as f64 * voxel_m, (i / plan) as f64 * voxel_m))
            .collect();
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min) - MARGIN * voxel_m;
        let tops = bed.shapes.iter().map(|s| s.centre.z + s.reach().z);
        let high = heights.iter().copied().chain(tops).fold(low, f64::max) + MARGIN * voxel_m;
        let layers = ((high - low) / voxel_m).ceil() as usize + 1;
        let mut value = Vec::with_capacity(plan * plan * layers);
        for k in 0..layers {
            let z = low + k as f64 * voxel_m;
            value.extend(heights.iter().map(|h| ((z - h) / voxel_m).clamp(-MARGIN, MARGIN) as f32));
        }
        let mut voxels = Voxels { size: [plan, plan, layers], voxel_m, origin: DVec3::new(0.0, 0.0, low), value };
        for stone in 0..bed.shapes.len() {
            voxels.add_stone(bed, stone);
        }
        voxels.close_pinches();
        voxels
    }

    fn add_stone(&mut self, bed: &Bed, stone: usize) {
        let shape = &bed.shapes[stone];
        let reach = shape.reach() + DVec3::splat(2.0 * self.voxel_m);
        let low = (shape.centre - reach - self.origin) / self.voxel_m;
        let high = (shape.centre + reach - self.origin) / self.voxel_m;
        let span = |axis: usize| low[axis].max(0.0) as usize..(high[axis].max(0.0) as usize + 1).min(self.size[axis]);
        let (xs, ys, zs) = (span(0), span(1), span(2));
        for k in zs {
            for j in ys.clone() {
                for i in xs.clone() {
                    let distance = shape.distance_m(self.corner_m([i, j, k]), 2.0 * self.voxel_m) / self.voxel_m;
                    let at = self.index([i, j, k]);
                    self.value[at] = self.value[at].min(distance as f32);
                }
            }
        }
    }

    /// Fills corners until no face of a voxel has its inside on one diagonal only.
    ///
    /// With such faces gone the dual surface is a manifold. Filling only ever adds solid, so it ends; it
    /// closes gaps of a voxel's width, which a survey would not resolve either.
    fn close_pinches(&mut self) {
        let steps = [1, self.size[0], self.size[0] * self.size[1]];
        loop {
            let mut filled = false;
            for (axis_a, axis_b) in [(0, 1), (1, 2), (0, 2)] {
                let limit = |axis: usize| self.size[axis] - usize::from(axis == axis_a || axis == axis_b);
                for k in 0..limit(2) {
                    for j in 0..limit(1) {
                        let row = self.index([0, j, k]);
                        for at in row..row + limit(0) {
                            filled |= fill_pinch(&mut self.value, at, steps[axis_a], steps[axis_b]);
                        }
                    }
                }
            }
            if !filled {
                return;
            }
        }
    }

    pub(super) fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    fn corner_m(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.origin + DVec3::new(i as f64, j as f64, k as f64) * self.voxel_m
    }

    /// Whether the corner nearest to a point in voxels is inside; none beyond the grid.
    pub(super) fn solid(&self, at: DVec3) -> Option<bool> {
        let mut corner = [0; 3];
        for axis in 0..3 {
            let rounded = (at[axis] + 0.5).floor();
            if rounded < 0.0 || rounded >= self.size[axis] as f64 {
                return None;
            }
            corner[axis] = rounded as usize;
        }
        Some(self.value[self.index(corner)] < 0.0)
    }
}

/// Fills the outside corner that is nearer to the surface, if the face at `at` is pinched.
fn fill_pinch(value: &mut [f32], at: usize, a: usize, b: usize) -> bool {
    let corners = [at, at + a + b, at + a, at + b];
    let inside = corners.map(|c| value[c] < 0.0);
    if inside[0] != inside[1] || inside[2] != inside[3] || inside[0] == inside[2] {
        return false;
    }
    let outside = if inside[0] { [corners[2], corners[3]] } else { [corners[0], corners[1]] };
    let nearer = if value[outside[0]] <= value[outside[1]] { outside[0] } else { outside[1] };
    value[nearer] = -0.05;
    true
}
