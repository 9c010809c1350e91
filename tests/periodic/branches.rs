//! Branches of periodic orbits that end at rest, and in units of any size.

use crate::continuation::{close, kinds, resolved};
use crate::models::PENDULUM;
use std::f64::consts::TAU;
use tfe::continuation::{
    Branch, BranchWarning, ContinuationError, ContinuationErrorKind, End, EventKind,
};
use tfe::prelude::*;

/// A hardening oscillator, and next to it a linear one, damped, with a force in other units.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2/2 - x^4/4 - 20*y^2,
    force(x) = cos(omega*t)/2 - dot(x)/10,
    force(y) = large*cos(omega*t) - dot(y)/2,
    sensitivity(omega),
)]
#[derive(Clone)]
struct Beside {
    large: f64,
    omega: f64,
}

/// Orbits of given energy, or of given period, shrink to the pendulum at rest. There are none beyond it.
#[test]
fn branches_end_where_their_orbits_come_to_rest() {
    let pendulum = PENDULUM;
    let continuation = || {
        Continuation::of(&pendulum)
            .parameter(|pendulum| &mut pendulum.k)
            .range(1.0..0.1)
            .element(Mixed::<5>)
            .elements(40)
            .guess(|t| ([1.2 * (0.9 * t).cos()], [-1.08 * (0.9 * t).sin()]))
    };
    let of_energy = continuation().unknown_period(7.0);
    let of_period = continuation().period(|_| 7.0);
    // H = −k at rest, and T = 2π/√k.
    for (continuation, rest) in [(of_energy, 1.2_f64.cos()), (of_period, (TAU / 7.0).powi(2))] {
        let branch = continuation.run().expect("a branch");
        assert_eq!(branch.end(), Some(End::Rest));
        assert!(branch.events().is_empty());
        let last = branch.points().last().expect("points");
        // Ten of the smallest steps, 1e-5 of the amplitude, squared; elements of eighth order.
        close(last.parameter, rest, 1e-9);
        close(last.period, TAU / rest.sqrt(), 1e-8);
        let mut pairs = branch.points().windows(2);
        assert!(pairs.all(|pair| pair[1].amplitudes[0] < pair[0].amplitudes[0]));
    }
}

/// The response of both over ω, from one side of the resonance of the first one to the other.
fn response(large: f64, end: f64) -> Branch<Beside, 2> {
    let model = Beside { large, omega: 0.8 };
    Continuation::of(&model)
        .parameter(|model| &mut model.omega)
        .range(0.8..end)
        .element(Mixed::<5>)
        .elements(40)
        .period(|model| TAU / model.omega)
        .guess(move |t| {
            let (sin, cos) = (0.8 * t).sin_cos();
            let y = large / (40.0 - 0.64);
            ([cos, y * cos], [-0.8 * sin, -0.8 * y * sin])
        })
        .run()
        .unwrap_or_else(|error| panic!("{large:e}, {end}: {error}"))
}

/// Folds do not depend on what moves next to the oscillator: in the arc length, each coordinate is scaled by its own
/// size.
#[test]
fn folds_of_small_coordinates_are_found_beside_large_ones() {
    let alone = response(0.0, 3.5);
    assert_eq!(kinds(&alone), [EventKind::Fold, EventKind::Fold]);
    for large in [1e-9, 1e9] {
        let branch = response(large, 3.5);
        assert_eq!(kinds(&branch), [EventKind::Fold, EventKind::Fold]);
        assert_eq!(branch.end(), Some(End::Range));
        for (fold, expected) in branch.events().iter().zip(alone.events()) {
            // Both are found up to rounding errors, times the condition number of the equations at folds.
            close(fold.point.parameter, expected.point.parameter, 1e-9);
        }
    }
}

/// A branch that leaves the range just before a fold, and one that begins there and returns: both are inside the range
/// again within one step.
#[test]
fn branches_end_at_bounds_beside_folds() {
    let whole = response(0.0, 3.5);
    let fold = whole.events()[0].point.parameter;
    let bound = fold - 1e-4;
    let before = response(0.0, bound);
    assert_eq!((before.end(), kinds(&before)), (Some(End::Range), vec![]));
    let last = before.points().len() - 1;
    let start = &before.points()[last];
    assert_eq!(start.parameter, bound);
    let round = Continuation::of(before.model(last).expect("a model"))
        .parameter(|model| &mut model.omega)
        .range(bound..3.5)
        .element(Mixed::<5>)
        .elements(40)
        .period(|model| TAU / model.omega)
        .guess_from(start.start)
        .run()
        .expect("a branch");
    assert_eq!(
        (round.end(), kinds(&round)),
        (Some(End::Range), vec![EventKind::Fold])
    );
    close(round.events()[0].point.parameter, fold, 1e-9);
    let end = &round.points()[round.points().len() - 1];
    assert_eq!(end.parameter, bound);
    // The other orbit with this frequency: the amplitudes differ by the order of the square root of 1e-4.
    close(round.points()[0].amplitudes[0], start.amplitudes[0], 1e-9);
    assert!((end.amplitudes[0] - start.amplitudes[0]).abs() > 1e-4);
}

/// The derivative of the period by the parameter, where a small part of the range extends beyond a pole.
#[test]
fn periods_change_as_they_do_beside_poles() {
    let omega = 0.5;
    let model = Beside { large: 1.0, omega };
    let branch = Continuation::of(&model)
        .parameter(|model| &mut model.omega)
        .range(omega..1e6)
        .period(|model| TAU / model.omega)
        .guess(move |t| {
            let (sin, cos) = (omega * t).sin_cos();
            ([0.6 * cos, 0.0], [-0.6 * omega * sin, 0.0])
        })
        .max_points(1)
        .run()
        .expect("a branch");
    let tangent = branch.points()[0].tangent;
    let slope = tangent.period / tangent.parameter;
    // Differences of two orders agree to 1e-9.
    close(slope * omega * omega / TAU, -1.0, 1e-8);
}

/// A first step longer than a twentieth of the range is made; one that contradicts the other settings is an error.
#[test]
fn the_first_step_is_the_one_that_was_asked_for() {
    let model = Beside {
        large: 0.0,
        omega: 5.0,
    };
    let continuation = || {
        Continuation::of(&model)
            .parameter(|model| &mut model.omega)
            .range(5.0..6.0)
            .elements(20)
            .period(|model| TAU / model.omega)
    };
    let branch = continuation().step(0.2).max_points(2).run();
    let branch = branch.expect("a branch");
    // In arc length, where the small response x = −1/2 cos(ωt)/(ω² − 1) is scaled to a tenth: 0.19.
    let step = branch.points()[1].parameter - 5.0;
    assert!((0.15..0.2).contains(&step), "{step}");
    for (step, smallest, largest) in [(0.2, 1e-3, 0.1), (0.01, 0.02, 0.1), (0.1, 0.2, 0.05)] {
        let steps = continuation().step(step).smallest_step(smallest);
        let error = steps.largest_step(largest).run().expect_err("no branch");
        assert!(
            matches!(error.kind(), ContinuationErrorKind::Steps { .. }),
            "{error}"
        );
    }
}

#[test]
fn parameters_that_are_no_numbers_are_told() {
    for omega in [f64::NAN, f64::INFINITY] {
        let model = Beside { large: 1.0, omega };
        let error = Continuation::of(&model)
            .parameter(|model| &mut model.omega)
            .range(0.5..2.0)
            .period(|_| 1.0)
            .run()
            .expect_err("no branch");
        assert!(
            matches!(error.kind(), ContinuationErrorKind::Range { .. }),
            "{error}"
        );
    }
}

/// A damped rotor, driven by a torque. It rotates as long as the torque is above that of a homoclinic orbit; the period
/// grows without bounds towards it, and there are no folds.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + cos(theta),
    force(theta) = torque - dot(theta)/2,
    sensitivity(torque),
)]
#[derive(Clone)]
struct Rotor {
    torque: f64,
}

/// The rotations of the rotor on 60 equal elements, down to a torque.
fn rotations(element: Element, end: f64, points: usize) -> Branch<Rotor, 1> {
    let rotor = Rotor { torque: 1.5 };
    Continuation::of(&rotor)
        .parameter(|rotor| &mut rotor.torque)
        .range(1.5..end)
        .element(element)
        .elements(60)
        .unknown_period(TAU / 3.0)
        .advance([TAU])
        .guess(|t| ([3.0 * t], [3.0]))
        .largest_step(1.2)
        .max_points(points)
        .run()
        .unwrap_or_else(ContinuationError::into_partial)
}

/// Elements of order 8 have a fold towards the homoclinic orbit, at 0.59738, where the ends of all elements are right to
/// 1e-6 of the motion; elements of order 6 go on to torques for which nothing rotates.
#[test]
fn a_branch_towards_a_homoclinic_orbit_tells_when_it_is_not_resolved() {
    for element in [Element::mixed(5), Element::mixed(4)] {
        let branch = rotations(element, 0.3, 70);
        let mut folds = branch.events_of(EventKind::Fold);
        assert!(folds.all(|fold| !fold.resolved), "{branch:?}");
        let first = branch.warnings().iter().find_map(|warning| match warning {
            BranchWarning::Unresolved { point, .. } => Some(*point),
            _ => None,
        });
        // At the period 15 the torque changes a thousand times as much as its error does.
        let first = &branch.points()[first.expect("a warning of a point")];
        assert!(first.period > 15.0, "{}", first.period);
    }
}

/// The same elements resolve the same branch as far as its period is five times as long.
#[test]
fn a_branch_that_is_resolved_has_no_warning() {
    for element in [Element::mixed(5), Element::mixed(4)] {
        let branch = rotations(element, 0.6, 70);
        assert!(resolved(&branch).is_empty());
        assert_eq!(branch.end(), Some(End::Range));
        let last = branch.points().last().expect("points");
        assert!(last.period > 10.0, "{}", last.period);
    }
}

/// The folds of a resonance are of the model, whether a step ends just beside them or not.
#[test]
fn folds_are_confirmed_by_finer_elements() {
    let folds = [EventKind::Fold, EventKind::Fold];
    assert_eq!(resolved(&response(0.0, 3.5)), folds);
    assert_eq!(resolved(&response(1e9, 3.5)), folds);
}

/// A hardening oscillator whose force is large in the middle of the branch only.
#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2 - x^4/4,
    force(x) = (0.3 + f/(1 + ((s - 0.8)/0.02)^2))*cos(2*t) - 0.2*dot(x),
    sensitivity(s),
)]
#[derive(Clone)]
struct Peak {
    f: f64,
    s: f64,
}

/// Orbits in the middle of a branch that the elements do not resolve are told, although those at both ends are resolved.
#[test]
fn a_branch_that_is_not_resolved_in_the_middle_is_told() {
    let peak = Peak { f: 100.0, s: 0.0 };
    let branch = Continuation::of(&peak)
        .parameter(|peak| &mut peak.s)
        .range(0.0..1.2)
        .elements(8)
        .period(|_| TAU / 2.0)
        .largest_step(0.03)
        .run()
        .expect("a branch");
    let first = branch.warnings().iter().find_map(|warning| match warning {
        BranchWarning::Unresolved { point, .. } => Some(*point),
        _ => None,
    });
    let first = first.expect("a warning of a point");
    let parameter = branch.points()[first].parameter;
    assert!((parameter - 0.8).abs() < 0.1, "{parameter}");
    assert!(first + 50 < branch.points().len(), "{first}");
}
