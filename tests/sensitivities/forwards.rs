//! Forward derivatives along a run: by parameters and initial states, of outputs, with constraints.

use super::*;

/// The product of three masses overflows or underflows, although the masses themselves do not.
#[test]
fn velocities_of_masses_of_any_size_have_their_derivatives() {
    #[dynamics(
        coordinates(x, y, z),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(z)^2) - m*k/2*(x^2 + 2*y^2 + 3*z^2),
        output(climb) = dot(z),
    )]
    struct Springs {
        m: f64,
        k: f64,
    }
    let found = |m: f64| {
        let model = Springs { m, k: 1.3 };
        let start = model.state([1.0, 0.7, -0.4], [0.0, 0.0, 0.0]);
        let s = Simulation::new(&model).step(0.1);
        let s = s.run_sensitive(start, 0.0..1.0).expect("derivatives");
        let climb = s.by("k").output("climb").expect("declared");
        let [x, y, z] = s.by("k").last().v;
        let by_momentum = s.by_start().output("climb").expect("declared")[10].p[2] * m;
        [x, y, z, climb[10], by_momentum]
    };
    let expected = found(1.0);
    for m in [1e-120, 1e120] {
        for (found, expected) in found(m).into_iter().zip(expected) {
            let error = (found - expected).abs() / expected.abs();
            assert!(error < 1e-11, "{m:e}: {found} instead of {expected}");
        }
    }
}

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

/// All kinds of elements.
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

#[test]
fn hamiltonians_have_derivatives() {
    let start = PHASE;
    for element in [Mixed::<4>.into(), Element::primal(3), Radau::<4>.into()] {
        let s = check::<_, 2, 4>(
            &DRIVEN,
            start,
            3.0,
            1e-11,
            |model| Simulation::new(model).element(element).step(0.1),
            true,
        );
        // The output depends on the state only.
        let (last, state) = (s.by("b").last(), s.motion().last());
        let expected = last.q[0] * state.p[1] + state.q[0] * last.p[1]
            - last.q[1] * state.p[0]
            - state.q[1] * last.p[0];
        let found = s.by("b").output("moment").expect("declared");
        assert!((found[30] - expected).abs() < 1e-14);
        // v = p/m
        let expected = last.p[0] / DRIVEN.m;
        assert!((last.v[0] - expected).abs() < 1e-14);
        let by_mass = s.by("m").last();
        let expected = by_mass.p[0] / DRIVEN.m - state.p[0] / DRIVEN.m.powi(2);
        assert!((by_mass.v[0] - expected).abs() < 1e-14);
    }
}

/// The derivatives of velocities and outputs at nodes are functions of the state there.
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

/// Parameters that do not occur in constraints: the initial state stays admissible, so that differences give the
/// derivative.
#[test]
fn constrained_motions_have_derivatives() {
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    let simulation = Simulation::new(&ROD).step(0.02);
    let s = simulation
        .run_sensitive(start, 0.0..1.0)
        .expect("derivatives");
    for (index, name) in ["m", "g", "c"].into_iter().enumerate() {
        let expected = difference(
            |value| {
                let other = ROD.with_parameter(index, value).expect("numbers");
                end::<_, 2, 4>(&Simulation::new(&other).step(0.02), start, 1.0)
            },
            ROD.parameter(index),
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
        // The derivatives are tangent to the constraint: x δx + y δy = 0.
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

/// The derivative by the length of the rod, with an initial state that depends on it: q₀ = l (sin, −cos), p₀ = m l ω
/// (cos, sin).
#[test]
fn parameters_of_constraints_count() {
    fn at(l: f64) -> State<2> {
        let (sin, cos) = 0.6_f64.sin_cos();
        State {
            q: [l * sin, -l * cos],
            p: [1.3 * l * 0.7 * cos, 1.3 * l * 0.7 * sin],
        }
    }
    let twice = Twice {
        m: 1.3,
        g: 9.81,
        l: 1.0,
    };
    let start = at(1.0);
    let both = [
        (
            Simulation::new(&ROD)
                .step(0.02)
                .run_sensitive(start, 0.0..1.0),
            difference(
                |l| {
                    let other = Rod { l, ..ROD };
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
        // The initial state is proportional to l.
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
