//! Derivatives of motions by parameters and starts, against differences of runs.

use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};
use tfe::runtime::{Direction, Model, Parameter};
use tfe::sensitivity::Loss;
use tfe::{RunErrorKind, Sensitive};

/// The derivative of a function at `x`: of eighth order, over a distance at which roundings of 1e-15 of the values leave some 1e-13 of them.
fn difference<const N: usize>(of: impl Fn(f64) -> [f64; N], x: f64) -> [f64; N] {
    let distance = 4e-3 * x.abs().max(0.1);
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = [0.0; N];
    for (k, weight) in (1..).zip(weights) {
        let step = f64::from(k) * distance;
        let (high, low) = (of(x + step), of(x - step));
        for a in 0..N {
            sum[a] += weight * (high[a] - low[a]) / distance;
        }
    }
    sum
}

/// The state at the end of a run as one array, q and p.
fn end<M: Model<N> + Sync, const N: usize, const D: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    end: f64,
) -> [f64; D] {
    let motion = simulation.run(start, 0.0..end).expect("a good run");
    let last = motion.last();
    std::array::from_fn(|a| if a < N { last.q[a] } else { last.p[a - N] })
}

/// Compares all derivatives of a run with differences; `allowed` is relative to the largest derivative by the same thing.
fn check<M: Model<N> + Sync, const N: usize, const D: usize>(
    model: &M,
    start: State<N>,
    length: f64,
    allowed: f64,
    simulation: impl for<'m> Fn(&'m M) -> Simulation<'m, M, N>,
    by_start: bool,
) -> Sensitive<N> {
    assert_eq!(D, 2 * N);
    let s = simulation(model)
        .run_sensitive(start, 0.0..length)
        .expect("derivatives");
    assert_eq!(s.motion().last().t, length);
    assert_eq!(s.parameters().len(), model.parameters());
    let compare = |what: &str, found: [f64; D], expected: [f64; D]| {
        let scale = expected.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        for a in 0..D {
            let error = (found[a] - expected[a]).abs() / scale;
            assert!(
                error < allowed,
                "{what}, entry {a}: {} instead of {}, off by {error:.1e}",
                found[a],
                expected[a]
            );
        }
    };
    for (index, name) in s.parameters().iter().enumerate() {
        let expected = difference(
            |value| {
                let other = model.with_parameter(index, value).expect("numbers alone");
                end::<M, N, D>(&simulation(&other), start, length)
            },
            model.parameter(index),
        );
        let last = s.by(name).last();
        let found = std::array::from_fn(|a| if a < N { last.q[a] } else { last.p[a - N] });
        compare(name, found, expected);
        assert_eq!(s.by(name).states().len(), s.motion().states().len());
        assert_eq!(s.by(name).states()[0].q, [0.0; N], "{name}");
    }
    if by_start {
        let matrix = s.by_start().last();
        for k in 0..D {
            let changed = |x: f64| {
                let mut start = start;
                if k < N {
                    start.q[k] = x;
                } else {
                    start.p[k - N] = x;
                }
                end::<M, N, D>(&simulation(model), start, length)
            };
            let x = if k < N { start.q[k] } else { start.p[k - N] };
            // Matrices are ordered (p, q).
            let (row, column) = (|a| (a + N) % D, (k + N) % D);
            let found = std::array::from_fn(|a| matrix[(row(a), column)]);
            compare(&format!("start {k}"), found, difference(changed, x));
        }
    }
    s
}

/// Two pendulums with friction; the names of `sensitivity` have kernels of their own, the others are differentiated by dual numbers.
#[dynamics(
    coordinates(theta[2]),
    let x1 = l[0]*sin(theta[0]), let y1 = -l[0]*cos(theta[0]),
    let x2 = x1 + l[1]*sin(theta[1]), let y2 = y1 - l[1]*cos(theta[1]),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(m1*y1 + m2*y2),
    force(theta[0]) = -c*dot(theta[0]),
    force(theta[1]) = -c*(dot(theta[1]) - dot(theta[0])),
    sensitivity(g, l[1]),
    output(height) = y2,
    output(speed) = sqrt(dot(x2)^2 + dot(y2)^2),
)]
struct Pendulums {
    l: [f64; 2],
    m1: f64,
    m2: f64,
    g: f64,
    c: f64,
}

const PENDULUMS: Pendulums = Pendulums {
    l: [1.0, 0.8],
    m1: 1.0,
    m2: 0.7,
    g: 9.81,
    c: 0.1,
};

#[test]
fn parameters_are_numbered_as_they_stand() {
    let names = (0..PENDULUMS.parameters()).map(|k| PENDULUMS.parameter_name(k).to_string());
    let names: Vec<_> = names.collect();
    assert_eq!(names, ["l[0]", "l[1]", "m1", "m2", "g", "c"]);
    let values: Vec<_> = (0..7).map(|k| PENDULUMS.parameter(k)).collect();
    assert_eq!(values[..6], [1.0, 0.8, 1.0, 0.7, 9.81, 0.1]);
    assert!(values[6].is_nan() && PENDULUMS.with_parameter(6, 1.0).is_none());
    let other = PENDULUMS.with_parameter(1, 0.5).expect("numbers alone");
    assert_eq!((other.l, other.g), ([1.0, 0.5], 9.81));
    assert_eq!(PENDULUMS.find_parameter("l[1]"), Some(1));
    assert_eq!(PENDULUMS.find_parameter("l[1"), None);
    assert_eq!(PENDULUMS.find_parameter("l[1]2"), None);
}

/// Every kind of element.
#[test]
fn derivatives_are_those_of_the_numbers_of_a_run() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let elements: [Element; 7] = [
        Mixed::<4>.into(),
        Mixed::<2>.into(),
        Primal::<3>.into(),
        Primal::<4>.reduced(),
        Radau::<3>.into(),
        Mixed::<6>.into(),
        Element::primal(4).lobatto(),
    ];
    for element in elements {
        check::<_, 2, 4>(
            &PENDULUMS,
            start,
            1.0,
            1e-11,
            |model| Simulation::new(model).element(element).step(0.05),
            true,
        );
    }
}

/// A Hamiltonian, in phase space and in velocities, whose time appears too.
#[dynamics(
    coordinates(x, y),
    hamiltonian = (px^2 + py^2)/(2*m) + k*(x^2 + y^2)/2 + b*(x^2*y - y^3/3) + a*x*cos(omega*t),
    momenta(px, py),
    force(y) = -c*py,
    output(moment) = x*py - y*px,
)]
struct Driven {
    m: f64,
    k: f64,
    b: f64,
    a: f64,
    omega: f64,
    c: f64,
}

#[test]
fn hamiltonians_have_derivatives() {
    let driven = Driven {
        m: 1.2,
        k: 1.0,
        b: 0.8,
        a: 0.3,
        omega: 1.7,
        c: 0.05,
    };
    let start = State {
        q: [0.2, 0.3],
        p: [0.1, -0.2],
    };
    for element in [Mixed::<4>.into(), Element::primal(3), Radau::<4>.into()] {
        let s = check::<_, 2, 4>(
            &driven,
            start,
            3.0,
            1e-11,
            |model| Simulation::new(model).element(element).step(0.1),
            true,
        );
        // The output is one of the state alone.
        let (last, state) = (s.by("b").last(), s.motion().last());
        let expected = last.q[0] * state.p[1] + state.q[0] * last.p[1]
            - last.q[1] * state.p[0]
            - state.q[1] * last.p[0];
        let found = s.by("b").output("moment").expect("declared");
        assert!((found[30] - expected).abs() < 1e-14);
        // v = p/m
        let expected = last.p[0] / driven.m;
        assert!((last.v[0] - expected).abs() < 1e-14);
        let by_mass = s.by("m").last();
        let expected = by_mass.p[0] / driven.m - state.p[0] / driven.m.powi(2);
        assert!((by_mass.v[0] - expected).abs() < 1e-14);
    }
}

/// Velocities and outputs between the nodes of a run are not asked for; at nodes they are those of the state.
#[test]
fn velocities_and_outputs_move_with_the_state() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    fn simulation(model: &Pendulums) -> Simulation<'_, Pendulums, 2> {
        Simulation::new(model).step(0.05)
    }
    let s = simulation(&PENDULUMS)
        .run_sensitive(start, 0.0..1.0)
        .expect("derivatives");
    for (index, name) in s.parameters().iter().enumerate() {
        let values = |value| {
            let other = PENDULUMS.with_parameter(index, value).expect("numbers");
            let motion = simulation(&other).run(start, 0.0..1.0).expect("a run");
            let speed = motion.outputs().column("speed").expect("declared");
            let height = motion.outputs().column("height").expect("declared");
            [
                motion.last().v[0],
                motion.last().v[1],
                speed[20],
                height[20],
            ]
        };
        let expected = difference(values, PENDULUMS.parameter(index));
        let by = s.by(name);
        let v = by.last().v;
        let [speed, height] = ["speed", "height"].map(|name| by.output(name).expect("declared"));
        for (found, expected) in [v[0], v[1], speed[20], height[20]].iter().zip(expected) {
            let error = (found - expected).abs();
            assert!(error < 1e-11 * expected.abs().max(1.0), "{name}: {error:e}");
        }
    }
    let gradient = s.by_start().output("height").expect("declared");
    assert_eq!(gradient.len(), 21);
    let height = |q: f64| {
        let start = State {
            q: [q, start.q[1]],
            ..start
        };
        let motion = simulation(&PENDULUMS).run(start, 0.0..1.0).expect("a run");
        [motion.outputs().column("height").expect("declared")[20]]
    };
    let [expected] = difference(height, start.q[0]);
    assert!((gradient[20].q[0] - expected).abs() < 1e-11);
    assert!(s.get("nothing").is_none() && s.by("g").output("nothing").is_none());
}

/// A pendulum on a rod, with the angle of its trajectory as a redundant constraint: the length is a parameter of constraints.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    force(x) = -c*dot(x),
    constraint(rod) = x^2 + y^2 - l^2,
    output(height) = y,
)]
struct Rod {
    m: f64,
    g: f64,
    c: f64,
    l: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
    constraint(again) = (x^2 + y^2)/l - l,
)]
struct Twice {
    m: f64,
    g: f64,
    l: f64,
}

/// A blade on a slope: a constraint of velocities whose direction turns.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*slope*x,
    constraint(blade) = sin(phi)*dot(x) - cos(phi)*dot(y),
)]
struct Blade {
    m: f64,
    j: f64,
    g: f64,
    slope: f64,
}

/// Parameters that are not in constraints: a run from another start is as good, so that differences know the derivative.
#[test]
fn constrained_motions_have_derivatives() {
    let rod = Rod {
        m: 1.3,
        g: 9.81,
        c: 0.2,
        l: 1.0,
    };
    let start = rod.state([0.6, -0.8], [0.4, 0.3]);
    let simulation = Simulation::new(&rod).step(0.02);
    let s = simulation
        .run_sensitive(start, 0.0..1.0)
        .expect("derivatives");
    for (index, name) in ["m", "g", "c"].into_iter().enumerate() {
        let expected = difference(
            |value| {
                let other = rod.with_parameter(index, value).expect("numbers");
                end::<_, 2, 4>(&Simulation::new(&other).step(0.02), start, 1.0)
            },
            rod.parameter(index),
        );
        let last = s.by(name).last();
        for (found, expected) in [last.q[0], last.q[1], last.p[0], last.p[1]]
            .iter()
            .zip(expected)
        {
            assert!(
                (found - expected).abs() < 1e-10,
                "{name}: {found} {expected}"
            );
        }
        // Motions stay on the rod: x δx + y δy = 0.
        let node = s.motion().last();
        assert!((node.q[0] * last.q[0] + node.q[1] * last.q[1]).abs() < 1e-13);
    }
    let blade = Blade {
        m: 1.0,
        j: 0.4,
        g: 9.81,
        slope: 0.3,
    };
    let start = blade.state(
        [0.0, 0.0, 0.5],
        [0.2 * 0.5_f64.cos(), 0.2 * 0.5_f64.sin(), 1.5],
    );
    let simulation = Simulation::new(&blade).step(0.02);
    let s = simulation
        .run_sensitive(start, 0.0..1.0)
        .expect("derivatives");
    for (index, name) in ["m", "j", "g", "slope"].into_iter().enumerate().skip(1) {
        let expected = difference(
            |value| {
                let other = blade.with_parameter(index, value).expect("numbers");
                end::<_, 3, 6>(&Simulation::new(&other).step(0.02), start, 1.0)
            },
            blade.parameter(index),
        );
        let last = s.by(name).last();
        for (a, expected) in expected.into_iter().enumerate() {
            let found = if a < 3 { last.q[a] } else { last.p[a - 3] };
            let error = (found - expected).abs();
            assert!(
                error < 1e-10 * expected.abs().max(1.0),
                "{name}: {found} {expected}"
            );
        }
    }
}

/// By the length of the rod, with a start that moves along: q₀ = l (sin, −cos), p₀ = m l ω (cos, sin).
#[test]
fn parameters_of_constraints_count() {
    fn at(l: f64) -> State<2> {
        let (sin, cos) = 0.6_f64.sin_cos();
        State {
            q: [l * sin, -l * cos],
            p: [1.3 * l * 0.7 * cos, 1.3 * l * 0.7 * sin],
        }
    }
    let rod = Rod {
        m: 1.3,
        g: 9.81,
        c: 0.2,
        l: 1.0,
    };
    let twice = Twice {
        m: 1.3,
        g: 9.81,
        l: 1.0,
    };
    let start = at(1.0);
    let both = [
        (
            Simulation::new(&rod)
                .step(0.02)
                .run_sensitive(start, 0.0..1.0),
            difference(
                |l| {
                    let other = Rod { l, ..rod };
                    end::<_, 2, 4>(&Simulation::new(&other).step(0.02), at(l), 1.0)
                },
                1.0,
            ),
        ),
        (
            Simulation::new(&twice)
                .step(0.02)
                .run_sensitive(start, 0.0..1.0),
            difference(
                |l| {
                    let other = Twice { l, ..twice };
                    end::<_, 2, 4>(&Simulation::new(&other).step(0.02), at(l), 1.0)
                },
                1.0,
            ),
        ),
    ];
    for (s, expected) in both {
        let s = s.expect("derivatives");
        // The start is proportional to l.
        let (by, matrix) = (s.by("l").last(), s.by_start().last());
        let moved = [start.p[0], start.p[1], start.q[0], start.q[1]];
        let total = |row: usize| (0..4).map(|k| matrix[(row, k)] * moved[k]).sum::<f64>();
        let found = [
            by.q[0] + total(2),
            by.q[1] + total(3),
            by.p[0] + total(0),
            by.p[1] + total(1),
        ];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-10, "{found} {expected}");
        }
    }
}

/// A ball that bounces: by closed forms, and of the time of the bounce.
#[dynamics(
    coordinates(y),
    lagrangian = m/2*dot(y)^2 - m*g*y,
    event(impact) = y - floor,
    output(velocity) = dot(y),
)]
struct Ball {
    m: f64,
    g: f64,
    floor: f64,
}

fn bouncing(ball: &Ball) -> Simulation<'_, Ball, 1> {
    Simulation::new(ball)
        .step(0.1)
        .on("impact", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-0.8 * event.v[0]]))
        })
}

#[test]
fn derivatives_go_through_bounces() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let s = bouncing(&ball)
        .run_sensitive(ball.state([1.0], [0.0]), 0.0..1.5)
        .expect("derivatives");
    assert_eq!(s.motion().events().len(), 2);
    // From rest at the height H: τ = √(2H/g), the second bounce at 2.6 τ, then y = 0.64 g τ s − g s²/2 with s = t − 2.6 τ.
    let tau = |height: f64, g: f64| (2.0 * height / g).sqrt();
    let y = |height: f64, g: f64| {
        let s = 1.5 - 2.6 * tau(height, g);
        0.64 * g * tau(height, g) * s - g * s * s / 2.0
    };
    let [by_g] = difference(|g| [y(1.0, g)], 9.81);
    let [by_height] = difference(|height| [y(height, 9.81)], 1.0);
    assert!((s.motion().last().q[0] - y(1.0, 9.81)).abs() < 1e-14);
    assert!((s.by("g").last().q[0] - by_g).abs() < 1e-12);
    let found = s.by_start().last().q_by_q()[(0, 0)];
    assert!((found - by_height).abs() < 1e-11, "{found} {by_height}");
    // A floor that is raised is a ball that is lowered.
    let by_floor = s.by("floor").last().q[0];
    assert!((by_floor - (1.0 - by_height)).abs() < 1e-11, "{by_floor}");
    assert!(s.by("m").last().q[0].abs() < 1e-12);
    let times = [0, 1].map(|event| s.by("g").event_time(event).expect("a bounce"));
    assert!((times[0] + tau(1.0, 9.81) / (2.0 * 9.81)).abs() < 1e-14);
    assert!((times[1] + 2.6 * tau(1.0, 9.81) / (2.0 * 9.81)).abs() < 1e-13);
    assert_eq!(s.by("g").event_time(2), None);
    assert_eq!(s.by("g").states().len(), s.motion().states().len());
    // The velocity before the first bounce is −√(2gH), after it 0.8 times the other way.
    let nodes = s.motion().states();
    let at = nodes
        .windows(2)
        .position(|two| two[0].t == two[1].t)
        .expect("a bounce");
    let speeds = s.by("g").output("velocity").expect("declared");
    let rate = 0.5 * (2.0 / 9.81_f64).sqrt();
    assert!((speeds[at] + rate).abs() < 1e-13 && (speeds[at + 1] - 0.8 * rate).abs() < 1e-12);
}

/// The same ball with an input, whose model belongs to the run; and in velocities of a Hamiltonian, whose mass the momentum after the bounce depends on.
#[test]
fn derivatives_go_through_events_of_other_models() {
    #[dynamics(
        coordinates(y),
        lagrangian = m/2*dot(y)^2 - m*g*y,
        input(u),
        force(y) = u,
        event(impact) = y,
    )]
    struct Pushed {
        m: f64,
        g: f64,
    }
    #[dynamics(
        coordinates(y),
        momenta(p),
        hamiltonian = p^2/(2*m) + m*g*y,
        event(impact) = y,
    )]
    struct Canonical {
        m: f64,
        g: f64,
    }
    fn bounce<const N: usize>(event: &tfe::simulation::Occurrence<'_, N>) -> Act<N> {
        // Faster the faster it comes: not linear.
        Act::Restart(event.state_with_velocity(event.v.map(|v| -0.8 * v - 0.02 * v * v)))
    }
    fn pushed(model: &Pushed) -> Simulation<'_, tfe::Driven<'_, Pushed>, 1> {
        Simulation::new(model)
            .step(0.1)
            .on("impact", Crossing::Falling, bounce)
            .input("u", |t| 0.3 * t)
    }
    fn canonical(model: &Canonical) -> Simulation<'_, Canonical, 1> {
        Simulation::new(model)
            .step(0.1)
            .on("impact", Crossing::Falling, bounce)
    }
    let start = State { q: [1.0], p: [0.4] };
    let ends = |motion: &Motion<1>| [motion.last().q[0], motion.last().p[0]];
    let model = Pushed { m: 1.3, g: 9.81 };
    let s = pushed(&model)
        .run_sensitive(start, 0.0..1.1)
        .expect("derivatives");
    assert_eq!(s.motion().events().len(), 1);
    let other = Canonical { m: 1.3, g: 9.81 };
    let h = canonical(&other)
        .run_sensitive(start, 0.0..1.1)
        .expect("derivatives");
    for (name, by) in [("m", 1.3), ("g", 9.81)] {
        let with = |x: f64| if name == "m" { (x, 9.81) } else { (1.3, x) };
        let expected = difference(
            |x| {
                let (m, g) = with(x);
                ends(
                    &pushed(&Pushed { m, g })
                        .run(start, 0.0..1.1)
                        .expect("a run"),
                )
            },
            by,
        );
        let found = s.by(name).last();
        assert!((found.q[0] - expected[0]).abs() < 1e-11, "{name}");
        assert!((found.p[0] - expected[1]).abs() < 1e-10, "{name}");
        let expected = difference(
            |x| {
                let (m, g) = with(x);
                ends(
                    &canonical(&Canonical { m, g })
                        .run(start, 0.0..1.1)
                        .expect("a run"),
                )
            },
            by,
        );
        let found = h.by(name).last();
        assert!((found.q[0] - expected[0]).abs() < 1e-11, "{name}");
        assert!((found.p[0] - expected[1]).abs() < 1e-10, "{name}");
    }
}

/// Two pendulums that hit a wall, several times, with an impulse along the normal of the wall; and the derivative where the run stops at the next one.
#[test]
fn derivatives_go_through_impacts() {
    #[dynamics(
        coordinates(a, b),
        lagrangian = m/2*dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b)/2 + g*(cos(a) + cos(b)/2),
        event(wall) = a - w,
    )]
    struct Hitting {
        m: f64,
        g: f64,
        w: f64,
    }
    fn simulation(model: &Hitting) -> Simulation<'_, Hitting, 2> {
        Simulation::new(model).step(0.05).element(Mixed::<5>).on(
            "wall",
            Crossing::Rising,
            |event| {
                let cos = (event.q[0] - event.q[1]).cos() / 2.0;
                let mass = 1.3 - cos * cos;
                Act::Impulse([-1.7 * mass * event.v[0], 0.0])
            },
        )
    }
    let model = Hitting {
        m: 1.3,
        g: 9.81,
        w: 0.1,
    };
    let start = model.state([-0.8, 0.2], [0.0, 0.3]);
    let s = check::<_, 2, 4>(&model, start, 2.5, 1e-10, simulation, true);
    assert_eq!(s.motion().events().len(), 2);
}

/// The gradient of a loss, backwards, is what derivatives, forwards, make of it.
#[track_caller]
fn check_gradient<M: Model<N> + Sync, const N: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    output: &str,
) {
    let times = [0.0, 0.31, 0.5, 1.0];
    let values = [0.2, -0.1, 0.4, 0.3];
    let loss = Loss::at_end(|node: &Node<N>| {
        node.q[0].sin() + 0.5 * node.p[N - 1].powi(2) + node.q[N - 1] * node.v[0]
    })
    .and(Loss::squares(output, times, values))
    .and(Loss::output_at_end(output));
    let (value, gradient) = simulation
        .gradient(start, 0.0..1.0, &loss)
        .expect("a gradient");
    let run = times
        .iter()
        .fold(simulation.clone(), |run, t| run.break_at(*t));
    let s = run.run_sensitive(start, 0.0..1.0).expect("derivatives");
    let last = s.motion().last();
    let nodes = s.motion().states();
    let at = times.map(|t| nodes.iter().position(|node| node.t == t).expect("a node"));
    let outputs = s.motion().outputs().column(output).expect("declared");
    let squares = at
        .iter()
        .zip(values)
        .map(|(at, m)| 0.5 * (outputs[*at] - m).powi(2));
    let (q, p, v) = (last.q, last.p, last.v);
    let direct = q[0].sin() + 0.5 * p[N - 1].powi(2) + q[N - 1] * v[0] + outputs[at[3]];
    assert!((value - squares.sum::<f64>() - direct).abs() < 1e-13 * value.abs().max(1.0));
    let size = gradient
        .by_parameters()
        .iter()
        .fold(1.0_f64, |m, x| m.max(x.abs()));
    for name in s.parameters() {
        let by = s.by(name).last();
        let slopes = s.by(name).output(output).expect("declared");
        let squares = at
            .iter()
            .zip(values)
            .map(|(at, m)| (outputs[*at] - m) * slopes[*at]);
        let expected = squares.sum::<f64>()
            + q[0].cos() * by.q[0]
            + p[N - 1] * by.p[N - 1]
            + by.q[N - 1] * v[0]
            + q[N - 1] * by.v[0]
            + slopes[at[3]];
        let found = gradient.by(name);
        assert!(
            (found - expected).abs() < 1e-12 * size,
            "{name}: {found} {expected}"
        );
    }
    let by_start = s.by_start().output(output).expect("declared");
    let matrix = s.by_start().last();
    for a in 0..N {
        // The velocity at the end follows from differences of runs only: a loss without it.
        let loss = Loss::squares(output, times, values).and(Loss::at_end(|node: &Node<N>| {
            node.q[0].sin() + 0.5 * node.p[N - 1].powi(2)
        }));
        let (_, gradient) = simulation
            .gradient(start, 0.0..1.0, &loss)
            .expect("a gradient");
        let squares = at.iter().zip(values);
        let squares: f64 = squares
            .map(|(at, m)| (outputs[*at] - m) * by_start[*at].q[a])
            .sum();
        let expected =
            squares + q[0].cos() * matrix.q_by_q()[(0, a)] + p[N - 1] * matrix.p_by_q()[(N - 1, a)];
        let found = gradient.by_start().q[a];
        assert!(
            (found - expected).abs() < 1e-12 * size.max(expected.abs()),
            "{a}: {found} {expected}"
        );
    }
}

#[test]
fn gradients_backwards_are_derivatives_forwards() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let elements: [Element; 5] = [
        Mixed::<4>.into(),
        Primal::<3>.into(),
        Primal::<4>.reduced(),
        Radau::<3>.into(),
        Element::primal(4).lobatto(),
    ];
    for element in elements {
        let simulation = Simulation::new(&PENDULUMS).element(element).step(0.05);
        check_gradient(&simulation, start, "height");
        check_gradient(&simulation.impulse(0.42, [0.1, -0.2]), start, "speed");
    }
    // Steps that are cut into pieces.
    let simulation = Simulation::new(&PENDULUMS).step(0.9).element(Mixed::<3>);
    check_gradient(&simulation, start, "speed");
    let driven = Driven {
        m: 1.2,
        k: 1.0,
        b: 0.8,
        a: 0.3,
        omega: 1.7,
        c: 0.05,
    };
    let start = State {
        q: [0.2, 0.3],
        p: [0.1, -0.2],
    };
    for element in [Mixed::<4>.into(), Element::primal(3)] {
        let simulation = Simulation::new(&driven).element(element).step(0.1);
        check_gradient(&simulation, start, "moment");
    }
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let start = ball.state([0.6], [0.0]);
    check_gradient(&bouncing(&ball), start, "velocity");
    let rod = Rod {
        m: 1.3,
        g: 9.81,
        c: 0.2,
        l: 1.0,
    };
    let start = rod.state([0.6, -0.8], [0.4, 0.3]);
    check_gradient(&Simulation::new(&rod).step(0.02), start, "height");
}

/// Masses in a row, with a friction between neighbours that depends on where they are, and springs that are all different.
#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m[i]/2*dot(q[i])^2 + b*q[i]*dot(q[i])^2/2) - sum(i in 0..4, k[i]/2*(q[i+1]-q[i])^2 + a[i]/4*(q[i+1]-q[i])^4) - k[4]/2*q[0]^2,
    dissipation = sum(i in 0..4, c[i]/2*(dot(q[i+1]) - dot(q[i]))^2),
    force(q[4]) = f*sin(omega*t),
    output(middle) = q[2]*k[1],
)]
struct Row {
    m: [f64; 5],
    k: [f64; 5],
    a: [f64; 4],
    c: [f64; 4],
    b: f64,
    f: f64,
    omega: f64,
}

const ROW: Row = Row {
    m: [1.0, 1.1, 0.9, 1.3, 0.8],
    k: [2.0, 1.5, 1.7, 2.2, 0.5],
    a: [0.3, 0.2, 0.4, 0.1],
    c: [0.05, 0.1, 0.02, 0.07],
    b: 0.1,
    f: 0.4,
    omega: 1.9,
};

/// Many parameters at once, by operations read backwards; with an iteration and, where steps are too long for it, with factors; of elements with fewer points than go side by side, and more.
#[test]
fn gradients_by_many_parameters_are_derivatives_forwards() {
    let start = ROW.state([0.3, -0.2, 0.1, 0.4, -0.5], [0.1, 0.0, -0.3, 0.2, 0.4]);
    for (element, step) in [
        (Element::from(Mixed::<4>), 0.1),
        (Mixed::<3>.into(), 0.5),
        (Mixed::<7>.into(), 0.2),
        (Mixed::<10>.into(), 0.2),
        (Primal::<3>.into(), 0.1),
        (EnergyConserving::<3>.into(), 0.1),
    ] {
        let simulation = Simulation::new(&ROW).element(element).step(step);
        check_gradient(&simulation, start, "middle");
    }
}

/// Some of many parameters, in any order, have what they have among all.
#[test]
fn some_parameters_backwards_are_those_among_all() {
    let mut state = ROW.state([0.3, -0.2, 0.1, 0.4, -0.5], [0.1, 0.0, -0.3, 0.2, 0.4]);
    let mut stepper =
        Stepper::new(&ROW, Mixed::<5>.into(), Control::default()).expect("an element");
    stepper.advance(0.0, 0.2, &mut state, &[]).expect("a step");
    let lambda: [f64; 10] = std::array::from_fn(|row| 1.0 / (row + 1) as f64);
    let mut by = |indices: &[usize]| {
        let direction = |index: &usize| Direction {
            parameter: Some(Parameter::Any(*index)),
            ..Direction::default()
        };
        let directions: Vec<_> = indices.iter().map(direction).collect();
        let (mut rest, mut sums) = (lambda, vec![0.0; indices.len()]);
        let product = stepper.adjoint(&directions, &mut rest, &mut sums);
        product.expect("a derivative");
        (rest, sums)
    };
    let all: Vec<usize> = (0..ROW.parameters()).collect();
    let (by_start, by_all) = by(&all);
    assert!(by_all.iter().filter(|sum| **sum != 0.0).count() > 18);
    let some = [17, 3, 20, 0, 9];
    let (again, by_some) = by(&some);
    assert_eq!(again, by_start);
    assert_eq!(by_some, some.map(|index| by_all[index]));
}

#[test]
fn losses_that_are_none_are_told() {
    let simulation = Simulation::new(&PENDULUMS).step(0.05);
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let error = |loss: Loss<'_, 2>| {
        let error = simulation
            .gradient(start, 0.0..1.0, &loss)
            .expect_err("no gradient");
        error.kind().clone()
    };
    let unknown = error(Loss::output_at_end("hight"));
    assert!(unknown.to_string().contains("height"), "{unknown}");
    for (times, values) in [
        (vec![0.5], vec![]),
        (vec![1.5], vec![1.0]),
        (vec![f64::NAN], vec![1.0]),
        (vec![0.5], vec![f64::NAN]),
    ] {
        let kind = error(Loss::squares("height", times, values));
        assert!(matches!(kind, RunErrorKind::Loss { .. }), "{kind}");
    }
    let gradient = simulation.gradient(start, 0.0..1.0, &Loss::output_at_end("height"));
    let (_, gradient) = gradient.expect("a gradient");
    assert_eq!(
        (gradient.get("nothing"), gradient.parameters().len()),
        (None, 6)
    );
}
