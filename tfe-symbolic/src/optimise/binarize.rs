//! Converts sums and products of many operands to operations with two operands.
//!
//! It decides which operands are paired (see `cse.rs`), which powers become products, which divisors become
//! reciprocals, and where signs go. A sign is carried along with the value until a sum absorbs it, instead of costing a
//! negation.

mod demand;
mod family;
mod fractions;

use crate::expr::constant::{Constant, is_decimal};
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::sorting::sort_by_key;
use crate::optimise::cse::{Item, Kind, Operands, Pair};
use crate::optimise::plan::{Op, Plan, Value};
use demand::{Multiple, ONE, PositiveConstant, Terms, demanded, gather, multiple};
use family::{Family, Meaning};
use fractions::{Factors, Fractions, LARGEST_PRODUCT_POWER};

/// Arranges all operations that the roots need.
pub(crate) fn arrange(graph: &Graph, roots: &[ExprId]) -> Plan {
    Arranger::new(graph).run(roots)
}

/// A quotient of two products: sets of the family of products.
#[derive(Clone, Copy)]
struct Quotient {
    above: Option<usize>,
    below: Option<usize>,
}

struct Arranger<'a> {
    graph: &'a Graph,
    plan: Plan,
    sums: Family,
    products: Family,
    sum_sets: Map<Multiple, usize>,
    /// Sums that are evaluated in the given order.
    in_order: Map<Multiple, Terms>,
    quotients: Map<Multiple, Quotient>,
    fractions: Fractions,
    fraction_sets: Vec<Quotient>,
    built: Map<Multiple, Value>,
}

/// The products in which a divisor appears, with its exponents.
type Places = Vec<(Multiple, i32)>;

/// Divisors whose reciprocal is computed, each with those that always appear together with it (including itself).
type SharedDivisors = SortedMap<ExprId, Vec<ExprId>>;

impl<'a> Arranger<'a> {
    fn new(graph: &'a Graph) -> Self {
        Self {
            graph,
            plan: Plan::default(),
            sums: Family::new(Kind::Sum),
            products: Family::new(Kind::Product),
            sum_sets: Map::default(),
            in_order: Map::default(),
            quotients: Map::default(),
            fractions: Fractions::default(),
            fraction_sets: Vec::new(),
            built: Map::default(),
        }
    }

    fn run(mut self, roots: &[ExprId]) -> Plan {
        let demanded = demanded(self.graph, roots);
        let mut sums = gather(self.graph, &demanded);
        self.fractions = Fractions::of(self.graph, &demanded);
        self.collect_fractions();
        let shared = self.shared_divisors(&demanded);
        for multiple in &demanded {
            let (x, factor) = *multiple;
            match (self.graph.node(x), sums.remove(multiple)) {
                // Of two terms there is one order.
                (_, Some(sum)) if sum.count() > 2 && self.graph.keeps_order(x) => {
                    self.in_order.insert(*multiple, sum);
                }
                (_, Some(sum)) => self.collect_sum(*multiple, &sum),
                (Node::Product(_), _) => self.collect_product(*multiple, &shared),
                _ if factor != ONE => self.collect_product(*multiple, &shared),
                _ => {}
            }
        }
        self.sums.pair();
        self.products.pair();
        // Children before parents, and x before its multiples: everything needed is there.
        for multiple in &demanded {
            let value = self.build(*multiple);
            self.built.insert(*multiple, value);
        }
        for root in roots {
            let value = self.value(*root);
            self.plan.set_value(*root, value);
        }
        self.plan
    }

    fn value(&self, x: ExprId) -> Value {
        let (multiple, negative) = multiple(self.graph, Constant::ONE, x);
        let value = self.built[&multiple];
        Value {
            negative: value.negative != negative,
            op: value.op,
        }
    }

    /// Divisors of several products, and divisors in a loop in which they do not vary.
    fn shared_divisors(&self, demanded: &SortedSet<Multiple>) -> SharedDivisors {
        let mut places: SortedMap<ExprId, Places> = SortedMap::new();
        let mut outside: SortedSet<ExprId> = SortedSet::new();
        for multiple in demanded {
            let (_, factors) = self.fractions.rest(self.graph, multiple);
            for (x, n) in self.roots_below(&factors) {
                // A constant divisor stays a divisor: its reciprocal may not be exact.
                if n < 0 && self.graph.as_constant(x).is_none() {
                    places.get_or_default(x).push((*multiple, n));
                    if self.graph.loops_of(x) != self.graph.loops_of(multiple.0) {
                        outside.insert(x);
                    }
                }
            }
        }
        places.retain(|x, places| {
            (places.len() > 1 || outside.contains(x))
                && places
                    .iter()
                    .all(|(_, n)| n.unsigned_abs() <= LARGEST_PRODUCT_POWER)
        });
        // Divisors that always appear together need a single reciprocal.
        let mut together: SortedMap<(Places, u64), Vec<ExprId>> = SortedMap::new();
        for (x, places) in places {
            let key = (places, self.graph.loops_of(x));
            together.get_or_default(key).push(x);
        }
        let mut shared = SharedDivisors::new();
        for group in together.into_values() {
            for x in &group {
                shared.insert(*x, group.clone());
            }
        }
        shared
    }

    /// The factors with 1/(√x x) as (1/√x)³.
    fn roots_below(&self, factors: &[(ExprId, i32)]) -> Vec<(ExprId, i32)> {
        let mut factors = factors.to_vec();
        for at in 0..factors.len() {
            let (root, n) = factors[at];
            let Node::Call {
                function: Function::Sqrt,
                arguments,
            } = self.graph.node(root)
            else {
                continue;
            };
            let below = |(x, n): &(ExprId, i32)| Some(x) == arguments.first() && *n < 0;
            let Some(square) = factors.iter().position(below).filter(|_| n < 0) else {
                continue;
            };
            if let Some(total) = factors[square]
                .1
                .checked_mul(2)
                .and_then(|m| m.checked_add(n))
            {
                factors[at].1 = total;
                factors[square].1 = 0;
            }
        }
        factors.retain(|(_, n)| *n != 0);
        factors
    }

    fn collect_sum(&mut self, sum: Multiple, Terms { number, terms }: &Terms) {
        let mut operands = Operands::new();
        for (multiple, negative) in terms {
            let item = self.sums.item(
                Meaning::Multiple(*multiple),
                self.graph.loops_of(multiple.0),
            );
            operands.insert(item, if *negative { -1 } else { 1 });
        }
        if !number.is_zero() {
            let item = self.sums.item(Meaning::Number(number.abs()), 0);
            operands.insert(item, if number.is_negative() { -1 } else { 1 });
        }
        let set = self.sums.set(operands);
        self.sum_sets.insert(sum, set);
    }

    fn collect_fractions(&mut self) {
        let fractions = std::mem::take(&mut self.fractions);
        for fraction in &fractions.all {
            let mut set = |factors: &Factors| {
                let mut operands = Operands::new();
                for (x, n) in factors {
                    let loops = self.graph.loops_of(*x);
                    let item = self.products.item(Meaning::Multiple((*x, ONE)), loops);
                    operands.insert(item, *n);
                }
                (!operands.is_empty()).then(|| self.products.set(operands))
            };
            let quotient = Quotient {
                above: set(&fraction.above),
                below: set(&fraction.below),
            };
            self.fraction_sets.push(quotient);
        }
        self.fractions = fractions;
    }

    fn collect_product(&mut self, multiple: Multiple, shared: &SharedDivisors) {
        let (x, PositiveConstant(c)) = multiple;
        let (mut above, mut below) = (Operands::new(), Operands::new());
        // A third is computed as a division by three: the product with the rounded third would round twice.
        let divisor = c
            .as_ratio()
            .filter(|(top, bottom)| *top == 1 && !is_decimal(*bottom))
            .map(|(_, bottom)| bottom);
        match divisor.and_then(|divisor| Constant::rational(divisor, 1)) {
            Some(divisor) => {
                let item = self.products.item(Meaning::Number(divisor), 0);
                below.insert(item, 1);
            }
            None if c.is_one() => {}
            None => {
                let item = self.products.item(Meaning::Number(c), 0);
                above.insert(item, 1);
            }
        }
        let (fractions, factors) = self.fractions.rest(self.graph, &multiple);
        for fraction in fractions {
            let meaning = Meaning::Fraction(fraction);
            let class = self.graph.loops_of(x);
            above.insert(self.products.item(meaning, class), 1);
        }
        let merged = self.roots_below(&factors);
        let is_shared = |(x, n): &(ExprId, i32)| *n > 0 || shared.contains_key(x);
        let known = |factor: &&(ExprId, i32)| !factors.contains(*factor);
        // Merging pays only where the reciprocal of the root is computed.
        let factors = if merged.iter().filter(known).all(is_shared) {
            merged
        } else {
            factors
        };
        for &(x, n) in &factors {
            let (loops, size) = (self.graph.loops_of(x), n.unsigned_abs());
            // Groups are those of merged factors: others may lack one, or have another power of it.
            let stand_here =
                |group: &&Vec<ExprId>| group.iter().all(|y| factors.contains(&(*y, n)));
            let together = shared
                .get(&x)
                .filter(|_| n < 0 && size <= LARGEST_PRODUCT_POWER)
                .filter(stand_here);
            if together.is_some_and(|together| together[0] != x) {
                continue; // the reciprocal of the first covers it
            }
            let side = if n > 0 || together.is_some() {
                &mut above
            } else {
                &mut below
            };
            let (meaning, power) = match i32::try_from(size) {
                Ok(power) if size <= LARGEST_PRODUCT_POWER => {
                    let one = || Meaning::Multiple((x, ONE));
                    (
                        together.map_or_else(one, |together| Meaning::Reciprocal(together.clone())),
                        power,
                    )
                }
                power => (Meaning::LargePower(x, power.unwrap_or(i32::MAX)), 1),
            };
            let item = self.products.item(meaning, loops);
            side.insert(item, power);
        }
        let mut set =
            |operands: Operands| (!operands.is_empty()).then(|| self.products.set(operands));
        let quotient = Quotient {
            above: set(above),
            below: set(below),
        };
        self.quotients.insert(multiple, quotient);
    }

    fn build(&mut self, multiple: Multiple) -> Value {
        if let Some(quotient) = self.quotients.get(&multiple).copied() {
            return self.build_quotient(quotient);
        }
        let (x, _) = multiple;
        if let Some(set) = self.sum_sets.get(&multiple).copied() {
            return self.build_set(Kind::Sum, set);
        }
        if let Some(sum) = self.in_order.remove(&multiple) {
            return self.build_in_order(&sum);
        }
        let operand = |arranger: &mut Self, x: ExprId| {
            let value = arranger.value(x);
            arranger.plan.plain(value)
        };
        let op = match self.graph.node(x) {
            Node::Constant(value) if value.is_negative() => {
                let op = self.plan.push(Op::Constant(-*value));
                return Value { negative: true, op };
            }
            Node::Constant(value) => Op::Constant(*value),
            Node::Input(input) => Op::Input(input.clone()),
            Node::Power { base, exponent } => {
                Op::Power(operand(self, *base), operand(self, *exponent))
            }
            Node::Call {
                function,
                arguments,
            } => Op::Call(
                *function,
                arguments
                    .iter()
                    .map(|argument| operand(self, *argument))
                    .collect(),
            ),
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => Op::Select {
                comparison: *comparison,
                left: operand(self, *left),
                right: operand(self, *right),
                then: operand(self, *then),
                otherwise: operand(self, *otherwise),
            },
            Node::Loop { range, body } => {
                let value = self.value(*body);
                let op = self.plan.push(Op::Loop {
                    range: range.clone(),
                    body: value.op,
                });
                return Value {
                    negative: value.negative,
                    op,
                };
            }
            Node::Sum { .. } | Node::Product(_) => Op::Constant(Constant::ZERO), // collected before
        };
        Value {
            negative: false,
            op: self.plan.push(op),
        }
    }

    fn build_quotient(&mut self, Quotient { above, below }: Quotient) -> Value {
        let top = match above {
            Some(set) => self.build_set(Kind::Product, set),
            None => Value {
                negative: false,
                op: self.plan.push(Op::Constant(Constant::ONE)),
            },
        };
        let Some(set) = below else { return top };
        let bottom = self.build_set(Kind::Product, set);
        Value {
            negative: top.negative != bottom.negative,
            op: self.plan.push(Op::Divide(top.op, bottom.op)),
        }
    }

    /// A sum that keeps its order, group by group.
    fn build_in_order(&mut self, Terms { number, terms }: &Terms) -> Value {
        let mut groups: SortedMap<usize, Vec<Value>> = SortedMap::new();
        for (multiple, negative) in terms {
            let value = self.built[multiple];
            let value = Value {
                negative: value.negative != *negative,
                op: value.op,
            };
            let group = self.graph.group_of_term(multiple.0);
            groups.get_or_default(group).push(value);
        }
        let mut sums: Vec<Value> = groups
            .into_values()
            .map(|values| self.fold(Kind::Sum, &values))
            .collect();
        if !number.is_zero() {
            let op = self.plan.push(Op::Constant(number.abs()));
            sums.push(Value {
                negative: number.is_negative(),
                op,
            });
        }
        self.fold(Kind::Sum, &sums)
    }

    fn family(&mut self, kind: Kind) -> &mut Family {
        match kind {
            Kind::Sum => &mut self.sums,
            Kind::Product => &mut self.products,
        }
    }

    /// The value of a set, outer loops first. Groups and pairs nest at most a few hundred deep, because longer sets are not paired.
    fn build_set(&mut self, kind: Kind, set: usize) -> Value {
        if let Some(value) = self.family(kind).built_sets[set] {
            return value;
        }
        let operands = self.family(kind).sets[set].clone();
        let mut values = Vec::with_capacity(operands.len());
        for (item, power) in operands {
            let value = self.build_item(kind, item);
            match kind {
                Kind::Sum => values.push(Value {
                    negative: value.negative != (power < 0),
                    op: value.op,
                }),
                Kind::Product => values.push(self.build_power(value, power)),
            }
        }
        sort_by_key(&mut values, |value| {
            self.plan.loops_of(value.op).count_ones()
        });
        let value = self.fold(kind, &values);
        self.family(kind).built_sets[set] = Some(value);
        value
    }

    fn fold(&mut self, kind: Kind, values: &[Value]) -> Value {
        let mut rest = values.iter().copied();
        let Some(mut total) = rest.next() else {
            return Value {
                negative: false,
                op: self.plan.push(Op::Constant(Constant::ONE)),
            };
        };
        for value in rest {
            total = match kind {
                Kind::Sum => self.plan.add(total, value),
                Kind::Product => self.plan.multiply(total, value),
            };
        }
        total
    }

    fn build_power(&mut self, base: Value, power: i32) -> Value {
        let mut total = base;
        for _ in 1..power {
            total = self.plan.multiply(total, base);
        }
        total
    }

    fn build_item(&mut self, kind: Kind, item: Item) -> Value {
        let family = self.family(kind);
        let at = item as usize;
        if let Some(pair) = at.checked_sub(family.meanings.len()) {
            if let Some(value) = family.built_pairs[pair] {
                return value;
            }
            let Pair {
                first,
                second,
                sign,
            } = family.pairs[pair];
            let (first, mut second) = (self.build_item(kind, first), self.build_item(kind, second));
            second.negative ^= sign < 0;
            let value = self.fold(kind, &[first, second]);
            self.family(kind).built_pairs[pair] = Some(value);
            return value;
        }
        let positive = |op| Value {
            negative: false,
            op,
        };
        match family.meanings[at].clone() {
            Meaning::Multiple(multiple) => match kind {
                Kind::Sum => self.built[&multiple],
                // A factor may be a multiple.
                Kind::Product => self.value(multiple.0),
            },
            Meaning::Number(value) => positive(self.plan.push(Op::Constant(value))),
            Meaning::Group(set) => self.build_set(kind, set),
            Meaning::Fraction(fraction) => self.build_quotient(self.fraction_sets[fraction]),
            Meaning::Reciprocal(divisors) => {
                let below: Vec<Value> = divisors.into_iter().map(|x| self.value(x)).collect();
                let below = self.fold(Kind::Product, &below);
                let one = self.plan.push(Op::Constant(Constant::ONE));
                Value {
                    negative: below.negative,
                    op: self.plan.push(Op::Divide(one, below.op)),
                }
            }
            Meaning::LargePower(x, n) => {
                let base = self.value(x);
                let negative = base.negative && n % 2 != 0;
                Value {
                    negative,
                    op: self.plan.push(Op::IntegerPower(base.op, n)),
                }
            }
        }
    }
}
