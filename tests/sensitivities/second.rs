//! Second derivatives of losses, compared with closed forms.

use super::*;
use crate::differences::difference_over;
use std::sync::Mutex;

#[dynamics(coordinates(x), lagrangian = m*dot(x)^2/2 - k*x^2/2, force(x) = -c*dot(x), output(place) = x)]
struct Oscillator {
    m: f64,
    k: f64,
    c: f64,
}

/// x = e^(−γt) (cos ωt + γ/ω sin ωt) from rest at 1, γ = c/2m, ω² = k/m − γ²
fn place([m, k, c]: [f64; 3], t: f64) -> f64 {
    let rate = c / (2.0 * m);
    let omega = (k / m - rate * rate).sqrt();
    (-rate * t).exp() * ((omega * t).cos() + rate / omega * (omega * t).sin())
}

/// ∂²f/∂a∂b of closed forms by differences of eighth order, with a spacing that leads to errors of 1e-10.
fn second(f: impl Fn([f64; 3]) -> f64, at: [f64; 3], (i, j): (usize, usize)) -> f64 {
    let moved = |x: f64, place: usize, mut at: [f64; 3]| {
        at[place] += x;
        at
    };
    let derivative = |g: &dyn Fn(f64) -> f64| difference_over(2e-2, |x| [g(x)], 0.0)[0];
    derivative(&|x| derivative(&|y| f(moved(y, j, moved(x, i, at)))))
}

/// Compared with the closed form, at a parameter that is zero and at one that is not.
#[test]
fn second_derivatives_are_those_of_a_closed_form() {
    for c in [0.0, 0.2] {
        let model = Oscillator { m: 1.3, k: 2.1, c };
        let start = model.state([1.0], [0.0]);
        let loss = Loss::at_end(|node: &Node<1>| 0.5 * node.q[0] * node.q[0]);
        let run = Simulation::new(&model).element(Mixed::<8>).step(0.1);
        let hessian = run
            .hessian(start, 0.0..2.0, &loss, ["k", "c", "m"])
            .expect("second derivatives");
        let expected = |of: [f64; 3]| 0.5 * place(of, 2.0).powi(2);
        assert!((hessian.value() - expected([1.3, 2.1, c])).abs() < 1e-13);
        let places = [("m", 0), ("k", 1), ("c", 2)];
        for (a, i) in places {
            for (b, j) in places {
                let expected = second(expected, [1.3, 2.1, c], (i, j));
                let found = hessian.by(a, b);
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{a} {b}: {found} instead of {expected}"
                );
            }
        }
        assert!(hessian.errors().amax() < 1e-9, "{}", hessian.errors());
        assert_eq!(hessian.parameters(), ["k", "c", "m"]);
        assert_eq!(hessian.get("k", "m"), Some(hessian.by("m", "k")));
        assert_eq!(hessian.get("k", "x"), None);
        assert_eq!(hessian.matrix(), &hessian.matrix().transpose());
        assert_eq!(hessian.gradient().parameters(), ["m", "k", "c"]);
    }
}

/// A drag close to zero has the second derivatives of no drag, or an estimated error that says that they are
/// inaccurate.
#[test]
fn second_derivatives_by_parameters_next_to_zero() {
    let found = |c: f64| {
        let model = Oscillator { m: 1.3, k: 2.1, c };
        let loss = Loss::at_end(|node: &Node<1>| 0.5 * node.q[0] * node.q[0]);
        let run = Simulation::new(&model).element(Mixed::<8>).step(0.1);
        let hessian = run.hessian(model.state([1.0], [0.0]), 0.0..2.0, &loss, ["k", "c"]);
        let hessian = hessian.expect("second derivatives");
        assert!(
            hessian.errors().amax() < 1e-8,
            "{c:e}: {}",
            hessian.errors()
        );
        [("k", "k"), ("k", "c"), ("c", "c")].map(|(a, b)| hessian.by(a, b))
    };
    let expected = found(0.0);
    for c in [1e-9, 1e-12, -1e-15, 1e-20, 1e-200] {
        for (found, expected) in found(c).into_iter().zip(expected) {
            let error = (found - expected).abs();
            assert!(error < 1e-8, "{c:e}: {found} instead of {expected}");
        }
    }
}

/// Across bounces, and with a loss that depends on time.
#[test]
fn second_derivatives_go_through_bounces() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let loss = Loss::at_end(|node: &Node<1>| node.q[0]);
    let hessian = bouncing(&ball)
        .hessian(ball.state([1.0], [0.0]), 0.0..1.5, &loss, ["g", "floor"])
        .expect("second derivatives");
    // From rest at height 1 above the floor z: τ = √(2(1 − z)/g), and finally y = z + 0.64 g τ s − g s²/2 with s = 1.5
    // − 2.6 τ.
    let y = |[g, z, _]: [f64; 3]| {
        let tau = (2.0 * (1.0 - z) / g).sqrt();
        let s = 1.5 - 2.6 * tau;
        z + 0.64 * g * tau * s - g * s * s / 2.0
    };
    for (a, i) in [("g", 0), ("floor", 1)] {
        for (b, j) in [("g", 0), ("floor", 1)] {
            let expected = second(y, [9.81, 0.0, 0.0], (i, j));
            let found = hessian.by(a, b);
            let error = (found - expected).abs() / expected.abs().max(1.0);
            assert!(
                error < 1e-8,
                "{a} {b}: {found} instead of {expected}, {error:.1e}"
            );
        }
    }
}

/// With a constraint that contains the parameter, and an integral: compared with second differences of the loss.
#[test]
fn second_derivatives_with_constraints_and_integrals() {
    let rod = |l: f64, g: f64| Rod {
        m: 1.3,
        g,
        c: 0.2,
        l,
    };
    let loss = Loss::integral("height").and(Loss::at_end(|node: &Node<2>| node.q[0]));
    let value = |[l, g, _]: [f64; 3]| {
        let model = rod(l, g);
        let start = model.state([0.6 * l, -0.8 * l], [0.4, 0.3]);
        let run = Simulation::new(&model).element(Mixed::<6>).step(0.05);
        let (value, _) = run.gradient(start, 0.0..1.0, &loss).expect("a loss");
        value
    };
    let model = rod(1.0, 9.81);
    let run = Simulation::new(&model).element(Mixed::<6>).step(0.05);
    let start = model.state([0.6, -0.8], [0.4, 0.3]);
    let by_g = run
        .hessian(start, 0.0..1.0, &loss, ["g"])
        .expect("second derivatives");
    // With another l the initial state would violate the constraint: by g alone.
    let expected = second(value, [1.0, 9.81, 0.0], (1, 1));
    let found = by_g.by("g", "g");
    assert!((found - expected).abs() < 1e-8, "{found} {expected}");
}

#[test]
fn what_cannot_be_differentiated_twice_is_told() {
    let model = Oscillator {
        m: 1.3,
        k: 2.1,
        c: 0.0,
    };
    let start = model.state([1.0], [0.0]);
    let run = Simulation::new(&model).step(0.1);
    let loss = Loss::output_at_end("place");
    let error = run.hessian(start, 0.0..1.0, &loss, ["k", "mass"]);
    let error = error.expect_err("no such parameter");
    assert!(matches!(error.kind(), RunErrorKind::NoParameter { name, .. } if name == "mass"));
    assert_eq!(error.partial().states().len(), 11);
    let none: [&str; 0] = [];
    let empty = run
        .hessian(start, 0.0..1.0, &loss, none)
        .expect("a gradient");
    assert_eq!(empty.matrix().shape(), (0, 0));
    let unknown = run.hessian(start, 0.0..1.0, &Loss::output_at_end("y"), ["k"]);
    let unknown = unknown.expect_err("no such output");
    assert!(matches!(unknown.kind(), RunErrorKind::NoOutput { .. }));

    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2)]
    struct Counted {
        k: f64,
        _seen: Mutex<u32>,
    }
    let counted = Counted {
        k: 1.0,
        _seen: Mutex::new(0),
    };
    let loss = Loss::at_end(|node: &Node<1>| node.q[0]);
    let fixed = Simulation::new(&counted)
        .step(0.1)
        .hessian(start, 0.0..1.0, &loss, ["k"]);
    let fixed = fixed.expect_err("a field that cannot be copied");
    assert_eq!(*fixed.kind(), RunErrorKind::ParametersFixed);
}

/// Differences by a parameter of 1e-308 divide by a number whose reciprocal overflows.
#[test]
fn second_derivatives_that_are_not_finite_are_refused() {
    let model = Oscillator {
        m: 1.3,
        k: 1e-308,
        c: 0.0,
    };
    let loss = Loss::output_at_end("place");
    let run = Simulation::new(&model).step(0.1);
    let error = run.hessian(model.state([1.0], [0.0]), 0.0..1.0, &loss, ["k"]);
    let error = error.expect_err("no number");
    assert!(matches!(error.kind(), RunErrorKind::Loss { name, .. } if name == "k"));
    assert_eq!(error.partial().states().len(), 11);
}
