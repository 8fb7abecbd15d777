//! Landmarks that were set by hand, as terms of the fit (papers 000 §3.1: the joint parameters sought are those that
//! drive the template's skin to the feature points; the difference of the surfaces improves them afterwards).

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint};

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
/// How far the whole body moves while landmarks alone drive it: standard deviations in metres and radians (15°, a third
/// of the way to the next heading that is tried). Landmarks on one limb turn that limb, not the person.
const ROOT_SHIFT: f64 = 0.1;
const ROOT_TURN: f64 = 0.26;
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
        (!self.goals.is_empty()).then(|| Guide { body, goals: self.goals.clone() })
    }
}

/// Guides with what their derivatives need.
pub(crate) struct Guide {
    body: Articulated,
    goals: Vec<Point3<f64>>,
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
    pub fn drive(&self, start: State, prior: &JointPrior) -> Result<State, FittingError> {
        let problem = Driven { guide: self, prior, start: &start, columns: Columns::new(body_joints(), 0) };
        Ok(descend(&problem, start.clone(), ITERATIONS)?.state)
    }
}

/// The pose by landmarks alone.
struct Driven<'a> {
    guide: &'a Guide,
    prior: &'a JointPrior,
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
        self.prior.add(&mut equations, state, &frames, &self.columns);
        let shift = state.pose.translation - self.start.pose.translation;
        (0..3).for_each(|axis| equations.add_single(axis, shift[axis], ROOT_SHIFT));
        let center = self.start.pose.rotation(Joint::Hips);
        JointPrior::hold(Joint::Hips, &center, ROOT_TURN, &mut equations, state, &frames, &self.columns);
        Linearised { equations, frames, bounds: Vec::new() }
    }

    fn is_small(&self, step: &[f64]) -> bool {
        step.iter().all(|d| d.abs() < SMALL_STEP)
    }

    fn solved_for(&self) -> &'static str {
        "the pose by landmarks"
    }
}
