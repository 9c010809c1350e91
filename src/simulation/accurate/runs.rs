//! Makes the runs of a search for an accuracy, and keeps their steppers and their results.

use super::place::Place;
use super::repeatable::{Passing, Repeatable};
use super::watcher::{Watcher, follow};
use crate::accuracy::{Beside, Failed, Judge, Ran, RanBeside, Runner, Trace, Way};
use crate::error::RunErrorKind;
use crate::simulation::mesh::Mesh;
use std::mem;
use std::ops::ControlFlow;
use tfe_runtime::constrained::Trail;
use tfe_runtime::{Element, Solve, Statistics};

/// The largest number of fixed-point iterations a step; with more, Newton's method is cheaper.
pub(super) const MOST_ITERATIONS: u32 = 25;

/// The best result so far: the last recorded motion, or, before there is one, the state that reached farthest.
pub(super) enum Kept<T, S> {
    Nothing,
    Part(f64, S),
    Motion(T),
}

impl<T, S> Kept<T, S> {
    fn keep_part(&mut self, start: f64, t: f64, state: S) {
        let farthest = match self {
            Self::Nothing => start,
            Self::Part(farthest, _) => *farthest,
            Self::Motion(_) => return,
        };
        if (t - start).abs() >= (farthest - start).abs() {
            *self = Self::Part(t, state);
        }
    }
}

/// Makes the runs of a search.
pub(super) struct Runs<'a, R: Repeatable<N>, const N: usize> {
    run: &'a R,
    start: (f64, &'a R::State),
    /// The steppers used last, the most recent first.
    steppers: Vec<Reusable<R::Stepper>>,
    place: Place,
    /// The stage values that the more accurate run of the last pair has found, as first guesses.
    trail: Trail,
    kept: &'a mut Kept<R::Motion, R::State>,
    work: &'a mut Statistics,
}

/// A stepper with the settings for which it can be used again.
struct Reusable<T> {
    by_iteration: bool,
    element: Element,
    stepper: T,
}

impl<'a, R: Repeatable<N>, const N: usize> Runs<'a, R, N> {
    /// The number of steppers that are kept: those of two elements.
    const MOST_STEPPERS: usize = 2;

    /// Prepares runs from a start; `kept` receives the best result, and `work` the work of all runs.
    pub(super) fn new(
        run: &'a R,
        start: (f64, &'a R::State),
        kept: &'a mut Kept<R::Motion, R::State>,
        work: &'a mut Statistics,
    ) -> Self {
        Self {
            run,
            start,
            steppers: Vec::new(),
            place: Place::default(),
            trail: Trail::new(),
            kept,
            work,
        }
    }

    /// Takes the stepper with the element and the solver of a run from those that are kept, or creates one.
    fn take_stepper(&mut self, way: &Way<'_>) -> Result<Reusable<R::Stepper>, RunErrorKind> {
        let is_known = |one: &Reusable<R::Stepper>| {
            (one.by_iteration, one.element) == (way.by_iteration, way.element)
        };
        if let Some(known) = self.steppers.iter().position(is_known) {
            return Ok(self.steppers.remove(known));
        }
        let mut control = self.run.control();
        if way.by_iteration {
            control.solve = Solve::FixedPoint;
            control.max_iterations = control.max_iterations.min(MOST_ITERATIONS);
        }
        Ok(Reusable {
            by_iteration: way.by_iteration,
            element: way.element,
            stepper: self.run.stepper(way.element, control, true)?,
        })
    }

    /// Adds the work of a stepper to the total, keeps the stepper for the next run, and returns its work in this run.
    fn keep_stepper(&mut self, mut reusable: Reusable<R::Stepper>) -> Statistics {
        let taken = R::take_statistics(&mut reusable.stepper);
        self.work.merge(&taken);
        self.steppers.insert(0, reusable);
        self.steppers.truncate(Self::MOST_STEPPERS);
        taken
    }

    fn mesh(&self, way: &Way<'_>) -> Result<Mesh<N>, RunErrorKind> {
        match way.grading {
            Some(grading) => self.run.through(&way.nodes(grading)),
            None => self.run.even(way.cuts, way.step),
        }
    }

    /// Makes a run whose motion may be the result of the search.
    fn record(
        &mut self,
        stepper: &mut R::Stepper,
        mesh: &Mesh<N>,
        passed: &mut Passing<'_, R::Model, R::Stepper, R::State>,
    ) -> Result<(), Failed> {
        match self.run.record(stepper, mesh, self.start, passed) {
            Ok(motion) => {
                *self.kept = Kept::Motion(motion);
                Ok(())
            }
            Err(broken) => {
                let (kind, part) = *broken;
                if !matches!(self.kept, Kept::Motion(_)) {
                    *self.kept = Kept::Motion(part);
                }
                Err(Failed::from(kind))
            }
        }
    }

    fn trace(
        &mut self,
        stepper: &mut R::Stepper,
        way: &Way<'_>,
        mesh: &Mesh<N>,
    ) -> Result<Trace, Failed> {
        let (run, times) = (self.run, &way.cuts[1..]);
        if way.keeps {
            let mut watcher = Watcher::new(run, stepper, self.start);
            let mut times = times.iter().peekable();
            self.record(stepper, mesh, &mut |stepper, at| {
                let keeps = times.next_if_eq(&&at.t).is_some();
                watcher.pass(run, stepper, at, keeps);
                ControlFlow::Continue(())
            })?;
            return Ok(watcher.trace);
        }
        follow(run, stepper, self.start, mesh, times).map_err(|(kind, t, state)| {
            let mut failed = Failed::from(kind);
            if !run.has_events() {
                let stopped = (&failed.kind, &state);
                failed.is_final |= (self.place).is_an_end(run, self.start.0, (way, mesh), stopped);
            }
            self.kept.keep_part(self.start.0, t, state);
            failed
        })
    }
}

impl<R: Repeatable<N>, const N: usize> Runner for Runs<'_, R, N> {
    fn run(&mut self, way: &Way<'_>) -> Result<Ran, Failed> {
        let mesh = self.mesh(way)?;
        let mut reusable = self.take_stepper(way)?;
        R::set_tolerance(&mut reusable.stepper, way.tolerance);
        let trace = self.trace(&mut reusable.stepper, way, &mesh);
        let taken = self.keep_stepper(reusable);
        Ok(Ran {
            trace: trace?,
            contracts: taken.newton_iterations == 0
                && taken.products == 0
                && !self.run.crosses_kinks(),
        })
    }

    fn run_beside(
        &mut self,
        way: &Way<'_>,
        better: &Way<'_>,
        judge: &mut Judge<'_>,
    ) -> Result<RanBeside, Failed> {
        let (run, (t0, start)) = (self.run, self.start);
        let mesh = self.mesh(way)?;
        let (mut first, mut second) = (self.take_stepper(way)?, self.take_stepper(better)?);
        R::set_tolerance(&mut first.stepper, way.tolerance);
        R::set_tolerance(&mut second.stepper, better.tolerance);
        let mut watchers = [
            Watcher::new(run, &mut first.stepper, self.start),
            Watcher::new(run, &mut second.stepper, self.start),
        ];
        let mut elements = mesh.elements().enumerate().peekable();
        // First guesses: the first stepper takes them from the more accurate run of the last pair, the second from the
        // first stepper in the same step.
        let before = mem::take(&mut self.trail);
        let (mut trail, mut here) = (Trail::new(), Trail::new());
        let mut state = start.clone();
        let mut shown = Shown::default();
        let mut failure = None;
        let mut goes_on = ControlFlow::Continue(());
        let passed = self.record(&mut first.stepper, &mesh, &mut |stepper, at| {
            // The second stepper makes the same step.
            let Some((element, (from, next, h))) = elements.next() else {
                return ControlFlow::Continue(());
            };
            here.clear();
            R::leave(stepper, &mut here);
            R::foresee(&mut second.stepper, &here, (from, h));
            let step = run.advance(&mut second.stepper, (from, next, h), &mesh, &mut state);
            if let Err(source) = step {
                failure = Some(run.failed(element, (from, h), source));
                return ControlFlow::Break(());
            }
            R::leave(&second.stepper, &mut trail);
            if let Some((_, (from, _, h))) = elements.peek() {
                R::foresee(stepper, &before, (*from, *h));
            }
            let [one, other] = &mut watchers;
            one.pass(run, stepper, at, true);
            // Pairs are not used for runs with events, so the parameters are those of the given model.
            other.pass(run, &mut second.stepper, &run.at(at.t, &state), true);
            goes_on = shown.judge(at.t, &watchers, judge);
            goes_on
        });
        self.trail = farther(trail, before, t0);
        self.keep_stepper(second);
        self.keep_stepper(first);
        let failed = passed.err().or(failure.map(Failed::from));
        if let Some(mut failed) = failed {
            let stopped = (&failed.kind, &state);
            failed.is_final |= self.place.is_an_end(run, t0, (way, &mesh), stopped);
            return Err(failed);
        }
        Ok(RanBeside {
            traces: watchers.map(|watcher| watcher.trace),
            times: shown.times,
            is_complete: goes_on.is_continue(),
        })
    }
}

/// What a judge is shown of two runs over the same steps.
#[derive(Default)]
struct Shown {
    /// The times of the nodes.
    times: Vec<f64>,
    apart: Vec<f64>,
    sizes: Vec<f64>,
}

impl Shown {
    /// Compares the runs at a node that both have reached; the result says whether they continue.
    fn judge(
        &mut self,
        time: f64,
        [one, other]: &[Watcher; 2],
        judge: &mut Judge<'_>,
    ) -> ControlFlow<()> {
        self.times.push(time);
        other.trace.apart(&one.row, &other.row, &mut self.apart);
        other.trace.sizes_with(&one.row, &mut self.sizes);
        judge(&Beside {
            time,
            apart: &self.apart,
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
