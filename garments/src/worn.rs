//! Layers as they are worn: what they do in other poses, and what of them is never in sight.

pub mod hidden;
pub mod posed;
