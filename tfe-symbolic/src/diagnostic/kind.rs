//! The kinds of mistake.

use crate::diagnostic::role::Role;
use crate::expr::function::Function;

/// Declares [`Kind`] together with the list of its variants' names.
macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident $({ $($(#[$field_doc:meta])* $field:ident: $type:ty),* $(,)? })?,)*) => {
        /// What is wrong.
        #[derive(Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum Kind {
            $($(#[$doc])* $name $({ $($(#[$field_doc])* $field: $type),* })?,)*
        }

        impl Kind {
            /// The names of all kinds, so that a test can ask for a case of each.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),*];

            /// The name of this kind.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$name { .. } => stringify!($name),)*
                }
            }
        }
    };
}

kinds! {
    // ---- syntax ----
    /// The text stops making sense.
    Expected {
        /// What could have stood there, in words.
        wanted: String,
        /// What stands there.
        found: String,
        /// How the argument is written, if the mistake follows its word.
        form: Option<&'static str>,
    },
    /// An argument that follows another one without a comma, or behind a semicolon.
    MissingComma {
        /// What stands there: the first word of the argument, or the semicolon.
        found: String,
    },
    /// `2x`, `2(x)`, `x y`
    MissingOperator {
        /// What stands left of the gap.
        left: String,
        /// What stands right of it.
        right: String,
    },
    /// `1.0_f64`
    NumberWithType {
        /// The number without its type.
        number: String,
    },
    /// `0x1F`
    NumberInBase {
        /// The number as written.
        number: String,
        /// The same number to the base ten, if it is below 2^64.
        decimal: Option<u64>,
    },
    /// `**`
    DoubleStar,
    /// `a..=b`
    InclusiveRange,
    /// `if a < b { x } else { y }`
    Condition {
        /// `if` or `match`.
        word: &'static str,
    },
    /// `a = b` inside a formula.
    EqualsSign {
        /// What stands left of it, where the formula is that of a constraint.
        left: Option<String>,
        /// What stands right of it.
        right: String,
    },
    /// `link.m`
    FieldAccess {
        /// What stands left of the point.
        object: String,
        /// The name right of it.
        field: String,
    },
    /// `x.sin()`
    MethodCall {
        /// What stands left of the point.
        object: String,
        /// The name right of it.
        method: String,
    },
    /// `std::f64::consts::PI`
    Path {
        /// The path without blanks.
        path: String,
    },
    /// `|x| x^2`, or `|x|` for an absolute value.
    Bars,
    /// Too many brackets, powers or signs inside each other.
    NestedTooDeep {
        /// The deepest nesting that is read.
        limit: usize,
    },
    /// One expression with too many operators in a row.
    TooLong {
        /// How many are read.
        limit: usize,
    },
    /// A number beyond the largest `f64`, or an integer beyond `i64` where an integer is needed.
    NumberTooLarge {
        /// The number as written.
        number: String,
    },
    /// A number other than zero that is below all positive `f64`.
    NumberTooSmall {
        /// The number as written.
        number: String,
    },
    /// `lagrange = …`
    UnknownArgument {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    // ---- declarations ----
    /// No `coordinates(...)`, or an empty one.
    NoCoordinates,
    /// An argument that can be given once is given again.
    RepeatedArgument {
        /// `lagrangian`, `dissipation`, …
        argument: &'static str,
    },
    /// A name declared twice.
    NameClash {
        /// The name.
        name: String,
        /// What it names already.
        taken: Role,
    },
    /// A name of the language.
    ReservedName {
        /// The name.
        name: String,
        /// The field that has it, if it is a field.
        field: bool,
    },
    /// A name that begins like those of the generated code.
    ReservedPrefix {
        /// The name.
        name: String,
        /// The field that has it, if it is a field.
        field: bool,
    },
    /// A keyword that no item of Rust can have as its name: `crate`, `self`, `super`, `Self`, `_`.
    Keyword {
        /// The keyword.
        name: String,
    },
    /// `q[0]`
    ZeroLength {
        /// The array.
        name: String,
        /// Whether it is a field.
        field: bool,
    },
    /// `q[M]` where the struct has no `M`.
    UnknownLength {
        /// The length.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// `q[N + 1]`
    LengthNotSimple,
    /// A coordinate array larger than the engine's indices.
    TooManyCoordinates {
        /// How many are allowed.
        limit: usize,
    },
    /// `q[N]` beside other coordinates, `N` a const parameter.
    FamilyNotAlone {
        /// The array.
        name: String,
    },
    /// `q[n]` with `n` a field, beside an argument that needs the number of coordinates.
    RunTimeLength {
        /// The argument.
        argument: &'static str,
    },
    /// A constraint in which velocities stand other than linearly.
    ConstraintNotAffine {
        /// The constraint.
        name: String,
    },
    /// A constraint that holds neither coordinates nor velocities.
    ConstraintWithoutCoordinate {
        /// The constraint.
        name: String,
    },
    /// A constraint that says what another one says.
    RepeatedConstraint {
        /// The constraint.
        name: String,
        /// The one before it.
        other: String,
    },
    /// A momentum in a constraint.
    MomentumInConstraint,
    /// A velocity in a constraint of a model of run-time length.
    VelocityConstraintOfFamily {
        /// The constraint.
        name: String,
    },
    /// `constraint(rod[i in 0..n])`
    ConstraintRange {
        /// The range as written.
        range: String,
    },
    /// A family of constraints over a very long range.
    TooManyConstraints {
        /// How many are allowed.
        limit: usize,
    },
    /// A sum in a constraint that cannot be written out.
    SumInConstraint {
        /// The constraint.
        name: String,
        /// The longest sum that is written out.
        limit: usize,
    },
    /// `sum(j in 0..left[k], …)`
    ListInRange {
        /// The list.
        list: String,
    },
    /// `output(x[i in a..b])`
    OutputFamily,
    /// Neither a Lagrangian nor a Hamiltonian.
    NoEnergy,
    /// A Lagrangian and a Hamiltonian.
    TwoEnergies,
    /// A Hamiltonian without momenta.
    NoMomenta,
    /// Momenta beside a Lagrangian.
    MomentaWithLagrangian,
    /// The momenta do not match the coordinates.
    MomentaMismatch {
        /// The coordinates as declared.
        coordinates: String,
        /// The momenta as declared.
        momenta: String,
    },
    /// A force on something that is no coordinate.
    ForceTarget {
        /// What it acts on.
        target: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// A coordinate that the energy does not know.
    UnusedCoordinate {
        /// The coordinate.
        name: String,
        /// `Lagrangian` or `Hamiltonian`.
        energy: &'static str,
    },
    /// A field that no expression uses.
    UnusedField {
        /// The field.
        name: String,
    },
    /// A coordinate whose velocity is not in the Lagrangian.
    NoVelocity {
        /// The coordinate.
        name: String,
    },
    /// A coordinate whose momentum ∂L/∂v holds no velocity.
    LinearVelocity {
        /// The coordinate.
        name: String,
    },
    /// An energy without coordinates, velocities and momenta.
    ConstantEnergy {
        /// `Lagrangian` or `Hamiltonian`.
        energy: &'static str,
    },
    /// A Rayleigh function that does not depend on velocities.
    DissipationWithoutVelocity,
    /// A Rayleigh function whose derivatives by velocities do not depend on any.
    LinearDissipation,
    /// `sensitivity()`
    NoSensitivity,
    /// `input()`
    NoInput,
    /// More inputs than a model can have.
    TooManyInputs {
        /// The most there can be.
        limit: usize,
    },
    /// An input beside an argument that has to know all that a model depends on.
    InputWith {
        /// The argument.
        argument: &'static str,
    },
    /// An input that no formula uses.
    UnusedInput {
        /// Its name.
        name: String,
    },
    /// `dot(u)` of an input.
    RateOfInput {
        /// Its name.
        name: String,
    },
    /// An input in a constraint.
    InputOfConstraint {
        /// Its name.
        name: String,
        /// The constraint.
        constraint: String,
    },
    /// A name in `sensitivity(...)` that nothing declares.
    UnknownParameter {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// Something in `sensitivity(...)` that is no parameter.
    NotAParameter {
        /// What is named.
        target: String,
        /// What it is, if it is a name.
        role: Option<Role>,
    },
    /// An array in `sensitivity(...)` without an index.
    ArrayOfParameters {
        /// The array.
        name: String,
    },
    /// `sensitivity(k[n])`
    IndexNotLiteral {
        /// The array.
        array: String,
        /// The index as written.
        index: String,
    },
    /// A parameter that `sensitivity(...)` names twice.
    RepeatedParameter {
        /// The parameter.
        name: String,
    },
    /// A parameter in `sensitivity(...)` that a constraint holds.
    ParameterOfConstraint {
        /// The parameter.
        name: String,
        /// The constraint.
        constraint: String,
    },
    /// A time transformation beside a Lagrangian.
    TransformationOfLagrangian,
    /// A time transformation of a model whose number of coordinates is not known here.
    TransformationOfFamily {
        /// The length.
        length: String,
    },
    /// A time transformation beside an argument that does not go with it.
    TransformationWith {
        /// `constraint` or `sensitivity`.
        argument: &'static str,
    },
    /// `time_transformation = -1`
    TransformationNotPositive,
    /// Forces beside a time transformation, where velocities cannot be written out.
    PowerOfLoop {
        /// The longest sum that is written out.
        limit: usize,
    },
    // ---- models made from models ----
    /// `model(Name)`
    NoPass {
        /// The name of the model.
        name: String,
    },
    /// `model(Name, linearised(2))`
    UnknownPass {
        /// The word.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// Something between the parentheses of a pass that does not belong there, or nothing where something does.
    PassEntry {
        /// The pass.
        pass: &'static str,
    },
    /// A degree that is no integer of the range allowed.
    TruncationDegree {
        /// The largest.
        limit: u32,
    },
    /// A coordinate or momentum, in an entry of a pass, that the model does not have.
    UnknownCoordinate {
        /// What is named.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// An element beyond an array of coordinates, or an index where there is no array.
    NoSuchElement {
        /// The element.
        name: String,
    },
    /// A pass that says twice what becomes of a coordinate.
    RepeatedEntry {
        /// What is named.
        name: String,
    },
    /// A value that varies with more than it may.
    PassValue {
        /// The pass.
        pass: &'static str,
    },
    /// A pass that needs sums written out, where they cannot be.
    PassOfLength {
        /// The pass.
        pass: &'static str,
    },
    /// A truncation of a model with constraints.
    TruncationOfConstraints,
    /// An energy without derivatives at the point of a truncation.
    NoTaylorPolynomial,
    /// A truncation whose derivatives become too long.
    LongTaylorPolynomial {
        /// The first degree that is too long.
        degree: u32,
    },
    /// A frozen coordinate of a Hamiltonian.
    FrozenHamiltonian,
    /// A coordinate to be ignored that formulas hold.
    NotCyclic {
        /// The coordinate.
        name: String,
    },
    /// One on which a constraint acts.
    CyclicConstrained {
        /// The coordinate.
        name: String,
    },
    /// One on which a force acts, so that its momentum is no constant.
    CyclicForced {
        /// The coordinate.
        name: String,
    },
    /// One in whose velocity the Lagrangian is not quadratic.
    CyclicNotQuadratic {
        /// The coordinate.
        name: String,
    },
    /// A name that is needed for the momentum or the velocity of an ignored coordinate, and taken.
    RouthName {
        /// The name.
        name: String,
        /// The coordinate.
        coordinate: String,
    },
    /// A field whose energy is no square of a function of positions.
    NotASpring {
        /// The field.
        field: String,
        /// What is found instead.
        found: String,
    },
    /// A constraint, in an entry of a pass, that the model does not have.
    UnknownConstraint {
        /// What is named.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// A constraint on velocities that should become a spring.
    ElasticVelocity {
        /// The constraint.
        name: String,
    },
    /// No coordinate is left.
    NothingLeft {
        /// The pass.
        pass: &'static str,
    },
    /// A constraint that holds no coordinate after a pass.
    ConstraintLeft {
        /// The constraint.
        name: String,
    },
    /// A coordinate without kinetic energy after all passes.
    MasslessCoordinate {
        /// The model.
        model: String,
        /// The coordinate.
        name: String,
    },
    // ---- names ----
    /// A name that nothing declares.
    UnknownSymbol {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// `theta_dot`, where `theta` is declared.
    VelocityName {
        /// The name.
        name: String,
        /// What it may be the rate of.
        stem: String,
    },
    /// A function that does not exist.
    UnknownFunction {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// A number used like a function: `m(a + b)`.
    NotAFunction {
        /// The name.
        name: String,
    },
    /// A function without its arguments.
    FunctionAsValue {
        /// The name.
        name: String,
    },
    /// A `let` used before it is declared.
    UsedBeforeLet {
        /// The name.
        name: String,
    },
    /// A field of a type that formulas cannot use.
    UnsupportedField {
        /// The field.
        name: String,
        /// Its type as written.
        field_type: String,
    },
    /// A function with too many or too few arguments.
    WrongArity {
        /// The function.
        function: String,
        /// How many it takes.
        expected: usize,
        /// How many it got.
        found: usize,
    },
    // ---- velocities ----
    /// The rate of a velocity.
    Acceleration,
    /// A velocity in a Hamiltonian.
    VelocityInHamiltonian {
        /// The `let` that holds it.
        via: Option<String>,
    },
    /// `dot()` outside a Hamiltonian that has sums in loops.
    VelocityOfLoop,
    /// `dot()` of a momentum.
    RateOfMomentum,
    // ---- values ----
    /// An exponent that varies over a base that may be negative.
    VariableExponent {
        /// The base as written.
        base: String,
        /// The exponent as written.
        exponent: String,
    },
    /// `x/0`
    DivisionByZero,
    /// `(-8)^(1/3)`
    RootOfNegative,
    /// `ln(-1)`
    OutsideDomain {
        /// The function.
        function: Function,
    },
    // ---- vectors ----
    /// A vector where a number belongs.
    ScalarExpected {
        /// The length of the vector.
        length: usize,
    },
    /// A number where a vector belongs.
    VectorExpected,
    /// Two vectors of different length, or a function that wants another length.
    WrongLength {
        /// The length that fits.
        expected: usize,
        /// The length found.
        found: usize,
    },
    /// A vector times a vector.
    ProductOfVectors,
    /// Something divided by a vector.
    DivisionByVector,
    /// A power of a vector or a vector as exponent.
    PowerOfVector,
    /// A number plus a vector.
    ScalarPlusVector,
    /// `[]`
    EmptyVector,
    /// `[[a, b], [c, d]]`
    Matrix,
    /// An array whose length the macro does not know, without an index.
    WholeArray {
        /// The array.
        name: String,
    },
    // ---- indices and sums ----
    /// An index that is not an integer.
    IndexNotInteger {
        /// The index as written.
        index: String,
    },
    /// An index that is not affine.
    IndexNotAffine {
        /// The index as written.
        index: String,
    },
    /// A vector (not an array) indexed by something that varies.
    IndexNotConstant {
        /// The index as written.
        index: String,
    },
    /// An index beyond the array.
    IndexOutOfRange {
        /// The array.
        array: String,
        /// The value that is outside.
        value: String,
        /// The length of the array, if it is known here.
        length: Option<String>,
        /// The sums that lead there, `i in 0..3`.
        ranges: String,
    },
    /// `sum(i in 3..3, …)`
    EmptyRange {
        /// The range as written.
        range: String,
    },
    /// `output(x[i in -2..n])`
    SitesBelowZero {
        /// The range as written.
        range: String,
    },
    /// A sum inside a nonlinear expression of an energy, too long to be written out.
    NonlinearSum {
        /// The longest sum that is written out.
        limit: usize,
    },
    // ---- solvers ----
    /// An element that does not exist.
    UnknownElement {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// `Mixed::<40>`
    NodesOutOfRange {
        /// The nodes asked for.
        nodes: u64,
    },
    /// `.quadrature(0)`
    PointsOutOfRange {
        /// The points asked for.
        points: u64,
    },
    /// `Mixed::<4>.exact()`
    UnknownRule {
        /// The name.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// `.reduced()` on an element other than `Primal`.
    RuleNotForFamily {
        /// The rule.
        rule: String,
        /// The element.
        family: String,
    },
    /// `solver(...)` on a model whose size is a const parameter.
    SolverOfFamily {
        /// The const parameter.
        length: String,
    },
    /// `solver(...)` with an element that does not admit the constraints of the model.
    SolverOfConstraints {
        /// The element as written.
        element: String,
        /// Its nodes.
        nodes: u32,
        /// It admits holonomic ones.
        velocity: bool,
    },
    /// `solver(...)` with an element that has velocities as unknowns, beside a time transformation.
    SolverOfTransformation {
        /// The element as written.
        element: String,
        /// Its nodes.
        nodes: u32,
    },
}
