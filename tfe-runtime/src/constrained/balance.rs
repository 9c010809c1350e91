//! The residual of an element with constraints, part by part.

use crate::basis::legendre_slopes;
use crate::constrained::constrains::Constrains;
use crate::constrained::element::{Declared, Derivatives, ElementConstraints, End, Output, Place};
use crate::equations::weighted;
use crate::velocity_form::{PointDerivatives, PointTangent};

impl<const N: usize> ElementConstraints<'_, N> {
    /// Adds the reactions at a point to its momentum and force, and the contributions of the point to the residual and,
    /// on request, to the derivatives.
    pub(super) fn add_at(
        &mut self,
        model: &dyn Constrains<N>,
        place: &Place<N>,
        x: &[f64],
        point: &mut PointDerivatives<N>,
        output: &mut Output<'_>,
    ) {
        let (declared, l) = (model.declared(), place.l);
        let slopes = legendre_slopes(self.scheme.nodes[l], self.layout.degree());
        self.rows.evaluate(model, place.t, &place.q);
        match &mut output.derivatives {
            None => self.add_reactions(model, place, (x, &slopes[..]), point, None),
            Some(Derivatives { tangent, by_start }) => {
                let mut by = PointTangent::of(self.span.h, &point.second);
                self.add_reactions(model, place, (x, &slopes[..]), point, Some(&mut by));
                self.add_element(l, &by, tangent);
                self.add_point(declared, l, &slopes, tangent);
                if !by_start.is_empty() {
                    self.add_start(declared, l, &by, &slopes, by_start);
                }
            }
        }
        self.add_balance(declared, place, &slopes, &point.p, output.residual);
    }

    /// Adds the reactions at a point to its momentum and force, and to their derivatives if they are given.
    fn add_reactions(
        &mut self,
        model: &dyn Constrains<N>,
        place: &Place<N>,
        (x, slopes): (&[f64], &[f64]),
        point: &mut PointDerivatives<N>,
        mut by: Option<&mut PointTangent<N>>,
    ) {
        let (declared, l, h) = (model.declared(), place.l, self.span.h);
        if self.on_velocities {
            self.set_mu(declared, l, x, slopes, false);
            let bend = self.rows.differentiate(model, place.t, &place.q, &place.v);
            let momentum = transposed(self.rows.rows, self.rows.mu);
            let force = transposed(self.rows.rates, self.rows.mu);
            for a in 0..N {
                point.p[a] += momentum[a];
                point.force[a] += force[a];
            }
            if let Some(by) = &mut by {
                for a in 0..N {
                    for b in 0..N {
                        by.momentum_q[a][b] += h * bend.bend[a][b];
                        by.force_q[a][b] += h * bend.rate_q[a][b];
                        by.force_v[a][b] += bend.rate_v[a][b];
                    }
                }
            }
        }
        if self.on_positions {
            self.set_mu(declared, l, x, slopes, true);
            let force = transposed(self.rows.rows, self.rows.mu);
            for a in 0..N {
                point.force[a] -= force[a];
            }
            if let Some(by) = by {
                let bend = self.rows.differentiate(model, place.t, &place.q, &place.v);
                for a in 0..N {
                    for b in 0..N {
                        by.force_q[a][b] -= h * bend.bend[a][b];
                    }
                }
            }
        }
    }

    /// Adds the momentum at a point to the rows of momenta, and the constraints there to their own.
    fn add_balance(
        &self,
        declared: Declared,
        place: &Place<N>,
        slopes: &[f64],
        momentum: &[f64; N],
        residual: &mut [f64],
    ) {
        let (scheme, layout, l) = (&self.scheme, &self.layout, place.l);
        let points = scheme.points();
        for i in 0..scheme.unknowns() {
            let weight = scheme.momentum[i * points + l];
            for a in 0..N {
                residual[i * N + a] += weight * momentum[a];
            }
        }
        for (c, holonomic) in self.active(declared) {
            if holonomic {
                for j in 1..layout.degree() {
                    residual[layout.inside(j, c)] +=
                        scheme.weights[l] * slopes[j] * self.rows.values[c] / self.span.h;
                }
            } else {
                residual[layout.inside(l, c)] = self.rows.psi(c, &place.v);
            }
        }
    }

    /// Adds the contributions of both nodes, of impulses and of the forces at the points, and the equations of
    /// constraints that are not in use.
    pub(super) fn add_nodes(
        &mut self,
        model: &dyn Constrains<N>,
        forces: &[[f64; N]],
        x: &[f64],
        end: &End<N>,
        output: &mut Output<'_>,
    ) {
        let kick = self.add_start_node(model, forces, x, output);
        self.add_end_node(model, (forces, &kick), x, end, output);
        self.hold_dependent(x, output);
    }

    /// Subtracts all impulses from the rows of momenta; returns that of the multipliers at the start.
    fn add_start_node(
        &mut self,
        model: &dyn Constrains<N>,
        forces: &[[f64; N]],
        x: &[f64],
        output: &mut Output<'_>,
    ) -> [f64; N] {
        let rows = output.residual[..self.layout.rates()]
            .as_chunks_mut::<N>()
            .0;
        self.span.subtract_impulse(&self.scheme, forces, rows);
        self.set_node_mu(model.declared(), x, true);
        let kick = transposed(self.rows.start, self.rows.mu);
        for row in rows {
            for a in 0..N {
                row[a] -= kick[a];
            }
        }
        if let Some(Derivatives { by_start, .. }) = &mut output.derivatives
            && !by_start.is_empty()
        {
            self.add_kick_by_start(model, by_start);
        }
        kick
    }

    /// Adds the derivative of the impulse of the multipliers at the start by the coordinates there.
    fn add_kick_by_start(&mut self, model: &dyn Constrains<N>, by_start: &mut [f64]) {
        let (layout, unknowns) = (self.layout, self.scheme.unknowns());
        let (t, q) = (self.span.t, &self.span.start.q);
        let bend = self.rows.differentiate(model, t, q, &[0.0; N]);
        for row in (0..unknowns * N).chain(layout.end(0)..layout.node(0)) {
            let a = if row < layout.rates() {
                row % N
            } else {
                row - layout.end(0)
            };
            for b in 0..N {
                by_start[row * N + b] -= bend.bend[a][b];
            }
        }
    }

    /// Sets the rows of the end, where `kick` is the impulse of the multipliers at the start.
    fn add_end_node(
        &mut self,
        model: &dyn Constrains<N>,
        (forces, kick): (&[[f64; N]], &[f64; N]),
        x: &[f64],
        end: &End<N>,
        output: &mut Output<'_>,
    ) {
        let (declared, layout) = (model.declared(), self.layout);
        let (scheme, span, h) = (self.scheme, self.span, self.span.h);
        self.rows.evaluate(model, end.t, &end.q);
        self.set_node_mu(declared, x, false);
        let reaction = transposed(self.rows.rows, self.rows.mu);
        let force = weighted(scheme.weights, scheme.weights_low, forces);
        for a in 0..N {
            let impulse = h * force[a] + (span.low.p[a] + self.impulse[a] + kick[a]);
            output.residual[layout.end(a)] = (end.p[a] - span.start.p[a]) + (reaction[a] - impulse);
        }
        for (c, holonomic) in self.active(declared) {
            output.residual[layout.node(c)] = self.rows.psi(c, &end.v);
            if holonomic {
                output.residual[layout.inside(0, c)] = self.rows.values[c] / h;
            }
        }
        if let Some(Derivatives { tangent, by_start }) = &mut output.derivatives {
            let bend = self.rows.differentiate(model, end.t, &end.q, &end.v);
            self.add_ends(declared, end, &bend, tangent);
            if !by_start.is_empty() {
                self.add_end_by_start(declared, end, &bend, by_start);
            }
        }
    }
}

/// Σ rows_c μ_c
fn transposed<const N: usize>(rows: &[[f64; N]], mu: &[f64]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (row, mu) in rows.iter().zip(mu) {
        if *mu != 0.0 {
            for a in 0..N {
                sum[a] += row[a] * mu;
            }
        }
    }
    sum
}
