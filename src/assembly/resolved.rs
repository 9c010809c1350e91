//! Detects solutions that exist only because of the discretisation error.
//!
//! At conjugate points, and at resonance without damping, the equations of motion have no solution or many. The
//! discrete equations are then singular up to the discretisation error and have one solution, which grows as that error
//! decreases.

use super::chain::Chain;
use super::convergence::Size;
use super::error::AssemblyError;
use super::newton::{Assembly, Problem};
use tfe_runtime::Element;

/// Below this pivot ratio a solution is checked: it may be a thousand times as large as the prescribed values.
const DOUBTFUL: f64 = 1e-3;

/// Below this pivot ratio the rounding errors of a solution, about 4e-16, change it by more than the limit for rounding
/// errors.
const ROUNDINGS: f64 = 1e-6;

/// The largest relative change by one correction on a mesh of half the element length. A solution that is due to the
/// discretisation error grows by the factor by which the error decreases, at least four.
const LEFT: f64 = 0.5;

impl Chain {
    /// Whether the equations are so close to singular that the solution should be checked.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.smallest_pivot() < DOUBTFUL
    }

    /// The error of a failed iteration: the equations are singular if rounding errors alone prevent convergence.
    pub(crate) fn explained(&self, error: AssemblyError) -> AssemblyError {
        match error {
            AssemblyError::Stalled { iterations, .. } if self.smallest_pivot() < ROUNDINGS => {
                AssemblyError::Singular { iterations }
            }
            error => error,
        }
    }
}

impl Size {
    /// Whether the correction on a mesh of half the element length confirms the solution.
    pub(crate) fn leaves(self) -> bool {
        self.whole() <= LEFT
    }
}

impl<const N: usize> Assembly<N> {
    /// See [`Chain::is_doubtful`].
    pub(crate) fn is_doubtful(&self) -> bool {
        self.chain().is_doubtful()
    }

    /// See [`Chain::explained`].
    pub(crate) fn explained(&self, error: AssemblyError) -> AssemblyError {
        self.chain().explained(error)
    }

    /// Refuses a solution without global unknowns that one Newton correction on a mesh of half the element length
    /// (`fine`) does not confirm. `curve` is the solution.
    pub(crate) fn check_resolved<P: Problem<N>>(
        &self,
        element: Element,
        (fine, elements): (&P, usize),
        curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
    ) -> Result<(), AssemblyError> {
        let mut halves = Self::new::<P::Model>(element, elements, 0, 0)?;
        // If the check itself fails, the solution is accepted.
        let Ok(iterate) = halves.along(fine, curve, Vec::new()) else {
            return Ok(());
        };
        let is_left = match halves.linearise(fine, &iterate) {
            Ok(()) => halves.size(fine, &iterate).leaves(),
            Err(AssemblyError::Singular { .. }) => false,
            Err(_) => true,
        };
        if is_left {
            return Ok(());
        }
        Err(AssemblyError::Singular {
            iterations: self.corrections(),
        })
    }
}
