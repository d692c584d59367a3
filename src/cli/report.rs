//! Telling progress: bars on a terminal, plain lines elsewhere, JSON on request. All on standard error.

use super::Log;
use crate::progress::{Progress, Unit};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The reporter for a log style.
pub fn reporter(log: Log) -> Box<dyn Progress> {
    match log {
        Log::Json => Box::new(Lines { json: true, stage: Mutex::default() }),
        Log::Text if std::io::stderr().is_terminal() => Box::new(Bars { bar: Mutex::default() }),
        Log::Text => Box::new(Lines { json: false, stage: Mutex::default() }),
    }
}

/// Why a command failed, in the style of its log.
pub fn report_error(log: Log, error: &crate::error::Error) {
    match log {
        Log::Json => say(&serde_json::json!({ "event": "error", "text": error.to_string() }).to_string()),
        Log::Text => say(&format!("error: {error}")),
    }
}

/// A line on standard error. That nobody reads it is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One bar for each stage, with rate and time left.
struct Bars {
    bar: Mutex<Option<ProgressBar>>,
}

impl Bars {
    fn say(&self, text: &str) {
        match &*lock(&self.bar) {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }
}

impl Progress for Bars {
    fn begin(&self, stage: &'static str, total: u64, unit: Unit) {
        let counts = match unit {
            Unit::Bytes => "{bytes}/{total_bytes} {bytes_per_sec}".to_owned(),
            Unit::Files => "{pos}/{len} files".to_owned(),
            other => format!("{{human_pos}}/{{human_len}} {} {{per_sec:.0}}", other.name()),
        };
        let template = format!("{{prefix:>10}} {{bar:32}} {counts} {{elapsed}} left {{eta}}");
        let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
        bar.set_style(style);
        bar.set_prefix(stage);
        bar.enable_steady_tick(Duration::from_millis(200));
        *lock(&self.bar) = Some(bar);
    }
    fn advance(&self, amount: u64) {
        if let Some(bar) = &*lock(&self.bar) {
            bar.inc(amount);
        }
    }
    fn end(&self) {
        if let Some(bar) = lock(&self.bar).take() {
            bar.finish();
        }
    }
    fn note(&self, text: &str) {
        self.say(text);
    }
    fn warn(&self, text: &str) {
        self.say(&format!("warning: {text}"));
    }
}

/// A line at the start and end of a stage, and every few seconds between.
struct Lines {
    json: bool,
    stage: Mutex<Option<Stage>>,
}

struct Stage {
    name: &'static str,
    done: u64,
    total: u64,
    unit: Unit,
    began: Instant,
    told: Instant,
}

/// Lines of a long stage come this often: rarely enough for a batch job's log.
const EVERY: Duration = Duration::from_secs(10);

impl Lines {
    fn tell(&self, event: &'static str, stage: &Stage) {
        let seconds = stage.began.elapsed().as_secs_f64();
        if self.json {
            let line = serde_json::json!({
                "event": event, "stage": stage.name, "done": stage.done, "total": stage.total,
                "unit": stage.unit.name(), "seconds": (seconds * 1e3).round() / 1e3,
            });
            say(&line.to_string());
            return;
        }
        let Stage { name, done, total, unit, .. } = stage;
        match event {
            "begin" => {}
            "end" => say(&format!("{name}: {done} {} in {seconds:.1} s", unit.name())),
            _ => {
                let rate = *done as f64 / seconds.max(1e-9);
                let left = total.saturating_sub(*done) as f64 / rate.max(1e-9);
                say(&format!("{name}: {done} of {total} {}, {rate:.0} a second, {left:.0} s left", unit.name()));
            }
        }
    }

    fn say(&self, level: &'static str, text: &str) {
        match (self.json, level) {
            (true, _) => say(&format!("{}", serde_json::json!({ "event": level, "text": text }))),
            (false, "warning") => say(&format!("warning: {text}")),
            (false, _) => say(text),
        }
    }
}

impl Progress for Lines {
    fn begin(&self, name: &'static str, total: u64, unit: Unit) {
        let now = Instant::now();
        let stage = Stage { name, done: 0, total, unit, began: now, told: now };
        self.tell("begin", &stage);
        *lock(&self.stage) = Some(stage);
    }
    fn advance(&self, amount: u64) {
        if let Some(stage) = &mut *lock(&self.stage) {
            stage.done += amount;
            if stage.told.elapsed() > EVERY {
                stage.told = Instant::now();
                self.tell("progress", stage);
            }
        }
    }
    fn end(&self) {
        if let Some(stage) = lock(&self.stage).take() {
            self.tell("end", &stage);
        }
    }
    fn note(&self, text: &str) {
        self.say("note", text);
    }
    fn warn(&self, text: &str) {
        self.say("warning", text);
    }
}
