//! Headings inside kernels, which name the results that the following statements compute.
//!
//! ```text
//! /// ∂L/∂θ̇₁, ∂L/∂θ̇₂
//! let t3 = …;
//! …
//! first.z[0] = …;
//! first.z[1] = …;
//! ```
//!
//! Comments do not survive in tokens; documentation before a `let` does, and costs nothing at run time. Assignments
//! cannot have any. Statements are in an order with few live values: a part of a later result may come where it needs
//! the fewest registers, and the heading says so.

use crate::in_place::is_written_in_place;
use crate::parts::LONG_KERNEL;
use std::ops::Range;
use tfe_symbolic::expr::ordered::{SortedMap, SortedSet};
use tfe_symbolic::expr::sorting::sort;
use tfe_symbolic::model::declared::{Declared, Form, names};
use tfe_symbolic::model::notation;
use tfe_symbolic::program::{Array, Operand, Place, Statement, Temporary};

/// Up to this number of results are named; for more, the arrays are.
const MAX_RESULTS: usize = 4;

/// The names of a model's results.
#[derive(Clone, Debug)]
pub(crate) struct Headings {
    letter: char,
    second: char,
    coordinates: Vec<String>,
    /// Velocities, or momenta.
    rates: Vec<String>,
}

impl Headings {
    pub(crate) fn of(declared: &Declared) -> Self {
        let coordinates = names(&declared.coordinates);
        let symbols = |names: &[String]| names.iter().map(|name| notation::element(name)).collect();
        match declared.form {
            Form::Lagrangian => Self {
                letter: 'L',
                second: 'v',
                rates: coordinates
                    .iter()
                    .map(|name| notation::rate_of(name))
                    .collect(),
                coordinates: symbols(&coordinates),
            },
            Form::Hamiltonian => Self {
                letter: 'H',
                second: 'p',
                rates: symbols(&names(&declared.momenta)),
                coordinates: symbols(&coordinates),
            },
        }
    }

    /// The headings, by the positions of the statements before which they are placed; none for kernels with one group
    /// of statements, or that are not meant to be read.
    pub(crate) fn place(
        &self,
        statements: &[Statement],
        reads: &SortedMap<Temporary, usize>,
    ) -> SortedMap<usize, String> {
        let mut headings = SortedMap::new();
        if statements.len() <= LONG_KERNEL {
            for group in groups(statements, reads) {
                let begin = group.clone().find(|at| {
                    let rest = &statements[*at..];
                    takes_documentation(&rest[0]) && !is_written_in_place(rest, reads)
                });
                if let (Some(at), Some(heading)) = (begin, self.heading(&statements[group])) {
                    headings.insert(at, heading);
                }
            }
        }
        if headings.len() < 2 {
            headings.clear();
        }
        headings
    }

    /// The names of the results of a group, and whether other results need some of its values. Where a result has no
    /// name of its own, as in a loop, the array is named.
    fn heading(&self, group: &[Statement]) -> Option<String> {
        let mut results: Vec<&Place> = group.iter().flat_map(results).collect();
        sort(&mut results);
        let names: Option<Vec<String>> = results.iter().map(|place| self.name(place)).collect();
        let mut seen = SortedSet::new();
        let names = names.map(|mut names| {
            names.retain(|name| seen.insert(name.clone()));
            names
        });
        let names = match names {
            Some(names) if names.len() <= MAX_RESULTS => names,
            _ => {
                let arrays: SortedSet<Array> = results.iter().map(|place| place.array).collect();
                let arrays: Option<Vec<String>> =
                    arrays.into_iter().map(|array| self.array(array)).collect();
                arrays?
            }
        };
        let names = (!names.is_empty()).then(|| names.join(", "))?;
        Some(match needs_all(group) {
            true => format!(" {names}"),
            false => format!(" {names}, and parts of later results"),
        })
    }

    /// `∂L/∂θ̇₁`
    fn name(&self, place: &Place) -> Option<String> {
        let of = |names: &[String], index: &tfe_symbolic::expr::input::Affine| {
            let index = usize::try_from(index.as_constant()?).ok()?;
            names.get(index).cloned()
        };
        let letter = self.letter;
        let (row, column) = (&place.row, &place.column);
        let (q, z) = (&self.coordinates, &self.rates);
        let second = |a: String, b: String| match a == b {
            true => format!("∂²{letter}/∂{a}²"),
            false => format!("∂²{letter}/∂{a}∂{b}"),
        };
        // Entries on both sides of a diagonal are the same derivative.
        let ordered = || match row.as_constant() <= column.as_constant() {
            true => (row, column),
            false => (column, row),
        };
        Some(match place.array {
            Array::ByZ => format!("∂{letter}/∂{}", of(z, row)?),
            Array::ByQ => format!("∂{letter}/∂{}", of(q, row)?),
            Array::Force => format!("Q_{}", of(q, row)?),
            Array::ZZ => {
                let (row, column) = ordered();
                second(of(z, row)?, of(z, column)?)
            }
            Array::ZQ => second(of(z, row)?, of(q, column)?),
            Array::QQ => {
                let (row, column) = ordered();
                second(of(q, row)?, of(q, column)?)
            }
            Array::ForceZ => format!("∂Q_{}/∂{}", of(q, row)?, of(z, column)?),
            Array::ForceQ => format!("∂Q_{}/∂{}", of(q, row)?, of(q, column)?),
            _ => return None,
        })
    }

    /// `L_vq`
    fn array(&self, array: Array) -> Option<String> {
        let (letter, z) = (self.letter, self.second);
        Some(match array {
            Array::ByZ => format!("{letter}_{z}"),
            Array::ByQ => format!("{letter}_q"),
            Array::Force => "Q".to_owned(),
            Array::ZZ => format!("{letter}_{z}{z}"),
            Array::ZQ => format!("{letter}_{z}q"),
            Array::QQ => format!("{letter}_qq"),
            Array::ForceZ => format!("Q_{z}"),
            Array::ForceQ => "Q_q".to_owned(),
            Array::SiteRow => "A".to_owned(),
            Array::SiteDrift => "a".to_owned(),
            Array::SitePhi => "φ".to_owned(),
            Array::PsiQ(_) => "∂ψ/∂q".to_owned(),
            Array::RowRate(_) => "Ȧ".to_owned(),
            Array::Bend => "∂(Aᵀμ)/∂q".to_owned(),
            Array::RateQ => "∂(Ȧᵀμ)/∂q".to_owned(),
            Array::RateV => "∂(Ȧᵀμ)/∂v".to_owned(),
            _ => return None,
        })
    }
}

/// Groups of statements, each ending with results; what follows the last result is no group. A loop with results
/// belongs to the statements before it.
fn groups(statements: &[Statement], reads: &SortedMap<Temporary, usize>) -> Vec<Range<usize>> {
    let (mut groups, mut begin, mut end) = (Vec::new(), 0, 0);
    for (at, statement) in statements.iter().enumerate() {
        if result(statement).is_some() {
            end = at + 1;
        } else if !results(statement).is_empty() {
            if end > begin {
                groups.push(begin..end);
                begin = end;
            }
            end = at + 1;
        } else if end > begin && !is_written_in_place(&statements[at..], reads) {
            groups.push(begin..end);
            begin = end;
        }
    }
    if end > begin {
        groups.push(begin..end);
    }
    groups
}

fn result(statement: &Statement) -> Option<&Place> {
    match statement {
        Statement::Store { output, .. } => Some(output),
        _ => None,
    }
}

/// Those of a statement with all that it repeats.
fn results(statement: &Statement) -> Vec<&Place> {
    match statement {
        Statement::Loop { body, .. } => body.iter().flat_map(results).collect(),
        Statement::Balance { output, .. } => vec![output],
        statement => result(statement).into_iter().collect(),
    }
}

/// All that a statement reads, with what it repeats.
fn reads_of(statement: &Statement) -> Vec<&Operand> {
    match statement {
        Statement::Loop { body, .. } => body.iter().flat_map(reads_of).collect(),
        statement => statement.operands(),
    }
}

fn takes_documentation(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::Let { .. }
            | Statement::SineCosine { .. }
            | Statement::Accumulator { .. }
            | Statement::Loop { .. }
    )
}

/// Whether the results of a group need everything that is computed in it.
fn needs_all(group: &[Statement]) -> bool {
    let mut needed: SortedSet<Temporary> = SortedSet::new();
    group.iter().rev().all(|statement| {
        let is_needed = match statement {
            Statement::Let { target, .. } => needed.contains(target),
            Statement::SineCosine { sine, cosine, .. } => {
                needed.contains(sine) || needed.contains(cosine)
            }
            _ => true,
        };
        for operand in reads_of(statement) {
            if let Operand::Temporary(temporary) = operand {
                needed.insert(*temporary);
            }
        }
        is_needed
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tfe_symbolic::compile::declare;
    use tfe_symbolic::derive::derivation::Derivation;
    use tfe_symbolic::program::Request;
    use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

    #[track_caller]
    fn headings(text: &str, request: Request, expected: &[&str]) {
        let lambda = Field {
            name: "lambda".to_owned(),
            kind: FieldKind::Scalar,
        };
        let context = Context {
            fields: vec![lambda],
            ..Context::default()
        };
        let declared = declare(text, &context).expect("no mistakes in it");
        let program = Derivation::of(&declared).program(request);
        let mut reads: SortedMap<Temporary, usize> = SortedMap::new();
        for operand in program.statements.iter().flat_map(Statement::operands) {
            if let Operand::Temporary(temporary) = operand {
                *reads.get_or_default(*temporary) += 1;
            }
        }
        let placed = Headings::of(&declared).place(&program.statements, &reads);
        let found: Vec<&str> = placed.values().map(|heading| heading.trim()).collect();
        assert_eq!(found, expected, "{program}");
        for at in placed.into_keys() {
            assert!(takes_documentation(&program.statements[at]));
        }
    }

    #[test]
    fn results_are_told_by_the_names_of_coordinates() {
        let henon_heiles = "coordinates(x, y), momenta(px, py), \
             hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3)";
        headings(henon_heiles, Request::FIRST, &["∂H/∂x", "∂H/∂y"]);
        let second = Request::SECOND;
        headings(
            henon_heiles,
            second,
            &[
                "∂²H/∂x∂y, and parts of later results",
                "∂H/∂x, ∂²H/∂x²",
                "∂²H/∂y², and parts of later results",
                "∂H/∂y",
            ],
        );
    }

    #[test]
    fn one_group_needs_no_heading() {
        let pendulum = "coordinates(x), lagrangian = lambda*dot(x)^2/2 + cos(x)";
        headings(pendulum, Request::FIRST, &[]);
    }
}
