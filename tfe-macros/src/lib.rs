//! The `#[dynamics(...)]` attribute of [`tfe`](https://docs.rs/tfe).
//!
//! A thin shell: tokens become text with a table of places (`source_map`), the engine `tfe-symbolic` derives the model, and
//! `expand` writes the resulting programs as Rust. See the documentation of `tfe` for the language.

mod balance;
mod constraint;
mod emit;
mod expand;
mod fallback;
mod family;
#[cfg(test)]
mod fuzz;
mod input;
mod page;
mod solver;
mod source_map;
mod state;
#[cfg(test)]
mod tests;
mod variant;

use proc_macro::TokenStream;

/// Declares a mechanical model on the struct that holds its parameters.
///
/// The arguments are raw tokens, separated by commas: `coordinates(...)`, `lagrangian = ...` or `hamiltonian = ...`, and as many
/// `let`, `force(...)`, `dissipation`, `constraint(...)`, `output(...)`, `solver(...)` and `model(...)` as the model needs. `sensitivity(omega, k[2])` asks for the derivatives by
/// parameters, that is by fields of type `f64` and by elements of array fields, and by the time. Everything is differentiated symbolically while
/// the crate compiles; mistakes are reported under the token that is wrong, all of them at once.
///
/// `time_transformation = g`, beside a Hamiltonian with a known number of coordinates, makes steps equal in a time τ of their own, dt = g dτ with g > 0 any expression of
/// coordinates, momenta, parameters and `t`: short steps where g is small. The time becomes the last coordinate, `t`, with a momentum `p_t` that is −H along the motion, so
/// that states have one entry more; `state(q, p)` makes such a state of the coordinates and momenta (not velocities) as declared, at t = 0, and `state_at(t, q, p)` at another time.
/// Formulas stay as they are, `t` and `dot()` in them mean the time of the model. Energies of a motion are those of the extended model, g (H + p_t), zero but for errors: an
/// `output` shows H. It does not go with `constraint` and `sensitivity`, and elements must step in phase space (`Mixed`, `Primal` reduced, `EnergyConserving`, `Radau`).
///
/// `coordinates(q[n])` with `n` a field of type `usize` declares a model of run-time length: sums stay loops, state and parameters (`Vec<f64>`) live on the heap, and the
/// code is the same for every length. `Simulation::new` runs both kinds. There, `constraint(rod[i in 0..n-1]) = ...` (of positions and the time) and `output(strain[i in 0..n-1]) = ...`
/// stand for one equation or one number for each site, and a field `left` of type `Vec<usize>` is a list of indices, `q[left[b]]`.
///
/// `model(Name, pass, pass, ...)`, any number of times, declares another model made from this one by the passes from left to right: a struct `Name` with the fields that it still
/// uses, and `Name::of(&original)`, which copies them. It has all that a model has; derives of the original below the attribute (`Clone`, `Copy`, `Debug`, `PartialEq`, `Default`),
/// outputs, and `sensitivity` by parameters that are left, are inherited; solvers are not.
///
/// * `truncated(k, q = e, dot(q) = e)`: the Taylor polynomial of degree k ≥ 2 of the Lagrangian about a point (of a Hamiltonian `truncated(k, x = e, p_x = e)`), zero where nothing is said; e
///   are formulas of parameters. Forces are taken to degree k − 1, the dissipation to degree k; outputs and the time stay as they are, and coordinates keep their meaning. With k = 2 the model is
///   linear. Not for models with constraints. Of an array without an index all elements are meant; where the number of coordinates is generic, or known at run time only, the point must be the same
///   for all.
/// * `frozen(q = e)`: coordinates that follow formulas of parameters and the time, of a Lagrangian with a known number of coordinates. They are no coordinates of the new model; forces on them drop
///   out.
/// * `routh(phi, psi)`: cyclic coordinates ignored, on which neither forces nor constraints act. Their momenta become fields `p_phi`, `p_psi`; `Name::of_state(&original, &state)` takes them from a
///   state and gives what is left of it. Their velocities become outputs `phi_rate`, `psi_rate`, of which `Motion::integral` makes the coordinates again; outputs that hold the coordinates themselves
///   are left out.
/// * `rigid(rod = k)`: the springs of stiffness k, a field of type `f64`, become constraints. The energy must be linear in k, with a square of a function of positions for its factor; where it is
///   a sum of several, the constraints are `rod_1`, `rod_2`, …. The field is none of the new model, and outputs that show it are left out.
/// * `elastic(rod = k)`: the constraint `rod` on positions φ = 0 (all equations of a vector or a range; `rod[2]` for one) becomes a spring of the energy k φ²/2, with k a new field of type `f64`, an
///   argument of `Name::of(&original, k)` and `pub` if the struct is.
///
/// Velocities `dot(x)` in forces and outputs of a Hamiltonian model mean ∂H/∂p of the Hamiltonian as declared.
///
/// The attribute keeps the struct as it is, implements the kernels that the elements of `tfe` integrate, and adds the methods
/// `state(q, v)`, `structure()` and one for each `output`.
#[proc_macro_attribute]
pub fn dynamics(arguments: TokenStream, item: TokenStream) -> TokenStream {
    expand::expand(arguments.into(), item.into()).into()
}
