//! Models made from models, against closed forms and against the derivatives of the originals.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, Variant};
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const PARAMETERS: [(&str, f64); 6] = [
    ("m", 1.3),
    ("l", 0.8),
    ("g", 9.81),
    ("k", 40.0),
    ("c", 0.2),
    ("omega", 1.7),
];

/// A struct with some of [`PARAMETERS`].
fn context(fields: &str) -> Context {
    let field = |name: &str| match name {
        "n" => Field {
            name: name.to_owned(),
            kind: FieldKind::Length,
        },
        "w" => Field {
            name: name.to_owned(),
            kind: FieldKind::Vector,
        },
        _ => Field {
            name: name.to_owned(),
            kind: FieldKind::Scalar,
        },
    };
    Context {
        struct_name: "Model".to_owned(),
        fields: fields.split_whitespace().map(field).collect(),
        const_parameters: Vec::new(),
    }
}

/// A declaration with the fields of [`PARAMETERS`] that it uses.
fn declared(text: &str, fields: &str) -> Declared {
    declare(text, &context(fields)).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
}

fn variant(text: &str, fields: &str) -> Variant {
    let mut variants = declared(text, fields).variants;
    variants.pop().expect("a variant was asked for")
}

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

fn run(model: &Declared, q: &[f64], z: &[f64]) -> Results {
    let with_constraints = Request {
        constraint_values: true,
        constraint_rows: true,
        constraint_second: true,
        ..ALL
    };
    let request = if model.constraints.is_empty() {
        ALL
    } else {
        with_constraints
    };
    let program = Derivation::of(model).program(request);
    let environment = Environment {
        time: 0.4,
        q: q.to_vec(),
        z: z.to_vec(),
        parameters: PARAMETERS
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
        sizes: [("n".to_owned(), q.len() as i64)].into(),
        arrays: [("w".to_owned(), vec![0.3; q.len()])].into(),
        mu: vec![0.7; model.constraints.len()],
        ..Environment::default()
    };
    interpret(&program, &environment).unwrap_or_else(|error| panic!("{error}\n{program}"))
}

/// All numbers of two models; each is a sum of some ten terms.
#[track_caller]
fn same(one: &Declared, other: &Declared, q: &[f64], z: &[f64]) {
    let numbers = |model| {
        let r = run(model, q, z);
        let blocks = [
            r.zz,
            r.zq,
            r.qq,
            r.force_z,
            r.force_q,
            r.rows,
            r.psi_q,
            r.row_rates,
            r.bend,
            r.rate_q,
            r.rate_v,
        ];
        let blocks = blocks.map(|block| block.concat()).concat();
        let vectors = [
            vec![r.value],
            r.z,
            r.q,
            r.force,
            r.observables,
            r.phi,
            r.drift,
        ];
        [vectors.concat(), blocks].concat()
    };
    let (one, other) = (numbers(one), numbers(other));
    assert_eq!(one.len(), other.len());
    for (at, (x, y)) in one.iter().zip(&other).enumerate() {
        assert!((x - y).abs() <= 1e-13 * y.abs().max(1.0), "{at}: {x} {y}");
    }
}

/// Numbers between −1 and 1 that look random.
fn points(count: usize) -> impl Iterator<Item = f64> {
    (1..=count).map(|i| (12.9898 * (i * i) as f64).sin())
}

const PENDULUM: &str = "coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta)";

#[test]
fn the_pendulum_to_fourth_degree() {
    let cubic = variant(&format!("{PENDULUM}, model(Cubic, truncated(4))"), "m l g");
    let (m, l, g) = (1.3, 0.8, 9.81);
    for (theta, omega) in points(20).zip(points(40).skip(20)) {
        let value = run(&cubic.model, &[theta], &[omega]).value;
        let potential = m * g * l * (1.0 - theta.powi(2) / 2.0 + theta.powi(4) / 24.0);
        let expected = m * (l * omega).powi(2) / 2.0 + potential;
        assert!((value - expected).abs() <= 1e-14 * expected.abs().max(1.0));
    }
    assert_eq!(cubic.made, "truncated to degree 4");
    assert_eq!(cubic.model.used_fields, ["m", "l", "g"]);
}

#[test]
fn degree_two_is_linear() {
    let linear = variant(&format!("{PENDULUM}, model(Linear, truncated(2))"), "m l g").model;
    let structure = Derivation::of(&linear).structure().clone();
    assert!(structure.linear && structure.constant_mass && structure.separable);
    let full = declared(PENDULUM, "m l g");
    assert!(!Derivation::of(&full).structure().linear);
}

const DOUBLE: &str = "coordinates(a, b), let x1 = l*sin(a), let y1 = -l*cos(a), let x2 = x1 + sin(b), let y2 = y1 - cos(b),
    lagrangian = m/2*(dot(x1)^2 + dot(y1)^2) + (dot(x2)^2 + dot(y2)^2)/2 - g*(m*y1 + y2)";

#[test]
fn degree_two_is_half_the_hessian() {
    let (q0, v0) = ([0.3, -0.4], [0.2, 0.5]);
    let text = format!(
        "{DOUBLE}, model(Near, truncated(2, a = 0.3, b = -0.4, dot(a) = 1/5, dot(b) = 0.5))"
    );
    let near = variant(&text, "m l g").model;
    let full = run(&declared(DOUBLE, "m l g"), &q0, &v0);
    let mut points = points(40);
    for _ in 0..10 {
        let [dq, dv] = [0, 1].map(|_| [0, 1].map(|_| points.next().expect("enough")));
        let at = |x: [f64; 2], d: [f64; 2]| [x[0] + d[0], x[1] + d[1]];
        let value = run(&near, &at(q0, dq), &at(v0, dv)).value;
        let mut expected = full.value;
        for i in 0..2 {
            expected += full.q[i] * dq[i] + full.z[i] * dv[i];
            for j in 0..2 {
                expected +=
                    full.qq[i][j] * dq[i] * dq[j] / 2.0 + full.zz[i][j] * dv[i] * dv[j] / 2.0;
                expected += full.zq[i][j] * dv[i] * dq[j];
            }
        }
        assert!((value - expected).abs() < 1e-12, "{value} {expected}");
    }
}

#[test]
fn the_remainder_falls_with_the_next_power() {
    // L is even in all angles and velocities together, so that the first term left out is of degree six.
    let fourth = variant(&format!("{DOUBLE}, model(Near, truncated(4))"), "m l g").model;
    let full = declared(DOUBLE, "m l g");
    let error = |size: f64| {
        let (q, v) = ([0.7 * size, -0.5 * size], [0.9 * size, 0.6 * size]);
        (run(&fourth, &q, &v).value - run(&full, &q, &v).value).abs()
    };
    for size in [0.4, 0.2, 0.1] {
        let order = (error(size) / error(size / 2.0)).log2();
        assert!((5.9..6.1).contains(&order), "{order}");
    }
}

#[test]
fn forces_dissipation_and_outputs() {
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k*cos(x + y),
        force(x) = sin(x)*dot(y) + exp(y), dissipation = c/2*(1 + x^2)*dot(x)^2, output(tip) = sin(x)*y,
        model(Near, truncated(3))";
    let by_hand = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k*(1 - (x + y)^2/2),
        force(x) = x*dot(y) + 1 + y + y^2/2, dissipation = c/2*dot(x)^2, output(tip) = sin(x)*y";
    let near = variant(text, "k c").model;
    for (x, y) in points(5).zip(points(20).skip(5)) {
        same(&near, &declared(by_hand, "k c"), &[x, y], &[0.3, -0.8]);
    }
}

#[test]
fn a_hamiltonian_about_a_point() {
    let text = "coordinates(x), momenta(p), hamiltonian = exp(x)*p^2/2 - cos(x), model(Near, truncated(3, x = omega, p = c))";
    let near = variant(text, "omega c").model;
    let (x0, p0) = (1.7_f64, 0.2);
    let (x, p) = (1.9, -0.4);
    let (d, e) = (x - x0, p - p0);
    let exponential = |degree: u32| {
        let terms =
            (0..=degree).map(|j| d.powi(j as i32) / (1..=j).map(f64::from).product::<f64>());
        x0.exp() * terms.sum::<f64>()
    };
    let kinetic =
        exponential(3) * p0 * p0 / 2.0 + exponential(2) * p0 * e + exponential(1) * e * e / 2.0;
    let cosine = x0.cos() - x0.sin() * d - x0.cos() * d * d / 2.0 + x0.sin() * d.powi(3) / 6.0;
    let value = run(&near, &[x], &[p]).value;
    assert!((value - (kinetic - cosine)).abs() < 1e-14 * value.abs().max(1.0));
}

#[test]
fn no_polynomial_where_two_sides_meet() {
    let truncation = |parts: &str, given: &str| {
        let text = format!(
            "coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2 - c*x^4 {parts}, model(Near, truncated(2{given}))"
        );
        declare(&text, &context("k c"))
    };
    for parts in [
        "- abs(x)",
        "- max(x, 0)^2",
        "- select(x > 0, x, 2*x)",
        "- max(x, c)^2 + max(c, x)",
        ", force(x) = -c*sign(dot(x))",
        ", force(x) = c*max(x, 0) + c*max(-x, 0)",
        ", dissipation = c*abs(dot(x))",
        ", force(x) = -c*norm([dot(x), 2*dot(x)])",
        "- norm([c*x, x])",
    ] {
        let about = if parts.contains("x, c") {
            ", x = c"
        } else {
            ""
        };
        assert!(truncation(parts, about).is_err(), "{parts}");
        truncation(parts, ", x = 0.3, dot(x) = 0.2").expect("away from it");
    }
    // Both sides have the polynomial that is asked for.
    for parts in [
        "- abs(x)^3",
        "- max(-x, 0)^3",
        "- select(x > 0, x^3, x^4)",
        ", force(x) = -c*dot(x)*abs(dot(x))",
    ] {
        let near = variant(
            &format!(
                "coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2 - c*x^4 {parts}, model(Near, truncated(2))"
            ),
            "k c",
        );
        let linear = declared("coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2", "k");
        same(&near.model, &linear, &[0.7], &[-0.8]);
    }
}

#[test]
fn sums_of_any_length_stay_sums() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - w[i]*cosh(q[i])) - sum(i in 0..n-1, k*cos(q[i+1] - q[i])), model(Near, truncated(2))";
    let by_hand = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - w[i]*(1 + q[i]^2/2)) - sum(i in 0..n-1, k*(1 - (q[i+1] - q[i])^2/2))";
    let near = variant(text, "n w k").model;
    assert!(near.is_of_run_time_length() && Derivation::of(&near).structure().linear);
    let (q, z): (Vec<f64>, Vec<f64>) = (points(7).collect(), points(14).skip(7).collect());
    same(&near, &declared(by_hand, "n w k"), &q, &z);
    let about = text.replace("truncated(2)", "truncated(2, q = c)");
    let by_hand = by_hand.replace(
        "(1 + q[i]^2/2)",
        "(cosh(c) + sinh(c)*(q[i] - c) + cosh(c)*(q[i] - c)^2/2)",
    );
    same(
        &variant(&about, "n w k c").model,
        &declared(&by_hand, "n w k c"),
        &q,
        &z,
    );
}

#[test]
fn fields_that_a_truncation_leaves_out() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - k*q[i]^2/2 - w[i]*q[i]^4), model(Near, truncated(2))";
    let near = variant(text, "n w k").model;
    assert_eq!(near.used_fields, ["n", "k"]);
    // That w has n elements is not asked for any more.
    let original = declared(text, "n w k");
    assert_eq!(near.requirements.len() + 1, original.requirements.len());
}

const SPRING: &str = "coordinates(r, theta), lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
    force(r) = -c*dot(r), force(theta) = -c*r^2*dot(theta), output(height) = -r*cos(theta)";

#[test]
fn a_frozen_coordinate() {
    let text = format!("{SPRING}, model(Rod, frozen(r = l))");
    let rod = variant(&text, "m l g k c").model;
    assert_eq!(rod.used_fields, ["m", "l", "g", "c"]);
    let by_hand = "coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta), force(theta) = -c*l^2*dot(theta), output(height) = -l*cos(theta)";
    same(&rod, &declared(by_hand, "m l g c"), &[0.8], &[-0.6]);
}

#[test]
fn a_coordinate_that_is_moved() {
    let text = format!("{SPRING}, model(Parametric, frozen(r = l + c*cos(omega*t)))");
    let moved = variant(&text, "m l g k c omega").model;
    let by_hand = "coordinates(theta), let r = l + c*cos(omega*t), lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
        force(theta) = -c*r^2*dot(theta), output(height) = -r*cos(theta)";
    same(
        &moved,
        &declared(by_hand, "m l g k c omega"),
        &[0.8],
        &[-0.6],
    );
    assert!(Derivation::of(&moved).structure().time_dependent);
}

#[test]
fn elements_of_arrays_and_constraints() {
    let text = "coordinates(s, q[3], u), lagrangian = (dot(s)^2 + dot(u)^2)/2 + sum(i in 0..3, m/2*dot(q[i])^2 - k/2*(q[i] - s)^2) - g*u*q[2],
        force(q[i]) = -c*dot(q[i])*u, constraint(rod) = s^2 + q[1]^2 + u^2 - l^2, model(Less, frozen(q[1] = l, s = omega*t))";
    let less = variant(text, "m k g c l omega").model;
    let names: Vec<&str> = less
        .coordinates
        .iter()
        .map(|array| array.name.as_str())
        .collect();
    assert_eq!(names, ["q[0]", "q[2]", "u"]);
    let by_hand = "coordinates(a, b, u), let s = omega*t, lagrangian = (dot(s)^2 + dot(u)^2)/2 + m/2*(dot(a)^2 + dot(b)^2)
        - k/2*((a - s)^2 + (l - s)^2 + (b - s)^2) - g*u*b, force(a) = -c*dot(a)*u, force(b) = -c*dot(b)*u, constraint(rod) = s^2 + l^2 + u^2 - l^2";
    same(
        &less,
        &declared(by_hand, "m k g c l omega"),
        &[0.3, -0.2, 0.7],
        &[0.5, 0.1, -0.9],
    );
}

#[test]
fn passes_one_after_another() {
    let text = format!("{SPRING}, model(Linear, frozen(r = l), truncated(2))");
    let linear = variant(&text, "m l g k c");
    let by_hand = "coordinates(theta), lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*(1 - theta^2/2), force(theta) = -c*l^2*dot(theta), output(height) = -l*cos(theta)";
    same(
        &linear.model,
        &declared(by_hand, "m l g c"),
        &[0.8],
        &[-0.6],
    );
    assert_eq!(linear.made, "frozen `r = l`; truncated to degree 2");
    // A point with r = l, beside which r may move.
    let both = variant(
        &format!("{SPRING}, model(Both, truncated(2, r = l))"),
        "m l g k c",
    )
    .model;
    assert!(Derivation::of(&both).structure().linear);
    assert_eq!(
        both.to_string(),
        "Model: truncated to degree 2 about r = l\n\
         L = m g l − 0.5 k (r − l)² + m g (r − l) + 0.5 m (r\u{307}² + l² θ\u{307}²) − 0.5 m g l θ²\n\
         Q(r) = −c r\u{307}\n\
         Q(θ) = −l² c θ\u{307}\n\
         coordinates: r, θ      parameters: m, l, g, k, c"
    );
}

const SPRING_IN_A_PLANE: &str = "coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y - k/2*(sqrt(x^2 + y^2) - l)^2";

#[test]
fn a_spring_becomes_a_rod() {
    let text = format!(
        "{SPRING_IN_A_PLANE}, output(height) = y, output(pull) = k*(sqrt(x^2 + y^2) - l), model(Rod, rigid(rod = k))"
    );
    let rod = variant(&text, "m g k l");
    assert_eq!(rod.model.used_fields, ["m", "g", "l"]);
    let by_hand = "coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = sqrt(x^2 + y^2) - l, output(height) = y";
    let by_hand = declared(by_hand, "m g l");
    assert_eq!(rod.model.constraints.len(), 1);
    assert_eq!(rod.model.constraints[0].name, "rod");
    assert_eq!(rod.model.constraints[0].kind, by_hand.constraints[0].kind);
    same(&rod.model, &by_hand, &[0.6, -0.7], &[0.3, 0.4]);
}

/// Fields beside the square do not change where it vanishes, in a denominator either.
#[test]
fn a_bar_becomes_a_rod() {
    let by_hand = "coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = sqrt(x^2 + y^2) - l";
    let by_hand = declared(by_hand, "m g l");
    for stiffness in ["E*A/(2*l)", "3*E*A/l^3", "E*A/(1 - c^2)", "E*A^2/2"] {
        let text = format!(
            "coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y - {stiffness}*(sqrt(x^2 + y^2) - l)^2, model(Rod, rigid(rod = E))"
        );
        let fields = match stiffness.contains('c') {
            true => "m g E A l c",
            false => "m g E A l",
        };
        let rod = variant(&text, fields);
        if !stiffness.contains("A^2") {
            assert_eq!(rod.model.used_fields, ["m", "g", "l"], "{stiffness}");
            // A square does not tell the sign of its root, nor does the order in which names were met.
            same(&rod.model, &by_hand, &[0.6, -0.7], &[0.3, 0.4]);
        }
        assert_eq!(rod.model.constraints.len(), 1, "{stiffness}");
        assert_eq!(rod.model.constraints[0].name, "rod");
    }
}

#[test]
fn springs_of_one_stiffness_become_several_constraints() {
    let text = "coordinates(q[20]), momenta(p[20]), hamiltonian = sum(i in 0..20, p[i]^2/(2*m)) + k*sum(i in 0..19, (q[i+1] - q[i] - l)^2) + g*q[0],
        model(Stiff, rigid(link = k))";
    let stiff = variant(text, "m k l g").model;
    let names: Vec<&str> = stiff
        .constraints
        .iter()
        .map(|one| one.name.as_str())
        .collect();
    assert_eq!(
        (names.len(), names[0], names[18]),
        (19, "link_1", "link_19")
    );
    let by_hand = "coordinates(q[20]), momenta(p[20]), hamiltonian = sum(i in 0..20, p[i]^2/(2*m)) + g*q[0], constraint(link[i in 0..19]) = q[i] - q[i+1] + l";
    let by_hand = declared(by_hand, "m l g");
    let (q, z): (Vec<f64>, Vec<f64>) = (points(20).collect(), points(40).skip(20).collect());
    let [one, other] = [&stiff, &by_hand].map(|model| run(model, &q, &z));
    assert!((one.value - other.value).abs() < 1e-13);
    // Elongations, from which the length is subtracted.
    let mut left: Vec<f64> = one.phi.clone();
    let mut right: Vec<f64> = other.phi.iter().map(|phi| -phi).collect();
    left.sort_by(f64::total_cmp);
    right.sort_by(f64::total_cmp);
    assert_eq!(left, right);
}

#[test]
fn a_constraint_becomes_a_spring() {
    let rod = "coordinates(x, y, z), lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(z)^2) - m*g*y, constraint(wall) = z - c, constraint(rod) = x^2 + y^2 - l^2, constraint(plane) = z + x*omega";
    let text =
        format!("{rod}, model(Soft, elastic(rod = k)), model(Softer, elastic(rod = k, wall = h))");
    let model = declared(&text, "m g c l omega");
    let soft = &model.variants[0];
    let by_hand = "coordinates(x, y, z), lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(z)^2) - m*g*y - k/2*(x^2 + y^2 - l^2)^2, constraint(wall) = z - c, constraint(plane) = z + x*omega";
    same(
        &soft.model,
        &declared(by_hand, "m g c l omega k"),
        &[0.3, 0.5, 0.1],
        &[0.2, 0.7, -0.4],
    );
    assert_eq!(
        soft.added[0],
        ("k".to_owned(), "Stiffness in place of `rod`".to_owned())
    );
    assert_eq!(soft.model.used_fields, ["m", "g", "c", "l", "omega", "k"]);
    let rows: Vec<_> = soft
        .model
        .constraints
        .iter()
        .map(|one| one.row.as_constant())
        .collect();
    assert_eq!(rows, [Some(0), Some(1)]);
    let added: Vec<&str> = model.variants[1]
        .added
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(added, ["k", "h"]);
}

#[test]
fn families_of_constraints_become_springs() {
    let written_out = "coordinates(q[4]), lagrangian = sum(i in 0..4, m/2*dot(q[i])^2 - g*q[i]), constraint(link[i in 0..3]) = q[i+1] - q[i] - l, model(Soft, elastic(link = k))";
    let any_length = "coordinates(q[n]), lagrangian = sum(i in 0..n, m/2*dot(q[i])^2 - g*q[i]), constraint(link[i in 0..n-1]) = q[i+1] - q[i] - l, model(Soft, elastic(link = k))";
    let by_hand = "coordinates(q[4]), lagrangian = sum(i in 0..4, m/2*dot(q[i])^2 - g*q[i]) - sum(i in 0..3, k/2*(q[i+1] - q[i] - l)^2)";
    let by_hand = declared(by_hand, "m g l k");
    let (q, z) = ([0.1, 0.4, -0.3, 0.8], [0.3, 0.1, 0.5, -0.2]);
    same(&variant(written_out, "m g l").model, &by_hand, &q, &z);
    let family = variant(any_length, "n m g l").model;
    assert!(family.is_of_run_time_length());
    same(&family, &by_hand, &q, &z);
    let one = written_out.replace("elastic(link = k)", "elastic(link[1] = k)");
    let one = variant(&one, "m g l").model;
    let names: Vec<&str> = one
        .constraints
        .iter()
        .map(|one| one.name.as_str())
        .collect();
    assert_eq!(names, ["link[0]", "link[2]"]);
}
