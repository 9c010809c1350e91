//! Runs of all kinds, and emitted solvers.

use super::models::{DOUBLE, EmittedDouble, EmittedGalaxy, HenonHeiles, Landing};
use super::{List, Outcome, ran};
use tfe::Statistics;
use tfe::prelude::*;

/// Other features of simulations.
pub(super) fn ways_to_run(list: &mut List) {
    let double = Simulation::new(&DOUBLE).element(Mixed::<4>).step(0.03);
    let start = DOUBLE.state([0.9, -0.4], [0.2, 0.5]);
    let simulation = double.clone();
    list.add("steps", move || {
        let nodes = simulation.steps(start, 0.5).take(20).flatten();
        let last = nodes.last();
        let numbers = last
            .into_iter()
            .flat_map(|end| end.q.into_iter().chain(end.p).chain(end.v));
        Outcome::with(numbers, &Statistics::default())
    });
    let simulation = double.clone().record_every(7);
    list.add("few nodes recorded", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.6)))
    });
    let simulation = double.clone().tolerance(1e-6);
    list.add("loose tolerance", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.6)))
    });
    let simulation = double.clone().solver(Solve::FixedPoint);
    list.add("fixed point", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.6)))
    });
    let simulation = double.clone();
    list.add("backwards", move || {
        Outcome::of(&ran(simulation.run(start, 0.6..0.0)))
    });
    let simulation = double.clone();
    list.add("between nodes", move || {
        let motion = ran(simulation.run(start, 0.0..0.6));
        let inside = [0.011, 0.2, 0.433, 0.59]
            .map(|t| motion.at(t))
            .into_iter()
            .flatten();
        let numbers = inside.flat_map(|node| node.q.into_iter().chain(node.p).chain(node.v));
        Outcome::with(numbers.collect::<Vec<_>>(), motion.statistics())
    });
    let simulation = double.clone().break_at(0.21).break_at(0.4);
    list.add("breaks", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.6)))
    });
    let simulation = double
        .clone()
        .impulse(0.1, [0.2, -0.1])
        .impulse(0.31, [0.0, 0.3]);
    list.add("impulses", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.6)))
    });
    let simulation = double.clone().element(Mixed::<4>).step(0.4);
    list.add("long steps that are cut", move || {
        let wild = DOUBLE.state([2.8, 1.9], [0.0, 0.0]);
        Outcome::of(&ran(simulation.run(wild, 0.0..4.0)))
    });
    let simulation = double.clone();
    list.add("transition matrices of a run", move || {
        match simulation.run_linearised(start, 0.0..0.6) {
            Ok(linearised) => {
                let matrix = linearised.product();
                Outcome::with(
                    matrix.iter().copied().collect::<Vec<_>>(),
                    &Statistics::default(),
                )
            }
            Err(_) => Outcome::default(),
        }
    });
    let simulation = double.clone();
    list.add("derivatives by parameters and start", move || {
        let numbers = simulation.run_sensitive(start, 0.0..0.6).map(|sensitive| {
            let by_g = sensitive.by("g").last();
            let by_start = sensitive.by_start().last().clone();
            let by_start: Vec<f64> = by_start.iter().copied().collect();
            by_g.q
                .into_iter()
                .chain(by_g.p)
                .chain(by_start)
                .collect::<Vec<_>>()
        });
        Outcome::with(numbers.unwrap_or_default(), &Statistics::default())
    });
    let simulation = double.clone().on("bottom", Crossing::Rising, |event| {
        Act::Impulse(event.v.map(|v| 0.01 * v))
    });
    list.add("events", move || {
        let motion = ran(simulation.run(start, 0.0..3.0));
        let mut outcome = Outcome::of(&motion);
        outcome
            .numbers
            .extend(motion.events().iter().map(|event| event.t));
        outcome
    });
    let simulation = double.clone();
    list.add("accuracy", move || {
        let run = simulation.clone().accuracy(1e-7).run(start, 0.0..1.0);
        run.map_or_else(
            |_| Outcome::default(),
            |estimated| Outcome::of(estimated.motion()),
        )
    });
    list.add("estimated error", move || {
        let estimated = double.run_estimated(start, 0.0..0.6);
        estimated.map_or_else(
            |_| Outcome::default(),
            |estimated| {
                let mut outcome = Outcome::of(estimated.motion());
                outcome.numbers.push(estimated.error_estimate());
                outcome
            },
        )
    });
    static LANDING: Landing = Landing { g: 10.0, k: 1e4 };
    let landing = Simulation::new(&LANDING).element(Mixed::<6>).step(0.02);
    let start = LANDING.state([0.05], [0.0]);
    let simulation = landing.clone().at_kinks(true);
    list.add("kinks", move || {
        Outcome::of(&ran(simulation.run(start, 0.0..0.5)))
    });
    list.add("uncut kinks", move || {
        Outcome::of(&ran(landing.run(start, 0.0..0.5)))
    });
}

pub(super) fn emitted(list: &mut List) {
    list.add("emitted double pendulum", || {
        let mut solver = EmittedDouble::new(&DOUBLE, 0.03);
        let mut state = DOUBLE.state([0.9, -0.4], [0.2, 0.5]);
        for _ in 0..20 {
            if solver.advance(&mut state).is_err() {
                break;
            }
        }
        Outcome::with(state.q.into_iter().chain(state.p), solver.statistics())
    });
    list.add("emitted Hénon–Heiles", || {
        let mut solver = EmittedGalaxy::new(&HenonHeiles, 0.2);
        let mut state = State {
            q: [0.1, 0.2],
            p: [0.3, 0.1],
        };
        for _ in 0..20 {
            if solver.advance(&mut state).is_err() {
                break;
            }
        }
        Outcome::with(state.q.into_iter().chain(state.p), solver.statistics())
    });
}
