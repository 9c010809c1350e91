//! Test functions: functions of an orbit that change sign at a bifurcation of its branch.

use crate::periodic_schur::Multiplier;
use nalgebra::Complex;

/// The kind of a bifurcation on a branch of periodic orbits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EventKind {
    /// A fold (saddle-node): the branch turns back in the parameter, and a multiplier passes through +1.
    Fold,
    /// A period doubling (flip): a real multiplier passes through −1, and a branch of orbits of twice the period
    /// begins.
    PeriodDoubling,
    /// A torus (Neimark–Sacker) bifurcation: a complex pair of multipliers crosses the unit circle, and an invariant
    /// torus begins.
    Torus,
    /// A branch point: a real multiplier passes through +1 and the branch does not turn; another branch of the same
    /// period crosses or forks off.
    Branch,
}

impl EventKind {
    /// All kinds.
    pub(super) const ALL: [Self; 4] = [Self::Fold, Self::PeriodDoubling, Self::Torus, Self::Branch];
}

/// The data from which the test functions are computed.
pub(super) struct Circumstances<'a> {
    /// The component of the unit tangent along the parameter.
    pub(super) slope: f64,
    /// The sign of the determinant of the equations, including the equation of arc length.
    pub(super) sign: f64,
    /// The multipliers.
    pub(super) floquet: &'a [Multiplier],
    /// The indices of the trivial multipliers.
    pub(super) trivial: &'a [usize],
    /// Whether multipliers come in pairs μ, 1/μ, which reach the unit circle together.
    pub(super) symplectic: bool,
}

/// The test functions of an orbit:
///
/// ```text
/// fold             dλ/ds
/// period doubling  ∏ (μ_i + 1) / (|μ_i| + 1)
/// torus            ∏_{i<j} (μ_i μ_j − 1) / (|μ_i μ_j| + 1)
/// branch           ±∏ (μ_i − 1) / (|μ_i| + 1) ,   the sign that of the determinant of all equations
/// ```
///
/// over the nontrivial multipliers; of each product, the size is that of its smallest factor. The denominators keep the
/// factors bounded and have no zeros. The determinant changes sign where branches cross, but not at folds, where the
/// product does; only both together distinguish the two and give a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tests {
    values: [f64; 4],
}

/// The product of factors of modulus at most one, replaced by a number with the same changes of sign: the smallest
/// factor with the phase of the product. A product of many factors could be rounding error although no factor is close
/// to zero.
fn product(factors: impl Iterator<Item = Complex<f64>>) -> f64 {
    let (mut turned, mut least) = (Complex::new(1.0, 0.0), 1.0_f64);
    for factor in factors {
        let size = factor.norm();
        if size == 0.0 {
            return 0.0;
        }
        turned *= factor / size;
        least = least.min(size);
    }
    turned.re * least
}

impl Tests {
    pub(super) fn new(at: &Circumstances<'_>) -> Self {
        let others: Vec<Multiplier> = (0..at.floquet.len())
            .filter(|place| !at.trivial.contains(place))
            .map(|place| at.floquet[place])
            .collect();
        let shifted = |by: f64| -> f64 {
            let factors = others
                .iter()
                .map(|one| beside(one.log_modulus, unit(one), by));
            product(factors)
        };
        let torus = if at.symplectic {
            1.0
        } else {
            product(pairs(&others).map(|(one, other)| product_beside_one(one, other)))
        };
        Self {
            values: [at.slope, shifted(-1.0), torus, at.sign * shifted(1.0).abs()],
        }
    }

    /// The same with dλ/ds in another metric.
    pub(super) fn with_slope(mut self, slope: f64) -> Self {
        self.values[EventKind::Fold as usize] = slope;
        self
    }

    /// The value of the test function of an event.
    pub(super) fn value(&self, kind: EventKind) -> f64 {
        self.values[kind as usize]
    }

    /// The events between two orbits: test functions that change sign between values beyond rounding error.
    pub(super) fn changes(&self, next: &Self) -> impl Iterator<Item = EventKind> {
        let (before, after) = (*self, *next);
        EventKind::ALL.into_iter().filter(move |kind| {
            let (before, after) = (before.value(*kind), after.value(*kind));
            before * after < 0.0 && before.abs() > ROUND_OFF && after.abs() > ROUND_OFF
        })
    }
}

/// The last signs of the test functions along a branch, ignoring values within rounding error; zero if there was none
/// yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Signs {
    last: [f64; 4],
}

impl Signs {
    /// Takes the next orbit of the branch.
    pub(super) fn pass(&mut self, tests: &Tests) {
        for (last, value) in self.last.iter_mut().zip(tests.values) {
            if value.abs() > ROUND_OFF {
                *last = value.signum();
            }
        }
    }

    /// The events exactly at the last orbit: test functions that vanish there up to rounding error and have the
    /// opposite sign at the next one.
    pub(super) fn changes_at(&self, at: &Tests, next: &Tests) -> impl Iterator<Item = EventKind> {
        let (signs, at, next) = (self.last, *at, *next);
        EventKind::ALL.into_iter().filter(move |kind| {
            let (sign, next) = (signs[*kind as usize], next.value(*kind));
            at.value(*kind).abs() <= ROUND_OFF && next.abs() > ROUND_OFF && sign * next < 0.0
        })
    }
}

/// The bound below which a test function counts as zero, as one that vanishes identically because of a symmetry of the
/// multipliers.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// Whether a zero of the torus test function is a torus bifurcation: the pair with product one must be complex, since
/// two real multipliers μ, 1/μ have no meaning.
pub(super) fn is_torus(floquet: &[Multiplier], trivial: &[usize]) -> bool {
    let others: Vec<Multiplier> = (0..floquet.len())
        .filter(|place| !trivial.contains(place))
        .map(|place| floquet[place])
        .collect();
    let nearest = pairs(&others).min_by(|(a, b), (c, d)| {
        let (first, second) = (product_beside_one(a, b), product_beside_one(c, d));
        first.norm().total_cmp(&second.norm())
    });
    nearest.is_some_and(|(one, _)| unit(one).im != 0.0)
}

fn pairs(multipliers: &[Multiplier]) -> impl Iterator<Item = (&Multiplier, &Multiplier)> {
    let rest = |i: usize| multipliers.iter().skip(i + 1);
    let firsts = multipliers.iter().enumerate();
    firsts.flat_map(move |(i, one)| rest(i).map(move |other| (one, other)))
}

/// μ / |μ|, real if μ is.
fn unit(multiplier: &Multiplier) -> Complex<f64> {
    Multiplier {
        log_modulus: 0.0,
        argument: multiplier.argument,
    }
    .to_complex()
}

/// (μ − σ) / (|μ| + 1), also if |μ| exceeds the range of `f64`.
fn beside(log_modulus: f64, unit: Complex<f64>, sigma: f64) -> Complex<f64> {
    let small = (-log_modulus.abs()).exp();
    let difference = if log_modulus > 0.0 {
        unit - sigma * small
    } else {
        unit * small - sigma
    };
    difference / (1.0 + small)
}

fn product_beside_one(one: &Multiplier, other: &Multiplier) -> Complex<f64> {
    let log_modulus = one.log_modulus + other.log_modulus;
    beside(log_modulus, unit(one) * unit(other), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn multiplier(modulus: f64, argument: f64) -> Multiplier {
        Multiplier {
            log_modulus: modulus.ln(),
            argument,
        }
    }

    fn at(slope: f64, floquet: &[Multiplier]) -> Tests {
        // The determinant at fixed parameter has the sign of ∏ (μ − 1); that with arc length has this sign divided by
        // that of the slope.
        let product: f64 = floquet
            .iter()
            .map(|one| {
                if one.argument == 0.0 {
                    one.modulus() - 1.0
                } else {
                    1.0
                }
            })
            .product();
        Tests::new(&Circumstances {
            slope,
            sign: product.signum() * slope.signum(),
            floquet,
            trivial: &[],
            symplectic: false,
        })
    }

    #[track_caller]
    fn check(before: &Tests, after: &Tests, expected: &[EventKind]) {
        let found: Vec<EventKind> = before.changes(after).collect();
        assert_eq!(found, expected);
        let back: Vec<EventKind> = after.changes(before).collect();
        assert_eq!(back, expected);
    }

    #[test]
    fn each_crossing_is_one_event() {
        let fixed = multiplier(0.3, 0.0);
        let inside = at(1.0, &[multiplier(0.9, 0.0), fixed]);
        let outside = [multiplier(1.1, 0.0), fixed];
        check(&inside, &at(-1.0, &outside), &[EventKind::Fold]);
        check(&inside, &at(1.0, &outside), &[EventKind::Branch]);
        check(
            &at(1.0, &[multiplier(0.9, PI), fixed]),
            &at(1.0, &[multiplier(1.1, PI), fixed]),
            &[EventKind::PeriodDoubling],
        );
        let pair = |modulus| {
            at(
                1.0,
                &[multiplier(modulus, 0.7), multiplier(modulus, -0.7), fixed],
            )
        };
        check(&pair(0.9), &pair(1.1), &[EventKind::Torus]);
    }

    #[test]
    fn an_event_at_an_orbit_itself_is_one() {
        let along = |slopes: &[f64]| {
            let orbits: Vec<Tests> = (slopes.iter())
                .map(|slope| at(*slope, &[multiplier(0.9 + 0.1 * (1.0 - slope), 0.0)]))
                .collect();
            let mut signs = Signs::default();
            let mut found = Vec::new();
            for (place, pair) in orbits.windows(2).enumerate() {
                signs.pass(&pair[0]);
                let at_first = signs.changes_at(&pair[0], &pair[1]);
                found.extend(at_first.map(|kind| (place, kind)));
                let between = pair[0].changes(&pair[1]);
                found.extend(between.map(|kind| (place, kind)));
            }
            found
        };
        let fold = EventKind::Fold;
        assert_eq!(along(&[0.2, 0.1, -0.1, -0.2]), [(1, fold)]);
        assert_eq!(along(&[0.2, 0.1, 0.0, -0.1, -0.2]), [(2, fold)]);
        assert_eq!(along(&[-0.2, 1e-12, 0.1]), [(1, fold)]);
        // A function that is zero at the beginning or the end, or only touches zero, does not change its sign.
        for slopes in [&[0.0, -0.1, -0.2][..], &[0.1, 0.0, 0.1], &[0.1, 0.0]] {
            assert!(along(slopes).is_empty(), "{slopes:?}");
        }
    }

    #[test]
    fn multipliers_that_meet_off_the_circle_are_no_event() {
        let both =
            |a: (f64, f64), b: (f64, f64)| at(1.0, &[multiplier(a.0, a.1), multiplier(b.0, b.1)]);
        let complex = both((0.5, 0.1), (0.5, -0.1));
        check(&complex, &both((0.6, 0.0), (0.4, 0.0)), &[]);
        let complex = both((1.5, 3.0), (1.5, -3.0));
        check(&complex, &both((1.6, PI), (1.4, PI)), &[]);
    }

    #[test]
    fn two_real_multipliers_with_product_one_are_no_torus() {
        let before = at(1.0, &[multiplier(2.0, 0.0), multiplier(0.4, 0.0)]);
        let after = at(1.0, &[multiplier(2.0, 0.0), multiplier(0.6, 0.0)]);
        check(&before, &after, &[EventKind::Torus]);
        let real = [multiplier(2.0, 0.0), multiplier(0.5, 0.0)];
        assert!(!is_torus(&real, &[]));
        let complex = [multiplier(1.0, 0.4), multiplier(1.0, -0.4)];
        assert!(is_torus(&complex, &[]));
        // The trivial multiplier and a conjugate pair.
        let cycle = [
            multiplier(1.0, 0.4),
            multiplier(1.0, -0.4),
            multiplier(1.0, 0.0),
        ];
        assert!(is_torus(&cycle, &[2]));
    }

    #[test]
    fn what_vanishes_identically_is_no_event() {
        // The product of an undamped pair under forcing is one up to rounding error of either sign.
        let pair = |noise: f64| at(1.0, &[multiplier(1.0 + noise, 0.4), multiplier(1.0, -0.4)]);
        check(&pair(1e-14), &pair(-1e-14), &[]);
    }

    #[test]
    fn huge_and_vanishing_multipliers_stay_finite() {
        for log_modulus in [1e4, -1e4, f64::NEG_INFINITY] {
            let extreme = Multiplier {
                log_modulus,
                argument: 0.0,
            };
            let tests = at(1.0, &[extreme, multiplier(0.5, 0.0)]);
            assert!(
                EventKind::ALL
                    .iter()
                    .all(|kind| tests.value(*kind).is_finite())
            );
        }
    }

    #[test]
    fn many_multipliers_hide_no_event() {
        let others: Vec<Multiplier> = (0..18)
            .flat_map(|k| {
                let angle = 0.1 + 0.15 * f64::from(k);
                [multiplier(0.98, angle), multiplier(0.98, -angle)]
            })
            .collect();
        let with = |modulus: f64, angle: f64| {
            let mut all = others.clone();
            all.push(multiplier(modulus, angle));
            if angle != 0.0 && angle != PI {
                all.push(multiplier(modulus, -angle));
            }
            at(1.0, &all)
        };
        for (angle, kind) in [
            (PI, EventKind::PeriodDoubling),
            (0.0, EventKind::Branch),
            (1.77, EventKind::Torus),
        ] {
            check(&with(0.99, angle), &with(1.01, angle), &[kind]);
            check(&with(0.97, angle), &with(0.99, angle), &[]);
        }
    }
}
