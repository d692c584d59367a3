//! The cloud in blocks that are triangulated one by one, each with what lies around it.

use super::density::Density;
use crate::geometry::DVec3;
use std::ops::Range;

/// Points of a block, at most, where cells can still be told apart. Neither threads nor memory change it, so that
/// triangles have the same numbers in every run.
const MOST_POINTS: u64 = 1 << 16;

/// Points of a block with its halo, in eighths of those within.
const HALO_FACTOR_EIGHTHS: u64 = 11;

/// A block of cells.
pub(super) struct Block {
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
}

impl Block {
    /// Whether a cell is in the block.
    pub(super) fn holds(&self, [column, row]: [u32; 2]) -> bool {
        self.columns.contains(&column) && self.rows.contains(&row)
    }
}

/// All blocks, and a tree that finds those that a point is needed in.
pub(super) struct Blocks {
    pub(super) blocks: Vec<Block>,
    nodes: Vec<Node>,
    top: usize,
}

/// Part of the survey: what it and its halo cover, metres in plan, and its halves or its block.
struct Node {
    sides: [[f64; 2]; 2],
    part: Part,
}

enum Part {
    Block(u32),
    Halves([usize; 2]),
}

impl Blocks {
    /// Cuts the survey. A block needs the points up to `halo_m` of its widest spacing around it.
    pub(super) fn cut(density: &Density, halo_m: impl Fn(f64) -> f64) -> Blocks {
        let [columns, rows] = density.size();
        let mut blocks = Blocks { blocks: Vec::new(), nodes: Vec::new(), top: 0 };
        let all = Block { columns: 0..columns, rows: 0..rows };
        blocks.top = blocks.add(density, all, &halo_m).unwrap_or(usize::MAX);
        blocks
    }

    /// Adds a part and its halves; none where it holds no points.
    fn add(&mut self, density: &Density, part: Block, halo_m: &impl Fn(f64) -> f64) -> Option<usize> {
        let (width, height) = (part.columns.len(), part.rows.len());
        let along_rows = width >= height;
        // Points in each column, or row, of the longer side.
        let mut lines = vec![0u64; width.max(height)];
        for row in part.rows.clone() {
            for column in part.columns.clone() {
                let line = if along_rows { column - part.columns.start } else { row - part.rows.start };
                lines[line as usize] += u64::from(density.count([column, row]));
            }
        }
        let points: u64 = lines.iter().sum();
        if points == 0 {
            return None;
        }
        if points <= MOST_POINTS || lines.len() == 1 {
            return Some(self.add_block(density, part, halo_m));
        }
        let mut before = 0;
        let half = lines.iter().position(|n| {
            before += n;
            2 * before >= points
        });
        // At least one line on each side.
        let cut = (half.unwrap_or(0) as u32 + 1).min(lines.len() as u32 - 1);
        let Block { columns, rows } = part;
        let halves = if along_rows {
            let middle = columns.start + cut;
            [Block { columns: columns.start..middle, rows: rows.clone() }, Block { columns: middle..columns.end, rows }]
        } else {
            let middle = rows.start + cut;
            [Block { columns: columns.clone(), rows: rows.start..middle }, Block { columns, rows: middle..rows.end }]
        };
        let halves = halves.map(|half| self.add(density, half, halo_m));
        match halves {
            [Some(a), Some(b)] => {
                let sides = around(self.nodes[a].sides, self.nodes[b].sides);
                self.nodes.push(Node { sides, part: Part::Halves([a, b]) });
                Some(self.nodes.len() - 1)
            }
            [only, None] | [None, only] => only,
        }
    }

    fn add_block(&mut self, density: &Density, block: Block, halo_m: &impl Fn(f64) -> f64) -> usize {
        let cells = block.rows.clone().flat_map(|row| block.columns.clone().map(move |column| [column, row]));
        let occupied = cells.filter(|&cell| density.count(cell) > 0);
        let widest_m = occupied.map(|cell| density.spacing_m(cell)).fold(0.0, f64::max);
        let [low, high] = density.sides(&block.columns, &block.rows);
        let halo_m = halo_m(widest_m);
        let sides = [low.map(|x| x - halo_m), high.map(|x| x + halo_m)];
        self.nodes.push(Node { sides, part: Part::Block(self.blocks.len() as u32) });
        self.blocks.push(block);
        self.nodes.len() - 1
    }

    /// Points of the largest block and its halo, about.
    pub(super) fn largest_points(&self, density: &Density) -> u64 {
        let points = |block: &Block| -> u64 {
            let cells = block.rows.clone().flat_map(|row| block.columns.clone().map(move |column| [column, row]));
            cells.map(|cell| u64::from(density.count(cell))).sum()
        };
        self.blocks.iter().map(points).max().unwrap_or(0).max(1) * HALO_FACTOR_EIGHTHS / 8
    }

    /// Hands the blocks to `take` that a point is needed in.
    pub(super) fn around(&self, p: DVec3, mut take: impl FnMut(usize)) {
        let mut waiting = [0usize; 64];
        let mut n = 0;
        if self.top < self.nodes.len() {
            (waiting[0], n) = (self.top, 1);
        }
        while n > 0 {
            n -= 1;
            let node = &self.nodes[waiting[n]];
            let [low, high] = node.sides;
            if p.x < low[0] || p.x > high[0] || p.y < low[1] || p.y > high[1] {
                continue;
            }
            match node.part {
                Part::Block(block) => take(block as usize),
                // Every cut halves columns or rows, of which there are fewer than 2^24 each: no path is longer than 48.
                Part::Halves([a, b]) => {
                    (waiting[n], waiting[n + 1]) = (b, a);
                    n += 2;
                }
            }
        }
    }
}

fn around([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]]
}
