/// # Derived model
/// ```text
/// L = ½ m (ẋ² + ẏ²) − m g y
/// 0 = x² + y² − l²      (rod)
/// coordinates: x, y      parameters: m, l, g
/// operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 0 +−, 3 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 0 +−, 3 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, 2 coordinates
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0) (1,1)
/// pattern L_vq            zero
/// pattern L_qq            zero
/// constraints             rod (holonomic, quadratic)
/// ```
struct RodPendulum {
    m: f64,
    l: f64,
    g: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for RodPendulum {
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
        const DIAGONAL_MASS: bool = true;
        /// L(q, v, t): 2 +−, 5 ×
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let g = t.parameter(2, self.g);
            let m = t.parameter(0, self.m);
            let t0 = g * q[1];
            let t1 = z[0] * z[0];
            let t2 = z[1] * z[1];
            let t3 = t1 + t2;
            let t4 = t.like(0.5) * t3;
            let t5 = t4 - t0;
            m * t5
        }
        /// L_v and L_q: 3 ×
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let g = t.parameter(2, self.g);
            let m = t.parameter(0, self.m);
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            let t0 = g * m;
            first.q[1] = -t0;
        }
        /// L_v and L_q, and L_vv: 3 ×
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let g = t.parameter(2, self.g);
            let m = t.parameter(0, self.m);
            zz[0][0] = m;
            zz[1][1] = m;
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            let t0 = g * m;
            first.q[1] = -t0;
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 3 ×
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let g = t.parameter(2, self.g);
            let m = t.parameter(0, self.m);
            second.zz[0][0] = m;
            second.zz[1][1] = m;
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            let t0 = g * m;
            first.q[1] = -t0;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                1 => __tfe::CoordinateName::single("y"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const CONSTRAINTS: &'static [__tfe::Constraint] = &[
            __tfe::Constraint {
                name: "rod",
                kind: __tfe::ConstraintKind::Holonomic {
                    quadratic: true,
                },
            },
        ];
        /// φ(q, t): 2 +−, 3 ×
        fn constraint_values<R: __tfe::Real>(&self, t: R, q: &[R; 2], values: &mut [R]) {
            let ::core::option::Option::Some(values) = values.first_chunk_mut::<1>()
            else {
                return;
            };
            let l = t.parameter(1, self.l);
            let t0 = q[0] * q[0];
            let t1 = q[1] * q[1];
            let t2 = t0 + t1;
            let t3 = l * l;
            values[0] = t2 - t3;
        }
        /// A and a of ψ = A v + a: 2 ×
        fn constraint_rows<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            rows: &mut [[R; 2]],
            drift: &mut [R],
        ) {
            let ::core::option::Option::Some(rows) = rows.first_chunk_mut::<1>() else {
                return;
            };
            rows[0][0] = t.like(2.0) * q[0];
            rows[0][1] = t.like(2.0) * q[1];
        }
        /// ∂ψ/∂q, Ȧ, ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂q and ∂(Ȧᵀμ)/∂v: 3 ×
        fn constraint_second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            v: &[R; 2],
            mu: &[R],
            second: &mut __tfe::ConstraintSecond<'_, R, 2>,
        ) {
            let ::core::option::Option::Some(mu) = mu.first_chunk::<1>() else {
                return;
            };
            let ::core::option::Option::Some(psi_q) = second.psi_q.first_chunk_mut::<1>()
            else {
                return;
            };
            let ::core::option::Option::Some(row_rates) = second
                .row_rates
                .first_chunk_mut::<1>() else {
                return;
            };
            /// ∂ψ/∂q, Ȧ
            let t0 = t.like(2.0) * v[0];
            psi_q[0][0] = t0;
            row_rates[0][0] = t0;
            /// ∂ψ/∂q, Ȧ
            let t1 = t.like(2.0) * v[1];
            psi_q[0][1] = t1;
            row_rates[0][1] = t1;
            /// ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂v
            let t2 = t.like(2.0) * mu[0];
            second.bend[0][0] = t2;
            second.bend[1][1] = t2;
            second.rate_v[0][0] = t2;
            second.rate_v[1][1] = t2;
        }
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
impl RodPendulum {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 2], v: [f64; 2]) -> ::tfe::__private::State<2> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "RodPendulum",
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
                additions: 2,
                multiplications: 5,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 0,
                multiplications: 3,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 0,
                multiplications: 3,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ m (x\u{307}² + y\u{307}²) − m g y\n",
                "0 = x² + y² − l²      (rod)\n",
                "coordinates: x, y      parameters: m, l, g\n",
                "operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 0 +−, 3 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 0 +−, 3 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, 2 coordinates\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n",
                "pattern L_vv            (0,0) (1,1)\n",
                "pattern L_vq            zero\n", "pattern L_qq            zero\n",
                "constraints             rod (holonomic, quadratic)"
            ),
        }
    }
}
