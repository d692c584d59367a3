//! Builds PLY files byte by byte.

/// A value of a record.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    One(f64),
    Many(Vec<f64>),
}

#[derive(Debug, Clone)]
struct Column {
    declaration: String,
    values: Vec<Value>,
}

/// An element: columns of values under property declarations.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    name: String,
    /// What the header says, if not the truth.
    pub(crate) declared: Option<u64>,
    columns: Vec<Column>,
}

impl Element {
    pub(crate) fn new(name: &str) -> Element {
        Element { name: name.into(), declared: None, columns: Vec::new() }
    }

    /// Adds a property, declared as in a header (`float x`, `list uchar int vertex_indices`).
    pub(crate) fn with(mut self, declaration: &str, values: impl IntoIterator<Item = Value>) -> Element {
        self.columns.push(Column { declaration: declaration.into(), values: values.into_iter().collect() });
        self
    }

    pub(crate) fn numbers(self, declaration: &str, values: impl IntoIterator<Item = f64>) -> Element {
        self.with(declaration, values.into_iter().map(Value::One))
    }

    pub(crate) fn lists(self, declaration: &str, values: impl IntoIterator<Item = Vec<f64>>) -> Element {
        self.with(declaration, values.into_iter().map(Value::Many))
    }

    fn header(&self, newline: &str) -> String {
        let count = self.declared.unwrap_or(self.columns.first().map_or(0, |c| c.values.len() as u64));
        let mut text = format!("element {} {count}{newline}", self.name);
        for column in &self.columns {
            text += &format!("property {}{newline}", column.declaration);
        }
        text
    }

    fn payload(&self, out: &mut Vec<u8>, push: impl Fn(&mut Vec<u8>, &str, f64)) {
        for record in 0..self.columns.first().map_or(0, |c| c.values.len()) {
            for column in &self.columns {
                let words: Vec<&str> = column.declaration.split(' ').collect();
                match &column.values[record] {
                    Value::One(value) => push(out, words[0], *value),
                    Value::Many(values) => {
                        push(out, words[1], values.len() as f64);
                        values.iter().for_each(|v| push(out, words[2], *v));
                    }
                }
            }
        }
    }
}

/// The number with its highest byte first.
fn push_turned(out: &mut Vec<u8>, kind: &str, value: f64) {
    let start = out.len();
    push(out, kind, value);
    out[start..].reverse();
}

/// The number in words, one on a line.
fn push_text(out: &mut Vec<u8>, kind: &str, value: f64) {
    let text = if kind.starts_with("float") { (value as f32).to_string() } else { value.to_string() };
    out.extend(format!(" {text}\r\n").into_bytes());
}

fn push(out: &mut Vec<u8>, kind: &str, value: f64) {
    match kind {
        "char" | "int8" => out.extend((value as i8).to_le_bytes()),
        "uchar" | "uint8" => out.extend((value as u8).to_le_bytes()),
        "short" | "int16" => out.extend((value as i16).to_le_bytes()),
        "ushort" | "uint16" => out.extend((value as u16).to_le_bytes()),
        "int" | "int32" => out.extend((value as i32).to_le_bytes()),
        "uint" | "uint32" => out.extend((value as u32).to_le_bytes()),
        "int64" => out.extend((value as i64).to_le_bytes()),
        "uint64" => out.extend((value as u64).to_le_bytes()),
        "float" | "float32" => out.extend((value as f32).to_le_bytes()),
        "double" | "float64" => out.extend(value.to_le_bytes()),
        other => panic!("no such type: {other}"),
    }
}

/// The header of a little-endian file with these elements.
pub(crate) fn header(elements: &[&Element], newline: &str) -> String {
    let elements: String = elements.iter().map(|e| e.header(newline)).collect();
    format!("ply{newline}format binary_little_endian 1.0{newline}comment a test{newline}{elements}end_header{newline}")
}

/// A whole file.
pub(crate) fn file(elements: &[&Element]) -> Vec<u8> {
    file_with(elements, "\n")
}

/// A whole file with these line ends.
pub(crate) fn file_with(elements: &[&Element], newline: &str) -> Vec<u8> {
    let mut bytes = header(elements, newline).into_bytes();
    elements.iter().for_each(|e| e.payload(&mut bytes, push));
    bytes
}

/// A whole file in this encoding.
pub(crate) fn file_in(encoding: &str, elements: &[&Element]) -> Vec<u8> {
    let mut bytes = header(elements, "\n").replace("binary_little_endian", encoding).into_bytes();
    for element in elements {
        match encoding {
            "ascii" => element.payload(&mut bytes, push_text),
            "binary_little_endian" => element.payload(&mut bytes, push),
            _ => element.payload(&mut bytes, push_turned),
        }
    }
    bytes
}

/// A tetrahedron-like patch: five vertices over a square metre, four triangles about the middle.
pub(crate) const PLACES: [[f64; 3]; 5] =
    [[1.0, 2.0, 0.5], [2.0, 2.0, 0.25], [2.0, 3.0, 0.0], [1.0, 3.0, -0.25], [1.5, 2.5, 1.0]];
pub(crate) const TRIANGLES: [[u64; 3]; 4] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];

/// The column of one coordinate.
pub(crate) fn axis(i: usize) -> impl Iterator<Item = f64> {
    PLACES.into_iter().map(move |p| p[i])
}

/// The corner lists of the triangles.
pub(crate) fn corner_lists() -> impl Iterator<Item = Vec<f64>> {
    TRIANGLES.into_iter().map(|t| t.iter().map(|&v| v as f64).collect())
}

/// The vertices as doubles.
pub(crate) fn vertices() -> Element {
    Element::new("vertex").numbers("double x", axis(0)).numbers("double y", axis(1)).numbers("double z", axis(2))
}

/// The faces as most software writes them.
pub(crate) fn faces() -> Element {
    Element::new("face").lists("list uchar int vertex_indices", corner_lists())
}
