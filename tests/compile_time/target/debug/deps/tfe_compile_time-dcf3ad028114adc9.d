/work/main/tests/compile_time/target/debug/deps/tfe_compile_time-dcf3ad028114adc9.d: src/main.rs src/arm.rs src/user.rs Cargo.toml

/work/main/tests/compile_time/target/debug/deps/libtfe_compile_time-dcf3ad028114adc9.rmeta: src/main.rs src/arm.rs src/user.rs Cargo.toml

src/main.rs:
src/arm.rs:
src/user.rs:
Cargo.toml:

# env-dep:CARGO_MANIFEST_DIR=/work/main/tests/compile_time
# env-dep:CLIPPY_ARGS=-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__
# env-dep:CLIPPY_CONF_DIR
