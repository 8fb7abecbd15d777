//! The body of somebody dressed takes on the skin that is bare, and stays inside the clothes where it is not.

use nalgebra::{Point3, UnitQuaternion};
use toile_character::BodyModel;
use toile_geometry::Mesh;

use super::{
    body::{BodyFit, at_rest, measured},
    evidence::{Coverage, Distances, samples},
    prepare::{Mend, prepare},
    verdict::SKIN_COVERED,
};
use crate::{
    FitSettings, FittingError,
    conform::{ScanLandmark, conform},
    solve::State,
    surface::trust_of,
    under::{Inside, contained},
};

/// Takes the bare skin of `scan`, from which the dressed body `fit` was estimated, onto that body: face, hair, hands and whatever
/// else `is_cloth` (an entry a vertex of the scan) leaves bare. What cloth covers keeps the shape of the model and is drawn
/// inside the cloth. Of the skin, only what is bare counts as seen. Same result for any number of threads.
///
/// # Errors
/// [`FittingError`] where the scan cannot be a person, `is_cloth` does not go with it, or the elastic system is singular.
pub fn take_on_bare_skin(
    model: &BodyModel,
    mut fit: BodyFit,
    scan: &Mesh,
    is_cloth: &[bool],
    settings: &FitSettings,
) -> Result<BodyFit, FittingError> {
    let scan = upright(scan, &fit.mend.rotation)?;
    if is_cloth.len() != scan.positions.len() {
        let (labels, vertices) = (is_cloth.len(), scan.positions.len());
        return Err(FittingError::Scan(format!("it has {vertices} vertices, but {labels} labels of cloth")));
    }
    let trust = trust_of(&scan);
    let bare: Vec<f32> = trust.iter().zip(is_cloth).map(|(t, cloth)| if *cloth { 0.0 } else { *t }).collect();
    let state = State { pose: fit.pose.clone(), beta: fit.beta.clone() };
    let inside = Inside::new(&scan);
    let as_undressed = FitSettings { dressed: false, ..settings.clone() };
    let points = conform(model, &state, &scan, inside.bvh(), &bare, &as_undressed, &fit.landmarks)?;
    let drawn_in = contained(model, &points, (&scan, &trust), &inside);
    let points = kept_by_hand(model, &fit.landmarks, &points, drawn_in);
    fit.body = at_rest(model, &state, &points);
    fit.measurements = measured(model, &fit.body, &fit.pose);
    fit.seen = Coverage::new(model, &points, &scan, &bare, SKIN_COVERED).seen;
    fit.report.scan_to_body = Distances::new(&samples(&scan, &bare), &points, model).stats();
    Ok(fit)
}

/// Reach of a landmark that was set by hand over the skin around it, metres.
const BY_HAND: f32 = 0.03;

/// The points that were `drawn_in` by the clothes, but for what lies around landmarks set by hand: there as they were `before`.
fn kept_by_hand(
    model: &BodyModel,
    landmarks: &[ScanLandmark],
    before: &[Point3<f32>],
    mut drawn_in: Vec<Point3<f32>>,
) -> Vec<Point3<f32>> {
    for landmark in landmarks.iter().filter(|l| l.by_hand) {
        let Some(center) = model.landmark(&landmark.name).map(|v| before[v as usize]) else { continue };
        for (p, before) in drawn_in.iter_mut().zip(before) {
            let kept = (1.0 - (before - center).norm() / BY_HAND).max(0.0);
            *p += (before - *p) * kept;
        }
    }
    drawn_in
}

/// The scan as it was fitted: outward, turned by `rotation`.
fn upright(scan: &Mesh, rotation: &UnitQuaternion<f64>) -> Result<Mesh, FittingError> {
    let prepared = prepare(scan)?;
    Ok(Mend { scale: 1.0, rotation: *rotation }.apply(&prepared.mesh))
}
