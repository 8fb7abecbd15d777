//! One take's garment, from the scan to the common frame.

use toile_character::{FREE_PART, GarmentType, SkinWeights};
use toile_geometry::Mesh;

use crate::{
    edits,
    error::GarmentError,
    hem::lower_hems,
    labels::{
        self, Labelled, closed_patches::settle_closed_patches, guess::looks_like_two, islands::drop_islands,
        types::Labels,
    },
    measure::Measured,
    mesh::garment_mesh,
    report::{ExtractionReport, Warning, warnings},
    settings::{ExtractSettings, Labelling},
    skin::{common_frame, hanging::mark_free},
    take::DressedTake,
};

/// A take's garment and how it was found.
#[derive(Debug, Clone)]
pub struct Extraction {
    /// Labels of the scan's vertices.
    pub labels: Labels,
    /// The garment in the take's pose and frame; attributes `confidence`, `filled`, and for skirts and dresses
    /// [`FREE_PART`]. Empty where nothing new was found.
    pub in_take: Mesh,
    /// The same vertices in the common frame: take 0's pose.
    pub garment: Mesh,
    /// Skin weights of the garment's vertices.
    pub weights: SkinWeights,
    /// The decisions.
    pub report: ExtractionReport,
    /// Warnings.
    pub warnings: Vec<Warning>,
}

/// Finds the new garment of a take, cuts it out and brings it to the common frame.
///
/// # Errors
/// [`GarmentError`] where a mesh is empty, broken, or does not go with its weights; where edits cannot be used; and where
/// a setting is outside of its range or asks for a template that the garment's type does not have. A take without a new garment is a result with
/// [`Warning::NothingNew`] and empty meshes.
pub fn extract(
    take: &DressedTake,
    settings: &ExtractSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Extraction, GarmentError> {
    settings.check()?;
    take.check()?;
    let on = Measured::new(take, settings);
    progress(0.3);
    let Labelled { garment_type, labels, uncovered_m2 } = labels::label(&on, settings)?;
    let labels = settle(labels, &on, garment_type, settings);
    let pieces = on.graph.components(|v| labels.garment[v]).1.len();
    let is_two = looks_like_two(&on, &labels);
    progress(0.6);
    let (labels, edited) = match take.edits {
        Some(edits) => {
            let (labels, applied) = edits::apply(labels, edits, &on, settings);
            (labels, Some(applied))
        }
        None => (labels, None),
    };
    let mut in_take = garment_mesh(&labels, &on, garment_type, edited.as_ref(), settings);
    if matches!(garment_type, GarmentType::Skirt | GarmentType::Dress) && !in_take.is_empty() {
        in_take.attributes.insert(FREE_PART.into(), mark_free(take.body, &in_take));
    }
    progress(0.8);
    let weights = common_frame::weights(take, &in_take, settings);
    let garment = common_frame::to_common_frame(take, &in_take, &weights);
    let warnings = warnings(&on, &labels, &in_take, uncovered_m2, is_two, edited.as_ref());
    let report = ExtractionReport::new(&on, &labels, &in_take, garment_type, pieces, edited.as_ref());
    progress(1.0);
    Ok(Extraction { labels, in_take, garment, weights, report, warnings })
}

/// Of each vertex of a dressed take's scan, whether it is cloth; the rest is skin and hair. Made for takes that no undressed one
/// came before ([`DressedTake::is_first`]).
///
/// # Errors
/// As [`extract`].
pub fn find_cloth(take: &DressedTake, settings: &ExtractSettings) -> Result<Vec<bool>, GarmentError> {
    settings.check()?;
    take.check()?;
    let on = Measured::new(take, settings);
    let Labelled { garment_type, labels, .. } = labels::label(&on, settings)?;
    Ok(settle(labels, &on, garment_type, settings).garment)
}

/// The labels with islands, closed patches and hems settled. Those of a template stay as they are: the seed corrects
/// them by hand.
fn settle(labels: Labels, on: &Measured, garment_type: GarmentType, settings: &ExtractSettings) -> Labels {
    if settings.labelling == Labelling::NearestBodyVertex {
        return labels;
    }
    let labels = drop_islands(labels, &on.graph, settings);
    let labels = settle_closed_patches(labels, on);
    let labels = lower_hems(labels, on, garment_type, settings);
    let labels = settle_closed_patches(labels, on);
    drop_islands(labels, &on.graph, settings)
}
