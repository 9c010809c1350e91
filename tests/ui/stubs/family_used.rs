//! The stubs of a family keep its const parameter.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 - k/2*q[j]^2),
)]
struct Chain<const N: usize> { m: f64, k: f64 }

fn start<const N: usize>(chain: &Chain<N>) -> State<N> {
    chain.state([0.0; N], [1.0; N])
}

fn main() {
    let chain = Chain::<8> { m: 1.0, k: 1.0 };
    let motion = Simulation::new(&chain).step(0.1).run(start(&chain), 0.0..1.0);
    println!("{:?}", motion.map(|motion| motion.last().q[7]).ok());
}
