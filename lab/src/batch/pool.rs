//! Work on several threads, results in order.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Largest distance in the order between new work and the next awaited result: it bounds what is held back.
const AHEAD: u64 = 256;

/// Number of threads that the system refused.
static REFUSED: AtomicUsize = AtomicUsize::new(0);

/// Number of threads that the system refused so far (a limit on processes, or on memory). Their work was done by the
/// others, or by the calling thread, with the same results.
pub fn refused_threads() -> usize {
    REFUSED.load(Ordering::Relaxed)
}

/// Does `work` on each of `items` with `jobs` threads, and passes each result to `take` in the order of the items, as
/// soon as all results before it are ready. The first error of `take` ends it: what is being worked on is still
/// finished, and dropped. A panic in `work` ends it too and goes on in the caller; work that may panic catches its own.
pub fn in_order<I: Send, T: Send, E>(
    jobs: NonZeroUsize,
    items: impl Iterator<Item = I> + Send,
    work: impl Fn(I) -> T + Sync,
    mut take: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    let queue = Pending {
        state: Mutex::new(QueueState {
            items: items.zip(0..),
            taken: 0,
            stop: false,
        }),
        moved: Condvar::new(),
    };
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        let mut threads = 0;
        for _ in 0..jobs.get() {
            let (send, queue, work) = (send.clone(), &queue, &work);
            let spawned = std::thread::Builder::new().spawn_scoped(scope, move || {
                while let Some((item, place)) = queue.next() {
                    let done = catch_unwind(AssertUnwindSafe(|| work(item)));
                    if send.send((place, done)).is_err() {
                        return;
                    }
                }
            });
            match spawned {
                Ok(_) => threads += 1,
                Err(_) => {
                    REFUSED.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        drop(send);
        if threads == 0 {
            while let Some((item, _)) = queue.next() {
                take(work(item))?;
                queue.taken(u64::MAX - AHEAD); // none is ahead of the only one
            }
            return Ok(());
        }
        let mut early = BTreeMap::new();
        let mut next = 0;
        for (place, done) in receive {
            early.insert(place, done);
            while let Some(done) = early.remove(&next) {
                next += 1;
                let taken = match done {
                    Ok(result) => take(result),
                    Err(panic) => {
                        queue.stop();
                        resume_unwind(panic)
                    }
                };
                if let Err(e) = taken {
                    queue.stop();
                    return Err(e);
                }
            }
            queue.taken(next);
        }
        Ok(())
    })
}

/// The results of `work` on each of `items` with `jobs` threads, in the order of the items.
pub fn map_in_order<'a, I: Sync, T: Send>(
    jobs: usize,
    items: &'a [I],
    work: impl Fn(&'a I) -> T + Sync,
) -> Vec<T> {
    let jobs = jobs.min(items.len());
    let Some(jobs) = NonZeroUsize::new(jobs).filter(|n| n.get() > 1) else {
        return items.iter().map(work).collect();
    };
    let mut results = Vec::with_capacity(items.len());
    let taken = in_order(jobs, items.iter(), work, |result| {
        results.push(result);
        Ok::<(), Infallible>(())
    });
    match taken {
        Ok(()) => results,
    }
}

struct QueueState<I> {
    items: I,
    taken: u64,
    stop: bool,
}

struct Pending<I> {
    state: Mutex<QueueState<I>>,
    moved: Condvar,
}

impl<I> Pending<I> {
    fn lock(&self) -> MutexGuard<'_, QueueState<I>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the next item and its place; waits while the place is too far ahead.
    fn next<T>(&self) -> Option<(T, u64)>
    where
        I: Iterator<Item = (T, u64)>,
    {
        let mut state = self.lock();
        if state.stop {
            return None;
        }
        let (item, place) = state.items.next()?;
        while place >= state.taken + AHEAD {
            state = self
                .moved
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
            if state.stop {
                return None;
            }
        }
        Some((item, place))
    }

    fn taken(&self, taken: u64) {
        self.lock().taken = taken;
        self.moved.notify_all();
    }

    fn stop(&self) {
        self.lock().stop = true;
        self.moved.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    fn jobs(n: usize) -> NonZeroUsize {
        NonZeroUsize::new(n).unwrap()
    }

    /// Later items finish earlier, and still come later.
    #[test]
    fn order_does_not_depend_on_threads_or_speed() {
        for n in [1, 2, 7] {
            let mut seen = Vec::new();
            let work = |i: u64| {
                std::thread::sleep(std::time::Duration::from_micros(if i.is_multiple_of(5) {
                    900
                } else {
                    10
                }));
                i * i
            };
            in_order(jobs(n), 0..600, work, |x| {
                seen.push(x);
                Ok::<_, ()>(())
            })
            .unwrap();
            assert_eq!(seen, (0..600).map(|i| i * i).collect::<Vec<_>>());
        }
    }

    /// One slow item must not let the others pile up.
    #[test]
    fn what_is_held_back_is_bounded() {
        let (started, taken) = (AtomicU64::new(0), AtomicU64::new(0));
        let work = |i: u64| {
            started.fetch_max(i, Ordering::SeqCst);
            if i == 0 {
                std::thread::sleep(std::time::Duration::from_millis(50));
                assert!(started.load(Ordering::SeqCst) < AHEAD);
            }
        };
        in_order(jobs(3), 0..5000, work, |()| {
            taken.fetch_add(1, Ordering::SeqCst);
            Ok::<_, ()>(())
        })
        .unwrap();
        assert_eq!(taken.load(Ordering::SeqCst), 5000);
    }

    #[test]
    fn an_error_ends_it() {
        let worked = AtomicU64::new(0);
        let work = |i: u64| {
            worked.fetch_add(1, Ordering::SeqCst);
            i
        };
        let end = in_order(jobs(2), 0..1_000_000, work, |x| {
            if x == 10 { Err("ten") } else { Ok(()) }
        });
        assert_eq!(end, Err("ten"));
        assert!(worked.load(Ordering::SeqCst) < 11 + AHEAD + 2);
    }

    #[test]
    fn a_panic_goes_on_in_the_caller() {
        let run = || {
            in_order(
                jobs(2),
                0..1000,
                |i| assert!(i != 20, "twenty"),
                |()| Ok::<_, ()>(()),
            )
        };
        assert!(catch_unwind(run).is_err());
    }
}
