//! Gauss–Newton on a skinned surface: the unknowns, their derivatives, the equations, and the one loop that solves them.

mod articulated;
mod bounds;
mod descend;
mod equations;
mod gate;
mod point_to_point;
mod prior;
mod state;

pub(crate) use articulated::{Articulated, Posed};
pub(crate) use descend::{Descent, Linearised, Problem, descend};
pub(crate) use equations::{NormalEquations, Residual};
pub(crate) use gate::{Cloth, Gate, INDEPENDENT};
pub(crate) use point_to_point::{Norm, PointToPoint};
pub(crate) use prior::{JointPrior, add_shape_prior};
pub(crate) use state::{Columns, State, body_joints, main_joints};
