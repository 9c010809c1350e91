//! Long kernels in parts, each of which is a function of its own.
//!
//! Values that one part computes and a later one reads are stored in an array, `kept`, whose places are reused as soon
//! as they are free.

use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::expr::sorting::{sort, sort_by_key};
use tfe_symbolic::program::{Array, Operand, Statement, Temporary};

/// Kernels with more statements are emitted in parts.
///
/// Tuned on serial arms in space of 1 to 12 links, whose longest kernels have 7 to 30 000 statements. Each `let` opens
/// a scope within the one before, through which the compiler recurses in `dev`: with some 3000 statements its stack
/// overflows. Twice as many statements are still compiled in the same time.
pub(crate) const LONG_KERNEL: usize = 600;

/// The number of statements in a part.
///
/// Tuned on the same arms. With twice as many, optimisation takes longer and nothing is faster; with half as many, more
/// values have to be stored.
const MAX_PART: usize = 300;

/// A part of a kernel.
pub(crate) struct Part {
    /// What it does.
    pub(crate) statements: Vec<Statement>,
    /// Values of earlier parts that it reads, with their places in `kept`.
    pub(crate) reads: Vec<(Temporary, usize)>,
    /// Values of its own that later parts read, with their places.
    pub(crate) keeps: SortedMap<Temporary, usize>,
}

/// A kernel in parts.
pub(crate) struct Parts {
    /// In order.
    pub(crate) parts: Vec<Part>,
    /// The largest number of values stored at a time.
    pub(crate) kept: usize,
    /// The value of the energy function, if it was requested, and its place if a part has computed it.
    pub(crate) value: Option<(Operand, Option<usize>)>,
}

impl Parts {
    /// The parts of a long kernel; `None` for a short one.
    pub(crate) fn of(statements: &[Statement]) -> Option<Self> {
        if length(statements) <= LONG_KERNEL {
            return None;
        }
        let (mut rest, mut value) = (Vec::with_capacity(statements.len()), None);
        for statement in statements {
            match statement {
                Statement::Store {
                    output,
                    value: operand,
                    ..
                } if output.array == Array::Value => value = Some(operand.clone()),
                other => rest.push(other.clone()),
            }
        }
        let pieces = cut(rest);
        let lives = lives(&pieces, value.as_ref());
        let (places, kept) = places(&lives);
        let place = |temporary: &Temporary| places.get(temporary).map(|at| (*temporary, *at));
        let parts = pieces.into_iter().enumerate().map(|(number, statements)| {
            let mut read = Vec::new();
            for_each_read(&statements, &mut |temporary| read.push(temporary));
            sort(&mut read);
            read.dedup();
            let of_earlier = |temporary: &Temporary| lives[temporary].0 < number;
            let reads = read.iter().filter(|temporary| of_earlier(temporary));
            let keeps = lives
                .iter()
                .filter(|(_, (first, last))| *first == number && first < last);
            Part {
                reads: reads.filter_map(place).collect(),
                keeps: keeps
                    .filter_map(|(temporary, _)| place(temporary))
                    .collect(),
                statements,
            }
        });
        Some(Self {
            parts: parts.collect(),
            kept,
            value: value.map(|operand| {
                let at = match &operand {
                    Operand::Temporary(temporary) => places.get(temporary).copied(),
                    _ => None,
                };
                (operand, at)
            }),
        })
    }
}

/// The number of statements, with those in loops.
fn length(statements: &[Statement]) -> usize {
    let inside = statements.iter().map(|statement| match statement {
        Statement::Loop { body, .. } => length(body),
        _ => 0,
    });
    statements.len() + inside.sum::<usize>()
}

/// Divides the statements where a part is full. Running sums stay with the loops that add to them.
fn cut(statements: Vec<Statement>) -> Vec<Vec<Statement>> {
    let mut changed = SortedMap::new();
    for (at, statement) in statements.iter().enumerate() {
        for_each_change(statement, &mut |temporary| {
            changed.insert(temporary, at);
        });
    }
    let (mut pieces, mut piece, mut full, mut open) = (Vec::new(), Vec::new(), 0, 0);
    for (at, statement) in statements.into_iter().enumerate() {
        if let Statement::Accumulator { target, .. } = &statement {
            open = open.max(changed.get(target).copied().unwrap_or(0));
        }
        full += length(std::slice::from_ref(&statement));
        piece.push(statement);
        if full >= MAX_PART && open <= at {
            pieces.push(std::mem::take(&mut piece));
            full = 0;
        }
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// For each value the part that defines it and the last one that reads it; the energy function is read after the last
/// part.
fn lives(
    pieces: &[Vec<Statement>],
    value: Option<&Operand>,
) -> SortedMap<Temporary, (usize, usize)> {
    let mut lives = SortedMap::new();
    for (number, statements) in pieces.iter().enumerate() {
        for statement in statements {
            for target in defined(statement) {
                lives.insert(target, (number, number));
            }
        }
        for_each_read(statements, &mut |temporary| {
            lives.get_or_insert(temporary, (number, number)).1 = number;
        });
    }
    if let Some(Operand::Temporary(temporary)) = value
        && let Some(life) = lives.get_mut(temporary)
    {
        life.1 = pieces.len();
    }
    lives
}

/// A place for each value that is read in later parts, and the number of places.
fn places(lives: &SortedMap<Temporary, (usize, usize)>) -> (SortedMap<Temporary, usize>, usize) {
    let mut kept: Vec<_> = lives
        .iter()
        .filter(|(_, (first, last))| first < last)
        .collect();
    sort_by_key(&mut kept, |(temporary, (first, _))| (*first, *temporary));
    // The last reader of each place. A part reads before it stores, so that places it reads last are free for its own
    // values.
    let (mut places, mut ends): (SortedMap<Temporary, usize>, SortedMap<usize, Vec<usize>>) =
        Default::default();
    let (mut free, mut used) = (Vec::new(), 0);
    for (temporary, (first, last)) in kept {
        while let Some(&(end, _)) = ends.iter().next()
            && end <= *first
        {
            free.extend(ends.remove(&end).unwrap_or_default());
        }
        let at = free.pop().unwrap_or_else(|| {
            used += 1;
            used - 1
        });
        places.insert(*temporary, at);
        ends.get_or_default(*last).push(at);
    }
    (places, used)
}

/// The values that begin with a statement of a kernel itself; those of its loops are read nowhere else.
fn defined(statement: &Statement) -> Vec<Temporary> {
    match statement {
        Statement::Let { target, .. } | Statement::Accumulator { target, .. } => vec![*target],
        Statement::SineCosine { sine, cosine, .. } => vec![*sine, *cosine],
        Statement::Loop { body, .. } => body.iter().flat_map(defined).collect(),
        _ => Vec::new(),
    }
}

fn for_each_read(statements: &[Statement], note: &mut impl FnMut(Temporary)) {
    for statement in statements {
        for operand in statement.operands() {
            if let Operand::Temporary(temporary) = operand {
                note(*temporary);
            }
        }
        // What is added to is read.
        if let Statement::Accumulate { target, .. } = statement {
            note(*target);
        }
        if let Statement::Loop { body, .. } = statement {
            for_each_read(body, note);
        }
    }
}

/// The running sums that a statement changes.
fn for_each_change(statement: &Statement, note: &mut impl FnMut(Temporary)) {
    match statement {
        Statement::Accumulate { target, .. } | Statement::Assign { target, .. } => note(*target),
        Statement::Loop { body, .. } => {
            for statement in body {
                for_each_change(statement, note);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tfe_symbolic::expr::input::{Affine, Input, LoopVariable};
    use tfe_symbolic::program::Operation;
    use tfe_symbolic::program::Place;

    fn add(target: u32, a: u32, b: u32) -> Statement {
        let operand = |number| match number {
            0 => Operand::Input(Input::Time),
            number => Operand::Temporary(Temporary(number)),
        };
        Statement::Let {
            target: Temporary(target),
            operation: Operation::Add(operand(a), operand(b)),
        }
    }

    fn energy(value: u32) -> Statement {
        Statement::Store {
            output: Place::scalar(Array::Value),
            value: Operand::Temporary(Temporary(value)),
            accumulate: false,
        }
    }

    #[test]
    fn short_kernels_are_not_cut() {
        let statements: Vec<Statement> = (1..=600).map(|k| add(k, k - 1, 0)).collect();
        assert!(Parts::of(&statements).is_none());
    }

    #[test]
    fn a_chain_hands_on_one_value_at_a_time() {
        let mut statements: Vec<Statement> = (1..=1000).map(|k| add(k, k - 1, 0)).collect();
        statements.push(energy(1000));
        let parts = Parts::of(&statements).expect("it is long");
        let lengths: Vec<usize> = parts
            .parts
            .iter()
            .map(|part| part.statements.len())
            .collect();
        assert_eq!(lengths, [300, 300, 300, 100]);
        assert_eq!(parts.kept, 1);
        assert_eq!(parts.parts[1].reads, [(Temporary(300), 0)]);
        assert_eq!(parts.parts[1].keeps, SortedMap::from([(Temporary(600), 0)]));
        let value = (Operand::Temporary(Temporary(1000)), Some(0));
        assert_eq!(parts.value, Some(value));
    }

    #[test]
    fn places_are_used_again_by_values_that_begin_where_others_end() {
        // The first value is read until the third part, the others by the next one only.
        let mut statements: Vec<Statement> = (1..=900).map(|k| add(k, k - 1, 0)).collect();
        statements.push(add(901, 1, 900));
        statements.push(energy(901));
        let parts = Parts::of(&statements).expect("it is long");
        assert_eq!(parts.kept, 2);
        let reads: Vec<usize> = parts.parts.iter().map(|part| part.reads.len()).collect();
        assert_eq!(reads, [0, 1, 1, 2]);
    }

    #[test]
    fn running_sums_stay_with_their_loops() {
        let mut statements: Vec<Statement> = (1..=299).map(|k| add(k, k - 1, 0)).collect();
        statements.push(Statement::Accumulator {
            target: Temporary(1000),
            start: Operand::Constant(0.0),
        });
        statements.extend((300..=610).map(|k| add(k, k - 1, 0)));
        statements.push(Statement::Loop {
            variable: LoopVariable(0),
            start: Affine::constant(0),
            end: Affine::constant(3),
            body: vec![Statement::Accumulate {
                target: Temporary(1000),
                value: Operand::Temporary(Temporary(610)),
            }],
        });
        statements.push(energy(1000));
        let parts = Parts::of(&statements).expect("it is long");
        assert_eq!(parts.parts.len(), 1);
        assert_eq!(
            parts.value,
            Some((Operand::Temporary(Temporary(1000)), Some(0)))
        );
    }
}
