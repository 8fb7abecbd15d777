//! Scans of the upper part of a person: what is shown, and which of two fits is believed.
//!
//! A part looks like a very short person to a fit that stands the model on the scan's floor. Where that fit is not believed, the
//! model is hung from the scan's crown instead, as large as people are; whatever it leaves below the scan's lower end was not
//! seen. Only parts with a head are looked for: without one, neither heading nor size is known.

use nalgebra::Point3;
use toile_character::{BodyModel, Joint, Region};
use toile_geometry::{
    Mesh,
    areas::vertex_areas,
    statistics::{Rank, quantile_by},
};

use super::report::{FitReport, PartShown, Verdict};
use crate::solve::State;

/// The tallest scan of a part, metres: a short person (1.5 m) without feet and shins.
const TALLEST: f32 = 1.4;
/// Scan below this share of its vertices is stray, or the rim's own ragged edge.
const STRAY: f64 = 0.01;
/// Scan with less trust than this was closed and not seen.
const SEEN: f32 = 0.5;
/// The body starts to be expected this far over the scan's lower end, metres: a rim is ragged by some pixels.
const RIM: f32 = 0.03;

/// Whether a fit to the whole scan may have been one to a part of a person.
pub(super) fn is_suspected(whole: &FitReport, scan: &Mesh) -> bool {
    let height = scan.bounds().map_or(0.0, |(low, high)| high.y - low.y);
    whole.verdict != Verdict::Trusted && height < TALLEST
}

/// Whether a fit to a part is believed: nothing is wrong with it but that it is one, or that too little is shown.
pub(super) fn is_believed(part: &FitReport) -> bool {
    part.verdict != Verdict::Failed || part.is_too_little
}

impl PartShown {
    /// What a scan shows of the body at `points`, of which `seen` vertices lie on the scan.
    pub(crate) fn new(
        model: &BodyModel,
        state: &State,
        points: &[Point3<f32>],
        seen: &[bool],
        (scan, trust): (&Mesh, &[f32]),
    ) -> Self {
        let mut heights: Vec<f32> =
            scan.positions.iter().zip(trust).filter(|(_, t)| **t > SEEN).map(|(p, _)| p.y).collect();
        let cut = quantile_by(&mut heights, STRAY, Rank::Below).unwrap_or(0.0);
        let areas = vertex_areas(&Mesh::new(points.to_vec(), model.triangles.clone()));
        let share = |is_in: &dyn Fn(usize) -> bool| {
            let of = |takes: &dyn Fn(usize) -> bool| {
                let taken = (0..points.len()).filter(|&v| !model.inner[v] && is_in(v) && takes(v));
                taken.map(|v| f64::from(areas[v])).sum::<f64>()
            };
            of(&|v| seen[v]) / of(&|_| true).max(1e-12)
        };
        let lowest = points.iter().fold(f32::INFINITY, |low, p| low.min(p.y));
        Self {
            from: level(model, state, f64::from(cut)).into(),
            cut_m: f64::from(cut),
            below_m: f64::from(cut - lowest),
            covered: share(&|v| points[v].y > cut + RIM),
            trunk_covered: share(&|v| model.regions[v] == Region::Torso),
        }
    }
}

/// The level of the body that lies nearest to `height`, in words.
fn level(model: &BodyModel, state: &State, height: f64) -> &'static str {
    let at = state.pose.joint_positions(&model.skeleton_at(&state.beta));
    let y = |joint: Joint| at[joint.index()].y;
    let middle = |a: Joint, b: Joint| 0.5 * (y(a) + y(b));
    let levels = [
        ("ankles", y(Joint::LeftFoot)),
        ("shins", middle(Joint::LeftFoot, Joint::LeftLowerLeg)),
        ("knees", y(Joint::LeftLowerLeg)),
        ("thighs", middle(Joint::LeftLowerLeg, Joint::LeftUpperLeg)),
        ("hips", y(Joint::Hips)),
        ("waist", y(Joint::Spine)),
        ("chest", y(Joint::UpperChest)),
        ("shoulders", y(Joint::LeftUpperArm)),
        ("neck", y(Joint::Neck)),
    ];
    let nearest = levels.into_iter().min_by(|a, b| (a.1 - height).abs().total_cmp(&(b.1 - height).abs()));
    nearest.map_or("neck", |l| l.0)
}
