//! The choice of the angles that are computed; the others follow from them.
//!
//! Small angles come first. Each follows from those before it if that is cheaper than computing it, so that n angles
//! and all their differences need n pairs. Atoms that are not themselves angles of the program are tried as helpers:
//! the three angles a − b, b − c, a + b + c do not follow from each other, but they do from a, b, c.

use crate::expr::graph::ExprId;
use crate::expr::ordered::SortedMap;
use crate::expr::sorting::{sort, sort_by_key};
use crate::program::cost;

/// An angle, `Σ n x`: atoms in order, n ≠ 0, the first n positive. A constant is an atom like the others.
pub(crate) type Angle = Vec<(ExprId, i64)>;

/// The functions of an angle that are needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Need {
    pub(super) sine: bool,
    pub(super) cosine: bool,
}

/// How sine and cosine of an angle are computed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum How {
    /// From the argument.
    Direct,
    /// From first + second, or first − second.
    Sum {
        first: Angle,
        second: Angle,
        negative: bool,
    },
    /// From its half.
    Double(Angle),
}

/// The angles in an order in which each follows from those before it.
#[derive(Clone, Debug, Default)]
pub(super) struct Choice {
    steps: Vec<Step>,
    known: SortedMap<Angle, usize>,
    /// The angles with an atom, by that atom.
    with_atom: SortedMap<ExprId, Vec<usize>>,
}

#[derive(Clone, Debug)]
struct Step {
    angle: Angle,
    how: How,
    need: Need,
    /// Numbers cost nothing.
    free: bool,
}

/// The number of helpers that are tried one by one.
const MAX_TRIALS: usize = 24;

/// The number of known angles that are tried as part of another one.
const MAX_PARTS: usize = 64;

const BOTH: Need = Need {
    sine: true,
    cosine: true,
};

impl Need {
    fn count(self) -> usize {
        usize::from(self.sine) + usize::from(self.cosine)
    }
}

/// A choice of low cost.
pub(super) fn choose(
    wanted: &SortedMap<Angle, Need>,
    is_number: &dyn Fn(ExprId) -> bool,
) -> Choice {
    let mut helpers: SortedMap<Angle, bool> = SortedMap::new();
    let mut numbers: Vec<Angle> = Vec::new();
    for (x, _) in wanted.keys().filter(|angle| angle.len() > 1).flatten() {
        let atom = vec![(*x, 1)];
        if is_number(*x) {
            numbers.push(atom);
        } else if wanted.get(&atom) != Some(&BOTH) {
            helpers.insert(atom, false);
        }
    }
    sort(&mut numbers);
    numbers.dedup();
    let mut order: Vec<(&Angle, Need)> =
        wanted.iter().map(|(angle, need)| (angle, *need)).collect();
    sort_by_key(&mut order, |(angle, _)| (size(angle), *angle));
    let attempt = |helpers: &SortedMap<Angle, bool>| Choice::with(&numbers, helpers, &order);
    let mut best = attempt(&helpers);
    if helpers.is_empty() {
        return best;
    }
    let all = helpers.keys().map(|atom| (atom.clone(), true)).collect();
    let trial = attempt(&all);
    if trial.cost() < best.cost() {
        (best, helpers) = (trial, all);
    }
    for atom in helpers.keys().take(MAX_TRIALS).cloned().collect::<Vec<_>>() {
        let mut other = helpers.clone();
        if let Some(used) = other.get_mut(&atom) {
            *used = !*used;
        }
        let trial = attempt(&other);
        if trial.cost() < best.cost() {
            (best, helpers) = (trial, other);
        }
    }
    best
}

/// The angle or its opposite, whichever begins with a positive coefficient; and whether it is the opposite.
pub(super) fn canonical(mut angle: Angle) -> (Angle, bool) {
    let negative = angle.first().is_some_and(|(_, n)| *n < 0);
    if negative {
        angle.iter_mut().for_each(|(_, n)| *n = -*n);
    }
    (angle, negative)
}

fn size(angle: &Angle) -> u64 {
    angle.iter().map(|(_, n)| n.unsigned_abs()).sum()
}

/// a + sign · b
fn plus(a: &Angle, sign: i64, b: &Angle) -> Angle {
    let mut parts: SortedMap<ExprId, i64> = a.iter().copied().collect();
    for (x, n) in b {
        *parts.get_or_default(*x) += sign * n;
    }
    parts.retain(|_, n| *n != 0);
    parts.into_iter().collect()
}

impl Choice {
    /// Whether each angle is computed from its argument.
    pub(super) fn follows_nothing(&self) -> bool {
        self.steps.iter().all(|step| step.how == How::Direct)
    }

    /// The angles, each after those it follows from.
    pub(super) fn steps(&self) -> impl Iterator<Item = (&Angle, &How)> {
        self.steps.iter().map(|step| (&step.angle, &step.how))
    }

    fn with(numbers: &[Angle], helpers: &SortedMap<Angle, bool>, order: &[(&Angle, Need)]) -> Self {
        let mut choice = Self::default();
        for number in numbers {
            choice.push(number.clone(), How::Direct, BOTH, true);
        }
        for (atom, _) in helpers.iter().filter(|(_, used)| *used) {
            choice.push(atom.clone(), How::Direct, BOTH, false);
        }
        for (angle, need) in order {
            choice.place(angle, *need);
        }
        choice
    }

    fn push(&mut self, angle: Angle, how: How, need: Need, free: bool) {
        let at = self.steps.len();
        for (x, _) in &angle {
            self.with_atom.get_or_default(*x).push(at);
        }
        self.known.insert(angle.clone(), at);
        self.steps.push(Step {
            angle,
            how,
            need,
            free,
        });
    }

    /// Adds an angle in the cheapest way found.
    fn place(&mut self, angle: &Angle, need: Need) {
        if let Some(at) = self.known.get(angle) {
            let known = &mut self.steps[*at].need;
            known.sine |= need.sine;
            known.cosine |= need.cosine;
            return;
        }
        let direct = How::Direct.cost(need);
        match self.route(angle) {
            Some(route) if self.price(&route, need) < direct => {
                let last = route.len() - 1;
                for (at, (angle, how)) in route.into_iter().enumerate() {
                    for part in how.parts() {
                        if let Some(part) = self.known.get(part) {
                            self.steps[*part].need = BOTH;
                        }
                    }
                    let need = if at == last { need } else { BOTH };
                    self.push(angle, how, need, false);
                }
            }
            _ => self.push(angle.clone(), How::Direct, need, false),
        }
    }

    /// Steps to an angle from known ones: known parts are split off, even angles are halved, until the rest follows.
    fn route(&self, angle: &Angle) -> Option<Vec<(Angle, How)>> {
        let mut route = Vec::new();
        let mut rest = angle.clone();
        while !self.known.contains_key(&rest) {
            if let Some(how) = self.two_parts(&rest) {
                route.push((rest, how));
                break;
            }
            if let Some(half) = half(&rest) {
                route.push((rest, How::Double(half.clone())));
                rest = half;
                continue;
            }
            let (part, sign) = rest.iter().find_map(|(x, n)| {
                let atom = vec![(*x, 1)];
                (rest.len() + n.unsigned_abs() as usize > 2 && self.known.contains_key(&atom))
                    .then_some((atom, n.signum()))
            })?;
            let (other, opposite) = canonical(plus(&rest, -sign, &part));
            // rest = ±other ± part, and one of the signs is positive, for rest begins with a positive coefficient.
            let how = match (opposite, sign < 0) {
                (false, negative) => How::Sum {
                    first: other.clone(),
                    second: part,
                    negative,
                },
                (true, false) => How::Sum {
                    first: part,
                    second: other.clone(),
                    negative: true,
                },
                (true, true) => return None,
            };
            route.push((rest, how));
            rest = other;
        }
        route.reverse();
        (!route.is_empty()).then_some(route)
    }

    /// The angle as a sum or difference of two known ones. An atom that is in both parts but not in the angle would
    /// contribute the rounding error of its sine to that of the angle: sin a is not computed from those of a + b and b.
    fn two_parts(&self, angle: &Angle) -> Option<How> {
        if let Some(half) = half(angle).filter(|half| self.known.contains_key(half)) {
            return Some(How::Double(half));
        }
        // One of the two parts has this atom, whichever atom it is: the one with the fewest angles is looked through.
        let empty: &[usize] = &[];
        let candidates = angle
            .iter()
            .map(|(x, _)| self.with_atom.get(x).map_or(empty, |found| found))
            .min_by_key(|found| found.len())?;
        for at in candidates.iter().take(MAX_PARTS) {
            let part = &self.steps[*at].angle;
            let fits = |other: &Angle| {
                size(part) + size(other) == size(angle) && self.known.contains_key(other)
            };
            let (other, opposite) = canonical(plus(angle, -1, part));
            if fits(&other) {
                return Some(How::Sum {
                    first: part.clone(),
                    second: other,
                    negative: opposite,
                });
            }
            let (other, opposite) = canonical(plus(angle, 1, part));
            if !opposite && fits(&other) {
                return Some(How::Sum {
                    first: other,
                    second: part.clone(),
                    negative: true,
                });
            }
        }
        None
    }

    /// What the steps cost, with what they further need of known angles.
    fn price(&self, route: &[(Angle, How)], need: Need) -> usize {
        let mut total = 0;
        let mut upgraded = Vec::new();
        for (at, (_, how)) in route.iter().enumerate() {
            let need = if at + 1 == route.len() { need } else { BOTH };
            total += how.cost(need);
            for part in how.parts() {
                if let Some(part) = self.known.get(part)
                    && !upgraded.contains(part)
                {
                    upgraded.push(*part);
                    let step = &self.steps[*part];
                    total += Step {
                        need: BOTH,
                        ..step.clone()
                    }
                    .cost()
                        - step.cost();
                }
            }
        }
        total
    }

    fn cost(&self) -> usize {
        self.steps.iter().map(Step::cost).sum()
    }
}

impl Step {
    fn cost(&self) -> usize {
        if self.free {
            0
        } else {
            self.how.cost(self.need)
        }
    }
}

impl How {
    fn parts(&self) -> Vec<&Angle> {
        match self {
            Self::Direct => Vec::new(),
            Self::Sum { first, second, .. } => vec![first, second],
            Self::Double(half) => vec![half],
        }
    }

    fn cost(&self, need: Need) -> usize {
        match self {
            Self::Direct if need == BOTH => cost::SINE_WITH_COSINE,
            Self::Direct => cost::LONE_SINE,
            Self::Sum { .. } => 3 * need.count(),
            Self::Double(_) => 2 * need.count(),
        }
    }
}

/// The half of an angle with even coefficients, none of them of a number (its half would be another number).
fn half(angle: &Angle) -> Option<Angle> {
    angle
        .iter()
        .map(|(x, n)| (n % 2 == 0).then_some((*x, n / 2)))
        .collect()
}
