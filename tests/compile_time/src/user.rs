//! The crate of a user, and the time that the compiler needs for it.

use std::error::Error;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A profile of Cargo with its default settings.
#[derive(Clone, Copy, Debug)]
pub enum Profile {
    /// The profile of `cargo build`.
    Dev,
    /// The profile of `cargo build --release`.
    Release,
    /// The profile of `cargo build` with the two lines of the README in the manifest, by which the engine is optimised.
    Tuned,
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Dev => "dev",
            Self::Release => "release",
            Self::Tuned => "tuned",
        })
    }
}

/// The result of a compilation.
#[derive(Clone, Copy, Debug)]
pub enum Outcome {
    /// It took this many processor seconds.
    Seconds(f64),
    /// The compiler was ended by a signal, as when its stack overflows, or reported an error.
    Failed,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Seconds(seconds) => f.pad(&format!("{seconds:.2}")),
            Self::Failed => f.pad("failed"),
        }
    }
}

/// A crate outside the workspace with `tfe` as its only dependency.
#[derive(Debug)]
pub struct User {
    folder: PathBuf,
    profile: Profile,
}

impl User {
    /// Makes the crate and builds its dependencies.
    ///
    /// # Errors
    /// If a file cannot be written, or the dependencies cannot be built.
    pub fn new(profile: Profile) -> Result<Self, Box<dyn Error>> {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let root = tests.join("..").canonicalize()?;
        let folder = root.join("target/compile_time/user");
        fs::create_dir_all(folder.join("src"))?;
        let lines = match profile {
            Profile::Tuned => "\n[profile.dev.build-override]\nopt-level = 2\n",
            Profile::Dev | Profile::Release => "",
        };
        let manifest = format!(
            "[package]\nname = \"user\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\ntfe = {{ path = {root:?} }}\n{lines}"
        );
        fs::write(folder.join("Cargo.toml"), manifest)?;
        // The versions used by the other crate outside the workspace.
        let versions = fs::read_to_string(tests.join("outside/Cargo.lock"))?;
        fs::write(
            folder.join("Cargo.lock"),
            versions.replace(
                "\"tfe-outside\"\nversion = \"0.1.0\"",
                "\"user\"\nversion = \"0.0.0\"",
            ),
        )?;
        let user = Self { folder, profile };
        fs::write(user.main(), crate::arm::program(0))?;
        for command in ["check", "build"] {
            if !user
                .cargo(command)
                .stderr(Stdio::inherit())
                .status()?
                .success()
            {
                return Err(format!("`cargo {command}` of the dependencies failed").into());
            }
        }
        Ok(user)
    }

    /// The time of `cargo check` and of `cargo build` for this `main.rs`.
    ///
    /// # Errors
    /// If the file cannot be written, or Cargo cannot be started.
    pub fn compile(&self, program: &str) -> Result<(Outcome, Outcome), Box<dyn Error>> {
        fs::write(self.main(), program)?;
        Ok((self.measured("check")?, self.measured("build")?))
    }

    fn main(&self) -> PathBuf {
        self.folder.join("src/main.rs")
    }

    fn cargo(&self, command: &str) -> Command {
        let mut cargo = Command::new("cargo");
        cargo.current_dir(&self.folder).arg(command).arg("--quiet");
        if let Profile::Release = self.profile {
            cargo.arg("--release");
        }
        // Settings in the environment of whoever runs this are not those of a user; and every measurement must compile
        // the whole crate.
        cargo.env("CARGO_TARGET_DIR", self.folder.join("target"));
        cargo.env("CARGO_INCREMENTAL", "0");
        cargo
    }

    fn measured(&self, command: &str) -> Result<Outcome, Box<dyn Error>> {
        let before = of_children()?;
        let output = self
            .cargo(command)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .output()?;
        let seconds = of_children()? - before;
        Ok(match output.status.success() {
            true => Outcome::Seconds(seconds),
            false => Outcome::Failed,
        })
    }
}

/// Processor seconds, user and system time, of all processes that this one has started and that have ended, including
/// theirs.
fn of_children() -> Result<f64, Box<dyn Error>> {
    /// Clock ticks per second in `/proc`; the same on all relevant architectures of Linux.
    const TICKS: f64 = 100.0;
    let line = fs::read_to_string("/proc/self/stat")?;
    // The name of the program is in parentheses and may contain anything.
    let (_, numbers) = line.rsplit_once(')').ok_or("/proc/self/stat has no name")?;
    let mut ticks = 0.0;
    // cutime and cstime are the fields 16 and 17, of which the first after the name is 3.
    for field in numbers.split_whitespace().skip(13).take(2) {
        ticks += field.parse::<f64>()?;
    }
    Ok(ticks / TICKS)
}
