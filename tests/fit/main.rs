//! Parameters identified from measured motions.

mod bounds;

use tfe::fit::FitError;
use tfe::prelude::*;
use tfe::runtime::Model;
use tfe::{RunErrorKind, runtime};

/// A ball that falls through air.
#[dynamics(
    coordinates(y),
    lagrangian = m/2*dot(y)^2 - m*g*y,
    force(y) = -c*dot(y),
    output(height) = y,
    output(speed) = dot(y),
)]
struct Ball {
    m: f64,
    g: f64,
    c: f64,
}

const TRUE: Ball = Ball {
    m: 1.0,
    g: 9.81,
    c: 0.3,
};

fn times() -> Vec<f64> {
    (0..=40).map(|k| 0.05 * f64::from(k)).collect()
}

/// Heights of the true ball, thrown upwards.
fn heights() -> Vec<f64> {
    let simulation = Simulation::new(&TRUE).step(0.05);
    let motion = simulation
        .run(TRUE.state([1.0], [4.0]), 0.0..2.0)
        .expect("a throw");
    motion.outputs().column("height").expect("declared")
}

/// Random numbers of the standard normal distribution, always the same.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        // The sum of twelve uniform random numbers has variance one.
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

#[test]
fn exact_measurements_give_exact_parameters() {
    let guess = Ball {
        m: 1.0,
        g: 8.0,
        c: 0.0,
    };
    let fit = Fit::new(&guess)
        .start(guess.state([1.0], [4.0]), 0.0)
        .step(0.05)
        .parameters(["g", "c"])
        .output("height", times(), heights())
        .solve()
        .expect("a fit");
    assert!((fit.value("g").expect("named") - 9.81).abs() < 1e-11);
    assert!((fit.value("c").expect("named") - 0.3).abs() < 1e-11);
    assert_eq!((fit.value("m"), fit.model().m), (None, 1.0));
    assert_eq!(fit.model().g, fit.values()[0]);
    assert!(fit.residuals().iter().all(|r| r.abs() < 1e-12));
    assert_eq!(fit.residuals().len(), 41);
    assert!(fit.trials().len() < 12, "{} runs", fit.trials().len());
    assert_eq!(fit.trials()[0].values, [8.0, 0.0]);
    assert!(fit.to_string().contains("g") && fit.to_string().contains("runs"));
}

/// Times from two clocks, computed by products and by sums, and a break at that of a third one.
#[test]
fn times_a_few_roundings_apart_are_one() {
    let guess = Ball { g: 8.0, ..TRUE };
    let apart = |roundings: f64| {
        times()
            .into_iter()
            .map(move |t| t * (1.0 + roundings * f64::EPSILON))
    };
    for (first, second) in [(20.0, -20.0), (-20.0, 20.0), (0.0, 40.0)] {
        let (one, two): (Vec<f64>, Vec<f64>) = (apart(first).collect(), apart(second).collect());
        for at in [1.0, 2.0] {
            let fit = Fit::new(&guess).start(guess.state([1.0], [4.0]), 0.0);
            let fit = fit.step(0.05).parameters(["g"]).break_at(at);
            let fit = fit.output("height", &one, heights());
            let fit = fit.output("height", &two, heights()).solve();
            let g = fit.expect("a fit").values()[0];
            assert!((g - 9.81).abs() < 1e-11, "{first} {second} {at}: {g}");
        }
    }
}

/// Units must not matter: neither those of the masses, nor of the measured quantity, nor of its standard deviation.
#[test]
fn sizes_do_not_matter() {
    let fitted = |mass: f64, length: f64, deviation: f64| {
        let guess = Ball {
            m: mass,
            g: 9.81 * length,
            c: 0.1 * mass,
        };
        let start = guess.state([length], [4.0 * length]);
        let measured: Vec<f64> = heights()
            .into_iter()
            .enumerate()
            .map(|(k, y)| (y + if k % 2 == 0 { 1e-3 } else { -1e-3 }) * length)
            .collect();
        let fit = Fit::new(&guess).start(start, 0.0).step(0.05);
        fit.parameters(["g", "c"])
            .output_within("height", times(), &measured, deviation)
            .solve()
            .expect("a fit")
    };
    let plain = fitted(1.0, 1.0, 1.0);
    let sizes = [1e-150, 1e-9, 1.0, 1e9, 1e150];
    let kinds = sizes.into_iter().flat_map(|size| {
        let deviations = [1e-100, 1.0, 1e100].map(|deviation| (1.0, size, deviation));
        deviations.into_iter().chain([(size, 1.0, 1.0)])
    });
    for (mass, length, deviation) in kinds {
        let fit = fitted(mass, length, deviation);
        for (name, unit) in [("g", length), ("c", mass)] {
            let numbers = [&fit, &plain].map(|fit| (fit.value(name), fit.deviation(name)));
            let [
                (Some(value), Some(off)),
                (Some(expected), Some(expected_off)),
            ] = numbers
            else {
                panic!("{name} is looked for");
            };
            // The position of a minimum is known to the square root of the rounding unit relative to the deviations,
            // here about 1e-3 of them.
            assert!(
                (value / unit - expected).abs() < 1e-6 * expected_off,
                "{name} {mass:e} {length:e} {deviation:e}: {value:e}"
            );
            assert!(
                (off / unit / expected_off - 1.0).abs() < 1e-6,
                "{name} {mass:e} {length:e} {deviation:e}: {off:e} {expected_off:e}"
            );
        }
    }
}

/// The shortest use: the initial state is fitted, too.
#[test]
fn a_start_that_is_not_told_is_found() {
    let guess = Ball {
        m: 1.0,
        g: 8.0,
        c: 0.1,
    };
    let (times, measured) = (times(), heights());
    let fit = Fit::new(&guess)
        .parameters(["g", "c"])
        .output("height", &times, &measured)
        .solve()
        .expect("a fit");
    assert!((fit.value("g").expect("named") - 9.81).abs() < 1e-9);
    assert!((fit.value("c").expect("named") - 0.3).abs() < 1e-9);
    assert!((fit.start().q[0] - 1.0).abs() < 1e-10 && (fit.start().p[0] - 4.0).abs() < 1e-9);
    assert_eq!(fit.names().len(), 4);
    // A coordinate given by its name, from a close guess, with no other unknowns.
    let only_start = Fit::new(&TRUE)
        .start_near(TRUE.state([0.5], [3.0]), 0.0)
        .step(0.05)
        .output("y", &times, &measured)
        .solve()
        .expect("a fit");
    assert!((only_start.start().p[0] - 4.0).abs() < 1e-11);
}

/// Two links with friction in both joints and a spring in the second.
#[dynamics(
    coordinates(theta[2]),
    let x1 = l1*sin(theta[0]), let y1 = -l1*cos(theta[0]),
    let x2 = x1 + l2*sin(theta[1]), let y2 = y1 - l2*cos(theta[1]),
    let bend = theta[1] - theta[0],
    lagrangian = (dot(x1)^2 + dot(y1)^2)/2 + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(y1 + m2*y2) - k/2*bend^2,
    force(theta[0]) = -c1*dot(theta[0]) + c2*dot(bend),
    force(theta[1]) = -c2*dot(bend),
)]
struct Links {
    l1: f64,
    l2: f64,
    m2: f64,
    g: f64,
    k: f64,
    c1: f64,
    c2: f64,
}

/// Six parameters of a double pendulum from noisy angles: the errors are as large as the covariance says.
#[test]
fn noise_moves_parameters_by_their_covariance() {
    const NAMES: [&str; 6] = ["l1", "l2", "m2", "k", "c1", "c2"];
    let truth = Links {
        l1: 1.0,
        l2: 0.8,
        m2: 0.6,
        g: 9.81,
        k: 0.5,
        c1: 0.08,
        c2: 0.05,
    };
    let start = truth.state([1.1, -0.7], [0.0, 0.0]);
    let simulation = Simulation::new(&truth).step(0.025);
    let motion = simulation.run(start, 0.0..5.0).expect("a motion");
    let times: Vec<f64> = motion.states().iter().map(|node| node.t).collect();
    let guess = Links {
        l1: 1.05,
        l2: 0.75,
        m2: 0.7,
        k: 0.3,
        c1: 0.0,
        c2: 0.1,
        ..truth
    };
    let mut squares = Vec::new();
    for seed in 1..=10 {
        let mut noise = Noise(0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(seed));
        let angles = [0, 1].map(|a| {
            let nodes = motion.states().iter();
            nodes
                .map(|node| node.q[a] + 0.01 * noise.next())
                .collect::<Vec<_>>()
        });
        let fit = Fit::new(&guess)
            .start(start, 0.0)
            .step(0.025)
            .parameters(NAMES)
            .bounds("c1", 0.0..)
            .bounds("c2", 0.0..=1.0)
            .output_within("theta[0]", &times, &angles[0], 0.01)
            .output_within("theta[1]", &times, &angles[1], 0.01)
            .solve()
            .expect("a fit");
        assert!(fit.trials().len() < 40, "{} runs", fit.trials().len());
        let off: Vec<f64> = NAMES
            .iter()
            .zip(fit.values())
            .map(|(name, value)| {
                let index = truth.find_parameter(name).expect("a parameter");
                value - truth.parameter(index)
            })
            .collect();
        let inverse = fit.covariance().clone().try_inverse().expect("regular");
        let mut square = 0.0;
        for a in 0..6 {
            for b in 0..6 {
                square += off[a] * inverse[(a, b)] * off[b];
            }
        }
        squares.push(square);
        // The mean square of (y − m)/σ is about one.
        let mean =
            fit.residuals().iter().map(|r| r * r).sum::<f64>() / fit.residuals().len() as f64;
        assert!((mean - 1.0).abs() < 0.2, "{mean}");
    }
    // The squared errors follow χ² with six degrees of freedom: the mean of ten is 6 ± 1.1, and one value in a thousand
    // is above 22.5.
    let mean = squares.iter().sum::<f64>() / 10.0;
    assert!(mean > 2.5 && mean < 10.0, "{squares:?}");
    assert!(squares.iter().all(|one| *one < 22.5), "{squares:?}");
}

/// A point mass on a rod.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
)]
struct Rod {
    m: f64,
    g: f64,
    l: f64,
}

const ROD: Rod = Rod {
    m: 1.0,
    g: 9.81,
    l: 1.0,
};

/// A fit that ends because all runs nearby fail has not found a minimum: with a rod of another length the initial state
/// violates the constraint.
#[test]
fn runs_that_fail_nearby_are_no_end() {
    let guess = ROD;
    let start = guess.state([0.6, -0.8], [0.0, 0.0]);
    let times: Vec<f64> = (1..=20).map(|k| 0.1 * f64::from(k)).collect();
    let measured: Vec<f64> = times.iter().map(|t| 0.5 * (2.8 * t).cos()).collect();
    for deviation in [1.0, 1e200, 1e-200] {
        let fit = Fit::new(&guess).start(start, 0.0).step(0.02);
        let fit = fit.parameters(["l"]);
        let fit = fit.output_within("x", &times, &measured, deviation);
        let told = fit.solve().map(|fit| fit.to_string()).expect_err("no fit");
        let is_told =
            matches!(&told, FitError::NotConverged { why, .. } if why.contains("runs nearby fail"));
        assert!(is_told, "{deviation:e}: {told}");
    }
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let (times, measured) = (times(), heights());
    let start = TRUE.state([1.0], [4.0]);
    let fit = || Fit::new(&TRUE).start(start, 0.0).step(0.05);
    let with = |fit: Fit<'_, Ball, 1>| fit.output("height", &times, &measured).solve().map(|_| ());
    let error = |fit: Fit<'_, Ball, 1>| fit.solve().map(|_| ()).expect_err("no fit");
    assert_eq!(with(fit()), Err(FitError::NothingUnknown));
    assert_eq!(error(fit().parameters(["g"])), FitError::NothingMeasured);
    for names in [["g", "h"], ["g", "g"]] {
        let told = with(fit().parameters(names)).expect_err("no fit");
        assert!(matches!(&told, FitError::NoParameter { known, .. } if known.len() == 3));
        assert!(told.to_string().contains("`m`, `g`, `c`"));
    }
    let told = error(fit().parameters(["g"]).output("hight", &times, &measured));
    assert!(told.to_string().contains("`height`"), "{told}");
    let too_few = fit()
        .parameters(["g"])
        .output("height", &times[1..], &measured);
    assert!(matches!(error(too_few), FitError::Measured { .. }));
    let odd = fit().parameters(["g"]).output("height", [1.0], [f64::NAN]);
    assert!(matches!(error(odd), FitError::Measured { .. }));
    // The messages name the numbers that cannot be used.
    let told = |times: &[f64], values: &[f64]| {
        let fit = fit().parameters(["g"]);
        error(fit.output("height", times, values)).to_string()
    };
    let value = told(&[0.5, 1.5], &[1.0, f64::INFINITY]);
    assert!(value.contains("value [1], at t = 1.5, is inf"), "{value}");
    let time = told(&[0.5, f64::NAN], &[1.0, 2.0]);
    assert!(time.contains("time [1] is NaN"), "{time}");
    let lengths = told(&[0.5], &[1.0, 2.0]);
    assert!(lengths.contains("1 times and 2 values"), "{lengths}");
    for deviation in [0.0, -1.0, 5e-324, f64::NAN, f64::INFINITY] {
        let odd = fit().parameters(["g"]);
        let odd = error(odd.output_within("height", [1.0], [0.5], deviation));
        assert!(matches!(odd, FitError::Measured { .. }), "{odd}");
        assert!(
            odd.to_string().contains("in the unit of the output"),
            "{odd}"
        );
    }
    let early = fit().parameters(["g"]).output("height", [-1.0], [0.5]);
    assert_eq!(
        error(early),
        FitError::Early {
            time: -1.0,
            start: 0.0
        }
    );
    let few = fit().parameters(["g", "c"]).output("height", [1.0], [0.5]);
    let few = error(few);
    assert_eq!(
        few,
        FitError::TooFew {
            values: 1,
            unknowns: 2
        }
    );
    assert!(few.to_string().contains("fit fewer parameters"), "{few}");
    for never in [f64::NAN, f64::INFINITY] {
        let never = fit().start(start, never).parameters(["g"]);
        let told = error(never.output("height", [1.0], [0.5])).to_string();
        assert!(told.contains("but it must be finite"), "{told}");
    }
    let outside = with(fit().parameters(["c"]).bounds("c", 1.0..2.0));
    assert!(matches!(outside, Err(FitError::Bounds { value: 0.3, .. })));
    let far = with(fit().parameters(["c"]).bounds("c", 1e-320..=5e-310)).expect_err("no fit");
    assert!(
        far.to_string().contains("between 1e-320 and 5e-310"),
        "{far}"
    );
    let stray = with(fit().parameters(["c"]).bounds("g", 1.0..2.0));
    assert!(
        stray
            .expect_err("no fit")
            .to_string()
            .contains("is not fitted")
    );
    // A first value that is not a number has no bounds: the first run reports it.
    let unknown = Ball {
        g: f64::NAN,
        ..TRUE
    };
    let unknown = Fit::new(&unknown)
        .start(start, 0.0)
        .step(0.05)
        .parameters(["g"]);
    assert!(matches!(with(unknown), Err(FitError::Run(_))));
    // The motion depends on c/m only and not on the mass alone: the two parameters cannot be determined separately.
    let rest = TRUE.state([1.0], [0.0]);
    let both = Fit::new(&TRUE)
        .start(rest, 0.0)
        .step(0.05)
        .parameters(["m", "c"]);
    let told = with(both).expect_err("no fit");
    assert!(
        matches!(told, FitError::Undetermined { .. }),
        "{told:?} {told}"
    );
    // Only the initial state is unknown, and the model cannot be copied since it has no parameters.
    #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - 9.81*y)]
    struct Falling;
    let told = Fit::new(&Falling).output("y", &times, &measured).solve();
    let told = told.map(|fit| fit.to_string()).expect_err("no fit");
    assert_eq!(told, FitError::NotCopied);
    assert!(told.to_string().contains("no parameter"), "{told}");
    // The first run fails.
    let broken = Fit::new(&TRUE)
        .start(start, 0.0)
        .step(f64::NAN)
        .parameters(["g"]);
    assert!(matches!(
        with(broken),
        Err(FitError::Run(RunErrorKind::Step { .. }))
    ));
    let nowhere = Fit::new(&TRUE).start(start, f64::NAN).parameters(["g"]);
    assert!(matches!(with(nowhere), Err(FitError::Early { .. })));
}

/// For a model with constraints the initial state must be given; the parameter of a constraint can be fitted.
#[test]
fn constrained_models_are_fitted() {
    let rod = ROD;
    let start = rod.state([0.6, -0.8], [0.0, 0.0]);
    let simulation = Simulation::new(&rod).step(0.02);
    let motion = simulation.run(start, 0.0..2.0).expect("a motion");
    let times: Vec<f64> = motion.states().iter().map(|node| node.t).collect();
    let measured: Vec<f64> = motion.states().iter().map(|node| node.q[0]).collect();
    let guess = Rod { g: 9.0, ..rod };
    let fit = |guess: &Rod| {
        let fit = Fit::new(guess).step(0.02).parameters(["g"]);
        fit.output("x", &times, &measured)
            .solve()
            .map(|fit| fit.values()[0])
    };
    assert_eq!(fit(&guess), Err(FitError::StartOfConstraints));
    let fit = Fit::new(&guess)
        .start(start, 0.0)
        .step(0.02)
        .parameters(["g"]);
    let found = fit.output("x", &times, &measured).solve().expect("a fit");
    assert!((found.values()[0] - 9.81).abs() < 1e-10);
    let _: &runtime::Statistics = found.motion().statistics();
}

/// A pendulum with a motor of unknown strength.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + g*cos(theta),
    input(current),
    force(theta) = strength*current - c*dot(theta),
    output(angle) = theta,
)]
struct Motor {
    g: f64,
    strength: f64,
    c: f64,
}

/// Measurements with the inputs that caused them: a function, and a table, at whose knots elements end.
#[test]
fn models_with_inputs_are_fitted() {
    let truth = Motor {
        g: 9.81,
        strength: 1.7,
        c: 0.4,
    };
    let times: Vec<f64> = (1..=40).map(|k| 0.1 * f64::from(k)).collect();
    let (knots, currents) = ([0.0, 0.55, 1.31, 2.2], [1.0, -2.0, 0.5, 0.0]);
    let start = truth.state([0.1], [0.0]);
    let held = |motor| {
        tfe::Driven::new(motor)
            .table("current", &knots, &currents, Interpolation::Hold)
            .expect("a table")
    };
    let waves = |motor| {
        tfe::Driven::new(motor)
            .input("current", |t| (3.0 * t).sin())
            .expect("an input")
    };
    let guess = Motor {
        g: 9.81,
        strength: 1.0,
        c: 0.1,
    };
    for (true_model, first) in [(held(&truth), held(&guess)), (waves(&truth), waves(&guess))] {
        let run = Simulation::new(&true_model).step(0.1);
        let run = times.iter().fold(run, |run, t| run.break_at(*t));
        let motion = run.run(start, 0.0..4.0).expect("a run");
        let measured: Vec<f64> = times
            .iter()
            .map(|t| motion.at(*t).expect("inside").q[0])
            .collect();
        let fit = Fit::new(&first)
            .start(start, 0.0)
            .step(0.1)
            .parameters(["strength", "c"])
            .output("angle", &times, &measured);
        let fit = fit.solve().expect("a fit");
        let value = |name| fit.value(name).expect("named");
        assert!((value("strength") - 1.7).abs() < 1e-9, "{fit}");
        assert!((value("c") - 0.4).abs() < 1e-9, "{fit}");
    }
}
