//! States at which digits are easily lost: what a rewritten formula is compared at with the formula as declared.
//!
//! A state is a number for each input. Cancellation is what hurts, so most states bring inputs close to each other: equal or nearly equal
//! ones, beside large common offsets, or of opposite signs; others have inputs of very different sizes. The numbers depend on the position of
//! an input among all inputs, not on its name.

use crate::expr::input::Input;

/// How the inputs of a state are chosen.
#[derive(Clone, Copy, Debug)]
struct Regime {
    /// What coordinates, velocities and momenta have in common; 0 for none.
    offset: f64,
    /// How far they are from it.
    spread: f64,
    /// Parameters are 10^±this times a number of ordinary size.
    decades: f64,
    /// Which inputs go with the offset, and how.
    cluster: Cluster,
}

/// Which inputs have the common offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cluster {
    /// None.
    Nobody,
    /// All that move; velocities have another offset of the same size.
    Moving,
    /// The same, with random signs.
    MovingOrOpposite,
    /// All inputs, parameters too.
    All,
    /// The same, with random signs of what moves.
    AllOrOpposite,
    /// Half of all inputs, parameters too.
    Half,
    /// The same, with random signs of what moves.
    HalfOrOpposite,
}

impl Regime {
    const fn new(cluster: Cluster, offset: f64, spread: f64) -> Self {
        Self {
            offset,
            spread,
            decades: 0.0,
            cluster,
        }
    }

    const fn of_sizes(spread: f64, decades: f64) -> Self {
        Self {
            offset: 0.0,
            spread,
            decades,
            cluster: Cluster::Nobody,
        }
    }
}

/// The states, those first at which a bad formula is most often found out.
const REGIMES: [Regime; 28] = {
    use Cluster::{All, AllOrOpposite, Half, HalfOrOpposite, Moving, MovingOrOpposite};
    [
        Regime::new(Moving, 1e6, 0.5),
        Regime::new(All, 1.0, 1e-5),
        Regime::new(MovingOrOpposite, 1.0, 1e-6),
        Regime::new(Half, 1.0, 1e-5),
        Regime::of_sizes(1.0, 0.0),
        Regime::of_sizes(1e-3, 0.0),
        Regime::new(HalfOrOpposite, 1.0, 0.0),
        Regime::new(Moving, 1e3, 0.5),
        Regime::new(All, 1e8, 0.5),
        Regime::new(MovingOrOpposite, 1.0, 0.0),
        Regime::of_sizes(1.0, 6.0),
        Regime::new(AllOrOpposite, 1.0, 1e-3),
        Regime::new(HalfOrOpposite, 1e3, 1e-3),
        Regime::new(Moving, 1e8, 0.5),
        Regime::new(Moving, 1.0, 0.0),
        Regime::new(HalfOrOpposite, 1.0, 1e-3),
        Regime::new(Half, 1.0, 1e-7),
        Regime::of_sizes(1.0, 3.0),
        Regime::new(All, 1.0, 0.0),
        Regime::new(MovingOrOpposite, 1e5, 1e-2),
        Regime::new(AllOrOpposite, 1e-3, 1e-6),
        Regime::new(Half, 1e3, 0.5),
        Regime::of_sizes(1e-6, 0.0),
        Regime::new(Moving, 1e-3, 1e-7),
        Regime::new(HalfOrOpposite, 1.0, 1e-5),
        Regime::of_sizes(1e-3, 6.0),
        Regime::new(AllOrOpposite, 1.0, 0.0),
        Regime::new(Half, 1e8, 0.5),
    ]
};

/// How many states of each regime there are.
const DRAWS: usize = 2;

/// How many states there are.
pub(crate) const STATES: usize = DRAWS * REGIMES.len();

/// The numbers of these inputs in the state of this number, below [`STATES`].
pub(crate) fn state(inputs: &[Input], number: usize) -> Vec<f64> {
    let regime = REGIMES[number % REGIMES.len()];
    let sample = |(position, input)| regime.sample(input, Draw::of(number, position));
    inputs.iter().enumerate().map(sample).collect()
}

impl Regime {
    fn sample(self, input: &Input, mut draw: Draw) -> f64 {
        let (own, sign, joins, small) = (draw.size(), draw.sign(), draw.sign(), draw.sign());
        let exponent = self.decades * draw.symmetric();
        let (moves, offset) = match input {
            // An index or a length.
            Input::Integer(_) => return (8.0 * own).floor(),
            Input::Parameter(_) | Input::ParameterElement(..) => (false, self.offset),
            Input::Velocity(_) | Input::Momentum(_) => (true, 0.75 * self.offset),
            Input::Time | Input::Coordinate(_) | Input::Multiplier(_) => (true, self.offset),
        };
        let together = match self.cluster {
            Cluster::Nobody => false,
            Cluster::Moving | Cluster::MovingOrOpposite => moves,
            Cluster::All | Cluster::AllOrOpposite => true,
            Cluster::Half | Cluster::HalfOrOpposite => joins > 0.0,
        };
        let opposite = matches!(
            self.cluster,
            Cluster::MovingOrOpposite | Cluster::AllOrOpposite | Cluster::HalfOrOpposite
        );
        match (moves, together) {
            (true, true) => {
                (if opposite { sign } else { 1.0 }) * (offset + self.spread * small * own)
            }
            (false, true) => (offset + self.spread * small * own).abs(),
            (false, false) => own * 10.0_f64.powf(exponent),
            // Of states without offset, half of the inputs are small.
            (true, false) if self.cluster == Cluster::Nobody && small > 0.0 => {
                sign * own * self.spread
            }
            (true, false) => sign * own,
        }
    }
}

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
    fn names_do_not_matter() {
        let named = |name: &str| [Input::Parameter(name.to_owned()), Input::Time];
        for number in 0..STATES {
            assert_eq!(state(&named("l"), number), state(&named("length"), number));
        }
    }
}
