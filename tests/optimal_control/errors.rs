//! Invalid problems, and searches that fail.

use super::*;

/// Two masses; no force acts on one of them.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2,
    input(u),
    force(x) = u,
    output(effort) = u^2,
    output(logarithm) = ln(u),
)]
struct Pair;

/// A mass on a wire.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2,
    constraint(wire) = y - x^2,
    input(u),
    force(x) = u,
    output(effort) = u^2,
)]
struct Wire;

#[test]
fn what_makes_no_sense_is_an_error() {
    use OptimalControlErrorKind as Kind;
    let kind = |problem: OptimalControl<'_, Sled, 1>| {
        let error = problem.solve().expect_err("an error");
        assert!(error.partial().is_none(), "{error}");
        assert!(!error.to_string().is_empty());
        error.kind().clone()
    };
    let rest = Sled.state([0.0], [0.0]);
    let bare = || OptimalControl::of(&Sled).from(rest);
    let sled = || {
        bare()
            .to(Sled.state([1.0], [0.0]))
            .span(0.0..1.0)
            .running_cost("effort")
    };
    assert!(matches!(
        kind(bare().running_cost("effort")),
        Kind::Ends(BoundaryError::Span { .. })
    ));
    assert_eq!(kind(sled().span(1.0..0.0)), Kind::Backwards);
    for wrong in [f64::NAN, f64::INFINITY, -1.0, 1.0] {
        let told = kind(sled().tolerance(wrong));
        assert!(matches!(told, Kind::Tolerance { .. }), "{told}");
    }
    assert_eq!(
        kind(sled().elements(0)),
        Kind::Ends(BoundaryError::Mesh(MeshError::NoElements))
    );
    assert!(matches!(
        kind(sled().graded([1.0, -1.0])),
        Kind::Ends(BoundaryError::Mesh(_))
    ));
    assert!(matches!(
        kind(sled().start(Component::Coordinate(0), 1.0)),
        Kind::Ends(BoundaryError::Twice { .. })
    ));
    assert!(matches!(
        kind(sled().start(Component::Momentum(1), 1.0)),
        Kind::Ends(BoundaryError::Component { .. })
    ));
    assert!(matches!(
        kind(
            bare()
                .span(0.0..1.0)
                .running_cost("effort")
                .end(Component::Momentum(0), f64::NAN)
        ),
        Kind::Ends(BoundaryError::Value { .. })
    ));
    assert_eq!(kind(bare().span(0.0..1.0)), Kind::NoCost);
    assert!(
        matches!(kind(sled().running_cost("efort")), Kind::UnknownOutput { name, known } if name == "efort" && known.len() == 3)
    );
    assert_eq!(
        kind(sled().end_cost("effort")),
        Kind::EndCostOfInput {
            output: "effort".to_owned(),
            input: "u"
        }
    );
    assert!(matches!(
        kind(sled().guess_input("w", |_| 0.0)),
        Kind::Input(InputError::Unknown { .. })
    ));
    assert_eq!(
        kind(sled().input_degree(3)),
        Kind::Degree {
            degree: 3,
            largest: 2
        }
    );
    assert_eq!(
        kind(sled().input_degree(usize::MAX)),
        Kind::Degree {
            degree: usize::MAX,
            largest: 2
        }
    );
    assert!(matches!(
        kind(sled().element(Element::mixed(40))),
        Kind::Element(_)
    ));
    assert!(matches!(
        kind(sled().guess(|_| ([f64::NAN], [f64::NAN]))),
        Kind::Legendre(_)
    ));
    // Its derivative by the force vanishes while the cart stands.
    let power = swing_up().end_cost("power").solve();
    assert_eq!(
        power.expect_err("an input at the end").kind(),
        &Kind::EndCostOfInput {
            output: "power".to_owned(),
            input: "u"
        }
    );
    let wire = OptimalControl::of(&Wire)
        .span(0.0..1.0)
        .running_cost("effort")
        .solve();
    assert_eq!(
        wire.expect_err("constraints").kind(),
        &Kind::Constrained { constraint: "wire" }
    );
}

#[test]
fn searches_that_fail_keep_what_they_have() {
    use OptimalControlErrorKind as Kind;
    let error = swing_up()
        .max_iterations(3)
        .solve()
        .expect_err("three are not enough");
    assert!(
        matches!(error.kind(), Kind::Stalled { iterations: 3, .. }),
        "{error}"
    );
    let partial = error.partial().expect("what was done");
    assert!(partial.history().len() == 3 && partial.cost() > 0.0);
    assert_eq!(partial.motion().states().len(), 41);

    // The second mass cannot reach the end.
    let pair = |target: f64, cost: &str| {
        OptimalControl::of(&Pair)
            .elements(4)
            .from_to(
                Pair.state([0.0, 0.0], [0.0, 0.0]),
                Pair.state([1.0, target], [0.0, 0.0]),
                0.0..1.0,
            )
            .running_cost(cost)
            .solve()
    };
    let error = pair(1.0, "effort").expect_err("out of reach");
    assert!(
        matches!(error.kind(), Kind::Singular { iterations: 0 }),
        "{error}"
    );
    let error = pair(0.0, "logarithm").expect_err("ln 0");
    assert!(
        matches!(
            error.kind(),
            Kind::Undefined {
                element: 0,
                iterations: 0,
                ..
            }
        ),
        "{error}"
    );
    assert!(error.partial().is_some());
    let unknown = swing_up()
        .elements(20)
        .solve()
        .expect("a minimum")
        .input("v", 0.0);
    assert!(matches!(unknown, Err(InputError::Unknown { .. })));
}
