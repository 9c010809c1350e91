//! The operations that are written down, and how they are read backwards.

use alloc::vec::Vec;

/// The number of points side by side. With more, the tape no longer fits into the cache: eight points take half as long
/// again.
pub(crate) const LANES: usize = 4;

/// A number for each point.
pub(crate) type Row = [f64; LANES];

pub(super) const ZERO: Row = [0.0; LANES];

/// No operand, or one that depends on no parameter.
pub(super) const NONE: u32 = u32::MAX;

/// The derivative of an operation by one of its operands.
#[derive(Clone, Copy, Debug)]
pub(super) enum Slope {
    One,
    MinusOne,
    Of(Row),
}

/// An operand, and where the derivative by it is stored; for sums the derivative is known and takes no memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operand {
    place: u32,
    slope: u32,
}

impl Operand {
    const ONE: u32 = u32::MAX;
    const MINUS_ONE: u32 = u32::MAX - 1;
    pub(super) const NONE: Self = Self {
        place: NONE,
        slope: Self::ONE,
    };
}

/// The recorded operations of one kernel call; the parameters occupy the places before them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Operations {
    pub(super) parameters: usize,
    pub(super) list: Vec<[Operand; 2]>,
    pub(super) slopes: Vec<Row>,
}

impl Operations {
    #[inline]
    pub(super) fn operand(&mut self, place: u32, slope: Slope) -> Operand {
        let slope = match slope {
            Slope::One => Operand::ONE,
            Slope::MinusOne => Operand::MINUS_ONE,
            Slope::Of(row) => {
                self.slopes.push(row);
                self.slopes.len() as u32 - 1
            }
        };
        Operand { place, slope }
    }
}

/// Propagates the adjoints of the results to those of the parameters (T-149); the adjoints of the operations are zero
/// afterwards.
pub(super) fn read_backwards(operations: &Operations, adjoints: &mut [Row]) {
    for (place, operation) in operations.list.iter().enumerate().rev() {
        let own = &mut adjoints[operations.parameters + place];
        let adjoint = core::mem::replace(own, ZERO);
        if adjoint == ZERO {
            continue;
        }
        for operand in operation {
            if operand.place == NONE {
                continue;
            }
            let sum = &mut adjoints[operand.place as usize];
            match operand.slope {
                Operand::ONE => (0..LANES).for_each(|lane| sum[lane] += adjoint[lane]),
                Operand::MINUS_ONE => (0..LANES).for_each(|lane| sum[lane] -= adjoint[lane]),
                slope => add(sum, &adjoint, &operations.slopes[slope as usize]),
            }
        }
    }
}

/// sum += adjoint · derivative, where an infinite derivative counts as zero if nothing changes along it: if the adjoint
/// is zero, or no parameter moves the operand.
#[inline]
fn add(sum: &mut Row, adjoint: &Row, derivative: &Row) {
    for lane in 0..LANES {
        let product = adjoint[lane] * derivative[lane];
        let is_none = (adjoint[lane] == 0.0) | (derivative[lane] == 0.0);
        sum[lane] += if is_none { 0.0 } else { product };
    }
}
