//! The passes of `model(Name, …)`: their entries, with formulas in the arena.

use super::{Lowerer, Setting};
use crate::check::{Symbol, reserved};
use crate::diagnostic::{Kind, Span, nearest};
use crate::expr::graph::ExprId;
use crate::expr::input::Input;
use crate::syntax::ast::{self, Entry, Expr, ExprKind, Name};
use crate::syntax::context::FieldKind;
use crate::variants::{Assignment, Ignored, MAX_DEGREE, Pass, Spring, Step, Target};

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
            "rigid" => self.rigid(pass)?,
            "elastic" => self.elastic(pass)?,
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

    /// `rigid(rod = k)`
    fn rigid(&mut self, pass: &ast::Pass) -> Option<(Pass, String)> {
        let springs = self.springs("rigid", pass, Self::stiffness)?;
        let words: Vec<String> = springs
            .iter()
            .map(|spring| {
                format!(
                    "spring `{}` rigid as `{}`",
                    spring.stiffness, spring.constraint
                )
            })
            .collect();
        Some((Pass::Rigid(springs), words.join(", ")))
    }

    /// `elastic(rod = k)`
    fn elastic(&mut self, pass: &ast::Pass) -> Option<(Pass, String)> {
        let springs = self.springs("elastic", pass, Self::new_stiffness)?;
        let words: Vec<String> = springs
            .iter()
            .map(|spring| {
                format!(
                    "constraint `{}` elastic with stiffness `{}`",
                    spring.constraint, spring.stiffness
                )
            })
            .collect();
        Some((Pass::Elastic(springs), words.join(", ")))
    }

    /// All mistakes of a list are reported.
    fn springs(
        &mut self,
        word: &'static str,
        pass: &ast::Pass,
        stiffness: fn(&mut Self, &str, Span) -> Option<()>,
    ) -> Option<Vec<Spring>> {
        if pass.entries.is_empty() {
            self.report(pass.word.span, Kind::PassEntry { pass: word });
        }
        let mut springs = Vec::new();
        for entry in &pass.entries {
            let constraint = entry.target.as_ref().and_then(target);
            let constraint = constraint.filter(|target| !target.rate);
            let span = entry.target.as_ref().unwrap_or(&entry.value).span;
            let (Some(constraint), ExprKind::Name(name)) = (constraint, &entry.value.node) else {
                self.report(span, Kind::PassEntry { pass: word });
                continue;
            };
            if stiffness(self, name, entry.value.span).is_some() {
                springs.push(Spring {
                    constraint,
                    span,
                    stiffness: Name::new(name.clone(), entry.value.span),
                });
            }
        }
        (springs.len() == pass.entries.len() && !springs.is_empty()).then_some(springs)
    }

    /// A field of type `f64`.
    fn stiffness(&mut self, name: &str, span: Span) -> Option<()> {
        match self.symbol(name) {
            Some(Symbol::Field(at)) if self.context.fields[*at].kind == FieldKind::Scalar => {
                Some(())
            }
            Some(symbol) => {
                let found = format!("it is {}", symbol.role());
                let field = name.to_owned();
                self.report(span, Kind::NotASpring { field, found });
                None
            }
            None => {
                let fields = self.context.fields.iter();
                let scalars = fields.filter(|field| field.kind == FieldKind::Scalar);
                let kind = Kind::UnknownParameter {
                    name: name.to_owned(),
                    nearest: nearest(name, scalars.map(|field| field.name.as_str())),
                };
                self.report(span, kind);
                None
            }
        }
    }

    /// Checks that a name is not in use.
    fn new_stiffness(&mut self, name: &str, span: Span) -> Option<()> {
        let taken = self.symbol(name).map(|symbol| Kind::NameClash {
            name: name.to_owned(),
            taken: symbol.role(),
        });
        match taken.or_else(|| reserved(name, false)) {
            Some(kind) => {
                self.report(span, kind);
                None
            }
            None => Some(()),
        }
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

    /// A value that does not depend on the state.
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
            Input::Placeholder(..)
            | Input::Parameter(_)
            | Input::ParameterElement(..)
            | Input::Integer(_) => true,
            Input::Time => pass == "frozen",
            Input::Coordinate(_)
            | Input::Velocity(_)
            | Input::Momentum(_)
            | Input::Control(_)
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
