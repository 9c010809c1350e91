//! The tangent of an element with constraints, part by part.

use crate::constrained::element::{Declared, ElementConstraints, End};
use crate::constrained::rows::Bend;
use crate::velocity_form::{PointTangent, add_row};

impl<const N: usize> ElementConstraints<'_, N> {
    /// Adds the multiplier columns and the rows of constraints at a point.
    pub(super) fn add_point(
        &self,
        declared: Declared,
        l: usize,
        slopes: &[f64],
        tangent: &mut [f64],
    ) {
        let (scheme, h, size) = (&self.scheme, self.span.h, self.layout.size());
        let (points, unknowns) = (scheme.points(), scheme.unknowns());
        let (weight, position) = (
            scheme.weights[l],
            &scheme.position[l * unknowns..][..unknowns],
        );
        for (c, holonomic) in self.active(declared) {
            let (row, rate) = (&self.rows.rows[c], &self.rows.rates[c]);
            if holonomic {
                for j in 1..self.layout.degree() {
                    let at = self.layout.inside(j, c);
                    for a in 0..N {
                        let force = h * slopes[j] * row[a];
                        for i in 0..unknowns {
                            tangent[(i * N + a) * size + at] +=
                                scheme.force[i * points + l] * force;
                        }
                        tangent[self.layout.end(a) * size + at] += weight * force;
                        for (u, position) in position.iter().enumerate() {
                            tangent[at * size + u * N + a] +=
                                weight * slopes[j] * position * row[a];
                        }
                    }
                }
            } else {
                let at = self.layout.inside(l, c);
                for a in 0..N {
                    tangent[(l * N + a) * size + at] += h * row[a];
                    for i in 0..unknowns {
                        let factor = h * h * scheme.force[i * points + l];
                        tangent[(i * N + a) * size + at] -= factor * rate[a];
                    }
                    tangent[self.layout.end(a) * size + at] -= h * h * weight * rate[a];
                    for (u, position) in position.iter().enumerate() {
                        tangent[at * size + u * N + a] += h * position * self.rows.psi_q[c][a];
                    }
                    tangent[at * size + l * N + a] += row[a];
                }
            }
        }
    }

    /// Adds the contributions of start and end to the tangent; the rows are those of the end.
    pub(super) fn add_ends(
        &self,
        declared: Declared,
        end: &End<N>,
        bend: &Bend<N>,
        tangent: &mut [f64],
    ) {
        let (scheme, h, size) = (&self.scheme, self.span.h, self.layout.size());
        let layout = &self.layout;
        for a in 0..N {
            let row = &mut tangent[layout.end(a) * size..][..size];
            for b in 0..N {
                row[layout.end(b)] += end.second.zz[a][b];
                let by_q = h * (end.second.zq[a][b] + bend.bend[a][b]);
                for (u, advance) in scheme.advance.iter().enumerate() {
                    row[u * N + b] += advance * by_q;
                }
            }
        }
        for (c, holonomic) in self.active(declared) {
            let (start, row) = (&self.rows.start[c], &self.rows.rows[c]);
            let node = layout.node(c);
            let (first, sign) = if holonomic {
                (layout.inside(0, c), 1.0)
            } else {
                (node, -1.0)
            };
            for a in 0..N {
                for i in 0..scheme.unknowns() {
                    tangent[(i * N + a) * size + first] += sign * h * start[a];
                }
                let end_row = layout.end(a) * size;
                tangent[end_row + first] += sign * h * start[a];
                tangent[end_row + node] += sign * h * row[a];
                tangent[node * size + layout.end(a)] += row[a];
                for (u, advance) in scheme.advance.iter().enumerate() {
                    let column = u * N + a;
                    tangent[node * size + column] += h * advance * self.rows.psi_q[c][a];
                    if holonomic {
                        tangent[first * size + column] += advance * row[a];
                    }
                }
            }
        }
    }

    /// Adds the contributions of momentum and force at a point to the tangent.
    pub(super) fn add_element(&self, l: usize, by: &PointTangent<N>, tangent: &mut [f64]) {
        let (scheme, h, size) = (&self.scheme, self.span.h, self.layout.size());
        let (points, rates) = (scheme.points(), self.layout.rates());
        for (i, rows) in tangent[..rates * size]
            .chunks_exact_mut(N * size)
            .enumerate()
        {
            let momentum = scheme.momentum[i * points + l];
            let force = -h * scheme.force[i * points + l];
            for (a, row) in rows.chunks_exact_mut(size).enumerate() {
                add_row(scheme, l, by, a, momentum, force, &mut row[..rates]);
            }
        }
        for a in 0..N {
            let row = &mut tangent[self.layout.end(a) * size..][..rates];
            add_row(scheme, l, by, a, 0.0, -h * scheme.weights[l], row);
        }
    }

    /// Adds the contributions of a point to the derivative by the coordinates at the start.
    pub(super) fn add_start(
        &self,
        declared: Declared,
        l: usize,
        by: &PointTangent<N>,
        slopes: &[f64],
        by_start: &mut [f64],
    ) {
        let (scheme, h) = (&self.scheme, self.span.h);
        let (points, weight) = (scheme.points(), scheme.weights[l]);
        for a in 0..N {
            for i in 0..scheme.unknowns() {
                let momentum = scheme.momentum[i * points + l] / h;
                let force = scheme.force[i * points + l];
                let row = &mut by_start[(i * N + a) * N..][..N];
                for b in 0..N {
                    row[b] += momentum * by.momentum_q[a][b] - force * by.force_q[a][b];
                }
            }
            let row = &mut by_start[self.layout.end(a) * N..][..N];
            for b in 0..N {
                row[b] -= weight * by.force_q[a][b];
            }
        }
        for (c, holonomic) in self.active(declared) {
            for b in 0..N {
                if holonomic {
                    for j in 1..self.layout.degree() {
                        by_start[self.layout.inside(j, c) * N + b] +=
                            weight * slopes[j] * self.rows.rows[c][b] / h;
                    }
                } else {
                    by_start[self.layout.inside(l, c) * N + b] = self.rows.psi_q[c][b];
                }
            }
        }
    }

    /// Adds the contributions of the end to the derivative by the coordinates at the start.
    pub(super) fn add_end_by_start(
        &self,
        declared: Declared,
        end: &End<N>,
        bend: &Bend<N>,
        by_start: &mut [f64],
    ) {
        let layout = &self.layout;
        for b in 0..N {
            for a in 0..N {
                by_start[layout.end(a) * N + b] += end.second.zq[a][b] + bend.bend[a][b];
            }
            for (c, holonomic) in self.active(declared) {
                by_start[layout.node(c) * N + b] = self.rows.psi_q[c][b];
                if holonomic {
                    by_start[layout.inside(0, c) * N + b] = self.rows.rows[c][b] / self.span.h;
                }
            }
        }
    }
}
