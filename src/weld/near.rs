//! Which vertices and triangles are near another file. All passes go through the survey in its order.

use super::parts::{Part, common};
use super::sheet::Sheet;
use crate::geometry::{DVec3, PlanBox};
use crate::open::{Bits, Surface, over_chunks, over_chunks_then, pieces};
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::{Mutex, PoisonError};

/// Side of a square, mean edges: some hundred triangles lie in it, so that an area covered by a file is known to
/// about a hundredth although whole triangles are counted.
const SQUARE_EDGES: f64 = 8.0;
/// A triangle that spans more than this share of a square says nothing about the square of its centroid.
const WIDEST_IN_SQUARES: f64 = 0.5;
/// Areas are counted in this part of a square, and heights in this part of its side: whole numbers, whose sum does
/// not depend on their order.
const AREA_STEPS: f64 = 4_294_967_296.0;
const HEIGHT_STEPS: f64 = 65_536.0;

/// The files of a survey, and where they may meet.
pub(super) struct Files<'a> {
    pub(super) surface: &'a dyn Surface,
    pub(super) parts: &'a [Part],
    /// For each file where others may be as well.
    pub(super) zones: Vec<Option<PlanBox>>,
    pub(super) tolerance_m: f64,
}

/// What a file has in a square that it shares with others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Cover {
    /// Triangles whose centroid is in it.
    pub(super) triangles: u64,
    area: i64,
    height: i64,
}

impl Cover {
    fn add(&mut self, other: Cover) {
        self.triangles += other.triangles;
        self.area += other.area;
        self.height += other.height;
    }

    /// Share of the square that is covered, 0 to 1. What lies below an overhang is not counted twice, since areas
    /// that look down are negative.
    pub(super) fn share(&self) -> f64 {
        (self.area.unsigned_abs() as f64 / AREA_STEPS).min(1.0)
    }

    /// Mean height of the triangles, in sides of the square.
    pub(super) fn height(&self) -> f64 {
        self.height as f64 / HEIGHT_STEPS / self.triangles.max(1) as f64
    }
}

/// What lies near another file.
pub(super) struct Near {
    pub(super) sheet: Sheet,
    /// Vertices in shared squares that a triangle uses.
    pub(super) used: Bits,
    vertices: u64,
    /// What each file has in the shared squares: by square, then file.
    pub(super) covers: Vec<((u64, usize), Cover)>,
}

impl Near {
    /// Memory, bytes, with what was needed to make it.
    pub(super) fn bytes(&self) -> u64 {
        let bits = 2 * Bits::bytes(self.vertices);
        self.sheet.bytes() + bits + 2 * (self.covers.len() * size_of::<((u64, usize), Cover)>()) as u64
    }
}

impl Files<'_> {
    /// Looks at all vertices where several files may be, and at the triangles of those that are near another file.
    /// None where no boxes meet.
    pub(super) fn near(&self, longest_edge_m: f64) -> Option<Near> {
        let mut area = PlanBox::EMPTY;
        self.zones.iter().flatten().for_each(|zone| area.merge(zone));
        if area.width_m() <= 0.0 {
            return None;
        }
        let vertices = self.surface.vertices();
        let side_m = (SQUARE_EDGES * longest_edge_m).max(SQUARE_EDGES * self.tolerance_m);
        let sheet = Sheet::over(&area, side_m, vertices);
        self.each_vertex_in_zone(|file, _, p| sheet.mark(p, self.tolerance_m, file as u32));
        let near = Bits::new(vertices);
        self.each_vertex_in_zone(|_, vertex, p| {
            if sheet.is_shared(sheet.square(p)) {
                near.set(vertex);
            }
        });
        let used = Bits::new(vertices);
        let covers = self.covers(&sheet, &near, &used);
        Some(Near { sheet, used, vertices, covers })
    }

    fn each_vertex_in_zone(&self, look: impl Fn(usize, u64, DVec3) + Sync) {
        let Ok(()) = over_chunks::<_, Infallible>(
            self.surface,
            self.surface.vertices(),
            || Ok(Vec::new()),
            |positions, range| {
                for (file, (part, zone)) in self.parts.iter().zip(&self.zones).enumerate() {
                    let Some(zone) = zone else { continue };
                    for piece in pieces(common(&range, &part.vertices)) {
                        self.surface.positions(piece.clone(), positions);
                        for (vertex, &p) in piece.zip(&*positions) {
                            if zone.margin_m(p) >= 0.0 {
                                look(file, vertex, p);
                            }
                        }
                    }
                }
                Ok(())
            },
        );
    }

    /// Hands the triangles of files that may meet others to `look`, with a state for each thread and its end.
    pub(super) fn each_triangle<S: Default>(
        &self,
        look: impl Fn(&mut S, usize, [u64; 3]) + Sync,
        end: impl Fn(S) + Sync,
    ) {
        let Ok(()) = over_chunks_then::<_, Infallible>(
            self.surface,
            self.surface.triangles(),
            || Ok((S::default(), Vec::new())),
            |(state, corners), range| {
                for (file, (part, zone)) in self.parts.iter().zip(&self.zones).enumerate() {
                    if zone.is_some() {
                        for piece in pieces(common(&range, &part.triangles)) {
                            self.surface.corner_numbers(piece, corners);
                            corners.iter().for_each(|&corners| look(state, file, corners));
                        }
                    }
                }
                Ok(())
            },
            |(state, _)| {
                end(state);
                Ok(())
            },
        );
    }

    fn covers(&self, sheet: &Sheet, near: &Bits, used: &Bits) -> Vec<((u64, usize), Cover)> {
        let all = Mutex::new(HashMap::new());
        let merge = |into: &mut HashMap<(u64, usize), Cover>, key, cover| into.entry(key).or_default().add(cover);
        self.each_triangle(
            |covers: &mut HashMap<(u64, usize), Cover>, file, corners| {
                let is_near = corners.map(|v| near.get(v));
                if !is_near.contains(&true) {
                    return;
                }
                (0..3).filter(|&i| is_near[i]).for_each(|i| used.set(corners[i]));
                if let Some((square, cover)) = self.cover(sheet, corners) {
                    merge(covers, (square, file), cover);
                }
            },
            |covers| {
                let mut all = all.lock().unwrap_or_else(PoisonError::into_inner);
                covers.into_iter().for_each(|(key, cover)| merge(&mut all, key, cover));
            },
        );
        let mut covers: Vec<_> = all.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().collect();
        covers.sort_unstable_by_key(|&(key, _)| key);
        covers
    }

    /// What a triangle covers of the shared square that holds its centroid, if it is in one.
    fn cover(&self, sheet: &Sheet, corners: [u64; 3]) -> Option<(u64, Cover)> {
        let [a, b, c] = corners.map(|v| self.surface.position(v));
        let extent = a.max(b).max(c) - a.min(b).min(c);
        if extent.x.max(extent.y) > WIDEST_IN_SQUARES * sheet.side_m() {
            return None;
        }
        let centroid = (a + b + c) / 3.0;
        let square = sheet.square(centroid);
        sheet.is_shared(square).then(|| {
            let squares = (b - a).cross(c - a).z / 2.0 / (sheet.side_m() * sheet.side_m());
            let height = centroid.z / sheet.side_m();
            let steps = |value: f64, steps: f64| (value * steps) as i64;
            (square, Cover { triangles: 1, area: steps(squares, AREA_STEPS), height: steps(height, HEIGHT_STEPS) })
        })
    }
}
