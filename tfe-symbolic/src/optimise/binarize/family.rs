//! Sums, or products, that share operands.

use super::demand::Multiple;
use crate::expr::constant::Constant;
use crate::expr::graph::ExprId;
use crate::expr::hash::Map;
use crate::expr::ordered::SortedMap;
use crate::optimise::cse::{self, Item, Kind, Operands, Pair};
use crate::optimise::plan::Value;

/// What an operand stands for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Meaning {
    /// A multiple of an expression (of a product in sums, of an atom, with factor 1, in products).
    Multiple(Multiple),
    Number(Constant),
    /// 1 / Π x
    Reciprocal(Vec<ExprId>),
    /// xⁿ for large n
    LargePower(ExprId, i32),
    /// A fraction that several products have.
    Fraction(usize),
    /// A group of operands that vary in fewer loops than the whole.
    Group(usize),
}

/// Sums, or products, with the operands they share.
pub(super) struct Family {
    kind: Kind,
    pub(super) meanings: Vec<Meaning>,
    items: Map<Meaning, Item>,
    loops: Vec<u64>,
    pub(super) sets: Vec<Operands>,
    known: Map<Vec<(Item, i32)>, usize>,
    pub(super) pairs: Vec<Pair>,
    /// Of pairs and of sets, once they are built.
    pub(super) built_pairs: Vec<Option<Value>>,
    pub(super) built_sets: Vec<Option<Value>>,
}

impl Family {
    pub(super) fn new(kind: Kind) -> Self {
        Self {
            kind,
            meanings: Vec::new(),
            items: Map::default(),
            loops: Vec::new(),
            sets: Vec::new(),
            known: Map::default(),
            pairs: Vec::new(),
            built_pairs: Vec::new(),
            built_sets: Vec::new(),
        }
    }

    pub(super) fn item(&mut self, meaning: Meaning, loops: u64) -> Item {
        if let Some(item) = self.items.get(&meaning) {
            return *item;
        }
        let item = self.meanings.len() as Item;
        self.meanings.push(meaning.clone());
        self.loops.push(loops);
        self.items.insert(meaning, item);
        item
    }

    /// The set of these operands; those that vary in fewer loops than the rest are grouped, so that the group can be
    /// computed outside these loops.
    pub(super) fn set(&mut self, operands: Operands) -> usize {
        let whole = operands
            .keys()
            .fold(0, |mask, item| mask | self.loops[*item as usize]);
        let mut classes: SortedMap<u64, Operands> = SortedMap::new();
        for (item, power) in &operands {
            classes
                .get_or_default(self.loops[*item as usize])
                .insert(*item, *power);
        }
        let mut grouped = Operands::new();
        // Outer ones first: what varies in no loop goes with what varies in one.
        let mut outer = (0, Operands::new());
        for (loops, class) in classes {
            if loops == whole {
                grouped.extend(class);
            } else if outer.0 & !loops == 0 {
                let (inside, class_inside) = outer;
                let mut class = class;
                self.put_together(class_inside, inside, &mut class);
                outer = (loops, class);
            } else {
                self.put_together(class, loops, &mut grouped);
            }
        }
        self.put_together(outer.1, outer.0, &mut grouped);
        self.intern(grouped)
    }

    /// Adds operands to others, several of them as one.
    fn put_together(&mut self, class: Operands, loops: u64, whole: &mut Operands) {
        if class.len() < 2 {
            whole.extend(class);
        } else {
            let set = self.intern(class);
            let item = self.item(Meaning::Group(set), loops);
            whole.insert(item, 1);
        }
    }

    fn intern(&mut self, operands: Operands) -> usize {
        let key: Vec<_> = operands
            .iter()
            .map(|(item, power)| (*item, *power))
            .collect();
        if let Some(set) = self.known.get(&key) {
            return *set;
        }
        self.sets.push(operands);
        self.known.insert(key, self.sets.len() - 1);
        self.sets.len() - 1
    }

    pub(super) fn pair(&mut self) {
        let first = self.meanings.len() as Item;
        self.pairs = cse::extract(self.kind, &mut self.sets, first);
        self.built_pairs = vec![None; self.pairs.len()];
        self.built_sets = vec![None; self.sets.len()];
    }
}
