//! What increments count of coordinates that are small beside the largest one, as an angle beside a distance of 10⁹ m.
//!
//! Iterations measure increments relative to the largest coordinate. Where they have converged so, they go on while
//! increments shrink relative to each coordinate itself. The elements of an array have one unit and count together: a
//! wave that has not yet come to most sites of a lattice prolongs nothing.

use crate::legendre::largest;
use crate::model::Model;

/// Coordinates above this fraction of the largest one have converged when that has: a tolerance of a twentieth of a
/// rounding error leaves at most fifty of theirs.
pub(crate) const ALIKE: f64 = 1.0 / 1024.0;

/// Coordinates below this fraction of the largest one may be nothing but its rounding errors.
const NOISE: f64 = 1e-12;

/// The sizes of coordinates that are small beside the largest one.
#[derive(Clone, Copy)]
pub(crate) struct Small {
    least: f64,
    most: f64,
    largest: f64,
}

impl Small {
    /// Beside this largest one, and above rounding errors of this size.
    pub(crate) fn beside(largest: f64, noise: f64) -> Self {
        Self {
            least: noise.max(NOISE * largest),
            most: ALIKE * largest,
            largest,
        }
    }

    /// How many times as much an increment counts for a coordinate of this size.
    pub(crate) fn weight(self, size: f64) -> f64 {
        // Comparisons with a NaN are false.
        if self.least < size && size < self.most {
            self.largest / size
        } else {
            1.0
        }
    }
}

/// Whether one of these sizes is small beside the largest one, or zero.
#[inline(always)]
pub(crate) fn are_unlike<const N: usize>(sizes: &[f64; N]) -> bool {
    let (mut least, mut most) = (f64::INFINITY, 0.0);
    for a in 0..N {
        let size = sizes[a];
        least = if size < least { size } else { least };
        most = if size > most { size } else { most };
    }
    least < ALIKE * most
}

/// Which coordinates belong to one array, whose elements count together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Declarations<const N: usize> {
    /// Whether an array, or a coordinate of its own, begins here.
    begins: [bool; N],
    pub(crate) are_several: bool,
}

impl<const N: usize> Declarations<N> {
    pub(crate) fn of<M>() -> Self
    where
        M: Model<N>,
    {
        let (mut begins, mut are_several) = ([true; N], false);
        for a in 1..N {
            begins[a] = M::coordinate_name(a).name != M::coordinate_name(a - 1).name;
            are_several |= begins[a];
        }
        Self {
            begins,
            are_several,
        }
    }

    /// Whether one of them is small beside the largest coordinate, or zero.
    #[inline(always)]
    pub(crate) fn may_be_small(&self, sizes: &[f64; N]) -> bool {
        are_unlike(sizes) && self.is_within(sizes, 0.0)
    }

    /// Whether one of them is small beside the largest coordinate, and above its rounding errors.
    #[inline(always)]
    pub(crate) fn is_small(&self, sizes: &[f64; N]) -> bool {
        are_unlike(sizes) && self.is_within(sizes, NOISE)
    }

    /// Whether the size of one of them, as a part of the largest coordinate, is at least `least` and below [`ALIKE`].
    #[inline(always)]
    fn is_within(&self, sizes: &[f64; N], least: f64) -> bool {
        let mut most = 0.0;
        for a in 0..N {
            most = if sizes[a] > most { sizes[a] } else { most };
        }
        let (low, high) = (least * most, ALIKE * most);
        let (mut size, mut is_any) = (0.0, false);
        for a in (0..N).rev() {
            size = if sizes[a] > size { sizes[a] } else { size };
            if self.begins[a] {
                is_any |= low <= size && size < high;
                size = 0.0;
            }
        }
        is_any
    }
}

/// The weights of the increments of coordinates of these sizes; `None` where all are one. Sizes up to `noise` are those
/// of rounding errors.
#[cold]
#[inline(never)]
pub(crate) fn weights<M, const N: usize>(sizes: &[f64; N], noise: f64) -> Option<[f64; N]>
where
    M: Model<N>,
{
    if !are_unlike(sizes) {
        return None;
    }
    let small = Small::beside(largest(sizes), noise);
    let begins = Declarations::of::<M>().begins;
    let (mut weights, mut is_any, mut first) = ([1.0; N], false, 0);
    for end in 1..=N {
        if end < N && !begins[end] {
            continue;
        }
        let weight = small.weight(largest(&sizes[first..end]));
        weights[first..end].fill(weight);
        is_any |= weight > 1.0;
        first = end;
    }
    is_any.then_some(weights)
}

/// The largest increment relative to the size of its own array or coordinate; `None` where none is small beside the
/// largest one, so that this is the increment relative to that.
pub(crate) fn own_increment<M, const N: usize>(
    sizes: &[f64; N],
    increments: &[f64; N],
    noise: f64,
) -> Option<f64>
where
    M: Model<N>,
{
    let mut weighted = weights::<M, N>(sizes, noise)?;
    for a in 0..N {
        weighted[a] *= increments[a];
    }
    Some(largest(&weighted) / largest(sizes))
}

/// The larger of two such increments.
pub(crate) fn larger_own(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    match (one, other) {
        (Some(one), Some(other)) => Some(largest(&[one, other])),
        _ => one.or(other),
    }
}

/// The largest magnitude of each coordinate in rows of N; NaN is kept.
pub(crate) fn by_coordinate<const N: usize>(rows: &[f64]) -> [f64; N] {
    let mut sizes = [0.0; N];
    for row in rows.as_chunks::<N>().0 {
        for a in 0..N {
            raise(&mut sizes[a], row[a].abs());
        }
    }
    sizes
}

/// Raises a maximum to a number; NaN is kept.
pub(crate) fn raise(so_far: &mut f64, number: f64) {
    if number > *so_far || number.is_nan() {
        *so_far = number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_is_between_rounding_errors_and_the_like() {
        let small = Small::beside(1e9, 0.0);
        let counted = [1e6 * 0.9, 1.0, 2e-3].map(|size| small.weight(size) * size);
        for largest in counted {
            assert!((largest - 1e9).abs() <= 1e-6, "{counted:?}");
        }
        for size in [1e9, 1e6, 0.9e-3, 0.0, f64::NAN] {
            assert!(small.weight(size) == 1.0, "{size}");
        }
        assert!(Small::beside(1e9, 0.1).weight(0.05) == 1.0);
        assert!(Small::beside(f64::NAN, 0.0).weight(1.0) == 1.0);
    }

    #[test]
    fn no_number_is_lost() {
        let [first, second] = by_coordinate(&[1.0, f64::NAN, -3.0, 5.0]);
        assert!(first == 3.0 && second.is_nan());
        assert!(larger_own(Some(1.0), Some(f64::NAN)).is_some_and(f64::is_nan));
        assert_eq!(larger_own(None, Some(2.0)), Some(2.0));
        assert!(are_unlike(&[1.0, 0.0]) && !are_unlike(&[1.0, 0.5]) && !are_unlike(&[0.0, 0.0]));
    }
}
