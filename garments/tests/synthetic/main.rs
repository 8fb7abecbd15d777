//! Garments on a synthetic person: a column of cloth-covered rings with known truth.

#![allow(clippy::unwrap_used)] // all of it is test code

mod column;
mod edits;
mod extraction;
mod first;
mod hard_cases;
mod seed;
mod stacking;
