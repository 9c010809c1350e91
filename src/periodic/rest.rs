//! Detects motions at rest: an equilibrium repeats after any time and is no periodic orbit.

use super::error::OrbitError;
use crate::assembly::AssemblyError;
use crate::length::{Length, Polynomial};
use crate::motion::Motion;
use crate::numbers::{larger, largest, smaller};

/// The residual motion of a coordinate at rest after Newton's method, relative to its largest value: its rounding
/// error, amplified by the condition of the equations.
const LEFT: f64 = 1e-11;

/// The same relative to the largest of all coordinates; their rounding errors are in coordinates that vanish.
const ROUNDINGS: f64 = 32.0 * f64::EPSILON;

/// The number of samples in each element, if all nodes coincide.
const PLACES: u32 = 16;

/// The least and the largest value of each coordinate.
#[derive(Clone, Debug, Default)]
pub(super) struct Extent {
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Extent {
    /// The extent of several points.
    pub(super) fn of<'a>(places: impl IntoIterator<Item = &'a [f64]>) -> Self {
        let mut extent = Self::default();
        for q in places {
            extent.add(q);
        }
        extent
    }

    /// The extent of the nodes of a motion.
    pub(super) fn of_nodes<const N: usize, L: Length<N>>(motion: &Motion<N, L>) -> Self {
        Self::of(motion.states().iter().map(|node| node.q.as_ref()))
    }

    fn add(&mut self, q: &[f64]) {
        if self.low.is_empty() {
            (self.low, self.high) = (q.to_vec(), q.to_vec());
        }
        for ((low, high), q) in self.low.iter_mut().zip(&mut self.high).zip(q) {
            (*low, *high) = (smaller(*low, *q), larger(*high, *q));
        }
    }

    /// Includes samples inside the elements of a motion.
    fn add_inside<const N: usize, L: Length<N>>(&mut self, motion: &Motion<N, L>) {
        let pieces = motion.elements().iter().flat_map(Polynomial::pieces);
        for piece in pieces {
            for place in 0..PLACES {
                let state = piece.at((f64::from(place) + 0.5) / f64::from(PLACES));
                let (q, _) = L::parts(&state);
                self.add(q.as_ref());
            }
        }
    }

    /// The largest magnitude of each coordinate.
    fn sizes(&self) -> impl Iterator<Item = f64> {
        let bounds = self.low.iter().zip(&self.high);
        bounds.map(|(low, high)| larger(low.abs(), high.abs()))
    }

    /// Whether each coordinate is constant, up to the rounding error of its values now or in the guess.
    fn is_point(&self, guess: &Self) -> bool {
        let sizes = self.sizes().zip(guess.sizes());
        let sizes: Vec<f64> = sizes.map(|(own, guess)| larger(own, guess)).collect();
        let largest = largest(&sizes);
        let mut ways = self.low.iter().zip(&self.high).zip(&sizes);
        // A NaN is not at rest.
        ways.all(|((low, high), size)| high - low <= larger(LEFT * size, ROUNDINGS * largest))
    }
}

/// Whether a motion is constant, at its nodes and, if these coincide, inside the elements; relative to the values of
/// the coordinates now and in the guess.
pub(super) fn is_at_rest<const N: usize, L: Length<N>>(
    mut nodes: Extent,
    guess: &Extent,
    motion: impl FnOnce() -> Motion<N, L>,
) -> bool {
    if !nodes.is_point(guess) {
        return false;
    }
    // The length of each element may be a period.
    nodes.add_inside(&motion());
    nodes.is_point(guess)
}

/// Whether this outcome of a search is possible at rest, where the equations of an orbit are singular.
pub(super) fn may_rest(solved: &Result<(), OrbitError>) -> bool {
    matches!(
        solved,
        Ok(())
            | Err(OrbitError::NoFamily { .. }
                | OrbitError::Period { .. }
                | OrbitError::Assembly(
                    AssemblyError::Singular { .. } | AssemblyError::Stalled { .. }
                ))
    )
}

#[cfg(test)]
mod tests {
    use super::Extent;

    fn extent(places: &[[f64; 2]]) -> Extent {
        Extent::of(places.iter().map(|q| &q[..]))
    }

    #[test]
    fn a_motion_is_measured_by_the_coordinates_and_by_the_guess() {
        let guess = extent(&[[1.0, 0.0], [-1.0, 0.0]]);
        // The residue of a guess that moved, and the rounding error of another coordinate in one that vanishes.
        assert!(extent(&[[1e-17, 0.0], [-1e-16, 2e-17]]).is_point(&guess));
        assert!(!extent(&[[1e-9, 0.0], [-1e-9, 0.0]]).is_point(&guess));
        // The result does not depend on units.
        let small = extent(&[[1e-120, 0.0], [-1e-120, 0.0]]);
        assert!(!small.is_point(&small));
        // An angle beside a constant distance.
        let far = extent(&[[1.5e11, -1.0], [1.5e11, 1.0]]);
        assert!(!far.is_point(&far));
        let still = extent(&[[1.5e11, 1e-6], [1.5e11, -1e-6]]);
        assert!(still.is_point(&still));
        let unknown = extent(&[[0.0, f64::NAN], [0.0, f64::NAN]]);
        assert!(!unknown.is_point(&guess));
        // A NaN between numbers.
        let passing = extent(&[[0.0, 0.0], [0.0, f64::NAN], [0.0, 0.0]]);
        assert!(!passing.is_point(&guess));
        assert!(!extent(&[[0.0, 0.0]]).is_point(&passing));
    }
}
