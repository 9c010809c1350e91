//! A heavy top in Euler angles: steady precession, small nutation, nutation alone, and the full model.

use super::{elements, fastest, ladder, micros, model_error, print_table, served, shown};
use std::error::Error;
use tfe::charts::Section;
use tfe::fidelity::{Choice, Ladder};
use tfe::prelude::*;
use tfe::runtime::structure::{Operations, Structure};

/// A heavy symmetric top; precession φ and spin ψ are cyclic. `steady` is the inclination at which it would precess
/// steadily with the momenta of the initial state.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgl*cos(theta),
    output(height) = cos(theta),
    output(spin) = dot(psi) + dot(phi)*cos(theta),
    output(nutation) = theta - steady,
    model(Precession, frozen(theta = steady)),
    model(SmallNutation, routh(psi, phi), truncated(2, theta = steady)),
    model(Nutation, routh(psi, phi)),
)]
struct Top {
    a: f64,
    c: f64,
    mgl: f64,
    steady: f64,
}

impl Top {
    /// The model with `steady` computed from the momenta of an initial state; for tops that spin fast.
    fn of_start(q: [f64; 3], v: [f64; 3]) -> (Self, State<3>) {
        let mut top = Self {
            a: 1.2,
            c: 0.7,
            mgl: 2.0,
            steady: q[1],
        };
        let start = top.state(q, v);
        top.steady = top.steady_inclination(&start);
        (top, start)
    }

    /// The root near the initial inclination at which θ is not accelerated, a φ̇² cos θ − p_ψ φ̇ + mgl = 0 with φ̇ =
    /// (p_φ − p_ψ cos θ)/(a sin² θ), by bisection.
    fn steady_inclination(&self, start: &State<3>) -> f64 {
        const NEAR: f64 = 0.5;
        let [p_phi, _, p_psi] = start.p;
        let pull = |theta: f64| {
            let (sin, cos) = theta.sin_cos();
            let rate = (p_phi - p_psi * cos) / (self.a * sin * sin);
            self.a * rate * rate * cos - p_psi * rate + self.mgl
        };
        let (mut low, mut high) = (start.q[1] - NEAR, start.q[1] + NEAR);
        while high - low > 4.0 * f64::EPSILON {
            let middle = f64::midpoint(low, high);
            // Where the inclination is too small, gravity increases it, and vice versa.
            if pull(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        f64::midpoint(low, high)
    }
}

/// A slow and a fast top, and what the reduction saves.
pub fn sections() -> Result<Vec<Section>, Box<dyn Error>> {
    let slow = nodding(6.0)?;
    let fast = nodding(60.0)?;
    for ladder in [&slow, &fast] {
        let errors = [0, 1].map(|rung: usize| ladder.rungs()[rung].model_error());
        assert!(errors[1] < errors[0], "{errors:?}");
        // Eliminating cyclic coordinates causes no error, and no other model is as accurate as that.
        assert_eq!(ladder.rungs()[2].model_error(), None);
        for rung in &ladder.rungs()[2..] {
            assert!(fastest(rung, 1e-10).is_some(), "{}", rung.name());
        }
    }
    let mut sections = Vec::new();
    for ladder in [&slow, &fast] {
        sections.push(shown(ladder, &sentence(ladder))?.table(HEADINGS, rows(ladder)));
        println!();
        print_table(HEADINGS, &rows(ladder));
    }
    Ok(sections)
}

/// Initial inclination 0.9, for ten seconds.
fn nodding(spin: f64) -> Result<Ladder, Box<dyn Error>> {
    let (top, start) = Top::of_start([0.3, 0.9, -0.2], [0.4, 0.1, spin]);
    let precession = Precession::of(&top);
    let ([p_phi, _, p_psi], [phi, _, psi]) = (start.p, start.q);
    // The same momenta, without that of the nutation.
    let turning = State {
        q: [phi, psi],
        p: [p_phi, p_psi],
    };
    let (nutation, left) = Nutation::of_state(&top, &start);
    let small = SmallNutation::of(&top, p_psi, p_phi);
    let ladder = ladder(format!("A heavy top, spin {spin}, over 10 s"), 10.0)
        .elements(elements())
        .outputs(["height", "spin"])
        .rung("precession", &precession, turning)
        .rung("small nutation", &small, left)
        .rung("nutation", &nutation, left)
        .rung("full", &top, start);
    Ok(ladder.run()?)
}

const HEADINGS: [&str; 9] = [
    "model",
    "unknowns",
    "operations: gradient",
    "with Hessian",
    "model error",
    "µs for 1e-4",
    "evaluations",
    "µs for 1e-8",
    "evaluations",
];

/// Sizes of kernels, and what equal accuracy costs.
fn rows(ladder: &Ladder) -> Vec<[String; 9]> {
    let structures = [
        (2, Precession::structure()),
        (1, SmallNutation::structure()),
        (1, Nutation::structure()),
        (3, Top::structure()),
    ];
    let rungs = ladder.rungs().iter().zip(structures);
    rungs
        .map(|(rung, (unknowns, structure))| {
            let Structure { first, second, .. } = structure;
            let [coarse, fine] = [1e-4, 1e-8].map(|accuracy| fastest(rung, accuracy));
            [
                rung.name().to_owned(),
                unknowns.to_string(),
                total(first).to_string(),
                total(second).to_string(),
                model_error(rung),
                micros(coarse),
                evaluations(coarse),
                micros(fine),
                evaluations(fine),
            ]
        })
        .collect()
}

fn evaluations(choice: Option<&Choice>) -> String {
    choice.map_or_else(|| "—".to_owned(), |one| one.evaluations.to_string())
}

fn total(one: Operations) -> u32 {
    one.additions + one.multiplications + one.divisions + one.sines + one.functions
}

fn sentence(ladder: &Ladder) -> String {
    let [steady, small] = [0, 1].map(|rung: usize| model_error(&ladder.rungs()[rung]));
    let [reduced, full] = [2, 3].map(|rung: usize| fastest(&ladder.rungs()[rung], 1e-8));
    let saved = match (reduced, full) {
        (Some(reduced), Some(full)) => format!(
            "the nutation alone reaches 1e-8 in 1/{:.1} of the time of the full model, without a model error: its mass matrix is constant, so that the forces are its only unknowns",
            full.seconds / reduced.seconds
        ),
        _ => "the time for 1e-8 is not known".to_owned(),
    };
    format!(
        "Result: steady precession has an error of {steady} and nutation of small angles one of {small}; {saved}; the cheapest model is {}.",
        served(ladder)
    )
}
