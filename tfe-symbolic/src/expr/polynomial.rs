//! Expanded polynomials: products of sums are multiplied out, so that equal polynomials become the same expression.
//!
//! The constructors of expressions keep nested sums, because kernels share them. To compare two expressions, they have
//! to be expanded.

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::ordered::SortedMap;

/// Expressions with more terms than this are not compared.
const MAX_TERMS: usize = 512;

/// Σ c x: coefficients by products of atoms; the number one stands for the constant.
type Polynomial = SortedMap<ExprId, Constant>;

impl Graph {
    /// The expanded expression; `None` if it has too many terms.
    ///
    /// Functions and their arguments, quotients by sums and sums over ranges are atoms.
    pub(crate) fn expanded(&mut self, root: ExprId) -> Option<ExprId> {
        self.expanded_within(root, MAX_TERMS)
    }

    /// The same, with the largest number of terms on the way.
    pub(crate) fn expanded_within(&mut self, root: ExprId, most_terms: usize) -> Option<ExprId> {
        let mut done: SortedMap<ExprId, Polynomial> = SortedMap::new();
        for id in self.reachable_outside_sums(&[root]) {
            let polynomial = match self.node(id).clone() {
                Node::Constant(value) => {
                    let one = self.constant(Constant::ONE);
                    let mut number = Polynomial::new();
                    add(&mut number, one, value);
                    number
                }
                Node::Sum { constant, terms } => {
                    let one = self.constant(Constant::ONE);
                    let mut sum = Polynomial::new();
                    add(&mut sum, one, constant);
                    for (factor, x) in terms {
                        for (y, coefficient) in done.get(&x)? {
                            add(&mut sum, *y, factor * *coefficient);
                        }
                    }
                    sum
                }
                Node::Product(factors) => {
                    let one = self.constant(Constant::ONE);
                    let mut product = Polynomial::from([(one, Constant::ONE)]);
                    for (x, exponent) in factors {
                        let base = done.get(&x)?;
                        if exponent < 0 || base.len() == 1 {
                            let power = self.product(Constant::ONE, &[(x, exponent)]);
                            let (factor, power) = self.as_multiple(power);
                            let power = Polynomial::from([(power, factor)]);
                            product = self.times(&product, &power, most_terms)?;
                        } else {
                            for _ in 0..exponent {
                                product = self.times(&product, base, most_terms)?;
                            }
                        }
                    }
                    product
                }
                _ => Polynomial::from([(id, Constant::ONE)]),
            };
            if polynomial.len() > most_terms {
                return None;
            }
            done.insert(id, polynomial);
        }
        let terms: Vec<(Constant, ExprId)> = done
            .get(&root)?
            .iter()
            .map(|(x, coefficient)| (*coefficient, *x))
            .collect();
        Some(self.linear(Constant::ZERO, &terms))
    }

    fn times(&mut self, a: &Polynomial, b: &Polynomial, most_terms: usize) -> Option<Polynomial> {
        if a.len().saturating_mul(b.len()) > most_terms {
            return None;
        }
        let mut product = Polynomial::new();
        for (x, c) in a {
            for (y, d) in b {
                let (factor, both) = {
                    let both = self.multiply(*x, *y);
                    self.as_multiple(both)
                };
                add(&mut product, both, *c * *d * factor);
            }
        }
        Some(product)
    }
}

fn add(polynomial: &mut Polynomial, x: ExprId, coefficient: Constant) {
    let sum = polynomial.get(&x).copied().unwrap_or(Constant::ZERO) + coefficient;
    if sum.is_zero() {
        polynomial.remove(&x);
    } else {
        polynomial.insert(x, sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::function::Function;
    use crate::expr::input::{Affine, Input};

    fn q(graph: &mut Graph, index: i64) -> ExprId {
        graph.input(Input::Coordinate(Affine::constant(index)))
    }

    #[test]
    fn squares_of_sums_are_multiplied_out() {
        // (x + y)² − x² = 2 x y + y², and with −2 x y − y² nothing is left.
        let mut g = Graph::default();
        let (x, y) = (q(&mut g, 0), q(&mut g, 1));
        let sum = g.add(x, y);
        let (sum2, x2, y2, xy) = (
            g.multiply(sum, sum),
            g.multiply(x, x),
            g.multiply(y, y),
            g.multiply(x, y),
        );
        let left = g.subtract(sum2, x2);
        let twice = g.add(xy, xy);
        let right = g.add(twice, y2);
        assert_eq!(g.expanded(left), g.expanded(right));
        let difference = g.subtract(left, right);
        let nothing = g.expanded(difference).and_then(|id| g.as_constant(id));
        assert!(nothing.is_some_and(Constant::is_zero));
    }

    #[test]
    fn functions_and_quotients_are_atoms() {
        // (sin(x) + 1/y) y = y sin(x) + 1
        let mut g = Graph::default();
        let (x, y) = (q(&mut g, 0), q(&mut g, 1));
        let one = g.integer(1);
        let (sine, inverse) = (g.call(Function::Sin, &[x]), g.divide(one, y));
        let sum = g.add(sine, inverse);
        let product = g.multiply(sum, y);
        let expected = g.multiply(y, sine);
        let expected = g.add(expected, one);
        assert_eq!(g.expanded(product), Some(expected));
    }

    #[test]
    fn what_grows_too_large_is_left() {
        let mut g = Graph::default();
        let (mut sum, one) = (g.integer(0), g.integer(1));
        for index in 0..10 {
            let x = q(&mut g, index);
            sum = g.add(sum, x);
        }
        let sum = g.add(sum, one);
        let power = g.integer(6);
        let power = g.power(sum, power);
        assert_eq!(g.expanded(power), None);
    }
}
