/// # Derived model
/// ```text
/// L = Σ_{i = 0..N} ½ m[i] q̇[i]² − (Σ_{i = 0..N − 1} (½ k (q[i + 1] − q[i])² + a/4 (q[i + 1] − q[i])⁴))
/// Q(q[i]) = −c q̇[i]
/// Q(q[N − 1]) = f sin(ω t)
/// coordinates: q[N]      parameters: m, k, a, c, f, ω
/// operations, value: 4 +−, 8 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 6 +−, 7 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient and second derivatives: 11 +−, 8 ×, 0 ÷, 1 sin/cos, 0 other
/// declared by             Lagrangian, N coordinates
/// depends on time         yes
/// forces                  yes
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (i,i)
/// pattern L_vq            zero
/// pattern L_qq            (i,i) (i,i+1) (i+1,i) (i+1,i+1)
/// pattern Q_v             (i,i)
/// pattern Q_q             zero
/// ```
struct Chain<const N: usize> {
    m: [f64; N],
    k: f64,
    a: f64,
    c: f64,
    f: f64,
    omega: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(clippy::int_plus_one)]
    impl<const N: usize> Chain<N> {
        const __TFE_LENGTHS: () = {
            {
                ::core::assert!(
                    0 <= (N as i64) - 1, "index `N-1` is outside `q` of length N"
                );
                ::core::assert!(
                    (N as i64) - 1 < (N as i64), "index `N-1` is outside `q` of length N"
                );
            }
            {
                ::core::assert!(0 < (N as i64), "index `0` is outside `q` of length N");
            }
        };
    }
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl<const N: usize> __tfe::Model<N> for Chain<N> {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: true,
            forced: true,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        const DIAGONAL_MASS: bool = true;
        /// L(q, v, t): 4 +−, 8 ×; those of a loop for one turn
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R {
            let () = Self::__TFE_LENGTHS;
            let a = t.parameter(N + 1, self.a);
            let k = t.parameter(N, self.k);
            let mut t0 = t.like(0.0);
            let t1 = t.like(0.5) * k;
            let t2 = t.like(0.25) * a;
            for i in 0..N.saturating_sub(1) {
                let t3 = q[i] - q[i + 1];
                let t4 = t3 * t3;
                let t5 = t2 * t4;
                let t6 = t1 + t5;
                let t7 = t4 * t6;
                t0 -= t7;
            }
            for i in 0..N {
                let t8 = t.like(0.5) * t.parameter(i, self.m[i]);
                let t9 = z[i] * z[i];
                t0 += t8 * t9;
            }
            t0
        }
        const LANES: bool = true;
        /// L_v, L_q and Q: 6 +−, 7 ×, 1 sin/cos; those of a loop for one turn
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            first: &mut __tfe::First<R, N>,
        ) {
            let () = Self::__TFE_LENGTHS;
            let a = t.parameter(N + 1, self.a);
            let c = t.parameter(N + 2, self.c);
            let f = t.parameter(N + 3, self.f);
            let k = t.parameter(N, self.k);
            let omega = t.parameter(N + 4, self.omega);
            first.q.fill(t.like(0.0));
            first.force.fill(t.like(0.0));
            /// Q
            let t0 = t * omega;
            let t1 = t0.sin();
            first.force[N.saturating_sub(1)] += f * t1;
            /// L_q
            for i in 0..N.saturating_sub(1) {
                let t2 = q[i] - q[i + 1];
                let t3 = t2 * t2;
                let t4 = a * t3;
                let t5 = k + t4;
                let t6 = t5 * t2;
                first.q[i] -= t6;
                first.q[i + 1] += t6;
            }
            /// L_v, Q
            for i in 0..N {
                first.z[i] = t.parameter(i, self.m[i]) * z[i];
                let t7 = c * z[i];
                first.force[i] -= t7;
            }
        }
        /// L_v, L_q and Q, and L_vv: 6 +−, 7 ×, 1 sin/cos; those of a loop for one turn
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            first: &mut __tfe::First<R, N>,
            zz: &mut [[R; N]; N],
        ) {
            let () = Self::__TFE_LENGTHS;
            let a = t.parameter(N + 1, self.a);
            let c = t.parameter(N + 2, self.c);
            let f = t.parameter(N + 3, self.f);
            let k = t.parameter(N, self.k);
            let omega = t.parameter(N + 4, self.omega);
            first.q.fill(t.like(0.0));
            first.force.fill(t.like(0.0));
            /// Q
            let t0 = t * omega;
            let t1 = t0.sin();
            first.force[N.saturating_sub(1)] += f * t1;
            /// L_q
            for i in 0..N.saturating_sub(1) {
                let t2 = q[i] - q[i + 1];
                let t3 = t2 * t2;
                let t4 = a * t3;
                let t5 = k + t4;
                let t6 = t5 * t2;
                first.q[i] -= t6;
                first.q[i + 1] += t6;
            }
            /// L_v, Q, L_vv
            for i in 0..N {
                let t7 = c * z[i];
                first.z[i] = t.parameter(i, self.m[i]) * z[i];
                first.force[i] -= t7;
                zz[i][i] = t.parameter(i, self.m[i]);
            }
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            first: &mut __tfe::First<R, N>,
        ) {
            __tfe::Model::first_inline(self, t, q, z, first);
        }
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            first: &mut __tfe::First<R, N>,
            zz: &mut [[R; N]; N],
        ) {
            __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
        }
        /// L_v, L_q and Q, L_vv, L_vq, L_qq, Q_v and Q_q: 11 +−, 8 ×, 1 sin/cos; those of a loop for one turn
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            first: &mut __tfe::First<R, N>,
            second: &mut __tfe::Second<R, N>,
        ) {
            let () = Self::__TFE_LENGTHS;
            let a = t.parameter(N + 1, self.a);
            let c = t.parameter(N + 2, self.c);
            let f = t.parameter(N + 3, self.f);
            let k = t.parameter(N, self.k);
            let omega = t.parameter(N + 4, self.omega);
            first.q.fill(t.like(0.0));
            first.force.fill(t.like(0.0));
            for row in &mut second.qq {
                row.fill(t.like(0.0));
            }
            /// Q
            let t0 = t * omega;
            let t1 = t0.sin();
            first.force[N.saturating_sub(1)] += f * t1;
            /// L_q, L_qq
            for i in 0..N.saturating_sub(1) {
                /// L_q
                let t2 = q[i] - q[i + 1];
                let t3 = t2 * t2;
                let t4 = a * t3;
                let t5 = k + t4;
                let t6 = t5 * t2;
                first.q[i] -= t6;
                first.q[i + 1] += t6;
                /// L_qq
                let t7 = t.like(3.0) * t4;
                let t8 = k + t7;
                let t9 = -t8;
                second.qq[i][i] += t9;
                second.qq[i][i + 1] += t8;
                second.qq[i + 1][i] += t8;
                second.qq[i + 1][i + 1] += t9;
            }
            /// L_v, Q, L_vv, Q_v
            let t10 = -c;
            for i in 0..N {
                let t11 = c * z[i];
                first.z[i] = t.parameter(i, self.m[i]) * z[i];
                first.force[i] -= t11;
                second.zz[i][i] = t.parameter(i, self.m[i]);
                second.force_z[i][i] = t10;
            }
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; N],
            z: &[R; N],
            values: &mut [R],
        ) {
            values[0] = q[N.saturating_sub(1)] - q[0];
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0.. => __tfe::CoordinateName::element("q", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["extension"];
        fn parameters(&self) -> usize {
            N + 5
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < N {
                return __tfe::CoordinateName::element("m", index);
            }
            if index < N + 1 {
                return __tfe::CoordinateName::single("k");
            }
            if index < N + 2 {
                return __tfe::CoordinateName::single("a");
            }
            if index < N + 3 {
                return __tfe::CoordinateName::single("c");
            }
            if index < N + 4 {
                return __tfe::CoordinateName::single("f");
            }
            if index < N + 5 {
                return __tfe::CoordinateName::single("omega");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < N {
                return self.m[index];
            }
            if index < N + 1 {
                return self.k;
            }
            if index < N + 2 {
                return self.a;
            }
            if index < N + 3 {
                return self.c;
            }
            if index < N + 4 {
                return self.f;
            }
            if index < N + 5 {
                return self.omega;
            }
            ::core::primitive::f64::NAN
        }
        fn with_parameter(
            &self,
            index: usize,
            value: f64,
        ) -> ::core::option::Option<Self> {
            let mut made = Self { ..*self };
            if index < N {
                made.m[index] = value;
            } else if index < N + 1 {
                made.k = value;
            } else if index < N + 2 {
                made.a = value;
            } else if index < N + 3 {
                made.c = value;
            } else if index < N + 4 {
                made.f = value;
            } else if index < N + 5 {
                made.omega = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl<const N: usize> Chain<N> {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; N], v: [f64; N]) -> ::tfe::__private::State<N> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Chain",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: true,
                forced: true,
                quadratic_in_z: true,
                constant_mass: true,
                linear: false,
                separable: true,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 8,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 6,
                multiplications: 7,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 11,
                multiplications: 8,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            page: ::core::concat!(
                "L = Σ_{i = 0..N} ½ m[i] q\u{307}[i]² − (Σ_{i = 0..N − 1} (½ k (q[i + 1] − q[i])² + a/4 (q[i + 1] − q[i])⁴))\n",
                "Q(q[i]) = −c q\u{307}[i]\n", "Q(q[N − 1]) = f sin(ω t)\n",
                "coordinates: q[N]      parameters: m, k, a, c, f, ω\n",
                "operations, value: 4 +−, 8 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 6 +−, 7 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 11 +−, 8 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "declared by             Lagrangian, N coordinates\n",
                "depends on time         yes\n", "forces                  yes\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (i,i)\n",
                "pattern L_vq            zero\n",
                "pattern L_qq            (i,i) (i,i+1) (i+1,i) (i+1,i+1)\n",
                "pattern Q_v             (i,i)\n", "pattern Q_q             zero"
            ),
        }
    }
    /// The observable `extension` at time `t`, coordinates `q` and velocities `v`.
    fn extension(&self, t: f64, q: [f64; N], v: [f64; N]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
