//! Progress of an ensemble on standard error, from any thread.

use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A line that says how many runs are done, rewritten once a second.
pub(super) struct Progress {
    shown: Option<Mutex<Shown>>,
    done: AtomicUsize,
    runs: usize,
}

struct Shown {
    start: Instant,
    next: Instant,
    is_begun: bool,
}

impl Progress {
    pub(super) fn new(wanted: bool, runs: usize) -> Self {
        let start = Instant::now();
        let shown = wanted.then(|| {
            Mutex::new(Shown {
                start,
                next: start + Duration::from_secs(1),
                is_begun: false,
            })
        });
        Self {
            shown,
            done: AtomicUsize::new(0),
            runs,
        }
    }

    /// Counts runs that are done.
    pub(super) fn advance(&self, runs: usize) {
        let done = self.done.fetch_add(runs, Ordering::Relaxed) + runs;
        // Whoever is writing writes for all.
        if let Some(shown) = &self.shown
            && let Ok(mut shown) = shown.try_lock()
        {
            shown.write(done, self.runs);
        }
    }
}

impl Shown {
    fn write(&mut self, done: usize, runs: usize) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + Duration::from_secs(1);
        self.is_begun = true;
        let fraction = done as f64 / runs as f64;
        let left = (now - self.start).as_secs_f64() * (1.0 / fraction - 1.0);
        let percent = 100.0 * fraction;
        // Progress that cannot be shown is no reason to stop.
        let _ = write!(
            std::io::stderr(),
            "\r{done} of {runs} runs ({percent:.0} %), {left:.0} s left "
        );
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(Ok(shown)) = self.shown.as_mut().map(Mutex::get_mut)
            && shown.is_begun
        {
            let _ = writeln!(std::io::stderr());
        }
    }
}
