//! Operation counts of published models, pinned.
//!
//! Each counts the energy function, its gradient and the upper half of its second derivatives together, as they are computed in one program.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::Request;
use tfe_symbolic::program::count::Counts;
use tfe_symbolic::syntax::context::Context;

const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: false,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

fn counts(text: &str) -> Counts {
    let declared = declare(text, &Context::default()).expect("a model of the test");
    let derivation = Derivation::of(&declared);
    derivation.counts(ALL)
}

/// n links: L = Σi (n−i)/2 ωi² + Σ_{i<j} (n−j) ωi ωj cos(θi−θj) + Σi 9.81 (n−i) cos θi
fn links(n: usize) -> String {
    let names: Vec<String> = (0..n).map(|i| format!("th{i}")).collect();
    let mut terms = Vec::new();
    for i in 0..n {
        terms.push(format!("{}/2*dot(th{i})^2", n - i));
    }
    for i in 0..n {
        for j in i + 1..n {
            terms.push(format!("{}*dot(th{i})*dot(th{j})*cos(th{i}-th{j})", n - j));
        }
    }
    for i in 0..n {
        terms.push(format!("9.81*{}*cos(th{i})", n - i));
    }
    format!(
        "coordinates({}), lagrangian = {}",
        names.join(", "),
        terms.join(" + ")
    )
}

const DOUBLE_PENDULUM: &str = "coordinates(a, b), lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a-b) + 9.81*(2*cos(a) + cos(b))";

const HEAVY_TOP: &str = "coordinates(phi, theta, psi), lagrangian = 1/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) \
    + 0.5/2*(dot(psi) + dot(phi)*cos(theta))^2 - 2*cos(theta)";

const BODY: &str = "coordinates(x, y, z, phi, theta, psi), \
    let o1 = dot(phi)*sin(theta)*sin(psi) + dot(theta)*cos(psi), \
    let o2 = dot(phi)*sin(theta)*cos(psi) - dot(theta)*sin(psi), \
    let o3 = dot(phi)*cos(theta) + dot(psi), \
    lagrangian = 0.7*(dot(x)^2 + dot(y)^2 + dot(z)^2) + (o1^2 + 2*o2^2 + 3.5*o3^2)/2 - 13.734*z";

/// Additions / multiplications / evaluations of sine or cosine; none of the models divides.
#[track_caller]
fn check(text: &str, additions: usize, multiplications: usize, evaluations: usize) {
    let counts = counts(text);
    let found = (
        counts.additions,
        counts.multiplications,
        counts.sine_cosine_evaluations(),
    );
    assert_eq!(found, (additions, multiplications, evaluations), "{counts}");
    assert_eq!(
        counts.divisions + counts.functions + counts.lone_sines,
        0,
        "{counts}"
    );
}

// The comments give what CasADi (SX with cse), SymForce and the better of two ways of SymPy emit.

#[test]
fn double_pendulum() {
    // 11/16/6, 11/16/6, 10/14/6
    check(DOUBLE_PENDULUM, 11, 18, 4);
}

#[test]
fn three_links() {
    // 33/36/12, 32/39/12, 29/39/12
    check(&links(3), 32, 45, 6);
}

#[test]
fn five_links() {
    // 107/109/30, 104/105/30, 94/105/30
    check(&links(5), 104, 134, 10);
}

#[test]
fn declared_by_positions() {
    // The same pendulum by where its masses are: the mass matrix is found again, with cos² + sin² = 1.
    let text = "coordinates(a, b), let x1 = sin(a), let y1 = -cos(a), let x2 = x1 + sin(b), let y2 = y1 - cos(b), \
        lagrangian = (dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2)/2 - 9.81*(y1 + y2)";
    let declared = declare(text, &Context::default()).expect("a model of the test");
    let second = Request {
        value: false,
        ..ALL
    };
    let counts = |text: &str| {
        let declared = declare(text, &Context::default()).expect("a model of the test");
        Derivation::of(&declared).counts(second)
    };
    let by_angles = counts(DOUBLE_PENDULUM);
    let by_positions = Derivation::of(&declared).counts(second);
    assert!(
        by_positions.weighted() <= by_angles.weighted() + 2,
        "{by_positions} and {by_angles}"
    );
}

#[test]
fn heavy_top() {
    // 14/33/2, 12/31/2, 12/28/2
    check(HEAVY_TOP, 10, 17, 2);
}

#[test]
fn free_body() {
    // 54/122/4 and a division, 39/88/4, 28/76/4
    check(BODY, 23, 45, 4);
}
