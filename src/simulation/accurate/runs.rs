//! Makes the runs of a search for an accuracy, and keeps their steppers.

use super::place::Place;
use super::repeatable::{Repeatable, Stepping};
use super::watcher::{Watcher, follow};
use crate::accuracy::{
    Failed, PairComparison, PairObserver, PairRun, Ran, RunSettings, Runner, Trace,
};
use crate::error::RunErrorKind;
use crate::simulation::times::Times;
use std::mem;
use std::ops::ControlFlow;
use tfe_runtime::constrained::Trail;
use tfe_runtime::{Element, Solve, Statistics};

/// The largest number of fixed-point iterations a step; with more, Newton's method is cheaper.
pub(super) const MAX_ITERATIONS: u32 = 25;

/// What a search keeps besides its result and its motion.
pub(super) struct Kept {
    /// The time and the state that reached farthest in runs that were not recorded.
    pub(super) farthest: Option<(f64, Vec<f64>)>,
    /// The work of all runs.
    pub(super) work: Statistics,
}

impl Kept {
    pub(super) const NOTHING: Self = Self {
        farthest: None,
        work: Statistics::NONE,
    };

    fn keep_part(&mut self, start: f64, t: f64, state: Vec<f64>) {
        let farthest = self.farthest.as_ref().map_or(start, |(time, _)| *time);
        if (t - start).abs() >= (farthest - start).abs() {
            self.farthest = Some((t, state));
        }
    }
}

/// Makes the runs of a search.
pub(super) struct Runs<'a> {
    run: &'a dyn Repeatable,
    /// The steppers used last, the most recent first.
    steppers: Vec<Reusable<'a>>,
    place: Place,
    /// The stage values that the more accurate run of the last pair has found, as first guesses.
    trail: Trail,
    kept: &'a mut Kept,
}

/// A stepper with the settings for which it can be used again.
struct Reusable<'a> {
    by_iteration: bool,
    element: Element,
    stepper: Box<dyn Stepping + 'a>,
}

impl<'a> Runs<'a> {
    /// The number of steppers that are kept: those of two elements.
    const MAX_STEPPERS: usize = 2;

    pub(super) fn new(run: &'a dyn Repeatable, kept: &'a mut Kept) -> Self {
        Self {
            run,
            steppers: Vec::new(),
            place: Place::default(),
            trail: Trail::new(),
            kept,
        }
    }

    /// A stepper at the start with the element, the solver and the tolerance of a run, from those that are kept or new.
    fn take_stepper(&mut self, settings: &RunSettings<'_>) -> Result<Reusable<'a>, RunErrorKind> {
        let mut reusable = self.find_stepper(settings)?;
        reusable.stepper.set_tolerance(settings.tolerance);
        Ok(reusable)
    }

    fn find_stepper(&mut self, settings: &RunSettings<'_>) -> Result<Reusable<'a>, RunErrorKind> {
        let given = self.run.given();
        let is_known = |one: &Reusable<'a>| {
            (one.by_iteration, one.element) == (settings.by_iteration, settings.element)
        };
        if let Some(known) = self.steppers.iter().position(is_known) {
            let mut known = self.steppers.remove(known);
            let (t, start) = &given.start;
            known.stepper.place(*t, start);
            return Ok(known);
        }
        let mut control = given.control;
        if settings.by_iteration {
            control.solve = Solve::FixedPoint;
            control.max_iterations = control.max_iterations.min(MAX_ITERATIONS);
        }
        Ok(Reusable {
            by_iteration: settings.by_iteration,
            element: settings.element,
            stepper: self.run.stepper(settings.element, control, true)?,
        })
    }

    /// Adds the work of a stepper to the total, keeps the stepper for the next run, and returns its work in this run.
    fn keep_stepper(&mut self, mut reusable: Reusable<'a>) -> Statistics {
        let taken = reusable.stepper.take_statistics();
        self.kept.work.merge(&taken);
        self.steppers.insert(0, reusable);
        self.steppers.truncate(Self::MAX_STEPPERS);
        taken
    }

    fn mesh(&self, settings: &RunSettings<'_>) -> Result<Times, RunErrorKind> {
        let given = self.run.given();
        match settings.grading {
            Some(grading) => given.through(settings.element, &settings.nodes(grading)),
            None => given.even(settings.element, settings.cuts, settings.step),
        }
    }

    fn trace(
        &mut self,
        stepper: &mut dyn Stepping,
        settings: &RunSettings<'_>,
        mesh: &Times,
    ) -> Result<Trace, Failed> {
        let (run, times) = (self.run, &settings.cuts[1..]);
        if settings.keeps {
            let mut watcher = Watcher::new(run, stepper);
            let mut times = times.iter().peekable();
            stepper.record(mesh, true, &mut |at| {
                let keeps = times.next_if_eq(&&at.t).is_some();
                watcher.pass(at.arrived, at.acts, keeps);
                ControlFlow::Continue(())
            })?;
            return Ok(watcher.trace);
        }
        follow(run, stepper, mesh, times).map_err(|stop| {
            let (kind, t, state) = *stop;
            let mut failed = Failed::from(kind);
            let given = run.given();
            if !given.has_events {
                let stopped = (&failed.kind, &state[..]);
                failed.is_final |= self.place.is_an_end(run, (settings, mesh), stopped);
            }
            self.kept.keep_part(given.start.0, t, state);
            failed
        })
    }
}

impl Runner for Runs<'_> {
    fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed> {
        let mesh = self.mesh(settings)?;
        let mut reusable = self.take_stepper(settings)?;
        let trace = self.trace(&mut *reusable.stepper, settings, &mesh);
        let taken = self.keep_stepper(reusable);
        let crosses_kinks = self.run.given().crosses_kinks;
        Ok(Ran {
            trace: trace?,
            contracts: taken.newton_iterations == 0 && taken.products == 0 && !crosses_kinks,
        })
    }

    fn run_pair(
        &mut self,
        settings: &RunSettings<'_>,
        better: &RunSettings<'_>,
        observer: &mut PairObserver<'_>,
    ) -> Result<PairRun, Failed> {
        let run = self.run;
        let mesh = self.mesh(settings)?;
        let (mut first, mut second) = (self.take_stepper(settings)?, self.take_stepper(better)?);
        let mut watchers = [
            Watcher::new(run, &mut *first.stepper),
            Watcher::new(run, &mut *second.stepper),
        ];
        let mut elements = mesh.elements().enumerate().peekable();
        // First guesses: the first stepper takes them from the more accurate run of the last pair, the second from the
        // first stepper in the same step.
        let before = mem::take(&mut self.trail);
        let (mut trail, mut here) = (Trail::new(), Trail::new());
        let mut shown = Shown::default();
        let mut failure = None;
        let mut goes_on = ControlFlow::Continue(());
        let comparison = &mut second.stepper;
        let passed = first.stepper.record(&mesh, true, &mut |at| {
            // The second stepper makes the same step.
            let Some((element, (from, next, h))) = elements.next() else {
                return ControlFlow::Continue(());
            };
            here.clear();
            at.arrived.leave(&mut here);
            comparison.foresee(&here, (from, h));
            if let Err(source) = comparison.advance(&mesh, (from, next, h)) {
                failure = Some(run.failed(element, (from, h), source));
                return ControlFlow::Break(());
            }
            comparison.leave(&mut trail);
            if let Some((_, (from, _, h))) = elements.peek() {
                at.arrived.foresee(&before, (*from, *h));
            }
            let [one, other] = &mut watchers;
            one.pass(at.arrived, at.acts, true);
            // Pairs are not used for runs with events, so the parameters are those of the given model.
            other.pass(&mut **comparison, 0, true);
            goes_on = shown.compare(at.t, &watchers, observer);
            goes_on
        });
        self.trail = farther(trail, before, run.given().start.0);
        let state = second.stepper.state();
        self.keep_stepper(second);
        self.keep_stepper(first);
        if let Some(kind) = passed.err().or(failure) {
            let mut failed = Failed::from(kind);
            let stopped = (&failed.kind, &state[..]);
            failed.is_final |= self.place.is_an_end(run, (settings, &mesh), stopped);
            return Err(failed);
        }
        Ok(PairRun {
            traces: watchers.map(|watcher| watcher.trace),
            times: shown.times,
            is_complete: goes_on.is_continue(),
        })
    }
}

/// What an observer is shown of two runs over the same steps.
#[derive(Default)]
struct Shown {
    /// The times of the nodes.
    times: Vec<f64>,
    differences: Vec<f64>,
    sizes: Vec<f64>,
}

impl Shown {
    /// Compares the runs at a node that both have reached; the result says whether they continue.
    fn compare(
        &mut self,
        time: f64,
        [one, other]: &[Watcher; 2],
        observer: &mut PairObserver<'_>,
    ) -> ControlFlow<()> {
        self.times.push(time);
        other
            .trace
            .differences(&one.row, &other.row, &mut self.differences);
        other.trace.sizes_with(&one.row, &mut self.sizes);
        observer(&PairComparison {
            time,
            differences: &self.differences,
            sizes: &self.sizes,
        })
    }
}

/// The trail of a pair of runs from `start`, or that of an earlier pair if that reaches as far.
fn farther(trail: Trail, earlier: Trail, start: f64) -> Trail {
    let reach = |trail: &Trail| trail.end().map_or(0.0, |end| (end - start).abs());
    if reach(&trail) > reach(&earlier) {
        trail
    } else {
        earlier
    }
}
