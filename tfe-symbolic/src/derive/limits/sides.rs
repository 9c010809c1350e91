//! Limits of terms that jump where a quantity changes its sign, from both of its sides.
//!
//! ```text
//! |x| |sin x|          ∂²/∂x² = 2 cos x sign x sign(sin x) − |x sin x|  →  { 2  where |x| ≤ 0;  2 cos x sign x sign(sin x)  elsewhere } − |x sin x|
//! ```
//!
//! A sign is zero at zero, and a choice has the value of one of its branches: where two of them jump at the same place, their
//! product is there not what it is on both sides. The terms that jump are evaluated for a quantity u → 0 from above and from
//! below, where sign u is 1 and −1, and sign w(u) the sign of u ∂w/∂u. Where both are the same expression, and not what the terms
//! are at u = 0, that is the limit. Where they differ, as 2 sign x of x |x| + |x| |sin x| does, the terms are unchanged.
//!
//! The same is done for sums of a few terms that jump: of max(x − a, 0)² + max(b − x, 0)² both terms have the curvature 2 at x = a = b,
//! where the sum is (x − a)².

use super::approach::Approach;
use super::facts::{MAX_TERMS, factors_of, is_at_rest, is_equal, moves, times_terms};
use super::norm::{MAX_DEPTH, MAX_SUMS, is_small_with_its_argument};
use crate::derive::entry::Entry;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input};

/// In a sum no more quantities than these are examined.
const MAX_KINKS: usize = 6;

/// Of longer sums only the products of jumps are examined.
const MAX_JUMPING: usize = 8;

/// The list of the placeholder of the quantity that vanishes.
const KINK: u32 = 1;

/// Rewrites derivatives so that they have the limits that they have from both sides.
pub(super) fn take_limits_from_both_sides(graph: &mut Graph, derivatives: &mut [&mut Entry]) {
    let roots: Vec<ExprId> = derivatives.iter().map(|entry| entry.value).collect();
    let nodes = graph.reachable(&roots);
    if !nodes.iter().any(|id| is_jump(graph.node(*id))) {
        return;
    }
    let mut sides = Sides::default();
    for entry in derivatives {
        entry.value = sides.limit(graph, entry.value);
    }
}

/// What finds limits from both sides.
#[derive(Default)]
struct Sides {
    /// A copy in which limits are sought: most jumps have none, and expressions made in vain would change the order of later ones.
    trial: Option<Graph>,
    /// The expressions examined so far.
    known: Map<ExprId, ExprId>,
}

impl Sides {
    /// The expression with the limits that its jumping terms have together.
    fn limit(&mut self, graph: &mut Graph, x: ExprId) -> ExprId {
        if let Some(known) = self.known.get(&x) {
            return *known;
        }
        let new = self.new_limit(graph, x).unwrap_or(x);
        self.known.insert(x, new);
        new
    }

    fn new_limit(&mut self, graph: &mut Graph, x: ExprId) -> Option<ExprId> {
        let (_, terms) = graph.terms(x);
        if graph.contains_sum(x) || !jump_together(graph, &terms) {
            return None;
        }
        let trial = self.trial.get_or_insert_with(|| graph.clone());
        with_limits(trial, x)?;
        with_limits(graph, x)
    }
}

/// A term of a sum with its coefficient.
type Term = (Constant, ExprId);

/// Terms whose limit is not known.
#[derive(Clone, Copy, PartialEq)]
enum Unknown {
    /// With one of them there is no limit.
    Refused,
    /// They stay as they are beside the limit of the others.
    Kept,
}

/// A sum with the limits of its jumping terms; `None` where there are none. Where the limits of some terms are not known, those of the
/// others are taken with sums in products multiplied out, so that no term is a product with both.
fn with_limits(graph: &mut Graph, x: ExprId) -> Option<ExprId> {
    let (number, terms) = graph.terms(x);
    if let Some(value) = with_limits_of_terms(graph, number, &terms, Unknown::Refused) {
        return Some(value);
    }
    let opened = opened(graph, &terms, MAX_SUMS);
    with_limits_of_terms(graph, number, &opened, Unknown::Kept)
}

fn with_limits_of_terms(
    graph: &mut Graph,
    number: Constant,
    terms: &[Term],
    unknown: Unknown,
) -> Option<ExprId> {
    let (jumping, mut others): (Vec<Term>, Vec<Term>) = terms
        .iter()
        .copied()
        .partition(|(_, term)| jumps(graph, *term, MAX_SUMS) > 0);
    let limits = limits_at_kinks(graph, &jumping, unknown);
    if limits.is_empty() {
        return None;
    }
    let zero = graph.constant(Constant::ZERO);
    let mut value = graph.linear(Constant::ZERO, &jumping);
    for (size, limit) in limits {
        value = graph.select(Comparison::LessOrEqual, size, zero, limit, value);
    }
    others.push((Constant::ONE, value));
    Some(graph.linear(number, &others))
}

/// The terms with their products with jumping sums multiplied out, to at most [`MAX_TERMS`].
fn opened(graph: &mut Graph, terms: &[Term], depth: usize) -> Vec<Term> {
    let Some(depth) = depth.checked_sub(1) else {
        return terms.to_vec();
    };
    let mut all = Vec::with_capacity(terms.len());
    for (c, term) in terms {
        let parts = multiplied_out(graph, *term).unwrap_or_default();
        if parts.is_empty() || parts.len() > MAX_TERMS {
            all.push((*c, *term));
            continue;
        }
        let parts: Vec<Term> = parts.into_iter().map(|(d, y)| (*c * d, y)).collect();
        all.extend(opened(graph, &parts, depth));
    }
    match all.len() <= MAX_TERMS {
        true => all,
        false => terms.to_vec(),
    }
}

/// A product with a sum that jumps, as the sum of its products.
fn multiplied_out(graph: &mut Graph, term: ExprId) -> Option<Vec<Term>> {
    let mut factors = factors_of(graph, term);
    let jumps_as_sum = |(y, n): &(ExprId, i32)| {
        *n == 1 && graph.as_sum(*y).is_some() && jumps(graph, *y, MAX_SUMS) > 0
    };
    let at = factors.iter().position(jumps_as_sum)?;
    let (sum, _) = factors.swap_remove(at);
    let number = graph.as_multiple(term).0;
    let rest = graph.product(number, &factors);
    let mut products = times_terms(graph, rest, sum);
    for (c, product) in &mut products {
        let (own, y) = graph.as_multiple(*product);
        (*c, *product) = (*c * own, y);
    }
    Some(products)
}

/// Whether there are products of jumps among the terms, or a few terms that jump.
fn jump_together(graph: &Graph, terms: &[Term]) -> bool {
    let times = terms
        .iter()
        .map(|(_, term)| jumps(graph, *term, MAX_SUMS))
        .filter(|times| *times > 0);
    let times: Vec<usize> = times.collect();
    times.iter().any(|times| *times > 1) || (2..=MAX_JUMPING).contains(&times.len())
}

/// The number of jumps that are multiplied with each other in a term.
fn jumps(graph: &Graph, term: ExprId, depth: usize) -> usize {
    let mut count = 0_usize;
    for (y, n) in factors_of(graph, term) {
        let times = usize::try_from(n).unwrap_or(0);
        let own = match (graph.as_sum(y), depth.checked_sub(1)) {
            (Some((_, terms)), Some(depth)) => {
                let within = terms.iter().map(|(_, z)| jumps(graph, *z, depth));
                within.max().unwrap_or(0).saturating_mul(times)
            }
            (_, depth) if times > 0 && is_jump(graph.node(y)) => {
                1 + jumps_in_branches(graph, y, depth)
            }
            _ => 0,
        };
        count = count.saturating_add(own);
    }
    count
}

/// The number of jumps in the branches of a choice, as of the slope of max(|x| − a, 0).
fn jumps_in_branches(graph: &Graph, x: ExprId, depth: Option<usize>) -> usize {
    let (
        Node::Select {
            then, otherwise, ..
        },
        Some(depth),
    ) = (graph.node(x), depth)
    else {
        return 0;
    };
    jumps(graph, *then, depth).max(jumps(graph, *otherwise, depth))
}

/// Whether it is a sign or a choice.
fn is_jump(node: &Node) -> bool {
    matches!(
        node,
        Node::Select { .. }
            | Node::Call {
                function: Function::Sign,
                ..
            }
    )
}

/// Sizes of quantities that may vanish, and the limits of a sum of jumping terms where they do, as far as it has these from both sides and is
/// not evaluated to them.
fn limits_at_kinks(graph: &mut Graph, terms: &[Term], unknown: Unknown) -> Vec<(ExprId, ExprId)> {
    let mut kinks = Vec::new();
    for (_, term) in terms {
        let mut own = Vec::new();
        add_kinks(graph, *term, MAX_SUMS, &mut own);
        own.truncate(MAX_KINKS);
        let new = own.into_iter().filter(|kink| !kinks.contains(kink));
        let new: Vec<ExprId> = new.collect();
        kinks.extend(new);
    }
    kinks.truncate(MAX_KINKS);
    let mut found = Vec::with_capacity(kinks.len());
    for kink in &kinks {
        if let Some(limit) = limit_at(graph, terms, (*kink, unknown)) {
            let size = graph.call(Function::Abs, &[*kink]);
            found.push((size, limit));
        }
    }
    let pairs = kinks.iter().enumerate();
    let pairs = pairs.flat_map(|(at, kink)| kinks[..at].iter().map(|other| [*other, *kink]));
    let mut pairs: Vec<[ExprId; 2]> = pairs.collect();
    pairs.sort_unstable();
    for pair in pairs {
        if let Some(limit) = limit_at_pair(graph, terms, (pair, unknown)) {
            let sizes = pair.map(|kink| (Constant::ONE, graph.call(Function::Abs, &[kink])));
            found.push((graph.linear(Constant::ZERO, &sizes), limit));
        }
    }
    found
}

/// The quantities that decide the jumps in a term.
fn add_kinks(graph: &mut Graph, term: ExprId, depth: usize, kinks: &mut Vec<ExprId>) {
    for (y, n) in factors_of(graph, term) {
        if n <= 0 {
            continue;
        }
        match graph.node(y).clone() {
            Node::Call {
                function: Function::Sign,
                arguments,
            } => {
                for argument in arguments {
                    add_zeros(graph, argument, MAX_DEPTH, kinks);
                }
            }
            Node::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => {
                let difference = graph.subtract(left, right);
                add_zeros(graph, difference, MAX_DEPTH, kinks);
                if depth > 0 {
                    add_kinks(graph, then, depth - 1, kinks);
                    add_kinks(graph, otherwise, depth - 1, kinks);
                }
            }
            Node::Sum { terms, .. } if depth > 0 => {
                for (_, z) in terms {
                    add_kinks(graph, z, depth - 1, kinks);
                }
            }
            _ => {}
        }
    }
}

/// The quantities with which an expression vanishes: x and y of tanh(x y). A sum that is not solved for an input may
/// vanish with one, as x + x³.
fn add_zeros(graph: &Graph, x: ExprId, depth: usize, kinks: &mut Vec<ExprId>) {
    let Some(depth) = depth.checked_sub(1) else {
        return;
    };
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Call {
            function,
            arguments,
        } if *function == Function::Abs || is_small_with_its_argument(*function) => {
            for argument in arguments {
                add_zeros(graph, *argument, depth, kinks);
            }
        }
        Node::Product(factors) => {
            for (y, n) in factors {
                if *n > 0 {
                    add_zeros(graph, *y, depth, kinks);
                }
            }
        }
        _ if !moves(graph, x) || kinks.contains(&x) => {}
        _ => {
            kinks.push(x);
            if is_variable(graph, x) || linear_term(graph, x).is_some() {
                return;
            }
            for y in graph.reachable(&[x]) {
                if is_variable(graph, y) && !kinks.contains(&y) {
                    kinks.push(y);
                }
            }
        }
    }
}

/// Whether it is an input that may change during a motion.
fn is_variable(graph: &Graph, x: ExprId) -> bool {
    matches!(graph.node(x), Node::Input(input) if !is_at_rest(input))
}

/// Which of the terms of a sum is a multiple of an input that is in none of the others.
fn linear_term(graph: &Graph, sum: ExprId) -> Option<usize> {
    let (_, terms) = graph.as_sum(sum)?;
    (0..terms.len()).find(|at| {
        let (_, y) = terms[*at];
        let mut others = terms.iter().enumerate().filter(|(other, _)| other != at);
        is_variable(graph, y) && !others.any(|(_, (_, z))| graph.reachable(&[*z]).contains(&y))
    })
}

/// The limit of a sum of terms where a quantity vanishes, if it has one from both sides and is not evaluated to that.
fn limit_at(
    graph: &mut Graph,
    terms: &[Term],
    (kink, unknown): (ExprId, Unknown),
) -> Option<ExprId> {
    let (mut of_kink, mut leaf) = (Vec::with_capacity(terms.len()), None);
    for (c, term) in terms {
        let (term, own) = in_terms_of(graph, *term, kink);
        of_kink.push((*c, term));
        leaf = Some(own);
    }
    let leaf = leaf?;
    let zero = graph.input(leaf.clone());
    limit_from_both_sides(graph, (terms, unknown), &of_kink, (&leaf, &[zero]))
}

/// The same where two quantities do that change together, and of which none vanishes with the other for all values of parameters: x − a and
/// b − x, or x² − 1 and x⁴ − 1.
fn limit_at_pair(
    graph: &mut Graph,
    terms: &[Term],
    (pair, unknown): ([ExprId; 2], Unknown),
) -> Option<ExprId> {
    let leaf = common_variable(graph, pair)?;
    let [first, second] = pair;
    if is_known_at(graph, first, second) || is_known_at(graph, second, first) {
        return None;
    }
    limit_from_both_sides(graph, (terms, unknown), terms, (&leaf, &pair))
}

/// A variable of two quantities that are functions of it alone, or of which one is a multiple of the other but for what is at rest, as
/// x − y − a and b − x + y.
fn common_variable(graph: &mut Graph, pair: [ExprId; 2]) -> Option<Input> {
    let [of_first, of_second] = pair.map(|kink| {
        let mut inputs = graph.inputs_of(kink);
        inputs.retain(|input| !is_at_rest(input));
        inputs
    });
    if of_first != of_second {
        return None;
    }
    let leaf = of_first.first()?.clone();
    if of_first.len() > 1 {
        let slopes = pair.map(|kink| derivative(graph, kink, &leaf));
        let [first, second] = slopes.map(|slope| graph.as_constant(slope));
        let (first, second) = (first?, second?);
        let terms = [(second, pair[0]), (-first, pair[1])];
        let difference = graph.linear(Constant::ZERO, &terms);
        let (_, rest) = graph.terms(difference);
        let rest = graph.linear(Constant::ZERO, &rest);
        if first.is_zero() || moves(graph, rest) {
            return None;
        }
    }
    Some(leaf)
}

/// Whether a quantity has a number as its value where another one vanishes.
fn is_known_at(graph: &mut Graph, x: ExprId, kink: ExprId) -> bool {
    let (x, leaf) = in_terms_of(graph, x, kink);
    let zeros = [graph.input(leaf.clone())];
    let mut approach = Approach::of(&leaf, &zeros, 0);
    let limit = approach.limit(graph, x, MAX_DEPTH);
    limit.is_none_or(|limit| graph.as_constant(limit).is_some())
}

/// The limit of a sum of terms, given also as expressions of a leaf, where some quantities vanish together.
fn limit_from_both_sides(
    graph: &mut Graph,
    (terms, unknown): (&[Term], Unknown),
    of_leaf: &[Term],
    (leaf, zeros): (&Input, &[ExprId]),
) -> Option<ExprId> {
    let [above, below, at_zero] = [1, -1, 0].map(|side| {
        let mut approach = Approach::of(leaf, zeros, side);
        let limit = |(c, term): &Term| Some((*c, approach.limit(graph, *term, MAX_DEPTH)?));
        of_leaf.iter().map(limit).collect::<Vec<_>>()
    });
    let is_known = |at: usize| above[at].is_some() && below[at].is_some();
    let (known, others): (Vec<usize>, Vec<usize>) = (0..terms.len()).partition(|at| is_known(*at));
    if unknown == Unknown::Refused && !others.is_empty() {
        return None;
    }
    let mut sum = |limits: &[Option<Term>]| {
        let limits = known.iter().map(|at| limits[*at]);
        let limits = limits.collect::<Option<Vec<Term>>>()?;
        Some(graph.linear(Constant::ZERO, &limits))
    };
    let (above, below, at_zero) = (sum(&above)?, sum(&below)?, sum(&at_zero));
    if !is_equal(graph, above, below) {
        return None;
    }
    if at_zero == Some(above) {
        return None;
    }
    let mut limit: Vec<Term> = others.into_iter().map(|at| terms[at]).collect();
    limit.push((Constant::ONE, above));
    Some(graph.linear(Constant::ZERO, &limit))
}

/// An expression as one of a quantity that may vanish, and the leaf that is the quantity in it.
fn in_terms_of(graph: &mut Graph, x: ExprId, kink: ExprId) -> (ExprId, Input) {
    if let Node::Input(input) = graph.node(kink) {
        return (x, input.clone());
    }
    let leaf = Input::Placeholder(KINK, Affine::constant(0));
    let value = graph.input(leaf.clone());
    let solution = solution(graph, kink, value);
    let mapping = graph.with_nodes(x, &mut |_, old, _| match solution {
        _ if old == kink => Some(value),
        Some((input, solved)) if old == input => Some(solved),
        _ => None,
    });
    (mapping.of(x), leaf)
}

/// An input in a sum, and what it is where the sum has a value.
fn solution(graph: &mut Graph, sum: ExprId, value: ExprId) -> Option<(ExprId, ExprId)> {
    let at = linear_term(graph, sum)?;
    let (constant, terms) = graph.as_sum(sum)?;
    let mut others = terms.to_vec();
    let (c, input) = others.remove(at);
    let rest = graph.linear(constant, &others);
    let difference = graph.subtract(value, rest);
    Some((input, graph.scale(c.reciprocal()?, difference)))
}
