//! Programs as text.
//!
//! ```text
//! t0 = q[0] - q[1]
//! (t1, t2) = sin_cos(t0)
//! for i in 0..n
//!   L_q[i] += t2
//! ```

use std::fmt;

use crate::program::place::{Array, Place, Shape};
use crate::program::{Operand, Operation, Program, Statement, Temporary};

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        list(&self.statements, 0, f)
    }
}

/// Recursion is as deep as the loops nest.
fn list(statements: &[Statement], depth: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for statement in statements {
        write!(f, "{:1$}", "", 2 * depth)?;
        match statement {
            Statement::Let { target, operation } => writeln!(f, "{target} = {operation}")?,
            Statement::SineCosine {
                sine,
                cosine,
                argument,
            } => writeln!(f, "({sine}, {cosine}) = sin_cos({argument})")?,
            Statement::Accumulator {
                target,
                start: value,
            }
            | Statement::Assign { target, value } => writeln!(f, "{target} = {value}")?,
            Statement::Accumulate { target, value } => writeln!(f, "{target} += {value}")?,
            Statement::Store {
                output,
                value,
                accumulate,
            } => {
                writeln!(
                    f,
                    "{output} {} {value}",
                    if *accumulate { "+=" } else { "=" }
                )?;
            }
            Statement::Balance { output, length } => {
                writeln!(f, "balance {output}, {length} entries")?;
            }
            Statement::Clear { array } => writeln!(f, "clear {}", name(*array))?,
            Statement::Loop {
                variable,
                start,
                end,
                body,
            } => {
                writeln!(f, "for {variable} in {start}..{end}")?;
                list(body, depth + 1, f)?;
            }
        }
    }
    Ok(())
}

/// The name of an array of results: E is the energy function, z the velocity or the momentum, Q the generalized force, A and a belong to
/// constraints.
fn name(array: Array) -> &'static str {
    match array {
        Array::Value => "E",
        Array::ByZ => "E_z",
        Array::ByQ => "E_q",
        Array::Force => "Q",
        Array::ZZ => "E_zz",
        Array::ZQ => "E_zq",
        Array::QQ => "E_qq",
        Array::ForceZ => "Q_z",
        Array::ForceQ => "Q_q",
        Array::Observable(_) | Array::SiteObservable => "output",
        Array::Phi(_) | Array::SitePhi => "phi",
        Array::Row(_) | Array::SiteRow => "A",
        Array::Drift(_) | Array::SiteDrift => "a",
        Array::PsiQ(_) => "psi_q",
        Array::RowRate(_) => "A_rate",
        Array::Bend => "bend",
        Array::RateQ => "rate_q",
        Array::RateV => "rate_v",
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name(self.array))?;
        let number = self.array.number().map(|number| number.to_string());
        let indices = match self.array.shape() {
            Shape::Number => Vec::new(),
            Shape::Vector => vec![&self.row],
            Shape::Matrix => vec![&self.row, &self.column],
        };
        let indices = indices.into_iter().map(ToString::to_string);
        let all: Vec<String> = number.into_iter().chain(indices).collect();
        match all[..] {
            [] => Ok(()),
            _ => write!(f, "[{}]", all.join(", ")),
        }
    }
}

impl fmt::Display for Temporary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "t{}", self.0)
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Temporary(temporary) => temporary.fmt(f),
            Self::Constant(value) => value.fmt(f),
            Self::Input(input) => input.fmt(f),
        }
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Add(a, b) => write!(f, "{a} + {b}"),
            Self::Subtract(a, b) => write!(f, "{a} - {b}"),
            Self::Multiply(a, b) => write!(f, "{a} * {b}"),
            Self::Divide(a, b) => write!(f, "{a} / {b}"),
            Self::Negate(a) => write!(f, "-{a}"),
            Self::IntegerPower(a, n) => write!(f, "{a}^{n}"),
            Self::Power(a, b) => write!(f, "{a}^{b}"),
            Self::Call(function, arguments) => {
                let arguments: Vec<String> = arguments.iter().map(ToString::to_string).collect();
                write!(f, "{function}({})", arguments.join(", "))
            }
            Self::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let sign = comparison.symbol();
                write!(f, "select({left} {sign} {right}, {then}, {otherwise})")
            }
        }
    }
}
