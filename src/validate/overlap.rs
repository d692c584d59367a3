//! How much area each grain shares with each stone.

use std::collections::BTreeMap;

/// What a labelling is held against, triangle by triangle.
#[derive(Debug, Clone, Copy)]
pub struct TrueSurface<'a> {
    /// Area of each triangle, m².
    pub areas_m2: &'a [f64],
    /// The stone of each triangle, negative on sand.
    pub stone_of_triangle: &'a [i32],
    /// Triangles that the reconstruction spans over space that no camera saw; none beyond its end.
    pub unseen: &'a [bool],
    /// Number of stones: each stone of a triangle is below it.
    pub stones: usize,
}

/// Areas that grains and stones share. Grains count from 0 in the order of their ids, stones from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlaps {
    /// The grains' ids, ascending.
    pub grain_ids: Vec<i64>,
    /// Area of each grain, m².
    pub grain_area_m2: Vec<f64>,
    /// Area of each stone in the mesh, m².
    pub stone_area_m2: Vec<f64>,
    /// What of each grain lies on sand, m².
    pub sand_m2: Vec<f64>,
    /// What of each grain lies on triangles over unseen space, m².
    pub unseen_m2: Vec<f64>,
    /// Stones that each grain touches, ascending, and what they share, m².
    of_grain: Vec<Vec<(usize, f64)>>,
    /// Grains that each stone touches, ascending, and what they share, m².
    of_stone: Vec<Vec<(usize, f64)>>,
}

/// An area below which a union is none, m²: keeps a ratio finite.
const NO_AREA_M2: f64 = 1e-12;

impl Overlaps {
    /// Sums areas by grain and stone, in the order of the triangles. `grain_of_triangle`: negative for no grain;
    /// triangles beyond its end have none.
    pub fn of(surface: TrueSurface<'_>, grain_of_triangle: &[i64]) -> Overlaps {
        let mut grain_ids: Vec<i64> = grain_of_triangle.iter().copied().filter(|&g| g >= 0).collect();
        grain_ids.sort_unstable();
        grain_ids.dedup();
        let grains = grain_ids.len();
        let mut overlaps = Overlaps {
            grain_area_m2: vec![0.0; grains],
            stone_area_m2: vec![0.0; surface.stones],
            sand_m2: vec![0.0; grains],
            unseen_m2: vec![0.0; grains],
            of_grain: vec![Vec::new(); grains],
            of_stone: vec![Vec::new(); surface.stones],
            grain_ids,
        };
        let mut shared: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (triangle, (&area, &stone)) in surface.areas_m2.iter().zip(surface.stone_of_triangle).enumerate() {
            let stone = usize::try_from(stone).ok();
            if let Some(stone) = stone {
                overlaps.stone_area_m2[stone] += area;
            }
            let Some(grain) = grain_of_triangle.get(triangle).and_then(|&id| overlaps.place(id)) else { continue };
            overlaps.grain_area_m2[grain] += area;
            match stone {
                Some(stone) => *shared.entry((grain, stone)).or_insert(0.0) += area,
                None => overlaps.sand_m2[grain] += area,
            }
            if surface.unseen.get(triangle) == Some(&true) {
                overlaps.unseen_m2[grain] += area;
            }
        }
        for ((grain, stone), area) in shared {
            overlaps.of_grain[grain].push((stone, area));
            overlaps.of_stone[stone].push((grain, area));
        }
        overlaps
    }

    /// The place of a grain by its id; none for what is no grain.
    pub fn place(&self, grain_id: i64) -> Option<usize> {
        self.grain_ids.binary_search(&grain_id).ok()
    }

    /// Number of grains.
    pub fn grains(&self) -> usize {
        self.grain_ids.len()
    }

    /// Number of stones, hidden ones too.
    pub fn stones(&self) -> usize {
        self.stone_area_m2.len()
    }

    /// Stones that a grain touches, ascending, and the shared areas, m².
    pub fn of_grain(&self, grain: usize) -> &[(usize, f64)] {
        &self.of_grain[grain]
    }

    /// Area that a grain and a stone share, m².
    pub fn shared_m2(&self, grain: usize, stone: usize) -> f64 {
        let of_grain = &self.of_grain[grain];
        of_grain.binary_search_by_key(&stone, |&(stone, _)| stone).map_or(0.0, |at| of_grain[at].1)
    }

    /// Intersection over union of a grain and a stone, 0 to 1.
    pub fn iou(&self, grain: usize, stone: usize) -> f64 {
        let shared = self.shared_m2(grain, stone);
        shared / (self.grain_area_m2[grain] + self.stone_area_m2[stone] - shared).max(NO_AREA_M2)
    }

    /// The grain that holds most of a stone (the first of several) and what they share, m²; none if no grain does.
    pub fn largest_on(&self, stone: usize) -> Option<(usize, f64)> {
        let mut largest: Option<(usize, f64)> = None;
        for &(grain, area) in &self.of_stone[stone] {
            if area > largest.map_or(0.0, |(_, most)| most) {
                largest = Some((grain, area));
            }
        }
        largest
    }
}
