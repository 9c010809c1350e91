//! Constraints by site of models of run-time length, against hyper-dual numbers on the equations written by hand.

use num_dual::{DualNum, HyperDual64};
use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, Requirement};
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

/// Rods between neighbours, two equations beside them, and a rail: x[i-1] and x[0] are one coordinate at its first site.
const TEXT: &str = "coordinates(x[n], y[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2 + dot(y[i])^2/2), \
    constraint(rod[i in 0..n-1]) = (x[i+1]-x[i])^2 + (y[i+1]-y[i])^2 - l[i]^2, \
    constraint(pin) = [x[0] - sin(t), y[n-1]*x[0]^2], \
    constraint(rail[i in 1..n]) = y[i]*cos(k*x[i]) - k*t*x[i-1]*x[0]";

fn equations(n: usize, t: HyperDual64, q: &[HyperDual64]) -> Vec<HyperDual64> {
    let (x, y) = q.split_at(n);
    let rod = (0..n - 1).map(|i| {
        let length = HyperDual64::from(LENGTHS[i]);
        (x[i + 1] - x[i]).powi(2) + (y[i + 1] - y[i]).powi(2) - length * length
    });
    let pin = [x[0] - t.sin(), y[n - 1] * x[0] * x[0]];
    let k = HyperDual64::from(K);
    let rail = (1..n).map(|i| y[i] * (k * x[i]).cos() - k * t * x[i - 1] * x[0]);
    rod.chain(pin).chain(rail).collect()
}

const LENGTHS: [f64; 5] = [1.0, 0.8, 1.3, 0.6, 0.9];
const K: f64 = 0.7;

fn context() -> Context {
    let fields = [
        ("n", FieldKind::Length),
        ("k", FieldKind::Scalar),
        ("l", FieldKind::Vector),
    ];
    let fields = fields.map(|(name, kind)| Field {
        name: name.to_owned(),
        kind,
    });
    Context {
        struct_name: "Model".to_owned(),
        fields: fields.into(),
        const_parameters: Vec::new(),
    }
}

fn declared(text: &str) -> Declared {
    declare(text, &context()).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
}

fn environment(n: usize) -> Environment {
    let rows = 2 * (n - 1) + 2;
    Environment {
        time: 0.4,
        q: (0..2 * n).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        mu: (0..rows).map(|r| (0.9 * r as f64 - 0.2).cos()).collect(),
        parameters: [("k".to_owned(), K)].into(),
        arrays: [("l".to_owned(), LENGTHS[..n - 1].to_vec())].into(),
        sizes: [("n".to_owned(), n as i64)].into(),
        ..Environment::default()
    }
}

/// Some ten operations on numbers of size one.
#[track_caller]
fn close(one: f64, other: f64) {
    assert!(
        (one - other).abs() < 1e-14 * other.abs().max(1.0),
        "{one} {other}"
    );
}

#[test]
fn kernels_are_the_derivatives_of_the_equations() {
    let derivation = Derivation::of(&declared(TEXT));
    let kernel = |request: Request, n: usize| {
        let program = derivation.program(request);
        interpret(&program, &environment(n)).unwrap_or_else(|e| panic!("{e}\n{program}"))
    };
    let none = Request::default();
    for n in [2, 3, 6] {
        let environment = environment(n);
        let number = |value: f64| HyperDual64::from(value);
        let q: Vec<HyperDual64> = environment.q.iter().copied().map(number).collect();
        let t = number(environment.time);
        let along = |a: Option<usize>, b: Option<usize>| {
            let (mut t, mut q) = (t, q.clone());
            // No coordinate stands for the time.
            match a {
                Some(a) => q[a].eps1 = 1.0,
                None => t.eps1 = 1.0,
            }
            if let Some(b) = b {
                q[b].eps2 = 1.0;
            }
            equations(n, t, &q)
        };
        let values = kernel(
            Request {
                constraint_values: true,
                ..none
            },
            n,
        );
        let rows = kernel(
            Request {
                constraint_rows: true,
                ..none
            },
            n,
        );
        let second = kernel(
            Request {
                constraint_second: true,
                ..none
            },
            n,
        );
        let expected = along(None, None);
        assert_eq!(expected.len(), environment.mu.len());
        for (r, expected) in expected.iter().enumerate() {
            close(values.phi[r], expected.re);
            close(rows.drift[r], expected.eps1);
        }
        for a in 0..2 * n {
            for (r, expected) in along(Some(a), None).iter().enumerate() {
                close(rows.rows[r][a], expected.eps1);
            }
            for b in 0..2 * n {
                let expected = along(Some(a), Some(b));
                let weighted = expected.iter().zip(&environment.mu);
                let weighted: f64 = weighted.map(|(phi, mu)| mu * phi.eps1eps2).sum();
                close(second.bend[a][b], weighted);
            }
        }
    }
}

/// The program of the second derivatives has one loop a range, whatever n is.
#[test]
fn each_range_is_one_template() {
    let declared = declared(TEXT);
    let names: Vec<&str> = declared.constraints.iter().map(|c| &*c.name).collect();
    assert_eq!(names, ["rod", "pin[0]", "pin[1]", "rail"]);
    let rows: Vec<String> = declared
        .constraints
        .iter()
        .map(|c| c.row.to_string())
        .collect();
    assert_eq!(rows, ["i", "n-1", "n", "i+n"]);
    let request = Request {
        constraint_second: true,
        ..Request::default()
    };
    let program = Derivation::of(&declared).program(request).to_string();
    assert_eq!(program.matches("for i in ").count(), 2, "{program}");
    assert!(!Derivation::of(&declared).structure().linear);
    assert!(Derivation::of(&declared).structure().time_dependent);
}

/// Requirements say in which constraint an index stands.
#[test]
fn requirements_name_the_constraint() {
    let text = "coordinates(x[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2), \
        constraint(rod[i in 0..n-1]) = x[i+1] - x[i] - l[i], constraint(far) = x[3] - k";
    let told = |requirement: &Requirement| match requirement {
        Requirement::Index {
            array,
            text,
            ranges,
            ..
        } => format!("{array}[{text}] in {ranges}"),
        Requirement::FieldLength { field, ranges, .. } => format!("{field} in {ranges}"),
        Requirement::Turns { ranges, .. } => format!("turns of {ranges}"),
    };
    let mut all: Vec<String> = declared(text).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "l in constraint(rod[i in 0..n-1])",
            "turns of constraint(rod[i in 0..n-1])",
            "turns of i in 0..n",
            "x[3] in constraint(far)",
        ]
    );
}

/// The last five of three sites would begin at -2.
#[test]
fn sites_begin_at_zero_or_above() {
    let text = "coordinates(x[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2) - k*sum(i in 0..n-1, l[i]*x[i]^2), output(late[i in n-5..n]) = t*i";
    let requirements = declared(text).requirements;
    let found = requirements
        .iter()
        .find_map(|requirement| match requirement {
            Requirement::Index {
                array,
                text,
                ranges,
                nest,
                ..
            } => Some((array.as_str(), text.as_str(), ranges.as_str(), nest.len())),
            _ => None,
        });
    assert_eq!(found, Some(("late", "n-5", "output(late[i in n-5..n])", 0)));
}

/// Outputs by site and single ones, in order of declaration; the sum is one number for each site.
#[test]
fn outputs_by_site_are_numbered() {
    let text = "coordinates(x[n], y[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2 + dot(y[i])^2/2), \
        output(strain[i in 0..n-1]) = (x[i+1] - x[i])/l[i] - 1, output(last) = y[n-1], \
        output(pull[i in 1..n]) = sum(j in 0..i, k*(x[i] - x[j])*dot(y[j])), output(time) = t";
    let derivation = Derivation::of(&declared(text));
    let program = derivation.program(Request {
        observables: true,
        ..Request::default()
    });
    for n in [2, 3, 6] {
        let mut environment = environment(n);
        environment.z = environment.q.iter().map(|q| q * q - 0.3).collect();
        let results =
            interpret(&program, &environment).unwrap_or_else(|e| panic!("{e}\n{program}"));
        let (x, y) = environment.q.split_at(n);
        let y_dot = &environment.z[n..];
        let strain = (0..n - 1).map(|i| (x[i + 1] - x[i]) / LENGTHS[i] - 1.0);
        let pull = (1..n).map(|i| (0..i).map(|j| K * (x[i] - x[j]) * y_dot[j]).sum());
        let expected: Vec<f64> = strain
            .chain([y[n - 1]])
            .chain(pull)
            .chain([environment.time])
            .collect();
        assert_eq!(results.observables.len(), expected.len());
        for (one, other) in results.observables.iter().zip(&expected) {
            close(*one, *other);
        }
    }
}
