//! Derivatives by parameters and by the time: elements of arrays in loops, and what their programs look like. Their values are compared with
//! dual numbers in `back_derivatives`, and with difference quotients in the oracle test of `tfe`.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{By, Program};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// A model with numbers k and c, and arrays m and w of N and any number of elements.
fn derivation(text: &str) -> Derivation {
    let kinds = [
        ("k", FieldKind::Scalar),
        ("c", FieldKind::Scalar),
        (
            "m",
            FieldKind::Array(Length::ConstParameter("N".to_owned())),
        ),
        ("w", FieldKind::Vector),
    ];
    let formulas = text.split("sensitivity").next().unwrap_or_default();
    let words: Vec<&str> = formulas.split(|c: char| !c.is_alphanumeric()).collect();
    let used = kinds.into_iter().filter(|(name, _)| words.contains(name));
    let context = Context {
        struct_name: "Model".to_owned(),
        fields: used
            .map(|(name, kind)| Field {
                name: name.to_owned(),
                kind,
            })
            .collect(),
        const_parameters: vec!["N".to_owned()],
    };
    let declared =
        declare(text, &context).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"));
    Derivation::of(&declared)
}

fn environment(m: &[f64]) -> Environment {
    let n = m.len();
    Environment {
        time: 0.4,
        q: (0..n).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        z: (0..n).map(|i| (0.9 * i as f64 - 0.2).cos()).collect(),
        parameters: [("k", 0.7), ("c", 0.25)]
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
        arrays: [("m", m.to_vec()), ("w", vec![2.0; 9])]
            .map(|(name, values)| (name.to_owned(), values))
            .into(),
        sizes: [("N".to_owned(), n as i64)].into(),
        ..Environment::default()
    }
}

fn results(program: &Program, environment: &Environment) -> Results {
    interpret(program, environment).unwrap_or_else(|error| panic!("{error}\n{program}"))
}

#[test]
fn an_element_counts_where_the_loop_meets_it() {
    let program = derivation(
        "coordinates(q[N]), lagrangian = sum(i in 0..N, m[i]/2*dot(q[i])^2), sensitivity(m[2])",
    )
    .program_by(By::Parameter(0));
    assert_eq!(
        program.to_string(),
        "for i in 0..N\n  \
           t0 = (i-2) * (i-2)\n  \
           t1 = select(t0 <= 0, v[i], 0)\n  \
           E_z[i] = t1\n"
    );
    let environment = environment(&[1.0, 1.1, 1.2, 1.3]);
    assert_eq!(
        results(&program, &environment).z,
        [0.0, 0.0, environment.z[2], 0.0]
    );
}

#[test]
fn an_array_that_is_shorter_has_no_such_element() {
    let derivation = derivation(
        "coordinates(q[N]), lagrangian = sum(i in 0..N, m[i]/2*dot(q[i])^2), sensitivity(m[2])",
    );
    let found = results(
        &derivation.program_by(By::Parameter(0)),
        &environment(&[1.0, 1.1]),
    );
    assert_eq!(found.z, [0.0, 0.0]);
}

#[test]
fn a_pole_at_another_element_does_no_harm() {
    // ∂√m/∂m is infinite at m[1] = 0; by m[0] only q[0] v[0] / (2 √m[0]) counts.
    let derivation = derivation(
        "coordinates(q[N]), lagrangian = sum(i in 0..N, dot(q[i])^2/2 - sqrt(m[i])*q[i]^2/2), sensitivity(m[0])",
    );
    let environment = environment(&[4.0, 0.0, 9.0]);
    let found = results(&derivation.program_by(By::Parameter(0)), &environment);
    assert_eq!(found.q, [-environment.q[0] / 4.0, 0.0, 0.0]);
}

#[test]
fn an_element_inside_a_function_of_sums() {
    // Q = √S, S = Σ m[i]² q[i]²; ∂Q/∂m[1] = m[1] q[1]² / √S
    let derivation = derivation(
        "coordinates(q[N]), lagrangian = sum(i in 0..N, dot(q[i])^2/2), \
         force(q[0]) = sqrt(sum(i in 0..N, m[i]^2*q[i]^2)), sensitivity(m[1])",
    );
    let m = [1.3, 0.7, 1.1, 0.6, 0.9];
    let environment = environment(&m);
    let found = results(&derivation.program_by(By::Parameter(0)), &environment);
    let square = |i: usize| (m[i] * environment.q[i]).powi(2);
    let root = (0..m.len()).map(square).sum::<f64>().sqrt();
    let expected = m[1] * environment.q[1].powi(2) / root;
    // A dozen operations on positive numbers.
    assert!((found.force[0] - expected).abs() <= 12.0 * f64::EPSILON * expected);
    assert_eq!(found.force[1..], [0.0; 4]);
}

#[test]
fn a_number_in_a_loop_leaves_no_choice() {
    let program = derivation(
        "coordinates(q[N]), lagrangian = sum(i in 0..N, dot(q[i])^2/2 - k*cos(c*q[i])), sensitivity(k, c)",
    )
    .program_by(By::Parameter(1))
    .to_string();
    assert!(program.contains("for i in 0..N"), "{program}");
    assert!(!program.contains("select"), "{program}");
}

#[test]
fn nothing_depends_on_it() {
    let derivation = derivation(
        "coordinates(x), lagrangian = dot(x)^2/2 - k*x^2, output(scaled) = c*x, sensitivity(c, k)",
    );
    for by in [
        By::Time,
        By::Parameter(0),
        By::Parameter(2),
        By::Parameter(usize::MAX),
    ] {
        assert_eq!(derivation.program_by(by), Program::default(), "{by:?}");
    }
    assert_ne!(derivation.program_by(By::Parameter(1)), Program::default());
}

#[test]
fn the_time_is_taken_at_fixed_coordinates_and_velocities() {
    // x + k sin t swings: v = dx/dt + k cos t, so ∂L_v/∂t = −k sin t while dx/dt is held.
    let derivation =
        derivation("coordinates(x), let y = x + k*sin(t), lagrangian = dot(y)^2/2, sensitivity(k)");
    let environment = environment(&[1.0]);
    let found = results(&derivation.program_by(By::Time), &environment);
    // Two operations, and a sine that may differ by its last digit.
    let expected = -0.7 * 0.4_f64.sin();
    assert!((found.z[0] - expected).abs() <= 3.0 * f64::EPSILON * expected.abs());
}
