//! What a fit looks for.

use super::error::FitError;
use std::f64::consts::FRAC_PI_2;
use tfe_runtime::{Model, State};

/// What is looked for: parameters, then the numbers of the start, ordered (p, q).
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    pub(super) names: Vec<String>,
    /// The parameters, by their index among all of the model.
    pub(super) parameters: Vec<usize>,
    ways: Vec<Way>,
    /// The first values.
    pub(super) first: Vec<f64>,
}

/// How a value with bounds x follows from a number without, u.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// x = u
    Free,
    /// x = end ± unit (√(u² + 1) − 1)
    Beyond { end: f64, unit: f64 },
    /// x = low + width sin² u
    Between { low: f64, width: f64 },
}

impl Way {
    fn new(low: f64, high: f64, value: f64) -> Self {
        let unit = |end: f64| match (value - end).abs().max(end.abs()) {
            0.0 => 1.0,
            size => size,
        };
        match (low.is_finite(), high.is_finite()) {
            (false, false) => Self::Free,
            (true, false) => Self::Beyond {
                end: low,
                unit: unit(low),
            },
            (false, true) => Self::Beyond {
                end: high,
                unit: -unit(high),
            },
            (true, true) => Self::Between {
                low,
                width: high - low,
            },
        }
    }

    /// x and dx/du.
    fn value(self, u: f64) -> (f64, f64) {
        match self {
            Self::Free => (u, 1.0),
            Self::Beyond { end, unit } => {
                let root = u.hypot(1.0);
                // √(u² + 1) − 1, with all digits where u is small.
                (end + unit * (u * (u / (root + 1.0))), unit * u / root)
            }
            Self::Between { low, width } => {
                let (sin, cos) = u.sin_cos();
                (low + width * (sin * sin), 2.0 * width * sin * cos)
            }
        }
    }

    /// u of x; where x is a bound it does not move with u, which is then a little inside.
    fn number(self, x: f64) -> f64 {
        const INSIDE: f64 = 1e-2;
        match self {
            Self::Free => x,
            Self::Beyond { end, unit } => {
                let beyond = (x - end) / unit;
                let u = (beyond * (beyond + 2.0)).sqrt();
                if u > 0.0 { u } else { INSIDE }
            }
            Self::Between { low, width } => {
                let part = (x - low) / width;
                if part <= 0.0 {
                    INSIDE
                } else if part >= 1.0 {
                    FRAC_PI_2 - INSIDE
                } else {
                    part.sqrt().asin()
                }
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
            ways: Vec::new(),
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
            // Of a value that is NaN the first run tells.
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
            unknowns.push(name.clone(), Way::new(low, high, value), value);
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
                unknowns.push(name, Way::Free, start.p[a]);
            }
            for a in 0..N {
                let name = format!("{} at the start", M::coordinate_name(a));
                unknowns.push(name, Way::Free, start.q[a]);
            }
        }
        if unknowns.names.is_empty() {
            return Err(FitError::NothingUnknown);
        }
        Ok(unknowns)
    }

    fn push(&mut self, name: String, way: Way, value: f64) {
        self.names.push(name);
        self.ways.push(way);
        self.first.push(value);
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The values of numbers without bounds, and their rates.
    pub(super) fn values(&self, numbers: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let ways = self.ways.iter().zip(numbers);
        ways.map(|(way, u)| way.value(*u)).unzip()
    }

    /// Numbers without bounds for the first values.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let ways = self.ways.iter().zip(&self.first);
        ways.map(|(way, x)| way.number(*x)).collect()
    }
}
