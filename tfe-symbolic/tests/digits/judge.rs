//! Kernels against formulas: how many digits each entry of the results loses, beyond those that the formula as written loses.
//!
//! For each entry and regime,
//!
//! ```text
//! loss = max |kernel − exact| / max (|plain − exact| + ulp(exact))
//! ```
//!
//! over the states of the regime, where `exact` is the formula in double-double numbers and `plain` the same formula in `f64`.
//!
//! **Convention for angles.** A sine or cosine of a sum of angles may be computed from those of the angles: sin(a − b) = sin a cos b −
//! cos a sin b is the sine of an angle that differs by some ulps of a and b, and not of a − b. Hence each part of an argument of a sine or
//! cosine counts as known to half an ulp of its own, and what the formula changes by such a change is added to the divisor. Losses are stated
//! without and with this convention.
//!
//! States in which the formula itself overflows are left out, as are those in which the rounding of the formula as written reaches the kink
//! of an `abs`, `sign` or `select`.

use tfe_symbolic::compile::declare;
use tfe_symbolic::context::{Context, Field, FieldKind};
use tfe_symbolic::derivation::Derivation;
use tfe_symbolic::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{Program, Request};

use super::double_double::DoubleDouble;
use super::entries::{Array, Entry, entries};
use super::formula::{Schedule, State, ulp};
use super::random::Random;
use super::states::{Regime, regimes};
use super::writer::Model;

/// Losses beyond this one are offences.
pub const LIMIT: f64 = 8.0;

/// Added to what the formula may lose: below it, double-double numbers have no more digits than others.
const UNDERFLOW: f64 = 1e-250;

/// A switch whose distance from its kink is so many times the rounding of the formula is left out.
const KINK: f64 = 16.0;

/// An entry that a kernel computes worse than the formula does.
#[derive(Clone, Debug)]
pub struct Offence {
    /// Without and with the convention for angles.
    pub raw: f64,
    pub loss: f64,
    pub entry: String,
    pub kernel: &'static str,
    pub regime: String,
    pub state: State,
    pub found: f64,
    pub plain: f64,
    pub exact: f64,
}

/// An entry that differs between kernels by more than the formula's rounding.
#[derive(Clone, Debug)]
pub struct Disagreement {
    /// Without and with the convention for angles.
    pub raw: f64,
    pub loss: f64,
    pub entry: String,
    pub kernels: [&'static str; 2],
    pub regime: String,
    pub state: State,
    pub found: [f64; 2],
    pub exact: f64,
}

/// What came out for a model.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// Why the engine does not accept the declaration.
    pub refused: Option<String>,
    /// How many pairs of entries and regimes were compared.
    pub compared: usize,
    /// The largest losses of all entries.
    pub raw: f64,
    pub loss: f64,
    /// The worst regime of each entry that loses more than [`LIMIT`], worst first.
    pub offences: Vec<Offence>,
    /// The worst regime of each entry that differs by more than [`LIMIT`], worst first.
    pub disagreements: Vec<Disagreement>,
}

struct Kernel {
    name: &'static str,
    program: Program,
    arrays: &'static [Array],
}

fn kernels(derivation: &Derivation) -> Vec<Kernel> {
    use Array::{
        Bend, ByQ, ByZ, Drift, Force, ForceQ, ForceZ, Observable, Phi, PsiQ, QQ, RateQ, RateV, Row,
        RowRate, Value, ZQ, ZZ,
    };
    let nothing = Request::default();
    let first = Request {
        first: true,
        ..nothing
    };
    let requests: [(&'static str, Request, &'static [Array]); 8] = [
        (
            "value",
            Request {
                value: true,
                ..nothing
            },
            &[Value],
        ),
        ("first", first, &[ByZ, ByQ, Force]),
        (
            "first+mass",
            Request {
                mass: true,
                ..first
            },
            &[ByZ, ByQ, Force, ZZ],
        ),
        (
            "first+second",
            Request {
                second: true,
                ..first
            },
            &[ByZ, ByQ, Force, ZZ, ZQ, QQ, ForceZ, ForceQ],
        ),
        (
            "observables",
            Request {
                observables: true,
                ..nothing
            },
            &[Observable],
        ),
        (
            "constraint values",
            Request {
                constraint_values: true,
                ..nothing
            },
            &[Phi],
        ),
        (
            "constraint rows",
            Request {
                constraint_rows: true,
                ..nothing
            },
            &[Row, Drift],
        ),
        (
            "constraint second",
            Request {
                constraint_second: true,
                ..nothing
            },
            &[PsiQ, RowRate, Bend, RateQ, RateV],
        ),
    ];
    let mut kernels: Vec<Kernel> = requests
        .into_iter()
        .map(|(name, request, arrays)| Kernel {
            name,
            program: derivation.program(request),
            arrays,
        })
        .collect();
    kernels.push(Kernel {
        name: "forces",
        program: derivation.forces(),
        arrays: &[ByQ, Force],
    });
    kernels.retain(|kernel| !kernel.program.statements.is_empty());
    kernels
}

fn environment(model: &Model, state: &State) -> Environment {
    Environment {
        time: state.time,
        q: state.q.clone(),
        z: state.z.clone(),
        mu: state.mu.clone(),
        parameters: model
            .parameters
            .iter()
            .cloned()
            .zip(state.parameters.iter().copied())
            .collect(),
        ..Environment::default()
    }
}

/// The values of the formulas of a model at one state.
struct Reference {
    plain: Vec<f64>,
    exact: Vec<DoubleDouble>,
}

/// What was found for one entry at one state.
struct Sample {
    /// What the formula may lose.
    allowance: f64,
    exact: DoubleDouble,
    plain: f64,
    /// By kernel; `None` where it does not compute the entry.
    found: Vec<Option<f64>>,
    state: usize,
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
            let mistakes: Vec<String> = mistakes
                .iter()
                .map(|mistake| mistake.kind.message())
                .collect();
            verdict.refused = Some(mistakes.join("; "));
            return verdict;
        }
    };
    let kernels = kernels(&Derivation::of(&declared));
    let mut model = model.clone();
    let entries = entries(&mut model);
    let roots: Vec<_> = entries.iter().map(|entry| entry.formula).collect();
    let schedule = Schedule::of(&model.formulas, &roots);
    for regime in regimes(random, &model) {
        judge_regime(&model, &kernels, &entries, &schedule, &regime, &mut verdict);
    }
    verdict.offences.sort_by(|a, b| b.loss.total_cmp(&a.loss));
    verdict
        .disagreements
        .sort_by(|a, b| b.loss.total_cmp(&a.loss));
    verdict
}

fn judge_regime(
    model: &Model,
    kernels: &[Kernel],
    entries: &[Entry],
    schedule: &Schedule,
    regime: &Regime,
    verdict: &mut Verdict,
) {
    let references: Vec<Reference> = regime
        .states
        .iter()
        .map(|state| Reference {
            plain: schedule.evaluate(state, None),
            exact: schedule.evaluate(state, None),
        })
        .collect();
    let usable = away_from_kinks(schedule, &references);
    let found: Vec<Vec<Option<Results>>> = regime
        .states
        .iter()
        .map(|state| {
            let environment = environment(model, state);
            let run = |kernel: &Kernel| interpret(&kernel.program, &environment).ok();
            kernels.iter().map(run).collect()
        })
        .collect();
    // By state and then by place: what is not known of the results, where it has been asked for.
    let mut unknown: Vec<Option<Vec<f64>>> = vec![None; regime.states.len()];
    for entry in entries {
        let place = schedule.place(entry.formula);
        let mut samples: Vec<Sample> = Vec::new();
        for (state, reference) in references.iter().enumerate() {
            let (plain, exact) = (reference.plain[place], reference.exact[place]);
            let within_range = plain.is_finite() && exact.hi.is_finite() && exact.lo.is_finite();
            if !usable[state] || !within_range {
                continue;
            }
            let value = |(kernel, results): (&Kernel, &Option<Results>)| {
                let wanted = kernel.arrays.contains(&entry.array);
                let value = || results.as_ref().map_or(f64::NAN, |found| entry.of(found));
                wanted.then(value)
            };
            samples.push(Sample {
                allowance: distance(plain, exact) + ulp(exact.hi) + UNDERFLOW,
                exact,
                plain,
                found: kernels.iter().zip(&found[state]).map(value).collect(),
                state,
            });
        }
        verdict.compared += 1;
        let allowed = largest(samples.iter().map(|sample| sample.allowance));
        let worst = worst_of(&samples, kernels.len());
        let differing = differing(&samples);
        let raw = worst.as_ref().map_or(0.0, |worst| worst.error / allowed);
        let raw_difference = differing
            .as_ref()
            .map_or(0.0, |worst| worst.error / allowed);
        verdict.raw = verdict.raw.max(raw);
        if raw.max(raw_difference) <= LIMIT {
            verdict.loss = verdict.loss.max(raw);
            continue;
        }
        let with_angles = samples.iter().map(|sample| {
            let known = &mut unknown[sample.state];
            let unknown = known.get_or_insert_with(|| {
                let state = &regime.states[sample.state];
                unknown_by_angles(schedule, state, &references[sample.state])
            });
            sample.allowance + unknown[place]
        });
        let allowed_with_angles = largest(with_angles);
        if let Some(worst) = worst {
            let loss = worst.error / allowed_with_angles;
            verdict.loss = verdict.loss.max(loss);
            if raw > LIMIT {
                let sample = &samples[worst.sample];
                record(
                    &mut verdict.offences,
                    Offence {
                        raw,
                        loss,
                        entry: entry.name.clone(),
                        kernel: kernels[worst.kernels[0]].name,
                        regime: regime.name.clone(),
                        state: regime.states[sample.state].clone(),
                        found: sample.found[worst.kernels[0]].unwrap_or(f64::NAN),
                        plain: sample.plain,
                        exact: sample.exact.hi,
                    },
                    |offence| (&offence.entry, offence.loss, offence.raw),
                );
            }
        }
        if let Some(worst) = differing.filter(|_| raw_difference > LIMIT) {
            let sample = &samples[worst.sample];
            let value = |kernel: usize| sample.found[kernel].unwrap_or(f64::NAN);
            record(
                &mut verdict.disagreements,
                Disagreement {
                    raw: raw_difference,
                    loss: worst.error / allowed_with_angles,
                    entry: entry.name.clone(),
                    kernels: worst.kernels.map(|kernel| kernels[kernel].name),
                    regime: regime.name.clone(),
                    state: regime.states[sample.state].clone(),
                    found: worst.kernels.map(value),
                    exact: sample.exact.hi,
                },
                |found| (&found.entry, found.loss, found.raw),
            );
        }
    }
}

/// Keeps the worst of each entry.
fn record<T>(known: &mut Vec<T>, new: T, key: impl Fn(&T) -> (&String, f64, f64)) {
    let (name, loss, raw) = key(&new);
    match known.iter_mut().find(|old| key(old).0 == name) {
        Some(old) => {
            let (_, old_loss, old_raw) = key(old);
            if (old_loss, old_raw) < (loss, raw) {
                *old = new;
            }
        }
        None => known.push(new),
    }
}

/// The largest error: in which sample, of which kernels.
struct Worst {
    error: f64,
    sample: usize,
    kernels: [usize; 2],
}

fn worst_of(samples: &[Sample], kernels: usize) -> Option<Worst> {
    let mut worst: Option<Worst> = None;
    for (number, sample) in samples.iter().enumerate() {
        for kernel in 0..kernels {
            let Some(found) = sample.found[kernel] else {
                continue;
            };
            let error = size(distance(found, sample.exact));
            if worst.as_ref().is_none_or(|worst| error > worst.error) {
                worst = Some(Worst {
                    error,
                    sample: number,
                    kernels: [kernel; 2],
                });
            }
        }
    }
    worst
}

fn differing(samples: &[Sample]) -> Option<Worst> {
    let mut worst: Option<Worst> = None;
    for (number, sample) in samples.iter().enumerate() {
        let found = sample.found.iter().enumerate();
        let mut found: Vec<(usize, f64)> = found
            .filter_map(|(kernel, value)| Some((kernel, (*value)?)))
            .collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        if let [least, .., most] = found[..] {
            let error = size(most.1 - least.1);
            if worst.as_ref().is_none_or(|worst| error > worst.error) {
                worst = Some(Worst {
                    error,
                    sample: number,
                    kernels: [least.0, most.0],
                });
            }
        }
    }
    worst
}

/// NaN counts as infinite.
fn size(error: f64) -> f64 {
    if error.is_nan() { f64::INFINITY } else { error }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(UNDERFLOW, f64::max)
}

fn distance(found: f64, exact: DoubleDouble) -> f64 {
    DoubleDouble::from(found).subtract(exact).hi.abs()
}

/// Whether the formula as written is on the right side of all its switches, whatever its rounding.
fn away_from_kinks(schedule: &Schedule, references: &[Reference]) -> Vec<bool> {
    let mut usable = vec![true; references.len()];
    for (left, right) in schedule.switches() {
        let sides: Vec<(f64, f64)> = references
            .iter()
            .map(|reference| {
                let exact = |at: usize| reference.exact[at];
                let plain = |at: usize| distance(reference.plain[at], reference.exact[at]);
                match right {
                    Some(right) => {
                        let difference = exact(left).subtract(exact(right)).hi.abs();
                        (difference, plain(left) + plain(right))
                    }
                    None => (exact(left).hi.abs(), plain(left)),
                }
            })
            .collect();
        let noise = largest(sides.iter().map(|(_, error)| *error));
        for (usable, (difference, _)) in usable.iter_mut().zip(&sides) {
            // Where the formula has no rounding at all, its kink itself is a state like any other.
            *usable &= noise <= UNDERFLOW || *difference > KINK * noise;
        }
    }
    usable
}

/// How much all values change by half an ulp of each part of each angle.
fn unknown_by_angles(schedule: &Schedule, state: &State, reference: &Reference) -> Vec<f64> {
    let mut unknown = vec![0.0; reference.exact.len()];
    for angle in schedule.angles() {
        let amount = schedule.uncertainty(angle, &reference.plain);
        let shifted: Vec<DoubleDouble> = schedule.evaluate(state, Some((angle, amount)));
        for ((unknown, shifted), exact) in unknown.iter_mut().zip(shifted).zip(&reference.exact) {
            let change = shifted.subtract(*exact).hi.abs();
            if change.is_finite() {
                *unknown += change;
            }
        }
    }
    unknown
}
