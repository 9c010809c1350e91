//! The rules of sums (the list of all rules is in `simplify.rs`).

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::ordered::SortedMap;

impl Graph {
    /// constant + Σ cᵢ xᵢ; this function contains all rules of sums.
    pub(crate) fn linear(&mut self, constant: Constant, terms: &[(Constant, ExprId)]) -> ExprId {
        let mut sum = Collected {
            constant,
            terms: SortedMap::new(),
        };
        for (coefficient, x) in terms {
            sum.push(self, *coefficient, *x);
        }
        sum.open_where_terms_cancel(self);
        sum.join_squares_of_sine_and_cosine(self);
        sum.join_exponentials(self);
        sum.join_parts_of_denominators(self);
        let Collected { constant, terms } = sum;
        let mut terms: Vec<(Constant, ExprId)> = terms
            .into_iter()
            .map(|(x, coefficient)| (coefficient, x))
            .collect();
        let Some((first, only)) = terms.first().copied() else {
            return self.constant(constant);
        };
        if terms.len() == 1 && constant.is_zero() {
            return if first.is_one() {
                only
            } else {
                self.intern(Node::Sum { constant, terms })
            };
        }
        let size = first.abs();
        let same_size = terms
            .iter()
            .all(|(coefficient, _)| coefficient.abs() == size)
            && (constant.is_zero() || constant.abs() == size);
        let out = match (same_size, first.is_negative()) {
            (true, _) => first,
            (false, true) => Constant::MINUS_ONE,
            (false, false) => Constant::ONE,
        };
        if out.is_one() {
            return self.intern(Node::Sum { constant, terms });
        }
        let divided =
            |value: Constant| match (same_size, value.is_negative() == first.is_negative()) {
                _ if value.is_zero() => value,
                (true, true) => Constant::ONE,
                (true, false) => Constant::MINUS_ONE,
                (false, _) => -value,
            };
        for (coefficient, _) in &mut terms {
            *coefficient = divided(*coefficient);
        }
        let inner = self.intern(Node::Sum {
            constant: divided(constant),
            terms,
        });
        self.intern(Node::Sum {
            constant: Constant::ZERO,
            terms: vec![(out, inner)],
        })
    }
}

/// A sum being collected.
struct Collected {
    constant: Constant,
    terms: SortedMap<ExprId, Constant>,
}

impl Collected {
    fn push(&mut self, graph: &Graph, coefficient: Constant, x: ExprId) {
        let (coefficient, x) = graph.as_multiple_times(coefficient, x);
        if let Some(value) = graph.as_constant(x) {
            self.constant = self.constant + coefficient * value;
            return;
        }
        let total = self.terms.get(&x).copied().unwrap_or(Constant::ZERO) + coefficient;
        if total.is_zero() {
            self.terms.remove(&x);
        } else {
            self.terms.insert(x, total);
        }
    }

    fn open_where_terms_cancel(&mut self, graph: &Graph) {
        loop {
            let cancels = |(x, coefficient): &(ExprId, Constant)| {
                let (constant, terms) = graph.as_sum(*x)?;
                let cancels = |own: Option<Constant>, inner: Constant| {
                    own.is_some_and(|own| (own + *coefficient * inner).is_zero())
                };
                let constants = !constant.is_zero() && cancels(Some(self.constant), constant);
                let some = terms
                    .iter()
                    .any(|(inner, y)| cancels(self.terms.get(y).copied(), *inner));
                (constants || some).then_some((*x, *coefficient))
            };
            let Some((x, coefficient)) = self.terms.iter().find_map(cancels) else {
                return;
            };
            self.terms.remove(&x);
            if let Some((constant, terms)) = graph.as_sum(x) {
                self.constant = self.constant + coefficient * constant;
                for (inner, y) in terms {
                    self.push(graph, coefficient * *inner, *y);
                }
            }
        }
    }

    fn join_squares_of_sine_and_cosine(&mut self, graph: &mut Graph) {
        if self.terms.len() < 2 {
            return;
        }
        'again: loop {
            for (x, coefficient) in &self.terms {
                let Node::Product(factors) = graph.node(*x) else {
                    continue;
                };
                for (at, (sine, exponent)) in factors.iter().enumerate() {
                    let Node::Call {
                        function: Function::Sin,
                        arguments,
                    } = graph.node(*sine)
                    else {
                        continue;
                    };
                    let cosine = Node::Call {
                        function: Function::Cos,
                        arguments: arguments.clone(),
                    };
                    let Some(cosine) = graph.find(&cosine).filter(|_| *exponent >= 2) else {
                        continue;
                    };
                    let mut rest = factors.clone();
                    rest[at].1 -= 2;
                    let mut partner = rest.clone();
                    match partner.iter_mut().find(|(y, _)| *y == cosine) {
                        Some((_, n)) => *n = n.saturating_add(2),
                        None => partner.push((cosine, 2)),
                    }
                    partner.retain(|(_, n)| *n != 0);
                    partner.sort_unstable();
                    let Some(partner) = graph.find(&Node::Product(partner)) else {
                        continue;
                    };
                    if self.terms.get(&partner) != Some(coefficient) {
                        continue;
                    }
                    let (x, coefficient) = (*x, *coefficient);
                    self.terms.remove(&x);
                    self.terms.remove(&partner);
                    let rest = graph.product(Constant::ONE, &rest);
                    self.push(graph, coefficient, rest);
                    continue 'again;
                }
            }
            return;
        }
    }

    /// a eᵘ + a e⁻ᵘ → 2 a cosh u and a eᵘ − a e⁻ᵘ → 2 a sinh u: quotients of these are finite where the exponentials are not.
    fn join_exponentials(&mut self, graph: &mut Graph) {
        while self.terms.len() > 1 {
            let joined = self.terms.iter().find_map(|(x, coefficient)| {
                let (exponent, inverse) = exponent_and_inverse(graph, *x)?;
                let other = *self.terms.get(&inverse)?;
                let has_same_size = other.abs() == coefficient.abs();
                has_same_size.then_some((*x, inverse, exponent, *coefficient, other))
            });
            let Some((x, inverse, exponent, coefficient, other)) = joined else {
                return;
            };
            self.terms.remove(&x);
            self.terms.remove(&inverse);
            let function = match other == coefficient {
                true => Function::Cosh,
                false => Function::Sinh,
            };
            let value = graph.call(function, &[exponent]);
            self.push(graph, Constant::integer(2) * coefficient, value);
        }
    }

    /// a r uⁿ⁺¹ − a c r uⁿ w → a r uⁿ (u − c w), where c w is a term of u, a sum with positive coefficients, and n < 0.
    ///
    /// With u = x² + y² this is 1/√u − x²/√u³ → y²/√u³, the second derivative of a distance: nothing cancels any more where y is small. With
    /// u = z² − x² nothing cancels in 1/√u + x²/√u³, which stays as it is. For h = hypot(x, y), h² is such a sum: 1/h − x²/h³ → y²/h³.
    fn join_parts_of_denominators(&mut self, graph: &mut Graph) {
        while self.terms.len() > 1 {
            let joined = self.terms.iter().find_map(|(x, coefficient)| {
                let parts = parts_of_denominators(graph, *x).into_iter();
                let mut known = parts.filter_map(|part| {
                    let partner = *self.terms.get(&part.partner)?;
                    (*coefficient == -(partner * part.coefficient)).then_some((*x, partner, part))
                });
                known.next()
            });
            let Some((x, coefficient, part)) = joined else {
                return;
            };
            self.terms.remove(&x);
            self.terms.remove(&part.partner);
            let mut factors = part.rest;
            factors.push(match part.left {
                Left::Without { sum, term } => {
                    (without(graph, sum, term, &mut SortedMap::new()), 1)
                }
                Left::Square(x) => (x, 2),
            });
            let product = graph.product(Constant::ONE, &factors);
            self.push(graph, coefficient, product);
        }
    }
}

/// u and e⁻ᵘ of eᵘ, if both powers have been made.
fn exponent_and_inverse(graph: &Graph, x: ExprId) -> Option<(ExprId, ExprId)> {
    let Node::Call {
        function: Function::Exp,
        arguments,
    } = graph.node(x)
    else {
        return None;
    };
    let exponent = *arguments.first()?;
    let (c, inner) = graph.as_multiple(exponent);
    let opposite = match (-c).is_one() {
        true => inner,
        false => graph.find(&Node::Sum {
            constant: Constant::ZERO,
            terms: vec![(-c, inner)],
        })?,
    };
    let inverse = Node::Call {
        function: Function::Exp,
        arguments: vec![opposite],
    };
    Some((exponent, graph.find(&inverse)?))
}

/// A product r uⁿ w, where c w is a term of u.
struct PartOfDenominator {
    /// c
    coefficient: Constant,
    /// r uⁿ
    rest: Vec<(ExprId, i32)>,
    /// r uⁿ⁺¹
    partner: ExprId,
    left: Left,
}

/// u − c w
enum Left {
    Without { sum: ExprId, term: ExprId },
    Square(ExprId),
}

/// A term c w of a sum u that stands below.
struct TermBelow {
    coefficient: Constant,
    /// w
    factors: Vec<(ExprId, i32)>,
    /// Which power of the divisor u is.
    power: i32,
    left: Left,
}

/// In denominators with more terms than this, some terms are not examined.
const LONG_DENOMINATOR: usize = 8;

/// The ways to read an expression as such a product whose partner has been made.
fn parts_of_denominators(graph: &Graph, x: ExprId) -> Vec<PartOfDenominator> {
    let Node::Product(factors) = graph.node(x) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (divisor, n) in factors.iter().filter(|(_, n)| *n < 0) {
        if stands_below_a_power(graph, factors, *divisor) {
            continue;
        }
        for term in terms_below(graph, *divisor) {
            let Some(rest) = quotient(factors, &term.factors) else {
                continue;
            };
            let mut partner = rest.clone();
            for (y, m) in &mut partner {
                if y == divisor {
                    *m = n + term.power;
                }
            }
            partner.retain(|(_, m)| *m != 0);
            let partner = match partner[..] {
                [(y, 1)] => Some(y),
                _ => graph.find(&Node::Product(partner)),
            };
            if let Some(partner) = partner {
                found.push(PartOfDenominator {
                    coefficient: term.coefficient,
                    rest,
                    partner,
                    left: term.left,
                });
            }
        }
    }
    found
}

/// Whether a power of a divisor, or of its root, whose exponent is not a number is among the factors. Then the degree of
/// the divisor is not known, and joined terms would all vanish with it: the curvature of hᵉ is constant where e = 2.
fn stands_below_a_power(graph: &Graph, factors: &[(ExprId, i32)], divisor: ExprId) -> bool {
    let is_power = |(x, _): &(ExprId, i32)| {
        let Node::Power { base, exponent } = graph.node(*x) else {
            return false;
        };
        let base = graph.as_multiple(*base).1;
        let radicand = match graph.node(base) {
            Node::Call {
                function: Function::Sqrt,
                arguments,
            } => arguments.first().map(|y| graph.as_multiple(*y).1),
            _ => None,
        };
        graph.as_constant(*exponent).is_none() && (base == divisor || radicand == Some(divisor))
    };
    factors.iter().any(is_power)
}

/// The terms of a divisor that is a sum, or whose square is one.
fn terms_below(graph: &Graph, divisor: ExprId) -> Vec<TermBelow> {
    if let Node::Call {
        function: Function::Hypot,
        arguments,
    } = graph.node(divisor)
        && let [x, y] = arguments[..]
    {
        return [(x, y), (y, x)]
            .map(|(own, other)| {
                let (coefficient, own) = graph.as_multiple(own);
                let mut factors = factors_of(graph, own);
                for (_, n) in &mut factors {
                    *n = n.saturating_mul(2);
                }
                TermBelow {
                    coefficient: coefficient * coefficient,
                    factors,
                    power: 2,
                    left: Left::Square(other),
                }
            })
            .into();
    }
    if graph.as_sum(divisor).is_none() {
        return Vec::new();
    }
    let mut terms = terms_if_positive(graph, divisor);
    // The coefficients of a term that appears in several of the nested sums add up.
    terms.retain(|(_, term)| occurrences(graph, divisor, *term, &mut SortedMap::new()) <= 1);
    let below = |(coefficient, term): (Constant, ExprId)| TermBelow {
        coefficient,
        factors: factors_of(graph, term),
        power: 1,
        left: Left::Without { sum: divisor, term },
    };
    terms.into_iter().map(below).collect()
}

/// The factors of an expression with their exponents.
pub(super) fn factors_of(graph: &Graph, x: ExprId) -> Vec<(ExprId, i32)> {
    match graph.node(x) {
        Node::Product(factors) => factors.clone(),
        _ => vec![(x, 1)],
    }
}

/// The terms of a sum and of the sums in it with their coefficients, up to a few; none where a coefficient is negative.
fn terms_if_positive(graph: &Graph, sum: ExprId) -> Vec<(Constant, ExprId)> {
    let mut found = Vec::new();
    let mut waiting = vec![(Constant::ONE, sum)];
    while let Some((coefficient, x)) = waiting.pop() {
        match graph.as_sum(x) {
            Some((constant, terms))
                if found.len() + waiting.len() + terms.len() <= LONG_DENOMINATOR =>
            {
                if constant.is_negative() || terms.iter().any(|(c, _)| c.is_negative()) {
                    return Vec::new();
                }
                waiting.extend(terms.iter().map(|(c, y)| (coefficient * *c, *y)));
            }
            _ => found.push((coefficient, x)),
        }
    }
    found
}

/// How often an expression is a term of a sum and of its nested sums. Sums that are shared by several others are
/// counted in each, but examined once.
fn occurrences(
    graph: &Graph,
    sum: ExprId,
    term: ExprId,
    counted: &mut SortedMap<ExprId, usize>,
) -> usize {
    if let Some(count) = counted.get(&sum) {
        return *count;
    }
    let mut count = 0_usize;
    for (_, x) in graph.as_sum(sum).map_or(&[][..], |(_, terms)| terms) {
        let within = occurrences(graph, *x, term, counted);
        count = count.saturating_add(within + usize::from(*x == term));
    }
    *counted.get_or_default(sum) = count;
    count
}

/// A sum without one of its terms, which may stand in a sum within. Sums that stand in several others are looked into once.
fn without(
    graph: &mut Graph,
    sum: ExprId,
    term: ExprId,
    made: &mut SortedMap<ExprId, ExprId>,
) -> ExprId {
    if let Some(known) = made.get(&sum) {
        return *known;
    }
    let Some((constant, terms)) = graph.as_sum(sum) else {
        return sum;
    };
    let mut left = terms.to_vec();
    match left.iter().position(|(_, x)| *x == term) {
        Some(at) => {
            left.remove(at);
        }
        None => {
            for (_, x) in &mut left {
                *x = without(graph, *x, term, made);
            }
        }
    }
    let rest = graph.linear(constant, &left);
    made.insert(sum, rest);
    rest
}

/// The quotient of a product and a product of some of its factors.
pub(super) fn quotient(
    factors: &[(ExprId, i32)],
    by: &[(ExprId, i32)],
) -> Option<Vec<(ExprId, i32)>> {
    let mut rest = factors.to_vec();
    let stands = |m: i32, n: i32| if n > 0 { m >= n } else { m <= n };
    for (x, n) in by {
        let (_, m) = rest.iter_mut().find(|(y, m)| y == x && stands(*m, *n))?;
        *m -= n;
    }
    rest.retain(|(_, m)| *m != 0);
    Some(rest)
}
