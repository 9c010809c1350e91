//! Random runs: models with singularities, masses of any size and sign, steps from far too short to absurdly long, all
//! elements and iterations. No run may panic, and none may return a state or an energy that is not finite without an
//! error or a warning. `FUZZ_RUNS=1000000 cargo test --release --test fuzz_runs` makes as many runs, `FUZZ_SEED=2`
//! others.

#[path = "common/random.rs"]
mod random;

use random::{Random, setting};
use std::panic::{AssertUnwindSafe, catch_unwind};
use tfe::prelude::*;
use tfe::runtime::Model;
use tfe::runtime::length::{Declared, FixedLength};
use tfe::{Node, Warning};

#[dynamics(coordinates(x, y), lagrangian = m*(dot(x)^2 + dot(y)^2)/2 + k/sqrt(x^2 + y^2))]
struct Centre {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x), lagrangian = m*dot(x)^2/2 - k*ln(x))]
struct Logarithm {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(a, b), lagrangian = m*dot(a)^2 + dot(b)^2/2 + cos(a - b)*dot(a)*dot(b) + k*(2*cos(a) + cos(b)))]
struct DoublePendulum {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x, y), momenta(u, v), hamiltonian = (u^2 + v^2)/(2*m) + (x^2 + y^2)/2 + k*(x^2*y - y^3/3))]
struct HenonHeiles {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x, y), lagrangian = m*(dot(x)^2 + dot(y)^2)/2 - k*y, constraint(cusp) = y^3 - x^2)]
struct Cusp {
    m: f64,
    k: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m*(dot(x)^2 + dot(y)^2)/2 - k*y,
    constraint(rod) = x^2 + y^2 - 1,
    constraint(again) = sqrt(x^2 + y^2) - 1,
)]
struct TwiceHeld {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x, y, a), lagrangian = m*(dot(x)^2 + dot(y)^2 + dot(a)^2)/2 + k*x, constraint(blade) = dot(x)*sin(a) - dot(y)*cos(a))]
struct Knife {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(y), lagrangian = m*dot(y)^2/2 - y - k/2*min(y, 0)^2, force(y) = -sign(dot(y))/10 + select(t < 1, 1, 0))]
struct Bounce {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x), lagrangian = m*dot(x)^2/2, force(x) = k*(1 - x^2)*dot(x) - x + exp(x)/100)]
struct VanDerPol {
    m: f64,
    k: f64,
}

#[dynamics(coordinates(x), lagrangian = m*dot(x)^2/2 - k*x^2/2)]
struct Oscillator {
    m: f64,
    k: f64,
}

/// The counts of the runs.
#[derive(Debug, Default)]
struct Count {
    right: u32,
    warned: u32,
    refused: u32,
}

fn is_finite<const N: usize>(node: &Node<N>) -> bool {
    let numbers = node.q.iter().chain(&node.p);
    numbers.copied().all(f64::is_finite) && node.t.is_finite()
}

/// Makes one run of a model.
fn one<M, const N: usize>(model: &M, is_tame: bool, random: &mut Random, count: &mut Count)
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    let mut start = State {
        q: [0.0; N],
        p: [0.0; N],
    };
    for a in 0..N {
        (start.q[a], start.p[a]) = (random.number(), random.number());
    }
    if !M::CONSTRAINTS.is_empty() && random.below(5) > 0 {
        let Ok(consistent) = model.consistent_state(start.q, start.p) else {
            count.refused += 1;
            return;
        };
        start = consistent.state;
    }
    let (element, steps) = (random.element(), 1 + random.below(8));
    let step = 10_f64.powf(match random.below(4) {
        0 => random.between(-9.0, 3.0),
        _ => random.between(-2.0, 0.5),
    });
    let from = if random.below(10) == 0 {
        random.number()
    } else {
        0.0
    };
    let run: Simulation<'_, M, N> = Simulation::new(model);
    let mut run = run.element(element);
    run = match random.below(6) {
        0 => run.solver(Solve::FixedPoint),
        1 => run.solver(Solve::Newton),
        2 => run.solver(Solve::Trusting),
        _ => run,
    };
    if random.below(6) == 0 {
        run = run.tolerance(10_f64.powf(random.between(-16.0, 1.0)));
    }
    let end = from + f64::from(steps) * step;
    // Other accuracies would rightly take millions of steps.
    let numbers = start.q.iter().chain(&start.p);
    let is_short = f64::from(steps) * step < 3.0;
    let is_tame =
        is_tame && is_short && element.order() > 3 && numbers.copied().all(|x| x.abs() < 3.0);
    let outcome = match random.below(6) {
        0 if is_tame => {
            let accuracy = 10_f64.powf(random.between(-8.0, -1.0));
            let run = run.accuracy(accuracy).run(start, from..end);
            run.map(tfe::accuracy::Estimated::into_motion)
        }
        _ => run
            .step(step)
            .max_iterations(1 + random.below(100))
            .at_kinks(random.below(3) == 0)
            .run(start, from..end),
    };
    match outcome {
        Ok(motion) => {
            assert!(motion.states().iter().all(is_finite), "a state");
            let told = |warning: &Warning| matches!(warning, Warning::EnergyNotFinite { .. });
            let is_told = motion.warnings().iter().any(told);
            let is_finite = motion.energies().iter().all(|energy| energy.is_finite());
            assert!(is_finite || is_told, "an energy: {:?}", motion.energies());
            if motion.warnings().is_empty() {
                count.right += 1;
            } else {
                count.warned += 1;
            }
        }
        Err(error) => {
            assert!(
                error.partial().states().iter().skip(1).all(is_finite),
                "partial"
            );
            assert!(!error.to_string().is_empty());
            count.refused += 1;
        }
    }
}

// Two tests of the same kind, so that they run in parallel.
#[test]
fn random_runs_neither_panic_nor_hide_what_is_not_finite() {
    random_runs(setting("FUZZ_SEED").unwrap_or(1));
}

#[test]
fn nor_do_others() {
    random_runs(setting("FUZZ_SEED").unwrap_or(1) + 1);
}

fn random_runs(seed: u32) {
    let runs = setting("FUZZ_RUNS").unwrap_or(1500);
    let mut random = Random(seed.into());
    let mut count = Count::default();
    for run in 0..runs {
        let Random(seed) = random;
        let (m, k) = match random.below(4) {
            0 => (random.number(), random.number()),
            _ => (1.0, random.between(0.0, 10.0)),
        };
        let which = random.below(10);
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let (random, count) = (&mut random, &mut count);
            let tame = m > 0.1 && k.abs() < 10.0;
            match which {
                0 => one(&Centre { m, k }, false, random, count),
                1 => one(&Logarithm { m, k }, false, random, count),
                2 => one(&DoublePendulum { m, k }, tame, random, count),
                3 => one(&HenonHeiles { m, k }, tame, random, count),
                4 => one(&Cusp { m, k }, tame, random, count),
                5 => one(&TwiceHeld { m, k }, tame, random, count),
                6 => one(&Knife { m, k }, tame, random, count),
                7 => one(&Bounce { m, k }, tame, random, count),
                8 => one(&VanDerPol { m, k }, tame, random, count),
                _ => one(&Oscillator { m, k }, tame, random, count),
            }
        }));
        assert!(outcome.is_ok(), "run {run}, seed {seed}, model {which}");
    }
    println!("{count:?}");
    // A test in which nothing runs would say nothing.
    assert!(count.right > runs / 4, "{count:?}");
}
