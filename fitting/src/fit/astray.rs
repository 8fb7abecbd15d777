//! What body and scan leave of each other: scan that no part of the body lies at, and skin that lies where no scan is.

use rayon::prelude::*;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    guides::Guides,
    problem::BodyProblem,
    resolution::{Resolutions, Sampled},
};
use crate::{
    FitSettings, FittingError,
    solve::{JointPrior, State},
    surface::{Cloud, Samples},
};

/// Farther than this from each other scan and skin do not belong together, metres: twice what a body of twelve
/// components is off, less than half the thickness of an arm.
const APART: f32 = 0.03;
/// Smallest cosine between the normals of what belongs together.
const SAME_SIDE: f32 = 0.0;
/// Winding number from which on a point is surely inside, holes or not.
const SURE: f32 = 0.85;
/// Shares from which on a start is wrong: a hand's back.
const UNEXPLAINED: f64 = 0.004;
const BURIED: f64 = 0.004;

/// Shares of areas, 0–1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Astray {
    /// Of the trusted scan without skin near it.
    pub unexplained: f64,
    /// The same without what lies nearest to the head: hair is no limb.
    pub limbs_unexplained: f64,
    /// Of the skin that lies deep inside the scan.
    pub buried: f64,
    /// The same of the region of which most is buried, but for the head, which hair may cover.
    pub region_buried: f64,
}

impl Astray {
    /// Of the body at `state`; `bvh` is over the scan's triangles.
    pub fn new(model: &BodyModel, sampled: &Sampled, problem: &BodyProblem, bvh: &Bvh, state: &State) -> Self {
        let posed = problem.body.pose(state);
        let far = |v: usize| problem.scan.nearest(&posed.points[v], &posed.normals[v], APART, SAME_SIDE).is_none();
        let winding = |v: usize| if far(v) { bvh.winding_number(&posed.points[v]) } else { 0.5 };
        let windings: Vec<f32> = (0..problem.body.len()).into_par_iter().with_min_len(64).map(winding).collect();
        let region = |v: usize| model.regions[sampled.vertices[v] as usize];
        let share = |is_part: &dyn Fn(usize) -> bool, is_lost: &dyn Fn(f32) -> bool| {
            let area = |v: usize| f64::from(problem.body.areas[v]);
            let part = || (0..problem.body.len()).filter(|&v| is_part(v));
            let lost: f64 = part().filter(|&v| is_lost(windings[v])).map(area).sum();
            lost / part().map(area).sum::<f64>().max(1e-12)
        };
        let most = |is_lost: &dyn Fn(f32) -> bool| {
            let regions = Region::ALL.into_iter().filter(|r| *r != Region::Head);
            regions.map(|r| share(&|v| region(v) == r, is_lost)).fold(0.0, f64::max)
        };
        let is_buried = |w: f32| w > SURE;
        let skin = Samples { points: posed.points.clone(), normals: posed.normals.clone(), ..Samples::default() };
        let [unexplained, limbs_unexplained] =
            Cloud::new(skin).map_or([1.0; 2], |skin| left_over(&sampled.reverse, &skin, |v| region(v) == Region::Head));
        Self { unexplained, limbs_unexplained, buried: share(&|_| true, &is_buried), region_buried: most(&is_buried) }
    }

    /// Of a finished fit; `scan` has normals.
    ///
    /// # Errors
    /// [`FittingError::Scan`] where no triangle of the scan has an area.
    pub fn of_fit(
        model: &BodyModel,
        (scan, trust, bvh): (&Mesh, &[f32], &Bvh),
        settings: &FitSettings,
        state: &State,
    ) -> Result<Self, FittingError> {
        let heading = Resolutions::new(settings).heading.with_components(state.beta.len());
        let sampled = Sampled::new(model, scan, trust, &Guides::default(), heading)?;
        let prior = JointPrior::standing(&model.mean_skeleton);
        Ok(Self::new(model, &sampled, &sampled.problem(&prior, settings.shape_sigma), bvh, state))
    }

    /// Whether a part of the body lies in another place.
    pub fn is_wrong(&self) -> bool {
        self.unexplained > UNEXPLAINED || self.buried > BURIED
    }
}

/// Share of the scan without skin near it: of all of it, and without what lies nearest to the head.
fn left_over(scan: &Samples, skin: &Cloud, is_head: impl Fn(usize) -> bool + Sync) -> [f64; 2] {
    let is_far = |k: &usize| skin.nearest(&scan.points[*k], &scan.normals[*k], APART, SAME_SIDE).is_none();
    let left: Vec<usize> = (0..scan.points.len()).into_par_iter().with_min_len(128).filter(is_far).collect();
    let is_limb = |k: &usize| {
        let nearest = skin.nearest(&scan.points[*k], &scan.normals[*k], f32::INFINITY, -1.0);
        nearest.is_none_or(|v| !is_head(v as usize))
    };
    let area = |k: usize| f64::from(scan.weights[k]);
    let total = (0..scan.points.len()).map(area).sum::<f64>().max(1e-12);
    let limbs: f64 = left.iter().copied().filter(is_limb).map(area).sum();
    [left.into_iter().map(area).sum::<f64>() / total, limbs / total]
}
