//! Time transformations: steps that are equal in a fictitious time τ with dt = g dτ.

#[path = "common/largest.rs"]
mod largest;

use largest::larger;
use std::f64::consts::{PI, TAU};

use tfe::prelude::*;

/// The Kepler problem with g = r^k. For k = 0, τ is the time; for k = 1 and semi-major axis 1, τ is the eccentric
/// anomaly.
#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    let square = x^2 + y^2,
    let energy = (px^2 + py^2)/2 - 1/sqrt(square),
    hamiltonian = energy,
    time_transformation = square^(k/2),
    output(energy) = energy,
)]
struct Kepler {
    k: f64,
}

/// A driven and damped pendulum in physical time.
#[dynamics(
    coordinates(q),
    momenta(p),
    hamiltonian = p^2/2 - cos(q) - a*q*cos(w*t),
    force(q) = -c*p,
    output(height) = -cos(q),
    output(drive) = a*cos(w*t),
)]
struct Driven {
    a: f64,
    w: f64,
    c: f64,
}

/// The same with a time transformation that makes steps short where the angle is large.
#[dynamics(
    coordinates(q),
    momenta(p),
    hamiltonian = p^2/2 - cos(q) - a*q*cos(w*t),
    time_transformation = 1/(1 + q^2),
    force(q) = -c*p,
    output(drive) = a*cos(w*t),
    output(balance) = p^2/2 - cos(q) - a*q*cos(w*t),
    output(speed) = dot(q),
    solver(Fixed, Mixed::<5>),
)]
struct Slowed {
    a: f64,
    w: f64,
    c: f64,
}

/// The initial state at the pericentre of an ellipse with semi-major axis 1 and eccentricity e.
fn ellipse(kepler: &Kepler, e: f64) -> State<3> {
    kepler.state([1.0 - e, 0.0], [0.0, ((1.0 + e) / (1.0 - e)).sqrt()])
}

/// The root E of Kepler's equation E − e sin E = t, for 0 ≤ t ≤ 2π, by bisection.
fn eccentric_anomaly(e: f64, t: f64) -> f64 {
    let (mut low, mut high) = (0.0, TAU);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if middle - e * middle.sin() < t {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Position and momentum at the time t after the pericentre.
fn on_ellipse(e: f64, t: f64) -> ([f64; 2], [f64; 2]) {
    let (sin, cos) = eccentric_anomaly(e, t.rem_euclid(TAU)).sin_cos();
    let (b, rate) = ((1.0 - e * e).sqrt(), 1.0 / (1.0 - e * cos));
    ([cos - e, b * sin], [-rate * sin, rate * b * cos])
}

fn distance(a: &[f64], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn run(kepler: &Kepler, element: Element, step: f64, e: f64, end: f64) -> Motion<3> {
    let simulation = Simulation::new(kepler).element(element).step(step);
    let motion = simulation.run(ellipse(kepler, e), 0.0..end);
    motion.expect("steps short enough to be solved")
}

/// The energy error |H + ½| at the nodes.
fn energy_errors(motion: &Motion<3>) -> Vec<f64> {
    let rows = (0..motion.states().len()).filter_map(|node| motion.outputs().row(node));
    rows.map(|row| (row[0] + 0.5).abs()).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, larger)
}

/// The observed orders: log₂ of the ratios of successive errors.
fn powers(errors: &[f64]) -> Vec<f64> {
    errors
        .windows(2)
        .map(|pair| (pair[0] / pair[1]).log2())
        .collect()
}

/// The length of one revolution in τ, with dt = r^k dτ; the midpoint rule converges exponentially.
fn revolution(e: f64, k: f64) -> f64 {
    let points = 4000;
    let h = TAU / f64::from(points);
    let rate = |i| (1.0 - e * (h * (f64::from(i) + 0.5)).cos()).powf(1.0 - k);
    h * (0..points).map(rate).sum::<f64>()
}

#[test]
fn states_are_those_of_the_ellipse_at_their_own_times() {
    let e = 0.6;
    for k in [1.0, 1.5] {
        let kepler = Kepler { k };
        let errors = [40.0, 80.0, 160.0, 320.0].map(|steps| {
            let motion = run(&kepler, Element::mixed(3), 4.0 / steps, e, 4.0);
            let last = motion.last();
            let (q, p) = on_ellipse(e, last.q[2]);
            // For k = 1 the eccentric anomaly is τ.
            let clock = last.q[2] - (4.0 - e * 4_f64.sin());
            [distance(&last.q, &q), distance(&last.p, &p), clock.abs()]
        });
        let measured = if k == 1.0 { 3 } else { 2 };
        for part in 0..measured {
            let errors = errors.map(|errors| errors[part]);
            let powers = powers(&errors);
            println!("k = {k}, part {part}: {errors:?}, orders {powers:.2?}");
            // Order 2(n − 1) for n = 3 nodes.
            assert!(
                powers.iter().all(|power| (power - 4.0).abs() < 0.1),
                "{powers:?}"
            );
        }
    }
}

#[test]
fn the_energy_of_a_thin_ellipse_does_not_drift() {
    let kepler = Kepler { k: 1.0 };
    let motion = run(&kepler, Element::mixed(5), TAU / 100.0, 0.99, 1000.0 * TAU);
    let errors = energy_errors(&motion);
    let tenth = errors.len() / 10;
    let (first, last) = (&errors[..tenth], &errors[errors.len() - tenth..]);
    let (first, last) = (largest(first), largest(last));
    println!("1000 orbits of 100 steps: {first:.3e} in the first tenth, {last:.3e} in the last");
    assert!(last <= 2.0 * first, "{last:e} after {first:e}");
    // Measured: 1.2e-7. The distance at the pericentre is 0.01, and the largest kinetic energy 99.5.
    assert!(first < 2.5e-7, "{first:e}");
    // p_t is constant for this motion, and no step changes it.
    assert_eq!(motion.last().p[2], motion.states()[0].p[2]);
}

#[test]
fn a_rate_like_the_period_resolves_a_thin_ellipse_to_rounding() {
    let (e, k) = (0.99, 1.5);
    let (kepler, period) = (Kepler { k }, revolution(0.99, 1.5));
    let motion = run(
        &kepler,
        Element::mixed(5),
        period / 100.0,
        e,
        100.0 * period,
    );
    let error = largest(&energy_errors(&motion));
    let time = motion.last().q[2] - 100.0 * TAU;
    println!(
        "g = r^(3/2), 100 orbits of 100 steps: energy {error:.2e}, time of the orbits {time:.2e}"
    );
    // Measured: 2.3e-12 and 2.8e-11, with energies up to 99.5 and a time of 628.
    assert!(error < 1e-11, "{error:e}");
    assert!(time.abs() < 1e-10, "{time:e}");
}

/// The largest energy error, and the error of the position at the end.
fn errors_of_one_orbit(k: f64, steps: usize) -> Option<[f64; 2]> {
    let kepler = Kepler { k };
    let step = TAU / steps as f64;
    let simulation = Simulation::new(&kepler)
        .element(Mixed::<5>)
        .step(step)
        .run(ellipse(&kepler, 0.99), 0.0..TAU);
    // Without the transformation, some steps are too long to be solved.
    let motion = simulation.ok()?;
    let last = motion.last();
    let (q, _) = on_ellipse(0.99, last.q[2]);
    Some([largest(&energy_errors(&motion)), distance(&last.q, &q)])
}

#[test]
fn a_hundredth_of_the_steps_does() {
    let steps = 100;
    let own = errors_of_one_orbit(1.0, steps).expect("a motion");
    for (part, what) in ["energy", "position at the end"].into_iter().enumerate() {
        let enough = (0..12)
            .map(|doubling| {
                (
                    steps << doubling,
                    errors_of_one_orbit(0.0, steps << doubling),
                )
            })
            .find(|(_, errors)| errors.is_some_and(|errors| errors[part] <= own[part]));
        let (plain, errors) = enough.expect("short enough steps");
        let error = errors.expect("a motion")[part];
        println!(
            "{what}: {steps} steps of r dτ {:.2e}, {plain} of dt {error:.2e}",
            own[part]
        );
        // Measured: 25 600 and 51 200 equal steps; half as many are not enough.
        assert!(plain >= 100 * steps, "{what}: {plain} steps do");
    }
}

/// Compares the motion in τ with the one in t, up to the same time t: the largest difference of (q, p), and the largest
/// |H + p_t|.
fn differences(c: f64) -> (f64, f64) {
    let (a, w, start) = (0.4, 1.3, 0.7);
    let slowed = Slowed { a, w, c };
    let state = slowed.state_at(start, [1.0], [0.9]);
    let simulation = Simulation::new(&slowed).element(Mixed::<6>).step(0.05);
    let motion = simulation.run(state, 0.0..60.0).expect("a motion");
    let last = motion.last();
    let plain = Driven { a, w, c };
    let state = plain.state([1.0], [0.9]);
    let end = last.q[1];
    let simulation = Simulation::new(&plain)
        .element(Mixed::<6>)
        .step((end - start) / 2000.0);
    let reference = simulation.run(state, start..end).expect("a motion");
    let expected = reference.last();
    let difference = (last.q[0] - expected.q[0]).hypot(last.p[0] - expected.p[0]);
    let balance = motion.states().iter().enumerate().map(|(node, state)| {
        let outputs = motion.outputs().row(node).expect("a row for each node");
        (outputs[1] + state.p[1]).abs()
    });
    let balance = balance.fold(0.0, larger);
    println!("c = {c}: t = {end}, difference {difference:.2e}, |H + p_t| {balance:.2e}");
    // Outputs are evaluated at the physical time, and rates are derivatives by it.
    let node = motion.states().len() - 1;
    let outputs = motion.outputs().row(node).expect("a row for each node");
    assert_eq!(outputs[0], a * (w * end).cos());
    assert_eq!(outputs[2], last.p[0]);
    let none = [node + 1, usize::MAX].map(|node| motion.outputs().row(node));
    assert_eq!(none, [None; 2]);
    (difference, balance)
}

#[test]
fn a_driven_pendulum_moves_as_it_does_without() {
    let (difference, balance) = differences(0.0);
    // Measured: 1.2e-14 and 3.2e-15, which are rounding errors, slightly amplified by the motion.
    assert!(difference < 1e-11, "{difference:e}");
    assert!(balance < 1e-11, "{balance:e}");
}

#[test]
fn damping_takes_its_power_from_the_energy() {
    let (difference, balance) = differences(0.1);
    // Measured: 5.4e-15 and 1.4e-15. Without the power of the forces in the equation of p_t, the second value would be
    // the dissipated energy, of order one.
    assert!(difference < 1e-11, "{difference:e}");
    assert!(balance < 1e-11, "{balance:e}");
}

#[test]
fn states_hold_the_time_and_minus_the_energy() {
    let (a, w, c) = (0.4, 1.3, 0.1);
    let slowed = Slowed { a, w, c };
    let (q, p, t) = (1.1_f64, 0.9_f64, 2.0);
    let state = slowed.state_at(t, [q], [p]);
    let energy = p * p / 2.0 - q.cos() - a * q * (w * t).cos();
    assert_eq!(state.q, [q, t]);
    assert_eq!(state.p[0], p);
    // A few operations, each with one rounding error.
    assert!((state.p[1] + energy).abs() < 4.0 * f64::EPSILON);
    assert_eq!(slowed.state([q], [p]), slowed.state_at(0.0, [q], [p]));
    assert_eq!(Kepler::structure().cyclic, ["t"]);
    assert!(Kepler::structure().to_string().contains("dt/dτ"));
}

#[test]
fn solvers_and_columns_know_the_time() {
    let (a, w, c) = (0.4, 1.3, 0.1);
    let slowed = Slowed { a, w, c };
    let start = slowed.state([1.0], [0.0]);
    let mut fixed = Fixed::new(&slowed, 0.1);
    let mut state = start;
    for _ in 0..10 {
        fixed.advance(&mut state).expect("a step");
    }
    let simulation = Simulation::new(&slowed).element(Mixed::<5>).step(0.1);
    let motion = simulation.run(start, 0.0..1.0).expect("a motion");
    // Iterations stop below 1e-13 of the state.
    assert!((state.q[1] - motion.last().q[1]).abs() < 1e-12);
    let path = std::env::temp_dir().join(format!("tfe_clock_{}.csv", std::process::id()));
    motion.write_csv(&path).expect("a writable folder");
    let text = std::fs::read_to_string(&path).expect("the file");
    std::fs::remove_file(&path).expect("the file");
    let header = "tau,q,t,q_dot,t_dot,p_q,p_t,energy,drive,balance,speed";
    assert_eq!(text.lines().next(), Some(header));
}

#[test]
fn an_output_called_energy_has_the_column_of_that_name() {
    let kepler = Kepler { k: 1.0 };
    let simulation = Simulation::new(&kepler).element(Mixed::<5>).step(0.1);
    let motion = simulation.run(ellipse(&kepler, 0.3), 0.0..0.2);
    let motion = motion.expect("a motion");
    let path = std::env::temp_dir().join(format!("tfe_energies_{}.csv", std::process::id()));
    motion.write_csv(&path).expect("a writable folder");
    let text = std::fs::read_to_string(&path).expect("the file");
    std::fs::remove_file(&path).expect("the file");
    let mut lines = text.lines();
    let header = "tau,x,y,t,x_dot,y_dot,t_dot,p_x,p_y,p_t,energy_,energy";
    assert_eq!(lines.next(), Some(header));
    assert_eq!(text.lines().count(), 1 + motion.states().len());
    let outputs = motion.outputs().column("energy").expect("declared");
    for ((line, energy), output) in lines.zip(motion.energies()).zip(outputs) {
        let row: Vec<f64> = line
            .split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        assert_eq!(row[10..], [*energy, output]);
    }
}

#[test]
fn elements_with_velocities_as_unknowns_say_that_p_t_has_none() {
    let kepler = Kepler { k: 1.0 };
    let simulation = Simulation::new(&kepler)
        .element(Primal::<3>)
        .step(PI / 50.0);
    let error = simulation.run(ellipse(&kepler, 0.6), 0.0..1.0);
    let error = error
        .map(|motion| motion.last().t)
        .map_err(|error| error.to_string());
    let expected = "singular at coordinate 2";
    assert!(
        error.as_ref().is_err_and(|error| error.contains(expected)),
        "{error:?}"
    );
}
