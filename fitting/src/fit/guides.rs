//! Landmarks that were set by hand, as terms of the fit (Magnenat-Thalmann et al. 2004, "Modeling of Bodies
//! and Clothes for Virtual Environments", §3.1: the joint parameters sought are those that
//! drive the template's skin to the feature points; the difference of the surfaces improves them afterwards).

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint, Pose};

use crate::{
    FittingError, HandLandmarks,
    solve::{
        Articulated, Columns, JointPrior, Linearised, NormalEquations, Problem, Residual, State, body_joints, descend,
    },
    surface::Thinned,
};

/// Standard deviation of a landmark that was set by hand, metres: trained people who find the same point on the same
/// person again differ by 5 to 10 mm (observer error in anthropometry).
const PLACED: f64 = 0.008;
/// Distance from which on a landmark pulls no harder, metres (Huber): one that was set on the wrong place then pulls no
/// harder than one that is four standard deviations off, and the surface and the other landmarks outweigh it.
const PULLS_TO: f64 = 0.03;
/// Scale of the misfit of a landmark, metres: about a limb's radius.
const ASTRAY: f64 = 0.05;
/// Standard deviations while landmarks alone drive the pose: of a joint's turn (57°: limits hold, nothing else is known),
/// and of how far the whole body moves (metres) and turns (radians, 9°). Landmarks on one limb turn that limb, not the
/// person.
const JOINT_TURN: f64 = 1.0;
const ROOT_SHIFT: f64 = 0.05;
const ROOT_TURN: f64 = 0.15;
/// Steps that landmarks alone drive the pose: half a turn of a joint takes thirteen.
const ITERATIONS: usize = 30;
/// A step below this ends that, metres and radians: the surface does the rest.
const SMALL_STEP: f64 = 2e-3;

/// Landmarks that were set by hand: vertices of the template and where they belong, metres, in the frame of the fit.
#[derive(Default)]
pub(crate) struct Guides {
    vertices: Vec<u32>,
    goals: Vec<Point3<f64>>,
}

impl Guides {
    /// Landmarks that the model does not have are left out.
    pub fn new(model: &BodyModel, set: &HandLandmarks) -> Self {
        let known = set.iter().filter_map(|(name, at)| Some((model.landmark(name)?, Point3::from(*at))));
        let (vertices, goals) = known.unzip();
        Self { vertices, goals }
    }

    /// The landmarks on a model of `components` shape components; `None` where no landmark was set.
    pub fn on(&self, model: &BodyModel, components: usize) -> Option<Guide> {
        let picked = Thinned::of_vertices(self.vertices.clone());
        let body = Articulated::of_model(model, &picked, components);
        let prior = JointPrior::around(Pose::identity(), JOINT_TURN, &model.mean_skeleton);
        (!self.goals.is_empty()).then(|| Guide { body, goals: self.goals.clone(), prior })
    }
}

/// Guides with what their derivatives need.
pub(crate) struct Guide {
    body: Articulated,
    goals: Vec<Point3<f64>>,
    /// Of the joints while landmarks alone drive the pose.
    prior: JointPrior,
}

impl Guide {
    /// Adds the landmarks' part of the cost.
    pub fn add(&self, equations: &mut NormalEquations, state: &State, columns: &Columns) {
        let posed = self.body.pose(state);
        let mut residuals = Vec::with_capacity(3 * self.goals.len());
        for (vertex, (p, goal)) in posed.points.iter().zip(&self.goals).enumerate() {
            let off = p.cast::<f64>() - goal;
            let weight = (PULLS_TO / off.norm().max(PULLS_TO)) / PLACED.powi(2);
            residuals.extend((0..3).map(|axis| Residual {
                vertex: vertex as u32,
                normal: Vector3::ith(axis, 1.0),
                value: off[axis] as f32,
                weight,
            }));
        }
        equations.add(NormalEquations::accumulate(&residuals, &self.body, &posed, columns));
    }

    /// How far landmarks are astray, 0–1, averaged.
    pub fn misfit(&self, state: &State) -> f64 {
        let posed = self.body.pose(state);
        let squared = posed.points.iter().zip(&self.goals).map(|(p, goal)| (p.cast::<f64>() - goal).norm_squared());
        squared.map(|s| s / (s + ASTRAY * ASTRAY)).sum::<f64>() / self.goals.len().max(1) as f64
    }

    /// The pose that takes the landmarks to where they belong, with the shape as it is and the whole body near where it
    /// stands in `start`.
    ///
    /// # Errors
    /// [`FittingError::Singular`] where the equations have no solution.
    pub fn drive(&self, start: &State) -> Result<State, FittingError> {
        let problem = Driven { guide: self, start, columns: Columns::new(body_joints(), 0) };
        Ok(descend(&problem, start.clone(), ITERATIONS)?.state)
    }
}

/// The pose by landmarks alone.
struct Driven<'a> {
    guide: &'a Guide,
    start: &'a State,
    columns: Columns,
}

impl Problem for Driven<'_> {
    fn columns(&self) -> &Columns {
        &self.columns
    }

    fn linearised(&self, state: &State) -> Linearised {
        let mut equations = NormalEquations::zeros(self.columns.len());
        let frames = self.guide.body.pose(state).frames;
        self.guide.add(&mut equations, state, &self.columns);
        self.guide.prior.add(&mut equations, state, &frames, &self.columns);
        let shift = state.pose.translation - self.start.pose.translation;
        (0..3).for_each(|axis| equations.add_single(axis, shift[axis], ROOT_SHIFT));
        let center = self.start.pose.rotation(Joint::Hips);
        JointPrior::hold(Joint::Hips, &center, ROOT_TURN, &mut equations, state, &frames, &self.columns);
        Linearised { equations, frames, bounds: Vec::new() }
    }

    fn is_small(&self, step: &[f64], _: f64) -> bool {
        step.iter().all(|d| d.abs() < SMALL_STEP)
    }

    fn solved_for(&self) -> &'static str {
        "the pose by landmarks"
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    #[test]
    fn landmarks_on_a_limb_bend_the_limb_and_leave_the_person_standing() {
        let model = BodyModel::load_default().unwrap();
        let names = ["leftKneeFront", "leftAnkleOuter", "leftHeel", "leftToeTip"];
        let mut lifted = Pose::identity();
        *lifted.rotation_mut(Joint::LeftUpperLeg) = UnitQuaternion::from_scaled_axis(Vector3::x() * -1.4);
        *lifted.rotation_mut(Joint::LeftLowerLeg) = UnitQuaternion::from_scaled_axis(Vector3::x() * 1.5);
        let truth = model.posed(&[], &lifted);
        let at = |name: &str| truth[model.landmark(name).unwrap() as usize];
        let set = names.iter().map(|n| ((*n).to_owned(), at(n).cast::<f64>().into())).collect();
        let guide = Guides::new(&model, &set).on(&model, 0).unwrap();
        let found = guide.drive(&State { pose: Pose::identity(), beta: Vec::new() }).unwrap().pose;
        let posed = model.posed(&[], &found);
        for name in names {
            let off = (posed[model.landmark(name).unwrap() as usize] - at(name)).norm();
            assert!(off < 0.02, "{name} is {off} m off");
        }
        let crown = model.landmark("vertex").unwrap() as usize;
        let moved = (posed[crown] - model.mean[crown]).norm();
        assert!(moved < 0.15, "the crown moved by {moved} m");
        assert!(guide.misfit(&State { pose: found, beta: Vec::new() }) < 0.1);
    }
}
