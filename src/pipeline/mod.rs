//! Scheduling: jobs flow through a bounded pipeline. Knows no geometry: a job is a number, a byte count
//! and three closures.
//!
//! ```text
//!  dispatcher ──rendezvous──> workers (the pool's threads) ──bounded──> caller, in the jobs' order
//!   waits for a slot     may use the pool inside;
//!  and a job's bytes     free both
//! ```
//!
//! A worker without a job helps inside those of others, so that few jobs at once, where memory holds no more, keep all
//! threads busy.
//!
//! One thread or many, the caller sees the same results in the same order.

mod arena;
mod budget;
mod control;
mod machine;

pub use arena::{return_free_memory, share_one_heap};
pub use budget::{Budget, OverBudget, Reservation};
pub use control::{Cancelled, Control, Interrupted};
pub use machine::{cpu_seconds, memory_there_bytes, peak_memory_bytes};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError, bounded};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What a pipeline needs of the machine.
pub struct Crew {
    /// The compute threads.
    pub pool: rayon::ThreadPool,
    /// Memory for jobs in flight.
    pub budget: Budget,
    /// Whether to go on.
    pub control: Control,
}

/// Why a pipeline ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped<C> {
    /// The run was cancelled.
    Interrupted,
    /// A result could not be collected.
    Collecting(C),
}

impl<C> From<Interrupted> for Stopped<C> {
    fn from(_: Interrupted) -> Stopped<C> {
        Stopped::Interrupted
    }
}

/// A job that panicked or failed. The others went on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostJob {
    /// Its number.
    pub job: usize,
    /// What the panic or the error said.
    pub message: String,
}

/// What a pipeline does with a job, and with how many.
pub struct Stages<F, W> {
    /// Jobs in flight, at most; at least 1.
    pub at_once: usize,
    /// Bytes that a job takes while it is in flight.
    pub footprint_bytes: F,
    /// Fetches a job's data and does the work. The reservation may be grown when a job turns out larger.
    pub work: W,
}

/// Does something that waits for the disk beside work, and gives both results.
///
/// # Panics
/// When either does.
pub fn beside<A: Send, B>(aside: impl FnOnce() -> A + Send, work: impl FnOnce() -> B) -> (A, B) {
    std::thread::scope(|scope| {
        let aside = scope.spawn(aside);
        let done = work();
        (aside.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), done)
    })
}

/// Runs the given jobs and hands each result to `collect`, in their order.
///
/// A job that panics or fails is left out and returned; all others are done. The first error of `collect`
/// stops the run and is returned.
///
/// # Errors
/// [`Stopped::Interrupted`] when the control says stop; [`Stopped::Collecting`] when `collect` fails.
pub fn over_jobs<R: Send, E: Display, C>(
    crew: &Crew,
    jobs: &[usize],
    stages: &Stages<impl Fn(usize) -> u64 + Sync, impl Fn(usize, &mut Reservation) -> Result<R, E> + Sync>,
    mut collect: impl FnMut(usize, R) -> Result<(), C>,
) -> Result<Vec<LostJob>, Stopped<C>> {
    let workers = crew.pool.current_num_threads();
    let (here_in, here_out) = bounded::<()>(workers);
    let (slot_taken, slot_free) = bounded::<()>(stages.at_once.max(1));
    let (given_in, given_out) = bounded::<(usize, Reservation)>(0);
    let (done_in, done_out) = bounded::<(usize, Result<R, LostJob>)>(workers);
    let mut lost = Vec::new();
    let mut failed = None;
    // A stop of this pipeline alone: what the caller cannot collect nobody needs to make.
    let halted = AtomicBool::new(false);
    let go_on = || crew.control.check().is_ok() && !halted.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let given_in = given_in;
            // A worker that came later could begin on top of a piece of a job that it helps with, and that job would
            // wait for it for ever.
            (0..workers).for_each(|_| here_out.recv().unwrap_or_default());
            for &job in jobs {
                // Both ends of the slots outlive this: they can always be taken and given back.
                let _ = slot_taken.send(());
                let Ok(reservation) = crew.budget.reserve((stages.footprint_bytes)(job), &crew.control) else { return };
                // The workers are gone only when they were stopped.
                if !go_on() || given_in.send((job, reservation)).is_err() {
                    return;
                }
            }
        });
        let from = given_out;
        scope.spawn(|| {
            let (from, done_in) = (from, done_in);
            crew.pool.broadcast(|_| {
                let _ = here_in.send(());
                work_all(&from, &done_in, &slot_free, &go_on, stages);
            });
        });
        // Results arrive in any order; those that are early wait here.
        let mut early = BTreeMap::new();
        let mut next = jobs.iter();
        let mut expected = next.next();
        for (job, result) in done_out {
            early.insert(job, result);
            while let Some((&job, result)) = expected.and_then(|job| Some((job, early.remove(job)?))) {
                expected = next.next();
                match result {
                    Ok(result) if failed.is_none() => {
                        if let Err(error) = collect(job, result) {
                            failed = Some(error);
                            halted.store(true, Ordering::Relaxed);
                        }
                    }
                    Ok(_) => {}
                    Err(why) => lost.push(why),
                }
            }
        }
    });
    if let Some(error) = failed {
        return Err(Stopped::Collecting(error));
    }
    crew.control.check()?;
    Ok(lost)
}

fn work_all<R, E: Display>(
    from: &Receiver<(usize, Reservation)>,
    to: &Sender<(usize, Result<R, LostJob>)>,
    slots: &Receiver<()>,
    go_on: &impl Fn() -> bool,
    stages: &Stages<impl Fn(usize) -> u64, impl Fn(usize, &mut Reservation) -> Result<R, E>>,
) {
    while let Some((job, mut reservation)) = next_job(from) {
        if !go_on() {
            let _ = slots.recv();
            return;
        }
        let result = guarded(job, || (stages.work)(job, &mut reservation));
        drop(reservation);
        let _ = slots.recv();
        if to.send((job, result)).is_err() {
            return;
        }
    }
}

/// How long a worker waits for a job before it looks again whether it can help: at first, and at most, after it has
/// found nothing to help with several times.
const PAUSES: [Duration; 2] = [Duration::from_micros(100), Duration::from_millis(4)];

/// The next job; none when there will be no more. Until there is one, helps the other threads of the pool.
fn next_job<J>(from: &Receiver<J>) -> Option<J> {
    let mut pause = PAUSES[0];
    loop {
        match from.try_recv() {
            Ok(job) => return Some(job),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) if rayon::yield_now() == Some(rayon::Yield::Executed) => pause = PAUSES[0],
            Err(TryRecvError::Empty) => match from.recv_timeout(pause) {
                Ok(job) => return Some(job),
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) => pause = (2 * pause).min(PAUSES[1]),
            },
        }
    }
}

/// Turns a panic or an error into a lost job, so that one bad tile cannot take a day's run with it.
fn guarded<T, E: Display>(job: usize, work: impl FnOnce() -> Result<T, E>) -> Result<T, LostJob> {
    let lost = |message| LostJob { job, message };
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(|error| lost(error.to_string())),
        Err(payload) => Err(lost(
            payload
                .downcast_ref::<&str>()
                .map(|s| (*s).to_owned())
                .or_else(|| payload.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "panic without a message".to_owned()),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;
    use std::sync::atomic::AtomicUsize;

    fn crew(threads: usize, bytes: u64) -> Crew {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        Crew { pool, budget: Budget::new(bytes), control: Control::default() }
    }

    fn squares(crew: &Crew) -> (Vec<usize>, Vec<LostJob>) {
        let mut seen = Vec::new();
        let stages = Stages {
            at_once: 4,
            footprint_bytes: |_| 40,
            work: |job: usize, _: &mut Reservation| {
                assert!(job != 13, "unlucky");
                if job == 17 { Err("not today") } else { Ok(job * job) }
            },
        };
        let jobs: Vec<usize> = (0..50).collect();
        let collect = |_, r| -> Result<(), Infallible> {
            seen.push(r);
            Ok(())
        };
        let lost = over_jobs(crew, &jobs, &stages, collect).expect("not interrupted");
        (seen, lost)
    }

    #[test]
    fn results_come_in_order_and_a_panic_or_an_error_loses_one_job_only() {
        for threads in [1, 2, 5] {
            let (seen, lost) = squares(&crew(threads, 100));
            assert_eq!(seen, (0..50).filter(|j| ![13, 17].contains(j)).map(|j| j * j).collect::<Vec<_>>());
            let why = |job, message: &str| LostJob { job, message: message.into() };
            assert_eq!(lost, [why(13, "unlucky"), why(17, "not today")]);
        }
    }

    #[test]
    fn no_more_jobs_are_in_flight_than_are_allowed() {
        for at_once in [1, 2] {
            let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
            let stages = Stages {
                at_once,
                footprint_bytes: |_| 1,
                work: |_, _: &mut Reservation| {
                    most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(2));
                    now.fetch_sub(1, Ordering::SeqCst);
                    Ok::<_, Infallible>(())
                },
            };
            let jobs: Vec<usize> = (0..30).collect();
            let lost = over_jobs(&crew(4, 100), &jobs, &stages, |_, ()| Ok::<_, Infallible>(()));
            assert_eq!((lost, most.load(Ordering::SeqCst)), (Ok(Vec::new()), at_once));
        }
    }

    #[test]
    fn threads_without_a_job_help_inside_the_only_one() {
        use rayon::prelude::*;
        let stages = Stages {
            at_once: 1,
            footprint_bytes: |_| 1,
            work: |_, _: &mut Reservation| {
                let wait = |_| {
                    std::thread::sleep(Duration::from_millis(5));
                    rayon::current_thread_index()
                };
                let mut threads: Vec<_> = (0..40).into_par_iter().with_max_len(1).map(wait).collect();
                threads.sort_unstable();
                threads.dedup();
                Ok::<_, Infallible>(threads.len())
            },
        };
        let mut helped = Vec::new();
        let collect = |_, threads| {
            helped.push(threads);
            Ok::<_, Infallible>(())
        };
        // While the first is worked, the second waits: the other threads have nothing else to do.
        assert_eq!(over_jobs(&crew(3, 100), &[0, 1], &stages, collect), Ok(Vec::new()));
        assert!(helped.iter().all(|&threads| threads > 1), "{helped:?}");
    }

    #[test]
    fn what_waits_for_the_disk_is_done_beside_work() {
        let (a_in, a_out) = bounded(1);
        let (b_in, b_out) = bounded(1);
        let aside = || a_in.send(1).is_ok() && b_out.recv() == Ok(2);
        let work = || b_in.send(2).is_ok() && a_out.recv() == Ok(1);
        assert_eq!(beside(aside, work), (true, true));
    }

    #[test]
    fn what_cannot_be_collected_stops_the_run() {
        let stages =
            Stages { at_once: 3, footprint_bytes: |_| 1, work: |job, _: &mut Reservation| Ok::<_, Infallible>(job) };
        let jobs: Vec<usize> = (0..10_000).collect();
        let collect = |job, _| if job == 5 { Err("full") } else { Ok(()) };
        assert_eq!(over_jobs(&crew(3, 100), &jobs, &stages, collect), Err(Stopped::Collecting("full")));
    }

    #[test]
    fn a_job_larger_than_the_budget_runs_alone_instead_of_never() {
        assert_eq!(squares(&crew(2, 1)).0.len(), 48);
    }

    #[test]
    fn a_cancelled_run_ends_interrupted() {
        let crew = crew(2, 100);
        let stages = Stages {
            at_once: 1,
            footprint_bytes: |_| 1,
            work: |job, _: &mut Reservation| {
                if job == 3 {
                    crew.control.cancel();
                }
                Ok::<_, Infallible>(())
            },
        };
        let jobs: Vec<usize> = (0..1000).collect();
        let collect = |_, ()| Ok::<_, Infallible>(());
        assert_eq!(over_jobs(&crew, &jobs, &stages, collect), Err(Stopped::Interrupted));
    }
}
