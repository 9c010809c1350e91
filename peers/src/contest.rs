//! All peers with all of their settings, to be compared with our elements.

use crate::run::{Outcome, Problem, de, diffsol, fixed, ode_solvers};
use crate::scenes::Start;
use crate::system::System;
use tfe::State;
use tfe::prelude::WorkPrecision;
use tfe::work_precision::PeerRun;

/// Tolerances, a factor of √10 apart.
fn tolerances(finest: i32) -> impl Iterator<Item = f64> {
    (6..=2 * finest).map(|k| 10.0_f64.powf(-0.5 * f64::from(k)))
}

/// Numbers of steps, a factor of √2 apart.
fn steps(most: f64) -> impl Iterator<Item = f64> {
    let counts = (6..).map(|k| 2.0_f64.powf(0.5 * f64::from(k)).round());
    counts.take_while(move |count| *count <= most)
}

/// Which peers take part.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Field {
    All,
    /// Those for stiff equations: explicit methods would need millions of steps.
    Implicit,
}

/// Adds the peers to a problem. `momenta` converts coordinates and velocities into the state.
pub fn contest<'m, M, S, const N: usize, const D: usize>(
    ours: WorkPrecision<'m, M, State<N>>,
    system: &'m S,
    start: &Start<N>,
    field: Field,
    state: fn([f64; N], [f64; N]) -> State<N>,
) -> WorkPrecision<'m, M, State<N>>
where
    M: tfe::Model<N>,
    S: System<N>,
{
    type Method<'m, S, const N: usize, const D: usize> =
        fn(&Problem<'m, S, N, D>, f64) -> Outcome<D>;
    let adaptive: [(&str, Method<'m, S, N, D>, i32); 7] = [
        ("DOPRI5 (ode_solvers)", ode_solvers::dopri5, 14),
        ("DOP853 (ode_solvers)", ode_solvers::dop853, 14),
        ("DOPRI5 (differential-equations)", de::dopri5, 14),
        ("DOP853 (differential-equations)", de::dop853, 14),
        ("Verner 8(7) (differential-equations)", de::verner87, 14),
        ("Verner 9(8) (differential-equations)", de::verner98, 14),
        ("Tsitouras 5(4) (diffsol)", diffsol::tsit45, 14),
    ];
    let implicit: [(&str, Method<'m, S, N, D>, i32); 5] = [
        ("Radau IIA 5 (differential-equations)", de::radau5, 12),
        ("BDF (differential-equations)", de::bdf, 10),
        ("BDF (diffsol)", diffsol::bdf, 10),
        ("ESDIRK 3(4) (diffsol)", diffsol::esdirk34, 10),
        ("TR-BDF2 (diffsol)", diffsol::tr_bdf2, 8),
    ];
    let symplectic: [(&str, Method<'m, S, N, D>, f64); 5] = [
        ("Leapfrog (utsuroi)", fixed::leapfrog, 2.0),
        ("Forest–Ruth (differential-equations)", de::forest_ruth, 8.0),
        ("Yoshida 4 (utsuroi)", fixed::yoshida4, 6.0),
        ("Yoshida 6 (utsuroi)", fixed::yoshida6, 14.0),
        ("Yoshida 8 (utsuroi)", fixed::yoshida8, 30.0),
    ];
    let with = |ours: WorkPrecision<'m, M, State<N>>,
                name: &str,
                settings: Vec<f64>,
                method: Method<'m, S, N, D>| {
        let problem = Problem::<S, N, D>::new(system, start);
        ours.peer(name, settings, move |setting| {
            let run = method(&problem, setting)?;
            let (q, v) = problem.motion(&run.y);
            Ok(PeerRun {
                end: state(q, v),
                time: run.time,
                evaluations: run.evaluations,
            })
        })
    };
    let mut ours = ours;
    let explicit = adaptive.into_iter().filter(|_| field == Field::All);
    for (name, method, finest) in explicit.chain(implicit) {
        ours = with(ours, name, tolerances(finest).collect(), method);
    }
    for (name, method, evaluations) in symplectic
        .into_iter()
        .filter(|_| S::SEPARABLE && field == Field::All)
    {
        // At least as much work as the others do with their smallest tolerances.
        let most = 1e6 / evaluations;
        ours = with(ours, name, steps(most).collect(), method);
    }
    ours
}
