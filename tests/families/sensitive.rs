//! Derivatives of motions of models of run-time length: compared with models of fixed size, and with differences of
//! runs.

use crate::lengths::{Seen, of_both_lengths, of_heap};
use tfe::RunErrorKind;
use tfe::family::RunError;
use tfe::prelude::*;
use tfe::{Model, family};

/// Masses that depend on coordinates, forces, outputs with velocities, and a vector of parameters between numbers.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*(1 + q[i]^2)*dot(q[i])^2) + sum(i in 0..n-1, a*dot(q[i])*dot(q[i+1])*sin(q[i]))
        - sum(i in 0..n-1, s[i]/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^4),
    force(q[i]) = -c*dot(q[i]) + c*sin(t),
    output(power) = c*dot(q[0])^2 + s[1]*q[1],
)]
pub(super) struct Long {
    pub(super) n: usize,
    pub(super) m: Vec<f64>,
    pub(super) a: f64,
    pub(super) s: Vec<f64>,
    pub(super) c: f64,
}

#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m[i]/2*(1 + q[i]^2)*dot(q[i])^2) + sum(i in 0..4, a*dot(q[i])*dot(q[i+1])*sin(q[i]))
        - sum(i in 0..4, s[i]/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^4),
    force(q[i]) = -c*dot(q[i]) + c*sin(t),
    output(power) = c*dot(q[0])^2 + s[1]*q[1],
)]
pub(super) struct Five {
    pub(super) m: [f64; 5],
    pub(super) a: f64,
    pub(super) s: [f64; 4],
    pub(super) c: f64,
}

/// A Hamiltonian with momentum-dependent friction.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/(2*m)) + sum(i in 0..n-1, k[i]*(1 - cos(q[i+1] - q[i]))) + sum(i in 0..n, b*q[i]^4),
    force(q[i]) = -c*p[i],
    output(energy) = p[0]^2/(2*m) + b*q[0]^4,
)]
pub(super) struct LongPendula {
    pub(super) n: usize,
    pub(super) m: f64,
    pub(super) k: Vec<f64>,
    pub(super) b: f64,
    pub(super) c: f64,
}

#[dynamics(
    coordinates(q[3]), momenta(p[3]),
    hamiltonian = sum(i in 0..3, p[i]^2/(2*m)) + sum(i in 0..2, k[i]*(1 - cos(q[i+1] - q[i]))) + sum(i in 0..3, b*q[i]^4),
    force(q[i]) = -c*p[i],
    output(energy) = p[0]^2/(2*m) + b*q[0]^4,
)]
pub(super) struct ThreePendula {
    pub(super) m: f64,
    pub(super) k: [f64; 2],
    pub(super) b: f64,
    pub(super) c: f64,
}

/// The largest difference between all derivatives of two runs, relative to the largest derivative; asserts that there
/// are as many.
fn compare<M: family::Model, F: Model<N>, const N: usize>(
    (long, long_run): (&M, Simulation<'_, M, 0, tfe::length::RunTimeLength>),
    fixed_run: &Simulation<'_, F, N>,
    start: State<N>,
    output: &str,
) -> f64 {
    let span = 0.0..1.5;
    let ours = long_run.run_sensitive(of_heap(&start), span.clone());
    let ours = ours.expect("a good run");
    let theirs = fixed_run.run_sensitive(start, span).expect("a good run");
    assert_eq!(ours.parameters(), theirs.parameters());
    assert_eq!(ours.parameters().len(), long.parameters());
    let mut seen = Seen::NOTHING;
    for name in theirs.parameters() {
        let (ours, theirs) = (ours.by(name), theirs.by(name));
        let (a, b) = (ours.states(), theirs.states());
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(a.t, b.t);
            seen.see_nodes(a, b);
        }
        let [a, b] = [ours.output(output), theirs.output(output)];
        seen.see(&a.expect("declared"), &b.expect("declared"));
    }
    let (a, b) = (ours.by_start().matrices(), theirs.by_start().matrices());
    for (a, b) in a.iter().zip(&b) {
        seen.see(a.as_slice(), b.as_slice());
    }
    let a = ours.by_start().output(output).expect("declared");
    let b = theirs.by_start().output(output).expect("declared");
    for (a, b) in a.iter().zip(&b) {
        seen.see(&a.q, &b.q);
        seen.see(&a.p, &b.p);
    }
    seen.part()
}

/// The same model with both kinds of length, and a start.
pub(super) fn pair() -> (Long, Five, State<5>) {
    let (m, s) = ([1.0, 1.5, 0.7, 2.0, 0.4], [1.0, 2.0, 0.5, 3.0]);
    let (a, c) = (0.3, 0.2);
    let (long, five) = of_both_lengths!(Long(5), Five: m, a, s, c);
    let start = five.state([0.3, -0.2, 0.8, 0.1, -0.6], [0.1, 0.5, -0.4, 0.2, 0.9]);
    (long, five, start)
}

/// The same by a Hamiltonian.
pub(super) fn pendula() -> (LongPendula, ThreePendula, State<3>) {
    let (m, k, b, c) = (0.7, [1.3, 2.1], 0.2, 0.15);
    let (long, three) = of_both_lengths!(LongPendula(3), ThreePendula: m, k, b, c);
    let (q, p) = ([0.4, -0.3, 0.9], [0.2, 0.5, -0.1]);
    (long, three, State { q, p })
}

#[test]
fn derivatives_are_those_of_models_of_fixed_size() {
    let (long, five, start) = pair();
    for element in [
        Element::mixed(4),
        Element::mixed(3),
        Element::radau(3),
        Element::primal(3),
    ] {
        // Some nodes are not recorded, and one element ends at a break.
        let ours = Simulation::new(&long)
            .element(element)
            .step(0.1)
            .break_at(0.55)
            .record_every(2);
        let theirs = Simulation::new(&five)
            .element(element)
            .step(0.1)
            .break_at(0.55)
            .record_every(2);
        let off = compare((&long, ours), &theirs, start, "power");
        // The rounding errors of fifteen steps and of both solutions.
        assert!(off < 1e-12, "{element}: {off:.1e}");
    }
    let (long, three, start) = pendula();
    for element in [Element::mixed(4), Element::radau(4)] {
        let ours = Simulation::new(&long).element(element).step(0.1);
        let theirs = Simulation::new(&three).element(element).step(0.1);
        let off = compare((&long, ours), &theirs, start, "energy");
        assert!(off < 1e-12, "{element}: {off:.1e}");
    }
}

/// A hundred sites with a spring each as a parameter, and an impulse during the run: compared with differences of runs.
#[test]
fn derivatives_of_a_hundred_sites_are_differences_of_runs() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, m*dot(q[i])^2/2) - sum(i in 0..n-1, k[i]*((q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/4)),
    )]
    struct Chain {
        n: usize,
        m: f64,
        k: Vec<f64>,
    }
    const N: usize = 100;
    let with = |site: usize, by: f64| {
        let mut k: Vec<f64> = (0..N - 1).map(|i| 1.0 + 0.3 * (i as f64).sin()).collect();
        k[site] += by;
        Chain { n: N, m: 0.8, k }
    };
    let chain = with(0, 0.0);
    let q: Vec<f64> = (0..N).map(|i| (0.4 * i as f64).cos()).collect();
    let start = chain.state(q, vec![0.0; N]);
    let mut kick = vec![0.0; N];
    kick[50] = 0.7;
    let run = |chain: &Chain| {
        let motion = Simulation::new(chain)
            .step(0.1)
            .impulse(0.65, kick.clone())
            .run(start.clone(), 0.0..2.0);
        motion.expect("a good run").last().clone()
    };
    let sensitive = Simulation::new(&chain)
        .step(0.1)
        .impulse(0.65, kick.clone())
        .record_every(100)
        .run_sensitive(start.clone(), 0.0..2.0)
        .expect("a good run");
    assert_eq!(sensitive.parameters().len(), N);
    for site in [0, 37, 50, 98] {
        let found = sensitive.by(&format!("k[{site}]")).last();
        // Differences of sixth order with a spacing at which rounding errors lead to 1e-13.
        let d = 0.008;
        let ends = [1.0, 2.0, 3.0].map(|k| [k, -k].map(|k| run(&with(site, k * d))));
        for a in 0..N {
            let slope = |of: &dyn Fn(&tfe::family::Node) -> f64| {
                let half = |k: usize| of(&ends[k][0]) - of(&ends[k][1]);
                (45.0 * half(0) - 9.0 * half(1) + half(2)) / (60.0 * d)
            };
            for (found, expected) in [
                (found.q[a], slope(&|node| node.q[a])),
                (found.p[a], slope(&|node| node.p[a])),
                (found.v[a], slope(&|node| node.v[a])),
            ] {
                assert!(
                    (found - expected).abs() < 2e-11,
                    "{site} {a}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn what_has_no_derivatives_is_told() {
    let told = |error: RunError| match error.kind() {
        RunErrorKind::Unsupported { call, of } => format!("{call} {of}"),
        other => panic!("{other}"),
    };
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2),
        event(wall) = q[0],
    )]
    struct Masses {
        n: usize,
    }
    let masses = Masses { n: 2 };
    let start = masses.state([1.0, 0.5], [0.0; 2]);
    let run = Simulation::new(&masses).step(0.1);
    // Events that are only recorded change nothing.
    let recorded = run.clone().on("wall", Crossing::Either, |_| Act::Record);
    let with = recorded
        .run_sensitive(start.clone(), 0.0..3.0)
        .expect("a run");
    let without = run.run_sensitive(start, 0.0..3.0).expect("a run");
    assert_eq!(with.by_start().last(), without.by_start().last());
    assert_eq!(with.motion().events().len(), 1);
    assert!(with.get("k").is_none() && with.parameters().is_empty());

    // Steps so long that the run has cut them.
    let (long, ..) = pair();
    let start = long.state([2.0, -1.0, 0.8, 1.5, -0.6], [3.0, 0.5, -4.0, 2.0, 0.9]);
    let run = Simulation::new(&long).step(0.7);
    let cuts = run
        .run(start.clone(), 0.0..2.1)
        .map(|motion| motion.statistics().cuts);
    assert!(cuts.is_ok_and(|cuts| cuts > 0));
    let text = told(
        run.run_sensitive(start, 0.0..2.1)
            .expect_err("steps in halves"),
    );
    assert!(text.ends_with("they were cut"), "{text}");
}
