//! Bodies of implicit primitives: metaballs on a skeleton, contours around it, a closed skin (Thalmann, Shen and Chauvineau's "Body
//! Builder", here called paper 002).
//!
//! - [`ImplicitBody`]: ellipsoidal [`Primitive`]s, each on its joint, in one or several of fifteen [`Group`]s (§1, §3.1);
//! - [`format`](mod@format): the same as TOML; [`Deform`]: primitives that follow a joint, as muscles do (§3.2);
//! - [`Field`]: their sum in a pose, and where rays leave it (§1, §2);
//! - [`plan`]: which rays are cast from the links, driven by joint angles ([`bones`]) or by rims ([`boundary`]; §2.1, §2.2);
//! - [`Envelope`]: contours, the B-spline skin over them ([`spline`]), head, hands and feet stitched to it (§3); [`Level`]s of detail (§4.3);
//! - [`RealTime`]: contours deformed directly, for crowds (§4); [`Scaling`]: other sizes and proportions (§5); [`Edit`]: changes by hand;
//! - [`fit`](mod@fit): primitives fitted to a person's body by themselves.
//!
//! ```no_run
//! use toile_character::{BodyModel, Pose};
//! use toile_implicit::{Envelope, LEVELS, fit};
//!
//! let model = BodyModel::load_default()?;
//! let person = model.skinned(&[0.5]);
//! let fitted = fit::fit(&model, &person, &[0.5], "anna", &[], &fit::FitSettings::default())?;
//! let envelope = Envelope::new(&model, &fitted.body, LEVELS[0])?;
//! let surface = envelope.sample(&fitted.body, &Pose::identity());
//! assert_eq!(surface.missed, 0);
//! # Ok::<(), toile_implicit::ImplicitError>(())
//! ```

pub mod body;
pub mod bones;
pub mod boundary;
pub mod contours;
mod deform;
mod edit;
mod envelope;
mod error;
pub mod extremities;
mod field;
mod field_function;
pub mod fit;
pub mod format;
mod group;
mod level;
mod muscles;
pub mod plan;
mod primitive;
mod real_time;
mod scaling;
pub mod spline;
mod state;
pub mod stitch;
mod surface;
pub mod target;

pub use body::ImplicitBody;
pub use deform::{Blending, Deform};
pub use edit::Edit;
pub use envelope::{Envelope, Sampled};
pub use error::ImplicitError;
pub use field::Field;
pub use field_function::{FieldFunction, THRESHOLD};
pub use group::{Group, Groups};
pub use level::{LEVELS, Level};
pub use primitive::{Kind, Primitive};
pub use real_time::{Deformed, RealTime};
pub use scaling::{Dimensions, Scaling};
pub use state::State;
pub use surface::{Ray, Surface};
