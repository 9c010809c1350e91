//! Numbers side by side: in registers during computations, in memory between them.

use crate::precise::Precise;

/// A fixed number of values in registers: one for each of four points, or of eight trajectories.
pub trait Side<const LANES: usize>: Precise {
    /// The same kind of numbers with these values.
    fn with(self, lanes: [f64; LANES]) -> Self;

    /// The values.
    fn lanes(self) -> [f64; LANES];
}

/// Runs a block for every coordinate, four in each turn of a loop: with many coordinates, a tenth of the instructions of
/// a step would count them one by one.
macro_rules! each_coordinate {
    ($a:ident, $count:ident, $body:block) => {
        for block in 0..$count / 4 {
            for lane in 0..4 {
                let $a = 4 * block + lane;
                $body
            }
        }
        for $a in $count / 4 * 4..$count $body
    };
}
pub(crate) use each_coordinate;

/// Loads a row from memory into registers.
#[cfg(feature = "alloc")]
#[inline(always)]
pub(crate) fn load<V: Side<L>, const L: usize, const N: usize>(
    like: V,
    row: &[[f64; L]; N],
) -> [V; N] {
    let mut loaded = [like; N];
    for a in 0..N {
        loaded[a] = like.with(row[a]);
    }
    loaded
}

/// Stores a matrix for every lane from registers to memory.
#[inline(always)]
pub(crate) fn store<V: Side<L>, const L: usize, const N: usize>(
    to: &mut [[[f64; L]; N]; N],
    matrix: &[[V; N]; N],
) {
    for a in 0..N {
        for b in 0..N {
            to[a][b] = matrix[a][b].lanes();
        }
    }
}

/// LU factorisation without row exchanges: a mass matrix is positive definite, and where it is not, the iteration does
/// not converge and the step is left to another method. The diagonal holds the inverse pivots.
#[inline(always)]
pub(crate) fn factor<V: Precise, const N: usize>(like: V, matrix: &mut [[V; N]; N]) {
    for column in 0..N {
        let inverse = like.like(1.0) / matrix[column][column];
        matrix[column][column] = inverse;
        for row in column + 1..N {
            let factor = matrix[row][column] * inverse;
            matrix[row][column] = factor;
            for j in column + 1..N {
                matrix[row][j] = (-factor).times_plus(matrix[column][j], matrix[row][j]);
            }
        }
    }
}

/// Solves with the factors of [`factor`].
#[inline(always)]
pub(crate) fn solve<V: Side<L>, const L: usize, const N: usize>(
    like: V,
    factors: &[[[f64; L]; N]; N],
    vector: &mut [V; N],
) {
    for row in 0..N {
        for j in 0..row {
            vector[row] = (-like.with(factors[row][j])).times_plus(vector[j], vector[row]);
        }
    }
    for row in (0..N).rev() {
        for j in row + 1..N {
            vector[row] = (-like.with(factors[row][j])).times_plus(vector[j], vector[row]);
        }
        vector[row] = vector[row] * like.with(factors[row][row]);
    }
}
