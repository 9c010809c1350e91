//! Runs with the transition matrices of all elements, for models of run-time length.

use super::super::setup::Simulation;
use super::super::trail::Trail;
#[cfg(feature = "sparse")]
use super::super::trail::{Element, LONG_STEPS};
#[cfg(feature = "sparse")]
use crate::constraints::allowed::{self, basis_of};
use crate::error::RunError;
#[cfg(feature = "sparse")]
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use crate::linearised::Linearised;
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the transition matrix Φ = ∂(p, q)ₖ₊₁/∂(p, q)ₖ of every
    /// element: 2n × 2n, ordered (p, q).
    ///
    /// Every element is solved once more for its matrix, with 2n solutions by sparse factors. The matrices are dense:
    /// 4n² numbers for each element.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported)
    /// without the feature `sparse`, for events that change the state or end the run, and if steps were so long that
    /// they had to be cut.
    #[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
    pub fn run_linearised(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Linearised<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let (motion, trail) = self.trailed("run_linearised", start, &span, Trail::default())?;
        #[cfg(feature = "sparse")]
        return self.linearised(motion, &trail.elements);
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
        elements: &[Element],
    ) -> Result<Linearised<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        use tfe_runtime::family;
        let mut transitions = Vec::with_capacity(elements.len());
        let steps = elements.iter();
        let steps = steps.map(|element| (element.t, element.h, &element.before));
        let each = |transition: family::TransitionOperator| {
            let element: &Element = &elements[transitions.len()];
            element.check(transition.end(), self.control.tolerance)?;
            let mut matrix = transition.matrix();
            if let Some(kicked) = &element.kicked {
                let kick = family::Kick::of(&*self.model, element.t, &kicked.with, &[])?;
                let mut kicks = nalgebra::DMatrix::identity(matrix.nrows(), matrix.ncols());
                for mut column in kicks.column_iter_mut() {
                    kick.apply(column.as_mut_slice());
                }
                matrix *= kicks;
            }
            transitions.push(matrix);
            Ok(())
        };
        let element = self.chosen_element();
        let asked = (0.0, &[][..]);
        let found =
            family::TransitionOperator::of_steps_by(&*self.model, element, asked, steps, each);
        let Err((number, error)) = found else {
            let reduced = M::CONSTRAINED.then(|| {
                if elements.is_empty() {
                    let start = motion.last();
                    let basis = basis_of(&*self.model, start.t, &start.state());
                    return allowed::identity(basis);
                }
                let starts = elements.iter();
                let bases = starts.map(|element| basis_of(&*self.model, element.t, element.node()));
                let bases = bases.collect::<Result<Vec<_>, _>>()?;
                allowed::reduced(&bases, transitions.iter())
            });
            return Ok(Linearised::with(motion, transitions, reduced));
        };
        let at = elements.get(number).map(|element| (number, element));
        let kind = operator_failed(error, at, "run_linearised");
        Err(RunError::new(kind, motion))
    }
}

/// The error of a run one of whose elements has no derivative.
#[cfg(feature = "sparse")]
pub(in crate::simulation) fn operator_failed(
    error: family::OperatorError,
    at: Option<(usize, &Element)>,
    call: &'static str,
) -> RunErrorKind {
    match error {
        family::OperatorError::Family(error) => RunErrorKind::Family(error),
        family::OperatorError::Step(source) => {
            let (element, time, step) = at.map_or((0, f64::NAN, f64::NAN), |(number, element)| {
                (number, element.t, element.h)
            });
            RunErrorKind::Solve {
                element,
                time,
                step,
                source,
            }
        }
        family::OperatorError::Cut => RunErrorKind::Unsupported {
            call,
            of: LONG_STEPS,
        },
        _ => RunErrorKind::Unsupported {
            call,
            of: "models of run-time length",
        },
    }
}
