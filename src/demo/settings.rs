//! What a scene is asked to be.

/// The stone of a triangle that lies on sand.
pub const SAND: u32 = u32::MAX;

/// What scene to make. Values beyond the ranges given are brought into them.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSettings {
    /// Names the scene: another seed is another gravel bar.
    pub seed: u64,
    /// Side of the square patch, metres, 0.05 to 2.
    pub side_m: f64,
    /// Stones to drop; some find no place. At most 20000.
    pub stones: usize,
    /// Median of the b axes, metres, between the two limits.
    pub median_b_m: f64,
    /// Standard deviation of the natural logarithm of the b axes, 0 to 1.
    pub sigma_ln_b: f64,
    /// Smallest b axis, metres, 0.002 or more.
    pub min_b_m: f64,
    /// Largest b axis, metres, at most half the side.
    pub max_b_m: f64,
    /// Share of the stones that seek contact with others, 0 to 1.
    pub crowding: f64,
    /// Voxel of the reconstruction, metres: about the mean edge length; at least 1/1500 of the side.
    pub voxel_m: f64,
    /// Steepest view, degrees from the vertical, 0 to 80.
    pub view_limit_deg: f64,
    /// Laplacian smoothing passes, 0 to 100.
    pub smoothing_passes: u32,
    /// Standard deviation of the noise, voxels, 0 to 0.3.
    pub noise_voxels: f64,
}

impl Default for SceneSettings {
    fn default() -> Self {
        SceneSettings {
            seed: 1,
            side_m: 0.40,
            stones: 450,
            median_b_m: 0.014,
            sigma_ln_b: 0.4,
            min_b_m: 0.007,
            max_b_m: 0.045,
            crowding: 0.8,
            voxel_m: 1.15e-3,
            view_limit_deg: 50.0,
            smoothing_passes: 2,
            noise_voxels: 0.04,
        }
    }
}

impl SceneSettings {
    /// The settings with every value inside its range, a value that is no number at the lower end.
    pub(super) fn in_range(&self) -> SceneSettings {
        let within = |value: f64, low: f64, high: f64| if value > low { value.min(high) } else { low };
        let side_m = within(self.side_m, 0.05, 2.0);
        let max_b_m = within(self.max_b_m, 0.002, 0.5 * side_m);
        let min_b_m = within(self.min_b_m, 0.002, max_b_m);
        SceneSettings {
            seed: self.seed,
            side_m,
            stones: self.stones.min(20_000),
            median_b_m: within(self.median_b_m, min_b_m, max_b_m),
            sigma_ln_b: within(self.sigma_ln_b, 0.0, 1.0),
            min_b_m,
            max_b_m,
            crowding: within(self.crowding, 0.0, 1.0),
            voxel_m: within(self.voxel_m, side_m / 1500.0, side_m / 20.0),
            view_limit_deg: within(self.view_limit_deg, 0.0, 80.0),
            smoothing_passes: self.smoothing_passes.min(100),
            noise_voxels: within(self.noise_voxels, 0.0, 0.3),
        }
    }
}
