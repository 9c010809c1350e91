//! Whether a motion is at rest: an equilibrium, which repeats after any time.

use super::error::OrbitError;
use crate::assembly::AssemblyError;
use crate::length::{Length, Polynomial};
use crate::motion::Motion;

/// What a search for an orbit leaves of the motion of a coordinate at rest, beside the largest value that the coordinate had: some of its roundings, as many as the condition of the
/// equations makes of them.
const LEFT: f64 = 1e-11;

/// The same beside the largest of all coordinates, roundings of which those hold that are zero.
const ROUNDINGS: f64 = 32.0 * f64::EPSILON;

/// So many places of each element are looked at where all nodes are one.
const PLACES: u32 = 16;

/// Between which values each coordinate lies.
#[derive(Clone, Debug, Default)]
pub(super) struct Extent {
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Extent {
    /// Of some places.
    pub(super) fn of<'a>(places: impl IntoIterator<Item = &'a [f64]>) -> Self {
        let mut extent = Self::default();
        for q in places {
            extent.add(q);
        }
        extent
    }

    /// Of the nodes of a motion.
    pub(super) fn of_nodes<const N: usize, L: Length<N>>(motion: &Motion<N, L>) -> Self {
        Self::of(motion.states().iter().map(|node| node.q.as_ref()))
    }

    fn add(&mut self, q: &[f64]) {
        if self.low.is_empty() {
            (self.low, self.high) = (q.to_vec(), q.to_vec());
        }
        for ((low, high), q) in self.low.iter_mut().zip(&mut self.high).zip(q) {
            (*low, *high) = (low.min(*q), high.max(*q));
        }
    }

    /// With the places inside the elements of a motion.
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

    /// The largest value of each coordinate.
    fn sizes(&self) -> impl Iterator<Item = f64> {
        let bounds = self.low.iter().zip(&self.high);
        bounds.map(|(low, high)| low.abs().max(high.abs()))
    }

    /// Whether each coordinate stays where it is, up to roundings of the values that it has or had in the guess.
    fn is_point(&self, guess: &Self) -> bool {
        let sizes = self.sizes().zip(guess.sizes());
        let sizes: Vec<f64> = sizes.map(|(own, guess)| own.max(guess)).collect();
        let largest = sizes.iter().fold(0.0_f64, |most, size| most.max(*size));
        let mut ways = self.low.iter().zip(&self.high).zip(&sizes);
        // What is not a number is no rest.
        ways.all(|((low, high), size)| high - low <= (LEFT * size).max(ROUNDINGS * largest))
    }
}

/// Whether a motion goes nowhere: neither from node to node nor, where all nodes are one, within elements. Beside the values that coordinates have, and had in the guess.
pub(super) fn is_at_rest<const N: usize, L: Length<N>>(
    mut nodes: Extent,
    guess: &Extent,
    motion: impl FnOnce() -> Motion<N, L>,
) -> bool {
    if !nodes.is_point(guess) {
        return false;
    }
    // The end of each element may be that of a period.
    nodes.add_inside(&motion());
    nodes.is_point(guess)
}

/// Whether a search that ends so may have come to rest: equations of an orbit are singular there.
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
        // What is left of a guess that moved, and roundings of another coordinate in one that is zero.
        assert!(extent(&[[1e-17, 0.0], [-1e-16, 2e-17]]).is_point(&guess));
        assert!(!extent(&[[1e-9, 0.0], [-1e-9, 0.0]]).is_point(&guess));
        // Units make no difference.
        let small = extent(&[[1e-120, 0.0], [-1e-120, 0.0]]);
        assert!(!small.is_point(&small));
        // An angle beside a distance that stays.
        let far = extent(&[[1.5e11, -1.0], [1.5e11, 1.0]]);
        assert!(!far.is_point(&far));
        let still = extent(&[[1.5e11, 1e-6], [1.5e11, -1e-6]]);
        assert!(still.is_point(&still));
        let unknown = extent(&[[0.0, f64::NAN], [0.0, f64::NAN]]);
        assert!(!unknown.is_point(&guess));
    }
}
