//! PLY headers: which elements follow, in which order, with which properties.
//!
//! The grammar is that of `ply-rs-bw`. Lines are cut here, because the byte at which the payload starts
//! must be known exactly, and names are swapped for plain ones before the grammar sees them, because it
//! refuses names that CloudCompare writes (`scalar_CANUPO.class`), merges properties of the same name
//! (which would shift every byte behind them) and stops at comments that are not UTF-8. Types of 64 bits, which it
//! does not know, go the same way.

use super::error::OpenError;
use super::scalar::Scalar;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Encoding, PropertyType, ScalarType};
use std::collections::HashSet;
use std::fmt;

/// The words that a header line may begin with, comments aside.
const KEYWORDS: [&str; 5] = ["ply", "format", "element", "property", "end_header"];

/// Longest header that is looked for, bytes.
const LONGEST_HEADER: usize = 1 << 20;

/// What a PLY file declares.
#[derive(Debug, Clone)]
pub(super) struct PlyHeader {
    /// Encoding of the payload.
    pub(super) encoding: Encoding,
    /// Elements in file order.
    pub(super) elements: Vec<Element>,
    /// `comment` and `obj_info` texts in file order.
    pub(super) comments: Vec<String>,
    /// Lines that begin with no word of PLY, as a comment does that lacks its `comment`: number, from 1, and text.
    pub(super) skipped: Vec<(u64, String)>,
    /// First byte of the payload.
    pub(super) payload: u64,
    /// Lines before it.
    pub(super) lines: u64,
}

/// One element: `count` records of the same properties.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// One property of an element.
#[derive(Debug, Clone)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// A number or a list of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Scalar),
    List { length: Scalar, entry: Scalar },
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Number(scalar) => f.write_str(scalar.ply_name()),
            Kind::List { length, entry } => write!(f, "list {} {}", length.ply_name(), entry.ply_name()),
        }
    }
}

impl Element {
    /// The names of the properties, for messages.
    pub(super) fn property_names(&self) -> String {
        self.properties.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

impl PlyHeader {
    /// Reads the header at the start of `bytes`; `path` is for messages.
    ///
    /// # Errors
    /// No PLY, no end, a line outside the grammar, an element declared twice, a list whose length is a float.
    pub(super) fn parse(path: &str, bytes: &[u8]) -> Result<PlyHeader, OpenError> {
        let lines = HeaderLines::cut(path, bytes)?;
        let plain = PlainHeader::new(&lines.texts);
        let mut reader = Reader::new(plain.text.as_bytes());
        let parsed = Parser::<DefaultElement>::new().read_header(&mut reader).map_err(|e| {
            let line = e.line().unwrap_or(1);
            let text = lines.texts.get(line.saturating_sub(1)).cloned().unwrap_or_default();
            // The first line of the parser's message says what; the rest quotes the plain text, not the file's.
            let full = e.to_string();
            let reason = full.lines().next().unwrap_or_default();
            let reason = reason.split_once(": ").map_or(reason, |(_, r)| r).trim_end_matches('.').to_owned();
            OpenError::HeaderLine { path: path.to_owned(), line: line as u64, text: shorten(&text), reason }
        })?;
        let mut words = plain.words.into_iter();
        let mut word = || words.next().unwrap_or_default();
        let elements = parsed
            .elements
            .values()
            .map(|e| Element {
                name: word().name,
                count: e.count as u64,
                properties: e
                    .properties
                    .values()
                    .map(|p| {
                        let Words { name, wide } = word();
                        Property { name, kind: kind_of(&p.data_type, wide) }
                    })
                    .collect(),
            })
            .collect();
        let header = PlyHeader {
            encoding: parsed.encoding,
            elements,
            comments: plain.comments,
            skipped: plain.skipped,
            payload: lines.payload,
            lines: lines.texts.len() as u64,
        };
        header.check(path)?;
        Ok(header)
    }

    fn check(&self, path: &str) -> Result<(), OpenError> {
        let mut names = HashSet::new();
        for element in &self.elements {
            if !names.insert(element.name.as_str()) {
                return Err(OpenError::RepeatedElement { path: path.to_owned(), element: element.name.clone() });
            }
            for property in &element.properties {
                if let Kind::List { length, .. } = property.kind
                    && !length.is_integer()
                {
                    return Err(OpenError::PropertyKind {
                        path: path.to_owned(),
                        element: element.name.clone(),
                        property: property.name.clone(),
                        kind: property.kind.to_string(),
                        expected: "a list whose length is an integer type",
                    });
                }
            }
        }
        Ok(())
    }

    /// The element of that name.
    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }
}

/// The type of 64 bits of this name.
fn wide(name: &str) -> Option<Scalar> {
    [Scalar::I64, Scalar::U64].into_iter().find(|s| s.ply_name() == name)
}

/// A type that the grammar knows in place of one that it does not.
fn narrow(name: &str) -> &str {
    if wide(name).is_some() { "int" } else { name }
}

fn kind_of(kind: &PropertyType, wide: [Option<Scalar>; 2]) -> Kind {
    let scalar = |s: &ScalarType| match s {
        ScalarType::Char => Scalar::I8,
        ScalarType::UChar => Scalar::U8,
        ScalarType::Short => Scalar::I16,
        ScalarType::UShort => Scalar::U16,
        ScalarType::Int => Scalar::I32,
        ScalarType::UInt => Scalar::U32,
        ScalarType::Float => Scalar::F32,
        ScalarType::Double => Scalar::F64,
    };
    match kind {
        PropertyType::Scalar(s) => Kind::Number(wide[0].unwrap_or_else(|| scalar(s))),
        PropertyType::List(length, entry) => Kind::List {
            length: wide[0].unwrap_or_else(|| scalar(length)),
            entry: wide[1].unwrap_or_else(|| scalar(entry)),
        },
    }
}

fn shorten(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(80).collect()
}

/// The header's lines without their ends, `end_header` included, and the byte behind them.
struct HeaderLines {
    texts: Vec<String>,
    payload: u64,
}

impl HeaderLines {
    fn cut(path: &str, bytes: &[u8]) -> Result<HeaderLines, OpenError> {
        let head = &bytes[..bytes.len().min(LONGEST_HEADER)];
        let (mut texts, mut at, mut old_mac) = (Vec::new(), 0, false);
        while at < head.len() {
            let end = head[at..].iter().position(|&b| b == b'\n' || b == b'\r').map_or(head.len(), |n| at + n);
            let mut text = String::from_utf8_lossy(&head[at..end]).trim().to_owned();
            let crlf = head[end..].starts_with(b"\r\n");
            if texts.is_empty() {
                // Some editors put a byte order mark before text.
                text = text.trim_start_matches('\u{feff}').to_owned();
                if text != "ply" {
                    return Err(OpenError::NotPly {
                        path: path.to_owned(),
                        start: shorten(&text.escape_debug().to_string()),
                    });
                }
                old_mac = head.get(end) == Some(&b'\r') && !crlf;
            }
            // With lone carriage returns, a line feed behind `end_header` is the first byte of the payload.
            at = (end + if crlf && !old_mac { 2 } else { 1 }).min(head.len());
            let last = text == "end_header";
            texts.push(text);
            if last {
                return Ok(HeaderLines { texts, payload: at as u64 });
            }
        }
        Err(OpenError::HeaderUnended { path: path.to_owned(), searched: head.len() as u64 })
    }
}

/// The header with plain names, line by line as in the file; what was taken out of it lies beside.
struct PlainHeader {
    text: String,
    words: Vec<Words>,
    comments: Vec<String>,
    skipped: Vec<(u64, String)>,
}

/// What the grammar is not shown of an element or a property.
#[derive(Default)]
struct Words {
    name: String,
    wide: [Option<Scalar>; 2],
}

impl PlainHeader {
    fn new(lines: &[String]) -> PlainHeader {
        let mut plain =
            PlainHeader { text: String::new(), words: Vec::new(), comments: Vec::new(), skipped: Vec::new() };
        for (number, line) in (1..).zip(lines) {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let rewritten = match words.as_slice() {
                [] => "comment".to_owned(),
                [first @ ("comment" | "obj_info"), ..] => {
                    plain.comments.push(line[first.len()..].trim().to_owned());
                    "comment".to_owned()
                }
                ["element", name, count] => {
                    let n = plain.take(name, [None; 2]);
                    format!("element n{n} {count}")
                }
                // Behind the types is the name, and some have blanks in it.
                ["property", "list", length, entry, name @ ..] if !name.is_empty() => {
                    let n = plain.take(&name.join(" "), [wide(length), wide(entry)]);
                    format!("property list {} {} n{n}", narrow(length), narrow(entry))
                }
                ["property", kind, name @ ..] if !name.is_empty() && *kind != "list" => {
                    let n = plain.take(&name.join(" "), [wide(kind), None]);
                    format!("property {} n{n}", narrow(kind))
                }
                [word, ..] if !KEYWORDS.contains(word) && !line.contains(|c: char| c.is_control() && c != '\t') => {
                    plain.skipped.push((number, shorten(line)));
                    "comment".to_owned()
                }
                _ => words.join(" "),
            };
            plain.text.push_str(&rewritten);
            plain.text.push('\n');
        }
        plain
    }

    fn take(&mut self, name: &str, wide: [Option<Scalar>; 2]) -> usize {
        self.words.push(Words { name: name.to_owned(), wide });
        self.words.len()
    }
}
