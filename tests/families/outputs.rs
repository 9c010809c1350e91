//! Outputs at sites: one column each, and a method that returns all of them.

use tfe::family;
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i]-l[i])^2),
    output(strain[i in 0..n-1]) = (q[i+1]-q[i])/l[i] - 1,
    output(length) = q[n-1] - q[0],
    output(power[site in 1..n-1]) = k*(q[site+1] - 2*q[site] + q[site-1])*dot(q[site]),
)]
struct Chain {
    n: usize,
    k: f64,
    l: Vec<f64>,
}

const Q: [f64; 4] = [0.0, 1.1, 1.9, 3.2];
const V: [f64; 4] = [0.3, -0.2, 0.5, 0.1];

fn chain() -> Chain {
    let (n, k, l) = (4, 1.5, vec![1.0, 0.8, 1.25]);
    Chain { n, k, l }
}

/// Four operations on numbers of order one.
const ROUNDING: f64 = 4e-15;

#[track_caller]
fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (one, other) in found.iter().zip(expected) {
        assert!((one - other).abs() <= ROUNDING, "{found:?} {expected:?}");
    }
}

fn strain(q: &[f64], l: &[f64]) -> Vec<f64> {
    (0..l.len())
        .map(|i| (q[i + 1] - q[i]) / l[i] - 1.0)
        .collect()
}

#[test]
fn the_method_gives_one_number_for_each_site() {
    let chain = chain();
    let found = chain.strain(0.0, &Q, &V).expect("lengths that fit");
    close(&found, &strain(&Q, &chain.l));
    let length = chain.length(0.0, &Q, &V).expect("lengths that fit");
    close(&[length], &[3.2]);
    let expected: Vec<f64> = (1..3)
        .map(|i| 1.5 * (Q[i + 1] - 2.0 * Q[i] + Q[i - 1]) * V[i])
        .collect();
    let found = chain.power(0.0, &Q, &V).expect("lengths that fit");
    close(&found, &expected);
}

#[test]
fn a_motion_has_a_column_for_each_site() {
    let chain = chain();
    let motion = Simulation::new(&chain)
        .step(0.1)
        .run(chain.state(Q, V), 0.0..0.5)
        .expect("a smooth motion");
    let outputs = motion.outputs();
    let names: Vec<String> = outputs.names().iter().map(ToString::to_string).collect();
    let expected = [
        "strain[0]",
        "strain[1]",
        "strain[2]",
        "length",
        "power[1]",
        "power[2]",
    ];
    assert_eq!(names, expected);
    let column = outputs.column("strain[1]").expect("a column");
    assert_eq!(column.len(), motion.states().len());
    for (k, node) in motion.states().iter().enumerate() {
        let row = outputs.row(k).expect("a row for each node");
        close(&row[..3], &strain(&node.q, &chain.l));
        assert_eq!(column[k], row[1]);
    }
    assert_eq!(outputs.column("strain"), None);
    assert_eq!(outputs.column("strain[3]"), None);
    let path = std::env::temp_dir().join(format!("tfe-outputs-{}.csv", std::process::id()));
    motion.write_csv(&path).expect("a writable folder");
    let text = std::fs::read_to_string(&path).expect("what was written");
    std::fs::remove_file(&path).expect("a file of this test");
    let header = text.lines().next().expect("a header");
    let end = ",energy,strain[0],strain[1],strain[2],length,power[1],power[2]";
    assert!(header.ends_with(end), "{header}");
    let columns = |line: &str| line.split(',').count();
    assert!(text.lines().all(|line| columns(line) == columns(header)));
}

#[test]
fn lengths_of_outputs_are_checked() {
    let short = Chain {
        n: 2,
        l: vec![1.0],
        ..chain()
    };
    let (q, v) = (&Q[..2], &V[..2]);
    // Two masses have no inner one between them.
    close(&short.strain(0.0, q, v).expect("one spring"), &[0.1]);
    assert_eq!(short.power(0.0, q, v), Ok(Vec::new()));
    let motion = Simulation::new(&short).step(0.1);
    let motion = motion.run(short.state(q, v), 0.0..0.5).expect("a run");
    let names = motion.outputs().names().iter().map(ToString::to_string);
    assert_eq!(names.collect::<Vec<_>>(), ["strain[0]", "length"]);
    let single = Chain {
        n: 1,
        l: Vec::new(),
        ..chain()
    };
    let error = single.strain(0.0, &Q[..1], &V[..1]).expect_err("-1 sites");
    let expected = family::ModelError::EmptyRange {
        ranges: "output(power[site in 1..n-1])",
        start: 1,
        end: 0,
    };
    assert_eq!(error, expected);
    let message = "`output(power[site in 1..n-1])` ends below its start: its range is 1..0";
    assert_eq!(error.to_string(), message);
    let error = chain().strain(0.0, &Q[..3], &V).expect_err("a short q");
    assert!(matches!(
        error,
        family::ModelError::StateLength { vector: "q", .. }
    ));
    // Lengths that exceed any memory are refused before anything is counted.
    let huge = Chain {
        n: usize::MAX,
        ..chain()
    };
    assert!(huge.strain(0.0, &Q, &V).is_err());
    assert!(huge.length(0.0, &Q, &V).is_err());
}

/// The last w sites, of which there may be fewer; and a sum over their indices, in which they need not exist.
#[test]
fn sites_below_zero_are_told() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2),
        output(late[i in n-w..n]) = i*q[0],
        output(places) = sum(i in n-back..n, i*q[0]),
    )]
    struct Late {
        n: usize,
        w: usize,
        back: usize,
    }
    let late = |n, w, back| Late { n, w, back };
    let (q, v) = ([0.5; 2], [0.0; 2]);
    let found = late(2, 2, 4);
    close(&found.late(0.0, &q, &v).expect("two sites"), &[0.0, 0.5]);
    // (−2 − 1 + 0 + 1) q
    close(&[found.places(0.0, &q, &v).expect("a sum")], &[-1.0]);
    let wrong = late(2, 3, 4);
    let error = wrong.late(0.0, &q, &v).expect_err("no third site");
    let expected = family::ModelError::Index {
        array: "late",
        index: "n-w",
        ranges: "output(late[i in n-w..n])",
        value: -1,
        length: 2,
    };
    assert_eq!(error, expected);
    let run = Simulation::new(&wrong).step(0.1);
    let run = run.run(wrong.state(q, v), 0.0..1.0).expect_err("no third");
    assert_eq!(run.kind(), &tfe::RunErrorKind::Family(expected));
}

/// Outputs named like methods; the kernels must not call these.
#[test]
fn outputs_may_be_called_like_parts_of_the_kernel() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2),
        constraint(values[i in 0..n-1]) = q[i+1] - q[i],
        output(columns[i in 0..n]) = q[i],
        output(constraints) = q[0],
    )]
    struct Named {
        n: usize,
    }
    let named = Named { n: 3 };
    assert_eq!(family::Model::columns(&named), 4);
    let found = Named::columns(&named, 0.0, &Q[..3], &V[..3]);
    assert_eq!(found, Ok(Q[..3].to_vec()));
    let found = Named::constraints(&named, 0.0, &Q[..3], &V[..3]);
    assert_eq!(found, Ok(Q[0]));
}
