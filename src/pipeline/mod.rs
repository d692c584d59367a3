//! Scheduling: jobs flow through a bounded pipeline. Knows no geometry: a job is a number, a byte count
//! and three closures.
//!
//! ```text
//!  loader (1 thread) ──bounded──> workers (the pool's threads) ──bounded──> caller, in the jobs' order
//!      waits for its bytes        may use the pool inside; frees the bytes
//! ```
//!
//! One thread or many, the caller sees the same results in the same order.

mod budget;
mod control;
mod machine;

pub use budget::{Budget, Reservation};
pub use control::{Control, Interrupted};
pub use machine::{cpu_seconds, memory_there_bytes, peak_memory_bytes};

use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a pipeline needs of the machine.
pub struct Crew {
    /// The compute threads.
    pub pool: rayon::ThreadPool,
    /// Memory for jobs in flight.
    pub budget: Budget,
    /// Whether to go on.
    pub control: Control,
}

/// A job that panicked. The others went on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostJob {
    /// Its number.
    pub job: usize,
    /// What the panic said.
    pub message: String,
}

/// The three closures of a pipeline.
pub struct Stages<F, L, W> {
    /// Bytes that a job takes while it is in flight.
    pub footprint_bytes: F,
    /// Fetches a job's data; runs on one thread, ahead of the work.
    pub load: L,
    /// Does the work. The reservation may be grown when a job turns out larger.
    pub work: W,
}

/// Runs jobs 0, 1, ... `jobs` - 1 and hands each result to `collect`, in this order.
///
/// A job that panics is left out and returned; all others are done.
///
/// # Errors
/// [`Interrupted`] when the control says stop.
pub fn over_jobs<D: Send, R: Send>(
    crew: &Crew,
    jobs: usize,
    stages: &Stages<
        impl Fn(usize) -> u64 + Sync,
        impl Fn(usize) -> D + Sync,
        impl Fn(usize, D, &mut Reservation) -> R + Sync,
    >,
    mut collect: impl FnMut(usize, R),
) -> Result<Vec<LostJob>, Interrupted> {
    let workers = crew.pool.current_num_threads();
    let (loaded_in, loaded_out) = bounded::<(usize, Result<D, LostJob>, Reservation)>(workers);
    let (done_in, done_out) = bounded::<(usize, Result<R, LostJob>)>(2 * workers);
    let mut lost = Vec::new();
    std::thread::scope(|scope| {
        scope.spawn(move || load_all(crew, jobs, stages, &loaded_in));
        let from = loaded_out;
        scope.spawn(move || {
            crew.pool.broadcast(|_| work_all(&from, &done_in, &crew.control, stages));
        });
        // Results arrive in any order; those that are early wait here.
        let mut early = BTreeMap::new();
        let mut next = 0;
        for (job, result) in done_out {
            early.insert(job, result);
            while let Some(result) = early.remove(&next) {
                match result {
                    Ok(result) => collect(next, result),
                    Err(panicked) => lost.push(panicked),
                }
                next += 1;
            }
        }
    });
    crew.control.check()?;
    Ok(lost)
}

fn load_all<D, R>(
    crew: &Crew,
    jobs: usize,
    stages: &Stages<impl Fn(usize) -> u64, impl Fn(usize) -> D, impl Fn(usize, D, &mut Reservation) -> R>,
    to: &Sender<(usize, Result<D, LostJob>, Reservation)>,
) {
    for job in 0..jobs {
        let Ok(reservation) = crew.budget.reserve((stages.footprint_bytes)(job), &crew.control) else { return };
        let data = guarded(job, || (stages.load)(job));
        // The workers are gone only when they were interrupted.
        if to.send((job, data, reservation)).is_err() {
            return;
        }
    }
}

fn work_all<D, R>(
    from: &Receiver<(usize, Result<D, LostJob>, Reservation)>,
    to: &Sender<(usize, Result<R, LostJob>)>,
    control: &Control,
    stages: &Stages<impl Fn(usize) -> u64, impl Fn(usize) -> D, impl Fn(usize, D, &mut Reservation) -> R>,
) {
    for (job, data, mut reservation) in from {
        if control.check().is_err() {
            return;
        }
        let result = data.and_then(|data| guarded(job, || (stages.work)(job, data, &mut reservation)));
        drop(reservation);
        if to.send((job, result)).is_err() {
            return;
        }
    }
}

/// Turns a panic into a lost job, so that one bad tile cannot take a day's run with it.
fn guarded<T>(job: usize, work: impl FnOnce() -> T) -> Result<T, LostJob> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| LostJob {
        job,
        message: payload
            .downcast_ref::<&str>()
            .map(|s| (*s).to_owned())
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "panic without a message".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crew(threads: usize, bytes: u64) -> Crew {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        Crew { pool, budget: Budget::new(bytes), control: Control::default() }
    }

    fn squares(crew: &Crew) -> (Vec<usize>, Vec<LostJob>) {
        let mut seen = Vec::new();
        let stages = Stages {
            footprint_bytes: |_| 40,
            load: |job| job,
            work: |job, data: usize, _: &mut Reservation| {
                assert!(job != 13, "unlucky");
                data * data
            },
        };
        let lost = over_jobs(crew, 50, &stages, |_, r| seen.push(r)).expect("not interrupted");
        (seen, lost)
    }

    #[test]
    fn results_come_in_order_and_a_panic_loses_one_job_only() {
        for threads in [1, 2, 5] {
            let (seen, lost) = squares(&crew(threads, 100));
            assert_eq!(seen, (0..50).filter(|j| *j != 13).map(|j| j * j).collect::<Vec<_>>());
            assert_eq!(lost, [LostJob { job: 13, message: "unlucky".into() }]);
        }
    }

    #[test]
    fn a_job_larger_than_the_budget_runs_alone_instead_of_never() {
        assert_eq!(squares(&crew(2, 1)).0.len(), 49);
    }

    #[test]
    fn a_cancelled_run_ends_interrupted() {
        let crew = crew(2, 100);
        let stages = Stages {
            footprint_bytes: |_| 1,
            load: |job| job,
            work: |job, _, _: &mut Reservation| {
                if job == 3 {
                    crew.control.cancel();
                }
            },
        };
        assert!(over_jobs(&crew, 1000, &stages, |_, ()| {}).is_err());
    }
}
