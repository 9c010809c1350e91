//! Eight numbers in one register of a processor with AVX-512, for eight trajectories side by side. The rules are those of [`quad`](crate::registers::quad).

use crate::registers::pair::{Eight, LANES, OutOfLine};
use crate::registers::side::Side;
use crate::trigonometry::LIMIT;
use pulp::x86::V4;
use pulp::{Simd, b8, f64x8, u64x8};

crate::registers::register::register! {
    /// Eight numbers, and the proof that the processor has registers for them.
    Octet: 8 of V4,
    f64x8, b8, u64x8, mul_sub_f64x8, mul_add_f64x8, shl_const_u64x8, shr_const_u64x8
}

impl Octet {
    /// Whether all lanes are within limits.
    #[inline(always)]
    fn is_within(self, (low, high): (f64, f64)) -> bool {
        let isa = self.isa;
        let above = isa.less_than_or_equal_f64s(isa.splat_f64s(low), self.value);
        let below = isa.less_than_or_equal_f64s(self.value, isa.splat_f64s(high));
        (above.0 & below.0) == u8::MAX
    }

    /// Whether at least one number is positive.
    #[inline(always)]
    pub(crate) fn any_positive(self) -> bool {
        self.isa
            .less_than_f64s(self.isa.splat_f64s(0.0), self.value)
            .0
            != 0
    }

    /// Runs work in a function of its own.
    #[inline(always)]
    pub(crate) fn out_of_line<W: OutOfLine>(self, work: W) {
        self.isa.vectorize(Call {
            isa: self.isa,
            work,
        });
    }
}

struct Call<W> {
    isa: V4,
    work: W,
}

impl<W: OutOfLine> pulp::NullaryFnOnce for Call<W> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.work.run(Octet::of(self.isa, [0.0; 8]));
    }
}

impl Side<LANES> for Octet {
    #[inline(always)]
    fn with(self, lanes: [f64; LANES]) -> Self {
        self.with(lanes)
    }

    #[inline(always)]
    fn lanes(self) -> [f64; LANES] {
        self.lanes()
    }
}

impl Eight for Octet {
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.any_positive()
    }

    #[inline(always)]
    fn out_of_line<W: OutOfLine>(self, work: W) {
        self.out_of_line(work);
    }
}
