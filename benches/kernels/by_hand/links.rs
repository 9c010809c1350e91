//! Two and three links, by the angles: sines and cosines of differences from those of the angles.

use super::ByHand;
use crate::models::{DoublePendulum, DoublePendulumAngles, TriplePendulum, TriplePendulumAngles};
use tfe::runtime::{First, Real, Second};

/// Two links of masses `m` and lengths `l`.
struct Two {
    m: [f64; 2],
    l: [f64; 2],
    g: f64,
}

impl Two {
    #[inline(always)] // the links are built for this call only
    fn first<R: Real>(&self, q: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
        let [l1, l2] = self.l.map(R::from_f64);
        let m2 = R::from_f64(self.m[1]);
        let total = R::from_f64(self.m[0] + self.m[1]);
        let g = R::from_f64(self.g);
        let ((sin1, cos1), (sin2, cos2)) = (q[0].sin_cos(), q[1].sin_cos());
        let sin = sin1 * cos2 - cos1 * sin2;
        let cos = cos1 * cos2 + sin1 * sin2;
        let (u1, u2) = (l1 * v[0], l2 * v[1]);
        let w2 = m2 * u2;
        let turn = w2 * u1 * sin;
        first.z[0] = l1 * (total * u1 + cos * w2);
        first.z[1] = m2 * l2 * (cos * u1 + u2);
        first.q[0] = -(turn + total * l1 * (g * sin1));
        first.q[1] = turn - m2 * l2 * (g * sin2);
    }

    #[inline(always)] // the links are built for this call only
    fn second<R: Real>(
        &self,
        q: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        second: &mut Second<R, 2>,
    ) {
        let [l1, l2] = self.l.map(R::from_f64);
        let m2 = R::from_f64(self.m[1]);
        let total = R::from_f64(self.m[0] + self.m[1]);
        let g = R::from_f64(self.g);
        let ((sin1, cos1), (sin2, cos2)) = (q[0].sin_cos(), q[1].sin_cos());
        let sin = sin1 * cos2 - cos1 * sin2;
        let cos = cos1 * cos2 + sin1 * sin2;
        let (s1, s2) = (total * l1, m2 * l2);
        let (inertia1, inertia2) = (s1 * l1, s2 * l2);
        let (weight1, weight2) = (s1 * g, s2 * g);
        let coupling = s2 * l1;
        let cosine = coupling * cos;
        let cosine1 = cosine * v[0];
        first.z[0] = inertia1 * v[0] + cosine * v[1];
        first.z[1] = cosine1 + inertia2 * v[1];
        let sine = coupling * sin;
        let sine1 = sine * v[0];
        let turn = sine1 * v[1];
        first.q[0] = -(turn + weight1 * sin1);
        first.q[1] = turn - weight2 * sin2;
        second.zz[0][0] = inertia1;
        second.zz[0][1] = cosine;
        second.zz[1][0] = cosine;
        second.zz[1][1] = inertia2;
        let sine2 = sine * v[1];
        second.zq[0][0] = -sine2;
        second.zq[0][1] = sine2;
        second.zq[1][0] = -sine1;
        second.zq[1][1] = sine1;
        let bend = cosine1 * v[1];
        second.qq[0][0] = -(bend + weight1 * cos1);
        second.qq[0][1] = bend;
        second.qq[1][0] = bend;
        second.qq[1][1] = -(bend + weight2 * cos2);
    }
}

/// Three links.
struct Three {
    m: [f64; 3],
    l: [f64; 3],
    g: f64,
}

impl Three {
    /// Inward over the links: what the masses outside of each carry.
    #[inline(always)] // the links are built for this call only
    fn first<R: Real>(&self, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [m1, m2, m3] = self.m.map(R::from_f64);
        let g = R::from_f64(self.g);
        let arm = |i: usize| {
            let ((sin, cos), l) = (q[i].sin_cos(), R::from_f64(self.l[i]));
            (l * cos, l * sin)
        };
        let ((c1, s1), (c2, s2), (c3, s3)) = (arm(0), arm(1), arm(2));
        // Velocities of the masses, added outward; momenta, added inward.
        let (x1, y1) = (v[0] * c1, v[0] * s1);
        let (x, y) = (v[1] * c2, v[1] * s2);
        let (x2, y2) = (x1 + x, y1 + y);
        let (x_, y_) = (v[2] * c3, v[2] * s3);
        let (x3, y3) = (x2 + x_, y2 + y_);
        let (px3, py3) = (m3 * x3, m3 * y3);
        let (px2, py2) = (px3 + m2 * x2, py3 + m2 * y2);
        let (px1, py1) = (px2 + m1 * x1, py2 + m1 * y1);
        let m23 = m2 + m3;
        first.z[0] = c1 * px1 + s1 * py1;
        first.z[1] = c2 * px2 + s2 * py2;
        first.z[2] = c3 * px3 + s3 * py3;
        first.q[0] = x1 * py1 - s1 * (v[0] * px1 + g * (m1 + m23));
        first.q[1] = x * py2 - s2 * (v[1] * px2 + g * m23);
        first.q[2] = x_ * py3 - s3 * (v[2] * px3 + g * m3);
    }

    #[inline(always)] // the links are built for this call only
    fn second<R: Real>(
        &self,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let [l1, l2, l3] = self.l.map(R::from_f64);
        let [m1, m2, m3] = self.m.map(R::from_f64);
        let g = R::from_f64(self.g);
        let m23 = m2 + m3;
        // Inertia; l sin, l cos; and these times the mass that hangs there.
        let arm = |i: usize, m: R, l: R| {
            let ((sin, cos), ml) = (q[i].sin_cos(), m * l);
            (ml * l, (l * sin, l * cos), (ml * sin, ml * cos))
        };
        let (i1, plain1, heavy1) = arm(0, m1 + m23, l1);
        let (i2, plain2, heavy2) = arm(1, m23, l2);
        let (i3, _, heavy3) = arm(2, m3, l3);
        let sine = |(sin, cos): (R, R), heavy: (R, R)| sin * heavy.1 - cos * heavy.0;
        let cosine = |(sin, cos): (R, R), heavy: (R, R)| cos * heavy.1 + sin * heavy.0;
        let (s12, c12) = (sine(plain1, heavy2), cosine(plain1, heavy2));
        let (s13, c13) = (sine(plain1, heavy3), cosine(plain1, heavy3));
        let (s23, c23) = (sine(plain2, heavy3), cosine(plain2, heavy3));
        let (c12_v1, c13_v1, c23_v2) = (c12 * v[0], c13 * v[0], c23 * v[1]);
        first.z[0] = i1 * v[0] + (c12 * v[1] + c13 * v[2]);
        first.z[1] = c12_v1 + (i2 * v[1] + c23 * v[2]);
        first.z[2] = c13_v1 + (c23_v2 + i3 * v[2]);
        let (s12_v1, s13_v1, s23_v2) = (s12 * v[0], s13 * v[0], s23 * v[1]);
        let (turn12, turn13, turn23) = (s12_v1 * v[1], s13_v1 * v[2], s23_v2 * v[2]);
        first.q[0] = -(turn12 + turn13 + g * heavy1.0);
        first.q[1] = turn12 - (turn23 + g * heavy2.0);
        first.q[2] = turn13 + turn23 - g * heavy3.0;
        second.zz = [[i1, c12, c13], [c12, i2, c23], [c13, c23, i3]];
        let (s12_v2, s13_v3, s23_v3) = (s12 * v[1], s13 * v[2], s23 * v[2]);
        second.zq = [
            [-(s12_v2 + s13_v3), s12_v2, s13_v3],
            [-s12_v1, s12_v1 - s23_v3, s23_v3],
            [-s13_v1, -s23_v2, s13_v1 + s23_v2],
        ];
        let (bend12, bend13, bend23) = (c12_v1 * v[1], c13_v1 * v[2], c23_v2 * v[2]);
        second.qq = [
            [-(bend12 + bend13 + g * heavy1.1), bend12, bend13],
            [bend12, -(bend12 + bend23 + g * heavy2.1), bend23],
            [bend13, bend23, -(bend13 + bend23 + g * heavy3.1)],
        ];
    }
}

/// Three links declared by their angles.
struct ThreeByAngles {
    m: [f64; 3],
    l: [f64; 3],
    g: f64,
}

impl ThreeByAngles {
    /// By sines and cosines of differences. Momenta added inward as for positions need fewer operations, but lose digits of ∂L/∂q that the formula has: the
    /// part m₁ẋ₁ẏ₁ of ẋ₁p_y − ẏ₁p_x cancels, and may be large beside what the other links add.
    #[inline(always)] // the links are built for this call only
    fn first<R: Real>(&self, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [m1, m2, m3] = self.m.map(R::from_f64);
        let [l1, l2, l3] = self.l.map(R::from_f64);
        let g = R::from_f64(self.g);
        let [(s1, c1), (s2, c2), (s3, c3)] = q.map(R::sin_cos);
        let (m23, arm3) = (m2 + m3, m3 * l3);
        let (u1, u2, u3) = (l1 * v[0], l2 * v[1], l3 * v[2]);
        let (w2, w3) = (m23 * u2, m3 * u3);
        let (sin12, cos12) = (s1 * c2 - c1 * s2, c1 * c2 + s1 * s2);
        let (sin13, cos13) = (s1 * c3 - c1 * s3, c1 * c3 + s1 * s3);
        let (sin23, cos23) = (s2 * c3 - c2 * s3, c2 * c3 + s2 * s3);
        let total = m1 + m23;
        first.z[0] = l1 * (total * u1 + (cos12 * w2 + cos13 * w3));
        first.z[1] = l2 * (m23 * (cos12 * u1 + u2) + cos23 * w3);
        first.z[2] = arm3 * (cos13 * u1 + (cos23 * u2 + u3));
        let (turn12, turn13, turn23) = (w2 * (u1 * sin12), w3 * (u1 * sin13), w3 * (u2 * sin23));
        first.q[0] = -(turn12 + turn13 + total * l1 * (g * s1));
        first.q[1] = turn12 - (turn23 + m23 * l2 * (g * s2));
        first.q[2] = turn13 + turn23 - arm3 * (g * s3);
    }

    #[inline(always)] // the links are built for this call only
    fn second<R: Real>(
        &self,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let Self { m, l, g } = *self;
        Three { m, l, g }.second(q, v, first, second);
    }
}

macro_rules! links {
    ($model:ty, $count:literal, $chain:ident, $($m:ident)*, $($l:ident)*) => {
        impl ByHand<$count> for $model {
            fn first<R: Real>(&self, _t: R, q: &[R; $count], v: &[R; $count], first: &mut First<R, $count>) {
                let chain = $chain { m: [$(self.$m),*], l: [$(self.$l),*], g: self.g };
                chain.first(q, v, first);
            }

            fn second<R: Real>(
                &self,
                _t: R,
                q: &[R; $count],
                v: &[R; $count],
                first: &mut First<R, $count>,
                second: &mut Second<R, $count>,
            ) {
                let chain = $chain { m: [$(self.$m),*], l: [$(self.$l),*], g: self.g };
                chain.second(q, v, first, second);
            }
        }
    };
}
links!(DoublePendulum, 2, Two, m1 m2, l1 l2);
links!(DoublePendulumAngles, 2, Two, m1 m2, l1 l2);
links!(TriplePendulum, 3, Three, m1 m2 m3, l1 l2 l3);
links!(TriplePendulumAngles, 3, ThreeByAngles, m1 m2 m3, l1 l2 l3);
