//! What an element does not leave: bounds of its polynomials (T-128).

use super::DenseElement;
use crate::basis::MAX_NODES;
use crate::dual::Dual;
use crate::enclosure::Enclosure;
use crate::model::Form;
use crate::real::Real;

/// What outputs are functions of, along an element or a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arguments<R, const N: usize> {
    /// The time.
    pub t: R,
    /// Coordinates.
    pub q: [R; N],
    /// Velocities: the derivative of the coordinates' polynomial.
    pub v: [R; N],
    /// Momenta.
    pub p: [R; N],
}

/// No less than |∫₀^τ P_k(2σ − 1) dσ|: 1/(2k + 1), for |P_{k+1} − P_{k−1}| ≤ 2.
const MOST_OF_INTEGRALS: [f64; MAX_NODES] = {
    let mut most = [1.0; MAX_NODES];
    let mut k = 1;
    while k < MAX_NODES {
        most[k] = 1.0 / (2 * k + 1) as f64;
        k += 1;
    }
    most
};

/// Powers of y ∈ [−1, 1].
fn power(exponent: usize) -> Enclosure {
    match exponent {
        0 => Enclosure::from_f64(1.0),
        even if even % 2 == 0 => Enclosure::between(0.0, 1.0),
        _ => Enclosure::between(-1.0, 1.0),
    }
}

/// Legendre polynomials of τ = m + r y as polynomials of y, with the sizes of what was added up for each coefficient.
struct Expansion {
    radius: f64,
    /// Coefficients, their sizes, and the same one degree lower.
    here: [[f64; MAX_NODES]; 2],
    before: [[f64; MAX_NODES]; 2],
    degree: usize,
}

impl Expansion {
    /// That of degree zero, over a part of the element.
    fn over((from, to): (f64, f64)) -> (f64, Self) {
        let mut one = [[0.0; MAX_NODES]; 2];
        (one[0][0], one[1][0]) = (1.0, 1.0);
        let expansion = Self {
            radius: 0.5 * (to - from),
            here: one,
            before: [[0.0; MAX_NODES]; 2],
            degree: 0,
        };
        (0.5 * (from + to), expansion)
    }

    /// The next: (n + 1) P_{n+1} = (2n + 1) x P_n − n P_{n−1} with x = 2m − 1 + 2 r y.
    fn raise(&mut self, middle: f64) {
        let n = self.degree as f64;
        let (place, slope) = (2.0 * middle - 1.0, 2.0 * self.radius);
        let signed = [(place, -n), (place.abs(), n)];
        for (row, (place, sign)) in signed.into_iter().enumerate() {
            let (here, before) = (self.here[row], self.before[row]);
            for j in 0..=self.degree + 1 {
                let lower = if j == 0 { 0.0 } else { here[j - 1] };
                let product = (2.0 * n + 1.0) * (place * here[j] + slope * lower);
                self.here[row][j] = (product + sign * before[j]) / (n + 1.0);
            }
            self.before[row] = here;
        }
        self.degree += 1;
    }
}

/// Σ c_j yʲ for each coordinate.
struct Powers<const N: usize> {
    coefficients: [[Enclosure; N]; MAX_NODES],
    count: usize,
}

impl<const N: usize> Powers<N> {
    /// The polynomial with given Legendre coefficients, over a part of the element.
    fn of(rates: &[[f64; N]], part: (f64, f64)) -> Self {
        let count = rates.len();
        let (mut values, mut sizes) = ([[0.0; N]; MAX_NODES], [[0.0; N]; MAX_NODES]);
        let (middle, mut expansion) = Expansion::over(part);
        for (k, rate) in rates.iter().enumerate() {
            if k > 0 {
                expansion.raise(middle);
            }
            for j in 0..=k {
                for a in 0..N {
                    values[j][a] += expansion.here[0][j] * rate[a];
                    sizes[j][a] += expansion.here[1][j] * rate[a].abs();
                }
            }
        }
        // Each of the sums and of the recurrences has some four roundings a degree.
        let rounding = 8.0 * f64::EPSILON * (count + 1) as f64;
        let mut coefficients = [[Enclosure::ZERO; N]; MAX_NODES];
        for j in 0..count {
            for a in 0..N {
                let off = rounding * sizes[j][a];
                coefficients[j][a] = Enclosure::between(values[j][a] - off, values[j][a] + off);
            }
        }
        Self {
            coefficients,
            count,
        }
    }

    /// Σ w_j c_j y^{j + shift}, without the terms whose power would be negative.
    fn sum(&self, a: usize, shift: isize, weight: impl Fn(usize) -> f64) -> Enclosure {
        let mut sum = Enclosure::ZERO;
        for (j, row) in self.coefficients[..self.count].iter().enumerate() {
            if let Some(exponent) = j.checked_add_signed(shift) {
                let factor = Enclosure::from_f64(weight(j)) * power(exponent);
                sum += row[a] * factor;
            }
        }
        sum
    }

    /// Polynomial and derivative by τ.
    fn rate(&self, a: usize, radius: f64) -> Dual<Enclosure> {
        let value = self.sum(a, 0, |_| 1.0);
        Dual::new(value, self.sum(a, -1, |j| j as f64 / radius))
    }

    /// The integral from the middle on, and the polynomial.
    fn integral(&self, a: usize, radius: f64) -> Dual<Enclosure> {
        let value = self.sum(a, 1, |j| radius / (j + 1) as f64);
        Dual::new(value, self.sum(a, 0, |_| 1.0))
    }
}

impl<const N: usize> DenseElement<N> {
    /// Bounds of what outputs of a `form` are functions of, all along an element of one [piece](Self::pieces): q ∈ [q₀, q₁] ± Σ |r_k|/(2k + 1) with the coefficients
    /// r_k of the rate, k ≥ 1. Quick, and wide where the motion bends. Of velocities and momenta those that the form does not need are not looked at.
    #[must_use]
    #[inline]
    pub fn bounds(&self, form: Form) -> Arguments<Enclosure, N> {
        /// For what is rounded in sums and polynomials.
        const ROUNDING: f64 = 16.0 * f64::EPSILON;

        let (from, to) = self.times;
        let (rates, forces) = self.rates.split_at(self.rates.len() / 2);
        let along = |rates: &[[f64; N]], a: usize, ends: (f64, f64)| {
            let mut radius = ROUNDING * (ends.0.abs() + ends.1.abs());
            if let Some((_, rates)) = rates.split_first() {
                for (rate, most) in rates.iter().zip(&MOST_OF_INTEGRALS[1..]) {
                    radius += rate[a].abs() * most;
                }
            }
            let (low, high) = (ends.0.min(ends.1), ends.0.max(ends.1));
            Enclosure::between(low - radius, high + radius)
        };
        let mut bounds = Arguments {
            t: Enclosure::between(from, to),
            q: [Enclosure::ZERO; N],
            v: [Enclosure::ZERO; N],
            p: [Enclosure::ZERO; N],
        };
        let by_time = 1.0 / (to - from);
        for a in 0..N {
            bounds.q[a] = along(rates, a, (self.start.q[a], self.end.q[a]));
            match form {
                Form::Lagrangian => {
                    if let Some((mean, others)) = rates.split_first() {
                        let sum = others.iter().fold(0.0, |sum, rate| sum + rate[a].abs());
                        let radius = sum + ROUNDING * (sum + mean[a].abs());
                        let ends = ((mean[a] - radius) * by_time, (mean[a] + radius) * by_time);
                        bounds.v[a] = Enclosure::between(ends.0, ends.1);
                    }
                }
                Form::Hamiltonian => {
                    bounds.p[a] = along(forces, a, (self.start.p[a], self.end.p[a]));
                }
            }
        }
        bounds
    }

    /// Bounds over a part of an element of one [piece](Self::pieces), from τ to τ, and of the derivatives by τ: by Taylor's polynomials about the middle, whose width
    /// falls with that of the part.
    #[must_use]
    pub fn bounds_over(&self, part: (f64, f64)) -> Arguments<Dual<Enclosure>, N> {
        let (from, to) = part;
        let (middle, radius) = (0.5 * (from + to), 0.5 * (to - from));
        let length = self.times.1 - self.times.0;
        let time = |tau: f64| {
            Enclosure::from_f64(self.times.0)
                + Enclosure::from_f64(tau) * Enclosure::from_f64(length)
        };
        let (rates, forces) = self.rates.split_at(self.rates.len() / 2);
        let (rates, forces) = (Powers::of(rates, part), Powers::of(forces, part));
        let centre = self.at(middle);
        let zero = Dual::new(Enclosure::ZERO, Enclosure::ZERO);
        let mut bounds = Arguments {
            t: Dual::new(time(from).hull(time(to)), Enclosure::from_f64(length)),
            q: [zero; N],
            v: [zero; N],
            p: [zero; N],
        };
        let about = |value: f64, start: f64| {
            let rounding = 16.0 * f64::EPSILON * (value.abs() + start.abs());
            Enclosure::between(value - rounding, value + rounding)
        };
        let by_time = Enclosure::from_f64(1.0) / Enclosure::from_f64(length);
        for a in 0..N {
            let (q, p) = (rates.integral(a, radius), forces.integral(a, radius));
            let q_centre = about(centre.q[a], self.start.q[a]);
            let p_centre = about(centre.p[a], self.start.p[a]);
            bounds.q[a] = Dual::new(q_centre + q.value, q.slope);
            bounds.p[a] = Dual::new(p_centre + p.value, p.slope);
            let rate = rates.rate(a, radius);
            bounds.v[a] = Dual::new(rate.value * by_time, rate.slope * by_time);
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::State;

    /// Elements of random coefficients: what they do in a part is within the bounds of that part, and these are not much wider where parts are short.
    #[test]
    fn elements_stay_within_their_bounds() {
        let mut seed = 3_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for count in [0, 1, 2, 4, 9, 12] {
            let mut rates = vec![[0.0]; 2 * count];
            for (k, rate) in rates.iter_mut().enumerate() {
                rate[0] = 2.0_f64.powi(-((k % count) as i32)) * random();
            }
            let mut element = DenseElement::constant(
                3.0,
                3.5,
                State {
                    q: [random()],
                    p: [1e3 * random()],
                },
            );
            element.rates = rates.into();
            if count > 0 {
                element.end = State {
                    q: [element.start.q[0] + element.rates[0][0]],
                    p: [element.start.p[0] + element.rates[count][0]],
                };
            }
            let within = |bounds: Enclosure, value: f64| {
                assert!(
                    bounds.low() <= value && value <= bounds.high(),
                    "{value} {bounds:?}"
                );
            };
            let whole = element.bounds(Form::Lagrangian);
            let of_momenta = element.bounds(Form::Hamiltonian);
            for (from, to) in [(0.0, 1.0), (0.0, 0.25), (0.7, 0.8), (0.3, 0.300_001)] {
                let part = element.bounds_over((from, to));
                for k in 0..=50 {
                    let tau = from + (to - from) * f64::from(k) / 50.0;
                    let time = 3.0 + 0.5 * tau;
                    let (state, v) = (element.at(tau), element.velocity_at_time(time));
                    for (bounds, all, value) in [
                        (part.t, whole.t, time),
                        (part.q[0], whole.q[0], state.q[0]),
                        (part.v[0], whole.v[0], v[0]),
                        (part.p[0], of_momenta.p[0], state.p[0]),
                    ] {
                        within(bounds.value, value);
                        within(all, value);
                    }
                    within(part.q[0].slope, 0.5 * v[0]);
                    within(part.t.slope, 0.5);
                }
                let width = |bounds: Enclosure| bounds.high() - bounds.low();
                let most = 20.0 * (to - from) + 1e-10;
                assert!(width(part.q[0].value) < most && width(part.v[0].value) < 20.0 * most);
            }
        }
    }
}
