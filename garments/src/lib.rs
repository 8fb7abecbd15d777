//! The next garment layer from the next scan: labels, cut, un-pose, stack without penetration.
//!
//! Input of one take: the new scan, the surface that was worn before (posed into it), and the body (posed into it).
//! [`extract()`] runs these steps:
//!
//! 1. `measure`: how far each scan vertex stands off what was worn before, how its colour differs, and where on the body
//!    it lies;
//! 2. `labels`: new garment or not, one energy over the scan's surface, minimised globally by a graph cut; cloth that only
//!    swung, or was uncovered, is not new; `hem` moves the border half-way up the step at each hem;
//! 3. `edits`: corrections by hand, applied to the labels each time;
//! 4. `mesh`: the garment's own mesh, cut through triangles along a smooth hem, islands dropped, holes closed;
//! 5. `skin`: weights from the body, un-posed into the body's pose (Hu et al. 2017, §6.3).
//!
//! [`stack()`] then puts every layer outside all layers below it (seed eq. 7 and better), verified with exact tests, and
//! [`carry_weights`] gives layers that lie close over one another like weights, and none that a stride tears. `worn` examines
//! the result: [`posed_report`] poses the layers, [`hidden_triangles`] finds triangles that are never in sight.
//!
//! [`follow()`] takes all of them along where the body's shape is changed; [`wear()`] brings a garment of one person onto another.
//!
//! The seed's own way stays selectable: [`Labelling::NearestBodyVertex`] and [`StackMethod::PushAlongNormal`].
//!
//! ```
//! use toile_garments::{ExtractSettings, GarmentType, Labelling};
//! assert_eq!("trousers".parse(), Ok(GarmentType::Trousers));
//! assert_eq!(ExtractSettings::default().labelling, Labelling::GraphCut);
//! ```

mod edits;
mod error;
mod extract;
mod follow;
mod generic;
mod hem;
mod labels;
mod measure;
mod mesh;
mod order;
mod report;
mod settings;
mod skin;
mod stack;
mod take;
mod wear;
mod worn;

pub use edits::{
    GROWTH,
    applied::WithoutEffect,
    format::{EditName, Edits, HemLine, Mark, Stroke, VERSION as EDITS_VERSION},
};
pub use error::GarmentError;
pub use extract::{Extraction, extract, find_cloth};
pub use follow::follow;
pub use generic::{Conformed, ConformedReport, Generic, GenericGarment, conform_generic, make_generic};
pub use labels::{
    template::cloth_thickness,
    types::{Labels, Reason},
};
pub use order::{Bulk, are_taken_off};
pub use report::{ExtractionReport, Warning};
pub use settings::{CullSettings, ExtractSettings, Labelling, StackMethod, StackSettings};
pub use skin::{common_frame::weights as weights_from_body, hanging::mark_free, layer_weights::carry_weights};
pub use stack::{
    Apart,
    press::{Part, PressReport, press_in},
    report::{GAP_BINS_MM, LayerReport, StackReport},
    stack,
};
pub use take::DressedTake;
pub use toile_character::{FREE_PART, GarmentType};
pub use wear::{Person, wear};
pub use worn::{
    hidden::hidden_triangles,
    posed::{PosedReport, TORN, Worn, posed_report},
};
