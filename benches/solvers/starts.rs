//! Thousands of initial states on one core: lanes written by hand, an ensemble, and emitted solvers one after the
//! other.

#[cfg(target_arch = "x86_64")]
use crate::by_hand::{self, LANES, SideBySide};
use crate::scenes::{HenonHeiles, HenonHeiles4, HenonHeiles9, Kepler, Kepler4, Kepler9};
use crate::scenes::{Pendulum, Pendulum4, Pendulum9};
use crate::{Failure, cell};
use std::hint::black_box;
use std::time::{Duration, Instant};
use tfe::prelude::*;

const STARTS: usize = 4096;
const STEPS: u32 = 50;
const TURNS: u32 = 7;

/// The coordinates at the ends and the time; `None` if the processor cannot run it.
type Outcome<const N: usize> = Option<(Vec<[f64; N]>, Duration)>;

/// An ensemble on one core.
fn alone<T: Send>(f: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    #[cfg(feature = "parallel")]
    {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        Ok(one.install(f))
    }
    #[cfg(not(feature = "parallel"))]
    Ok(f())
}

fn of_ensemble<M, const N: usize>(
    model: &M,
    element: Element,
    h: f64,
    starts: &[State<N>],
) -> Result<Outcome<N>, Failure>
where
    M: Model<N> + Sync,
{
    let ensemble = Ensemble::new(model).element(element).step(h);
    let (ends, time) = alone(|| {
        let clock = Instant::now();
        let ends = ensemble.run(black_box(starts), 0.0..h * f64::from(STEPS));
        (ends, clock.elapsed())
    })?;
    let (ends, mut coordinates) = (ends?, Vec::with_capacity(starts.len()));
    for end in &ends {
        match end {
            Ok(end) => coordinates.push(end.q),
            Err(error) => return Err(error.to_string().into()),
        }
    }
    Ok(Some((coordinates, time)))
}

/// Momenta that are equal to velocities.
#[cfg(target_arch = "x86_64")]
fn by_hand<F, const N: usize, const K: usize>(
    model: F,
    h: f64,
    starts: &[State<N>],
) -> Result<Outcome<N>, Failure>
where
    F: by_hand::SecondOrder<N>,
{
    let Some(isa) = by_hand::V3::try_new() else {
        return Ok(None);
    };
    let mut stepper = SideBySide::<_, N, K>::new(isa, model, h);
    let mut ends = Vec::with_capacity(starts.len());
    let clock = Instant::now();
    for eight in black_box(starts).as_chunks::<LANES>().0 {
        stepper.start(&eight.map(|start| (start.q, start.p)));
        for _ in 0..STEPS {
            if !stepper.advance() {
                return Err("the stepper written by hand failed".into());
            }
        }
        ends.extend((0..LANES).map(|lane| stepper.coordinates(lane)));
    }
    Ok(Some((ends, clock.elapsed())))
}

/// A row of the table: name, model, initial states; the emitted solver, its number of nodes and its step; the stepper
/// written by hand.
macro_rules! compare {
    ($name:literal, $model:expr, $starts:expr, $solver:ident $nodes:literal, $h:literal, $hand:expr) => {{
        let (model, starts) = ($model, &$starts);
        let one_by_one = || {
            let mut ends = Vec::with_capacity(STARTS);
            let clock = Instant::now();
            for start in black_box(starts) {
                let (mut solver, mut state) = ($solver::new(&model, $h), *start);
                for _ in 0..STEPS {
                    solver.advance(&mut state)?;
                }
                ends.push(state.q);
            }
            Ok(Some((ends, clock.elapsed())))
        };
        #[cfg(target_arch = "x86_64")]
        let hand = || by_hand::<_, _, { $nodes - 1 }>($hand, $h, starts);
        #[cfg(not(target_arch = "x86_64"))]
        let hand = || Ok(None);
        let ensemble = || of_ensemble(&model, Mixed::<$nodes>.into(), $h, starts);
        show($name, $nodes, [&hand, &ensemble, &one_by_one])?;
    }};
}

/// Runs each in turn, so that all see the same machine.
fn show<const N: usize>(
    name: &str,
    nodes: u32,
    kinds: [&dyn Fn() -> Result<Outcome<N>, Failure>; 3],
) -> Result<(), Failure> {
    let (mut best, mut ends) = ([None; 3], [const { Vec::new() }; 3]);
    for _ in 0..TURNS {
        for ((best, ends), kind) in best.iter_mut().zip(&mut ends).zip(kinds) {
            if let Some((found, time)) = kind()? {
                *best = Some(best.unwrap_or(time).min(time));
                *ends = found;
            }
        }
    }
    let steps = STARTS as f64 * f64::from(STEPS);
    let [hand, ensemble, one_by_one] =
        best.map(|time| time.map(|time| time.as_secs_f64() * 1e9 / steps));
    let ratio = |x: Option<f64>, y: Option<f64>| Some(x? / y?);
    let mut difference = 0.0_f64;
    for (x, y) in ends[1].iter().zip(&ends[2]) {
        for a in 0..N {
            let off = (x[a] - y[a]).abs();
            assert!(!off.is_nan(), "{name}: {x:?} {y:?}");
            difference = difference.max(off);
        }
    }
    println!(
        "{name:<16} {nodes}  {:>6} {:>8} {:>10}  {:>5} {:>5}  {difference:.0e}",
        cell(hand, 1),
        cell(ensemble, 1),
        cell(one_by_one, 1),
        cell(ratio(ensemble, hand), 2),
        cell(ratio(ensemble, one_by_one), 2),
    );
    Ok(())
}

/// A number of values evenly distributed between two ends.
fn starts<const N: usize>(start: impl Fn(f64) -> State<N>) -> Vec<State<N>> {
    (0..STARTS)
        .map(|k| start(k as f64 / STARTS as f64))
        .collect()
}

/// Prints the table.
pub fn show_all() -> Result<(), Failure> {
    println!("\n{STARTS} initial states on one core, nanoseconds per step of one");
    println!("scene          nodes    hand ensemble one by one    e/h   e/o  difference");
    let angles = starts(|f| Pendulum {}.state([2.5 * f], [0.0]));
    compare!("pendulum", Pendulum {}, angles, Pendulum4 4, 0.1, by_hand::Pendulum);
    compare!("pendulum", Pendulum {}, angles, Pendulum9 9, 1.0, by_hand::Pendulum);
    let orbits = starts(|f| Kepler {}.state([0.5 + 0.3 * f, 0.0], [0.0, 1.4]));
    compare!("kepler", Kepler {}, orbits, Kepler4 4, 0.02, by_hand::Kepler);
    compare!("kepler", Kepler {}, orbits, Kepler9 9, 0.2, by_hand::Kepler);
    let stars = starts(|f| State {
        q: [0.3 * f, 0.1],
        p: [0.2, 0.1],
    });
    compare!("henon-heiles", HenonHeiles {}, stars, HenonHeiles4 4, 0.1, by_hand::HenonHeiles);
    compare!("henon-heiles", HenonHeiles {}, stars, HenonHeiles9 9, 1.0, by_hand::HenonHeiles);
    Ok(())
}
