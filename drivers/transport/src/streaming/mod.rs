//! Common to all cameras that stream: how they are driven and restarted, how their frames are numbered, and what
//! may come beside depth.

mod driver;
mod numbering;
mod transfers;

pub use driver::{Progress, Streaming, Streams};
pub use numbering::Numbering;
pub use transfers::next_transfer;

/// Images that come beside depth, of cameras that have colour and infrared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VideoMode {
    /// Colour.
    #[default]
    Color,
    /// The depth camera's picture, as grey.
    Infrared,
    /// Nothing.
    Off,
}
