/// # Derived model
/// ```text
/// x₁ = l₁ sin θ₁
/// y₁ = −l₁ cos θ₁
/// x₂ = x₁ + l₂ sin θ₂
/// y₂ = y₁ − l₂ cos θ₂
/// L = ½ m₁ (ẋ₁² + ẏ₁²) + ½ m₂ (ẋ₂² + ẏ₂²) − g (m₁ y₁ + m₂ y₂)
/// coordinates: θ₁, θ₂      parameters: m₁, m₂, l₁, l₂, g
/// operations, value: 7 +−, 17 ×, 0 ÷, 2 sin/cos, 0 other
/// operations, gradient: 7 +−, 20 ×, 0 ÷, 2 sin/cos, 0 other
/// operations, gradient and second derivatives: 9 +−, 25 ×, 0 ÷, 2 sin/cos, 0 other
/// declared by             Lagrangian, 2 coordinates
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           no
/// separable (L_vq = 0)    no
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0) (0,1) (1,0) (1,1)
/// pattern L_vq            (0,0) (0,1) (1,0) (1,1)
/// pattern L_qq            (0,0) (0,1) (1,0) (1,1)
/// ```
struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for DoublePendulum {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: false,
            linear: false,
            separable: false,
            smooth: true,
        };
        /// L(q, v, t): 7 +−, 17 ×, 2 sin/cos
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let g = t.parameter(4, self.g);
            let l1 = t.parameter(2, self.l1);
            let l2 = t.parameter(3, self.l2);
            let m1 = t.parameter(0, self.m1);
            let m2 = t.parameter(1, self.m2);
            let (sin_theta1, cos_theta1) = q[0].sin_cos();
            let (sin_theta2, cos_theta2) = q[1].sin_cos();
            let t0 = l1 * cos_theta1;
            let t1 = l1 * z[0];
            let t2 = z[0] * t0;
            let t3 = l2 * cos_theta2;
            let t4 = l2 * sin_theta2;
            let t5 = z[1] * t4;
            let t6 = z[1] * t3;
            let t7 = t2 + t6;
            let t8 = t7 * t7;
            let t9 = sin_theta1 * t1;
            let t10 = t5 + t9;
            let t11 = t1 * t1;
            let t12 = m1 * t11;
            let t13 = t10 * t10;
            let t14 = t8 + t13;
            let t15 = m2 * t14;
            let t16 = t12 + t15;
            let t17 = t.like(0.5) * t16;
            let t18 = m1 * t0;
            let t19 = t0 + t3;
            let t20 = m2 * t19;
            let t21 = t18 + t20;
            let t22 = g * t21;
            t17 + t22
        }
        const LANES: bool = true;
        /// L_v and L_q: 7 +−, 20 ×, 2 sin/cos
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let g = t.parameter(4, self.g);
            let l1 = t.parameter(2, self.l1);
            let l2 = t.parameter(3, self.l2);
            let m1 = t.parameter(0, self.m1);
            let m2 = t.parameter(1, self.m2);
            /// ∂L/∂θ̇₁, ∂L/∂θ̇₂, and parts of later results
            let (sin_theta1, cos_theta1) = q[0].sin_cos();
            let (sin_theta2, cos_theta2) = q[1].sin_cos();
            let t0 = l1 * z[0];
            let t1 = m1 + m2;
            let t2 = l2 * m2;
            let t3 = l2 * z[1];
            let t4 = z[1] * t2;
            let t5 = t0 * t1;
            let t6 = cos_theta1 * cos_theta2;
            let t7 = cos_theta2 * sin_theta1;
            let t8 = cos_theta1 * sin_theta2;
            let t9 = t7 - t8;
            let t10 = t0 * t9;
            let t11 = t4 * t10;
            let t12 = sin_theta1 * sin_theta2;
            let t13 = t6 + t12;
            let t14 = t4 * t13;
            let t15 = t5 + t14;
            let t16 = t0 * t13;
            let t17 = t3 + t16;
            first.z[0] = l1 * t15;
            first.z[1] = t2 * t17;
            /// ∂L/∂θ₁, ∂L/∂θ₂
            let t18 = g * l1;
            let t19 = sin_theta1 * t18;
            let t20 = t19 * t1;
            let t21 = g * sin_theta2;
            let t22 = t2 * t21;
            let t23 = t11 + t20;
            first.q[1] = t11 - t22;
            first.q[0] = -t23;
        }
        /// L_v and L_q, and L_vv: 7 +−, 21 ×, 2 sin/cos
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let g = t.parameter(4, self.g);
            let l1 = t.parameter(2, self.l1);
            let l2 = t.parameter(3, self.l2);
            let m1 = t.parameter(0, self.m1);
            let m2 = t.parameter(1, self.m2);
            /// ∂²L/∂θ̇₁², and parts of later results
            let (sin_theta1, cos_theta1) = q[0].sin_cos();
            let (sin_theta2, cos_theta2) = q[1].sin_cos();
            let t0 = m1 + m2;
            let t1 = l1 * cos_theta1;
            let t2 = l2 * m2;
            let t3 = cos_theta2 * t2;
            let t4 = l1 * sin_theta1;
            let t5 = l1 * l1;
            let t6 = t5 * t0;
            zz[0][0] = t6;
            /// ∂²L/∂θ̇₂², and parts of later results
            let t7 = z[0] * t6;
            let t8 = sin_theta2 * t2;
            let t9 = l2 * t2;
            zz[1][1] = t9;
            /// ∂²L/∂θ̇₁∂θ̇₂, and parts of later results
            let t10 = z[1] * t9;
            let t11 = t4 * t0;
            let t12 = g * t11;
            let t13 = g * t8;
            let t14 = t1 * t3;
            let t15 = t4 * t3;
            let t16 = t4 * t8;
            let t17 = t14 + t16;
            zz[0][1] = t17;
            zz[1][0] = t17;
            /// ∂L/∂θ̇₁, and parts of later results
            let t18 = t1 * t8;
            let t19 = t15 - t18;
            let t20 = z[1] * t17;
            first.z[0] = t7 + t20;
            /// ∂L/∂θ̇₂
            let t21 = z[0] * t17;
            first.z[1] = t10 + t21;
            /// ∂L/∂θ₁, ∂L/∂θ₂
            let t22 = z[0] * z[1];
            let t23 = t22 * t19;
            let t24 = t12 + t23;
            first.q[1] = t23 - t13;
            first.q[0] = -t24;
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
        /// L_v and L_q, L_vv, L_vq and L_qq: 9 +−, 25 ×, 2 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let g = t.parameter(4, self.g);
            let l1 = t.parameter(2, self.l1);
            let l2 = t.parameter(3, self.l2);
            let m1 = t.parameter(0, self.m1);
            let m2 = t.parameter(1, self.m2);
            /// ∂²L/∂θ̇₁², and parts of later results
            let (sin_theta1, cos_theta1) = q[0].sin_cos();
            let (sin_theta2, cos_theta2) = q[1].sin_cos();
            let t0 = m1 + m2;
            let t1 = l1 * cos_theta1;
            let t2 = l2 * m2;
            let t3 = cos_theta2 * t2;
            let t4 = l1 * sin_theta1;
            let t5 = l1 * l1;
            let t6 = t5 * t0;
            second.zz[0][0] = t6;
            /// ∂²L/∂θ̇₂², and parts of later results
            let t7 = z[0] * t6;
            let t8 = sin_theta2 * t2;
            let t9 = l2 * t2;
            second.zz[1][1] = t9;
            /// ∂²L/∂θ̇₁∂θ̇₂, and parts of later results
            let t10 = z[1] * t9;
            let t11 = g * t0;
            let t12 = t1 * t3;
            let t13 = t4 * t8;
            let t14 = t12 + t13;
            second.zz[0][1] = t14;
            second.zz[1][0] = t14;
            /// ∂L/∂θ̇₁
            let t15 = z[1] * t14;
            first.z[0] = t7 + t15;
            /// ∂L/∂θ̇₂
            let t16 = z[0] * t14;
            first.z[1] = t10 + t16;
            /// ∂²L/∂θ₁∂θ₂
            let t17 = z[0] * t15;
            second.qq[0][1] = t17;
            second.qq[1][0] = t17;
            /// ∂²L/∂θ̇₁∂θ₂, and parts of later results
            let t18 = t4 * t3;
            let t19 = t4 * t11;
            let t20 = t1 * t11;
            let t21 = t1 * t8;
            let t22 = t18 - t21;
            let t23 = z[1] * t22;
            second.zq[0][1] = t23;
            /// ∂²L/∂θ̇₂∂θ₂, and parts of later results
            let t24 = g * t8;
            let t25 = g * t3;
            let t26 = z[0] * t22;
            second.zq[1][1] = t26;
            /// ∂L/∂θ₁, ∂L/∂θ₂, ∂²L/∂θ̇₁∂θ₁, ∂²L/∂θ̇₂∂θ₁
            let t27 = z[0] * t23;
            let t28 = t27 + t19;
            first.q[1] = t27 - t24;
            first.q[0] = -t28;
            second.zq[0][0] = -t23;
            second.zq[1][0] = -t26;
            /// ∂²L/∂θ₁², ∂²L/∂θ₂²
            let t29 = t17 + t20;
            let t30 = t25 + t17;
            second.qq[0][0] = -t29;
            second.qq[1][1] = -t30;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            values: &mut [R],
        ) {
            let l1 = t.parameter(2, self.l1);
            let l2 = t.parameter(3, self.l2);
            let sin_theta1 = q[0].sin();
            let sin_theta2 = q[1].sin();
            let t0 = l1 * sin_theta1;
            let t1 = l2 * sin_theta2;
            values[0] = t0 + t1;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("theta1"),
                1 => __tfe::CoordinateName::single("theta2"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["tip_x"];
        fn parameters(&self) -> usize {
            5
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m1");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("m2");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("l1");
            }
            if index < 4 {
                return __tfe::CoordinateName::single("l2");
            }
            if index < 5 {
                return __tfe::CoordinateName::single("g");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m1;
            }
            if index < 2 {
                return self.m2;
            }
            if index < 3 {
                return self.l1;
            }
            if index < 4 {
                return self.l2;
            }
            if index < 5 {
                return self.g;
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
                made.m1 = value;
            } else if index < 2 {
                made.m2 = value;
            } else if index < 3 {
                made.l1 = value;
            } else if index < 4 {
                made.l2 = value;
            } else if index < 5 {
                made.g = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl DoublePendulum {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 2], v: [f64; 2]) -> ::tfe::__private::State<2> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "DoublePendulum",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: false,
                quadratic_in_z: true,
                constant_mass: false,
                linear: false,
                separable: false,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: false,
            value: ::tfe::__private::Operations {
                additions: 7,
                multiplications: 17,
                divisions: 0,
                sines: 2,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 7,
                multiplications: 20,
                divisions: 0,
                sines: 2,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 9,
                multiplications: 25,
                divisions: 0,
                sines: 2,
                functions: 0,
            },
            page: ::core::concat!(
                "x₁ = l₁ sin θ₁\n", "y₁ = −l₁ cos θ₁\n",
                "x₂ = x₁ + l₂ sin θ₂\n", "y₂ = y₁ − l₂ cos θ₂\n",
                "L = ½ m₁ (x\u{307}₁² + y\u{307}₁²) + ½ m₂ (x\u{307}₂² + y\u{307}₂²) − g (m₁ y₁ + m₂ y₂)\n",
                "coordinates: θ₁, θ₂      parameters: m₁, m₂, l₁, l₂, g\n",
                "operations, value: 7 +−, 17 ×, 0 ÷, 2 sin/cos, 0 other\n",
                "operations, gradient: 7 +−, 20 ×, 0 ÷, 2 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 9 +−, 25 ×, 0 ÷, 2 sin/cos, 0 other\n",
                "declared by             Lagrangian, 2 coordinates\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           no\n", "separable (L_vq = 0)    no\n",
                "smooth                  yes\n", "cyclic coordinates      none\n",
                "pattern L_vv            (0,0) (0,1) (1,0) (1,1)\n",
                "pattern L_vq            (0,0) (0,1) (1,0) (1,1)\n",
                "pattern L_qq            (0,0) (0,1) (1,0) (1,1)"
            ),
        }
    }
    /// The observable `tip_x` at time `t`, coordinates `q` and velocities `v`.
    fn tip_x(&self, t: f64, q: [f64; 2], v: [f64; 2]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
