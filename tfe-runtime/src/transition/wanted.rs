//! The results that can be computed from the linear system of an element, each as a type, so that results that are not
//! requested are not compiled.

#[cfg(feature = "alloc")]
use crate::backwards::Backwards;
use crate::condense::{
    Direction, EndForces, System, phase_ends, phase_weights, velocity_ends, velocity_weights,
};
use crate::constrained::element::ConstrainedForm;
use crate::constrained::linearise;
use crate::error::StepError;
#[cfg(feature = "alloc")]
use crate::inside::{Columns, InsideLoss, Seeds};
use crate::model::Model;
use crate::phase_form::PhaseForm;
use crate::velocity_form::VelocityForm;
#[cfg(feature = "alloc")]
use alloc::{vec, vec::Vec};

/// A result computed from the system of an element, in each of its forms.
pub(super) trait Wanted<const N: usize>: Sized {
    /// For an element with constraints, whose system is not set up yet.
    fn of_constrained<M: Model<N>>(
        self,
        form: &mut ConstrainedForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError>;

    /// For an element in phase space.
    fn of_phase<M: Model<N>>(
        self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError>;

    /// For an element in velocity form; `forces` are the derivatives of the momentum at the end.
    fn of_velocities<M: Model<N>>(
        self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        given: (&[Direction], &EndForces<'_, N>),
        system: System<'_>,
    ) -> Result<(), StepError>;

    /// Whether the result could be computed by iteration, without the system.
    fn by_iteration<M: Model<N>>(
        &mut self,
        _equations: &mut VelocityForm<'_, M, N>,
        _x: &[f64],
    ) -> Result<bool, StepError> {
        Ok(false)
    }
}

/// The derivatives of the end, row by row, with the columns of the right-hand sides.
pub(super) struct Matrix<'a> {
    pub(super) ends: &'a mut [f64],
}

impl Matrix<'_> {
    fn write_phase<'s, M: Model<N>, const N: usize>(
        self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'s>,
    ) -> Result<&'s [f64], StepError> {
        let sides = &*system.solve()?.sides;
        let (scheme, h) = (&equations.scheme, equations.span.h);
        phase_ends::<N>(scheme, h, x, directions, sides, self.ends);
        Ok(sides)
    }

    fn write_velocities<'s, M: Model<N>, const N: usize>(
        self,
        equations: &VelocityForm<'_, M, N>,
        x: &[f64],
        (directions, forces): (&[Direction], &EndForces<'_, N>),
        system: System<'s>,
    ) -> Result<&'s [f64], StepError> {
        let sides = &*system.solve()?.sides;
        let (scheme, h) = (&equations.scheme, equations.span.h);
        velocity_ends(scheme, h, x, directions, forces, sides, self.ends);
        Ok(sides)
    }
}

impl<const N: usize> Wanted<N> for Matrix<'_> {
    fn of_constrained<M: Model<N>>(
        self,
        form: &mut ConstrainedForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        linearise(form, x, directions, false, system, self.ends)?;
        Ok(())
    }

    fn of_phase<M: Model<N>>(
        self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        self.write_phase(equations, x, directions, system)?;
        Ok(())
    }

    fn of_velocities<M: Model<N>>(
        self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        given: (&[Direction], &EndForces<'_, N>),
        system: System<'_>,
    ) -> Result<(), StepError> {
        self.write_velocities(equations, x, given, system)?;
        Ok(())
    }
}

/// The same, with the derivatives of the polynomials of the element.
#[cfg(feature = "alloc")]
pub(super) struct MatrixInside<'a> {
    pub(super) ends: &'a mut [f64],
    pub(super) inside: &'a mut Vec<f64>,
}

#[cfg(feature = "alloc")]
impl<const N: usize> Wanted<N> for MatrixInside<'_> {
    fn of_constrained<M: Model<N>>(
        self,
        form: &mut ConstrainedForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        let sides = linearise(form, x, directions, false, system, self.ends)?;
        let columns = Columns {
            scheme: form.inner.scheme,
            h: form.inner.span.h,
            directions,
            sides,
        };
        *self.inside = columns.of_constrained(&mut form.inner, x, self.ends)?;
        Ok(())
    }

    fn of_phase<M: Model<N>>(
        self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        let matrix = Matrix { ends: self.ends };
        let sides = matrix.write_phase(equations, x, directions, system)?;
        let columns: Columns<'_, N> = Columns {
            scheme: equations.scheme,
            h: equations.span.h,
            directions,
            sides,
        };
        *self.inside = columns.of_phase(x);
        Ok(())
    }

    fn of_velocities<M: Model<N>>(
        self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        given: (&[Direction], &EndForces<'_, N>),
        system: System<'_>,
    ) -> Result<(), StepError> {
        let matrix = Matrix { ends: self.ends };
        let sides = matrix.write_velocities(equations, x, given, system)?;
        let columns = Columns {
            scheme: equations.scheme,
            h: equations.span.h,
            directions: given.0,
            sides,
        };
        *self.inside = columns.of_velocities(equations, x)?;
        Ok(())
    }
}

/// The product of a row λ with these derivatives: that for the columns of the start replaces λ, those for the
/// directions are added to sums.
pub(super) struct Product<'a, const N: usize> {
    /// λ
    pub(super) lambda: &'a mut [f64],
    pub(super) by_direction: &'a mut [f64],
    /// Derivatives by all parameters at once, which are not directions then.
    #[cfg(feature = "alloc")]
    pub(super) at_once: Option<&'a mut Backwards<N>>,
    /// The derivatives of a loss by the inside of the element, if it depends on that.
    #[cfg(feature = "alloc")]
    pub(super) inside: Option<&'a InsideLoss>,
}

impl<const N: usize> Wanted<N> for Product<'_, N> {
    #[cfg(feature = "alloc")]
    fn of_constrained<M: Model<N>>(
        self,
        form: &mut ConstrainedForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        let columns = 2 * N + directions.len();
        let mut ends = vec![0.0; 2 * N * columns];
        let sides = linearise(form, x, directions, false, system, &mut ends)?;
        let Self {
            lambda,
            by_direction,
            inside,
            ..
        } = self;
        let weights = lambda.to_vec();
        lambda.fill(0.0);
        let mut add = |weights: &[f64], rows: &[f64]| {
            for (weight, row) in weights.iter().zip(rows.chunks_exact(columns)) {
                let sums = lambda.iter_mut().chain(by_direction.iter_mut());
                for (sum, entry) in sums.zip(row) {
                    *sum += weight * entry;
                }
            }
        };
        add(&weights, &ends);
        if let Some(inside) = inside {
            let own = Columns {
                scheme: form.inner.scheme,
                h: form.inner.span.h,
                directions,
                sides,
            };
            let rows = own.of_constrained(&mut form.inner, x, &ends)?;
            add(&inside.coefficients, &rows);
        }
        Ok(())
    }

    #[cfg(not(feature = "alloc"))]
    fn of_constrained<M: Model<N>>(
        self,
        _: &mut ConstrainedForm<'_, M, N>,
        _: &[f64],
        _: &[Direction],
        _: System<'_>,
    ) -> Result<(), StepError> {
        // Gradients are only computed where there is an allocator.
        Err(StepError::NonFinite)
    }

    fn of_phase<M: Model<N>>(
        self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        system: System<'_>,
    ) -> Result<(), StepError> {
        let (scheme, h) = (&equations.scheme, equations.span.h);
        let (lambda, by_direction) = (self.lambda, self.by_direction);
        let sums = (&*lambda, &mut *by_direction, &mut *system.residual);
        phase_weights::<N>(scheme, h, x, directions, sums);
        #[cfg(feature = "alloc")]
        {
            let seeds = Seeds::of(self.inside, scheme, h);
            seeds.add_to_phase(x, (directions, h), by_direction, system.residual);
        }
        let _mu = system.product(lambda, by_direction)?;
        #[cfg(feature = "alloc")]
        if let Some(backwards) = self.at_once {
            backwards.of_phase(equations, x, _mu);
        }
        Ok(())
    }

    fn of_velocities<M: Model<N>>(
        self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        (directions, forces): (&[Direction], &EndForces<'_, N>),
        system: System<'_>,
    ) -> Result<(), StepError> {
        let (scheme, h) = (equations.scheme, equations.span.h);
        let (lambda, by_direction) = (self.lambda, self.by_direction);
        let mut _of_p = [0.0; N];
        _of_p.copy_from_slice(&lambda[..N]);
        let sums = (&mut *lambda, &mut *by_direction, &mut *system.residual);
        velocity_weights(&scheme, h, x, (directions, forces), sums);
        #[cfg(feature = "alloc")]
        let seeds = Seeds::of(self.inside, &scheme, h);
        #[cfg(feature = "alloc")]
        {
            let sums = (&mut *lambda, &mut *by_direction, &mut *system.residual);
            seeds.add_to_velocities(equations, x, directions, sums)?;
        }
        let _mu = system.product(lambda, by_direction)?;
        #[cfg(feature = "alloc")]
        if let Some(backwards) = self.at_once {
            let sums = (&_of_p, _mu);
            backwards.of_velocities(equations, x, sums, &seeds.forces)?;
        }
        Ok(())
    }

    #[cfg(feature = "alloc")]
    fn by_iteration<M: Model<N>>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
    ) -> Result<bool, StepError> {
        match &mut self.at_once {
            Some(backwards) => backwards.try_iteration(equations, x, (self.inside, self.lambda)),
            None => Ok(false),
        }
    }
}
