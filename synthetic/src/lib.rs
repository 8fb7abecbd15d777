//! A virtual depth and colour camera that looks at a virtual dressed person on a turning disk, with the truth beside.
//!
//! It serves the training of operators, tests, benchmarks and the sessions in `recorded/`. Everything follows from the
//! seed in [`SyntheticSettings`]: the same bytes in every run, for any number of threads.
//!
//! - [`Subject`]: a person drawn from the body model, with detail that the model does not know, and garments made on them;
//! - [`Take`]: the person in one pose with the first n garments on, the moments of its frames, each frame rendered on demand;
//! - [`sensor`]: Kinect v1, Kinect v2 and active stereo as noise on the true depth;
//! - [`truth`]: surfaces with layers, poses and measurements, for scoring;
//! - [`folder::write_subject_folder`]: a subject as folders of images that `toile import` reads, with the truth;
//! - [`record::record_subject`]: a subject as a subject folder with recordings, and the truth under `truth/`.
//!
//! Room: +Y up, origin where the disk's axis meets its top, the camera on the +Z side. The subject's frame turns with
//! the disk and equals the room's at the first frame.

mod cut;
mod dirt;
pub mod dressing;
mod error;
mod field;
pub mod folder;
mod garment;
mod interference;
mod lens;
mod motion;
mod noise;
mod nuisances;
mod pattern;
mod person;
mod posture;
mod random;
pub mod record;
mod rig;
mod rig_settings;
pub mod room;
pub mod sensor;
mod settings;
mod subdivide;
mod subject;
mod surface;
mod surface_nets;
mod tailor;
mod tailoring;
mod take;
mod tape;
pub mod truth;
mod tubes;
mod turntable;
mod view;

pub use error::SyntheticError;
pub use garment::Garment;
pub use motion::Motion;
pub use nuisances::Nuisances;
pub use person::Person;
pub use rig_settings::{MAX_SENSORS, RigSettings};
pub use sensor::SensorPreset;
pub use settings::{GarmentKind, GarmentSettings, Pattern, Sex, SyntheticSettings};
pub use subject::Subject;
pub use surface::Surface;
pub use take::Take;
pub use tape::{Girth, Girths};
pub use turntable::{Bend, Moment};
