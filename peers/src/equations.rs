//! The equations of motion of the scenes, written by hand as efficiently as possible: shared sines, symmetric sums over
//! pairs, no allocation.

use crate::scenes::lattice::Lattice;
use crate::scenes::oscillators::{DoublePendulum, HenonHeiles, Pendulum, VanDerPol};
use crate::scenes::planets::{Bodies, Kepler};
use crate::scenes::stiff::ElasticPendulum;
use crate::system::System;

impl System<1> for Pendulum {
    const SEPARABLE: bool = true;

    #[inline]
    fn acceleration(&self, q: &[f64; 1], _: &[f64; 1]) -> [f64; 1] {
        [-q[0].sin()]
    }

    #[inline]
    fn variation(&self, q: &[f64; 1], _: &[f64; 1], dq: &[f64; 1], _: &[f64; 1]) -> [f64; 1] {
        [-q[0].cos() * dq[0]]
    }
}

impl System<2> for Kepler {
    const SEPARABLE: bool = true;

    #[inline]
    fn acceleration(&self, q: &[f64; 2], _: &[f64; 2]) -> [f64; 2] {
        let square = q[0] * q[0] + q[1] * q[1];
        let factor = -1.0 / (square * square.sqrt());
        [factor * q[0], factor * q[1]]
    }

    #[inline]
    fn variation(&self, q: &[f64; 2], _: &[f64; 2], dq: &[f64; 2], _: &[f64; 2]) -> [f64; 2] {
        let square = q[0] * q[0] + q[1] * q[1];
        let factor = -1.0 / (square * square.sqrt());
        let along = 3.0 * (q[0] * dq[0] + q[1] * dq[1]) / square;
        [
            factor * (dq[0] - along * q[0]),
            factor * (dq[1] - along * q[1]),
        ]
    }
}

impl System<2> for HenonHeiles {
    const SEPARABLE: bool = true;

    #[inline]
    fn acceleration(&self, q: &[f64; 2], _: &[f64; 2]) -> [f64; 2] {
        let [x, y] = *q;
        [-x - 2.0 * x * y, y * y - x * x - y]
    }

    #[inline]
    fn variation(&self, q: &[f64; 2], _: &[f64; 2], dq: &[f64; 2], _: &[f64; 2]) -> [f64; 2] {
        let ([x, y], [dx, dy]) = (*q, *dq);
        [-dx - 2.0 * (x * dy + y * dx), 2.0 * (y * dy - x * dx) - dy]
    }
}

impl System<2> for DoublePendulum {
    // 2 a'' + b'' c = −b'² s − 2 g sin a,  a'' c + b'' = a'² s − g sin b,  where s = sin(a − b), c = cos(a − b)
    #[inline]
    fn acceleration(&self, q: &[f64; 2], v: &[f64; 2]) -> [f64; 2] {
        let ((sa, ca), (sb, cb)) = (q[0].sin_cos(), q[1].sin_cos());
        let (s, c) = (sa * cb - ca * sb, ca * cb + sa * sb);
        let f = -v[1] * v[1] * s - 2.0 * self.g * sa;
        let k = v[0] * v[0] * s - self.g * sb;
        let inverse = 1.0 / (2.0 - c * c);
        [(f - c * k) * inverse, (2.0 * k - c * f) * inverse]
    }

    #[inline]
    fn variation(&self, q: &[f64; 2], v: &[f64; 2], dq: &[f64; 2], dv: &[f64; 2]) -> [f64; 2] {
        let ((sa, ca), (sb, cb)) = (q[0].sin_cos(), q[1].sin_cos());
        let (s, c) = (sa * cb - ca * sb, ca * cb + sa * sb);
        let f = -v[1] * v[1] * s - 2.0 * self.g * sa;
        let k = v[0] * v[0] * s - self.g * sb;
        let inverse = 1.0 / (2.0 - c * c);
        let turn = dq[0] - dq[1];
        let (ds, dc) = (c * turn, -s * turn);
        let df = -2.0 * v[1] * s * dv[1] - v[1] * v[1] * ds - 2.0 * self.g * ca * dq[0];
        let dk = 2.0 * v[0] * s * dv[0] + v[0] * v[0] * ds - self.g * cb * dq[1];
        // The derivative of the determinant 2 − c² is −2 c dc.
        let relative = 2.0 * c * dc * inverse;
        [
            (df - c * dk - dc * k) * inverse + (f - c * k) * inverse * relative,
            (2.0 * dk - c * df - dc * f) * inverse + (2.0 * k - c * f) * inverse * relative,
        ]
    }
}

/// x, y, z of each body; the unit of time is a thousand days.
impl System<18> for Bodies {
    const SEPARABLE: bool = true;
    const UNIT: f64 = 1000.0;

    #[inline]
    fn acceleration(&self, q: &[f64; 18], _: &[f64; 18]) -> [f64; 18] {
        let g = self.g * Self::UNIT * Self::UNIT;
        let mut a = [0.0; 18];
        for i in 1..6 {
            for j in 0..i {
                let (x, y, z) = (q[i] - q[j], q[6 + i] - q[6 + j], q[12 + i] - q[12 + j]);
                let square = x * x + y * y + z * z;
                let factor = g / (square * square.sqrt());
                let (of_i, of_j) = (factor * self.m[j], factor * self.m[i]);
                a[i] -= of_i * x;
                a[6 + i] -= of_i * y;
                a[12 + i] -= of_i * z;
                a[j] += of_j * x;
                a[6 + j] += of_j * y;
                a[12 + j] += of_j * z;
            }
        }
        a
    }

    fn variation(&self, q: &[f64; 18], _: &[f64; 18], dq: &[f64; 18], _: &[f64; 18]) -> [f64; 18] {
        let g = self.g * Self::UNIT * Self::UNIT;
        let mut a = [0.0; 18];
        for i in 1..6 {
            for j in 0..i {
                let mut d = [0.0; 3];
                let mut w = [0.0; 3];
                let (mut square, mut product) = (0.0, 0.0);
                for k in 0..3 {
                    d[k] = q[6 * k + i] - q[6 * k + j];
                    w[k] = dq[6 * k + i] - dq[6 * k + j];
                    square += d[k] * d[k];
                    product += d[k] * w[k];
                }
                let factor = g / (square * square.sqrt());
                for k in 0..3 {
                    let change = factor * (w[k] - 3.0 * product / square * d[k]);
                    a[6 * k + i] -= self.m[j] * change;
                    a[6 * k + j] += self.m[i] * change;
                }
            }
        }
        a
    }

    /// The distances and velocities of Jupiter and the outer planets; the Sun, which moves little, gets theirs too.
    fn sizes(&self) -> ([f64; 18], [f64; 18]) {
        ([10.0; 18], [5.0; 18])
    }
}

impl System<32> for Lattice {
    const SEPARABLE: bool = true;

    #[inline]
    fn acceleration(&self, q: &[f64; 32], _: &[f64; 32]) -> [f64; 32] {
        let force = |stretch: f64| stretch + self.a * stretch * stretch;
        let mut a = [0.0; 32];
        let mut before = force(q[0]);
        for i in 0..31 {
            let after = force(q[i + 1] - q[i]);
            a[i] = after - before;
            before = after;
        }
        a[31] = force(-q[31]) - before;
        a
    }

    #[inline]
    fn variation(&self, q: &[f64; 32], _: &[f64; 32], dq: &[f64; 32], _: &[f64; 32]) -> [f64; 32] {
        let change = |stretch: f64, by: f64| by + 2.0 * self.a * stretch * by;
        let mut a = [0.0; 32];
        let mut before = change(q[0], dq[0]);
        for i in 0..31 {
            let after = change(q[i + 1] - q[i], dq[i + 1] - dq[i]);
            a[i] = after - before;
            before = after;
        }
        a[31] = change(-q[31], -dq[31]) - before;
        a
    }
}

impl System<1> for VanDerPol {
    #[inline]
    fn acceleration(&self, q: &[f64; 1], v: &[f64; 1]) -> [f64; 1] {
        [self.mu * (1.0 - q[0] * q[0]) * v[0] - q[0]]
    }

    #[inline]
    fn variation(&self, q: &[f64; 1], v: &[f64; 1], dq: &[f64; 1], dv: &[f64; 1]) -> [f64; 1] {
        let (x, speed) = (q[0], v[0]);
        [(-2.0 * self.mu * x * speed - 1.0) * dq[0] + self.mu * (1.0 - x * x) * dv[0]]
    }
}

impl System<2> for ElasticPendulum {
    // r'' = r θ'² + g cos θ − k (r − 1),  θ'' = −(g sin θ + 2 r' θ') / r
    #[inline]
    fn acceleration(&self, q: &[f64; 2], v: &[f64; 2]) -> [f64; 2] {
        let (sine, cosine) = q[1].sin_cos();
        [
            q[0] * v[1] * v[1] + self.g * cosine - self.k * (q[0] - 1.0),
            -(self.g * sine + 2.0 * v[0] * v[1]) / q[0],
        ]
    }

    #[inline]
    fn variation(&self, q: &[f64; 2], v: &[f64; 2], dq: &[f64; 2], dv: &[f64; 2]) -> [f64; 2] {
        let (sine, cosine) = q[1].sin_cos();
        let angular = -(self.g * sine + 2.0 * v[0] * v[1]) / q[0];
        let change = self.g * cosine * dq[1] + 2.0 * (v[0] * dv[1] + v[1] * dv[0]);
        [
            (v[1] * v[1] - self.k) * dq[0] + 2.0 * q[0] * v[1] * dv[1] - self.g * sine * dq[1],
            -(change + angular * dq[0]) / q[0],
        ]
    }
}
