//! The last neighbour is missing, whatever the length.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2 - k/2*(q[i+1] - q[i])^2),
)]
struct Chain { n: usize, m: f64, k: f64 }

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chain = Chain { n: 10, m: 1.0, k: 1.0 };
    let start = chain.state([0.0; 10], vec![0.0; 10]);
    let motion = Simulation::new(&chain).step(0.1).run(start, 0.0..1.0)?;
    println!("{}", motion.energy_error());
    Ok(())
}
