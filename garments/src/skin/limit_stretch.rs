//! Cloth that no stride tears: skin weights are evened out where a triangle would stretch too far.
//!
//! Weights that were smoothed over a surface still change fast across its slivers and crumples, as between the legs of
//! a skirt. The stretch is measured in a few strides. The weights of a triangle that stretches too far are drawn to their
//! mean, again and again, as strain limiting does with positions: neighbours take over the rest.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{FREE_PART, Joint, Pose, Skeleton, SkinWeights, skinning};
use toile_geometry::{Mesh, rims::grow, topology::VertexNeighbors};

use super::{
    influences::{Row, push_continuous, row},
    stretch::stretches,
};

/// No triangle may become this many times as long in any direction.
const MAX_STRETCH: f32 = 2.5;
/// Rings of vertices around a triangle that may take over.
const RINGS: usize = 8;
/// Limit of the times that all triangles are looked at.
const PASSES: usize = 4;
/// Limit of the times that weights are drawn together before all are looked at again.
const SWEEPS: usize = 60;
/// Bends of the legs, degrees: hips forward and knee of one leg, then of the other. Those of a jog, which any walker can
/// reach.
const STRIDES: [[f64; 4]; 3] = [[50.0, 20.0, -25.0, 10.0], [40.0, 90.0, 0.0, 0.0], [10.0, 60.0, -20.0, 40.0]];

/// Evens out `weights` of `mesh` (in `pose0`) until no stride stretches a triangle beyond [`MAX_STRETCH`], as far as that
/// is possible. Returns the largest stretch before and after. Weights elsewhere stay to the bit, and so do all weights of
/// a garment without [`FREE_PART`]: it goes where the skin below it goes, which would otherwise cut through it.
pub(super) fn limit_stretch(mesh: &Mesh, weights: &mut SkinWeights, skeleton: &Skeleton, pose0: &Pose) -> [f32; 2] {
    if !mesh.attributes.contains_key(FREE_PART) {
        return [1.0; 2];
    }
    let strides = strides(pose0);
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let worst = |stretch: &[f32]| stretch.iter().copied().fold(1.0, f32::max);
    let mut stretch = maximum_stretches(mesh, weights, skeleton, pose0, &strides);
    let before = worst(&stretch);
    for _ in 0..PASSES {
        let over = mesh.triangles.iter().zip(&stretch).filter(|(_, s)| **s > MAX_STRETCH);
        let seeds: Vec<u32> = over.flat_map(|(t, _)| *t).collect();
        if seeds.is_empty() {
            break;
        }
        let mut near = vec![false; mesh.positions.len()];
        grow(seeds, &neighbors, RINGS).iter().for_each(|&v| near[v as usize] = true);
        let (part, old_of_new) = mesh.filter_triangles(|t| mesh.triangles[t].iter().all(|&v| near[v as usize]));
        let mut of_part = weights.gather(&old_of_new);
        for _ in 0..SWEEPS {
            let stretch = maximum_stretches(&part, &of_part, skeleton, pose0, &strides);
            if worst(&stretch) <= MAX_STRETCH {
                break;
            }
            of_part = drawn_together(&part, &of_part, &stretch);
        }
        for (new, &old) in old_of_new.iter().enumerate() {
            (weights.joints[old as usize], weights.weights[old as usize]) = (of_part.joints[new], of_part.weights[new]);
        }
        stretch = maximum_stretches(mesh, weights, skeleton, pose0, &strides);
    }
    [before, worst(&stretch)]
}

/// Poses of both legs in a stride, the rest as in `pose0`.
fn strides(pose0: &Pose) -> Vec<Pose> {
    let legs = [[Joint::LeftUpperLeg, Joint::LeftLowerLeg], [Joint::RightUpperLeg, Joint::RightLowerLeg]];
    let bent = |degrees: f64| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), degrees.to_radians());
    let pose = |[front, back]: [[Joint; 2]; 2], [hip, knee, other_hip, other_knee]: [f64; 4]| {
        let mut pose = pose0.clone();
        // Forward is +Z: a thigh swings there by a negative turn about +X, and a knee bends the other way.
        for (joint, degrees) in [(front[0], -hip), (front[1], knee), (back[0], -other_hip), (back[1], other_knee)] {
            *pose.rotation_mut(joint) = bent(degrees);
        }
        pose
    };
    STRIDES.iter().flat_map(|s| [pose(legs, *s), pose([legs[1], legs[0]], *s)]).collect()
}

/// The largest stretch of each triangle in any of `poses`.
fn maximum_stretches(
    mesh: &Mesh,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose0: &Pose,
    poses: &[Pose],
) -> Vec<f32> {
    let rest = skinning::unskin(&mesh.positions, weights, &pose0.skinning_transforms(skeleton));
    let mut most = vec![0.0f32; mesh.triangles.len()];
    for pose in poses {
        let posed = skinning::skin(&rest, weights, &pose.skinning_transforms(skeleton));
        most.iter_mut().zip(stretches(mesh, &posed)).for_each(|(most, s)| *most = most.max(s));
    }
    most
}

/// Draws the weights of the corners of each triangle that stretches too far to their mean, in proportion to the excess.
fn drawn_together(mesh: &Mesh, weights: &SkinWeights, stretch: &[f32]) -> SkinWeights {
    let mut rows: Vec<Row> = (0..weights.len()).map(|v| row(weights, v)).collect();
    let mut changed = vec![false; rows.len()];
    for (corners, &s) in mesh.triangles.iter().zip(stretch).filter(|(_, s)| **s > MAX_STRETCH) {
        let keep = MAX_STRETCH / s;
        let mean: Row = std::array::from_fn(|j| corners.iter().map(|&v| rows[v as usize][j]).sum::<f32>() / 3.0);
        for &v in corners {
            rows[v as usize].iter_mut().zip(mean).for_each(|(w, mean)| *w = mean + keep * (*w - mean));
        }
        corners.iter().for_each(|&v| changed[v as usize] = true);
    }
    let mut out = SkinWeights::default();
    for (v, row) in rows.into_iter().enumerate() {
        if changed[v] {
            push_continuous(&mut out, (0u8..).zip(row));
        } else {
            out.joints.push(weights.joints[v]);
            out.weights.push(weights.weights[v]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_character::BodyModel;

    use super::*;

    /// A sheet between the legs, from left to right at knee height, with one row of slivers in its middle.
    fn sheet() -> Mesh {
        let (columns, rows) = (41u32, 20u32);
        let at = |i: u32| {
            let (x, y) = (i % columns, i / columns);
            let x = if x == 20 { 0.0004 } else { (x as f32 - 20.0) * 0.006 };
            Point3::new(x, 0.45 + y as f32 * 0.006, 0.0)
        };
        let triangles = (0..rows - 1)
            .flat_map(|j| (0..columns - 1).map(move |i| j * columns + i))
            .flat_map(|a| [[a, a + 1, a + columns + 1], [a, a + columns + 1, a + columns]])
            .collect();
        let mut mesh = Mesh::new((0..columns * rows).map(at).collect(), triangles);
        mesh.attributes.insert(FREE_PART.into(), vec![1.0; mesh.positions.len()]);
        mesh
    }

    #[test]
    fn a_sheet_between_the_legs_is_not_torn_and_its_ends_stay() {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let (mesh, pose0) = (sheet(), Pose::identity());
        // From one leg to the other, but a fifth of the way within one column.
        let mut weights = SkinWeights::default();
        for p in &mesh.positions {
            let left = 0.5 + 1.5 * p.x + 0.1 * p.x.signum();
            weights
                .push(&[(Joint::LeftUpperLeg.index() as u8, left), (Joint::RightUpperLeg.index() as u8, 1.0 - left)]);
        }
        let given = weights.clone();
        let [before, after] = limit_stretch(&mesh, &mut weights, &skeleton, &pose0);
        assert!(before > 5.0 && after <= MAX_STRETCH * 1.01, "{before} {after}");
        for v in (0..weights.len()).filter(|&v| mesh.positions[v].x.abs() > 0.11) {
            assert_eq!((weights.joints[v], weights.weights[v]), (given.joints[v], given.weights[v]));
        }
        assert_eq!(limit_stretch(&mesh, &mut weights, &skeleton, &pose0)[0], after);
        let (mut close, mut weights) = (mesh, given.clone());
        close.attributes.clear();
        limit_stretch(&close, &mut weights, &skeleton, &pose0);
        assert_eq!(weights, given);
    }
}
