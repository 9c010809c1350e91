//! Which model is just accurate enough: pendulums by amplitude, a top by its nutation, a pendulum on a spring by its
//! stiffness, a beam by its number of modes.

mod beam;
mod elastic;
mod pendulum;
mod top;

use std::error::Error;
use std::time::Duration;
use tfe::charts::Section;
use tfe::fidelity::{Choice, Ladder, Rung};
use tfe::prelude::*;
use tfe::work_precision::Cost;

/// A section for each ladder, with its chart, its table of choices, and a sentence on the result.
pub fn sections() -> Result<Vec<Section>, Box<dyn Error>> {
    let mut sections = pendulum::sections()?;
    sections.extend(top::sections()?);
    sections.extend(elastic::sections()?);
    sections.push(beam::section()?);
    Ok(sections)
}

/// A ladder whose runs are timed for a short time only.
fn ladder<'m>(title: impl Into<String>, end: f64) -> Fidelity<'m> {
    let repeat_for = if cfg!(debug_assertions) { 0 } else { 5 };
    Fidelity::new(0.0..end)
        .title(title)
        .repeat_for(Duration::from_millis(repeat_for))
}

/// Elements of many orders.
fn elements() -> impl Iterator<Item = Element> {
    let nodes: &[usize] = if cfg!(debug_assertions) {
        &[3, 5, 9]
    } else {
        &[2, 3, 4, 5, 6, 7, 9, 12]
    };
    nodes.iter().copied().map(Element::mixed)
}

/// Prints a ladder and the sentence on its result, and makes a section of both.
fn shown(ladder: &Ladder, seen: &str) -> Result<Section, Box<dyn Error>> {
    println!("\n{}\n{ladder}\n{seen}", ladder.title());
    Ok(ladder.section()?.paragraph(seen))
}

/// The name of the model that is chosen.
fn chosen(ladder: &Ladder, accuracy: f64) -> Option<&str> {
    ladder.cheapest(accuracy).map(|one| &*one.rung)
}

/// The fastest run of one model with an error of at most `accuracy`.
fn fastest(rung: &Rung, accuracy: f64) -> Option<&Choice> {
    let front = rung.front(Cost::Time);
    front.into_iter().find(|one| one.error <= accuracy)
}

/// Which model is chosen for which of the accuracies: "linear for 1e-1, cubic for 1e-2 to 1e-5".
fn served(ladder: &Ladder) -> String {
    let mut spans: Vec<(&str, f64, f64)> = Vec::new();
    for &accuracy in ladder.accuracies() {
        let unserved = if ladder.is_known(accuracy) {
            "none"
        } else {
            "not known"
        };
        let name = chosen(ladder, accuracy).unwrap_or(unserved);
        match spans.last_mut() {
            Some((last, _, to)) if *last == name => *to = accuracy,
            _ => spans.push((name, accuracy, accuracy)),
        }
    }
    let span = |(name, from, to): &(&str, f64, f64)| {
        if from == to {
            format!("{name} for {from:.0e}")
        } else {
            format!("{name} for {from:.0e} to {to:.0e}")
        }
    };
    spans.iter().map(span).collect::<Vec<_>>().join(", ")
}

/// The error of a model in two digits.
fn model_error(rung: &Rung) -> String {
    match rung.model_error() {
        None => "—".to_owned(),
        Some(error) if error >= 0.1 => format!("{error:.2}"),
        Some(error) => format!("{error:.1e}"),
    }
}

/// The time in microseconds of the fastest run of a model with this accuracy.
fn micros(choice: Option<&Choice>) -> String {
    choice.map_or_else(|| "—".to_owned(), |one| format!("{:.1}", 1e6 * one.seconds))
}

/// Prints a table with aligned columns.
fn print_table<const N: usize>(headings: [&str; N], rows: &[[String; N]]) {
    let mut lines = vec![headings.map(str::to_owned)];
    lines.extend_from_slice(rows);
    let width = |column: usize| {
        let cells = lines.iter().map(|line| line[column].chars().count());
        cells.max().unwrap_or(0)
    };
    let widths: [usize; N] = std::array::from_fn(width);
    for line in &lines {
        let cells = line.iter().zip(widths);
        let cells: Vec<String> = cells
            .map(|(cell, width)| format!("{cell:<width$}"))
            .collect();
        println!("{}", cells.join("  ").trim_end());
    }
}
