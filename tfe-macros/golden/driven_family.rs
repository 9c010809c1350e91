/// # Derived model
/// ```text
/// L = Σ_{i = 0..n} ½ q̇[i]² − (Σ_{i = 0..n − 1} ½ (q[i + 1] − q[i])²) − ½ (q[0] − w)²
/// Q(q[i]) = u
/// coordinates: q[n]      parameters: n      inputs: w, u
/// operations, value: 4 +−, 6 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 3 +−, 0 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 4 +−, 0 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, n coordinates
/// depends on time         yes
/// forces                  yes
/// linear                  yes
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (i,i)
/// pattern L_vq            zero
/// pattern L_qq            (0,0) (i,i) (i,i+1) (i+1,i) (i+1,i+1)
/// pattern Q_v             zero
/// pattern Q_q             zero
/// ```
struct Chain {
    n: usize,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    impl __tfe::Declared<0> for Chain {
        type Length = __tfe::RunTimeLength;
    }
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::FamilyModel for Chain {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: true,
            forced: true,
            quadratic_in_z: true,
            constant_mass: true,
            linear: true,
            separable: true,
            smooth: true,
        };
        const MOMENTA_MOVE: bool = false;
        fn len(&self) -> usize {
            self.n
        }
        fn check(&self) -> ::core::result::Result<(), __tfe::FamilyError> {
            __tfe::checks::length("n", self.n)?;
            __tfe::checks::elements("q[n]", self.n)?;
            __tfe::checks::terms(
                "i in 0..n-1",
                0,
                (self.n as i64) - 1,
                ((self.n as i64), &[((self.n as i64) - 1)]),
            )?;
            __tfe::checks::index(("q", "0", ""), 0, self.n)?;
            ::core::result::Result::Ok(())
        }
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R]) -> R {
            <Self as __tfe::FamilyControlled>::energy_function_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
            )
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            <Self as __tfe::FamilyControlled>::first_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
                first,
            );
        }
        #[inline(always)]
        fn forces_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            <Self as __tfe::FamilyControlled>::forces_inline_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
                first,
            );
        }
        fn mass<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            entries: &mut __E,
        ) {
            <Self as __tfe::FamilyControlled>::mass_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
                entries,
            );
        }
        fn second<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
            entries: &mut __E,
        ) {
            <Self as __tfe::FamilyControlled>::second_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
                first,
                entries,
            );
        }
        fn observables<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R], values: &mut [R]) {
            <Self as __tfe::FamilyControlled>::observables_with(
                self,
                &[t.like(0.0); __tfe::MAX_INPUTS],
                t,
                q,
                z,
                values,
            );
        }
        fn coordinate_name(&self, index: usize) -> __tfe::CoordinateName {
            let end = self.n;
            if index < end {
                return __tfe::CoordinateName::element("q", index);
            }
            let index = index - end;
            __tfe::CoordinateName::element("", index)
        }
        const OBSERVABLES: &'static [&'static str] = &["power"];
        fn unnumbered<__F: ::core::ops::FnMut(u64)>(&self, values: &mut __F) {
            values(self.n as u64);
        }
    }
    #[automatically_derived]
    #[allow(unused, non_snake_case, clippy::too_many_arguments)]
    impl __tfe::FamilyControlled for Chain {
        const INPUTS: &'static [&'static str] = &["w", "u"];
        /// L(q, v, t): 4 +−, 6 ×; those of a loop for one turn
        fn energy_function_with<R: __tfe::Real>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
        ) -> R {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let t0 = q[0] - inputs[0];
            let t1 = t0 * t0;
            let t2 = t.like(0.5) * t1;
            let t3 = -t2;
            let mut t4 = t3;
            for i in 0..self.n.saturating_sub(1) {
                let t5 = q[i] - q[i + 1];
                let t6 = t5 * t5;
                let t7 = t.like(0.5) * t6;
                t4 -= t7;
            }
            for i in 0..self.n {
                let t8 = z[i] * z[i];
                t4 += t.like(0.5) * t8;
            }
            t4
        }
        /// L_v, L_q and Q: 3 +−; those of a loop for one turn
        fn first_with<R: __tfe::Real>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: &mut first.z[..__tfe_length],
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            /// L_q
            let t0 = inputs[0] - q[0];
            let mut t1 = t0;
            for i in 0..self.n.saturating_sub(1) {
                let t2 = q[i] - q[i + 1];
                first.q[i] = t1 - t2;
                t1 = t2;
            }
            /// L_v, L_q, Q
            for i in 0..self.n {
                first.z[i] = z[i];
                first.force[i] = inputs[1];
            }
            first.q[self.n.saturating_sub(1)] = t1;
        }
        /// L_q and Q: 3 +−; those of a loop for one turn
        #[inline(always)]
        fn forces_inline_with<R: __tfe::Real>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: first.z,
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            /// L_q
            let t0 = inputs[0] - q[0];
            let mut t1 = t0;
            for i in 0..self.n.saturating_sub(1) {
                let t2 = q[i] - q[i + 1];
                first.q[i] = t1 - t2;
                t1 = t2;
            }
            /// L_q, Q
            for i in 0..self.n {
                first.force[i] = inputs[1];
            }
            first.q[self.n.saturating_sub(1)] = t1;
        }
        /// L_vv: no operations
        fn mass_with<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
            entries: &mut __E,
        ) {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            for i in 0..self.n {
                entries.add(__tfe::Block::ZZ, i, i, t.like(1.0));
            }
        }
        /// L_v, L_q and Q, L_vv, L_vq, L_qq, Q_v and Q_q: 4 +−; those of a loop for one turn
        fn second_with<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
            entries: &mut __E,
        ) {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: &mut first.z[..__tfe_length],
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            /// L_q, L_qq
            let t0 = inputs[0] - q[0];
            let mut t1 = t0;
            let mut t2 = t.like(-1.0);
            for i in 0..self.n.saturating_sub(1) {
                entries.add(__tfe::Block::QQ, i, i + 1, t.like(1.0));
                entries.add(__tfe::Block::QQ, i + 1, i, t.like(1.0));
                let t3 = q[i] - q[i + 1];
                first.q[i] = t1 - t3;
                t1 = t3;
                entries.add(__tfe::Block::QQ, i, i, t2 - t.like(1.0));
                t2 = t.like(-1.0);
            }
            /// L_v, L_q, Q, L_vv, L_qq
            for i in 0..self.n {
                first.z[i] = z[i];
                first.force[i] = inputs[1];
                entries.add(__tfe::Block::ZZ, i, i, t.like(1.0));
            }
            first.q[self.n.saturating_sub(1)] = t1;
            entries
                .add(
                    __tfe::Block::QQ,
                    self.n.saturating_sub(1),
                    self.n.saturating_sub(1),
                    t2,
                );
        }
        fn observables_with<R: __tfe::Real>(
            &self,
            inputs: &[R; __tfe::MAX_INPUTS],
            t: R,
            q: &[R],
            z: &[R],
            values: &mut [R],
        ) {
            let __tfe_length = self.n;
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            values[0] = inputs[1] * z[0];
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Chain {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Vectors of another length than the model's, and lengths of the model that do not fit together, are errors of the run.
    fn state(
        &self,
        q: impl ::core::convert::AsRef<[::core::primitive::f64]>,
        v: impl ::core::convert::AsRef<[::core::primitive::f64]>,
    ) -> ::tfe::__private::FamilyState {
        ::tfe::__private::family_state(self, 0.0, q, v)
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
                linear: true,
                separable: true,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 6,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 0,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 0,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "L = Σ_{i = 0..n} ½ q\u{307}[i]² − (Σ_{i = 0..n − 1} ½ (q[i + 1] − q[i])²) − ½ (q[0] − w)²\n",
                "Q(q[i]) = u\n",
                "coordinates: q[n]      parameters: n      inputs: w, u\n",
                "operations, value: 4 +−, 6 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 3 +−, 0 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 4 +−, 0 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, n coordinates\n",
                "depends on time         yes\n", "forces                  yes\n",
                "linear                  yes\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (i,i)\n",
                "pattern L_vq            zero\n",
                "pattern L_qq            (0,0) (i,i) (i,i+1) (i+1,i) (i+1,i+1)\n",
                "pattern Q_v             zero\n", "pattern Q_q             zero"
            ),
        }
    }
    /// The observable `power` at time `t`, coordinates `q` and velocities `v`.
    ///
    /// # Errors
    /// Vectors of another length than the model's, and lengths of the model that do not fit together.
    fn power(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
    ) -> ::core::result::Result<f64, ::tfe::__private::FamilyError> {
        ::tfe::__private::family_observable(self, t, q, v, 0)
    }
}
