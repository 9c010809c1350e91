//! Sines and cosines of sums of angles: the values are those of the model as it is written, and the differences are of the stated size.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const TEXT: &str = "coordinates(a, b, c), \
    lagrangian = (dot(a)^2 + dot(b)^2 + dot(c)^2)/2 + dot(a)*cos(a - b) + dot(b)*sin(a + b - c) + dot(c)*cos(2*b + w) + cos(a) + sin(b) + cos(c + 2) \
    + cos(b + c - a) + sin(c - t) + cos(t) + sin(w - a) + sin(w)";

#[test]
fn values_and_derivatives_are_those_of_the_written_model() {
    let w = Field {
        name: "w".to_owned(),
        kind: FieldKind::Scalar,
    };
    let context = Context {
        fields: vec![w],
        ..Context::default()
    };
    let derivation = Derivation::of(&declare(TEXT, &context).expect("a model of the test"));
    let request = Request {
        value: true,
        first: true,
        second: true,
        ..Request::default()
    };
    let program = derivation.program(request);
    let counts = derivation.counts(request);
    // a, b, c, w, t
    assert_eq!(
        (counts.sine_cosine_pairs, counts.lone_sines),
        (5, 0),
        "{program}"
    );
    let mut state = 1u64;
    let mut random = || {
        // Knuth's linear congruential generator; angles up to ±10
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 20.0 - 10.0
    };
    for _ in 0..200 {
        let [a, b, c, w, t] = std::array::from_fn(|_| random());
        let [va, vb, vc] = std::array::from_fn(|_| random() / 10.0);
        let environment = Environment {
            time: t,
            q: vec![a, b, c],
            z: vec![va, vb, vc],
            parameters: [("w".to_owned(), w)].into_iter().collect(),
            ..Environment::default()
        };
        let results = interpret(&program, &environment).expect("all inputs are there");
        // Up to three steps of 2⁻⁵² in each of a dozen sines, and the rounding of arguments up to 40.
        let tolerance = 300.0 * f64::EPSILON;
        let close = |found: f64, expected: f64| {
            assert!((found - expected).abs() <= tolerance, "{found} {expected}");
        };
        let f = (a + b - c, 2.0 * b + w, b + c - a);
        close(
            results.value,
            (va * va + vb * vb + vc * vc) / 2.0
                + va * (a - b).cos()
                + vb * f.0.sin()
                + vc * f.1.cos()
                + a.cos()
                + b.sin()
                + (c + 2.0).cos()
                + f.2.cos()
                + (c - t).sin()
                + t.cos()
                + (w - a).sin()
                + w.sin(),
        );
        close(
            results.q[0],
            -va * (a - b).sin() + vb * f.0.cos() - a.sin() + f.2.sin() - (w - a).cos(),
        );
        close(
            results.q[1],
            va * (a - b).sin() + vb * f.0.cos() - 2.0 * vc * f.1.sin() + b.cos() - f.2.sin(),
        );
        close(results.z[2], vc + f.1.cos());
        close(results.qq[1][2], vb * f.0.sin() - f.2.cos());
        close(results.zq[2][1], -2.0 * f.1.sin());
    }
}
