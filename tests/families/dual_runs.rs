//! Derivatives of a run of a hundred sites compared with an independent solver in dual numbers.

use super::gradient::{Chain, chain};
use crate::duals::{self, Beside, Phase, number};
use crate::lengths::Seen;
use tfe::family::{Gradient, Loss, Model as _};
use tfe::prelude::*;
use tfe::runtime::dual::Dual;

/// Rates and forces; the mass matrix is diagonal and constant, so that L_v at velocities of one gives it.
fn flow(model: &Chain, time: Dual, (q, p): (&[Dual], &[Dual]), rate: &mut Vec<Dual>) -> Vec<Dual> {
    let n = q.len();
    let first = |v: &[Dual]| {
        let zero = vec![number(0.0); n];
        let [mut z, mut by_q, mut force] = [zero.clone(), zero.clone(), zero];
        let into = Gradient {
            z: &mut z,
            q: &mut by_q,
            force: &mut force,
        };
        model.first(time, q, v, into);
        [z, by_q, force]
    };
    let [mass, ..] = first(&vec![number(1.0); n]);
    *rate = p.iter().zip(mass).map(|(p, m)| *p / m).collect();
    let [_, by_q, force] = first(rate);
    by_q.iter().zip(force).map(|(q, f)| *q + f).collect()
}

#[test]
fn derivatives_of_a_hundred_sites_are_those_of_runs_in_dual_numbers() {
    const SITES: usize = 100;
    let (model, start) = chain(SITES);
    let element = Element::mixed(4);
    let (steps, h) = (4_u32, 0.05);
    let length = f64::from(steps) * h;
    let run = Simulation::new(&model).element(element).step(h);
    let s = run.run_sensitive(start.clone(), 0.0..length);
    let s = s.expect("derivatives");
    let end = |start: &Phase, parameter: Option<usize>| {
        (0..steps).fold(start.clone(), |at, step| {
            let begin = number(f64::from(step) * h);
            duals::element_end(element, &at, (begin, number(h)), |t, at, rate| {
                flow(&model, t.by_parameter(parameter), at, rate)
            })
        })
    };
    let loss = |q: &[f64], p: &[f64]| -> f64 {
        let weight = |a: usize| (1.0 + a as f64).sin();
        let terms = q.iter().chain(p).enumerate();
        terms.map(|(a, x)| weight(a) * x).sum()
    };
    let at_end = Loss::of_end(move |q, p, _| loss(q, p));
    let (_, gradient) = run
        .gradient(start.clone(), 0.0..length, &at_end)
        .expect("a gradient");
    let mut beside = Beside::new((&start.q, &start.p), &end);
    let mut seen = Seen::NOTHING;
    // Every thirteenth mass and spring, and all parameters common to all sites; gradients are compared with all of
    // these.
    assert_eq!(s.parameters().len(), 2 * SITES - 1 + 4);
    for (index, name) in s.parameters().iter().enumerate() {
        let by = s.by(name).last();
        seen.see(&[gradient.by(name)], &[loss(&by.q, &by.p)]);
        if index % 13 == 0 || index >= 2 * SITES - 1 {
            beside.by_parameter(index, &by.q, &by.p);
        }
    }
    let matrix = s.by_start().last();
    for column in 0..2 * SITES {
        let found: Vec<f64> = matrix.column(column).iter().copied().collect();
        let backwards = gradient.by_start();
        let (backwards, a) = match column.checked_sub(SITES) {
            None => (&backwards.p, column),
            Some(a) => (&backwards.q, a),
        };
        let forwards = loss(&found[SITES..], &found[..SITES]);
        seen.see(&[backwards[a]], &[forwards]);
        if column % 23 == 0 {
            beside.by_start(column, &found[SITES..], &found[..SITES]);
        }
    }
    // The rounding errors of four steps of both.
    assert!(beside.off() < 1e-12, "{:.1e}", beside.off());
    assert!(seen.part() < 1e-12, "{:.1e} of {:.1e}", seen.off, seen.size);
}
