//! Events of models of run-time length, compared with those of the same model of fixed size.

use crate::chain::{CHAIN, Chain, THREE, Three};
use crate::common::distance;
use crate::lengths::of_both_lengths;
#[cfg(feature = "sparse")]
use crate::rods::Rods;
use std::error::Error;
use tfe::error::RunErrorKind;
use tfe::family;
use tfe::prelude::*;

/// The chain as a Hamiltonian.
#[dynamics(
    coordinates(q[n]),
    momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2) + sum(i in 0..n-1, (q[i+1] - q[i])^2/2 + a/4*(q[i+1] - q[i])^4) + q[0]^2/2,
    event(still) = p[0],
)]
struct Momenta {
    n: usize,
    a: f64,
}

const Q: [f64; 3] = [0.5, -0.5, 0.25];
const V: [f64; 3] = [0.0, 0.5, 1.0];

fn long() -> family::Simulation<'static, Chain> {
    Simulation::new(&CHAIN).element(Mixed::<6>).step(0.2)
}

fn fixed() -> Simulation<'static, Three, 3> {
    Simulation::new(&THREE).element(Mixed::<6>).step(0.2)
}

#[test]
fn recorded_events_change_no_bit() -> Result<(), Box<dyn Error>> {
    let start = || CHAIN.state(Q, V);
    let plain = long().run(start(), 0.0..20.0)?;
    let run = long()
        .on("first", Crossing::Either, |_| Act::Record)
        .on("speed", Crossing::Falling, |_| Act::Record)
        .run(start(), 0.0..20.0)?;
    assert_eq!(run.states(), plain.states());
    let beside = fixed()
        .on("first", Crossing::Either, |_| Act::Record)
        .on("speed", Crossing::Falling, |_| Act::Record)
        .run(THREE.state(Q, V), 0.0..20.0)?;
    assert!(run.events().len() > 5);
    assert_eq!(run.events().len(), beside.events().len());
    for (a, b) in run.events().iter().zip(beside.events()) {
        assert_eq!((&a.name, a.rises), (&b.name, b.rises));
        assert!((a.t - b.t).abs() < 1e-12, "{} {}", a.t, b.t);
        assert!(distance(&a.v, &b.v) < 1e-12 && distance(&a.p, &b.p) < 1e-12);
    }
    Ok(())
}

/// Bounces off a wall, by a given state and by an impact along the normal; stops; impulses.
#[test]
fn acts_are_those_of_fixed_size() -> Result<(), Box<dyn Error>> {
    let run = long()
        .on("wall[2]", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(0.9))
        })
        .run(CHAIN.state(Q, V), 0.0..15.0)?;
    let beside = fixed()
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(0.9))
        })
        .run(THREE.state(Q, V), 0.0..15.0)?;
    assert!(
        run.events().len() > 2,
        "{} {}",
        run.events().len(),
        beside.events().len()
    );
    assert_eq!(run.states().len(), beside.states().len());
    for (a, b) in run.states().iter().zip(beside.states()) {
        assert!((a.t - b.t).abs() < 1e-12);
        assert!(distance(&a.q, &b.q) < 1e-11 && distance(&a.p, &b.p) < 1e-11);
    }
    assert_eq!(run.arcs().count(), run.events().len() + 1);
    assert!(run.states().iter().all(|node| node.q[2] < 0.8 + 1e-12));
    assert!(run.checkpoint().is_some());

    let own = long()
        .on("wall[2]", Crossing::Falling, |event| {
            let mut v = event.v.clone();
            v[2] *= -0.9;
            Act::Restart(event.state_with_velocity(v))
        })
        .run(CHAIN.state(Q, V), 0.0..15.0)?;
    assert!(distance(&own.last().q, &run.last().q) < 1e-12);

    let stopped = long()
        .on("wall[2]", Crossing::Falling, |_| Act::Stop)
        .run(CHAIN.state(Q, V), 0.0..15.0)?;
    assert_eq!(stopped.last().t, run.events()[0].t);
    assert!((stopped.last().q[2] - 0.8).abs() < 1e-14);

    let blow = |event: &tfe::Occurrence<'_, 0, family::RunTimeLength>| {
        Act::Impulse(vec![0.0, 0.0, -1.9 * event.p[2]])
    };
    let struck = long().on("wall[2]", Crossing::Falling, blow);
    let struck = struck.run(CHAIN.state(Q, V), 0.0..15.0)?;
    assert!(distance(&struck.last().q, &run.last().q) < 1e-12);
    Ok(())
}

#[test]
fn momenta_and_functions() -> Result<(), Box<dyn Error>> {
    let chain = Momenta { n: 3, a: 0.5 };
    let start = family::FamilyState {
        q: Q.to_vec(),
        p: V.to_vec(),
    };
    let simulation = Simulation::new(&chain).element(Mixed::<6>).step(0.2);
    let of_momenta = simulation
        .clone()
        .on("still", Crossing::Either, |_| Act::Record);
    let of_momenta = of_momenta.run(start.clone(), 0.0..20.0)?;
    let of_function =
        simulation.on_function("still", Crossing::Either, |_, _, v| v[0], |_| Act::Record);
    let of_function = of_function.run(start, 0.0..20.0)?;
    assert!(of_momenta.events().len() > 5);
    for (a, b) in of_momenta.events().iter().zip(of_function.events()) {
        assert!((a.t - b.t).abs() < 1e-13 && a.p[0].abs() < 1e-14);
    }
    Ok(())
}

/// Steps, halves of runs, accuracies and ensembles handle events as runs do.
#[test]
fn every_kind_of_run() -> Result<(), Box<dyn Error>> {
    let bounce = |event: &tfe::Occurrence<'_, 0, family::RunTimeLength>| {
        Act::Restart(event.after_impact(0.9))
    };
    let start = || CHAIN.state(Q, V);
    let simulation = long().on("wall[2]", Crossing::Falling, bounce);
    let run = simulation.run(start(), 0.0..15.0)?;
    let mut nodes = Vec::new();
    for node in simulation.steps(start(), 0.0).take(run.states().len() - 1) {
        nodes.push(node?);
    }
    assert_eq!(nodes, run.states()[1..]);

    let first = simulation.run(start(), 0.0..4.0)?;
    let checkpoint = first.checkpoint().ok_or("complete")?;
    let second = simulation.resume(checkpoint, 15.0)?;
    assert_eq!(second.last(), run.last());

    let asked = Simulation::new(&CHAIN).on("wall[2]", Crossing::Falling, bounce);
    let accurate = asked.accuracy(1e-9).run(start(), 0.0..15.0)?;
    let fine = Simulation::new(&CHAIN).element(Mixed::<10>).step(0.05);
    let fine = fine
        .on("wall[2]", Crossing::Falling, bounce)
        .run(start(), 0.0..15.0)?;
    assert!(accurate.error_estimate() < 1e-9);
    assert!(distance(&accurate.last().q, &fine.last().q) < 2e-9);

    let ensemble = Ensemble::new(&CHAIN).element(Mixed::<6>).step(0.2);
    let ends = ensemble.on("wall[2]", Crossing::Falling, bounce);
    let ends = ends.run(&[start(), start()], 0.0..15.0)?;
    assert_eq!(ends[1].as_ref(), Ok(run.last()));
    Ok(())
}

/// The points of a section are the events of a run.
#[test]
fn sections() -> Result<(), Box<dyn Error>> {
    let start = || CHAIN.state(Q, V);
    let run = long().on("first", Crossing::Rising, |_| Act::Record);
    let run = run.run(start(), 0.0..50.0)?;
    let points = long().section("first", Crossing::Rising, start(), 0.0);
    let points: Vec<_> = points.take(run.events().len()).collect::<Result<_, _>>()?;
    assert!(points.len() > 5);
    for (point, event) in points.iter().zip(run.events()) {
        assert!((point.t - event.t).abs() < 1e-12 && point.transition().is_none());
        assert!(distance(&point.p, &event.p) < 1e-12);
    }
    Ok(())
}

#[test]
fn what_cannot_be_is_a_typed_error() {
    let kind = |run: family::Simulation<'static, Chain>| {
        let error = run.run(CHAIN.state(Q, V), 0.0..15.0).expect_err("refused");
        error.kind().clone()
    };
    let unknown = kind(long().on("wall[3]", Crossing::Either, |_| Act::Stop));
    let known = ["first", "wall[0]", "wall[1]", "wall[2]", "speed", "power"];
    assert_eq!(
        unknown,
        RunErrorKind::NoEvent {
            name: "wall[3]".to_owned(),
            known: known.map(str::to_owned).to_vec(),
        }
    );
    let set = |name: &'static str, value: f64| {
        let act = move |_: &tfe::Occurrence<'_, 0, family::RunTimeLength>| {
            Act::Set(tfe::Settings::new(name, value))
        };
        kind(long().on("first", Crossing::Either, act))
    };
    let none = set("n", 1.0);
    assert!(matches!(none, RunErrorKind::NoParameter { .. }), "{none}");
    let infinite = set("a", f64::INFINITY);
    assert!(
        matches!(infinite, RunErrorKind::Parameter { .. }),
        "{infinite}"
    );
    // A state that is too short, or not finite.
    for bad in [vec![0.0; 2], vec![f64::NAN; 3]] {
        let act = move |_: &tfe::Occurrence<'_, 0, family::RunTimeLength>| {
            Act::Restart(family::FamilyState {
                q: bad.clone(),
                p: vec![0.0; 3],
            })
        };
        let found = kind(long().on("first", Crossing::Either, act));
        let is_told = matches!(found, RunErrorKind::Family(_) | RunErrorKind::Start { .. });
        assert!(is_told, "{found:?}");
    }
    let short = |_: &tfe::Occurrence<'_, 0, family::RunTimeLength>| Act::Impulse(vec![1.0]);
    let short = kind(long().on("first", Crossing::Either, short));
    assert!(matches!(short, RunErrorKind::Start { .. }), "{short:?}");
}

/// A row of pendulums with rods, the last of which hits a wall: compared with coordinates in angles.
#[cfg(feature = "sparse")]
#[test]
fn impacts_along_constraints() -> Result<(), Box<dyn Error>> {
    #[dynamics(
        coordinates(a, b),
        let x = sin(a) + sin(b),
        let y = -cos(a) - cos(b),
        lagrangian = (dot(sin(a))^2 + dot(cos(a))^2 + dot(x)^2 + dot(y)^2)/2 - (y - cos(a)),
        event(wall) = 1 - x,
    )]
    struct Angles;
    let rods = Rods::of_unit_length(2);
    let (a, b, u, w): (f64, f64, f64, f64) = (0.0, -0.5, 1.5, 2.5);
    let (x, y) = ([a.sin(), a.sin() + b.sin()], [-a.cos(), -a.cos() - b.cos()]);
    let (vx, vy) = (
        [u * a.cos(), u * a.cos() + w * b.cos()],
        [u * a.sin(), u * a.sin() + w * b.sin()],
    );
    let start = rods.state([x[0], x[1], y[0], y[1]], [vx[0], vx[1], vy[0], vy[1]]);
    let run = Simulation::new(&rods)
        .element(Mixed::<8>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(1.0))
        })
        .run(start, 0.0..8.0)?;
    let beside = Simulation::new(&Angles)
        .element(Mixed::<8>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(1.0))
        })
        .run(Angles.state([a, b], [u, w]), 0.0..8.0)?;
    assert!(
        run.events().len() > 1,
        "{} {}",
        run.events().len(),
        beside.events().len()
    );
    assert_eq!(run.events().len(), beside.events().len());
    for (one, other) in run.events().iter().zip(beside.events()) {
        assert!((one.t - other.t).abs() < 1e-11, "{} {}", one.t, other.t);
    }
    let end = beside.last().q;
    assert!((run.last().q[1] - end[0].sin() - end[1].sin()).abs() < 1e-10);
    assert!(run.energy_error() < 1e-11 && run.constraint_residual().position < 1e-13);
    Ok(())
}

/// Springs that are parameters each, and masses that are not.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m*dot(q[i])^2/2) - sum(i in 0..n-1, k[i]*((q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/8)) - k[0]*q[0]^2/2,
    output(first) = q[0],
    output(last) = q[n-1],
)]
struct Springs {
    n: usize,
    m: f64,
    k: Vec<f64>,
}

#[dynamics(
    coordinates(q[3]),
    lagrangian = sum(i in 0..3, m*dot(q[i])^2/2) - sum(i in 0..2, k[i]*((q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/8)) - k[0]*q[0]^2/2,
    output(first) = q[0],
    output(last) = q[2],
)]
struct ThreeSprings {
    m: f64,
    k: [f64; 2],
}

/// A spring yields at one event; at another one masses change, while velocities remain.
#[test]
fn parameters_are_set_at_events() -> Result<(), Box<dyn Error>> {
    let (m, k) = (1.2, [2.0, 3.0]);
    let (springs, three) = of_both_lengths!(Springs(3), ThreeSprings: m, k);
    let span = || 0.0..30.0;
    for every in [1, 7] {
        let long = Simulation::new(&springs)
            .element(Mixed::<6>)
            .step(0.1)
            .record_every(every)
            .on("first", Crossing::Rising, |event| {
                Act::Set(tfe::Settings::new("k[1]", 3.0 + event.t))
            })
            .on("last", Crossing::Falling, |event| {
                let settings = tfe::Settings::new("m", 1.0 + 0.1 * event.t).and("k[0]", 2.5);
                Act::Set(settings.and_velocity(event.v.clone()))
            })
            .run(springs.state(Q, V), span())?;
        let fixed = Simulation::new(&three)
            .element(Mixed::<6>)
            .step(0.1)
            .record_every(every)
            .on("first", Crossing::Rising, |event| {
                Act::Set(tfe::Settings::new("k[1]", 3.0 + event.t))
            })
            .on("last", Crossing::Falling, |event| {
                let settings = tfe::Settings::new("m", 1.0 + 0.1 * event.t).and("k[0]", 2.5);
                Act::Set(settings.and_velocity(event.v))
            })
            .run(three.state(Q, V), span())?;
        assert!(long.events().len() > 4, "{}", long.events().len());
        assert_eq!(long.events().len(), fixed.events().len());
        for (a, b) in long.events().iter().zip(fixed.events()) {
            assert!((a.t - b.t).abs() < 1e-12, "{} {}", a.t, b.t);
        }
        assert_eq!(long.settings().len(), fixed.settings().len());
        assert!(distance(&long.last().q, &fixed.last().q) < 1e-11);
        assert!(distance(&long.last().p, &fixed.last().p) < 1e-11);
        let energies = long.energies().iter().zip(fixed.energies());
        for (a, b) in energies {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
    }
    // The caller's model is unchanged.
    assert_eq!((springs.m, &springs.k[..]), (1.2, &[2.0, 3.0][..]));
    // Steps use the new parameters, too, and so do ensembles.
    let run = Simulation::new(&springs).element(Mixed::<6>).step(0.1).on(
        "first",
        Crossing::Rising,
        |event| Act::Set(tfe::Settings::new("k[1]", 3.0 + event.t)),
    );
    let whole = run.run(springs.state(Q, V), 0.0..10.0)?;
    let mut steps = run.steps(springs.state(Q, V), 0.0);
    let last = steps.find(|node| node.as_ref().is_ok_and(|node| node.t > 9.99));
    let last = last.expect("a step")?;
    assert!(distance(&last.q, &whole.last().q) < 1e-12);
    Ok(())
}
