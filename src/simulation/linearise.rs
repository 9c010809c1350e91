//! Runs with the transition matrices of all elements.

mod family;

use super::events::Severed;
use super::follow::{Follow, Passed};
use super::sensitive::Tangents;
use super::setup::Simulation;
use crate::constraints::allowed;
use crate::error::{RunError, RunErrorKind};
use crate::linearised::Linearised;
use nalgebra::DMatrix;
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::Stepper;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, Share, State, StepError};

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the transition matrix of every element,
    ///
    /// ```text
    /// Φ = ∂(p, q)ₖ₊₁ / ∂(p, q)ₖ ,     2N × 2N, ordered (p, q)                                  (T-30)
    /// ```
    ///
    /// Use it for the linear stability of a motion and for the propagation of small changes of the start. There is an
    /// example at [`Linearised`]. A matrix costs a factorisation of the element's tangent and 2N solutions with it:
    /// the time of half a step for one coordinate, and of some twenty steps for twenty coordinates if the step itself
    /// does not use Newton's method. Impulses are constant and do not contribute to the derivative.
    ///
    /// At an [event](Self::on) that changes the state, the matrix of the element includes the change of the state and
    /// that of the time of the event (T-140). The functions given to `on` are called several times with nearby states,
    /// for differences of sixth order. If an event falls on a node, the elements before and after it share one matrix.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::Transition`] if an element has no transition matrix,
    /// [`RunErrorKind::SetByState`] if an event [sets](crate::Act::Set) a parameter to a value
    /// that depends on the state.
    pub fn run_linearised(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Linearised<N>, RunError<N>> {
        let run = self.cut_at_kinks();
        let mut matrices = Matrices {
            tangents: Tangents::new(run.model.clone(), run.chosen(), &[]),
            is_across: false,
            entries: vec![0.0; 4 * N * N],
            transitions: Vec::new(),
            bases: Vec::new(),
        };
        let mut motion = run.drive(start, &span, identity, Some(&mut matrices))?;
        run.warn_of_kinks(&mut motion);
        matrices.close();
        let Matrices {
            tangents,
            transitions,
            bases,
            ..
        } = matrices;
        let reduced = if const { M::CONSTRAINTS.is_empty() } {
            None
        } else if transitions.is_empty() {
            let start = motion.last();
            Some(allowed::identity(tangents.basis(start.t, &start.state())))
        } else {
            Some(on_constraints(bases, &transitions))
        };
        Ok(Linearised::with(motion, transitions, reduced))
    }
}

/// Collects the transition matrices along a run.
struct Matrices<'m, M, const N: usize> {
    /// The derivatives since the end of the last matrix.
    tangents: Tangents<'m, M, N>,
    /// Whether an event has occurred since then.
    is_across: bool,
    entries: Vec<f64>,
    transitions: Vec<DMatrix<f64>>,
    /// Bases of the motions that the constraints allow, at the start of each matrix; for models with constraints.
    bases: Vec<Result<DMatrix<f64>, StepError>>,
}

impl<M: Model<N>, const N: usize> Matrices<'_, M, N> {
    fn begin(&mut self, t: f64, state: &State<N>) {
        if const { !M::CONSTRAINTS.is_empty() } && !self.is_across {
            self.bases.push(self.tangents.basis(t, state));
        }
    }

    /// Ends a matrix that spans events.
    fn close(&mut self) {
        if self.is_across {
            self.transitions.push(self.tangents.restart());
            self.is_across = false;
        }
    }
}

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Matrices<'m, M, N> {
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        self.begin(passed.t, passed.before);
        if self.is_across {
            self.tangents.passed(stepper, passed)?;
            self.close();
            return Ok(());
        }
        stepper.transition(&mut self.entries)?;
        let matrix = DMatrix::from_row_slice(2 * N, 2 * N, &self.entries);
        self.transitions.push(matrix);
        Ok(())
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        self.begin(severed.start, severed.before);
        self.is_across = true;
        self.tangents.cut(severed)
    }

    fn acted(&mut self) {
        self.tangents.acted();
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        self.tangents.set(model)
    }
}

/// The transition matrices, restricted to motions that the constraints allow, given the bases of these at their starts.
fn on_constraints(
    bases: Vec<Result<DMatrix<f64>, StepError>>,
    transitions: &[DMatrix<f64>],
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let bases = bases.into_iter().collect::<Result<Vec<_>, _>>()?;
    allowed::reduced(&bases, transitions.iter())
}
