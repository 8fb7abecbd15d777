//! New garment or not: the label of every scan vertex.
//!
//! Each step is a function from labels to labels and leaves a [`Reason`](types::Reason) where it had the last word. The
//! first labels come from one energy ([`energy`]) over evidence, place on the body and colours ([`odds`]; [`bare`] where
//! nothing was scanned before), or from the nearest body vertex as in the seed ([`nearest_body`]). Patches that cloth worn before swung into or that were
//! uncovered are not new ([`swung`], [`uncovered`]); islands and patches that nobody saw are settled by their
//! surroundings ([`islands`], [`closed_patches`]).

mod bare;
pub(crate) mod closed_patches;
pub(crate) mod energy;
pub(crate) mod guess;
pub(crate) mod islands;
mod nearest_body;
pub(crate) mod odds;
mod swung;
pub mod template;
pub mod types;
mod uncovered;

use toile_character::GarmentType;

use self::{
    energy::Energy,
    nearest_body::label_by_nearest_body_vertex,
    odds::log_odds,
    swung::drop_swung,
    types::{Labels, Reason},
    uncovered::drop_uncovered,
};
use crate::{
    error::GarmentError,
    measure::Measured,
    settings::{ExtractSettings, Labelling},
};

/// First labels of a take.
pub(crate) struct Labelled {
    /// The known or guessed type.
    pub garment_type: GarmentType,
    pub labels: Labels,
    /// Area that looked new and was only uncovered, square metres.
    pub uncovered_m2: f32,
}

/// Labels a take by the way that the settings choose.
pub(crate) fn label(on: &Measured, settings: &ExtractSettings) -> Result<Labelled, GarmentError> {
    let mut found = match on.take.garment_type {
        Some(known) => label_by_evidence(on, known, None, settings),
        None => label_and_guess(on, settings),
    };
    if settings.labelling == Labelling::NearestBodyVertex {
        found.labels = label_by_nearest_body_vertex(on, found.garment_type)?;
    }
    Ok(found)
}

/// Labels without a template first, then with that of the type that these labels look like.
fn label_and_guess(on: &Measured, settings: &ExtractSettings) -> Labelled {
    let free = label_by_evidence(on, GarmentType::Other, None, settings);
    match guess::guess_type(on, &free.labels) {
        GarmentType::Other => free,
        guess => {
            let found = label_by_evidence(on, guess, Some(&free.labels), settings);
            Labelled { uncovered_m2: found.uncovered_m2.max(free.uncovered_m2), ..found }
        }
    }
}

/// Labels a take as a garment of a type. The colours of `earlier` labels are used from the first round on.
fn label_by_evidence(
    on: &Measured,
    garment_type: GarmentType,
    earlier: Option<&Labels>,
    settings: &ExtractSettings,
) -> Labelled {
    let energy = Energy::new(on, settings);
    let mut labels = energy.minimise(log_odds(on, garment_type, earlier), &[]);
    let mut settled = earlier.is_some_and(|before| before.garment == labels.garment);
    for _ in 1..settings.rounds.max(1) {
        if settled {
            break;
        }
        let next = energy.minimise(log_odds(on, garment_type, Some(&labels)), &[]);
        settled = next.garment == labels.garment;
        labels = next;
    }
    if on.take.is_first {
        return Labelled { garment_type, labels: bare::close_prints(labels, on), uncovered_m2: 0.0 };
    }
    let labels = drop_uncovered(labels, on);
    let uncovered_m2 = labels.area_of(Reason::Uncovered, &on.graph.areas);
    Labelled { garment_type, labels: drop_swung(labels, on), uncovered_m2 }
}
