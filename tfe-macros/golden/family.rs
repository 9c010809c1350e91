/// # Derived model
/// ```text
/// L = ½ ṡ² + Σ_{i = 0..n} ½ m[i] q̇[i]² − (Σ_{i = 0..w} (½ k (q[i + 1] − q[i])² + a/3 (q[i + 1] − q[i])³)) − ½ k (q[0] − s)²
/// Q(q[n − 1]) = −q̇[n − 1]
/// coordinates: s, q[n]      parameters: n, w, m, k, a
/// operations, value: 6 +−, 11 ×, 1 ÷, 0 sin/cos, 0 other
/// operations, gradient: 7 +−, 4 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 16 +−, 4 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, n+1 coordinates
/// depends on time         no
/// forces                  yes
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0) (i+1,i+1)
/// pattern L_vq            zero
/// pattern L_qq            (0,0) (0,1) (1,0) (1,1) (i+1,i+1) (i+1,i+2) (i+2,i+1) (i+2,i+2)
/// pattern Q_v             (n,n)
/// pattern Q_q             zero
/// ```
struct Family {
    n: usize,
    w: usize,
    m: Vec<f64>,
    k: f64,
    a: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    impl __tfe::Declared<0> for Family {
        type Length = __tfe::RunTimeLength;
    }
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::FamilyModel for Family {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: true,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        const MOMENTA_MOVE: bool = false;
        fn len(&self) -> usize {
            1usize.saturating_add(self.n)
        }
        fn check(&self) -> ::core::result::Result<(), __tfe::FamilyError> {
            __tfe::checks::length("n", self.n)?;
            __tfe::checks::length("w", self.w)?;
            __tfe::checks::elements("q[n]", self.n)?;
            __tfe::checks::terms(
                "i in 0..w",
                0,
                (self.w as i64),
                ((self.n as i64) + 1, &[((self.w as i64) + 1)]),
            )?;
            __tfe::checks::field_length(
                "m",
                self.m.len(),
                &[((self.n as i64), "i", "i in 0..n")],
            )?;
            for i in 0..self.w {
                __tfe::checks::index(("q", "i+1", "i in 0..w"), (i as i64) + 1, self.n)?;
            }
            for i in 0..self.w {
                __tfe::checks::index(("q", "i", "i in 0..w"), (i as i64), self.n)?;
            }
            __tfe::checks::index(("q", "0", ""), 0, self.n)?;
            __tfe::checks::index(("q", "n-1", ""), (self.n as i64) - 1, self.n)?;
            ::core::result::Result::Ok(())
        }
        /// L(q, v, t): 6 +−, 11 ×, 1 ÷; those of a loop for one turn
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R]) -> R {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let a = t.parameter(self.m.len() + 1, self.a);
            let k = t.parameter(self.m.len(), self.k);
            let t0 = q[0] - q[1];
            let t1 = z[0] * z[0];
            let t2 = t0 * t0;
            let t3 = k * t2;
            let t4 = t1 - t3;
            let t5 = t.like(0.5) * t4;
            let mut t6 = t5;
            for i in 0..self.n {
                let t7 = t.like(0.5) * t.parameter(i, self.m[i]);
                let t8 = z[i + 1] * z[i + 1];
                t6 += t7 * t8;
            }
            let t9 = t.like(0.5) * k;
            for i in 0..self.w {
                let t10 = q[i + 1] - q[i + 2];
                let t11 = a * t10;
                let t12 = t10 * t10;
                let t13 = t11 / t.like(3.0);
                let t14 = t9 - t13;
                let t15 = t12 * t14;
                t6 -= t15;
            }
            t6
        }
        /// L_v, L_q and Q: 7 +−, 4 ×; those of a loop for one turn
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: &mut first.z[..__tfe_length],
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            let a = t.parameter(self.m.len() + 1, self.a);
            let k = t.parameter(self.m.len(), self.k);
            first.q.fill(t.like(0.0));
            /// L_v, L_q, Q
            let t0 = q[0] - q[1];
            let t1 = k * t0;
            let mut t2 = t1;
            first.z[0] = z[0];
            first.q[0] -= t1;
            first.force[self.n] = -z[self.n];
            /// L_v
            for i in 0..self.n {
                first.z[i + 1] = t.parameter(i, self.m[i]) * z[i + 1];
            }
            /// L_q
            for i in 0..self.w {
                let t3 = q[i + 1] - q[i + 2];
                let t4 = a * t3;
                let t5 = k - t4;
                let t6 = t5 * t3;
                first.q[i + 1] += t2 - t6;
                t2 = t6;
            }
            first.q[self.w + 1] += t2;
        }
        /// L_q and Q: 7 +−, 3 ×; those of a loop for one turn
        #[inline(always)]
        fn forces_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: first.z,
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            let a = t.like(self.a);
            let k = t.like(self.k);
            /// L_q, Q
            let t0 = q[0] - q[1];
            let t1 = k * t0;
            let mut t2 = t1;
            first.q[0] -= t1;
            first.force[self.n] = -z[self.n];
            /// L_q
            for i in 0..self.w {
                let t3 = q[i + 1] - q[i + 2];
                let t4 = a * t3;
                let t5 = k - t4;
                let t6 = t5 * t3;
                first.q[i + 1] += t2 - t6;
                t2 = t6;
            }
            first.q[self.w + 1] += t2;
        }
        /// L_vv: no operations
        fn mass<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            entries: &mut __E,
        ) {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            entries.add(__tfe::Block::ZZ, 0, 0, t.like(1.0));
            for i in 0..self.n {
                entries.add(__tfe::Block::ZZ, i + 1, i + 1, t.like(self.m[i]));
            }
        }
        /// L_v, L_q and Q, L_vv, L_vq, L_qq, Q_v and Q_q: 16 +−, 4 ×; those of a loop for one turn
        fn second<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
            entries: &mut __E,
        ) {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            let first = __tfe::Gradient {
                z: &mut first.z[..__tfe_length],
                q: &mut first.q[..__tfe_length],
                force: &mut first.force[..__tfe_length],
            };
            let a = t.like(self.a);
            let k = t.like(self.k);
            first.q.fill(t.like(0.0));
            /// L_v, L_q, Q, L_vv, L_qq, Q_v
            let t0 = q[0] - q[1];
            let t1 = k * t0;
            let mut t2 = t1;
            let t3 = -k;
            let mut t4 = t3;
            first.z[0] = z[0];
            first.q[0] -= t1;
            entries.add(__tfe::Block::ZZ, 0, 0, t.like(1.0));
            first.force[self.n] = -z[self.n];
            entries.add(__tfe::Block::QQ, 0, 0, t3);
            entries.add(__tfe::Block::QQ, 0, 1, k);
            entries.add(__tfe::Block::QQ, 1, 0, k);
            entries.add(__tfe::Block::ForceZ, self.n, self.n, t.like(-1.0));
            /// L_v, L_vv
            for i in 0..self.n {
                entries.add(__tfe::Block::ZZ, i + 1, i + 1, t.like(self.m[i]));
                first.z[i + 1] = t.like(self.m[i]) * z[i + 1];
            }
            /// L_q, L_qq
            for i in 0..self.w {
                /// L_qq
                let t5 = q[i + 1] - q[i + 2];
                let t6 = a * t5;
                let t7 = k - t6;
                let t8 = t6 - t7;
                let t9 = -t8;
                entries.add(__tfe::Block::QQ, i + 1, i + 2, t9);
                entries.add(__tfe::Block::QQ, i + 2, i + 1, t9);
                /// L_q
                let t10 = t7 * t5;
                first.q[i + 1] += t2 - t10;
                t2 = t10;
                entries.add(__tfe::Block::QQ, i + 1, i + 1, t4 + t8);
                t4 = t8;
            }
            first.q[self.w + 1] += t2;
            entries.add(__tfe::Block::QQ, self.w + 1, self.w + 1, t4);
        }
        fn observables<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R], values: &mut [R]) {
            let __tfe_length = 1usize.saturating_add(self.n);
            let (q, z) = (&q[..__tfe_length], &z[..__tfe_length]);
            values[0] = q[self.n] - q[1];
        }
        fn coordinate_name(&self, index: usize) -> __tfe::CoordinateName {
            if index == 0 {
                return __tfe::CoordinateName::single("s");
            }
            let index = index - 1;
            let end = self.n;
            if index < end {
                return __tfe::CoordinateName::element("q", index);
            }
            let index = index - end;
            __tfe::CoordinateName::element("", index)
        }
        const OBSERVABLES: &'static [&'static str] = &["extension"];
        fn parameters(&self) -> usize {
            self.m.len() + 1 + 1
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < self.m.len() {
                return __tfe::CoordinateName::element("m", index);
            }
            let index = index - self.m.len();
            if index == 0 {
                return __tfe::CoordinateName::single("k");
            }
            let index = index - 1;
            if index == 0 {
                return __tfe::CoordinateName::single("a");
            }
            let index = index - 1;
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < self.m.len() {
                return self.m[index];
            }
            let index = index - self.m.len();
            if index == 0 {
                return self.k;
            }
            let index = index - 1;
            if index == 0 {
                return self.a;
            }
            let index = index - 1;
            ::core::primitive::f64::NAN
        }
        fn with_parameter(
            &self,
            index: usize,
            value: f64,
        ) -> ::core::option::Option<Self> {
            let mut made = Self {
                n: self.n,
                w: self.w,
                m: ::core::clone::Clone::clone(&self.m),
                k: self.k,
                a: self.a,
            };
            if index < self.m.len() {
                made.m[index] = value;
                return ::core::option::Option::Some(made);
            }
            let index = index - self.m.len();
            if index == 0 {
                made.k = value;
                return ::core::option::Option::Some(made);
            }
            let index = index - 1;
            if index == 0 {
                made.a = value;
                return ::core::option::Option::Some(made);
            }
            let index = index - 1;
            ::core::option::Option::None
        }
        fn unnumbered<__F: ::core::ops::FnMut(u64)>(&self, values: &mut __F) {
            values(self.n as u64);
            values(self.w as u64);
            values(self.m.len() as u64);
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Family {
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
            name: "Family",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
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
                additions: 6,
                multiplications: 11,
                divisions: 1,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 7,
                multiplications: 4,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 16,
                multiplications: 4,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ s\u{307}² + Σ_{i = 0..n} ½ m[i] q\u{307}[i]² − (Σ_{i = 0..w} (½ k (q[i + 1] − q[i])² + a/3 (q[i + 1] − q[i])³)) − ½ k (q[0] − s)²\n",
                "Q(q[n − 1]) = −q\u{307}[n − 1]\n",
                "coordinates: s, q[n]      parameters: n, w, m, k, a\n",
                "operations, value: 6 +−, 11 ×, 1 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 7 +−, 4 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 16 +−, 4 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, n+1 coordinates\n",
                "depends on time         no\n", "forces                  yes\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n",
                "pattern L_vv            (0,0) (i+1,i+1)\n",
                "pattern L_vq            zero\n",
                "pattern L_qq            (0,0) (0,1) (1,0) (1,1) (i+1,i+1) (i+1,i+2) (i+2,i+1) (i+2,i+2)\n",
                "pattern Q_v             (n,n)\n", "pattern Q_q             zero"
            ),
        }
    }
    /// The observable `extension` at time `t`, coordinates `q` and velocities `v`.
    ///
    /// # Errors
    /// Vectors of another length than the model's, and lengths of the model that do not fit together.
    fn extension(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
    ) -> ::core::result::Result<f64, ::tfe::__private::FamilyError> {
        ::tfe::__private::family_observable(self, t, q, v, 0)
    }
}
