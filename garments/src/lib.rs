//! The next garment layer from the next scan: labels, cut, un-pose, stack without penetration.
//!
//! Input of one take: the new scan, what was worn before (posed into it), and the body (posed into it). The way:
//!
//! 1. [`evidence`]: how far each scan vertex stands off what was worn before, how its colour differs, and where on
//!    the body it lies;
//! 2. [`labels`]: new garment or not, one energy over the scan's surface, minimised globally by a graph cut;
//!    What only swung, or was uncovered, is not ([`not_new`]);
//! 3. [`hem`], [`cut`], [`clean`] and [`rim`]: the garment's own mesh, cut through triangles along a smooth hem, islands dropped, holes
//!    closed;
//! 4. [`common_frame`]: weights from the body, un-posed into the body's pose (Hu et al. 2017, §6.3);
//! 5. [`mod@stack`]: every layer outside all layers below it (seed eq. 7 and better), verified with exact tests;
//! 6. [`mod@limit_stretch`] and [`layer_weights`]: cloth that no stride tears, and layers close over one another move
//!    alike; [`posed`] tells what they do in other poses;
//! 7. [`hidden`]: what of the body and of lower layers is never in sight, for exports that leave it out.
//!
//! [`edits`] are corrections by hand, applied to the labels each time.
//!
//! [`extract`](extract::extract) runs 1 to 4 for one take; [`stack`](stack::stack) runs 5 and
//! [`carry_weights`] 6 over all layers.
//!
//! ```
//! use toile_garments::GarmentType;
//! assert_eq!("trousers".parse(), Ok(GarmentType::Trousers));
//! ```

pub mod body_parts;
pub mod clean;
pub mod color;
pub mod common_frame;
pub mod contacts;
pub mod cut;
pub mod cut_rest;
pub mod edits;
pub mod error;
pub mod evidence;
pub mod extract;
pub mod fair;
mod garment_mesh;
pub mod garment_type;
mod guess;
pub mod hanging;
pub mod hem;
pub mod hidden;
pub mod labels;
pub mod layer_weights;
pub mod limit_stretch;
pub mod not_new;
pub mod pile;
pub mod posed;
pub mod push;
pub mod region;
pub mod rim;
pub mod scan_graph;
pub mod settings;
pub mod stack;
pub mod stack_report;
pub mod surface_solve;
pub mod untangle;
pub mod worn_surface;

pub use edits::Edits;
pub use error::GarmentError;
pub use extract::{Extraction, Take, Warning, extract};
pub use garment_type::GarmentType;
pub use hidden::hidden_triangles;
pub use layer_weights::carry_weights;
pub use limit_stretch::limit_stretch;
pub use posed::{PosedReport, Worn, posed_report};
pub use settings::{CullSettings, ExtractSettings, StackSettings};
pub use stack::stack;
pub use stack_report::{GAP_BINS_MM, LayerReport, StackReport};
