//! The two kinds of number that formulas are evaluated in.

use super::double_double::DoubleDouble;

/// A function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    Sin,
    Cos,
    Exp,
    Ln,
    Sqrt,
    Abs,
    /// −1, 0 or 1
    Sign,
}

impl Function {
    /// Its name in declarations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Sqrt => "sqrt",
            Self::Abs => "abs",
            Self::Sign => "sign",
        }
    }
}

/// What formulas are evaluated in.
pub trait Scalar: Copy {
    /// digits / 10^decimals, to the precision of the type.
    fn decimal(digits: i64, decimals: u32) -> Self;
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn add(self, other: Self) -> Self;
    fn subtract(self, other: Self) -> Self;
    fn multiply(self, other: Self) -> Self;
    fn divide(self, other: Self) -> Self;
    fn negate(self) -> Self;
    fn power(self, n: i32) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn call(self, function: Function) -> Self;
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

impl Scalar for f64 {
    fn decimal(digits: i64, decimals: u32) -> Self {
        digits as Self / 10f64.powi(decimals as i32)
    }

    fn from_f64(value: f64) -> Self {
        value
    }

    fn to_f64(self) -> f64 {
        self
    }

    fn add(self, other: Self) -> Self {
        self + other
    }

    fn subtract(self, other: Self) -> Self {
        self - other
    }

    fn multiply(self, other: Self) -> Self {
        self * other
    }

    fn divide(self, other: Self) -> Self {
        self / other
    }

    fn negate(self) -> Self {
        -self
    }

    fn power(self, n: i32) -> Self {
        self.powi(n)
    }

    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    fn call(self, function: Function) -> Self {
        match function {
            Function::Sin => self.sin(),
            Function::Cos => self.cos(),
            Function::Exp => self.exp(),
            Function::Ln => self.ln(),
            Function::Sqrt => self.sqrt(),
            Function::Abs => self.abs(),
            Function::Sign => sign(self),
        }
    }
}

impl Scalar for DoubleDouble {
    fn decimal(digits: i64, decimals: u32) -> Self {
        Self::from(digits as f64).divide(Self::from(10f64.powi(decimals as i32)))
    }

    fn from_f64(value: f64) -> Self {
        Self::from(value)
    }

    fn to_f64(self) -> f64 {
        self.hi
    }

    fn add(self, other: Self) -> Self {
        Self::add(self, other)
    }

    fn subtract(self, other: Self) -> Self {
        Self::subtract(self, other)
    }

    fn multiply(self, other: Self) -> Self {
        Self::multiply(self, other)
    }

    fn divide(self, other: Self) -> Self {
        Self::divide(self, other)
    }

    fn negate(self) -> Self {
        Self::negate(self)
    }

    fn power(self, n: i32) -> Self {
        Self::power(self, n)
    }

    fn sin_cos(self) -> (Self, Self) {
        Self::sin_cos(self)
    }

    fn call(self, function: Function) -> Self {
        match function {
            Function::Sin => self.sin_cos().0,
            Function::Cos => self.sin_cos().1,
            Function::Exp => self.exp(),
            Function::Ln => self.ln(),
            Function::Sqrt => self.sqrt(),
            Function::Abs => self.abs(),
            Function::Sign => Self::from(sign(self.hi)),
        }
    }
}
