//! Kernels against formulas: how many digits each entry of the results loses, beyond those that the formula as written loses.
//!
//! For each entry and regime,
//!
//! ```text
//! loss = max |kernel − exact| / max (|plain − exact| + ulp(exact))
//! ```
//!
//! over the states of the regime, where `exact` is the formula in double-double numbers and `plain` the same formula in `f64`. Numbers in a
//! declaration stand for the decimal fractions that they are. The user writes an energy and not its derivatives: for these, `plain` is the
//! worse one of forward and reverse mode. A formula may be exact at a few states by chance: an entry that seems to lose more than [`LIMIT`] is judged
//! again with more states in the divisor, three times as many of the regime and as many beside the worst, where all inputs are larger or smaller by
//! one factor, so that what is equal stays equal.
//!
//! **Convention for angles.** A sine or cosine of a sum of angles may be computed from those of the angles: sin(a − b) = sin a cos b −
//! cos a sin b is the sine of an angle that differs by some ulps of a and b, and not of a − b. Hence each part of an argument of a sine or
//! cosine counts as known to half an ulp of its own, and what the formula changes by such a change is added to the divisor. Losses are stated
//! without and with this convention.
//!
//! States in which the formula itself overflows, or may lose numbers near the largest, are left out, as are those at the kink of an `abs` or
//! `select`, and those whose distance from it drowns in the rounding of the formula as written. Entries without a state are counted.

use std::time::{Duration, Instant};

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::interpret::Results;
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

use super::entries::{Entry, entries};
use super::formula::{Schedule, State};
use super::kernels::{Kernel, kernels, run};
use super::random::Random;
use super::reference::{MAX, Reference, UNDERFLOW, Value, distance};
use super::states::{Regime, beside, regimes};
use super::writer::Model;

/// Losses beyond this one are offences.
pub const LIMIT: f64 = 8.0;

/// How much is lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Loss {
    /// With the convention for angles.
    pub loss: f64,
    /// Without it.
    pub raw: f64,
}

/// An entry that a kernel computes worse than the formula does, or that differs between kernels.
#[derive(Clone, Debug)]
pub struct Offence {
    pub loss: Loss,
    pub entry: String,
    pub regime: String,
    pub state: State,
    /// One kernel and its result, or the two that differ most.
    pub found: Vec<(&'static str, f64)>,
    pub plain: f64,
    pub exact: f64,
}

/// What came out for a model.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// Why the engine does not accept the declaration.
    pub refused: Option<String>,
    /// How many pairs of entries and regimes were judged.
    pub judged: usize,
    /// How many were not, since no state of the regime counts.
    pub left_out: usize,
    /// How long the engine took, and how long the judgement.
    pub deriving: Duration,
    pub judging: Duration,
    /// The worst regime of each entry that loses more than [`LIMIT`], worst first.
    pub offences: Vec<Offence>,
    /// The worst regime of each entry that differs by more than [`LIMIT`] between kernels, worst first.
    pub disagreements: Vec<Offence>,
}

/// Judges one model.
pub fn judge(model: &Model, random: &mut Random) -> Verdict {
    let mut verdict = Verdict::default();
    let fields = model.used_parameters().into_iter().map(|name| Field {
        name,
        kind: FieldKind::Scalar,
    });
    let context = Context {
        struct_name: "Model".to_owned(),
        fields: fields.collect(),
        ..Context::default()
    };
    let declared = match declare(&model.text, &context) {
        Ok(declared) => declared,
        Err(mistakes) => {
            let mistakes = mistakes.iter().map(|mistake| mistake.kind.message());
            verdict.refused = Some(mistakes.collect::<Vec<_>>().join("; "));
            return verdict;
        }
    };
    let start = Instant::now();
    let kernels = kernels(&Derivation::of(&declared));
    verdict.deriving = start.elapsed();
    let start = Instant::now();
    let mut model = model.clone();
    let entries = entries(&mut model);
    let roots: Vec<_> = entries.iter().map(|entry| entry.formula).collect();
    let schedule = Schedule::of(&model.formulas, &roots);
    let roots: Vec<_> = entries.iter().map(|entry| entry.reverse).collect();
    let reverse = Schedule::of(&model.formulas, &roots);
    for regime in regimes(random, &model) {
        let states = regime.states.iter();
        let case = Case {
            kernels: &kernels,
            entries: &entries,
            schedule: &schedule,
            reverse: &reverse,
            regime: &regime,
            results: states.map(|state| run(&kernels, &model, state)).collect(),
        };
        case.judge(&mut verdict);
    }
    verdict.judging = start.elapsed();
    for list in [&mut verdict.offences, &mut verdict.disagreements] {
        list.sort_by(|a, b| {
            b.loss
                .partial_cmp(&a.loss)
                .unwrap_or(std::cmp::Ordering::Equal)
        });
    }
    verdict
}

/// What is compared with what in one regime.
struct Case<'a> {
    kernels: &'a [Kernel],
    entries: &'a [Entry],
    schedule: &'a Schedule,
    reverse: &'a Schedule,
    regime: &'a Regime,
    /// By state, and then by kernel.
    results: Vec<Vec<Option<Results>>>,
}

/// The largest error: at which state, of which kernels.
struct Worst {
    error: f64,
    value: Value,
    found: [(usize, f64); 2],
}

impl Case<'_> {
    fn judge(&self, verdict: &mut Verdict) {
        let mut reference = Reference::of(self.schedule, self.reverse, &self.regime.states);
        let has_values = |entry: &&Entry| !reference.values(entry).is_empty();
        let judged = self.entries.iter().filter(has_values).count();
        verdict.judged += judged;
        verdict.left_out += self.entries.len() - judged;
        let suspect = |entry: &&Entry| {
            let values = reference.values(entry);
            let [error, difference] = self.worst(entry, &values);
            let error = error.map_or(0.0, |worst| worst.error);
            let difference = difference.map_or(0.0, |worst| worst.error);
            error.max(difference) > LIMIT * largest(values.iter().map(Value::allowance))
        };
        let suspects: Vec<&Entry> = self.entries.iter().filter(suspect).collect();
        if suspects.is_empty() {
            return;
        }
        reference.extend(&self.regime.further);
        for entry in suspects {
            let values = reference.values(entry);
            let allowed = largest(values.iter().map(Value::allowance));
            let [error, difference] = self.worst(entry, &values);
            let worst = [&error, &difference].into_iter().flatten();
            let allowed = worst.fold(allowed, |allowed, worst| {
                allowed.max(self.allowed_beside(worst.value.state, entry))
            });
            let lists = [&mut verdict.offences, &mut verdict.disagreements];
            for (worst, list) in [error, difference].into_iter().zip(lists) {
                let Some(worst) = worst.filter(|worst| worst.error > LIMIT * allowed) else {
                    continue;
                };
                let judged = values
                    .iter()
                    .filter(|value| value.state < self.results.len());
                let with_angles = judged
                    .map(|value| value.allowance() + reference.by_angles(value, entry))
                    .filter(|allowed| *allowed <= MAX)
                    .chain([allowed]);
                let loss = Loss {
                    loss: worst.error / largest(with_angles),
                    raw: worst.error / allowed,
                };
                record(list, self.offence(entry, worst, loss));
            }
        }
    }

    /// What the formula loses at states that are like one of the regime.
    fn allowed_beside(&self, state: usize, entry: &Entry) -> f64 {
        let states = beside(&self.regime.states[state]);
        let reference = Reference::of(self.schedule, self.reverse, &states);
        largest(reference.values(entry).iter().map(Value::allowance))
    }

    /// The largest error of a kernel, and the largest difference between two.
    fn worst(&self, entry: &Entry, values: &[Value]) -> [Option<Worst>; 2] {
        let wanted: Vec<usize> = (0..self.kernels.len())
            .filter(|kernel| self.kernels[*kernel].arrays.contains(&entry.array))
            .collect();
        let mut worst: [Option<Worst>; 2] = [None, None];
        let mut keep = |which: usize, error: f64, value: &Value, found: [(usize, f64); 2]| {
            // NaN is as wrong as can be.
            let error = if error.is_nan() { f64::INFINITY } else { error };
            if worst[which]
                .as_ref()
                .is_none_or(|worst| error > worst.error)
            {
                let value = *value;
                worst[which] = Some(Worst {
                    error,
                    value,
                    found,
                });
            }
        };
        for value in values {
            let Some(results) = self.results.get(value.state) else {
                continue;
            };
            let (mut least, mut most) = ((0, f64::INFINITY), (0, f64::NEG_INFINITY));
            for kernel in &wanted {
                let results = results[*kernel].as_ref();
                let found = results.map_or(f64::NAN, |results| entry.of(results));
                let one = (*kernel, found);
                keep(0, distance(found, value.exact), value, [one; 2]);
                least = if found < least.1 { one } else { least };
                most = if found > most.1 { one } else { most };
            }
            if least.1 < most.1 {
                keep(1, most.1 - least.1, value, [least, most]);
            }
        }
        worst
    }

    fn offence(&self, entry: &Entry, worst: Worst, loss: Loss) -> Offence {
        let found = worst
            .found
            .map(|(kernel, found)| (self.kernels[kernel].name, found));
        let same = worst.found[0].0 == worst.found[1].0;
        Offence {
            loss,
            entry: entry.name.clone(),
            regime: self.regime.name.clone(),
            state: self.regime.states[worst.value.state].clone(),
            found: found.into_iter().take(if same { 1 } else { 2 }).collect(),
            plain: worst.value.plain,
            exact: worst.value.exact.hi,
        }
    }
}

/// Keeps the worst of each entry.
fn record(known: &mut Vec<Offence>, new: Offence) {
    match known.iter_mut().find(|old| old.entry == new.entry) {
        Some(old) if old.loss < new.loss => *old = new,
        Some(_) => {}
        None => known.push(new),
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(UNDERFLOW, f64::max)
}
