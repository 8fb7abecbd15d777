//! Where a fit begins: the scan's front, up and arm angles are unknown, so several starts compete.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Joint, Pose};
use toile_geometry::Mesh;

use crate::{
    FitSettings, FittingError,
    arms::found_arms,
    articulated::{Articulated, Columns, State},
    cloud::{Cloud, Samples},
    correspond::{Gate, inside, matches},
    level::{Level, LevelResult, main_joints},
    prior::JointPrior,
    thin::Thinned,
};

/// Turns of the upper arms away from the A-pose that are tried, degrees; positive raises the arms.
const ARM_TURNS: [f64; 3] = [0.0, -25.0, 35.0];
/// How many starts are refined.
const REFINED: usize = 4;
/// Components of the coarse shape.
const COARSE_COMPONENTS: usize = 4;

/// A coarse fit of one start.
pub(crate) struct Start {
    pub state: State,
    /// Index of the up rotation it stands by.
    pub up: usize,
    /// Coarse misfit 0–1.
    pub misfit: f64,
    pub iterations: usize,
}

/// The best coarse fits, best first.
pub(crate) fn starts(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    ups: &[UnitQuaternion<f64>],
    settings: &FitSettings,
) -> Result<Vec<Start>, FittingError> {
    let cloud = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, 0.03)).ok_or_else(no_surface)?;
    let reverse = Samples::of_mesh(scan, &scan.normals, trust, 0.045);
    let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
    let picked = Thinned::new(&mesh, &mesh.vertex_normals(), 0.05, |v| !model.inner[v]);
    let body = Articulated::of_model(model, &picked, COARSE_COMPONENTS);
    let gate = Gate { distance: 0.25, slip: 0.12, min_cos: 0.3, kernel: 0.06, noise: 0.02, inside: inside(settings) };
    let level = Level {
        body: &body,
        scan: &cloud,
        reverse: &reverse,
        gate,
        columns: Columns::new(main_joints(), COARSE_COMPONENTS),
        iterations: 10,
        shape_sigma: 1.0,
        rooted: false,
    };
    let candidates = candidates(model, scan, &level, ups, settings.headings);
    let prior = JointPrior::standing(&model.mean_skeleton);
    let mut refined: Vec<Start> = candidates
        .into_par_iter()
        .map(|c| {
            let first = level.run(c.state, &prior)?;
            let Some(state) = found_arms(&level, &first.state) else { return Ok(refined(first, c.up)) };
            let mut again = level.run(state, &prior)?;
            again.iterations += first.iterations;
            Ok(refined(if again.matches.misfit < first.matches.misfit { again } else { first }, c.up))
        })
        .collect::<Result<_, FittingError>>()?;
    refined.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    Ok(refined)
}

fn no_surface() -> FittingError {
    FittingError::Scan("its triangles have no area; scan the subject again".into())
}

fn refined(result: LevelResult, up: usize) -> Start {
    Start { state: result.state, up, misfit: result.matches.misfit, iterations: result.iterations }
}

/// All starts judged without moving them; the best for each heading and up, the most promising few.
fn candidates(
    model: &BodyModel,
    scan: &Mesh,
    level: &Level,
    ups: &[UnitQuaternion<f64>],
    headings: usize,
) -> Vec<Start> {
    let places: Vec<Placement> = ups.iter().map(|up| Placement::new(model, scan, up)).collect();
    let turns: Vec<(usize, usize)> = (0..ups.len()).flat_map(|u| (0..headings.max(1)).map(move |h| (u, h))).collect();
    let mut best: Vec<Start> = turns
        .into_par_iter()
        .map(|(up, h)| {
            let heading = TAU * h as f64 / headings.max(1) as f64;
            let judged = ARM_TURNS.map(|arms| {
                let state = places[up].state(model, heading, arms.to_radians(), &ups[up]);
                let found = matches(level.body, &level.body.pose(&state), level.scan, level.reverse, &level.gate);
                Start { state, up, misfit: found.misfit, iterations: 0 }
            });
            judged.into_iter().reduce(|a, b| if b.misfit < a.misfit { b } else { a })
        })
        .flatten()
        .collect();
    best.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    best.truncate(REFINED);
    best
}

/// Where the model has to stand for one way up.
struct Placement {
    /// Coefficients that give the model the scan's height.
    beta: Vec<f64>,
    /// The scan's lowest height and the middle of its surface seen from above.
    floor: f64,
    middle: (f64, f64),
}

impl Placement {
    fn new(model: &BodyModel, scan: &Mesh, up: &UnitQuaternion<f64>) -> Self {
        let points: Vec<Point3<f64>> = scan.positions.iter().map(|p| up * p.cast::<f64>()).collect();
        let (low, high) = height_range(&points);
        let areas = crate::cloud::vertex_areas(scan);
        let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
        let sum: Vector3<f64> = points.iter().zip(&areas).map(|(p, &a)| p.coords * f64::from(a)).sum();
        Self {
            beta: beta_of_height(model, high - low, COARSE_COMPONENTS),
            floor: low,
            middle: (sum.x / total, sum.z / total),
        }
    }

    fn state(&self, model: &BodyModel, heading: f64, arms: f64, up: &UnitQuaternion<f64>) -> State {
        let skeleton = model.skeleton_at(&self.beta);
        let mut pose = Pose::identity();
        *pose.rotation_mut(Joint::LeftUpperArm) = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), arms);
        *pose.rotation_mut(Joint::RightUpperArm) = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -arms);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), heading);
        let stand = Isometry3::from_parts(Translation3::new(self.middle.0, self.floor, self.middle.1), turn);
        let lie = Isometry3::from_parts(Translation3::identity(), up.inverse());
        State { pose: pose.moved(&(lie * stand), &skeleton), beta: self.beta.clone() }
    }
}

/// Lowest and highest point without a few stray ones.
fn height_range(points: &[Point3<f64>]) -> (f64, f64) {
    let mut heights: Vec<f64> = points.iter().map(|p| p.y).collect();
    heights.sort_by(f64::total_cmp);
    let cut = heights.len() / 2000;
    (heights[cut], heights[heights.len() - 1 - cut])
}

/// The least unusual coefficients (smallest |β|) that give the model `height`, at most three deviations out.
fn beta_of_height(model: &BodyModel, height: f64, components: usize) -> Vec<f64> {
    let by_height = |a: &usize, b: &usize| model.mean[*a].y.total_cmp(&model.mean[*b].y);
    let (Some(top), Some(sole)) = ((0..model.mean.len()).max_by(by_height), (0..model.mean.len()).min_by(by_height))
    else {
        return vec![0.0; components];
    };
    let slope: Vec<f64> = model.components.iter().take(components).map(|c| f64::from(c[top].y - c[sole].y)).collect();
    let squared: f64 = slope.iter().map(|s| s * s).sum::<f64>().max(1e-9);
    let missing = height - f64::from(model.mean[top].y - model.mean[sole].y);
    slope.iter().map(|s| (s * missing / squared).clamp(-3.0, 3.0)).collect()
}
