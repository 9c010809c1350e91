/// # Derived model
/// ```text
/// H = ½ p² − cos q − a q cos(ω t)
/// dt/dτ = 1/(1 + q²)
/// H̃ = dt/dτ (H + p_t)
/// Q(q) = −c p
/// coordinates: q, t      momenta: p, p_t      parameters: a, ω, c
/// operations, value: 4 +−, 6 ×, 1 ÷, 2 sin/cos, 0 other
/// operations, gradient: 6 +−, 15 ×, 1 ÷, 2 sin/cos, 0 other
/// operations, gradient and second derivatives: 9 +−, 32 ×, 1 ÷, 2 sin/cos, 0 other
/// declared by             Hamiltonian, 2 coordinates
/// depends on time         no
/// forces                  yes
/// linear                  no
/// quadratic in p          yes
/// constant H_pp           no, diagonal
/// separable (H_pq = 0)    no
/// smooth                  yes
/// cyclic coordinates      none
/// pattern H_pp            (0,0)
/// pattern H_pq            (0,0) (1,0)
/// pattern H_qq            (0,0) (0,1) (1,0) (1,1)
/// pattern Q_p             (0,0) (1,0)
/// pattern Q_q             (0,0) (1,0)
/// ```
struct Forced {
    a: f64,
    omega: f64,
    c: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for Forced {
        const FORM: __tfe::Form = __tfe::Form::Hamiltonian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: true,
            quadratic_in_z: true,
            constant_mass: false,
            linear: false,
            separable: false,
            smooth: true,
        };
        /// H(q, p, t): 4 +−, 6 ×, 1 ÷, 2 sin/cos
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let a = t.parameter(0, self.a);
            let omega = t.parameter(1, self.omega);
            let cos_q = q[0].cos();
            let t0 = omega * q[1];
            let t1 = t0.cos();
            let t2 = a * t1;
            let t3 = z[0] * z[0];
            let t4 = t.like(0.5) * t3;
            let t5 = t4 - cos_q;
            let t6 = z[1] + t5;
            let t7 = q[0] * t2;
            let t8 = t6 - t7;
            let t9 = q[0] * q[0];
            let t10 = t.like(1.0) + t9;
            t8 / t10
        }
        const LANES: bool = true;
        /// H_p, H_q and Q: 6 +−, 15 ×, 1 ÷, 2 sin/cos
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let a = t.parameter(0, self.a);
            let c = t.parameter(2, self.c);
            let omega = t.parameter(1, self.omega);
            /// ∂H/∂p_t, and parts of later results
            let (sin_q, cos_q) = q[0].sin_cos();
            let t0 = omega * q[1];
            let (t1, t2) = t0.sin_cos();
            let t3 = a * t2;
            let t4 = a * t1;
            let t5 = omega * t4;
            let t6 = sin_q - t3;
            let t7 = q[0] * t3;
            let t8 = cos_q + t7;
            let t9 = t8 - z[1];
            let t10 = t.like(2.0) * t9;
            let t11 = q[0] * q[0];
            let t12 = t.like(1.0) + t11;
            let t13 = t.like(1.0) / t12;
            first.z[1] = t13;
            /// ∂H/∂t
            let t14 = q[0] * t13;
            first.q[1] = t5 * t14;
            /// ∂H/∂p
            let t15 = z[0] * t13;
            first.z[0] = t15;
            /// ∂H/∂q, Q_q, Q_t
            let t16 = c * t15;
            let t17 = z[0] * z[0];
            let t18 = t17 - t10;
            let t19 = t14 * t18;
            let t20 = t6 - t19;
            first.q[0] = t20 * t13;
            first.force[1] = z[0] * t16;
            first.force[0] = -t16;
        }
        /// H_p, H_q and Q, and H_pp: 6 +−, 15 ×, 1 ÷, 2 sin/cos
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let a = t.parameter(0, self.a);
            let c = t.parameter(2, self.c);
            let omega = t.parameter(1, self.omega);
            /// ∂H/∂p_t, ∂²H/∂p², and parts of later results
            let (sin_q, cos_q) = q[0].sin_cos();
            let t0 = omega * q[1];
            let (t1, t2) = t0.sin_cos();
            let t3 = a * t2;
            let t4 = a * t1;
            let t5 = omega * t4;
            let t6 = sin_q - t3;
            let t7 = q[0] * t3;
            let t8 = cos_q + t7;
            let t9 = t8 - z[1];
            let t10 = t.like(2.0) * t9;
            let t11 = q[0] * q[0];
            let t12 = t.like(1.0) + t11;
            let t13 = t.like(1.0) / t12;
            first.z[1] = t13;
            zz[0][0] = t13;
            /// ∂H/∂t
            let t14 = q[0] * t13;
            first.q[1] = t5 * t14;
            /// ∂H/∂p
            let t15 = z[0] * t13;
            first.z[0] = t15;
            /// ∂H/∂q, Q_q, Q_t
            let t16 = c * t15;
            let t17 = z[0] * z[0];
            let t18 = t17 - t10;
            let t19 = t14 * t18;
            let t20 = t6 - t19;
            first.q[0] = t20 * t13;
            first.force[1] = z[0] * t16;
            first.force[0] = -t16;
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            __tfe::Model::first_inline(self, t, q, z, first);
        }
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
        }
        /// H_p, H_q and Q, H_pp, H_pq, H_qq, Q_p and Q_q: 9 +−, 32 ×, 1 ÷, 2 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let a = t.parameter(0, self.a);
            let c = t.parameter(2, self.c);
            let omega = t.parameter(1, self.omega);
            /// ∂H/∂p_t, ∂²H/∂p², and parts of later results
            let (sin_q, cos_q) = q[0].sin_cos();
            let t0 = omega * q[1];
            let (t1, t2) = t0.sin_cos();
            let t3 = q[0] * q[0];
            let t4 = t.like(1.0) + t3;
            let t5 = t.like(1.0) / t4;
            first.z[1] = t5;
            second.zz[0][0] = t5;
            /// ∂H/∂p
            let t6 = z[0] * t5;
            first.z[0] = t6;
            /// ∂²H/∂t², and parts of later results
            let t7 = q[0] * t5;
            let t8 = t.like(2.0) * t7;
            let t9 = a * t2;
            let t10 = q[0] * t9;
            let t11 = sin_q - t9;
            let t12 = a * omega;
            let t13 = omega * t2;
            let t14 = t1 * t12;
            let t15 = t13 * t7;
            second.qq[1][1] = t12 * t15;
            /// ∂H/∂t
            let t16 = t7 * t14;
            first.q[1] = t16;
            /// ∂²H/∂q∂t
            let t17 = t14 * t5;
            let t18 = t8 * t16;
            let t19 = t17 - t18;
            second.qq[0][1] = t19;
            second.qq[1][0] = t19;
            /// ∂H/∂q, and parts of later results
            let t20 = z[0] * z[0];
            let t21 = t.like(0.5) * t20;
            let t22 = t21 - cos_q;
            let t23 = t10 - t22;
            let t24 = t23 - z[1];
            let t25 = cos_q * t5;
            let t26 = t8 * t24;
            let t27 = t26 + t11;
            first.q[0] = t27 * t5;
            /// Q_t
            let t28 = c * t6;
            let t29 = z[0] * t28;
            first.force[1] = t29;
            /// ∂²H/∂p∂q
            let t30 = t8 * t6;
            second.zq[0][0] = -t30;
            /// ∂Q_q/∂p
            let t31 = c * t5;
            second.force_z[0][0] = -t31;
            /// Q_q, ∂Q_t/∂q
            let t32 = t8 * t29;
            second.force_q[1][0] = -t32;
            first.force[0] = -t28;
            /// ∂²H/∂p_t∂q, and parts of later results
            let t33 = t8 * t5;
            let t34 = t5 * t5;
            let t35 = t34 * t24;
            let t36 = t33 * t27;
            let t37 = t35 - t36;
            second.zq[1][0] = -t33;
            /// ∂²H/∂q², ∂Q_t/∂p, ∂Q_q/∂q
            let t38 = t.like(2.0) * t37;
            second.qq[0][0] = t38 + t25;
            second.force_q[0][0] = t8 * t28;
            second.force_z[1][0] = t.like(2.0) * t28;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            values: &mut [R],
        ) {
            let cos_q = q[0].cos();
            let t0 = z[0] * z[0];
            let t1 = t.like(0.5) * t0;
            values[0] = t1 - cos_q;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("q"),
                1 => __tfe::CoordinateName::single("t"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["energy"];
        fn parameters(&self) -> usize {
            3
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("a");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("omega");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("c");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.a;
            }
            if index < 2 {
                return self.omega;
            }
            if index < 3 {
                return self.c;
            }
            ::core::primitive::f64::NAN
        }
        fn with_parameter(
            &self,
            index: usize,
            value: f64,
        ) -> ::core::option::Option<Self> {
            let mut made = Self { ..*self };
            if index < 1 {
                made.a = value;
            } else if index < 2 {
                made.omega = value;
            } else if index < 3 {
                made.c = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Forced {
    /// The state with coordinates `q` and momenta `p` at the time t = 0 of the model: t and p_t = −H(q, p, t) come last.
    fn state(&self, q: [f64; 1], p: [f64; 1]) -> ::tfe::__private::State<2> {
        self.state_at(0.0, q, p)
    }
    /// The state with coordinates `q` and momenta `p` at the time `t` of the model: t and p_t = −H(q, p, t) come last.
    fn state_at(&self, t: f64, q: [f64; 1], p: [f64; 1]) -> ::tfe::__private::State<2> {
        let mut state = ::tfe::__private::State {
            q: [t; 2],
            p: [0.0; 2],
        };
        state.q[..1].copy_from_slice(&q);
        state.p[..1].copy_from_slice(&p);
        state.p[1] = -self.__tfe_hamiltonian(t, &state.q, &state.p);
        state
    }
    #[allow(unused_variables, non_snake_case)]
    fn __tfe_hamiltonian<R: ::tfe::__private::Real>(
        &self,
        t: R,
        q: &[R; 2],
        z: &[R; 2],
    ) -> R {
        let a = t.like(self.a);
        let omega = t.like(self.omega);
        let cos_q = q[0].cos();
        let t0 = omega * q[1];
        let t1 = t0.cos();
        let t2 = a * t1;
        let t3 = q[0] * t2;
        let t4 = z[0] * z[0];
        let t5 = t.like(0.5) * t4;
        let t6 = t5 - cos_q;
        t6 - t3
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Forced",
            form: ::tfe::__private::Form::Hamiltonian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: true,
                quadratic_in_z: true,
                constant_mass: false,
                linear: false,
                separable: false,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 6,
                divisions: 1,
                sines: 2,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 6,
                multiplications: 15,
                divisions: 1,
                sines: 2,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 9,
                multiplications: 32,
                divisions: 1,
                sines: 2,
                functions: 0,
            },
            page: ::core::concat!(
                "H = ½ p² − cos q − a q cos(ω t)\n", "dt/dτ = 1/(1 + q²)\n",
                "H\u{303} = dt/dτ (H + p_t)\n", "Q(q) = −c p\n",
                "coordinates: q, t      momenta: p, p_t      parameters: a, ω, c\n",
                "operations, value: 4 +−, 6 ×, 1 ÷, 2 sin/cos, 0 other\n",
                "operations, gradient: 6 +−, 15 ×, 1 ÷, 2 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 9 +−, 32 ×, 1 ÷, 2 sin/cos, 0 other\n",
                "declared by             Hamiltonian, 2 coordinates\n",
                "depends on time         no\n", "forces                  yes\n",
                "linear                  no\n", "quadratic in p          yes\n",
                "constant H_pp           no, diagonal\n", "separable (H_pq = 0)    no\n",
                "smooth                  yes\n", "cyclic coordinates      none\n",
                "pattern H_pp            (0,0)\n",
                "pattern H_pq            (0,0) (1,0)\n",
                "pattern H_qq            (0,0) (0,1) (1,0) (1,1)\n",
                "pattern Q_p             (0,0) (1,0)\n",
                "pattern Q_q             (0,0) (1,0)"
            ),
        }
    }
    /// The observable `energy` at time `tau`, coordinates `q` and momenta `p`.
    fn energy(&self, tau: f64, q: [f64; 2], p: [f64; 2]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, tau, &q, &p, &mut values);
        values[0]
    }
}
