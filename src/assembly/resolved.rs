//! Whether a solution is one of the equations of motion, or of the errors of elements alone.
//!
//! At conjugate points, and at resonance without damping, the equations of motion have no solution, or many. Those of elements have one: they are singular up to the errors of the elements,
//! and their solution is as large as these are small.

use super::chain::Chain;
use super::convergence::Size;
use super::error::AssemblyError;
use super::newton::{Assembly, Problem};
use tfe_runtime::Element;

/// Smaller pivots are looked at: with them a solution may be a thousand times as large as what is asked for.
const DOUBTFUL: f64 = 1e-3;

/// With smaller ones roundings of a solution, some 4e-16, move it by more than what counts as such.
const ROUNDINGS: f64 = 1e-6;

/// A solution of which elements of half the length leave less than this part is none: theirs is as many times larger as their errors are smaller, four times at least.
const LEFT: f64 = 0.5;

impl Chain {
    /// Whether the equations that were solved are so near to singular ones that a solution should be looked at.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.smallest_pivot() < DOUBTFUL
    }

    /// What an iteration that has failed ends with: where roundings alone keep it from its end, the equations are singular.
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
    /// Whether one correction on elements of half the length leaves a solution as it is.
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

    /// Refuses a solution without global unknowns that one correction on elements of half the length, those of `fine`, does not leave. The curve is that of the solution.
    pub(crate) fn check_resolved<P: Problem<N>>(
        &self,
        element: Element,
        (fine, elements): (&P, usize),
        curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
    ) -> Result<(), AssemblyError> {
        let mut halves = Self::new::<P::Model>(element, elements, 0, 0)?;
        // What it cannot tell it does not refuse.
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
            iterations: self.iterations(),
        })
    }
}
