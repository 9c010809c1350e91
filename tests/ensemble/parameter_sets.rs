//! Many models of one kind: each gives the same as alone, whatever runs in the other lanes.

use super::{DoublePendulum, Driven, HenonHeiles, Pendulum, PendulumH, distance, fractions};
use tfe::ensemble::EnsembleError;
use tfe::prelude::*;

/// Models in lanes compared with single runs; the result for a model does not depend by a single bit on those in the
/// other lanes.
fn models_agree<M, const N: usize>(
    models: &[M],
    element: impl Into<Element> + Copy,
    start: State<N>,
) where
    M: Model<N> + Sync,
{
    let span = 0.0..5.03;
    let run = |models: &[M]| {
        let ensemble = Ensemble::of_models(models).element(element).step(0.05);
        let ends = ensemble.run(&[start], span.clone());
        ends.expect("a good plan").into_results()
    };
    let ends = run(models);
    let starts = vec![start; models.len()];
    let ensemble = Ensemble::of_models(models).element(element).step(0.05);
    let same = ensemble.run(&starts, span.clone()).expect("a good plan");
    assert_eq!(ends, same.into_results());
    assert_eq!(ends[3..], run(&models[3..]));
    for (model, end) in models.iter().zip(ends) {
        let simulation = Simulation::new(model).element(element).step(0.05);
        let motion = simulation
            .run(start, span.clone())
            .expect("a regular motion");
        // The rounding errors of a hundred steps, in motions that hardly amplify them.
        let error = distance(&end.expect("an end"), motion.last());
        assert!(error <= 1e-13, "{error:.1e}");
    }
}

#[test]
fn parameter_sets() {
    let models: Vec<_> = fractions(19).map(|f| Driven { c: f }).collect();
    models_agree(&models, Mixed::<4>, models[0].state([1.0], [0.0]));
    models_agree(&models, Radau::<3>, models[0].state([1.0], [0.0]));
    // A constant mass, different in each lane.
    let models: Vec<_> = fractions(11)
        .map(|f| Pendulum {
            m: 0.1 + f,
            l: 1.3 - f,
            g: 9.81 * (1.0 + f),
        })
        .collect();
    let start = State {
        q: [0.4],
        p: [0.01],
    };
    models_agree(&models, Mixed::<6>, start);
    let models: Vec<_> = fractions(9)
        .map(|f| PendulumH {
            m: 0.5 + f,
            l: 1.3 - f,
            g: 9.81,
        })
        .collect();
    models_agree(&models, Mixed::<6>, start);
    let start = State {
        q: [0.1, 0.2],
        p: [0.2, 0.1],
    };
    let models: Vec<_> = fractions(12).map(|f| HenonHeiles { lambda: f }).collect();
    models_agree(&models, Mixed::<5>, start);
    let models: Vec<_> = fractions(9)
        .map(|f| DoublePendulum { g: 1.0 + f })
        .collect();
    models_agree(&models, Mixed::<6>, start);
    // One after the other, since elements with full quadrature do not support lanes.
    models_agree(&models[..5], Primal::<3>, start);

    let models: Vec<_> = fractions(7).map(|f| Driven { c: f }).collect();
    let start = models[0].state([1.0], [0.0]);
    let two = Ensemble::of_models(&models)
        .step(0.1)
        .run(&[start; 2], 0.0..5.0);
    assert_eq!(
        two,
        Err(EnsembleError::Starts {
            models: 7,
            starts: 2
        })
    );
    let none = Ensemble::of_models(&models[..0]).run(&[start], 0.0..5.0);
    assert_eq!(none.expect("nothing to do").len(), 0);
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^4/4, input(u), force(x) = u)]
struct Pushed {
    k: f64,
}

/// Each model is driven by its own function, whatever runs in the other lanes.
#[test]
fn inputs_are_those_of_each_model() {
    let plain: Vec<_> = fractions(11).map(|k| Pushed { k }).collect();
    let numbered = || plain.iter().zip(0..);
    let own: Vec<_> = numbered()
        .map(|(model, i)| {
            let phase = f64::from(i);
            let driven = tfe::Driven::new(model).input("u", move |t| (t + phase).cos());
            driven.expect("an input")
        })
        .collect();
    let table: Vec<_> = numbered()
        .map(|(model, i)| {
            let driven = tfe::Driven::new(model);
            let values = [f64::from(i), 1.0, 0.0];
            (driven.table("u", &[0.0, 1.0, 5.0], &values, tfe::Interpolation::Linear)).expect("one")
        })
        .collect();
    let start = plain[0].state([1.0], [0.0]);
    models_agree(&own, Mixed::<6>, start);
    models_agree(&table, Mixed::<4>, start);
}

/// A model in a lane whose iteration does not contract is solved separately, with its own parameters; one that fails
/// does not stop the others.
#[test]
fn some_parameter_sets_go_their_own_way() {
    let mut models: Vec<_> = fractions(13).map(|f| Driven { c: f }).collect();
    models[2].c = 2e3;
    models[5].c = f64::NAN;
    models[9].c = 5e2;
    let start = models[0].state([1.0], [0.0]);
    let ends = Ensemble::of_models(&models)
        .element(Radau::<3>)
        .step(0.1)
        .run(&[start], 0.0..3.0)
        .expect("a good plan");
    assert!(ends[5].is_err() && ends.failures().count() == 1);
    assert!(ends.statistics().newton_iterations > 0);
    for (model, end) in models.iter().zip(&ends).filter(|(_, end)| end.is_ok()) {
        let simulation = Simulation::new(model).element(Radau::<3>).step(0.1);
        let motion = simulation.run(start, 0.0..3.0).expect("a regular motion");
        let error = distance(end.as_ref().expect("an end"), motion.last());
        assert!(error <= 1e-12, "c = {}: {error:.1e}", model.c);
    }
}

/// Two springs, and a coupling that contains an integer.
#[dynamics(
    coordinates(q[2]),
    lagrangian = sum(i in 0..2, m/2*dot(q[i])^2 - k[i]/4*q[i]^4) + order*cos(q[0] - q[1]),
)]
struct Springs {
    m: f64,
    k: Vec<f64>,
    order: usize,
}

/// The numbers of a vector, and an integer, are those of each model; if they are equal for all, lanes are used.
#[test]
fn what_has_no_number_is_that_of_each_model() {
    let start = State {
        q: [0.5, -0.3],
        p: [0.2, 0.1],
    };
    let model = |f: f64, order| Springs {
        m: 1.0 + f,
        k: vec![1.0, 2.0],
        order,
    };
    let same: Vec<_> = fractions(11).map(|f| model(f, 1)).collect();
    models_agree(&same, Mixed::<6>, start);
    let orders: Vec<_> = (0..11).map(|order| model(0.0, order)).collect();
    models_agree(&orders, Mixed::<6>, start);
    let vectors: Vec<_> = fractions(11)
        .map(|f| Springs {
            k: vec![1.0 + f, 2.0 - f],
            ..model(f, 1)
        })
        .collect();
    models_agree(&vectors, Mixed::<6>, start);
}
