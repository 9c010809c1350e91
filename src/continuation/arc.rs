//! Arc length along a branch, and the equations that fix a point on it.

use crate::assembly::{DenseMut, Iterate};
use crate::periodic::problem::{Global, Periodic};
use tfe_runtime::State;

/// The scalar product in which arc length is measured, in units of the parameter:
///
/// ```text
/// ⟨a, b⟩ = λ_a λ_b + w² [ Σ_e h_e/T Σ_k (y_k,a y_k,b / Y_k²)_e + T_a T_b / T² ]
/// ```
///
/// with w the length of the range of λ and Y_k half the range of each coordinate and momentum y_k so far: an angle
/// counts as much as a distance, whatever its origin. If the branch begins at rest there are no ranges; they are
/// therefore at least a hundredth of |∂y_k/∂λ| w. The weight h_e/T of an element makes the sum a mean over time that
/// does not depend on the mesh.
#[derive(Clone, Debug)]
pub(super) struct Metric<const N: usize> {
    /// The weight of each node; none for the last, which equals the first.
    shares: Vec<f64>,
    width: f64,
    /// The least and the largest value of each component so far.
    bounds: [State<N>; 2],
    /// The smallest scale of each component.
    least: State<N>,
    /// T, if it is an unknown.
    period: Option<f64>,
}

/// Ranges below this fraction of the largest component of their kind are rounding errors, as in a component that
/// vanishes by symmetry.
const ROUNDINGS: f64 = 1e-9;

/// The smallest range relative to the values, so that arc length keeps about ten digits whatever the origin of a
/// component.
const OFFSET: f64 = 1e-5;

impl<const N: usize> Metric<N> {
    /// Begins with the first orbit and its derivative by the parameter.
    pub(super) fn new<M>(
        orbit: &Periodic<'_, M, N>,
        width: f64,
        start: &Iterate<N>,
        derivative: &Iterate<N>,
    ) -> Self {
        let shares = (0..orbit.mesh.elements()).map(|e| orbit.mesh.share(e));
        let largest = largest(derivative);
        let mut metric = Self {
            shares: shares.chain([0.0]).collect(),
            width,
            bounds: [start.nodes[0]; 2],
            least: State {
                q: largest.q.map(|q| 1e-2 * width * q),
                p: largest.p.map(|p| 1e-2 * width * p),
            },
            period: (orbit.globals.first() == Some(&Global::Period)).then_some(orbit.period),
        };
        metric.grow(start);
        metric
    }

    /// Extends the ranges by another orbit.
    pub(super) fn grow(&mut self, iterate: &Iterate<N>) {
        let [low, high] = &mut self.bounds;
        for node in &iterate.nodes {
            for a in 0..N {
                low.q[a] = low.q[a].min(node.q[a]);
                low.p[a] = low.p[a].min(node.p[a]);
                high.q[a] = high.q[a].max(node.q[a]);
                high.p[a] = high.p[a].max(node.p[a]);
            }
        }
    }

    /// w / Y_k of all components. Not squared, since the squares may overflow or underflow.
    fn weights(&self) -> State<N> {
        let [low, high] = &self.bounds;
        let least = &self.least;
        State {
            q: weights(self.width, [&low.q, &high.q], &least.q),
            p: weights(self.width, [&low.p, &high.p], &least.p),
        }
    }

    /// The square root of the weight of the k-th of `globals` unknowns: a period, an unfolding parameter, or λ.
    fn global(&self, k: usize, globals: usize) -> f64 {
        if k + 1 == globals {
            1.0
        } else if k == 0 {
            self.period.map_or(0.0, |period| self.width / period)
        } else {
            0.0
        }
    }

    /// The linear form b ↦ ⟨a, b⟩, as coefficients of b.
    fn dual(&self, a: &Iterate<N>) -> (Vec<State<N>>, Vec<f64>) {
        let by = self.weights();
        let nodes = a.nodes.iter().zip(&self.shares);
        let nodes = nodes.map(|(state, share)| State {
            q: std::array::from_fn(|a| share * by.q[a] * (by.q[a] * state.q[a])),
            p: std::array::from_fn(|a| share * by.p[a] * (by.p[a] * state.p[a])),
        });
        let globals = a.globals.iter().enumerate().map(|(k, value)| {
            let by = self.global(k, a.globals.len());
            by * (by * value)
        });
        (nodes.collect(), globals.collect())
    }

    /// ⟨a, b⟩.
    pub(super) fn product(&self, a: &Iterate<N>, b: &Iterate<N>) -> f64 {
        let (nodes, globals) = self.dual(a);
        pair(&nodes, &globals, b)
    }

    /// Whether an orbit has shrunk to almost nothing, or is traversed in the opposite phase.
    pub(super) fn withers(&self, from: &Iterate<N>, to: &Iterate<N>) -> bool {
        /// The smallest remaining fraction; a step that leaves less leads to rest or beyond.
        const LEFT: f64 = 0.1;
        let (from, to) = (way(from), way(to));
        let whole = self.product(&from, &from);
        // With a single element there are no differences between nodes.
        whole > 0.0 && self.product(&from, &to) < LEFT * whole
    }

    /// The same product of orbits on elements of half the length, where the nodes in the middle of the elements have no
    /// weight.
    pub(super) fn on_halves(&self) -> Self {
        let shares = self.shares.iter().flat_map(|share| [*share, 0.0]);
        Self {
            shares: shares.collect(),
            ..self.clone()
        }
    }

    /// The length of an iterate relative to the range of λ: of a difference of orbits, its root mean square in half
    /// ranges of the components.
    pub(super) fn relative(&self, a: &Iterate<N>) -> f64 {
        self.product(a, a).sqrt() / self.width
    }

    /// a / √⟨a, a⟩.
    pub(super) fn unit(&self, mut a: Iterate<N>) -> Iterate<N> {
        let norm = self.product(&a, &a).sqrt();
        a.scale(1.0 / norm);
        a
    }

    /// The equation of the point at an arc length from `base`, measured along the unit vector `tangent`.
    pub(super) fn row(&self, base: &Iterate<N>, tangent: &Iterate<N>, length: f64) -> Row<N> {
        let (nodes, globals) = self.dual(tangent);
        let value = pair(&nodes, &globals, base) + length;
        Row::Arc {
            nodes,
            globals,
            value,
        }
    }
}

/// The differences between successive nodes of an orbit.
fn way<const N: usize>(iterate: &Iterate<N>) -> Iterate<N> {
    let difference = |from: &[f64; N], to: &[f64; N]| std::array::from_fn(|a| to[a] - from[a]);
    let pairs = iterate.nodes.windows(2);
    let nodes = pairs.map(|pair| State {
        q: difference(&pair[0].q, &pair[1].q),
        p: difference(&pair[0].p, &pair[1].p),
    });
    Iterate {
        nodes: nodes.collect(),
        interiors: Vec::new(),
        globals: Vec::new(),
    }
}

/// The largest magnitude of each component.
fn largest<const N: usize>(iterate: &Iterate<N>) -> State<N> {
    let largest = |value: &dyn Fn(&State<N>, usize) -> f64| {
        std::array::from_fn(|a| {
            let values = iterate.nodes.iter().map(|node| value(node, a).abs());
            values.fold(0.0_f64, f64::max)
        })
    };
    State {
        q: largest(&|node, a| node.q[a]),
        p: largest(&|node, a| node.p[a]),
    }
}

/// w divided by the half ranges of the components of one kind, which are at least `least`; zero for a component that is
/// identically zero.
fn weights<const N: usize>(width: f64, [low, high]: [&[f64; N]; 2], least: &[f64; N]) -> [f64; N] {
    let largest = low.iter().chain(high);
    let largest = largest.fold(0.0_f64, |most, value| most.max(value.abs()));
    std::array::from_fn(|a| {
        let range = 0.5 * (high[a] - low[a]);
        let own = OFFSET * low[a].abs().max(high[a].abs());
        let scale = range.max(least[a]).max(own).max(ROUNDINGS * largest);
        if scale > 0.0 { width / scale } else { 0.0 }
    })
}

fn pair<const N: usize>(nodes: &[State<N>], globals: &[f64], b: &Iterate<N>) -> f64 {
    let mut sum = 0.0;
    for (weights, state) in nodes.iter().zip(&b.nodes) {
        for a in 0..N {
            sum += weights.p[a] * state.p[a] + weights.q[a] * state.q[a];
        }
    }
    let globals = globals.iter().zip(&b.globals);
    sum + globals.map(|(weight, value)| weight * value).sum::<f64>()
}

/// The cubic interpolant of the branch between two orbits u₀ and u₁ with their tangents, in x = ⟨τ₀, u − u₀⟩ / ⟨τ₀, u₁
/// − u₀⟩ ∈ [0, 1].
pub(super) struct Between<const N: usize> {
    ends: [Iterate<N>; 2],
    /// u₁ − u₀.
    change: Iterate<N>,
    /// du/dx.
    slopes: [Iterate<N>; 2],
    /// τ₀, of unit length.
    tangent: Iterate<N>,
    length: f64,
}

impl<const N: usize> Between<N> {
    /// The interpolant between two orbits with their unit tangents.
    pub(super) fn new(
        metric: &Metric<N>,
        ends: [&Iterate<N>; 2],
        tangents: [&Iterate<N>; 2],
    ) -> Self {
        let change = ends[1].plus(-1.0, ends[0]);
        let length = metric.product(tangents[0], &change);
        let mut slopes = tangents.map(Clone::clone);
        slopes[0].scale(length);
        slopes[1].scale(length / metric.product(tangents[0], tangents[1]));
        Self {
            ends: ends.map(Clone::clone),
            change,
            slopes,
            tangent: tangents[0].clone(),
            length,
        }
    }

    /// The value of the cubic.
    pub(super) fn guess(&self, x: f64) -> Iterate<N> {
        let y = 1.0 - x;
        self.ends[0]
            .plus(x * x * (3.0 - 2.0 * x), &self.change)
            .plus(x * y * y, &self.slopes[0])
            .plus(-x * x * y, &self.slopes[1])
    }

    /// The first point at which the parameter leaves its range, and the bound; `left` returns the bound that a
    /// parameter exceeds. Behind a fold the branch may have returned through the bound at which it began.
    pub(super) fn exit(&self, left: impl Fn(f64) -> Option<f64>) -> Option<(f64, f64)> {
        /// The number of points that are examined.
        const PLACES: u32 = 64;
        let place = |k: u32| f64::from(k) / f64::from(PLACES);
        let bound_at = |x: f64| left(self.parameter(x));
        let (k, bound) = (1..=PLACES).find_map(|k| Some((k, bound_at(place(k))?)))?;
        let (mut inside, mut outside) = (place(k - 1), place(k));
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (inside + outside);
            if bound_at(middle).is_some() {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        Some((outside, bound))
    }

    /// The parameter of the cubic.
    fn parameter(&self, x: f64) -> f64 {
        let of = |iterate: &Iterate<N>| iterate.globals.last().copied().unwrap_or(f64::NAN);
        let y = 1.0 - x;
        of(&self.ends[0])
            + x * x * (3.0 - 2.0 * x) * of(&self.change)
            + x * y * (y * of(&self.slopes[0]) - x * of(&self.slopes[1]))
    }

    /// The equation of the point at x.
    pub(super) fn row(&self, metric: &Metric<N>, x: f64) -> Row<N> {
        metric.row(&self.ends[0], &self.tangent, x * self.length)
    }
}

/// The equation that fixes the point on the branch.
#[derive(Clone, Debug)]
pub(super) enum Row<const N: usize> {
    /// λ = value.
    Parameter(f64),
    /// ⟨τ, u⟩ = value, given by the coefficients of ⟨τ, ·⟩.
    Arc {
        nodes: Vec<State<N>>,
        globals: Vec<f64>,
        value: f64,
    },
}

impl<const N: usize> Row<N> {
    /// Writes the equation, linearised at an iterate.
    pub(super) fn write(&self, iterate: &Iterate<N>, dense: DenseMut<'_>) {
        dense.nodes.fill(0.0);
        dense.global.fill(0.0);
        match self {
            Self::Parameter(value) => {
                if let (Some(weight), Some(parameter)) =
                    (dense.global.last_mut(), iterate.globals.last())
                {
                    *weight = 1.0;
                    *dense.right = value - parameter;
                }
            }
            Self::Arc {
                nodes,
                globals,
                value,
            } => {
                for (weights, state) in dense.nodes.chunks_exact_mut(2 * N).zip(nodes) {
                    weights[..N].copy_from_slice(&state.p);
                    weights[N..].copy_from_slice(&state.q);
                }
                dense.global.copy_from_slice(globals);
                *dense.right = value - pair(nodes, globals, iterate);
            }
        }
    }
}
