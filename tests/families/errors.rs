//! Inconsistent lengths, and what is not supported for models of run-time length: typed errors that name the sum and
//! the index.

use tfe::RunErrorKind;
use tfe::family::{self, FamilyState, Model as _, momenta};
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n], r[w]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) + sum(i in 0..w, dot(r[i])^2/2)
        - sum(i in 0..n-1, k[i]/2*(q[i+1]-q[i])^2) - sum(j in 0..n, (q[j]-r[j])^4),
)]
struct Coupled {
    n: usize,
    w: usize,
    m: Vec<f64>,
    k: Vec<f64>,
}

fn coupled(n: usize, w: usize, m: usize, k: usize) -> Coupled {
    Coupled {
        n,
        w,
        m: vec![1.0; m],
        k: vec![1.0; k],
    }
}

#[track_caller]
fn check(model: &Coupled, expected: family::ModelError, message: &str) {
    assert_eq!(model.check(), Err(expected));
    assert_eq!(expected.to_string(), message);
    let (q, v) = (vec![0.0; model.n + model.w], vec![0.0; model.n + model.w]);
    assert_eq!(momenta(model, 0.0, &q, &v), Err(expected));
    let start = FamilyState { q, p: v };
    let error = Simulation::new(model)
        .run(start, 0.0..1.0)
        .expect_err("a wrong model");
    assert_eq!(error.kind(), &RunErrorKind::Family(expected));
}

#[test]
fn lengths_are_checked_before_anything_else() {
    assert_eq!(coupled(3, 3, 3, 2).check(), Ok(()));
    assert_eq!(coupled(3, 5, 3, 2).check(), Ok(()));
    let error = family::ModelError::NoElements { array: "q[n]" };
    check(
        &coupled(0, 3, 0, 0),
        error,
        "the array `q[n]` has no elements",
    );
    let error = family::ModelError::NoElements { array: "r[w]" };
    check(
        &coupled(3, 0, 3, 2),
        error,
        "the array `r[w]` has no elements",
    );
    // One site has no neighbour.
    assert_eq!(coupled(1, 3, 1, 0).check(), Ok(()));
    let (field, index, ranges) = ("m", "i", "i in 0..n");
    let error = family::ModelError::FieldLength {
        field,
        length: 4,
        expected: 3,
        index,
        ranges,
    };
    check(
        &coupled(3, 3, 4, 2),
        error,
        "`m` has 4 elements, but `m[i]` in the sum over `i in 0..n` needs 3",
    );
    let (field, ranges) = ("k", "i in 0..n-1");
    let error = family::ModelError::FieldLength {
        field,
        length: 1,
        expected: 2,
        index,
        ranges,
    };
    check(
        &coupled(3, 3, 3, 1),
        error,
        "`k` has 1 elements, but `k[i]` in the sum over `i in 0..n-1` needs 2",
    );
    let (array, index, ranges) = ("r", "j", "j in 0..n");
    let error = family::ModelError::Index {
        array,
        index,
        ranges,
        value: 2,
        length: 2,
    };
    check(
        &coupled(3, 2, 3, 2),
        error,
        "the index of `r[j]` in the sum over `j in 0..n` becomes 2, but `r` has 2 elements",
    );
}

/// An array needs an element also where other coordinates stand beside it.
#[test]
fn arrays_beside_single_coordinates_are_not_empty() {
    #[dynamics(
        coordinates(s, q[n]),
        lagrangian = dot(s)^2/2 + sum(i in 0..n, dot(q[i])^2/2 - (q[i] - s)^2/2),
    )]
    struct Cart {
        n: usize,
    }
    let expected = family::ModelError::NoElements { array: "q[n]" };
    let cart = Cart { n: 0 };
    assert_eq!(
        (Cart { n: 1 }.check(), cart.check()),
        (Ok(()), Err(expected))
    );
    let error = Simulation::new(&cart).run(cart.state([0.1], [0.0]), 0.0..1.0);
    let error = error.expect_err("no bodies on the cart");
    assert_eq!(error.kind(), &RunErrorKind::Family(expected));
}

/// Sums without terms are zero; ranges that end below their start are not meant, and those that are empty beyond the end of
/// an array have no place for what their loops leave.
#[test]
fn ranges_without_terms_end_where_they_start() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-2, k[i]*(q[i+2] - 2*q[i+1] + q[i])^4),
    )]
    struct Beam {
        n: usize,
        k: Vec<f64>,
    }
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in a..b, (q[i+1] - q[i])^4),
    )]
    struct Part {
        n: usize,
        a: usize,
        b: usize,
    }
    let beam = |n| Beam { n, k: Vec::new() }.check();
    assert_eq!(beam(2), Ok(()));
    let error = beam(1).expect_err("no sum of -1 terms");
    let ranges = "i in 0..n-2";
    let (start, end) = (0, -1);
    let expected = family::ModelError::EmptyRange { ranges, start, end };
    assert_eq!(error, expected);
    let message = "the sum over `i in 0..n-2` ends below its start: its range is 0..-1";
    assert_eq!(error.to_string(), message);
    let part = |a, b| Part { n: 3, a, b }.check().map_err(|e| e.to_string());
    assert_eq!(
        (part(0, 2), part(0, 0), part(2, 2)),
        (Ok(()), Ok(()), Ok(()))
    );
    let message = "the sum over `i in a..b` is empty: its range is 3..3";
    assert_eq!(part(3, 3), Err(message.to_owned()));
    let message = "the sum over `i in a..b` ends below its start: its range is 2..1";
    assert_eq!(part(2, 1), Err(message.to_owned()));
}

/// Sums of lengths do not overflow either, and nothing is counted up to them.
#[test]
fn lengths_of_no_array_are_errors() {
    let mut message = String::new();
    for length in [1 << 60, 1 << 63, usize::MAX] {
        let expected = family::ModelError::Length { field: "n", length };
        message = expected.to_string();
        assert_eq!(coupled(length, 3, 3, 2).check(), Err(expected));
        let expected = family::ModelError::Length { field: "w", length };
        assert_eq!(coupled(3, length, 3, 2).check(), Err(expected));
    }
    assert_eq!(
        message,
        "`n` is 18446744073709551615, but an array cannot have so many elements"
    );
}

/// An index outside any sum is reported without one.
#[test]
fn a_single_index_is_checked_too() {
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2) - q[2]^4)]
    struct Third {
        n: usize,
    }
    assert_eq!(Third { n: 3 }.check(), Ok(()));
    let error = Third { n: 2 }.check().expect_err("no third");
    let message = "the index of `q[2]` becomes 2, but `q` has 2 elements";
    assert_eq!(error.to_string(), message);
}

/// Where a field chooses the element, a vector may have any length that holds it.
#[test]
fn chosen_elements_are_checked_alone() {
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - c[k]*q[0]^2)]
    struct Chosen {
        n: usize,
        k: usize,
        c: Vec<f64>,
    }
    let chosen = |k, c: usize| {
        let c = vec![1.0; c];
        Chosen { n: 2, k, c }.check()
    };
    assert_eq!(
        (chosen(0, 1), chosen(0, 4), chosen(3, 4)),
        (Ok(()), Ok(()), Ok(()))
    );
    let error = chosen(4, 4).expect_err("no fifth");
    let message = "the index of `c[k]` becomes 4, but `c` has 4 elements";
    assert_eq!(error.to_string(), message);
}

#[test]
fn states_of_another_length_are_refused() {
    let model = coupled(3, 3, 3, 2);
    let error = |vector, length| family::ModelError::StateLength {
        vector,
        length,
        expected: 6,
    };
    assert_eq!(
        momenta(&model, 0.0, &[0.0; 5], &[0.0; 6]),
        Err(error("q", 5))
    );
    assert_eq!(
        momenta(&model, 0.0, &[0.0; 6], &[0.0; 7]),
        Err(error("v", 7))
    );
    let run = Simulation::new(&model).run(model.state([0.0; 6], [0.0; 7]), 0.0..1.0);
    let kind = run.expect_err("a wrong start").kind().clone();
    assert_eq!(kind, RunErrorKind::Family(error("p", 7)));
    let start = FamilyState {
        q: vec![0.0; 6],
        p: vec![0.0; 4],
    };
    let run = Simulation::new(&model).run(start.clone(), 0.0..1.0);
    let kind = run.expect_err("a wrong start").kind().clone();
    assert_eq!(kind, RunErrorKind::Family(error("p", 4)));
    assert_eq!(family::velocity(&model, 0.0, &start), Err(error("p", 4)));
    let mut steps = Simulation::new(&model).step(0.1).steps(start, 0.0);
    assert_eq!(steps.next(), Some(Err(RunErrorKind::Family(error("p", 4)))));
    assert_eq!(steps.next(), None);
}

/// A length that exceeds any memory is compared with the vectors before memory is allocated.
#[test]
fn an_absurd_length_is_an_error() {
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2 - q[i]^4))]
    struct Free {
        n: usize,
    }
    for n in [1 << 60, usize::MAX] {
        let model = Free { n };
        let start = FamilyState {
            q: vec![0.0; 2],
            p: vec![0.0; 2],
        };
        let error = Simulation::new(&model).run(start, 0.0..1.0);
        let error = error.expect_err("a wrong length");
        assert!(matches!(error.kind(), RunErrorKind::Family(_)), "{error}");
        assert!(momenta(&model, 0.0, &[0.0; 2], &[0.0; 2]).is_err());
        let velocity = model.velocity(0.0, &model.state([0.0; 2], [0.0; 2]));
        assert!(velocity.len() == 2 && velocity.iter().all(|v| v.is_nan()));
    }
}

#[test]
fn bad_starts_steps_and_spans_are_refused() {
    let model = coupled(3, 3, 3, 2);
    let start = model.state([0.1; 6], [0.0; 6]);
    let mut infinite = start.clone();
    infinite.q[4] = f64::INFINITY;
    let kind = |start: &FamilyState, step: f64, end: f64| {
        let run = Simulation::new(&model)
            .step(step)
            .run(start.clone(), 0.0..end);
        run.expect_err("a mistake").kind().clone()
    };
    assert!(matches!(
        kind(&infinite, 0.1, 1.0),
        RunErrorKind::Start { coordinate: 4, .. }
    ));
    assert!(matches!(kind(&start, 0.0, 1.0), RunErrorKind::Step { .. }));
    assert!(matches!(
        kind(&start, 0.1, f64::NAN),
        RunErrorKind::Span { .. }
    ));
}

/// A step far too long for fixed-point iteration: the error says so and contains the motion up to there.
#[cfg(not(feature = "sparse"))]
#[test]
fn a_stiff_chain_says_that_the_fixed_point_failed() {
    let model = Coupled {
        k: vec![1e8; 2],
        ..coupled(3, 3, 3, 2)
    };
    let start = model.state([0.1, 0.0, 0.2, 0.0, 0.0, 0.0], [0.0; 6]);
    let error = Simulation::new(&model)
        .step(0.1)
        .run(start.clone(), 0.0..1.0);
    let error = error.expect_err("no contraction");
    let RunErrorKind::Solve {
        element: 0, source, ..
    } = error.kind()
    else {
        panic!("{error}");
    };
    assert!(
        matches!(
            source,
            tfe::StepError::FixedPointStalled { .. } | tfe::StepError::NonFinite
        ),
        "{error}"
    );
    assert_eq!(error.partial().last().state(), start);
}

#[track_caller]
fn kind(run: Result<family::Motion, family::RunError>) -> RunErrorKind {
    run.expect_err("not yet").kind().clone()
}

#[test]
fn what_families_cannot_do_yet_is_said() {
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n-1, dot(q[i])*dot(q[i+1])) - sum(i in 0..n, q[i]^2))]
    struct OffDiagonal {
        n: usize,
    }
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, (1 + q[i]^2)*dot(q[i])^2 - q[i]^2))]
    struct Varying {
        n: usize,
    }
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n-1, dot(q[i])^2) - sum(i in 0..n, q[i]^2))]
    struct Singular {
        n: usize,
    }
    let zero = [0.0; 3];
    assert_eq!(
        momenta(&OffDiagonal { n: 3 }, 0.0, &zero, &zero),
        Ok(zero.to_vec())
    );
    let start = FamilyState {
        q: vec![0.1; 3],
        p: vec![0.0; 3],
    };
    let run = Simulation::new(&OffDiagonal { n: 3 }).run(start.clone(), 0.0..1.0);
    // Three masses in a row, each coupled to its neighbours only: singular, too.
    let expected = if cfg!(feature = "sparse") {
        family::ModelError::NoVelocity
    } else {
        family::ModelError::MassNotDiagonal { row: 0, column: 1 }
    };
    assert_eq!(kind(run), RunErrorKind::Family(expected));
    let run = Simulation::new(&Varying { n: 3 });
    if cfg!(feature = "sparse") {
        let run = run.solver(Solve::FixedPoint).run(start.clone(), 0.0..1.0);
        assert_eq!(
            kind(run),
            RunErrorKind::Family(family::ModelError::NeedsNewton)
        );
    } else {
        let run = run.run(start.clone(), 0.0..1.0);
        assert_eq!(
            kind(run),
            RunErrorKind::Family(family::ModelError::NotSecondOrder)
        );
    }
    let run = Simulation::new(&Singular { n: 3 }).run(start.clone(), 0.0..1.0);
    let expected = family::ModelError::SingularMass { coordinate: 2 };
    assert_eq!(kind(run), RunErrorKind::Family(expected));
    let model = coupled(3, 3, 3, 2);
    let start = model.state([0.1; 6], [0.0; 6]);
    if cfg!(not(feature = "sparse")) {
        let run = Simulation::new(&model).solver(Solve::Newton);
        let kind = kind(run.run(start.clone(), 0.0..1.0));
        assert_eq!(kind, RunErrorKind::Family(family::ModelError::NoNewton));
    }
    if cfg!(not(feature = "sparse")) {
        let run = Simulation::new(&model).element(Primal::<3>);
        assert!(matches!(
            kind(run.run(start.clone(), 0.0..1.0)),
            RunErrorKind::Family(family::ModelError::ElementNotSupported { .. })
        ));
    }
    let run = Simulation::new(&model)
        .element(Element::mixed(13))
        .run(start, 0.0..1.0);
    assert!(matches!(
        kind(run),
        RunErrorKind::Family(family::ModelError::Element(_))
    ));
}

/// The same rod twice: the sparse matrix would be singular.
#[cfg(feature = "sparse")]
#[test]
fn dependent_rows_are_refused() {
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - y[i]),
        constraint(rod[i in 0..n]) = x[i]^2 + y[i]^2 - 1,
        constraint(again) = 2*x[0]^2 + 2*y[0]^2 - 2,
    )]
    struct Rods {
        n: usize,
    }
    let rods = Rods { n: 2 };
    let start = rods.state([0.6, 1.0, -0.8, 0.0], [0.0; 4]);
    let error = Simulation::new(&rods).step(0.1).run(start, 0.0..1.0);
    let error = error.expect_err("one row follows from another");
    let message = error.to_string();
    assert!(
        message.contains("the constraints are dependent"),
        "{message}"
    );
}

/// An initial state that violates constraints whose gradients have no squares is reported; formerly the first element
/// projected it.
#[cfg(feature = "sparse")]
#[test]
fn starts_beside_large_constraints_are_told() {
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - y[i]),
        constraint(rod[i in 0..n]) = s*(x[i]^2 + y[i]^2 - 1)
    )]
    struct Rods {
        n: usize,
        s: f64,
    }
    for s in [1.0, 1e200] {
        let rods = Rods { n: 2, s };
        let start = FamilyState {
            q: vec![1.0, 1.1, 0.0, 0.0],
            p: vec![0.0; 4],
        };
        let run = Simulation::new(&rods).step(0.01).run(start, 0.0..0.1);
        assert!(run.is_err(), "{s}");
    }
}
