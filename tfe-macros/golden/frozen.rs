/// A mass on a spring.
#[derive(Clone, Debug, PartialEq, PartialOrd)]
///
/// # Derived model
/// ```text
/// L = ½ m (ṙ² + r² θ̇²) + m g r cos θ − ½ k (r − l)²
/// coordinates: r, θ      parameters: m, l, g, k
/// operations, value: 4 +−, 10 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient: 3 +−, 10 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient and second derivatives: 4 +−, 15 ×, 0 ÷, 1 sin/cos, 0 other
/// declared by             Lagrangian, 2 coordinates
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           no, diagonal
/// separable (L_vq = 0)    no
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0) (1,1)
/// pattern L_vq            (1,0)
/// pattern L_qq            (0,0) (0,1) (1,0) (1,1)
/// ```
pub struct SpringPendulum {
    /// Mass.
    pub m: f64,
    /// Length.
    pub l: f64,
    /// Acceleration of gravity.
    pub g: f64,
    /// Stiffness.
    pub k: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for SpringPendulum {
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
        /// L(q, v, t): 4 +−, 10 ×, 1 sin/cos
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            let cos_theta = q[1].cos();
            let t0 = z[0] * z[0];
            let t1 = q[0] * z[1];
            let t2 = t1 * t1;
            let t3 = t0 + t2;
            let t4 = t.like(0.5) * t3;
            let t5 = g * q[0];
            let t6 = cos_theta * t5;
            let t7 = t4 + t6;
            let t8 = m * t7;
            let t9 = l - q[0];
            let t10 = t.like(0.5) * k;
            let t11 = t9 * t9;
            let t12 = t10 * t11;
            t8 - t12
        }
        const LANES: bool = true;
        /// L_v and L_q: 3 +−, 10 ×, 1 sin/cos
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂ṙ, and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, ∂L/∂r, and parts of later results
            let t0 = g * m;
            let t1 = m * q[0];
            let t2 = z[1] * t1;
            let t3 = cos_theta * t0;
            let t4 = sin_theta * t0;
            let t5 = l - q[0];
            let t6 = k * t5;
            let t7 = z[1] * t2;
            let t8 = t6 + t7;
            first.q[0] = t3 + t8;
            first.z[1] = q[0] * t2;
            /// ∂L/∂θ
            let t9 = q[0] * t4;
            first.q[1] = -t9;
        }
        /// L_v and L_q, and L_vv: 3 +−, 11 ×, 1 sin/cos
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂ṙ, ∂²L/∂ṙ², and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            zz[0][0] = m;
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let t0 = l - q[0];
            let t1 = k * t0;
            let t2 = g * sin_theta;
            let t3 = g * m;
            let t4 = cos_theta * t3;
            let t5 = t1 + t4;
            let t6 = m * q[0];
            let t7 = q[0] * t6;
            zz[1][1] = t7;
            first.z[1] = z[1] * t7;
            /// ∂L/∂r
            let t8 = z[1] * z[1];
            let t9 = t6 * t8;
            first.q[0] = t9 + t5;
            /// ∂L/∂θ
            let t10 = t6 * t2;
            first.q[1] = -t10;
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
        /// L_v and L_q, L_vv, L_vq and L_qq: 4 +−, 15 ×, 1 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂ṙ, ∂²L/∂ṙ², and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            second.zz[0][0] = m;
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let t0 = g * m;
            let t1 = cos_theta * t0;
            let t2 = sin_theta * t0;
            let t3 = l - q[0];
            let t4 = k * t3;
            let t5 = m * q[0];
            let t6 = z[1] * t5;
            second.zz[1][1] = q[0] * t5;
            first.z[1] = q[0] * t6;
            /// ∂L/∂r, ∂²L/∂θ̇∂r
            let t7 = z[1] * t6;
            let t8 = t4 + t7;
            first.q[0] = t1 + t8;
            second.zq[1][0] = t.like(2.0) * t6;
            /// ∂²L/∂r²
            let t9 = z[1] * z[1];
            let t10 = m * t9;
            second.qq[0][0] = t10 - k;
            /// ∂L/∂θ, and parts of later results
            let t11 = q[0] * t1;
            let t12 = q[0] * t2;
            first.q[1] = -t12;
            /// ∂²L/∂r∂θ, ∂²L/∂θ²
            let t13 = -t2;
            second.qq[0][1] = t13;
            second.qq[1][0] = t13;
            second.qq[1][1] = -t11;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            values: &mut [R],
        ) {
            let cos_theta = q[1].cos();
            let t0 = q[0] * cos_theta;
            values[0] = -t0;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("r"),
                1 => __tfe::CoordinateName::single("theta"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["height"];
        fn parameters(&self) -> usize {
            4
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("l");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("g");
            }
            if index < 4 {
                return __tfe::CoordinateName::single("k");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.l;
            }
            if index < 3 {
                return self.g;
            }
            if index < 4 {
                return self.k;
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
                made.m = value;
            } else if index < 2 {
                made.l = value;
            } else if index < 3 {
                made.g = value;
            } else if index < 4 {
                made.k = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl SpringPendulum {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    pub fn state(&self, q: [f64; 2], v: [f64; 2]) -> ::tfe::__private::State<2> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    pub fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "SpringPendulum",
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
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 10,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 10,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 15,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ m (r\u{307}² + r² θ\u{307}²) + m g r cos θ − ½ k (r − l)²\n",
                "coordinates: r, θ      parameters: m, l, g, k\n",
                "operations, value: 4 +−, 10 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient: 3 +−, 10 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 4 +−, 15 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "declared by             Lagrangian, 2 coordinates\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           no, diagonal\n", "separable (L_vq = 0)    no\n",
                "smooth                  yes\n", "cyclic coordinates      none\n",
                "pattern L_vv            (0,0) (1,1)\n",
                "pattern L_vq            (1,0)\n",
                "pattern L_qq            (0,0) (0,1) (1,0) (1,1)"
            ),
        }
    }
    /// The observable `height` at time `t`, coordinates `q` and velocities `v`.
    pub fn height(&self, t: f64, q: [f64; 2], v: [f64; 2]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
/// `Rod` from [`SpringPendulum`]: frozen `r = l`; truncated to degree 4.
#[derive(Clone, Debug, PartialEq)]
///
/// # Derived model
/// ```text
/// SpringPendulum: frozen r = l; truncated to degree 4
/// L = 0.5 m l² θ̇² + m g l − 0.5 m g l θ² + 1/24 m g l θ⁴
/// coordinates: θ      parameters: m, l, g
/// operations, value: 3 +−, 9 ×, 1 ÷, 0 sin/cos, 0 other
/// operations, gradient: 1 +−, 7 ×, 1 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 2 +−, 8 ×, 1 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, 1 coordinate
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0)
/// pattern L_vq            zero
/// pattern L_qq            (0,0)
/// ```
pub struct Rod {
    /// Mass.
    pub m: f64,
    /// Length.
    pub l: f64,
    /// Acceleration of gravity.
    pub g: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<1> for Rod {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        /// L(q, v, t): 3 +−, 9 ×, 1 ÷
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 1], z: &[R; 1]) -> R {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            let t0 = l * m;
            let t1 = z[0] * z[0];
            let t2 = t.like(0.5) * t1;
            let t3 = l * t2;
            let t4 = g + t3;
            let t5 = q[0] * q[0];
            let t6 = t.like(0.5) * g;
            let t7 = g * t5;
            let t8 = t7 / t.like(24.0);
            let t9 = t6 - t8;
            let t10 = t5 * t9;
            let t11 = t4 - t10;
            t0 * t11
        }
        const LANES: bool = true;
        /// L_v and L_q: 1 +−, 7 ×, 1 ÷
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇
            let t0 = l * m;
            let t1 = l * z[0];
            first.z[0] = t0 * t1;
            /// ∂L/∂θ
            let t2 = g * q[0];
            let t3 = t0 * t2;
            let t4 = q[0] * q[0];
            let t5 = t4 * t3;
            let t6 = t5 / t.like(6.0);
            first.q[0] = t6 - t3;
        }
        /// L_v and L_q, and L_vv: 1 +−, 7 ×, 1 ÷
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇, ∂²L/∂θ̇²
            let t0 = l * m;
            let t1 = l * t0;
            zz[0][0] = t1;
            first.z[0] = z[0] * t1;
            /// ∂L/∂θ
            let t2 = g * q[0];
            let t3 = t0 * t2;
            let t4 = q[0] * q[0];
            let t5 = t4 * t3;
            let t6 = t5 / t.like(6.0);
            first.q[0] = t6 - t3;
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            __tfe::Model::first_inline(self, t, q, z, first);
        }
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 2 +−, 8 ×, 1 ÷
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            second: &mut __tfe::Second<R, 1>,
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇, ∂²L/∂θ̇²
            let t0 = l * m;
            let t1 = l * t0;
            second.zz[0][0] = t1;
            first.z[0] = z[0] * t1;
            /// ∂L/∂θ
            let t2 = g * t0;
            let t3 = q[0] * t2;
            let t4 = q[0] * t3;
            let t5 = q[0] * t4;
            let t6 = t5 / t.like(6.0);
            first.q[0] = t6 - t3;
            /// ∂²L/∂θ²
            let t7 = t.like(0.5) * t4;
            second.qq[0][0] = t7 - t2;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            values: &mut [R],
        ) {
            let l = t.parameter(1, self.l);
            let cos_theta = q[0].cos();
            let t0 = l * cos_theta;
            values[0] = -t0;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("theta"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["height"];
        fn parameters(&self) -> usize {
            3
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("l");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("g");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.l;
            }
            if index < 3 {
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
                made.m = value;
            } else if index < 2 {
                made.l = value;
            } else if index < 3 {
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
impl Rod {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    pub fn state(&self, q: [f64; 1], v: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    pub fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Rod",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: false,
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
                additions: 3,
                multiplications: 9,
                divisions: 1,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 1,
                multiplications: 7,
                divisions: 1,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 2,
                multiplications: 8,
                divisions: 1,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "SpringPendulum: frozen r = l; truncated to degree 4\n",
                "L = 0.5 m l² θ\u{307}² + m g l − 0.5 m g l θ² + 1/24 m g l θ⁴\n",
                "coordinates: θ      parameters: m, l, g\n",
                "operations, value: 3 +−, 9 ×, 1 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 1 +−, 7 ×, 1 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 2 +−, 8 ×, 1 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, 1 coordinate\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (0,0)\n",
                "pattern L_vq            zero\n", "pattern L_qq            (0,0)"
            ),
        }
    }
    /// The observable `height` at time `t`, coordinates `q` and velocities `v`.
    pub fn height(&self, t: f64, q: [f64; 1], v: [f64; 1]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
#[automatically_derived]
#[allow(dead_code)]
impl Rod {
    /// The model with the parameters of a [`SpringPendulum`].
    pub fn of(original: &SpringPendulum) -> Self {
        Self {
            m: original.m,
            l: original.l,
            g: original.g,
        }
    }
}
