//! Surveys that another program writes to while they are read: refused before anything of them is kept, and not where
//! nothing is read any more.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::pipeline::Control;
use gravelometer::progress::{Progress, Unit};
use gravelometer::run::{Job, run};
use gravelometer::settings::Settings;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use support::bed::{bed, ply};

/// Does something when a stage begins; while a survey is opened, when something of it was read.
struct When<'d> {
    stage: &'static str,
    then: &'d (dyn Fn() + Sync),
    done: AtomicBool,
}

impl Progress for When<'_> {
    fn begin(&self, stage: &'static str, _: u64, _: Unit) {
        if stage == self.stage && stage != "open" {
            self.now();
        }
    }
    fn advance(&self, amount: u64) {
        if self.stage == "open" && amount > 0 {
            self.now();
        }
    }
    fn end(&self) {}
    fn note(&self, _: &str) {}
    fn warn(&self, _: &str) {}
}

impl When<'_> {
    fn now(&self) {
        if !self.done.swap(true, Ordering::Relaxed) {
            (self.then)();
        }
    }
}

struct Bed {
    folder: tempfile::TempDir,
    mesh: PathBuf,
    job: Job,
}

impl Bed {
    fn of(bytes: &[u8]) -> Bed {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("reach.ply");
        std::fs::write(&mesh, bytes).unwrap();
        let mut settings = Settings::default();
        settings.segment.max_grain_m = 1.05;
        settings.segment.min_grain_area_m2 = 0.004;
        let (out, work) = (folder.path().join("out"), Some(folder.path().join("work")));
        let job = Job { inputs: vec![mesh.clone()], out, settings, force: true, resume: false, work };
        Bed { folder, mesh, job }
    }

    /// Grains of a run in which something happens when a stage begins, or why there are none.
    fn run(&self, stage: &'static str, then: &(dyn Fn() + Sync)) -> Result<String, String> {
        let when = When { stage, then, done: AtomicBool::new(false) };
        let outcome = run(&self.job, &when, &Control::default());
        assert!(when.done.into_inner(), "no stage is called {stage}");
        outcome.map_err(|error| error.to_string())?;
        Ok(std::fs::read_to_string(self.folder.path().join("out/grains.csv")).unwrap())
    }
}

/// Writes into the file, as `cp` does; with the time of its last change a little later, or as it was.
fn rewrite(path: &Path, bytes: &[u8], later: bool) {
    use std::io::Write;
    let was = std::fs::metadata(path).unwrap().modified().unwrap();
    let mut file = std::fs::File::options().write(true).open(path).unwrap();
    file.write_all(bytes).unwrap();
    file.set_modified(if later { was + std::time::Duration::from_secs(2) } else { was }).unwrap();
}

fn is_refused(outcome: Result<String, String>) {
    let said = outcome.unwrap_err();
    assert!(said.contains("reach.ply: was changed while it was read"), "{said}");
}

#[test]
fn an_index_of_a_survey_that_was_rewritten_meanwhile_is_not_kept() {
    let (high, mut low) = (bed(1, 60, 60), bed(1, 60, 60));
    low.positions.iter_mut().for_each(|p| p.z *= 0.5);
    let [one, other] = [ply(&high), ply(&low)];
    let clean = Bed::of(&one).run("open", &|| {}).unwrap();
    let bed = Bed::of(&one);
    let was = std::fs::metadata(&bed.mesh).unwrap().modified().unwrap();
    is_refused(bed.run("index", &|| rewrite(&bed.mesh, &other, true)));
    // Back to what it was, with the time of its last change, as from a backup: the work folder must not pass for that.
    rewrite(&bed.mesh, &one, false);
    std::fs::File::options().append(true).open(&bed.mesh).unwrap().set_modified(was).unwrap();
    assert!(bed.run("open", &|| {}).unwrap() == clean, "an index of two files was used");
}

#[test]
fn a_text_file_that_was_rewritten_while_it_was_decoded_is_refused() {
    let surface = bed(1, 220, 220);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        surface.positions.len(),
        surface.triangles.len()
    );
    surface.positions.iter().for_each(|p| text.push_str(&format!("{} {} {}\n", p.x, p.y, p.z)));
    surface.triangles.iter().for_each(|[a, b, c]| text.push_str(&format!("3 {a} {b} {c}\n")));
    let bed = Bed::of(text.as_bytes());
    is_refused(bed.run("open", &|| rewrite(&bed.mesh, text.as_bytes(), true)));
}

#[test]
fn a_survey_that_is_written_to_when_nothing_reads_it_any_more_is_not_refused_unless_labels_go_back_onto_it() {
    let bytes = ply(&bed(1, 60, 60));
    let mut bed = Bed::of(&bytes);
    let grains = bed.run("grains", &|| rewrite(&bed.mesh, &bytes, true)).unwrap();
    assert!(grains.len() > 1000);
    bed.job.settings.output.labelled_mesh = true;
    is_refused(bed.run("grains", &|| rewrite(&bed.mesh, &bytes, true)));
}
