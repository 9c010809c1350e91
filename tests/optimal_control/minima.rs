//! Stationary points that are minima, and others that are not.

use super::*;

/// A pendulum with a torque, hanging at θ = 0, where the cost of its depth is highest.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + cos(theta),
    input(u),
    force(theta) = u,
    output(effort) = u^2,
    output(depth) = weight*(1 + cos(theta)),
    output(distance) = -weight*theta^2,
)]
struct Pendulum {
    weight: f64,
}

/// From hanging at rest, with the torque zero as the first guess: by symmetry this is a stationary point.
fn hanging(pendulum: &Pendulum) -> OptimalControl<'_, Pendulum, 1> {
    OptimalControl::of(pendulum)
        .elements(20)
        .from(pendulum.state([0.0], [0.0]))
        .span(0.0..2.0)
        .running_cost("effort")
}

#[test]
fn stationary_points_that_are_no_minima_are_left() {
    // The smallest ∫ u² dt that brings a pendulum from rest to θ within the time T is θ² divided by ∫ sin² = T/2 −
    // sin(2T)/4, and w θ²/2 is gained.
    let critical = 2.0 / (1.0 - 4.0_f64.sin() / 4.0);
    let best = |weight: f64| {
        let pendulum = Pendulum { weight };
        let best = hanging(&pendulum).end_cost("depth").solve();
        best.unwrap_or_else(|error| panic!("{weight}: {error}"))
    };
    let rest = best(0.95 * critical);
    assert!((rest.cost() - 1.9 * critical).abs() < 1e-12);
    assert!(rest.motion().last().q[0].abs() < 1e-12);
    // Reference values computed independently: by a Runge–Kutta method instead of elements, with all equations in one
    // matrix.
    for (weight, known) in [
        (1.02 * critical, 3.428752),
        (1.1 * critical, 3.654510),
        (5.0, 5.223040),
    ] {
        let swung = best(weight);
        assert!(
            (swung.cost() / known - 1.0).abs() < 1e-5,
            "{weight}: {}",
            swung.cost()
        );
        assert!(swung.cost() < 2.0 * weight && swung.motion().last().q[0].abs() > 0.3);
        // The stationary point that was left is in the history.
        let first = swung.history()[0];
        assert!((first.cost - 2.0 * weight).abs() < 1e-12 && first.correction < 1e-10);
    }

    // In the opposite case the point that is left is symmetric, and the minimum is one of two.
    let pendulum = Pendulum { weight: 5.0 };
    let other = hanging(&pendulum)
        .end_cost("depth")
        .guess_input("u", |_| -0.5)
        .solve()
        .expect("a minimum");
    assert!((other.cost() / best(5.0).cost() - 1.0).abs() < 1e-9);
}

#[test]
fn stationary_points_between_given_ends_are_left() {
    let best = |weight: f64| {
        let pendulum = Pendulum { weight };
        let rest = pendulum.state([0.0], [0.0]);
        let best = OptimalControl::of(&pendulum)
            .elements(20)
            .from_to(rest, rest, 0.0..4.0)
            .running_cost("effort")
            .running_cost("depth")
            .solve();
        best.unwrap_or_else(|error| panic!("{weight}: {error}"))
    };
    // Too little is gained on the way there and back: at most 2 w over the whole time.
    assert!((best(1.0).cost() - 8.0).abs() < 1e-12);
    let swung = best(5.0);
    assert!(
        (swung.cost() / 37.220222 - 1.0).abs() < 1e-5,
        "{}",
        swung.cost()
    );
    assert!(swung.motion().last().q[0].abs() < 1e-12);
}

#[test]
fn costs_that_fall_without_end_are_told() {
    use OptimalControlErrorKind as Kind;
    let pendulum = Pendulum { weight: 2.0 };
    let error = hanging(&pendulum)
        .end_cost("distance")
        .solve()
        .expect_err("no minimum");
    let Kind::NoMinimum {
        element,
        time,
        iterations,
    } = *error.kind()
    else {
        panic!("{error}");
    };
    assert!(element < 20 && (time - 0.1 * element as f64).abs() < 1e-12);
    assert_eq!(iterations, 1);
    assert!(error.to_string().contains("guess_input"), "{error}");
    let partial = error.partial().expect("what was done");
    assert!(partial.cost() == 0.0 && partial.history().len() == 1);

    // Here the torque costs more than it gains (1/(1 − sin(4)/4) = 0.84), but the velocity at the start is free.
    let pendulum = Pendulum { weight: 0.5 };
    let error = OptimalControl::of(&pendulum)
        .elements(20)
        .start(Component::Coordinate(0), 0.0)
        .span(0.0..2.0)
        .running_cost("effort")
        .end_cost("distance")
        .solve()
        .expect_err("no minimum");
    assert!(
        matches!(
            error.kind(),
            Kind::NoMinimum {
                element: 0,
                iterations: 1,
                ..
            }
        ),
        "{error}"
    );
}
