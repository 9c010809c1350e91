/// # Derived model
/// ```text
/// L = ½ m ẋ² − ½ k[0] x² − k[1]/4 x⁴
/// D = ½ c ẋ²
/// Q(x) = amplitude cos(ω t)
/// coordinates: x      parameters: m, k, c, amplitude, ω      sensitivity: ω, k[1], c
/// operations, value: 2 +−, 8 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 2 +−, 7 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient and second derivatives: 3 +−, 8 ×, 0 ÷, 1 sin/cos, 0 other
/// declared by             Lagrangian, 1 coordinate
/// depends on time         yes
/// forces                  yes
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0)
/// pattern L_vq            zero
/// pattern L_qq            (0,0)
/// pattern Q_v             (0,0)
/// pattern Q_q             zero
/// ```
struct Duffing {
    m: f64,
    k: [f64; 2],
    c: f64,
    amplitude: f64,
    omega: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<1> for Duffing {
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
        /// L(q, v, t): 2 +−, 8 ×
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 1], z: &[R; 1]) -> R {
            let m = t.parameter(0, self.m);
            let t0 = z[0] * z[0];
            let t1 = m * t0;
            let t2 = q[0] * q[0];
            let t3 = t.parameter(1, self.k[0]) * t2;
            let t4 = t1 - t3;
            let t5 = t.like(0.5) * t4;
            let t6 = t.like(0.25) * t.parameter(2, self.k[1]);
            let t7 = t2 * t2;
            let t8 = t6 * t7;
            t5 - t8
        }
        const LANES: bool = true;
        /// L_v, L_q and Q: 2 +−, 7 ×, 1 sin/cos
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            let amplitude = t.parameter(4, self.amplitude);
            let c = t.parameter(3, self.c);
            let m = t.parameter(0, self.m);
            let omega = t.parameter(5, self.omega);
            /// ∂L/∂ẋ, and parts of later results
            let t0 = t * omega;
            let t1 = t0.cos();
            let t2 = amplitude * t1;
            first.z[0] = m * z[0];
            /// Q_x
            let t3 = c * z[0];
            first.force[0] = t2 - t3;
            /// ∂L/∂x
            let t4 = q[0] * q[0];
            let t5 = t.parameter(2, self.k[1]) * t4;
            let t6 = t.parameter(1, self.k[0]) + t5;
            let t7 = q[0] * t6;
            first.q[0] = -t7;
        }
        /// L_v, L_q and Q, and L_vv: 2 +−, 7 ×, 1 sin/cos
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            let amplitude = t.parameter(4, self.amplitude);
            let c = t.parameter(3, self.c);
            let m = t.parameter(0, self.m);
            let omega = t.parameter(5, self.omega);
            /// ∂²L/∂ẋ², and parts of later results
            let t0 = t * omega;
            let t1 = t0.cos();
            zz[0][0] = m;
            /// ∂L/∂ẋ, and parts of later results
            let t2 = amplitude * t1;
            first.z[0] = m * z[0];
            /// Q_x
            let t3 = c * z[0];
            first.force[0] = t2 - t3;
            /// ∂L/∂x
            let t4 = q[0] * q[0];
            let t5 = t.parameter(2, self.k[1]) * t4;
            let t6 = t.parameter(1, self.k[0]) + t5;
            let t7 = q[0] * t6;
            first.q[0] = -t7;
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
        /// L_v, L_q and Q, L_vv, L_vq, L_qq, Q_v and Q_q: 3 +−, 8 ×, 1 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            second: &mut __tfe::Second<R, 1>,
        ) {
            let amplitude = t.parameter(4, self.amplitude);
            let c = t.parameter(3, self.c);
            let m = t.parameter(0, self.m);
            let omega = t.parameter(5, self.omega);
            /// ∂²L/∂ẋ², and parts of later results
            let t0 = t * omega;
            let t1 = t0.cos();
            second.zz[0][0] = m;
            /// ∂L/∂ẋ, and parts of later results
            let t2 = amplitude * t1;
            first.z[0] = m * z[0];
            /// Q_x, ∂Q_x/∂ẋ
            let t3 = c * z[0];
            first.force[0] = t2 - t3;
            second.force_z[0][0] = -c;
            /// ∂L/∂x
            let t4 = q[0] * q[0];
            let t5 = t.parameter(2, self.k[1]) * t4;
            let t6 = t.parameter(1, self.k[0]) + t5;
            let t7 = q[0] * t6;
            first.q[0] = -t7;
            /// ∂²L/∂x²
            let t8 = t.like(3.0) * t5;
            let t9 = t.parameter(1, self.k[0]) + t8;
            second.qq[0][0] = -t9;
        }
        /// Derivatives of L_v, L_q and Q by the time and by parameters
        fn first_by<R: __tfe::Real>(
            &self,
            by: __tfe::By,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            match by {
                /// ∂/∂t: 3 ×, 1 sin/cos
                __tfe::By::Time => {
                    let amplitude = t.parameter(4, self.amplitude);
                    let omega = t.parameter(5, self.omega);
                    let t0 = t * omega;
                    let t1 = t0.sin();
                    let t2 = amplitude * omega;
                    let t3 = t1 * t2;
                    first.force[0] = -t3;
                }
                /// ∂/∂ω: 3 ×, 1 sin/cos
                __tfe::By::Parameter(0) => {
                    let amplitude = t.parameter(4, self.amplitude);
                    let omega = t.parameter(5, self.omega);
                    let t0 = t * omega;
                    let t1 = t0.sin();
                    let t2 = amplitude * t1;
                    let t3 = t * t2;
                    first.force[0] = -t3;
                }
                /// ∂/∂k[1]: 2 ×
                __tfe::By::Parameter(1) => {
                    let t0 = q[0] * q[0];
                    let t1 = q[0] * t0;
                    first.q[0] = -t1;
                }
                /// ∂/∂c: no operations
                __tfe::By::Parameter(2) => {
                    first.force[0] = -z[0];
                }
                _ => {}
            }
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        fn parameters(&self) -> usize {
            6
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 3 {
                return __tfe::CoordinateName::element("k", index - 1);
            }
            if index < 4 {
                return __tfe::CoordinateName::single("c");
            }
            if index < 5 {
                return __tfe::CoordinateName::single("amplitude");
            }
            if index < 6 {
                return __tfe::CoordinateName::single("omega");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 3 {
                return self.k[index - 1];
            }
            if index < 4 {
                return self.c;
            }
            if index < 5 {
                return self.amplitude;
            }
            if index < 6 {
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
            if index < 1 {
                made.m = value;
            } else if index < 3 {
                made.k[index - 1] = value;
            } else if index < 4 {
                made.c = value;
            } else if index < 5 {
                made.amplitude = value;
            } else if index < 6 {
                made.omega = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
        const SENSITIVITIES: &'static [&'static str] = &["omega", "k[1]", "c"];
        fn sensitivity_parameter(&self, index: usize) -> f64 {
            match index {
                0 => self.omega,
                1 => self.k[1],
                2 => self.c,
                _ => ::core::primitive::f64::NAN,
            }
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Duffing {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 1], v: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Duffing",
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
                additions: 2,
                multiplications: 8,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 2,
                multiplications: 7,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 8,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ m x\u{307}² − ½ k[0] x² − k[1]/4 x⁴\n",
                "D = ½ c x\u{307}²\n", "Q(x) = amplitude cos(ω t)\n",
                "coordinates: x      parameters: m, k, c, amplitude, ω      sensitivity: ω, k[1], c\n",
                "operations, value: 2 +−, 8 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 2 +−, 7 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 3 +−, 8 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "declared by             Lagrangian, 1 coordinate\n",
                "depends on time         yes\n", "forces                  yes\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (0,0)\n",
                "pattern L_vq            zero\n", "pattern L_qq            (0,0)\n",
                "pattern Q_v             (0,0)\n", "pattern Q_q             zero"
            ),
        }
    }
}
