//! Runs with error estimates and runs with a prescribed accuracy: the part that both kinds of length share.

mod asked;
mod graded;
mod pilots;
mod place;
pub(super) mod repeatable;
mod runs;
mod watcher;

use super::mesh::Mesh;
use crate::accuracy::{Asked, Estimated, Found, Pilot, difference, element_for, search};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use graded::{Steps, graded, graded_by};
use repeatable::{Broken, Repeatable};
use runs::{Kept, Runs};
use std::ops::ControlFlow;
use tfe_runtime::{Element, Statistics};
use watcher::{Watcher, follow};

/// Integrates over a mesh, and again with an element of higher order; the difference estimates the error (T-98).
fn estimated<R: Repeatable<N>, const N: usize>(
    run: &R,
    (t0, start): (f64, &R::State),
    mesh: &Mesh<N>,
) -> Result<Estimated<R::Motion>, Broken<R::Motion>> {
    let (element, control) = (run.element(), run.control());
    let mut stepper = match run.stepper(element, control, true) {
        Ok(stepper) => stepper,
        Err(kind) => return Err(Box::new((kind, run.part((t0, start), (t0, start))))),
    };
    let mut watcher = Watcher::new(run, &mut stepper, (t0, start));
    let mut times = Vec::new();
    let motion = run.record(&mut stepper, mesh, (t0, start), &mut |stepper, at| {
        times.push(at.t);
        watcher.pass(run, stepper, at, true);
        ControlFlow::Continue(())
    })?;
    let other = || {
        // The same steps with one node more. Above the largest number of nodes: two steps of half the length instead.
        let more = Element::mixed(element.nodes() + 1);
        let start = (t0, start);
        if more.validate().is_ok() {
            let mut stepper = run.stepper(more, control, false)?;
            return follow(run, &mut stepper, start, mesh, &times).map_err(|stop| stop.0);
        }
        let starts = [t0].into_iter().chain(times.iter().copied());
        // Every element is halved, not only the longest ones.
        let halves = starts
            .zip(&times)
            .flat_map(|(t, next)| [t + 0.5 * (next - t), *next]);
        let nodes: Vec<f64> = [t0].into_iter().chain(halves).collect();
        let mut stepper = run.stepper(Element::mixed(element.nodes()), control, false)?;
        let mesh = match times.is_empty() {
            true => mesh.clone(),
            false => run.through(&nodes)?,
        };
        follow(run, &mut stepper, start, &mesh, &times).map_err(|stop| stop.0)
    };
    match other() {
        Ok(other) => {
            let errors = difference(&watcher.trace, &other);
            Ok(Estimated::new(motion, times, errors, run.outputs(), None))
        }
        Err(kind) => Err(Box::new((kind, motion))),
    }
}

/// Half a unit in the last place of 1: a lower bound of every relative error, also where two runs agree to the last
/// bit.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// Searches the element and the step size that meet an accuracy, and runs with them (T-99).
fn accurate<R: Repeatable<N>, const N: usize>(
    run: &R,
    start: &R::State,
    asked: &Asked,
    steps: Steps,
) -> Result<Estimated<R::Motion>, Broken<R::Motion>> {
    let t0 = asked.span.start;
    let wanted = asked.accuracy;
    let asked = &Asked {
        accuracy: wanted.max(ROUNDING),
        ..asked.clone()
    };
    let mut kept = Kept::Nothing;
    let mut work = Statistics::NONE;
    let outcome = match (steps, run.nodes()) {
        (_, Some(nodes)) => {
            let element = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
            let given = Asked {
                graded: graded_by(nodes, element),
                ..asked.clone()
            };
            find(run, start, &given, None, (&mut kept, &mut work))
        }
        (Steps::Varying { damps }, None) if const { R::MAY_VARY } => {
            let mut explored = Statistics::NONE;
            let mut pilot = |first| graded(run, start, asked, damps, first, &mut explored);
            let found = find(run, start, asked, Some(&mut pilot), (&mut kept, &mut work));
            work.merge(&explored);
            found
        }
        (_, None) => find(run, start, asked, None, (&mut kept, &mut work)),
    };
    let motion = match kept {
        Kept::Motion(motion) => motion,
        Kept::Nothing => run.part((t0, start), (t0, start)),
        Kept::Part(t, state) => run.part((t0, start), (t, &state)),
    };
    concluded((outcome, work), motion, run.outputs(), wanted)
}

/// The result of a search: the motion with its errors, or why it has not the accuracy that is wanted.
fn concluded<T>(
    (outcome, work): (Result<Found, RunErrorKind>, Statistics),
    motion: T,
    outputs: Vec<String>,
    wanted: f64,
) -> Result<Estimated<T>, Broken<T>> {
    let mut found = match outcome {
        Ok(found) => found,
        Err(kind) => return Err(Box::new((kind, motion))),
    };
    found.picked.work = work;
    let (times, errors) = (found.times, found.errors);
    let estimated = Estimated::new(motion, times, errors, outputs, Some(found.picked));
    let is_possible = wanted >= ROUNDING;
    if found.is_met && is_possible {
        return Ok(estimated);
    }
    let until = estimated.horizon(wanted);
    let kind = RunErrorKind::AccuracyMissed {
        asked: wanted,
        estimate: larger(estimated.error_estimate(), ROUNDING),
        until: until.filter(|_| is_possible),
    };
    Err(Box::new((kind, estimated.into_motion())))
}

fn find<R: Repeatable<N>, const N: usize>(
    run: &R,
    start: &R::State,
    asked: &Asked,
    pilot: Option<&mut Pilot<'_>>,
    (kept, work): (&mut Kept<R::Motion, R::State>, &mut Statistics),
) -> Result<Found, RunErrorKind> {
    let mut runs = Runs::new(run, (asked.span.start, start), kept, work);
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
