//! A motion with its error.

use crate::numbers::larger;
use std::fmt;
use std::ops::Deref;
use tfe_runtime::{Element, Solve, Statistics};

/// A motion with an estimate of its error; everything that a motion can be asked, it can be asked too.
///
/// Made by [`Simulation::run_estimated`](crate::Simulation::run_estimated) and [`Simulation::accuracy`](crate::Simulation::accuracy), where the examples are.
#[derive(Clone, Debug)]
pub struct Estimated<T> {
    motion: T,
    times: Vec<f64>,
    /// Of each kind at each time: coordinates, momenta, one output after the other.
    errors: Vec<Vec<f64>>,
    outputs: Vec<String>,
    picked: Option<Picked>,
}

impl<T> Estimated<T> {
    pub(crate) fn new(
        motion: T,
        times: Vec<f64>,
        errors: Vec<Vec<f64>>,
        outputs: Vec<String>,
        picked: Option<Picked>,
    ) -> Self {
        Self {
            motion,
            times,
            errors,
            outputs,
            picked,
        }
    }

    /// The largest estimated error over the span: of coordinates over the largest coordinate, of momenta over the largest momentum, of each declared output
    /// over its largest value, whichever is largest.
    ///
    /// Infinite where the motion it was compared with is not finite.
    pub fn error_estimate(&self) -> f64 {
        self.errors.iter().flatten().copied().fold(0.0, larger)
    }

    /// The estimated error at each time at which it was estimated, the end of the span the last: (t, error), measured as by
    /// [`error_estimate`](Self::error_estimate).
    pub fn error_estimates(&self) -> impl Iterator<Item = (f64, f64)> {
        self.times.iter().enumerate().map(|(k, t)| {
            let here = self.errors.iter().map(|kind| kind[k]);
            (*t, here.fold(0.0, larger))
        })
    }

    /// The largest estimated error of one declared output over its largest value; `None` where the model declares no such name.
    pub fn error_estimate_of(&self, output: &str) -> Option<f64> {
        let at = self.outputs.iter().position(|name| name == output)?;
        // After coordinates and momenta.
        let errors = self.errors.get(2 + at)?;
        Some(errors.iter().copied().fold(0.0, larger))
    }

    /// The last time up to which the estimated error stays at or below `limit`; `None` where it is larger from the first time on. Of a chaotic motion: how far
    /// it can be trusted.
    pub fn horizon(&self, limit: f64) -> Option<f64> {
        let within = self
            .error_estimates()
            .take_while(|(_, error)| *error <= limit);
        within.last().map(|(t, _)| t)
    }

    /// What was picked and why; `None` where element and step were given, and for an empty span.
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// The motion alone.
    pub fn motion(&self) -> &T {
        &self.motion
    }

    /// The motion alone, by value.
    pub fn into_motion(self) -> T {
        self.motion
    }
}

impl<T> Deref for Estimated<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.motion
    }
}

/// Element, step, tolerance and solver that [`Simulation::accuracy`](crate::Simulation::accuracy) picked: a run of one's own with them is as accurate. `Display` says them with the reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The element.
    pub element: Element,
    /// The step, positive; where steps vary, or breaks cut the span, the longest one.
    pub step: f64,
    /// The shortest step.
    pub shortest: f64,
    /// The tolerance of the iteration inside elements.
    pub tolerance: f64,
    /// How its equations were solved: by [`Solve::FixedPoint`] where that contracts in all steps, else as the simulation was told.
    pub solve: Solve,
    /// What was asked for.
    pub accuracy: f64,
    /// The estimated error.
    pub error_estimate: f64,
    /// The runs over the whole span, in their order; the last one is the motion.
    pub attempts: Vec<Attempt>,
    /// What all steps of the search have cost: of probes, of a pilot run, of all runs, and of the one that verifies the last. The motion's own [`Statistics`] are those of the last run.
    pub work: Statistics,
}

/// One run of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attempt {
    /// Its longest step.
    pub step: f64,
    /// Its estimated error, from the run that followed (of the last one, from the run before); `None` where it stopped.
    pub error_estimate: Option<f64>,
}

impl Picked {
    /// Whether steps are short where the motion is fast, by more than a span that is no whole number of steps makes them.
    pub fn varies(&self) -> bool {
        self.step > 2.0 * self.shortest
    }
}

impl fmt::Display for Picked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let order = self.element.order();
        write!(f, "{} with ", self.element)?;
        if self.varies() {
            write!(f, "steps from {:.3e} to {:.3e}", self.shortest, self.step)?;
        } else {
            write!(f, "step {:.3e}", self.step)?;
        }
        write!(
            f,
            " and tolerance {:.0e}: order {order} is the cheapest for {:.0e}; steps of",
            self.tolerance, self.accuracy
        )?;
        for (k, attempt) in self.attempts.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            match attempt.error_estimate {
                Some(error) => write!(f, "{comma} {:.3e} are off by {error:.1e}", attempt.step)?,
                None => write!(f, "{comma} {:.3e} fail", attempt.step)?,
            }
        }
        Ok(())
    }
}
