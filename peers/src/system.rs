//! The interface for equations of motion written by hand.

/// q̈ = a(q, q̇) for `N` coordinates. Peers integrate them as y = (q, q̇) with `D = 2 N` components.
pub trait System<const N: usize> {
    /// Whether a depends on q alone, as leapfrog requires.
    const SEPARABLE: bool = false;

    /// The unit of time, chosen such that coordinates and velocities are of about the same size: then one absolute
    /// tolerance fits both.
    const UNIT: f64 = 1.0;

    /// a(q, q̇) in units of time of [`UNIT`](Self::UNIT).
    fn acceleration(&self, q: &[f64; N], v: &[f64; N]) -> [f64; N];

    /// ∂a/∂q · dq + ∂a/∂q̇ · dv
    fn variation(&self, q: &[f64; N], v: &[f64; N], dq: &[f64; N], dv: &[f64; N]) -> [f64; N];

    /// The sizes that coordinates and velocities reach, in these units.
    fn sizes(&self) -> ([f64; N], [f64; N]) {
        ([1.0; N], [1.0; N])
    }
}

/// The halves of y: coordinates and velocities. `None` if y has fewer than 2 N components, which cannot happen in this
/// crate.
fn halves<const N: usize>(y: &[f64]) -> (&[f64; N], &[f64; N]) {
    const NEVER: &str = "y has 2 N components";
    let (q, v) = y.split_at(N);
    (q.try_into().expect(NEVER), v.try_into().expect(NEVER))
}

/// y' = (q̇, a)
#[inline]
pub fn rates<S: System<N>, const N: usize>(system: &S, y: &[f64], rates: &mut [f64]) {
    let (q, v) = halves::<N>(y);
    let a = system.acceleration(q, v);
    rates[..N].copy_from_slice(v);
    rates[N..].copy_from_slice(&a);
}

/// ∂y'/∂y · w
#[inline]
pub fn product<S: System<N>, const N: usize>(system: &S, y: &[f64], w: &[f64], out: &mut [f64]) {
    let ((q, v), (dq, dv)) = (halves::<N>(y), halves::<N>(w));
    let da = system.variation(q, v, dq, dv);
    out[..N].copy_from_slice(dv);
    out[N..].copy_from_slice(&da);
}
