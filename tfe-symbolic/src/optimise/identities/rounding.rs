//! What rounding may do to the roots of a plan, at a few states: a running error analysis, to first order.

use crate::expr::graph::ExprId;
use crate::expr::input::Input;
use crate::expr::simplify::holds;
use crate::optimise::plan::{Op, Plan};
use crate::syntax::ast::Comparison;

use super::residue::{mixed, scattered};

/// At how many states; from the third one on, half of the inputs are small, each time others.
const STATES: u64 = 10;

/// How much larger an error may become.
const FACTOR: f64 = 4.0;

/// Bounds of the errors of all roots at all states, in units of half an ulp of 1.
pub(super) struct Bounds(Vec<(ExprId, Vec<f64>)>);

impl Bounds {
    /// Those of a plan.
    pub(super) fn of(plan: &Plan) -> Self {
        let words: Vec<u64> = plan.ids().map(|id| word(plan.op(id))).collect();
        let states: Vec<Vec<(f64, f64)>> = (0..STATES)
            .map(|state| errors(plan, &words, state))
            .collect();
        let mut roots: Vec<_> = plan.values().collect();
        roots.sort_unstable_by_key(|(root, _)| *root);
        let bounds = |op: usize| states.iter().map(|known| known[op].1).collect();
        Self(
            roots
                .into_iter()
                .map(|(root, value)| (root, bounds(value.op.index())))
                .collect(),
        )
    }

    /// Whether another plan of the same roots is not much worse at any of the states.
    pub(super) fn hold_for(&self, plan: &Plan) -> bool {
        let other = Self::of(plan);
        // Where nothing is known, in NaN, nothing is worse.
        let worse = |(old, new): (&f64, &f64)| *new > FACTOR * old;
        let pairs = self.0.iter().zip(&other.0);
        !pairs
            .into_iter()
            .any(|((_, old), (_, new))| old.iter().zip(new).any(worse))
    }
}

/// The values of all operations, and bounds of their errors.
fn errors(plan: &Plan, words: &[u64], state: u64) -> Vec<(f64, f64)> {
    let mut known: Vec<(f64, f64)> = Vec::with_capacity(plan.len());
    for id in plan.ids() {
        let op = plan.op(id);
        let operands: Vec<(f64, f64)> = op.operands().iter().map(|x| known[x.index()]).collect();
        let (a, ea) = operands.first().copied().unwrap_or((f64::NAN, 0.0));
        let (b, eb) = operands.get(1).copied().unwrap_or((f64::NAN, 0.0));
        let rounded = |value: f64, error: f64| (value, error + value.abs());
        let all: f64 = operands.iter().map(|(_, error)| error).sum();
        let result = match op {
            Op::Constant(value) => (value.to_f64(), 0.0),
            Op::Input(input) => (sample(input, words[id.index()], state), 0.0),
            Op::Add(..) => rounded(a + b, ea + eb),
            Op::Subtract(..) => rounded(a - b, ea + eb),
            Op::Multiply(..) => rounded(a * b, ea * b.abs() + a.abs() * eb),
            Op::Divide(..) => rounded(a / b, ea / b.abs() + a.abs() * eb / (b * b)),
            Op::Negate(_) => (-a, ea),
            Op::IntegerPower(_, n) => {
                let slope = f64::from(*n) * a.powi(n.saturating_sub(1));
                rounded(a.powi(*n), slope.abs() * ea)
            }
            Op::Power(..) => rounded(a.powf(b), (b * a.powf(b - 1.0)).abs() * ea + all),
            Op::Call(function, _) => {
                let arguments: Vec<f64> = operands.iter().map(|(x, _)| *x).collect();
                rounded(function.evaluate(&arguments), all)
            }
            Op::Select { comparison, .. } => chosen(*comparison, &operands),
            // The summand stands for the sum.
            Op::Loop { .. } => rounded(a, ea),
        };
        known.push(result);
    }
    known
}

fn chosen(comparison: Comparison, operands: &[(f64, f64)]) -> (f64, f64) {
    match operands {
        [left, right, then, otherwise] => {
            if holds(comparison, left.0, right.0) {
                *then
            } else {
                *otherwise
            }
        }
        _ => (f64::NAN, 0.0),
    }
}

/// What an input is known by.
fn word(op: &Op) -> u64 {
    match op {
        Op::Input(input) => scattered(3, &format!("{input:?}")),
        _ => 0,
    }
}

/// Between 1/4 and 2, or a thousandth of that; parameters are positive.
fn sample(input: &Input, word: u64, state: u64) -> f64 {
    let bits = mixed(word, state);
    let part = (bits % 4096) as f64 / 4096.0;
    let size = 0.25 * 8.0_f64.powf(part);
    let small = state >= 2 && (bits >> 12) & 1 == 0;
    let size = if small { 1e-3 * size } else { size };
    let parameter = matches!(input, Input::Parameter(_) | Input::ParameterElement(..));
    if parameter || (bits >> 16) & 1 == 0 {
        size
    } else {
        -size
    }
}
