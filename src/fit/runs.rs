//! Runs with trial values of the unknowns, compared with the measurements.

use super::data::{Column, Observed};
use super::error::FitError;
use super::problem::{Compare, Compared};
use super::setup::Fit;
use super::unknowns::Unknowns;
use crate::motion::{Motion, is_unresolved, looked_at};
use crate::sensitivity::Sensitive;
use nalgebra::DMatrix;
use std::ops::Range;
use tfe_runtime::{Model, State};

/// Makes the runs of a fit.
pub(super) struct Runs<'f, M, const N: usize> {
    fit: &'f Fit<'f, M, N>,
    columns: Vec<Column<'f>>,
    unknowns: &'f Unknowns,
    /// The start, if it is not among the unknowns.
    start: Option<State<N>>,
    span: Range<f64>,
    times: Vec<f64>,
    /// The run with the last values.
    last: Option<Sensitive<N>>,
}

impl<'f, M: Model<N>, const N: usize> Runs<'f, M, N> {
    pub(super) fn new(
        fit: &'f Fit<'f, M, N>,
        columns: Vec<Column<'f>>,
        unknowns: &'f Unknowns,
        (t0, start): (f64, Option<State<N>>),
    ) -> Self {
        let measured = || columns.iter().flat_map(|one| one.times).copied();
        let known = [&fit.breaks[..], &[t0]].concat();
        let times = looked_at(measured(), &known);
        // If the last time cannot be a node, the adjacent number is used.
        let latest = measured().fold(t0, f64::max);
        let last = known.into_iter().find(|one| is_unresolved(*one, latest));
        let last = last.or(times.last().copied()).unwrap_or(t0);
        Self {
            fit,
            columns,
            unknowns,
            start,
            span: t0..last,
            times,
            last: None,
        }
    }

    /// The model with given values of the unknowns.
    pub(super) fn model(&self, values: &[f64]) -> Result<M, FitError> {
        let model = self.fit.model;
        let mut made = None;
        for (index, value) in self.unknowns.parameters.iter().zip(values) {
            let from = made.as_ref().unwrap_or(model);
            made = Some(
                from.with_parameter(*index, *value)
                    .ok_or(FitError::NotCopied)?,
            );
        }
        match made {
            Some(made) => Ok(made),
            // If only the start is unknown, the model is copied by setting any parameter to its own value.
            None => model
                .with_parameter(0, model.parameter(0))
                .ok_or(FitError::NotCopied),
        }
    }

    /// The last run, if there is one.
    pub(super) fn motion(&self) -> Option<&Motion<N>> {
        self.last.as_ref().map(Sensitive::motion)
    }

    /// The start of a run with given values of the unknowns.
    fn start(&self, values: &[f64]) -> State<N> {
        let own = &values[self.unknowns.parameters.len()..];
        self.start.unwrap_or_else(|| State {
            p: std::array::from_fn(|a| own[a]),
            q: std::array::from_fn(|a| own[N + a]),
        })
    }
}

impl<M: Model<N>, const N: usize> Compare for Runs<'_, M, N> {
    fn compare(&mut self, values: &[f64]) -> Result<Compared, FitError> {
        let model = self.model(values)?;
        let run = self.fit.simulation(&model, &self.times);
        let (start, span) = (self.start(values), self.span.clone());
        let sensitive = run.run_sensitive_by(start, span, &self.unknowns.parameters);
        let sensitive = sensitive.map_err(|error| FitError::Run(error.kind().clone()))?;
        let (mut residuals, mut slopes) = (Vec::new(), Vec::new());
        let motion = sensitive.motion();
        for column in &self.columns {
            for (t, measured) in column.times.iter().zip(column.values) {
                // Elements end at the measured times.
                let node = motion.nearest(*t);
                let (value, by_parameters, by_start) = match column.place {
                    Observed::Output(place) => sensitive.output_at(node, place),
                    Observed::Coordinate(a) => sensitive.coordinate_at(node, a),
                };
                residuals.push((value - measured) / column.deviation);
                let all = by_parameters.iter().chain(&by_start).take(values.len());
                slopes.extend(all.map(|slope| slope / column.deviation));
            }
        }
        let slopes = DMatrix::from_row_iterator(residuals.len(), values.len(), slopes);
        self.last = Some(sensitive);
        Ok(Compared { residuals, slopes })
    }
}
