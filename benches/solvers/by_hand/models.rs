//! The equations of the scenes, written by hand.

use super::coupled::Coupled;
use super::lanes::Quad;
use super::second_order::SecondOrder;

pub struct Pendulum;

impl SecondOrder<1> for Pendulum {
    #[inline(always)]
    fn acceleration(&self, [angle]: &[Quad; 1], _: &[Quad; 1]) -> [Quad; 1] {
        [-angle.sin()]
    }
}

pub struct Kepler;

impl SecondOrder<2> for Kepler {
    #[inline(always)]
    fn acceleration(&self, &[x, y]: &[Quad; 2], _: &[Quad; 2]) -> [Quad; 2] {
        let square = x.times_plus(x, y * y);
        let pull = x.splat(-1.0) / (square * square.sqrt());
        [pull * x, pull * y]
    }
}

pub struct HenonHeiles;

impl SecondOrder<2> for HenonHeiles {
    #[inline(always)]
    fn acceleration(&self, &[x, y]: &[Quad; 2], _: &[Quad; 2]) -> [Quad; 2] {
        let first = (x + x).times_from(y, -x);
        [first, y.times_plus(y, x.times_from(x, -y))]
    }
}

/// The coordinates in the order x₀ … x₅, y₀ … y₅, z₀ … z₅.
pub struct Planets {
    pub g: f64,
    pub m: [f64; 6],
}

impl SecondOrder<18> for Planets {
    #[inline(always)]
    fn acceleration(&self, q: &[Quad; 18], _: &[Quad; 18]) -> [Quad; 18] {
        let like = q[0];
        let mut acceleration = [like.splat(0.0); 18];
        for i in 1..6 {
            for j in 0..i {
                let mut apart = [like; 3];
                for k in 0..3 {
                    apart[k] = q[6 * k + i] - q[6 * k + j];
                }
                let [x, y, z] = apart;
                let square = x.times_plus(x, y.times_plus(y, z * z));
                let cube = like.splat(self.g) / (square * square.sqrt());
                let (of_i, of_j) = (cube * like.splat(self.m[j]), cube * like.splat(self.m[i]));
                for k in 0..3 {
                    acceleration[6 * k + i] = of_i.times_from(apart[k], acceleration[6 * k + i]);
                    acceleration[6 * k + j] = of_j.times_plus(apart[k], acceleration[6 * k + j]);
                }
            }
        }
        acceleration
    }
}

pub struct Fput {
    pub alpha: f64,
}

impl SecondOrder<32> for Fput {
    #[inline(always)]
    fn acceleration(&self, q: &[Quad; 32], _: &[Quad; 32]) -> [Quad; 32] {
        let like = q[0];
        let (alpha, one) = (like.splat(self.alpha), like.splat(1.0));
        let mut left = q[0] * alpha.times_plus(q[0], one);
        let mut acceleration = [like; 32];
        for i in 0..32 {
            let stretch = if i < 31 { q[i + 1] - q[i] } else { -q[i] };
            let right = stretch * alpha.times_plus(stretch, one);
            acceleration[i] = right - left;
            left = right;
        }
        acceleration
    }
}

pub struct VanDerPol {
    pub mu: f64,
}

impl SecondOrder<1> for VanDerPol {
    const BY_VELOCITY: bool = true;

    #[inline(always)]
    fn acceleration(&self, &[x]: &[Quad; 1], &[v]: &[Quad; 1]) -> [Quad; 1] {
        let mu = x.splat(self.mu);
        [(mu * x.times_from(x, x.splat(1.0))).times_plus(v, -x)]
    }
}

/// Two unit masses on two unit rods.
pub struct DoublePendulum {
    pub g: f64,
}

impl Coupled<2> for DoublePendulum {
    /// The cosine of the angle between the rods.
    type Masses = Quad;

    #[inline(always)]
    fn forces(&self, &[a, b]: &[Quad; 2], &[v, w]: &[Quad; 2]) -> ([Quad; 2], Quad) {
        let ((sin_a, cos_a), (sin_b, cos_b)) = (a.sin_cos(), b.sin_cos());
        let sin = cos_a.times_from(sin_b, sin_a * cos_b);
        let cos = cos_a.times_plus(cos_b, sin_a * sin_b);
        let turn = v * w * sin;
        let first = a.splat(-2.0 * self.g).times_plus(sin_a, -turn);
        ([first, a.splat(-self.g).times_plus(sin_b, turn)], cos)
    }

    #[inline(always)]
    fn velocities(&self, &cos: &Quad, &[p, r]: &[Quad; 2]) -> [Quad; 2] {
        let inverse = cos.splat(1.0) / cos.times_from(cos, cos.splat(2.0));
        [
            cos.times_from(r, p) * inverse,
            cos.times_from(p, r + r) * inverse,
        ]
    }
}

/// Moments of inertia `a`, `a`, `c`, weight times distance `w`; coordinates φ, θ, ψ.
pub struct HeavyTop {
    pub a: f64,
    pub c: f64,
    pub w: f64,
}

impl Coupled<3> for HeavyTop {
    /// sin² and cosine of the inclination.
    type Masses = (Quad, Quad);

    const NEEDED: [bool; 3] = [false, true, false];
    const FORCED: [bool; 3] = [false, true, false];

    #[inline(always)]
    fn forces(
        &self,
        &[_, theta, _]: &[Quad; 3],
        &[turn, _, spin]: &[Quad; 3],
    ) -> ([Quad; 3], (Quad, Quad)) {
        let (sin, cos) = theta.sin_cos();
        let zero = theta.splat(0.0);
        let about_axis = theta.splat(self.c) * turn.times_plus(cos, spin);
        let force = turn.times_plus(
            (theta.splat(self.a) * turn).times_plus(cos, -about_axis),
            theta.splat(self.w),
        );
        ([zero, sin * force, zero], (sin * sin, cos))
    }

    #[inline(always)]
    fn velocities(&self, &(square, cos): &(Quad, Quad), &[p, r, s]: &[Quad; 3]) -> [Quad; 3] {
        let turn = s.times_from(cos, p) / (cos.splat(self.a) * square);
        let spin = turn.times_from(cos, s * cos.splat(1.0 / self.c));
        [turn, r * cos.splat(1.0 / self.a), spin]
    }
}
