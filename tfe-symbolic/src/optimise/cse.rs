//! Greedy common subexpression elimination in sums and products: which two operands are worth computing once.
//!
//! In sums and products of many operands it is open which are added or multiplied first. The pair that saves most
//! operations over all of them becomes an operand of its own, repeatedly, as long as a pair saves anything.

use crate::expr::hash::Map;
use crate::expr::ordered::SortedMap;
use crate::expr::sorting::sort;
use std::collections::BinaryHeap;

/// An operand: an index chosen by the caller, or of a pair made here.
pub(crate) type Item = u32;

/// The meaning of the numbers attached to operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Signs, ±1.
    Sum,
    /// Exponents, 1 or more.
    Product,
}

/// Operands with their signs or exponents.
pub(crate) type Operands = SortedMap<Item, i32>;

/// `first + sign · second`, or `first · second` (then `sign` is 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Pair {
    pub(crate) first: Item,
    pub(crate) second: Item,
    pub(crate) sign: i32,
}

/// Longer sums and products are left unchanged: they would have too many pairs.
const LONGEST: usize = 400;

/// Rewrites the sets so that worthwhile pairs are operands; pair number k is the operand `first_pair + k`.
pub(crate) fn extract(kind: Kind, sets: &mut [Operands], first_pair: Item) -> Vec<Pair> {
    let mut search = Search {
        kind,
        sets: sets.iter().map(Operand::of).collect(),
        places: Map::default(),
        queue: BinaryHeap::new(),
        made: Vec::new(),
        first_pair,
    };
    search.run();
    for (set, found) in sets.iter_mut().zip(search.sets) {
        if found.changed {
            *set = found.items.into_iter().collect();
        }
    }
    search.made
}

/// A candidate with the saving that it had when it was queued; the earliest pair first among equals.
type Candidate = (i32, std::cmp::Reverse<Pair>);

/// One of the sets while it is searched.
struct Operand {
    /// In ascending order.
    items: Vec<(Item, i32)>,
    /// The sum of all sizes of signs or exponents.
    size: i32,
    changed: bool,
}

impl Operand {
    fn of(operands: &Operands) -> Self {
        Self {
            items: operands.iter().map(|(item, n)| (*item, *n)).collect(),
            size: operands.values().map(|n| n.abs()).sum(),
            changed: false,
        }
    }

    /// The sign or exponent; zero of what is not there.
    fn get(&self, item: Item) -> i32 {
        match self.items.binary_search_by_key(&item, |(item, _)| *item) {
            Ok(at) => self.items[at].1,
            Err(_) => 0,
        }
    }

    /// Sets the sign or exponent, to zero where it is to go.
    fn set(&mut self, item: Item, n: i32) {
        self.changed = true;
        match self.items.binary_search_by_key(&item, |(item, _)| *item) {
            Ok(at) => {
                self.size += n.abs() - self.items[at].1.abs();
                if n == 0 {
                    self.items.remove(at);
                } else {
                    self.items[at].1 = n;
                }
            }
            Err(at) if n != 0 => {
                self.size += n.abs();
                self.items.insert(at, (item, n));
            }
            Err(_) => {}
        }
    }
}

struct Search {
    kind: Kind,
    sets: Vec<Operand>,
    /// Where a pair may occur: complete, but not always up to date.
    places: Map<Pair, Vec<usize>>,
    queue: BinaryHeap<Candidate>,
    made: Vec<Pair>,
    first_pair: Item,
}

impl Search {
    fn run(&mut self) {
        let mut candidates = Vec::new();
        for set in 0..self.sets.len() {
            let items = self.sets[set].items.clone();
            if items.len() > LONGEST {
                continue;
            }
            for (at, first) in items.iter().enumerate() {
                for second in &items[at..] {
                    candidates.extend(self.note(set, *first, *second));
                }
            }
        }
        self.enqueue(candidates);
        while let Some((saving, std::cmp::Reverse(pair))) = self.queue.pop() {
            let now = self.saving(pair);
            if now < saving {
                if now > 0 {
                    self.queue.push((now, std::cmp::Reverse(pair)));
                }
                continue;
            }
            self.apply(pair);
        }
    }

    /// Records that two operands of a set are a pair, and returns the pair if it may now save something: because it is
    /// in a second set, or twice in this one.
    fn note(&mut self, set: usize, first: (Item, i32), second: (Item, i32)) -> Option<Pair> {
        let ((first, a), (second, b)) = (first.min(second), first.max(second));
        let (sign, twice) = match self.kind {
            Kind::Product if first == second => (1, a >= 4),
            Kind::Product => (1, a.min(b) >= 2),
            Kind::Sum if first == second => return None,
            Kind::Sum => (a * b, false),
        };
        let pair = Pair {
            first,
            second,
            sign,
        };
        let places = self.places.entry(pair).or_default();
        if places.last() == Some(&set) {
            return twice.then_some(pair);
        }
        places.push(set);
        // A pair in more sets has been given before.
        (twice || places.len() == 2).then_some(pair)
    }

    fn enqueue(&mut self, mut candidates: Vec<Pair>) {
        sort(&mut candidates);
        candidates.dedup();
        for pair in candidates {
            let saving = self.saving(pair);
            if saving > 0 {
                self.queue.push((saving, std::cmp::Reverse(pair)));
            }
        }
    }

    /// How often the pair can be taken out of a set.
    fn occurrences(&self, set: usize, pair: Pair) -> i32 {
        let set = &self.sets[set];
        let first = set.get(pair.first);
        if first == 0 {
            return 0;
        }
        match self.kind {
            Kind::Sum => i32::from(first * set.get(pair.second) == pair.sign),
            Kind::Product if pair.first == pair.second => first / 2,
            Kind::Product => first.min(set.get(pair.second)),
        }
    }

    /// Twice the operations saved, plus one if the pair is wanted by itself anyway; 0 if nothing is saved.
    fn saving(&self, pair: Pair) -> i32 {
        let Some(places) = self.places.get(&pair) else {
            return 0;
        };
        let (mut total, mut complete) = (-1, 0);
        for set in places {
            let count = self.occurrences(*set, pair);
            total += count;
            if count == 1 && self.sets[*set].size == 2 {
                complete = 1;
            }
        }
        if total > 0 { 2 * total + complete } else { 0 }
    }

    fn apply(&mut self, pair: Pair) {
        let item = self.first_pair + self.made.len() as Item;
        self.made.push(pair);
        let mut candidates = Vec::new();
        for at in self.places.remove(&pair).unwrap_or_default() {
            let count = self.occurrences(at, pair);
            if count == 0 {
                continue;
            }
            let set = &mut self.sets[at];
            let own = match self.kind {
                Kind::Sum => {
                    let sign = set.get(pair.first);
                    set.set(pair.first, 0);
                    set.set(pair.second, 0);
                    sign
                }
                Kind::Product => {
                    for part in [pair.first, pair.second] {
                        set.set(part, (set.get(part) - count).max(0));
                    }
                    count
                }
            };
            set.set(item, own);
            for other in set.items.clone() {
                candidates.extend(self.note(at, (item, own), other));
            }
        }
        self.enqueue(candidates);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(items: &[(Item, i32)]) -> Operands {
        items.iter().copied().collect()
    }

    #[test]
    fn a_wanted_product_is_reused_inside_longer_ones() {
        // abc, ab, bc, abd, bd: with ab and bd shared, five products instead of eight.
        let mut sets = [
            set(&[(0, 1), (1, 1), (2, 1)]),
            set(&[(0, 1), (1, 1)]),
            set(&[(1, 1), (2, 1)]),
            set(&[(0, 1), (1, 1), (3, 1)]),
            set(&[(1, 1), (3, 1)]),
        ];
        let pairs = extract(Kind::Product, &mut sets, 10);
        let rest: usize = sets.iter().map(|set| set.len() - 1).sum();
        assert_eq!(pairs.len() + rest, 5);
    }

    #[test]
    fn powers_are_squared() {
        // x^8 in three products.
        let mut sets = [set(&[(0, 8)])];
        assert_eq!(extract(Kind::Product, &mut sets, 1).len(), 2);
        assert_eq!(sets[0], set(&[(2, 2)]));
    }

    #[test]
    fn differences_are_shared_up_to_their_sign() {
        // a − b + c and b − a + d
        let mut sets = [
            set(&[(0, 1), (1, -1), (2, 1)]),
            set(&[(0, -1), (1, 1), (3, 1)]),
        ];
        let pairs = extract(Kind::Sum, &mut sets, 10);
        assert_eq!(
            pairs,
            [Pair {
                first: 0,
                second: 1,
                sign: -1
            }]
        );
        assert_eq!(sets, [set(&[(2, 1), (10, 1)]), set(&[(3, 1), (10, -1)])]);
    }
}
