//! A branch of periodic orbits: the result of continuation.

use super::events::EventKind;
use super::warning::BranchWarning;
use crate::assembly::{Iterate, Mesh, Solution};
use crate::csv::{self, Column};
use crate::periodic::{Orbit, Verdict};
use crate::periodic_schur::Multiplier;
use nalgebra::Complex;
use std::fmt;
use std::io;
use std::path::Path;
use tfe_runtime::{Element, Model, State, Statistics};

/// One periodic orbit of a branch: its parameter, period, amplitudes and Floquet multipliers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Point<const N: usize> {
    /// The parameter λ.
    pub parameter: f64,
    /// The period T.
    pub period: f64,
    /// The state at the start of the period.
    pub start: State<N>,
    /// The amplitude of each coordinate: half the difference of its largest and its smallest value over the period,
    /// without its growth over the whole period.
    ///
    /// It is found from the nodes, three points inside each element, and a parabola through the largest three values;
    /// this gives six digits with a few dozen elements.
    pub amplitudes: [f64; N],
    /// The Floquet multipliers, in order of decreasing modulus.
    pub multipliers: Vec<Complex<f64>>,
    /// The Floquet multipliers as logarithms of the modulus and arguments, which neither overflow nor underflow.
    pub floquet: Vec<Multiplier>,
    /// The indices of the trivial multipliers, which are always one; see [`Orbit::trivial`].
    pub trivial: Vec<usize>,
    /// The stability of the orbit, from the other multipliers.
    pub verdict: Verdict,
    /// The direction of the branch at this orbit.
    pub tangent: Tangent<N>,
    /// The number of iterations of Newton's method for this orbit.
    pub iterations: u32,
}

/// The derivatives of an orbit along its branch, with respect to the arc length s.
///
/// Away from folds, the derivatives with respect to the parameter are the other derivatives divided by dλ/ds. For an
/// autonomous model, the derivative of the start depends on the phase condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent<const N: usize> {
    /// dλ/ds.
    pub parameter: f64,
    /// dT/ds.
    pub period: f64,
    /// d(q, p)/ds at the start of the period.
    pub start: State<N>,
}

impl<const N: usize> Point<N> {
    /// Whether the orbit is not unstable, so that neighbouring motions stay near.
    pub fn is_stable(&self) -> bool {
        !matches!(self.verdict, Verdict::Unstable { .. })
    }
}

/// A bifurcation: a place where the branch turns, or where other orbits begin.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Event<const N: usize> {
    /// The kind of the bifurcation.
    pub kind: EventKind,
    /// The orbit at the bifurcation.
    pub point: Point<N>,
    /// The index of the point in [`Branch::points`] at which, or between which and the next point, the event lies.
    pub after: usize,
    /// How accurately the parameter of the event is known: the length of the last interval in which the test function
    /// changed its sign. Where another branch crosses, the orbit is interpolated, and this is the difference of two
    /// interpolations.
    pub width: f64,
    /// Whether elements of half the length confirm the event: there as well the test function changes its sign between
    /// the points beside it, with values of nearly the same size. If not, the event may be one of the elements and not
    /// of the model, as a fold of a branch that approaches a homoclinic orbit; see [`Branch::warnings`].
    pub resolved: bool,
}

/// How a branch ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At an end of the range; the last point is exactly there.
    Range,
    /// After the largest number of points.
    Points,
    /// At a Hopf bifurcation, where the orbits of an autonomous model shrink to an equilibrium. The parameter of the
    /// last point is that of the equilibrium, with an error of the order of the square of the [smallest
    /// step](super::Continuation::smallest_step) relative to the range.
    Rest,
}

/// The data from which an orbit of the branch is reconstructed.
#[derive(Clone)]
pub(super) struct Member<M, const N: usize> {
    pub(super) model: M,
    pub(super) iterate: Iterate<N>,
    pub(super) transitions: Vec<f64>,
    pub(super) period: f64,
    pub(super) unfolding: f64,
}

/// The data common to all orbits of a branch.
#[derive(Clone, Debug)]
pub(super) struct Frame<const N: usize> {
    pub(super) element: Element,
    pub(super) mesh: Mesh,
    pub(super) start: f64,
    pub(super) advance: [f64; N],
    /// The number of trivial multipliers.
    pub(super) trivial: usize,
    /// Whether there is an unfolding force (an additional unknown of conservative models).
    pub(super) unfolded: bool,
}

impl<const N: usize> Frame<N> {
    /// Reconstructs an orbit.
    pub(super) fn orbit<'b, M: Model<N>>(
        &self,
        member: &'b Member<M, N>,
        floquet: Vec<Multiplier>,
        iterations: u32,
    ) -> Orbit<'b, M, N> {
        let solution = Solution {
            model: &member.model,
            element: self.element,
            mesh: self.mesh.clone(),
            start: self.start,
            length: member.period,
            end: self.start + member.period,
            damping: member.unfolding,
            iterate: member.iterate.clone(),
            transitions: member.transitions.clone(),
            statistics: Statistics {
                iterations: iterations.into(),
                newton_iterations: iterations.into(),
                ..Statistics::NONE
            },
        };
        let unfolding = self.unfolded.then_some(member.unfolding);
        Orbit::of_solution(solution, floquet, self.trivial, unfolding)
    }
}

/// A branch of periodic orbits in one parameter, made by [`Continuation`](super::Continuation).
///
/// It holds a clone of the model for each of its points.
#[derive(Clone)]
pub struct Branch<M, const N: usize> {
    pub(super) parameter: &'static str,
    pub(super) frame: Option<Frame<N>>,
    pub(super) points: Vec<Point<N>>,
    pub(super) events: Vec<Event<N>>,
    pub(super) members: Vec<Member<M, N>>,
    pub(super) event_members: Vec<Member<M, N>>,
    pub(super) end: Option<End>,
    pub(super) warnings: Vec<BranchWarning>,
    pub(super) statistics: Statistics,
}

impl<M: Model<N>, const N: usize> Branch<M, N> {
    /// A branch without points.
    pub(super) fn new(parameter: &'static str) -> Self {
        Self {
            parameter,
            frame: None,
            points: Vec::new(),
            events: Vec::new(),
            members: Vec::new(),
            event_members: Vec::new(),
            end: None,
            warnings: Vec::new(),
            statistics: Statistics::NONE,
        }
    }

    /// The orbits, in order along the branch; the first is that of the model as given.
    pub fn points(&self) -> &[Point<N>] {
        &self.points
    }

    /// The bifurcations (folds, period doublings, tori, branch points), in order along the branch.
    pub fn events(&self) -> &[Event<N>] {
        &self.events
    }

    /// The events of one kind.
    pub fn events_of(&self, kind: EventKind) -> impl Iterator<Item = &Event<N>> {
        self.events.iter().filter(move |event| event.kind == kind)
    }

    /// How the branch ended; `None` if an error ended it.
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// What makes the branch doubtful, in the order in which it was found; empty if elements of half the length confirm
    /// all events and the points that were compared, see [`Continuation`](super::Continuation#resolution), and no nodes
    /// next to each other lie on both sides of a kink or a jump of a force.
    pub fn warnings(&self) -> &[BranchWarning] {
        &self.warnings
    }

    /// The name of the parameter.
    pub fn parameter(&self) -> &'static str {
        self.parameter
    }

    /// The orbit at a point, with its motion and its transition matrices; `None` if there is no such point.
    pub fn orbit(&self, point: usize) -> Option<Orbit<'_, M, N>> {
        let (frame, point, member) = (
            self.frame.as_ref()?,
            self.points.get(point)?,
            self.members.get(point)?,
        );
        Some(frame.orbit(member, point.floquet.clone(), point.iterations))
    }

    /// The orbit at an event; `None` if there is no such event.
    pub fn event_orbit(&self, event: usize) -> Option<Orbit<'_, M, N>> {
        let (frame, event, member) = (
            self.frame.as_ref()?,
            self.events.get(event)?,
            self.event_members.get(event)?,
        );
        let point = &event.point;
        Some(frame.orbit(member, point.floquet.clone(), point.iterations))
    }

    /// The model with the parameter of a point; `None` if there is no such point.
    pub fn model(&self, point: usize) -> Option<&M> {
        self.members.get(point).map(|member| &member.model)
    }

    /// The model with the parameter of an event, such as to examine the orbit there or to start another branch at it;
    /// `None` if there is no such event.
    pub fn event_model(&self, event: usize) -> Option<&M> {
        self.event_members.get(event).map(|member| &member.model)
    }

    /// Counts of iterations, evaluations and factorisations of the whole branch, including its events, without the
    /// comparisons with elements of half the length.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Writes the points as CSV with a header line: parameter, period, amplitudes, multipliers (real and imaginary
    /// parts), and 1 if the orbit is stable, else 0. Numbers read back exactly. If the parameter is called `period`,
    /// it keeps its name and the period is the column `period_`.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let mut names = vec!["period".to_owned()];
        names.extend((0..N).map(|a| format!("amplitude_{}", M::coordinate_name(a))));
        // With constraints there are fewer multipliers.
        let multipliers = self.points.first().map(|point| point.multipliers.len());
        for k in 1..=multipliers.unwrap_or(2 * N) {
            names.extend([format!("multiplier{k}_re"), format!("multiplier{k}_im")]);
        }
        names.push("stable".to_owned());
        let mut header = vec![Column::Model(self.parameter.to_owned())];
        header.extend(names.into_iter().map(Column::Table));
        let rows = self.points.iter().map(|point| {
            let mut row = vec![point.parameter, point.period];
            row.extend(point.amplitudes);
            row.extend(point.multipliers.iter().flat_map(|one| [one.re, one.im]));
            row.push(if point.is_stable() { 1.0 } else { 0.0 });
            row
        });
        csv::write(path.as_ref(), &header, rows)
    }
}

impl<M, const N: usize> fmt::Debug for Branch<M, N> {
    /// The extent of the branch, without its thousands of numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parameter = |point: &Point<N>| point.parameter;
        let events = self.events.iter();
        let events: Vec<_> = events
            .map(|event| (event.kind, event.point.parameter))
            .collect();
        f.debug_struct("Branch")
            .field("parameter", &self.parameter)
            .field("first", &self.points.first().map(parameter))
            .field("last", &self.points.last().map(parameter))
            .field("points", &self.points.len())
            .field("events", &events)
            .field("end", &self.end)
            .field("warnings", &self.warnings)
            .finish_non_exhaustive()
    }
}

/// Half the range of each coordinate over the period of an orbit, without its steady growth.
pub(super) fn amplitudes<M: Model<N>, const N: usize>(
    orbit: &Orbit<'_, M, N>,
    advance: &[f64; N],
) -> [f64; N] {
    let motion = orbit.motion();
    let (start, period) = (orbit.solution.start, orbit.period());
    let mut samples: Vec<(f64, [f64; N])> = Vec::new();
    for pair in motion.states().windows(2) {
        for part in 0..SAMPLES {
            let t = pair[0].t + (pair[1].t - pair[0].t) * f64::from(part) / f64::from(SAMPLES);
            let mut q = motion.at(t).unwrap_or(pair[0]).q;
            for a in 0..N {
                q[a] -= advance[a] * (t - start) / period;
            }
            samples.push((t, q));
        }
    }
    std::array::from_fn(|a| {
        let values: Vec<(f64, f64)> = samples.iter().map(|(t, q)| (*t, q[a])).collect();
        let negated: Vec<(f64, f64)> = values.iter().map(|(t, q)| (*t, -q)).collect();
        0.5 * (largest(&values, period) + largest(&negated, period))
    })
}

/// The number of samples in an element, including its first node.
const SAMPLES: u32 = 4;

/// The maximum of a periodic function given at ascending points, by the parabola through the largest value and its
/// neighbours.
fn largest(values: &[(f64, f64)], period: f64) -> f64 {
    let by_value = |a: &usize, b: &usize| values[*a].1.total_cmp(&values[*b].1);
    let Some(top) = (0..values.len()).max_by(by_value) else {
        return f64::NAN;
    };
    let (t, value) = values[top];
    let (before, after) = (
        (top + values.len() - 1) % values.len(),
        (top + 1) % values.len(),
    );
    let distance = |from: f64, to: f64| (to - from).rem_euclid(period);
    let (left, right) = (distance(values[before].0, t), distance(t, values[after].0));
    let (rise, fall) = (value - values[before].1, values[after].1 - value);
    let curvature = (fall / right - rise / left) / (left + right);
    let slope = rise / left + curvature * left;
    if curvature < 0.0 {
        value - slope / (4.0 * curvature) * slope
    } else {
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_parabola_is_exact_also_across_the_period() {
        // 1 − (t − 0.05)² near t = 0, with period 1 and unequal spacing.
        let value = |t: f64| 1.0 - (t - 0.05) * (t - 0.05);
        let values = [
            (0.0, value(0.0)),
            (0.2, value(0.2)),
            (0.5, 0.3),
            (0.9, value(-0.1)),
        ];
        assert!((largest(&values, 1.0) - 1.0).abs() < 1e-15);
        assert_eq!(largest(&[(0.0, 2.0), (0.5, 2.0)], 1.0), 2.0);
        // In units in which squares overflow or underflow.
        for (size, time) in [(1e100, 1e-100), (1e-100, 1e100)] {
            let values = values.map(|(t, value)| (t * time, value * size));
            assert!((largest(&values, time) / size - 1.0).abs() < 1e-14);
        }
    }
}
