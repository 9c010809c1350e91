//! Bounds of the polynomials of an element: enclosures of all states inside it (T-128).

use super::DenseElement;
use crate::basis::{INTEGRAL_BOUNDS, MAX_NODES};
use crate::dual::Dual;
use crate::enclosure::Enclosure;
use crate::model::Form;
use crate::real::Real;
use alloc::vec::Vec;

/// The arguments of outputs, along an element or a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arguments<R, const N: usize> {
    /// The time.
    pub t: R,
    /// Coordinates.
    pub q: [R; N],
    /// Velocities: the derivative of the polynomial of the coordinates.
    pub v: [R; N],
    /// Momenta.
    pub p: [R; N],
}

/// The enclosure of a power of y ∈ [−1, 1].
fn power(exponent: usize) -> Enclosure {
    match exponent {
        0 => Enclosure::from_f64(1.0),
        even if even % 2 == 0 => Enclosure::between(0.0, 1.0),
        _ => Enclosure::between(-1.0, 1.0),
    }
}

/// Legendre polynomials of τ = m + r y expanded in powers of y, with the sums of magnitudes from which each coefficient
/// has been computed.
struct Expansion {
    radius: f64,
    /// The coefficients, their sums of magnitudes, and the same of one degree lower.
    here: [[f64; MAX_NODES]; 2],
    before: [[f64; MAX_NODES]; 2],
    degree: usize,
}

impl Expansion {
    /// The expansion of degree zero, over a part of the element.
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

    /// Goes on to the next degree: (n + 1) P_{n+1} = (2n + 1) x P_n − n P_{n−1} with x = 2m − 1 + 2 r y.
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

/// The expansions of all Legendre polynomials below a degree.
struct Expansions {
    middle: f64,
    radius: f64,
    coefficients: [[[f64; MAX_NODES]; 2]; MAX_NODES],
    count: usize,
}

impl Expansions {
    fn over(part: (f64, f64), count: usize) -> Self {
        let (middle, mut expansion) = Expansion::over(part);
        let mut coefficients = [[[0.0; MAX_NODES]; 2]; MAX_NODES];
        for (k, row) in coefficients[..count].iter_mut().enumerate() {
            if k > 0 {
                expansion.raise(middle);
            }
            *row = expansion.here;
        }
        Self {
            middle,
            radius: expansion.radius,
            coefficients,
            count,
        }
    }

    /// The polynomial of one coordinate with given Legendre coefficients, as powers of y.
    fn powers(&self, rate: impl Fn(usize) -> f64) -> Powers {
        let (mut values, mut sizes) = ([0.0; MAX_NODES], [0.0; MAX_NODES]);
        for (k, [here, size]) in self.coefficients[..self.count].iter().enumerate() {
            let rate = rate(k);
            for j in 0..=k {
                values[j] += here[j] * rate;
                sizes[j] += size[j] * rate.abs();
            }
        }
        // Each of the sums and recurrences has about four rounding errors for each degree.
        let rounding = 8.0 * f64::EPSILON * (self.count + 1) as f64;
        let mut coefficients = [Enclosure::ZERO; MAX_NODES];
        for (j, coefficient) in coefficients[..self.count].iter_mut().enumerate() {
            let off = rounding * sizes[j];
            *coefficient = Enclosure::between(values[j] - off, values[j] + off);
        }
        Powers {
            coefficients,
            count: self.count,
            radius: self.radius,
        }
    }
}

/// Σ c_j yʲ
struct Powers {
    coefficients: [Enclosure; MAX_NODES],
    count: usize,
    radius: f64,
}

impl Powers {
    /// Σ w_j c_j y^{j + shift}, without the terms whose exponent would be negative.
    fn sum(&self, shift: isize, weight: impl Fn(usize) -> f64) -> Enclosure {
        let mut sum = Enclosure::ZERO;
        for (j, coefficient) in self.coefficients[..self.count].iter().enumerate() {
            if let Some(exponent) = j.checked_add_signed(shift) {
                let factor = Enclosure::from_f64(weight(j)) * power(exponent);
                sum += *coefficient * factor;
            }
        }
        sum
    }

    /// The polynomial and its derivative by τ.
    fn rate(&self) -> Dual<Enclosure> {
        let value = self.sum(0, |_| 1.0);
        Dual::new(value, self.sum(-1, |j| j as f64 / self.radius))
    }

    /// The integral from the middle, and the polynomial.
    fn integral(&self) -> Dual<Enclosure> {
        let value = self.sum(1, |j| self.radius / (j + 1) as f64);
        Dual::new(value, self.sum(0, |_| 1.0))
    }
}

/// An allowance for rounding errors in sums and polynomials.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Bounds of a coordinate, or a momentum, along the whole element, from the coefficients of its rate, except the first,
/// and its values at the ends.
fn along(others: impl Iterator<Item = f64>, ends: (f64, f64)) -> Enclosure {
    let mut radius = ROUNDING * (ends.0.abs() + ends.1.abs());
    for (rate, most) in others.zip(&INTEGRAL_BOUNDS[1..]) {
        radius += rate.abs() * most;
    }
    let (low, high) = (ends.0.min(ends.1), ends.0.max(ends.1));
    Enclosure::between(low - radius, high + radius)
}

/// Bounds of a velocity along the whole element, from the coefficients of the rate and the reciprocal of the length.
fn velocity_along(mean: f64, others: impl Iterator<Item = f64>, by_time: f64) -> Enclosure {
    let sum = others.fold(0.0, |sum, rate| sum + rate.abs());
    let radius = sum + ROUNDING * (sum + mean.abs());
    Enclosure::between((mean - radius) * by_time, (mean + radius) * by_time)
}

/// The time over a part of an element, with its derivative.
fn time_over(times: (f64, f64), (from, to): (f64, f64)) -> Dual<Enclosure> {
    let length = Enclosure::from_f64(times.1 - times.0);
    let time = |tau: f64| Enclosure::from_f64(times.0) + Enclosure::from_f64(tau) * length;
    Dual::new(time(from).hull(time(to)), length)
}

/// A coordinate, or a momentum, over a part of an element, with a given value in the middle.
fn over(powers: &Powers, centre: f64, start: f64) -> Dual<Enclosure> {
    let rounding = ROUNDING * (centre.abs() + start.abs());
    let centre = Enclosure::between(centre - rounding, centre + rounding);
    let Dual { value, slope, .. } = powers.integral();
    Dual::new(centre + value, slope)
}

/// The velocity over that part.
fn velocity_over(powers: &Powers, length: f64) -> Dual<Enclosure> {
    let by_time = Enclosure::from_f64(1.0) / Enclosure::from_f64(length);
    let Dual { value, slope, .. } = powers.rate();
    Dual::new(value * by_time, slope * by_time)
}

impl<const N: usize> DenseElement<N> {
    /// Bounds of the arguments of outputs of a `form`, along the whole of an element of one [piece](Self::pieces): q ∈
    /// [q₀, q₁] ± Σ |r_k|/(2k + 1) with the coefficients r_k of the rate, k ≥ 1. They are cheap, and wide where the
    /// motion is strongly curved. Of velocities and momenta, those that the form does not need are not computed.
    #[must_use]
    #[inline]
    pub fn bounds(&self, form: Form) -> Arguments<Enclosure, N> {
        let (from, to) = self.times;
        let (rates, forces) = self.rates.split_at(self.rates.len() / 2);
        let mut bounds = Arguments {
            t: Enclosure::between(from, to),
            q: [Enclosure::ZERO; N],
            v: [Enclosure::ZERO; N],
            p: [Enclosure::ZERO; N],
        };
        let by_time = 1.0 / self.length;
        for a in 0..N {
            let others = rates.iter().skip(1).map(|rate| rate[a]);
            bounds.q[a] = along(others.clone(), (self.start.q[a], self.end.q[a]));
            match form {
                Form::Lagrangian => {
                    if let Some(mean) = rates.first() {
                        bounds.v[a] = velocity_along(mean[a], others, by_time);
                    }
                }
                Form::Hamiltonian => {
                    let others = forces.iter().skip(1).map(|force| force[a]);
                    let (start, end) = (self.start.p[a], self.end.p[a]);
                    bounds.p[a] = along(others.clone(), (start, end));
                    if self.jumps
                        && let Some(mean) = forces.first()
                    {
                        let before = along(others, (start, start + mean[a]));
                        bounds.p[a] = bounds.p[a].hull(before);
                    }
                }
            }
        }
        bounds
    }

    /// Bounds of the arguments of outputs, and of their derivatives by τ, over a part from τ to τ of an element of one
    /// [piece](Self::pieces). They come from Taylor polynomials about the middle, whose width decreases with that of
    /// the part.
    #[must_use]
    pub fn bounds_over(&self, part: (f64, f64)) -> Arguments<Dual<Enclosure>, N> {
        let (rates, forces) = self.rates.split_at(self.rates.len() / 2);
        let expansions = Expansions::over(part, rates.len());
        let centre = self.at(expansions.middle);
        let zero = Dual::new(Enclosure::ZERO, Enclosure::ZERO);
        let mut bounds = Arguments {
            t: time_over(self.times, part),
            q: [zero; N],
            v: [zero; N],
            p: [zero; N],
        };
        for a in 0..N {
            let rate = expansions.powers(|k| rates[k][a]);
            let force = expansions.powers(|k| forces[k][a]);
            bounds.q[a] = over(&rate, centre.q[a], self.start.q[a]);
            bounds.p[a] = over(&force, centre.p[a], self.start.p[a]);
            bounds.v[a] = velocity_over(&rate, self.length);
        }
        bounds
    }
}

/// The arguments of outputs of a model of run-time length, along an element or a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct LongArguments<R> {
    /// The time.
    pub t: R,
    /// Coordinates.
    pub q: Vec<R>,
    /// Velocities, for a Lagrangian: the derivative of the polynomial of the coordinates.
    pub v: Vec<R>,
    /// Momenta, for a Hamiltonian.
    pub p: Vec<R>,
}

/// The polynomials of an element of many coordinates: Legendre coefficients of the rates of coordinates and momenta, a
/// row of n each, and its ends.
pub(crate) struct Rows<'a> {
    pub(crate) times: (f64, f64),
    pub(crate) length: f64,
    pub(crate) rates: &'a [f64],
    pub(crate) forces: &'a [f64],
    pub(crate) start: [&'a [f64]; 2],
    pub(crate) end: [&'a [f64]; 2],
}

/// The coefficients of one of n coordinates, except the first.
fn others(rates: &[f64], n: usize, a: usize) -> impl Iterator<Item = f64> {
    let rows = rates.chunks_exact(n.max(1)).skip(1);
    rows.map(move |row| row[a])
}

impl Rows<'_> {
    /// As for elements of fixed size.
    pub(crate) fn bounds(&self, form: Form) -> LongArguments<Enclosure> {
        let [q, p] = self.start;
        let n = q.len();
        let by_time = 1.0 / self.length;
        let velocity = |a: usize| match self.rates.get(a) {
            Some(mean) => velocity_along(*mean, others(self.rates, n, a), by_time),
            None => Enclosure::ZERO,
        };
        let momentum = |a: usize| along(others(self.forces, n, a), (p[a], self.end[1][a]));
        LongArguments {
            t: Enclosure::between(self.times.0, self.times.1),
            q: (0..n)
                .map(|a| along(others(self.rates, n, a), (q[a], self.end[0][a])))
                .collect(),
            v: match form {
                Form::Lagrangian => (0..n).map(velocity).collect(),
                Form::Hamiltonian => Vec::new(),
            },
            p: match form {
                Form::Lagrangian => Vec::new(),
                Form::Hamiltonian => (0..n).map(momentum).collect(),
            },
        }
    }

    /// As for elements of fixed size; `centre` is the state in the middle of the part.
    pub(crate) fn bounds_over(
        &self,
        form: Form,
        part: (f64, f64),
        centre: [&[f64]; 2],
    ) -> LongArguments<Dual<Enclosure>> {
        let [q, p] = self.start;
        let n = q.len();
        let expansions = Expansions::over(part, self.rates.len() / n.max(1));
        let powers = |rates: &[f64], a: usize| expansions.powers(|k| rates[k * n + a]);
        let mut bounds = LongArguments {
            t: time_over(self.times, part),
            q: Vec::with_capacity(n),
            v: Vec::new(),
            p: Vec::new(),
        };
        for a in 0..n {
            let rate = powers(self.rates, a);
            bounds.q.push(over(&rate, centre[0][a], q[a]));
            match form {
                Form::Lagrangian => bounds.v.push(velocity_over(&rate, self.length)),
                Form::Hamiltonian => {
                    let force = powers(self.forces, a);
                    bounds.p.push(over(&force, centre[1][a], p[a]));
                }
            }
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::State;

    /// Elements of random coefficients: what they do in a part is within the bounds of that part, and these are not
    /// much wider where parts are short.
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
