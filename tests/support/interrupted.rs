//! Runs of the program that end before they are done, on a small made-up bed.
#![allow(dead_code, unreachable_pub, missing_docs, clippy::unwrap_used)]

use super::bed::{bed, write_ply};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What a resumed run must give byte for byte.
pub const RESULTS: [&str; 4] = ["grains.csv", "labelled_mesh.ply", "grain_size.tif", "summary.json"];
pub const WORK: &str = "gravelometer-work";
/// The last of two settings counts, and a flag counts more.
/// The published method, which has all commit points: curvature is kept as well.
const AS_ALWAYS: [&str; 6] = [
    "--set=segment.method=rheinwalt2025",
    "--set=work.tile_size_m=0.4",
    "--set=work.threads=2",
    "--set=segment.max_grain_m=0.6",
    "--set=segment.min_grain_area_m2=1e-3",
    "--set=output.labelled_mesh=true",
];

/// A survey, and what an uninterrupted run finds in it.
pub struct Scene {
    pub folder: tempfile::TempDir,
    pub mesh: PathBuf,
    pub whole: BTreeMap<&'static str, Vec<u8>>,
    pub tiles: u64,
    pub lasts: Duration,
}

pub struct Said {
    pub code: Option<i32>,
    pub err: String,
}

impl Said {
    pub fn fails(&self, code: i32, says: &[&str]) {
        assert_eq!(self.code, Some(code), "{}", self.err);
        for text in says {
            assert!(self.err.contains(text), "`{text}` is not in: {}", self.err);
        }
        assert!(self.err.contains("\nhelp: "), "{}", self.err);
    }
}

pub fn said(command: &mut Command) -> Said {
    let output = command.output().unwrap();
    Said { code: output.status.code(), err: String::from_utf8(output.stderr).unwrap() }
}

pub fn results(out: &Path) -> BTreeMap<&'static str, Vec<u8>> {
    RESULTS.into_iter().filter_map(|name| Some((name, std::fs::read(out.join(name)).ok()?))).collect()
}

/// All files below a folder.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            let bytes = std::fs::read(&path).unwrap();
            found.insert(path, bytes);
        }
    }
    found
}

pub fn copy(from: &Path, to: &Path) {
    for (path, bytes) in files(from) {
        let target = to.join(path.strip_prefix(from).unwrap());
        std::fs::create_dir_all(target.parent().unwrap()).unwrap();
        std::fs::write(target, bytes).unwrap();
    }
}

pub fn run_json(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap()
}

impl Scene {
    pub fn new() -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("bed.ply");
        write_ply(&mesh, &bed(21, 70, 60));
        let mut scene = Scene { folder, mesh, whole: BTreeMap::new(), tiles: 0, lasts: Duration::ZERO };
        let (out, began) = (scene.path("whole"), Instant::now());
        scene.finishes(&out, &[]);
        scene.lasts = began.elapsed();
        scene.whole = results(&out);
        scene.tiles = run_json(&out)["facts"]["tiles"].as_u64().unwrap();
        assert!(scene.whole.len() == RESULTS.len() && scene.tiles >= 12, "{} tiles", scene.tiles);
        assert!(scene.whole["grains.csv"].iter().filter(|&&b| b == b'\n').count() > 10, "too few grains");
        scene
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn of(&self, mesh: &Path, out: &Path, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gravelometer"));
        command.arg("run").arg(mesh).arg("-o").arg(out).args(AS_ALWAYS).args(more).env("RUST_BACKTRACE", "0");
        command
    }

    pub fn run(&self, out: &Path, more: &[&str]) -> Command {
        self.of(&self.mesh, out, more)
    }

    pub fn finishes(&self, out: &Path, more: &[&str]) {
        let said = said(&mut self.run(out, more));
        assert_eq!(said.code, Some(0), "{more:?}: {}", said.err);
    }

    /// What lies there is the result, and nothing of a work folder is left in it.
    pub fn is_whole(&self, out: &Path, after: &str) {
        assert!(results(out) == self.whole, "{after}: other results");
        let names = std::fs::read_dir(out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let others: Vec<String> = names.filter(|n| n == WORK || n.contains(".partial")).collect();
        assert!(others.is_empty(), "{after}: {others:?} are left");
    }

    pub fn resumes(&self, out: &Path, more: &[&str], after: &str) {
        let said = said(self.run(out, more).arg("--resume"));
        assert_eq!(said.code, Some(0), "{after}: {}", said.err);
        self.is_whole(out, after);
    }

    /// A run that was killed at a commit point; the folder of its results.
    #[cfg(debug_assertions)]
    pub fn killed(&self, name: &str, at: &str, more: &[&str]) -> PathBuf {
        let out = self.path(name);
        let said = said(self.run(&out, more).env(gravelometer::store::KILL_AT, at));
        assert_eq!(said.code, None, "{at}: the run was not killed: {}", said.err);
        out
    }

    /// A run that is under way: it has begun to read its input, and heeds signals.
    pub fn under_way(&self, out: &Path, more: &[&str]) -> Child {
        let mut command = self.run(out, more);
        let mut child = command.args(["--log", "json"]).stderr(Stdio::piped()).spawn().unwrap();
        let mut first = [0; 1];
        std::io::Read::read_exact(child.stderr.as_mut().unwrap(), &mut first).unwrap();
        child
    }
}

pub fn send(signal: &str, child: &Child) {
    // The shell's own kill: a small system has no other.
    let kill = format!("kill {signal} {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}
