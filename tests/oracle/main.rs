//! The compiled kernels compared with the interpreter: the same declaration is processed by `#[dynamics]` and by the
//! engine at run time, and both are evaluated at the same numbers. Both execute the same program, so that they agree to
//! the last bit; only `powi` may round differently.

mod engine;
mod kernels;

use engine::Oracle;
use kernels::compare;
use tfe::Model;
use tfe::prelude::dynamics;
use tfe::runtime::{By, ConstraintSecond, First};

/// The values of a field.
trait Values {
    fn values(&self) -> &[f64];
}

impl Values for f64 {
    fn values(&self) -> &[f64] {
        std::slice::from_ref(self)
    }
}

impl<const K: usize> Values for [f64; K] {
    fn values(&self) -> &[f64] {
        self
    }
}

/// Declares a model twice from the same tokens.
macro_rules! agrees {
    (
        $test:ident: [f64; $dof:literal]
        struct $(<const $size:ident: usize = $length:literal>)? { $($field:ident: $type:ty = $value:expr),* $(,)? }
        $($arguments:tt)*
    ) => {
        #[test]
        fn $test() {
            #[dynamics($($arguments)*)]
            struct Declared $(<const $size: usize>)? {
                $($field: $type),*
            }
            let model: Declared $(<$length>)? = Declared { $($field: $value),* };
            let fields: &[(&str, &str, &[f64])] = &[$((stringify!($field), stringify!($type), model.$field.values())),*];
            let sizes: &[(&str, i64)] = &[$((stringify!($size), $length))?];
            compare::<_, $dof>(&model, Oracle::new(stringify!($($arguments)*), fields, sizes));
        }
    };
}

agrees! { double_pendulum: [f64; 2]
    struct { m1: f64 = 1.3, m2: f64 = 0.7, l1: f64 = 1.1, l2: f64 = 0.9, g: f64 = 9.81, c: f64 = 0.2 }
    coordinates(theta1, theta2),
    let x1 = l1*sin(theta1),
    let y1 = -l1*cos(theta1),
    let x2 = x1 + l2*sin(theta2),
    let y2 = y1 - l2*cos(theta2),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(m1*y1 + m2*y2),
    force(theta1) = -c*dot(theta1)*abs(dot(theta1)),
    dissipation = c/2*(dot(theta2) - dot(theta1))^2,
    output(tip) = x2,
    output(tip_speed) = sqrt(dot(x2)^2 + dot(y2)^2),
}

agrees! { henon_heiles: [f64; 2]
    struct { lambda: f64 = 0.8 }
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3),
    force(x) = -lambda*px + cos(t),
    output(angular_momentum) = x*py - y*px,
}

agrees! { trigonometric: [f64; 2]
    struct { k: f64 = 1.7 }
    coordinates(x, y),
    lagrangian = dot(x)^2/2 + exp(x)*dot(y)^2/2 - k*(sin(x*y) + cos(x) + tan(x/2) + asin(x/3) + acos(y/2) + atan(x - 2*y) + atan2(y, 3 + x)),
    output(a) = sin(2*x)*tan(y) + asin(y)*acos(x) + atan(k*x) + atan2(x, y),
}

agrees! { hyperbolic: [f64; 2]
    struct { k: f64 = 0.4 }
    coordinates(x, y),
    lagrangian = cosh(x)*dot(x)^2/2 + dot(y)^2/2 - k*(sinh(x*y) + tanh(x + y) + asinh(y) + acosh(2 + x*y) + atanh(x/2)),
    output(a) = sinh(x)*cosh(y) + tanh(dot(x)) + asinh(x) + acosh(1 + x^2) + atanh(y),
}

agrees! { powers_and_logarithms: [f64; 2]
    struct { k: f64 = 1.5, e: f64 = 2.5 }
    coordinates(x, y),
    lagrangian = (1 + x^2)*dot(x)^2/2 + dot(y)^4/12 + dot(y)^2 - k*(exp(-x) + ln(2 + y) + sqrt(3 + x*y) + hypot(x, y) + (2 + x)^e)
        - x^7/7 - (1 + y^2)^(-3) - (2 + y)^(3/2) - 1/(3 + x),
    force(y) = -y^11 + x^(-5)*exp(t),
    output(a) = k^(1/3) + (x^2 + 1)^(2/3) + hypot(dot(x), dot(y)) + x^23,
}

agrees! { kinks: [f64; 2]
    struct { k: f64 = 20.0, mu: f64 = 0.3 }
    coordinates(x, y),
    lagrangian = dot(x)^2/2 + dot(y)^2/2 - select(x < 0.1, k/2*(x - 0.1)^2, y^2*x) - select(y >= x, y^3, x*y) - max(x, y)^2*min(x, 2*y)/2 - abs(x*y),
    force(x) = -mu*sign(dot(x)) - select(dot(x) > 0.5, dot(x)^2, 0.5*dot(x)) + select(t <= 0.4, t, 0.4),
    output(a) = select(x < y, sign(x), min(dot(x), dot(y))) + max(x, 0),
}

agrees! { chain_of_any_length: [f64; 5]
    struct <const N: usize = 5> { m: [f64; N] = [1.0, 1.2, 0.8, 1.1, 0.9], k: f64 = 2.0, a: f64 = 0.3, c: f64 = 0.1, omega: f64 = 1.4 }
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m[i]/2*dot(q[i])^2) - sum(i in 0..N-1, k/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4)
        - sum(i in 0..N, (i + 1)*cos(q[i])),
    force(q[i]) = -c*dot(q[i])^3,
    force(q[N-1]) = sin(omega*t),
    output(extension) = q[N-1] - q[0],
    output(kinetic) = sum(i in 0..N, m[i]/2*dot(q[i])^2),
}

agrees! { all_to_all: [f64; 6]
    struct <const N: usize = 6> { k: f64 = 0.7 }
    coordinates(q[N]),
    momenta(p[N]),
    hamiltonian = sum(i in 0..N, p[i]^2/2) - k/(2*N)*sum(i in 0..N, sum(j in 0..N, cos(q[i] - q[j]))),
    output(order) = sqrt(sum(i in 0..N, cos(q[i]))^2 + sum(i in 0..N, sin(q[i]))^2)/N,
}

agrees! { rigid_body: [f64; 7]
    struct { j: [f64; 3] = [1.0, 2.0, 3.0], m: f64 = 1.5, g: f64 = 9.81, d: [f64; 3] = [0.1, 0.2, 0.3] }
    coordinates(r[3], e[4]),
    let w = body_rate(e),
    lagrangian = m/2*inner(dot(r), dot(r)) + (j[0]*w[0]^2 + j[1]*w[1]^2 + j[2]*w[2]^2)/2 + m/2*inner(dot(e), dot(e)) - m*g*(r + rotate(e, d))[2],
    output(spin) = norm(w),
    output(momentum) = cross(r, m*dot(r))[1],
}

agrees! { duffing_with_sensitivities: [f64; 1]
    struct { m: f64 = 1.2, k: [f64; 3] = [2.0, 0.7, 0.4], c: f64 = 0.3, amplitude: f64 = 1.5, omega: f64 = 1.9, scale: f64 = 2.0, _spare: f64 = 1.0 }
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k[0]/2*x^2 - k[2]/4*x^4,
    dissipation = c*k[1]/2*dot(x)^2,
    force(x) = amplitude*cos(omega*t),
    output(scaled) = scale*x,
    sensitivity(omega, amplitude, k[2], k[1], m, c, scale, _spare),
}

agrees! { moving_support_with_sensitivities: [f64; 2]
    struct { m: [f64; 2] = [1.3, 0.7], l: f64 = 1.1, g: f64 = 9.81, a: f64 = 0.2, omega: f64 = 2.3, k: f64 = 1.4, c: f64 = 0.2, n: f64 = 2.5 }
    coordinates(theta, s),
    let x = s + l*sin(theta) + a*sin(omega*t),
    let y = -l*cos(theta) + a*exp(-c*t)*cos(omega*t),
    lagrangian = m[0]/2*dot(s)^2 + m[1]/2*(dot(x)^2 + dot(y)^2) - m[1]*g*y - k/2*(sqrt(l^2 + s^2) - a)^2 - (2 + s)^n
        - select(theta < 3, k*s^2*theta, a),
    dissipation = c/2*(dot(x)^2 + hypot(1, dot(s))),
    force(s) = -c*dot(theta)*abs(dot(theta)) + tanh(k*t)*atan2(s, 3 + l),
    sensitivity(l, a, omega, m[0], m[1], k, c, g, n),
}

agrees! { hamiltonian_with_sensitivities: [f64; 2]
    struct { m: f64 = 1.4, k: [f64; 2] = [0.9, 0.3], c: f64 = 0.25, omega: f64 = 1.7 }
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + (py - k[1]*sin(omega*t)*x)^2)/(2*m) + k[0]/2*(x^2 + y^2) + k[1]*x^2*y*cos(omega*t),
    dissipation = c/2*(dot(x)^2 + k[1]*dot(y)^4),
    force(y) = k[0]*exp(-c*t)*dot(x) - omega*py,
    sensitivity(k[1], k[0], m, c, omega),
}

agrees! { chain_of_any_length_with_sensitivities: [f64; 5]
    struct <const N: usize = 5> { m: [f64; N] = [1.0, 1.2, 0.8, 1.1, 0.9], k: [f64; N] = [2.0, 1.5, 1.7, 1.9, 1.4], a: f64 = 0.3, c: f64 = 0.1, omega: f64 = 1.4 }
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m[i]/2*dot(q[i])^2) - sum(i in 0..N-1, k[i]*k[i+1]/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4)
        - k[1]*cos(omega*t)*sum(i in 0..N, sqrt(m[i])*cos(q[i])) - k[N-1]*q[0]^2,
    force(q[i]) = -c*m[i]*dot(q[i])^3,
    force(q[N-1]) = a*sin(omega*t)/(2 + sum(i in 0..N, k[i]^2*q[i]^2)),
    sensitivity(m[2], m[0], m[4], k[1], k[4], k[3], a, c, omega),
}

agrees! { all_to_all_with_sensitivities: [f64; 6]
    struct <const N: usize = 6> { k: f64 = 0.7, w: [f64; N] = [1.0, 0.9, 1.1, 1.3, 0.8, 0.7] }
    coordinates(q[N]),
    momenta(p[N]),
    hamiltonian = sum(i in 0..N, p[i]^2/2) - k/(2*N)*sum(i in 0..N, sum(j in 0..N, w[i]*w[j]*cos(q[i] - q[j] + k*t))),
    force(q[i]) = -k*p[i]/sqrt(1 + sum(j in 0..N, w[j]^2*p[j]^2)),
    sensitivity(k, w[3], w[5]),
}

agrees! { long_chain_with_sensitivities: [f64; 20]
    struct { m: f64 = 1.1, k: [f64; 20] = std::array::from_fn(|i| 1.0 + 0.05 * i as f64) }
    coordinates(q[20]),
    lagrangian = sum(i in 0..20, m/2*dot(q[i])^2 - k[19-i]/2*q[i]^2) - sum(i in 0..19, k[i]^2*exp(q[i+1] - q[i])),
    force(q[i]) = -k[i]*k[3]*dot(q[i]),
    sensitivity(k[3], k[19], k[0], m),
}

agrees! { sensitivities_named_like_the_emitter: [f64; 1]
    struct { by: f64 = 1.2, index: f64 = 0.7, first: f64 = 0.4, t0: f64 = 0.3, row: f64 = 0.6 }
    coordinates(x),
    lagrangian = by/2*dot(x)^2 - index*sin(first*x) - row*x^2,
    force(x) = t0^2*t*x,
    sensitivity(by, index, first, t0, row),
}

agrees! { rod_pendulum: [f64; 2]
    struct { m: f64 = 1.3, l: f64 = 0.9, g: f64 = 9.81 }
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
}

agrees! { knife_edge: [f64; 3]
    struct { m: f64 = 1.3, j: f64 = 0.9, g: f64 = 9.81, alpha: f64 = 0.3 }
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*sin(alpha)*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
}

agrees! { moving_wire: [f64; 2]
    struct { m: f64 = 1.3, g: f64 = 9.81 }
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(wire) = y - x^4/4*(1 + sin(t)/5),
}

agrees! { chaplygin_sleigh: [f64; 3]
    struct { m: f64 = 1.3, j: f64 = 0.9, a: f64 = 0.4 }
    coordinates(x, y, phi),
    lagrangian = m/2*((dot(x) - a*sin(phi)*dot(phi))^2 + (dot(y) + a*cos(phi)*dot(phi))^2) + j/2*dot(phi)^2,
    constraint(blade) = dot(y)*cos(phi) - dot(x)*sin(phi),
}

agrees! { ball_on_a_turntable: [f64; 7]
    struct { m: f64 = 1.3, j: [f64; 3] = [0.4, 0.5, 0.6], a: f64 = 0.3, d: [f64; 3] = [0.2, -0.1, 0.4], mu: f64 = 0.7 }
    coordinates(r[3], e[4]),
    let w = body_rate(e),
    let w_space = rotate(e, w),
    lagrangian = m/2*inner(dot(r), dot(r)) + (j[0]*w[0]^2 + j[1]*w[1]^2 + j[2]*w[2]^2)/2,
    constraint(unit) = inner(e, e) - 1,
    constraint(roll) = dot(r) - cross(w_space, [0, 0, a]) - mu*cross([0, 0, cos(t)], r),
    constraint(ball) = r + rotate(e, [0, 0, 1]),
    constraint(hinge) = inner(rotate(e, [1, 0, 0]), [0, 0, 1]),
    constraint(arm) = norm(r + rotate(e, d)) - 1,
}

agrees! { rods_of_a_hamiltonian_model: [f64; 6]
    struct { l: [f64; 2] = [0.7, 1.1], rows: f64 = 0.2, v: f64 = 0.3 }
    coordinates(x[3], y[3]),
    momenta(px[3], py[3]),
    let slip = cos(rows*t)*dot(y[0]),
    hamiltonian = inner(px, px)/2 + inner(py, py)/3 + px[0]*x[1],
    constraint(rod[i in 0..2]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2*cosh(t),
    constraint(given) = exp(x[2])*dot(x[2]) - slip - v,
}

agrees! { ends_of_a_chain: [f64; 5]
    struct <const N: usize = 5> { l: f64 = 0.7 }
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, dot(q[i])^2/2),
    constraint(ends) = (q[N-1] - q[0])^3 - l^2,
    constraint(middle) = q[N-2]*dot(q[N-1]) - sin(q[1])*dot(q[0]),
}

agrees! { parameters_with_an_underscore: [f64; 1]
    struct { q: f64 = 1.2, q_: f64 = 0.7, mu: f64 = 0.4, mu_: f64 = 0.3, mu__: f64 = 0.9 }
    coordinates(x),
    lagrangian = q/2*dot(x)^2 - q_*sin(mu*x) - mu_*x^2 + mu__*x,
    constraint(a) = mu*x^3 - mu_*x + mu__*q - q_,
}

#[test]
fn short_slices_are_left_alone() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = (dot(x)^2 + dot(y)^2)/2,
        constraint(rod) = x^2 + y^2 - 1,
        constraint(blade) = x*dot(y) - t,
    )]
    struct Short {}
    let (mut values, mut rows, mut drift) = ([7.0], [[7.0; 2]], [7.0]);
    Short {}.constraint_values(0.5, &[1.0, 2.0], &mut values);
    Short {}.constraint_rows(0.5, &[1.0, 2.0], &mut rows, &mut drift);
    assert_eq!((values, rows, drift), ([7.0], [[7.0; 2]], [7.0]));
    let mut second = ConstraintSecond {
        psi_q: &mut [],
        row_rates: &mut [],
        bend: [[7.0; 2]; 2],
        rate_q: [[7.0; 2]; 2],
        rate_v: [[7.0; 2]; 2],
    };
    Short {}.constraint_second(0.5, &[1.0, 2.0], &[0.0; 2], &[1.0], &mut second);
    assert_eq!(second.bend, [[7.0; 2]; 2]);
}

#[test]
fn an_element_that_is_not_there_has_no_value() {
    #[dynamics(
        coordinates(q[N]),
        lagrangian = sum(i in 0..N, m[i]/2*dot(q[i])^2 - w[i]*q[i]^2/2),
        sensitivity(m[2], w[1], w[3]),
    )]
    struct Chain<const N: usize> {
        m: [f64; N],
        w: Vec<f64>,
    }
    let chain = Chain {
        m: [1.0, 1.5],
        w: vec![2.0, 2.5],
    };
    assert!(chain.sensitivity_parameter(0).is_nan());
    assert_eq!(chain.sensitivity_parameter(1), 2.5);
    assert!(chain.sensitivity_parameter(2).is_nan());
    let mut first = First::ZERO;
    chain.first_by(By::Parameter(0), 0.0, &[0.1, 0.2], &[0.3, 0.4], &mut first);
    assert_eq!(first, First::ZERO);
    chain.first_by(By::Parameter(1), 0.0, &[0.1, 0.2], &[0.3, 0.4], &mut first);
    assert_eq!(first.q, [0.0, -0.2]);
}
