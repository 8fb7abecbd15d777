//! Landmarks on the scan: set by hand, or found by sliding each landmark's surroundings on the fitted body over the scan.

use nalgebra::{Matrix6, Point3, Rotation3, Vector3, Vector6};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, Region, SkinWeights};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

use crate::{
    FitSettings, FittingError, HandLandmarks,
    solve::State,
    surface::{Contact, ScanSurface},
};

/// Radius of the surroundings that are slid over the scan, metres.
const PATCH: f32 = 0.045;
/// Scan farther than this from the body is not compared with a landmark's surroundings, metres.
const REACH: f32 = 0.025;
/// Smallest cosine between the normals of body and scan.
const MIN_COS: f32 = 0.5;
/// Standard deviations of a scan point (metres), of how far a landmark slides (metres), and of how far its surroundings
/// turn (radians).
const NOISE: f64 = 0.002;
const SLIDE: f64 = 0.002;
const TURN: f64 = 0.08;
/// Number of independent measurements that one patch stands for.
const INDEPENDENT: f64 = 10.0;
/// Gauss–Newton steps.
const STEPS: usize = 4;
/// Scale of the robust kernel, as a share of [`REACH`].
const KERNEL: f64 = 0.2;
/// Share of the surroundings that must have been seen.
const SEEN_SHARE: f64 = 0.3;
/// A landmark that slid farther than this was not found, metres.
const FARTHEST: f64 = 0.012;
/// Farthest from the scan that a landmark may be set, metres: on skin, and under clothes.
const OFF_SCAN: f32 = 0.03;
const UNDER_CLOTHES: f32 = 0.15;
/// Largest number of points of a patch.
const PATCH_POINTS: usize = 120;

/// Where a landmark lies on the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanLandmark {
    /// The template's name, such as `navel`.
    pub name: String,
    /// Metres, in the (mended) scan's frame.
    pub position: [f64; 3],
    /// How much of its surroundings was seen, 0–1; 1 where it was set by hand.
    pub seen: f64,
    /// Distance from the landmark of the statistical model, millimetres.
    pub moved_mm: f64,
    /// Set by hand.
    pub by_hand: bool,
}

/// All landmarks of the model on the scan; those that the scan does not show have `seen` 0 and stay on the model.
pub(crate) fn landmarks(
    model: &BodyModel,
    state: &State,
    scan: &Mesh,
    bvh: &Bvh,
    trust: &[f32],
    by_hand: &HandLandmarks,
) -> Vec<ScanLandmark> {
    let surface = ScanSurface::new(scan, trust, bvh);
    let posed = &model.posed(&state.beta, &state.pose);
    let normals = vertex_normals(posed, &model.triangles);
    let one = |(name, vertex): &(String, u32)| {
        let from = posed[*vertex as usize];
        let (position, seen) = match by_hand.get(name) {
            Some(set) => (Point3::from(*set), 1.0),
            // Fingers melt together in a scan: the model's own are nearer to the truth.
            None if is_hand(model.regions[*vertex as usize]) => (from.cast(), 0.0),
            None => slide(&surface, bvh, &patch(model, posed, &normals, *vertex), &from),
        };
        let moved_mm = 1e3 * (position - from.cast::<f64>()).norm();
        let by_hand = by_hand.contains_key(name);
        ScanLandmark { name: name.clone(), position: position.into(), seen, moved_mm, by_hand }
    };
    model.landmarks.par_iter().map(one).collect()
}

/// The landmarks set by hand, times `scale`: those of the scan that was brought to metres, which is `scan`.
///
/// # Errors
/// [`FittingError::Setting`] names a landmark that the model does not have, one that is not finite, or one far off the scan.
pub(crate) fn set_by_hand(
    model: &BodyModel,
    settings: &FitSettings,
    scale: f64,
    scan: &Mesh,
) -> Result<HandLandmarks, FittingError> {
    if settings.landmarks.is_empty() {
        return Ok(HandLandmarks::new());
    }
    let bvh = Bvh::new(&scan.positions, &scan.triangles);
    let farthest = if settings.dressed { UNDER_CLOTHES } else { OFF_SCAN };
    let bad = |reason| FittingError::Setting { name: "landmarks", reason };
    let one = |(name, p): (&String, &[f64; 3])| {
        if model.landmark(name).is_none() {
            let known: Vec<&str> = model.landmarks.iter().map(|l| l.0.as_str()).collect();
            return Err(bad(format!("there is no landmark {name}; the landmarks are {}", known.join(", "))));
        }
        if !p.iter().all(|x| x.is_finite()) {
            return Err(bad(format!("{name} is not finite: give three numbers")));
        }
        let point = Point3::from(*p) * scale;
        if bvh.closest(&point.cast(), farthest).is_none() {
            let limit = 1e3 * farthest;
            return Err(bad(format!(
                "{name} is more than {limit:.0} mm from the scan: is it in the scan's own frame?"
            )));
        }
        Ok((name.clone(), point.into()))
    };
    settings.landmarks.iter().map(one).collect()
}

fn is_hand(region: Region) -> bool {
    matches!(region, Region::LeftHand | Region::RightHand)
}

/// Points and normals of the body around a vertex, on the same side.
fn patch(
    model: &BodyModel,
    posed: &[Point3<f32>],
    normals: &[Vector3<f32>],
    vertex: u32,
) -> Vec<(Point3<f32>, Vector3<f32>)> {
    let v = vertex as usize;
    let joined = |w: usize| main(&model.weights, w) == main(&model.weights, v) || normals[w].dot(&normals[v]) > 0.0;
    let near = |w: &usize| !model.inner[*w] && (posed[*w] - posed[v]).norm_squared() < PATCH * PATCH && joined(*w);
    let all: Vec<usize> = (0..posed.len()).filter(near).collect();
    let stride = all.len().div_ceil(PATCH_POINTS).max(1);
    all.into_iter().step_by(stride).map(|w| (posed[w], normals[w])).collect()
}

fn main(weights: &SkinWeights, v: usize) -> u8 {
    weights.joints[v][0]
}

/// Slides the patch over the scan by Gauss–Newton steps of a small rigid motion about `center`; where the centre then
/// lies on the scan, and how much of the patch was seen (0: not found).
fn slide(
    surface: &ScanSurface,
    bvh: &Bvh,
    patch: &[(Point3<f32>, Vector3<f32>)],
    center: &Point3<f32>,
) -> (Point3<f64>, f64) {
    let center: Point3<f64> = center.cast();
    let (mut turn, mut shift) = (Rotation3::identity(), Vector3::zeros());
    let mut seen = 0.0;
    for _ in 0..STEPS {
        let moved = |p: &Point3<f32>| center + turn * (p.cast::<f64>() - center) + shift;
        let pairs: Vec<Pair> =
            patch.iter().filter_map(|(p, n)| Pair::new(surface, moved(p), &(turn.cast::<f32>() * n))).collect();
        seen = pairs.iter().map(|p| p.trust).sum::<f64>() / patch.len().max(1) as f64;
        let Some(step) = step(&pairs, &(center + shift), &turn, &shift, patch.len()) else { break };
        shift += step.fixed_rows::<3>(0);
        turn = Rotation3::new(step.fixed_rows::<3>(3).into_owned()) * turn;
    }
    let there = center + shift;
    let hit = bvh.closest(&there.cast(), REACH).filter(|_| seen > SEEN_SHARE && shift.norm() < FARTHEST);
    hit.map_or((center, 0.0), |h| (h.point.cast(), seen.min(1.0)))
}

/// A point of the patch and the nearest scan point.
struct Pair {
    point: Point3<f64>,
    on_scan: Point3<f64>,
    normal: Vector3<f64>,
    trust: f64,
}

impl Pair {
    fn new(surface: &ScanSurface, point: Point3<f64>, n: &Vector3<f32>) -> Option<Self> {
        let Contact { point: on_scan, normal, trust, .. } = surface.nearest(&point.cast(), n, REACH, MIN_COS)?;
        Some(Self { point, on_scan: on_scan.cast(), normal: normal.cast(), trust: f64::from(trust) })
    }
}

fn step(
    pairs: &[Pair],
    center: &Point3<f64>,
    turn: &Rotation3<f64>,
    shift: &Vector3<f64>,
    count: usize,
) -> Option<Vector6<f64>> {
    let weight = INDEPENDENT / (count.max(1) as f64 * NOISE * NOISE);
    let (mut h, mut g) = (Matrix6::zeros(), Vector6::zeros());
    for Pair { point, on_scan, normal: n, trust } in pairs {
        let lever = (point - center).cross(n);
        let row = Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z);
        let value = n.dot(&(point - on_scan));
        let kernel = f64::from(REACH) * KERNEL;
        let robust = kernel.powi(2) / (kernel.powi(2) + value * value);
        let w = weight * trust * robust * robust;
        h += row * row.transpose() * w;
        g += row * (w * value);
    }
    let turned = turn.scaled_axis();
    for k in 0..3 {
        h[(k, k)] += SLIDE.powi(-2);
        g[k] += shift[k] * SLIDE.powi(-2);
        h[(k + 3, k + 3)] += TURN.powi(-2);
        g[k + 3] += turned[k] * TURN.powi(-2);
    }
    Some(h.cholesky()?.solve(&-g))
}
