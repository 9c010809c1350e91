//! Quadrature rules on the unit interval, computed to full double precision.
//!
//! Nodes are found by Newton's method on Legendre polynomials in twice the working precision. Every function is
//! `const`, so that a solver for one element holds its rule as a constant.

use crate::basis::next_legendre;
use crate::double_double::DoubleDouble;

/// The largest number of points of a rule.
pub const MAX_POINTS: usize = 32;

/// Nodes and weights with ∫₀¹ f dτ ≈ Σ wᵢ f(τᵢ); the nodes ascend.
///
/// # Example
/// ```
/// use tfe_runtime::quadrature::Quadrature;
///
/// const RULE: Quadrature = Quadrature::gauss(3);
/// let fifth: f64 = (0..RULE.len()).map(|i| RULE.weight(i) * RULE.node(i).powi(4)).sum();
/// assert!((fifth - 0.2).abs() < 1e-16);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadrature {
    count: usize,
    nodes: [DoubleDouble; MAX_POINTS],
    weights: [DoubleDouble; MAX_POINTS],
}

impl Quadrature {
    const EMPTY: Self = Self {
        count: 0,
        nodes: [DoubleDouble::ZERO; MAX_POINTS],
        weights: [DoubleDouble::ZERO; MAX_POINTS],
    };

    /// Gauss–Legendre: exact for degree 2k − 1. `points` is clamped to 1..=32.
    #[must_use]
    pub const fn gauss(points: usize) -> Self {
        let k = clamp(points, 1);
        let mut rule = Self {
            count: k,
            ..Self::EMPTY
        };
        let mut i = 0;
        // The lower half and its mirror image: the rule is symmetric to the last digit.
        while i < k.div_ceil(2) {
            let angle = PI * (4 * i + 3) as f64 / (4 * k + 2) as f64;
            let x = if 2 * i + 1 == k {
                DoubleDouble::ZERO
            } else {
                root(Polynomial::Legendre, k, -cosine(angle))
            };
            // w = 1/((1 − x²) P'²) on the unit interval.
            let slope = Legendre::at(k, x).slope(k, x);
            let bulge = DoubleDouble::ONE.minus(x.times(x));
            let weight = DoubleDouble::ONE.over(bulge.times(slope.times(slope)));
            rule.set(i, x, weight);
            rule.set(k - 1 - i, x.negated(), weight);
            i += 1;
        }
        rule
    }

    /// Gauss–Lobatto, both ends included: exact for degree 2k − 3. `points` is clamped to 2..=32.
    #[must_use]
    pub const fn lobatto(points: usize) -> Self {
        let k = clamp(points, 2);
        let degree = k - 1;
        let mut rule = Self {
            count: k,
            ..Self::EMPTY
        };
        let mut i = 0;
        while i < k.div_ceil(2) {
            let x = if i == 0 {
                DoubleDouble::ONE.negated()
            } else if 2 * i + 1 == k {
                DoubleDouble::ZERO
            } else {
                let angle = PI * i as f64 / degree as f64;
                root(Polynomial::Slope, degree, -cosine(angle))
            };
            // w = 1/(k (k − 1) P_{k−1}²).
            let value = Legendre::at(degree, x).value;
            let product = DoubleDouble::integer(k * degree).times(value.times(value));
            let weight = DoubleDouble::ONE.over(product);
            rule.set(i, x, weight);
            rule.set(k - 1 - i, x.negated(), weight);
            i += 1;
        }
        rule
    }

    /// Right Radau, the end included: exact for degree 2k − 2. `points` is clamped to 1..=32.
    #[must_use]
    pub const fn radau(points: usize) -> Self {
        let k = clamp(points, 1);
        let mut rule = Self {
            count: k,
            ..Self::EMPTY
        };
        let square = DoubleDouble::integer(k * k);
        rule.set(k - 1, DoubleDouble::ONE, DoubleDouble::ONE.over(square));
        let mut i = 1;
        while i < k {
            let angle = 2.0 * PI * i as f64 / (2 * k - 1) as f64;
            let x = root(Polynomial::Radau, k, cosine(angle));
            // w = (1 + x)/(2 k² P_{k−1}²).
            let before = Legendre::at(k, x).before;
            let product = square.times(before.times(before));
            rule.set(k - 1 - i, x, DoubleDouble::ONE.plus(x).half().over(product));
            i += 1;
        }
        rule
    }

    /// Stores a node given on [−1, 1].
    const fn set(&mut self, index: usize, x: DoubleDouble, weight: DoubleDouble) {
        self.nodes[index] = DoubleDouble::ONE.plus(x).half();
        self.weights[index] = weight;
    }

    /// The number of points.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Always false: a rule has at least one point.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Node τᵢ ∈ [0, 1], rounded to the nearest double; zero for larger indices.
    #[must_use]
    pub const fn node(&self, index: usize) -> f64 {
        if index < MAX_POINTS {
            self.nodes[index].high
        } else {
            0.0
        }
    }

    /// Weight wᵢ, rounded to the nearest double; the weights add up to one. Zero for larger indices.
    #[must_use]
    pub const fn weight(&self, index: usize) -> f64 {
        if index < MAX_POINTS {
            self.weights[index].high
        } else {
            0.0
        }
    }

    /// The rounding error of [`node`](Self::node): the node to twice the working precision is the sum of both.
    #[must_use]
    pub const fn node_correction(&self, index: usize) -> f64 {
        if index < MAX_POINTS {
            self.nodes[index].low
        } else {
            0.0
        }
    }

    /// The rounding error of [`weight`](Self::weight): the weight to twice the working precision is the sum of both.
    #[must_use]
    pub const fn weight_correction(&self, index: usize) -> f64 {
        if index < MAX_POINTS {
            self.weights[index].low
        } else {
            0.0
        }
    }

    pub(crate) const fn exact_node(&self, index: usize) -> DoubleDouble {
        self.nodes[index]
    }

    pub(crate) const fn exact_weight(&self, index: usize) -> DoubleDouble {
        self.weights[index]
    }
}

const PI: f64 = core::f64::consts::PI;

const fn clamp(points: usize, least: usize) -> usize {
    if points < least {
        least
    } else if points > MAX_POINTS {
        MAX_POINTS
    } else {
        points
    }
}

/// cos x on [0, π] by its series, accurate enough for the start of Newton's method.
const fn cosine(x: f64) -> f64 {
    if x > 0.5 * PI {
        return -cosine(PI - x);
    }
    let (mut term, mut sum, mut j) = (1.0, 1.0, 1.0);
    while j < 24.0 {
        term *= -x * x / (j * (j + 1.0));
        sum += term;
        j += 2.0;
    }
    sum
}

/// P_k and P_{k−1} at one place of [−1, 1].
struct Legendre {
    value: DoubleDouble,
    before: DoubleDouble,
}

impl Legendre {
    const fn at(degree: usize, x: DoubleDouble) -> Self {
        let (mut before, mut value) = (DoubleDouble::ZERO, DoubleDouble::ONE);
        let mut j = 0;
        while j < degree {
            let next = next_legendre(j, x, value, before);
            before = value;
            value = next;
            j += 1;
        }
        Self { value, before }
    }

    /// P'_k = k (P_{k−1} − x P_k)/(1 − x²), inside the interval.
    const fn slope(&self, degree: usize, x: DoubleDouble) -> DoubleDouble {
        DoubleDouble::integer(degree)
            .times(self.before.minus(x.times(self.value)))
            .over(DoubleDouble::ONE.minus(x.times(x)))
    }
}

/// The polynomial whose root is sought.
#[derive(Clone, Copy)]
enum Polynomial {
    /// P_k
    Legendre,
    /// P'_k
    Slope,
    /// P_k − P_{k−1}
    Radau,
}

/// The root next to `start`, by Newton's method.
const fn root(polynomial: Polynomial, degree: usize, start: f64) -> DoubleDouble {
    let mut x = DoubleDouble::new(start);
    let k = DoubleDouble::integer(degree);
    let mut round = 0;
    // The initial guesses have errors of at most 10⁻², so that six doublings of the correct digits reach 10⁻³².
    while round < 7 {
        let legendre = Legendre::at(degree, x);
        let slope = legendre.slope(degree, x);
        let step = match polynomial {
            Polynomial::Legendre => legendre.value.over(slope),
            Polynomial::Slope => {
                // (1 − x²) P'' = 2 x P' − k (k + 1) P
                let bend = DoubleDouble::integer(2)
                    .times(x.times(slope))
                    .minus(DoubleDouble::integer(degree * (degree + 1)).times(legendre.value))
                    .over(DoubleDouble::ONE.minus(x.times(x)));
                slope.over(bend)
            }
            Polynomial::Radau => {
                // P'_{k−1} = x P'_k − k P_k
                let before = x.times(slope).minus(k.times(legendre.value));
                legendre
                    .value
                    .minus(legendre.before)
                    .over(slope.minus(before))
            }
        };
        x = x.minus(step);
        if step.magnitude() < 1e-20 {
            break;
        }
        round += 1;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error of the moments ∫τᵐ = 1/(m + 1) up to `degree`, in twice the precision.
    fn moment_error(rule: &Quadrature, degree: usize) -> f64 {
        let mut worst = 0.0_f64;
        for m in 0..=degree {
            let mut sum = DoubleDouble::ZERO;
            for i in 0..rule.len() {
                let mut term = rule.exact_weight(i);
                for _ in 0..m {
                    term = term.times(rule.exact_node(i));
                }
                sum = sum.plus(term);
            }
            let exact = DoubleDouble::ONE.over(DoubleDouble::integer(m + 1));
            let off = sum.minus(exact).magnitude();
            assert!(off.is_finite(), "{m}: {off}");
            worst = worst.max(off);
        }
        worst
    }

    // Sixty-four products and additions of unit 2⁻¹⁰⁴ ≈ 5e-32.
    const TOLERANCE: f64 = 1e-29;

    #[test]
    fn gauss_is_exact_to_degree_2k_minus_1() {
        for k in 1..=MAX_POINTS {
            let rule = Quadrature::gauss(k);
            assert!(moment_error(&rule, 2 * k - 1) < TOLERANCE, "{k} points");
        }
    }

    #[test]
    fn lobatto_is_exact_to_degree_2k_minus_3() {
        for k in 2..=MAX_POINTS {
            let rule = Quadrature::lobatto(k);
            assert!(moment_error(&rule, 2 * k - 3) < TOLERANCE, "{k} points");
            assert_eq!((rule.node(0), rule.node(k - 1)), (0.0, 1.0));
        }
    }

    #[test]
    fn radau_is_exact_to_degree_2k_minus_2() {
        for k in 1..=MAX_POINTS {
            let rule = Quadrature::radau(k);
            assert!(moment_error(&rule, 2 * k - 2) < TOLERANCE, "{k} points");
            assert_eq!(rule.node(k - 1), 1.0);
        }
    }

    #[test]
    fn nodes_ascend_and_weights_are_positive() {
        for k in 2..=MAX_POINTS {
            for rule in [
                Quadrature::gauss(k),
                Quadrature::lobatto(k),
                Quadrature::radau(k),
            ] {
                for i in 0..k {
                    assert!(rule.weight(i) > 0.0);
                    assert!(
                        i == 0 || rule.node(i) > rule.node(i - 1),
                        "{k} points, node {i}"
                    );
                }
            }
        }
    }

    #[test]
    fn known_rules() {
        let gauss = Quadrature::gauss(2);
        // ½ − √3/6, rounded once.
        assert_eq!(gauss.node(0), 0.211_324_865_405_187_1);
        assert_eq!(gauss.weight(1), 0.5);
        let radau = Quadrature::radau(2);
        assert_eq!((radau.node(0), radau.weight(0)), (1.0 / 3.0, 0.75));
    }

    #[test]
    fn out_of_range_counts_are_clamped() {
        assert_eq!(Quadrature::gauss(0).len(), 1);
        assert_eq!(Quadrature::lobatto(1).len(), 2);
        assert_eq!(Quadrature::radau(99).len(), MAX_POINTS);
    }

    #[test]
    fn a_rule_is_a_constant() {
        const RULE: Quadrature = Quadrature::gauss(8);
        assert_eq!(RULE, Quadrature::gauss(8));
    }
}
