//! The scene: its mesh, and the truth about its stones.

use super::bed::{Bed, Sand};
use super::placement::place;
use super::settings::SceneSettings;
use super::sheet::{components, neighbours};
use super::surface::{Mesh, polygonise};
use super::voxels::Voxels;
use super::{color, finish, sight};
use crate::geometry::DVec3;

/// Smaller islands in the unseen are left out, triangles; a stone's cap behind its overhang stays.
const ISLAND: usize = 100;

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
    /// The stone of each triangle, or [`super::SAND`].
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
