//! Recordings: frames of a rig as one MCAP file, and back.
//!
//! The contents (see `docs/recording.md`): a metadata record `toile.recording` with the rig as JSON; per sensor the
//! channels `/NAME/depth/image`, `/NAME/color/image`, `/NAME/depth/calibration`, `/NAME/color/calibration`; chunks
//! without compression (the payloads are compressed already) that each hold whole frames, with CRC and index. An MCAP
//! message's log time is the host time, its publish time the device time, its sequence the device's frame number.
//!
//! Writing: [`Recorder`] → `message` → `protobuf`, `depth_codec`; the `mcap` crate's writer makes the file.
//! Reading: [`Replay`] → `index` (or `foreign`, for files of other programs) → `scan` → `container`; `images` decodes.

mod bytes;
mod container;
pub mod depth_codec;
mod foreign;
mod images;
mod index;
pub(crate) mod log;
mod loss;
mod message;
mod metadata;
mod options;
mod protobuf;
mod recorder;
mod records;
mod replay;
mod scan;
mod schema;
mod standard;
mod stream;

pub use loss::Loss;
pub use options::{DepthEncoding, RecorderOptions, RecordingSummary};
pub use recorder::Recorder;
pub use replay::{FrameInfo, Replay};
pub use standard::export_standard;
