//! What a run found: a table of counts, and the worst models in full.

use std::cmp::Ordering;
use std::fmt::Write as _;
use std::time::Duration;

use super::cases::cases;
use super::formula::State;
use super::judge::{LIMIT, Loss, Offence, Verdict, judge};
use super::models::{KINDS, model};
use super::random::Random;
use super::writer::Model;

/// A model and what came out for it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The number of a random model; cases come before.
    pub number: Option<usize>,
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
    outcome(Some(number), &model, &mut random)
}

/// The fixed cases.
pub fn case_outcomes(seed: u64) -> Vec<Outcome> {
    let judged = |(number, model): (u64, &Model)| {
        let mut random = Random::new(seed, number);
        outcome(None, model, &mut random)
    };
    (0..).zip(&cases()).map(judged).collect()
}

fn outcome(number: Option<usize>, model: &Model, random: &mut Random) -> Outcome {
    Outcome {
        number,
        kind: model.kind,
        text: model.text.clone(),
        parameters: model.parameters.clone(),
        verdict: judge(model, random),
    }
}

impl Outcome {
    /// The largest loss of an entry.
    fn loss(&self) -> Loss {
        largest(&self.verdict.offences)
    }

    /// The largest difference between kernels.
    fn difference(&self) -> Loss {
        largest(&self.verdict.disagreements)
    }

    /// Whether the engine refuses the model, or a kernel loses more than [`LIMIT`] with the convention for angles, or two kernels differ by
    /// more than twice that.
    pub fn is_bad(&self) -> bool {
        let loses = self.loss().loss > LIMIT || self.difference().loss > 2.0 * LIMIT;
        self.verdict.refused.is_some() || loses
    }
}

fn largest(offences: &[Offence]) -> Loss {
    let losses = offences.iter().map(|offence| offence.loss);
    losses.fold(Loss::default(), |a, b| Loss {
        loss: a.loss.max(b.loss),
        raw: a.raw.max(b.raw),
    })
}

/// How many models lose more than the thresholds, by kind.
pub fn table(outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:<12} {:>6} {:>7} {:>9} {:>9} | {:^20} | {:^20} | {:^20} | {:>7} {:>7}",
        "",
        "models",
        "refused",
        "judged",
        "left out",
        "loss",
        "without angles",
        "kernels differ",
        "derive",
        "judge"
    );
    let _ = write!(text, "{:<12} {:>6} {:>7} {:>9} {:>9}", "", "", "", "", "");
    for _ in 0..3 {
        let _ = write!(text, " | {:>6} {:>6} {:>6}", ">8", ">100", ">1e4");
    }
    let _ = writeln!(text, " | {:>7} {:>7}", "s", "s");
    for kind in ["cases"].iter().chain(&KINDS).chain(&["all"]) {
        let of_kind = |outcome: &&Outcome| outcome.kind == *kind || *kind == "all";
        let models: Vec<&Outcome> = outcomes.iter().filter(of_kind).collect();
        let refused = models.iter().filter(|one| one.verdict.refused.is_some());
        let judged: usize = models.iter().map(|one| one.verdict.judged).sum();
        let left_out: usize = models.iter().map(|one| one.verdict.left_out).sum();
        let _ = write!(
            text,
            "{kind:<12} {:>6} {:>7} {judged:>9} {left_out:>9}",
            models.len(),
            refused.count(),
        );
        let measures: [fn(&Outcome) -> f64; 3] = [
            |one| one.loss().loss,
            |one| one.loss().raw,
            |one| one.difference().loss,
        ];
        for measure in measures {
            text.push_str(" |");
            for threshold in THRESHOLDS {
                let above = models.iter().filter(|one| measure(one) > threshold);
                let _ = write!(text, " {:>6}", above.count());
            }
        }
        let deriving: Duration = models.iter().map(|one| one.verdict.deriving).sum();
        let judging: Duration = models.iter().map(|one| one.verdict.judging).sum();
        let (deriving, judging) = (deriving.as_secs_f64(), judging.as_secs_f64());
        let _ = writeln!(text, " | {deriving:>7.1} {judging:>7.1}");
    }
    text
}

/// Models that the engine refuses, and those that lose most, worst first, with so many entries of each.
pub fn offenders(outcomes: &[Outcome], models: usize, entries: usize) -> String {
    let mut text = String::new();
    for one in outcomes {
        if let Some(refused) = &one.verdict.refused {
            let _ = writeln!(text, "{}refused: {refused}", heading(one));
        }
    }
    let lost = |one: &&Outcome| one.loss().raw > LIMIT || one.difference().raw > LIMIT;
    let mut bad: Vec<&Outcome> = outcomes.iter().filter(lost).collect();
    let key = |one: &Outcome| (one.loss(), one.difference());
    bad.sort_by(|a, b| key(b).partial_cmp(&key(a)).unwrap_or(Ordering::Equal));
    for one in bad.into_iter().take(models) {
        text.push_str(&heading(one));
        for offence in one.verdict.offences.iter().take(entries) {
            text.push_str(&described(offence, &one.parameters, "loses"));
        }
        for offence in one.verdict.disagreements.iter().take(entries) {
            text.push_str(&described(offence, &one.parameters, "differs"));
        }
    }
    text
}

fn heading(one: &Outcome) -> String {
    let number = one.number.map(|number| format!("model {number}, "));
    let number = number.unwrap_or_default();
    format!("\n{number}{}: {}\n", one.kind, one.text)
}

fn described(offence: &Offence, parameters: &[String], verb: &str) -> String {
    let Loss { loss, raw } = offence.loss;
    let mut text = format!(
        "  {} {verb}: {loss:.1e}, without angles {raw:.1e}; {}\n   ",
        offence.entry, offence.regime
    );
    for (kernel, found) in &offence.found {
        let _ = write!(text, " `{kernel}` {found:e}");
    }
    let (plain, exact) = (offence.plain, offence.exact);
    let state = listed(&offence.state, parameters);
    let _ = writeln!(text, " plain {plain:e} exact {exact:e}\n    {state}");
    text
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
