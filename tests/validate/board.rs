//! Boards of unit squares, each two triangles, on which stones are patches: areas can be counted by hand.

use gravelometer::geometry::DVec3;
use gravelometer::validate::{Labels, Scored, TrueStone, Truth, score};
use std::fmt::Write;
use std::path::Path;

/// A map of squares, rows from the top, `.` for sand and a letter for each stone or grain: `a` is 0.
pub struct Board {
    pub rows: Vec<String>,
}

impl Board {
    pub fn new(rows: &[&str]) -> Board {
        Board { rows: rows.iter().map(|&row| row.to_owned()).collect() }
    }

    pub fn width(&self) -> usize {
        self.rows[0].len()
    }

    /// The letter of each triangle: 0 for `a`, -1 for `.`.
    pub fn of_triangles(&self) -> Vec<i32> {
        let number = |c: u8| if c == b'.' { -1 } else { i32::from(c - b'a') };
        self.rows.iter().flat_map(|row| row.bytes()).flat_map(|c| [number(c); 2]).collect()
    }

    pub fn labels(&self) -> Labels {
        Labels::of_triangles(self.of_triangles().into_iter().map(i64::from).collect())
    }

    /// Vertices with a bulge, so that no patch is flat.
    pub fn points(&self) -> Vec<DVec3> {
        let (width, height) = (self.width() + 1, self.rows.len() + 1);
        let bulge = |x: usize, y: usize| 0.01 * ((x * 7 + y * 13) % 5) as f64;
        (0..width * height)
            .map(|i| (i % width, i / width))
            .map(|(x, y)| DVec3::new(x as f64, -(y as f64), bulge(x, y)))
            .collect()
    }

    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let (width, height) = (self.width(), self.rows.len());
        let corner = |x: usize, y: usize| (y * (width + 1) + x) as u32;
        (0..width * height)
            .map(|i| (i % width, i / width))
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [corner(x, y), corner(x, y + 1), corner(x + 1, y + 1), corner(x + 1, y)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    /// The board as truth: every stone has axes 3, 2, 1 m along x, y, z and is visible.
    pub fn truth(&self) -> Truth {
        let stones = self.of_triangles().into_iter().max().map_or(0, |most| (most + 1) as usize);
        let stone =
            TrueStone { directions: Some([DVec3::X, DVec3::Y, DVec3::Z]), ..TrueStone::of_axes([3.0, 2.0, 1.0]) };
        Truth::new(self.points(), self.triangles(), self.of_triangles(), vec![stone; stones])
    }

    /// Scores grains on this board.
    pub fn scored(&self, grains: &[&str]) -> Scored {
        score(&self.truth(), &Board::new(grains).labels(), 0.0)
    }

    /// Writes the mesh as PLY, with numbers for each face and vertex if they are given.
    pub fn write_ply(&self, path: &Path, faces: Option<(&str, &[i32])>, vertices: Option<(&str, &[i32])>) {
        let (points, triangles) = (self.points(), self.triangles());
        let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
        text += "property double x\nproperty double y\nproperty double z\n";
        if let Some((declaration, _)) = vertices {
            writeln!(text, "property {declaration}").unwrap();
        }
        writeln!(text, "element face {}\nproperty list uchar int vertex_indices", triangles.len()).unwrap();
        if let Some((declaration, _)) = faces {
            writeln!(text, "property {declaration}").unwrap();
        }
        text += "end_header\n";
        for (i, p) in points.iter().enumerate() {
            let label = vertices.map_or_else(String::new, |(_, numbers)| numbers[i].to_string());
            writeln!(text, "{} {} {} {label}", p.x, p.y, p.z).unwrap();
        }
        for (i, [a, b, c]) in triangles.iter().enumerate() {
            let label = faces.map_or_else(String::new, |(_, numbers)| numbers[i].to_string());
            writeln!(text, "3 {a} {b} {c} {label}").unwrap();
        }
        std::fs::write(path, text).unwrap();
    }

    /// Writes a folder of known stones: all of them visible.
    pub fn write_truth(&self, folder: &Path) {
        std::fs::create_dir_all(folder).unwrap();
        self.write_ply(&folder.join("mesh.ply"), None, None);
        write_npz(&folder.join("truth.npz"), &[("tri_id", &self.of_triangles()), ("tri_strict", &self.of_triangles())]);
        let stones = self.of_triangles().into_iter().max().unwrap_or(-1) + 1;
        let rows: String = (0..stones).map(|i| format!("{i},1,9.0,3,2,1,1,0,0,0,1,0,0,0,1\n")).collect();
        let header = "id,visible,component_area,A,B,C,r00,r01,r02,r10,r11,r12,r20,r21,r22";
        std::fs::write(folder.join("truth.csv"), format!("{header}\n{rows}")).unwrap();
    }
}

/// Writes named arrays of `int32`.
pub fn write_npz(path: &Path, arrays: &[(&str, &[i32])]) {
    use npyz::WriterBuilder;
    let mut archive = npyz::npz::NpzWriter::create(path).unwrap();
    for (name, numbers) in arrays {
        let shape = [numbers.len() as u64];
        let array = archive.array::<i32>(name, Default::default()).unwrap();
        let mut writer = array.default_dtype().shape(&shape).begin_nd().unwrap();
        writer.extend(numbers.iter().copied()).unwrap();
        writer.finish().unwrap();
    }
}
