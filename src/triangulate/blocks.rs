//! The cloud in blocks that are triangulated one by one, each with what lies around it.

use super::density::Density;
use crate::geometry::DVec3;
use std::ops::Range;

/// Points of a block, at most, where cells can still be told apart. Neither threads nor memory change it, so that
/// triangles have the same numbers in every run.
pub(super) const MOST_POINTS: u64 = 1 << 17;

/// A block of cells.
pub(super) struct Block {
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
    /// Widest spacing of the points in it and around it, metres.
    pub(super) spacing_m: f64,
}

impl Block {
    fn of(columns: Range<u32>, rows: Range<u32>) -> Block {
        Block { columns, rows, spacing_m: 0.0 }
    }

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
    most_points: u64,
    halo_spacings: f64,
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
    /// Cuts the survey into blocks of `most_points`. A block needs the points up to so many spacings around it.
    pub(super) fn cut(density: &Density, most_points: u64, halo_spacings: f64) -> Blocks {
        let [columns, rows] = density.size();
        let mut blocks = Blocks { blocks: Vec::new(), nodes: Vec::new(), top: 0, most_points, halo_spacings };
        let all = Block::of(0..columns, 0..rows);
        blocks.top = blocks.add(density, all).unwrap_or(usize::MAX);
        blocks
    }

    /// Adds a part and its halves; none where it holds no points.
    fn add(&mut self, density: &Density, part: Block) -> Option<usize> {
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
        if points <= self.most_points || lines.len() == 1 {
            return Some(self.add_block(density, part));
        }
        let mut before = 0;
        let half = lines.iter().position(|n| {
            before += n;
            2 * before >= points
        });
        // At least one line on each side.
        let cut = (half.unwrap_or(0) as u32 + 1).min(lines.len() as u32 - 1);
        let Block { columns, rows, .. } = part;
        let halves = if along_rows {
            let middle = columns.start + cut;
            [Block::of(columns.start..middle, rows.clone()), Block::of(middle..columns.end, rows)]
        } else {
            let middle = rows.start + cut;
            [Block::of(columns.clone(), rows.start..middle), Block::of(columns, middle..rows.end)]
        };
        let halves = halves.map(|half| self.add(density, half));
        match halves {
            [Some(a), Some(b)] => {
                let sides = around(self.nodes[a].sides, self.nodes[b].sides);
                self.nodes.push(Node { sides, part: Part::Halves([a, b]) });
                Some(self.nodes.len() - 1)
            }
            [only, None] | [None, only] => only,
        }
    }

    fn add_block(&mut self, density: &Density, mut block: Block) -> usize {
        // What lies around may be wider spaced, and then one must look further: until nothing new is found.
        loop {
            let halo_m = self.halo_spacings * block.spacing_m;
            let [columns, rows] = density.grown(&block.columns, &block.rows, halo_m);
            let spacing_m = density.widest_m(&columns, &rows);
            if spacing_m <= block.spacing_m {
                break;
            }
            block.spacing_m = spacing_m;
        }
        let [low, high] = density.sides(&block.columns, &block.rows);
        let halo_m = self.halo_spacings * block.spacing_m;
        let sides = [low.map(|x| x - halo_m), high.map(|x| x + halo_m)];
        self.nodes.push(Node { sides, part: Part::Block(self.blocks.len() as u32) });
        self.blocks.push(block);
        self.nodes.len() - 1
    }

    /// Points of the largest block and all that it needs around it, at most.
    pub(super) fn largest_points(&self, density: &Density) -> u64 {
        let points = |block: &Block| -> u64 {
            let halo_m = self.halo_spacings * block.spacing_m;
            let [columns, rows] = density.grown(&block.columns, &block.rows, halo_m);
            let cells = rows.flat_map(|row| columns.clone().map(move |column| [column, row]));
            cells.map(|cell| u64::from(density.count(cell))).sum()
        };
        self.blocks.iter().map(points).max().unwrap_or(0).max(1)
    }

    /// Hands the blocks to `take` that a point is needed in.
    pub(super) fn around(&self, p: DVec3, mut take: impl FnMut(usize)) {
        self.below(self.top, p, &mut take);
    }

    fn below(&self, node: usize, p: DVec3, take: &mut impl FnMut(usize)) {
        let Some(node) = self.nodes.get(node) else { return };
        let [low, high] = node.sides;
        if p.x < low[0] || p.x > high[0] || p.y < low[1] || p.y > high[1] {
            return;
        }
        match node.part {
            Part::Block(block) => take(block as usize),
            Part::Halves(halves) => halves.into_iter().for_each(|half| self.below(half, p, take)),
        }
    }
}

fn around([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]]
}
