//! Files that say how far a survey was shifted: those of OpenDroneMap, Pix4D and others, told apart by what they hold.
//!
//! | form | holds |
//! |---|---|
//! | OpenDroneMap, `coords.txt` | `WGS84 UTM 17N`, then `EAST NORTH`; a line for each photograph follows. Heights are not shifted |
//! | `SHIFT.txt` | a CRS and its shift in one line, `EPSG:32633 500000 4600000 100`, or with the code alone |
//! | plain numbers (Pix4D, Skycatch) | `EAST NORTH` or `EAST NORTH UP`, by blanks, commas or lines |
//!
//! In all of them true = local + offset.

use super::error::OpenError;
use std::path::Path;

/// What an offset file says.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetFile {
    /// What kind of file it is, for people.
    pub form: &'static str,
    /// East, north and up shift, in units of the CRS.
    pub offset: [f64; 3],
    /// The CRS that it names, as a code.
    pub crs: Option<String>,
}

/// The largest shift, units of the CRS: that of `input.offset`.
const LARGEST: f64 = 1e9;
/// Heights are not shifted further: a larger third number is a northing behind something that is no easting.
const LARGEST_UP: f64 = 1e5;
/// Offset files are short, but OpenDroneMap's has a line for each photograph.
const LONGEST_BYTES: u64 = 64 << 20;

const ODM_EXAMPLE: &str = "  WGS84 UTM 17N\n  480000 4420000";
const SHIFT_EXAMPLE: &str = "  EPSG:32633 500000 4600000 100";
const PLAIN_EXAMPLE: &str = "  500000 4600000 100";

/// A line that is not what it should be.
struct Flaw {
    line: usize,
    found: String,
    expected: &'static str,
    example: &'static str,
}

/// A line with something on it, by its number.
type Line<'a> = (usize, &'a str);

impl OffsetFile {
    /// Reads an offset file.
    ///
    /// # Errors
    /// A file that cannot be read, or that is none of those above: with the line and an example.
    pub fn read(path: &Path) -> Result<OffsetFile, OpenError> {
        let name = || path.display().to_string();
        let unreadable = |source| OpenError::OffsetFileUnreadable { path: name(), source };
        let kind = std::fs::metadata(path).map_err(unreadable)?;
        let told = |flaw: Flaw| OpenError::OffsetFile {
            path: name(),
            line: flaw.line,
            found: flaw.found,
            expected: flaw.expected.to_owned(),
            example: flaw.example.to_owned(),
        };
        if !kind.is_file() || kind.len() > LONGEST_BYTES {
            let found = if kind.is_file() { format!("{} bytes", kind.len()) } else { "no regular file".to_owned() };
            return Err(told(Flaw { line: 1, found, expected: "a short text", example: PLAIN_EXAMPLE }));
        }
        let bytes = std::fs::read(path).map_err(unreadable)?;
        parse(&String::from_utf8_lossy(&bytes)).map_err(told)
    }
}

fn parse(text: &str) -> Result<OffsetFile, Flaw> {
    let text = text.trim_start_matches('\u{feff}');
    let lines: Vec<Line<'_>> = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .collect();
    let Some(&first) = lines.first() else {
        return Err(Flaw { line: 1, found: "nothing".to_owned(), expected: "an offset", example: PLAIN_EXAMPLE });
    };
    let words = words(first)?;
    let is = |i: usize, word: &str| words.get(i).is_some_and(|w| w.eq_ignore_ascii_case(word));
    if is(0, "WGS84") || (is(0, "WGS") && is(1, "84")) {
        return open_drone_map(first, &lines);
    }
    if let Some(code) = code(words[0]) {
        return match words.len() {
            1 => code_above_numbers(code, &lines),
            _ => shift(code, first, &words[1..], &lines),
        };
    }
    match (words.len(), words[0].parse::<u32>()) {
        (4, Ok(number @ 1024..=32_767)) => shift(format!("EPSG:{number}"), first, &words[1..], &lines),
        _ => plain(&lines),
    }
}

/// `EPSG:32633` in upper case, if the word is a code.
fn code(word: &str) -> Option<String> {
    let (authority, code) = word.split_once(':')?;
    let is_code = !code.is_empty() && code.chars().all(|c| c.is_ascii_digit() || c == '+');
    (authority.eq_ignore_ascii_case("EPSG") && is_code).then(|| format!("EPSG:{code}"))
}

/// What stands between blanks, or, where there are none, between commas or semicolons.
fn words((line, text): Line<'_>) -> Result<Vec<&str>, Flaw> {
    let by_blanks: Vec<&str> = text.split_whitespace().collect();
    let by_marks = |text| -> Vec<&str> { str::split(text, [',', ';']).map(str::trim).collect() };
    if by_blanks.len() == 1 {
        return Ok(by_marks(text.trim_end_matches([',', ';'])));
    }
    let bare: Vec<&str> = by_blanks.iter().map(|w| w.trim_end_matches([',', ';'])).collect();
    if bare.iter().any(|w| w.contains(',')) {
        let found = format!("`{}` has commas within words", super::crs::shorten(text));
        return Err(Flaw { line, found, expected: "a decimal point in numbers", example: PLAIN_EXAMPLE });
    }
    // A mark between blanks, as in `500000 , 4600000`.
    Ok(bare.into_iter().filter(|w| !w.is_empty()).collect())
}

fn numbers(line: Line<'_>, words: &[&str], expected: &'static str, example: &'static str) -> Result<Vec<f64>, Flaw> {
    let flaw = |found: String| Flaw { line: line.0, found, expected, example };
    let mut numbers = Vec::new();
    for word in words {
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() && number.abs() < LARGEST => numbers.push(number),
            Ok(number) => return Err(flaw(format!("{number} cannot be an offset"))),
            Err(_) => return Err(flaw(format!("`{}` is no number", super::crs::shorten(word)))),
        }
    }
    Ok(numbers)
}

/// East, north and up of two or three numbers.
fn shifts(line: Line<'_>, words: &[&str], expected: &'static str, example: &'static str) -> Result<[f64; 3], Flaw> {
    let flaw = |found: String| Flaw { line: line.0, found, expected, example };
    match numbers(line, words, expected, example)?.as_slice() {
        &[east, north] => Ok([east, north, 0.0]),
        &[east, north, up] if up.abs() < LARGEST_UP => Ok([east, north, up]),
        &[_, _, up] => Err(flaw(format!("a height of {up} is out of this world"))),
        other => Err(flaw(format!("there are {} numbers", other.len()))),
    }
}

fn open_drone_map(first: Line<'_>, lines: &[Line<'_>]) -> Result<OffsetFile, Flaw> {
    let flaw = |line: usize, found: String, expected| Flaw { line, found, expected, example: ODM_EXAMPLE };
    let joined: String = first.1.split_whitespace().collect::<String>().to_ascii_uppercase();
    let zone = joined.strip_prefix("WGS84UTM").and_then(|zone| {
        let (number, base) = match zone.strip_suffix('N') {
            Some(number) => (number, 32_600),
            None => (zone.strip_suffix('S')?, 32_700),
        };
        let number = number.parse::<u32>().ok().filter(|n| (1..=60).contains(n))?;
        Some(base + number)
    });
    let Some(code) = zone else {
        let found = format!("`{}` names no UTM zone", super::crs::shorten(first.1));
        return Err(flaw(first.0, found, "WGS84 UTM with a zone of 1 to 60 and N or S"));
    };
    let expected = "EAST NORTH";
    let Some(&second) = lines.get(1) else {
        return Err(flaw(first.0 + 1, "the file ends".to_owned(), expected));
    };
    match numbers(second, &words(second)?, expected, ODM_EXAMPLE)?.as_slice() {
        &[east, north] => {
            let crs = Some(format!("EPSG:{code}"));
            Ok(OffsetFile { form: "OpenDroneMap", offset: [east, north, 0.0], crs })
        }
        other => Err(flaw(second.0, format!("there are {} numbers", other.len()), expected)),
    }
}

/// A code on a line of its own. As in OpenDroneMap's files, lines behind two numbers are those of photographs.
fn code_above_numbers(code: String, lines: &[Line<'_>]) -> Result<OffsetFile, Flaw> {
    let expected = "two or three numbers below the code";
    let Some(&second) = lines.get(1) else {
        let found = "the file ends".to_owned();
        return Err(Flaw { line: lines[0].0 + 1, found, expected, example: SHIFT_EXAMPLE });
    };
    let words = words(second)?;
    let offset = shifts(second, &words, expected, SHIFT_EXAMPLE)?;
    if words.len() == 3 {
        nothing_behind(lines, 2, SHIFT_EXAMPLE)?;
    }
    Ok(OffsetFile { form: "shift with its CRS", offset, crs: Some(code) })
}

fn shift(code: String, line: Line<'_>, words: &[&str], lines: &[Line<'_>]) -> Result<OffsetFile, Flaw> {
    let offset = shifts(line, words, "a CRS, X, Y and Z", SHIFT_EXAMPLE)?;
    nothing_behind(lines, 1, SHIFT_EXAMPLE)?;
    Ok(OffsetFile { form: "shift with its CRS", offset, crs: Some(code) })
}

fn plain(lines: &[Line<'_>]) -> Result<OffsetFile, Flaw> {
    let expected = "two or three numbers";
    let form = "plain numbers";
    let first = words(lines[0])?;
    if first.len() > 1 {
        let offset = shifts(lines[0], &first, expected, PLAIN_EXAMPLE)?;
        nothing_behind(lines, 1, PLAIN_EXAMPLE)?;
        return Ok(OffsetFile { form, offset, crs: None });
    }
    let mut single = Vec::new();
    for &line in lines.iter().take(3) {
        let words = words(line)?;
        if words.len() != 1 {
            let found = format!("there are {} numbers below a line of one", words.len());
            return Err(Flaw { line: line.0, found, expected, example: PLAIN_EXAMPLE });
        }
        numbers(line, &words, expected, PLAIN_EXAMPLE)?;
        single.extend(words);
    }
    nothing_behind(lines, 3, PLAIN_EXAMPLE)?;
    let last = lines[lines.len() - 1];
    Ok(OffsetFile { form, offset: shifts(last, &single, expected, PLAIN_EXAMPLE)?, crs: None })
}

fn nothing_behind(lines: &[Line<'_>], used: usize, example: &'static str) -> Result<(), Flaw> {
    match lines.get(used) {
        None => Ok(()),
        Some(&(line, text)) => {
            let found = format!("`{}` follows", super::crs::shorten(text));
            Err(Flaw { line, found, expected: "nothing behind the offset", example })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (String, [f64; 3], Option<String>) {
        let found = parse(text).unwrap_or_else(|flaw| panic!("{text:?}: line {}: {}", flaw.line, flaw.found));
        (found.form.to_owned(), found.offset, found.crs)
    }

    #[test]
    fn every_form_is_told_by_what_it_holds() {
        let odm = |crs: &str, offset| ("OpenDroneMap".to_owned(), offset, Some(crs.to_owned()));
        let shift = |offset| ("shift with its CRS".to_owned(), offset, Some("EPSG:32633".to_owned()));
        let plain = |offset| ("plain numbers".to_owned(), offset, None);
        for (text, expected) in [
            ("WGS84 UTM 17N\n480000 4420000\n1.5 -2.5 120.25\n3 4 121\n", odm("EPSG:32617", [480e3, 4420e3, 0.0])),
            ("\u{feff}wgs84 utm 59s\r\n410000.5 5250000.25\r\n", odm("EPSG:32759", [410_000.5, 5_250_000.25, 0.0])),
            ("WGS84 UTM 5 N\n1 2", odm("EPSG:32605", [1.0, 2.0, 0.0])),
            ("EPSG:32633 500000 4600000 100\n", shift([5e5, 46e5, 100.0])),
            ("32633 500000 4600000 100", shift([5e5, 46e5, 100.0])),
            ("epsg:32633,500000,4600000,-3.5", shift([5e5, 46e5, -3.5])),
            ("EPSG:32633 500000 4600000", shift([5e5, 46e5, 0.0])),
            ("EPSG:32633\n500000 4600000 100", shift([5e5, 46e5, 100.0])),
            ("EPSG:32633\n500000 4600000\n0.5 0.5 3\n", shift([5e5, 46e5, 0.0])),
            ("500000.000 4600000.000 100.000\n", plain([5e5, 46e5, 100.0])),
            ("500000.000,4600000.000,100.000", plain([5e5, 46e5, 100.0])),
            ("500000, 4600000, 100", plain([5e5, 46e5, 100.0])),
            ("500000 , 4600000", plain([5e5, 46e5, 0.0])),
            ("# east, north, up\n500000\n4600000\n100\n", plain([5e5, 46e5, 100.0])),
            ("500000\n\n4600000,\n", plain([5e5, 46e5, 0.0])),
            ("-3\t-4\t5e1", plain([-3.0, -4.0, 50.0])),
        ] {
            assert_eq!(read(text), expected, "{text:?}");
        }
    }

    #[test]
    fn anything_else_is_refused_with_the_line_and_an_example() {
        for (text, line, says) in [
            ("", 1, "nothing"),
            ("# only this\n", 1, "nothing"),
            ("WGS84 UTM 61N\n1 2", 1, "names no UTM zone"),
            ("WGS84 UTM 17\n1 2", 1, "names no UTM zone"),
            ("WGS84 UTM 17N\n", 2, "the file ends"),
            ("WGS84 UTM 17N\n480000\n", 2, "1 numbers"),
            ("WGS84 UTM 17N\n480000 4420000 100\n", 2, "3 numbers"),
            ("WGS84 UTM 17N\n\neast north\n", 3, "`east` is no number"),
            ("EPSG:32633\n", 2, "the file ends"),
            ("EPSG:32633 500000 4600000 100 7", 1, "4 numbers"),
            ("EPSG:32633 500000 4600000 100\n1 2 3", 2, "`1 2 3` follows"),
            ("500000 4600000 100\n500001 4600001 101\n", 2, "follows"),
            ("500000", 1, "1 numbers"),
            ("1\n2\n3\n4\n", 4, "`4` follows"),
            ("1\n2 3\n", 2, "2 numbers below"),
            ("500000,5 4600000,5 100,5", 1, "commas within words"),
            ("32633 500000 4600000", 1, "out of this world"),
            ("99999 500000 4600000 100", 1, "4 numbers"),
            ("inf 0 0", 1, "cannot be an offset"),
            ("1e12 0 0", 1, "cannot be an offset"),
            ("+proj=utm +zone=33\n1 2", 1, "no number"),
            ("hello", 1, "`hello` is no number"),
        ] {
            let flaw = parse(text).expect_err(text);
            assert_eq!(flaw.line, line, "{text:?}: {}", flaw.found);
            assert!(flaw.found.contains(says), "{text:?}: {}", flaw.found);
            assert!(!flaw.expected.is_empty() && flaw.example.starts_with("  "));
        }
    }
}
