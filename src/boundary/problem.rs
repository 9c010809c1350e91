//! Boundary-value problems: the problem, its equations and its solution.

use crate::assembly::{
    Assembly, AssemblyError, ClosureMut, Control, Curve, Iterate, Mesh, MeshError, MeshWarning,
    Problem, Solution, crossed_kinks,
};
use crate::motion::{Motion, Node};
use crate::numbers::Short;
use crate::periodic::along_motion;
use crate::simulation::Simulation;
use nalgebra::DMatrix;
use std::fmt;
use std::ops::Range;
use tfe_runtime::condenser::Direction;
use tfe_runtime::{Element, LegendreError, Mixed, Model, State, Statistics};

/// A component of the state at one end of the span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// The coordinate qᵢ with this index, from 0.
    Coordinate(usize),
    /// The momentum pᵢ with this index, from 0.
    Momentum(usize),
}

impl Component {
    /// The index in the order (p, q).
    pub(crate) fn place<const N: usize>(self) -> Option<usize> {
        match self {
            Self::Momentum(index) if index < N => Some(index),
            Self::Coordinate(index) if index < N => Some(N + index),
            _ => None,
        }
    }

    fn of<const N: usize>(self, state: &State<N>) -> f64 {
        match self {
            Self::Coordinate(index) => state.q[index],
            Self::Momentum(index) => state.p[index],
        }
    }
}

/// A prescribed component at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Condition {
    pub(crate) at_end: bool,
    pub(crate) component: Component,
    pub(crate) value: f64,
}

/// Checks that a span has a finite length, and one that can be divided.
pub(crate) fn check_span(span: &Range<f64>) -> Result<(), BoundaryError> {
    let Range { start, end } = *span;
    // Also the difference of two finite times may overflow; one below all normal numbers is lost when it is divided.
    if (end - start).is_normal() {
        return Ok(());
    }
    Err(BoundaryError::Span { start, end })
}

/// Checks that the conditions are valid and different.
pub(crate) fn check_conditions<const N: usize>(
    conditions: &[Condition],
) -> Result<(), BoundaryError> {
    for (at, condition) in conditions.iter().enumerate() {
        let Condition {
            component,
            value,
            at_end,
        } = *condition;
        if component.place::<N>().is_none() {
            return Err(BoundaryError::Component { component });
        }
        if !value.is_finite() {
            return Err(BoundaryError::Value { component, value });
        }
        let same = |other: &Condition| other.component == component && other.at_end == at_end;
        if conditions[..at].iter().any(same) {
            return Err(BoundaryError::Twice { component });
        }
    }
    Ok(())
}

/// Linear interpolation of the prescribed coordinates; constant if only one end is prescribed.
pub(crate) fn straight<const N: usize>(
    conditions: &[Condition],
    span: &Range<f64>,
) -> impl Fn(f64) -> ([f64; N], [f64; N]) + use<N> {
    let value = |index: usize, at_end: bool| {
        let found = conditions.iter().find(|condition| {
            condition.at_end == at_end && condition.component == Component::Coordinate(index)
        });
        found.map(|condition| condition.value)
    };
    let mut line = [(0.0, 0.0); N];
    let Range { start, end } = *span;
    for (index, entry) in line.iter_mut().enumerate() {
        let (first, last) = (value(index, false), value(index, true));
        let from = first.or(last).unwrap_or(0.0);
        *entry = (from, (last.unwrap_or(from) - from) / (end - start));
    }
    move |t| (line.map(|(q, v)| q + v * (t - start)), line.map(|(_, v)| v))
}

/// A two-point boundary-value problem: the motion of a model over a span with 2N values of coordinates and momenta
/// given at its ends, in any combination.
///
/// All elements of the span are assembled and solved together by Newton's method; the linear equations of an iteration
/// are
///
/// ```text
/// δy_{e+1} − A_e δy_e = r_e ,   e = 0 … E − 1 ;      B₀ y_0 + B_E y_E = b
/// ```
///
/// (`docs/theory.md`, (T-81) with other conditions at the ends), with A_e the transition matrix of element e and B₀,
/// B_E the rows of the conditions. With all conditions at the start, this is the initial-value problem solved for the
/// whole span at once: the same motion as step by step.
///
/// Defaults: element `Mixed::<4>` (order 6), 40 equal elements. The first guess is a straight line between the
/// coordinates given (or, if everything is given at the start, a motion by steps of second order). If several motions
/// meet the conditions, the guess decides which one is found.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - 9.81*y)]
/// struct Projectile {}
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let projectile = Projectile {};
/// let arc = BoundaryValue::of(&projectile)
///     .element(Mixed::<4>)
///     .elements(20)
///     .from_to([0.0, 0.0], [10.0, 0.0], 0.0..2.0)
///     .solve()?;
/// assert!((arc.start().p[0] - 5.0).abs() < 1e-12); // 10 m in 2 s
/// assert!((arc.start().p[1] - 9.81).abs() < 1e-12); // at the top after 1 s
/// assert!((arc.motion().at(1.0)?.q[1] - 9.81 / 2.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
pub struct BoundaryValue<'m, M, const N: usize> {
    pub(super) model: &'m M,
    pub(super) element: Element,
    elements: usize,
    weights: Vec<f64>,
    span: Range<f64>,
    pub(super) conditions: Vec<Condition>,
    guess: Option<Curve<'m, N>>,
    control: Control,
}

impl<'m, M: Model<N>, const N: usize> BoundaryValue<'m, M, N> {
    /// A problem for `model`, as yet without conditions.
    pub fn of(model: &'m M) -> Self {
        Self {
            model,
            element: Mixed::<4>.into(),
            elements: 40,
            weights: Vec::new(),
            span: f64::NAN..f64::NAN,
            conditions: Vec::new(),
            guess: None,
            control: Control::default(),
        }
    }

    /// Sets the element; `Mixed::<4>` by default.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = element.into();
        self
    }

    /// Sets the number of elements, all of the same length; 40 by default. Of this call and [`graded`](Self::graded)
    /// the last one counts.
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self.weights.clear();
        self
    }

    /// Sets one element for each weight, with lengths proportional to the weights: short elements where the motion is
    /// fast.
    #[must_use]
    pub fn graded(mut self, weights: impl IntoIterator<Item = f64>) -> Self {
        self.weights = weights.into_iter().collect();
        self.elements = self.weights.len();
        self
    }

    /// Sets the span of time.
    #[must_use]
    pub fn span(mut self, span: Range<f64>) -> Self {
        self.span = span;
        self
    }

    /// Sets all coordinates at both ends, and the span.
    #[must_use]
    pub fn from_to(mut self, start: [f64; N], end: [f64; N], span: Range<f64>) -> Self {
        for (a, (start, end)) in start.into_iter().zip(end).enumerate() {
            self = self
                .start(Component::Coordinate(a), start)
                .end(Component::Coordinate(a), end);
        }
        self.span(span)
    }

    /// Sets all components at the start, and the span: the initial-value problem, solved for the whole span at once.
    #[must_use]
    pub fn initial(mut self, state: State<N>, span: Range<f64>) -> Self {
        for a in 0..N {
            self = self
                .start(Component::Coordinate(a), state.q[a])
                .start(Component::Momentum(a), state.p[a]);
        }
        self.span(span)
    }

    /// Sets one component at the start.
    #[must_use]
    pub fn start(mut self, component: Component, value: f64) -> Self {
        self.conditions.push(Condition {
            at_end: false,
            component,
            value,
        });
        self
    }

    /// Sets one component at the end.
    #[must_use]
    pub fn end(mut self, component: Component, value: f64) -> Self {
        self.conditions.push(Condition {
            at_end: true,
            component,
            value,
        });
        self
    }

    /// Sets the first guess of Newton's method: a curve t ↦ (q, dq/dt). If the problem has several solutions, it
    /// decides which one is found.
    #[must_use]
    pub fn guess(mut self, curve: impl Fn(f64) -> ([f64; N], [f64; N]) + 'm) -> Self {
        self.guess = Some(Box::new(curve));
        self
    }

    /// Sets when the iteration is finished: when the last correction, relative to the solution, is at most this; 10⁻¹³
    /// by default. That correction is still applied.
    ///
    /// Coordinates are measured relative to the largest coordinate, momenta relative to the largest momentum.
    /// Components that are much smaller, such as an angle beside a distance, are corrected by up to six more
    /// iterations for as long as these improve them.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations of Newton's method, 50 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Solves the problem.
    ///
    /// Between conjugate points (for an oscillator, after half a period), the problem with all coordinates given at
    /// both ends has no solution or a whole family of them. The discretised equations still have a solution, which is
    /// determined by the discretisation error alone. Such a solution changes when the elements are halved, and is
    /// reported as [`AssemblyError::Singular`].
    ///
    /// # Errors
    /// For an invalid problem [`BoundaryError::Span`], [`Count`](BoundaryError::Count),
    /// [`Component`](BoundaryError::Component), [`Twice`](BoundaryError::Twice), [`Value`](BoundaryError::Value),
    /// [`Mesh`](BoundaryError::Mesh). [`BoundaryError::Assembly`] holds [`AssemblyError::Model`],
    /// [`Element`](AssemblyError::Element) or [`Tolerance`](AssemblyError::Tolerance) for a model, an element or a
    /// tolerance that is invalid, and
    /// [`Singular`](AssemblyError::Singular), [`Stalled`](AssemblyError::Stalled),
    /// [`Linearise`](AssemblyError::Linearise), [`Legendre`](AssemblyError::Legendre) or
    /// [`Violated`](AssemblyError::Violated) if no solution is found from the guess.
    pub fn solve(&self) -> Result<BoundaryMotion<'m, M, N>, BoundaryError> {
        self.check()?;
        let mut problem = self.problem()?;
        let mut assembly = Assembly::new::<M>(self.element, self.elements, 0, 0)
            .map_err(AssemblyError::Element)?;
        let curve = match (&self.guess, self.stepped()) {
            (Some(curve), _) => curve,
            (None, Some(motion)) => {
                &(Box::new(move |t| along_motion(self.model, &motion, t)) as Curve<'_, N>)
            }
            (None, None) => &(Box::new(straight(&self.conditions, &self.span)) as Curve<'_, N>),
        };
        let mut iterate = assembly
            .along(&problem, curve, Vec::new())
            .map_err(AssemblyError::Legendre)?;
        assembly
            .solve(&mut problem, &mut iterate, self.control)
            .map_err(|error| assembly.explained(error))?;
        let halves = Spanned {
            mesh: problem.mesh.halved(),
            ..self.problem()?
        };
        let solution = Solution {
            model: self.model,
            element: self.element,
            mesh: problem.mesh,
            start: self.span.start,
            length: self.span.end - self.span.start,
            end: self.span.end,
            damping: 0.0,
            transitions: assembly.transitions().to_vec(),
            statistics: assembly.statistics(),
            iterate,
        };
        // With all conditions at one end, the problem is regular for every span.
        let at_end = self.conditions.iter().filter(|one| one.at_end).count();
        let motion = solution.motion();
        let along = |t: f64| along_motion(self.model, &motion, t);
        let fine = (&halves, 2 * self.elements);
        let may_be_singular = (1..2 * N).contains(&at_end);
        let halved = Assembly::halved_correction(self.element, fine, (Vec::new(), 0), along)?;
        if may_be_singular && assembly.is_doubtful() {
            assembly.check_resolved(halved)?;
        }
        let mut warnings = halved.map_or(Vec::new(), |halved| halved.doubts(self.elements));
        let nodes = solution.times().into_iter();
        let crossed = crossed_kinks(
            self.model,
            nodes.zip(solution.iterate.nodes.iter().copied()),
        );
        warnings.extend(crossed.map(|time| MeshWarning::KinksCrossed { time }));
        Ok(BoundaryMotion { solution, warnings })
    }

    pub(super) fn problem(&self) -> Result<Spanned<'_, M, N>, BoundaryError> {
        Ok(Spanned {
            model: self.model,
            mesh: Mesh::new(self.elements, &self.weights)?,
            span: self.span.clone(),
            conditions: &self.conditions,
        })
    }

    fn check(&self) -> Result<(), BoundaryError> {
        self.model.check().map_err(AssemblyError::Model)?;
        self.control.check()?;
        check_span(&self.span)?;
        if self.conditions.len() != 2 * N {
            return Err(BoundaryError::Count {
                needed: 2 * N,
                given: self.conditions.len(),
            });
        }
        check_conditions::<N>(&self.conditions)
    }

    /// The first guess for a problem with all conditions at the start: a run of second-order steps on the same mesh.
    fn stepped(&self) -> Option<Motion<N>> {
        let mut start = State {
            q: [0.0; N],
            p: [0.0; N],
        };
        for condition in &self.conditions {
            let value = match condition.component {
                Component::Coordinate(index) => &mut start.q[index],
                Component::Momentum(index) => &mut start.p[index],
            };
            *value = condition.value;
        }
        let Range {
            start: from,
            end: to,
        } = self.span;
        let initial =
            self.guess.is_none() && self.conditions.iter().all(|condition| !condition.at_end);
        let simulation = Simulation::new(self.model)
            .element(Mixed::<2>)
            .step((to - from) / self.elements as f64);
        initial.then(|| simulation.run(start, from..to).ok())?
    }
}

/// The chain of elements over a span, with its conditions at the ends.
pub(super) struct Spanned<'a, M, const N: usize> {
    model: &'a M,
    mesh: Mesh,
    span: Range<f64>,
    conditions: &'a [Condition],
}

impl<M: Model<N>, const N: usize> Problem<N> for Spanned<'_, M, N> {
    type Model = M;

    fn model(&self) -> &M {
        self.model
    }

    fn place(&self, element: usize) -> (f64, f64) {
        let length = self.span.end - self.span.start;
        self.mesh.place(element, self.span.start, length)
    }

    fn directions(&self, _: usize, _: &mut [Direction]) {}

    fn set_globals(&mut self, _: &[f64]) {}

    fn close(
        &self,
        iterate: &Iterate<N>,
        mut closure: ClosureMut<'_>,
    ) -> Result<(), LegendreError> {
        closure.clear();
        let (Some(first), Some(last)) = (iterate.nodes.first(), iterate.nodes.last()) else {
            return Ok(());
        };
        for (row, condition) in self.conditions.iter().enumerate() {
            let Some(place) = condition.component.place::<N>() else {
                continue;
            };
            let (matrix, state) = if condition.at_end {
                (&mut closure.last, last)
            } else {
                (&mut closure.first, first)
            };
            matrix[row * 2 * N + place] = 1.0;
            closure.right[row] = condition.value - condition.component.of(state);
        }
        Ok(())
    }
}

/// A solution of a [`BoundaryValue`] problem.
#[derive(Clone, Debug)]
pub struct BoundaryMotion<'m, M, const N: usize> {
    pub(super) solution: Solution<'m, M, N>,
    warnings: Vec<MeshWarning>,
}

impl<M: Model<N>, const N: usize> BoundaryMotion<'_, M, N> {
    /// The state at the start of the span.
    pub fn start(&self) -> State<N> {
        self.solution.start()
    }

    /// The state at the end of the span.
    pub fn end(&self) -> State<N> {
        self.solution.end()
    }

    /// The nodes (ends of the elements), in order of time.
    pub fn nodes(&self) -> Vec<Node<N>> {
        self.solution.nodes()
    }

    /// The transition matrices of the elements, in order: 2N × 2N each, ordered (p, q).
    pub fn transitions(&self) -> Vec<DMatrix<f64>> {
        self.solution.matrices()
    }

    /// What makes the motion doubtful: whether elements of half the length change it, by one correction of Newton's
    /// method, and whether nodes next to each other lie on both sides of a kink or a jump of a force.
    pub fn warnings(&self) -> &[MeshWarning] {
        &self.warnings
    }

    /// Counts of iterations, evaluations and factorisations of the solution.
    pub fn statistics(&self) -> &Statistics {
        &self.solution.statistics
    }

    /// The solution as a motion with dense output.
    pub fn motion(&self) -> Motion<N> {
        self.solution.motion()
    }
}

/// Why a boundary-value problem was not solved.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BoundaryError {
    /// The span was not given, is empty, or is not finite; or its length overflows or is below all normal numbers.
    Span {
        /// The start of the span.
        start: f64,
        /// The end of the span.
        end: f64,
    },
    /// The number of conditions is not 2N.
    Count {
        /// The number of conditions needed, 2N.
        needed: usize,
        /// The number of conditions given.
        given: usize,
    },
    /// A component does not exist: its index is not below N.
    Component {
        /// The component.
        component: Component,
    },
    /// A component is given twice at the same end.
    Twice {
        /// The component.
        component: Component,
    },
    /// A given value is not finite.
    Value {
        /// The component for which it was given.
        component: Component,
        /// The value given.
        value: f64,
    },
    /// The mesh is invalid.
    Mesh(MeshError),
    /// The assembled equations could not be solved.
    Assembly(AssemblyError),
}

impl From<MeshError> for BoundaryError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

impl From<AssemblyError> for BoundaryError {
    fn from(error: AssemblyError) -> Self {
        Self::Assembly(error)
    }
}

impl fmt::Display for BoundaryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Span { start, end } => write!(
                f,
                "the span {}..{} is missing, empty or not finite: give it with `.span(t0..t1)` or with the values at both ends",
                Short(*start),
                Short(*end)
            ),
            Self::Count { needed, given } => {
                write!(
                    f,
                    "{given} conditions at the ends, {needed} are needed: two for each coordinate, with `.start(component, value)` and `.end(component, value)`"
                )
            }
            Self::Component { component } => write!(
                f,
                "{component:?} does not exist: its index, counted from 0, is not below the number of coordinates"
            ),
            Self::Twice { component } => {
                write!(f, "{component:?} is given twice at one end: give it once")
            }
            Self::Value { component, value } => write!(
                f,
                "{component:?} is given as {value}, but it must be finite",
                value = Short(*value)
            ),
            Self::Mesh(error) => error.fmt(f),
            Self::Assembly(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for BoundaryError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Mesh(error) => Some(error),
            Self::Assembly(error) => error.source(),
            _ => None,
        }
    }
}
