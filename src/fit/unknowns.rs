//! The unknowns of a fit, and their transformation to unbounded variables.

use super::error::FitError;
use std::f64::consts::FRAC_PI_2;
use tfe_runtime::{Model, State};

/// The unknowns: parameters, then the components of the start in the order (p, q).
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    pub(super) names: Vec<String>,
    /// The indices of the parameters in the model.
    pub(super) parameters: Vec<usize>,
    transformations: Vec<Transformation>,
    /// The first values.
    pub(super) first: Vec<f64>,
}

/// The transformation from an unbounded variable u to a value x with bounds: x = ±X, with the sign such that the lower
/// bound of X is the one closer to zero. If zero lies between the bounds, X is measured from zero, so that small values
/// keep their digits even between distant bounds.
#[derive(Clone, Copy, Debug)]
struct Transformation {
    /// 1, or −1 if the upper bound is closer to zero.
    sign: f64,
    low: f64,
    high: f64,
    /// X at u = 0: the lower bound, or zero.
    origin: f64,
    shape: Shape,
}

/// X as a function of u.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// X = u
    Free,
    /// X = origin + unit (√((u + shift)² + 1) − √(shift² + 1))
    Beyond { unit: f64, shift: f64 },
    /// X = origin + width (sin² (u + shift) − sin² shift)
    Between { width: f64, shift: f64 },
}

impl Transformation {
    /// The transformation of a value without bounds.
    const FREE: Self = Self {
        sign: 1.0,
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
        origin: 0.0,
        shape: Shape::Free,
    };

    fn new(low: f64, high: f64, value: f64) -> Self {
        // A bound at the largest finite number is no restriction.
        let bounds = [-low, high].map(|end| if end < f64::MAX { end } else { f64::INFINITY });
        let [low, high] = [-bounds[0], bounds[1]];
        if low.is_infinite() && high.is_infinite() {
            return Self::FREE;
        }
        let (sign, low, high, value) = match high.abs() < low.abs() {
            true => (-1.0, -high, -low, -value),
            false => (1.0, low, high, value),
        };
        let origin = low.max(0.0);
        let shape = match high.is_finite() {
            true => Shape::Between {
                width: high - low,
                // The position of zero between the bounds is sin² shift.
                shift: (origin - low).sqrt().atan2((high - origin).sqrt()),
            },
            false => {
                let unit = match (value - low).abs().max(low.abs()) {
                    0.0 => 1.0,
                    size => size,
                };
                let beyond = (origin - low) / unit;
                Shape::Beyond {
                    unit,
                    shift: (beyond * (beyond + 2.0)).sqrt(),
                }
            }
        };
        Self {
            sign,
            low,
            high,
            origin,
            shape,
        }
    }

    /// The value x and its derivative dx/du.
    fn value(self, u: f64) -> (f64, f64) {
        let (more, rate) = match self.shape {
            Shape::Free => return (u, 1.0),
            Shape::Beyond { unit, shift } => {
                let (root, first) = ((u + shift).hypot(1.0), shift.hypot(1.0));
                // The difference of the roots, written without cancellation for small u.
                let difference = u * ((u + 2.0 * shift) / (root + first));
                (unit * difference, unit * (u + shift) / root)
            }
            Shape::Between { width, shift } => {
                let difference = u.sin() * (u + 2.0 * shift).sin();
                (width * difference, width * (2.0 * (u + shift)).sin())
            }
        };
        let value = (self.origin + more).clamp(self.low, self.high);
        // At a bound the rounding error of the angle would count as a rate.
        let is_inside = self.low < value && value < self.high;
        let rate = if is_inside { rate } else { 0.0 };
        (self.sign * value, self.sign * rate)
    }

    /// The value x moved by a distance away from a bound to which it is nearer than that, though not beyond the middle of
    /// the bounds; `None` elsewhere.
    fn released(self, x: f64, distance: f64) -> Option<f64> {
        let (value, step) = (self.sign * x, self.sign * distance);
        let (above, below) = (value - self.low, self.high - value);
        let (passed, room) = if step > 0.0 {
            (above, below)
        } else {
            (below, above)
        };
        let moved = value + step.signum() * step.abs().min(0.5 * room);
        let is_inside = self.low < moved && moved < self.high;
        (passed < step.abs() && is_inside).then_some(self.sign * moved)
    }

    /// The variable u of a value x.
    fn number(self, x: f64) -> f64 {
        let value = self.sign * x;
        let more = value - self.origin;
        match self.shape {
            Shape::Free => x,
            Shape::Beyond { shift, .. } if value <= self.low => -shift,
            Shape::Beyond { unit, shift } => {
                let part = more / unit;
                let change = part * (2.0 * shift.hypot(1.0) + part);
                change / ((shift * shift + change).max(0.0).sqrt() + shift)
            }
            Shape::Between { shift, .. } if value <= self.low => -shift,
            Shape::Between { shift, .. } if value >= self.high => FRAC_PI_2 - shift,
            Shape::Between { width, .. } => {
                // The sine of the difference of two angles, from their sines and cosines.
                let [from, to] = [self.origin, value].map(|at| {
                    let parts = [at - self.low, self.high - at];
                    parts.map(|part| (part / width).sqrt())
                });
                (more / width / (to[0] * from[1] + from[0] * to[1])).asin()
            }
        }
    }
}

impl Unknowns {
    pub(super) fn new<M: Model<N>, const N: usize>(
        model: &M,
        (names, bounds): (&[String], &[(String, f64, f64)]),
        (start, start_is_known): (&State<N>, bool),
    ) -> Result<Self, FitError> {
        let mut unknowns = Self {
            names: Vec::new(),
            parameters: Vec::new(),
            transformations: Vec::new(),
            first: Vec::new(),
        };
        for name in names {
            let index = model.find_parameter(name);
            let index = index.filter(|index| !unknowns.parameters.contains(index));
            let index = index.ok_or_else(|| FitError::NoParameter {
                name: name.clone(),
                known: (0..model.parameters())
                    .map(|at| model.parameter_name(at).to_string())
                    .collect(),
            })?;
            let value = model.parameter(index);
            if model.with_parameter(index, value).is_none() {
                return Err(FitError::NotCopied);
            }
            let own = bounds.iter().rev().find(|(own, ..)| own == name);
            let (low, high) = own.map_or((f64::NEG_INFINITY, f64::INFINITY), |one| (one.1, one.2));
            // A NaN is reported by the first run.
            let is_within = value.is_nan() || (low..=high).contains(&value);
            if !(low < high && is_within) {
                return Err(FitError::Bounds {
                    name: name.clone(),
                    low,
                    high,
                    value,
                });
            }
            unknowns.parameters.push(index);
            unknowns.push(name.clone(), Transformation::new(low, high, value), value);
        }
        let stray = bounds.iter().find(|(own, ..)| !names.contains(own));
        if let Some((name, low, high)) = stray {
            return Err(FitError::Bounds {
                name: name.clone(),
                low: *low,
                high: *high,
                value: f64::NAN,
            });
        }
        if !start_is_known {
            for a in 0..N {
                let name = format!("momentum of {} at the start", M::coordinate_name(a));
                unknowns.push(name, Transformation::FREE, start.p[a]);
            }
            for a in 0..N {
                let name = format!("{} at the start", M::coordinate_name(a));
                unknowns.push(name, Transformation::FREE, start.q[a]);
            }
        }
        if unknowns.names.is_empty() {
            return Err(FitError::NothingUnknown);
        }
        Ok(unknowns)
    }

    fn push(&mut self, name: String, transformation: Transformation, value: f64) {
        self.names.push(name);
        self.transformations.push(transformation);
        self.first.push(value);
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The values for given unbounded variables, and their derivatives.
    pub(super) fn values(&self, numbers: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let transformations = self.transformations.iter().zip(numbers);
        transformations
            .map(|(transformation, u)| transformation.value(*u))
            .unzip()
    }

    /// The unbounded variable of a value of one unknown, moved by a distance away from a bound that is nearer than that;
    /// `None` if there is none.
    pub(super) fn released(&self, place: usize, value: f64, distance: f64) -> Option<f64> {
        let transformation = self.transformations[place];
        Some(transformation.number(transformation.released(value, distance)?))
    }

    /// The unbounded variables of the first values.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let transformations = self.transformations.iter().zip(&self.first);
        transformations
            .map(|(transformation, x)| transformation.number(*x))
            .collect()
    }
}
