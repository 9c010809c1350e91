//! Gradients of losses, which are computed backwards, beside those composed of forward derivatives, for both kinds of
//! length.

use std::ops::Range;
use tfe::length::Length;
use tfe::sensitivity::{Loss, LossGradient, Sensitive};

/// The times at which an output is compared with [`VALUES`]; one of them is the start.
pub const TIMES: [f64; 4] = [0.0, 0.31, 0.5, 1.0];
const VALUES: [f64; 4] = [0.2, -0.1, 0.4, 0.3];

/// A loss of coordinates and momenta at the end, and of an output at [`TIMES`].
pub fn of_states<'l, const N: usize, L: Length<N>>(output: &str) -> Loss<'l, N, L> {
    Loss::of_end(|q, p, _| q[0].sin() + 0.5 * p[q.len() - 1].powi(2))
        .and(Loss::squares(output, TIMES, VALUES))
}

/// The same with velocities and with the output at the end.
pub fn of_all<'l, const N: usize, L: Length<N>>(output: &str) -> Loss<'l, N, L> {
    Loss::of_end(|q, p, v| {
        let last = q.len() - 1;
        q[0].sin() + 0.5 * p[last].powi(2) + q[last] * v[0] + 0.1 * v[last].powi(2)
    })
    .and(Loss::squares(output, TIMES, VALUES))
    .and(Loss::output_at_end(output))
}

/// A loss of a span: of the end, with an output, of the output at the start, inside, twice at one time and at the end,
/// and of its integral.
pub fn of_span<'l, const N: usize, L: Length<N>>(
    output: &str,
    span: &Range<f64>,
) -> Loss<'l, N, L> {
    let length = span.end - span.start;
    let times = [0.0, 0.31, 0.5, 0.5, 1.0].map(|part| span.start + part * length);
    Loss::of_end(|q, p, v| q[0].sin() + p[q.len() - 1] * v[0])
        .and(Loss::squares(output, times, [0.2, -0.1, 0.4, 0.1, 0.3]).times(0.7))
        .and(Loss::output_at_end(output))
        .and(Loss::integral(output))
}

/// The gradient of a loss by all parameters and by the initial state, and the loss, as one row.
pub fn row<const N: usize, L: Length<N>>(
    (value, gradient): &(f64, LossGradient<N, L>),
) -> Vec<f64> {
    let by_start = gradient.by_start();
    let (q, p) = L::parts(&by_start);
    [gradient.by_parameters(), q.as_ref(), p.as_ref(), &[*value]].concat()
}

/// Asserts that two such rows agree up to rounding errors.
#[track_caller]
pub fn compare_rows(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-12 * size,
            "{what}: {found} instead of {expected}"
        );
    }
}

/// What was found and what is expected.
pub struct Pairs {
    /// The value of [`of_all`].
    pub value: [f64; 2],
    /// Its derivatives by the parameters.
    pub by_parameters: Vec<[f64; 2]>,
    /// The derivatives of [`of_states`] by the start, ordered (p, q): there are no forward derivatives of velocities.
    pub by_start: Vec<[f64; 2]>,
}

/// The results for [`of_all`] and for [`of_states`], and the forward derivatives of a run with nodes at [`TIMES`].
pub fn pairs<const N: usize, L: Length<N>>(
    (value, of_all): &(f64, LossGradient<N, L>),
    (_, of_states): &(f64, LossGradient<N, L>),
    s: &Sensitive<N, L>,
    output: &str,
) -> Pairs {
    let nodes = s.motion().states();
    let at = TIMES.map(|t| nodes.iter().position(|node| node.t == t).expect("a node"));
    let outputs = s.motion().outputs().column(output).expect("declared");
    let node = s.motion().last();
    let (q, p, v) = (node.q.as_ref(), node.p.as_ref(), node.v.as_ref());
    let (n, last) = (q.len(), q.len() - 1);
    let squares: f64 = (at.iter().zip(VALUES))
        .map(|(at, m)| 0.5 * (outputs[*at] - m).powi(2))
        .sum();
    let at_end = q[0].sin() + 0.5 * p[last].powi(2) + q[last] * v[0] + 0.1 * v[last].powi(2);
    // The derivative of the squares, from that of the output at each node.
    let of_squares = |slope: &dyn Fn(usize) -> f64| -> f64 {
        let terms = at.iter().zip(VALUES);
        terms.map(|(at, m)| (outputs[*at] - m) * slope(*at)).sum()
    };
    let by_parameter = |name: &String| {
        let slopes = s.by(name).output(output).expect("declared");
        let by = s.by(name).last();
        let (by_q, by_p, by_v) = (by.q.as_ref(), by.p.as_ref(), by.v.as_ref());
        let expected = of_squares(&|at| slopes[at])
            + q[0].cos() * by_q[0]
            + p[last] * by_p[last]
            + by_q[last] * v[0]
            + q[last] * by_v[0]
            + 0.2 * v[last] * by_v[last]
            + slopes[at[3]];
        [of_all.by(name), expected]
    };
    let slopes = s.by_start().output(output).expect("declared");
    let (matrix, found) = (s.by_start().last(), of_states.by_start());
    let by_start = |column: usize| {
        let number = |state: &L::State| {
            let (q, p) = L::parts(state);
            match column.checked_sub(n) {
                None => p.as_ref()[column],
                Some(a) => q.as_ref()[a],
            }
        };
        let expected = of_squares(&|at| number(&slopes[at]))
            + q[0].cos() * matrix[(n, column)]
            + p[last] * matrix[(n - 1, column)];
        [number(&found), expected]
    };
    Pairs {
        value: [*value, squares + at_end + outputs[at[3]]],
        by_parameters: s.parameters().iter().map(by_parameter).collect(),
        by_start: (0..2 * n).map(by_start).collect(),
    }
}
