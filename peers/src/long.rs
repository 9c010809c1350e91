//! A lattice of 1024 sites: a model of run-time length compared with the peers.

use crate::run::{Problem, Run, de, fixed, ode_solvers};
use crate::scenes::Start;
use crate::system::System;
use crate::ways::{self, Way, Ways};
use std::error::Error;
use std::time::Instant;
use tfe::family::{FamilyState, Node as FamilyNode};
use tfe::prelude::*;

const SITES: usize = 1024;
const COMPONENTS: usize = 2 * SITES;
const END: f64 = 100.0;
const TARGETS: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
/// The ratio of times, ours to theirs, that we aim at.
const AIM: f64 = 0.5;

/// The text above the table of the page.
pub const EXPLANATION: &str = "The lattice of Fermi, Pasta, Ulam and Tsingou with 1024 free sites, to t = 100. Ours is a model of run-time length, which records nothing on \
     the way. Errors at the end are relative to the largest state. The table shows the fastest run of each side that reaches the error; we aim at half of the time of the peer.";

/// Unit masses with free ends, joined by springs of force δ + a δ².
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
)]
struct Fput {
    n: usize,
    a: f64,
}

const A: f64 = 0.25;

/// The same equations by hand.
struct ByHand;

impl System<SITES> for ByHand {
    const SEPARABLE: bool = true;

    #[inline]
    fn acceleration(&self, q: &[f64; SITES], _: &[f64; SITES]) -> [f64; SITES] {
        let mut a = [0.0; SITES];
        let mut before = 0.0;
        for i in 0..SITES - 1 {
            let stretch = q[i + 1] - q[i];
            let after = stretch * (1.0 + A * stretch);
            a[i] = after - before;
            before = after;
        }
        a[SITES - 1] = -before;
        a
    }

    // Only implicit methods use it, and none takes part.
    fn variation(
        &self,
        q: &[f64; SITES],
        _: &[f64; SITES],
        dq: &[f64; SITES],
        _: &[f64; SITES],
    ) -> [f64; SITES] {
        let mut a = [0.0; SITES];
        let mut before = 0.0;
        for i in 0..SITES - 1 {
            let after = (1.0 + 2.0 * A * (q[i + 1] - q[i])) * (dq[i + 1] - dq[i]);
            a[i] = after - before;
            before = after;
        }
        a[SITES - 1] = -before;
        a
    }
}

fn start() -> Start<SITES> {
    let mut q = [0.0; SITES];
    for (i, q) in (1..).zip(&mut q) {
        *q = 0.5 * (1.7 * f64::from(i)).sin();
    }
    Start {
        q,
        v: [0.0; SITES],
        end: END,
    }
}

/// The largest difference, relative to the largest coordinate or velocity.
fn error(q: &[f64], v: &[f64], known: &FamilyNode) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let apart = |one: &[f64], other: &[f64]| -> f64 {
        let differences = one
            .iter()
            .zip(other)
            .map(|(one, other)| (one - other).abs());
        // A NaN counts as the largest.
        differences.max_by(f64::total_cmp).unwrap_or(f64::NAN)
    };
    let (q, v) = (
        apart(q, &known.q) / largest(&known.q),
        apart(v, &known.p) / largest(&known.p),
    );
    if q.is_nan() || q >= v { q } else { v }
}

fn ours<'w>(fput: &'w Fput, begin: &'w FamilyState, known: &'w FamilyNode) -> Vec<Way<'w>> {
    let mut ways = Vec::new();
    for nodes in [4, 5, 6, 7, 8, 9, 12] {
        let element = Element::mixed(nodes);
        for step in [2.0, 1.6, 1.25, 1.0, 0.8, 0.625, 0.5, 0.4, 0.25] {
            for tolerance in [1e-5, 1e-7, 1e-9, 1e-11, 0.05 * f64::EPSILON] {
                let simulation = Simulation::new(fput).element(element).step(step);
                let simulation = simulation.tolerance(tolerance).record_every(usize::MAX);
                let run = move || {
                    let clock = Instant::now();
                    let motion = simulation.run(begin.clone(), 0.0..END).ok()?;
                    let seconds = clock.elapsed().as_secs_f64();
                    let last = motion.last();
                    Some((seconds, error(&last.q, &last.p, known)))
                };
                ways.push(Way {
                    name: format!("{element}, {step}, {tolerance:.0e}"),
                    run: Box::new(run),
                });
            }
        }
    }
    ways
}

type Problem1024<'s> = Problem<'s, ByHand, SITES, COMPONENTS>;
type Method = fn(&Problem1024<'_>, f64) -> Result<Run<COMPONENTS>, Box<dyn Error>>;

fn peers<'w>(problem: &'w Problem1024<'w>, known: &'w FamilyNode) -> Vec<Way<'w>> {
    let adaptive: [(&str, Method); 5] = [
        ("DOPRI5 (ode_solvers)", ode_solvers::dopri5),
        ("DOP853 (ode_solvers)", ode_solvers::dop853),
        ("DOP853 (differential-equations)", de::dop853),
        ("Verner 8(7) (differential-equations)", de::verner87),
        ("Verner 9(8) (differential-equations)", de::verner98),
    ];
    let tolerances: Vec<f64> = (6..=26)
        .map(|k| 10.0_f64.powf(-0.5 * f64::from(k)))
        .collect();
    let symplectic: [(&str, Method); 3] = [
        ("Yoshida 4 (utsuroi)", fixed::yoshida4),
        ("Yoshida 6 (utsuroi)", fixed::yoshida6),
        ("Yoshida 8 (utsuroi)", fixed::yoshida8),
    ];
    let counts: Vec<f64> = (12..=24)
        .map(|k| 2.0_f64.powf(0.5 * f64::from(k)).round())
        .collect();
    let adaptive = adaptive.map(|(name, method)| (name, method, &tolerances));
    let symplectic = symplectic.map(|(name, method)| (name, method, &counts));
    let mut ways = Vec::new();
    for (name, method, settings) in adaptive.into_iter().chain(symplectic) {
        for &setting in settings {
            let run = move || {
                let run = method(problem, setting).ok()?;
                let (q, v) = run.y.split_at(SITES);
                Some((run.time.as_secs_f64(), error(q, v, known)))
            };
            ways.push(Way {
                name: if setting < 1.0 {
                    format!("{name}, {setting:.1e}")
                } else {
                    format!("{name}, {setting} steps")
                },
                run: Box::new(run),
            });
        }
    }
    ways
}

/// The columns.
pub const HEADER: [&str; 7] = [
    "scene",
    "error",
    "our element, step, tolerance",
    "time",
    "best peer, setting",
    "its time",
    "ratio",
];

/// A row for each error to be reached.
pub fn table() -> Result<Vec<[String; 7]>, Box<dyn Error>> {
    let fput = Fput { n: SITES, a: A };
    let start = start();
    let begin = fput.state(start.q.to_vec(), start.v.to_vec());
    let end = |step: f64| -> Result<FamilyNode, Box<dyn Error>> {
        let simulation = Simulation::new(&fput).element(Mixed::<9>).step(step);
        let motion = simulation
            .record_every(usize::MAX)
            .run(begin.clone(), 0.0..END)?;
        Ok(motion.last().clone())
    };
    let (known, finer) = (end(0.2)?, end(0.1)?);
    let uncertainty = error(&known.q, &known.p, &finer);
    println!("  lattice of 1024: reference known to {uncertainty:.1e}");
    let problem = Problem::new(&ByHand, &start);
    let ours = Ways::look_at(ours(&fput, &begin, &finer));
    let peers = Ways::look_at(peers(&problem, &finer));
    let row = |target| ways::row("FPUT lattice, n = 1024", target, [&ours, &peers], AIM);
    Ok(TARGETS.map(row).into())
}
