//! Vector instructions: the same computation on many values at once, chosen for the machine at run time.
//!
//! - [`floats`]: sixteen floats (fusion);
//! - [`bytes`]: thirty-two bytes or words (stereo matching).
//!
//! A computation is a `Kernel` generic over `Lanes`; `dispatch` runs it on AVX-512 or AVX2 where the processor has them
//! and on plain arrays elsewhere. `pulp` proves at run time that the instructions exist, so there is no `unsafe` here.

pub mod bytes;
pub mod floats;

/// Name of the instruction set that kernels over [`floats`] use on this machine: `avx512`, `avx2` or `scalar`.
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    match pulp::x86::Arch::new() {
        pulp::x86::Arch::V4(_) => return "avx512",
        pulp::x86::Arch::V3(_) => return "avx2",
        _ => {}
    }
    "scalar"
}
