//! The body takes on the scan's own surface: local deformation to the closest compatible points under an elastic
//! energy (the conformation of the V-Man project, §2.1.2; the mass–spring relaxation is replaced by one sparse solve).
//! Landmarks that were set by hand carry the body along first (see [`super::radial_basis`]).
//!
//! Minimised over the displacement d of all vertices, with vertex areas M and the cotangent Laplacian C:
//! Σ Mᵢ wᵢ |dᵢ − δᵢ|² + (C ℓ² d)ᵀ M⁻¹ (C ℓ² d) + m² dᵀ C d + ε dᵀ M d. Details finer than about six times ℓ are left
//! out (bending); over holes the displacement of the rim is carried on without its slope (membrane, m).

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

use super::{
    elastic::{Elastic, Pull},
    floor::{draw_up, floor_of, press_flat},
    folds::{release_folds, unfolded},
    landmarks::ScanLandmark,
    radial_basis::mapped,
    segments::Segments,
    uncross::uncrossed,
};
use crate::{
    ConformSettings, FitSettings, FittingError,
    solve::State,
    surface::{Contact, ScanSurface},
};

/// Pull of a landmark that was set by hand, against 1 of a scan point: the body passes within a millimetre of it.
const ANCHOR: f64 = 300.0;
/// Smallest trust of a scan point that a vertex follows: what fusion closed was not seen.
const SEEN: f32 = 0.1;
/// How far hands follow the scan: fingers melt together in it, so that the model's own are nearer to the truth.
const HAND_FREEDOM: f64 = 0.01;
/// Lips and toes are folded finer than a scan shows: there the normals may differ by this share of the usual cosine.
const FOLDED: f64 = 0.5;

/// The template's vertices moved from the posed model onto the scan, in the scan's pose; soles stay above the floor that
/// it stands on.
///
/// # Errors
/// [`FittingError::Singular`] where the elastic system cannot be factorised.
pub(crate) fn conform(
    model: &BodyModel,
    state: &State,
    scan: &Mesh,
    bvh: &Bvh,
    trust: &[f32],
    settings: &FitSettings,
    landmarks: &[ScanLandmark],
) -> Result<Vec<Point3<f32>>, FittingError> {
    let posed = model.posed(&state.beta, &state.pose);
    let rest = model.shape(&state.beta);
    let start = mapped(model, &rest, &posed, landmarks, settings.conformation.map);
    if !settings.conform || settings.dressed {
        return Ok(start);
    }
    let anchors = anchors(model, landmarks);
    let surface = ScanSurface::new(scan, trust, bvh);
    let segments = Segments::new(model, &rest, &start);
    let elastic = Elastic::new(model, &start, &settings.conformation)?;
    let floor = floor_of(scan);
    let mut freedom = freedom(model);
    let mut points = start.clone();
    for _ in 0..settings.conformation.rounds {
        let mut pulls = pulls(model, &points, &freedom, &surface, &segments, &settings.conformation);
        if let Some(floor) = floor {
            draw_up(model, &points, floor, &mut pulls);
        }
        for &(v, target) in &anchors {
            pulls[v] = Pull { target, weight: ANCHOR };
        }
        points = elastic.solve(&start, &pulls)?;
        release_folds(model, &start, &points, &mut freedom);
    }
    if let Some(floor) = floor {
        press_flat(model, &mut points, floor);
    }
    let points = unfolded(model, &posed, points);
    Ok(uncrossed(&model.triangles, &posed, points))
}

/// Vertices of the landmarks that were set by hand and where they belong.
fn anchors(model: &BodyModel, landmarks: &[ScanLandmark]) -> Vec<(usize, Point3<f32>)> {
    let set = landmarks.iter().filter(|l| l.by_hand);
    set.filter_map(|l| Some((model.landmark(&l.name)? as usize, Point3::from(l.position).cast()))).collect()
}

/// How far each vertex follows the scan, 0 to 1: pockets are not seen, hands poorly.
fn freedom(model: &BodyModel) -> Vec<f64> {
    let of = |v: usize| match model.regions[v] {
        _ if model.inner[v] => 0.0,
        Region::LeftHand | Region::RightHand => HAND_FREEDOM,
        _ => 1.0,
    };
    (0..model.mean.len()).map(of).collect()
}

/// Where the scan draws each vertex.
fn pulls(
    model: &BodyModel,
    points: &[Point3<f32>],
    freedom: &[f64],
    surface: &ScanSurface,
    segments: &Segments,
    settings: &ConformSettings,
) -> Vec<Pull> {
    let normals = vertex_normals(points, &model.triangles);
    let pull = |v: usize| {
        let min_cos = min_cos(model.regions[v], settings);
        let is_own = |c: &Contact| segments.joins(v, &c.point, &c.normal, settings.reach);
        pull(surface, &points[v], &normals[v], min_cos, is_own, settings.reach)
            .map_or(Pull { target: points[v], weight: 0.0 }, |p| Pull { weight: p.weight * freedom[v], ..p })
    };
    (0..points.len()).into_par_iter().with_min_len(128).map(pull).collect()
}

fn min_cos(region: Region, settings: &ConformSettings) -> f32 {
    let is_folded = matches!(region, Region::Head | Region::LeftFoot | Region::RightFoot);
    (if is_folded { FOLDED * settings.min_cos } else { settings.min_cos }) as f32
}

/// Where the scan draws a vertex at `p` with normal `n`, if there is scan near that `is_own`, a part of the same limb.
fn pull(
    surface: &ScanSurface,
    p: &Point3<f32>,
    n: &Vector3<f32>,
    min_cos: f32,
    is_own: impl Fn(&Contact) -> bool,
    reach: f64,
) -> Option<Pull> {
    let contact = surface.nearest(p, n, reach as f32, min_cos)?;
    if contact.is_rim(n) || contact.trust < SEEN || !is_own(&contact) {
        return None;
    }
    let near = 1.0 - (f64::from(contact.distance) / reach).powi(2);
    Some(Pull { target: contact.point, weight: f64::from(contact.trust).powi(2) * near.max(0.0) })
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use toile_character::{Joint, Pose};

    use super::*;

    #[test]
    fn an_arm_pressed_into_the_trunk_does_not_follow_it() {
        let model = BodyModel::load_default().unwrap();
        let lowered = |angle: f64| {
            let mut pose = Pose::identity();
            *pose.rotation_mut(Joint::LeftUpperArm) = UnitQuaternion::from_scaled_axis(Vector3::z() * -angle);
            model.posed(&[], &pose)
        };
        let rest = model.shape(&[]);
        let is_arm = |v: &usize| (7..=9).contains(&model.weights.joints[*v][0]);
        let settings = ConformSettings::default();
        let trust = vec![1.0; rest.len()];
        let mut astray = [0, 0];
        for angle in [0.6, 0.7, 0.8] {
            // The fitted arm hangs nearer to the trunk than the scan's, or in it.
            let (scan, start) = (Mesh::new(lowered(angle), model.triangles.clone()), lowered(angle + 0.08));
            let bvh = Bvh::new(&scan.positions, &scan.triangles);
            let surface = ScanSurface::new(&scan, &trust, &bvh);
            let segments = Segments::new(&model, &rest, &start);
            let normals = vertex_normals(&start, &model.triangles);
            for v in (0..rest.len()).filter(is_arm) {
                for (count, is_segmented) in astray.iter_mut().zip([false, true]) {
                    let joins = |c: &Contact| segments.joins(v, &c.point, &c.normal, settings.reach);
                    let is_own = |c: &Contact| !is_segmented || joins(c);
                    let Some(pull) = pull(&surface, &start[v], &normals[v], 0.6, is_own, settings.reach) else {
                        continue;
                    };
                    // Where the scan's own arm touches the trunk they cannot be distinguished.
                    let own = (0..rest.len()).filter(|u| (rest[*u] - rest[v]).norm() < 0.15);
                    let is_other = own.map(|u| (scan.positions[u] - pull.target).norm()).all(|d| d > 0.01);
                    *count += usize::from(pull.weight > 0.0 && is_other);
                }
            }
        }
        // What is left: some of the fitted arm is itself nearest to the trunk.
        assert!(astray[0] > 20 && astray[1] <= 3, "{astray:?} vertices of the arm follow the trunk");
    }
}
