//! Video4Linux2 declarations for the `v4l` and `nokhwa` crates, in place of `v4l2-sys-mit` from the registry.
//!
//! The registry's crate runs bindgen at every build and so needs libclang on every machine. The declarations are
//! part of Linux' stable interface: here they were generated once (bindgen 0.72 on `linux/videodev2.h` of Linux
//! 6.1, 64-bit, taken under the header's BSD-3-Clause choice) and are committed. This crate only declares; it calls
//! nothing.

#![allow(missing_docs, non_camel_case_types, non_snake_case, non_upper_case_globals, clippy::all)]

#[cfg(not(target_pointer_width = "64"))]
compile_error!("bindings.rs was generated for 64-bit Linux; generate it anew for this target");

include!("bindings.rs");
