//! Random calls other than plain runs: derivatives, sections, estimates, ensembles, orbits, boundary values and tables,
//! for models with events and inputs, with initial states, steps and spans of all sizes. No call may panic, and none
//! may return a number that is not finite. `FUZZ_CALLS=100000 cargo test --release -p tfe-light-tests --test
//! fuzz_calls` makes as many calls, `FUZZ_SEED=2` others.

#[path = "common/random.rs"]
mod random;

use random::{Random, setting};
use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use tfe::prelude::*;
use tfe::runtime::Model;
use tfe::runtime::length::{Declared, FixedLength};
use tfe::sensitivity::Loss;
use tfe::{Driven, Occurrence, RunError};

#[dynamics(
    coordinates(x),
    lagrangian = m*dot(x)^2/2 - k/2*x^2 - x^4/4,
    input(u),
    force(x) = u - dot(x)/10,
    event(place) = x,
    event(speed) = dot(x) - 1,
    event(late) = t - 10,
    output(w) = x^2 + ln(abs(x) + 1),
    sensitivity(k, m),
)]
struct Hardening {
    m: f64,
    k: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m*(dot(x)^2 + dot(y)^2)/2 - k*y,
    constraint(rod) = x^2 + y^2 - 1,
    input(u),
    force(x) = u,
    event(place) = x,
    event(speed) = dot(x) - 1,
    event(late) = t - 10,
    output(w) = y/x,
    sensitivity(k, m),
)]
struct Rod {
    m: f64,
    k: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(p, s),
    hamiltonian = (p^2 + s^2)/(2*m) - k/sqrt(x^2 + y^2),
    input(u),
    force(x) = u,
    event(place) = y,
    event(speed) = p - 1,
    event(late) = t - 10,
    output(w) = sqrt(x),
    sensitivity(k, m),
)]
struct Centre {
    m: f64,
    k: f64,
}

#[dynamics(
    coordinates(a, b),
    lagrangian = m*dot(a)^2 + dot(b)^2/2 + cos(a - b)*dot(a)*dot(b) + k*(2*cos(a) + cos(b)),
    input(u),
    force(a) = u - max(dot(b), 0)/10,
    event(place) = sin(a),
    event(speed) = dot(b) - 1,
    event(late) = t - 10,
    output(w) = tan(a),
    sensitivity(k),
)]
struct DoublePendulum {
    m: f64,
    k: f64,
}

const DERIVATIVES: [&str; 4] = ["run_sensitive", "gradient", "hessian", "run_linearised"];

const MOTIONS: [&str; 3] = ["run and its output", "run_estimated", "Ensemble::run"];

const SOLUTIONS: [&str; 3] = ["section", "PeriodicOrbit::solve", "BoundaryValue::solve"];

/// How many calls returned a result, and how many were refused.
type Count = BTreeMap<&'static str, [u32; 2]>;

const MAX_STEPS: f64 = 300.0;

/// Some periods of the models. A longer step is solved in up to 1024 pieces. With events there may be a thousand of them
/// in a step, each of which is found by up to eight such solutions, and a Hessian takes up to 49 gradients.
const LONG_STEP: f64 = 10.0;

fn are_finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|number| number.is_finite())
}

fn is_finite<const N: usize>(state: &State<N>) -> bool {
    are_finite(state.q.iter().chain(&state.p))
}

fn all_finite<const N: usize>(nodes: &[Node<N>]) -> bool {
    nodes.iter().all(|node| is_finite(&node.state()))
}

fn told(error: &dyn std::error::Error) {
    assert!(!error.to_string().is_empty());
}

/// Checks the result of a call; returns false if it was refused.
fn found<T, E: std::error::Error>(outcome: Result<T, E>, look: impl FnOnce(T)) -> bool {
    outcome.inspect_err(|error| told(error)).map(look).is_ok()
}

/// The same for a run, including the partial motion of a refused one.
fn ran<T, const N: usize>(outcome: Result<T, RunError<N>>, look: impl FnOnce(T)) -> bool {
    if let Err(error) = &outcome {
        // The initial state itself may be the reason for the refusal.
        let behind = error.partial().states().get(1..).unwrap_or_default();
        assert!(all_finite(behind), "partial");
    }
    found(outcome, look)
}

/// A random act for an event; some of them use the state that was reached.
fn act<const N: usize>(
    random: &mut Random,
) -> impl Fn(&Occurrence<'_, N>) -> Act<N> + Send + Sync + 'static {
    let which = random.below(6);
    let [a, b] = [(); 2].map(|()| std::array::from_fn(|_| random.number()));
    move |event| match which {
        0 => Act::Stop,
        1 => Act::Impulse(a),
        2 => Act::Restart(State { q: a, p: b }),
        3 => Act::Restart(event.state_with_velocity(a)),
        4 => Act::Restart(event.state_with_velocity(event.v.map(|v| -0.8 * v))),
        _ => Act::Record,
    }
}

/// A random initial state, step and span; the state mostly satisfies the constraints.
fn place<M, const N: usize>(model: &M, random: &mut Random) -> (State<N>, f64, Range<f64>)
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    let [q, p] = [(); 2].map(|()| std::array::from_fn(|_| random.number()));
    let start = match model.consistent_state(q, p) {
        Ok(consistent) if random.below(4) > 0 => consistent.state,
        _ => State { q, p },
    };
    let step = match random.below(12) {
        0 => random.number(),
        1 => 10_f64.powf(random.between(-6.0, 2.0)),
        _ => random.between(0.01, 0.4),
    };
    let from = if random.below(6) == 0 {
        random.number()
    } else {
        0.0
    };
    let to = match random.below(12) {
        0 => random.number(),
        _ => from + random.between(0.5, 6.0) * step,
    };
    (start, step, from..to)
}

/// Makes a random call; returns whether it had a result.
fn call<M, const N: usize>(model: &M, which: &str, random: &mut Random) -> Option<bool>
where
    M: Model<N> + Declared<N, Length = FixedLength> + Clone + Send + Sync,
{
    let (start, step, span) = place(model, random);
    let steps = ((span.end - span.start) / step).abs();
    let is_fast = start.p.iter().any(|p| (1e4..f64::MAX).contains(&p.abs()));
    if steps > MAX_STEPS || which == "hessian" && is_fast {
        return None; // it would take too long
    }
    let element = random.element();
    let mut run: Simulation<'_, M, N> = Simulation::new(model).element(element).step(step);
    if random.below(5) == 0 {
        run = run.break_at(random.number());
    }
    if random.below(4) == 0 {
        let time = random.between(span.start, span.end);
        run = run.impulse(time, std::array::from_fn(|_| random.number()));
    }
    let has_events = random.below(3) == 0;
    if has_events {
        let name = ["place", "speed"][random.below(2) as usize];
        let crossings = [Crossing::Rising, Crossing::Falling, Crossing::Either];
        run = run.on(name, crossings[random.below(3) as usize], act(random));
    }
    let loss = match random.below(3) {
        0 => Loss::output_at_end("w"),
        1 => Loss::integral("w"),
        _ => Loss::squares(
            "w",
            [random.between(span.start, span.end)],
            [random.number()],
        ),
    };
    // Orbits and boundary values take no step, and the ensembles here no events.
    let is_run =
        DERIVATIVES.contains(&which) || MOTIONS[..2].contains(&which) || which == "section";
    if step.abs() > LONG_STEP && (which == "hessian" || is_run && has_events) {
        return None; // it would take too long
    }
    Some(match which {
        "run and its output" => ran(run.run(start, span), |motion| {
            // Velocities are NaN if a mass is zero, as documented.
            for node in motion.states() {
                assert!(is_finite(&node.state()), "{node:?}");
                let here = motion.at(node.t).expect("a node");
                assert!(is_finite(&here.state()), "{here:?}");
            }
        }),
        "run_sensitive" => ran(run.run_sensitive(start, span), |sensitive| {
            for name in sensitive.parameters() {
                assert!(all_finite(&sensitive.by(name).states()), "{name}");
            }
            assert!(
                are_finite(sensitive.by_start().last().iter()),
                "by the start"
            );
        }),
        "gradient" => ran(run.gradient(start, span, &loss), |(value, gradient)| {
            assert!(value.is_finite() && are_finite(gradient.by_parameters()));
            assert!(is_finite(&gradient.by_start()));
        }),
        "hessian" => ran(run.hessian(start, span, &loss, ["k"]), |hessian| {
            assert!(are_finite(hessian.matrix().iter()));
        }),
        "run_linearised" => ran(run.run_linearised(start, span), |linearised| {
            for matrix in linearised.transitions() {
                assert!(are_finite(matrix.iter()));
            }
        }),
        "section" => {
            // A guess close to the last point.
            if !(step > 0.05 && span.start > -3.0 && span.start < 9.0) {
                return None;
            }
            let run = run.on("late", Crossing::Rising, |_| Act::Stop);
            run.section("place", Crossing::Either, start, span.start)
                .take(3)
                .all(|point| {
                    found(point, |point| {
                        assert!(are_finite(point.q.iter().chain(&point.p)));
                    })
                })
        }
        "run_estimated" => ran(run.run_estimated(start, span), |motion| {
            assert!(all_finite(motion.states()));
            assert!(!motion.error_estimate().is_nan());
        }),
        "Ensemble::run" => {
            let starts = (0..random.below(12)).map(|k| match k {
                0..5 => start,
                _ => State {
                    q: start.q,
                    p: std::array::from_fn(|_| random.number()),
                },
            });
            let starts: Vec<_> = starts.collect();
            let ensemble = Ensemble::new(model).element(element).step(step);
            let ends = ensemble.at_kinks(random.below(2) == 0).run(&starts, span);
            let mut arrived = 0;
            found(ends, |ends| {
                assert!(ends.nodes().all(|node| is_finite(&node.state())));
                ends.failures().for_each(|failure| told(failure.kind));
                arrived = ends.nodes().count();
            }) && arrived > 0
        }
        "PeriodicOrbit::solve" => {
            let period = random.between(0.5, 8.0);
            let orbit = PeriodicOrbit::of(model).element(element).guess_from(start);
            let orbit = orbit
                .elements(1 + random.below(6) as usize)
                .max_iterations(10);
            let orbit = match random.below(2) {
                0 => orbit.period(period),
                _ => orbit.unknown_period(period),
            };
            found(orbit.solve(), |orbit| {
                assert!(orbit.period().is_finite() && is_finite(&orbit.start()));
            })
        }
        _ => {
            let end = std::array::from_fn(|_| random.number());
            let problem = BoundaryValue::of(model).element(element).elements(3);
            found(problem.from_to(start.q, end, span).solve(), |arc| {
                assert!(all_finite(&arc.nodes()));
            })
        }
    })
}

/// The model with an input, a line or a table.
fn driven<'m, M, const N: usize>(model: &'m M, random: &mut Random) -> Option<Driven<'m, M>>
where
    M: tfe::runtime::Controlled<N> + Declared<N, Length = FixedLength>,
{
    let (a, b) = (random.number(), random.number());
    let driven = Driven::new(model);
    match random.below(3) {
        0 => {
            let times: Vec<f64> = (0..random.below(5)).map(|k| 0.3 * f64::from(k)).collect();
            let values: Vec<f64> = times.iter().map(|_| random.number()).collect();
            let ways = [
                Interpolation::Hold,
                Interpolation::Linear,
                Interpolation::Spline,
            ];
            driven
                .table("u", &times, &values, ways[random.below(3) as usize])
                .ok()
        }
        _ => driven.input("u", move |t| a + b * t).ok(),
    }
}

/// Makes calls of these kinds.
fn random_calls(kinds: &[&'static str]) {
    let calls = setting("FUZZ_CALLS").unwrap_or(20 * kinds.len() as u32);
    let mut random = Random(setting("FUZZ_SEED").unwrap_or(1).into());
    let mut count = Count::new();
    for turn in 0..calls {
        let Random(seed) = random;
        let which = kinds[random.below(kinds.len() as u32) as usize];
        let (m, k) = match random.below(4) {
            0 => (random.number(), random.number()),
            _ => (1.0, random.between(0.0, 5.0)),
        };
        let model = random.below(4);
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let random = &mut random;
            match model {
                0 => call(&driven(&Hardening { m, k }, random)?, which, random),
                1 => call(&driven(&Rod { m, k }, random)?, which, random),
                2 => call(&driven(&Centre { m, k }, random)?, which, random),
                _ => call(&driven(&DoublePendulum { m, k }, random)?, which, random),
            }
        }));
        let Ok(outcome) = outcome else {
            panic!("turn {turn}, seed {seed}, model {model}: {which}");
        };
        if let Some(is_right) = outcome {
            count.entry(which).or_default()[usize::from(!is_right)] += 1;
        }
    }
    println!("{count:?}");
    // A test in which all calls are refused would say nothing.
    for which in kinds {
        let [right, refused] = count[which];
        assert!(
            right > 0 && refused > 0,
            "{which}: {right} of {}",
            right + refused
        );
    }
}

#[test]
fn random_derivatives_neither_panic_nor_hide_what_is_not_finite() {
    random_calls(&DERIVATIVES);
}

#[test]
fn random_motions_neither_panic_nor_hide_what_is_not_finite() {
    random_calls(&MOTIONS);
}

#[test]
fn random_solutions_neither_panic_nor_hide_what_is_not_finite() {
    random_calls(&SOLUTIONS);
}
