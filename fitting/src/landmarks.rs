//! Landmarks on the scan: found by sliding each landmark's surroundings on the fitted body over the scan, or set by hand.

use nalgebra::{Matrix6, Point3, Rotation3, Vector3, Vector6};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, Region, SkinWeights};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

use crate::{FitSettings, FittingError, Mend, settings::HandLandmarks};

/// Radius of the surroundings that are slid over the scan, metres.
const PATCH: f32 = 0.045;
/// Scan farther than this from the body says nothing of a landmark, metres.
const REACH: f32 = 0.025;
/// Least cosine between the normals of body and scan.
const MIN_COS: f32 = 0.5;
/// Standard deviations: of a scan point, and how far a landmark may slide (metres) and its surroundings turn (radians).
const NOISE: f64 = 0.002;
const SLIDE: f64 = 0.002;
const TURN: f64 = 0.08;
/// How many independent measurements one patch stands for.
const INDEPENDENT: f64 = 10.0;
const STEPS: usize = 4;
/// A landmark that slid farther than this was not found, metres.
const FARTHEST: f64 = 0.012;
/// Farthest from the scan that a landmark may be set, metres: on skin, and under clothes.
const OFF_SCAN: f32 = 0.03;
const UNDER_CLOTHES: f32 = 0.15;
/// Most points of a patch.
const MOST: usize = 120;

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
    posed: &[Point3<f32>],
    scan: &Mesh,
    bvh: &Bvh,
    trust: &[f32],
    by_hand: &HandLandmarks,
) -> Vec<ScanLandmark> {
    let surface = Surface { scan, trust, bvh };
    let normals = vertex_normals(posed, &model.triangles);
    let one = |(name, vertex): &(String, u32)| {
        let from = posed[*vertex as usize];
        let (position, seen) = match by_hand.get(name) {
            Some(set) => (Point3::from(*set), 1.0),
            // fingers melt together in a scan: the model's are nearer
            None if is_hand(model.regions[*vertex as usize]) => (from.cast(), 0.0),
            None => surface.slide(&patch(model, posed, &normals, *vertex), &from),
        };
        let moved_mm = 1e3 * (position - from.cast::<f64>()).norm();
        let by_hand = by_hand.contains_key(name);
        ScanLandmark { name: name.clone(), position: position.into(), seen, moved_mm, by_hand }
    };
    model.landmarks.par_iter().map(one).collect()
}

/// The landmarks set by hand, brought to the frame of the mended scan, whose triangles `bvh` has.
///
/// # Errors
/// [`FittingError::Setting`] names a landmark that the model does not have, one that is no point, or one far off the scan.
pub(crate) fn mended(
    model: &BodyModel,
    settings: &FitSettings,
    mend: &Mend,
    bvh: &Bvh,
) -> Result<HandLandmarks, FittingError> {
    let farthest = if settings.dressed { UNDER_CLOTHES } else { OFF_SCAN };
    let bad = |reason| FittingError::Setting { name: "landmarks", reason };
    let one = |(name, p): (&String, &[f64; 3])| {
        if model.landmark(name).is_none() {
            let known: Vec<&str> = model.landmarks.iter().map(|l| l.0.as_str()).collect();
            return Err(bad(format!("there is no {name}; there are {}", known.join(", "))));
        }
        if !p.iter().all(|x| x.is_finite()) {
            return Err(bad(format!("{name} is not finite")));
        }
        let point = mend.rotation * (Point3::from(*p) * mend.scale);
        if bvh.closest(&point.cast(), farthest).is_none() {
            let limit = 1e3 * farthest;
            return Err(bad(format!(
                "{name} is more than {limit:.0} mm from the scan; is it in the scan's own frame?"
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
    let stride = all.len().div_ceil(MOST).max(1);
    all.into_iter().step_by(stride).map(|w| (posed[w], normals[w])).collect()
}

fn main(weights: &SkinWeights, v: usize) -> u8 {
    weights.joints[v][0]
}

struct Surface<'a> {
    scan: &'a Mesh,
    trust: &'a [f32],
    bvh: &'a Bvh,
}

/// A patch point, its nearest scan point with normal, and how far that is trusted.
type Pair = (Point3<f64>, Point3<f64>, Vector3<f64>, f64);

impl Surface<'_> {
    /// Slides the patch over the scan by Gauss–Newton steps of a small rigid motion about `center`; where the centre
    /// then lies on the scan, and how much of the patch was seen.
    fn slide(&self, patch: &[(Point3<f32>, Vector3<f32>)], center: &Point3<f32>) -> (Point3<f64>, f64) {
        let center: Point3<f64> = center.cast();
        let (mut turn, mut shift) = (Rotation3::identity(), Vector3::zeros());
        let mut seen = 0.0;
        for _ in 0..STEPS {
            let moved = |p: &Point3<f32>| center + turn * (p.cast::<f64>() - center) + shift;
            let pairs: Vec<Pair> =
                patch.iter().filter_map(|(p, n)| self.pair(&moved(p), &(turn.cast::<f32>() * n))).collect();
            seen = pairs.iter().map(|p| p.3).sum::<f64>() / patch.len().max(1) as f64;
            let Some(step) = step(&pairs, &(center + shift), &turn, &shift, patch.len()) else { break };
            shift += step.fixed_rows::<3>(0);
            turn = Rotation3::new(step.fixed_rows::<3>(3).into_owned()) * turn;
        }
        let there = center + shift;
        let hit = self.bvh.closest(&there.cast(), REACH).filter(|_| seen > 0.3 && shift.norm() < FARTHEST);
        hit.map_or((center, 0.0), |h| (h.point.cast(), seen.min(1.0)))
    }

    fn pair(&self, p: &Point3<f64>, n: &Vector3<f32>) -> Option<Pair> {
        let fits = |t: u32| self.normal(t).dot(n) > MIN_COS;
        let hit = self.bvh.closest_where(&p.cast(), REACH, fits)?;
        let corners = self.scan.triangles[hit.triangle as usize];
        let trust: f32 = (0..3).map(|k| self.trust[corners[k] as usize] * hit.barycentric[k]).sum();
        Some((*p, hit.point.cast(), self.normal(hit.triangle).cast(), f64::from(trust)))
    }

    fn normal(&self, t: u32) -> Vector3<f32> {
        let [a, b, c] = self.scan.corners(t as usize);
        (b - a).cross(&(c - a)).try_normalize(1e-20).unwrap_or_default()
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
    for (p, q, n, trust) in pairs {
        let lever = (p - center).cross(n);
        let row = Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z);
        let value = n.dot(&(p - q));
        let robust = (REACH as f64 * 0.2).powi(2) / ((REACH as f64 * 0.2).powi(2) + value * value);
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
