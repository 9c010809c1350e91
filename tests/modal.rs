//! Modal reduction: frequencies compared with closed forms, motions with those of the full model, and models without
//! modes, which are refused.

use std::f64::consts::PI;
use tfe::modal::ModalError;
use tfe::prelude::*;
use tfe::runtime::CoordinateName;

/// A row of masses between two walls.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2 + m*g*q[i])
        - k/2*q[0]^2 - k/2*q[n-1]^2 - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2),
    output(last) = q[n-1], output(speed) = dot(q[0]),
    output(stretch[i in 0..n-1]) = (q[i+1] - q[i])^2,
)]
struct Row {
    n: usize,
    m: f64,
    k: f64,
    g: f64,
}

/// Two masses joined by a spring and otherwise free, and a term that only adds a constant to a momentum.
#[dynamics(coordinates(x[2]), lagrangian = m*dot(x[0])^2 + m/2*dot(x[1])^2 + c*dot(x[1]) - k/2*(x[1]-x[0])^2 - m*g*(2*x[0]+x[1]))]
struct Free {
    m: f64,
    c: f64,
    k: f64,
    g: f64,
}

/// Kinetic energies with products, a Hamiltonian with a drift, and coordinates whose equilibrium is not at zero.
#[dynamics(
    coordinates(x, y), momenta(p, r),
    hamiltonian = p^2/2 + p*r/3 + r^2 + u*p + 2*(x - 1)^2 + x*y/2 + y^2,
    output(both) = x + 2*y, output(product) = p*r,
)]
struct Drifting {
    u: f64,
}

/// A cart on a spring, and a body on a spring to it; the position of the body in the cart couples their masses.
#[dynamics(coordinates(cart, body), lagrangian = frame/2*dot(cart)^2 + m/2*(dot(cart) + dot(body))^2 - k/2*cart^2 - c/2*body^2 + f*(cart + body))]
struct Riding {
    frame: f64,
    m: f64,
    k: f64,
    c: f64,
    f: f64,
}

fn row(n: usize, g: f64) -> Row {
    let (m, k) = (0.7, 3.1);
    Row { n, m, k, g }
}

fn names(names: &[CoordinateName]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

/// The frequencies in closed form: 2 √(k/m) sin(jπ/(2(n+1))).
fn frequency(row: &Row, j: usize) -> f64 {
    2.0 * (row.k / row.m).sqrt() * (PI * j as f64 / (2 * (row.n + 1)) as f64).sin()
}

#[test]
fn frequencies_are_those_of_the_closed_form() {
    let row = row(20, 0.0);
    let modal: Modal<'_, Row, 20> = Modal::of(&row).unwrap();
    for (k, found) in modal.frequencies().iter().enumerate() {
        let exact = frequency(&row, k + 1);
        assert!((found / exact - 1.0).abs() < 1e-12, "{k}: {found} {exact}");
    }
    // With fewer modes, the lowest ones are found.
    let few: Modal<'_, Row, 3> = Modal::of(&row).unwrap();
    assert_eq!(few.frequencies()[..], modal.frequencies()[..3]);
    // The shapes are sines, normalised by the mass matrix.
    let scale = (2.0 / (row.m * 21.0)).sqrt();
    for k in 0..3 {
        let shape = few.shape(k).unwrap();
        let sine = |i: usize| scale * (PI * ((k + 1) * (i + 1)) as f64 / 21.0).sin();
        let sign = if sine(0) * shape[0] < 0.0 { -1.0 } else { 1.0 };
        for (i, entry) in shape.iter().enumerate() {
            // Rounding errors of eigenvectors are those of the matrix divided by the gap to the next eigenvalue, here a
            // sixtieth of the largest.
            assert!((entry - sign * sine(i)).abs() < 1e-12, "{k} {i}");
        }
    }
    assert_eq!(few.shape(3), None);
}

/// A run that continues from the checkpoint of another model, with other frequencies, equals a run from the state of
/// that checkpoint.
#[test]
fn modes_go_on_from_a_checkpoint_of_others() {
    let (soft, stiff) = (
        row(8, 0.4),
        Row {
            k: 5.0,
            ..row(8, 0.4)
        },
    );
    let soft: Modal<'_, Row, 3> = Modal::of(&soft).unwrap();
    let stiff: Modal<'_, Row, 3> = Modal::of(&stiff).unwrap();
    let start = State {
        q: [1.0, 0.5, -0.3],
        p: [0.0, 0.2, 0.1],
    };
    let first = Simulation::new(&soft).element(Mixed::<6>).step(0.1);
    let first = first.record_every(10).run(start, 0.0..5.0).unwrap();
    let checkpoint = first.checkpoint().unwrap();
    let second = Simulation::new(&stiff).element(Mixed::<6>).step(0.1);
    let second = second.record_every(10);
    let resumed = second.resume(checkpoint, 10.0).unwrap();
    let anew = second.run(*checkpoint.state(), 5.0..10.0).unwrap();
    for k in 0..3 {
        // The rounding errors of fifty steps.
        assert!((resumed.last().q[k] - anew.last().q[k]).abs() < 1e-13);
        assert!((resumed.last().p[k] - anew.last().p[k]).abs() < 1e-13);
    }
}

#[test]
fn all_modes_together_move_as_the_full_model() {
    let row = row(8, 0.4);
    let modal: Modal<'_, Row, 8> = Modal::of(&row).unwrap();
    let q: Vec<f64> = (0..8).map(|i| (0.9 * i as f64).sin()).collect();
    let v: Vec<f64> = (0..8).map(|i| (0.4 * i as f64).cos()).collect();
    let start = row.state(q, v);
    let reduced = modal.reduce(&start);
    let back = modal.expand(&reduced);
    for (a, b) in start
        .q
        .iter()
        .chain(&start.p)
        .zip(back.q.iter().chain(&back.p))
    {
        assert!((a - b).abs() < 1e-13);
    }
    let full = Simulation::new(&row).element(Mixed::<9>).step(0.05);
    let full = full.run(start, 0.0..20.0).unwrap();
    let motion = Simulation::new(&modal).element(Mixed::<9>).step(0.05);
    let motion = motion.run(reduced, 0.0..20.0).unwrap();
    assert_eq!(motion.states().len(), full.states().len());
    for (one, all) in motion.states().iter().zip(full.states()) {
        let one = modal.expand(&one.state());
        for (a, b) in one.q.iter().chain(&one.p).zip(all.q.iter().chain(&all.p)) {
            assert!((a - b).abs() < 1e-10, "{a} {b}");
        }
    }
    assert!((motion.energies()[0] / full.energies()[0] - 1.0).abs() < 1e-12);
    assert!(motion.energy_error() < 1e-12);
    // The outputs have the names and the values of the full model, including those at each site.
    assert_eq!(
        names(motion.outputs().names()),
        names(full.outputs().names())
    );
    assert_eq!(motion.outputs().names().len(), 2 + 7);
    for name in ["last", "speed", "stretch[6]"] {
        let columns = [motion.outputs().column(name), full.outputs().column(name)];
        let [one, all] = columns.map(|column| column.unwrap());
        assert!(
            one.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-10),
            "{name}"
        );
    }
}

#[test]
fn fewer_modes_keep_their_part_of_the_motion() {
    let row = row(30, 0.2);
    let modal: Modal<'_, Row, 2> = Modal::of(&row).unwrap();
    // The position of a row that hangs at rest is no excitation of its modes.
    let hanging = row.state(modal.equilibrium(), vec![0.0; 30]);
    let rest = modal.reduce(&hanging);
    assert!(rest.q.iter().chain(&rest.p).all(|x| x.abs() < 1e-14));
    // The displacement of masses between two walls under their weight is m g / k · j (n + 1 − j) / 2.
    for (i, q) in modal.equilibrium().iter().enumerate() {
        let j = (i + 1) as f64;
        let exact = row.m * row.g / row.k * j * (31.0 - j) / 2.0;
        assert!((q / exact - 1.0).abs() < 1e-12, "{i}: {q} {exact}");
    }
    // An excitation of one of the two modes remains in this mode.
    let start = modal.expand(&State {
        q: [0.0, 0.3],
        p: [0.0; 2],
    });
    let run = Simulation::new(&row).element(Mixed::<7>).step(0.1);
    let run = run.run(start, 0.0..5.0).unwrap();
    let end = modal.reduce(&run.last().state());
    let exact = 0.3 * (5.0 * modal.frequencies()[1]).cos();
    assert!(end.q[0].abs() < 1e-11 && (end.q[1] - exact).abs() < 1e-11);
    let short = tfe::family::FamilyState {
        q: vec![0.0; 3],
        p: vec![0.0; 3],
    };
    assert!(modal.reduce(&short).q[0].is_nan());
}

#[test]
fn what_nothing_holds_falls() {
    let free = Free {
        m: 0.5,
        c: 0.3,
        k: 2.0,
        g: 9.81,
    };
    let modal: Modal<'_, Free, 2, State<2>> = Modal::of(&free).unwrap();
    let [rigid, elastic] = modal.frequencies();
    assert_eq!(rigid, 0.0);
    // The masses 2m and m on a spring.
    assert!((elastic / (free.k * 1.5 / free.m).sqrt() - 1.0).abs() < 1e-14);
    let start = free.state([0.0, 0.1], [0.0; 2]);
    let motion = Simulation::new(&modal).element(Mixed::<6>).step(0.05);
    let motion = motion.run(modal.reduce(&start), 0.0..2.0).unwrap();
    let end = modal.expand(&motion.last().state());
    let fall = -free.g * 2.0 * 2.0 / 2.0;
    let stretch = 0.1 * (2.0 * elastic).cos();
    let exact = [
        fall + (0.1 - stretch) / 3.0,
        fall + (0.1 + 2.0 * stretch) / 3.0,
    ];
    for (found, exact) in end.q.iter().zip(exact) {
        assert!((found - exact).abs() < 1e-10, "{found} {exact}");
    }
    let full = Simulation::new(&free).element(Mixed::<6>).step(0.05);
    let full = full.run(start, 0.0..2.0).unwrap();
    for (one, all) in end.p.iter().zip(full.last().p) {
        assert!((one - all).abs() < 1e-10, "{one} {all}");
    }
    assert!((motion.energies()[0] - full.energies()[0]).abs() < 1e-12);
}

#[test]
fn slow_modes_beside_stiff_springs() {
    let (m, f) = (0.7, 1.3);
    let springs = [1e-150, 1e-20, 1.0, 1e20, 1e60, 1e150];
    for k in springs {
        for c in springs {
            let riding = Riding {
                frame: m,
                m,
                k,
                c,
                f,
            };
            let modal: Modal<'_, Riding, 2, State<2>> = Modal::of(&riding).unwrap();
            // The frequencies are the roots of m²ω⁴ − m (k + 2c) ω² + k c = 0.
            let sum = k + 2.0 * c + k.hypot(2.0 * c);
            let exact = [(2.0 * (k / sum) * (c / m)).sqrt(), (sum / 2.0 / m).sqrt()];
            for (found, exact) in modal.frequencies().iter().zip(exact) {
                let error = (found / exact - 1.0).abs();
                assert!(error < 1e-14, "k = {k}, c = {c}: {found} {exact}");
            }
            // The softer spring carries the force. The displacement of the stiffer one may be less than a rounding
            // error of that of the softer one, and is not compared.
            let (softer, spring) = if k <= c { (0, k) } else { (1, c) };
            let found = modal.equilibrium()[softer];
            let error = (found * spring / f - 1.0).abs();
            assert!(error < 1e-14, "k = {k}, c = {c}: {found}");
        }
    }
}

#[test]
fn rigid_and_growing_modes_beside_stiff_springs() {
    let (m, f) = (0.7, 0.0);
    for stiff in [1.0, 1e20, 1e150] {
        for (k, c) in [(0.0, stiff), (stiff, 0.0)] {
            let riding = Riding {
                frame: m,
                m,
                k,
                c,
                f,
            };
            let modal: Modal<'_, Riding, 2, State<2>> = Modal::of(&riding).unwrap();
            assert_eq!(modal.frequencies()[0], 0.0, "k = {k}, c = {c}");
        }
    }
    for (k, c, mass) in [(-1.0, 1e20, 2.0 * m), (1e20, -1.0, m)] {
        let riding = Riding {
            frame: m,
            m,
            k,
            c,
            f,
        };
        let modal: Modal<'_, Riding, 2, State<2>> = Modal::of(&riding).unwrap();
        // The stiff spring is close to a rod.
        let exact = -(1.0 / mass).sqrt();
        let error = (modal.frequencies()[0] / exact - 1.0).abs();
        assert!(error < 1e-14, "k = {k}, c = {c}");
    }
}

#[test]
fn hamiltonians_have_modes_too() {
    let model = Drifting { u: 0.4 };
    let modal: Modal<'_, Drifting, 2, State<2>> = Modal::of(&model).unwrap();
    let start = State {
        q: [0.2, -0.5],
        p: [0.3, 0.1],
    };
    let run = Simulation::new(&model).element(Mixed::<9>).step(0.05);
    let full = run.run(start, 0.0..6.0).unwrap();
    let run = Simulation::new(&modal).element(Mixed::<9>).step(0.05);
    let motion = run.run(modal.reduce(&start), 0.0..6.0).unwrap();
    let end = modal.expand(&motion.last().state());
    for (one, all) in end
        .q
        .iter()
        .chain(&end.p)
        .zip(full.last().q.iter().chain(&full.last().p))
    {
        assert!((one - all).abs() < 1e-11, "{one} {all}");
    }
    assert!((motion.energies()[0] - full.energies()[0]).abs() < 1e-13);
    for name in ["both", "product"] {
        let columns = [motion.outputs().column(name), full.outputs().column(name)];
        let [one, all] = columns.map(|column| column.unwrap());
        assert!(
            one.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-11),
            "{name}"
        );
    }
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + cos(x))]
struct Pendulum;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2*(1 + cos(t)/9))]
struct Parametric;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, dissipation = dot(x)^2/9)]
struct Damped;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2 - y^2 + b*(x*dot(y) - y*dot(x)))]
struct Gyroscopic {
    b: f64,
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2 - y^2, constraint(line) = x - y)]
struct Held;

#[test]
fn what_has_no_modes() {
    #[track_caller]
    fn check<M: tfe::modal::Reducible<State<N>>, const N: usize>(model: &M, expected: &ModalError) {
        let error = Modal::<'_, M, 1, State<N>>::of(model).unwrap_err();
        assert_eq!(error, *expected);
        assert!(error.to_string().len() > 40);
    }
    check(&Pendulum, &ModalError::NotLinear);
    check(&Parametric, &ModalError::TimeDependent);
    check(&Damped, &ModalError::Forced);
    check(&Held, &ModalError::Constrained);
    let turning = ModalError::VelocityCoupling {
        velocity: 1,
        coordinate: 0,
    };
    check(&Gyroscopic { b: 0.2 }, &turning);
    assert!(turning.to_string().contains("leave those out"));
    let (m, k, g) = (1.0, 1.0, 0.0);
    check(
        &Free {
            m: 0.0,
            c: 0.0,
            k,
            g,
        },
        &ModalError::MassNotPositive,
    );
    check(
        &Free {
            m: -1.0,
            c: 0.0,
            k,
            g,
        },
        &ModalError::MassNotPositive,
    );
    check(
        &Free {
            m,
            c: 0.0,
            k: f64::NAN,
            g,
        },
        &ModalError::NotFinite,
    );
    // The mass matrix is singular: its last pivot is zero, or a rounding error of either sign.
    for m in [0.3, 0.5, 0.7, 1.0, 2.0, 7.0] {
        let (frame, c, f) = (0.0, 1.0, 0.0);
        check(&Riding { frame, m, k, c, f }, &ModalError::MassNotPositive);
    }
    let none = Row { n: 0, m, k, g };
    let error = Modal::<'_, Row, 1>::of(&none).unwrap_err();
    assert!(matches!(error, ModalError::Family(_)), "{error}");
    for (modes, coordinates) in [(0, 8), (9, 8)] {
        let row = row(8, 0.0);
        let error = match modes {
            0 => Modal::<'_, Row, 0>::of(&row).unwrap_err(),
            _ => Modal::<'_, Row, 9>::of(&row).unwrap_err(),
        };
        assert_eq!(error, ModalError::Modes { modes, coordinates });
    }
}

#[test]
fn modes_are_rungs() {
    let row = row(16, 0.0);
    let one: Modal<'_, Row, 1> = Modal::of(&row).unwrap();
    let four: Modal<'_, Row, 4> = Modal::of(&row).unwrap();
    // The first mode, and a thousandth of the third.
    let all: Modal<'_, Row, 16> = Modal::of(&row).unwrap();
    let mut amplitudes = State {
        q: [0.0; 16],
        p: [0.0; 16],
    };
    (amplitudes.q[0], amplitudes.q[2]) = (1.0, 1e-3);
    let start = all.expand(&amplitudes);
    let ladder = Fidelity::new(0.0..30.0)
        .rung("1 mode", &one, one.reduce(&start))
        .rung("4 modes", &four, four.reduce(&start))
        .rung("full", &row, start)
        .outputs(["last"])
        .elements([Mixed::<5>.into()])
        .accuracies([1e-2, 1e-6])
        .repeat_for(std::time::Duration::ZERO)
        .run()
        .unwrap();
    // At the last mass, the shape of the third mode is sin 3x/sin x = 2.97 times that of the first, x = π/17. Both
    // motions have their maximum at the start.
    let error = ladder.rungs()[0].model_error().unwrap();
    let ratio = 1e-3 * (3.0 * PI / 17.0).sin() / (PI / 17.0).sin();
    assert!((error / ratio - 1.0).abs() < 0.1, "{error:e} {ratio:e}");
    assert_eq!(
        ladder.rungs()[0]
            .choices()
            .filter(|one| one.error < 1e-3)
            .count(),
        0
    );
    assert!(ladder.rungs()[1].choices().any(|one| one.error < 1e-6));
}
