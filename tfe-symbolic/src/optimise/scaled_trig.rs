//! Scaled sines and cosines: l sin θ and l cos θ as variables.
//!
//! Where θ moves an arm of length l, all expressions can be written in S = l sin θ and C = l cos θ: in the products l₁
//! m l₂ sin θ₁ cos θ₂ the lengths need not be multiplied with each other. This cannot be seen from single products,
//! each of which can be grouped in several ways. So sine and cosine are replaced by S/l and C/l, with new inputs S and
//! C. Where all divisors cancel, the operations are arranged with the new inputs, which are then replaced by products.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::{Map, Set};
use crate::expr::input::{Affine, Input};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::rewrite::Mapping;
use crate::optimise::plan::{Op, Plan};
use crate::optimise::rebuild::{Changes, Formula, rebuild};

/// A sine or cosine with its amplitude, and the input that represents their product.
struct Arm {
    input: Input,
    amplitude: ExprId,
    call: ExprId,
}

/// The list of the placeholders of sines and cosines with their amplitudes.
const SCALED: u32 = 1;

/// The inputs that represent scaled sines and cosines in the rewritten values.
pub(crate) struct ScaledTrig(Vec<Arm>);

/// Exponents of parameters, and of whatever is made of parameters alone; of sines and cosines, by their argument.
type Powers = SortedMap<ExprId, i32>;

impl ScaledTrig {
    /// The values rewritten with scaled sines and cosines; `None` if there are none.
    pub(crate) fn of(graph: &mut Graph, values: &[ExprId]) -> Option<(Self, Vec<ExprId>)> {
        if values.iter().any(|value| graph.contains_sum(*value)) {
            return None;
        }
        let mut search = Search {
            moving: moving(graph, values),
            counts: true,
            arguments: SortedSet::new(),
            written: Map::default(),
            lost: Vec::new(),
        };
        search.run(graph, values);
        let amplitudes = search.amplitudes(values);
        search.written = Map::default();
        search.arguments.clear();
        search.counts = false;
        let mut arms = Vec::new();
        for (argument, factors) in &amplitudes {
            let factors: Vec<_> = factors.iter().map(|(x, n)| (*x, *n)).collect();
            let amplitude = graph.product(Constant::ONE, &factors);
            for call in [Function::Sin, Function::Cos].map(|function| call(function, *argument)) {
                let Some(call) = graph.find(&call) else {
                    continue;
                };
                let place = Affine::constant(arms.len() as i64);
                let input = Input::Placeholder(SCALED, place);
                let whole = graph.input(input.clone());
                let powers = factors.iter().map(|(x, n)| (*x, -n)).collect();
                search.written.insert(call, (powers, whole));
                arms.push(Arm {
                    input,
                    amplitude,
                    call,
                });
            }
        }
        if arms.is_empty() {
            return None;
        }
        search.run(graph, values);
        let whole = |x: &ExprId| {
            let (powers, x) = &search.written[x];
            let value = product(graph, powers, *x);
            powers.values().all(|n| *n > 0).then_some(value)
        };
        let values: Option<Vec<ExprId>> = values.iter().map(whole).collect();
        Some((Self(arms), values?))
    }

    /// The expressions that have to be arranged together with the values.
    pub(crate) fn parts(&self) -> impl Iterator<Item = ExprId> + '_ {
        self.0.iter().flat_map(|arm| [arm.amplitude, arm.call])
    }

    /// The plan of values and parts with products in place of the new inputs, for the values alone.
    pub(crate) fn written_out(&self, mut plan: Plan, values: &[ExprId]) -> Plan {
        let mut changes = Changes::default();
        for arm in &self.0 {
            let parts = (plan.value(arm.amplitude), plan.value(arm.call));
            let input = plan.find(&Op::Input(arm.input.clone()));
            if let ((Some(amplitude), Some(call)), Some(input)) = (parts, input) {
                let product = Formula::product(Formula::Is(amplitude), Formula::Is(call));
                changes.formulas.insert(input, product);
            }
        }
        let values: SortedSet<ExprId> = values.iter().copied().collect();
        plan.retain_values(|root| values.contains(&root));
        rebuild(&plan, &changes).0
    }
}

/// The nodes that are made of more than parameters and numbers.
fn moving(graph: &Graph, roots: &[ExprId]) -> Set<ExprId> {
    let mut found = Set::default();
    for id in graph.reachable(roots) {
        let moves = match graph.node(id) {
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..)) => false,
            Node::Input(_) => true,
            node => node.children().iter().any(|child| found.contains(child)),
        };
        if moves {
            found.insert(id);
        }
    }
    found
}

fn call(function: Function, argument: ExprId) -> Node {
    Node::Call {
        function,
        arguments: vec![argument],
    }
}

/// Expressions as powers of parameters times the rest.
struct Search {
    moving: Set<ExprId>,
    /// Whether sines and cosines count as powers of their arguments, to find amplitudes.
    counts: bool,
    /// The arguments of these.
    arguments: SortedSet<ExprId>,
    written: Map<ExprId, (Powers, ExprId)>,
    /// Powers that stay in one term of a sum.
    lost: Vec<Powers>,
}

impl Search {
    /// Takes as many parameters out of sums as all terms have.
    fn run(&mut self, graph: &mut Graph, values: &[ExprId]) {
        self.lost.clear();
        for id in graph.reachable(values) {
            if !self.written.contains_key(&id) {
                let written = self.write(graph, id);
                self.written.insert(id, written);
            }
        }
    }

    fn write(&mut self, graph: &mut Graph, id: ExprId) -> (Powers, ExprId) {
        let one = graph.constant(Constant::ONE);
        let node = graph.node(id).clone();
        match &node {
            Node::Product(factors) => {
                let (mut powers, mut rest) = (Powers::new(), Vec::new());
                for (x, n) in factors {
                    let (own, core) = &self.written[x];
                    for (y, m) in own {
                        let total = powers.get_or_insert(*y, 0_i32);
                        *total = total.saturating_add(m.saturating_mul(*n));
                    }
                    rest.push((*core, *n));
                }
                powers.retain(|_, n| *n != 0);
                (powers, graph.product(Constant::ONE, &rest))
            }
            Node::Sum { constant, terms } => {
                let mut all = terms.iter().map(|(_, x)| &self.written[x].0);
                let first = all.next().cloned().unwrap_or_default();
                let first = if constant.is_zero() {
                    first
                } else {
                    Powers::new()
                };
                let mut common = all.fold(first, |known, other| least(&known, other));
                // Where terms have other sines and cosines, each keeps the parameters that stand beside its own.
                let calls = |powers: &Powers| -> Powers {
                    let arguments = self.arguments.iter();
                    arguments
                        .filter_map(|x| Some((*x, *powers.get(x)?)))
                        .collect()
                };
                let mut others = terms.iter().map(|(_, x)| calls(&self.written[x].0));
                if others.any(|other| other != calls(&common)) {
                    common.clear();
                }
                let mut inside = Vec::new();
                for (c, x) in terms {
                    let (mut own, core) = self.written[x].clone();
                    for (y, n) in &common {
                        *own.get_or_default(*y) -= n;
                    }
                    own.retain(|_, n| *n != 0);
                    inside.push((*c, product(graph, &own, core)));
                    self.lost.push(own);
                }
                if !constant.is_zero() {
                    let inverse = common.iter().map(|(x, n)| (*x, -n)).collect();
                    inside.push((*constant, product(graph, &inverse, one)));
                }
                let sum = graph.linear(Constant::ZERO, &inside);
                if self.moving.contains(&id) || terms.len() < 2 {
                    return (common, sum);
                }
                let mut powers = common;
                powers.insert(sum, 1);
                (powers, one)
            }
            Node::Constant(_) => (Powers::new(), id),
            _ if !self.moving.contains(&id) => (Powers::from([(id, 1)]), one),
            Node::Call {
                function: Function::Sin | Function::Cos,
                arguments,
            } if self.counts => {
                self.arguments.extend(arguments.iter().copied());
                let inside = arguments.iter().map(|x| self.written[x].0.clone());
                self.lost.extend(inside);
                (arguments.iter().map(|x| (*x, 1)).collect(), one)
            }
            node => {
                let mut mapping = Mapping::default();
                for x in node.children() {
                    let (powers, core) = &self.written[&x];
                    mapping.set(x, product(graph, powers, *core));
                    self.lost.push(powers.clone());
                }
                let id = if mapping.keeps(node) {
                    id
                } else {
                    graph.remake(node, &mapping)
                };
                (Powers::new(), id)
            }
        }
    }

    /// By argument: the parameters that stand beside each sine and cosine, as often as these.
    fn amplitudes(&self, values: &[ExprId]) -> SortedMap<ExprId, Powers> {
        let mut found: SortedMap<ExprId, Powers> = SortedMap::new();
        let values = values.iter().map(|value| &self.written[value].0);
        for powers in self.lost.iter().chain(values) {
            let calls = powers.iter().filter(|(x, _)| self.arguments.contains(x));
            for (argument, degree) in calls {
                let still = powers
                    .iter()
                    .filter(|(x, n)| *degree > 0 && n >= degree && !self.moving.contains(x));
                let own: Powers = still.map(|(x, n)| (*x, n / degree)).collect();
                let known = found.remove(argument);
                found.insert(
                    *argument,
                    known.map_or_else(|| own.clone(), |known| least(&known, &own)),
                );
            }
        }
        found.retain(|_, factors| !factors.is_empty());
        found
    }
}

/// The powers times the rest.
fn product(graph: &mut Graph, powers: &Powers, rest: ExprId) -> ExprId {
    let mut factors: Vec<(ExprId, i32)> = powers.iter().map(|(x, n)| (*x, *n)).collect();
    factors.push((rest, 1));
    graph.product(Constant::ONE, &factors)
}

/// The powers that both have.
fn least(a: &Powers, b: &Powers) -> Powers {
    let of = |all: &Powers, x: &ExprId| all.get(x).copied().unwrap_or(0);
    let both: SortedSet<&ExprId> = a.keys().chain(b.keys()).collect();
    let least = both.into_iter().map(|x| (*x, of(a, x).min(of(b, x))));
    least.filter(|(_, n)| *n != 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimise::binarize::arrange;

    /// The parameters a, b, m and sine and cosine of two angles.
    fn leaves(graph: &mut Graph) -> ([ExprId; 3], [ExprId; 2], [ExprId; 2]) {
        let parameters = ["a", "b", "m"].map(|x| graph.input(Input::Parameter(x.to_owned())));
        let [first, second] = [0, 1].map(|k| {
            let angle = graph.input(Input::Coordinate(Affine::constant(k)));
            [Function::Sin, Function::Cos].map(|function| graph.call(function, &[angle]))
        });
        (parameters, first, second)
    }

    /// Operations without and with arms.
    fn costs(graph: &mut Graph, values: &[ExprId]) -> Option<(usize, usize)> {
        let plain = arrange(graph, values);
        let (arms, values) = ScaledTrig::of(graph, values)?;
        let roots: Vec<ExprId> = values.iter().copied().chain(arms.parts()).collect();
        let plan = arrange(graph, &roots);
        let plan = arms.written_out(plan, &values);
        // What stood for sines and cosines is gone.
        let stands = |id| matches!(plan.op(id), Op::Input(Input::Placeholder(..)));
        assert!(!plan.ids().any(stands));
        Some((plain.cost(), plan.cost()))
    }

    #[test]
    fn lengths_go_with_their_angles() {
        // m a b (c c' ± s s'), a s, a c, b s', b c': with the arms, 4 products and 6 operations, then 2 products with m.
        let mut g = Graph::default();
        let ([a, b, m], [s, c], [s2, c2]) = leaves(&mut g);
        let (cc, ss) = (g.multiply(c, c2), g.multiply(s, s2));
        let (sum, difference) = (g.add(cc, ss), g.subtract(cc, ss));
        let mut values = Vec::new();
        for x in [sum, difference] {
            values.push(g.product(Constant::ONE, &[(a, 1), (b, 1), (m, 1), (x, 1)]));
        }
        for (length, x) in [(a, s), (a, c), (b, s2), (b, c2)] {
            values.push(g.multiply(length, x));
        }
        let (plain, by_arms) = costs(&mut g, &values).expect("there are arms");
        assert!(by_arms < plain, "{by_arms} {plain}");
    }

    #[test]
    fn a_sine_without_a_length_has_no_arm() {
        let mut g = Graph::default();
        let ([a, ..], [s, c], _) = leaves(&mut g);
        let values = [g.multiply(a, c), s];
        assert!(ScaledTrig::of(&mut g, &values).is_none());
        let one = g.integer(1);
        let (product, inside) = (g.multiply(a, s), g.add(c, one));
        let values = [g.multiply(a, inside), product];
        assert!(ScaledTrig::of(&mut g, &values).is_none());
    }

    #[test]
    fn other_sines_stay() {
        let mut g = Graph::default();
        let ([a, b, ..], [s, _], [s2, _]) = leaves(&mut g);
        let long = g.product(Constant::ONE, &[(a, 1), (b, 1), (s, 1), (s2, 1)]);
        let (_, values) = ScaledTrig::of(&mut g, &[long, s2]).expect("one sine has lengths");
        assert_eq!(values[1], s2);
        // a b sin becomes one input, beside the other sine.
        assert!(g.reachable(&values).contains(&s2) && !g.reachable(&values).contains(&s));
    }

    #[test]
    fn lengths_are_found_before_sums() {
        // a (s + m c) b: both terms have a and b beside their sine or cosine.
        let mut g = Graph::default();
        let ([a, b, m], [s, c], _) = leaves(&mut g);
        let mc = g.multiply(m, c);
        let sum = g.add(s, mc);
        let value = g.product(Constant::ONE, &[(a, 1), (b, 1), (sum, 1)]);
        assert!(ScaledTrig::of(&mut g, &[value]).is_some());
    }
}
