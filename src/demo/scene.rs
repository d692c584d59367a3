//! The scene: its settings, its mesh, and the truth about its stones.

use super::bed::{Bed, Sand};
use super::placement::place;
use super::sheet::{components, neighbours};
use super::surface::{Mesh, polygonise};
use super::voxels::Voxels;
use super::{color, finish, sight};
use crate::geometry::DVec3;

/// The stone of a triangle that lies on sand.
pub const SAND: u32 = u32::MAX;

/// Smaller islands in the unseen are left out, triangles; a stone's cap behind its overhang stays.
const ISLAND: usize = 100;

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
    fn in_range(&self) -> SceneSettings {
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

/// A stone as it truly is, metres in the scene's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Stone {
    /// Number of the stone: its index in [`Scene::stones`].
    pub id: u32,
    /// Full axes a >= b >= c: its calipers along its own axes, buried parts included.
    pub axes_m: [f64; 3],
    /// Centre of the body.
    pub centre: DVec3,
    /// Unit vectors of a, b and c, right-handed.
    pub directions: [DVec3; 3],
    /// Area of its triangles, m².
    pub visible_area_m2: f64,
    /// Area of the largest part of them that hangs together, m².
    pub connected_area_m2: f64,
}

/// A mesh with known stones.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Vertices, metres: x east, y north, z up, from the south-west corner of the patch.
    pub vertices: Vec<[f32; 3]>,
    /// Red, green, blue of each vertex.
    pub colors: Vec<[u8; 3]>,
    /// Vertex ids, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The stone of each triangle, or [`SAND`].
    pub stone_of_triangle: Vec<u32>,
    /// All stones, hidden ones too.
    pub stones: Vec<Stone>,
}

impl Scene {
    /// Area of a triangle, m².
    pub fn triangle_area_m2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.triangles[triangle].map(|v| DVec3::from_array(self.vertices[v as usize].map(f64::from)));
        0.5 * (b - a).cross(c - a).length()
    }
}

/// Builds the scene that the settings describe; the same settings give the same scene.
pub fn make_scene(settings: &SceneSettings) -> Scene {
    let settings = settings.in_range();
    let sand = Sand::new(settings.seed);
    let shapes = place(&settings, &sand);
    let bed = Bed::new(&settings, sand, shapes);
    let mesh = surveyed_surface(&settings, &bed);
    let colors = mesh.vertices.iter().map(|&p| color::color(settings.seed, bed.owner(p), p)).collect();
    let stone_of_triangle = mesh
        .triangles
        .iter()
        .map(|t| bed.owner(t.iter().map(|&v| mesh.vertices[v as usize]).sum::<DVec3>() / 3.0))
        .collect();
    let mut scene = Scene {
        vertices: mesh.vertices.iter().map(|v| v.to_array().map(|c| c as f32)).collect(),
        colors,
        triangles: mesh.triangles,
        stone_of_triangle,
        stones: Vec::new(),
    };
    scene.stones = true_stones(&scene, &bed);
    scene
}

fn surveyed_surface(settings: &SceneSettings, bed: &Bed) -> Mesh {
    let voxels = Voxels::sample(settings, bed);
    let whole = polygonise(&voxels);
    let outer = finish::cut(&whole, &vec![true; whole.triangles.len()], usize::MAX);
    let mut mesh = finish::cut(&outer, &sight::seen(&outer, &voxels, settings.view_limit_deg), ISLAND);
    finish::smooth(&mut mesh, settings.smoothing_passes);
    finish::roughen(&mut mesh, settings.seed ^ 31, settings.noise_voxels * settings.voxel_m, settings.voxel_m);
    mesh
}

fn true_stones(scene: &Scene, bed: &Bed) -> Vec<Stone> {
    let mut visible = vec![0.0; bed.shapes.len()];
    let mut connected = vec![0.0f64; bed.shapes.len()];
    let (part, count) = components(&neighbours(&scene.triangles), &scene.stone_of_triangle);
    let mut part_area = vec![0.0; count as usize];
    for (triangle, &p) in part.iter().enumerate() {
        part_area[p as usize] += scene.triangle_area_m2(triangle);
    }
    for (triangle, (&stone, &p)) in scene.stone_of_triangle.iter().zip(&part).enumerate() {
        if let Some(area) = visible.get_mut(stone as usize) {
            *area += scene.triangle_area_m2(triangle);
            connected[stone as usize] = connected[stone as usize].max(part_area[p as usize]);
        }
    }
    let stone = |(id, shape): (usize, &super::stone::Shape)| {
        let (axes_m, directions) = shape.axes();
        Stone {
            id: id as u32,
            axes_m,
            centre: shape.centre,
            directions: [directions.x_axis, directions.y_axis, directions.z_axis],
            visible_area_m2: visible[id],
            connected_area_m2: connected[id],
        }
    };
    bed.shapes.iter().enumerate().map(stone).collect()
}
