//! Models with a time transformation against the extended models written by hand.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::Declared;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{Program, Request};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

fn declared(text: &str) -> Declared {
    let context = Context {
        struct_name: "Model".to_owned(),
        fields: vec![Field {
            name: "k".to_owned(),
            kind: FieldKind::Scalar,
        }],
        const_parameters: Vec::new(),
    };
    declare(text, &context).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
}

fn environment(dof: usize) -> Environment {
    Environment {
        // Nothing may depend on it.
        time: f64::NAN,
        q: (0..dof).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        z: (0..dof).map(|i| (0.9 * i as f64 - 0.2).cos()).collect(),
        parameters: [("k".to_owned(), 0.7)].into(),
        ..Environment::default()
    }
}

fn run(program: &Program, dof: usize) -> Results {
    interpret(program, &environment(dof)).unwrap_or_else(|error| panic!("{error}\n{program}"))
}

/// Some hundred terms of size one at most, in another order: 1e-12 leaves a factor of ten.
#[track_caller]
fn check(dof: usize, transformed: &str, by_hand: &str) {
    let numbers = |r: Results| {
        let blocks = [r.zz, r.zq, r.qq, r.force_z, r.force_q].map(|block| block.concat());
        let vectors = [vec![r.value], r.z, r.q, r.force, r.observables];
        [vectors.concat(), blocks.concat()].concat()
    };
    let results = |text| run(&Derivation::of(&declared(text)).program(ALL), dof);
    let found = numbers(results(transformed));
    let expected = numbers(results(by_hand));
    assert_eq!(found.len(), expected.len());
    for (at, (x, y)) in found.iter().zip(&expected).enumerate() {
        let size = 1f64.max(y.abs());
        assert!((x - y).abs() < 1e-12 * size, "{at}: {x} {y}");
    }
}

#[test]
fn forces_dissipation_and_outputs() {
    check(
        3,
        "coordinates(x, y), momenta(px, py), let r = sqrt(1 + x^2 + y^2),
         hamiltonian = (px^2 + 2*py^2 + x*px*py)/2 - 1/r + k*x*cos(t), time_transformation = r*(2 + sin(t))/(1 + px^2),
         force(y) = -k*py*t, dissipation = k/2*dot(x)^2, output(speed) = dot(x) + t",
        "coordinates(x, y, s), momenta(px, py, ps), let r = sqrt(1 + x^2 + y^2),
         let h = (px^2 + 2*py^2 + x*px*py)/2 - 1/r + k*x*cos(s), let g = r*(2 + sin(s))/(1 + px^2),
         let vx = px + x*py/2, let vy = 2*py + x*px/2,
         hamiltonian = g*(h + ps),
         force(x) = -g*k*vx, force(y) = -g*k*py*s, force(s) = g*(k*vx*vx + k*py*s*vy), output(speed) = vx + s",
    );
}

#[test]
fn sums_that_stay_loops() {
    check(
        21,
        "coordinates(q[20]), momenta(p[20]),
         hamiltonian = sum(i in 0..20, p[i]^2/2) + sum(i in 0..19, k*(q[i+1] - q[i])^4),
         time_transformation = 1/(1 + q[0]^2 + t^2), force(q[i]) = -t*p[i]",
        "coordinates(q[20], s), momenta(p[20], ps), let g = 1/(1 + q[0]^2 + s^2),
         hamiltonian = g*(sum(i in 0..20, p[i]^2/2) + sum(i in 0..19, k*(q[i+1] - q[i])^4) + ps),
         force(q[i]) = -g*s*p[i], force(s) = g*s*sum(i in 0..20, p[i]^2)",
    );
}

#[test]
fn a_rate_of_a_long_sum() {
    check(
        21,
        "coordinates(q[20]), momenta(p[20]), hamiltonian = sum(i in 0..20, p[i]^2/2 + k*q[i]^4),
         time_transformation = 1/sqrt(1 + sum(i in 0..20, q[i]^2))",
        "coordinates(q[20], s), momenta(p[20], ps),
         hamiltonian = 1/sqrt(1 + sum(i in 0..20, q[i]^2))*(sum(i in 0..20, p[i]^2/2 + k*q[i]^4) + ps)",
    );
}

#[test]
fn the_hamiltonian_as_declared() {
    let text = "coordinates(q[20]), momenta(p[20]), hamiltonian = sum(i in 0..20, p[i]^2/2) + k*t*sum(i in 0..19, q[i]*q[i+1]),
        time_transformation = 1 + q[0]^2";
    let program = Derivation::hamiltonian(&declared(text)).expect("a time transformation");
    let Environment { q, z: p, .. } = environment(21);
    let kinetic: f64 = p[..20].iter().map(|p| p * p / 2.0).sum();
    let potential: f64 = q[..20].windows(2).map(|pair| pair[0] * pair[1]).sum();
    let expected = kinetic + 0.7 * q[20] * potential;
    assert!((run(&program, 21).value - expected).abs() < 1e-13);
    let plain = "coordinates(q), momenta(p), hamiltonian = p^2 + k*q^2";
    assert!(Derivation::hamiltonian(&declared(plain)).is_none());
}
