//! The table of `docs/calls.md`: all calls of the library on models of both kinds of length, with and without
//! constraints. Calls that work are run, and the others must be a typed error.
//!
//! `UPDATE_TABLE=1 cargo test --test families the_table` writes the table anew.

use std::error::Error;
use std::fmt::Write as _;
use tfe::prelude::*;
use tfe::sensitivity::Loss;
use tfe::work_precision::WorkPrecision;
use tfe::{Act, Interpolation, Settings, stability};

#[dynamics(
    coordinates(theta),
    lagrangian = m*dot(theta)^2/2 + m*cos(theta),
    input(u),
    force(theta) = u,
    event(hit) = theta,
    output(height) = -cos(theta),
)]
struct Fixed {
    m: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m*(dot(x)^2 + dot(y)^2)/2 - m*y,
    constraint(rod) = x^2 + y^2 - 1,
    input(u),
    force(x) = u,
    event(hit) = x,
    output(height) = y,
)]
struct FixedOnRod {
    m: f64,
}

#[dynamics(
    coordinates(theta[n]),
    lagrangian = sum(i in 0..n, m*dot(theta[i])^2/2 + m*cos(theta[i])),
    input(u),
    force(theta[0]) = u,
    event(hit) = theta[0],
    output(height) = -cos(theta[0]),
)]
struct Long {
    n: usize,
    m: f64,
}

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m*(dot(x[i])^2 + dot(y[i])^2)/2 - m*y[i]),
    constraint(rod[i in 0..n]) = x[i]^2 + y[i]^2 - 1,
    input(u),
    force(x[0]) = u,
    event(hit) = x[0],
    output(height) = y[0],
)]
struct LongOnRods {
    n: usize,
    m: f64,
}

/// The same four models with a kink.
#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 - abs(theta))]
struct Bent;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - abs(x), constraint(rod) = x^2 + y^2 - 1)]
struct BentOnRod;

#[dynamics(coordinates(theta[n]), lagrangian = sum(i in 0..n, dot(theta[i])^2/2 - abs(theta[i])))]
struct LongBent {
    n: usize,
}

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - abs(x[i])),
    constraint(rod[i in 0..n]) = x[i]^2 + y[i]^2 - 1,
)]
struct LongBentOnRods {
    n: usize,
}

type Outcome = Result<(), Box<dyn Error>>;

/// The outcome of a call: it works, or is refused by an error that says so.
fn told(outcome: Outcome) -> String {
    let Err(error) = outcome else {
        return "works".to_owned();
    };
    let text = error.to_string();
    let is_refusal = text.contains(" is not supported for models of run-time length");
    assert!(is_refusal, "no refusal: {text}");
    "refused".to_owned()
}

fn is_finite(values: &[f64]) -> Outcome {
    assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
    Ok(())
}

macro_rules! calls {
    ($model:expr, $start:expr, $rest:expr, $blow:expr, $bent:expr, $bent_start:expr, $loss:expr) => {{
        let (model, bent) = ($model, $bent);
        let (start, rest) = (|| $start(&model), || $rest(&model));
        let run = || Simulation::new(&model).element(Mixed::<4>).step(0.1);
        let span = || 0.0..1.0;
        let mut rows: Vec<(&str, String)> = Vec::new();
        let mut call = |name: &'static str, outcome: &dyn Fn() -> Outcome| {
            rows.push((name, told(outcome())));
        };
        call("`Simulation::run`", &|| {
            is_finite(&run().run(start(), span())?.last().q[..])
        });
        call("`steps`", &|| {
            let node = run().steps(start(), 0.0).take(5).last().ok_or("none")??;
            is_finite(&node.v[..])
        });
        call("`resume`", &|| {
            let first = run().run(start(), 0.0..0.5)?;
            let checkpoint = first.checkpoint().ok_or("none")?;
            is_finite(&run().resume(checkpoint, 1.0)?.last().q[..])
        });
        call("`nodes`, `break_at`, `record_every`", &|| {
            let run = run().nodes([0.0, 0.3, 1.0]).break_at(0.5).record_every(2);
            is_finite(&run.run(start(), span())?.last().q[..])
        });
        call("`impulse`", &|| {
            is_finite(&run().impulse(0.5, $blow).run(start(), span())?.last().q[..])
        });
        call(
            "`on` with `Act::Record`, `Stop`, `Restart`, `Impulse`",
            &|| {
                for which in 0..4 {
                    let run = run().on("hit", Crossing::Either, move |event| match which {
                        0 => Act::Record,
                        1 => Act::Stop,
                        2 => Act::Restart(event.after_impact(0.5)),
                        _ => Act::Impulse($blow),
                    });
                    let motion = run.run(start(), 0.0..2.0)?;
                    assert!(!motion.events().is_empty());
                    is_finite(&motion.last().q[..])?;
                }
                Ok(())
            },
        );
        call("`on` with `Act::Set`", &|| {
            let run = run().on("hit", Crossing::Either, |_| {
                Act::Set(Settings::new("m", 2.0))
            });
            let motion = run.run(start(), 0.0..2.0)?;
            assert!(!motion.settings().is_empty());
            is_finite(&motion.last().q[..])
        });
        call("`on_function`", &|| {
            let run = run().on_function("own", Crossing::Either, |_, q, _| q[0], |_| Act::Record);
            assert!(!run.run(start(), 0.0..2.0)?.events().is_empty());
            Ok(())
        });
        call("`at_kinks` of a model that has any", &|| {
            let run = Simulation::new(&bent).step(0.1).at_kinks(true);
            let motion = run.run($bent_start(&bent), 0.0..2.0)?;
            assert!(motion.statistics().kinks > 0);
            Ok(())
        });
        call("`accuracy`", &|| {
            is_finite(&[run().accuracy(1e-6).run(start(), span())?.error_estimate()])
        });
        call("`accuracy` of a model with kinks", &|| {
            let run = Simulation::new(&bent).accuracy(1e-4);
            Ok(run.run($bent_start(&bent), 0.0..2.0).map(|_| ())?)
        });
        call("`run_estimated`", &|| {
            is_finite(&[run().run_estimated(start(), span())?.error_estimate()])
        });
        call("`input`, `table`", &|| {
            let driven = run().input("u", |t| t.sin());
            is_finite(&driven.run(start(), span())?.last().q[..])?;
            let driven = run().table("u", [0.0, 0.5], [1.0, -1.0], Interpolation::Hold);
            is_finite(&driven.run(start(), span())?.last().q[..])
        });
        call("`hold`", &|| {
            let mut held = run().hold(start(), 0.0)?;
            held.set("u", 0.1);
            held.advance()?;
            is_finite(&held.node().q[..])
        });
        call("`section`", &|| {
            let mut section = run().section("hit", Crossing::Either, start(), 0.0).take(1);
            Ok(section.next().ok_or("none")?.map(|_| ())?)
        });
        call("`run_linearised`", &|| {
            let run = run().run_linearised(start(), span())?;
            is_finite(run.product().as_slice())
        });
        call("`run_sensitive`, also between the nodes", &|| {
            let s = run().run_sensitive(start(), span())?;
            is_finite(s.by_start().at(0.55)?.as_slice())
        });
        call("`gradient`, also of `Loss::integral`", &|| {
            let loss = $loss.and(Loss::integral("height"));
            let (loss, gradient) = run().gradient(start(), span(), &loss)?;
            is_finite(&[loss])?;
            is_finite(gradient.by_parameters())
        });
        call("`hessian`", &|| {
            let hessian = run().hessian(start(), span(), &$loss, ["m"])?;
            is_finite(hessian.matrix().as_slice())
        });
        call(
            "`run_linearised`, `run_sensitive`, `gradient`, `hessian` across events that change the state",
            &|| {
                let run = run().on("hit", Crossing::Either, |event| {
                    Act::Restart(event.after_impact(0.5))
                });
                let matrices = run.run_linearised(start(), span())?;
                assert!(!matrices.motion().events().is_empty());
                is_finite(matrices.product().as_slice())?;
                let s = run.run_sensitive(start(), span())?;
                is_finite(s.by_start().last().as_slice())?;
                let (_, gradient) = run.gradient(start(), span(), &$loss)?;
                is_finite(gradient.by_parameters())?;
                let hessian = run.hessian(start(), span(), &$loss, ["m"])?;
                is_finite(hessian.matrix().as_slice())
            },
        );
        call(
            "`Motion`: `states`, `at`, `energies`, `outputs`, `warnings`, `arcs`, `write_csv`",
            &|| {
                let motion = run().run(start(), span())?;
                is_finite(&motion.at(0.55)?.v[..])?;
                is_finite(motion.energies())?;
                is_finite(&motion.outputs().column("height").ok_or("none")?)?;
                assert_eq!((motion.arcs().count(), motion.warnings().len()), (1, 0));
                let file = format!(
                    "tfe_table_{}_{}.csv",
                    std::process::id(),
                    motion.last().q.len()
                );
                let file = std::env::temp_dir().join(file);
                motion.write_csv(&file)?;
                Ok(std::fs::remove_file(file)?)
            },
        );
        call("`Motion::integral`", &|| {
            is_finite(&run().run(start(), span())?.integral(&model, "height")?)
        });
        call("`Motion::reactions`, `constraint_residual`", &|| {
            let motion = run().run(start(), span())?;
            let rows = motion.reactions().names().len();
            is_finite(motion.reactions().row(5).ok_or("none")?)?;
            assert_eq!(motion.constraint_residual().rank, rows);
            is_finite(&[motion.constraint_residual().position])
        });
        call("`Ensemble::run`, `for_each`, `on`", &|| {
            let ensemble = Ensemble::new(&model).step(0.1);
            let ensemble = ensemble.on("hit", Crossing::Either, |_| Act::Record);
            let ends = ensemble.run(&[start(), start()], span())?;
            assert_eq!(ends.nodes().count(), 2);
            Ok(())
        });
        call("`Ensemble::begin`, `EnsembleRun::run_to`", &|| {
            let ensemble = Ensemble::new(&model).step(0.1);
            let ensemble = ensemble.on("hit", Crossing::Either, |_| Act::Record);
            let mut parts = ensemble.begin(&[start()], 0.0)?;
            let ends = ensemble.run(&[start()], span())?.into_results();
            parts.run_to(span().end / 2.0)?;
            assert_eq!(parts.run_to(span().end)?.into_results(), ends);
            Ok(())
        });
        call("`PeriodicOrbit`", &|| {
            let orbit = PeriodicOrbit::of(&model)
                .elements(10)
                .period(1.0)
                .guess_from(rest());
            assert!(orbit.solve()?.is_stable());
            Ok(())
        });
        call("`PeriodicOrbit::solve_sensitive`", &|| {
            let orbit = PeriodicOrbit::of(&model)
                .elements(10)
                .period(1.0)
                .guess_from(rest());
            assert!(orbit.solve_sensitive()?.by_period().is_some());
            Ok(())
        });
        call("`PeriodicOrbit::of_simulation`", &|| {
            let orbit = PeriodicOrbit::of_simulation(&run());
            let orbit = orbit.elements(10).period(1.0).guess_from(rest());
            assert!(orbit.solve()?.is_stable());
            assert!(orbit.solve_sensitive()?.by_period().is_some());
            Ok(())
        });
        call("`stability::transition_matrix`", &|| {
            let matrix = stability::transition_matrix(&model, Mixed::<4>, &start(), 0.0, 0.1);
            is_finite(matrix?.as_slice())
        });
        call("`WorkPrecision`", &|| {
            let problem = WorkPrecision::new(&model, start(), span());
            let measured = problem.element(Mixed::<3>).steps([0.1, 0.05]).run()?;
            assert_eq!(measured.curves().len(), 1);
            Ok(())
        });
        rows
    }};
}

#[test]
fn the_table() {
    let fixed = calls!(
        Fixed { m: 1.0 },
        |model: &Fixed| model.state([-0.5], [1.0]),
        |model: &Fixed| model.state([0.0], [0.0]),
        [0.1],
        Bent,
        |model: &Bent| model.state([-0.5], [1.0]),
        Loss::at_end(|node| node.q[0])
    );
    let on_rod = calls!(
        FixedOnRod { m: 1.0 },
        |model: &FixedOnRod| model.state([-0.6, -0.8], [0.8, -0.6]),
        |model: &FixedOnRod| model.state([0.0, -1.0], [0.0; 2]),
        [0.1, 0.2],
        BentOnRod,
        |model: &BentOnRod| model.state([-0.6, -0.8], [0.8, -0.6]),
        Loss::at_end(|node| node.q[0])
    );
    let long = calls!(
        Long { n: 3, m: 1.0 },
        |model: &Long| model.state([-0.5; 3], [1.0; 3]),
        |model: &Long| model.state([0.0; 3], [0.0; 3]),
        vec![0.1; 3],
        LongBent { n: 3 },
        |model: &LongBent| model.state([-0.5; 3], [1.0; 3]),
        Loss::of_end(|q, _, _| q[0])
    );
    let on_rods = calls!(
        LongOnRods { n: 1, m: 1.0 },
        |model: &LongOnRods| model.state([-0.6, -0.8], [0.8, -0.6]),
        |model: &LongOnRods| model.state([0.0, -1.0], [0.0; 2]),
        vec![0.1, 0.2],
        LongBentOnRods { n: 1 },
        |model: &LongBentOnRods| model.state([-0.6, -0.8], [0.8, -0.6]),
        Loss::of_end(|q, _, _| q[0])
    );
    let mut table = String::new();
    table.push_str("| call | fixed size | fixed size, constraints | run-time length | run-time length, constraints |\n|---|---|---|---|---|\n");
    for (k, (name, outcome)) in fixed.iter().enumerate() {
        let others = [&on_rod[k], &long[k], &on_rods[k]];
        assert!(others.iter().all(|other| other.0 == *name));
        let [b, c, d] = others.map(|other| &other.1);
        writeln!(table, "| {name} | {outcome} | {b} | {c} | {d} |").expect("a string");
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/calls.md");
    let page = std::fs::read_to_string(path).expect("a page");
    let (before, rest) = page.split_once("| call |").expect("a table");
    let after = rest.split_once("\n\n").map_or("", |(_, after)| after);
    let now = format!("{before}{table}\n{after}");
    if std::env::var_os("UPDATE_TABLE").is_some() {
        std::fs::write(path, now).expect("a page");
        return;
    }
    assert_eq!(page, now, "UPDATE_TABLE=1 writes the table anew");
}
