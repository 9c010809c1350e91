//! Measured data.

use super::error::FitError;
use crate::numbers::Short;
use tfe_runtime::Model;

/// The measured values of one output, as given.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) name: String,
    pub(super) times: Vec<f64>,
    pub(super) values: Vec<f64>,
    pub(super) deviation: f64,
}

/// The same values, with the output resolved in the model.
#[derive(Debug)]
pub(super) struct Column<'a> {
    pub(super) place: Observed,
    pub(super) times: &'a [f64],
    pub(super) values: &'a [f64],
    pub(super) deviation: f64,
}

/// The quantity of a motion that was measured.
#[derive(Clone, Copy, Debug)]
pub(super) enum Observed {
    /// An output, by its index.
    Output(usize),
    /// A coordinate.
    Coordinate(usize),
}

impl<'a> Column<'a> {
    pub(super) fn new<M: Model<N>, const N: usize>(
        model: &M,
        measured: &'a Measured,
    ) -> Result<Self, FitError> {
        let Measured {
            name,
            times,
            values,
            deviation,
        } = measured;
        let output = (0..model.columns()).find(|at| model.column_name(*at).is(name));
        let coordinate = || (0..N).find(|a| M::coordinate_name(*a).is(name));
        let place = match output {
            Some(output) => Observed::Output(output),
            None => Observed::Coordinate(coordinate().ok_or_else(|| {
                FitError::NoOutput {
                    name: name.clone(),
                    known: (0..model.columns())
                        .map(|at| model.column_name(at).to_string())
                        .chain((0..N).map(|a| M::coordinate_name(a).to_string()))
                        .collect(),
                }
            })?),
        };
        let unusable = |number: &f64| !number.is_finite();
        let why = if times.len() != values.len() {
            let (times, values) = (times.len(), values.len());
            Some(format!("there are {times} times and {values} values"))
        } else if times.is_empty() {
            Some("there is none".to_owned())
        } else if let Some(at) = times.iter().position(unusable) {
            let time = Short(times[at]);
            Some(format!("its time [{at}] is {time}, but must be finite"))
        } else if let Some(at) = values.iter().position(unusable) {
            let (value, time) = (Short(values[at]), Short(times[at]));
            Some(format!(
                "its value [{at}], at t = {time}, is {value}, but must be finite"
            ))
        } else if !(*deviation > 0.0 && deviation.is_normal()) {
            // Divided by a number below all normal ones, most residuals would be infinite.
            Some(format!(
                "the standard deviation is {}, but must be positive, finite and not below 2.3e-308: give it in the unit of the output",
                Short(*deviation)
            ))
        } else {
            None
        };
        match why {
            Some(why) => Err(FitError::Measured {
                name: name.clone(),
                why,
            }),
            None => Ok(Self {
                place,
                times,
                values,
                deviation: *deviation,
            }),
        }
    }
}
