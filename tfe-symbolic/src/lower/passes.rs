//! The passes of `model(Name, …)`: their entries, with formulas in the arena.

use super::{Lowerer, Setting};
use crate::ast::{self, Entry, Expr, ExprKind, Name};
use crate::diagnostic::Kind;
use crate::graph::ExprId;
use crate::input::Input;
use crate::reduce::{Assignment, Ignored, MAX_DEGREE, Pass, Step, Target};

impl Lowerer<'_> {
    /// The models made from this one: name, and what is done from left to right.
    pub(super) fn variants(&mut self) -> Vec<(Name, Vec<Step>)> {
        let model = self.model;
        let mut variants = Vec::new();
        for (name, passes) in &model.variants {
            let steps = passes.iter().filter_map(|pass| self.step(pass)).collect();
            variants.push((name.clone(), steps));
        }
        variants
    }

    /// `None` where a mistake has been reported.
    fn step(&mut self, pass: &ast::Pass) -> Option<Step> {
        let (lowered, words) = match pass.word.node.as_str() {
            "truncated" => self.truncated(pass)?,
            "frozen" => self.frozen(pass)?,
            "routh" => self.routh(pass)?,
            _ => return None,
        };
        Some(Step {
            pass: lowered,
            span: pass.word.span,
            words,
        })
    }

    /// `truncated(k, x = e, dot(x) = e)`
    fn truncated(&mut self, pass: &ast::Pass) -> Option<(Pass, String)> {
        let wrong = Kind::PassEntry { pass: "truncated" };
        let Some((first, rest)) = pass.entries.split_first() else {
            self.report(pass.word.span, wrong);
            return None;
        };
        let (None, ExprKind::Number(digits)) = (&first.target, &first.value.node) else {
            let target = first.target.as_ref().unwrap_or(&first.value);
            self.report(target.span, wrong);
            return None;
        };
        let degree = digits.replace('_', "").parse().ok();
        let Some(degree) = degree.filter(|degree| (2..=MAX_DEGREE).contains(degree)) else {
            let limit = MAX_DEGREE;
            self.report(first.value.span, Kind::TruncationDegree { limit });
            return None;
        };
        let point = self.assignments("truncated", rest)?;
        let mut words = format!("truncated to degree {degree}");
        if !point.is_empty() {
            words += &format!(" about {}", quoted(rest));
        }
        Some((Pass::Truncated { degree, point }, words))
    }

    /// `frozen(r = e)`
    fn frozen(&mut self, pass: &ast::Pass) -> Option<(Pass, String)> {
        if pass.entries.is_empty() {
            self.report(pass.word.span, Kind::PassEntry { pass: "frozen" });
            return None;
        }
        let held = self.assignments("frozen", &pass.entries)?;
        Some((
            Pass::Frozen(held),
            format!("frozen {}", quoted(&pass.entries)),
        ))
    }

    /// `routh(phi, psi)`
    fn routh(&mut self, pass: &ast::Pass) -> Option<(Pass, String)> {
        let wrong = Kind::PassEntry { pass: "routh" };
        if pass.entries.is_empty() {
            self.report(pass.word.span, wrong);
            return None;
        }
        let mut ignored = Vec::new();
        for entry in &pass.entries {
            let own = target(&entry.value).filter(|target| entry.target.is_none() && !target.rate);
            let Some(target) = own else {
                let place = entry.target.as_ref().unwrap_or(&entry.value);
                self.report(place.span, wrong);
                return None;
            };
            ignored.push(Ignored {
                target,
                span: entry.value.span,
            });
        }
        let words = format!("without {}", quoted(&pass.entries));
        Some((Pass::Routh(ignored), words))
    }

    /// All mistakes of a list are reported.
    fn assignments(&mut self, pass: &'static str, entries: &[Entry]) -> Option<Vec<Assignment>> {
        let read: Vec<_> = entries
            .iter()
            .map(|entry| self.assignment(pass, entry))
            .collect();
        read.into_iter().collect()
    }

    fn assignment(&mut self, pass: &'static str, entry: &Entry) -> Option<Assignment> {
        let Some(written) = &entry.target else {
            self.report(entry.value.span, Kind::PassEntry { pass });
            return None;
        };
        let value = self.fixed(pass, &entry.value);
        let target = target(written).filter(|target| pass != "frozen" || !target.rate);
        let Some(target) = target else {
            self.report(written.span, Kind::PassEntry { pass });
            return None;
        };
        Some(Assignment {
            target,
            span: written.span,
            value: value?,
        })
    }

    /// A value that holds nothing of the state.
    fn fixed(&mut self, pass: &'static str, value: &Expr) -> Option<ExprId> {
        let setting = Setting {
            dot: self.usual_dot,
            linear_loops: true,
        };
        let id = self.within(setting, |lowerer| {
            let id = lowerer.scalar(value)?;
            lowerer.no_loop(id, value.span)
        })?;
        let is_fixed = |input: &Input| match input {
            Input::Parameter(_) | Input::ParameterElement(..) | Input::Integer(_) => true,
            Input::Time => pass == "frozen",
            Input::Coordinate(_)
            | Input::Velocity(_)
            | Input::Momentum(_)
            | Input::Multiplier(_) => false,
        };
        if !self.graph.inputs_of(id).iter().all(is_fixed) {
            self.report(value.span, Kind::PassValue { pass });
            return None;
        }
        Some(id)
    }
}

/// `x`, `q[2]`, `dot(x)`
fn target(written: &Expr) -> Option<Target> {
    match &written.node {
        ExprKind::Name(name) => Some(Target {
            name: name.clone(),
            index: None,
            rate: false,
        }),
        ExprKind::Index { value, index } => match (&value.node, &index.node) {
            (ExprKind::Name(name), ExprKind::Number(digits)) => Some(Target {
                name: name.clone(),
                index: Some(digits.replace('_', "").parse().ok()?),
                rate: false,
            }),
            _ => None,
        },
        ExprKind::Call {
            function,
            arguments,
        } => match (function.node.as_str(), &arguments[..]) {
            ("dot", [argument]) => {
                let own = target(argument).filter(|target| !target.rate)?;
                Some(Target { rate: true, ..own })
            }
            _ => None,
        },
        _ => None,
    }
}

/// `` `r = l`, `s = 0` ``
fn quoted(entries: &[Entry]) -> String {
    let entries: Vec<String> = entries.iter().map(|entry| format!("`{entry}`")).collect();
    entries.join(", ")
}
