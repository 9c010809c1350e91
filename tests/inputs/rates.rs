//! Time derivatives of inputs: they affect the motion if the time of an event changes.

use crate::{DRIVING, Driving, Kicked};
use std::f64::consts::PI;
use tfe::Driven;
use tfe::prelude::*;
use tfe::runtime::{By, First, Model};

const TIMES: [f64; 3] = [0.0, 1.0, 2.0];

/// Close to a time of a table, the rate is that of the piece itself: zero for held values, and not the difference
/// across the jump.
#[test]
fn rates_of_tables_are_those_of_their_pieces() {
    for (way, rates) in [
        (Interpolation::Hold, [0.0, 0.0]),
        (Interpolation::Linear, [-3.0, 2.5]),
    ] {
        let values = [1.0, -2.0, 0.5];
        let driven = Driven::new(&DRIVING)
            .table("u", &TIMES, &values, way)
            .and_then(|driven| driven.table("w", &TIMES, &values, way))
            .expect("inputs");
        let (q, v) = ([0.4_f64], [0.7]);
        for (t, rate) in [
            (1.0 - 1e-7, rates[0]),
            (1.0, rates[1]),
            (1.0 + 1e-7, rates[1]),
        ] {
            let mut by_time = First::ZERO;
            driven.first_by(By::Time, t, &q, &v, &mut by_time);
            // θ̇ and w are in m/2 |ẋ|², and the moved pivot in m w l θ̇ cos θ.
            let Driving { m, l, .. } = DRIVING;
            let expected = [
                m * l * q[0].cos() * rate,
                -m * l * v[0] * q[0].sin() * rate,
                rate,
            ];
            let found = [by_time.z[0], by_time.q[0], by_time.force[0]];
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{way:?} at {t}: {by_time:?} for {expected}"
                );
            }
        }
    }
}

/// The same for functions of time, whether they change within a second or a microsecond, and at 1e9 s.
#[test]
fn rates_of_functions_are_those_of_their_own_scale() {
    for (rate, t) in [(1.0, 0.3), (1.0, 1e9 + 0.5), (2e6 * PI, 3.2e-7)] {
        let driven = Driven::new(&DRIVING)
            .input("u", move |t| (rate * t).sin())
            .and_then(|driven| driven.input("w", move |t| 0.5 * (rate * t).cos()))
            .expect("inputs");
        let (q, v) = ([0.4_f64], [0.7]);
        let mut by_time = First::ZERO;
        driven.first_by(By::Time, t, &q, &v, &mut by_time);
        let (sin, cos) = (rate * t).sin_cos();
        // As above, with the rates of w and of u.
        let Driving { m, l, .. } = DRIVING;
        let expected = [
            -m * l * q[0].cos() * 0.5 * rate * sin,
            m * l * v[0] * q[0].sin() * 0.5 * rate * sin,
            rate * cos,
        ];
        let found = [by_time.z[0], by_time.q[0], by_time.force[0]];
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 2e-9 * rate,
                "{rate} at {t}: {by_time:?} for {expected}"
            );
        }
    }
}

/// θ″ = u from rest, with an impulse at a value of θ that is reached 10⁻⁷ before u jumps or has a kink, so that the
/// jump is closer than the spacing of a difference. With the speed v at that time t, in closed form: δt = −(δθ + t
/// δp)/v, δθ(T) = δθ + T δp − δt, and δp does not change.
#[test]
fn matrices_across_events_near_the_times_of_a_table() {
    let free = Driving {
        m: 1.0,
        l: 1.0,
        g: 0.0,
        c: 0.0,
    };
    let time: f64 = 1.0 - 1e-7;
    for (way, values, speed, level) in [
        (
            Interpolation::Hold,
            [1.0, -1.0, 0.0],
            time,
            time.powi(2) / 2.0,
        ),
        (
            Interpolation::Linear,
            [0.0, 1.0, -1.0],
            time.powi(2) / 2.0,
            time.powi(3) / 6.0,
        ),
    ] {
        for element in [Element::mixed(4), Element::radau(3)] {
            let end = 1.75;
            let run = Simulation::new(&free)
                .element(element)
                .step(0.25)
                .on_function(
                    "level",
                    Crossing::Rising,
                    move |_, q, _| q[0] - level,
                    |_| Act::Impulse([1.0]),
                )
                .table("u", TIMES, values, way)
                .run_linearised(free.state([0.0], [0.0]), 0.0..end)
                .expect("a run");
            let events = run.motion().events();
            assert_eq!(events.len(), 1);
            assert!((events[0].t - time).abs() < 1e-12, "{events:?}");
            // Ordered (p, q).
            let expected = [1.0, 0.0, end + time / speed, 1.0 + 1.0 / speed];
            let product = run.product();
            for (place, expected) in expected.iter().enumerate() {
                let found = product[(place / 2, place % 2)];
                assert!(
                    (found - expected).abs() < 1e-8,
                    "{way:?}, {element:?}: {product}"
                );
            }
        }
    }
}

/// The same for a model whose time derivatives are dual numbers, compared with differences of runs.
#[test]
fn matrices_beside_runs_where_a_table_jumps_soon_after_an_event() {
    /// The distance in time between the event and the jump; the event moves by less than this.
    const DISTANCE: f64 = 8e-7;

    let start = State {
        q: [0.1, -0.05],
        p: [0.2, 0.3],
    };
    let run = |jump: f64| {
        Simulation::new(&Kicked)
            .element(Mixed::<8>)
            .step(0.1)
            .on_function(
                "line",
                Crossing::Rising,
                |_, q, _| q[0] - 0.15,
                |_| Act::Impulse([0.1, -0.2]),
            )
            .table("e", [0.0, jump], [0.3, -0.4], Interpolation::Hold)
            .table("f", [0.0, jump], [-0.5, 0.7], Interpolation::Hold)
    };
    let early = run(1.0).run(start, 0.0..0.9).expect("a run");
    let [event] = early.events() else {
        panic!("{:?}", early.events());
    };
    // Closer than the spacing of a difference in time.
    let run = run(event.t + 5e-6);
    let product = run
        .run_linearised(start, 0.0..0.9)
        .expect("a run")
        .product();
    for column in 0..4_usize {
        let end = |change: f64| {
            let mut moved = start;
            match column.checked_sub(2) {
                None => moved.p[column] += change,
                Some(a) => moved.q[a] += change,
            }
            let motion = run.run(moved, 0.0..0.9).expect("a run");
            assert_eq!(motion.events().len(), 1);
            let last = *motion.last();
            [last.p[0], last.p[1], last.q[0], last.q[1]]
        };
        let (high, low) = (end(DISTANCE), end(-DISTANCE));
        for row in 0..4 {
            let expected = (high[row] - low[row]) / (2.0 * DISTANCE);
            let found = product[(row, column)];
            // The rounding errors of runs, divided by the spacing of the differences.
            assert!(
                (found - expected).abs() < 1e-6,
                "({row}, {column}): {found} for {expected}"
            );
        }
    }
}
