//! Fractions k/d common to several products.
//!
//! Where d is a divisor of several products that all have the factor k, the fraction k/d is computed once: the
//! reciprocal 1/d would cost one more product. An example is the force k x/(r √r) between two bodies, with its other
//! components.

use super::demand::Multiple;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::ordered::{SortedMap, SortedSet};

/// Larger powers are left to the method that computes integer powers.
pub(super) const LARGEST_PRODUCT_POWER: u32 = 64;

/// Factors with their exponents.
pub(super) type Factors = Vec<(ExprId, i32)>;

/// A fraction.
pub(super) struct Fraction {
    pub(super) above: Factors,
    /// With positive exponents.
    pub(super) below: Factors,
}

/// The common fractions, and of each product with some of them: their numbers, and the factors that are left.
#[derive(Default)]
pub(super) struct Fractions {
    pub(super) all: Vec<Fraction>,
    products: SortedMap<Multiple, (Vec<usize>, Factors)>,
}

impl Fractions {
    /// Those of the products that have to be computed.
    pub(super) fn of(graph: &Graph, demanded: &SortedSet<Multiple>) -> Self {
        let mut fractions = Self::default();
        for (places, below) in divisors(graph, demanded) {
            let mut rest: Vec<Factors> = places
                .iter()
                .map(|place| fractions.rest(graph, place).1)
                .collect();
            let above = common(&rest);
            let roots = |(x, _): &(ExprId, i32)| {
                root_of(graph, *x).is_some_and(|y| below.iter().any(|(x, _)| *x == y))
            };
            if above.is_empty() && !below.iter().any(roots) {
                continue;
            }
            for factors in &mut rest {
                factors.retain(|(x, _)| below.iter().all(|(y, _)| x != y));
                for (x, n) in &above {
                    factors
                        .iter_mut()
                        .filter(|(y, _)| x == y)
                        .for_each(|(_, m)| *m -= n);
                }
                factors.retain(|(_, n)| *n != 0);
            }
            let number = fractions.all.len();
            fractions.all.push(Fraction { above, below });
            for (place, rest) in places.into_iter().zip(rest) {
                let known = fractions.products.get_or_default(place);
                known.0.push(number);
                known.1 = rest;
            }
        }
        fractions
    }

    /// The fractions in a product, and its other factors.
    pub(super) fn rest(&self, graph: &Graph, product: &Multiple) -> (Vec<usize>, Factors) {
        match (self.products.get(product), graph.node(product.0)) {
            (Some(known), _) => known.clone(),
            (None, Node::Product(factors)) => (Vec::new(), factors.clone()),
            _ => (Vec::new(), vec![(product.0, 1)]),
        }
    }
}

/// Divisors that have one exponent wherever they stand, together with those that stand in the same products.
fn divisors(graph: &Graph, demanded: &SortedSet<Multiple>) -> SortedMap<Vec<Multiple>, Factors> {
    let mut places: SortedMap<ExprId, Vec<(Multiple, i32)>> = SortedMap::new();
    for multiple in demanded {
        if let Node::Product(factors) = graph.node(multiple.0) {
            let below = factors.iter().filter(|(_, n)| *n < 0);
            for (x, n) in below.filter(|(x, _)| graph.as_constant(*x).is_none()) {
                places.get_or_default(*x).push((*multiple, *n));
            }
        }
    }
    let all: SortedSet<ExprId> = places.keys().copied().collect();
    let mut together: SortedMap<Vec<Multiple>, Factors> = SortedMap::new();
    for (x, places) in places {
        let n = places[0].1;
        let here = |(place, m): &(Multiple, i32)| {
            // What does not vary in a loop is divided by outside of it.
            *m == n && graph.loops_of(place.0) == graph.loops_of(x)
        };
        if places.len() > 1 && places.iter().all(here) && n.unsigned_abs() <= LARGEST_PRODUCT_POWER
        {
            let places = places.into_iter().map(|(place, _)| place).collect();
            together.get_or_default(places).push((x, -n));
        }
    }
    // The reciprocal of √x also serves for x, wherever one of both stands alone.
    together.retain(|_, group| {
        let inside = |x: ExprId| group.iter().any(|(y, _)| *y == x);
        all.iter().all(|x| match root_of(graph, *x) {
            Some(square) => inside(*x) == inside(square) || !all.contains(&square),
            None => true,
        })
    });
    together
}

/// x of √x.
fn root_of(graph: &Graph, root: ExprId) -> Option<ExprId> {
    match graph.node(root) {
        Node::Call {
            function: Function::Sqrt,
            arguments,
        } => arguments.first().copied(),
        _ => None,
    }
}

/// The factors that all of them have.
fn common(all: &[Factors]) -> Factors {
    let Some((first, others)) = all.split_first() else {
        return Factors::new();
    };
    let power = |factors: &Factors, x: ExprId| {
        let own = factors.iter().find(|(y, _)| *y == x);
        own.map_or(0, |(_, n)| *n)
    };
    first
        .iter()
        .map(|(x, n)| {
            let least = others.iter().map(|other| power(other, *x)).min();
            (*x, least.map_or(*n, |m| m.min(*n)))
        })
        .filter(|(_, n)| *n > 0)
        .collect()
}
