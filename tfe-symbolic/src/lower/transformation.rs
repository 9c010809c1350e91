//! The rate g of `time_transformation = g`: steps are taken in a time τ with dt = g dτ.

use super::{Lowerer, Setting};
use crate::diagnostic::Kind;
use crate::expr::graph::ExprId;

impl Lowerer<'_> {
    /// g of `time_transformation = g`, without loops.
    pub(super) fn rate_of_time(&mut self) -> Option<ExprId> {
        let (value, _) = self.model.time_transformation.as_ref()?;
        let setting = Setting {
            dot: self.usual_dot,
            linear_loops: true,
        };
        let rate = self.within(setting, |lowerer| {
            let rate = lowerer.scalar(value)?;
            lowerer.no_loop(rate, value.span)
        })?;
        // Without H there is a message already.
        self.hamiltonian?;
        let constant = self.graph.as_constant(rate);
        if constant.is_some_and(|rate| !(rate.to_f64() > 0.0)) {
            self.report(value.span, Kind::TransformationNotPositive);
            return None;
        }
        Some(rate)
    }
}
