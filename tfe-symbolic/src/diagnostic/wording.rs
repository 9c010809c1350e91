//! What is said of each kind of mistake: all wording is here.

use super::Kind;
use crate::expr::function::{Domain, Function};

impl Kind {
    /// What is wrong: lower case, names in backticks, no full stop.
    pub fn message(&self) -> String {
        match self {
            Self::Expected { wanted, found } => format!("expected {wanted}, found {found}"),
            Self::MissingOperator { left, right } => {
                format!("missing operator between `{left}` and `{right}`")
            }
            Self::DoubleStar => "`**` is not an operator".into(),
            Self::InclusiveRange => "`..=` is not supported in sums".into(),
            Self::NestedTooDeep { limit } => {
                format!("expression is nested more than {limit} levels deep")
            }
            Self::TooLong { limit } => format!("expression has more than {limit} operators"),
            Self::NumberTooLarge { number } => format!("number `{number}` is too large"),
            Self::UnknownArgument { name, .. } => {
                format!("unknown argument `{name}` of `dynamics`")
            }
            Self::NoCoordinates => "the model has no coordinates".into(),
            Self::RepeatedArgument { argument } => format!("`{argument}` is given more than once"),
            Self::NameClash { name, taken } => format!("the name `{name}` is taken by {taken}"),
            Self::ReservedName { name, .. } => {
                format!("the name `{name}` has a meaning of its own in formulas")
            }
            Self::ReservedPrefix { name, .. } => {
                format!("the name `{name}` begins like those of the generated code")
            }
            Self::ZeroLength { name, .. } => format!("array `{name}` has no elements"),
            Self::UnknownLength { name, .. } => format!("unknown length `{name}`"),
            Self::LengthNotSimple => {
                "the length of an array must be a number, or the name of a const parameter or of a \
                 field of type `usize`"
                    .into()
            }
            Self::TooManyCoordinates { limit } => {
                format!("the model has more than {limit} coordinates")
            }
            Self::FamilyNotAlone { name } => {
                format!("array `{name}` has a generic length and is not the only coordinate")
            }
            Self::RunTimeLength { argument } => {
                format!("`{argument}` in a model of run-time length is not supported yet")
            }
            Self::ConstraintNotAffine { name } => {
                format!("constraint `{name}` is not affine in the velocities")
            }
            Self::ConstraintWithoutCoordinate { name } => {
                format!("constraint `{name}` holds no coordinate")
            }
            Self::RepeatedConstraint { name, other } => {
                format!("constraint `{name}` repeats `{other}`")
            }
            Self::MomentumInConstraint => "momenta cannot be used in a constraint".into(),
            Self::VelocityConstraintOfFamily { name } => format!(
                "constraint `{name}` holds velocities, which models of run-time length do not support yet"
            ),
            Self::ConstraintRange { range } => {
                format!("a family of constraints needs a range known here, found `{range}`")
            }
            Self::TooManyConstraints { limit } => {
                format!("a family of constraints has more than {limit} members")
            }
            Self::SumInConstraint { name, .. } => {
                format!("constraint `{name}` holds a sum that cannot be written out")
            }
            Self::ListInRange { list } => {
                format!("the bound of a range cannot be an entry of the list `{list}`")
            }
            Self::OutputFamily => "outputs over a range are for models of run-time length".into(),
            Self::NoEnergy => "the model has neither a Lagrangian nor a Hamiltonian".into(),
            Self::TwoEnergies => "the model has both a Lagrangian and a Hamiltonian".into(),
            Self::NoMomenta => "a Hamiltonian needs momenta".into(),
            Self::TransformationOfLagrangian => "a time transformation needs a hamiltonian".into(),
            Self::TransformationOfFamily { length } => format!(
                "a time transformation needs a number of coordinates known here, but `{length}` is generic"
            ),
            Self::TransformationWith { argument } => {
                format!("a time transformation does not go with `{argument}`")
            }
            Self::TransformationNotPositive => "the rate of the time is not positive".into(),
            Self::PowerOfLoop { .. } => {
                "the power of the forces cannot be written out where a Hamiltonian is summed in a loop"
                    .into()
            }
            Self::MomentaWithLagrangian => "a model with a Lagrangian declares no momenta".into(),
            Self::MomentaMismatch {
                coordinates,
                momenta,
            } => {
                format!("momenta `{momenta}` do not match coordinates `{coordinates}`")
            }
            Self::ForceTarget { target, .. } => format!("`{target}` is not a coordinate"),
            Self::UnusedCoordinate { name, energy } => {
                format!("coordinate `{name}` does not appear in the {energy}")
            }
            Self::UnusedField { name } => format!("field `{name}` is not used in any formula"),
            Self::NoVelocity { name } => {
                format!("coordinate `{name}` has no velocity in the Lagrangian")
            }
            Self::LinearVelocity { name } => {
                format!("the momentum of coordinate `{name}` does not depend on any velocity")
            }
            Self::NoMomentum { name } => {
                format!("momentum `{name}` does not appear in the Hamiltonian")
            }
            Self::ConstantEnergy { energy } => {
                format!("the {energy} does not depend on the state of the system")
            }
            Self::DissipationWithoutVelocity => "the dissipation depends on no velocity".into(),
            Self::NoSensitivity => "`sensitivity` names no parameter".into(),
            Self::NotAParameter {
                target,
                role: Some(role),
            } => format!("cannot differentiate by `{target}`, which is {role}"),
            Self::NotAParameter { target, role: None } => {
                format!("cannot differentiate by `{target}`")
            }
            Self::UnknownParameter { name, .. } => format!("unknown parameter `{name}`"),
            Self::ArrayOfParameters { name } => {
                format!("array `{name}` of parameters needs an index")
            }
            Self::IndexNotLiteral { index, .. } => {
                format!("index `{index}` of a parameter is not a literal")
            }
            Self::RepeatedParameter { name } => {
                format!("`sensitivity` names `{name}` more than once")
            }
            Self::ParameterOfConstraint { name, constraint } => {
                format!("cannot differentiate by `{name}`, which constraint `{constraint}` holds")
            }
            Self::NoPass { name } => format!("model `{name}` is made by nothing"),
            Self::UnknownPass { name, .. } => format!("unknown pass `{name}`"),
            Self::PassEntry { pass } => format!("this does not fit into `{pass}(…)`"),
            Self::TruncationDegree { limit } => {
                format!("the degree of a truncation is an integer from 2 to {limit}")
            }
            Self::UnknownCoordinate { name, .. } => {
                format!("`{name}` is not a coordinate of the model")
            }
            Self::NoSuchElement { name } => format!("there is no coordinate `{name}`"),
            Self::RepeatedEntry { name } => format!("`{name}` is given more than once"),
            Self::PassValue { pass: "frozen" } => {
                "a frozen coordinate can depend on parameters and the time only".into()
            }
            Self::PassValue { .. } => {
                "the point of a truncation can depend on parameters only".into()
            }
            Self::PassOfLength { pass } => {
                format!("`{pass}` needs sums written out, which is not possible here")
            }
            Self::TruncationOfConstraints => "a model with constraints cannot be truncated".into(),
            Self::NoTaylorPolynomial => {
                "the model has no Taylor polynomial at the point of the truncation".into()
            }
            Self::FrozenHamiltonian => "coordinates of a Hamiltonian cannot be frozen".into(),
            Self::NotCyclic { name } => {
                format!("`{name}` is not cyclic: the energy or a force depends on it")
            }
            Self::CyclicConstrained { name } => {
                format!("`{name}` cannot be ignored: a constraint acts on it")
            }
            Self::CyclicForced { name } => {
                format!("`{name}` cannot be ignored: a force acts on it, so that its momentum is not constant")
            }
            Self::CyclicNotQuadratic { name } => {
                format!("`{name}` cannot be ignored: the Lagrangian is not quadratic in its velocity")
            }
            Self::RouthName { name, coordinate } => {
                format!("`{coordinate}` cannot be ignored: the name `{name}` is taken, and needed for its momentum or velocity")
            }
            Self::NotASpring { field, found } => {
                format!("`{field}` is not the stiffness of a spring: {found}")
            }
            Self::UnknownConstraint { name, .. } => {
                format!("`{name}` is not a constraint of the model")
            }
            Self::ElasticVelocity { name } => {
                format!("constraint `{name}` holds velocities and cannot become a spring")
            }
            Self::NothingLeft { pass } => format!("`{pass}` leaves no coordinate"),
            Self::ConstraintLeft { name } => {
                format!("constraint `{name}` holds no coordinate any more")
            }
            Self::MasslessCoordinate { model, name } => {
                format!("coordinate `{name}` of model `{model}` has no kinetic energy")
            }
            Self::UnknownSymbol { name, .. } => format!("unknown name `{name}`"),
            Self::UnknownFunction { name, .. } => format!("unknown function `{name}`"),
            Self::NotAFunction { name } => format!("`{name}` is not a function"),
            Self::FunctionAsValue { name } => format!("function `{name}` needs arguments"),
            Self::UsedBeforeLet { name } => format!("`{name}` is used before its `let`"),
            Self::UnsupportedField { name, field_type } => {
                format!("field `{name}` of type `{field_type}` cannot be used in a formula")
            }
            Self::WrongArity {
                function,
                expected,
                found,
            } => {
                format!(
                    "`{function}` takes {}, found {found}",
                    counted(*expected, "argument")
                )
            }
            Self::Acceleration => "accelerations cannot be used in a model".into(),
            Self::VelocityInHamiltonian { via: None } => {
                "velocities cannot be used in a Hamiltonian".into()
            }
            Self::VelocityInHamiltonian { via: Some(name) } => {
                format!("`{name}` contains a velocity and cannot be used in a Hamiltonian")
            }
            Self::VelocityOfLoop => {
                "velocities are not available where a Hamiltonian is summed in a loop".into()
            }
            Self::RateOfMomentum => "the rate of a momentum cannot be used in a model".into(),
            Self::VariableExponent { exponent, .. } => {
                format!("exponent `{exponent}` varies while the base may become negative")
            }
            Self::DivisionByZero => "division by zero".into(),
            Self::OutsideDomain { function } => {
                format!("`{function}` is defined {} only", domain_words(*function))
            }
            Self::ScalarExpected { length } => {
                format!("expected a number, found a vector of length {length}")
            }
            Self::VectorExpected => "expected a vector, found a number".into(),
            Self::WrongLength { expected, found } => {
                format!("expected a vector of length {expected}, found length {found}")
            }
            Self::ProductOfVectors => "the product of two vectors is ambiguous".into(),
            Self::DivisionByVector => "cannot divide by a vector".into(),
            Self::PowerOfVector => "powers of vectors are not defined".into(),
            Self::ScalarPlusVector => "cannot add a number and a vector".into(),
            Self::EmptyVector => "a vector needs at least one component".into(),
            Self::WholeArray { name } => {
                format!("array `{name}` has no length known here and needs an index")
            }
            Self::IndexNotInteger { index } => format!("index `{index}` is not an integer"),
            Self::IndexNotAffine { index } => {
                format!(
                    "index `{index}` is not a sum of integers, lengths and multiples of indices"
                )
            }
            Self::IndexNotConstant { index } => {
                format!("index `{index}` into a vector is not a constant")
            }
            Self::IndexOutOfRange {
                array,
                value,
                length,
                ranges,
            } => {
                let reached = match ranges.as_str() {
                    "" => format!("index `{value}` is"),
                    ranges => format!("index reaches `{value}` for `{ranges}`,"),
                };
                let length = length.as_ref().map(|length| format!(" of length {length}"));
                format!("{reached} outside `{array}`{}", length.unwrap_or_default())
            }
            Self::EmptyRange { range } => format!("range `{range}` is empty"),
            Self::NonlinearSum { .. } => {
                "a sum in a loop stands inside a nonlinear expression of the energy".into()
            }
            Self::UnknownElement { name, .. } => format!("unknown element `{name}`"),
            Self::NodesOutOfRange { nodes } => format!("an element cannot have {nodes} nodes"),
            Self::PointsOutOfRange { points } => {
                format!("a rule cannot have {}", counted(*points as usize, "point"))
            }
            Self::UnknownRule { name, .. } => format!("unknown rule `{name}`"),
            Self::RuleNotForFamily { rule, family } => {
                format!("rule `{rule}` is not defined for `{family}`")
            }
            Self::SolverOfFamily { length } => {
                format!("a solver needs sizes known here, but `{length}` is generic")
            }
            Self::SolverOfTransformation { element, .. } => {
                format!("element `{element}` does not admit a time transformation")
            }
            Self::SolverOfConstraints {
                element, velocity, ..
            } => {
                let kind = if *velocity { "velocity " } else { "" };
                format!("element `{element}` does not admit {kind}constraints")
            }
        }
    }

    /// The remedy, where there is one to name.
    pub fn help(&self) -> Option<String> {
        Some(match self {
            Self::MissingOperator { left, right } => format!("write `{left}*{right}`"),
            Self::DoubleStar => "write `^` for a power".into(),
            Self::InclusiveRange => "write `a..b+1`".into(),
            Self::NestedTooDeep { .. } | Self::TooLong { .. } => {
                "name parts of it with `let`".into()
            }
            Self::UnknownArgument {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownSymbol {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownFunction {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownLength {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownElement {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownRule {
                nearest: Some(nearest),
                ..
            }
            | Self::ForceTarget {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownParameter {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownPass {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownCoordinate {
                nearest: Some(nearest),
                ..
            }
            | Self::UnknownConstraint {
                nearest: Some(nearest),
                ..
            } => {
                format!("did you mean `{nearest}`?")
            }
            Self::UnknownArgument { nearest: None, .. } => {
                format!("the arguments are {}", backticked(crate::syntax::parse::ARGUMENTS))
            }
            Self::UnknownSymbol {
                nearest: None,
                name,
            } => {
                format!("declare `{name}` as a field of the struct, a coordinate or a `let`")
            }
            Self::UnknownElement { nearest: None, .. } => {
                format!("the elements are {}", backticked(crate::check::ELEMENTS))
            }
            Self::UnknownRule { nearest: None, .. } => {
                format!("the rules are {}", backticked(crate::check::RULES))
            }
            Self::UnknownLength {
                nearest: None,
                name,
            } => {
                format!(
                    "declare `const {name}: usize` on the struct, or a field `{name}: usize`, or \
                     write a number"
                )
            }
            Self::NoCoordinates => "add `coordinates(x)`".into(),
            Self::NameClash { .. } | Self::ReservedName { .. } | Self::ReservedPrefix { .. } => {
                "choose another name".into()
            }
            Self::FamilyNotAlone { name } => {
                format!("make the others elements of `{name}`, or give all arrays literal lengths")
            }
            Self::RunTimeLength { .. } => {
                "give the coordinates a length known here, such as `q[10]`".into()
            }
            Self::ConstraintNotAffine { .. } => {
                "write a condition on positions, or one in which velocities stand linearly, such \
                 as `dot(x)*sin(phi) - dot(y)*cos(phi)`"
                    .into()
            }
            Self::ConstraintWithoutCoordinate { .. } => {
                "write what must vanish, such as `x^2 + y^2 - l^2`".into()
            }
            Self::RepeatedConstraint { name, .. } => format!("remove `{name}`"),
            Self::MomentumInConstraint => "write the velocity instead, such as `dot(x)`".into(),
            Self::VelocityConstraintOfFamily { .. } => {
                "write a condition on positions, or give the coordinates a length known here, such \
                 as `q[10]`"
                    .into()
            }
            Self::ConstraintRange { .. } => {
                "write the constraints out, or give the array and the range literal lengths".into()
            }
            Self::TooManyConstraints { .. } => "split the family into several shorter ones".into(),
            Self::SumInConstraint { limit, .. } => {
                format!("make the length a number of at most {limit}, or write the sum out")
            }
            Self::ParameterOfConstraint { .. } => {
                "remove it from `sensitivity`: derivatives of constraints by parameters are not \
                 available"
                    .into()
            }
            Self::SolverOfConstraints { nodes, .. }
            | Self::SolverOfTransformation { nodes, .. } => format!("use `Mixed::<{nodes}>`"),
            Self::ListInRange { .. } => {
                "bound the range by numbers and fields of type `usize`".into()
            }
            Self::OutputFamily => "declare one `output` an element".into(),
            Self::NoEnergy => "add `lagrangian = …` or `hamiltonian = …`".into(),
            Self::TwoEnergies => "keep one of them".into(),
            Self::NoMomenta => "add `momenta(…)`, one for each coordinate, in their order".into(),
            Self::TransformationOfLagrangian => {
                "declare the model by `momenta(…)` and `hamiltonian = …`".into()
            }
            Self::TransformationOfFamily { .. } => {
                "give the coordinates a length known here, such as `q[10]`".into()
            }
            Self::TransformationWith {
                argument: "constraint",
            } => "choose coordinates that satisfy the constraints, or remove one of the two".into(),
            Self::TransformationWith { .. } => "remove one of the two".into(),
            Self::TransformationNotPositive => {
                "write dt/dτ, such as the distance from a singularity".into()
            }
            Self::PowerOfLoop { limit } => format!(
                "make the length a number of at most {limit}, or remove `time_transformation`"
            ),
            Self::MomentaWithLagrangian => {
                "remove `momenta`; they follow from the Lagrangian as ∂L/∂v".into()
            }
            Self::MomentaMismatch { .. } => {
                "declare one momentum for each coordinate, in the same order and of the same \
                 lengths"
                    .into()
            }
            Self::UnusedCoordinate { name, .. } => format!("remove `{name}` from `coordinates`"),
            Self::UnusedField { name } => {
                format!("remove it, or name it `_{name}` if other code needs it")
            }
            Self::NoVelocity { name } => {
                format!("add its kinetic energy, such as `m/2*dot({name})^2`")
            }
            Self::LinearVelocity { name } => {
                format!("the Lagrangian must hold `dot({name})` other than linearly")
            }
            Self::NoMomentum { name } => {
                format!("add its kinetic energy, such as `{name}^2/(2*m)`")
            }
            Self::ConstantEnergy { .. } => "write kinetic and potential energy".into(),
            Self::DissipationWithoutVelocity => {
                "a Rayleigh function holds velocities, such as `c/2*dot(x)^2`".into()
            }
            Self::NoSensitivity => "name fields of the struct, as in `sensitivity(omega)`".into(),
            Self::UnknownParameter {
                nearest: None,
                name,
            } => format!("declare `{name}` as a field of the struct"),
            Self::NotAParameter { target, role: None } if target == "t" => {
                "derivatives by the time come with those by any parameter".into()
            }
            Self::NotAParameter { .. } => {
                "derivatives are taken by fields of type `f64` and by elements of array fields, \
                 such as `k[2]`"
                    .into()
            }
            Self::ArrayOfParameters { name } => {
                format!("name its elements, as in `{name}[0], {name}[1]`")
            }
            Self::IndexNotLiteral { array, .. } => {
                format!("name each element, as in `{array}[0], {array}[1]`")
            }
            Self::RepeatedParameter { .. } => "name it once".into(),
            Self::NoPass { name } => format!("say what to do, as in `model({name}, truncated(2))`"),
            Self::UnknownPass { nearest: None, .. } => {
                format!("the passes are {}", backticked(crate::check::PASSES))
            }
            Self::PassEntry { pass } => format!("write it like `{}`", usage(pass)),
            Self::TruncationDegree { .. } => "write `truncated(2)` for a linear model".into(),
            Self::UnknownCoordinate { nearest: None, .. } => {
                "name a coordinate as declared, such as `x` or `q[2]`; momenta and velocities \
                 belong to truncations"
                    .into()
            }
            Self::RepeatedEntry { .. } => "give it once".into(),
            Self::PassValue { .. } => "write numbers and fields of the struct".into(),
            Self::PassOfLength {
                pass: "frozen" | "rigid" | "elastic",
            } => "give arrays of coordinates literal lengths of at most some thousand".into(),
            Self::PassOfLength { .. } => {
                "give arrays of coordinates literal lengths of at most some thousand, or say the \
                 same of all elements of the only array"
                    .into()
            }
            Self::TruncationOfConstraints => {
                "choose coordinates that satisfy the constraints, or make them springs by \
                 `elastic(name = k)` first"
                    .into()
            }
            Self::NoTaylorPolynomial => "give another point, such as `truncated(2, r = l)`".into(),
            Self::NotCyclic { .. } => {
                "ignore coordinates only that appear by their velocities; `structure()` lists the cyclic ones".into()
            }
            Self::CyclicConstrained { .. } => {
                "choose coordinates that satisfy the constraint".into()
            }
            Self::CyclicForced { name } => {
                format!("keep `{name}`, or declare the model without the force")
            }
            Self::RouthName { name, .. } => format!("give the field or output `{name}` another name"),
            Self::CyclicNotQuadratic { .. } => "declare the model by a Hamiltonian".into(),
            Self::FrozenHamiltonian => "declare the model by a Lagrangian".into(),
            Self::NotASpring { .. } => {
                "name a field of type `f64` whose energy is a square, such as `k/2*(r - l)^2`"
                    .into()
            }
            Self::UnknownConstraint { nearest: None, .. } => "name a constraint as declared".into(),
            Self::ElasticVelocity { .. } => {
                "name constraints on positions, or declare a `dissipation` instead".into()
            }
            Self::NothingLeft { .. } => "leave one coordinate at least".into(),
            Self::ConstraintLeft { .. } => {
                "freeze fewer coordinates, or declare the constraint in another model".into()
            }
            Self::MasslessCoordinate { name, .. } => {
                format!("freeze `{name}` too, or truncate about another point")
            }
            Self::NotAFunction { name } => format!("write `{name}*(…)` for a product"),
            Self::FunctionAsValue { name } => format!("write `{name}(…)`"),
            Self::UsedBeforeLet { .. } => "move the `let` up".into(),
            Self::UnsupportedField { .. } => {
                "formulas use fields of type `f64`, `[f64; N]`, `Vec<f64>` and `usize`".into()
            }
            Self::Acceleration => "forces and energies depend on velocities at most".into(),
            Self::VelocityInHamiltonian { .. } | Self::VelocityOfLoop => {
                "write the momenta instead".into()
            }
            Self::RateOfMomentum => "write the force that changes it".into(),
            Self::VariableExponent { base, exponent } => {
                format!("write `exp(({exponent})*ln({base}))` if the base is always positive")
            }
            Self::ScalarExpected { .. } => {
                "take a component such as `r[0]`, or use `inner` or `norm`".into()
            }
            Self::VectorExpected => "write a vector as `[a, b, c]`".into(),
            Self::ProductOfVectors => "use `inner(a, b)` or `cross(a, b)`".into(),
            Self::PowerOfVector => "use `inner(r, r)` for the square of the length".into(),
            Self::DivisionByVector => "divide by its `norm`".into(),
            Self::WholeArray { name } => format!("write an element such as `{name}[i]`"),
            Self::IndexNotConstant { .. } => {
                "an index that varies needs a coordinate array or an array field".into()
            }
            Self::NonlinearSum { limit } => format!(
                "make the length a number of at most {limit}, or rewrite the energy as a sum of \
                 local terms"
            ),
            Self::NodesOutOfRange { .. } => "choose 2 to 12 nodes".into(),
            Self::PointsOutOfRange { .. } => {
                format!("choose 1 to {} points", crate::check::MAX_POINTS)
            }
            Self::RuleNotForFamily { .. } => "use `.quadrature(k)`".into(),
            Self::SolverOfFamily { .. } => {
                "give the coordinates literal lengths, or use `Simulation`".into()
            }
            Self::Expected { .. }
            | Self::NumberTooLarge { .. }
            | Self::RepeatedArgument { .. }
            | Self::ZeroLength { .. }
            | Self::LengthNotSimple
            | Self::TooManyCoordinates { .. }
            | Self::ForceTarget { .. }
            | Self::UnknownFunction { .. }
            | Self::WrongArity { .. }
            | Self::NoSuchElement { .. }
            | Self::DivisionByZero
            | Self::OutsideDomain { .. }
            | Self::WrongLength { .. }
            | Self::ScalarPlusVector
            | Self::EmptyVector
            | Self::IndexNotInteger { .. }
            | Self::IndexNotAffine { .. }
            | Self::IndexOutOfRange { .. }
            | Self::EmptyRange { .. } => return None,
        })
    }

    /// The field of the struct that is to blame.
    pub fn field(&self) -> Option<&str> {
        match self {
            Self::UnusedField { name }
            | Self::ReservedName { name, field: true }
            | Self::ReservedPrefix { name, field: true }
            | Self::ZeroLength { name, field: true } => Some(name),
            _ => None,
        }
    }
}

fn domain_words(function: Function) -> &'static str {
    match function.domain() {
        Domain::Everywhere => "everywhere",
        Domain::NotOddQuarterTurns => "away from odd multiples of π/2",
        Domain::NonNegative => "for numbers that are not negative",
        Domain::Positive => "for positive numbers",
        Domain::UnitInterval => "between −1 and 1",
        Domain::OpenUnitInterval => "strictly between −1 and 1",
        Domain::AtLeastOne => "from 1 upwards",
    }
}

/// A pass as it may be written.
fn usage(pass: &str) -> &'static str {
    match pass {
        "frozen" => "frozen(r = l)",
        "routh" => "routh(phi, psi)",
        "rigid" => "rigid(rod = k)",
        "elastic" => "elastic(rod = k)",
        _ => "truncated(4, theta = 0)",
    }
}

/// `3 arguments`
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// `` `a`, `b` and `c` ``
fn backticked(names: &[&str]) -> String {
    let mut names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match names.pop() {
        None => String::new(),
        Some(last) if names.is_empty() => last,
        Some(last) => format!("{} and {last}", names.join(", ")),
    }
}
