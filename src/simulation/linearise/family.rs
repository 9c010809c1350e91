//! Runs with the transition matrices of all elements, for models of run-time length.

use super::super::setup::Simulation;
use super::super::trail::Trail;
use crate::error::RunError;
use crate::length::RunTimeLength;
use crate::linearised::Linearised;
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
#[cfg(feature = "sparse")]
use {
    super::super::retrace::Retrace,
    super::super::sensitive::family::Carrying,
    super::super::trail::{Between, Element, Kicked},
    crate::constraints::allowed::{self, basis_of},
    crate::error::RunErrorKind,
    nalgebra::DMatrix,
    tfe_runtime::StepError,
    tfe_runtime::family::{OperatorError, TransitionOperator},
};

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the transition matrix Φ = ∂(p, q)ₖ₊₁/∂(p, q)ₖ of every
    /// element: 2n × 2n, ordered (p, q).
    ///
    /// Every element is solved once more for its matrix, with 2n solutions by sparse factors. The matrices are dense:
    /// 4n² numbers for each element.
    ///
    /// At an [event](Self::on) that changes the state, the matrix of the element includes the change of the state and
    /// that of the time of the event (T-140), as for models of fixed size.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run); [`RunErrorKind::Transition`](crate::RunErrorKind::Transition) if an
    /// event has no derivative; [`RunErrorKind::SetByState`](crate::RunErrorKind::SetByState) if an event
    /// [sets](crate::Act::Set) a parameter to a value that depends on the state.
    /// [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported) without the feature `sparse`, and if steps were
    /// so long that they had to be cut.
    #[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
    pub fn run_linearised(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Linearised<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let trail = Trail::new();
        let (motion, trail) = self.trailed("run_linearised", start, &span, trail)?;
        #[cfg(feature = "sparse")]
        return self.linearised(motion, &trail);
        // Such a model was refused above.
        #[cfg(not(feature = "sparse"))]
        {
            drop(trail);
            Ok(Linearised::with(motion, Vec::new(), None))
        }
    }

    #[cfg(feature = "sparse")]
    fn linearised(
        &self,
        motion: crate::Motion<0, RunTimeLength>,
        trail: &Trail<'m, M>,
    ) -> Result<Linearised<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let mut matrices = Matrices {
            carrying: Carrying::new(self.model.len(), &[]),
            is_across: false,
            transitions: Vec::with_capacity(trail.elements.len()),
            bases: Vec::new(),
        };
        if let Err(kind) = self.retrace("run_linearised", trail, &[], &mut matrices) {
            return Err(RunError::new(kind, motion));
        }
        matrices.close();
        let Matrices {
            transitions, bases, ..
        } = matrices;
        let reduced = M::CONSTRAINED.then(|| {
            if transitions.is_empty() {
                let start = motion.last();
                let basis = basis_of(&*self.model, start.t, &start.state());
                return allowed::identity(basis);
            }
            let bases = bases.into_iter().collect::<Result<Vec<_>, _>>()?;
            allowed::reduced(&bases, transitions.iter())
        });
        Ok(Linearised::with(motion, transitions, reduced))
    }
}

/// Collects the transition matrices of the elements.
#[cfg(feature = "sparse")]
struct Matrices {
    /// The derivatives since the end of the last matrix.
    carrying: Carrying,
    /// Whether an event or impulses that constraints react to have occurred since then.
    is_across: bool,
    transitions: Vec<DMatrix<f64>>,
    /// Bases of the motions that the constraints allow, at the start of each matrix; for models with constraints.
    bases: Vec<Result<DMatrix<f64>, StepError>>,
}

#[cfg(feature = "sparse")]
impl Matrices {
    fn begin<M: family::Model>(&mut self, model: &M, t: f64, state: &FamilyState) {
        if M::CONSTRAINED && !self.is_across {
            self.bases.push(basis_of(model, t, state));
        }
    }

    /// Ends a matrix that spans events.
    fn close(&mut self) {
        if self.is_across {
            self.transitions.push(self.carrying.carried.restart());
            self.is_across = false;
        }
    }
}

#[cfg(feature = "sparse")]
impl<'m, M: family::Model> Retrace<'m, M> for Matrices {
    fn element(
        &mut self,
        model: &M,
        element: &Element,
        transition: &TransitionOperator,
    ) -> Result<(), OperatorError> {
        self.begin(model, element.t, &element.before);
        let ends = element.moves.1;
        if self.is_across || ends {
            self.carrying.pass(element, transition)?;
            // The event that ends the element follows.
            self.is_across = true;
            if !ends {
                self.close();
            }
            return Ok(());
        }
        self.transitions.push(transition.matrix());
        Ok(())
    }

    fn kicked(&mut self, model: &M, kicked: &Kicked) -> Result<(), OperatorError> {
        self.begin(model, kicked.t, &kicked.before);
        self.is_across = true;
        self.carrying.kick(model, kicked)
    }

    fn between(&mut self, model: &M, between: &Between<'m, M>) -> Result<(), RunErrorKind> {
        if let Between::Cut(cut) = between {
            let severed = cut.severed();
            self.begin(model, severed.begin, severed.before);
            self.is_across = true;
        }
        self.carrying.between(model, between)
    }
}
