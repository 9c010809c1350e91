//! The `let`s that contain rates: their meaning depends on that of `dot()` in the formula that uses them.

use crate::check::{Model, Symbol};
use crate::syntax::ast::{Expr, ExprKind};

/// Which `let`s hold a `dot()`, themselves or by those before them.
pub(super) fn lets_with_rates(model: &Model) -> Vec<bool> {
    let mut rates = Vec::with_capacity(model.lets.len());
    for (_, value) in &model.lets {
        let found = holds_rate(value, model, &rates);
        rates.push(found);
    }
    rates
}

fn holds_rate(expr: &Expr, model: &Model, rates: &[bool]) -> bool {
    let mut stack = vec![expr];
    while let Some(expr) = stack.pop() {
        match &expr.node {
            ExprKind::Call { function, .. }
                if matches!(function.node.as_str(), "dot" | "body_rate") =>
            {
                return true;
            }
            ExprKind::Name(name) => {
                if let Some(Symbol::Let(at)) = model.symbols.get(name)
                    && rates.get(*at).copied().unwrap_or(false)
                {
                    return true;
                }
            }
            _ => {}
        }
        stack.extend(expr.children());
    }
    false
}
