//! The effect of edits on a scan's labels.

use serde::Serialize;

use super::format::{EditName, Mark};

/// The effect of edits on a scan's labels, as the garment's mesh needs it.
#[derive(Debug, Clone)]
pub struct Applied {
    /// True for vertices whose labels an edit may have changed.
    pub near: Vec<bool>,
    /// The statement of the last stroke that touches a vertex.
    pub painted: Vec<Option<Mark>>,
    /// Signed distance from a hem line, metres, positive on the garment's side; `None` away from hem lines.
    pub hem_distance: Vec<Option<f32>>,
    /// Area whose label changed, square metres.
    pub changed_m2: f32,
    /// Edits that could not do anything.
    pub without_effect: Vec<WithoutEffect>,
}

/// An edit that could not do anything.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WithoutEffect {
    /// The stroke or hem line.
    pub edit: EditName,
    /// Distance from what it could have changed, metres: of a stroke from the scan's vertices, of a hem line from the
    /// garment's hem; infinite where there is none.
    pub distance_m: f32,
    /// Its radius or reach, metres.
    pub radius_m: f32,
}

impl Applied {
    pub(super) fn new(count: usize) -> Self {
        Self {
            near: vec![false; count],
            painted: vec![None; count],
            hem_distance: vec![None; count],
            changed_m2: 0.0,
            without_effect: Vec::new(),
        }
    }
}

impl std::fmt::Display for WithoutEffect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (edit, far, radius) = (self.edit, 1e3 * self.distance_m, 1e3 * self.radius_m);
        match edit {
            EditName::Stroke(_) => write!(
                f,
                "{edit} has no effect: it touches nothing; the nearest vertex of the scan is {far:.0} mm from it, its \
                 radius is {radius:.0} mm"
            ),
            EditName::HemLine(_) if far.is_infinite() => {
                write!(f, "{edit} has no effect: no garment was found whose hem it could move")
            }
            EditName::HemLine(_) => write!(
                f,
                "{edit} has no effect: no hem of the garment lies beside it within its reach of {radius:.0} mm; the \
                 nearest is {far:.0} mm away; draw the line nearer, give it a longer reach, or use strokes"
            ),
        }
    }
}
