//! Parameters between bounds.

use super::*;

/// If the true value is beyond a bound, the parameter ends at the bound.
#[test]
fn bounds_hold() {
    let guess = Ball {
        m: 1.0,
        g: 8.0,
        c: 0.0,
    };
    let fit = Fit::new(&guess)
        .start(guess.state([1.0], [4.0]), 0.0)
        .step(0.05)
        .parameters(["g", "c"])
        .bounds("g", ..=9.5)
        .output("height", times(), heights())
        .solve()
        .expect("a fit");
    let g = fit.value("g").expect("named");
    assert!(g <= 9.5 && g > 9.499, "{g}");
}

/// However wide a range is, the fit starts from the value of the model: far from there the oscillator is out of phase.
#[test]
fn wide_bounds_do_not_move_the_first_values() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2)]
    struct Oscillator {
        k: f64,
    }
    let truth = Oscillator { k: 10.3 };
    let start = truth.state([1.0], [0.0]);
    let times: Vec<f64> = (1..=40).map(|k| 0.25 * f64::from(k)).collect();
    let measured: Vec<f64> = times.iter().map(|t| (t * truth.k.sqrt()).cos()).collect();
    let guess = Oscillator { k: 10.0 };
    let fit = |low: f64, high: f64| {
        let fit = Fit::new(&guess).start(start, 0.0).step(0.05);
        let fit = fit.parameters(["k"]).bounds("k", low..=high);
        fit.output("x", &times, &measured).solve().expect("a fit")
    };
    for (low, high) in [
        (0.0, 1e4),
        (0.0, 1e9),
        (0.0, f64::INFINITY),
        (-1e6, f64::INFINITY),
        (-1e6, 1e6),
        (10.0, 1e3),
        (9.999_999, 1e9),
        (f64::NEG_INFINITY, 1e5),
        // Relative to bounds so wide, 10 has three digits or none.
        (-1e12, 1e12),
        (-3e12, 1e12),
        (-1e12, f64::INFINITY),
        (f64::NEG_INFINITY, 1e12),
        (0.0, f64::MAX),
        (f64::MIN, f64::MAX),
    ] {
        let fit = fit(low, high);
        let first = fit.trials()[0].values[0];
        let off = (first - 10.0).abs();
        assert!(off <= 1e-9, "{low} to {high}: {first}");
        let k = fit.value("k").expect("named");
        assert!((k - 10.3).abs() < 1e-8, "{low} to {high}: {k}");
    }
}

/// A spring with friction and a cubic part.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2, force(x) = -c*dot(x) - d*x^3)]
struct Spring {
    k: f64,
    c: f64,
    d: f64,
}

/// A fit that begins at a bound leaves it if the sum of squares falls there, however far the other bound is; also if it
/// rises there as long as another parameter is wrong.
#[test]
fn first_values_at_a_bound_are_left() {
    let truth = Spring {
        k: 2.0,
        c: 0.3,
        d: 0.5,
    };
    let start = truth.state([1.0], [0.0]);
    let times: Vec<f64> = (0..=40).map(|k| 0.25 * f64::from(k)).collect();
    let motion = Simulation::new(&truth).step(0.05).nodes(times.clone());
    let motion = motion.run(start, 0.0..10.0).expect("a motion");
    let measured: Vec<f64> = times
        .iter()
        .map(|t| motion.at(*t).expect("a node").q[0])
        .collect();
    for high in [1.0, 1e3, 1e9, f64::MAX] {
        for (k, c, d) in [(2.0, 0.0, 0.0), (2.5, 1.0, 0.0), (2.0, 0.0, 1.0)] {
            let guess = Spring { k, c, d };
            let fit = Fit::new(&guess).start(start, 0.0).step(0.05);
            let fit = fit.parameters(["k", "c", "d"]).bounds("c", 0.0..=high);
            let fit = fit.bounds("d", 0.0..=high);
            let fit = fit.output("x", &times, &measured).solve().expect("a fit");
            for (first, given) in fit.trials()[0].values.iter().zip([k, c, d]) {
                // Up to a rounding of the variable without bounds.
                assert!((first - given).abs() <= 1e-15, "{first} for {given}");
            }
            let runs = fit.trials().len();
            for (value, expected) in fit.values().iter().zip([2.0, 0.3, 0.5]) {
                // The motion is measured at nodes of another mesh, which errs by 1e-7.
                let off = (value - expected).abs();
                assert!(off <= 1e-5, "{high:e} {k} {c} {d}: {value}, {runs} runs");
            }
            assert!(runs < 200, "{high:e} {k} {c} {d}: {runs} runs");
        }
    }
    // The truth is at the bound, and so is the fit, whose first step leads elsewhere.
    let free = Spring { d: 0.0, ..truth };
    let motion = Simulation::new(&free).step(0.05).nodes(times.clone());
    let motion = motion.run(start, 0.0..10.0).expect("a motion");
    let measured: Vec<f64> = times
        .iter()
        .map(|t| motion.at(*t).expect("a node").q[0])
        .collect();
    let guess = Spring { k: 1.8, ..free };
    let fit = Fit::new(&guess).start(start, 0.0).step(0.05);
    let fit = fit.parameters(["k", "c", "d"]).bounds("d", 0.0..);
    let fit = fit.output("x", &times, &measured).solve().expect("a fit");
    for (value, expected) in fit.values().iter().zip([2.0, 0.3, 0.0]) {
        assert!((value - expected).abs() <= 1e-5, "{fit}");
    }
}
