//! Holds the arrows between crates (who may import whom, what each crate never does) and that every page names what exists.

#![allow(clippy::unwrap_used)] // all of it is test code

mod crates;
mod pages;
mod workspace;
