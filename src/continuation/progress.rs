//! Progress of a continuation, on standard error.

/// A line on standard error, rewritten once a second.
pub(super) struct Progress {
    shown: Option<std::time::Instant>,
    is_dirty: bool,
}

impl Progress {
    pub(super) fn new(wanted: bool) -> Self {
        Self {
            shown: wanted.then(std::time::Instant::now),
            is_dirty: false,
        }
    }

    pub(super) fn show(&mut self, points: usize, parameter: f64) {
        use std::io::Write;
        let Some(shown) = &mut self.shown else { return };
        if shown.elapsed().as_secs() < 1 {
            return;
        }
        *shown = std::time::Instant::now();
        self.is_dirty = true;
        // Errors of the display are ignored.
        let _ = write!(
            std::io::stderr(),
            "\r{points} orbits, parameter {parameter:.6} "
        );
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.is_dirty {
            use std::io::Write;
            let _ = writeln!(std::io::stderr());
        }
    }
}
