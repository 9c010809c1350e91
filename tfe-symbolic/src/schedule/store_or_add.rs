//! Which results are stored, and which are added to what is already there.
//!
//! The first write to a place is a store; later writes add. If the first write is another one on other turns, zeros are
//! stored at the beginning. Where loops have literal ranges, this is found by running through their turns; elsewhere it
//! needs a proof (`apart.rs` beside this file), or the array is cleared.

mod apart;

use crate::expr::graph::{ExprId, SumRange};
use crate::expr::hash::Set;
use crate::expr::input::{Affine, IndexSymbol, LoopVariable};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::program::{Array, Place};
use crate::schedule::loop_nest::{Block, Sink, Target};
use apart::all_apart;

/// The largest number of writes that are run through.
const MAX_WRITES: usize = 100_000;

/// An array with more places to be set to zero is cleared as a whole.
const MAX_ZEROS: usize = 32;

/// Decides for each result, and inserts zeros in front where they are needed; returns the arrays that have to be
/// cleared.
pub(crate) fn settle(root: &mut Block, zero: ExprId) -> SortedSet<Array> {
    let mut writers = Vec::new();
    let steps = steps(root, &mut Vec::new(), &mut writers);
    let mut turns = Turns {
        writers,
        ..Turns::default()
    };
    turns.run(&steps, &mut Vec::new());
    let mut cleared = turns.unknown;
    let mut zeros: SortedMap<Array, Vec<Place>> = SortedMap::new();
    for writer in &mut turns.writers {
        let array = writer.place.array;
        if cleared.contains(&array) {
            writer.adds = true;
        } else if writer.adds {
            let place = |(row, column): &(i64, i64)| Place {
                array,
                row: Affine::constant(*row),
                column: Affine::constant(*column),
            };
            let first = writer.first.iter().map(place);
            zeros.get_or_default(array).extend(first);
        }
    }
    cleared.retain(|array| {
        let own = |writer: &&mut Writer| writer.place.array == *array;
        let mut own: Vec<&mut Writer> = turns.writers.iter_mut().filter(own).collect();
        let apart = all_apart(
            &own.iter()
                .map(|w| (&w.nest[..], &w.place))
                .collect::<Vec<_>>(),
        );
        own.iter_mut().for_each(|writer| writer.adds = !apart);
        !apart
    });
    let mut front = Vec::new();
    for (array, places) in zeros {
        if places.len() > MAX_ZEROS {
            cleared.insert(array);
        } else {
            let stores = places.into_iter();
            front.extend(stores.map(|place| Sink::store(place, None, Some(zero))));
        }
    }
    let mut decided = turns.writers.iter();
    for_each_store(root, &mut |accumulate| {
        *accumulate = decided.next().is_some_and(|writer| writer.adds);
    });
    root.sinks.splice(0..0, front);
    cleared
}

/// The writes of a program, in order; each is the number of a writer.
enum Step {
    Write(usize),
    Loop(SumRange, Vec<Self>),
}

/// A result that is stored or added, on every turn of a nest of loops.
struct Writer {
    nest: Vec<SumRange>,
    place: Place,
    /// The places to which nothing has been written before.
    first: Vec<(i64, i64)>,
    /// Whether there are others.
    adds: bool,
}

fn steps(block: &Block, nest: &mut Vec<SumRange>, writers: &mut Vec<Writer>) -> Vec<Step> {
    let mut found = Vec::new();
    let write = |sinks: &[Sink], nest: &[SumRange], writers: &mut Vec<Writer>| {
        let mut steps = Vec::new();
        for place in sinks.iter().filter_map(Sink::place) {
            steps.push(Step::Write(writers.len()));
            writers.push(Writer {
                nest: nest.to_vec(),
                place: place.clone(),
                first: Vec::new(),
                adds: false,
            });
        }
        steps
    };
    found.extend(write(&block.sinks, nest, writers));
    for (range, inner) in &block.inner {
        nest.push(range.clone());
        found.push(Step::Loop(range.clone(), steps(inner, nest, writers)));
        nest.pop();
    }
    found.extend(write(&block.after, nest, writers));
    found
}

/// In the order of [`steps`].
fn for_each_store(block: &mut Block, visit: &mut dyn FnMut(&mut bool)) {
    let stores = |sinks: &mut Vec<Sink>, visit: &mut dyn FnMut(&mut bool)| {
        for sink in sinks {
            if let Target::Store { accumulate, .. } = &mut sink.target {
                visit(accumulate);
            }
        }
    };
    stores(&mut block.sinks, visit);
    for (_, inner) in &mut block.inner {
        for_each_store(inner, visit);
    }
    stores(&mut block.after, visit);
}

/// A run through all turns of all loops.
#[derive(Default)]
struct Turns {
    writers: Vec<Writer>,
    written: Set<(Array, i64, i64)>,
    writes: usize,
    /// Arrays of which not all is known.
    unknown: SortedSet<Array>,
}

/// The values of loop variables.
type Values = Vec<(LoopVariable, i64)>;

impl Turns {
    /// Recursion is as deep as the loops nest.
    fn run(&mut self, steps: &[Step], values: &mut Values) {
        for step in steps {
            match step {
                Step::Write(number) => self.write(*number, values),
                Step::Loop(range, inner) => {
                    let bounds = value(&range.start, values).zip(value(&range.end, values));
                    let Some((start, end)) = bounds.filter(|_| self.writes < MAX_WRITES) else {
                        self.unknown_in(inner);
                        continue;
                    };
                    for turn in start..end {
                        self.writes += 1;
                        if self.writes > MAX_WRITES {
                            self.unknown_in(inner);
                            break;
                        }
                        values.push((range.variable, turn));
                        self.run(inner, values);
                        values.pop();
                    }
                }
            }
        }
    }

    fn write(&mut self, number: usize, values: &Values) {
        self.writes += 1;
        let writer = &mut self.writers[number];
        let array = writer.place.array;
        let row = value(&writer.place.row, values);
        match row.zip(value(&writer.place.column, values)) {
            Some((row, column)) if self.written.insert((array, row, column)) => {
                writer.first.push((row, column));
            }
            Some(_) => writer.adds = true,
            None => {
                self.unknown.insert(array);
            }
        }
    }

    fn unknown_in(&mut self, steps: &[Step]) {
        for step in steps {
            match step {
                Step::Write(number) => {
                    self.unknown.insert(self.writers[*number].place.array);
                }
                Step::Loop(_, inner) => self.unknown_in(inner),
            }
        }
    }
}

/// An index, or nothing if it is fixed at run time only.
fn value(affine: &Affine, values: &Values) -> Option<i64> {
    let mut total = affine.constant;
    for (symbol, factor) in &affine.terms {
        let variable = match symbol {
            IndexSymbol::Loop(variable) => variable,
            IndexSymbol::Within(_) => continue,
            _ => return None,
        };
        let (_, value) = values.iter().rev().find(|(known, _)| known == variable)?;
        total = total.checked_add(value.checked_mul(*factor)?)?;
    }
    Some(total)
}
