//! The clothed trunk as points with normals.

use nalgebra::{Isometry3, Point3, Vector3};
use toile_character::{Joint, SkinWeights, joint::JOINTS};
use toile_geometry::Mesh;

/// Points that the trunk is made of, about: some 16 mm apart.
const POINTS: usize = 3000;

/// The trunk and thighs of a body, with its clothes pressed on.
pub(super) struct Trunk {
    points: Vec<TrunkPoint>,
}

struct TrunkPoint {
    place: Point3<f64>,
    normal: Vector3<f64>,
    influences: Vec<(usize, f64)>,
}

/// The trunk in a pose.
pub(super) struct PosedTrunk {
    points: Vec<(Point3<f64>, Vector3<f64>)>,
}

impl Trunk {
    /// Of a `body` with `pressed` metres of clothes over each of its vertices.
    pub fn new(body: &Mesh, weights: &SkinWeights, pressed: &[f32]) -> Self {
        let normals = body.vertex_normals();
        let of_trunk = |v: &usize| JOINTS.get(usize::from(weights.joints[*v][0])).is_some_and(|j| is_trunk(*j));
        let all: Vec<usize> = (0..body.positions.len()).filter(of_trunk).collect();
        let point = |&v: &usize| {
            let normal = normals[v].cast::<f64>();
            let influences = weights.of(v).map(|(joint, w)| (usize::from(joint), f64::from(w))).collect();
            TrunkPoint { place: body.positions[v].cast() + normal * f64::from(pressed[v]), normal, influences }
        };
        Self { points: all.iter().step_by(all.len().div_ceil(POINTS).max(1)).map(point).collect() }
    }

    /// Where the joints took it.
    pub fn posed(&self, posed_from_first: &[Isometry3<f64>]) -> PosedTrunk {
        let posed = |point: &TrunkPoint| {
            let (mut place, mut normal) = (Vector3::zeros(), Vector3::zeros());
            for &(joint, w) in &point.influences {
                place += (posed_from_first[joint] * point.place).coords * w;
                normal += posed_from_first[joint] * point.normal * w;
            }
            (Point3::from(place), normal)
        };
        PosedTrunk { points: self.points.iter().map(posed).collect() }
    }
}

impl PosedTrunk {
    /// Height of `p` over the trunk's clothes, metres: negative inside; infinite where there is no trunk.
    pub fn height(&self, p: &Point3<f64>) -> f64 {
        let nearest = self
            .points
            .iter()
            .map(|(q, n)| (p - q, n))
            .min_by(|a, b| a.0.norm_squared().total_cmp(&b.0.norm_squared()));
        nearest.map_or(f64::INFINITY, |(way, normal)| way.norm().copysign(way.dot(normal)))
    }
}

fn is_trunk(joint: Joint) -> bool {
    use Joint::*;
    [Hips, Spine, Chest, UpperChest, LeftUpperLeg, RightUpperLeg].contains(&joint)
}
