//! Runs with an estimate of their error: what models of both kinds of length have in common.

mod family;
mod fixed;
mod pilots;

use super::mesh::Mesh;
use super::progress::Bar;
use crate::accuracy::{
    Asked, Beside, Course, Estimated, Failed, Found, Graded, Grading, Judge, Pilot, Ran, RanBeside,
    Runner, Trace, Way, damping_element_for, difference, element_for, explore, factor_for, search,
};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use std::ops::ControlFlow;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Facts, Solve, Statistics, StepError};

/// An iteration that takes more is no bargain.
const MOST_ITERATIONS: u32 = 25;

/// A run that can be made with other elements and steps.
pub(super) trait Repeatable<const N: usize> {
    type State: Clone;
    type Stepper;
    type Motion;

    /// The element; the default one where none was chosen.
    fn element(&self) -> Element;
    fn control(&self) -> Control;
    /// Whether progress is to be shown.
    fn progress(&self) -> bool;
    fn coordinates(&self) -> usize;
    /// How many outputs there are.
    fn columns(&self) -> usize;
    /// The names of all outputs.
    fn outputs(&self) -> Vec<String>;
    /// A stepper; the inside of its steps is asked for only if they are to be recorded.
    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Self::Stepper, RunErrorKind>;
    /// One element of the mesh: its start, end and length.
    fn advance(
        &self,
        stepper: &mut Self::Stepper,
        element: (f64, f64, f64),
        mesh: &Mesh<N>,
        state: &mut Self::State,
    ) -> Result<(), StepError>;
    /// Why an element could not be solved.
    fn failed(&self, element: usize, (time, step): (f64, f64), source: StepError) -> RunErrorKind {
        RunErrorKind::Solve {
            element,
            time,
            step,
            source,
        }
    }
    fn set_tolerance(stepper: &mut Self::Stepper, tolerance: f64);
    fn statistics(stepper: &Self::Stepper) -> Statistics;
    /// The same since the last call.
    fn take_statistics(stepper: &mut Self::Stepper) -> Statistics;
    /// Coordinates, momenta and outputs, one after the other.
    fn row(&self, stepper: &mut Self::Stepper, t: f64, state: &Self::State, row: &mut [f64]);
    /// The steps of a mesh as motion; every end of an element is shown to `passed`.
    fn record(
        &self,
        stepper: &mut Self::Stepper,
        mesh: &Mesh<N>,
        start: (f64, &Self::State),
        passed: &mut Passing<'_, Self::Stepper, Self::State>,
    ) -> Result<Self::Motion, Broken<Self::Motion>>;
    /// Whether the run looks for events, so that elements alone do not make it.
    fn has_events(&self) -> bool {
        false
    }
    /// Whether steps go across kinks or jumps of forces, so that errors need not fall with the order of the element.
    fn crosses_kinks(&self) -> bool;
    /// A motion of the start and one other state.
    fn part(&self, start: (f64, &Self::State), end: (f64, &Self::State)) -> Self::Motion;
    /// A mesh of equal parts between times.
    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<N>, RunErrorKind>;
    /// A mesh of given nodes.
    fn through(&self, nodes: &[f64]) -> Result<Mesh<N>, RunErrorKind>;
    /// The nodes that were given.
    fn nodes(&self) -> Option<&[f64]>;
}

/// Is shown the end of every element: the stepper, the time, the state, and how many events have changed the motion so far. Says whether the run goes on.
pub(super) type Passing<'a, T, S> = dyn FnMut(&mut T, f64, &S, usize) -> ControlFlow<()> + 'a;

/// Why a recorded run has stopped, and what there is of it.
pub(super) type Broken<T> = Box<(RunErrorKind, T)>;

/// What is seen of a run.
struct Watcher {
    trace: Trace,
    /// Room for one time.
    row: Vec<f64>,
}

impl Watcher {
    /// One that has seen the start.
    fn new<R: Repeatable<N>, const N: usize>(
        run: &R,
        stepper: &mut R::Stepper,
        (t, start): (f64, &R::State),
    ) -> Self {
        let trace = Trace::new(run.coordinates(), run.columns());
        let mut watcher = Self {
            row: vec![0.0; trace.width()],
            trace,
        };
        watcher.pass(run, stepper, (t, start), 0, false);
        watcher
    }

    fn pass<R: Repeatable<N>, const N: usize>(
        &mut self,
        run: &R,
        stepper: &mut R::Stepper,
        (t, state): (f64, &R::State),
        acts: usize,
        keeps: bool,
    ) {
        run.row(stepper, t, state, &mut self.row);
        self.trace.pass(&self.row, acts, keeps);
    }
}

/// What there is of the motion: the last one that was recorded; as long as there is none, the state that went farthest.
enum Kept<T, S> {
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

/// Why a run has stopped, and where.
type Stop<S> = (RunErrorKind, f64, S);

/// A run of which nothing is kept but what it is compared by, at `times`.
fn follow<R: Repeatable<N>, const N: usize>(
    run: &R,
    stepper: &mut R::Stepper,
    (t0, start): (f64, &R::State),
    mesh: &Mesh<N>,
    times: &[f64],
) -> Result<Trace, Stop<R::State>> {
    let mut watcher = Watcher::new(run, stepper, (t0, start));
    let mut times = times.iter().peekable();
    if run.has_events() {
        let passed = run.record(
            stepper,
            mesh,
            (t0, start),
            &mut |stepper, t, state, acts| {
                let keeps = times.next_if_eq(&&t).is_some();
                watcher.pass(run, stepper, (t, state), acts, keeps);
                ControlFlow::Continue(())
            },
        );
        return match passed {
            Ok(_) => Ok(watcher.trace),
            Err(broken) => Err((broken.0, t0, start.clone())),
        };
    }
    let mut state = start.clone();
    let mut bar = Bar::new(run.progress(), mesh.steps());
    for (element, (t, next, h)) in mesh.elements().enumerate() {
        if let Err(source) = run.advance(stepper, (t, next, h), mesh, &mut state) {
            let kind = run.failed(element, (t, h), source);
            return Err((kind, t, state));
        }
        let keeps = times.next_if_eq(&&next).is_some();
        watcher.pass(run, stepper, (next, &state), 0, keeps);
        bar.advance();
    }
    Ok(watcher.trace)
}

/// A run over a mesh beside one of higher order (T-98).
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
    let motion = run.record(
        &mut stepper,
        mesh,
        (t0, start),
        &mut |stepper, t, state, acts| {
            times.push(t);
            watcher.pass(run, stepper, (t, state), acts, true);
            ControlFlow::Continue(())
        },
    )?;
    let other = || {
        // The same steps with one node more, or two steps for each of the same number where there are no more.
        let more = Element::mixed(element.nodes() + 1);
        let start = (t0, start);
        if more.validate().is_ok() {
            let mut stepper = run.stepper(more, control, false)?;
            return follow(run, &mut stepper, start, mesh, &times).map_err(|stop| stop.0);
        }
        let nodes: Vec<f64> = [t0].iter().chain(&times).copied().collect();
        let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let half = lengths.fold(0.0, larger) * (0.5 + 1e-9);
        let mut stepper = run.stepper(Element::mixed(element.nodes()), control, false)?;
        let mesh = run.even(&nodes, half)?;
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

/// A run with the element and the step that meet an accuracy (T-99).
fn accurate<R: Repeatable<N>, const N: usize>(
    run: &R,
    start: &R::State,
    asked: &Asked,
    steps: Steps,
) -> Result<Estimated<R::Motion>, Broken<R::Motion>> {
    let t0 = asked.span.start;
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
        (Steps::Equal, None) => find(run, start, asked, None, (&mut kept, &mut work)),
        (Steps::Varying { damps }, None) => {
            let mut explored = Statistics::NONE;
            let mut pilot = |first| graded(run, start, asked, damps, first, &mut explored);
            let found = find(run, start, asked, Some(&mut pilot), (&mut kept, &mut work));
            work.merge(&explored);
            found
        }
    };
    let motion = match kept {
        Kept::Motion(motion) => motion,
        Kept::Nothing => run.part((t0, start), (t0, start)),
        Kept::Part(t, state) => run.part((t0, start), (t, &state)),
    };
    let found = match outcome {
        Ok(mut found) => {
            found.picked.work = work;
            found
        }
        Err(kind) => return Err(Box::new((kind, motion))),
    };
    let (times, errors) = (found.times, found.errors);
    let estimated = Estimated::new(motion, times, errors, run.outputs(), Some(found.picked));
    if found.is_met {
        return Ok(estimated);
    }
    let kind = RunErrorKind::AccuracyMissed {
        asked: asked.accuracy,
        estimate: estimated.error_estimate(),
        until: estimated.horizon(asked.accuracy),
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
    let mut runs = Runs {
        run,
        start: (asked.span.start, start),
        steppers: Vec::new(),
        place: Place::default(),
        kept,
        work,
    };
    search(asked, &mut runs, pilot)
}

/// Makes the runs of a search.
struct Runs<'a, R: Repeatable<N>, const N: usize> {
    run: &'a R,
    start: (f64, &'a R::State),
    /// The last ones.
    steppers: Vec<Reusable<R::Stepper>>,
    place: Place,
    kept: &'a mut Kept<R::Motion, R::State>,
    work: &'a mut Statistics,
}

/// A stepper, and what it is for.
struct Reusable<T> {
    by_iteration: bool,
    element: Element,
    stepper: T,
}

impl<R: Repeatable<N>, const N: usize> Runs<'_, R, N> {
    /// How many steppers are kept: of two elements.
    const MOST_STEPPERS: usize = 2;

    /// Takes the stepper for a way from those that are kept, or makes one.
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

    /// Counts what a stepper has done, and keeps it for the next run. What it has done in this one is returned.
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

    /// A run that may be the motion that is asked for.
    fn record(
        &mut self,
        stepper: &mut R::Stepper,
        mesh: &Mesh<N>,
        passed: &mut Passing<'_, R::Stepper, R::State>,
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
            self.record(stepper, mesh, &mut |stepper, t, state, acts| {
                let keeps = times.next_if_eq(&&t).is_some();
                watcher.pass(run, stepper, (t, state), acts, keeps);
                ControlFlow::Continue(())
            })?;
            return Ok(watcher.trace);
        }
        follow(run, stepper, self.start, mesh, times).map_err(|(kind, t, state)| {
            let mut failed = Failed::from(kind);
            if !run.has_events() && self.place.is_met_again(self.start.0, &failed.kind) {
                failed.is_final |= !is_passed(run, way, mesh, (&failed.kind, &state));
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
        let mut elements = mesh.elements().enumerate();
        let mut state = start.clone();
        let mut times = Vec::new();
        let mut failure = None;
        let mut goes_on = ControlFlow::Continue(());
        let (mut apart, mut sizes) = (Vec::new(), Vec::new());
        let passed = self.record(&mut first.stepper, &mesh, &mut |stepper, t, end, acts| {
            let [one, other] = &mut watchers;
            // The other one makes the same step.
            let Some((element, (from, next, h))) = elements.next() else {
                return ControlFlow::Continue(());
            };
            let step = run.advance(&mut second.stepper, (from, next, h), &mesh, &mut state);
            if let Err(source) = step {
                failure = Some(run.failed(element, (from, h), source));
                return ControlFlow::Break(());
            }
            times.push(t);
            one.pass(run, stepper, (t, end), acts, true);
            other.pass(run, &mut second.stepper, (t, &state), acts, true);
            other.trace.apart(&one.row, &other.row, &mut apart);
            other.trace.sizes_with(&one.row, &mut sizes);
            goes_on = judge(&Beside {
                time: t,
                apart: &apart,
                sizes: &sizes,
            });
            goes_on
        });
        self.keep_stepper(second);
        self.keep_stepper(first);
        let failed = passed.err().or(failure.map(Failed::from));
        if let Some(mut failed) = failed {
            if self.place.is_met_again(t0, &failed.kind) {
                failed.is_final |= !is_passed(run, way, &mesh, (&failed.kind, &state));
            }
            return Err(failed);
        }
        Ok(RanBeside {
            traces: watchers.map(|watcher| watcher.trace),
            times,
            is_complete: goes_on.is_continue(),
        })
    }
}

/// Where runs with shorter and shorter steps stop.
#[derive(Debug, Default)]
struct Place {
    last: Option<(f64, f64)>,
    /// How many runs in succession have stopped there.
    times: u32,
}

impl Place {
    /// Whether runs have stopped again and again within a step or two of the same time, which is not the start's.
    fn is_met_again(&mut self, start: f64, kind: &RunErrorKind) -> bool {
        const OFTEN: u32 = 3;
        let &RunErrorKind::Solve { time, step, .. } = kind else {
            return false;
        };
        let is_same = |&(t, h): &(f64, f64)| (time - t).abs() <= 2.0 * h.abs().max(step.abs());
        self.times = match self.last {
            Some(last) if time != start && is_same(&last) => self.times + 1,
            _ => 1,
        };
        self.last = Some((time, step));
        self.times >= OFTEN
    }
}

/// Whether the motion goes on beyond a time at which a run has stopped, with steps that are as short as they have to be. It does not where it ends in a singular point.
fn is_passed<R: Repeatable<N>, const N: usize>(
    run: &R,
    way: &Way<'_>,
    mesh: &Mesh<N>,
    (kind, state): (&RunErrorKind, &R::State),
) -> bool {
    /// How far beyond, in steps of the run.
    const BEYOND: f64 = 4.0;
    const MOST: u32 = 2000;
    let &RunErrorKind::Solve { time, step, .. } = kind else {
        return true;
    };
    let solve = trusting(run.control()).solve;
    let control = Control {
        solve,
        ..run.control()
    };
    let Ok(mut stepper) = run.stepper(way.element, control, false) else {
        return true;
    };
    let (mut t, mut h, mut state) = (time, step, state.clone());
    for _ in 0..MOST {
        let mut moved = state.clone();
        let next = t + h;
        if next == t {
            return false;
        }
        match run.advance(&mut stepper, (t, next, next - t), mesh, &mut moved) {
            Ok(()) => {
                (t, state) = (next, moved);
                if (t - time).abs() >= BEYOND * step.abs() {
                    return true;
                }
                h = if step.abs() > 2.0 * h.abs() {
                    2.0 * h
                } else {
                    step
                };
            }
            Err(_) => h /= 2.0,
        }
    }
    true
}

/// Given nodes as a grading, with the factor 1 the nodes themselves.
fn graded_by(nodes: &[f64], element: Element) -> Option<Graded> {
    let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    Some(Graded {
        grading: Grading::new(nodes, &lengths.collect::<Vec<_>>())?,
        element,
        factor: 1.0,
    })
}

/// Where steps have to be short, by a pilot run that begins with the step `first`; `None` where equal steps are as good.
///
/// Elements that damp what is fast, or those of Gauss points where nothing is: where the fixed point contracted in nearly all steps.
fn graded<R: Repeatable<N>, const N: usize>(
    run: &R,
    start: &R::State,
    asked: &Asked,
    damps: bool,
    first: f64,
    work: &mut Statistics,
) -> Option<Graded> {
    /// The part of steps that Newton's method may have made.
    const FEW: f64 = 0.1;
    /// What a step may be off by: with less of it the pilot run is longer than those that follow, with more it may step over what is fast.
    const LOCAL: f64 = 1e-7;
    let smooth = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
    let element = match asked.element {
        Some(element) => element,
        None if damps => damping_element_for(asked.accuracy),
        None => smooth,
    };
    let length = (asked.span.end - asked.span.start).abs();
    let course = Course {
        span: asked.span.clone(),
        breaks: asked.breaks.clone(),
        longest: asked.longest.map_or(length, |step| step.abs().min(length)),
        power: element.order() as f64 + 1.0,
        first,
        local: LOCAL,
    };
    let mut pair = pilots::Pilots::new(run, element, &course, start).ok()?;
    let grading = explore(&course, &mut pair);
    *work = pair.work();
    let grading = grading?;
    let element = if asked.element.is_none() && pair.by_newton() < FEW {
        smooth
    } else {
        element
    };
    let steps = grading.sum(asked.span.end);
    Some(Graded {
        grading,
        element,
        factor: factor_for(asked.accuracy, element, course.local, steps),
    })
}

/// Which steps a run may have.
#[derive(Clone, Copy, Debug)]
enum Steps {
    Equal,
    /// Short ones where the motion is fast, where that pays; with elements that damp, if the model runs with them.
    Varying {
        damps: bool,
    },
}

impl Steps {
    /// Equal ones keep the structure of models that are conservative and do not depend on time, and step linear ones by a matrix.
    fn of(facts: &Facts, are_equal: bool, is_constrained: bool) -> Self {
        let may_vary = facts.time_dependent || (facts.forced && !facts.linear);
        if may_vary && !are_equal {
            Self::Varying {
                damps: !is_constrained,
            }
        } else {
            Self::Equal
        }
    }
}

/// What is asked of a run is a number between 0 and 1.
fn check_accuracy(accuracy: f64) -> Result<(), RunErrorKind> {
    if accuracy > 0.0 && accuracy < 1.0 {
        Ok(())
    } else {
        Err(RunErrorKind::Accuracy { asked: accuracy })
    }
}

/// A run to be that picks its element and its step; made by [`Simulation::accuracy`](crate::Simulation::accuracy) and
/// [`FamilySimulation::accuracy`](crate::family::FamilySimulation::accuracy).
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

    /// Forbids steps that vary, as models that are conservative and do not depend on time never have: all steps are equal then, between breaks.
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

/// Runs that are compared with better ones need no other evidence: a step with another root is told by the comparison, and one that was cut on one side alone would
/// spoil it.
fn trusting(control: Control) -> Control {
    let solve = match control.solve {
        Solve::Auto => Solve::Trusting,
        solve => solve,
    };
    Control { solve, ..control }
}
