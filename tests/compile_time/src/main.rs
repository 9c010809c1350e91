//! The processor time that the compiler needs for the crate of a user whose model is a serial robot arm in space.
//!
//! The crate depends on `tfe` by its path and has the default profiles of Cargo, so that the engine runs unoptimised in `dev`, as it
//! does for users. Dependencies are built once; then only the crate itself is compiled anew, for one number of links after the other:
//!
//! * `check`: the attribute is expanded and the types are checked;
//! * `build`: the same, then the machine code of all that `main` uses, and linking.
//!
//! A row with the number zero is a crate with the same `main` for a pendulum: what is left when the model costs next to nothing.
//!
//! ```text
//! tests/compile_time/run                     1 to 8 and 12 links; dev, dev with the engine optimised (`tuned`), and release
//! tests/compile_time/run dev 6 8             6 and 8 links, dev
//! ```

mod arm;
mod user;

use std::error::Error;
use user::{Profile, User};

/// The numbers of links if none are given.
const LINKS: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12];

fn main() -> Result<(), Box<dyn Error>> {
    let (mut profiles, mut links) = (Vec::new(), Vec::new());
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "dev" => profiles.push(Profile::Dev),
            "release" => profiles.push(Profile::Release),
            "tuned" => profiles.push(Profile::Tuned),
            number => links.push(number.parse()?),
        }
    }
    if profiles.is_empty() {
        profiles = vec![Profile::Dev, Profile::Tuned, Profile::Release];
    }
    if links.is_empty() {
        links = LINKS.to_vec();
    }
    for profile in profiles {
        let user = User::new(profile)?;
        println!("{profile}: processor seconds of the last crate");
        println!("{:>5} {:>9} {:>9}", "links", "check", "build");
        for links in &links {
            let (check, build) = user.compile(&arm::program(*links))?;
            println!("{links:>5} {check:>9} {build:>9}");
        }
    }
    Ok(())
}
