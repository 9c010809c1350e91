//! A model with both sets of kernels, behind one interface.

use crate::by_hand::ByHand;
use crate::error::{Disagreement, Error};
use std::fmt;
use std::hint::black_box;
use std::time::Instant;
use tfe::runtime::{First, Lanes, Model, Operations, Real, Second, Structure};

/// Which kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// `Model::first`
    First,
    /// `Model::second`
    Second,
}

/// Who wrote it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writer {
    /// The macro.
    Generated,
    /// A person.
    Hand,
    /// Nobody: the loop and the call alone, to be subtracted.
    Nothing,
}

impl Kernel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];
}

impl Writer {
    /// All.
    pub const ALL: [Self; 3] = [Self::Generated, Self::Hand, Self::Nothing];
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::First => "first",
            Self::Second => "second",
        })
    }
}

impl fmt::Display for Writer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Generated => "generated",
            Self::Hand => "hand",
            Self::Nothing => "nothing",
        })
    }
}

/// What is measured of a model.
pub trait Case {
    /// The name in the table and on the command line.
    fn name(&self) -> &'static str;
    /// The operations of the generated kernel.
    fn operations(&self, kernel: Kernel) -> Operations;
    /// Compares the kernels at several states.
    fn check(&self) -> Result<(), Error>;
    /// Calls a kernel so many times.
    fn repeat(&self, kernel: Kernel, writer: Writer, times: u32);
    /// Nanoseconds a call, of numbers.
    fn nanoseconds(&self, kernel: Kernel) -> Pair;
    /// Nanoseconds a call, of four numbers side by side.
    fn lanes(&self, kernel: Kernel) -> Pair;
}

/// A measurement of both.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Of the generated kernel.
    pub generated: f64,
    /// Of the other one.
    pub hand: f64,
}

/// A model with its name and what the macro says about it.
pub struct Of<M, const N: usize> {
    name: &'static str,
    structure: Structure,
    model: M,
}

impl<M, const N: usize> Of<M, N> {
    /// The case of a model.
    pub fn new(name: &'static str, structure: Structure, model: M) -> Self {
        Self {
            name,
            structure,
            model,
        }
    }
}

/// What a kernel is called with.
struct Arguments<R, const N: usize> {
    q: [R; N],
    z: [R; N],
    first: First<R, N>,
    second: Second<R, N>,
}

impl<R: Real, const N: usize> Arguments<R, N> {
    /// Coordinates and velocities in (−1, 1) that repeat nowhere: multiples of the golden section, modulo one.
    fn boxed(state: usize) -> Box<Self> {
        let place = |k: usize| {
            let turns = (1 + state * 2 * N + k) as f64 * 0.618_033_988_749_894_9;
            R::from_f64(2.0 * turns.fract() - 1.0)
        };
        Box::new(Self {
            q: std::array::from_fn(place),
            z: std::array::from_fn(|k| place(N + k)),
            first: First::zero(),
            second: Second::zero(),
        })
    }
}

/// The time of all calls: one at which the models that depend on it do.
const TIME: f64 = 0.3;

type Call<M, R, const N: usize> = fn(&M, &[R; N], &[R; N], &mut First<R, N>, &mut Second<R, N>);

/// The function behind which a kernel stands; all have the same arguments, so that all calls cost the same.
fn call<M, R, const N: usize>(kernel: Kernel, writer: Writer) -> Call<M, R, N>
where
    M: Model<N> + ByHand<N>,
    R: Real,
{
    #[inline(never)]
    fn nothing<M, R: Real, const N: usize>(
        _: &M,
        _: &[R; N],
        _: &[R; N],
        _: &mut First<R, N>,
        _: &mut Second<R, N>,
    ) {
    }
    #[inline(never)]
    fn generated_first<M: Model<N>, R: Real, const N: usize>(
        model: &M,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        _: &mut Second<R, N>,
    ) {
        model.first(R::from_f64(TIME), q, z, first);
    }
    #[inline(never)]
    fn generated_second<M: Model<N>, R: Real, const N: usize>(
        model: &M,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        model.second(R::from_f64(TIME), q, z, first, second);
    }
    #[inline(never)]
    fn hand_first<M: ByHand<N>, R: Real, const N: usize>(
        model: &M,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        _: &mut Second<R, N>,
    ) {
        ByHand::first(model, R::from_f64(TIME), q, z, first);
    }
    #[inline(never)]
    fn hand_second<M: ByHand<N>, R: Real, const N: usize>(
        model: &M,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        ByHand::second(model, R::from_f64(TIME), q, z, first, second);
    }
    match (writer, kernel) {
        (Writer::Nothing, _) => nothing,
        (Writer::Generated, Kernel::First) => generated_first,
        (Writer::Generated, Kernel::Second) => generated_second,
        (Writer::Hand, Kernel::First) => hand_first,
        (Writer::Hand, Kernel::Second) => hand_second,
    }
}

#[inline(never)]
fn repeat<M, R: Real, const N: usize>(
    model: &M,
    call: Call<M, R, N>,
    arguments: &mut Arguments<R, N>,
    times: u32,
) {
    let call = black_box(call);
    for _ in 0..times {
        let Arguments {
            q,
            z,
            first,
            second,
        } = black_box(&mut *arguments);
        call(model, q, z, first, second);
    }
    black_box(arguments);
}

/// Entries agree to so many times the largest one: sums of a few dozen terms, in another order.
const AGREEMENT: f64 = 1e-13;

fn compare(
    case: &'static str,
    array: &'static str,
    generated: &[f64],
    hand: &[f64],
) -> Result<(), Error> {
    let scale = hand.iter().fold(0.0, |scale: f64, x| scale.max(x.abs()));
    for (index, (a, b)) in generated.iter().zip(hand).enumerate() {
        if !((a - b).abs() <= AGREEMENT * scale) {
            return Err(Error::Disagreement(Disagreement {
                case,
                array,
                index,
                generated: *a,
                hand: *b,
            }));
        }
    }
    Ok(())
}

impl<M, const N: usize> Of<M, N>
where
    M: Model<N> + ByHand<N>,
{
    /// The best of several runs, generated and hand-written in turn, so that both see the same machine.
    fn time<R: Real>(&self, kernel: Kernel) -> Pair {
        const RUNS: usize = 12;
        const SECONDS: f64 = 0.005;
        let mut arguments = Arguments::boxed(0);
        let mut seconds = |writer, times| {
            let start = Instant::now();
            let call = call::<M, R, N>(kernel, writer);
            repeat(&self.model, call, &mut arguments, times);
            start.elapsed().as_secs_f64()
        };
        let mut times = 64;
        while times < 1 << 24 && seconds(Writer::Generated, times) < SECONDS {
            times *= 2;
        }
        let mut best = Pair {
            generated: f64::INFINITY,
            hand: f64::INFINITY,
        };
        for _ in 0..RUNS {
            let a_call = 1e9 / f64::from(times);
            best.generated = best
                .generated
                .min(a_call * seconds(Writer::Generated, times));
            best.hand = best.hand.min(a_call * seconds(Writer::Hand, times));
        }
        best
    }
}

impl<M, const N: usize> Case for Of<M, N>
where
    M: Model<N> + ByHand<N>,
{
    fn name(&self) -> &'static str {
        self.name
    }

    fn operations(&self, kernel: Kernel) -> Operations {
        match kernel {
            Kernel::First => self.structure.first,
            Kernel::Second => self.structure.second,
        }
    }

    fn check(&self) -> Result<(), Error> {
        for state in 0..5 {
            for kernel in Kernel::ALL {
                let [generated, hand] = [Writer::Generated, Writer::Hand].map(|writer| {
                    let mut arguments = Arguments::<f64, N>::boxed(state);
                    repeat(&self.model, call(kernel, writer), &mut arguments, 1);
                    arguments
                });
                let (a, b) = (&generated.first, &hand.first);
                for (array, a, b) in [
                    ("z", &a.z, &b.z),
                    ("q", &a.q, &b.q),
                    ("force", &a.force, &b.force),
                ] {
                    compare(self.name, array, a, b)?;
                }
                let (a, b) = (&generated.second, &hand.second);
                for (array, a, b) in [
                    ("zz", &a.zz, &b.zz),
                    ("zq", &a.zq, &b.zq),
                    ("qq", &a.qq, &b.qq),
                    ("force_z", &a.force_z, &b.force_z),
                    ("force_q", &a.force_q, &b.force_q),
                ] {
                    compare(self.name, array, a.as_flattened(), b.as_flattened())?;
                }
            }
        }
        Ok(())
    }

    fn repeat(&self, kernel: Kernel, writer: Writer, times: u32) {
        let mut arguments = Arguments::<f64, N>::boxed(0);
        repeat(&self.model, call(kernel, writer), &mut arguments, times);
    }

    fn nanoseconds(&self, kernel: Kernel) -> Pair {
        self.time::<f64>(kernel)
    }

    fn lanes(&self, kernel: Kernel) -> Pair {
        self.time::<Lanes<4>>(kernel)
    }
}
