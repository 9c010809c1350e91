//! What a run found: a table of counts, and the worst models in full.

use std::fmt::Write as _;

use super::cases::cases;
use super::formula::State;
use super::judge::{Disagreement, LIMIT, Offence, Verdict, judge};
use super::models::{KINDS, model};
use super::random::Random;
use super::writer::Model;

/// A model and what came out for it.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub label: String,
    pub kind: &'static str,
    pub text: String,
    pub parameters: Vec<String>,
    pub verdict: Verdict,
}

/// The thresholds of the table.
const THRESHOLDS: [f64; 3] = [LIMIT, 100.0, 1e4];

/// The random model of this number.
pub fn random_outcome(seed: u64, number: usize) -> Outcome {
    let mut random = Random::new(seed, number as u64);
    let model = model(&mut random, number);
    outcome(number.to_string(), &model, &mut random)
}

/// The fixed cases.
pub fn case_outcomes(seed: u64) -> Vec<Outcome> {
    let judged = |(number, model): (usize, Model)| {
        let mut random = Random::new(seed, number as u64);
        outcome(format!("case {number}"), &model, &mut random)
    };
    cases()
        .into_iter()
        .enumerate()
        .map(|(number, model)| judged((number, model)))
        .collect()
}

fn outcome(label: String, model: &Model, random: &mut Random) -> Outcome {
    Outcome {
        label,
        kind: model.kind,
        text: model.text.clone(),
        parameters: model.parameters.clone(),
        verdict: judge(model, random),
    }
}

impl Outcome {
    /// The largest loss of an entry, without and with the convention for angles.
    fn losses(&self) -> [f64; 2] {
        [self.verdict.raw, self.verdict.loss]
    }

    fn disagreement(&self) -> f64 {
        let found = self.verdict.disagreements.iter().map(|found| found.loss);
        found.fold(0.0, f64::max)
    }

    /// Whether the engine refuses the model, or a kernel loses more than [`LIMIT`] with the convention for angles, or two kernels differ by
    /// more than twice that.
    pub fn is_bad(&self) -> bool {
        let loses = self.verdict.loss > LIMIT || self.disagreement() > 2.0 * LIMIT;
        self.verdict.refused.is_some() || loses
    }
}

/// How many models lose more than the thresholds, by kind.
pub fn table(outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:<12} {:>7} {:>8} {:>8} | {:^20} | {:^20} | {:^20}",
        "", "models", "refused", "entries", "loss", "without angles", "kernels differ"
    );
    let _ = write!(text, "{:<12} {:>7} {:>8} {:>8}", "", "", "", "judged");
    for _ in 0..3 {
        let _ = write!(text, " | {:>6} {:>6} {:>6}", ">8", ">100", ">1e4");
    }
    let _ = writeln!(text);
    for kind in ["cases"].iter().chain(&KINDS).chain(&["all"]) {
        let of_kind = |outcome: &&Outcome| outcome.kind == *kind || *kind == "all";
        let models: Vec<&Outcome> = outcomes.iter().filter(of_kind).collect();
        let refused = models.iter().filter(|one| one.verdict.refused.is_some());
        let compared: usize = models.iter().map(|one| one.verdict.compared).sum();
        let _ = write!(
            text,
            "{kind:<12} {:>7} {:>8} {:>8}",
            models.len(),
            refused.count(),
            compared
        );
        let measures: [fn(&Outcome) -> f64; 3] = [
            |one| one.losses()[1],
            |one| one.losses()[0],
            Outcome::disagreement,
        ];
        for measure in measures {
            let _ = write!(text, " |");
            for threshold in THRESHOLDS {
                let above = models.iter().filter(|one| measure(one) > threshold);
                let _ = write!(text, " {:>6}", above.count());
            }
        }
        let _ = writeln!(text);
    }
    text
}

/// Models that the engine refuses, and those that lose most, worst first, with so many entries of each.
pub fn offenders(outcomes: &[Outcome], models: usize, entries: usize) -> String {
    let mut text = String::new();
    for one in outcomes {
        if let Some(refused) = &one.verdict.refused {
            let _ = writeln!(text, "{} refused: {refused}\n    {}", one.label, one.text);
        }
    }
    let mut bad: Vec<&Outcome> = outcomes
        .iter()
        .filter(|one| !one.verdict.offences.is_empty() || !one.verdict.disagreements.is_empty())
        .collect();
    let key = |one: &Outcome| (one.verdict.loss.max(one.disagreement()), one.verdict.raw);
    bad.sort_by(|a, b| {
        key(b)
            .partial_cmp(&key(a))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    for one in bad.into_iter().take(models) {
        let [raw, loss] = one.losses();
        let _ = writeln!(
            text,
            "\n{} ({}): loss {loss:.3e}, without angles {raw:.3e}\n    {}",
            one.label, one.kind, one.text
        );
        for offence in one.verdict.offences.iter().take(entries) {
            text.push_str(&line_of_offence(offence, &one.parameters));
        }
        for found in one.verdict.disagreements.iter().take(entries) {
            text.push_str(&line_of_disagreement(found, &one.parameters));
        }
    }
    text
}

fn line_of_offence(offence: &Offence, parameters: &[String]) -> String {
    format!(
        "  {} in `{}`: loss {:.3e}, without angles {:.3e}; {}\n    kernel {:e} plain {:e} exact {:e}\n    {}\n",
        offence.entry,
        offence.kernel,
        offence.loss,
        offence.raw,
        offence.regime,
        offence.found,
        offence.plain,
        offence.exact,
        listed(&offence.state, parameters)
    )
}

fn line_of_disagreement(found: &Disagreement, parameters: &[String]) -> String {
    format!(
        "  {} differs: loss {:.3e}, without angles {:.3e}; {}\n    `{}` {:e} `{}` {:e} exact {:e}\n    {}\n",
        found.entry,
        found.loss,
        found.raw,
        found.regime,
        found.kernels[0],
        found.found[0],
        found.kernels[1],
        found.found[1],
        found.exact,
        listed(&found.state, parameters)
    )
}

fn listed(state: &State, parameters: &[String]) -> String {
    let mut text = format!("t = {:?}, q = {:?}, z = {:?}", state.time, state.q, state.z);
    if !state.mu.is_empty() {
        let _ = write!(text, ", mu = {:?}", state.mu);
    }
    for (name, value) in parameters.iter().zip(&state.parameters) {
        let _ = write!(text, ", {name} = {value:?}");
    }
    text
}
