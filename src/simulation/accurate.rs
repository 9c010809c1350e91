//! Runs with error estimates and runs with a prescribed accuracy: the part that both kinds of length share.

mod asked;
mod graded;
mod pilots;
mod place;
mod repeatable;
mod runs;
mod trial;
mod watcher;

use super::times::Times;
use crate::accuracy::{Asked, Estimated, Found, Pilot, Trace, difference, element_for, search};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use graded::{Steps, graded, graded_by};
use repeatable::Repeatable;
use runs::{Kept, Runs};
use std::ops::ControlFlow;
use tfe_runtime::{Element, Statistics};
use watcher::{Watcher, follow};

/// Integrates over a mesh, and again with an element of higher order; the difference estimates the error (T-98). The
/// motion is kept by the run.
fn estimated(run: &dyn Repeatable, mesh: &Times) -> Result<Estimated<()>, RunErrorKind> {
    let given = run.given();
    let (element, control) = (given.element, given.control);
    let mut stepper = run.stepper(element, control, true)?;
    let mut watcher = Watcher::new(run, &mut *stepper);
    let mut times = Vec::new();
    stepper.record(mesh, true, &mut |at| {
        times.push(at.t);
        watcher.pass(at.arrived, at.acts, true);
        ControlFlow::Continue(())
    })?;
    let other = compared(run, mesh, &times)?;
    let errors = difference(&watcher.trace, &other);
    let outputs = given.outputs.clone();
    Ok(Estimated::new((), times, errors, outputs, None))
}

/// The same run with an element of higher order, at the ends of its elements.
fn compared(run: &dyn Repeatable, mesh: &Times, times: &[f64]) -> Result<Trace, RunErrorKind> {
    let given = run.given();
    let (element, control) = (given.element, given.control);
    // The same steps with one node more. Above the largest number of nodes: two steps of half the length instead.
    let more = Element::mixed(element.nodes() + 1);
    if more.validate().is_ok() {
        let mut stepper = run.stepper(more, control, false)?;
        return follow(run, &mut *stepper, mesh, times).map_err(|stop| stop.0);
    }
    let (t0, _) = given.start;
    let starts = [t0].into_iter().chain(times.iter().copied());
    // Every element is halved, not only the longest ones.
    let halves = starts
        .zip(times)
        .flat_map(|(t, next)| [t + 0.5 * (next - t), *next]);
    let nodes: Vec<f64> = [t0].into_iter().chain(halves).collect();
    let mut stepper = run.stepper(Element::mixed(element.nodes()), control, false)?;
    let mesh = match times.is_empty() {
        true => mesh.clone(),
        false => given.through(given.element, &nodes)?,
    };
    follow(run, &mut *stepper, &mesh, times).map_err(|stop| stop.0)
}

/// Half a unit in the last place of 1: a lower bound of every relative error, also where two runs agree to the last
/// bit.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// Searches the element and the step size that meet an accuracy, and runs with them (T-99). The motion is kept by the
/// run; without one, `kept` has the state that was reached.
fn accurate(
    run: &dyn Repeatable,
    asked: &Asked,
    steps: Steps,
    kept: &mut Kept,
) -> Result<Estimated<()>, RunErrorKind> {
    let wanted = asked.accuracy;
    let asked = &Asked {
        accuracy: wanted.max(ROUNDING),
        ..asked.clone()
    };
    let outcome = match (steps, run.given().nodes) {
        (_, Some(nodes)) => {
            let element = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
            let given = Asked {
                graded: graded_by(nodes, element),
                ..asked.clone()
            };
            find(run, &given, None, kept)
        }
        (Steps::Varying { damps }, None) => {
            let mut explored = Statistics::NONE;
            let mut pilot = |first| graded(run, asked, damps, first, &mut explored);
            let found = find(run, asked, Some(&mut pilot), kept);
            kept.work.merge(&explored);
            found
        }
        (Steps::Equal, None) => find(run, asked, None, kept),
    };
    concluded((outcome?, kept.work), run.given().outputs.clone(), wanted)
}

/// The result of a search, or that it has not the accuracy that is wanted.
fn concluded(
    (mut found, work): (Found, Statistics),
    outputs: Vec<String>,
    wanted: f64,
) -> Result<Estimated<()>, RunErrorKind> {
    found.picked.work = work;
    let (times, errors) = (found.times, found.errors);
    let estimated = Estimated::new((), times, errors, outputs, Some(found.picked));
    let is_possible = wanted >= ROUNDING;
    if found.is_met && is_possible {
        return Ok(estimated);
    }
    let until = estimated.horizon(wanted);
    Err(RunErrorKind::AccuracyMissed {
        asked: wanted,
        estimate: larger(estimated.error_estimate(), ROUNDING),
        until: until.filter(|_| is_possible),
    })
}

fn find(
    run: &dyn Repeatable,
    asked: &Asked,
    pilot: Option<&mut Pilot<'_>>,
    kept: &mut Kept,
) -> Result<Found, RunErrorKind> {
    let mut runs = Runs::new(run, kept);
    search(asked, &mut runs, pilot)
}

/// Refuses an accuracy that is not between 0 and 1.
fn check_accuracy(accuracy: f64) -> Result<(), RunErrorKind> {
    if accuracy > 0.0 && accuracy < 1.0 {
        Ok(())
    } else {
        Err(RunErrorKind::Accuracy { asked: accuracy })
    }
}

/// A simulation that chooses its element and its step size to meet a given accuracy; made by
/// [`Simulation::accuracy`](crate::Simulation::accuracy).
#[derive(Clone, Debug)]
pub struct Accurate<S> {
    simulation: S,
    accuracy: f64,
    equal_steps: bool,
}

impl<S> Accurate<S> {
    fn new(simulation: S, accuracy: f64) -> Self {
        Self {
            simulation,
            accuracy,
            equal_steps: false,
        }
    }

    /// Forbids variable step sizes: all steps between breaks are then equal. Conservative models that do not depend on
    /// time always have equal steps.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
    /// struct VanDerPol { mu: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let oscillator = VanDerPol { mu: 20.0 };
    /// let start = oscillator.state([2.0], [0.0]);
    /// let asked = Simulation::new(&oscillator).accuracy(1e-4);
    /// let graded = asked.clone().run(start, 0.0..40.0)?;
    /// let equal = asked.equal_steps().run(start, 0.0..40.0)?;
    /// assert!(2 * graded.states().len() < equal.states().len());
    /// assert!((graded.last().q[0] - equal.last().q[0]).abs() < 4e-4); // of a motion between −2 and 2
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn equal_steps(mut self) -> Self {
        self.equal_steps = true;
        self
    }
}
