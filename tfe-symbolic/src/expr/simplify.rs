//! The constructors of expressions, which are the only simplification rules.
//!
//! | rule | |
//! |---|---|
//! | constants | folded exactly; of functions by the value that the emitted code would compute |
//! | sums | x + 0 → x; like terms collect, c₁x + c₂x → (c₁+c₂)x; a common size of all coefficients comes out, 2x + 2y → 2(x + y); the first coefficient is positive, −x + y → −(x − y) |
//! | nested sums | stay nested, because the inner one may be shared, unless a term cancels: (x + y) − x → y |
//! | c·sin²x·r + c·cos²x·r | → c·r |
//! | r·uⁿ⁺¹ − c·r·uⁿ·w | → r·uⁿ·(u − c·w), where c·w is a term of u, a sum with positive coefficients, and n < 0: 1/√(x² + y²) − x²/√(x² + y²)³ → y²/√(x² + y²)³, and with hypot(x, y) for the root; not beside a power of the root whose exponent is a field |
//! | products | x·0 → 0, x·1 → x; numbers come out in front; x·x → x², xᵃxᵇ → xᵃ⁺ᵇ; (x y)ⁿ → xⁿyⁿ (up to 16 factors) |
//! | numbers | whose product or power leaves the normal numbers of `f64` stay beside their factors: (1e-200 x)² is not 0·x² |
//! | quotients | x/y → x·y⁻¹; x/x → 1; xᵉ/xⁿ → xᵉ⁻ⁿ for a number e; xᵉ⁻¹·x → xᵉ |
//! | powers | x^n a product for whole n; x^(n/2) → √xⁿ |
//! | √ | √x^(2n) → xⁿ; √(x²) → abs x; √(x⁴ + x⁶) → x² √(1 + x²); √(1 − cos x) → √(2 sin²(x/2)), and so for 1 + cos x and cosh x − 1 |
//! | abs, sign | abs(x)^(2n) → x^(2n); abs(x^(2n)) → x^(2n); abs(x² + y²) → x² + y²; abs(abs x) → abs x; abs(√x) → √x; of c x with c > 0 → c abs x, sign x; x·sign x → abs x; abs(x)·sign x → x; abs(x)ᵉ·sign²x → abs(x)ᵉ |
//! | sinh, cosh | sinh x/cosh x → tanh x; a eˣ + a e⁻ˣ → 2 a cosh x; a eˣ − a e⁻ˣ → 2 a sinh x |
//! | acos | acos(cos x) → sign(sin x)·atan2(sin x, cos x) |
//! | parity | sin(−x) → −sin x, cos(−x) → cos x, and so for each even or odd function |
//! | min, max | of x and x → x; hypot(x, 0) → abs x |
//! | select | with equal branches → the branch; with a decided condition → its branch |
//! | sums over ranges | of 0, or over an empty range → 0; numbers come out in front; a number over a literal range → a number |
//!
//! **Domain.** A rule never shrinks where an expression is defined and never changes a defined value (but for rounding). Some extend it:
//! x/x → 1, x·0 → 0 and √x² → x also give a value where the left side has none. That is decided: kernels meet removable 0/0 in derivatives
//! such as those of x²/x, and the continued value is the one wanted.

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::{Function, Parity};
use crate::expr::graph::{ExprId, Graph, Node, SumRange};
use crate::expr::ordered::SortedMap;

/// Products with more factors than this stay nested: opening them would make the derivative of a deep composition
/// quadratic in its depth.
const LONG_PRODUCT: usize = 16;

/// The largest whole exponent of a factor of a product; powers beyond it are calls of `powf`. Passes negate exponents and add
/// those of equal factors in `i32`: two thousand factors, as many as one expression can have, stay far from overflow.
const MAX_EXPONENT: u32 = 1 << 20;

impl Graph {
    /// a + b
    pub fn add(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.linear(Constant::ZERO, &[(Constant::ONE, a), (Constant::ONE, b)])
    }

    /// a − b
    pub fn subtract(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.linear(
            Constant::ZERO,
            &[(Constant::ONE, a), (Constant::MINUS_ONE, b)],
        )
    }

    /// a b
    pub fn multiply(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.product(Constant::ONE, &[(a, 1), (b, 1)])
    }

    /// a / b
    pub fn divide(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.product(Constant::ONE, &[(a, 1), (b, -1)])
    }

    /// −a
    pub fn negate(&mut self, a: ExprId) -> ExprId {
        self.scale(Constant::MINUS_ONE, a)
    }

    /// c a
    pub(crate) fn scale(&mut self, factor: Constant, a: ExprId) -> ExprId {
        self.linear(Constant::ZERO, &[(factor, a)])
    }

    /// base^exponent
    pub fn power(&mut self, base: ExprId, exponent: ExprId) -> ExprId {
        let Some(number) = self.as_constant(exponent) else {
            if self.as_constant(base).is_some_and(Constant::is_one) {
                return base;
            }
            return self.intern(Node::Power { base, exponent });
        };
        let small = |number: Constant| number.as_integer().and_then(|n| i32::try_from(n).ok());
        if let Some(n) = small(number) {
            return self.product(Constant::ONE, &[(base, n)]);
        }
        if let Some(n) = small(number + number) {
            let root = self.call(Function::Sqrt, &[base]);
            return self.product(Constant::ONE, &[(root, n)]);
        }
        if let Some(value) = self.as_constant(base) {
            let folded = value.to_f64().powf(number.to_f64());
            if folded.is_finite() {
                return self.constant(Constant::float(folded));
            }
        }
        self.intern(Node::Power { base, exponent })
    }

    /// A function of as many arguments as it takes.
    pub fn call(&mut self, function: Function, arguments: &[ExprId]) -> ExprId {
        let numbers: Option<Vec<Constant>> = arguments
            .iter()
            .map(|argument| self.as_constant(*argument))
            .collect();
        if let Some(folded) = numbers.and_then(|numbers| fold(function, &numbers)) {
            return self.constant(folded);
        }
        if let [x] = *arguments {
            let (coefficient, _) = self.as_multiple(x);
            if coefficient.is_negative() && function.parity() != Parity::Neither {
                let opposite = self.negate(x);
                let value = self.call_positive(function, opposite);
                return if function.parity() == Parity::Odd {
                    self.negate(value)
                } else {
                    value
                };
            }
            return self.call_positive(function, x);
        }
        if let [x, y] = *arguments {
            let is_zero = |id| self.as_constant(id).is_some_and(Constant::is_zero);
            match function {
                Function::Min | Function::Max if x == y => return x,
                Function::Hypot if is_zero(x) => return self.call(Function::Abs, &[y]),
                Function::Hypot if is_zero(y) => return self.call(Function::Abs, &[x]),
                _ => {}
            }
        }
        self.intern(Node::Call {
            function,
            arguments: arguments.to_vec(),
        })
    }

    fn call_positive(&mut self, function: Function, x: ExprId) -> ExprId {
        if matches!(function, Function::Abs | Function::Sign) {
            let (size, inner) = self.as_multiple(x);
            if inner != x {
                let value = self.call(function, &[inner]);
                return match function {
                    Function::Abs => self.scale(size, value),
                    _ => value,
                };
            }
        }
        match (function, self.node(x)) {
            (Function::Sqrt, Node::Product(_) | Node::Sum { .. }) => {
                if let Some(root) = self.simpler_root(x) {
                    return root;
                }
            }
            (
                Function::Abs,
                Node::Call {
                    function: Function::Abs | Function::Sqrt,
                    ..
                },
            ) => return x,
            (Function::Abs, Node::Product(factors)) if factors.iter().all(|(_, n)| n % 2 == 0) => {
                return x;
            }
            (Function::Abs, Node::Sum { .. }) if self.is_sum_of_squares(x) => return x,
            (Function::Acos, Node::Call { .. }) => {
                if let Some(angle) = self.angle_of_cosine(x) {
                    return angle;
                }
            }
            _ => {}
        }
        self.intern(Node::Call {
            function,
            arguments: vec![x],
        })
    }

    /// `then` where `left comparison right` holds, `otherwise` elsewhere.
    pub fn select(
        &mut self,
        comparison: Comparison,
        left: ExprId,
        right: ExprId,
        then: ExprId,
        otherwise: ExprId,
    ) -> ExprId {
        let decided = match (self.as_constant(left), self.as_constant(right)) {
            (Some(a), Some(b)) => Some(comparison.holds(a.to_f64(), b.to_f64())),
            _ if left == right => Some(comparison.holds(0.0, 0.0)),
            _ => None,
        };
        match decided {
            Some(true) => then,
            Some(false) => otherwise,
            None if then == otherwise => then,
            None => self.intern(Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            }),
        }
    }

    /// Σ body over the range.
    pub fn sum(&mut self, range: SumRange, body: ExprId) -> ExprId {
        let length = match (range.start.as_constant(), range.end.as_constant()) {
            (Some(start), Some(end)) => end.checked_sub(start),
            _ => None,
        };
        if length.is_some_and(|length| length <= 0) {
            return self.constant(Constant::ZERO);
        }
        let (coefficient, body) = self.as_multiple(body);
        if let Some(value) = self.as_constant(body) {
            if value.is_zero() {
                return body;
            }
            if let Some(length) = length {
                return self.constant(coefficient * value * Constant::integer(length));
            }
        }
        let sum = self.intern(Node::Loop { range, body });
        self.scale(coefficient, sum)
    }

    /// c Π xᵢ^nᵢ; this function contains all rules of products.
    pub(crate) fn product(&mut self, coefficient: Constant, factors: &[(ExprId, i32)]) -> ExprId {
        let mut coefficient = coefficient;
        // Constants whose product with the others would leave the range of `f64`.
        let mut apart: Vec<Constant> = Vec::new();
        let mut collected: SortedMap<ExprId, i64> = SortedMap::new();
        let mut waiting: Vec<(ExprId, i64)> =
            factors.iter().map(|(x, n)| (*x, i64::from(*n))).collect();
        while let Some((x, n)) = waiting.pop() {
            let small = i32::try_from(n).ok();
            let (multiple, inner) = self.as_multiple(x);
            match self.node(inner) {
                _ if n == 0 => {}
                Node::Constant(value) => match small.and_then(|n| value.powi(n)) {
                    Some(value) => match coefficient.product_in_range(value) {
                        Some(product) => coefficient = product,
                        None => apart.push(value),
                    },
                    None => *collected.get_or_default(inner) += n,
                },
                _ if inner != x => {
                    let power = small.and_then(|n| multiple.powi_in_range(n));
                    match power.and_then(|power| coefficient.product_in_range(power)) {
                        Some(product) => {
                            coefficient = product;
                            waiting.push((inner, n));
                        }
                        None => *collected.get_or_default(x) += n,
                    }
                }
                Node::Product(inner) if inner.len() <= LONG_PRODUCT => waiting.extend(
                    inner
                        .iter()
                        .map(|(x, m)| (*x, i64::from(*m).saturating_mul(n))),
                ),
                _ => {
                    let total = collected.get_or_default(inner);
                    *total = total.saturating_add(n);
                }
            }
            if waiting.is_empty() {
                coefficient = coefficient * self.fold_powers(&mut collected, &mut waiting);
            }
        }
        collected.retain(|_, n| *n != 0);
        if coefficient.is_zero() {
            return self.constant(Constant::ZERO);
        }
        let mut factors: Vec<(ExprId, i32)> = Vec::with_capacity(collected.len());
        for (x, n) in collected {
            match i32::try_from(n) {
                Ok(n) if n.unsigned_abs() <= MAX_EXPONENT => factors.push((x, n)),
                _ => {
                    let exponent = self.constant(Constant::integer(n));
                    factors.push((self.intern(Node::Power { base: x, exponent }), 1));
                }
            }
        }
        factors.sort_unstable();
        let product = match factors[..] {
            [] => {
                let number = apart.into_iter().fold(coefficient, |a, b| a * b);
                return self.constant(number);
            }
            [(x, 1)] => x,
            // As it is: there are no terms to collect.
            _ if coefficient.is_one() && apart.is_empty() => {
                return self.intern(Node::Product(factors));
            }
            _ => self.intern(Node::Product(factors)),
        };
        let scaled = self.scale(coefficient, product);
        apart.into_iter().fold(scaled, |x, c| self.scale(c, x))
    }
}

/// The value of a function of numbers, where it is finite.
fn fold(function: Function, arguments: &[Constant]) -> Option<Constant> {
    match (function, arguments) {
        (Function::Sqrt, [x]) if x.exact_sqrt().is_some() => x.exact_sqrt(),
        (Function::Abs, [x]) => Some(x.abs()),
        (Function::Min | Function::Max, [x, y]) => {
            let first = function.takes_first().holds(x.to_f64(), y.to_f64());
            Some(if first { *x } else { *y })
        }
        _ => {
            let values: Vec<f64> = arguments.iter().map(|argument| argument.to_f64()).collect();
            let value = function.evaluate(&values);
            value.is_finite().then(|| Constant::float(value))
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::expr::differentiate::derivative;
    use crate::expr::input::{Affine, IndexSymbol, Input, LoopVariable};

    /// A graph with x, y, z.
    pub(crate) fn variables() -> (Graph, ExprId, ExprId, ExprId) {
        let mut graph = Graph::default();
        let [x, y, z] = ["x", "y", "z"].map(|name| graph.input(Input::Parameter(name.to_owned())));
        (graph, x, y, z)
    }

    pub(crate) fn number(graph: &mut Graph, text: &str) -> ExprId {
        let value = Constant::parse(text).expect("a literal of the test");
        graph.constant(value)
    }

    #[test]
    fn constants_fold_exactly() {
        let mut g = Graph::default();
        let (one, three, tenth) = (g.integer(1), g.integer(3), number(&mut g, "0.1"));
        let third = g.divide(one, three);
        let sum = g.add(third, third);
        let sum = g.add(sum, third);
        assert_eq!(sum, one);
        let thrice = g.multiply(three, tenth);
        assert_eq!(thrice, number(&mut g, "0.3"));
        let zero = g.integer(0);
        assert_eq!(g.call(Function::Cos, &[zero]), one);
        let nine = g.integer(9);
        assert_eq!(g.call(Function::Sqrt, &[nine]), three);
        let minus = g.negate(one);
        let root = g.call(Function::Sqrt, &[minus]);
        assert_eq!(
            g.as_constant(root),
            None,
            "NaN is left to the running kernel"
        );
    }

    #[test]
    fn zero_and_one_vanish() {
        let (mut g, x, ..) = variables();
        let (zero, one) = (g.integer(0), g.integer(1));
        assert_eq!(g.add(x, zero), x);
        assert_eq!(g.multiply(x, one), x);
        assert_eq!(g.multiply(x, zero), zero);
        assert_eq!(g.subtract(x, x), zero);
        assert_eq!(g.power(x, zero), one);
        assert_eq!(g.power(x, one), x);
        assert_eq!(g.power(one, x), one);
    }

    #[test]
    fn like_terms_collect() {
        let (mut g, x, y, _) = variables();
        let two = g.integer(2);
        let double = g.add(x, x);
        assert_eq!(double, g.multiply(two, x));
        let (a, b) = (g.multiply(x, y), g.multiply(y, x));
        let sum = g.add(a, b);
        assert_eq!(sum, g.multiply(two, a));
    }

    #[test]
    fn a_common_size_comes_out_of_sums() {
        let (mut g, x, y, _) = variables();
        let two = g.integer(2);
        let (a, b) = (g.multiply(two, x), g.multiply(two, y));
        let (sum, inner) = (g.add(a, b), g.add(x, y));
        assert_eq!(sum, g.multiply(two, inner));
        let (forth, back) = (g.subtract(x, y), g.subtract(y, x));
        assert_eq!(back, g.negate(forth));
    }

    #[test]
    fn nested_sums_stay_unless_a_term_cancels() {
        let (mut g, x, y, z) = variables();
        let inner = g.add(x, y);
        let outer = g.add(inner, z);
        assert_eq!(g.as_sum(outer).map(|(_, terms)| terms.len()), Some(2));
        assert_eq!(g.subtract(inner, x), y);
        let one = g.integer(1);
        let shifted = g.add(x, one);
        assert_eq!(g.subtract(shifted, one), x);
    }

    #[test]
    fn squares_of_sine_and_cosine_join() {
        let (mut g, x, y, _) = variables();
        let (sine, cosine) = (g.call(Function::Sin, &[x]), g.call(Function::Cos, &[x]));
        let (a, b) = (g.multiply(y, sine), g.multiply(y, cosine));
        let (a, b) = (g.multiply(a, a), g.multiply(b, b));
        let sum = g.add(a, b);
        assert_eq!(sum, g.multiply(y, y));
        let difference = g.subtract(a, b);
        assert_eq!(
            g.inputs_of(difference).len(),
            2,
            "only equal coefficients join"
        );
    }

    #[test]
    fn second_derivatives_of_distances_do_not_cancel() {
        let (mut g, x, y, z) = variables();
        let [x2, y2, z2] = [x, y, z].map(|x| g.multiply(x, x));
        let second = |g: &mut Graph, square: ExprId| {
            let distance = g.call(Function::Sqrt, &[square]);
            let by = Input::Parameter("x".to_owned());
            let first = derivative(g, distance, &by);
            derivative(g, first, &by)
        };
        // ∂²√u/∂x² = v/√u³
        let expected = |g: &mut Graph, u: ExprId, v: ExprId| {
            let root = g.call(Function::Sqrt, &[u]);
            let cube = g.multiply(u, root);
            g.divide(v, cube)
        };
        let flat = g.add(x2, y2);
        assert_eq!(second(&mut g, flat), expected(&mut g, flat, y2));
        let space = g.add(flat, z2);
        let rest = g.add(z2, y2);
        assert_eq!(second(&mut g, space), expected(&mut g, space, rest));
        // Nothing cancels in the height over a sphere.
        let below = g.subtract(z2, x2);
        let curvature = second(&mut g, below);
        assert_ne!(curvature, expected(&mut g, below, z2));
        assert_eq!(g.inputs_of(curvature).len(), 2);
    }

    #[test]
    fn factors_collect() {
        let (mut g, x, y, _) = variables();
        let (two, three) = (g.integer(2), g.integer(3));
        let square = g.multiply(x, x);
        assert_eq!(square, g.power(x, two));
        let cube = g.multiply(square, x);
        assert_eq!(cube, g.power(x, three));
        let product = g.multiply(x, y);
        let expected = {
            let y2 = g.power(y, two);
            g.multiply(square, y2)
        };
        assert_eq!(g.power(product, two), expected);
    }

    #[test]
    fn quotients_cancel() {
        let (mut g, x, y, _) = variables();
        let one = g.integer(1);
        assert_eq!(g.divide(x, x), one);
        let quotient = g.divide(x, y);
        assert_eq!(g.multiply(quotient, y), x);
        let zero = g.integer(0);
        let infinite = g.divide(x, zero);
        assert_eq!(
            g.as_constant(infinite),
            None,
            "division by zero is left to the running kernel"
        );
    }

    #[test]
    fn negation_is_an_involution_and_moves_out_of_functions() {
        let (mut g, x, y, _) = variables();
        let minus = g.negate(x);
        assert_eq!(g.negate(minus), x);
        let (sine, cosine) = (g.call(Function::Sin, &[x]), g.call(Function::Cos, &[x]));
        assert_eq!(g.call(Function::Cos, &[minus]), cosine);
        assert_eq!(g.call(Function::Sin, &[minus]), g.negate(sine));
        let (forth, back) = (g.subtract(x, y), g.subtract(y, x));
        let (a, b) = (
            g.call(Function::Sin, &[forth]),
            g.call(Function::Sin, &[back]),
        );
        assert_eq!(b, g.negate(a));
    }

    #[test]
    fn roots_and_powers() {
        let (mut g, x, ..) = variables();
        let two = g.integer(2);
        let (half, three_halves) = (number(&mut g, "0.5"), number(&mut g, "1.5"));
        let root = g.call(Function::Sqrt, &[x]);
        assert_eq!(g.power(x, half), root);
        assert_eq!(g.power(root, two), x);
        assert_eq!(g.power(x, three_halves), g.multiply(x, root));
        let square = g.power(x, two);
        let size = g.call(Function::Abs, &[x]);
        assert_eq!(g.call(Function::Sqrt, &[square]), size);
        assert_eq!(g.power(size, two), square);
        assert_eq!(g.call(Function::Abs, &[size]), size);
        assert_eq!(g.call(Function::Abs, &[square]), square);
        let fourth = g.multiply(square, square);
        assert_eq!(g.call(Function::Sqrt, &[fourth]), square);
        assert_eq!(g.call(Function::Abs, &[root]), root);
    }

    #[test]
    fn numbers_that_would_vanish_stay() {
        let (mut g, x, ..) = variables();
        let (small, two) = (number(&mut g, "1e-200"), g.integer(2));
        let scaled = g.multiply(small, x);
        let square = g.power(scaled, two);
        assert_eq!(*g.node(square), Node::Product(vec![(scaled, 2)]));
        let again = g.multiply(small, scaled);
        let terms = vec![(Constant::float(1e-200), scaled)];
        let constant = Constant::ZERO;
        assert_eq!(*g.node(again), Node::Sum { constant, terms });
        assert_eq!(g.divide(square, square), g.integer(1));
        let half = number(&mut g, "0.5");
        let halved = g.multiply(half, square);
        assert_eq!(g.as_multiple(halved).1, square);
    }

    #[test]
    fn functions_of_two_arguments() {
        let (mut g, x, y, _) = variables();
        let zero = g.integer(0);
        assert_eq!(g.call(Function::Min, &[x, x]), x);
        let size = g.call(Function::Abs, &[x]);
        assert_eq!(g.call(Function::Hypot, &[x, zero]), size);
        assert_eq!(g.call(Function::Hypot, &[zero, x]), size);
        assert_ne!(
            g.call(Function::Hypot, &[x, y]),
            g.call(Function::Hypot, &[y, x])
        );
    }

    #[test]
    fn decided_conditions_choose() {
        let (mut g, x, y, z) = variables();
        let (one, two) = (g.integer(1), g.integer(2));
        assert_eq!(g.select(Comparison::Less, one, two, x, y), x);
        assert_eq!(g.select(Comparison::Less, z, z, x, y), y);
        assert_eq!(g.select(Comparison::LessOrEqual, z, z, x, y), x);
        assert_eq!(g.select(Comparison::Less, x, y, z, z), z);
    }

    #[test]
    fn sums_over_ranges() {
        let (mut g, x, ..) = variables();
        let variable = LoopVariable(0);
        let range = |end: i64| SumRange {
            variable,
            start: Affine::constant(0),
            end: Affine::constant(end),
        };
        let (zero, two) = (g.integer(0), g.integer(2));
        assert_eq!(g.sum(range(0), x), zero);
        assert_eq!(g.sum(range(3), zero), zero);
        assert_eq!(g.sum(range(3), two), g.integer(6));
        let element = g.input(Input::Coordinate(Affine::symbol(IndexSymbol::Loop(
            variable,
        ))));
        let double = g.multiply(two, element);
        let (sum, inner) = (g.sum(range(3), double), g.sum(range(3), element));
        assert_eq!(sum, g.multiply(two, inner));
    }

    #[test]
    fn huge_exponents_neither_overflow_nor_vanish() {
        let (mut g, x, ..) = variables();
        let large = g.integer(i64::from(i32::MAX));
        let power = g.power(x, large);
        let square = g.multiply(power, power);
        assert_ne!(square, power);
        let one = g.integer(1);
        assert_eq!(g.divide(square, square), one);
        for exponent in [i64::from(i32::MIN), i64::from(i32::MIN) - 1, i64::MIN] {
            let exponent = g.integer(exponent);
            let power = g.power(x, exponent);
            let base = Node::Power { base: x, exponent };
            assert_eq!(*g.node(power), base);
        }
    }
}
