//! Progress on standard error, from any thread.

use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A line with the completed fraction, rewritten once a second.
pub(crate) struct Progress {
    shown: Option<Mutex<Shown>>,
    done: AtomicUsize,
    total: usize,
}

struct Shown {
    /// The name of what is counted, in the plural.
    what: &'static str,
    start: Instant,
    next: Instant,
    is_begun: bool,
}

impl Progress {
    /// Progress over a number of runs, rows or steps.
    pub(crate) fn new(is_wanted: bool, total: usize, what: &'static str) -> Self {
        let start = Instant::now();
        let shown = is_wanted.then(|| {
            Mutex::new(Shown {
                what,
                start,
                next: start + Duration::from_secs(1),
                is_begun: false,
            })
        });
        Self {
            shown,
            done: AtomicUsize::new(0),
            total,
        }
    }

    pub(crate) fn is_wanted(&self) -> bool {
        self.shown.is_some()
    }

    /// Counts completed items.
    pub(crate) fn advance(&self, by: usize) {
        let done = self.done.fetch_add(by, Ordering::Relaxed) + by;
        // If another thread is writing, it writes for all.
        if let Some(shown) = &self.shown
            && let Ok(mut shown) = shown.try_lock()
        {
            shown.write(done, self.total);
        }
    }
}

impl Shown {
    fn write(&mut self, done: usize, total: usize) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + Duration::from_secs(1);
        self.is_begun = true;
        let fraction = done as f64 / total as f64;
        let left = (now - self.start).as_secs_f64() * (1.0 / fraction - 1.0);
        let (what, percent) = (self.what, 100.0 * fraction);
        // Errors of the display are ignored.
        let _ = write!(
            std::io::stderr(),
            "\r{done} of {total} {what} ({percent:.0} %), {left:.0} s left "
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
