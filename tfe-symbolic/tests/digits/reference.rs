//! The formulas of a model at some states: plainly in `f64`, exactly, and what is not known of them.

use super::double_double::DoubleDouble;
use super::entries::Entry;
use super::formula::{Schedule, State, ulp};

/// Added to what the formula may lose: below it, double-double numbers have no more digits than others.
pub const UNDERFLOW: f64 = 1e-250;

/// A state is left out where the formula may lose more than this: nothing could exceed a multiple of it.
pub const MAX: f64 = f64::MAX / 1024.0;

/// A state is left out where a switch is nearer to its kink than so many times the rounding of the formula.
const KINK: f64 = 16.0;

/// All values at one state.
struct Values<'a> {
    state: &'a State,
    plain: Vec<f64>,
    exact: Vec<DoubleDouble>,
    /// Plainly, by the schedule of derivatives in reverse mode.
    reverse: Vec<f64>,
    /// By how much all values change with the angles, once it has been asked for.
    by_angles: Option<Vec<f64>>,
}

/// A value at one state.
#[derive(Clone, Copy, Debug)]
pub struct Value {
    /// The number of the state.
    pub state: usize,
    pub plain: f64,
    pub exact: DoubleDouble,
    /// The larger error of the formula in forward and in reverse mode.
    rounding: f64,
}

impl Value {
    /// What the formula loses, and an ulp of the value.
    pub fn allowance(&self) -> f64 {
        self.rounding + ulp(self.exact.hi) + UNDERFLOW
    }
}

/// The values at all states of a regime.
pub struct Reference<'a> {
    schedule: &'a Schedule,
    reverse: &'a Schedule,
    values: Vec<Values<'a>>,
    /// Whether a state is away from all kinks.
    usable: Vec<bool>,
}

impl<'a> Reference<'a> {
    /// By the schedules of the formulas in forward and in reverse mode.
    pub fn of(schedule: &'a Schedule, reverse: &'a Schedule, states: &'a [State]) -> Self {
        let mut reference = Self {
            schedule,
            reverse,
            values: Vec::new(),
            usable: Vec::new(),
        };
        reference.extend(states);
        reference
    }

    /// Adds states.
    pub fn extend(&mut self, states: &'a [State]) {
        let (schedule, reverse) = (self.schedule, self.reverse);
        self.values.extend(states.iter().map(|state| Values {
            state,
            plain: schedule.evaluate(state, None),
            exact: schedule.evaluate(state, None),
            reverse: reverse.evaluate(state, None),
            by_angles: None,
        }));
        self.usable = self.away_from_kinks();
    }

    /// The value of an entry at all states that count: where the formula is finite and away from kinks, and what it
    /// loses is known.
    pub fn values(&self, entry: &Entry) -> Vec<Value> {
        let place = self.schedule.place(entry.formula);
        let other = self.reverse.place(entry.reverse);
        let value = |(state, values): (usize, &Values)| {
            let (plain, exact) = (values.plain[place], values.exact[place]);
            let reverse = values.reverse[other];
            let forward = distance(plain, exact);
            // Reverse mode may overflow where forward mode does not.
            let backward = distance(reverse, exact);
            let rounding = if backward > forward {
                backward
            } else {
                forward
            };
            let finite = plain.is_finite() && exact.hi.is_finite() && exact.lo.is_finite();
            let value = Value {
                state,
                plain,
                exact,
                rounding,
            };
            let is_known = value.allowance() <= MAX;
            (finite && is_known && self.usable[state]).then_some(value)
        };
        self.values.iter().enumerate().filter_map(value).collect()
    }

    /// By how much a value changes where each part of each angle does by half an ulp.
    pub fn by_angles(&mut self, value: &Value, entry: &Entry) -> f64 {
        let place = self.schedule.place(entry.formula);
        let values = &mut self.values[value.state];
        let (schedule, state) = (self.schedule, values.state);
        let (plain, exact) = (&values.plain, &values.exact);
        values
            .by_angles
            .get_or_insert_with(|| changes_by_angles(schedule, state, plain, exact))[place]
    }

    /// Whether the formula as written is on the right side of all its switches, whatever its rounding.
    ///
    /// Exactly at a kink, derivatives are a matter of convention and not of digits.
    fn away_from_kinks(&self) -> Vec<bool> {
        let mut usable = vec![true; self.values.len()];
        for (left, right) in self.schedule.switches() {
            let side = |values: &Values| {
                let rounding = |at: usize| distance(values.plain[at], values.exact[at]);
                let left_value = values.exact[left];
                match right {
                    Some(right) => {
                        let difference = left_value.subtract(values.exact[right]);
                        (difference.hi.abs(), rounding(left) + rounding(right))
                    }
                    None => (left_value.hi.abs(), rounding(left)),
                }
            };
            let sides: Vec<(f64, f64)> = self.values.iter().map(side).collect();
            let rounding = sides.iter().map(|(_, rounding)| *rounding);
            let rounding = rounding.fold(UNDERFLOW, f64::max);
            for (usable, (difference, _)) in usable.iter_mut().zip(&sides) {
                *usable &= *difference > KINK * rounding;
            }
        }
        usable
    }
}

fn changes_by_angles(
    schedule: &Schedule,
    state: &State,
    plain: &[f64],
    exact: &[DoubleDouble],
) -> Vec<f64> {
    let mut changes = vec![0.0; exact.len()];
    for angle in schedule.angles() {
        let amount = schedule.uncertainty(angle, plain);
        let shifted: Vec<DoubleDouble> = schedule.evaluate(state, Some((angle, amount)));
        for ((sum, shifted), exact) in changes.iter_mut().zip(shifted).zip(exact) {
            let change = shifted.subtract(*exact).hi.abs();
            if change.is_finite() {
                *sum += change;
            }
        }
    }
    changes
}

/// |found − exact|
pub fn distance(found: f64, exact: DoubleDouble) -> f64 {
    DoubleDouble::from(found).subtract(exact).hi.abs()
}
