//! The models that are measured, of fixed size and of run-time length, behind one interface.
//!
//! The interface is resolved at compile time, so that the timed steps are the same as in a simulation of the model.

use crate::error::{RunError, RunErrorKind};
use crate::numbers::raise;
use crate::simulation::Simulation;
use std::ops::Range;
use tfe_runtime::ConstraintError;
use tfe_runtime::constrained;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::legendre;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Form, Model, State, Statistics, StepError};

/// A state that can be read as numbers: [`State`] for models of fixed size, [`FamilyState`] for those of run-time
/// length.
pub trait PhasePoint: Clone {
    /// The coordinates q.
    fn q(&self) -> &[f64];
    /// The momenta p, as many as coordinates.
    fn p(&self) -> &[f64];
}

impl<const N: usize> PhasePoint for State<N> {
    fn q(&self) -> &[f64] {
        &self.q
    }

    fn p(&self) -> &[f64] {
        &self.p
    }
}

impl PhasePoint for FamilyState {
    fn q(&self) -> &[f64] {
        &self.q
    }

    fn p(&self) -> &[f64] {
        &self.p
    }
}

/// A model with states of type `S` that [`WorkPrecision`](super::WorkPrecision) can measure: every [`Model`] with
/// [`State`], every [`family::Model`] with [`FamilyState`], and nothing else.
///
/// Use it as a bound in functions that take models of either kind:
///
/// ```
/// use tfe::prelude::*;
/// use tfe::work_precision::{PhasePoint, Subject, WorkPrecisionError};
///
/// fn order<M: Subject<S>, S: PhasePoint>(problem: WorkPrecision<'_, M, S>) -> Result<f64, WorkPrecisionError> {
///     let measured = problem.element(Mixed::<3>).steps([0.2, 0.1, 0.05]).run()?;
///     Ok(measured.curves()[0].slope().map_or(f64::NAN, |slope| slope.exponent))
/// }
///
/// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4)]
/// struct Single;
///
/// #[dynamics(coordinates(x[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2 - x[i]^4/4))]
/// struct Many { n: usize }
///
/// # fn main() -> Result<(), WorkPrecisionError> {
/// let many = Many { n: 3 };
/// let one = order(WorkPrecision::new(&Single, Single.state([1.0], [0.0]), 0.0..4.0))?;
/// let three = order(WorkPrecision::new(&many, many.state([1.0; 3], [0.0; 3]), 0.0..4.0))?;
/// assert!((one - 4.0).abs() < 0.2 && (one - three).abs() < 1e-3);
/// # Ok(())
/// # }
/// ```
pub trait Subject<S: PhasePoint>: Steppable<S> {}

impl<M: Steppable<S>, S: PhasePoint> Subject<S> for M {}

/// How a model is stepped and evaluated; internal.
pub trait Steppable<S> {
    /// The type that makes the steps.
    type Stepper<'m>
    where
        Self: 'm;

    /// The velocities found last, as first guesses.
    type Velocity: AsRef<[f64]>;

    /// Whether the model has constraints.
    const CONSTRAINED: bool;

    /// Creates a stepper without first guesses.
    fn stepper(
        &self,
        element: Element,
        control: Control,
    ) -> Result<Self::Stepper<'_>, RunErrorKind>;

    /// Advances the state from t to t + h.
    fn advance(
        stepper: &mut Self::Stepper<'_>,
        t: f64,
        h: f64,
        state: &mut S,
    ) -> Result<(), StepError>;

    /// The work of the steps so far.
    fn statistics(stepper: &Self::Stepper<'_>) -> Statistics;

    /// Velocities of zero.
    fn rest(&self) -> Self::Velocity;

    /// The energy; NaN if no velocity belongs to the momentum. Keeps the velocity as the next guess; zeros if there is
    /// none.
    fn energy(
        &self,
        stepper: &mut Self::Stepper<'_>,
        t: f64,
        state: &S,
        velocity: &mut Self::Velocity,
    ) -> f64;

    /// The largest |φ| and |A v + a|.
    fn residuals(&self, t: f64, state: &S, velocity: &Self::Velocity) -> (f64, f64);

    /// The names of the outputs, in order.
    fn output_names(&self) -> Result<Vec<String>, RunErrorKind>;

    /// The outputs at a state, in that order; NaN if they need a velocity and none belongs to the momentum.
    fn outputs(&self, stepper: &mut Self::Stepper<'_>, t: f64, state: &S) -> Vec<f64>;

    /// Refuses a start at which no simulation can begin with a step over `over`.
    fn check_start(&self, start: &S, over: Range<f64>, h: f64) -> Result<(), RunErrorKind>;
}

impl<M: Model<N>, const N: usize> Steppable<State<N>> for M {
    type Stepper<'m>
        = Stepper<'m, M, N>
    where
        M: 'm;

    type Velocity = [f64; N];

    const CONSTRAINED: bool = !M::CONSTRAINTS.is_empty();

    fn stepper(
        &self,
        element: Element,
        control: Control,
    ) -> Result<Stepper<'_, M, N>, RunErrorKind> {
        let stepper = Stepper::new(self, element, control);
        // The inside of elements is not needed, so that linear models may step by a matrix.
        stepper
            .map(Stepper::ends_only)
            .map_err(RunErrorKind::of_stepper)
    }

    #[inline]
    fn advance(
        stepper: &mut Stepper<'_, M, N>,
        t: f64,
        h: f64,
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state, &[])
    }

    fn statistics(stepper: &Stepper<'_, M, N>) -> Statistics {
        *stepper.statistics()
    }

    fn rest(&self) -> [f64; N] {
        [0.0; N]
    }

    fn energy(
        &self,
        _: &mut Stepper<'_, M, N>,
        t: f64,
        state: &State<N>,
        velocity: &mut [f64; N],
    ) -> f64 {
        match constrained::velocity_of(self, t, &state.q, &state.p, velocity) {
            Ok(found) => {
                *velocity = found;
                legendre::energy_at(self, t, &state.q, &state.p, velocity)
            }
            Err(_) => {
                *velocity = [0.0; N];
                f64::NAN
            }
        }
    }

    fn residuals(&self, t: f64, state: &State<N>, velocity: &[f64; N]) -> (f64, f64) {
        let (mut position, mut rate) = (0.0, 0.0);
        for one in constrained::residuals(self, t, &state.q, velocity, 1.0) {
            raise(&mut position, one.position.abs());
            raise(&mut rate, one.velocity.abs());
        }
        (position, rate)
    }

    fn output_names(&self) -> Result<Vec<String>, RunErrorKind> {
        self.check().map_err(RunErrorKind::Family)?;
        let columns = 0..self.columns();
        Ok(columns.map(|at| self.column_name(at).to_string()).collect())
    }

    fn outputs(&self, _: &mut Stepper<'_, M, N>, t: f64, state: &State<N>) -> Vec<f64> {
        let mut values = vec![0.0; self.columns()];
        let z = match M::FORM {
            Form::Lagrangian => {
                let rest = [0.0; N];
                let velocity = constrained::velocity_of(self, t, &state.q, &state.p, &rest);
                velocity.unwrap_or([f64::NAN; N])
            }
            Form::Hamiltonian => state.p,
        };
        self.observables(t, &state.q, &z, &mut values);
        values
    }

    fn check_start(&self, start: &State<N>, over: Range<f64>, h: f64) -> Result<(), RunErrorKind> {
        let run = Simulation::new(self).step(h).run(*start, over);
        match run.as_ref().map_err(RunError::kind) {
            Err(
                kind @ (RunErrorKind::Family(_)
                | RunErrorKind::Start { .. }
                | RunErrorKind::Inconsistent { .. }),
            ) => Err(kind.clone()),
            // Only the checks before the step matter.
            _ => Ok(()),
        }
    }
}

impl<M: family::Model> Steppable<FamilyState> for M {
    type Stepper<'m>
        = family::Stepper<'m, M>
    where
        M: 'm;

    type Velocity = Vec<f64>;

    const CONSTRAINED: bool = <M as family::Model>::CONSTRAINED;

    fn stepper(
        &self,
        element: Element,
        control: Control,
    ) -> Result<family::Stepper<'_, M>, RunErrorKind> {
        family::Stepper::new(self, element, control).map_err(RunErrorKind::Family)
    }

    #[inline]
    fn advance(
        stepper: &mut family::Stepper<'_, M>,
        t: f64,
        h: f64,
        state: &mut FamilyState,
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state)
    }

    fn statistics(stepper: &family::Stepper<'_, M>) -> Statistics {
        *stepper.statistics()
    }

    fn rest(&self) -> Vec<f64> {
        vec![0.0; self.len()]
    }

    fn energy(
        &self,
        stepper: &mut family::Stepper<'_, M>,
        t: f64,
        state: &FamilyState,
        velocity: &mut Vec<f64>,
    ) -> f64 {
        // The stepper keeps the ordering of the mass matrix between evaluations.
        match stepper.velocity(t, state) {
            Ok(found) => {
                *velocity = found;
                family::energy(self, t, state, velocity)
            }
            Err(_) => {
                velocity.fill(0.0);
                f64::NAN
            }
        }
    }

    fn residuals(&self, t: f64, state: &FamilyState, velocity: &Vec<f64>) -> (f64, f64) {
        family::constraint_residual(self, t, &state.q, velocity)
    }

    fn output_names(&self) -> Result<Vec<String>, RunErrorKind> {
        // The number of sites may exceed the length of a list.
        self.check().map_err(RunErrorKind::Family)?;
        let columns = 0..self.columns();
        Ok(columns.map(|at| self.column_name(at).to_string()).collect())
    }

    fn outputs(
        &self,
        stepper: &mut family::Stepper<'_, M>,
        t: f64,
        state: &FamilyState,
    ) -> Vec<f64> {
        let mut values = vec![0.0; self.columns()];
        match <M as family::Model>::FORM {
            Form::Lagrangian => {
                let velocity = stepper.velocity(t, state);
                let velocity = velocity.unwrap_or_else(|_| vec![f64::NAN; self.len()]);
                self.observables(t, &state.q, &velocity, &mut values);
            }
            Form::Hamiltonian => self.observables(t, &state.q, &state.p, &mut values),
        }
        values
    }

    fn check_start(
        &self,
        start: &FamilyState,
        over: Range<f64>,
        h: f64,
    ) -> Result<(), RunErrorKind> {
        let run = Simulation::new(self).step(h).run(start.clone(), over);
        match run {
            Err(error) if refuses(error.kind()) => Err(error.kind().clone()),
            // As above.
            _ => Ok(()),
        }
    }
}

/// Whether a run of a family failed because of its model or its start.
fn refuses(kind: &RunErrorKind) -> bool {
    matches!(
        kind,
        RunErrorKind::Start { .. }
            | RunErrorKind::Family(_)
            | RunErrorKind::Solve {
                // Found by the first step; models of fixed size report `Inconsistent` before it.
                source: StepError::Constraint(ConstraintError::Start { .. }),
                element: 0,
                ..
            }
    )
}
