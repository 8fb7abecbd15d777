//! Where the model stands before anything is fitted: on the scan's floor, in its middle, as tall as it; or with its crown at the
//! scan's top, where the scan shows the upper part of a person.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose};
use toile_geometry::{Mesh, areas::vertex_areas};

use crate::solve::State;

/// One vertex in this many may be a stray point above the crown or below the soles.
const STRAY: usize = 2000;
/// Farthest that a coefficient is set to meet the height, standard deviations.
const FARTHEST_BETA: f64 = 3.0;

/// How much of a person a scan is taken to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// All of it: the scan is as tall as the person.
    Whole,
    /// From the crown down to where the scan ends.
    FromCrown,
}

/// Where the model has to stand for one way up.
pub(crate) struct Placement {
    /// Coefficients that give the model the scan's height.
    beta: Vec<f64>,
    /// The scan's lowest height and the middle of its surface seen from above.
    floor: f64,
    middle: (f64, f64),
}

impl Placement {
    /// `up` turns the scan upright; the model gets `components` coefficients. One that hangs from the crown is an average
    /// person.
    pub fn new(model: &BodyModel, scan: &Mesh, up: &UnitQuaternion<f64>, components: usize, extent: Extent) -> Self {
        let points: Vec<Point3<f64>> = scan.positions.iter().map(|p| up * p.cast::<f64>()).collect();
        let (low, high) = height_range(&points);
        let areas = vertex_areas(scan);
        let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
        let sum: Vector3<f64> = points.iter().zip(&areas).map(|(p, &a)| p.coords * f64::from(a)).sum();
        let middle = (sum.x / total, sum.z / total);
        match extent {
            Extent::Whole => Self { beta: beta_of_height(model, high - low, components), floor: low, middle },
            Extent::FromCrown => {
                let crown = model.mean.iter().fold(0.0, |top, p| f64::max(top, f64::from(p.y)));
                Self { beta: vec![0.0; components], floor: high - crown, middle }
            }
        }
    }

    /// The model at `heading`, upper arms turned by `arms` away from the A-pose (radians, positive raises them), in the
    /// frame of the scan as it lies.
    pub fn state(&self, model: &BodyModel, heading: f64, arms: f64, up: &UnitQuaternion<f64>) -> State {
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

/// Lowest and highest point without the stray ones.
fn height_range(points: &[Point3<f64>]) -> (f64, f64) {
    let mut heights: Vec<f64> = points.iter().map(|p| p.y).collect();
    heights.sort_by(f64::total_cmp);
    let cut = heights.len() / STRAY;
    (heights[cut], heights[heights.len() - 1 - cut])
}

/// The most ordinary coefficients (smallest |β|) that give the model `height`.
fn beta_of_height(model: &BodyModel, height: f64, components: usize) -> Vec<f64> {
    let by_height = |a: &usize, b: &usize| model.mean[*a].y.total_cmp(&model.mean[*b].y);
    let (Some(top), Some(sole)) = ((0..model.mean.len()).max_by(by_height), (0..model.mean.len()).min_by(by_height))
    else {
        return vec![0.0; components];
    };
    let slope: Vec<f64> = model.components.iter().take(components).map(|c| f64::from(c[top].y - c[sole].y)).collect();
    let squared: f64 = slope.iter().map(|s| s * s).sum::<f64>().max(1e-9);
    let missing = height - f64::from(model.mean[top].y - model.mean[sole].y);
    slope.iter().map(|s| (s * missing / squared).clamp(-FARTHEST_BETA, FARTHEST_BETA)).collect()
}
