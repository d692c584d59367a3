//! What a run costs, stage by stage. The stages are those that progress is told of, so the meter sits between
//! the run and its listener and passes everything on.

use crate::pipeline::{cpu_seconds, peak_memory_bytes};
use crate::progress::{Progress, Unit};
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// What one stage cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageCost {
    /// The stage, as progress names it.
    pub name: &'static str,
    /// How much it did.
    pub amount: u64,
    /// What the amount counts.
    pub unit: Unit,
    /// CPU time of the whole process while it ran, user and system, seconds; none where the system does not
    /// tell. Counted in hundredths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu_s: Option<f64>,
    /// Time by the clock, seconds.
    pub wall_s: f64,
}

/// What a run has cost so far.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Costs {
    /// The stages in the order in which they began; the last may still be at work.
    pub stages: Vec<StageCost>,
    /// CPU time of the process since the run began, seconds: the stages, and what is done between them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu_s: Option<f64>,
    /// Time by the clock since the run began, seconds.
    pub wall_s: f64,
    /// Most memory that the process ever had resident, bytes, mapped parts of input files included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

/// Measures the stages of a run whose progress it hears and passes on.
pub struct Meter<'a> {
    listener: &'a dyn Progress,
    began: Moment,
    ended: Mutex<Vec<StageCost>>,
    running: Mutex<Option<(&'static str, Unit, Moment)>>,
    /// Of the running stage. Apart from it, because every thread may advance.
    amount: AtomicU64,
}

/// A point on both clocks.
#[derive(Clone, Copy)]
struct Moment {
    cpu_s: Option<f64>,
    wall: Instant,
}

impl Moment {
    fn now() -> Moment {
        Moment { cpu_s: cpu_seconds(), wall: Instant::now() }
    }

    /// CPU and wall seconds since then, to the microsecond: differences of sums have no more meaning.
    fn elapsed_s(self) -> (Option<f64>, f64) {
        let rounded = |s: f64| (s * 1e6).round() / 1e6;
        let cpu_s = cpu_seconds().zip(self.cpu_s).map(|(now, then)| rounded(now - then));
        (cpu_s, rounded(self.wall.elapsed().as_secs_f64()))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> Meter<'a> {
    /// Begins to measure.
    pub fn new(listener: &'a dyn Progress) -> Meter<'a> {
        Meter {
            listener,
            began: Moment::now(),
            ended: Mutex::default(),
            running: Mutex::default(),
            amount: AtomicU64::new(0),
        }
    }

    /// What the run has cost so far, the stage at work included.
    pub fn costs(&self) -> Costs {
        let mut stages = lock(&self.ended).clone();
        stages.extend(lock(&self.running).map(|stage| self.cost(stage)));
        let (cpu_s, wall_s) = self.began.elapsed_s();
        Costs { stages, cpu_s, wall_s, peak_memory_bytes: peak_memory_bytes() }
    }

    fn cost(&self, (name, unit, began): (&'static str, Unit, Moment)) -> StageCost {
        let (cpu_s, wall_s) = began.elapsed_s();
        StageCost { name, amount: self.amount.load(Ordering::Relaxed), unit, cpu_s, wall_s }
    }
}

impl Progress for Meter<'_> {
    fn begin(&self, stage: &'static str, total: u64, unit: Unit) {
        self.listener.begin(stage, total, unit);
        self.amount.store(0, Ordering::Relaxed);
        *lock(&self.running) = Some((stage, unit, Moment::now()));
    }
    fn advance(&self, amount: u64) {
        self.amount.fetch_add(amount, Ordering::Relaxed);
        self.listener.advance(amount);
    }
    fn end(&self) {
        let stage = lock(&self.running).take();
        lock(&self.ended).extend(stage.map(|stage| self.cost(stage)));
        self.listener.end();
    }
    fn note(&self, text: &str) {
        self.listener.note(text);
    }
    fn warn(&self, text: &str) {
        self.listener.warn(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    #[test]
    fn stages_come_in_order_with_their_amounts_and_the_one_at_work_so_far() {
        let meter = Meter::new(&Silent);
        meter.begin("open", 10, Unit::Bytes);
        meter.advance(4);
        meter.advance(6);
        meter.end();
        meter.begin("index", 5, Unit::Triangles);
        std::thread::sleep(std::time::Duration::from_millis(2));
        meter.advance(2);
        let costs = meter.costs();
        let seen: Vec<_> = costs.stages.iter().map(|s| (s.name, s.amount, s.unit)).collect();
        assert_eq!(seen, [("open", 10, Unit::Bytes), ("index", 2, Unit::Triangles)]);
        assert!(costs.stages[1].wall_s >= 2e-3 && costs.wall_s >= costs.stages[1].wall_s, "{costs:?}");
        meter.end();
        assert_eq!(meter.costs().stages.len(), 2);
    }

    #[test]
    fn what_the_system_does_not_tell_is_absent_and_not_zero() {
        let stage = StageCost { name: "open", amount: 1, unit: Unit::Bytes, cpu_s: None, wall_s: 0.5 };
        let costs = Costs { stages: vec![stage], cpu_s: None, wall_s: 0.5, peak_memory_bytes: None };
        let expected = serde_json::json!({
            "stages": [{ "name": "open", "amount": 1, "unit": "bytes", "wall_s": 0.5 }], "wall_s": 0.5,
        });
        assert_eq!(serde_json::to_value(costs).expect("plain"), expected);
    }
}
