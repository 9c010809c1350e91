//! Progress on standard error.

use std::io::Write;
use std::time::{Duration, Instant};

/// A line that says how far a run is, rewritten once a second.
pub(super) struct Bar {
    shown: Option<Shown>,
    steps: usize,
    done: usize,
}

struct Shown {
    start: Instant,
    next: Instant,
}

impl Bar {
    pub(super) fn new(wanted: bool, steps: usize) -> Self {
        let now = Instant::now();
        let shown = wanted.then(|| Shown {
            start: now,
            next: now + Duration::from_secs(1),
        });
        Self {
            shown,
            steps,
            done: 0,
        }
    }

    pub(super) fn advance(&mut self) {
        self.done += 1;
        let Some(shown) = &mut self.shown else { return };
        // Asking for the time costs more than a small step does.
        if !self.done.is_multiple_of(256) && self.done != self.steps {
            return;
        }
        let now = Instant::now();
        if now < shown.next {
            return;
        }
        shown.next = now + Duration::from_secs(1);
        let fraction = self.done as f64 / self.steps as f64;
        let left = (now - shown.start).as_secs_f64() * (1.0 / fraction - 1.0);
        let (done, steps, percent) = (self.done, self.steps, 100.0 * fraction);
        // Progress that cannot be shown is no reason to stop a run.
        let _ = write!(
            std::io::stderr(),
            "\r{done} of {steps} steps ({percent:.0} %), {left:.0} s left "
        );
        if self.done == self.steps {
            let _ = writeln!(std::io::stderr());
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(shown) = &self.shown
            && shown.next > shown.start + Duration::from_secs(1)
            && self.done != self.steps
        {
            let _ = writeln!(std::io::stderr());
        }
    }
}
