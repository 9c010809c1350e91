//! Documentation of derived models: in the documentation of the struct, and as the page of `Name::structure()`.

use proc_macro2::{Literal, TokenStream};
use quote::quote;
use std::fmt::Write as _;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, Form, names};
use tfe_symbolic::program::count::Counts;
use tfe_symbolic::program::{Program, Request, Statement};

/// Beyond this number of operations, the compile time of a kernel becomes noticeable.
const LARGE: usize = 10_000;

/// The lines that are added to the documentation of the struct.
pub(crate) fn lines(declared: &Declared, derivation: &Derivation, documented: bool) -> Vec<String> {
    // A blank line after the user's own words.
    let mut lines = if documented {
        vec![String::new()]
    } else {
        Vec::new()
    };
    lines.extend([" # Derived model".to_owned(), " ```text".to_owned()]);
    lines.extend(
        page(declared, derivation)
            .lines()
            .map(|line| format!(" {line}")),
    );
    lines.push(" ```".to_owned());
    lines
}

/// The three kernels whose costs are reported.
struct Kernels {
    value: Counts,
    first: Counts,
    second: Counts,
}

impl Kernels {
    fn of(derivation: &Derivation) -> Self {
        Self {
            value: derivation.counts(Request::VALUE),
            first: derivation.counts(Request::FIRST),
            second: derivation.counts(Request::SECOND),
        }
    }
}

/// Formulas, operation counts, structure.
fn page(declared: &Declared, derivation: &Derivation) -> String {
    let kernels = Kernels::of(derivation);
    let mut page = format!("{declared}\n");
    for (name, counts) in [
        ("value", &kernels.value),
        ("gradient", &kernels.first),
        ("gradient and second derivatives", &kernels.second),
    ] {
        let _ = writeln!(page, "operations, {name}: {}", told(counts));
    }
    let _ = write!(page, "{}", derivation.structure());
    if !declared.constraints.is_empty() {
        let constraints = declared.constraints.iter();
        let kinds: Vec<String> = constraints
            .map(|constraint| format!("{} ({})", constraint.name, constraint.kind))
            .collect();
        let _ = write!(page, "\nconstraints             {}", kinds.join(", "));
    }
    for remark in &declared.remarks {
        let _ = write!(page, "\nremark                  {remark}");
    }
    let total = kernels.second.additions + kernels.second.multiplications;
    if total > LARGE {
        let _ = write!(
            page,
            "\nlarge: {total} operations; a sum over an array of coordinates stays a loop and compiles faster"
        );
    }
    page
}

fn told(counts: &Counts) -> String {
    let Operations {
        additions,
        multiplications,
        divisions,
        sines,
        functions,
    } = operations(counts);
    format!(
        "{additions} +−, {multiplications} ×, {divisions} ÷, {sines} sin/cos, {functions} other"
    )
}

/// A line of documentation for a kernel: what it computes, and of how many operations.
pub(crate) fn kernel(formula: &str, program: &Program) -> String {
    let Operations {
        additions,
        multiplications,
        divisions,
        sines,
        functions,
    } = operations(&Counts::of(program));
    let kinds = [
        (additions, "+−"),
        (multiplications, "×"),
        (divisions, "÷"),
        (sines, "sin/cos"),
        (functions, "other"),
    ];
    let counted = kinds.into_iter().filter(|(count, _)| *count > 0);
    let counted: Vec<String> = counted
        .map(|(count, kind)| format!("{count} {kind}"))
        .collect();
    let has_loops = |statement: &Statement| matches!(statement, Statement::Loop { .. });
    match counted.is_empty() {
        true => format!(" {formula}: no operations"),
        false if program.statements.iter().any(has_loops) => {
            format!(
                " {formula}: {}; those of a loop for one turn",
                counted.join(", ")
            )
        }
        false => format!(" {formula}: {}", counted.join(", ")),
    }
}

/// The kinds of operations that are counted separately.
struct Operations {
    additions: usize,
    multiplications: usize,
    divisions: usize,
    sines: usize,
    functions: usize,
}

fn operations(counts: &Counts) -> Operations {
    Operations {
        additions: counts.additions,
        multiplications: counts.multiplications,
        divisions: counts.divisions,
        sines: counts.sine_cosine_pairs + counts.lone_sines,
        functions: counts.functions + counts.selections,
    }
}

/// The results of the kernels of a model, as formulas.
pub(crate) struct Formulas {
    pub(crate) value: String,
    /// First derivatives and forces.
    pub(crate) first: String,
    /// The same without derivatives by velocities or momenta.
    pub(crate) forces: String,
    pub(crate) mass: String,
    /// The results of the kernel of second derivatives, besides the first ones.
    pub(crate) second: String,
}

impl Formulas {
    pub(crate) fn of(declared: &Declared, derivation: &Derivation) -> Self {
        let (letter, z) = match declared.form {
            Form::Lagrangian => ('L', 'v'),
            Form::Hamiltonian => ('H', 'p'),
        };
        let forced = derivation.structure().forced;
        let first = match forced {
            true => format!("{letter}_{z}, {letter}_q and Q"),
            false => format!("{letter}_{z} and {letter}_q"),
        };
        let forces = match forced {
            true => format!("{letter}_q and Q"),
            false => format!("{letter}_q"),
        };
        let second = match forced {
            true => format!("{letter}_{z}{z}, {letter}_{z}q, {letter}_qq, Q_{z} and Q_q"),
            false => format!("{letter}_{z}{z}, {letter}_{z}q and {letter}_qq"),
        };
        Self {
            value: format!("{letter}(q, {z}, t)"),
            first,
            forces,
            mass: format!("{letter}_{z}{z}"),
            second,
        }
    }
}

/// `Facts { .. }` for the runtime.
pub(crate) fn facts(derivation: &Derivation, path: &TokenStream) -> TokenStream {
    let structure = derivation.structure();
    let (time_dependent, forced) = (structure.time_dependent, structure.forced);
    let (quadratic_in_z, constant_mass) = (structure.quadratic_in_z, structure.constant_mass);
    let (linear, separable) = (structure.linear, structure.separable);
    let smooth = structure.smooth;
    quote! {
        #path::Facts {
            time_dependent: #time_dependent,
            forced: #forced,
            quadratic_in_z: #quadratic_in_z,
            constant_mass: #constant_mass,
            linear: #linear,
            separable: #separable,
            smooth: #smooth,
        }
    }
}

/// The constant of `Model` that tells which coordinates are ignorable; nothing if none is.
pub(crate) fn ignorable(derivation: &Derivation, dof: &TokenStream) -> Option<TokenStream> {
    let structure = derivation.structure();
    let ignorable = &structure.ignorable;
    let count = usize::try_from(structure.dof.as_constant()?).ok()?;
    let flags = (0..count).map(|index| ignorable.contains(&index));
    (!ignorable.is_empty()).then(|| quote!(const IGNORABLE: [bool; #dof] = [#(#flags),*];))
}

/// The constant of `Model` that tells of a constant diagonal mass matrix of several coordinates; nothing if there is none.
pub(crate) fn diagonal_mass(derivation: &Derivation) -> Option<TokenStream> {
    let structure = derivation.structure();
    let is_diagonal = structure.constant_mass && structure.diagonal_mass;
    let is_told = is_diagonal && structure.dof.as_constant() != Some(1);
    is_told.then(|| {
        quote!(
            const DIAGONAL_MASS: bool = true;
        )
    })
}

/// All operations, each counted once.
pub(crate) fn total(counts: &Counts) -> usize {
    let all = operations(counts);
    all.additions + all.multiplications + all.divisions + all.sines + all.functions
}

/// `Structure { .. }`, the value of `Name::structure()`.
pub(crate) fn structure(
    declared: &Declared,
    derivation: &Derivation,
    path: &TokenStream,
) -> TokenStream {
    let private = quote!(#path::__private);
    let kernels = Kernels::of(derivation);
    let tokens = |counts: &Counts| {
        let Operations {
            additions,
            multiplications,
            divisions,
            sines,
            functions,
        } = operations(counts);
        let [additions, multiplications, divisions, sines, functions] =
            [additions, multiplications, divisions, sines, functions]
                .map(Literal::usize_unsuffixed);
        quote! {
            #private::Operations {
                additions: #additions,
                multiplications: #multiplications,
                divisions: #divisions,
                sines: #sines,
                functions: #functions,
            }
        }
    };
    let (value, first, second) = (
        tokens(&kernels.value),
        tokens(&kernels.first),
        tokens(&kernels.second),
    );
    let all = names(&declared.coordinates);
    let found = derivation.structure();
    let cyclic = found.cyclic.iter().filter_map(|index| all.get(*index));
    let conserved = found.conserved.iter().filter_map(|index| all.get(*index));
    let diagonal_mass = found.diagonal_mass;
    let form = match declared.form {
        Form::Lagrangian => quote!(Lagrangian),
        Form::Hamiltonian => quote!(Hamiltonian),
    };
    let facts = facts(derivation, &private);
    let (name, page) = (&declared.name, page(declared, derivation));
    // A line of code for each of the page.
    let page = page.split_inclusive('\n');
    quote! {
        #private::Structure {
            name: #name,
            form: #private::Form::#form,
            facts: #facts,
            cyclic: &[#(#cyclic),*],
            conserved: &[#(#conserved),*],
            diagonal_mass: #diagonal_mass,
            value: #value,
            first: #first,
            second: #second,
            page: ::core::concat!(#(#page),*),
        }
    }
}
