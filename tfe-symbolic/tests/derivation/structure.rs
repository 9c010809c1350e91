//! What is found out about models, and how programs are written.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::derive::structure::Pattern;
use tfe_symbolic::program::Request;
use tfe_symbolic::syntax::context::Context;

#[track_caller]
fn derivation(text: &str) -> Derivation {
    Derivation::of(&declare(text, &Context::default()).expect("a model of the test"))
}

/// The program of the first derivatives.
#[track_caller]
fn first(text: &str) -> String {
    derivation(text)
        .program(Request {
            first: true,
            ..Request::default()
        })
        .to_string()
}

#[test]
fn a_linear_oscillator() {
    let derivation = derivation(
        "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - (x - y)^2, force(x) = -0.1*dot(x) + t",
    );
    let structure = derivation.structure();
    assert!(structure.linear && structure.constant_mass && structure.separable);
    assert!(structure.forced && structure.time_dependent && !structure.symmetric_forces);
    assert_eq!(structure.zz, Pattern::Entries(vec![(0, 0), (1, 1)]));
    assert_eq!(
        structure.qq,
        Pattern::Entries(vec![(0, 0), (0, 1), (1, 0), (1, 1)])
    );
    assert_eq!(structure.force_z, Pattern::Entries(vec![(0, 0)]));
}

#[test]
fn a_spherical_pendulum() {
    let derivation = derivation(
        "coordinates(theta, phi), lagrangian = (dot(theta)^2 + sin(theta)^2*dot(phi)^2)/2 + cos(theta)",
    );
    let structure = derivation.structure();
    assert_eq!(structure.cyclic, [1]);
    assert!(
        structure.quadratic_in_z
            && !structure.constant_mass
            && !structure.linear
            && !structure.separable
    );
    assert!(!structure.forced && !structure.time_dependent);
    let page = structure.to_string();
    assert!(page.contains("cyclic coordinates      q[1]"), "{page}");
    assert!(
        page.contains("pattern L_vv            (0,0) (1,1)"),
        "{page}"
    );
}

#[test]
fn coordinates_that_cancel_are_cyclic() {
    // ẋ² + ẏ² = ṙ² + r² α̇²: α is in x and y and in no derivative.
    let text = "coordinates(r, alpha), let x = r*cos(alpha), let y = r*sin(alpha), \
        lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/r";
    let derivation = derivation(text);
    assert_eq!(derivation.structure().cyclic, [1]);
    assert!(!first(text).contains("E_q[1]"), "{}", first(text));
}

/// Cyclic ones on which no force acts, and on which none depends, not even by a sign.
#[test]
fn ignorable_coordinates_are_in_no_equation() {
    let ignorable = |rest: &str| {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^4{rest}");
        derivation(&text).structure().ignorable.clone()
    };
    assert_eq!(ignorable(""), [1]);
    assert_eq!(ignorable(", force(x) = -dot(x)"), [1]);
    assert_eq!(ignorable(", force(x) = -dot(x)*dot(y)"), [1]);
    assert_eq!(ignorable(", force(y) = -1"), []);
    assert_eq!(ignorable(", input(u), force(y) = u"), []);
    assert_eq!(ignorable(", input(u), force(x) = u"), [1]);
    assert_eq!(ignorable(", force(x) = -y*dot(x)"), []);
    assert_eq!(ignorable(", force(x) = -select(y > 1, dot(x), 0)"), []);
    assert_eq!(ignorable(" + x*sign(y)"), []);
    assert_eq!(ignorable(", constraint(rod) = y - x"), []);
    assert_eq!(ignorable(", constraint(still) = dot(x)"), []);
}

#[test]
fn a_hamiltonian_that_is_not_quadratic() {
    let derivation = derivation("coordinates(x), momenta(p), hamiltonian = sqrt(1 + p^2) + x^4");
    let structure = derivation.structure();
    assert!(structure.separable && !structure.quadratic_in_z && !structure.linear);
    assert!(structure.to_string().contains("constant H_pp           no"));
}

#[test]
fn dissipation_is_a_force() {
    let derivation = derivation(
        "coordinates(x), lagrangian = dot(x)^2/2 - x^2, dissipation = 0.1*dot(x)^2 + 0.2*dot(x)^2*x^2",
    );
    let program = derivation
        .program(Request {
            first: true,
            second: true,
            ..Request::default()
        })
        .to_string();
    assert!(derivation.structure().forced);
    assert!(
        program.contains("Q[0] = ")
            && program.contains("Q_z[0, 0] = ")
            && program.contains("Q_q[0, 0] = ")
    );
}

#[test]
fn sine_and_cosine_come_together() {
    let text = first("coordinates(a), lagrangian = dot(a)^2/2 + sin(a)*cos(a)*a");
    assert_eq!(
        (
            text.matches("sin_cos(").count(),
            text.matches(" sin(").count()
        ),
        (1, 0),
        "{text}"
    );
}

#[test]
fn repeated_division_takes_one_reciprocal() {
    let text = first("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2)");
    assert_eq!(text.matches(" / ").count(), 1, "{text}");
    assert_eq!(text.matches("sqrt").count(), 1, "{text}");
}

#[test]
fn divisors_that_stand_together_share_a_reciprocal() {
    let text = first(
        "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + x*y/((1 + x^2)*(2 + y^2))",
    );
    assert_eq!(text.matches(" / ").count(), 2, "{text}");
    let kepler = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2)";
    let all = Request {
        value: true,
        first: true,
        second: true,
        ..Request::default()
    };
    let counts = derivation(kepler).counts(all);
    assert_eq!(counts.divisions, 1, "{counts}");
}

#[test]
fn powers_share_their_squares() {
    // x^8 and 8 x^7: x², x⁴ … are shared.
    let derivation = derivation("coordinates(x), lagrangian = dot(x)^2/2 + x^8");
    let counts = derivation.counts(Request {
        value: true,
        first: true,
        ..Request::default()
    });
    assert!(counts.multiplications <= 2 + 6, "{counts}");
    assert_eq!(counts.functions, 0);
}

#[test]
fn a_third_is_a_division_by_three() {
    let text = derivation("coordinates(x), lagrangian = dot(x)^2/2 + x^3/3 + 0.7*x")
        .program(Request {
            value: true,
            ..Request::default()
        })
        .to_string();
    assert!(text.contains("/ 3") && text.contains("0.7 *"), "{text}");
}

#[test]
fn programs_do_not_change_from_run_to_run() {
    let text = "coordinates(a, b), lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a-b)*exp(a*b)/(1 + a^2) + cos(a)";
    let all = Request {
        value: true,
        first: true,
        mass: true,
        second: true,
        observables: true,
        constraint_values: false,
        constraint_rows: false,
        constraint_second: false,
    };
    let programs: Vec<String> = (0..5)
        .map(|_| derivation(text).program(all).to_string())
        .collect();
    assert!(programs.windows(2).all(|pair| pair[0] == pair[1]));
}

/// Second derivatives of what a sign decides are zero, and say nothing.
#[test]
fn choices_are_not_linear() {
    let energy = "lagrangian = dot(x)^2/2 - x^2/2";
    for (text, expected) in [
        (
            format!("{energy}, force(x) = -3*sign(dot(x))"),
            [false, true, true, true],
        ),
        (
            format!("{energy}, force(x) = select(x > 0, 1, -1)"),
            [false, true, true, true],
        ),
        (
            format!("{energy}, dissipation = abs(dot(x))"),
            [false, true, true, true],
        ),
        (
            format!("{energy}, force(x) = select(t < 1, 1, 0)"),
            [true; 4],
        ),
        (format!("{energy}, output(side) = sign(x)"), [true; 4]),
        (format!("{energy} - abs(x)"), [false, true, true, true]),
        (format!("{energy} - max(x, 0)"), [false, true, true, true]),
        (
            format!("{energy} - abs(dot(x))"),
            [false, false, false, true],
        ),
        (
            format!("{energy} - select(x > 0, dot(x), 2*dot(x))"),
            [false, true, true, false],
        ),
    ] {
        let derivation = derivation(&format!("coordinates(x), {text}"));
        let found = derivation.structure();
        let found = [
            found.linear,
            found.quadratic_in_z,
            found.constant_mass,
            found.separable,
        ];
        // Linear, quadratic in z, with a constant mass, separable.
        assert_eq!(found, expected, "{text}");
    }
}

/// A power of a number has no kink, and nothing to choose.
#[test]
fn powers_of_numbers_are_smooth() {
    for parts in [" - 2^-x", " - 0.5^(x*t)", ", force(x) = -dot(x)*3^-x"] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2{parts}");
        let derivation = derivation(&text);
        assert!(derivation.structure().smooth, "{text}");
        let program = derivation
            .program(Request {
                first: true,
                second: true,
                ..Request::default()
            })
            .to_string();
        assert!(!program.contains("select"), "{text}\n{program}");
    }
    let contact = derivation("coordinates(x), lagrangian = dot(x)^2/2 - max(-x, 0)^2");
    assert!(!contact.structure().smooth);
}
