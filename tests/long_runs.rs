//! Rounding errors over long runs: there is no drift, and they grow only as a random walk, with the square root of the
//! number of steps.

use tfe::prelude::*;
use tfe::runtime::legendre::energy;
use tfe::runtime::step::{Control, Stepper};

// Only some of the scenes are run for long.
#[allow(dead_code)]
#[path = "../examples/speed_accuracy/scenes/mod.rs"]
mod scenes;

use scenes::Start;
use scenes::planets::{KEPLER_START, Kepler, SOLAR_SYSTEM, solar_system_start};

/// A Kepler ellipse of eccentricity 0.6, with its pericentre in a given direction.
fn ellipse(angle: f64) -> State<2> {
    let (sin, cos) = angle.sin_cos();
    let (radius, speed) = (KEPLER_START.q[0], KEPLER_START.v[1]);
    State {
        q: [radius * cos, radius * sin],
        p: [-speed * sin, speed * cos],
    }
}

/// The planets, rotated about the z axis.
fn planets(angle: f64) -> State<18> {
    let (sin, cos) = angle.sin_cos();
    let turned = |from: [f64; 18]| {
        let mut to = from;
        for i in 0..6 {
            (to[i], to[6 + i]) = (
                cos * from[i] - sin * from[6 + i],
                sin * from[i] + cos * from[6 + i],
            );
        }
        to
    };
    let Start { q, v, .. } = solar_system_start();
    SOLAR_SYSTEM.state(turned(q), turned(v))
}

/// The relative energy errors after given numbers of steps, one row for each initial state.
fn energy_errors<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    h: f64,
    starts: &[State<N>],
    checks: &[usize],
) -> Vec<Vec<f64>> {
    let of = |state: &State<N>| energy(model, 0.0, &state.q, &state.p).expect("an energy");
    let run = |start: &State<N>| {
        let control = Control::default();
        let mut stepper = Stepper::new(model, element, control)
            .expect("an element")
            .ends_only();
        let (mut state, mut done) = (*start, 0);
        let mut errors = Vec::new();
        for check in checks {
            while done < *check {
                let t = h * done as f64;
                stepper
                    .advance(t, h, &mut state, &[])
                    .expect("a smooth step");
                done += 1;
            }
            errors.push((of(&state) - of(start)) / of(start));
        }
        errors
    };
    starts.iter().map(run).collect()
}

/// The mean and the root mean square over all initial states, a pair for each check.
fn moments(errors: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let count = errors.len() as f64;
    let checks = errors.first().map_or(0, Vec::len);
    let moments = (0..checks).map(|k| {
        let sum: f64 = errors.iter().map(|row| row[k]).sum();
        let squares: f64 = errors.iter().map(|row| row[k] * row[k]).sum();
        [sum / count, (squares / count).sqrt()]
    });
    moments.collect()
}

/// The exponent of the growth between the first and the last check.
fn growth(moments: &[[f64; 2]], checks: &[usize]) -> f64 {
    let (first, last) = (0, checks.len() - 1);
    let times = checks[last] as f64 / checks[first] as f64;
    (moments[last][1] / moments[first][1]).ln() / times.ln()
}

/// After whole periods the planet is back at its initial position. For comparison: compositions of leapfrog with
/// compensated sums reach 1e-11.
#[test]
fn a_thousand_kepler_periods() {
    let steps = 4000;
    let h = std::f64::consts::TAU / f64::from(steps);
    for nodes in [5, 6] {
        let element = Element::mixed(nodes);
        let control = Control::default();
        let mut stepper = Stepper::new(&Kepler {}, element, control)
            .expect("an element")
            .ends_only();
        let start = ellipse(0.0);
        let mut state = start;
        for step in 0..1000 * steps {
            let t = h * f64::from(step);
            stepper
                .advance(t, h, &mut state, &[])
                .expect("a smooth step");
        }
        let error = (state.q[0] - start.q[0]).hypot(state.q[1] - start.q[1]);
        println!("{element}: {error:.2e} after 1000 periods");
        assert!(error <= 3e-11, "{element}: {error:.1e}");
    }
}

#[test]
fn kepler_energy_is_a_random_walk() {
    let h = std::f64::consts::TAU / 256.0;
    let starts: Vec<_> = (0..16).map(|k| ellipse(0.25 * f64::from(k))).collect();
    let checks = [10, 30, 100, 300, 1000].map(|periods| 256 * periods);
    let errors = energy_errors(&Kepler {}, Element::mixed(8), h, &starts, &checks);
    let moments = moments(&errors);
    let slope = growth(&moments, &checks);
    println!("energy error after 10 to 1000 periods {moments:?}, exponent {slope:.2}");
    // A drift of the same sign in all runs would have the exponent 1, a random walk has 1/2; the rounding error in
    // evaluating the energy itself makes it smaller.
    assert!(slope < 0.6, "{slope}");
    let [mean, rms] = moments[4];
    assert!(rms < 5e-15, "{rms:.1e}");
    // There is no common sign: the mean of 16 random walks is about a quarter of one of them.
    assert!(mean.abs() < 0.6 * rms, "{mean:.1e} of {rms:.1e}");
}

/// Primal elements with more quadrature points than unknown rates. Sums in working precision gave errors of 4e-14 after
/// a thousand periods, all of the same sign.
#[test]
fn displacement_elements_keep_the_energy_of_kepler_orbits() {
    let h = std::f64::consts::TAU / 64.0;
    let starts: Vec<_> = (0..12).map(|k| ellipse(0.5 * f64::from(k))).collect();
    let checks = [100, 1000].map(|periods| 64 * periods);
    for element in [Element::primal(8), Element::primal(8).lobatto()] {
        let errors = energy_errors(&Kepler {}, element, h, &starts, &checks);
        let moments = moments(&errors);
        println!("{element}: energy error after 100 and 1000 periods {moments:?}");
        let [mean, rms] = moments[1];
        assert!(rms < 1e-14, "{element}: {rms:.1e}");
        // The mean of twelve random walks is about 0.3 of one of them.
        assert!(mean.abs() < 0.9 * rms, "{element}: {mean:.1e} of {rms:.1e}");
    }
}

#[test]
fn planets_over_a_million_days() {
    let starts: Vec<_> = (0..6).map(|k| planets(f64::from(k))).collect();
    let days = [1e4, 1e5, 1e6];
    for (nodes, h) in [(9, 200.0), (8, 100.0)] {
        let checks = days.map(|days| (days / h) as usize);
        let errors = energy_errors(&SOLAR_SYSTEM, Element::mixed(nodes), h, &starts, &checks);
        let moments = moments(&errors);
        let slope = growth(&moments, &checks);
        println!(
            "{nodes} nodes, {h} days: energy error after 1e4, 1e5, 1e6 days {moments:?}, exponent {slope:.2}"
        );
        assert!(slope < 0.6, "{slope}");
        assert!(moments[2][1] < 5e-15, "{:.1e}", moments[2][1]);
    }
}
