//! A motion together with its error estimate.

use crate::numbers::larger;
use std::fmt;
use std::ops::Deref;
use tfe_runtime::{Element, Solve, Statistics};

/// A motion with an estimate of its error; dereferences to [`Motion`](crate::Motion).
///
/// Made by [`Simulation::run_estimated`](crate::Simulation::run_estimated) and
/// [`Simulation::accuracy`](crate::Simulation::accuracy), which have examples.
#[derive(Clone, Debug)]
pub struct Estimated<T> {
    motion: T,
    times: Vec<f64>,
    /// One list for the coordinates, one for the momenta and one for each output; each with an error for every time.
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

    /// The same estimate, for a motion.
    pub(crate) fn of<U>(self, motion: U) -> Estimated<U> {
        Estimated {
            motion,
            times: self.times,
            errors: self.errors,
            outputs: self.outputs,
            picked: self.picked,
        }
    }

    /// The largest estimated relative error over the span: the error of the coordinates divided by the largest
    /// coordinate, of the momenta divided by the largest momentum, and of each declared output divided by its largest
    /// value, whichever is largest.
    ///
    /// Infinite if the motion with which this one was compared is not finite.
    pub fn error_estimate(&self) -> f64 {
        self.errors.iter().flatten().copied().fold(0.0, larger)
    }

    /// The estimated error at each time at which the two motions were compared, as pairs (t, error); the last is the
    /// end of the span. The error is relative, as in [`error_estimate`](Self::error_estimate).
    pub fn error_estimates(&self) -> impl Iterator<Item = (f64, f64)> {
        self.times.iter().enumerate().map(|(k, t)| {
            let here = self.errors.iter().map(|kind| kind[k]);
            (*t, here.fold(0.0, larger))
        })
    }

    /// The largest estimated error of one declared output, divided by the largest value of that output; `None` if the
    /// model declares no output of this name.
    pub fn error_estimate_of(&self, output: &str) -> Option<f64> {
        let at = self.outputs.iter().position(|name| name == output)?;
        // The outputs follow the coordinates and the momenta.
        let errors = self.errors.get(2 + at)?;
        Some(errors.iter().copied().fold(0.0, larger))
    }

    /// The last time up to which the estimated error stays at or below `limit`; `None` if it is larger from the first
    /// comparison on. For a chaotic motion, this is how far it can be trusted.
    pub fn horizon(&self, limit: f64) -> Option<f64> {
        let within = self
            .error_estimates()
            .take_while(|(_, error)| *error <= limit);
        within.last().map(|(t, _)| t)
    }

    /// What was chosen and why; `None` if the element and the step size were given, and for an empty span.
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// The motion without its error estimate.
    pub fn motion(&self) -> &T {
        &self.motion
    }

    /// The motion without its error estimate, by value.
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

/// The element, step size, tolerance and solver that [`Simulation::accuracy`](crate::Simulation::accuracy) chose. A
/// run with these settings is as accurate. `Display` prints them with the reason for the choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The element.
    pub element: Element,
    /// The step size, positive; if steps vary or breaks cut the span, the longest step.
    pub step: f64,
    /// The shortest step, positive.
    pub shortest: f64,
    /// The tolerance of the iteration inside elements, relative to the state.
    pub tolerance: f64,
    /// How the equations of elements were solved: by [`Solve::FixedPoint`] if that converges in all steps, otherwise
    /// as set in the simulation.
    pub solve: Solve,
    /// The accuracy asked for.
    pub accuracy: f64,
    /// The estimated error of the motion.
    pub error_estimate: f64,
    /// The runs over the whole span, in order; the last one is the motion.
    pub attempts: Vec<Attempt>,
    /// The cost of all steps of the search: probes, a pilot run, all runs, and the one for verification. The motion's
    /// own [`Statistics`] are those of the last run alone.
    pub work: Statistics,
}

/// One run of the search for a step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attempt {
    /// The longest step of this run.
    pub step: f64,
    /// The estimated error of this run, from the run that followed (for the last run, from the one before); `None` if
    /// the run failed.
    pub error_estimate: Option<f64>,
}

impl Picked {
    /// Whether step sizes were varied on purpose, short where the motion is fast; not if only the last step of a span
    /// is shorter than the others.
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
