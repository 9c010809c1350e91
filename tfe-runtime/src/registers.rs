//! Scalars in registers of the processor: four points or eight trajectories side by side, and the storage that keeps
//! them between steps.

pub(crate) mod four;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
pub(crate) mod octet;
#[cfg(feature = "alloc")]
pub(crate) mod pair;
mod products;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
pub(crate) mod quad;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
mod quads;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
mod register;
pub(crate) mod side;
pub(crate) mod storage;
