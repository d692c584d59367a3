//! From what was named to the files of a survey: folders, patterns and lists become paths.

use super::error::OpenError;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The files of a survey.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inputs {
    /// Files, in the order in which they count.
    pub paths: Vec<PathBuf>,
    /// What was left out, for people.
    pub notes: Vec<String>,
}

/// How the names of surveys end.
const ENDINGS: [&str; 3] = ["ply", "las", "laz"];
/// Our own results: never an input unless they are named.
const OWN_RESULTS: [&str; 2] = ["labelled_mesh.ply", "labelled_cloud.laz"];
/// Kinds of files that a message counts.
const KINDS_SHOWN: usize = 6;

/// Makes files of what was named. A file stands for itself, a folder for the `*.ply`, `*.las` and `*.laz` right in it
/// and a pattern (`*`, `?`, `[ab]`) for what matches, both by their names in byte order; `@LIST` for the lines of a
/// text file, relative to its folder, `#` for comments. Our own results are left out of folders and patterns.
///
/// What is no folder and no pattern is passed on as it is: whoever opens it says what is wrong with it.
///
/// # Errors
/// A folder or pattern without surveys, with what is there instead; a survey that is there in two formats; a list that
/// cannot be read.
pub fn resolve_inputs(named: &[PathBuf]) -> Result<Inputs, OpenError> {
    let mut inputs = Inputs { paths: Vec::new(), notes: Vec::new() };
    for path in named {
        match list_name(path) {
            Some(list) => inputs.add_list(&list)?,
            None => inputs.add(path)?,
        }
    }
    Ok(inputs)
}

/// The list that `@LIST` names, unless a file is called that.
fn list_name(path: &Path) -> Option<PathBuf> {
    let list = path.to_str()?.strip_prefix('@')?;
    (!path.exists()).then(|| PathBuf::from(list))
}

impl Inputs {
    fn add(&mut self, path: &Path) -> Result<(), OpenError> {
        if path.is_dir() {
            return self.add_folder(path);
        }
        let is_pattern = |text: &&str| text.contains(['*', '?', '[']) && !path.exists();
        match path.to_str().filter(is_pattern) {
            Some(pattern) => self.add_pattern(pattern),
            None => {
                self.paths.push(path.to_owned());
                Ok(())
            }
        }
    }

    fn add_list(&mut self, list: &Path) -> Result<(), OpenError> {
        let text = std::fs::read_to_string(list)
            .map_err(|source| OpenError::InputList { path: list.display().to_string(), source })?;
        let folder = list.parent().unwrap_or(Path::new(""));
        let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
        let mut is_empty = true;
        for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
            is_empty = false;
            self.add(&folder.join(line))?;
        }
        if is_empty {
            return Err(OpenError::InputListEmpty { path: list.display().to_string() });
        }
        Ok(())
    }

    fn add_folder(&mut self, folder: &Path) -> Result<(), OpenError> {
        let path = || folder.display().to_string();
        let unreadable = |source| OpenError::Unreadable { path: path(), source };
        let mut files = Vec::new();
        let mut others = BTreeMap::<String, usize>::new();
        for entry in std::fs::read_dir(folder).map_err(unreadable)? {
            let file = entry.map_err(unreadable)?.path();
            let ending = ending(&file);
            if file.is_dir() {
                *others.entry("folders".to_owned()).or_default() += 1;
            } else if ENDINGS.contains(&ending.as_str()) {
                files.push(file);
            } else {
                let kind = if ending.is_empty() { "files without an ending".to_owned() } else { format!(".{ending}") };
                *others.entry(kind).or_default() += 1;
            }
        }
        let results = self.leave_out_results(&mut files);
        if files.is_empty() {
            if results > 0 {
                others.insert("results of a run".to_owned(), results);
            }
            return Err(OpenError::NoSurveysInFolder { path: path(), found: counted(&others) });
        }
        self.leave_out_reordered(&mut files);
        files.sort();
        if let Some([one, other]) = same_survey(&files) {
            return Err(OpenError::TwoFormats { one, other });
        }
        self.paths.extend(files);
        Ok(())
    }

    fn add_pattern(&mut self, pattern: &str) -> Result<(), OpenError> {
        let matches = glob::glob(pattern)
            .map_err(|e| OpenError::Pattern { pattern: pattern.to_owned(), reason: e.to_string() })?;
        let mut files = Vec::new();
        for found in matches {
            let file =
                found.map_err(|e| OpenError::Unreadable { path: e.path().display().to_string(), source: e.into() })?;
            if !file.is_dir() {
                files.push(file);
            }
        }
        let results = self.leave_out_results(&mut files);
        if files.is_empty() {
            let but = if results > 0 { " but results of a run" } else { "" };
            return Err(OpenError::NoMatch { pattern: pattern.to_owned(), but });
        }
        files.sort();
        self.paths.extend(files);
        Ok(())
    }

    /// Leaves out what a run wrote, and counts it.
    fn leave_out_results(&mut self, files: &mut Vec<PathBuf>) -> usize {
        let before = files.len();
        files.retain(|file| {
            let is_result = OWN_RESULTS.iter().any(|name| file.file_name() == Some(OsStr::new(name)));
            if is_result {
                self.notes.push(format!("{} is left out: it is the result of a run", file.display()));
            }
            !is_result
        });
        before - files.len()
    }

    /// Leaves out `reach.copc.laz` where `reach.laz` or `reach.las` is there: the same points in another order.
    fn leave_out_reordered(&mut self, files: &mut Vec<PathBuf>) {
        let stems: Vec<_> = files.iter().filter_map(|f| f.file_stem().map(OsStr::to_owned)).collect();
        files.retain(|file| {
            let Some(inner) = file.file_stem().map(Path::new) else { return true };
            let is_copy =
                ending(inner) == "copc" && inner.file_stem().is_some_and(|plain| stems.iter().any(|s| s == plain));
            if is_copy {
                self.notes.push(format!("{} is left out: the same points are there in another order", file.display()));
            }
            !is_copy
        });
    }
}

/// The ending of a name, in small letters.
fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Two files that differ only in their endings.
fn same_survey(files: &[PathBuf]) -> Option<[String; 2]> {
    let mut stems = BTreeMap::new();
    for file in files {
        if let Some(first) = stems.insert(file.file_stem(), file) {
            return Some([first, file].map(|f| f.display().to_string()));
        }
    }
    None
}

fn counted(kinds: &BTreeMap<String, usize>) -> String {
    if kinds.is_empty() {
        return "is empty".to_owned();
    }
    let shown: Vec<String> = kinds.iter().take(KINDS_SHOWN).map(|(kind, n)| format!("{n} {kind}")).collect();
    let more = if kinds.len() > KINDS_SHOWN { " and others" } else { "" };
    format!("holds {}{more}", shown.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("temporary folder");
        for name in names {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("folders");
            std::fs::write(path, "").expect("a file");
        }
        folder
    }

    fn found(folder: &Path, named: &Path) -> (Vec<String>, Vec<String>) {
        let inputs = resolve_inputs(&[named.to_owned()]).unwrap_or_else(|e| panic!("{e}"));
        let name = |p: &PathBuf| p.strip_prefix(folder).expect("in the folder").to_string_lossy().into_owned();
        (inputs.paths.iter().map(name).collect(), inputs.notes)
    }

    fn refused(named: &Path) -> String {
        let message = resolve_inputs(&[named.to_owned()]).expect_err("must be refused").to_string();
        assert!(message.contains("\nhelp: "), "{message}");
        message
    }

    #[test]
    fn a_folder_gives_its_surveys_in_byte_order_and_nothing_else() {
        let folder = folder(&["b2.ply", "b10.PLY", "a.laz", "c.Las", "notes.txt", "below/d.ply", "labelled_mesh.ply"]);
        std::fs::create_dir(folder.path().join("e.ply")).expect("a folder with the name of a survey");
        let (names, notes) = found(folder.path(), folder.path());
        assert_eq!(names, ["a.laz", "b10.PLY", "b2.ply", "c.Las"]);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("labelled_mesh.ply is left out"), "{notes:?}");
    }

    #[test]
    fn points_are_not_taken_twice_because_they_are_there_in_another_order() {
        let folder = folder(&["a.copc.laz", "a.laz", "b.copc.laz", "c.las", "c.COPC.laz"]);
        let (names, notes) = found(folder.path(), folder.path());
        assert_eq!(names, ["a.laz", "b.copc.laz", "c.las"]);
        assert_eq!(notes.len(), 2, "{notes:?}");
    }

    #[test]
    fn a_survey_in_two_formats_is_refused_with_both_named() {
        let folder = folder(&["a.ply", "b.ply", "b.laz"]);
        let message = refused(folder.path());
        assert!(message.contains("b.laz") && message.contains("b.ply"), "{message}");
    }

    #[test]
    fn a_folder_without_surveys_says_what_it_holds() {
        let nothing = folder(&[]);
        assert!(refused(nothing.path()).contains("is empty"));
        let others = folder(&["a.jpg", "b.JPG", "README", "below/a.ply", "labelled_cloud.laz"]);
        let message = refused(others.path());
        for part in ["2 .jpg", "1 files without an ending", "1 folders", "1 results of a run"] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }

    #[test]
    fn a_pattern_gives_what_matches_and_says_so_when_nothing_does() {
        let folder = folder(&["blocks/b2.ply", "blocks/b10.ply", "blocks/c.laz", "blocks/labelled_mesh.ply"]);
        let (names, notes) = found(folder.path(), &folder.path().join("blocks/*.ply"));
        assert_eq!(names, ["blocks/b10.ply", "blocks/b2.ply"]);
        assert_eq!(notes.len(), 1);
        assert_eq!(found(folder.path(), &folder.path().join("bl*/b?.ply")).0, ["blocks/b2.ply"]);
        assert!(refused(&folder.path().join("blocks/*.las")).contains("nothing matches"));
        assert!(refused(&folder.path().join("blocks/label*")).contains("but results of a run"));
        assert!(refused(&folder.path().join("blocks/***.ply")).contains("***"));
    }

    #[test]
    fn a_file_whose_name_looks_like_a_pattern_or_a_list_is_that_file() {
        let folder = folder(&["a[1].ply", "a1.ply"]);
        let path = folder.path().join("a[1].ply");
        assert_eq!(found(folder.path(), &path).0, ["a[1].ply"]);
        let named = folder.path().join("labelled_mesh.ply");
        assert_eq!(found(folder.path(), &named), (vec!["labelled_mesh.ply".to_owned()], Vec::new()));
    }

    #[test]
    fn a_list_names_files_from_its_own_folder() {
        let folder = folder(&["lists/a.ply", "more/b.ply", "more/c.ply"]);
        let list = folder.path().join("lists/blocks.txt");
        let at = PathBuf::from(format!("@{}", list.display()));
        std::fs::write(&list, "# the lower reach\r\na.ply\r\n\r\n../more/c.ply\n").expect("a list");
        assert_eq!(found(folder.path(), &at).0, ["lists/a.ply", "lists/../more/c.ply"]);
        std::fs::write(&list, "../more\n").expect("a list");
        assert_eq!(found(folder.path(), &at).0, ["lists/../more/b.ply", "lists/../more/c.ply"]);
        std::fs::write(&list, "# nothing\n").expect("a list");
        assert!(refused(&at).contains("names no file"));
        assert!(refused(Path::new("@nowhere/blocks.txt")).contains("nowhere/blocks.txt"));
    }
}
