//! The states at which a rewritten formula is compared with the formula as declared: states at which digits are easily
//! lost.
//!
//! A state is a number for each input. Digits are lost by cancellation, so most states have inputs close to each other:
//! coordinates, velocities, parameters, or some of each are equal or nearly equal, with large common offsets, or of
//! opposite signs; in half of the states, parameters are of very different magnitudes. The numbers depend on the
//! position of an input among all inputs, not on its name.

use crate::expr::input::Input;

/// The number of states besides those with an outstanding parameter: each kind of cluster is combined with each offset
/// and each spread once. The time of the guard is proportional to it.
const STATES: usize = 140;

/// At most this many parameters are in turn made much larger than all other inputs, in two states each.
const MAX_OUTSTANDING: usize = 12;

/// How large such a parameter is.
const OUTSTANDING: f64 = 1e5;

/// The inputs that are close to each other.
const CLUSTERS: [Cluster; 7] = {
    use Cluster::{All, Coordinates, Half, Moving, Nobody, Rates, WithParameters};
    [
        Coordinates,
        All,
        Half,
        Moving,
        WithParameters,
        Rates,
        Nobody,
    ]
};

/// The common offsets of a cluster.
const OFFSETS: [f64; 5] = [1.0, 1e3, 1e8, 1e5, 1e-3];

/// The distances from the common offset, relative to it.
const SPREADS: [f64; 4] = [1e-3, 1e-6, 0.0, 1e-9];

/// In states without clusters, half of the moving inputs are this small; and parameters are by this factor larger or
/// smaller than one.
const SMALL: f64 = 1e-3;
const DECADES: f64 = 6.0;

/// Which inputs have the common offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cluster {
    /// None.
    Nobody,
    /// Coordinates and the time.
    Coordinates,
    /// Velocities and momenta.
    Rates,
    /// Coordinates and, about another offset of the same size, velocities and momenta.
    Moving,
    /// Coordinates and parameters.
    WithParameters,
    /// All inputs.
    All,
    /// Half of all inputs.
    Half,
}

/// How the inputs of a state are chosen.
#[derive(Clone, Copy, Debug)]
struct Regime {
    cluster: Cluster,
    offset: f64,
    spread: f64,
    /// Whether what moves has random signs.
    opposite: bool,
    /// How many decades apart parameters are that are in no cluster.
    decades: f64,
}

impl Regime {
    /// Each of the choices goes with each of the others once: their numbers have no common factor.
    fn of(number: usize) -> Self {
        Self {
            cluster: CLUSTERS[number % CLUSTERS.len()],
            offset: OFFSETS[number % OFFSETS.len()],
            spread: SPREADS[number % SPREADS.len()],
            opposite: number % 3 == 2,
            decades: if (number / 4).is_multiple_of(2) {
                0.0
            } else {
                DECADES
            },
        }
    }

    fn sample(self, input: &Input, mut draw: Draw) -> f64 {
        let (own, sign, joins, side) = (draw.size(), draw.sign(), draw.sign(), draw.sign());
        let exponent = self.decades * draw.symmetric();
        let (kind, share) = match input {
            // An index or a length.
            Input::Integer(_) => return (8.0 * own).floor(),
            Input::Placeholder(..) | Input::Parameter(_) | Input::ParameterElement(..) => {
                (Kind::Parameter, 1.0)
            }
            // At rest with each other, but not at the place of anything.
            Input::Velocity(_) | Input::Momentum(_) => (Kind::Rate, 0.75),
            Input::Time | Input::Control(_) | Input::Coordinate(_) | Input::Multiplier(_) => {
                (Kind::Coordinate, 1.0)
            }
        };
        let together = match self.cluster {
            Cluster::Nobody => false,
            Cluster::Coordinates => kind == Kind::Coordinate,
            Cluster::Rates => kind == Kind::Rate,
            Cluster::Moving => kind != Kind::Parameter,
            Cluster::WithParameters => kind != Kind::Rate,
            Cluster::All => true,
            Cluster::Half => joins > 0.0,
        };
        let near = share * self.offset * (1.0 + self.spread * side * own);
        match (kind, together) {
            (Kind::Parameter, true) => near,
            (Kind::Parameter, false) => own * 10.0_f64.powf(exponent),
            (_, true) if self.opposite => sign * near,
            (_, true) => near,
            (_, false) if self.cluster == Cluster::Nobody && side > 0.0 => sign * own * SMALL,
            (_, false) => sign * own,
        }
    }
}

/// The positions of the parameters that are much larger than all else in turn.
fn outstanding(inputs: &[Input]) -> Vec<usize> {
    let is_parameter =
        |input: &Input| matches!(input, Input::Parameter(_) | Input::ParameterElement(..));
    let all: Vec<usize> = (0..inputs.len())
        .filter(|at| is_parameter(&inputs[*at]))
        .collect();
    let every = all.len().div_ceil(MAX_OUTSTANDING).max(1);
    all.into_iter().step_by(every).collect()
}

/// How many states there are for these inputs.
pub(crate) fn number_of_states(inputs: &[Input]) -> usize {
    STATES + 2 * outstanding(inputs).len()
}

/// A state with a parameter that is much larger than all other inputs. In every second one nothing moves fast, so that
/// forces at rest are compared as well; in the others all coordinates are equal.
fn state_with_outstanding(inputs: &[Input], number: usize) -> Vec<f64> {
    let number_of_outstanding = number - STATES;
    let large = outstanding(inputs).get(number_of_outstanding / 2).copied();
    let at_rest = number_of_outstanding.is_multiple_of(2);
    let regime = Regime {
        cluster: match at_rest {
            true => Cluster::Rates,
            false => Cluster::Coordinates,
        },
        offset: Draw::of(number, OF_STATE).size() * if at_rest { SMALL / OUTSTANDING } else { 1.0 },
        spread: if at_rest { 0.5 } else { 0.0 },
        opposite: at_rest,
        decades: 0.0,
    };
    let sample = |(position, input)| {
        let own = regime.sample(input, Draw::of(number, position));
        match Some(position) == large {
            true => OUTSTANDING * own,
            false => own,
        }
    };
    inputs.iter().enumerate().map(sample).collect()
}

/// The kinds of inputs that are chosen in different ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Coordinate,
    Rate,
    Parameter,
}

/// The numbers of these inputs in the state of this number, below [`number_of_states`].
pub(crate) fn state(inputs: &[Input], number: usize) -> Vec<f64> {
    if number >= STATES {
        return state_with_outstanding(inputs, number);
    }
    let mut regime = Regime::of(number);
    // Products of powers of ten would be exact.
    regime.offset *= Draw::of(number, OF_STATE).size();
    let sample = |(position, input)| regime.sample(input, Draw::of(number, position));
    inputs.iter().enumerate().map(sample).collect()
}

/// Whether coordinates are close to each other, and velocities or momenta as well, of one sign: where cos 0 = 1, sums of these cancel exactly.
pub(crate) fn moves_together(number: usize) -> bool {
    let regime = Regime::of(number);
    number < STATES && !regime.opposite && matches!(regime.cluster, Cluster::Moving | Cluster::All)
}

/// The position of what all inputs of a state have in common.
const OF_STATE: usize = u32::MAX as usize;

/// Numbers that look random, the same on every run.
struct Draw(u64);

impl Draw {
    fn of(state: usize, position: usize) -> Self {
        Self(((state as u64) << 32) ^ (position as u64 + 1))
    }

    /// A step of the generator `splitmix64`.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between 1/4 and 2.
    fn size(&mut self) -> f64 {
        0.25 * 8.0_f64.powf(self.unit())
    }

    /// Between −1 and 1.
    fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn sign(&mut self) -> f64 {
        if self.bits() & (1 << 40) == 0 {
            1.0
        } else {
            -1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Affine;

    #[test]
    fn all_kinds_of_closeness_occur() {
        let inputs = [
            Input::Coordinate(Affine::constant(0)),
            Input::Coordinate(Affine::constant(1)),
            Input::Parameter("k".to_owned()),
        ];
        let all: Vec<Vec<f64>> = (0..STATES).map(|number| state(&inputs, number)).collect();
        assert!(all.iter().flatten().all(|x| x.is_finite() && *x != 0.0));
        let some =
            |holds: &dyn Fn(f64, f64, f64) -> bool| all.iter().any(|s| holds(s[0], s[1], s[2]));
        assert!(some(&|x, y, _| x == y), "equal");
        assert!(some(&|x, y, _| x == -y), "opposite");
        assert!(
            some(&|x, y, _| x != y && (x - y).abs() < 1e-3 * x.abs()),
            "nearly equal"
        );
        assert!(
            some(&|x, _, k| x != k && (x - k).abs() < 1e-3 * k),
            "near a parameter"
        );
        assert!(
            some(&|x, y, _| x.abs() > 1e5 && (x - y).abs() < 2.0),
            "a large offset"
        );
        assert!(
            some(&|_, _, k| k < 1e-3) && some(&|_, _, k| k > 1e3),
            "sizes of parameters"
        );
        assert!(all.iter().all(|s| s[2] > 0.0));
    }

    #[test]
    fn each_parameter_is_once_much_larger_than_all_else() {
        let parameter = |name: &str| Input::Parameter(name.to_owned());
        let inputs = [
            Input::Coordinate(Affine::constant(0)),
            parameter("k"),
            Input::Velocity(Affine::constant(0)),
            Input::Coordinate(Affine::constant(1)),
            parameter("l"),
        ];
        assert_eq!(number_of_states(&inputs), STATES + 4);
        for (number, large) in [(0, 1), (1, 1), (2, 4), (3, 4)] {
            let state = state(&inputs, STATES + number);
            let others = (0..5).filter(|at| *at != large);
            let most = others.map(|at| state[at].abs()).fold(0.0, f64::max);
            assert!(state[large] > 1e3 * most, "{state:?}");
            assert_eq!(state[0] == state[3], number % 2 == 1, "{state:?}");
            assert_eq!(state[2].abs() < 1e-6, number % 2 == 0, "{state:?}");
        }
    }

    #[test]
    fn names_do_not_matter() {
        let named = |name: &str| [Input::Parameter(name.to_owned()), Input::Time];
        for number in 0..STATES {
            assert_eq!(state(&named("l"), number), state(&named("length"), number));
        }
    }
}
