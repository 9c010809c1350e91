//! The progress bar of a run.

use crate::progress::Progress;

/// Counts steps and reports them in groups.
pub(super) struct Bar {
    progress: Progress,
    waiting: usize,
}

impl Bar {
    /// The number of steps in a group; reading the clock costs more than a small step.
    const TOGETHER: usize = 256;

    pub(super) fn new(is_wanted: bool, steps: usize) -> Self {
        Self {
            progress: Progress::new(is_wanted, steps, "steps"),
            waiting: 0,
        }
    }

    pub(super) fn advance(&mut self) {
        if !self.progress.is_wanted() {
            return;
        }
        self.waiting += 1;
        if self.waiting == Self::TOGETHER {
            self.progress.advance(Self::TOGETHER);
            self.waiting = 0;
        }
    }
}
