//! Detects solutions that exist only because of the discretisation error.
//!
//! At conjugate points, and at resonance without damping, the equations of motion have no solution or many. The
//! discrete equations are then singular up to the discretisation error and have one solution, which grows as that error
//! decreases.

use super::chain::Chain;
#[cfg(feature = "sparse")]
use super::convergence::Size;
use super::error::AssemblyError;
use super::newton::{Assembly, Iterate, Problem};
use super::warning::MeshWarning;
use crate::numbers::{larger, raise, smaller};
use tfe_runtime::{Element, State};

/// Below this pivot ratio a solution is checked: it may be a thousand times as large as the prescribed values.
const DOUBTFUL: f64 = 1e-3;

/// Below this pivot ratio the rounding errors of a solution, about 4e-16, change it by more than the limit for rounding
/// errors.
const ROUNDINGS: f64 = 1e-6;

/// The largest relative change by one correction on a mesh of half the element length. A solution that is due to the
/// discretisation error grows by the factor by which the error decreases, at least four.
const LEFT: f64 = 0.5;

/// The largest change by that correction without a warning, relative to the extent of the motion; runs have the same
/// limit (T-121).
const FARTHEST: f64 = 0.03;

/// The least extent, relative to the values themselves: that of a motion at rest is its rounding errors.
const MIN: f64 = 1e-6;

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

#[cfg(feature = "sparse")]
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
        let unknowns = (Vec::new(), 0);
        let size = |halves: &Self, iterate: &Iterate<N>| halves.size(fine, iterate).whole();
        let change = Self::corrected(element, (fine, elements), unknowns, curve, size)?;
        // If the check itself fails, the solution is accepted.
        let is_left = change.is_none_or(|change| change <= LEFT);
        if is_left {
            return Ok(());
        }
        Err(AssemblyError::Singular {
            iterations: self.corrections(),
        })
    }

    /// The warnings for a solution, given as a curve with its global unknowns, by one Newton correction on a mesh of half
    /// the element length (`fine`). If there is no correction, there are none.
    pub(crate) fn doubts<P: Problem<N>>(
        element: Element,
        (fine, elements): (&P, usize),
        unknowns: (Vec<f64>, usize),
        curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
    ) -> Vec<MeshWarning> {
        let size = |halves: &Self, iterate: &Iterate<N>| halves.part_of_extent(fine, iterate);
        let change = Self::corrected(element, (fine, elements), unknowns, curve, size);
        let Ok(Some(change)) = change else {
            return Vec::new();
        };
        let warning = MeshWarning::Unresolved {
            elements: elements / 2,
            change,
        };
        // A NaN is no solution, of which the iteration has told.
        if change > FARTHEST {
            vec![warning]
        } else {
            Vec::new()
        }
    }

    /// The size of one Newton correction on a mesh of half the element length (`fine`), for a solution given as a curve
    /// with its global unknowns: infinite where the equations are singular, `None` if there is no correction.
    fn corrected<P: Problem<N>>(
        element: Element,
        (fine, elements): (&P, usize),
        (globals, dense): (Vec<f64>, usize),
        curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
        size: impl FnOnce(&Self, &Iterate<N>) -> f64,
    ) -> Result<Option<f64>, AssemblyError> {
        let mut halves = Self::new::<P::Model>(element, elements, globals.len(), dense)?;
        let Ok(iterate) = halves.along(fine, curve, globals) else {
            return Ok(None);
        };
        Ok(match halves.linearise(fine, &iterate) {
            Ok(()) => Some(size(&halves, &iterate)),
            Err(AssemblyError::Singular { .. }) => Some(f64::INFINITY),
            Err(_) => None,
        })
    }

    /// The size of the last correction: of coordinates and momenta relative to their extents, of global unknowns relative
    /// to their scales.
    fn part_of_extent<P: Problem<N>>(&self, problem: &P, iterate: &Iterate<N>) -> f64 {
        let kinds: [fn(&State<N>) -> &[f64; N]; 2] = [|state| &state.p, |state| &state.q];
        let mut most = 0.0;
        for (kind, of) in kinds.into_iter().enumerate() {
            let (mut extent, mut correction) = (0.0, 0.0);
            for a in 0..N {
                let values = || iterate.nodes.iter().map(|node| of(node)[a]);
                let high = values().fold(f64::NEG_INFINITY, larger);
                let low = values().fold(f64::INFINITY, smaller);
                raise(&mut extent, high - low);
                raise(&mut extent, MIN * larger(high.abs(), low.abs()));
                for e in 0..iterate.nodes.len() {
                    raise(&mut correction, self.chain().node(e)[kind * N + a].abs());
                }
            }
            if extent > 0.0 {
                raise(&mut most, correction / extent);
            }
        }
        for (k, correction) in self.chain().globals().iter().enumerate() {
            raise(&mut most, (correction / problem.scale(k)).abs());
        }
        most
    }
}
