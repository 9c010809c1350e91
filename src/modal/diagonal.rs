//! Refines modes so that all frequencies have the relative accuracy of mass and stiffness, however far apart they are.

use nalgebra::DMatrix;

/// The largest number of rounds of Jacobi rotations: usually none are needed, and four if some springs are 10²⁰ times
/// as stiff as others.
const ROUNDS: usize = 30;

/// The number of successive rounds after which a zero frequency is accepted as a rigid-body mode. Before that, it may
/// be a slow mode with a dominating component of a stiff one. Each round reduces this component to a few ε of it;
/// twelve rounds reach the smallest `f64`.
const CERTAIN: u32 = 12;

/// ω² and Φ with ΦᵀKΦ = diag(ω²), from a Φ with ΦᵀMΦ = 1 that diagonalises K up to the rounding errors of the largest
/// ω²: slow modes may be any combinations of each other, with a component of a stiff mode.
///
/// Jacobi rotations [GVL, §8.5] preserve ΦᵀMΦ, and the digits of a small ω² beside a large one. Rounding errors are
/// estimated from the summands, |Φ|ᵀ|K||Φ|; an ω² within them is set to zero, that of a rigid-body mode.
pub(super) fn diagonal(
    stiffness: &DMatrix<f64>,
    mut shapes: DMatrix<f64>,
) -> (Vec<f64>, DMatrix<f64>) {
    let n = shapes.ncols();
    let mut squares = vec![0.0; n];
    let mut rigid = vec![0_u32; n];
    for _ in 0..ROUNDS {
        let mut form = Form::of(stiffness, &shapes);
        let mut is_diagonal = true;
        for j in 1..n {
            for i in 0..j {
                if rigid[i].max(rigid[j]) < CERTAIN && form.is_coupled(i, j) {
                    form.uncouple(i, j, &mut shapes);
                    is_diagonal = false;
                }
            }
        }
        for k in 0..n {
            let square = form.entries[(k, k)];
            if rigid[k] >= CERTAIN || square.abs() <= form.roundings[(k, k)] {
                (squares[k], rigid[k]) = (0.0, rigid[k] + 1);
            } else {
                (squares[k], rigid[k]) = (square, 0);
            }
        }
        if is_diagonal {
            break;
        }
    }
    (squares, shapes)
}

/// The matrix ΦᵀKΦ during the rotations of the columns of Φ.
struct Form {
    entries: DMatrix<f64>,
    /// The initial rounding errors of its entries.
    roundings: DMatrix<f64>,
}

impl Form {
    fn of(stiffness: &DMatrix<f64>, shapes: &DMatrix<f64>) -> Self {
        let entries = shapes.tr_mul(&(stiffness * shapes));
        let (sizes, sizes_of_shapes) = (stiffness.abs(), shapes.abs());
        let terms = sizes_of_shapes.tr_mul(&(sizes * &sizes_of_shapes));
        // Two sums of n products, and the entries of K themselves.
        let of_terms = (shapes.nrows() + 2) as f64 * f64::EPSILON;
        Self {
            entries: (&entries + entries.transpose()) * 0.5,
            roundings: terms * of_terms,
        }
    }

    /// Whether the coupling of two modes exceeds the rounding errors of itself and of their ω².
    fn is_coupled(&self, i: usize, j: usize) -> bool {
        let size = |k: usize| self.entries[(k, k)].abs().sqrt();
        let coupling = self.entries[(i, j)].abs();
        coupling > self.roundings[(i, j)] && coupling > f64::EPSILON * size(i) * size(j)
    }

    /// Applies the rotation that makes the coupling of two modes zero.
    fn uncouple(&mut self, i: usize, j: usize, shapes: &mut DMatrix<f64>) {
        let a = &mut self.entries;
        let (one, coupling, other) = (a[(i, i)], a[(i, j)], a[(j, j)]);
        let cotangent = (other - one) / (2.0 * coupling);
        let tangent = cotangent.signum() / (cotangent.abs() + cotangent.hypot(1.0));
        let cosine = 1.0 / tangent.hypot(1.0);
        let turn = (cosine, tangent * cosine);
        turn_columns(shapes, i, j, turn);
        turn_columns(a, i, j, turn);
        for k in 0..a.ncols() {
            (a[(i, k)], a[(j, k)]) = turned((a[(i, k)], a[(j, k)]), turn);
        }
        a[(i, i)] = one - tangent * coupling;
        a[(j, j)] = other + tangent * coupling;
        (a[(i, j)], a[(j, i)]) = (0.0, 0.0);
    }
}

fn turn_columns(matrix: &mut DMatrix<f64>, i: usize, j: usize, turn: (f64, f64)) {
    for k in 0..matrix.nrows() {
        (matrix[(k, i)], matrix[(k, j)]) = turned((matrix[(k, i)], matrix[(k, j)]), turn);
    }
}

fn turned((x, y): (f64, f64), (cosine, sine): (f64, f64)) -> (f64, f64) {
    (cosine * x - sine * y, sine * x + cosine * y)
}
