//! Follows a branch: predictor, corrector, step size control, and the search for bifurcations between two orbits.

use super::arc::{Between, Metric, Row};
use super::branch::{Branch, End, Event, Frame, Point, Tangent, amplitudes};
use super::error::ContinuationErrorKind;
use super::events::{EventKind, Signs, is_torus};
use super::halves::{Halves, are_confirmed};
use super::problem::Continued;
use super::progress::Progress;
use super::solved::{Solved, solved};
use super::warning::BranchWarning;
use crate::assembly::{Assembly, AssemblyError, Control, Iterate, Problem, crossed_kinks};
use crate::periodic::OrbitError;
use crate::periodic::orbit::trivial_of;
use crate::periodic::problem::Global;
use crate::stability::chebyshev::bracketed_root;
use std::ops::Range;
use tfe_runtime::basis::shape_functions;
use tfe_runtime::{Element, Model};

/// The step sizes, in arc length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    pub(super) first: f64,
    pub(super) smallest: f64,
    pub(super) largest: f64,
}

/// The range of the parameter and the steps of a continuation.
#[derive(Clone, Debug)]
pub(super) struct ParameterPath {
    pub(super) range: Range<f64>,
    pub(super) steps: Steps,
    pub(super) max_points: usize,
}

impl ParameterPath {
    /// The end of the range that a parameter exceeds, if any.
    fn left(&self, parameter: f64) -> Option<f64> {
        let (low, high) = (
            self.range.start.min(self.range.end),
            self.range.start.max(self.range.end),
        );
        if parameter < low {
            Some(low)
        } else if parameter > high {
            Some(high)
        } else {
            None
        }
    }
}

/// A successful step.
struct Step<M, const N: usize> {
    next: Solved<M, N>,
    /// The cosine of the angle between the tangents.
    turn: f64,
    /// Whether an end of the range was reached.
    ended: bool,
}

/// A located event.
struct Located<M, const N: usize> {
    /// Its position between the two orbits, from 0 to 1.
    part: f64,
    solved: Solved<M, N>,
    /// The uncertainty of the parameter.
    width: f64,
}

/// The state of a continuation.
pub(super) struct Follower<'c, M, const N: usize> {
    problem: Continued<'c, M, N>,
    assembly: Assembly<N>,
    control: Control,
    path: ParameterPath,
    metric: Metric<N>,
    frame: Frame<N>,
    last: Solved<M, N>,
    /// The signs of the test functions up to the last orbit.
    signs: Signs,
    halves: Halves<'c, M, N>,
}

impl<'c, M: Model<N> + Clone, const N: usize> Follower<'c, M, N> {
    /// Starts at the first orbit, with its iterate known up to the tolerance.
    pub(super) fn start(
        mut problem: Continued<'c, M, N>,
        mut iterate: Iterate<N>,
        (element, control): (Element, Control),
        path: ParameterPath,
    ) -> Result<Self, OrbitError> {
        let elements = problem.orbit.mesh.elements();
        let (globals, dense) = (iterate.globals.len() + 1, problem.orbit.dense() + 1);
        let mut assembly = Assembly::new::<M>(element, elements, globals, dense)
            .map_err(|error| OrbitError::Assembly(error.into()))?
            .with_tangent();
        let parameter = problem.parameter();
        iterate.globals.push(parameter);
        problem.row = Row::Parameter(parameter);
        assembly.solve(&mut problem, &mut iterate, control)?;
        problem.orbit.check()?;
        let derivative = assembly.tangent();
        let metric = Metric::new(&problem.orbit, problem.width, &iterate, &derivative);
        let mut tangent = metric.unit(derivative);
        if path.range.end < parameter {
            tangent.scale(-1.0);
        }
        let frame = Frame {
            element,
            mesh: problem.orbit.mesh.clone(),
            start: problem.orbit.start,
            advance: problem.orbit.advance,
            trivial: problem.orbit.trivial(),
            unfolded: problem.orbit.globals.contains(&Global::Unfolding),
        };
        let last = solved(&problem, &assembly, iterate, tangent, assembly.iterations())?;
        let mut signs = Signs::default();
        signs.pass(&last.tests);
        // If more iterations are needed, the step is too long.
        let control = Control {
            max_iterations: MAX_ITERATIONS,
            ..control
        };
        Ok(Self {
            signs,
            halves: Halves::new(&problem, element, control)?,
            problem,
            assembly,
            control,
            path,
            metric,
            frame,
            last,
        })
    }

    /// Follows the branch to its end.
    pub(super) fn run(
        mut self,
        branch: &mut Branch<M, N>,
        progress: Progress,
    ) -> Result<(), ContinuationErrorKind> {
        branch.frame = Some(self.frame.clone());
        self.record(branch);
        let followed = self.follow(branch, progress);
        branch.statistics = self.assembly.statistics();
        if !is_compared(branch.points.len() - 1) {
            self.compare_last(branch);
        }
        followed
    }

    /// Takes steps from the first orbit, which is recorded, until the branch ends.
    fn follow(
        &mut self,
        branch: &mut Branch<M, N>,
        mut progress: Progress,
    ) -> Result<(), ContinuationErrorKind> {
        // The first step is measured in the parameter.
        let slope = self.last.tests.value(EventKind::Fold).abs();
        let Steps {
            first,
            smallest,
            largest,
        } = self.path.steps;
        let mut step = (first / slope.max(1e-2)).clamp(smallest, largest);
        while branch.points.len() < self.path.max_points {
            let taken = match self.step(step) {
                Ok(taken) => taken,
                Err(_) if step > smallest => {
                    step = (0.5 * step).max(smallest);
                    continue;
                }
                Err(_) if self.comes_to_rest(&self.ahead(NEAR_REST * smallest)) => {
                    branch.end = Some(End::Rest);
                    break;
                }
                Err(source) => {
                    return Err(ContinuationErrorKind::Step {
                        parameter: self.last.parameter(),
                        step,
                        source,
                    });
                }
            };
            self.find_events(&taken.next, branch);
            let iterations = taken.next.iterations;
            self.accept(taken.next);
            self.record(branch);
            if is_compared(branch.points.len() - 1) {
                self.compare_last(branch);
            }
            progress.show(branch.points.len(), self.last.parameter());
            if taken.ended {
                branch.end = Some(End::Range);
                break;
            }
            step = adapted(step, iterations, taken.turn).clamp(smallest, largest);
        }
        branch.end = branch.end.or(Some(End::Points));
        Ok(())
    }

    /// Appends the last orbit to the branch.
    fn record(&self, branch: &mut Branch<M, N>) {
        self.find_kinks(branch);
        branch.points.push(self.point(&self.last));
        branch.members.push(self.last.member.clone());
    }

    /// Looks for kinks of forces in the elements of the last orbit, unless an orbit before it has a warning.
    fn find_kinks(&self, branch: &mut Branch<M, N>) {
        let is_kink =
            |warning: &BranchWarning| matches!(warning, BranchWarning::KinksCrossed { .. });
        if branch.warnings.iter().any(is_kink) {
            return;
        }
        let (frame, member) = (&self.frame, &self.last.member);
        let times = frame.mesh.times(frame.start, member.period);
        let nodes = times.zip(member.iterate.nodes.iter().copied());
        let crossed = crossed_kinks(&member.model, nodes);
        branch
            .warnings
            .extend(crossed.map(|time| BranchWarning::KinksCrossed {
                point: branch.points.len(),
                parameter: self.last.parameter(),
                time,
            }));
    }

    /// Compares the last orbit with that of elements of half the length, unless an orbit before it has a warning.
    fn compare_last(&mut self, branch: &mut Branch<M, N>) {
        let is_point =
            |warning: &BranchWarning| matches!(warning, BranchWarning::Unresolved { .. });
        if branch.warnings.iter().any(is_point) {
            return;
        }
        let point = branch.points.len() - 1;
        let before = point
            .checked_sub(1)
            .map_or(0.0, |before| branch.points[before].tangent.parameter);
        let compared = self.halves.compare(&self.frame, &self.metric, &self.last);
        if !compared.is_direction_left(before) {
            let warning = compared.warning(point, self.last.parameter());
            branch.warnings.push(warning);
        }
    }

    fn point(&self, solved: &Solved<M, N>) -> Point<N> {
        let orbit = self
            .frame
            .orbit(&solved.member, solved.floquet.clone(), solved.iterations);
        Point {
            parameter: solved.parameter(),
            period: orbit.period(),
            start: orbit.start(),
            amplitudes: amplitudes(&orbit, &self.frame.advance),
            multipliers: orbit.multipliers().to_vec(),
            floquet: solved.floquet.clone(),
            trivial: orbit.trivial(),
            verdict: orbit.verdict(),
            tangent: self.tangent(solved),
            iterations: solved.iterations,
        }
    }

    fn tangent(&self, solved: &Solved<M, N>) -> Tangent<N> {
        let along = &solved.tangent;
        let parameter = along.globals.last().copied().unwrap_or(f64::NAN);
        let unknown = self.problem.orbit.globals.first() == Some(&Global::Period);
        Tangent {
            parameter,
            period: if unknown {
                along.globals[0]
            } else {
                solved.rate * parameter
            },
            start: along.nodes[0],
        }
    }

    /// Continues from an orbit.
    fn accept(&mut self, next: Solved<M, N>) {
        self.last = next;
        self.signs.pass(&self.last.tests);
        self.metric.grow(&self.last.member.iterate);
        // The metric has changed, and with it the length of the tangent.
        self.last.tangent = self.metric.unit(self.last.tangent.clone());
    }

    /// The predictor: the point at an arc length from the last orbit along its tangent.
    fn ahead(&self, length: f64) -> Iterate<N> {
        let last = &self.last;
        last.member.iterate.plus(length, &last.tangent)
    }

    /// Whether a predicted orbit is at rest or beyond: the branch would then return over the same orbits, with the
    /// opposite phase. Orbits whose phase is fixed by time may pass through rest.
    fn comes_to_rest(&self, ahead: &Iterate<N>) -> bool {
        let last = &self.last.member.iterate;
        self.problem.orbit.phase.is_some() && self.metric.withers(last, ahead)
    }

    /// The orbit at an arc length from the last one, or at the end of the range before that. `Err(None)` if the branch
    /// turned too much, or came to rest.
    fn step(&mut self, length: f64) -> Result<Step<M, N>, Option<OrbitError>> {
        let last = &self.last;
        let guess = self.ahead(length);
        if self.comes_to_rest(&guess) {
            return Err(None);
        }
        let row = self.metric.row(&last.member.iterate, &last.tangent, length);
        let (next, turn) = self.correct(guess, row)?;
        if turn < MAX_TURN || self.comes_to_rest(&next.member.iterate) {
            return Err(None);
        }
        let between = self.between(&next);
        let Some((part, bound)) = between.exit(|parameter| self.path.left(parameter)) else {
            return Ok(Step {
                next,
                turn,
                ended: false,
            });
        };
        let (next, turn) = self.correct(between.guess(part), Row::Parameter(bound))?;
        if turn < MAX_TURN {
            return Err(None);
        }
        Ok(Step {
            next,
            turn,
            ended: true,
        })
    }

    /// The corrector: Newton's method from a guess. Returns the solution, and the cosine of the angle between its
    /// tangent and the last one.
    fn correct(
        &mut self,
        mut iterate: Iterate<N>,
        row: Row<N>,
    ) -> Result<(Solved<M, N>, f64), OrbitError> {
        self.problem.row = row;
        let before = self.assembly.iterations();
        self.assembly
            .solve(&mut self.problem, &mut iterate, self.control)?;
        self.problem.orbit.check()?;
        if let (Row::Parameter(value), Some(parameter)) =
            (&self.problem.row, iterate.globals.last_mut())
        {
            // Exactly, not only up to rounding error.
            *parameter = *value;
            self.problem.set_globals(&iterate.globals);
        }
        let mut tangent = self.metric.unit(self.assembly.tangent());
        let mut turn = self.metric.product(&tangent, &self.last.tangent);
        if turn < 0.0 {
            tangent.scale(-1.0);
            turn = -turn;
        }
        let iterations = self.assembly.iterations() - before;
        let solved = solved(&self.problem, &self.assembly, iterate, tangent, iterations)?;
        Ok((solved, turn))
    }

    /// Looks for events at the last orbit and between it and the next one, and records them.
    fn find_events(&mut self, next: &Solved<M, N>, branch: &mut Branch<M, N>) {
        let at_last = self.signs.changes_at(&self.last.tests, &next.tests);
        let at_last = at_last.map(|kind| (kind, true));
        let between = self.last.tests.changes(&next.tests);
        let kinds: Vec<(EventKind, bool)> =
            at_last.chain(between.map(|kind| (kind, false))).collect();
        let mut found: Vec<(EventKind, bool, Located<M, N>)> = Vec::new();
        for (kind, is_at_last) in kinds {
            let located = if is_at_last {
                self.at_last(next, kind)
            } else {
                self.locate(next, kind)
            };
            let floquet = &located.solved.floquet;
            let trivial = trivial_of(floquet, self.frame.trivial);
            if kind != EventKind::Torus || is_torus(floquet, &trivial) {
                found.push((kind, is_at_last, located));
            }
        }
        if found.is_empty() {
            return;
        }
        found.sort_by(|(.., a), (.., b)| a.part.total_cmp(&b.part));
        let ends = [&self.last, next];
        let ends = ends.map(|end| self.halves.compare(&self.frame, &self.metric, end));
        for (kind, is_at_last, at) in found {
            // A test function that vanishes at the last orbit has no sign there.
            let resolved = are_confirmed(kind, &ends[usize::from(is_at_last)..]);
            if !resolved {
                branch.warnings.push(BranchWarning::UnresolvedEvent {
                    event: branch.events.len(),
                    kind,
                    parameter: at.solved.parameter(),
                });
            }
            branch.events.push(Event {
                kind,
                point: self.point(&at.solved),
                after: branch.points.len() - 1,
                width: at.width,
                resolved,
            });
            branch.event_members.push(at.solved.member);
        }
    }

    /// The event exactly at the last orbit.
    fn at_last(&mut self, next: &Solved<M, N>, kind: EventKind) -> Located<M, N> {
        if kind == EventKind::Branch {
            let between = self.between(next);
            if let Ok(crossing) = self.crossing(&between, 0.0) {
                return crossing;
            }
        }
        let [here, there] = [&self.last, next].map(|end| end.tests.value(kind).abs());
        let distance = (next.parameter() - self.last.parameter()).abs();
        Located {
            part: 0.0,
            solved: self.last.clone(),
            width: distance * (here / there),
        }
    }

    /// Locates the event at which a test function vanishes, between the last orbit and the next.
    fn locate(&mut self, next: &Solved<M, N>, kind: EventKind) -> Located<M, N> {
        let between = self.between(next);
        let values = [&self.last, next].map(|end| end.tests.value(kind));
        // The closest orbits on both sides of the root.
        let mut low = (0.0, self.last.clone());
        let mut high = (1.0, next.clone());
        let near = if kind == EventKind::Branch {
            NEAR * values[0].abs().max(values[1].abs())
        } else {
            0.0
        };
        // If a trial fails, the best result so far is used.
        let root = bracketed_root(
            |part| {
                let solved = self.trial(&between, part)?;
                let value = solved.tests.value(kind);
                let side = if value * values[0] > 0.0 {
                    &mut low
                } else {
                    &mut high
                };
                *side = (part, solved);
                Ok::<f64, OrbitError>(if value.abs() < near { 0.0 } else { value })
            },
            (0.0, values[0]),
            (1.0, values[1]),
        );
        if let (EventKind::Branch, Ok(part)) = (kind, root)
            && let Ok(crossing) = self.crossing(&between, part)
        {
            return crossing;
        }
        let width = (low.1.parameter() - high.1.parameter()).abs();
        let value = |end: &(f64, Solved<M, N>)| end.1.tests.value(kind).abs();
        let (part, solved) = if value(&low) < value(&high) {
            low
        } else {
            high
        };
        Located {
            part,
            solved,
            width,
        }
    }

    /// The interpolant of the branch between the last orbit and the next.
    fn between(&self, next: &Solved<M, N>) -> Between<N> {
        let ends = [&self.last, next];
        Between::new(
            &self.metric,
            ends.map(|end| &end.member.iterate),
            ends.map(|end| &end.tangent),
        )
    }

    /// Solves an orbit between the last one and the next.
    fn trial(&mut self, between: &Between<N>, part: f64) -> Result<Solved<M, N>, OrbitError> {
        let row = between.row(&self.metric, part);
        Ok(self.correct(between.guess(part), row)?.0)
    }

    /// Locates the orbit at which another branch crosses, between the last orbit and the next.
    ///
    /// The equations are singular there: Newton's method would find the orbit only to the square root of the rounding
    /// error, and could change to the other branch. Since the branch is smooth, orbits at some distance on both sides
    /// are solved, and the polynomial through them is evaluated at the zero of the test function.
    fn crossing(&mut self, between: &Between<N>, part: f64) -> Result<Located<M, N>, OrbitError> {
        let places = STENCIL.map(|k| part + k * SPACING);
        let mut orbits = Vec::with_capacity(places.len());
        for place in places {
            orbits.push(self.trial(between, place)?);
        }
        let values: Vec<f64> = orbits
            .iter()
            .map(|orbit| orbit.tests.value(EventKind::Branch))
            .collect();
        // Once with all orbits, and once without the outermost two: the difference estimates the error.
        let root = |from: usize, to: usize| {
            let weights = lagrange(&values[from..to], 0.0);
            let terms = weights.iter().zip(&places[from..to]);
            let part: f64 = terms.map(|(weight, place)| weight * place).sum();
            let weights = lagrange(&places[from..to], part);
            let terms = weights.iter().zip(&orbits[from..to]);
            let parameter: f64 = terms
                .map(|(weight, orbit)| weight * orbit.parameter())
                .sum();
            (part, parameter)
        };
        let (part, parameter) = root(0, places.len());
        let width = (parameter - root(1, places.len() - 1).1).abs();
        let weights = lagrange(&places, part);
        let blend = |of: &dyn Fn(&Solved<M, N>) -> &Iterate<N>| {
            let mut sum = of(&orbits[0]).clone();
            sum.scale(weights[0]);
            let terms = weights.iter().zip(&orbits).skip(1);
            terms.fold(sum, |sum, (weight, orbit)| sum.plus(*weight, of(orbit)))
        };
        let iterate = blend(&|orbit| &orbit.member.iterate);
        let tangent = self.metric.unit(blend(&|orbit| &orbit.tangent));
        self.problem.set_globals(&iterate.globals);
        match self.assembly.linearise(&self.problem, &iterate) {
            // Linearised only for the transition matrices.
            Ok(()) | Err(AssemblyError::Singular { .. }) => {}
            Err(error) => return Err(error.into()),
        }
        let solved = solved(&self.problem, &self.assembly, iterate, tangent, 1)?;
        Ok(Located {
            part,
            solved,
            width,
        })
    }
}

/// The Lagrange weights for points at `places`, evaluated at x.
fn lagrange(places: &[f64], x: f64) -> Vec<f64> {
    let mut weights = vec![0.0; places.len()];
    shape_functions(places, x, &mut weights);
    weights
}

/// The positions of the solved orbits about a branch point, in units of [`SPACING`].
const STENCIL: [f64; 6] = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0];

/// The spacing of these orbits relative to the step: its sixth power is below 10⁻¹⁰, and the closest orbit is
/// sufficiently far from the singular one.
const SPACING: f64 = 0.02;

/// The value of the test function, relative to its larger end value, at which the root is close enough for
/// interpolation.
const NEAR: f64 = 1e-2;

/// Whether an orbit is compared with that of elements of half the length: number 8 and every sixteenth, which
/// takes a few hundredths of the time. The last orbit and those beside events are compared as well.
fn is_compared(point: usize) -> bool {
    point == 8 || point > 0 && point.is_multiple_of(16)
}

/// The length of the next step.
fn adapted(step: f64, iterations: u32, turn: f64) -> f64 {
    if iterations <= 4 && turn > EASY_TURN {
        1.5 * step
    } else if iterations >= 7 || turn < 0.5 * (MAX_TURN + EASY_TURN) {
        0.7 * step
    } else {
        step
    }
}

/// The largest number of Newton iterations; more indicate that the step was too long.
const MAX_ITERATIONS: u32 = 8;

/// If the smallest step fails, the branch has come to rest if rest lies within this number of smallest steps: the
/// equations lose digits close to it.
const NEAR_REST: f64 = 10.0;

/// The cosine of 25°, the largest angle between successive tangents.
const MAX_TURN: f64 = 0.906;

/// The cosine of 10°, the angle below which steps may grow.
const EASY_TURN: f64 = 0.985;
