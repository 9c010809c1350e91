//! Sums of squares, and other quadratic forms that vanish only where all their parts do.
//!
//! ```text
//! x² + x y + y² ≥ (x² + y²)/2
//! ```

use super::facts::factors_of;
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// A product, without the parameters among its factors.
pub(super) type Part = Vec<(ExprId, i32)>;

/// A term of a form with its coefficient.
type Term = (Constant, ExprId);

/// Forms with products in more variables than this are not examined.
const MAX_VARIABLES: usize = 8;

/// A pivot that is smaller, relative to the coefficient it comes from, counts as zero.
const ROUNDING: f64 = 1e-9;

/// The root of the factors of an expression without parameters, if they have one and it can vanish.
pub(super) fn part(graph: &Graph, x: ExprId, root: i32) -> Option<Part> {
    let mut part = Part::new();
    for (y, n) in factors_of(graph, x) {
        match graph.node(y) {
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..)) => {}
            Node::Constant(_) => return None,
            _ if n > 0 && n % root == 0 => part.push((y, n / root)),
            _ => return None,
        }
    }
    (!part.is_empty()).then_some(part)
}

/// The xᵢ of a form that is zero only where all xᵢ are, and positive elsewhere.
pub(super) fn parts_of_form(graph: &Graph, form: ExprId) -> Option<Vec<Part>> {
    let (constant, terms) = graph.terms(form);
    if !constant.is_zero() {
        return None;
    }
    let (mut squares, mut products, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for (c, term) in terms {
        match part(graph, term, 2) {
            Some(_) if c.is_negative() || c.is_zero() => return None,
            Some(part) => {
                squares.push((c, term));
                parts.push(part);
            }
            None => products.push((c, term)),
        }
    }
    let vanishes_with_its_parts = products.is_empty() || is_definite(graph, &squares, &products);
    vanishes_with_its_parts.then_some(parts)
}

/// Whether a form in variables with numbers as coefficients is positive definite: elimination leaves positive pivots.
fn is_definite(graph: &Graph, squares: &[Term], products: &[Term]) -> bool {
    let Some(mut matrix) = matrix(graph, squares, products) else {
        return false;
    };
    for k in 0..matrix.len() {
        let pivot = matrix[k][k];
        for i in k + 1..matrix.len() {
            let ratio = matrix[i][k] / pivot;
            let before = matrix[i][i];
            for j in k + 1..matrix.len() {
                matrix[i][j] -= ratio * matrix[k][j];
            }
            if !(matrix[i][i] > ROUNDING * before) {
                return false;
            }
        }
    }
    true
}

/// The symmetric matrix of a form in the variables of which it holds squares.
fn matrix(graph: &Graph, squares: &[Term], products: &[Term]) -> Option<Vec<Vec<f64>>> {
    let mut variables: Vec<ExprId> = Vec::with_capacity(squares.len());
    for (_, square) in squares {
        let factors = factors_of(graph, *square);
        let [(x, 2)] = factors[..] else {
            return None;
        };
        if variables.contains(&x) || variables.len() == MAX_VARIABLES {
            return None;
        }
        variables.push(x);
    }
    let mut matrix = vec![vec![0.0; variables.len()]; variables.len()];
    for (at, (c, _)) in squares.iter().enumerate() {
        matrix[at][at] = c.to_f64();
    }
    for (c, product) in products {
        let factors = factors_of(graph, *product);
        let [(x, 1), (y, 1)] = factors[..] else {
            return None;
        };
        let row = variables.iter().position(|z| *z == x)?;
        let column = variables.iter().position(|z| *z == y)?;
        matrix[row][column] += c.to_f64() / 2.0;
        matrix[column][row] += c.to_f64() / 2.0;
    }
    Some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Affine;

    /// How many parts x² + c x y + y² + z² has.
    fn parts(c: i64) -> Option<usize> {
        let mut g = Graph::default();
        let [x, y, z] = [0, 1, 2].map(|k| g.input(Input::Coordinate(Affine::constant(k))));
        let [x2, xy, y2, z2] = [(x, x), (x, y), (y, y), (z, z)].map(|(a, b)| g.multiply(a, b));
        let one = Constant::ONE;
        let terms = [(one, x2), (Constant::integer(c), xy), (one, y2), (one, z2)];
        let form = g.linear(Constant::ZERO, &terms);
        parts_of_form(&g, form).map(|parts| parts.len())
    }

    #[test]
    fn definite_forms_have_parts() {
        assert_eq!([0, 1, -1].map(parts), [Some(3); 3]);
        // (x + y)² + z² vanishes elsewhere as well.
        assert_eq!([2, -2, 3].map(parts), [None; 3]);
    }
}
