//! Programs as text.
//!
//! ```text
//! t0 = q[0] - q[1]
//! (t1, t2) = sin_cos(t0)
//! for i in 0..n
//!   L_q[i] += t2
//! ```

use std::fmt;

use crate::program::{Operand, Operation, Output, Program, Statement, Temporary};
use crate::syntax::ast::Comparison;

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
            Statement::Clear { output } => writeln!(f, "clear {}", array(output))?,
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
fn array(output: &Output) -> &'static str {
    match output {
        Output::Value => "E",
        Output::ByZ(_) => "E_z",
        Output::ByQ(_) => "E_q",
        Output::Force(_) => "Q",
        Output::ZZ(..) => "E_zz",
        Output::ZQ(..) => "E_zq",
        Output::QQ(..) => "E_qq",
        Output::ForceZ(..) => "Q_z",
        Output::ForceQ(..) => "Q_q",
        Output::Observable(_) | Output::SiteObservable(_) => "output",
        Output::Phi(_) | Output::SitePhi(_) => "phi",
        Output::Row(..) | Output::SiteRow(..) => "A",
        Output::Drift(_) | Output::SiteDrift(_) => "a",
        Output::PsiQ(..) => "psi_q",
        Output::RowRate(..) => "A_rate",
        Output::Bend(..) => "bend",
        Output::RateQ(..) => "rate_q",
        Output::RateV(..) => "rate_v",
    }
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(array(self))?;
        match self {
            Self::Value => Ok(()),
            Self::ByZ(a)
            | Self::ByQ(a)
            | Self::Force(a)
            | Self::SitePhi(a)
            | Self::SiteDrift(a)
            | Self::SiteObservable(a) => write!(f, "[{a}]"),
            Self::ZZ(a, b)
            | Self::ZQ(a, b)
            | Self::QQ(a, b)
            | Self::ForceZ(a, b)
            | Self::ForceQ(a, b)
            | Self::Bend(a, b)
            | Self::RateQ(a, b)
            | Self::RateV(a, b)
            | Self::SiteRow(a, b) => {
                write!(f, "[{a}, {b}]")
            }
            Self::Row(number, a) | Self::PsiQ(number, a) | Self::RowRate(number, a) => {
                write!(f, "[{number}, {a}]")
            }
            Self::Observable(number) | Self::Phi(number) | Self::Drift(number) => {
                write!(f, "[{number}]")
            }
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
            Self::Copy(a) => a.fmt(f),
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
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessOrEqual => "<=",
                    Comparison::Greater => ">",
                    Comparison::GreaterOrEqual => ">=",
                };
                write!(f, "select({left} {sign} {right}, {then}, {otherwise})")
            }
        }
    }
}
