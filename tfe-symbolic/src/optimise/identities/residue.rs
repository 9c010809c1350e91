//! Values of operations in a finite field: equal expressions have equal values, and different ones almost never.
//!
//! Inputs are pseudo-random residues modulo the prime 2⁶¹ − 1. Sums, products and quotients are those of the field, so
//! that all consequences of the rules of arithmetic are found, and those of sin² + cos² = 1 as well. The values of all
//! other functions are independent numbers.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::optimise::plan::{Op, Plan};

/// A number modulo 2⁶¹ − 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Residue(u64);

const PRIME: u64 = (1 << 61) - 1;

impl Residue {
    const ZERO: Self = Self(0);
    const ONE: Self = Self(1);

    pub(super) fn is_zero(self) -> bool {
        self.0 == 0
    }

    pub(super) fn plus(self, other: Self) -> Self {
        let sum = self.0 + other.0;
        Self(if sum >= PRIME { sum - PRIME } else { sum })
    }

    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(other.opposite())
    }

    pub(super) fn opposite(self) -> Self {
        Self(if self.0 == 0 { 0 } else { PRIME - self.0 })
    }

    pub(super) fn times(self, other: Self) -> Self {
        let product = u128::from(self.0) * u128::from(other.0);
        let (low, high) = ((product as u64) & PRIME, (product >> 61) as u64);
        Self(low).plus(Self(high))
    }

    fn power(self, mut exponent: u64) -> Self {
        let (mut base, mut total) = (self, Self::ONE);
        while exponent > 0 {
            if exponent & 1 == 1 {
                total = total.times(base);
            }
            base = base.times(base);
            exponent >>= 1;
        }
        total
    }

    /// 1/x, and 0 for 0.
    pub(super) fn reciprocal(self) -> Self {
        self.power(PRIME - 2)
    }

    /// x or −x, the same for both.
    pub(super) fn size(self) -> Self {
        if self.0 > PRIME / 2 {
            Self(PRIME - self.0)
        } else {
            self
        }
    }

    /// Some bits of it.
    pub(super) fn bits(self, mask: u64) -> u64 {
        (self.0 ^ (self.0 >> 29)) & mask
    }

    fn whole(value: i128) -> Self {
        let size = (value.unsigned_abs() % u128::from(PRIME)) as u64;
        if value < 0 {
            Self(size).opposite()
        } else {
            Self(size)
        }
    }
}

/// The same on every run.
pub(super) fn mixed(state: u64, word: u64) -> u64 {
    let mut x = (state ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A number that looks random, of a seed and a name.
pub(super) fn scattered(seed: u64, name: &str) -> u64 {
    name.bytes().fold(mixed(seed, 1), |state, byte| {
        mixed(state, u64::from(byte) + 2)
    })
}

/// The residues of all operations.
pub(super) fn residues(plan: &Plan, seed: u64) -> Vec<Residue> {
    let mut known: Vec<Residue> = Vec::with_capacity(plan.len());
    for id in plan.ids() {
        let op = plan.op(id);
        let of = |at: usize| {
            let operand = op.operands().get(at).map(|operand| operand.index());
            operand.map_or(Residue::ZERO, |at| known[at])
        };
        let own = |name: &str| {
            let start = scattered(seed, name);
            let all = op.operands().into_iter().fold(start, |state, operand| {
                mixed(state, known[operand.index()].0)
            });
            Residue(all % PRIME)
        };
        let value = match op {
            Op::Constant(value) => constant(*value, seed),
            Op::Input(input) => own(&format!("{input:?}")),
            Op::Add(..) => of(0).plus(of(1)),
            Op::Subtract(..) => of(0).minus(of(1)),
            Op::Multiply(..) => of(0).times(of(1)),
            Op::Divide(..) if of(1).is_zero() => own("quotient"),
            Op::Divide(..) => of(0).times(of(1).reciprocal()),
            Op::Negate(_) => of(0).opposite(),
            Op::IntegerPower(_, n) if *n >= 0 => of(0).power(u64::from(n.unsigned_abs())),
            Op::IntegerPower(_, n) => own(&format!("power {n}")),
            Op::Power(..) => own("power"),
            Op::Call(function @ (Function::Sin | Function::Cos), _) => {
                // Both are rational in one number: 2t/(1 + t²) and (1 − t²)/(1 + t²).
                let t = own("angle");
                let square = t.times(t);
                let below = Residue::ONE.plus(square).reciprocal();
                match function {
                    Function::Sin => t.plus(t).times(below),
                    _ => Residue::ONE.minus(square).times(below),
                }
            }
            Op::Call(function, _) => own(&format!("{function:?}")),
            Op::Select { comparison, .. } => own(&format!("select {comparison:?}")),
            Op::Loop { range, .. } => own(&format!("sum {range:?}")),
        };
        known.push(value);
    }
    known
}

fn constant(value: Constant, seed: u64) -> Residue {
    match value.as_ratio() {
        Some((top, bottom)) => Residue::whole(top).times(Residue::whole(bottom).reciprocal()),
        None => Residue(scattered(seed, &format!("{value:?}")) % PRIME),
    }
}
