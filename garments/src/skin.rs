//! Skin weights of garments: carried from the body, alike in layers that lie close, and without tears.

pub mod common_frame;
pub mod hanging;
mod influences;
pub mod layer_weights;
mod limit_stretch;
pub(crate) mod stretch;
